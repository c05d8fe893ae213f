"""Command about the life of the linings."""

import json
import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ._cli_options import Json, Rtol, Scenario, Set, opened, prepare_jax, print_written, say, tolerance


def life(
    scenario: Scenario,
    /,
    *,
    permissible: str | None = None,
    turn_at: Annotated[list[str] | None, Parameter(negative="", consume_multiple=False)] = None,
    out: Path | None = None,
    json_: Json = False,
    set_: Set = None,
    rtol: Rtol = 1e-10,
) -> int:
    """Print how many stops the linings last: lining by lining, how unevenly, and what turning the band gains.

    The scene has a wear part, and is one stop, which is repeated.

    Parameters
    ----------
    permissible
        Thickness that may be worn off a lining, in m or with its unit, as "8 mm"; by default that of the scene.
    turn_at
        Stops after which the band is turned end for end, or best for the moment that makes the life longest; may be
        repeated.
    out
        Folder for the picture and the figures (JSON).
    json_
        Print the figures as JSON, alone on stdout.
    """
    prepare_jax()
    from .._base._faults import Fault, InputError
    from .._base._progress import Waiting
    from .._run._log import SimulationError
    from ..studies._lining_life import lining_life

    scene = opened(scenario, set_, out, rtol=tolerance(rtol))
    try:
        turns = "best" if turn_at == ["best"] else [float(x) for x in turn_at or []] or None
    except ValueError:
        raise InputError([Fault("--turn-at", f"{turn_at} are not numbers of stops", "numbers, or best")]) from None
    try:
        with Waiting("life", "compiles what it has not seen before, then runs"):
            found = lining_life(scene, permissible, turn_at=turns, rtol=rtol)
    except SimulationError as error:
        print(f"simbrake: {error}", file=sys.stderr)
        return 1
    say(json.dumps(found.as_dict(), indent=1, allow_nan=False) if json_ else found)
    if out is not None:
        from .. import plot
        from .._base._whole import whole_folder

        with whole_folder(out) as (scratch, written):
            (scratch / "life.json").write_text(json.dumps(found.as_dict(), indent=1, allow_nan=False) + "\n", "utf-8")
            plot.wear(found).savefig(scratch / "wear.png", dpi=130)
        print_written(written, json_)
    return 0
