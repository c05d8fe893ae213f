"""Sheets of one run: lever and load, the stop, stages, contacts, temperatures, maps.
Each is put together from the panels of `simbrake.plot.panels`."""

import numpy as np
from jaxtyping import Float, Int
from matplotlib import colormaps
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from .._base._faults import input_error
from .._base._numbers import digits, reading
from ..loads import AbstractString
from ..outputs.duty import first_greatest
from ..outputs.log import Event
from ..runs.linings import CONTACT_WORDS, Contact, RunningIn, lining_values
from ..runs.result import Result
from . import panels
from .drawing import (
    BLUE,
    GREEN,
    ORANGE,
    VERMILLION,
    Times,
    Window,
    above_legend,
    application,
    cells,
    dense_grid,
    finish,
    head,
    marks,
    name_marks,
    one_run,
    sheet,
    span,
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
    draw = [panels.lever, panels.load]
    if isinstance(result.scene.duty.load, AbstractString):
        draw.append(panels.hook_mass)
    figure = sheet(figure, 9.0, 2.2, rows=len(draw), room=0.9)
    column = figure.subplots(len(draw), 1, sharex=True)
    series = dense_grid(result, *span(result))
    for panel, ax in zip(draw, column, strict=True):
        panel(result, series=series, ax=ax)
        ax.set_xlabel("" if ax is not column[-1] else "time, s")
    name_marks(figure, rule=result.scene.brake.force_words)
    banded = result.scene.brake.banded
    head(figure, result.scene, f"{'lever' if banded else 'actuator'} and load")
    return figure


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
    columns = _whole_and_detail(result)
    figure = sheet(figure, 11.5 if len(columns) > 1 else 8.0, 9.6)
    ratios = [1.5, 1][: len(columns)]
    axes = figure.subplots(
        4, len(columns), squeeze=False, sharex="col", width_ratios=ratios
    )
    draw = (panels.speed, panels.torques, panels.forces, panels.linings_at_limit)
    marked = list[Event]()
    for column, window in zip(axes.T, columns, strict=True):
        series = dense_grid(result, window.start, window.end)
        for panel, ax in zip(draw, column, strict=True):
            panel(result, series=series, ax=ax)
            ax.margins(x=0)
            ax.set_xlabel("")
            marked += marks(ax, result, window)
            if window is not columns[0]:
                ax.set_ylabel("")
                if ax.get_legend() is not None:
                    ax.get_legend().remove()
        window.label_time(column[-1])
        # all at one height, above the legend of the first column
        column[0].set_title(window.title, pad=above_legend(axes[0, 0]))
    name_marks(figure, events=marked, rule=result.scene.brake.force_words)
    head(figure, result.scene, f"{result.status.replace('_', ' ')}: {result.message}")
    return figure


def _whole_and_detail(result: Result) -> list[Window]:
    """The whole motion; and of several stops the one with the maximum friction heat, of
    a single one the onset of slip where it is short."""
    columns = windows(result)
    if len(result.stops) < 2:
        return columns
    table = result.stops
    strongest = float(table["time"][first_greatest(table["energy"])])
    words = "the stop with the maximum friction heat"
    return [columns[0], *application(result, strongest, words, 0.3)]


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
    every = table.frame()
    braked = every[every["braking_time"] > 0]
    shown = braked if len(braked) else every
    heat = reading("J", float(shown["energy"].max()))
    hot = reading("K")
    curves = [
        (0, shown["braking_time"], BLUE, "contact time"),
        (1, heat(shown["energy"]), VERMILLION, "friction heat"),
    ]
    for name in shown.filter(like="peak_"):
        place = (
            name.removeprefix("peak_")
            .removesuffix("_temperature")
            .replace("lining", "linings")
        )
        colour = panels.HOT[place]
        curves.append((2, hot(shown[name]), colour, f"hottest {place}"))
    labels = ("time, s", f"heat, {heat.name}", f"temperature, {hot.name}")
    labels = labels[: curves[-1][0] + 1]
    figure = sheet(figure, 8.5, 2.2, rows=len(labels), room=1.0)
    rows = figure.subplots(len(labels), 1, sharex=True)
    for row, values, colour, label in curves:
        rows[row].plot(shown["stop"], values, "o-", ms=3, color=colour, label=label)
    for ax, label in zip(rows, labels, strict=True):
        ax.set_ylabel(label)
    finish(rows)
    rows[-1].xaxis.set_major_locator(MaxNLocator(integer=True))
    rows[-1].set_xlabel("number of the stop")
    head(
        figure,
        result.scene,
        "the stops of the run"
        if len(shown) == len(every)
        else "the stops of the run by the brake",
    )
    return figure


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

    Raises `InputError` for a standard brake.

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
    series = dense_grid(result, start, end)
    figure = sheet(figure, 9.0, 12.0)
    rows = figure.subplots(5, 1, sharex=True, height_ratios=[1.2, 1.2, 1, 0.7, 0.7])
    draw = (panels.pair_speeds, panels.pair_torques, panels.pair_heats)
    for panel, ax in zip(draw, rows, strict=False):
        panel(result, series=series, ax=ax)
    for pair, ax in zip(("external", "internal"), rows[3:], strict=True):
        panels.overlap_of_pair(
            result, pair, running_in=running_in, series=series, ax=ax
        )
    speed = rows[0]
    # space for the names of the stages
    speed.set_ylim(top=1.3 * float(np.max(series.omega)))
    named = dict[str, Patch]()
    middle_of_top = {
        "transform": speed.get_xaxis_transform(),
        "ha": "center",
        "va": "top",
    }
    for stage in parts:
        last = min(stage.end, end)
        words, colour = _STAGES[stage.name]
        named[stage.name] = Patch(
            label=words, facecolor=colour, edgecolor="0.7", alpha=0.25
        )
        for ax in rows:
            ax.axvspan(stage.start, last, color=colour, alpha=0.15, lw=0)
        long = last - stage.start > 0.08 * (end - start)
        if stage.name.startswith("stage_") and long:
            middle = 0.5 * (stage.start + last)
            name = stage.name.replace("_", " ")
            speed.text(middle, 0.97, name, **middle_of_top)
    for ax in rows[:-1]:
        ax.set_xlabel("")
    speed.set_xlim(start, end)
    name_marks(figure, named.values())
    head(figure, result.scene, f"stages of the brake: {result.message}")
    return figure


@styled
def contacts(result: Result, *, figure: Figure | None = None) -> Figure:
    """Stick and slip of each lining over time: of a chain on the pulley, of a resolved
    bandage on band and rim.

    One line for each lining, from the slack end: light blue while it sticks, orange
    while it slides ahead, purple while it slides back. Left the whole motion, right the
    time up to the first full slip, if it is short.

    Raises `InputError` where the linings act as one.

    Example:
        >>> figure = sb.plot.contacts(chain)
        >>> figure.axes[0].get_ylabel()
        'lining, from the slack end'
    """
    columns = windows(result)
    pairs = result.scene.brake.pairs
    figure = sheet(figure, 11.5, 3.2, rows=len(pairs), room=1.9)
    axes = figure.subplots(len(pairs), len(columns), squeeze=False, sharex="col")
    for row, (pair, place) in zip(axes, pairs.items(), strict=True):
        name = place.words if len(pairs) == 1 else f"{place.words} ({pair})"
        for ax, window in zip(row, columns, strict=True):
            panels.contact_states(result, pair, ax=ax)
            ax.set_xlim(window.start, window.end)
            ax.set_xlabel("")
            ax.set_title(f"{name}{', enlarged' if window.enlarged else ''}")
        for ax in row[1:]:
            ax.set_ylabel("")
    for ax, window in zip(axes[-1], columns, strict=True):
        window.label_time(ax)
    kinds = (Contact.SLIDES_BACK, Contact.STICKS, Contact.SLIDES)
    named = [
        Patch(color=CONTACT_COLOURS[kind], label=CONTACT_WORDS[kind]) for kind in kinds
    ]
    name_marks(figure, named)
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

    Raises `InputError` if the scene has no heat.

    Example:
        >>> figure = sb.plot.temperatures(heated)
        >>> figure.axes[0].get_ylabel()
        'surface temperature, °C'
    """
    whole = Window(*span(result))
    hottest = _time_of_hottest(result, whole)
    columns = [whole, *application(result, hottest, "the hottest brake application")]
    walls = result.scene.network.walls[:2]
    rows = 2 + bool(walls)
    width = 11.5 if walls or len(columns) > 1 else 8.5
    figure = sheet(figure, width, 3.1, rows=rows, room=0.6)
    grid = figure.add_gridspec(rows, 2, width_ratios=[1.3, 1.0])
    for i, window in enumerate(columns):
        column = slice(None) if len(columns) == 1 else i
        surface = figure.add_subplot(grid[0, column])
        friction = figure.add_subplot(grid[1, column], sharex=surface)
        between = {"start": window.start, "end": window.end}
        panels.surface_temperatures(result, **between, ax=surface)
        panels.friction_coefficients(result, **between, ax=friction)
        surface.set_xlabel("")
        surface.tick_params(labelbottom=False)
        if i:
            surface.set_title(window.title, loc="left", pad=6.0)
            for ax in (surface, friction):
                ax.get_legend().remove()  # pyright: ignore
    for i, wall in enumerate(walls):
        ax = figure.add_subplot(grid[2, :] if len(walls) == 1 else grid[2, i])
        panels.wall_profile(result, hottest, wall.name, ax=ax)
    head(figure, result.scene, "temperatures")
    return figure


def _time_of_hottest(result: Result, whole: Window) -> float:
    """When the first place that the scene names, mostly the rim, was hottest (s)."""
    panels.check_heated(result)
    for name, peak in result.report().peaks.items():
        if name.startswith("peak_"):
            return float(peak.time)
    t = cells(result, whole.start, whole.end)
    first = next(iter(panels.temperatures_at(result, t).values()))
    return float(t[int(np.argmax(first.max(axis=1)))])


# --- maps -----------------------------------------------------------------------------


@styled
def depth(
    result: Result,
    wall: str | None = None,
    copy: int | None = None,
    *,
    figure: Figure | None = None,
) -> Figure:
    """Temperature through the depth of a wall over time as a map, beside it profiles.

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
    chosen = panels.wall_of(one_run(result), wall)
    if copy is not None and not 1 <= copy <= chosen.copies:
        why = f"there is no {chosen.name} {copy}"
        raise input_error("copy", why, f"there are 1…{chosen.copies}")
    window = windows(result)[0]
    degrees = reading("K")
    deep = reading("m", 0.01)

    def layers(
        window: Window,
    ) -> tuple[Times, Times, Float[np.ndarray, "t copies layers"]]:
        edges = cells(result, window.start, window.end)
        middle = 0.5 * (edges[1:] + edges[:-1])
        nodes = np.asarray(result.series(middle).temperature)
        return edges, middle, panels.layers_of(result, chosen, degrees(nodes))

    edges, middle, T = layers(window)
    index = int(np.argmax(T.max(axis=(0, 2)))) if copy is None else copy - 1
    near = application(
        result, float(middle[int(np.argmax(T[:, index, 0]))]), "the hottest application"
    )
    depths = deep(np.append(0.0, np.cumsum(np.asarray(chosen.steps))))
    centres = deep(chosen.centres)
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
        mesh = field.pcolormesh(
            edges,
            depths,
            T[:, index].T,
            vmin=low,
            vmax=max(high, T[:, index].max()),
            cmap="inferno",
            rasterized=True,
        )
        marked += marks(field, result, part, front=True)
        field.set(xlabel="time, s", xlim=(part.start, part.end))
        field.set_title(part.title, loc="left", pad=16.0)
    T = T[:, index]
    bar = figure.colorbar(
        mesh, ax=fields, label=f"temperature, {degrees.name}", pad=0.01
    )
    if np.ptp(T) > 1e-9 and chosen.layers > 1:
        levels = MaxNLocator(7).tick_values(T.min(), T.max())
        # none along what is still cold
        levels = levels[levels > T.min() + 1e-3 * np.ptp(T)]
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
    profile.set_xlabel(f"temperature, {degrees.name}")
    profile.grid(alpha=0.3)
    profile.legend(
        loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, handlelength=1.2
    )
    fields[0].set(
        ylabel=f"depth below the front face, {deep.name}", ylim=(depths[-1], 0.0)
    )
    which = f" {index + 1} of {chosen.copies}" if chosen.copies > 1 else ""
    name_marks(figure, events=marked, rule=f"means of {chosen.layers} layers")
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


@styled
def lining_map(
    result: Result,
    quantity: str = "temperature",
    *,
    pair: str = "external",
    figure: Figure | None = None,
) -> Figure:
    """A quantity of every lining over time as a map, linings of a band from the slack
    to the tight end, with lines at events; at the right a short onset of slip, or of
    several stops the one with the maximum friction heat.

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
    columns = _whole_and_detail(one_run(result))
    brake = result.scene.brake
    figure = sheet(figure, 11.5 if len(columns) > 1 else 8.5, 5.4)
    ratios = [1.5, 1][: len(columns)]
    row = figure.subplots(
        1, len(columns), squeeze=False, sharey=True, width_ratios=ratios
    )[0]
    marked = list[Event]()
    for ax, window in zip(row, columns, strict=True):
        panels.lining_values_map(
            result, quantity, pair=pair, start=window.start, end=window.end, ax=ax
        )
        marked += marks(ax, result, window, front=True)
        window.label_time(ax)
        ax.set_title(window.title)
    for ax in row[1:]:
        ax.set_ylabel("")
    where = f"{brake.pairs[pair].words}: " if len(brake.pairs) > 1 else ""
    lining = brake.words.lining
    note = ""
    if quantity == "temperature":
        ends = columns[0].start, columns[0].end
        surfaces = lining_values(result, quantity, ends, pair=pair).shape[1]
        if surfaces == 1 < brake.linings.count:
            note = " (one surface for all linings)"
    words = panels.view_of(quantity)[1]
    name_marks(figure, events=marked, rule=brake.force_words)
    head(figure, result.scene, f"{where}{words}, {lining} by {lining}{note}")
    return figure
