"""The smallest maximum tension under limits on a run: stopping time, temperatures, or
any other metric."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ..._base._faults import Fault, InputError, Issues
from ..._base._progress import Progress
from ..._base._table import Column, Table, Tabular, frozen, plain
from ...hybrid.arrays import Array
from ...outputs.metrics import is_least
from ...parts.scene import Scene
from ...parts.scene_checks import faults
from ...runs.measure import check_metrics, measure, unit_of
from ...runs.result import Result
from ...runs.simulate import Solver
from ...studies.bounds import Box, box_of
from ...studies.evaluating import PointEvaluator


class LimitRow(NamedTuple):
    """One limit: the metric at the `start` and at the optimum, and `sensitivity` =
    d(objective)/d(limit), ≤ 0."""

    name: str
    unit: str
    start: float
    value: float
    limit: float
    active: bool
    sensitivity: float


class BoundRow(NamedTuple):
    """One free number: at the `start`, at the optimum, the active bound (`low`, `high`
    or none), and `sensitivity` = d(objective)/d(bound)."""

    path: str
    start: float
    value: float
    bound: str
    sensitivity: float


@frozen
class LeastTension(Tabular):
    """The scene of minimum tension, its objective and its active limits.

    - `objective`, its `unit`, its values at the `start` and at the optimum (`value`)
    - `limits`, `variables`: with their multipliers, as derivatives of the objective by
      limit or bound
    - `success`: the search ended at a point within all limits
    - `stationarity`: the gradient that the active limits and
      bounds do not balance, relative to it (0 at an optimum)
    - `runs` of the simulation, each with its derivatives
    """

    scene: Scene
    objective: str
    unit: str
    start: float
    value: float
    limits: tuple[LimitRow, ...]
    variables: tuple[BoundRow, ...]
    success: bool
    message: str
    iterations: int
    runs: int
    stationarity: float

    @property
    def values(self) -> dict[str, float]:
        """The free numbers at the optimum, by path."""
        return {row.path: row.value for row in self.variables}

    def as_dict(self) -> dict[str, Any]:
        """Return the data without the scene as numbers, lists and text."""
        return plain(
            {name: value for name, value in vars(self).items() if name != "scene"}
        )

    def parts(self) -> Iterator[str | Table]:
        how = "found" if self.success else f"NOT converged ({self.message})"
        yield (
            f"minimum {self.objective} {how}: == {self.value:.8g} {self.unit} (start "
            f"{self.start:.8g}) in {self.iterations} iterations, {self.runs} runs; "
            f"stationary to {self.stationarity:.1e}"
        )
        start = Column("start")
        value = Column("value")
        cost = f"d{self.objective}/dlimit"
        rows = [
            (
                row.name,
                *row[2:5],
                row.unit,
                f"{row.sensitivity:.6g} {self.unit}/{row.unit}"
                if row.active
                else "slack",
            )
            for row in self.limits
        ]
        columns = ["limit of", start, value, Column("limit"), "unit"]
        yield Table([*columns, (cost, cost)], rows)
        cost = f"d{self.objective}/dbound"
        sides = {"low": "at its lower bound", "high": "at its upper bound", "": ""}
        yield Table(
            ["parameter", start, value, "bound", Column(cost, heading=cost)],
            [
                (*row[:3], sides[row.bound], row.sensitivity if row.bound else None)
                for row in self.variables
            ],
        )


_ANGLES = "brake.linings.angle"
# relative excess given to a limit on something that did not happen in a trial
_FAR = 10.0
# share of the speed left at the end of a run, above which a stop is extrapolated along
# a straight line
_SLOW = 0.9
_ACTIVE = 1e-6  # relative distance at which a limit or a bound is met


class _Searched(NamedTuple):
    """Metrics of the search, the objective first."""

    names: tuple[str, ...]

    def __call__(self, result: Result, given: object) -> tuple[Array, None]:
        """A brake that does not stop in the run has the time at which its mean
        deceleration would stop it."""
        record = result.record
        start = record.rows.t[0]
        end = record.t_end
        left = record.y_end.omega / jnp.asarray(result.scene.start_speed)
        slow = (
            1 / (1 - jnp.minimum(left, _SLOW))
            + jnp.maximum(left - _SLOW, 0.0) / (1 - _SLOW) ** 2
        )
        metrics = {name: measure(result, name) for name in self.names}
        time = metrics["stopping_time"]
        metrics["stopping_time"] = jnp.where(
            jnp.isfinite(time), time, start + (end - start) * slow
        )
        return jnp.stack([metrics[name] for name in self.names]), None


class _Problem:
    """The search in scaled unknowns `u = (x − low)/(high − low)` and relative limits,
    the objective first."""

    def __init__(
        self,
        run: PointEvaluator,
        names: tuple[str, ...],
        box: Box,
        limits: np.ndarray,
        keep_wrap: bool,
    ) -> None:
        self.run = run
        self.names = names
        self.box = box
        self.limits = limits
        self.scale = 1.0
        self.progress = Progress("minimum tension", "compiling…")
        self.start = box.down(box.start)
        # change of the wrap with the unknowns, where an angle is free
        angles = [float(path.partition("[")[0] == _ANGLES) for path in box.paths.names]
        sizes = [span.stop - span.start for span in box.paths.spans]
        self.wrap = (
            np.repeat(angles, sizes) * box.slope(box.start)
            if keep_wrap and any(angles)
            else None
        )

    def look(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Metrics and their derivatives by `u`; infinite where the run fails."""
        before = self.run.runs
        evaluation = self.run(self.box.up(u))
        values = (
            evaluation.values
            if evaluation.code == 0
            else np.full_like(evaluation.values, np.inf)
        )
        if self.run.runs > before:
            self.progress.now(f"run {self.run.runs}, {self.names[0]} {values[0]:.6g}")
        return values, evaluation.jacobian * self.box.slope(self.box.up(u))

    def objective(self, u: np.ndarray) -> tuple[float, np.ndarray]:
        metrics, jacobian = self.look(u)
        # a trial whose run fails ranks below all others
        value = metrics[0] / self.scale if np.isfinite(metrics[0]) else 1.0 + _FAR
        return float(value), jacobian[0] / self.scale

    def room(self, u: np.ndarray) -> np.ndarray:
        """Margin of every limit: `1 − r`, `r = metric/limit`, and `−ln r` beyond it,
        where `r` may be large."""
        r = self.look(u)[0][1:] / self.limits
        return np.where(
            np.isfinite(r), np.where(r <= 1, 1 - r, -np.log(np.maximum(r, 1.0))), -_FAR
        )

    def room_slope(self, u: np.ndarray) -> np.ndarray:
        metrics, jacobian = self.look(u)
        r = metrics[1:] / self.limits
        factor = np.where(np.isfinite(r), 1 / np.maximum(r, 1.0), 1.0) / self.limits
        return -factor[:, None] * jacobian[1:]


