"""Pictures of one run over time: lever and load, the stop, stages, contacts, temperatures, maps."""

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullLocator

from .._base._faults import Fault, InputError
from .._run._linings import VIEWS, WORDS, Contact, RunningIn, lining_values, overlap
from .._run._result import Result
from ..brakes._design import BrakeWords
from ..loads import TrippingLoad
from ..thermal._network import Wall, place_of
from ._pulley import CONTACT_COLOURS
from ._shared import (
    BLUE,
    GREEN,
    ORANGE,
    VERMILLION,
    ZERO,
    cells,
    dense_grid,
    finish,
    marks,
    one_run,
    time_axis,
    windows,
)


def duty(result: Result, *, figure: Figure | None = None) -> Figure:
    """Slack tension or force that the lever gives and torque of the load over the whole run, with the mass on the hook
    below where it changes."""
    record = result.record
    times = np.asarray(record.rows.t)[: int(record.count) + 1]
    knots = [e for e in result.events if e.name in ("slip_onset", "full_slip", "stop", "restart", "release")]
    t, s = dense_grid(result, float(times[0]), float(times[-1]), knots)
    # the steps end at every corner of the profiles: none of them is cut off by the even grid
    at = np.unique(times[:: 1 + len(times) // 3000])
    steps = result.series(at)
    order = np.argsort(np.concatenate([t, at]), kind="stable")
    t = np.concatenate([t, at])[order]

    def merged(name: str) -> np.ndarray:
        return np.concatenate([np.asarray(getattr(s, name)), np.asarray(getattr(steps, name))])[order]

    load = result.scene.duty.load
    rows = 3 if isinstance(load, TrippingLoad) else 2
    figure = Figure(figsize=(9.0, 1.9 * rows + 0.6), layout="constrained") if figure is None else figure
    panels = figure.subplots(rows, 1, sharex=True)
    banded = result.scene.brake.banded
    lever = merged("slack_tension" if banded else "lever_force") / 1e3
    panels[0].plot(t, lever, color="tab:blue", label="slack tension T₀" if banded else "force of the actuator F")
    panels[0].set_ylabel("tension, kN" if banded else "force, kN")
    panels[1].plot(t, merged("load_torque") / 1e3, color="tab:red", label="load torque on the shaft")
    panels[1].set_ylabel("torque, kN·m")
    if isinstance(load, TrippingLoad):
        cycles = np.arange(load.count) * float(load.period)
        edges = np.stack([cycles + float(load.taken), cycles + float(load.set)], axis=1).ravel()
        hung = float(load.string) + np.arange(load.count) * float(load.stand)
        mass = float(load.empty) + np.stack([hung, np.zeros(load.count)], axis=1).ravel()
        corners = np.concatenate([[times[0]], edges, [times[-1]]])
        heights = np.concatenate([[float(load.empty)], mass, mass[-1:]])
        panels[2].step(corners, heights / 1e3, where="post", color="tab:brown", label="mass on the hook")
        panels[2].set_ylabel("mass, t")
    finish(panels, "best")
    for panel in panels:
        panel.set_xlim(times[0], times[-1])
        panel.set_ylim(bottom=min(0.0, panel.get_ylim()[0]))
    panels[-1].set_xlabel("time, s")
    return figure


# --- the stop, stages, contacts, temperatures -------------------------------------------------------------------------

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


# --- maps -------------------------------------------------------------------------------------------------------------


def depth(result: Result, wall: str | None = None, copy: int | None = None, *, figure: Figure | None = None) -> Figure:
    """Temperature (°C) through the depth (mm) of a wall over time as a map with contour lines, beside it profiles.

    Where the layers are graded, the axis of the depth is so too: every layer is equally high. The lines of the map are
    those on the colour bar. The profiles are those at the start, while the face heats to its greatest temperature and
    cools again, and at the end.

    - `wall`: name of a body in layers; default that of the rim, else the first one
    - `copy`: which of several equal walls, such as one per lining, from 1; default the one that gets hottest

    Raises `InputError` if the scene has no such wall.
    """
    chosen = _wall(one_run(result), wall, copy)
    start, end, _ = windows(result)
    edges = cells(result, start, end)
    middle = 0.5 * (edges[1:] + edges[:-1])
    here = [i for i, name in enumerate(result.nodes) if name.partition("[")[0] == chosen.name]
    T = np.asarray(result.series(middle).temperature)[:, here] - ZERO
    T = T.reshape(len(middle), chosen.copies, chosen.layers)
    number = int(np.argmax(T.max(axis=(0, 2)))) if copy is None else copy - 1
    T = T[:, number]
    layer_edges = 1e3 * np.append(0.0, np.cumsum(np.asarray(chosen.steps)))
    centres = 1e3 * np.asarray(chosen.centres)
    if figure is None:
        figure = Figure(figsize=(11.5, 5.6), layout="constrained")
    field, profile = figure.subplots(1, 2, sharey=True, width_ratios=[1.8, 1])
    mesh = field.pcolormesh(edges, layer_edges, T.T, cmap="inferno", rasterized=True)
    bar = figure.colorbar(mesh, ax=field, label="temperature, °C", pad=0.01)
    if np.ptp(T) > 1e-9 and chosen.layers > 1:
        levels = MaxNLocator(7).tick_values(T.min(), T.max())
        lines = field.contour(middle, centres, T.T, levels=levels, colors="white", linewidths=0.7)
        bar.add_lines(lines)  # which line is which temperature, without words over the map
        bar.set_ticks([x for x in levels if T.min() <= x <= T.max()])
    _depth_axis(field, layer_edges)
    marks(field, result.events, start, end, named=False, front=True)
    hottest, shown = _telling(T[:, 0])
    colours = colormaps["viridis"](np.linspace(0, 0.92, len(shown)))
    for i, colour in zip(shown, colours, strict=True):
        words = " (face hottest)" if i == hottest else ""
        profile.plot(T[i], centres, color=colour, marker=".", label=f"{middle[i]:.5g} s{words}")
        field.plot([middle[i]], [1.0], marker=7, color=colour, transform=field.get_xaxis_transform(), clip_on=False)
    profile.set_xlabel("temperature, °C")
    profile.legend(fontsize=8, framealpha=0.9, title="time", title_fontsize=8)
    profile.grid(alpha=0.3)
    field.set_ylabel("depth below the front face, mm" + (" (graded)" if _graded(layer_edges) else ""))
    field.set_xlabel("time, s")
    which = f" {number + 1} of {chosen.copies}" if chosen.copies > 1 else ""
    words = f"{chosen.name}{which}, means of {chosen.layers} layers"
    figure.suptitle(f"temperature through the depth: {words} (dashed: events)", fontsize=11)
    return figure


def _telling(face: np.ndarray) -> tuple[int, np.ndarray]:
    """When the face is hottest, and indices of profiles that tell how it came to be so: equal steps of its change."""
    hottest = int(np.argmax(face))
    change = np.append(0.0, np.cumsum(np.abs(np.diff(face))))
    wanted = change[hottest] + np.ptp(face) * np.array([-0.8, -0.5, -0.25, 0.15, 0.3, 0.5])
    around = np.searchsorted(change, wanted[(wanted > 0) & (wanted < change[-1])])
    return hottest, np.unique([0, *around, hottest, len(face) - 1])


def _wall(result: Result, name: str | None, copy: int | None) -> Wall:
    heat = result.scene.network
    walls = heat.walls
    if not walls:
        why = "no body of the scene is in layers" if result.scene.heated else "the scene has no heat"
        raise InputError([Fault("wall", why, "there is no depth to draw; layered_heat makes walls")])
    if name is None and heat.rim is not None:
        name = place_of(heat.rim)[0]
        name = name if name in [wall.name for wall in walls] else None
    found = [wall for wall in walls if name in (None, wall.name)]
    if not found:
        names = ", ".join(wall.name for wall in walls)
        raise InputError([Fault("wall", f"there is no wall {name!r}", f"there are: {names}")])
    if copy is not None and not 1 <= copy <= found[0].copies:
        raise InputError([Fault("copy", f"there is no {name} {copy}", f"there are 1…{found[0].copies}")])
    return found[0]


def _graded(edges: np.ndarray) -> bool:
    steps = np.diff(edges)
    return bool(steps.max() > 3.0 * steps.min())


def _depth_axis(axes: Axes, edges: np.ndarray) -> None:
    """The surface on top; graded layers equally high, with the depths of some of their edges."""
    if _graded(edges):
        places = np.arange(len(edges), dtype=np.float64)

        def to(d: Any) -> Any:
            return np.interp(d, edges, places)

        def back(p: Any) -> Any:
            return np.interp(p, places, edges)

        axes.set_yscale("function", functions=(to, back))
        axes.yaxis.set_major_locator(FixedLocator(edges[:: -(-len(edges) // 9)].tolist()))
        axes.yaxis.set_minor_locator(NullLocator())
        axes.yaxis.set_major_formatter(FuncFormatter(lambda d, _: f"{d:.3g}"))
    axes.set_ylim(edges[-1], edges[0])


def lining_map(
    result: Result, quantity: str = "temperature", *, pair: str = "external", figure: Figure | None = None
) -> Figure:
    """A quantity of every lining over time as a map, with lines at events; a short onset of slip enlarged at the right.

    - `quantity`: `temperature` (°C), `normal_load`, `tension` behind the lining, `tension_increment`, `friction_force`
      (kN), `pressure` (MPa), `slip_speed` (m/s), `friction_power` (kW), `friction_heat` since the start (kJ),
      `friction_coefficient`, `displacement` of a chain (mm)
    - `pair`: name of a friction pair; of a staged brake `external` is band on linings, `internal` linings on rim

    Raises `InputError` for what the run does not have.
    """
    start, end, zoom = windows(one_run(result))
    ends = [end] if zoom is None else [end, zoom]
    view, n = VIEWS.get(quantity), result.scene.brake.linings.count
    parts = []
    for top in ends:
        edges = cells(result, start, top)
        values = lining_values(result, quantity, edges, pair=pair)
        parts.append((edges, values))
    assert view is not None  # `lining_values` refuses what it does not know
    if figure is None:
        figure = Figure(figsize=(11.5 if zoom else 8.5, 4.8), layout="constrained")
    panels = figure.subplots(1, len(ends), squeeze=False, sharey=True, width_ratios=[1.5, 1][: len(ends)])[0]
    linings = np.arange(n + 1) + 0.5
    colours = "inferno" if quantity in ("temperature", "friction_heat", "friction_power") else "viridis"
    unit = f", {view.unit}" if view.unit else ""
    for i, (panel, top, (edges, values)) in enumerate(zip(panels, ends, parts, strict=True)):
        shown = np.broadcast_to(view.factor * values + view.offset, (len(edges) - 1, n)).T
        low, high = float(shown.min()), float(shown.max())
        limits = {"vmin": low, "vmax": high if high > low else low + 1.0}
        mesh = panel.pcolormesh(edges, linings, shown, cmap=colours, rasterized=True, **limits)
        figure.colorbar(mesh, ax=panel, label=f"{view.words}{unit}", pad=0.01)
        marks(panel, result.events, start, top, named=True, front=True)
        panel.set_xlim(start, top)
        panel.yaxis.set_major_locator(MaxNLocator(integer=True))
        time_axis(panel, milliseconds=i == 1 and bool(top - start < 0.5))
        panel.set_title("up to full slip, enlarged" if i else "whole run", fontsize=10)
    brake = result.scene.brake
    panels[0].set_ylabel("lining, from the slack to the tight end" if brake.banded else brake.words.lining)
    where = f"{brake.pairs[pair].words}: " if len(brake.pairs) > 1 else ""
    alike = " (one surface for all linings)" if parts[0][1].shape[1] == 1 < n and quantity == "temperature" else ""
    figure.suptitle(f"{where}{view.words}, lining by lining{alike}", fontsize=11)
    return figure
