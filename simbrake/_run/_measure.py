"""What is asked of a run: metrics by name, energies as `energy.…`, or any function of a result."""

import difflib
from collections.abc import Callable, Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np

from .._base._faults import Fault, InputError
from .._hybrid._arrays import Array
from .._parts._scene import Scene
from ._metrics import METRICS, metric_names
from ._result import Result

#: a metric's name, the name of an energy (`energy.friction_heat`), or a function of a `Result` to a number
Metric = str | Callable[[Result], Any]


def name_of(metric: Metric) -> str:
    """How a metric is called in tables."""
    return metric if isinstance(metric, str) else getattr(metric, "__name__", type(metric).__name__)


def unit_of(metric: Metric) -> str:
    """SI unit of a metric; empty for a function, whose unit nobody knows."""
    if not isinstance(metric, str):
        return ""
    if metric.startswith("energy."):
        return "J"
    return METRICS[metric].unit if metric in METRICS else ""


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
