"""What happened in a run: how it ended, and the events of its log."""

import difflib
import enum
import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from .._base._table import JsonObject
from ..brakes.design import Brake, BrakeWords
from ..hybrid import FINISHED, Code, Record
from ..loads import Driller
from ..parts.scene import Scene
from ..phases import Ended
from ..physics.mechanism import BandMode, BrakeCode, Label, Mode, events_of_change
from .metrics import marks
from .torques import ends_driven, lowers_steadily, runs_away

# --- how a run ends ------------------------------------------------------------------

#: failure codes of runs: name, what happened, what to do
FAILURES = {
    Code.STEP_LIMIT: (
        "step_limit",
        "the step limit was reached before the end time",
        "raise max_steps, loosen rtol, take solver=Rodas5P() where the motion is stiff "
        "(as under strong drag), or look for a mode that changes all the time",
    ),
    Code.EVENT_LIMIT: (
        "event_limit",
        "the event limit was reached before the end time",
        "raise max_events",
    ),
    Code.CHATTER: (
        "chatter",
        "the modes changed again and again at one instant",
        "look at the last modes: two of them exclude each other at this load",
    ),
    Code.ZENO: (
        "zeno",
        "events follow each other ever faster",
        "look at the last events: the motion between two of them dies out",
    ),
    Code.NOT_FINITE: (
        "not_finite",
        "a state or a rate became infinite or not a number",
        "check the laws and profiles",
    ),
    Code.STEP_TOO_SMALL: (
        "step_too_small",
        "the step size fell to rounding level",
        "the equations change faster than this method can follow: loosen rtol or check "
        "the laws and profiles",
    ),
    BrakeCode.SINGULAR_GEOMETRY: (
        "singular_geometry",
        Brake.words.locking,
        Brake.words.unlocking,
    ),
    BrakeCode.BAND_SNAP: (
        "band_snap",
        "1 + γ fell to 0: friction fades faster than the elastic band can follow, and "
        "its tension would jump",
        "give the surface that the friction law senses a larger capacity, states of "
        "the law slower rates, or the band a higher stiffness",
    ),
    BrakeCode.FLASH_FOLD: (
        "flash_fold",
        "friction and its flash temperature have no common solution: a fold, or a "
        "lining that would lock as it slides",
        "look at the friction law above this surface temperature, or at the size and "
        "hardness of the spots",
    ),
    BrakeCode.OUTSIDE_TABLE: (
        "outside_table",
        "a lining's temperature left the table of its friction law",
        "extend the table; it is not extrapolated",
    ),
    BrakeCode.PHASE_NEVER_ENDS: (
        "phase_never_ends",
        "the end time was reached while a phase of the duty still waited for its end",
        "give it an end that comes, or set a later end_time",
    ),
    BrakeCode.ROPE_END: (
        "rope_end",
        "the rope is at its end: the drum is empty, or nothing hangs any longer",
        "give more rope or turns at the start, or end the run earlier",
    ),
    BrakeCode.SLACK_ROPE: (
        "slack_rope",
        "one side of the rope is slack, or slips on its sheave: what hangs there cannot "
        "follow the brake",
        "brake more softly, or balance both sides better",
    ),
}


def failure_of(code: int, words: BrakeWords) -> tuple[str, str]:
    """What a failure code means for a kind of brake, and what to do."""
    if code == BrakeCode.SINGULAR_GEOMETRY:
        return words.locking, words.unlocking
    return FAILURES[code][1:]


class SimulationError(RuntimeError):
    """A run that ended in a failure code; `result` holds what was computed until then.

    Example:
        >>> try:
        ...     sb.simulate(scene, max_steps=2)
        ... except sb.SimulationError as error:
        ...     print(error.result.status)
        step_limit
    """

    def __init__(self, message: str, result: object) -> None:
        super().__init__(message)
        self.result = result


