"""Materials of rims and linings, and the results of a pair of them in a brake application."""

import dataclasses
import functools
import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from .._base._faults import require_positive
from .._parts._scene import Scene, band_brake
from .._run._linings import lining_wear
from ..thermal._material import LIBRARY, Entry, Material, library, material
from ..wear import ThresholdWear
from ._braking import Braking
from ._estimates import ROWS, Row, look, number
from ._heated import there
from .heating import maximum_temperatures, transmission_table
from .stress import ElasticMaterial

_ZERO = 273.15  # K


@dataclasses.dataclass(frozen=True, eq=False)
class RimMaterial:
    """A material for rims: `thermal` properties, constants for thermal stress (`elastic`), and its limits.

    - `permissible` (K): of the surface in service; `solidus` (K): where it begins to melt; `hardness` (Pa)
    - `sources`: number → source; assumptions are marked

    Example:
        >>> sb.formulas.rim_material("brass").elastic.young
        105000000000.0
    """

    name: str
    thermal: Material
    elastic: ElasticMaterial
    permissible: float
    solidus: float
    hardness: float
    sources: dict[str, str] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        require_positive(permissible=self.permissible, solidus=self.solidus, hardness=self.hardness)

    @property
    def numbers(self) -> dict[str, float]:
        """Return all numbers by name (SI)."""
        return {name: float(look(self, path)) for name, path in (_THERMAL | _ELASTIC | _LIMITS).items()}


@dataclasses.dataclass(frozen=True, eq=False)
class LiningMaterial:
    """A material for linings: `thermal` properties, law of `wear`, and its limits.

    - `wear`: rate `I(p, v, T)` (m³/(N·m)) as `sb.results.lining_wear` takes it
    - `permissible` (K): of its surface; `hardness` (Pa); `sources`: number → source

    Its friction is that of the scene: the effect of another coefficient needs a run with another law.

    Example:
        >>> sb.formulas.lining_material("retinax").permissible
        773.15
    """

    name: str
    thermal: Material
    wear: Callable[..., Any]
    permissible: float
    hardness: float
    sources: dict[str, str] = dataclasses.field(default_factory=dict)

    def __post_init__(self) -> None:
        require_positive(permissible=self.permissible, hardness=self.hardness)

    @property
    def numbers(self) -> dict[str, float]:
        """Return all numbers by name (SI); of the wear law those of `ThresholdWear`."""
        paths = _THERMAL | (_WEAR if isinstance(self.wear, ThresholdWear) else {}) | _LIMITS
        return {name: float(look(self, path)) for name, path in paths.items() if name != "solidus"}


#: number of a material → its place
_THERMAL = {name: f"thermal.{name}" for name in ("conductivity", "density", "specific_heat")}
_ELASTIC = {name: f"elastic.{name}" for name in ("young", "expansion", "poisson")}
_ELASTIC |= {"permissible_stress": "elastic.permissible"}
_WEAR = {"wear_coefficient": "wear.coefficient", "wear_threshold": "wear.threshold", "wear_activation": "wear.energy"}
_LIMITS = {"permissible_temperature": "permissible", "solidus": "solidus", "hardness": "hardness"}


#: rim material → number → value with its source; the alloys are those whose conductivity is next to V's
RIMS = library("rim")
#: lining material → number → value with its source
LININGS = library("lining")


def _settled(
    name: str, table: dict[str, dict[str, Entry]], kind: str, changes: dict[str, float]
) -> tuple[dict[str, float], Material, dict[str, str]]:
    """Numbers by name with `changes`, the thermal ones as a material, and where each is from."""
    if name not in table:
        raise KeyError(f"no {kind} {name!r}; there are: {', '.join(sorted(table))}")
    entries, sources = LIBRARY[name] | table[name], {}
    if unknown := sorted(set(changes) - set(entries)):
        raise KeyError(f"a {kind} has no {', '.join(unknown)}; there are: {', '.join(entries)}")
    numbers = {key: float(changes.get(key, entry.value)) for key, entry in entries.items()}
    for key, entry in entries.items():
        unsaid = entry.assumed and not entry.source.startswith("assumption")
        sources[key] = "given" if key in changes else entry.source + (" (assumed)" if unsaid else "")
    return numbers, material(name, **{key: numbers[key] for key in _THERMAL}), sources


