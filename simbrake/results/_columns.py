"""A data set as columns over time and a header that holds all the rest, for tables in files."""

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from xarray import DataArray, Dataset
else:
    DataArray = Dataset = Any  # xarray is imported when a data set is needed

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
            here = columns_of(data, str(name))
            columns |= here
            about["columns"] = list(here)
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
        labels = [f"{label}_{one}" for label in labels for one in own]
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
