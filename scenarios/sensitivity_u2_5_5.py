"""Sensitivities of a stop of a U2-5-5 drawworks: stopping time, maximum tension,
hottest lining, by every parameter.

The brake of `u2_5_5_stop.py` with three thermal lumps and friction that fades; values
not in the papers are marked as assumptions.
`python scenarios/sensitivity_u2_5_5.py --out DIR` also draws.
"""

import argparse
import math
import pathlib

import numpy as np

import simbrake as sb

METRICS = ["stopping_time", "max_tension", "peak_lining_temperature"]


def scene() -> sb.Scene:
    """The scene that `simbrake run` integrates."""
    track_radius = 0.590  # m, V table 1
    friction = sb.friction.ProductFriction(
        sb.ConstantFriction(0.35),  # assumption: FK-24A on steel, within Z's 0.1…0.5
        # 4 % per 100 K above 150 °C; assumption
        (sb.LinearFade(slope=4e-4, above=423.15, floor=0.1, blend=5.0),),
    )
    heat = sb.lumped_heat(
        rim=6.0e3,  # J/K; assumption: heated depth in a stop, 1.5 mm of the rim
        linings=2.0e3,  # J/K; assumption: some 0.9 mm of all linings
        band=1.9e4,  # J/K; assumption: 6 mm of steel
        lining_to_band=15.0,  # W/K; assumption: through 30 mm of lining
        rim_cooling=40.0,  # W/K; assumption
        band_cooling=10.0,  # W/K; assumption
        partition=sb.thermal.ConstantPartition(0.9),  # assumption: share of the metal
        permissible=673.15,  # K; assumption for FK-24A
        temperature=443.15,  # K; assumption: hot from the stands before
    )
    return sb.Scene(
        brake=sb.Brake(
            pulley=sb.Pulley(radius=track_radius, inertia=1200.0),  # kg·m²; assumption
            # m; N/m at the tight end, assumption
            band=sb.Band(radius=0.623, stiffness=1.0e5),
            linings=sb.uniform_linings(20, math.radians(270.0), friction),  # Z
        ),
        duty=sb.Duty(
            # s, N; assumptions
            slack_tension=sb.PiecewiseLinear([0.0, 0.35], [2.0e3, 24.0e3]),
            # assumptions, as in u2_5_5_stop
            load=sb.HookLoad(mass=60.0e3, drum_radius=0.40, line_count=8),
        ),
        initial=sb.Initial(omega=24.0),
        end_time=3.0,
        heat=heat,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--out", type=pathlib.Path, help="folder for the tornado charts"
    )
    folder = parser.parse_args().out

    base = scene()
    tables = sb.sensitivity(base, METRICS, span=0.05)
    for table in tables:
        print(f"{table}\n")

    print("the largest elasticities beside central differences of whole runs")
    for table in tables:
        for row in table.matters[:3]:
            path = row.path.removesuffix("[:]")
            p = np.asarray(
                next(leaf.value for leaf in sb.files.leaves(base) if leaf.path == path)
            )
            ends = [
                sb.simulate(sb.with_values(base, {path: p * (1 + s)}), rtol=1e-12)
                for s in (1e-4, -1e-4)
            ]
            high, low = (end.metrics[table.metric] for end in ends)
            assert high is not None
            assert low is not None
            difference = (high - low) / 2e-4 / table.value
            print(
                f"{table.metric:24} {row.path:42} {row.elasticity:12.8f} {difference:12.8f}"
            )
    if folder is not None:
        from simbrake import plot

        folder.mkdir(parents=True, exist_ok=True)
        for table in tables:
            file = folder / f"tornado_{table.metric}.png"
            plot.tornado(table).figure.savefig(file, dpi=130)
            print(f"written  {file}")


if __name__ == "__main__":
    main()
