"""Figures of many runs: sensitivities, fits, distributions, layouts, wear over the
life."""

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from .._base._faults import Fault, Issues
from .._base._numbers import ZERO, Reading, number, pretty, reading
from ..outputs.metrics import is_least
from ..runs.measure import MetricLike, name_of
from ..runs.result import Result
from ..runs.simulate import simulate
from ..studies._fitted import Calibration
from ..studies._lining_life import LiningLife
from ..studies._sensitivity_table import Sensitivity, SensitivityTable
from ..studies._uncertainty import Uncertainty
from ..studies.measured import Measured, Points, check_measured, pick
from .drawing import (
    BLUE,
    CYCLE,
    GREY,
    VERMILLION,
    dense_grid,
    drawn_in,
    finish,
    head,
    ink,
    metric_words,
    sheet,
    styled,
)


@styled
def tornado(table: SensitivityTable, *, most: int = 12, ax: Axes | None = None) -> Axes:
    """Tornado chart: effect of every parameter on a metric over its range, the largest
    on top.

    Lines across a bar are where its derivative alone would lead to: what the bar
    differs by is curvature. Without ranges in the table: elasticities.

    Example:
        >>> (table,) = sb.sensitivity(scene, ["stopping_time"], ["duty.load.mass"])
        >>> axes = sb.plot.tornado(table)
        >>> axes.get_xlabel()
        'stopping time, s'
    """
    base, bars = table.bars(most)
    ranged = any(len(ends) > 1 for _, ends in bars)
    bars.sort(key=lambda bar: max(abs(end - base) for end in bar[1].values()))
    axes = drawn_in(ax, 9.5, 1.9 + 0.6 * len(bars))
    colours = {"low": BLUE, "high": VERMILLION}
    labels = []
    names = _parameters([row for row, _ in bars])
    shown = reading(table.unit, abs(table.value)) if ranged else Reading(1.0, 0.0, "")
    middle = shown(base)
    for y, (name, (row, ends)) in enumerate(zip(names, bars, strict=True)):
        for side, end in ends.items():
            length = shown(end) - middle
            axes.barh(y, length, left=middle, color=colours[side], height=0.7)
        if row.tangent is not None:
            tangents = np.asarray([base - row.tangent, base + row.tangent])
            axes.vlines(shown(tangents), y - 0.35, y + 0.35, ink(), lw=1.5)
        value = number(row.value, row.unit, count=4)
        half = ""
        if ranged:
            beside = abs(row.value)
            width = number(row.half, row.unit, absolute=False, count=3, beside=beside)
            half = f" ± {width}"
        labels.append(f"{name}\n{value}{half}")
    axes.set_yticks(range(len(bars)), labels)
    axes.axvline(middle, color=ink(), lw=0.9)
    name = metric_words(table.metric)
    if not ranged:
        axes.set_xlabel(f"elasticity of the {name}, % for 1 % of the parameter")
        finish([axes])
        return axes
    axes.set_xlabel(shown.axis(name))
    axes.set_title(f"{name} {number(table.value, table.unit, count=4)}")
    handles = [
        Patch(color=BLUE, label="parameter at its lower bound"),
        Patch(color=VERMILLION, label="at its upper bound"),
        Line2D([], [], color=ink(), lw=1.5, label="by the derivative alone"),
    ]
    finish([axes], handles, "each parameter over its range, the others fixed")
    axes.grid(visible=False, axis="y")
    return axes


def _parameters(rows: Sequence[Sensitivity]) -> list[str]:
    """Parameters in words, with their paths where several have the same words."""
    meanings = [row.meaning or row.path for row in rows]
    names = [
        f"{m} ({r.path})" if meanings.count(m) > 1 else m
        for m, r in zip(meanings, rows, strict=True)
    ]
    return [textwrap.fill(name, 36) for name in names]


@styled
def overlay(result: Result, data: Measured, *, figure: Figure | None = None) -> Figure:
    """Measured columns over a run, one panel each: what was measured, its standard
    deviation, and the run.

    Axes have units for reading (within `simbrake.results.display_units("rig")` those of
    a rig). Raises `InputError` for columns that are not in a run of the scene, and for
    times outside it.

    Example:
        >>> data = sb.studies.Measured.of([0.2, 0.4, 0.6], {"omega": [24.1, 19.6, 13.9]})
        >>> figure = sb.plot.overlay(result, data)
        >>> figure.axes[0].get_ylabel()
        'speed of the pulley, rad/s'
    """
    check_measured(data, result.scene)
    rows = max(len(data.points), 1)
    figure = sheet(figure, 9.0, 2.3, rows=rows, room=1.4)
    panels = figure.subplots(rows, 1, squeeze=False, sharex=True)[:, 0]
    faults = Issues()
    for axes, part in zip(panels, data.points, strict=False):
        s = dense_grid(result, float(part.t.min()), float(part.t.max()))
        values = pick(result, s, part.column, part.entry)
        if isinstance(values, Fault):
            faults.append(values)
            continue
        read = reading(part.unit, float(np.max(np.abs(part.value))))
        spread = None if part.sigma is None else read.factor * part.sigma
        _dots(axes, part.t, read(part.value), spread, "measured")
        axes.plot(s.t, read(values), color=BLUE, label="run")
        axes.set_ylabel(read.axis(_words_of(part)))
    faults.report()
    panels[-1].set_xlabel("time, s")
    finish(panels)
    head(figure, result.scene, "measured, and the run")
    return figure


