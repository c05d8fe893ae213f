"""Uncertainty of an emergency stop: a U2-5-5 with uncertain friction, load, lever,
speed and temperature at the start.

The brake of `u2_5_5_stop.py` with heat and fade.
`python scenarios/stopping_time_uncertainty.py` samples the uncertain parameters, prints
quantiles of stopping time, travel and temperature, the probabilities that the brake
does not stop in time, travels too far or exceeds the permissible temperature, and the
most influential parameters. `--out DIR` writes charts, the runs and the numbers as
JSON. Values not in the papers are marked as assumptions. A brake that grips hard stops
on the elastic band before all linings slide: it makes no friction heat at all.
"""

import argparse
import json
import math
from pathlib import Path

import simbrake as sb

TRACK_RADIUS = 0.590  # m, V table 1
TRACK_WIDTH = 0.220  # m, V
# m, V
LINING_THICKNESS = 0.030
BAND_THICKNESS = 0.006
# Z
LININGS = 20
WRAP = math.radians(270.0)
# lines strung, m to the rope; assumptions, as in u2_5_5_stop
LINES = 8
DRUM_RADIUS = 0.40
# both bands of the drawworks act as one: areas and tensions are sums over the two
BANDS = 2


def _heat() -> sb.Heat:
    steel = sb.material("steel_20L")
    lining = sb.material("FK-24A")
    return sb.layered_heat(
        rim=steel,
        rim_thickness=0.025,  # m, V table 1
        track_area=BANDS * 2 * math.pi * TRACK_RADIUS * TRACK_WIDTH,
        partition=sb.thermal.EffusivityPartition(steel, lining),
        rim_layers=12,
        rim_first=4e-4,  # m
        lining=lining,
        lining_thickness=LINING_THICKNESS,
        lining_area=BANDS * WRAP * TRACK_RADIUS * TRACK_WIDTH,
        lining_layers=16,
        lining_first=5e-5,  # m; the heat of one stop stays near the face
        inside=25.0,  # W/(m²·K); assumption
        outside=40.0,  # W/(m²·K); assumption
        permissible=673.15,  # K; assumption for FK-24A
    )


def scene() -> sb.Scene:
    """The scene with the central values of the uncertain parameters."""
    # fades by 4 % every 100 K above 150 °C (assumption)
    friction = sb.friction.ProductFriction(
        sb.ConstantFriction(0.50), (sb.LinearFade(4e-4, 423.15, 0.1, 0.01),)
    )
    return sb.Scene(
        brake=sb.Brake(
            # kg·m²; assumption
            pulley=sb.Pulley(TRACK_RADIUS, inertia=1200.0, width=TRACK_WIDTH),
            # N/m; assumption
            band=sb.Band(
                TRACK_RADIUS + LINING_THICKNESS + BAND_THICKNESS / 2, stiffness=3.0e5
            ),
            linings=sb.uniform_linings(LININGS, WRAP, friction),
        ),
        duty=sb.Duty(
            # s, N; assumptions, as in u2_5_5_stop
            slack_tension=sb.PiecewiseLinear([0.0, 0.35], [2.0e3, 24.0e3]),
            # kg; assumption
            load=sb.HookLoad(mass=60.0e3, drum_radius=DRUM_RADIUS, line_count=LINES),
        ),
        initial=sb.Initial(omega=24.0),  # rad/s: the hook at 1.2 m/s; assumption
        end_time=6.0,  # s: without a stop by then the string is lost
        heat=_heat(),
    )


