"""Steps 8 and 9 of the synthesis: temperatures of the rim's layers, rational thickness, maximum temperature."""

import math

import numpy as np

from ._estimate_report import EstimateRow
from ._estimate_temperatures import temperature_rows
from ._rational_thickness import back_temperature, rational_lining_thickness, rational_rim_thickness
from ._synthesis_chain import Chain
from ._synthesis_report import SynthesisRow

#: depths, as shares of the rim's thickness, at which temperatures are told
_DEPTHS = ((0.0, "face"), (0.25, "1/4"), (0.5, "1/2"), (0.75, "3/4"), (1.0, "back"))
_SCHEME = "the scheme has no exchange with linings and air; constant properties; layers of another thickness"


def layer_rows(c: Chain) -> list[SynthesisRow]:
    """Step 8: temperatures over the rim by Schmidt's scheme, rational thickness of rim and lining."""
    return [*_course(c), *_rim(c), *_lining(c)]


def face_peak(c: Chain) -> float:
    """Greatest temperature of the rim's face by Schmidt's scheme (K)."""
    return float(np.max(c.schmidt.temperature[:, 0]))


def _course(c: Chain) -> list[SynthesisRow]:
    course, run, b = c.schmidt, c.after.layered, c.after
    heat = "the run's own heat" if b.run is not None else "falling power"
    given = [("a", float(b.rim.diffusivity), "m^2/s"), ("q", b.flux, "W/m^2"), ("N", float(course.depth.size - 2), "1")]
    peak = None if run is None or run.surface is None else float(np.max(run.surface))
    row = EstimateRow(
        "greatest face temperature", f"½ (t_{{j−1}} + t_{{j+1}}), {heat}", face_peak(c), "K", "S-28", peak, _SCHEME
    )
    rows = [SynthesisRow.of(8, row, *given)]
    end = [float(np.interp(b.time, course.t, column)) for column in course.temperature.T]
    for share, name in _DEPTHS:
        z = share * b.rim_thickness
        simulated = None if run is None else float(np.interp(z, run.profile_depth, run.profile[-1]))
        found = float(np.interp(z, course.depth, end))
        row = EstimateRow(f"rim at the end, {name}", "½ (t_{j−1} + t_{j+1})", found, "K", "S-28", simulated, _SCHEME)
        rows.append(SynthesisRow.of(8, row, ("x", z, "m")))
    drop = float(np.max(course.temperature[:, 0] - course.temperature[:, -1]))
    seen = None if run is None else float(np.max(run.profile[:, 0] - run.profile[:, -1]))
    row = EstimateRow("greatest drop over the rim", "t_1 − t_N over time", drop, "K", "S-29", seen, _SCHEME)
    return [*rows, SynthesisRow.of(8, row, ("δ", b.rim_thickness, "m"))]


def _rim(c: Chain) -> list[SynthesisRow]:
    """Thickness for this braking; for a duty of several, for the heat of all of them without cooling as well."""
    b, limit = c.after, c.limits["lining_permissible"]
    cases = [("braking", b.metal_heat / b.track_area, limit - c.start["rim"])]
    if b.run is not None and b.run.brakings > 1:
        cases.append(
            ("whole duty", b.share * float(b.power.heat) * b.run.total_work / b.track_area, limit - float(b.start))
        )
    a, time = ("a", float(b.rim.diffusivity), "m^2/s"), ("τ", b.time, "s")
    capacity = ("ρ c", _capacity(c), "J/(m^3*K)")
    rows, found = [], []
    for name, heat, rise in cases:
        found.append(rational_rim_thickness(b.rim, b.time, heat=heat, rise=rise))
        row = EstimateRow(f"thickness that holds the heat, {name}", "Q/(ρ c ΔT_p)", found[-1].storage, "m", "energy")
        rows.append(SynthesisRow.of(8, row, ("Q", heat, "J/m^2"), capacity, ("ΔT_p", rise, "K")))
    depth = EstimateRow(
        "thickness that heat reaches, rim", "1.73 √(a τ), Fo = 1/3", found[0].depth, "m", "S, steps 1, 2"
    )
    modelled = None if c.seen is None or c.seen.rim is None else float(c.seen.rim.wall.thickness)
    why = (
        "the run has the scene's thickness, which also carries load and wears; air and flange take heat in a long duty"
    )
    thickest = max(case.rational for case in found)
    rational = EstimateRow("rational thickness, rim", "greatest of these", thickest, "m", "S, step 8", modelled, why)
    numbers = [(f"δ, {name}", case.rational, "m") for (name, _, _), case in zip(cases, found, strict=True)]
    return [SynthesisRow.of(8, depth, a, time), *rows, SynthesisRow.of(8, rational, *numbers)]


