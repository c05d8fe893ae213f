"""Pictures of many runs: sensitivities, fits to measurements."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from .._run._simulate import simulate
from ..studies._calibration import Calibration
from ..studies._measured import pick
from ..studies._sensitivity import SensitivityTable
from ._plot_shared import ZERO, dense_grid


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
