"""Rows of the report of a run and its scene: verdict, key figures, tables of events and
energies, parts, duty."""

import dataclasses
import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from .._base._part import about_of, below, parts_below
from .._base._table import Column, Number, Table, digits, number, numbers, scale
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
from ..outputs.judgement import Colour
from ..outputs.log import STAGES, Event, plain_words
from ..outputs.metrics import (
    METRICS,
    RESIDUAL_SEES,
    Balance,
    energy_balance,
    heat_balance,
)
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
from ..runs.measure import LimitCheck, title_of, unit_of
from ..runs.result import Result
from ..studies._sensitivity import Sensitivity, SensitivityTable

#: what `Result.summary` returns
Summary: TypeAlias = dict[str, Any]

# --- tables --------------------------------------------------------------------------
# a hidden column belongs to another one: `what_note` is below `what`, `time_end` ends
# it, `verdict_kind` colours it

#: classes of badges by the colour of what they say
BADGES = {Colour.RED: "bad", Colour.AMBER: "open", Colour.GREEN: "good", None: ""}


def limit_table(checks: Sequence[LimitCheck]) -> Table:
    """Limits, verdicts of the run, and times."""
    columns = [
        "quantity",
        Column("limit"),
        Column("in this run"),
        Column("margin"),
        "verdict",
        "when",
    ]
    rows = [
        (
            title_of(check.name),
            number(check.limit, check.unit),
            number(check.value, check.unit),
            number(check.margin, check.unit, absolute=False),
            check.verdict,
            check.note,
            BADGES[check.verdict.colour],
        )
        for check in checks
    ]
    return Table([*columns, Column("verdict_kind", hidden=True)], rows)


#: metrics of the first stop of a run
_FIRST_STOP = (
    "slip_onset_time",
    "full_slip_time",
    "stopping_time",
    "stopping_angle",
    "hook_travel",
)


#: significant digits of a tile; all are in its tooltip
_DIGITS = 3


class Tile(NamedTuple):
    """A key figure of a page: words, value, note below it; `decides`: it is among those
    that come first, and larger."""

    words: str
    value: Number
    note: str
    decides: bool = False


def _of_stops(rows: Sequence[Summary]) -> list[Tile]:
    def tile(
        words: str, value: float, unit: str, note: str = "", decides: bool = False
    ) -> Tile:
        return Tile(words, number(value, unit, count=_DIGITS), note, decides)

    sums = totals(rows)
    slowest, hottest = (
        f"in stop {sums[name]['stop']}" for name in ("slowest", "hottest")
    )
    tiles = [
        tile("Longest braking", sums["slowest"]["braking_time"], "s", slowest, True),
        tile(
            "Maximum friction heat of a stop",
            sums["hottest"]["energy"],
            "J",
            hottest,
            True,
        ),
        Tile("Stops", Number(str(len(rows)), ""), ""),
        tile("Time in motion", sums["motion_time"], "s"),
        tile("Time of braking", sums["braking_time"], "s"),
        tile("Angle of all stops", sums["angle"], "rad"),
    ]
    if "travel" in sums:
        up = (
            f"{number(sums['upwards'], 'm', count=_DIGITS)} of it upwards"
            if sums["upwards"] > 0
            else ""
        )
        tiles.append(tile("Hook travel of all stops", sums["travel"], "m", up))
    return tiles


def deciding(values: Mapping[str, float | None]) -> list[str]:
    """Metrics that decide, in order: time and travel of the stop, the hottest body, the
    holding reserve."""
    there = [
        name
        for name, value in values.items()
        if value is not None and math.isfinite(value)
    ]
    travel = "hook_travel" if "hook_travel" in there else "stopping_angle"
    hot = [
        name
        for name in there
        if name.startswith("peak_") and name.endswith("temperature")
    ]
    hottest = [max(hot, key=lambda name: values[name] or 0.0)] if hot else []
    return [
        name
        for name in ("stopping_time", travel, *hottest, "min_holding_reserve")
        if name in there
    ]