def least_tension(
    scene: Scene,
    stopping_time: float,
    variables: Mapping[str, Any],
    *,
    limits: dict[str, float] | None = None,
    keep_wrap: bool = True,
    objective: str = "max_tension",
    solver: Solver | None = None,
    rtol: float = 1e-10,
    tolerance: float = 1e-10,
    max_iterations: int = 100,
) -> LeastTension:
    """Values of the free parameters that minimise the maximum band tension within a
    stopping time.

        min T_max(x)   subject to   t_stop(x) ≤ limit,  m_j(x) ≤ limit_j,  low ≤ x ≤ high,  Σβ = wrap

    by SciPy's SLSQP with the derivatives of the simulation, forward or reverse by
    counts.

    - `stopping_time` (s): longest one allowed
    - `variables`: path → (low, high); a field with many entries is free in each,
      `brake.linings.angle[0]` is one of it. The search starts from the values of the
      scene: a local optimum near them is found. A uniform pitch is stationary by
      symmetry: start from another one where angles are free
    - `limits`: limits of further metrics by name, `{"peak_lining_temperature": 673.15}`
    - `keep_wrap`: where lining angles are free, their sum stays
    - `objective`: another metric to be minimised
    - `tolerance`: relative change of the objective at which the search ends

    Raises `InputError` with all errors, also where the scene as given does not stop.
    """
    allowed = {"stopping_time": float(stopping_time), **(limits or {})}
    errors = Issues(faults(scene))
    if not variables:
        errors.add(
            "variables",
            "no parameter is free",
            "as {'duty.slack_tension.level': (1e3, 3e4)}",
        )
    box = box_of(scene, variables, errors, each=True)
    errors.attempt(check_metrics, scene, [objective, *allowed])
    for name, value in allowed.items():
        if not (np.isfinite(value) and value > 0):
            errors.add(
                name,
                f"a limit of {value:g} is not possible",
                "it must be positive and finite",
            )
        if is_least(name):
            hint = "give limits of greatest values"
            errors.add(name, "a least value is no limit of this search", hint)
    errors.report()
    names = (objective, *allowed)
    reverse = len(box.low) > 4 * len(names)
    run = PointEvaluator(
        scene, box.paths, _Searched(names), reverse=reverse, solver=solver, rtol=rtol
    )
    result = run.result()
    run.like(result)
    problem = _Problem(run, names, box, np.asarray(list(allowed.values())), keep_wrap)
    with problem.progress:
        first = problem.look(problem.start)[0]
        missing = [
            name
            for name, value in zip(names, first, strict=True)
            if not np.isfinite(value)
        ]
        if missing:
            hint = (
                "start from values with which it occurs: derivatives exist only there"
            )
            what = f"does not occur in the scene ({result.status})"
            raise InputError([Fault(name, what, hint) for name in missing])
        problem.scale = float(first[0])
        return _report(problem, _solve(problem, tolerance, max_iterations))


