"""Findings of a run: each fact once, in words and with its numbers.

The printed summary, explanation, verdict, JSON and pages show these.
"""

import functools
import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from .._base._numbers import digits, number
from .._base._table import Column, JsonObject, Table
from ..hybrid import Code
from ..hybrid.extremes import first_largest
from ..loads import AbstractHookLoad, TabulatedLoad, TorqueLoad
from ..outputs.duty import DutyKind, end_of, totals
from ..outputs.energies import ENERGY_WORDS, Balance, energy_balance, heat_balance
from ..outputs.judgement import COLOURS, REASONS, SMALL_RESERVE, Colour
from ..outputs.log import Event, Status, failure_of, labels_of, status_words
from ..outputs.metrics import (
    HOLDING,
    HOT,
    METRICS,
    RESIDUAL_SEES,
    allowable_values,
    metric_of,
)
from ..outputs.programs import RunJit, ends_of
from ..outputs.stages import STAGES
from ..outputs.torques import lowers_steadily, terminal_speed
from ..parts.scene import Scene
from ..parts.unusual import plausibility, warnings
from ..phases import AfterTravel, AtHeight, AtRest
from ..physics._brake import Capacity
from ..physics._rope import ElasticRope
from ..physics.mechanism import BrakeCode
from ..shaft import AbstractDryTorque, TabulatedDrag
from .report import Report

#: a hook load that swings by less than this share of the weight counts as at rest
_SLIGHT = 1e-2
#: energies that differ by less than this share balance each other
_BALANCED = 1e-9
#: a load speeds the shaft up where the speed grows by more than this factor
_FASTER = 1.001
#: linings whose maximum wear over their mean is below this wear alike
_ALIKE = 1 + 1e-6
#: groups of events that are listed one by one, at most
_EVENTS = 12
#: percent of a balance below which a term is not listed
_SHOWN = 5e-4


class Finding(NamedTuple):
    """One fact about a run: its topic, its text, and its numbers in SI.

    In an explanation the text has whole sentences.

    - `severity`: green, amber or red; `None` where nothing is judged

    Example:
        >>> finding = sb.studies.explain(result, influence=False)["outcome"]
        >>> finding.topic, finding.numbers["status"], finding.numbers["exceeded"]
        ('outcome', 'stopped', 0)
    """

    topic: str
    text: str
    numbers: Mapping[str, Any] = {}
    severity: Colour | None = None


def upper(text: str) -> str:
    """The text with a capital letter at its start."""
    return text[:1].upper() + text[1:]


def lower(text: str) -> str:
    """The text with a small letter at its start."""
    return text[:1].lower() + text[1:]


#: general words, which `in_words_of` replaces by those of a machine
_GENERAL = re.compile(
    r"(?<![\w.`])(hook load|hook|drum|ropes?|pulley|lever)(?![\w`]|\.\w)", re.IGNORECASE
)


def in_words_of(scene: Scene, text: str) -> str:
    """A text about a scene in the words of its machine: a lift has a car in place of
    the hook."""
    load = scene.duty.load.words
    own = {
        **load._asdict(),
        "hook load": load.hook if load.hook == "load" else f"{load.hook} load",
        "pulley": scene.brake.words.body,
        "lever": "actuator" if scene.duty.lever_field == "force" else "lever",
    }

    def word(found: re.Match[str]) -> str:
        name = own[found[0].lower()]
        return upper(name) if found[0][0].isupper() else name

    return _GENERAL.sub(word, text)


def worded(scene: Scene, found: Iterable[Finding]) -> list[Finding]:
    """Findings in the words of the machine."""
    return [each._replace(text=in_words_of(scene, each.text)) for each in found]


def sentences(texts: Iterable[str]) -> str:
    """Texts as sentences, one after the other."""
    return " ".join(f"{upper(text)}." for text in texts)


def findings(report: Report) -> list[Finding]:
    """Findings of a run, without its verdict, in the order of the summary."""
    summary = report.summary
    solver = summary["solver"]
    steps = (
        f"{solver['method']}, because {solver['reason']}; rtol {solver['rtol']:g}: "
        f"{solver['steps']} steps, {solver['rejected']} rejected, "
        f"{solver['retaken']} truncated at events, {solver['segments']} segments"
    )
    closure = f"relative energy-balance residual {_share(summary['energy']['closure'])}"
    split = summary["distribution"]
    found = [
        Finding("events", _events(report)),
        course(report),
        *held(report),
        *powers(report),
        _maxima(report),
        *holding(report),
        *_energies(report),
        *wear(report),
        Finding("closure", f"{closure} ({RESIDUAL_SEES})"),
        Finding("solver", steps, solver),
        *([] if split.startswith("mobilisation") else [Finding("split", split)]),
        *(
            Finding("stages", f"no {_words(stage['name'])}: {stage['reason']}")
            for stage in summary.get("absent_stages", ())
        ),
    ]
    return worded(report.result.scene, found)


