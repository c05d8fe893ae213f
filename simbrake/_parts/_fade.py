"""Friction that depends on temperature and pressure: a law times factors."""

import abc
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._base._faults import Fault
from .._base._quantity import Scalar, quantity
from .._hybrid._arrays import Array
from ._friction import AbstractFriction, AnyContact, Contact


class AbstractFactor(eqx.Module):
    """A factor of a coefficient of friction, 1 where the base law was measured. Never negative."""

    @abc.abstractmethod
    def factor(self, contact: Contact) -> Float[Array, "..."]:
        """The factor at surface temperature `T` (K) and pressure `p` (Pa)."""

    @abc.abstractmethod
    def faults(self, path: str) -> list[Fault]:
        """What cannot be right in this factor, beyond the ranges of single numbers."""

    def temperature_range(self) -> tuple[Any, Any] | None:
        """Temperatures (K) between which it holds, `None` if there are no bounds."""
        return None


def _rounded(x: Array, w: Array | None) -> Array:
    """`max(x, 0)` with its corner rounded over `±w`, four times continuously differentiable.

        w u⁵ (14 − 28 u + 20 u² − 5 u³),   u = (x + w)/(2 w)

    Its slope `u⁴ (35 − 84 u + 70 u² − 20 u³)` goes from 0 to 1 with three derivatives 0 at either end: steps cross the
    ends of the blend, and each derivative that is continuous there makes those of a run more exact.
    At a sharp corner, where runs like to start, the slope is the one above it: half of each (as that of a maximum)
    would be the slope of no side, and an integrator would shorten its first step until that no longer matters.
    """
    if w is None:
        return jnp.where(x >= 0, x, 0.0)
    u = jnp.clip((x + w) * (1 / jnp.where(w > 0, 2 * w, 1.0)), 0.0, 1.0)  # (one division, however many the linings)
    blend = w * u**5 * (14 + u * (-28 + u * (20 - 5 * u)))
    return jnp.where(x >= w, x, jnp.where(x > -w, blend, 0.0))


class LinearFade(AbstractFactor):
    """Fade above a permissible temperature: `max(φ_min, 1 − s (T − T_p)₊)`.

    - `slope` `s` (1/K), `above` `T_p` (K), `floor` `φ_min`
    - `blend` `w` (K): half-width over which both corners are rounded; `None` or 0: corners, which cost steps at tight
      tolerances where many linings pass them one after the other, and derivatives half of their digits

    Within `±w` of a corner `x₊` is `w u⁵ (14 − 28 u + 20 u² − 5 u³)`, `u = (x + w)/(2 w)`, with four continuous
    derivatives; at the floor the same with `s w` for `w`.
    """

    slope: Scalar = quantity("1/K", "loss of friction per kelvin", low=0.0, many=True)
    above: Scalar = quantity("K", "temperature at which fade begins", low=0.0, many=True)
    floor: Scalar = quantity("1", "least factor", low=0.0, high=1.0, many=True, default=0.0)
    blend: Scalar | None = quantity(
        "K", "half-width of the rounded corner", low=0.0, difference=True, many=True, default=None
    )

    def factor(self, contact):
        w, s = None if self.blend is None else jnp.asarray(self.blend), self.slope
        lost = s * _rounded(contact.T - self.above, w)
        return self.floor + _rounded(1 - lost - self.floor, None if w is None else s * w)

    def faults(self, path):
        return []


class TabulatedFade(AbstractFactor):
    """A measured factor over the temperature, interpolated by a monotone cubic (Fritsch–Carlson).

    - `temperature` (k,) in K, increasing; `values` (k,)

    The table is not extrapolated: a run that leaves it ends with the code `outside_table`.
    """

    temperature: Scalar = quantity("K", "temperatures of the table", low=0.0, many=True)
    values: Scalar = quantity("1", "factors of the table", low=0.0, high=10.0, many=True)

    def factor(self, contact):
        import interpax  # half a second that only tables pay

        T, values = jnp.asarray(self.temperature), jnp.asarray(self.values)
        with jax.numpy_dtype_promotion("standard"):  # the library mixes integers and floats
            here = jnp.clip(contact.T, T[0], T[-1])
            return interpax.interp1d(here.reshape(-1), T, values, method="monotonic").reshape(jnp.shape(contact.T))

    def faults(self, path):
        T, values = np.asarray(self.temperature), np.asarray(self.values)
        if T.ndim != 1 or T.shape != values.shape or T.size < 2:
            return [Fault(path, "the table needs temperatures and factors of one length, at least 2")]
        return [] if np.all(np.diff(T) > 0) else [Fault(f"{path}.temperature", "the temperatures must increase")]

    def temperature_range(self):
        T = jnp.asarray(self.temperature)
        return T[0], T[-1]


class PressureFactor(AbstractFactor):
    """Friction that falls (or rises) with pressure: `(1 + p/p_r)^{−m}`.

    - `reference` `p_r` (Pa), `exponent` `m`
    """

    reference: Scalar = quantity("Pa", "reference pressure", positive=True, many=True)
    exponent: Scalar = quantity("1", "exponent of the pressure", low=-1.0, high=1.0, many=True)

    def factor(self, contact):
        return (1 + contact.p / self.reference) ** (-self.exponent)

    def faults(self, path):
        return []


class ProductFriction(AbstractFriction):
    """`f(T, v, p) = f_base(v) · ∏ factors(T, p)`, sliding and sticking alike. States are those of the base law."""

    base: AbstractFriction
    factors: tuple[AbstractFactor, ...]

    def _product(self, contact: AnyContact) -> Array:
        product = None
        for one in self.factors:
            product = one.factor(contact) if product is None else product * one.factor(contact)
        return jnp.ones(()) if product is None else product

    def governing(self, contact, static):
        return self.base.governing(contact, static) * self._product(contact)

    def kinetic(self, contact):
        return self.base.kinetic(contact) * self._product(contact)

    def static(self, contact):
        return self.base.static(contact) * self._product(contact)

    def start(self, n):
        return self.base.start(n)

    def rates(self, contact):
        return self.base.rates(contact)

    def sizes(self):
        return self.base.sizes()

    def faults(self, path):
        found = self.base.faults(f"{path}.base")
        for i, one in enumerate(self.factors):
            found += one.faults(f"{path}.factors[{i}]")
        return found

    def temperature_range(self):
        bounds = [r for r in (part.temperature_range() for part in (self.base, *self.factors)) if r is not None]
        if not bounds:
            return None
        low, high = bounds[0]
        for one in bounds[1:]:
            low, high = jnp.maximum(low, one[0]), jnp.minimum(high, one[1])
        return low, high
