"""Lining angles for equal wear over a heated stop with fade, beside the uniform pitch
and the layouts of Z.

Z (Zhuravlov et al.) level the tension increments of linings at full slip with one
coefficient of friction. In a stop each lining heats individually: those with more
friction work fade more, and hot linings wear faster. Equal wear of equal linings then
needs other angles, which the simulation finds with its own derivatives. Geometry from V
(Volchenko et al.); other values are marked as assumptions.
"""

import argparse
import math
import pathlib

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import simbrake as sb

# m, V
TRACK_RADIUS = 0.590
TRACK_WIDTH = 0.220
# m, V: lining FK-24A, brake band
THICKNESS = 0.030
BAND = 0.006
# Z: tables 5 and 6
LININGS = 10
WRAP = math.radians(270.0)
# share of the wrap that linings cover (S); they are equal, so that angles are pitches
COVERED = 0.75
AREA = COVERED * WRAP * TRACK_RADIUS * TRACK_WIDTH / LININGS  # m² of one lining
FRICTION = 0.3  # Z, table 6
STEEL = sb.material("steel_20L")
LINING = sb.material("FK-24A")


class HotWear(eqx.Module):
    """Wear rate that grows with the surface temperature,
    `I = I_0 (1 + s max(T − T_w, 0))`."""

    rate: jax.Array
    slope: jax.Array
    above: jax.Array

    def __call__(self, p, v, T):
        return self.rate * (1 + self.slope * jnp.maximum(T - self.above, 0.0))


def wear_rate(slope: float = 6e-3) -> HotWear:
    """1e-14 m³/(N·m) cold, 60 % more for every 100 K above 150 °C; both are assumptions
    for FK-24A."""
    return HotWear(jnp.asarray(1e-14), jnp.asarray(slope), jnp.asarray(423.15))


def scene() -> sb.Scene:
    """The stop with the uniform pitch."""
    friction = sb.friction.ProductFriction(
        sb.ConstantFriction(FRICTION),
        # 8 % less for every 100 K above 150 °C, not below a third; assumption
        (sb.LinearFade(slope=8e-4, above=423.15, floor=0.33),),
    )
    brake = sb.Brake(
        # kg·m²; assumption, as in u2_5_5_stop
        sb.Pulley(TRACK_RADIUS, inertia=1200.0, width=TRACK_WIDTH),
        # N/m; assumption: the linkage dominates
        sb.Band(TRACK_RADIUS + THICKNESS + BAND / 2, stiffness=1.0e5),
        sb.uniform_linings(LININGS, WRAP, friction, area=AREA),
    )
    heat = sb.layered_heat(
        rim=STEEL,
        rim_thickness=0.025,  # m, V table 1
        track_area=2 * math.pi * TRACK_RADIUS * TRACK_WIDTH,
        partition=sb.thermal.EffusivityPartition(STEEL, LINING),
        rim_layers=6,
        rim_first=1.5e-3,  # m
        lining=LINING,
        lining_thickness=THICKNESS,
        lining_area=LININGS * AREA,
        lining_layers=14,
        lining_first=2e-4,  # m; the heat of one stop stays near the face
        each=LININGS,
        inside=25.0,  # W/(m²·K); assumption
        outside=40.0,  # W/(m²·K); assumption
        temperature=433.15,  # K; assumption: warm from the brake applications before
    )
    duty = sb.Duty(
        # s, N; assumptions
        slack_tension=sb.PiecewiseLinear([0.0, 0.35], [2.0e3, 30.0e3]),
        # assumptions, as in u2_5_5_stop
        load=sb.HookLoad(mass=60.0e3, drum_radius=0.40, line_count=8),
    )
    return sb.Scene(brake, duty, sb.Initial(omega=24.0), end_time=3.0, heat=heat)


def end_ratio() -> float:
    """Load of the running-on lining over that of the running-off one, uniform pitch at
    cold full slip.

    N_n/N_1 = ((1 + f z)/(1 − f z))^(n−1),   z = tan(β/2)
    """
    fz = FRICTION * math.tan(WRAP / LININGS / 2)
    return ((1 + fz) / (1 - fz)) ** (LININGS - 1)


