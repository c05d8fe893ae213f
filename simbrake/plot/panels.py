"""Panels of a run: each draws one picture into the axes that it is given, or into a
figure of its own, and returns the axes. The sheets of `simbrake.plot` are put together
from them.

Values over time are those of `series`, as `result.series(times)` has them; without it
they are those of the whole run, on both sides of each event.
"""

import functools
import re
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.ticker import MaxNLocator

from .._base._faults import input_error
from .._base._numbers import Reading, number, reading
from ..loads import AbstractString
from ..outputs.quantities import LINING_QUANTITIES, Series
from ..runs.findings import in_words_of
from ..runs.linings import (
    ABOUT_HEAT,
    Contact,
    RunningIn,
    lining_values,
    overlap,
)
from ..runs.result import Result, look
from ..thermal.network import Wall, place_of
from .drawing import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    Times,
    cells,
    dense_grid,
    drawn_in,
    finish,
    ink,
    keep_level,
    one_run,
    span,
    strong_applications,
    styled,
)
from .wheels import CONTACT_COLOURS
from .wheels import wheel as wheel

__all__ = [
    "contact_states",
    "forces",
    "friction_coefficients",
    "hook_mass",
    "lever",
    "lining_values_map",
    "linings_at_limit",
    "load",
    "overlap_of_pair",
    "pair_heats",
    "pair_speeds",
    "pair_torques",
    "speed",
    "surface_temperatures",
    "torques",
    "wall_profile",
    "wheel",
]

#: look of the torque of a motor
_MOTOR = {"color": GREEN, "ls": "--"}


def over_time(draw: Callable[[Result, Series, Axes], None]) -> Callable[..., Axes]:
    """A panel over time, with its axes and legend, from a function that draws a series
    into axes."""

    @functools.wraps(draw)
    def panel(
        result: Result, *, series: Series | None = None, ax: Axes | None = None
    ) -> Axes:
        axes = drawn_in(ax)
        axes.set_xlabel("time, s")
        if series is None:
            series = dense_grid(one_run(result), *span(result))
        draw(result, series, axes)
        finish([axes])
        return axes

    del panel.__wrapped__  # its signature is that of the panel
    return styled(panel)


def _curves(
    axes: Axes, s: Series, unit: str, words: str, *curves: tuple[Any, str, Any]
) -> None:
    """Curves of one quantity in the unit for reading: values (SI), label and look of
    each; those without values are left out."""
    read = reading(unit)
    for values, label, style in curves:
        if values is not None:
            axes.plot(s.t, read(values), label=label, **style)
    axes.set_ylabel(f"{words}, {read.name}")


# --- motion and forces ----------------------------------------------------------------


@over_time
def speed(result: Result, s: Series, axes: Axes) -> None:
    """Speed `ω` (rad/s) of the pulley or its like over time, and of the hook (m/s) on
    an axis of its own at the right.

    Example:
        >>> axes = sb.plot.panels.speed(result)
        >>> float(axes.lines[0].get_ydata()[0])
        24.0
    """
    body = result.scene.brake.words.body
    way = "" if s.motor_torque is None else ", below 0 upwards"
    turning = reading("rad/s")
    omega = turning(s.omega)
    axes.plot(s.t, omega, color=ink(), label=rf"speed of the {body} $\omega${way}")
    axes.set_ylabel(rf"$\omega$, {turning.name}")
    if s.hook_speed is not None and np.any(s.omega):
        keep_level(axes)
        moving = reading("m/s")
        v = moving(s.hook_speed)
        hook = axes.twinx()
        hook.plot(s.t, v, color=SKY, ls="--")
        label = in_words_of(result.scene, "speed of the hook $v$")
        axes.plot([], [], color=SKY, ls="--", label=label)
        # in the scale of the fast line, on the curve of the pulley where the rope is
        # rigid and in one layer
        ratio = float(np.abs(v).max() / np.abs(omega).max())
        hook.set(
            ylabel=f"$v$, {moving.name}", ylim=tuple(ratio * x for x in axes.get_ylim())
        )


@over_time
def torques(result: Result, s: Series, axes: Axes) -> None:
    """Torques (kN·m) of brake, load, motor and other parts on the shaft over time.

    Example:
        >>> axes = sb.plot.panels.torques(result)
        >>> axes.get_ylabel()
        'torque, kN·m'
    """
    others = None if s.motor_torque is None else s.shaft_torque
    _curves(
        axes,
        s,
        "N*m",
        "torque",
        (s.brake_torque, "brake $M_b$", {"color": BLUE}),
        (s.load_torque, r"load $M_\mathrm{load}$", {"color": PURPLE, "ls": "-."}),
        (s.motor_torque, "motor $M$", _MOTOR),
        (others, r"others $\Sigma M_\mathrm{shaft}$", {"color": ORANGE, "ls": ":"}),
    )


