"""What is asked of a run: metrics by name, energies as `energy.…`, or any function of a result."""

import difflib
from collections.abc import Callable, Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np

from .._base._faults import Fault, InputError
from .._hybrid._arrays import Array
from .._parts._scene import Scene
from ._metrics import BAND_PEAKS, HOT_PLACES, METRICS, PEAKS, special_metrics
from ._result import Result

#: a metric's name, the name of an energy (`energy.friction_heat`), or a function of a `Result` to a number
Metric = str | Callable[[Result], Any]

METRIC_UNITS = {
    "slip_onset_time": "s",
    "full_slip_time": "s",
    "stopping_time": "s",
    "stopping_angle": "rad",
    "hook_travel": "m",
    "internal_slip_time": "s",
    "external_lock_time": "s",
    "first_lining_slip_time": "s",
    "greatest_wear": "m",
    "wear_over_mean": "1",
    "wear_over_least": "1",
    "max_tension": "N",
    "max_normal_load": "N",
    **dict.fromkeys(HOT_PLACES, "K"),
}

_ENERGIES = ("load_work", "lever_work", "friction_heat", "kinetic_change")
_HEATS = ("heat_to_metal", "heat_to_linings", "heat_to_band", "heat_supplied", "heat_stored", "heat_lost")


def metric_names(scene: Scene) -> tuple[str, ...]:
    """Names of everything that a run of the scene has as one number, energies as `energy.…`."""
    brake = scene.brake
    names: list[str] = [*METRICS, *(BAND_PEAKS if brake.banded else ()), *PEAKS]
    energies: list[str] = [*_ENERGIES, *(("elastic_change",) if brake.banded else ())]
    if len(brake.pairs) > 1:
        energies += [f"heat_{pair}" for pair in brake.pairs]
    names += special_metrics(len(brake.pairs), resolved=brake.resolved, wears=scene.wear is not None)
    if brake.resolved:
        energies.append("damper_heat")
    if scene.power_shares is not None:
        energies += ["electrical_work", "mechanical_work"]
    names += [name for name, kind in HOT_PLACES.items() if kind in scene.network.hot_places]
    energies += _HEATS if scene.heated else ()
    if scene.duty.load.travel() is None:
        names.remove("hook_travel")
    return (*names, *(f"energy.{name}" for name in energies))


def name_of(metric: Metric) -> str:
    """How a metric is called in tables."""
    return metric if isinstance(metric, str) else getattr(metric, "__name__", type(metric).__name__)


def unit_of(metric: Metric) -> str:
    """SI unit of a metric; empty for a function, whose unit nobody knows."""
    if not isinstance(metric, str):
        return ""
    return "J" if metric.startswith("energy.") else METRIC_UNITS.get(metric, "")


def check_metrics(scene: Scene, metrics: Sequence[Any]) -> None:
    """Raises `InputError` with every name that a run of the scene does not have."""
    names, faults = metric_names(scene), []
    for one in metrics:
        if isinstance(one, str) and one not in names:
            near = difflib.get_close_matches(one, names, n=3, cutoff=0.4)
            hint = (
                f"nearest: {', '.join(near)}" if near else f"there are: {', '.join(names)}, or a function of the result"
            )
            faults.append(Fault(one, "is no metric of this scene", hint))
        elif not isinstance(one, str) and not callable(one):
            faults.append(Fault(repr(one), "is no metric", "a name, or a function of the result to a number"))
    if faults:
        raise InputError(faults)


def measure(result: Result, metric: Metric) -> Array:
    """One number of a result, concrete or traced; `inf` for times of what did not happen."""
    if not isinstance(metric, str):
        return jnp.asarray(metric(result), jnp.float64)
    if metric.startswith("energy."):
        return jnp.asarray(result.energy[metric.removeprefix("energy.")])
    found = getattr(result, metric)
    return jnp.asarray(getattr(found, "value", found))


def happened(value: Any) -> Any:
    """Whether a metric has a value: times of what did not happen are infinite."""
    return np.isfinite(np.asarray(value))
