"""Wear along the band over the life of the linings."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from ..studies._lining_life import LiningLife
from ._plot_shared import BLUE, GREEN, ORANGE, PURPLE, VERMILLION

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
