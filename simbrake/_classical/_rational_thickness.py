"""Rational thickness of rim and lining: how much a braking can make use of, and how much keeps the back cool."""

import math
from typing import Any, NamedTuple

import numpy as np

from .._base._admissible import require_not_negative, require_positive
from ..thermal._material import Material
from ._thermal_estimates import fourier_number, penetration_depth


class RimThickness(NamedTuple):
    """Rational thickness of a rim (m), and the two that it is the greater of."""

    depth: float  # heat of one braking just reaches the back
    storage: float  # the heat warms all of it just to the permissible temperature; `inf` where there is no room for any
    rational: float


class LiningThickness(NamedTuple):
    """Rational thickness of a lining (m), and the two that it is the greater of."""

    depth: float  # heat of one braking just reaches the back
    insulation: float  # the back just reaches its permissible temperature; `inf` where it starts there
    rational: float


def rational_rim_thickness(material: Material, time: float, *, heat: float, rise: float) -> RimThickness:
    """Thickness of a rim that a braking makes use of and that can hold its heat (S, step 8):

        δ_1 = 1.73 √(a τ)          Fo = a τ/δ² = 1/3: what lies deeper takes up no heat before the braking is over
        δ_2 = Q/(ρ c ΔT_p)         the heat Q, spread over the thickness, warms it by the permissible rise
        δ = max(δ_1, δ_2)

    - `material` at the temperature of its properties; `time` `τ` (s); `heat` `Q` (J/m²) into the track; `rise` `ΔT_p`
      (K), permissible, of the bulk; not above 0: no thickness will do

    S names a rational thickness and not its condition: that heat reaches through is the condition of its steps 1 and 2.
    Raises `ValueError` for a negative time or heat.
    """
    require_not_negative(time=time, heat=heat)
    depth = float(penetration_depth(float(material.diffusivity), time))
    storage = heat / float(material.density * material.specific_heat) / rise if rise > 0 else math.inf
    return RimThickness(depth, storage, max(depth, storage))


def held_face_rise(Fo: Any) -> Any:
    """Rise of the adiabatic back of a slab over that of its face, which is held from the first moment:

        θ(Fo) = 1 − (4/π) Σ (−1)ⁿ/(2n + 1) exp(−(2n + 1)² π² Fo/4),   n = 0, 1, …

    - `Fo`: Fourier number of the thickness

    Below `Fo = 0.2` by images, `2 Σ (−1)ⁿ erfc((2n + 1)/(2 √Fo))`. Raises `ValueError` for a negative one.

    Reference: Carslaw & Jaeger (1959), §3.4, eqs. (5), (6).
    """
    from scipy.special import erfc

    require_not_negative(Fo=Fo)
    F = np.asarray(Fo, float)
    n = np.arange(8)
    odd, sign = 2.0 * n + 1, (-1.0) ** n
    late = 1 - 4 / math.pi * np.sum(sign / odd * np.exp(-(odd**2) * math.pi**2 * F[..., None] / 4), axis=-1)
    root = 2 * np.sqrt(np.where(F > 0, F, 1.0))
    early = np.where(F > 0, 2 * np.sum(sign * erfc(odd / root[..., None]), axis=-1), 0.0)
    return np.where(F < 0.2, early, late)[()]


def back_temperature(material: Material, thickness: float, time: float, *, face: float, start: float) -> float:
    """Temperature (K) of the back of a lining whose `face` (K) is held for the `time` (s), from `start` (K).

    `T_0 + (T_f − T_0) θ(a τ/δ²)` by `held_face_rise`; an upper bound where the face is that hot only for a while.
    Raises `ValueError` where thickness, face or start is not positive or the time is negative.
    """
    require_positive(thickness=thickness, face=face, start=start)
    Fo = fourier_number(float(material.diffusivity), time, thickness)
    return start + (face - start) * float(held_face_rise(Fo))


def rational_lining_thickness(
    material: Material, time: float, *, face: float, back: float, start: float
) -> LiningThickness:
    """Thickness of a lining that a braking makes use of and that keeps its back (bond, rivets) cool (S, step 8):

        δ_1 = 1.73 √(a τ)
        δ_2 = √(a τ/Fo_p),   θ(Fo_p) = (T_p − T_0)/(T_f − T_0)        (`held_face_rise`)
        δ = max(δ_1, δ_2)

    - `material` at the temperature of its properties; `time` `τ` (s) for which the `face` is at `T_f` (K); `back` `T_p`
      (K): its permissible temperature; `start` `T_0` (K)

    `δ_2` is 0 where the face itself is not hotter than `T_p`. Wear comes on top of it. Raises `ValueError` where a
    temperature is not positive or the time is negative.
    """
    require_positive(face=face, back=back, start=start)
    depth = float(penetration_depth(float(material.diffusivity), time))
    if start >= back:
        insulation = math.inf
    elif face <= back:
        insulation = 0.0
    else:
        insulation = math.sqrt(float(material.diffusivity) * time / _held_face_number((back - start) / (face - start)))
    return LiningThickness(depth, insulation, max(depth, insulation))


def _held_face_number(theta: float) -> float:
    """Fourier number at which the back has the share `theta` (0…1) of the face's rise."""
    from scipy.optimize import brentq

    low, high = 1e-3, 20.0  # θ is 1e-110 and 1 there
    if held_face_rise(low) >= theta:
        return low
    return float(brentq(lambda Fo: float(held_face_rise(Fo)) - theta, low, high, xtol=1e-15, rtol=1e-13))  # pyright: ignore
