"""Factors of a coefficient of friction, by temperature, pressure, history and time, and the contact that they see."""

import abc
import functools
import operator
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jax.custom_derivatives import SymbolicZero
from jaxtyping import Float

from ._base._corners import clipped
from ._base._faults import Fault
from ._base._part import Part, part, quantity
from ._base._quantity import Over, Scalar
from .hybrid._arrays import Array
from .profiles import AbstractProfile

#: molar gas constant (J/(mol·K)), CODATA 2018
GAS_CONSTANT = 8.31446261815324


class Contact(NamedTuple):
    """Inputs of a friction law: slip speed `v` (m/s), surface temperature `T` (K) and pressure `p` (Pa).

    Each broadcasts over the linings; `None` where the scene does not model it. A law with states has them in `memory`;
    their rates also see `q = f p v` (W/m²), the friction power per area of its face.

    Example:
        >>> sb.ConstantFriction(0.35).kinetic(sb.friction.Contact(np.float64(2.0))).item()
        0.35
    """

    v: Any
    T: Any = None
    p: Any = None

    @property
    def memory(self) -> Any:
        """States of the law, as `start` gives them, (n,) each; `None` without."""
        return None

    @property
    def q(self) -> Any:
        """Friction power per area of the face, `f p v` (W/m²), for rates of states only; `None` without areas.

        Under a band the friction heat over the area is `1/cos(β/2)` times that: friction acts on the band circle.
        """
        return None

    @property
    def factor(self) -> Any:
        """Factor of friction by given changes over time, (n,); `None` without any, or where no time is known."""
        return None


class ContactWithMemory(NamedTuple):
    """A `Contact` of a law with states, or one that changes over time."""

    v: Any
    T: Any
    p: Any
    memory: Any
    q: Any = None
    factor: Any = None


if TYPE_CHECKING:
    AnyContact: TypeAlias = Contact
else:
    # inputs of laws in a running program; for authors of laws both are a `Contact`
    AnyContact = Contact | ContactWithMemory


#: temperatures (K) between which a law or factor holds
Bounds: TypeAlias = tuple[Float[Array, ""], Float[Array, ""]]


def _alike(a: Array, b: Array) -> Array:
    """Whether two chords have one sense.

    One of 0 counts as rising at both of its ends: these are then on the same side of the corner. Two of 0 differ, as
    the value between them moves them apart, whichever way.
    """
    return ((a >= 0) == (b >= 0)) & ((a != 0) | (b != 0))


def _end_slope(h: tuple[Array, Array], chord: tuple[Array, Array]) -> Array:
    """Slope at an end by the parabola through three points, the nearer interval and chord first.

    It is 0 where the parabola would leave the sense of the first chord. A second chord of the other sense is left out:
    the slope then depends on the values like a straight line wherever both chords are 0, as on a plateau.
    """
    alike = _alike(*chord)
    slope = ((2 * h[0] + h[1]) * chord[0] - h[0] * jnp.where(alike, chord[1], 0.0)) / (h[0] + h[1])
    return jnp.where(alike & (slope * chord[0] <= 0), 0.0, slope)


def _node_slopes(h: Array, chord: Array) -> Array:
    """Slopes (k,) of a monotone cubic at its points, for the intervals `h` (k − 1,) and the slopes of their chords.

    Inside the weighted harmonic mean of both chords, 0 where they differ in sense or one of them is 0.
    """
    if h.shape[0] == 1:
        return jnp.concatenate([chord, chord])
    before, after = 2 * h[1:] + h[:-1], h[1:] + 2 * h[:-1]
    alike = _alike(chord[:-1], chord[1:])
    whole = jnp.where(alike, before * chord[1:] + after * chord[:-1], 1.0)
    inside = jnp.where(alike, (before + after) * (chord[:-1] * chord[1:]) / whole, 0.0)
    first, last = (_end_slope((h[a], h[b]), (chord[a], chord[b])) for a, b in ((0, 1), (-1, -2)))
    return jnp.concatenate([first[None], inside, last[None]])


