"""Integration in stretches: a long run in parts, between which a caller can look at the clock, joined to one record."""

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PyTree

from ._arrays import Array
from ._carry import carried_size, pack, unpack
from ._loop import Problem, advanced, closed, space, started
from ._method import AbstractMethod
from ._packing import Rows, flatten, pack_mode, ravel, unpack_rows
from ._solve import Record, fitted, likes, weights_of
from ._system import AbstractHybridSystem, Settings


def _go_on(p: Problem, y0: Array, mode0: Array, carried: Array, limit: Any):
    """As `_loop.run`, for `limit` attempts at most, from where `carried` says; and what the next part begins with.

    All of a carry as one vector, in which whole numbers are exact; one that begins with NaN begins the run.
    """
    start = started(p, y0, mode0)
    ny, ng = y0.shape[0], start.g.shape[0]
    x, n = pack(start)
    fresh = jnp.isnan(carried[0])
    x = jnp.where(fresh, x, carried[: x.size])
    n = jnp.where(fresh, n, carried[x.size :].astype(n.dtype))
    (x, n), rows, count = advanced(p, (x, n), space(p, y0, mode0), ny, ng, limit)
    return closed(unpack((x, n), ny, ng), rows, count), jnp.concatenate([x, n.astype(x.dtype)])


def stretch(
    system: AbstractHybridSystem,
    y0: PyTree,
    mode0: PyTree,
    t0: Any,
    t1: Any,
    method: AbstractMethod,
    settings: Settings,
    carried: Array,
    limit: Any,
) -> tuple[Record, Array]:
    """A part of what `hybridsolve` does, `limit` attempts at most (up to `max_steps`), and what the next begins with.

    `carried` is what the part before has left, or `beginning(…)`. Joined, the parts are one run to the last bit,
    however long each of them is: nothing is decided anew at a seam. Not differentiable.
    """
    y0 = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float64), y0)
    t0, t1 = jnp.asarray(t0, jnp.float64), jnp.asarray(t1, jnp.float64)
    flat_y0, flat_mode0 = ravel(y0, jnp.float64), pack_mode(mode0)
    y_like, mode_like = likes(y0, mode0)
    method, weights = fitted(system, method), weights_of(system, y_like)
    p = Problem(flatten(system, y_like, mode_like), method, weights, t0, t1, settings)
    (packed, count, code, stats), carried = _go_on(p, flat_y0, flat_mode0, carried, limit)
    rows = unpack_rows(packed, flat_y0.shape[0])
    return Record(system, method, y_like, mode_like, t1, rows, count, code, stats), carried


def beginning(system: AbstractHybridSystem, y0: PyTree, mode0: PyTree, t0: Any) -> np.ndarray:
    """What `stretch` begins a run with."""
    y, mode = ravel(y0, jnp.float64), pack_mode(mode0)
    guards = flatten(system, *likes(y0, mode0)).guards
    ng = jax.eval_shape(guards, jnp.asarray(t0, jnp.float64), y, mode).size
    return np.full(carried_size(y.size, ng, mode.size), np.nan)


def joined(parts: Sequence[Rows], last: Record, room: int) -> Record:
    """The rows of all parts as one record with space for `room` attempts; `last` is the part that ended the run."""
    count = sum(len(part.t) for part in parts)

    def column(end: Any, *leaves: Any) -> np.ndarray:
        whole = np.zeros((room + 1, *end.shape[1:]), end.dtype)
        np.concatenate(leaves, out=whole[:count])
        whole[count] = np.asarray(end)[int(last.count)]
        return whole

    rows = jax.tree.map(column, last.rows, *parts)
    return eqx.tree_at(lambda r: (r.rows, r.count), last, jax.device_put((rows, np.asarray(count, np.int32))))
