"""Commands that run a scene many times: sensitivities, sweeps, calibration, life of the linings."""

import shlex
from collections import Counter
from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

import simbrake as sb

from .._base._faults import Fault
from .._base._progress import Waiting
from . import _options as cli

if TYPE_CHECKING:
    from numpy import ndarray
    from pandas import DataFrame
    from xarray import Dataset

    from .._base._table import Table
    from ..studies import Calibration
else:
    ndarray = DataFrame = Dataset = Table = Calibration = object  # slow to import, and not needed by `--help`


def sensitivity(
    scenario: cli.Scenario,
    /,
    *,
    metric: cli.Many = None,
    wrt: cli.Many = None,
    span: float = 0.01,
    out: cli.Out = None,
    json_: cli.Json = False,
    set_: cli.Set = None,
    rtol: cli.Rtol = 1e-10,
) -> int:
    """Print how metrics of a scenario depend on its parameters: derivatives, elasticities, values at bounds.

    Parameters
    ----------
    metric
        Name of a metric, as stopping_time, max_tension, peak_rim_temperature or energy.friction_heat; may be repeated.
        Without it: the stopping time.
    wrt
        Path of a parameter, or of a part of the scene for all parameters below it; may be repeated. Without it: all.
    span
        Half-width of the range of each parameter, relative to its value: the scene is run at both bounds; 0: no ranges.
    out
        Folder for the tables (JSON, CSV) and a tornado chart of each metric.
    """
    faults = [] if 0 <= span < 1 else [Fault("--span", f"{span} is out of range", "0 ≤ span < 1, of each parameter")]
    scene = cli.opened(scenario, set_, rtol, folder=out, faults=faults)
    tables = sb.sensitivity(scene, metric or ["stopping_time"], wrt, span=span or None, rtol=rtol)
    cli.tell("\n\n".join(str(table) for table in tables), lambda: [table.as_dict() for table in tables], json_)
    if out is not None:
        from .._pages._page import write_sensitivities

        cli.print_written(write_sensitivities(tables, out), json_)
    return 0


def sweep(
    scenario: cli.Scenario,
    /,
    *,
    vary: cli.Many = None,
    sample: int | None = None,
    seed: int = 0,
    metrics: str | None = None,
    out: cli.Out = None,
    json_: cli.Json = False,
    set_: cli.Set = None,
    rtol: cli.Rtol = 1e-10,
    max_steps: cli.MaxSteps = None,
    workers: int | None = None,
    resume: Path | None = None,
    scheduler: str | None = None,
) -> int:
    """Run a scenario on a grid or a sample of its parameters.

    Parameters
    ----------
    vary
        PATH=LOW:HIGH:COUNT or PATH=a,b,c: values of a parameter (SI); repeated, a grid. With --sample PATH=LOW:HIGH.
    sample
        Number of quasi-random samples of the ranges, instead of a grid.
    seed
        Seed of the sample.
    metrics
        Names with commas between them, or all. By default all but maxima, which cost more than the runs.
    out
        Folder for the tables: runs.csv and runs.nc (netCDF).
    workers
        Threads (one per core by default).
    resume
        Folder that stores finished runs: the same command continues an interrupted one.
    scheduler
        Address of a Dask scheduler whose workers simulate the runs.
    """
    faults: list[Fault] = []
    form = "PATH=LOW:HIGH:COUNT, PATH=a,b,c, or PATH=LOW:HIGH with --sample"
    axes = cli.assignments("--vary", form, vary, _grid if sample is None else cli.bounds, faults)
    if not vary:
        faults.append(Fault("--vary", "is missing", form))
    scene = cli.opened(
        scenario, set_, rtol, folder=out, faults=faults, sample=sample, max_steps=max_steps, workers=workers
    )
    asked = _metrics_of(scene, metrics)
    drawn = axes if sample is None else sb.studies.samples(scene, axes, sample, seed)
    data = (sb.sweep if sample is None else sb.ensemble)(
        scene, drawn, asked, rtol=rtol, max_steps=max_steps, workers=workers, directory=resume, client=scheduler
    )
    runs = _table_of(data)
    cli.tell(_text(runs, asked), lambda: _summary(runs, axes, asked, rtol), json_)
    if out is not None:
        heads = [one.name if one.unit in ("", "1") else f"{one.name} [{one.unit}]" for one in runs.columns]
        rows = partial(runs.frame().to_csv, index=False, header=heads, float_format="%.15g", lineterminator="\n")
        cli.write(out, {"runs.csv": rows, "runs.nc": partial(data.to_netcdf, engine="scipy")}, json_)
    # -1: interrupted before it was run
    return 130 if min(runs["code"]) < 0 else cli.exit_code(not any(runs["code"]))


