"""Validation of thermal networks alone: walls, faces and junctions at which several
flows meet."""

import functools
import math

import numpy as np
from case_tools import AIR, FORM, SIGMA, cases_of
from scipy.optimize import brentq

from simbrake import Heat, Material, ramp, simulate_heat, steady_state
from simbrake.thermal import (
    Conductance,
    Convection,
    FrictionHeat,
    Junction,
    Lump,
    Radiation,
    Reservoir,
    Source,
    ThermalContact,
    Wall,
)

# --- networks in the steady state ----------------------------------------------------

# K
_HOT = 500.0
_COLD = 300.0
# wall and screen: flux into the wall (W), thickness (m) and conductivity of each,
# emissivity towards air and screen, h
_FLUX = 6e3
_THICK = ((0.02, 30.0), (0.01, 5.0))
_GLOW = 0.8
_BEHIND = 0.4
_H = 12.0
# junctions: conductances (W/K) of hot reservoir and first, first and second, second and
# cold; radiating areas
_G = 8.0, 3.0, 2.0
# friction heat of three linings (W) at an interface: conductances to rim and lining,
# and of these to the air
_POWERS = (40.0, 90.0, 170.0)
_INTO = (12.0, 4.0)
_AWAY = (2.0, 1.0)


def _network():
    """One network of three that do not touch: of each some temperatures are
    compared."""
    plain = [Material(k, 7800.0, 480.0) for _, k in _THICK]
    bodies = (
        Reservoir("air", AIR),
        Reservoir("hot", _HOT),
        Reservoir("cold", _COLD),
        Lump("rim", 1e3),
        Lump("lining", 100.0, count=3),
        *(
            Wall(name, m, d, 1.0, 4)
            for name, m, (d, _) in zip(("wall", "screen"), plain, _THICK, strict=True)
        ),
        Junction("first"),
        Junction("second"),
        Junction("interface"),
    )
    links = (
        # one end or the other of a link is the face
        Radiation("wall.front", 1.0, 0.3),
        Radiation("air", 1.0, _GLOW - 0.3, "wall.front"),
        Convection("wall.front", 1.0, _H),
        Radiation("wall.back", 1.0, _BEHIND, "screen.front"),
        ThermalContact("screen.back", "cold", 1.0),
        Conductance("hot", "first", _G[0]),
        Conductance("first", "second", _G[1]),
        Radiation("first", 0.5, 0.9),
        Conductance("second", "cold", _G[2]),
        Radiation("second", 0.2, 0.6),
        Conductance("interface", "rim", _INTO[0]),
        Conductance("interface", "lining", _INTO[1]),
        Conductance("rim", "air", _AWAY[0]),
        Conductance("lining", "air", _AWAY[1]),
    )
    pair = FrictionHeat("interface", "interface", 0.5, "rim")
    return Heat(
        bodies, links, pair, (Source("wall.front", _FLUX), Source("lining", 60.0))
    )


