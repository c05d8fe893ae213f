"""Lowering a heavy string at constant speed on the brake alone: the lever follows the
friction of the heating linings.

The heat flow is the power of the load at any fade; the lever force grows, and where it
reaches its limit the load runs away. Sources and assumptions as in the tripping
scenario.
"""

import math
import runpy

import simbrake as sb


def scene() -> sb.Scene:
    """The scene that `simbrake run` integrates."""
    tripping = runpy.run_path(str(sb.files.shipped("tripping_30_stands")))
    # assumptions, as there
    line_count = 8
    drum_radius = 0.40
    hook_speed = 0.3  # m/s; assumption: slow lowering of a casing string
    # assumptions, as there
    fade = sb.LinearFade(slope=1.5e-3, above=273.15 + 120.0, floor=0.6, blend=10.0)
    return sb.Scene(
        brake=sb.Brake(
            pulley=sb.Pulley(radius=0.590, inertia=1200.0),
            # rigid: elasticity does not matter at constant speed
            band=sb.Band(radius=0.623),
            linings=sb.uniform_linings(
                20,
                math.radians(270.0),
                sb.friction.ProductFriction(sb.ConstantFriction(0.35), (fade,)),
            ),
        ),
        duty=sb.Duty(
            # N; assumption: maximum of the driller
            slack_tension=sb.SpeedHold(limit=30.0e3),
            # kg; assumption: casing
            load=sb.HookLoad(
                mass=120.0e3, drum_radius=drum_radius, line_count=line_count
            ),
        ),
        initial=sb.Initial(omega=hook_speed * line_count / drum_radius),
        end_time=90.0,  # s: one stand of 27 m
        heat=tripping["heat"](),
    )


def main() -> None:
    print(sb.simulate(scene()))


if __name__ == "__main__":
    main()
