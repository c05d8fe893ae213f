"""Command `synthesize`: the parametric synthesis of a scene beside its run."""

import json
import sys
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from ._cli_options import LIMIT_EXCEEDED, Json, Many, Rtol, Scenario, Set, opened, prepare_jax, print_written, tolerance


def synthesize(
    scenario: Scenario,
    /,
    *,
    run: bool = True,
    out: Annotated[Path | None, Parameter(name=["--out", "-o"])] = None,
    given: Many = None,
    transmission: Annotated[bool, Parameter(negative="")] = False,
    fail_on_limit: Annotated[bool, Parameter(name="--fail-on-limit", negative="")] = False,
    set_: Set = None,
    rtol: Rtol = 1e-10,
    json_: Json = False,
) -> int:
    """Print the parametric synthesis of a braking in twelve steps, beside its simulation.

    Depth of heat, Fourier numbers, volumes, partition, temperatures, properties at these, rational thickness of rim and
    lining, heat balance, stress, operating characteristics and permissible limits.

    Parameters
    ----------
    run
        Simulate the scene as well; without it time and work are those of a classical stop.
    out
        File for the report (JSON with --json or where its name ends in .json). An existing one is replaced whole.
    given
        NAME=VALUE: a number that the scene does not have, with its unit, as "rim_thickness=28 mm", a material by its
        name, as rim=cast_iron, or a limit, as "permissible.back=130 degC"; may be repeated.
    transmission
        Take the share into the rim by heat transmission (S-41) instead of the scene's law or effusivities.
    fail_on_limit
        Exit with code 3 if the estimate or the run exceeds a permissible limit of step 12.
    json_
        Print the figures as JSON, alone on stdout: a list of {step, name, formula, value, unit, simulated, …}.
    """
    prepare_jax()
    from .._base._faults import whole_file
    from .._base._progress import Waiting
    from .._run._simulate import simulate
    from ..formulas._chain import SynthesisError
    from ..formulas._synthesis import synthesize as synthesis_of
    from ..formulas.heating import transmission_table

    scene, data, permissible = _asked(scenario, set_, given, out, rtol)
    partition = transmission_table() if transmission else None
    with Waiting("run", "compiles what it has not seen before, then runs"):
        result = simulate(scene, rtol=rtol, throw=False) if run else None
        try:
            found = synthesis_of(result or scene, data, permissible=permissible, partition=partition)
        except SynthesisError as error:
            print(f"simbrake: {error}", file=sys.stderr)
            return 1
    figures = json.dumps(found.as_list(), indent=1, allow_nan=False)
    print(figures if json_ else found)
    if out is not None:
        with whole_file(out) as path:
            path.write_text((figures if json_ or out.suffix == ".json" else str(found)) + "\n", "utf-8")
        print_written([out], json_)
    if result is not None and not result.ok:
        return 1
    return LIMIT_EXCEEDED if fail_on_limit and found.exceeded else 0


def _asked(scenario: Path, set_: Set, given: Many, out: Path | None, rtol: float) -> tuple[Any, Any, Any]:
    """Scene, given numbers and limits; `InputError` with the faults of all, before a run that may take minutes."""
    from .._base._faults import Fault, InputError
    from ..formulas._inputs import Permissible, read_given
    from ..formulas._synthesis import faults_of_synthesis

    faults = [] if out is None or not out.is_dir() else [Fault("--out", f"{out} is a folder", "give a file")]
    scene, data, permissible = None, None, Permissible()
    try:
        data, permissible = read_given(given or [])
    except InputError as error:
        faults += error.faults
    try:
        scene = opened(scenario, set_, None, rtol=tolerance(rtol))
    except InputError as error:
        faults += error.faults
    if scene is not None:
        faults += faults_of_synthesis(scene, data, permissible)
    if faults:
        raise InputError(faults)
    return scene, data, permissible
