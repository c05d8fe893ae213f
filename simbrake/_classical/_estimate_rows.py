"""Rows of a table of estimates: stop, power, depth of heat, partition, surfaces, heat balance."""

import jax.numpy as jnp
import numpy as np

from ..thermal._material import effusivity_share
from ._contact_estimates import radiation_coefficient, real_contact_area
from ._equivalents import current_density, series_conductivity, series_resistance
from ._estimate_basis import Basis
from ._estimate_report import EstimateRow
from ._heat_balance import heat_balance
from ._reproduce import transmission_table
from ._thermal_estimates import effective_fourier_number, effective_volume, fourier_parameter, penetration_depth


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
    split, source = b.power.split(b.work), "S-8…11"
    booked = (None, None, None) if b.run is None else b.booked.split(b.work)
    why = (
        "the run has shares of its own (`Scene.power_shares`)" if b.booked.heat < 1 else "in the run all of it is heat"
    )
    return [
        EstimateRow("work into heat", "share of heat × W", split.heat, "J", source, booked[0], why),
        EstimateRow("electrical work", "share of electricity × W", split.electrical, "J", source, booked[1], why),
        EstimateRow("mechanical work", "share of mechanical work × W", split.mechanical, "J", source, booked[2], why),
    ]


def depth_rows(b: Basis) -> list[EstimateRow]:
    """Penetration depth, Fourier numbers, effective volumes and parameter B of what the pair heats."""
    rows = []
    areas = [(b.part, b.metal_area), ("lining", b.face_area)]
    if not b.pair:
        areas.append(("band", b.lining_area))
    for part, area in areas:
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
    """Share of the heat into the rim (or band) by effusivities and by heat transmission, beside the run's."""
    simulated = None
    if b.run is not None and b.result is not None and b.scene.heated and b.run.total_work > 0:
        entered = b.result.energy.get("heat_to_band" if b.part == "band" else "heat_to_metal")
        if b.pair == "internal" and entered is not None:  # without what the external pair sends beyond the linings
            entered = entered - b.beyond_share * b.result.energy["heat_external"]
        simulated = None if entered is None else float(entered) / float(b.booked.split(b.run.total_work).heat)
    why = "the simulated share is of where the heat enters by the scene's own law, before bodies exchange any"
    effusivities = EstimateRow(
        f"share into the {b.part}, effusivities",
        "e_1/(e_1 + e_2)",
        float(effusivity_share(b.metal, b.lining)),
        "1",
        "Charron",
        simulated,
        why,
    )
    if b.part == "band":
        return [effusivities]
    K_1, K_2 = (float(np.asarray(K)) for K in transmission_table().transmissions(jnp.asarray(b.start_now)))
    stack = ([b.lining_thickness, b.band_thickness], [float(b.lining.conductivity), float(b.band.conductivity)])
    return [
        effusivities,
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


def contact_rows(b: Basis) -> list[EstimateRow]:
    """Real contact area, surfaces and their coefficient of radiation, gradient through the rim."""
    pressure = b.work / (b.friction * b.travel * b.face_area) if b.friction * b.travel > 0 else 0.0
    rows = []
    if 0 < pressure <= b.hardness:
        area = float(real_contact_area(b.face_area, pressure, b.hardness))
        rows += [
            EstimateRow("pressure, mean", "W/(f s A_l)", pressure, "Pa", "S-7"),
            EstimateRow("real contact area", "A_a p/HB", area, "m^2", "S-34"),
        ]
    if b.part == "band":
        return rows
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
    omega = b.travel / (b.arm * b.time)
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
