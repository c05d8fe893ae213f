"""Commands about the files of scenes: new; scene show, scene check, scene schema."""

import shutil
import textwrap
from pathlib import Path

import cyclopts

import simbrake as sb

from .._base._faults import InputError, input_error, whole_file
from ..files.shipped_scenes import (
    Shipped,
    shipped,
    shipped_files,
    shipped_test_names,
    shipped_tests,
    title_of,
)
from . import _options as cli

_WRONG = "0 success; 2 the input is wrong."
CODES = f"Exit codes: {_WRONG}"


def new(
    name: str | None = None, file: Path | None = None, /, *, json_: cli.Flag = False
) -> int:
    """Write a new scene: a commented template, or a copy of a shipped scene. Without a
    name: list these.

    Templates: standard, staged, heated, tripping, rig, disc, shoe; lift, windlass,
    winch, winder and rotor with their acceptance tests, as lift_tests; drawworks_tests.
    The file runs at once: simbrake run FILE, simbrake test FILE.

    Parameters
    ----------
    name
        Name of a template or of a shipped scene.
    file
        File to write, by default the name with its ending in the working folder. An
        existing file is not replaced.
    json_
        Print {written, template, title}, or without a name a list of {name, file,
        template, title}, as JSON.
    """
    if name is None:
        entries = list(shipped_files().values())
        rows = [
            {
                "name": x.name,
                "file": str(x.file),
                "template": x.template,
                "title": x.title,
            }
            for x in entries
        ]
        cli.tell(_listed(entries), json_, rows)
        return 0
    tests = shipped_tests(name)
    source = tests or shipped(name)
    entry = Shipped(source.stem, source, title_of(source))
    target = (
        Path(source.name)
        if file is None
        else file / source.name
        if file.is_dir()
        else file
    )
    if target.suffix != source.suffix:
        raise input_error(
            str(target),
            f"{name} is a {source.suffix} file",
            f"give a name with {source.suffix}",
        )
    if target.exists():
        raise input_error(
            str(target), "exists and is not replaced", "give another name"
        )
    # the commands in its comments name the new file
    text = (
        source.read_text("utf-8")
        .replace(f"scenarios/{source.name}", str(target))
        .replace(source.name, target.name)
    )
    with whole_file(target) as scratch:
        scratch.write_text(text, "utf-8")
    about = {"written": str(target), "template": entry.template, "title": entry.title}
    command = "test" if tests else "run"
    lines = [f"written  {target}: {entry.title}"]
    lines.append(f"run it   simbrake {command} {target}")
    if not tests and shipped_tests(f"{name}_tests"):
        lines.append(f"tests    simbrake new {name}_tests: its acceptance tests")
    if source.suffix == ".py":
        lines.append(f"         python {target}: what the script prints beside")
    cli.tell("\n".join(lines), json_, about)
    return 0


def _listed(entries: list[Shipped]) -> str:
    """The names with their titles."""
    width = max(len(entry.name) for entry in entries)
    room = max(shutil.get_terminal_size((200, 24)).columns - width - 4, 40)
    templates = []
    scenes = []
    for entry in entries:
        title = textwrap.shorten(entry.title, room, placeholder="…")
        rows = templates if entry.template else scenes
        rows.append(f"  {entry.name:{width}}  {title}")
    how = "simbrake new NAME [FILE] writes one, simbrake run NAME runs it."
    tests = "\n".join(textwrap.wrap(", ".join(shipped_test_names()), room))
    parts = {
        "templates, with comments": templates,
        "acceptance tests, for simbrake test NAME": [textwrap.indent(tests, "  ")],
        "shipped scenes": scenes,
    }
    texts = ["\n".join([head, *lines]) for head, lines in parts.items()]
    return "\n\n".join([*texts, how])


scene = cyclopts.App(
    name="scene",
    help="Show a scene, check it, or print the format of scene files.",
    help_epilogue=CODES,
)


@scene.command
def show(
    file: cli.SceneFile,
    /,
    *,
    set_: cli.Set = None,
    toml: cli.Flag = False,
    json_: cli.Flag = False,
) -> int:
    """Print every parameter of a scene with its path, value, unit and meaning. A Python
    scene is run as a program.

    Parameters
    ----------
    toml
        Print the scene as a TOML file instead, which can be run.
    json_
        Print a list of {path, value, unit, meaning}, alone on stdout.
    """
    opened_scene = cli.opened(file, set_)
    from ..files._scene_file import scene_text
    from ._scene_format import parameter_table

    if toml:
        print(scene_text(opened_scene), end="")
    else:
        table = parameter_table(opened_scene)
        cli.tell(table, json_, table.as_list())
    return 0


@scene.command
def check(
    file: cli.SceneFile, /, *, set_: cli.Set = None, json_: cli.Flag = False
) -> int:
    """Check a scene without running it: every error in one report (exit code 2), and
    warnings of unusual values.

    The code of a Python scene is run: check a file of somebody else as TOML only, or
    read it first.

    Parameters
    ----------
    json_
        Print {faults, warnings} as JSON, alone on stdout.
    """
    cli.prepare_jax()
    from ..parts.unusual import plausibility, warnings
    from ._scene_format import count_text

    try:
        opened_scene = cli.opened(file, set_)
        sb.check_scene(opened_scene)  # pyright: ignore
    except InputError as error:
        if not json_:
            raise
        faults = [vars(fault) for fault in error.faults]
        cli.tell("", json_, {"faults": faults, "warnings": []})
        return 2
    found = [*warnings(opened_scene), *plausibility(opened_scene)]
    lines = [
        f"no error: {count_text(opened_scene)}",
        *(f"warning  {text}" for text in found),
    ]
    cli.tell("\n".join(lines), json_, {"faults": [], "warnings": found})
    return 0


@scene.command
def schema(name: str | None = None, /, *, json_: cli.Flag = False) -> int:
    """Print the format of scene files: keys, units, ranges, meaning.

    Parameters
    ----------
    name
        A type, as HookLoad or layered_heat, or a key, as friction. Without it: the
        whole format.
    json_
        Print the JSON Schema of scene files (draft 2020-12), alone on stdout: editors
        complete and check with it.
    """
    cli.prepare_jax()
    from ._scene_format import json_schema, schema_text

    print(cli.as_json(json_schema()) if json_ else schema_text(name))
    return 0


#: commands and their exit codes
COMMANDS = {new: "0 success; 2 an unknown name, or the file exists."}
