"""State carried by step attempts, and evaluation of the guards: no event, a shorter
attempt, or an event at its end.

The carry is packed into two vectors instead of twenty arrays: XLA then updates all of
it in two small kernels. With one kernel per array it would also repeat the decisions of
an attempt in every one of them.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Float, Int

from . import _thresholds as at
from .arrays import (
    Array,
    Count,
    GuardMarks,
    Guards,
    Mark,
    Scalar,
    State,
    entry,
    first_least,
    numpy_of,
)
from .system import ravel, unravel


class Stats(NamedTuple):
    """Counts of one run: accepted steps, rejected ones, attempts truncated at events,
    events, segments."""

    accepted: Count
    rejected: Count
    retaken: Count
    events: Count
    segments: Count


class Carry(NamedTuple):
    """State of the loop between two attempts."""

    t: Scalar
    h: Scalar  # what the step-size controller proposes
    # longest next attempt: of a retake, of the two looks after a restart (0, then the
    # first length), or to just before a known crossing; else infinite
    h_limit: Scalar
    crosses_within: Scalar  # time within which a guard is known to cross
    t_event: Scalar
    y: State
    f: State
    g: Guards
    g_rate: Guards
    # derivatives of the state, where they steer the steps as well
    tangents: tuple[State, ...]
    status: Count
    retakes: Count
    events_at_instant: Count  # events at this very instant
    zeno_count: Count  # repeated firings in the present cluster
    # 2 just after a restart: rates and guards are unknown; then 1: the first step's
    # length is unknown; else 0
    restart_stage: Count
    stats: Stats
    armed: GuardMarks  # clear of zero at some time since the last restart
    # limits reached at the time breakpoint where the segment begins
    touched_at_breakpoint: GuardMarks
    # fired in the present cluster of events with hardly any time between
    zeno_guards: GuardMarks
    mode: Int[Array, " mode"]


#: the first field of a carry with whole numbers or marks
_WHOLE = Carry._fields.index("status")

Packed = tuple[Float[Array, " x"], Int[Array, " n"]]


def pack(carry: Carry) -> Packed:
    return ravel(carry[:_WHOLE], jnp.float64), ravel(carry[_WHOLE:], jnp.int32)


def unpack(packed: Packed, like: Carry) -> Carry:
    """The carry in two vectors, with the shapes of the carry `like`."""
    x, n = packed
    carry = Carry(*unravel(x, like[:_WHOLE]), *unravel(n, like[_WHOLE:]))
    return carry._replace(
        armed=carry.armed > 0,
        touched_at_breakpoint=carry.touched_at_breakpoint > 0,
        zeno_guards=carry.zeno_guards > 0,
    )


# --- where a guard reaches zero inside a step: the cubic through its end values and end rates


def first_root(g0: Guards, d0: Guards, g1: Guards, d1: Guards) -> Guards:
    """First root in (0, 1] of the cubic Hermite interpolant of each guard.

    `g0, g1` are the values at the ends and `d0, d1` the rates times the step. A guard
    with `g0 <= 0` counts as 0 at the start, and that root is divided out: the next one
    is found, at which it returns to 0. The caller ensures `g1 < 0`.
    """
    from_zero = g0 <= 0
    start = jnp.where(from_zero, 0.0, g0)
    c2 = 3 * (g1 - start) - 2 * d0 - d1
    c3 = 2 * (start - g1) + d0 + d1

    # (places s may be one column for all guards)
    def value(s: Float[Array, "*points columns"]) -> Float[Array, "*points guard"]:
        full = ((c3 * s + c2) * s + d0) * s + start
        return jnp.where(from_zero, (c3 * s + c2) * s + d0, full)

    def slope(s: Guards) -> Guards:
        return jnp.where(from_zero, 2 * c3 * s + c2, (3 * c3 * s + 2 * c2) * s + d0)

    before = jnp.arange(at.SAMPLES, dtype=g0.dtype)[:, None]
    below = value((before + 1) / at.SAMPLES) <= 0
    j = jnp.min(jnp.where(below, before, at.SAMPLES - 1.0), axis=0)

    def refine(
        _: Count | int, bracket: tuple[Guards, Guards, Guards]
    ) -> tuple[Guards, Guards, Guards]:
        low, high, s = bracket
        v = value(s)
        low = jnp.where(v > 0, s, low)
        high = jnp.where(v > 0, high, s)
        k = slope(s)
        newton = s - v / jnp.where(k == 0, 1.0, k)
        # (the ends are inside: a root that is found stays where it is)
        inside = (newton >= low) & (newton <= high) & (k != 0)
        return low, high, jnp.where(inside, newton, 0.5 * (low + high))

    low = j / at.SAMPLES
    high = (j + 1) / at.SAMPLES
    return jax.lax.fori_loop(
        0, at.REFINEMENTS, refine, (low, high, 0.5 * (low + high))
    )[2]


def interior_minimum(
    g0: Guards, d0: Guards, g1: Guards, d1: Guards, margin: float = at.INSIDE
) -> tuple[Guards, Guards, GuardMarks]:
    """Place, value and existence of a minimum of the cubic Hermite interpolant inside
    the step, more than `margin` (a share of the step) from its ends."""
    xp = numpy_of(g0)
    c2 = 3 * (g1 - g0) - 2 * d0 - d1
    c3 = 2 * (g0 - g1) + d0 + d1
    discriminant = c2**2 - 3 * c3 * d0
    root = xp.sqrt(xp.maximum(discriminant, 0.0))
    # the same root in the form that does not cancel
    denominator = xp.where(c2 >= 0, c2 + root, 3 * c3)
    s = xp.where(c2 >= 0, -d0, root - c2) / xp.where(denominator == 0, 1.0, denominator)
    exists = (discriminant > 0) & (denominator != 0) & (s > margin) & (s < 1 - margin)
    s = xp.where(exists, s, 0.5)
    return s, ((c3 * s + c2) * s + d0) * s + g0, exists


# --- evaluation of the guards after an accepted attempt -----------------------------


class Found(NamedTuple):
    """The first event of an attempt."""

    step_fraction: Scalar  # where it is, `inf` where the attempt is valid
    guard: Count
    instant: Mark  # `guard` fires where the step started


def leaving(carry: Carry, h: Scalar) -> GuardMarks:
    """Guards that rise from zero over an attempt by more than rounding."""
    return ~carry.armed & (carry.g_rate * h > at.RISING * at.TINY)


def crossed(
    carry: Carry, h: Scalar, g1: Guards, g_rate1: Guards, tol: Scalar
) -> GuardMarks:
    """Whether a guard is negative at the end of an attempt; touching zero within
    rounding is not a crossing."""
    returned = g1 < jnp.where(
        leaving(carry, h), jnp.minimum(carry.g, 0.0) - at.TINY, -tol
    )
    return jnp.where(
        carry.armed, (g1 < -at.TINY) | ((g1 <= 0) & (g_rate1 < 0)), returned
    )


def exceeded(
    carry: Carry, h: Scalar, g1: Guards, g_rate1: Guards, room: Scalar
) -> GuardMarks:
    """Whether a guard is clearly negative at the end of an attempt, or will be before a
    time breakpoint in `room`.

    After the attempt the guard is continued with the curvature that its cubic has at
    the end, if that is more than rounding.
    """
    d0 = carry.g_rate * h
    d1 = g_rate1 * h
    bend = jnp.maximum(6 * (carry.g - g1) + 2 * d0 + 4 * d1 - at.BENDING * at.TINY, 0.0)
    turn = jnp.where(
        (bend > 0) & (d1 < 0), -d1 / jnp.where(bend > 0, bend, 1.0), jnp.inf
    )
    s = jnp.minimum(jnp.where(h > 0, room / jnp.where(h > 0, h, 1.0), 0.0), turn)
    return (g1 < -at.TOUCH) | (g1 + s * (d1 + 0.5 * s * bend) < -at.TOUCH)


def inconsistent(carry: Carry, tol: Scalar) -> GuardMarks:
    """Guards that are negative where the attempt starts, except those that rise after
    rounding."""
    return (carry.g < -tol) & ((carry.g_rate <= 0) | (carry.g < -at.DEEP * tol))


def suspicious(
    carry: Carry,
    h: Scalar,
    g1: Guards,
    g_rate1: Guards,
    tol: Scalar,
    crosses: GuardMarks,
) -> GuardMarks:
    """Guards at which `search` could find an event: the cheap test of every attempt."""
    dips = (g_rate1 > 0) & (
        (carry.g_rate < 0) | (3 * (g1 - carry.g) < h * (carry.g_rate + g_rate1))
    )
    return crosses | inconsistent(carry, tol) | dips


def search(
    carry: Carry,
    h: Scalar,
    g1: Guards,
    g_rate1: Guards,
    tol: Scalar,
    crosses: GuardMarks,
    negative_from: Guards | float,
) -> Found:
    """First crossing or dip of any guard over an attempt of length `h`.

    `negative_from` is the share of the step from which a guard was seen to be negative,
    `inf` where it was not.
    """
    d0 = carry.g_rate * h
    d1 = g_rate1 * h
    # a guard that falls from 0 (a rise by rounding is none) fires at the start if its
    # slope there explains the drop; else attempts are halved until it does
    sinking = ~carry.armed & (carry.g <= tol) & ~leaving(carry, h) & crosses
    # (just above -tol the steps that are left would be too short to move a state)
    at_start = inconsistent(carry, tol) | (
        sinking & ((d0 <= at.EXPLAINED * g1) | (carry.g <= -at.SUNK * tol))
    )
    root = jnp.where(
        sinking | (carry.retakes >= at.AIMED), 0.5, first_root(carry.g, d0, g1, d1)
    )
    step_fraction = jnp.where(crosses, root, jnp.inf)

    # the cubic is an estimate: an attempt to a minimum near zero shows the guard there
    s, lowest, exists = interior_minimum(carry.g, d0, g1, d1)
    high = jnp.maximum(carry.g, g1)
    near = exists & ~crosses & (lowest < at.LOW * high) & (high > at.HIGH * tol)
    step_fraction = jnp.minimum(step_fraction, jnp.where(near, s, jnp.inf))
    step_fraction = jnp.minimum(step_fraction, negative_from)
    least, i = first_least(jnp.where(at_start, -1.0, step_fraction))
    return Found(step_fraction=entry(step_fraction, i), guard=i, instant=least < 0)


def sampled(
    guards: Callable[[Scalar, State, Int[Array, " mode"]], Guards],
    carry: Carry,
    h: Scalar,
    y1: State,
    f1: State,
    tol: Scalar,
    n: int,
) -> Guards:
    """First of `n` evenly spaced points inside the step at which a guard is negative,
    as a share of the step.

    The state between the ends is the cubic Hermite interpolant; an excursion of 1/(n +
    1) of the step or longer cannot hide between the points.
    """
    points = jnp.arange(1, n + 1, dtype=h.dtype) / (n + 1)

    def guards_at(s: Scalar) -> Guards:
        blend = s * s * (3 - 2 * s)
        y = (
            (1 - blend) * carry.y
            + blend * y1
            + h * s * (1 - s) * ((1 - s) * carry.f - s * f1)
        )
        return guards(carry.t + s * h, y, carry.mode)

    negative = jax.vmap(guards_at)(points) < -tol
    return jnp.where(
        jnp.any(negative, axis=0), points[jnp.argmax(negative, axis=0)], jnp.inf
    )
