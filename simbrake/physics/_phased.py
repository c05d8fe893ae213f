"""A duty in phases: when each began, how far the pulley has turned in it, and what ends
it."""

from typing import Any, ClassVar, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Int

from ..hybrid import QUADRATURE
from ..hybrid.arrays import Array, Mark, ScalarArray, largest
from ..hybrid.system import ENDED
from ..phases import AfterTravel, AtHeight, AtRest, AtTemperature, PhaseEnd, PhaseNow
from ._brake import BrakeAtInstant, BrakeGuards, BrakeSystem, Feature, State
from .heated import surface_temperatures
from .mechanism import HELD, OPEN, Mode

#: typical travel of a block (m)
_HEIGHT = 10.0


class PhaseState(NamedTuple):
    """Begin of the phase that runs (s), angle by which the pulley has turned in it
    (rad), and the sense (±1) in which it turned when the phase or a later piece of it
    began, 0: at rest."""

    begun: Any
    turned: Any
    way: Any


class DutyInPhases(Feature):
    """The phases of a duty (`Phases`), of which one runs: `Mode.phase` have ended.

    - `block_height` (m) at the start, `None` where no phase asks for it
    """

    block_height: Array | None = None
    self_timed: ClassVar[bool] = True

    def rests_open(self, brake: BrakeSystem) -> bool:
        return any(isinstance(phase.until, AtRest) for phase in brake.lever.each)

    def courses(self, now: BrakeAtInstant, courses: dict[str, Any]) -> dict[str, Any]:
        return {**courses, "phase": PhaseEnd(courses["lever"])}

    def start(self, now: BrakeAtInstant) -> tuple[State, Mode]:
        return now.y._replace(
            phase=PhaseState(now.t, jnp.zeros_like(now.y.omega), jnp.sign(now.y.omega))
        ), now.mode

    def sizes(self, brake: BrakeSystem, sizes: State) -> State:
        return sizes._replace(phase=PhaseState(jnp.inf, 1.0, jnp.inf))

    def places(self, brake: BrakeSystem, places: State) -> State:
        # (rates depend on the begin of the phase, but that never moves)
        # (and the angle turned in it is corrected where that of the whole run is)
        return places._replace(
            phase=PhaseState(np.asarray(QUADRATURE), places.phi, np.asarray(QUADRATURE))
        )

    def rates(self, now: BrakeAtInstant, rates: State) -> State:
        zero = jnp.zeros_like(now.y.omega)
        return rates._replace(phase=PhaseState(zero, now.y.omega, zero))

    def margins(self, now: BrakeAtInstant, guards: BrakeGuards) -> BrakeGuards:
        """Margin to the end of the phase that runs; 1 where a time ends it, which is a
        time breakpoint."""
        brake = now.brake
        y = now.y
        mode = now.mode
        phase_now: PhaseNow = brake.lever.at(mode.phase, y.phase.begun)
        phases = phase_now.whole.each
        hot = dict[str, Array]()
        lowered = _lowered(brake, y)
        if any(isinstance(phase.until, AtTemperature) for phase in phases):
            hot = surface_temperatures(brake, now.z)
        margins = []
        for phase, end in ((phase, phase.until) for phase in phases):
            if isinstance(end, AtRest):
                # (the pulley has moved in the phase, if only by rounding: an event at
                # its begin takes no time)
                moved = y.phase.turned != 0
                speed = y.omega / brake.sizes.speed
                # (of a step in which it turns round and comes back, the angle would say
                # that nothing was)
                way = jnp.where(y.phase.way != 0, y.phase.way, jnp.sign(y.phase.turned))
                still = jnp.where(way != 0, way * speed, 1.0)
                if phase.motor is None:  # which brings it to rest by itself
                    still = jnp.where(_unwatched(mode), still, 1.0)
                turns_round = ~_unwatched(mode) & (
                    _way(mode).astype(jnp.float64) * y.phase.turned < 0
                )
                margins.append(
                    jnp.where((mode.rests & moved) | turns_round, -1.0, still)
                )
            elif isinstance(end, AfterTravel):
                margins.append(1.0 - lowered / end.distance)
            elif isinstance(end, AtHeight):
                above = self.block_height - brake.load.travelled(y.phi) - end.height  # pyright: ignore
                margins.append((-above if end.rising else above) / _HEIGHT)
            elif isinstance(end, AtTemperature):
                margins.append(to_temperature(end, hot))
            else:
                margins.append(1.0)
        return guards._replace(phase_end=phase_now.of_each(margins))

    def rests(self, now: BrakeAtInstant, fired: BrakeGuards) -> Mark:
        """Whether a phase that waits for rest ends."""
        phase: PhaseNow = now.brake.lever.at(now.mode.phase, now.y.phase.begun)
        waits = [
            1.0 if isinstance(phase_of_rim.until, AtRest) else 0.0
            for phase_of_rim in phase.whole.each
        ]
        return fired.phase_end & (phase.of_each(waits) > 0)

    def settled(self, now: BrakeAtInstant, fired: BrakeGuards, omega: Array) -> Array:
        return jnp.where(self.rests(now, fired), 0.0, omega)

    def before(
        self, now: BrakeAtInstant, new: Mode, fired: BrakeGuards
    ) -> tuple[State, Mode]:
        """The next phase begins where one is over, if its time has not been
        (`Mode.phase`)."""
        phases = now.brake.lever
        ended = now.mode.phase
        phase = ended + (fired.phase_end | (new.phase > ended)).astype(jnp.int32)
        begins = (phase > ended) & (phase < phases.total)
        lever = jnp.where(
            begins, phases.at(phase, now.t).first_piece(now.t), new.pieces["lever"]
        )
        pieces = {**new.pieces, "phase": phase, "lever": lever}
        if now.brake.load.by_phases:
            pieces["load"] = now.brake.load.piece_in_phase(*phases.string_at(phase))
        new = new._replace(pieces=pieces)
        return now.y._replace(phase=_begun_anew(now, new, now.y)), new

    def after(
        self, now: BrakeAtInstant, new: Mode, fired: BrakeGuards, code: Array
    ) -> tuple[Mode, Array]:
        return new, jnp.where(
            (code == 0) & (new.phase == now.brake.lever.total), ENDED, code
        )

    def reset(self, now: BrakeAtInstant, after: Mode, new: State) -> State:
        return new._replace(phase=_begun_anew(now, after, new))