def _grid(text: str) -> ndarray:
    """Values of `LOW:HIGH:COUNT` or `a,b,c`. Raises `ValueError`."""
    import numpy as np

    ends = text.split(":")
    if len(ends) == 1:
        return np.asarray([float(part) for part in text.split(",")])
    low, high, count = float(ends[0]), float(ends[1]), int(ends[2]) if len(ends) == 3 else 0
    if count < 2 or not low < high:
        raise ValueError(text)
    return np.linspace(low, high, count)


def _metrics_of(scene: cli.Scene, text: str | None) -> tuple[str, ...]:
    """`--metrics`: names with commas between them, `all`, or the default metrics of an ensemble."""
    from .._run._metrics import metric_names
    from ..studies._ensemble import default_metrics

    if text is None:
        return default_metrics(scene)
    return metric_names(scene) if text == "all" else tuple(name.strip() for name in text.split(",") if name.strip())


def _table_of(data: Dataset) -> Table:
    """A row per run: varied parameters, metrics, and status."""
    from .._base._table import Column, Table

    rows = data.to_dataframe().reset_index()
    names = [str(name) for name in (*data.coords, *data.data_vars) if name != "run"]
    columns = [Column(name, data[name].attrs.get("units", "")) for name in names]
    return Table(columns, rows[names].itertuples(index=False, name=None))


def _counts(runs: Table) -> dict[str, int]:
    """Number of runs by status."""
    return dict(sorted(Counter(runs["status"]).items()))


def _summary(runs: Table, paths: Iterable[str], metrics: Sequence[str], rtol: float) -> dict[str, object]:
    """Data of `--json`: every run with its numbers (`null`: did not happen), and the units."""
    energies = [name for name in dict.fromkeys([*metrics, "energy.closure"]) if name.startswith("energy.")]
    rows = [
        {
            "run": i,
            "values": {path: row[path] for path in paths},
            "status": row["status"],
            "code": row["code"],
            "metrics": {name: row[name] for name in metrics if name not in energies},
            "energy": {name.removeprefix("energy."): row[name] for name in energies},
            "solver": {name: row[name] for name in ("method", "steps", "rejected", "retaken", "segments")},
        }
        for i, row in enumerate(runs.as_list())
    ]
    units = {one.name: one.unit for one in runs.columns if one.name in (*paths, *metrics)}
    return {"units": units, "counts": _counts(runs), "rtol": rtol, "runs": rows}


def _text(runs: Table, metrics: Sequence[str]) -> str:
    """Statuses of the runs, and the range of every metric."""
    import numpy as np

    from .._base._table import Column, Table

    ended = ", ".join(f"{n} {name.replace('_', ' ')}" for name, n in _counts(runs).items())
    lines = []
    for one in (one for one in runs.columns if one.name in metrics):
        values = np.asarray(runs[one.name])
        values = values[np.isfinite(values)]
        found = np.quantile(values, [0.0, 0.5, 1.0]) if values.size else (None, "—", None)
        lines.append((one.name, *found, one.unit, values.size))
    three = [Column(one) for one in ("minimum", "median", "maximum")]
    table = Table(["metric", *three, "unit", Column("of how many runs")], lines)
    return f"{len(runs)} runs: {ended}\n{table}"


