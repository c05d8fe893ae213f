"""Results for other programs: an Excel workbook, a MATLAB file. Both are written, not read back."""

import itertools
import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .._base._faults import Fault, InputError, needed
from ..thermal._material import LIBRARY, Material

if TYPE_CHECKING:
    from xarray import DataArray, Dataset
else:
    DataArray = Dataset = Any  # xarray is imported when a data set is needed

# --- columns ----------------------------------------------------------------------------------------------------------


Variable = tuple[tuple[str, ...], np.ndarray, dict[str, str]]  # dimensions, values, unit and meaning
Header = dict[str, Any]  # plain values of JSON
_TYPES = {"f": "float64", "i": "int64", "U": "str"}


def normalised(data: Dataset) -> Dataset:
    """The data set with 64-bit numbers and plain strings for every file format, and no encodings.

    Attributes are text, as not every format keeps other types apart.
    """
    import xarray as xr

    def plain(variable: DataArray) -> Variable:
        values = np.asarray(variable.values)
        kind = {"i": np.int64, "u": np.int64, "b": np.int64, "f": np.float64}.get(values.dtype.kind, str)
        return tuple(map(str, variable.dims)), values.astype(kind), _texts(variable.attrs)

    coords = {name: plain(variable) for name, variable in data.coords.items()}
    return xr.Dataset({k: plain(v) for k, v in data.data_vars.items()}, coords, _texts(data.attrs))


def _texts(attrs: Mapping[Any, Any]) -> dict[str, str]:
    return {str(key): str(value) for key, value in attrs.items()}


def split(data: Dataset) -> tuple[Header, dict[str, np.ndarray]]:
    """Header (plain values of JSON, every name a line of a file) and columns of a normalised data set."""
    header: dict[str, Any] = {"attrs": dict(data.attrs), "sizes": {str(k): int(n) for k, n in data.sizes.items()}}
    header["coords"] = [str(name) for name in data.coords]
    header["variables"] = {}
    columns: dict[str, np.ndarray] = {}
    for name, variable in {**data.coords, **data.data_vars}.items():
        about: dict[str, Any] = {"dims": list(variable.dims), "kind": _TYPES[variable.dtype.kind]}
        about["attrs"] = dict(variable.attrs)
        if "time" in variable.dims:
            own_columns = columns_of(data, str(name))
            columns |= own_columns
            about["columns"] = list(own_columns)
        else:
            about["values"] = [_plain(x) for x in np.ravel(variable.values)]
        header["variables"][str(name)] = about
    return header, columns


def columns_of(data: Dataset, name: str) -> dict[str, np.ndarray]:
    """The columns of a variable over its first dimension, with their labels and unit, as `tension_3 [N]`."""
    variable = data[name]
    unit = variable.attrs.get("units", "1")
    labels = [""]
    for dim in variable.dims[1:]:
        own = data[dim].values.tolist()
        labels = [f"{label}_{coordinate}" for label in labels for coordinate in own]
    names = [f"{name}{label}" + (f" [{unit}]" if unit != "1" else "") for label in labels]
    return dict(zip(names, variable.values.reshape(variable.shape[0], -1).T, strict=True))


def _plain(x: Any) -> Any:
    """A value of JSON, which has no infinity."""
    if isinstance(x, np.floating):
        return float(x) if np.isfinite(x) else repr(float(x))
    return x.item() if isinstance(x, np.generic) else x


def join(header: Header, columns: dict[str, np.ndarray]) -> Dataset:
    """The data set of a header and its columns; `KeyError`, `ValueError`, … where these do not match."""
    import xarray as xr

    sizes, variables = header["sizes"], {}
    for name, about in header["variables"].items():
        shape = tuple(sizes[dim] for dim in about["dims"])
        dtype = np.dtype(about["kind"])
        if "columns" in about:
            values = np.stack([np.asarray(columns[column]).astype(dtype) for column in about["columns"]], axis=1)
        else:
            values = np.asarray(about["values"], dtype=dtype if dtype.kind != "U" else str)
        variables[name] = (tuple(about["dims"]), values.reshape(shape), about["attrs"])
    coords = {name: variables.pop(name) for name in header["coords"]}
    return xr.Dataset(variables, coords, header["attrs"])


