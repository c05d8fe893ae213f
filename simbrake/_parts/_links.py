"""Ways for heat between two places of a thermal network: conduction, contact, convection, radiation, given flows."""

import abc
import functools
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from .._base._dependence import Skeleton, read_by, skeleton
from .._base._quantity import Scalar, quantity
from .._hybrid._arrays import Array
from ._duty import AbstractProfile
from ._material import ROOM

STEFAN_BOLTZMANN = 5.670374419e-8  # W/(m²·K⁴), CODATA 2018


class Surroundings(NamedTuple):
    """What links may depend on besides temperatures: track speed (m/s), and 1 while the band is closed, else 0."""

    speed: Any = 0.0
    closed: Any = 0.0


class AbstractLink(eqx.Module):
    """A way for heat between the places `a` and `b`: `flow = g(T_a, T_b) (T_a − T_b)`."""

    a: eqx.AbstractVar[str]
    b: eqx.AbstractVar[str]

    @abc.abstractmethod
    def conductance(self, T_a: Array, T_b: Array, around: Surroundings) -> Array | None:
        """`g` in W/K; `None` for perfect contact."""


class Reads(NamedTuple):
    """What the conductance of a link depends on, beside its own numbers."""

    temperatures: bool
    surroundings: bool


def reads(link: AbstractLink, n_a: int, n_b: int) -> Reads:
    """What `g` of a link between places of `n_a` and `n_b` nodes depends on.

    Found from the lowered program, once for each structure of a link; in doubt it depends on them (`read_by`).
    """
    return _reads(skeleton(link), n_a, n_b)


def is_nonlinear(link: AbstractLink, n_a: int, n_b: int) -> bool:
    """Whether `g` of a link between places of `n_a` and `n_b` nodes depends on their temperatures."""
    return reads(link, n_a, n_b).temperatures


@functools.lru_cache(maxsize=1024)
def _reads(link: Skeleton, n_a: int, n_b: int) -> Reads:
    one = jax.ShapeDtypeStruct((), np.float64)
    ends = [jax.ShapeDtypeStruct((n,), np.float64) for n in (n_a, n_b)]
    _, *temperatures, around = read_by(
        lambda link, T_a, T_b, around: link.conductance(T_a, T_b, around),
        link.stand_in(),
        *ends,
        Surroundings(one, one),
    )
    return Reads(any(temperatures), any(around))


class Conductance(AbstractLink):
    """A given conductance (W/K): a bolt, a spoke, a flange, or the reciprocal of one of V's resistances."""

    a: str = eqx.field(static=True)
    b: str = eqx.field(static=True)
    value: Scalar = quantity("W/K", "thermal conductance", low=0.0)

    def conductance(self, T_a, T_b, around):
        return jnp.asarray(self.value)


class ThermalContact(AbstractLink):
    """Two surfaces that touch: `g = A/R_c`.

    - `area` (m²); `resistance` `R_c` (m²·K/W), `None` for perfect contact (one of the two must then be a wall's face)
    """

    a: str = eqx.field(static=True)
    b: str = eqx.field(static=True)
    area: Scalar = quantity("m^2", "area in contact", positive=True)
    resistance: Scalar | None = quantity("m^2*K/W", "contact resistance", positive=True, default=None)

    def conductance(self, T_a, T_b, around):
        return None if self.resistance is None else self.area / jnp.asarray(self.resistance)


class AbstractCoefficient(eqx.Module):
    """A heat transfer coefficient `h(v, T, T_a)` in W/(m²·K)."""

    @abc.abstractmethod
    def value(self, v: Array, T: Array, T_a: Array) -> Array:
        """At the track speed `v` (m/s), surface and air temperature (K)."""


class SpeedCoefficient(AbstractCoefficient):
    """Convection that grows with the speed: `h = h_0 [1 + (v/v_0)²]^{m/2}`, `h_0` at rest, `∝ v^m` when fast.

    - `at_rest` `h_0`; `speed` `v_0` (m/s) where forced convection takes over; `exponent` `m` (0.8 for turbulent flow)

    Blends the two regimes as S. W. Churchill & R. Usagi, *AIChE J.* 18 (1972) 1121 do, and is smooth at rest.
    """

    at_rest: Scalar = quantity("W/(m^2*K)", "heat transfer coefficient at rest", positive=True)
    speed: Scalar = quantity("m/s", "speed at which forced convection takes over", positive=True)
    exponent: Scalar = quantity("1", "exponent of the speed", low=0.0, high=2.0, default=0.8)

    def value(self, v, T, T_a):
        return self.at_rest * (1 + (v / self.speed) ** 2) ** (0.5 * self.exponent)


