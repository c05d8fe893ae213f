"""Stops of a double-shoe brake that several tests share, and the moments of its shoes
by quadrature."""

import math

import numpy as np
from scenes import with_points
from scipy.integrate import quad

import simbrake as sb

R = 0.150
B = 0.032
A = 0.1227
C = 0.212
START = 0.15
END = math.radians(126.0)
J = 12.0
W0 = 25.0
F = 2e3
FRICTION = 0.32


def moments(end=END):
    """Moments of normal force and friction (per coefficient), force and torque (per
    coefficient) for p̂ = 1 Pa."""

    def over(function):
        return quad(function, START, end, epsabs=0.0, epsrel=1e-13)[0]

    normal = B * R * A * over(lambda x: math.sin(x) ** 2)
    friction = B * R * over(lambda x: math.sin(x) * (R - A * math.cos(x)))
    return normal, friction, B * R * over(math.sin)


M_N, M_F, N_1 = moments()
LOCKS = M_N / M_F


def normals(f, force=F, back=False):
    """Normal forces on both shoes by their balance about the pins."""
    leads = np.array([-1.0, 1.0]) if back else np.array([1.0, -1.0])
    return force * C / (M_N - leads * f * M_F) * N_1


def shoe_scene(*, omega=W0, load=0.0, friction=None, force=F, end=4.0, **parts):
    friction = (
        sb.ConstantFriction([FRICTION, FRICTION], 1.1) if friction is None else friction
    )
    brake = sb.ShoeBrake(J, sb.Shoes(friction, R, B, START, END), A, C)
    duty = sb.ForceDuty(with_points(force), sb.TorqueLoad(with_points(load)))
    return sb.Scene(brake, duty, sb.Initial(omega), end, **parts)


def shoe_heat():
    return sb.Heat(
        (
            sb.thermal.Lump("drum", 4e3, 293.15),
            sb.thermal.Lump("shoes", 60.0, 293.15, count=2),
            sb.thermal.Reservoir("air", 293.15),
        ),
        (sb.thermal.Conductance("shoes", "air", 1.0),),
        sb.thermal.FrictionHeat("drum", "shoes", 0.8),
        rim="drum",
        linings="shoes",
    )
