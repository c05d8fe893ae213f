"""Stops of a disc brake of four pads that several tests share."""

from scenes import with_points

import simbrake as sb

R_I = 0.30
R_O = 0.50
N = 4
F = 20e3
J = 400.0
W0 = 30.0
FRICTION = 0.4
RATIO = 1.25
LOAD = 1500.0
TORQUE = N * FRICTION * F * 0.5 * (R_I + R_O)


def disc_scene(
    *, force=F, load=LOAD, omega=W0, friction=None, end=4.0, pressure=None, **parts
):
    """A stop of four pads with two points for the force and the load, so that scenes
    share their program."""
    friction = sb.ConstantFriction(FRICTION, RATIO) if friction is None else friction
    pads = sb.Pads(friction, R_I, R_O, 0.7, N, pressure or sb.brakes.UniformWear())
    return sb.Scene(
        sb.DiscBrake(J, pads),
        sb.ForceDuty(with_points(force), sb.TorqueLoad(with_points(load))),
        sb.Initial(omega),
        end,
        **parts,
    )


CAPACITY = 500.0  # J/K of a pad


def disc_heat():
    return sb.Heat(
        (
            sb.thermal.Lump("disc", 2e5, 293.15),
            sb.thermal.Lump("pads", CAPACITY, 293.15, count=N),
            sb.thermal.Reservoir("air", 293.15),
        ),
        (
            sb.thermal.Conductance("pads", "air", 5.0),
            sb.thermal.Conductance("disc", "air", 20.0),
        ),
        sb.thermal.FrictionHeat("disc", "pads", 0.7),
        rim="disc",
        linings="pads",
        permissible=310.0,
    )


FADE = sb.friction.ProductFriction(
    sb.ConstantFriction(FRICTION, RATIO), (sb.LinearFade(slope=2e-3, above=273.15),)
)


def fading_scene(**changes):
    return disc_scene(
        friction=FADE,
        heat=disc_heat(),
        wear=sb.Wear(sb.wear.ExponentialWear(1e-13, rise=80.0)),
        **changes,
    )
