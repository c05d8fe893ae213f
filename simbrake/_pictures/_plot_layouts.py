"""Pictures of layouts: angles of linings along the wrap, layouts beside each other, chord angles of equal loads."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, MultipleLocator

from .._base._faults import Fault, InputError
from .._parts._design import Brake, Lining
from .._parts._layout import InfeasibleLayout, Layout, chord_equal_load_angles
from .._parts._scene import Scene, band_brake
from ..layouts._equal_layout import LayoutDesign, LayoutRow
from ._plot_shared import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION, finish
from ._plot_wheel import lining_edges

_STYLES = [(BLUE, "o"), (VERMILLION, "s"), (GREEN, "D"), (ORANGE, "^"), (PURPLE, "v"), (SKY, "P"), ("black", "X")]


def angles(given: Any, *, uniform: bool = True, figure: Figure | None = None) -> Figure:
    """Central angles `β_i` (°) of linings where they lie on the wrap, from the slack to the tight end.

    One or several layouts, each lining as wide as it is, with a mark in its middle.

    How `β_i` depend on a chosen `β_k` (Z, Fig. 4) is drawn by `chord_angles`.

    - `given`: angles (n,) in rad, a `Layout`, `LayoutRow`, `Lining`, `Brake` or `Scene`, or a mapping from names to
      these; of a `LayoutDesign` all rows. Brakes and scenes count the gaps of their band
    - `uniform`: also draws the uniform pitch with the same number of linings and wrap as the first layout

    Raises `InputError` for what is no layout, with every fault.
    """
    named = _named(given)
    found, edges = [], {}
    for name, one in named.items():
        try:
            edges[name] = _edges(one)
        except ValueError as error:
            found.append(Fault(f"given[{name!r}]", str(error), "angles in rad from the slack to the tight end"))
    if found or not edges:
        raise InputError(found or [Fault("given", "is empty", "give a layout, or several by name")])
    first = next(iter(edges.values()))
    beta = first[:, 1] - first[:, 0]
    if uniform and np.ptp(beta) > 1e-9 * beta.max():
        places = np.linspace(0.0, beta.sum(), len(beta) + 1)
        edges["uniform pitch"] = np.stack([places[:-1], places[1:]], axis=1)
    if figure is None:
        figure = Figure(figsize=(9.0, 5.0), layout="constrained")
    axes = figure.subplots()
    for i, (name, places) in enumerate(edges.items()):
        colour, marker = _STYLES[i % len(_STYLES)]
        span, beta = np.degrees(places), np.degrees(places[:, 1] - places[:, 0])
        gaps = " with gaps" if np.any(places[1:, 0] - places[:-1, 1] > 1e-9) else ""
        label = f"{name}: {len(beta)} linings, Σβ = {beta.sum():.4g}°, on {span[-1, 1]:.4g}°{gaps}"
        # a step for each lining; gaps interrupt it
        x = np.column_stack([span, np.full(len(beta), np.nan)]).ravel()
        y = np.column_stack([beta, beta, np.full(len(beta), np.nan)]).ravel()
        axes.plot(x, y, color=colour, lw=2.0, ls="--" if name == "uniform pitch" else "-")
        axes.plot(span.mean(axis=1), beta, color=colour, marker=marker, ms=5, ls=":", lw=0.8, label=label)
    axes.set_xlabel("position on the wrap from the slack end Σβ, °")
    axes.set_ylabel("central angle of a lining βᵢ, °")
    axes.xaxis.set_major_locator(MultipleLocator(30))
    axes.set_ylim(bottom=0)
    axes.margins(x=0.01)
    finish([axes], "best")
    axes.set_title("angles of the linings along the band", fontsize=11)
    return figure


def _named(given: Any) -> dict[str, Any]:
    if isinstance(given, LayoutDesign):
        return {row.name: row for row in given.rows}
    if isinstance(given, Mapping):
        return {str(name): one for name, one in given.items()}
    if isinstance(given, Sequence) and given and all(isinstance(row, LayoutRow) for row in given):
        return {row.name: row for row in given}
    return {getattr(given, "name", "layout"): given}


def _edges(one: Any) -> Float[np.ndarray, "n 2"]:
    """Angles (rad) at which each lining begins and ends."""
    if isinstance(one, Scene):
        return lining_edges(band_brake(one))
    if isinstance(one, Brake):
        return lining_edges(one)
    angle = one.angle if isinstance(one, Layout | LayoutRow | Lining) else one
    try:
        beta = np.asarray(angle, np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{type(one).__name__} is no layout") from error
    if beta.ndim != 1 or beta.size == 0 or not np.all(np.isfinite(beta)) or np.any(beta <= 0):
        raise ValueError("angles must be a list of positive numbers")
    if np.sum(beta) > 4 * np.pi:
        raise ValueError(f"the angles add up to {np.sum(beta):.4g} rad, more than two turns: are they in degrees?")
    places = np.append(0.0, np.cumsum(beta))
    return np.stack([places[:-1], places[1:]], axis=1)


def layouts(rows: Sequence[LayoutRow], *, figure: Figure | None = None) -> Figure:
    """Layouts of linings beside each other: angles from the slack to the tight end, what they differ from the last
    layout by, and each target of every lining."""
    targets = list(rows[0].values)
    if figure is None:
        figure = Figure(figsize=(11.5, 3.2 * (2 + len(targets))), layout="constrained")
    panels = figure.subplots(2 + len(targets), 1, squeeze=False, sharex=True)[:, 0]
    linings, width = np.arange(1, len(rows[0].angle) + 1), 0.8 / len(rows)
    for k, row in enumerate(rows):
        panels[0].plot(linings, np.degrees(row.angle), marker="o", ms=4, label=row.name)
        if row.non_uniformity < 1.5:  # others are far away
            panels[1].plot(linings, np.degrees(row.angle - rows[-1].angle), marker="o", ms=4, color=f"C{k}")
        for panel, name in zip(panels[2:], targets, strict=True):
            label = f"{row.name}: greatest over least {np.max(row.values[name]) / np.min(row.values[name]):.4g}"
            panel.bar(linings + (k - (len(rows) - 1) / 2) * width, row.values[name], width, label=label)
    panels[0].set_ylabel("angle β, °")
    panels[1].set_ylabel(f"β less that of\n“{rows[-1].name}”, °")
    for panel, name in zip(panels[2:], targets, strict=True):
        panel.set_ylabel(f"{name.replace('_', ' ')}, {rows[0].units[name]}".rstrip(", "))
    panels[-1].set_xlabel("lining, from the slack to the tight end")
    panels[-1].xaxis.set_major_locator(MaxNLocator(integer=True))
    finish([panels[0], *panels[2:]], "best")
    panels[1].grid(alpha=0.3)
    return figure


def chord_angles(k: int, frictions: Sequence[float]) -> Figure:
    """Chord angles `β_1…β_{k−2}` of equal loads over `β_k = β_{k−1}` as far as they exist, by friction (Z, Fig. 4)."""
    figure = Figure(figsize=(3.9 * len(frictions), 4.2), layout="constrained")
    panels = figure.subplots(1, len(frictions), squeeze=False)[0]
    for panel, f in zip(panels, frictions, strict=True):
        found = []
        try:
            for beta in np.radians(np.linspace(1.0, 90.0, 900)):
                found.append(np.degrees(chord_equal_load_angles(f, k, beta, beta)))
        except InfeasibleLayout:
            panel.set_title(f"f = {f:g}, possible up to {found[-1][-1]:.1f}°", fontsize=10)
        angles = np.asarray(found)
        for j in range(k - 2):
            panel.plot(angles[:, -1], angles[:, j], label=f"β{j + 1}")
        panel.plot(angles[:, -1], angles[:, -1], color="k", ls=":", label=f"β{k - 1} = β{k}")
        panel.set_xlabel(f"β{k}, °")
    finish(panels, "upper left")
    figure.supylabel("chord angles of equal loads, °", fontsize=10)
    return figure
