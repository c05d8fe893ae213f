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
        young, expansion, poisson, stress = self.elastic
        found = _thermal(self.thermal) | {"young": young, "expansion": expansion, "poisson": poisson}
        limits = {"permissible_temperature": self.permissible, "solidus": self.solidus, "hardness": self.hardness}
        return found | {"permissible_stress": stress} | limits


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
        found, law = _thermal(self.thermal), self.wear
        if isinstance(law, ThresholdWear):
            numbers = {"coefficient": law.coefficient, "threshold": law.threshold, "activation": law.energy}
            found |= {f"wear_{name}": float(value) for name, value in numbers.items()}
        return found | {"permissible_temperature": self.permissible, "hardness": self.hardness}


_THERMAL = ("conductivity", "density", "specific_heat")


def _thermal(material: Material) -> dict[str, float]:
    return {name: float(getattr(material, name)) for name in _THERMAL}


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


# --- one brake application with one pair of materials -----------------------------------------------------------------


#: quantity → unit, meaning, formula of the estimate
QUANTITIES = {
    "friction_work": (
        "J",
        "friction work of the brake application",
        "classical stop, or the hardest brake application of the run",
    ),
    "duration": ("s", "time over which friction works", "as the work"),
    "share": (
        "1",
        "share of the heat into the rim, used for the temperatures",
        "the scene's law, else e_1/(e_1 + e_2)",
    ),
    "effusivity_share": ("1", "heat partition coefficient of the rim by effusivities", "e_1/(e_1 + e_2) (Charron)"),
    "transmission_share": (
        "1",
        "heat partition coefficient of the rim by heat transmission",
        "K_1/(K_1 + K_2) (S-41; V, table 2)",
    ),
    "bulk": ("K", "mean temperature of the heated depth", "T + (2/3) a W/(c G) (S-25)"),
    "bulk_end": ("K", "mean temperature of the rim at the end", "T + a W/(c G_rim)"),
    "surface": ("K", "maximum temperature of the rim's surface", "half-space under falling flux, at least bulk_end"),
    "lining_surface": ("K", "maximum temperature of the linings' surface", "as the rim: surfaces in contact"),
    "maximum": ("K", "maximum temperature with a third of the flash", "T + t_s + t_f/3 (S-26)"),
    "stress": ("Pa", "thermal stress of the rim's surface", "−E α (T_s − T_m)/(1 − ν), slab under constant flux"),
    "stress_ratio": ("1", "thermal stress over the allowable one", "|σ|/σ_p"),
    "wear": ("m", "mean depth worn off the linings", "I(T_s) W cos(β/2)/(f A_l) (Archard)"),
    "mass": ("kg", "mass of the rim", "ρ δ A"),
    "inertia": ("kg*m^2", "inertia of the rim about the shaft", "m (R² + (R − δ)²)/2"),
}


class Compared(NamedTuple):
    """An estimate, and the simulated number beside it where there is one; its unit, meaning and formula."""

    value: float
    simulated: float | None
    unit: str
    meaning: str
    formula: str

    @property
    def best(self) -> float:
        """The simulated number, else the estimate."""
        return self.value if self.simulated is None else self.simulated


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
    def limited(self) -> dict[str, float]:
        """Estimates that `criteria` limit; the maximum has a third of the flash."""
        start = self.braking.start_now
        maximum = maximum_temperatures(self.braking.heated.rise, self.surface_rise, self.flash).surface_and_third_flash
        ratio, surface = self.braking.stress_ratio, start + self.surface_rise
        limited = {"surface": surface, "lining_surface": surface, "stress_ratio": ratio}
        return limited | {"maximum": start + float(maximum)}

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
        rate = self.lining.wear(jnp.asarray(load_way) / b.travel, speed, jnp.asarray(self.limited["surface"]))
        return float(np.mean(np.asarray(rate))) * load_way

    def quantities(self, simulated: bool) -> dict[str, Compared]:
        """All quantities by name, beside those of the run if they are `simulated`."""
        b, mass, in_run = self.braking, rim_mass(self.braking), {}
        values = self.limited | {
            "friction_work": b.work,
            "duration": b.time,
            "share": b.share,
            "effusivity_share": b.effusivity_share,
            "transmission_share": self.transmission(),
            "bulk": b.heated.bulk,
            "bulk_end": b.end,
            "stress": b.stress,
            "wear": self.wear(),
            "mass": mass,
            "inertia": ring_inertia(mass, b),
        }
        if simulated and b.run is not None:
            result = b.run.result
            in_run = {"share": b.simulated_share, "bulk": b.simulated_bulk, "bulk_end": b.simulated_end}
            in_run["surface"] = b.peak
            if b.run_stress is not None:
                _, in_run["stress"], in_run["stress_ratio"] = b.run_stress
            if b.scene.network.linings is not None:
                in_run["lining_surface"] = float(result.peak_lining_temperature.value)
            if knows_wear(result.scene):
                in_run["wear"] = float(np.mean(np.asarray(lining_wear(result, self.lining.wear))))
        return {name: Compared(values[name], in_run.get(name), *about) for name, about in QUANTITIES.items()}


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
        return max(criteria(case.scaled(math.exp(log_s)).limited, case.rim, case.lining), key=lambda limit: limit.ratio)

    low, high = math.log(1e-4), math.log(1e4)
    if worst(low).ratio >= 1:
        return 0.0, worst(low).name
    end = brentq(lambda x: worst(x).ratio - 1, low, high, xtol=1e-13)
    assert isinstance(end, float)
    return case.braking.work * math.exp(2 * end), worst(end).name
