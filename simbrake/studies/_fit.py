"""The search of a fit: measured quantities of a scene as a function of its parameters,
and bounded least squares."""

import dataclasses
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from .._base._faults import Fault, InputError, Issues, input_error
from .._base._progress import Progress
from .._base._quantity import shown
from ..hybrid.arrays import Array
from ..parts.scene import Scene, check_scene, require_scene
from ..runs.choice import stiffness
from ..runs.edit import Inputs, entry_of, with_inputs, with_values
from ..runs.measure import Metric, measure
from ..runs.result import Result
from ..runs.simulate import solver_for
from .evaluating import (
    Box,
    Evaluation,
    Paths,
    PointEvaluator,
    Solver,
    box_of,
    failure_name,
)
from .measured import Measured, check_measured, pick


class MeasuredValues(NamedTuple):
    """Columns with their entries at all the times given, then metrics, as one
    vector."""

    columns: tuple[tuple[str, str | None], ...]
    metrics: tuple[Metric, ...]

    def __call__(self, result: Result, ts: Array) -> tuple[Array, None]:
        parts = []
        issues = Issues()
        if self.columns:
            series = result.series(ts)
            for column, entry in self.columns:
                values = pick(result, series, column, entry)
                if isinstance(values, Fault):
                    issues.append(values)
                else:
                    parts.append(values)
        issues.report()  # detected while tracing, before the run
        parts += [jnp.reshape(measure(result, metric), (1,)) for metric in self.metrics]
        return jnp.concatenate(parts), None


class Recording(NamedTuple):
    """A recording in a fit: its name, empty where it is the only one; its scene with
    the known numbers; its data."""

    name: str
    scene: Scene
    data: Measured

    def label(self, what: str) -> str:
        """A path or a column of this recording: `initial.omega@stop 3`."""
        return f"{what}@{self.name}" if self.name else what

    def labelled(self, faults: Iterable[Fault]) -> list[Fault]:
        """Errors with the name of this recording."""
        return [
            dataclasses.replace(fault, path=self.label(fault.path)) for fault in faults
        ]


#: lowest and highest value by path, in SI or with units
Bounds: TypeAlias = Mapping[str, tuple[float | str, float | str]]
#: bounds with a larger ratio are searched on a logarithmic scale
_DECADES = 100.0


def recordings_of(scene: Scene, data: Any, issues: Issues) -> list[Recording]:
    """The recordings in `data`, measured data or several of them; adds what is wrong
    with their known numbers."""
    require_scene(scene)
    named: Any = data
    if isinstance(data, Measured):
        named = {"": data}
    elif isinstance(data, list | tuple):
        named = {str(i): each for i, each in enumerate(data, 1)}
    if not (
        isinstance(named, Mapping)
        and named
        and all(isinstance(each, Measured) for each in named.values())
    ):
        problem = f"{shown(data)} is not measured data"
        raise input_error(
            "data", problem, "what simbrake.read_measured gives, or a list of these"
        )
    recordings = []
    for name, each in named.items():
        wrong = Issues()
        known = wrong.attempt(with_inputs, scene, dict(each.known))
        recordings.append(Recording(str(name), scene if known is None else known, each))
        issues += recordings[-1].labelled(wrong)
    return recordings


def box_of_all(
    recordings: Sequence[Recording],
    shared: Bounds,
    own: Bounds,
    starts: Mapping[str, float | str],
    issues: Issues,
) -> Box:
    """Bounds and start of the parameters, first those that all recordings share, then
    those of each; adds what is wrong with them."""
    boxes = list[Box]()
    wrong = list[Issues]()
    k = len(shared)
    free = {**shared, **own}
    if not free:
        issues.add(
            "bounds",
            "no parameter is to be fitted",
            '{"brake.pulley.inertia": (500, 2000)}',
        )
    for path in dict.fromkeys(
        path for each in recordings for path in each.data.known if path in shared
    ):
        issues.add(
            path,
            "is shared by all recordings, and known of one",
            "fit it per recording",
        )
    for path in sorted(
        {*starts} - {*free} - {each.label(path) for path in own for each in recordings}
    ):
        issues.add(
            path,
            "has a start value but no bounds",
            "give bounds, or set it in the scene",
        )
    for each in recordings:
        start = {
            path: starts[label] for path in own if (label := each.label(path)) in starts
        }
        wrong.append(Issues())
        boxes.append(
            box_of(
                each.scene,
                free,
                wrong[-1],
                starts={**starts, **start},
                decades=_DECADES,
            )
        )
    of_all = [fault for fault in wrong[0] if all(fault in other for other in wrong)]
    issues += of_all
    for each, mine in zip(recordings, wrong, strict=True):
        issues += each.labelled(fault for fault in mine if fault not in of_all)
    paths = Paths.each(
        (*shared, *(each.label(path) for each in recordings for path in own))
    )
    columns = zip(*(box[1:] for box in boxes), strict=True)
    return Box(
        paths,
        *(
            np.concatenate([rows[0][:k], *(row[k:] for row in rows)])
            for rows in columns
        ),
    )