def _unwatched(mode: Mode) -> Mark:
    """Whether the pulley may pass through 0 without an event: no contact and no dry
    friction watches its speed."""
    if mode.turn is not None:
        return jnp.asarray(False)
    slides = mode.band == OPEN
    return (
        slides
        if mode.inner is None
        else slides | ((mode.inner != 0) & (mode.band != HELD))
    )


def _way(mode: Mode) -> Int[Array, ""]:
    """The way in which a pulley turns whose speed is watched."""
    if mode.turn is not None:
        return mode.turn
    return (
        mode.sense
        if mode.inner is None
        else jnp.where(mode.inner != 0, mode.inner, mode.sense)
    )


def to_temperature(end: AtTemperature, hot: dict[str, Array]) -> ScalarArray:
    """Margin to a temperature over 100 K, for the surface temperatures `hot` of all
    places (K)."""
    above = (largest(jnp.atleast_1d(hot[end.of])) - end.level) / 100.0
    return above if end.falling else -above


def _begun_anew(now: BrakeAtInstant, after: Mode, y: State) -> PhaseState:
    """The state after a change of mode to `y`: another phase begins now, unless all are
    over."""
    new = (after.phase != now.mode.phase) & (after.phase < now.brake.lever.total)
    state = now.y.phase
    turned = jnp.where(new, 0.0, state.turned)
    return PhaseState(
        jnp.where(new, now.t, state.begun),
        turned,
        jnp.where(new | (state.way == 0), jnp.sign(y.omega), state.way),
    )


def _lowered(brake: BrakeSystem, y: State) -> ScalarArray | None:
    """Travel of the hook since the begin of the phase (m), `None` without a hook."""
    load = brake.load
    if load.layers is None:
        per_radian = load.travel()
        return None if per_radian is None else y.phase.turned * per_radian
    now, then = (load.travelled(phi) for phi in (y.phi, y.phi - y.phase.turned))
    return now - then  # pyright: ignore
