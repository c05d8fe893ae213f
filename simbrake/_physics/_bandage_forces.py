"""Everything that acts on a resolved bandage at one instant: tensions, torques and heat flows of every lining."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Float

from .._hybrid._arrays import Array
from .._parts._band import affine_tensions, tension_ratio
from .._parts._design import Bandage, Lining
from .._parts._duty import AbstractProfile
from .._parts._friction import AbstractFriction, Contact, continued, reads
from .._parts._links import Surroundings
from .._parts._loads import AbstractLoad
from ._acting import AbstractActing
from ._at_rest import Resting, Shared, holding_range, share_load
from ._bandage_state import BandageFlows, BandageMode, BandageState, BandageThermal
from ._modes import BandMode
from ._sliding import Grip
from ._thermal import Thermal


class Coefficients(NamedTuple):
    """Tension ratios `μ_i` on the band and coefficients `f_i` on the rim, sticking and sliding."""

    mu_static: Float[Array, " n"]
    mu_kinetic: Float[Array, " n"]
    grip_static: Float[Array, " n"]  # f_i tan(β_i/2) on the band
    inner_static: Float[Array, " n"]
    inner_kinetic: Float[Array, " n"]


class BandageForces(AbstractActing):
    """Tensions, torques and heat flows of a resolved bandage as functions of time, state and mode (model §4).

    Per lining (`G_i = T_i − T_{i−1}` from the band, `λ_i` from the rim, `Q_i` from the springs to its neighbours):

        J ω̇ = M_load − Σ λ_i,  J_i ω̇_i = λ_i + Q_i − R_b G_i,  M_i = R f_i (N_i + N_pre,i),  N_i = (T_i + T_{i−1}) s_i
        slides on the band:                     T_i = T_{i−1} μ_i^{±1}, ± = sign of ω_i
        held on the band, slides on the rim:    R_b (T_i − T_{i−1}) = σ_i M_i + Q_i, linear in T_i
        sticks on the rim, slides on the band:  λ_i = R_b G_i − Q_i + J_i ω̇, ω̇ common to pulley and such linings
        neither moves (pulley at rest):         `_at_rest`

    Springs: `S_j = K_j e_j + D_j ė_j`, `ė_j = R_b (ω_j − ω_{j+1})`, `Q_i = R_b (S_{i−1} − S_i)`.

    - `inertia` `J`, `inertias` `J_i` (kg·m²); `stiffness` `K_j` (N/m), `damping` `D_j` (N·s/m) of the n − 1 springs
    - `grip.tangent` `tan(β_i/2)`, `grip.sine` `s_i = sin(β_i/2)`
    """

    inertia: Array
    inertias: Float[Array, " n"]
    band_radius: Array
    track_radius: Array
    grip: Grip
    internal: Bandage
    stiffness: Float[Array, " springs"]
    damping: Float[Array, " springs"]
    lever: AbstractProfile
    load: AbstractLoad
    thermal: Thermal | None

    @property
    def linings(self) -> Lining:
        return self.grip.linings

    @property
    def count(self) -> int:
        return self.inertias.shape[0]

    def lever_tension(self, t: Array, mode: BandageMode) -> tuple[Array, Array]:
        """`T_0` and its rate as the lever has them."""
        return jax.jvp(lambda t: self.lever.value(t, mode.lever_piece), (t,), (jnp.ones_like(t),))

    @property
    def pair(self):
        return None if self.thermal is None else self.thermal.heat.external

    def laws(self, u):
        outer, inner = self.surfaces(u)
        return [(self.linings.friction, outer), (self.internal.friction, inner)]

    @property
    def fades(self) -> bool:
        """Whether a coefficient of friction depends on temperatures that the scene has."""
        heat = None if self.thermal is None else self.thermal.heat
        hot = heat is not None and heat.friction is not None
        return self.grip.reads.T or reads(self.internal.friction, self.count, T=hot, p=False).T

    def surfaces(self, u: Any) -> tuple[Array | None, Array | None]:
        """Temperatures that the friction laws on the band and on the rim see."""
        if self.thermal is None:
            return None, None
        return self.sensed(self.thermal.heat.external, u), self.sensed(self.thermal.heat.friction, u)

    def coefficients(self, y: BandageState, mode: BandageMode) -> Coefficients:
        """Friction of all linings; their own slip speeds, smooth past the end of the mode, decide while they slide."""
        n, still = self.count, jnp.zeros(self.count)
        outer_T, inner_T = self.surfaces(y.heat)
        outer_v = self.band_radius * mode.outer.astype(jnp.float64) * y.speeds
        inner_v = self.track_radius * mode.inner.astype(jnp.float64) * (y.omega - y.speeds)

        def each(f: Array) -> Array:
            return jnp.broadcast_to(f, (n,))

        outer, inner = self.linings.friction, self.internal.friction
        grip_static = each(outer.static(Contact(still, outer_T))) * self.grip.tangent
        on_band = continued(lambda v: outer.kinetic(Contact(v, outer_T)), outer_v)
        on_rim = continued(lambda v: inner.kinetic(Contact(v, inner_T)), inner_v)
        return Coefficients(
            mu_static=tension_ratio(grip_static)[0],
            mu_kinetic=tension_ratio(each(on_band) * self.grip.tangent)[0],
            grip_static=grip_static,
            inner_static=each(inner.static(Contact(still, inner_T))),
            inner_kinetic=each(on_rim),
        )

    def springs(self, y: BandageState) -> tuple[Array, Array, Array]:
        """Forces `S_j` (N), their part from the dampers (N) and torques `Q_i` on the linings (N·m)."""
        damped = -self.damping * self.band_radius * jnp.diff(y.speeds)
        force = self.stiffness * y.stretch + damped
        return force, damped, self.band_radius * (jnp.pad(force, (1, 0)) - jnp.pad(force, (0, 1)))

    def resting(self, y: BandageState, mode: BandageMode, c: Coefficients, Q: Array) -> Resting:
        """The linings as equations for the tensions along the band."""
        stuck, held = mode.inner == 0, mode.outer == 0
        sense, R_b = mode.inner.astype(jnp.float64), self.band_radius
        f = jnp.where(stuck, c.inner_static, c.inner_kinetic)
        grip = self.track_radius * f * self.grip.sine
        floor = self.track_radius * f * jnp.asarray(self.internal.preload)
        sliding = jnp.where(mode.outer > 0, c.mu_kinetic, 1 / c.mu_kinetic)
        gain = jnp.where(held, (R_b + sense * grip) / (R_b - sense * grip), sliding)
        offset = jnp.where(held, (sense * floor + Q) / (R_b - sense * grip), 0.0)
        return Resting(mode.fixed, R_b, c.mu_static, grip, floor, Q, gain, offset, sense)

    def around(self, y: BandageState, mode: BandageMode) -> Surroundings:
        moving = jnp.where(mode.rests, 0.0, jnp.abs(y.omega))
        return Surroundings(moving * self.track_radius, jnp.where(mode.band == BandMode.OPEN, 0.0, 1.0))

    def flows(self, t: Array, y: BandageState, mode: BandageMode) -> BandageFlows:
        """Everything that acts at one instant."""
        R_b, stuck, held, rests = self.band_radius, mode.inner == 0, mode.outer == 0, mode.rests
        lever = self.lever.value(t, mode.lever_piece)
        T_0 = jnp.where(mode.band == BandMode.OPEN, 0.0, lever)
        load = self.load.torque(t, y.omega, mode.load_piece)
        c, (S, _, Q) = self.coefficients(y, mode), self.springs(y)
        r = self.resting(y, mode, c, Q)

        def at_rest() -> Shared:
            return share_load(r, T_0, load)

        def in_motion() -> Shared:
            zero = jnp.zeros_like(T_0)
            return Shared(zero, affine_tensions(T_0, r.gain, r.offset), zero, zero)

        shared = jax.lax.cond(rests, at_rest, in_motion)
        along = shared.tension
        before = jnp.concatenate([T_0[None], along[:-1]])
        G, total = along - before, along + before
        capacity = r.grip * total + r.floor
        needed = R_b * G - Q
        slid = r.sense * capacity
        joined = jnp.sum(jnp.where(stuck, self.inertias, 0.0))
        alpha = (load - jnp.sum(jnp.where(stuck, needed, slid))) / (self.inertia_at(mode) + joined)
        alpha = jnp.where(rests, 0.0, alpha)
        torque = jnp.where(stuck, needed + self.inertias * alpha, slid)
        own = jnp.where(held, 0.0, (torque - needed) / self.inertias)
        q = BandageFlows(
            slack_tension=T_0,
            lever_tension=lever,
            tight_tension=along[-1],
            load_torque=load,
            brake_torque=R_b * (along[-1] - T_0),
            alpha=alpha,
            slip_speed=R_b * jnp.mean(y.speeds),
            tension=along,
            outer_force=G,
            normal=total * self.grip.sine,
            load=total * self.grip.sine + jnp.asarray(self.internal.preload),
            inner_torque=torque,
            capacity=capacity,
            inner_slip=self.track_radius * (y.omega - y.speeds),
            outer_slip=R_b * y.speeds,
            accelerations=jnp.where(stuck, alpha, own),
            spring_torque=Q,
            spring_force=S,
            outer_limit=c.grip_static * total,
            share=shared.share,
            least_hold=shared.least,
            most_hold=shared.most,
        )
        return q if self.thermal is None else q._replace(thermal=self._heated(t, y, mode, q))

    def pair_torques(self, T_0, y, mode):
        # one sum: every lining in its weaker pair, as at the limit of a pulley at rest but with kinetic friction
        n, (outer_T, inner_T), speed = self.count, self.surfaces(y.heat), jnp.abs(y.omega)

        def each(law: AbstractFriction, arm: Array, T: Array | None) -> Array:
            return jnp.broadcast_to(law.kinetic(Contact(jnp.broadcast_to(arm * speed, (n,)), T)), (n,))

        mu = tension_ratio(each(self.linings.friction, self.band_radius, outer_T) * self.grip.tangent)[0]
        on_rim = self.track_radius * each(self.internal.friction, self.track_radius, inner_T)
        floor, none = on_rim * jnp.asarray(self.internal.preload), jnp.zeros(n)
        every = jnp.ones(n, bool)
        _, _, Q = self.springs(y)
        r = Resting(every, self.band_radius, mu, on_rim * self.grip.sine, floor, Q, none, none, none)
        least, most = holding_range(r, T_0)
        return jnp.where(y.omega < 0, -least, most)[None]

    def powers(self, y: BandageState, mode: BandageMode, q: BandageFlows) -> tuple[Array, Array]:
        """Friction heat (W) of every lining on the band, `R_b G_i ω_i`, and on the rim, `λ_i (ω − ω_i)`."""
        outer = jnp.where(mode.outer == 0, 0.0, self.band_radius * q.outer_force * y.speeds)
        return outer, jnp.where(mode.inner == 0, 0.0, q.inner_torque * (y.omega - y.speeds))

    def _heated(self, t: Array, y: BandageState, mode: BandageMode, q: BandageFlows) -> BandageThermal:
        """The network with the friction heat of this instant."""
        net = self.thermal
        assert net is not None
        around, T = self.around(y, mode), net.temperatures(y.heat)
        T_J = net.junctions(T, t, around, mode.heat_pieces)
        P_outer, P_inner = self.powers(y, mode, q)
        outer = net.deposit(net.heat.external, T, T_J, t, around, P_outer, mode.heat_pieces)
        inner = net.deposit(net.heat.friction, T, T_J, t, around, P_inner, mode.heat_pieces)
        hot = T_J + outer.into_junctions + inner.into_junctions
        return BandageThermal(T, hot, net.flows(T, T_J, t, around, mode.heat_pieces), outer, inner)

    def stored(self, t: Array, y: BandageState, mode: BandageMode) -> tuple[Array, Array]:
        """Kinetic energy of pulley and linings, elastic energy of the springs (J)."""
        kinetic = 0.5 * self.inertia_at(mode) * y.omega**2 + 0.5 * jnp.sum(self.inertias * y.speeds**2)
        return kinetic, 0.5 * jnp.sum(self.stiffness * y.stretch**2)
