"""Materials: thermal properties with their temperature dependence, and a small library
with sources."""

import csv
from importlib import resources
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from .._base._faults import Fault
from .._base._part import Part, positive_quantity, quantity
from .._base._quantity import IndexedBy, Scalar
from ..hybrid.arrays import Floats

ROOM = 293.15  # K, default reference of properties (20 °C)


class Material(Part):
    """Thermal properties, linear in the temperature: `λ(T) = λ [1 + b_λ (T − T_r)]`,
    `c(T) = c [1 + b_c (T − T_r)]`.

    - `conductivity` `λ` (W/(m·K)), `density` `ρ` (kg/m³), `specific_heat` `c`
      (J/(kg·K)) at `reference` `T_r` (K)
    - `conductivity_slope` `b_λ`, `specific_heat_slope` `b_c` (1/K); `None`: no
      dependence, and no cost

    Example:
        >>> sb.Material(47.8, 7850.0, 534.0)
        Material(conductivity=47.8 W/(m·K), density=7850 kg/m³, specific_heat=534
        J/(kg·K), reference=20 °C)
    """

    conductivity: Scalar = positive_quantity("W/(m*K)", "thermal conductivity")
    density: Scalar = positive_quantity("kg/m^3", "density")
    specific_heat: Scalar = positive_quantity("J/(kg*K)", "specific heat")
    conductivity_slope: Scalar | None = quantity(
        "1/K", "relative change of conductivity per kelvin", default=None
    )
    specific_heat_slope: Scalar | None = quantity(
        "1/K", "relative change of specific heat per kelvin", default=None
    )
    reference: Scalar = positive_quantity(
        "K", "temperature at which the properties hold", default=ROOM
    )

    @property
    def volumetric_heat_capacity(self) -> Scalar:
        """`ρ c` in J/(m³·K)."""
        return self.density * self.specific_heat

    @property
    def diffusivity(self) -> Scalar:
        """`a = λ/(ρ c)` in m²/s."""
        return self.conductivity / self.volumetric_heat_capacity

    @property
    def effusivity(self) -> Scalar:
        """`e = √(λ ρ c)` in W·√s/(m²·K)."""
        return (self.conductivity * self.density * self.specific_heat) ** 0.5


class SurfaceLayer(Part):
    """A massless layer on the friction face of a wall: `R = δ_s(T)/λ_s` between face
    and wall (V, table 2).

    - `temperature` (k,): of the wall's outermost layer (K)
    - `thickness` `δ_s` (k,) of the surface layer there (m)
    - `conductivity` `λ_s` (W/(m·K))

    Linear between the temperatures, constant beyond their ends. V's layer of FK-24A
    grows from 5.6 µm at 100 °C to 35.4 µm at 650 °C;
    `simbrake.design.formulas.heating.transmission_table` has all its rows:

        table = sb.formulas.heating.transmission_table()
        sb.thermal.SurfaceLayer(table.temperature, table.surface_layer)

    Example:
        >>> layer = sb.thermal.SurfaceLayer(["100 degC", "650 degC"], ["5.6 um", "35.4 um"])
        >>> round(float(layer.resistance(500.0)) * 1e6, 4)
        12.2284
    """

    temperature: Scalar = quantity(
        "K", "temperatures of the table", low=0.0, many=IndexedBy.ROWS
    )
    thickness: Scalar = quantity(
        "m", "thickness of the surface layer", low=0.0, many=IndexedBy.ROWS
    )
    conductivity: Scalar = positive_quantity(
        "W/(m*K)", "conductivity of the surface layer", default=1.02
    )

    def resistance(self, T: Floats) -> Floats:
        """`δ_s(T)/λ_s` in m²·K/W."""
        T_k, thickness = (
            jnp.atleast_1d(jnp.asarray(x)) for x in (self.temperature, self.thickness)
        )
        return jnp.interp(T, T_k, thickness) / self.conductivity

    def faults(self, path: str) -> list[Fault]:
        """Errors of the table."""
        if np.shape(self.temperature) != np.shape(self.thickness):
            return [
                Fault(
                    f"{path}.thickness",
                    "does not fit the temperatures",
                    "give one thickness for each",
                )
            ]
        if np.any(np.diff(np.atleast_1d(np.asarray(self.temperature, float))) <= 0):
            return [
                Fault(
                    f"{path}.temperature", "the temperatures of the table must increase"
                )
            ]
        return []


class Entry(NamedTuple):
    """One number of the library: value (SI), valid range, source, and whether it is
    assumed."""

    value: float
    low: float
    high: float
    source: str
    assumed: bool = False


def library(part: str) -> dict[str, dict[str, Entry]]:
    """Material of a part (`thermal`: of any) → number → value with its source, from
    `materials.csv`."""
    materials: dict[str, dict[str, Entry]] = {}
    text = (resources.files("simbrake") / "thermal" / "materials.csv").read_text(
        "utf-8"
    )
    for row in csv.DictReader(text.splitlines()):
        if row["part"] == part:
            value, low, high = (float(row[key]) for key in ("value", "low", "high"))
            entry = Entry(value, low, high, row["source"], bool(row["assumed"]))
            materials.setdefault(row["material"], {})[row["number"]] = entry
    return materials


#: material → property → number with its source
LIBRARY = library("thermal")


def material(name: str, **changes: float) -> Material:
    """A material of the library, with other numbers where `changes` names them.

    `simbrake.thermal.LIBRARY[name]` gives the source and the range of every number, and
    marks assumptions. Raises `KeyError` with the known names.

    Example:
        >>> sb.material("steel_20L").density
        array(7850.)
    """
    if name not in LIBRARY:
        raise KeyError(f"no material {name!r}; there are: {', '.join(sorted(LIBRARY))}")
    numbers = {key: entry.value for key, entry in LIBRARY[name].items()}
    return Material(**{**numbers, **changes})


def effusivity_share(metal: Material, lining: Material) -> Scalar:
    """Heat partition coefficient of the metal for two sliding half-spaces:
    `e_1/(e_1 + e_2)` (Charron, 1943).

    Example:
        >>> share = sb.thermal.effusivity_share(sb.material("steel_20L"), sb.material("FK-24A"))
        >>> round(float(share), 4)
        0.9211
    """
    return metal.effusivity / (metal.effusivity + lining.effusivity)


def layer_growth(first: float, thickness: float, layers: int) -> float:
    """Ratio `r` of neighbouring layers so that `layers` of them, the first `first`
    thick, fill `thickness`:

    `first (r^N − 1)/(r − 1) = thickness`. Raises `ValueError` if the first is not
    between 0 and the whole.

    Example:
        >>> round(sb.thermal.layer_growth(0.4e-3, 25e-3, 16), 5)
        1.16285
    """
    if not (0 < first < thickness and layers > 1):
        raise ValueError(
            f"a first layer of {first:g} m does not fit {layers} layers in {thickness:g} m"
        )
    # Newton's method on log Σ r^k over log r, which is convex and rises: from above it
    # comes down to the root. (Of SciPy the import alone would take longer than most
    # runs)
    powers = np.arange(layers)
    wanted = np.log(thickness / first)
    log_r = step = wanted + 1.0
    for _ in range(200):
        largest = max(0.0, log_r * (layers - 1))
        terms = np.exp(log_r * powers - largest)
        total = np.sum(terms)
        last = step
        step = (largest + np.log(total) - wanted) * total / np.sum(powers * terms)
        if abs(step) <= 1e-16 or abs(step) >= abs(last) < 1e-9:  # rounding
            break
        log_r -= step
    return float(np.exp(log_r))