@over_time
def forces(result: Result, s: Series, axes: Axes) -> None:
    """Tensions (kN) at the ends of the band over time; of discs and shoes the forces
    (kN) of the actuator and on the linings.

    Example:
        >>> axes = sb.plot.panels.forces(result)
        >>> axes.get_ylabel()
        'tension, kN'
    """
    if s.slack_tension is not None:
        tight = (s.tight_tension, "tight end $T_n$", {"color": BLUE})
        slack = (s.slack_tension, "slack end $T_0$", {"color": SKY})
        _curves(axes, s, "N", "tension", tight, slack)
    elif s.lever_force is not None:
        curves: list[Any] = [(s.lever_force, "actuator $F$", {"color": SKY})]
        lining = result.scene.brake.words.lining
        differ = np.ptp(s.normal_load, axis=1).max() > 0
        for i in range(s.normal_load.shape[1] if differ else 1):
            which = f" on {lining} {i + 1}" if differ else ""
            curves.append(
                (s.normal_load[:, i], f"normal force $N${which}", {"ls": "--"})
            )
        _curves(axes, s, "N", "force", *curves)


@over_time
def linings_at_limit(result: Result, s: Series, axes: Axes) -> None:
    """Number `k` of the linings at their friction limit over time.

    Example:
        >>> axes = sb.plot.panels.linings_at_limit(result)
        >>> axes.get_ylabel()
        '$k$ of 8'
    """
    n = s.normal_load.shape[1]
    words = f"{result.scene.brake.words.lining}s at their limit $k$"
    axes.plot(s.t, s.at_limit, color=ORANGE, drawstyle="steps-post", label=words)
    axes.set(ylim=(-0.5, n + 0.5), ylabel=f"$k$ of {n}")
    axes.yaxis.set_major_locator(MaxNLocator(5, integer=True, steps=[1, 2, 5, 10]))


@over_time
def lever(result: Result, s: Series, axes: Axes) -> None:
    """Slack tension (kN) that the lever gives over time, or the force (kN) of the
    actuator.

    Example:
        >>> axes = sb.plot.panels.lever(result)
        >>> axes.get_ylabel()
        'tension, kN'
    """
    look = {"color": BLUE}
    if result.scene.brake.banded:
        slack = (s.slack_tension, "slack tension $T_0$", look)
        _curves(axes, s, "N", "tension", slack)
    else:
        force = (s.lever_force, "force of the actuator $F$", look)
        _curves(axes, s, "N", "force", force)
    _from_zero(axes)


@over_time
def load(result: Result, s: Series, axes: Axes) -> None:
    """Torques (kN·m) of the load and of a motor on the shaft over time.

    Example:
        >>> axes = sb.plot.panels.load(result)
        >>> axes.get_ylabel()
        'torque, kN·m'
    """
    given = (s.load_torque, "load torque on the shaft", {"color": VERMILLION})
    _curves(axes, s, "N*m", "torque", given, (s.motor_torque, "motor $M$", _MOTOR))
    _from_zero(axes)


@over_time
def hook_mass(result: Result, s: Series, axes: Axes) -> None:
    """Mass (t) on the hook over time.

    Raises `InputError` for a load that is no string of pipes.

    Example:
        >>> axes = sb.plot.panels.hook_mass(trip)
        >>> axes.get_ylabel()
        'mass, t'
    """
    string = result.scene.duty.load
    if not isinstance(string, AbstractString):
        why = "does not change its mass"
        raise input_error("duty.load", why, "plot.panels.load draws its torque")
    hook = look(result, s.t).hook
    assert hook is not None
    mass = np.asarray(hook.weight) / float(string.gravity)
    stepped = {"drawstyle": "steps-post", "color": PURPLE}
    _curves(axes, s, "kg", "mass", (mass, "mass on the hook", stepped))
    _from_zero(axes)


def _from_zero(axes: Axes) -> None:
    """All of the time, and 0 among the values."""
    times = axes.lines[0].get_xdata()
    axes.set(xlim=(times[0], times[-1]), ylim=(min(0.0, axes.get_ylim()[0]), None))  # pyright: ignore


