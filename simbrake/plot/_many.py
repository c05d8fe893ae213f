"""Several runs in one figure: results laid over each other, and metrics over the
parameters that were varied."""

import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from matplotlib.tri import Triangulation
from scipy.interpolate import RegularGridInterpolator

from .._base._faults import input_error
from .._base._numbers import Reading, reading
from .._base._quantity import shown as about
from ..outputs.judgement import Colour
from ..outputs.log import Status
from ..outputs.metrics import is_least, margin_to
from ..outputs.quantities import SERIES_COLUMNS
from ..results.stored import Dataset, Source, dataset, read_result
from ..runs.result import Result
from .drawing import (
    BLUE,
    CYCLE,
    GREY,
    MARKED,
    TEXT,
    VERMILLION,
    drawn_in,
    finish,
    ink,
    metric_words,
    name_marks,
    sheet,
    styled,
    words_of_mark,
)

# --- results laid over each other ----------------------------------------------------

_DASHES = ("-", "--", "-.", ":")
#: events that are marked on the curves of the speed, where one result has not too many
#: of them
_EVENTS = {"slip_onset": "o", "full_slip": "s", "stop": "D"}
_MOST = 6
#: panels of a comparison: words, and the columns whose maximum is shown
_COMPARED = {
    "speed": ("omega",),
    "brake torque": ("brake_torque",),
    "tension of\nthe lever": ("slack_tension",),
    "force of\nthe actuator": ("lever_force",),
    "tension of\nthe tight end": ("tight_tension",),
    "normal force\non a lining": ("normal_load",),
    "hottest\nsurface": ("rim_temperature", "lining_temperature", "band_temperature"),
}
#: of these the panels of a lever that holds the speed
_OF_LEVER = (("slack_tension",), ("lever_force",))


@styled
def compare(
    results: Mapping[str, Source] | Sequence[Source], *, figure: Figure | None = None
) -> Figure:
    """Results laid over each other: speed, brake torque, tension of a band's tight end,
    of discs and shoes the normal force, and the hottest surface, as far as the results
    have them; of levers that hold the speed, their tension.

    Each result has its colour and dashes; marks on the curves of the speed are onset of
    slip, full slip and stop. Runs that end at rest are cut shortly after the last stop
    of all.

    - `results`: two or more by name, or in a list (named a, b, …); each a `Result`, its
      data set, or a result file

    Raises `InputError` for fewer than two results, and for a file that is not a result.

    Example:
        >>> heavy = sb.simulate(sb.with_values(scene, {"duty.load.mass": 22e3}))
        >>> figure = sb.plot.compare({"20 t": result, "22 t": heavy})
        >>> [line.get_label() for line in figure.axes[0].lines if line.get_linestyle() != "None"]
        ['20 t', '22 t']
    """
    named = (
        results
        if isinstance(results, Mapping)
        else {chr(97 + i): source for i, source in enumerate(results)}
    )
    if len(named) < 2:
        raise input_error(
            "results", f"{len(named)} result is no comparison", "give two or more"
        )
    data = {name: _data(source) for name, source in named.items()}
    held = all(run["status"].item() == Status.LOWERING for run in data.values())
    shown = []
    for words, columns in _COMPARED.items():
        curves = {name: _curve(run, columns) for name, run in data.items()}
        curves = {name: y for name, y in curves.items() if y is not None}
        if curves and (held or columns not in _OF_LEVER):
            shown.append((words, SERIES_COLUMNS[columns[0]].unit, curves))
    figure = sheet(figure, 9.5, 2.1, rows=len(shown), room=1.7)
    rows = figure.subplots(len(shown), 1, squeeze=False, sharex=True)[:, 0]
    for axes, (words, unit, curves) in zip(rows, shown, strict=True):
        top = max(float(np.nanmax(np.abs(y))) for y in curves.values())
        read = reading(unit, top)
        for i, name in enumerate(data):
            if name in curves:
                label = name if axes is rows[0] else None
                y = read(curves[name])
                axes.plot(
                    data[name]["time"].values,
                    y,
                    label=label,
                    color=CYCLE[i % len(CYCLE)],
                    ls=_DASHES[i % len(_DASHES)],
                )
        axes.set_ylabel(f"{words}, {read.name}")
    marked = [
        event for i, run in enumerate(data.values()) for event in _mark(rows[0], run, i)
    ]
    finish(rows)
    start = min(float(run["time"][0]) for run in data.values())
    end = max(map(_end, data.values()))
    rows[-1].set(xlabel="time, s", xlim=(start, end))
    marks = [
        Line2D(
            [],
            [],
            marker=marker,
            label=words_of_mark(MARKED[event][1]),
            color=GREY,
            ls="none",
            mfc="white",
        )
        for event, marker in _EVENTS.items()
        if event in marked
    ]
    name_marks(figure, marks)
    figure.suptitle("results compared")
    return figure


