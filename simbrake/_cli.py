"""The command line. Exit codes: 0 the run reached its end, 1 it failed, 2 the input is wrong."""

import importlib.util
import json
import os
import sys
from pathlib import Path
from typing import Annotated, Any

import cyclopts
from cyclopts import Parameter

app = cyclopts.App(
    name="simbrake",
    help="Dynamic simulator of band-shoe brakes of drilling drawworks.",
    version=lambda: _version(),
)


_Many = Annotated[list[str] | None, Parameter(negative="", consume_multiple=False)]
_Set = Annotated[list[str] | None, Parameter(name="--set", negative="", consume_multiple=False)]
_Json = Annotated[bool, Parameter(name="--json", negative="")]


def _version() -> str:
    from importlib.metadata import version

    names = ("simbrake", "jax", "diffrax", "equinox")
    return ", ".join(f"{name} {version(name)}" for name in names)


def _prepare_jax() -> None:
    """64 bits, and compiled programs kept between runs (`JAX_COMPILATION_CACHE_DIR` moves them, empty: none)."""
    cache = os.environ.get("JAX_COMPILATION_CACHE_DIR")
    if cache is None:
        base = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
        cache = os.path.join(base, "simbrake", "compiled")
    os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")  # a hit of the cache is no news for users
    import jax

    jax.config.update("jax_enable_x64", True)
    if cache:
        jax.config.update("jax_compilation_cache_dir", cache)
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.1)


