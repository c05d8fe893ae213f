"""Running again: a stored result, and a run at another tolerance to see how accurate it was."""

import json
from pathlib import Path
from typing import Any, NamedTuple

import diffrax
import numpy as np

from .._base._faults import Fault, InputError
from .._base._quantity import leaves
from .._parts._scene import Scene
from .._run._edit import with_values
from .._run._log import Event
from .._run._measure import unit_of
from .._run._result import Result
from .._run._simulate import simulate
from ..files._scene_file import scene_from_text
from ..hybrid import Rodas5P
from ._dataset import load
from ._provenance import parts, provenance


def origin(source: Any) -> dict[str, Any]:
    """What `provenance` said when a result was stored: of a file, a data set, or (now) a result."""
    if isinstance(source, Result):
        return provenance(source)
    data, name = (load(source), str(source)) if isinstance(source, str | Path) else (source, "data set")
    try:
        return json.loads(data.attrs["provenance"])
    except (AttributeError, KeyError, ValueError) as error:
        what = "does not say where it came from"
        raise InputError([Fault(name, what, "give a result file, or a data set of simbrake.dataset")]) from error


def rerun(source: Any, *, scene: Scene | None = None, solver: Any = None) -> Result:
    """Runs a stored result again: its scene, with its solver and settings.

    - `source`: a result file, a data set or a `Result`
    - `scene`: needed where the file holds no text of it (a law of one's own): a scene of the same parts, whose numbers
      are replaced by those stored
    - `solver`: needed where the stored one is no solver of diffrax without options, and not `Rodas5P`

    With the same versions on the same machine the result is the same to the last bit. A run that fails is returned, as
    `simulate(..., throw=False)` does. Raises `InputError`.
    """
    stored = origin(source)
    settings = stored["settings"]
    scene = _scene_of(stored["scene"]) if scene is None else _filled(scene, stored["scene"])
    longest = settings["max_step"]
    return simulate(
        scene,
        solver=solver or _solver_of(settings["method"]),
        rtol=settings["rtol"],
        max_step=np.inf if longest is None else longest,
        max_steps=settings["max_steps"],
        max_events=settings["max_events"],
        throw=False,
    )


def _scene_of(stored: dict[str, Any]) -> Scene:
    if stored["toml"] is None:
        hint = "give a scene of the same parts: rerun(…, scene=…)"
        raise InputError([Fault("scene", f"is not in the file as text ({stored['why']})", hint)])
    return scene_from_text(stored["toml"])


def _filled(scene: Scene, stored: dict[str, Any]) -> Scene:
    """The scene with the stored numbers, if it is of the stored parts."""
    own, theirs = parts(scene), stored["parts"]
    faults = [
        Fault(path or "scene", f"is {own.get(path)}, in the stored run {theirs.get(path)}", "give a scene of its parts")
        for path in sorted(own.keys() | theirs.keys())
        if own.get(path) != theirs.get(path)
    ]
    values = {row["path"]: np.asarray(row["value"], float) for row in stored["numbers"]}
    shapes = {leaf.path: np.shape(leaf.value) for leaf in leaves(scene)}
    for path in sorted(shapes.keys() | values.keys()):
        if path not in shapes or path not in values:
            where = "the stored run" if path in shapes else "the scene given"
            faults.append(Fault(path, f"is absent in {where}", "give a scene of its parts"))
        elif shapes[path] != values[path].shape:
            what = f"is of shape {shapes[path]}, in the stored run {values[path].shape}"
            faults.append(Fault(path, what, "give a scene of its parts"))
    if faults:
        raise InputError(faults)
    return with_values(scene, values)


def _solver_of(name: str) -> Any:
    if name == "Rodas5P":
        return Rodas5P()
    solver = getattr(diffrax, name, None)
    if isinstance(solver, type) and issubclass(solver, diffrax.AbstractERK):
        return solver()
    raise InputError([Fault("settings.method", f"{name} cannot be made by its name", "give it: rerun(…, solver=…)")])


# --- at another tolerance ---------------------------------------------------------------------------------------------

#: factor between the tolerances of the two runs
RATIO = 100.0
#: below this tolerance rounding governs, and a tighter run says nothing
_TIGHTEST = 1e-13


