"""Commands that run a scene many times: sensitivities, sweeps, calibration."""

import json
import sys
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from ._cli_options import Json, Many, Rtol, Scenario, Set, limit, opened, prepare_jax, print_written, say, tolerance


def sensitivity(
    scenario: Scenario,
    /,
    *,
    metric: Many = None,
    wrt: Many = None,
    span: float = 0.01,
    out: Path | None = None,
    json_: Json = False,
    set_: Set = None,
    rtol: Rtol = 1e-10,
) -> int:
    """Print how metrics of a scenario move with its numbers: derivatives, elasticities, ends of a range.

    Parameters
    ----------
    metric
        Name of a metric, as stopping_time, max_tension, peak_rim_temperature or energy.friction_heat; may be repeated.
        Without it: the stopping time.
    wrt
        Path of a number, or of a part of the scene for all numbers below it; may be repeated. Without it: all.
    span
        Half of the range of each number at whose ends the scene is run as well, as a share of the number; 0: no ranges.
    out
        Folder for the tables (JSON, CSV) and a tornado chart of each metric.
    json_
        Print a list of tables as JSON, alone on stdout.
    """
    prepare_jax()
    from .._run._log import SimulationError
    from ..studies._sensitivity import sensitivity as tables_of

    share = (span, 0 <= span < 1, "a share of each number, 0 ≤ span < 1")
    scene = opened(scenario, set_, out, rtol=tolerance(rtol), span=share)
    try:
        tables = tables_of(scene, metric or ["stopping_time"], wrt, span=span or None, rtol=rtol)
    except SimulationError as error:
        print(f"simbrake: {error}", file=sys.stderr)
        return 1
    if json_:
        say(json.dumps([table.as_dict() for table in tables], indent=1, allow_nan=False))
    else:
        say("\n\n".join(str(table) for table in tables))
    if out is not None:
        from .._pages._export import write_sensitivities

        print_written(write_sensitivities(tables, out), json_)
    return 0


def sweep(
    scenario: Scenario,
    /,
    *,
    vary: Many = None,
    sample: int | None = None,
    seed: int = 0,
    metrics: str | None = None,
    out: Path | None = None,
    json_: Json = False,
    set_: Set = None,
    rtol: Rtol = 1e-10,
    max_steps: int | None = None,
    workers: int | None = None,
    resume: Path | None = None,
    scheduler: str | None = None,
) -> int:
    """Run a scenario on a grid or a sample of its numbers.

    Parameters
    ----------
    vary
        PATH=LOW:HIGH:COUNT or PATH=a,b,c: values of a number (SI units); repeated, a grid. With --sample PATH=LOW:HIGH.
    sample
        Number of quasi-random samples of the ranges, instead of a grid.
    seed
        Seed of the sample.
    metrics
        Names with commas between them, or all. By default all but greatest values, which cost more than the runs.
    out
        Folder for the tables: runs.csv and runs.nc (netCDF).
    json_
        Print units, counts and all runs as JSON, alone on stdout.
    max_steps
        Step attempts allowed.
    workers
        Threads (one per core by default).
    resume
        Folder that keeps finished runs: the same command goes on where an earlier one ended.
    scheduler
        Address of a Dask scheduler on whose workers the runs take place.
    """
    prepare_jax()
    from . import _sweep_run

    axes = _sweep_run.parse_axes(vary or [], sample)
    limits = {"rtol": tolerance(rtol), "max_steps": limit(max_steps), "workers": limit(workers)}
    scene = opened(scenario, set_, out, **limits)
    asked = _sweep_run.metrics_of(scene, metrics)
    settings: dict[str, Any] = {"rtol": rtol, "max_steps": max_steps, "workers": workers}
    data = _sweep_run.run(scene, axes, asked, sample=sample, seed=seed, directory=resume, client=scheduler, **settings)
    say(
        json.dumps(_sweep_run.summary(data, asked), indent=1, allow_nan=False)
        if json_
        else _sweep_run.text(data, asked)
    )
    if out is not None:
        print_written(_sweep_run.write(data, out), json_)
    return _sweep_run.exit_code(data)


def calibrate(
    scenario: Scenario,
    /,
    *data: Path,
    fit: Many = None,
    events: Annotated[list[Path] | None, Parameter(negative="", consume_multiple=False)] = None,
    sigma: Many = None,
    column: Many = None,
    start: Many = None,
    set_: Set = None,
    loss: str = "linear",
    starts: int = 1,
    rtol: Rtol = 1e-8,
    out: Path | None = None,
    json_: Json = False,
) -> int:
    """Fit numbers of a scenario to measured data and tell how well the data hold them.

    Parameters
    ----------
    data
        CSV files: series with a column t and others as in `omega [rpm]`, `omega_sigma`, or events.
    fit
        PATH=LOW:HIGH: a number of the scene to fit and its bounds (SI units); may be repeated.
    events
        CSV file with the columns event, time, sigma; may be repeated.
    sigma
        NAME=VALUE: standard deviation (SI units) of a column or event that has none in its file; may be repeated.
    column
        Column of the series to use, all by default; may be repeated.
    start
        PATH=VALUE: start value of a fitted number, the scene's by default; may be repeated.
    loss
        linear, or against outliers soft_l1, huber, cauchy, arctan.
    starts
        How many starts; more than one are spread over the bounds.
    out
        Folder for a chart (calibration.png), residuals.csv and the result as text and JSON.
    json_
        Print the result as JSON, alone on stdout.
    """
    prepare_jax()
    from ._calibrate_run import read_all, run

    scene = opened(scenario, set_, out, rtol=tolerance(rtol), starts=limit(starts))
    files = [*data, *(events or [])]
    measured, bounds, first = read_all(files, sigma or [], column or [], fit or [], start or [])
    options = {"start": first, "loss": loss, "starts": starts, "rtol": rtol}
    command = ["simbrake", "run", str(scenario), *(part for text in set_ or [] for part in ("--set", text))]
    return run(scene, command, measured, bounds, json_=json_, out=out, **options)
