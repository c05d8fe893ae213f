"""Linear systems whose matrix is tridiagonal but for a small border: the Jacobians of chains that meet in a few places.

    [ A  B ] [u]   [b]     A (m, m) dense: the core
    [ C  T ] [w] = [c]     T (n, n) tridiagonal: chains one behind the other

Cost `O(n m² + m³)` to factor and `O(n m)` to solve, instead of `O((n + m)³)`.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import jax.scipy.linalg
import numpy as np
from jaxtyping import Float, Int

from ._arrays import Array

#: kinds of a state's place in the Jacobian; a number ≥ 0 is its place in the chain
CORE, QUADRATURE = -1, -2


class Couplings(NamedTuple):
    """Places of the entries of a flat state: core, chain in its order, and quadratures (no rate depends on them)."""

    core: tuple[int, ...]
    chain: tuple[int, ...]
    quadrature: tuple[int, ...]

    @classmethod
    def of(cls, kinds: np.ndarray) -> "Couplings":
        """From one number per entry: CORE, QUADRATURE or the place in the chain."""
        inside = np.flatnonzero(kinds >= 0)
        return cls(
            tuple(int(i) for i in np.flatnonzero(kinds == CORE)),
            tuple(int(i) for i in inside[np.argsort(kinds[inside], kind="stable")]),
            tuple(int(i) for i in np.flatnonzero(kinds == QUADRATURE)),
        )


class Bordered(NamedTuple):
    """A matrix over the entries core, then chain. `lower[i]` stands at `(i, i − 1)`, `upper[i]` at `(i, i + 1)`."""

    core: Float[Array, "m m"]
    right: Float[Array, "m n"]
    below: Float[Array, "n m"]
    lower: Float[Array, " n"]
    diagonal: Float[Array, " n"]
    upper: Float[Array, " n"]

    @property
    def transposed(self) -> "Bordered":
        lower, upper = self.upper, self.lower
        if self.diagonal.shape[0]:
            lower, upper = jnp.pad(self.upper[:-1], (1, 0)), jnp.pad(self.lower[1:], (0, 1))
        return Bordered(self.core.T, self.below.T, self.right.T, lower, self.diagonal, upper)


def jacobian(f, y: Float[Array, " m_plus_n"], m: int) -> tuple[Bordered, Float[Array, "more m_plus_n"]]:
    """Jacobian of `f`, whose entries from `m` on couple among themselves only with their neighbours.

    `f` may give more than `y` has; the rows of these are the second result. Core columns and three colours of chain
    columns come from directional derivatives, core rows and the rows beyond from one reverse pass each: `2 m + 3`
    passes and one for each row more, however long the chain.
    """
    size = y.shape[0]
    n = size - m
    place = np.arange(n)
    seeds = np.zeros((m + min(n, 3), size))
    seeds[np.arange(m), np.arange(m)] = 1.0
    for colour in range(min(n, 3)):
        seeds[m + colour, m + place[colour::3]] = 1.0
    values, push = jax.linearize(f, y)
    columns = jax.vmap(push)(jnp.asarray(seeds))[:, :size]
    wanted = np.concatenate([np.eye(m, len(values)), np.eye(len(values))[size:]])
    rows = jnp.zeros((0, size))
    if len(wanted):
        pull = jax.linear_transpose(push, y)
        rows = jax.vmap(lambda e: pull(e)[0])(jnp.asarray(wanted))
    core, below = columns[:m, :m].T, columns[:m, m:].T
    if n == 0:
        nothing = jnp.zeros(0)
        return Bordered(core, jnp.zeros((m, 0)), below, nothing, nothing, nothing), rows[m:]
    colours = columns[m:, m:]  # (colours, n)

    def diagonal(offset: int) -> Array:
        # entry (i, i + offset) lies in the colour of column i + offset; masks, as gathers are slow in loops
        rows = [jnp.where((place + offset) % 3 == c, colours[c], 0.0) for c in range(colours.shape[0])]
        return jnp.where((place + offset >= 0) & (place + offset < n), sum(rows[1:], start=rows[0]), 0.0)

    return Bordered(core, rows[:m, m:], below, diagonal(-1), diagonal(0), diagonal(1)), rows[m:]


class Factored(NamedTuple):
    """A bordered matrix made ready for many right-hand sides."""

    matrix: Bordered
    levels: tuple[Array, Array]  # (passes, n) of the chain: multipliers of the entries 1, 2, 4, … before and behind
    pivots: Float[Array, " n"]  # what is left of the chain's diagonal
    reduced: Any  # Schur complement of the chain: its inverse, or its LU where it is large
    spread: Float[Array, "n m"]  # T⁻¹ C


def _neighbours(x: Float[Array, "n ..."], k: Array, beyond: float) -> tuple[Array, Array]:
    """`x[i − k]` and `x[i + k]`, and the value `beyond` the ends."""
    n = x.shape[0]
    rest = jnp.full_like(x, beyond)
    wide = jnp.concatenate([rest, x, rest])
    zeros = (jnp.zeros_like(k),) * (x.ndim - 1)
    return tuple(jax.lax.dynamic_slice(wide, (start, *zeros), x.shape) for start in (n - k, n + k))  # pyright: ignore


def _reaches(n: int) -> Int[Array, " passes"]:
    """Distances 1, 2, 4, … below `n`."""
    return jnp.asarray([1 << i for i in range((n - 1).bit_length())], jnp.int32)


def _reduction(a: Bordered) -> tuple[tuple[Array, Array], Array]:
    """Parallel cyclic reduction of the chain: every pass takes neighbours of twice the distance out of each equation.

    log₂ n passes over whole vectors, where elimination from end to end is one long chain of divisions; a loop, as
    written out the passes would be fused into one another. No pivoting: meant for diagonally dominant chains, as of
    conduction. The sums of the rows are carried along instead of the diagonal, which is 10⁹ times larger in thin
    layers: nothing cancels then. Reference: R. W. Hockney, C. R. Jesshope, *Parallel Computers* (1981), section 5.4.
    """

    def reduce(rows: tuple[Array, Array, Array], k: Array) -> tuple[tuple[Array, Array, Array], tuple[Array, Array]]:
        lower, total, upper = rows
        (l_before, l_behind), (u_before, u_behind) = _neighbours(lower, k, 0.0), _neighbours(upper, k, 0.0)
        t_before, t_behind = _neighbours(total, k, 1.0)
        before, behind = -lower / (t_before - l_before - u_before), -upper / (t_behind - l_behind - u_behind)
        total = total + before * t_before + behind * t_behind
        return (before * l_before, total, behind * u_behind), (before, behind)

    start = (a.lower, a.lower + a.diagonal + a.upper, a.upper)
    (lower, total, upper), levels = jax.lax.scan(reduce, start, _reaches(a.diagonal.shape[0]))
    return levels, total - lower - upper


def _along(levels: tuple[Array, Array], pivots: Array, b: Float[Array, "n ..."]) -> Float[Array, "n ..."]:
    """`T⁻¹ b`."""
    each = (slice(None), *(None,) * (b.ndim - 1))

    def substitute(b: Array, level: tuple[Array, Array, Array]) -> tuple[Array, None]:
        before, behind, k = level
        b_before, b_behind = _neighbours(b, k, 0.0)
        return b + before[each] * b_before + behind[each] * b_behind, None

    return jax.lax.scan(substitute, b, (*levels, _reaches(b.shape[0])))[0] / pivots[each]


def _inverse(a: Float[Array, "m m"]) -> Float[Array, "m m"]:
    """By Gauss–Jordan elimination with row pivoting on rows of equal size, written with masks instead of indices."""
    m = a.shape[0]
    place = jnp.arange(m, dtype=jnp.int32)
    size = jnp.max(jnp.abs(a), axis=1, keepdims=True)
    size = jnp.where(size > 0, size, 1.0)

    def eliminate(k: Array, rows: Array) -> Array:
        column = jnp.sum(jnp.where(place == k, rows[:, :m], 0.0), axis=1)
        best = jnp.argmax(jnp.where(place >= k, jnp.abs(column), -1.0)).astype(jnp.int32)
        here, there = (place == k)[:, None], (place == best)[:, None]
        row_k, row_best = jnp.sum(jnp.where(here, rows, 0.0), axis=0), jnp.sum(jnp.where(there, rows, 0.0), axis=0)
        rows = jnp.where(here, row_best, jnp.where(there, row_k, rows))
        column = jnp.sum(jnp.where(place == k, rows[:, :m], 0.0), axis=1)
        pivot = jnp.sum(jnp.where(place == k, column, 0.0))
        row = row_best / pivot
        return jnp.where(here, row, rows - column[:, None] * row)

    whole = jnp.concatenate([a / size, jnp.eye(m) / size.T], axis=1)
    return jax.lax.fori_loop(np.int32(0), np.int32(m), eliminate, whole)[:, m:]


#: a core up to this size is inverted in plain code, which a compiler can join with all the rest; a larger one by LAPACK
_SMALL_CORE = 16


def factor(a: Bordered) -> Factored:
    """Eliminates the chain."""
    levels, pivots = _reduction(a)
    spread = _along(levels, pivots, a.below)
    complement = a.core - a.right @ spread
    if 0 < complement.shape[0] <= _SMALL_CORE:
        return Factored(a, levels, pivots, _inverse(complement), spread)
    return Factored(a, levels, pivots, jax.scipy.linalg.lu_factor(complement) if complement.size else None, spread)


def solve(a: Factored, b: Float[Array, " m_plus_n"]) -> Float[Array, " m_plus_n"]:
    """`x` with `A x = b`."""
    m = a.matrix.core.shape[0]
    chain = _along(a.levels, a.pivots, b[m:])
    if m == 0:
        return chain
    core = b[:m] - a.matrix.right @ chain
    core = a.reduced @ core if m <= _SMALL_CORE else jax.scipy.linalg.lu_solve(a.reduced, core)
    return jnp.concatenate([core, chain - a.spread @ core])