def remarks(report: Report) -> list[Finding]:
    """Notes on what a run could not see, and its warnings."""
    scene = report.result.scene
    texts = [
        *warnings(scene),
        *plausibility(scene, report.metrics.get("peak_rim_temperature")),
        *_thick_layers(report),
        *_shortage(report),
        *_over_limits(report),
        *_beyond_tables(report),
    ]
    # (`warnings` has linings that lock themselves from the start)
    for name, words in _WARNED.items():
        if times := [event.time for event in report.events if event.name == name]:
            texts.append(f"{name}: {words.format(min(times))}")
    found = [
        *(Finding("note", text) for text in _not_seen(report)),
        *(Finding("warning", text, severity=Colour.AMBER) for text in texts),
    ]
    return worded(scene, found)


#: events that are warnings of a run
_WARNED = {
    "self_locking": "a lining came to lock itself, first at {:.6g} s",
    "coolant_boils": "from {:.6g} s on the coolant boils at the wetted wall; the heat "
    "is computed as if it stayed liquid",
}


def summary_of(report: Report) -> JsonObject:
    """What `Result.summary` gives: numbers of a run, its message and its warnings."""
    found = remarks(report)
    facts = report.summary
    return {
        "status": facts["status"],
        "duty": facts["duty"],
        "message": message(report.result),
        "warnings": [finding.text for finding in found if finding.topic == "warning"],
        "notes": [finding.text for finding in found if finding.topic == "note"],
        **facts,
    }


def _words(name: str) -> str:
    return name.replace("_", " ")


def _share(value: float | None) -> str:
    return "—" if value is None else f"{value:.1e}"


# --- how a run ended ----------------------------------------------------------------


def message(result: Any) -> str:
    """The status of a concrete result in words, with what to do where it failed."""
    return in_words_of(result.scene, _message(result))


def _message(result: Any) -> str:
    if not result.ok:
        return _failure(result)
    status = Status(result.status)
    body = result.scene.brake.words.body
    text = status_words(status, result.scene.brake.words)
    if status is Status.RUNAWAY:
        return f"{text}: at the end {capacity_words(result.end_capacity, result.scene)}"
    if status is Status.LOWERING:
        speed = float(terminal_speed(result.record))
        return f"{text}: {number(speed, 'rad/s')}"
    (end,) = labels_of(result.record, np.asarray([int(result.record.count)]))
    if end.stands:
        return (
            f"the {body} is at rest with the brake open: dry friction of the shaft "
            "holds it"
        )
    if status is Status.STOPPED:
        if result.scene.motor is not None:  # (which may have brought it there)
            text = f"the {body} is at rest, and the brake holds it"
        if float(result.record.y_end.omega) != 0.0:
            text = text.replace("holds it", "holds it on the springs of its band")
    return text + (_swing(result) if end.rests else "")


def capacity_words(capacity: Capacity, scene: Scene) -> str:
    """Torque of the sliding brake, the pair that limits it, and that of the load."""
    torque = number(float(capacity.torque), "N*m")
    weakest = ""
    if len(scene.brake.pairs) > 1:
        pair = list(scene.brake.pairs)[int(np.argmin(capacity.pairs))]
        weakest = f", limited by its {pair} pair,"
    load = number(capacity.hanging, "N*m")
    return f"the sliding brake gives {torque}{weakest} against {load} of the load"


def _failure(result: Any) -> str:
    """What failed, when and in which modes, and what to do."""
    record = result.record
    code = int(result.code)
    what, hint = failure_of(code, result.scene.brake.words)
    if code == BrakeCode.PHASE_NEVER_ENDS:
        until = _end_awaited(result)
        what = f"{what}: {_waiting(result, until)}"
        if isinstance(until, AtRest) and float(record.y_end.omega) != 0.0:
            weak = bool(result.end_capacity.outweighed)
            hint = "pull harder, or take a lighter load" if weak else hint
    labels = labels_of(record)
    changes = [x for i, x in enumerate(labels) if i == 0 or x != labels[i - 1]]
    modes = " → ".join(map(str, changes[-4:]))
    if code in (Code.CHATTER, Code.ZENO, Code.EVENT_LIMIT):
        modes += f"; last guards: {', '.join(record.last_guards(4))}"
    end = np.asarray(record.rows.t)[len(labels) - 1]
    return f"{what} (at t = {end:.9g} s; last modes: {modes}): {hint}"


