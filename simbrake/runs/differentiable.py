"""Metrics of results, which pass through jit, vmap and grad."""

import functools
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from .._base._compiling import run_device
from .._base._jacobian import with_precompiled_jacobian
from .._base._no_slope import without_slope
from ..hybrid import Code, Record
from ..hybrid.arrays import Array
from ..outputs.energies import energies
from ..outputs.extremes import maxima
from ..outputs.metrics import METRICS, Metric, Peak, identity_of
from ..parts.scene import Scene


def metric_of_result(result: Any, name: str) -> Array | Peak:
    """A metric of a result, concrete or traced. Raises `ValueError` for one that the
    scene does not have."""
    metric = METRICS[name]
    scene = result.scene
    if (missing := metric.needs.lacks(scene)) and not metric.shown_anyway:
        raise ValueError(f"the scene has no {name}: {missing}")
    if not result.concrete:
        if metric.greatest:
            return greatest_values(result, (name,))[name]
        return _differentiable(name, metric)(scene.as_run, result.record)
    if metric.energy:
        return result.energy[name.removeprefix("energy.")]
    if metric.greatest:
        return result.report().peaks[name]
    return jax.device_put(np.asarray(metric.find(result.record, scene)), run_device())


def greatest_values(result: Any, names: tuple[str, ...]) -> dict[str, Peak]:
    """Metrics that are maxima over a traced run, all from one walk over it."""
    if not names:
        return {}
    found = _differentiable_maxima(names, tuple(map(identity_of, names)))(
        result.scene.as_run, result.record
    )
    return dict(zip(names, found, strict=True))


@functools.cache
def _differentiable_maxima(
    names: tuple[str, ...], asked: tuple[object, ...]
) -> Callable[[Scene, Record], tuple[Peak, ...]]:
    """Maxima of traced runs; `asked`: what a program for them depends on."""

    def find(scene: Scene, record: Record) -> tuple[Peak, ...]:
        return tuple(
            peak._replace(value=_where_it_happened(peak.value, scene, record))
            for peak in maxima(record, scene, names).whole.values()
        )

    return (
        with_precompiled_jacobian(find, ("maxima", *names)) if asked == names else find
    )


@functools.cache
def _differentiable(name: str, metric: Metric) -> Callable[[Scene, Record], Array]:
    """A metric of traced runs."""

    def find(scene: Scene, record: Record) -> Array:
        if metric.energy:
            return energies(record)[name.removeprefix("energy.")]
        return _where_it_happened(metric.find(record, scene), scene, record)

    return (
        with_precompiled_jacobian(find, ("metric", name))
        if isinstance(identity_of(name), str)
        else find
    )


def _where_it_happened(value: Array, scene: Scene, record: Record) -> Array:
    """The same value. It has no derivative (NaN) where it is infinite, as the time of
    what did not happen, and where the record was too short for the run: a constant has
    the derivative 0, which would look like an answer."""
    return without_slope(
        value, jnp.isinf(value) | (record.code == Code.STEP_LIMIT), scene
    )
