"""The resolved chain: linings that move individually on segments of the band, each
sticks or slides (model §3.1)."""

from typing import Any, ClassVar, NamedTuple

import jax.numpy as jnp
from jaxtyping import Bool, Float, Int

from ..friction import SurfaceState
from ..hybrid.arrays import Array, ScalarArray, Vector
from ._contact import acceleration, contact_margin, sense_after
from .mechanism import (
    ELASTIC,
    HELD,
    SLIP,
    SLIP_BACK,
    AbstractMechanism,
    AppliedLoads,
    ContactState,
    EvaluateInMode,
    EventState,
    MechanismNow,
    MechanismOutputs,
    Mode,
    Pair,
    PairNow,
    Sizes,
    Surfaces,
)
from .sliding import LiningFriction, coefficients_of

#: bits of a segment's mode: its tension is positive; its elastic part is
TAUT = 1
STRETCHED = 2
#: a lining this far past its limit (over the reference tension) breaks away together
#: with one that fired
_PAST = 1e-10


class ChainState(NamedTuple):
    """Elongation `e_i = u_i − u_{i+1}` (n,) of the segments (m), and speed `v = u̇`
    (n,) of the linings along the band circle (m/s).

    Elongations instead of displacements `u`: on a stiff segment the tension would be a
    difference of two nearly equal displacements, with a rounding of `K` times that of
    `u`, in which events could no longer be located.
    """

    e: Any
    v: Any


class ChainMode(NamedTuple):
    """State of each lining (n,): 0 sticks, +1 the pulley slides ahead of it, −1 behind;
    bits `TAUT`, `STRETCHED` of each segment (n,)."""

    linings: Any
    segments: Any

    lifted = None
    locks = None  # linings that move individually do not lock
    internal = None

    def slides(self, mode: Mode) -> Array:
        """There is no internal pair."""
        return 0 * mode.band

    @property
    def contacts(self) -> dict[str, Array]:
        return {"lining": self.linings}


class ChainGuards(NamedTuple):
    """Guards of a chain, or which of them fired.

    - `linings` (n,): friction left of one that sticks, slip of one that slides
    - `motion` of the pulley in its sense
    - of the segments (n,): `taut`, whether the whole tension is above 0, `stretched`,
      whether its elastic part is
    """

    linings: Array
    taut: Array
    stretched: Array
    motion: Array


class ChainNow(MechanismNow):
    """Variables of a chain; `brake_torque` is `R_b Σ G_i`, `lever_power` `T_0 u̇_1`."""

    damping: ScalarArray  # of all segments (W)
    tension: Vector  # T_i (N)
    elastic: Vector  # T_i^0 + K_i e_i (N), below 0 where the segment is slack
    total: Vector  # the same with the damper's part
    force: Vector  # G_i (N)
    limit: Vector  # f_s,i N_i/c_i (N): up to there a lining sticks
    normal: Vector  # N_i (N)
    lining_slip: Vector  # R_b ω − u̇_i (m/s)
    acceleration: Vector  # ü_i (m/s²)
    stretching: Vector  # ė_i (m/s)