def steady_network_cases():
    """Steady temperatures of walls, faces and junctions at which several flows meet."""
    run = functools.cache(lambda: steady_state(_network(), power=np.asarray(_POWERS)))

    def faces(Q):
        """Temperatures of the wall's two faces and of the screen's front for a heat
        flow through them."""
        front = _COLD + Q * _THICK[1][0] / _THICK[1][1]
        back = (front**4 + Q / (_BEHIND * SIGMA)) ** 0.25
        return back + Q * _THICK[0][0] / _THICK[0][1], back, front

    def rejected(Q):
        T = faces(Q)[0]
        return _GLOW * SIGMA * (T**4 - AIR**4) + _H * (T - AIR) + Q - _FLUX

    Q = brentq(rejected, 1.0, _FLUX, xtol=1e-12)
    half = [d / (8 * k) for d, k in _THICK]
    face, back, front = faces(Q)

    def second(first):
        """Temperature of the second junction, from the balance of the first."""
        left = _G[0] * (_HOT - first) - 0.5 * 0.9 * SIGMA * (first**4 - AIR**4)
        return first - left / _G[1]

    def excess(first):
        T = second(first)
        return (
            _G[1] * (first - T)
            - _G[2] * (T - _COLD)
            - 0.2 * 0.6 * SIGMA * (T**4 - AIR**4)
        )

    first = brentq(excess, AIR, _HOT, xtol=1e-12)

    # of the interface: conductance to the air by each way, and heat that arrives from
    # 20 W in each lining
    ways = [a * b / (a + b) for a, b in zip(_INTO, _AWAY, strict=True)]
    arriving = sum(_POWERS) + 60.0 * _INTO[1] / (_INTO[1] + _AWAY[1])
    interface = arriving / (ways[0] + 3 * ways[1])
    lining = (_INTO[1] * interface + 20.0) / (_INTO[1] + _AWAY[1])

    glow = (
        "root: ε σ (T⁴ − T_a⁴) + h (T − T_a) = P − Q, Q = λ ΔT/δ = ε σ (T_b⁴ − "
        "T_s⁴) = λ_s ΔT_s/δ_s"
    )
    of_rim = f"{FORM}Σ P/Σ 1/R over rim and linings"
    faced = [
        ("wall at its front", glow, face - Q * half[0], "wall[1]"),
        ("wall at its back", glow, back + Q * half[0], "wall[4]"),
        ("screen", glow, front - Q * half[1], "screen[1]"),
    ]
    joined = [
        ("first", "root: balances of two junctions", first, "first"),
        ("second", "root: balances of two junctions", second(first), "second"),
    ]
    entered = [
        (
            "rim",
            of_rim,
            _INTO[0] * interface / (_INTO[0] + _AWAY[0]),
            lambda T: T["rim"] - AIR,
        ),
        ("lining", of_rim, lining, lambda T: T["lining[2]"] - AIR),
    ]
    return [
        *cases_of("faces that radiate", run, 1e-10, faced),
        *cases_of("radiating junctions", run, 1e-11, joined),
        *cases_of("heat into an interface", run, 1e-11, entered),
    ]


# --- networks over time -------------------------------------------------------------


def transient_cases():
    """A lump that radiates through a junction without capacity, and a wall whose
    specific heat grows as it warms."""
    C = 500.0
    G = 6.0
    glow = 0.9 * 0.4
    start = 900.0
    end = 400.0
    b = 8e-4
    met = 300.0
    flux = 20e3
    thickness = 0.01
    wall = Wall(
        "wall",
        Material(60.0, 7800.0, 480.0, specific_heat_slope=b, reference=met),
        thickness,
        1.0,
        4,
    )
    heat = Heat(
        (Lump("lump", C, start), Reservoir("space", 0.0), Junction("skin"), wall),
        (Conductance("lump", "skin", G), Radiation("skin", 0.4, 0.9, "space")),
        sources=(Source("wall.front", ramp(flux, 0.0, 0.0, 200.0)),),
    )
    run = functools.cache(lambda: simulate_heat(heat, [0.0, end], rtol=1e-12))
    k = glow * SIGMA / G

    def of_skin(T):
        """Temperature of the lump: `G (T − T_s) = ε σ A T_s⁴`."""
        return T + k * T**4

    def elapsed(T):
        return C / G * ((T**-3) / (3 * k) - 4 * math.log(T))

    first = brentq(lambda T: of_skin(T) - start, 1.0, start, xtol=1e-12)
    last = brentq(lambda T: elapsed(T) - elapsed(first) - end, 1.0, first, xtol=1e-12)
    content = (
        (AIR - met)
        + b * (AIR - met) ** 2 / 2
        + flux * 200.0 / 2 / (7800.0 * 480.0 * thickness)
    )
    warmed = met + (math.sqrt(1 + 2 * b * content) - 1) / b
    skin = (
        "temperature",
        f"{FORM}1/(3 k T_s³) − 4 ln T_s rises by G t/C, T = T_s + k T_s⁴, k = ε σ A/G",
        of_skin(last),
        lambda found: found.temperature[-1, 0],
    )
    even = (
        "temperature",
        f"{FORM}∫ q dt = ρ c d [(T − T_r) + b (T − T_r)²/2]",
        warmed,
        lambda found: np.mean(found.temperature[-1, 1:]),
    )
    return [
        *cases_of("radiation through a junction", run, 1e-10, [skin]),
        *cases_of("specific heat by temperature", run, 1e-10, [even]),
    ]


CASES = (
    steady_network_cases,
    transient_cases,
)
