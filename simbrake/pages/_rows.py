"""Rows of the report of a run and its scene: verdict, key figures, tables of events and
energies, parts, duty."""

import dataclasses
import functools
import itertools
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from .._base._numbers import Number, digits, number, numbers, reading
from .._base._part import about_of, below, parts_below
from .._base._table import Column, Table
from ..loads import (
    AbstractLoad,
    Cylinder,
    Driller,
    HookLoad,
    Lever,
    SpeedHold,
    StringLoad,
    TorqueLoad,
    TrippingLoad,
)
from ..outputs.duty import totals
from ..outputs.energies import Balance, energy_balance, heat_balance
from ..outputs.judgement import Colour
from ..outputs.log import Event, plain_words
from ..outputs.metrics import HOLDING, METRICS
from ..parts.scene import Scene, paths_without_meaning
from ..phases import Phases
from ..profiles import (
    AbstractProfile,
    Constant,
    ExponentialRise,
    FunctionProfile,
    PiecewiseLinear,
    Repeated,
)
from ..runs.findings import (
    event_groups,
    hottest_first,
    linings_of,
    place_and_time,
    title_of,
    upper,
    words_of_energies,
)
from ..runs.report import Report
from ..runs.result import Result

#: what `Result.summary` returns
Summary: TypeAlias = dict[str, Any]

# --- tables --------------------------------------------------------------------------
# a hidden column belongs to another one: `what_note` is below `what`, `time_end` ends
# it

#: classes of badges by the colour of what they say
BADGES = {Colour.RED: "bad", Colour.AMBER: "open", Colour.GREEN: "good", None: ""}


#: metrics of the first stop of a run
_FIRST_STOP = (
    "slip_onset_time",
    "full_slip_time",
    "stopping_time",
    "stopping_angle",
    "hook_travel",
)


#: torques at the end of a run that does not stop
_TORQUES = {
    "load_torque": "Load torque at the end",
    "brake_torque": "Torque of the sliding brake at the end",
}
#: travels (m) below which one sees nothing: of a lever whose band hardly stretches, of
#: a hook that ends where it began
_SEEN = {"lever_travel": 1e-3, "total_hook_travel": 1e-3}
#: significant digits of a tile; all are in its tooltip
_DIGITS = 3


def in_prose(text: str) -> str:
    """A text whose numbers have no more digits than a tile; what is nearly 1 keeps its
    own, and what rounding has left of 0 is 0."""

    def rounded(found: re.Match[str]) -> str:
        shown = digits(float(found[0]), _DIGITS)
        return found[0] if shown == "1" else shown

    text = re.sub("[0-9][0-9.]*·10⁻(⁹|[¹²³][⁰¹²³⁴⁵⁶⁷⁸⁹])", "0", text)
    return re.sub(r"\b\d+\.\d+\b", rounded, text)


class Tile(NamedTuple):
    """A key figure of a page: words, value, note below it; `decides`: it is among those
    that come first, and larger."""

    words: str
    value: Number
    note: str
    decides: bool = False


def _of_stops(rows: Sequence[Summary]) -> list[Tile]:
    """The longest braking, and the most friction heat of one stop."""
    sums = totals(rows)
    tiles = []
    for words, column, unit, worst in (
        ("Longest braking", "braking_time", "s", sums["slowest"]),
        ("Maximum friction heat of a stop", "energy", "J", sums["hottest"]),
    ):
        value = number(worst[column], unit, count=_DIGITS)
        tiles.append(Tile(words, value, f"in stop {worst['stop']}", True))
    return tiles


def deciding(values: Mapping[str, float | None]) -> list[str]:
    """Metrics that decide, in order: time and travel of the stop, the hottest body, the
    holding reserve."""
    there = [name for name, x in values.items() if x is not None and math.isfinite(x)]
    travel = "hook_travel" if "hook_travel" in there else "stopping_angle"
    hottest = hottest_first({name: values[name] for name in there})[:1]
    wanted = ("stopping_time", travel, *hottest, HOLDING)
    return [name for name in wanted if name in there]


