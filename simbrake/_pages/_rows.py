"""What a page says of a run and its scene, as plain rows: verdict, figures, events, energies, parts, duty."""

import dataclasses
import functools
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from .._base._quantity import Quantity, about_of, unit_below
from .._base._table import Number, digits, number, numbers, scale
from .._parts._scene import Scene
from .._run._log import EVENTS, STAGES, Event, Status
from .._run._measure import PRESSURE, LimitCheck, LimitVerdict
from .._run._metrics import METRICS
from .._run._result import Result
from ..loads import AbstractLoad, Driller, HookLoad, Lever, SpeedHold, TorqueLoad, TrippingLoad
from ..profiles import AbstractProfile, Constant, ExponentialRise, FunctionProfile, PiecewiseLinear, Repeated

#: ends of a run with the pulley at rest
_AT_REST = (Status.STOPPED, Status.HELD)


def words_of(name: str) -> str:
    """A metric in words."""
    if name.startswith("energy."):
        return f"Energy: {name.removeprefix('energy.').replace('_', ' ')}"
    if name == PRESSURE:
        return "Greatest mean pressure on a lining"
    base = name.removesuffix("_time")
    if name not in METRICS and base in METRICS:
        return f"{METRICS[base].title}, when"
    return METRICS[name].title if name in METRICS else name.replace("_", " ").capitalize()


class Verdict(NamedTuple):
    """How a run ended: `kind` is `good`, `open` or `bad`, `text` says it in one line."""

    kind: str
    status: str
    text: str


def verdict(result: Result, summary: dict[str, Any], checks: Sequence[LimitCheck]) -> Verdict:
    """How the run ended, with limits that it exceeds, stop time, hook travel and closure."""
    m, closure = summary["metrics"], summary["energy"]["closure"]
    exceeded = [check for check in checks if check.verdict == LimitVerdict.EXCEEDED]
    limits = [_exceeded(check) for check in exceeded]
    if not result.ok:
        return Verdict("bad", f"failed: {summary['status']}", "; ".join([summary["message"], *limits]))
    words = [summary["message"], *limits]
    if m["stopping_time"] is not None:
        words.append(f"stop after {number(m['stopping_time'], 's')}")
    if m["hook_travel"] is not None:
        words.append(f"hook travel {number(m['hook_travel'], 'm')}")
    words.append(f"the energies close to {digits(closure, 2)} of the largest exchanged")
    status = Status(summary["status"])
    kind = "bad" if exceeded or status is Status.RUNAWAY else "good" if status in _AT_REST else "open"
    said = status.replace("_", " ") + (", limit exceeded" if exceeded else "")
    return Verdict(kind, said, "; ".join(words))


def _exceeded(check: LimitCheck) -> str:
    """A limit that is exceeded, in words."""
    limit = number(check.limit, check.unit)
    if check.margin is None:
        return f"limit exceeded: {words_of(check.name)} {check.note}, limit {limit}"
    value, over = number(check.value, check.unit), number(-check.margin, check.unit, absolute=False)
    return f"limit exceeded: {words_of(check.name)} {value}, limit {limit}, exceeded by {over}"


class LimitRow(NamedTuple):
    """A limit in the table of the page; `kind` colours its verdict: `good`, `bad` or none."""

    what: str
    permissible: Number
    found: Number
    margin: Number
    verdict: str
    kind: str
    note: str


def limit_rows(checks: Sequence[LimitCheck]) -> list[LimitRow]:
    """Limits for reading."""
    kinds = {LimitVerdict.EXCEEDED: "bad", LimitVerdict.WITHIN: "good", LimitVerdict.WITHIN_SO_FAR: "good"}
    return [
        LimitRow(
            words_of(check.name),
            number(check.limit, check.unit),
            number(check.value, check.unit),
            number(check.margin, check.unit, absolute=False),
            str(check.verdict),
            kinds.get(check.verdict, ""),
            check.note,
        )
        for check in checks
    ]


class Figure(NamedTuple):
    """A number worth knowing at a glance, and when or where it occurred."""

    words: str
    value: Number
    note: str = ""


def key_figures(summary: dict[str, Any], units: Any) -> list[Figure]:
    """Metrics of the run with their time and lining; `units` gives the SI unit of a metric."""
    found = []
    at, lining, body = summary["at"], summary.get("lining", "lining"), summary.get("body", "rim")
    for name, metric in METRICS.items():
        value = summary["metrics"].get(name)
        if value is None:
            continue
        words = metric.title.replace("lining", lining).replace("rim ", f"{body} ")
        notes = []
        if f"{name}_lining" in at:
            notes.append(f"{lining} {at[f'{name}_lining']}")
        if f"{name}_time" in at:
            notes.append(f"at {number(at[f'{name}_time'], 's', count=4)}")
        found.append(Figure(words, number(value, units(name), count=5), ", ".join(notes)))
    capacity = summary["capacity"]
    if capacity is not None:
        found.append(Figure("Load torque at the end", number(capacity["load_torque"], "N*m", count=5)))
        words = "Torque of the sliding brake at the end"
        found.append(Figure(words, number(capacity["brake_torque"], "N*m", count=5)))
    found.append(Figure("Friction heat", number(summary["energy"]["friction_heat"], "J", count=5)))
    return found


