"""Claims of V and S: resistance, overlap, partition, rejection and stabilisation."""

import math

import numpy as np
from claim import WRAP, ZERO, Found, Runs, claim, judged, of_each, scenario, stop

import simbrake as sb


@claim("V", "table 1", "flange and two rim lips double the thermal resistance of the pulley", fast=True)
def resistance(_: Runs) -> Found:
    k = 47.8  # W/(m·K), V: steel 20L
    shell = float(sb.thermal.axial_resistance(0.220, k, 0.565, 0.590))
    parts = ((0.420, 0.565, 0.035), (0.565, 0.615, 0.025), (0.575, 0.615, 0.025))  # flange, two rim lips
    behind = [float(sb.thermal.radial_resistance(width, k, r, R)) for r, R, width in parts]
    series, parallel = (shell + sum(behind)) / shell, 1 / (1 + shell * sum(1 / r for r in behind))
    text = (
        f"{series:.2f} times that of the shell if heat passes all of them one after the other, as V adds them; "
        f"as ways side by side behind one rim they lower it to {parallel:.3f}"
    )
    return Found(series, text, judged(abs(series - 2) < 0.1 and parallel > 1, abs(series - 2) < 0.1))


@claim(
    "V",
    "introduction",
    "the larger the overlap, the lower the frequency of heating and cooling",
    "equal lining length and speed",
    fast=False,
)
def frequency(_: Runs) -> Found:
    steel, found = sb.material("steel_20L"), []
    for n, share in ((6, 0.75), (10, 0.75), (10, 1.0)):
        of = stop(stiffness=None, angle=np.full(n, WRAP / 10))
        area = share * WRAP / 10 * 0.590 * 0.220
        result = sb.simulate(sb.with_values(of, {"brake.linings.area": area}))
        found.append(sb.formulas.track_ripple(result, [0.4], material=steel, share=0.9))
    kappa, rate = [r.overlap for r in found], [float(r.frequency[0] * r.period[0]) for r in found]
    high = [float(r.amplitude[0]) for r in found]
    text = (
        f"cycles per turn {of_each(rate, '.0f')} at overlaps {of_each(kappa)}: more linings of one length "
        "raise the frequency, "
        f"closing their gaps lowers it; amplitude {of_each(high, '.1f')} K"
    )
    return Found(rate[2] / rate[0], text, judged(rate[1] < rate[0] and rate[2] < rate[1], rate[2] < rate[1]))


@claim(
    "V",
    "introduction",
    "above 350 °C of the rim heat rejection must be taken into account",
    "stop of 0.8 MJ every 90 s",
    fast=True,
)
def rejected(_: Runs) -> Found:
    track, stored, pause = 2 * math.pi * 0.590 * 0.220, 0.8e6, 90.0

    def share(T: float) -> float:
        h = 25.0 + sb.formulas.radiation_coefficient(0.8, T, sb.thermal.ROOM)
        return 2 * track * h * (T - sb.thermal.ROOM) * pause / stored

    from scipy.optimize import brentq

    tenth = brentq(lambda T: share(T) - 0.1, 300.0, 900.0) - ZERO
    braking = share(ZERO + 350.0) / pause
    text = (
        f"at 350 °C {100 * share(ZERO + 350.0):.0f} % of a stop's heat leaves in the pause and "
        f"{100 * braking:.1f} % in a second of braking; "
        f"in the pause it passes 10 % at {tenth:.0f} °C already"
    )
    return Found(tenth, text, judged(250 < tenth < 450, share(ZERO + 350.0) > 0.1))


@claim(
    "V", "table 2, summary", "the metal's share of the heat grows from 0.531 to 0.756 between 100 and 450 °C", fast=True
)
def metal_share(_: Runs) -> Found:
    law = sb.formulas.transmission_table()
    share = [float(law.share(np.asarray(T + ZERO), np.asarray(T + ZERO))) for T in (100.0, 450.0)]
    charron = float(sb.thermal.effusivity_share(sb.material("steel_20L"), sb.material("FK-24A")))
    text = (
        f"{of_each(share, '.3f')} by $K_1/(K_1 + K_2)$ with V's coefficients; effusivities (Charron) give "
        f"{charron:.3f} at all of them"
    )
    return Found(share[1], text, judged(np.abs(np.asarray(share) - [0.531, 0.756]) < 2e-3))