def load_scene(file: Path) -> Any:
    """The scene that a scenario file defines by its function `scene()`."""
    from ._quantity import Fault, InputError
    from ._scene import Scene

    if not file.is_file():
        folder = file.parent if file.parent.is_dir() else Path(".")
        there = sorted(str(f) for f in folder.glob("*.py"))
        hint = f"there are: {', '.join(there[:8])}" if there else "give the path of a scenario file"
        raise InputError([Fault(str(file), "there is no such file", hint)])
    if file.suffix != ".py":
        raise InputError([Fault(str(file), "is not a Python file", "a scenario is a .py file with a function scene()")])
    spec = importlib.util.spec_from_file_location(f"scenario_{file.stem}", file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
        if not callable(getattr(module, "scene", None)):
            raise InputError([Fault(str(file), "defines no function scene()", "return a simbrake.Scene from it")])
        scene = module.scene()
    except InputError:
        raise
    except Exception as error:  # whatever goes wrong in somebody's file is a fault of the input, told in one line
        raise InputError([Fault(str(file), f"{type(error).__name__}: {error}", "mend the scenario file")]) from error
    if not isinstance(scene, Scene):
        raise InputError([Fault(str(file), f"scene() returned {type(scene).__name__}", "return a simbrake.Scene")])
    return scene


def _open(scenario: Path, set_: list[str] | None, out: Path | None, **limits: tuple[Any, bool, str]) -> Any:
    """The scene of a command, its numbers overridden; faults of the options first: name, value, admissible, hint."""
    from ._edit import parse_assignments, with_values
    from ._quantity import Fault, InputError

    wrong = [
        Fault(f"--{name.replace('_', '-')}", f"{value} is not admissible", hint)
        for name, (value, admissible, hint) in limits.items()
        if not admissible
    ]
    if out is not None and out.exists() and not out.is_dir():
        wrong.append(Fault("--out", f"{out} is a file", "give a folder"))
    if wrong:
        raise InputError(wrong)
    return with_values(load_scene(scenario), parse_assignments(set_ or []))


def _tolerance(rtol: float) -> tuple[float, bool, str]:
    return rtol, 1e-15 < rtol < 0.1, "0 < rtol < 0.1"


def _limit(count: int | None) -> tuple[int | None, bool, str]:
    return count, count is None or count > 0, "at least 1"


def _print_written(written: list[Path], json_: bool) -> None:
    if not json_:
        print("written  " + ", ".join(str(path) for path in written))


@app.command
def run(
    scenario: Path,
    /,
    *,
    out: Path | None = None,
    json_: _Json = False,
    set_: _Set = None,
    rtol: float = 1e-10,
    max_steps: int | None = None,
    max_events: int = 10_000,
) -> int:
    """Run a scenario and print a summary.

    Parameters
    ----------
    scenario
        Python file with a function scene() that returns a simbrake.Scene.
    out
        Folder for a chart (stop.png), the series (series.csv) and the summary.
    json_
        Print the summary as JSON, alone on stdout.
    set_
        PATH=VALUE: override a number of the scene (SI units), as in brake.band.stiffness=2e5; may be repeated.
    rtol
        Relative tolerance of the integration.
    max_steps
        Step attempts allowed.
    max_events
        Events allowed.
    """
    _prepare_jax()
    from ._simulate import simulate

    limits = {"rtol": _tolerance(rtol), "max_events": _limit(max_events), "max_steps": _limit(max_steps)}
    scene = _open(scenario, set_, out, **limits)
    result = simulate(scene, rtol=rtol, max_steps=max_steps, max_events=max_events, throw=False)
    if json_:
        print(json.dumps(result.summary(), indent=2, allow_nan=False))
    else:
        print(result)
    if out is not None:
        from ._export import write

        _print_written(write(result, out), json_)
    return 0 if result.ok else 1


@app.command
def calibrate(
    scenario: Path,
    /,
    *data: Path,
    fit: _Many = None,
    events: Annotated[list[Path] | None, Parameter(negative="", consume_multiple=False)] = None,
    sigma: _Many = None,
    column: _Many = None,
    start: _Many = None,
    set_: _Set = None,
    loss: str = "linear",
    starts: int = 1,
    rtol: float = 1e-8,
    out: Path | None = None,
    json_: _Json = False,
) -> int:
    """Fit numbers of a scenario to measured data and tell how well the data hold them.

    Parameters
    ----------
    scenario
        Python file with a function scene() that returns a simbrake.Scene.
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
    set_
        PATH=VALUE: override a number of the scene (SI units) before the fit; may be repeated.
    loss
        linear, or against outliers soft_l1, huber, cauchy, arctan.
    starts
        How many starts; more than one are spread over the bounds.
    rtol
        Relative tolerance of the integration.
    out
        Folder for a chart (calibration.png), residuals.csv and the result as text and JSON.
    json_
        Print the result as JSON, alone on stdout.
    """
    _prepare_jax()
    from ._calibrate_run import read_all, run

    scene = _open(scenario, set_, out, rtol=_tolerance(rtol), starts=_limit(starts))
    files = [*data, *(events or [])]
    measured, bounds, first = read_all(files, sigma or [], column or [], fit or [], start or [])
    options = {"start": first, "loss": loss, "starts": starts, "rtol": rtol}
    command = ["simbrake", "run", str(scenario), *(part for text in set_ or [] for part in ("--set", text))]
    return run(scene, command, measured, bounds, json_=json_, out=out, **options)


@app.command
def sensitivity(
    scenario: Path,
    /,
    *,
    metric: _Many = None,
    wrt: _Many = None,
    span: float = 0.01,
    out: Path | None = None,
    json_: _Json = False,
    set_: _Set = None,
    rtol: float = 1e-10,
) -> int:
    """Print how metrics of a scenario move with its numbers: derivatives, elasticities, ends of a range.

    Parameters
    ----------
    scenario
        Python file with a function scene() that returns a simbrake.Scene.
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
    set_
        PATH=VALUE: override a number of the scene (SI units); may be repeated.
    rtol
        Relative tolerance of the integration.
    """
    _prepare_jax()
    from ._outcome import SimulationError
    from ._sensitivity import sensitivity as tables_of

    share = (span, 0 <= span < 1, "a share of each number, 0 ≤ span < 1")
    scene = _open(scenario, set_, out, rtol=_tolerance(rtol), span=share)
    try:
        tables = tables_of(metric or ["stopping_time"], scene, wrt, span=span or None, rtol=rtol)
    except SimulationError as error:
        print(f"simbrake: {error}", file=sys.stderr)
        return 1
    if json_:
        print(json.dumps([table.as_dict() for table in tables], indent=1, allow_nan=False))
    else:
        print("\n\n".join(str(table) for table in tables))
    if out is not None:
        from ._export import write_sensitivities

        _print_written(write_sensitivities(tables, out), json_)
    return 0


@app.command
def sweep(
    scenario: Path,
    /,
    *,
    vary: _Many = None,
    sample: int | None = None,
    seed: int = 0,
    metrics: str | None = None,
    out: Path | None = None,
    json_: _Json = False,
    set_: _Set = None,
    rtol: float = 1e-10,
    max_steps: int | None = None,
    workers: int | None = None,
    resume: Path | None = None,
    scheduler: str | None = None,
) -> int:
    """Run a scenario on a grid or a sample of its numbers.

    Parameters
    ----------
    scenario
        Python file with a function scene() that returns a simbrake.Scene.
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
    set_
        PATH=VALUE: override a number of the scene (SI units) in all runs; may be repeated.
    rtol
        Relative tolerance of the integration.
    max_steps
        Step attempts allowed.
    workers
        Threads (one per core by default).
    resume
        Folder that keeps finished runs: the same command goes on where an earlier one ended.
    scheduler
        Address of a Dask scheduler on whose workers the runs take place.
    """
    _prepare_jax()
    from . import _sweep

    axes = _sweep.parse_axes(vary or [], sample)
    limits = {"rtol": _tolerance(rtol), "max_steps": _limit(max_steps), "workers": _limit(workers)}
    scene = _open(scenario, set_, out, **limits)
    asked = _sweep.metrics_of(scene, metrics)
    settings: dict[str, Any] = {"rtol": rtol, "max_steps": max_steps, "workers": workers}
    data = _sweep.run(scene, axes, asked, sample=sample, seed=seed, directory=resume, client=scheduler, **settings)
    print(json.dumps(_sweep.summary(data, asked), indent=1, allow_nan=False) if json_ else _sweep.text(data, asked))
    if out is not None:
        _print_written(_sweep.write(data, out), json_)
    return _sweep.exit_code(data)


@app.command
def reproduce(*, json_: _Json = False) -> int:
    """Recompute the published tables cell by cell: printed, computed, difference, verdict.

    Parameters
    ----------
    json_
        Print a list of {table, row, column, printed, computed, verdict}, alone on stdout.
    """
    _prepare_jax()
    from ._reproduce import cells, report

    rows = cells()
    print(json.dumps([cell.as_dict() for cell in rows], indent=1, allow_nan=False) if json_ else report(rows))
    return 1 if any(cell.verdict == "disagrees" for cell in rows) else 0


def main(arguments: list[str] | None = None) -> None:
    """Entry point of the `simbrake` command."""
    from ._quantity import InputError

    try:
        code = app(arguments, exit_on_error=False, print_error=True, result_action="return_value")
    except cyclopts.CycloptsError:
        sys.exit(2)
    except InputError as error:
        print(f"simbrake: {error}", file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        print("simbrake: interrupted", file=sys.stderr)
        sys.exit(130)
    except BrokenPipeError:
        sys.stderr.close()
        sys.exit(1)
    sys.exit(code if isinstance(code, int) else 0)
