"""The staged brake: the band rubs on a bandage of linings, and the bandage on the rim;
either pair sticks or slides."""

import dataclasses
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._base._corners import clipped
from ..brakes.band import (
    band_torque,
    limit_tensions,
    lining_ratio,
    piece_of,
    tensions_on,
)
from ..brakes.design import Bandage
from ..friction import Reads, SurfaceState, reads
from ..hybrid.arrays import Array, IntScalar, ScalarArray, Vector
from ..hybrid.struct import Struct
from ._contact import (
    acceleration,
    contact_margin,
    lifted_after,
    rim_margin,
    sense_after,
)
from ._elastic import AbstractElasticBand, BandState, ElasticNow
from ._rigid import ContactGuards, LumpedMode, rigid_mode
from .mechanism import (
    ELASTIC,
    HELD,
    OPEN,
    SLIP,
    SLIP_BACK,
    TAKE_UP,
    AppliedLoads,
    BrakeCode,
    ContactState,
    EvaluateInMode,
    EventState,
    MechanismOutputs,
    Mode,
    Pair,
    PairNow,
    Sizes,
    Surfaces,
    slips,
)
from .sliding import BandFriction, coefficients_of, where_static

# iterations for a tension under a law that depends on the pressure; otherwise it is
# linear: one is exact
_NEWTON = 8


class RimInputs(Struct):
    """Inputs of the friction of the internal pair at one instant: speed `v` (m/s),
    signed by the sense, and the state of the surfaces (`None`: the scene has none).

    - `static`: whether the pair sticks
    - `thrust`: centrifugal force `m_i r_m ω_b²` of the linings (N), and `lifted`: those
      off the rim; `None` without masses, and of a bandage at rest
    """

    v: Array
    surface: SurfaceState | None
    static: Array | bool
    thrust: Array | None = None
    lifted: Array | None = None


