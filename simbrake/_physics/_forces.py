"""Everything that acts on a brake at one instant: tensions, slip, torques and heat flows of every mode."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Bool, Float

from .._hybrid._arrays import Array
from .._parts._band import limit_tensions, piece_of, product, running_product, tensions_on
from .._parts._driller import AbstractSpeedLever
from .._parts._duty import AbstractProfile
from .._parts._friction import AbstractFriction
from .._parts._heat import FrictionHeat
from .._parts._internal import Held, InternalPair
from .._parts._links import Surroundings
from .._parts._loads import AbstractLoad
from ._acting import AbstractActing
from ._heat_flows import Deposit
from ._modes import BandMode, Mode, slips
from ._sliding import Coefficients, Grip
from ._state import Flows, Inner, State, ThermalNow
from ._thermal import Thermal


class Slip(NamedTuple):
    """What full slip in one direction would be."""

    tension: Float[Array, ""]
    band_speed: Float[Array, ""]
    snap: Any = None  # 1 + γ
    deposit: Deposit | None = None  # of the friction heat, per unit of slip speed


class Limits(NamedTuple):
    """Static limits: ratios of the linings, `Π` from the slack end upwards and downwards, whether a lining locks."""

    mu: Float[Array, " n"]
    ahead: Array
    back: Array
    locked: Bool[Array, ""]
    margin: Any = None  # 1 − max f z, where it can change


class Forces(AbstractActing):
    """Tensions, torques and heat flows of a brake as functions of time, state and mode (model §3; staged: §4).

    The band acts on what carries it: the pulley, or the bandage of a staged brake, which the pulley drives through the
    internal pair. Products `Π` that cannot change in the run are formed once, at assembly.
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
    internal: InternalPair | None = None

    @property
    def pair(self) -> FrictionHeat | None:
        """Where the heat of the pair goes on which the band acts."""
        if self.thermal is None:
            return None
        return self.thermal.heat.friction if self.internal is None else self.thermal.heat.external

    def carrier_speed(self, y: State) -> Array:
        """Speed of what carries the band: pulley or bandage (rad/s)."""
        return y.omega if self.internal is None else y.omega_b

    def laws(self, u):
        found: list[tuple[AbstractFriction, Array | None]] = [(self.grip.linings.friction, self.surface(u))]
        if self.internal is not None:
            found.append((self.internal.bandage.friction, self.inner_surface(u)))
        return found

    def inner_surface(self, u: Any) -> Array | None:
        """Temperatures that the friction law of the internal pair sees."""
        return self.sensed(None if self.thermal is None else self.thermal.heat.friction, u)

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
        return self._kinetic(q.lever_tension, self.carrier_speed(y), y.heat, mode, mode.band == BandMode.SLIP_BACK).f

    def limits(self, T_0: Array, u: Any, mode: Mode) -> Limits:
        """Limits of the tension while the linings stick."""
        if self.mu_static is not None and self.ratio_static is not None:
            return Limits(self.mu_static, self.ratio_static, self.ratio_static, self.locked)
        still, T = jnp.zeros(self.grip.linings.count), self.surface(u)
        f = self.grip.coefficients(T_0, still, T, jnp.asarray(False), static=True).f
        mu, margin = self.grip.ratios(f)
        ahead = back = product(mu)
        if self.grip.reads.p:
            f = self.grip.coefficients(T_0, still, T, jnp.asarray(True), static=True).f
            back = product(self.grip.ratios(f)[0])
        return Limits(mu, ahead, back, mode.locks > 0, margin)

    def lever_tension(self, t: Array, y: State, mode: Mode) -> tuple[Array, Array]:
        """`T_0` and its rate as the lever has them."""
        piece = mode.lever_piece
        given = jax.jvp(lambda t: self.lever.value(t, piece), (t,), (jnp.ones_like(t),))
        if not isinstance(self.lever, AbstractSpeedLever):
            return given
        load, inertia = self.load.torque(t, y.omega, mode.load_piece), jnp.asarray(self.inertia_at(mode))
        torque = self.lever.wanted_torque(t, y.omega, piece, load, inertia)
        Pi = self._ratio(given[0], y.omega, y.heat, mode, False)
        follows, T_0 = self.lever.follows(piece), self.lever.holding(torque, self.band_radius * (Pi - 1))
        return jnp.where(follows, T_0, given[0]), jnp.where(follows, 0.0, given[1])

    # --- full slip ------------------------------------------------------------------------------------------------

    def slip(self, t: Array, y: State, mode: Mode, back: Any, now: ThermalNow | None) -> Slip:
        """Full slip with the anchor end tight, or (`back`) the lever end: `T_n = T_0 Π^{±1}`, `ẋ = Ṫ_n/C`.

        The tension moves with the lever, the speed and the temperatures, which move with the heat of the slip itself:
        `ẋ = ẋ_0 + γ v_s`, `v_s = (R_b ω − ẋ_0)/(1 + γ)` (model §3).
        """
        T_0, rate = self.lever_tension(t, y, mode)
        omega = self.carrier_speed(y)
        point = (T_0, omega, y.heat)

        def tension(T_0: Array, omega: Array, u: Any) -> Array:
            return T_0 * self._ratio(T_0, omega, u, mode, back)

        deposit = heated = None
        if self.thermal is not None and now is not None:
            friction, along = self._slip_friction(T_0, omega, y.heat, mode, back)
            deposit = self.deposit(t, y, mode, now, friction)
            heated = self._inner_deposit(t, y, mode, now, T_0, along)
        if self.stiffness is None:
            return Slip(tension(*point), jnp.zeros_like(t), None, deposit)
        if self.ratio_kinetic is not None:
            Pi = self._ratio(*point, mode, back)
            return Slip(T_0 * Pi, rate * Pi / self.stiffness, None, deposit)
        T_n, along_rates = jax.linearize(tension, *point)
        alpha = self._carrier_alpha(t, y, mode, T_0, T_n, back)
        if self.thermal is None or now is None or deposit is None:
            return Slip(T_n, along_rates(rate, alpha, None) / self.stiffness)
        warming = now.flows.into
        if heated is not None:
            warming = warming + heated.into * self.inner_speed(y, mode)
        growth = along_rates(rate, alpha, self.thermal.rise(warming)) / self.stiffness
        if not self.grip.reads.T:
            return Slip(T_n, growth, None, deposit)
        still = jnp.zeros_like(T_n)
        gamma = along_rates(still, still, self.thermal.rise(deposit.into)) / self.stiffness
        v = (self.band_radius * omega - growth) / jnp.where(1 + gamma > 0, 1 + gamma, 1.0)
        return Slip(T_n, growth + gamma * v, 1 + gamma, deposit)

    def _slip_friction(self, T_0: Array, omega: Array, u: Any, mode: Mode, back: Any) -> tuple[Array, Array]:
        """Forces `T_i − T_{i−1}` in full slip that friction heat comes from, and the tensions `T_i`.

        Their sum alone where the linings share one body (`Thermal.tells_apart`).
        """
        assert self.thermal is not None
        if self.internal is None and not self.thermal.tells_apart(self.pair):
            tight = T_0 * self._ratio(T_0, omega, u, mode, back)
            return (tight - T_0)[None], tight[None]
        mu = self.kinetic_mu(T_0, omega, u, mode, back)[0]
        along = T_0 * running_product(jnp.where(back, 1 / mu, mu))
        return jnp.diff(along, prepend=T_0), along

    def _carrier_alpha(self, t: Array, y: State, mode: Mode, T_0: Array, T_n: Array, back: Any) -> Array:
        """Acceleration of what carries a sliding band."""
        load = self.load.torque(t, y.omega, mode.load_piece)
        torque = self.band_radius * (T_n - T_0)
        if self.internal is None:
            return (load - torque) / self.inertia_at(mode)
        J, J_b = self.inertia_at(mode), jnp.asarray(self.internal.bandage.inertia)
        pull = mode.inner.astype(jnp.float64) * self._full_slip_grip(T_0, y, mode, back)
        return jnp.where(mode.inner == 0, (load - torque) / (J + J_b), (pull - torque) / J_b)

    def _ratio(self, T_0: Array, omega: Array, u: Any, mode: Mode, back: Any) -> Array:
        """`Π^{±1}` of sliding linings."""
        Pi = self.ratio_kinetic
        if Pi is None:
            Pi = product(self.kinetic_mu(T_0, omega, u, mode, back)[0])
        return jnp.where(back, 1 / Pi, Pi)

    def sliding_tension(self, t: Array, y: State, mode: Mode) -> Array:
        """Tension `T_0 Π^{±1}` of the tight end if the band slides as its mode says."""
        T_0, _ = self.lever_tension(t, y, mode)
        return T_0 * self._ratio(T_0, self.carrier_speed(y), y.heat, mode, mode.band == BandMode.SLIP_BACK)

    def around(self, y: State, mode: Mode) -> Surroundings:
        rests = mode.band == BandMode.HELD
        if self.internal is not None:
            rests = rests & (mode.inner == 0)
        moving = jnp.where(rests, 0.0, jnp.abs(y.omega))
        return Surroundings(moving * self.track_radius, jnp.where(mode.band == BandMode.OPEN, 0.0, 1.0))

    # --- the internal pair of a staged brake ----------------------------------------------------------------------

    def inner_speed(self, y: State, mode: Mode) -> Array:
        """`R (ω − ω_b)` while the internal pair slides (m/s)."""
        return jnp.where(mode.inner == 0, 0.0, self.track_radius * (y.omega - y.omega_b))

    def holding(self, y: State, mode: Mode, static: Any = False) -> Held:
        """What the friction of the internal pair depends on."""
        v = self.track_radius * jnp.where(mode.inner < 0, -1.0, 1.0) * (y.omega - y.omega_b)
        return Held(v, self.inner_surface(y.heat), static)

    def mobilised_mu(self, T_0: Array, y: State, mode: Mode) -> Float[Array, " n"]:
        """Tension ratios at which linings are at their limit: kinetic in full slip, else static."""
        sliding = self.kinetic_mu(T_0, self.carrier_speed(y), y.heat, mode, mode.band == BandMode.SLIP_BACK)[0]
        return jnp.where(slips(mode.band), sliding, self.limits(T_0, y.heat, mode).mu)

    def _full_slip_grip(self, T_0: Array, y: State, mode: Mode, back: Any) -> Array:
        """`M_int` of the sliding internal pair while every lining slides on the band."""
        assert self.internal is not None
        n = self.grip.linings.count
        mu = self.kinetic_mu(T_0, y.omega_b, y.heat, mode, back)[0]
        piece = jnp.where(back, -1 - n, n)
        tight = T_0 * jnp.where(back, 1 / product(mu), product(mu))
        along = tensions_on(T_0, tight, mu, piece)
        return self.internal.capacity(T_0, along, self.holding(y, mode))

    def drives(self, T_0: Array, load: Array, y: State, mode: Mode, limits: Limits) -> tuple[Array, Array]:
        """Torques that drive what carries the band, with the band at its upper and at its lower static limit."""
        if self.internal is None:
            return load, load
        n, held = self.grip.linings.count, self.holding(y, mode)
        ahead, back = (
            self.internal.capacity(T_0, tensions_on(T_0, T_n, limits.mu, jnp.asarray(piece, jnp.int32)), held)
            for T_n, piece in ((T_0 * limits.ahead, n), (T_0 / limits.back, -1 - n))
        )
        sense = mode.inner.astype(jnp.float64)
        stuck = mode.inner == 0
        return jnp.where(stuck, load, sense * ahead), jnp.where(stuck, load, sense * back)

    def _inner_deposit(self, t: Array, y: State, mode: Mode, now: ThermalNow, T_0: Array, along: Array) -> Any:
        """Where the heat of the internal pair goes, per unit of its slip speed."""
        if self.internal is None or self.thermal is None:
            return None
        sense = jnp.where(mode.inner < 0, -1.0, 1.0)
        friction = sense * self.internal.friction(T_0, along, self.holding(y, mode))
        around, pair = self.around(y, mode), self.thermal.heat.friction
        return self.thermal.deposit(pair, now.T, now.T_junctions, t, around, friction, mode.heat_pieces)

    def held_tension(self, T_0: Array, load: Array, y: State, mode: Mode) -> Array:
        """`T_n` while what carries the band is at rest: it bears the load, or what the sliding internal pair gives."""
        resting = T_0 + load / self.band_radius
        if self.internal is None:
            return resting
        mu, held = self.limits(T_0, y.heat, mode).mu, self.holding(y, mode)
        driven = self.internal.holding_tension(T_0, mu, mode.piece, mode.inner, self.band_radius, held)
        return jnp.where(mode.inner == 0, resting, driven)

    def pair_torques(self, T_0, y, mode):
        outer = self.band_torque(T_0, y.omega, self.surface(y.heat))
        if self.internal is None:
            return outer[None]
        # a held bandage is braced by the static friction of the band; the rim slides in it with the pulley's speed
        mu, speed = self.limits(T_0, y.heat, mode).mu, self.track_radius * jnp.abs(y.omega)
        held, sense = Held(speed, self.inner_surface(y.heat), jnp.asarray(False)), jnp.where(y.omega < 0, -1, 1)
        piece = self.internal.holding_piece(T_0, mu, sense, self.band_radius, held)
        T_n = self.internal.holding_tension(T_0, mu, piece, sense, self.band_radius, held)
        T_n = jnp.clip(T_n, T_0 / product(mu), T_0 * product(mu))
        inner = self.internal.capacity(T_0, tensions_on(T_0, T_n, mu, piece), held)
        return jnp.stack([outer, inner])

    def inner_flows(self, slack: Array, T_n: Array, load: Array, y: State, mode: Mode) -> Inner:
        """Torque and acceleration of the bandage for given tensions (model §4)."""
        assert self.internal is not None
        J, J_b = self.inertia_at(mode), jnp.asarray(self.internal.bandage.inertia)
        stuck, rests = mode.inner == 0, mode.band == BandMode.HELD
        mu, held = self.mobilised_mu(slack, y, mode), self.holding(y, mode, stuck)
        piece = jnp.where(stuck & ~slips(mode.band), piece_of(slack, T_n, mu), mode.piece)
        along = tensions_on(slack, T_n, mu, piece)
        friction = self.internal.friction(slack, along, held)
        capacity = self.internal.radius * jnp.sum(friction)
        M_ext = self.band_radius * (T_n - slack)
        common = jnp.where(rests, 0.0, (load - M_ext) / (J + J_b))
        torque = jnp.where(stuck, load - J * common, mode.inner.astype(jnp.float64) * capacity)
        alpha = jnp.where(stuck, common, jnp.where(rests, 0.0, (torque - M_ext) / J_b))
        speed, normal = self.inner_speed(y, mode), self.internal.normal(slack, along)
        return Inner(torque, capacity, speed, alpha, friction, normal)

    def limit_margins(self, slack: Array, T_n: Array, y: State, mode: Mode) -> tuple[Array, Array]:
        """How far `T_n` is below and above the tensions at which one lining more or less is at its limit (N)."""
        n = self.grip.linings.count
        limits = limit_tensions(slack, self.mobilised_mu(slack, y, mode))
        at = jnp.arange(2 * n + 1, dtype=jnp.int32) - n

        def pick(i: Array) -> Array:
            return jnp.sum(jnp.where(at == i, limits, 0.0))

        return pick(mode.piece + 1) - T_n, T_n - pick(mode.piece)

    # --- all of it ------------------------------------------------------------------------------------------------

    def flows(self, t: Array, y: State, mode: Mode) -> Flows:
        """Everything that acts at one instant (model §3, table of modes; staged: §4)."""
        band, R_b = mode.band, self.band_radius
        is_open, held, sliding = band == BandMode.OPEN, band == BandMode.HELD, slips(band)
        lever_tension, _ = self.lever_tension(t, y, mode)
        T_0 = jnp.where(is_open, 0.0, lever_tension)
        load = self.load.torque(t, y.omega, mode.load_piece)
        now = self.thermal_now(t, y, mode)
        slip = self.slip(t, y, mode, band == BandMode.SLIP_BACK, now)
        speed = R_b * self.carrier_speed(y)
        rest = jnp.where(held, self.held_tension(T_0, load, y, mode), 0.0)
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
        inner, alpha = None, jnp.where(held, 0.0, (load - torque) / self.inertia_at(mode))
        if self.internal is not None:
            inner = self.inner_flows(slack, tension, load, y, mode)
            alpha = jnp.where(mode.inner == 0, inner.alpha, (load - inner.torque) / self.inertia_at(mode))
        if now is not None and slip.deposit is not None:
            now = self._heated(t, y, mode, now, slip, slip_speed, inner)
        return Flows(
            slack_tension=slack,
            lever_tension=lever_tension,
            tight_tension=tension,
            load_torque=load,
            brake_torque=torque,
            alpha=alpha,
            band_speed=band_speed,
            slip_speed=slip_speed,
            snap=slip.snap,
            thermal=now,
            inner=inner,
        )

    def _heated(
        self, t: Array, y: State, mode: Mode, now: ThermalNow, slip: Slip, slip_speed: Array, inner: Inner | None
    ) -> ThermalNow:
        """The network with the friction heat of this instant."""
        assert slip.deposit is not None
        hot = now.T_junctions + slip.deposit.into_junctions * slip_speed
        if inner is None or self.thermal is None:
            return now._replace(T_junctions=hot, deposit=slip.deposit)
        # in full slip the tensions are those of `slip`; else they follow the band
        sense = jnp.where(mode.inner < 0, -1.0, 1.0)
        around, pair = self.around(y, mode), self.thermal.heat.friction
        given = self.thermal.deposit(pair, now.T, now.T_junctions, t, around, sense * inner.friction, mode.heat_pieces)
        hot = hot + given.into_junctions * inner.slip_speed
        return now._replace(T_junctions=hot, deposit=slip.deposit, inner_deposit=given)
