"""What a pair of materials comes to in a braking: temperatures, share, stress, wear, mass, the work it can take."""

import dataclasses
import math
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from .._parts._scene import Scene, band_brake
from .._run._linings import lining_wear
from .._run._result import Result
from ..thermal._material import effusivity_share
from ._estimate_basis import Basis
from ._estimate_temperatures import flash_rise
from ._material_data import LiningMaterial, RimMaterial
from ._reproduce import transmission_table
from ._thermal_estimates import (
    effective_volume,
    maximum_temperatures,
    mean_bulk_rise,
    penetration_depth,
    slab_rise,
    stopping_rise,
)
from ._thermal_stress import surface_stress

_ZERO = 273.15  # K

#: quantity → unit, meaning, formula
QUANTITIES: dict[str, tuple[str, str, str]] = {
    "friction_work": ("J", "friction work of the braking", "classical stop, or the run's hardest braking"),
    "duration": ("s", "time over which friction works", "as the work"),
    "share": (
        "1",
        "share of the heat into the rim, taken for the temperatures",
        "the scene's law, else e_1/(e_1 + e_2)",
    ),
    "effusivity_share": ("1", "share into the rim by effusivities", "e_1/(e_1 + e_2) (Charron)"),
    "transmission_share": ("1", "share into the rim by heat transmission", "K_1/(K_1 + K_2) (S-41; V, table 2)"),
    "bulk": ("K", "mean temperature of the heated depth", "T + (2/3) a W/(c G) (S-25)"),
    "bulk_end": ("K", "mean temperature of the rim at the end", "T + a W/(c G_rim)"),
    "surface": ("K", "greatest temperature of the rim's surface", "half-space under falling flux, at least bulk_end"),
    "lining_surface": ("K", "greatest temperature of the linings' surface", "as the rim's: they touch"),
    "maximum": ("K", "greatest temperature with a third of the flash", "T + t_s + t_f/3 (S-26)"),
    "stress": ("Pa", "thermal stress of the rim's surface", "−E α (T_s − T_m)/(1 − ν), slab under constant flux"),
    "stress_ratio": ("1", "thermal stress over the permissible one", "|σ|/σ_p"),
    "wear": ("m", "mean depth worn off the linings", "I(T_s) W cos(β/2)/(f A_l) (Archard)"),
    "mass": ("kg", "mass of the rim", "ρ δ A"),
    "inertia": ("kg*m^2", "inertia of the rim about the shaft", "m (R² + (R − δ)²)/2"),
}


class Compared(NamedTuple):
    """An estimate, and the simulated number beside it where there is one."""

    value: float
    simulated: float | None = None

    @property
    def best(self) -> float:
        """The simulated number, else the estimate."""
        return self.value if self.simulated is None else self.simulated


class Criterion(NamedTuple):
    """One thing that a pair of materials has to bear: its value over what is permitted, and both in words."""

    name: str
    ratio: float  # of temperatures in K
    words: str


@dataclasses.dataclass(frozen=True)
class Case:
    """One braking with one pair of materials."""

    basis: Basis
    rim: RimMaterial
    lining: LiningMaterial

    def scaled(self, s: float) -> "Case":
        """The braking from `s` times the speed, under the same torques: time by `s`, work by `s²`."""
        b = self.basis
        basis = dataclasses.replace(b, omega=b.omega * s, time=b.time * s, work=b.work * s**2)
        return dataclasses.replace(self, basis=basis)


def rim_mass(b: Basis) -> float:
    """`ρ δ A` (kg): flat, as the wall of a network is."""
    return float(b.rim.density) * b.rim_thickness * b.track_area


def ring_inertia(mass: float, radius: float, thickness: float) -> float:
    """Inertia (kg·m²) of a ring of the outer `radius` (m): `m (R² + (R − δ)²)/2`."""
    return mass * (radius**2 + (radius - thickness) ** 2) / 2


def stress_of(b: Basis) -> float:
    """Thermal stress (Pa) of the surface of a slab under the mean flux, at the end."""
    face = float(slab_rise(b.flux, b.time, b.rim_thickness, b.rim))
    mean = b.flux * b.time / (b.rim_thickness * float(b.rim.density * b.rim.specific_heat))
    return float(surface_stress(face, mean, b.elastic))


def temperatures_of(b: Basis, flash: float) -> dict[str, float]:
    """Bulk, surface and maximum temperatures (K), as in the table of `estimates`; `flash`: rise of the spots (K)."""
    T = b.start_now
    depth = float(penetration_depth(float(b.rim.diffusivity), b.time))
    heated = effective_volume(b.track_area, b.rim_thickness, depth) * float(b.rim.density)
    bulk = float(mean_bulk_rise(b.share, b.heat, float(b.rim.specific_heat), heated))
    whole = b.share * b.heat / (float(b.rim.specific_heat) * rim_mass(b))
    half_space = float(stopping_rise(2 * b.flux, b.time / 2, b.time, float(b.rim.effusivity)))
    surface = max(half_space, whole)  # a half-space has no back: long brakings warm the rim through
    maximum = float(maximum_temperatures(bulk, surface, flash).surface_and_third_flash)
    rises = {"bulk": bulk, "bulk_end": whole, "surface": surface, "lining_surface": surface, "maximum": maximum}
    return {name: T + rise for name, rise in rises.items()}


