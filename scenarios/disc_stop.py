"""Emergency stop of a hook being lowered, by the disc brake of a drawworks: heat, fade
and wear of eight pads.

Values without a source are marked as assumptions.
"""

import dataclasses
import math

import simbrake as sb


def scene() -> sb.Scene:
    """The scene that `simbrake run` integrates."""
    # m to the rope, lines strung; assumptions as in u2_5_5_stop.py
    drum_radius = 0.40
    line_count = 8
    hook_speed = 1.2  # m/s downwards; assumption: lowering of a heavy string
    # assumption: an organic pad, 0.40 cold, that loses 0.08 % per kelvin above 250 °C
    friction = sb.friction.ProductFriction(
        sb.StribeckFriction(
            static_coefficient=0.44, kinetic_coefficient=0.40, stribeck_speed=0.5
        ),
        (sb.LinearFade(slope=8e-4, above=523.15, floor=0.5, blend=10.0),),
    )
    pads = sb.Pads(
        friction,
        inner_radius=0.65,  # m; assumption: a disc 1.65 m in diameter
        outer_radius=0.80,  # m
        angle=math.radians(16.0),  # assumption: about 300 cm² for each pad
        faces=8,  # two discs with two callipers each
    )
    swept = math.pi * (0.80**2 - 0.65**2)  # m² of one face
    return sb.Scene(
        brake=sb.DiscBrake(
            inertia=1200.0,  # kg·m²; assumption: drum, both discs and fast line
            linings=pads,
        ),
        duty=sb.ForceDuty(
            # the springs of fail-safe callipers close within 0.25 s once the oil is let
            # off; assumptions
            force=sb.PiecewiseLinear(
                times=[0.0, 0.08, 0.25], values=[0.0, 2.0e3, 45.0e3]
            ),
            load=sb.HookLoad(
                mass=60.0e3, drum_radius=drum_radius, line_count=line_count
            ),
        ),
        initial=sb.Initial(omega=hook_speed * line_count / drum_radius),
        end_time=4.0,  # s: past the stop, to show the hold
        heat=sb.layered_heat(
            rim=sb.material("steel_35KhNL"),
            # m: half of a disc, as both of its faces are heated; assumption
            rim_thickness=0.038,
            rim_layers=16,
            rim_first=2e-4,
            track_area=4 * swept,  # four faces
            lining=sb.material("retinax"),
            lining_thickness=0.020,
            lining_area=8 * float(pads.area),
            lining_layers=14,
            lining_first=1e-4,
            each=8,
            outside=25.0,  # W/(m²·K) to the air; assumption
            # assumption: by the effusivities
            partition=sb.thermal.ConstantPartition(0.93),
            permissible=623.15,
        ),
        # assumption: some 0.1 mm³/MJ cold
        wear=sb.Wear(sb.wear.ExponentialWear(3e-14, rise=120.0), permissible=0.012),
    )


def main() -> None:
    run_in = scene()
    result = sb.simulate(run_in)
    print(result)
    brake = run_in.brake
    assert isinstance(brake, sb.DiscBrake)
    pads = dataclasses.replace(brake.linings, pressure=sb.brakes.UniformPressure())
    new = dataclasses.replace(run_in, brake=dataclasses.replace(brake, linings=pads))
    print(
        f"\nstopping time with run-in pads {float(result.stopping_time):.5f} s, ",
        end="",
    )
    print(
        f"with new ones, uniform pressure, {float(sb.simulate(new).stopping_time):.5f} s"
    )


if __name__ == "__main__":
    main()
