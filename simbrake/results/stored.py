"""A run as one labelled data set with its provenance, and netCDF files that hold all of
it."""

import dataclasses
import hashlib
import importlib
import json
import os
import platform
import re
from collections.abc import Mapping
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jax
import numpy as np
from jaxtyping import Float, Int

from .._base._arguments import explained
from .._base._compiling import makes_one_function, run_device
from .._base._faults import InputError, existing_file, input_error, whole_file
from .._base._part import leaves
from ..files._scene_file import scene_from_text, scene_text
from ..hybrid import LANDED
from ..outputs.duty import stop_variables
from ..outputs.metrics import about_output
from ..outputs.quantities import (
    SERIES_COLUMNS,
    Series,
    about_column,
    columns_by_name,
    times_within,
)
from ..parts.scene import Scene
from ..parts.unusual import warnings
from ..runs.result import Result, require_one
from ..thermal.network import Junction, Reservoir, Wall

if TYPE_CHECKING:
    from xarray import DataArray, Dataset
else:
    DataArray = Dataset = Any  # xarray is imported when a data set is needed

#: of the data set, in its attribute `format`; its number increases when the layout
#: changes
FORMAT = "simbrake result 1"
#: times of an even grid
POINTS = 1001

#: numbers of a staged brake's stages
_STAGE_FIELDS = {
    "start": ("s", "start of the stage"),
    "end": ("s", "end of the stage"),
    "heat_external": ("J", "friction heat of the external pair in the stage"),
    "heat_internal": ("J", "friction heat of the internal pair in the stage"),
    "lever_work": ("J", "work of the lever in the stage"),
    "load_work": ("J", "work of the load in the stage"),
}
# dimensions, values, unit and meaning
Variable = tuple[tuple[str, ...], np.ndarray, dict[str, str]]
Variables = dict[str, Variable]


Source = Result | Dataset | str | Path
#: plain values of JSON by name
Settings = dict[str, Any]


@explained
def dataset(result: Result, times: Any = None) -> Dataset:
    """A concrete result as an `xarray.Dataset`; every variable has its `units` (SI,
    `1`: none) and `meaning`.

    - over `time`: all columns of `Series`, those of single linings also over `lining`
      (from 1, from the slack end), and those of each friction pair, as
      `internal_torque`, where there are several or linings move individually;
      `temperature` over `node`; of a wall `<wall>_layer_temperature` over
      `<wall>_layer` with the depth of the layers' centres `<wall>_depth` (m), and over
      `<wall>_copy` where there are several
    - `side`: at an event, and where a given profile has a corner or a jump, a time
      occurs twice: with the values before (−1) and after (+1); elsewhere 0.
      `data.isel(time=data.side >= 0)` has every time once
    - `event_time`, `event_name`, `event_lining` (0: no single lining) over `event`; of
      a staged brake `stage_…` over `stage`; metrics and `energy.…` as single numbers
      (times of events that do not occur are `inf`)
    - `status`, `code`, and in the attribute `provenance` (JSON) the data of
      `simbrake.results.provenance`

    `times` (s): by default 1001 even ones and all events and corners. Raises
    `InputError` for times outside the run, and for a traced or batched result.

    Example:
        >>> data = sb.dataset(result, [0.0, 1.0])
        >>> data.omega.values.round(4), data.omega.units
        (array([24.    ,  4.9179]), 'rad/s')
    """
    import xarray as xr

    series, t, side = _sampled(require_one(result), times)
    linings = np.arange(series.normal_load.shape[1]) + 1
    coords = {
        "time": _variable("time", t, "s", SERIES_COLUMNS["t"].meaning),
        "side": _variable(
            "time", side, "1", "-1 just before an event, +1 just after it, 0 elsewhere"
        ),
        "lining": _variable(
            "lining", linings, "1", "lining, of a band from the slack end"
        ),
    }
    data = _columns(result, series)
    for field, (dims, values, _) in data.items():
        if f"{field}_state" in dims:
            states = np.arange(values.shape[1]) + 1
            coords[dims[1]] = _variable(
                dims[1], states, "1", "state of the friction law"
            )
    if series.temperature is not None:
        coords["node"] = _variable("node", result.nodes, "1", "thermal node")
        _add_walls(result, np.asarray(series.temperature), coords, data)
    data |= (
        _events(result)
        | _stages(result)
        | stop_variables(result.stops)
        | _numbers(result)
    )
    attrs = {
        "format": FORMAT,
        "title": f"brake run: {result.message}",
        "provenance": json.dumps(
            provenance(result), ensure_ascii=False, allow_nan=False
        ),
    }
    return xr.Dataset(data, coords, attrs)


