"""What contact_states leaves on the linings: wear, and states of friction laws; and the ends
of tables of friction."""

import functools
from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, PyTree

from ..friction import SurfaceState, memory_at_start, memory_sizes
from ..hybrid import QUADRATURE, smallest
from ..hybrid.arrays import Array
from ._brake import BrakeAtInstant, BrakeGuards, BrakeSystem, Feature, State
from ._sparsity import couplings_of_memory
from .heated import sensed
from .mechanism import OPEN, BrakeCode, Mode


class Wearing(Feature):
    """Integration of the wear depth of the linings: no rate depends on it, it is a
    quadrature.

    - `scale` (m): typical thickness that the run wears off
    - `turned_at`: times at which the band is turned end for end (of a duty in phases:
      numbers of phases that have ended). `h_i` of the first pair stays that of the
      lining which was the `i`-th at the start; after an odd number of turns it rubs
      where the `(n + 1 − i)`-th did
    """

    scale: Float[Array, ""]
    turned_at: Array | None

    def _of_pairs(self, brake: BrakeSystem, state: State, thickness: PyTree) -> State:
        return state._replace(
            worn=tuple(
                thickness if pair.wears else None for pair in brake.mechanism.pairs
            )
        )

    def start(self, now: BrakeAtInstant) -> tuple[State, Mode]:
        return self._of_pairs(
            now.brake, now.y, jnp.zeros(now.brake.mechanism.pairs[0].count)
        ), now.mode

    def sizes(self, brake: BrakeSystem, sizes: State) -> State:
        return self._of_pairs(brake, sizes, self.scale)

    def places(self, brake: BrakeSystem, places: State) -> State:
        return self._of_pairs(
            brake, places, np.full(brake.mechanism.pairs[0].count, QUADRATURE)
        )

    def rates(self, now: BrakeAtInstant, rates: State) -> State:
        """Rates of wear (m/s) of the linings as they were counted at the start."""
        passed = now.t if now.mode.phase is None else now.mode.phase.astype(jnp.float64)
        pairs = zip(
            now.brake.mechanism.pairs,
            now.z.contact_states,
            sensed(now.brake, now.y.heat),
            strict=True,
        )
        first, *others = (pair.wear_rate(rub, T) for pair, rub, T in pairs)
        if self.turned_at is not None and first is not None:
            turns = jnp.sum(jnp.asarray(passed) >= self.turned_at)
            first = jnp.where(turns % 2 == 1, first[::-1], first)
        return rates._replace(worn=(first, *others))


class Memory(Feature):
    """The states of the friction laws of the pairs, of those that have any."""

    sparse: ClassVar[bool] = True

    def surfaces(
        self, now: BrakeAtInstant, surfaces: list[SurfaceState]
    ) -> list[SurfaceState]:
        each = zip(surfaces, now.y.memory, strict=True)
        return [surface._replace(memory=memory) for surface, memory in each]

    def start(self, now: BrakeAtInstant) -> tuple[State, Mode]:
        pairs = now.brake.mechanism.pairs
        memory = tuple(
            None if pair.memory is None else memory_at_start(pair.law, pair.count)
            for pair in pairs
        )
        return now.y._replace(memory=memory), now.mode

    def sizes(self, brake: BrakeSystem, sizes: State) -> State:
        pairs = brake.mechanism.pairs
        memory = (
            None
            if p.memory is None
            else memory_sizes(p.law, memory_at_start(p.law, p.count))
            for p in pairs
        )
        return sizes._replace(memory=tuple(memory))

    def places(self, brake: BrakeSystem, places: State) -> State:
        others = np.concatenate(
            [
                np.ravel(place)
                for place in jax.tree.leaves((places.omega, places.own, places.heat))
            ]
        )
        of_pair = couplings_of_memory(brake.mechanism, others)
        memory = (
            None if pair.memory is None else of_pair(pair)
            for pair in brake.mechanism.pairs
        )
        return places._replace(memory=tuple(memory))

    def rates(self, now: BrakeAtInstant, rates: State) -> State:
        brake, t, y, mode, z = now
        mechanism = brake.mechanism
        surfaces = brake.surfaces(t, y, mode)
        memory = list[PyTree]()
        for i, (pair, rub, surface) in enumerate(
            zip(mechanism.pairs, z.contact_states, surfaces, strict=True)
        ):
            if pair.memory is None or surface is None:
                memory.append(None)
                continue
            v = rub.sense * rub.slip
            power = rub.force * rub.slip
            normal = rub.normal
            # the pair on which the lever acts may be open, and sticking linings share
            # its load by a rule
            if i == 0:
                v = jnp.where(mode.band == OPEN, 0.0, v)
                power = jnp.where(mode.band == OPEN, 0.0, power)
                if pair.memory.p:
                    shown = mechanism.shown(
                        z.lever_tension, y.omega, y.own, mode, surfaces, z.contact
                    )
                    normal = jnp.where(rub.sense == 0, shown.pairs[0].normal, normal)
            memory.append(pair.memory_rates(surface, v, normal, power))
        return rates._replace(memory=tuple(memory))


class FrictionTables(Feature):
    """Laws of friction that hold between two temperatures: a run ends where a lining
    leaves them."""

    def margins(self, now: BrakeAtInstant, guards: BrakeGuards) -> BrakeGuards:
        """Margin of the temperatures to the ends of the tables, over 100 K."""
        room = []
        for pair, T in zip(
            now.brake.mechanism.pairs, sensed(now.brake, now.y.heat), strict=True
        ):
            bounds = pair.law.temperature_range()
            if bounds is not None and T is not None:
                room.append(
                    jnp.minimum(smallest(T - bounds[0]), smallest(bounds[1] - T))
                    / 100.0
                )
        return guards._replace(friction_table=functools.reduce(jnp.minimum, room))

    def limits(self, mode: Mode, limits: BrakeGuards) -> BrakeGuards:
        return limits._replace(friction_table=np.True_)

    def after(
        self, now: BrakeAtInstant, new: Mode, fired: BrakeGuards, code: Array
    ) -> tuple[Mode, Array]:
        return new, jnp.where(fired.friction_table, int(BrakeCode.OUTSIDE_TABLE), code)
