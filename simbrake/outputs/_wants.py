"""What a brake is to do in a run. The input says it, or what happened before the end;
the motion at the end itself never does.

Everything here can be traced.
"""

import enum
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from .._base._compiling import Compiled
from ..hybrid import Record
from ..hybrid.arrays import Array, numpy_of
from ..loads import AbstractActuator, AbstractFollower, Lever, SpeedHold
from ..phases import AfterTravel, AtHeight, AtRest, Phase, PhaseNow, Phases, of_running
from ..physics._brake import BrakeSystem, State, piece_of
from ..physics.mechanism import OPEN, Mode, holds
from ..physics.shaft import Drive, rests
from .programs import in_lanes, is_traced_run


class Want(enum.IntEnum):
    """What a brake is to do at the end of a run; a duty can name the first five
    (`wants`), the others follow from it alone."""

    REST = 0
    HOLD = 1
    LOWER = 2
    HOIST = 3
    FREE = 4
    RELEASED = 5  # the lever was let go
    # the lever is applied in a phase, and it may be a stop, a hold or a lowering
    UNSAID = 6

    def __str__(self) -> str:
        return self.name.lower()


def want_of_speed(speed: Array) -> Array:
    """The want of a set speed (rad/s)."""
    return jnp.where(
        speed > 0,
        Want.LOWER,
        jnp.where(speed < 0, Want.HOIST, Want.REST),
    )


def _wants_of_phases(phases: Phases, begins_at_rest: Array) -> Int[Array, " phases"]:
    """The want of each phase: as it names it, or else by its lever, its motor and its
    end.

    A brake that is applied after a stop, after another hold or after a start at rest is
    to hold.
    """
    wants = list[Array]()
    may_hold = begins_at_rest
    for phase in phases.each:
        want = _want_of(phase, may_hold)
        wants.append(want)
        may_hold = (want == Want.HOLD) | isinstance(phase.until, AtRest)
    return jnp.stack(wants).astype(jnp.int32)


def _want_of(phase: Phase, may_hold: Array) -> Array:
    lever = phase.lever
    if phase.wants:
        return jnp.asarray(Want[phase.wants.upper()])
    if isinstance(phase.until, AtRest) and phase.motor is None:
        return jnp.asarray(Want.REST)
    if isinstance(lever, AbstractFollower):
        return want_of_speed(jnp.asarray(lever.speed.values)[-1])
    if lever.controls_speed:
        return jnp.asarray(Want.LOWER)
    if phase.motor is not None:
        return want_of_speed(jnp.asarray(phase.motor.values)[-1])
    if isinstance(phase.until, AfterTravel | AtHeight):
        return jnp.asarray(Want.LOWER)
    pulls = (
        lever.greatest_from(
            jnp.zeros(()), jnp.asarray(getattr(phase.until, "duration", 0.0))
        )
        > 0
    )
    applied = jnp.where(may_hold, Want.HOLD, Want.UNSAID)
    return jnp.where(pulls, applied, Want.LOWER)


def want_of_input(
    system: BrakeSystem, lever: Any, start_speed: Array
) -> tuple[Array, Array]:
    """The want of the duty or of its present phase, and whether it is named; `UNSAID`
    where the input does not tell."""
    if isinstance(lever, PhaseNow):
        wants = _wants_of_phases(lever.whole, start_speed == 0)
        named = jnp.asarray([bool(phase.wants) for phase in lever.whole.each])
        return jnp.sum(jnp.where(lever.here, wants, 0)), jnp.any(lever.here & named)
    want = Want[system.wants.upper()] if system.wants else Want.UNSAID
    return jnp.asarray(want), jnp.asarray(bool(system.wants))


def set_speed_of(now: Any, t: Array, start_speed: Array) -> Array:
    """Speed (rad/s) that a lever or a motor, or that of the present phase, is to keep;
    NaN where it keeps none."""

    def of_part(part: Any, t: Array) -> Array:
        if isinstance(part, AbstractFollower):
            return jnp.asarray(part.speed.value(t, part.speed.first_piece(t)))
        if isinstance(part, SpeedHold):
            return start_speed
        return jnp.full_like(start_speed, jnp.nan)

    return of_running(now, t, of_part)


