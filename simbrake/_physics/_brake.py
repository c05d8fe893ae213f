"""A brake as a hybrid system: mechanism, lever and load, and its features over any friction pairs."""

import dataclasses
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, PyTree

from .._base._part import leaves, parts_below
from .._base._quantity import Characteristic
from .._phases import AtRest, PhaseEnd, PhaseNow, Phases
from ..friction import SurfaceState
from ..hybrid import CORE, QUADRATURE
from ..hybrid._arrays import Array
from ..hybrid._struct import struct_field
from ..hybrid._system import Instant, variables_of
from ..loads import AbstractLoad
from ..profiles import AbstractProfile, FunctionProfile, Piece, Real, hides_nothing, next_known_time
from ._feature import LEVER, LOAD, AbstractBrake, BrakeGuards, BrakeNow, Feature, Moment, State, piece_of
from ._heated import Heating, Network
from ._mechanism import (
    OPEN,
    AbstractMechanism,
    AppliedLoads,
    BrakeCode,
    ContactNow,
    EventState,
    Ledger,
    MechanismOutputs,
    Mode,
    Surfaces,
)
from ._motor import Drive
from ._onset import Onsets
from ._rope import ElasticRope
from ._shaft import Shaft, ShaftNow
from ._sliding import AbstractLiningFriction
from ._thermal import Thermal, total

#: relative rounding of a torque that balances another one
_ROUNDING = 1e-9


class Capacity(NamedTuple):
    """Load and sliding brake at one instant, or at many: torques (N·m) in the direction in which the pulley turns.

    - `load`: load torque, less the other torques on the shaft
    - `pairs` (…, k): maximum torque of each friction pair with its kinetic friction at the speed of the pulley and the
      temperatures of that instant: of a standard brake one, of a staged brake external, internal
    - `settled`: whether the lever is at its last value
    - `hanging`: torque of what hangs, without drag and the other torques on the shaft: what the brake alone would hold
    """

    load: Float[Array, "*many"]
    pairs: Float[Array, "*many pairs"]
    settled: Bool[Array, "*many"]
    hanging: Float[Array, "*many"]

    @property
    def torque(self) -> Float[Array, "*many"]:
        """Capacity of the brake: the torque of its weaker pair (N·m)."""
        return self.pairs.min(axis=-1)

    @property
    def outweighed(self) -> Bool[Array, "*many"]:
        """Whether the load exceeds the torque of the sliding brake; a load that equals it keeps the speed constant."""
        return self.load > self.torque * (1 + _ROUNDING)

    @property
    def exceeded(self) -> Bool[Array, "*many"]:
        """Whether the load exceeds what the brake gives, now and with the final lever force."""
        return self.settled & self.outweighed


#: passes in which tension and temperature after a jump are settled; each leaves about 1e-3 of the one before it
_PASSES = 4


def course_of_profile(profile: AbstractProfile, t: Array, piece: Piece) -> Real:
    """A profile as a function of time."""
    return profile.value(t, piece)


def _course_of_lever(lever: Any, t: Array, piece: Piece) -> tuple[Real, Real | None]:
    one = jnp.ones(())
    return lever.value(t, piece), lever.wanted_torque(t, one, piece, one, one) if lever.controls_speed else None


def _course_of_load(load: AbstractLoad, t: Array, piece: Piece) -> Real:
    return load.torque(t, jnp.ones(()), piece)


