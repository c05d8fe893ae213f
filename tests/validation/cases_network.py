"""Validation of thermal networks alone: walls, faces and junctions, a pulley's structure, and formulas of heat."""

import functools
import math
from typing import Any

import numpy as np
from case_tools import AIR, FORM, SIGMA, Case, Row, cases_of
from scipy.optimize import brentq

from simbrake import Heat, Material, layered_heat, ramp, simulate_heat, steady_state
from simbrake.thermal import (
    Conductance,
    ConstantPartition,
    Convection,
    FrictionHeat,
    Junction,
    Lump,
    Radiation,
    Reservoir,
    Source,
    ThermalContact,
    Wall,
    axial_resistance,
    layer_growth,
    radiation_governs_above,
    with_pulley_structure,
)

# --- networks in the steady state -------------------------------------------------------------------------------------

# air and the two ends of the wall whose conductivity changes (K); its conductivity (W/(m·K)), slope, reference
_HOT, _COLD, _LAYERS = 500.0, 300.0, 81
_CONDUCTS, _BENDS, _MET = 40.0, 2e-3, 300.0
# wall and screen: flux into the wall (W), thickness (m) and conductivity of each, emissivity towards air and screen, h
_FLUX, _THICK, _GLOW, _BEHIND, _H = 6e3, ((0.02, 30.0), (0.01, 5.0)), 0.8, 0.4, 12.0
# junctions: conductances (W/K) of hot reservoir and first, first and second, second and cold; radiating areas
_G = 8.0, 3.0, 2.0
# friction heat of three linings (W) at an interface: conductances to rim and lining, and of these to the air
_POWERS, _INTO, _AWAY = (40.0, 90.0, 170.0), (12.0, 4.0), (2.0, 1.0)
# structure of a pulley: inner and outer radius, width (m) of flange, two rim lips, disc (V, table 1), of two pulleys
_PARTS = (0.420, 0.565, 0.035), (0.565, 0.615, 0.025), (0.575, 0.615, 0.025), (0.575, 0.590, 0.025)
_HUB, _STEEL = 900.0, (48.0, 7850.0, 480.0)


def _network() -> Heat:
    """One network of five that do not touch: of each some temperatures are compared."""
    plain = [Material(k, 7800.0, 480.0) for _, k in _THICK]
    bent = Material(_CONDUCTS, 7800.0, 480.0, _BENDS, reference=_MET)
    bodies = (
        *(Reservoir("air", AIR), Reservoir("hot", _HOT), Reservoir("cold", _COLD)),
        *(Lump("rim", 1e3), Lump("lining", 100.0, count=3), Lump("ring", 1e3), Lump("hub", 1e3)),
        Wall("bent", bent, 0.03, 1.0, _LAYERS),
        *(Wall(name, m, d, 1.0, 4) for name, m, (d, _) in zip(("wall", "screen"), plain, _THICK, strict=True)),
        *(Junction("first"), Junction("second"), Junction("interface")),
    )
    links = (
        *(ThermalContact("bent.front", "hot", 1.0), ThermalContact("bent.back", "cold", 1.0)),
        # one end or the other of a link is the face
        *(Radiation("wall.front", 1.0, 0.3), Radiation("air", 1.0, _GLOW - 0.3, "wall.front")),
        Convection("wall.front", 1.0, _H),
        *(Radiation("wall.back", 1.0, _BEHIND, "screen.front"), ThermalContact("screen.back", "cold", 1.0)),
        *(Conductance("hot", "first", _G[0]), Conductance("first", "second", _G[1])),
        *(Radiation("first", 0.5, 0.9), Conductance("second", "cold", _G[2]), Radiation("second", 0.2, 0.6)),
        *(Conductance("interface", "rim", _INTO[0]), Conductance("interface", "lining", _INTO[1])),
        *(Conductance("rim", "air", _AWAY[0]), Conductance("lining", "air", _AWAY[1])),
        Conductance("ring", "air", 1 / axial_resistance(0.1, 48.0, 0.55, 0.59)),
    )
    pair = FrictionHeat("interface", "interface", ConstantPartition(0.5), "rim")
    sources = Source("wall.front", _FLUX), Source("ring", 1e3), Source("hub", _HUB), Source("lining", 60.0)
    heat = Heat(bodies, links, pair, sources)
    return with_pulley_structure(heat, Material(*_STEEL), rim_place="hub", pulleys=2)


