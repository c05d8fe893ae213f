"""Steps 10 to 12 of the synthesis: heat balance, thermal stress, operating characteristics and permissible limits."""

import dataclasses
import math

import numpy as np

from .._parts._scene import band_brake
from .._run._measure import LimitVerdict
from .._run._series import Series
from ._estimate_basis import Basis
from ._estimate_report import EstimateRow
from ._estimate_rows import balance_rows, contact_rows, stop_rows
from ._estimate_temperatures import stress_rows
from ._synthesis_chain import Chain
from ._synthesis_layers import face_peak, lining_back
from ._synthesis_report import SynthesisRow

_FACE = "the run's is the hottest lining's face, which contact resistance and unequal work leave hotter than the rim's"


def balance_steps(c: Chain) -> list[SynthesisRow]:
    """Step 10: what the rim takes up in the braking, and S's balance over four revolutions."""
    b, rim = c.after, None if c.seen is None else c.seen.rim
    kept = None if rim is None else float(rim.content[-1] * float(rim.wall.area) * rim.wall.copies)
    why = "linings, flange and air take from the rim, or give to it, while it is braked"
    row = EstimateRow("heat into the rim", "α W", b.metal_heat, "J", "S-18", kept, why)
    rows = [SynthesisRow.of(10, row, ("α", b.share, "1"), ("W", b.heat, "J"))]
    found = {row.name: row for row in balance_rows(b)}
    if not found:
        return rows
    time, gained = _revolutions(c)
    flux = None if kept is None else kept / (b.track_area * b.time)
    omega = b.travel / (float(band_brake(b.scene).band.radius) * b.time)
    kappa, h = ("κ", b.overlap, "1"), ("h", b.coefficient, "W/(m^2*K)")
    air = [("ε", b.emissivity, "1"), ("T", b.start_now, "K"), ("T_a", b.ambient, "K")]
    q = ("q_1", b.flux / b.overlap, "W/m^2")
    first = "the first four revolutions are faster than the mean, and their power is another"
    for name, simulated, reason, numbers in (
        ("overlap coefficient", None, "", [("A_l", b.lining_area, "m^2"), ("A_a", b.track_area, "m^2")]),
        ("time of four revolutions", time, first, [("n", 4.0, "1"), ("ω", omega, "rad/s")]),
        ("heat gained in it", gained, first, [q, ("A_a", b.track_area, "m^2"), kappa]),
        ("heat given away in it", None, "", [h, *air, kappa]),
        ("mean flux kept", flux, why, [q, kappa, h, *air]),
    ):
        changed = dataclasses.replace(found[name], simulated=simulated, why=reason)
        rows.append(SynthesisRow.of(10, changed, *numbers))
    return rows


def _revolutions(c: Chain) -> tuple[float | None, float | None]:
    """Time (s) of the first four revolutions of the simulated braking, and heat into the rim (J) in them."""
    b, run = c.after, c.after.run
    if run is None:
        return None, None
    angle = np.concatenate([[0.0], np.cumsum(0.5 * np.abs(run.omega[1:] + run.omega[:-1]) * np.diff(run.t))])
    if angle[-1] < 8 * math.pi:
        return None, None  # it comes to rest before
    time = float(np.interp(8 * math.pi, angle, run.t))
    return time - float(run.t[0]), b.share * float(b.power.heat) * float(np.interp(time, run.t, run.work))


def stress_steps(c: Chain) -> list[SynthesisRow]:
    """Step 11: thermal stress of the rim and the gradient that makes it."""
    b, run = c.after, c.after.layered
    elastic = b.elastic
    constants = [("E", elastic.young, "Pa"), ("α_T", elastic.expansion, "1/K"), ("ν", elastic.poisson, "1")]
    heated = [("q", b.flux, "W/m^2"), ("τ", b.time, "s"), ("δ", b.rim_thickness, "m")]
    limit = [("σ_p", elastic.permissible, "Pa")]
    more = {"stress over permissible": limit, "time of greatest stress": []}
    rows = [SynthesisRow.of(11, row, *more.get(row.name, [*constants, *heated])) for row in stress_rows(b)]
    steepest = None
    if run is not None and run.surface is not None and run.layers is not None and run.depth is not None:
        steepest = float(np.max((run.surface - run.layers[:, 0]) / run.depth[0]))
    conductivity = float(b.rim.conductivity)
    row = EstimateRow(
        "greatest gradient at the face",
        "2 q/λ: falling power at first",
        2 * b.flux / conductivity,
        "K/m",
        "S-23",
        steepest,
        "the power is not that of a linear fall, and the covered track takes more than the mean",
    )
    return [*rows, SynthesisRow.of(11, row, ("q", b.flux, "W/m^2"), ("λ", conductivity, "W/(m*K)"))]


