"""The columns of a run over time, with their units."""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int

from .._base._faults import Fault, InputError
from .._hybrid._arrays import Array


class Series(NamedTuple):
    """States and forces at the times `t` (m,), SI units; arrays over linings are (m, n)."""

    t: Float[Array, " m"]
    phi: Float[Array, " m"]  # angle, rad
    omega: Float[Array, " m"]  # speed, rad/s
    slack_tension: Any  # T_0 (m,), N; None without a band
    tight_tension: Any  # T_n (m,), N; None without a band
    load_torque: Float[Array, " m"]  # N·m
    brake_torque: Float[Array, " m"]  # N·m
    slip_speed: Float[Array, " m"]  # m/s
    at_limit: Int[Array, " m"]  # k, number of linings at their limit
    band_mode: Int[Array, " m"]  # BandMode
    load_work: Float[Array, " m"]  # J
    lever_work: Float[Array, " m"]  # J
    friction_heat: Float[Array, " m"]  # J
    tension: Any  # (m, n) behind each lining, N; None without a band
    normal_load: Float[Array, "m n"]  # N
    friction_force: Float[Array, "m n"]  # N
    lever_force: Float[Array, " m"] | None = None  # F on every pad or shoe of a brake without a band, N
    elongation: Float[Array, " m"] | None = None  # x, m; None for a rigid band
    temperature: Float[Array, "m k"] | None = None  # of every thermal node (`Result.nodes`), K; None without heat
    rim_temperature: Float[Array, "m r"] | None = None  # surface of the rim, K; None where the scene names none
    lining_temperature: Float[Array, "m l"] | None = None  # surfaces of the linings, K
    band_temperature: Float[Array, "m b"] | None = None  # K
    lining_outer_temperature: Float[Array, "m o"] | None = None  # outer faces of a staged brake's linings, K
    heat_lost: Float[Array, " m"] | None = None  # J
    friction_coefficient: Float[Array, "m n"] | None = None  # of every lining, sliding; None without heat
    bandage_speed: Float[Array, " m"] | None = None  # ω_b of a staged brake, rad/s; None without a bandage
    internal_torque: Float[Array, " m"] | None = None  # Λ from the pulley to the bandage, N·m
    internal_capacity: Float[Array, " m"] | None = None  # M_int, N·m
    internal_slip_speed: Float[Array, " m"] | None = None  # R (ω − ω_b), m/s
    internal_mode: Int[Array, " m"] | None = None  # 0: the internal pair sticks, ±1: it slides
    internal_sliding: Int[Array, " m"] | None = None  # number of linings that slide on the rim
    internal_heat: Float[Array, " m"] | None = None  # of the internal pair, part of friction_heat, J
    internal_friction_coefficient: Float[Array, "m n"] | None = None  # on the rim; None without heat
    internal_load: Float[Array, "m n"] | None = None  # of every lining on the rim, preload included, N
    lining_slip_speed: Float[Array, "m n"] | None = None  # of every lining that moves for itself, m/s
    lining_speed: Float[Array, "m n"] | None = None  # ω_i of every lining of a resolved bandage, rad/s
    lining_internal_slip_speed: Float[Array, "m n"] | None = None  # R (ω − ω_i), m/s
    lining_internal_torque: Float[Array, "m n"] | None = None  # λ_i from the pulley to every lining, N·m
    displacement: Float[Array, "m n"] | None = None  # u of every lining of a chain along the band circle, m
    damper_heat: Float[Array, " m"] | None = None  # of dampers in a chain or between linings, J
    electrical_work: Float[Array, " m"] | None = None  # of the friction, J; None where all of it is heat
    mechanical_work: Float[Array, " m"] | None = None  # J
    worn_thickness: Float[Array, "m n"] | None = None  # of every lining since the start, m; None without wear
    internal_worn_thickness: Float[Array, "m n"] | None = None  # part of it at faces on the rim of a staged brake, m

    @property
    def friction_work(self) -> Any:
        """All that friction has taken (J): heat, and the electrical and mechanical parts where the scene has them."""
        if self.electrical_work is None or self.mechanical_work is None:
            return self.friction_heat
        return self.friction_heat + self.electrical_work + self.mechanical_work


def outside(ts: Any, start: Any, end: Any) -> Any:
    """Which of the times `ts` are not in a run from `start` to `end`, rounding at the two ends allowed for."""
    rounding = 1e-9 * (end - start) + 1e-15 * (abs(start) + abs(end))
    return ~((ts >= start - rounding) & (ts <= end + rounding))  # written so that a NaN is outside


def fault_of_times(ts: np.ndarray, start: float, end: float, path: str, hint: str = "") -> Fault | None:
    """What is wrong with times of which some are not in a run, `None` if all are."""
    bad = ts[outside(ts, start, end)]
    if not bad.size:
        return None
    more = f" (and {bad.size - 1} more of {ts.size} times)" if bad.size > 1 else ""
    return Fault(path, f"{bad[0]:g} s is outside the run{more}", f"between {start:g} and {end:g} s{hint}")


def array_of_times(ts: Any, path: str) -> np.ndarray:
    """Times (m,) of a list, an array or one number. Raises `InputError` for anything else, and for no times."""
    try:
        found = np.atleast_1d(np.asarray(ts, np.float64))
    except (TypeError, ValueError):
        raise InputError([Fault(path, f"{ts!r} are no numbers", "times in s")]) from None
    if found.ndim != 1 or not found.size:
        raise InputError([Fault(path, f"have the shape {found.shape}", "one time in s, or a list of times")])
    return found


def times_within(ts: Any, start: float, end: float, path: str, hint: str = "") -> np.ndarray:
    """Times (m,) in a run, those that only rounding puts outside moved to its ends. Raises `InputError` for others."""
    found = array_of_times(ts, path)
    if fault := fault_of_times(found, start, end, path, hint):
        raise InputError([fault])
    return np.clip(found, start, end)


#: units of the columns of a Series, "" where there is none
SERIES_UNITS = {
    "t": "s",
    "phi": "rad",
    "omega": "rad/s",
    "elongation": "m",
    "slack_tension": "N",
    "tight_tension": "N",
    "load_torque": "N*m",
    "brake_torque": "N*m",
    "slip_speed": "m/s",
    "at_limit": "",
    "band_mode": "",
    "load_work": "J",
    "lever_work": "J",
    "friction_heat": "J",
    "tension": "N",
    "lever_force": "N",
    "normal_load": "N",
    "friction_force": "N",
    "temperature": "K",
    "rim_temperature": "K",
    "lining_temperature": "K",
    "band_temperature": "K",
    "heat_lost": "J",
    "friction_coefficient": "",
    "lining_outer_temperature": "K",
    "internal_friction_coefficient": "",
    "bandage_speed": "rad/s",
    "internal_torque": "N*m",
    "internal_capacity": "N*m",
    "internal_slip_speed": "m/s",
    "internal_mode": "",
    "internal_sliding": "",
    "internal_heat": "J",
    "internal_load": "N",
    "lining_slip_speed": "m/s",
    "lining_speed": "rad/s",
    "lining_internal_slip_speed": "m/s",
    "lining_internal_torque": "N*m",
    "displacement": "m",
    "damper_heat": "J",
    "electrical_work": "J",
    "mechanical_work": "J",
    "worn_thickness": "m",
    "internal_worn_thickness": "m",
}
