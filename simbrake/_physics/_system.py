"""The standard brake as a hybrid system: equations, guards, changes of mode and an energy ledger."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._hybrid import CORE, QUADRATURE
from .._hybrid._arrays import Array
from .._parts._band import piece_of, product, running_product
from ._acting import AbstractBrakeSystem
from ._forces import Forces, Limits
from ._modes import BandMode, Mode, Situation, moving_mode, rigid_mode, slips
from ._sparsity import couplings
from ._state import BrakeCode, Flows, HeatLedger, Ledger, State
from ._wearing import Pressed, Wearing

#: passes in which tension and temperature after a jump are settled; each leaves about 1e-3 of the one before it
_PASSES = 4


class BrakeSystem(AbstractBrakeSystem):
    """A brake as a hybrid system: standard (model §3; Z-15…Z-18) or staged (§4; K), with its thermal network if any.

        J ω̇ = M_load(t, ω) − R_b (T_n − T_0),   φ̇ = ω,   T_n = C x while the band is elastic, T_0 Π^{±1} while it slides

    A staged brake has a bandage between band and pulley: `J ω̇ = M_load − Λ`, `J_b ω̇_b = Λ − R_b (T_n − T_0)`, where the
    internal pair sticks (`ω = ω_b`) while `|Λ| ≤ M_int` and slides with `Λ = ± M_int`.
    """

    forces: Forces
    tension_scale: Float[Array, ""]
    torque_scale: Float[Array, ""]
    speed_scale: Float[Array, ""]
    wearing: Wearing | None = None

    @property
    def staged(self):
        return self.forces.internal is not None

    @property
    def codes(self) -> tuple[BrakeCode, ...]:
        """What the guards after the fourth stand for: ends of the run that heat can bring about."""
        found = []
        if self.forces.grip.reads.T and self.forces.stiffness is not None:
            found.append(BrakeCode.BAND_SNAP)
        if self.forces.grip.implicit:
            found.append(BrakeCode.FLASH_FOLD)
        if self.has_tables:
            found.append(BrakeCode.OUTSIDE_TABLE)
        return tuple(found)

    @property
    def _inner_guards(self) -> int:
        """Where the guards of the internal pair begin: grip or slip, one lining more at its limit, one less."""
        return 4 + self.forces.grip.varies + len(self.codes)

    def rhs(self, t, y, mode):
        q = self.forces.flows(t, y, mode)
        rests = mode.band == BandMode.HELD
        if q.inner is not None:
            rests = rests & (mode.inner == 0)
        moving = jnp.where(rests, 0.0, y.omega)
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
        if q.inner is not None:
            sliding = jnp.where(mode.inner == 0, 0.0, y.omega - y.omega_b)
            rates = rates._replace(
                ledger=rates.ledger._replace(internal_heat=q.inner.torque * sliding), omega_b=q.inner.alpha
            )
        rates = self.with_wear(rates, t, y, mode, q)
        if self.forces.thermal is None:
            return rates
        net, into, booked = q.thermal.flows, q.thermal.flows.into, self._given(q.thermal.deposit, q.slip_speed)
        into = into + q.thermal.deposit.into * q.slip_speed
        if q.inner is not None:
            inner, v = q.thermal.inner_deposit, q.inner.slip_speed
            into = into + inner.into * v
            booked = jax.tree.map(
                jnp.add, booked, HeatLedger(inner.to_metal * v, inner.to_linings * v, inner.lost * v, 0.0, 0.0 * v)
            )
        booked = booked._replace(lost=net.lost + booked.lost, supplied=net.supplied)
        return rates._replace(ledger=rates.ledger._replace(heat=booked), heat=self.forces.thermal.rise(into))

    def pressed(self, y, mode, q):
        forces, back = self.forces, mode.band == BandMode.SLIP_BACK
        # all linings slide, or none does
        mu = forces.kinetic_mu(q.lever_tension, forces.carrier_speed(y), y.heat, mode, back)[0]
        along = q.slack_tension * running_product(jnp.where(back, 1 / mu, mu))
        before = jnp.concatenate([q.slack_tension[None], along[:-1]])
        normal = (along + before) * forces.grip.sine
        outer = Pressed(normal, jnp.where(back, -q.slip_speed, q.slip_speed), forces.surface(y.heat))
        if q.inner is None:
            return outer, None
        speed = mode.inner.astype(jnp.float64) * q.inner.slip_speed
        return outer, Pressed(q.inner.normal, speed, forces.inner_surface(y.heat))

    def _given(self, deposit: Any, amount: Any) -> HeatLedger:
        """Where heat of the pair went on which the band acts."""
        to_metal, to_linings, lost = deposit.to_metal * amount, deposit.to_linings * amount, deposit.lost * amount
        if self.forces.internal is None:
            return HeatLedger(to_metal, to_linings, lost, 0.0)
        behind = jnp.zeros_like(to_metal) if deposit.beyond is None else deposit.beyond * amount
        return HeatLedger(behind, to_linings, lost, 0.0, to_metal)

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
        speed = self.forces.carrier_speed(y)
        motion = jnp.where(fixed, 1.0, jnp.where(mode.sense > 0, speed, -speed) / self.speed_scale)
        # at rest the load torque is compared, else the tension; both against the static limits
        reference = jnp.where(held, self.torque_scale, self.tension_scale)
        most, least = self.forces.drives(T_0, q.load_torque, y, mode, limits)
        high = jnp.where(held, R_b * T_0 * (limits.ahead - 1) - most, T_0 * limits.ahead - q.tight_tension)
        low = jnp.where(held, least + R_b * T_0 * (1 - 1 / limits.back), q.tight_tension - T_0 / limits.back)
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
        if q.inner is not None:
            more += self._inner_margins(y, mode, q)
        return jnp.stack([motion, high, low, lever, *more])

    def _inner_margins(self, y: State, mode: Mode, q: Flows) -> list[Array]:
        """Grip of the internal pair, or its slip; and how near a lining on the band is to coming to its limit.

        While the internal pair slides, its torque depends on the linings at their limit; the equations are smooth only
        while their number stays the same.
        """
        stuck, scale = mode.inner == 0, self.torque_scale
        slip = mode.inner.astype(jnp.float64) * (y.omega - y.omega_b) / self.speed_scale
        grip = jnp.where(stuck, (q.inner.capacity - jnp.abs(q.inner.torque)) / scale, slip)
        counted = ~stuck & ((mode.band == BandMode.ELASTIC) | (mode.band == BandMode.HELD))
        above, below = self.forces.limit_margins(q.slack_tension, q.tight_tension, y, mode)
        n = self.forces.grip.linings.count
        above = jnp.where(counted & (mode.piece < n - 1), above / self.tension_scale, 1.0)
        below = jnp.where(counted & (mode.piece > -n), below / self.tension_scale, 1.0)
        return [grip, above, below]

    def _margin(self, code: BrakeCode, t: Array, y: State, mode: Mode, q: Flows) -> Array:
        if code == BrakeCode.BAND_SNAP:
            return jnp.where(slips(mode.band), q.snap, 1.0)
        if code == BrakeCode.FLASH_FOLD:
            speed = self.forces.carrier_speed(y)
            slope = self.forces.kinetic_mu(q.lever_tension, speed, y.heat, mode, mode.band == BandMode.SLIP_BACK)[1]
            return jnp.where(slips(mode.band), slope, 1.0)
        return self.table_margin(y.heat)

    def _tension_of_band(self, t: Array, y: State, mode: Mode) -> Array:
        """`C x`, with the exact value where it follows from the slack tension."""
        return jnp.where(slips(mode.band), self.forces.sliding_tension(t, y, mode), self.forces.stiffness * y.x)

    def transition(self, t, y, mode, fired, at_stop):
        before = mode.band
        new = self.next_pieces(mode, at_stop)
        if mode.locks is not None:
            new = new._replace(locks=jnp.where(fired[4], 1 - mode.locks, mode.locks).astype(jnp.int32))
        T_0, rate = self.forces.lever_tension(t, y, new)
        limits = self.forces.limits(T_0, y.heat, new)
        load = self.forces.load.torque(t, y.omega, new.load_piece)
        rounding = 1e-12 * self.tension_scale
        rising = (jnp.abs(T_0) <= rounding) & (rate > 0)
        pulls = (rounding < T_0) | rising
        if mode.inner is not None:
            new = self._inner_transition(t, y, new, fired)
        low, high = self.holding_range(T_0, limits)
        most, least = self.forces.drives(T_0, load, y, new, limits)
        # a guard that fired has the last word over a comparison at rounding level
        held = before == BandMode.HELD
        slack = 1e-12 * self.torque_scale
        direction = jnp.where(most > high + slack, 1, jnp.where(least < low - slack, -1, 0))
        direction = jnp.where(held & fired[1], 1, jnp.where(held & fired[2], -1, direction))
        speed = self.forces.carrier_speed(y)
        # without speed in a mode of motion: it starts to move at this very instant, the way that was found
        was_open = before == BandMode.OPEN
        at_rest = held | (fired[0] & ~was_open) | ((speed == 0) & was_open)
        direction = jnp.where(at_rest, direction, jnp.where(speed == 0, mode.sense, jnp.sign(speed).astype(jnp.int32)))
        speed = jnp.where(at_rest, 0.0, speed)
        new = new._replace(sense=jnp.where(direction == 0, mode.sense, direction).astype(jnp.int32))

        if self.forces.stiffness is None:
            moving = rigid_mode(direction)
            code = jnp.where(limits.locked & pulls, int(BrakeCode.SINGULAR_GEOMETRY), 0)
        else:
            y = y._replace(omega=speed) if mode.inner is None else y._replace(omega_b=speed)
            moving, code = self._elastic_mode(t, y, mode, new, fired, direction, rising, limits), 0
        for i, failure in enumerate(self.codes, 4 + (mode.locks is not None)):
            code = jnp.where(fired[i], int(failure), code)
        after = jnp.where(at_rest & (direction == 0), BandMode.HELD, moving)
        after = jnp.where(pulls, after, BandMode.OPEN)
        new = new._replace(band=after.astype(jnp.int32))
        if mode.inner is not None:
            new = new._replace(piece=self._piece(t, y, mode, new, fired))
            code = jnp.where(limits.locked, int(BrakeCode.SINGULAR_GEOMETRY), code)
        return new, code

    def _inner_transition(self, t: Array, y: State, new: Mode, fired: Array) -> Mode:
        """Whether the internal pair sticks after the event; it slides the way the torque acts that broke it loose."""
        fires = fired[self._inner_guards]
        way = jnp.where(self.forces.flows(t, y, new).inner.torque < 0, -1, 1)
        inner = jnp.where(fires, jnp.where(new.inner == 0, way, 0), new.inner)
        return new._replace(inner=inner.astype(jnp.int32))

    def _piece(self, t: Array, y: State, before: Mode, new: Mode, fired: Array) -> Array:
        """Number of linings at their limit on the band after the event."""
        first, n, f = self._inner_guards, self.forces.grip.linings.count, self.forces
        # under a lever that only begins to pull everything is 0: take the first moment after
        T_0 = jnp.maximum(f.lever_tension(t, y, new)[0], 1e-9 * self.tension_scale)
        mu, held = f.limits(T_0, y.heat, new).mu, f.holding(y, new)
        assert f.internal is not None
        driven = f.internal.holding_piece(T_0, mu, new.inner, f.band_radius, held)
        counted = (before.band == new.band) & (before.inner == new.inner) & (before.inner != 0)
        if f.stiffness is not None:
            low, high = T_0 / product(mu), T_0 * product(mu)
            stretched = piece_of(T_0, jnp.clip(self._tension_of_band(t, y, before), low, high), mu)
            driven = jnp.where(new.band == BandMode.ELASTIC, stretched, driven)
        step = fired[first + 1].astype(jnp.int32) - fired[first + 2].astype(jnp.int32)
        piece = jnp.where(counted & (step != 0), jnp.clip(before.piece + step, -n, n - 1), driven)
        piece = jnp.where(new.band == BandMode.SLIP, n, jnp.where(new.band == BandMode.SLIP_BACK, -1 - n, piece))
        slack = (new.band == BandMode.OPEN) | (new.band == BandMode.TAKE_UP)
        return jnp.where(slack, 0, piece).astype(jnp.int32)

    def _elastic_mode(self, t, y, old, new, fired, direction, rising, limits) -> Array:
        """Mode of an elastic band on a pulley that moves or starts to."""
        assert self.forces.stiffness is not None
        T_0, rate = self.forces.lever_tension(t, y, new)
        omega, rounding = self.forces.carrier_speed(y), 1e-12 * self.tension_scale
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
        still = self.booked_change_of_load(y, before, after)
        if after.inner is None:
            still = still._replace(omega=jnp.where(stopped, 0.0, y.omega))
        else:
            sticks = after.inner == 0
            omega_b = jnp.where(stopped, 0.0, jnp.where(sticks, y.omega, y.omega_b))
            still = still._replace(omega=jnp.where(sticks & stopped, 0.0, y.omega), omega_b=omega_b)
        if self.forces.stiffness is None:
            return still
        tension, y = self._tension_of_band(t, y, before), still
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
        booked = jax.tree.map(jnp.add, y.ledger.heat, self._given(given, 1.0))
        into = thermal.rise(thermal.soaked(given.into))
        return y._replace(heat=y.heat + into, ledger=y.ledger._replace(heat=booked))

    def scales(self):
        x = None if self.forces.stiffness is None else self.tension_scale / self.forces.stiffness
        infinity = jnp.inf
        staged = self.staged
        ledger = Ledger(infinity, infinity, infinity, internal_heat=infinity if staged else None)
        plain = State(1.0, self.speed_scale, x, ledger, omega_b=self.speed_scale if staged else None)
        plain = self.with_worn(plain)
        if self.forces.thermal is None:
            return plain
        kelvin = jnp.full_like(self.forces.thermal.capacity, 100.0)
        booked = HeatLedger(infinity, infinity, infinity, infinity, infinity if staged else None)
        return plain._replace(ledger=plain.ledger._replace(heat=booked), heat=kelvin)

    def couplings(self):
        if self.forces.thermal is None:
            return None
        q, c = np.asarray(QUADRATURE), np.asarray(CORE)
        staged = self.staged
        booked = Ledger(q, q, q, HeatLedger(q, q, q, q, q if staged else None), q if staged else None)
        x, places = None if self.forces.stiffness is None else c, couplings(self.forces.thermal.heat)
        kinds = State(q, c, x, booked, places, c if staged else None)
        return self.with_worn(kinds, np.full(self.forces.grip.linings.count, QUADRATURE))
