"""Emergency stop of a drawworks with two bands of different linings under one lever:
torque, heat and wear of each.

The stop of `u2_5_5_stop.py`; each rim of the drum has its band. The second band was
relined with a new material and has two linings fewer. The lever pulls both bands
through a stiff shaft (equal stretch, K: Kryshtopa, compliance of friction units), or
through a balance beam (equal tensions). Geometry from V: Volchenko et al., table 1, and
Z: Zhuravlov et al.; other values are marked as assumptions.
"""

import math

import simbrake as sb

TRACK_RADIUS = 0.590  # m, V table 1
WIDTH = 0.220  # m, V: of a rim; assumption: band and linings are as wide
LINING = 0.030  # m, V: lining FK-24A
BAND = 0.006  # m, V: brake band
PITCH = math.radians(13.5)  # Z: 20 linings over 270°
COUNTS = (20, 18)  # linings of the bands; assumption
AREA = TRACK_RADIUS * PITCH * WIDTH


def fading(coefficient: float, slope: float) -> sb.friction.ProductFriction:
    """Friction that fades above 120 °C."""
    fade = sb.LinearFade(slope, above="120 degC", floor=0.6, blend=10.0)  # assumptions
    return sb.friction.ProductFriction(sb.ConstantFriction(coefficient), (fade,))


def bands(*, beam: bool) -> tuple[sb.brakes.LinedBand, ...]:
    """Both bands; with a balance `beam` their tensions are equal."""
    # assumptions: worn FK-24A, and a new organic lining
    laws = fading(0.35, 1.0e-3), fading(0.42, 2.5e-3)
    made = []
    # m to the anchor; assumption
    for law, count, tight_end in zip(laws, COUNTS, (0.60, 0.90), strict=True):
        linings = sb.uniform_linings(count, count * PITCH, law, area=AREA)
        steel = sb.brakes.LiningsOnPlates(
            modulus=2.06e11, area=WIDTH * BAND, slack_end=0.35, tight_end=tight_end
        )
        made.append(
            sb.brakes.LinedBand(linings, share=1.0)
            if beam
            else sb.brakes.LinedBand(linings, steel)
        )
    return tuple(made)


def heat() -> sb.Heat:
    """A wall for each of the two rims, and one for every lining."""
    rim = sb.material("steel_20L")
    lining = sb.material("FK-24A")
    n = sum(COUNTS)
    track = 2 * math.pi * TRACK_RADIUS * WIDTH
    return sb.Heat(
        bodies=(
            # V table 1
            sb.thermal.Wall(
                "rims",
                rim,
                thickness=0.025,
                area=track,
                layers=10,
                growth=1.4,
                copies=2,
            ),
            sb.thermal.Wall(
                "linings", lining, LINING, AREA, layers=14, growth=1.4, copies=n
            ),
            sb.thermal.Reservoir("air"),
        ),
        links=(
            # W/(m²·K); assumption
            sb.thermal.Conductance("rims.back", "air", 25.0 * track),
            # W/(m²·K); assumption
            sb.thermal.Conductance("linings.back", "air", 10.0 * AREA),
        ),
        friction=sb.thermal.FrictionHeat(
            "rims.front", "linings.front", sb.thermal.EffusivityPartition(rim, lining)
        ),
        rim="rims.front",
        linings="linings.front",
    )


def scene(*, beam: bool = False) -> sb.Scene:
    """The scene that `simbrake run` integrates."""
    # kg·m²; assumption: drum, both rims and fast line
    pulley = sb.Pulley(TRACK_RADIUS, inertia=1200.0)
    return sb.Scene(
        brake=sb.brakes.MultiBandBrake(
            pulley, TRACK_RADIUS + LINING + BAND / 2, bands(beam=beam)
        ),
        duty=sb.Duty(
            # N of both bands; assumption
            slack_tension=sb.ramp(2.0e3, 24.0e3, 0.0, 0.35),
            # assumptions: a heavy string
            load=sb.HookLoad(mass=60.0e3, drum_radius=0.40, line_count=8),
        ),
        initial=sb.Initial(omega=24.0),  # 1.2 m/s at the hook; assumption
        end_time=4.0,
        heat=heat(),
        wear=sb.Wear(1.0e-13),  # m³/(N·m); assumption
    )


def main() -> None:
    import numpy as np

    for beam in (False, True):
        result = sb.simulate(scene(beam=beam))
        brake = result.scene.brake
        series = result.series([0.35])
        shares = np.asarray(sb.brakes.tension_shares(brake, 293.15))
        print(
            f"{'equal tensions (balance beam)' if beam else 'equal stretch (K-8)'}: "
            f"{result.message}"
        )
        print(
            f"stop after {float(result.stopping_time):.4f} s; with the lever fully on:"
        )
        per_lining = {
            "tight": np.asarray(series.tension)[0],
            "work": np.asarray(sb.results.friction_work(result)),
            "load": np.asarray(sb.results.lining_peak(result, "normal_load")),
            "wear": np.asarray(result.worn_thickness),
        }
        each = {name: brake.of_bands(values) for name, values in per_lining.items()}
        rims = np.asarray(
            result.series(np.linspace(0.0, 4.0, 401)).rim_temperature
        ).max(axis=0)
        heads = (
            "band",
            "share, %",
            "tight end, kN",
            "torque, kN·m",
            "work, kJ",
            "rim, °C",
            "greatest N, kN",
            "wear, µm",
        )
        print("".join(f"{head:>16}" for head in heads))
        for j, share in enumerate(shares):
            slack = share * float(series.slack_tension[0])
            tight = each["tight"][j][-1]
            torque = float(brake.band_radius) * (tight - slack)
            row = (
                100 * share,
                tight / 1e3,
                torque / 1e3,
                each["work"][j].sum() / 1e3,
                rims[j] - 273.15,
            )
            row += (each["load"][j].max() / 1e3, each["wear"][j].max() * 1e6)
            print(f"{j + 1:>16}" + "".join(f"{value:>16.2f}" for value in row))
        print()


if __name__ == "__main__":
    main()
