"""Figures of materials side by side, and of work and precision."""

import json
import math
from collections.abc import Callable
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from .._base._faults import Fault, InputError
from ..formulas._material_table import MaterialComparison, MaterialRow
from ..formulas._materials import LiningMaterial, RimMaterial
from ._shared import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION, ZERO, styled

# --- materials side by side -------------------------------------------------------------------------------------------


class _Panel(NamedTuple):
    """One quantity: its title, how a number of a row is shown, and the limit of a pair of materials, if any."""

    name: str
    title: str
    shown: Callable[[float], float] = lambda x: x
    limit: Callable[[RimMaterial, LiningMaterial], float] | None = None
    each_level: bool = True


def _permissible(rim: RimMaterial, lining: LiningMaterial) -> float:
    return min(rim.permissible, lining.permissible) - ZERO


_PANELS = (
    _Panel("surface", "maximum surface\ntemperature, °C", lambda T: T - ZERO, _permissible),
    _Panel("stress_ratio", "thermal stress\nover allowable (–)", limit=lambda rim, lining: 1.0),
    _Panel("wear", "wear of the linings,\nµm", lambda h: 1e6 * h),
    _Panel("mass", "mass of the rim, kg\n(all levels)", each_level=False),
)


@styled
def materials(comparison: MaterialComparison, *, figure: Figure | None = None) -> Figure:
    """Rim materials side by side, one row of panels for each lining, one bar for each energy level, weak to strong.

    Bars are the estimates, diamonds the simulated numbers, red: permissible value; hatched: limit exceeded. The
    mass is the same at all levels. The wear's axis is logarithmic where it spreads over more than two decades.

    Example:
        >>> figure = sb.plot.materials(sb.compare_materials(scene, data=rims, run=False))
        >>> figure.axes[0].get_title(loc="left")
        'lining FK-24A'
    """
    linings, rims, levels = comparison.linings, comparison.rims, comparison.levels
    if figure is None:
        height = 1.3 + len(linings) * (0.9 + len(rims) * (0.28 + 0.14 * len(levels)))
        figure = Figure(figsize=(14.0, height), layout="constrained")
    axes = figure.subplots(len(linings), len(_PANELS), squeeze=False, sharex="col", width_ratios=[1.2, 1.2, 1.0, 0.8])
    for row, lining in zip(axes, linings, strict=True):
        for axis, panel in zip(row, _PANELS, strict=True):
            _draw(axis, panel, comparison, lining)
        row[0].set_yticks(range(len(rims)), [rim.name.replace("_", " ") for rim in rims])
        row[0].set_title(f"lining {lining.name}", loc="left", fontweight="bold")
        for axis in row[1:]:
            axis.set_yticks(range(len(rims)), [""] * len(rims))
    for axis, panel in zip(axes[-1], _PANELS, strict=True):
        axis.set_xlabel(panel.title)
    wear = [x for row in comparison for x in row["wear"] if x is not None and x > 0]
    if wear and max(wear) > 100 * min(wear):
        for axis in axes[:, 2]:
            axis.set(xscale="log", xlim=(10 ** np.floor(np.log10(1e6 * min(wear))), None))
    for axis in axes.flat:
        axis.tick_params(labelbottom=True)
    figure.legend(handles=_legend(comparison), loc="outside upper center", ncols=4, frameon=False)
    return figure


def _shade(level: int, count: int) -> tuple[float, float, float]:
    """Blue, the paler the weaker the level."""
    pale = 0.75 * (1 - (level + 1) / count)
    red, green, blue = (pale + (1 - pale) * part for part in to_rgb(BLUE))
    return red, green, blue


def _draw(axis: Axes, panel: _Panel, comparison: MaterialComparison, lining: LiningMaterial) -> None:
    levels = range(len(comparison.levels)) if panel.each_level else [len(comparison.levels) - 1]
    height = 0.8 / len(levels)
    for i, rim in enumerate(comparison.rims):
        for j, level in enumerate(levels):
            row: MaterialRow = comparison.row(rim.name, lining.name, level)
            y = i - 0.4 + (j + 0.5) * height
            colour = _shade(level, len(comparison.levels)) if panel.each_level else "0.6"
            hatch = "////" if panel.each_level and not row.admissible else None
            number = row[panel.name]
            axis.barh(y, panel.shown(number.value), 0.9 * height, color=colour, hatch=hatch, edgecolor="white", lw=0)
            if number.simulated is not None:
                axis.plot(panel.shown(number.simulated), y, "D", color="black", ms=4.5, mec="white", mew=0.6, zorder=4)
        if panel.limit is not None:
            axis.plot([panel.limit(rim, lining)] * 2, [i - 0.45, i + 0.45], color=VERMILLION, lw=2.2, zorder=3)
    axis.set_ylim(len(comparison.rims) - 0.4, -0.6)
    axis.grid(axis="x", alpha=0.3)
    axis.set_axisbelow(True)