def solver_within(recordings: Sequence[Recording], bounds: Bounds) -> Solver:
    """The method that `simulate` chooses at the start or with any parameter at a bound:
    the stiff one if any is."""
    scenes = [each.scene for each in recordings]
    ends = [(path, end) for path, pair in bounds.items() for end in pair]
    trials = [
        *scenes,
        *(with_values(scene, {path: end}) for scene in scenes for path, end in ends),
    ]
    return solver_for(scenes[0].heated and any(stiffness(trial)[0] for trial in trials))


def _layout(
    recordings: Sequence[Recording],
) -> tuple[MeasuredValues, list[np.ndarray], list[np.ndarray]]:
    """What all recordings measured, as one program finds it in each of their runs; the
    times that it is given for each of them, filled up to the same length; and where the
    values of each (m,) are among what it finds."""
    columns = dict.fromkeys(
        (part.column, part.entry) for each in recordings for part in each.data.points
    )
    metrics = dict.fromkeys(
        single.metric for each in recordings for single in each.data.singles
    )
    grids = [
        np.unique(np.hstack([p.t for p in r.data.points] or [r.scene.initial.time]))
        for r in recordings
    ]
    longest = max(ts.size for ts in grids)
    given = [np.pad(ts, (0, longest - ts.size), mode="edge") for ts in grids]
    begin = {column: i * longest for i, column in enumerate(columns)}
    last = {metric: len(columns) * longest + i for i, metric in enumerate(metrics)}
    where = []
    for each, ts in zip(recordings, grids, strict=True):
        found = [
            begin[part.column, part.entry] + np.searchsorted(ts, part.t)
            for part in each.data.points
        ]
        found.append([last[single.metric] for single in each.data.singles])
        where.append(np.concatenate(found).astype(int))
    return MeasuredValues(tuple(columns), tuple(metrics)), given, where


