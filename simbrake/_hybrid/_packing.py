"""Flat views of states and modes, and the layout of one recorded row."""

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int, PyTree

from ._arrays import Array
from ._system import AbstractHybridSystem, AbstractSemiExplicitSystem

#: what became of one step attempt
SKIPPED, ADVANCED, FINISHED, LANDED, INSTANT, STOPPED = range(6)


class Flat(NamedTuple):
    """A hybrid system on flat vectors: state `(ny,)`, mode `(nm,)` of int32."""

    rhs: Callable[[Any, Any, Any], Array]
    guards: Callable[[Any, Any, Any], Array]
    look: Callable[[Any, Any, Any], tuple[Array, Array, Array]]  # rates of the states, guards and their rates
    rates: Callable[[Any, Any, Any], tuple[Array, Array]]  # those of states and guards, without derivatives
    jump: Callable[..., tuple[Array, Array, Array]]  # state, mode and code just after an event
    reset: Callable[..., Array]
    next_stop: Callable[[Array], Array]
    unpack_state: Callable[[Array], PyTree]
    unpack_mode: Callable[[Array], PyTree]


def unravel(flat: Any, like: PyTree) -> PyTree:
    """Entries along the last axis of an array as leaves shaped like those of `like`."""
    leaves, structure = jax.tree.flatten(like)
    ends = np.cumsum([0, *(np.size(leaf) for leaf in leaves)]).tolist()
    spans = zip(ends[:-1], ends[1:], leaves, strict=True)
    parts = [flat[..., a:b].reshape((*flat.shape[:-1], *np.shape(leaf))) for a, b, leaf in spans]
    return jax.tree.unflatten(structure, parts)


def ravel(tree: PyTree, dtype: Any) -> Array:
    """All leaves in one vector."""
    leaves = [jnp.ravel(jnp.asarray(leaf, dtype)) for leaf in jax.tree.leaves(tree)]
    return jnp.concatenate(leaves) if leaves else jnp.zeros(0, dtype)


def pack_mode(mode: PyTree) -> Int[Array, " mode"]:
    return ravel(mode, jnp.int32)


def flatten(system: AbstractHybridSystem, y0: PyTree, mode0: PyTree) -> Flat:
    """`system` on flat vectors laid out like `y0` and `mode0`."""

    def unpack_state(flat: Array) -> PyTree:
        return unravel(flat, y0)

    def unpack_mode(flat: Array) -> PyTree:
        return unravel(flat, mode0)

    def state(y: PyTree) -> Array:
        return ravel(y, jnp.float64)

    def jump(t, y, mode, fired, at_stop):
        y, before = unpack_state(y), unpack_mode(mode)
        after, code = system.transition(t, y, before, fired, at_stop)
        after = jax.tree.map(lambda label: jnp.asarray(label, jnp.int32), after)
        return state(system.reset(t, y, before, after)), pack_mode(after), jnp.asarray(code, jnp.int32)

    # traced once each, however often a program asks for them or for their derivatives
    @jax.jit
    def rhs(t, y, mode):
        return state(system.rhs(t, unpack_state(y), unpack_mode(mode)))

    @jax.jit
    def guards(t, y, mode):
        return system.guards(t, unpack_state(y), unpack_mode(mode))

    def look_at(system, t, y, mode):
        y, mode = unpack_state(y), unpack_mode(mode)
        if isinstance(system, AbstractSemiExplicitSystem):
            now = system.instant(t, y, mode)
            moving = (jnp.ones_like(t), now.y_rate, now.z_rate)
            g, rate = jax.jvp(lambda t, y, z: system.margins(t, y, mode, z), (t, y, now.z), moving)
            return state(now.y_rate), g, rate
        f = jax.tree.map(jnp.asarray, system.rhs(t, y, mode))
        return state(f), *jax.jvp(lambda t, y: system.guards(t, y, mode), (t, y), (jnp.ones_like(t), f))

    def rates(t, y, mode):
        numbers, rest = eqx.partition((system, t, y), eqx.is_inexact_array)
        still, t, y = eqx.combine(jax.lax.stop_gradient(numbers), rest)
        f, _, rate = look_at(still, t, y, mode)
        return f, rate

    return Flat(
        rhs=rhs,
        guards=guards,
        look=functools.partial(look_at, system),
        rates=rates,
        jump=jump,
        reset=lambda t, y, before, after: state(
            system.reset(t, unpack_state(y), unpack_mode(before), unpack_mode(after))
        ),
        next_stop=lambda mode: jnp.asarray(system.next_stop(unpack_mode(mode)), jnp.float64),
        unpack_state=unpack_state,
        unpack_mode=unpack_mode,
    )


class Rows(eqx.Module):
    """Recorded step attempts; row `i` starts at `t[i], y[i]` in `mode[i]`, row `count` is the end of the run.

    `h` is the step taken, `kind` one of SKIPPED (rejected or retaken shorter), ADVANCED, LANDED (on guard `guard`,
    after a last move by `delta`), INSTANT (guard `guard`, no time passed), STOPPED (at a known time) and FINISHED.
    """

    t: Float[Array, " row"]
    y: Float[Array, "row state"]
    h: Float[Array, " row"]
    delta: Float[Array, " row"]
    kind: Int[Array, " row"]
    guard: Int[Array, " row"]
    mode: Int[Array, "row mode"]


HEAD = 5


def pack_row(t, h, delta, kind, guard, y, mode) -> Float[Array, " column"]:
    head = jnp.stack([t, h, delta, kind.astype(t.dtype), guard.astype(t.dtype)])
    return jnp.concatenate([head, y, mode.astype(t.dtype)])


def unpack_rows(packed: Float[Array, "row column"], ny: int) -> Rows:
    def integer(x: Array) -> Array:
        return jnp.round(x).astype(jnp.int32)

    return Rows(
        t=packed[..., 0],
        h=packed[..., 1],
        delta=packed[..., 2],
        kind=integer(packed[..., 3]),
        guard=integer(packed[..., 4]),
        y=packed[..., HEAD : HEAD + ny],
        mode=integer(packed[..., HEAD + ny :]),
    )