def _solve(problem: _Problem, tolerance: float, most: int) -> Any:
    from scipy.optimize import Bounds, minimize  # imported where it is used

    u = problem.start
    wrap = problem.wrap
    rules: list[dict[str, Any]] = [
        {"type": "ineq", "fun": problem.room, "jac": problem.room_slope}
    ]
    if wrap is not None:
        rules.append(
            {
                "type": "eq",
                "fun": lambda v: np.atleast_1d(wrap @ (v - u)),
                "jac": lambda v: wrap[None, :],
            }
        )
    return minimize(
        problem.objective,
        u,
        jac=True,
        method="SLSQP",
        bounds=Bounds(np.zeros_like(u), np.ones_like(u)),  # pyright: ignore
        constraints=rules,
        options={"ftol": tolerance, "maxiter": most},
    )


def _multipliers(
    problem: _Problem, u: np.ndarray
) -> tuple[Float[np.ndarray, " limits"], Float[np.ndarray, " entries"], float]:
    """Multipliers of limits and bounds (scaled) and the residual gradient, by least
    squares at the optimum.

    ∇T = Σ λ_j ∇(1 − m_j/limit_j) + Σ ν_i ∇(bounds) + κ ∇Σβ,   λ ≥ 0, of what is active
    """
    from scipy.optimize import lsq_linear

    gradient = problem.objective(u)[1]
    slope = problem.room_slope(u)
    room = problem.room(u)
    active, low, high = (
        np.flatnonzero(at)
        for at in (np.abs(room) < _ACTIVE, u < _ACTIVE, u > 1 - _ACTIVE)
    )
    unit = np.eye(len(u))
    wrap = [] if problem.wrap is None else [problem.wrap]
    columns = [*slope[active], *unit[low], *(-unit[high]), *wrap]
    lam = np.zeros(len(room))
    nu = np.zeros(len(u))
    norm = np.linalg.norm(gradient).item()
    if not columns:
        return lam, nu, norm
    matrix = np.stack(columns, axis=1)
    least = np.append(np.zeros(len(columns) - len(wrap)), [-np.inf] * len(wrap))
    x = lsq_linear(
        matrix, gradient, (least, np.full(len(columns), np.inf)), tol=1e-14
    ).x
    lam[active], nu[low], of_high, _ = np.split(
        x, np.cumsum([len(active), len(low), len(high)])
    )
    nu[high] = -of_high
    return lam, nu, np.linalg.norm(matrix @ x - gradient).item() / max(norm, 1e-300)


def _report(problem: _Problem, solution: Any) -> LeastTension:
    paths = problem.box.paths
    end = np.clip(solution.x, 0.0, 1.0)
    before = problem.look(problem.start)[0]
    after = problem.look(end)[0]
    lam, nu, residual = _multipliers(problem, end)
    room = problem.room(end)
    units = [unit_of(name) for name in problem.names]
    # T* changes with its limit by −λ_j ∂(room_j)/∂(limit_j), where room_j = 0
    moves = -lam * problem.scale / problem.limits
    columns = (before[1:], after[1:], problem.limits, np.abs(room) < _ACTIVE, moves)
    named = (problem.names[1:], units[1:], *(column.tolist() for column in columns))
    limits = tuple(map(LimitRow, *named))
    names = [
        path if span.stop - span.start == 1 else f"{path}[{i}]"
        for path, span in zip(paths.names, paths.spans, strict=True)
        for i in range(span.stop - span.start)
    ]
    start, x = (problem.box.up(u) for u in (problem.start, end))
    sides = np.where(end < _ACTIVE, "low", np.where(end > 1 - _ACTIVE, "high", ""))
    columns = (start, x, sides, nu * problem.scale / problem.box.slope(x))
    rows = tuple(map(BoundRow, names, *(column.tolist() for column in columns)))
    scene = jax.tree.map(np.asarray, paths(problem.run.scene, jnp.asarray(x)))
    feasible = bool(np.all(room > -_ACTIVE))
    return LeastTension(
        scene=scene,
        objective=problem.names[0],
        unit=units[0],
        start=float(before[0]),
        value=float(after[0]),
        limits=limits,
        variables=rows,
        success=bool(solution.success) and feasible,
        message=str(solution.message)
        if feasible
        else f"a limit is exceeded: {solution.message}",
        iterations=int(solution.nit),
        runs=problem.run.runs,
        stationarity=residual,
    )