class FitModel:
    """Measured quantities of all recordings as a function of the parameters, with
    derivatives: those that all recordings share, then those of each recording."""

    def __init__(
        self,
        recordings: Sequence[Recording],
        shared: Sequence[str],
        own: Sequence[str] = (),
        *,
        solver: Solver,
        rtol: float,
        max_steps: int | None,
    ) -> None:
        #: paths without the names of recordings
        self.recordings = tuple(recordings)
        self.fields = (*shared, *(path for _ in recordings for path in own))
        self.measured, self.given, self.where = _layout(recordings)
        place = Paths.each((*shared, *own))
        self.run = PointEvaluator(
            recordings[0].scene,
            place,
            self.measured,
            given=self.given[0],
            solver=solver,
            rtol=rtol,
            max_steps=max_steps,
        )
        self.paths = (
            *shared,
            *(each.label(path) for each in recordings for path in own),
        )
        self.shared = len(shared)
        first = len(shared) + len(own) * np.arange(len(recordings))
        #: which parameters each recording has
        self._has = [np.r_[: len(shared), k : k + len(own)] for k in first]
        self.parts = [(each, part) for each in recordings for part in each.data.all]
        self.names = [
            each.label(part.name)
            for each, part in self.parts
            for _ in np.atleast_1d(part.value)
        ]
        self.failures: dict[str, int] = {}
        self.points = 0
        self._latest = dict[bytes, Evaluation]()

    @property
    def arrays(self) -> tuple[np.ndarray, np.ndarray]:
        """All measured values (m,) and their standard deviations."""
        values, sigma = zip(
            *(each.data.arrays for each in self.recordings), strict=True
        )
        return np.concatenate(values), np.concatenate(sigma)

    def split(self, values: np.ndarray) -> list[np.ndarray]:
        """Slice of each of `parts` among all values (m,)."""
        return np.split(
            values, np.cumsum([np.size(part.value) for _, part in self.parts])[:-1]
        )

    def check(self, theta: np.ndarray) -> None:
        """Raise `InputError` with what is wrong with scenes and data of the recordings
        at a start."""
        issues = Issues()
        for each, scene in zip(self.recordings, self.scenes(theta), strict=True):
            wrong = Issues()
            wrong.attempt(check_scene, scene)
            wrong.attempt(check_measured, each.data, scene)
            issues += each.labelled(wrong)
        issues.report()

    def scenes(self, theta: np.ndarray) -> list[Scene]:
        """The scene of each recording with these parameters."""
        rows = zip(self.recordings, self._has, strict=True)
        names = self.run.place.names
        return [
            with_values(each.scene, dict(zip(names, theta[has].tolist(), strict=True)))
            for each, has in rows
        ]

    def __call__(self, theta: np.ndarray) -> Evaluation:
        """Values (m,) and Jacobian (m, p) at a trial point; `more` is the reason to
        reject it, `None` for a valid one. What is rejected is counted, the last few
        are cached."""
        key = theta.tobytes()
        if key not in self._latest:
            self.points += 1
            found = self._evaluate(theta, [each.scene for each in self.recordings])
            self._latest[key] = found
            if found.more is not None:
                self.failures[found.more] = self.failures.get(found.more, 0) + 1
            if len(self._latest) > _REMEMBERED:
                del self._latest[next(iter(self._latest))]
        return self._latest[key]

    def _evaluate(self, theta: np.ndarray, scenes: Iterable[Scene]) -> Evaluation:
        """One evaluation of the runs of all recordings, each of a scene of its own."""
        values = []
        jacobian = []
        reason = None
        for each, scene, has, ts, where in zip(
            self.recordings, scenes, self._has, self.given, self.where, strict=True
        ):
            run = self.run(theta[has], ts, scene)
            values.append(run.values[where])
            rows = np.zeros((where.size, theta.size))
            rows[:, has] = run.jacobian[where]
            jacobian.append(rows)
            if run.code != 0 and reason is None:
                reason = f"{each.label('the run')} fails: {failure_name(run.code)}"
        whole = Evaluation(np.concatenate(values), np.concatenate(jacobian), 0, reason)
        return whole._replace(more=reason or self._missing(whole))

    def _missing(self, evaluation: Evaluation) -> str | None:
        """What of the measured values, or of their derivatives, a point lacks."""
        for i in np.flatnonzero(~np.isfinite(evaluation.values)):
            endless = np.isinf(evaluation.values[i])
            what = "does not occur" if endless else "is not a number"
            return f"{self.names[i]} {what} in the model"
        for i in np.flatnonzero(~np.isfinite(evaluation.jacobian).all(axis=1)):
            return f"the derivative of {self.names[i]} is not finite"
        return None

    def of_fixed(self, theta: np.ndarray) -> list[tuple[str, float, np.ndarray]]:
        """Numbers of the scene that are not fitted, not 0, and change the measured
        values: path, value (that of the largest entry), and the change of the values
        (m,) per relative change of the number in all recordings.

        Central differences with the program of the fit, in which every number of the
        scene is an input: nothing is compiled, and two runs per number and recording
        suffice for correlations.
        """
        known = [Inputs(scene) for scene in self.scenes(theta)]
        effects = []
        fitted = {entry_of(path, known[0])[0] for path in self.fields}
        for path, leaf in known[0].items():
            values = [
                np.asarray(inputs[path].value if path in inputs else [], float)
                for inputs in known
            ]
            every = np.hstack([np.ravel(value) for value in values])
            if (
                path in fitted
                or path in _OF_THE_RUN
                or not np.any(every)
                or not leaf.about.admits(np.outer([1 + STEP, 1 - STEP], every)).all()
            ):
                continue
            try:
                up, down = (
                    self._evaluate(
                        theta,
                        [
                            with_values(each.scene, {path: factor * value})
                            for each, value in zip(self.recordings, values, strict=True)
                        ],
                    )
                    for factor in (1 + STEP, 1 - STEP)
                )
            # numbers that must fit to others, as times in their order
            except InputError:
                continue
            change = (up.values - down.values) / (2 * STEP)
            if up.more is None and down.more is None:
                effects.append((path, float(every[np.argmax(np.abs(every))]), change))
        return effects


#: points whose evaluations are cached
_REMEMBERED = 4
#: relative step of differences by fixed numbers
STEP = 1e-3
#: numbers of a scene that are no properties of what was measured
_OF_THE_RUN = ("end_time", "initial.time")
#: why a search has ended
_DONE = "the residual no longer decreases"
_LIMITED = "the limit of evaluations was reached"
#: a parameter this close to an active bound (over the range) at the end is set to it
_NEAR = 1e-3