class EventRow(NamedTuple):
    """One event, or several of one name at several linings that follow each other: these in `members`."""

    name: str
    meaning: str
    start: Number
    end: Number | None
    linings: str
    members: tuple[tuple[int, Number], ...] = ()


def event_rows(events: Sequence[Event]) -> list[EventRow]:
    """The log, with events of one name at linings that follow each other drawn together."""
    rows: list[EventRow] = []
    i = 0
    while i < len(events):
        j = i + 1
        while events[i].lining is not None and j < len(events) and events[j].name == events[i].name:
            j += 1
        group = events[i:j]
        first, last = number(group[0].time, "s"), number(group[-1].time, "s")
        linings = [event.lining for event in group if event.lining is not None]
        members = tuple((event.lining or 0, number(event.time, "s")) for event in group) if len(group) > 1 else ()
        rows.append(
            EventRow(
                group[0].name,
                _words_of_event(group[0].name),
                first,
                last if members else None,
                _span(linings),
                members,
            )
        )
        i = j
    return rows


def _words_of_event(name: str) -> str:
    """What an event means, in plain words; nothing for a name that is not known."""
    return EVENTS[name].plain if name in EVENTS else ""


def _span(linings: list[int]) -> str:
    if len(linings) <= 1:
        return "".join(str(i) for i in linings)
    if len(linings) == abs(linings[-1] - linings[0]) + 1 and sorted(linings) in (linings, linings[::-1]):
        return f"{linings[0]}…{linings[-1]}"
    return f"{len(linings)} times"


class EventCount(NamedTuple):
    """All events of one name: how many, the first and the last."""

    name: str
    meaning: str
    count: int
    first: Number
    last: Number


def event_counts(events: Sequence[Event]) -> list[EventCount]:
    """Events by name, in the order of the first of each."""
    times: dict[str, list[float]] = {}
    for event in events:
        times.setdefault(event.name, []).append(event.time)
    return [
        EventCount(name, _words_of_event(name), len(t), number(min(t), "s"), number(max(t), "s"))
        for name, t in times.items()
    ]


class StageRow(NamedTuple):
    """A stage of a staged brake: name, what the pairs do, times and energies."""

    name: str
    meaning: str
    cells: tuple[Number, ...]


def stage_rows(summary: dict[str, Any]) -> list[StageRow]:
    """Stages in order: start, end, duration, heat of both pairs, work of load and lever."""
    columns = (("start", "s"), ("end", "s"), ("duration", "s"), ("heat_external", "J"), ("heat_internal", "J"))
    columns = (*columns, ("load_work", "J"), ("lever_work", "J"))
    return [
        StageRow(
            stage["name"].replace("_", " "),
            STAGES.get(stage["name"], ""),
            tuple(number(stage[name], unit) for name, unit in columns),
        )
        for stage in summary.get("stages", [])
    ]


class Share(NamedTuple):
    """One term of a ledger: how much (J), and its share of the side in percent; `hue` is its place in the colours."""

    words: str
    value: Number
    percent: float
    hue: int


class Ledger(NamedTuple):
    """A balance: what came in, what became of it, and how well the two sides agree."""

    title: str
    into: tuple[Share, ...]
    out: tuple[Share, ...]
    total: Number
    closure: str
    note: str = ""


def ledger(title: str, into: dict[str, float], out: dict[str, float], closure: float, note: str = "") -> Ledger:
    """Both sides of a balance; what is negative stands on the other side."""
    sides: tuple[list[tuple[str, float]], list[tuple[str, float]]] = ([], [])
    for side, terms in enumerate((into, out)):
        for words, value in terms.items():
            if value:
                sides[side if value > 0 else 1 - side].append((words, abs(value)))
    totals = [sum(value for _, value in side) for side in sides]
    hues = iter(range(100))
    shares = [
        tuple(
            Share(words, number(value, "J", beside=max(totals)), 100 * value / total, next(hues))
            for words, value in side
        )
        for side, total in zip(sides, totals, strict=True)
    ]
    return Ledger(title, shares[0], shares[1], number(max(totals), "J"), digits(closure, 2), note)


