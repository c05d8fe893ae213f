"""The command line.

Exit codes: 0 the run reached its end, 1 it failed, 2 the input is wrong, 3 a limit is exceeded (`--fail-on-limit`).
"""

import json
import sys
from pathlib import Path
from typing import Annotated, Any

import cyclopts

from ._cli_completion import OUTPUT, Shell, write_completion
from ._cli_doctor import doctor, versions
from ._cli_life import life
from ._cli_materials import materials
from ._cli_options import (
    FailOnLimit,
    Json,
    Limits,
    Rtol,
    Scenario,
    Set,
    exit_code,
    limits_asked,
    nobody_reads,
    opened,
    prepare_jax,
    print_written,
    say,
    tolerance,
)
from ._cli_options import limit as limit_of
from ._cli_results import animate, compare, estimates, report
from ._cli_scene import scene
from ._cli_studies import calibrate, sensitivity, sweep
from ._cli_synthesis import synthesize
from ._cli_validate import validate
from ._console import print_readably


def _version() -> str:
    """simbrake with the versions that its numbers depend on."""
    python, *others = versions().items()
    return ", ".join([*(f"{name} {number}" for name, number in others), f"Python {python[1]}"])


app = cyclopts.App(
    name="simbrake",
    help="""Dynamic simulator of band-shoe brakes of drilling drawworks: stick and slip of every lining, heat, events,
    and derivatives of all of it. First steps:

    * A run, its pictures and tables in a folder: `simbrake run scenarios/u2_5_5_stop.toml --out stop`
    * Every number of a scene: `simbrake scene show scenarios/u2_5_5_stop.toml`
    * A scene of your own: copy that file and edit it; what may stand in it: `simbrake scene schema`
    * One number changed: `simbrake run mine.toml --set "duty.load.mass=80 t"`
    * What every number does to the stopping time: `simbrake sensitivity mine.toml`
    * A page to pass on: `simbrake report mine.toml`
    """,
    help_format="markdown",
    help_epilogue="Exit codes: 0 the run reached its end; 1 it failed, with a named code; 2 the input is wrong; "
    "3 a limit is exceeded (only with --fail-on-limit).",
    version=_version,
)


@app.command(name="--install-completion")
def install_completion(*, shell: Shell | None = None, output: Annotated[Path | None, OUTPUT] = None) -> int:
    """Write the completion of commands and options for a shell; its start file is not touched.

    Parameters
    ----------
    shell
        Shell that is to complete; default that of the environment variable SHELL.
    output
        File to write; default where bash, zsh or fish looks for it.
    """
    print(write_completion(app.generate_completion, shell, output))
    return 0


@app.command
def run(
    scenario: Scenario,
    /,
    *,
    out: Path | None = None,
    json_: Json = False,
    set_: Set = None,
    limit: Limits = None,
    fail_on_limit: FailOnLimit = False,
    rtol: Rtol = 1e-10,
    max_steps: int | None = None,
    max_events: int = 10_000,
) -> int:
    """Run a scenario and print a summary.

    Parameters
    ----------
    out
        Folder for every picture of the run, the series (CSV), the result as labelled data (netCDF) and the summary.
    json_
        Print the summary and the limits as JSON, alone on stdout.
    max_steps
        Step attempts allowed.
    max_events
        Events allowed.
    """
    prepare_jax()
    from .._base._faults import InputError
    from .._base._progress import Waiting
    from .._run._measure import limit_checks, summary_with_limits, text_with_limits
    from .._run._simulate import simulate

    options = {"rtol": tolerance(rtol), "max_events": limit_of(max_events), "max_steps": limit_of(max_steps)}
    scene = opened(scenario, set_, out, **options)
    limits, faults = limits_asked(scene, limit, fail_on_limit)
    if faults:
        raise InputError(faults)
    with Waiting("run", "compiles") as told:
        given: dict[str, Any] = {"max_steps": max_steps, "max_events": max_events}
        result = simulate(scene, rtol=rtol, **given, throw=False, progress=told)
        told.now("sums up")
        checks = limit_checks(result, limits)
        text = text_with_limits(result, checks)
        if json_:
            text = json.dumps(summary_with_limits(result, checks), indent=2, allow_nan=False)
    say(text)
    if out is not None:
        from .._pages._page import write

        print_written(write(result, out, None, checks), json_)
    return exit_code(result.ok, checks, fail_on_limit)


@app.command
def reproduce(*, out: Path | None = None, json_: Json = False) -> int:
    """Recompute the published tables cell by cell: printed, computed, difference, verdict; draw what a formula gives.

    Parameters
    ----------
    out
        Folder for pictures of the papers' figures and tables that a formula gives, with the printed numbers as points.
    json_
        Print a list of {table, row, column, printed, computed, verdict}, alone on stdout.
    """
    prepare_jax()
    from ..published import cells, report

    rows = cells()
    print(json.dumps([cell.as_dict() for cell in rows], indent=1, allow_nan=False) if json_ else report(rows))
    if out is not None:
        from .._pages._page import write_published

        print_written(write_published(out), json_)
    return 1 if any(cell.verdict == "disagrees" for cell in rows) else 0


app.command(scene)
for _command in (
    report,
    animate,
    compare,
    estimates,
    synthesize,
    materials,
    life,
    sensitivity,
    sweep,
    calibrate,
    validate,
    doctor,
):
    app.command(_command)


def main(arguments: list[str] | None = None) -> None:
    """Entry point of the `simbrake` command."""
    from .._base._faults import InputError

    print_readably()
    try:
        code = app(arguments, exit_on_error=False, print_error=True, result_action="return_value")
        sys.stdout.flush()
    except cyclopts.CycloptsError:
        sys.exit(2)
    except InputError as error:
        print(f"simbrake: {error}", file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        print("simbrake: interrupted; what --resume DIR keeps is kept, the same command goes on", file=sys.stderr)
        sys.exit(130)
    except BrokenPipeError:
        nobody_reads()
        sys.exit(1)
    sys.exit(code if isinstance(code, int) else 0)
