"""The body of `simbrake calibrate`: files in, a fit out."""

import csv
import json
import shlex
from pathlib import Path
from typing import Any

import numpy as np

from .._base._faults import Fault, InputError, whole_folder
from .._parts._scene import Scene
from ..studies._calibration import Calibration, calibrate
from ..studies._measured import Measured, read_measured
from ._cli_options import say


def parse_bounds(texts: list[str]) -> dict[str, tuple[float, float]]:
    """`PATH=LOW:HIGH` as bounds by path. Raises `InputError` with every text that is none."""
    bounds: dict[str, tuple[float, float]] = {}
    faults = []
    for text in texts:
        path, _, ends = text.partition("=")
        try:
            low, high = (float(end) for end in ends.split(":"))
        except ValueError:
            faults.append(Fault(text, "is not of the form PATH=LOW:HIGH", "as in brake.pulley.inertia=500:2000"))
            continue
        if path.strip() in bounds:
            faults.append(Fault(path.strip(), "is fitted twice", "one --fit each"))
        bounds[path.strip()] = (low, high)
    if not texts:
        faults.append(Fault("--fit", "no parameter is to be fitted", "--fit brake.pulley.inertia=500:2000"))
    if faults:
        raise InputError(faults)
    return bounds


def parse_numbers(texts: list[str], option: str) -> dict[str, float]:
    """`NAME=VALUE` as numbers by name. Raises `InputError` with every text that is none."""
    found: dict[str, float] = {}
    faults = []
    for text in texts:
        name, _, value = text.rpartition("=")
        try:
            found[name.strip()] = float(value)
        except ValueError:
            name = ""
        if not name.strip():
            faults.append(Fault(f"{option} {text}", "is not of the form NAME=VALUE", "numbers are in SI units"))
    if faults:
        raise InputError(faults)
    return found


def read_all(
    files: list[Path], sigma: list[str], columns: list[str], fit: list[str], start: list[str]
) -> tuple[Measured, dict[str, tuple[float, float]], dict[str, float]]:
    """Data, bounds and start values of the command line. Raises one `InputError` for all of them."""
    faults: list[Fault] = []

    def attempt(do: Any, *arguments: Any, **named: Any) -> Any:
        try:
            return do(*arguments, **named)
        except InputError as error:
            faults.extend(error.faults)
            return {}

    spreads = attempt(parse_numbers, sigma, "--sigma")
    data = attempt(read_measured, *files, sigma=spreads, columns=columns or None)
    found = (data, attempt(parse_bounds, fit), attempt(parse_numbers, start, "--start"))
    if faults:
        raise InputError(faults)
    return found


def write_calibration(fit: Calibration, folder: Path) -> list[Path]:
    """Writes `calibration.json`, `calibration.txt`, `calibration.png` and `residuals.csv`."""
    from .. import plot  # matplotlib is loaded by those who want a picture

    with whole_folder(folder) as (scratch, written):
        (scratch / "calibration.json").write_text(json.dumps(fit.as_dict(), indent=2, allow_nan=False) + "\n", "utf-8")
        (scratch / "calibration.txt").write_text(str(fit) + "\n", "utf-8")
        with open(scratch / "residuals.csv", "w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["name", "unit", "t [s]", "measured", "sigma", "before", "fitted", "residual over sigma"])
            for part in fit.residuals:
                times = [""] * part.measured.size if part.t is None else [f"{t:.12g}" for t in part.t]
                numbers = np.stack([part.measured, part.sigma, part.before, part.model, part.scaled], axis=1)
                for t, row in zip(times, numbers, strict=True):
                    writer.writerow([part.name, part.unit, t, *(f"{x:.12g}" for x in row)])
        plot.calibration(fit).savefig(scratch / "calibration.png", dpi=130)
    return written


def run(
    scene: Scene,
    command: list[str],
    data: Measured,
    bounds: dict[str, tuple[float, float]],
    *,
    json_: bool,
    out: Path | None,
    **options: Any,
) -> int:
    """Fits, prints, writes; the exit code: 0 fitted, 1 not converged. `command` runs the scene as it was given."""
    fit = calibrate(scene, bounds, data, **options)
    if json_:
        say(json.dumps(fit.as_dict(), indent=2, allow_nan=False))
    else:
        say(fit)
        settings = [part for path, value in fit.values.items() for part in ("--set", f"{path}={value:.12g}")]
        say(f"run it   {shlex.join([*command, *settings])}")
    if out is not None:
        written = write_calibration(fit, out)
        if not json_:
            say("written  " + ", ".join(str(path) for path in written))
    return 0 if fit.converged else 1