def rim_material(name: str, **changes: float) -> RimMaterial:
    """A rim's material: steel_20L, steel_35KhNL, cast_iron, magnesium_alloy, brass, aluminium_alloy.

    `changes` by name (SI): those of `Material`, `young`, `expansion`, `poisson`, `permissible_stress`,
    `permissible_temperature`, `solidus`, `hardness`. The source of each number is in `sources`: conductivities of
    V, handbook values, and assumptions. Raises `KeyError` with the known names.

    Example:
        >>> sb.formulas.rim_material("steel_20L").name
        'steel_20L'
    """
    n, thermal, sources = _settled(name, RIMS, "rim material", changes)
    elastic = ElasticMaterial(n["young"], n["expansion"], n["poisson"], n["permissible_stress"])
    limits = n["permissible_temperature"], n["solidus"], n["hardness"]
    return RimMaterial(name, thermal, elastic, *limits, sources)


def lining_material(name: str, **changes: float) -> LiningMaterial:
    """A lining's material: FK-24A, retinax.

    `changes` by name (SI): those of `Material`, `wear_coefficient`, `wear_threshold`, `wear_activation` (of
    `ThresholdWear`), `permissible_temperature`, `hardness`. Raises `KeyError` with the known names.

    Example:
        >>> sb.formulas.lining_material("FK-24A").name
        'FK-24A'
    """
    n, thermal, sources = _settled(name, LININGS, "lining material", changes)
    wear = ThresholdWear(n["wear_coefficient"], n["wear_threshold"], n["wear_activation"])
    return LiningMaterial(name, thermal, wear, n["permissible_temperature"], n["hardness"], sources)


# --- one brake application with one pair of materials
# ---------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Case:
    """One brake application with one pair of materials; `flash`: rise of the spots (K)."""

    braking: Braking
    rim: RimMaterial
    lining: LiningMaterial
    flash: float

    def scaled(self, s: float) -> "Case":
        """The same from `s` times the speed, under the same torques: time by `s`, work by `s²`, flash by `√s`."""
        b = self.braking
        braking = dataclasses.replace(b, omega=b.omega * s, time=b.time * s, work=b.work * s**2)
        return dataclasses.replace(self, braking=braking, flash=self.flash * math.sqrt(s))

    @functools.cached_property
    def surface_rise(self) -> float:
        """Rise (K) of the rim's surface: a half-space has no back, and long brake applications warm the rim through."""
        return max(self.braking.falling_rise, self.braking.whole_rise)

    @property
    def surface(self) -> float:
        """Maximum temperature of the rim's surface (K)."""
        return self.braking.start_now + self.surface_rise

    def maximum(self) -> float:
        """The same with a third of the flash (K)."""
        found = maximum_temperatures(self.braking.heated.rise, self.surface_rise, self.flash)
        return self.braking.start_now + float(found.surface_and_third_flash)

    def transmission(self) -> float:
        """Heat partition coefficient of the rim by heat transmission."""
        b, T = self.braking, jnp.asarray(self.braking.start_now)
        law = dataclasses.replace(
            transmission_table(), rim_conductivity=b.rim.conductivity, lining_conductivity=b.lining.conductivity
        )
        return float(law.share(T, T))

    def wear(self) -> float:
        """Mean depth (m) worn off the linings over all brake applications, each at the temperature of the hardest."""
        b = self.braking
        work = b.work if b.run is None else b.run.total_work
        cosine = float(np.mean(np.cos(np.asarray(band_brake(b.scene).linings.angle) / 2)))
        load_way = work * cosine / (b.friction * b.lining_area)  # ∫ p v dt, as the friction f N acts at R_b/cos(β/2)
        speed = jnp.asarray(b.travel / b.time)
        rate = self.lining.wear(jnp.asarray(load_way) / b.travel, speed, jnp.asarray(self.surface))
        return float(np.mean(np.asarray(rate))) * load_way

    def lining_peak(self) -> float:
        """Maximum temperature (K) of the linings in the run."""
        there(self.braking.scene.network.linings)
        return float(there(self.braking.run).result.peak_lining_temperature.value)

    def run_wear(self) -> float:
        """Mean depth (m) worn off in the run."""
        result = there(self.braking.run).result
        worn = lining_wear(there(result if knows_wear(result.scene) else None), self.lining.wear)
        return float(np.mean(np.asarray(worn)))

    def mass(self) -> float:
        """`ρ δ A` of the rim (kg)."""
        return rim_mass(self.braking)

    def inertia(self) -> float:
        """Inertia of the rim (kg·m²)."""
        return ring_inertia(rim_mass(self.braking), self.braking)