def key_figures(report: Report) -> list[Tile]:
    """Metrics of the run in words, with their value, lining and time, those that decide
    first; of several stops the worst one."""
    summary = report.summary
    tiles = []
    values = {name: report.metrics.get(name) for name in METRICS}
    if "stops" in summary:
        tiles = _of_stops(summary["stops"])
        values |= dict.fromkeys(_FIRST_STOP)
    decide = deciding(values)
    for name in (*decide, *(name for name in METRICS if name not in decide)):
        shown = values[name]
        if shown is not None and (name in decide or abs(shown) >= _SEEN.get(name, 0)):
            title = title_of(name, report.result.scene)
            value = number(shown, METRICS[name].unit, count=_DIGITS)
            place = place_and_time(name, report, 4)
            tiles.append(Tile(title, value, place, name in decide))
    torques = summary["capacity"] or {}
    for name, words in _TORQUES.items():
        if name in torques:
            value = number(torques[name], "N*m", count=_DIGITS)
            tiles.append(Tile(words, value, "", True))
    heat = number(summary["energy"]["friction_heat"], "J", count=_DIGITS)
    tiles.append(Tile("Friction heat", heat, ""))
    return sorted(tiles, key=lambda tile: not tile.decides)


EVENT = Column("event", left=True, show=lambda name: name.replace("_", " "))


def event_table(events: Sequence[Event]) -> Table:
    """The log; events of one name at linings that follow each other are one row, each
    of them in `meaning_members`."""
    rows = []
    for group in event_groups(events):
        name = group[0].name
        phase = group[0].phase
        members = [(event.lining, number(event.time, "s")) for event in group]
        first = members[0][1]
        last = members[-1][1]
        meaning = f"{phase} ended" if phase else plain_words(name)
        until = None if str(last) == str(first) else last
        each = members if len(group) > 1 else []
        rows.append((first, name, linings_of(group), meaning, until, each))
    hidden = [Column("time_end", hidden=True), Column("meaning_members", hidden=True)]
    return Table([Column("time"), EVENT, "lining", "meaning", *hidden], rows)


def ledgers(result: Result) -> Iterator[dict[str, Any]]:
    """The balance of energy; with a thermal part also that of heat.

    Of each the title, both sides, and how well they agree. A term is in J and in
    percent of its side, `hue` its place in the colours; negative ones are shown on the
    other side.
    """
    e = result.report().summary["energy"]
    pairs = result.scene.brake.pairs
    into, out = energy_balance(e)
    if len(pairs) > 1:
        del out["friction_heat"]
        each = {
            f"friction heat, {x.words}": e[f"heat_{name}"] for name, x in pairs.items()
        }
        out = each | out
    words = words_of_energies(result.scene)
    yield _ledger("Mechanical energy", Balance(into, out), e["closure"], words)
    if "heat_stored" in e:
        into, out = heat_balance(e)
        del out["heat_stored"]
        stored = {f"stored in {name}": x for name, x in result.stored_heat.items()}
        yield _ledger("Heat", Balance(into, stored | out), e["heat_closure"], words)


def _ledger(
    title: str, balance: Balance, residual: float, words: Mapping[str, str]
) -> dict[str, Any]:
    # (what left the range of numbers in a failed run is no number)
    numbers = (
        {name: np.nan if x is None else float(x) for name, x in side.items()}
        for side in balance
    )
    both = Balance(*numbers).positive
    totals = [sum(side.values()) for side in both]
    hues = itertools.count()
    into, out = (
        [
            {
                "words": upper(words.get(name, name)),
                "value": number(x, "J", beside=max(totals)),
                "percent": 100 * x / total,
                "hue": next(hues),
            }
            for name, x in side.items()
        ]
        for side, total in zip(both, totals, strict=True)
    )
    return {
        "title": title,
        "into": into,
        "out": out,
        "total": number(max(totals), "J"),
        "closure": digits(residual, 2),
    }


# --- equipment and duty -------------------------------------------------------------

