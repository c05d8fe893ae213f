"""Contacts between surfaces: their thermal resistance, also by the pressure on them, and whether they open."""

import abc

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float

from .._base._quantity import Over, Part, Scalar, part, quantity
from ..hybrid._arrays import Array
from ._network import AbstractLink, Surroundings, Temperatures

#: relative pressure below which the conductance of metals is linear in it
_SLIGHT = 1e-6


class AbstractContactLaw(Part):
    """A contact conductance `h_c(p)` in W/(m²·K)."""

    @abc.abstractmethod
    def conductance(self, p: Float[Array, "..."]) -> Float[Array, "..."]:
        """At the pressure `p` (Pa)."""


class MetalContact(AbstractContactLaw):
    """Metal on metal, rough surfaces that yield: `h_c = 1.25 k_s (m/σ) (p/H)^0.95`.

    With `k_s = 2 k_1 k_2/(k_1 + k_2)`, `m = √(m_1² + m_2²)`, `σ = √(σ_1² + σ_2²)`; each of the three as two numbers, of
    the two surfaces, or one for both. Below `p/H = 1e-6` linear in the pressure. Linings of polymers contact
    elastically: give these a number.

    - `conductivity` `k` (W/(m·K)), `slope` `m` of the asperities, `roughness` `σ` (m)
    - `hardness` `H` (Pa) of the softer

    Reference: M. M. Yovanovich, *IEEE Trans. Compon. Packag. Technol.* 28 (2005) 182.
    """

    conductivity: Scalar = quantity("W/(m*K)", "conductivities of both metals", positive=True, many=Over.ROWS)
    slope: Scalar = quantity("1", "mean slopes of the asperities", positive=True, many=Over.ROWS)
    roughness: Scalar = quantity("m", "roughnesses of both surfaces", positive=True, many=Over.ROWS)
    hardness: Scalar = quantity("Pa", "hardness of the softer metal", positive=True)

    def conductance(self, p: Float[Array, "..."]) -> Float[Array, "..."]:
        k, m, sigma = (jnp.broadcast_to(x, (2,)) for x in (self.conductivity, self.slope, self.roughness))
        x = p / self.hardness
        slopes = jnp.sqrt(jnp.sum(m**2) / jnp.sum(sigma**2))
        return 1.25 * 2 / jnp.sum(1 / k) * slopes * x * (x**2 + _SLIGHT**2) ** -0.025


class ThermalContact(AbstractLink):
    """Two surfaces in contact: `g = h_c A`, `h_c = 1/R_c`.

    - `area` (m²); `resistance` `R_c` (m²·K/W), `None` for perfect contact (one of the two must then be a wall's face)
    - `opens`: nothing flows while the surfaces are apart: rim and linings of a standard brake, linings and band of a
      staged one, while the band is open; rim and a lining of a staged one while it has lifted off. What crosses the
      gap is a link of its own: `Convection` or `Radiation` from one to the other, with `covered=1.0`
    - `law` of `h_c` by the pressure of the linings, in place of `resistance`; of one node for all linings their mean

    Example:
        >>> sb.thermal.ThermalContact("rim", "lining", 1.2, resistance=2e-3)
        ThermalContact(a='rim', b='lining', area=1.2 m², resistance=0.002 m²·K/W)
    """

    a: str = eqx.field(static=True)
    b: str = eqx.field(static=True)
    area: Scalar = quantity("m^2", "area in contact", positive=True)
    resistance: Scalar | None = quantity("m^2*K/W", "contact resistance", positive=True, default=None)
    opens: bool = eqx.field(static=True, default=False)
    law: AbstractContactLaw | None = part(AbstractContactLaw, default=None)

    def conductance(self, T_a: Temperatures, T_b: Temperatures, around: Surroundings) -> Temperatures | None:
        if self.law is None:
            return None if self.resistance is None else self.area / jnp.asarray(self.resistance)
        h = self.law.conductance(jnp.asarray(around.pressure))
        alone = max(T_a.size, T_b.size) == 1
        return self.area * (jnp.mean(h) if alone else h)
