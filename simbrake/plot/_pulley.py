"""The pulley and what rubs on it, seen along the shaft: tension and load along the band, pads, shoes."""

import math
import textwrap
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Arc, FancyArrowPatch, Patch, Wedge
from matplotlib.ticker import MaxNLocator

from .._base._faults import Fault, InputError
from .._parts._scene import band_brake
from .._run._linings import WORDS, Contact, lining_contacts, look
from .._run._probe import Probe
from .._run._result import Result
from .._run._series import times_within
from ..brakes._band import AbstractStiffness, ParallelBands
from ..brakes._design import Brake
from ..brakes._pressed import DiscBrake, ShoeBrake
from ._shared import BLUE, GREEN, ORANGE, PURPLE, VERMILLION, one_run, span

#: colour of what a lining does; light for what sticks, so that numbers stay readable on all of them
CONTACT_COLOURS = {
    Contact.SLIDES: VERMILLION,
    Contact.AT_LIMIT: ORANGE,
    Contact.STICKS: "#9ecae1",
    Contact.SLIDES_BACK: PURPLE,
    Contact.FREE: "0.88",
}
#: radii in units of the drawn rim
RIM, LINING, BAND = 1.0, (1.02, 1.18), 1.21


def lining_edges(brake: Brake) -> np.ndarray:
    """Angles (n, 2) in rad at which each lining begins and ends, from the slack end on, gaps between them included.

    Of bands in parallel the first one; its gaps stand for all.
    """
    angle = np.asarray(brake.linings.angle, np.float64)
    stiffness: Any = brake.band.stiffness
    if isinstance(stiffness, ParallelBands):
        stiffness = stiffness.bands[0]
    gap = getattr(stiffness, "gap", 0.0) if isinstance(stiffness, AbstractStiffness) else 0.0
    gaps = np.broadcast_to(np.asarray(gap, np.float64), (angle.size - 1,))
    begin = np.append(0.0, np.cumsum(angle[:-1] + gaps))
    return np.stack([begin, begin + angle], axis=1)


def on_circle(edges: np.ndarray) -> np.ndarray:
    """Angles in the picture (rad, counter-clockwise from the right) of angles from the slack end on.

    The wrap is centred on the top. The pulley turns counter-clockwise: it runs onto the band at the right, the tight
    end, and off at the left.
    """
    wrap = float(np.max(edges))
    return math.pi / 2 + wrap / 2 - edges


def spot(radius: Any, angle: Any) -> Any:
    """Points (…, 2) at a radius and an angle."""
    return np.stack(np.broadcast_arrays(radius * np.cos(angle), radius * np.sin(angle)), axis=-1)


def draw_linings(axes: Axes, angles: np.ndarray, radii: tuple[float, float], gid: str) -> list[Wedge]:
    """A wedge for each lining between two radii, `angles` (n, 2) in the picture; coloured later."""
    wedges = []
    for begin, end in np.degrees(angles):
        wedge = Wedge((0, 0), radii[1], end, begin, width=radii[1] - radii[0], ec="white", lw=0.8, gid=gid, zorder=2)
        wedges.append(axes.add_patch(wedge))
    return wedges


def draw_band(axes: Axes, angles: np.ndarray, ends: tuple[str, str]) -> None:
    """The band with its two straight ends and what is written at them, slack end first."""
    first, last = angles[0, 0], angles[-1, 1]
    turn = np.linspace(first, last, 400)
    axes.plot(*spot(BAND, turn).T, color="0.25", lw=2.5, zorder=3)
    for angle, direction, words in ((first, 1.0, ends[0]), (last, -1.0, ends[1])):
        start = spot(BAND, angle)
        tangent: Any = direction * np.array([-math.sin(angle), math.cos(angle)])
        arrow = FancyArrowPatch(start, start + 0.5 * tangent, arrowstyle="-|>", mutation_scale=14, color="0.25", lw=2.5)
        axes.add_patch(arrow)
        axes.annotate(
            words,
            start + 0.52 * tangent,
            xytext=(0, -3),
            textcoords="offset points",
            ha="center",
            va="top",
            fontsize=9,
        )


