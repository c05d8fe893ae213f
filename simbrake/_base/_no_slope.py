"""A number that has no derivative: NaN reaches what asks for it, and nothing else."""

from typing import Any

import jax
import jax.numpy as jnp

from ..hybrid.arrays import Array


def _slope(moved: Array, lost: Array) -> Array:
    """NaN in the place of a tangent or a cotangent that is not 0, where the value is
    `lost`; else 0.

    A product with NaN would make NaN of those that are 0 as well, those of all other
    numbers of a run among them. JAX transposes products alone, and what is said to
    solve a linear system: that may look at what it is given.
    """

    def solve(_: Any, x: Array) -> Array:
        return jnp.where(lost & (x != 0), jnp.nan, 0.0)

    return jax.lax.custom_linear_solve(lambda x: x, moved, solve, symmetric=True)


@jax.custom_jvp
def _nothing(x: Any, lost: Any) -> Array:
    return jnp.zeros_like(x)


@_nothing.defjvp
def _(primals: tuple, tangents: tuple) -> tuple[Any, Any]:
    (x, lost) = primals
    (moved, _) = tangents
    return _nothing(x, lost), _slope(moved, lost)


def without_slope(value: Array, lost: Any, numbers: Any) -> Array:
    """The same value, whose derivatives by the numbers (a PyTree) are NaN where it is
    `lost`."""
    reals = [
        x
        for x in jax.tree.leaves(numbers)
        if jnp.issubdtype(jnp.result_type(x), jnp.floating)
    ]
    total = sum((jnp.sum(jnp.asarray(x)) for x in reals), start=jnp.zeros(()))
    return value + _nothing(
        jnp.broadcast_to(total, jnp.shape(value)),
        jnp.broadcast_to(lost, jnp.shape(value)),
    )