def _dots(axes: Axes, t: Any, values: Any, spread: Any, label: str) -> None:
    """Measured values with their standard deviations."""
    axes.errorbar(
        t,
        values,
        spread,
        label=label,
        fmt=".",
        color=ink(),
        ms=4,
        elinewidth=0.8,
        zorder=3,
    )


#: columns that are named by a symbol
_SYMBOLS = {"phi": "angle of the pulley", "omega": "speed of the pulley"}


def _words_of(points: Points) -> str:
    """A measured column in words."""
    return _SYMBOLS.get(points.column, points.name.replace("_", " "))


@styled
def calibration(
    fit: Calibration, recording: str | None = None, *, figure: Figure | None = None
) -> Figure:
    """Measured values with their standard deviations and the runs before and after a
    fit; below, residuals in σ.

    One column of panels for each measured column, and one for single values such as
    event times. Of several recordings one is drawn, by default that with the largest
    residual.

    Example:
        >>> data = sb.studies.Measured.of([0.2, 0.6], {"omega": [24.1, 13.9]}, sigma={"omega": 0.1})
        >>> fit = sb.calibrate(scene, {"duty.load.mass": (15e3, 25e3)}, data)
        >>> figure = sb.plot.calibration(fit)
        >>> figure.axes[0].get_ylabel()
        'speed of the pulley, rad/s'
    """
    each, parts = fit.of(recording)
    columns, singles = (
        [part for part in parts if (part.t is None) == single]
        for single in (False, True)
    )
    widths = [2.5] * len(columns) + [1] * bool(singles)
    figure = sheet(figure, 3.0 + 4.6 * len(columns) + 2.0 * bool(singles), 6.0)
    axes = figure.subplots(
        2,
        len(widths),
        width_ratios=widths,
        squeeze=False,
        sharex="col",
        height_ratios=[2, 1],
    )
    before = {"color": "0.5", "label": "before"}
    fitted = {"color": BLUE, "label": "fitted"}
    runs = [
        (simulate(each.before, throw=False), before, "--"),
        (simulate(each.scene, throw=False), fitted, "-"),
    ]
    for (above, below), part, points in zip(
        axes.T[: len(columns)], columns, each.data.points, strict=True
    ):
        # (in SI but for °C)
        hot = part.unit == "K"
        read = Reading(1.0, -ZERO * hot, "°C" if hot else pretty(part.unit))
        times = points.t
        for result, look, style in runs:
            s = dense_grid(result, float(times.min()), float(times.max()))
            values = pick(result, s, points.column, points.entry)
            above.plot(s.t, read(values), style, **look)
        label = r"measured $\pm\,\sigma$"
        _dots(above, times, read(part.measured), part.sigma, label)
        above.set_ylabel(read.axis(_words_of(points)))
        below.plot(times, part.scaled, ".", color=BLUE, ms=4)
        below.set_xlabel("time, s")
    if singles:
        names = [part.name.replace("_", " ") for part in singles]
        was = [((part.before - part.measured) / part.sigma)[0] for part in singles]
        now = [part.scaled[0] for part in singles]
        for panel, values, look in zip(
            axes[:, -1], (was, now), (before, fitted), strict=True
        ):
            # no bar: it did not occur
            bars = np.where(np.isfinite(values), values, 0.0)
            panel.bar(names, bars, width=0.3, **look)
            panel.set_xlim(-0.6, len(names) - 0.4)
            panel.axhline(0.0, color=ink(), lw=0.8)
        axes[0, -1].set_ylabel(r"(model − measured)$/\sigma$ (–)")
        axes[1, -1].tick_params(axis="x", rotation=20)
    finish(axes.flat)
    for panel in axes[1]:
        panel.axhspan(-1, 1, color=BLUE, alpha=0.1, lw=0)
    axes[1, 0].set_ylabel(r"(model − measured)$/\sigma$ (–)")
    figure.suptitle(
        f"calibration: {fit.message}; $\\chi^2$ {fit.chi2:.4g}, {fit.freedom} degrees of freedom"
    )
    return figure


# --- uncertain results --------------------------------------------------------------


