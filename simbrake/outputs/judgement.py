"""Whether a brake did in a run what it was to do: one decision for single runs,
ensembles, C and pages.

The rules are tried in order; the first one that fits gives the reason, with its colour.
Everything here can be traced.
"""

import enum
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from ..hybrid import LANDED, Code, Record, smallest
from ..hybrid.arrays import Array, TwoArrays, numpy_of
from ..hybrid.system import unravel
from ..phases import AtRest, PhaseNow, Phases, levers_of, of_running
from ..physics._brake import BrakeSystem, State
from ..physics.mechanism import OPEN, TAKE_UP, BrakeCode, Mode
from ..physics.shaft import Drive, Shaft, rests
from ..shaft import EddyCurrentBrake
from ._wants import (
    Past,
    Want,
    holding_rows,
    is_commanded,
    next_marked,
    past_of,
    set_speed_of,
    want_of_input,
    want_of_speed,
)
from .metrics import held_share
from .programs import RunJit, ends_of, is_traced_run
from .torques import balance_of, capacity, holding, is_led

#: a holding reserve below this is small: a convention of simbrake
SMALL_RESERVE = 1.25
#: torques that differ by less than this share of a typical one balance each other
_ROUNDING = 1e-9
#: a set speed is kept within this share of it, or this speed (rad/s) if that is more
_KEPT = 0.05
_KEPT_AT_LEAST = 0.05
#: a motor has brought the pulley to rest below this share of its maximum speed
_STILL = 1e-6


class Colour(enum.StrEnum):
    """Colour of a verdict, from the best to the worst.

    Example:
        >>> result.verdict().colour == "amber"
        True
    """

    GREEN = "green"
    AMBER = "amber"
    RED = "red"


#: by its number in traced results
COLOURS = tuple(Colour)
_GREEN, _AMBER, _RED = range(len(COLOURS))


class Reason(NamedTuple):
    """Why a verdict has its colour: an id that does not change, and short words.

    - `shown`: whether the run showed what it was to show; if not, it is no pass,
      whatever its colour
    - `goes_on`: whether a load that was to stop or to hold still moves at the end
    - `held`: false for a load at rest that broke away before, or that the friction brake
      alone does not hold
    """

    id: str
    words: str
    shown: bool = True
    goes_on: bool = False
    held: bool = True


#: in the order in which they are tried
REASONS = (
    Reason("F1", "The run failed"),
    Reason("T1", "A phase did not end", shown=False),
    Reason("H1", "The held load broke away", held=False),
    Reason("H6", "The brake is open: dry friction alone holds the load", held=False),
    Reason("H7", "Held by the motor alone"),
    Reason(
        "H2",
        "At rest, but the friction brake alone does not hold the load",
        held=False,
    ),
    Reason("H3", "To hold the load, and moves", goes_on=True),
    Reason("H4", "At rest and held"),
    Reason("X0", "No load hangs"),
    Reason("H5", "The lever was let go, and the load moves on", goes_on=True),
    Reason("S3", "Runs away", goes_on=True),
    Reason("S1", "To be stopped, and runs on", goes_on=True),
    Reason("S4", "The motor works against the applied brake", goes_on=True),
    Reason(
        "S2", "Not shown: still in motion at the end time", shown=False, goes_on=True
    ),
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
    Reason(
        "U1",
        "Moves under the applied brake, and nothing says that it is to move",
        goes_on=True,
    ),
    Reason("X1", "The load moves, and nothing is to stop it"),
)


