"""What every column and number of a run is, in words and with its unit: attributes of labelled data."""

from .._run._measure import METRIC_UNITS
from .._run._series import PAIR_COLUMNS, pair_column

#: of the columns of a `Series`; units are in `SERIES_UNITS`, those of friction pairs in `PAIR_COLUMNS`
SERIES_MEANINGS = {
    "t": "time",
    "phi": "angle of the pulley since the start",
    "omega": "speed of the pulley, positive in the braking direction",
    "slack_tension": "tension T_0 of the band at the slack (lever) end",
    "tight_tension": "tension T_n of the band at the tight (anchor) end",
    "load_torque": "torque of the load on the pulley",
    "brake_torque": "torque of the brake against the pulley",
    "slip_speed": "speed of the track past the linings of the band",
    "at_limit": "number of linings at their limit of friction",
    "band_mode": "0 open, 1 take-up, 2 elastic, 3 full slip, 4 full slip the other way, 5 held",
    "load_work": "work of the load since the start",
    "lever_work": "work of the lever since the start",
    "friction_heat": "friction heat since the start",
    "tension": "tension of the band behind each lining, counted from the slack end",
    "lever_force": "force of the actuator on each pad or shoe",
    "normal_load": "normal load on each lining",
    "friction_force": "friction force on each lining",
    "elongation": "elongation x of the band",
    "temperature": "temperature of every thermal node",
    "rim_temperature": "surface temperature of the rim",
    "lining_temperature": "surface temperature of the linings",
    "band_temperature": "temperature of the band",
    "lining_outer_temperature": "temperature of the outer faces of the linings",
    "heat_lost": "heat lost to the surroundings since the start",
    "friction_coefficient": "coefficient of friction of each lining, sliding",
    "bandage_speed": "speed of the bandage (the mean of the linings where each has its own)",
    "lining_speed": "speed of each lining",
    "displacement": "displacement of each lining along the band circle",
    "damper_heat": "heat of dampers since the start",
    "electrical_work": "electrical part of the friction work since the start",
    "mechanical_work": "mechanical part of the friction work since the start",
    "worn_thickness": "thickness that each lining lost since the start",
    "friction_memory": "state of the friction law of each lining (several: over state, in the order of its PyTree)",
}

#: of the metrics; times that never come are infinite
METRIC_MEANINGS = {
    "slip_onset_time": "first onset of slip t0: the band is taut",
    "full_slip_time": "first time at which every lining slides, t1",
    "stopping_time": "first time at which the brake brings the pulley to rest",
    "stopping_angle": "angle from the start to the first stop",
    "hook_travel": "travel of the hook from the start to the first stop",
    "internal_slip_time": "first time at which the internal pair slides",
    "external_lock_time": "first time at which the bandage is at rest on a turning pulley",
    "first_lining_slip_time": "first time at which a lining slides by itself",
    "greatest_wear": "greatest thickness that a lining lost in the run",
    "wear_over_mean": "greatest wear over the mean of all linings",
    "wear_over_least": "greatest wear over the least",
    "max_tension": "greatest tension of the band at either side of any lining",
    "max_normal_load": "greatest normal load on any lining",
    "peak_rim_temperature": "greatest surface temperature of the rim",
    "peak_lining_temperature": "greatest surface temperature of any lining",
    "peak_band_temperature": "greatest temperature of the band",
    "peak_lining_outer_temperature": "greatest temperature of the outer faces of the linings",
}

#: of the energies over the run (J); the closures are shares
ENERGY_MEANINGS = {
    "load_work": "work of the load",
    "lever_work": "work of the lever",
    "friction_heat": "friction heat",
    "damper_heat": "heat of dampers",
    "electrical_work": "electrical part of the friction work",
    "mechanical_work": "mechanical part of the friction work",
    "kinetic_change": "change of the kinetic energy",
    "elastic_change": "change of the elastic energy",
    "closure": "residual of the energy balance as a share of the largest energy exchanged",
    "heat_to_metal": "friction heat that entered the metal",
    "heat_to_linings": "friction heat that entered the linings",
    "heat_to_band": "friction heat that entered the band",
    "heat_supplied": "heat from sources",
    "heat_stored": "heat stored in the network",
    "heat_lost": "heat lost to the surroundings",
    "heat_closure": "residual of the heat balance as a share of the largest heat exchanged",
}


def about_metric(name: str) -> dict[str, str]:
    """Unit and meaning of a metric, or of the time (`…_time`) or lining (`…_lining`) of a greatest value."""
    if name in METRIC_MEANINGS:
        return {"units": METRIC_UNITS[name], "meaning": METRIC_MEANINGS[name]}
    peak, _, what = name.rpartition("_")
    unit, words = {"time": ("s", "time"), "lining": ("1", "lining (from 1)")}[what]
    return {"units": unit, "meaning": f"{words} of the {METRIC_MEANINGS[peak]}"}


def meaning_of_column(name: str) -> str:
    """Meaning of a column of a `Series`, or of one of its friction pairs."""
    of_pair = pair_column(name)
    if of_pair is None:
        return SERIES_MEANINGS[name]
    pair, column = of_pair
    return f"{pair} pair: {PAIR_COLUMNS[column].meaning}"


def about_energy(name: str) -> dict[str, str]:
    """Unit and meaning of an energy over the run; `heat_…` of a friction pair is its friction heat."""
    meaning = ENERGY_MEANINGS.get(name, f"friction heat of the {name.removeprefix('heat_')} pair")
    return {"units": "1" if name.endswith("closure") else "J", "meaning": meaning}
