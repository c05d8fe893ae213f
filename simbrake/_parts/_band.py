"""Statics of a band on linings: the lining model, and the chord model of the papers.

Linings `i = 1…n` are counted from the slack end (tension `T_0`) to the tight end (tension `T_n`), arrays accordingly.
Tag Z: Zhuravlov et al., *Dynamics of friction couples of a band-shoe brake*.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Bool, Float, Int

from .._hybrid._arrays import Array


def grip(f: Float[Array, "..."], angle: Float[Array, " n"]) -> Float[Array, " n"]:
    """`f_i z_i = f_i tan(β_i/2)` of each lining; at 1 or above the lining locks itself."""
    return f * jnp.tan(angle / 2)


def tension_ratio(fz: Float[Array, " n"]) -> tuple[Float[Array, " n"], Bool[Array, " n"]]:
    """Tension ratio of each lining at its limit, and which linings lock themselves.

        μ_i = T_i/T_{i−1} = (1 + f_i z_i)/(1 − f_i z_i),   z_i = tan(β_i/2)                                (Z-12…Z-14)

    Where `f_i z_i ≥ 1` the limit is infinite: that lining is marked and its ratio given as 1, for the caller to treat.
    """
    locked = fz >= 1.0
    safe = jnp.where(locked, 0.0, fz)
    return (1 + safe) / (1 - safe), locked


@jax.custom_jvp
def product(mu: Float[Array, " n"]) -> Float[Array, ""]:
    """`∏ μ_i` of ratios that are never 0."""
    return jnp.prod(mu)


@product.defjvp
def _(primals, tangents):
    # the general rule of jnp.prod costs n products; here no factor is 0
    (mu,), (d_mu,) = primals, tangents
    whole = jnp.prod(mu)
    return whole, whole * jnp.sum(d_mu / mu)


def _running(combine: Callable[[Array, Array], Array], x: Float[Array, " n"], neutral: float) -> Float[Array, " n"]:
    """`x_1 ∘ … ∘ x_i` by doubling: log₂ n short vector operations, where a sum over a mask costs n² serial ones."""
    reach = 1
    while reach < x.shape[0]:
        x = combine(x, jnp.concatenate([jnp.full(reach, neutral), x[:-reach]]))
        reach *= 2
    return x


@jax.custom_jvp
def running_product(mu: Float[Array, " n"]) -> Float[Array, " n"]:
    """`Π_i = ∏_{j≤i} μ_j` of ratios that are never 0."""
    return _running(jnp.multiply, mu, 1.0)


@running_product.defjvp
def _(primals, tangents):
    (mu,), (d_mu,) = primals, tangents
    running = running_product(mu)
    return running, running * _running(jnp.add, d_mu / mu, 0.0)


@jax.custom_jvp
def sliding_ratio(fz: Float[Array, " n"]) -> Float[Array, ""]:
    """`Π = ∏ (1 + f_i z_i)/(1 − f_i z_i)` for `|f_i z_i| < 1`; of negative ones it is `1/Π`."""
    return jnp.prod((1 + fz) / (1 - fz))


@sliding_ratio.defjvp
def _(primals, tangents):
    # d ln Π = Σ 2 d(f_i z_i)/(1 − (f_i z_i)²)
    (fz,), (d_fz,) = primals, tangents
    ratio = sliding_ratio(fz)
    return ratio, ratio * jnp.sum(2 / (1 - fz * fz) * d_fz)


def affine_tensions(T_0: Float[Array, ""], a: Float[Array, " n"], b: Float[Array, " n"]) -> Float[Array, " n"]:
    """`T_i = a_i T_{i−1} + b_i` without a loop: `T_i = A_i (T_0 + Σ_{j≤i} b_j/A_j)`, `A_i = ∏_{j≤i} a_j ≠ 0`."""
    A = running_product(a)
    return A * (T_0 + _running(jnp.add, b / A, 0.0))


def capstan_ratio(f: Float[Array, ""], wrap: Float[Array, ""]) -> Float[Array, ""]:
    """Euler's limit for many small linings, `T_n/T_0 → exp(f α)`."""
    return jnp.exp(f * wrap)


class LiningForces(NamedTuple):
    """Forces at every lining: tension behind it `T_i`, circumferential and normal force `F_i`, `N_i` (N).

    `tension` is `None` where no band presses the linings.
    """

    tension: Any
    friction: Float[Array, " n"]
    normal: Float[Array, " n"]
    at_limit: Bool[Array, " n"]


def mobilised(
    T_0: Float[Array, ""], T_n: Float[Array, ""], mu: Float[Array, " n"], angle: Float[Array, " n"]
) -> LiningForces:
    """Distribution of a given pair of end tensions by the mobilisation rule (model §3).

        T_i = min(T_0 Π_i, T_n)                 from the slack end while T_n ≥ T_0
        T_i = min(T_n ∏_{j>i} μ_j, T_0)         from the anchor while T_n < T_0
        F_i = (T_i − T_{i−1}) cos(β_i/2),  N_i = (T_i + T_{i−1}) sin(β_i/2)                                (Z-12)

    The first linings of that order are at their limit, the next carries the rest, the others nothing: the rule used
    wherever rigid bodies leave the split undetermined.
    """
    forward = T_n >= T_0
    ahead = jnp.cumprod(mu)
    behind = jnp.append(jnp.cumprod(mu[::-1])[::-1][1:], 1.0)
    tension = jnp.where(forward, jnp.minimum(T_0 * ahead, T_n), jnp.minimum(T_n * behind, T_0))
    before = jnp.append(T_0, tension[:-1])
    slack = 1e-12 * jnp.maximum(T_0, T_n)
    limit_ahead = T_0 * ahead <= T_n + slack
    limit_behind = T_n * jnp.cumprod(mu[::-1])[::-1] <= T_0 + slack
    at_limit = jnp.where(forward, limit_ahead, limit_behind) & (jnp.maximum(T_0, T_n) > 0)
    return LiningForces(
        tension=tension,
        friction=(tension - before) * jnp.cos(angle / 2),
        normal=(tension + before) * jnp.sin(angle / 2),
        at_limit=at_limit,
    )


