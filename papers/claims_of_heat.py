"""Claims of V and S: resistance, overlap, partition, rejection and stabilisation."""

import dataclasses
import math

import numpy as np
from claim import (
    WRAP,
    ZERO,
    Found,
    Runs,
    claim,
    judged,
    layers_of,
    of_each,
    scenario,
    stop,
)
from scipy.optimize import brentq

import simbrake as sb


@claim(
    "V",
    "table 1",
    "flange and two rim lips double the thermal resistance of the pulley",
    fast=True,
)
def resistance(_: Runs) -> Found:
    k = 47.8  # W/(m·K), V: steel 20L
    shell = float(sb.thermal.axial_resistance(0.220, k, 0.565, 0.590))
    # flange, two rim lips
    parts = ((0.420, 0.565, 0.035), (0.565, 0.615, 0.025), (0.575, 0.615, 0.025))
    behind = [
        float(sb.thermal.radial_resistance(width, k, r, R)) for r, R, width in parts
    ]
    series = (shell + sum(behind)) / shell
    parallel = 1 / (1 + shell * sum(1 / r for r in behind))
    text = (
        f"{series:.2f} times that of the shell if heat passes all of them one after "
        "the other, as V adds them; "
        f"as ways side by side behind one rim they lower it to {parallel:.3f}"
    )
    return Found(
        series,
        text,
        judged(abs(series - 2) < 0.1 and parallel > 1, abs(series - 2) < 0.1),
    )


@claim(
    "V",
    "introduction",
    "the larger the overlap, the lower the frequency of heating and cooling",
    "equal lining length and speed",
    fast=False,
)
def frequency(_: Runs) -> Found:
    steel = sb.material("steel_20L")
    found = []
    for n, share in ((6, 0.75), (10, 0.75), (10, 1.0)):
        of = stop(stiffness=None, angle=np.full(n, WRAP / 10))
        area = share * WRAP / 10 * 0.590 * 0.220
        result = sb.simulate(sb.with_values(of, {"brake.linings.area": area}))
        found.append(sb.formulas.track_ripple(result, [0.4], material=steel, share=0.9))
    kappa = [r.overlap for r in found]
    rate = [float(r.frequency[0] * r.period[0]) for r in found]
    high = [float(r.amplitude[0]) for r in found]
    text = (
        f"cycles per turn {of_each(rate, '.0f')} at overlaps {of_each(kappa)}: more "
        "linings of one length raise the frequency, closing their gaps lowers it; "
        f"amplitude {of_each(high, '.1f')} K"
    )
    return Found(
        rate[2] / rate[0],
        text,
        judged(rate[1] < rate[0] and rate[2] < rate[1], rate[2] < rate[1]),
    )


@claim(
    "V",
    "introduction",
    "above 350 °C of the rim heat rejection must be taken into account",
    "stop of 0.8 MJ every 90 s",
    fast=True,
)
def rejected(_: Runs) -> Found:
    track = 2 * math.pi * 0.590 * 0.220
    stored = 0.8e6
    pause = 90.0

    def share(T: float) -> float:
        h = 25.0 + sb.formulas.radiation_coefficient(0.8, T, sb.thermal.ROOM)
        return 2 * track * h * (T - sb.thermal.ROOM) * pause / stored

    tenth = brentq(lambda T: share(T) - 0.1, 300.0, 900.0) - ZERO
    braking = share(ZERO + 350.0) / pause
    text = (
        f"at 350 °C {100 * share(ZERO + 350.0):.0f} % of a stop's heat leaves in the pause and "
        f"{100 * braking:.1f} % in a second of braking; "
        f"in the pause it passes 10 % at {tenth:.0f} °C already"
    )
    return Found(tenth, text, judged(250 < tenth < 450, share(ZERO + 350.0) > 0.1))


