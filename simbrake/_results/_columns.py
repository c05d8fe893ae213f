"""A labelled data set taken apart for tables and put together again: columns over time, and a header with the rest."""

import json
from typing import Any

import numpy as np

KINDS = {"f": "float64", "i": "int64", "U": "str"}


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
        about: dict[str, Any] = {"dims": list(variable.dims), "kind": KINDS[variable.dtype.kind]}
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