class InternalPair(Struct):
    """Friction between bandage and rim (model §4; K).

    M_int = R Σ F_i,   F_i = f_i N_int,i
    N_int,i = N_i + N_pre,i − m_i r_m ω_b² ≥ 0,   N_i = (T_i + T_{i−1}) sin(β_i/2)
    """

    bandage: Bandage
    radius: Array
    sine: Vector  # sin(β_i/2)

    @property
    def count(self) -> int:
        return self.sine.shape[0]

    def turning(
        self, held: RimInputs, omega_b: Array, lifted: Array | None
    ) -> RimInputs:
        """The same on a bandage that turns."""
        thrust = self.bandage.centrifugal_force(omega_b)
        return (
            held
            if thrust is None
            else dataclasses.replace(held, thrust=thrust, lifted=lifted)
        )

    def balance(self, T_0: Array, along: Vector, held: RimInputs) -> Vector:
        """`N_i + N_pre,i − m_i r_m ω_b²` for the tensions `T_1…T_n`; below 0 rods and
        springs carry it."""
        before = jnp.concatenate([T_0[None], along[:-1]])
        pressed = (along + before) * self.sine + jnp.asarray(self.bandage.preload)
        return pressed if held.thrust is None else pressed - held.thrust

    def normal(self, T_0: Array, along: Vector, held: RimInputs) -> Vector:
        """Loads `N_int,i` on the rim."""
        normal = self.balance(T_0, along, held)
        return (
            normal if held.lifted is None else jnp.where(held.lifted != 0, 0.0, normal)
        )

    def coefficients(self, N: Vector, held: RimInputs) -> Float[Array, " *n"]:
        """Coefficients of friction `f_i`, or one for all, between linings and rim under
        the loads `N` (N)."""
        p = None if self.bandage.area is None else N / jnp.asarray(self.bandage.area)
        v = jnp.broadcast_to(held.v, (self.count,))
        contact = (held.surface or SurfaceState()).contact(v, p)
        return coefficients_of(
            self.bandage.friction, contact, held.static, by_speed=self._reads(held).v
        )

    def _reads(self, held: RimInputs) -> Reads:
        heated = held.surface is not None and held.surface.T is not None
        pressed = self.bandage.area is not None
        return reads(self.bandage.friction, self.count, T=heated, p=pressed)

    def friction(self, T_0: Array, along: Vector, held: RimInputs) -> Vector:
        """Maximum forces `F_i` between linings and rim (N)."""
        N = self.normal(T_0, along, held)
        return self.coefficients(N, held) * N

    def capacity(self, T_0: Array, along: Vector, held: RimInputs) -> ScalarArray:
        """`M_int` (N·m)."""
        return self.radius * jnp.sum(self.friction(T_0, along, held))

    def _unbalance(
        self,
        T_0: Array,
        T_n: Array,
        mu: Array,
        piece: Array,
        sense: Array,
        arm: Array,
        held: RimInputs,
    ) -> Array:
        pull = sense.astype(jnp.float64) * self.capacity(
            T_0, tensions_on(T_0, T_n, mu, piece), held
        )
        return arm * (T_n - T_0) - pull

    def holding_tension(
        self,
        T_0: Array,
        mu: Array,
        piece: IntScalar,
        sense: IntScalar,
        arm: Array,
        held: RimInputs,
    ) -> ScalarArray:
        """`T_n` by which the band holds a bandage on a sliding rim,
        `R_b (T_n − T_0) = ± M_int(T_n)`, on one piece."""

        def improve(T_n: Array, _: None) -> tuple[Array, None]:
            def unbalance(T_n: Array) -> Array:
                return self._unbalance(T_0, T_n, mu, piece, sense, arm, held)

            value, slope = jax.jvp(unbalance, (T_n,), (jnp.ones_like(T_n),))
            return T_n - value / jnp.where(slope == 0, 1.0, slope), None

        if not self._reads(held).p:
            return improve(T_0, None)[0]
        # Newton from the start of the piece runs along a concave curve to its root
        # there
        limits = limit_tensions(T_0, mu)
        here = jnp.arange(limits.shape[0], dtype=jnp.int32) == piece + self.count + 1
        return jax.lax.scan(
            improve, jnp.sum(jnp.where(here, limits, 0.0)), None, length=_NEWTON
        )[0]

    def holding_piece(
        self, T_0: Array, mu: Array, sense: IntScalar, arm: Array, held: RimInputs
    ) -> IntScalar:
        """The piece on which `holding_tension` lies: a walk along all of them (their
        unbalance changes sign once)."""
        n = self.count
        limits = limit_tensions(T_0, mu)
        pieces = jnp.clip(jnp.arange(2 * n + 1, dtype=jnp.int32) - n, -n, n - 1)
        below = jax.vmap(
            lambda T_n, piece: (
                self._unbalance(T_0, T_n, mu, piece, sense, arm, held) < 0
            )
        )(limits, pieces)
        return jnp.clip(jnp.sum(below).astype(jnp.int32) - 1 - n, -n, n - 1)


class StagedGuards(NamedTuple):
    """Guards of a staged brake, or which of them fired.

    - `band`: those of the external pair
    - `internal`: friction left of an internal pair that sticks, else its slip
    - `above`, `below`: until one more lining comes to its limit on the band, or one
      less is there
    - `rim` (n,): load of each lining on the rim, `None` where none lifts off
    """

    band: ContactGuards
    internal: Array
    above: Array
    below: Array
    rim: Array | None


class StagedNow(ElasticNow):
    """Variables of a staged brake: those of its band on the bandage, and of the
    internal pair."""

    alpha_b: ScalarArray  # ω̇_b (rad/s²)
    drive: ScalarArray  # Λ that the pulley gives to the bandage (N·m)
    capacity: ScalarArray  # M_int up to which it sticks, or with which it slides (N·m)
    inner_slip: ScalarArray  # R (ω − ω_b) while it slides (m/s)
    inner_friction: Vector  # maximum forces of the linings on the rim (N)
    inner_normal: Vector  # loads on the rim, with preload and centrifugal force (N)
    rim_margin: Array | None  # as `rim_margin` (N)


def ratios(z: ElasticNow) -> Vector:
    """Tension ratios `μ_i` of the linings at the limit that counts."""
    return lining_ratio(z.limit.fz)


