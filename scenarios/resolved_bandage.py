"""A staged stop lining by lining: 26 linings between band and pulley, each with its own
speed and two contacts.

The bandage of K (Kryshtopa, part III): linings on rods with an interference, springs
between neighbours. The order of slip on the rim and of rest on the band, beside a rigid
bandage. Geometry from V (Volchenko et al.) and K; other values are marked as
assumptions.
"""

import dataclasses
import math

import simbrake as sb


def scene() -> sb.Scene:
    """The scene that `simbrake run` integrates."""
    # Z: even, 8…26
    count = 26
    wrap = math.radians(270.0)
    # m: V table 1, K, V
    track_radius = 0.590
    lining = 0.045
    band = 0.006
    return sb.Scene(
        sb.Brake(
            # kg·m²; assumption: drum, pulleys, fast line
            sb.Pulley(track_radius, inertia=1200.0),
            # rigid: the speeds of the linings matter, not its elasticity
            sb.Band(track_radius + lining + band / 2),
            sb.uniform_linings(count, wrap, sb.ConstantFriction(0.42)),  # assumption
            sb.Bandage(
                inertia=22.0,  # kg·m², all linings; assumption: FK-24A at 2000 kg/m³
                friction=sb.ConstantFriction(0.30),  # assumption; K: less than outside
                preload=4.0e3,  # N for each lining; assumption
                mass=57.0 / count,  # kg; as the inertia
                mass_radius=track_radius + lining / 2,
                spring=2.0e5,  # N/m between neighbours; assumption
                spring_damping=0.05,  # of critical; assumption
            ),
        ),
        sb.Duty(
            # s, N; assumptions, as in u2_5_5_stop
            sb.PiecewiseLinear([0.0, 0.35], [2.0e3, 24.0e3]),
            # assumptions, as in u2_5_5_stop
            sb.HookLoad(mass=60.0e3, drum_radius=0.40, line_count=8),
        ),
        sb.Initial(omega=24.0),  # rad/s: hook at 1.2 m/s; assumption
        end_time=2.0,
    )


def as_one(scene: sb.Scene) -> sb.Scene:
    """The same scene with a rigid bandage."""
    bandage = dataclasses.replace(scene.brake.bandage, spring=None, spring_damping=0.05)
    return dataclasses.replace(
        scene, brake=dataclasses.replace(scene.brake, bandage=bandage)
    )


def main() -> None:
    resolved = sb.simulate(scene())
    rigid = sb.simulate(as_one(scene()))
    print(f"--- resolved bandage ---\n{resolved}\n\n--- rigid bandage ---\n{rigid}\n")
    first = {}
    for event in resolved.events:
        first.setdefault((event.name, event.lining), event.time)
    n = scene().brake.linings.count
    print("lining   slips on the rim     comes to rest on the band")
    for i in range(1, n + 1):
        cells = [
            first.get((name, i))
            for name in ("lining_internal_slip", "lining_external_stick")
        ]
        slip, rest = ("never" if time is None else f"{time:.6f} s" for time in cells)
        print(f"{i:6d} {slip:>20} {rest:>27}")
    print(
        f"rigid  {float(rigid.internal_slip_time):.6f} s            "
        f"{float(rigid.external_lock_time):.6f} s"
    )


if __name__ == "__main__":
    main()
