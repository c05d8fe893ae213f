"""Heat of a brake: where the friction heat of its pairs enters the thermal network, and
what their laws see of it."""

from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ..friction import SurfaceState
from ..hybrid.arrays import Array
from ..phases import Phases
from ..profiles import AbstractProfile
from ._brake import (
    BrakeAtInstant,
    BrakeNow,
    BrakeSystem,
    Feature,
    PerPair,
    State,
    numbered,
    piece_of,
)
from ._sparsity import couplings
from ._thermal import Conditions, Deposit, HeatFlows, Pieces, Stream, Thermal, total
from .mechanism import OPEN, HeatLedger, Ledger, Pair
from .shaft import Shaft

#: the network at one instant, input of its heat flows: temperatures of nodes and
#: junctions, time, conditions at the surfaces, pieces of given functions
Network = tuple[Array, Array, Array, Conditions, Pieces]


class ThermalNow(NamedTuple):
    """The thermal network at one instant."""

    T: Array  # temperatures of the nodes with capacity (K)
    T_junctions: Array  # of those without, friction heat included
    flows: HeatFlows  # friction apart
    deposits: tuple[Deposit, ...] = ()  # of the friction heat of each pair (W)
    network: Network | None = None  # while the mechanism answers

    @property
    def coolant(self) -> Stream | None:
        """Coolant of the jackets, with the friction heat that reaches it at once."""
        stream = self.flows.coolant
        if stream is None:
            return None
        return stream._replace(
            heat=total([stream.heat, *(deposit.coolant for deposit in self.deposits)])
        )


