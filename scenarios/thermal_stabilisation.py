"""Thermal stabilisation: repeated braking from cold until a cycle ends as it began, and
what flows where then.

`simbrake run` integrates one cycle from cold. Run as a script, it also computes the
cyclic steady state directly, repeats the cycle until all temperatures are near it, and
prints the heat flow into each part of the pulley, `∫ G (T_rim − T_part) dt` per cycle,
in the first cycle and in the steady state. S calls a brake stabilised when no heat
flows between rim and flange, the gradient between lining and rim is reversed, and the
exchange with the air is weak. Here the flow into the flange rises to five times that of
the first cycle, the linings become warmer than the rim, and all heat goes to the air.
Sources and assumptions as in the tripping scenario.
"""

import dataclasses
import math

import numpy as np

import simbrake as sb

PERIOD = 90.0  # s between brake applications; assumption
BANDS = 2


def heat() -> sb.Heat:
    """Rim, linings and band as lumps, and the structure of the pulley behind the
    rim."""
    track = BANDS * 2 * math.pi * 0.590 * 0.220  # m², V table 1
    steel = sb.material("steel_20L")
    lining = sb.material("FK-24A")
    band = sb.material("band_steel")
    lumps = sb.lumped_heat(
        # J/K; V: rim of 25 mm
        rim=float(steel.density * steel.specific_heat) * track * 0.025,
        # V: linings of 30 mm
        linings=float(lining.density * lining.specific_heat) * 0.75 * track * 0.030,
        # V: band of 6 mm
        band=float(band.density * band.specific_heat) * 0.75 * track * 0.006,
        partition=sb.thermal.EffusivityPartition(steel, lining),
        rim_cooling=25.0 * 2 * track,  # W/K; assumption: 25 W/(m²·K) inside and outside
        lining_to_band=float(lining.conductivity) * 0.75 * track / 0.030,
        band_cooling=10.0 * 0.75 * track,  # assumption
        permissible=273.15 + 250.0,  # K; assumption
    )
    return sb.thermal.with_pulley_structure(
        lumps, steel, rim_place="rim", inside=15.0, pulleys=BANDS
    )


def scene() -> sb.Scene:
    """One cycle: the driller brakes a turning pulley, which stops and is held until the
    next application."""
    return sb.Scene(
        brake=sb.Brake(
            pulley=sb.Pulley(radius=0.590, inertia=1200.0),
            # rigid: elasticity does not matter for the heat of a whole stop
            band=sb.Band(radius=0.623),
            linings=sb.uniform_linings(
                20, math.radians(270.0), sb.ConstantFriction(0.35)
            ),
        ),
        duty=sb.Duty(
            slack_tension=sb.ramp(2.0e3, 24.0e3, 0.0, 0.35),
            load=sb.HookLoad(mass=60.0e3, drum_radius=0.40, line_count=8),
        ),
        initial=sb.Initial(omega=24.0),
        end_time=PERIOD,
        heat=heat(),
    )


def temperature_integrals(probe):
    """Temperatures of all nodes, the integrand of every mean over the cycle."""
    return probe.flows.thermal.T


def course_of(run: sb.Result) -> tuple[dict[str, float], dict[tuple[str, str], float]]:
    """Mean temperature of each body over a run (K), and heat `∫ G (T_a − T_b) dt`
    through each link (J)."""
    duration = float(run.record.t_end)
    means = np.asarray(sb.results.integral(run, temperature_integrals)) / duration
    heat = run.scene.heat
    mean = dict(zip(run.nodes, means.tolist(), strict=True)) | {
        "air": float(heat.bodies[1].temperature)
    }
    flow = {}
    for link in heat.links:  # all of them have constant conductances
        G = float(
            link.conductance(mean[link.a], mean[link.b], sb.thermal.Surroundings())
        )
        flow[link.a, link.b] = G * (mean[link.a] - mean[link.b]) * duration
    return mean, flow


def report(title: str, run: sb.Result) -> None:
    """Print the means and flows of one cycle."""
    mean, flow = course_of(run)
    friction = float(run.energy["friction_heat"])
    lost = float(run.energy["heat_lost"])
    print(f"\n{title}: {friction / 1e3:.1f} kJ of friction heat")
    temperatures = ", ".join(
        f"{name} {T - 273.15:.1f} °C" for name, T in mean.items() if name != "air"
    )
    print(f"  mean temperatures: {temperatures}")
    for part in ("flange", "rebord_1", "rebord_2", "disc"):
        print(f"  rim to {part}: {flow['rim', part] / 1e3:.2f} kJ")
    warmer = "lining" if mean["linings"] > mean["rim"] else "rim"
    print(
        f"  lining minus rim: {mean['linings'] - mean['rim']:+.2f} K, the {warmer} is "
        "the warmer one"
    )
    print(
        f"  heat to the air: {lost / 1e3:.1f} kJ, {100 * lost / friction:.1f} % of the "
        "friction heat"
    )


def cycles_to(target: np.ndarray, band: float) -> int:
    """Cycles from cold until every temperature at the end of a cycle is within `band`
    (K) of the steady one."""
    here = scene()
    count = 0
    run = sb.prepare(here)
    while True:
        T = np.asarray(run(here).end_temperatures)
        count += 1
        if np.max(np.abs(T - target)) <= band:
            return count
        here = dataclasses.replace(
            here, heat=sb.results.with_temperatures(here.heat, T)
        )


def main() -> None:
    found = sb.cyclic_steady_state(scene())
    print(found.result)
    print(f"found with {found.cycles} cycles; change over a cycle {found.change:.1e} K")
    report("first cycle, from cold", sb.simulate(scene()))
    report("cyclic steady state", found.result)
    print()
    for band in (10.0, 5.0, 1.0):
        count = cycles_to(np.asarray(found.result.end_temperatures), band)
        print(
            f"within {band:g} K of it after {count} cycles, {count * PERIOD / 3600:.2f} h"
        )


if __name__ == "__main__":
    main()
