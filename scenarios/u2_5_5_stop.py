"""Emergency stop of a hook being lowered by a U2-5-5 drawworks.

Geometry from the published description of the drawworks (V: Volchenko et al., table 1;
Z: Zhuravlov et al.). Values not in the papers are marked as assumptions.
"""

import math

import simbrake as sb


def scene() -> sb.Scene:
    """The scene that `simbrake run` integrates."""
    track_radius = 0.590  # m, V table 1
    lining_thickness = 0.030  # m, V: lining FK-24A
    band_thickness = 0.006  # m, V: brake band
    line_count = 8  # lines strung; assumption: 4 × 5 sheaves
    drum_radius = 0.40  # m to the rope; assumption: first layer of a mid-size drum
    hook_speed = 1.2  # m/s downwards; assumption: lowering of a heavy string
    return sb.Scene(
        brake=sb.Brake(
            pulley=sb.Pulley(
                radius=track_radius,
                inertia=1200.0,  # kg·m²; assumption: drum, both pulleys and fast line
            ),
            band=sb.Band(
                radius=track_radius + lining_thickness + band_thickness / 2,
                # N/m at the tight end; assumption: linkage and anchor dominate, not the
                # steel band
                stiffness=1.0e5,
            ),
            linings=sb.uniform_linings(
                20,  # Z: even, 8…26
                math.radians(270.0),  # Z: wrap
                # assumption: FK-24A on steel, within Z's 0.1…0.5
                sb.ConstantFriction(0.35),
            ),
        ),
        duty=sb.Duty(
            # both bands of the drawworks act as one: tensions are sums over the two
            slack_tension=sb.PiecewiseLinear(
                times=[0.0, 0.35],  # s; assumption: the driller applies the lever
                # N; assumptions: pretension and final slack tension
                values=[2.0e3, 24.0e3],
            ),
            load=sb.HookLoad(
                mass=60.0e3,  # kg; assumption: string in mud, hook and travelling block
                drum_radius=drum_radius,
                line_count=line_count,
            ),
        ),
        initial=sb.Initial(omega=hook_speed * line_count / drum_radius),
        end_time=5.0,  # s: well past the stop, to show the hold
    )


def main() -> None:
    print(sb.simulate(scene()))


if __name__ == "__main__":
    main()
