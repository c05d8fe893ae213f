"""Figures of one run over time: lever and load, the stop, stages, contacts,
temperatures, maps."""

import re
from collections.abc import Iterable
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from .._base._faults import input_error
from .._base._table import digits, number
from ..brakes.design import BrakeWords
from ..loads import AbstractString
from ..outputs.log import Event
from ..outputs.quantities import LINING_QUANTITIES, Series
from ..runs.linings import (
    HEAT,
    VIEW_OF_HEAT,
    WORDS,
    Contact,
    RunningIn,
    lining_values,
    overlap,
)
from ..runs.result import Result
from ..thermal.network import Wall, place_of
from .drawing import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    TEXT,
    VERMILLION,
    ZERO,
    Times,
    Window,
    application,
    cells,
    dense_grid,
    finish,
    head,
    ink,
    keep_level,
    marks,
    name_marks,
    one_run,
    sheet,
    span,
    strong_applications,
    styled,
    windows,
)
from .wheels import CONTACT_COLOURS


@styled
def duty(result: Result, *, figure: Figure | None = None) -> Figure:
    """Slack tension or force that the lever gives, torques of the load and of a motor
    over the whole run, with the mass on the hook below where it changes.

    Example:
        >>> figure = sb.plot.duty(result)
        >>> [axes.get_ylabel() for axes in figure.axes]
        ['tension, kN', 'torque, kN·m']
    """
    start, end = span(result)
    s = dense_grid(result, start, end)
    load = result.scene.duty.load
    banded = result.scene.brake.banded
    rows = 3 if isinstance(load, AbstractString) else 2
    figure = sheet(figure, 9.0, 2.2, rows=rows, room=0.9)
    panels = figure.subplots(rows, 1, sharex=True)
    lever = s.slack_tension if banded else s.lever_force
    words = "slack tension $T_0$" if banded else "force of the actuator $F$"
    panels[0].plot(s.t, np.asarray(lever) / 1e3, color=BLUE, label=words)
    panels[0].set_ylabel("tension, kN" if banded else "force, kN")
    panels[1].plot(
        s.t, s.load_torque / 1e3, color=VERMILLION, label="load torque on the shaft"
    )
    if s.motor_torque is not None:
        panels[1].plot(
            s.t, s.motor_torque / 1e3, color=GREEN, ls="--", label="motor $M$"
        )
    panels[1].set_ylabel("torque, kN·m")
    if isinstance(load, AbstractString):
        weight = np.asarray(s.load_torque) + float(load.drag) * np.asarray(s.omega)
        mass = weight / float(load.gravity * load.travel())
        swings = load.elasticity is not None
        words = "hook load over gravity" if swings else "mass on the hook"
        panels[2].step(s.t, mass / 1e3, where="post", color=PURPLE, label=words)
        panels[2].set_ylabel("mass, t")
    finish(panels)
    for panel in panels:
        panel.set(xlim=(start, end), ylim=(min(0.0, panel.get_ylim()[0]), None))
    panels[-1].set_xlabel("time, s")
    name_marks(figure, [], rule=result.scene.brake.force_words)
    head(figure, result.scene, "lever and load" if banded else "actuator and load")
    return figure


# --- the stop, stages, contacts, temperatures ---------------------------------------

_HOT = {
    "rim": VERMILLION,
    "linings": ORANGE,
    "band": BLUE,
    "linings, outer face": GREEN,
}
_HOT |= {"wetted wall": PURPLE, "coolant, outlet": SKY}