def interpolated(x: Array, at: Array, values: Array) -> Array:
    """A monotone cubic through `values` (k,) at the places `at` (k,), for `x` (n,) between the first and the last.

    Its derivatives by values and places are those of one side at ties, as on a plateau of equal values.

    Reference: F. N. Fritsch, J. Butland, *SIAM J. Sci. Stat. Comput.* 5 (1984) 300; ends: C. Moler, *Numerical
    Computing with MATLAB* (2004), section 3.6.
    """
    h = jnp.diff(at)
    chord = jnp.diff(values) / h
    d = _node_slopes(h, chord)
    square, cube = (3 * chord - 2 * d[:-1] - d[1:]) / h, (d[:-1] + d[1:] - 2 * chord) / (h * h)
    pieces = jnp.stack([at[:-1], values[:-1], d[:-1], square, cube], axis=1)
    # a product with a mask in place of indexed loads, which are slow in a loop and backwards
    passed = jnp.sum(x[:, None] >= at[None, 1:-1], axis=1, dtype=jnp.int32)
    here = passed[:, None] == jnp.arange(h.shape[0], dtype=jnp.int32)
    start, value, slope, square, cube = (here.astype(jnp.float64) @ pieces).T
    s = x - start
    return value + s * (slope + s * (square + s * cube))


def is_table(at: Scalar, values: Scalar) -> bool:
    return np.ndim(at) == 1 and np.shape(at) == np.shape(values) and np.size(at) >= 2


class AbstractFactor(Part):
    """A factor of a coefficient of friction, 1 where the base law was measured. Never negative."""

    @abc.abstractmethod
    def factor(self, contact: AnyContact) -> Float[Array, "..."]:
        """The factor at surface temperature `T` (K) and pressure `p` (Pa)."""

    def faults(self, path: str) -> list[Fault]:
        """Errors of this factor beyond the ranges of single numbers."""
        return []

    def temperature_range(self) -> Bounds | None:
        """Temperatures (K) between which it holds, `None` if there are no bounds."""
        return None


def _rounded(x: Array, w: Array | None) -> Array:
    """`max(x, 0)` with its corner rounded over `±w`, four times continuously differentiable.

        w u⁵ (14 − 28 u + 20 u² − 5 u³),   u = (x + w)/(2 w)

    Its slope `u⁴ (35 − 84 u + 70 u² − 20 u³)` goes from 0 to 1 with three derivatives 0 at either end: steps cross the
    ends of the blend, and each derivative that is continuous there makes those of a run more exact.
    At a sharp corner, where runs often start, the slope is the one above it: half of each (as that of a maximum)
    would be the slope of neither side, and an integrator would shorten its first step until the effect vanishes.
    """
    return jnp.where(x >= 0, x, 0.0) if w is None else _blended(x, w)


def _shares(x: Array, w: Array) -> tuple[Array, Array, Array]:
    """Of the blend: `u` from 0 to 1 (a step where there is none), value over `w`, and slope."""
    across = 1 / jnp.where(w > 0, 2 * w, 1.0)  # (one division, however many the linings)
    u = jnp.where(w > 0, jnp.clip((x + w) * across, 0.0, 1.0), jnp.where(x >= 0, 1.0, 0.0))
    u4 = (u * u) * (u * u)
    return u, (u4 * u) * (14 + u * (-28 + u * (20 - 5 * u))), u4 * (35 + u * (-84 + u * (70 - 20 * u)))


@jax.custom_jvp
def _blended(x: Array, w: Array) -> Array:
    return jnp.where(x >= w, x, w * _shares(x, w)[1])


@functools.partial(_blended.defjvp, symbolic_zeros=True)
def _(at: tuple[Array, Array], by: tuple[Any, Any]) -> tuple[Array, Array]:
    # (by hand, as derivatives of powers and selections would be a tenth of a program)
    (x, w), (dx, dw) = at, by
    u, value, slope = _shares(x, w)
    parts = [] if isinstance(dx, SymbolicZero) else [slope * dx]
    parts += [] if isinstance(dw, SymbolicZero) else [(value - (2 * u - 1) * slope) * dw]
    return jnp.where(x >= w, x, w * value), functools.reduce(jnp.add, parts)


