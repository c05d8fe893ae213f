"""Staged brakes that several tests share, and one integrated independently with
SciPy."""

import math

import numpy as np

import simbrake as sb

R = 0.59
R_B = 0.64
J = 900.0
J_B = 45.0
N = 8
BETA = math.radians(33.0)
F_EXT = 0.40
F_INT = 0.22
PRELOAD = 900.0


def brake(
    stiffness=None,
    f_ext=F_EXT,
    f_int=F_INT,
    preload=PRELOAD,
    J_b=J_B,
    J=J,
    n=N,
    law=None,
    inner=None,
):
    return sb.Brake(
        sb.Pulley(R, J),
        sb.Band(R_B, stiffness),
        sb.Lining(law or sb.ConstantFriction(f_ext), np.full(n, BETA)),
        sb.Bandage(J_b, inner or sb.ConstantFriction(f_int), preload),
    )


def stop(
    rate=4e3, start=200.0, load=300.0, w0=20.0, end=12.0, lever=None, heat=None, **parts
):
    """A stop under a lever ramp of `rate` (N/s) that ends at 30 kN."""
    lever = lever or sb.PiecewiseLinear([0.0, 3e4 / rate], [start, start + 3e4])
    return sb.Scene(
        brake(**parts),
        sb.Duty(lever, load),
        sb.Initial(w0),
        end,
        heat,
    )


def tensions(T_0, T_n, mu):
    """Mobilisation rule, written as a walk along the linings."""
    T = [T_0]
    if T_n >= T_0:
        for m in mu:
            T.append(min(T[-1] * m, T_n))
        return np.array(T)
    T = [T_n]
    for m in mu[::-1]:
        T.append(min(T[-1] * m, T_0))
    return np.array(T[::-1])
