"""The synthesis of a stop, step by step and without the package."""

import math

from scenes import lining_ratio


def by_hand():
    """Steps 1 to 5 and 12 of the U2-5-5 stop from its printed numbers alone."""
    ratio = lining_ratio(0.35, math.radians(270.0 / 20)) ** 20
    torque = 0.623 * 24e3 * (ratio - 1)
    load = 60e3 * 9.80665 * 0.4 / 8
    inertia = 1200.0 + 60e3 * (0.4 / 8) ** 2
    time = inertia * 24.0 / (torque - load)
    work = torque * 24.0 * time / 2
    a = 47.8 / (7850.0 * 534.1)
    a_l = 0.736 / (2000.0 * 1000.0)
    e = math.sqrt(47.8 * 7850.0 * 534.1)
    e_l = math.sqrt(0.736 * 2000.0 * 1000.0)
    b = 1.73 * math.sqrt(a * time)
    b_l = 1.73 * math.sqrt(a_l * time)
    share = e / (e + e_l)
    track = 2 * 2 * math.pi * 0.590 * 0.220
    rim = 293.15 + 2 / 3 * share * work / (534.1 * 7850.0 * track * b)
    lining = 293.15 + 2 / 3 * (1 - share) * work / (
        1000.0 * 2000.0 * 0.75 * track * b_l
    )
    return {
        "thermal penetration depth, rim": b,
        "thermal penetration depth, lining": b_l,
        "thermal penetration depth, band": 1.73
        * math.sqrt(53.94 / (7850.0 * 480.0) * time),
        "Fourier number, rim": 1 / 3,
        "Fourier number, band": 53.94 / (7850.0 * 480.0) * time / 0.006**2,
        "effective volume, rim": track * b,
        "effective volume, band": 0.75 * track * 0.006,  # heat reaches through it
        "heat partition coefficient, rim": share,
        "heat partition coefficient, linings": 1 - share,
        "mean bulk temperature, rim": rim,
        "mean bulk temperature, lining": lining,
        "mean bulk temperature, rim, refined": rim,  # below 150 °C nothing is replaced
        "heat into the rim": share * work,
        "tension ratio": ratio,
        "brake torque": torque,
        "stopping time": time,
        "stopping angle": 24.0 * time / 2,
        "friction work": work,
        "tight tension, maximum": ratio * 24e3,
        "friction travel": 0.623 * 24.0 * time / 2,
        "hook travel": 0.4 / 8 * 24.0 * time / 2,
        "energy load of the linings": work / (0.75 * track),
        "power load of the linings, mean": work / (0.75 * track * time),
        "maximum gradient at the face": 2 * share * work / (track * time) / 47.8,
        "thickness that heat reaches, rim": b,
        "thickness that holds the heat, braking": share
        * work
        / track
        / (7850.0 * 534.1 * 380.0),
    }
