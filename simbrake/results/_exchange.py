"""Results for other programs: an Excel workbook, a MATLAB file. Both are written, not read back."""

import itertools
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .._base._faults import Fault, InputError, needed
from ..thermal._material import LIBRARY, Material
from ._columns import columns_of

if TYPE_CHECKING:
    from xarray import DataArray, Dataset
else:
    DataArray = Dataset = Any

#: variables by the first dimension that they are over; others are over places (linings, thermal nodes, layers)
_GROUPS = {"time": "series", "event": "events", "stop": "stops", "stage": "stages"}
_PLACES, _METRICS = "places", "metrics"
_TEXT = "@"  # number format of Excel for cells that are text
#: characters with which Excel begins a formula
_FORMULA = ("=", "+", "-", "@")


def groups(data: Dataset) -> dict[str, dict[str, DataArray]]:
    """The variables of a data set as `series`, `events`, `stops`, `stages`, `places`, and `metrics` (single values)."""
    found: dict[str, dict[str, DataArray]] = {name: {} for name in (*_GROUPS.values(), _PLACES, _METRICS)}
    for name in [*data.coords, *data.data_vars]:
        dims = data[name].dims
        found[_GROUPS.get(str(dims[0]), _PLACES) if dims else _METRICS][str(name)] = data[name]
    return {name: variables for name, variables in found.items() if variables}


def inputs(data: Dataset) -> list[tuple[str, float, str]]:
    """Path, value (SI) and unit of every number of the scene; those of an array one by one, as `times[2]`."""
    found = list[tuple[str, float, str]]()
    for one in json.loads(data.attrs["provenance"])["scene"]["numbers"]:
        values = np.asarray(one["value"], float)
        for place in np.ndindex(values.shape):
            found.append((one["path"] + "".join(f"[{i}]" for i in place), float(values[place]), one["unit"]))
    return found


def materials(data: Dataset) -> list[dict[str, Any]]:
    """The materials of the scene: `path`, `name` in the library ("" for another), and properties (SI)."""
    parts = json.loads(data.attrs["provenance"])["scene"]["parts"]
    numbers, found = {path: value for path, value, _ in inputs(data)}, []
    for path in (path for path, kind in parts.items() if kind == Material.__name__):
        own = {key.removeprefix(f"{path}."): x for key, x in numbers.items() if key.startswith(f"{path}.")}
        same = (name for name, known in LIBRARY.items() if all(own.get(k) == x.value for k, x in known.items()))
        found.append({"path": path, "name": next(same, ""), **{name: own.get(name, np.nan) for name in _properties()}})
    return found


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
    found = groups(data)
    for title in ("stops", "stages", "events", "series", _METRICS, _PLACES):
        variables = found.get(title, {})
        if title == _METRICS:
            rows = [[name, one.values[()], _unit(one), one.attrs["meaning"]] for name, one in variables.items()]
            yield title, [["name", "value", "unit", "meaning"], *rows]
        elif variables:
            columns = {name: x for variable in variables for name, x in columns_of(data, variable).items()}
            yield title, [list(columns), *map(list, itertools.zip_longest(*columns.values()))]
    heads = [f"{name} [{unit}]" if unit != "1" else name for name, unit in _properties().items()]
    yield "materials", [["path", "name", *heads], *(list(one.values()) for one in materials(data))]
    told = [[name, group, _unit(one), one.attrs["meaning"]] for group in found for name, one in found[group].items()]
    yield "columns", [["name", "sheet", "unit", "meaning"], *told]


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
        if isinstance(x, float | np.floating) and np.isnan(x):
            return None
        if isinstance(x, int | np.integer):
            return int(x)
        if isinstance(x, float | np.floating) and np.isfinite(x):
            return float(x)
        if x is None:
            return None
        text = ILLEGAL_CHARACTERS_RE.sub("?", str(x))
        found = WriteOnlyCell(sheet, text)
        found.data_type = "s"
        if text.startswith(_FORMULA):  # stays a text also where it is edited
            found.quotePrefix, found.number_format = True, _TEXT
        return found

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

    found = groups(data)
    words = _identifiers([name for variables in found.values() for name in variables])
    told = {name: one for variables in found.values() for name, one in variables.items()}
    result: dict[str, Any] = {
        group: {words[name]: _matlab(one.values) for name, one in variables.items()}
        for group, variables in found.items()
    }
    result["units"] = {words[name]: _unit(one) for name, one in told.items()}
    result["meaning"] = {words[name]: one.attrs["meaning"] for name, one in told.items()}
    numbers = inputs(data)
    result["inputs"] = {
        key: _matlab(np.asarray([one[i] for one in numbers])) for i, key in enumerate(("path", "value", "unit"))
    }
    if here := materials(data):
        result["materials"] = {key: _matlab(np.asarray([one[key] for one in here])) for key in here[0]}
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
    found = dict[str, str]()
    for name in names:
        word = re.sub(r"[^A-Za-z0-9_]", "_", name)[:60]
        word = word if word[:1].isalpha() else f"x{word}"
        while word in found.values():
            word += "_"
        found[name] = word
    return found