class LinearFade(AbstractFactor):
    """Fade above a permissible temperature: `max(φ_min, 1 − s (T − T_p)₊)`.

    - `slope` `s` (1/K), `above` `T_p` (K), `floor` `φ_min`
    - `blend` `w` (K): half-width over which both corners are rounded; `None` or 0: corners, which cost steps at tight
      tolerances where many linings pass them one after the other, and derivatives half of their digits

    Within `±w` of a corner `x₊` is `w u⁵ (14 − 28 u + 20 u² − 5 u³)`, `u = (x + w)/(2 w)`, with four continuous
    derivatives; at the floor the same with `s w` for `w`.

    Example:
        >>> fade = sb.LinearFade(slope=1.5e-3, above="120 degC", floor=0.6)
        >>> sb.friction.ProductFriction(0.35, (fade,)).base
        ConstantFriction(coefficient=0.35, static_ratio=1)
    """

    slope: Scalar = quantity("1/K", "loss of friction per kelvin", low=0.0, many=True, typical=1e-3)
    above: Scalar = quantity("K", "temperature at which fade begins", low=0.0, many=True)
    floor: Scalar = quantity("1", "minimum factor", low=0.0, high=1.0, many=True, default=0.0)
    blend: Scalar | None = quantity(
        "K", "half-width of the rounded corner", low=0.0, difference=True, many=True, default=None
    )

    def factor(self, contact: AnyContact) -> Float[Array, "..."]:
        w, s = None if self.blend is None else jnp.asarray(self.blend), self.slope
        lost = s * _rounded(contact.T - self.above, w)
        return self.floor + _rounded(1 - lost - self.floor, None if w is None else s * w)


class TabulatedFade(AbstractFactor):
    """A measured factor over the temperature, interpolated by a monotone cubic (Fritsch–Carlson).

    - `temperature` (k,) in K, increasing; `values` (k,)

    The table is not extrapolated: a run that leaves it ends with the code `outside_table`.

    Example:
        >>> sb.friction.TabulatedFade([293.15, 573.15], [1.0, 0.8])
        TabulatedFade(temperature=[20, 300] °C, values=[1, 0.8])
    """

    temperature: Scalar = quantity("K", "temperatures of the table", low=0.0, many=Over.ROWS)
    values: Scalar = quantity("1", "factors of the table", low=0.0, high=10.0, many=Over.ROWS)

    def factor(self, contact: AnyContact) -> Float[Array, "..."]:
        T, values = jnp.asarray(self.temperature), jnp.asarray(self.values)
        here = clipped(contact.T, T[0], T[-1])
        return interpolated(here.reshape(-1), T, values).reshape(here.shape)

    def faults(self, path: str) -> list[Fault]:
        if not is_table(self.temperature, self.values):
            return [Fault(path, "the table needs temperatures and factors of one length, at least 2")]
        rises = np.all(np.diff(np.asarray(self.temperature, float)) > 0)
        return [] if rises else [Fault(f"{path}.temperature", "the temperatures must increase")]

    def temperature_range(self) -> Bounds | None:
        T = jnp.asarray(self.temperature)
        return T[0], T[-1]


class PressureFactor(AbstractFactor):
    """Friction that falls (or rises) with pressure: `(1 + p/p_r)^{−m}`.

    - `reference` `p_r` (Pa), `exponent` `m`

    Example:
        >>> sb.friction.PressureFactor("1 MPa", 0.1)
        PressureFactor(reference=1 MPa, exponent=0.1)
    """

    reference: Scalar = quantity("Pa", "reference pressure", positive=True, many=True)
    exponent: Scalar = quantity("1", "exponent of the pressure", low=-1.0, high=1.0, many=True)

    def factor(self, contact: AnyContact) -> Float[Array, "..."]:
        return (1 + contact.p / self.reference) ** (-self.exponent)


