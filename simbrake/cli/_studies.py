"""Commands that run a scene many times: sensitivities, sweeps, calibration, life of the
linings."""

import math
import shlex
from collections import Counter
from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

import simbrake as sb

from .._base._faults import Fault, Issues, faults_of_place
from .._base._progress import Progress
from ..files.shipped_scenes import scene_file
from . import _options as cli

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import DataArray, Dataset

    from .._base._table import Table
    from ..runs.measure import Limited
    from ..studies import Calibration
else:
    DataFrame = DataArray = Dataset = Table = Limited = Calibration = (
        object  # slow to import, and not needed by `--help`
    )


def sensitivity(
    file: cli.SceneFile,
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
    """Print how metrics of a scene depend on its parameters: derivatives, elasticities,
    values at bounds.

    --out writes the tables (JSON, CSV) and a tornado chart of each metric.

    Parameters
    ----------
    metric
        Name of a metric, as stopping_time, max_tension, peak_rim_temperature or
        energy.friction_heat; may be repeated. Without it: the stopping time.
    wrt
        Path of a parameter, or of a part of the scene for all parameters below it; may
        be repeated. Without it: all.
    span
        Half-width of the range of each parameter, relative to its value: the scene is
        run at both bounds; 0: no ranges.
    """
    faults = (
        []
        if 0 <= span < 1
        else [
            Fault(
                "--span", f"{span} is out of range", "0 ≤ span < 1, of each parameter"
            )
        ]
    )
    scene = cli.opened(file, set_, rtol, folder=out, faults=faults)
    tables = sb.sensitivity(
        scene, metric or ["stopping_time"], wrt, span=span or None, rtol=rtol
    )
    cli.tell(
        "\n\n".join(str(table) for table in tables),
        json_,
        [table.as_dict() for table in tables],
    )
    if out is not None:
        cli.print_written(sb.pages.write_sensitivities(tables, out), json_)
    return 0


def sweep(
    file: cli.SceneFile,
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
    key: str | None = None,
    scheduler: str | None = None,
    limit: cli.Limits = None,
) -> int:
    """Run a scene on a grid or a sample of its parameters, and print the range of every
    metric.

    --out writes all runs as runs.csv and runs.nc (netCDF), and a figure of the metrics, sweep.png.

    Parameters
    ----------
    vary
        PATH=LOW:HIGH:COUNT or PATH=a,b,c: values of a parameter, in SI or each with its
        unit, as "duty.load.mass=40 t:80 t:5"; repeated: a grid of all combinations.
        With --sample: PATH=LOW:HIGH.
    sample
        Number of quasi-random samples of the ranges, instead of a grid.
    seed
        Seed of the sample.
    metrics
        Names of metrics, separated by commas, or all. By default all but maxima, which
        take longer than the runs.
    workers
        Number of threads; by default one for each core.
    resume
        Folder that stores finished runs: the same command continues an interrupted one.
    key
        With --resume: a text for the present version of functions of your own in a
        scene of Python. Without it such a study starts anew at each call.
    scheduler
        Address of a Dask scheduler whose workers run the simulations.
    """
    from ..runs import measure

    faults = Issues()
    form = "PATH=LOW:HIGH:COUNT, PATH=a,b,c, or PATH=LOW:HIGH with --sample"

    def split(text: str) -> tuple[list[str], int]:
        if sample is not None:
            return cli.bounds(text), 0
        if ":" not in text:
            return text.split(","), 0
        low, high, count = text.split(":")
        if not 2 <= int(count) <= _MOST_VALUES:
            raise ValueError(text)
        return [low, high], int(count)

    requested = cli.assignments("--vary", form, vary, split, faults)
    if not vary:
        faults.add("--vary", "is missing", form)
    runs = (
        math.prod(max(count, len(texts)) for texts, count in requested.values())
        if sample is None
        else sample
    )
    if runs > _MOST_RUNS:
        faults.add("--vary", f"{runs} runs are too many", f"at most {_MOST_RUNS}")
    faults += faults_of_place("--resume", resume)
    counts = {"sample": sample, "max_steps": max_steps, "workers": workers}
    scene = faults.attempt(cli.opened, file, set_, rtol, folder=out, **counts)
    import numpy as np

    axes: Any = cli.in_si(
        scene, "--vary", {path: texts for path, (texts, _) in requested.items()}, faults
    )
    for path, (texts, count) in requested.items():
        if count and path in axes:
            low, high = axes[path]
            axes[path] = np.linspace(low, high, count).tolist()
            if not low < high:
                faults.add(
                    f"--vary {path}",
                    f"{texts[0]} is not below {texts[1]}",
                    "give LOW:HIGH:COUNT",
                )
    limits = (scene and faults.attempt(cli.limits_of, scene, limit)) or {}
    scene = cli.checked(scene, faults)
    asked = _metrics_of(scene, metrics, limits)
    drawn = axes if sample is None else sb.studies.samples(scene, axes, sample, seed)
    data = (sb.sweep if sample is None else sb.ensemble)(
        scene,
        drawn,
        asked,
        rtol=rtol,
        max_steps=max_steps,
        workers=workers,
        directory=resume,
        key=key,
        client=scheduler,
    )
    limited = measure.Limited.of(scene, limits, asked)
    data = data.assign(colour=_colours(data, limited))
    runs = _table_of(data)
    within = _limits_of(limited, runs, asked)
    summary = _summary(runs, axes, asked, rtol) | {"limits": within} if json_ else None
    cli.tell(_text(runs, asked) + _limits_text(within), json_, summary)
    if out is not None:
        cli.write(out, _files_of(data, runs), json_)
    # -1: interrupted before it was run
    return 130 if min(runs["code"]) < 0 else cli.exit_code(not any(runs["code"]))


#: runs, and values of one parameter, at most
_MOST_RUNS = 100_000_000
_MOST_VALUES = 1_000_000


def _metrics_of(
    scene: cli.Scene, text: str | None, limits: Iterable[str]
) -> tuple[str, ...]:
    """`--metrics`: names with commas between them, `all`, or the default metrics of an
    ensemble; and those that have `limits`, where a pressure is compared by the load
    that gives it."""
    from ..outputs.metrics import metric_names
    from ..runs.measure import PRESSURE
    from ..studies.evaluating import default_metrics

    named = default_metrics(scene) if text is None else metric_names(scene)
    if text not in (None, "all"):
        named = tuple(name.strip() for name in text.split(",") if name.strip())
    return tuple(
        dict.fromkeys(
            (
                *named,
                *("max_normal_load" if name == PRESSURE else name for name in limits),
            )
        )
    )


def _files_of(data: Dataset, runs: Table) -> dict[str, Any]:
    """What `--out` writes, by name: all runs as a table and as netCDF, and a figure
    where one can be drawn."""
    heads = [
        column.name if column.unit in ("", "1") else f"{column.name} [{column.unit}]"
        for column in runs.columns
    ]
    rows = partial(
        runs.frame().to_csv,
        index=False,
        header=heads,
        float_format="%.15g",
        lineterminator="\n",
    )
    files = {"runs.csv": rows, "runs.nc": partial(data.to_netcdf, engine="scipy")}
    chart = Issues().attempt(
        sb.plot.sweep, data
    )  # none of three parameters or more, and where nothing varies
    return (
        files
        if chart is None
        else files | {"sweep.png": partial(chart.savefig, dpi=130)}
    )


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


def _summary(
    runs: Table, paths: Iterable[str], metrics: Sequence[str], rtol: float
) -> dict[str, object]:
    """Data of `--json`: every run with its numbers (`null`: did not happen), and the
    units."""
    energies = [
        name
        for name in dict.fromkeys([*metrics, "energy.closure"])
        if name.startswith("energy.")
    ]
    rows = [
        {
            "run": i,
            "values": {path: row[path] for path in paths},
            "status": row["status"],
            "reason": row["reason"],
            "colour": row["colour"],
            "code": row["code"],
            "metrics": {name: row[name] for name in metrics if name not in energies},
            "energy": {name.removeprefix("energy."): row[name] for name in energies},
            "solver": {
                name: row[name]
                for name in ("method", "steps", "rejected", "retaken", "segments")
            },
        }
        for i, row in enumerate(runs.as_list())
    ]
    units = {
        column.name: column.unit
        for column in runs.columns
        if column.name in (*paths, *metrics)
    }
    reasons = dict(sorted(Counter(runs["reason"]).items()))
    return {
        "units": units,
        "counts": _counts(runs),
        "reasons": reasons,
        "rtol": rtol,
        "runs": rows,
    }


#: what a verdict of many runs leaves out
_UNJUDGED = "; of parts without a limit, and of small margins, they say nothing"


def _text(runs: Table, metrics: Sequence[str]) -> str:
    """Verdicts and statuses of the runs, and the range of every metric, temperatures in
    °C."""
    import numpy as np

    from .._base._table import ZERO, Column, Table
    from ..outputs.judgement import REASONS

    ended = ", ".join(
        f"{n} {name.replace('_', ' ')}" for name, n in _counts(runs).items()
    )
    words = {reason.id: reason.words for reason in REASONS}
    judged = Counter(
        (row["colour"], row["reason"]) for row in runs.as_list() if row["reason"]
    )
    verdicts = "; ".join(
        f"{n} {colour} {id} ({words[id]})" for (colour, id), n in sorted(judged.items())
    )
    lines = []
    for column in (each for each in runs.columns if each.name in metrics):
        values = np.asarray(runs[column.name])
        values = values[np.isfinite(values)]
        hot = column.unit == "K"
        quantiles = (
            np.quantile(values, [0.0, 0.5, 1.0]) - (ZERO if hot else 0.0)
            if values.size
            else (None, "—", None)
        )
        lines.append(
            (column.name, *quantiles, "°C" if hot else column.unit, values.size)
        )
    three = [Column(title) for title in ("minimum", "median", "maximum")]
    table = Table(["metric", *three, "unit", Column("of how many runs")], lines)
    return (
        f"{len(runs)} runs: {ended}\nverdicts {verdicts or 'none'}{_UNJUDGED}\n{table}"
    )


def _colours(data: Dataset, limited: Limited) -> DataArray:
    """Colours of the reasons, red where a limit is exceeded; what did not happen
    exceeds its limit.

    The least holding reserve of a run is in its reason only as far as its end shows it.
    """
    from ..outputs.metrics import HOLDING

    colours = data["colour"]
    if HOLDING in data:
        colours = colours.where((data["code"] != 0) | ~(data[HOLDING] <= 1), "red")
    for name, bound in limited.limits.items():
        colours = colours.where((data["code"] != 0) | (data[name] <= bound), "red")
    return colours.assign_attrs(
        meaning="colour of the reason, red where a limit that was checked is exceeded"
    )


def _limits_of(
    limited: Limited, runs: Table, metrics: Sequence[str]
) -> dict[str, Any] | None:
    """How many runs exceed each limit, of how many that have a value or should have
    one, and the names of those that were not looked at; `None` where there are none."""
    from ..outputs.metrics import HOLDING

    done = [row for row in runs.as_list() if row["code"] == 0]
    # what did not happen, as a stop that never came, exceeds its limit
    exceeded = {
        name: sum(row[name] is None or row[name] > bound for row in done)
        for name, bound in limited.limits.items()
    }
    bounds = dict(limited.limits)
    if HOLDING in metrics:
        bounds[HOLDING] = 1.0
        exceeded[HOLDING] = sum(
            row[HOLDING] is not None and row[HOLDING] <= 1 for row in done
        )
    if not bounds and not set(limited.aside) - {HOLDING}:
        return None
    # a reserve is of runs in which something holds; all others exceed a limit with what
    # never happened
    having = (
        {HOLDING: sum(row[HOLDING] is not None for row in done)}
        if HOLDING in metrics
        else {}
    )
    counts = [
        {
            "name": name,
            "limit": bounds[name],
            "exceeded": count,
            "of": having.get(name, len(done)),
        }
        for name, count in exceeded.items()
    ]
    return {"checked": counts, "runs": len(done), "not_checked": [*limited.aside]}


def _limits_text(limits: dict[str, Any] | None) -> str:
    """The same as a line."""
    from .._base._table import number
    from ..outputs.metrics import HOLDING
    from ..runs.measure import unit_of

    if limits is None:
        return ""
    said = []
    for one in limits["checked"]:
        bound = (
            "of 1 or less"
            if one["name"] == HOLDING
            else f"above {number(one['limit'], unit_of(one['name']))}"
        )
        without = limits["runs"] - one["of"]
        rest = (
            f" that have it ({without} {'has' if without == 1 else 'have'} none)"
            if without
            else ""
        )
        said.append(
            f"{one['name']} {bound} in {one['exceeded']} of {one['of']} runs{rest}"
        )
    said += [f"not among --metrics: {', '.join(limits['not_checked'])}"] * bool(
        limits["not_checked"]
    )
    return f"\nlimits   {'; '.join(said)}"


def calibrate(
    file: cli.SceneFile,
    /,
    *data: Path,
    fit: cli.Many = None,
    recordings: Path | None = None,
    each: cli.Many = None,
    events: Annotated[
        list[Path] | None, Parameter(negative="", consume_multiple=False)
    ] = None,
    sigma: cli.Many = None,
    column: cli.Many = None,
    start: cli.Many = None,
    set_: cli.Set = None,
    loss: str = "linear",
    starts: int = 1,
    profile: cli.Flag = False,
    rtol: cli.Rtol = 1e-8,
    out: cli.Out = None,
    json_: cli.Json = False,
) -> int:
    """Fit parameters of a scene to measured data, and report how well the data
    determine them.

    --out writes a chart (calibration.png), residuals.csv and the result as text and JSON.

    Parameters
    ----------
    data
        CSV files: series with a column t and others as in `omega [rpm]`, `omega_sigma`,
        or events.
    fit
        PATH=LOW:HIGH: a parameter of the scene to fit and its bounds, in SI or each
        with its unit, as "brake.pulley.inertia=500:2000"; may be repeated.
    recordings
        CSV table with a row for each recording instead of `data`: name, file, events,
        metrics that were measured, and numbers of the scene that are known of it, by
        path with unit.
    each
        PATH=LOW:HIGH: as --fit, of a parameter that differs between recordings; may be
        repeated.
    events
        CSV file with the columns event, time, sigma; may be repeated.
    sigma
        NAME=VALUE: standard deviation (SI units) of a column or event that has none in
        its file; may be repeated.
    column
        Column of the series to use, all by default; may be repeated.
    start
        PATH=VALUE: start value of a fitted parameter, by default that of the scene; may
        be repeated.
    loss
        Loss function: linear, or robust against outliers: soft_l1, huber, cauchy,
        arctan.
    starts
        Number of starts of the search; further ones are spread over the bounds.
    profile
        Intervals of the parameters that all recordings share by profile likelihood as
        well.
    """
    scene_file(file)
    cli.prepare_jax()
    faults = Issues()
    spreads = cli.assignments("--sigma", "NAME=VALUE", sigma, float, faults)
    if not (fit or each):
        faults.add(
            "--fit",
            "no parameter is to be fitted",
            "--fit brake.pulley.inertia=500:2000",
        )
    files = [*data, *(events or [])]
    if recordings and files:
        faults.add(
            "--recordings",
            f"beside {files[0]}",
            "name the files of each recording in the table",
        )
    reader, sources = (
        (sb.studies.read_recordings, [recordings])
        if recordings
        else (sb.read_measured, files)
    )
    measured = faults.attempt(reader, *sources, sigma=spreads, columns=column)  # pyright: ignore
    scene = faults.attempt(cli.opened, file, set_, rtol, folder=out, starts=starts)

    def numbers(option: str, form: str, texts: list[str] | None, split: Any) -> Any:
        return cli.in_si(
            scene, option, cli.assignments(option, form, texts, split, faults), faults
        )

    limits = numbers("--fit", "PATH=LOW:HIGH", fit, cli.bounds)
    limits_of_each = numbers("--each", "PATH=LOW:HIGH", each, cli.bounds)
    starts_at = numbers("--start", "PATH=VALUE", start, lambda text: [text])
    first = {path: value for path, (value,) in starts_at.items()}
    scene = cli.checked(scene, faults)
    measured = cli.checked(measured, faults)
    options = {
        "start": first,
        "loss": loss,
        "starts": starts,
        "rtol": rtol,
        "profile": profile,
    }
    calibration = sb.calibrate(
        scene, limits, measured, per_recording=limits_of_each, **options
    )  # pyright: ignore
    cli.tell(calibration, json_)
    if not json_:
        fitted = {
            path: value for path, value in calibration.values.items() if "@" not in path
        }
        settings = [
            *(set_ or []),
            *(f"{path}={value:.12g}" for path, value in fitted.items()),
        ]
        command = [
            "simbrake",
            "run",
            str(file),
            *(part for text in settings for part in ("--set", text)),
        ]
        cli.say(f"run it   {shlex.join(command)}")
    if out is not None:
        chart = partial(sb.plot.calibration(calibration).savefig, dpi=130)
        table = partial(
            _residuals(calibration).to_csv,
            index=False,
            float_format="%.12g",
            lineterminator="\n",
        )
        texts = {
            "calibration.json": cli.as_json(calibration.as_dict()),
            "calibration.txt": str(calibration),
        }
        cli.write(
            out, {**texts, "residuals.csv": table, "calibration.png": chart}, json_
        )
    return _OUTCOMES[calibration.outcome]


#: exit codes of `calibrate`; 2 and 3 have their meaning for every command
_OUTCOMES = {"converged": 0, "not_converged": 1, "not_determined": 4}


def _residuals(fit: Calibration) -> DataFrame:
    """A row for each measured value."""
    import numpy as np
    import pandas as pd

    heads = [
        "name",
        "unit",
        "t [s]",
        "measured",
        "sigma",
        "before",
        "fitted",
        "residual over sigma",
    ]
    rows = []
    for part in fit.residuals:
        t = np.nan if part.t is None else part.t
        numbers = np.broadcast(
            t, part.measured, part.sigma, part.before, part.model, part.scaled
        )
        rows += [(part.name, part.unit, *row) for row in numbers]
    return pd.DataFrame(rows, columns=heads)


def life(
    file: cli.SceneFile,
    /,
    *,
    permissible: str | None = None,
    turn_at: cli.Many = None,
    out: cli.Out = None,
    json_: cli.Json = False,
    set_: cli.Set = None,
    rtol: cli.Rtol = 1e-10,
) -> int:
    """Print how many stops the linings last: lining by lining, how unevenly, and the
    gain by turning the band.

    The scene is one stop, which is repeated, and has a wear part. --out writes a figure
    and the numbers (JSON).

    Parameters
    ----------
    permissible
        Permissible wear depth of a lining, in m or with its unit, as "8 mm"; by default
        that of the scene.
    turn_at
        Number of stops after which the band is turned end for end, or best: the number
        that gives the longest life; may be repeated.
    """
    faults = Issues()
    turns = None
    try:
        turns = (
            "best" if turn_at == ["best"] else [float(x) for x in turn_at or []] or None
        )
    except ValueError:
        faults.add(
            "--turn-at", f"{turn_at} are not numbers of stops", "numbers, or best"
        )
    scene = cli.opened(file, set_, rtol, folder=out, faults=faults)
    with Progress("life", "compiling and running…"):
        lining_life = sb.lining_life(scene, permissible, turn_at=turns, rtol=rtol)
    cli.tell(lining_life, json_)
    if out is not None:
        chart = partial(sb.plot.wear(lining_life).savefig, dpi=130)
        cli.write(
            out,
            {"life.json": cli.as_json(lining_life.as_dict()), "wear.png": chart},
            json_,
        )
    return 0


#: commands and their exit codes
COMMANDS = {
    sensitivity: "0 success; 1 a run failed; 2 the input is wrong.",
    sweep: "0 every run reached its end; 1 a run failed; 2 the input is wrong; 130 interrupted.",
    calibrate: "0 the fit converged and the data determine every parameter; 1 it did "
    "not converge; 2 the input is "
    "wrong; 4 the data do not determine a parameter.",
    life: "0 success; 1 the run failed; 2 the input is wrong.",
}