# --- the two pairs of a staged brake --------------------------------------------------


@over_time
def pair_speeds(result: Result, s: Series, axes: Axes) -> None:
    """Speeds (rad/s) of pulley and bandage of a staged brake over time.

    Raises `InputError` for a standard brake, as all panels of two pairs.

    Example:
        >>> axes = sb.plot.panels.pair_speeds(staged)
        >>> axes.get_ylabel()
        'speed, rad/s'
    """
    _check_staged(result)
    pulley = (s.omega, r"pulley $\omega$", {"color": ink()})
    look = {"color": GREEN, "ls": "--"}
    bandage = (s.bandage_speed, r"bandage $\omega_b$", look)
    _curves(axes, s, "rad/s", "speed", pulley, bandage)


@over_time
def pair_torques(result: Result, s: Series, axes: Axes) -> None:
    """Friction torques (kN·m) of both pairs of a staged brake over time, and the torque
    up to which the internal pair sticks.

    Example:
        >>> axes = sb.plot.panels.pair_torques(staged)
        >>> axes.get_ylabel()
        'torque, kN·m'
    """
    _check_staged(result)
    external = s.pairs["external"].torque
    internal = s.pairs["internal"]
    most = {"color": BLUE, "ls": ":"}
    _curves(
        axes,
        s,
        "N*m",
        "torque",
        (external, r"band on bandage $M_\mathrm{ext}$", {"color": GREEN}),
        (internal.torque, r"pulley on bandage $\Lambda$", {"color": BLUE}),
        (internal.capacity, r"it sticks up to $M_\mathrm{int}$", most),
    )


@over_time
def pair_heats(result: Result, s: Series, axes: Axes) -> None:
    """Friction heat (kJ) of both pairs of a staged brake since the start.

    Example:
        >>> axes = sb.plot.panels.pair_heats(staged)
        >>> axes.get_ylabel()
        'friction heat, kJ'
    """
    _check_staged(result)
    heats = [
        (s.pairs[name].heat, f"{name} pair", {"color": colour})
        for name, colour in _PAIRS.items()
    ]
    _curves(axes, s, "J", "friction heat", *heats)