def _legend(comparison: MaterialComparison) -> list[Any]:
    count = len(comparison.levels)
    found: list[Any] = [
        Patch(color=_shade(i, count), label=f"{level.words}  ({level.label})")
        for i, level in enumerate(comparison.levels)
    ]
    if comparison.simulated:
        found.append(Line2D([], [], marker="D", ls="", color="black", mec="white", label="simulated (bars: estimates)"))
    found.append(Line2D([], [], color=VERMILLION, lw=2.2, label="permissible, rim or lining"))
    if any(not row.admissible for row in comparison):
        found.append(Patch(facecolor="0.6", edgecolor="white", hatch="////", label="limit exceeded"))
    return found


# --- work and precision -----------------------------------------------------------------------------------------------

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


@styled
def work_precision(data: dict[str, Any] | str | PathLike[str], *, figure: Figure | None = None) -> Figure:
    """Largest error against the time of one warm run, both logarithmic: a panel for each scene, a line for each method.

    - `data`: what `benchmarks/speed_against_error.py --json` writes, as a `dict` or the path of the file

    Raises `InputError` for a file that cannot be read or is not such a benchmark.

    Example:
        >>> rows = [{"method": "simbrake Dopri8", "seconds": 1e-4, "error": 1e-9}]
        >>> one = {"name": "a", "title": "stop", "reference": {"uncertainty": 1e-15}, "rows": rows}
        >>> figure = sb.plot.work_precision({"scenes": {"a": one}})
        >>> figure.axes[0].get_xlabel()
        'time of one warm run, ms'
    """
    found = _benchmark(data)
    scenes = list(found["scenes"].values())
    if figure is None:
        figure = Figure(figsize=(11.0, 6.5 * len(scenes) + 0.6), layout="constrained")
    axes = figure.subplots(len(scenes), 1, squeeze=False)
    for ax, scene in zip(axes[:, 0], scenes, strict=True):
        _panel(ax, scene)
    machine = found.get("machine", {})
    version = machine.get("versions", {}).get("simbrake", "")
    place = f"{machine.get('cpu', 'machine unknown')}, {machine.get('cores', '?')} cores; simbrake {version}"
    figure.suptitle(f"work and precision; left and low is better\n{place}")
    return figure


def _panel(ax: Axes, scene: dict[str, Any]) -> None:
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
            [max(p["error"], 1e-16) for p in good],  # an error of 0 is drawn at the rounding of the reference
            marker=marker,
            color=_COLOURS.get(family, "0.5"),
            linewidth=2.2 if family == "simbrake" else 1.0,
            markersize=4,
            label=name,
        )
    ax.axhspan(1e-16, max(scene["reference"]["uncertainty"], 1.1e-16), color="0.9", label="reference uncertain")
    ax.set_title(f"({scene['name']}) {scene['title']}", loc="left")
    ax.set_xlabel("time of one warm run, ms")
    ax.set_ylabel("largest error (–): event times relative,\nfinal state in its typical sizes")
    ax.grid(alpha=0.3)
    ax.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False, labelspacing=0.15)


def _benchmark(data: dict[str, Any] | str | PathLike[str]) -> dict[str, Any]:
    """The numbers of a benchmark, read and checked."""
    hint = "give what benchmarks/speed_against_error.py --json wrote"
    if isinstance(data, str | PathLike):
        try:
            data = json.loads(Path(data).read_text("utf-8"))
        except OSError as error:
            raise InputError([Fault("data", f"cannot be read: {error}", hint)]) from error
        except ValueError as error:
            raise InputError([Fault("data", f"is not JSON: {error}", hint)]) from error
    scenes = data.get("scenes") if isinstance(data, dict) else None
    if not isinstance(data, dict) or not isinstance(scenes, dict) or not scenes:
        raise InputError([Fault("data.scenes", "is missing or empty", hint)])
    missing = [f"{name}.{key}" for name, scene in scenes.items() for key in _missing(scene)]
    if missing:
        raise InputError([Fault(f"data.scenes.{key}", "is missing", hint) for key in missing])
    return data


def _missing(scene: Any) -> list[str]:
    needed = ("name", "title", "reference", "rows")
    if missing := [key for key in needed if not isinstance(scene, dict) or key not in scene]:
        return missing
    missing = [f"rows.{key}" for key in ("method", "seconds", "error") if any(key not in row for row in scene["rows"])]
    return missing + ([] if "uncertainty" in scene["reference"] else ["reference.uncertainty"])
