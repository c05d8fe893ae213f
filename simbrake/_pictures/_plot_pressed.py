"""Pads on their disc and shoes in their drum, with the pressure and the forces on them."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Wedge

from .._base._faults import Fault, InputError
from .._parts._pressed import DiscBrake, ShoeBrake
from .._run._lining_view import lining_contacts, look
from .._run._probe import Probe
from .._run._result import Result
from .._run._series import times_within
from ._plot_shared import BLUE, GREEN, one_run, span
from ._plot_wheel import CONTACT_COLOURS, contact_legend, draw_rotation, spot


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
    t, p = _moment(result, time)
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


def _moment(result: Result, time: float | int | None) -> tuple[float, Probe]:
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
