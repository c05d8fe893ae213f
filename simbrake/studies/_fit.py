"""The search of a fit: measured quantities of a scene as a function of its parameters, and bounded least squares."""

import dataclasses
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from .._base._faults import Fault, InputError
from .._base._progress import Progress
from .._parts._scene import Scene
from .._run._edit import Inputs, entry_of, with_values
from .._run._measure import Metric, measure
from .._run._result import Result
from ..hybrid._arrays import Array
from ._evaluator import Box, Evaluation, Evaluator, Faults, Paths, Solver, failure_name
from ._measured import Measured, pick


class MeasuredValues(NamedTuple):
    """Measured quantities: columns with their entries, at some of the given times, and metrics."""

    columns: tuple[tuple[str, str | None], ...]
    metrics: tuple[Metric, ...]

    def __call__(self, result: Result, given: tuple[Array, tuple[Array, ...]]) -> tuple[Array, None]:
        ts, rows = given
        parts, issues = [], Faults()
        if self.columns:
            series = result.series(ts)
            for (column, entry), row in zip(self.columns, rows, strict=True):
                values = pick(result, series, column, entry)
                if isinstance(values, Fault):
                    issues.append(values)
                else:
                    parts.append(values[row])
        issues.report()  # detected while tracing, before the run
        parts += [jnp.reshape(measure(result, metric), (1,)) for metric in self.metrics]
        return jnp.concatenate(parts), None


class FitModel:
    """Measured quantities of a scene as a function of the parameters at `paths`, with derivatives."""

    def __init__(
        self,
        scene: Scene,
        paths: tuple[str, ...],
        data: Measured,
        *,
        solver: Solver,
        rtol: float,
        max_steps: int | None,
    ) -> None:
        times = [part.t for part in data.points]
        ts = np.unique(np.concatenate(times)) if times else np.zeros(0)
        columns = tuple((part.column, part.entry) for part in data.points)
        measured = MeasuredValues(columns, tuple(single.metric for single in data.singles))
        self.run = Evaluator(
            scene,
            Paths.each(paths),
            measured,
            given=(ts, tuple(np.searchsorted(ts, t).astype(np.int32) for t in times)),
            solver=solver,
            rtol=rtol,
            max_steps=max_steps,
        )
        self.paths = paths
        self.names = [part.name for part in data.all for _ in np.atleast_1d(part.value)]
        self.failures: dict[str, int] = {}

    def __call__(self, theta: np.ndarray) -> Evaluation:
        """Values (m,) and Jacobian (m, p)."""
        before, evaluation = self.run.runs, self.run(theta)
        reason = self.refused(evaluation)
        if reason is not None and self.run.runs > before:
            self.failures[reason] = self.failures.get(reason, 0) + 1
        return evaluation

    def of_fixed(self, theta: np.ndarray) -> list[tuple[str, float, np.ndarray]]:
        """Numbers of the scene that are not fitted, not 0, and change the measured values: path, value (that of the
        largest entry), and the change of the values (m,) per relative change of the number.

        Central differences with the program of the fit, in which every number of the scene is an input: nothing is
        compiled, and two runs per number suffice for correlations.
        """
        scene, effects = with_values(self.run.scene, self.run.place.values(theta)), []
        known = Inputs(scene)
        fitted = {entry_of(path, known)[0] for path in self.paths}
        for leaf in known.values():
            value = np.asarray(leaf.value, float) if leaf.value is not None else np.zeros(0)
            if leaf.path in fitted or leaf.path in _OF_THE_RUN or not np.any(value) or not np.all(np.isfinite(value)):
                continue
            ends = [np.asarray(value * (1 + side * STEP)) for side in (1, -1)]
            if not all(np.all(leaf.about.admits(end)) for end in ends):
                continue
            try:
                up, down = (self.run.elsewhere(theta, with_values(self.run.scene, {leaf.path: end})) for end in ends)
            except InputError:  # numbers that must fit to others, as times in their order
                continue
            change = (up.values - down.values) / (2 * STEP)
            if up.code == down.code == 0 and np.all(np.isfinite(change)):
                effects.append((leaf.path, float(value.flat[np.argmax(np.abs(value))]), change))
        return effects

    def refused(self, evaluation: Evaluation) -> str | None:
        """Reason to reject a point: its run fails, or it lacks a measured event; `None` for a valid point."""
        if evaluation.code != 0:
            return f"the run fails: {failure_name(evaluation.code)}"
        for i in np.flatnonzero(~np.isfinite(evaluation.values)):
            what = "does not occur" if np.isinf(evaluation.values[i]) else "is not a number"
            return f"{self.names[i]} {what} in the model"
        for i in np.flatnonzero(~np.isfinite(evaluation.jacobian).all(axis=1)):
            return f"the derivative of {self.names[i]} is not finite"
        return None


