"""Walls of the heated scenes as plain matrices: layers, their rates, and what friction
heat does to them."""

import math

import numpy as np


def layers(first: float | None, thickness: float, count: int) -> np.ndarray:
    """Thicknesses of the layers of a wall: equal, or growing by one ratio from the
    first."""
    if first is None:
        return np.full(count, thickness / count)
    from scipy.optimize import brentq

    total = thickness / first
    q = brentq(
        lambda q: math.fsum(q**i for i in range(count)) - total,
        1.0,
        100.0,
        xtol=1e-15,
        rtol=1e-15,
    )
    steps = q ** np.arange(count)
    return thickness * steps / steps.sum()


def wall_rates(
    steps: np.ndarray, conductivity: float, heat: float, front: float, back: float
) -> np.ndarray:
    """`dT/dt = rates @ T` of a wall of unit area: volumetric `heat` (J/(m³·K)), `front`
    and `back` W/(m²·K)."""
    k = len(steps)
    rates = np.zeros((k, k))
    half = steps / (2 * conductivity)
    g = 1 / (half[:-1] + half[1:])
    for i in range(k - 1):
        rates[i, i] -= g[i]
        rates[i, i + 1] += g[i]
        rates[i + 1, i + 1] -= g[i]
        rates[i + 1, i] += g[i]
    for i, h in ((0, front), (k - 1, back)):
        rates[i, i] -= h / (1 + h * half[i])
    return rates / (heat * steps)[:, None]


TRACK = 2 * math.pi * 0.725 * 0.23
RIM = {
    "thickness": 0.028,
    "conductivity": 48.0,
    "density": 7800.0,
    "specific_heat": 500.0,
}
LINING = {
    "thickness": 0.030,
    "conductivity": 0.8,
    "density": 2000.0,
    "specific_heat": 1100.0,
}
SHARE = 0.95
INSIDE = 60.0
OUTSIDE = 60.0
OPEN = 0.25
OVERLAP = 0.75


def rim_wall(first: float | None) -> tuple[np.ndarray, np.ndarray]:
    """Rates and heat of a rim of 20 layers that is cooled on the inside and on the open
    quarter of its track."""
    steps = layers(first, RIM["thickness"], 20)
    heat = RIM["density"] * RIM["specific_heat"]
    half = steps[0] / (2 * RIM["conductivity"])
    # only a quarter of the face cools, through half a layer under the whole of it
    outside = 1 / (1 / (OPEN * OUTSIDE) + half)
    rates = wall_rates(steps, RIM["conductivity"], heat, 0.0, INSIDE)
    rates[0, 0] -= outside / (heat * steps[0])
    into = np.zeros(20)
    into[0] = SHARE / (heat * steps[0] * TRACK)
    return rates, into


def lining_wall(first: float) -> tuple[np.ndarray, np.ndarray]:
    """Rates and heat of a lining of 12 layers whose back is insulated."""
    steps = layers(first, LINING["thickness"], 12)
    heat = LINING["density"] * LINING["specific_heat"]
    into = np.zeros(12)
    into[0] = (1 - SHARE) / (heat * steps[0] * OVERLAP * TRACK)
    return wall_rates(steps, LINING["conductivity"], heat, 0.0, 0.0), into