def steady_network_cases() -> list[Case]:
    """Steady temperatures of walls, faces and junctions at which several flows meet, and of a pulley's structure."""
    run = functools.cache(lambda: steady_state(_network(), power=np.asarray(_POWERS)))

    # Kirchhoff's transform is linear in the depth
    def transform(T: float) -> float:
        return (T - _MET) + _BENDS * (T - _MET) ** 2 / 2

    middle = _MET + (math.sqrt(1 + _BENDS * (transform(_HOT) + transform(_COLD))) - 1) / _BENDS

    def faces(Q: float) -> tuple[float, float, float]:
        """Temperatures of the wall's two faces and of the screen's front for a heat flow through them."""
        front = _COLD + Q * _THICK[1][0] / _THICK[1][1]
        back = (front**4 + Q / (_BEHIND * SIGMA)) ** 0.25
        return back + Q * _THICK[0][0] / _THICK[0][1], back, front

    def rejected(Q: float) -> float:
        T = faces(Q)[0]
        return _GLOW * SIGMA * (T**4 - AIR**4) + _H * (T - AIR) + Q - _FLUX

    Q: Any = brentq(rejected, 1.0, _FLUX, xtol=1e-12)
    half = [d / (8 * k) for d, k in _THICK]
    face, back, front = faces(Q)

    def second(first: float) -> float:
        """Temperature of the second junction, from the balance of the first."""
        left = _G[0] * (_HOT - first) - 0.5 * 0.9 * SIGMA * (first**4 - AIR**4)
        return first - left / _G[1]

    def excess(first: float) -> float:
        T = second(first)
        return _G[1] * (first - T) - _G[2] * (T - _COLD) - 0.2 * 0.6 * SIGMA * (T**4 - AIR**4)

    first: Any = brentq(excess, AIR, _HOT, xtol=1e-12)

    # of the interface: conductance to the air by each way, and heat that arrives from 20 W in each lining
    ways = [a * b / (a + b) for a, b in zip(_INTO, _AWAY, strict=True)]
    arriving = sum(_POWERS) + 60.0 * _INTO[1] / (_INTO[1] + _AWAY[1])
    interface = arriving / (ways[0] + 3 * ways[1])
    lining = (_INTO[1] * interface + 20.0) / (_INTO[1] + _AWAY[1])

    def towards_air(inner: float, outer: float, width: float) -> tuple[float, float]:
        """Resistance (K/W) from the hub to a part, and from the part to the air."""
        area = math.pi * (outer**2 - inner**2)
        return math.log(outer / inner) / (2 * math.pi * _STEEL[0] * width) / 2, 1 / (10.0 * 2 * area * 2)

    hub = _HUB / sum(1 / sum(towards_air(*part)) for part in _PARTS)
    flange = hub * towards_air(*_PARTS[0])[1] / sum(towards_air(*_PARTS[0]))
    ring = 1e3 * 0.1 / (48.0 * math.pi * (0.59**2 - 0.55**2))
    mass = sum(2 * math.pi * (outer**2 - inner**2) * width for inner, outer, width in _PARTS) * _STEEL[1]

    def structure() -> float:
        named = {body.name: body for body in _network().bodies if isinstance(body, Lump)}
        return float(sum(named[name].capacity for name in ("flange", "rebord_1", "rebord_2", "disc")))

    glow = "root: ε σ (T⁴ − T_a⁴) + h (T − T_a) = P − Q, Q = λ ΔT/δ = ε σ (T_b⁴ − T_s⁴) = λ_s ΔT_s/δ_s"
    of_rim = f"{FORM}Σ P/Σ 1/R over rim and linings"
    of_hub = f"{FORM}P = Σ ΔT/(R_k + 1/h A_k), R_k = ln(R/r)/(2π λ L)"
    faced: list[Row] = [
        ("wall at its front", glow, face - Q * half[0], "wall[1]"),
        ("wall at its back", glow, back + Q * half[0], "wall[4]"),
        ("screen", glow, front - Q * half[1], "screen[1]"),
    ]
    joined: list[Row] = [
        ("first", "root: balances of two junctions", first, "first"),
        ("second", "root: balances of two junctions", second(first), "second"),
    ]
    entered: list[Row] = [
        ("rim", of_rim, _INTO[0] * interface / (_INTO[0] + _AWAY[0]), lambda T: T["rim"] - AIR),
        ("lining", of_rim, lining, lambda T: T["lining[2]"] - AIR),
    ]
    parts: list[Row] = [
        ("hub", of_hub, hub, lambda T: T["hub"] - AIR),
        ("flange", of_hub, flange, lambda T: T["flange"] - AIR),
        ("ring along its axis", f"{FORM}P L/(λ π (R² − r²))", ring, lambda T: T["ring"] - AIR),
        ("capacity", f"{FORM}Σ n ρ c π (R² − r²) L", mass * _STEEL[2], lambda T: structure()),
    ]
    of_wall = f"{FORM}Kirchhoff: θ + b θ²/2 is linear in the depth"
    return [
        *cases_of("conductivity by temperature", run, 1e-5, [("middle", of_wall, middle, "bent[41]")]),
        *cases_of("faces that radiate", run, 1e-10, faced),
        *cases_of("radiating junctions", run, 1e-11, joined),
        *cases_of("heat into an interface", run, 1e-11, entered),
        *cases_of("structure of a pulley", run, 1e-11, parts),
    ]


