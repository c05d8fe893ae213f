"""The bandage on springs: every lining of a staged brake is a body of its own that
sticks or slides on the band and on the rim."""

from typing import Any, ClassVar, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from .._base._corners import clipped
from ..brakes.band import affine_tensions, band_torque, tension_ratio
from ..brakes.design import Bandage
from ..friction import Reads, SurfaceState, reads
from ..hybrid import largest
from ..hybrid.arrays import Array, Marks, ScalarArray, TwoArrays, Vector, numpy_of
from ._contact import (
    acceleration,
    contact_margin,
    driven_way,
    exceeded,
    lifted_after,
    limit_margins,
    rim_margin,
    sense_after,
    speed_after,
)
from .mechanism import (
    HELD,
    OPEN,
    SLIP,
    SLIP_BACK,
    AbstractMechanism,
    AppliedLoads,
    BrakeCode,
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

# --- at rest -------------------------------------------------------------------------


#: intervals of the grid on which a share is searched for, and how often it is narrowed
#: to one of them: to 2/32³, near enough for so many Newton steps to converge
_GRID = 32
_ROUNDS = 3
_NEWTON = 4


class Resting(NamedTuple):
    """Equations of the linings on a pulley at rest; some linings may still move.

        fixed:   R_b (T_i − T_{i−1}) = θ M_i + Q_i, but T_{i−1}/μ_i ≤ T_i ≤ T_{i−1} μ_i;   M_i = q_i (T_i+T_{i−1}) + p_i
        moving:  T_i = a_i T_{i−1} + b_i,   λ_i = σ_i M_i

    - `arm` `R_b`; `mu`: static ratios on the band; `pull` `Q_i`
    - `grip` `q_i = R f_i s_i` and `floor` `p_i = R f_i (N_pre,i − m_i r_m ω_i²)` of the
      rim, 0 where a lining has lifted off
    - `gain` `a_i`, `offset` `b_i` and `sense` `σ_i` of linings that move
    """

    fixed: Marks
    arm: ScalarArray
    mu: Vector
    grip: Vector
    floor: Vector
    pull: Vector
    gain: Vector
    offset: Vector
    sense: Vector


class LoadShare(NamedTuple):
    """A load shared by the linings: the tensions, and at rest the load torques between
    which the pulley stays there."""

    tension: Vector
    least: ScalarArray
    most: ScalarArray


def unclipped_tension(r: Resting, before: Array, share: Array) -> Array:
    """`T_i` of fixed linings for a share `θ` of their grip on the rim, whatever the
    limits on the band."""
    return ((r.arm + share * r.grip) * before + share * r.floor + r.pull) / (
        r.arm - share * r.grip
    )


def resting_tensions(r: Resting, T_0: ScalarArray, share: ScalarArray) -> Vector:
    """Tensions `T_1…T_n` for a share `θ` of the grip on the rim."""

    def lining(before: Array, here: Resting) -> TwoArrays:
        T = clipped(
            unclipped_tension(here, before, share), before / here.mu, before * here.mu
        )
        T = jnp.where(here.fixed, T, here.gain * before + here.offset)
        return T, T

    each = r._replace(arm=jnp.broadcast_to(r.arm, r.mu.shape))
    return jax.lax.scan(lining, T_0, each)[1]


def tensions_before(T_0: ScalarArray, along: Vector) -> Vector:
    """Tensions `T_0…T_{n−1}` ahead of the linings."""
    return jnp.concatenate([T_0[None], along[:-1]])


def yields_on_band(
    r: Resting, T_0: ScalarArray, along: Vector, way: Int[Array, ""]
) -> Marks:
    """Linings that break away on the band (the others on the rim) when the pulley
    starts to move `way` (±1)."""
    before = tensions_before(T_0, along)
    on_rim = unclipped_tension(r, before, way.astype(jnp.float64))
    return jnp.where(way > 0, on_rim >= before * r.mu, on_rim <= before / r.mu)


def transmitted_torque(r: Resting, T_0: ScalarArray, along: Vector) -> ScalarArray:
    """Torque `Σ λ_i` (N·m) from the pulley to all linings."""
    before = tensions_before(T_0, along)
    moving = r.sense * (r.grip * (along + before) + r.floor)
    return jnp.sum(jnp.where(r.fixed, r.arm * (along - before) - r.pull, moving))


def holding_range(r: Resting, T_0: ScalarArray) -> TwoArrays:
    """Load torques between which the fixed linings hold the pulley: each at the limit
    of its weaker pair (θ = ∓1)."""
    ends = jnp.asarray([-1.0, 1.0])
    least, most = jax.vmap(
        lambda share: transmitted_torque(r, T_0, resting_tensions(r, T_0, share))
    )(ends)
    return least, most


def share_load(r: Resting, T_0: ScalarArray, load: ScalarArray) -> LoadShare:
    """The load carried by all fixed linings with one share `θ` of their grip on the rim.

    `Σ λ_i(θ) = M_load` is solved for `θ`. Its left side has corners where linings come
    to their limit on the band. It rises with `θ` while all linings are fixed. Where
    springs move some of them it may fall, as these press harder on the rim when the
    tension before them rises; then the last root with a rise counts. Narrowing grids
    bracket the root, Newton's method finds it, and one last Newton step with a frozen
    slope carries the exact derivative. A load outside the range ends at `θ = ±1`.
    """
    frozen, T_f, load_f = jax.lax.stop_gradient((r, T_0, load))
    steps = jnp.linspace(0.0, 1.0, _GRID + 1)

    def sum_at(r: Resting, T_0: Array, share: Array) -> Array:
        return transmitted_torque(r, T_0, resting_tensions(r, T_0, share))

    def narrow(_: Array, ends: TwoArrays) -> TwoArrays:
        grid = ends[0] + (ends[1] - ends[0]) * steps
        below = jax.vmap(lambda share: sum_at(frozen, T_f, share))(grid) < load_f
        rising = jnp.max(
            jnp.where(below[:-1] & ~below[1:], jnp.arange(_GRID, dtype=jnp.int32), -1)
        )
        i = jnp.where(rising >= 0, rising, jnp.where(below[-1], _GRID - 1, 0)).astype(
            jnp.int32
        )
        return grid[i], grid[i + 1]

    def slope_at(share: Array) -> TwoArrays:
        value, slope = jax.jvp(
            lambda share: sum_at(frozen, T_f, share), (share,), (jnp.ones_like(share),)
        )
        return value, jnp.where(slope > 0, slope, jnp.inf)

    low, high = jax.lax.fori_loop(
        0, _ROUNDS, narrow, (-jnp.ones_like(T_f), jnp.ones_like(T_f))
    )

    def newton(_: Array, share: Array) -> Array:
        value, slope = slope_at(share)
        return jnp.clip(share - (value - load_f) / slope, low, high)

    share = jax.lax.fori_loop(0, _NEWTON, newton, 0.5 * (low + high))
    least, most = holding_range(r, T_0)
    inside = (least < load) & (load < most)
    correction = (sum_at(r, T_0, share) - load) / slope_at(share)[1]
    share = jnp.where(inside, share - correction, share)
    return LoadShare(resting_tensions(r, T_0, share), least, most)


# --- sprung linings -----------------------------------------------------------------


class SprungState(NamedTuple):
    """Elongations `e_j` (n − 1,) of the springs at the band circle (m), speeds `ω_i`
    (n,) of the linings (rad/s)."""

    stretch: Any
    speeds: Any


class SprungMode(NamedTuple):
    """Mode of every lining.

    - `outer` (n,): 0 while lining `i` is held on the band, else the sign of `ω_i`
      (meaningless while the brake is open)
    - `inner` (n,): 0 while it sticks on the rim, else the sign of `ω − ω_i`
    - `lifted` (n,): 1 for linings that have lifted off the rim (`inner` is then not 0,
      its sign meaningless); `None` without centrifugal force

    Both 0 means that the lining is at rest on a pulley at rest. The label of the band
    is `OPEN` while the lever does not pull, `HELD` while every lining rests on the
    band, else `SLIP`, or `SLIP_BACK` with the pulley in reverse. Leaves may have
    leading axes (rows of a record).
    """

    outer: Any
    inner: Any
    lifted: Any = None
    locks = None  # a lining that becomes self-locking ends the run
    internal = None

    @property
    def fixed(self) -> Bool[Array, "*row n"]:
        """Linings that neither move on the band nor on the rim."""
        return (self.outer == 0) & (self.inner == 0)

    @property
    def rests(self) -> Bool[Array, "*row"]:
        """Whether the pulley is at rest: a lining that is fixed holds it."""
        return jnp.any(self.fixed, axis=-1)

    def slides(self, mode: Mode) -> Int[Array, "*row"]:
        """The internal pair as a whole: 0 while every lining sticks on the rim, else
        the sense of the pulley (±1)."""
        xp = numpy_of(self.inner)
        return xp.where(xp.all(self.inner == 0, axis=-1), 0, mode.sense)

    @property
    def contacts(self) -> dict[str, Array]:
        return {"lining_external": self.outer, "lining_internal": self.inner}


class Coefficients(NamedTuple):
    """Tension ratios `μ_i` on the band and coefficients `f_i` on the rim, sticking and
    sliding."""

    mu_static: Vector
    mu_kinetic: Vector
    grip_static: Vector  # f_i tan(β_i/2) on the band
    inner_static: Vector
    inner_kinetic: Vector


# --- the mechanism ------------------------------------------------------------------


class SprungGuards(NamedTuple):
    """Guards of a bandage on springs, or which of them fired.

    - `lever`: its force
    - `high`, `low`: at rest distances of the load from both ends of what the brake
      holds; else `high` is the speed of the pulley in its sense
    - `inner`, `outer` (n,): for each lining the friction that is left where the pair
      sticks, else its slip
    - `locking`: distance of the linings from it, `None` where that cannot change
    - `rim` (n,): load of each lining on the rim, `None` where none can lift off
    """

    lever: Array
    high: Array
    low: Array
    inner: Array
    outer: Array
    locking: Array | None
    rim: Array | None


class SprungNow(MechanismNow):
    """Variables of a bandage on springs; `brake_torque` is `R_b (T_n − T_0)`."""

    damping: ScalarArray  # of all springs (W)
    tension: Vector  # T_i (N)
    outer_force: Vector  # G_i = T_i − T_{i−1}, by which the band holds lining i (N)
    normal: Vector  # N_i (N)
    load: Vector  # N_int,i on the rim (N)
    rim_margin: Array | None  # as `rim_margin` (N)
    inner_torque: Vector  # λ_i that the pulley gives to lining i (N·m)
    capacity: Vector  # M_i up to which it sticks, or with which it slides (N·m)
    inner_slip: Vector  # R (ω − ω_i) (m/s)
    outer_slip: Vector  # R_b ω_i (m/s)
    accelerations: Vector  # ω̇_i (rad/s²)
    stretching: Float[Array, " springs"]  # ė_j (m/s)
    spring_torque: Vector  # Q_i (N·m)
    # maximum |G_i| up to which it is held (N), of the tensions there are
    outer_limit: Vector
    resting: Resting  # the linings as equations for the tensions
    locking: ScalarArray  # by how much the lining nearest to locking is away from it
    # load torques between which a pulley at rest stays there (N·m), else 0
    least_hold: ScalarArray
    most_hold: ScalarArray


class SprungBandage(AbstractMechanism):
    """A staged brake on a rigid band whose linings are separate bodies, with springs
    between neighbours (model §4).

    Per lining (`G_i = T_i − T_{i−1}` from the band, `λ_i` from the rim, `Q_i` from the
    springs to its neighbours):

        J ω̇ = M_load − Σ λ_i,  J_i ω̇_i = λ_i + Q_i − R_b G_i,  N_i = (T_i + T_{i−1})
        s_i M_i = R f_i N_int,i,  N_int,i = N_i + N_pre,i − m_i r_m ω_i² ≥ 0
        slides on the band:                     T_i = T_{i−1} μ_i^{±1}, ± = sign of ω_i
        held on the band, slides on the rim:    R_b (T_i − T_{i−1}) = σ_i M_i + Q_i, linear in T_i
        sticks on the rim, slides on the band:  λ_i = R_b G_i − Q_i + J_i ω̇, ω̇ common to pulley and such linings
        neither moves (pulley at rest):         `_at_rest`

    Springs: `S_j = K_j e_j + D_j ė_j`, `ė_j = R_b (ω_j − ω_{j+1})`,
    `Q_i = R_b (S_{i−1} − S_i)`.

    Guards: lever, pulley (two), then two for each lining, `inner` and `outer`, locking
    where friction fades, and where linings have a centrifugal force the contact of each
    with the rim:

        sticks on the rim:      M_s,i − |λ_i|                             slides there: σ_i (ω − ω_i)
        held on the band:       f_s,i z_i (T_i + T_{i−1}) − |T_i − T_{i−1}|     slides there: sgn(ω_i) ω_i
        neither moves:          what both pairs could hold against its springs
        pulley:                 its speed in motion; at rest how far the load is from both ends of what holds it

    The second line is `T_{i−1}/μ_s ≤ T_i ≤ T_{i−1} μ_s`. Speeds that vanish together
    with the pulley's have no guard of their own: its guard decides for all linings that
    come to rest with it.

    - `inertias` `J_i` (kg·m²); `stiffness` `K_j` (N/m), `damping` `D_j` (N·s/m) of the
      n − 1 springs
    """

    inertias: Vector
    band_radius: ScalarArray
    track_radius: ScalarArray
    grip: LiningFriction
    bandage: Bandage
    stiffness: Float[Array, " springs"]
    damping: Float[Array, " springs"]
    pairs: tuple[Pair, ...]
    sizes: Sizes
    distribution: ClassVar[str] = (
        "every lining from its own balance; at rest all mobilise one share of their grip on the rim"
    )
    resolved: ClassVar[bool] = True
    damps: ClassVar[bool] = True

    @property
    def count(self) -> int:
        return self.inertias.shape[0]

    @property
    def fades(self) -> bool:
        """Whether a coefficient of friction depends on temperatures of the scene,
        states of its law, or on time."""
        if any(pair.memory is not None or pair.law.over_time for pair in self.pairs):
            return True
        return self.grip.reads.T or self._inner_reads.T

    def start(
        self, omega: Array, elongation: Array
    ) -> tuple[SprungState, np.int32, SprungMode]:
        sense = jnp.where(omega < 0, -1, 1).astype(jnp.int32)
        zeros = jnp.zeros(self.count, jnp.int32)
        lifted = None if self.bandage.mass is None else zeros
        contacts = SprungMode(jnp.broadcast_to(sense, (self.count,)), zeros, lifted)
        return (
            SprungState(
                jnp.zeros(self.count - 1), jnp.broadcast_to(omega, (self.count,))
            ),
            OPEN,
            contacts,
        )

    # --- all of it at one instant ----------------------------------------------------

    def _coefficients(
        self, omega: Array, own: SprungState, mode: Mode, surfaces: Surfaces
    ) -> Coefficients:
        """Friction of all linings; their own slip speeds, smooth past the end of the
        mode, decide while they slide."""
        outer_v = self.band_radius * mode.own.outer.astype(jnp.float64) * own.speeds
        inner_v = (
            self.track_radius
            * mode.own.inner.astype(jnp.float64)
            * (omega - own.speeds)
        )

        on_band, on_rim = self._friction(surfaces, outer_v, inner_v, static=False)
        band_static, rim_static = self._friction(
            surfaces, outer_v, inner_v, static=True
        )
        grip_static = band_static * self.grip.tangent
        return Coefficients(
            mu_static=tension_ratio(grip_static)[0],
            mu_kinetic=tension_ratio(on_band * self.grip.tangent)[0],
            grip_static=grip_static,
            inner_static=rim_static,
            inner_kinetic=on_rim,
        )

    def _friction(
        self, surfaces: Surfaces, outer_v: Array, inner_v: Array, *, static: bool
    ) -> tuple[Vector, Vector]:
        """Coefficients of both pairs at slip speeds (m/s) signed by the sense."""
        coefficients = []
        read = (self.grip.reads, self._inner_reads)
        for pair, v, surface, reads_of in zip(
            self.pairs, (outer_v, inner_v), surfaces, read, strict=True
        ):
            contact = (surface or SurfaceState()).contact(
                jnp.broadcast_to(v, (self.count,))
            )
            f = coefficients_of(pair.law, contact, static, by_speed=reads_of.v)
            coefficients.append(jnp.broadcast_to(f, (self.count,)))
        return coefficients[0], coefficients[1]

    @property
    def _inner_reads(self) -> Reads:
        return reads(
            self.pairs[1].law, self.count, T=self.pairs[1].heat is not None, p=False
        )

    def _springs(self, own: SprungState) -> TwoArrays:
        """Forces of the dampers, a part of `S_j` (N), and torques `Q_i` on the linings
        (N·m)."""
        damped = -self.damping * self.band_radius * jnp.diff(own.speeds)
        force = self.stiffness * own.stretch + damped
        return damped, self.band_radius * (
            jnp.pad(force, (1, 0)) - jnp.pad(force, (0, 1))
        )

    def _seat(self, own: SprungState) -> Array:
        """`N_pre,i − m_i r_m ω_i²` (N)."""
        preload = jnp.asarray(self.bandage.preload)
        thrust = self.bandage.centrifugal_force(own.speeds)
        return preload if thrust is None else preload - thrust

    def _resting(
        self, own: SprungState, mode: Mode, c: Coefficients, Q: Array
    ) -> Resting:
        """The linings as equations for the tensions along the band."""
        stuck = mode.own.inner == 0
        held = mode.own.outer == 0
        sense = mode.own.inner.astype(jnp.float64)
        R_b = self.band_radius
        f = jnp.where(stuck, c.inner_static, c.inner_kinetic)
        if mode.own.lifted is not None:
            f = jnp.where(mode.own.lifted != 0, 0.0, f)
        grip = self.track_radius * f * self.grip.sine
        floor = self.track_radius * f * self._seat(own)
        sliding = jnp.where(mode.own.outer > 0, c.mu_kinetic, 1 / c.mu_kinetic)
        gain = jnp.where(held, (R_b + sense * grip) / (R_b - sense * grip), sliding)
        offset = jnp.where(held, (sense * floor + Q) / (R_b - sense * grip), 0.0)
        return Resting(
            mode.own.fixed, R_b, c.mu_static, grip, floor, Q, gain, offset, sense
        )

    def variables(
        self, acting: AppliedLoads, omega: Array, own: SprungState, mode: Mode
    ) -> SprungNow:
        R_b = self.band_radius
        stuck = mode.own.inner == 0
        held = mode.own.outer == 0
        rests = mode.own.rests
        T_0 = jnp.where(mode.band == OPEN, 0.0, acting.tension)
        c = self._coefficients(omega, own, mode, acting.surfaces)
        (damped, Q) = self._springs(own)
        r = self._resting(own, mode, c, Q)
        lifted = mode.own.lifted

        def at_rest() -> LoadShare:
            return share_load(r, T_0, acting.load)

        def in_motion() -> LoadShare:
            zero = jnp.zeros_like(T_0)
            return LoadShare(affine_tensions(T_0, r.gain, r.offset), zero, zero)

        shared = jax.lax.cond(rests, at_rest, in_motion)
        along = shared.tension
        before = tensions_before(T_0, along)
        G = along - before
        total = along + before
        capacity = r.grip * total + r.floor
        needed = R_b * G - Q
        slid = r.sense * capacity
        inertia = acting.inertia + jnp.sum(jnp.where(stuck, self.inertias, 0.0))
        taken = jnp.sum(jnp.where(stuck, needed, slid))
        alpha = acceleration(acting.load, taken, inertia, rests)
        torque = jnp.where(stuck, needed + self.inertias * alpha, slid)
        not_stuck = acceleration(torque, needed, self.inertias, held)
        stretching = -R_b * jnp.diff(own.speeds)
        on_rim = self.track_radius * c.inner_static * self.grip.sine / R_b
        load = total * self.grip.sine + self._seat(own)
        margin = None
        if lifted is not None:
            margin = rim_margin(lifted, load)
            load = jnp.where(lifted != 0, 0.0, load)
        return SprungNow(
            slack_tension=T_0,
            tight_tension=along[-1],
            brake_torque=band_torque(R_b, T_0, along[-1]),
            alpha=alpha,
            slip_speed=R_b * jnp.mean(own.speeds),
            lever_power=jnp.zeros_like(T_0),
            damping=jnp.sum(damped * stretching),
            tension=along,
            outer_force=G,
            normal=total * self.grip.sine,
            load=load,
            rim_margin=margin,
            inner_torque=torque,
            capacity=capacity,
            inner_slip=self.track_radius * (omega - own.speeds),
            outer_slip=R_b * own.speeds,
            accelerations=jnp.where(stuck, alpha, not_stuck),
            stretching=stretching,
            spring_torque=Q,
            outer_limit=c.grip_static * total,
            resting=r,
            locking=1 - jnp.maximum(largest(c.grip_static), largest(on_rim)),
            least_hold=shared.least,
            most_hold=shared.most,
        )

    def own_rates(self, z: SprungNow) -> SprungState:
        return SprungState(z.stretching, z.accelerations)

    def lining_speed(self, own: SprungState) -> Array:
        return self.band_radius * own.speeds

    def contact_states(self, mode: Mode, z: SprungNow) -> tuple[ContactState, ...]:
        outer = mode.own.outer
        inner = mode.own.inner
        on_band = jnp.where(outer == 0, 0.0, z.outer_slip)
        on_rim = jnp.where(inner == 0, 0.0, z.inner_slip)
        return (
            ContactState(z.outer_force, on_band, outer.astype(jnp.float64), z.normal),
            ContactState(
                z.inner_torque / self.track_radius,
                on_rim,
                inner.astype(jnp.float64),
                z.load,
            ),
        )

    # --- guards ----------------------------------------------------------------------

    def guards(
        self,
        acting: AppliedLoads,
        omega: Array,
        own: SprungState,
        mode: Mode,
        z: SprungNow,
    ) -> SprungGuards:
        size = self.sizes
        is_open = mode.band == OPEN
        rests = mode.own.rests
        lever = jnp.where(is_open, -acting.tension, acting.tension) / size.tension
        turning = jnp.where(
            is_open, 1.0, mode.sense.astype(jnp.float64) * omega / size.speed
        )
        above, below = limit_margins(acting.load, z.least_hold, z.most_hold)
        high = jnp.where(rests, above / size.torque, turning)
        low = jnp.where(rests, below / size.torque, 1.0)
        rim = None
        if z.rim_margin is not None:
            rim = jnp.where(mode.own.outer == 0, 1.0, z.rim_margin / size.tension)
        linings = self._lining_guards(omega, own, mode, z)
        return SprungGuards(
            lever, high, low, *linings, z.locking if self.fades else None, rim
        )

    def limits(self, mode: Mode, none: SprungGuards) -> SprungGuards:
        own = mode.own
        rests = mode.own.rests
        rim = None if none.rim is None else own.lifted == 0
        return none._replace(
            high=rests, low=rests, inner=own.inner == 0, outer=own.outer == 0, rim=rim
        )

    def _lining_guards(
        self, omega: Array, own: SprungState, mode: Mode, z: SprungNow
    ) -> TwoArrays:
        stuck = mode.own.inner == 0
        held = mode.own.outer == 0
        torque_scale = self.sizes.torque / self.count
        left = (z.capacity - jnp.abs(z.inner_torque)) / torque_scale
        inner = contact_margin(
            mode.own.inner, left, (omega - own.speeds) / self.sizes.speed
        )
        # a lining that is held on the band slips on the rim at the pulley's speed, whose
        # guard decides
        unguarded = held & ~stuck
        if mode.own.lifted is not None:
            unguarded = unguarded | (mode.own.lifted != 0)
        inner = jnp.where(unguarded, 1.0, inner)
        inner = jnp.where(mode.own.fixed, self._spring_margin(z) / torque_scale, inner)
        left = (z.outer_limit - jnp.abs(z.outer_force)) / self.sizes.tension
        outer = contact_margin(mode.own.outer, left, own.speeds / self.sizes.speed)
        # fixed linings are bounded by their limits on the band; stuck ones move with
        # the pulley
        return inner, jnp.where(stuck | (mode.band == OPEN), 1.0, outer)

    def _spring_margin(self, z: SprungNow) -> Array:
        """Torque (N·m) that both pairs of a fixed lining can hold, less that of its
        springs."""
        r = z.resting
        Q = z.spring_torque
        before = tensions_before(z.slack_tension, z.tension)
        most = jnp.where(Q > 0, before * r.mu, before / r.mu)
        return (
            r.grip * (most + before)
            + r.floor
            + self.band_radius * jnp.abs(most - before)
            - jnp.abs(Q)
        )

    # --- changes of mode -------------------------------------------------------------

    def change(
        self, now: EventState, new: Mode, fired: SprungGuards, evaluate: EvaluateInMode
    ) -> tuple[Mode, Array]:
        old = now.mode
        omega = now.omega
        own = now.own
        size = self.sizes
        acting, z = evaluate(new, omega, own)
        T_0 = acting.tension
        rounding = size.slight_tension
        pulls = (rounding < T_0) | ((jnp.abs(T_0) <= rounding) & (acting.pull > 0))
        was_open = old.band == OPEN
        rests = old.own.rests
        broke = fired.inner
        gone = fired.outer
        new = new._replace(own=self._each_lining(omega, own, new, z, broke, gone))

        # where the lever begins to pull, linings that move slide on the band, the others
        # are held on it up to their limit
        grips = was_open & pulls
        starts = grips & (omega == 0)
        sense = jnp.where(
            grips & (omega != 0), jnp.sign(omega).astype(jnp.int32), old.sense
        )
        outer = jnp.where(grips, jnp.sign(own.speeds).astype(jnp.int32), new.own.outer)
        new = new._replace(
            own=new.own._replace(outer=outer),
            sense=sense,
            band=jnp.where(pulls, HELD, OPEN),
        )

        # pulley and linings come to rest together, start together, or pass through
        stops = ~was_open & ~rests & fired.high
        breaks = rests & (fired.high | fired.low)
        with_pulley = (old.own.inner == 0) | (old.own.outer == 0) | broke | gone
        together = jnp.where(
            breaks,
            old.own.fixed & ~broke,
            jnp.where(starts, own.speeds == 0, with_pulley),
        )
        forced = jnp.where(breaks, jnp.where(fired.high, 1, -1), 0)
        settled = self._settled(omega, own, new, together, forced, evaluate)
        decides = pulls & (stops | breaks | starts)
        new = jax.tree.map(
            lambda a, b: jnp.where(decides, a, b).astype(jnp.int32), settled, new
        )

        # while open, `outer` says nothing and no lining is held
        outer = jnp.where(pulls, new.own.outer, new.sense).astype(jnp.int32)
        moving = jnp.where(new.sense > 0, SLIP, SLIP_BACK)
        band = jnp.where(pulls, jnp.where(jnp.all(outer == 0), HELD, moving), OPEN)
        new = new._replace(
            own=new.own._replace(outer=outer), band=band.astype(jnp.int32)
        )
        locks = jnp.asarray(False) if fired.locking is None else fired.locking
        # where friction jumps past the limit, other guards fire before that of locking
        if self.fades:
            locks = locks | (z.locking < 0)
        if old.own.lifted is not None:
            new = self._with_lift_off(now, new, fired, evaluate)
        return new, jnp.where(locks, BrakeCode.SINGULAR_GEOMETRY, 0)

    def _with_lift_off(
        self, now: EventState, new: Mode, fired: SprungGuards, evaluate: EvaluateInMode
    ) -> Mode:
        """The new mode with the linings that lift off the rim or touch it again."""
        before = now.mode.own
        assert fired.rim is not None
        omega, own = self.with_stuck_speeds(now.omega, now.own, now.mode, new)
        z = evaluate(new, omega, own)[1]
        lifted = lifted_after(
            before.lifted,
            z.rim_margin,
            fired.rim,
            new.own.outer == 0,
            self.sizes.slight_tension,
        )
        # a lining that lifts off slides the way of the torque that it had before, and
        # touches again at the slip that it has
        slip = jnp.sign(omega - own.speeds).astype(jnp.int32)
        inner = new.own.inner
        inner = sense_after(inner, (lifted != 0) & (inner == 0), z.inner_torque)
        touches = (lifted == 0) & (before.lifted != 0) & (slip != 0)
        inner = jnp.where(touches, slip, inner).astype(jnp.int32)
        return new._replace(own=new.own._replace(inner=inner, lifted=lifted))

    def _each_lining(
        self,
        omega: Array,
        own: SprungState,
        mode: Mode,
        z: SprungNow,
        broke: Array,
        gone: Array,
    ) -> SprungMode:
        """Mode of each lining after its own guards fired.

        Where pulley and lining are both without speed and the pulley starts, the lining
        sticks in its stronger pair.
        """
        old = mode.own
        stuck = old.inner == 0
        held = old.outer == 0
        fixed = old.fixed
        rests = old.rests
        slides = ~stuck & ~held
        still = slides & (gone | broke) & (own.speeds == 0) & (omega == 0)
        band_yields = yields_on_band(z.resting, z.slack_tension, z.tension, mode.sense)
        on_band = slides & jnp.where(still, ~band_yields, gone)
        on_rim = slides & jnp.where(still, band_yields, broke & ~gone)
        inner = sense_after(old.inner, stuck & ~fixed & broke, z.inner_torque)
        inner = jnp.where(
            on_band, jnp.where(rests, 0, mode.sense), jnp.where(on_rim, 0, inner)
        )
        outer = sense_after(old.outer, held & ~stuck & gone, z.outer_force)
        outer = jnp.where(
            on_band, 0, jnp.where(on_rim, jnp.where(rests, 0, mode.sense), outer)
        )
        # springs tear a lining off both: it moves against a pulley at rest
        torn = fixed & broke
        way = driven_way(z.spring_torque)
        outer = jnp.where(torn, way, outer)
        inner = jnp.where(torn, -way, inner)
        return old._replace(
            outer=outer.astype(jnp.int32), inner=inner.astype(jnp.int32)
        )

    def _settled(
        self,
        omega: Array,
        own: SprungState,
        new: Mode,
        together: Marks,
        forced: Array,
        evaluate: EvaluateInMode,
    ) -> Mode:
        """The mode of a pulley without speed, and of the linings `together` with it.

        These rest if the load is within what all of them hold, each at the limit of its
        weaker pair. Otherwise the pulley starts in the sense of the load, or of the
        guard that fired (`forced`, ±1), and each lining breaks away at its weaker pair.
        """
        own_mode = new.own._replace(
            outer=jnp.where(together, 0, new.own.outer),
            inner=jnp.where(together, 0, new.own.inner),
        )
        trial = new._replace(own=own_mode)
        load = evaluate(trial, jnp.zeros_like(omega), own)[0].load
        acting, z = evaluate(trial, omega, own)
        T_0 = acting.tension
        r = z.resting._replace(fixed=together)
        least, most = holding_range(r, T_0)
        way = jnp.where(
            forced == 0, exceeded(load, least, most, self.sizes.slight_torque), forced
        )
        # nothing comes to rest: the pulley passes through zero
        none = ~jnp.any(together)
        way = jnp.where(none, -new.sense, way)
        yields = yields_on_band(
            r, T_0, resting_tensions(r, T_0, way.astype(jnp.float64)), way
        )
        outer = jnp.where(together, jnp.where(yields, way, 0), new.own.outer)
        inner = jnp.where(together, jnp.where(yields, 0, way), new.own.inner)
        return new._replace(
            own=new.own._replace(outer=outer, inner=inner),
            sense=jnp.where(way == 0, new.sense, way),
        )

    def with_stuck_speeds(
        self, omega: Array, own: SprungState, before: Mode, after: Mode
    ) -> tuple[Array, SprungState]:
        omega = speed_after(omega, before, after, after.own.rests)
        speeds = jnp.where(
            after.own.outer == 0,
            0.0,
            jnp.where(after.own.inner == 0, omega, own.speeds),
        )
        return omega, own._replace(speeds=speeds)

    # --- results, stored energy, capacity --------------------------------------------

    def shown(
        self,
        tension: Array,
        omega: Array,
        own: SprungState,
        mode: Mode,
        surfaces: Surfaces,
        z: SprungNow,
    ) -> MechanismOutputs:
        on_band = on_rim = None
        if self.shows_friction:
            c = self._coefficients(omega, own, mode, surfaces)
            on_band = (c.mu_kinetic - 1) / (c.mu_kinetic + 1) / self.grip.tangent
            on_rim = c.inner_kinetic
        outer = jnp.where(mode.band == OPEN, 0, mode.own.outer)
        inner = mode.own.inner
        external = PairNow.of(
            z.outer_force, z.normal, z.outer_slip, outer, z.brake_torque, on_band
        )
        external = external._replace(friction=z.outer_force * self.grip.cosine)
        on_track = z.inner_torque / self.track_radius
        driven = jnp.sum(z.inner_torque)
        most = jnp.sum(z.capacity)
        internal = PairNow.of(
            on_track, z.load, z.inner_slip, inner, driven, on_rim, most
        )
        mean = jnp.mean(own.speeds)
        return MechanismOutputs(
            (external, internal), z.tension, bandage_speed=mean, lining_speed=own.speeds
        )

    def stored(
        self, inertia: Array, omega: Array, own: SprungState, mode: Mode
    ) -> TwoArrays:
        kinetic = 0.5 * inertia * omega**2 + 0.5 * jnp.sum(
            self.inertias * own.speeds**2
        )
        return kinetic, 0.5 * jnp.sum(self.stiffness * own.stretch**2)

    def own_sizes(self) -> SprungState:
        size = self.sizes
        return SprungState(
            size.tension / self.stiffness, jnp.ones_like(self.inertias) * size.speed
        )

    def capacity(
        self,
        tension: Array,
        omega: Array,
        own: SprungState,
        surfaces: Surfaces,
        *,
        static: bool = False,
    ) -> Float[Array, " pairs"]:
        # every lining is at the limit of its weaker pair, as on a pulley at rest, but
        # with kinetic friction unless `static`
        speed = jnp.abs(omega)
        arms = self.band_radius * speed, self.track_radius * speed
        on_band, on_rim = self._friction(surfaces, *arms, static=static)
        mu = tension_ratio(on_band * self.grip.tangent)[0]
        on_rim = self.track_radius * on_rim
        floor = on_rim * jnp.asarray(self.bandage.preload)
        none = jnp.zeros(self.count)
        every = jnp.ones(self.count, bool)
        _, Q = self._springs(own)
        r = Resting(
            every,
            self.band_radius,
            mu,
            on_rim * self.grip.sine,
            floor,
            Q,
            none,
            none,
            none,
        )
        least, most = holding_range(r, tension)
        return jnp.where(omega < 0, -least, most)[None]