class Status(enum.StrEnum):
    """How a run that reached its end time ended.

    Example:
        >>> sb.results.Status.RUNAWAY.value
        'runaway'
    """

    STOPPED = "stopped"
    HELD = "held"
    NOT_STOPPED = "not_stopped"
    NOT_FOLLOWED = "not_followed"
    RUNAWAY = "runaway"
    LOWERING = "lowering"
    DRIVEN = "driven"
    RELEASED = "released"


STATUS_MESSAGES = {
    Status.STOPPED: "the brake brought the pulley to rest and holds it",
    Status.HELD: "the pulley was at rest from the start and is held",
    Status.NOT_STOPPED: "the pulley still turns at the end time",
    Status.NOT_FOLLOWED: "the pulley never comes near the speed that it is to keep",
    Status.RUNAWAY: "the brake cannot hold this load",
    Status.LOWERING: "the pulley turns at a steady speed, torques on the shaft balance "
    "the load, nothing holds it",
    Status.DRIVEN: "the motor moves or holds the pulley at the end time, the brake is open",
    Status.RELEASED: "the brake is open at the end time",
}


def status_words(status: Status, words: BrakeWords) -> str:
    """What a status means for a kind of brake."""
    return STATUS_MESSAGES[status].replace("the pulley", f"the {words.body}")


def status_of(
    end: Label,
    moved: bool,
    driven: bool,
    exceeded: Callable[[], bool],
    steady: Callable[[], bool],
) -> Status:
    """Status of a run that ended in the mode `end`.

    - `moved`: whether the pulley turned at any time
    - `driven`: whether the motor runs at the end
    - `exceeded`: whether the load exceeds what the brake can hold, and `steady`: whether
      the speed is steady; called only where the pulley still turns
    """
    if driven and end.band == BandMode.OPEN:
        return Status.DRIVEN
    if end.rests:
        return Status.STOPPED if moved else Status.HELD
    if steady():
        return Status.LOWERING
    if end.band == BandMode.OPEN:
        return Status.RELEASED
    return Status.RUNAWAY if exceeded() else Status.NOT_STOPPED


def labels_of(record: Record, rows: np.ndarray | None = None) -> list[Label]:
    """Modes as in the log, in `rows` of a concrete record; by default in all rows, with
    the mode at the end."""
    mode: Mode = record.modes
    rows = np.arange(int(record.count) + 1) if rows is None else rows
    columns = (np.asarray(column)[rows].tolist() for column in mode.label)
    return [Label(*pair) for pair in zip(*columns, strict=True)]


def segments_of(record: Record) -> tuple[np.ndarray, np.ndarray]:
    """First and last rows (k,) of the spans of a concrete record between events and
    time breakpoints."""
    n = int(record.count)
    kind = np.asarray(record.rows.kind)[:n]
    last = np.union1d(np.flatnonzero(kind >= FINISHED), np.arange(n)[-1:])
    return np.append(0, last[:-1] + 1)[: len(last)], last


#: a speed within this share of the greatest set speed is followed
_FOLLOWED = 1e-2


def status_of_run(record: Record, scene: Scene) -> str:
    """Status of a concrete run, or the name of its failure code."""
    if int(record.code) != 0:
        return FAILURES[int(record.code)][0]
    if _never_follows(record, scene):
        return str(Status.NOT_FOLLOWED)
    n = int(record.count)
    moved = bool(np.any(np.asarray(record.rows.y)[: n + 1, 1] != 0.0))
    (end,) = labels_of(record, np.asarray([n]))
    exceeded = functools.partial(runs_away, record)
    steady = functools.partial(lowers_steadily, record)
    return str(status_of(end, moved, bool(ends_driven(record)), exceeded, steady))  # pyright: ignore


def _never_follows(record: Record, scene: Scene) -> bool:
    """Whether a lever or a motor that is to keep a speed throughout never brings the
    pulley near it."""
    lever = scene.duty.lever
    profile = None if scene.motor is None else scene.motor.speed
    if isinstance(lever, Driller):
        profile = lever.speed
    if profile is None:
        return False
    n = int(record.count) + 1
    speeds = np.asarray(profile.values)
    t = np.asarray(record.rows.t)[:n]
    set_speed = np.interp(t, np.asarray(profile.times), speeds)
    most = np.max(np.abs(speeds))
    # (at a small set speed a pulley that never moves would count as near it)
    asked = np.abs(set_speed) > 0.5 * most
    off = np.abs(np.asarray(record.rows.y)[:n, 1] - set_speed)[asked]
    return bool(off.size and np.all(off > _FOLLOWED * most))


