"""What a brake was to do in a run, and whether it did: one decision for single runs, ensembles, C and pages.

The want comes from the input and from the course before the end, never from the motion at the end. The rules are tried
in order; the first one that fits gives the reason, with its colour. Everything here can be traced.
"""

import enum
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from .._base._compiling import DeviceJit
from .._phases import AfterTravel, AtHeight, AtRest, Phase, PhaseNow, Phases
from .._physics._brake import BrakeSystem
from .._physics._feature import LEVER, State, piece_of
from .._physics._mechanism import OPEN, TAKE_UP, BrakeCode, Mode, holds
from .._physics._shaft import rests
from ..hybrid import SKIPPED, Code, Record, smallest
from ..hybrid._arrays import Array, numpy_of
from ..loads import AbstractActuator, AbstractFollower, Lever, SpeedHold
from ..profiles import AbstractProfile
from ..shaft import EddyCurrentBrake
from ._probe import RunJit, balance_of, capacity, ends_of, in_lanes, is_traced_run

#: a holding reserve below this is small: a convention of simbrake
SMALL_RESERVE = 1.25
#: torques that differ by less than this share of a typical one balance each other
_ROUNDING = 1e-9
#: a set speed is kept within this share of it, or this speed (rad/s) if that is more
_KEPT, _KEPT_AT_LEAST = 0.05, 0.05
#: a motor has brought the pulley to rest below this share of its maximum speed
_STILL = 1e-6


class Want(enum.IntEnum):
    """What a brake is to do at the end of a run; the first five can be said (`wants`), the others only follow."""

    REST = 0
    HOLD = 1
    LOWER = 2
    HOIST = 3
    FREE = 4
    RELEASED = 5  # the lever was let go
    UNSAID = 6  # a phase with an applied lever that nothing names a stop, a hold or a lowering

    def __str__(self) -> str:
        return self.name.lower()


class Shade(enum.IntEnum):
    """Colour of a reason, as a number that can be traced."""

    GREEN = 0
    AMBER = 1
    RED = 2

    def __str__(self) -> str:
        return self.name.lower()


class Reason(NamedTuple):
    """Why a verdict has its colour: an id that does not change, and short words.

    - `shown`: whether the run showed what it was to show; if not, it is no pass, whatever its colour
    - `goes_on`: whether a load that was to stop or to hold still moves at the end
    """

    id: str
    words: str
    shown: bool = True
    goes_on: bool = False


#: in the order in which they are tried
REASONS = (
    Reason("F1", "The run failed"),
    Reason("T1", "A phase did not end", shown=False),
    Reason("H1", "The held load broke away"),
    Reason("H6", "The brake is open: dry friction alone holds the load"),
    Reason("H7", "Held by the motor alone"),
    Reason("H2", "At rest, but the friction brake alone does not hold the load"),
    Reason("H3", "To hold the load, and moves", goes_on=True),
    Reason("H4", "At rest and held"),
    Reason("X0", "No load hangs"),
    Reason("H5", "The lever was let go, and the load moves on", goes_on=True),
    Reason("S3", "Runs away", goes_on=True),
    Reason("S1", "To be stopped, and runs on", goes_on=True),
    Reason("S4", "The motor works against the applied brake", goes_on=True),
    Reason("S2", "Not shown: still in motion at the end time", shown=False, goes_on=True),
    Reason("M3", "The motor works against the applied brake"),
    Reason("M2", "The load pulls the motor down"),
    Reason("M0", "Not shown: not yet at its speed", shown=False),
    Reason("M1", "Hoisted"),
    Reason("L2", "The speed of lowering is lost"),
    Reason("L0", "Not shown: not yet at its speed", shown=False),
    Reason("L3", "Never comes to its speed"),
    Reason("L1", "Lowered at the prescribed speed"),
    Reason("L7", "Past the critical speed of the eddy-current brake"),
    Reason("L5", "Lowered at a steady speed; no pull of the friction brake is given"),
    Reason("L4", "Lowered at a steady speed"),
    Reason("L6", "Lowered, not at a steady speed"),
    Reason("U1", "Moves under the applied brake, and nothing says that it is to move", goes_on=True),
    Reason("X1", "The brake is open, the load falls"),
)


