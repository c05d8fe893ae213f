"""Contact and surfaces: areas, radiation, triboelectricity, and equivalents of parts in
series or parallel."""

import math
from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from jaxtyping import Float

from ..._base._faults import require_not_negative, require_positive
from ...hybrid.arrays import Array
from ...thermal.network import STEFAN_BOLTZMANN

Amount: TypeAlias = float | int | Array  # one number, or an array of them
Layers: TypeAlias = Sequence[float] | Array  # a number for each layer or part
SeriesOfTimes: TypeAlias = Float[np.ndarray, " m"]  # a number at each time
# a number at each depth, or part of the track
Depths: TypeAlias = Float[np.ndarray, " k"]
Profiles: TypeAlias = Float[np.ndarray, "m k"]  # the same at each time


def real_contact_area(area: Amount, pressure: Amount, hardness: Amount) -> Amount:
    """Real contact area, plastic spots: `A_r = A_a p_a/HB` (S-34), in m².

    - `area` `A_a` (m²), nominal; `pressure` `p_a` (Pa) on it; `hardness` `HB` (Pa) of
      the softer surface

    The scan also shows a 2 in the denominator; the form with `HB` alone is that of
    plastic spots in equilibrium, which carry the pressure `HB`. Raises `ValueError`
    where area or hardness is not positive, the pressure negative or above the hardness:
    it cannot exceed the nominal area.

    Reference: F. P. Bowden, D. Tabor, *The Friction and Lubrication of Solids* (1950),
    ch. I.

    Example:
        >>> round(float(sb.formulas.real_contact_area(0.05, 1e6, 2e9)), 9)
        2.5e-05
    """
    require_positive(area=area, hardness=hardness)
    require_not_negative(pressure=pressure)
    if pressure > hardness:
        raise ValueError(
            f"pressure = {pressure} Pa exceeds the hardness of {hardness} Pa"
        )
    return area * pressure / hardness


def polished_surface(radius: Amount, width: Amount) -> Amount:
    """The friction track `A_p = 2 π R b` (S-35), in m². Raises `ValueError` where an
    argument is not positive.

    Example:
        >>> round(float(sb.formulas.polished_surface(0.59, 0.22)), 4)
        0.8156
    """
    require_positive(radius=radius, width=width)
    return 2 * math.pi * radius * width


def ring_face(inner: Amount, outer: Amount) -> Amount:
    """One face of a ring, `π (R² − r²)`, in m²: rim lip, flange or disc. Raises
    `ValueError` for `r ≥ R` or `r < 0`.

    Example:
        >>> round(float(sb.formulas.ring_face(0.3, 0.5)), 4)
        0.5027
    """
    require_not_negative(inner=inner)
    if not outer > inner:
        raise ValueError(f"outer = {outer} must exceed inner = {inner}")
    return math.pi * (outer**2 - inner**2)


def matte_surface(*areas: Amount) -> Amount:
    """Matte (unpolished) surface: `A_m = A_lips + A_flange + A_bore + …` (S-36), in m².

    Raises `ValueError` where one is negative.

    Example:
        >>> round(sb.formulas.matte_surface(0.12, 0.3, 0.5), 2)
        0.92
    """
    for area in areas:
        require_not_negative(area=area)
    return sum(areas)


def radiation_coefficient(
    emissivity: Amount, temperature: Amount, ambient: Amount
) -> Amount:
    """Heat transfer coefficient of radiation in W/(m²·K), temperatures in K (S-37
    polished, S-38 matte surfaces):

        α = C_r [(T/100)⁴ − (T_a/100)⁴]/(T − T_a),   C_r = 10⁸ ε σ

    Written as `ε σ (T² + T_a²)(T + T_a)`, which also holds at `T = T_a`. Raises
    `ValueError` for an emissivity that is negative or temperatures that are not
    positive.

    Example:
        >>> round(float(sb.formulas.radiation_coefficient(0.8, 500.0, 293.15)), 3)
        12.087
    """
    require_not_negative(emissivity=emissivity)
    require_positive(temperature=temperature, ambient=ambient)
    return (
        emissivity
        * STEFAN_BOLTZMANN
        * (temperature**2 + ambient**2)
        * (temperature + ambient)
    )


def triboelectric_power(
    current: Amount, voltage: Amount, factor: Amount = 200.0
) -> Amount:
    """Electrical share of the friction power (W): `W_el = k_v I U` (S-8). An estimate.

    - `current` `I` (A) between asperities of lining and metal; `voltage` `U` (V) at the
      end of the brake application
    - `factor` `k_v`, 2·10² as printed: represents the contact time of asperities,
      without a derivation or a unit

    The formula of S for the current (S-9) is lost: give a measured one, or
    `contact_current`. Raises `ValueError` for a negative argument.

    Example:
        >>> sb.formulas.triboelectric_power(0.5, 0.02)
        2.0
    """
    require_not_negative(current=current, voltage=voltage, factor=factor)
    return factor * current * voltage


def thermoelectric_voltage(seebeck: Amount, hot: Amount, cold: Amount) -> Amount:
    """Voltage (V) of the contact as a thermocouple: `U = S_ab (T_c − T_0)`, a
    substitute for the lost S-9. An estimate.

    - `seebeck` `S_ab` (V/K), of the pair of materials; `hot` `T_c` (K) of the spots,
      `cold` `T_0` (K) of the bodies

    Reference: R. Holm, *Electric Contacts*, 4th ed. (1967), on thermoelectric effects
    in contacts.

    Example:
        >>> round(float(sb.formulas.thermoelectric_voltage(1e-5, 500.0, 300.0)), 6)
        0.002
    """
    return seebeck * (hot - cold)


