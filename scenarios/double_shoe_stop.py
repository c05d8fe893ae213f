"""Stop and hold of a winch drum by a double-shoe brake.

As a script it also runs in the other direction, and gives the coefficient of friction
for self-locking. Geometry of the shoes: an example of internal expanding shoes in the
book (Shigley: Budynas & Nisbett, *Shigley's Mechanical Engineering Design*). Values
without a source are marked as assumptions.
"""

import math

import numpy as np

import simbrake as sb


def scene(omega: float = 25.0, load: float = 250.0) -> sb.Scene:
    """The scene that `simbrake run` integrates."""
    friction = sb.friction.ProductFriction(
        # Shigley; the ratio is an assumption
        sb.ConstantFriction(0.32, static_ratio=1.1),
        # assumption
        (sb.LinearFade(slope=1.5e-3, above=373.15, floor=0.4, blend=10.0),),
    )
    return sb.Scene(
        brake=sb.ShoeBrake(
            inertia=12.0,  # kg·m²; assumption: drum and wound rope
            linings=sb.Shoes(
                friction,
                radius=0.150,  # m; this and the following by Shigley
                width=0.032,
                start=0.0,
                end=math.radians(126.0),
            ),
            pin=0.1227,
            arm=0.212,
        ),
        duty=sb.ForceDuty(
            # N; assumption
            force=sb.PiecewiseLinear(
                times=[0.0, 0.15, 3.0, 3.5], values=[0.0, 2.2e3, 2.2e3, 0.0]
            ),
            load=sb.TorqueLoad(sb.Constant(load)),  # N·m; assumption: load on the rope
        ),
        initial=sb.Initial(omega=omega),
        end_time=4.0,
        heat=sb.Heat(
            bodies=(
                sb.thermal.Lump("drum", 4.0e3),  # J/K; assumption: some 8 kg of iron
                # assumption: heated part of the linings in one stop
                sb.thermal.Lump("shoes", 250.0, count=2),
                sb.thermal.Reservoir("air", 293.15),
            ),
            links=(
                sb.thermal.Conductance("drum", "air", 8.0),
                sb.thermal.Conductance("shoes", "drum", 2.0),
            ),
            friction=sb.thermal.FrictionHeat(
                "drum", "shoes", sb.thermal.ConstantPartition(0.85)
            ),
            rim="drum",
            linings="shoes",
        ),
        wear=sb.Wear(5e-14),
    )


def main() -> None:
    result = sb.simulate(scene())
    print(result)
    back = sb.simulate(scene(-25.0, -250.0))
    worn = np.asarray(result.worn_thickness)
    print(
        f"\nin the other direction it stops after the same time: {float(back.stopping_time):.6f} s"
    )
    print(
        f"the leading shoe wears {worn[0] / worn[1]:.3f} times as much as the trailing one"
    )
    brake = scene().brake
    assert isinstance(brake, sb.ShoeBrake)
    locks = float(brake.normal_moment / brake.friction_moment)
    print(
        f"a leading shoe is self-locking from a coefficient of friction of {locks:.4f}"
    )


if __name__ == "__main__":
    main()
