"""Rows of a table of estimates: bulk, surface, flash and maximum temperature of the rim, and its thermal stress."""

import math

import jax.numpy as jnp
import numpy as np

from ..thermal._heat import FlashTemperature
from ._estimate_basis import Basis
from ._estimate_data import rim_wall
from ._estimate_report import EstimateRow
from ._estimate_run import schmidt_of_run
from ._schmidt import schmidt
from ._thermal_estimates import (
    effective_volume,
    maximum_temperatures,
    mean_bulk_rise,
    penetration_depth,
    slab_rise,
    stopping_rise,
)
from ._thermal_stress import plate_stress, surface_stress


def temperature_rows(b: Basis) -> list[EstimateRow]:
    """Bulk, surface, flash and maximum temperature of the rim (or band) by the formulas, beside the run's."""
    run, T, metal = b.bodied, b.start_now, b.metal
    depth = float(penetration_depth(float(metal.diffusivity), b.time))
    heated = effective_volume(b.metal_area, b.metal_thickness, depth) * float(metal.density)
    bulk = float(mean_bulk_rise(1.0, b.metal_heat, float(metal.specific_heat), heated))
    plate = float(slab_rise(b.flux, b.time, b.metal_thickness, metal))
    stop = float(stopping_rise(2 * b.flux, b.time / 2, b.time, float(metal.effusivity)))
    flash = flash_rise(b)
    within = None if run is None else float(np.mean(run.mean(depth)))
    end = None if run is None or run.surface is None else float(run.surface[-1])
    peak = None if run is None or run.surface is None else float(np.max(run.surface))
    whole = b.metal_heat / (b.metal_area * b.metal_thickness * float(metal.density * metal.specific_heat))
    rows = [
        EstimateRow(
            "bulk temperature, mean",
            "T + (2/3) a W/(c G)",
            T + bulk,
            "K",
            "S-25",
            within,
            "2/3 is for power that falls linearly from the first moment, and G is all of the heated depth",
        ),
        EstimateRow(
            "bulk temperature, end",
            "T + a W/(c G_rim)",
            T + whole,
            "K",
            "",
            None if run is None else float(run.mean()[-1]),
            "heat exchanged with linings and air during the braking, properties that change with temperature",
        ),
        EstimateRow(
            "surface temperature, constant flux",
            "slab, adiabatic back, t = τ",
            T + plate,
            "K",
            "Carslaw & Jaeger §3.8",
            end,
            "the power falls towards the end, when the formula is hottest",
        ),
        EstimateRow(
            "surface temperature, falling flux",
            "half-space, q_0 (1 − t/τ), t = τ/2",
            T + stop,
            "K",
            "Carslaw & Jaeger §2.9",
            peak,
            "the power does not fall linearly; a half-space has no back",
        ),
    ]
    if flash is not None:
        rows += maximum_rows(b, bulk, stop, flash, peak)
    return rows + schmidt_rows(b, peak, T, plate)


def flash_rise(b: Basis) -> float | None:
    """Flash temperature (K) at the first speed, on spots that carry the hardness; `None` at rest."""
    if b.speed <= 0:
        return None
    metal = b.metal
    law = FlashTemperature(
        b.spot_length,
        float(metal.conductivity),
        float(metal.diffusivity),
        b.metal_share * float(b.power.heat),
        b.hardness,
    )
    return float(law.rise(jnp.asarray(b.friction * b.hardness * b.speed), jnp.asarray(b.speed)))


def maximum_rows(b: Basis, bulk: float, surface: float, flash: float, peak: float | None) -> list[EstimateRow]:
    """S's combinations for the maximum temperature side by side."""
    found = maximum_temperatures(bulk, surface, flash)
    why = "the run's surface has no flash; S does not derive its factors; t_s holds the bulk, which t_v adds again"
    rows = [EstimateRow("flash temperature, rise", "(2 q/λ) √(a l/(π v))", flash, "K", "Blok, Jaeger")]
    for name, formula, value, source in (
        ("S-26", "T + t_s + t_f/3", found.surface_and_third_flash, "S-26"),
        ("S-27", "T + t_v + t_s/3 + t_f/3", found.printed, "S-27, doubtful scan"),
        ("sum", "T + t_v + t_s + t_f", found.plain_sum, ""),
    ):
        rows.append(EstimateRow(f"maximum temperature, {name}", formula, b.start_now + value, "K", source, peak, why))
    return rows


def schmidt_rows(b: Basis, peak: float | None, T: float, plate: float) -> list[EstimateRow]:
    """Schmidt's scheme: with the run's own heat where there is one, else with a constant flux."""
    run, wall = b.layered, None if b.part == "band" else rim_wall(b.scene)
    if run is not None and wall is not None:
        hot, beyond = float(b.power.heat), b.beyond_share if b.pair else 0.0
        course = schmidt_of_run(run, wall, hot * b.share, b.track_area, hot * beyond)
        why = "the scheme has no exchange with linings and air; constant properties; layers of another thickness"
        value, formula = float(np.max(course.temperature[:, 0])), "½ (t_{j−1} + t_{j+1}), the run's own heat"
        return [EstimateRow("surface temperature, Schmidt", formula, value, "K", "S-28", peak, why)]
    course = schmidt(b.metal, b.metal_thickness, 40, b.time, b.flux, start=T)
    value = float(np.interp(b.time, course.t, course.temperature[:, 0]))
    return [EstimateRow("surface temperature, Schmidt", "½ (t_{j−1} + t_{j+1}), constant flux", value, "K", "S-28")]


def stress_rows(b: Basis) -> list[EstimateRow]:
    """Thermal stress of the rim's surface: from the slab under constant flux, beside that of the simulated profiles."""
    run, elastic = b.layered, b.elastic
    z = b.rim_thickness * np.linspace(0.0, 1.0, 401) ** 2
    rise = np.asarray(slab_rise(b.flux, b.time, b.rim_thickness, b.rim, z))
    mean = b.flux * b.time / (b.rim_thickness * float(b.rim.density * b.rim.specific_heat))
    stress = float(surface_stress(rise[0], mean, elastic))
    free = float(plate_stress(rise, z, elastic, restraint="none")[0])
    time, worst, ratio = (None, None, None) if run is None else run.stress(elastic).worst
    why = "the greatest difference comes before the end, while the power is high"
    rows = [
        EstimateRow("thermal stress, surface", "−E α (T_s − T_m)/(1 − ν)", stress, "Pa", "model §6.3", worst, why),
        EstimateRow("thermal stress, free to bend", "plate without restraint", free, "Pa", "Timoshenko & Goodier §132"),
        EstimateRow(
            "stress over permissible", "|σ|/σ_p", abs(stress) / elastic.permissible, "1", "S, step 11", ratio, why
        ),
    ]
    if time is not None and math.isfinite(time):
        rows.append(EstimateRow("time of greatest stress", "at the end: τ", b.time, "s", "", time - run.t[0], why))  # pyright: ignore
    return rows
