"""A scene as a function of a few of its numbers: what was measured, as the model has it, with derivatives."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from .._base._compiling import DeviceJit
from .._base._faults import Fault, InputError
from .._parts._scene import Scene
from .._run._edit import with_values
from .._run._measure import Metric, measure
from .._run._outcome import FAILURES
from .._run._simulate import simulate, step_limits
from ..hybrid import Code
from ..hybrid._arrays import Array
from ._measured import Measured, Points, pick


class Plan(NamedTuple):
    """What a compiled program depends on, besides the structure of the scene and the number of measured values."""

    paths: tuple[str, ...]
    columns: tuple[tuple[str, str | None], ...]
    metrics: tuple[Metric, ...]
    solver: Any
    max_steps: int


def _model(theta: Array, scene: Scene, rtol: Any, ts: Array, rows: tuple[Array, ...], plan: Plan) -> Any:
    changed = with_values(scene, dict(zip(plan.paths, theta, strict=True)))
    result = simulate(changed, solver=plan.solver, rtol=rtol, max_steps=plan.max_steps)
    parts, faults = [], []
    if plan.columns:
        series = result.series(ts)
        for (column, entry), row in zip(plan.columns, rows, strict=True):
            found = pick(result, series, column, entry)
            if isinstance(found, Fault):
                faults.append(found)
            else:
                parts.append(found[row])
    if faults:  # seen while it is traced, before anything runs
        raise InputError(faults)
    parts += [jnp.reshape(measure(result, metric), (1,)) for metric in plan.metrics]
    values = jnp.concatenate(parts)
    return values, (values, result.code)


def _with_jacobian(theta: Array, scene: Scene, rtol: Any, ts: Array, rows: tuple[Array, ...], plan: Plan) -> Any:
    return jax.jacfwd(_model, has_aux=True)(theta, scene, rtol, ts, rows, plan)


_program = DeviceJit(_with_jacobian, static_argnames=("plan",))


class Evaluation(NamedTuple):
    """Model values (m,) and their derivatives (m, p) at a point; `refused`: why it counts as a bad one."""

    values: np.ndarray
    jacobian: np.ndarray
    refused: str | None


class FitModel:
    """Measured quantities of a scene as a function of the numbers at `paths`.

    One compiled program gives values and Jacobian; it is kept by structure, and new numbers never re-trace.
    """

    def __init__(
        self, scene: Scene, paths: tuple[str, ...], data: Measured, *, solver: Any, rtol: float, max_steps: int | None
    ):
        self.scene = jax.tree.map(jnp.asarray, scene)
        self.rtol = jnp.asarray(rtol, jnp.float64)
        self.ladder = step_limits(scene, max_steps)
        columns = tuple((part.column, part.entry) for part in data.points)
        metrics = tuple(one.metric for one in data.singles)
        self.plan = Plan(paths, columns, metrics, solver, self.ladder[0])
        times = [part.t for part in data.points]
        ts = np.unique(np.concatenate(times)) if times else np.zeros(0)
        self.ts = jnp.asarray(ts)
        self.rows = tuple(jnp.asarray(np.searchsorted(ts, t), jnp.int32) for t in times)
        self.names = [part.name for part in data.points for _ in part.t] + [one.name for one in data.singles]
        self.evaluations = 0
        self.failures: dict[str, int] = {}

    def __call__(self, theta: np.ndarray) -> Evaluation:
        """Values and Jacobian; a run that fails or lacks a measured event is refused with its reason."""
        self.evaluations += 1
        jacobian, (values, code) = _program(
            jnp.asarray(theta), self.scene, self.rtol, self.ts, self.rows, plan=self.plan
        )
        if int(code) == Code.STEP_LIMIT and self.plan.max_steps != self.ladder[-1]:
            longer = self.ladder[self.ladder.index(self.plan.max_steps) + 1]
            self.plan = self.plan._replace(max_steps=longer)
            self.evaluations -= 1
            return self(theta)
        found = Evaluation(np.asarray(values), np.asarray(jacobian), None)
        reason = self._refused(found, int(code))
        if reason is not None:
            self.failures[reason] = self.failures.get(reason, 0) + 1
        return found._replace(refused=reason)

    def _refused(self, found: Evaluation, code: int) -> str | None:
        if code != 0:
            return f"the run fails: {FAILURES[code][0]}"  # pyright: ignore
        for i in np.flatnonzero(~np.isfinite(found.values)):
            what = "does not occur" if np.isinf(found.values[i]) else "is not a number"
            return f"{self.names[i]} {what} in the model"
        for i in np.flatnonzero(~np.isfinite(found.jacobian).all(axis=1)):
            return f"the derivative of {self.names[i]} is not finite"
        return None


def measured_arrays(data: Measured) -> tuple[np.ndarray, np.ndarray]:
    """All measured values (m,) and their standard deviations, 1 where nobody knows them, in the order of the model."""
    parts: list[Any] = [*data.points, *data.singles]
    value = [np.atleast_1d(part.value) for part in parts]
    sigma = [np.broadcast_to(1.0 if p.sigma is None else p.sigma, v.shape) for p, v in zip(parts, value, strict=True)]
    return np.concatenate(value), np.concatenate(sigma)


def slices(data: Measured) -> list[tuple[Any, slice]]:
    """Every column and single value with its place among all values."""
    found, start = [], 0
    for part in (*data.points, *data.singles):
        end = start + (part.t.size if isinstance(part, Points) else 1)
        found.append((part, slice(start, end)))
        start = end
    return found
