"""Shared parts of figures: colours, marks at events, windows and grids of time, axes."""

import base64
import io
from collections.abc import Iterable
from typing import Literal, NamedTuple, TypeAlias

import jax
import matplotlib
import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from .._base._faults import Fault, InputError
from .._run._result import Result
from .._run._series import Series

Times: TypeAlias = Float[np.ndarray, " t"]  # s
Corner: TypeAlias = Literal["best", "upper left", "upper right", "lower right"]

ZERO = 273.15  # K

#: colours distinguishable with any colour vision (M. Okabe, K. Ito, *Color Universal Design*, 2008)
BLUE, SKY, GREEN, ORANGE, VERMILLION, PURPLE = "#0072B2", "#56B4E9", "#009E73", "#E69F00", "#D55E00", "#CC79A7"

#: events that change the state of a whole pair, with the colour and label of their line
MARKED = {
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


#: style of legends
SMALL = {"fontsize": 8, "framealpha": 0.9}


def sheet(figure: Figure | None, width: float, height: float) -> Figure:
    """The figure to draw into: the one given, or a new one of this size (inch)."""
    return Figure(figsize=(width, height), layout="constrained") if figure is None else figure


def one_run(result: Result) -> Result:
    """The result, if it is one run. Raises `InputError` for a batch of them."""
    if np.ndim(result.record.count) > 0:
        raise InputError([Fault("result", "is a batch of runs", "draw one of them: jax.tree.map(lambda x: x[0], …)")])
    return result


def span(result: Result) -> tuple[float, float]:
    """Start and end of a run (s)."""
    t = np.asarray(result.record.rows.t)
    return float(t[0]), float(t[int(result.record.count)])


class Window(NamedTuple):
    """A part of a run (s) that has a column of panels: all of it, or the onset of slip `enlarged`."""

    start: float
    end: float
    enlarged: bool = False

    @property
    def title(self) -> str:
        return "up to full slip, enlarged" if self.enlarged else "whole run"

    def label_time(self, axes: Axes) -> None:
        """Time in s, or in ms where a short time is enlarged."""
        milliseconds = self.enlarged and self.end - self.start < 0.5
        if milliseconds:
            axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{1e3 * x:g}"))
        axes.set_xlabel("time, ms" if milliseconds else "time, s")


def windows(result: Result) -> list[Window]:
    """The part of a run to be drawn, and the onset of slip where it is short.

    A run that ends at rest is cut shortly after its last stop; the onset reaches to the first full slip or lock.
    """
    start, end = span(result)
    events = result.events
    # oscillations after the stop, as of the linings of a chain, are no motion of the pulley
    moves = [e for e in events if e.name in MARKED]
    if moves and moves[-1].name == "stop" and moves[-1].time > start:
        end = min(end, start + 1.15 * (moves[-1].time - start))
    slip = next((e.time for e in events if e.name in ("full_slip", "external_lock") and e.time > start), end)
    short = slip - start < 0.25 * (end - start)
    return [Window(start, end), *([Window(start, start + 1.3 * (slip - start), enlarged=True)] if short else [])]


def marks(axes: Axes, result: Result, window: Window, *, named: bool, front: bool = False) -> None:
    """Vertical lines at events inside the window; names, staggered, in the topmost panel.

    `front`: the lines lie over what the panel shows, in white and black; many of them are ticks at its foot.
    """
    shown = [e for e in result.events if e.name in MARKED and window.start <= e.time <= window.end]
    few = len(shown) <= 12
    faint = 1.0 if len(shown) <= 40 else 0.3  # many stops: the lines must not hide the curves
    for i, event in enumerate(shown):
        colour, words = MARKED[event.name]
        if front:
            axes.axvline(event.time, ymax=1.0 if few else 0.03, color="black", lw=0.8)
            axes.axvline(event.time, ymax=1.0 if few else 0.03, color="white", lw=0.8, ls=(0, (4, 4)))
        else:
            axes.axvline(event.time, color=colour, lw=0.9 * faint, ls="--", zorder=0, alpha=faint)
        if named and few:
            right = event.time > window.start + 0.75 * (window.end - window.start)
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


def both_sides(result: Result, times: Times, events: Float[np.ndarray, " e"]) -> Series:
    """The series at times in order, and at those of events both before and after them."""
    after = result.series(np.union1d(times, events))
    if not events.size:
        return after
    before = result.series(events, left=True)
    order = np.argsort(np.concatenate([before.t, after.t]), kind="stable")
    return jax.tree.map(lambda a, b: np.concatenate([a, b])[order], before, after)


def dense_grid(result: Result, low: float, high: float) -> Series:
    """The series on a dense grid, with the values before and after every event in it."""
    inside = np.unique([e.time for e in result.events if low < e.time < high])
    return both_sides(result, cells(result, low, high), inside)


def cells(result: Result, low: float, high: float) -> Times:
    """Edges (s) of the cells of a map over time: even ones, events, and steps, which are dense during fast changes."""
    t = np.unique(np.asarray(result.record.rows.t)[: int(result.record.count) + 1])
    steps = t[(t > low) & (t < high)]
    events = [e.time for e in result.events if low < e.time < high]
    edges = np.unique(np.concatenate([np.linspace(low, high, 600), events, steps[:: 1 + len(steps) // 2400]]))
    # events that rounding keeps apart are one edge
    kept = np.append(True, np.diff(edges) > 1e-12 * (high - low))
    return edges[kept]


def finish(panels: Iterable[Axes], legend: Corner = "best") -> None:
    """Grids, and a legend where something has a name."""
    for panel in panels:
        panel.grid(alpha=0.3)
        if panel.get_legend_handles_labels()[0]:
            panel.legend(loc=legend, **SMALL)


#: a figure whose SVG is longer is a PNG instead (bytes)
_LONGEST = 400_000
_DPI = 170.0  # of PNGs: sharp in print over the width of a page


def data_uri(figure: Figure) -> str:
    """A figure for a page, the same for the same figure: SVG, or PNG where that is shorter to load."""
    kind, file = "svg+xml", io.BytesIO()
    # text drawn as paths, independent of fonts; ids from a hash with a fixed salt; no date
    with matplotlib.rc_context({"svg.hashsalt": "simbrake", "svg.fonttype": "path"}):
        figure.savefig(file, format="svg", metadata={"Date": None})
    if file.tell() > _LONGEST:
        kind, file = "png", io.BytesIO()
        figure.savefig(file, format="png", dpi=_DPI, metadata={"Software": None})
    return f"data:image/{kind};base64,{base64.b64encode(file.getvalue()).decode('ascii')}"
