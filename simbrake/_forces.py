"""Everything that acts on a brake at one instant: tensions, slip, torques and heat flows of every mode."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ._acting import AbstractActing
from ._band import product, running_product
from ._duty import AbstractProfile, SpeedHold
from ._links import Surroundings
from ._loads import AbstractLoad
from ._modes import BandMode, Mode, slips
from ._sliding import Coefficients, Grip
from ._state import Flows, State, ThermalNow
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


class Forces(AbstractActing):
    """Tensions, torques and heat flows of the standard brake (model §3) as functions of time, state and mode.

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

    def coefficients(self, y: State, mode: Mode, q: Flows) -> Float[Array, " n"]:
        """Coefficients of friction that the linings have when they slide."""
        return self._kinetic(q.lever_tension, y.omega, y.heat, mode, mode.band == BandMode.SLIP_BACK).f

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

    def lever_tension(self, t: Array, y: State, mode: Mode) -> tuple[Array, Array]:
        """`T_0` and its rate as the lever has them."""
        if isinstance(self.lever, SpeedHold):
            load = self.load.torque(t, y.omega, mode.load_piece)
            everywhere = self.lever.value(t, mode.lever_piece)
            Pi = self._ratio(everywhere, y.omega, y.heat, mode, False)
            return self.lever.holding(load, self.band_radius, Pi), jnp.zeros_like(t)
        return jax.jvp(lambda t: self.lever.value(t, mode.lever_piece), (t,), (jnp.ones_like(t),))

    # --- full slip ------------------------------------------------------------------------------------------------

    def slip(self, t: Array, y: State, mode: Mode, back: Any, now: ThermalNow | None) -> Slip:
        """Full slip with the anchor end tight, or (`back`) the lever end: `T_n = T_0 Π^{±1}`, `ẋ = Ṫ_n/C`.

        The tension moves with the lever, the speed and the temperatures, which move with the heat of the slip itself:
        `ẋ = ẋ_0 + γ v_s`, `v_s = (R_b ω − ẋ_0)/(1 + γ)` (model §3).
        """
        T_0, rate = self.lever_tension(t, y, mode)
        point = (T_0, y.omega, y.heat)

        def tension(T_0: Array, omega: Array, u: Any) -> Array:
            return T_0 * self._ratio(T_0, omega, u, mode, back)

        friction = deposit = None
        if self.thermal is not None and now is not None:
            mu = self.kinetic_mu(*point, mode, back)[0]
            along = T_0 * running_product(jnp.where(back, 1 / mu, mu))
            friction = jnp.diff(along, prepend=T_0)
            deposit = self.deposit(t, y, mode, now, friction)
        if self.stiffness is None:
            return Slip(tension(*point), jnp.zeros_like(t), None, friction, deposit)
        if self.ratio_kinetic is not None:
            Pi = self._ratio(*point, mode, back)
            return Slip(T_0 * Pi, rate * Pi / self.stiffness, None, friction, deposit)
        T_n = tension(*point)
        load = self.load.torque(t, y.omega, mode.load_piece)
        alpha = (load - self.band_radius * (T_n - T_0)) / self.inertia_at(mode)
        if self.thermal is None or now is None or deposit is None:
            growth = jax.jvp(tension, point, (rate, alpha, None))[1]
            return Slip(T_n, growth / self.stiffness)
        growth = jax.jvp(tension, point, (rate, alpha, now.flows.into / self.thermal.capacity))[1] / self.stiffness
        if not self.grip.linings.friction.temperature_dependent:
            return Slip(T_n, growth, None, friction, deposit)
        zero = jnp.zeros_like(rate)
        gamma = jax.jvp(tension, point, (zero, zero, deposit.into / self.thermal.capacity))[1] / self.stiffness
        v = (self.band_radius * y.omega - growth) / jnp.where(1 + gamma > 0, 1 + gamma, 1.0)
        return Slip(T_n, growth + gamma * v, 1 + gamma, friction, deposit)

    def _ratio(self, T_0: Array, omega: Array, u: Any, mode: Mode, back: Any) -> Array:
        """`Π^{±1}` of sliding linings."""
        Pi = self.ratio_kinetic
        if Pi is None:
            Pi = product(self.kinetic_mu(T_0, omega, u, mode, back)[0])
        return jnp.where(back, 1 / Pi, Pi)

    def sliding_tension(self, t: Array, y: State, mode: Mode) -> Array:
        """Tension `T_0 Π^{±1}` of the tight end if the band slides as its mode says."""
        T_0, _ = self.lever_tension(t, y, mode)
        return T_0 * self._ratio(T_0, y.omega, y.heat, mode, mode.band == BandMode.SLIP_BACK)

    def around(self, y: State, mode: Mode) -> Surroundings:
        moving = jnp.where(mode.band == BandMode.HELD, 0.0, jnp.abs(y.omega))
        return Surroundings(moving * self.track_radius, jnp.where(mode.band == BandMode.OPEN, 0.0, 1.0))

    def flows(self, t: Array, y: State, mode: Mode) -> Flows:
        """Everything that acts at one instant (model §3, table of modes)."""
        band, R_b = mode.band, self.band_radius
        is_open, held, sliding = band == BandMode.OPEN, band == BandMode.HELD, slips(band)
        lever_tension, _ = self.lever_tension(t, y, mode)
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
            alpha=jnp.where(held, 0.0, (load - torque) / self.inertia_at(mode)),
            band_speed=band_speed,
            slip_speed=slip_speed,
            snap=slip.snap,
            friction=slip.friction,
            thermal=now,
        )