@claim(
    "V",
    "table 2, summary",
    "the metal's share of the heat grows from 0.531 to 0.756 between 100 and 450 °C",
    fast=True,
)
def metal_share(_: Runs) -> Found:
    law = sb.formulas.transmission_table()
    share = [
        float(law.share(np.asarray(T + ZERO), np.asarray(T + ZERO)))
        for T in (100.0, 450.0)
    ]
    charron = float(
        sb.thermal.effusivity_share(sb.material("steel_20L"), sb.material("FK-24A"))
    )
    text = (
        f"{of_each(share, '.3f')} by $K_1/(K_1 + K_2)$ with V's coefficients; "
        f"effusivities (Charron) give {charron:.3f} at all of them"
    )
    return Found(
        share[1], text, judged(np.abs(np.asarray(share) - [0.531, 0.756]) < 2e-3)
    )


@claim(
    "V",
    "formula 4",
    "in an open brake heat parts between rim and linings by the coefficients of transmission",
    "rim, linings and band at one temperature; V's coefficients on their faces",
)
def open_brake(_: Runs) -> Found:
    law = sb.formulas.transmission_table()
    time = np.asarray([0.0, 600.0])
    track = 2 * math.pi * 0.590 * 0.220
    steel = sb.material("steel_20L")
    lining = sb.material("FK-24A")
    of_band = sb.material("band_steel")

    def shares(T: float) -> tuple[float, float]:
        """The rim's share of what is rejected in ten minutes, and that by the
        formula."""
        polished, matte, outer = (
            np.interp(T, law.temperature, a)
            for a in (law.alpha_1, law.alpha_2, law.alpha_3)
        )
        rim = sb.thermal.Wall("rim", steel, law.rim_thickness, track, 10, temperature=T)
        linings = sb.thermal.Wall(
            "lining", lining, law.lining_thickness, 0.75 * track, 16, temperature=T
        )
        band = sb.thermal.Lump(
            "band",
            of_band.density * of_band.specific_heat * 0.75 * track * law.band_thickness,
            T,
        )
        links = (
            sb.thermal.Convection("rim.front", track, polished),
            sb.thermal.Convection("rim.back", track, matte),
            sb.thermal.Convection("lining.front", 0.75 * track, polished),
            sb.thermal.ThermalContact("lining.back", "band", 0.75 * track),
            sb.thermal.Convection("band", 0.75 * track, outer),
        )
        heat = sb.Heat((rim, linings, band, sb.thermal.Reservoir("air")), links)
        fallen = T - np.asarray(sb.simulate_heat(heat, time).temperature)[-1]
        stored = [
            w.material.density * w.material.specific_heat * w.area * np.asarray(w.steps)
            for w in (rim, linings)
        ]
        lost = fallen * np.concatenate([*stored, [float(band.capacity)]])
        return float(np.sum(lost[: rim.layers]) / np.sum(lost)), float(
            law.share(np.asarray(T), np.asarray(T))
        )

    run, formula = np.asarray([shares(T + ZERO) for T in (100.0, 300.0, 450.0)]).T
    off = np.abs(run - formula)
    text = (
        f"the rim rejects {of_each(run, '.3f')} of the heat in ten minutes from 100, "
        f"300, 450 °C, by the formula {of_each(formula, '.3f')}"
    )
    return Found(float(np.max(off)), text, judged(off < 0.05, off < 0.05))


