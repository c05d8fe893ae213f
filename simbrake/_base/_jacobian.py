"""Derivatives outside of `jit`, by one program that is kept, where JAX would compile
operation by operation, anew in every process."""

import functools
import itertools
import math
from collections.abc import Callable, Iterable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PyTree

from ..hybrid.arrays import Array
from ._compiling import Compiled
from ._packing import Packing, is_traced, pack
from ._store import kept

#: entries of a matrix of derivatives up to which it is made as a whole
_MOST_SLOPES = 2**22


def _is_real(x: Any) -> bool:
    return jnp.issubdtype(jnp.result_type(x), jnp.floating)


def _reals(tree: PyTree) -> list[Any]:
    return [leaf for leaf in jax.tree.leaves(tree) if _is_real(leaf)]


def with_precompiled_jacobian(
    function: Callable, subject: tuple, inside: Callable | None = None
) -> Callable:
    """`function(*arguments)`, whose values and first derivatives come from one stored
    program where it is differentiated outside of `jit`: JAX would compile operation by
    operation, anew in every process.

    The program gives the matrix of all derivatives. What JAX differentiates is a
    product with it, forwards, backwards and mapped. Inside of `jit`, and where the
    matrix is too large, the function is differentiated as it is.

    - `subject`: a name, and all that the function depends on
    - `inside`: the same function, for programs that do not
      differentiate it
    """

    def with_slopes(*arguments: PyTree) -> tuple[PyTree, Array]:
        leaves, structure = jax.tree.flatten(arguments)
        numbers, like = pack(_reals(leaves), jnp)

        def of_numbers(x: Array) -> tuple[Array, PyTree]:
            reals = iter(like.unpack(x))
            values = function(
                *jax.tree.unflatten(
                    structure, [next(reals) if _is_real(y) else y for y in leaves]
                )
            )
            return pack(_reals(values), jnp)[0], values

        size = jax.eval_shape(of_numbers, numbers)[0].size
        jacobian = jax.jacrev if size <= numbers.size else jax.jacfwd
        slopes, values = jacobian(of_numbers, has_aux=True)(numbers)
        return values, slopes

    def fits(packing: Packing) -> bool:
        def entries() -> int:
            arguments = packing.stand_in()
            both = arguments, jax.eval_shape(function, *arguments)
            return math.prod(sum(leaf.size for leaf in _reals(tree)) for tree in both)

        return kept(("entries", *subject, packing), entries) <= _MOST_SLOPES

    program = Compiled(with_slopes, subject=("slopes", *subject))

    @jax.custom_jvp
    def call(*arguments: PyTree) -> PyTree:
        return (inside or function)(*arguments)

    @functools.partial(call.defjvp, symbolic_zeros=True)
    def _(primals: tuple, tangents: tuple) -> tuple[PyTree, PyTree]:
        if (
            not is_traced(primals)
            and jax.default_backend() == "cpu"
            and fits(Packing.of(primals))
        ):
            # (JAX has classes of its own for scalars)
            values, slopes = program(*jax.tree.map(np.asarray, primals))
            both = zip(*map(jax.tree.leaves, (primals, tangents)), strict=True)
            moves = [
                d if hasattr(d, "shape") else np.asarray(d)
                for x, d in both
                if _is_real(x)
            ]
            return values, _along(np.asarray(slopes), values, moves)
        moves = jax.tree.map(
            lambda d: np.zeros(d.shape, d.dtype) if _is_zero(d) else d, tangents
        )
        return jax.jvp(function, primals, moves)

    return call


def _is_zero(tangent: Any) -> bool:
    return isinstance(tangent, jax.custom_derivatives.SymbolicZero)


def _along(slopes: np.ndarray, values: PyTree, moves: list[Any]) -> PyTree:
    """Tangents of the values for moves of all numbers, by the derivatives (values,
    numbers).

    What does not depend on a number passes nothing on to it. Products are bare
    operations, few of which have other shapes than those before.
    """

    def ends(arrays: Iterable[Any]) -> list[int]:
        return np.cumsum([0, *(math.prod(x.shape) for x in arrays)]).tolist()

    def tangent(value: Array, rows: np.ndarray) -> Array:
        total: Any = np.zeros(value.shape)
        for (a, b), move in zip(itertools.pairwise(ends(moves)), moves, strict=True):
            if not _is_zero(move) and np.any(block := rows[:, a:b]):
                axes = range(value.ndim, value.ndim + move.ndim), range(move.ndim)
                part = jax.lax.dot_general(
                    block.reshape(value.shape + move.shape), move, (axes, ((), ()))
                )
                total = part if type(total) is np.ndarray else jax.lax.add(total, part)
        return total

    reals = _reals(values)
    by_place = zip(reals, itertools.pairwise(ends(reals)), strict=True)
    tangents = iter([tangent(value, slopes[a:b]) for value, (a, b) in by_place])
    return jax.tree.map(
        lambda x: (
            next(tangents) if _is_real(x) else np.zeros(x.shape, jax.dtypes.float0)
        ),
        values,
    )
