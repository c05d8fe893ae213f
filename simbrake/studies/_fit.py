"""The search of a fit: a scene's measured quantities as a function of its numbers, and bounded least squares on it."""

from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from .._base._faults import Fault, InputError
from .._base._identify import cost
from .._base._progress import Waiting
from .._parts._scene import Scene
from .._run._log import FAILURES
from .._run._measure import Metric, measure
from .._run._result import Result
from ..hybrid._arrays import Array
from ._evaluator import Evaluation, Evaluator, Paths
from ._measured import Measured, Points, pick


class Asked(NamedTuple):
    """What was measured: columns with the entry of each, at some of the times given, and metrics."""

    columns: tuple[tuple[str, str | None], ...]
    metrics: tuple[Metric, ...]

    def __call__(self, result: Result, given: tuple[Array, tuple[Array, ...]]) -> tuple[Array, None]:
        ts, rows = given
        parts, faults = [], []
        if self.columns:
            series = result.series(ts)
            for (column, entry), row in zip(self.columns, rows, strict=True):
                found = pick(result, series, column, entry)
                if isinstance(found, Fault):
                    faults.append(found)
                else:
                    parts.append(found[row])
        if faults:  # seen while it is traced, before anything runs
            raise InputError(faults)
        parts += [jnp.reshape(measure(result, metric), (1,)) for metric in self.metrics]
        return jnp.concatenate(parts), None


class FitModel:
    """Measured quantities of a scene as a function of the numbers at `paths`, with derivatives."""

    def __init__(
        self, scene: Scene, paths: tuple[str, ...], data: Measured, *, solver: Any, rtol: float, max_steps: int | None
    ):
        times = [part.t for part in data.points]
        ts = np.unique(np.concatenate(times)) if times else np.zeros(0)
        asked = Asked(tuple((part.column, part.entry) for part in data.points), tuple(s.metric for s in data.singles))
        self.run = Evaluator(
            scene,
            Paths.each(paths),
            asked,
            given=(ts, tuple(np.searchsorted(ts, t).astype(np.int32) for t in times)),
            solver=solver,
            rtol=rtol,
            max_steps=max_steps,
        )
        self.paths = paths
        self.names = [part.name for part in data.points for _ in part.t] + [one.name for one in data.singles]
        self.failures: dict[str, int] = {}

    def __call__(self, theta: np.ndarray) -> Evaluation:
        """Values (m,) and Jacobian (m, p)."""
        before, found = self.run.runs, self.run(theta)
        reason = self.refused(found)
        if reason is not None and self.run.runs > before:
            self.failures[reason] = self.failures.get(reason, 0) + 1
        return found

    def refused(self, found: Evaluation) -> str | None:
        """Why a point counts as a bad one: its run fails, or it lacks a measured event; `None` for a good one."""
        if found.code != 0:
            return f"the run fails: {FAILURES[found.code][0]}"  # pyright: ignore
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


#: a parameter that ends this close to a bound (over the range), and is pressed on it, is put there
_NEAR = 1e-3


class Scale(NamedTuple):
    """Parameters over the range of their bounds: `z` in 0…1, linear or logarithmic."""

    low: np.ndarray
    high: np.ndarray
    logarithmic: np.ndarray

    def up(self, z: np.ndarray) -> np.ndarray:
        safe = np.where(self.logarithmic, self.low, 1.0)
        ratio = np.where(self.logarithmic, self.high / safe, 1.0)
        return np.where(self.logarithmic, safe * ratio**z, self.low + (self.high - self.low) * z)

    def down(self, theta: np.ndarray) -> np.ndarray:
        safe = np.where(self.logarithmic, self.low, 1.0)
        ratio = np.where(self.logarithmic, self.high / safe, np.e)
        log = np.log(np.where(self.logarithmic, theta / safe, 1.0)) / np.log(ratio)
        return np.where(self.logarithmic, log, (theta - self.low) / (self.high - self.low))

    def slope(self, theta: np.ndarray) -> np.ndarray:
        """`dθ/dz`."""
        ratio = self.high / np.where(self.logarithmic, self.low, self.high)
        return np.where(self.logarithmic, theta * np.log(ratio), self.high - self.low)


