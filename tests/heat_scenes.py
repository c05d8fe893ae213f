"""Scenes with heat that several tests share."""

import math

import numpy as np
from scenes import stop_scene
from scipy.optimize import minimize_scalar

import simbrake as sb

R = 0.725
J = 800.0
C = 2e5
T0 = 8e3
W0 = 20.0
N = 20
BETA = math.radians(13.5)
TRACK = 2 * math.pi * R * 0.23
FLASH = sb.thermal.FlashTemperature(length=1e-3, conductivity=50.0, diffusivity=1.44e-5)


def fading(f=0.35, slope=3e-4, above=293.15, floor=0.0, blend=0.0):
    return sb.friction.ProductFriction(f, (sb.LinearFade(slope, above, floor, blend),))


def brake(law, stiffness=C, n=N, beta=BETA, area=None):
    return sb.Brake(
        sb.Pulley(R, J), sb.Band(R, stiffness), sb.Lining(law, np.full(n, beta), area)
    )


def layered_stop(growth=1.0, stiffness=C, end=2.0, law=None):
    """A stop from the onset of slip with a rim of 20 layers; nothing but the rim is
    heated (95 %)."""
    rim = sb.thermal.Wall(
        "rim", sb.Material(48.0, 7800.0, 500.0), 0.028, TRACK, 20, growth
    )
    heat = sb.Heat(
        bodies=(rim, sb.thermal.Reservoir("air")),
        links=(
            sb.thermal.Convection("rim.back", TRACK, 60.0),
            sb.thermal.Convection("rim.front", 0.25 * TRACK, 60.0),
        ),
        friction=sb.thermal.FrictionHeat("rim.front", None, 0.95),
        rim="rim.front",
    )
    parts = {"law": law or fading(), "elongation": T0 / stiffness, "heat": heat}
    return stop_scene(C=stiffness, end=end, **parts)


def lump(capacity=2e4, share=1.0, linings=None, cooling=0.0, **more):
    return sb.lumped_heat(
        rim=capacity,
        partition=sb.thermal.ConstantPartition(share),
        rim_cooling=cooling,
        linings=linings,
        **more,
    )


def rigid_stop(law, heat, end=10.0, lever=None, **parts):
    parts |= {"law": law, "heat": heat, "end": end, "lever": lever}
    return stop_scene(C=None, **parts)


def warmed(
    law,
    power,
    load=0.0,
    stiffness=C,
    end=200.0,
    capacity=1e4,
    n=N,
    beta=BETA,
    flash=None,
    area=None,
    w0=0.0,
):
    """A brake whose linings are warmed from outside: `T = T_0 + P t/C`."""
    heat = sb.Heat(
        (sb.thermal.Lump("linings", capacity),),
        sources=(sb.thermal.Source("linings", power),),
        friction=sb.thermal.FrictionHeat(None, "linings", 1.0),
        flash=flash,
        linings="linings",
        permissible=293.15 + 50.0,
    )
    duty = sb.Duty(T0, load)
    return sb.Scene(
        brake(law, stiffness, n, beta, area), duty, sb.Initial(w0), end, heat
    )


def falling_flux(k, rho, c, work, duration, depth=0.028):
    """A face of TRACK m² that takes `work` in a stop, where the heat does not reach the
    back at `depth`.

    The greatest rise of the face `(4/3) q_0 √(τ/2π)/e`, at τ/2, that of the mean at the
    end, and the greatest difference of the two, under the flux `q_0 (1 − t/τ)`.
    """
    e = math.sqrt(k * rho * c)
    q = 2 * work / duration / TRACK

    def face(t):
        return 2 * q * math.sqrt(t / math.pi) / e * (1 - 2 * t / (3 * duration))

    def mean(t):
        return q * t * (1 - t / (2 * duration)) / (rho * c * depth)

    greatest = minimize_scalar(
        lambda t: mean(t) - face(t), bounds=(0.1 * duration, duration), method="bounded"
    )
    return face(duration / 2), mean(duration), -greatest.fun
