"""What an ensemble is to run, checked before anything runs."""

import dataclasses
import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .._base._faults import Fault, InputError
from .._base._quantity import Quantity, leaves
from .._parts._scene import Scene, faults
from .._run._choice import stiffness
from .._run._edit import with_values
from .._run._measure import Metric, check_metrics, name_of
from .._run._metrics import METRICS, metric_names
from .._run._simulate import solver_for, step_limits
from ..hybrid import Rodas5P

#: step attempts that suffice for most stops without heat: less to write and to measure than the first limit of one run
_SHORT = 128
#: scenes looked at as a whole, besides those with the least and the greatest value of every number
_LOOKED_AT = 16
#: runs named in one fault
_NAMED = 5


@dataclasses.dataclass(frozen=True, eq=False)
class Plan:
    """A scene, the varied numbers (runs first), what is measured, and how it is integrated."""

    scene: Scene
    values: dict[str, np.ndarray]
    metrics: tuple[Metric, ...]
    rtol: float
    solver: Any
    max_steps: int | None
    chunk: int

    @property
    def paths(self) -> tuple[str, ...]:
        return tuple(self.values)

    @property
    def count(self) -> int:
        return len(next(iter(self.values.values())))

    @property
    def columns(self) -> np.ndarray:
        """All varied numbers, (runs, numbers)."""
        return np.concatenate([array.reshape(self.count, -1) for array in self.values.values()], axis=1)

    def one(self, i: int) -> Scene:
        """The scene of run `i`."""
        return with_values(self.scene, {path: array[i] for path, array in self.values.items()})

    def abouts(self) -> dict[str, Quantity]:
        """Unit, meaning and range of every varied number."""
        known = {leaf.path: leaf.about for leaf in leaves(self.one(0))}
        return {path: known[path if path in known else re.sub(r"\[-?\d+\]$", "", path)] for path in self.paths}

    def limits(self, solver: Any) -> tuple[int, ...]:
        """Limits of the step attempts, tried one after the other; long records cost time and memory, used or not."""
        limits = step_limits(self.scene, self.max_steps)
        # with heat a long duty or an implicit method needs more as a rule, and a limit too low compiles in vain
        long = self.scene.heated and (isinstance(solver, Rodas5P) or limits[0] > 8 * _SHORT)
        return limits if self.max_steps or long else (_SHORT, *limits)

    def groups(self) -> list[tuple[Any, np.ndarray]]:
        """Solvers, and the runs that each of them gets: for every run what it would get by itself."""
        every = np.arange(self.count)
        if self.solver is not None or not self.scene.heated:
            return [(self.solver or solver_for(False), every)]
        if not any(path.startswith(("heat", "end_time", "initial.time")) for path in self.paths):
            return [(solver_for(stiffness(self.one(0))[0]), every)]
        stiff = np.asarray([stiffness(self.one(i))[0] for i in range(self.count)])
        return [(solver_for(kind), every[stiff == kind]) for kind in (False, True) if np.any(stiff == kind)]


def default_metrics(scene: Scene) -> tuple[str, ...]:
    """Everything that a scene has but greatest values: these look at every step, which costs many times the run."""
    return tuple(name for name in metric_names(scene) if name not in METRICS or not METRICS[name].greatest)


def plan_of(
    scene: Scene,
    values: Mapping[str, Any],
    metrics: Sequence[Metric] | None,
    *,
    rtol: float,
    solver: Any,
    max_steps: int | None,
    chunk: int,
) -> Plan:
    """The plan, or `InputError` with all faults of values, ranges, metrics and settings."""
    arrays, found = _arrays(values)
    for name, value, good in (
        ("rtol", rtol, 1e-15 < float(rtol) < 0.1),
        ("chunk", chunk, chunk >= 1),
        ("max_steps", max_steps, max_steps is None or max_steps > 0),
    ):
        if not good:
            found.append(Fault(name, f"{value} is not admissible", "0 < rtol < 0.1, chunk and max_steps > 0"))
    if found:
        raise InputError(found)
    asked = default_metrics(scene) if metrics is None else tuple(metrics)
    plan = Plan(scene, arrays, asked, float(rtol), solver, max_steps, int(chunk))
    first = plan.one(0)  # names that the scene does not have are told here
    found = [fault for path, about in plan.abouts().items() for fault in _outside(path, arrays[path], about)]
    try:
        check_metrics(first, asked)
    except InputError as error:
        found += error.faults
    names = [name_of(metric) for metric in asked]
    twice = {name for name in names if names.count(name) > 1}
    found += [Fault(name, "is asked for twice", "functions are told apart by their names") for name in sorted(twice)]
    found = found or _of_times(plan) or _of_scenes(plan)
    if found:
        raise InputError(found)
    return plan


