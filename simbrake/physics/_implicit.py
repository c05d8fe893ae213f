"""Coefficients of friction that depend on the load of their own lining, or on a flash
temperature."""

from typing import Any, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
from jaxtyping import PyTree

from ..brakes.band import affine_tensions, running_product, tension_ratio
from ..friction import SurfaceState, continued
from ..hybrid import largest, smallest
from ..hybrid.arrays import Array, Mark, Scalar, TwoArrays, Vector
from ..hybrid.struct import Struct, traced_once, with_fields

#: most sweeps over all linings; some ten do where there is a solution
_SWEEPS = 100
#: change of a coefficient within rounding
_ROUNDING = 1e-15
#: least slope of a residual by which Newton's method divides
_LEAST_SLOPE = 0.05
#: largest residual of a solution
_OFF = 1e-9
#: looks along the way from the coefficient without flash to the root
_LOOKS = 17

_Search: TypeAlias = tuple[Vector, Vector, Vector, Array]


class EachWay(NamedTuple):
    """Coefficients of linings as they slide, of the same with tensions that go the
    other way, and of linings that stick forwards; `solvability` of the first."""

    sliding: Vector
    opposite: Vector
    sticking: Vector
    solvability: Scalar


class ImplicitFriction(Struct):
    """Linings under a band that slide one way, or are about to.

        f_i = F_i(T + ΔT(f_i), p_i),   T_i = T_{i−1} μ_i(f_i)^{±1}
        p_i = (T_{i−1} + T_i) sin(β_i/2)/A_i

    - `grip`: friction of the linings;  `slack`: tension `T_0` (N)
    - `v` (n,): slip speeds (m/s) signed by the sense;  `surface`: state of the surfaces
    - `back`: tensions fall along the band;  `static`: the linings stick
    """

    grip: Any
    slack: Scalar
    v: Vector
    surface: SurfaceState
    back: Mark
    static: Mark

    def ratios(self, f: Vector) -> Vector:
        """`T_i/T_{i−1}`."""
        mu, _ = tension_ratio(self.grip.gripped(f))
        return jnp.where(self.back, 1 / mu, mu)

    def before(self, f: Vector) -> Vector:
        """Tensions `T_{i−1}` (N)."""
        along = running_product(self.ratios(f))
        return self.slack * jnp.concatenate([jnp.ones(1), along[:-1]])

    @traced_once
    def law(self, f: Vector, before: Vector) -> TwoArrays:
        """`F_i` at the coefficients `f` behind the tensions `before` (N), and `T_i`."""
        grip = self.grip
        surface = self.surface
        ratio = self.ratios(f)
        p = None
        if grip.linings.area is not None:
            p = grip.pressed(before, ratio) / jnp.asarray(grip.linings.area)

        def at_speed(v: Array) -> Array:
            here = surface
            if grip.flash is not None and surface.T is not None:
                spots = p if grip.flash.hardness is None else grip.flash.hardness
                assert spots is not None
                heat = 1.0 if grip.shares is None else grip.shares.heat
                hot = surface.T + grip.flash.rise(heat * f * spots * v, v)
                here = surface._replace(T=jnp.where(self.static, surface.T, hot))
            contact = here.contact(v, p)
            return jnp.asarray(grip.linings.friction.governing(contact, self.static))

        by_speed = grip.reads.v or grip.flash is not None
        F = continued(at_speed, self.v) if by_speed else at_speed(self.v)
        return jnp.broadcast_to(F, f.shape), before * ratio

    def residual(self, f: Vector, before: Vector) -> TwoArrays:
        """`f − F(f)` of each lining, and its slope."""

        def off(f: Vector) -> Vector:
            return f - self.law(f, before)[0]

        return jax.jvp(off, (f,), (jnp.ones_like(f),))

    def solvability(self, f: Vector, before: Vector) -> Scalar:
        """By how much the equations have a solution: the least slope of a residual up
        to the root `f`, or `1 − f z` where that is less."""
        # up to the root the residual must rise all the way: beyond a fold the next root
        # lies behind a valley
        cold = jax.lax.stop_gradient(self.law(jnp.zeros_like(f), before)[0])
        way = cold + jnp.linspace(0.0, 1.0, _LOOKS)[:, None] * (f - cold)
        r, slopes = jax.vmap(self.residual, (0, None))(way, before)
        off = jnp.abs(r[-1])
        slope = smallest(jnp.where(off > _OFF, -off, slopes).ravel())
        # flash can lift a sliding lining over its sticking self, up to where it would
        # lock: no solution either
        return jnp.minimum(slope, 1 - largest(self.grip.gripped(f)))

    @traced_once
    def each_way(self) -> EachWay:
        """The coefficients in three cases, as rows of arrays: so the equations stand in
        a program once."""
        no = jnp.zeros_like(self.back)
        backs = jnp.stack([self.back, ~self.back, no])
        statics = jnp.stack([self.static, self.static, ~no])

        def in_case(back: Mark, static: Mark) -> TwoArrays:
            return solved(with_fields(self, back=back, static=static))

        f, before = jax.vmap(in_case)(backs, statics)
        return EachWay(f[0], f[1], f[2], self.solvability(f[0], before[0]))


@jax.custom_jvp
def solved(friction: ImplicitFriction) -> TwoArrays:
    """The coefficients `f_i`, on the branch that starts at those without flash, and the
    tensions `T_{i−1}` (N).

    Newton's method on all linings at once, each under the tension that the coefficients
    of those before it give. The first lining converges first; as a tension depends
    weakly on each coefficient, the others follow within a few sweeps.
    """

    def sweep(search: _Search) -> _Search:
        f, _, _, count = search
        before = friction.before(f)
        r, slope = friction.residual(f, before)
        new = f - r / jnp.where(slope > _LEAST_SLOPE, slope, 1.0)
        return jnp.maximum(new, 0.0), before, f, count + 1

    def moves(search: _Search) -> Mark:
        f, _, old, count = search
        settled = jnp.all(jnp.abs(f - old) <= _ROUNDING * (1 + f))
        return (count < _SWEEPS) & ~settled

    nothing = jnp.zeros_like(friction.v)
    slack = nothing + friction.slack
    cold, _ = friction.law(nothing, slack)
    start = cold, slack, nothing - 1, jnp.asarray(0, jnp.int32)
    f, before, _, _ = jax.lax.while_loop(moves, sweep, start)
    return f, before


@solved.defjvp
def _(
    primals: tuple[ImplicitFriction], tangents: tuple[PyTree]
) -> tuple[TwoArrays, TwoArrays]:
    # df_i = F_f df_i + F_T dT_{i−1} + dF,   dT_i = T_f df_i + T_T dT_{i−1} + dT
    (friction,) = primals
    (change,) = tangents
    f, before = solved(friction)

    def along(d_f: Scalar, d_before: Scalar) -> TwoArrays:
        moves = jnp.full_like(f, d_f), jnp.full_like(f, d_before)
        return jax.jvp(friction.law, (f, before), moves)[1]

    (F_f, F_T), (T_f, T_T) = jax.vmap(along)(*jnp.eye(2))
    dF, dT = jax.jvp(lambda friction: friction.law(f, before), primals, tangents)[1]
    gain = F_T / (1 - F_f)
    own = dF / (1 - F_f)
    rates = affine_tensions(change.slack, T_T + T_f * gain, dT + T_f * own)
    d_before = jnp.concatenate([change.slack[None], rates[:-1]])
    return (f, before), (gain * d_before + own, d_before)