def _data(source: Source) -> Dataset:
    if isinstance(source, Result):
        return dataset(source)
    return read_result(source) if isinstance(source, str | Path) else source


def _curve(data: Dataset, columns: Sequence[str]) -> Float[np.ndarray, " t"] | None:
    """Maximum of the columns that a result has, and of its linings; the normal load
    where there is no tension."""
    banded = "tight_tension" in data
    names = [
        name
        for name in columns
        if name in data and not (banded and name in ("normal_load", "lever_force"))
    ]
    curves = [data[name].values.astype(float) for name in names]
    if not curves:
        return None
    return np.max([y.reshape(len(y), -1).max(axis=1) for y in curves], axis=0)


def _end(data: Dataset) -> float:
    """Where the curves of a result end (s): a run that ends at rest shortly after its
    last stop."""
    start = float(data["time"][0])
    end = float(data["time"][-1])
    stops = _times_of(data, "stop")
    if stops.size and data["status"].item() == Status.STOPPED:
        return min(end, start + 1.15 * (float(stops[-1]) - start))
    return end


def _times_of(data: Dataset, event: str) -> Float[np.ndarray, " e"]:
    """Times (s) of the events of a name."""
    return data["event_time"].values[data["event_name"].values == event].astype(float)


def _mark(axes: Axes, data: Dataset, i: int) -> list[str]:
    """Marks at the events of a result on the curve of its speed; returns the names of
    the events that have some."""
    t = data["time"].values
    omega = data["omega"].values
    names = []
    for event, marker in _EVENTS.items():
        times = _times_of(data, event)
        if 0 < len(times) <= _MOST:
            axes.plot(
                times,
                np.interp(times, t, omega),
                marker,
                zorder=4,
                color=CYCLE[i % len(CYCLE)],
                mfc="white",
                ms=6.0,
            )
            names.append(event)
    return names


# --- metrics over parameters --------------------------------------------------------

#: metrics that are drawn first, if a study has them
_FIRST = (
    "stopping_time",
    "hook_travel",
    "stopping_angle",
    "energy.friction_heat",
    "max_tension",
)


