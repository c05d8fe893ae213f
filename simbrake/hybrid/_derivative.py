"""First derivatives of a recorded run: a sweep over its rows, forwards (jvp) or
backwards (vjp).

The step lengths are frozen, as they are no part of the result. A row that landed on a
guard carries the implicit derivative of its time, `dt = −dg / ġ`; one that ended on a
time breakpoint carries that of the breakpoint."""

from collections.abc import Callable
from typing import NamedTuple, NoReturn, TypeAlias, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, PyTree

from ._method import AbstractMethod
from .arrays import Array, Count, Mark, Scalar, State, TwoArrays
from .system import ADVANCED, FINISHED, INSTANT, LANDED, SKIPPED, STOPPED, Flat, Rows

Start = tuple[Scalar, State]  # of a row, or its cotangents
Turned = TypeVar("Turned")


def _landing(flat: Flat, t1: Scalar, row: Rows, t: Scalar, y: State, f: State) -> Start:
    """Time and state of an event at the end of one row, before any jump, from the end
    of its step."""
    t2 = t + row.delta
    y2 = y + row.delta * f
    g = flat.guards(t2, y2, row.mode)
    f2, rate = flat.rates(t2, y2, row.mode)
    chosen = jnp.arange(g.shape[0], dtype=jnp.int32) == row.guard
    g = jnp.sum(jnp.where(chosen, g, 0.0))
    rate = jnp.sum(jnp.where(chosen, rate, 0.0))
    # value 0: only the derivative of the place where the guard is 0 (those of the rates
    # would be multiplied by it)
    dt = -(g - jax.lax.stop_gradient(g)) / jnp.where(rate == 0, -1.0, rate)
    # or that of the time breakpoint
    stop = jnp.where(row.kind == FINISHED, t1, flat.next_stop(row.mode, y2))
    stops = (row.kind == STOPPED) | (row.kind == FINISHED)
    move = stop - t2
    dt = jnp.where(
        stops,
        move - jax.lax.stop_gradient(move),
        jnp.where(row.kind == LANDED, dt, 0.0),
    )
    return jnp.where(stops, stop, t2 + dt), y2 + dt * f2


def before_jump(flat: Flat, method: AbstractMethod, t1: Scalar, row: Rows) -> Start:
    """Time and state at the end of one row, before any jump, with the derivatives of
    the event."""

    def moved() -> Start:
        y, f = method.step_with_rate(
            lambda t, y: flat.rhs(t, y, row.mode), row.t, row.y, row.h
        )
        t = row.t + row.h
        return jax.lax.cond(
            row.kind == ADVANCED,
            lambda: (t, y),
            lambda: _landing(flat, t1, row, t, y, f),
        )

    # an overlong step that was rejected may overflow
    return jax.lax.cond(row.kind == SKIPPED, lambda: (row.t, row.y), moved)


def _jumps(row: Rows) -> Mark:
    return (row.kind == LANDED) | (row.kind == INSTANT) | (row.kind == STOPPED)


def advance(
    flat: Flat, method: AbstractMethod, t1: Array, row: Rows, mode_after: Array
) -> Start:
    """Start of the next row."""
    t, y = before_jump(flat, method, t1, row)
    y = jax.lax.cond(
        _jumps(row), lambda: flat.reset(t, y, row.mode, mode_after), lambda: y
    )
    return t, y


def pull_back(
    flat_of: Callable[[PyTree], Flat],
    method: AbstractMethod,
    params: PyTree,
    t1_of: Callable[[PyTree], Scalar],
    row: Rows,
    mode_after: Array,
    c: Start,
) -> tuple[PyTree, Scalar, State]:
    """Cotangents of `(params, t, y)` at the start of a row for those of the start of
    the next: `advance` backwards.

    Quantities of events are differentiated within their branch: otherwise every branch
    would pass on its intermediate results.
    """

    def moved() -> tuple[PyTree, Scalar, State]:
        step = method.pullback(
            lambda p, t, y: flat_of(p).rhs(t, y, row.mode), params, row.t, row.y, row.h
        )
        t = row.t + row.h

        def event() -> tuple[PyTree, Scalar, State, State]:
            def landing(params: PyTree, t: Scalar, y: State, f: State) -> Start:
                return _landing(flat_of(params), t1_of(params), row, t, y, f)

            (t2, y2), back = jax.vjp(landing, params, t, step.y, step.f)

            def jump() -> tuple[PyTree, Scalar, State]:
                def reset(params: PyTree, t: Scalar, y: State) -> State:
                    return flat_of(params).reset(t, y, row.mode, mode_after)

                d_params, c_t, c_y = jax.vjp(reset, params, t2, y2)[1](c[1])
                return d_params, c[0] + c_t, c_y

            def stay() -> tuple[PyTree, Scalar, State]:
                return jax.tree.map(jnp.zeros_like, params), *c

            at_jump, c_t, c_y = jax.lax.cond(_jumps(row), jump, stay)
            d_params, d_t, d_y, d_f = back((c_t, c_y))
            return jax.tree.map(jnp.add, d_params, at_jump), d_t, d_y, d_f

        def plain() -> tuple[PyTree, Scalar, State, State]:
            return jax.tree.map(jnp.zeros_like, params), *c, jnp.zeros_like(step.f)

        at_event, c_t, c_y, c_f = jax.lax.cond(row.kind == ADVANCED, plain, event)
        d_params, d_t, d_y = step.back(c_y, c_f)
        return jax.tree.map(jnp.add, d_params, at_event), c_t + d_t, d_y

    def unmoved() -> tuple[PyTree, Scalar, State]:
        return jax.tree.map(jnp.zeros_like, params), *c

    return jax.lax.cond(row.kind == SKIPPED, unmoved, moved)


