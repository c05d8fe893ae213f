"""What every brake has: a lever, a load, inertia, friction and perhaps heat, and the known times of all these."""

import abc
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Bool, Float

from .._hybrid import AbstractHybridSystem, largest, smallest
from .._hybrid._arrays import Array
from .._parts._band import product
from .._parts._driller import AbstractSpeedLever
from .._parts._duty import AbstractProfile, hides_nothing, next_known_time
from .._parts._friction import AbstractFriction
from .._parts._heat import FrictionHeat
from .._parts._links import Surroundings
from .._parts._loads import AbstractLoad
from ._heat_flows import Deposit
from ._mechanism import Sizes
from ._modes import BandMode
from ._sliding import Grip
from ._state import ThermalNow
from ._thermal import Thermal
from ._wearing import Pressed, Wearing

#: up to this share of the tension the lever may still move, at its present rate over the time of the run so far
AT_REST = 1e-3
#: relative rounding of a torque that balances another one
_ROUNDING = 1e-9


class Capacity(NamedTuple):
    """Load and sliding brake at one instant, or at many: torques (N·m) in the direction in which the pulley turns.

    - `load`: load torque;  `pairs` (…, k): greatest torque of each friction pair with its kinetic friction at the speed
      of the pulley and the temperatures of that instant: of a standard brake one, of a staged brake external, internal
    - `settled`: whether the lever is at its last value
    """

    load: Float[Array, "*many"]
    pairs: Float[Array, "*many pairs"]
    settled: Bool[Array, "*many"]

    @property
    def torque(self) -> Float[Array, "*many"]:
        """What the brake can hold: the torque of its weaker pair (N·m)."""
        return self.pairs.min(axis=-1)

    @property
    def exceeded(self) -> Bool[Array, "*many"]:
        """Whether the brake cannot hold the load, nor ever will by its lever."""
        return self.settled & (self.load > 0) & (self.load >= self.torque * (1 - _ROUNDING))


def course_of_profile(profile: AbstractProfile, t: Any, piece: Any) -> Any:
    """A profile as a function of time."""
    return profile.value(t, piece)


def course_of_lever(lever: AbstractProfile, t: Any, piece: Any) -> Any:
    one = jnp.ones(())
    follows = isinstance(lever, AbstractSpeedLever)
    return lever.value(t, piece), lever.wanted_torque(t, one, piece, one, one) if follows else None


def course_of_load(load: AbstractLoad, t: Any, piece: Any) -> Any:
    return load.torque(t, jnp.ones(()), piece)


