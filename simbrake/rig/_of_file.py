"""The duty ledger straight from the file of a recording."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from .._base._faults import InputError, Issues
from .._base._quantity import BAD, NumberReader, Quantity
from ..parts.scene import Scene
from ._ledger import POSITIVE, Ledger, faults_of_settings, ledger
from ._log import read
from ._lowerings import THRESHOLDS, faults_of_thresholds, lowerings
from ._replay import settings_of


def ledger_of(
    file: str | Path,
    *,
    thresholds: Mapping[str, float | str] | None = None,
    tare: Sequence[float | str] | None = None,
    lines: float | None = None,
    drum_radius: float | str | None = None,
    efficiency: float | None = None,
    block_mass: float | str | None = None,
    brake: str | None = None,
    auxiliary: float | str | Mapping[str, float] | None = None,
    trip_pause: float | str = 3600.0,
    scene: Scene | None = None,
    offset: float | str | None = None,
    progress: Callable[..., object] = lambda *_: None,
    **reading: Any,
) -> Ledger:
    """Read a recording, find its lowerings and book their work: `simbrake.rig.read`,
    `lowerings` and `ledger` in one, with all errors of their arguments in one report.

    Numbers are in SI, or texts with their unit.

    - `thresholds`: name → number, of `simbrake.rig.lowerings` (`simbrake.rig.THRESHOLDS`
      has names and units); `tare`: lowest and highest hook load without a string (N)
    - `scene`: what its tackle and drum say stands for arguments that are not given
    - `progress`: called with what is being done, and MB read of how many
    - others: those of `simbrake.rig.read` and `ledger`

    Raises `InputError` with all arguments that cannot be, and what the file lacks.

    Example:
        >>> import pathlib, tempfile
        >>> t = np.arange(0.0, 120.0, 2.0)
        >>> rows = [f"{a},{b},500\\n" for a, b in zip(t, 30.0 - np.clip(t - 40.0, 0.0, 20.0))]
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     file = pathlib.Path(folder, "rig.csv")
        ...     _ = file.write_text("Time,BPOS,HKLD\\ns,m,kN\\n" + "".join(rows))
        ...     book = sb.rig.ledger_of(file, lines=8, drum_radius="40 cm", thresholds={"pause": "20 s"})
        >>> book.totals["hook_work"] / 1e6
        10.0
    """
    reader = NumberReader()
    faults = Issues()

    def in_si(name: str, given: Any, unit: str) -> Any:
        if not isinstance(given, str):
            return given
        number = reader.number(given, Quantity(unit, "a number"), name, unit)
        return None if number is BAD else number

    settings: dict[str, Any] = {
        "lines": lines,
        "drum_radius": drum_radius,
        "block_mass": block_mass,
        "trip_pause": trip_pause,
    }
    settings = {
        name: in_si(name, settings[name], unit) for name, unit in POSITIVE.items()
    }
    settings |= {"efficiency": efficiency, "brake": brake}
    settings["auxiliary"] = in_si("auxiliary", auxiliary, "1")
    limits: dict[str, Any] = {}
    for name, given in (thresholds or {}).items():
        if name in THRESHOLDS:
            limits[name] = in_si(name, given, THRESHOLDS[name])
        else:
            hint = f"there are: {', '.join(THRESHOLDS)}"
            faults.add(f"threshold {name}", "unknown threshold", hint)
    if tare is not None and len(tare) != 2:
        faults.add("tare", f"{':'.join(map(str, tare))} is not LOW:HIGH", _TARE)
    elif tare is not None:
        ends = tuple(in_si("tare", end, "N") for end in tare)
        limits["tare"] = None if None in ends else ends
    limits = {name: x for name, x in limits.items() if x is not None}
    shift = in_si("offset", offset, "s")
    wrong = Issues([*faults, *reader.faults])
    wrong += [*faults_of_settings(**settings), *faults_of_thresholds(limits)]

    def megabytes(done: int, of: int) -> None:
        progress("MB read", done / 1e6, of / 1e6)

    log = wrong.attempt(read, file, offset=shift, progress=megabytes, **reading)
    if log is None or wrong:
        raise InputError(wrong)
    progress("lowerings")
    known = {} if scene is None else settings_of(scene, log)
    settings |= {name: x for name, x in known.items() if settings[name] is None}
    return ledger(lowerings(log, **limits), **settings)


_TARE = 'lowest and highest load without a string, as "290 kN:310 kN"'