def draw_rotation(axes: Axes, omega: float, radius: float) -> None:
    """An arrow round the centre in the sense of the rotation, with the speed."""
    if omega != 0.0:
        low, high = (-50.0, 230.0)
        axes.add_patch(Arc((0, 0), 2 * radius, 2 * radius, theta1=low, theta2=high, color="k", lw=1.4))
        tip, back = (high, high - 14) if omega > 0 else (low, low + 14)
        ends = [spot(radius, math.radians(a)) for a in (back, tip)]
        axes.add_patch(FancyArrowPatch(*ends, arrowstyle="-|>", mutation_scale=12, color="k", lw=1.4, gid="rotation"))
    words = f"ω\n{omega:.3g}\nrad/s" if omega != 0.0 else "at rest"
    axes.text(0, 0, words, ha="center", va="center", fontsize=8)


def contact_legend(found: list[np.ndarray], lining: str = "lining") -> list[Patch]:
    """Patches for the contacts that occur."""
    present = set(np.unique(np.concatenate([states.ravel() for states in found])).tolist())
    return [Patch(color=CONTACT_COLOURS[c], label=f"{lining} {words}") for c, words in WORDS.items() if c in present]


# --- along the band ---------------------------------------------------------------------------------------------------

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


# --- pads and shoes ---------------------------------------------------------------------------------------------------


def pressed(result: Result, time: float | int | None = None, *, figure: Figure | None = None) -> Figure:
    """Pads of a disc brake, or shoes of a double-shoe brake, at one time, with the pressure and the forces on them.

    Left the linings at their true angles and radii, coloured by what they do; right the pressure along a lining (MPa):
    of pads over the radius, of shoes over the angle from the pin.

    - `time` (s): default that of the greatest normal force; at an event the values after it

    Raises `InputError` for a time outside the run, for a batch of runs and for another kind of brake.
    """
    one_run(result)
    brake = result.scene.brake
    if not isinstance(brake, DiscBrake | ShoeBrake):
        hint = "draw it with `plot.pulley`" if brake.banded else "`plot.stop` and `plot.lining_map` show its forces"
        raise InputError([Fault("brake", f"is a {brake.words.brake}: this draws discs and drums", hint)])
    t, p = _pressed_moment(result, time)
    (states,), (pair,) = lining_contacts(result, p).values(), p.shown.pairs
    normal, friction = np.asarray(pair.normal)[0], np.asarray(pair.friction)[0]
    if figure is None:
        figure = Figure(figsize=(11.0, 5.8), layout="constrained")
    wheel, course = figure.subplots(1, 2, width_ratios=[1.3, 1])
    colours = [CONTACT_COLOURS[int(state)] for state in states[0]]  # pyright: ignore
    if isinstance(brake, DiscBrake):
        _disc(wheel, course, brake, normal, colours)
    else:
        _drum(wheel, course, brake, normal, colours)
    wheel.set_aspect("equal")
    wheel.axis("off")
    course.set_ylabel("pressure, MPa")
    course.set_ylim(bottom=0.0)
    course.grid(alpha=0.3)
    course.legend(loc="best", fontsize=8)
    lines = [
        f"{brake.words.lining} {i + 1}: N = {N / 1e3:.4g} kN, friction {F / 1e3:.4g} kN"
        for i, (N, F) in enumerate(zip(normal, friction, strict=True))
    ]
    shown = lines if len(lines) <= 4 else [*lines[:2], f"… {len(lines) - 3} more …", lines[-1]]
    wheel.text(0.5, -0.02, "\n".join(shown), transform=wheel.transAxes, ha="center", va="top", fontsize=9)
    force, torque = float(p.flows.slack_tension[0]) / 1e3, float(p.flows.brake_torque[0]) / 1e3
    figure.suptitle(
        f"{brake.words.brake} at t = {t:.6g} s: force of the actuator {force:.4g} kN, brake torque {torque:.4g} kN·m",
        fontsize=11,
    )
    draw_rotation(wheel, float(p.y.omega[0]), 0.2 * float(brake.radius))
    figure.legend(handles=contact_legend([states], brake.words.lining), loc="outside lower center", ncols=3, fontsize=8)
    return figure


def _pressed_moment(result: Result, time: float | int | None) -> tuple[float, Probe]:
    """The time to draw, and the run there."""
    if time is not None:
        t = float(times_within([time], *span(result), "time")[0])
        return t, look(result, t)
    t = float(result.report().peaks["max_normal_load"].time)
    after, before = look(result, t), look(result, t, left=True)
    # a force that jumps at an event is greatest on one side of it
    before_it, after_it = (float(np.max(p.shown.pairs[0].normal)) for p in (before, after))
    return t, before if before_it > after_it else after


