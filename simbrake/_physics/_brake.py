"""A brake as a hybrid system: shaft, load and lever, heat, wear and ledger over any friction pairs."""

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, PyTree

from .._base._corners import lesser
from .._base._part import leaves, parts_below
from .._base._quantity import Characteristic
from .._phases import AfterTravel, AtRest, AtTemperature, PhaseEnd, PhaseNow, Phases
from ..friction import SurfaceState, memory_at_start, memory_sizes
from ..hybrid import CORE, QUADRATURE, AbstractSemiExplicitSystem, smallest
from ..hybrid._arrays import Array, largest
from ..hybrid._system import ENDED, Instant, variables_of
from ..loads import AbstractLoad
from ..profiles import AbstractProfile, FunctionProfile, Piece, Real, hides_nothing, next_known_time
from ..rope import RopeElasticity
from ._mechanism import (
    OPEN,
    AbstractMechanism,
    AppliedLoads,
    BrakeCode,
    ContactNow,
    ContactState,
    EventState,
    HeatLedger,
    Ledger,
    Mode,
    Pair,
    Sizes,
    Surfaces,
)
from ._shaft import Shaft, ShaftNow, speed_on_layer
from ._sliding import AbstractLiningFriction
from ._sparsity import couplings, couplings_of_memory
from ._thermal import Conditions, Deposit, HeatFlows, Pieces, Thermal, total

# --- state of a run ---------------------------------------------------------------------------------------------------


#: relative rounding of a torque that balances another one
_ROUNDING = 1e-9


class State(NamedTuple):
    """Angle `φ` (rad) and speed `ω` (rad/s) of the pulley, the states of the mechanism's own, the ledger, the heat
    content of the thermal nodes over their capacity (K; `None` without heat), the thickness worn off the linings of
    each pair (m; `None` without wear, and of a pair without), the states of the friction law of each pair (`None`
    without any), of the phase of the duty (`None` without phases), and of a hook on an elastic rope (`None` on a rigid
    one)."""

    phi: Any
    omega: Any
    own: Any
    ledger: Ledger
    heat: Any = None
    worn: Any = None
    memory: Any = None
    phase: Any = None
    hook: Any = None


class ThermalNow(NamedTuple):
    """The thermal network at one instant."""

    T: Array  # temperatures of the nodes with capacity (K)
    T_junctions: Array  # of those without, friction heat included
    flows: HeatFlows  # friction apart
    deposits: tuple[Deposit, ...]  # of the friction heat of each pair (W)


class BrakeNow(NamedTuple):
    """Variables of a brake: applied loads, its mechanism (`contact`), its pairs, and the thermal network if any."""

    lever_tension: Float[Array, ""]  # T_0 (N), as the lever would give it
    lever_rate: Float[Array, ""]  # its rate (N/s)
    load_torque: Float[Array, ""]  # M_load (N·m)
    contact: PyTree  # a `ContactNow`
    rubs: tuple[ContactState, ...]
    thermal: ThermalNow | None
    shaft: ShaftNow | None = None  # torques on the shaft beside load and brake
    rope: Any = None  # a `RopeNow`, of an elastic rope

    @property
    def net_load(self) -> Array:
        """Torque (N·m) that the shaft leaves of the load: that on the mechanism."""
        return self.load_torque if self.shaft is None else self.shaft.left


class Wearing(NamedTuple):
    """Integration of the wear depth of the linings: no rate depends on it, it is a quadrature.

    - `scale` (m): typical thickness that the run wears off
    - `turned_at`: times at which the band is turned end for end (of a duty in phases: numbers of phases that have
      ended). `h_i` of the first pair stays that of the lining which was the `i`-th at the start; after an odd number of
      turns it rubs where the `(n + 1 − i)`-th did
    """

    scale: Float[Array, ""]
    turned_at: Array | None


class Capacity(NamedTuple):
    """Load and sliding brake at one instant, or at many: torques (N·m) in the direction in which the pulley turns.

    - `load`: load torque, less the other torques on the shaft
    - `pairs` (…, k): maximum torque of each friction pair with its kinetic friction at the speed of the pulley and the
      temperatures of that instant: of a standard brake one, of a staged brake external, internal
    - `settled`: whether the lever is at its last value
    """

    load: Float[Array, "*many"]
    pairs: Float[Array, "*many pairs"]
    settled: Bool[Array, "*many"]

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


# --- phases of a duty -------------------------------------------------------------------------------------------------


class PhaseState(NamedTuple):
    """Begin of the phase that runs (s), and angle by which the pulley has turned in it (rad)."""

    begun: Any
    turned: Any


def begun_anew(state: PhaseState, t: Array, before: Mode, after: Mode, phases: Phases) -> PhaseState:
    """The state after a change of mode: another phase begins now, unless all are over."""
    new = (after.phase != before.phase) & (after.phase < phases.total)
    return PhaseState(jnp.where(new, t, state.begun), jnp.where(new, 0.0, state.turned))


def margin_of_phase(
    now: PhaseNow, state: PhaseState, mode: Mode, lowered: Any, hot: dict[str, Array]
) -> Float[Array, ""]:
    """Margin to the end of the phase that runs; 1 where a time ends it, which is a time breakpoint.

    - `lowered`: travel of the hook in the phase (m);  `hot`: surface temperatures (K)
    """
    found = []
    for phase in now.whole.phases:
        end = phase.until
        if isinstance(end, AtRest):
            # (the pulley has moved in the phase, if only by rounding: an event at its begin takes no time)
            found.append(jnp.where(mode.rests & (state.turned != 0), -1.0, 1.0))
        elif isinstance(end, AfterTravel):
            found.append(1.0 - lowered / end.distance)
        elif isinstance(end, AtTemperature):
            above = (largest(jnp.atleast_1d(hot[end.of])) - end.level) / 100.0
            found.append(above if end.falling else -above)
        else:
            found.append(1.0)
    return now.of_each(found)


