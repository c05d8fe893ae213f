"""Pictures of one run: the stop, stages, contacts, temperatures."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from .._parts._design import BrakeWords
from .._run._lining_view import WORDS, Contact
from .._run._overlap import RunningIn, overlap
from .._run._result import Result
from ._plot_shared import BLUE, GREEN, ORANGE, VERMILLION, ZERO, dense_grid, finish, marks, time_axis, windows
from ._plot_wheel import CONTACT_COLOURS

_HOT = {"rim": VERMILLION, "linings": ORANGE, "band": BLUE, "linings, outer face": GREEN}


def stop(result: Result, *, figure: Figure | None = None) -> Figure:
    """Speed, torques, tensions or forces, and number of linings at their limit over time, the onset of slip enlarged.

    Left the whole motion (a run that goes on at rest is cut shortly after the stop), right the time up to full slip.
    """
    events = result.events
    start, end, zoom = windows(result)
    columns = 1 if zoom is None else 2
    if figure is None:
        figure = Figure(figsize=(11.5 if zoom else 7.5, 8.5), layout="constrained")
    axes = figure.subplots(4, columns, squeeze=False, sharex="col", width_ratios=[1.5, 1][:columns])
    for column, top in enumerate([end, zoom][:columns]):
        t, s = dense_grid(result, start, top, events)
        _panels(axes[:, column], t, s, result.scene.brake.words, compact=column == 1)
        for row in range(4):
            marks(axes[row, column], events, start, top, named=row == 0)
        time_axis(axes[3, column], milliseconds=column == 1 and bool(top - start < 0.5))
        axes[0, column].set_title("whole run" if column == 0 else "up to full slip, enlarged", fontsize=10)
    figure.suptitle(f"{result.status.replace('_', ' ')}: {result.message}", fontsize=11)
    return figure


_STAGES = {
    "stage_1": ("stage 1: band slides on the bandage", "tab:green"),
    "stage_2": ("stage 2: both pairs slide", "tab:orange"),
    "stage_3": ("stage 3: pulley slides in the bandage", "tab:blue"),
    "held": ("held", "tab:gray"),
    "open": ("open", "white"),
}


def stages(result: Result, *, running_in: RunningIn | None = None, figure: Figure | None = None) -> Figure:
    """Stages of a staged brake: speeds of pulley and bandage, torques and heat of both pairs, and their overlap
    coefficients (K, Fig. 5), stages shaded. Raises `ValueError` for a standard brake.
    """
    parts = result.stages
    start, end = parts[0].start, parts[-1].end
    if parts[-1].name == "held" and len(parts) > 1:
        end = min(end, start + 1.15 * (parts[-1].start - start))
    t, s = dense_grid(result, start, end, result.events)
    if figure is None:
        figure = Figure(figsize=(9.0, 11.0), layout="constrained")
    speed, torque, heat, outer, inner = figure.subplots(5, 1, sharex=True, height_ratios=[1.2, 1.2, 1, 0.7, 0.7])
    speed.plot(t, s.omega, color="k", label="pulley ω")
    speed.plot(t, s.bandage_speed, color="tab:green", ls="--", label="bandage ω_b")
    speed.set_ylabel("speed, rad/s")
    external, internal = s.pairs["external"], s.pairs["internal"]
    torque.plot(t, external.torque / 1e3, color="tab:green", label="band on bandage M_ext")
    torque.plot(t, internal.torque / 1e3, color="tab:blue", label="pulley on bandage Λ")
    torque.plot(t, internal.capacity / 1e3, color="tab:blue", ls=":", label="up to which it sticks M_int")
    torque.set_ylabel("torque, kN·m")
    heat.plot(t, external.heat / 1e3, color="tab:green", label="external pair")
    heat.plot(t, internal.heat / 1e3, color="tab:blue", label="internal pair")
    heat.set_ylabel("friction heat, kJ")
    o = overlap(result, t, running_in)
    shares = {outer: (o.external_dynamic, o.external_static), inner: (o.internal_dynamic, o.internal_static)}
    for panel, (dynamic, static) in shares.items():
        colour = "tab:green" if panel is outer else "tab:blue"
        panel.fill_between(t, dynamic, color=colour, alpha=0.7, lw=0, label="slides (dynamic)")
        panel.fill_between(t, static, facecolor="none", edgecolor=colour, hatch="///", lw=0, label="sticks (static)")
        panel.set_ylim(0, 1)
    outer.set_ylabel("external overlap")
    inner.set_ylabel("internal overlap")
    inner.set_xlabel("time, s")
    for stage in parts:
        middle = 0.5 * (stage.start + min(stage.end, end))
        if stage.name.startswith("stage_") and min(stage.end, end) - stage.start > 0.03 * (end - start):
            place = {"transform": speed.get_xaxis_transform(), "ha": "center", "va": "bottom"}
            speed.text(middle, 1.01, stage.name.replace("_", " "), fontsize=9, **place)
    for panel in (speed, torque, heat, outer, inner):
        named: set[str] = set()
        for stage in parts:
            words, colour = _STAGES[stage.name]
            label = words if panel is speed and stage.name not in named else None
            panel.axvspan(stage.start, min(stage.end, end), color=colour, alpha=0.12, lw=0, label=label)
            named.add(stage.name)
        panel.grid(alpha=0.3)
        panel.margins(x=0)
        panel.set_xlim(start, end)
        panel.legend(loc="best", fontsize=8, framealpha=0.9)
    figure.suptitle(f"stages of the brake — {result.status.replace('_', ' ')}: {result.message}", fontsize=11)
    return figure


def contacts(result: Result, *, figure: Figure | None = None) -> Figure:
    """Which linings stick and which slide, over time: of a chain on the pulley, of a resolved bandage on band and rim.

    Left the whole motion, right the time up to the first full slip, if it is short. Raises `ValueError` where the
    linings act as one.
    """
    modes: Any = result.record.modes
    if not modes.contacts:
        raise ValueError("the linings of this brake act as one: there are no single contacts to draw")
    n = int(result.record.count)
    t = np.asarray(result.record.rows.t)[: n + 1]
    _, end, zoom = windows(result)
    ends = [end] if zoom is None else [end, zoom]
    if figure is None:
        figure = Figure(figsize=(11.5, 1.2 + 3.2 * len(modes.contacts)), layout="constrained")
    axes = figure.subplots(len(modes.contacts), len(ends), squeeze=False, sharex="col")
    kinds = (Contact.SLIDES_BACK, Contact.STICKS, Contact.SLIDES)
    colours = ListedColormap([CONTACT_COLOURS[kind] for kind in kinds])
    pairs = result.scene.brake.pairs
    for row, ((pair, place), states) in enumerate(zip(pairs.items(), modes.contacts.values(), strict=True)):
        states, name = np.asarray(states)[: n + 1], place.words if len(pairs) == 1 else f"{place.words} ({pair})"
        changes = np.append(True, np.any(states[1:] != states[:-1], axis=1))
        edges = np.append(t[changes], t[-1])
        for column, end in enumerate(ends):
            panel = axes[row, column]
            linings = np.arange(states.shape[1] + 1) + 0.5
            panel.pcolormesh(edges, linings, states[changes].T, cmap=colours, vmin=-1, vmax=1)
            panel.set_xlim(t[0], end)
            panel.yaxis.set_major_locator(MaxNLocator(integer=True))
            panel.set_title(f"{name}{', enlarged' if column else ''}", fontsize=10)
            if column == 0:
                panel.set_ylabel("lining, from the slack end")
    for column in range(len(ends)):
        time_axis(axes[-1, column], milliseconds=column == 1 and bool(ends[1] - t[0] < 0.5))
    patches = [Patch(color=CONTACT_COLOURS[kind], label=WORDS[kind]) for kind in kinds]
    figure.legend(handles=patches, loc="outside lower center", ncols=3, fontsize=9)
    return figure


def temperatures(result: Result, *, figure: Figure | None = None) -> Figure:
    """Temperatures of rim, linings and band over time, the permissible one, and the hottest moment's depth profiles.

    Above the surfaces over time (linings with walls of their own: the coolest and the hottest), below the coefficient
    of friction that is left, and at the right the temperature through the depth of the walls when the rim, or the first
    place that the scene names, was hottest. Raises `ValueError` if the scene has no heat.
    """
    heat = result.scene.network
    if not result.scene.heated:
        raise ValueError("the scene has no heat: there are no temperatures to draw")
    # the steps of the run are dense where it heats quickly: a peak of one braking in hours is not lost
    rows = np.unique(np.asarray(result.record.rows.t)[: int(result.record.count) + 1])
    even = np.linspace(rows[0], rows[-1], 600)
    t = np.union1d(rows[:: 1 + len(rows) // 3000], even)
    s = result.series(t)
    surfaces = {"rim": s.rim_temperature, "linings": s.lining_temperature, "band": s.band_temperature}
    surfaces["linings, outer face"] = s.lining_outer_temperature
    shown = {name: np.asarray(T) - ZERO for name, T in surfaces.items() if T is not None}
    if not shown:
        shown = {"nodes": np.asarray(s.temperature) - ZERO}
    walls = heat.walls
    if figure is None:
        figure = Figure(figsize=(11.5 if walls else 7.5, 6.5), layout="constrained")
    axes = figure.subplots(2, 2 if walls else 1, squeeze=False, width_ratios=[1.6, 1][: 2 if walls else 1])
    brake = result.scene.brake
    own = {} if brake.banded else {"rim": brake.words.body, "linings": f"{brake.words.lining}s"}

    def called(place: str) -> str:
        return own.get(place, place)

    for name, T in shown.items():
        colour = _HOT.get(name, "tab:gray")
        # the rim broader, as the faces of linings are often as hot
        axes[0, 0].plot(
            t,
            T.max(axis=1),
            color=colour,
            lw=3.0 if name == "rim" else 1.3,
            label=called(name) if T.shape[1] == 1 else f"{called(name)}, hottest",
        )
        if T.shape[1] > 1:
            axes[0, 0].plot(t, T.min(axis=1), color=colour, ls=":", label=f"{called(name)}, coolest")
    if heat.permissible is not None:
        limit = float(np.asarray(heat.permissible)) - ZERO
        low, high = min(T.min() for T in shown.values()), max(T.max() for T in shown.values())
        if limit < high + 1.5 * (high - low):
            axes[0, 0].axhline(limit, color="k", lw=0.9, ls="--", label="permissible (linings)")
        else:
            axes[0, 0].plot([], [], " ", label=f"permissible (linings) {limit:g} °C, far above")
    axes[0, 0].set_ylabel("surface temperature, °C")
    for (name, pair), colour in zip(s.pairs.items(), ("tab:green", "tab:blue"), strict=False):
        if pair.friction_coefficient is None:
            continue
        f, words = np.asarray(pair.friction_coefficient), name if len(s.pairs) > 1 else "when sliding"
        axes[1, 0].plot(t, f.max(axis=1), color=colour, label=f"coefficient of friction, {words}")
        if np.ptp(f, axis=1).max() > 1e-9:
            axes[1, 0].plot(t, f.min(axis=1), color=colour, ls=":", label="of the lining with the least")
    low, high = axes[1, 0].get_ylim()
    if high - low < 0.12 * high:  # hardly changes: no axis of a few thousandths
        axes[1, 0].set_ylim(0.0, 1.25 * high)
    axes[1, 0].set_ylabel("coefficient of friction")
    axes[1, 0].set_xlabel("time, s")
    peaks = [peak for name, peak in result.report().peaks.items() if name.startswith("peak_")]
    hottest = float(peaks[0].time) if peaks else float(t[int(np.argmax(next(iter(shown.values())).max(axis=1)))])
    profiles = np.asarray(result.series([hottest]).temperature)[0] - ZERO
    for row, wall in enumerate(walls[:2]):
        _profile(axes[row, 1], result, wall, profiles, hottest)
    for row in range(len(walls[:2]), 2):
        if walls:
            axes[row, 1].axis("off")
    finish(axes.flat, "best")
    figure.suptitle("temperatures", fontsize=11)
    return figure


def _profile(axes: Axes, result: Result, wall: Any, T: np.ndarray, time: float) -> None:
    """Temperature over the depth of a wall, of all its copies."""
    here = [i for i, name in enumerate(result.nodes) if name.partition("[")[0] == wall.name]
    depth = 1e3 * np.asarray(wall.centres)
    for copy in range(wall.copies):
        axes.plot(depth, T[here][copy * wall.layers : (copy + 1) * wall.layers], color="tab:red", marker=".", lw=1.0)
    axes.set_title(f"through the {wall.name} at {time:.6g} s", fontsize=10)
    axes.set_xlabel("depth below the friction surface, mm")
    axes.set_ylabel("temperature, °C")


def _panels(axes: Any, t: np.ndarray, s: Any, words: BrakeWords, *, compact: bool) -> None:
    speed, torque, tension, linings = axes
    speed.plot(t, s.omega, color="k", label=f"{words.body} speed ω")
    if np.ptp(s.omega) <= 1e-6 * np.abs(s.omega).max():  # constant but for rounding, which is not worth a picture
        speed.set_ylim(sorted((0.0, 1.2 * float(s.omega[0]) or 1.0)))
    torque.plot(t, s.brake_torque / 1e3, color="tab:blue", label="brake M_b")
    torque.plot(t, s.load_torque / 1e3, color="tab:brown", ls="-.", label="load M_load")
    n = s.normal_load.shape[1]
    if s.lever_force is None:
        tension.plot(t, s.tight_tension / 1e3, color="tab:blue", label="tight end T_n")
        tension.plot(t, s.slack_tension / 1e3, color="tab:cyan", label="slack end T_0")
    else:
        tension.plot(t, s.lever_force / 1e3, color="tab:cyan", label="actuator F")
        for i in range(n if np.ptp(s.normal_load, axis=1).max() > 0 else 1):
            which = f" on {words.lining} {i + 1}" if np.ptp(s.normal_load, axis=1).max() > 0 else ""
            tension.plot(t, s.normal_load[:, i] / 1e3, ls="--", label=f"normal force N{which}")
    linings.plot(t, s.at_limit, color="tab:orange", drawstyle="steps-post", label=f"{words.lining}s at their limit k")
    linings.set_ylim(-0.5, n + 0.5)
    names = ("ω, rad/s", "torque, kN·m", "force, kN" if s.tension is None else "tension, kN", f"k of {n}")
    for panel, name in zip(axes, names, strict=True):
        panel.grid(alpha=0.3)
        panel.margins(x=0)
        if not compact:
            panel.set_ylabel(name)
            panel.legend(loc="best", fontsize=8, framealpha=0.9)