@styled
def stop(result: Result, *, figure: Figure | None = None) -> Figure:
    """Speed of the pulley and of the hook, torques of brake, load and motor, tensions
    at the two ends of the band or forces on the linings, and number of linings at their
    friction limit over time.

    Left the whole motion (a run that continues at rest is cut shortly after the stop),
    right the time from the onset of slip to full slip, if it is short, or of several
    stops the one with the maximum friction heat. Dashed lines are events.

    Example:
        >>> figure = sb.plot.stop(result)
        >>> float(figure.axes[0].lines[0].get_ydata()[0])
        24.0
    """
    columns = windows(result)
    marked = list[Event]()
    if len(result.stops) > 1:
        strongest = float(result.stops["time"][int(np.argmax(result.stops["energy"]))])
        columns = [
            columns[0],
            *application(
                result, strongest, "the stop with the maximum friction heat", 0.3
            ),
        ]
    figure = sheet(figure, 11.5 if len(columns) > 1 else 8.0, 9.6)
    axes = figure.subplots(
        4,
        len(columns),
        squeeze=False,
        sharex="col",
        width_ratios=[1.5, 1][: len(columns)],
    )
    for panels, window in zip(axes.T, columns, strict=True):
        _panels(
            panels,
            dense_grid(result, window.start, window.end),
            result.scene.brake.words,
        )
        for panel in panels:
            panel.grid(alpha=0.3)
            panel.margins(x=0)
            marked += marks(panel, result, window)
            panel.set_ylabel("" if window is not columns[0] else panel.get_ylabel())
        window.label_time(panels[-1])
        panels[0].set_title(
            window.title, pad=6.0 + 1.35 * TEXT
        )  # beside the legend of the other column
    finish(axes[:, 0])
    name_marks(figure, marked, rule=result.scene.brake.force_words)
    head(figure, result.scene, f"{result.status.replace('_', ' ')}: {result.message}")
    return figure


@styled
def stops(result: Result, *, figure: Figure | None = None) -> Figure:
    """One point for each stop of the run: duration of the braking, friction heat, and
    the highest temperatures of rim, linings and band until the next restart. Stops by a
    motor alone are left out.

    Example:
        >>> figure = sb.plot.stops(result)
        >>> figure.axes[-1].get_xlabel()
        'number of the stop'
    """
    table = result.stops
    if not len(table):
        raise input_error("result", "has no stop", "a run in which the pulley stops")
    names = [column.name for column in table.columns]
    every = np.asarray(table["braking_time"])
    shown = (every > 0) | ~np.any(every > 0)
    hot = [name for name in names if name.startswith("peak_")]
    figure = sheet(figure, 8.5, 7.6 if hot else 5.4)
    panels = figure.subplots(3 if hot else 2, 1, sharex=True)
    number = np.asarray(table["stop"])[shown]
    panels[0].plot(number, every[shown], "o-", ms=3, color=BLUE, label="contact time")
    panels[0].set_ylabel("time, s")
    panels[1].plot(
        number,
        np.asarray(table["energy"])[shown] / 1e3,
        "o-",
        ms=3,
        color=VERMILLION,
        label="friction heat",
    )
    panels[1].set_ylabel("heat, kJ")
    for name in hot:
        place = (
            name.removeprefix("peak_")
            .removesuffix("_temperature")
            .replace("lining", "linings")
        )
        T = np.asarray(table[name])[shown] - ZERO
        panels[2].plot(
            number, T, "o-", ms=3, color=_HOT[place], label=f"hottest {place}"
        )
    if hot:
        panels[2].set_ylabel("temperature, °C")
    finish(panels)
    panels[-1].xaxis.set_major_locator(MaxNLocator(integer=True))
    panels[-1].set_xlabel("number of the stop")
    head(
        figure,
        result.scene,
        "the stops of the run"
        if np.all(shown)
        else "the stops of the run by the brake",
    )
    return figure