class RowMap(NamedTuple):
    """The start `(t, y)` of row `i + 1` as a function of that of row `i`, and its
    derivative backwards.

    `fixed`: arrays that both take besides, not differentiated.  `own`: numbers of this
    row alone.
    """

    # (fixed, params, own, start, i) → start
    advance: Callable[[PyTree, PyTree, PyTree, Array, Count], Array]
    #: (fixed, params, own, start, i, c) → cotangents of parameters, own numbers and
    #: start
    back: Callable[
        [PyTree, PyTree, PyTree, Array, Count, Array], tuple[PyTree, PyTree, Array]
    ]


#: calls a function of a tree of arrays, as the caller has it compiled
Call: TypeAlias = Callable[[Callable[[PyTree], PyTree], PyTree], PyTree]


def sweep(
    row_map: RowMap,
    fixed: PyTree,
    params: PyTree,
    own: PyTree,
    starts: Float[Array, "row start"],
    count: Count,
    tangents: tuple[PyTree, PyTree, Array],
    call: Call,
) -> Float[Array, "row start"]:
    """Tangents of every row's start, `(rows, 1 + ny)`, for tangents of the parameters,
    of the numbers that each row has of its `own` (rows, …), and of the first start."""
    sealed = tuple(_first_order_only(x) for x in (params, own, starts))

    def forward(_: Callable[[PyTree], PyTree], b: PyTree) -> PyTree:
        *moves, _ = b
        return *moves, call(along, (fixed, *sealed, count, *moves))

    def along(arrays: PyTree) -> Array:
        fixed, params, own, starts, count, d_params, d_own, d_start = arrays

        def body(i: Count, state: TwoArrays) -> TwoArrays:
            d, out = state
            here = (params, _row(own, i), starts[i])
            moves = (d_params, _row(d_own, i), d)
            d = jax.jvp(
                lambda q, o, x: row_map.advance(fixed, q, o, x, i), here, moves
            )[1]
            return d, jax.lax.dynamic_update_slice(
                out, d[None], (i + 1, jnp.zeros_like(i))
            )

        out = jnp.zeros_like(starts).at[0].set(d_start)
        return _repeat(count, body, (d_start, out))[1]

    def backward(_: Callable[[PyTree], PyTree], cotangents: PyTree) -> PyTree:
        c_params, c_own, c_start, c_rows = cotangents
        c, *totals = call(back, (fixed, *sealed, count, c_params, c_own, c_rows))
        return *totals, c_start + c, jnp.zeros_like(c_rows)

    def back(arrays: PyTree) -> tuple[Array, PyTree, PyTree]:
        fixed, params, own, starts, count, c_params, c_own, c_rows = arrays

        def body(
            j: Count, state: tuple[Array, PyTree, PyTree]
        ) -> tuple[Array, PyTree, PyTree]:
            i = count - 1 - j
            c, total, of_rows = state
            d_params, d_own, c = row_map.back(
                fixed, params, _row(own, i), starts[i], i, c + c_rows[i + 1]
            )
            of_rows = jax.tree.map(
                lambda x, d: jax.lax.dynamic_update_index_in_dim(x, d, i, 0),
                of_rows,
                d_own,
            )
            return c, jax.tree.map(jnp.add, total, d_params), of_rows

        # (cotangents of the own numbers themselves come after those of the rows, which
        # take their places)
        nothing = jax.tree.map(jnp.zeros_like, own)
        c, total, of_rows = _repeat(
            count, body, (jnp.zeros_like(starts[0]), c_params, nothing)
        )
        return c + c_rows[0], total, jax.tree.map(jnp.add, of_rows, c_own)

    # One linear operator with an explicit transpose. JAX requires every part of the
    # right-hand side to depend on the tangent, so that zeros (numbers that are not
    # differentiated, the rows) are written as 0 times the sum of all tangents.
    zero = 0.0 * sum(jnp.sum(leaf) for leaf in jax.tree.leaves(tangents))
    moves = jax.tree.map(lambda leaf: leaf + zero, tangents)
    solution = jax.lax.custom_linear_solve(
        lambda x: x,
        (*moves, jnp.zeros_like(starts) + zero),
        solve=forward,
        transpose_solve=backward,
    )
    return solution[-1]


def _row(of_rows: PyTree, i: Count) -> PyTree:
    return jax.tree.map(lambda x: x[i], of_rows)


def _repeat(
    count: Count, body: Callable[[Count, Turned], Turned], state: Turned
) -> Turned:
    """`body(i, state)` for `i < count`."""

    def turn(loop: tuple[Count, Turned]) -> tuple[Count, Turned]:
        return loop[0] + 1, body(*loop)

    return jax.lax.while_loop(
        lambda loop: loop[0] < count, turn, (jnp.zeros_like(count), state)
    )[1]


@jax.custom_jvp
def _first_order_only(x: PyTree) -> PyTree:
    return x


@_first_order_only.defjvp
def _(primals: tuple[PyTree], tangents: tuple[PyTree]) -> NoReturn:
    raise NotImplementedError(
        "simbrake gives first derivatives only: a derivative of a derivative through a "
        "run is not available. "
        "Take differences of first derivatives instead, as simbrake.studies.hessian does."
    )


def no_tangent(x: Array) -> Array:
    """Zero tangent of an output without derivative."""
    if jnp.issubdtype(jnp.result_type(x), jnp.inexact):
        return jnp.zeros_like(x)
    return np.zeros(jnp.shape(x), jax.dtypes.float0)
