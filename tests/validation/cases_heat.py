"""Validation of heat: thermal networks alone, and brakes whose friction fades as they warm up."""

import functools
import math
from typing import Any, TypeAlias

import diffrax
import numpy as np
from case_tools import FORM, SIGMA, Case, cases_of
from jaxtyping import Float
from scipy.optimize import brentq, minimize_scalar
from scipy.special import dawsn

from simbrake import Heat, Material, PiecewiseLinear, ramp, simulate_heat, steady_state
from simbrake.profiles import ExponentialRise
from simbrake.thermal import (
    ROOM,
    Convection,
    Junction,
    Lump,
    Radiation,
    Reservoir,
    Source,
    ThermalContact,
    Wall,
    layer_growth,
)

_K, _A = 50.0, 1.4e-5  # conductivity and diffusivity of the half-spaces
_STEEL = Material(_K, 7800.0, _K / (7800.0 * _A))

# --- lumps ------------------------------------------------------------------------------------------------------------


def _temperatures(
    subject: str,
    heat: Heat,
    source: str,
    truths: dict[float, tuple[str, float]],
    tolerance: float = 1e-9,
    rtol: float = 1e-12,
    less: float = 0.0,
) -> list[Case]:
    """Cases of the first temperature of a network: names and truths at times (s); `less`: taken from it (K)."""
    rows = [
        (name, source, truth, lambda T, i=i: T[i, 0] - less) for i, (name, truth) in enumerate(truths.values(), start=1)
    ]
    return cases_of(subject, lambda: simulate_heat(heat, [0.0, *truths], rtol=rtol).temperature, tolerance, rows)


def _radiated(T0: float, Ta: float, c: float, t: float) -> float:
    """Root T of `∫ dT/(T⁴ − T_a⁴) = −c t`: the lump that radiates to surroundings at `T_a`, in implicit closed form."""
    if Ta == 0:
        return T0 * (1 + 3 * c * T0**3 * t) ** (-1 / 3)

    def integral(T: float) -> float:
        return (math.log((T - Ta) / (T + Ta)) - 2 * math.atan(T / Ta)) / (4 * Ta**3)

    found: Any = brentq(lambda T: integral(T) - integral(T0) + c * t, Ta * (1 + 1e-13), T0, xtol=1e-12)
    return found


def radiation_cases() -> list[Case]:
    """A lump at 900 K that radiates to 0 K and to 300 K."""
    T0, eps, mc, found = 900.0, 0.8, 1e4, []
    for Ta, form in ((0.0, "T_0(1 + 3εσA T_0³t/mc)^(−1/3)"), (300.0, "∫ dT/(T⁴ − T_a⁴) = −εσA t/mc")):
        heat = Heat((Lump("a", mc, T0), Reservoir("air", Ta)), (Radiation("a", 1.0, eps),))
        truths = {t: (f"T at {t:.0f} s", _radiated(T0, Ta, eps * SIGMA / mc, t)) for t in (60.0, 600.0, 3600.0)}
        found += _temperatures(f"radiation to {Ta:.0f} K", heat, f"{FORM}{form}", truths)
    return found


def repeated_cases() -> list[Case]:
    """Stops once a minute that warm a drum by 40 K each, in pulses of 1 µs."""
    C, b, t_c, rise, pulse = 1000.0, 1 / 300, 60.0, 40.0, 1e-6
    starts = np.arange(10) * t_c
    times = np.sort(np.concatenate([starts, starts, starts + pulse, starts + pulse]))
    power = np.tile([0.0, 1.0, 1.0, 0.0], 10) * rise * C / pulse
    heat = Heat(
        (Lump("drum", C, 300.0), Reservoir("air", 300.0)),
        (Convection("drum", 1.0, C * b),),
        sources=(Source("drum", PiecewiseLinear(times, power)),),
    )
    source = "Limpert, Brake Design and Safety: ΔT(1 − e^(−n b t_c))/(1 − e^(−b t_c))"
    truths = {
        (n - 1) * t_c + pulse: (f"rise after {n}", rise * math.expm1(-n * b * t_c) / math.expm1(-b * t_c))
        for n in (1, 5, 10)
    }
    # the pulse lasts 1 µs of the 300 s in which the drum cools
    return _temperatures("repeated stops", heat, source, truths, tolerance=1e-7, rtol=1e-11, less=300.0)


# --- walls ------------------------------------------------------------------------------------------------------------

_TIMES = np.linspace(0.0, 2.0, 81)


#: depths of the layers (m) and their rises (K) at `_TIMES`
Rises: TypeAlias = tuple[Float[np.ndarray, " layer"], Float[np.ndarray, "81 layer"]]


def _heated(layers: int, q: float, q_end: float) -> Rises:
    """Depths of the layers of a half-space (m) and their rises (K) at `_TIMES`, the flux a straight line in time."""
    wall = Wall("w", _STEEL, 0.048, 1.0, layers)
    heat = Heat((wall,), sources=(Source("w.front", ramp(q, q_end, 0.0, float(_TIMES[-1]))),))
    run = simulate_heat(heat, _TIMES, rtol=1e-9, solver=diffrax.Dopri8())
    return np.asarray(wall.centres), np.asarray(run.temperature) - ROOM


def _hottest(rise: Float[np.ndarray, "81"]) -> tuple[float, float]:
    """Time and height of the maximum of a course at `_TIMES`, of the parabola through its three highest points."""
    top = int(np.argmax(rise))
    a, b, c = rise[top - 1 : top + 2]
    off = 0.5 * (a - c) / (a - 2 * b + c)
    return float(_TIMES[top] + off * (_TIMES[1] - _TIMES[0])), float(b - 0.25 * (a - c) * off)


