"""Tension and normal load along the band, drawn on the pulley's circle (Z, Fig. 5)."""

import math
import textwrap
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Wedge
from matplotlib.ticker import MaxNLocator

from .._parts._scene import band_brake
from .._run._lining_view import Contact, lining_contacts, look
from .._run._result import Result
from .._run._series import times_within
from ._plot_shared import BLUE, GREEN, one_run, span
from ._plot_wheel import (
    CONTACT_COLOURS,
    LINING,
    RIM,
    contact_legend,
    draw_band,
    draw_linings,
    draw_rotation,
    lining_edges,
    on_circle,
    spot,
)

_TENSION, _LOAD = (1.30, 0.72), (0.72, -0.44)  # where the scales begin, and their length; of the load inwards


def pulley(result: Result, time: float | int | None = None, *, figure: Figure | None = None) -> Figure:
    """Tension of the band and normal load of every lining on the pulley's circle at one time (Z, Fig. 5).

    Outwards the tension `T_0…T_n` (kN) at the ends of each lining, joined by a line to guide the eye; inwards the
    normal load `N_i` (kN) of each lining. Linings at their true angles, coloured by what they do. Of a staged brake the
    outer half of a lining stands for the band on it, the inner half for the lining on the rim, whose load has an
    outline.

    - `time` (s): default that of the greatest tension; at an event the values after it

    Raises `InputError` for a time outside the run, for a batch of runs and for a brake without a band (`pressed`).
    """
    one_run(result)
    band_brake(result.scene)
    time, why, p = _moment(result, time)
    pairs = lining_contacts(result, p)
    edges = lining_edges(band_brake(result.scene))
    angles = on_circle(edges)
    tension = np.append(float(p.flows.slack_tension[0]), np.asarray(p.shown.tension)[0]) / 1e3
    loads = [np.asarray(pair.normal)[0] / 1e3 for pair in p.shown.pairs]
    if figure is None:
        figure = Figure(figsize=(9.0, 9.4), layout="constrained")
    axes = figure.subplots()
    axes.add_patch(Wedge((0, 0), RIM, 0, 360, width=0.06, color="0.6", zorder=1))
    halves = np.linspace(*LINING, len(pairs) + 1)
    for (pair, states), low, high in zip(pairs.items(), halves[::-1][1:], halves[::-1], strict=False):
        for wedge, state in zip(draw_linings(axes, angles, (low, high), pair), states[0], strict=True):
            wedge.set_facecolor(CONTACT_COLOURS[int(state)])  # pyright: ignore
    for i, angle in enumerate(angles.mean(axis=1)):
        x, y = spot(np.mean(halves[-2:]), angle)
        axes.text(x, y, str(i + 1), ha="center", va="center", fontsize=7, zorder=4)
    _draw_tension(axes, tension, angles)
    _draw_load(axes, loads, angles)
    reverse = tension[-1] < tension[0]
    names = ("lever end, now tight", "anchor end, now slack") if reverse else ("slack end", "tight end")
    draw_band(
        axes,
        angles,
        (f"{names[0]} (lever)\nT₀ = {tension[0]:.4g} kN", f"{names[1]} (anchor)\nTₙ = {tension[-1]:.4g} kN"),
    )
    draw_rotation(axes, float(p.y.omega[0]), 0.2)
    axes.set_aspect("equal")
    axes.set_xlim(-2.25, 2.25)
    axes.set_ylim(-1.85, 2.15)
    axes.axis("off")
    torque = float(p.flows.brake_torque[0]) / 1e3
    title = f"tension of the band and normal load of the linings at t = {time:.6g} s{why}"
    title = f"{title}\nbrake torque {torque:.4g} kN·m"
    under_band = next(iter(pairs.values()))
    if np.any((under_band == Contact.STICKS) | (under_band == Contact.AT_LIMIT)):
        distribution = result.record.system.mechanism.distribution  # pyright: ignore
        title += "\n" + textwrap.fill(f"how linings that stick share it: {distribution}", 100)
    figure.suptitle(title, fontsize=10)
    handles: list[Any] = [
        Line2D([], [], color=BLUE, marker="o", ms=3, label="tension T of the band, kN, outwards"),
        Patch(color=GREEN, alpha=0.75, label="normal load N of a lining, kN, inwards"),
    ]
    if len(pairs) > 1:
        handles.append(Patch(fill=False, ec="0.3", label="load of a lining on the rim, preload included, kN"))
    handles += contact_legend(list(pairs.values()))
    title = "outer half of a lining: band on lining; inner half: lining on rim" if len(pairs) > 1 else None
    figure.legend(handles=handles, loc="outside lower center", ncols=2, fontsize=8, title=title, title_fontsize=8)
    return figure