def _end_awaited(result: Any) -> Any:
    """The end for which the last phase waits."""
    lever = result.record.system.lever
    phase = np.asarray(result.record.mode_end.phase, np.int32)
    return lever.each[int(lever.place(phase))].until


def _waiting(result: Any, until: Any) -> str:
    """The phase in force at the end, where the shaft is, and why a load runs away."""
    record = result.record
    y = record.y_end
    phase = record.system.lever.ended(int(record.mode_end.phase))
    phrases = [f"{phase} began at {number(y.phase.begun, 's')}"]
    phrases.append(at_end(end_of(record, result.scene)))
    rises = isinstance(until, AtHeight) and until.rising
    if rises or (isinstance(until, AfterTravel) and float(until.distance) < 0):
        phrases.append("upwards it needs `motor`, with a speed below 0")
    if float(y.omega) != 0.0:
        capacity = result.end_capacity
        runs_away = capacity.outweighed and not lowers_steadily(record)
        words = capacity_words(capacity, result.scene)
        phrases.append(f"the load runs away: {words}" if runs_away else words)
    return ", ".join(phrases)


@functools.partial(RunJit, quick=True)
def _rope_at(system: Any, y: Any, mode: Any) -> Any:
    return system.feature(ElasticRope).at(system, y, mode)


def _swing(result: Any) -> str:
    """How the hook swings at the end over a drum at rest; empty below 1 % of its
    weight."""
    system = result.record.system
    _, y, mode = ends_of(result.record)[1]
    elastic = system.feature(ElasticRope)
    if elastic is None:
        return ""
    if int(mode.taut) == 0:
        return "; the hook falls on a slack rope"
    rope = _rope_at(system, y, mode)
    k = float(elastic.stiffness)
    away = k * float(y.hook.excess)
    swing = math.hypot(away, float(y.hook.speed) * math.sqrt(k * float(rope.mass)))
    if swing < _SLIGHT * float(rope.weight):
        return ""
    return f"; the hook swings on its rope by ± {number(swing, 'N', count=3)}"


# --- the reason of a verdict --------------------------------------------------------


def sentence(report: Report) -> str:
    """The reason of a verdict in words, with its numbers."""
    judgement = report.judgement
    end = report.summary["end"]
    reason = REASONS[judgement.reason]
    speed = number(abs(end["omega"]), "rad/s")
    moves = f"{speed}{' upwards' if end['omega'] < 0 else ''}"
    share = _over_load(judgement.sliding, 3)
    sliding = f"the sliding friction brake gives {share} of the load's torque"
    reserve = f"reserve if the lever pulls: {_over_load(judgement.reserve)}"
    pulled = f"; {reserve}" if judgement.pull > 0 else ""
    set_speed = number(abs(judgement.set_speed), "rad/s")
    ends = f"the end time of {number(end['time'], 's')}"
    falls = end["omega"] * judgement.load > 0
    red = COLOURS[judgement.colour] == Colour.RED
    match reason.id:
        case "F1":
            detail = f" with the code {report.result.status}"
            if math.isfinite(judgement.sliding):
                detail += f"; the load hangs with {number(abs(judgement.load), 'N*m')}"
        case "T1":
            weak = f"; {sliding}" if judgement.sliding <= 1 else ""
            detail = f" before {ends}: {report.phase_at_end}{weak}"
        case "H1":
            when, capacity = report.broke_away
            detail = f" at {number(when, 's')}: static capacity "
            detail += f"{_over_load(capacity)} of the load"
        case "H2":
            worst = report.by_worst_angle
            detail = " where it is heaviest in the run" if worst else ""
            detail += f": it holds {_over_load(judgement.reserve)} of it"
            detail += "" if worst else _others(report)
        case "H4":
            many = "stops" in report.summary
            state = f"; at the end {_words(report.result.status)}" if many else ""
            return _stopped(report) + state + _by_static_friction(report)
        case "H5":
            ask = 'if that is meant, say wants = "lower" or "free"'
            rest = f"the load moves on at {moves}: {ask}"
            return f"{_stopped(report)}, then the lever was let go; {rest}"
        case "H7":
            detail = ": at a power failure the load falls"
        case "X0":
            return f"{_led(report)}; no load hangs"
        case "X1" if judgement.sliding_now > 0:
            return f"The load {'runs on' if falls else 'moves'} at {moves}: {sliding}"
        case "X1":
            motion = "falls" if falls and judgement.load > 0 else "moves"
            return f"The brake is open, and the load {motion} at {moves}"
        case "H3" | "S1":
            detail = f" at {moves}: {sliding}"
        case "S3":
            detail = f", at {moves} at the end: {sliding}"
        case "S2":
            detail = f" of {number(end['time'], 's')}, at {moves}; give a later one"
        case "M0" | "L0":
            detail = f" of {set_speed} at {ends}, but at {moves}; give a later one"
        case "M1":
            detail = f" at {speed}{pulled}"
        case "M3" | "S4":
            detail = f", at {moves}: {sliding}"
        case "L1":
            detail = f" of {speed}{pulled or _NO_PULL}"
        case "L2":
            detail = f": {moves} instead of {number(judgement.set_speed, 'rad/s')}"
            if judgement.pull > 0:
                limit = number(judgement.pull, "N")
                detail += f"; its lever is at the limit of {limit}"
        case "L4" | "L5":
            return f"Lowered at a steady {speed}{pulled or _NO_PULL}"
        case "L6" if red:
            return f"Falls freely, at {moves} at the end"
        case "L3" | "L6" | "L7":
            detail = f": at {moves} at the end"
        case "U1":
            detail = f": at {moves}, {sliding}. If it is meant, give `wants`"
        case _:
            detail = ""
    return reason.words + detail