#: replaces docstrings of parts that address programmers
_WORDS = {
    "Scene": "One run of a brake.",
    "Lining": "The linings, counted from the slack to the tight end.",
}
#: actuation, by the field of the duty
_LEVER = {
    "slack_tension": "Lever, slack tension",
    "force": "Actuator, force on each pad or shoe",
}


def parts_of(scene: Scene) -> list[dict[str, Any]]:
    """A scene and all parts below it: path, kind, what that is in words, and own fields
    (path, meaning, value).

    Without fields that mean nothing in this scene, and parts that have no others.
    """
    absent = paths_without_meaning(scene)
    parts = []
    for path, part, unit in parts_below(scene):
        rows = []
        for field in dataclasses.fields(part):
            value = getattr(part, field.name)
            field_path = below(path, field)
            about = about_of(field, unit)
            whole = field.metadata.get("whole")
            if field_path in absent or next(parts_below(value), None) is not None:
                continue
            if about is not None:
                meaning = about.meaning
                shown = Number("not given")
                if value is not None:
                    shown = numbers(value, about.unit, absolute=not about.difference)
            elif value is not None and value is not False and (words := _plain(value)):
                meaning = whole.meaning if whole else field.name.replace("_", " ")
                shown = Number(words)
            else:
                continue
            rows.append({"path": field_path, "meaning": meaning, "value": shown})
        kind = type(part).__name__
        words = _WORDS.get(kind, _said_of(part))
        if rows:
            parts.append({"path": path, "kind": kind, "words": words, "rows": rows})
    return parts


def _said_of(node: object) -> str:
    """The first paragraph of a part's docstring."""
    summary = (type(node).__doc__ or "").strip().partition("\n\n")[0]
    return " ".join(summary.replace("`", "").split())


def _plain(value: object) -> str:
    """Fields that are neither numbers nor parts: names, counts, functions."""
    if callable(value):
        return getattr(value, "__qualname__", type(value).__name__)
    return (
        ", ".join(str(entry) for entry in value)
        if isinstance(value, tuple | list)
        else str(value)
    )


_five = functools.partial(number, count=5)


def _points(profile: PiecewiseLinear | Repeated, unit: str) -> str:
    """`2 kN at 0 s, 24 kN at 0.35 s`, in one unit for all values."""
    values = profile.values
    read = reading(unit, float(np.max(np.abs(values), initial=0.0)))
    shown = [
        f"{digits(v, 5)} {read.name} at {digits(t, 5)} s"
        for t, v in zip(profile.times, read(values), strict=True)
    ]
    if len(shown) > 8:
        shown = [*shown[:4], f"… {len(shown) - 6} more …", *shown[-2:]]
    return ", ".join(shown)


def profile_words(profile: AbstractProfile | Phases, unit: str) -> str:
    """A given function of time in words; `unit` is that of its values."""
    match profile:
        case Phases():
            each = [
                (
                    f"{phase.name or i + 1}: {profile_words(phase.lever, unit)}, until "
                    f"{phase.until.words}"
                )
                for i, phase in enumerate(profile.phases)
            ]
            return f"{profile.count} cycles of phases; " + "; ".join(each)
        case Constant():
            return f"{_five(profile.level, unit)} at all times"
        case PiecewiseLinear():
            return f"straight lines through {_points(profile, unit)}; constant before and after"
        case Repeated():
            words = f"{profile.count} cycles of {number(profile.period, 's')} each"
            if profile.begin:
                words += f" from {number(profile.begin, 's')} on"
            return f"{words}, in each straight lines through {_points(profile, unit)}"
        case SpeedHold():
            return (
                f"as required to hold the speed, at most {_five(profile.limit, unit)}"
            )
        case Driller():
            speeds = _points(profile.speed, "rad/s")
            return (
                f"as required for a speed of {speeds}, at most "
                f"{_five(profile.limit, unit)}"
            )
        case ExponentialRise():
            rise = (
                f"rises from 0 at {number(profile.begin, 's')} towards "
                f"{_five(profile.level, unit)}"
            )
            return f"{rise} with the time constant {number(profile.time_constant, 's')}"
        case FunctionProfile():
            knots = np.size(profile.knots)
            corners = f", with {knots} corners or jumps" if knots else ""
            return f"a user-defined function, {_plain(profile.function)}{corners}"
        case Lever():
            return (
                f"a force on the lever, times {digits(float(profile.gain), 5)} (efficiency · "
                f"arm/slack arm): {profile_words(profile.force, 'N')}"
            )
        case Cylinder():
            words = f"a gauge pressure on {_five(profile.piston_area, 'm^2')}"
            if profile.spring:
                words += f" less {_five(profile.spring, 'N')} of a spring"
            words += f", times {digits(float(profile.gain), 5)} (efficiency · ratio)"
            if profile.dead_time:
                words += f", {number(profile.dead_time, 's')} later"
            if profile.lag is not None:
                words += f", with a lag of {number(profile.lag, 's')}"
            return f"{words}: {profile_words(profile.pressure, 'Pa')}"
    return f"{type(profile).__name__}: {_said_of(profile)}"