class Judgement(NamedTuple):
    """The decision on a run, with the numbers behind it: traced, or Python's of a concrete run.

    - `reason`: place in `REASONS`;  `colour`: a `Shade`;  `want`: a `Want`
    - `load` (N·m): torque of the hanging load alone, without drag, shaft, motor and inertia, at the end
    - `pull` (N): greatest pull of the whole duty on the friction brake
    - `reserve`: static capacity of the friction brake over the hanging load, at rest under the tension of the end, of
      a moving load under the greatest pull; `inf` without a hanging load
    - `sliding`: torque of the sliding friction brake over the hanging load, under the greatest pull from the end on
    - `sliding_now`: the same under the tension of the end
    - `set_speed` (rad/s) that a lever or motor is to keep at the end, NaN where none is
    - `steady`, `away`: whether the torques balance at the end, and whether the load exceeds them at any speed
    """

    reason: Any
    colour: Any
    want: Any
    load: Any
    pull: Any
    reserve: Any
    sliding: Any
    sliding_now: Any
    set_speed: Any
    steady: Any
    away: Any


# --- what is wanted ---------------------------------------------------------------------------------------------------


def said_want(words: str) -> Want | None:
    """The want that a duty or phase names, `None` where it names none."""
    return Want[words.upper()] if words else None


def _by_speed(speed: Array, *, up: Want = Want.HOIST) -> Array:
    return jnp.where(speed > 0, int(Want.LOWER), jnp.where(speed < 0, int(up), int(Want.REST)))


def _wants_of_phases(phases: Phases, begins_at_rest: Array) -> Int[Array, " phases"]:
    """The want of each phase, from its words, or else its lever, its motor and its end.

    An applied brake behind a stop, another hold or a start at rest is to hold.
    """
    wants, may_hold = list[Array](), begins_at_rest
    for phase in phases.each:
        want = _want_of(phase, may_hold)
        wants.append(want)
        may_hold = (want == int(Want.HOLD)) | isinstance(phase.until, AtRest)
    return jnp.stack(wants).astype(jnp.int32)


def _want_of(phase: Phase, may_hold: Array) -> Array:
    lever, said = phase.lever, said_want(phase.wants)
    if said is not None:
        return jnp.asarray(int(said))
    if isinstance(phase.until, AtRest) and phase.motor is None:
        return jnp.asarray(int(Want.REST))
    if isinstance(lever, AbstractFollower):
        return _by_speed(jnp.asarray(lever.speed.values)[-1])
    if lever.controls_speed:
        return jnp.asarray(int(Want.LOWER))
    if phase.motor is not None:
        return _by_speed(jnp.asarray(phase.motor.values)[-1])
    if isinstance(phase.until, AfterTravel | AtHeight):
        return jnp.asarray(int(Want.LOWER))
    pulls = lever.greatest_from(jnp.zeros(()), jnp.asarray(getattr(phase.until, "duration", 0.0))) > 0
    applied = jnp.where(may_hold, int(Want.HOLD), int(Want.UNSAID))
    return jnp.where(pulls, applied, int(Want.LOWER))


def _set_speed(part: Any, t: Array, start_speed: Array) -> Array:
    """Speed (rad/s) that a lever or a motor is to keep at its own time `t`, NaN of one that keeps none."""
    if isinstance(part, AbstractFollower):
        return jnp.asarray(part.speed.value(t, part.speed.first_piece(t)))
    return start_speed if isinstance(part, SpeedHold) else jnp.full_like(start_speed, jnp.nan)


def _paced(now: Any, t: Array, start_speed: Array) -> Array:
    """The same of a lever or motor, or of that of the phase that runs."""
    if not isinstance(now, PhaseNow):
        return _set_speed(now, t, start_speed)
    local = t - now.begun
    speeds = jnp.stack([_set_speed(phase.lever, local, start_speed) for phase in now.whole.each])
    return jnp.sum(jnp.where(now.here, jnp.nan_to_num(speeds), 0.0)) + jnp.where(
        jnp.any(now.here & jnp.isnan(speeds)), jnp.nan, 0.0
    )


def _command_waits(lever: Any, t: Array) -> Array:
    """Whether an actuator has been told to pull, and its force is still to come."""
    if isinstance(lever, PhaseNow):
        local = t - lever.begun
        return jnp.any(lever.here & jnp.stack([_command_waits(phase.lever, local) for phase in lever.whole.each]))
    if isinstance(lever, Lever):
        return _command_waits(lever.force, t)
    if not isinstance(lever, AbstractActuator):
        return jnp.asarray(False)
    return jnp.asarray(lever.input.value(t, lever.input.first_piece(t)) > 0)