class TemperatureCoefficient(AbstractCoefficient):
    """Free convection: `h = h_1 |T − T_a|^n`, `n` = 1/4 laminar, 1/3 turbulent, smooth below a difference of 1 K.

    - `at_one_kelvin` `h_1`

    Reference: W. H. McAdams, *Heat Transmission* (1954), ch. 7.
    """

    at_one_kelvin: Scalar = quantity("W/(m^2*K)", "coefficient at a difference of 1 K", positive=True)
    exponent: Scalar = quantity("1", "exponent of the difference", low=0.0, high=1.0, default=0.25)

    def value(self, v, T, T_a):
        return self.at_one_kelvin * ((T - T_a) ** 2 + 1.0) ** (0.5 * self.exponent)


def _uncovered(g: Any, covered: Any, around: Surroundings) -> Any:
    """What of a conductance is left while linings cover a share of the area (`None`: never any)."""
    return g if covered is None else g * (1 - covered * around.closed)


class Convection(AbstractLink):
    """Convection from a surface: `g = h A (1 − κ)`, `κ` only while the band is closed.

    - `area` (m²); `coefficient` `h` (W/(m²·K)): a number or a law
    - `covered` `κ`: share of the area that the linings cover (the overlap coefficient of a track, averaged over one
      revolution: `q_net = κ a q − (1 − κ) h (T_s − T_a)`, S-16…S-21); `None`: 0, and no cost
    """

    a: str = eqx.field(static=True)
    area: Scalar = quantity("m^2", "area of the surface", positive=True)
    coefficient: AbstractCoefficient | Any = quantity("W/(m^2*K)", "heat transfer coefficient", low=0.0)
    b: str = eqx.field(static=True, default="air")
    covered: Scalar | None = quantity(
        "1", "share covered by the linings while the band is closed", low=0.0, high=1.0, default=None
    )

    def conductance(self, T_a, T_b, around):
        h = self.coefficient
        if isinstance(h, AbstractCoefficient):
            h = h.value(jnp.asarray(around.speed), T_a, T_b)
        return _uncovered(h * jnp.asarray(self.area), self.covered, around)


class Radiation(AbstractLink):
    """Radiation from a grey surface: flow `ε σ A (T⁴ − T_a⁴)` (S-37, S-38).

    - `area` (m²), `emissivity` `ε`; `covered` as in `Convection`
    """

    a: str = eqx.field(static=True)
    area: Scalar = quantity("m^2", "area of the surface", positive=True)
    emissivity: Scalar = quantity("1", "emissivity", low=0.0, high=1.0)
    b: str = eqx.field(static=True, default="air")
    covered: Scalar | None = quantity(
        "1", "share covered by the linings while the band is closed", low=0.0, high=1.0, default=None
    )

    def conductance(self, T_a, T_b, around):
        h = self.emissivity * STEFAN_BOLTZMANN * (T_a**2 + T_b**2) * (T_a + T_b)
        return _uncovered(h * self.area, self.covered, around)


def radiation_governs_above(coefficient: float, emissivity: float, ambient: float = ROOM) -> float:
    """Surface temperature (K) above which radiation carries more than convection: `ε σ (T² + T_a²)(T + T_a) = h`.

    Both act at all temperatures; convection governs below and radiation above (S, of the permissible lining
    temperature). Raises `ValueError` where radiation carries more even without a difference of temperature.
    """
    from scipy.optimize import brentq

    def surplus(T: float) -> float:
        return emissivity * STEFAN_BOLTZMANN * (T**2 + ambient**2) * (T + ambient) - coefficient

    if surplus(ambient) > 0:
        raise ValueError("radiation governs at every temperature: the convection is too weak")
    return float(brentq(surplus, ambient, 1e5))  # pyright: ignore


class Source(eqx.Module):
    """A given heat flow into a place (W): a number or a profile over time."""

    a: str = eqx.field(static=True)
    power: AbstractProfile | Any = quantity("W", "heat flow into the place")
