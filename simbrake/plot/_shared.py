"""What pictures share: colours, marks at events, grids of times, axes, and figures as bytes of a file."""

import io
from typing import Any

import jax
import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from .._base._faults import Fault, InputError
from .._run._log import Event
from .._run._result import Result

ZERO = 273.15  # K

#: colours that people with any colour vision tell apart (M. Okabe, K. Ito, *Color Universal Design*, 2008)
BLUE, SKY, GREEN, ORANGE, VERMILLION, PURPLE = "#0072B2", "#56B4E9", "#009E73", "#E69F00", "#D55E00", "#CC79A7"

#: events that change what a whole pair does, with their colour and the words beside their line
_MARKED = {
    "slip_onset": (GREEN, "slip onset t₀"),
    "full_slip": (ORANGE, "full slip t₁"),
    "internal_slip": (SKY, "internal slip"),
    "external_lock": (BLUE, "external lock"),
    "external_release": (PURPLE, "external release"),
    "internal_restick": (PURPLE, "internal re-stick"),
    "stop": (VERMILLION, "stop"),
    "restick": (PURPLE, "re-stick"),
    "restart": ("0.35", "restart"),
    "release": ("0.5", "release"),
}


def one_run(result: Result) -> Result:
    """The result, if it is one run. Raises `InputError` for a batch of them."""
    if np.ndim(result.record.count) > 0:
        raise InputError([Fault("result", "is a batch of runs", "draw one of them: jax.tree.map(lambda x: x[0], …)")])
    return result


def span(result: Result) -> tuple[float, float]:
    """Start and end of a run (s)."""
    t = np.asarray(result.record.rows.t)
    return float(t[0]), float(t[int(result.record.count)])


def windows(result: Result) -> tuple[float, float, float | None]:
    """Start of a run, its end as far as it is worth a picture, and the end of the onset of slip where it is short.

    A run that ends at rest is cut shortly after its last stop; the onset reaches to the first full slip or lock.
    """
    start, end = span(result)
    events = result.events
    last = [e.time for e in events if e.name in ("stop", "release", "restart")]
    # what swings after the stop, as linings of a chain do, is no motion of the pulley
    moves = [e for e in events if e.name in _MARKED]
    if last and moves[-1].name == "stop" and moves[-1].time > start:
        end = min(end, start + 1.15 * (moves[-1].time - start))
    slip = next((e.time for e in events if e.name in ("full_slip", "external_lock") and e.time > start), None)
    short = slip is not None and slip - start < 0.25 * (end - start)
    return start, end, start + 1.3 * (slip - start) if short else None  # pyright: ignore


def marks(axes: Axes, events: list[Event], low: float, high: float, *, named: bool, front: bool = False) -> None:
    """Vertical lines at events inside the window; names, staggered, in the topmost panel.

    `front`: the lines lie over what the panel shows, in white and black; many of them are ticks at its foot.
    """
    shown = [e for e in events if e.name in _MARKED and low <= e.time <= high]
    faint = 1.0 if len(shown) <= 40 else 0.3  # many brakings: the lines must not hide the curves
    for event in shown:
        colour = _MARKED[event.name][0]
        if front:
            top = 1.0 if faint == 1.0 and len(shown) <= 12 else 0.03
            axes.axvline(event.time, ymax=top, color="black", lw=0.8)
            axes.axvline(event.time, ymax=top, color="white", lw=0.8, ls=(0, (4, 4)))
        else:
            axes.axvline(event.time, color=colour, lw=0.9 * faint, ls="--", zorder=0, alpha=faint)
    if named and len(shown) <= 12:
        for i, event in enumerate(shown):
            colour, words = _MARKED[event.name]
            right = event.time > low + 0.75 * (high - low)
            axes.annotate(
                words,
                (event.time, 0.06 + 0.13 * (i % 4)),
                xycoords=("data", "axes fraction"),
                xytext=(-4 if right else 4, 0),
                textcoords="offset points",
                ha="right" if right else "left",
                fontsize=8,
                color="black" if front else colour,
                bbox={"facecolor": "white", "alpha": 0.8, "linewidth": 0, "pad": 1.0},
            )


def dense_grid(result: Result, low: float, high: float, events: list[Event]) -> tuple[Any, Any]:
    """A dense grid with the values before and after every event in it."""
    inside = sorted({e.time for e in events if low < e.time < high})
    t = cells(result, low, high)
    right, left = result.series(t), result.series(np.asarray(inside), left=True) if inside else None
    if left is None:
        return np.asarray(right.t), right
    order = np.argsort(np.concatenate([np.asarray(left.t), np.asarray(right.t)]), kind="stable")

    def merged(a: Any, b: Any) -> Any:
        return np.concatenate([np.asarray(a), np.asarray(b)])[order]

    series = jax.tree.map(merged, left, right)
    return series.t, series


def cells(result: Result, low: float, high: float) -> np.ndarray:
    """Edges (s) of the cells of a map over time: even ones, events, and steps, which are dense where it is quick."""
    t = np.unique(np.asarray(result.record.rows.t)[: int(result.record.count) + 1])
    steps = t[(t > low) & (t < high)]
    events = [e.time for e in result.events if low < e.time < high]
    edges = np.unique(np.concatenate([np.linspace(low, high, 600), events, steps[:: 1 + len(steps) // 2400]]))
    # events that rounding keeps apart are one edge
    kept = np.append(True, np.diff(edges) > 1e-12 * (high - low))
    return edges[kept]


def time_axis(axes: Axes, *, milliseconds: bool) -> None:
    """Time in s, or in ms for a panel that is enlarged."""
    if milliseconds:
        axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{1e3 * x:g}"))
    axes.set_xlabel("time, ms" if milliseconds else "time, s")


def finish(panels: Any, legend: str) -> None:
    """Grids, and a legend where something has a name."""
    for panel in panels:
        panel.grid(alpha=0.3)
        if panel.get_legend_handles_labels()[0]:
            panel.legend(loc=legend, fontsize=8, framealpha=0.9)


# --- figures as bytes, the same for the same figure -------------------------------------------------------------------


def svg(figure: Figure) -> bytes:
    """The figure as an SVG whose text is drawn, so that it looks alike without the font, and without a date."""
    file = io.BytesIO()
    # ids inside the file come from a hash; without a salt of our own they differ from one time to the next
    with matplotlib.rc_context({"svg.hashsalt": "simbrake", "svg.fonttype": "path"}):
        figure.savefig(file, format="svg", metadata={"Date": None})
    return file.getvalue()


def png(figure: Figure, dpi: float) -> bytes:
    """The figure as a PNG."""
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=dpi, metadata={"Software": None})
    return file.getvalue()
