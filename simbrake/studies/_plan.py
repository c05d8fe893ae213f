"""The plan of many runs of one scene with other numbers, and what is wrong with it."""

import dataclasses
import functools
import math
from collections.abc import Mapping, Sequence

import numpy as np

from .._base._faults import Fault, Issues
from .._base._quantity import Quantity, unit_suffix
from ..parts.scene import Scene
from ..runs.choice import stiffness
from ..runs.edit import with_inputs, with_values
from ..runs.measure import MetricLike, as_metrics, check_metrics
from ..runs.simulate import check_limits, solver_for
from .bounds import Inputs, Paths, array_in_si, faults_of_runs, named_runs
from .evaluating import Solver, own_part
from .many_points import Columns, default_metrics

#: runs up to which each is made by itself: a program of chunks takes longer to compile
FEW = 100
#: scenes looked at as a whole, besides those with the minimum and the maximum of every
#: parameter
_LOOKED_AT = 16


@dataclasses.dataclass(frozen=True, eq=False)
class Plan:
    """A scene, the varied numbers (runs first), what is measured, and how it is
    integrated."""

    scene: Scene
    values: dict[str, np.ndarray]
    metrics: tuple[MetricLike, ...]
    rtol: float
    solver: Solver | None
    max_steps: int | None
    chunk: int | None
    key: str | None = None

    @property
    def paths(self) -> Paths:
        return Paths(
            tuple(self.values), tuple(array.shape[1:] for array in self.values.values())
        )

    @property
    def count(self) -> int:
        return len(next(iter(self.values.values())))

    @property
    def own(self) -> str:
        """Name of a class or function in it that is the user's own, or of a library
        that simbrake does not know."""
        return own_part(self.scene, self.solver, self.metrics)

    @functools.cached_property
    def columns(self) -> np.ndarray:
        """All varied numbers, (runs, numbers)."""
        return np.concatenate(
            [array.reshape(self.count, -1) for array in self.values.values()], axis=1
        )

    @functools.cached_property
    def first(self) -> Scene:
        """The scene of the first run, which has a number at each path."""
        return with_inputs(self.scene, self.paths.values(self.columns[0]))

    def scene_of(self, i: int) -> Scene:
        """The scene of a run."""
        return with_values(self.first, self.paths.values(self.columns[i]))

    @functools.cached_property
    def abouts(self) -> dict[str, Quantity]:
        """Unit, meaning and range of every varied number."""
        known = Inputs(self.first)
        return {path: known.about(path) for path in self.values}

    def groups(self) -> list[tuple[Solver, np.ndarray]]:
        """Solvers, and the runs that each of them gets: for every run what it would get
        by itself."""
        every = np.arange(self.count)
        if self.solver is not None or not self.scene.heated:
            return [(self.solver or solver_for(False), every)]
        if not any(
            path.startswith(("heat", "end_time", "initial.time"))
            for path in self.values
        ):
            return [(solver_for(stiffness(self.first)[0]), every)]
        stiff = np.asarray([stiffness(self.scene_of(i))[0] for i in range(self.count)])
        return [
            (solver_for(kind), every[stiff == kind])
            for kind in (False, True)
            if np.any(stiff == kind)
        ]


def plan_of(
    scene: Scene,
    values: Mapping[str, object],
    metrics: MetricLike | Sequence[MetricLike] | None,
    rtol: float,
    solver: Solver | None,
    max_steps: int | None,
    chunk: int | None,
) -> Plan:
    issues = Issues()
    arrays = _arrays(scene, values, issues)
    issues.attempt(check_limits, rtol, np.inf, max_steps)
    for name, count in (("chunk", chunk), ("max_steps", max_steps)):
        issues.unless(
            count is None or (isinstance(count, int) and count >= 1),
            name,
            count,
            f"{name} > 0",
        )
    asked = default_metrics(scene) if metrics is None else tuple(as_metrics(metrics))
    firsts = {path: array[0] for path, array in arrays.items()}
    first = issues.attempt(with_inputs, scene, firsts)
    if first is not None:
        known = Inputs(first)
        for path, array in arrays.items():
            issues += _outside(path, array, known.about(path))
    issues += Inputs(scene).twice(arrays)
    unknown = Issues()
    unknown.attempt(check_metrics, scene, asked)
    if unknown and first is not None:  # what it varies may bring it
        issues.attempt(check_metrics, first, asked)
    else:
        issues += unknown
    issues.report()
    plan = Plan(scene, arrays, asked, float(rtol), solver, max_steps, chunk)
    issues += _of_times(plan)
    issues += [] if issues else _of_scenes(plan)
    issues.report()
    return plan


def _arrays(scene: Scene, values: Mapping[str, object], issues: Issues) -> Columns:
    arrays: Columns = {}
    if not values or not isinstance(values, Mapping):
        issues.add("values", "nothing varies", "give {path: array of values}")
        return arrays
    for path, value in values.items():
        array = array_in_si(scene, path, value, issues)
        if array is None:
            continue
        if array.ndim not in (1, 2) or array.size == 0:
            hint = "an array (runs,), or (runs, entries) for a number with entries"
            issues.add(path, f"has the shape {array.shape}", hint)
            continue
        arrays[path] = array
    counts = {path: len(array) for path, array in arrays.items()}
    if len(set(counts.values())) > 1:
        each = ", ".join(f"{path} {count}" for path, count in counts.items())
        hint = "give every number once for every run"
        issues.add("values", f"the numbers of runs differ: {each}", hint)
    return arrays


def _outside(path: str, array: np.ndarray, about: Quantity) -> list[Fault]:
    """One error for all values of a parameter outside its range, with the runs that
    have them."""
    bad = np.argwhere(~about.admits(array).reshape(len(array), -1))
    if len(bad) == 0:
        return []
    worst = array.reshape(len(array), -1)[tuple(bad[0])]
    unit = unit_suffix(about.unit)
    what = f"{worst:g}{unit} is out of range {named_runs(np.unique(bad[:, 0]))}"
    return [Fault(path, what, f"{about.meaning} must be {about.range}{unit}")]


def _of_times(plan: Plan) -> list[Fault]:
    """Runs that end before they start: these would be returned as if they had reached
    their end."""
    start, end = (
        plan.values.get(path, np.full(plan.count, value))
        for path, value in (
            ("initial.time", plan.scene.initial.time),
            ("end_time", plan.scene.end_time),
        )
    )
    bad = np.flatnonzero(~(end > start))
    if not len(bad):
        return []
    what = f"{end[bad[0]]:g} s is not after the start {named_runs(bad)}"
    return [Fault("end_time", what, "it must be later")]


def _of_scenes(plan: Plan) -> list[Fault]:
    """Errors between parameters, in the runs with the minima and maxima and in some
    others; each reported once."""
    columns = plan.columns
    ends = np.concatenate([columns.argmin(axis=0), columns.argmax(axis=0)])
    step = 1 if plan.count <= FEW else math.ceil(plan.count / _LOOKED_AT)
    chosen = np.unique(np.concatenate([ends, np.arange(0, plan.count, step)]))
    return faults_of_runs((int(i), plan.scene_of(int(i))) for i in chosen)