def load_words(load: AbstractLoad) -> str:
    """Load on the pulley, in words."""
    match load:
        case TorqueLoad():
            words = f"a torque on the shaft, {profile_words(load.profile, 'N*m')}"
        case HookLoad():
            torque = _five(load.mass * load.gravity * load.travel(), "N*m")
            end = "line" if load.words.hook == "load" else "hook"
            words = (
                f"{_five(load.mass, 'kg')} on the {end}, {_tackle(load)}: "
                f"{torque} on the shaft"
            )
        case TrippingLoad():
            words = (
                f"trip in {load.count} stands of {_five(load.stand, 'kg')}, one every "
                f"{number(load.period, 's')}: {_five(load.empty, 'kg')} of hook and "
                f"block, and from {number(load.taken, 's')} to {number(load.set, 's')} "
                f"of each cycle the string, initially {_five(load.string, 'kg')}; "
                f"{_tackle(load)}"
            )
        case StringLoad():
            string, stand, empty = (
                _five(m, "kg") for m in (load.string, load.stand, load.empty)
            )
            hook = f"on a hook of {empty} or in the slips; {_tackle(load)}"
            words = (
                f"a string of {string} in the first cycle, {stand} more in each, {hook}"
            )
        case _:
            return f"{type(load).__name__}: {_said_of(load)}"
    drag = f"; drag {_five(load.drag, 'N*m*s')} against the motion"
    return words + (drag if load.drag else "")


def _tackle(load: HookLoad | StringLoad | TrippingLoad) -> str:
    count = digits(load.line_count, 5)
    lines = "line" if count == "1" else "lines"
    words = (
        f"{count} {lines} strung, rope at {_five(load.drum_radius, 'm')} from the shaft"
    )
    if load.rope is not None:
        words += f" in the first layer, {digits(load.rope.turns, 5)} turns on the drum"
    if load.elasticity is not None:
        k = _five(load.elasticity.at_hook(load.line_count), "N/m")
        words += f", {k} at the hook"
    return words


def duty_words(scene: Scene) -> list[tuple[str, str]]:
    """Lever, load, start and end of a run, in words."""
    start = scene.initial
    rest = "" if float(scene.start_speed) else ", at rest"
    last = (
        "with the last phase, at the latest at "
        if isinstance(scene.duty.lever, Phases)
        else "at "
    )
    lever = profile_words(scene.duty.lever, "N")
    of = scene.brake.force_words
    rims = scene.brake.rims
    if rims > 1 and any(
        isinstance(part, Lever) for _, part, _ in parts_below(scene.duty.lever)
    ):
        lever = f"{lever}; shared by the bands of {rims} rims"
        of = ""
    return [
        (_LEVER[scene.duty.lever_field] + (f" ({of})" if of else ""), lever),
        ("Load", load_words(scene.duty.load)),
        (
            "Start",
            f"{number(scene.start_speed, 'rad/s')} at {digits(float(start.time))} s{rest}",
        ),
        ("End", f"{last}{digits(float(scene.end_time))} s"),
    ]