def _arrays(values: Mapping[str, Any]) -> tuple[dict[str, np.ndarray], list[Fault]]:
    arrays: dict[str, np.ndarray] = {}
    found: list[Fault] = [] if values else [Fault("values", "nothing varies", "give {path: array of values}")]
    for path, value in values.items():
        try:
            array = np.array(value, dtype=np.float64)
        except (TypeError, ValueError):
            found.append(Fault(path, "its values are not numbers", "an array (runs,), or (runs, entries)"))
            continue
        if array.ndim not in (1, 2) or array.size == 0:
            shape = f"has the shape {array.shape}"
            found.append(Fault(path, shape, "an array (runs,), or (runs, entries) for a number with entries"))
        arrays[path] = array
    counts = {path: len(array) for path, array in arrays.items() if array.ndim}
    if len(set(counts.values())) > 1:
        each = ", ".join(f"{path} {count}" for path, count in counts.items())
        found.append(Fault("values", f"the numbers of runs differ: {each}", "give every number once for every run"))
    return arrays, found


def _named(runs: Any) -> str:
    """`(run 3)`, `(runs 3, 4, 5, 6, 7 and 12 more)`."""
    more = f" and {len(runs) - _NAMED} more" if len(runs) > _NAMED else ""
    return f"({'run' if len(runs) == 1 else 'runs'} {', '.join(str(i) for i in runs[:_NAMED])}{more})"


def _outside(path: str, array: np.ndarray, about: Quantity) -> list[Fault]:
    """One fault for all values of a number outside its range, with the runs that have them."""
    bad = np.argwhere(~about.admits(array).reshape(len(array), -1))
    if len(bad) == 0:
        return []
    worst = array.reshape(len(array), -1)[tuple(bad[0])]
    what = f"{worst:g} {about.unit} is not admissible {_named(np.unique(bad[:, 0]))}"
    return [Fault(path, what, f"{about.meaning} must be {about.range} {about.unit}")]


def _of_times(plan: Plan) -> list[Fault]:
    """Runs that end before they start: these would come back as if they had reached their end."""
    start, end = (
        np.broadcast_to(plan.values.get(path, np.asarray(value, np.float64)), (plan.count,))
        for path, value in (("initial.time", plan.scene.initial.time), ("end_time", plan.scene.end_time))
    )
    bad = np.flatnonzero(~(end > start))
    what = f"{end[bad[0]]:g} s is not after the start {_named(bad)}" if len(bad) else ""
    return [Fault("end_time", what, "it must be later")] if len(bad) else []


def _of_scenes(plan: Plan) -> list[Fault]:
    """Faults between numbers, in the runs with the least and greatest values and in some others; each told once."""
    columns = plan.columns
    ends = np.concatenate([columns.argmin(axis=0), columns.argmax(axis=0)])
    step = max(1, math.ceil(plan.count / _LOOKED_AT))
    chosen = np.unique(np.concatenate([ends, np.arange(0, plan.count, step)]))
    seen: dict[tuple[str, str], tuple[Fault, list[int]]] = {}
    for i in chosen:
        for fault in faults(plan.one(int(i))):
            seen.setdefault((fault.path, fault.hint), (fault, []))[1].append(int(i))
    found = []
    for fault, runs in seen.values():
        found.append(Fault(fault.path, f"{fault.problem} {_named(runs)}", fault.hint))
    return found
