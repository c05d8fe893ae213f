"""The command that compares materials of rim and linings."""

import json
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from ._cli_options import LIMIT_EXCEEDED, Json, Many, Rtol, Scenario, Set, opened, prepare_jax, print_written, tolerance

_FORMS = 'friction works, as in "400 kJ, 800 kJ", or a number of the scene, as in "initial.omega=12,24"'


def materials(
    scenario: Scenario,
    /,
    *,
    energy: str | None = None,
    rim: Many = None,
    lining: Many = None,
    run: bool = True,
    inertia: bool = False,
    fail_on_limit: Annotated[bool, Parameter(name="--fail-on-limit", negative="")] = False,
    out: Annotated[Path | None, Parameter(name=["--out", "-o"])] = None,
    set_: Set = None,
    rtol: Rtol = 1e-10,
    json_: Json = False,
) -> int:
    """Compare materials of rim and linings for the duty of a scene: temperatures, shares, stress, wear, mass.

    Parameters
    ----------
    energy
        Energy levels: friction works ("400 kJ, 800 kJ"), for which the initial speed is sought, or PATH=a,b,c, a number
        of the scene and its values. Without it: the scene as it is.
    rim
        Name of a rim's material; may be repeated. Without it: steel_20L, magnesium_alloy, brass, aluminium_alloy,
        cast_iron.
    lining
        Name of a lining's material; may be repeated. Without it: FK-24A, retinax.
    run
        Simulate each combination as well, where the scene's heat has a rim in layers; without it estimates alone.
    inertia
        Let the pulley's inertia follow the mass of its rim.
    fail_on_limit
        Exit with code 3 if a pair exceeds a permissible temperature or stress of its materials.
    out
        Chart of the comparison (.png, .svg or .pdf).
    json_
        Print materials with their sources, rows and verdicts as JSON, alone on stdout.
    """
    prepare_jax()
    from .._base._faults import Fault, InputError
    from ..formulas._material_table import DEFAULT_LININGS, DEFAULT_RIMS, compare_materials

    scene = opened(scenario, set_, None, rtol=tolerance(rtol))
    if out is not None and out.suffix not in (".png", ".svg", ".pdf"):
        what = f"{out.suffix or 'a name without ending'} is no picture"
        raise InputError([Fault(str(out), what, "give .png, .svg or .pdf")])
    levels = None if energy is None else _energy(scene, energy)
    try:
        found = compare_materials(
            scene,
            rim or DEFAULT_RIMS,
            lining or DEFAULT_LININGS,
            energy=levels,
            run=run,
            inertia=inertia,
            rtol=rtol,
        )
    except KeyError as error:
        raise InputError([Fault("--rim, --lining", error.args[0])]) from None
    print(json.dumps(found.as_dict(), indent=1, allow_nan=False) if json_ else found)
    if out is not None:
        from .. import plot

        plot.materials(found).savefig(out, dpi=120)
        print_written([out], json_)
    return LIMIT_EXCEEDED if fail_on_limit and not all(row.admissible for row in found) else 0


def _energy(scene: Any, text: str) -> Any:
    """`--energy` in its forms; raises `InputError` with all faults."""
    from .._base._faults import Fault, InputError
    from .._base._quantity import NumberReader, Quantity
    from .._run._edit import parse_assignments, with_values

    path, equals, given = (part.strip() for part in text.partition("="))
    listed = [part.strip() for part in (given if equals else text).split(",")]
    if equals and path and all(listed):
        # each value is read as by --set, units and all, and looked up where it then stands
        return {path: [_value(with_values(scene, parse_assignments([f"{path}={one}"])), path) for one in listed]}
    reader, joule = NumberReader(), Quantity("J", "friction work", 0.0, open_low=True)
    works = [reader.number(one, joule, "--energy", "J") for one in listed]
    if reader.faults:
        raise InputError([Fault(fault.path, fault.problem, _FORMS) for fault in reader.faults])
    return works


def _value(scene: Any, path: str) -> float:
    from .._base._faults import Fault, InputError
    from .._base._quantity import leaves

    found = next((leaf.value for leaf in leaves(scene) if leaf.path == path), None)
    if found is None or getattr(found, "ndim", 0):
        raise InputError([Fault("--energy", f"{path} is no single number of the scene", _FORMS)])
    return float(found)