def _panels(panels: Iterable[Axes], s: Series, words: BrakeWords) -> None:
    """Speed, torques, tensions or forces, and linings at their limit."""
    speed, torque, tension, linings = panels
    way = "" if s.motor_torque is None else ", below 0 upwards"
    speed.plot(
        s.t, s.omega, color=ink(), label=rf"speed of the {words.body} $\omega${way}"
    )
    speed.set_ylabel(r"$\omega$, rad/s")
    if s.hook_speed is not None and np.any(s.omega):
        keep_level(speed)
        hook = speed.twinx()
        hook.plot(s.t, s.hook_speed, color=SKY, ls="--")
        speed.plot([], [], color=SKY, ls="--", label="speed of the hook $v$")
        # in the scale of the fast line, on the curve of the pulley where the rope is
        # rigid and in one layer
        ratio = float(np.abs(s.hook_speed).max() / np.abs(s.omega).max())
        hook.set(ylabel="$v$, m/s", ylim=tuple(ratio * x for x in speed.get_ylim()))
    torque.plot(s.t, s.brake_torque / 1e3, color=BLUE, label="brake $M_b$")
    torque.plot(
        s.t, s.load_torque / 1e3, color=PURPLE, ls="-.", label=r"load $M_\mathrm{load}$"
    )
    if s.motor_torque is not None:
        torque.plot(s.t, s.motor_torque / 1e3, color=GREEN, ls="--", label="motor $M$")
        if s.shaft_torque is not None:
            torque.plot(
                s.t,
                s.shaft_torque / 1e3,
                color=ORANGE,
                ls=":",
                label=r"others $\Sigma M_\mathrm{shaft}$",
            )
    torque.set_ylabel("torque, kN·m")
    n = s.normal_load.shape[1]
    if s.slack_tension is not None:
        tension.plot(s.t, s.tight_tension / 1e3, color=BLUE, label="tight end $T_n$")
        tension.plot(s.t, s.slack_tension / 1e3, color=SKY, label="slack end $T_0$")
        tension.set_ylabel("tension, kN")
    elif s.lever_force is not None:
        tension.plot(s.t, s.lever_force / 1e3, color=SKY, label="actuator $F$")
        differ = np.ptp(s.normal_load, axis=1).max() > 0
        for i in range(n if differ else 1):
            which = f" on {words.lining} {i + 1}" if differ else ""
            tension.plot(
                s.t,
                s.normal_load[:, i] / 1e3,
                ls="--",
                label=f"normal force $N${which}",
            )
        tension.set_ylabel("force, kN")
    linings.plot(
        s.t,
        s.at_limit,
        color=ORANGE,
        drawstyle="steps-post",
        label=f"{words.lining}s at their limit $k$",
    )
    linings.set(ylim=(-0.5, n + 0.5), ylabel=f"$k$ of {n}")
    linings.yaxis.set_major_locator(MaxNLocator(5, integer=True, steps=[1, 2, 5, 10]))


_STAGES = {
    "stage_1": ("stage 1: band slides on the bandage", GREEN),
    "stage_2": ("stage 2: both pairs slide", ORANGE),
    "stage_3": ("stage 3: pulley slides in the bandage", BLUE),
    "held": ("held", "0.5"),
    "open": ("open", "white"),
}


@styled
def stages(
    result: Result, *, running_in: RunningIn | None = None, figure: Figure | None = None
) -> Figure:
    """Speeds of pulley and bandage of a staged brake, torques and friction heat of both
    pairs, and their overlap coefficients (K, Fig. 5; filled while a pair slides,
    hatched while it sticks), stages shaded.

    Raises `ValueError` for a standard brake.

    Example:
        >>> figure = sb.plot.stages(staged)
        >>> figure.axes[0].get_ylabel()
        'speed, rad/s'
    """
    parts = result.stages
    start = parts[0].start
    end = parts[-1].end
    if parts[-1].name == "held" and len(parts) > 1:
        end = min(end, start + 1.15 * (parts[-1].start - start))
    s = dense_grid(result, start, end)
    t = s.t
    o = overlap(result, s.t, running_in)
    figure = sheet(figure, 9.0, 12.0)
    panels = figure.subplots(5, 1, sharex=True, height_ratios=[1.2, 1.2, 1, 0.7, 0.7])
    speed, torque, heat, outer, inner = panels
    speed.plot(t, s.omega, color=ink(), label=r"pulley $\omega$")
    speed.plot(t, s.bandage_speed, color=GREEN, ls="--", label=r"bandage $\omega_b$")
    speed.set_ylabel("speed, rad/s")
    external = s.pairs["external"]
    internal = s.pairs["internal"]
    torque.plot(
        t, external.torque / 1e3, color=GREEN, label=r"band on bandage $M_\mathrm{ext}$"
    )
    torque.plot(
        t, internal.torque / 1e3, color=BLUE, label=r"pulley on bandage $\Lambda$"
    )
    torque.plot(
        t,
        np.asarray(internal.capacity) / 1e3,
        color=BLUE,
        ls=":",
        label=r"it sticks up to $M_\mathrm{int}$",
    )
    torque.set_ylabel("torque, kN·m")
    heat.plot(t, external.heat / 1e3, color=GREEN, label="external pair")
    heat.plot(t, internal.heat / 1e3, color=BLUE, label="internal pair")
    heat.set_ylabel("friction heat, kJ")
    for panel, colour, name, dynamic, static in (
        (outer, GREEN, "external", o.external_dynamic, o.external_static),
        (inner, BLUE, "internal", o.internal_dynamic, o.internal_static),
    ):
        panel.fill_between(
            t, dynamic, color=colour, alpha=0.7, lw=0, label="slides (dynamic)"
        )
        panel.fill_between(
            t,
            static,
            facecolor="none",
            edgecolor=colour,
            hatch="///",
            lw=0,
            label="sticks (static)",
        )
        panel.set(ylim=(0, 1), ylabel=f"{name}\noverlap (–)")
    inner.set_xlabel("time, s")
    speed.set_ylim(
        top=1.3 * float(np.max(s.omega))
    )  # space for the names of the stages
    named = dict[str, Patch]()
    for stage in parts:
        last = min(stage.end, end)
        (words, colour) = _STAGES[stage.name]
        named[stage.name] = Patch(
            facecolor=colour, edgecolor="0.7", alpha=0.25, label=words
        )
        for panel in panels:
            panel.axvspan(stage.start, last, color=colour, alpha=0.15, lw=0)
        if stage.name.startswith("stage_") and last - stage.start > 0.08 * (
            end - start
        ):
            place = {
                "transform": speed.get_xaxis_transform(),
                "ha": "center",
                "va": "top",
            }
            speed.text(
                0.5 * (stage.start + last), 0.97, stage.name.replace("_", " "), **place
            )
    speed.set_xlim(start, end)
    finish(panels)
    name_marks(figure, [], named.values())
    head(figure, result.scene, f"stages of the brake: {result.message}")
    return figure