def _variable(
    dims: str | tuple[str, ...], values: Any, units: str, meaning: str
) -> Variable:
    return (
        (dims,) if isinstance(dims, str) else dims,
        np.asarray(values),
        {"units": units or "1", "meaning": meaning},
    )


def instants(result: Result) -> Float[np.ndarray, " k"]:
    """Times (s) after the start of all events, and of the corners and jumps of given
    profiles, each once."""
    record = result.record
    n = int(record.count)
    t = np.asarray(record.rows.t)
    ends = t[1 : n + 1][np.asarray(record.rows.kind)[:n] >= LANDED]
    times = np.unique([*ends, *(event.time for event in result.events)])
    return times[times > t[0]]  # nothing comes before the start


def _sampled(
    result: Result, times: Any
) -> tuple[Series, Float[np.ndarray, " m"], Int[np.ndarray, " m"]]:
    """The series at the times wanted, in order, at events before and after; these
    times, and the side of each."""
    record = result.record
    start = float(np.asarray(record.rows.t)[0])
    end = float(np.asarray(record.t_end))
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
    side = np.append(side, np.full(corners.size, -1))
    t = np.append(wanted, corners)
    order = np.lexsort((side, t))

    def joined(a: Any, b: Any) -> Any:
        return np.concatenate([np.asarray(a), np.asarray(b)])[order]

    return jax.tree.map(joined, after, before), t[order], side[order]


def _columns(result: Result, series: Series) -> Variables:
    """Columns of a series as variables; a place of one node has no dimension beside the
    time."""
    n = series.normal_load.shape[1]
    data = {}
    for field, values in columns_by_name(
        series, pairs=result.tells_pairs_apart
    ).items():
        if field == "t":
            continue
        value = np.asarray(values)
        if np.issubdtype(value.dtype, np.integer):
            value = value.astype(np.int64)
        wetted = field.startswith(("coolant_", "wetted_"))
        last = "node" if field == "temperature" else "jacket" if wetted else "lining"
        dims = (
            "time",
            *(
                ()
                if value.ndim == 1
                else (last,)
                if value.ndim == 2
                else (f"{field}_state", last)
            ),
        )
        if (value.ndim == 2 and last != "node" and value.shape[1] != n) or wetted:
            # else of the rims of several bands, or of several jackets
            single = value.shape[1] == 1
            several = "jacket" if wetted else "band"
            dims = ("time",) if single else ("time", several)
            value = value[:, 0] if single else value
        data[field] = _variable(dims, value, *about_column(field)[:2])
    return data


def _add_walls(
    result: Result,
    temperature: Float[np.ndarray, "m nodes"],
    coords: Variables,
    data: Variables,
) -> None:
    """Temperatures of every wall by its layers, and where these lie."""
    first = 0
    for body in result.scene.network.bodies:
        if isinstance(body, Junction | Reservoir):
            continue
        layers = slice(first, first + body.count)
        first = first + body.count
        if not isinstance(body, Wall):
            continue
        name = _free(body.name, data)
        layer = f"{name}_layer"
        copy = f"{name}_copy"
        coords[layer] = _variable(
            layer,
            np.arange(body.layers) + 1,
            "1",
            f"layer of {body.name}, from its front",
        )
        depth = np.asarray(body.centres, float)
        coords[f"{name}_depth"] = _variable(
            layer, depth, "m", "depth of the layer's centre below the front"
        )
        values = temperature[:, layers]
        dims = ("time", layer)
        if body.copies > 1:
            values = values.reshape(-1, body.copies, body.layers)
            dims = ("time", copy, layer)
            coords[copy] = _variable(
                copy, np.arange(body.copies) + 1, "1", f"which of the walls {body.name}"
            )
        data[f"{name}_layer_temperature"] = _variable(
            dims, values, "K", f"temperature of {body.name} in its layers"
        )


