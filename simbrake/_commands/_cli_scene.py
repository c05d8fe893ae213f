"""`simbrake scene`: look at a scene, check it, and see what may stand in a scene file."""

import json
from typing import Annotated

import cyclopts
from cyclopts import Parameter

from ._cli_options import Json, Scenario, Set, opened, prepare_jax

scene = cyclopts.App(name="scene", help="Look at a scene, check it, or see what may stand in a scene file.")


@scene.command
def show(
    scenario: Scenario,
    /,
    *,
    set_: Set = None,
    toml: Annotated[bool, Parameter(negative="")] = False,
    json_: Json = False,
) -> int:
    """Print every number of a scene with its unit and meaning.

    Parameters
    ----------
    toml
        Print the scene as a TOML file instead, with which it can be run again.
    json_
        Print a list of {path, value, unit, meaning}, alone on stdout.
    """
    prepare_jax()
    from ..files._scene_file import scene_text
    from ..files._schema import numbers_of, numbers_text

    found = opened(scenario, set_, None)
    if toml:
        print(scene_text(found), end="")
    elif json_:
        print(json.dumps(numbers_of(found), indent=1))
    else:
        print(numbers_text(found))
    return 0


@scene.command
def check(scenario: Scenario, /, *, set_: Set = None, json_: Json = False) -> int:
    """Check a scene without running it: every fault in one report (exit code 2), or none, and what is unusual.

    Parameters
    ----------
    json_
        Print {faults, warnings} as JSON, alone on stdout.
    """
    prepare_jax()
    from .._base._faults import InputError
    from .._parts._scene import check as check_scene
    from .._parts._scene import plausibility, warnings
    from ..files._schema import count_text

    try:
        found = opened(scenario, set_, None)
        check_scene(found)
    except InputError as error:
        if not json_:
            raise
        faults = [{"path": f.path, "problem": f.problem, "hint": f.hint} for f in error.faults]
        print(json.dumps({"faults": faults, "warnings": []}, indent=1))
        return 2
    said = [*warnings(found), *plausibility(found)]
    if json_:
        print(json.dumps({"faults": [], "warnings": said}, indent=1))
    else:
        print("\n".join([f"no fault: {count_text(found)}", *(f"warning  {text}" for text in said)]))
    return 0


@scene.command
def schema(name: str | None = None, /, *, json_: Json = False) -> int:
    """Print what may stand in a scene file: keys, units, ranges, meaning.

    Parameters
    ----------
    name
        A type, as HookLoad or layered_heat, or a key, as friction. Without it: everything, from the scene down.
    json_
        Print the JSON Schema of scene files (draft 2020-12), alone on stdout: editors complete and check with it.
    """
    from ..files._schema import json_schema, schema_text

    print(json.dumps(json_schema(), indent=1) if json_ else schema_text(name))
    return 0