# --- the system -------------------------------------------------------------------------------------------------------


#: passes in which tension and temperature after a jump are settled; each leaves about 1e-3 of the one before it
_PASSES = 4

#: places among `Mode.pieces`: of the lever, the load, then of the profiles of the heat, friction, then of the shaft
LEVER, LOAD, HEAT = 0, 1, 2


def course_of_profile(profile: AbstractProfile, t: Array, piece: Piece) -> Real:
    """A profile as a function of time."""
    return profile.value(t, piece)


def _course_of_lever(lever: Any, t: Array, piece: Piece) -> tuple[Real, Real | None]:
    one = jnp.ones(())
    return lever.value(t, piece), lever.wanted_torque(t, one, piece, one, one) if lever.controls_speed else None


def _course_of_load(load: AbstractLoad, t: Array, piece: Piece) -> Real:
    return load.torque(t, jnp.ones(()), piece)


class BrakeGuards(NamedTuple):
    """Guards of a brake, or which of them fired; `None`: absent physics has none.

    - `contact`: those of the mechanism;  `dry_shaft`: motion of the shaft, or what its dry friction can hold
    - `layer_paid_out`, `layer_full`: rope left on its layer;  `friction_table`: to the ends of a table of friction
    - `phase_end` of the duty;  `rope`: pull of an elastic rope, of a slack one its slack
    """

    contact: PyTree
    dry_shaft: Any = None
    layer_paid_out: Any = None
    layer_full: Any = None
    friction_table: Any = None
    phase_end: Any = None
    rope: Any = None