def ledgers(result: Result, summary: dict[str, Any]) -> list[Ledger]:
    """Where the energy came from and what became of it; with a thermal part, where the heat is."""
    e = summary["energy"]
    into = {
        "Work of the load": e["load_work"],
        "Work of the lever": e["lever_work"],
        "Kinetic energy given up": -e["kinetic_change"],
    }
    pairs = result.scene.brake.pairs
    out = {"Friction heat": e["friction_heat"]}
    if len(pairs) > 1:
        out = {f"Friction heat, {place.words}": e[f"heat_{pair}"] for pair, place in pairs.items()}
    for name, words in (
        ("electrical_work", "Electrical work of friction"),
        ("mechanical_work", "Mechanical work of friction"),
    ):
        if name in e:
            out[words] = e[name]
    out["Heat of dampers"] = e.get("damper_heat", 0.0)
    if "elastic_change" in e:
        out["Elastic energy of the band"] = e["elastic_change"]
    found = [ledger("Mechanical energy", into, out, e["closure"])]
    if "heat_stored" in e:
        stored = {f"Stored in {name}": float(value) for name, value in result.stored_heat.items()}
        entered = [
            f"{place} {number(e[f'heat_to_{name}'], 'J')}"
            for name, place in (("metal", "metal"), ("linings", "linings"), ("band", "band"))
            if e[f"heat_to_{name}"]
        ]
        note = f"The friction heat entered: {', '.join(entered)}." if entered else ""
        into = {"Friction heat": e["friction_heat"], "Supplied": e["heat_supplied"]}
        out = {**stored, "Lost to the surroundings": e["heat_lost"]}
        found.append(ledger("Heat", into, out, e["heat_closure"], note))
    return found


# --- installation and duty --------------------------------------------------------------------------------------------

#: where the docstring of a part speaks to programmers
_WORDS = {"Scene": "One run of a brake.", "Lining": "The linings, counted from the slack to the tight end."}


#: what the lever gives, by the field of the duty
_LEVER = {"slack_tension": "Lever, slack tension", "force": "Actuator, force on each pad or shoe"}


class Row(NamedTuple):
    """One field of a part: its path in the scene, what it means, and its value."""

    path: str
    meaning: str
    value: Number


class Part(NamedTuple):
    """One part of a scene: its path, its kind, what that is in words, and its own fields."""

    path: str
    kind: str
    words: str
    rows: tuple[Row, ...]


def parts_of(node: Any, path: str = "", unit: str = "SI") -> list[Part]:
    """A part of a scene and all parts below it, in the order of the fields; `unit`: what `SI` means here."""
    if isinstance(node, tuple | list):
        return [part for i, child in enumerate(node) for part in parts_of(child, f"{path}[{i}]", unit)]
    if not _is_part(node):
        return []
    rows: list[Row] = []
    below: list[Part] = []
    for field in dataclasses.fields(node):
        value, here = getattr(node, field.name), f"{path}.{field.name}" if path else field.name
        if _is_part(value) or (isinstance(value, tuple | list) and any(_is_part(one) for one in value)):
            below += parts_of(value, here, unit_below(field, unit))
        elif (about := about_of(field, unit)) is not None:
            rows.append(Row(here, about.meaning, _value(value, about)))
        elif value is not None and not (isinstance(value, tuple | list) and not value):
            known = field.metadata.get("whole")
            meaning = field.name.replace("_", " ") if known is None else known.meaning
            rows.append(Row(here, meaning, Number(_plain(value))))
    kind = type(node).__name__
    return [Part(path, kind, _WORDS.get(kind, _said_of(node)), tuple(rows)), *below]


def _said_of(node: Any) -> str:
    """The first line of a part's docstring."""
    return (type(node).__doc__ or "").strip().partition("\n")[0].replace("`", "")


def _is_part(node: Any) -> bool:
    return dataclasses.is_dataclass(node) and not isinstance(node, type)


def _value(value: Any, about: Quantity) -> Number:
    if value is None:
        return Number("not given")
    return numbers(value, about.unit, absolute=about.unit == "K" and not about.difference)


def _plain(value: Any) -> str:
    """What is neither number nor part: names, counts, functions."""
    if callable(value):
        return getattr(value, "__qualname__", type(value).__name__)
    if isinstance(value, tuple | list):
        return ", ".join(str(one) for one in value)
    return str(value)


def _points(times: Sequence[float], values: Sequence[float], unit: str) -> str:
    """`2 kN at 0 s, 24 kN at 0.35 s`, in one unit for all values."""
    factor, offset, name = scale(unit, float(np.max(np.abs(values), initial=0.0)), absolute=unit == "K")
    shown = [f"{digits(v * factor + offset, 5)} {name} at {digits(t, 5)} s" for t, v in zip(times, values, strict=True)]
    if len(shown) > 8:
        shown = [*shown[:4], f"… {len(shown) - 6} more …", *shown[-2:]]
    return ", ".join(shown)


