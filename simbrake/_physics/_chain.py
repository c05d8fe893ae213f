"""Forces in the resolved chain: linings that move for themselves on segments of the band (model §3.1)."""

from typing import Any, NamedTuple

import jax.numpy as jnp
from jaxtyping import Float

from .._hybrid._arrays import Array
from .._parts._band import LiningForces
from .._parts._duty import AbstractProfile
from .._parts._friction import Contact, continued
from .._parts._links import Surroundings
from .._parts._loads import AbstractLoad
from ._acting import AbstractActing
from ._sliding import Grip
from ._state import Ledger
from ._thermal import Thermal

#: bits of a segment's mode: its tension is positive; its elastic part is
TAUT, STRETCHED = 1, 2


class ChainState(NamedTuple):
    """Angle `φ` (rad), speed `ω` (rad/s), elongation `e_i = u_i − u_{i+1}` (n,) of the segments (m), speed `v = u̇` (n,)
    of the linings along the band circle (m/s), the ledger, the heat content of the thermal nodes over their capacity
    (K; `None` without heat), and the thickness worn off the linings (`Worn`; `None` without wear).

    Elongations instead of displacements `u`: on a stiff segment the tension would be a difference of two nearly equal
    displacements, with a rounding of `K` times that of `u`, in which events could no longer be located.
    """

    phi: Any
    omega: Any
    e: Any
    v: Any
    ledger: Ledger
    heat: Any = None
    worn: Any = None


class ChainMode(NamedTuple):
    """Label of the whole band (`BandMode`), direction of motion (±1), pieces of the given profiles; what each lining
    does (n,): 0 sticks, +1 the pulley slides ahead of it, −1 behind; bits `TAUT`, `STRETCHED` of each segment (n,)."""

    band: Any
    sense: Any
    lever_piece: Any
    load_piece: Any
    linings: Any
    segments: Any
    heat_pieces: tuple[Any, ...] = ()

    @property
    def slides(self) -> Any:
        """There is no internal pair."""
        return 0 * self.band

    @property
    def contacts(self) -> dict[str, Any]:
        """What every lining does for itself."""
        return {"lining": self.linings}


class ChainFlows(NamedTuple):
    """Forces and rates at one instant."""

    slack_tension: Float[Array, ""]  # T_0 (N)
    lever_tension: Float[Array, ""]  # the same: the lever always pulls on lining 1
    tight_tension: Float[Array, ""]  # T_n (N)
    load_torque: Float[Array, ""]  # M_load (N·m)
    brake_torque: Float[Array, ""]  # R_b Σ G_i (N·m)
    alpha: Float[Array, ""]  # ω̇ (rad/s²)
    slip_speed: Float[Array, ""]  # mean of the linings' (m/s)
    tension: Float[Array, " n"]  # T_i (N)
    elastic: Float[Array, " n"]  # T_i^0 + K_i e_i (N), below 0 where the segment is slack
    total: Float[Array, " n"]  # the same with the damper's part
    grip: Float[Array, " n"]  # G_i (N)
    normal: Float[Array, " n"]  # N_i (N)
    displacement: Float[Array, " n"]  # u_i (m)
    lining_speed: Float[Array, " n"]  # u̇_i (m/s)
    lining_slip: Float[Array, " n"]  # R_b ω − u̇_i (m/s)
    acceleration: Float[Array, " n"]  # ü_i (m/s²)
    stretching: Float[Array, " n"]  # ė_i (m/s)
    thermal: Any = None  # ThermalNow, with heat only; its deposit is in W, for the friction heats of this instant


def differences(x: Float[Array, " n"]) -> Float[Array, " n"]:
    """`x_i − x_{i+1}` with `x_{n+1} = 0`, the anchor."""
    return x - jnp.append(x[1:], 0.0)


