"""Flat views of states and modes, and the layout of one recorded row."""

import itertools
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int, PyTree

from ._arrays import Array
from ._system import AbstractHybridSystem, AbstractSemiExplicitSystem

#: what became of one step attempt
SKIPPED, ADVANCED, FINISHED, LANDED, INSTANT, STOPPED = range(6)


def _parts(leaves: list[Any]) -> list[list[Any]]:
    """Leaves in order, scalars that follow each other together: in programs one equation takes or gives all of them."""
    runs = ((scalars, list(run)) for scalars, run in itertools.groupby(leaves, key=lambda leaf: np.ndim(leaf) == 0))
    return [part for scalars, run in runs for part in ([run] if scalars else [[leaf] for leaf in run])]


def unravel(flat: Any, like: PyTree) -> PyTree:
    """Entries along the last axis of an array as leaves shaped like those of `like`."""
    leaves, structure = jax.tree.flatten(like)
    parts, known = _parts(leaves), isinstance(flat, np.ndarray)
    sizes = [sum(int(np.size(leaf)) for leaf in part) for part in parts]
    if len(parts) < 2:
        pieces = [flat] * len(parts)
    elif known:
        pieces = np.split(flat, np.cumsum(sizes)[:-1], axis=-1)
    else:
        pieces = jax.lax.split(flat, sizes, axis=flat.ndim - 1)
    found = []
    for piece, part in zip(pieces, parts, strict=True):
        if np.ndim(part[0]):
            found.append(piece.reshape((*flat.shape[:-1], *np.shape(part[0]))))
        else:
            found += [piece[..., i] for i in range(len(part))] if known else jnp.unstack(piece, axis=-1)
    return jax.tree.unflatten(structure, found)


def ravel(tree: PyTree, dtype: Any) -> Array:
    """All leaves in one vector."""
    parts = _parts([jnp.asarray(leaf, dtype) for leaf in jax.tree.leaves(tree)])
    pieces = [jnp.ravel(part[0]) if np.ndim(part[0]) else jnp.stack(part) for part in parts]
    if len(pieces) < 2:
        return pieces[0] if pieces else jnp.zeros(0, dtype)
    return jnp.concatenate(pieces)


def pack_mode(mode: PyTree) -> Int[Array, " mode"]:
    return ravel(mode, jnp.int32)


class Flat(eqx.Module):
    """A hybrid system on flat vectors: state `(ny,)`, mode `(nm,)` of int32.

    What programs ask for again and again, for stages, guards and their derivatives, is traced once for all systems of
    one structure.
    """

    system: AbstractHybridSystem
    y_like: PyTree
    mode_like: PyTree

    def unpack_state(self, y: Array) -> PyTree:
        return unravel(y, self.y_like)

    def unpack_mode(self, mode: Array) -> PyTree:
        return unravel(mode, self.mode_like)

    @eqx.filter_jit
    def rhs(self, t: Array, y: Array, mode: Array) -> Array:
        return _packed(self.system.rhs(t, self.unpack_state(y), self.unpack_mode(mode)))

    @eqx.filter_jit
    def guards(self, t: Array, y: Array, mode: Array) -> Array:
        return self.system.guards(t, self.unpack_state(y), self.unpack_mode(mode))

    def reset(self, t: Array, y: Array, before: Array, after: Array) -> Array:
        modes = self.unpack_mode(before), self.unpack_mode(after)
        return _packed(_reset(self.system, t, self.unpack_state(y), *modes))

    def next_stop(self, mode: Array) -> Array:
        return jnp.asarray(self.system.next_stop(self.unpack_mode(mode)), jnp.float64)

    def look(self, t: Array, y: Array, mode: Array) -> tuple[Array, Array, Array]:
        """Rates of the states, guards and their rates."""
        system, y, mode = self.system, self.unpack_state(y), self.unpack_mode(mode)
        if isinstance(system, AbstractSemiExplicitSystem):
            now = system.instant(t, y, mode)
            moving = (jnp.ones_like(t), now.y_rate, now.z_rate)
            g, rate = jax.jvp(lambda t, y, z: system.margins(t, y, mode, z), (t, y, now.z), moving)
            return _packed(now.y_rate), g, rate
        f = jax.tree.map(jnp.asarray, system.rhs(t, y, mode))
        return _packed(f), *jax.jvp(lambda t, y: system.guards(t, y, mode), (t, y), (jnp.ones_like(t), f))

    def rates(self, t: Array, y: Array, mode: Array) -> tuple[Array, Array]:
        """Rates of states and guards, without derivatives."""
        numbers, rest = eqx.partition((self, t, y), eqx.is_inexact_array)
        still, t, y = eqx.combine(jax.lax.stop_gradient(numbers), rest)
        f, _, rate = still.look(t, y, mode)
        return f, rate

    def jump(self, t: Array, y: Array, mode: Array, fired: Array, at_stop: Array) -> tuple[Array, Array, Array]:
        """State, mode and code just after an event."""
        y, before = self.unpack_state(y), self.unpack_mode(mode)
        after, code = self.system.transition(t, y, before, fired, at_stop)
        after = jax.tree.map(lambda label: jnp.asarray(label, jnp.int32), after)
        return _packed(_reset(self.system, t, y, before, after)), pack_mode(after), jnp.asarray(code, jnp.int32)


@eqx.filter_jit
def _reset(system: AbstractHybridSystem, t: Array, y: PyTree, before: PyTree, after: PyTree) -> PyTree:
    return system.reset(t, y, before, after)


def _packed(y: PyTree) -> Array:
    return ravel(y, jnp.float64)


def flatten(system: AbstractHybridSystem, y0: PyTree, mode0: PyTree) -> Flat:
    """`system` on flat vectors laid out like `y0` and `mode0`."""

    def likes(tree: PyTree, dtype: Any) -> PyTree:
        return jax.tree.map(lambda leaf: jax.ShapeDtypeStruct(np.shape(leaf), dtype), tree)

    return Flat(system, likes(y0, np.float64), likes(mode0, np.int32))


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