@styled
def contacts(result: Result, *, figure: Figure | None = None) -> Figure:
    """Stick and slip of each lining over time: of a chain on the pulley, of a resolved
    bandage on band and rim.

    One line for each lining, from the slack end: light blue while it sticks, orange
    while it slides ahead, purple while it slides back. Left the whole motion, right the
    time up to the first full slip, if it is short.

    Raises `ValueError` where the linings act as one.

    Example:
        >>> figure = sb.plot.contacts(chain)
        >>> figure.axes[0].get_ylabel()
        'lining, from the slack end'
    """
    contact_states = result.record.modes.contacts  # pyright: ignore
    if not contact_states:
        raise ValueError(
            "the linings of this brake act as one: there are no single contacts to draw"
        )
    t = np.asarray(result.record.rows.t)[: int(result.record.count) + 1]
    columns = windows(result)
    figure = sheet(figure, 11.5, 3.2, rows=len(contact_states), room=1.9)
    axes = figure.subplots(
        len(contact_states), len(columns), squeeze=False, sharex="col"
    )
    kinds = (Contact.SLIDES_BACK, Contact.STICKS, Contact.SLIDES)
    colours = ListedColormap([CONTACT_COLOURS[kind] for kind in kinds])
    pairs = result.scene.brake.pairs
    for row, (pair, place), states in zip(
        axes, pairs.items(), contact_states.values(), strict=True
    ):
        states = np.asarray(states)[: len(t)]
        name = place.words if len(pairs) == 1 else f"{place.words} ({pair})"
        changes = np.append(True, np.any(states[1:] != states[:-1], axis=1))
        edges = np.append(t[changes], t[-1])
        linings = np.arange(states.shape[1] + 1) + 0.5
        for panel, window in zip(row, columns, strict=True):
            panel.pcolormesh(
                edges, linings, states[changes].T, cmap=colours, vmin=-1, vmax=1
            )
            panel.set_xlim(window.start, window.end)
            panel.yaxis.set_major_locator(MaxNLocator(integer=True))
            panel.set_title(f"{name}{', enlarged' if window.enlarged else ''}")
        row[0].set_ylabel("lining, from the slack end")
    for panel, window in zip(axes[-1], columns, strict=True):
        window.label_time(panel)
    name_marks(
        figure,
        [],
        [Patch(color=CONTACT_COLOURS[kind], label=WORDS[kind]) for kind in kinds],
    )
    head(figure, result.scene, "stick and slip of each lining")
    return figure


