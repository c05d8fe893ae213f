"""The rows of a table of engineering estimates: stop, power, depth, temperatures, surfaces, balance, stress."""

import dataclasses
import math
from typing import Any

import jax.numpy as jnp
import numpy as np

from ._classical_stop import ClassicalStop, friction_at_start
from ._contact_estimates import radiation_coefficient, real_contact_area
from ._equivalents import current_density, series_conductivity, series_resistance
from ._estimate_data import Input, rim_wall
from ._estimate_report import EstimateRow
from ._estimate_run import RunValues, schmidt_of_run
from ._heat import FlashTemperature
from ._heat_balance import heat_balance
from ._material import effusivity_share
from ._reproduce import transmission_table
from ._result import Result
from ._scene import Scene
from ._schmidt import schmidt
from ._thermal_estimates import (
    effective_fourier_number,
    effective_volume,
    fourier_parameter,
    maximum_temperatures,
    mean_bulk_rise,
    penetration_depth,
    slab_rise,
    stopping_rise,
)
from ._thermal_stress import plate_stress, surface_stress


@dataclasses.dataclass(frozen=True)
class Basis:
    """What every row is made from: scene, inputs by name, the classical stop and the run where there are any.

    `time` (s), `work` (J), `omega` (rad/s, at first) of the braking: the run's, else the classical stop's.
    """

    scene: Scene
    inputs: dict[str, Input]
    stop: ClassicalStop | None
    result: Result | None
    run: RunValues | None
    time: float
    work: float
    omega: float

    def __getattr__(self, name: str) -> Any:
        try:
            return self.__dict__["inputs"][name].value
        except KeyError:
            raise AttributeError(name) from None

    @property
    def speed(self) -> float:
        """Track speed at first (m/s)."""
        return self.omega * float(self.scene.brake.pulley.radius)

    @property
    def start_now(self) -> float:
        """Mean temperature of the rim as the braking begins (K)."""
        return self.start if self.run is None or self.run.layers is None else float(self.run.mean()[0])

    @property
    def travel(self) -> float:
        """Way that the linings rub (m), on the band circle."""
        if self.run is None:
            angle = self.omega * self.time / 2
        else:
            angle = np.sum(0.5 * (self.run.omega[1:] + self.run.omega[:-1]) * np.diff(self.run.t))
        return float(self.scene.brake.band.radius) * abs(float(angle))

    @property
    def friction(self) -> float:
        """Mean coefficient of friction at the start."""
        return float(np.mean(friction_at_start(self.scene)))

    @property
    def flux(self) -> float:
        """Mean heat flux into the whole track (W/m²)."""
        return self.share * self.work / (self.track_area * self.time)

    @property
    def layered(self) -> RunValues | None:
        """The run where it has a rim in layers."""
        return None if self.run is None or self.run.layers is None else self.run


def stop_rows(b: Basis) -> list[EstimateRow]:
    """Tension ratio, torque, time, angle, friction work of the classical stop, beside the run's."""
    stop, metrics = b.stop, {} if b.result is None else b.result.metrics
    if stop is None:
        return []
    run = b.run
    torque = None if run is None else float(np.max(run.torque))
    work = None if run is None else run.total_work
    peak = None if run is None else float(np.max(np.diff(run.work) / np.diff(run.t)))
    lever = "the lever takes time, the band stretches before it slides, hot linings rub less"
    return [
        EstimateRow("tension ratio", "Π = ∏ (1 + f z)/(1 − f z)", stop.ratio, "1", "Z-12…14"),
        EstimateRow("brake torque", "M_b = R_b T_0 (Π − 1)", stop.torque, "N*m", "Z-17", torque, lever),
        EstimateRow(
            "stopping time", "t = J ω_0/(M_b − M)", stop.time, "s", "Z-18", metrics.get("stopping_time"), lever
        ),
        EstimateRow("stopping angle", "φ = ω_0 t/2", stop.angle, "rad", "", metrics.get("stopping_angle"), lever),
        EstimateRow(
            "friction work",
            "W = M_b φ",
            stop.work,
            "J",
            "",
            work,
            "a longer way adds work of the load, and what stretches the band does not rub",
        ),
        EstimateRow("friction power at first", "P = M_b ω_0", stop.power, "W", "S-7", peak, lever),
    ]


