"""Linings between band and rim on a pulley at rest: how they share the load, which rigid bodies leave undetermined."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Bool, Float, Int

from .._base._corners import clipped
from ..hybrid._arrays import Array

_GRID, _ROUNDS, _NEWTON = 32, 3, 4


class Resting(NamedTuple):
    """Linings while the pulley is at rest; some of them may still move.

        fixed:   R_b (T_i − T_{i−1}) = θ M_i + Q_i, but T_{i−1}/μ_i ≤ T_i ≤ T_{i−1} μ_i;   M_i = q_i (T_i+T_{i−1}) + p_i
        others:  T_i = a_i T_{i−1} + b_i,   λ_i = σ_i M_i

    `arm` `R_b`; `mu` static ratios on the band; `pull` `Q_i`; of the rim `grip` `q_i = R f_i s_i` and `floor` `p_i =
    R f_i (N_pre,i − m_i r_m ω_i²)`, 0 of linings that have lifted off; `gain` `a_i`, `offset` `b_i` and `sense` `σ_i`
    of linings that are not `fixed`.
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
        T = clipped(unbounded(one, before, share), before / one.mu, before * one.mu)
        T = jnp.where(one.fixed, T, one.gain * before + one.offset)
        return T, T

    each = r._replace(arm=jnp.broadcast_to(r.arm, r.mu.shape))
    return jax.lax.scan(lining, T_0, each)[1]


def yields_on_band(
    r: Resting, T_0: Float[Array, ""], along: Float[Array, " n"], way: Int[Array, ""]
) -> Bool[Array, " n"]:
    """Linings that break away on the band (the others on the rim) when the pulley starts to move `way` (±1)."""
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
