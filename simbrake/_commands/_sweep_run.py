"""The command `simbrake sweep`: a grid or a sample of a scenario's numbers, as tables."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .._base._faults import Fault, InputError
from .._base._table import Column, Table, plain
from .._parts._scene import Scene
from .._run._metrics import metric_names
from ..studies._ensemble import NOT_RUN, default_metrics, ensemble, sweep
from ..studies._uncertainty import samples

_FORMS = "PATH=LOW:HIGH:COUNT, PATH=a,b,c, or PATH=LOW:HIGH with --sample; SI units"


class Axes(NamedTuple):
    """What `--vary` asks for: values of a grid, or ranges of a sample."""

    values: dict[str, np.ndarray]
    ranges: dict[str, tuple[float, float]]


def parse_axes(texts: list[str], sample: int | None) -> Axes:
    """`--vary` in its forms; raises `InputError` with all errors."""
    axes, found = Axes({}, {}), []
    for text in texts:
        path, equals, given = (part.strip() for part in text.partition("="))
        if not (path and equals and given):
            found.append(Fault(text, "is not of the form path=values", _FORMS))
            continue
        if path in axes.values or path in axes.ranges:
            found.append(Fault(path, "is varied twice", "give each number once"))
            continue
        try:
            ends = given.split(":")
            if sample is not None:
                low, high = (float(end) for end in ends[:2]) if len(ends) == 2 else (math.nan, math.nan)
                if not low < high:
                    raise ValueError
                axes.ranges[path] = (low, high)
            else:
                axes.values[path] = _values(given)
        except ValueError:
            found.append(Fault(path, f"{given!r} cannot be read", _FORMS))
    if not texts:
        found.append(Fault("--vary", "is missing", _FORMS))
    if sample is not None and sample < 1:
        found.append(Fault("--sample", f"{sample} is out of range", "at least 1"))
    if found:
        raise InputError(found)
    return axes


def _values(text: str) -> np.ndarray:
    ends = text.split(":")
    if len(ends) == 1:
        return np.asarray([float(part) for part in text.split(",")])
    low, high, count = float(ends[0]), float(ends[1]), int(ends[2]) if len(ends) == 3 else 0
    if count < 2 or not low < high:
        raise ValueError(text)
    return np.linspace(low, high, count)


def metrics_of(scene: Scene, text: str | None) -> tuple[str, ...]:
    """`--metrics`: names with commas between them, `all`, or what an ensemble measures by itself."""
    if text is None:
        return default_metrics(scene)
    return metric_names(scene) if text == "all" else tuple(name.strip() for name in text.split(",") if name.strip())


def table(data: Any) -> dict[str, np.ndarray]:
    """Columns with units, one row per run: varied numbers, metrics, and how each run ended."""
    columns: dict[str, np.ndarray] = {}
    for name, variable in {**data.coords, **data.data_vars}.items():
        whole = variable.broadcast_like(data["code"]) if set(variable.dims) <= set(data["code"].dims) else variable
        unit = variable.attrs.get("units", "")
        columns[f"{name} [{unit}]" if unit not in ("", "1") else str(name)] = np.ravel(whole.values)
    columns.pop("run")
    return columns


def summary(data: Any, metrics: tuple[str, ...]) -> dict[str, Any]:
    """What `--json` prints: every run with its numbers, `null` for what did not happen, and the units."""
    paths = [str(name) for name in data.coords if name != "run"]
    columns = {name: np.ravel(data[name].broadcast_like(data["code"]).values) for name in [*paths, *metrics]}
    code, status = np.ravel(data["code"].values), np.ravel(data["status"].values)
    solver = {name: np.ravel(data[name].values) for name in ("method", "steps", "rejected", "retaken", "segments")}

    runs = [
        {
            "run": i,
            "values": {path: float(columns[path][i]) for path in paths},
            "status": str(status[i]),
            "code": int(code[i]),
            "metrics": {name: columns[name][i] for name in metrics if not name.startswith("energy.")},
            "energy": {
                name.removeprefix("energy."): column[i]
                for name, column in (*columns.items(), ("energy.closure", np.ravel(data["energy.closure"].values)))
                if name.startswith("energy.")
            },
            "solver": {name: str(c[i]) if name == "method" else int(c[i]) for name, c in solver.items()},
        }
        for i in range(code.size)
    ]
    units = {name: data[name].attrs.get("units", "") for name in [*paths, *metrics]}
    return plain({"units": units, "counts": counts(data), "rtol": data.attrs["rtol"], "runs": runs})


def counts(data: Any) -> dict[str, int]:
    """How many runs ended how."""
    names, numbers = np.unique(np.ravel(data["status"].values), return_counts=True)
    return {str(name): int(n) for name, n in zip(names, numbers, strict=True)}


def text(data: Any, metrics: tuple[str, ...]) -> str:
    """Some lines for people: how the runs ended, and the range of every metric."""
    total = data["code"].size
    ended = ", ".join(f"{n} {name.replace('_', ' ')}" for name, n in counts(data).items())
    three, rows = ("minimum", "median", "maximum"), []
    for name in metrics:
        values = np.ravel(data[name].values)
        values = values[np.isfinite(values)]
        found = np.quantile(values, [0.0, 0.5, 1.0]) if values.size else (None, "—", None)
        rows.append((name, *found, data[name].attrs.get("units", ""), values.size))
    columns = [Column("metric", left=True), *(Column(one) for one in three), "unit", Column("of how many runs")]
    return f"{total} runs: {ended}\n{Table(columns, rows)}"


def write(data: Any, folder: Path) -> list[Path]:
    """`runs.csv` and `runs.nc` (netCDF)."""
    folder.mkdir(parents=True, exist_ok=True)
    columns = table(data)
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    lines = [",".join(columns), *(",".join(_cell(x) for x in row) for row in rows)]
    written = [folder / "runs.csv", folder / "runs.nc"]
    written[0].write_text("\n".join(lines) + "\n", "utf-8")
    data.to_netcdf(written[1], engine="scipy")
    return written


def _cell(x: Any) -> str:
    if isinstance(x, float):
        return "" if math.isnan(x) else f"{x:.15g}"
    return str(x)


def run(scene: Scene, axes: Axes, metrics: tuple[str, ...], *, sample: int | None, seed: int, **settings: Any) -> Any:
    """The data set of a grid, or of a quasi-random sample."""
    if sample is None:
        return sweep(scene, axes.values, metrics, **settings)
    drawn: Mapping[str, Any] = samples(scene, axes.ranges, sample, seed)
    return ensemble(scene, drawn, metrics, **settings)


def exit_code(data: Any) -> int:
    """0 if every run reached its end, 1 if one failed, 130 if the user ended the whole before."""
    code = data["code"].values
    return 130 if np.any(code == NOT_RUN) else int(np.any(code != 0))
