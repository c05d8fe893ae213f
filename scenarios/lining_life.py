"""How many emergency stops the linings last: uniform pitch, the layouts of Z, and a
band turned end for end.

Z (Zhuravlov et al.) level the work of the linings by their angles, and name the
practice of turning a worn band end for end. Here both are counted in brake
applications. The stop is that of u2_5_5_stop with 10 linings; `--hot` takes the stop of
equal_wear_layout, with the rim in layers, linings that heat individually, fade, and
wear that grows with temperature.
"""

import argparse
import dataclasses
import math
import pathlib
import runpy

import numpy as np

import simbrake as sb

# m, V
TRACK_RADIUS = 0.590
TRACK_WIDTH = 0.220
# m, V: lining FK-24A, brake band
THICKNESS = 0.030
BAND = 0.006
# Z: table 6
LININGS = 10
WRAP = math.radians(270.0)
FRICTION = 0.3
# m² of one lining; 75 % of the wrap is covered (S)
AREA = 0.75 * WRAP * TRACK_RADIUS * TRACK_WIDTH / LININGS
RATE = 1e-14  # m³/(N·m); assumption for FK-24A, cold
PERMISSIBLE = 8e-3  # m; assumption
TAKE_UP = 0.1  # m/s; assumption: speed of the band's end while the lever takes up slack


def scene() -> sb.Scene:
    """One stop with the uniform pitch, cold."""
    brake = sb.Brake(
        # kg·m²; assumption, as in u2_5_5_stop
        sb.Pulley(TRACK_RADIUS, inertia=1200.0, width=TRACK_WIDTH),
        # N/m; assumption: the linkage dominates
        sb.Band(TRACK_RADIUS + THICKNESS + BAND / 2, stiffness=1.0e5),
        sb.uniform_linings(LININGS, WRAP, sb.ConstantFriction(FRICTION), area=AREA),
    )
    duty = sb.Duty(
        # s, N; assumptions
        slack_tension=sb.PiecewiseLinear([0.0, 0.35], [2.0e3, 30.0e3]),
        # assumptions, as in u2_5_5_stop
        load=sb.HookLoad(mass=60.0e3, drum_radius=0.40, line_count=8),
    )
    wear = sb.Wear(
        RATE,
        permissible=PERMISSIBLE,
        thickness=THICKNESS,
        geometry=True,
        take_up_speed=TAKE_UP,
    )
    return sb.Scene(brake, duty, sb.Initial(omega=24.0), end_time=4.0, wear=wear)


def hot_scene() -> sb.Scene:
    """The same stop with heat: 60 % more wear for every 100 K above 150 °C, worn
    linings conduct and store less."""
    hot = runpy.run_path(str(sb.files.shipped("equal_wear_layout")))["scene"]()
    rate = sb.wear.LinearWear(RATE, slope=6e-3, reference=423.15)
    return dataclasses.replace(
        hot, wear=sb.Wear(rate, permissible=PERMISSIBLE, geometry=True, heat=True)
    )


def layouts() -> dict[str, np.ndarray]:
    """Angles (rad) of the layouts in closed form."""
    return {
        "Z, equal increments": np.asarray(
            sb.layouts.equal_increment_angles(FRICTION, LININGS, LININGS, WRAP).angle
        ),
        "equal loads": np.asarray(
            sb.layouts.equal_load_angles(FRICTION, LININGS, WRAP).angle
        ),
    }


def lives(one: sb.Scene) -> dict[str, sb.studies.LiningLife]:
    """The life with every layout, and with uniform pitch and the band turned at the
    best time."""
    found = {
        "uniform pitch": sb.lining_life(one),
        "uniform pitch, turned": sb.lining_life(one, turn_at="best"),
    }
    for name, angle in layouts().items():
        found[name] = sb.lining_life(
            sb.with_values(one, {"brake.linings.angle": angle})
        )
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--hot", action="store_true", help="with heat, fade and hot wear"
    )
    parser.add_argument("--out", type=pathlib.Path, help="folder for the figure")
    arguments = parser.parse_args()
    found = lives(hot_scene() if arguments.hot else scene())
    first = found["uniform pitch"]
    print(
        f"{'':22}{'stops':>10}{'gain':>8}{'max/mean':>10}{'max/min':>9}{'at the end':>12}{'used':>8}"
    )
    for name, life in found.items():
        print(
            f"{name:22}{life.brakings:10.0f}{life.brakings / first.brakings:8.3f}{life.over_mean[0]:10.3f}"
            f"{life.over_least[0]:9.3f}{life.over_least[-1]:12.3f}{100 * life.used:7.1f} %"
        )
    print(f"\nuniform pitch, turned end for end:\n{found['uniform pitch, turned']}")
    if arguments.out is not None:
        from simbrake import plot

        arguments.out.mkdir(parents=True, exist_ok=True)
        plot.wear(found).savefig(arguments.out / "wear.png", dpi=130)
        print(f"figure in {arguments.out}")


if __name__ == "__main__":
    main()