class Heating(Feature):
    """Heat of a brake: its thermal network under the friction heat of its pairs.

    - `weights` of the linings, over which the heat of a jump is spread
    """

    thermal: Thermal
    weights: Float[Array, " n"]
    sparse: ClassVar[bool] = True

    @property
    def profiles(self) -> dict[str, AbstractProfile | Phases]:
        return numbered("heat", self.thermal.heat.profiles)

    # --- states: `State.heat` is given -----------------------------------------------

    def book(self, brake: BrakeSystem, ledger: Ledger, of_each: Any) -> Ledger:
        coolant = of_each if self.thermal.heat.jackets else None
        heat = HeatLedger(
            of_each,
            of_each,
            of_each,
            of_each,
            of_each if _has_band(brake) else None,
            coolant,
        )
        return ledger._replace(heat=heat)

    def sizes(self, brake: BrakeSystem, sizes: State) -> State:
        return sizes._replace(heat=jnp.full_like(self.thermal.capacity, 100.0))

    def places(self, brake: BrakeSystem, places: State) -> State:
        shaft = brake.feature(Shaft)
        heated = (
            ()
            if shaft is None
            else tuple(law.place for law in shaft.laws if law.place is not None)
        )
        return places._replace(heat=couplings(self.thermal.heat, heated))

    # --- at one instant --------------------------------------------------------------

    def network(self, now: BrakeAtInstant) -> Network:
        """The thermal network at one instant."""
        brake, t, y, mode, _ = now
        around = Conditions(
            speed=jnp.abs(y.omega) * brake.track_radius,
            lining_speed=jnp.abs(brake.mechanism.lining_speed(y.own)),
            closed=jnp.where(mode.band == OPEN, 0.0, 1.0),
            pressures=self._pressures(now) if self.thermal.heat.pressed else (0.0,),
            seated=None
            if mode.lifted is None
            else 1.0 - mode.lifted.astype(jnp.float64),
        )
        T = self.thermal.temperatures(y.heat)
        pieces = tuple(piece_of(mode, name) for name in self.profiles)
        return T, self.thermal.junctions(T, t, around, pieces), t, around, pieces

    def _pressures(self, now: BrakeAtInstant) -> tuple[Array, ...]:
        """Pressures of the linings (Pa) in each pair; loads do not depend on how fast
        temperatures change."""
        brake, t, y, mode, _ = now
        applied, surfaces = brake.shaft_and_lever(t, y, mode)
        still = self.at_sensors(brake, jnp.zeros_like(y.heat))
        acting = brake.applied_loads(t, y, mode, applied, surfaces)._replace(
            heating_rate=lambda forces: still
        )
        z = brake.mechanism.variables(acting, y.omega, y.own, mode)
        shown = brake.mechanism.shown(
            applied.lever_tension, y.omega, y.own, mode, surfaces, z
        ).pairs
        each = zip(brake.mechanism.pairs, shown, strict=True)
        return tuple(
            jnp.zeros(()) if pair.area is None else now.normal / pair.area
            for pair, now in each
        )

    def at_sensors(self, brake: BrakeSystem, T: Array) -> tuple[Array | None, ...]:
        """Values at the nodes on which the laws of the pairs depend."""
        values = []
        for pair in brake.mechanism.pairs:
            sensor = None if pair.heat is None else pair.heat.sensor
            values.append(
                None if sensor is None else self.thermal.at(T, sensor, pair.count)
            )
        return tuple(values)

    def deposit(
        self, brake: BrakeSystem, pair: Pair, heat: Array, now: Network
    ) -> Deposit:
        """Distribution of the friction heat of a pair, for that of its linings on one
        rim."""
        return self.thermal.deposit(pair.heat, jnp.atleast_1d(brake.of_all(heat)), *now)

    def surfaces(
        self, now: BrakeAtInstant, surfaces: list[SurfaceState]
    ) -> list[SurfaceState]:
        each = zip(surfaces, sensed(now.brake, now.y.heat), strict=True)
        return [surface._replace(T=T) for surface, T in each]

    def conditions(self, now: BrakeAtInstant) -> BrakeNow:
        network = self.network(now)
        shaft = now.brake.feature(Shaft)
        flows = self.thermal.flows(
            *network, () if shaft is None else shaft.heating(now.z.shaft, now.y.omega)
        )
        return now.z._replace(thermal=ThermalNow(*network[:2], flows, network=network))

    def heating_rates(
        self,
        now: BrakeAtInstant,
        forces: tuple[Array | None, ...] | None,
        rates: PerPair,
    ) -> PerPair:
        brake = now.brake
        thermal = now.z.thermal
        into = thermal.flows.into
        if forces is not None:
            pairs = zip(brake.mechanism.pairs, forces, strict=True)
            given = [(pair, force) for pair, force in pairs if force is not None]
            into = total(
                [
                    self.deposit(brake, pair, force, thermal.network).into
                    for pair, force in given
                ]
            )
        return self.at_sensors(brake, self.thermal.rise(into))

    def variables(self, now: BrakeAtInstant) -> BrakeNow:
        """The network with the friction heat of the pairs."""
        brake = now.brake
        thermal = now.z.thermal
        deposits = []
        for pair, rub in zip(brake.mechanism.pairs, now.z.contact_states, strict=True):
            if jnp.ndim(rub.slip) == 0:
                # one slip speed for all linings: the mechanism has asked for the heat
                # per unit of it
                deposit = self.deposit(brake, pair, rub.force, thermal.network)
                deposit = jax.tree.map(lambda x, v=rub.slip: x * v, deposit)
            else:
                power = rub.force * rub.slip
                deposit = self.deposit(
                    brake,
                    pair,
                    power if pair.apart else jnp.sum(power),
                    thermal.network,
                )
            deposits.append(deposit)
        hot_junctions = total(
            [thermal.T_junctions, *(deposit.into_junctions for deposit in deposits)]
        )
        hot = thermal._replace(
            T_junctions=hot_junctions, deposits=tuple(deposits), network=None
        )
        return now.z._replace(thermal=hot)

    def surface_temperatures(self, z: BrakeNow) -> dict[str, Array]:
        """Surface temperatures (K) of rim, linings and band where the scene names them,
        and of what jackets wet; on walls reconstructed."""
        assert z.thermal is not None
        faces = dict(z.thermal.flows.faces)
        for deposit in z.thermal.deposits:
            for place, flow in deposit.faces.items():
                faces[place] = faces.get(place, 0.0) + flow
        T = z.thermal.T
        T_J = z.thermal.T_junctions
        heat = self.thermal.heat
        hot = {
            kind: self.thermal.surface(place, T, T_J, faces)
            for kind, place in heat.hot_places.items()
        }
        wetted = [
            self.thermal.surface(jacket.a, T, T_J, faces)
            for jacket in heat.jackets.values()
        ]
        return {**hot, "wetted": jnp.concatenate(wetted)} if wetted else hot

    def rates(self, now: BrakeAtInstant, rates: State) -> State:
        brake = now.brake
        z = now.z
        flows = z.thermal.flows
        deposits = z.thermal.deposits
        into = total([flows.into, *(deposit.into for deposit in deposits)])
        pairs = zip(brake.mechanism.pairs, deposits, strict=True)
        booked: HeatLedger = jax.tree.map(
            lambda *parts: total(parts), *(_booked(brake, *pair) for pair in pairs)
        )
        lost = booked.lost + flows.lost
        shaft = brake.feature(Shaft)
        if shaft is not None:  # heat that enters no body
            lost = lost + total(
                [
                    power
                    for place, power in shaft.powers(z.shaft, now.y.omega)
                    if place is None
                ]
            )
        stream = z.thermal.coolant
        booked = booked._replace(
            lost=lost, supplied=flows.supplied, coolant=stream and jnp.sum(stream.heat)
        )
        return rates._replace(
            ledger=rates.ledger._replace(heat=booked), heat=self.thermal.rise(into)
        )

    # --- jumps -----------------------------------------------------------------------

    def heat_of_jump(
        self, now: BrakeAtInstant
    ) -> Callable[[State, tuple[Array, ...]], State]:
        # the heat is spread over the linings by their sizes, and through walls, as no
        # time passes
        brake = now.brake
        network = self.network(now)
        increments = []
        for pair in brake.mechanism.pairs:
            share = self.weights / jnp.sum(self.weights) if pair.apart else np.ones(1)
            deposit = self.thermal.deposit(pair.heat, share, *network)
            # of the states per joule (K/J), and its places
            increments.append(
                (self.thermal.rise_at_once(deposit.into), _booked(brake, pair, deposit))
            )

        def heated(state: State, heats: tuple[Array, ...]) -> State:
            booked: Any = state.ledger.heat
            heat = total(
                [
                    state.heat,
                    *(E * rise for E, (rise, _) in zip(heats, increments, strict=True)),
                ]
            )
            for E, (_, shares) in zip(heats, increments, strict=True):
                booked = jax.tree.map(
                    lambda x, share, E=E: x + E * share, booked, shares
                )._replace(supplied=booked.supplied)
            return state._replace(heat=heat, ledger=state.ledger._replace(heat=booked))

        return heated


