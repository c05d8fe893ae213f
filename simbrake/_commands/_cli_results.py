"""Commands about results: compare two, a report as one page, a film, estimates beside it."""

import json
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ._cli_options import (
    FailOnLimit,
    Json,
    Limits,
    Many,
    Rtol,
    Scenario,
    Set,
    opened,
    prepare_jax,
    print_written,
    tolerance,
)


def compare(a: Path, b: Path, /, *, rtol: float = 1e-9, json_: Json = False) -> int:
    """Compare two results: what of the scenes differs, and what moved. Exit code 0: equal, 1: different.

    Parameters
    ----------
    a
        Result file (.nc, .parquet, .csv), folder of `run --out`, or a scene (.toml, .py), which is run.
    b
        The same.
    rtol
        Relative difference up to which numbers count as equal.
    json_
        Print the comparison as JSON, alone on stdout.
    """
    prepare_jax()
    from ..files._scene_file import open_scene
    from ._compare_run import run

    return run(a, b, open_scene, rtol=rtol, json_=json_)


def report(
    scenario: Scenario,
    /,
    *,
    out: Annotated[Path | None, Parameter(name=["--out", "-o"])] = None,
    sensitivity: Many = None,
    limit: Limits = None,
    fail_on_limit: FailOnLimit = False,
    check: bool = True,
    set_: Set = None,
    rtol: Rtol = 1e-10,
    json_: Json = False,
) -> int:
    """Run a scene and write its report: one HTML page that needs nothing else.

    Parameters
    ----------
    out
        The page; by default the scene's name with .html in the working folder. An existing one is replaced whole.
    sensitivity
        Metric whose derivatives by every number are shown; may be repeated.
    check
        Run a second time at another tolerance, to say how accurate the first run is.
    json_
        Print {status, message, written, limits} as JSON, alone on stdout.
    """
    prepare_jax()
    from ._report_run import report_run

    scene = opened(scenario, set_, None, rtol=tolerance(rtol))
    options = {"sensitivity": sensitivity or [], "limit": limit or [], "fail_on_limit": fail_on_limit}
    return report_run(scene, scenario, out, **options, check=check, rtol=rtol, json_=json_)


def animate(
    scenario: Scenario,
    out: Path,
    /,
    *,
    duration: float = 6.0,
    fps: int = 20,
    start: float | None = None,
    end: float | None = None,
    set_: Set = None,
    rtol: Rtol = 1e-10,
) -> int:
    """Film one braking: the pulley turns, linings are coloured by stick and slip and by temperature.

    Parameters
    ----------
    out
        The film: .gif, or .html for a page with a slider that needs nothing else.
    duration
        Length of the film (s).
    fps
        Frames per second.
    start
        Simulated time (s) at which it begins.
    end
        Simulated time (s) at which it ends; by default shortly after the stop.
    """
    prepare_jax()
    from .._base._faults import Fault, InputError
    from .._base._progress import Waiting
    from .._run._simulate import simulate

    scene = opened(scenario, set_, None, rtol=tolerance(rtol), duration=(duration, 0 < duration <= 600, "0…600 s"))
    if out.suffix not in (".gif", ".html"):
        raise InputError([Fault(str(out), f"{out.suffix or 'a name without ending'} is no film", "give .gif or .html")])
    with Waiting("run", "compiles") as told:
        result = simulate(scene, rtol=rtol, throw=False, progress=told)
    from .. import plot

    plot.animate(result, out, duration=duration, fps=fps, start=start, end=end)
    print_written([out], False)
    return 0 if result.ok else 1


def estimates(
    scenario: Scenario, /, *, run: bool = True, set_: Set = None, rtol: Rtol = 1e-10, json_: Json = False
) -> int:
    """Print the classical engineering estimates of a braking beside its simulation, and why they differ.

    Parameters
    ----------
    run
        Simulate the scene as well; without it time and work are those of a classical stop.
    json_
        Print inputs and rows as JSON, alone on stdout.
    """
    prepare_jax()
    from .._base._progress import Waiting
    from .._run._simulate import simulate
    from ..formulas._estimates import estimates as table_of

    scene = opened(scenario, set_, None, rtol=tolerance(rtol))
    with Waiting("estimates", "compiles") as told:
        result = simulate(scene, rtol=rtol, throw=False, progress=told) if run else None
        told.now("estimates")
        table = table_of(scene if result is None else result)
    print(json.dumps(table.as_dict(), indent=1, allow_nan=False) if json_ else table)
    return 0 if result is None or result.ok else 1
