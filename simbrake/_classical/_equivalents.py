"""One equivalent number for parts in a row or side by side: resistances, conductivity, capacity, density, gradients."""

from typing import Any

import numpy as np

from .._base._admissible import require_not_negative, require_positive


def series_resistance(*resistances: Any) -> Any:
    """`R = Σ R_i` (K/W) of parts that the same heat passes one after the other (S-30). Raises `ValueError` below 0."""
    for R in resistances:
        require_not_negative(resistance=R)
    return sum(resistances)


def parallel_resistance(*resistances: Any) -> Any:
    """`1/R = Σ 1/R_i` (K/W) of parts between the same two temperatures (S-30). Raises `ValueError` where one is ≤ 0."""
    for R in resistances:
        require_positive(resistance=R)
    return 1 / sum(1 / R for R in resistances)


def series_conductivity(thickness: Any, conductivity: Any) -> Any:
    """Conductivity (W/(m·K)) of layers (k,) that heat passes one after the other: `λ = Σ δ_k/Σ(δ_k/λ_k)` (S-30).

    The reading of a garbled formula that keeps the resistance of the layers. Raises `ValueError` where a number ≤ 0.
    """
    require_positive(thickness=thickness, conductivity=conductivity)
    thickness = np.asarray(thickness, float)
    return np.sum(thickness) / np.sum(thickness / np.asarray(conductivity, float))


def parallel_conductivity(area: Any, conductivity: Any) -> Any:
    """Conductivity (W/(m·K)) of parts (k,) side by side: `λ = Σ λ_k A_k/Σ A_k` (S-30). Raises `ValueError` as above."""
    require_positive(area=area, conductivity=conductivity)
    area = np.asarray(area, float)
    return np.sum(area * np.asarray(conductivity, float)) / np.sum(area)


def equivalent_specific_heat(mass: Any, specific_heat: Any) -> Any:
    """`c = Σ G_k c_k/Σ G_k` (J/(kg·K)) of layers (k,) of the masses `G_k` (S-32). Raises `ValueError` as above."""
    require_positive(mass=mass, specific_heat=specific_heat)
    mass = np.asarray(mass, float)
    return np.sum(mass * np.asarray(specific_heat, float)) / np.sum(mass)


def equivalent_density(mass: Any, volume: Any) -> Any:
    """`ρ = Σ m_k/Σ V_k` (kg/m³) of layers (k,) (S-33, a sum of quotients in the scan). Raises `ValueError` as above."""
    require_positive(mass=mass, volume=volume)
    return np.sum(np.asarray(mass, float)) / np.sum(np.asarray(volume, float))


def equivalent_diffusivity(conductivity: Any, density: Any, specific_heat: Any) -> Any:
    """`a = λ/(ρ c)` (m²/s) of the equivalent numbers (S-31). Raises `ValueError` where one of them is not positive."""
    require_positive(conductivity=conductivity, density=density, specific_heat=specific_heat)
    return conductivity / (density * specific_heat)


def current_density(conductivity: Any, change: Any, depth: Any) -> Any:
    """Current through a layer per area: `j = σ Δφ/δ` electrical (S-22, A/m²), `q = λ ΔT/δ` thermal (S-23, W/m²).

    - `conductivity` `σ` (S/m) or `λ` (W/(m·K)); `change` `Δφ` (V) or `ΔT` (K) over the `depth` `δ` (m)

    S calls the quotient `Δφ/δ` the gradient; with `conductivity=1` it is that. Raises `ValueError` where conductivity
    or depth is not positive.
    """
    require_positive(conductivity=conductivity, depth=depth)
    return conductivity * change / depth
