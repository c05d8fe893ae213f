"""A run as one labelled data set, and in files that hold all of it: netCDF, Parquet, CSV."""

import csv
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np

from .._base._faults import Fault, InputError
from .._base._whole import whole_file
from .._run._metrics import about_output
from .._run._result import Result
from .._run._series import SERIES_COLUMNS, Series, flat, meaning_of_column, times_within, unit_of_column
from ..hybrid import LANDED
from ..studies._chunks import fingerprint
from ..thermal._network import Junction, Reservoir, Wall
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
    - `status`, `code`, and in the attribute `provenance` (JSON) what `simbrake.results.provenance` says

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
            found[name] = ((), np.asarray(value), about_output(name))
    for name, value in energies.items():
        found[f"energy.{name}"] = ((), np.asarray(value), about_output(f"energy.{name}"))
    counts = dict(zip(_COUNTS, (stats.accepted, stats.rejected, stats.retaken, stats.segments), strict=True))
    for name, count in counts.items():
        found[name] = ((), np.asarray(int(count)), _about("1", _COUNTS[name]))
    found["code"] = ((), np.asarray(int(result.code)), _about("1", "0 if the run reached its end time, else why not"))
    found["status"] = ((), np.asarray(result.status), _about("1", "how the run ended"))
    found["method"] = ((), np.asarray(result.method_name), _about("1", "solver of the run"))
    found["rtol"] = ((), np.asarray(float(result.rtol)), _about("1", "relative tolerance of the run"))
    return found


# --- columns and a header, for tables in files ------------------------------------------------------------------------

_TYPES = {"f": "float64", "i": "int64", "U": "str"}


def normalised(data: Any) -> Any:
    """The data set with 64-bit numbers and plain strings, however a file format keeps them, and no encodings.

    Attributes are text, as not every format keeps other types apart.
    """
    import xarray as xr

    def texts(attrs: Any) -> dict[str, str]:
        return {str(key): str(value) for key, value in attrs.items()}

    def plain(variable: Any) -> tuple[Any, np.ndarray, dict[str, Any]]:
        values = np.asarray(variable.values)
        if values.dtype.kind in "iub":
            values = values.astype(np.int64)
        elif values.dtype.kind == "f":
            values = values.astype(np.float64)
        else:
            values = values.astype(str)
        return variable.dims, values, texts(variable.attrs)

    coords = {name: plain(variable) for name, variable in data.coords.items()}
    return xr.Dataset({k: plain(v) for k, v in data.data_vars.items()}, coords, texts(data.attrs))