class ChainForces(AbstractActing):
    """Forces in a chain of linings (model §3.1), counted from the slack end.

        T_i = max(0, T_i^0 + K_i e_i + D_i ė_i),   e_i = u_i − u_{i+1},  u_{n+1} = 0,  T_i^0 = C x_0
        m_i ü_i = G_i + T_{i−1} − T_i,   N_i = (T_i + T_{i−1}) sin(β_i/2),   J ω̇ = M_load − R_b Σ G_i
        sliding ±:  G_i = ± f_i N_i/cos(β_i/2)
        sticking:   u̇_i = R_b ω,  G_i = m_i R_b ω̇ + T_i − T_{i−1},
                    (J + R_b² Σ_stuck m_i) ω̇ = M_load − R_b [Σ_slip G_i + Σ_stuck (T_i − T_{i−1})]

    - `mass` `m_i` (kg); `stiffness` `K_i` (N/m), the last one `C`; `damping` `D_i` (N·s/m); `preload` `T_i^0` (N)
    - `cosine` of `β_i/2`
    """

    inertia: Array
    band_radius: Array
    track_radius: Array
    mass: Float[Array, " n"]
    stiffness: Float[Array, " n"]
    damping: Float[Array, " n"]
    preload: Array
    cosine: Float[Array, " n"]
    grip: Grip
    lever: AbstractProfile
    load: AbstractLoad
    thermal: Thermal | None

    @property
    def pair(self):
        return None if self.thermal is None else self.thermal.heat.friction

    def laws(self, u):
        return [(self.grip.linings.friction, self.surface(u))]

    def around(self, y: ChainState, mode: ChainMode) -> Surroundings:
        return Surroundings(jnp.abs(y.omega) * self.track_radius, jnp.ones_like(y.omega))

    def _contact(self, y: ChainState, normal: Array, slip: Array) -> Contact:
        linings = self.grip.linings
        pressure = None if linings.area is None else normal / jnp.asarray(linings.area)
        return Contact(v=slip, T=self.surface(y.heat), p=pressure)

    def limit(self, y: ChainState, q: ChainFlows) -> Float[Array, " n"]:
        """`f_s,i N_i/c_i` (N): up to there a lining sticks."""
        contact = self._contact(y, q.normal, jnp.zeros_like(q.normal))
        return self.grip.linings.friction.static(contact) * q.normal / self.cosine

    def kinetic(self, y: ChainState, mode: ChainMode, q: ChainFlows) -> Float[Array, " n"]:
        """Coefficients of friction that the linings have when they slide."""
        slip = jnp.abs(q.lining_slip)
        f = self.grip.linings.friction.kinetic(self._contact(y, q.normal, slip))
        return jnp.broadcast_to(f, slip.shape)

    def flows(self, t: Array, y: ChainState, mode: ChainMode) -> ChainFlows:
        """Everything that acts at one instant."""
        R_b, sign = self.band_radius, mode.linings.astype(y.v.dtype)
        sticks, taut = mode.linings == 0, (mode.segments & TAUT) > 0
        v = jnp.where(sticks, R_b * y.omega, y.v)
        slip, stretching = R_b * y.omega - v, differences(v)
        elastic = self.preload + self.stiffness * y.e
        total = elastic + self.damping * stretching
        tension = jnp.where(taut, total, 0.0)
        T_0 = self.lever.value(t, mode.lever_piece)
        before = jnp.append(T_0, tension[:-1])
        normal = (tension + before) * self.grip.sine
        contact = self._contact(y, normal, sign * slip)
        f = continued(lambda v: self.grip.linings.friction.kinetic(contact._replace(v=v)), sign * slip)
        sliding = sign * f * normal / self.cosine
        load = self.load.torque(t, y.omega, mode.load_piece)
        carried = jnp.sum(jnp.where(sticks, tension - before, sliding))
        inertia = self.inertia_at(mode) + R_b**2 * jnp.sum(jnp.where(sticks, self.mass, 0.0))
        alpha = (load - R_b * carried) / inertia
        G = jnp.where(sticks, self.mass * R_b * alpha + tension - before, sliding)
        now = self.thermal_now(t, y, mode)
        if now is not None:
            deposit = self.deposit(t, y, mode, now, G * slip)
            now = now._replace(T_junctions=now.T_junctions + deposit.into_junctions, deposit=deposit)
        return ChainFlows(
            slack_tension=T_0,
            lever_tension=T_0,
            tight_tension=tension[-1],
            load_torque=load,
            brake_torque=R_b * jnp.sum(G),
            alpha=alpha,
            slip_speed=jnp.mean(slip),
            tension=tension,
            elastic=elastic,
            total=total,
            grip=G,
            normal=normal,
            displacement=jnp.cumsum(y.e[::-1])[::-1],
            lining_speed=v,
            lining_slip=slip,
            acceleration=jnp.where(sticks, R_b * alpha, (G + before - tension) / self.mass),
            stretching=stretching,
            thermal=now,
        )

    def pair_torques(self, T_0, y, mode):
        # linings at rest on the band, the pulley sliding past all of them
        return self.band_torque(T_0, y.omega, self.surface(y.heat))[None]

    def stored(self, t: Array, y: ChainState, mode: ChainMode) -> tuple[Array, Array]:
        """Kinetic energy of pulley and linings and elastic energy `Σ T_el²/(2 K_i)` of the segments (J)."""
        v = jnp.where(mode.linings == 0, self.band_radius * y.omega, y.v)
        kinetic = 0.5 * self.inertia_at(mode) * y.omega**2 + 0.5 * jnp.sum(self.mass * v**2)
        tension = jnp.maximum(self.preload + self.stiffness * y.e, 0.0)
        return kinetic, jnp.sum(tension**2 / (2 * self.stiffness))


def chain_lining_forces(forces: ChainForces, mode: ChainMode, q: ChainFlows) -> LiningForces:
    """Tension, circumferential force `F_i = G_i cos(β_i/2)`, normal force, and whether each lining slides."""
    return LiningForces(q.tension, q.grip * forces.cosine, q.normal, mode.linings != 0)