def wear_of(case: Case, surface: float) -> float:
    """Mean depth (m) worn off the linings over all brakings, each as hot as the hardest."""
    b = case.basis
    work = b.work if b.run is None else b.run.total_work
    cosine = float(np.mean(np.cos(np.asarray(band_brake(b.scene).linings.angle) / 2)))
    load_way = work * cosine / (b.friction * b.lining_area)  # ∫ p v dt, as the friction f N acts at R_b/cos(β/2)
    speed = jnp.asarray(b.travel / b.time)
    rate = case.lining.wear(jnp.asarray(load_way) / b.travel, speed, jnp.asarray(surface))
    return float(np.mean(np.asarray(rate))) * load_way


def estimated(case: Case) -> dict[str, float]:
    """Every quantity of a pair by its classical formula (SI)."""
    b = case.basis
    table = dataclasses.replace(
        transmission_table(), rim_conductivity=b.rim.conductivity, lining_conductivity=b.lining.conductivity
    )
    T = temperatures_of(b, flash_rise(b) or 0.0)
    stress, mass = stress_of(b), rim_mass(b)
    found = {
        "friction_work": b.work,
        "duration": b.time,
        "share": b.share,
        "effusivity_share": float(effusivity_share(b.rim, b.lining)),
        "transmission_share": float(table.share(jnp.asarray(b.start_now), jnp.asarray(b.start_now))),
        **T,
        "stress": stress,
        "stress_ratio": abs(stress) / b.elastic.permissible,
        "wear": wear_of(case, T["surface"]),
        "mass": mass,
        "inertia": ring_inertia(mass, float(band_brake(b.scene).pulley.radius), b.rim_thickness),
    }
    return {name: float(found[name]) for name in QUANTITIES}


def simulated(case: Case, result: Result) -> dict[str, float]:
    """The quantities of a pair that a run with its materials has; none where the rim is not in layers."""
    b, run = case.basis, case.basis.layered
    if run is None or run.surface is None:
        return {}
    depth = float(penetration_depth(float(b.rim.diffusivity), b.time))
    _, stress, ratio = run.stress(b.elastic).worst
    found = {
        "bulk": float(np.mean(run.mean(depth))),
        "bulk_end": float(run.mean()[-1]),
        "surface": float(np.max(run.surface)),
        "stress": stress,
        "stress_ratio": ratio,
    }
    to_metal = result.energy.get("heat_to_metal")
    if to_metal is not None and run.total_work > 0:
        found["share"] = float(to_metal) / float(b.booked.split(run.total_work).heat)
    if result.scene.network.linings is not None:
        found["lining_surface"] = float(result.peak_lining_temperature.value)
    if knows_wear(result.scene):
        found["wear"] = float(np.mean(np.asarray(lining_wear(result, case.lining.wear))))
    return found


def knows_wear(scene: Scene) -> bool:
    """Whether runs of a scene have a temperature of the linings, on which their wear depends."""
    pair = scene.network.friction
    return pair is not None and pair.lining is not None


def criteria(values: dict[str, float], rim: RimMaterial, lining: LiningMaterial) -> list[Criterion]:
    """What the materials have to bear, of estimated or simulated values (SI)."""

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
    """Greatest friction work (J) of one braking that the pair bears by the estimates, and what ends it.

    The braking at hand from another speed under the same torques (time by the speed, work by its square). Every
    criterion grows with the speed, so that there is one end; 0 where the rim is too hot at the start.
    """
    from scipy.optimize import brentq

    flash = flash_rise(case.basis) or 0.0

    def worst(log_s: float) -> Criterion:
        scaled = case.scaled(math.exp(log_s))
        values = temperatures_of(scaled.basis, flash * math.exp(log_s / 2))  # it grows with the root of the speed
        values["stress_ratio"] = abs(stress_of(scaled.basis)) / scaled.basis.elastic.permissible
        return max(criteria(values, case.rim, case.lining), key=lambda one: one.ratio)

    low, high = math.log(1e-4), math.log(1e4)
    if worst(low).ratio >= 1:
        return 0.0, worst(low).name
    end = brentq(lambda x: worst(x).ratio - 1, low, high, xtol=1e-13)
    assert isinstance(end, float)
    return case.basis.work * math.exp(2 * end), worst(end).name