def as_lines(header: Header) -> list[str]:
    """A header as lines of text, one for each variable: `name: JSON`."""
    parts = {key: header[key] for key in ("attrs", "sizes", "coords")} | {
        f"variable {name}": about for name, about in header["variables"].items()
    }
    return [f"{key}: {json.dumps(part, ensure_ascii=False, allow_nan=False)}" for key, part in parts.items()]


def from_lines(lines: list[str]) -> Header:
    """The header that `as_lines` wrote."""
    header: Header = {"variables": {}}
    for line in lines:
        key, _, text = line.partition(": ")
        if key.startswith("variable "):
            header["variables"][key.removeprefix("variable ")] = json.loads(text)
        else:
            header[key] = json.loads(text)
    return header


# --- files ------------------------------------------------------------------------------------------------------------


#: variables by the first dimension that they are over; others are over places (linings, thermal nodes, layers)
_GROUPS = {"time": "series", "event": "events", "stop": "stops", "stage": "stages"}
_PLACES, _METRICS = "places", "metrics"
_TEXT = "@"  # number format of Excel for cells that are text
#: characters with which Excel begins a formula
_FORMULA = ("=", "+", "-", "@")


def groups(data: Dataset) -> dict[str, dict[str, DataArray]]:
    """The variables of a data set as `series`, `events`, `stops`, `stages`, `places`, and `metrics` (single values)."""
    by_group: dict[str, dict[str, DataArray]] = {name: {} for name in (*_GROUPS.values(), _PLACES, _METRICS)}
    for name in [*data.coords, *data.data_vars]:
        dims = data[name].dims
        by_group[_GROUPS.get(str(dims[0]), _PLACES) if dims else _METRICS][str(name)] = data[name]
    return {name: variables for name, variables in by_group.items() if variables}


def inputs(data: Dataset) -> list[tuple[str, float, str]]:
    """Path, value (SI) and unit of every number of the scene; those of an array one by one, as `times[2]`."""
    rows = list[tuple[str, float, str]]()
    for row in json.loads(data.attrs["provenance"])["scene"]["numbers"]:
        values = np.asarray(row["value"], float)
        for place in np.ndindex(values.shape):
            rows.append((row["path"] + "".join(f"[{i}]" for i in place), float(values[place]), row["unit"]))
    return rows


def materials(data: Dataset) -> list[dict[str, Any]]:
    """The materials of the scene: `path`, `name` in the library ("" for another), and properties (SI)."""
    parts = json.loads(data.attrs["provenance"])["scene"]["parts"]
    numbers, rows = {path: value for path, value, _ in inputs(data)}, []
    for path in (path for path, kind in parts.items() if kind == Material.__name__):
        own = {key.removeprefix(f"{path}."): x for key, x in numbers.items() if key.startswith(f"{path}.")}
        same = (
            name for name, properties in LIBRARY.items() if all(own.get(k) == x.value for k, x in properties.items())
        )
        rows.append({"path": path, "name": next(same, ""), **{name: own.get(name, np.nan) for name in _properties()}})
    return rows


def _properties() -> dict[str, str]:
    """Properties of a material with their units."""
    fields = Material.__dataclass_fields__
    return {name: field.metadata["quantity"].unit for name, field in fields.items()}


def written_only(path: Path) -> Any:
    """Refuses to read a file that is for other programs."""
    hint = "keep the result as .nc, .parquet or .csv as well"
    raise InputError([Fault(str(path), f"{path.suffix} is written for other programs, not read back", hint)])


# --- Excel ------------------------------------------------------------------------------------------------------------


def sheets(data: Dataset) -> Iterator[tuple[str, list[list[Any]]]]:
    """Title and rows of every sheet, the head first."""
    yield "inputs", [["path", "value", "unit"], *map(list, inputs(data))]
    by_group = groups(data)
    for title in ("stops", "stages", "events", "series", _METRICS, _PLACES):
        variables = by_group.get(title, {})
        if title == _METRICS:
            rows = [
                [name, variable.values[()], _unit(variable), variable.attrs["meaning"]]
                for name, variable in variables.items()
            ]
            yield title, [["name", "value", "unit", "meaning"], *rows]
        elif variables:
            columns = {name: x for variable in variables for name, x in columns_of(data, variable).items()}
            yield title, [list(columns), *map(list, itertools.zip_longest(*columns.values()))]
    heads = [f"{name} [{unit}]" if unit != "1" else name for name, unit in _properties().items()]
    yield "materials", [["path", "name", *heads], *(list(material.values()) for material in materials(data))]
    descriptions = [
        [name, group, _unit(variable), variable.attrs["meaning"]]
        for group in by_group
        for name, variable in by_group[group].items()
    ]
    yield "columns", [["name", "sheet", "unit", "meaning"], *descriptions]