# --- what an event means ------------------------------------------------------------


class EventMeaning(NamedTuple):
    """What an event of the log means: its condition, which brakes can have it, and the
    meaning in plain words."""

    meaning: str
    brakes: str
    plain: str


_ANY = "every brake"
_BAND = "a band as a whole"
_STAGED = "staged brake"
_NO_CHAIN = "every brake but the resolved chain"
_CHAIN = "resolved chain"
_RESOLVED = "resolved bandage"


def _meanings_of_marks() -> dict[str, EventMeaning]:
    return {
        mark.event: EventMeaning(f"{mark.meaning}; a mark", mark.brakes, mark.plain)
        for mark in marks()
    }


#: every name that an `Event` can have
EVENTS = {
    "slip_onset": EventMeaning(
        "t0: the band is taut, `C x = T_0` (rigid band, pads, shoes: the lever pulls)",
        _NO_CHAIN,
        "the band is taut: it begins to brake",
    ),
    "lining_limit": EventMeaning(
        "lining `i`, on alike rims that of every band, reaches its friction limit, "
        "`T_n/T_0 = Π_i` (reversed: counted from the anchor); a mark",
        _BAND,
        "a lining has reached its friction limit",
    ),
    "full_slip": EventMeaning(
        "t1: every lining slides, `T_n = T_0 Π` (reversed: `T_0/Π`)",
        _ANY,
        "every lining slides",
    ),
    "restick": EventMeaning(
        "the slip speed came to 0 while the pulley turns",
        "elastic band, chain",
        "the slip ended while the shaft turns",
    ),
    "stop": EventMeaning(
        "the pulley came to rest and is held", _ANY, "the shaft came to rest"
    ),
    "restart": EventMeaning(
        "the load exceeded the static limit of a brake at rest, or the grip fell below "
        "the load; with the band open: the load exceeded dry friction of the shaft",
        _ANY,
        "the load exceeded what the brake at rest can hold",
    ),
    "reversal": EventMeaning(
        "the speed of the pulley passed through 0 and changed its sign without a rest; "
        "against dry friction of the shaft a change of mode, else a mark",
        _ANY,
        "the shaft turned round without a rest",
    ),
    "release": EventMeaning(
        "the force of the lever fell to 0, the brake is open",
        _NO_CHAIN,
        "the brake was released and is open",
    ),
    "internal_slip": EventMeaning(
        "the linings begin to slide on the rim",
        _STAGED,
        "the linings begin to slide on the rim",
    ),
    "internal_restick": EventMeaning(
        "the linings stick to the turning rim again, `ω_b = ω`",
        _STAGED,
        "the linings stick to the rim again",
    ),
    "external_lock": EventMeaning(
        "the bandage comes to rest on a turning pulley, `ω_b = 0`",
        _STAGED,
        "the bandage came to rest, the pulley turns in it",
    ),
    "external_release": EventMeaning(
        "the bandage comes loose from the band again",
        _STAGED,
        "the bandage came loose again",
    ),
    "phase_end": EventMeaning(
        "a phase of the duty ended", "duty in phases", "a phase of the duty ended"
    ),
    "lining_slip": EventMeaning(
        "lining `i` starts to slip on the rim", _CHAIN, "a lining starts to slip"
    ),
    "lining_stick": EventMeaning(
        "lining `i` sticks to the rim", _CHAIN, "a lining sticks"
    ),
    "lining_internal_slip": EventMeaning(
        "lining `i` starts to slip on the rim",
        _RESOLVED,
        "a lining starts to slip on the rim",
    ),
    "lining_internal_stick": EventMeaning(
        "lining `i` sticks to the rim", _RESOLVED, "a lining sticks to the rim"
    ),
    "lining_external_slip": EventMeaning(
        "lining `i` starts to slip on the band",
        _RESOLVED,
        "a lining starts to slip on the band",
    ),
    "lining_external_stick": EventMeaning(
        "lining `i` comes to rest on the band", _RESOLVED, "a lining sticks to the band"
    ),
    "lining_lift_off": EventMeaning(
        "the centrifugal force lifts lining `i` off the rim, `N_int,i = 0`",
        _STAGED,
        "a lining lifts off the rim",
    ),
    "lining_touchdown": EventMeaning(
        "lining `i` touches the rim again", _STAGED, "a lining touches the rim again"
    ),
    "layer_change": EventMeaning(
        "the rope on the drum changes its layer: effective radius, hook load torque "
        "and inertia jump",
        "any brake under a hook load with layers of rope",
        "the rope changed its layer",
    ),
    "rope_slack": EventMeaning(
        "the pull of the elastic rope fell to 0, the load falls freely",
        "any brake under a hook load on an elastic rope",
        "the rope went slack",
    ),
    "rope_taut": EventMeaning(
        "the slack rope is longer than without load again, and pulls: `e > 0`, `k e + c ė > 0`",
        "any brake under a hook load on an elastic rope",
        "the rope is taut again",
    ),
    "anchor_grounded": EventMeaning(
        "the anchor stands on the ground, and its weight and inertia are off the chain",
        "any brake under a `WindlassLoad`",
        "the anchor came to the ground",
    ),
    "anchor_lifted": EventMeaning(
        "the anchor leaves the ground, with the momentum of all that moves",
        "any brake under a `WindlassLoad`",
        "the anchor left the ground",
    ),
    "friction_change": EventMeaning(
        "a change of friction began that waited for a temperature or a stop, `FrictionChange.when`",
        "any brake with a `ChangingFriction`",
        "the friction of linings began to change",
    ),
    "self_locking": EventMeaning(
        "`f tan(β/2)` of a lining reached 1: it does not slip while that lasts; a mark",
        "elastic band whose friction varies in the run",
        "a lining came to lock itself",
    ),
    **_meanings_of_marks(),
}