def key_title(name: str, summary: Summary) -> str:
    """What a metric is called on a page, in the words of its kind of brake."""
    lining = summary.get("lining", "lining")
    body = summary.get("body", "rim")
    return METRICS[name].title.replace("lining", lining).replace("rim ", f"{body} ")


def key_figures(summary: Summary) -> list[Tile]:
    """Metrics of the run in words, with their value, lining and time, those that decide
    first; of several stops totals and the worst one."""
    tiles = _of_stops(summary["stops"]) if "stops" in summary else []
    at = summary["at"]
    lining = summary.get("lining", "lining")
    skipped = _FIRST_STOP if "stops" in summary else ()
    values = {
        name: value
        for name, value in summary["metrics"].items()
        if name in METRICS and name not in skipped
    }
    decide = deciding(values)
    for name in (*decide, *(name for name in METRICS if name not in decide)):
        value = values.get(name)
        if value is None:
            continue
        notes = [f"{lining} {at[f'{name}_lining']}"] if f"{name}_lining" in at else []
        notes += (
            [f"at {number(at[f'{name}_time'], 's', count=4)}"]
            if f"{name}_time" in at
            else []
        )
        shown = number(value, unit_of(name), count=_DIGITS)
        tiles.append(
            Tile(key_title(name, summary), shown, ", ".join(notes), name in decide)
        )
    capacity = summary["capacity"]
    if capacity is not None:
        torques = {
            "Load torque at the end": capacity["load_torque"],
            "Torque of the sliding brake at the end": capacity["brake_torque"],
        }
        tiles += [
            Tile(words, number(torque, "N*m", count=_DIGITS), "", True)
            for words, torque in torques.items()
        ]
    tiles.append(
        Tile(
            "Friction heat",
            number(summary["energy"]["friction_heat"], "J", count=_DIGITS),
            "",
        )
    )
    return sorted(tiles, key=lambda tile: not tile.decides)


EVENT = Column("event", left=True, show=lambda name: name.replace("_", " "))


def event_table(events: Sequence[Event]) -> Table:
    """The log; events of one name at linings that follow each other are one row, each
    of them in `meaning_members`."""

    def together(entry: tuple[int, Event]) -> tuple[str, int]:
        return entry[1].name, entry[0] if entry[1].lining is None else -1

    rows = []
    for (name, _), group in itertools.groupby(enumerate(events), together):
        alike = [event for _, event in group]
        members = [(event.lining, number(event.time, "s")) for event in alike]
        linings = [lining for lining, _ in members if lining is not None]
        many = len(members) > 1
        last, each = (members[-1][1], members) if many else (None, [])
        last = None if str(last) == str(members[0][1]) else last
        meaning = f"{alike[0].phase} ended" if alike[0].phase else plain_words(name)
        rows.append((members[0][1], name, _span(linings), meaning, last, each))
    hidden = [Column("time_end", hidden=True), Column("meaning_members", hidden=True)]
    return Table([Column("time"), EVENT, "lining", "meaning", *hidden], rows)


def _span(linings: list[int]) -> str:
    if len(linings) <= 1:
        return "".join(str(i) for i in linings)
    if len(linings) == abs(linings[-1] - linings[0]) + 1 and sorted(linings) in (
        linings,
        linings[::-1],
    ):
        return f"{linings[0]}…{linings[-1]}"
    return f"{len(linings)} times"


def event_counts(events: Sequence[Event]) -> Table:
    """Events by name, in the order of the first of each."""
    times: dict[str, list[float]] = {}
    for event in events:
        times.setdefault(event.name, []).append(event.time)
    rows = [
        (name, len(t), number(min(t), "s"), number(max(t), "s"), plain_words(name))
        for name, t in times.items()
    ]
    return Table(
        [EVENT, Column("count"), Column("first"), Column("last"), "meaning"],
        rows,
        "Events by name",
    )