def operating_rows(c: Chain) -> list[SynthesisRow]:
    """Step 12: stop, tensions, friction work, travel, load by energy, and the permissible limits."""
    rows = [*_stop(c), *_load(c)]
    return rows + _limits(c, {row.name: row for row in rows})


def _stop(c: Chain) -> list[SynthesisRow]:
    b, stop, run = c.before, c.stop, c.before.run
    if stop is None:  # a lever that holds the speed, a load that outweighs the brake: no stop by statics
        torque = b.work * float(band_brake(b.scene).band.radius) / b.travel if b.travel > 0 else math.nan
        mean = EstimateRow("mean brake torque", "W/φ", torque, "N*m", "energy")
        work = EstimateRow("friction work", "of the braking", b.work, "J", "run")
        found = [SynthesisRow.of(12, mean, ("W", b.work, "J")), SynthesisRow.of(12, work, ("τ", b.time, "s"))]
        return [row for row in found if math.isfinite(row.value)]
    rows = {row.name: row for row in stop_rows(dataclasses.replace(b, stop=stop))}
    if run is not None and run.brakings > 1:
        rows = _of_braking(b, rows)
    scene, duty = b.scene, b.scene.duty
    T_0, R_b = float(duty.lever.scale()), float(band_brake(scene).band.radius)
    fz = [("f", b.friction, "1"), ("n", float(scene.brake.linings.count), "1")]
    omega = ("ω_0", b.omega, "rad/s")
    numbers = {
        "tension ratio": fz,
        "brake torque": [("R_b", R_b, "m"), ("T_0", T_0, "N"), ("Π", stop.ratio, "1")],
        "stopping time": [omega, ("M_b", stop.torque, "N*m")],
        "stopping angle": [omega, ("t", stop.time, "s")],
        "friction work": [("M_b", stop.torque, "N*m"), ("φ", stop.angle, "rad")],
        "friction power at first": [("M_b", stop.torque, "N*m"), omega],
    }
    first = [SynthesisRow.of(12, rows[name], *numbers[name]) for name in ("stopping time", "brake torque")]
    rest = [SynthesisRow.of(12, row, *numbers.get(name, [])) for name, row in rows.items()]
    return first + [row for row in rest if row.name not in ("stopping time", "brake torque")] + _ends(c, T_0, rows)


def _of_braking(b: Basis, rows: dict[str, EstimateRow]) -> dict[str, EstimateRow]:
    """Rows of a stop with what the run shows over its hardest braking alone."""
    run, result = b.run, b.result
    assert run is not None
    assert result is not None
    begin, end = float(run.t[0]), float(run.t[-1])
    rests = [e.time for e in result.events if e.name == "stop" and e.time >= end - 1e-9 * max(end, 1.0)]
    time = rests[0] - begin if rests and rests[0] - end < run.duration else None  # not the rest after another braking
    angle = None
    if time is not None:
        phi = np.asarray(result.series(np.array([begin, begin + time])).phi)
        angle = float(phi[1] - phi[0])
    shown = {"stopping time": time, "stopping angle": angle, "friction work": float(run.work[-1])}
    return {name: dataclasses.replace(row, simulated=shown.get(name, row.simulated)) for name, row in rows.items()}


def _ends(c: Chain, T_0: float, rows: dict[str, EstimateRow]) -> list[SynthesisRow]:
    """Tensions of both ends of the band, and the ways of linings and hook."""
    b, stop, seen = c.before, c.stop, c.seen
    assert stop is not None
    ratio, angle = stop.ratio, rows["stopping angle"].simulated
    R_b, load = float(band_brake(b.scene).band.radius), b.scene.duty.load
    slack = None if seen is None else float(np.max(np.asarray(seen.series.slack_tension)))
    tight = None if seen is None else float(np.max(np.asarray(seen.series.tight_tension)))
    slid = "as the stopping angle; a band that is stretched meanwhile slides less"
    why = "the band holds against the load, is stretched before it slides, and hot linings rub less"
    way = None if seen is None else _slid(seen.series)
    found = [
        SynthesisRow.of(12, EstimateRow("slack tension, greatest", "T_0 of the lever", T_0, "N", "", slack, why)),
        SynthesisRow.of(
            12,
            EstimateRow("tight tension, greatest", "Π T_0", ratio * T_0, "N", "Z-14", tight, why),
            ("Π", ratio, "1"),
            ("T_0", T_0, "N"),
        ),
        SynthesisRow.of(
            12,
            EstimateRow("friction travel", "R_b φ", R_b * stop.angle, "m", "", way, slid),
            ("R_b", R_b, "m"),
            ("φ", stop.angle, "rad"),
        ),
    ]
    drum, lines = (getattr(load, name, None) for name in ("drum_radius", "line_count"))
    if drum is not None and lines is not None:
        per = float(drum) / float(lines)
        hook = None if angle is None else per * float(angle)
        row = EstimateRow("hook travel", "r_d φ/n", per * stop.angle, "m", "", hook, "as the stopping angle")
        found.append(SynthesisRow.of(12, row, ("r_d", float(drum), "m"), ("n", float(lines), "1")))
    return found


