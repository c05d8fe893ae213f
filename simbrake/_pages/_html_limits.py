"""Permissible limits of a scene and those that a user gives: kept, passed, or why nobody can tell."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from .._base._faults import Fault, InputError
from .._base._handy import Number, number
from .._base._numbers import BAD, NumberReader
from .._base._quantity import Quantity
from .._parts._driller import AbstractSpeedLever
from .._parts._scene import Scene, read_by_linings
from .._run._measure import check_metrics, measure, metric_names, unit_of
from .._run._result import Result
from .._run._rubbing import lining_peak
from ._html_parts import words_of

#: a limit that is no metric: needs areas of the linings
PRESSURE = "max_pressure"
_HOT = "peak_lining_temperature"


class Limit(NamedTuple):
    """One limit: `verdict` is `kept`, `kept so far` (the run failed), `passed`, `no limit` or `not examined`; `words`
    say when, or why not."""

    what: str
    permissible: Number
    found: Number
    verdict: str
    words: str = ""


def read_limits(scene: Scene, limits: Mapping[str, int | float | str]) -> tuple[dict[str, float], list[Fault]]:
    """Limits in SI, given so or as texts with a unit; and the faults: names that are no metric, what is no number."""
    reader, read = NumberReader(), {}
    if PRESSURE in limits and scene.brake.linings.area is None:
        reader.fault(PRESSURE, "needs the areas of the linings", "give brake.linings.area")
    known = (*metric_names(scene), PRESSURE)
    try:
        check_metrics(scene, [name for name in limits if name != PRESSURE])
    except InputError as error:
        reader.faults += error.faults
    for name, value in ((name, value) for name, value in limits.items() if name in known):
        unit = "Pa" if name == PRESSURE else unit_of(name)
        number = reader.number(_plain(value), Quantity(unit, "greatest permissible value"), f"limits[{name!r}]", unit)
        read |= {} if number is BAD else {name: number}
    return read, reader.faults


def _plain(value: Any) -> Any:
    """A number of NumPy as one of Python, which a reader knows."""
    return value.item() if isinstance(value, np.generic) else value


def limits_of(result: Result, summary: dict[str, Any], limits: Mapping[str, float]) -> list[Limit]:
    """All limits with their verdicts, the scene's own first."""
    scene, m = result.scene, summary["metrics"]
    rows = [_linings(scene, summary, limits)]
    known = metric_names(scene)
    for name in ("peak_rim_temperature", "max_tension", "max_normal_load"):
        if name in known and name not in limits:
            rows.append(Limit(words_of(name), Number("—"), number(m[name], unit_of(name)), "no limit"))
    for name, bound in limits.items():
        if name == _HOT:
            continue
        if name == PRESSURE:
            value, unit, when = float(np.max(np.asarray(lining_peak(result, "pressure")))), "Pa", ""
        else:
            value, unit = float(measure(result, name)), unit_of(name)
            time = summary["at"].get(f"{name}_time")
            when = "" if time is None else f"greatest at {number(time, 's')}"
        rows.append(_judged(words_of(name), bound, value, unit, when))
    rows += _marks(scene, summary)
    if not result.ok:  # nobody knows how it would have gone on
        rows = [row._replace(verdict="kept so far") if row.verdict == "kept" else row for row in rows]
    return rows


def _judged(what: str, bound: float, value: float, unit: str, words: str) -> Limit:
    """What did not happen (an infinite time) kept no limit: a run that does not stop passed its stopping time."""
    verdict = "kept" if value <= bound else "passed"
    words = words if np.isfinite(value) else "did not happen in this run"
    return Limit(what, number(bound, unit), number(value, unit), verdict, words)


def _linings(scene: Scene, summary: dict[str, Any], limits: Mapping[str, float]) -> Limit:
    what, heat, value = "Permissible temperature of the linings", scene.heat, summary["metrics"].get(_HOT)
    if heat is None:
        return Limit(what, Number("—"), Number("—"), "not examined", "the scene has no thermal part")
    own = None if heat.permissible is None else float(np.asarray(heat.permissible))
    bound = float(limits[_HOT]) if _HOT in limits else own
    if value is None:
        words = "the thermal part names no place as that of the linings"
        return Limit(what, number(bound, "K"), Number("—"), "not examined", words)
    if bound is None:
        return Limit(what, Number("—"), number(value, "K"), "no limit")
    times = [event["time"] for event in summary["events"] if event["name"] == "permissible_temperature"]
    hottest = f"hottest at {number(summary['at'][f'{_HOT}_time'], 's')}"
    if value <= bound or bound != own:
        return _judged(what, bound, value, "K", hottest)
    often = "" if len(times) < 2 else f", {len(times)} times in all"
    words = f"first passed at {number(min(times), 's')}{often}" if times else "above it from the start"
    return Limit(what, number(bound, "K"), number(value, "K"), "passed", f"{words}; {hottest}")


def _marks(scene: Scene, summary: dict[str, Any]) -> list[Limit]:
    """Limits of the brake itself, which the run watches."""
    rows = []
    times = {event["name"]: event["time"] for event in reversed(summary["events"])}
    if scene.heat is not None and read_by_linings(scene).T and scene.brake.bandage is None:
        greatest = Number("—")
        if isinstance(scene.duty.slack_tension, AbstractSpeedLever):
            greatest = number(scene.duty.slack_tension.greatest(), "N")
        rows.append(_mark("Grip: the sliding brake outweighs its load", greatest, times.get("grip_lost")))
    if "self_locking" in times:
        rows.append(_mark("No lining locks itself", Number("—"), times["self_locking"]))
    return rows


def _mark(what: str, bound: Number, time: float | None) -> Limit:
    if time is None:
        return Limit(what, bound, Number("—"), "kept")
    return Limit(what, bound, Number("—"), "passed", f"first at {number(time, 's')}")