# --- networks over time -----------------------------------------------------------------------------------------------


def transient_cases() -> list[Case]:
    """A lump that radiates through a junction without capacity, and a wall whose specific heat grows as it warms."""
    C, G, glow, start, end = 500.0, 6.0, 0.9 * 0.4, 900.0, 400.0
    b, met, flux, thickness = 8e-4, 300.0, 20e3, 0.01
    wall = Wall("wall", Material(60.0, 7800.0, 480.0, specific_heat_slope=b, reference=met), thickness, 1.0, 4)
    heat = Heat(
        (Lump("lump", C, start), Reservoir("space", 0.0), Junction("skin"), wall),
        (Conductance("lump", "skin", G), Radiation("skin", 0.4, 0.9, "space")),
        sources=(Source("wall.front", ramp(flux, 0.0, 0.0, 200.0)),),
    )
    run = functools.cache(lambda: simulate_heat(heat, [0.0, end], rtol=1e-12))
    k = glow * SIGMA / G

    def of_skin(T: float) -> float:
        """Temperature of the lump: `G (T − T_s) = ε σ A T_s⁴`."""
        return T + k * T**4

    def elapsed(T: float) -> float:
        return C / G * ((T**-3) / (3 * k) - 4 * math.log(T))

    first: Any = brentq(lambda T: of_skin(T) - start, 1.0, start, xtol=1e-12)
    last: Any = brentq(lambda T: elapsed(T) - elapsed(first) - end, 1.0, first, xtol=1e-12)
    content = (AIR - met) + b * (AIR - met) ** 2 / 2 + flux * 200.0 / 2 / (7800.0 * 480.0 * thickness)
    warmed = met + (math.sqrt(1 + 2 * b * content) - 1) / b
    skin: Row = (
        "temperature",
        f"{FORM}1/(3 k T_s³) − 4 ln T_s rises by G t/C, T = T_s + k T_s⁴, k = ε σ A/G",
        of_skin(last),
        lambda found: found.temperature[-1, 0],
    )
    even: Row = (
        "temperature",
        f"{FORM}∫ q dt = ρ c d [(T − T_r) + b (T − T_r)²/2]",
        warmed,
        lambda found: np.mean(found.temperature[-1, 1:]),
    )
    return [
        *cases_of("radiation through a junction", run, 1e-10, [skin]),
        *cases_of("specific heat by temperature", run, 1e-10, [even]),
    ]


def formula_cases() -> list[Case]:
    """Temperature above which radiation carries more than convection, growing layers, also as built, and effusivity."""
    h, glow = 10.0, 0.8
    cubic = np.roots([1.0, AIR, AIR**2, AIR**3 - h / (glow * SIGMA)])
    governs = float(cubic[np.abs(cubic.imag) < 1e-6].real.max())
    first, thickness = 1e-3, 0.02
    ratio, half = ((math.sqrt(4 * d / first - 3) - 1) / 2 for d in (thickness, thickness / 2))
    steel = Material(*_STEEL)
    rim: dict[str, Any] = {"rim": steel, "rim_thickness": 0.025, "track_area": 1.6, "partition": 0.9}
    layers: dict[str, Any] = {"lining_layers": 6, "lining_first": first, "lining_both": True}
    built = layered_heat(**rim, lining=steel, lining_thickness=thickness, lining_area=1.0, **layers)
    (lining,) = (wall for wall in built.walls if wall.name == "lining")
    return [
        *cases_of(
            "radiation over convection",
            lambda: radiation_governs_above(h, glow),
            1e-11,
            [("temperature", f"{FORM}root of T³ + T_a T² + T_a² T + T_a³ = h/ε σ", governs, lambda T: T)],
        ),
        *cases_of(
            "growing layers",
            lambda: layer_growth(first, thickness, 3),
            1e-13,
            [("ratio of three", f"{FORM}1 + r + r² = d/d_1", ratio, lambda r: r)],
        ),
        *cases_of(
            "growing layers",
            lambda: lining.steps,
            1e-12,
            [
                ("first layer of a lining", f"{FORM}d_1, as wanted", first, "0"),
                ("last layer of a lining", f"{FORM}d_1, thin at both faces", first, "5"),
                ("middle layer of a lining", f"{FORM}d/2 − d_1 (1 + r)", thickness / 2 - first * (1 + half), "2"),
            ],
        ),
        *cases_of(
            "effusivity",
            lambda: Material(48.0, 7800.0, 480.0),
            1e-14,
            [("of steel", f"{FORM}√(λ ρ c)", math.sqrt(48.0 * 7800.0 * 480.0), "effusivity")],
        ),
    ]


CASES = (
    steady_network_cases,
    transient_cases,
    formula_cases,
)
