"""Figures of layouts of linings."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, MultipleLocator

from ..._base._arguments import explained
from ..._base._faults import Issues
from ..._base._numbers import scale
from ...brakes.design import Brake, Lining
from ...parts.scene import Scene, band_brake
from ...plot.drawing import (
    BLUE,
    CYCLE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    drawn_in,
    finish,
    ink,
    sheet,
    styled,
)
from ...plot.wheels import Ends, lining_edges, side_by_side
from ._equal_layout import (
    InfeasibleLayout,
    Layout,
    LayoutDesign,
    LayoutRow,
    chord_equal_load_angles,
)

_STYLES = [
    (BLUE, "o"),
    (VERMILLION, "s"),
    (GREEN, "D"),
    (ORANGE, "^"),
    (PURPLE, "v"),
    (SKY, "P"),
    (GREY, "X"),
]


@explained
@styled
def angles(given: Any, *, uniform: bool = True, ax: Axes | None = None) -> Axes:
    """Central angles `β_i` (°) of linings where they lie on the wrap, from the slack to
    the tight end.

    One or several layouts, each lining as wide as it is, with a mark in its middle.

    How `β_i` depend on a chosen `β_k` (Z, Fig. 4) is drawn by `chord_angles`.

    - `given`: angles (n,) in rad, a `Layout`, `LayoutRow`, `Lining`, `Brake` or
      `Scene`, or a mapping from names to these; of a `LayoutDesign` all rows. Brakes
      and scenes count the gaps of their band
    - `uniform`: also draws the uniform pitch with the same number of linings and wrap
      as the first layout

    Raises `InputError` for values that are no layout, with every error.

    Example:
        >>> axes = sb.layouts.figures.angles({"equal loads": sb.layouts.equal_load_angles(0.3, 10, 4.7)})
        >>> print(axes.get_xlabel())
        position on the wrap from the slack end $\\Sigma\\beta$, °
    """
    named = _named(given)
    faults = Issues()
    edges = {}
    for name, layout in named.items():
        try:
            edges[name] = _edges(layout)
        except ValueError as error:
            faults.add(
                f"given[{name!r}]",
                str(error),
                "angles in rad from the slack to the tight end",
            )
    if not named:
        faults.add("given", "is empty", "give a layout, or several by name")
    faults.report()
    first = next(iter(edges.values()))
    beta = first[:, 1] - first[:, 0]
    if uniform and np.ptp(beta) > 1e-9 * beta.max():
        edges["uniform pitch"] = side_by_side(np.full(len(beta), beta.mean()))
    axes = drawn_in(ax, 9.0, 5.0)
    axes.set_title("angles of the linings along the band")
    for i, (name, places) in enumerate(edges.items()):
        colour, marker = _STYLES[i % len(_STYLES)]
        along = np.degrees(places)
        beta = np.degrees(places[:, 1] - places[:, 0])
        gaps = " with gaps" if np.any(places[1:, 0] - places[:-1, 1] > 1e-9) else ""
        label = (
            f"{name}: {len(beta)} linings, $\\Sigma\\beta$ = {beta.sum():.4g}°, on "
            f"{along[-1, 1]:.4g}°{gaps}"
        )
        # a step for each lining; gaps interrupt it
        blank = np.full(len(beta), np.nan)
        x = np.column_stack([along, blank])
        y = np.column_stack([beta, beta, blank])
        axes.plot(
            x.ravel(),
            y.ravel(),
            color=colour,
            lw=2.0,
            ls="--" if name == "uniform pitch" else "-",
        )
        axes.plot(
            along.mean(axis=1),
            beta,
            color=colour,
            marker=marker,
            ms=5,
            ls=":",
            lw=0.8,
            label=label,
        )
    axes.set(
        xlabel=r"position on the wrap from the slack end $\Sigma\beta$, °",
        ylabel=r"central angle of a lining $\beta_i$, °",
    )
    axes.xaxis.set_major_locator(MultipleLocator(30))
    axes.margins(x=0.01)
    axes.set_ylim(bottom=0)
    finish([axes])
    return axes


def _named(designs: Any) -> dict[str, Any]:
    if isinstance(designs, Mapping):
        return {str(name): layout for name, layout in designs.items()}
    rows = designs.rows if isinstance(designs, LayoutDesign) else designs
    if (
        not isinstance(rows, Sequence)
        or not rows
        or not all(isinstance(row, LayoutRow) for row in rows)
    ):
        rows = [designs]
    return {getattr(row, "name", "layout"): row for row in rows}


def _edges(layout: Any) -> Ends:
    """Angles (rad) at which each lining begins and ends."""
    if isinstance(layout, Scene | Brake):
        return lining_edges(band_brake(layout) if isinstance(layout, Scene) else layout)
    angle = layout.angle if isinstance(layout, Layout | LayoutRow | Lining) else layout
    try:
        beta = np.asarray(angle, np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{type(layout).__name__} is no layout") from error
    if (
        beta.ndim != 1
        or beta.size == 0
        or not np.all(np.isfinite(beta))
        or np.any(beta <= 0)
    ):
        raise ValueError("angles must be a list of positive numbers")
    if np.sum(beta) > 4 * np.pi:
        raise ValueError(
            f"the angles add up to {np.sum(beta):.4g} rad, more than two turns: are "
            "they in degrees?"
        )
    return side_by_side(beta)


@explained
@styled
def layouts(rows: Sequence[LayoutRow], *, figure: Figure | None = None) -> Figure:
    """Layouts of linings beside each other: angles from the slack to the tight end,
    their difference from the last layout, and each target of every lining.

    Example:
        >>> figure = sb.layouts.figures.layouts(sb.equal_layout(scene, "friction_work").rows)
        >>> print(figure.axes[0].get_ylabel())
        angle $\\beta$, °
    """
    tops = {name: float(np.max(values)) for name, values in rows[0].values.items()}
    scales = {
        name: scale(rows[0].units[name], top, absolute=True)
        for name, top in tops.items()
    }
    figure = sheet(figure, 11.5, 3.4, rows=2 + len(scales))
    panels = figure.subplots(2 + len(scales), 1, squeeze=False, sharex=True)[:, 0]
    linings = np.arange(1, len(rows[0].angle) + 1)
    width = 0.8 / len(rows)
    for k, row in enumerate(rows):
        panels[0].plot(linings, np.degrees(row.angle), marker="o", ms=4, label=row.name)
        if row.non_uniformity < 1.5:  # others are far away
            # less is rounding
            apart = np.round(np.degrees(row.angle - rows[-1].angle), 9)
            panels[1].plot(
                linings, apart, marker="o", ms=4, color=CYCLE[k % len(CYCLE)]
            )
        for panel, (name, (factor, offset, _)) in zip(
            panels[2:], scales.items(), strict=True
        ):
            values = row.values[name]
            uneven = np.max(values) / np.min(values)
            label = f"{row.name}: maximum over minimum {uneven:.4g}"
            shown = factor * values + offset
            panel.bar(
                linings + (k - (len(rows) - 1) / 2) * width, shown, width, label=label
            )
    panels[0].set_ylabel(r"angle $\beta$, °")
    panels[1].set_ylabel(f"$\\beta$ less that of\n“{rows[-1].name}”, °")
    for panel, (name, (_, _, unit)) in zip(panels[2:], scales.items(), strict=True):
        panel.set_ylabel(f"{name.replace('_', ' ')}, {unit}".rstrip(", "))
    panels[-1].set_xlabel("lining, from the slack to the tight end")
    panels[-1].xaxis.set_major_locator(MaxNLocator(integer=True))
    finish([panels[0], *panels[2:]])
    panels[1].grid(alpha=0.3)
    return figure


@explained
@styled
def chord_angles_of(k: int, f: float, *, ax: Axes | None = None) -> Axes:
    """Chord angles `β_1…β_{k−2}` (°) of equal loads over `β_k = β_{k−1}` as far as they
    exist, for a friction `f` (Z, Fig. 4).

    Example:
        >>> axes = sb.layouts.figures.chord_angles_of(7, 0.3)
        >>> axes.get_title()
        '$f$ = 0.3, possible up to 27.3°'
    """
    rows = []
    axes = drawn_in(ax, 4.2, 5.4)
    try:
        for beta in np.radians(np.linspace(1.0, 90.0, 900)):
            rows.append(np.degrees(chord_equal_load_angles(f, k, beta, beta)))
    except InfeasibleLayout:
        axes.set_title(f"$f$ = {f:g}, possible up to {rows[-1][-1]:.1f}°")
    angles = np.asarray(rows)
    last = angles[:, -1]
    for j in range(k - 2):
        axes.plot(last, angles[:, j], label=rf"$\beta_{j + 1}$")
    equal = rf"$\beta_{k - 1} = \beta_{k}$"
    axes.plot(last, last, color=ink(), ls=":", label=equal)
    axes.set(xlabel=rf"$\beta_{k}$, °", ylabel="chord angles of equal loads, °")
    finish([axes])
    return axes


@explained
@styled
def chord_angles(
    k: int, frictions: Sequence[float], *, figure: Figure | None = None
) -> Figure:
    """`chord_angles_of` several frictions side by side.

    Example:
        >>> figure = sb.layouts.figures.chord_angles(7, (0.1, 0.3))
        >>> figure.axes[1].get_title()
        '$f$ = 0.3, possible up to 27.3°'
    """
    figure = sheet(figure, 4.2 * len(frictions), 5.4)
    row = figure.subplots(1, len(frictions), squeeze=False)[0]
    for ax, f in zip(row, frictions, strict=True):
        chord_angles_of(k, f, ax=ax)
    for ax in row[1:]:
        ax.set_ylabel("")
    return figure
