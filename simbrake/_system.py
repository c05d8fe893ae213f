"""Where the physics of a scene couples: one system of equations with modes, guards, jumps and an energy ledger."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ._band import LiningForces, grip, mobilised, tension_ratio
from ._design import Lining
from ._duty import AbstractLoad, AbstractProfile
from ._friction import Contact
from ._hybrid import AbstractHybridSystem
from ._modes import BandMode, Mode, Situation, moving_mode, rigid_mode, slips
from ._scene import Scene
from ._state import BrakeCode, Flows, Ledger, State


class Slip(NamedTuple):
    """What full slip in one direction would be."""

    tension: Float[Array, ""]
    band_speed: Float[Array, ""]


@jax.custom_jvp
def _product(mu: Float[Array, " n"]) -> Float[Array, ""]:
    return jnp.prod(mu)


@_product.defjvp
def _(primals, tangents):
    # the general rule of jnp.prod costs n products; here no factor is 0
    (mu,), (d_mu,) = primals, tangents
    product = jnp.prod(mu)
    return product, product * jnp.sum(d_mu / mu)


class BrakeSystem(AbstractHybridSystem):
    """The standard brake (model §3; Z-15…Z-18) as a hybrid system.

        J ω̇ = M_load(t, ω) − R_b (T_n − T_0),   φ̇ = ω,   T_n = C x while the band is elastic, T_0 Π^{±1} while it slides

    Products `Π` that cannot change in the run are formed once, here.
    """

    inertia: Array
    band_radius: Array
    stiffness: Array | None
    linings: Lining
    lever: AbstractProfile
    load: AbstractLoad
    mu_static: Float[Array, " n"]
    locked: Bool[Array, ""]
    mu_kinetic: Float[Array, " n"] | None
    ratio_static: Float[Array, ""]
    ratio_kinetic: Float[Array, ""] | None
    tension_scale: Float[Array, ""]
    torque_scale: Float[Array, ""]
    speed_scale: Float[Array, ""]

    @property
    def guard_samples(self) -> int:
        """Points inside a step at which the guards are looked at: none where the profiles hide nothing."""
        return 0 if self.lever.smooth_between and self.load.profile.smooth_between else 15

    def kinetic_mu(self, omega: Array, sense: Array) -> Float[Array, " n"]:
        """Tension ratios `μ_i` of sliding linings at the speed `ω`."""
        if self.mu_kinetic is not None:
            return self.mu_kinetic
        v = jnp.broadcast_to(jnp.where(sense > 0, omega, -omega) * self.band_radius, self.mu_static.shape)
        return tension_ratio(grip(self.linings.friction.kinetic(Contact(v=v)), jnp.asarray(self.linings.angle)))[0]

    def _lever(self, t: Array, mode: Mode) -> tuple[Array, Array]:
        return jax.jvp(lambda t: self.lever.value(t, mode.lever_piece), (t,), (jnp.ones_like(t),))

    def slip(self, t: Array, omega: Array, mode: Mode, back: Any) -> Slip:
        """Full slip with the anchor end tight, or (`back`) the lever end: `T_n = T_0 Π^{±1}`, `ẋ = Ṫ_n/C`."""
        T_0, rate = self._lever(t, mode)

        def ratio(omega: Array) -> Array:
            product = self.ratio_kinetic
            if product is None:
                product = _product(self.kinetic_mu(omega, mode.sense))
            return jnp.where(back, 1 / product, product)

        if self.ratio_kinetic is not None:
            Pi, slope = ratio(omega), None
        else:
            Pi, slope = jax.jvp(ratio, (omega,), (jnp.ones_like(omega),))
        tension = T_0 * Pi
        if self.stiffness is None:
            return Slip(tension, jnp.zeros_like(t))
        growth = rate * Pi
        if slope is not None:
            load = self.load.torque(t, omega, mode.load_piece)
            growth = growth + T_0 * slope * (load - self.band_radius * (tension - T_0)) / self.inertia
        return Slip(tension, growth / self.stiffness)

    def flows(self, t: Array, y: State, mode: Mode) -> Flows:
        """Everything that acts at one instant (model §3, table of modes)."""
        band, R_b = mode.band, self.band_radius
        is_open, held, sliding = band == BandMode.OPEN, band == BandMode.HELD, slips(band)
        lever_tension, _ = self._lever(t, mode)
        T_0 = jnp.where(is_open, 0.0, lever_tension)
        load = self.load.torque(t, y.omega, mode.load_piece)
        slip = self.slip(t, y.omega, mode, band == BandMode.SLIP_BACK)
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
        return Flows(
            slack_tension=slack,
            lever_tension=lever_tension,
            tight_tension=tension,
            load_torque=load,
            brake_torque=torque,
            alpha=jnp.where(held, 0.0, (load - torque) / self.inertia),
            band_speed=band_speed,
            slip_speed=jnp.where(sliding, speed - band_speed, 0.0),
        )

    def rhs(self, t, y, mode):
        q = self.flows(t, y, mode)
        moving = jnp.where(mode.band == BandMode.HELD, 0.0, y.omega)
        return State(
            phi=moving,
            omega=q.alpha,
            x=None if self.stiffness is None else q.band_speed,
            ledger=Ledger(
                load_work=q.load_torque * moving,
                lever_work=q.slack_tension * q.band_speed,
                friction_heat=(q.tight_tension - q.slack_tension) * q.slip_speed,
            ),
        )

    def holding_range(self, T_0: Array) -> tuple[Array, Array]:
        """Load torques between which the static limit holds the pulley at rest (N·m)."""
        high = self.band_radius * T_0 * (self.ratio_static - 1)
        low = -self.band_radius * T_0 * (1 - 1 / self.ratio_static)
        return jnp.where(self.locked, -jnp.inf, low), jnp.where(self.locked, jnp.inf, high)

    def guards(self, t, y, mode):
        """Guards `[motion, high, low, lever]`: tension differences, torque differences and speeds over a reference."""
        band = mode.band
        q = self.flows(t, y, mode)
        held, forward, back = band == BandMode.HELD, band == BandMode.SLIP, band == BandMode.SLIP_BACK
        fixed = (band == BandMode.OPEN) | held
        T_0, Pi, R_b = q.lever_tension, self.ratio_static, self.band_radius
        motion = jnp.where(fixed, 1.0, jnp.where(mode.sense > 0, y.omega, -y.omega) / self.speed_scale)
        # at rest the load torque is compared, else the tension; both against the static limits
        reference = jnp.where(held, self.torque_scale, self.tension_scale)
        high = jnp.where(held, R_b * T_0 * (Pi - 1) - q.load_torque, T_0 * Pi - q.tight_tension) / reference
        low = jnp.where(held, q.load_torque + R_b * T_0 * (1 - 1 / Pi), q.tight_tension - T_0 / Pi) / reference
        limited = held if self.stiffness is None else held | (band == BandMode.ELASTIC)
        limited = limited & ~self.locked
        high, low = jnp.where(limited, high, 1.0), jnp.where(limited, low, 1.0)
        if self.stiffness is not None:
            high = jnp.where(band == BandMode.TAKE_UP, (T_0 - q.tight_tension) / self.tension_scale, high)
            slip = q.slip_speed / (R_b * self.speed_scale)
            high, low = jnp.where(forward, slip, high), jnp.where(back, -slip, low)
        lever = jnp.where(band == BandMode.OPEN, -T_0, T_0) / self.tension_scale
        return jnp.stack([motion, high, low, lever])

    def _tension_of_band(self, t: Array, y: State, mode: Mode) -> Array:
        """`C x`, with the exact value where it follows from the slack tension."""
        slip = self.slip(t, y.omega, mode, mode.band == BandMode.SLIP_BACK)
        return jnp.where(slips(mode.band), slip.tension, self.stiffness * y.x)

    def _next_pieces(self, t: Array, mode: Mode, at_stop: Array) -> Mode:
        lever = jnp.asarray(mode.lever_piece, jnp.int32)
        load = jnp.asarray(mode.load_piece, jnp.int32)
        lever = lever + (at_stop & (self.lever.next_knot(lever) <= t)).astype(jnp.int32)
        load = load + (at_stop & (self.load.profile.next_knot(load) <= t)).astype(jnp.int32)
        return mode._replace(lever_piece=lever, load_piece=load)

    def transition(self, t, y, mode, fired, at_stop):
        before = mode.band
        new = self._next_pieces(t, mode, at_stop)
        T_0, rate = self._lever(t, new)
        load = self.load.torque(t, y.omega, new.load_piece)
        rounding = 1e-12 * self.tension_scale
        rising = (jnp.abs(T_0) <= rounding) & (rate > 0)
        pulls = (rounding < T_0) | rising
        low, high = self.holding_range(T_0)
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
            code = jnp.where(self.locked & pulls, int(BrakeCode.SINGULAR_GEOMETRY), 0)
        else:
            moving, code = self._elastic_mode(t, y, mode, new, fired, omega, direction, rising), 0
        after = jnp.where(at_rest & (direction == 0), BandMode.HELD, moving)
        after = jnp.where(pulls, after, BandMode.OPEN)
        return new._replace(band=after.astype(jnp.int32)), code

    def _elastic_mode(self, t, y, old, new, fired, omega, direction, rising) -> Array:
        """Mode of an elastic band on a pulley that moves or starts to."""
        T_0, rate = self._lever(t, new)
        rounding = 1e-12 * self.tension_scale
        was_slack = (old.band == BandMode.OPEN) | (old.band == BandMode.TAKE_UP)
        tension = self._tension_of_band(t, y, old)
        speed = self.band_radius * omega
        takes_up = jnp.where(rising, self.stiffness * speed < rate, tension < T_0 - rounding)
        takes_up = was_slack & (omega > 0) & takes_up & ~((old.band == BandMode.TAKE_UP) & fired[1])
        ahead, back = self.slip(t, omega, new, False), self.slip(t, omega, new, True)
        low = jnp.where(self.locked, 0.0, T_0 / self.ratio_static)
        high = jnp.where(self.locked, jnp.inf, T_0 * self.ratio_static)
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

    def reset(self, t, y, before, after):
        stopped = (after.band == BandMode.HELD) | ((before.band != BandMode.OPEN) & (after.sense != before.sense))
        omega = jnp.where(stopped, 0.0, y.omega)
        if self.stiffness is None:
            return y._replace(omega=omega)
        C = self.stiffness
        T_0 = jnp.where(after.band == BandMode.OPEN, 0.0, self._lever(t, after)[0])
        low = jnp.where(self.locked, 0.0, T_0 / self.ratio_static)
        high = jnp.where(self.locked, jnp.inf, T_0 * self.ratio_static)
        tension = self._tension_of_band(t, y, before)
        was_slack = (before.band == BandMode.OPEN) | (before.band == BandMode.TAKE_UP)
        drawn = jnp.where(was_slack, jnp.maximum(tension, low), tension)
        new = self.slip(t, omega, after, after.band == BandMode.SLIP_BACK).tension
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
        return State(y.phi, omega, x, ledger)

    def next_stop(self, mode):
        return jnp.minimum(self.lever.next_knot(mode.lever_piece), self.load.profile.next_knot(mode.load_piece))

    def scales(self):
        x = None if self.stiffness is None else self.tension_scale / self.stiffness
        infinity = jnp.inf
        return State(1.0, self.speed_scale, x, Ledger(infinity, infinity, infinity))

    def lining_forces(self, t: Array, y: State, mode: Mode) -> LiningForces:
        """Tension, friction and normal force at every lining (mobilisation rule of model §3)."""
        q = self.flows(t, y, mode)
        sliding = slips(mode.band)
        mu = jnp.where(sliding, self.kinetic_mu(y.omega, mode.sense), self.mu_static)
        return mobilised(q.slack_tension, q.tight_tension, mu, jnp.asarray(self.linings.angle))

    def lining_margins(self, t: Array, y: State, mode: Mode) -> Float[Array, " twice_n"]:
        """By how much each lining is past its static limit while the band is elastic, over the reference tension.

        The first `n` count from the slack end (`C x − T_0 Π_i`), the last `n` from the anchor for a band pulled the
        other way (`T_0 − C x ∏_{j≥i} μ_j`); −1 in every other mode.
        """
        q = self.flows(t, y, mode)
        ahead = q.tight_tension - q.slack_tension * jnp.cumprod(self.mu_static)
        back = q.slack_tension - q.tight_tension * jnp.cumprod(self.mu_static[::-1])[::-1]
        margins = jnp.concatenate([ahead, back]) / self.tension_scale
        return jnp.where((mode.band == BandMode.ELASTIC) & ~self.locked, margins, -1.0)


def assemble(scene: Scene) -> tuple[BrakeSystem, State, Mode]:
    """System, initial state and initial mode of a scene. The run settles the true first mode itself, as an event."""
    brake, duty, initial = scene.brake, scene.duty, scene.initial
    linings = brake.linings
    angle = jnp.asarray(linings.angle)
    still = Contact(v=jnp.zeros(angle.shape))
    law = linings.friction
    mu_static, locks = tension_ratio(grip(law.static(still), angle))
    mu_kinetic = None if law.speed_dependent else tension_ratio(grip(law.kinetic(still), angle))[0]
    ratio_static = _product(mu_static)
    R_b = jnp.asarray(brake.band.radius)
    J = jnp.asarray(brake.pulley.inertia) + duty.load.inertia()
    t_0, omega_0 = jnp.asarray(initial.time), jnp.asarray(initial.omega)
    lever_piece, load_piece = duty.slack_tension.first_piece(t_0), duty.load.profile.first_piece(t_0)

    def positive(x: Array) -> Array:
        return jax.lax.stop_gradient(jnp.where(x > 0, x, 1.0))

    tension_scale = positive(duty.slack_tension.scale())
    capacity = R_b * tension_scale * (ratio_static - 1)
    load_0 = jnp.abs(duty.load.torque(t_0, omega_0, jnp.asarray(load_piece, jnp.int32)))
    torque_scale = positive(jnp.maximum(capacity, jnp.maximum(load_0, duty.load.profile.scale())))
    # from rest: the speed that the largest torque could give in the run, 1 rad/s at most
    reach = jnp.minimum(torque_scale / J * (jnp.asarray(scene.end_time) - t_0), 1.0)
    speed_scale = positive(jnp.where(omega_0 == 0, reach, jnp.abs(omega_0)))
    stiffness = None if brake.band.stiffness is None else jnp.asarray(brake.band.stiffness)
    system = BrakeSystem(
        inertia=J,
        band_radius=R_b,
        stiffness=stiffness,
        linings=linings,
        lever=duty.slack_tension,
        load=duty.load,
        mu_static=mu_static,
        locked=jnp.any(locks),
        mu_kinetic=mu_kinetic,
        ratio_static=ratio_static,
        ratio_kinetic=None if mu_kinetic is None else _product(mu_kinetic),
        tension_scale=tension_scale,
        torque_scale=torque_scale,
        speed_scale=speed_scale,
    )
    zero = jnp.zeros_like(omega_0)
    x = None if stiffness is None else jnp.asarray(initial.elongation) + zero
    state = State(zero, omega_0, x, Ledger(zero, zero, zero))
    sense = jnp.where(omega_0 < 0, -1, 1)
    return system, state, Mode(jnp.asarray(int(BandMode.OPEN), jnp.int32), sense, lever_piece, load_piece)