def _free(name: str, data: Variables) -> str:
    """A name valid in files and unique among the walls."""
    name = re.sub(r"\W+", "_", name)
    while f"{name}_layer_temperature" in data:
        name += "_"
    return name


def _events(result: Result) -> Variables:
    times = [e.time for e in result.events]
    names = [e.name for e in result.events]
    linings = np.asarray([e.lining or 0 for e in result.events], np.int64)
    return {
        "event_time": _variable(
            "event", np.asarray(times, float), "s", "time of the event"
        ),
        "event_name": _variable(
            "event", np.asarray(names, str), "1", "name of the event"
        ),
        "event_lining": _variable(
            "event", linings, "1", "lining (from 1) that it concerns, 0: no single one"
        ),
    }


def _stages(result: Result) -> Variables:
    if not result.scene.brake.in_series:
        return {}
    names = np.asarray([stage.name for stage in result.stages], str)
    return {"stage_name": _variable("stage", names, "1", "name of the stage")} | {
        f"stage_{field}": _variable(
            "stage",
            np.asarray([getattr(s, field) for s in result.stages], float),
            *about,
        )
        for field, about in _STAGE_FIELDS.items()
    }


def _numbers(result: Result) -> Variables:
    """Metrics, energies and solver counts: variables without a dimension."""
    summary = result.summary()
    stats = result.record.stats
    energies = summary["energy"]
    variables = {}
    for name, value in {**summary["metrics"], **summary["at"]}.items():
        if name not in energies:  # heats are among the energies
            value = (
                value
                if isinstance(value, int)
                else float(np.inf if value is None else value)
            )
            variables[name] = ((), np.asarray(value), about_output(name))
    variables |= {
        f"energy.{name}": ((), np.asarray(value), about_output(f"energy.{name}"))
        for name, value in energies.items()
    }
    about = {
        "steps": (int(stats.accepted), "steps accepted"),
        "rejected": (int(stats.rejected), "step attempts rejected for their error"),
        "retaken": (int(stats.retaken), "steps taken again, shorter, at events"),
        "segments": (int(stats.segments), "parts of the run between events"),
        "code": (
            int(result.code),
            "0 if the run reached its end time, else the failure code",
        ),
        "status": (result.status, "status of the run"),
        "method": (result.method_name, "solver of the run"),
        "rtol": (float(result.rtol), "relative tolerance of the run"),
    }
    return variables | {
        name: _variable((), value, "1", meaning)
        for name, (value, meaning) in about.items()
    }


# --- provenance ---------------------------------------------------------------------

PACKAGES = ("jax", "jaxlib", "diffrax", "equinox", "numpy", "scipy")


@explained
def provenance(result: Result) -> dict[str, Any]:
    """Provenance of a concrete result, as plain values of JSON, without user, host or
    path.

    - `simbrake`, `versions`, `machine`, `date` (UTC, ISO 8601, of this call)
    - `scene`: `toml`, the text of a scene file, or `null` and `why` for a scene that
      cannot be written, as one with a custom law; `numbers` (path, value, unit, SI) and
      `parts` (path → class or word) of any scene
    - `settings`: the options of `simulate`
    - `outcome`: status, code and counts of the solver

    `simbrake.results.rerun` runs it again. Raises `InputError` for a traced or batched
    result.

    Example:
        >>> about = sb.results.provenance(result)
        >>> about["settings"]["method"], about["outcome"]["status"]
        ('Dopri8', 'stopped')
    """
    stats = require_one(result).record.stats
    limits = result.limits
    longest = float(limits.max_step)
    return {
        "simbrake": str(importlib.import_module("simbrake").__version__),
        "versions": {
            "python": platform.python_version(),
            **{name: version(name) for name in PACKAGES},
        },
        "machine": machine(),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "scene": scene_dict(result.scene),
        "settings": {
            "method": result.method_name,
            "rtol": float(result.rtol),
            "max_step": longest if np.isfinite(longest) else None,
            "max_steps": limits.max_steps,
            "max_events": int(limits.max_events),
        },
        "outcome": {
            "status": result.status,
            "code": int(result.code),
            "message": result.message,
            "warnings": warnings(result.scene),
            **{
                name: int(count)
                for name, count in zip(stats._fields, stats, strict=True)
            },
        },
    }


