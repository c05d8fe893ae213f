"""The emergency stop of a U2-5-5 with its serial brake and with a staged one, side by
side.

The staged brake (K: Kryshtopa, part III) carries its linings on the pulley: the band
first slides on them, then, once the internal pair slips, they come to rest and the
pulley slides in them. Geometry from V (Volchenko et al.) and K; values not in the
papers are marked as assumptions.
"""

import math

import simbrake as sb

TRACK_RADIUS = 0.590  # m, V table 1
TRACK_WIDTH = 0.220  # m, V
BAND = 0.006  # m, V: brake band
# Z
LININGS = 20
WRAP = math.radians(270.0)
STEEL = sb.material("steel_20L")
BAND_STEEL = sb.material("band_steel")
LINING = sb.material("FK-24A")


def _fading(coefficient: float) -> sb.friction.ProductFriction:
    """Friction that fades by 4 % every 100 K above 150 °C (assumption)."""
    return sb.friction.ProductFriction(
        sb.ConstantFriction(coefficient), (sb.LinearFade(4e-4, 423.15, 0.1, 0.01),)
    )


def _heat(lining_thickness: float) -> sb.Heat:
    area = WRAP * TRACK_RADIUS * TRACK_WIDTH
    return sb.layered_heat(
        rim=STEEL,
        rim_thickness=0.025,  # m, V table 1
        track_area=2 * math.pi * TRACK_RADIUS * TRACK_WIDTH,
        partition=sb.thermal.EffusivityPartition(STEEL, LINING),
        rim_layers=10,
        rim_first=1.5e-3,  # m
        lining=LINING,
        lining_thickness=lining_thickness,
        lining_area=area,
        lining_layers=32,
        lining_both=True,
        # m; thin, as the heat of a brake application stays near the faces
        lining_first=6e-5,
        band=BAND_STEEL,
        band_thickness=BAND,
        inside=25.0,  # W/(m²·K); assumption
        outside=40.0,  # W/(m²·K); assumption
        band_coefficient=15.0,  # W/(m²·K); assumption
        permissible=673.15,  # K; assumption for FK-24A
    )


def _scene(brake: sb.Brake, heat: sb.Heat) -> sb.Scene:
    duty = sb.Duty(
        # s, N; assumptions, as in u2_5_5_stop
        slack_tension=sb.PiecewiseLinear([0.0, 0.35], [2.0e3, 24.0e3]),
        # assumptions, as in u2_5_5_stop
        load=sb.HookLoad(mass=60.0e3, drum_radius=0.40, line_count=8),
    )
    return sb.Scene(brake, duty, sb.Initial(omega=24.0), end_time=5.0, heat=heat)


def standard() -> sb.Scene:
    """The serial brake: linings on the band, 30 mm thick (V)."""
    thickness = 0.030
    brake = sb.Brake(
        sb.Pulley(TRACK_RADIUS, inertia=1200.0, width=TRACK_WIDTH),  # kg·m²; assumption
        # N/m; assumption: the linkage dominates
        sb.Band(TRACK_RADIUS + thickness + BAND / 2, stiffness=1.0e5),
        sb.uniform_linings(
            LININGS,
            WRAP,
            _fading(0.35),
            area=WRAP * TRACK_RADIUS * TRACK_WIDTH / LININGS,
        ),
    )
    return _scene(brake, _heat(thickness))


