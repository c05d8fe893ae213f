"""Measured quantities of recordings as a function of the parameters of their scenes."""

import dataclasses
import functools
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import jax.numpy as jnp
import numpy as np

from .._base._faults import Fault, InputError, Issues, input_error
from .._base._quantity import shown
from ..hybrid.arrays import Array
from ..parts.scene import Scene, require_scene
from ..parts.scene_checks import check_scene
from ..runs.choice import stiffness
from ..runs.edit import entry_of, with_inputs, with_values
from ..runs.measure import MetricLike, measure
from ..runs.result import Result
from ..runs.simulate import solver_for
from .bounds import Box, Inputs, Paths, box_of
from .evaluating import Evaluation, PointEvaluator, Solver, failure_name
from .measured import Measured, check_measured, pick


class MeasuredValues(NamedTuple):
    """Columns with their entries at all the times given, then metrics, as one
    vector."""

    columns: tuple[tuple[str, str | None], ...]
    metrics: tuple[MetricLike, ...]

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
        found: list[Any] = [
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
        self.recordings = tuple(recordings)
        self.solver = solver
        #: paths without the names of recordings
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
        self._latest = functools.lru_cache(_REMEMBERED)(self._new)

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
        return self._latest(theta.tobytes())

    def _new(self, numbers: bytes) -> Evaluation:
        self.points += 1
        scenes = [each.scene for each in self.recordings]
        found = self._evaluate(np.frombuffer(numbers), scenes)
        if found.more is not None:
            self.failures[found.more] = self.failures.get(found.more, 0) + 1
        return found

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
        fitted = {entry_of(path)[0] for path in self.fields}
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