# --- S ----------------------------------------------------------------------------------------------------------------


@claim("S", "heat load", "below the linings' permissible temperature convection governs, above it radiation", fast=True)
def governs(_: Runs) -> Found:
    low, high = (float(sb.formulas.radiation_coefficient(0.8, T + ZERO, sb.thermal.ROOM)) for T in (250.0, 400.0))
    text = (
        f"equal between 250 and 400 °C, where linings are permissible, for h from {low:.0f} to {high:.0f} "
        "W/(m²·K) at an "
        f"emissivity of 0.8; at 40 W/(m²·K) from {sb.thermal.radiation_governs_above(40.0, 0.8) - ZERO:.0f} °C on"
    )
    return Found(high, text, judged(low < 10 and high > 40, high > 10))


@claim("S", "stabilisation", "in the stabilised state no heat flows between the rim and its flange", "the same cycle")
def stabilisation(_: Runs) -> Found:
    module = scenario("thermal_stabilisation")
    cycle = module.scene()
    (G,) = (float(link.value) for link in cycle.network.links if getattr(link, "value", None) and link.b == "flange")

    def flow(result: sb.Result) -> float:
        t = np.linspace(0.0, float(cycle.end_time), 2001)
        T = dict(zip(result.nodes, np.asarray(result.series(t).temperature).T, strict=True))
        return float(np.trapezoid(G * (T["rim"] - T["flange"]), t))

    first, last = flow(sb.simulate(cycle)), flow(sb.cyclic_steady_state(cycle).result)
    text = (
        f"{first / 1e3:.1f} kJ in the first cycle from cold, {last / 1e3:.1f} kJ in the cyclic steady "
        "state: the flange goes on rejecting heat"
    )
    return Found(last / first, text, judged(last < 0.05 * first, last < first))


@claim("S", "after table 1", "in real braking the Fourier number does not exceed 15", fast=True)
def fourier(_: Runs) -> Found:
    a = float(sb.material("steel_20L").diffusivity)
    longest = {name: 15 * depth**2 / a for name, depth in (("rim", 0.025), ("band", 0.006))}
    of_stop = float(sb.formulas.fourier_number(a, 10.0, 0.025))
    text = (
        f"a stop of 10 s has {of_stop:.2f} in the rim of 25 mm; 15 is reached after {longest['rim']:.0f} "
        f"s there, {longest['band']:.0f} s in the band of 6 mm (drag)"
    )
    return Found(of_stop, text, judged(longest["band"] > 600, longest["rim"] > 60))


@claim("S", "heat balance", "in the serial brake a quarter of the polished track stays open", fast=True)
def open_track(_: Runs) -> Found:
    open_share = 1 - sb.results.geometric_overlap(scenario("staged_vs_standard").standard().brake)[1]
    text = f"{open_share:.3f} of the track for linings over all of a wrap of 270°; gaps between linings add to it"
    return Found(open_share, text, judged(abs(open_share - 0.25) < 0.02, open_share < 0.5))


@claim(
    "S", "stabilisation", "the temperature gradient in a lining is far above the least gradient in the rim", "one stop"
)
def gradients(runs: Runs) -> Found:
    result = runs.standard
    t = [0.5 * result.metrics["stopping_time"], result.metrics["stopping_time"]]
    T = np.asarray(result.series(t).temperature)
    found = {}
    for body in result.scene.heat.bodies:
        if isinstance(body, sb.thermal.Wall):
            at = [i for i, name in enumerate(result.nodes) if name.split("[")[0] == body.name]
            found[body.name] = np.abs(np.diff(T[:, at], axis=1) / np.diff(np.asarray(body.centres)))
    over = np.max(found["lining"], axis=1) / np.max(found["rim"], axis=1)
    text = (
        f"steepest in the lining over steepest in the rim {of_each(over, '.1f')} in the middle and at the "
        "end of a stop; the least in the rim is 0, at its back"
    )
    return Found(float(over[0]), text, judged(over > 1, over > 1))