def _over_load(share: float, count: int = 4) -> str:
    """A torque over that of the load: what is not 1, by however little, is not told as
    1."""
    texts = (digits(share, n) for n in range(count, 11))
    return next((text for text in texts if text != "1"), "1")


_NO_PULL = "; no pull of the friction brake is given: nothing is said of holding"


def _others(report: Report) -> str:
    """What holds the part of a resting load that the friction brake does not."""
    scene = report.result.scene
    others = [] if scene.motor is None else ["the motor"]
    if any(isinstance(law, AbstractDryTorque) for law in scene.shaft):
        others.append("dry friction of the shaft")
    return f"; {' or '.join(others)} holds the rest" if others else ""


def _by_static_friction(report: Report) -> str:
    """That the brake holds the load only while it sticks; empty where it also does
    sliding."""
    judgement = report.judgement
    if not judgement.sliding_now <= 1 < judgement.reserve < math.inf:
        return ""
    return (
        "; held by static friction alone: sliding, the brake gives "
        f"{_over_load(judgement.sliding_now)} of the load's torque"
    )


def _led(report: Report) -> str:
    """What a run without a hanging load did."""
    if report.summary["duty"] == DutyKind.DRIVEN:
        duration = number(report.summary["end"]["duration"], "s")
        return f"Driven by the motor for {duration}"
    return upper(message(report.result))


def _stopped(report: Report) -> str:
    """That the pulley came to rest, and when."""
    summary = report.summary
    stop = report.metrics["stopping_time"]
    if "stops" in summary:
        return _number_of_stops(summary["stops"])
    if stop is not None:
        return f"Stopped after {number(stop, 's')}"
    if summary["status"] in (Status.HELD, Status.STOPPED):
        return upper(message(report.result))
    return "Not brought to rest" if report.holding is None else "Held from the start"


def _number_of_stops(rows: Sequence[JsonObject]) -> str:
    """How many stops there are, and how many come after hoisting."""
    hoists = sum(row.get("travel", 0.0) < 0 for row in rows)
    return f"{len(rows)} stops" + (f", {hoists} after hoisting" if hoists else "")


# --- the course of a run ------------------------------------------------------------


def course(report: Report) -> Finding:
    """How a run went, in order of time."""
    summary = report.summary
    end = summary["end"]
    if summary["duty"] == DutyKind.STOPS:
        phrases, numbers = _stops(summary)
    elif summary["status"] == Status.HELD:
        duration = number(end["duration"], "s")
        phrases = [f"the load is held from the start, for {duration}: nothing moves"]
        numbers = {}
    else:
        phrases, numbers = _one_stop(report)
    text = in_words_of(report.result.scene, sentences(phrases)[:-1])
    return Finding("course", text, end | numbers)


