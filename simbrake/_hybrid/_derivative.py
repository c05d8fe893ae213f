"""First derivatives of a recorded run: a sweep over its rows, forwards (jvp) or backwards (vjp).

The step lengths are frozen, as they are no part of the answer. A row that landed on a guard carries the implicit
derivative of its time, `dt = −dg / ġ`; one that stopped at a known time that of the known time.
"""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ._invariants import hoisted
from ._method import AbstractMethod
from ._packing import ADVANCED, FINISHED, INSTANT, LANDED, SKIPPED, STOPPED, Flat, Rows


def before_jump(flat: Flat, method: AbstractMethod, t1: Array, row: Rows) -> tuple[Array, Array]:
    """Time and state at the end of one row, before any jump, with the right derivatives."""
    h = jnp.where(row.kind == SKIPPED, 0.0, row.h)  # an overlong step that was rejected may overflow
    f = flat.rhs(row.t, row.y, row.mode)
    y, _, f = method.step(lambda t, y: flat.rhs(t, y, row.mode), row.t, row.y, f, h)
    t = row.t + h

    def advanced():
        return t, y

    def landed():
        t2, y2 = t + row.delta, y + row.delta * f
        g = flat.guards(t2, y2, row.mode)
        f2, rate = flat.rates(t2, y2, row.mode)
        chosen = jnp.arange(g.shape[0], dtype=jnp.int32) == row.guard
        g, rate = jnp.sum(jnp.where(chosen, g, 0.0)), jnp.sum(jnp.where(chosen, rate, 0.0))
        # value 0: only the derivative of the place where the guard is 0 (those of the rates would be multiplied by it)
        dt = -(g - jax.lax.stop_gradient(g)) / jnp.where(rate == 0, -1.0, rate)
        return t2 + dt, y2 + dt * f2

    def stopped():
        stop = jnp.minimum(flat.next_stop(row.mode), t1)
        move = stop - t
        dt = move - jax.lax.stop_gradient(move)
        return jax.lax.stop_gradient(stop) + (stop - jax.lax.stop_gradient(stop)), y + dt * jax.lax.stop_gradient(f)

    def unmoved():
        return row.t, row.y

    branch = jnp.zeros_like(row.kind)  # SKIPPED, INSTANT
    branch = jnp.where(row.kind == ADVANCED, 1, branch)
    branch = jnp.where(row.kind == LANDED, 2, branch)
    branch = jnp.where((row.kind == STOPPED) | (row.kind == FINISHED), 3, branch)
    return jax.lax.switch(branch, [unmoved, advanced, landed, stopped])


def advance(flat: Flat, method: AbstractMethod, t1: Array, row: Rows, mode_after: Array) -> tuple[Array, Array]:
    """Start of the next row."""
    t, y = before_jump(flat, method, t1, row)
    jumps = (row.kind == LANDED) | (row.kind == INSTANT) | (row.kind == STOPPED)
    y = jax.lax.cond(jumps, lambda: flat.reset(t, y, row.mode, mode_after), lambda: y)
    return t, y


RowMap = Callable[[Any, Array, Array], Array]


def sweep(row_map: RowMap, params: Any, starts: Float[Array, "row state"], count: Array, tangents: tuple[Any, Array]):
    """Tangents of every row's start, `(rows, 1 + ny)`, for tangents of the parameters and of the first start.

    `row_map(params, start, i)` is the start of row `i + 1` for the start `(t, y)` of row `i`.
    """
    sealed = (_first_order_only(params), _first_order_only(starts))

    def forward(_, b):
        params, starts = sealed
        d_params, d_start, _ = b

        def body(i, state):
            d, out = state
            d = jax.jvp(lambda q, x: row_map(q, x, i), (params, starts[i]), (d_params, d))[1]
            return d, jax.lax.dynamic_update_slice(out, d[None], (i + 1, jnp.zeros_like(i)))

        out = jnp.zeros_like(starts).at[0].set(d_start)
        return d_params, d_start, _repeat(count, body, (d_start, out))[1]

    def backward(_, cotangents):
        params, starts = sealed
        c_params, c_start, c_rows = cotangents

        def body(j, state):
            i = count - 1 - j
            c, total = state
            c = c + c_rows[i + 1]
            d_params, c = jax.vjp(lambda q, x: row_map(q, x, i), params, starts[i])[1](c)
            return c, jax.tree.map(jnp.add, total, d_params)

        c, total = _repeat(count, body, (jnp.zeros_like(c_start), c_params))
        return total, c_start + c + c_rows[0], jnp.zeros_like(c_rows)

    # One linear operator with its own transpose. JAX wants every part of the right-hand side to depend on the tangent,
    # so that zeros (numbers that are not differentiated, the rows) are written as 0 times the sum of all tangents.
    zero = 0.0 * sum(jnp.sum(leaf) for leaf in jax.tree.leaves(tangents))
    d_params, d_start = jax.tree.map(lambda leaf: leaf + zero, tangents)
    nothing = jnp.zeros_like(starts) + zero
    solution = jax.lax.custom_linear_solve(
        lambda x: x, (d_params, d_start, nothing), solve=forward, transpose_solve=backward
    )
    return solution[2]


def _repeat(count: Array, body: Callable[[Array, Any], Any], state: Any) -> Any:
    """`body(i, state)` for `i < count`, what is the same every time computed once."""
    begin = (jnp.zeros_like(count), state)
    turn = hoisted(lambda loop: (loop[0] + 1, body(*loop)), begin)
    return jax.lax.while_loop(lambda loop: loop[0] < count, turn, begin)[1]


@jax.custom_jvp
def _first_order_only(x):
    return x


@_first_order_only.defjvp
def _(primals, tangents):
    raise NotImplementedError(
        "simbrake gives first derivatives only: a derivative of a derivative through a run is not available. "
        "Take differences of first derivatives instead."
    )


def no_tangent(x: Array) -> Any:
    """Zero tangent of an output without derivative."""
    if jnp.issubdtype(jnp.result_type(x), jnp.inexact):
        return jnp.zeros_like(x)
    return np.zeros(jnp.shape(x), jax.dtypes.float0)