def power_rows(b: Basis) -> list[EstimateRow]:
    """The friction work of the braking in its shares."""
    split = b.power.split(b.work)
    heat = None if b.run is None else b.work
    why = "the simulated ledger books all friction power as heat"
    source = "S-8…11"
    return [
        EstimateRow("work into heat", "share of heat × W", split.heat, "J", source, heat, why),
        EstimateRow("electrical work", "share of electricity × W", split.electrical, "J", source),
        EstimateRow("mechanical work", "share of mechanical work × W", split.mechanical, "J", source),
    ]


def depth_rows(b: Basis) -> list[EstimateRow]:
    """Penetration depth, Fourier numbers, effective volumes and parameter B of rim, lining and band."""
    rows = []
    for part, area in (("rim", b.track_area), ("lining", b.lining_area), ("band", b.lining_area)):
        thickness, a = getattr(b, f"{part}_thickness"), float(getattr(b, part).diffusivity)
        depth = float(penetration_depth(a, b.time))
        Fo = float(effective_fourier_number(a, b.time, thickness))
        rows += [
            EstimateRow(f"depth of heat, {part}", "b = 1.73 √(a τ)", depth, "m", "S, step 1"),
            EstimateRow(f"Fourier number, {part}", "a τ/δ², or 1/3 while b ≤ δ", Fo, "1", "S-15, step 2"),
            EstimateRow(f"parameter B, {part}", "a/δ²", float(fourier_parameter(a, thickness)), "1/s", "S, table 1"),
            EstimateRow(
                f"effective volume, {part}",
                "A min(b, δ)",
                float(effective_volume(area, thickness, depth)),
                "m^3",
                "S, step 3",
            ),
        ]
    return rows


def partition_rows(b: Basis) -> list[EstimateRow]:
    """Share of the heat into the rim by effusivities and by heat transmission, beside the run's."""
    simulated = None
    if b.run is not None and b.result is not None and b.scene.heat is not None and b.run.total_work > 0:
        to_metal = b.result.energy.get("heat_to_metal")
        simulated = None if to_metal is None else float(to_metal) / b.run.total_work
    why = "the simulated share is of where the heat enters by the scene's own law, before bodies exchange any"
    K_1, K_2 = (float(np.asarray(K)) for K in transmission_table().transmissions(jnp.asarray(b.start_now)))
    effusivities = float(effusivity_share(b.rim, b.lining))
    stack = ([b.lining_thickness, b.band_thickness], [float(b.lining.conductivity), float(b.band.conductivity)])
    return [
        EstimateRow(
            "share into the rim, effusivities", "e_1/(e_1 + e_2)", effusivities, "1", "Charron", simulated, why
        ),
        EstimateRow(
            "share into the rim, transmission", "K_1/(K_1 + K_2)", K_1 / (K_1 + K_2), "1", "S-41; V2", simulated, why
        ),
        EstimateRow(
            "conductivity, lining and band", "Σδ/Σ(δ/λ)", float(series_conductivity(*stack)), "W/(m*K)", "S-30"
        ),
        EstimateRow(
            "resistance, lining and band",
            "Σ δ/(λ A)",
            float(series_resistance(*(d / (k * b.lining_area) for d, k in zip(*stack, strict=True)))),
            "K/W",
            "S-30",
        ),
    ]


def temperature_rows(b: Basis) -> list[EstimateRow]:
    """Bulk, surface, flash and maximum temperature of the rim by the formulas, beside the run's."""
    run, T = b.layered, b.start_now
    depth = float(penetration_depth(float(b.rim.diffusivity), b.time))
    heated = effective_volume(b.track_area, b.rim_thickness, depth) * float(b.rim.density)
    bulk = float(mean_bulk_rise(b.share, b.work, float(b.rim.specific_heat), heated))
    plate = float(slab_rise(b.flux, b.time, b.rim_thickness, b.rim))
    stop = float(stopping_rise(2 * b.flux, b.time / 2, b.time, float(b.rim.effusivity)))
    flash = flash_rise(b)
    within = None if run is None else float(np.mean(run.mean(depth)))
    end = None if run is None or run.surface is None else float(run.surface[-1])
    peak = None if run is None or run.surface is None else float(np.max(run.surface))
    whole = b.share * b.work / (b.track_area * b.rim_thickness * float(b.rim.density * b.rim.specific_heat))
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
    law = FlashTemperature(b.spot_length, float(b.rim.conductivity), float(b.rim.diffusivity), b.share, b.hardness)
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
    run, wall = b.layered, rim_wall(b.scene)
    if run is not None and wall is not None:
        course = schmidt_of_run(run, wall, b.share, b.track_area)
        why = "the scheme has no exchange with linings and air; constant properties; layers of another thickness"
        value, formula = float(np.max(course.temperature[:, 0])), "½ (t_{j−1} + t_{j+1}), the run's own heat"
        return [EstimateRow("surface temperature, Schmidt", formula, value, "K", "S-28", peak, why)]
    course = schmidt(b.rim, b.rim_thickness, 40, b.time, b.flux, start=T)
    value = float(np.interp(b.time, course.t, course.temperature[:, 0]))
    return [EstimateRow("surface temperature, Schmidt", "½ (t_{j−1} + t_{j+1}), constant flux", value, "K", "S-28")]