def rows_of(
    layouts: dict[str, np.ndarray], rate: HotWear
) -> list[sb.layouts.LayoutRow]:
    """Every layout with its wear over the stop."""
    rows = []
    for name, angle in layouts.items():
        result = sb.simulate(sb.with_values(scene(), {"brake.linings.angle": angle}))
        worn = np.asarray(sb.results.lining_wear(result, rate))
        rows.append(
            sb.layouts.LayoutRow(
                name,
                np.asarray(angle),
                np.full(LININGS, AREA),
                {"wear": worn},
                {"wear": "m"},
            )
        )
        hot = np.asarray(sb.results.lining_peak(result, "normal_load")) / 1e3
        print(
            f"{name:26} stops after {result.metrics['stopping_time']:.4f} s, maximum tension "
            f"{result.metrics['max_tension'] / 1e3:6.2f} kN, hottest lining "
            f"{result.metrics['peak_lining_temperature'] - 273.15:5.1f} °C, maximum "
            f"load {hot.max():.2f} kN"
        )
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=pathlib.Path, help="folder for the figures")
    out = parser.parse_args().out

    design = sb.equal_layout(scene(), "wear", over="braking", rate=wear_rate())
    fade_only = sb.equal_layout(
        scene(), "wear", over="braking", rate=wear_rate(slope=0.0)
    )
    work = sb.equal_layout(scene(), "friction_work", over="braking")
    layouts = {
        "uniform pitch": np.asarray(scene().brake.linings.angle),
        "Z, equal increments": sb.layouts.equal_increment_angles(
            FRICTION, LININGS, LININGS, WRAP
        ).angle,
        "equal loads at full slip": sb.layouts.equal_load_angles(
            FRICTION, LININGS, WRAP
        ).angle,
        "equal work over the stop": work.angle,
        "equal wear, constant rate": fade_only.angle,
        "equal wear over the stop": design.angle,
    }
    rows = rows_of(layouts, wear_rate())
    print(
        f"\n{'lining':8}"
        + "".join(f"{i:>8}" for i in range(1, LININGS + 1))
        + "   max/min"
    )
    for row in rows:
        print(f"{row.name}")
        print(f"{'  β, °':8}" + "".join(f"{x:8.2f}" for x in np.degrees(row.angle)))
        print(
            f"{'  h, µm':8}"
            + "".join(f"{1e6 * x:8.4f}" for x in row.values["wear"])
            + f"{row.non_uniformity:10.6f}"
        )
    z = rows[1].angle
    best = rows[-1].angle
    first = rows[2].angle
    print(
        f"\nequal wear differs from Z's angles by up to {np.degrees(np.abs(best - z).max()):.2f}°,"
    )
    print(
        "from those of equal loads at full slip by up to "
        f"{np.degrees(np.abs(best - first).max()):.2f}°"
    )
    print(
        "equal work over the stop differs from Z's by up to "
        f"{np.degrees(np.abs(work.angle - z).max()):.2f}°; Z's layout leaves a maximum "
        f"over minimum work of {work.row('closed form').non_uniformity:.4f}"
    )
    loads = [
        np.asarray(sb.results.lining_mean(sb.simulate(one), "normal_load"))
        for one in (scene(), design.scene)
    ]
    print(
        "running-on over running-off load, mean over the sliding distance: uniform "
        f"{loads[0][-1] / loads[0][0]:.3f} "
        f"(at cold full slip {end_ratio():.3f}), "
        f"equal wear {loads[1][-1] / loads[1][0]:.3f}"
    )
    print(f"\n{design}")
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        sb.layouts.figures.layouts([rows[i] for i in (0, 1, 2, 5)]).savefig(
            out / "layouts.png", dpi=130
        )
        sb.layouts.figures.chord_angles(7, (0.1, 0.3, 0.5)).savefig(
            out / "chord_angles.png", dpi=130
        )
        print(f"figures in {out}")


if __name__ == "__main__":
    main()