@styled
def temperatures(result: Result, *, figure: Figure | None = None) -> Figure:
    """Temperatures of rim, linings and band over time, the permissible one, and the
    hottest moment's depth profiles.

    Above the surfaces over time (of several lining walls the coolest and the hottest),
    then the coefficient of friction, below the temperature through the depth of the
    walls when the rim, or the first place that the scene names, was hottest. Of a run
    with several brake applications the hottest one is enlarged at the right; of many,
    the surfaces are their maximum and minimum in each cycle (from one strong
    application to the next).

    Raises `ValueError` if the scene has no heat.

    Example:
        >>> figure = sb.plot.temperatures(heated)
        >>> figure.axes[0].get_ylabel()
        'surface temperature, °C'
    """
    heat = result.scene.network
    brake = result.scene.brake
    if not result.scene.heated:
        raise ValueError("the scene has no heat: there are no temperatures to draw")
    whole = Window(*span(result))
    starts = strong_applications(result)
    peaks = [
        float(peak.time)
        for name, peak in result.report().peaks.items()
        if name.startswith("peak_")
    ]
    t, shown = _surfaces(result, whole)
    hottest = (
        peaks[0]
        if peaks
        else float(t[int(np.argmax(next(iter(shown.values())).max(axis=1)))])
    )
    columns = [whole, *application(result, hottest, "the hottest brake application")]
    walls = heat.walls[:2]
    rows = 2 + bool(walls)
    figure = sheet(
        figure, 11.5 if walls or len(columns) > 1 else 8.5, 3.1, rows=rows, room=0.6
    )
    grid = figure.add_gridspec(rows, 2, width_ratios=[1.3, 1.0])
    body = brake.words.body
    lining = brake.words.lining
    own = (
        {} if brake.banded else {"rim": body, "lining": lining, "linings": f"{lining}s"}
    )
    lowest = min(T.min() for T in shown.values())
    highest = max(T.max() for T in shown.values())
    for i, window in enumerate(columns):
        column = slice(None) if len(columns) == 1 else i
        surface = figure.add_subplot(grid[0, column])
        friction = figure.add_subplot(grid[1, column], sharex=surface)
        if i:
            t, shown = _surfaces(result, window)
        cycles = starts if i == 0 and len(starts) > _FEW else None
        for name, T in shown.items():
            words = own.get(name, name)
            colour = _HOT.get(name, "0.5")
            if cycles is not None:
                _envelope(
                    surface,
                    t,
                    T,
                    np.unique([whole.start, *cycles[1:], whole.end]),
                    colour,
                    words,
                )
                continue
            named = (
                (f"{words}, hottest", f"{words}, coolest")
                if T.shape[1] > 1
                else (words, None)
            )
            # the rim broader, as the faces of linings are often as hot
            _extremes(surface, t, T, colour, named, lw=3.0 if name == "rim" else 1.3)
        if cycles is not None:
            surface.plot([], [], color=GREY, ls=":", label="lowest of a cycle")
        limits = {
            name: (f"{own.get(name, name)} ≤", "--", T)
            for name, T in heat.permissible_at.items()
        }
        limits["coolant, outlet"] = "coolant boils at", ":", heat.boiling
        for name, (words, style, most) in limits.items():
            if (
                most is None or name == "outer"
            ):  # the outer face of the linings, with their own limit
                continue
            limit = float(np.asarray(most)) - ZERO
            look = {"color": _HOT[name], "lw": 1.3, "ls": style}
            if limit < highest + 1.5 * (highest - lowest):
                surface.axhline(limit, label=f"{words} {limit:.4g} °C", **look)
            else:
                surface.plot([], [], label=f"{words} {limit:.4g} °C above", **look)
        _coefficients(friction, result, t)
        surface.set_xlim(window.start, window.end)
        surface.set_ylabel("surface temperature, °C")
        friction.set(xlabel="time, s", ylabel="coefficient of\nfriction (–)")
        surface.tick_params(labelbottom=False)
        finish([surface, friction])
        if i:
            surface.get_legend().remove()  # pyright: ignore
            surface.set_title(window.title, loc="left", pad=6.0)
            friction.get_legend().remove()  # pyright: ignore
    profiles = np.asarray(result.series([hottest]).temperature)[0] - ZERO
    for i, wall in enumerate(walls):
        panel = figure.add_subplot(grid[2, :] if len(walls) == 1 else grid[2, i])
        depths = 1e3 * np.asarray(wall.centres)
        panel.plot(
            depths,
            _layers(result, wall, profiles).T,
            color=VERMILLION,
            marker=".",
            lw=1.0,
        )
        panel.set_title(
            f"through the {own.get(wall.name, wall.name)} at {number(hottest, 's', count=4)}",
            loc="left",
        )
        panel.set(
            xlabel="depth below the friction surface, mm", ylabel="temperature, °C"
        )
        panel.grid(alpha=0.3)
    head(figure, result.scene, "temperatures")
    return figure