class Shift(NamedTuple):
    """A metric in both runs, in its SI unit; `None` where it has no value."""

    name: str
    unit: str
    value: float | None
    other: float | None

    @property
    def difference(self) -> float | None:
        return None if self.value is None or self.other is None else abs(self.value - self.other)

    @property
    def relative(self) -> float | None:
        """Difference as a share of the value; kelvins as a share of the temperature above absolute zero."""
        return self.difference / abs(self.value) if self.difference is not None and self.value else None


class EventShift(NamedTuple):
    """Events of one name: how many are in both runs, and the greatest difference of their times (s)."""

    name: str
    count: int
    difference: float


class Repeat(NamedTuple):
    """A run and the same scene at another tolerance.

    With `tighter` the differences estimate the error of the run reported; else they are, mostly far above it, the error
    of the looser one. `unmatched`: events that only one of the two has; `problem`: why there is no comparison.
    """

    rtol: float
    tighter: bool
    events: tuple[EventShift, ...] = ()
    metrics: tuple[Shift, ...] = ()
    unmatched: int = 0
    max_step: float | None = None
    problem: str = ""


def repeat(result: Result, progress: Any = False) -> Repeat:
    """Runs the scene of a concrete result again, 100 times tighter (or looser, where rounding would govern), with the
    same method, and compares the times of all events and all metrics.

    Where events and known times cut a run into pieces so short that both tolerances take the same steps, their
    difference would be 0 and say nothing: the second run then takes steps of at most half the mean one. `progress` as
    for `simulate`.
    """
    rtol = float(result.rtol)
    tighter = rtol / RATIO >= _TIGHTEST
    other_rtol = rtol / RATIO if tighter else min(rtol * RATIO, 1e-2)
    if not result.ok:
        return Repeat(other_rtol, tighter, problem=f"the run ended early ({result.status}) and was not repeated")
    events, metrics = result.events, result.metrics  # before the other run: the scan of one result at a time is kept
    options: dict[str, Any] = {"rtol": other_rtol, "solver": result.record.method, "throw": False}
    options["progress"] = progress
    other, longest = simulate(result.scene, **options), None
    if other.ok and _steps(other) == _steps(result):
        times = np.asarray(result.record.rows.t)
        longest = float(times[int(result.record.count)] - times[0]) / (2 * max(_steps(result)[0], 1))
        other = simulate(result.scene, max_step=longest, **options)
    if not other.ok:
        return Repeat(other_rtol, tighter, problem=f"the second run failed ({other.status}): {other.message}")
    shifts, unmatched = _events(events, other.events)
    found = other.metrics
    rows = tuple(Shift(name, _unit(name), value, found[name]) for name, value in metrics.items() if name in found)
    return Repeat(other_rtol, tighter, shifts, rows, unmatched, longest)


def _steps(result: Result) -> tuple[int, int]:
    return int(result.record.stats.accepted), int(result.record.stats.rejected)


def _unit(name: str) -> str:
    """SI unit of an entry of `Result.metrics`: times of peaks and heats are there too."""
    return "s" if name.endswith("_time") else "J" if name.startswith("heat_") else unit_of(name)


def _events(a: list[Event], b: list[Event]) -> tuple[tuple[EventShift, ...], int]:
    """Events matched by name, lining and which of these it is."""
    times = [_occurrences(events) for events in (a, b)]
    both = times[0].keys() & times[1].keys()
    by_name: dict[str, list[float]] = {}
    for key in times[0]:
        if key in both:
            by_name.setdefault(key[0], []).append(abs(times[0][key] - times[1][key]))
    shifts = tuple(EventShift(name, len(found), float(np.max(found))) for name, found in by_name.items())
    return shifts, len(times[0].keys() ^ times[1].keys())


def _occurrences(events: list[Event]) -> dict[tuple[str, int | None, int], float]:
    found: dict[tuple[str, int | None, int], float] = {}
    seen: dict[tuple[str, int | None], int] = {}
    for event in events:
        here = (event.name, event.lining)
        seen[here] = seen.get(here, 0) + 1
        found[(*here, seen[here])] = event.time
    return found
