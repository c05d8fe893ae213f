"""Numbers of many runs as a labelled data set."""

from typing import Any

import numpy as np

from .._physics._mechanism import Label
from .._run._measure import Metric, name_of, unit_of
from .._run._outcome import FAILURES, status_of
from ._plan import Plan

NOT_RUN = -1

_MEANINGS = {
    "code": "0 if the run reached its end time, else its failure code; -1: not run",
    "steps": "steps accepted",
    "rejected": "step attempts rejected for their error",
    "retaken": "steps taken again, shorter, at events",
    "segments": "parts of the run between events",
    "energy.closure": "residual of the energy balance as a share of the largest energy exchanged",
}


def status_names(columns: dict[str, np.ndarray]) -> np.ndarray:
    """How every run ended, in the words of `Result.status`; `not_run` where it did not take place."""
    code, band = columns["code"], columns["band"]
    yes_or_no = [columns[name].astype(bool).astype(code.dtype) for name in ("moved", "exceeded")]
    kinds = np.stack([code, band, columns["inner"], *yes_or_no], axis=1)
    distinct, which = np.unique(kinds, axis=0, return_inverse=True)
    names = np.asarray([_status(*(int(number) for number in kind)) for kind in distinct], dtype=object)
    return names[which.reshape(-1)].astype(str)


def _status(code: int, band: int, inner: int, moved: int, exceeded: int) -> str:
    if code == NOT_RUN:
        return "not_run"
    if code:
        return FAILURES[code][0]  # pyright: ignore
    return str(status_of(Label(band, inner), bool(moved), lambda: bool(exceeded)))


def as_dataset(plan: Plan, columns: dict[str, np.ndarray], attrs: dict[str, Any]) -> Any:
    """One row per run: the varied numbers as coordinates, metrics, result code and step counts as variables."""
    import xarray as xr

    coords: dict[str, Any] = {"run": ("run", np.arange(plan.count), {"meaning": "number of the run, from 0"})}
    for path, about in plan.abouts().items():
        array = plan.values[path]
        dims = ("run",) if array.ndim == 1 else ("run", f"{path} entry")
        coords[path] = (dims, array, {"units": about.unit, "meaning": about.meaning})
    data: dict[str, Any] = {}
    for metric in plan.metrics:
        name = name_of(metric)
        data[name] = ("run", columns[name], _attrs_of(metric))
    for name, meaning in _MEANINGS.items():
        data[name] = ("run", columns[name], {"units": "1", "meaning": meaning})
    data["status"] = ("run", status_names(columns), {"meaning": "how the run ended"})
    data["method"] = ("run", columns["method"].astype(str), {"meaning": "solver of the run"})
    return xr.Dataset(data, coords, attrs)


def _attrs_of(metric: Metric) -> dict[str, str]:
    unit = unit_of(metric)
    return {"units": unit} if unit else {}


def as_grid(flat: Any, axes: dict[str, np.ndarray]) -> Any:
    """The data set of a full grid (the last number varies fastest) with one dimension per number."""
    import xarray as xr

    shape = tuple(len(axis) for axis in axes.values())
    data = {
        name: (tuple(axes), variable.values.reshape(shape), variable.attrs) for name, variable in flat.data_vars.items()
    }
    data["run"] = (tuple(axes), np.arange(int(np.prod(shape))).reshape(shape), flat["run"].attrs)
    coords = {path: (path, axis, flat[path].attrs) for path, axis in axes.items()}
    return xr.Dataset(data, coords, flat.attrs)