class _Sample(NamedTuple):
    """The values of a metric in good runs, in order, as they are shown."""

    x: Float[np.ndarray, " n"]
    read: Reading
    label: str


def _sample(found: Uncertainty, name: str) -> _Sample:
    values = np.asarray(found.data[name], np.float64)
    good = np.isfinite(values) & (np.asarray(found.data["code"]) == 0)
    x = np.sort(values[good])
    top = float(np.abs(x).max(initial=0.0))
    read = reading(found.statistics[name].unit, top)
    return _Sample(read(x), read, read.axis(metric_words(name)))


def _draw_limit(axes: Axes, found: Uncertainty, name: str, sample: _Sample) -> None:
    """A line at the limit of the metric, if it has one, with the probability to exceed
    it."""
    limit = found.limits.get(name)
    if limit is None or np.ndim(limit) > 0:
        return
    side = f"{name} {'<' if is_least(name) else '>'} "
    judged = (f for words, f in found.failures.items() if words.startswith(side))
    p = next(judged).probability
    words = (
        f"limit, exceeded with probability {p.value:.3g} [{p.low:.2g}, {p.high:.2g}]"
    )
    axes.axvline(sample.read(limit), color=VERMILLION, ls="--", label=words)


@styled
def histogram(
    found: Uncertainty, metric: MetricLike, *, ax: Axes | None = None
) -> Axes:
    """Histogram of a metric in % of all runs, and its limit where it has one.

    Example:
        >>> found = sb.uncertainty(scene, {"duty.load.mass": (18e3, 22e3)}, ("stopping_time",), n=64, progress=False)
        >>> axes = sb.plot.histogram(found, "stopping_time")
        >>> axes.get_xlabel()
        'stopping time, s'
    """
    name = name_of(metric)
    sample = _sample(found, name)
    axes = drawn_in(ax, 8.5, 3.9)
    if len(sample.x):
        bins = int(np.clip(np.sqrt(len(sample.x)), 5, 40))
        weights = np.full(len(sample.x), 100 / found.runs)
        axes.hist(sample.x, bins=bins, weights=weights, color=BLUE, alpha=0.6)
    _draw_limit(axes, found, name, sample)
    axes.set(xlabel=sample.label, ylabel=f"share of {found.runs} runs, %")
    finish([axes])
    return axes


@styled
def cumulative(
    found: Uncertainty, metric: MetricLike, *, ax: Axes | None = None
) -> Axes:
    """Cumulative share of a metric among the runs that have it, quantiles with their
    intervals, and its limit where it has one.

    Example:
        >>> found = sb.uncertainty(scene, {"duty.load.mass": (18e3, 22e3)}, ("stopping_time",), n=64, progress=False)
        >>> axes = sb.plot.cumulative(found, "stopping_time")
        >>> axes.get_ylabel()
        'cumulative share, %'
    """
    name = name_of(metric)
    sample = _sample(found, name)
    axes = drawn_in(ax, 8.5, 3.9)
    n = len(sample.x)
    if n:
        axes.step(sample.x, 100 * np.arange(1, n + 1) / n, where="post", color=BLUE)
    interval = f"quantile, {100 * found.confidence:g} % interval"
    for p, estimate in found.statistics[name].quantiles.items():
        at, low, high = sample.read(estimate)
        ends = [[max(at - low, 0.0)], [max(high - at, 0.0)]]
        bounded = np.isfinite(ends).all()
        xerr = ends if bounded else None
        axes.errorbar(
            [at],
            [100 * p],
            xerr=xerr,
            label=interval,
            fmt="o",
            ms=4,
            capsize=4,
            color=ink(),
        )
        interval = None
        shift, side = ((-8, 5), "right") if p > 0.5 else ((8, -11), "left")
        axes.annotate(
            f"{100 * p:g} %: {at:.4g} {sample.read.name}",
            (at, 100 * p),
            xytext=shift,
            textcoords="offset points",
            ha=side,
        )
    _draw_limit(axes, found, name, sample)
    axes.set(xlabel=sample.label, ylabel="cumulative share, %")
    finish([axes])
    return axes


@styled
def distribution(
    found: Uncertainty, metric: MetricLike, *, figure: Figure | None = None
) -> Figure:
    """Histogram and cumulative share of a metric, quantiles with their intervals, and
    its limit where it has one.

    Example:
        >>> found = sb.uncertainty(scene, {"duty.load.mass": (18e3, 22e3)}, ("stopping_time",), n=64, progress=False)
        >>> figure = sb.plot.distribution(found, "stopping_time")
        >>> figure.axes[1].get_xlabel()
        'stopping time, s'
    """
    figure = sheet(figure, 8.5, 7.8)
    above, below = figure.subplots(2, 1, sharex=True)
    histogram(found, metric, ax=above)
    above.set_xlabel("")
    cumulative(found, metric, ax=below)
    name = name_of(metric)
    count = found.statistics[name].count
    every = count == found.runs
    rest = "" if every else f", which {count} of {found.runs} runs have"
    figure.suptitle(f"{metric_words(name)}{rest}")
    return figure