def is_commanded(lever: Any, t: Array) -> Array:
    """Whether an actuator is commanded to pull; its force may be still to come."""

    def command(lever: Any, t: Array) -> Any:
        if isinstance(lever, Lever):
            return command(lever.force, t)
        if not isinstance(lever, AbstractActuator):
            return 0.0
        return lever.input.value(t, lever.input.first_piece(t))

    return of_running(lever, t, command) > 0


def dead_time_of(lever: Any, passed: Array) -> Any:
    """Dead time (s) between a command and the pull of a lever; of a duty in phases that
    of the phase after `passed` others."""
    if isinstance(lever, Phases):
        each = [dead_time_of(phase.lever, passed) for phase in lever.each]
        return jnp.stack(jnp.broadcast_arrays(*each))[lever.place(passed)]
    if isinstance(lever, Lever):
        return dead_time_of(lever.force, passed)
    return getattr(lever, "dead_time", 0.0)


# --- what happened before the end ---------------------------------------------------


class LeverNow(NamedTuple):
    """The lever at one instant: its pull (N), whether the pulley is to move, for the
    duty or for a lever or motor that follows a speed (`moves`), and whether the brake
    is to hold."""

    pull: Array
    duty_moves: Array
    moves: Array
    is_hold: Array


def _lever_now(
    system: BrakeSystem, t: Array, y: State, mode: Mode, start_speed: Array
) -> LeverNow:
    lever = system.lever_at(y, mode)
    piece = piece_of(mode, "lever")
    pull = jnp.asarray(lever.value(t, piece), jnp.float64)
    want, named = want_of_input(system, lever, start_speed)
    duty_moves = (want == Want.LOWER) | (want == Want.HOIST) | (want == Want.FREE)
    moves = duty_moves
    motor = system.feature(Drive)
    if motor is not None and not isinstance(lever, PhaseNow):
        moves = jnp.where(
            named, moves, set_speed_of(motor.now(y, mode), t, start_speed) != 0
        )
    moves = moves | lever.follows(piece)
    return LeverNow(pull, duty_moves, moves, want == Want.HOLD)


def _levers(
    system: BrakeSystem, t: Array, y: State, mode: Mode, start_speed: Array
) -> LeverNow:
    return jax.vmap(_lever_now, in_axes=(None, 0, 0, 0, None))(
        system, t, y, mode, start_speed
    )


_LEVERS = Compiled(_levers, quick=True)


class Holding(NamedTuple):
    """Rows of a record: in which the brake is `to_hold`, that begin with a held load
    that has `broken` away, and in or before which the pull of the lever `rises`; and
    that pull (N) at the begin of each."""

    to_hold: Bool[Array, " rows"]
    broken: Bool[Array, " rows"]
    rises: Bool[Array, " rows"]
    pull: Float[Array, " rows"]


#: tensions that differ by less than this share of the greatest are the same
_SAME = 1e-9


def _lever_at_ends(record: Record, ends: Array) -> tuple[LeverNow, LeverNow]:
    """The lever at the start of each row, and at its end, the time `ends` (s)."""
    system: BrakeSystem = record.system  # pyright: ignore
    y = record.states
    start_speed = y.omega[0]
    modes = record.modes
    if is_traced_run(record):
        first, last = (
            _levers(system, t, y, modes, start_speed) for t in (record.rows.t, ends)
        )
        return first, last
    columns = jax.tree.map(np.asarray, (record.rows.t, ends, y, modes))
    start_speed = np.asarray(start_speed)

    def look(index: np.ndarray) -> tuple[LeverNow, LeverNow]:
        t, later, *state = jax.tree.map(lambda column: column[index], columns)
        return _LEVERS(system, t, *state, start_speed), _LEVERS(
            system, later, *state, start_speed
        )

    return in_lanes(look, np.arange(len(ends), dtype=np.int32))


