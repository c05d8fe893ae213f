"""Commands that run a scene many times: sensitivities, sweeps, calibration, life of the
linings."""

import math
import shlex
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any

import simbrake as sb

from .._base._faults import Issues, faults_of_place
from .._base._progress import Progress
from ..files.shipped_scenes import scene_file
from . import _options as cli


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
    faults = Issues()
    faults.unless(0 <= span < 1, "--span", span, "0 ≤ span < 1, of each parameter")
    scene = cli.opened(file, set_, rtol, folder=out, faults=faults)
    tables = sb.sensitivity(
        scene,
        metric or ["stopping_time"],
        wrt,
        span=span or None,
        rtol=rtol,  # pyright: ignore
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
    metrics: cli.Many = None,
    out: cli.Out = None,
    json_: cli.Json = False,
    set_: cli.Set = None,
    rtol: cli.Rtol = 1e-10,
    max_steps: int | None = None,
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
    max_steps
        Maximum number of step attempts; by default as many as needed.
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
    scene = faults.attempt(
        cli.opened,
        file,
        set_,
        rtol,
        folder=out,
        sample=sample,
        max_steps=max_steps,
        workers=workers,
    )
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
    drawn = axes if sample is None else sb.studies.samples(scene, axes, sample, seed)  # pyright: ignore
    data = (sb.sweep if sample is None else sb.ensemble)(
        scene,  # pyright: ignore
        drawn,
        asked,
        rtol=rtol,
        max_steps=max_steps,
        workers=workers,
        directory=resume,
        key=key,
        client=scheduler,
    )
    found = sb.studies.overview(scene, data, asked, limits)  # pyright: ignore
    cli.tell(found, json_, {**found.as_dict(), "rtol": rtol} if json_ else None)
    if out is not None:
        cli.print_written(sb.pages.write_runs(found, out), json_)
    # -1: interrupted before it was run
    codes = data["code"].values
    return 130 if codes.min() < 0 else cli.exit_code(not codes.any())


#: runs, and values of one parameter, at most
_MOST_RUNS = 100_000_000
_MOST_VALUES = 1_000_000


def _metrics_of(
    scene: cli.Scene, texts: list[str] | None, limits: Iterable[str]
) -> tuple[str, ...]:
    """`--metrics`: names with commas between them, `all`, or the default metrics of an
    ensemble; and those that have `limits`, where a pressure is compared by the load
    that gives it."""
    from ..outputs.metrics import metric_names
    from ..runs.measure import PRESSURE
    from ..studies.many_points import default_metrics

    asked = [name.strip() for text in texts or () for name in text.split(",")]
    named: Iterable[str] = (
        metric_names(scene) if "all" in asked else filter(None, asked)
    )
    if texts is None:
        named = default_metrics(scene)
    return tuple(
        dict.fromkeys(
            (
                *named,
                *("max_normal_load" if name == PRESSURE else name for name in limits),
            )
        )
    )


def calibrate(
    file: cli.SceneFile,
    /,
    *data: Path,
    fit: cli.Many = None,
    recordings: Path | None = None,
    each: cli.Many = None,
    events: Annotated[list[Path] | None, cli.REPEATED] = None,
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
    measured = faults.attempt(reader, *sources, sigma=spreads, columns=column)
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
    calibration = sb.calibrate(
        scene,
        limits,
        measured,
        per_recording=limits_of_each,
        start=first,
        loss=loss,
        starts=starts,
        rtol=rtol,
        profile=profile,  # pyright: ignore
    )
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
        cli.print_written(sb.pages.write_calibration(calibration, out), json_)
    return _OUTCOMES[calibration.outcome]


#: exit codes of `calibrate`; 2 and 3 have their meaning for every command
_OUTCOMES = {"converged": 0, "not_converged": 1, "not_determined": 4}


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
        lining_life = sb.lining_life(scene, permissible, turn_at=turns, rtol=rtol)  # pyright: ignore
    cli.tell(lining_life, json_)
    if out is not None:
        cli.print_written(sb.pages.write_life(lining_life, out), json_)
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
