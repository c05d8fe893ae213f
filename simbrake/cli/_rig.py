"""The command about recordings of rigs."""

import dataclasses
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

import simbrake as sb

from .._base._faults import Fault, InputError, Issues, existing_file, faults_of_place
from .._base._progress import Progress
from . import _options as cli

if TYPE_CHECKING:
    from ..parts.scene import Scene
    from ..rig import Ledger
else:
    Ledger = Scene = object  # slow to import, and not needed by `--help`

_LOG = (
    "Recording of a rig: WITSML 1.3 or 1.4 (.xml), LAS 1.2 to 3 (.las), or CSV, "
    "also as .xz or .gz."
)


def rig(
    file: Annotated[Path, Parameter(name="LOG", help=_LOG)],
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
    null: Annotated[
        list[float] | None, Parameter(negative="", consume_multiple=False)
    ] = None,
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
    settings: dict[str, Any] = {
        "lines": lines,
        "drum_radius": drum_radius,
        "efficiency": efficiency,
        "brake": brake,
    }
    settings |= {
        "block_mass": block_mass,
        "trip_pause": trip_pause,
        "auxiliary": auxiliary,
    }
    reading = {
        "names": column,
        "null": null,
        "time": time,
        "offset": offset,
        "show_names": names,
    }
    faults = Issues(faults_of_place("--out", out))
    if (
        faults.attempt(existing_file, file, "*.xml", "*.xml.xz", "*.las", "*.csv")
        is None
    ):
        raise InputError(faults)  # known before JAX is loaded
    cli.prepare_jax()
    brake_scene = (
        None
        if scene is None
        else faults.attempt(cli.opened, scene, set_, undriven=True)
    )
    if set_ and scene is None:
        faults.add("--set", "has no effect", "it is for a parameter of --scene")
    with Progress("rig", "reading…") as progress:
        try:
            said = book = _ledger(
                file, settings, tare, threshold, reading, brake_scene, faults, progress
            )
            if brake_scene is not None:
                said = sb.rig.replay(book, brake_scene, progress=progress)
        except InputError as error:
            raise InputError([_as_option(fault) for fault in error.faults]) from None
        with sb.results.display_units(units):
            cli.tell(said, json_)
        if out is not None:
            progress.now("page and figure")
            cli.print_written(sb.pages.write_ledger(said, out), json_)
    return cli.exit_code(said is book or said.result.ok)  # pyright: ignore


def _ledger(
    file: Path,
    settings: dict[str, Any],
    tare: str | None,
    threshold: list[str] | None,
    reading: dict[str, Any],
    scene: Scene | None,
    faults: Issues,
    progress: Progress,
) -> Ledger:
    """The ledger of a log by options as they are written, else by a scene. Raises
    `InputError` with all errors."""
    from .._base._quantity import BAD, NumberReader, Quantity
    from ..rig._ledger import POSITIVE, faults_of_settings
    from ..rig._lowerings import THRESHOLDS, faults_of_thresholds
    from ..rig._replay import settings_of

    reader = NumberReader()

    def in_si(name: str, text: Any, unit: str) -> Any:
        number = (
            reader.number(text, Quantity(unit, "a number"), name, unit)
            if isinstance(text, str)
            else text
        )
        return None if number is BAD else number

    settings |= {
        name: in_si(name, settings[name], unit) for name, unit in POSITIVE.items()
    }
    reading["offset"] = in_si("offset", reading["offset"], "s")
    reading["names"] = cli.assignments(
        "--column", "ROLE=COLUMN", reading["names"], _written, faults
    )
    shares = settings["auxiliary"] or []
    if len(shares) == 1 and "=" not in shares[0]:
        settings["auxiliary"] = in_si("auxiliary", shares[0], "1")
    elif shares:
        settings["auxiliary"] = cli.assignments(
            "--auxiliary", "KIND=SHARE", shares, float, faults
        )
    limits: dict[str, Any] = {}
    for name, text in cli.assignments(
        "--threshold", "NAME=VALUE", threshold, _written, faults
    ).items():
        if name in THRESHOLDS:
            limits[name] = in_si(name, text, THRESHOLDS[name])
        else:
            faults.add(
                f"--threshold {name}",
                "unknown threshold",
                f"there are: {', '.join(THRESHOLDS)}",
            )
    if tare is not None:
        ends = tuple(in_si("tare", end, "N") for end in tare.split(":"))
        if len(ends) != 2:
            faults.add(
                "tare", f"{tare} is not of the form LOW:HIGH", 'as in "290 kN:310 kN"'
            )
        elif None not in ends:
            limits["tare"] = ends
    limits = {name: value for name, value in limits.items() if value is not None}
    wrong = Issues(
        [
            *faults,
            *reader.faults,
            *faults_of_settings(**settings),
            *faults_of_thresholds(limits),
        ]
    )
    log = wrong.attempt(
        sb.rig.read,
        file,
        progress=lambda x, of: progress.now("MB read", x / 1e6, of / 1e6),
        **reading,
    )
    if log is None or wrong:
        raise InputError(wrong)
    progress.now("lowerings")
    if scene is not None:
        settings |= {
            name: x
            for name, x in settings_of(scene, log).items()
            if settings[name] is None
        }
    return sb.rig.ledger(sb.rig.lowerings(log, **limits), **settings)


def _written(text: str) -> str:
    if not text:
        raise ValueError
    return text


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

    name, _, rest = fault.path.partition(" ")
    if name in THRESHOLDS:
        fault = dataclasses.replace(fault, path=f"--threshold {name}")
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
        fault = dataclasses.replace(fault, path=f"--{option} {rest}".strip())
    hint = re.sub(r"names=\{'(\w+)': '(.*?)'\}", r'--column "\1=\2"', fault.hint)
    hint = re.sub(r"time=(\('.*?'\)|'[^']*')", lambda match: _as_times(match[1]), hint)
    return dataclasses.replace(fault, hint=re.sub(r"\blines=", "--lines", hint))


#: commands and their exit codes
COMMANDS = {
    rig: "0 success; 1 the replay failed; 2 the input is wrong, as damaged logs and "
    "such without lowerings are."
}