def sensed(brake: BrakeSystem, u: Array | None) -> tuple[Array | None, ...]:
    """Temperatures (K) that the law of each pair sees, (n,), for the heat contents `u`;
    `None`: there are none."""
    heat = brake.feature(Heating)
    if heat is None or u is None:
        return tuple(None for _ in brake.mechanism.pairs)
    return heat.at_sensors(brake, heat.thermal.temperatures(u))


def surface_temperatures(brake: BrakeSystem, z: BrakeNow) -> dict[str, Array]:
    """Surface temperatures (K) of rim, linings and band where the scene names them."""
    heat = brake.feature(Heating)
    return {} if heat is None else heat.surface_temperatures(z)


def thermal_of(brake: BrakeSystem) -> Thermal | None:
    """The thermal network of a brake, where the scene has one."""
    heat = brake.feature(Heating)
    return None if heat is None else heat.thermal


def _has_band(brake: BrakeSystem) -> bool:
    return any(pair.on_band for pair in brake.mechanism.pairs)


def _booked(brake: BrakeSystem, pair: Pair, deposit: Deposit) -> HeatLedger:
    metal = deposit.to_metal
    none = jnp.zeros_like(deposit.to_metal)
    behind = none if deposit.beyond is None else deposit.beyond
    metal, band = (
        (behind, metal)
        if pair.on_band
        else (metal if deposit.beyond is None else metal + behind, none)
    )
    coolant = None if deposit.coolant is None else jnp.sum(deposit.coolant)
    return HeatLedger(
        metal,
        deposit.to_linings,
        deposit.lost,
        0.0,
        band if _has_band(brake) else None,
        coolant,
    )
