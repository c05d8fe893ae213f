"""Limits whose derivatives at a tie are those of one side, and a rounded corner.

JAX's `minimum`, `maximum` and `clip` give the mean of both sides where their arguments
are equal: the derivative of neither. A scene often starts on such a corner, or stays on
it: a number that is 0, a temperature at its threshold.
"""

import functools
from typing import Any

import jax
import jax.numpy as jnp
from jax import Array
from jax.custom_derivatives import SymbolicZero
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


def rounded(x: Array, w: Array | None) -> Array:
    """`max(x, 0)` with its corner rounded over `±w`, four times continuously
    differentiable.

        w u⁵ (14 − 28 u + 20 u² − 5 u³),   u = (x + w)/(2 w)

    Its slope `u⁴ (35 − 84 u + 70 u² − 20 u³)` goes from 0 to 1 with three derivatives 0
    at either end: steps cross the ends of the blend, and each derivative that is
    continuous there makes those of a run more exact. At a sharp corner, where runs
    often start, the slope is the one above it: half of each (as that of a maximum)
    would be the slope of neither side, and an integrator would shorten its first step
    until the effect vanishes.
    """
    return jnp.where(x >= 0, x, 0.0) if w is None else _blended(x, w)


def _share(x: Array, w: Array) -> tuple[Array, Array]:
    """Of the blend: `u` from 0 to 1 (a step where there is none), and `1/(2 w)`."""
    # (one division, however many the linings)
    across = 1 / jnp.where(w > 0, 2 * w, 1.0)
    return jnp.where(
        w > 0, jnp.clip((x + w) * across, 0.0, 1.0), jnp.where(x >= 0, 1.0, 0.0)
    ), across


def _value(u: Array) -> Array:
    return ((u * u) * (u * u) * u) * (14 + u * (-28 + u * (20 - 5 * u)))


# Derivatives by hand: those that JAX finds of powers and selections would be a tenth of
# a program, and more of the steps in which rates of friction are differentiated once
# more; and they round otherwise.


@jax.custom_jvp
def _blended(x: Array, w: Array) -> Array:
    return jnp.where(x >= w, x, w * _value(_share(x, w)[0]))


@functools.partial(_blended.defjvp, symbolic_zeros=True)
def _(at: tuple[Array, Array], by: tuple[Any, Any]) -> tuple[Array, Array]:
    (x, w) = at
    (dx, dw) = by
    slope = _slope(x, w)
    parts = [] if isinstance(dx, SymbolicZero) else [slope * dx]
    if not isinstance(dw, SymbolicZero):
        u, _ = _share(x, w)
        parts += [(_value(u) - (2 * u - 1) * slope) * dw]
    return _blended(x, w), functools.reduce(jnp.add, parts)


@jax.custom_jvp
def _slope(x: Array, w: Array) -> Array:
    u, _ = _share(x, w)
    return ((u * u) * (u * u)) * (35 + u * (-84 + u * (70 - 20 * u)))


@functools.partial(_slope.defjvp, symbolic_zeros=True)
def _(at: tuple[Array, Array], by: tuple[Any, Any]) -> tuple[Array, Array]:
    (x, w) = at
    (dx, dw) = by
    u, across = _share(x, w)
    inside = u * (1 - u)
    bend = (140 * across) * (inside * inside * inside)
    parts = [] if isinstance(dx, SymbolicZero) else [bend * dx]
    parts += [] if isinstance(dw, SymbolicZero) else [(1 - 2 * u) * bend * dw]
    return _slope(x, w), functools.reduce(jnp.add, parts)