@claim(
    "V",
    "after formula 4",
    "the thermal model of the band-shoe brake holds for a drum-shoe brake",
    "one network, inertia, speed and stopping time",
)
def drum(_: Runs) -> Found:
    heat = sb.lumped_heat(rim=8e4, linings=6e3, partition=0.9, rim_cooling=40.0)
    band = dataclasses.replace(stop(stiffness=None), heat=heat)
    first = sb.simulate(band)
    lined = sb.Shoes(
        0.35,
        radius=0.565,
        width=0.220,
        start=math.radians(20.0),
        end=math.radians(130.0),
    )
    shoes = sb.ShoeBrake(band.brake.pulley.inertia, lined, pin=0.46, arm=0.80)

    def braked(force: float) -> sb.Result:
        duty = sb.ForceDuty(sb.ramp(0.1 * force, force, 0.0, 0.35), band.duty.load)
        return sb.simulate(sb.Scene(shoes, duty, band.initial, end_time=8.0, heat=heat))

    def late(force: float) -> float:
        taken = braked(force).metrics.get("stopping_time")
        return (
            8.0 if taken is None or not np.isfinite(taken) else taken
        ) - first.metrics["stopping_time"]

    second = braked(brentq(late, 2e4, 3e5, rtol=1e-6))
    rise = [
        r.metrics["peak_rim_temperature"] - sb.thermal.ROOM for r in (second, first)
    ]
    work = [np.asarray(sb.results.friction_work(r)) for r in (second, first)]
    text = (
        f"the rim warms by {rise[0]:.2f} K in a drum with two shoes, by {rise[1]:.2f} "
        "K under a band; the most loaded lining takes "
        f"{np.max(work[0]) / np.min(work[0]):.2f} times the heat of the least loaded "
        f"one, under the band {np.max(work[1]) / np.min(work[1]):.2f} times"
    )
    ratio = rise[0] / rise[1]
    return Found(ratio, text, judged(abs(ratio - 1) < 0.02, abs(ratio - 1) < 0.1))


# --- S ------------------------------------------------------------------------------


@claim(
    "S",
    "heat load",
    "below the linings' permissible temperature convection governs, above it radiation",
    fast=True,
)
def governs(_: Runs) -> Found:
    low, high = (
        float(sb.formulas.radiation_coefficient(0.8, T + ZERO, sb.thermal.ROOM))
        for T in (250.0, 400.0)
    )
    text = (
        "equal between 250 and 400 °C, where linings are permissible, for h from "
        f"{low:.0f} to {high:.0f} W/(m²·K) at an emissivity of 0.8; at 40 W/(m²·K) "
        f"from {sb.thermal.radiation_governs_above(40.0, 0.8) - ZERO:.0f} °C on"
    )
    return Found(high, text, judged(low < 10 and high > 40, high > 10))


@claim(
    "S",
    "stabilisation",
    "in the stabilised state no heat flows between the rim and its flange",
    "the same cycle",
)
def stabilisation(_: Runs) -> Found:
    module = scenario("thermal_stabilisation")
    cycle = module.scene()
    (G,) = (
        float(link.value)
        for link in cycle.network.links
        if getattr(link, "value", None) and link.b == "flange"
    )

    def flow(result: sb.Result) -> float:
        t = np.linspace(0.0, float(cycle.end_time), 2001)
        T = dict(
            zip(result.nodes, np.asarray(result.series(t).temperature).T, strict=True)
        )
        return float(np.trapezoid(G * (T["rim"] - T["flange"]), t))

    first = flow(sb.simulate(cycle))
    last = flow(sb.cyclic_steady_state(cycle).result)
    text = (
        f"{first / 1e3:.1f} kJ in the first cycle from cold, {last / 1e3:.1f} kJ in "
        "the cyclic steady state: the flange goes on rejecting heat"
    )
    return Found(last / first, text, judged(last < 0.05 * first, last < first))


@claim(
    "S",
    "after table 1",
    "in real braking the Fourier number does not exceed 15",
    fast=True,
)
def fourier(_: Runs) -> Found:
    a = float(sb.material("steel_20L").diffusivity)
    longest = {
        name: 15 * depth**2 / a for name, depth in (("rim", 0.025), ("band", 0.006))
    }
    of_stop = float(sb.formulas.fourier_number(a, 10.0, 0.025))
    text = (
        f"a stop of 10 s has {of_stop:.2f} in the rim of 25 mm; 15 is reached after "
        f"{longest['rim']:.0f} "
        f"s there, {longest['band']:.0f} s in the band of 6 mm (drag)"
    )
    return Found(of_stop, text, judged(longest["band"] > 600, longest["rim"] > 60))