class AbstractActing(eqx.Module):
    """What acts on a brake from outside, and the heat in it. Modes are those of the brake that builds on it."""

    inertia: eqx.AbstractVar[Array]
    band_radius: eqx.AbstractVar[Array]
    track_radius: eqx.AbstractVar[Array]
    grip: eqx.AbstractVar[Grip]
    lever: eqx.AbstractVar[AbstractProfile]
    load: eqx.AbstractVar[AbstractLoad]
    thermal: eqx.AbstractVar[Thermal | None]

    @property
    @abc.abstractmethod
    def pair(self) -> FrictionHeat | None:
        """Where the heat of the pair goes on which the band acts."""

    @abc.abstractmethod
    def laws(self, u: Any) -> list[tuple[AbstractFriction, Array | None]]:
        """All friction laws with the temperatures that they see, for heat contents `u` (or `None`)."""

    @abc.abstractmethod
    def around(self, y: Any, mode: Any) -> Surroundings:
        """Speed of the track, and whether the linings touch it, as the links of the thermal network see them."""

    @abc.abstractmethod
    def pair_torques(self, T_0: Array, y: Any, mode: Any) -> Float[Array, " pairs"]:
        """Greatest torque (N·m, ≥ 0) of each friction pair against the pulley's motion, sliding at its speed, for the
        slack tension `T_0`."""

    def capacity(self, t: Array, y: Any, mode: Any, start: Array) -> Capacity:
        """Load and capacity of a turning brake at the time `t` of a run that began at `start`."""
        T_0, rate = jax.jvp(lambda t: self.lever.value(t, mode.lever_piece), (t,), (jnp.ones_like(t),))
        if isinstance(self.lever, AbstractSpeedLever):
            follows = self.lever.follows(mode.lever_piece)
            T_0, rate = jnp.where(follows, self.lever.greatest(), T_0), jnp.where(follows, 0.0, rate)
        settled = self.lever.no_more_turns(t) & (jnp.abs(rate) * (t - start) <= AT_REST * T_0)
        load = jnp.sign(y.omega) * self.load.torque(t, y.omega, mode.load_piece)
        return Capacity(load, self.pair_torques(T_0, y, mode), settled)

    def band_torque(self, T_0: Array, omega: Array, T: Array | None) -> Float[Array, ""]:
        """`R_b T_0 (Π − 1)`, in reverse `R_b T_0 (1 − 1/Π)`, of linings that slide on the band at the temperatures `T`.

        A lining that locks itself makes it infinite; in reverse the tight end can only become slack: `R_b T_0`.
        """
        back = omega < 0
        v = jnp.broadcast_to(jnp.abs(omega) * self.band_radius, (self.grip.linings.count,))
        mu, margin = self.grip.ratios(self.grip.coefficients(T_0, v, T, back, static=False).f)
        growth = jnp.where(back, 1 - 1 / product(mu), product(mu) - 1)
        growth = jnp.where(margin > 0, growth, jnp.where(back, 1.0, jnp.inf))
        return jnp.where(T_0 > 0, self.band_radius * T_0 * growth, 0.0)

    def inertia_at(self, mode: Any) -> Array:
        """Inertia of all that turns and moves with the shaft (kg·m²)."""
        more = self.load.added_inertia(mode.load_piece)
        return self.inertia if more is None else self.inertia + more

    def surface(self, u: Any) -> Array | None:
        """Temperatures that the linings' friction law sees."""
        return self.sensed(self.pair, u)

    def sensed(self, pair: FrictionHeat | None, u: Any) -> Array | None:
        """Temperatures that the law of a pair sees at every lining."""
        if self.thermal is None or pair is None or u is None:
            return None
        assert pair.sensor is not None
        return self.thermal.at(self.thermal.temperatures(u), pair.sensor, self.grip.linings.count)

    def deposit(self, t: Array, y: Any, mode: Any, now: ThermalNow, P: Array) -> Deposit:
        """Where the heats `P` of the linings go in the pair on which the band acts; linear in them."""
        assert self.thermal is not None
        around = self.around(y, mode)
        return self.thermal.deposit(self.pair, now.T, now.T_junctions, t, around, P, mode.heat_pieces)

    def thermal_now(self, t: Array, y: Any, mode: Any) -> ThermalNow | None:
        """Temperatures and heat flows, friction apart."""
        if self.thermal is None:
            return None
        around, T = self.around(y, mode), self.thermal.temperatures(y.heat)
        T_J = self.thermal.junctions(T, t, around, mode.heat_pieces)
        return ThermalNow(T, T_J, self.thermal.flows(T, T_J, t, around, mode.heat_pieces), None)