def calibrate(
    scenario: cli.Scenario,
    /,
    *data: Path,
    fit: cli.Many = None,
    events: Annotated[list[Path] | None, Parameter(negative="", consume_multiple=False)] = None,
    sigma: cli.Many = None,
    column: cli.Many = None,
    start: cli.Many = None,
    set_: cli.Set = None,
    loss: str = "linear",
    starts: int = 1,
    rtol: cli.Rtol = 1e-8,
    out: cli.Out = None,
    json_: cli.Json = False,
) -> int:
    """Fit parameters of a scenario to measured data and report how well the data determine them.

    Parameters
    ----------
    data
        CSV files: series with a column t and others as in `omega [rpm]`, `omega_sigma`, or events.
    fit
        PATH=LOW:HIGH: a parameter of the scene to fit and its bounds (SI units); may be repeated.
    events
        CSV file with the columns event, time, sigma; may be repeated.
    sigma
        NAME=VALUE: standard deviation (SI units) of a column or event that has none in its file; may be repeated.
    column
        Column of the series to use, all by default; may be repeated.
    start
        PATH=VALUE: start value of a fitted parameter, the scene's by default; may be repeated.
    loss
        linear, or against outliers soft_l1, huber, cauchy, arctan.
    starts
        How many starts; more than one are spread over the bounds.
    out
        Folder for a chart (calibration.png), residuals.csv and the result as text and JSON.
    """
    cli.prepare_jax()
    faults: list[Fault] = []
    limits = cli.assignments("--fit", "PATH=LOW:HIGH", fit, cli.bounds, faults)
    spreads = cli.assignments("--sigma", "NAME=VALUE", sigma, float, faults)
    first = cli.assignments("--start", "NAME=VALUE", start, float, faults)
    if not fit:
        faults.append(Fault("--fit", "no parameter is to be fitted", "--fit brake.pulley.inertia=500:2000"))
    files = [*data, *(events or [])]
    measured = cli.attempt(faults, sb.read_measured, *files, sigma=spreads, columns=column)
    scene = cli.opened(scenario, set_, rtol, folder=out, faults=faults, starts=starts)
    assert measured is not None
    found = sb.calibrate(scene, limits, measured, start=first, loss=loss, starts=starts, rtol=rtol)
    cli.tell(found, found.as_dict, json_)
    if not json_:
        settings = [*(set_ or []), *(f"{path}={value:.12g}" for path, value in found.values.items())]
        command = ["simbrake", "run", str(scenario), *(part for text in settings for part in ("--set", text))]
        cli.say(f"run it   {shlex.join(command)}")
    if out is not None:
        chart = partial(sb.plot.calibration(found).savefig, dpi=130)
        table = partial(_residuals(found).to_csv, index=False, float_format="%.12g", lineterminator="\n")
        texts = {"calibration.json": cli.as_json(found.as_dict()), "calibration.txt": str(found)}
        cli.write(out, {**texts, "residuals.csv": table, "calibration.png": chart}, json_)
    return cli.exit_code(found.converged)


def _residuals(fit: Calibration) -> DataFrame:
    """A row for each measured value."""
    import numpy as np
    import pandas as pd

    columns: dict[str, list[np.ndarray]] = {}
    for part in fit.residuals:
        times = np.full(part.measured.shape, np.nan) if part.t is None else part.t
        names = [np.full(part.measured.shape, text, object) for text in (part.name, part.unit)]
        numbers = (times, part.measured, part.sigma, part.before, part.model, part.scaled)
        heads = ("name", "unit", "t [s]", "measured", "sigma", "before", "fitted", "residual over sigma")
        for head, column in zip(heads, (*names, *numbers), strict=True):
            columns.setdefault(head, []).append(column)
    return pd.DataFrame({head: np.concatenate(found) for head, found in columns.items()})


def life(
    scenario: cli.Scenario,
    /,
    *,
    permissible: str | None = None,
    turn_at: cli.Many = None,
    out: cli.Out = None,
    json_: cli.Json = False,
    set_: cli.Set = None,
    rtol: cli.Rtol = 1e-10,
) -> int:
    """Print how many stops the linings last: lining by lining, how unevenly, and the gain by turning the band.

    The scene has a wear part, and is one stop, which is repeated.

    Parameters
    ----------
    permissible
        Permissible wear depth of a lining, in m or with its unit, as "8 mm"; by default that of the scene.
    turn_at
        Stops after which the band is turned end for end, or best for the number that gives the longest life; may be
        repeated.
    out
        Folder for the figure and the numbers (JSON).
    """
    faults: list[Fault] = []
    turns = None
    try:
        turns = "best" if turn_at == ["best"] else [float(x) for x in turn_at or []] or None
    except ValueError:
        faults.append(Fault("--turn-at", f"{turn_at} are not numbers of stops", "numbers, or best"))
    scene = cli.opened(scenario, set_, rtol, folder=out, faults=faults)
    with Waiting("life", "compiling and running…"):
        found = sb.lining_life(scene, permissible, turn_at=turns, rtol=rtol)
    cli.tell(found, found.as_dict, json_)
    if out is not None:
        chart = partial(sb.plot.wear(found).savefig, dpi=130)
        cli.write(out, {"life.json": cli.as_json(found.as_dict()), "wear.png": chart}, json_)
    return 0


COMMANDS = (sensitivity, sweep, calibrate, life)
