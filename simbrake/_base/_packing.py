"""Trees of numbers as one vector and back: programs take and give few arrays, as JAX
takes longer to make an array than to compute a small one."""

import functools
import math
from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import PyTree

from ..hybrid.arrays import Array


def is_traced(tree: PyTree) -> bool:
    """Whether any leaf is being traced by a transformation of JAX."""
    return any(
        type(leaf) is not np.ndarray and isinstance(leaf, Tracer)
        for leaf in jax.tree.leaves(tree)
    )


class Packing(NamedTuple):
    """A PyTree without its numbers: structure, shapes and types.

    Hashable: it shapes programs, and answers that hold for all numbers are kept by it.
    Whole numbers (indices in a custom law) come back as such.
    """

    structure: Any
    shapes: tuple[tuple[int, ...], ...]
    kinds: tuple[str, ...]

    @classmethod
    def of(cls, tree: PyTree) -> "Packing":
        leaves, structure = jax.tree.flatten(tree)
        kinds = tuple(
            # (JAX's own way takes 20 times as long)
            _name(leaf.dtype)
            if type(leaf) is np.ndarray
            else str(jnp.result_type(leaf))
            for leaf in leaves
        )
        return cls(structure, tuple(map(np.shape, leaves)), kinds)

    @property
    def size(self) -> int:
        return sum(map(math.prod, self.shapes))

    def unpack(self, numbers: Array) -> PyTree:
        """The tree whose numbers lie in one vector (`pack`)."""
        return jax.tree.unflatten(self.structure, self.reader()(numbers))

    def reader(self) -> Callable[[Array], list[Array]]:
        """What cuts such a vector into the leaves."""
        ends = np.cumsum([math.prod(shape) for shape in self.shapes]).tolist()
        places = [*zip([0, *ends], ends, self.shapes, strict=False)]
        others = [(i, kind) for i, kind in enumerate(self.kinds) if kind != "float64"]

        def read(numbers: Array) -> list[Array]:
            leaves = [numbers[a:b].reshape(shape) for a, b, shape in places]
            for i, kind in others:
                leaves[i] = leaves[i].astype(kind)
            return leaves

        return read

    def stand_in(self) -> PyTree:
        """The tree with the shape and type of each number in place of it."""
        leaves = map(jax.ShapeDtypeStruct, self.shapes, map(np.dtype, self.kinds))
        return jax.tree.unflatten(self.structure, leaves)


_name = functools.cache(str)


@functools.cache
def _kind(dtype: np.dtype) -> str:
    return "float64" if np.issubdtype(dtype, np.floating) else str(dtype)


def pack(tree: PyTree, xp: ModuleType = np) -> tuple[Array, Packing]:
    """All numbers of a tree in one vector, and how they lie in it; `xp`: `jax.numpy`
    for traced ones."""
    leaves, structure = jax.tree.flatten(tree)
    arrays = [xp.asarray(leaf) for leaf in leaves]
    kinds = tuple(_kind(array.dtype) for array in arrays)
    shapes = tuple(array.shape for array in arrays)
    numbers = xp.concatenate([array.ravel() for array in arrays], dtype=np.float64)
    return numbers, Packing(structure, shapes, kinds)


#: entries from which on an array is a separate result: XLA splits larger operations
#: into parallel tasks, which cannot be part of one function
_LARGE = 256


def pack_small(leaves: Sequence[Any]) -> list[Array]:
    """Traced arrays as a program gives them: small ones in one vector, then the large
    ones."""
    small = [leaf for leaf in leaves if leaf.size < _LARGE]
    return [pack(small, jnp)[0], *(leaf for leaf in leaves if leaf.size >= _LARGE)]


def unpack_small(like: PyTree) -> Callable[[Sequence[Array]], PyTree]:
    """What makes a tree like this, in NumPy, of the arrays of `pack_small`; `like`:
    with shapes and types in place of numbers."""
    leaves, structure = jax.tree.flatten(like)
    are_small = [leaf.size < _LARGE for leaf in leaves]
    both = zip(leaves, are_small, strict=True)
    read = Packing.of([leaf for leaf, is_small in both if is_small]).reader()

    def unpack(arrays: Sequence[Array]) -> PyTree:
        large = map(np.asarray, arrays)
        small = iter(read(next(large)))
        parts = [next(small if is_small else large) for is_small in are_small]
        return jax.tree.unflatten(structure, parts)

    return unpack