#: relative step of differences by fixed numbers
STEP = 1e-3
#: numbers of a scene that are no properties of what was measured
_OF_THE_RUN = ("end_time", "initial.time")
#: why a search has ended
DONE, LIMITED = "the residual no longer decreases", "the limit of evaluations was reached"
#: a parameter this close to an active bound (over the range) at the end is set to it
_NEAR = 1e-3


#: points tried to see whether parameters have an effect elsewhere
_PROBES = 12


def _halton(d: int, n: int) -> np.ndarray:
    """Points (n, d) spread over the unit cube, without its corner."""
    from scipy.stats import qmc  # slow to import, and rarely needed

    return qmc.Halton(d, scramble=False).fast_forward(1).random(n)


@dataclasses.dataclass
class Search:
    """Least squares from one or more starts, all points evaluated once; at most `most` evaluations from each."""

    model: FitModel
    box: Box
    measured: np.ndarray
    sigma: np.ndarray
    loss: str
    loss_scale: float
    method: str
    most: int
    starts: int
    best: tuple[float, np.ndarray, Evaluation] | None = None
    ends: list[tuple[float, np.ndarray]] = dataclasses.field(default_factory=list)
    converged: bool = False
    message: str = ""

    def __post_init__(self) -> None:
        self.progress, self.least = Progress("calibrate", "compiling…"), np.inf

    def look(self, z: np.ndarray) -> tuple[Evaluation, str | None]:
        """The model at a point, and the reason to reject the point."""
        before, evaluation = self.model.run.runs, self.model(self.box.up(z))
        refused = self.model.refused(evaluation)
        if refused is None and self.model.run.runs > before:
            if self.best is None or self.cost(evaluation) < self.best[0]:
                self.best = (self.cost(evaluation), z.copy(), evaluation)
            self.least, most = min(self.least, float(np.sum(self.residual(evaluation) ** 2))), self.most * self.starts
            # a search mostly ends long before its limit: the time left is shown as a bound
            count, also = min(self.model.run.runs, most), f", chi² {self.least:.6g}"
            self.progress.now("run", count, most, also=also)
        return evaluation, refused

    @property
    def noise(self) -> float:
        """Relative rounding of values and derivatives: they are those of the steps taken, which differ from the motion
        by the tolerance."""
        return max(10 * self.model.run.rtol, 1e-12)

    def silent(self, z: np.ndarray) -> np.ndarray:
        """Parameters (p,) on which no value depends at a point, within rounding."""
        evaluation = self.look(z)[0]
        size = np.linalg.norm(np.maximum(np.abs(evaluation.values), np.abs(self.measured)) / self.sigma)
        return np.linalg.norm(self.jacobian(z, evaluation), axis=0) <= self.noise * size

    def probes(self, z: np.ndarray, varied: np.ndarray) -> list[tuple[np.ndarray, float]]:
        """Points over the bounds of the parameters `varied`, the others as in `z`, at which the measured values differ
        from those at `z`, with their costs, the best first."""
        here, points = self.look(z)[0].values, []
        for shares in _halton(int(varied.sum()), _PROBES):
            point = z.copy()
            point[varied] = shares
            there = self.model.run(self.box.up(point))
            size = np.maximum(np.abs(here), np.abs(self.measured))
            if self.model.refused(there) is None and np.any(np.abs(there.values - here) > self.noise * size):
                points.append((point, self.cost(there)))
        return sorted(points, key=lambda pair: pair[1])

    def residual(self, evaluation: Evaluation) -> np.ndarray:
        return (evaluation.values - self.measured) / self.sigma

    def jacobian(self, z: np.ndarray, evaluation: Evaluation) -> np.ndarray:
        return evaluation.jacobian * self.box.slope(self.box.up(z)) / self.sigma[:, None]

    def cost(self, evaluation: Evaluation) -> float:
        return cost(self.residual(evaluation), self.loss, self.loss_scale)

    def run(self) -> None:
        self.progress.__enter__()
        try:
            for k, z in enumerate(self._spread(self.box.down(self.box.start))):
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
        return [first, *(_halton(first.size, self.starts - 1) if self.starts > 1 else ())]

    def _descend(self, z: np.ndarray) -> None:
        """Search from one start; parameters at active bounds are fixed there, and the others searched again."""
        assert self.best is not None
        free = np.ones(z.size, bool)
        z, cost, converged, message = self._minimise(z, free)
        while (pressed := self.pressed(z) & free).any():
            on = np.where(pressed, np.round(z), z)
            evaluation, refused = self.look(on)
            if refused is not None or self.cost(evaluation) > cost * (1 + 1e-9):
                break
            free = free & ~pressed
            z, cost, converged, message = self._minimise(on, free)
        if cost <= self.best[0] * (1 + 1e-9):  # the bound itself, not a neighbour that is better by rounding
            self.best = (cost, z, self.look(z)[0])
        if not self.ends or cost <= min(end[0] for end in self.ends):
            self.converged, self.message = converged, message
        self.ends.append((cost, z))

    def pressed(self, z: np.ndarray) -> np.ndarray:
        evaluation = self.look(z)[0]
        r, J = self.residual(evaluation), self.jacobian(z, evaluation)
        push = J.T @ r
        strong = np.abs(push) > 1e-8 * np.linalg.norm(J, axis=0) * np.linalg.norm(r)
        return strong & (((z < _NEAR) & (push > 0)) | ((z > 1 - _NEAR) & (push < 0)))

    def _minimise(self, z: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, float, bool, str]:
        from scipy.optimize import least_squares  # imported only by fits

        def whole(x: np.ndarray) -> np.ndarray:
            full = z.copy()
            full[free] = x
            return full

        barrier: str | None = None  # why trial points near the best one were rejected
        least = np.inf

        def residual(x: np.ndarray) -> np.ndarray:
            nonlocal barrier, least
            evaluation, refused = self.look(whole(x))
            if refused is not None:
                barrier = refused
                return np.full(self.measured.shape, np.inf)
            if self.cost(evaluation) < least * (1 - 1e-6):  # not the best start
                barrier, least = None, self.cost(evaluation)
            return self.residual(evaluation)

        def jacobian(x: np.ndarray) -> np.ndarray:
            return self.jacobian(whole(x), self.look(whole(x))[0])[:, free]

        if not free.any():
            return z, self.cost(self.look(z)[0]), True, "every parameter is at a bound"
        solution = least_squares(
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
        z, ended = whole(solution.x), solution.status > 0
        if solution.status != 1 and barrier is not None:
            return z, float(solution.cost), False, f"ended beside rejected points: {barrier}"
        return z, float(solution.cost), ended, DONE if ended else LIMITED


# --- covariance by a truncated SVD, and the undetermined combinations of parameters ----------------------------------

#: the robust losses ρ(z) of SciPy with their first and second derivatives, z the squared residual over its scale
_LOSSES = {
    "linear": lambda z: (z, np.ones_like(z), np.zeros_like(z)),
    "soft_l1": lambda z: (2 * (np.sqrt(1 + z) - 1), (1 + z) ** -0.5, -0.5 * (1 + z) ** -1.5),
    "huber": lambda z: (
        np.where(z <= 1, z, 2 * np.sqrt(np.maximum(z, 1)) - 1),
        np.maximum(z, 1) ** -0.5,
        np.where(z > 1, -0.5 * np.maximum(z, 1) ** -1.5, 0.0),
    ),
    "cauchy": lambda z: (np.log1p(z), 1 / (1 + z), -1 / (1 + z) ** 2),
    "arctan": lambda z: (np.arctan(z), 1 / (1 + z**2), -2 * z / (1 + z**2) ** 2),
}
LOSSES = tuple(_LOSSES)
#: standard deviation of a uniform distribution over a range of 1
_UNIFORM = 12**-0.5
#: a parameter that an open direction moves by less than this share of its standard error is not affected by it
_CONCERNED = 0.1


@dataclasses.dataclass(frozen=True)
class Direction:
    """An undetermined combination of parameters: `change` of every parameter over its range (or its
    logarithm over that of the range), the largest 1. `spread`: the combination's standard error in these units, `inf`
    where the data do not depend on it at all."""

    change: np.ndarray
    singular_value: float
    spread: float


class Identified(NamedTuple):
    """Covariance of the scaled parameters, and undetermined directions.

    `covariance` (p, p) of the determined directions alone;  `concerned` (p,): parameters that an open direction
    changes;  `singular_values` (p,), in standard deviations of the data per whole range
    """

    covariance: np.ndarray
    concerned: np.ndarray
    singular_values: np.ndarray
    open: list[Direction]
    rank: int


def cost(residual: np.ndarray, loss: str, scale: float) -> float:
    """Objective of a fit: `½ Σ c² ρ((r/c)²)`."""
    return 0.5 * scale**2 * float(np.sum(_LOSSES[loss]((residual / scale) ** 2)[0]))


def identify(
    jacobian: np.ndarray, residual: np.ndarray, *, absolute: bool, loss: str, loss_scale: float, noise: float
) -> Identified:
    """Covariance and open directions from residuals `r` (m,) in standard deviations and their derivatives `J` (m, p).

    - `cov = s² (JᵀJ)⁻¹`, `s = 1` where the standard deviations are `absolute`, else `s² = rᵀr/(m − p)`
    - robust losses: `H⁻¹ Jᵀ diag(ψ²) J H⁻¹ m/(m − p)`, `ψ = ρ' r`, `H = Jᵀ diag(ρ' + 2 z ρ'') J` (Huber)
    - a direction is open where its singular value is below the rounding `noise` of the largest, or where its standard
      error exceeds that of a uniform distribution over the range, `1/√12`: there the bounds determine more than the
      data
    """
    m, p = jacobian.shape
    _, first, second = _LOSSES[loss]((residual / loss_scale) ** 2)
    curved = np.maximum(first + 2 * (residual / loss_scale) ** 2 * second, 0.0)
    rows = np.pad(np.sqrt(curved)[:, None] * jacobian, ((0, max(p - m, 0)), (0, 0)))
    _, s, vt = np.linalg.svd(rows, full_matrices=False)
    v = vt.T
    vanishing = s <= noise * max(float(s[0]), 1e-300)
    freedom = m - int(p - vanishing.sum())
    scatter = np.sqrt(1 / freedom if freedom > 0 else np.inf)  # without any degrees of freedom it is unknown
    safe = np.where(vanishing, 1.0, s)
    if loss == "linear":
        scale = 1.0 if absolute else scatter * float(np.linalg.norm(residual))
        bent = scale * (v / safe)  # columns whose outer products add up to the covariance
    else:
        bent = scatter * np.sqrt(m) * (v / safe**2) @ (v.T @ (jacobian * (first * residual)[:, None]).T)
    along = np.linalg.norm(v.T @ bent, axis=1) if loss != "linear" else scale / safe
    vague = ~vanishing & (along > _UNIFORM)
    closed = ~(vanishing | vague)
    if loss == "linear":
        covariance = bent[:, closed] @ bent[:, closed].T
    else:
        kept = v[:, closed] @ (v[:, closed].T @ bent)
        covariance = kept @ kept.T
    directions = [Direction(change, 0.0, np.inf) for change in _readable(v[:, vanishing])]
    for k in np.flatnonzero(vague):
        change = v[:, k] / v[np.argmax(np.abs(v[:, k])), k]
        directions.append(Direction(change, float(s[k]), float(along[k])))
    return Identified(covariance, _concerned(v[:, ~closed], covariance), s, directions, int(closed.sum()))


class Confounded(NamedTuple):
    """How a fixed number is tied to fitted ones (p,): their correlations if it were free, their shift for its change of
    1, their variances while it is fixed (for residuals of variance 1), and by how much `Σ r²` would fall if it were
    free."""

    correlation: np.ndarray
    shift: np.ndarray
    variance: np.ndarray
    gain: float


def confound(jacobian: np.ndarray, column: np.ndarray, residual: np.ndarray, noise: float) -> Confounded:
    """Correlations of fitted parameters, with derivatives `J` (m, p), with a number of derivatives `j` (m,).

    With `a = J⁺ j` and `e = j − J a`, freeing the number makes its variance `1/eᵀe`, those of the parameters
    `C_ii + a_i²/eᵀe` with `C = (JᵀJ)⁺`, and the covariances `−a_i/eᵀe`.

    Source: Björck, Numerical Methods for Least Squares Problems (1996), 3.2 (a column that is added).
    """
    u, s, vt = np.linalg.svd(jacobian, full_matrices=False)
    kept = s > noise * max(float(s.max(initial=0.0)), 1e-300)
    u, v = u[:, kept], vt[kept].T / s[kept]
    a = v @ (u.T @ column)
    rest = column - u @ (u.T @ column)
    size, variance = float(column @ column), np.sum(v**2, axis=1)
    square = max(float(rest @ rest), noise**2 * size)  # never of rounding alone
    scale = np.sqrt(variance * square + a**2)
    correlation = np.where(scale > 0, -a / np.where(scale > 0, scale, 1.0), 0.0)
    left = residual - u @ (u.T @ residual)
    independent = square > 1e-6 * size
    return Confounded(correlation, -a, variance, float(rest @ left) ** 2 / square if independent else 0.0)


def _readable(basis: np.ndarray) -> np.ndarray:
    """Directions (k, p) that span the columns of `basis` (p, k), each with as few parameters as possible."""
    k = basis.shape[1]
    if k == 0:
        return np.zeros((0, basis.shape[0]))
    from scipy.linalg import qr  # imported only by fits

    _, _, order = qr(basis.T, pivoting=True)  # pyright: ignore
    rows = np.linalg.solve(basis.T[:, order[:k]], basis.T)
    rows[np.abs(rows) < 1e-6] = 0.0
    return rows / np.take_along_axis(rows, np.argmax(np.abs(rows), axis=1)[:, None], axis=1)


def _concerned(free: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Parameters that open directions (p, k), drawn as long as the bounds allow, would move beyond their errors."""
    if not free.size:
        return np.zeros(free.shape[0], bool)
    length = 1 / np.max(np.abs(free), axis=0)
    moved = np.max(np.abs(free) * length, axis=1)
    return moved > np.maximum(_CONCERNED * np.sqrt(np.diag(covariance)), 1e-6)