def _disc(wheel: Axes, course: Axes, brake: DiscBrake, normal: np.ndarray, colours: list[str]) -> None:
    """Pads at their callipers, evenly around the disc; of the two faces the one in front."""
    pads = brake.linings
    inner, outer, angle = float(pads.inner_radius), float(pads.outer_radius), math.degrees(float(pads.angle))
    edge = 1.06 * outer
    wheel.add_patch(Wedge((0, 0), edge, 0, 360, width=edge - 0.9 * inner, color="0.85", zorder=1))
    callipers = -(-pads.count // 2)
    for i in range(callipers):
        middle = 90.0 + 360.0 * i / callipers
        place = {"theta1": middle - angle / 2, "theta2": middle + angle / 2, "width": outer - inner}
        wheel.add_patch(Wedge((0, 0), outer, fc=colours[2 * i], ec="0.3", gid="pad", zorder=2, **place))
        x, y = spot(0.5 * (inner + outer), math.radians(middle))
        words = ", ".join(str(k) for k in (2 * i + 1, 2 * i + 2) if k <= pads.count)
        wheel.text(x, y, words, ha="center", va="center", zorder=3)
    turn = np.linspace(0, 2 * math.pi, 200)
    wheel.plot(*spot(float(brake.radius), turn).T, color=BLUE, ls="--", lw=1.0, zorder=4)
    wheel.set_xlim(-1.1 * edge, 1.1 * edge)
    wheel.set_ylim(-1.1 * edge, 1.1 * edge)
    radius = np.linspace(inner, outer, 100)
    share = np.asarray(pads.pressure.share(radius, inner))
    highest = float(np.asarray(pads.greatest_pressure(normal.max())))
    course.plot(1e3 * radius, 1e-6 * highest * share, color=GREEN, label="pressure on a pad")
    mean = 1e-6 * float(normal.max()) / float(pads.area)
    course.axhline(mean, color="0.5", ls=":", label=f"mean {mean:.4g} MPa")
    effective = 1e3 * float(brake.radius)
    course.axvline(effective, color=BLUE, ls="--", label=f"effective radius {effective:.4g} mm")
    course.set_xlabel("radius, mm")


def _drum(wheel: Axes, course: Axes, brake: ShoeBrake, normal: np.ndarray, colours: list[str]) -> None:
    """Shoes with their pins at the bottom; left the leading one, as the drum turns counter-clockwise, to its pin."""
    shoes = brake.linings
    r, start, end = float(shoes.radius), float(shoes.start), float(shoes.end)
    wheel.add_patch(Wedge((0, 0), 1.08 * r, 0, 360, width=0.06 * r, color="0.75", zorder=1))
    theta = np.linspace(start, end, 200)
    top = float(np.max([brake.greatest_pressure(N) for N in normal])) or 1.0
    highest = math.sin(min(max(0.5 * math.pi, start), end))
    for i, (N, side) in enumerate(zip(normal, (-1.0, 1.0), strict=True)):
        # a pin a little beside the vertical through the shaft; angles count from it, up along the shoe's side
        pin = -0.5 * math.pi + side * 0.12
        ends = np.degrees(pin + side * np.array([start, end]))
        place = {"theta1": float(min(ends)), "theta2": float(max(ends)), "width": 0.1 * r}
        wheel.add_patch(Wedge((0, 0), 1.02 * r, fc=colours[i], ec="0.3", gid="shoe", zorder=2, **place))
        wheel.plot(*spot(float(brake.pin), pin), marker="o", ms=9, mfc="white", mec="0.2", zorder=4)
        p = float(brake.greatest_pressure(N)) * np.sin(theta) / highest
        line = spot(0.92 * r - 0.45 * r * p / top, pin + side * theta)
        base = spot(0.92 * r, pin + side * theta)
        wheel.fill(*np.concatenate([line, base[::-1]]).T, color=GREEN if i else BLUE, alpha=0.25, lw=0, gid="pressure")
        x, y = spot(0.97 * r, pin + side * 0.5 * (start + end))
        wheel.text(x, y, str(i + 1), ha="center", va="center", fontsize=9, zorder=5)
        words = "leading ahead" if i == 0 else "trailing ahead"
        course.plot(np.degrees(theta), 1e-6 * p, color=GREEN if i else BLUE, label=f"shoe {i + 1}, {words}")
    wheel.set_xlim(-1.15 * r, 1.15 * r)
    wheel.set_ylim(-1.15 * r, 1.15 * r)
    course.set_xlabel("angle from the pin, degrees")