#: relative error of the root of a rise of χ² at the end of a profile; the root beyond
#: the runs that have all events
_CLOSE = 1e-6
_BEYOND = 1e3


@dataclasses.dataclass
class Search:
    """Least squares from one or more starts, all points evaluated once; at most `most`
    evaluations from each."""

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
        self.progress = Progress("calibrate", "compiling…")

    def look(self, z: np.ndarray) -> Evaluation:
        """The model at a point; the best valid one is kept."""
        before = self.model.points
        evaluation = self.model(self.box.up(z))
        if evaluation.more is None and self.model.points > before:
            if self.best is None or self.cost(evaluation) < self.best[0]:
                self.best = (self.cost(evaluation), z.copy(), evaluation)
            # a search mostly ends long before its limit: the time left is shown as a
            # bound
            most = self.most * self.starts
            chi2 = np.sum(self.residual(self.best[2]) ** 2)
            count = min(self.model.points, most)
            self.progress.now("run", count, most, also=f", chi² {chi2:.6g}")
        return evaluation

    @property
    def noise(self) -> float:
        """Relative rounding of values and derivatives: they are those of the steps
        taken, which differ from the motion by the tolerance."""
        return max(10 * self.model.run.rtol, 1e-12)

    def residual(self, evaluation: Evaluation) -> np.ndarray:
        return (evaluation.values - self.measured) / self.sigma

    def jacobian(self, z: np.ndarray) -> np.ndarray:
        """Derivatives (m, p) of the residual by the unknowns."""
        slope = self.box.slope(self.box.up(z))
        return self.look(z).jacobian * slope / self.sigma[:, None]

    def cost(self, evaluation: Evaluation) -> float:
        return cost(self.residual(evaluation), self.loss, self.loss_scale)

    def run(self) -> None:
        try:
            with self.progress:
                for z in self._spread(self.box.down(self.box.start)):
                    if self.look(z).more is None:
                        self._descend(z)
        except KeyboardInterrupt:
            if self.best is None:
                raise
            self.converged = False
            self.message = "interrupted: this is the best point found so far"
        if self.best is None:
            hint = "give another start, or try several (starts=8)"
            raise InputError(
                [
                    Fault(
                        "start",
                        reason,
                        f"{n} of the starts"
                        if self.starts > 1
                        else f"raise end_time, {hint}"
                        if "does not occur" in reason
                        else hint,
                    )
                    for reason, n in self.model.failures.items()
                ]
            )

    def _spread(self, first: np.ndarray) -> list[np.ndarray]:
        """The first start, and others spread over the unit cube, without its corner."""
        from scipy.stats import qmc  # slow to import, and rarely needed

        others = (
            qmc.Halton(first.size, scramble=False)
            .fast_forward(1)
            .random(self.starts - 1)
        )
        return [first, *others]

    def _descend(self, z: np.ndarray) -> None:
        """Search from one start; parameters at active bounds are fixed there, and the
        others searched again."""
        assert self.best is not None
        free = np.ones(z.size, bool)
        z, cost, converged, message = self._minimise(z, free)
        while (pressed := self.pressed(z) & free).any():
            on = np.where(pressed, np.round(z), z)
            evaluation = self.look(on)
            worse = cost * (1 + 1e-9)
            if evaluation.more is not None or self.cost(evaluation) > worse:
                break
            free = free & ~pressed
            z, cost, converged, message = self._minimise(on, free)
        # the bound itself, not a neighbour that is better by rounding
        if cost <= self.best[0] * (1 + 1e-9):
            self.best = (cost, z, self.look(z))
        if not self.ends or cost <= min(end[0] for end in self.ends):
            self.converged = converged
            self.message = message
        self.ends.append((cost, z))

    def profile(
        self, z: np.ndarray, i: int, rise: float, width: float
    ) -> tuple[float, float]:
        """Unknowns `i` below and above that of a best point `z` at which `min Σ r²`
        over all the others is larger by `rise`; `∓inf` where it is not up to the bound.
        `width`: how far away they are to first order, `inf` if unknown.

        The root of the rise is nearly linear in the unknown, so that few fits of the
        others find it.
        """
        from scipy.optimize import brentq  # imported only by fits

        least = self.cost(self.look(z))
        free = np.arange(z.size) != i
        solved = {float(z[i]): (-1.0, z)}

        def excess(x: float) -> float:
            if x not in solved:
                nearest = min(solved, key=lambda other: abs(other - x))
                point = solved[nearest][1].copy()
                point[i] = x
                if self.look(point).more is not None:
                    return _BEYOND  # no run has the measured events there
                point, cost, *_ = self._minimise(point, free)
                rose = np.sqrt(max(2 * (cost - least), 0.0) / rise)
                solved[x] = (float(rose) - 1, point)
            return solved[x][0]

        def end(side: int) -> float:
            bound = max(side, 0.0)
            near = np.clip(z[i] + side * width, 0.0, 1.0) if width > 0 else bound
            if near != bound and excess(near) < -_CLOSE:
                near = bound
            if near == z[i] or excess(near) < -_CLOSE:
                return side * np.inf
            if excess(near) < _CLOSE:
                return near
            return brentq(excess, *sorted((z[i], near)), xtol=1e-9, rtol=1e-8)  # pyright: ignore

        return end(-1), end(1)

    def pressed(self, z: np.ndarray) -> np.ndarray:
        """Unknowns (p,) that a bound keeps from a lower cost."""
        r = self.residual(self.look(z))
        J = self.jacobian(z)
        push = J.T @ r
        strong = np.abs(push) > 1e-8 * np.linalg.norm(J, axis=0) * np.linalg.norm(r)
        return strong & (((z < _NEAR) & (push > 0)) | ((z > 1 - _NEAR) & (push < 0)))

    def _minimise(
        self, z: np.ndarray, free: np.ndarray
    ) -> tuple[np.ndarray, float, bool, str]:
        from scipy.optimize import least_squares  # imported only by fits

        def whole(x: np.ndarray) -> np.ndarray:
            full = z.copy()
            full[free] = x
            return full

        barrier: str | None = None  # why trial points near the best one were rejected
        least = np.inf

        def residual(x: np.ndarray) -> np.ndarray:
            nonlocal barrier, least
            evaluation = self.look(whole(x))
            if evaluation.more is not None:
                barrier = evaluation.more
                return np.full(self.measured.shape, np.inf)
            if self.cost(evaluation) < least * (1 - 1e-6):  # not the best start
                barrier = None
                least = self.cost(evaluation)
            return self.residual(evaluation)

        if not free.any():
            return z, self.cost(self.look(z)), True, "every parameter is at a bound"
        solution = least_squares(
            residual,
            np.clip(z[free], 0.0, 1.0),
            lambda x: self.jacobian(whole(x))[:, free],  # pyright: ignore
            bounds=(0.0, 1.0),
            method=self.method,
            loss=self.loss,
            f_scale=self.loss_scale,
            x_scale="jac",
            ftol=1e-14,
            xtol=self.noise,  # shorter steps move a run by less than its tolerance
            gtol=1e-12,
            max_nfev=self.most,
        )
        ended = solution.status > 0
        message = _DONE if ended else _LIMITED
        if solution.status != 1 and barrier is not None:
            ended = False
            message = f"ended beside rejected points: {barrier}"
        return whole(solution.x), float(solution.cost), ended, message


