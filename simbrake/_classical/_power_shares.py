"""Friction power as heat, electrical and mechanical power, and estimates of its electrical share."""

import dataclasses
import math
from typing import Any, NamedTuple

from .._base._admissible import require_not_negative, require_positive, require_share


class PowerSplit(NamedTuple):
    """Parts of a friction power (W) or of a friction work (J)."""

    heat: Any
    electrical: Any
    mechanical: Any


@dataclasses.dataclass(frozen=True)
class PowerShares:
    """Shares of the friction power, `P = P_heat + P_electrical + P_mechanical` (S-8…11), each 0…1, 1 together.

    - `heat`: what warms rim, linings and band; `electrical`: currents that the contact drives (tribo-electricity);
      `mechanical`: what deforms and breaks asperities and is worn off
    - `source`: where the numbers are from

    By default all is heat, as in the simulated ledger. Shares are of the power: whether electrical and mechanical power
    become heat later, elsewhere, is left open (S does not say it). Raises `ValueError` for shares outside 0…1 or that
    do not add up to 1.
    """

    heat: float = 1.0
    electrical: float = 0.0
    mechanical: float = 0.0
    source: str = "all heat (default)"

    def __post_init__(self) -> None:
        require_share(heat=self.heat, electrical=self.electrical, mechanical=self.mechanical)
        total = self.heat + self.electrical + self.mechanical
        if not math.isclose(total, 1.0, rel_tol=1e-12, abs_tol=0.0):
            raise ValueError(f"the shares add up to {total:.12g} instead of 1")

    def split(self, power: Any) -> PowerSplit:
        """Parts of a friction power (W), or of a friction work (J); arrays pass through."""
        return PowerSplit(self.heat * power, self.electrical * power, self.mechanical * power)


def shares_of_S(electrical: float = 0.0) -> PowerShares:
    """S's figures: 0.68 of the friction power as heat (one reading of S-10), the rest mechanical.

    - `electrical`: a share of its own out of that rest, `k_v I U/P` by `triboelectric_power`; S-9 and S-11, from which
      electrical and mechanical power would follow, are lost in the source

    S-10 prints `0.68·10⁻³`: the power in kW is one reading of the factor, and the share the only one of its figures
    that can be read. Raises `ValueError` for an electrical share outside 0…0.32.
    """
    rest = 1.0 - 0.68 - electrical
    if not (electrical >= 0 and rest >= -1e-12):
        raise ValueError(f"electrical = {electrical} must be between 0 and 0.32")
    return PowerShares(0.68, electrical, max(rest, 0.0), "0.68 as heat: one reading of S-10; the rest an assumption")


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