def holding_rows(record: Record) -> Holding:
    """When the brake is to hold the pulley at rest, and when a held load broke away.

    A load that moves off has broken away, unless it is meant to move or the lever is
    let go: the lever falls, the load moves off, and the brake opens before the pulley
    rests again. In a phase that is to hold, the lever is never let go; there a load has
    also broken away that moves from the start of the phase, if the run does not end in
    that motion.
    """
    rows = record.rows
    xp = numpy_of(record.rows.t)
    n = rows.t.shape[0]
    number_of = xp.arange(n, dtype=np.int32)
    used = number_of < record.count
    ends = rows.t[xp.minimum(number_of + 1, record.count)]
    first, last = _lever_at_ends(record, ends)
    modes = jax.tree.map(xp.asarray, record.modes)
    held = holds(modes)
    # (the duration decides: a row of many runs at once may last though nothing happens
    # at its end)
    lasts = used & (ends > rows.t)
    slack = _SAME * xp.max(xp.where(used, xp.abs(first.pull), 0.0))
    falls = last.pull < first.pull - slack
    # the last lasting row before each
    before = xp.maximum.accumulate(xp.where(lasts, number_of, -1))
    before = xp.concatenate([xp.full(1, -1, before.dtype), before[:-1]])
    moves_off = lasts & ~held & (before >= 0) & held[before] & ~rests(modes)
    drops = falls[before] | (first.pull < last.pull[before] - slack)
    # the first row from each on in which the brake is open, and in which the pulley
    # rests
    there = number_of <= record.count
    opens = next_marked(there & ((modes.band == OPEN) | (first.pull <= 0)))
    rest_again = next_marked(there & rests(modes))
    let_go = drops & (opens < rest_again) & ~first.is_hold
    broken = moves_off & ~let_go & ~first.moves
    if modes.phase is not None:
        resting = rests(modes)
        last_phase = xp.max(xp.where(lasts, modes.phase, 0))
        goes_on = (modes.phase == last_phase) & ~resting[record.count]
        broken = broken | (lasts & ~resting & first.is_hold & ~goes_on)
    # where the lever is let go nothing is to be held from the begin of its fall
    falling = lasts & held & falls & ~first.is_hold
    steady = next_marked(lasts & ~falling)
    after = xp.minimum(steady, n - 1)
    released = (
        falling & (steady < n) & ~held[after] & (opens[after] < rest_again[after])
    )
    jumps = (before >= 0) & (first.pull > last.pull[before] + slack)
    return Holding(
        to_hold=lasts & held & ~released & ~first.duty_moves,
        broken=broken & (record.states.omega == 0.0),
        rises=lasts & (jumps | (last.pull > first.pull + slack)),
        pull=first.pull,
    )


def next_marked(marked: Bool[Array, " n"]) -> Int[Array, " n"]:
    """For each row the number of the first marked row from it on, `n` without any."""
    xp = numpy_of(marked)
    n = marked.shape[0]
    places = xp.where(marked, xp.arange(n, dtype=np.int32), np.int32(n))
    return xp.minimum.accumulate(places[::-1])[::-1]


class Past(NamedTuple):
    """What the end of a run does not show: whether a held load broke away, whether the
    pulley was at rest and moved again, and whether the lever pulled at the start and at
    any time."""

    broke_away: Any
    rested: Any
    began_pulling: Any
    pulled: Any


def past_of(record: Record) -> Past:
    rows = record.rows
    xp = numpy_of(record.rows.t)
    holding = holding_rows(record)
    number_of = xp.arange(rows.t.shape[0], dtype=np.int32)
    there = number_of <= record.count
    resting = there & rests(jax.tree.map(xp.asarray, record.modes))
    moved_last = xp.max(xp.where(there & ~resting, number_of, -1))
    return Past(
        broke_away=xp.any(holding.broken),
        rested=xp.any(resting & (number_of < moved_last)),
        began_pulling=holding.pull[0] > 0,
        pulled=xp.any(there & (holding.pull > 0)),
    )