@styled
def sweep(
    data: Dataset,
    metrics: str | Sequence[str] | None = None,
    *,
    figure: Figure | None = None,
) -> Figure:
    """Metrics over the parameters of `simbrake.sweep` or `simbrake.ensemble`.

    - a grid of one parameter: a curve with its points, dotted where the sequence of
      events changes
    - a grid of two: filled contours, runs that failed hatched, thick lines where the
      sequence of events changes
    - a parameter of one value is no axis
    - rows of an ensemble: a point for each run over each parameter, failed ones left
      out; of more than 50 runs with two parameters points over both, with contours
    - more than 50 runs: beside it the distribution of the metric, with its 5, 50 and 95
      % quantiles

    `metrics`: names, by default four at most that vary. Raises `InputError` for names
    that the data does not have, and for grids of more than two parameters.

    Example:
        >>> data = sb.sweep(scene, {"duty.load.mass": [18e3, 20e3, 22e3]}, ["stopping_time"], progress=False)
        >>> figure = sb.plot.sweep(data)
        >>> figure.axes[0].get_xlabel(), figure.axes[0].get_ylabel()
        ('mass on the hook, t', 'stopping time, s')
    """
    if not hasattr(data, "data_vars"):
        hint = "give the data set of simbrake.sweep or simbrake.ensemble"
        raise input_error("data", f"{about(data)} does not fit here", hint)
    grid = "run" not in data.dims
    if grid:
        single = [name for name, size in data.sizes.items() if size == 1]
        data = data.squeeze(single[: len(data.dims) - 1])
    paths = [
        str(name)
        for name in (data.dims if grid else data.coords)
        if name != "run" and data[name].ndim == 1
    ]
    if grid and len(paths) > 2:
        hint = "select one value of the others: data.sel({path: value})"
        raise input_error("data", f"is a grid of {len(paths)} parameters", hint)
    shown = _shown(data, metrics)
    many = data["code"].size > _FEW
    plane = len(paths) == 2 and (grid or many)
    columns = min(2, len(shown)) if plane else len(paths) + many
    rows = -(-len(shown) // columns) if plane else len(shown)
    height = 4.4 if plane else 3.4 if columns > 1 else 2.6
    figure = sheet(figure, max(9.5, 5.8 * columns), height, rows=rows, room=0.9)
    share: Any = {}
    if not plane:
        widths = [1.0] * len(paths) + [0.6] * many
        share = {"sharex": "col", "sharey": "row", "width_ratios": widths}
    panels = figure.subplots(rows, columns, squeeze=False, **share)
    for axes in panels.flat[len(shown) if plane else rows * columns :]:
        axes.axis("off")
    changes = plane and np.ptp(data["sequence"].values) > 0
    failed = data["code"].values != 0
    blank = bool(failed.any())
    for k, metric in enumerate(shown):
        values = data[metric].values.astype(float)
        good = np.isfinite(values) & ~failed
        blank |= not good.all()
        read = _reading(data, metric, values[good])
        y = np.where(good, read(values), np.nan)
        label = read.axis(metric_words(metric), _PURE)
        if plane:
            _contours(panels.flat[k], data, paths, y, label)
            continue
        for axes, path in zip(panels[k], paths, strict=False):
            x, name = _along(data, path)
            if grid:
                changes |= _curve_with_gaps(
                    axes, x, y, data["sequence"].values, "" if many else "o"
                )
            else:
                axes.plot(
                    x, y, ".", color=BLUE, ms=2.0 if many else 4.0, rasterized=many
                )
            axes.set_xlabel(name if metric == shown[-1] else "")
            axes.grid(alpha=0.3)
        panels[k, 0].set_ylabel(textwrap.fill(label, 28))
        if many:
            _quantiles(panels[k, -1], y)
            if metric == shown[-1]:
                panels[k, -1].set_xlabel("share of the runs, %")
    handles: list[Artist] = []
    if grid and changes:
        look = {"color": VERMILLION, "lw": 2.5} if plane else {"color": BLUE, **_BRIDGE}
        handles.append(Line2D([], [], label="the sequence of events changes", **look))
    if grid and blank:
        handles.append(Patch(**_BLANK, label=_NO_VALUE))
    name_marks(figure, handles)
    lost = f", {failed.sum()} failed" if failed.any() else ""
    figure.suptitle(f"{failed.size} runs{lost}")
    return figure


#: look of runs without a value
_BLANK: Any = {"facecolor": "white", "edgecolor": "0.5", "hatch": "///"}
_NO_VALUE = "no value: not stopped or held, or failed"
#: up to so many runs each is a point
_FEW = 50


def _quantiles(axes: Axes, y: Float[np.ndarray, " n"]) -> None:
    """Histogram of a metric along its axis, with quantiles; shares are those of all
    runs."""
    found = y[np.isfinite(y)]
    weights = np.full(found.size, 100.0 / y.size)
    axes.hist(
        found, bins=40, weights=weights, orientation="horizontal", color=BLUE, alpha=0.6
    )
    for p, style in ((95, "--"), (50, "-"), (5, ":")) if found.size else ():
        at = float(np.percentile(found, p))
        axes.axhline(at, color=ink(), lw=1.2, ls=style, label=f"{p} % below {at:.4g}")
    finish([axes])


def _along(data: Dataset, path: str) -> tuple[Float[np.ndarray, " n"], str]:
    """Values of a parameter for reading, and its name in words with their unit; two of
    one name have their path."""
    values = data[path].values.astype(float)
    read = _reading(data, path, values)
    alike = [
        name
        for name in data.coords
        if data[name].attrs.get("meaning") == data[path].attrs.get("meaning")
    ]
    words = str(data[path].attrs.get("meaning", path))
    return read(values), read.axis(words if len(alike) == 1 else path, _PURE)


_NOT_WITHIN = "a limit is exceeded, or the load is not stopped or held"
#: points along each side of a permissible map
_FINE = 241


@styled
def permissible(
    data: Dataset, limits: Mapping[str, float], *, ax: Axes | None = None
) -> Axes:
    """Where a brake is within its limits: a grid of two parameters of `simbrake.sweep`,
    with one line for each limit.

    - `limits`: metric → permissible value (SI), the greatest, or the least of a metric
      that begins with `min_`
    - green: within all limits; red: one is exceeded, or the load is not stopped or
      held, as the `colour` of the run says; hatched: the run failed, or has no value

    Raises `InputError` for a grid of another number of parameters, and for metrics that
    the data does not have.

    Example:
        >>> grid = {"duty.load.mass": [16e3, 20e3, 24e3], "initial.omega": [18.0, 22.0]}
        >>> data = sb.sweep(scene, grid, ["stopping_time"], progress=False)
        >>> axes = sb.plot.permissible(data, {"stopping_time": 1.0})
        >>> axes.get_xlabel()
        'mass on the hook, t'
    """
    if (
        not hasattr(data, "data_vars")
        or len(data["code"].dims) != 2
        or min(data["code"].shape) < 2
    ):
        hint = "give the data set of simbrake.sweep over two parameters"
        raise input_error("data", "is no grid of two parameters", hint)
    missing = [name for name in limits or ["a limit"] if name not in data.data_vars]
    if missing:
        hint = f"there are: {', '.join(map(str, data.data_vars))}"
        raise input_error("limits", f"the data is without {', '.join(missing)}", hint)
    (x, name), (y, other) = (_along(data, str(path)) for path in data["code"].dims)
    good = data["code"].values == 0
    margins = []
    lines = []
    for metric, limit in limits.items():
        value = data[metric].values.astype(float)
        margin = margin_to(limit, metric, value)
        margins.append(np.where(good & np.isfinite(value), margin, np.nan))
        read = _reading(data, metric, np.asarray([limit]))
        most = f"{read(limit):.4g} {read.name}".rstrip()
        lines.append(
            f"{metric_words(metric)} {'≥' if is_least(metric) else '≤'} {most}"
        )
    axes = drawn_in(ax, 8.0, 5.6)
    axes.set(
        xlabel=name, ylabel=other, xlim=(x.min(), x.max()), ylim=(y.min(), y.max())
    )
    # on a finer grid, so that the region ends on the lines
    u, v = (np.linspace(ends[0], ends[-1], _FINE) for ends in (x, y))
    points = tuple(np.meshgrid(u, v))
    fine = RegularGridInterpolator((x, y), np.stack(margins, axis=-1))(points)
    lost = np.zeros(good.shape)
    if "colour" in data:
        lost = (good & (data["colour"].values == Colour.RED)).astype(float)
    runs_on = RegularGridInterpolator((x, y), lost, method="nearest")(points) > 0
    blank = np.isnan(np.sum(fine, axis=-1)) & ~runs_on
    within = np.where(blank, np.nan, np.all(fine >= 0.0, axis=-1) & ~runs_on)
    # (pale on any paper)
    red = "#e0503c"
    green = "#4cb474"
    alpha = 0.28
    shades: Any = {"cmap": ListedColormap([red, green]), "vmin": 0.0, "vmax": 1.0}
    shades |= {"shading": "nearest", "rasterized": True}
    axes.pcolormesh(u, v, within, alpha=alpha, **shades)
    handles: list[Artist] = [
        Patch(color=green, alpha=alpha, label="within all limits"),
        Patch(color=red, alpha=alpha, label=_NOT_WITHIN),
    ]
    for i, label in enumerate(lines):
        colour = CYCLE[i % len(CYCLE)]
        there = np.where(blank, np.nan, fine[..., i])
        high = np.nanmax(there, initial=-np.inf)
        if np.nanmin(there, initial=np.inf) < 0 < high:
            axes.contour(u, v, there, levels=[0.0], colors=[colour], linewidths=2.0)
        else:
            label += ": kept everywhere" if high >= 0 else ": exceeded everywhere"
        handles.append(Line2D([], [], color=colour, lw=2.0, label=label))
    if blank.any():
        axes.contourf(u, v, blank, levels=[0.5, 1.5], colors=["white"], hatches=["///"])
        handles.append(Patch(**_BLANK, label="no value, or failed"))
    axes.set_title(f"permissible map, {data['code'].size} runs")
    finish([axes], handles)
    return axes


def _label(axes: Axes, lines: Any, **look: Any) -> None:
    """Numbers on contours, but those that the border would cut."""
    for text in axes.clabel(lines, fontsize=TEXT, fmt="%.4g", **look):
        x, y = axes.transAxes.inverted().transform(
            axes.transData.transform(text.get_position())
        )
        text.set_visible(0.05 < x < 0.95 and 0.05 < y < 0.95)


def _shown(data: Dataset, asked: str | Sequence[str] | None) -> list[str]:
    """Names of the metrics to be drawn."""
    names = [
        str(name)
        for name, variable in data.data_vars.items()
        if "meaning" not in variable.attrs
    ]
    if asked is not None:
        asked = [asked] if isinstance(asked, str) else asked
        if missing := [name for name in asked if name not in names]:
            hint = f"there are: {', '.join(names)}"
            raise input_error(
                "metrics", f"the data is without {', '.join(missing)}", hint
            )
        return list(asked)

    def varies(name: str) -> bool:
        values = data[name].values.astype(float)
        values = values[np.isfinite(values)]
        return values.size > 1 and bool(np.ptp(values) > 1e-9 * np.abs(values).max())

    first = [name for name in _FIRST if name in names]
    order = dict.fromkeys([*first, *names])
    varying = [name for name in order if varies(name)][:4]
    if not varying:
        raise input_error(
            "data", "has no metric that varies", "vary a parameter that matters"
        )
    return varying


#: after the words of a pure number
_PURE = " (–)"


def _reading(data: Dataset, name: str, values: Float[np.ndarray, " n"]) -> Reading:
    """How a metric or a parameter is read."""
    top = float(np.nanmax(np.abs(values), initial=0.0))
    return reading(data[name].attrs.get("units", ""), top)


#: look of a curve between two points with different sequences of events
_BRIDGE: Any = {"ls": ":", "lw": 1.0}


def _curve_with_gaps(
    axes: Axes,
    x: Float[np.ndarray, " n"],
    y: Float[np.ndarray, " n"],
    sequence: np.ndarray,
    marker: str,
) -> bool:
    """A curve through the points of each sequence of events, dotted from one to the
    next; points without a value are hatched. Whether there is anything dotted."""
    changes = np.flatnonzero(np.diff(sequence))
    bridged = [i for i in changes if np.all(np.isfinite(y[i : i + 2]))]
    for part in np.split(np.arange(len(x)), 1 + changes):
        axes.plot(x[part], y[part], f"{marker}-", color=BLUE, ms=4.0)
    for i in bridged:
        axes.plot(x[i : i + 2], y[i : i + 2], color=BLUE, **_BRIDGE)
    edges = _edges(x)
    blank = np.flatnonzero(np.isnan(y))
    for part in np.split(blank, 1 + np.flatnonzero(np.diff(blank) > 1)):
        if not part.size:  # there is none at all
            continue
        axes.axvspan(
            float(edges[part[0]]),
            float(edges[part[-1] + 1]),
            facecolor="none",
            edgecolor="0.6",
            hatch="///",
            lw=0,
        )
    return bool(bridged)


def _edges(x: Float[np.ndarray, " n"]) -> Float[np.ndarray, " m"]:
    """Borders of the cells around points."""
    middle = 0.5 * (x[1:] + x[:-1])
    return np.concatenate([x[:1], middle, x[-1:]])


def _contours(
    axes: Axes, data: Dataset, paths: list[str], z: Float[np.ndarray, "..."], label: str
) -> None:
    """Contours of a metric over two parameters: of a grid filled, runs without a value
    hatched; of rows of runs over their points."""
    (x, name), (y, other) = (_along(data, path) for path in paths)
    good = np.isfinite(z)
    sequence = data["sequence"].values
    axes.set(xlabel=name, ylabel=other)
    if z.ndim == 1:
        look = {"cmap": "viridis", "alpha": 0.5, "lw": 0, "rasterized": True}
        dots = axes.scatter(x[good], y[good], 6.0, z[good], **look)
        axes.figure.colorbar(dots, ax=axes, label=label, pad=0.01)
        # else they lie on a line
        if good.sum() > 3 and abs(np.corrcoef(x[good], y[good])[0, 1]) < 1.0 - 1e-9:
            near = Triangulation(*(w[good] / np.ptp(w[good]) for w in (x, y))).triangles
            mesh = Triangulation(x[good], y[good], near)
            lines = axes.tricontour(
                mesh, z[good], levels=7, colors=ink(), linewidths=1.0
            )
            _label(axes, lines)
        return
    axes.set(xlim=(x.min(), x.max()), ylim=(y.min(), y.max()), title=label)
    if good.sum() > 2:
        low = np.nanmin(z)
        high = np.nanmax(z)
        levels = MaxNLocator(8).tick_values(low, high)
        # none between values equal but rounding
        levels = levels[(levels > low + 1e-6 * (high - low)) & (levels < high)]
        filled = axes.contourf(x, y, z.T, levels=levels, cmap="viridis", extend="both")
        lines = axes.contour(
            x, y, z.T, levels=filled.levels, colors="white", linewidths=0.8
        )
        _label(axes, lines, colors="white")
    a = _edges(x)
    b = _edges(y)
    for i, j in np.argwhere(np.isnan(z)):
        x_cell = a[[i, i + 1, i + 1, i]]
        y_cell = b[[j, j, j + 1, j + 1]]
        axes.fill(x_cell, y_cell, gid="failed", lw=0, **_BLANK)
    look = {"colors": VERMILLION, "linewidths": 2.5, "gid": "sequence"}
    i, j = np.nonzero(np.diff(sequence, axis=0))
    axes.vlines(a[i + 1], b[j], b[j + 1], **look)
    i, j = np.nonzero(np.diff(sequence, axis=1))
    axes.hlines(b[j + 1], a[i], a[i + 1], **look)