def _one_stop(report: Report) -> tuple[list[str], JsonObject]:
    """Onset, stop and end of a run with one stop or none; in words and numbers."""
    summary = report.summary
    scene = report.result.scene
    m = summary["metrics"]
    end = summary["end"]
    body = scene.brake.words.body
    stop = m["stopping_time"]
    start = abs(float(scene.start_speed))
    most = m["max_drum_speed"]
    numbers = {"speed_maximum": most, "stopping_time": stop}
    names = ("slip_onset_time", "full_slip_time", "stopping_angle")
    numbers |= {name: m[name] for name in names}
    phrases = _onset(scene, m)
    before = stop is None or summary["at"]["max_drum_speed_time"] <= stop
    if before and (most or 0.0) > _FASTER * start > 0:
        speeds = f"from {number(start, 'rad/s')} to {number(most, 'rad/s')}"
        phrases.append(f"the load first speeds the {body} up {speeds}")
    if stop is not None:
        way = _way(m["stopping_angle"], m["hook_travel"])
        phrases.append(f"the {body} comes to rest after {number(stop, 's')} and {way}")
        again = [
            event.time
            for event in report.events
            if event.name in ("restart", "release") and event.time >= stop
        ]
        if not again or end["angle"] == m["stopping_angle"]:
            return phrases, numbers
        phrases.append(f"it turns again from {number(min(again), 's')} on")
    return [*phrases, at_end(end)], numbers


def _way(angle: float, travel: float | None) -> str:
    """Angle of the shaft, and travel of the hook where there is one."""
    hook = "" if travel is None else f", hook travel {number(travel, 'm')}"
    return f"{number(angle, 'rad')}{hook}"


def at_end(end: JsonObject, turned: float = 0.0) -> str:
    """Where the shaft is at the end of a run that does not end with its stop.

    `turned` (rad): angle turned to and fro; a difference from the start that is tiny
    against it is none
    """
    time = number(end["time"], "s")
    at_rest = end["omega"] == 0
    moves = "is at rest" if at_rest else f"turns at {number(end['omega'], 'rad/s')}"
    if abs(end["angle"]) <= _BALANCED * turned:
        return f"at {time} it {moves}, where it started"
    return f"at {time} it {moves}, after {_way(end['angle'], end['hook_travel'])}"


def _onset(scene: Scene, m: Mapping[str, float | None]) -> list[str]:
    """When the linings begin to act, and to slide."""
    lining = scene.brake.words.lining
    acts = "the band is taut" if scene.brake.banded else f"the {lining}s act"
    all_linings = f"all {scene.brake.linings.count} {lining}s"
    each = {
        "slip_onset_time": f"{acts} at {{}}",
        "full_slip_time": f"{all_linings} slide from {{}} on",
        "internal_slip_time": "the linings slide on the rim from {} on",
        "external_lock_time": "the bandage is at rest from {} on",
    }
    times = {name: m[name] for name in each if m.get(name) is not None}
    phrases = [each[name].format(number(time, "s")) for name, time in times.items()]
    return [", ".join(phrases)] if phrases else []


def _stops(summary: JsonObject) -> tuple[list[str], JsonObject]:
    """Totals of several stops, and the longest of them; in words and numbers."""
    rows = summary["stops"]
    end = summary["end"]
    total = totals(rows)
    longest = total["slowest"]
    hottest = total["hottest"]
    angle = total["angle"]
    travel = f", hook travel {_up_and_down(total)}" if "travel" in total else ""
    phrases = [
        f"{_number_of_stops(rows)} in {number(end['duration'], 's')}: "
        f"{number(total['motion_time'], 's')} in motion, "
        f"{number(total['braking_time'], 's')} braked, {number(angle, 'rad')}{travel}"
    ]
    if braked := [row["braking_time"] for row in rows if row["braking_time"] > 0]:
        first, last, most = (
            number(time, "s") for time in (braked[0], braked[-1], max(braked))
        )
        others = len(rows) - len(braked)
        without = f"; {others} are without it" if others else ""
        phrases.append(
            f"the longest braking takes {most} (stop {longest['stop']}), the first "
            f"{first}, the last {last}{without}; the maximum friction heat is {number(hottest['energy'], 'J')} "
            f"(stop {hottest['stop']})"
        )
    if abs(abs(end["angle"]) - angle) > _BALANCED * angle:
        phrases.append(at_end(end, angle))
    names = ("motion_time", "braking_time", "angle", "energy")
    sums = {name: total[name] for name in names}
    return phrases, {"stops": len(rows), **sums, "longest": longest}


def _up_and_down(total: JsonObject) -> str:
    """Travel of the hook in all stops, down and up where there is both."""
    whole = total["travel"]
    upwards = total["upwards"]
    up = number(upwards, "m", count=5)
    if upwards == whole > 0:
        return f"{up} up"
    down = number(whole - upwards, "m", count=5)
    return f"{down} down and {up} up" if upwards > 0 else str(number(whole, "m"))


