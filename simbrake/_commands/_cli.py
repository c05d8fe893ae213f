"""The command line.

Exit codes: 0 the run reached its end, 1 it failed, 2 the input is wrong, 3 a limit is exceeded (`--fail-on-limit`).
"""

import sys
from pathlib import Path
from typing import Annotated

import cyclopts
from cyclopts import Parameter

import simbrake as sb

from .._base._faults import InputError
from . import _checks, _runs, _studies
from . import _options as cli
from ._console import Shell, print_readably, write_completion


def _version() -> str:
    """simbrake with the versions that its numbers depend on."""
    python, *others = _checks.versions().items()
    return ", ".join([*(f"{name} {number}" for name, number in others), f"Python {python[1]}"])


app = cyclopts.App(
    name="simbrake",
    help="""Dynamic simulator of band-shoe brakes of drilling drawworks: stick and slip of every lining, heat, events,
    and derivatives of all of it. First steps:

    * A run, its figures and tables in a folder: `simbrake run scenarios/u2_5_5_stop.toml --out stop`
    * Every parameter of a scene: `simbrake scene show scenarios/u2_5_5_stop.toml`
    * Your own scene: copy that file and edit it; the file format: `simbrake scene schema`
    * One parameter changed: `simbrake run mine.toml --set "duty.load.mass=80 t"`
    * What every parameter does to the stopping time: `simbrake sensitivity mine.toml`
    * A page to pass on: `simbrake report mine.toml`
    """,
    help_format="markdown",
    help_epilogue="Exit codes: 0 the run reached its end; 1 it failed, with a named code; 2 the input is wrong; "
    "3 a limit is exceeded (only with --fail-on-limit).",
    version=_version,
)


@app.command(name="--install-completion")
def install_completion(
    *, shell: Shell | None = None, output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None
) -> int:
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


scene = cyclopts.App(name="scene", help="Look at a scene, check it, or see the format of scene files.")


@scene.command
def show(scenario: cli.Scenario, /, *, set_: cli.Set = None, toml: cli.Flag = False, json_: cli.Flag = False) -> int:
    """Print every parameter of a scene with its unit and meaning.

    Parameters
    ----------
    toml
        Print the scene as a TOML file instead, with which it can be run again.
    json_
        Print a list of {path, value, unit, meaning}, alone on stdout.
    """
    found = cli.opened(scenario, set_)
    from ..files._scene_file import scene_text
    from ..files._schema import parameter_table

    if toml:
        print(scene_text(found), end="")
    else:
        table = parameter_table(found)
        cli.tell(table, table.as_list, json_)
    return 0


@scene.command
def check(scenario: cli.Scenario, /, *, set_: cli.Set = None, json_: cli.Flag = False) -> int:
    """Check a scene without running it: every error in one report (exit code 2), or none, and what is unusual.

    Parameters
    ----------
    json_
        Print {faults, warnings} as JSON, alone on stdout.
    """
    cli.prepare_jax()
    from .._parts._scene import plausibility, warnings
    from ..files._schema import count_text

    try:
        found = cli.opened(scenario, set_)
        sb.check(found)
    except InputError as error:
        if not json_:
            raise
        faults = [{"path": f.path, "problem": f.problem, "hint": f.hint} for f in error.faults]
        cli.tell("", lambda: {"faults": faults, "warnings": []}, json_)
        return 2
    said = [*warnings(found), *plausibility(found)]
    lines = [f"no error: {count_text(found)}", *(f"warning  {text}" for text in said)]
    cli.tell("\n".join(lines), lambda: {"faults": [], "warnings": said}, json_)
    return 0


@scene.command
def schema(name: str | None = None, /, *, json_: cli.Flag = False) -> int:
    """Print the format of scene files: keys, units, ranges, meaning.

    Parameters
    ----------
    name
        A type, as HookLoad or layered_heat, or a key, as friction. Without it: everything, from the scene down.
    json_
        Print the JSON Schema of scene files (draft 2020-12), alone on stdout: editors complete and check with it.
    """
    from ..files._schema import json_schema, schema_text

    print(cli.as_json(json_schema()) if json_ else schema_text(name))
    return 0


for _command in (scene, *_runs.COMMANDS, *_studies.COMMANDS, *_checks.COMMANDS):
    app.command(_command)


def main(arguments: list[str] | None = None) -> None:
    """Entry point of the `simbrake` command."""
    print_readably()
    try:
        code = app(arguments, exit_on_error=False, print_error=True, result_action="return_value")
        sys.stdout.flush()
        sys.exit(code if isinstance(code, int) else 0)
    except cyclopts.CycloptsError:
        sys.exit(2)
    except InputError as error:
        _end(error, 2)
    except RuntimeError as error:
        if not isinstance(error, sb.SimulationError | sb.formulas.SynthesisError):
            raise
        _end(error, 1)
    except KeyboardInterrupt:
        _end("interrupted; what --resume DIR keeps is kept, the same command goes on", 130)
    except BrokenPipeError:
        cli.redirect_output()
        sys.exit(1)


def _end(message: object, code: int) -> None:
    print(f"simbrake: {message}", file=sys.stderr)
    sys.exit(code)