def machine() -> dict[str, Any]:
    """Processor, cores and operating system, and how JAX computes."""
    cpu = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        lines = info.read_text("utf-8", errors="replace").splitlines()
        cpu = next(
            (
                line.split(":", 1)[1].strip()
                for line in lines
                if line.startswith("model name")
            ),
            cpu,
        )
    return {
        "cpu": cpu,
        "architecture": platform.machine(),
        "cores": os.cpu_count(),
        "system": platform.system(),
        "backend": jax.default_backend(),
        "one_function": makes_one_function(run_device().platform),
    }


def scene_dict(scene: Scene) -> dict[str, Any]:
    """A scene as text where a scene file can hold it, and its numbers and parts."""
    toml, why = _toml(scene)
    numbers = [
        {
            "path": leaf.path,
            "value": np.asarray(leaf.value, float).tolist(),
            "unit": leaf.about.unit,
        }
        for leaf in leaves(scene)
    ]
    return {"toml": toml, "why": why, "numbers": numbers, "parts": parts(scene)}


def _toml(scene: Scene) -> tuple[str | None, str | None]:
    """The text of a scene file that restores the same scene exactly, or the reason why
    there is none."""
    try:
        text = scene_text(scene)
        back = scene_from_text(text)
    except InputError as error:
        return None, "; ".join(str(fault) for fault in error.faults)
    same = parts(back) == parts(scene) and all(
        a.path == b.path and np.array_equal(a.value, b.value)
        for a, b in zip(leaves(back), leaves(scene), strict=True)
    )
    return (
        (text, None) if same else (None, "the text does not give the same scene back")
    )


def parts(node: Any, path: str = "") -> dict[str, Any]:
    """Structure of a scene beside its numbers with units: path → name of the class, or
    value of a word or count.

    Classes that are not of simbrake are named with their module.
    """
    structure: dict[str, Any] = {}
    if isinstance(node, tuple | list):
        for i, child in enumerate(node):
            structure |= parts(child, f"{path}[{i}]")
    elif dataclasses.is_dataclass(node) and not isinstance(node, type):
        structure[path] = _name(type(node))
        for field in dataclasses.fields(node):
            value = getattr(node, field.name)
            if "quantity" not in field.metadata or dataclasses.is_dataclass(value):
                structure |= parts(
                    value, f"{path}.{field.name}" if path else field.name
                )
    elif isinstance(node, bool | int | float | str):
        structure[path] = node
    # numbers of a custom law that name no unit
    elif isinstance(node, np.ndarray | jax.Array):
        structure[path] = np.asarray(node).tolist()
    elif node is not None:
        structure[path] = _name(node if callable(node) else type(node))
    return structure


def _name(thing: Any) -> str:
    module = getattr(thing, "__module__", "")
    name = getattr(thing, "__qualname__", type(thing).__qualname__)
    return name if str(module).split(".")[0] == "simbrake" else f"{module}.{name}"


# --- files --------------------------------------------------------------------------

_CHECK = "sha256"


@explained
def save(result: Result | Dataset, path: str | Path) -> Path:
    """Write a result, or a data set of `simbrake.dataset`, to one netCDF file (`.nc`):
    whole, or not at all.

    The format is the classic one, which xarray, MATLAB, Octave, R and Panoply open.
    `read_result` gives the same data set back, to the last bit. Tables for other
    programs are written by xarray and pandas, as the recipe
    `docs/recipes/result_tables.py` does. Raises `InputError`.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     print(sb.save(result, f"{folder}/stop.nc").name)
        stop.nc
    """
    path = _netcdf(path)
    data = dataset(result) if isinstance(result, Result) else result
    if getattr(data, "attrs", {}).get("format") != FORMAT:
        raise input_error(
            str(path),
            "the object to be saved is not a result",
            "give a Result, or its dataset",
        )
    data = _normalised(data)
    data.attrs[_CHECK] = _checksum(data)
    if path.is_dir():
        raise input_error(str(path), "is a folder", "give the name of a file")
    with whole_file(path) as scratch:
        data.to_netcdf(scratch, engine="scipy")
    return path