def limit_tensions(T_0: Float[Array, ""], mu: Float[Array, " n"]) -> Float[Array, " pieces"]:
    """Tensions `T_n` (2 n + 1,), rising, at which one lining more or less is at its limit.

        T_0/∏_{all} μ, …, T_0/μ_n, T_0, T_0 μ_1, …, T_0 Π_n

    Between two of them all tensions along the band are linear in `T_n`.
    """
    down = running_product(mu[::-1])
    return jnp.concatenate([T_0 / down[::-1], T_0[None], T_0 * running_product(mu)])


def piece_of(T_0: Float[Array, ""], T_n: Float[Array, ""], mu: Float[Array, " n"]) -> Int[Array, ""]:
    """Number of linings at their limit: `k = 0…n − 1` from the slack end; with `T_n < T_0` `−1 − k` from the anchor."""
    n = mu.shape[0]
    passed = jnp.sum(limit_tensions(T_0, mu) <= T_n).astype(jnp.int32)
    return jnp.clip(passed - 1 - n, -n, n - 1)


def tensions_on(
    T_0: Float[Array, ""], T_n: Float[Array, ""], mu: Float[Array, " n"], piece: Int[Array, ""]
) -> Float[Array, " n"]:
    """Tensions `T_1…T_n` by the mobilisation rule for a given number of linings at their limit (see `piece_of`).

    Linear in `T_0` and `T_n`. `n` and `−1 − n` stand for full slip ahead and back, whatever `T_n`.
    """
    n = mu.shape[0]
    i = jnp.arange(1, n + 1, dtype=jnp.int32)
    behind = jnp.append(running_product(mu[::-1])[::-1][1:], 1.0)
    ahead = jnp.where(i <= piece, T_0 * running_product(mu), T_n)
    back = jnp.where(i >= n + 1 + piece, T_n * behind, T_0)
    return jnp.where(piece >= 0, ahead, back)


def sliding_tensions(
    T_0: Float[Array, ""],
    f: Float[Array, " n"],
    angle: Float[Array, " n"],
    *,
    inertia_force: Float[Array, " n"] | float = 0.0,
    centrifugal_force: Float[Array, " n"] | float = 0.0,
) -> LiningForces:
    """All linings at their limit, with the optional mass terms of the lining model (model §2.2).

        F_i = (T_i − T_{i−1}) c_i + m_i a_i,  N_i = (T_i + T_{i−1}) s_i − m_i R ω_i² ≥ 0,  F_i = f_i N_i    (Z-12…Z-14)
        T_i = [T_{i−1} (c_i + f_i s_i) − m_i a_i − f_i m_i R ω_i²] / (c_i − f_i s_i)

    - `inertia_force`: `m_i a_i` (N), the lining's own acceleration along the rim
    - `centrifugal_force`: `m_i R ω_i²` (N), the lining's own speed; where it exceeds the band's push the lining lifts
      off: `N_i = F_i = 0` and `T_i = T_{i−1} − m_i a_i/c_i`.

    A lining on an anchored band rests: both are zero and `T_i = μ_i T_{i−1}`. Needs `f_i tan(β_i/2) < 1`.
    """
    c, s = jnp.cos(angle / 2), jnp.sin(angle / 2)
    ma = jnp.broadcast_to(jnp.asarray(inertia_force, c.dtype), c.shape)
    mrw = jnp.broadcast_to(jnp.asarray(centrifugal_force, c.dtype), c.shape)
    f = jnp.broadcast_to(f, c.shape)

    def lining(before, one):
        f, c, s, ma, mrw = one
        after = (before * (c + f * s) - ma - f * mrw) / (c - f * s)
        lifted = (after + before) * s < mrw
        after = jnp.where(lifted, before - ma / c, after)
        normal = jnp.where(lifted, 0.0, (after + before) * s - mrw)
        return after, (after, f * normal, normal)

    _, (tension, friction, normal) = jax.lax.scan(lining, jnp.asarray(T_0, c.dtype), (f, c, s, ma, mrw))
    return LiningForces(tension, friction, normal, jnp.ones(c.shape, bool))


class ChordForces(NamedTuple):
    """Tensions `T_1…T_k` of the chords behind the linings and normal loads `N_1…N_k` (N)."""

    tension: Float[Array, " k"]
    normal: Float[Array, " k"]


def chord_tensions(T_0: Float[Array, ""], f: Float[Array, "..."], beta: Float[Array, " k_plus_1"]) -> ChordForces:
    """Tensions along a band on point linings joined by chords (model §2.1).

        T_i = T_{i−1} (c_{i−1} + f s_{i−1}) / (c_i − f s_i),   N_i = T_i s_i + T_{i−1} s_{i−1}              (Z-1…Z-4)

    `beta` (k + 1,) holds `β_0…β_k` (rad): chord `i` between lining `i` and `i + 1` subtends `β_i`, `β_0` and `β_k`
    belong to the end chords. Needs `1 − f z_i > 0` for every `i ≥ 1`.
    """
    c, s = jnp.cos(beta / 2), jnp.sin(beta / 2)
    ratio = (c[:-1] + f * s[:-1]) / (c[1:] - f * s[1:])
    tension = T_0 * jnp.cumprod(ratio)
    before = jnp.append(jnp.asarray(T_0, tension.dtype), tension[:-1])
    return ChordForces(tension, tension * s[1:] + before * s[:-1])