class Judgement(NamedTuple):
    """The decision on a run, with the numbers behind it: traced, or Python's of a
    concrete run.

    - `reason`: place in `REASONS`;  `colour`: place in `COLOURS`;  `want`: a `Want`
    - `load` (N·m): torque of the hanging load alone, without drag, shaft, motor and
      inertia, at the end
    - `pull` (N): greatest pull of the whole duty on the friction brake
    - `reserve`: static capacity of the friction brake over the hanging load, at rest
      under the tension of the end, of a moving load under the greatest pull; `inf`
      without a hanging load. Of a load that depends on the angle the least over all
      angles of the run, the others under the greatest pull
    - `sliding`: torque of the sliding friction brake over the hanging load, under the
      greatest pull from the end on
    - `sliding_now`: the same under the tension of the end
    - `set_speed` (rad/s) that a lever or motor is to keep at the end, NaN where none is
    - `steady`, `away`: whether the torques balance at the end, and whether the load
      exceeds them at any speed
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


def _greatest_pull(system: BrakeSystem, start: Array, end: Array) -> Array:
    lever = system.lever
    zero = jnp.zeros(())
    begins, ends = (zero, end - start) if isinstance(lever, Phases) else (start, end)
    pulls = jnp.stack(
        [
            jnp.asarray(lever.greatest_from(begins, ends), jnp.float64)
            for lever in levers_of(lever)
        ]
    )
    return jnp.maximum(jnp.max(pulls), 0.0)


class _End(NamedTuple):
    """The brake at the end of a run, as the rules see it.

    - `load` (N·m), and whether one `hangs`; `hauls_down`: whether the pulley turns the
      way in which the load pulls
    - `pull`, `reserve`, `sliding`, `sliding_now`, `set_speed`, `steady`, `away`: as in
      `Judgement`
    - `rises`: whether the torques speed the pulley up; `tends`: whether they balance at
      some higher speed
    - `rests`: also where the motor keeps the pulley at rest; `closed`: whether the
      friction brake touches and pulls
    - `pulls`: whether the lever pulls, or has been told to; `follows` a speed;
      `at_limit` of its pull while it does
    - `engaged`: the motor, and whether it is `at_full_torque`
    - `drags`: whether something but the brake takes torque of the motion;
      `past_critical` speed of an eddy brake
    - `awaits_rest`: whether the phase that runs ends with a stop
    """

    load: Array
    hangs: Array
    hauls_down: Array
    omega: Array
    pull: Array
    reserve: Array
    sliding: Array
    sliding_now: Array
    set_speed: Array
    steady: Array
    rises: Array
    tends: Array
    away: Array
    rests: Array
    closed: Array
    pulls: Array
    follows: Array
    at_limit: Array
    engaged: Array
    at_full_torque: Array
    drags: Array
    past_critical: Array
    awaits_rest: Array


class _MotorNow(NamedTuple):
    engaged: Array
    at_full_torque: Array
    keeps_still: Array
    set_speed: Array


def _motor_now(
    system: BrakeSystem, t: Array, y: State, mode: Mode, start_speed: Array
) -> _MotorNow:
    motor = system.feature(Drive)
    if motor is None:
        no = jnp.asarray(False)
        return _MotorNow(no, no, no, jnp.full_like(start_speed, jnp.nan))
    course = motor.now(y, mode)
    engaged = motor.follows(y, mode)
    given = jnp.abs(motor.torque(system, t, y.omega, y, mode))
    full = given >= (1 - _ROUNDING) * motor.motor.available(y.omega)
    still = jnp.abs(y.omega) <= _STILL * motor.motor.max_speed
    set_speed = jnp.where(engaged, set_speed_of(course, t, start_speed), jnp.nan)
    return _MotorNow(engaged, engaged & full, engaged & still, set_speed)


def _drag(system: BrakeSystem, t: Array, y: State, mode: Mode, load: Array) -> Array:
    """Torque (N·m) of what the motion itself causes: drag of the load and of the
    shaft."""
    drag = load - system.hanging_torque(t, y.omega, mode, y)
    shaft = system.feature(Shaft)
    if shaft is None:
        return drag
    return drag + shaft.engaged(mode).turning(
        t, y.omega, load, jnp.zeros_like(y.omega), shaft.pieces(mode)
    )


def _exceeds_critical(system: BrakeSystem, omega: Array) -> Array:
    shaft = system.feature(Shaft)
    laws = () if shaft is None else shaft.laws
    speeds = [law.critical_speed for law in laws if isinstance(law, EddyCurrentBrake)]
    if not speeds:
        return jnp.asarray(False)
    return jnp.any(jnp.stack([jnp.asarray(jnp.abs(omega) > each) for each in speeds]))


def _end_of(
    system: BrakeSystem,
    t: Array,
    y: State,
    mode: Mode,
    start: TwoArrays,
    greatest_loads: TwoArrays | None,
) -> _End:
    """The brake at the end; `start`: time and speed at the start, `greatest_loads`
    of the run (N·m, ≥ 0) in either sense, where they depend on the angle."""
    start_time, start_speed = start
    omega = y.omega
    size = system.sizes.torque
    lever = system.lever_at(y, mode)
    applied, surfaces = system.shaft_and_lever(t, y, mode)
    tension = applied.lever_tension
    load = system.hanging_torque(t, 0.0 * omega, mode, y)
    hangs = jnp.abs(load) > _ROUNDING * size
    way = jnp.where(load < 0, -1.0, 1.0)
    motor = _motor_now(system, t, y, mode, start_speed)
    at_rest = rests(mode) | motor.keeps_still
    closed = (mode.band != OPEN) & (mode.band != TAKE_UP) & (tension > 0)

    follows = is_led(system, y, mode)
    limit = of_running(lever, t, lambda lever, t: lever.greatest_from(t, t))
    to_come = jnp.maximum(limit, 0.0)
    here = jnp.where(follows, to_come, tension)
    most = _greatest_pull(system, start_time, t)

    def over_load(tension: Array, speed: Array, *, static: bool) -> Array:
        torque = smallest(
            system.capacity(tension, speed, y.own, surfaces, static=static)
        )
        return jnp.where(hangs, torque / jnp.where(hangs, jnp.abs(load), 1.0), jnp.inf)

    sense = way * jnp.where(omega == 0, 1.0, jnp.abs(omega))
    sliding, sliding_now = jax.vmap(lambda pull: over_load(pull, sense, static=False))(
        jnp.stack([to_come, here])
    )
    reserve = over_load(jnp.where(at_rest & closed, here, most), way, static=True)
    for most_load, side in zip(greatest_loads or (), (1.0, -1.0), strict=False):
        side = jnp.asarray(side)
        pairs = system.capacity(most, side, y.own, surfaces, static=True)
        pulls = most_load > _ROUNDING * size
        share = smallest(pairs) / jnp.where(pulls, most_load, 1.0)
        reserve = jnp.minimum(reserve, jnp.where(pulls, share, jnp.inf))
    balance = balance_of(system, t, y, mode)
    drags = jnp.abs(_drag(system, t, y, mode, load)) > _ROUNDING * size
    by_lever = set_speed_of(lever, t, start_speed)
    awaits_rest = jnp.asarray(False)
    if isinstance(lever, PhaseNow):
        ends_with_stop = np.asarray(
            [isinstance(phase.until, AtRest) for phase in lever.whole.each]
        )
        awaits_rest = jnp.any(lever.here & ends_with_stop)
    return _End(
        load=load,
        hangs=hangs,
        hauls_down=hangs & (omega * way > _KEPT_AT_LEAST),
        omega=omega,
        pull=most,
        reserve=reserve,
        sliding=sliding,
        sliding_now=sliding_now,
        set_speed=jnp.where(jnp.isnan(by_lever), motor.set_speed, by_lever),
        steady=balance.steady,
        rises=balance.rises > _ROUNDING * size,
        tends=balance.tends,
        away=capacity(system, t, y, mode, start_time).exceeded & ~balance.tends,
        rests=at_rest,
        closed=closed,
        pulls=(tension > 0) | is_commanded(lever, t),
        follows=follows,
        at_limit=follows & (tension >= (1 - _ROUNDING) * limit),
        engaged=motor.engaged,
        at_full_torque=motor.at_full_torque,
        drags=drags,
        past_critical=drags & _exceeds_critical(system, omega),
        awaits_rest=awaits_rest,
    )


def _want_at_end(
    system: BrakeSystem, y: State, mode: Mode, end: _End, start_speed: Array, past: Past
) -> TwoArrays:
    """What is wanted at the end, and whether words say it."""
    lever = system.lever_at(y, mode)
    want, named = want_of_input(system, lever, start_speed)
    if isinstance(lever, PhaseNow):
        released = (want == Want.UNSAID) & ~end.pulls
        return jnp.where(released, Want.RELEASED, want), named
    to_hold = past.began_pulling & (start_speed == 0) | past.rested
    applied = jnp.where(to_hold, Want.HOLD, Want.REST)
    never = jnp.where(end.drags, Want.LOWER, Want.FREE)
    shown = jnp.where(end.pulls, applied, jnp.where(past.pulled, Want.RELEASED, never))
    shown = jnp.where(
        jnp.isnan(end.set_speed), shown, want_of_speed(jnp.nan_to_num(end.set_speed))
    )
    return jnp.where(named, want, shown), named


def _colour_of_reserve(reserve: Array) -> Array:
    xp = numpy_of(reserve)
    small = xp.where(reserve < SMALL_RESERVE, _AMBER, _GREEN)
    return xp.where(reserve <= 1, _RED, small)


def _rules(
    end: _End, want: Array, named: Array, code: Array, past: Past
) -> Iterator[tuple[str, Any, Any]]:
    """Reason, whether it fits, and its colour, in the order of `REASONS`."""
    to_rest = want == Want.REST
    hold = want == Want.HOLD
    lower = want == Want.LOWER
    hoist = want == Want.HOIST
    free = want == Want.FREE
    unsaid = want == Want.UNSAID
    has_set_speed = ~jnp.isnan(end.set_speed)
    to_move = (lower | hoist) & ~(has_set_speed & (jnp.abs(end.set_speed) <= 0))
    stays = ~to_move
    moves = ~end.rests
    kept = jnp.maximum(_KEPT * jnp.abs(end.set_speed), _KEPT_AT_LEAST)
    speed_its_way = jnp.where(end.set_speed < 0, -1.0, 1.0) * end.omega
    slow = speed_its_way < jnp.abs(end.set_speed) - kept
    fast = speed_its_way > jnp.abs(end.set_speed) + kept
    by_reserve = _colour_of_reserve(end.reserve)
    strong = end.sliding > 1

    never_ends = code == BrakeCode.PHASE_NEVER_ENDS
    yield "F1", (code != Code.COMPLETED) & ~never_ends, _RED
    yield "T1", never_ends, jnp.where(end.awaits_rest & moves & ~strong, _RED, _AMBER)
    yield "H1", past.broke_away, _RED
    yield (
        "H6",
        end.rests & ~end.closed & end.hangs & ~end.engaged,
        jnp.where(lower, _AMBER, _RED),
    )
    yield "H7", end.rests & ~end.closed & end.hangs & end.engaged, _AMBER
    yield "H2", end.rests & stays & end.hangs & (end.reserve <= 1), _RED
    yield "H3", hold & moves, _RED
    yield "H4", end.rests & stays & (end.closed | to_rest | hold), by_reserve
    yield "X0", ~end.hangs & ~has_set_speed & ~to_rest & ~unsaid, _GREEN
    yield "H5", (want == Want.RELEASED) & moves, _AMBER
    yield "S3", to_rest & moves & ~strong & end.rises & ~end.steady, _RED
    yield "S1", to_rest & moves & ~strong, _RED
    yield (
        "S4",
        to_rest & moves & end.engaged & end.closed & ~end.rises & end.steady,
        _AMBER,
    )
    yield "S2", to_rest & moves, _AMBER
    yield "M3", to_move & end.engaged & end.closed & ~end.follows, _AMBER
    yield "M2", hoist & slow & (end.at_full_torque | end.hauls_down), _RED
    yield "M0", hoist & slow, _AMBER
    yield "M1", hoist, jnp.where(end.reserve <= 1, _AMBER, _GREEN)
    yield "L2", lower & has_set_speed & (fast | end.at_limit), _RED
    yield "L0", lower & has_set_speed & slow & end.rises, _AMBER
    yield "L3", lower & (has_set_speed & slow | end.rests), _AMBER
    yield (
        "L1",
        lower & has_set_speed,
        jnp.where(end.pull > 0, by_reserve, jnp.where(end.hangs, _AMBER, _GREEN)),
    )
    yield "L7", lower & end.past_critical, _RED
    yield "L5", lower & end.steady & (end.pull <= 0), _AMBER
    yield "L4", lower & end.steady, by_reserve
    yield "L6", lower, jnp.where(end.rises & ~end.tends, _RED, _AMBER)
    yield "U1", unsaid & moves, jnp.where(strong, _AMBER, _RED)
    yield (
        "X1",
        True,
        jnp.where(end.hangs & moves, jnp.where(named & free, _AMBER, _RED), _GREEN),
    )


def _judged(
    system: BrakeSystem,
    t: Array,
    y: State,
    mode: Mode,
    start: TwoArrays,
    code: Array,
    past: Past,
    greatest_loads: TwoArrays | None,
) -> Judgement:
    end = _end_of(system, t, y, mode, start, greatest_loads)
    want, named = _want_at_end(system, y, mode, end, start[1], past)
    ids, fits, colours = zip(*_rules(end, want, named, code, past), strict=True)
    assert ids == tuple(reason.id for reason in REASONS)
    fits = jnp.stack([jnp.asarray(fit, bool) for fit in fits])
    colours = jnp.stack([jnp.asarray(colour, jnp.int32) for colour in colours])
    number_of = jnp.arange(len(ids), dtype=jnp.int32)
    first = jnp.argmax(fits).astype(jnp.int32)
    # of a phase that did not end the worse colour counts, its own or that of the next
    # rule, which judges what the brake did in it
    never_ends = ids.index("T1")
    second = jnp.argmax(fits & (number_of != never_ends)).astype(jnp.int32)
    chosen = (number_of == first) | ((first == never_ends) & (number_of == second))
    return Judgement(
        reason=first,
        colour=jnp.max(jnp.where(chosen, colours, 0)).astype(jnp.int32),
        want=want.astype(jnp.int32),
        load=end.load,
        pull=end.pull,
        reserve=end.reserve,
        sliding=end.sliding,
        sliding_now=end.sliding_now,
        set_speed=end.set_speed,
        steady=end.steady,
        away=end.away,
    )


_JUDGED = RunJit(_judged, quick=True)


def _greatest_loads(record: Record) -> TwoArrays:
    """Greatest load (N·m, ≥ 0) on a pulley at rest in either sense, over both ends of
    all steps of a run."""
    system: BrakeSystem = record.system  # pyright: ignore
    rows = jnp.arange(record.rows.t.shape[0], dtype=jnp.int32)
    after = jnp.minimum(rows + 1, record.count)
    # (the angle does not jump)
    ends = jax.tree.map(lambda column: column[after], record.states)

    def hanging(t: Array, y: State, mode: Mode) -> Array:
        return system.hanging_torque(t, jnp.zeros(()), mode, y)

    loads = jnp.stack(
        [
            jax.vmap(hanging)(record.rows.t, y, record.modes)
            for y in (record.states, ends)
        ]
    )
    loads = jnp.where((rows < record.count) & jnp.isfinite(loads), loads, 0.0)
    return jnp.max(loads, initial=0.0), -jnp.min(loads, initial=0.0)


_GREATEST_LOADS = RunJit(_greatest_loads, quick=True)


def judge(record: Record) -> Judgement:
    """What the brake was to do, and whether it did, of a run at its end; NumPy's of a
    concrete one."""
    (start, first, _), (t, y, mode) = ends_of(record)
    past = past_of(record)
    decide: Callable[..., Judgement] = _judged if is_traced_run(record) else _JUDGED
    system: BrakeSystem = record.system  # pyright: ignore
    loads = _GREATEST_LOADS(record) if system.load.by_angle else None
    start = (start, first.omega)
    return decide(system, t, y, mode, start, record.code, past, loads)


def held_throughout(found: Judgement, least: Any) -> Judgement:
    """The decision with the `least` holding reserve of the whole run, `inf` where the
    brake was never to hold: of a load at rest it decides, of others it can only make
    the colour worse. NumPy's outside of programs."""
    xp = numpy_of(found.reserve)
    ids = [reason.id for reason in REASONS]
    broke_away = found.reason == ids.index("H1")
    weak = ids.index("H2")
    held = ids.index("H4")
    at_rest = broke_away | (found.reason == weak) | (found.reason == held)
    examined = xp.isfinite(least) & at_rest
    reserve = xp.where(examined, xp.minimum(found.reserve, least), found.reserve)
    decided = examined & ~broke_away
    worse = xp.maximum(found.colour, _colour_of_reserve(xp.asarray(least)))
    return found._replace(
        reserve=reserve,
        reason=xp.where(decided, xp.where(reserve <= 1, weak, held), found.reason),
        colour=xp.where(decided, _colour_of_reserve(reserve), worse),
    )


