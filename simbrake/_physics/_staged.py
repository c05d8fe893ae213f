"""The staged brake: the band rubs on a bandage of linings, and the bandage on the rim; either pair sticks or slides."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Bool, Float, Int

from ..brakes._band import limit_tensions, piece_of, tensions_on
from ..brakes._design import Bandage
from ..friction import SurfaceState, continued, reads
from ..hybrid._arrays import Array
from ._elastic import (
    ElasticNow,
    Slide,
    ageing_of,
    band_guards,
    friction_of,
    limit_of,
    slide_of,
    strained,
    taut_mode,
    tension_of,
)
from ._mechanism import (
    HELD,
    OPEN,
    AbstractMechanism,
    Acting,
    BandMode,
    BrakeCode,
    Fired,
    Mode,
    Moment,
    Pair,
    PairNow,
    Rub,
    Shown,
    Sizes,
    failed,
    moving_as_one,
    onset,
    pick,
    rigid_mode,
    sense_of,
    settled_mode,
    slips,
)
from ._wrap import MOBILISATION, Wrap, band_torque

_NEWTON = 8  # iterations for a tension under a law that looks at the pressure; otherwise it is linear: one is exact


class Held(eqx.Module):
    """What the friction of the internal pair depends on at one instant: speed `v` (m/s), signed by the sense, and the
    state of the surfaces (`None`: the scene has none)."""

    v: Array
    surface: SurfaceState | None
    static: Any  # whether the pair sticks


class InternalPair(eqx.Module):
    """Friction between bandage and rim (model §4; K).

    M_int = R Σ F_i,   F_i = f_i (N_i + N_pre,i),   N_i = (T_i + T_{i−1}) sin(β_i/2)
    """

    bandage: Bandage
    radius: Array
    sine: Float[Array, " n"]  # sin(β_i/2)

    @property
    def count(self) -> int:
        return self.sine.shape[0]

    def normal(self, T_0: Array, along: Float[Array, " n"]) -> Float[Array, " n"]:
        """Loads `N_i + N_pre,i` on the rim for the tensions `T_1…T_n`."""
        before = jnp.concatenate([T_0[None], along[:-1]])
        return (along + before) * self.sine + jnp.asarray(self.bandage.preload)

    def coefficients(self, N: Float[Array, " n"], held: Held) -> Float[Array, " *n"]:
        """Coefficients of friction `f_i`, or one for all, between linings and rim under the loads `N` (N)."""
        law = self.bandage.friction
        p = None if self.bandage.area is None else N / jnp.asarray(self.bandage.area)
        still = (held.surface or SurfaceState()).contact(jnp.zeros(self.count), p)
        v = jnp.broadcast_to(held.v, (self.count,))
        kinetic = continued(lambda v: law.kinetic(still._replace(v=v)), v)
        return jnp.where(held.static, law.static(still), kinetic)

    def friction(self, T_0: Array, along: Float[Array, " n"], held: Held) -> Float[Array, " n"]:
        """Greatest forces `F_i` between linings and rim (N)."""
        N = self.normal(T_0, along)
        return self.coefficients(N, held) * N

    def capacity(self, T_0: Array, along: Float[Array, " n"], held: Held) -> Float[Array, ""]:
        """`M_int` (N·m)."""
        return self.radius * jnp.sum(self.friction(T_0, along, held))

    def _unbalance(
        self, T_0: Array, T_n: Array, mu: Array, piece: Array, sense: Array, arm: Array, held: Held
    ) -> Array:
        pull = sense.astype(jnp.float64) * self.capacity(T_0, tensions_on(T_0, T_n, mu, piece), held)
        return arm * (T_n - T_0) - pull

    def holding_tension(
        self, T_0: Array, mu: Array, piece: Int[Array, ""], sense: Int[Array, ""], arm: Array, held: Held
    ) -> Float[Array, ""]:
        """`T_n` by which the band holds a bandage on a sliding rim, `R_b (T_n − T_0) = ± M_int(T_n)`, on one piece."""

        def improve(T_n: Array, _: Any) -> tuple[Array, None]:
            def unbalance(T_n: Array) -> Array:
                return self._unbalance(T_0, T_n, mu, piece, sense, arm, held)

            value, slope = jax.jvp(unbalance, (T_n,), (jnp.ones_like(T_n),))
            return T_n - value / jnp.where(slope == 0, 1.0, slope), None

        pressed = self.bandage.area is not None
        heated = held.surface is not None and held.surface.T is not None
        if not reads(self.bandage.friction, self.count, T=heated, p=pressed).p:
            return improve(T_0, None)[0]
        # Newton from the start of the piece runs along a concave curve to its root there
        limits = limit_tensions(T_0, mu)
        here = jnp.arange(limits.shape[0], dtype=jnp.int32) == piece + self.count + 1
        return jax.lax.scan(improve, jnp.sum(jnp.where(here, limits, 0.0)), None, length=_NEWTON)[0]

    def holding_piece(self, T_0: Array, mu: Array, sense: Int[Array, ""], arm: Array, held: Held) -> Int[Array, ""]:
        """The piece on which `holding_tension` lies: a walk along all of them (their unbalance changes sign once)."""
        n = self.count
        limits = limit_tensions(T_0, mu)
        pieces = jnp.clip(jnp.arange(2 * n + 1, dtype=jnp.int32) - n, -n, n - 1)
        below = jax.vmap(lambda T_n, piece: self._unbalance(T_0, T_n, mu, piece, sense, arm, held) < 0)(limits, pieces)
        return jnp.clip(jnp.sum(below).astype(jnp.int32) - 1 - n, -n, n - 1)


class Bandaged(NamedTuple):
    """Elongation `x` of the band (m; `None` where it is rigid) and speed `ω_b` of the bandage (rad/s)."""

    x: Any
    omega_b: Any


class Stages(NamedTuple):
    """What a staged brake does beside its band.

    - `inner`: 0 while the internal pair sticks, ±1 the sign of `ω − ω_b` while it slides
    - `piece`: number of linings at their limit on the band, as `_band.piece_of` counts them
    - `locks`: whether a lining locks itself, where that can change in a run (else `None`)
    """

    inner: Any
    piece: Any
    locks: Any

    def slides(self, mode: Any) -> Any:
        """The internal pair: 0 while it sticks, else ±1."""
        return self.inner

    @property
    def contacts(self) -> dict[str, Any]:
        """The linings act as one."""
        return {}


class StagedNow(NamedTuple):
    """Variables of a staged brake: those of its band, and of the internal pair."""

    band: ElasticNow
    alpha: Float[Array, ""]  # ω̇ (rad/s²)
    alpha_b: Float[Array, ""]  # ω̇_b
    drive: Float[Array, ""]  # Λ that the pulley gives to the bandage (N·m)
    capacity: Float[Array, ""]  # M_int up to which it sticks, or with which it slides (N·m)
    inner_slip: Float[Array, ""]  # R (ω − ω_b) while it slides (m/s)
    inner_friction: Float[Array, " n"]  # greatest forces of the linings on the rim (N)
    inner_normal: Float[Array, " n"]  # loads on the rim, preload included (N)

    @property
    def slack_tension(self) -> Array:
        """`T_0` (N)."""
        return self.band.slack_tension

    @property
    def tight_tension(self) -> Array:
        """`T_n` (N)."""
        return self.band.tight_tension

    @property
    def brake_torque(self) -> Array:
        """`R_b (T_n − T_0)` (N·m)."""
        return self.band.brake_torque

    @property
    def slip_speed(self) -> Array:
        """Of the bandage under the band (m/s)."""
        return self.band.slip_speed

    @property
    def lever_power(self) -> Array:
        """`T_0 ẋ` (W)."""
        return self.band.lever_power


class StagedBrake(AbstractMechanism):
    """A band on a bandage on a rim (model §4; K).

        J ω̇ = M_load − Λ,   J_b ω̇_b = Λ − R_b (T_n − T_0)

    The internal pair sticks (`ω = ω_b`) while `|Λ| ≤ M_int`, and slides with `Λ = ± M_int`, which depends on the
    tensions along the band: on the number of linings at their limit there (`piece`).

    Guards: those of the band on the bandage; grip or slip of the internal pair; a lining more at its limit, one less.
    """

    wrap: Wrap
    stiffness: Float[Array, ""] | None
    internal: InternalPair
    pairs: tuple[Pair, ...]
    sizes: Sizes

    @property
    def codes(self) -> tuple[BrakeCode, ...]:
        """Ends of the run that heat can bring about, each with a guard."""
        grip = self.wrap.grip
        found = [BrakeCode.BAND_SNAP] if grip.follows_slip and self.stiffness is not None else []
        return (*found, BrakeCode.FLASH_FOLD) if grip.implicit else tuple(found)

    @property
    def _first(self) -> int:
        """Where the guards of the internal pair begin."""
        return 4 + self.varies + len(self.codes)

    def start(self, omega, elongation):
        zero = jnp.asarray(0, jnp.int32)
        locks = self.wrap.locked.astype(jnp.int32) if self.varies else None
        return Bandaged(None if self.stiffness is None else elongation, omega), OPEN, Stages(zero, zero, locks)

    def rests(self, mode):
        return (mode.band == BandMode.HELD) & (mode.own.inner == 0)

    def locked_in(self, mode: Mode) -> Bool[Array, ""]:
        """Whether a lining locks itself."""
        return self.wrap.locked if mode.own.locks is None else mode.own.locks > 0

    # --- all of it at one instant -----------------------------------------------------------------------------------

    def _rim(self, omega: Array, own: Bandaged, mode: Mode, surface: Any, static: Any) -> Held:
        """What the friction of the internal pair depends on."""
        v = self.internal.radius * jnp.where(mode.own.inner < 0, -1.0, 1.0) * (omega - own.omega_b)
        return Held(v, surface, static)

    def variables(self, acting, omega, own, mode):
        band, R_b, inner = mode.band, self.wrap.radius, mode.own.inner
        sliding, back, held, stuck = slips(band), band == BandMode.SLIP_BACK, band == BandMode.HELD, inner == 0
        T_0, n = acting.tension, self.wrap.count
        upper, push, at_limit = limit_of(self, acting, own.omega_b, mode)
        mu = (1 + at_limit.fz) / (1 - at_limit.fz)
        rim = self._rim(omega, own, mode, acting.surfaces[1], stuck)
        # a held bandage bears the load, or what the sliding internal pair gives
        driven = self.internal.holding_tension(T_0, mu, mode.own.piece, inner, R_b, rim)
        tight = pick(held, pick(stuck, T_0 + acting.load / R_b, driven), pick(sliding, upper, 0.0))
        slack, take_up = pick(band == BandMode.OPEN, 0.0, T_0), band == BandMode.TAKE_UP
        if self.stiffness is not None:
            stretched = self.stiffness * own.x
            tight = pick(take_up | (band == BandMode.ELASTIC), stretched, tight)
            slack = pick(take_up, stretched, slack)
        drag = tight - slack
        torque = R_b * drag

        full = jnp.where(back, -1 - n, n)
        piece = pick(sliding, full, pick(stuck, piece_of(slack, tight, mu), mode.own.piece))
        along = tensions_on(slack, tight, mu, piece.astype(jnp.int32))
        friction = self.internal.friction(slack, along, rim)
        capacity = self.internal.radius * jnp.sum(friction)
        J, J_b = acting.inertia, jnp.asarray(self.internal.bandage.inertia)
        common = pick(held, 0.0, (acting.load - torque) / (J + J_b))
        drive = pick(stuck, acting.load - J * common, inner.astype(jnp.float64) * capacity)
        alpha_b = pick(stuck, common, pick(held, 0.0, (drive - torque) / J_b))
        inner_slip = pick(stuck, 0.0, self.internal.radius * (omega - own.omega_b))

        speed, zero = R_b * own.omega_b, jnp.zeros_like(T_0)
        slide = Slide(zero, speed, speed, None)
        if self.stiffness is not None:
            drift = None
            if self.wrap.fixed is None:
                heated = acting.warming((None, pick(inner < 0, -1.0, 1.0) * friction * inner_slip))[0]
                drift = _sum(acting.warming(None)[0], heated)
            rubs = (friction_of(self, T_0, at_limit.fz, back, upper), None)
            ageing = ageing_of(self, acting, T_0, at_limit.fz, back, rubs[0])
            slide = slide_of(self, push, acting, speed, alpha_b, drift, rubs, ageing)
        carried = take_up | (band == BandMode.ELASTIC)
        band_speed = pick(carried, speed, pick(sliding, slide.growth, 0.0)) if self.stiffness is not None else zero
        found = ElasticNow(
            slack_tension=slack,
            tight_tension=tight,
            drag=drag,
            brake_torque=torque,
            alpha=alpha_b,
            slip_speed=pick(sliding, slide.slip, 0.0),
            band_speed=band_speed,
            lever_power=slack * band_speed,
            upper=upper,
            lower=T_0 / at_limit.other,
            ratio=at_limit.other,
            fz=at_limit.fz,
            slope=at_limit.slope,
            margin=at_limit.margin,
            snap=slide.snap,
            lead=pick(sliding, slide.lead, 0.0),
        )
        return StagedNow(
            band=found,
            alpha=pick(stuck, alpha_b, (acting.load - drive) / J),
            alpha_b=alpha_b,
            drive=drive,
            capacity=capacity,
            inner_slip=inner_slip,
            inner_friction=friction,
            inner_normal=self.internal.normal(slack, along),
        )

    def own_rates(self, z):
        return Bandaged(None if self.stiffness is None else z.band.band_speed, z.alpha_b)

    def rubs(self, acting, mode, z):
        band, inner = z.band, mode.own.inner
        each, normal = self.wrap.sliding(band.slack_tension, band.fz, mode.band == BandMode.SLIP_BACK)
        outer = Rub(each if self.pairs[0].apart else band.drag, band.slip_speed, sense_of(mode), normal)
        force = jnp.where(inner < 0, -1.0, 1.0) * z.inner_friction
        force = force if self.pairs[1].apart else jnp.sum(force)
        return outer, Rub(force, z.inner_slip, inner.astype(jnp.float64), z.inner_normal)

    # --- guards and changes of mode -----------------------------------------------------------------------------------

    def guards(self, acting, omega, own, mode, z):
        inner, n, size = mode.own.inner, self.wrap.count, self.sizes
        stuck, piece = inner == 0, mode.own.piece
        slip = inner.astype(jnp.float64) * (omega - own.omega_b) / size.speed
        grip = jnp.where(stuck, (z.capacity - jnp.abs(z.drive)) / size.torque, slip)
        # while the internal pair slides its torque depends on the linings at their limit on the band; the equations are
        # smooth only while their number stays the same
        counted = ~stuck & ((mode.band == BandMode.ELASTIC) | (mode.band == BandMode.HELD))
        limits = limit_tensions(z.slack_tension, (1 + z.band.fz) / (1 - z.band.fz))
        at = jnp.arange(2 * n + 1, dtype=jnp.int32) - n

        def pick(i: Array) -> Array:
            return jnp.sum(jnp.where(at == i, limits, 0.0))

        above = (pick(piece + 1) - z.tight_tension) / size.tension
        below = (z.tight_tension - pick(piece)) / size.tension
        above = jnp.where(counted & (piece < n - 1), above, 1.0)
        below = jnp.where(counted & (piece > -n), below, 1.0)
        return jnp.stack([*band_guards(self, acting, own.omega_b, mode, z.band), grip, above, below])

    def _grips(self, acting: Acting, omega: Array, own: Bandaged, mode: Mode, rest: ElasticNow, surface: Any) -> Any:
        """`M_int` (N·m) with the band at its upper and at its lower static limit."""
        n, T_0 = self.wrap.count, acting.tension
        rim, mu = self._rim(omega, own, mode, surface, mode.own.inner == 0), (1 + rest.fz) / (1 - rest.fz)
        full = [(rest.upper, n), (rest.lower, -1 - n)]
        return [
            self.internal.capacity(T_0, tensions_on(T_0, T_n, mu, jnp.asarray(piece, jnp.int32)), rim)
            for T_n, piece in full
        ]

    def change(self, now, new, fired, ask):
        fired, old, size, R_b = jnp.unstack(fired), now.mode, self.sizes, self.wrap.radius
        locks = None if old.own.locks is None else (old.own.locks ^ fired[4].astype(jnp.int32)).astype(jnp.int32)
        # the internal pair slides the way the torque acts that broke it loose
        way = jnp.where(ask(new, now.omega, now.own)[1].drive < 0, -1, 1)
        inner = jnp.where(fired[self._first], jnp.where(old.own.inner == 0, way, 0), old.own.inner).astype(jnp.int32)
        new = new._replace(own=Stages(inner, old.own.piece, locks))
        acting, rest = ask(new._replace(band=HELD), now.omega, now.own)
        T_0, spare, locked = acting.tension, size.slight_torque, self.locked_in(new)
        high, low = R_b * (rest.band.upper - T_0), R_b * (rest.band.lower - T_0)
        grips = self._grips(acting, now.omega, now.own, new, rest.band, acting.surfaces[1])
        most, least = (jnp.where(inner == 0, acting.load, inner.astype(jnp.float64) * M_int) for M_int in grips)
        beyond = jnp.where(least < low - spare, -1, 0)
        beyond = jnp.where(most > high + spare, 1, beyond)
        # at rest on both pairs a load beyond the band breaks the rim loose where that is weaker, and the band stays
        stands = (old.band == BandMode.HELD) | fired[0] | (now.own.omega_b == 0)
        weak = self._at_limit(now, rest.band, beyond) & jnp.where(beyond > 0, grips[0] < high, grips[1] < -low)
        loose = stands & (inner == 0) & (beyond != 0) & weak & ~locked
        inner = jnp.where(loose, jnp.where(acting.load < 0, -1, 1), inner).astype(jnp.int32)
        beyond, new = jnp.where(loose, 0, beyond), new._replace(own=new.own._replace(inner=inner))
        carrier = now._replace(omega=now.own.omega_b, z=now.z.band)
        found = onset(carrier, fired, acting, jnp.where(locked, 0, beyond), size)
        if self.stiffness is None:
            moving = rigid_mode(found.direction)
        else:
            turned = new._replace(sense=settled_mode(carrier, new, found, old.band).sense)

            def there(mode: Mode) -> ElasticNow:
                return ask(mode, now.omega, now.own._replace(omega_b=found.omega))[1].band

            moving = taut_mode(self, carrier, turned, fired, there, acting, rest.band, found)
        new = settled_mode(carrier, new, found, moving)
        piece = self._piece(now, new, fired, acting, rest.band)
        code = failed(self.codes, fired, 4 + (locks is not None), jnp.asarray(0, jnp.int32))
        return new._replace(own=new.own._replace(piece=piece)), jnp.where(
            locked, int(BrakeCode.SINGULAR_GEOMETRY), code
        )

    def _at_limit(self, now: Moment, rest: ElasticNow, beyond: Array) -> Any:
        """Whether a band that is to be moved that way slides at once: an elastic one does where it is at its limit."""
        if self.stiffness is None:
            return True
        tension, rounding = tension_of(self, now.own.x, now.mode, now.z.band), self.sizes.slight_tension
        return jnp.where(beyond > 0, tension >= rest.upper - rounding, tension <= rest.lower + rounding)

    def _piece(self, now: Moment, new: Mode, fired: Fired, acting: Acting, rest: ElasticNow) -> Int[Array, ""]:
        """Number of linings at their limit on the band after the event."""
        first, n, old, R_b = self._first, self.wrap.count, now.mode, self.wrap.radius
        # under a lever that only begins to pull everything is 0: take the first moment after
        T_0 = jnp.maximum(acting.tension, 1e-9 * self.sizes.tension)
        mu, ratio = (1 + rest.fz) / (1 - rest.fz), rest.ratio
        rim = self._rim(now.omega, now.own, new, acting.surfaces[1], False)
        driven = self.internal.holding_piece(T_0, mu, new.own.inner, R_b, rim)
        counted = (old.band == new.band) & (old.own.inner == new.own.inner) & (old.own.inner != 0)
        if self.stiffness is not None:
            tension = jnp.clip(tension_of(self, now.own.x, old, now.z.band), T_0 / ratio, T_0 * ratio)
            driven = jnp.where(new.band == BandMode.ELASTIC, piece_of(T_0, tension, mu), driven)
        step = fired[first + 1].astype(jnp.int32) - fired[first + 2].astype(jnp.int32)
        piece = jnp.where(counted & (step != 0), jnp.clip(old.own.piece + step, -n, n - 1), driven)
        piece = jnp.where(new.band == BandMode.SLIP, n, jnp.where(new.band == BandMode.SLIP_BACK, -1 - n, piece))
        slack = (new.band == BandMode.OPEN) | (new.band == BandMode.TAKE_UP)
        return jnp.where(slack, 0, piece).astype(jnp.int32)

    def arrested(self, omega, own, before, after):
        turned = (before.band != BandMode.OPEN) & (after.sense != before.sense)
        stopped, sticks = (after.band == BandMode.HELD) | turned, after.own.inner == 0
        omega_b = jnp.where(stopped, 0.0, jnp.where(sticks, omega, own.omega_b))
        return jnp.where(sticks & stopped, 0.0, omega), own._replace(omega_b=omega_b)

    @property
    def couples_slip(self):
        return self.stiffness is not None

    @property
    def strains(self):
        return self.stiffness is not None

    def strained(self, omega, own, before, after):
        jump = strained(self, own.omega_b, own.x, (before[0], before[1].band), after)

        def of(surfaces: tuple[Any, ...]) -> tuple[Bandaged, Array, tuple[Array, ...]]:
            x, work, heat = jump(surfaces[0])
            return own._replace(x=x), work, (heat, jnp.zeros_like(heat))

        return of

    # --- what one looks at ------------------------------------------------------------------------------------------

    @property
    def grip(self):
        return self.wrap.grip

    @property
    def varies(self):
        return self.wrap.grip.varies

    @property
    def distribution(self):
        return MOBILISATION

    def lining_margins(self, mode, z):
        margins = self.wrap.margins(z.slack_tension, z.tight_tension, z.band.fz) / self.sizes.tension
        return jnp.where((mode.band == BandMode.ELASTIC) & ~self.locked_in(mode), margins, -1.0)

    def shown(self, tension, omega, own, mode, surfaces, z):
        forces = self.wrap.linings(z.slack_tension, z.tight_tension, z.band.fz)
        inner, n, on_band, on_rim = mode.own.inner, (self.wrap.count,), None, None
        if self.shows_friction:
            on_band = self.wrap.kinetic(tension, own.omega_b, surfaces[0], mode)
            held = self._rim(omega, own, mode, surfaces[1], False)
            on_rim = jnp.broadcast_to(self.internal.coefficients(z.inner_normal, held), n)
        # linings that stick to the rim share the torque as the greatest friction that each can give
        share = z.drive / jnp.where(z.capacity > 0, z.capacity, 1.0)
        friction = pick(inner == 0, share, inner.astype(jnp.float64)) * z.inner_friction
        internal = PairNow(
            force=friction,
            friction=friction,
            normal=z.inner_normal,
            slip=jnp.broadcast_to(z.inner_slip, n),
            sense=jnp.broadcast_to(inner, n),
            at_limit=jnp.broadcast_to(inner != 0, n),
            torque=z.drive,
            coefficient=on_rim,
            capacity=z.capacity,
        )
        external = moving_as_one(forces, self.grip.cosine, mode, z, on_band)
        return Shown((external, internal), forces.tension, elongation=own.x, bandage_speed=own.omega_b)

    # --- what it stores, what it could hold -------------------------------------------------------------------------

    def stored(self, inertia, omega, own, mode):
        kinetic = 0.5 * inertia * omega**2 + 0.5 * self.internal.bandage.inertia * own.omega_b**2
        return kinetic, jnp.zeros_like(kinetic) if self.stiffness is None else 0.5 * self.stiffness * own.x**2

    def own_sizes(self):
        x = None if self.stiffness is None else self.sizes.tension / self.stiffness
        return Bandaged(x, self.sizes.speed)

    def capacity(self, tension, omega, own, surfaces):
        outer, R_b = band_torque(self.grip, self.wrap.radius, tension, omega, surfaces[0]), self.wrap.radius
        # a held bandage is braced by the static friction of the band; the rim slides in it with the pulley's speed
        still, no = jnp.zeros_like(omega), jnp.asarray(False)
        fz = self.wrap.limit(tension, still, surfaces[0], no, jnp.asarray(True)).fz
        mu, speed = (1 + fz) / (1 - fz), self.internal.radius * jnp.abs(omega)
        rim, sense = Held(speed, surfaces[1], no), jnp.where(omega < 0, -1, 1).astype(jnp.int32)
        piece = self.internal.holding_piece(tension, mu, sense, R_b, rim)
        T_n = self.internal.holding_tension(tension, mu, piece, sense, R_b, rim)
        T_n = jnp.clip(T_n, tension / jnp.prod(mu), tension * jnp.prod(mu))
        inner = self.internal.capacity(tension, tensions_on(tension, T_n, mu, piece), rim)
        return jnp.stack([outer, inner])


def _sum(a: Any, b: Any) -> Any:
    """`a + b`, where either may be absent."""
    return b if a is None else a if b is None else a + b
