"""The pulley and its linings, seen along the shaft: tension and load along the band,
pads, shoes."""

import math
from collections.abc import Callable
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
from jaxtyping import Float
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Arc, Circle, FancyArrowPatch, Patch, Wedge
from matplotlib.ticker import MaxNLocator

from .._base._faults import input_error
from .._base._numbers import digits, number, reading
from ..brakes._pressed import DiscBrake, ShoeBrake
from ..brakes.band import AbstractStiffness, ParallelBands
from ..brakes.design import AbstractBandBrake
from ..hybrid.arrays import Array
from ..outputs.probe import Probe, tension_before
from ..outputs.quantities import times_within
from ..parts.scene import banded_brake
from ..runs.linings import CONTACT_WORDS, Contact, lining_contacts
from ..runs.result import Result, look
from .drawing import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    VERMILLION,
    drawn_in,
    finish,
    head,
    ink,
    name_marks,
    one_run,
    sheet,
    span,
    styled,
)

# angles (rad) at which each lining begins and ends
Ends: TypeAlias = Float[np.ndarray, "n 2"]
PerLining: TypeAlias = Float[np.ndarray, " n"]

#: colour of stick and slip; light for sticking, so that numbers stay readable
CONTACT_COLOURS = {
    Contact.SLIDES: VERMILLION,
    Contact.AT_LIMIT: ORANGE,
    Contact.STICKS: "#9ecae1",
    Contact.SLIDES_BACK: PURPLE,
    Contact.FREE: "0.88",
}
#: radii in units of the drawn rim
RIM = 1.0
LINING = (1.02, 1.18)
#: shares of the largest speed of a run: rounding, which is left at the instant of a
#: stop; and 0 to the eye, as in the last moments before a stop, where maxima often lie
_STILL = 1e-9
_SLIGHT = 1e-5
BAND = 1.21
#: sides of the two shoes, and angles of their pins: a little beside the vertical through
#: the shaft
SIDES = np.array([-1.0, 1.0])
PINS = -0.5 * math.pi + 0.12 * SIDES


def lining_edges(brake: AbstractBandBrake, band: int = 0) -> Ends:
    """Angles (rad) at which each lining of a band begins and ends, from the slack end
    on, gaps between them included.

    Of bands in parallel the first one, as all have its gaps.
    """
    stiffness: Any = brake.stiffnesses[band]
    if isinstance(stiffness, ParallelBands):
        stiffness = stiffness.bands[0]
    gap = (
        getattr(stiffness, "gap", 0.0)
        if isinstance(stiffness, AbstractStiffness)
        else 0.0
    )
    angle = np.asarray(brake.bands_of_linings[band].weights, np.float64)
    return side_by_side(angle, np.asarray(gap, np.float64))


def side_by_side(angle: PerLining, gap: float | np.ndarray = 0.0) -> Ends:
    """Angles at which linings begin and end, with one gap between all of them or one
    for each."""
    begin = np.append(0.0, np.cumsum(angle[:-1] + gap))
    return np.stack([begin, begin + angle], axis=1)


def on_circle(edges: Ends) -> Ends:
    """Angles in the figure (rad, counter-clockwise from the right) of angles from the
    slack end on.

    The wrap is centred on the top. The pulley turns counter-clockwise: it runs onto the
    band at the right, the tight end, and off at the left.
    """
    return math.pi / 2 + float(np.max(edges)) / 2 - edges


