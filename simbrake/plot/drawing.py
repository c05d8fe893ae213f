"""Shared parts of figures: style, titles, colours, marks at events, windows and grids
of time, legends."""

import base64
import contextlib
import functools
import io
import re
import textwrap
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextvars import ContextVar
from typing import Any, NamedTuple, ParamSpec, TypeAlias, TypeVar

import jax
import matplotlib
import numpy as np
from cycler import cycler
from jaxtyping import Float
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, MaxNLocator

from .._base._faults import Issues, input_error
from .._base._numbers import number
from .._base._quantity import as_number
from ..outputs.log import Event
from ..outputs.metrics import marks as known_marks
from ..outputs.quantities import Series, fault_of_times
from ..parts.scene import Scene
from ..runs.findings import lower, title_of
from ..runs.result import Result

Times: TypeAlias = Float[np.ndarray, " t"]  # s
P = ParamSpec("P")

#: colours distinguishable with any colour vision (M. Okabe, K. Ito, *Color Universal
#: Design*, 2008)
BLUE = "#0072B2"
SKY = "#56B4E9"
GREEN = "#009E73"
ORANGE = "#E69F00"
VERMILLION = "#D55E00"
PURPLE = "#CC79A7"

#: a grey that is dark on white paper, and can be seen on black
GREY = "0.4"
CYCLE = (BLUE, VERMILLION, GREEN, ORANGE, PURPLE, SKY, GREY, "0.7")

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
    "restart": (GREY, "restart"),
    "release": ("0.5", "release"),
}


def line_of(event: Event) -> tuple[str, str] | None:
    """Colour and label of the line at an event: of a whole pair, or of a mark of the
    whole brake; else `None`."""
    if event.name in MARKED or event.lining is not None:
        return MARKED.get(event.name)
    return next(
        ((GREY, mark.words) for mark in known_marks() if mark.event == event.name), None
    )


#: dashes of the lines at events, so that they differ without colours as well
_DASHES = {
    "slip_onset": ":",
    "full_slip": "--",
    "stop": "-.",
    "internal_slip": (0, (6, 2)),
    "external_lock": (0, (2, 2)),
}

#: size of every text (pt): 6 pt in a figure that is printed at half of its size
TEXT = 12.0
STYLE: Any = {  # (as rcParams)
    "font.size": TEXT,
    "axes.titlesize": TEXT,
    "figure.titlesize": TEXT,
    "axes.prop_cycle": cycler(color=CYCLE),
    "axes.formatter.useoffset": False,
    "legend.title_fontsize": TEXT,
}
# mean width of a letter, width of a line of the legend with its spaces, in sizes of
# text
_LETTER = 0.52
_HANDLE = 3.6
#: what a panel gains in width when the figure is laid out, after its legend is made
_WIDENED = 1.15


def ink() -> str:
    """What is black on white paper: the colour of texts in the style in force."""
    return matplotlib.rcParams["text.color"]


Drawing = TypeVar("Drawing", Figure, Axes)


def styled(draw: Callable[P, Drawing]) -> Callable[P, Drawing]:
    """A function that draws a panel or a sheet, with the style of all figures."""

    @functools.wraps(draw)
    def drawn(*args: P.args, **kwargs: P.kwargs) -> Drawing:
        with matplotlib.rc_context(STYLE):
            made = draw(*args, **kwargs)
        for axes in made.axes if isinstance(made, Figure) else [made]:
            keep_level(axes)
            # further ticks are made when the figure is written
            axes.tick_params(which="both", labelsize=TEXT)
        return made

    return drawn


def drawn_in(ax: Axes | None, width: float = 9.0, height: float = 3.2) -> Axes:
    """The axes to draw into: the given ones, or those of a new figure of this size
    (inch)."""
    return ax or sheet(None, width, height).subplots()


def keep_level(axes: Axes) -> None:
    """From 0 on where all values are equal to a thousandth: no axis of rounding
    errors."""
    low, high = axes.dataLim.intervaly
    if axes.get_autoscaley_on() and 0.0 <= high - low <= 1e-3 * abs(high):
        axes.set_ylim(*sorted((0.0, 1.2 * high or 1.0)))


_title: ContextVar[str] = ContextVar("title", default="")


@contextlib.contextmanager
def titled(title: str) -> Iterator[None]:
    """Figures of a run that are drawn inside begin with this title, others with the
    kind of the brake.

    Example:
        >>> with sb.plot.titled("stop of 20 t"):
        ...     figure = sb.plot.stop(result)
        >>> figure.get_suptitle().splitlines()[0]
        'stop of 20 t'
    """
    token = _title.set(title)
    try:
        yield
    finally:
        _title.reset(token)