def _load(c: Chain) -> list[SynthesisRow]:
    """Energy and power of friction per area of the linings, and their mean pressure."""
    b, stop, run = c.before, c.stop, c.before.run
    work, time = (b.work, b.time) if stop is None else (stop.work, stop.time)
    simulated = (None, None) if run is None else (b.work / b.lining_area, b.work / (b.lining_area * b.time))
    why = "as friction work and stopping time"
    area = ("A_l", b.lining_area, "m^2")
    energy = EstimateRow("energy load of the linings", "W/A_l", work / b.lining_area, "J/m^2", "S-7", simulated[0], why)
    power = work / (b.lining_area * time)
    mean = EstimateRow("power load of the linings, mean", "W/(A_l τ)", power, "W/m^2", "S-7", simulated[1], why)
    rows = [
        SynthesisRow.of(12, energy, ("W", work, "J"), area),
        SynthesisRow.of(12, mean, ("W", work, "J"), area, ("τ", time, "s")),
    ]
    for row in contact_rows(b):
        if row.name == "pressure, mean":
            shown = None if c.seen is None else _pressure(c.seen.series) / b.lining_area
            reason = (
                "the formula leaves out the angle at which the band leaves a lining, and takes friction as at first"
            )
            changed = dataclasses.replace(row, simulated=shown, why=reason)
            rows.append(SynthesisRow.of(12, changed, ("W", b.work, "J"), ("s", b.travel, "m"), area))
    return rows


def _slid(s: Series) -> float:
    """Way of the linings on the track (m)."""
    return float(np.trapezoid(np.abs(np.asarray(s.slip_speed)), np.asarray(s.t)))


def _pressure(s: Series) -> float:
    """Normal load of all linings (N), mean over the way that they slide."""
    loads, way = np.asarray(s.normal_load).sum(axis=1), np.abs(np.asarray(s.slip_speed))
    return float(np.trapezoid(loads * way, np.asarray(s.t)) / _slid(s))


def _limits(c: Chain, rows: dict[str, SynthesisRow]) -> list[SynthesisRow]:
    """What is left up to each permissible value, by the estimate and by the run."""
    by_stress = {row.name: row for row in stress_rows(c.after)}["thermal stress, surface"]
    back, run = lining_back(c), c.seen
    stress = None if by_stress.simulated is None else abs(by_stress.simulated)
    looked = [
        (
            "face of the linings",
            "lining_permissible",
            "T_p − T_max",
            face_peak(c),
            None if run is None else run.face,
            "K",
        ),
        ("back of the linings", "back_permissible", "T_p − T_back", back.value, back.simulated, "K"),
        ("stress of the rim", None, "σ_p − |σ|", abs(by_stress.value), stress, "Pa"),
    ]
    for name, limit, row in (
        ("pressure", "pressure_permissible", rows.get("pressure, mean")),
        ("power load", "power_permissible", rows.get("power load of the linings, mean")),
    ):
        if limit in c.limits and row is not None:
            looked.append((name, limit, "permissible − mean", row.value, row.simulated, row.unit))
    found = []
    for name, limit, formula, value, simulated, unit in looked:
        permissible = c.after.elastic.permissible if limit is None else c.limits[limit]
        left, shown = permissible - value, None if simulated is None else permissible - simulated
        why = _FACE if limit == "lining_permissible" else "as the figure that it is the margin of"
        row = EstimateRow(f"margin, {name}", formula, left, unit, "S, step 12", shown, why)
        numbers = [("permissible", permissible, unit), ("found", value, unit)]
        found.append(SynthesisRow.of(12, row, *numbers, verdict=_verdict(left, shown)))
    return found


def _verdict(left: float, shown: float | None) -> str:
    """Within limit or exceeded by the estimate, and what the run says where that is something else."""
    by_estimate, by_run = (
        None if margin is None else LimitVerdict.WITHIN if margin >= 0 else LimitVerdict.EXCEEDED
        for margin in (left, shown)
    )
    return f"{by_estimate}" if by_run in (None, by_estimate) else f"{by_estimate}, in the run {by_run}"
