"""Where a guard reaches zero inside a step, read off the cubic through its end values and end rates."""

import jax
import jax.numpy as jnp
from jaxtyping import Bool, Float

from ._arrays import Array

_SAMPLES = 16
_REFINEMENTS = 8


def first_root(
    g0: Float[Array, " guard"], d0: Float[Array, " guard"], g1: Float[Array, " guard"], d1: Float[Array, " guard"]
) -> Float[Array, " guard"]:
    """First root in (0, 1] of the cubic Hermite interpolant of each guard.

    `g0, g1` are the values at the ends and `d0, d1` the rates times the step. A guard with `g0 <= 0` is taken to start
    at exactly 0 and that root is divided out, so that what is found is its return. The caller knows that `g1 < 0`.
    """
    from_zero = g0 <= 0
    start = jnp.where(from_zero, 0.0, g0)
    c2 = 3 * (g1 - start) - 2 * d0 - d1
    c3 = 2 * (start - g1) + d0 + d1

    def value(s):
        full = ((c3 * s + c2) * s + d0) * s + start
        return jnp.where(from_zero, (c3 * s + c2) * s + d0, full)

    def slope(s):
        return jnp.where(from_zero, 2 * c3 * s + c2, (3 * c3 * s + 2 * c2) * s + d0)

    grid = jnp.arange(1, _SAMPLES + 1, dtype=g0.dtype) / _SAMPLES
    below = jax.vmap(value)(grid) <= 0
    j = jnp.argmax(below.at[-1].set(True), axis=0).astype(g0.dtype)

    def refine(_, bracket):
        low, high, s = bracket
        v = value(s)
        low, high = jnp.where(v > 0, s, low), jnp.where(v > 0, high, s)
        k = slope(s)
        newton = s - v / jnp.where(k == 0, 1.0, k)
        # (at the ends as well: a root that is found stays where it is)
        inside = (newton >= low) & (newton <= high) & (k != 0)
        return low, high, jnp.where(inside, newton, 0.5 * (low + high))

    low, high = j / _SAMPLES, (j + 1) / _SAMPLES
    return jax.lax.fori_loop(0, _REFINEMENTS, refine, (low, high, 0.5 * (low + high)))[2]


def interior_minimum(
    g0: Float[Array, " guard"], d0: Float[Array, " guard"], g1: Float[Array, " guard"], d1: Float[Array, " guard"]
) -> tuple[Float[Array, " guard"], Float[Array, " guard"], Bool[Array, " guard"]]:
    """Place, value and existence of a minimum of the cubic Hermite interpolant strictly inside the step."""
    c2 = 3 * (g1 - g0) - 2 * d0 - d1
    c3 = 2 * (g0 - g1) + d0 + d1
    discriminant = c2**2 - 3 * c3 * d0
    root = jnp.sqrt(jnp.maximum(discriminant, 0.0))
    # the same root in the form that does not cancel
    denominator = jnp.where(c2 >= 0, c2 + root, 3 * c3)
    s = jnp.where(c2 >= 0, -d0, root - c2) / jnp.where(denominator == 0, 1.0, denominator)
    exists = (discriminant > 0) & (denominator != 0) & (s > 0.02) & (s < 0.98)
    s = jnp.where(exists, s, 0.5)
    return s, ((c3 * s + c2) * s + d0) * s + g0, exists