def held(report: Report) -> Iterator[Finding]:
    """Load and static capacity of a brake that holds from the start."""
    entry = report.summary.get("holding")
    if report.summary["duty"] != DutyKind.HOLD:
        return
    if entry is None:
        yield Finding("balance", "there is no load to hold")
        return
    load = entry["load_torque"]
    capacity = entry["capacity"]
    text = (
        f"the load asks for {number(load, 'N*m')}; the brake at rest could hold "
        f"{number(capacity, 'N*m')}: {digits(100 * load / capacity, 4)} % of its "
        "static capacity are used"
    )
    yield Finding("balance", text, entry)


def powers(report: Report) -> Iterator[Finding]:
    """Mean powers of a lowering or of a driven shaft, and the pull that the lever
    needs."""
    if report.summary["duty"] not in (DutyKind.DRAG, DutyKind.STEADY, DutyKind.DRIVEN):
        return
    yield mean_powers(report)
    pull = report.summary.get("pull")
    if pull is not None:
        needed = number(pull["value"], "N")
        rims = report.summary.get("rims")
        each = "" if rims is None else f" on each of {rims} rims"
        text = (
            f"the lever needs at most {needed} of its {number(pull['limit'], 'N')}"
            f"{each} to hold the speed, at {number(pull['time'], 's')}"
        )
        yield Finding("lever", text, {"pull": pull})


def mean_powers(report: Report) -> Finding:
    """Mean powers of a run, on both sides of its energy balance."""
    energy = report.summary["energy"]
    duration = report.summary["end"]["duration"]
    both = energy_balance(energy).positive
    words = words_of_energies(report.result.scene)
    whole = max(sum(side.values()) for side in both) or 1.0

    def terms(side: Mapping[str, float]) -> str:
        shares = {name: 100 * work / whole for name, work in side.items()}
        each = (
            f"{words[name]} {number(side[name] / duration, 'W')} ({digits(share, 3)} %)"
            for name, share in shares.items()
            if share >= _SHOWN
        )
        return ", ".join(each) or "nothing"

    numbers: dict[str, Any] = {
        "load_power": energy.get("load_work", 0.0) / duration,
        "friction": energy.get("friction_heat", 0.0) / duration,
        "other": energy.get("shaft_work", 0.0) / duration,
    }
    for side, works in both._asdict().items():
        numbers[side] = {name: work / duration for name, work in works.items()}
    text = f"mean powers: in {terms(both.into)}; out {terms(both.out)}"
    return Finding("power", text, numbers)


def holding(report: Report) -> Iterator[Finding]:
    """The minimum holding reserve while a load is held."""
    reserve = report.metrics.get(HOLDING)
    if reserve is not None:
        when = report.summary["at"][f"{HOLDING}_time"]
        small = f", below {SMALL_RESERVE:g}: small" if reserve < SMALL_RESERVE else ""
        text = (
            f"held at rest the static capacity is at least {digits(reserve, 5)} times "
            f"the load, at {number(when, 's')}{small}"
        )
        yield Finding("holding", text, {"value": reserve, "time": when})


# --- events, forces, energies, temperatures, wear -----------------------------------


def event_groups(events: Sequence[Event]) -> list[list[Event]]:
    """Events in order of time; consecutive events of linings with one name are in one
    group."""
    groups: list[list[Event]] = []
    for event in events:
        last = groups[-1][-1] if groups else None
        if last and last.lining and event.lining and event.name == last.name:
            groups[-1].append(event)
        else:
            groups.append([event])
    return groups


def linings_of(group: Sequence[Event]) -> str:
    """The linings of a group of events: a range, or how many events there are."""
    linings = [event.lining for event in group if event.lining is not None]
    if len(linings) <= 1:
        return "".join(map(str, linings))
    first, last = linings[0], linings[-1]
    in_order = sorted(linings) in (linings, linings[::-1])
    if in_order and len(linings) == abs(last - first) + 1:
        return f"{first}…{last}"
    return f"{len(linings)} times"


def _events(report: Report) -> str:
    """The log: its events one by one, or how many there are of each name."""
    groups = event_groups(report.events)
    if len(groups) > _EVENTS:
        counts = Counter(event.name for event in report.events)
        return ", ".join(f"{count} × {_words(name)}" for name, count in counts.items())
    parts = []
    for group in groups:
        many = len(group) > 1
        name = _words(group[0].name) + ("s" if many else "")
        first, last = (f"{group[i].time:.6g}" for i in (0, -1))
        time = f"{first} s" if first == last else f"{first}…{last} s"
        parts.append(" ".join(filter(None, (name, linings_of(group), time))))
    return ", ".join(parts) or "none"


#: a limit that is not on a metric, as only runs with areas of linings have the value
PRESSURE = "max_pressure"