def scene() -> sb.Scene:
    """The staged brake: linings of 45 mm (K) on the pulley."""
    thickness = 0.045
    outer = TRACK_RADIUS + thickness
    mass = LINING.density * WRAP * (outer**2 - TRACK_RADIUS**2) / 2 * TRACK_WIDTH  # kg
    brake = sb.Brake(
        # kg·m²; assumption, as above
        sb.Pulley(TRACK_RADIUS, inertia=1200.0, width=TRACK_WIDTH),
        sb.Band(outer + BAND / 2, stiffness=1.0e5),  # N/m; assumption, as above
        # K: the external friction must exceed the internal; both coefficients are
        # assumptions
        sb.uniform_linings(
            LININGS, WRAP, _fading(0.42), area=WRAP * outer * TRACK_WIDTH / LININGS
        ),
        sb.Bandage(
            inertia=mass * (outer**2 + TRACK_RADIUS**2) / 2,
            friction=_fading(0.30),
            # N for each lining; assumption: the interference of rods and springs
            preload=4.0e3,
            area=WRAP * TRACK_RADIUS * TRACK_WIDTH / LININGS,
            # 2.9 kg: the centrifugal force takes a quarter of the preload at 24 rad/s
            mass=mass / LININGS,
            mass_radius=(TRACK_RADIUS + outer) / 2,
        ),
    )
    heat = sb.thermal.with_external_pair(
        _heat(thickness), sb.thermal.EffusivityPartition(BAND_STEEL, LINING)
    )
    return _scene(brake, heat)


def ring() -> sb.Scene:
    """The same with linings all around the pulley, which travel under the band (K:
    change of position)."""
    inertia = scene().brake.bandage.inertia * 2 * math.pi / WRAP
    return sb.with_values(scene(), {"brake.bandage.inertia": inertia})


def wear_of_the_ring(stops: int) -> list[float]:
    """Maximum over minimum wear of the outer faces of 26 linings in a ring, after each
    of equal stops in a row; the first number is that of linings that do not travel."""
    run = sb.simulate(ring())
    worn = 0.0
    start = 0.0
    found = []
    for _ in range(stops):
        # m³/(N·m); assumption, only ratios are shown
        one = sb.results.ring_wear(run, 26, 3e-14, start=start)
        worn = worn + one.depth
        start = start + one.travel
        found.append(float(worn.max() / worn.min()))
    return [one.over_least[1], *found]


def main() -> None:
    results = {"standard": sb.simulate(standard()), "staged": sb.simulate(scene())}
    for name, result in results.items():
        print(f"--- {name} brake ---\n{result}\n")
    rows = [
        ("stopping time, s", lambda r: r.metrics["stopping_time"]),
        ("hook travel, m", lambda r: r.metrics["hook_travel"]),
        ("maximum tension, kN", lambda r: r.metrics["max_tension"] / 1e3),
        ("maximum load on a lining, kN", lambda r: r.metrics["max_normal_load"] / 1e3),
        ("friction heat, kJ", lambda r: float(r.energy["friction_heat"]) / 1e3),
        (
            "  of band and linings, kJ",
            lambda r: float(r.energy.get("heat_external", 0.0)) / 1e3,
        ),
        ("  into the rim, kJ", lambda r: float(r.energy["heat_to_metal"]) / 1e3),
        ("  into the linings, kJ", lambda r: float(r.energy["heat_to_linings"]) / 1e3),
        ("  into the band, kJ", lambda r: float(r.energy["heat_to_band"]) / 1e3),
        (
            "hottest rim surface, °C",
            lambda r: r.metrics["peak_rim_temperature"] - 273.15,
        ),
        (
            "hottest lining face, °C",
            lambda r: r.metrics["peak_lining_temperature"] - 273.15,
        ),
        ("hottest band, °C", lambda r: r.metrics["peak_band_temperature"] - 273.15),
    ]
    print(f"{'':32}" + "".join(f"{name:>12}" for name in results))
    for words, pick in rows:
        print(
            f"{words:32}"
            + "".join(f"{pick(result):12.4g}" for result in results.values())
        )
    still, *travelling = wear_of_the_ring(20)
    print(
        f"\nmaximum over minimum wear of the outer faces: {still:.3f} where linings do "
        "not travel; in a ring"
    )
    print(
        "after stop "
        + ", ".join(f"{k}: {travelling[k - 1]:.3f}" for k in (1, 2, 4, 10, 20))
    )


if __name__ == "__main__":
    main()
