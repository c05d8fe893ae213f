"""Materials: thermal properties with their temperature dependence, and a small library with sources."""

from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._base._quantity import Part, Scalar, quantity
from ..hybrid._arrays import Array

ROOM = 293.15  # K, reference of properties where nothing else is said (20 °C)


class Material(Part):
    """Thermal properties, linear in the temperature: `λ(T) = λ [1 + b_λ (T − T_r)]`, `c(T) = c [1 + b_c (T − T_r)]`.

    - `conductivity` `λ` (W/(m·K)), `density` `ρ` (kg/m³), `specific_heat` `c` (J/(kg·K)) at `reference` `T_r` (K)
    - `conductivity_slope` `b_λ`, `specific_heat_slope` `b_c` (1/K); `None`: no dependence, and no cost
    """

    conductivity: Scalar = quantity("W/(m*K)", "thermal conductivity", positive=True)
    density: Scalar = quantity("kg/m^3", "density", positive=True)
    specific_heat: Scalar = quantity("J/(kg*K)", "specific heat", positive=True)
    conductivity_slope: Scalar | None = quantity("1/K", "relative change of conductivity per kelvin", default=None)
    specific_heat_slope: Scalar | None = quantity("1/K", "relative change of specific heat per kelvin", default=None)
    reference: Scalar = quantity("K", "temperature at which the properties hold", positive=True, default=ROOM)

    def conductivity_at(self, T: Float[Array, "..."]) -> Float[Array, "..."]:
        """`λ(T)` in W/(m·K)."""
        if self.conductivity_slope is None:
            return jnp.broadcast_to(jnp.asarray(self.conductivity), jnp.shape(T))
        return self.conductivity * (1 + self.conductivity_slope * (T - self.reference))

    @property
    def diffusivity(self) -> Any:
        """`a = λ/(ρ c)` in m²/s."""
        return self.conductivity / (self.density * self.specific_heat)

    @property
    def effusivity(self) -> Any:
        """`e = √(λ ρ c)` in W·√s/(m²·K)."""
        return (self.conductivity * self.density * self.specific_heat) ** 0.5


class Entry(NamedTuple):
    """One number of the library: value (SI), admissible range in use, where it is from, and whether it is assumed."""

    value: float
    low: float
    high: float
    source: str
    assumed: bool = False


_TEXTBOOK = "textbook range, VDI Heat Atlas, part D"
_V1 = "V (Volchenko et al.), table 1"
_V2 = "V (Volchenko et al.), table 2"
_S = "S (Skrypnyk), table 1"


def _diffusivity(value: float, conductivity: float, density: float, source: str) -> Entry:
    """Specific heat that a published diffusivity implies."""
    c = conductivity / (density * value)
    return Entry(round(c, 1), 0.9 * c, 1.1 * c, f"from a = {value:g} m²/s ({source}), λ and ρ of this entry")