def title_of(metric: str, scene: Scene | None = None) -> str:
    """A metric, an energy or `max_pressure` in words, those of the kind of brake where
    the scene is given."""
    entry = metric_of(metric)
    base = METRICS.get(metric.removesuffix("_time"))
    if metric == PRESSURE:
        title = "Maximum mean pressure on a lining"
    elif entry is not None:
        title = entry.title
    elif base is not None:
        title = f"{base.title}, when"
    else:
        title = upper(_words(metric))
    if scene is None:
        return title
    title = title.replace("lining", scene.brake.words.lining)
    title = title.replace("rim ", f"{body_of('rim', scene)} ")
    return in_words_of(scene, title)


def place_and_time(name: str, report: Report, count: int = 6) -> str:
    """Lining and time of a maximum value, as far as it has them."""
    at = report.summary["at"]
    parts = []
    if (lining := at.get(f"{name}_lining")) is not None:
        parts.append(f"{report.result.scene.brake.words.lining} {lining}")
    if (time := at.get(f"{name}_time")) is not None:
        parts.append(f"at {number(time, 's', count=count)}")
    return ", ".join(parts)


def _maxima(report: Report) -> Finding:
    """Maximum values, each with its lining and time."""
    values = {
        name: value
        for name in report.peaks
        if name != HOLDING and (value := report.metrics[name]) is not None
    }
    rims = report.summary.get("rims")
    phrases = []
    for name, value in values.items():
        title = title_of(name, report.result.scene).removeprefix("Maximum ")
        if rims is not None and METRICS[name].of_linings:
            title += f" on each of {rims} rims"
        most = number(value, METRICS[name].unit)
        phrases.append(
            f"{lower(title)} at most {most} ({place_and_time(name, report)})"
        )
    return Finding("maxima", ", ".join(phrases), values)


def words_of_energies(scene: Scene) -> Mapping[str, str]:
    """Terms of both balances in words; the work of a load is less that of its drag."""
    load = scene.duty.load
    if isinstance(load, AbstractHookLoad | TorqueLoad) and np.any(load.drag != 0):
        return ENERGY_WORDS | {"load_work": "load less its drag"}
    return ENERGY_WORDS


def sum_words(balance: Balance, scene: Scene) -> str:
    """Both sides of a balance of energies, all in one unit."""
    words = words_of_energies(scene)
    size = max((abs(x) for side in balance for x in side.values() if x), default=0.0)
    sides = (
        " + ".join(
            f"{words[name]} {number(value, 'J', beside=size)}"
            for name, value in side.items()
        )
        for side in balance
    )
    return " = ".join(sides)


def _energies(report: Report) -> Iterator[Finding]:
    """Energy in and out, and heat."""
    scene = report.result.scene
    energy = report.summary["energy"]
    into, out = energy_balance(energy)
    change = energy["kinetic_change"]
    # the load has sped the pulley up: its energy goes out, it is not released
    if change is not None and change > _BALANCED * abs(energy["load_work"] or 0.0):
        out["kinetic_change"] = change
        del into["kinetic_release"]
    yield Finding("energy", sum_words(Balance(into, out), scene), into | out)
    if "heat_stored" in energy:
        into, out = heat_balance(energy)
        usual = ("heat_to_metal", "heat_to_linings")
        into = {name: x for name, x in into.items() if x != 0 or name in usual}
        text = sum_words(Balance(into, out), scene)
        residual = f"residual {_share(energy['heat_closure'])}"
        yield Finding("heat", f"{text} ({residual})", into | out)


def body_of(place: str, scene: Scene) -> str:
    """A place whose temperature is reported, in the words of its kind of brake."""
    words = scene.brake.words
    own = {"rim": "rim" if scene.brake.banded else words.body}
    own |= {"linings": f"{words.lining}s", "outer": "linings outside"}
    return own.get(place, place)


def hottest_first(metrics: Mapping[str, float | None]) -> list[str]:
    """Names of the maximum temperatures that a run has, the highest first."""
    hot = [name for name in HOT if metrics.get(name) is not None]
    return sorted(hot, key=lambda name: -(metrics[name] or 0.0))


def wear(report: Report) -> Iterator[Finding]:
    """The most worn lining, and its wear over that of the others."""
    m = report.metrics
    worn = report.summary.get("worn_thickness")
    if worn is None or m["greatest_wear"] is None:
        return
    lining = report.result.scene.brake.words.lining
    most = m["greatest_wear"]
    over = m["wear_over_mean"]
    least = m["wear_over_least"]
    place = int(first_largest(np.asarray(worn))) + 1
    depth = number(most, "m", count=5)
    if over is None:
        text = f"none: no {lining} slid"
    elif over < _ALIKE:
        text = f"all {lining}s wear alike, by {depth}"
    else:
        text = f"{lining} {place} wears the most: {depth}, {over:.4g} times the mean"
        text += "" if least is None else f", {least:.4g} times the least"
    numbers = {"lining": place, "value": most, "over_mean": over}
    yield Finding("wear", text, numbers)