def falling_flux_cases() -> list[Case]:
    """Flux that falls in a straight line to 0: the surface is hottest at half the time."""
    q, t_s = 1e6, float(_TIMES[-1])

    def surface() -> Float[np.ndarray, "81"]:
        x, rise = _heated(108, q, 0.0)
        return rise[:, 0] + q * (1 - _TIMES / t_s) * x[0] / _K

    source = "Fazekas 1953, Newcomb 1960"
    greatest = 4 / (3 * math.sqrt(2 * math.pi)) * q * math.sqrt(t_s) / (_K / math.sqrt(_A))
    rows = [
        ("maximum rise", f"{source}: 0.53192304 q_0 √t_s/√(kρc)", greatest, np.max),
        ("time of it", f"{source}: t_s/2", t_s / 2, lambda rise: _hottest(rise)[0], 0.01),
    ]
    return cases_of("falling flux", surface, 2e-3, rows)


def fading_flux_cases() -> list[Case]:
    """Flux that fades exponentially, on a half-space of a steel of 45 W/(m·K), in layers that grow from 0.05 mm."""
    q, rate, n, thickness = 1e6, 0.8, 120, 0.04
    steel = Material(45.0, 7850.0, 480.0)
    wall = Wall("w", steel, thickness, 1.0, n, layer_growth(5e-5, thickness, n))
    flux = Source("w.front", q), Source("w.front", ExponentialRise(-q, 1 / rate))
    per_root = 2 * q / math.sqrt(math.pi * rate * 45.0 * 7850.0 * 480.0)

    def surface() -> Float[np.ndarray, "81"]:
        run = simulate_heat(Heat((wall,), sources=flux), _TIMES, rtol=1e-9)
        half = float(wall.centres[0])
        return np.asarray(run.temperature)[:, 0] - ROOM + q * np.exp(-rate * _TIMES) * half / 45.0

    source = f"{FORM}2 q_0 D(√(λ t))/√(π λ k ρ c), D of Dawson"
    top: Any = minimize_scalar(lambda x: -dawsn(x), bracket=(0.5, 1.0, 1.5), tol=1e-12)
    i, end = 12, len(_TIMES) - 1
    rows = [
        ("maximum rise", source, -per_root * top.fun, lambda rise: _hottest(rise)[1]),
        ("time of it", f"{FORM}D' = 0", top.x**2 / rate, lambda rise: _hottest(rise)[0], 3e-4),
        (f"rise at {_TIMES[i]:g} s", source, per_root * dawsn(math.sqrt(rate * _TIMES[i])), str(i), 4e-4),
        (f"rise at {_TIMES[end]:g} s", source, per_root * dawsn(math.sqrt(rate * _TIMES[end])), str(end)),
        ("maximum rise, 15 digits", "Dawson function, evaluated outside", 52.4180821839227, lambda x: _hottest(x)[1]),
    ]
    return cases_of("fading flux", surface, 2e-4, rows)


def steady_cases() -> list[Case]:
    """A wall heated and cooled at one face and held at the other, in the steady state."""
    q, h, L, Ta, Tb = 1e5, 50.0, 0.03, 300.0, 350.0
    heat = Heat(
        (Wall("w", _STEEL, L, 1.0, 4), Reservoir("air", Ta), Reservoir("back", Tb)),
        (Convection("w.front", 1.0, h), ThermalContact("w.back", "back", 1.0)),
        sources=(Source("w.front", q),),
    )
    face = (q + h * Ta + _K / L * Tb) / (h + _K / L)
    source = f"{FORM}q = h(T_f − T_a) + λ(T_f − T_b)/L"
    row = ("first layer", source, face + (Tb - face) / 8, lambda found: next(iter(found.values())))
    return cases_of("wall in steady state", lambda: steady_state(heat), 1e-8, [row])


def effusivity_cases() -> list[Case]:
    """Heat into the interface of two bodies in perfect contact: the network yields Charron's share."""
    n, thickness = 120, 0.03
    growth = layer_growth(2e-6, thickness, n)

    def share(first: Material, second: Material) -> float:
        walls = Wall("rim", first, thickness, 1.0, n, growth), Wall("lining", second, thickness, 1.0, n, growth)
        contacts = ThermalContact("face", "rim.front", 1.0), ThermalContact("face", "lining.front", 1.0)
        heat = Heat((*walls, Junction("face")), contacts, sources=(Source("face", 1e6),))
        run = simulate_heat(heat, [0.0, 0.2], rtol=1e-8)
        system: Any = run.record.system
        stored = np.asarray(system.thermal.capacity) * (np.asarray(run.temperature)[-1] - ROOM)
        return float(stored[:n].sum() / stored.sum())

    def effusivity(m: Material) -> float:
        return math.sqrt(float(m.conductivity) * float(m.density) * float(m.specific_heat))

    metals = Material(51.0, 7100.0, 51.0 / (7100.0 * 1.44e-5)), Material(34.3, 4700.0, 34.3 / (4700.0 * 1.46e-5))
    found = []
    for name, *bodies in (
        ("steel and lining", Material(45.0, 7850.0, 480.0), Material(0.8, 2000.0, 1100.0)),
        ("two metals", *metals),
    ):
        e1, e2 = map(effusivity, bodies)
        row = (name, "Charron: e1/(e1 + e2), e = √(kρc)", e1 / (e1 + e2), lambda share: share)
        found += cases_of("two bodies in contact", functools.partial(share, *bodies), 5e-4, [row])
    return found


CASES = (
    effusivity_cases,
    radiation_cases,
    repeated_cases,
    falling_flux_cases,
    fading_flux_cases,
    steady_cases,
)
