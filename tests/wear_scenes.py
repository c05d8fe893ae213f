"""Brakes that wear, which several tests share."""

import math

import equinox as eqx
import numpy as np
from scenes import lining_ratio

import simbrake as sb

N = 4
F = 0.3
R = 0.6
J = 900.0
T0 = 6e3
W0 = 20.0
AREA = 0.03
BETA = math.radians(60.0)
K = 2e-14
# J/K of a lining's lump, share of the friction heat that goes into it
CAPACITY = 50.0
SHARE = 0.1


def statics(angle=None, f=F):
    """Tensions `T_0…T_n` and loads over the slack tension, all linings sliding."""
    angle = np.full(N, BETA) if angle is None else angle
    T = np.append(1.0, np.cumprod(lining_ratio(f, angle)))
    return T, (T[1:] + T[:-1]) * np.sin(angle / 2)


def distance(T_n=None):
    """Slip (m) of a stop from `W0` on a rigid band under the constant lever, no
    load."""
    return J * W0**2 / 2 / (T0 * ((statics()[0][-1] if T_n is None else T_n) - 1))


def stop(wear, heat=None, angle=None, end=8.0, law=None, area=AREA):
    """Rigid band, constant lever, no load."""
    linings = sb.Lining(
        law or sb.ConstantFriction(F),
        np.full(N, BETA) if angle is None else angle,
        area,
    )
    brake = sb.Brake(sb.Pulley(R, J), sb.Band(R), linings)
    return sb.Scene(
        brake,
        sb.Duty(T0, 0.0),
        sb.Initial(W0),
        end,
        heat,
        wear=wear,
    )


def lumps():
    """Each lining a lump of its own, from which no heat goes away."""
    return sb.Heat(
        bodies=(
            sb.thermal.Lump("rim", 1e5),
            sb.thermal.Lump("linings", CAPACITY, count=N),
        ),
        friction=sb.thermal.FrictionHeat("rim", "linings", 1 - SHARE),
        rim="rim",
        linings="linings",
    )


def wearing(scene, wear):
    """A scene of another test, with wear and areas."""
    area = {"brake.linings.area": AREA}
    if scene.brake.bandage is not None:
        area["brake.bandage.area"] = AREA
    return eqx.tree_at(
        lambda s: s.wear, sb.with_values(scene, area), wear, is_leaf=lambda x: x is None
    )
