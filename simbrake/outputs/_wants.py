"""What a brake is to do in a run: from the input and from the course before the end,
never from the motion at the end.

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
from .probe import in_lanes, is_traced_run


class Want(enum.IntEnum):
    """What a brake is to do at the end of a run; the first five can be said (`wants`),
    the others only follow."""

    REST = 0
    HOLD = 1
    LOWER = 2
    HOIST = 3
    FREE = 4
    RELEASED = 5  # the lever was let go
    # a phase with an applied lever that nothing names a stop, a hold or a lowering
    UNSAID = 6

    def __str__(self) -> str:
        return self.name.lower()


def by_speed(speed: Array) -> Array:
    """The want of a set speed (rad/s)."""
    return jnp.where(
        speed > 0,
        int(Want.LOWER),
        jnp.where(speed < 0, int(Want.HOIST), int(Want.REST)),
    )


def _wants_of_phases(phases: Phases, begins_at_rest: Array) -> Int[Array, " phases"]:
    """The want of each phase, from its words, or else its lever, its motor and its end.

    An applied brake behind a stop, another hold or a start at rest is to hold.
    """
    wants = list[Array]()
    may_hold = begins_at_rest
    for phase in phases.each:
        want = _want_of(phase, may_hold)
        wants.append(want)
        may_hold = (want == int(Want.HOLD)) | isinstance(phase.until, AtRest)
    return jnp.stack(wants).astype(jnp.int32)


def _want_of(phase: Phase, may_hold: Array) -> Array:
    lever = phase.lever
    if phase.wants:
        return jnp.asarray(int(Want[phase.wants.upper()]))
    if isinstance(phase.until, AtRest) and phase.motor is None:
        return jnp.asarray(int(Want.REST))
    if isinstance(lever, AbstractFollower):
        return by_speed(jnp.asarray(lever.speed.values)[-1])
    if lever.controls_speed:
        return jnp.asarray(int(Want.LOWER))
    if phase.motor is not None:
        return by_speed(jnp.asarray(phase.motor.values)[-1])
    if isinstance(phase.until, AfterTravel | AtHeight):
        return jnp.asarray(int(Want.LOWER))
    pulls = (
        lever.greatest_from(
            jnp.zeros(()), jnp.asarray(getattr(phase.until, "duration", 0.0))
        )
        > 0
    )
    applied = jnp.where(may_hold, int(Want.HOLD), int(Want.UNSAID))
    return jnp.where(pulls, applied, int(Want.LOWER))


def want_of_input(
    system: BrakeSystem, lever: Any, start_speed: Array
) -> tuple[Array, Array]:
    """The want of the duty, or of its phase that runs, and whether words name it;
    `UNSAID` where only the course shows it."""
    if isinstance(lever, PhaseNow):
        wants = _wants_of_phases(lever.whole, start_speed == 0)
        named = jnp.asarray([bool(phase.wants) for phase in lever.whole.each])
        return jnp.sum(jnp.where(lever.here, wants, 0)), jnp.any(lever.here & named)
    named = Want[system.wants.upper()] if system.wants else Want.UNSAID
    return jnp.asarray(int(named)), jnp.asarray(bool(system.wants))


def _set_speed(part: Any, t: Array, start_speed: Array) -> Array:
    """Speed (rad/s) that a lever or a motor is to keep at its own time `t`, NaN of one
    that keeps none."""
    if isinstance(part, AbstractFollower):
        return jnp.asarray(part.speed.value(t, part.speed.first_piece(t)))
    return (
        start_speed
        if isinstance(part, SpeedHold)
        else jnp.full_like(start_speed, jnp.nan)
    )


def paced(now: Any, t: Array, start_speed: Array) -> Array:
    """Speed (rad/s) that a lever or a motor is to keep, also of the phase that runs;
    NaN of one that keeps none."""
    return of_running(now, t, lambda part, t: _set_speed(part, t, start_speed))


def command_waits(lever: Any, t: Array) -> Array:
    """Whether an actuator has been told to pull, and its force is still to come."""

    def command(lever: Any, t: Array) -> Any:
        if isinstance(lever, Lever):
            return command(lever.force, t)
        if not isinstance(lever, AbstractActuator):
            return 0.0
        return lever.input.value(t, lever.input.first_piece(t))

    return of_running(lever, t, command) > 0


def dead_time_of(lever: Any, passed: Array) -> Any:
    """Dead time (s) between a command and the pull of a lever, in a duty in phases in
    the phase behind so many that have `passed`."""
    if isinstance(lever, Phases):
        each = [dead_time_of(phase.lever, passed) for phase in lever.each]
        return jnp.stack(jnp.broadcast_arrays(*each))[lever.place(passed)]
    if isinstance(lever, Lever):
        return dead_time_of(lever.force, passed)
    return getattr(lever, "dead_time", 0.0)


# --- what happened before the end ---------------------------------------------------


class LeverNow(NamedTuple):
    """The lever at one instant: its pull (N), whether motion is meant there, and
    whether a phase is to hold there."""

    pull: Array
    moves: Array
    is_hold: Array


def _lever_now(
    system: BrakeSystem, t: Array, y: State, mode: Mode, start_speed: Array
) -> LeverNow:
    lever = system.lever_at(y, mode)
    piece = piece_of(mode, "lever")
    pull = jnp.asarray(lever.value(t, piece), jnp.float64)
    want, named = want_of_input(system, lever, start_speed)
    moves = (
        (want == int(Want.LOWER)) | (want == int(Want.HOIST)) | (want == int(Want.FREE))
    )
    motor = system.feature(Drive)
    if motor is not None and not isinstance(lever, PhaseNow):
        moves = jnp.where(named, moves, paced(motor.now(y, mode), t, start_speed) != 0)
    return LeverNow(pull, moves | lever.follows(piece), want == int(Want.HOLD))


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


#: tensions that differ by less than this share of the greatest one are the same
_SAME = 1e-9


def holding_rows(record: Record) -> Holding:
    """When the brake is to hold the pulley at rest, and when a held load broke away.

    The lever is let go where it falls, the load moves off, and the brake opens before
    the pulley rests again, unless a phase is to hold. A load that moves off otherwise
    has broken away, unless its motion is meant. So has one that begins to move as a
    phase begins that is to hold it, if the run does not end in that motion.
    """
    rows = record.rows
    xp = numpy_of(record.rows.t)
    n = rows.t.shape[0]
    number_of = xp.arange(n, dtype=np.int32)
    used = number_of < record.count
    ends = rows.t[xp.minimum(number_of + 1, record.count)]
    system: BrakeSystem = record.system  # pyright: ignore
    y = record.states
    start_speed = y.omega[0]
    modes = record.modes

    def look(index: np.ndarray) -> tuple[LeverNow, LeverNow]:
        at = jax.tree.map(
            lambda column: np.asarray(column)[index], (rows.t, ends, y, modes)
        )
        t, later, *state = at
        return _LEVERS(system, t, *state, start_speed), _LEVERS(
            system, later, *state, start_speed
        )

    if is_traced_run(record):
        first, last = (
            _levers(system, t, y, modes, start_speed) for t in (rows.t, ends)
        )
    else:
        start_speed = np.asarray(start_speed)
        modes = jax.tree.map(np.asarray, modes)
        first, last = in_lanes(look, number_of)
    held = holds(modes)
    # (rows without duration say nothing; one of many runs at once may last though
    # nothing happens at its end)
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
    opens = next_marked(there & ((modes.band == OPEN) | (first.pull <= 0)), n, xp)
    rest_again = next_marked(there & rests(modes), n, xp)
    let_go = drops & (opens < rest_again) & ~first.is_hold
    broken = moves_off & ~let_go & ~first.moves
    if modes.phase is not None:
        resting = rests(modes)
        last_phase = xp.max(xp.where(lasts, modes.phase, 0))
        goes_on = (modes.phase == last_phase) & ~resting[record.count]
        broken = broken | (lasts & ~resting & first.is_hold & ~goes_on)
    # of a fall that lets go nothing is to be held from where it begins
    falling = lasts & held & falls & ~first.is_hold
    steady = next_marked(lasts & ~falling, n, xp)
    after = xp.minimum(steady, n - 1)
    released = (
        falling & (steady < n) & ~held[after] & (opens[after] < rest_again[after])
    )
    jumps = (before >= 0) & (first.pull > last.pull[before] + slack)
    return Holding(
        to_hold=lasts & held & ~released,
        broken=broken & (y.omega == 0.0),
        rises=lasts & (jumps | (last.pull > first.pull + slack)),
        pull=first.pull,
    )


def next_marked(marked: Bool[Array, " n"], n: int, xp: Any) -> Int[Array, " n"]:
    """Of each row the first one from it on that is marked, `n` where none is."""
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
        xp.any(holding.broken),
        xp.any(resting & (number_of < moved_last)),
        holding.pull[0] > 0,
        xp.any(there & (holding.pull > 0)),
    )