#: columns of the stages of a staged brake: heading and unit, by their names in the
#: summary
_STAGE = {
    "start": ("from", "s"),
    "end": ("to", "s"),
    "duration": ("lasted", "s"),
    "heat_external": ("heat, band on linings", "J"),
    "heat_internal": ("heat, linings on rim", "J"),
    "load_work": ("work of the load", "J"),
    "lever_work": ("work of the lever", "J"),
}


def stage_table(summary: Summary) -> Table:
    """Stages in order: start, end, duration, heat of both pairs, work of load and
    lever."""
    columns = [Column(name, heading=heading) for name, (heading, _) in _STAGE.items()]
    rows = [
        (
            stage["name"].replace("_", " "),
            *(number(stage[name], unit) for name, (_, unit) in _STAGE.items()),
            STAGES.get(stage["name"], ""),
        )
        for stage in summary.get("stages", [])
    ]
    return Table(["stage", *columns, Column("stage_note", hidden=True)], rows)


def tornado(table: SensitivityTable, most: int = 12) -> dict[str, Any]:
    """A tornado chart: effect of every parameter over its range, the largest on top;
    without ranges, elasticities.

    Of a bar the path and value of the parameter, the two ends, and where the derivative
    alone would lead (`tangents`). Places, of the metric's own value (`base`) as well,
    are in percent of the chart's width.
    """
    base, bars = table.bars(most)
    if any(len(ends) > 1 for _, ends in bars):
        caption = (
            "Metric at the lower (blue) and the upper (red) bound of each parameter's "
            "range, the others fixed; lines "
            "across the bars are where the derivative alone would lead to."
        )
    else:
        caption = "Percent of the metric for one percent of each parameter."
    bars.sort(key=lambda bar: -max(abs(x - base) for _, x in bar[1]))
    tangents = {
        row.path: [base - row.tangent, base + row.tangent] if row.tangent else []
        for row, _ in bars
    }
    every = [
        base,
        *(
            x
            for row, ends in bars
            for x in (*(end for _, end in ends), *tangents[row.path])
        ),
    ]
    low = min(every)
    width = max(max(every) - min(every), 1e-300)

    def place(x: float) -> float:
        return 100 * (x - low) / width

    def bar(row: Sensitivity, ends: Sequence[tuple[str, float]]) -> dict[str, Any]:
        half = (
            ""
            if row.half is None
            else f" ± {number(row.half, row.unit, absolute=False, count=3)}"
        )
        sides = []
        for side, x in ends:
            a, b = sorted((place(x), place(base)))
            words = (
                f", {side}er bound: {number(x, table.unit, count=6)}"
                if base
                else f": {Number(digits(x, 4))}"
            )
            sides.append(
                {"side": side, "x": a, "width": b - a, "words": f"{row.path}{words}"}
            )
        words = f"{number(row.value, row.unit, count=5)}{half}"
        return {
            "path": row.path,
            "words": words,
            "ends": sides,
            "tangents": [*map(place, tangents[row.path])],
        }

    return {
        "caption": caption,
        "bars": [bar(*pair) for pair in bars],
        "base": place(base),
    }


#: terms of both balances in words
_TERMS = {
    "load_work": "Work of the load",
    "lever_work": "Work of the lever",
    "motor_work": "Work of the motor",
    "kinetic_release": "Kinetic energy given up",
    "friction_heat": "Friction heat",
    "electrical_work": "Electrical work of friction",
    "mechanical_work": "Mechanical work of friction",
    "damper_heat": "Heat of dampers",
    "shaft_work": "Other torques on the shaft",
    "elastic_change": "Elastic energy",
    "heat_to_metal": "Friction heat into metal",
    "heat_to_linings": "Friction heat into linings",
    "heat_to_band": "Friction heat into the band",
    "heat_elsewhere": "Friction heat into no body",
    "heat_supplied": "Supplied",
    "heat_stored": "Stored",
    "heat_lost": "Lost to the surroundings and to no body",
    "heat_to_coolant": "Carried away by the coolant",
}


