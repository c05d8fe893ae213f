"""The columns of a run over time, and of each friction pair, with their units."""

import re
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from .._base._faults import Fault, InputError
from ..hybrid._arrays import Array


class PairSeries(NamedTuple):
    """One friction pair at the times of a `Series`, SI units; arrays over its linings are (m, n)."""

    normal_load: Float[Array, "m n"]  # N, preload included
    friction_force: Float[Array, "m n"]  # at the faces of the linings, f N at their limit, N
    slip_speed: Float[Array, "m n"]  # m/s
    sense: Int[Array, "m n"]  # 0: the lining sticks, ±1: it slides
    torque: Float[Array, " m"]  # that the pair passes on, N·m
    friction_work: Float[Array, " m"]  # J
    heat: Float[Array, " m"]  # friction heat, J
    capacity: Float[Array, " m"] | None = None  # torque up to which it sticks, or with which it slides, N·m
    friction_coefficient: Float[Array, "m n"] | None = None  # of every lining, sliding; None where it cannot change
    worn_thickness: Float[Array, "m n"] | None = None  # since the start, m; None without wear of the pair
    friction_memory: Any = None  # state of the friction law (m, n), of several (m, s, n); None of a law without


class Series(NamedTuple):
    """States and forces at the times `t` (m,), SI units; arrays over linings are (m, n).

    `pairs` has each friction pair by its name: `external` is that on which the lever acts, of which normal loads,
    friction forces and coefficients are columns here as well; a staged brake has `internal` beside it.
    """

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
    pairs: dict[str, PairSeries]
    lever_force: Float[Array, " m"] | None = None  # F on every pad or shoe of a brake without a band, N
    elongation: Float[Array, " m"] | None = None  # x, m; None for a rigid band
    temperature: Float[Array, "m k"] | None = None  # of every thermal node (`Result.nodes`), K; None without heat
    rim_temperature: Float[Array, "m r"] | None = None  # surface of the rim, K; None where the scene names none
    lining_temperature: Float[Array, "m l"] | None = None  # surfaces of the linings, K
    band_temperature: Float[Array, "m b"] | None = None  # K
    lining_outer_temperature: Float[Array, "m o"] | None = None  # outer faces of a staged brake's linings, K
    heat_lost: Float[Array, " m"] | None = None  # J
    friction_coefficient: Float[Array, "m n"] | None = None  # of every lining, sliding; None where it cannot change
    bandage_speed: Float[Array, " m"] | None = None  # ω_b of a staged brake, rad/s; None without a bandage
    lining_speed: Float[Array, "m n"] | None = None  # ω_i of every lining of a resolved bandage, rad/s
    displacement: Float[Array, "m n"] | None = None  # u of every lining of a chain along the band circle, m
    damper_heat: Float[Array, " m"] | None = None  # of dampers in a chain or between linings, J
    electrical_work: Float[Array, " m"] | None = None  # of the friction, J; None where all of it is heat
    mechanical_work: Float[Array, " m"] | None = None  # J
    worn_thickness: Float[Array, "m n"] | None = None  # of every lining since the start, at all faces, m; or no wear
    friction_memory: Any = None  # state of the friction law (m, n), of several (m, s, n); None of a law without

    @property
    def friction_work(self) -> Any:
        """All that friction has taken (J): heat, and the electrical and mechanical parts where the scene has them."""
        if self.electrical_work is None or self.mechanical_work is None:
            return self.friction_heat
        return self.friction_heat + self.electrical_work + self.mechanical_work


def memory_column(memory: Any) -> Any:
    """The column of the states of one friction law, a PyTree of (m, n)."""
    states = jax.tree.leaves(memory)
    if len(states) < 2:
        return states[0] if states else None
    return (np if isinstance(states[0], np.ndarray) else jnp).stack(states, axis=1)


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


class About(NamedTuple):
    """Unit of a column, "" where there is none, and its meaning."""

    unit: str
    meaning: str