# --- covariance by a truncated SVD, and the undetermined combinations of parameters -

#: the robust losses ρ(z) of SciPy, z the squared residual over its scale
_LOSSES: dict[str, Callable[[Any], Any]] = {
    "linear": lambda z: z,
    "soft_l1": lambda z: 2 * (jnp.sqrt(1 + z) - 1),
    "huber": lambda z: jnp.where(z <= 1, z, 2 * jnp.sqrt(jnp.maximum(z, 1)) - 1),
    "cauchy": jnp.log1p,
    "arctan": jnp.arctan,
}
LOSSES = tuple(_LOSSES)
#: standard deviation of a uniform distribution over a range of 1
_UNIFORM = 12**-0.5
#: a parameter that an open direction moves by less than this share of its standard
#: error is not affected by it
_CONCERNED = 0.1


class Identified(NamedTuple):
    """Covariance of the scaled parameters, and undetermined directions.

    - `covariance` (p, p) of the determined directions alone
    - `singular_values` (p,), in standard deviations of the data per whole range
    - `open` (k, p): directions that the data do not determine
    - `concerned` (p,): parameters that one of them changes
    """

    covariance: np.ndarray
    concerned: np.ndarray
    singular_values: np.ndarray
    open: np.ndarray
    rank: int


def cost(residual: np.ndarray, loss: str, scale: float) -> float:
    """Objective of a fit: `½ Σ c² ρ((r/c)²)`."""
    return 0.5 * scale**2 * float(np.sum(_LOSSES[loss]((residual / scale) ** 2)))