@explained
def read_result(path: str | Path) -> Dataset:
    """The data set (`xarray.Dataset`) of a result file, or of a folder of
    `simbrake run --out`.

    Raises `InputError` for a file that is missing, of another kind, damaged, or changed
    after it was written.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     print(sb.read_result(sb.save(result, f"{folder}/stop.nc")).status.item())
        stopped
    """
    path = Path(path)
    path = path / "result.nc" if path.is_dir() else _netcdf(path)
    existing_file(path, "*.nc")
    import xarray as xr

    try:
        data = _normalised(xr.load_dataset(path, engine="scipy", decode_times=False))
        checksum = data.attrs.pop(_CHECK, None)
        earlier = data.attrs.pop("checksum", None)  # another hash, before 0.1.0
    except Exception as error:  # any exception in a user's file is reported in one line
        words = f"cannot be read as a result ({type(error).__name__})"
        raise input_error(
            str(path), words, "give netCDF as `simbrake.save` writes it"
        ) from error
    if data.attrs.get("format") != FORMAT:
        raise input_error(
            str(path),
            "is not a result of a run",
            f"its attribute `format` must be {FORMAT!r}",
        )
    if earlier is None and checksum != _checksum(data):
        raise input_error(
            str(path),
            "is damaged, or was changed after it was written",
            "save the result again",
        )
    return data


def _netcdf(path: str | Path) -> Path:
    """The path of a result file, which ends in .nc."""
    path = Path(path)
    if path.suffix.lower() != ".nc":
        hint = (
            "results are kept as netCDF, .nc; docs/recipes/result_tables.py writes "
            "tables for other programs"
        )
        raise input_error(str(path), f"has the suffix {path.suffix!r}", hint)
    return path


def _normalised(data: Dataset) -> Dataset:
    """The data set as files hold it: 64-bit numbers, plain strings, attributes that are
    texts, no encodings."""
    import xarray as xr

    def texts(attrs: Mapping[Any, Any]) -> dict[str, str]:
        return {str(key): str(value) for key, value in attrs.items()}

    def plain(variable: DataArray) -> Variable:
        values = np.asarray(variable.values)
        kind = {"i": np.int64, "u": np.int64, "b": np.int64, "f": np.float64}.get(
            values.dtype.kind, str
        )
        return (
            tuple(map(str, variable.dims)),
            values.astype(kind),
            texts(variable.attrs),
        )

    coords = {name: plain(variable) for name, variable in data.coords.items()}
    return xr.Dataset(
        {k: plain(v) for k, v in data.data_vars.items()}, coords, texts(data.attrs)
    )


def _checksum(data: Dataset) -> str:
    """A hash of everything in a normalised data set."""
    attrs = sorted((key, value) for key, value in data.attrs.items() if key != _CHECK)
    check = hashlib.sha256(repr([attrs, sorted(map(str, data.coords))]).encode())
    for name in sorted(map(str, data.variables)):
        variable = data.variables[name]
        values = variable.values
        is_number = values.dtype.kind in "if"
        content = (
            values.astype(values.dtype.newbyteorder("<")).tobytes()
            if is_number
            else values.tolist()
        )
        check.update(
            repr(
                [
                    name,
                    variable.dims,
                    values.shape,
                    sorted(variable.attrs.items()),
                    content,
                ]
            ).encode()
        )
    return check.hexdigest()


def origin(source: Source) -> Settings:
    """Provenance of a stored result, from a file or a data set, or of a result."""
    if isinstance(source, Result):
        return provenance(source)
    data, name = (
        (read_result(source), str(source))
        if isinstance(source, str | Path)
        else (source, "data set")
    )
    try:
        return json.loads(data.attrs["provenance"])
    except (AttributeError, KeyError, ValueError) as error:
        what = "has no provenance"
        raise input_error(
            name, what, "give a result file, or a data set of simbrake.dataset"
        ) from error