def signed(inner: IntScalar) -> ScalarArray:
    return inner.astype(jnp.float64)


class StagedBrake(AbstractElasticBand):
    """A band on a bandage on a rim (model §4; K).

        J ω̇ = M_load − Λ,   J_b ω̇_b = Λ − R_b (T_n − T_0)

    The internal pair sticks (`ω = ω_b`) while `|Λ| ≤ M_int`, and slides with
    `Λ = ± M_int`, which depends on the tensions along the band: on the number of
    linings at their limit there (`piece`).

    Guards: those of the band on the bandage; grip or slip of the internal pair; one
    lining more at its limit, one lining less; where linings have a centrifugal force
    the contact of each with the rim.
    """

    wrap: BandFriction
    stiffness: ScalarArray | None
    internal: InternalPair
    pairs: tuple[Pair, ...]
    sizes: Sizes

    def start(
        self, omega: Array, elongation: Array
    ) -> tuple[BandState, np.int32, LumpedMode]:
        zero = jnp.asarray(0, jnp.int32)
        lifted = None
        if self.internal.bandage.mass is not None:
            lifted = jnp.zeros(self.wrap.count, jnp.int32)
        mode = LumpedMode(self.starts_locked, zero, zero, lifted)
        return BandState(elongation if self.stretches else None, omega), OPEN, mode

    # --- all of it at one instant ----------------------------------------------------

    def _rim(
        self,
        omega: Array,
        own: BandState,
        mode: Mode,
        surface: SurfaceState | None,
        static: Array | bool,
    ) -> RimInputs:
        v = (
            self.internal.radius
            * jnp.where(mode.own.inner < 0, -1.0, 1.0)
            * (omega - own.omega_b)
        )
        return RimInputs(v, surface, static)

    def variables(
        self, acting: AppliedLoads, omega: Array, own: BandState, mode: Mode
    ) -> StagedNow:
        band = mode.band
        R_b = self.wrap.radius
        inner = mode.own.inner
        sliding = slips(band)
        held = band == HELD
        stuck = inner == 0
        T_0 = acting.tension
        n = self.wrap.count
        at = self.at_limit(acting, own.omega_b, mode)
        mu = lining_ratio(at.limit.fz)
        still = self._rim(omega, own, mode, acting.surfaces[1], stuck)
        rim = self.internal.turning(still, own.omega_b, mode.own.lifted)
        # a held bandage bears the load, or what the sliding internal pair gives
        driven = self.internal.holding_tension(
            T_0, mu, mode.own.piece, inner, R_b, still
        )
        stretched = None if self.stiffness is None else self.stiffness * own.x
        rest = where_static(stuck, T_0 + acting.load / R_b, driven)
        drawn, tight = self.tensions(T_0, stretched, band, at.upper, rest)
        slack = where_static(band == OPEN, 0.0, drawn)
        net_tension = tight - slack
        torque = band_torque(R_b, slack, tight)

        full = jnp.where(band == SLIP_BACK, -1 - n, n)
        piece = where_static(
            sliding,
            full,
            where_static(stuck, piece_of(slack, tight, mu), mode.own.piece),
        )
        along = tensions_on(slack, tight, mu, piece.astype(jnp.int32))
        friction = self.internal.friction(slack, along, rim)
        capacity = self.internal.radius * jnp.sum(friction)
        J = acting.inertia
        J_b = jnp.asarray(self.internal.bandage.inertia)
        common = acceleration(acting.load, torque, J + J_b, held)
        drive = where_static(stuck, acting.load - J * common, signed(inner) * capacity)
        alpha_b = where_static(stuck, common, acceleration(drive, torque, J_b, held))
        inner_slip = where_static(
            stuck, 0.0, self.internal.radius * (omega - own.omega_b)
        )
        power = where_static(inner < 0, -1.0, 1.0) * friction * inner_slip
        margin = None
        if rim.lifted is not None:
            margin = rim_margin(rim.lifted, self.internal.balance(slack, along, rim))
        return StagedNow(
            slack_tension=slack,
            tight_tension=tight,
            net_tension=net_tension,
            brake_torque=torque,
            alpha=where_static(stuck, alpha_b, acceleration(acting.load, drive, J)),
            alpha_b=alpha_b,
            drive=drive,
            capacity=capacity,
            inner_slip=inner_slip,
            inner_friction=friction,
            inner_normal=self.internal.normal(slack, along, rim),
            rim_margin=margin,
            **self.band_kinematics(
                acting, mode, at, drawn, (own.omega_b, alpha_b), power
            ),
        )

    def own_rates(self, z: StagedNow) -> BandState:
        return BandState(z.band_speed if self.stretches else None, z.alpha_b)

    def lining_speed(self, own: BandState) -> Array:
        return self.wrap.radius * own.omega_b

    def contact_states(self, mode: Mode, z: StagedNow) -> tuple[ContactState, ...]:
        inner = mode.own.inner
        force = jnp.where(inner < 0, -1.0, 1.0) * z.inner_friction
        force = force if self.pairs[1].apart else jnp.sum(force)
        return self.outer_rub(mode, z), ContactState(
            force, z.inner_slip, signed(inner), z.inner_normal
        )

    # --- guards and changes of mode --------------------------------------------------

    def guards(
        self,
        acting: AppliedLoads,
        omega: Array,
        own: BandState,
        mode: Mode,
        z: StagedNow,
    ) -> StagedGuards:
        inner = mode.own.inner
        n = self.wrap.count
        size = self.sizes
        stuck = inner == 0
        piece = mode.own.piece
        left = (z.capacity - jnp.abs(z.drive)) / size.torque
        slip = (omega - own.omega_b) / size.speed
        grip = contact_margin(inner, left, slip)
        # while the internal pair slides its torque depends on the linings at their
        # limit on the band; the equations are smooth only while their number stays the
        # same
        counted = ~stuck & ((mode.band == ELASTIC) | (mode.band == HELD))
        limits = limit_tensions(z.slack_tension, ratios(z))
        at = jnp.arange(2 * n + 1, dtype=jnp.int32) - n

        def limit(i: Array) -> Array:
            return jnp.sum(jnp.where(at == i, limits, 0.0))

        above = (limit(piece + 1) - z.tight_tension) / size.tension
        below = (z.tight_tension - limit(piece)) / size.tension
        above = jnp.where(counted & (piece < n - 1), above, 1.0)
        below = jnp.where(counted & (piece > -n), below, 1.0)
        rim = (
            None
            if z.rim_margin is None
            else jnp.where(mode.band == HELD, 1.0, z.rim_margin / size.tension)
        )
        return StagedGuards(
            self.band_guards(acting, own.omega_b, mode, z), grip, above, below, rim
        )

    def limits(self, mode: Mode, none: StagedGuards) -> StagedGuards:
        rim = None if none.rim is None else mode.own.lifted == 0
        return none._replace(
            band=super().limits(mode, none.band), internal=mode.own.inner == 0, rim=rim
        )

    def _grips(
        self,
        acting: AppliedLoads,
        omega: Array,
        own: BandState,
        mode: Mode,
        rest: StagedNow,
    ) -> tuple[ScalarArray, ScalarArray]:
        """`M_int` (N·m) with the band at its upper and at its lower static limit."""
        n = self.wrap.count
        T_0 = acting.tension
        rim = self._rim(omega, own, mode, acting.surfaces[1], mode.own.inner == 0)
        mu = ratios(rest)

        def at(T_n: Array, piece: int) -> Array:
            return self.internal.capacity(
                T_0, tensions_on(T_0, T_n, mu, jnp.asarray(piece, jnp.int32)), rim
            )

        return at(rest.upper, n), at(rest.lower, -1 - n)

    def change(
        self, now: EventState, new: Mode, fired: StagedGuards, evaluate: EvaluateInMode
    ) -> tuple[Mode, Array]:
        band = fired.band
        old = now.mode
        size = self.sizes
        R_b = self.wrap.radius
        inner = sense_after(
            old.own.inner, fired.internal, evaluate(new, now.omega, now.own)[1].drive
        )
        new = self.relocked(new, band)
        new = new._replace(own=new.own._replace(inner=inner))
        acting, rest = evaluate(new._replace(band=HELD), now.omega, now.own)
        T_0 = acting.tension
        locked = self.locked_in(new)
        high = R_b * (rest.upper - T_0)
        low = R_b * (rest.lower - T_0)
        grips = self._grips(acting, now.omega, now.own, new, rest)
        most, least = (
            jnp.where(inner == 0, acting.load, signed(inner) * M_int) for M_int in grips
        )
        beyond = jnp.where(least < low - size.slight_torque, -1, 0)
        beyond = jnp.where(most > high + size.slight_torque, 1, beyond)
        # at rest on both pairs a load beyond the band breaks the rim loose where that
        # is weaker, and the band stays
        stands = (old.band == HELD) | band.motion | (now.own.omega_b == 0)
        weak = self._slides_at_once(now, rest, beyond) & jnp.where(
            beyond > 0, grips[0] < high, grips[1] < -low
        )
        loose = stands & (inner == 0) & (beyond != 0) & weak & ~locked
        inner = jnp.where(loose, jnp.where(acting.load < 0, -1, 1), inner).astype(
            jnp.int32
        )
        beyond = jnp.where(loose, 0, beyond)
        new = new._replace(own=new.own._replace(inner=inner))
        carrier = now._replace(omega=now.own.omega_b)
        motion = self.onset(carrier, band, acting, jnp.where(locked, 0, beyond))
        moving = rigid_mode(motion.direction)
        if self.stretches:
            turned = new._replace(sense=motion.settled(carrier, new, old.band).sense)

            def there(mode: Mode) -> StagedNow:
                return evaluate(
                    mode, now.omega, now.own._replace(omega_b=motion.omega)
                )[1]

            moving = self.taut_mode(carrier, turned, band, there, acting, rest, motion)
        new = motion.settled(carrier, new, moving)
        piece = self._piece(now, new, fired, acting, rest)
        code = self.code_of(band, jnp.asarray(0, jnp.int32))
        code = jnp.where(locked, int(BrakeCode.SINGULAR_GEOMETRY), code)
        new = new._replace(own=new.own._replace(piece=piece))
        if old.own.lifted is not None:
            margin = evaluate(
                new, *self.with_stuck_speeds(now.omega, now.own, old, new)
            )[1].rim_margin
            assert fired.rim is not None
            lifted = lifted_after(
                old.own.lifted,
                margin,
                fired.rim,
                new.band == HELD,
                self.sizes.slight_tension,
            )
            new = new._replace(own=new.own._replace(lifted=lifted))
        return new, code

    def _slides_at_once(
        self, now: EventState, rest: StagedNow, beyond: Array
    ) -> Array | bool:
        """Whether a band that is to be moved that way slides at once: an elastic one
        does where it is at its limit."""
        if not self.stretches:
            return True
        tension = self.tension_of(now.own.x, now.mode, now.z)
        rounding = self.sizes.slight_tension
        return jnp.where(
            beyond > 0,
            tension >= rest.upper - rounding,
            tension <= rest.lower + rounding,
        )

    def _piece(
        self,
        now: EventState,
        new: Mode,
        fired: StagedGuards,
        acting: AppliedLoads,
        rest: StagedNow,
    ) -> IntScalar:
        """Number of linings at their limit on the band after the event."""
        n = self.wrap.count
        old = now.mode
        R_b = self.wrap.radius
        # under a lever that only begins to pull everything is 0: take the first moment
        # after
        T_0 = jnp.maximum(acting.tension, 1e-9 * self.sizes.tension)
        mu = ratios(rest)
        ratio = rest.limit.other
        rim = self._rim(now.omega, now.own, new, acting.surfaces[1], False)
        driven = self.internal.holding_piece(T_0, mu, new.own.inner, R_b, rim)
        counted = (
            (old.band == new.band)
            & (old.own.inner == new.own.inner)
            & (old.own.inner != 0)
        )
        if self.stretches:
            tension = jnp.clip(
                self.tension_of(now.own.x, old, now.z), T_0 / ratio, T_0 * ratio
            )
            driven = jnp.where(new.band == ELASTIC, piece_of(T_0, tension, mu), driven)
        step = fired.above.astype(jnp.int32) - fired.below.astype(jnp.int32)
        piece = jnp.where(
            counted & (step != 0), jnp.clip(old.own.piece + step, -n, n - 1), driven
        )
        piece = jnp.where(
            new.band == SLIP, n, jnp.where(new.band == SLIP_BACK, -1 - n, piece)
        )
        slack = (new.band == OPEN) | (new.band == TAKE_UP)
        return jnp.where(slack, 0, piece).astype(jnp.int32)

    def with_stuck_speeds(
        self, omega: Array, own: BandState, before: Mode, after: Mode
    ) -> tuple[Array, BandState]:
        turned = (before.band != OPEN) & (after.sense != before.sense)
        stopped = (after.band == HELD) | turned
        sticks = after.own.inner == 0
        omega_b = jnp.where(stopped, 0.0, jnp.where(sticks, omega, own.omega_b))
        return jnp.where(sticks & stopped, 0.0, omega), own._replace(omega_b=omega_b)

    # --- results, stored energy, capacity --------------------------------------------

    def shown(
        self,
        tension: Array,
        omega: Array,
        own: BandState,
        mode: Mode,
        surfaces: Surfaces,
        z: StagedNow,
    ) -> MechanismOutputs:
        inner = mode.own.inner
        n = (self.wrap.count,)
        on_rim = None
        if self.shows_friction:
            held = self._rim(omega, own, mode, surfaces[1], False)
            on_rim = jnp.broadcast_to(
                self.internal.coefficients(z.inner_normal, held), n
            )
        # linings that stick to the rim share the torque as the maximum friction that
        # each can give
        share = z.drive / jnp.where(z.capacity > 0, z.capacity, 1.0)
        friction = where_static(inner == 0, share, signed(inner)) * z.inner_friction
        slip = jnp.broadcast_to(z.inner_slip, n)
        sense = jnp.broadcast_to(inner, n)
        internal = PairNow.of(
            friction, z.inner_normal, slip, sense, z.drive, on_rim, z.capacity
        )
        external, along = self.first_shown(tension, own.omega_b, mode, surfaces, z)
        return MechanismOutputs(
            (external, internal), along, elongation=own.x, bandage_speed=own.omega_b
        )

    def stored(
        self, inertia: Array, omega: Array, own: BandState, mode: Mode
    ) -> tuple[Array, Array]:
        kinetic = (
            0.5 * inertia * omega**2
            + 0.5 * self.internal.bandage.inertia * own.omega_b**2
        )
        return kinetic, jnp.zeros_like(
            kinetic
        ) if self.stiffness is None else 0.5 * self.stiffness * own.x**2

    def own_sizes(self) -> BandState:
        return BandState(
            None if self.stiffness is None else self.sizes.tension / self.stiffness,
            self.sizes.speed,
        )

    def capacity(
        self,
        tension: Array,
        omega: Array,
        own: BandState,
        surfaces: Surfaces,
        *,
        static: bool = False,
    ) -> Float[Array, " pairs"]:
        R_b = self.wrap.radius
        outer = self.grip.torque(R_b, tension, omega, surfaces[0], static=static)
        # a held bandage is braced by the static friction of the band; the rim slides in
        # it with the pulley's speed
        still = jnp.zeros_like(omega)
        no = jnp.asarray(False)
        fz = self.wrap.limit(tension, still, surfaces[0], no, jnp.asarray(True)).fz
        mu = lining_ratio(fz)
        speed = self.internal.radius * jnp.abs(omega)
        rim = RimInputs(still if static else speed, surfaces[1], jnp.asarray(static))
        sense = jnp.where(omega < 0, -1, 1).astype(jnp.int32)
        piece = self.internal.holding_piece(tension, mu, sense, R_b, rim)
        T_n = self.internal.holding_tension(tension, mu, piece, sense, R_b, rim)
        T_n = clipped(T_n, tension / jnp.prod(mu), tension * jnp.prod(mu))
        inner = self.internal.capacity(
            tension, tensions_on(tension, T_n, mu, piece), rim
        )
        return jnp.stack([outer, inner])
