"""The standard brake as a hybrid system: equations, guards, changes of mode and an energy ledger."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ._acting import AbstractBrakeSystem
from ._forces import Forces, Limits
from ._hybrid import CORE, QUADRATURE
from ._modes import BandMode, Mode, Situation, moving_mode, rigid_mode, slips
from ._sparsity import couplings
from ._state import BrakeCode, Flows, HeatLedger, Ledger, State

#: passes in which tension and temperature after a jump are settled; each leaves about 1e-3 of the one before it
_PASSES = 4


class BrakeSystem(AbstractBrakeSystem):
    """The standard brake (model §3; Z-15…Z-18) as a hybrid system, with the thermal network where the scene has one.

    J ω̇ = M_load(t, ω) − R_b (T_n − T_0),   φ̇ = ω,   T_n = C x while the band is elastic, T_0 Π^{±1} while it slides
    """

    forces: Forces
    tension_scale: Float[Array, ""]
    torque_scale: Float[Array, ""]
    speed_scale: Float[Array, ""]

    @property
    def codes(self) -> tuple[BrakeCode, ...]:
        """What the guards after the fourth stand for: ends of the run that heat can bring about."""
        law, found = self.forces.grip.linings.friction, []
        if law.temperature_dependent and self.forces.stiffness is not None:
            found.append(BrakeCode.BAND_SNAP)
        if self.forces.grip.implicit:
            found.append(BrakeCode.FLASH_FOLD)
        if law.temperature_range() is not None:
            found.append(BrakeCode.OUTSIDE_TABLE)
        return tuple(found)

    def rhs(self, t, y, mode):
        q = self.forces.flows(t, y, mode)
        moving = jnp.where(mode.band == BandMode.HELD, 0.0, y.omega)
        rates = State(
            phi=moving,
            omega=q.alpha,
            x=None if self.forces.stiffness is None else q.band_speed,
            ledger=Ledger(
                load_work=q.load_torque * moving,
                lever_work=q.slack_tension * q.band_speed,
                friction_heat=(q.tight_tension - q.slack_tension) * q.slip_speed,
            ),
        )
        if self.forces.thermal is None:
            return rates
        net, deposit, v = q.thermal.flows, q.thermal.deposit, q.slip_speed
        booked = HeatLedger(deposit.to_metal * v, deposit.to_linings * v, net.lost + deposit.lost * v, net.supplied)
        return rates._replace(
            ledger=rates.ledger._replace(heat=booked), heat=(net.into + deposit.into * v) / self.forces.thermal.capacity
        )

    def guards(self, t, y, mode):
        """Guards `[motion, high, low, lever]`, then `locking` and those of `codes` where the scene has them.

        Tension differences, torque differences and speeds over a reference.
        """
        band = mode.band
        q = self.forces.flows(t, y, mode)
        held, forward, back = band == BandMode.HELD, band == BandMode.SLIP, band == BandMode.SLIP_BACK
        fixed = (band == BandMode.OPEN) | held
        T_0, R_b = q.lever_tension, self.forces.band_radius
        limits = self.forces.limits(T_0, y.heat, mode)
        motion = jnp.where(fixed, 1.0, jnp.where(mode.sense > 0, y.omega, -y.omega) / self.speed_scale)
        # at rest the load torque is compared, else the tension; both against the static limits
        reference = jnp.where(held, self.torque_scale, self.tension_scale)
        high = jnp.where(held, R_b * T_0 * (limits.ahead - 1) - q.load_torque, T_0 * limits.ahead - q.tight_tension)
        low = jnp.where(held, q.load_torque + R_b * T_0 * (1 - 1 / limits.back), q.tight_tension - T_0 / limits.back)
        high, low = high / reference, low / reference
        limited = held if self.forces.stiffness is None else held | (band == BandMode.ELASTIC)
        limited = limited & ~limits.locked
        high, low = jnp.where(limited, high, 1.0), jnp.where(limited, low, 1.0)
        if self.forces.stiffness is not None:
            high = jnp.where(band == BandMode.TAKE_UP, (T_0 - q.tight_tension) / self.tension_scale, high)
            slip = q.slip_speed / (R_b * self.speed_scale)
            high, low = jnp.where(forward, slip, high), jnp.where(back, -slip, low)
        lever = jnp.where(band == BandMode.OPEN, -T_0, T_0) / self.tension_scale
        more = [] if limits.margin is None else [jnp.where(mode.locks > 0, -limits.margin, limits.margin)]
        more += [self._margin(code, t, y, mode, q) for code in self.codes]
        return jnp.stack([motion, high, low, lever, *more])

    def _margin(self, code: BrakeCode, t: Array, y: State, mode: Mode, q: Flows) -> Array:
        if code == BrakeCode.BAND_SNAP:
            return jnp.where(slips(mode.band), q.snap, 1.0)
        if code == BrakeCode.FLASH_FOLD:
            slope = self.forces.kinetic_mu(q.lever_tension, y.omega, y.heat, mode, mode.band == BandMode.SLIP_BACK)[1]
            return jnp.where(slips(mode.band), slope, 1.0)
        return self.table_margin(y.heat)

    def _tension_of_band(self, t: Array, y: State, mode: Mode) -> Array:
        """`C x`, with the exact value where it follows from the slack tension."""
        return jnp.where(slips(mode.band), self.forces.sliding_tension(t, y, mode), self.forces.stiffness * y.x)

    def transition(self, t, y, mode, fired, at_stop):
        before = mode.band
        new = self.next_pieces(t, mode, at_stop)
        if mode.locks is not None:
            new = new._replace(locks=jnp.where(fired[4], 1 - mode.locks, mode.locks).astype(jnp.int32))
        T_0, rate = self.forces.lever_tension(t, y, new)
        limits = self.forces.limits(T_0, y.heat, new)
        load = self.forces.load.torque(t, y.omega, new.load_piece)
        rounding = 1e-12 * self.tension_scale
        rising = (jnp.abs(T_0) <= rounding) & (rate > 0)
        pulls = (rounding < T_0) | rising
        low, high = self.holding_range(T_0, limits)
        # a guard that fired has the last word over a comparison at rounding level
        held = before == BandMode.HELD
        slack = 1e-12 * self.torque_scale
        direction = jnp.where(load > high + slack, 1, jnp.where(load < low - slack, -1, 0))
        direction = jnp.where(held & fired[1], 1, jnp.where(held & fired[2], -1, direction))
        at_rest = held | (fired[0] & (before != BandMode.OPEN)) | (y.omega == 0)
        direction = jnp.where(at_rest, direction, jnp.where(y.omega > 0, 1, -1))
        omega = jnp.where(at_rest, 0.0, y.omega)
        new = new._replace(sense=jnp.where(direction == 0, mode.sense, direction).astype(jnp.int32))

        if self.forces.stiffness is None:
            moving = rigid_mode(direction)
            code = jnp.where(limits.locked & pulls, int(BrakeCode.SINGULAR_GEOMETRY), 0)
        else:
            y = y._replace(omega=omega)
            moving, code = self._elastic_mode(t, y, mode, new, fired, direction, rising, limits), 0
        for i, failure in enumerate(self.codes, 4 + (mode.locks is not None)):
            code = jnp.where(fired[i], int(failure), code)
        after = jnp.where(at_rest & (direction == 0), BandMode.HELD, moving)
        after = jnp.where(pulls, after, BandMode.OPEN)
        return new._replace(band=after.astype(jnp.int32)), code

    def _elastic_mode(self, t, y, old, new, fired, direction, rising, limits) -> Array:
        """Mode of an elastic band on a pulley that moves or starts to."""
        T_0, rate = self.forces.lever_tension(t, y, new)
        omega, rounding = y.omega, 1e-12 * self.tension_scale
        was_slack = (old.band == BandMode.OPEN) | (old.band == BandMode.TAKE_UP)
        tension = self._tension_of_band(t, y, old)
        speed = self.forces.band_radius * omega
        takes_up = jnp.where(rising, self.forces.stiffness * speed < rate, tension < T_0 - rounding)
        takes_up = was_slack & (omega > 0) & takes_up & ~((old.band == BandMode.TAKE_UP) & fired[1])
        now = self.forces.thermal_now(t, y, new)
        both = jax.vmap(lambda back: self.forces.slip(t, y, new, back, now)[:2])(jnp.asarray([False, True]))
        (tension_ahead, tension_back), (speed_ahead, speed_back) = both
        low = jnp.where(limits.locked, 0.0, T_0 / limits.back)
        high = jnp.where(limits.locked, jnp.inf, T_0 * limits.ahead)
        # the lever itself draws a slack band tight on a pulley that does not run into it
        tension = jnp.where(was_slack & (omega <= 0), jnp.maximum(tension, low), tension)
        # late in a run the known times themselves are rounded
        steepest = jnp.maximum(jnp.abs(rate), jnp.abs(self.forces.lever_tension(t, y, old)[1]))
        rounding = rounding + 1e-15 * jnp.abs(t) * steepest * jnp.where(limits.locked, 1.0, limits.ahead)
        # a band that slides stays at its kinetic limit; at rest and elastic the static one counts
        situation = Situation(
            tension=tension,
            high=jnp.where(old.band == BandMode.SLIP, jnp.minimum(high, tension_ahead), high),
            low=jnp.where(old.band == BandMode.SLIP_BACK, jnp.maximum(low, tension_back), low),
            slip_ahead=speed - speed_ahead,
            slip_back=speed - speed_back,
            tolerance=rounding,
        )
        mode = moving_mode(situation, direction)
        mode = jnp.where((old.band == BandMode.ELASTIC) & fired[1], BandMode.SLIP, mode)
        mode = jnp.where((old.band == BandMode.ELASTIC) & fired[2], BandMode.SLIP_BACK, mode)
        sticks = ((old.band == BandMode.SLIP) & fired[1]) | ((old.band == BandMode.SLIP_BACK) & fired[2])
        mode = jnp.where(sticks, BandMode.ELASTIC, mode)
        return jnp.where(takes_up, BandMode.TAKE_UP, mode)

    def holding_range(self, T_0: Array, limits: Limits) -> tuple[Array, Array]:
        """Load torques between which the static limit holds the pulley at rest (N·m)."""
        high = self.forces.band_radius * T_0 * (limits.ahead - 1)
        low = -self.forces.band_radius * T_0 * (1 - 1 / limits.back)
        return jnp.where(limits.locked, -jnp.inf, low), jnp.where(limits.locked, jnp.inf, high)

    def reset(self, t, y, before, after):
        stopped = (after.band == BandMode.HELD) | ((before.band != BandMode.OPEN) & (after.sense != before.sense))
        omega = jnp.where(stopped, 0.0, y.omega)
        y = self.booked_change_of_load(y, before, after)
        if self.forces.stiffness is None:
            return y._replace(omega=omega)
        tension, y = self._tension_of_band(t, y, before), y._replace(omega=omega)
        if self.forces.thermal is None:
            return self._booked(y, *self._stretched(t, y, tension, before, after))

        # the heat of the jump warms the linings, on which the tension after it depends: settled in a few passes
        def settle(warm: State, _: None) -> tuple[State, tuple[Array, Array, Array]]:
            jump = self._stretched(t, warm, tension, before, after)
            return self._warmed(t, y, after, jump[2]), jump

        warm, jumps = jax.lax.scan(settle, y, None, length=_PASSES if self.forces.grip.varies else 1)
        return self._booked(warm, *(each[-1] for each in jumps))

    def _stretched(self, t: Array, y: State, tension: Array, before: Mode, after: Mode) -> tuple[Array, Array, Array]:
        """Elongation after a change of mode from the tension before it, lever work, and the heat that it sets free."""
        C = self.forces.stiffness
        assert C is not None
        T_0 = jnp.where(after.band == BandMode.OPEN, 0.0, self.forces.lever_tension(t, y, after)[0])
        limits = self.forces.limits(T_0, y.heat, after)
        low = jnp.where(limits.locked, 0.0, T_0 / limits.back)
        high = jnp.where(limits.locked, jnp.inf, T_0 * limits.ahead)
        was_slack = (before.band == BandMode.OPEN) | (before.band == BandMode.TAKE_UP)
        drawn = jnp.where(was_slack, jnp.maximum(tension, low), tension)
        new = self.forces.sliding_tension(t, y, after)
        new = jnp.where(after.band == BandMode.ELASTIC, jnp.clip(drawn, low, high), new)
        new = jnp.where(after.band == BandMode.HELD, drawn, new)
        new = jnp.where(after.band == BandMode.TAKE_UP, C * y.x, new)
        new = jnp.where(after.band == BandMode.OPEN, jnp.where(before.band == BandMode.OPEN, C * y.x, 0.0), new)
        x = new / C
        return x, T_0 * (x - y.x), (y.x - x) * (0.5 * C * (y.x + x) - T_0)

    def _booked(self, y: State, x: Array, work: Array, heat: Array) -> State:
        old = y.ledger
        ledger = old._replace(lever_work=old.lever_work + work, friction_heat=old.friction_heat + heat)
        return y._replace(x=x, ledger=ledger)

    def _warmed(self, t: Array, y: State, mode: Mode, E: Array) -> State:
        """The state after the friction heat `E` (J) of a jump, spread over the linings by their angles."""
        now, thermal = self.forces.thermal_now(t, y, mode), self.forces.thermal
        assert thermal is not None
        assert now is not None
        angle = jnp.asarray(self.forces.grip.linings.angle)
        given = self.forces.deposit(t, y, mode, now, E * angle / jnp.sum(angle))
        old = y.ledger.heat
        booked = old._replace(
            to_metal=old.to_metal + given.to_metal,
            to_linings=old.to_linings + given.to_linings,
            lost=old.lost + given.lost,
        )
        into = thermal.soaked(given.into) / thermal.capacity
        return y._replace(heat=y.heat + into, ledger=y.ledger._replace(heat=booked))

    def scales(self):
        x = None if self.forces.stiffness is None else self.tension_scale / self.forces.stiffness
        infinity = jnp.inf
        plain = State(1.0, self.speed_scale, x, Ledger(infinity, infinity, infinity))
        if self.forces.thermal is None:
            return plain
        kelvin = jnp.full_like(self.forces.thermal.capacity, 100.0)
        booked = HeatLedger(infinity, infinity, infinity, infinity)
        return plain._replace(ledger=plain.ledger._replace(heat=booked), heat=kelvin)

    def couplings(self):
        if self.forces.thermal is None:
            return None
        q, c = np.asarray(QUADRATURE), np.asarray(CORE)
        booked = Ledger(q, q, q, HeatLedger(q, q, q, q))
        return State(q, c, None if self.forces.stiffness is None else c, booked, couplings(self.forces.thermal.heat))
