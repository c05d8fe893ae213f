"""Engineering formulas for the temperatures of one braking: depth, Fourier numbers, bulk, surface and maximum."""

import math
from typing import Any, NamedTuple

import numpy as np

from .._base._admissible import require_not_negative, require_positive, require_share
from ..thermal._material import Material


def penetration_depth(diffusivity: Any, time: Any) -> Any:
    """Depth (m) that heat reaches in the `time` `τ` (s): `b = 1.73 √(a τ)` (S, step 1 of the synthesis).

    `1.73` is √3, so that `Fo = a τ/b² = 1/3` at that depth. `diffusivity` `a` in m²/s. Raises `ValueError` for a
    diffusivity that is not positive or a negative time.
    """
    require_positive(diffusivity=diffusivity)
    require_not_negative(time=time)
    return 1.73 * np.sqrt(diffusivity * np.asarray(time, float))


def fourier_number(diffusivity: Any, time: Any, depth: Any) -> Any:
    """`Fo = a τ/δ²` (S-15); below 0.01 the back face counts as adiabatic, S expects no more than 15.

    `diffusivity` `a` (m²/s), `time` `τ` (s), `depth` `δ` (m). Raises `ValueError` as `penetration_depth`.
    """
    require_positive(diffusivity=diffusivity, depth=depth)
    require_not_negative(time=time)
    return diffusivity * np.asarray(time, float) / np.asarray(depth, float) ** 2


def fourier_parameter(diffusivity: Any, depth: Any) -> Any:
    """`B = a/δ²` in 1/s, so that `Fo = B τ` (S, table 1, which prints 1000 times that for the rim)."""
    return fourier_number(diffusivity, 1.0, depth)


def effective_fourier_number(diffusivity: Any, time: Any, thickness: Any) -> Any:
    """Fourier number of a part, `a τ/δ²` while heat reaches through it, else 1/3 (S, step 2 of the synthesis).

    `1/3` where `1.73 √(a τ) ≤ δ`: the depth is then the penetration depth itself. Raises `ValueError` as above.
    """
    through = penetration_depth(diffusivity, time) > np.asarray(thickness, float)
    return np.where(through, fourier_number(diffusivity, time, thickness), 1 / 3)[()]


def effective_volume(area: Any, thickness: Any, depth: Any) -> Any:
    """Volume (m³) that takes up heat: `ψV = A min(b, δ)` (S, step 3), `area` `A` (m²), thicknesses in m.

    Raises `ValueError` where an argument is not positive (the depth: negative).
    """
    require_positive(area=area, thickness=thickness)
    require_not_negative(depth=depth)
    return area * np.minimum(depth, thickness)


def mean_bulk_rise(share: Any, work: Any, specific_heat: Any, mass: Any) -> Any:
    """Mean rise of the bulk temperature (K) in a braking: `ΔT_v = (2/3) a W/(c G)` (S-25).

    - `share` `a` of the friction `work` `W` (J) that goes into the part; `specific_heat` `c` (J/(kg·K)); `mass` `G`
      (kg) of its effective volume

    `2/3` is the mean over the braking of heat that comes in with a linearly falling power, `∫(2s − s²)ds` from 0 to 1;
    the rise at its end is `a W/(c G)`. Raises `ValueError` for numbers outside their ranges.
    """
    require_positive(specific_heat=specific_heat, mass=mass)
    require_not_negative(work=work)
    require_share(share=share)
    return 2 / 3 * share * work / (specific_heat * mass)


def half_space_rise(flux: Any, time: Any, effusivity: Any) -> Any:
    """Surface rise (K) of a half-space under a constant `flux` `q` (W/m²): `ΔT = 2 q √(τ/π)/e`.

    `effusivity` `e = √(λ ρ c)` (W·√s/(m²·K)). Raises `ValueError` where it is not positive or the time is negative.

    Reference: H. S. Carslaw, J. C. Jaeger, *Conduction of Heat in Solids* (1959), §2.9, eq. (7).
    """
    require_positive(effusivity=effusivity)
    require_not_negative(time=time)
    return 2 * flux * np.sqrt(np.asarray(time, float) / math.pi) / effusivity


