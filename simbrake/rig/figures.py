"""Figures of a rig's recording."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from .._base._arguments import explained
from .._base._numbers import scale
from ..plot.drawing import BLUE, GREEN, GREY, ORANGE, VERMILLION, finish, sheet, styled
from ._found import LOADS, Lowering
from ._ledger import Ledger
from ._replay import Comparison

#: colours of the kinds of load
_KINDS: dict[str, str] = dict(zip(LOADS, (ORANGE, GREEN, BLUE), strict=True))


@explained
@styled
def ledger(book: Ledger, *, figure: Figure | None = None) -> Figure:
    """Height of the block with its lowerings, and the work of the hook in each with its
    interval, by kind of load.

    Lowerings that are flagged, and in no total, have a colour of their own.

    Example:
        >>> figure = sb.rig.figures.ledger(book)
        >>> [axes.get_ylabel() for axes in figure.axes]
        ['height, m', 'work, MJ']
    """
    log = book.lowerings.log
    entries = [entry.lowering for entry in book.entries]
    figure = sheet(figure, 9.0, 2.3, rows=2, room=0.9)
    above, below = figure.subplots(2, 1, sharex=True)
    long = log.t[-1] > 7200.0
    unit, word = (3600.0, "h") if long else (1.0, "s")
    position = log.position
    above.plot(position.t / unit, position.value, color="0.6", lw=1.0)
    most = max(
        (
            abs(lowering.hook_work_high)
            for lowering in entries
            if np.isfinite(lowering.hook_work_high)
        ),
        default=0.0,
    )
    factor, _, name = scale("J", most)
    by_colour: dict[str, list[Lowering]] = {}
    for lowering in entries:
        by_colour.setdefault(
            VERMILLION if lowering.flags else _KINDS[lowering.kind], []
        ).append(lowering)
    for colour, alike in by_colour.items():
        # heights of all of them as one line, with a gap after each
        spans = [
            slice(
                *np.searchsorted(
                    position.t, (lowering.begin - 1e-6, lowering.end + 1e-6)
                )
            )
            for lowering in alike
        ]
        times, heights = (
            np.concatenate([np.append(x[span], np.nan) for span in spans])
            for x in (position.t / unit, position.value)
        )
        above.plot(times, heights, color=colour, lw=2.0)
        middle = (
            np.array([lowering.begin + 0.5 * lowering.duration for lowering in alike])
            / unit
        )
        low, work, high = (
            factor
            * np.array(
                [
                    (
                        lowering.hook_work_low,
                        lowering.hook_work,
                        lowering.hook_work_high,
                    )
                    for lowering in alike
                ]
            ).T
        )
        below.vlines(middle, 0.0, work, color=colour, lw=3.0, alpha=0.6)
        below.errorbar(
            middle, work, [work - low, high - work], fmt="none", ecolor=GREY, capsize=3
        )
    above.set_ylabel("height, m")
    below.set_ylabel(f"work, {name}")
    below.set_xlabel(f"time from the first row, {word}")
    below.set_ylim(min(0.0, below.get_ylim()[0]), None)
    finish((above, below))
    kinds = {lowering.kind for lowering in entries if not lowering.flags}
    shown = [
        Patch(color=colour, label=kind)
        for kind, colour in _KINDS.items()
        if kind in kinds
    ]
    if len(book.lowerings.valid) < len(entries):
        shown.append(Patch(color=VERMILLION, label="flagged"))
    figure.legend(handles=shown, loc="outside lower center", ncols=4, frameon=False)
    figure.suptitle(
        f"{len(book.lowerings.valid)} lowerings, work of the hook by {book.lowerings.interval_by}"
    )
    return figure


@explained
@styled
def replay(comparison: Comparison, *, figure: Figure | None = None) -> Figure:
    """Recorded and simulated height of the block and load of the hook, and
    temperatures.

    Spikes of the simulated load are the inertia of the load where the height of the log
    changes its speed at once; a gauge is too slow for them.

    Example:
        >>> figure = sb.rig.figures.replay(comparison)
        >>> [axes.get_ylabel() for axes in figure.axes]
        ['height, m', 'hook load, kN', 'temperature, °C']
    """
    result = comparison.replay.result
    end = float(result.record.t_end)
    unit, word = (3600.0, "h") if end > 7200.0 else (1.0, "s")
    hot = {
        "rim": "rim_temperature",
        "linings": "lining_temperature",
        "band": "band_temperature",
    }
    series = result.series(np.linspace(0.0, end, 2000))
    shown = {
        name: x
        for name, column in hot.items()
        if (x := getattr(series, column)) is not None
    }
    rows = 3 if shown else 2
    figure = sheet(figure, 9.0, 2.0, rows=rows, room=0.6)
    panels = figure.subplots(rows, 1, sharex=True)
    for axes, of, label, si in zip(
        panels,
        (comparison.position, comparison.load),
        ("height", "hook load"),
        ("m", "N"),
        strict=False,
    ):
        # in the unit of the log, of SI one for reading
        factor, name = 1 / of.factor, of.unit
        if of.factor == 1.0:
            factor, _, name = scale(si, np.nanmax(np.abs(of.recorded), initial=0.0))
        for x, how in (
            (of.recorded, {"color": "0.6", "lw": 2.0, "label": "recorded"}),
            (of.simulated, {"color": BLUE, "lw": 0.8, "label": "simulated"}),
        ):
            axes.plot(of.t / unit, factor * x, **how)
        axes.set_ylabel(f"{label}, {name}")
    factor, offset, degrees = scale("K", 0.0, absolute=True)
    for (name, x), colour in zip(
        shown.items(), (VERMILLION, ORANGE, GREEN), strict=False
    ):
        panels[2].plot(
            series.t / unit,
            factor * np.max(x, axis=1) + offset,
            color=colour,
            label=name,
        )
        panels[2].set_ylabel(f"temperature, {degrees}")
    panels[-1].set_xlabel(f"time from the first row, {word}")
    for axes in panels[1:]:
        axes.legend(loc="upper left", frameon=False)
    finish(panels)
    return figure
