"""Linings under a band: tensions while they slide, and how linings at rest share a load."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Bool, Float, Int

from ..brakes._band import LiningForces, mobilised, product, running_product, sliding_ratio
from ..hybrid import largest
from ..hybrid._arrays import Array
from ._mechanism import BandMode, Mode, pick
from ._sliding import Grip


class Fixed(NamedTuple):
    """`f_i z_i` and `Π` of linings whose friction cannot change in a run."""

    static: Float[Array, " n"]
    kinetic: Float[Array, " n"]
    ratio_static: Float[Array, ""]
    ratio_kinetic: Float[Array, ""]


def _unlocked(fz: Float[Array, " n"]) -> Float[Array, " n"]:
    """`f_i z_i`, 0 of a lining that locks itself: its limit is infinite, and for the caller to treat."""
    return jnp.where(fz < 1, fz, 0.0)


class Limit(NamedTuple):
    """Linings that slide, or are about to, one way.

    - `fz` (n,): `f_i z_i` of each, 0 of one that locks itself
    - `ratio`: `T_n/T_0`, `Π = ∏ (1 + f_i z_i)/(1 − f_i z_i)` while the anchor end is the tight one, else `1/Π`
    - `other`: `Π` the other way, which is another where the law looks at the pressure
    - `slope`: the least slope of implicit coefficients (1 where explicit)
    - `margin`: by how much the lining nearest to locking is away from it, `1 − max f_s z`; `None`: it cannot change
    """

    fz: Float[Array, " n"]
    ratio: Float[Array, ""]
    other: Float[Array, ""]
    slope: Array
    margin: Any


#: how the linings of a band as a whole share its tension
MOBILISATION = (
    "mobilisation rule: one lining after the other at its limit, from the slack end (reversed: from the anchor)"
)


class Wrap(eqx.Module):
    """The grip of a band on linings: `T_i = T_{i−1} μ_i^{±1}` where they slide, `T_{i−1}/μ_i ≤ T_i ≤ T_{i−1} μ_i` else.

    - `radius` `R_b` (m) of the band circle;  `locked`: whether a lining locks itself at the start
    - `fixed`: `f_i z_i` (n,) and `Π` of sticking and of sliding linings, formed once where they cannot change in a run
    """

    radius: Float[Array, ""]
    grip: Grip
    locked: Bool[Array, ""]
    fixed: Fixed | None

    @classmethod
    def of(cls, radius: Array, grip: Grip, static: Array, kinetic: Array) -> "Wrap":
        """The grip of linings whose coefficients are `static` and `kinetic` (n,) at the start."""
        read, fz = grip.reads, static * grip.tangent
        fixed = None
        if not (read.v or grip.varies or grip.implicit):
            both = _unlocked(fz), _unlocked(kinetic * grip.tangent)
            fixed = Fixed(*both, *(sliding_ratio(one) for one in both))
        return cls(radius, grip, jnp.any(fz >= 1), fixed)

    @property
    def count(self) -> int:
        return self.grip.linings.count

    def limit(self, T_0: Array, v: Array, surface: Any, back: Array, static: Array) -> Limit:
        """The limit at the slack tension `T_0`.

        - `v`: slip speed (m/s) signed by the sense;  `surface`: state of the surfaces
        - `back`: the lever end is the tight one;  `static`: the static coefficients count
        """
        if self.fixed is not None:
            one = self.fixed
            ratio = pick(static, one.ratio_static, one.ratio_kinetic)
            signed = pick(back, 1 / one.ratio_kinetic, ratio)
            return Limit(pick(static, one.static, one.kinetic), signed, ratio, jnp.ones(()), None)
        grip, margin = self.grip, None
        v = jnp.broadcast_to(v, (self.count,))
        found = grip.coefficients(T_0, v, surface, back, static=static)
        fz = _unlocked(found.f * grip.tangent)
        ratio = other = sliding_ratio(pick(back, -fz, fz))
        if grip.reads.p:
            falling = grip.coefficients(T_0, v, surface, ~back, static=static).f
            other = sliding_ratio(_unlocked(falling * grip.tangent))
        if grip.varies:
            still = grip.coefficients(T_0, v, surface, back & False, static=True).f
            margin = 1 - largest(still * grip.tangent)
        return Limit(fz, ratio, other, found.slope, margin)

    def kinetic(self, T_0: Array, omega: Array, surface: Any, mode: Mode) -> Float[Array, " n"]:
        """Coefficients of friction that the linings have when they slide."""
        v = jnp.broadcast_to(jnp.where(mode.sense > 0, omega, -omega) * self.radius, (self.count,))
        return self.grip.coefficients(T_0, v, surface, mode.band == BandMode.SLIP_BACK, static=False).f

    def linings(self, T_0: Array, T_n: Array, fz: Array) -> LiningForces:
        """Forces at every lining by the mobilisation rule (model §3)."""
        return mobilised(T_0, T_n, (1 + fz) / (1 - fz), jnp.asarray(self.grip.linings.angle))

    def sliding(self, T_0: Array, fz: Array, back: Array) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
        """Friction `T_i − T_{i−1}` and normal load `(T_i + T_{i−1}) s_i` of the linings (N) while every one slides."""
        signed = pick(back, -fz, fz)
        along = T_0 * running_product((1 + signed) / (1 - signed))
        before = jnp.concatenate([T_0[None], along[:-1]])
        return along - before, (along + before) * self.grip.sine

    def margins(self, T_0: Array, T_n: Array, fz: Array) -> Float[Array, " twice_n"]:
        """By how much (N) each lining is past its limit, from either end (see `AbstractMechanism.lining_margins`)."""
        mu = (1 + fz) / (1 - fz)
        ahead = T_n - T_0 * jnp.cumprod(mu)
        back = T_0 - T_n * jnp.cumprod(mu[::-1])[::-1]
        return jnp.concatenate([ahead, back])


def band_torque(grip: Grip, radius: Array, T_0: Array, omega: Array, surface: Any) -> Float[Array, ""]:
    """`R_b T_0 (Π − 1)`, in reverse `R_b T_0 (1 − 1/Π)`, of linings that slide on a band at rest.

    A lining that locks itself makes it infinite; in reverse the tight end can only become slack: `R_b T_0`.
    """
    back = omega < 0
    v = jnp.broadcast_to(jnp.abs(omega) * radius, (grip.linings.count,))
    mu, margin = grip.ratios(grip.coefficients(T_0, v, surface, back, static=False).f)
    growth = jnp.where(back, 1 - 1 / product(mu), product(mu) - 1)
    growth = jnp.where(margin > 0, growth, jnp.where(back, 1.0, jnp.inf))
    return jnp.where(T_0 > 0, radius * T_0 * growth, 0.0)


# --- linings at rest --------------------------------------------------------------------------------------------------

_GRID, _ROUNDS, _NEWTON = 32, 3, 4


class Resting(NamedTuple):
    """Linings while the pulley is at rest; some of them may still move.

        fixed:   R_b (T_i − T_{i−1}) = θ M_i + Q_i, but T_{i−1}/μ_i ≤ T_i ≤ T_{i−1} μ_i;   M_i = q_i (T_i+T_{i−1}) + p_i
        others:  T_i = a_i T_{i−1} + b_i,   λ_i = σ_i M_i

    `arm` `R_b`; `mu` static ratios on the band; `grip` `q_i = R f_i s_i`, `floor` `p_i = R f_i N_pre,i` of the rim;
    `pull` `Q_i`; `gain` `a_i`, `offset` `b_i` and `sense` `σ_i` of linings that are not `fixed`.
    """

    fixed: Bool[Array, " n"]
    arm: Float[Array, ""]
    mu: Float[Array, " n"]
    grip: Float[Array, " n"]
    floor: Float[Array, " n"]
    pull: Float[Array, " n"]
    gain: Float[Array, " n"]
    offset: Float[Array, " n"]
    sense: Float[Array, " n"]


class Shared(NamedTuple):
    """A load shared by the linings at rest: `θ`, tensions, and the load torques between which the pulley stays."""

    share: Float[Array, ""]
    tension: Float[Array, " n"]
    least: Float[Array, ""]
    most: Float[Array, ""]


def unbounded(r: Resting, before: Array, share: Array) -> Array:
    """`T_i` of fixed linings by the share of their grip on the rim alone."""
    return ((r.arm + share * r.grip) * before + share * r.floor + r.pull) / (r.arm - share * r.grip)


def resting_tensions(r: Resting, T_0: Float[Array, ""], share: Float[Array, ""]) -> Float[Array, " n"]:
    """Tensions `T_1…T_n` for a share `θ` of the grip on the rim."""

    def lining(before: Array, one: Resting) -> tuple[Array, Array]:
        T = jnp.clip(unbounded(one, before, share), before / one.mu, before * one.mu)
        T = jnp.where(one.fixed, T, one.gain * before + one.offset)
        return T, T

    each = r._replace(arm=jnp.broadcast_to(r.arm, r.mu.shape))
    return jax.lax.scan(lining, T_0, each)[1]


def yields_on_band(
    r: Resting, T_0: Float[Array, ""], along: Float[Array, " n"], way: Int[Array, ""]
) -> Bool[Array, " n"]:
    """Which linings let go on the band, the others on the rim, when the pulley starts to move `way` (±1)."""
    before = jnp.concatenate([T_0[None], along[:-1]])
    wanted = unbounded(r, before, way.astype(jnp.float64))
    return jnp.where(way > 0, wanted >= before * r.mu, wanted <= before / r.mu)


def carried(r: Resting, T_0: Float[Array, ""], along: Float[Array, " n"]) -> Float[Array, ""]:
    """Torque `Σ λ_i` that all linings together take from the pulley (N·m)."""
    before = jnp.concatenate([T_0[None], along[:-1]])
    moving = r.sense * (r.grip * (along + before) + r.floor)
    return jnp.sum(jnp.where(r.fixed, r.arm * (along - before) - r.pull, moving))


def holding_range(r: Resting, T_0: Float[Array, ""]) -> tuple[Array, Array]:
    """Load torques between which the fixed linings hold the pulley: each at the limit of its weaker pair (θ = ∓1)."""
    ends = jnp.asarray([-1.0, 1.0])
    least, most = jax.vmap(lambda share: carried(r, T_0, resting_tensions(r, T_0, share)))(ends)
    return least, most


def share_load(r: Resting, T_0: Float[Array, ""], load: Float[Array, ""]) -> Shared:
    """The share `θ` of their grip on the rim with which all fixed linings carry the load, and the tensions.

    `Σ λ_i(θ) = M_load` is one equation for one number, with corners where linings come to their limit on the band. It
    rises with `θ` while all linings are fixed; where springs move some of them it need not (these press harder on the
    rim when the tension before them rises), and the last root at which it rises is taken. Three passes over a grid of
    32 intervals bracket the root, Newton inside the bracket sharpens it, and one last Newton step with a frozen slope
    carries the exact derivative. A load outside the range is carried up to `θ = ±1`.
    """
    frozen, T_f, load_f = jax.lax.stop_gradient((r, T_0, load))
    steps = jnp.linspace(0.0, 1.0, _GRID + 1)

    def sum_at(r: Resting, T_0: Array, share: Array) -> Array:
        return carried(r, T_0, resting_tensions(r, T_0, share))

    def narrow(_: Array, ends: tuple[Array, Array]) -> tuple[Array, Array]:
        grid = ends[0] + (ends[1] - ends[0]) * steps
        below = jax.vmap(lambda share: sum_at(frozen, T_f, share))(grid) < load_f
        rising = jnp.max(jnp.where(below[:-1] & ~below[1:], jnp.arange(_GRID, dtype=jnp.int32), -1))
        i = jnp.where(rising >= 0, rising, jnp.where(below[-1], _GRID - 1, 0)).astype(jnp.int32)
        return grid[i], grid[i + 1]

    def slope_at(share: Array) -> tuple[Array, Array]:
        value, slope = jax.jvp(lambda share: sum_at(frozen, T_f, share), (share,), (jnp.ones_like(share),))
        return value, jnp.where(slope > 0, slope, jnp.inf)

    low, high = jax.lax.fori_loop(0, _ROUNDS, narrow, (-jnp.ones_like(T_f), jnp.ones_like(T_f)))

    def newton(_: Array, share: Array) -> Array:
        value, slope = slope_at(share)
        return jnp.clip(share - (value - load_f) / slope, low, high)

    share = jax.lax.fori_loop(0, _NEWTON, newton, 0.5 * (low + high))
    least, most = holding_range(r, T_0)
    inside = (least < load) & (load < most)
    correction = (sum_at(r, T_0, share) - load) / slope_at(share)[1]
    share = jnp.where(inside, share - correction, share)
    return Shared(share, resting_tensions(r, T_0, share), least, most)