def _least_at_ends(record: Record) -> Array:
    """Least holding reserve at events and at both ends of every hold, `inf` without
    any."""
    rows = record.rows
    system = record.system
    holding_of = holding_rows(record)
    to_hold = holding_of.to_hold
    n = rows.t.shape[0]
    after = jnp.minimum(jnp.arange(1, n + 1, dtype=jnp.int32), record.count)
    goes_on = to_hold & to_hold[after] & (rows.kind < LANDED)
    begins = holding_of.broken | (
        to_hold & ~jnp.concatenate([jnp.zeros(1, bool), goes_on[:-1]])
    )
    following = next_marked(
        jnp.concatenate([begins, to_hold & ~goes_on, jnp.ones(1, bool)])
    )

    def look(search: TwoArrays) -> TwoArrays:
        i, worst = search
        row = i % n
        at = jnp.where(i < n, row, after[row])
        y = unravel(rows.y[at], record.y_like)
        mode = unravel(rows.mode[row], record.mode_like)
        load, capacity = holding(system, rows.t[at], y, mode)  # pyright: ignore
        return following[i + 1], jnp.maximum(
            worst, held_share(load, capacity, jnp.asarray(True))
        )

    start = following[0], jnp.zeros(())
    worst = jax.lax.while_loop(lambda search: search[0] < 2 * n, look, start)[1]
    return jnp.where(worst > 0, 1 / jnp.where(worst > 0, worst, 1.0), jnp.inf)


_LEAST_AT_ENDS = RunJit(_least_at_ends, quick=True)


def judge_of_many(record: Record) -> Judgement:
    """As `judge`, with the holding reserve at events and at both ends of every hold,
    for runs side by side.

    Between these a load or a lever that varies without knots may leave less; the report
    of a run looks everywhere.
    """
    return held_throughout(judge(record), _LEAST_AT_ENDS(record))