class Search:
    """Least squares from one or more starts, all points evaluated once."""

    def __init__(
        self,
        model: FitModel,
        scale: Scale,
        measured: np.ndarray,
        sigma: np.ndarray,
        loss: str,
        loss_scale: float,
        method: str,
        most: int,
        starts: int,
    ):
        self.model, self.scale, self.loss, self.loss_scale = model, scale, loss, loss_scale
        self.method, self.most, self.starts = method, most, starts
        self.measured, self.sigma = measured, sigma
        self.progress, self.least = Waiting("calibrate", "compiles"), np.inf
        self.best: tuple[float, np.ndarray, Evaluation] | None = None
        self.ends: list[tuple[float, np.ndarray]] = []
        self.converged, self.message = False, ""

    def look(self, z: np.ndarray) -> tuple[Evaluation, str | None]:
        """The model at a point, and why the point counts as a bad one."""
        before, found = self.model.run.runs, self.model(self.scale.up(z))
        refused = self.model.refused(found)
        if refused is None and self.model.run.runs > before:
            if self.best is None or self.cost(found) < self.best[0]:
                self.best = (self.cost(found), z.copy(), found)
            self._show(float(np.sum(self.residual(found) ** 2)))
        return found, refused

    def _show(self, chi2: float) -> None:
        self.least, count, most = min(self.least, chi2), self.model.run.runs, self.most * self.starts
        # a search mostly ends long before its limit: what is left is told as a bound
        self.progress.now("run", min(count, most), most, bound=True, also=f", chi² {self.least:.6g}")

    def residual(self, found: Evaluation) -> np.ndarray:
        return (found.values - self.measured) / self.sigma

    def jacobian(self, z: np.ndarray, found: Evaluation) -> np.ndarray:
        return found.jacobian * self.scale.slope(self.scale.up(z)) / self.sigma[:, None]

    def cost(self, found: Evaluation) -> float:
        return cost(self.residual(found), self.loss, self.loss_scale)

    def run(self, first: np.ndarray) -> None:
        self.progress.__enter__()
        try:
            for k, z in enumerate(self._spread(first)):
                refused = self.look(z)[1]
                if refused is None:
                    self._descend(z)
                elif k == 0 and self.starts == 1:
                    hint = "give another start, or try several (starts=8)"
                    hint = f"raise end_time, {hint}" if "does not occur" in refused else hint
                    raise InputError([Fault("start", refused, hint)])
        except KeyboardInterrupt:
            if self.best is None:
                raise
            self.converged, self.message = False, "interrupted: this is the best point found so far"
        finally:
            self.progress.__exit__()
        if self.best is None:
            reasons = [Fault("start", reason, f"{n} of the starts") for reason, n in self.model.failures.items()]
            raise InputError(reasons)

    def _spread(self, first: np.ndarray) -> list[np.ndarray]:
        if self.starts == 1:
            return [first]
        from scipy.stats import qmc  # heavy, and hardly ever needed

        halton = qmc.Halton(first.size, scramble=False)
        halton.fast_forward(1)
        return [first, *halton.random(self.starts - 1)]

    def _descend(self, z: np.ndarray) -> None:
        """From one start to its minimum; what is pressed on a bound is put there, and the rest searched again."""
        assert self.best is not None
        free = np.ones(z.size, bool)
        z, cost, converged, message = self._minimise(z, free)
        while (pressed := self.pressed(z) & free).any():
            on = np.where(pressed, np.round(z), z)
            found, refused = self.look(on)
            if refused is not None or self.cost(found) > cost * (1 + 1e-9):
                break
            free = free & ~pressed
            z, cost, converged, message = self._minimise(on, free)
        if cost <= self.best[0] * (1 + 1e-9):  # the end itself, not a neighbour that is better by rounding
            self.best = (cost, z, self.look(z)[0])
        if not self.ends or cost <= min(end[0] for end in self.ends):
            self.converged, self.message = converged, message
        self.ends.append((cost, z))

    def pressed(self, z: np.ndarray) -> np.ndarray:
        found = self.look(z)[0]
        r, J = self.residual(found), self.jacobian(z, found)
        push = J.T @ r
        strong = np.abs(push) > 1e-8 * np.linalg.norm(J, axis=0) * np.linalg.norm(r)
        return strong & (((z < _NEAR) & (push > 0)) | ((z > 1 - _NEAR) & (push < 0)))

    def _minimise(self, z: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, float, bool, str]:
        from scipy.optimize import least_squares  # not paid for by those who only simulate

        def whole(x: np.ndarray) -> np.ndarray:
            full = z.copy()
            full[free] = x
            return full

        barrier: str | None = None  # why trial points near the best one were refused
        least = np.inf

        def residual(x: np.ndarray) -> np.ndarray:
            nonlocal barrier, least
            found, refused = self.look(whole(x))
            if refused is not None:
                barrier = refused
                return np.full(self.measured.shape, np.inf)
            if self.cost(found) < least * (1 - 1e-6):  # left behind
                barrier, least = None, self.cost(found)
            return self.residual(found)

        def jacobian(x: np.ndarray) -> np.ndarray:
            return self.jacobian(whole(x), self.look(whole(x))[0])[:, free]

        if not free.any():
            return z, self.cost(self.look(z)[0]), True, "every parameter is at a bound"
        found = least_squares(
            residual,
            np.clip(z[free], 0.0, 1.0),
            jacobian,  # pyright: ignore
            bounds=(0.0, 1.0),
            method=self.method,  # pyright: ignore
            loss=self.loss,  # pyright: ignore
            f_scale=self.loss_scale,
            x_scale="jac",
            ftol=1e-14,
            xtol=1e-12,
            gtol=1e-12,
            max_nfev=self.most,
        )
        z, words = whole(found.x), {0: "the limit of evaluations was reached", 1: "the gradient vanishes"}
        if found.status != 1 and barrier is not None:
            return z, float(found.cost), False, f"ended beside points that count as bad: {barrier}"
        return z, float(found.cost), found.status > 0, words.get(found.status, "no step makes the fit better")