def ledgers(result: Result, summary: Summary) -> list[dict[str, Any]]:
    """The balance of energy; with a thermal part also that of heat.

    Of each the title, both sides, how well they agree, and what that does not tell. A
    term is in J and in percent of its side, `hue` its place in the colours; negative
    ones are shown on the other side.
    """
    e = summary["energy"]
    pairs = result.scene.brake.pairs

    def ledger(
        title: str,
        into: Mapping[str, float | None],
        out: Mapping[str, float | None],
        residual: float,
    ) -> Any:
        # (what left the range of numbers in a failed run is no number)
        sides = (
            {
                _TERMS.get(name, name): np.nan if value is None else value
                for name, value in side.items()
            }
            for side in (into, out)
        )
        sides = Balance(*sides).positive
        totals = [sum(side.values()) for side in sides]
        hues = itertools.count()

        def share(words: str, value: float, total: float) -> dict[str, Any]:
            shown = number(value, "J", beside=max(totals))
            return {
                "words": words,
                "value": shown,
                "percent": 100 * value / total,
                "hue": next(hues),
            }

        left, right = (
            [share(words, value, total) for words, value in side.items()]
            for side, total in zip(sides, totals, strict=True)
        )
        total = number(max(totals), "J")
        note = f"This residual is no error estimate: {RESIDUAL_SEES}."
        return {
            "title": title,
            "into": left,
            "out": right,
            "total": total,
            "closure": digits(residual, 2),
            "note": note,
        }

    into, out = energy_balance(e)
    if len(pairs) > 1:
        del out["friction_heat"]
        out = {
            f"Friction heat, {place.words}": e[f"heat_{pair}"]
            for pair, place in pairs.items()
        } | out
    balances = [ledger("Mechanical energy", into, out, e["closure"])]
    if "heat_stored" in e:
        into, out = heat_balance(e)
        del out["heat_stored"]
        out = {
            f"Stored in {name}": float(value)
            for name, value in result.stored_heat.items()
        } | out
        balances.append(ledger("Heat", into, out, e["heat_closure"]))
    return balances


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
                shown = (
                    Number("not given")
                    if value is None
                    else numbers(value, about.unit, absolute=not about.difference)
                )
                rows.append(
                    {"path": field_path, "meaning": about.meaning, "value": shown}
                )
            elif value is not None and value is not False and (words := _plain(value)):
                meaning = (
                    field.name.replace("_", " ") if whole is None else whole.meaning
                )
                rows.append(
                    {"path": field_path, "meaning": meaning, "value": Number(words)}
                )
        kind = type(part).__name__
        if rows:
            parts.append(
                {
                    "path": path,
                    "kind": kind,
                    "words": _WORDS.get(kind, _said_of(part)),
                    "rows": rows,
                }
            )
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


