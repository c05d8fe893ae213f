"""Pictures of uncertain results: distribution of a metric, Sobol indices, elementary effects."""

import numpy as np
from matplotlib.figure import Figure

from .._run._measure import Metric, name_of
from ..studies._global import MorrisTable, SobolTable
from ..studies._uncertainty import Uncertainty

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
