"""The command about recordings of rigs."""

import dataclasses
import re
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

import simbrake as sb

from .._base._faults import Fault, InputError, Issues, existing_file, faults_of_place
from .._base._progress import Progress
from . import _options as cli


def rig(
    file: Annotated[Path, Parameter(name="LOG")],
    /,
    *,
    lines: float | None = None,
    drum_radius: str | None = None,
    brake: str | None = None,
    auxiliary: cli.Many = None,
    efficiency: float | None = None,
    block_mass: str | None = None,
    trip_pause: str = "1 h",
    tare: str | None = None,
    threshold: cli.Many = None,
    column: cli.Many = None,
    null: Annotated[list[float] | None, cli.REPEATED] = None,
    time: cli.Many = None,
    offset: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None,
    names: cli.Flag = False,
    scene: cli.ReplayScene = None,
    set_: cli.Set = None,
    units: cli.Units = "si",
    out: cli.Out = None,
    json_: cli.Json = False,
) -> int:
    """Print what a rig asked of its brakes: the lowerings in its recording, and the
    work at hook and drum.

    With --scene the recording is replayed on the brake of a scene: temperatures, wear
    and margins over the whole of it.
    --out writes the ledger as a self-contained page, CSV, JSON (SI), text, and its figure, with those of the replay.

    Parameters
    ----------
    file
        Recording of a rig: WITSML 1.3 or 1.4 (.xml), LAS 1.2 to 3 (.las), or CSV,
        also as .xz or .gz.
    lines
        Lines strung, where the log does not have them.
    drum_radius
        Radius of the drum to the middle of the rope, in m or with its unit, as "14 in".
    brake
        What brakes the drum: friction (friction brakes alone), auxiliary (and an
        auxiliary brake), or regenerative (and a motor that brakes).
    auxiliary
        Share (0 to 1) of the work at the drum that auxiliary brake or motor take, or
        KIND=SHARE with the kind of load, string, block or "not decidable"; may be
        repeated.
    efficiency
        Efficiency of the tackle in lowering (0 to 1); by default by the lines strung.
    block_mass
        Mass of block and top drive, in kg or with its unit, as "30 t".
    trip_pause
        Time without lowerings that ends a trip.
    tare
        LOW:HIGH: hook load without a string, in N or with its unit, as "290 kN:310 kN";
        by default by the log.
    threshold
        NAME=VALUE: a threshold of sb.rig.lowerings, in SI or with its unit, as
        "pause=20 s": pause, heave, end_speed, travel, jump, floor, fastest, spacing,
        alone, string, slack, set_down; may be repeated.
    column
        ROLE=COLUMN: which column is the block_position, hook_load, …, with its unit
        where the file lacks it, as "hook_load=W2 [klbf]"; may be repeated.
    null
        Value that means no value, instead of that of the file and of -999.25 and the
        like; may be repeated.
    time
        Column of times, or of dates and of clocks, and the format that each row has, of
        the date alone as %d/%m/%Y, or of all as "%H:%M:%S %d/%m/%Y"; may be repeated.
    offset
        Time by which the clock of the hook load is ahead of that of the position.
    names
        Show the name of the file and of the well in it, which are left out otherwise.
    """
    faults = Issues(faults_of_place("--out", out))
    kinds = ("*.xml", "*.xml.xz", "*.las", "*.csv")
    if faults.attempt(existing_file, file, *kinds) is None:
        raise InputError(faults)  # known before JAX is loaded
    cli.prepare_jax()
    brake_scene = (
        None
        if scene is None
        else faults.attempt(cli.opened, scene, set_, undriven=True)
    )
    if set_ and scene is None:
        faults.add("--set", "has no effect", "it is for a parameter of --scene")
    shares: Any = auxiliary or None
    if shares and (len(shares) > 1 or "=" in shares[0]):
        form = "KIND=SHARE"
        shares = cli.assignments("--auxiliary", form, shares, float, faults)
    elif shares:
        shares = shares[0]
    columns = cli.assignments("--column", "ROLE=COLUMN", column, cli.not_empty, faults)
    given = cli.assignments(
        "--threshold", "NAME=VALUE", threshold, cli.not_empty, faults
    )
    with Progress("rig", "reading…") as progress:
        try:
            book = faults.attempt(
                sb.rig.ledger_of,
                file,
                thresholds=given,
                tare=None if tare is None else tare.split(":"),
                lines=lines,
                drum_radius=drum_radius,
                efficiency=efficiency,
                block_mass=block_mass,
                brake=brake,
                auxiliary=shares,
                trip_pause=trip_pause,
                scene=brake_scene,
                names=columns,
                null=null,
                time=time,
                offset=offset,
                show_names=names,
                progress=progress.now,
            )
            answer = book = cli.checked(book, faults)
            if brake_scene is not None:
                answer = sb.rig.replay(book, brake_scene, progress=progress)  # pyright: ignore
        except InputError as error:
            raise InputError([_as_option(fault) for fault in error.faults]) from None
        with sb.results.display_units(units):
            cli.tell(answer, json_)
            if out is not None:
                progress.now("page and figure")
                cli.print_written(sb.pages.write_ledger(answer, out), json_)
    return cli.exit_code(answer is book or answer.result.ok)


def _as_times(names: str) -> str:
    """Names of columns and formats, as given to `time=`, as options."""
    each = re.findall(r"'([^']*)'", names)
    return " ".join(
        f'--time "{name}"' if " " in name else f"--time {name}" for name in each
    )


def _as_option(fault: Fault) -> Fault:
    """An error of a function of `simbrake.rig` in the words of the command."""
    from ..rig._ledger import POSITIVE
    from ..rig._lowerings import THRESHOLDS

    path = fault.path
    name, _, rest = path.partition(" ")
    if name in THRESHOLDS:
        path = f"--threshold {name}"
    elif name == "threshold":
        path = f"--{path}"
    elif name in (
        *POSITIVE,
        "efficiency",
        "brake",
        "auxiliary",
        "tare",
        "offset",
        "names",
        "time",
    ):
        option = "column" if name == "names" else name.replace("_", "-")
        path = f"--{option} {rest}".strip()
    hint = re.sub(r"names=\{'(\w+)': '(.*?)'\}", r'--column "\1=\2"', fault.hint)
    hint = re.sub(r"time=(\('.*?'\)|'[^']*')", lambda match: _as_times(match[1]), hint)
    hint = re.sub(r"\blines=", "--lines", hint)
    return dataclasses.replace(fault, path=path, hint=hint)


#: commands and their exit codes
COMMANDS = {
    rig: "0 success; 1 the replay failed; 2 the input is wrong, as damaged logs and "
    "such without lowerings are."
}