# --- wear over the life -------------------------------------------------------------

_MARKS = 5  # lines along the band in one panel


@styled
def wear(
    lives: LiningLife | Mapping[str, LiningLife], *, figure: Figure | None = None
) -> Figure:
    """Thickness worn off along the band after parts of the life, and below over the
    number of brake applications.

    - `lives`: one life, or several by name (layouts, a band turned or not): a panel on
      top for each
    - below left: the most and the least worn lining;  right: maximum over mean wear

    Linings are counted from the slack end at the start, and keep their number where the
    band is turned.

    Example:
        >>> figure = sb.plot.wear(life)
        >>> figure.axes[0].get_ylabel()
        'worn off, mm'
    """
    named = dict(lives) if isinstance(lives, Mapping) else {"": lives}
    figure = sheet(figure, max(9.5, 3.4 * len(named) + 1.5), 9.0)
    upper, lower = figure.subfigures(2, 1, height_ratios=[1.15, 1.0])  # pyright: ignore
    top = upper.subplots(1, len(named), squeeze=False, sharey=True)[0]
    left, right = lower.subplots(1, 2)
    longest = max(life.brakings for life in named.values())
    # of numbers of brake applications
    factor, words = (1e3, ", thousands") if longest >= 1e4 else (1.0, "")
    colours = ScalarMappable(Normalize(0.0, longest / factor), "viridis")
    for i, (axes, (name, life)) in enumerate(zip(top, named.items(), strict=True)):
        axes.set_title(f"{name}\n{life.brakings:.0f} brake applications".strip())
        _along_the_band(axes, life, colours, factor)
        colour = CYCLE[i % 5]
        even = np.linspace(0.0, life.brakings, 200)
        done = np.union1d(even, life.history.brakings)
        worn = _worn_after(life, done)
        shown = done / factor
        most = 1e3 * worn.max(axis=1)
        left.plot(shown, most, color=colour, label=name or "most worn")
        left.plot(shown, 1e3 * worn.min(axis=1), color=colour, ls="--")
        uneven = worn[1:].max(axis=1) / worn[1:].mean(axis=1)
        right.plot(shown[1:], uneven, color=colour, label=name or None)
        for at in np.divide(life.turned_at, factor):
            for axes in (left, right):
                axes.axvline(at, color=colour, lw=0.9, ls=":")
            left.text(
                at,
                0.97,
                "turned ",
                color=colour,
                ha="right",
                transform=left.get_xaxis_transform(),
                va="top",
            )
    top[0].set_ylabel("worn off, mm")
    upper.colorbar(colours, ax=list(top), label=f"brake applications{words}", pad=0.01)
    left.plot([], [], color=GREY, ls="--", label="least worn")
    left.set(ylabel="worn off, mm", ylim=(0.0, None))
    right.set(
        ylabel="maximum over\nmean wear so far (–)",
        ylim=(0.98, 1.05 * right.get_ylim()[1]),
    )
    for axes in (left, right):
        axes.set_xlabel(f"brake applications{words}")
        finish([axes])
    return figure


def _worn_after(
    life: LiningLife, done: Float[np.ndarray, " m"]
) -> Float[np.ndarray, "m n"]:
    """Thickness (m) worn off after numbers of brake applications; nearly straight
    between points of the history."""
    h = life.history
    each = [np.interp(done, h.brakings, lining) for lining in h.worn.T]
    return np.stack(each, axis=1)


def _along_the_band(
    axes: Axes, life: LiningLife, colours: ScalarMappable, factor: float
) -> None:
    """Lines over the linings at even parts of the life."""
    n = len(life.permissible)
    linings = np.arange(1, n + 1)
    done = np.linspace(0.0, life.brakings, _MARKS + 1)[1:]
    for count, worn in zip(done, _worn_after(life, done), strict=True):
        colour = colours.to_rgba(count / factor)
        axes.plot(linings, 1e3 * worn, "o-", ms=3.5, color=colour)
    edges = np.arange(n + 1) + 0.5
    axes.stairs(
        1e3 * life.permissible,
        edges,
        baseline=None,
        color=GREY,
        ls="--",
        lw=1.0,
        label="permissible",
    )
    top = 1.12e3 * float(life.permissible.max())
    axes.set(xlabel="lining, from the slack end", xlim=(0.5, n + 0.5), ylim=(0.0, top))
    axes.set_xticks(linings if n <= 12 else linings[:: 1 + n // 12])
    finish([axes])