def split(data: Any) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Header (plain values of JSON, every name a line of a file) and columns of a normalised data set."""
    header: dict[str, Any] = {"attrs": dict(data.attrs), "sizes": {str(k): int(n) for k, n in data.sizes.items()}}
    header["coords"] = [str(name) for name in data.coords]
    header["variables"] = {}
    columns: dict[str, np.ndarray] = {}
    for name, variable in {**data.coords, **data.data_vars}.items():
        about: dict[str, Any] = {"dims": list(variable.dims), "kind": _TYPES[variable.dtype.kind]}
        about["attrs"] = dict(variable.attrs)
        if "time" in variable.dims:
            names = _names(data, str(name))
            columns |= dict(zip(names, variable.values.reshape(variable.shape[0], -1).T, strict=True))
            about["columns"] = names
        else:
            about["values"] = [_plain(x) for x in np.ravel(variable.values)]
        header["variables"][str(name)] = about
    return header, columns


def _names(data: Any, name: str) -> list[str]:
    """One name for each column of a variable, with its labels and its unit, as in `tension_3 [N]`."""
    variable = data[name]
    unit = variable.attrs.get("units", "1")
    labels = [""]
    for dim in variable.dims[1:]:
        own = data[dim].values.tolist()
        labels = [f"{label}_{one}" for label in labels for one in own]
    return [f"{name}{label}" + (f" [{unit}]" if unit != "1" else "") for label in labels]


def _plain(x: Any) -> Any:
    """A value of JSON, which has no infinity."""
    if isinstance(x, np.floating):
        return float(x) if np.isfinite(x) else repr(float(x))
    return x.item() if isinstance(x, np.generic) else x


def join(header: dict[str, Any], columns: dict[str, np.ndarray]) -> Any:
    """The data set of a header and its columns; `KeyError`, `ValueError`, … where these do not belong together."""
    import xarray as xr

    sizes, found = header["sizes"], {}
    for name, about in header["variables"].items():
        shape = tuple(sizes[dim] for dim in about["dims"])
        dtype = np.dtype(about["kind"])
        if "columns" in about:
            values = np.stack([np.asarray(columns[one]).astype(dtype) for one in about["columns"]], axis=1)
        else:
            values = np.asarray(about["values"], dtype=dtype if dtype.kind != "U" else str)
        found[name] = (tuple(about["dims"]), values.reshape(shape), about["attrs"])
    coords = {name: found.pop(name) for name in header["coords"]}
    return xr.Dataset(found, coords, header["attrs"])


def as_lines(header: dict[str, Any]) -> list[str]:
    """A header as lines of text, one for each variable: `name: JSON`."""
    parts = {key: header[key] for key in ("attrs", "sizes", "coords")} | {
        f"variable {name}": about for name, about in header["variables"].items()
    }
    return [f"{key}: {json.dumps(part, ensure_ascii=False, allow_nan=False)}" for key, part in parts.items()]


def from_lines(lines: list[str]) -> dict[str, Any]:
    """The header that `as_lines` wrote."""
    header: dict[str, Any] = {"variables": {}}
    for line in lines:
        key, _, text = line.partition(": ")
        if key.startswith("variable "):
            header["variables"][key.removeprefix("variable ")] = json.loads(text)
        else:
            header[key] = json.loads(text)
    return header


# --- files ------------------------------------------------------------------------------------------------------------

_COMMENT = "# "
_CHECK = "checksum"


def save(result: Any, path: Any) -> Path:
    """Writes a result, or a data set of `simbrake.dataset`, to one file: whole, or not at all.

    By the suffix of `path`: `.nc` netCDF (classic, opened by xarray, MATLAB, Octave, R, Panoply …), `.parquet` (one
    row per time; needs `pip install 'simbrake[tables]'`), `.csv` (one row per time, the rest in lines that begin with
    `#`). `load` gives the same data set back, to the last bit. Raises `InputError`.
    """
    path = Path(path)
    kind = _kind_of(path)
    data = normalised(dataset(result) if isinstance(result, Result) else result)
    if data.attrs.get("format") != FORMAT:
        raise InputError([Fault(str(path), "what is to be saved is no result", "give a Result, or its dataset")])
    data.attrs[_CHECK] = _checksum(data)
    if path.is_dir():
        raise InputError([Fault(str(path), "is a folder", "give the name of a file")])
    with whole_file(path) as scratch:
        kind.write(data, scratch)
    return path


def load(path: Any) -> Any:
    """The data set (`xarray.Dataset`) of a result file, or of a folder of `simbrake run --out`.

    Raises `InputError` for a file that is not there, of another kind, damaged, or changed after it was written.
    """
    path = Path(path)
    if path.is_dir():
        path = path / "result.nc"
    kind = _kind_of(path)
    if not path.is_file():
        names = sorted(p.name for p in path.parent.glob("*") if p.suffix in KINDS) if path.parent.is_dir() else []
        hint = f"there are: {', '.join(names[:8])}" if names else "give the path of a result"
        raise InputError([Fault(str(path), "there is no such file", hint)])
    try:
        data = normalised(kind.read(path))
        found = data.attrs.pop(_CHECK, None)
    except InputError:
        raise
    except Exception as error:  # whatever stands in somebody's file is told in one line
        words = f"cannot be read as a result ({type(error).__name__})"
        raise InputError([Fault(str(path), words, f"give {kind.name} as `simbrake.save` writes it")]) from error
    if data.attrs.get("format") != FORMAT:
        raise InputError([Fault(str(path), "is no result of a run", f"its attribute `format` would be {FORMAT!r}")])
    if found != _checksum(data):
        raise InputError([Fault(str(path), "is damaged, or was changed after it was written", "save the result again")])
    return data


def _checksum(data: Any) -> str:
    """A hash of everything in a normalised data set, the same for all file formats."""
    variables = {
        str(name): [list(map(str, variable.dims)), _bytes(variable.values), sorted(variable.attrs.items())]
        for name, variable in sorted({**data.coords, **data.data_vars}.items())
    }
    attrs = sorted((key, value) for key, value in data.attrs.items() if key != _CHECK)
    return fingerprint(sorted(map(str, data.coords)), variables, attrs)


def _bytes(values: np.ndarray) -> Any:
    return values.tolist() if values.dtype.kind == "U" else values.astype(values.dtype.newbyteorder("<"))


def _write_netcdf(data: Any, path: Path) -> None:
    data.to_netcdf(path, engine="scipy")


def _read_netcdf(path: Path) -> Any:
    import xarray as xr

    return xr.load_dataset(path, engine="scipy", decode_times=False)


def _write_csv(data: Any, path: Path) -> None:
    header, columns = split(data)
    with path.open("w", encoding="utf-8", newline="") as file:
        file.writelines(f"{_COMMENT}{line}\n" for line in [FORMAT, *as_lines(header)])
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        # the shortest text that gives the very same number
        texts = ([x if isinstance(x, str) else repr(x) for x in column.tolist()] for column in columns.values())
        writer.writerows(zip(*texts, strict=True))


_PYTHON: dict[str, Callable[[str], Any]] = {"float64": float, "int64": int, "str": str}


def _read_csv(path: Path) -> Any:
    text = path.read_text("utf-8")
    if not text.startswith(f"{_COMMENT}{FORMAT}\n"):
        raise InputError([Fault(str(path), "is no result of a run", f"its first line would be {_COMMENT}{FORMAT}")])
    lines = text.split("\n")
    count = next(i for i, line in enumerate(lines) if not line.startswith(_COMMENT))
    header = from_lines([line.removeprefix(_COMMENT) for line in lines[1:count]])
    names, *rows = csv.reader(lines[count:-1])
    kinds = {name: about["kind"] for about in header["variables"].values() for name in about.get("columns", ())}
    cells = zip(*rows, strict=True)
    columns = {
        name: np.asarray([_PYTHON[kinds[name]](cell) for cell in column])
        for name, column in zip(names, cells, strict=True)
    }
    return join(header, columns)


def _pyarrow() -> Any:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        hint = "pip install 'simbrake[tables]'"
        raise InputError([Fault("pyarrow", "is missing, which reads and writes Parquet", hint)]) from None
    return pyarrow


def _write_parquet(data: Any, path: Path) -> None:
    pa = _pyarrow()
    header, columns = split(data)
    meta = {"simbrake": json.dumps(header, ensure_ascii=False, allow_nan=False)}
    fields, arrays = [], []
    for about in header["variables"].values():
        for name in about.get("columns", ()):
            arrays.append(pa.array(columns[name]))
            fields.append(pa.field(name, arrays[-1].type, nullable=False, metadata=about["attrs"]))
    pa.parquet.write_table(pa.Table.from_arrays(arrays, schema=pa.schema(fields, metadata=meta)), path)


def _read_parquet(path: Path) -> Any:
    pa = _pyarrow()
    table = pa.parquet.read_table(path, partitioning=None)
    text = (table.schema.metadata or {}).get(b"simbrake")
    if text is None:
        raise InputError([Fault(str(path), "is no result of a run", "its metadata would have an entry `simbrake`")])
    columns = {name: table.column(name).to_numpy() for name in table.column_names}
    return join(json.loads(text), columns)


class Kind(NamedTuple):
    """A file format: its name, and how it is written and read."""

    name: str
    write: Callable[[Any, Path], None]
    read: Callable[[Path], Any]


#: file formats by suffix
KINDS = {
    ".nc": Kind("netCDF", _write_netcdf, _read_netcdf),
    ".parquet": Kind("Parquet", _write_parquet, _read_parquet),
    ".csv": Kind("CSV", _write_csv, _read_csv),
}


def _kind_of(path: Path) -> Kind:
    kind = KINDS.get(path.suffix.lower())
    if kind is None:
        hint = ", ".join(f"{suffix} ({one.name})" for suffix, one in KINDS.items())
        raise InputError([Fault(str(path), f"has the suffix {path.suffix!r}", f"there are: {hint}")])
    return kind
