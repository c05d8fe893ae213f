"""Heat of a brake: where the friction heat of its pairs enters the thermal network, and what their laws see of it."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ..hybrid import QUADRATURE
from ..hybrid._arrays import Array
from ._feature import HEAT, AbstractBrake, BrakeNow, Feature, Moment, State, ThermalNow, piece_of
from ._mechanism import OPEN, ContactState, HeatLedger, Mode, Pair
from ._shaft import Shaft
from ._sparsity import couplings
from ._thermal import Conditions, Deposit, HeatFlows, Pieces, Thermal, total

#: the network at one instant, input of its heat flows: temperatures of nodes and junctions, time, conditions at the
#: surfaces, pieces of given functions
Network = tuple[Array, Array, Array, Conditions, Pieces]


class Heating(Feature):
    """Heat of a brake: its thermal network under the friction heat of its pairs.

    - `weights` of the linings, over which the heat of a jump is spread
    """

    thermal: Thermal
    weights: Float[Array, " n"]

    # --- states: `State.heat` is given --------------------------------------------------------------------------------

    def start(self, now: Moment) -> tuple[State, Mode]:
        return self._booking(now.brake, now.y, now.y.ledger.load_work), now.mode

    def sizes(self, brake: AbstractBrake, sizes: State) -> State:
        return self._booking(brake, sizes, jnp.inf)._replace(heat=jnp.full_like(self.thermal.capacity, 100.0))

    def places(self, brake: AbstractBrake, places: State) -> State:
        shaft = brake.feature(Shaft)
        heat = couplings(self.thermal.heat, () if shaft is None else shaft.heated_places)
        return self._booking(brake, places, np.asarray(QUADRATURE))._replace(heat=heat)

    def _booking(self, brake: AbstractBrake, state: State, of_each: object) -> State:
        coolant = of_each if self.thermal.heat.jackets else None
        heat = HeatLedger(of_each, of_each, of_each, of_each, of_each if _has_band(brake) else None, coolant)
        return state._replace(ledger=state.ledger._replace(heat=heat))

    # --- at one instant -----------------------------------------------------------------------------------------------

    def network(self, now: Moment, pressures: tuple[Array, ...] | tuple[float]) -> Network:
        """The thermal network at one instant; `pressures` of the linings (Pa) in each pair."""
        brake, t, y, mode, _ = now
        around = Conditions(
            speed=jnp.abs(y.omega) * brake.track_radius,
            lining_speed=jnp.abs(brake.mechanism.lining_speed(y.own)),
            closed=jnp.where(mode.band == OPEN, 0.0, 1.0),
            pressures=pressures,
            seated=None if mode.lifted is None else 1.0 - mode.lifted.astype(jnp.float64),
        )
        T, pieces = self.thermal.temperatures(y.heat), tuple(piece_of(mode, i) for i in range(HEAT, len(mode.pieces)))
        return T, self.thermal.junctions(T, t, around, pieces), t, around, pieces

    def at_sensors(self, brake: AbstractBrake, T: Array) -> tuple[Array | None, ...]:
        """Values at the nodes on which the laws of the pairs depend."""
        values = []
        for pair in brake.mechanism.pairs:
            sensor = None if pair.heat is None else pair.heat.sensor
            values.append(None if sensor is None else self.thermal.at(T, sensor, pair.count))
        return tuple(values)

    def deposit(self, brake: AbstractBrake, pair: Pair, heat: Array, now: Network) -> Deposit:
        """Distribution of the friction heat of a pair, for that of its linings on one rim."""
        return self.thermal.deposit(pair.heat, jnp.atleast_1d(brake.of_all(heat)), *now)

    def rates_at_sensors(
        self, brake: AbstractBrake, now: Network, flows: HeatFlows, forces: tuple[Array | None, ...] | None
    ) -> tuple[Array | None, ...]:
        """Rates (K/s) of the temperatures that the laws see (`AppliedLoads.heating_rate`)."""
        into = flows.into
        if forces is not None:
            pairs = zip(brake.mechanism.pairs, forces, strict=True)
            into = total([self.deposit(brake, pair, force, now).into for pair, force in pairs if force is not None])
        return self.at_sensors(brake, self.thermal.rise(into))

    def with_friction(
        self, brake: AbstractBrake, rubs: Sequence[ContactState], now: Network, flows: HeatFlows
    ) -> ThermalNow:
        """The network with the friction heat of the pairs."""
        deposits = []
        for pair, rub in zip(brake.mechanism.pairs, rubs, strict=True):
            if jnp.ndim(rub.slip) == 0:
                # one slip speed for all linings: the mechanism has asked for the heat per unit of it
                deposit = jax.tree.map(lambda x, v=rub.slip: x * v, self.deposit(brake, pair, rub.force, now))
            else:
                power = rub.force * rub.slip
                deposit = self.deposit(brake, pair, power if pair.apart else jnp.sum(power), now)
            deposits.append(deposit)
        hot_junctions = total([now[1], *(deposit.into_junctions for deposit in deposits)])
        return ThermalNow(now[0], hot_junctions, flows, tuple(deposits))

    def surface_temperatures(self, z: BrakeNow) -> dict[str, Array]:
        """Surface temperatures (K) of rim, linings and band where the scene names them, and of what jackets wet; on
        walls reconstructed."""
        assert z.thermal is not None
        faces = dict(z.thermal.flows.faces)
        for deposit in z.thermal.deposits:
            for place, flow in deposit.faces.items():
                faces[place] = faces.get(place, 0.0) + flow
        T, T_J, heat = z.thermal.T, z.thermal.T_junctions, self.thermal.heat
        hot = {kind: self.thermal.surface(place, T, T_J, faces) for kind, place in heat.hot_places.items()}
        wetted = [self.thermal.surface(jacket.a, T, T_J, faces) for jacket in heat.jackets.values()]
        return {**hot, "wetted": jnp.concatenate(wetted)} if wetted else hot

    def rates(self, now: Moment, rates: State) -> State:
        brake, z = now.brake, now.z
        flows, deposits = z.thermal.flows, z.thermal.deposits
        into = total([flows.into, *(deposit.into for deposit in deposits)])
        pairs = zip(brake.mechanism.pairs, deposits, strict=True)
        booked: HeatLedger = jax.tree.map(lambda *parts: total(parts), *(_booked(brake, *pair) for pair in pairs))
        lost, shaft = booked.lost + flows.lost, brake.feature(Shaft)
        if shaft is not None:  # heat that enters no body
            lost = lost + total([power for place, power in shaft.powers(z.shaft, now.y.omega) if place is None])
        stream = z.thermal.coolant
        booked = booked._replace(lost=lost, supplied=flows.supplied, coolant=stream and jnp.sum(stream.heat))
        return rates._replace(ledger=rates.ledger._replace(heat=booked), heat=self.thermal.rise(into))

    # --- jumps --------------------------------------------------------------------------------------------------------

    def of_a_jump(self, brake: AbstractBrake, now: Network) -> list[tuple[Array, HeatLedger]]:
        """Increment of the network's states per joule of friction heat in a jump (K/J), and its places.

        For each pair. The heat is spread over the linings by their sizes, and through walls, as no time passes.
        """
        increments = []
        for pair in brake.mechanism.pairs:
            share = self.weights / jnp.sum(self.weights) if pair.apart else np.ones(1)
            deposit = self.thermal.deposit(pair.heat, share, *now)
            increments.append((self.thermal.rise_at_once(deposit.into), _booked(brake, pair, deposit)))
        return increments


def _has_band(brake: AbstractBrake) -> bool:
    return any(pair.on_band for pair in brake.mechanism.pairs)


def _booked(brake: AbstractBrake, pair: Pair, deposit: Deposit) -> HeatLedger:
    metal, none = deposit.to_metal, jnp.zeros_like(deposit.to_metal)
    behind = none if deposit.beyond is None else deposit.beyond
    metal, band = (behind, metal) if pair.on_band else (metal if deposit.beyond is None else metal + behind, none)
    coolant = None if deposit.coolant is None else jnp.sum(deposit.coolant)
    return HeatLedger(metal, deposit.to_linings, deposit.lost, 0.0, band if _has_band(brake) else None, coolant)
