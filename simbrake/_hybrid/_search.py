"""What the guards say of one accepted step attempt: nothing, retake it shorter, or fire where it started."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Bool, Float, Int

from ._arrays import Array
from ._carry import Carry
from ._locate import first_root, interior_minimum

#: rounding of a guard of order one
TINY = 1e-15


class Found(NamedTuple):
    share: Float[Array, ""]  # of the step, `inf` where it may stand
    crosses: Bool[Array, ""]  # a guard is negative at its end
    guard: Int[Array, ""]
    instant: Bool[Array, ""]  # `guard` fires where the step started


def leaving(c: Carry, h) -> Bool[Array, " guard"]:
    """Guards that rise out of zero over an attempt, not by rounding alone."""
    return ~c.armed & (c.rate * h > 2 * TINY)


def crossed(c: Carry, h, g1, rate1, tol) -> Bool[Array, " guard"]:
    """Whether a guard is negative at the end of an attempt; a touch within rounding is none."""
    returned = g1 < jnp.where(leaving(c, h), jnp.minimum(c.g, 0.0) - TINY, -tol)
    return jnp.where(c.armed, (g1 < -TINY) | ((g1 <= 0) & (rate1 < 0)), returned)


def inconsistent(c: Carry, tol) -> Bool[Array, " guard"]:
    """Guards that are negative already where the attempt starts (and not on their way back up from rounding)."""
    return (c.g < -tol) & ((c.rate <= 0) | (c.g < -1e3 * tol))


def suspicious(c: Carry, h, g1, rate1, tol) -> Bool[Array, ""]:
    """Whether `search` could find anything: the cheap test of every attempt."""
    dips = (rate1 > 0) & ((c.rate < 0) | (3 * (g1 - c.g) < h * (c.rate + rate1)))
    return jnp.any(crossed(c, h, g1, rate1, tol) | inconsistent(c, tol) | dips)


def search(c: Carry, h, g1, rate1, tol, negative_from: Float[Array, " guard"] | float) -> Found:
    """First crossing or dip of any guard over the attempt from `c` with length `h`.

    `negative_from` is the share of the step from which a guard was seen to be negative, `inf` where it was not.
    """
    d0, d1 = c.rate * h, rate1 * h
    crosses = crossed(c, h, g1, rate1, tol)
    # from 0 downwards: at once if the slope at the start explains the drop, else halve until it is clear
    sinking = ~c.armed & (c.g <= tol) & (c.rate <= 0) & crosses
    # (just above -tol the steps that are left would be too short to move a state)
    at_start = inconsistent(c, tol) | (sinking & ((d0 <= 0.5 * g1) | (c.g <= -0.5 * tol)))
    root = jnp.where(sinking | (c.retakes >= 8), 0.5, first_root(c.g, d0, g1, d1))
    share = jnp.where(crosses, root, jnp.inf)

    # the cubic is a guess: a minimum that comes near zero is worth a look, there where it should lie
    s, lowest, exists = interior_minimum(c.g, d0, g1, d1)
    high = jnp.maximum(c.g, g1)
    near = exists & ~crosses & (lowest < 0.1 * high) & (high > 10 * tol)
    share = jnp.minimum(share, jnp.where(near, s, jnp.inf))
    share = jnp.minimum(share, negative_from)
    i = jnp.argmin(jnp.where(at_start, -1.0, share)).astype(jnp.int32)
    return Found(share=share[i], crosses=jnp.any(crosses), guard=i, instant=jnp.any(at_start))


def sampled(guards, c: Carry, h, y1, f1, tol, n: int) -> Float[Array, " guard"]:
    """First of `n` evenly spaced points inside the step at which a guard is negative, as a share of the step.

    The state between the ends is the cubic Hermite interpolant; an excursion of 1/(n + 1) of the step or longer cannot
    hide between the points.
    """
    points = jnp.arange(1, n + 1, dtype=h.dtype) / (n + 1)

    def guards_at(s):
        blend = s * s * (3 - 2 * s)
        y = (1 - blend) * c.y + blend * y1 + h * s * (1 - s) * ((1 - s) * c.f - s * f1)
        return guards(c.t + s * h, y, c.mode)

    negative = jax.vmap(guards_at)(points) < -tol
    return jnp.where(jnp.any(negative, axis=0), points[jnp.argmax(negative, axis=0)], jnp.inf)
