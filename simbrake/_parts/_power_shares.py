"""Friction power as heat, electrical and mechanical power."""

from typing import Any, NamedTuple

import equinox as eqx
import numpy as np
from jax.core import Tracer

from .._base._faults import Fault
from .._base._quantity import Scalar, quantity


class PowerSplit(NamedTuple):
    """Parts of a friction power (W) or of a friction work (J)."""

    heat: Any
    electrical: Any
    mechanical: Any


class PowerShares(eqx.Module):
    """Shares of the friction power, `P = P_heat + P_electrical + P_mechanical` (S-8…11), each 0…1, 1 together.

    - `electrical`: currents that the contact drives (tribo-electricity); `mechanical`: what deforms and breaks
      asperities and is worn off; `heat`, the rest, is what warms rim, linings and band
    - `source`: where the numbers are from

    In a scene (`Scene.power_shares`) they hold for every pair: only the share of heat enters the thermal part (and the
    flash temperature), and the ledger books the other two. Whether these become heat later, elsewhere, is left open (S
    does not say it). By default all is heat, at no cost.

    Raises `ValueError` for shares outside 0…1, alone or together.
    """

    electrical: Scalar = quantity("1", "electrical share of the friction power", low=0.0, high=1.0, default=0.0)
    mechanical: Scalar = quantity("1", "mechanical share of the friction power", low=0.0, high=1.0, default=0.0)
    source: str = eqx.field(static=True, default="given")

    def __check_init__(self) -> None:
        found = self.faults("")
        if found:
            raise ValueError("; ".join(f"{fault.path.lstrip('.')} {fault.problem}".strip() for fault in found))

    @property
    def heat(self) -> Any:
        """Share of heat, `1 − electrical − mechanical`."""
        return 1.0 - self.electrical - self.mechanical

    def split(self, power: Any) -> PowerSplit:
        """Parts of a friction power (W), or of a friction work (J); arrays pass through."""
        return PowerSplit(self.heat * power, self.electrical * power, self.mechanical * power)

    def faults(self, path: str) -> list[Fault]:
        """Shares below 0, or of more than 1 together. Traced ones cannot be looked at and pass."""
        parts = {"electrical": self.electrical, "mechanical": self.mechanical}
        if any(isinstance(value, Tracer) or not isinstance(value, np.ndarray | np.generic) for value in parts.values()):
            return []
        found = [
            Fault(f"{path}.{name}", f"= {float(value):g} must be between 0 and 1")
            for name, value in parts.items()
            if np.ndim(value) == 0 and not 0 <= value <= 1
        ]
        if not found and np.any(self.electrical + self.mechanical > 1 + 1e-12):
            total = float(np.max(self.electrical + self.mechanical))
            found.append(Fault(path, f"electrical + mechanical = {total:.12g} is more than 1", "heat has the rest"))
        return found


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
    return PowerShares(electrical, max(rest, 0.0), "0.68 as heat: one reading of S-10; the rest an assumption")