def distributions() -> dict:
    """Independent distributions of the uncertain parameters (an assumption: heavy
    strings are lowered slower)."""
    from scipy import stats

    return {
        # Drumeanu & Antonescu 2003: 0.35…0.65 on brakes of drawworks; equal probability
        # of all values is an assumption
        "brake.linings.friction.base.coefficient": (0.35, 0.65),
        # 1/K; assumption: lining lots differ in fade
        "brake.linings.friction.factors[0].slope": (2e-4, 6e-4),
        # kg; assumption: 40…120 t, most often 60 t
        "duty.load.mass": stats.triang(0.25, 40e3, 80e3),
        # N; assumption: lever force of the driller
        "duty.slack_tension.values[1]": stats.truncnorm(-3, 3, 24e3, 3e3),
        # s; assumption: time to apply the lever
        "duty.slack_tension.times[1]": (0.25, 0.70),
        "initial.omega": (12.0, 32.0),  # rad/s; assumption: the hook at 0.6…1.6 m/s
        # K; assumption: linings, cold or after some stands
        "heat.bodies[2].temperature": (293.15, 523.15),
    }


def sobol_indices(
    given: sb.Scene, metrics: tuple, points: int
) -> dict[tuple[str, str], dict[str, float]]:
    """First-order and total indices of each metric by SALib, which
    `pip install 'simbrake[recipes]'` brings."""
    import numpy as np
    from SALib.analyze import sobol
    from SALib.sample import sobol as saltelli
    from scipy import stats

    drawn = distributions()
    run = sb.studies.evaluator(given, list(drawn), metrics)
    problem = {
        "num_vars": len(drawn),
        "names": run.names,
        "bounds": [(0.0, 1.0)] * len(drawn),
    }
    # SALib samples shares of the distributions: the numbers are their quantiles
    columns = saltelli.sample(problem, points, calc_second_order=False, seed=1).T
    frozen = [
        stats.uniform(d[0], d[1] - d[0]) if isinstance(d, tuple) else d
        for d in drawn.values()
    ]
    values = run.evaluate(
        np.stack(
            [d.ppf(column) for d, column in zip(frozen, columns, strict=True)], axis=1
        )
    )
    found = {}
    for name, y in zip(run.metrics, values.T, strict=True):
        analysis = sobol.analyze(problem, y, calc_second_order=False, seed=3)
        for kind in ("S1", "ST"):
            found[name, kind] = dict(
                zip(run.names, analysis[kind].tolist(), strict=True)
            )
    return found


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--out", type=Path, help="folder for charts, runs (CSV) and numbers (JSON)"
    )
    parser.add_argument(
        "--runs", type=int, default=1024, help="runs of the uncertainty"
    )
    parser.add_argument(
        "--points", type=int, default=128, help="base points of the Sobol indices"
    )
    asked = parser.parse_args()
    import jax.numpy as jnp
    import pandas as pd

    metrics = ("stopping_time", "hook_travel", "peak_lining_temperature")
    given = scene()
    found = sb.uncertainty(
        given,
        distributions(),
        metrics,
        asked.runs,
        # m; assumption: free height above the rotary table
        limits={"hook_travel": 1.5},
        quantiles=(0.05, 0.5, 0.95, 0.99),
        max_steps=512,
    )
    print(found)

    # indices need a number from every run: one that does not stop counts with the end
    # of the run
    def time_to_stop(result: sb.Result) -> "jnp.ndarray":
        return jnp.minimum(result.stopping_time, result.scene.end_time)

    shares = sobol_indices(
        given, (time_to_stop, "peak_lining_temperature"), asked.points
    )
    print("\nshares of the variance (Sobol), alone S1 and with interactions ST")
    print(pd.DataFrame(shares).to_string(float_format="{:.3f}".format))

    if asked.out is not None:
        from simbrake import plot

        asked.out.mkdir(parents=True, exist_ok=True)
        for name in metrics:
            plot.distribution(found, name).savefig(asked.out / f"{name}.png", dpi=120)
        found.data.to_dataframe().to_csv(asked.out / "runs.csv")
        both = {
            "uncertainty": found.as_dict(),
            "sobol": {" ".join(key): value for key, value in shares.items()},
        }
        (asked.out / "uncertainty.json").write_text(
            json.dumps(both, indent=2, allow_nan=False), "utf-8"
        )
        print(
            f"\nwritten to {asked.out}: "
            + ", ".join(sorted(file.name for file in asked.out.iterdir()))
        )


if __name__ == "__main__":
    main()