@claim(
    "S",
    "heat balance",
    "in the serial brake a quarter of the polished track stays open",
    fast=True,
)
def open_track(_: Runs) -> Found:
    open_share = (
        1
        - sb.results.geometric_overlap(scenario("staged_vs_standard").standard().brake)[
            1
        ]
    )
    text = (
        f"{open_share:.3f} of the track for linings over all of a wrap of 270°; "
        "gaps between linings add to it"
    )
    return Found(
        open_share, text, judged(abs(open_share - 0.25) < 0.02, open_share < 0.5)
    )


def steepest(result: sb.Result, t: np.ndarray, name: str) -> np.ndarray:
    """Steepest gradient (K/m) over the depth of a wall."""
    T, depth = layers_of(result, t, name)
    return np.max(np.abs(np.diff(T, axis=1) / np.diff(depth)), axis=1)


@claim(
    "S",
    "stabilisation",
    "the temperature gradient in a lining is far above the least gradient in the rim",
    "one stop",
)
def gradients(runs: Runs) -> Found:
    result = runs.standard
    t = [0.5 * result.metrics["stopping_time"], result.metrics["stopping_time"]]
    over = steepest(result, np.asarray(t), "lining") / steepest(
        result, np.asarray(t), "rim"
    )
    text = (
        f"steepest in the lining over steepest in the rim {of_each(over, '.1f')} in "
        "the middle and at the end of a stop; the least in the rim is 0, at its back"
    )
    return Found(float(over[0]), text, judged(over > 1, over > 1))


@claim(
    "S",
    "stabilisation",
    "heat flows from the linings back to the rim, where the gradient in the lining is "
    "the steeper one",
    "one stop of 80 t and a minute after it, linings on the rim",
)
def inversion(runs: Runs) -> Found:
    result = runs.heavy
    t = np.linspace(0.0, 60.0, 6001)[1:]
    lining, rim = (layers_of(result, t, name)[0][:, 0] for name in ("lining", "rim"))
    back = lining > rim
    steeper = steepest(result, t, "lining") > steepest(result, t, "rim")
    (link,) = (
        one
        for one in result.scene.heat.links
        if getattr(one, "b", "") == "lining.front"
    )
    flow = float(link.area) / float(link.resistance) * (lining - rim)
    heat = float(np.trapezoid(np.maximum(flow, 0.0), t))
    share = heat / float(result.energy["heat_to_linings"])
    (start, end) = t[back][[0, -1]]
    peak = int(np.argmax(lining))
    text = (
        f"linings are the hotter ones from {start:.2f} to {end:.1f} s, at most "
        f"{lining[peak] - ZERO:.1f} against "
        f"{rim[peak] - ZERO:.1f} °C; {100 * share:.0f} % of their heat flow back, by "
        "conduction alone; the gradient in "
        f"them is the steeper one for {100 * np.mean(steeper[back]):.0f} % of that time"
    )
    return Found(
        share, text, judged(np.all(steeper[back]) and share > 0.05, share > 0.05)
    )


@claim(
    "S",
    "heat load",
    "the burn-off of binder is an endothermic reaction that takes little heat",
    "stop of 80 t; all that wears off decomposes",
)
def burn_off(runs: Runs) -> Found:
    # share of mass, J/kg of phenolic resin: assumptions
    binder = 0.2
    enthalpy = 1.5e6
    result = runs.heavy
    lining = sb.formulas.lining_material("FK-24A")
    depth = np.asarray(sb.results.lining_wear(result, lining.wear))
    mass = float(lining.thermal.density) * float(
        np.sum(depth * np.asarray(result.scene.brake.linings.area))
    )
    share = mass * binder * enthalpy / float(result.energy["heat_to_linings"])
    hotter = float(
        lining.wear(0.0, 0.0, ZERO + 600.0) / lining.wear(0.0, 0.0, ZERO + 100.0)
    )
    text = (
        f"{100 * share:.2g} % of the heat of the linings, {100 * share * hotter:.2g} % "
        "with the wear of 600 °C; the package has no such sink"
    )
    return Found(share * hotter, text, judged(share * hotter < 0.05, share < 0.05))