# --- what happened before the end -------------------------------------------------------------------------------------


class LeverNow(NamedTuple):
    """The lever at one instant: its pull (N), whether motion is meant there, and whether a phase is to hold there."""

    pull: Array
    moves: Array
    is_hold: Array


def _lever_now(system: BrakeSystem, t: Array, y: State, mode: Mode, start_speed: Array) -> LeverNow:
    lever, piece, said = system.lever_at(y, mode), piece_of(mode, LEVER), said_want(system.wants)
    pull = jnp.asarray(lever.value(t, piece), jnp.float64)
    moving = (int(Want.LOWER), int(Want.HOIST), int(Want.FREE))
    moves = jnp.asarray(said in (Want.LOWER, Want.HOIST, Want.FREE))
    is_hold = jnp.asarray(said is Want.HOLD)
    if isinstance(lever, PhaseNow):
        want = jnp.sum(jnp.where(lever.here, _wants_of_phases(lever.whole, start_speed == 0), 0))
        moves = jnp.any(jnp.stack([want == one for one in moving]))
        is_hold = want == int(Want.HOLD)
    elif system.motor is not None and said is None:
        moves = _paced(system.motor.now(y, mode), t, start_speed) != 0
    follows = lever.follows(piece) if lever.controls_speed else False
    return LeverNow(pull, moves | follows, is_hold)


def _levers(system: BrakeSystem, t: Array, y: State, mode: Mode, start_speed: Array) -> LeverNow:
    return jax.vmap(_lever_now, in_axes=(None, 0, 0, 0, None))(system, t, y, mode, start_speed)


_LEVERS = DeviceJit(_levers, quick=True)


class Holding(NamedTuple):
    """Rows of a record: in which the brake is `to_hold`, and that begin with a held load that has `broken` away; and
    the pull of the lever (N) at the begin of each."""

    to_hold: Bool[Array, " rows"]
    broken: Bool[Array, " rows"]
    pull: Float[Array, " rows"]


#: tensions that differ by less than this share of the greatest one are the same
_SAME = 1e-9


def holding_rows(record: Record) -> Holding:
    """When the brake is to hold the pulley at rest, and when a held load broke away.

    The lever is let go where it falls, the load moves off, and the brake opens before the pulley rests again, unless
    a phase is to hold. A load that moves off otherwise has broken away, unless its motion is meant.
    """
    rows, xp = record.rows, numpy_of(record.rows.t)
    n = rows.t.shape[0]
    number_of = xp.arange(n, dtype=np.int32)
    used = (number_of < record.count) & (rows.kind != SKIPPED)
    ends = rows.t[xp.minimum(number_of + 1, record.count)]
    start_speed = rows.y[0, 1]
    system: BrakeSystem = record.system  # pyright: ignore
    y, modes = record.states, record.modes

    def look(index: np.ndarray) -> tuple[LeverNow, LeverNow]:
        at = jax.tree.map(lambda column: np.asarray(column)[index], (rows.t, ends, y, modes))
        t, later, *state = at
        return _LEVERS(system, t, *state, start_speed), _LEVERS(system, later, *state, start_speed)

    if is_traced_run(record):
        first, last = (_levers(system, t, y, modes, start_speed) for t in (rows.t, ends))
    else:
        start_speed = np.asarray(start_speed)
        modes = jax.tree.map(np.asarray, modes)
        first, last = in_lanes(look, number_of)
    held = holds(modes)
    lasts = used & (ends > rows.t)  # (rows without duration say nothing)
    slack = _SAME * xp.max(xp.where(used, xp.abs(first.pull), 0.0))
    falls = last.pull < first.pull - slack
    # the last lasting row before each
    before = xp.maximum.accumulate(xp.where(lasts, number_of, -1))
    before = xp.concatenate([xp.full(1, -1, before.dtype), before[:-1]])
    moves_off = lasts & ~held & (before >= 0) & held[before] & ~rests(modes)
    drops = falls[before] | (first.pull < last.pull[before] - slack)
    # the first row from each on in which the brake is open, and in which the pulley rests
    there = number_of <= record.count
    opens = _next(there & ((modes.band == OPEN) | (first.pull <= 0)), n, xp)
    rest_again = _next(there & rests(modes), n, xp)
    let_go = drops & (opens < rest_again) & ~first.is_hold
    broken = moves_off & ~let_go & ~first.moves
    # of a fall that lets go nothing is to be held from where it begins
    falling = lasts & held & falls & ~first.is_hold
    steady = _next(lasts & ~falling, n, xp)
    after = xp.minimum(steady, n - 1)
    released = falling & (steady < n) & ~held[after] & (opens[after] < rest_again[after])
    return Holding(lasts & held & ~released, broken & (rows.y[:, 1] == 0.0), first.pull)