def known_events() -> dict[str, EventMeaning]:
    """`EVENTS`, and events of metrics that were added to `METRICS` since."""
    return {**EVENTS, **_meanings_of_marks()}


def plain_words(event: str) -> str:
    """What an event of a log means in plain words; empty for an unknown event, as from
    an earlier file."""
    meanings = known_events()
    return meanings[event].plain if event in meanings else ""


# --- the log ------------------------------------------------------------------------


class Event(NamedTuple):
    """One entry of the log: time in s, name, the lining (from 1) or the phase of the
    duty where it concerns one.

    Example:
        >>> result.events["stop"][0].name
        'stop'
    """

    time: float
    name: str
    lining: int | None = None
    phase: Ended | None = None

    def as_dict(self) -> JsonObject:
        entry: JsonObject = {"time": self.time, "name": self.name}
        if self.lining is not None:
            entry["lining"] = self.lining
        if self.phase is not None:
            entry |= {
                "phase": self.phase.phase,
                "cycle": self.phase.cycle,
                "until": self.phase.until,
            }
            if self.phase.name:
                entry["phase_name"] = self.phase.name
        return entry


class Events(list[Event]):
    """The event log in order of time: a list; `events["stop"]` are its events of that
    name.

    Raises `KeyError` with the nearest names for a name that no run has.

    Example:
        >>> log = sb.results.Events([sb.results.Event(0.1, "slip_onset"), sb.results.Event(1.2, "stop")])
        >>> log["stop"].times, len(log["restart"])
        ([1.2], 0)
    """

    def __getitem__(self, key: Any) -> Any:
        if not isinstance(key, str):
            return super().__getitem__(key)
        meanings = known_events()
        if key not in meanings:
            near = difflib.get_close_matches(key, meanings, n=3, cutoff=0.4)
            raise KeyError(
                f"{key!r} is not an event; nearest: {', '.join(near or meanings)}"
            )
        return Events(event for event in self if event.name == key)

    @property
    def times(self) -> list[float]:
        """Times of the events (s)."""
        return [event.time for event in self]


