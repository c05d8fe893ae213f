"""Linear systems whose matrix is tridiagonal but for a small border: the Jacobians of
chains that meet in a few places.

    [ A  B ] [u]   [b]     A (m, m) dense: the core
    [ C  T ] [w] = [c]     T (n, n) tridiagonal: chains one behind the other

Cost `O(n m² + m³)` to factor and `O(n m)` to solve, instead of `O((n + m)³)`."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import jax.scipy.linalg
import numpy as np
from jaxtyping import Float, Int

from .arrays import Array, TwoArrays, Vector, entry, put, take

#: kinds of a state's place in the Jacobian; a number ≥ 0 is its place in the chain
CORE = -1
QUADRATURE = -2
#: added to a place in the chain: its rate is linear in the states, with coefficients
#: that are constant in a run
LINEAR = 1 << 20


class Couplings(NamedTuple):
    """Places of the entries of a flat state: core, chain in its order, and quadratures
    (no rate depends on them)."""

    core: tuple[int, ...]
    chain: tuple[int, ...]
    quadrature: tuple[int, ...]
    # of the chain: whether a row of the Jacobian is constant
    linear: tuple[bool, ...] = ()

    @classmethod
    def of(cls, kinds: np.ndarray) -> "Couplings":
        """From one number per entry: CORE, QUADRATURE or the place in the chain (+
        LINEAR)."""
        inside = np.flatnonzero(kinds >= 0)
        inside = inside[np.argsort(kinds[inside] % LINEAR, kind="stable")]
        return cls(
            tuple(int(i) for i in np.flatnonzero(kinds == CORE)),
            tuple(int(i) for i in inside),
            tuple(int(i) for i in np.flatnonzero(kinds == QUADRATURE)),
            tuple(bool(kind >= LINEAR) for kind in kinds[inside]),
        )

    @property
    def varying(self) -> tuple[int, ...] | None:
        """Places in the chain whose rows change in a run, if forming the others once
        saves passes, else `None`.

        A row that changes costs a reverse pass, a chain whose rows all change no more
        than three forward ones.
        """
        rows = tuple(i for i, constant in enumerate(self.linear) if not constant)
        return rows if self.chain and len(rows) <= len(self.core) + 3 else None


class Bordered(NamedTuple):
    """A matrix over the entries core, then chain. `lower[i]` is at `(i, i − 1)`,
    `upper[i]` at `(i, i + 1)`."""

    core: Float[Array, "m m"]
    right: Float[Array, "m n"]
    below: Float[Array, "n m"]
    lower: Vector
    diagonal: Vector
    upper: Vector

    @property
    def transposed(self) -> "Bordered":
        lower = self.upper
        upper = self.lower
        if self.diagonal.shape[0]:
            lower = jnp.pad(self.upper[:-1], (1, 0))
            upper = jnp.pad(self.lower[1:], (0, 1))
        return Bordered(
            self.core.T, self.below.T, self.right.T, lower, self.diagonal, upper
        )


#: linear part of rates over the entries core, then chain: changes of time and state
#: `(m + n,)` → change `(m + n,)`
Push = Callable[[Any, Array], Array]


class ChainRows(NamedTuple):
    """The rows of a Jacobian that belong to a chain; `lower`, `diagonal` and `upper` as
    in `Bordered`."""

    below: Float[Array, "n m"]
    lower: Vector
    diagonal: Vector
    upper: Vector


def _columns(
    push: Push, m: int, n: int
) -> tuple[Float[Array, "m m"], ChainRows, Float[Array, " entries"]]:
    """Core and chain rows of a Jacobian from `m + 3` forward passes, core columns and
    three colours of chain columns, and the derivative by time from one more."""
    place = np.arange(n)
    colours = min(n, 3)
    seeds = np.zeros((m + colours + 1, m + n))
    seeds[np.arange(m), np.arange(m)] = 1.0
    for colour in range(colours):
        seeds[m + colour, m + place[colour::3]] = 1.0
    columns = jax.vmap(push)(
        jnp.asarray(np.eye(m + colours + 1)[-1]), jnp.asarray(seeds)
    )
    core = columns[:m, :m].T
    below = columns[:m, m:].T
    colour = columns[m:-1, m:]
    drift = columns[-1]

    def diagonal(offset: int) -> Array:
        # entry (i, i + offset) lies in the colour of column i + offset; masks, as
        # gathers are slow in loops
        rows = [
            jnp.where((place + offset) % 3 == c, colour[c], 0.0) for c in range(colours)
        ]
        return jnp.where(
            (place + offset >= 0) & (place + offset < n),
            sum(rows[1:], start=rows[0]),
            0.0,
        )

    if n == 0:
        nothing = jnp.zeros(0)
        return core, ChainRows(below, nothing, nothing, nothing), drift
    return core, ChainRows(below, diagonal(-1), diagonal(0), diagonal(1)), drift


def _rows(
    push: Push, size: int, wanted: tuple[int, ...]
) -> tuple[Float[Array, " k"], Float[Array, "k size"]]:
    """Entries `wanted` of the derivative by time, and these rows of a Jacobian of
    `size` columns, from one reverse pass each."""
    if not wanted:
        return jnp.zeros(0), jnp.zeros((0, size))
    like = [jax.ShapeDtypeStruct(shape, jnp.float64) for shape in ((), (size,))]
    pull = jax.linear_transpose(lambda dt, v: take(push(dt, v), wanted), *like)
    return jax.vmap(pull)(jnp.eye(len(wanted)))


def linear_rows(push: Push, places: Couplings) -> ChainRows:
    """The rows of a chain that are linear, the same everywhere in a run; the others as
    0.

    Of the program of the rates only what these rows take is left.
    """
    m = len(places.core)
    n = len(places.chain)
    linear = tuple(m + i for i, constant in enumerate(places.linear) if constant)
    return _columns(
        lambda dt, v: put(jnp.zeros(m + n), linear, take(push(dt, v), linear)), m, n
    )[1]


def jacobian(
    push: Push, places: Couplings, constant_rows: ChainRows | None = None
) -> tuple[Bordered, Float[Array, " entries"]]:
    """Jacobian of rates over the entries core, then chain, and their derivative by
    time, from their linear part `push`.

    Core and chain columns from `m + 3` forward passes and the core's rows from `m`
    reverse ones, however long the chain is; with the `constant_rows` of the chain, `m`
    reverse passes and one for each other row of the chain.
    """
    m = len(places.core)
    n = len(places.chain)
    varying = places.varying
    if constant_rows is None or varying is None:
        core, chain, drift = _columns(push, m, n)
        right = (
            _rows(push, m + n, tuple(range(m)))[1][:, m:] if n else jnp.zeros((m, 0))
        )
        return Bordered(core, right, *chain), drift
    wanted = (*range(m), *(m + i for i in varying))
    drift, rows = _rows(push, m + n, wanted)
    core = rows[:m, :m]
    right = rows[:m, m:]
    new = rows[m:]
    chain = constant_rows
    for j, i in enumerate(varying):
        before = new[j, m + i - 1] if i > 0 else jnp.zeros(())
        behind = new[j, m + i + 1] if i < n - 1 else jnp.zeros(())
        row = ChainRows(new[j, :m], before, new[j, m + i], behind)
        chain = ChainRows(
            *(_with_row(old, i, value) for old, value in zip(chain, row, strict=True))
        )
    return Bordered(core, right, *chain), put(jnp.zeros(m + n), wanted, drift)


def _with_row(
    old: Float[Array, "n ..."], i: int, value: Float[Array, "..."]
) -> Float[Array, "n ..."]:
    return jnp.concatenate([old[:i], value[None], old[i + 1 :]])


class Factored(NamedTuple):
    """A bordered matrix made ready for many right-hand sides."""

    matrix: Bordered
    # (passes, n) of the chain: multipliers of the entries 1, 2, 4, … before and behind
    levels: TwoArrays
    pivots: Vector  # reduced diagonal of the chain
    # Schur complement of the chain: its inverse, or where it is large its LU and the
    # size of its rows
    reduced: Any
    spread: Float[Array, "n m"]  # T⁻¹ C


def _neighbours(x: Float[Array, "n ..."], k: Array) -> TwoArrays:
    """`x[i − k]` and `x[i + k]`; beyond one end those at the other, where the
    multipliers of a chain are 0."""
    n = x.shape[0]
    twice = jnp.concatenate([x, x])
    zeros = (jnp.zeros_like(k),) * (x.ndim - 1)
    return tuple(
        jax.lax.dynamic_slice(twice, (start, *zeros), x.shape) for start in (n - k, k)
    )  # pyright: ignore


def _reaches(n: int) -> Int[Array, " passes"]:
    """Distances 1, 2, 4, … below `n`."""
    return jnp.asarray([1 << i for i in range((n - 1).bit_length())], jnp.int32)


def _reduction(a: Bordered) -> tuple[TwoArrays, Array]:
    """Parallel cyclic reduction of the chain: every pass takes neighbours of twice the
    distance out of each equation.

    log₂ n passes over whole vectors, where elimination from end to end is one long
    chain of divisions; a loop, as written out the passes would be fused into one
    another. No pivoting: meant for diagonally dominant chains, as of conduction. The
    sums of the rows are carried along instead of the diagonal, which is 10⁹ times
    larger in thin layers: nothing cancels then. Reference: R. W. Hockney, C. R.
    Jesshope, *Parallel Computers* (1981), section 5.4.
    """

    def reduce(
        rows: tuple[Array, Array, Array], k: Array
    ) -> tuple[tuple[Array, Array, Array], TwoArrays]:
        lower, total, upper = rows
        (l_before, l_behind) = _neighbours(lower, k)
        (u_before, u_behind) = _neighbours(upper, k)
        t_before, t_behind = _neighbours(total, k)
        before = -lower / (t_before - l_before - u_before)
        behind = -upper / (t_behind - l_behind - u_behind)
        total = total + before * t_before + behind * t_behind
        return (before * l_before, total, behind * u_behind), (before, behind)

    start = (a.lower, a.lower + a.diagonal + a.upper, a.upper)
    (lower, total, upper), levels = jax.lax.scan(
        reduce, start, _reaches(a.diagonal.shape[0])
    )
    return levels, total - lower - upper


def _along(
    levels: TwoArrays, pivots: Array, b: Float[Array, "n ..."]
) -> Float[Array, "n ..."]:
    """`T⁻¹ b`."""
    each = (slice(None), *(None,) * (b.ndim - 1))

    def substitute(b: Array, level: tuple[Array, Array, Array]) -> tuple[Array, None]:
        before, behind, k = level
        b_before, b_behind = _neighbours(b, k)
        return b + before[each] * b_before + behind[each] * b_behind, None

    return (
        jax.lax.scan(substitute, b, (*levels, _reaches(b.shape[0])))[0] / pivots[each]
    )


def _row_sizes(a: Float[Array, "m m"]) -> Float[Array, "m 1"]:
    """Magnitudes of the rows: pivots are chosen among rows of equal size, or large rows
    swamp small ones."""
    size = jnp.max(jnp.abs(a), axis=1, keepdims=True)
    return jnp.where(size > 0, size, 1.0)


def _inverse(a: Float[Array, "m m"]) -> Float[Array, "m m"]:
    """Inverse by Gauss–Jordan elimination with row pivoting on rows of equal size,
    chosen by a mask."""
    m = a.shape[0]
    size = _row_sizes(a)

    def eliminate(k: Array, carry: TwoArrays) -> TwoArrays:
        rows, free = carry
        column = jax.lax.dynamic_index_in_dim(rows, k, 1, keepdims=False)
        best = jnp.argmax(jnp.where(free, jnp.abs(column), -1.0)).astype(jnp.int32)
        is_best = jnp.arange(m, dtype=jnp.int32) == best
        row = jnp.sum(jnp.where(is_best[:, None], rows, 0.0), axis=0)
        row = row / entry(row, k)
        return jnp.where(
            is_best[:, None], row, rows - column[:, None] * row
        ), free & ~is_best

    whole = jnp.concatenate([a / size, jnp.eye(m) / size.T], axis=1), jnp.ones(m, bool)
    rows, _ = jax.lax.fori_loop(np.int32(0), np.int32(m), eliminate, whole)
    # (rows stay where they are: each column on the left now holds a 1 in the row of its
    # pivot, else 0)
    return _product(rows[:, :m].T, rows[:, m:])


#: a core up to this size is inverted in plain code, which a compiler can fuse with the
#: rest; a larger one by LAPACK
_SMALL_CORE = 16


def _product(a: Float[Array, "k l"], b: Float[Array, "l ..."]) -> Float[Array, "k ..."]:
    """`a @ b`, written out where the core is small: matrix products may be calls of a
    library."""
    if min(a.shape) > _SMALL_CORE:
        return a @ b
    if b.ndim == 1:
        return jnp.sum(a * b, axis=1)
    # in blocks: XLA of JAX 0.10.2 turns a long sum of products in a program of the user
    # into what it cannot compile
    blocks = [
        slice(i, i + _SMALL_CORE) for i in range(0, max(a.shape[1], 1), _SMALL_CORE)
    ]
    first, *others = (
        jnp.sum(a[:, block, None] * b[None, block], axis=1) for block in blocks
    )
    return sum(others, first)


def factor(a: Bordered) -> Factored:
    """Eliminates the chain."""
    levels, pivots = _reduction(a)
    spread = _along(levels, pivots, a.below)
    complement = a.core - _product(a.right, spread)
    if 0 < complement.shape[0] <= _SMALL_CORE:
        return Factored(a, levels, pivots, _inverse(complement), spread)
    if complement.size == 0:
        return Factored(a, levels, pivots, None, spread)
    size = _row_sizes(complement)
    return Factored(
        a,
        levels,
        pivots,
        (jax.scipy.linalg.lu_factor(complement / size), size[:, 0]),
        spread,
    )


def solve(a: Factored, b: Float[Array, " m_plus_n"]) -> Float[Array, " m_plus_n"]:
    """`x` with `A x = b`."""
    m = a.matrix.core.shape[0]
    chain = _along(a.levels, a.pivots, b[m:])
    if m == 0:
        return chain
    core = b[:m] - _product(a.matrix.right, chain)
    if m <= _SMALL_CORE:
        core = _product(a.reduced, core)
        return jnp.concatenate([core, chain - _product(a.spread, core)])
    lu, size = a.reduced
    core = jax.scipy.linalg.lu_solve(lu, core / size)
    # terms of a large core may cancel: the chain is solved again for what they leave of
    # its right-hand side
    return jnp.concatenate(
        [core, _along(a.levels, a.pivots, b[m:] - a.matrix.below @ core)]
    )