def _unit(variable: DataArray) -> str:
    return variable.attrs.get("units", "1")


def write_excel(data: Dataset, path: Path) -> None:
    """A workbook with a sheet for each of inputs, stops, events, series, metrics, materials and the rest.

    Texts stay texts, also where they begin like a formula; of numbers Excel has no infinity: these are texts as well.
    """
    openpyxl = needed("openpyxl", "writes Excel workbooks", "tables")
    from openpyxl.cell import WriteOnlyCell
    from openpyxl.cell.cell import ILLEGAL_CHARACTERS_RE

    book = openpyxl.Workbook(write_only=True)
    book.properties.creator, book.properties.title = "simbrake", data.attrs["title"]

    def cell(sheet: Any, x: Any) -> Any:
        if x is None or (isinstance(x, float | np.floating) and np.isnan(x)):
            return None
        if isinstance(x, int | np.integer):
            return int(x)
        if isinstance(x, float | np.floating) and np.isfinite(x):
            return float(x)
        text = ILLEGAL_CHARACTERS_RE.sub("?", str(x))
        written = WriteOnlyCell(sheet, text)
        written.data_type = "s"
        if text.startswith(_FORMULA):  # stays a text also where it is edited
            written.quotePrefix, written.number_format = True, _TEXT
        return written

    for title, rows in sheets(data):
        sheet = book.create_sheet(title)
        sheet.freeze_panes = "A2"
        for row in rows:
            sheet.append([cell(sheet, x) for x in row])
    book.save(path)


# --- MATLAB -----------------------------------------------------------------------------------------------------------


def write_matlab(data: Dataset, path: Path) -> None:
    """One struct `result`: `series`, `events`, `stops`, … with arrays by name; `inputs`, `materials`; `units` and
    `meaning` by the same names. Characters that a name of MATLAB cannot have are `_`: `energy_friction_heat`."""
    from scipy.io import savemat

    by_group = groups(data)
    words = _identifiers([name for variables in by_group.values() for name in variables])
    all_variables = {name: variable for variables in by_group.values() for name, variable in variables.items()}
    result: dict[str, Any] = {
        group: {words[name]: _matlab(variable.values) for name, variable in variables.items()}
        for group, variables in by_group.items()
    }
    result["units"] = {words[name]: _unit(variable) for name, variable in all_variables.items()}
    result["meaning"] = {words[name]: variable.attrs["meaning"] for name, variable in all_variables.items()}
    numbers = inputs(data)
    result["inputs"] = {
        key: _matlab(np.asarray([row[i] for row in numbers])) for i, key in enumerate(("path", "value", "unit"))
    }
    if rows := materials(data):
        result["materials"] = {key: _matlab(np.asarray([row[key] for row in rows])) for key in rows[0]}
        result["units"] |= _properties()
    result["provenance"] = data.attrs["provenance"]
    savemat(path, {"result": result}, long_field_names=True, oned_as="column", do_compression=True)


def _matlab(values: Any) -> Any:
    """Numbers as doubles, texts as a cell array or one char array."""
    if values.dtype.kind == "U":
        return values.astype(object) if values.ndim else str(values)
    return values.astype(float)


def _identifiers(names: list[str]) -> dict[str, str]:
    """Names as MATLAB allows them: letters, digits and `_`, a letter first, at most 63, none twice."""
    identifiers = dict[str, str]()
    for name in names:
        word = re.sub(r"[^A-Za-z0-9_]", "_", name)[:60]
        word = word if word[:1].isalpha() else f"x{word}"
        while word in identifiers.values():
            word += "_"
        identifiers[name] = word
    return identifiers