def title_of_scene(scene: Scene) -> str:
    """The title in force, else the scene in words."""
    lining = scene.brake.words.lining
    n = scene.brake.linings.count
    start = (
        f"initial speed {number(scene.start_speed, 'rad/s')}"
        if float(scene.start_speed)
        else "from rest"
    )
    each = f" on each of {scene.brake.rims} rims" if scene.brake.rims > 1 else ""
    return (
        _title.get()
        or f"{scene.brake.kind}, {n} {lining}{'s' * (n > 1)}{each}, {start}"
    )


def head(figure: Figure, scene: Scene, words: str) -> None:
    """The title of a figure: its scene, and below what is shown."""
    figure.suptitle(_fill(figure, f"{title_of_scene(scene)}\n{words}"))


def _fill(figure: Figure, words: str) -> str:
    """Lines no longer than a figure is wide."""
    letters = int(figure.bbox.width / figure.dpi * 72 / (TEXT * _LETTER))
    return "\n".join(textwrap.fill(line, letters) for line in words.split("\n"))


def metric_words(name: str) -> str:
    """A metric in words, within a line."""
    return lower(title_of(name))


def sheet(
    figure: Figure | None,
    width: float,
    height: float,
    *,
    rows: int = 1,
    room: float = 0.0,
) -> Figure:
    """The figure to draw into: the one given, or a new one of this width, for `rows` of
    this height with `room` around them (inch)."""
    return (
        Figure(figsize=(width, room + rows * height), layout="constrained")
        if figure is None
        else figure
    )


def one_run(result: Result) -> Result:
    """The result, if it is one run. Raises `InputError` for a batch of them."""
    if np.ndim(result.record.count) > 0:
        raise input_error(
            "result",
            "is a batch of runs",
            "draw one of them: jax.tree.map(lambda x: x[0], …)",
        )
    return result


def span(result: Result) -> tuple[float, float]:
    """Start and end of a run (s)."""
    t = result.record.rows.t
    return float(t[0]), float(t[result.record.count])


def part_to_play(
    result: Result, start: float | None, end: float | None, issues: Issues
) -> tuple[float, float]:
    """Start and end (s) of the part of a run that a film shows, by default until
    shortly after its first stop; adds what is wrong with them."""
    first, last = span(result)
    stop = next(
        (e.time for e in result.events if e.name == "stop" and e.time > first), last
    )
    low = first if start is None else float(as_number(start))
    high = min(first + 1.15 * (stop - first), last)
    high = high if high > low else last
    high = high if end is None else float(as_number(end))
    for name, t in (("start", low), ("end", high)):
        issues += filter(None, [fault_of_times(np.asarray([t]), first, last, name)])
    if not issues and not low < high:
        what = f"{high:g} s is not after the start at {low:g} s"
        issues.add("end", what, "it must be later")
    return max(low, first), min(high, last)


class Window(NamedTuple):
    """A part of a run (s) that has a column of panels: all of it, or the onset of slip
    `enlarged`."""

    start: float
    end: float
    enlarged: bool = False
    title: str = "whole run"

    def label_time(self, axes: Axes) -> None:
        """Time in s, or in ms where a short time is enlarged."""
        # longer numbers are in s
        milliseconds = self.enlarged and self.end - self.start < 0.5 and self.end < 10.0
        if milliseconds:
            axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{1e3 * x:g}"))
        if self.start > 9 * (self.end - self.start):  # long numbers
            axes.xaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
        axes.set_xlabel("time, ms" if milliseconds else "time, s")


def windows(result: Result) -> list[Window]:
    """The part of a run to be drawn, and the onset of slip where it is short, but not
    at once.

    A run that ends at rest is cut shortly after its last stop; the onset reaches to the
    first full slip or lock.
    """
    start, end = span(result)
    events = result.events
    # oscillations after the stop, as of the linings of a chain, are no motion of the
    # pulley
    moves = [e for e in events if e.name in MARKED]
    if moves and moves[-1].name == "stop" and moves[-1].time > start:
        end = min(end, start + 1.15 * (moves[-1].time - start))
    slip = next(
        (
            e.time
            for e in events
            if e.name in ("full_slip", "external_lock") and e.time > start
        ),
        end,
    )
    begin = max(
        (e.time for e in events if e.name == "slip_onset" and e.time <= slip),
        default=start,
    )
    took = slip - (start if begin - start < slip - begin else begin)
    onset = Window(
        max(slip - 1.3 * took, start),
        slip + 0.3 * took,
        True,
        "up to full slip, enlarged",
    )
    whole = Window(
        start, end, title="whole run" if end == span(result)[1] else "until rest"
    )
    return (
        [whole, onset]
        if 1e-6 * (end - start) < took < 0.25 * (end - start)
        else [whole]
    )


