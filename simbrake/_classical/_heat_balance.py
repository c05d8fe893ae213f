"""Heat balance of the rim over some revolutions: what enters under the linings, what the open track gives away."""

import math
from typing import Any, NamedTuple

from .._base._admissible import require_not_negative, require_positive, require_share


class HeatBalance(NamedTuple):
    """Balance of a rim over whole revolutions at constant speed and surface temperature (SI units)."""

    time: Any  # s, of the revolutions
    gained: Any  # J, Q_1
    lost: Any  # J, Q_2
    net: Any  # J, Q_1 − Q_2
    mean_flux: Any  # W/m² of the whole track, net over A_a τ
    stationary: Any  # K, surface temperature at which net is 0, `inf` where nothing is given away


def heat_balance(
    flux: Any,
    *,
    overlap: Any,
    coefficient: Any,
    surface: Any,
    ambient: Any,
    omega: Any,
    area: Any,
    revolutions: Any = 4,
) -> HeatBalance:
    """Heat that a rim gains and loses over `revolutions` `n` (S: four, one of which the open quarter makes up):

        τ = 2 π n/ω                                                                                          (S-17)
        Q_1 = q_1 A_a κ τ,   Q_2 = h (T_1 − T_a) A_a (1 − κ) τ,   Q = Q_1 − Q_2                              (S-18…20)
        q̄ = κ q_1 − (1 − κ) h (T_1 − T_a)                                                                   (S-21)

    - `flux` `q_1` (W/m²) into the rim under the linings; `overlap` `κ`: share of the track that they cover, about 0.75
    - `coefficient` `h` (W/(m²·K)) of the open track, radiation included; `surface` `T_1`, `ambient` `T_a` (K)
    - `omega` `ω` (rad/s); `area` `A_a` (m²) of the track

    The scan of S-17…S-20 is damaged; S-21 is whole, and these are the terms that it divides. `stationary` is the
    temperature of the surface at which `Q = 0`: `T_a + κ q_1/((1 − κ) h)`. Raises `ValueError` for numbers outside
    their ranges.
    """
    require_positive(omega=omega, area=area, revolutions=revolutions, surface=surface, ambient=ambient)
    require_not_negative(flux=flux, coefficient=coefficient)
    require_share(overlap=overlap)
    time = 2 * math.pi * revolutions / omega
    open_share = (1 - overlap) * coefficient
    into, out = overlap * flux, open_share * (surface - ambient)
    stationary = ambient + into / open_share if open_share > 0 else math.inf
    return HeatBalance(time, into * area * time, out * area * time, (into - out) * area * time, into - out, stationary)