#: cycles from which on the surfaces are drawn as an envelope
_FEW = 5


def _surfaces(
    result: Result, window: Window
) -> tuple[Times, dict[str, Float[np.ndarray, "t n"]]]:
    """Times, and temperatures (°C) of the surfaces that the scene names, else of all
    nodes."""
    t = cells(result, window.start, window.end)
    s = result.series(t)
    surfaces = {
        "rim": s.rim_temperature,
        "linings": s.lining_temperature,
        "band": s.band_temperature,
    }
    surfaces["linings, outer face"] = s.lining_outer_temperature
    surfaces |= {
        "wetted wall": s.wetted_temperature,
        "coolant, outlet": s.coolant_temperature,
    }
    by_surface = {name: T for name, T in surfaces.items() if T is not None} or {
        "nodes": s.temperature
    }
    return t, {name: np.asarray(T) - ZERO for name, T in by_surface.items()}


def _envelope(
    axes: Axes,
    t: Times,
    T: Float[np.ndarray, "t n"],
    bounds: Times,
    colour: str,
    words: str,
) -> None:
    """The area between the maxima and the minima of all cycles, at their times."""
    cuts = np.searchsorted(t, bounds)
    lines = []
    known = np.ones(t.size, bool)
    for values, extreme, style in (
        (T.max(axis=1), np.argmax, "-"),
        (T.min(axis=1), np.argmin, ":"),
    ):
        at = np.asarray([a + extreme(values[a:b]) for a, b in pairwise(cuts) if b > a])
        axes.plot(
            t[at],
            values[at],
            color=colour,
            ls=style,
            label=words if style == "-" else None,
        )
        lines.append(np.interp(t, t[at], values[at]))
        known &= (t >= t[at[0]]) & (t <= t[at[-1]])
    axes.fill_between(t, *lines, where=known.tolist(), color=colour, alpha=0.15, lw=0)


def _coefficients(axes: Axes, result: Result, t: Times) -> None:
    """Coefficients of friction of all pairs, of several linings the maximum and the
    minimum."""
    s = result.series(t)
    for (name, pair), colour in zip(s.pairs.items(), (GREEN, BLUE), strict=False):
        if pair.friction_coefficient is not None:
            f = np.asarray(pair.friction_coefficient)
            words = name if len(s.pairs) > 1 else "when sliding"
            lowest = (
                "lining with the minimum" if np.ptp(f, axis=1).max() > 1e-9 else None
            )
            _extremes(axes, t, f, colour, (words, lowest))
    low, high = axes.get_ylim()
    if high - low < 0.12 * high:  # hardly changes: no axis of a few thousandths
        axes.set_ylim(0.0, 1.25 * high)


def _extremes(
    axes: Axes,
    t: Float[np.ndarray, " t"],
    values: Float[np.ndarray, "t n"],
    colour: str,
    words: tuple[str, str | None],
    lw: float | None = None,
) -> None:
    """The maximum of several values over time and, where it has a name, the minimum."""
    axes.plot(t, values.max(axis=1), color=colour, lw=lw, label=words[0])
    if words[1] is not None:
        axes.plot(t, values.min(axis=1), color=colour, ls=":", label=words[1])


def _layers(
    result: Result, wall: Wall, T: Float[np.ndarray, "... k"]
) -> Float[np.ndarray, "... copies layers"]:
    """Temperatures of the layers of a wall, of all its copies, among those of all
    nodes."""
    nodes = [
        i for i, name in enumerate(result.nodes) if name.partition("[")[0] == wall.name
    ]
    return T[..., nodes].reshape(*T.shape[:-1], wall.copies, wall.layers)


# --- maps ---------------------------------------------------------------------------