class MemoryProcess(Part):
    """One way in which a lining's friction changes with its history: `ċ = (c_e φ(T) − c) (k e^{−E/(R_g T)} + q/w_0)`.

    - `end` `c_e`: factor of friction to which it tends; `fade` `φ(T)`: how that depends on temperature, 1 without
    - `rate` `k` (1/s) and `activation` energy `E` (J/mol): how fast with time; `k` at all temperatures without `E`
    - `work` `w_0` (J/m²): friction work per area of the face, `∫ f p v dt`, in which the distance to `c_e φ` falls to
      1/e

    Recovery with the time constant `τ(T) = e^{E/(R_g T)}/k`: `MemoryProcess(1.0, LinearFade(…), rate=1/τ)`. Burn-off of
    binders: `MemoryProcess(0.0, rate=A, activation=E)`. Running-in: `MemoryProcess(c_1, work=w_0)`.

    Example:
        >>> sb.friction.MemoryProcess(0.9, work="2 MJ/m^2")
        MemoryProcess(end=0.9, work=2000000 J/m²)
    """

    end: Scalar = quantity("1", "factor of friction to which it tends", low=0.0, high=10.0, many=True)
    fade: AbstractFactor | None = None
    rate: Scalar | None = quantity("1/s", "rate", low=0.0, many=True, default=None)
    activation: Scalar | None = quantity("J/mol", "activation energy", low=0.0, many=True, typical=2e4, default=None)
    work: Scalar | None = quantity(
        "J/m^2", "friction work per area of running-in", positive=True, many=True, default=None
    )

    def change(self, c: Array, contact: AnyContact) -> Array:
        """Rate (1/s) of the factor `c`."""
        end = jnp.asarray(self.end) * (1.0 if self.fade is None else self.fade.factor(contact))
        paces = [] if self.work is None else [contact.q / self.work]
        if self.rate is not None:
            thermal = 1.0 if self.activation is None else jnp.exp(-self.activation / (GAS_CONSTANT * contact.T))
            paces.append(self.rate * thermal)
        return (end - c) * functools.reduce(operator.add, paces)

    def faults(self, path: str) -> list[Fault]:
        """Error of a process without a pace, or with an activation energy and no rate."""
        if self.rate is None and (self.work is None or self.activation is not None):
            return [Fault(path, "has no pace", "give rate (1/s), work (J/m²), or both; activation belongs to rate")]
        return []


class FrictionChange(Part):
    """A factor of the friction of some linings over time: oil or water on them, a lining lost (0).

    - `factor`: a number ≥ 0 or a profile, 1 of sound linings, in the time of the run (also of a duty in phases)
    - `linings`: their numbers from the slack end (from 1), one or a list; `None`: all

    Example:
        >>> oil = sb.friction.FrictionChange(0.4, [3, 4])
        >>> oil
        FrictionChange(factor=Constant(level=0.4), linings=[3, 4])
        >>> np.asarray(oil.of_each(oil.factor.level, 6))
        array([1. , 1. , 0.4, 0.4, 1. , 1. ])
    """

    factor: AbstractProfile = part(AbstractProfile, "1")
    linings: Scalar | None = quantity(
        "1", "numbers of the linings, from 1 at the slack end", low=1.0, many=Over.ROWS, default=None
    )

    def of_each(self, value: Array, n: int) -> Float[Array, " n"]:
        """The factor of each of `n` linings, where that of the chosen ones is `value`."""
        if self.linings is None:
            return jnp.broadcast_to(value, (n,))
        chosen = jnp.arange(1.0, n + 1.0) == jnp.atleast_1d(jnp.asarray(self.linings))[:, None]
        return jnp.where(jnp.any(chosen, axis=0), value, 1.0)

    def turned(self, n: int) -> "FrictionChange":
        """The same of a band of `n` linings that is turned end for end."""
        return self if self.linings is None else FrictionChange(self.factor, n + 1 - jnp.asarray(self.linings))
