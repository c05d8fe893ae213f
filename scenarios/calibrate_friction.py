"""Calibration: friction, fade and heat capacity of a brake from speed, rim temperature
and event times of one stop.

`simbrake run` integrates the stop. Run as a script, it generates noisy measurements
from known parameters, writes these to CSV files and recovers the parameters by a fit.
**The measurements are synthetic**: a run of this model with seeded noise, no test of a
real brake. They show what such a test determines, and what not.
"""

import argparse
import csv
import math
import tempfile
from pathlib import Path

import numpy as np

import simbrake as sb

#: parameters of the synthetic brake; the scene has guesses before the test
PLANTED = {
    "brake.linings.friction.base.coefficient": 0.31,
    "brake.linings.friction.factors[0].slope": 1.4e-3,  # 1/K
    "heat.bodies[0].capacity": 2.6e4,  # J/K
}
BOUNDS = {
    "brake.linings.friction.base.coefficient": (0.15, 0.55),
    "brake.linings.friction.factors[0].slope": (0.0, 5.0e-3),
    "heat.bodies[0].capacity": (5.0e3, 2.0e5),
}
#: an underdetermined fit: forces and inertias, of which speeds and temperatures
#: determine only ratios
GREEDY = {
    "duty.slack_tension.values[0]": (1e3, 4e3),
    "duty.slack_tension.values[1]": (12e3, 48e3),
    "brake.pulley.inertia": (400.0, 3000.0),
    "duty.load.mass": (20e3, 120e3),
    "heat.bodies[0].capacity": (5.0e3, 2.0e5),
}
# rad/s, K, s; assumptions: encoder, thermocouple, clock
SPEED_NOISE = 0.15
TEMPERATURE_NOISE = 1.5
TIME_NOISE = 0.01


def scene() -> sb.Scene:
    """A stop of a lowered hook with a heated rim and friction that fades; parameters
    guessed before the test."""
    fading = sb.friction.ProductFriction(
        sb.ConstantFriction(0.35), (sb.LinearFade(slope=5e-4, above=293.15),)
    )
    return sb.Scene(
        brake=sb.Brake(
            pulley=sb.Pulley(radius=0.590, inertia=1200.0),
            # rigid: elasticity does not matter at the sampling rate of the speed
            band=sb.Band(radius=0.623),
            linings=sb.uniform_linings(20, math.radians(270.0), fading),
        ),
        duty=sb.Duty(
            slack_tension=sb.ramp(2.0e3, 24.0e3, 0.0, 0.35),
            load=sb.HookLoad(mass=60.0e3, drum_radius=0.40, line_count=8),
        ),
        initial=sb.Initial(omega=24.0),
        end_time=4.0,
        # assumptions: the outer 3 mm of the tracks take the heat of one stop, 80 % of
        # it; warm at the start
        heat=sb.lumped_heat(
            rim=2e4,
            partition=sb.thermal.ConstantPartition(0.8),
            rim_cooling=50.0,
            temperature=303.15,
        ),
    )


def measure(folder: Path, seed: int = 1) -> tuple[Path, Path]:
    """Write synthetic measurements, `series.csv` and `events.csv`, as a logger would:
    rpm, °C, milliseconds."""
    run = sb.simulate(sb.with_values(scene(), PLANTED))
    noise = np.random.default_rng(seed)
    t = np.linspace(0.05, 3.5, 70)
    s = run.series(t)
    speed = s.omega + SPEED_NOISE * noise.standard_normal(t.size)
    rim = np.asarray(s.rim_temperature)[
        :, 0
    ] + TEMPERATURE_NOISE * noise.standard_normal(t.size)
    stop = float(run.stopping_time) + TIME_NOISE * noise.standard_normal()
    folder.mkdir(parents=True, exist_ok=True)
    series = folder / "series.csv"
    events = folder / "events.csv"
    rpm = 60 / (2 * math.pi)
    with open(series, "w", encoding="utf-8", newline="") as file:
        file.write("# synthetic: a run of simbrake with noise, not a test of a brake\n")
        writer = csv.writer(file)
        writer.writerow(
            [
                "t [s]",
                "omega [rpm]",
                "omega_sigma",
                "rim_temperature [degC]",
                "rim_temperature_sigma",
            ]
        )
        for i in range(t.size):  # the thermocouple is read at every fifth sample
            cells = (
                [f"{rim[i] - 273.15:.3f}", TEMPERATURE_NOISE]
                if i % 5 == 0
                else ["", ""]
            )
            writer.writerow(
                [
                    f"{t[i]:.5f}",
                    f"{speed[i] * rpm:.4f}",
                    f"{SPEED_NOISE * rpm:.4f}",
                    *cells,
                ]
            )
    events.write_text(
        "# synthetic\nevent,time "
        f"[ms],sigma\nstopping_time,{1e3 * stop:.3f},{1e3 * TIME_NOISE:g}\n",
        "utf-8",
    )
    return series, events


def main() -> None:
    parser = argparse.ArgumentParser(
        description="fit a brake to synthetic measurements"
    )
    parser.add_argument("--out", type=Path, help="folder for the CSV files and a chart")
    folder = parser.parse_args().out
    with tempfile.TemporaryDirectory() as scratch:
        series, events = measure(folder or Path(scratch))
        data = sb.read_measured(series, events)
        print(
            "synthetic measurements (seeded noise on a run of this model, no test of a brake):"
        )
        print(data)
    fit = sb.calibrate(scene(), BOUNDS, data)
    print(f"\n{fit}\n\ntrue value, and deviation of the fit in its standard errors:")
    for path, planted in PLANTED.items():
        p = fit[path]
        print(
            f"  {path:<45} {planted:<8.6g} {p.unit:<4} "
            f"{(p.value - planted) / p.standard_error:+.2f}"
        )
    greedy = sb.calibrate(fit.scene, GREEDY, data)
    print(f"\nwith this friction, fit of every force and inertia at once:\n{greedy}")
    if folder is not None:
        import simbrake.plot

        simbrake.plot.calibration(fit).savefig(folder / "calibration.png", dpi=130)
        print(f"\nwritten: {series}, {events}, {folder / 'calibration.png'}")


if __name__ == "__main__":
    main()