@styled
def overlap_of_pair(
    result: Result,
    pair: str = "external",
    *,
    running_in: RunningIn | None = None,
    series: Series | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Overlap coefficients of a pair of a staged brake (K, Fig. 5): filled while the
    pair slides, hatched while it sticks.

    - `pair`: `external` or `internal`
    - `running_in`: how the contact grows with the friction work

    Example:
        >>> axes = sb.plot.panels.overlap_of_pair(staged, "internal")
        >>> axes.get_ylabel().splitlines()
        ['internal', 'overlap (–)']
    """
    _check_staged(result)
    axes = drawn_in(ax)
    if series is None:
        series = dense_grid(result, *span(result))
    t = series.t
    colour = _PAIRS[pair]
    o = overlap(result, t, running_in)
    dynamic = getattr(o, f"{pair}_dynamic")
    static = getattr(o, f"{pair}_static")
    axes.fill_between(
        t, dynamic, lw=0, color=colour, alpha=0.7, label="slides (dynamic)"
    )
    axes.fill_between(
        t,
        static,
        hatch="///",
        lw=0,
        facecolor="none",
        edgecolor=colour,
        label="sticks (static)",
    )  # pyright: ignore
    axes.set(xlabel="time, s", ylim=(0, 1), ylabel=f"{pair}\noverlap (–)")
    finish([axes])
    return axes


#: colours of the two pairs
_PAIRS = {"external": GREEN, "internal": BLUE}


def _check_staged(result: Result) -> None:
    if not result.scene.brake.in_series:
        why = "is not staged: it has one friction pair"
        raise input_error("brake", why, "plot.stop draws its run")


# --- temperatures ---------------------------------------------------------------------

#: colours of what gets hot
HOT = {
    "rim": VERMILLION,
    "linings": ORANGE,
    "band": BLUE,
    "linings, outer face": GREEN,
    "wetted wall": PURPLE,
    "coolant, outlet": SKY,
}
#: brake applications above which surfaces are drawn as an envelope
_FEW = 5


@styled
def surface_temperatures(
    result: Result,
    *,
    start: float | None = None,
    end: float | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Temperatures (°C) of rim, linings and band over time, and the permissible ones.

    Of several lining walls the coolest and the hottest. Of a whole run with many brake
    applications the maximum and the minimum in each cycle, from one strong application
    to the next.

    - `start`, `end` (s): default those of the run

    Raises `InputError` if the scene has no heat.

    Example:
        >>> axes = sb.plot.panels.surface_temperatures(heated)
        >>> axes.get_ylabel()
        'surface temperature, °C'
    """
    check_heated(result)
    axes = drawn_in(ax)
    low, high = _between(result, start, end)
    t = cells(result, low, high)
    shown = temperatures_at(result, t)
    brake = result.scene.brake
    lining = brake.words.lining
    body = brake.words.body
    others = {"rim": body, "lining": lining, "linings": f"{lining}s"}
    own = {} if brake.banded else others
    starts = strong_applications(result)
    in_cycles = (low, high) == span(result) and len(starts) > _FEW
    for name, T in shown.items():
        words = own.get(name, name)
        colour = HOT.get(name, "0.5")
        if in_cycles:
            bounds = np.unique([low, *starts[1:], high])
            _envelope(axes, t, T, bounds, colour, words)
            continue
        # the rim broader, as the faces of linings are often as hot
        lw = 3.0 if name == "rim" else 1.3
        several = T.shape[1] > 1
        named = (f"{words}, hottest", f"{words}, coolest") if several else (words, None)
        _extremes(axes, t, T, colour, named, lw)
    if in_cycles:
        axes.plot([], [], color=GREY, ls=":", label="lowest of a cycle")
    heat = result.scene.network
    limits = {
        name: (f"{own.get(name, name)} ≤", "--", T)
        for name, T in heat.permissible_at.items()
        # the outer face of the linings has the limit of the linings
        if name != "outer"
    }
    limits["coolant, outlet"] = "coolant boils at", ":", heat.boiling
    degrees = reading("K")
    coldest = min(T.min() for T in shown.values())
    hottest = max(T.max() for T in shown.values())
    for name, (words, style, most) in limits.items():
        if most is None:
            continue
        limit = float(degrees(most))
        look = {"color": HOT[name], "lw": 1.3, "ls": style}
        label = f"{words} {limit:.4g} {degrees.name}"
        if limit < hottest + 1.5 * (hottest - coldest):
            axes.axhline(limit, label=label, **look)
        else:
            axes.plot([], [], label=f"{label} above", **look)
    axes.set_xlim(low, high)
    axes.set(xlabel="time, s", ylabel=f"surface temperature, {degrees.name}")
    finish([axes])
    return axes


@styled
def friction_coefficients(
    result: Result,
    *,
    start: float | None = None,
    end: float | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Coefficients of friction of all pairs over time, of several linings the maximum
    and the minimum.

    - `start`, `end` (s): default those of the run

    Example:
        >>> axes = sb.plot.panels.friction_coefficients(heated)
        >>> axes.get_xlabel()
        'time, s'
    """
    axes = drawn_in(ax)
    low, high = _between(result, start, end)
    t = cells(result, low, high)
    pairs = result.series(t).pairs
    for (name, pair), colour in zip(pairs.items(), (GREEN, BLUE), strict=False):
        if pair.friction_coefficient is not None:
            f = np.asarray(pair.friction_coefficient)
            words = name if len(pairs) > 1 else "when sliding"
            differ = np.ptp(f, axis=1).max() > 1e-9
            lowest = "lining with the minimum" if differ else None
            _extremes(axes, t, f, colour, (words, lowest))
    bottom, top = axes.get_ylim()
    if top - bottom < 0.12 * top:  # hardly changes: no axis of a few thousandths
        axes.set_ylim(0.0, 1.25 * top)
    axes.set_xlim(low, high)
    axes.set(xlabel="time, s", ylabel="coefficient of\nfriction (–)")
    finish([axes])
    return axes


@styled
def wall_profile(
    result: Result,
    time: float,
    wall: str | None = None,
    *,
    ax: Axes | None = None,
) -> Axes:
    """Temperature (°C) through the depth (mm) of a wall at a time (s), a line for each
    of its copies.

    - `wall`: name of a body in layers; default that of the rim, else the first one

    Raises `InputError` if the scene has no such wall.

    Example:
        >>> axes = sb.plot.panels.wall_profile(heated, 1.0)
        >>> axes.get_xlabel()
        'depth below the friction surface, mm'
    """
    chosen = wall_of(result, wall)
    brake = result.scene.brake
    words = chosen.name
    if not brake.banded:
        own = {"rim": brake.words.body, "lining": brake.words.lining}
        words = own.get(words, words)
    axes = drawn_in(ax)
    depth = reading("m", 0.01)
    degrees = reading("K")
    T = degrees(result.series([time]).temperature)[0]
    layers = layers_of(result, chosen, T)
    axes.plot(depth(chosen.centres), layers.T, color=VERMILLION, marker=".", lw=1.0)
    axes.set_title(f"through the {words} at {number(time, 's', count=4)}", loc="left")
    axes.set(
        xlabel=f"depth below the friction surface, {depth.name}",
        ylabel=f"temperature, {degrees.name}",
    )
    axes.grid(alpha=0.3)
    return axes


def check_heated(result: Result) -> None:
    """Raise `InputError` for a scene without heat."""
    if not result.scene.heated:
        why = "has no heat: there are no temperatures to draw"
        raise input_error("scene", why, "give it heat, as simbrake.lumped_heat does")


def _between(
    result: Result, start: float | None, end: float | None
) -> tuple[float, float]:
    first, last = span(one_run(result))
    low = first if start is None else float(start)
    high = last if end is None else float(end)
    return low, high


def temperatures_at(result: Result, t: Times) -> dict[str, Float[np.ndarray, "t n"]]:
    """Temperatures (°C or °F) of the surfaces that the scene names, else of all
    nodes."""
    s = result.series(t)
    surfaces = {
        "rim": s.rim_temperature,
        "linings": s.lining_temperature,
        "band": s.band_temperature,
        "linings, outer face": s.lining_outer_temperature,
        "wetted wall": s.wetted_temperature,
        "coolant, outlet": s.coolant_temperature,
    }
    named = {name: T for name, T in surfaces.items() if T is not None}
    shown = named or {"nodes": s.temperature}
    degrees = reading("K")
    return {name: degrees(T) for name, T in shown.items()}


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
        inside = [a + extreme(values[a:b]) for a, b in pairwise(cuts) if b > a]
        at = np.array(inside, np.intp)
        label = words if style == "-" else None
        axes.plot(t[at], values[at], color=colour, ls=style, label=label)
        lines.append(np.interp(t, t[at], values[at]))
        known &= (t >= t[at[0]]) & (t <= t[at[-1]])
    axes.fill_between(t, *lines, where=known.tolist(), color=colour, alpha=0.15, lw=0)


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


def layers_of(
    result: Result, wall: Wall, T: Float[np.ndarray, "... k"]
) -> Float[np.ndarray, "... copies layers"]:
    """Temperatures of the layers of a wall, of all its copies, among those of all
    nodes."""
    bodies = [name.partition("[")[0] for name in result.nodes]
    nodes = [i for i, body in enumerate(bodies) if body == wall.name]
    return T[..., nodes].reshape(*T.shape[:-1], wall.copies, wall.layers)


def wall_of(result: Result, name: str | None) -> Wall:
    """The wall of a name; default that of the rim, else the first one. Raises
    `InputError` if there is none."""
    heat = result.scene.network
    walls = heat.walls
    if not walls:
        in_layers = "no body of the scene is in layers"
        why = in_layers if result.scene.heated else "the scene has no heat"
        hint = "there is no depth to draw; layered_heat makes walls"
        raise input_error("wall", why, hint)
    names = [wall.name for wall in walls]
    if name is None:
        rim = None if heat.rim is None else place_of(heat.rim)[0]
        name = rim if rim in names else names[0]
    if name not in names:
        hint = f"there are: {', '.join(names)}"
        raise input_error("wall", f"there is no wall {name!r}", hint)
    return walls[names.index(name)]


# --- maps -----------------------------------------------------------------------------


@styled
def contact_states(
    result: Result, pair: str | None = None, *, ax: Axes | None = None
) -> Axes:
    """Stick and slip of each lining over the whole run, a line for each lining from the
    slack end: light blue while it sticks, orange while it slides ahead, purple while it
    slides back.

    - `pair`: name of a friction pair; default the first one

    Raises `InputError` where the linings act as one.

    Example:
        >>> axes = sb.plot.panels.contact_states(chain)
        >>> axes.get_ylabel()
        'lining, from the slack end'
    """
    recorded = result.record.modes.contacts
    if not recorded:
        why = "has linings that act as one: there are no single contacts to draw"
        raise input_error("brake", why, "plot.stop draws how many are at their limit")
    names = list(result.scene.brake.pairs)
    if pair not in (None, *names):
        hint = f"there are: {', '.join(names)}"
        raise input_error("pair", f"there is no pair {pair!r}", hint)
    number_of_pair = 0 if pair is None else names.index(pair)
    axes = drawn_in(ax)
    t = result.record.rows.t[: result.record.count + 1]
    states = list(recorded.values())[number_of_pair][: len(t)]
    changes = np.append(True, np.any(states[1:] != states[:-1], axis=1))
    edges = np.append(t[changes], t[-1])
    linings = np.arange(states.shape[1] + 1) + 0.5
    kinds = (Contact.SLIDES_BACK, Contact.STICKS, Contact.SLIDES)
    colours = ListedColormap([CONTACT_COLOURS[kind] for kind in kinds])
    axes.pcolormesh(edges, linings, states[changes].T, cmap=colours, vmin=-1, vmax=1)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set(xlabel="time, s", ylabel="lining, from the slack end")
    return axes


@styled
def lining_values_map(
    result: Result,
    quantity: str = "temperature",
    *,
    pair: str = "external",
    start: float | None = None,
    end: float | None = None,
    ax: Axes | None = None,
) -> Axes:
    """A quantity of every lining over time as a map with its colour bar, linings of a
    band from the slack to the tight end.

    In a run with several stops what lasts for less than a line of the map is drawn by
    its greatest value, so that no brake application is lost.

    - `quantity`, `pair`: as of `simbrake.plot.lining_map`
    - `start`, `end` (s): default those of the run

    Raises `InputError` for quantities that the run does not have.

    Example:
        >>> axes = sb.plot.panels.lining_values_map(result, "normal_load")
        >>> axes.get_xlabel()
        'time, s'
    """
    low, high = _between(result, start, end)
    edges = cells(result, low, high)
    values = lining_values(result, quantity, edges, pair=pair)
    view, words = view_of(quantity)
    axes = drawn_in(ax)
    brake = result.scene.brake
    n = brake.linings.count
    shown = np.broadcast_to(view(values), (len(edges) - 1, n)).T
    if len(result.stops) > 1:
        edges, shown = _wide_enough(edges, shown)
    bottom = float(shown.min())
    top = float(shown.max())
    mesh = axes.pcolormesh(
        edges,
        np.arange(n + 1) + 0.5,
        shown,
        cmap="inferno" if quantity in _HEATS else "viridis",
        rasterized=True,
        vmin=bottom,
        vmax=top if top > bottom else bottom + 1.0,
    )
    axes.figure.colorbar(mesh, ax=axes, label=view.axis(words, " (–)"), pad=0.01)
    axes.set_xlim(low, high)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    one_band = len(brake.bands_of_linings) == 1
    order = "from the slack to the tight end" if one_band else "band after band"
    ylabel = f"lining, {order}" if brake.banded else brake.words.lining
    axes.set(xlabel="time, s", ylabel=ylabel)
    return axes


_HEATS = ("temperature", "friction_heat", "friction_power")
#: lines of a map over time that has narrower cells: no more than its pixels
_LINES = 400


def _wide_enough(
    edges: Float[np.ndarray, " m"], values: Float[np.ndarray, "n cells"]
) -> tuple[np.ndarray, np.ndarray]:
    """Edges and values of a map whose cells all can be seen: where some are narrower
    than a line, even lines with the value of the greatest magnitude in each."""
    wide = (edges[-1] - edges[0]) / _LINES
    if np.min(np.diff(edges)) >= wide:
        return edges, values
    lines = np.linspace(edges[0], edges[-1], _LINES + 1)
    first = np.clip(np.searchsorted(lines, edges[:-1], "right") - 1, 0, _LINES - 1)
    last = np.clip(np.searchsorted(lines, edges[1:], "left"), first + 1, _LINES)
    greatest = np.zeros((len(values), _LINES))
    size = np.full(greatest.shape, -1.0)
    for i, column in enumerate(values.T):
        inside = (slice(None), slice(first[i], last[i]))
        new = np.abs(column)[:, None] > size[inside]
        greatest[inside] = np.where(new, column[:, None], greatest[inside])
        size[inside] = np.where(new, np.abs(column)[:, None], size[inside])
    return lines, greatest


def view_of(quantity: str) -> tuple[Reading, str]:
    """How a quantity of linings is read, and its words with symbols set."""
    about = LINING_QUANTITIES.get(quantity, ABOUT_HEAT)
    symbols = re.sub(r"\b([NTFfuv])\b", r"$\1$", about.words)
    words = symbols.replace("|Tᵢ − Tᵢ₋₁|", "$|T_i - T_{i-1}|$")
    return reading(about.unit, about.like), words
