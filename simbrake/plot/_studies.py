"""Pictures of many runs: sensitivities, fits, distributions, layouts, wear over the life."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator, MultipleLocator

from .._base._faults import Fault, InputError
from .._parts._scene import Scene, band_brake
from .._run._measure import Metric, name_of
from .._run._simulate import simulate
from ..brakes._design import Brake, Lining
from ..layouts._equal_layout import InfeasibleLayout, Layout, LayoutDesign, LayoutRow, chord_equal_load_angles
from ..studies._calibration import Calibration
from ..studies._global import MorrisTable, SobolTable
from ..studies._lining_life import LiningLife
from ..studies._measured import pick
from ..studies._sensitivity import SensitivityTable
from ..studies._uncertainty import Uncertainty
from ._pulley import lining_edges
from ._shared import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION, ZERO, dense_grid, finish


def tornado(table: SensitivityTable, *, most: int = 12, figure: Figure | None = None) -> Figure:
    """Bars of what every number does to a metric over its range, the widest on top.

    Without ranges in the table: elasticities.
    """
    ranged = [row for row in table.matters if row.low is not None and row.high is not None]
    rows = (ranged or [row for row in table.matters if np.isfinite(row.elasticity)])[:most]
    width = [max(abs(r.low - table.value), abs(r.high - table.value)) if ranged else abs(r.elasticity) for r in rows]  # pyright: ignore
    rows = [rows[i] for i in np.argsort(width)]
    figure = Figure(figsize=(9.5, 1.6 + 0.38 * len(rows)), layout="constrained") if figure is None else figure
    axes = figure.subplots()
    for y, row in enumerate(rows):
        if ranged:
            for end, colour in ((row.low, "tab:blue"), (row.high, "tab:red")):
                axes.barh(y, end - table.value, left=table.value, color=colour, height=0.7)  # pyright: ignore
        else:
            axes.barh(y, row.elasticity, color="tab:red" if row.elasticity > 0 else "tab:blue", height=0.7)
    units = ["" if row.unit in ("1", "SI") else f" {row.unit}" for row in rows]
    halves = [f" ± {row.half:.3g}" if ranged else "" for row in rows]
    labels = [f"{r.path}\n{r.value:.5g}{half}{u}" for r, half, u in zip(rows, halves, units, strict=True)]
    axes.set_yticks(range(len(rows)), labels, fontsize=8)
    unit = f", {table.unit}" if table.unit else ""
    name = table.metric.replace("_", " ").replace("energy.", "energy: ")
    if ranged:
        axes.axvline(table.value, color="black", lw=0.9)
        ends = [Patch(color="tab:blue", label="number at its low end"), Patch(color="tab:red", label="at its high end")]
        axes.legend(handles=ends, fontsize=8, loc="lower right")
        axes.set_xlabel(f"{name}{unit}")
        axes.set_title(
            f"{name} {table.value:.6g} {table.unit}: each number over its range, the others fixed", fontsize=10
        )
    else:
        axes.axvline(0.0, color="black", lw=0.9)
        axes.set_xlabel(f"elasticity of the {name}: percent for one percent of the number")
    axes.grid(axis="x", alpha=0.3)
    return figure


def calibration(fit: Calibration, *, figure: Figure | None = None) -> Figure:
    """Measured values with their standard deviations and the runs before and after a fit; below, what is left in σ.

    One column of panels for each measured column, and one for single values such as event times.
    """
    columns = [part for part in fit.residuals if part.t is not None]
    singles = [part for part in fit.residuals if part.t is None]
    count = len(columns) + bool(singles)
    if figure is None:
        figure = Figure(figsize=(3.0 + 4.6 * len(columns) + 2.0 * bool(singles), 6.0), layout="constrained")
    widths = [2.5] * len(columns) + [1] * bool(singles)
    axes = figure.subplots(2, count, squeeze=False, sharex="col", height_ratios=[2, 1], width_ratios=widths)
    runs = [(simulate(scene, throw=False), style) for scene, style in ((fit.before, "--"), (fit.scene, "-"))]
    for i, (part, points) in enumerate(zip(columns, fit.data.points, strict=True)):
        shift, times = ZERO if part.unit == "K" else 0.0, points.t
        for (result, style), words in zip(runs, ("before", "fitted"), strict=True):
            t, s = dense_grid(result, float(times.min()), float(times.max()), result.events)
            values = np.asarray(pick(result, s, points.column, points.entry)) - shift
            axes[0, i].plot(t, values, style, color="tab:gray" if words == "before" else "tab:blue", label=words)
        dots = {"fmt": ".", "color": "k", "ms": 4, "elinewidth": 0.8, "zorder": 3}
        axes[0, i].errorbar(times, part.measured - shift, part.sigma, label="measured ± σ", **dots)
        axes[0, i].set_ylabel(f"{part.name}, {'°C' if shift else part.unit}")
        axes[1, i].plot(times, part.scaled, ".", color="tab:blue", ms=4)
        axes[1, i].set_xlabel("time, s")
    if singles:
        names = [part.name.replace("_", " ") for part in singles]
        before = [float((part.before - part.measured)[0] / part.sigma[0]) for part in singles]
        after = [float(part.scaled[0]) for part in singles]
        for row, values, words in ((0, before, "before"), (1, after, "fitted")):
            values = np.where(np.isfinite(values), values, 0.0)  # what did not occur before has no bar
            axes[row, -1].bar(names, values, color="tab:gray" if row == 0 else "tab:blue", width=0.3, label=words)
            axes[row, -1].set_xlim(-0.6, len(names) - 0.4)
            axes[row, -1].axhline(0.0, color="k", lw=0.8)
        axes[0, -1].set_ylabel("(model − measured)/σ")
        axes[1, -1].tick_params(axis="x", rotation=20)
    for panel in axes.flat:
        panel.grid(alpha=0.3)
    for panel in axes[0]:
        panel.legend(loc="best", fontsize=8, framealpha=0.9)
    for panel in axes[1]:
        panel.axhspan(-1, 1, color="tab:blue", alpha=0.1, lw=0)
    axes[1, 0].set_ylabel("(model − measured)/σ")
    figure.suptitle(f"calibration: {fit.message}; chi² {fit.chi2:.4g}, {fit.freedom} degrees of freedom", fontsize=11)
    return figure


# --- uncertain results ------------------------------------------------------------------------------------------------

#: SI unit → unit on an axis, factor, offset
_AXES = {"K": ("°C", 1.0, -273.15), "N": ("kN", 1e-3, 0.0), "J": ("kJ", 1e-3, 0.0)}


def distribution(found: Uncertainty, metric: Metric, *, figure: Figure | None = None) -> Figure:
    """Histogram and cumulative share of a metric, quantiles with their intervals, and its limit where it has one."""
    name = name_of(metric)
    s = found.statistics[name]
    unit, factor, offset = _AXES.get(s.unit, (s.unit, 1.0, 0.0))
    x = np.asarray(found.data[name], np.float64)
    x = np.sort(x[np.isfinite(x) & (np.asarray(found.data["code"]) == 0)]) * factor + offset
    if figure is None:
        figure = Figure(figsize=(7.5, 6.5), layout="constrained")
    density, cumulative = figure.subplots(2, 1, sharex=True)
    bins = int(np.clip(np.sqrt(len(x)), 5, 40))
    if len(x):
        density.hist(x, bins=bins, weights=np.full(len(x), 100 / found.runs), color="tab:blue", alpha=0.6)
        cumulative.step(x, 100 * np.arange(1, len(x) + 1) / len(x), where="post", color="tab:blue")
    for p, e in s.quantiles.items():
        at, low, high = (factor * value + offset for value in e)
        ends = [[max(at - low, 0.0)], [max(high - at, 0.0)]]
        bounded = np.isfinite(ends).all()
        cumulative.errorbar([at], [100 * p], xerr=ends if bounded else None, fmt="o", ms=4, capsize=4, color="k")
        upper = p > 0.5
        cumulative.annotate(
            f"{100 * p:g} %: {at:.4g} {unit}",
            (at, 100 * p),
            xytext=(-8 if upper else 8, 5 if upper else -11),
            textcoords="offset points",
            ha="right" if upper else "left",
            fontsize=8,
        )
    limit = found.limits.get(name)
    if limit is not None and np.ndim(limit) == 0:
        reason = next(f for words, f in found.failures.items() if words.startswith(f"{name} > "))
        p = reason.probability
        words = f"limit, exceeded with probability {p.value:.3g} [{p.low:.2g}, {p.high:.2g}]"
        for panel in (density, cumulative):
            panel.axvline(factor * float(limit) + offset, color="tab:red", ls="--", label=words)
        density.legend(loc="best", fontsize=8)
    density.set_ylabel(f"share of {found.runs} runs, %")
    cumulative.set_ylabel("cumulative share, %")
    cumulative.set_xlabel(f"{name.replace('_', ' ')}{', ' + unit if unit else ''}")
    rest = "" if s.count == found.runs else f" — {s.count} of {found.runs} runs have it"
    bars = f"bars: {100 * found.confidence:g} % intervals of the quantiles"
    figure.suptitle(f"{name.replace('_', ' ')}{rest} ({bars})", fontsize=10)
    for panel in (density, cumulative):
        panel.grid(alpha=0.3)
    return figure


def indices(table: SobolTable, *, figure: Figure | None = None) -> Figure:
    """Total and first-order Sobol indices as bars with their intervals, the greatest on top."""
    rows = table.indices[::-1]
    if figure is None:
        figure = Figure(figsize=(8.5, 1.4 + 0.55 * len(rows)), layout="constrained")
    axes = figure.subplots()
    place = np.arange(len(rows))
    kinds = [("total S_T: with all it acts on", "total", "tab:blue", -0.2)]
    kinds.append(("first order S_1: alone", "first", "tab:orange", 0.2))
    for label, kind, colour, shift in kinds[::-1]:
        estimates = [getattr(row, kind) for row in rows]
        value = [e.value for e in estimates]
        half = [e.high - e.value for e in estimates]
        axes.barh(
            place - shift,
            value,
            0.38,
            xerr=half,
            color=colour,
            alpha=0.8,
            label=label,
            error_kw={"capsize": 3, "lw": 1},
        )
    axes.set_yticks(place, [row.path for row in rows], fontsize=8)
    axes.axvline(0.0, color="k", lw=0.8)
    axes.set_xlabel(f"share of the variance (± half of the {100 * table.confidence:g} % interval)")
    axes.grid(alpha=0.3, axis="x")
    handles, labels = axes.get_legend_handles_labels()
    axes.legend(handles[::-1], labels[::-1], loc="lower right", fontsize=8)
    unit, factor, _ = _AXES.get(table.unit, (table.unit, 1.0, 0.0))
    unit = "K" if unit == "°C" else unit
    spread = f"{factor * table.deviation:.3g} {unit}".rstrip()
    words = f"what makes the {table.metric.replace('_', ' ')} uncertain"
    axes.set_title(f"{words} (standard deviation {spread})", fontsize=10)
    return figure


def effects(table: MorrisTable, *, figure: Figure | None = None) -> Figure:
    """Morris' plane: mean absolute elementary effect against its standard deviation.

    Far to the right: weighty. Above the line σ = μ*: the effect depends on where the other numbers are.
    """
    unit, factor, _ = _AXES.get(table.unit, (table.unit, 1.0, 0.0))
    unit = "K" if unit == "°C" else unit
    if figure is None:
        figure = Figure(figsize=(7.5, 5.5), layout="constrained")
    axes = figure.subplots()
    for one in table.effects:
        star, half = factor * one.mu_star.value, factor * (one.mu_star.high - one.mu_star.value)
        axes.errorbar([star], [factor * one.sigma], xerr=[half], fmt="o", capsize=3, label=one.path)
    right = axes.get_xlim()[1]
    for slope, words in ((1.0, "σ = μ*"), (0.1, "σ = 0.1 μ*: nearly linear below")):
        axes.plot([0, right], [0, slope * right], color="0.6", lw=0.8, ls="--" if slope == 1 else ":", label=words)
    top = max([factor * one.sigma for one in table.effects] + [0.12 * right])
    axes.set_xlim(0, right)
    axes.set_ylim(-0.03 * top, 1.15 * top)
    suffix = f", {unit}" if unit else ""
    axes.set_xlabel(f"mean absolute effect μ* of crossing the range (± half of the interval){suffix}")
    axes.set_ylabel(f"standard deviation of the effects σ{suffix}")
    axes.set_title(f"elementary effects on {table.metric.replace('_', ' ')}", fontsize=10)
    axes.legend(loc="best", fontsize=8)
    axes.grid(alpha=0.3)
    return figure


# --- layouts ----------------------------------------------------------------------------------------------------------

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


# --- wear over the life -----------------------------------------------------------------------------------------------

_COLOURS = (BLUE, VERMILLION, GREEN, ORANGE, PURPLE)
_MARKS = 5  # lines along the band in one panel


def wear(lives: LiningLife | Mapping[str, LiningLife], *, figure: Figure | None = None) -> Figure:
    """Thickness worn off along the band after parts of the life, and below over the number of brakings.

    - `lives`: one life, or several by name (layouts, a band turned or not): a panel on top for each
    - below left: the lining that has lost most and the one that has lost least;  right: greatest over mean wear

    Linings are counted from the slack end at the start, and keep their number where the band is turned.
    """
    named = dict(lives) if isinstance(lives, Mapping) else {"": lives}
    count = len(named)
    if figure is None:
        figure = Figure(figsize=(max(9.5, 3.4 * count + 1.5), 7.2), layout="constrained")
    rows: Any = figure.subfigures(2, 1, height_ratios=[1.15, 1.0])
    top = rows[0].subplots(1, count, squeeze=False, sharey=True)[0]
    longest = max(life.brakings for life in named.values())
    colours = ScalarMappable(Normalize(0.0, longest / _scale(longest)[0]), "viridis")
    for axes, (name, life) in zip(top, named.items(), strict=True):
        _along_the_band(axes, life, colours, _scale(longest)[0])
        axes.set_title(f"{name + ': ' if name else ''}{life.brakings:.0f} brakings", fontsize=10)
    top[0].set_ylabel("worn off, mm")
    factor, words = _scale(longest)
    rows[0].colorbar(colours, ax=list(top), label=f"brakings done{words}", pad=0.01)
    left, right = rows[1].subplots(1, 2)
    for (name, life), colour in zip(named.items(), _cycled(count), strict=True):
        done = np.unique(np.concatenate([np.linspace(0.0, life.brakings, 200), life.history.brakings]))
        worn = _worn_after(life, done)
        left.plot(
            done / factor, 1e3 * worn.max(axis=1), color=colour, label=f"{name}: most worn" if name else "most worn"
        )
        left.plot(done / factor, 1e3 * worn.min(axis=1), color=colour, ls="--", label="least worn")
        uneven = worn[1:].max(axis=1) / worn[1:].mean(axis=1)
        right.plot(done[1:] / factor, uneven, color=colour, label=name or None)
        for at in life.turned_at:
            _mark_turn(left, right, at / factor, colour)
    left.set_ylabel("worn off, mm")
    left.set_ylim(bottom=0.0)
    right.set_ylabel("greatest over mean wear so far")
    right.set_ylim(0.98, 1.05 * right.get_ylim()[1])
    for axes in (left, right):
        axes.set_xlabel(f"brakings done{words}")
        axes.grid(alpha=0.3)
        if axes.get_legend_handles_labels()[0]:
            axes.legend(fontsize=8, framealpha=0.9, loc="lower right" if axes is left else "upper right")
    return figure


def _worn_after(life: LiningLife, done: np.ndarray) -> np.ndarray:
    """Thickness (m, n) worn off after numbers of brakings; nearly straight between points of the history."""
    h = life.history
    return np.stack([np.interp(done, h.brakings, h.worn[:, i]) for i in range(h.worn.shape[1])], axis=1)


def _mark_turn(left: Axes, right: Axes, at: float, colour: str) -> None:
    for axes in (left, right):
        axes.axvline(at, color=colour, lw=0.9, ls=":")
    words = {"xycoords": ("data", "axes fraction"), "textcoords": "offset points"}
    left.annotate("turned ", (at, 0.97), xytext=(-2, 0), va="top", ha="right", fontsize=8, color=colour, **words)


def _cycled(count: int) -> list[str]:
    return [_COLOURS[i % len(_COLOURS)] for i in range(count)]


def _scale(longest: float) -> tuple[float, str]:
    """What numbers of brakings are divided by, and words for it."""
    return (1e3, ", thousands") if longest >= 1e4 else (1.0, "")


def _along_the_band(axes: Axes, life: LiningLife, colours: Any, factor: float) -> None:
    """Lines over the linings at even parts of the life."""
    n = len(life.permissible)
    linings = np.arange(1, n + 1)
    for done in np.linspace(0.0, life.brakings, _MARKS + 1)[1:]:
        worn = _worn_after(life, np.atleast_1d(done))[0]
        axes.plot(linings, 1e3 * worn, "o-", ms=3.5, color=colours.to_rgba(done / factor))
    axes.step(
        np.append(linings - 0.5, n + 0.5),
        1e3 * np.append(life.permissible, life.permissible[-1]),
        where="post",
        color="0.35",
        ls="--",
        lw=1.0,
        label="permissible",
    )
    axes.set_xlabel("lining, from the slack end")
    axes.set_xlim(0.5, n + 0.5)
    axes.set_ylim(0.0, 1.12e3 * float(life.permissible.max()))
    axes.set_xticks(linings if n <= 12 else linings[:: 1 + n // 12])
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8, loc="lower right", framealpha=0.9)