def _lining(c: Chain) -> list[SynthesisRow]:
    """Thickness for this braking; for a duty of several, that which keeps the back cool over it as well."""
    b, back = c.after, c.limits["back_permissible"]
    a, limit = ("a", float(b.lining.diffusivity), "m^2/s"), ("T_p", back, "K")
    cases = [("braking", b.time, face_peak(c), c.lining_body)]
    if b.run is not None and b.run.brakings > 1:  # as if the rim had been as warm all the time
        warm = c.start["rim"] + b.metal_heat / (b.track_area * b.rim_thickness * _capacity(c))
        cases.append(("whole duty", float(b.run.t[-1]) - float(b.scene.initial.time), warm, float(b.start)))
    rows, numbers = [], []
    for name, time, face, start in cases:
        found = rational_lining_thickness(b.lining, time, face=face, back=back, start=start)
        if name == "braking":
            row = EstimateRow("thickness that heat reaches, lining", "1.73 √(a τ)", found.depth, "m", "S, steps 1, 2")
            rows.append(SynthesisRow.of(8, row, a, ("τ", time, "s")))
            numbers.append(("δ, heat reaches", found.depth, "m"))
        formula = "√(a τ/Fo_p), θ(Fo_p) = (T_p − T_0)/(T_f − T_0)"
        row = EstimateRow(
            f"thickness that keeps the back cool, {name}", formula, found.insulation, "m", "Carslaw & Jaeger §3.4"
        )
        rows.append(SynthesisRow.of(8, row, a, ("τ", time, "s"), ("T_f", face, "K"), limit, ("T_0", start, "K")))
        numbers.append((f"δ, {name}", found.insulation, "m"))
    course = None if c.seen is None else c.seen.lining
    modelled = None if course is None else float(course.wall.thickness)
    why = "the run has the scene's thickness, of which a part is there to wear"
    thickest = max(value for _, value, _ in numbers)
    rational = EstimateRow("rational thickness, lining", "greatest of these", thickest, "m", "S, step 8", modelled, why)
    return [*rows, SynthesisRow.of(8, rational, *numbers), lining_back(c)]


def _capacity(c: Chain) -> float:
    return float(c.after.rim.density * c.after.rim.specific_heat)


def lining_back(c: Chain) -> SynthesisRow:
    """Temperature of the lining's back after the braking, at the thickness it has."""
    b, start = c.after, c.lining_body
    found = back_temperature(b.lining, b.lining_thickness, b.time, face=face_peak(c), start=start)
    course = None if c.seen is None else c.seen.lining
    simulated = None if course is None else float(np.max(course.layers[:, -1]))
    row = EstimateRow(
        "lining's back after the braking",
        "T_0 + (T_f − T_0) θ(a τ/δ²)",
        found,
        "K",
        "Carslaw & Jaeger §3.4",
        simulated,
        "the formula starts from a lining of one temperature; the run's has what earlier brakings left",
    )
    numbers = [("T_0", start, "K"), ("T_f", face_peak(c), "K"), ("τ", b.time, "s"), ("δ", b.lining_thickness, "m")]
    return SynthesisRow.of(8, row, *numbers)


def maximum_rows(c: Chain) -> list[SynthesisRow]:
    """Step 9: maximum temperature in S's combinations, and where in the braking it comes."""
    b, run = c.after, c.after.layered
    by_name = {row.name: row for row in temperature_rows(b)}
    surface = by_name["surface temperature, falling flux"]
    flash = by_name.get("flash temperature, rise")
    t_s, t_v = surface.value - b.start_now, c.last.bulk["rim"] - c.start["rim"]
    start = ("T", b.start_now, "K")
    e = ("e", float(b.rim.effusivity), "W*s^0.5/(m^2*K)")
    rows = []
    if flash is not None:
        given = [start, ("t_s", t_s, "K"), ("t_v", t_v, "K"), ("t_f", flash.value, "K")]
        names = [f"maximum temperature, {kind}" for kind in ("S-26", "S-27", "sum")]
        rows += [SynthesisRow.of(9, by_name[name], *given) for name in names]
        spot = [("v", b.speed, "m/s"), ("f", b.friction, "1"), ("HB", b.hardness, "Pa"), ("l", b.spot_length, "m")]
        rows.append(SynthesisRow.of(9, flash, *spot))
    rows.append(SynthesisRow.of(9, surface, start, ("q_0", 2 * b.flux, "W/m^2"), ("τ", b.time, "s"), e))
    times = (None, None, None)
    if run is not None and run.surface is not None:
        i = int(np.argmax(run.surface))
        power = np.gradient(run.work, run.t)
        times = (
            float(run.t[i] - run.t[0]) / run.duration,
            float(power[i]) * run.duration / float(run.work[-1]),
            float(run.work[i] / run.work[-1]),
        )
    why = "the power does not fall linearly from the first moment"
    for name, formula, value, simulated in (
        ("relative time of the maximum", "τ/τ_T = 1/2, half-space under falling power", 0.5, times[0]),
        ("relative power then", "τ_N = 2 (1 − τ/τ_T)", 1.0, times[1]),
        ("relative work then", "τ_W = 2 τ/τ_T − (τ/τ_T)²", 0.75, times[2]),
    ):
        row = EstimateRow(name, formula, value, "1", "S, step 9", simulated, why)
        rows.append(SynthesisRow.of(9, row, ("τ_T", b.time, "s")))
    return [row for row in rows if math.isfinite(row.value)]