class AbstractBrakeSystem(AbstractHybridSystem):
    """A brake under given functions of time, whose corners are known times."""

    forces: eqx.AbstractVar[Any]  # an AbstractActing
    tension_scale: eqx.AbstractVar[Float[Array, ""]]
    torque_scale: eqx.AbstractVar[Float[Array, ""]]
    speed_scale: eqx.AbstractVar[Float[Array, ""]]
    wearing: eqx.AbstractVar[Wearing | None]

    @property
    def thermal(self) -> Thermal | None:
        """The thermal network, if the scene has heat."""
        return self.forces.thermal

    @property
    def lever(self) -> AbstractProfile:
        """What sets the slack tension."""
        return self.forces.lever

    @property
    def inertia(self) -> Array:
        """Inertia of all that turns with the shaft at the start (kg·m²)."""
        return self.forces.inertia

    @property
    def shares(self) -> Any:
        """Shares of the friction power, if the scene splits it."""
        return self.forces.grip.shares

    @property
    def grip(self) -> Grip:
        """Friction of the linings under the band."""
        return self.forces.grip

    @property
    def linings(self) -> Any:
        """The linings under the band."""
        return self.grip.linings

    @property
    def areas(self) -> tuple[Any, ...]:
        """Areas of the linings in each friction pair, `None` where they are not given."""
        internal = getattr(self.forces, "internal", None)
        outer = self.linings.area
        return (outer,) if internal is None else (outer, getattr(internal, "bandage", internal).area)

    @property
    def sizes(self) -> Sizes:
        """Typical slack tension, torque and speed."""
        return Sizes(self.tension_scale, self.torque_scale, self.speed_scale)

    def hot(self, u: Any) -> tuple[Any, ...]:
        """Temperatures (K) that the law of each pair sees, for the heat contents `u`."""
        return tuple(T for _, T in self.forces.laws(u))

    def capacity(self, t: Array, y: Any, mode: Any, start: Array) -> Capacity:
        """Load and capacity of a turning brake at the time `t` of a run that began at `start`."""
        return self.forces.capacity(t, y, mode, start)

    @abc.abstractmethod
    def pressed(self, y: Any, mode: Any, q: Any) -> tuple[Pressed, Pressed | None]:
        """What rubs at the linings: in the pair on which the band acts, and in the internal one if there is any."""

    def with_wear(self, rates: Any, t: Array, y: Any, mode: Any, q: Any) -> Any:
        """The rates of the states with those of the wear, if the scene has it."""
        return rates if self.wearing is None else rates._replace(worn=self.wearing.rates(t, *self.pressed(y, mode, q)))

    def with_worn(self, like: Any, value: Any = None) -> Any:
        """What is like a state, with one value (its typical size) for every thickness, if the scene has wear."""
        if self.wearing is None:
            return like
        return like._replace(worn=self.wearing.each(self.wearing.scale if value is None else value))

    @property
    @abc.abstractmethod
    def staged(self) -> bool:
        """Whether the linings ride on the pulley, with an internal pair."""

    @property
    def profiles(self) -> tuple[AbstractProfile, ...]:
        """Given functions of time beside lever and load."""
        thermal = self.forces.thermal
        return () if thermal is None else thermal.heat.profiles

    @property
    def guard_samples(self) -> int:
        """Points inside a step at which the guards are evaluated: none where nothing short hides in what is given."""
        f = self.forces
        plain = hides_nothing(f.lever, course_of_lever) and hides_nothing(f.load, course_of_load)
        return 0 if plain and all(hides_nothing(profile, course_of_profile) for profile in self.profiles) else 15

    @property
    def has_tables(self) -> bool:
        """Whether a friction law ends at some temperature."""
        return any(law.temperature_range() is not None for law, _ in self.forces.laws(None))

    def table_margin(self, u: Any) -> Array:
        """By how much the temperatures are inside the tables of the friction laws, over 100 K."""
        room = []
        for law, T in self.forces.laws(u):
            bounds = law.temperature_range()
            if bounds is not None and T is not None:
                room.append(jnp.minimum(smallest(T) - bounds[0], bounds[1] - largest(T)) / 100.0)
        return room[0] if len(room) == 1 else jnp.minimum(*room)

    def _next_known(self, mode: Any) -> tuple[Any, list[Any]]:
        """The next known time, and whether it is that of the lever, of the load, and of each profile of the heat.

        A pulley at rest, and a lever that only begins to pull, must be held back by nothing that is over, and held by
        nothing that is yet to come: where its tension falls, without going to 0, the lever comes after the load, and
        also where it is to answer the load.
        """
        lever, piece = self.forces.lever, jnp.asarray(mode.lever_piece, jnp.int32)

        def waits(t: Array) -> Array:
            before, after = lever.value(t, piece), lever.value(t, piece + 1)
            answers = lever.follows(piece + 1) if isinstance(lever, AbstractSpeedLever) else False
            return (mode.band == BandMode.OPEN) | answers | ((after < before) & (after > 0))

        profiles = (lever, self.forces.load.profile, *self.profiles)
        return next_known_time(profiles, (piece, mode.load_piece, *mode.heat_pieces), waits)

    def next_pieces(self, mode: Any, at_stop: Array) -> Any:
        """The mode on the piece that begins at a known time."""
        _, turns = self._next_known(mode)
        old = [jnp.asarray(piece, jnp.int32) for piece in (mode.lever_piece, mode.load_piece, *mode.heat_pieces)]
        new = [piece + (at_stop & turn).astype(jnp.int32) for piece, turn in zip(old, turns, strict=True)]
        return mode._replace(lever_piece=new[0], load_piece=new[1], heat_pieces=tuple(new[2:]))

    def booked_change_of_load(self, y: Any, before: Any, after: Any) -> Any:
        """What comes onto the hook in motion brings its energy."""
        if self.forces.load.added_inertia(after.load_piece) is None:
            return y
        brought = 0.5 * (self.forces.inertia_at(after) - self.forces.inertia_at(before)) * y.omega**2
        return y._replace(ledger=y.ledger._replace(load_work=y.ledger.load_work + brought))

    def next_stop(self, mode):
        return self._next_known(mode)[0]
