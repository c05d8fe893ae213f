"""A run as one labelled data set: series, events, stages, metrics, energies and where they came from."""

import json
import re
from typing import Any

import jax
import numpy as np

from .._hybrid import LANDED
from .._parts._network import Junction, Reservoir, Wall
from .._run._metrics import about_energy, about_metric
from .._run._result import Result
from .._run._series import SERIES_COLUMNS, Series, flat, meaning_of_column, times_within, unit_of_column
from ._provenance import provenance

#: of the data set, in its attribute `format`; a number that grows when the layout changes
FORMAT = "simbrake result 1"
#: times of an even grid
POINTS = 1001

_STAGE_FIELDS = {
    "start": ("s", "start of the stage"),
    "end": ("s", "end of the stage"),
    "heat_external": ("J", "friction heat of the external pair in the stage"),
    "heat_internal": ("J", "friction heat of the internal pair in the stage"),
    "lever_work": ("J", "work of the lever in the stage"),
    "load_work": ("J", "work of the load in the stage"),
}
_COUNTS = {
    "steps": "steps accepted",
    "rejected": "step attempts rejected for their error",
    "retaken": "steps taken again, shorter, at events",
    "segments": "parts of the run between events",
}


def dataset(result: Result, times: Any = None) -> Any:
    """A concrete result as an `xarray.Dataset`; every variable has its `units` (SI, `1`: none) and `meaning`.

    - over `time`: all columns of `Series`, those of single linings also over `lining` (from 1, from the slack end), and
      those of each friction pair, as `internal_torque`, where there are several or linings move by themselves;
      `temperature` over `node`; of a wall `<wall>_layer_temperature` over `<wall>_layer` with the depth of the layers'
      centres `<wall>_depth` (m), and over `<wall>_copy` where there are several
    - `side`: at an event, and where a given profile has a corner or a jump, a time occurs twice: with the values
      before (−1) and after (+1); elsewhere 0. `data.isel(time=data.side >= 0)` has every time once
    - `event_time`, `event_name`, `event_lining` (0: no single lining) over `event`; of a staged brake `stage_…` over
      `stage`; metrics and `energy.…` as single numbers (times that never come are `inf`)
    - `status`, `code`, and in the attribute `provenance` (JSON) what `simbrake.provenance` says

    `times` (s): those wanted, by default 1001 even ones and all events and corners. Raises `InputError` for times
    outside the run, `ValueError` for a traced or batched result.
    """
    import xarray as xr

    if not result.concrete:
        raise ValueError("a traced or batched result has no data set: take one result outside of jit and vmap")
    series, t, side = _sampled(result, times)
    coords: dict[str, Any] = {
        "time": ("time", t, _about("s", SERIES_COLUMNS["t"].meaning)),
        "side": ("time", side, _about("1", "-1 just before an event, +1 just after it, 0 elsewhere")),
        "lining": (
            "lining",
            np.arange(series.normal_load.shape[1]) + 1,
            _about("1", "lining, of a band from the slack end"),
        ),
    }
    data = _columns(result, series)
    for field, (dims, values, _) in data.items():
        if f"{field}_state" in dims:
            coords[dims[1]] = (dims[1], np.arange(values.shape[1]) + 1, _about("1", "which state of the friction law"))
    if series.temperature is not None:
        coords["node"] = ("node", np.asarray(result.nodes), _about("1", "thermal node"))
        _add_walls(result, np.asarray(series.temperature), coords, data)
    data |= _events(result) | _stages(result) | _numbers(result)
    attrs = {
        "format": FORMAT,
        "title": f"brake run: {result.message}",
        "provenance": json.dumps(provenance(result), ensure_ascii=False, allow_nan=False),
    }
    return xr.Dataset(data, coords, attrs)


def _about(units: str, meaning: str) -> dict[str, str]:
    return {"units": units or "1", "meaning": meaning}


def instants(result: Result) -> np.ndarray:
    """Times (s) after the start of all events, and of the corners and jumps of given profiles, each once."""
    record = result.record
    n, t = int(record.count), np.asarray(record.rows.t)
    ends = t[1 : n + 1][np.asarray(record.rows.kind)[:n] >= LANDED]
    found = np.unique([*ends, *(event.time for event in result.events)])
    return found[found > t[0]]  # nothing comes before the start


def _sampled(result: Result, times: Any) -> tuple[Series, np.ndarray, np.ndarray]:
    """The series at the times wanted, in order, at events before and after; these times, and the side of each."""
    record = result.record
    start, end = float(np.asarray(record.rows.t)[0]), float(np.asarray(record.t_end))
    corners = instants(result)
    if times is None:
        wanted = np.union1d(np.linspace(start, end, POINTS), corners)
    else:
        wanted = np.unique(times_within(times, start, end, "times"))
        corners = corners[np.isin(corners, wanted)]
    after = result.series(wanted)
    side = np.where(np.isin(wanted, corners), 1, 0)
    if not corners.size:
        return after, wanted, side
    before = result.series(corners, left=True)
    side, t = np.append(side, np.full(corners.size, -1)), np.append(wanted, corners)
    order = np.lexsort((side, t))

    def joined(a: Any, b: Any) -> Any:
        return np.concatenate([np.asarray(a), np.asarray(b)])[order]

    return jax.tree.map(joined, after, before), t[order], side[order]