@styled
def depth(
    result: Result,
    wall: str | None = None,
    copy: int | None = None,
    *,
    figure: Figure | None = None,
) -> Figure:
    """Temperature (°C) through the depth (mm) of a wall over time as a map, beside it
    profiles.

    Of a run with several brake applications the hottest one is enlarged; the lines of
    its map are those on the colour bar. The profiles are those at its start, while the
    face heats to its maximum temperature and cools again, and at its end; marks above
    the map show their times.

    - `wall`: name of a body in layers; default that of the rim, else the first one
    - `copy`: which of several equal walls, such as one per lining, from 1; default the
      one that gets hottest

    Raises `InputError` if the scene has no such wall.

    Example:
        >>> figure = sb.plot.depth(heated)
        >>> figure.axes[0].get_ylabel()
        'depth below the front face, mm'
    """
    chosen = _wall(one_run(result), wall, copy)
    window = windows(result)[0]

    def layers(
        window: Window,
    ) -> tuple[Times, Times, Float[np.ndarray, "t copies layers"]]:
        edges = cells(result, window.start, window.end)
        middle = 0.5 * (edges[1:] + edges[:-1])
        return (
            edges,
            middle,
            _layers(result, chosen, np.asarray(result.series(middle).temperature))
            - ZERO,
        )

    edges, middle, T = layers(window)
    index = int(np.argmax(T.max(axis=(0, 2)))) if copy is None else copy - 1
    near = application(
        result, float(middle[int(np.argmax(T[:, index, 0]))]), "the hottest application"
    )
    depths = 1e3 * np.append(0.0, np.cumsum(np.asarray(chosen.steps)))
    centres = 1e3 * np.asarray(chosen.centres)
    low = T[:, index].min()
    high = T[:, index].max()
    figure = sheet(figure, 12.5, 6.0)
    *fields, profile = figure.subplots(
        1, 2 + len(near), sharey=True, width_ratios=[*[1.5] * (1 + len(near)), 1.3]
    )
    marked = list[Event]()
    for field, part in zip(fields, [window, *near], strict=True):
        if part is not window:
            edges, middle, T = layers(part)
        shades = {
            "vmin": low,
            "vmax": max(high, T[:, index].max()),
            "cmap": "inferno",
            "rasterized": True,
        }
        mesh = field.pcolormesh(edges, depths, T[:, index].T, **shades)
        marked += marks(field, result, part, front=True)
        field.set(xlabel="time, s", xlim=(part.start, part.end))
        field.set_title(part.title, loc="left", pad=16.0)
    T = T[:, index]
    bar = figure.colorbar(mesh, ax=fields, label="temperature, °C", pad=0.01)
    if np.ptp(T) > 1e-9 and chosen.layers > 1:
        levels = MaxNLocator(7).tick_values(T.min(), T.max())
        levels = levels[
            levels > T.min() + 1e-3 * np.ptp(T)
        ]  # none along what is still cold
        bar.add_lines(
            fields[-1].contour(
                middle, centres, T.T, levels=levels, colors="white", linewidths=0.7
            )
        )
    hottest, shown = _telling(T[:, 0])
    colours = colormaps["viridis"](np.linspace(0, 0.92, len(shown)))
    above = fields[-1].get_xaxis_transform()
    for i, colour in zip(shown, colours, strict=True):
        words = "\n(hottest)" if i == hottest else ""
        profile.plot(
            T[i],
            centres,
            color=colour,
            marker=".",
            label=f"{digits(float(middle[i]), 5)} s{words}",
        )
        fields[-1].plot(
            [middle[i]], [1.02], marker=7, color=colour, transform=above, clip_on=False
        )
    profile.set_xlabel("temperature, °C")
    profile.grid(alpha=0.3)
    profile.legend(
        loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, handlelength=1.2
    )
    fields[0].set(ylabel="depth below the front face, mm", ylim=(depths[-1], 0.0))
    which = f" {index + 1} of {chosen.copies}" if chosen.copies > 1 else ""
    name_marks(figure, marked, rule=f"means of {chosen.layers} layers")
    head(figure, result.scene, f"temperature through the depth: {chosen.name}{which}")
    return figure


def _telling(face: Float[np.ndarray, " t"]) -> tuple[int, Int[np.ndarray, " m"]]:
    """Time at which the face is hottest, and indices of profiles at equal steps of its
    temperature up to then."""
    hottest = int(np.argmax(face))
    change = np.append(0.0, np.cumsum(np.abs(np.diff(face))))
    wanted = change[hottest] + np.ptp(face) * np.array(
        [-0.8, -0.5, -0.25, 0.15, 0.3, 0.5]
    )
    around = np.searchsorted(change, wanted[(wanted > 0) & (wanted < change[-1])])
    return hottest, np.unique([0, *around, hottest, len(face) - 1])


