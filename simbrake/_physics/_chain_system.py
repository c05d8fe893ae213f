"""The resolved chain as a hybrid system: every lining sticks or slides for itself (model §3.1)."""

import jax
import jax.numpy as jnp
from jaxtyping import Bool, Float, Int

from .._hybrid._arrays import Array
from ._acting import AbstractBrakeSystem
from ._chain import STRETCHED, TAUT, ChainFlows, ChainForces, ChainMode, ChainState
from ._modes import BandMode
from ._state import BrakeCode, HeatLedger, Ledger
from ._wearing import Pressed, Wearing

#: a lining this far past its limit (over the reference tension) breaks away together with one that fired
_PAST = 1e-10


class ChainSystem(AbstractBrakeSystem):
    """A chain of linings on a pulley (model §3.1) as a hybrid system.

    Guards, in this order: one per lining (static limit less grip while it sticks, slip speed while it slides), one per
    segment for the sign of its tension, one per segment for the sign of the elastic part of it (where the rate of
    damper heat has a kink), the `motion` of the pulley until it is at rest, and the end of the friction table, if any.
    """

    forces: ChainForces
    tension_scale: Float[Array, ""]
    torque_scale: Float[Array, ""]
    speed_scale: Float[Array, ""]
    wearing: Wearing | None = None

    @property
    def staged(self):
        return False

    @property
    def codes(self) -> tuple[BrakeCode, ...]:
        """Ends of the run for which there is a guard, the last ones."""
        return (BrakeCode.OUTSIDE_TABLE,) if self.has_tables else ()

    def rhs(self, t, y, mode):
        q = self.forces.flows(t, y, mode)
        elastic = jnp.where((mode.segments & STRETCHED) > 0, q.elastic, 0.0)
        ledger = Ledger(
            load_work=q.load_torque * y.omega,
            lever_work=q.slack_tension * q.lining_speed[0],
            friction_heat=jnp.sum(q.grip * q.lining_slip),
            damper_heat=jnp.sum((q.tension - elastic) * q.stretching),
        )
        rates = ChainState(phi=y.omega, omega=q.alpha, e=q.stretching, v=q.acceleration, ledger=ledger)
        rates = self.with_wear(rates, t, y, mode, q)
        if self.forces.thermal is None:
            return rates
        net, deposit = q.thermal.flows, q.thermal.deposit
        booked = HeatLedger(deposit.to_metal, deposit.to_linings, net.lost + deposit.lost, net.supplied)
        return rates._replace(
            ledger=ledger._replace(heat=booked), heat=self.forces.thermal.rise(net.into + deposit.into)
        )

    def pressed(self, y, mode, q):
        speed = mode.linings.astype(y.v.dtype) * q.lining_slip
        return Pressed(q.normal, speed, self.forces.surface(y.heat)), None

    def guards(self, t, y, mode):
        q = self.forces.flows(t, y, mode)
        taut = jnp.where((mode.segments & TAUT) > 0, q.total, -q.total) / self.tension_scale
        stretched = jnp.where((mode.segments & STRETCHED) > 0, q.elastic, -q.elastic) / self.tension_scale
        motion = jnp.where(mode.sense > 0, y.omega, -y.omega) / self.speed_scale
        motion = jnp.where(mode.band == BandMode.HELD, 1.0, motion)
        more = [self.table_margin(y.heat) for _ in self.codes]
        return jnp.concatenate([self._lining_guards(y, mode, q), taut, stretched, jnp.stack([motion, *more])])

    def _lining_guards(self, y: ChainState, mode: ChainMode, q: ChainFlows) -> Float[Array, " n"]:
        stuck = (self.forces.limit(y, q) - jnp.abs(q.grip)) / self.tension_scale
        slides = mode.linings.astype(y.v.dtype) * q.lining_slip / (self.forces.band_radius * self.speed_scale)
        return jnp.where(mode.linings == 0, stuck, slides)

    def transition(self, t, y, mode, fired, at_stop):
        n = mode.linings.shape[0]
        q = self.forces.flows(t, y, mode)
        linings = self._next_linings(t, y, mode, q, fired[:n])
        bits = fired[n : 3 * n].reshape(2, n).astype(jnp.int32)
        segments = mode.segments ^ (bits[0] * TAUT + bits[1] * STRETCHED)
        changed = jnp.any(linings != mode.linings)
        ahead, back = jnp.all(linings > 0), jnp.all(linings < 0)
        all_slide = ahead | back
        # at rest a pulley is held until, at a later instant, the last lining lets go
        held = mode.band == BandMode.HELD
        restarts = held & all_slide & changed
        held = (held & ~restarts) | fired[3 * n]
        band = jnp.where(ahead, BandMode.SLIP, jnp.where(back, BandMode.SLIP_BACK, BandMode.ELASTIC))
        band = jnp.where(held, BandMode.HELD, band)
        direction = jnp.where(y.omega < 0, -1, jnp.where(y.omega > 0, 1, jnp.where(back, -1, 1)))
        new = self.next_pieces(mode, at_stop)._replace(
            band=band.astype(jnp.int32),
            sense=jnp.where(restarts, direction, mode.sense).astype(jnp.int32),
            linings=linings,
            segments=segments,
        )
        code = jnp.asarray(0, jnp.int32)
        for i, failure in enumerate(self.codes, 3 * n + 1):
            code = jnp.where(fired[i], jnp.asarray(int(failure), jnp.int32), code)
        return new, code

    def _next_linings(
        self, t: Array, y: ChainState, mode: ChainMode, q: ChainFlows, fired: Bool[Array, " n"]
    ) -> Int[Array, " n"]:
        """What each lining does after those marked reached their limit or lost their slip.

        Which way a lining breaks away is the sign of the force that would have held it: at equal static and kinetic
        friction its relative acceleration is still 0. Where that force is 0 as well, as nothing presses yet, its rate
        tells. A lining that loses its slip sticks; if the force to hold it is past the limit, it goes on the other way
        by a second event at the same instant.
        """

        def grip(t: Array, y: ChainState) -> Array:
            return self.forces.flows(t, y, mode).grip

        rate = jax.jvp(grip, (t, y), (jnp.ones_like(t), self.rhs(t, y, mode)))[1]
        pulls = jnp.where(jnp.abs(q.grip) > 1e-12 * self.tension_scale, q.grip, rate)
        leaves = (mode.linings == 0) & (fired | (self._lining_guards(y, mode, q) < -_PAST))
        after = jnp.where(leaves, jnp.where(pulls > 0, 1, -1), jnp.where(fired, 0, mode.linings))
        return after.astype(jnp.int32)

    def reset(self, t, y, before, after):
        y = self.booked_change_of_load(y, before, after)
        # what sticks moves with the pulley, to the last digit
        return y._replace(v=jnp.where(after.linings == 0, self.forces.band_radius * y.omega, y.v))

    def scales(self):
        kelvin, infinity = None, jnp.inf
        if self.forces.thermal is not None:
            kelvin = jnp.full_like(self.forces.thermal.capacity, 100.0)
        booked = None if kelvin is None else HeatLedger(infinity, infinity, infinity, infinity)
        sizes = ChainState(
            phi=1.0,
            omega=self.speed_scale,
            e=self.tension_scale / self.forces.stiffness,
            v=jnp.full_like(self.forces.mass, 1.0) * self.forces.band_radius * self.speed_scale,
            ledger=Ledger(infinity, infinity, infinity, booked, damper_heat=infinity),
            heat=kelvin,
        )
        return self.with_worn(sizes)