def strong_applications(result: Result) -> Times:
    """When the brake applications begin (s) that give at least a third of the friction
    heat of the strongest one."""
    stops = result.stops.frame()
    strong = 3 * stops["energy"] >= stops["energy"].max()
    return (stops["time"] - stops["motion_time"])[strong].to_numpy(float)


def application(
    result: Result, time: float, title: str, cooling: float = 4.0
) -> list[Window]:
    """Of a run with several stops the brake application that holds a time, and its
    cooling, so many times as long; else nothing."""
    table = result.stops
    if len(table) < 2:
        return []
    stops = np.asarray(table["time"])
    (first, last) = span(result)
    i = min(int(np.searchsorted(stops, time, side="left")), len(stops) - 1)
    # hottest after a stop, before the next motion
    i -= i > 0 and time < stops[i] - table["motion_time"][i]
    braked = max(table["braking_time"][i], time - stops[i])
    end = min(stops[i] + cooling * braked, last)
    return [
        Window(max(stops[i] - 1.2 * table["braking_time"][i], first), end, title=title)
    ]


def marks(
    axes: Axes, result: Result, window: Window, *, front: bool = False
) -> list[Event]:
    """Vertical lines at events inside the window, none on its left side; returns these
    events.

    `front`: the lines lie over a map, on white; none where they are many.
    """
    lines = [
        (e, line_of(e)) for e in result.events if window.start < e.time <= window.end
    ]
    shown = [(event, line[0]) for event, line in lines if line is not None]
    if front and len(shown) > 12:
        return []
    # many stops: the lines must not hide the curves
    faint = 1.0 if len(shown) <= 40 else 0.3
    for event, colour in shown:
        look: dict[str, Any] = {
            "color": colour,
            "ls": _DASHES.get(event.name, (0, (4, 2))),
        }
        if front:
            axes.axvline(event.time, color="white", lw=2.6)
            axes.axvline(event.time, lw=1.4, **look)
        else:
            axes.axvline(event.time, lw=1.1 * faint, zorder=0, alpha=faint, **look)
    return [event for event, _ in shown]


def words_of_mark(words: str) -> str:
    """The label of a line at an event as a legend writes it."""
    return words.replace("t₀", "$t_0$").replace("t₁", "$t_1$")


def name_marks(
    figure: Figure,
    others: Iterable[Artist] = (),
    events: Iterable[Event] = (),
    rule: str = "",
) -> None:
    """Below the panels what the lines at events mean, after `others`; above them a
    `rule` to read the figure."""
    handles = list(others)
    for name, line in {event.name: line_of(event) for event in events}.items():
        assert line is not None
        handles.append(
            Line2D(
                [],
                [],
                label=words_of_mark(line[1]),
                color=line[0],
                ls=_DASHES.get(name, (0, (4, 2))),
            )
        )
    if handles or rule:
        place = _in_columns(
            figure.bbox.width / figure.dpi, [h.get_label() for h in handles]
        )
        figure.legend(
            handles=handles,
            title=_fill(figure, rule) or None,
            loc="outside lower center",
            **place,
        )


def both_sides(result: Result, times: Times, events: Float[np.ndarray, " e"]) -> Series:
    """The series at times in order, and at those of events both before and after
    them."""
    after = result.series(np.union1d(times, events))
    if not events.size:
        return after
    before = result.series(events, left=True)
    order = np.argsort(np.concatenate([before.t, after.t]), kind="stable")
    return jax.tree.map(lambda a, b: np.concatenate([a, b])[order], before, after)


def dense_grid(result: Result, low: float, high: float) -> Series:
    """The series on a dense grid, with the values before and after every event in
    it."""
    inside = np.unique([e.time for e in result.events if low < e.time < high])
    return both_sides(result, cells(result, low, high), inside)