class BrakeSystem(AbstractBrake):
    """A brake: its mechanism under a lever and a load, and its features.

        φ̇ = ω,   J ω̇ = M_load(t, ω) − Σ M_shaft − M_b

    The only place where physics couples: temperatures go into the friction of the pairs, their power `F v` into the
    network, the ledger and the wear.

    - `inertia` `J` (kg·m²) of all that turns with the shaft at the start;  `track_radius` (m) of the rim
    - `features`: heat, shaft, rope, phases, wear, states of friction laws, of those that the scene has
    - `rims` `n`, which are alike: the mechanism is that of one, under `M_load/n` and `J/n`; its torque and its powers
      are `n` times as large on the shaft
    - `wants`: what the duty says that the brake is to do (`WANTS`), for the verdict alone
    """

    mechanism: AbstractMechanism
    inertia: Array
    track_radius: Array
    lever: AbstractProfile | Phases
    load: AbstractLoad
    features: tuple[Feature, ...]
    rims: int = struct_field(static=True, default=1)  # pyright: ignore
    wants: str = struct_field(static=True, default="")  # pyright: ignore

    @property
    def heat(self) -> Heating | None:
        """Heat of the brake, where the scene has it."""
        return self.feature(Heating)

    @property
    def thermal(self) -> Thermal | None:
        """The thermal network, where the scene has one."""
        return None if self.heat is None else self.heat.thermal

    @property
    def shaft(self) -> Shaft | None:
        """Torques on the shaft beside load and brake."""
        return self.feature(Shaft)

    @property
    def motor(self) -> Drive | None:
        """A motor on the shaft."""
        return self.feature(Drive)

    @property
    def rope(self) -> ElasticRope | None:
        """The elastic rope, where the load hangs on one."""
        return self.feature(ElasticRope)

    @property
    def grip(self) -> AbstractLiningFriction:
        """Friction of the linings under the band."""
        return self.mechanism.grip

    @property
    def pair_names(self) -> tuple[str, ...]:
        """Names of the friction pairs, first the one on which the lever acts."""
        return tuple(pair.name for pair in self.mechanism.pairs)

    # --- load and lever -----------------------------------------------------------------------------------------------

    @property
    def profiles(self) -> tuple[AbstractProfile | Phases, ...]:
        """Given functions of time beside lever and load."""
        heat = () if self.thermal is None else self.thermal.heat.profiles
        motor = () if self.motor is None else (self.motor.course,)
        return (*heat, *motor, *self.mechanism.profiles, *(() if self.shaft is None else self.shaft.profiles))

    @property
    def sampled(self) -> tuple[str, ...]:
        """Given functions of time, in words, that may have features between two breakpoints which only samples see."""

        def levers(lever: AbstractProfile | Phases) -> list[AbstractProfile]:
            return [phase.lever for phase in lever.each] if isinstance(lever, Phases) else [lever]

        motor = [] if self.motor is None else levers(self.motor.course)
        plain = {
            "the lever": all(hides_nothing(one, _course_of_lever) for one in levers(self.lever)),
            "the load": hides_nothing(self.load, _course_of_load),
            "the motor": all(hides_nothing(one, _course_of_lever) for one in motor),
            "another given function": all(
                hides_nothing(one, course_of_profile)
                for one in self.profiles
                if isinstance(one, AbstractProfile) and not one.controls_speed
            ),
        }
        return tuple(words for words, known in plain.items() if not known)

    @property
    def guard_samples(self) -> int:
        """Points inside a step at which guards are evaluated: none if given functions have no short features."""
        return 15 if self.sampled else 0

    @property
    def machine(self) -> Characteristic:
        """Force, length, speed and temperature from which typical sizes of the brake's numbers follow."""
        return Characteristic(self.sizes.torque / self.track_radius, self.track_radius, self.sizes.speed, 100.0)

    def typical_numbers(self) -> PyTree:
        sizes = {id(leaf.value): leaf.about.size(self.machine) for leaf in leaves(self)}
        for _, part, _ in parts_below(self):
            if isinstance(part, FunctionProfile):
                sizes |= {id(x): part.typical for x in jax.tree.leaves(part.parameters)}
        import equinox as eqx

        return jax.tree.map(lambda x: sizes.get(id(x), 0.0), eqx.filter(self, eqx.is_inexact_array))

    @property
    def jumps(self) -> bool:
        """Whether states jump at events, beyond rounding and the speed at a change of the rope's layer."""
        return self.mechanism.stretches or any(one.jumps(self) for one in self.features)

    @property
    def rests_open(self) -> bool:
        """Whether the pulley may come to rest with the band open, and no dry friction that holds it."""
        phases = self.lever.each if isinstance(self.lever, Phases) else ()
        return self.motor is not None or any(isinstance(phase.until, AtRest) for phase in phases)

    @property
    def self_timed(self) -> bool:
        return isinstance(self.lever, Phases) or self.feature(Onsets) is not None

    def lever_at(self, y: Any, mode: Mode) -> Any:
        """The lever, a profile, or that of the phase that runs, a `PhaseNow`."""
        return self.lever.at(mode.phase, y.phase.begun) if isinstance(self.lever, Phases) else self.lever

    def inertia_at(self, mode: Mode) -> Array:
        inertia = self.inertia
        if self.rope is not None:  # it alone feels the hook
            return inertia
        load = self.load.on_layer(mode.layer)
        if self.load.layers is not None:
            inertia = inertia + (load.inertia() - self.load.on_layer(self.load.layers.first_layer()).inertia())
        more = load.added_inertia(piece_of(mode, LOAD))
        return inertia if more is None else inertia + more

    def load_torque(self, t: Array, omega: Array, mode: Mode, y: State | None = None) -> Array:
        torque = jnp.asarray(self.load.on_layer(mode.layer).torque(t, omega, piece_of(mode, LOAD)))
        return torque if self.rope is None or y is None else torque + self.rope.torque_beyond_weight(self, y, mode)

    def motor_torque(self, t: Array, y: State, mode: Mode) -> Array | None:
        return None if self.motor is None else self.motor.torque(self, t, y.omega, y, mode)

    def _shaft_now(self, t: Array, y: State, mode: Mode, load: Array, motor: Array | None) -> ShaftNow | None:
        if self.shaft is None:
            return None
        at_rest = self.load_torque(t, 0.0 * y.omega, mode, y)
        return self.shaft.now(t, y.omega, (load, at_rest), mode, self.shaft.pieces(mode), motor)

    def _network(self, heat: Heating, t: Array, y: State, mode: Mode) -> Network:
        pressures = self._pressures(heat, t, y, mode) if heat.thermal.heat.pressed else (0.0,)
        return heat.network(Moment(self, t, y, mode), pressures)

    def _pressures(self, heat: Heating, t: Array, y: State, mode: Mode) -> tuple[Array, ...]:
        """Pressures of the linings (Pa) in each pair; loads do not depend on how fast temperatures change."""
        _, left, *_, surfaces, (tension, pull) = self.given(t, y, mode)
        still = heat.at_sensors(self, jnp.zeros_like(y.heat))
        shares = self.of_one((left, self.inertia_at(mode)))
        acting = AppliedLoads(t, tension, pull, *shares, surfaces, lambda forces: still)
        z = self.mechanism.variables(acting, y.omega, y.own, mode)
        shown = self.mechanism.shown(tension, y.omega, y.own, mode, surfaces, z).pairs
        each = zip(self.mechanism.pairs, shown, strict=True)
        return tuple(jnp.zeros(()) if pair.area is None else now.normal / pair.area for pair, now in each)

    def sensed(self, u: Array | None) -> tuple[Array | None, ...]:
        if self.heat is None or u is None:
            return tuple(None for _ in self.mechanism.pairs)
        return self.heat.at_sensors(self, self.heat.thermal.temperatures(u))

    def surfaces(self, t: Array, y: State, mode: Mode) -> Surfaces:
        memory = tuple(None for _ in self.mechanism.pairs) if y.memory is None else y.memory
        each = zip(self.sensed(y.heat), memory, self._factors(t, y, mode), strict=True)
        return tuple(None if all(x is None for x in one) else SurfaceState(*one) for one in each)

    @property
    def first_change(self) -> int:
        shaft = () if self.shaft is None else self.shaft.profiles
        return LOAD + 1 + len(self.profiles) - len(shaft) - len(self.mechanism.changes)

    def changes_now(self, y: State, mode: Mode) -> tuple[Any, ...]:
        """The courses of the changes of friction, also of those that begin when something happens."""
        onsets = self.feature(Onsets)
        return self.mechanism.profiles if onsets is None else onsets.courses(self, y, mode)

    def _factors(self, t: Array, y: State, mode: Mode) -> tuple[Array | None, ...]:
        """Factors of the friction of each pair by changes over time, (n,); `None` of a law without."""
        first, courses = self.first_change, self.changes_now(y, mode)
        return self.mechanism.factors(
            [jnp.asarray(course.value(t, piece_of(mode, first + i))) for i, course in enumerate(courses)]
        )

    def lever_tension(self, t: Array, y: State, mode: Mode, load: Array, surfaces: Surfaces) -> tuple[Array, Array]:
        """`T_0` (N) and its rate as the lever has them."""
        piece, lever, omega = piece_of(mode, LEVER), self.lever_at(y, mode), y.omega
        given, rate = jax.jvp(lambda t: lever.value(t, piece), (t,), (jnp.ones_like(t),))
        if not lever.controls_speed:
            return given, rate
        turned = y.phi if y.phase is None else y.phase.turned
        torque = jnp.asarray(lever.wanted_torque(t, omega, piece, load, jnp.asarray(self.inertia_at(mode)), turned))
        follows = lever.follows(piece)
        gain = self.of_all(self.mechanism.gain(jnp.where(mode.sense > 0, omega, -omega), surfaces))
        return jnp.where(follows, lever.holding(torque, gain), given), jnp.where(follows, 0.0, rate)

    def given(
        self, t: Array, y: State, mode: Mode
    ) -> tuple[Array, Array, ShaftNow | None, Array | None, Surfaces, Any]:
        """Load, what shaft and motor leave of it, their torques, surfaces, tension of the lever and its rate."""
        load, surfaces = self.load_torque(t, y.omega, mode, y), self.surfaces(t, y, mode)
        motor = self.motor_torque(t, y, mode)
        shaft = self._shaft_now(t, y, mode, load, motor)
        left = shaft.left if shaft is not None else load if motor is None else load - motor
        return load, left, shaft, motor, surfaces, self.lever_tension(t, y, mode, left, surfaces)

    def surface_temperatures(self, z: BrakeNow) -> dict[str, Array]:
        return {} if self.heat is None else self.heat.surface_temperatures(z)

    # --- all of it at one instant -------------------------------------------------------------------------------------

    def variables(self, t: Array, y: State, mode: Mode) -> BrakeNow:
        heat, thermal = self.heat, None
        load, left, shaft, motor, surfaces, (tension, pull) = self.given(t, y, mode)

        def heating_rate(forces: tuple[Array | None, ...] | None) -> tuple[Array | None, ...]:
            if heat is None:
                return tuple(None for _ in self.mechanism.pairs)
            return heat.rates_at_sensors(self, network, flows, forces)

        if heat is not None:
            network = self._network(heat, t, y, mode)
            flows = heat.thermal.flows(*network, () if self.shaft is None else self.shaft.heating(shaft, y.omega))
        factor_rates = None
        if self.mechanism.stretches and self.mechanism.profiles:
            factor_rates = jax.jvp(lambda t: self._factors(t, y, mode), (t,), (jnp.ones_like(t),))[1]
        shares = self.of_one((left, self.inertia_at(mode)))
        acting = AppliedLoads(t, tension, pull, *shares, surfaces, heating_rate, factor_rates)
        contact = self.mechanism.variables(acting, y.omega, y.own, mode)
        rubs = self.mechanism.rubs(mode, contact)
        if heat is not None:
            thermal = heat.with_friction(self, rubs, network, flows)
        z = BrakeNow(tension, pull, load, contact, rubs, thermal, shaft, motor=motor)
        for feature in self.features:
            z = feature.variables(Moment(self, t, y, mode, z))
        return z

    def rates(self, t: Array, y: State, mode: Mode, z: BrakeNow) -> State:
        ledger = Ledger(
            load_work=z.load_torque * y.omega,
            lever_work=self.of_all(z.contact.lever_power),
            friction=tuple(self.of_all(_total(rub.force * rub.slip)) for rub in z.rubs),
            damper_heat=self.of_all(z.contact.damping) if self.mechanism.damps else None,
        )
        rates = State(y.omega, z.contact.alpha, self.mechanism.own_rates(z.contact), ledger)
        now = Moment(self, t, y, mode, z)
        for feature in self.features:
            rates = feature.rates(now, rates)
        return rates

    # --- guards and changes of mode -----------------------------------------------------------------------------------

    def _acting(self, t: Array, y: State, mode: Mode, z: BrakeNow) -> AppliedLoads:
        """Applied loads for guards and changes of mode, which do not need the rates of temperatures."""
        shares, surfaces = self.of_one((z.net_load, self.inertia_at(mode))), self.surfaces(t, y, mode)
        return AppliedLoads(t, z.lever_tension, z.lever_rate, *shares, surfaces, lambda forces: ())

    def margins(self, t: Array, y: State, mode: Mode, z: BrakeNow) -> BrakeGuards:
        guards = BrakeGuards(self.mechanism.guards(self._acting(t, y, mode, z), y.omega, y.own, mode, z.contact))
        now = Moment(self, t, y, mode, z)
        for feature in self.features:
            guards = feature.margins(now, guards)
        return guards

    def limits(self, mode: Mode, guards: BrakeGuards) -> BrakeGuards:
        none = jax.tree.map(lambda guard: jnp.zeros(jnp.shape(guard), bool), guards)
        limits = none._replace(contact=self.mechanism.limits(mode, none.contact))
        for feature in self.features:
            limits = feature.limits(mode, limits)
        return limits

    def change(self, now: Instant, fired: BrakeGuards, at_stop: Bool[Array, ""]) -> tuple[Mode, Array]:
        for feature in self.features:
            now = now._replace(mode=feature.at_once(now.mode, fired))
        t, y, new = now.t, now.y, self._next_pieces(now.y, now.mode, at_stop)
        acting = self._acting(t, y, now.mode, now.z)
        omega = y.omega
        for feature in self.features:
            omega = feature.settled(Moment(self, t, y, now.mode), fired, omega)
        moment = EventState(t, omega, y.own, now.mode, acting, now.z.contact, now.z_rate.contact)
        for feature in self.features:
            y, new = feature.before(Moment(self, t, y, now.mode, now.z), new, fired)

        def ask(mode: Mode, omega: Array, own: PyTree) -> tuple[AppliedLoads, ContactNow]:
            z = self.variables(t, y._replace(omega=omega, own=own), mode)
            return self._acting(t, y, mode, z), z.contact

        new, code = self.mechanism.change(moment, new, fired.contact, ask)
        for feature in self.features:
            new, code = feature.after(Moment(self, t, y, now.mode, now.z), new, fired, code)
        return new, code

    def code_at_end(self, mode: Mode) -> int:
        return int(BrakeCode.PHASE_NEVER_ENDS) if isinstance(self.lever, Phases) else 0

    def reset(self, t: Array, y: State, before: Mode, after: Mode) -> State:
        omega, now = y.omega, Moment(self, t, y, before)
        for feature in self.features:
            omega = feature.speed_after(now, after, omega)
        omega, own = self.mechanism.with_stuck_speeds(omega, y.own, before, after)
        new = y._replace(omega=omega, own=own)
        if self.load.added_inertia(piece_of(after, LOAD)) is not None:  # mass added in motion brings its energy
            added = self.inertia_at(after) - self.inertia_at(before._replace(layer=after.layer))
            new = new._replace(ledger=y.ledger._replace(load_work=y.ledger.load_work + 0.5 * added * omega**2))
        for feature in self.features:
            new = feature.reset(now, after, new)
        return self._after_jump(t, y, before, after, new) if self.mechanism.stretches else new

    def _after_jump(self, t: Array, y: State, before: Mode, after: Mode, new: State) -> State:
        """The state after the jump of tension in a change of mode, with its work and its heat."""
        heat, omega, own = self.heat, new.omega, new.own
        z, surfaces = variables_of(self, t, y, before).contact, self.surfaces(t, y._replace(onset=new.onset), after)
        load = self.load_torque(t, omega, after)
        tension = self.lever_tension(t, new, after, load, surfaces)[0]
        of_rim = self.mechanism.tension_jump(omega, own, (before, z), (after, tension))
        per_joule = [] if heat is None else heat.of_a_jump(self, self._network(heat, t, new, after))

        def tension_jump(surfaces: Surfaces) -> tuple[PyTree, Array, tuple[Array, ...]]:
            own, work, heats = of_rim(surfaces)
            return own, *self.of_all((work, heats))

        def warmed(heats: tuple[Array, ...]) -> Array:
            return total([new.heat, *(E * rise for E, (rise, _) in zip(heats, per_joule, strict=True))])

        # the heat of the jump warms the linings, on which the tension after it depends: settled in a few passes
        def settle(jump: PyTree, _: None) -> tuple[PyTree, None]:
            return tension_jump(self.surfaces(t, new._replace(heat=warmed(jump[2])), after)), None

        if per_joule and self.grip.varies:
            zero = jnp.zeros_like(omega)
            jump: Any = (own, zero, tuple(zero for _ in per_joule))
            jump = jax.lax.scan(settle, jump, None, length=_PASSES)[0]
        else:
            jump = tension_jump(surfaces)
        own, work, heats = jump
        old, booked = new.ledger, new.ledger.heat
        friction = tuple(one + heat for one, heat in zip(old.friction, heats, strict=True))
        for E, (_, shares) in zip(heats, per_joule, strict=False):
            booked = jax.tree.map(lambda x, share, E=E: x + E * share, booked, shares)._replace(
                supplied=booked.supplied
            )
        ledger = old._replace(lever_work=old.lever_work + work, friction=friction, heat=booked)
        return new._replace(own=own, heat=warmed(heats) if per_joule else None, ledger=ledger)

    def _next_known(self, y: Any, mode: Mode) -> tuple[Float[Array, ""] | float, list[Bool[Array, ""] | bool]]:
        """The next time breakpoint, and whether it belongs to the lever, the load, each profile of the heat, and the
        end of the phase.

        A pulley at rest, and a lever that begins to pull, must see no input that has ended, nor one that has yet to
        begin: where its tension falls without going to 0, and where it follows the load, the lever is processed after
        the load.
        """
        lever, piece = self.lever_at(y, mode), jnp.asarray(piece_of(mode, LEVER), jnp.int32)

        def waits(t: Array) -> Array:
            before, after = lever.value(t, piece), lever.value(t, piece + 1)
            answers = lever.follows(piece + 1) if lever.controls_speed else False
            return (mode.band == OPEN) | answers | ((after < before) & (after > 0))

        profiles = (lever, self.load.profile, *self.profiles)
        if self.motor is not None:
            profiles = tuple(self.motor.now(y, mode) if one is self.motor.course else one for one in profiles)
        if self.feature(Onsets) is not None:
            first, changes = self.first_change, self.changes_now(y, mode)
            profiles = (*profiles[:first], *changes, *profiles[first + len(changes) :])
        pieces = [piece, *(piece_of(mode, i) for i in range(LOAD, len(profiles)))]
        if isinstance(lever, PhaseNow):
            profiles, pieces = (*profiles, PhaseEnd(lever)), [*pieces, piece]
        return next_known_time(profiles, pieces, waits)

    def _next_pieces(self, y: State, mode: Mode, at_stop: Array) -> Mode:
        """The mode on the piece that begins at a time breakpoint, or in the phase after the one that ends at it."""
        _, turns = self._next_known(y, mode)
        given = mode.pieces if mode.phase is None else (*mode.pieces, mode.phase)
        new = tuple(
            None if piece is None else jnp.asarray(piece, jnp.int32) + (at_stop & turn).astype(jnp.int32)
            for piece, turn in zip(given, turns, strict=True)
        )
        return mode._replace(pieces=new) if mode.phase is None else mode._replace(pieces=new[:-1], phase=new[-1])

    def next_stop(self, mode: Mode, y: Any = None) -> Float[Array, ""] | float:
        return self._next_known(y, mode)[0]

    # --- as results ---------------------------------------------------------------------------------------------------

    def capacity(
        self, tension: Array, omega: Array, own: PyTree, surfaces: Surfaces, *, static: bool = False
    ) -> Float[Array, " pairs"]:
        """Maximum torque (N·m) of each friction pair, of all rims, as `AbstractMechanism.capacity`."""
        return self.of_all(self.mechanism.capacity(tension, omega, own, surfaces, static=static))

    def shown(self, t: Array, y: State, mode: Mode, z: BrakeNow) -> tuple[BrakeNow, MechanismOutputs]:
        """Variables and results of the mechanism with torques of all rims; forces are those of one."""
        surfaces = self.surfaces(t, y, mode)
        shown = self.mechanism.shown(z.lever_tension, y.omega, y.own, mode, surfaces, z.contact)
        if self.rims == 1:
            return z, shown
        contact = dataclasses.replace(z.contact, brake_torque=self.of_all(z.contact.brake_torque))
        torques = (self.of_all((pair.torque, pair.capacity)) for pair in shown.pairs)
        each = zip(shown.pairs, torques, strict=True)
        pairs = tuple(pair._replace(torque=torque, capacity=capacity) for pair, (torque, capacity) in each)
        return z._replace(contact=contact), shown._replace(pairs=pairs)

    # --- states -------------------------------------------------------------------------------------------------------

    def start(self, t: Array, omega: Array, own: PyTree, heat: Array | None, mode: Mode) -> tuple[State, Mode]:
        """State and mode at the start; energies and wear are 0."""
        zero = jnp.zeros_like(omega)
        y = State(zero, omega, own, self._ledger(zero), heat)
        for feature in self.features:
            y, mode = feature.start(Moment(self, t, y, mode))
        return y, mode

    def _ledger(self, of_each: Any) -> Ledger:
        friction = tuple(of_each for _ in self.mechanism.pairs)
        return Ledger(of_each, of_each, friction, damper_heat=of_each if self.mechanism.damps else None)

    def scales(self) -> State:
        sizes = State(1.0, self.sizes.speed, self.mechanism.own_sizes(), self._ledger(jnp.inf))
        for feature in self.features:
            sizes = feature.sizes(self, sizes)
        return sizes

    def couplings(self) -> State | None:
        own = jax.tree.map(lambda size: np.full(jnp.shape(size), CORE), self.mechanism.own_sizes())
        core, quadrature = np.asarray(CORE), np.asarray(QUADRATURE)
        # (the angle moves nothing but a correction of the position)
        corrects = self.lever.corrects_position or (self.motor is not None and self.motor.course.corrects_position)
        places = State(core if corrects else quadrature, core, own, self._ledger(quadrature))
        for feature in self.features:
            places = feature.places(self, places)
        # (without heat and states of laws there are too few states for it)
        return None if places.heat is None and places.memory is None else places

    def stored_at(self, inertia: Array, omega: Array, own: PyTree, mode: Mode) -> tuple[Array, Array]:
        return self.of_all(self.mechanism.stored(self.of_one(inertia), omega, own, mode))

    def stored(self, t: Array, y: State, mode: Mode) -> tuple[Array, Array]:
        """Kinetic and elastic energy (J)."""
        stored = self.stored_at(self.inertia_at(mode), y.omega, y.own, mode)
        now = Moment(self, t, y, mode)
        for feature in self.features:
            stored = feature.stored(now, stored)
        return stored


def _total(power: Array) -> Array:
    """Power of a pair: the sum over its linings, where each is known."""
    return jnp.sum(power) if jnp.ndim(power) else power
