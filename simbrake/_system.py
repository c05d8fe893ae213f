"""Where the physics of a scene couples: one system of equations with modes, guards, jumps and an energy ledger."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ._band import LiningForces, mobilised
from ._duty import AbstractLoad, AbstractProfile
from ._heat import place_count
from ._hybrid import CORE, QUADRATURE, AbstractHybridSystem
from ._modes import BandMode, Mode, Situation, moving_mode, rigid_mode, slips
from ._network import Surroundings
from ._sliding import Coefficients, Grip
from ._sparsity import couplings
from ._state import BrakeCode, Flows, HeatLedger, Ledger, State, ThermalNow
from ._thermal import Deposit, Thermal


class Slip(NamedTuple):
    """What full slip in one direction would be."""

    tension: Float[Array, ""]
    band_speed: Float[Array, ""]
    snap: Any = None  # 1 + γ
    friction: Any = None  # T_i − T_{i−1} of each lining
    deposit: Deposit | None = None  # of that heat


class Limits(NamedTuple):
    """Static limits: ratios of the linings, `Π` from the slack end upwards and downwards, whether a lining locks."""

    mu: Float[Array, " n"]
    ahead: Array
    back: Array
    locked: Bool[Array, ""]
    margin: Any = None  # 1 − max f z, where it can change


@jax.custom_jvp
def product(mu: Float[Array, " n"]) -> Float[Array, ""]:
    """`∏ μ_i` of ratios that are never 0."""
    return jnp.prod(mu)


@product.defjvp
def _(primals, tangents):
    # the general rule of jnp.prod costs n products; here no factor is 0
    (mu,), (d_mu,) = primals, tangents
    whole = jnp.prod(mu)
    return whole, whole * jnp.sum(d_mu / mu)


class BrakeSystem(AbstractHybridSystem):
    """The standard brake (model §3; Z-15…Z-18) as a hybrid system, with the thermal network where the scene has one.

        J ω̇ = M_load(t, ω) − R_b (T_n − T_0),   φ̇ = ω,   T_n = C x while the band is elastic, T_0 Π^{±1} while it slides

    Products `Π` that cannot change in the run are formed once, at assembly.
    """

    inertia: Array
    band_radius: Array
    track_radius: Array
    stiffness: Array | None
    grip: Grip
    lever: AbstractProfile
    load: AbstractLoad
    mu_static: Float[Array, " n"] | None
    locked: Bool[Array, ""]
    mu_kinetic: Float[Array, " n"] | None
    ratio_static: Float[Array, ""] | None
    ratio_kinetic: Float[Array, ""] | None
    thermal: Thermal | None
    tension_scale: Float[Array, ""]
    torque_scale: Float[Array, ""]
    speed_scale: Float[Array, ""]

    @property
    def profiles(self) -> tuple[AbstractProfile, ...]:
        """Given functions of time beside lever and load."""
        return () if self.thermal is None else self.thermal.heat.profiles

    @property
    def guard_samples(self) -> int:
        """Points inside a step at which the guards are looked at: none where the profiles hide nothing."""
        given = (self.lever, self.load.profile, *self.profiles)
        return 0 if all(profile.smooth_between for profile in given) else 15

    @property
    def codes(self) -> tuple[BrakeCode, ...]:
        """What the guards after the fourth stand for: ends of the run that heat can bring about."""
        law, found = self.grip.linings.friction, []
        if law.temperature_dependent and self.stiffness is not None:
            found.append(BrakeCode.BAND_SNAP)
        if self.grip.implicit:
            found.append(BrakeCode.FLASH_FOLD)
        if law.temperature_range() is not None:
            found.append(BrakeCode.OUTSIDE_TABLE)
        return tuple(found)

    # --- friction of the linings ---------------------------------------------------------------------------------

    def surface(self, u: Any) -> Array | None:
        """Temperatures that the linings' friction law sees."""
        if self.thermal is None or self.thermal.heat.friction is None:
            return None
        place = self.thermal.heat.friction.sensor
        assert place is not None
        return self.thermal.at(self.thermal.temperatures(u), place, self.grip.linings.count)

    def kinetic_mu(self, T_0: Array, omega: Array, u: Any, mode: Mode, back: Any) -> tuple[Float[Array, " n"], Array]:
        """Tension ratios `μ_i` of sliding linings, and the least slope of their implicit equations."""
        if self.mu_kinetic is not None:
            return self.mu_kinetic, jnp.ones(())
        found = self._kinetic(T_0, omega, u, mode, back)
        return self.grip.ratios(found.f)[0], found.slope

    def _kinetic(self, T_0: Array, omega: Array, u: Any, mode: Mode, back: Any) -> Coefficients:
        v = jnp.where(mode.sense > 0, omega, -omega) * self.band_radius
        v = jnp.broadcast_to(v, (self.grip.linings.count,))
        return self.grip.coefficients(T_0, v, self.surface(u), jnp.asarray(back), static=False)

    def coefficients(self, t: Array, y: State, mode: Mode) -> Float[Array, " n"]:
        """Coefficients of friction that the linings have when they slide."""
        T_0, _ = self._lever(t, mode)
        return self._kinetic(T_0, y.omega, y.heat, mode, mode.band == BandMode.SLIP_BACK).f

    def limits(self, T_0: Array, u: Any, mode: Mode) -> Limits:
        """Limits of the tension while the linings stick."""
        if self.mu_static is not None and self.ratio_static is not None:
            return Limits(self.mu_static, self.ratio_static, self.ratio_static, self.locked)
        still, T = jnp.zeros(self.grip.linings.count), self.surface(u)
        f = self.grip.coefficients(T_0, still, T, jnp.asarray(False), static=True).f
        mu, margin = self.grip.ratios(f)
        ahead = back = product(mu)
        if self.grip.linings.friction.pressure_dependent:
            f = self.grip.coefficients(T_0, still, T, jnp.asarray(True), static=True).f
            back = product(self.grip.ratios(f)[0])
        return Limits(mu, ahead, back, mode.locks > 0, margin)

    def _lever(self, t: Array, mode: Mode) -> tuple[Array, Array]:
        return jax.jvp(lambda t: self.lever.value(t, mode.lever_piece), (t,), (jnp.ones_like(t),))

    # --- full slip ------------------------------------------------------------------------------------------------

    def slip(self, t: Array, y: State, mode: Mode, back: Any, now: ThermalNow | None) -> Slip:
        """Full slip with the anchor end tight, or (`back`) the lever end: `T_n = T_0 Π^{±1}`, `ẋ = Ṫ_n/C`.

        The tension moves with the lever, the speed and the temperatures, which move with the heat of the slip itself:
        `ẋ = ẋ_0 + γ v_s`, `v_s = (R_b ω − ẋ_0)/(1 + γ)` (model §3).
        """
        T_0, rate = self._lever(t, mode)

        def ratio(T_0: Array, omega: Array, u: Any) -> Array:
            Pi = self.ratio_kinetic
            if Pi is None:
                Pi = product(self.kinetic_mu(T_0, omega, u, mode, back)[0])
            return jnp.where(back, 1 / Pi, Pi)

        def tension(T_0: Array, omega: Array, u: Any) -> Array:
            return T_0 * ratio(T_0, omega, u)

        friction = deposit = None
        if self.thermal is not None and now is not None:
            mu = self.kinetic_mu(T_0, y.omega, y.heat, mode, back)[0]
            along = T_0 * jnp.cumprod(jnp.where(back, 1 / mu, mu))
            friction = jnp.diff(along, prepend=T_0)
            deposit = self._deposit(t, y, mode, now, friction)
        if self.stiffness is None:
            return Slip(tension(T_0, y.omega, y.heat), jnp.zeros_like(t), None, friction, deposit)
        if self.ratio_kinetic is not None:
            Pi = ratio(T_0, y.omega, y.heat)
            return Slip(T_0 * Pi, rate * Pi / self.stiffness, None, friction, deposit)
        hot = self.grip.linings.friction.temperature_dependent and deposit is not None and now is not None
        T_n = tension(T_0, y.omega, y.heat)
        load = self.load.torque(t, y.omega, mode.load_piece)
        alpha = (load - self.band_radius * (T_n - T_0)) / self.inertia
        if not hot:
            still = None if y.heat is None else jnp.zeros_like(y.heat)
            T_n, growth = jax.jvp(tension, (T_0, y.omega, y.heat), (rate, alpha, still))
            return Slip(T_n, growth / self.stiffness, None, friction, deposit)
        point, capacity = (T_0, y.omega, y.heat), self.thermal.capacity
        growth = jax.jvp(tension, point, (rate, alpha, now.flows.into / capacity))[1] / self.stiffness
        zero = jnp.zeros_like(rate)
        gamma = jax.jvp(tension, point, (zero, zero, deposit.into / capacity))[1] / self.stiffness
        v = (self.band_radius * y.omega - growth) / jnp.where(1 + gamma > 0, 1 + gamma, 1.0)
        return Slip(T_n, growth + gamma * v, 1 + gamma, friction, deposit)

    def _deposit(self, t: Array, y: State, mode: Mode, now: ThermalNow, P: Array) -> Deposit:
        around = self._around(y, mode)
        assert self.thermal is not None
        return self.thermal.deposit(now.T, now.T_junctions, t, around, P, mode.heat_pieces)

    def _around(self, y: State, mode: Mode) -> Surroundings:
        moving = jnp.where(mode.band == BandMode.HELD, 0.0, jnp.abs(y.omega))
        return Surroundings(moving * self.track_radius, jnp.where(mode.band == BandMode.OPEN, 0.0, 1.0))

    def thermal_now(self, t: Array, y: State, mode: Mode) -> ThermalNow | None:
        """Temperatures and heat flows, friction apart."""
        if self.thermal is None:
            return None
        around, T = self._around(y, mode), self.thermal.temperatures(y.heat)
        T_J = self.thermal.junctions(T, t, around, mode.heat_pieces)
        return ThermalNow(T, T_J, self.thermal.flows(T, T_J, t, around, mode.heat_pieces), None)

    def flows(self, t: Array, y: State, mode: Mode) -> Flows:
        """Everything that acts at one instant (model §3, table of modes)."""
        band, R_b = mode.band, self.band_radius
        is_open, held, sliding = band == BandMode.OPEN, band == BandMode.HELD, slips(band)
        lever_tension, _ = self._lever(t, mode)
        T_0 = jnp.where(is_open, 0.0, lever_tension)
        load = self.load.torque(t, y.omega, mode.load_piece)
        now = self.thermal_now(t, y, mode)
        slip = self.slip(t, y, mode, band == BandMode.SLIP_BACK, now)
        speed = R_b * y.omega
        rest = jnp.where(held, T_0 + load / R_b, 0.0)
        slack = T_0
        if self.stiffness is None:
            tension, band_speed = jnp.where(sliding, slip.tension, rest), jnp.zeros_like(speed)
        else:
            take_up = band == BandMode.TAKE_UP
            carried = take_up | (band == BandMode.ELASTIC)
            stretched = self.stiffness * y.x
            tension = jnp.where(carried, stretched, jnp.where(sliding, slip.tension, rest))
            slack = jnp.where(take_up, stretched, T_0)
            band_speed = jnp.where(carried, speed, jnp.where(sliding, slip.band_speed, 0.0))
        torque = R_b * (tension - slack)
        slip_speed = jnp.where(sliding, speed - band_speed, 0.0)
        if now is not None and slip.deposit is not None:
            hot = now.T_junctions + slip.deposit.into_junctions * slip_speed
            now = now._replace(T_junctions=hot, deposit=slip.deposit)
        return Flows(
            slack_tension=slack,
            lever_tension=lever_tension,
            tight_tension=tension,
            load_torque=load,
            brake_torque=torque,
            alpha=jnp.where(held, 0.0, (load - torque) / self.inertia),
            band_speed=band_speed,
            slip_speed=slip_speed,
            snap=slip.snap,
            friction=slip.friction,
            thermal=now,
        )

    # --- what the integrator asks for -----------------------------------------------------------------------------

    def rhs(self, t, y, mode):
        q = self.flows(t, y, mode)
        moving = jnp.where(mode.band == BandMode.HELD, 0.0, y.omega)
        rates = State(
            phi=moving,
            omega=q.alpha,
            x=None if self.stiffness is None else q.band_speed,
            ledger=Ledger(
                load_work=q.load_torque * moving,
                lever_work=q.slack_tension * q.band_speed,
                friction_heat=(q.tight_tension - q.slack_tension) * q.slip_speed,
            ),
        )
        if self.thermal is None:
            return rates
        net, deposit, v = q.thermal.flows, q.thermal.deposit, q.slip_speed
        booked = HeatLedger(deposit.to_metal * v, deposit.to_linings * v, net.lost + deposit.lost * v, net.supplied)
        return rates._replace(
            ledger=rates.ledger._replace(heat=booked), heat=(net.into + deposit.into * v) / self.thermal.capacity
        )

    def guards(self, t, y, mode):
        """Guards `[motion, high, low, lever]`, then `locking` and those of `codes` where the scene has them.

        Tension differences, torque differences and speeds over a reference.
        """
        band = mode.band
        q = self.flows(t, y, mode)
        held, forward, back = band == BandMode.HELD, band == BandMode.SLIP, band == BandMode.SLIP_BACK
        fixed = (band == BandMode.OPEN) | held
        T_0, R_b = q.lever_tension, self.band_radius
        limits = self.limits(T_0, y.heat, mode)
        motion = jnp.where(fixed, 1.0, jnp.where(mode.sense > 0, y.omega, -y.omega) / self.speed_scale)
        # at rest the load torque is compared, else the tension; both against the static limits
        reference = jnp.where(held, self.torque_scale, self.tension_scale)
        high = jnp.where(held, R_b * T_0 * (limits.ahead - 1) - q.load_torque, T_0 * limits.ahead - q.tight_tension)
        low = jnp.where(held, q.load_torque + R_b * T_0 * (1 - 1 / limits.back), q.tight_tension - T_0 / limits.back)
        high, low = high / reference, low / reference
        limited = held if self.stiffness is None else held | (band == BandMode.ELASTIC)
        limited = limited & ~limits.locked
        high, low = jnp.where(limited, high, 1.0), jnp.where(limited, low, 1.0)
        if self.stiffness is not None:
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
            slope = self.kinetic_mu(q.lever_tension, y.omega, y.heat, mode, mode.band == BandMode.SLIP_BACK)[1]
            return jnp.where(slips(mode.band), slope, 1.0)
        bounds, T = self.grip.linings.friction.temperature_range(), self.surface(y.heat)
        assert bounds is not None
        assert T is not None
        return jnp.minimum(jnp.min(T) - bounds[0], bounds[1] - jnp.max(T)) / 100.0

    def _tension_of_band(self, t: Array, y: State, mode: Mode) -> Array:
        """`C x`, with the exact value where it follows from the slack tension."""
        slip = self.slip(t, y, mode, mode.band == BandMode.SLIP_BACK, None)
        return jnp.where(slips(mode.band), slip.tension, self.stiffness * y.x)

    def _next_pieces(self, t: Array, mode: Mode, at_stop: Array) -> Mode:
        def following(profile: AbstractProfile, piece: Any) -> Array:
            piece = jnp.asarray(piece, jnp.int32)
            return piece + (at_stop & (profile.next_knot(piece) <= t)).astype(jnp.int32)

        return mode._replace(
            lever_piece=following(self.lever, mode.lever_piece),
            load_piece=following(self.load.profile, mode.load_piece),
            heat_pieces=tuple(following(p, i) for p, i in zip(self.profiles, mode.heat_pieces, strict=True)),
        )

    def transition(self, t, y, mode, fired, at_stop):
        before = mode.band
        new = self._next_pieces(t, mode, at_stop)
        if mode.locks is not None:
            new = new._replace(locks=jnp.where(fired[4], 1 - mode.locks, mode.locks).astype(jnp.int32))
        T_0, rate = self._lever(t, new)
        limits = self.limits(T_0, y.heat, new)
        load = self.load.torque(t, y.omega, new.load_piece)
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

        if self.stiffness is None:
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
        T_0, rate = self._lever(t, new)
        omega, rounding = y.omega, 1e-12 * self.tension_scale
        was_slack = (old.band == BandMode.OPEN) | (old.band == BandMode.TAKE_UP)
        tension = self._tension_of_band(t, y, old)
        speed = self.band_radius * omega
        takes_up = jnp.where(rising, self.stiffness * speed < rate, tension < T_0 - rounding)
        takes_up = was_slack & (omega > 0) & takes_up & ~((old.band == BandMode.TAKE_UP) & fired[1])
        now = self.thermal_now(t, y, new)
        ahead, back = self.slip(t, y, new, False, now), self.slip(t, y, new, True, now)
        low = jnp.where(limits.locked, 0.0, T_0 / limits.back)
        high = jnp.where(limits.locked, jnp.inf, T_0 * limits.ahead)
        # the lever itself draws a slack band tight on a pulley that does not run into it
        tension = jnp.where(was_slack & (omega <= 0), jnp.maximum(tension, low), tension)
        # a band that slides stays at its kinetic limit; at rest and elastic the static one counts
        situation = Situation(
            tension=tension,
            high=jnp.where(old.band == BandMode.SLIP, jnp.minimum(high, ahead.tension), high),
            low=jnp.where(old.band == BandMode.SLIP_BACK, jnp.maximum(low, back.tension), low),
            slip_ahead=speed - ahead.band_speed,
            slip_back=speed - back.band_speed,
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
        high = self.band_radius * T_0 * (limits.ahead - 1)
        low = -self.band_radius * T_0 * (1 - 1 / limits.back)
        return jnp.where(limits.locked, -jnp.inf, low), jnp.where(limits.locked, jnp.inf, high)

    def reset(self, t, y, before, after):
        stopped = (after.band == BandMode.HELD) | ((before.band != BandMode.OPEN) & (after.sense != before.sense))
        omega = jnp.where(stopped, 0.0, y.omega)
        if self.stiffness is None:
            return y._replace(omega=omega)
        C = self.stiffness
        T_0 = jnp.where(after.band == BandMode.OPEN, 0.0, self._lever(t, after)[0])
        limits = self.limits(T_0, y.heat, after)
        low = jnp.where(limits.locked, 0.0, T_0 / limits.back)
        high = jnp.where(limits.locked, jnp.inf, T_0 * limits.ahead)
        tension = self._tension_of_band(t, y, before)
        was_slack = (before.band == BandMode.OPEN) | (before.band == BandMode.TAKE_UP)
        drawn = jnp.where(was_slack, jnp.maximum(tension, low), tension)
        new = self.slip(t, y._replace(omega=omega), after, after.band == BandMode.SLIP_BACK, None).tension
        new = jnp.where(after.band == BandMode.ELASTIC, jnp.clip(drawn, low, high), new)
        new = jnp.where(after.band == BandMode.HELD, drawn, new)
        new = jnp.where(after.band == BandMode.TAKE_UP, C * y.x, new)
        new = jnp.where(after.band == BandMode.OPEN, jnp.where(before.band == BandMode.OPEN, C * y.x, 0.0), new)
        x = new / C
        # the elongation jumps: lever work less the elastic energy gained is heat
        heat = (y.x - x) * (0.5 * C * (y.x + x) - T_0)
        ledger = y.ledger._replace(
            lever_work=y.ledger.lever_work + T_0 * (x - y.x), friction_heat=y.ledger.friction_heat + heat
        )
        return self._warmed(t, State(y.phi, omega, x, ledger, y.heat), after, heat)

    def _warmed(self, t: Array, y: State, mode: Mode, E: Array) -> State:
        """The state after the friction heat `E` (J) of a jump, spread over the linings by their angles."""
        now = self.thermal_now(t, y, mode)
        if self.thermal is None or now is None:
            return y
        angle = jnp.asarray(self.grip.linings.angle)
        given = self._deposit(t, y, mode, now, E * angle / jnp.sum(angle))
        old = y.ledger.heat
        booked = HeatLedger(
            old.to_metal + given.to_metal, old.to_linings + given.to_linings, old.lost + given.lost, old.supplied
        )
        return y._replace(heat=y.heat + given.into / self.thermal.capacity, ledger=y.ledger._replace(heat=booked))

    def next_stop(self, mode):
        found = jnp.minimum(self.lever.next_knot(mode.lever_piece), self.load.profile.next_knot(mode.load_piece))
        for profile, piece in zip(self.profiles, mode.heat_pieces, strict=True):
            found = jnp.minimum(found, profile.next_knot(piece))
        return found

    def scales(self):
        x = None if self.stiffness is None else self.tension_scale / self.stiffness
        infinity = jnp.inf
        plain = State(1.0, self.speed_scale, x, Ledger(infinity, infinity, infinity))
        if self.thermal is None:
            return plain
        kelvin = jnp.full_like(self.thermal.capacity, 100.0)
        booked = HeatLedger(infinity, infinity, infinity, infinity)
        return plain._replace(ledger=plain.ledger._replace(heat=booked), heat=kelvin)

    def couplings(self):
        if self.thermal is None:
            return None
        q, c = np.asarray(QUADRATURE), np.asarray(CORE)
        booked = Ledger(q, q, q, HeatLedger(q, q, q, q))
        return State(q, c, None if self.stiffness is None else c, booked, couplings(self.thermal.heat))

    # --- the linings one by one -----------------------------------------------------------------------------------

    def lining_forces(self, t: Array, y: State, mode: Mode) -> LiningForces:
        """Tension, friction and normal force at every lining (mobilisation rule of model §3)."""
        q = self.flows(t, y, mode)
        T_0, sliding = q.lever_tension, slips(mode.band)
        mu = self.kinetic_mu(T_0, y.omega, y.heat, mode, mode.band == BandMode.SLIP_BACK)[0]
        mu = jnp.where(sliding, mu, self.limits(T_0, y.heat, mode).mu)
        return mobilised(q.slack_tension, q.tight_tension, mu, jnp.asarray(self.grip.linings.angle))

    def lining_margins(self, t: Array, y: State, mode: Mode) -> Float[Array, " twice_n"]:
        """By how much each lining is past its static limit while the band is elastic, over the reference tension.

        The first `n` count from the slack end (`C x − T_0 Π_i`), the last `n` from the anchor for a band pulled the
        other way (`T_0 − C x ∏_{j≥i} μ_j`); −1 in every other mode.
        """
        q = self.flows(t, y, mode)
        limits = self.limits(q.lever_tension, y.heat, mode)
        ahead = q.tight_tension - q.slack_tension * jnp.cumprod(limits.mu)
        back = q.slack_tension - q.tight_tension * jnp.cumprod(limits.mu[::-1])[::-1]
        margins = jnp.concatenate([ahead, back]) / self.tension_scale
        return jnp.where((mode.band == BandMode.ELASTIC) & ~limits.locked, margins, -1.0)

    def surfaces(self, q: Flows) -> dict[str, Array]:
        """Surface temperatures (K) of rim, linings and band where the scene names them; on walls reconstructed."""
        found: dict[str, Array] = {}
        if self.thermal is None or q.thermal is None:
            return found
        net, deposit = q.thermal.flows, q.thermal.deposit
        faces = dict(net.faces)
        for place, per_speed in deposit.faces.items():
            faces[place] = faces.get(place, 0.0) + per_speed * q.slip_speed
        for kind in ("rim", "linings", "band"):
            place = getattr(self.thermal.heat, kind)
            if place is not None:
                found[kind] = self.thermal.surface(place, q.thermal.T, q.thermal.T_junctions, faces)
        return found

    @property
    def mark_names(self) -> list[tuple[str, int | None]]:
        """Marks that heat can pass, as names of events with the lining (from 1) that they concern."""
        if self.thermal is None:
            return []
        heat, n = self.thermal.heat, self.grip.linings.count
        names: list[tuple[str, int | None]] = []
        if self.grip.linings.friction.temperature_dependent:
            names.append(("grip_lost", None))
        if heat.permissible is not None and heat.linings is not None:
            per_lining = place_count(heat, heat.linings) == n and n > 1
            names += [("permissible_temperature", i + 1 if per_lining else None) for i in range(n if per_lining else 1)]
        return names

    def passing(self, q: Flows, mode: Mode, surfaces: dict[str, Array]) -> Array:
        """By how much each of `mark_names` is passed, relative to a typical size."""
        found = []
        if self.thermal is None:
            return jnp.zeros(0)
        heat = self.thermal.heat
        if self.grip.linings.friction.temperature_dependent:
            # sliding ahead, the brake no longer outweighs the load
            short = (q.load_torque - q.brake_torque) / self.torque_scale
            found.append(jnp.where((mode.band == BandMode.SLIP) & (mode.sense > 0), short, -1.0)[None])
        if heat.permissible is not None and heat.linings is not None:
            found.append((surfaces["linings"] - heat.permissible) / 100.0)
        return jnp.concatenate(found) if found else jnp.zeros(0)