def rim_mass(b: Braking) -> float:
    """`ρ δ A` (kg)."""
    return float(b.rim.density) * b.rim_thickness * b.track_area


def ring_inertia(mass: float, b: Braking) -> float:
    """Inertia (kg·m²) of a ring as thick as the rim: `m (R² + (R − δ)²)/2`."""
    return mass * (b.R**2 + (b.R - b.rim_thickness) ** 2) / 2


def knows_wear(scene: Scene) -> bool:
    """Whether runs of a scene have a temperature of the linings, on which their wear depends."""
    pair = scene.network.friction
    return pair is not None and pair.lining is not None


class Compared(NamedTuple):
    """An estimate, and the simulated number beside it where there is one."""

    value: float
    simulated: float | None = None

    @property
    def best(self) -> float:
        """The simulated number, else the estimate."""
        return self.value if self.simulated is None else self.simulated


#: quantity → its row: the estimate, and what a run with a rim in layers has of it
QUANTITIES: dict[str, Row] = {row.name: row for row in ROWS if row.table == "materials"}


class Criterion(NamedTuple):
    """One limit of a pair of materials: value over permissible value, and both in words."""

    name: str
    ratio: float  # of temperatures in K
    words: str


def criteria(values: Mapping[str, float], rim: RimMaterial, lining: LiningMaterial) -> list[Criterion]:
    """Limits of the materials for estimated or simulated values (SI)."""

    def hot(name: str, key: str, limit: float, of: str) -> Criterion:
        words = f"{of} {values[key] - _ZERO:.0f} °C over {limit - _ZERO:.0f} °C"
        return Criterion(name, values[key] / limit, words)

    stress = f"stress {values['stress_ratio']:.2f} × allowable stress"
    return [
        hot("rim temperature", "surface", rim.permissible, "rim"),
        hot("lining temperature", "lining_surface", lining.permissible, "lining"),
        Criterion("thermal stress", values["stress_ratio"], stress),
        hot("melting", "maximum", rim.solidus, "spots"),
    ]


def greatest_work(case: Case) -> tuple[float, str]:
    """Maximum friction work (J) of one brake application that the pair withstands by the estimates, and its limiting
    criterion.

    The same brake application from another speed under the same torques (time by the speed, work by its square). Every
    criterion grows with the speed, so that there is one end; 0 where the rim is too hot at the start.
    """
    from scipy.optimize import brentq

    def worst(log_s: float) -> Criterion:
        scaled = case.scaled(math.exp(log_s))
        looked = ("surface", "lining_surface", "maximum", "stress_ratio")
        values = {name: there(number(scaled, QUANTITIES[name].value)) for name in looked}
        return max(criteria(values, case.rim, case.lining), key=lambda one: one.ratio)

    low, high = math.log(1e-4), math.log(1e4)
    if worst(low).ratio >= 1:
        return 0.0, worst(low).name
    end = brentq(lambda x: worst(x).ratio - 1, low, high, xtol=1e-13)
    assert isinstance(end, float)
    return case.braking.work * math.exp(2 * end), worst(end).name