def identify(
    jacobian: np.ndarray,
    residual: np.ndarray,
    *,
    absolute: bool,
    loss: str,
    loss_scale: float,
    noise: float,
) -> Identified:
    """Covariance and open directions from residuals `r` (m,) in standard deviations and
    their derivatives `J` (m, p).

    - `cov = s² (JᵀJ)⁻¹`, `s = 1` where the standard deviations are `absolute`, else
      `s² = rᵀr/(m − p)`
    - robust losses: `H⁻¹ Jᵀ diag(ψ²) J H⁻¹ m/(m − p)`, `ψ = ρ' r`,
      `H = Jᵀ diag(ρ' + 2 z ρ'') J` (Huber)
    - a direction is open where its singular value is below the rounding `noise` of the
      largest, or where its standard error exceeds that of a uniform distribution over
      the range, `1/√12`: there the bounds determine more than the data
    """
    m, p = jacobian.shape
    z = (residual / loss_scale) ** 2
    slope = jax.grad(_LOSSES[loss])
    first = np.asarray(jax.vmap(slope)(z))
    second = np.asarray(jax.vmap(jax.grad(slope))(z))
    curved = np.maximum(first + 2 * z * second, 0.0)
    rows = np.pad(np.sqrt(curved)[:, None] * jacobian, ((0, max(p - m, 0)), (0, 0)))
    _, s, vt = np.linalg.svd(rows, full_matrices=False)
    vanishing = s <= noise * np.max(s, initial=1e-300)
    freedom = m - int(p - vanishing.sum())
    # without any degrees of freedom it is unknown
    scatter = np.sqrt(1 / freedom if freedom > 0 else np.inf)
    if loss == "linear":
        scale = 1.0 if absolute else scatter * np.linalg.norm(residual)
        push = np.diag(s)
    else:
        scale = scatter * np.sqrt(m)
        push = vt @ (jacobian * (first * residual)[:, None]).T
    # columns whose outer products add up to the covariance, along each direction
    along = scale * push / np.where(vanishing, 1.0, s)[:, None] ** 2
    vague = ~vanishing & (np.linalg.norm(along, axis=1) > _UNIFORM)
    closed = ~(vanishing | vague)
    whole = vt[closed].T @ along[closed]
    covariance = whole @ whole.T
    free = vt[~closed]
    return Identified(
        covariance, _concerned(free.T, covariance), s, free, int(closed.sum())
    )


class Confounded(NamedTuple):
    """How a fixed number is tied to fitted ones (p,): their correlations if it were
    free, their shift for its change of 1, and their variances while it is fixed (for
    residuals of variance 1)."""

    correlation: np.ndarray
    shift: np.ndarray
    variance: np.ndarray


def confound(jacobian: np.ndarray, column: np.ndarray, noise: float) -> Confounded:
    """Correlations of fitted parameters, with derivatives `J` (m, p), with a number of
    derivatives `j` (m,).

    With `a = J⁺ j` and `e = j − J a`, freeing the number makes its variance `1/eᵀe`,
    those of the parameters `C_ii + a_i²/eᵀe` with `C = (JᵀJ)⁺`, and the covariances
    `−a_i/eᵀe`.

    Source: Björck, Numerical Methods for Least Squares Problems (1996), 3.2 (a column
    that is added).
    """
    inverse = np.linalg.pinv(jacobian, noise)
    a = inverse @ column
    rest = column - jacobian @ a
    size = float(column @ column)
    variance = np.sum(inverse**2, axis=1)
    square = max(float(rest @ rest), noise**2 * size)  # never of rounding alone
    scale = np.sqrt(variance * square + a**2)
    correlation = np.where(scale > 0, -a / np.where(scale > 0, scale, 1.0), 0.0)
    return Confounded(correlation, -a, variance)


def _concerned(free: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Parameters that open directions (p, k), drawn as long as the bounds allow, would
    move beyond their errors."""
    if not free.size:
        return np.zeros(free.shape[0], bool)
    length = 1 / np.max(np.abs(free), axis=0)
    moved = np.max(np.abs(free) * length, axis=1)
    return moved > np.maximum(_CONCERNED * np.sqrt(np.diag(covariance)), 1e-6)
