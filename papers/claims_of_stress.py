"""Claims of S and Z: thermal stress of the rim, and the cycles of it to a first
crack."""

import itertools
import math

import numpy as np
from claim import Found, Runs, claim, judged, layers_of
from scipy.optimize import brentq

import simbrake as sb

STEEL = sb.formulas.rim_material("steel_20L").elastic


def thermal_stress(result: sb.Result, t: np.ndarray) -> sb.formulas.StressHistory:
    T, depth = layers_of(result, t, "rim")
    return sb.formulas.stress_over_time(t, T, depth, STEEL)


def rainflow(course: np.ndarray) -> list[tuple[float, float]]:
    """Ranges and counts of the cycles of a course, by ASTM E1049."""
    course = course[np.append(True, np.diff(course) != 0)]
    inside = np.flatnonzero(np.diff(course)[1:] * np.diff(course)[:-1] < 0) + 1
    turns = course[np.concatenate([[0], inside, [-1]])]
    left = []
    found = []
    for x in turns:
        left.append(x)
        while len(left) >= 3 and (inner := abs(left[-2] - left[-3])) <= abs(
            left[-1] - left[-2]
        ):
            found.append((inner, 1.0 if len(left) > 3 else 0.5))
            left[-3:] = left[-1:] if len(left) > 3 else left[-2:]
    return found + [(abs(b - a), 0.5) for a, b in itertools.pairwise(left)]


def cycles_to_crack(strain: float) -> float:
    """Cycles of a range of strain to a crack: Coffin–Manson with Manson's universal
    slopes, steel 20L."""
    # GOST 977: least strength and reduction of area
    tensile = 412e6
    ductility = -math.log(1 - 0.35)
    elastic = 3.5 * tensile / STEEL.young
    return 10 ** brentq(
        lambda n: elastic * 10 ** (-0.12 * n) + (ductility / 10**n) ** 0.6 - strain,
        -2,
        60,
    )


@claim(
    "S",
    "introduction",
    "thermal stress of the rim is far above the permissible one",
    "one stop of 80 t",
)
def over_permissible(runs: Runs) -> Found:
    t = np.linspace(0.0, 5.0, 1001)
    at, stress, ratio = thermal_stress(runs.heavy, t).worst
    limit = STEEL.permissible / 1e6
    text = (
        f"{stress / 1e6:.0f} MPa at {at:.2f} s, {ratio:.2f} times the permissible "
        f"{limit:.0f} MPa (assumption)"
    )
    return Found(ratio, text, judged(ratio > 2, ratio > 1))


@claim(
    "Z",
    "review, [6]",
    "high temperature gradients and thermal stress start microcracks in the metal",
    "stops of 80 t from cold; rainflow and Coffin–Manson",
)
def microcracks(runs: Runs) -> Found:
    elastic = STEEL
    t = np.linspace(0.0, 60.0, 6001)
    ripple = sb.formulas.track_ripple(runs.heavy, t)
    turns = np.cumsum(np.gradient(t) / ripple.period)
    swing = 0.5 * np.asarray(ripple.amplitude) * np.sign(np.sin(2 * math.pi * turns))
    per_kelvin = elastic.young * elastic.expansion / (1 - elastic.poisson)
    stress = thermal_stress(runs.heavy, t).surface - per_kelvin * swing
    cycles = [
        (size / per_kelvin * elastic.expansion, count)
        for size, count in rainflow(stress)
    ]
    stops = 1 / sum(
        count / cycles_to_crack(strain) for strain, count in cycles if strain > 0
    )
    needed = brentq(
        lambda rise: cycles_to_crack(elastic.expansion * rise) - 1e4, 50.0, 3000.0
    )
    reach = (
        float(np.max(sb.formulas.transmission_table().temperature)) - sb.thermal.ROOM
    )
    text = (
        f"after {stops:.1e} stops, whose largest strain is "
        f"{1e3 * max(strain for strain, _ in cycles):.1f}e-3; within "
        f"1e4 cycles if the track swings by {needed:.0f} K against the rim, of "
        f"{reach:.0f} K that V's table allows"
    )
    return Found(stops, text, judged(stops < 1e4, needed < reach))
