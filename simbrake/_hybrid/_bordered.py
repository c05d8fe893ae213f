"""Linear systems whose matrix is tridiagonal but for a small border: the Jacobians of chains that meet in a few places.

    [ A  B ] [u]   [b]     A (m, m) dense: the core
    [ C  T ] [w] = [c]     T (n, n) tridiagonal: chains one behind the other

Cost `O(n m² + m³)` to factor and `O(n m)` to solve, instead of `O((n + m)³)`.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import jax.scipy.linalg
import numpy as np
from jaxtyping import Array, Float

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
        lower = jnp.pad(self.upper[:-1], (1, 0))
        upper = jnp.pad(self.lower[1:], (0, 1))
        return Bordered(self.core.T, self.below.T, self.right.T, lower, self.diagonal, upper)


def jacobian(f, y: Float[Array, " m_plus_n"], m: int) -> Bordered:
    """Jacobian of `f`, whose entries from `m` on couple among themselves only with their neighbours.

    Core columns and three colours of chain columns come from directional derivatives, core rows from one reverse pass
    each: `2 m + 3` passes, however long the chain.
    """
    size = y.shape[0]
    n = size - m
    place = np.arange(n)
    seeds = np.zeros((m + min(n, 3), size))
    seeds[np.arange(m), np.arange(m)] = 1.0
    for colour in range(min(n, 3)):
        seeds[m + colour, m + place[colour::3]] = 1.0
    _, push = jax.linearize(f, y)
    columns = jax.vmap(push)(jnp.asarray(seeds))
    core, below = columns[:m, :m].T, columns[:m, m:].T
    if n == 0:
        nothing = jnp.zeros(0)
        return Bordered(core, jnp.zeros((m, 0)), below, nothing, nothing, nothing)
    colours = columns[m:, m:]  # (colours, n)

    def diagonal(offset: int) -> Array:
        # entry (i, i + offset) lies in the colour of column i + offset; masks, as gathers are slow in loops
        rows = [jnp.where((place + offset) % 3 == c, colours[c], 0.0) for c in range(colours.shape[0])]
        return jnp.where((place + offset >= 0) & (place + offset < n), sum(rows[1:], start=rows[0]), 0.0)

    if m:
        _, pull = jax.vjp(f, y)
        right = jax.vmap(lambda e: pull(e)[0])(jnp.eye(m, size))[:, m:]
    else:
        right = jnp.zeros((0, n))
    return Bordered(core, right, below, diagonal(-1), diagonal(0), diagonal(1))


class Factored(NamedTuple):
    """A bordered matrix made ready for many right-hand sides."""

    matrix: Bordered
    reduced: tuple[Array, Array]  # LU of the Schur complement of the chain
    spread: Float[Array, "n m"]  # T⁻¹ C


def _along(a: Bordered, b: Float[Array, "n k"]) -> Float[Array, "n k"]:
    if b.shape[0] == 0 or b.shape[1] == 0:
        return b
    if b.shape[0] == 1:
        return b / a.diagonal[:, None]
    return jax.lax.linalg.tridiagonal_solve(a.lower, a.diagonal, a.upper, b)


def factor(a: Bordered) -> Factored:
    """Eliminates the chain."""
    spread = _along(a, a.below)
    return Factored(a, jax.scipy.linalg.lu_factor(a.core - a.right @ spread), spread)


def solve(a: Factored, b: Float[Array, " m_plus_n"]) -> Float[Array, " m_plus_n"]:
    """`x` with `A x = b`."""
    m = a.matrix.core.shape[0]
    chain = _along(a.matrix, b[m:, None])[:, 0]
    if m == 0:
        return chain
    core = jax.scipy.linalg.lu_solve(a.reduced, b[:m] - a.matrix.right @ chain)
    return jnp.concatenate([core, chain - a.spread @ core])