def pressed_angles(brake: DiscBrake | ShoeBrake) -> Ends:
    """Angles in the figure at which pads and shoes begin and end: two pads at each
    calliper, these evenly around the disc; left the leading shoe, as the drum turns
    counter-clockwise to its pin."""
    if isinstance(brake, DiscBrake):
        pads = brake.linings
        callipers = -(-pads.count // 2)
        middle = 0.5 * math.pi + 2 * math.pi * (np.arange(pads.count) // 2) / callipers
        half = 0.5 * float(pads.angle)
        return np.stack([middle - half, middle + half], axis=1)
    shoes = brake.linings
    # angles count from the pin, up along the side of a shoe
    along = np.array([float(shoes.start), float(shoes.end)])
    return np.sort(PINS[:, None] + SIDES[:, None] * along, axis=1)


def spot(radius: float | Array, angle: float | Array) -> Float[np.ndarray, "... 2"]:
    """Points at a radius and an angle."""
    return np.stack(
        np.broadcast_arrays(radius * np.cos(angle), radius * np.sin(angle)), axis=-1
    )


def _sector(
    axes: Axes, outer: float, inner: float, ends: Any = (0.0, 2 * math.pi), **look: Any
) -> None:
    """A part of a ring between two angles (rad), by default all of it."""
    angles = np.degrees(np.sort(ends))
    axes.add_patch(Wedge((0, 0), outer, *angles, width=outer - inner, **look))


def _step(angles: Ends) -> int:
    """Of how many linings one has its numbers, so that they stay readable."""
    return -(-len(angles) // 30)


def _draw_wheel(axes: Axes, angles: Ends, contacts: dict[str, np.ndarray]) -> None:
    """The rim, and on it a ring of linings for each friction pair, that under the band
    outermost, by stick and slip."""
    _sector(axes, RIM, RIM - 0.06, color="0.6", zorder=1)
    radii = np.linspace(*LINING, len(contacts) + 1)[::-1]
    for (pair, states), outer, inner in zip(
        contacts.items(), radii, radii[1:], strict=False
    ):
        for ends, state in zip(angles, states, strict=True):
            _sector(
                axes,
                outer,
                inner,
                ends,
                fc=CONTACT_COLOURS[state],
                ec="white",
                lw=min(0.8, 24 / len(angles)),
                gid=pair,
                zorder=2,
            )


#: half of the width of a label of an end of the band, with some white
_HALF_OF_LABEL = 0.29


class BandEnd(NamedTuple):
    """A straight end of the band: the points where it leaves the wheel and where it
    stops, the place of its label, and which side of the label is there."""

    start: Float[np.ndarray, " 2"]
    stop: Float[np.ndarray, " 2"]
    label: Float[np.ndarray, " 2"]
    side: Literal["center", "left", "right"]


def band_ends(angles: Ends) -> list[BandEnd]:
    """The two ends of a band on linings at these angles in the figure, slack end
    first."""
    ends = []
    for angle, direction in ((angles[0, 0], 1.0), (angles[-1, 1], -1.0)):
        start = spot(BAND, angle)
        tangent = direction * spot(1.0, angle + 0.5 * math.pi)
        # the two ends of a wide wrap stop before they cross
        towards = -np.sign(start[0]) * tangent[0]
        length = 0.5
        if towards > 0:
            length = min(length, (abs(start[0]) - 0.05) / towards)
        stop = start + length * tangent
        label = stop + 0.02 * tangent
        side = "center"
        if abs(label[0]) < _HALF_OF_LABEL:  # no room for both below the wheel
            label = np.array([-direction * 2.2, -1.6])
            side = "left" if direction > 0 else "right"
        ends.append(BandEnd(start, stop, label, side))
    return ends


def _draw_band(axes: Axes, angles: Ends, labels: tuple[str, str]) -> None:
    """The band with its two straight ends and their labels, slack end first."""
    turn = np.linspace(angles[0, 0], angles[-1, 1], 400)
    axes.plot(*spot(BAND, turn).T, color=GREY, lw=2.5, zorder=3)
    for end, words in zip(band_ends(angles), labels, strict=True):
        _draw_arrow(axes, end.start, end.stop, mutation_scale=14, color=GREY, lw=2.5)
        axes.annotate(
            words,
            tuple(end.label),
            (0, -3),
            textcoords="offset points",
            va="top",
            ha=end.side,
        )


def _draw_arrow(
    axes: Axes, start: Float[np.ndarray, "2"], end: Float[np.ndarray, "2"], **look: Any
) -> None:
    axes.add_patch(FancyArrowPatch(tuple(start), tuple(end), arrowstyle="-|>", **look))


def _draw_rotation(axes: Axes, result: Result, omega: float, radius: float) -> None:
    """An arrow round the centre in the sense of the rotation, with the speed."""
    fastest = np.max(np.abs(result.record.compact().states.omega))
    turns = abs(omega) > _STILL * fastest
    if turns:
        low = -50.0
        high = 230.0
        axes.add_patch(
            Arc(
                (0, 0),
                2 * radius,
                2 * radius,
                theta1=low,
                theta2=high,
                color=ink(),
                lw=1.4,
            )
        )
        tip, back = (high, high - 14) if omega > 0 else (low, low + 14)
        ends = [spot(radius, math.radians(a)) for a in (back, tip)]
        _draw_arrow(axes, *ends, mutation_scale=12, color=ink(), lw=1.4, gid="rotation")
    speed = reading("rad/s")
    size = digits(speed(omega if abs(omega) > _SLIGHT * fastest else 0.0), 3)
    words = f"$\\omega$\n{size}\n{speed.name}" if turns else "at rest"
    axes.text(0, 0, words, ha="center", va="center")


def _contact_legend(
    contacts: dict[str, np.ndarray], lining: str = "lining"
) -> list[Artist]:
    """Patches for the contacts that occur."""
    present = set(
        np.concatenate([states.ravel() for states in contacts.values()]).tolist()
    )
    return [
        Patch(color=CONTACT_COLOURS[c], label=f"{lining} {words}")
        for c, words in CONTACT_WORDS.items()
        if c in present
    ]


# --- along the band -----------------------------------------------------------------

# where the scales begin, and their length; of the load inwards
_TENSION = (1.30, 0.72)
_LOAD = (0.67, -0.37)
#: bars of the load of the first friction pair, and of the others
_BARS: tuple[dict[str, Any], ...] = (
    {"fc": GREEN, "alpha": 0.75, "gid": "load", "zorder": 2},
    {"fill": False, "ec": GREY, "lw": 0.7, "gid": "rim load"},
)


@styled
def pulley(
    result: Result, time: float | int | None = None, *, figure: Figure | None = None
) -> Figure:
    """Tension of the band and normal load of every lining on the pulley's circle at one
    time (Z, Fig. 5).

    Outwards the tension `T_0…T_n` at the ends of each lining, joined by a line to
    guide the eye; inwards the normal load `N_i` of each lining. Linings at their
    true angles, coloured by stick and slip. Of a staged brake the outer half of a
    lining shows the band on it, the inner half the lining on the rim, whose load has an
    outline.

    - `time` (s): default that of the maximum tension; at an event the values after it

    Of alike rims one is drawn; unlike bands have a circle each, side by side in one
    scale.

    Raises `InputError` for a time outside the run, for a batch of runs and for a brake
    without a band (`pressed`).

    Example:
        >>> figure = sb.plot.pulley(result, 0.5)
        >>> figure.get_suptitle().splitlines()[1]
        'tension of the band and normal load of the linings at $t$ = 0.5 s'
    """
    brake = banded_brake(one_run(result).scene)
    t, p = _moment(result, time, "max_tension", lambda p: p.shown.tension)
    figure = sheet(figure, 10.0 * len(brake.bands_of_linings), 10.8)
    draw_moment(
        figure,
        result,
        t,
        p,
        tops_of(p),
        ", at the maximum tension" if time is None else "",
    )
    return figure


def tops_of(p: Probe) -> tuple[float, float]:
    """Largest tension and load (in kN, or klbf) at some instants: the ends of the two
    scales."""
    force = reading("N")
    tensions = tension_before(p.shown, p.flows.contact.slack_tension), p.shown.tension
    loads = [pair.normal for pair in p.shown.pairs]
    return (
        max(float(np.max(force(x))) for x in tensions),
        max(float(np.max(force(x))) for x in loads),
    )


def draw_moment(
    figure: Figure,
    result: Result,
    t: float,
    p: Probe,
    tops: tuple[float, float],
    why: str = "",
) -> None:
    """Draw a run at a time into a figure; `tops` as of `tops_of`, `why` that time."""
    brake = banded_brake(result.scene)
    contacts = lining_contacts(result, p)
    bands = len(brake.bands_of_linings)
    for j, axes in enumerate(np.ravel(figure.subplots(1, bands, squeeze=False))):
        _draw_band_of(axes, result, p, j, tops)
        axes.set_title(f"band {j + 1}" if bands > 1 else "")
    title = f"tension of the band and normal load of the linings at $t$ = {digits(t, 4)} s{why}"
    torque = reading("N*m")
    brakes = float(torque(p.flows.contact.brake_torque[0]))
    title += f"\nbrake torque {digits(brakes, 4)} {torque.name}"
    title += f" of {brake.rims} rims" if brake.rims > 1 else ""
    rules = [brake.force_words] if brake.force_words else []
    rules += ["outer half of a lining: band on lining, inner half: lining on rim"] * (
        len(contacts) > 1
    )
    if np.isin(next(iter(contacts.values())), (Contact.STICKS, Contact.AT_LIMIT)).any():
        distribution = result.record.system.mechanism.distribution  # pyright: ignore
        rules.append(f"load sharing of sticking linings: {distribution}")
    head(figure, result.scene, title)
    unit = reading("N").name
    handles: list[Artist] = [
        Line2D(
            [],
            [],
            color=BLUE,
            marker="o",
            ms=3,
            label=f"tension $T$ of the band, {unit}, outwards",
        ),
        Patch(
            color=GREEN,
            alpha=0.75,
            label=f"normal load $N$ of a lining, {unit}, inwards",
        ),
    ]
    if len(contacts) > 1:
        label = f"load of a lining on the rim, {unit}"
        handles.append(Patch(fill=False, ec=GREY, label=label))
    name_marks(figure, [*handles, *_contact_legend(contacts)], rule="\n".join(rules))


def _draw_band_of(
    axes: Axes, result: Result, p: Probe, band: int, tops: tuple[float, float]
) -> None:
    """The pulley with one of its bands, its linings, tension and loads."""
    brake = banded_brake(result.scene)
    counts = [linings.count for linings in brake.bands_of_linings]
    first = sum(counts[:band])
    own = slice(first, first + counts[band])
    angles = on_circle(lining_edges(brake, band))
    contacts = lining_contacts(result, p)
    states = {pair: each[0, own] for pair, each in contacts.items()}
    _draw_wheel(axes, angles, states)
    before = tension_before(p.shown, p.flows.contact.slack_tension)
    force = reading("N")
    ahead = force(before[0, own])
    behind = force(p.shown.tension[0, own])
    tension = np.append(ahead[0], behind)
    loads = [force(pair.normal)[0, own] for pair in p.shown.pairs]
    _draw_around(axes, angles, first, tension, loads, tops)
    _draw_rotation(axes, result, float(p.y.omega[0]), 0.2)


@styled
def wheel(
    result: Result, time: float, band: int = 1, *, ax: Axes | None = None
) -> Axes:
    """The circle of `simbrake.plot.pulley` alone: linings of a band coloured by stick
    and slip, tension `T` of the band (kN) outwards, normal loads `N` (kN) inwards.

    - `time` (s); at an event the values after it
    - `band`: number of the band, from 1

    Raises `InputError` for a time outside the run, for a band that the brake does not
    have, and for a brake without one.

    Example:
        >>> axes = sb.plot.panels.wheel(result, 0.5)
        >>> axes.get_aspect()
        1.0
    """
    count = len(banded_brake(one_run(result).scene).bands_of_linings)
    if not 1 <= band <= count:
        raise input_error("band", f"there is no band {band}", f"there are 1…{count}")
    t = float(times_within([time], *span(result), "time")[0])
    p = look(result, t)
    axes = drawn_in(ax, 9.0, 9.0)
    _draw_band_of(axes, result, p, band - 1, tops_of(p))
    return axes


def _draw_around(
    axes: Axes,
    angles: Ends,
    first: int,
    tension: Float[np.ndarray, " m"],
    loads: list[PerLining],
    tops: tuple[float, float],
) -> None:
    """Numbers of the linings of a band, of which `first` are before it, its tension and
    loads (kN, or klbf), and its ends.

    `tops`: maxima of the two scales
    """
    # of the outermost ring
    middle = LINING[1] - 0.5 * (LINING[1] - LINING[0]) / len(loads)
    for i, angle in enumerate(angles.mean(axis=1)):
        if i % _step(angles):
            continue
        x, y = spot(middle, angle)
        axes.text(x, y, str(first + i + 1), ha="center", va="center", zorder=4)
    _draw_tension(axes, tension, angles, tops[0])
    _draw_load(axes, loads, angles, tops[1])
    reverse = tension[-1] < tension[0]
    slack, tight = (
        ("lever end, now tight", "anchor end, now slack")
        if reverse
        else ("slack end", "tight end")
    )
    unit = reading("N").name
    ends = (
        f"{slack} (lever)\n$T_0$ = {digits(tension[0], 4)} {unit}",
        f"{tight} (anchor)\n$T_n$ = {digits(tension[-1], 4)} {unit}",
    )
    _draw_band(axes, angles, ends)
    # the curve of a wide wrap comes down between the ends
    low = min(-1.85, 2.3 * float(np.sin(angles).min()))
    axes.set(aspect="equal", xlim=(-2.25, 2.25), ylim=(low, 2.15))
    axes.axis("off")


def _moment(
    result: Result, time: float | int | None, peak: str, values: Callable[[Probe], Any]
) -> tuple[float, Probe]:
    """The time to draw, by default that of the maximum of some values, and the run
    there."""
    if time is not None:
        t = float(times_within([time], *span(result), "time")[0])
        return t, look(result, t)
    t = float(result.report().peaks[peak].time)
    # what jumps at an event has its maximum on one side of it
    return t, max(
        (look(result, t, left=left) for left in (False, True)),
        key=lambda p: float(np.max(values(p))),
    )


def _rings(
    axes: Axes,
    top: float,
    count: int,
    scale: tuple[float, float],
    angles: Ends,
    gid: str,
) -> float:
    """Arcs of a scale with their values; returns the value at its far end."""
    unit = reading("N").name
    top = top if top > 0 else 1.0
    values = MaxNLocator(count, steps=[1, 2, 2.5, 5, 10]).tick_values(0.0, top)
    ticks = np.asarray(values)
    ticks = ticks[(ticks >= 0) & (ticks <= top * 1.0001)]
    turn = np.linspace(angles[0, 0], angles[-1, 1], 300)
    for value in ticks:
        radius = scale[0] + scale[1] * value / top
        axes.plot(*spot(radius, turn).T, color="0.85", lw=0.7, zorder=0, gid="scale")
        # outside of the wrap, at its slack end, where the curve is low
        x, y = spot(radius, turn[0] + 0.05 / radius)
        # the outermost
        last = value == (ticks[0] if scale[1] < 0 else ticks[-1])
        words = f"{value:g} {unit}" if last else f"{value:g}"
        axes.text(
            x,
            y,
            words,
            color=GREY,
            rotation_mode="anchor",
            gid=gid,
            ha="right",
            va="top",
            rotation=math.degrees(turn[0]) - 180.0,
        )
    return top


def _radial(
    axes: Axes, radius: float, angle: float, words: str, *, outwards: bool, **look: Any
) -> None:
    """A number written along the radius, always readable from below or the side."""
    degrees = math.degrees(angle) % 360
    flipped = 90 < degrees < 270
    x, y = spot(radius, angle)
    axes.text(
        x,
        y,
        words,
        zorder=5,
        ha="left" if outwards != flipped else "right",
        va="center",
        rotation=degrees - 180 if flipped else degrees,
        rotation_mode="anchor",
        **look,
    )


def _draw_tension(
    axes: Axes, tension: Float[np.ndarray, " m"], angles: Ends, most: float
) -> None:
    top = _rings(axes, most, 4, _TENSION, angles, "tension scale")
    radius = _TENSION[0] + _TENSION[1] * tension / top
    # both ends of each lining: over a gap the tension stays
    turn = angles.ravel()
    r = np.stack([radius[:-1], radius[1:]], axis=1).ravel()
    axes.fill(
        *np.concatenate([spot(r, turn), spot(_TENSION[0], turn)[::-1]]).T,
        color=BLUE,
        alpha=0.12,
        lw=0,
        zorder=1,
    )
    axes.plot(
        *spot(r, turn).T, color=BLUE, marker="o", ms=3, lw=1.2, gid="tension", zorder=4
    )
    step = _step(angles)
    for i, angle in enumerate(np.append(angles[:, 0], angles[-1, 1])):
        axes.plot(
            *spot(np.array([_TENSION[0], radius[i]]), angle).T,
            color=BLUE,
            lw=0.7,
            zorder=3,
        )
        if i % step == 0 or i == len(angles):
            words = digits(tension[i], 3)
            _radial(
                axes, radius[i] + 0.04, angle, words, outwards=True, gid="T", color=BLUE
            )


def _draw_load(axes: Axes, loads: list[PerLining], angles: Ends, most: float) -> None:
    """Loads of the linings inwards: filled those of the first friction pair, as
    outlines those of the others."""
    top = _rings(axes, most, 2, _LOAD, angles, "load scale")
    step = _step(angles)
    for i, (begin, end) in enumerate(angles):
        middle = (begin + end) / 2
        half = 0.36 * (end - begin)
        for k, load in enumerate(loads):
            inner = _LOAD[0] + _LOAD[1] * load[i] / top
            bar = (middle - half, middle + half)
            _sector(axes, _LOAD[0], inner, bar, **_BARS[min(k, 1)])
        if i % step == 0:
            _radial(
                axes,
                0.92,
                middle,
                digits(loads[0][i], 3),
                outwards=False,
                gid="N",
                color="#00604a",
            )


# --- pads and shoes -----------------------------------------------------------------


@styled
def pressed(
    result: Result, time: float | int | None = None, *, figure: Figure | None = None
) -> Figure:
    """Pads of a disc brake, or shoes of a double-shoe brake, at one time, with the
    pressure and the forces on them.

    Left the linings at their true angles and radii, coloured by stick and slip; right
    the pressure along a lining: of pads over the radius, of shoes over the angle
    from the pin.

    - `time` (s): default that of the maximum normal force; at an event the values after
      it

    Raises `InputError` for a time outside the run, for a batch of runs and for another
    kind of brake.

    Example:
        >>> figure = sb.plot.pressed(disc)
        >>> figure.axes[1].get_xlabel()
        'radius, mm'
    """
    brake = one_run(result).scene.brake
    if not isinstance(brake, DiscBrake | ShoeBrake):
        hint = (
            "draw it with `plot.pulley`"
            if brake.banded
            else "`plot.stop` and `plot.lining_map` show its forces"
        )
        raise input_error(
            "brake", f"is a {brake.words.brake}: this draws discs and drums", hint
        )
    t, p = _moment(result, time, "max_normal_load", lambda p: p.shown.pairs[0].normal)
    contacts = lining_contacts(result, p)
    (pair,) = p.shown.pairs
    normal = np.asarray(pair.normal)[0]
    friction = pair.friction[0]
    figure = sheet(figure, 11.0, 6.6)
    wheel, course = figure.subplots(1, 2, width_ratios=[1.3, 1])
    colours = [
        CONTACT_COLOURS[state] for (states,) in contacts.values() for state in states
    ]
    if isinstance(brake, DiscBrake):
        edge = _disc(wheel, course, brake, normal, colours)
    else:
        edge = _drum(wheel, course, brake, normal, colours)
    wheel.set(aspect="equal", xlim=(-edge, edge), ylim=(-edge, edge))
    wheel.axis("off")
    course.set(ylabel=f"pressure, {reading('Pa').name}", ylim=(0.0, None))
    finish([course])
    lines = [
        f"{brake.words.lining} {i + 1}: $N$ = {number(N, 'N', count=4)}, "
        f"friction {number(F, 'N', count=4)}"
        for i, (N, F) in enumerate(zip(normal, friction, strict=True))
    ]
    shown = (
        lines
        if len(lines) <= 4
        else [*lines[:2], f"… {len(lines) - 3} more …", lines[-1]]
    )
    wheel.text(
        0.5, -0.02, "\n".join(shown), transform=wheel.transAxes, ha="center", va="top"
    )
    force = number(p.flows.contact.slack_tension[0], "N", count=4)
    torque = number(p.flows.contact.brake_torque[0], "N*m", count=4)
    forces = f"force of the actuator {force}, brake torque {torque}"
    head(
        figure, result.scene, f"{brake.words.brake} at $t$ = {digits(t, 4)} s: {forces}"
    )
    _draw_rotation(wheel, result, float(p.y.omega[0]), 0.32 * float(brake.radius))
    name_marks(figure, _contact_legend(contacts, brake.words.lining))
    return figure


def _disc(
    wheel: Axes, course: Axes, brake: DiscBrake, normal: PerLining, colours: list[str]
) -> float:
    """Pads at their callipers, the one in front of the two faces; returns the
    extent."""
    pads = brake.linings
    inner = float(pads.inner_radius)
    outer = float(pads.outer_radius)
    edge = 1.06 * outer
    _sector(wheel, edge, 0.9 * inner, color="0.85", zorder=1)
    for i, ends in enumerate(pressed_angles(brake)[::2]):
        _sector(
            wheel, outer, inner, ends, fc=colours[2 * i], ec=GREY, gid="pad", zorder=2
        )
        x, y = spot(0.5 * (inner + outer), ends.mean())
        words = ", ".join(str(k) for k in (2 * i + 1, 2 * i + 2) if k <= pads.count)
        wheel.text(x, y, words, ha="center", va="center", zorder=3)
    wheel.add_patch(
        Circle(
            (0, 0),
            float(brake.radius),
            fill=False,
            ec=BLUE,
            ls="--",
            lw=1.0,
            zorder=1.5,
        )
    )
    radius = np.linspace(inner, outer, 100)
    highest = float(pads.greatest_pressure(normal.max()))
    length = reading("m", 0.01)
    press = reading("Pa")
    pressure = press(highest * np.asarray(pads.pressure.share(radius, inner)))
    course.plot(length(radius), pressure, color=GREEN, label="pressure on a pad")
    mean = float(press(normal.max() / float(pads.area)))
    effective = float(length(brake.radius))
    course.axhline(mean, color="0.5", ls=":", label=f"mean {mean:.4g} {press.name}")
    words = f"effective radius {effective:.4g} {length.name}"
    course.axvline(effective, color=BLUE, ls="--", label=words)
    course.set_xlabel(f"radius, {length.name}")
    return 1.1 * edge


def _drum(
    wheel: Axes, course: Axes, brake: ShoeBrake, normal: PerLining, colours: list[str]
) -> float:
    """Shoes with their pins at the bottom."""
    shoes = brake.linings
    r = float(shoes.radius)
    start = float(shoes.start)
    end = float(shoes.end)
    _sector(wheel, 1.08 * r, 1.02 * r, color="0.75", zorder=1)
    theta = np.linspace(start, end, 200)
    pressures = [float(brake.greatest_pressure(N)) for N in normal]
    highest = math.sin(min(max(0.5 * math.pi, start), end))
    each = zip(pressures, SIDES, PINS, pressed_angles(brake), strict=True)
    for i, (pressure, side, pin, ends) in enumerate(each):
        _sector(
            wheel,
            1.02 * r,
            0.92 * r,
            ends,
            fc=colours[i],
            ec=GREY,
            gid="shoe",
            zorder=2,
        )
        wheel.plot(
            *spot(float(brake.pin), pin),
            marker="o",
            ms=9,
            mfc="white",
            mec=GREY,
            zorder=4,
        )
        p = pressure * np.sin(theta) / highest
        colour = GREEN if i else BLUE
        line = spot(
            0.92 * r - 0.45 * r * p / (max(pressures) or 1.0), pin + side * theta
        )
        base = spot(0.92 * r, pin + side * theta)
        wheel.fill(
            *np.concatenate([line, base[::-1]]).T,
            color=colour,
            alpha=0.25,
            lw=0,
            gid="pressure",
        )
        x, y = spot(0.97 * r, ends.mean())
        wheel.text(x, y, str(i + 1), ha="center", va="center")
        words = "leading ahead" if i == 0 else "trailing ahead"
        label = f"shoe {i + 1}, {words}"
        course.plot(np.degrees(theta), reading("Pa")(p), color=colour, label=label)
    course.set_xlabel("angle from the pin, °")
    return 1.15 * r
