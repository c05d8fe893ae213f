"""Limits whose derivatives at a tie are those of one side.

JAX's `minimum`, `maximum` and `clip` give the mean of both sides where their arguments are equal: the derivative of
neither. A scene often starts on such a corner, or stays on it: a number that is 0, a temperature at its threshold.
"""

import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike


def lesser(a: ArrayLike, b: ArrayLike) -> Array:
    """`min(a, b)`; of equal ones the first."""
    return jnp.where(jnp.asarray(a) <= b, a, b)


def greater(a: ArrayLike, b: ArrayLike) -> Array:
    """`max(a, b)`; of equal ones the first."""
    return jnp.where(jnp.asarray(a) >= b, a, b)


def clipped(x: ArrayLike, low: ArrayLike, high: ArrayLike) -> Array:
    """`x` within `low ≤ high`; on a bound it is still `x`."""
    x = jnp.asarray(x)
    return jnp.where(x < low, low, jnp.where(x > high, high, x))