def stopping_rise(flux: Any, time: Any, duration: Any, effusivity: Any) -> Any:
    """Surface rise (K) of a half-space while the flux falls linearly, `q(t) = q_0 (1 − t/τ)`, as in a stop:

        ΔT(t) = (2 q_0/e) √(t/π) (1 − 2 t/(3 τ)),   greatest at t = τ/2: (2/3)(2 q_0/e) √(τ/(2π))

    - `flux` `q_0` (W/m²) at first, `time` `t ≤ τ`, `duration` `τ` of the braking (s), `effusivity` `e`

    Superposition of `half_space_rise` (Carslaw & Jaeger, §2.9). Raises `ValueError` outside `0 ≤ t ≤ τ`.
    """
    require_positive(duration=duration)
    t = np.asarray(time, float)
    if np.any(t > duration):
        raise ValueError(f"time = {time} lies after the end of the braking at {duration}")
    return half_space_rise(flux, t, effusivity) * (1 - 2 * t / (3 * duration))


def slab_rise(flux: Any, time: Any, thickness: Any, material: Material, depth: Any = 0.0) -> Any:
    """Rise (K) at a `depth` `x` below the heated face of a slab with an adiabatic back, under a constant flux:

        ΔT = (q δ/λ) {Fo + (3 ξ² − 1)/6 − (2/π²) Σ (−1)ⁿ/n² exp(−n² π² Fo) cos(n π ξ)},   ξ = 1 − x/δ,  n = 1, 2, …

    - `flux` `q` (W/m²), `time` (s), `thickness` `δ` (m), `material` with its properties at the reference temperature

    Arguments broadcast. Below `Fo = 0.02`, where the series would need ever more terms, the same by images,
    `ΔT = (2 q √(a τ)/λ) [ierfc(x/ℓ) + ierfc((2 δ − x)/ℓ)]`, `ℓ = 2 √(a τ)`; the next image would add 1e-22 of it.
    Raises `ValueError` where the thickness is not positive or the time is negative.

    Reference: Carslaw & Jaeger (1959), §3.8, eqs. (3), (4).
    """
    conductivity = float(material.conductivity)
    xi = 1 - np.asarray(depth, float) / thickness
    Fo, xi = np.broadcast_arrays(fourier_number(float(material.diffusivity), time, thickness), xi)
    rise = np.where(Fo < 0.02, _by_images(Fo, xi), _by_series(np.maximum(Fo, 0.02), xi))
    return (flux * thickness / conductivity * rise)[()]


def _by_series(Fo: Any, xi: Any) -> Any:
    n = np.arange(1, 16, dtype=float)
    terms = (-1.0) ** n / n**2 * np.exp(-(n**2) * math.pi**2 * Fo[..., None]) * np.cos(n * math.pi * xi[..., None])
    return Fo + (3 * xi**2 - 1) / 6 - 2 / math.pi**2 * terms.sum(axis=-1)


def _by_images(Fo: Any, xi: Any) -> Any:
    from scipy.special import erfc

    length = 2 * np.sqrt(np.where(Fo > 0, Fo, 1.0))
    near, far = (1 - xi) / length, (1 + xi) / length
    ierfc = sum(np.exp(-(u**2)) / math.sqrt(math.pi) - u * erfc(u) for u in (near, far))
    return np.where(Fo > 0, length * ierfc, 0.0)


class MaximumTemperatures(NamedTuple):
    """Readings of the maximum temperature of a friction surface side by side (K, or rises in K)."""

    surface_and_third_flash: Any  # S-26: t_s + t_flash/3
    printed: Any  # S-27 as the scan shows it: t_v + t_s/3 + t_flash/3
    plain_sum: Any  # t_v + t_s + t_flash


def maximum_temperatures(bulk: Any, surface: Any, flash: Any) -> MaximumTemperatures:
    """The maximum temperature in the combinations of S (S-26, S-27) and as a plain sum, of rises in K:

        S-26: t_s + t_flash/3;   S-27: t_v + t_s/3 + t_flash/3 (doubtful scan);   sum: t_v + t_s + t_flash

    - `bulk` `t_v`, `surface` `t_s`, `flash` `t_flash`: rises (K)

    Where `t_s` is the whole rise of the surface, as most formulas give it, the two that add `t_v` count the bulk twice;
    where it is the rise above the bulk, S-26 leaves the bulk out.
    They part by as much as the factors say: S names no condition under which one of them holds beyond the kind of
    braking (single, or repeated at short intervals). Raises `ValueError` for negative rises.
    """
    require_not_negative(bulk=bulk, surface=surface, flash=flash)
    return MaximumTemperatures(surface + flash / 3, bulk + surface / 3 + flash / 3, bulk + surface + flash)