def cells(result: Result, low: float, high: float) -> Times:
    """Edges (s) of the cells of a map over time: even ones, events, and steps, which
    are dense during fast changes."""
    t = np.unique(result.record.rows.t[: result.record.count + 1])
    steps = t[(t > low) & (t < high)]
    events = [e.time for e in result.events if low < e.time < high]
    edges = np.unique(
        np.concatenate(
            [np.linspace(low, high, 600), events, steps[:: 1 + len(steps) // 2400]]
        )
    )
    # events that rounding keeps apart are one edge
    kept = np.append(True, np.diff(edges) > 1e-12 * (high - low))
    return edges[kept]


def _in_columns(width: float, labels: Iterable[Any]) -> dict[str, Any]:
    """Settings of a legend with as many columns as fit into a width (inch)."""
    longest = max(
        len(re.sub(r"\\\w+|[${}_^]", "", str(label))) for label in (*labels, "")
    )
    columns = int(72 * width / (TEXT * (_LETTER * longest + _HANDLE)))
    return {
        "ncols": max(1, columns),
        "frameon": False,
        "borderpad": 0.2,
        "labelspacing": 0.3,
        "handlelength": 1.9,
    }


def finish(
    panels: Iterable[Axes], handles: Sequence[Artist] = (), rule: str = ""
) -> None:
    """Grids, and where something has a name a legend in lines above the panel, so that
    it covers nothing.

    - `handles`: what the legend names; default what has a label in the panel
    - `rule`: how to read the panel, above the legend
    """
    for panel in panels:
        panel.grid(alpha=0.3)
        found, labels = panel.get_legend_handles_labels()
        if handles:
            found = list(handles)
            labels = [handle.get_label() for handle in handles]
        if not labels:
            continue
        share = _WIDENED * panel.get_position().width
        width = share * panel.figure.bbox.width / panel.figure.dpi
        place = _in_columns(width, labels)
        place["ncols"] = min(place["ncols"], len(labels))
        place |= {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0)}
        panel.legend(found, labels, title=rule or None, borderaxespad=0.1, **place)  # pyright: ignore
        for side in ("left", "center"):
            words = panel.get_title(side)
            if words:
                panel.set_title(words, loc=side, pad=above_legend(panel))


def above_legend(panel: Axes) -> float:
    """Distance (points) of a title from a panel with a legend above it."""
    legend = panel.get_legend()
    assert legend is not None
    height = legend.get_window_extent().height  # pixels
    return 6.0 + 72 * height / panel.figure.dpi


#: a figure whose SVG is longer is a PNG instead (bytes)
_LONGEST = 400_000
_DPI = 170.0  # of PNGs: sharp in print over the width of a page
#: colours of pages on a dark screen
_DARK_PAPER = "#12181f"
_LIGHT_INK = "#e4e9f0"
_LIGHT_GREEN = "#2cc498"


def data_uri(figure: Figure) -> str:
    """A figure for a page, the same for the same figure: SVG, on a dark screen a dark
    one, or PNG where that is shorter to load."""
    kind = "svg+xml"
    file = io.BytesIO()
    # text drawn as paths, independent of fonts; ids from a hash with a fixed salt; no
    # date
    with matplotlib.rc_context({"svg.hashsalt": "simbrake", "svg.fonttype": "path"}):
        figure.savefig(file, format="svg", metadata={"Date": None})
    content = _dark_too(file.getvalue().decode()).encode()
    if len(content) > _LONGEST:
        kind = "png"
        file = io.BytesIO()
        figure.savefig(file, format="png", dpi=_DPI, metadata={"Software": None})
        content = file.getvalue()
    return f"data:image/{kind};base64,{base64.b64encode(content).decode('ascii')}"


def _dark_too(svg: str) -> str:
    """An SVG of Matplotlib with rules for dark screens: paper dark, dark greys light,
    blue and green lighter."""
    dark = {"#ffffff": _DARK_PAPER, BLUE.lower(): SKY, GREEN.lower(): _LIGHT_GREEN}
    # (text that is black has no colour of its own)
    rules = [f"svg {{ fill: {_LIGHT_INK}; }}"]
    for kind, colour in sorted(
        set(re.findall(r"(stroke|fill): (#[0-9a-f]{6})\b", svg))
    ):
        red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
        grey = max(red, green, blue) - min(red, green, blue) < 6
        other = dark.get(colour) or (
            f"#{3 * f'{235 - red:02x}'}" if grey and red < 120 else None
        )
        # (white is the paper as an area; as a line or a text it stands on a map)
        where = "path" if colour == "#ffffff" else ""
        if other is not None and (kind, colour) != ("stroke", "#ffffff"):
            rules.append(
                f'{where}[style*="{kind}: {colour}"] {{ {kind}: {other} !important; }}'
            )
    style = f"<style>@media screen and (prefers-color-scheme: dark) {{ {' '.join(rules)} }}</style>"
    return re.sub(r"(<svg [^>]*>)", rf"\1{style}", svg, count=1)