class BrakeSystem(AbstractSemiExplicitSystem):
    """A brake: its mechanism under a lever and a load, with a thermal network and wear if the scene has them.

        φ̇ = ω,   J ω̇ = M_load(t, ω) − Σ M_shaft − M_b

    The only place where physics couples: temperatures go into the friction of the pairs, their power `F v` into the
    network, the ledger and the wear.

    - `inertia` `J` (kg·m²) of all that turns with the shaft at the start;  `track_radius` (m), whose speed cools
    """

    mechanism: AbstractMechanism
    inertia: Array
    track_radius: Array
    lever: AbstractProfile | Phases
    load: AbstractLoad
    thermal: Thermal | None
    wearing: Wearing | None
    weights: Float[Array, " n"]  # of the linings, over which the heat of a jump is spread
    shaft: Shaft | None = None

    @property
    def sizes(self) -> Sizes:
        """Typical slack tension, torque and speed."""
        return self.mechanism.sizes

    @property
    def grip(self) -> AbstractLiningFriction:
        """Friction of the linings under the band."""
        return self.mechanism.grip

    @property
    def pair_names(self) -> tuple[str, ...]:
        """Names of the friction pairs, first the one on which the lever acts."""
        return tuple(pair.name for pair in self.mechanism.pairs)

    @property
    def remembers(self) -> bool:
        """Whether a friction law has internal states."""
        return any(pair.memory is not None for pair in self.mechanism.pairs)

    # --- load and lever -----------------------------------------------------------------------------------------------

    @property
    def profiles(self) -> tuple[AbstractProfile, ...]:
        """Given functions of time beside lever and load."""
        heat = () if self.thermal is None else self.thermal.heat.profiles
        return (*heat, *self.mechanism.profiles, *(() if self.shaft is None else self.shaft.profiles))

    @property
    def sampled(self) -> tuple[str, ...]:
        """Given functions of time, in words, that may have features between two breakpoints which only samples see."""
        levers = [phase.lever for phase in self.lever.phases] if isinstance(self.lever, Phases) else [self.lever]
        plain = {
            "the lever": all(hides_nothing(one, _course_of_lever) for one in levers),
            "the load": hides_nothing(self.load, _course_of_load),
            "another given function": all(hides_nothing(one, course_of_profile) for one in self.profiles),
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
        return jax.tree.map(lambda x: sizes.get(id(x), 0.0), eqx.filter(self, eqx.is_inexact_array))

    @property
    def jumps(self) -> bool:
        """Whether states jump at events, beyond rounding and the speed at a change of the rope's layer."""
        return self.mechanism.stretches

    @property
    def self_timed(self) -> bool:
        return isinstance(self.lever, Phases)

    def lever_at(self, y: Any, mode: Mode) -> Any:
        """The lever, a profile, or that of the phase that runs, a `PhaseNow`."""
        return self.lever.at(mode.phase, y.phase.begun) if isinstance(self.lever, Phases) else self.lever

    def inertia_at(self, mode: Mode) -> Array:
        """Inertia of all that turns and moves with the shaft (kg·m²)."""
        load, inertia = self.load.on_layer(mode.layer), self.inertia
        if self.load.layers is not None:
            inertia = inertia + (load.inertia() - self.load.on_layer(self.load.layers.first_layer()).inertia())
        more = load.added_inertia(piece_of(mode, LOAD))
        return inertia if more is None else inertia + more

    def load_torque(self, t: Array, omega: Array, mode: Mode, y: State | None = None) -> Array:
        """Torque of the load (N·m), its rope in the layer of the mode; where `y` matters, see `BrakeUnderRope`."""
        return jnp.asarray(self.load.on_layer(mode.layer).torque(t, omega, piece_of(mode, LOAD)))

    def shaft_pieces(self, mode: Mode) -> tuple[Piece, ...]:
        count = len(mode.pieces)
        return tuple(piece_of(mode, i) for i in range(count - len(self.shaft.laws), count)) if self.shaft else ()

    def _shaft_now(self, t: Array, y: State, mode: Mode, load: Array) -> ShaftNow | None:
        pieces, still = self.shaft_pieces(mode), 0.0 * y.omega
        return self.shaft and self.shaft.now(t, y.omega, (load, self.load_torque(t, still, mode, y)), mode, pieces)

    def _network(self, t: Array, y: State, mode: Mode) -> tuple[Array, Array, Array, Conditions, Pieces]:
        """The thermal network at one instant, input of its heat flows: temperatures of nodes and junctions, time,
        conditions at the surfaces, pieces of given functions."""
        assert self.thermal is not None
        around = Conditions(
            speed=jnp.abs(y.omega) * self.track_radius,
            lining_speed=jnp.abs(self.mechanism.lining_speed(y.own)),
            closed=jnp.where(mode.band == OPEN, 0.0, 1.0),
            pressures=self._pressures(t, y, mode) if self.thermal.heat.pressed else (0.0,),
            seated=None if mode.lifted is None else 1.0 - mode.lifted.astype(jnp.float64),
        )
        T, pieces = self.thermal.temperatures(y.heat), tuple(piece_of(mode, i) for i in range(HEAT, len(mode.pieces)))
        return T, self.thermal.junctions(T, t, around, pieces), t, around, pieces

    def _pressures(self, t: Array, y: State, mode: Mode) -> tuple[Array, ...]:
        """Pressures of the linings (Pa) in each pair; loads do not depend on how fast temperatures change."""
        _, left, _, surfaces, (tension, pull) = self.given(t, y, mode)
        still = self._at_sensors(jnp.zeros_like(y.heat))
        acting = AppliedLoads(t, tension, pull, left, self.inertia_at(mode), surfaces, lambda forces: still)
        z = self.mechanism.variables(acting, y.omega, y.own, mode)
        shown = self.mechanism.shown(tension, y.omega, y.own, mode, surfaces, z).pairs
        each = zip(self.mechanism.pairs, shown, strict=True)
        return tuple(jnp.zeros(()) if pair.area is None else now.normal / pair.area for pair, now in each)

    def sensed(self, u: Array | None) -> tuple[Array | None, ...]:
        """Temperatures (K) that the law of each pair sees, (n,), for the heat contents `u`; `None`: there are none."""
        if self.thermal is None or u is None:
            return tuple(None for _ in self.mechanism.pairs)
        return self._at_sensors(self.thermal.temperatures(u))

    def surfaces(self, t: Array, y: State, mode: Mode) -> Surfaces:
        """Surface states that the law of each pair depends on; `None`: none."""
        memory = tuple(None for _ in self.mechanism.pairs) if y.memory is None else y.memory
        each = zip(self.sensed(y.heat), memory, self._factors(t, mode), strict=True)
        return tuple(None if all(x is None for x in one) else SurfaceState(*one) for one in each)

    def _factors(self, t: Array, mode: Mode) -> tuple[Array | None, ...]:
        """Factors of the friction of each pair by changes over time, (n,); `None` of a law without."""
        last = len(mode.pieces) - len(self.shaft.laws if self.shaft else ())
        first = last - len(self.mechanism.profiles)
        return self.mechanism.factors(t, [piece_of(mode, i) for i in range(first, last)])

    def _at_sensors(self, T: Array) -> tuple[Array | None, ...]:
        """Values at the nodes on which the laws of the pairs depend."""
        assert self.thermal is not None
        found = []
        for pair in self.mechanism.pairs:
            sensor = None if pair.heat is None else pair.heat.sensor
            found.append(None if sensor is None else self.thermal.at(T, sensor, pair.count))
        return tuple(found)

    def lever_tension(self, t: Array, y: State, mode: Mode, load: Array, surfaces: Surfaces) -> tuple[Array, Array]:
        """`T_0` (N) and its rate as the lever has them."""
        piece, lever, omega = piece_of(mode, LEVER), self.lever_at(y, mode), y.omega
        given, rate = jax.jvp(lambda t: lever.value(t, piece), (t,), (jnp.ones_like(t),))
        if not lever.controls_speed:
            return given, rate
        torque = jnp.asarray(lever.wanted_torque(t, omega, piece, load, jnp.asarray(self.inertia_at(mode))))
        follows = lever.follows(piece)
        gain = self.mechanism.gain(jnp.where(mode.sense > 0, omega, -omega), surfaces)
        return jnp.where(follows, lever.holding(torque, gain), given), jnp.where(follows, 0.0, rate)

    def given(self, t: Array, y: State, mode: Mode) -> tuple[Array, Array, ShaftNow | None, Surfaces, Any]:
        """Load, what the shaft leaves of it, torques on the shaft, surfaces, tension of the lever and its rate."""
        load, surfaces = self.load_torque(t, y.omega, mode, y), self.surfaces(t, y, mode)
        shaft = self._shaft_now(t, y, mode, load)
        left = load if shaft is None else shaft.left
        return load, left, shaft, surfaces, self.lever_tension(t, y, mode, left, surfaces)

    def surface_temperatures(self, z: BrakeNow) -> dict[str, Array]:
        """Surface temperatures (K) of rim, linings and band where the scene names them; on walls reconstructed."""
        if self.thermal is None or z.thermal is None:
            return {}
        faces = dict(z.thermal.flows.faces)
        for deposit in z.thermal.deposits:
            for place, flow in deposit.faces.items():
                faces[place] = faces.get(place, 0.0) + flow
        T, T_J, places = z.thermal.T, z.thermal.T_junctions, self.thermal.heat.hot_places
        return {kind: self.thermal.surface(place, T, T_J, faces) for kind, place in places.items()}

    # --- all of it at one instant -------------------------------------------------------------------------------------

    def variables(self, t: Array, y: State, mode: Mode) -> BrakeNow:
        pairs = self.mechanism.pairs
        net: Any = self.thermal
        load, left, shaft, surfaces, (tension, pull) = self.given(t, y, mode)

        def deposit(pair: Pair, heat: Array) -> Deposit:
            return net.deposit(pair.heat, jnp.atleast_1d(heat), *now)

        def heating_rate(forces: tuple[Array | None, ...] | None) -> tuple[Array | None, ...]:
            if net is None:
                return (None,) * len(pairs)
            into = flows.into
            if forces is not None:
                given = [(pair, force) for pair, force in zip(pairs, forces, strict=True) if force is not None]
                into = total([deposit(pair, force).into for pair, force in given])
            return self._at_sensors(net.rise(into))

        if net is not None:
            now = self._network(t, y, mode)
            flows = net.flows(*now, () if self.shaft is None else self.shaft.heating(shaft, y.omega))
        factor_rates = None
        if self.mechanism.stretches and self.mechanism.profiles:
            factor_rates = jax.jvp(lambda t: self._factors(t, mode), (t,), (jnp.ones_like(t),))[1]
        acting = AppliedLoads(t, tension, pull, left, self.inertia_at(mode), surfaces, heating_rate, factor_rates)
        z = self.mechanism.variables(acting, y.omega, y.own, mode)
        rubs = self.mechanism.rubs(mode, z)
        if net is None:
            return BrakeNow(tension, pull, load, z, rubs, None, shaft)
        deposits = []
        for pair, rub in zip(pairs, rubs, strict=True):
            if jnp.ndim(rub.slip) == 0:
                # one slip speed for all linings: the mechanism has asked for the heat per unit of it
                found = jax.tree.map(lambda x, v=rub.slip: x * v, deposit(pair, rub.force))
            else:
                power = rub.force * rub.slip
                found = deposit(pair, power if pair.apart else jnp.sum(power))
            deposits.append(found)
        hot_junctions = total([now[1], *(found.into_junctions for found in deposits)])
        thermal = ThermalNow(now[0], hot_junctions, flows, tuple(deposits))
        return BrakeNow(tension, pull, load, z, rubs, thermal, shaft)

    def rates(self, t: Array, y: State, mode: Mode, z: BrakeNow) -> State:
        ledger = Ledger(
            load_work=z.load_torque * y.omega,
            lever_work=z.contact.lever_power,
            friction=tuple(_total(rub.force * rub.slip) for rub in z.rubs),
            damper_heat=z.contact.damping if self.mechanism.damps else None,
            shaft=None if self.shaft is None else tuple(power for _, power in self.shaft.powers(z.shaft, y.omega)),
        )
        rates = State(y.omega, z.contact.alpha, self.mechanism.own_rates(z.contact), ledger)
        if y.phase is not None:
            rates = rates._replace(phase=PhaseState(jnp.zeros_like(y.omega), y.omega))
        if self.wearing is not None:
            passed = t if mode.phase is None else mode.phase.astype(jnp.float64)
            rates = rates._replace(worn=self._wear_rates(passed, y, z.rubs, self.wearing.turned_at))
        if y.memory is not None:
            rates = rates._replace(memory=self._memory_rates(t, y, mode, z))
        if self.thermal is None or z.thermal is None:
            return rates
        flows, deposits = z.thermal.flows, z.thermal.deposits
        into = total([flows.into, *(deposit.into for deposit in deposits)])
        each = [self._booked_of(pair, deposit) for pair, deposit in zip(self.mechanism.pairs, deposits, strict=True)]
        booked: HeatLedger = jax.tree.map(lambda *parts: total(parts), *each)
        lost = booked.lost + flows.lost
        if self.shaft is not None:  # heat that enters no body
            lost = lost + total([power for place, power in self.shaft.powers(z.shaft, y.omega) if place is None])
        booked = booked._replace(lost=lost, supplied=flows.supplied)
        return rates._replace(ledger=ledger._replace(heat=booked), heat=self.thermal.rise(into))

    def _wear_rates(
        self, passed: Array, y: State, rubs: tuple[ContactState, ...], turned_at: Array | None
    ) -> tuple[Array | None, ...]:
        """Rates of wear (m/s) of the linings as they were counted at the start."""
        given = zip(self.mechanism.pairs, rubs, self.sensed(y.heat), strict=True)
        first, *others = (pair.wear_rate(rub, T) for pair, rub, T in given)
        if turned_at is not None and first is not None:
            turns = jnp.sum(jnp.asarray(passed) >= turned_at)
            first = jnp.where(turns % 2 == 1, first[::-1], first)
        return first, *others

    def _memory_rates(self, t: Array, y: State, mode: Mode, z: BrakeNow) -> tuple[PyTree, ...]:
        found, is_open, surfaces = [], mode.band == OPEN, self.surfaces(t, y, mode)
        for i, (pair, rub, surface) in enumerate(zip(self.mechanism.pairs, z.rubs, surfaces, strict=True)):
            if pair.memory is None or surface is None:
                found.append(None)
                continue
            v, power, normal = rub.sense * rub.slip, rub.force * rub.slip, rub.normal
            if i == 0:  # the pair on which the lever acts may be open, and sticking linings share its load by a rule
                v, power = jnp.where(is_open, 0.0, v), jnp.where(is_open, 0.0, power)
                if pair.memory.p:
                    seen = (z.lever_tension, y.omega, y.own, mode, surfaces, z.contact)
                    normal = jnp.where(rub.sense == 0, self.mechanism.shown(*seen).pairs[0].normal, normal)
            found.append(pair.memory_rates(surface, v, normal, power))
        return tuple(found)

    def _booked_of(self, pair: Pair, deposit: Deposit) -> HeatLedger:
        metal, none = deposit.to_metal, jnp.zeros_like(deposit.to_metal)
        behind = none if deposit.beyond is None else deposit.beyond
        metal, band = (behind, metal) if pair.on_band else (metal if deposit.beyond is None else metal + behind, none)
        return HeatLedger(metal, deposit.to_linings, deposit.lost, 0.0, band if self._has_band else None)

    @property
    def _has_band(self) -> bool:
        return any(pair.on_band for pair in self.mechanism.pairs)

    # --- guards and changes of mode -----------------------------------------------------------------------------------

    def _table_margin(self, u: Array | None) -> Float[Array, ""] | None:
        """Margin of the temperatures to the ends of the friction tables, over 100 K; `None`: no table ends."""
        room = []
        for pair, T in zip(self.mechanism.pairs, self.sensed(u), strict=True):
            bounds = pair.law.temperature_range()
            if bounds is not None and T is not None:
                room.append(jnp.minimum(smallest(T - bounds[0]), smallest(bounds[1] - T)) / 100.0)
        return functools.reduce(jnp.minimum, room) if room else None

    def _acting(self, t: Array, y: State, mode: Mode, z: BrakeNow) -> AppliedLoads:
        """Applied loads for guards and changes of mode, which do not need the rates of temperatures."""
        inertia, surfaces = self.inertia_at(mode), self.surfaces(t, y, mode)
        return AppliedLoads(t, z.lever_tension, z.lever_rate, z.net_load, inertia, surfaces, lambda forces: ())

    def margins(self, t: Array, y: State, mode: Mode, z: BrakeNow) -> BrakeGuards:
        found = BrakeGuards(self.mechanism.guards(self._acting(t, y, mode, z), y.omega, y.own, mode, z.contact))
        if z.shaft is not None and self.shaft is not None and self.shaft.dry:
            load, sizes = self.load_torque(t, 0.0 * y.omega, mode, y), self.sizes
            dry = self.shaft.margin(mode, y.omega, load, z.shaft, sizes.torque, sizes.speed)
            found = found._replace(dry_shaft=dry)
        if self.load.layers is not None:
            paid_out, full = self.load.layers.margins(y.phi, mode.layer)
            found = found._replace(layer_paid_out=paid_out, layer_full=full)
        found = found._replace(friction_table=self._table_margin(y.heat))
        if isinstance(self.lever, Phases):
            now, hot = self.lever.at(mode.phase, y.phase.begun), dict[str, Array]()
            if any(isinstance(phase.until, AtTemperature) for phase in self.lever.phases):
                hot = self.surface_temperatures(z)
            found = found._replace(phase_end=margin_of_phase(now, y.phase, mode, self._lowered(y), hot))
        return found

    def _lowered(self, y: State) -> Any:
        """Travel of the hook since the begin of the phase (m), `None` without a hook."""
        if self.load.layers is None:
            per_radian = self.load.travel()
            return None if per_radian is None else y.phase.turned * per_radian
        now, then = (self.load.travelled(phi) for phi in (y.phi, y.phi - y.phase.turned))
        return now - then  # pyright: ignore

    def change(self, now: Instant, fired: BrakeGuards, at_stop: Bool[Array, ""]) -> tuple[Mode, Array]:
        t, y = now.t, now.y

        def ask(mode: Mode, omega: Array, own: PyTree) -> tuple[AppliedLoads, ContactNow]:
            z = self.variables(t, y._replace(omega=omega, own=own), mode)
            return self._acting(t, y, mode, z), z.contact

        acting = self._acting(t, y, now.mode, now.z)
        moment = EventState(t, y.omega, y.own, now.mode, acting, now.z.contact, now.z_rate.contact)
        old, new = y, self._next_pieces(y, now.mode, at_stop)
        if isinstance(self.lever, Phases):
            new = self._next_phase(t, new, now.mode.phase, fired.phase_end)
            y = old._replace(phase=begun_anew(old.phase, t, now.mode, new, self.lever))
        new, code = self.mechanism.change(moment, new, fired.contact, ask)
        if fired.friction_table is not None:
            code = jnp.where(fired.friction_table, int(BrakeCode.OUTSIDE_TABLE), code)
        if fired.layer_full is not None and fired.layer_paid_out is not None:
            code = jnp.where(fired.layer_paid_out & (now.mode.layer == 1), int(BrakeCode.ROPE_END), code)
            step = fired.layer_full.astype(jnp.int32) - fired.layer_paid_out.astype(jnp.int32)
            new = new._replace(layer=jnp.maximum(now.mode.layer + step, 1).astype(jnp.int32))
        if fired.dry_shaft is not None and self.shaft is not None:
            load = self.load_torque(t, 0.0 * y.omega, new, y)
            shaft = self._shaft_now(t, y, new, load)
            assert shaft is not None
            turn = self.shaft.turn_after(now.mode, new, load, shaft, fired.dry_shaft, self.sizes.slight_torque)
            new = new._replace(turn=turn)
        if isinstance(self.lever, Phases):
            code = jnp.where((code == 0) & (new.phase == self.lever.total), ENDED, code)
        return new, code

    def _next_phase(self, t: Array, mode: Mode, before: Array, over: Array) -> Mode:
        """The mode in the next phase of the duty where one is `over`, if its time has not been (`mode.phase`)."""
        assert isinstance(self.lever, Phases)
        phase = before + (over | (mode.phase > before)).astype(jnp.int32)
        begins = (phase > before) & (phase < self.lever.total)
        lever, load, *others = mode.pieces
        lever = jnp.where(begins, self.lever.at(phase, t).first_piece(t), lever)
        load = self.lever.load_piece(phase) if self.load.by_phases else load
        return mode._replace(phase=phase, pieces=(lever, load, *others))

    def code_at_end(self, mode: Mode) -> int:
        return int(BrakeCode.PHASE_NEVER_ENDS)

    def reset(self, t: Array, y: State, before: Mode, after: Mode) -> State:
        more, moved = self.load.added_inertia(piece_of(after, LOAD)), before
        omega = y.omega if after.turn is None else jnp.where(after.turn == before.turn, y.omega, 0.0)
        if after.layer is not None:
            moved = before._replace(layer=after.layer)
            speed = speed_on_layer(self.mechanism, y, before, after, (self.inertia_at(before), self.inertia_at(moved)))
            omega = jnp.where(after.layer == before.layer, omega, speed)
        omega, own = self.mechanism.with_stuck_speeds(omega, y.own, before, after)
        still = y._replace(omega=omega, own=own)
        if isinstance(self.lever, Phases):
            still = still._replace(phase=begun_anew(y.phase, t, before, after, self.lever))
        if more is not None:  # mass added to the hook in motion brings its energy
            brought = 0.5 * (self.inertia_at(after) - self.inertia_at(moved)) * omega**2
            still = still._replace(ledger=y.ledger._replace(load_work=y.ledger.load_work + brought))
        if not self.mechanism.stretches:
            return still
        z, surfaces = variables_of(self, t, y, before).contact, self.surfaces(t, y, after)
        load = self.load_torque(t, omega, after)
        tension = self.lever_tension(t, still, after, load, surfaces)[0]
        tension_jump = self.mechanism.tension_jump(omega, own, (before, z), (after, tension))
        per_joule = [] if self.thermal is None else self._heat_of_a_jump(t, still, after)

        def warmed(heats: tuple[Array, ...]) -> Array:
            return total([still.heat, *(E * rise for E, (rise, _) in zip(heats, per_joule, strict=True))])

        # the heat of the jump warms the linings, on which the tension after it depends: settled in a few passes
        def settle(jump: PyTree, _: None) -> tuple[PyTree, None]:
            return tension_jump(self.surfaces(t, still._replace(heat=warmed(jump[2])), after)), None

        if per_joule and self.grip.varies:
            zero = jnp.zeros_like(omega)
            jump: Any = (own, zero, tuple(zero for _ in per_joule))
            jump = jax.lax.scan(settle, jump, None, length=_PASSES)[0]
        else:
            jump = tension_jump(surfaces)
        own, work, heats = jump
        old, booked = still.ledger, still.ledger.heat
        friction = tuple(one + heat for one, heat in zip(old.friction, heats, strict=True))
        for E, (_, shares) in zip(heats, per_joule, strict=False):
            booked = jax.tree.map(lambda x, share, E=E: x + E * share, booked, shares)._replace(
                supplied=booked.supplied
            )
        ledger = old._replace(lever_work=old.lever_work + work, friction=friction, heat=booked)
        return still._replace(own=own, heat=warmed(heats) if per_joule else None, ledger=ledger)

    def _heat_of_a_jump(self, t: Array, y: State, mode: Mode) -> list[tuple[Array, HeatLedger]]:
        """Increment of the network's states per joule of friction heat in a jump (K/J), and its places.

        For each pair. The heat is spread over the linings by their sizes, and through walls, as no time passes.
        """
        net, found = self.thermal, []
        assert net is not None
        now = self._network(t, y, mode)
        for pair in self.mechanism.pairs:
            share = self.weights / jnp.sum(self.weights) if pair.apart else np.ones(1)
            given = net.deposit(pair.heat, share, *now)
            found.append((net.rise_at_once(given.into), self._booked_of(pair, given)))
        return found

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

    # --- sizes --------------------------------------------------------------------------------------------------------

    def start(self, omega: Array, own: PyTree, heat: Array | None) -> State:
        """The state at the start: energies and wear are 0."""
        zero, worn = jnp.zeros_like(omega), jnp.zeros(self.mechanism.pairs[0].count)
        memory = self._of_laws(lambda pair: memory_at_start(pair.law, pair.count))
        return self._like(zero, omega, own, zero, heat, worn, memory, (zero, zero))

    def _of_laws(self, of: Callable[[Pair], PyTree]) -> tuple[PyTree, ...] | None:
        """Quantities of the states of each pair's friction law (`None`: it has none); `None` without any."""
        if not self.remembers:
            return None
        return tuple(None if pair.memory is None else of(pair) for pair in self.mechanism.pairs)

    def _like(
        self,
        phi: PyTree,
        omega: PyTree,
        own: PyTree,
        quadrature: PyTree,
        heat: PyTree,
        worn: PyTree,
        memory: PyTree,
        phase: tuple[PyTree, PyTree],
    ) -> State:
        """A tree shaped like the state, with one value for every quadrature."""
        booked = None
        if self.thermal is not None:
            booked = HeatLedger(quadrature, quadrature, quadrature, quadrature, quadrature if self._has_band else None)
        friction = tuple(quadrature for _ in self.mechanism.pairs)
        damped = quadrature if self.mechanism.damps else None
        shaft = None if self.shaft is None else tuple(quadrature for _ in self.shaft.laws)
        ledger = Ledger(quadrature, quadrature, friction, booked, damped, shaft)
        thickness = None
        if self.wearing is not None:
            thickness = tuple(worn if pair.wears else None for pair in self.mechanism.pairs)
        return State(phi, omega, own, ledger, heat, thickness, memory, PhaseState(*phase) if self.self_timed else None)

    def scales(self) -> State:
        kelvin = None if self.thermal is None else jnp.full_like(self.thermal.capacity, 100.0)
        worn = None if self.wearing is None else self.wearing.scale
        mechanism = self.mechanism
        memory = self._of_laws(lambda pair: memory_sizes(pair.law, memory_at_start(pair.law, pair.count)))
        held = jnp.inf, 1.0
        return self._like(1.0, mechanism.sizes.speed, mechanism.own_sizes(), jnp.inf, kelvin, worn, memory, held)

    def couplings(self) -> State | None:
        if self.thermal is None and not self.remembers:
            return None
        places = () if self.shaft is None else self.shaft.places
        heat = None if self.thermal is None else couplings(self.thermal.heat, places)
        own = jax.tree.map(lambda size: np.full(jnp.shape(size), CORE), self.mechanism.own_sizes())
        worn = np.full(self.mechanism.pairs[0].count, QUADRATURE)
        core, quadrature = np.asarray(CORE), np.asarray(QUADRATURE)
        others = np.concatenate([np.ravel(kind) for kind in jax.tree.leaves((core, own, heat))])
        memory = self._of_laws(couplings_of_memory(self.mechanism, others))
        # (rates depend on the begin of the phase, but that never moves)
        phase = quadrature, quadrature
        return self._like(quadrature, core, own, quadrature, heat, worn, memory, phase)

    def stored(self, t: Array, y: State, mode: Mode) -> tuple[Array, Array]:
        """Kinetic and elastic energy (J)."""
        return self.mechanism.stored(self.inertia_at(mode), y.omega, y.own, mode)


def _total(power: Array) -> Array:
    """Power of a pair: the sum over its linings, where each is known."""
    return jnp.sum(power) if jnp.ndim(power) else power


def piece_of(mode: Mode, which: int) -> Piece:
    """The piece on which a given function of time is; one without time breakpoints has only one."""
    return jnp.asarray(0, jnp.int32) if mode.pieces[which] is None else mode.pieces[which]


# --- under an elastic rope --------------------------------------------------------------------------------------------


class HookState(NamedTuple):
    """Speed of the hook downwards (m/s), and the stretch of the rope at the hook beyond that under the weight (m).

    Beyond that under the weight, so that a hook that hangs still does so exactly, whatever the rounding.
    """

    speed: Any
    excess: Any


class RopeNow(NamedTuple):
    """The rope at one instant.

    - `force` (N) on the hook;  `taut_force` (N): what it would be of a taut rope
    - `stretch` (m; below 0 it is slack by that), and its `rate` (m/s)
    - `mass` (kg) on the hook, and its `weight` (N)
    """

    force: Array
    taut_force: Array
    stretch: Array
    rate: Array
    mass: Array
    weight: Array


class BrakeUnderRope(BrakeSystem):
    """A brake under a hook on an elastic rope (`RopeElasticity`).

        F = k e + c ė,   ė = v − ω r/n,   m v̇ = m g − F,   J ω̇ = F r/n − c_d ω − Σ M_shaft − M_b

    Taut and slack are modes, in the slack one `F = 0`; `J` is without the hook, which only the rope feels. A slack rope
    has no energy: what is left of its stretch as its pull ends is heat of the damping, less what comes back where it
    pulls again before that stretch has gone.

    - `stiffness` `k` (N/m), `damping` `c` (N·s/m);  `excess` `e_0 − m g/k` (m) and `weight` `m g` (N) at the start
    """

    stiffness: Float[Array, ""] = eqx.field(kw_only=True)
    damping: Float[Array, ""] = eqx.field(kw_only=True)
    excess: Float[Array, ""] = eqx.field(kw_only=True)
    weight: Float[Array, ""] = eqx.field(kw_only=True)

    def hung(self, y: State, mode: Mode) -> tuple[State, Mode]:
        """State and mode at the start with those of hook and rope."""
        y = y._replace(hook=HookState(y.omega * self._per_radian(mode), self.excess))
        return y, mode._replace(taut=(self.rope(y, mode).stretch > 0).astype(jnp.int32))

    def _per_radian(self, mode: Mode) -> Any:
        return self.load.on_layer(mode.layer).travel()

    def rope(self, y: State, mode: Mode) -> RopeNow:
        mass, weight = map(jnp.asarray, self.load.hanging(piece_of(mode, LOAD)))  # pyright: ignore
        rate = y.hook.speed - self._per_radian(mode) * y.omega
        force = weight + (self.stiffness * y.hook.excess + self.damping * rate)
        stretch = weight / self.stiffness + y.hook.excess
        return RopeNow(jnp.where(mode.taut == 1, force, 0.0), force, stretch, rate, mass, weight)

    def stretched(self, y: State, mode: Mode) -> Array:
        """Stretch of the rope since the start (m); exactly 0 of a hook that hangs still."""
        return y.hook.excess - self.excess + (self.rope(y, mode).weight - self.weight) / self.stiffness

    # --- differences from a rigid rope ------------------------------------------------------------------------------

    def inertia_at(self, mode: Mode) -> Array:
        return self.inertia

    def load_torque(self, t: Array, omega: Array, mode: Mode, y: State | None = None) -> Array:
        """Torque of the load (N·m): with the pull of the rope in the state `y`, without a state that of the weight."""
        torque = super().load_torque(t, omega, mode)
        if y is None:
            return torque
        rope = self.rope(y, mode)
        return torque + (rope.force - rope.weight) * self._per_radian(mode)

    def variables(self, t: Array, y: State, mode: Mode) -> BrakeNow:
        return super().variables(t, y, mode)._replace(rope=self.rope(y, mode))

    def rates(self, t: Array, y: State, mode: Mode, z: BrakeNow) -> State:
        found, rope, v = super().rates(t, y, mode, z), z.rope, y.hook.speed
        ledger, heat = found.ledger, jnp.where(mode.taut == 1, self.damping * rope.rate**2, 0.0)
        ledger = ledger._replace(
            load_work=ledger.load_work + rope.weight * v - rope.force * (v - rope.rate),
            damper_heat=heat if ledger.damper_heat is None else ledger.damper_heat + heat,
        )
        return found._replace(ledger=ledger, hook=HookState((rope.weight - rope.force) / rope.mass, rope.rate))

    def margins(self, t: Array, y: State, mode: Mode, z: BrakeNow) -> BrakeGuards:
        rope = z.rope
        longer = lesser(self.stiffness * rope.stretch, rope.taut_force)
        margin = jnp.where(mode.taut == 1, rope.taut_force, -longer) / rope.weight
        return super().margins(t, y, mode, z)._replace(rope=margin)

    def change(self, now: Instant, fired: BrakeGuards, at_stop: Bool[Array, ""]) -> tuple[Mode, Array]:
        # (what the brake does answers the pull after the event of the rope)
        taut = now.mode.taut ^ fired.rope.astype(jnp.int32)
        return super().change(now._replace(mode=now.mode._replace(taut=taut)), fired, at_stop)

    def reset(self, t: Array, y: State, before: Mode, after: Mode) -> State:
        found, k, v = super().reset(t, y, before, after), self.stiffness, y.hook.speed
        old, new = self.rope(y, before), self.rope(y, after)
        pulls, still, e = _pulls(before), _pulls(after), old.stretch
        # a rope that pulls takes another weight on slowly; what hangs on the hook brings its energy
        excess = y.hook.excess - (1 - pulls) * (new.weight - old.weight) / k
        follows = new.weight / k + excess
        brought = 0.5 * (new.mass - old.mass) * v**2 + 0.5 * k * pulls * (follows**2 - e**2)
        left = 0.5 * k * (pulls - still) * follows**2
        ledger = found.ledger
        ledger = ledger._replace(load_work=ledger.load_work + brought, damper_heat=ledger.damper_heat + left)
        return found._replace(ledger=ledger, hook=HookState(v, excess))

    def stored(self, t: Array, y: State, mode: Mode) -> tuple[Array, Array]:
        kinetic, elastic = super().stored(t, y, mode)
        rope = self.rope(y, mode)
        return (
            kinetic + 0.5 * rope.mass * y.hook.speed**2,
            elastic + 0.5 * self.stiffness * _pulls(mode) * rope.stretch**2,
        )

    @property
    def jumps(self) -> bool:
        return super().jumps or self.load.added_inertia(jnp.asarray(0, jnp.int32)) is not None

    # --- sizes --------------------------------------------------------------------------------------------------------

    def _like(self, phi: PyTree, omega: PyTree, own: PyTree, quadrature: PyTree, *others: PyTree) -> State:
        found = super()._like(phi, omega, own, quadrature, *others)
        damped = found.ledger._replace(damper_heat=quadrature)
        return found._replace(ledger=damped, hook=HookState(omega, omega))

    def scales(self) -> State:
        per_radian, sizes = jnp.asarray(self.load.travel()), self.sizes
        hook = HookState(sizes.speed * per_radian, sizes.torque / (self.stiffness * per_radian))
        return super().scales()._replace(hook=hook)

    def couplings(self) -> State | None:
        found, core = super().couplings(), np.asarray(CORE)
        return None if found is None else found._replace(hook=HookState(core, core))


def _pulls(mode: Mode) -> Array:
    """1 of a taut rope, 0 of a slack one."""
    return jnp.asarray(mode.taut, jnp.float64)


def under_rope(elastic: RopeElasticity, load: AbstractLoad, piece: Piece | None) -> Callable[..., BrakeUnderRope]:
    """The system of a load on an elastic rope, which hangs still at the start; `piece` of the load at the start."""
    _, weight = load.hanging(jnp.asarray(0, jnp.int32) if piece is None else piece)  # pyright: ignore
    k = elastic.at_hook(load.line_count)  # pyright: ignore
    weight, damping = jnp.asarray(weight), jnp.asarray(elastic.damping)
    excess = jnp.zeros(()) if elastic.stretch is None else jnp.asarray(elastic.stretch) - weight / k
    return functools.partial(BrakeUnderRope, stiffness=k, damping=damping, excess=excess, weight=weight)