class Chain(AbstractMechanism):
    """A chain of linings on a pulley, counted from the slack end.

        T_i = max(0, T_i^0 + K_i e_i + D_i ė_i),   e_i = u_i − u_{i+1},  u_{n+1} = 0,
        T_i^0 = C x_0 m_i ü_i = G_i + T_{i−1} − T_i,   N_i = (T_i + T_{i−1}) sin(β_i/2),
        J ω̇ = M_load − R_b Σ G_i
        sliding ±:  G_i = ± f_i N_i/cos(β_i/2)
        sticking:   u̇_i = R_b ω,  G_i = m_i R_b ω̇ + T_i − T_{i−1},
                    (J + R_b² Σ_stuck m_i) ω̇ = M_load − R_b [Σ_slip G_i + Σ_stuck (T_i
                    − T_{i−1})]

    Guards, in this order: one per lining (static limit less force while it sticks, slip
    speed while it slides), one per segment for the sign of its tension, one per segment
    for the sign of the elastic part of it (where the rate of damper heat has a kink),
    and the `motion` of the pulley until it is at rest.

    The label of the band is `ELASTIC` while any lining sticks; a chain knows no `OPEN`
    and no `TAKE_UP`, as the lever pulls on the first lining from the start.

    - `mass` `m_i` (kg); `stiffness` `K_i` (N/m), the last one `C`; `damping` `D_i`
      (N·s/m); `preload` `T_i^0` (N)
    - `cosine` of `β_i/2`
    """

    radius: ScalarArray
    mass: Vector
    stiffness: Vector
    damping: Vector
    preload: ScalarArray
    cosine: Vector
    grip: LiningFriction
    pairs: tuple[Pair, ...]
    sizes: Sizes
    distribution: ClassVar[str] = "every lining from its own balance"
    resolved: ClassVar[bool] = True
    damps: ClassVar[bool] = True

    @property
    def couples_loads(self) -> bool:
        return False  # tensions are those of the segments

    def start(
        self, omega: Array, elongation: Array
    ) -> tuple[ChainState, Array, ChainMode]:
        n = self.mass.shape[0]
        still = jnp.zeros(n)
        own = ChainState(still, still + self.radius * omega)
        band = jnp.where(omega == 0, HELD, ELASTIC)
        return (
            own,
            band,
            ChainMode(
                jnp.zeros(n, jnp.int32), jnp.full(n, TAUT | STRETCHED, jnp.int32)
            ),
        )

    def _coefficients(
        self, surface: SurfaceState | None, normal: Array, slip: Array, *, static: bool
    ) -> Float[Array, " *n"]:
        law = self.pairs[0].law
        area = self.pairs[0].area
        contact = (surface or SurfaceState()).contact(
            slip, None if area is None else normal / area
        )
        return coefficients_of(law, contact, static, by_speed=self.grip.reads.v)

    def variables(
        self, acting: AppliedLoads, omega: Array, own: ChainState, mode: Mode
    ) -> ChainNow:
        R_b = self.radius
        surface = acting.surfaces[0]
        sign = mode.own.linings.astype(own.v.dtype)
        sticks = mode.own.linings == 0
        v = jnp.where(sticks, R_b * omega, own.v)
        slip = R_b * omega - v
        stretching = v - jnp.append(v[1:], 0.0)
        elastic = self.preload + self.stiffness * own.e
        total = elastic + self.damping * stretching
        tension = jnp.where((mode.own.segments & TAUT) > 0, total, 0.0)
        before = jnp.append(acting.tension, tension[:-1])
        normal = (tension + before) * self.grip.sine
        f = self._coefficients(surface, normal, sign * slip, static=False)
        sliding = sign * f * normal / self.cosine
        carried = jnp.sum(jnp.where(sticks, tension - before, sliding))
        inertia = acting.inertia + R_b**2 * jnp.sum(jnp.where(sticks, self.mass, 0.0))
        alpha = acceleration(acting.load, R_b * carried, inertia)
        G = jnp.where(sticks, self.mass * R_b * alpha + tension - before, sliding)
        still = self._coefficients(surface, normal, slip, static=True)
        held = jnp.where((mode.own.segments & STRETCHED) > 0, elastic, 0.0)
        return ChainNow(
            slack_tension=acting.tension,
            tight_tension=tension[-1],
            brake_torque=R_b * jnp.sum(G),
            alpha=alpha,
            slip_speed=jnp.mean(slip),
            lever_power=acting.tension * v[0],
            damping=jnp.sum((tension - held) * stretching),
            tension=tension,
            elastic=elastic,
            total=total,
            force=G,
            limit=still * normal / self.cosine,
            normal=normal,
            lining_slip=slip,
            acceleration=jnp.where(
                sticks, R_b * alpha, (G + before - tension) / self.mass
            ),
            stretching=stretching,
        )

    def own_rates(self, z: ChainNow) -> ChainState:
        return ChainState(z.stretching, z.acceleration)

    def contact_states(self, mode: Mode, z: ChainNow) -> tuple[ContactState, ...]:
        return (
            ContactState(
                z.force, z.lining_slip, mode.own.linings.astype(z.force.dtype), z.normal
            ),
        )

    # --- guards and changes of mode --------------------------------------------------

    def guards(
        self,
        acting: AppliedLoads,
        omega: Array,
        own: ChainState,
        mode: Mode,
        z: ChainNow,
    ) -> ChainGuards:
        taut = (
            jnp.where((mode.own.segments & TAUT) > 0, z.total, -z.total)
            / self.sizes.tension
        )
        stretched = (
            jnp.where((mode.own.segments & STRETCHED) > 0, z.elastic, -z.elastic)
            / self.sizes.tension
        )
        motion = jnp.where(mode.sense > 0, omega, -omega) / self.sizes.speed
        motion = jnp.where(mode.band == HELD, 1.0, motion)
        return ChainGuards(self._lining_guards(mode, z), taut, stretched, motion)

    def limits(self, mode: Mode, none: ChainGuards) -> ChainGuards:
        taut, stretched = ((mode.own.segments & bit) > 0 for bit in (TAUT, STRETCHED))
        return none._replace(
            linings=mode.own.linings == 0, taut=taut, stretched=stretched
        )

    def _lining_guards(self, mode: Mode, z: ChainNow) -> Vector:
        left = (z.limit - jnp.abs(z.force)) / self.sizes.tension
        return contact_margin(
            mode.own.linings, left, z.lining_slip / (self.radius * self.sizes.speed)
        )

    def change(
        self, now: EventState, new: Mode, fired: ChainGuards, evaluate: EvaluateInMode
    ) -> tuple[Mode, Array]:
        old = now.mode
        linings = self._next_linings(now, fired.linings)
        taut = fired.taut.astype(jnp.int32)
        stretched = fired.stretched.astype(jnp.int32)
        segments = old.own.segments ^ (taut * TAUT + stretched * STRETCHED)
        changed = jnp.any(linings != old.own.linings)
        ahead = jnp.all(linings > 0)
        back = jnp.all(linings < 0)
        # at rest a pulley is held until, at a later instant, the last lining breaks
        # away
        held = old.band == HELD
        restarts = held & (ahead | back) & changed
        held = (held & ~restarts) | fired.motion
        band = jnp.where(ahead, SLIP, jnp.where(back, SLIP_BACK, ELASTIC))
        band = jnp.where(held, HELD, band)
        direction = jnp.where(
            now.omega < 0, -1, jnp.where(now.omega > 0, 1, jnp.where(back, -1, 1))
        )
        return new._replace(
            band=band.astype(jnp.int32),
            sense=jnp.where(restarts, direction, old.sense).astype(jnp.int32),
            own=ChainMode(linings, segments),
        ), jnp.asarray(0, jnp.int32)

    def _next_linings(
        self, now: EventState, fired: Bool[Array, " n"]
    ) -> Int[Array, " n"]:
        """State of each lining after those marked reached their limit or lost their
        slip.

        At equal static and kinetic friction its relative acceleration is still 0. Where
        the force that held it is 0 as well, as nothing presses yet, the rate of that
        force tells which way it breaks away.
        """
        linings = now.mode.own.linings
        force = now.z.force
        pulls = jnp.where(
            jnp.abs(force) > 1e-12 * self.sizes.tension, force, now.z_rate.force
        )
        past = (linings == 0) & (self._lining_guards(now.mode, now.z) < -_PAST)
        return sense_after(linings, fired | past, pulls)

    def with_stuck_speeds(
        self, omega: Array, own: ChainState, before: Mode, after: Mode
    ) -> tuple[Array, ChainState]:
        # sticking linings have exactly the speed of the pulley
        return omega, own._replace(
            v=jnp.where(after.own.linings == 0, self.radius * omega, own.v)
        )

    # --- results, stored energy, capacity --------------------------------------------

    def shown(
        self,
        tension: Array,
        omega: Array,
        own: ChainState,
        mode: Mode,
        surfaces: Surfaces,
        z: ChainNow,
    ) -> MechanismOutputs:
        f = None
        displacement = jnp.cumsum(own.e[::-1])[::-1]
        if self.shows_friction:
            f = self._coefficients(
                surfaces[0], z.normal, jnp.abs(z.lining_slip), static=False
            )
            f = jnp.broadcast_to(f, z.normal.shape)
        pair = PairNow.of(
            z.force, z.normal, z.lining_slip, mode.own.linings, z.brake_torque, f
        )
        pair = pair._replace(friction=z.force * self.cosine)
        return MechanismOutputs(
            (pair,), z.tension, elongation=displacement[0], displacement=displacement
        )

    def stored(
        self, inertia: Array, omega: Array, own: ChainState, mode: Mode
    ) -> tuple[Array, Array]:
        v = jnp.where(mode.own.linings == 0, self.radius * omega, own.v)
        kinetic = 0.5 * inertia * omega**2 + 0.5 * jnp.sum(self.mass * v**2)
        tension = jnp.maximum(self.preload + self.stiffness * own.e, 0.0)
        return kinetic, jnp.sum(tension**2 / (2 * self.stiffness))

    def own_sizes(self) -> ChainState:
        size = self.sizes
        return ChainState(
            size.tension / self.stiffness,
            jnp.ones_like(self.mass) * self.radius * size.speed,
        )

    def capacity(
        self,
        tension: Array,
        omega: Array,
        own: ChainState,
        surfaces: Surfaces,
        *,
        static: bool = False,
    ) -> Float[Array, " pairs"]:
        # linings at rest on the band, the pulley sliding past all of them
        return self.grip.torque(
            self.radius, tension, omega, surfaces[0], static=static
        )[None]