def _next(marked: Bool[Array, " n"], n: int, xp: Any) -> Int[Array, " n"]:
    """Of each row the first one from it on that is marked, `n` where none is."""
    places = xp.where(marked, xp.arange(n, dtype=np.int32), np.int32(n))
    return xp.minimum.accumulate(places[::-1])[::-1]


class Past(NamedTuple):
    """What the end of a run does not show: whether a held load broke away, whether the pulley was at rest and moved
    again, and whether the lever pulled at the start and at any time."""

    broke_away: Any
    rested: Any
    began_pulling: Any
    pulled: Any


def _past(record: Record) -> Past:
    rows, xp = record.rows, numpy_of(record.rows.t)
    holding = holding_rows(record)
    number_of = xp.arange(rows.t.shape[0], dtype=np.int32)
    there = number_of <= record.count
    resting = there & rests(jax.tree.map(xp.asarray, record.modes))
    moved_last = xp.max(xp.where(there & ~resting, number_of, -1))
    return Past(
        xp.any(holding.broken),
        xp.any(resting & (number_of < moved_last)),
        holding.pull[0] > 0,
        xp.any(there & (holding.pull > 0)),
    )


# --- the decision -----------------------------------------------------------------------------------------------------


def _greatest_pull(system: BrakeSystem, start: Array, end: Array) -> Array:
    lever = system.lever
    levers = [phase.lever for phase in lever.each] if isinstance(lever, Phases) else [lever]
    zero = jnp.zeros(())
    begins, ends = (zero, end - start) if isinstance(lever, Phases) else (start, end)
    pulls = jnp.stack([jnp.asarray(one.greatest_from(begins, ends), jnp.float64) for one in levers])
    return jnp.maximum(jnp.max(pulls), 0.0)


def _pull_to_come(lever: AbstractProfile | PhaseNow, t: Array, end: Array) -> Array:
    """Greatest pull from the time `t` on, of the phase that runs."""
    if not isinstance(lever, PhaseNow):
        return jnp.asarray(lever.greatest_from(t, end))
    local = t - lever.begun
    return lever.of_each([phase.lever.greatest_from(local, end - lever.begun) for phase in lever.whole.each])