#: material → property → number with its source
LIBRARY: dict[str, dict[str, Entry]] = {
    "steel_20L": {
        "conductivity": Entry(47.8, 40.0, 54.0, _V1 + " (48.85 in table 2)"),
        "density": Entry(7850.0, 7800.0, 7870.0, _TEXTBOOK, True),
        "specific_heat": _diffusivity(1.14e-5, 47.8, 7850.0, _S + ", steel"),
    },
    "steel_35KhNL": {
        "conductivity": Entry(38.0, 33.0, 45.0, _TEXTBOOK + ": low-alloy Cr–Ni cast steel", True),
        "density": Entry(7850.0, 7800.0, 7870.0, _TEXTBOOK, True),
        "specific_heat": Entry(480.0, 460.0, 500.0, _TEXTBOOK, True),
    },
    "cast_iron": {
        "conductivity": Entry(50.0, 40.0, 60.0, _TEXTBOOK + ": grey iron", True),
        "density": Entry(7200.0, 7000.0, 7300.0, _TEXTBOOK, True),
        "specific_heat": _diffusivity(1.04e-5, 50.0, 7200.0, _S + ", cast iron"),
    },
    "magnesium_alloy": {
        "conductivity": Entry(79.1, 70.0, 90.0, _V1),
        "density": Entry(1800.0, 1760.0, 1850.0, _TEXTBOOK, True),
        "specific_heat": Entry(1050.0, 1000.0, 1100.0, _TEXTBOOK, True),
    },
    "brass": {
        "conductivity": Entry(109.0, 100.0, 125.0, _V1),
        "density": Entry(8500.0, 8300.0, 8700.0, _TEXTBOOK, True),
        "specific_heat": Entry(385.0, 375.0, 395.0, _TEXTBOOK, True),
    },
    "aluminium_alloy": {
        "conductivity": Entry(163.0, 130.0, 180.0, _V1),
        "density": Entry(2700.0, 2640.0, 2800.0, _TEXTBOOK, True),
        "specific_heat": Entry(900.0, 870.0, 960.0, _TEXTBOOK, True),
    },
    "band_steel": {
        "conductivity": Entry(53.94, 45.0, 60.0, _V2 + ", brake band"),
        "density": Entry(7850.0, 7800.0, 7870.0, _TEXTBOOK, True),
        "specific_heat": Entry(480.0, 460.0, 500.0, _TEXTBOOK, True),
    },
    "FK-24A": {
        "conductivity": Entry(0.736, 0.5, 1.0, _V2 + ", lining"),
        "density": Entry(2000.0, 1800.0, 2300.0, "friction composite, order of magnitude", True),
        "specific_heat": Entry(1000.0, 800.0, 1200.0, "friction composite, order of magnitude", True),
    },
    "FK-24A_surface_layer": {
        "conductivity": Entry(1.02, 0.7, 1.5, _V2 + ", surface layer of the lining"),
        "density": Entry(2000.0, 1800.0, 2300.0, "as the lining", True),
        "specific_heat": Entry(1000.0, 800.0, 1200.0, "as the lining", True),
    },
    "retinax": {
        "conductivity": Entry(0.6, 0.4, 0.9, "friction composite, order of magnitude", True),
        "density": Entry(2150.0, 2000.0, 2400.0, "friction composite, order of magnitude", True),
        "specific_heat": Entry(950.0, 800.0, 1150.0, "friction composite, order of magnitude", True),
    },
    "air": {
        "conductivity": Entry(0.0257, 0.024, 0.06, "dry air at 20 °C and 1 bar, VDI Heat Atlas, D2.2"),
        "density": Entry(1.189, 0.4, 1.3, "dry air at 20 °C and 1 bar, VDI Heat Atlas, D2.2"),
        "specific_heat": Entry(1007.0, 1000.0, 1100.0, "dry air at 20 °C and 1 bar, VDI Heat Atlas, D2.2"),
    },
}


def material(name: str, **changes: float) -> Material:
    """A material of the library, with other numbers where `changes` names them.

    `simbrake.thermal.LIBRARY[name]` tells the source and the range of every number, and which are assumptions.
    Raises `KeyError` with the names there are.
    """
    if name not in LIBRARY:
        raise KeyError(f"no material {name!r}; there are: {', '.join(sorted(LIBRARY))}")
    numbers: dict[str, float] = {key: entry.value for key, entry in LIBRARY[name].items()}
    return Material(**{**numbers, **changes})  # pyright: ignore


def effusivity_share(metal: Material, lining: Material) -> Any:
    """Share of the friction heat into the metal when two half-spaces rub: `e_1/(e_1 + e_2)` (Charron, 1943)."""
    return metal.effusivity / (metal.effusivity + lining.effusivity)


def layer_growth(first: float, thickness: float, layers: int) -> float:
    """Ratio `r` of neighbouring layers so that `layers` of them, the first `first` thick, fill `thickness`:

    `first (r^N − 1)/(r − 1) = thickness`. Raises `ValueError` if the first is not between 0 and the whole.
    """
    from scipy.optimize import brentq
    from scipy.special import logsumexp

    if not (0 < first < thickness and layers > 1):
        raise ValueError(f"a first layer of {first:g} m does not fit {layers} layers in {thickness:g} m")
    powers = np.arange(layers)

    def rest(log_r: float) -> float:
        return float(np.log(first) + logsumexp(log_r * powers) - np.log(thickness))

    bound = np.log(thickness / first)
    root = brentq(rest, -bound - 1, bound + 1, xtol=1e-15)
    return float(np.exp(root))  # pyright: ignore