def contact_current(
    voltage: Amount, resistivity: Amount, area: Amount, spots: Amount = 1
) -> Amount:
    """Current (A) that a `voltage` `U` drives through the contact spots; a substitute
    for S-9. An estimate.

        I = U/R,   R = ρ_e/(2 n r) of n equal round spots in parallel,   n π r² = A_r

    - `resistivity` `ρ_e` (Ω·m), mean of the two bodies; `area` `A_r` (m²) real contact
      area (`real_contact_area`); `spots` `n`

    Constriction alone: films and the resistance between spots are left out, so that it
    is an upper bound. Raises `ValueError` where resistivity, area or number of spots is
    not positive.

    Reference: R. Holm, *Electric Contacts*, 4th ed. (1967), constriction resistance
    `ρ/(2 a)` of a round spot.

    Example:
        >>> round(float(sb.formulas.contact_current(2e-3, 1e-6, 2.5e-5, 100)), 2)
        112.84
    """
    require_positive(resistivity=resistivity, area=area, spots=spots)
    radius = (area / (spots * math.pi)) ** 0.5
    return voltage * 2 * spots * radius / resistivity


def series_resistance(*resistances: Amount) -> Amount:
    """`R = Σ R_i` (K/W) of parts in series (S-30). Raises `ValueError` below 0.

    Example:
        >>> sb.formulas.series_resistance(0.02, 0.03)
        0.05
    """
    for R in resistances:
        require_not_negative(resistance=R)
    return sum(resistances)


def parallel_resistance(*resistances: Amount) -> Amount:
    """`1/R = Σ 1/R_i` (K/W) of parts in parallel (S-30). Raises `ValueError` where one
    is ≤ 0, or none is given.

    Example:
        >>> round(sb.formulas.parallel_resistance(0.02, 0.03), 4)
        0.012
    """
    if not resistances:
        raise ValueError("resistances: none is given")
    for R in resistances:
        require_positive(resistance=R)
    return 1 / sum(1 / R for R in resistances)


def series_conductivity(thickness: Layers, conductivity: Layers) -> float:
    """Conductivity (W/(m·K)) of layers (k,) in series: `λ = Σ δ_k/Σ(δ_k/λ_k)` (S-30).

    The reading of a garbled formula that keeps the resistance of the layers. Raises
    `ValueError` where a number is ≤ 0.

    Example:
        >>> round(float(sb.formulas.series_conductivity([0.025, 0.003], [0.6, 45.0])), 4)
        0.6709
    """
    require_positive(thickness=thickness, conductivity=conductivity)
    thickness = np.asarray(thickness, float)
    return np.sum(thickness) / np.sum(thickness / np.asarray(conductivity, float))


def parallel_conductivity(area: Layers, conductivity: Layers) -> float:
    """Conductivity (W/(m·K)) of parts (k,) in parallel: `λ = Σ λ_k A_k/Σ A_k` (S-30).
    Raises `ValueError` as above.

    Example:
        >>> round(float(sb.formulas.parallel_conductivity([0.6, 0.2], [0.6, 45.0])), 2)
        11.7
    """
    require_positive(area=area, conductivity=conductivity)
    area = np.asarray(area, float)
    return np.sum(area * np.asarray(conductivity, float)) / np.sum(area)


def equivalent_specific_heat(mass: Layers, specific_heat: Layers) -> float:
    """`c = Σ G_k c_k/Σ G_k` (J/(kg·K)) of layers (k,) of the masses `G_k` (S-32).
    Raises `ValueError` as above.

    Example:
        >>> round(float(sb.formulas.equivalent_specific_heat([400.0, 100.0], [500.0, 1000.0])), 3)
        600.0
    """
    require_positive(mass=mass, specific_heat=specific_heat)
    mass = np.asarray(mass, float)
    return np.sum(mass * np.asarray(specific_heat, float)) / np.sum(mass)


def equivalent_density(mass: Layers, volume: Layers) -> float:
    """`ρ = Σ m_k/Σ V_k` (kg/m³) of layers (k,) (S-33, a sum of quotients in the scan).
    Raises `ValueError` as above.

    Example:
        >>> round(float(sb.formulas.equivalent_density([400.0, 100.0], [0.05, 0.02])), 3)
        7142.857
    """
    require_positive(mass=mass, volume=volume)
    return np.sum(np.asarray(mass, float)) / np.sum(np.asarray(volume, float))


def equivalent_diffusivity(
    conductivity: Amount, density: Amount, specific_heat: Amount
) -> Amount:
    """`a = λ/(ρ c)` (m²/s) of the equivalent numbers (S-31). Raises `ValueError` where
    one of them is not positive.

    Example:
        >>> round(float(sb.formulas.equivalent_diffusivity(48.0, 7800.0, 500.0)), 9)
        1.2308e-05
    """
    require_positive(
        conductivity=conductivity, density=density, specific_heat=specific_heat
    )
    return conductivity / (density * specific_heat)


def current_density(conductivity: Amount, change: Amount, depth: Amount) -> Amount:
    """Current through a layer per area: `j = σ Δφ/δ` electrical (S-22, A/m²),
    `q = λ ΔT/δ` thermal (S-23, W/m²).

    - `conductivity` `σ` (S/m) or `λ` (W/(m·K)); `change` `Δφ` (V) or `ΔT` (K) over the
      `depth` `δ` (m)

    S calls the quotient `Δφ/δ` the gradient; with `conductivity=1` it is that. Raises
    `ValueError` where conductivity or depth is not positive.

    Example:
        >>> sb.formulas.current_density(45.0, 80.0, 0.03)
        120000.0
    """
    require_positive(conductivity=conductivity, depth=depth)
    return conductivity * change / depth
