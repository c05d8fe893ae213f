"""Work and precision: error against time of simbrake and other tools."""

import json
import math
from os import PathLike
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from .._base._faults import Fault, InputError
from ._plot_shared import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION

#: colour of each family of tools; its methods differ by their marks
_COLOURS = {
    "simbrake": "black",
    "SciPy": BLUE,
    "sundae": ORANGE,
    "CasADi": GREEN,
    "CyRK": VERMILLION,
    "PathSim": PURPLE,
    "diffrax": SKY,
}
_MARKERS = "osD^v*"


def work_precision(data: dict[str, Any] | str | PathLike[str], *, figure: Figure | None = None) -> Figure:
    """Largest error against the time of one warm run, both logarithmic: a panel for each scene, a line for each method.

    - `data`: what `benchmarks/speed_against_error.py --json` writes, as a `dict` or the path of the file

    Raises `InputError` for a file that cannot be read or is no such benchmark.
    """
    found = _read(data)
    scenes = list(found["scenes"].values())
    if figure is None:
        figure = Figure(figsize=(9.5, 5.6 * len(scenes) + 0.6), layout="constrained")
    axes = figure.subplots(len(scenes), 1, squeeze=False)
    for ax, scene in zip(axes[:, 0], scenes, strict=True):
        _panel(ax, scene)
    machine = found.get("machine", {})
    version = machine.get("versions", {}).get("simbrake", "")
    place = f"{machine.get('cpu', 'machine not told')}, {machine.get('cores', '?')} cores; simbrake {version}"
    figure.suptitle(f"Work and precision; left and low is better\n{place}", fontsize=11)
    return figure


def _panel(ax: Any, scene: dict[str, Any]) -> None:
    curves: dict[str, list[dict[str, Any]]] = {}
    for row in scene["rows"]:
        curves.setdefault(row["method"], []).append(row)
    seen: dict[str, int] = {}
    for name, points in curves.items():
        family = name.split()[0]
        marker = _MARKERS[seen.setdefault(family, 0) % len(_MARKERS)]
        seen[family] += 1
        good = [p for p in points if math.isfinite(p["error"])]
        ax.loglog(
            [1e3 * p["seconds"] for p in good],
            [max(p["error"], 1e-16) for p in good],  # an error of 0 stands at the rounding of the reference
            marker=marker,
            color=_COLOURS.get(family, "0.5"),
            linewidth=2.2 if family == "simbrake" else 1.0,
            markersize=4,
            label=name,
        )
    ax.axhspan(1e-16, max(scene["reference"]["uncertainty"], 1.1e-16), color="0.9", label="reference uncertain")
    ax.set_title(f"({scene['name']}) {scene['title']}", loc="left")
    ax.set_xlabel("time of one warm run, ms")
    ax.set_ylabel("largest error: event times relative,\nfinal state in its typical sizes")
    ax.grid(alpha=0.3)
    ax.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), fontsize=8, frameon=False)


def _read(data: Any) -> dict[str, Any]:
    hint = "give what benchmarks/speed_against_error.py --json wrote"
    if isinstance(data, str | PathLike):
        try:
            data = json.loads(Path(data).read_text("utf-8"))
        except OSError as error:
            raise InputError([Fault("data", f"cannot be read: {error}", hint)]) from error
        except ValueError as error:
            raise InputError([Fault("data", f"is no JSON: {error}", hint)]) from error
    scenes = data.get("scenes") if isinstance(data, dict) else None
    if not isinstance(scenes, dict) or not scenes:
        raise InputError([Fault("data.scenes", "is missing or empty", hint)])
    faults = []
    for name, scene in scenes.items():
        needed = ("name", "title", "reference", "rows")
        missing = [key for key in needed if not isinstance(scene, dict) or key not in scene]
        if not missing:
            keys = ("method", "seconds", "error")
            missing = [f"rows.{key}" for key in keys if any(key not in row for row in scene["rows"])]
            missing += [] if "uncertainty" in scene["reference"] else ["reference.uncertainty"]
        faults += [Fault(f"data.scenes.{name}.{key}", "is missing", hint) for key in missing]
    if faults:
        raise InputError(faults)
    return data
