"""Estimates of the electrical share of the friction power."""

import math
from typing import Any

from .._base._admissible import require_not_negative, require_positive


def triboelectric_power(current: Any, voltage: Any, factor: Any = 200.0) -> Any:
    """Electrical share of the friction power (W): `W_el = k_v I U` (S-8). An estimate.

    - `current` `I` (A) between asperities of lining and metal; `voltage` `U` (V) at the end of the braking
    - `factor` `k_v`, 2·10² as printed: stands for the time that asperities touch, without a derivation or a unit

    S's own formula of the current (S-9) is lost: give a measured one, or `contact_current`. Raises `ValueError` for a
    negative argument.
    """
    require_not_negative(current=current, voltage=voltage, factor=factor)
    return factor * current * voltage


def thermoelectric_voltage(seebeck: Any, hot: Any, cold: Any) -> Any:
    """Voltage (V) of the contact as a thermocouple: `U = S_ab (T_c − T_0)`, stands in for what S-9 lost. An estimate.

    - `seebeck` `S_ab` (V/K), of the pair of materials; `hot` `T_c` (K) of the spots, `cold` `T_0` (K) of the bodies

    Reference: R. Holm, *Electric Contacts*, 4th ed. (1967), on thermoelectric effects in contacts.
    """
    return seebeck * (hot - cold)


def contact_current(voltage: Any, resistivity: Any, area: Any, spots: Any = 1) -> Any:
    """Current (A) that a `voltage` `U` drives through the spots that touch; stands in for S-9. An estimate.

        I = U/R,   R = ρ_e/(2 n r) of n equal round spots in parallel,   n π r² = A_r

    - `resistivity` `ρ_e` (Ω·m), mean of the two bodies; `area` `A_r` (m²) that really touches (`real_contact_area`);
      `spots` `n`

    Constriction alone: films and the resistance between spots are left out, so that it is an upper bound. Raises
    `ValueError` where resistivity, area or number of spots is not positive.

    Reference: R. Holm, *Electric Contacts*, 4th ed. (1967), constriction resistance `ρ/(2 a)` of a round spot.
    """
    require_positive(resistivity=resistivity, area=area, spots=spots)
    radius = (area / (spots * math.pi)) ** 0.5
    return voltage * 2 * spots * radius / resistivity