def _wall(result: Result, name: str | None, copy: int | None) -> Wall:
    heat = result.scene.network
    walls = heat.walls
    if not walls:
        why = (
            "no body of the scene is in layers"
            if result.scene.heated
            else "the scene has no heat"
        )
        raise input_error(
            "wall", why, "there is no depth to draw; layered_heat makes walls"
        )
    if name is None and heat.rim is not None:
        name = place_of(heat.rim)[0]
        name = name if name in [wall.name for wall in walls] else None
    matching = [wall for wall in walls if name in (None, wall.name)]
    if not matching:
        names = ", ".join(wall.name for wall in walls)
        raise input_error("wall", f"there is no wall {name!r}", f"there are: {names}")
    if copy is not None and not 1 <= copy <= matching[0].copies:
        raise input_error(
            "copy", f"there is no {name} {copy}", f"there are 1…{matching[0].copies}"
        )
    return matching[0]


@styled
def lining_map(
    result: Result,
    quantity: str = "temperature",
    *,
    pair: str = "external",
    figure: Figure | None = None,
) -> Figure:
    """A quantity of every lining over time as a map, linings of a band from the slack
    to the tight end, with lines at events; a short onset of slip enlarged at the right.

    - `quantity`: `temperature` (°C), `normal_load`, `tension` behind the lining,
      `tension_increment`, `friction_force` (kN), `pressure`, `slack_edge_pressure`,
      `tight_edge_pressure` (MPa), `edge_pressure_ratio`, `slip_speed` (m/s),
      `friction_power` (kW), `friction_heat` since the start (kJ),
      `friction_coefficient`, `displacement` of a chain (mm)
    - `pair`: name of a friction pair; of a staged brake `external` is band on linings,
      `internal` linings on rim

    Raises `InputError` for quantities that the run does not have.

    Example:
        >>> figure = sb.plot.lining_map(result, "normal_load")
        >>> figure.axes[-1].get_ylabel()
        'normal load $N$, kN'
    """
    columns = windows(one_run(result))
    maps = []
    marked = list[Event]()
    brake = result.scene.brake
    for window in columns:
        edges = cells(result, window.start, window.end)
        maps.append((edges, lining_values(result, quantity, edges, pair=pair)))
    view = VIEW_OF_HEAT if quantity == HEAT else LINING_QUANTITIES[quantity].view
    assert view is not None
    n = brake.linings.count
    figure = sheet(figure, 11.5 if len(columns) > 1 else 8.5, 5.4)
    ratios = [1.5, 1][: len(columns)]
    panels = figure.subplots(
        1, len(columns), squeeze=False, sharey=True, width_ratios=ratios
    )[0]
    colours = (
        "inferno"
        if quantity in ("temperature", "friction_heat", "friction_power")
        else "viridis"
    )
    unit = f", {view.unit}" if view.unit else " (–)"
    words = re.sub(r"\b([NTFfuv])\b", r"$\1$", view.words).replace(
        "|Tᵢ − Tᵢ₋₁|", "$|T_i - T_{i-1}|$"
    )
    for panel, window, (edges, values) in zip(panels, columns, maps, strict=True):
        shown = np.broadcast_to(
            view.factor * values + view.offset, (len(edges) - 1, n)
        ).T
        low = float(shown.min())
        high = float(shown.max())
        limits = {"vmin": low, "vmax": high if high > low else low + 1.0}
        mesh = panel.pcolormesh(
            edges,
            np.arange(n + 1) + 0.5,
            shown,
            cmap=colours,
            rasterized=True,
            **limits,
        )
        figure.colorbar(mesh, ax=panel, label=f"{words}{unit}", pad=0.01)
        marked += marks(panel, result, window, front=True)
        panel.set_xlim(window.start, window.end)
        panel.yaxis.set_major_locator(MaxNLocator(integer=True))
        window.label_time(panel)
        panel.set_title(window.title)
    order = (
        "from the slack to the tight end"
        if len(brake.bands_of_linings) == 1
        else "band after band"
    )
    panels[0].set_ylabel(f"lining, {order}" if brake.banded else brake.words.lining)
    where = f"{brake.pairs[pair].words}: " if len(brake.pairs) > 1 else ""
    lining = brake.words.lining
    alike = (
        " (one surface for all linings)"
        if maps[0][1].shape[1] == 1 < n and quantity == "temperature"
        else ""
    )
    name_marks(figure, marked, rule=brake.force_words)
    head(figure, result.scene, f"{where}{words}, {lining} by {lining}{alike}")
    return figure
