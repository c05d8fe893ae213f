"""Figures of materials."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ..._base._arguments import explained
from ..._base._numbers import ZERO
from ...plot.drawing import BLUE, VERMILLION, ink, sheet, styled
from ._materials import LiningMaterial, RimMaterial
from .material_table import MaterialComparison, MaterialRow


class _Panel(NamedTuple):
    """One quantity: its title, how a number of a row is shown, and the limit of a pair
    of materials, if any."""

    name: str
    title: str
    shown: Callable[[float], float] = lambda x: x
    limit: Callable[[RimMaterial, LiningMaterial], float] | None = None
    each_level: bool = True


_PANELS = (
    _Panel(
        "surface",
        "maximum surface\ntemperature, °C",
        lambda T: T - ZERO,
        lambda *pair: min(part.permissible for part in pair) - ZERO,
    ),
    _Panel(
        "stress_ratio",
        "thermal stress\nover allowable (–)",
        limit=lambda rim, lining: 1.0,
    ),
    _Panel("wear", "wear of the linings,\nµm", lambda h: 1e6 * h),
    _Panel("mass", "mass of the rim, kg\n(all levels)", each_level=False),
)


@explained
@styled
def materials(
    comparison: MaterialComparison, *, figure: Figure | None = None
) -> Figure:
    """Rim materials side by side, one row of panels for each lining, one bar for each
    energy level, weak to strong.

    Bars are the estimates, diamonds the simulated numbers, red: permissible value;
    hatched: limit exceeded. The mass is the same at all levels. The wear's axis is
    logarithmic where it spreads over more than two decades.

    Example:
        >>> figure = sb.formulas.figures.materials(sb.compare_materials(scene, data=rims, run=False))
        >>> figure.axes[0].get_title(loc="left")
        'lining FK-24A'
    """
    linings = comparison.linings
    rims = comparison.rims
    height = 0.9 + len(rims) * (0.28 + 0.14 * len(comparison.levels))
    figure = sheet(figure, 14.0, height, rows=len(linings), room=1.3)
    axes = figure.subplots(
        len(linings),
        len(_PANELS),
        squeeze=False,
        sharex="col",
        width_ratios=[1.2, 1.2, 1.0, 0.8],
    )
    for row, lining in zip(axes, linings, strict=True):
        for axis, panel in zip(row, _PANELS, strict=True):
            _draw(axis, panel, comparison, lining)
        row[0].set_yticks(
            range(len(rims)), [rim.name.replace("_", " ") for rim in rims]
        )
        row[0].set_title(f"lining {lining.name}", loc="left", fontweight="bold")
        for axis in row[1:]:
            axis.set_yticks(range(len(rims)), [""] * len(rims))
    for axis, panel in zip(axes[-1], _PANELS, strict=True):
        axis.set_xlabel(panel.title)
    worn = [row["wear"] for row in comparison]
    wear = [
        x
        for each in worn
        for x in (each.value, each.simulated)
        if x is not None and x > 0
    ]
    if wear and max(wear) > 100 * min(wear):
        for axis in axes[:, 2]:
            axis.set(
                xscale="log", xlim=(10 ** np.floor(np.log10(1e6 * min(wear))), None)
            )
    for axis in axes.flat:
        axis.tick_params(labelbottom=True)
    figure.legend(
        handles=_legend(comparison), loc="outside upper center", ncols=4, frameon=False
    )
    return figure


def _shade(level: int, count: int) -> tuple[float, float, float]:
    """Blue, the paler the weaker the level."""
    pale = 0.75 * (1 - (level + 1) / count)
    red, green, blue = (pale + (1 - pale) * part for part in to_rgb(BLUE))
    return red, green, blue


def _draw(
    axis: Axes, panel: _Panel, comparison: MaterialComparison, lining: LiningMaterial
) -> None:
    levels = (
        range(len(comparison.levels))
        if panel.each_level
        else [len(comparison.levels) - 1]
    )
    height = 0.8 / len(levels)
    for i, rim in enumerate(comparison.rims):
        for j, level in enumerate(levels):
            row: MaterialRow = comparison.row(rim.name, lining.name, level)
            y = i - 0.4 + (j + 0.5) * height
            colour = (
                _shade(level, len(comparison.levels)) if panel.each_level else "0.6"
            )
            hatch = "////" if panel.each_level and not row.admissible else None
            number = row[panel.name]
            axis.barh(
                y,
                panel.shown(number.value),
                0.9 * height,
                color=colour,
                hatch=hatch,
                edgecolor="white",
                lw=0,
            )
            if number.simulated is not None:
                axis.plot(
                    panel.shown(number.simulated),
                    y,
                    "D",
                    color=ink(),
                    ms=4.5,
                    mec="white",
                    mew=0.6,
                    zorder=4,
                )
        if panel.limit is not None:
            axis.plot(
                [panel.limit(rim, lining)] * 2,
                [i - 0.45, i + 0.45],
                color=VERMILLION,
                lw=2.2,
                zorder=3,
            )
    axis.set_ylim(len(comparison.rims) - 0.4, -0.6)
    axis.grid(axis="x", alpha=0.3)
    axis.set_axisbelow(True)


def _legend(comparison: MaterialComparison) -> list[Any]:
    count = len(comparison.levels)
    handles: list[Any] = [
        Patch(color=_shade(i, count), label=f"{level.words}  ({level.title})")
        for i, level in enumerate(comparison.levels)
    ]
    if comparison.simulated:
        label = "simulated (bars: estimates)"
        handles.append(
            Line2D([], [], marker="D", ls="", color=ink(), mec="white", label=label)
        )
    handles.append(
        Line2D([], [], color=VERMILLION, lw=2.2, label="permissible, rim or lining")
    )
    if any(not row.admissible for row in comparison):
        handles.append(
            Patch(
                facecolor="0.6", edgecolor="white", hatch="////", label="limit exceeded"
            )
        )
    return handles
