"""Maps over time: temperature through the depth of a wall, and any quantity of every lining."""

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullLocator

from .._base._faults import Fault, InputError
from .._parts._network import Wall, place_of
from .._run._lining_view import VIEWS, lining_values
from .._run._result import Result
from ._plot_shared import ZERO, cells, marks, one_run, time_axis, windows


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
