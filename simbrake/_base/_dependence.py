"""What the result of a function depends on, found from its lowered program."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp


class Skeleton(NamedTuple):
    """A PyTree without its numbers: structure, shapes and types. Hashable: answers that hold for all numbers are kept
    by it."""

    structure: Any
    shapes: tuple[tuple[int, ...], ...]
    kinds: tuple[Any, ...]

    def stand_in(self) -> Any:
        """The tree with the shape and type of each number in place of it."""
        parts = zip(self.shapes, self.kinds, strict=True)
        return jax.tree.unflatten(self.structure, [jax.ShapeDtypeStruct(shape, kind) for shape, kind in parts])


def skeleton(tree: Any) -> Skeleton:
    """The skeleton of a tree of numbers, traced ones included."""
    numbers, structure = jax.tree.flatten(tree)
    return Skeleton(structure, tuple(jnp.shape(x) for x in numbers), tuple(jnp.result_type(x) for x in numbers))


def read_by(function: Callable[..., Any], *arguments: Any) -> tuple[Any, ...]:
    """For every leaf of the `arguments` (PyTrees of shapes) whether the result of `function` depends on it.

    The function is lowered once, which drops the arguments that its result does not need. What cannot be lowered by
    itself (a call back to the host, a tracer in a closure, a mistake) counts as depending on all of them: the answer
    only decides what may be left out, and a mistake shows in the run.
    """
    from jax import export  # a module that only this needs

    leaves, structure = jax.tree.flatten(arguments)
    try:
        kept = export.export(jax.jit(function), platforms=("cpu",))(*arguments).module_kept_var_idx
    except Exception:
        kept = tuple(range(len(leaves)))
    return jax.tree.unflatten(structure, [i in kept for i in range(len(leaves))])