def _moment(result: Result, time: float | int | None) -> tuple[float, str, Any]:
    """The time to draw, why it is that one, and the run there."""
    start, end = span(result)
    if time is not None:
        t = float(times_within([time], start, end, "time")[0])
        return t, "", look(result, t)
    t = float(result.report().peaks["max_tension"].time)
    after, before = look(result, t), look(result, t, left=True)
    # a tension that jumps at an event is greatest on one side of it
    drops = np.max(before.shown.tension) > np.max(after.shown.tension)
    return t, ", when the tension is greatest", before if drops else after


def _rings(axes: Axes, top: float, count: int, scale: tuple[float, float], angles: np.ndarray, gid: str) -> float:
    """Arcs of a scale with their values; returns the value at its far end."""
    top = top if top > 0 else 1.0
    ticks = [x for x in MaxNLocator(count, steps=[1, 2, 2.5, 5, 10]).tick_values(0.0, top) if 0 <= x <= top * 1.0001]
    turn = np.linspace(angles[0, 0], angles[-1, 1], 300)
    for value in ticks:
        radius = scale[0] + scale[1] * value / top
        axes.plot(*spot(radius, turn).T, color="0.85", lw=0.7, zorder=0)
        # outside of the wrap, at its slack end, where the curve is low
        x, y = spot(radius, turn[0] + 0.05 / radius)
        axes.text(
            x,
            y,
            f"{value:g} kN" if value == ticks[-1] else f"{value:g}",
            fontsize=6.5,
            color="0.35",
            ha="left" if scale[1] < 0 else "right",
            va="top",
            rotation=math.degrees(turn[0]) - 180.0,
            rotation_mode="anchor",
            gid=gid,
        )
    return top


def _radial(axes: Axes, radius: float, angle: float, words: str, *, outwards: bool, gid: str, colour: str) -> None:
    """A number written along the radius, always readable from below or the side."""
    degrees = math.degrees(angle) % 360
    flipped = 90 < degrees < 270
    side = "left" if outwards != flipped else "right"
    x, y = spot(radius, angle)
    axes.text(
        x,
        y,
        words,
        fontsize=7,
        ha=side,
        va="center",
        rotation=degrees - 180 if flipped else degrees,
        rotation_mode="anchor",
        color=colour,
        gid=gid,
        zorder=5,
    )


def _draw_tension(axes: Axes, tension: np.ndarray, angles: np.ndarray) -> None:
    top = _rings(axes, float(tension.max()), 4, _TENSION, angles, "tension scale")
    radius = _TENSION[0] + _TENSION[1] * tension / top
    # both ends of each lining: over a gap the tension stays
    turn, r = angles.ravel(), np.stack([radius[:-1], radius[1:]], axis=1).ravel()
    axes.fill(*np.concatenate([spot(r, turn), spot(_TENSION[0], turn)[::-1]]).T, color=BLUE, alpha=0.12, lw=0, zorder=1)
    axes.plot(*spot(r, turn).T, color=BLUE, marker="o", ms=3, lw=1.2, gid="tension", zorder=4)
    step = -(-len(angles) // 30)
    for i, angle in enumerate(np.append(angles[:, 0], angles[-1, 1])):
        axes.plot(*spot(np.array([_TENSION[0], radius[i]]), angle).T, color=BLUE, lw=0.7, zorder=3)
        if i % step == 0 or i == len(angles):
            words = f"{tension[i]:.3g}" if tension[i] < 1000 else f"{tension[i]:.0f}"
            _radial(axes, radius[i] + 0.04, angle, words, outwards=True, gid="T", colour=BLUE)


def _draw_load(axes: Axes, loads: list[np.ndarray], angles: np.ndarray) -> None:
    """Loads of the linings inwards: filled those of the first friction pair, as outlines those of the others."""
    load, *others = loads
    top = _rings(axes, max(float(each.max()) for each in loads), 3, _LOAD, angles, "load scale")
    step = -(-len(angles) // 30)
    for i, (begin, end) in enumerate(np.degrees(angles)):
        middle, width = (begin + end) / 2, 0.36 * (begin - end)
        depth = -_LOAD[1] * load[i] / top
        place = {"theta1": middle - width, "theta2": middle + width}
        axes.add_patch(Wedge((0, 0), _LOAD[0], width=depth, fc=GREEN, alpha=0.75, gid="load", zorder=2, **place))
        for other in others:
            depth = -_LOAD[1] * other[i] / top
            axes.add_patch(Wedge((0, 0), _LOAD[0], width=depth, fill=False, ec="0.3", lw=0.7, gid="rim load", **place))
        if i % step == 0:
            _radial(axes, 0.92, math.radians(middle), f"{load[i]:.3g}", outwards=False, gid="N", colour="#00604a")