def _judged(
    system: BrakeSystem, t: Array, y: State, mode: Mode, start: tuple[Array, Array], code: Array, past: Past
) -> Judgement:
    """The decision from the state at the end, `start`: time and speed at the start."""
    start_time, start_speed = start
    omega, size = y.omega, system.sizes.torque
    lever, piece = system.lever_at(y, mode), piece_of(mode, LEVER)
    *_, surfaces, (tension, _) = system.given(t, y, mode)
    load = system.load_torque(t, 0.0 * omega, mode)
    hangs = jnp.abs(load) > _ROUNDING * size
    way = jnp.where(load < 0, -1.0, 1.0)
    follows = jnp.asarray(lever.follows(piece) if lever.controls_speed else False)

    most = _greatest_pull(system, start_time, t)
    to_come = jnp.maximum(_pull_to_come(lever, t, t), 0.0)
    at_limit = follows & (tension >= (1 - _ROUNDING) * _pull_to_come(lever, t, t))
    here = jnp.where(follows, to_come, tension)
    engaged = jnp.asarray(False)
    motor_at_limit = jnp.asarray(False)
    still = jnp.asarray(False)
    if system.motor is not None:
        motor = system.motor
        course = motor.now(y, mode)
        engaged = jnp.asarray(course.follows(piece_of(mode, motor.piece)))
        given = jnp.abs(motor.torque(system, t, omega, y, mode))
        motor_at_limit = engaged & (given >= (1 - _ROUNDING) * motor.motor.available(omega))
        still = engaged & (jnp.abs(omega) <= _STILL * motor.motor.max_speed)
    at_rest = rests(mode) | still
    moves = ~at_rest
    closed = (mode.band != OPEN) & (mode.band != TAKE_UP) & (tension > 0)

    def over_load(tension: Array, speed: Array, *, static: bool) -> Array:
        torque = smallest(system.capacity(tension, speed, y.own, surfaces, static=static))
        return jnp.where(hangs, torque / jnp.where(hangs, jnp.abs(load), 1.0), jnp.inf)

    reserve = over_load(jnp.where(at_rest & closed, here, most), way, static=True)
    sense = way * jnp.where(omega == 0, 1.0, jnp.abs(omega))
    sliding, sliding_now = jax.vmap(lambda pull: over_load(pull, sense, static=False))(jnp.stack([to_come, here]))

    balance = balance_of(system, t, y, mode)
    rises = balance.rises > _ROUNDING * size
    steady = balance.steady

    # --- the want
    drag = load - system.load_torque(t, omega, mode)
    if system.shaft is not None:
        drag = drag + system.shaft.engaged(mode).turning(
            t, omega, load, jnp.zeros_like(omega), system.shaft.pieces(mode)
        )
    drags = jnp.abs(drag) > _ROUNDING * size
    set_speed = _paced(lever, t, start_speed)
    if system.motor is not None:
        by_motor = _paced(system.motor.now(y, mode), t, start_speed)
        set_speed = jnp.where(engaged & jnp.isnan(set_speed), by_motor, set_speed)
    paced = ~jnp.isnan(set_speed)
    pulls = (tension > 0) | _command_waits(lever, t)
    said = said_want(system.wants)
    if isinstance(lever, PhaseNow):
        want = jnp.sum(jnp.where(lever.here, _wants_of_phases(lever.whole, start_speed == 0), 0))
        names = jnp.stack([jnp.asarray(bool(phase.wants)) for phase in lever.whole.each])
        is_said = jnp.any(lever.here & names)
        want = jnp.where((want == int(Want.UNSAID)) & ~pulls, int(Want.RELEASED), want)
    elif said is not None:
        want, is_said = jnp.asarray(int(said)), jnp.asarray(True)
    else:
        applied = jnp.where(past.began_pulling & (start_speed == 0) | past.rested, int(Want.HOLD), int(Want.REST))
        never = jnp.where(drags, int(Want.LOWER), int(Want.FREE))
        want = jnp.where(pulls, applied, jnp.where(past.pulled, int(Want.RELEASED), never))
        want = jnp.where(paced, _by_speed(jnp.nan_to_num(set_speed)), want)
        is_said = jnp.asarray(False)
    to_rest = want == int(Want.REST)
    hold = want == int(Want.HOLD)
    lower = want == int(Want.LOWER)
    hoist = want == int(Want.HOIST)
    free = want == int(Want.FREE)
    released = want == int(Want.RELEASED)
    unsaid = want == int(Want.UNSAID)

    kept = jnp.maximum(_KEPT * jnp.abs(set_speed), _KEPT_AT_LEAST)
    ahead = jnp.where(set_speed < 0, -1.0, 1.0) * omega  # speed in the sense of the set one
    slow = ahead < jnp.abs(set_speed) - kept
    fast = ahead > jnp.abs(set_speed) + kept
    to_move = (lower | hoist) & ~(paced & (jnp.abs(set_speed) <= 0))
    stays = ~to_move
    green, amber, red = (jnp.asarray(int(shade)) for shade in Shade)

    def by_reserve(low: Array) -> Array:
        small = jnp.where(reserve < SMALL_RESERVE, amber, green)
        return jnp.where(reserve <= 1, low, small)

    past_critical = jnp.asarray(False)
    if system.shaft is not None:
        critical = [law.critical_speed for law in system.shaft.laws if isinstance(law, EddyCurrentBrake)]
        for least in critical:
            past_critical = past_critical | drags & (jnp.abs(omega) > least)
    waits_for_rest = isinstance(lever, PhaseNow) and jnp.any(
        lever.here & np.asarray([isinstance(phase.until, AtRest) for phase in lever.whole.each])
    )

    def rules() -> Iterator[tuple[str, Any, Any]]:
        """Reason, whether it fits, and its colour, in the order of `REASONS`."""
        never_ends = code == int(BrakeCode.PHASE_NEVER_ENDS)
        yield "F1", (code != int(Code.COMPLETED)) & ~never_ends, red
        yield "T1", never_ends, jnp.where(waits_for_rest & moves & (sliding <= 1), red, amber)
        yield "H1", past.broke_away, red
        yield "H6", at_rest & ~closed & hangs & ~engaged, jnp.where(lower, amber, red)
        yield "H7", at_rest & ~closed & hangs & engaged, amber
        yield "H2", at_rest & stays & hangs & (reserve <= 1), red
        yield "H3", hold & moves, red
        yield "H4", at_rest & stays & (closed | to_rest | hold), by_reserve(red)
        yield "X0", ~hangs & ~paced & ~to_rest & ~unsaid, green
        yield "H5", released & moves, amber
        yield "S3", to_rest & moves & (sliding <= 1) & rises, red
        yield "S1", to_rest & moves & (sliding <= 1), red
        yield "S4", to_rest & moves & engaged & closed & ~rises & steady, amber
        yield "S2", to_rest & moves, amber
        yield "M3", to_move & engaged & closed & ~follows, amber
        yield "M2", hoist & slow & (motor_at_limit | hangs & (omega * way > _KEPT_AT_LEAST)), red
        yield "M0", hoist & slow, amber
        yield "M1", hoist, jnp.where(reserve <= 1, amber, green)
        yield "L2", lower & paced & (fast | at_limit), red
        yield "L0", lower & paced & slow & rises, amber
        yield "L3", lower & (paced & slow | at_rest), amber
        yield "L1", lower & paced, jnp.where(most > 0, by_reserve(red), jnp.where(hangs, amber, green))
        yield "L7", lower & past_critical, red
        yield "L5", lower & steady & (most <= 0), amber
        yield "L4", lower & steady, by_reserve(red)
        yield "L6", lower, jnp.where(rises & ~balance.tends, red, amber)
        yield "U1", unsaid & moves, jnp.where(sliding <= 1, red, amber)
        yield "X1", True, jnp.where(hangs & moves, jnp.where(is_said & free, amber, red), green)

    ids, fits, colours = zip(*rules(), strict=True)
    assert ids == tuple(reason.id for reason in REASONS)
    first = jnp.argmax(jnp.stack([jnp.asarray(fit, bool) for fit in fits])).astype(jnp.int32)
    colours = jnp.stack([jnp.asarray(colour, jnp.int32) for colour in colours])
    return Judgement(
        first,
        jnp.sum(jnp.where(jnp.arange(len(ids), dtype=jnp.int32) == first, colours, 0)).astype(jnp.int32),
        want.astype(jnp.int32),
        load,
        most,
        reserve,
        sliding,
        sliding_now,
        set_speed,
        steady,
        capacity(system, t, y, mode, start_time).exceeded & ~balance.tends,
    )


_JUDGED = RunJit(_judged, quick=True)


def judge(record: Record) -> Judgement:
    """What the brake was to do, and whether it did, of a run at its end; NumPy's of a concrete one."""
    (start, first, _), (t, y, mode) = ends_of(record)
    past = _past(record)
    decide: Callable[..., Judgement] = _judged if is_traced_run(record) else _JUDGED
    return decide(record.system, t, y, mode, (start, first.omega), record.code, past)


class Coded(NamedTuple):
    """What a table of many runs keeps of each decision."""

    reason: Any
    colour: Any
    steady: Any
    away: Any


_COUNTS = Coded(len(REASONS), len(Shade), 2, 2)


def coded(judgement: Judgement) -> Array:
    """A decision as one whole number."""
    kept = Coded(judgement.reason, judgement.colour, judgement.steady, judgement.away)
    number = jnp.zeros((), jnp.int32)
    for part, count in zip(kept, _COUNTS, strict=True):
        number = count * number + jnp.asarray(part, jnp.int32)
    return number


def decoded(numbers: np.ndarray) -> Coded:
    """Decisions of numbers that `coded` gave."""
    return Coded(*np.unravel_index(np.asarray(numbers, int), _COUNTS))