@functools.singledispatch
def profile_words(profile: AbstractProfile, unit: str) -> str:
    """A given function of time in words; `unit` is that of its values."""
    return f"{type(profile).__name__}: {_said_of(profile)}"


@profile_words.register
def _(profile: Constant, unit: str) -> str:
    return f"{number(profile.level, unit, count=5)} at all times"


@profile_words.register
def _(profile: PiecewiseLinear, unit: str) -> str:
    points = _points(np.asarray(profile.times).tolist(), np.asarray(profile.values).tolist(), unit)
    return f"straight lines through {points}; constant before and after"


@profile_words.register
def _(profile: Repeated, unit: str) -> str:
    points = _points(np.asarray(profile.times).tolist(), np.asarray(profile.values).tolist(), unit)
    begin = "" if float(profile.begin) == 0.0 else f" from {number(profile.begin, 's')} on"
    return (
        f"{profile.count} cycles of {number(profile.period, 's')} each{begin}, in each straight lines through {points}"
    )


@profile_words.register
def _(profile: SpeedHold, unit: str) -> str:
    return f"just so much that the brake holds the speed, at most {number(profile.limit, unit, count=5)}"


@profile_words.register
def _(profile: Driller, unit: str) -> str:
    times, speeds = np.asarray(profile.speed.times).tolist(), np.asarray(profile.speed.values).tolist()
    pieces = zip(profile.following, times, times[1:], speeds, speeds[1:], strict=False)
    led = [
        f"{number(t, 's')}…{number(end, 's')}: {digits(a, 4)}…{digits(b, 4)} rad/s"
        for follows, t, end, a, b in pieces
        if follows
    ]
    cycles = f"{profile.speed.count} cycles of {number(profile.speed.period, 's')}; in each "
    led_words = f"the speed is led at {', '.join(led)} with at most {number(profile.limit, unit, count=5)}; otherwise "
    return cycles + (led_words if led else "") + profile_words(profile.tension, unit)


@profile_words.register
def _(profile: ExponentialRise, unit: str) -> str:
    return (
        f"rises from 0 at {number(profile.begin, 's')} towards {number(profile.level, unit, count=5)} "
        f"with the time constant {number(profile.time_constant, 's')}"
    )


@profile_words.register
def _(profile: FunctionProfile, unit: str) -> str:
    knots = np.asarray(profile.knots).size
    return f"a function of its own, {_plain(profile.function)}" + (f", with {knots} corners or jumps" if knots else "")


@profile_words.register
def _(profile: Lever, unit: str) -> str:
    force = profile_words(profile.force, "N")
    return f"a force on the lever, times {digits(float(profile.gain), 5)} (efficiency · arm/slack arm): {force}"


@functools.singledispatch
def load_words(load: AbstractLoad) -> str:
    """What drives the pulley, in words."""
    return f"{type(load).__name__}: {_said_of(load)}"


def _drag(drag: Any) -> str:
    return "" if float(drag) == 0.0 else f"; drag {number(drag, 'N*m*s', count=5)} against the motion"


def _tackle(load: Any) -> str:
    return f"{digits(float(load.line_count), 5)} lines, rope at {number(load.drum_radius, 'm', count=5)} from the shaft"


@load_words.register
def _(load: TorqueLoad) -> str:
    return f"a torque on the shaft, {profile_words(load.profile, 'N*m')}{_drag(load.drag)}"


@load_words.register
def _(load: HookLoad) -> str:
    torque = float(load.mass) * float(load.gravity) * float(load.drum_radius) / float(load.line_count)
    return (
        f"{number(load.mass, 'kg', count=5)} on the hook, {_tackle(load)}: "
        f"{number(torque, 'N*m', count=5)} on the shaft{_drag(load.drag)}"
    )


@load_words.register
def _(load: TrippingLoad) -> str:
    return (
        f"{load.count} stands of {number(load.stand, 'kg', count=5)} run in, one every {number(load.period, 's')}: "
        f"{number(load.empty, 'kg', count=5)} of hook and block, and from {number(load.taken, 's')} to "
        f"{number(load.set, 's')} of each cycle the string, at first {number(load.string, 'kg', count=5)}; "
        f"{_tackle(load)}{_drag(load.drag)}"
    )


def duty_words(scene: Scene) -> list[tuple[str, str]]:
    """Lever, load, start and end of a run: what, and in words."""
    start, wraps = scene.initial, "" if float(scene.initial.omega) else ", at rest"
    return [
        (_LEVER[scene.duty.lever_field], profile_words(scene.duty.lever, "N")),
        ("Load", load_words(scene.duty.load)),
        ("Start", f"{number(start.omega, 'rad/s')} at {digits(float(start.time))} s{wraps}"),
        ("End", f"at {digits(float(scene.end_time))} s"),
    ]
