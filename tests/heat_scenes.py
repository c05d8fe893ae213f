"""Scenes with heat that several tests share."""

import math

import numpy as np

import simbrake as sb

R, J, C, T0, W0, N, BETA = 0.725, 800.0, 2e5, 8e3, 20.0, 20, math.radians(13.5)
TRACK = 2 * math.pi * R * 0.23


def fading(f=0.35, slope=3e-4, above=293.15, floor=0.0, blend=0.0):
    return sb.friction.ProductFriction(sb.ConstantFriction(f), (sb.LinearFade(slope, above, floor, blend),))


def brake(law, stiffness=C, n=N, beta=BETA, area=None):
    return sb.Brake(sb.Pulley(R, J), sb.Band(R, stiffness), sb.Lining(law, np.full(n, beta), area))


def layered_stop(growth=1.0, stiffness=C, end=2.0, law=None):
    """A stop from the onset of slip with a rim of 20 layers; nothing but the rim is heated (95 %)."""
    rim = sb.thermal.Wall("rim", sb.Material(48.0, 7800.0, 500.0), 0.028, TRACK, 20, growth)
    heat = sb.Heat(
        bodies=(rim, sb.thermal.Reservoir("air")),
        links=(sb.thermal.Convection("rim.back", TRACK, 60.0), sb.thermal.Convection("rim.front", 0.25 * TRACK, 60.0)),
        friction=sb.thermal.FrictionHeat("rim.front", None, sb.thermal.ConstantPartition(0.95)),
        rim="rim.front",
    )
    duty = sb.Duty(sb.Constant(T0), sb.TorqueLoad())
    return sb.Scene(brake(law or fading(), stiffness), duty, sb.Initial(W0, T0 / stiffness), end, heat)


def lump(capacity=2e4, share=1.0, linings=None, cooling=0.0, **more):
    return sb.lumped_heat(
        rim=capacity, partition=sb.thermal.ConstantPartition(share), rim_cooling=cooling, linings=linings, **more
    )


def rigid_stop(law, heat, end=10.0, lever=None, load=0.0, w0=W0):
    duty = sb.Duty(lever or sb.Constant(T0), sb.TorqueLoad(sb.Constant(load)))
    return sb.Scene(brake(law, None), duty, sb.Initial(w0), end, heat)