# --- tables -------------------------------------------------------------------------

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


def stage_table(summary: JsonObject) -> Table:
    """Stages of a staged brake in order: start, end, duration, heat of both pairs, work
    of load and lever."""
    columns = [Column(name, heading=heading) for name, (heading, _) in _STAGE.items()]
    rows = [
        (
            _words(stage["name"]),
            *(number(stage[name], unit) for name, (_, unit) in _STAGE.items()),
            STAGES.get(stage["name"], ""),
        )
        for stage in summary.get("stages", [])
    ]
    return Table(["stage", *columns, Column("stage_note", hidden=True)], rows)


# --- notes and warnings -------------------------------------------------------------


def _not_seen(report: Report) -> Iterator[str]:
    """User-defined functions of time, and how often the run evaluated them."""
    record = report.result.record
    given = {"lever": "the lever", "load": "the load", "motor": "the motor"}
    sampled = record.system.sampled
    names = list(dict.fromkeys(given.get(x, "another given function") for x in sampled))
    if names:
        t = np.asarray(record.rows.t)[: int(record.count) + 1]
        # (guards are evaluated more often, but only the steps follow what turns the
        # pulley)
        longest = float(np.max(np.diff(t), initial=0.0)) * record.method.blind
        functions = "is a user-defined function"
        if len(names) > 1:
            functions = "are user-defined functions"
        yield (
            f"sampled: {' and '.join(names)} {functions} of time; this run "
            f"looked at least every {number(longest, 's', count=3)}, a shorter pulse "
            "may be missed: give its knots, or a shorter max_step"
        )


def _thick_layers(report: Report) -> Iterator[str]:
    for place, found, rise in report.thick_layers:
        first = number(found.first, "m", count=3)
        error = digits(abs(found.share) * rise, 2)
        remedy = "give it more layers, thin at the face"
        if found.layers:
            better = number(found.better, "m", count=2)
            remedy = f"{found.layers} layers, the first {better} thick, would do"
        yield (
            f"mesh: {place}: its layers, the first {first} thick, are too thick for "
            f"{number(found.time, 's', count=3)} of heating: the rise of "
            f"{digits(rise, 3)} K is some {error} K too "
            f"{'high' if found.share > 0 else 'low'}; {remedy}"
        )


def _shortage(report: Report) -> Iterator[str]:
    short = report.shortage
    if short is not None:
        load = number(short["load"], "N*m")
        torque = number(short["torque"], "N*m")
        yield (
            f"shortage: at {number(short['time'], 's')} the load torque {load} exceeded "
            f"the {torque} of the sliding brake under the maximum force of its lever"
        )


def _over_limits(report: Report) -> Iterator[str]:
    """Metrics above their allowable values, except those with a mark, which have events
    instead."""
    energies = report.summary["energy"]
    for name, most in allowable_values(report.result.scene).items():
        metric = METRICS.get(name)
        value = energies.get(name.removeprefix("energy."), report.metrics.get(name))
        if metric is None or metric.mark is not None or value is None or value <= most:
            continue
        words = _words(name.removeprefix("max_").removeprefix("energy."))
        ratio = f"{value / most:.4g} ×" if most > 0 else "above"
        allowed = f"{ratio} the allowable {number(most, metric.unit)}"
        yield f"over_limit: {words} {number(value, metric.unit)} is {allowed}"


def _beyond_tables(report: Report) -> Iterator[str]:
    """Tables of torques over speed whose speeds a run exceeds."""
    scene = report.result.scene
    omega = np.asarray(report.scan.columns.omega)
    tables = [(f"shaft[{i}]", law, abs(omega)) for i, law in enumerate(scene.shaft)]
    for path, table, speeds in [("duty.load", scene.duty.load, omega), *tables]:
        if not isinstance(table, TabulatedLoad | TabulatedDrag):
            continue
        low, *_, high = np.asarray(table.speed)
        beyond = np.where(speeds > high, speeds - high, np.maximum(low - speeds, 0.0))
        if np.any(beyond > 0):
            ends = f"{number(low, 'rad/s')} to {number(high, 'rad/s')}"
            reached = number(speeds[np.argmax(beyond)], "rad/s")
            yield (
                f"beyond_table: {path} has torques from {ends}, and the run reaches "
                f"{reached}: there the torque of the end of the table holds"
            )