#: columns of a `Series`
SERIES_COLUMNS = {
    "t": About("s", "time"),
    "phi": About("rad", "angle of the pulley since the start"),
    "omega": About("rad/s", "speed of the pulley, positive in the braking direction"),
    "elongation": About("m", "elongation x of the band"),
    "slack_tension": About("N", "tension T_0 of the band at the slack (lever) end"),
    "tight_tension": About("N", "tension T_n of the band at the tight (anchor) end"),
    "load_torque": About("N*m", "torque of the load on the pulley"),
    "brake_torque": About("N*m", "torque of the brake against the pulley"),
    "slip_speed": About("m/s", "speed of the track past the linings of the band"),
    "at_limit": About("", "number of linings at their limit of friction"),
    "band_mode": About("", "0 open, 1 take-up, 2 elastic, 3 full slip, 4 full slip the other way, 5 held"),
    "load_work": About("J", "work of the load since the start"),
    "lever_work": About("J", "work of the lever since the start"),
    "friction_heat": About("J", "friction heat since the start"),
    "tension": About("N", "tension of the band behind each lining, counted from the slack end"),
    "lever_force": About("N", "force of the actuator on each pad or shoe"),
    "normal_load": About("N", "normal load on each lining"),
    "friction_force": About("N", "friction force on each lining"),
    "temperature": About("K", "temperature of every thermal node"),
    "rim_temperature": About("K", "surface temperature of the rim"),
    "lining_temperature": About("K", "surface temperature of the linings"),
    "band_temperature": About("K", "temperature of the band"),
    "heat_lost": About("J", "heat lost to the surroundings since the start"),
    "friction_coefficient": About("", "coefficient of friction of each lining, sliding"),
    "lining_outer_temperature": About("K", "temperature of the outer faces of the linings"),
    "bandage_speed": About("rad/s", "speed of the bandage (the mean of the linings where each has its own)"),
    "lining_speed": About("rad/s", "speed of each lining"),
    "displacement": About("m", "displacement of each lining along the band circle"),
    "damper_heat": About("J", "heat of dampers since the start"),
    "electrical_work": About("J", "electrical part of the friction work since the start"),
    "mechanical_work": About("J", "mechanical part of the friction work since the start"),
    "worn_thickness": About("m", "thickness that each lining lost since the start"),
    "friction_memory": About("", "state of the friction law of each lining (several: in the order of its PyTree)"),
}

#: columns of a `PairSeries`
PAIR_COLUMNS = {
    "normal_load": About("N", "normal load on each lining, preload included"),
    "friction_force": About("N", "friction force on each lining"),
    "slip_speed": About("m/s", "slip speed of each lining"),
    "sense": About("", "0 the lining sticks, +1 and -1 it slides"),
    "torque": About("N*m", "torque that the pair passes on"),
    "friction_work": About("J", "friction work since the start"),
    "heat": About("J", "friction heat since the start"),
    "capacity": About("N*m", "torque up to which the pair sticks, or with which it slides"),
    "friction_coefficient": About("", "coefficient of friction of each lining, sliding"),
    "worn_thickness": About("m", "thickness that each lining lost since the start"),
    "friction_memory": About("", "state of the friction law of each lining (several: in the order of its PyTree)"),
}
_OF_PAIR = re.compile(rf"(?P<pair>[a-z][a-z_]*?)_(?P<column>{'|'.join(PAIR_COLUMNS)})")


def pair_column(name: str) -> tuple[str, str] | None:
    """Friction pair and column of a name as `internal_torque`; `None` of any other name."""
    match = None if name in SERIES_COLUMNS else _OF_PAIR.fullmatch(name)
    return None if match is None else (match["pair"], match["column"])


def unit_of_column(name: str) -> str:
    """Unit of a column of `flat`, "" where it has none."""
    of_pair = pair_column(name)
    return SERIES_COLUMNS[name].unit if of_pair is None else PAIR_COLUMNS[of_pair[1]].unit


def meaning_of_column(name: str) -> str:
    """Meaning of a column of `flat`."""
    of_pair = pair_column(name)
    if of_pair is None:
        return SERIES_COLUMNS[name].meaning
    pair, column = of_pair
    return f"{pair} pair: {PAIR_COLUMNS[column].meaning}"


def flat(series: Series, *, pairs: bool) -> dict[str, Any]:
    """The columns of a series by name, those that it does not have left out.

    - `pairs`: with those of every friction pair, called as `internal_torque`
    """
    found = {name: getattr(series, name) for name in SERIES_COLUMNS}
    if pairs:
        for pair, columns in series.pairs.items():
            found |= {f"{pair}_{name}": values for name, values in columns._asdict().items()}
    return {name: values for name, values in found.items() if values is not None}
