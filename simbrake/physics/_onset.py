"""Changes of friction that begin at a temperature or a stop: when each began, and what
begins the others."""

from typing import Any, ClassVar, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Int

from ..friction import FrictionChange
from ..hybrid import QUADRATURE
from ..hybrid.arrays import Array, Mark
from ..hybrid.struct import structural
from ..phases import AtStop, AtTemperature
from ..profiles import AbstractProfile, Piece
from ._brake import BrakeAtInstant, BrakeGuards, BrakeSystem, Feature, State
from ._phased import DutyInPhases, to_temperature
from .heated import surface_temperatures
from .mechanism import Mode, comes_to_rest


class OnsetMode(NamedTuple):
    """Which of the changes have begun (k,) (0, 1), and how often the pulley has come to
    rest."""

    begun: Any
    stops: Any


class Since(NamedTuple):
    """The course of a factor of friction in the time since its change began (s): 1
    until then."""

    factor: AbstractProfile
    begun: Mark
    time: Array

    def _local(self, t: Array) -> Array:
        return jnp.where(self.begun, t - self.time, 0.0)

    def value(self, t: Array, piece: Piece) -> Array:
        return jnp.where(self.begun, self.factor.value(self._local(t), piece), 1.0)

    def next_knot(self, piece: Piece) -> Array | float:
        knot = self.factor.next_knot(piece)
        return (
            knot
            if isinstance(knot, float)
            else jnp.where(self.begun, self.time + knot, jnp.inf)
        )

    def is_settled(self, t: Array) -> Mark:
        """Whether no time breakpoint after `t` is known: of what has not begun there is
        none."""
        return ~self.begun | self.factor.is_settled(self._local(t))


class Onsets(Feature):
    """Changes of friction that begin when something happens (`FrictionChange.when`),
    once each.

    - `watched`: places of these among all changes of the mechanism
    """

    watched: tuple[int, ...] = structural()
    self_timed: ClassVar[bool] = True

    @classmethod
    def of(cls, changes: tuple[FrictionChange, ...]) -> "Onsets":
        return cls(
            tuple(i for i, change in enumerate(changes) if change.when is not None)
        )

    def courses(self, now: BrakeAtInstant, courses: dict[str, Any]) -> dict[str, Any]:
        y = now.y
        mode = now.mode
        since = {}
        for k, i in enumerate(self.watched):
            name = f"friction {i}"
            since[name] = Since(courses[name], mode.onset.begun[k] > 0, y.onset[k])
        return courses | since

    def start(self, now: BrakeAtInstant) -> tuple[State, Mode]:
        times = now.t + jnp.zeros(len(self.watched))
        none = jnp.zeros(len(self.watched), jnp.int32)
        return now.y._replace(onset=times), now.mode._replace(
            onset=OnsetMode(none, jnp.asarray(0, jnp.int32))
        )

    def sizes(self, brake: BrakeSystem, sizes: State) -> State:
        return sizes._replace(onset=jnp.full(len(self.watched), jnp.inf))

    def places(self, brake: BrakeSystem, places: State) -> State:
        # (friction depends on the time since then, but that never moves)
        return places._replace(onset=np.full(len(self.watched), QUADRATURE))

    def rates(self, now: BrakeAtInstant, rates: State) -> State:
        return rates._replace(onset=jnp.zeros(len(self.watched)))

    def margins(self, now: BrakeAtInstant, guards: BrakeGuards) -> BrakeGuards:
        """Margins to what begins each change; 1 where it has begun."""
        brake = now.brake
        onset = now.mode.onset
        margins = list[Array]()
        whens = [brake.mechanism.changes[i].when for i in self.watched]
        hot = (
            surface_temperatures(brake, now.z)
            if any(isinstance(x, AtTemperature) for x in whens)
            else {}
        )
        for when in whens:
            if isinstance(when, AtTemperature):
                margins.append(to_temperature(when, hot))
            else:
                assert isinstance(when, AtStop)
                margins.append(
                    jnp.where(onset.stops.astype(jnp.float64) >= when.number, -1.0, 1.0)
                )
        return guards._replace(
            onset=jnp.where(onset.begun > 0, 1.0, jnp.stack(margins))
        )

    def before(
        self, now: BrakeAtInstant, new: Mode, fired: BrakeGuards
    ) -> tuple[State, Mode]:
        """Changes that begin do so at this instant, and the mechanism answers to
        them."""
        brake = now.brake
        onset = now.mode.onset
        pieces = dict(new.pieces)
        begins = fired.onset & (onset.begun == 0)
        for k, i in enumerate(self.watched):
            place = f"friction {i}"
            if pieces[place] is not None:
                first = jnp.asarray(
                    brake.mechanism.profiles[i].first_piece(jnp.zeros(())), jnp.int32
                )
                pieces[place] = jnp.where(begins[k], first, pieces[place])
        onset = onset._replace(begun=onset.begun | begins.astype(jnp.int32))
        new = new._replace(pieces=pieces, onset=onset)
        return now.y._replace(onset=_times(now, onset.begun)), new

    def after(
        self, now: BrakeAtInstant, new: Mode, fired: BrakeGuards, code: Array
    ) -> tuple[Mode, Array]:
        """Another stop counts; what it begins is an event at the same instant, after
        it."""
        duty = now.brake.feature(DutyInPhases)
        turned = False if duty is None else duty.rests(now, fired)
        stops = new.onset.stops + comes_to_rest(now.mode, new, turned).astype(jnp.int32)
        return new._replace(onset=new.onset._replace(stops=stops)), code

    def reset(self, now: BrakeAtInstant, after: Mode, new: State) -> State:
        return new._replace(onset=_times(now, after.onset.begun))


def _times(now: BrakeAtInstant, begun: Int[Array, " k"]) -> Array:
    """Times (k,) at which the changes began: now, of those that begin."""
    return jnp.where(begun > now.mode.onset.begun, now.t, now.y.onset)