def contact_rows(b: Basis) -> list[EstimateRow]:
    """Real contact area, surfaces and their coefficient of radiation, gradient through the rim."""
    pressure = b.work / (b.friction * b.travel * b.lining_area) if b.friction * b.travel > 0 else 0.0
    rows = []
    if 0 < pressure <= b.hardness:
        area = float(real_contact_area(b.lining_area, pressure, b.hardness))
        rows += [
            EstimateRow("pressure, mean", "W/(f s A_l)", pressure, "Pa", "S-7"),
            EstimateRow("real contact area", "A_a p/HB", area, "m^2", "S-34"),
        ]
    run = b.layered
    drop = float(np.max(run.profile[:, 0] - run.profile[:, -1])) if run is not None else None
    slope = b.flux * b.rim_thickness / float(b.rim.conductivity)
    rows += [
        EstimateRow("polished surface", "2 π R b", b.track_area, "m^2", "S-35"),
        EstimateRow("matte surfaces", "Σ A", b.matte_area, "m^2", "S-36"),
        EstimateRow(
            "radiation coefficient",
            "ε σ (T² + T_a²)(T + T_a)",
            float(radiation_coefficient(b.emissivity, b.start_now, b.ambient)),
            "W/(m^2*K)",
            "S-37, 38",
        ),
        EstimateRow(
            "drop over the rim, stationary flux",
            "q δ/λ",
            slope,
            "K",
            "S-23",
            drop,
            "while the rim soaks, its back takes nothing and the flux varies over the depth",
        ),
    ]
    if drop is not None:
        flow = float(current_density(float(b.rim.conductivity), drop, b.rim_thickness))
        rows.append(EstimateRow("flux by the greatest drop", "λ ΔT/δ", flow, "W/m^2", "S-23"))
    return rows


def balance_rows(b: Basis) -> list[EstimateRow]:
    """Heat balance of the rim over four revolutions at the mean speed of the braking."""
    if b.omega <= 0:
        return []
    omega = b.travel / (float(b.scene.brake.band.radius) * b.time)
    if not (omega > 0 and b.overlap > 0):
        return []
    coefficient = b.coefficient + float(radiation_coefficient(b.emissivity, b.start_now, b.ambient))
    found = heat_balance(
        b.flux / b.overlap,  # the flux under the linings, of which the track gets the mean
        overlap=b.overlap,
        coefficient=coefficient,
        surface=b.start_now,
        ambient=b.ambient,
        omega=omega,
        area=b.track_area,
    )
    return [
        EstimateRow("overlap coefficient", "κ = ΣA_l/A_a", b.overlap, "1", "S-21"),
        EstimateRow("time of four revolutions", "τ = 2 π n/ω", found.time, "s", "S-17"),
        EstimateRow("heat gained in it", "q_1 A_a κ τ", found.gained, "J", "S-18"),
        EstimateRow("heat given away in it", "h (T − T_a) A_a (1 − κ) τ", found.lost, "J", "S-19"),
        EstimateRow("mean flux kept", "κ q_1 − (1 − κ) h (T − T_a)", found.mean_flux, "W/m^2", "S-21"),
    ]


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


GROUPS = (
    stop_rows,
    power_rows,
    depth_rows,
    partition_rows,
    temperature_rows,
    contact_rows,
    balance_rows,
    stress_rows,
)
