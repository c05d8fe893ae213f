"""Areas: where surfaces really touch, and which surfaces of the pulley give heat to the air."""

import math
from typing import Any

from .._base._admissible import require_not_negative, require_positive
from ..thermal._network import STEFAN_BOLTZMANN


def real_contact_area(area: Any, pressure: Any, hardness: Any) -> Any:
    """Area of the spots that touch, all of them plastic: `A_r = A_a p_a/HB` (S-34), in m².

    - `area` `A_a` (m²), nominal; `pressure` `p_a` (Pa) on it; `hardness` `HB` (Pa) of the softer surface

    The scan also shows a 2 in the denominator; the form with `HB` alone is that of plastic spots in equilibrium, which
    carry the pressure `HB`. Raises `ValueError` where area or hardness is not positive, the pressure negative or above
    the hardness: there is no more than the whole area.

    Reference: F. P. Bowden, D. Tabor, *The Friction and Lubrication of Solids* (1950), ch. I.
    """
    require_positive(area=area, hardness=hardness)
    require_not_negative(pressure=pressure)
    if pressure > hardness:
        raise ValueError(f"pressure = {pressure} Pa exceeds the hardness of {hardness} Pa")
    return area * pressure / hardness


def polished_surface(radius: Any, width: Any) -> Any:
    """The friction track `A_p = 2 π R b` (S-35), in m². Raises `ValueError` where an argument is not positive."""
    require_positive(radius=radius, width=width)
    return 2 * math.pi * radius * width


def ring_face(inner: Any, outer: Any) -> Any:
    """One face of a ring, `π (R² − r²)`, in m²: rebord, flange or disc. Raises `ValueError` for `r ≥ R` or `r < 0`."""
    require_not_negative(inner=inner)
    if not outer > inner:
        raise ValueError(f"outer = {outer} must exceed inner = {inner}")
    return math.pi * (outer**2 - inner**2)


def matte_surface(*areas: Any) -> Any:
    """All that is not polished: `A_m = A_rebords + A_flange + A_bore + …` (S-36), in m².

    Raises `ValueError` where one is negative.
    """
    for area in areas:
        require_not_negative(area=area)
    return sum(areas)


def radiation_coefficient(emissivity: Any, temperature: Any, ambient: Any) -> Any:
    """Heat transfer coefficient of radiation in W/(m²·K), temperatures in K (S-37 polished, S-38 matte surfaces):

        α = C_r [(T/100)⁴ − (T_a/100)⁴]/(T − T_a),   C_r = 10⁸ ε σ

    Written as `ε σ (T² + T_a²)(T + T_a)`, which also holds at `T = T_a`. Raises `ValueError` for an emissivity that is
    negative or temperatures that are not positive.
    """
    require_not_negative(emissivity=emissivity)
    require_positive(temperature=temperature, ambient=ambient)
    return emissivity * STEFAN_BOLTZMANN * (temperature**2 + ambient**2) * (temperature + ambient)