class ModeSpan(NamedTuple):
    """Consecutive steps in one mode, from sample `first` to sample `last` of a scan.

    `turned`: whether the pulley has turned since it last was at rest, where it may rest
    in an open band
    """

    label: Label
    first: int
    last: int
    start: float
    end: float
    turned: bool = False


#: a margin of a lining above this is past the limit, not at it to rounding
_PAST = 1e-12


def event_log(
    spans: list[ModeSpan],
    margins: np.ndarray,
    locate: Callable[[list[tuple[int, int]]], np.ndarray],
    linings: int,
    start: Label,
) -> list[Event]:
    """All events in order of time; entries at one instant in the order of cause and
    effect, linings by index.

    - `margins` (samples, 2 n): by how much each lining is past its limit at samples
      along the run; the first `n` for slip that begins at the slack end, the last `n`
      for slip that begins at the anchor
    - `locate`: for a list of `(i, j)` the times at which margin `j` rises through 0
      between the samples `i` and `i + 1`
    - `start`: the mode before the first span
    """
    events: list[Event] = []
    crossings: list[tuple[int, int]] = []
    places: list[int] = []
    label = start
    slips = (BandMode.SLIP, BandMode.SLIP_BACK)
    reached = np.zeros(2 * linings, bool)
    # the last lining to slip comes with full slip, whatever rounding leaves of its
    # margin there
    last = slice(max(linings - 1, 0), linings + 1)
    for number, span in enumerate(spans):
        time = float(span.start)
        for name in events_of_change(label, span.label, number == 0, span.turned):
            # linings that reach their limit only now, in the order of the slip
            if name == "full_slip":
                ahead = span.label.band == BandMode.SLIP
                order = range(linings) if ahead else reversed(range(linings))
                late = [i for i in order if not reached[i if ahead else linings + i]]
                events += [Event(time, "lining_limit", i + 1) for i in late]
            events.append(Event(time, name))
        if span.label.band == BandMode.ELASTIC:
            if label.band not in (BandMode.ELASTIC, *slips):
                reached = np.zeros(2 * linings, bool)
            within = margins[span.first : span.last + 1]
            # past the limit as the span begins, or on the way up from 0 (as under a
            # lever force that begins at 0); a run that fails there has no second sample
            soon = within[:2][-1]
            at_once = (within[0] > _PAST) | ((within[0] >= 0) & (soon > _PAST))
            events += [
                Event(time, "lining_limit", 1 + int(j) % linings)
                for j in np.flatnonzero(at_once & ~reached)
            ]
            rises = (within[:-1] <= 0) & (within[1:] > 0)
            rises[:1] &= ~at_once
            rises[:, last] = False
            for i, j in np.argwhere(rises):
                crossings.append((span.first + int(i), int(j)))
                places.append(len(events))
                events.append(Event(np.nan, "lining_limit", 1 + int(j) % linings))
            reached = within[-1] > _PAST
            reached[last] = False
        else:
            reached = np.full(2 * linings, span.label.band in slips)
        label = span.label
    if crossings:
        for place, time in zip(places, locate(crossings), strict=True):
            events[place] = events[place]._replace(time=float(time))
    # (a stable sort keeps cause before effect)
    return sorted(events, key=lambda event: event.time)


def with_phases(events: list[Event], ends: list[Event]) -> list[Event]:
    """A log with the ends of phases and the begins of changes of friction (`ends`), each
    after the last stop of its instant, which causes it, and before other events then."""
    stops = {event.time: i for i, event in enumerate(events) if event.name == "stop"}
    ranked = [
        ((event.time, 0 if i <= stops.get(event.time, -1) else 2), event)
        for i, event in enumerate(events)
    ]
    ranked += [((end.time, 1), end) for end in ends]
    return [event for _, event in sorted(ranked, key=lambda entry: entry[0])]