def _points(profile: PiecewiseLinear | Repeated, unit: str) -> str:
    """`2 kN at 0 s, 24 kN at 0.35 s`, in one unit for all values."""
    times = np.asarray(profile.times)
    values = np.asarray(profile.values)
    factor, offset, name = scale(
        unit, float(np.max(np.abs(values), initial=0.0)), absolute=unit == "K"
    )
    shown = [
        f"{digits(v * factor + offset, 5)} {name} at {digits(t, 5)} s"
        for t, v in zip(times, values, strict=True)
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
            return f"{number(profile.level, unit, count=5)} at all times"
        case PiecewiseLinear():
            return f"straight lines through {_points(profile, unit)}; constant before and after"
        case Repeated():
            begin = (
                ""
                if float(profile.begin) == 0.0
                else f" from {number(profile.begin, 's')} on"
            )
            cycles = (
                f"{profile.count} cycles of {number(profile.period, 's')} each{begin}"
            )
            return f"{cycles}, in each straight lines through {_points(profile, unit)}"
        case SpeedHold():
            return f"as required to hold the speed, at most {number(profile.limit, unit, count=5)}"
        case Driller():
            speeds = _points(profile.speed, "rad/s")
            return (
                f"as required for a speed of {speeds}, at most "
                f"{number(profile.limit, unit, count=5)}"
            )
        case ExponentialRise():
            rise = (
                f"rises from 0 at {number(profile.begin, 's')} towards "
                f"{number(profile.level, unit, count=5)}"
            )
            return f"{rise} with the time constant {number(profile.time_constant, 's')}"
        case FunctionProfile():
            knots = np.asarray(profile.knots).size
            corners = f", with {knots} corners or jumps" if knots else ""
            return f"a user-defined function, {_plain(profile.function)}{corners}"
        case Lever():
            force = profile_words(profile.force, "N")
            return (
                f"a force on the lever, times {digits(float(profile.gain), 5)} "
                f"(efficiency · arm/slack arm): {force}"
            )
        case Cylinder():
            area = number(profile.piston_area, "m^2", count=5)
            gain = digits(float(profile.gain), 5)
            spring = (
                f" less {number(profile.spring, 'N', count=5)} of a spring"
                if float(profile.spring)
                else ""
            )
            late = (
                f", {number(profile.dead_time, 's')} later"
                if float(profile.dead_time)
                else ""
            )
            late += (
                ""
                if profile.lag is None
                else f", with a lag of {number(profile.lag, 's')}"
            )
            pressure = profile_words(profile.pressure, "Pa")
            return (
                f"a gauge pressure on {area}{spring}, times {gain} (efficiency · "
                f"ratio){late}: {pressure}"
            )
    return f"{type(profile).__name__}: {_said_of(profile)}"


def load_words(load: AbstractLoad) -> str:
    """Load on the pulley, in words."""
    match load:
        case TorqueLoad():
            words = f"a torque on the shaft, {profile_words(load.profile, 'N*m')}"
        case HookLoad():
            torque = number(load.mass * load.gravity * load.travel(), "N*m", count=5)
            words = (
                f"{number(load.mass, 'kg', count=5)} on the hook, {_tackle(load)}: "
                f"{torque} on the shaft"
            )
        case TrippingLoad():
            words = (
                f"trip in {load.count} stands of {number(load.stand, 'kg', count=5)}, one every "
                f"{number(load.period, 's')}: {number(load.empty, 'kg', count=5)} of "
                "hook and block, and from "
                f"{number(load.taken, 's')} to {number(load.set, 's')} of each cycle "
                "the string, initially "
                f"{number(load.string, 'kg', count=5)}; {_tackle(load)}"
            )
        case StringLoad():
            string, stand, empty = (
                number(m, "kg", count=5) for m in (load.string, load.stand, load.empty)
            )
            hook = f"on a hook of {empty} or in the slips; {_tackle(load)}"
            words = (
                f"a string of {string} in the first cycle, {stand} more in each, {hook}"
            )
        case _:
            return f"{type(load).__name__}: {_said_of(load)}"
    return words + (
        f"; drag {number(load.drag, 'N*m*s', count=5)} against the motion"
        if float(load.drag)
        else ""
    )


def _tackle(load: HookLoad | StringLoad | TrippingLoad) -> str:
    count = digits(float(load.line_count), 5)
    radius = number(load.drum_radius, "m", count=5)
    layers = (
        ""
        if load.rope is None
        else f" in the first layer, {digits(float(load.rope.turns), 5)} turns on the drum"
    )
    k = (
        ""
        if load.elasticity is None
        else number(load.elasticity.at_hook(load.line_count), "N/m", count=5)
    )
    return f"{count} lines strung, rope at {radius} from the shaft{layers}" + (
        f", {k} at the hook" if k else ""
    )


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