def _columns(result: Result, series: Series) -> dict[str, Any]:
    """Columns of a series as variables; a place of one node has no dimension beside the time."""
    n, data = series.normal_load.shape[1], {}
    for field, values in flat(series, pairs=result.tells_pairs_apart).items():
        if field == "t":
            continue
        value = np.asarray(values)
        if np.issubdtype(value.dtype, np.integer):
            value = value.astype(np.int64)
        last = "node" if field == "temperature" else "lining"
        dims = ("time", *(() if value.ndim == 1 else (last,) if value.ndim == 2 else (f"{field}_state", last)))
        if value.ndim == 2 and field.endswith("_temperature") and value.shape[1] != n:
            dims, value = ("time",), value[:, 0]
        data[field] = (dims, value, _about(unit_of_column(field), meaning_of_column(field)))
    return data


def _add_walls(result: Result, temperature: np.ndarray, coords: dict[str, Any], data: dict[str, Any]) -> None:
    """Temperatures of every wall by its layers, and where these lie."""
    first = 0
    for body in result.scene.network.bodies:
        if isinstance(body, Junction | Reservoir):
            continue
        here, first = slice(first, first + body.count), first + body.count
        if not isinstance(body, Wall):
            continue
        name = _free(body.name, data)
        layer, copy = f"{name}_layer", f"{name}_copy"
        depth = np.asarray(body.centres, float)
        coords[layer] = (layer, np.arange(body.layers) + 1, _about("1", f"layer of {body.name}, from its front"))
        coords[f"{name}_depth"] = (layer, depth, _about("m", "depth of the layer's centre below the front"))
        values, dims = temperature[:, here], ("time", layer)
        if body.copies > 1:
            values, dims = values.reshape(-1, body.copies, body.layers), ("time", copy, layer)
            coords[copy] = (copy, np.arange(body.copies) + 1, _about("1", f"which of the walls {body.name}"))
        data[f"{name}_layer_temperature"] = (dims, values, _about("K", f"temperature of {body.name} in its layers"))


def _free(name: str, data: dict[str, Any]) -> str:
    """A name that files take, and that no other wall has."""
    name = re.sub(r"\W+", "_", name)
    while f"{name}_layer_temperature" in data:
        name += "_"
    return name


def _events(result: Result) -> dict[str, Any]:
    events = result.events
    names = np.asarray([event.name for event in events], dtype=str)
    return {
        "event_time": ("event", np.asarray([e.time for e in events], float), _about("s", "time of the event")),
        "event_name": ("event", names, _about("1", "what happened")),
        "event_lining": (
            "event",
            np.asarray([e.lining or 0 for e in events], np.int64),
            _about("1", "lining (from 1) that it concerns, 0: no single one"),
        ),
    }


def _stages(result: Result) -> dict[str, Any]:
    if not result.scene.brake.in_series:
        return {}
    stages = result.stages
    found = {"stage_name": ("stage", np.asarray([s.name for s in stages], dtype=str), _about("1", "name of the stage"))}
    for field, about in _STAGE_FIELDS.items():
        found[f"stage_{field}"] = ("stage", np.asarray([getattr(s, field) for s in stages], float), _about(*about))
    return found


def _numbers(result: Result) -> dict[str, Any]:
    """Metrics, energies, and how the solver fared: variables without a dimension."""
    summary, stats = result.summary(), result.record.stats
    energies = summary["energy"]
    found: dict[str, Any] = {}
    for name, value in {**summary["metrics"], **summary["at"]}.items():
        if name not in energies:  # heats stand among the energies
            value = value if isinstance(value, int) else float(np.inf if value is None else value)
            found[name] = ((), np.asarray(value), about_metric(name))
    for name, value in energies.items():
        found[f"energy.{name}"] = ((), np.asarray(value), about_energy(name))
    counts = dict(zip(_COUNTS, (stats.accepted, stats.rejected, stats.retaken, stats.segments), strict=True))
    for name, count in counts.items():
        found[name] = ((), np.asarray(int(count)), _about("1", _COUNTS[name]))
    found["code"] = ((), np.asarray(int(result.code)), _about("1", "0 if the run reached its end time, else why not"))
    found["status"] = ((), np.asarray(result.status), _about("1", "how the run ended"))
    found["method"] = ((), np.asarray(result.method_name), _about("1", "solver of the run"))
    found["rtol"] = ((), np.asarray(float(result.rtol)), _about("1", "relative tolerance of the run"))
    return found
