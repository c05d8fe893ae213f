"""Data that the script of a page draws: curves over time, events, and the brake moment
by moment.

Numbers are in units for reading, with seven significant digits.
"""

import json
import math
from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from .._base._faults import Issues
from .._base._numbers import Reading, reading
from ..brakes._pressed import DiscBrake, ShoeBrake
from ..brakes.design import Brake
from ..outputs.log import Event, plain_words
from ..outputs.quantities import Series
from ..parts.scene import Scene, banded_brake
from ..plot.drawing import (
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    Times,
    Window,
    both_sides,
    line_of,
    part_to_play,
    span,
    windows,
)
from ..plot.wheels import (
    CONTACT_COLOURS,
    LINING,
    band_ends,
    lining_edges,
    on_circle,
    pressed_angles,
)
from ..runs.linings import CONTACT_WORDS, lining_contacts
from ..runs.result import Result, look

#: what JSON has as a mapping
Data: TypeAlias = dict[str, Any]

_BLACK = "#1c2430"


class Detail(NamedTuple):
    """How finely a run is drawn: times of a curve spread evenly over each window, ends
    of steps, which are dense where much changes, and evenly over the film."""

    even: int = 150
    steps: int = 300
    frames: int = 240


class Line(NamedTuple):
    """A curve: its name, colour, and the column of a series that it shows (`most`:
    "max" or "min" of a row)."""

    label: str
    colour: str
    column: str
    most: str = ""
    dashed: bool = False

    def find(self, series: Series) -> Any:
        """The curve in SI."""
        values = getattr(series, self.column)
        return getattr(values, self.most)(axis=1) if self.most else values


class Chart(NamedTuple):
    """Curves with one axis, and how that is read.

    `stepped`: whole numbers, drawn as steps
    """

    title: str
    lines: Sequence[Line]
    read: Reading = Reading(1.0, 0.0, "–")
    stepped: bool = False

    def of(self, series: Series) -> "Chart":
        """The same with those of its curves that a series has."""
        there = [x for x in self.lines if getattr(series, x.column) is not None]
        return self._replace(lines=there)

    def values(self, series: Series) -> list[Any]:
        """The curves in the unit for reading."""
        return [self.read(line.find(series)) for line in self.lines]

    def as_dict(self) -> Data:
        """Its data for the script."""
        lines = [
            {"label": line.label, "colour": line.colour, "dashed": line.dashed}
            for line in self.lines
        ]
        return {
            "title": self.title,
            "unit": self.read.name,
            "stepped": self.stepped,
            "lines": lines,
        }


def charts_of(scene: Scene, s: Series) -> list[Chart]:
    """The charts of a run, by the columns that its series has."""
    words = scene.brake.words
    speed = [
        Line(f"{words.body} ω", _BLACK, "omega"),
        Line("bandage", BLUE, "bandage_speed", dashed=True),
    ]
    torque = [
        Line("brake", BLUE, "brake_torque"),
        Line("load", VERMILLION, "load_torque", dashed=True),
        Line("others on the shaft", GREEN, "shaft_torque"),
        Line("motor", PURPLE, "motor_torque"),
    ]
    if scene.brake.banded:
        force = [
            Line("tight end", BLUE, "tight_tension"),
            Line("slack end", SKY, "slack_tension"),
        ]
    else:
        normal = Line(
            f"largest normal force on a {words.lining}", BLUE, "normal_load", "max"
        )
        force = [normal, Line("actuator", SKY, "lever_force", dashed=True)]
    forces = "Tension of the band" if scene.brake.banded else "Forces"
    forces = ", ".join(filter(None, (forces, scene.brake.force_words)))
    body = "rim" if scene.brake.banded else words.body
    hot = [
        Line(f"hottest {body}", VERMILLION, "rim_temperature", "max"),
        Line(f"hottest {words.lining}", ORANGE, "lining_temperature", "max"),
        Line("band", BLUE, "band_temperature", "max"),
    ]
    coefficient = [
        Line(f"lowest of the {words.lining}s", BLUE, "friction_coefficient", "min"),
        Line("highest", SKY, "friction_coefficient", "max", dashed=True),
    ]
    hook = scene.duty.load.words.hook
    travel = Line(f"{hook}, downwards", _BLACK, "hook_position")
    used = Line(f"{words.lining}s at their friction limit", ORANGE, "at_limit")
    charts = [
        Chart("Speed", speed, reading("rad/s")),
        Chart("Torque", torque, reading("N*m")),
        Chart(forces, force, reading("N")),
        Chart("Surface temperature", hot, reading("K")),
        Chart("Coefficient of friction, sliding", coefficient),
        Chart(f"Travel of the {hook}", [travel], reading("m")),
        Chart(f"At the limit, of {scene.brake.linings.count}", [used], stepped=True),
    ]
    there = [chart.of(s) for chart in charts]
    return [chart for chart in there if chart.lines]


def rounded(values: Any, digits: int = 7) -> Any:
    """Nested lists of numbers with so many significant digits; what is not finite is
    `None`."""
    x = np.asarray(values, np.float64)
    size = np.where(np.isfinite(x) & (x != 0), np.abs(x), 1.0)
    places = 10.0 ** (digits - 1 - np.floor(np.log10(size)))
    shown = np.round(np.where(np.isfinite(x), x, 0.0) * places) / places
    if np.all(np.isfinite(x)):
        return shown.tolist()
    return np.where(np.isfinite(x), shown, None).tolist()  # pyright: ignore


def times_of(result: Result, detail: Detail, film: "Film") -> Times:
    """Times at which the curves of a run and its film are drawn."""
    start, end = span(result)
    t = result.record.rows.t[: result.record.count + 1]
    spans = {(start, end), *((window.start, window.end) for window in windows(result))}
    even = [np.linspace(*ends, detail.even) for ends in spans]
    moments = np.linspace(0.0, film.film[-1], detail.frames)
    even.append(np.interp(moments, film.film, film.run))
    times = np.unique(np.concatenate([*even, t[:: 1 + len(t) // detail.steps]]))
    return times[np.append(True, np.diff(times) > 1e-12 * (end - start))]


def events_of(result: Result) -> list[Data]:
    """Events that the charts mark: time, words, colour, and the meaning in plain
    words."""
    return [
        {"t": event.time, **look}
        for event in result.events
        if (look := look_of_event(event)) is not None
    ]


def look_of_event(event: Event) -> Data | None:
    """Colour, words and meaning of an event that the charts mark."""
    if (line := line_of(event)) is None:
        return None
    colour, words = line
    return {"colour": _css(colour), "words": words, "plain": plain_words(event.name)}


def _css(colour: str) -> str:
    """A colour of figures as a page writes it: "0.5" is a grey."""
    return (
        colour
        if colour.startswith("#")
        else "#" + 3 * f"{round(255 * float(colour)):02x}"
    )


# --- the brake, moment by moment ----------------------------------------------------

#: digits of what the film draws of each lining
_DRAWN = 5
#: share of a film for a short onset of slip
_SHARE = 0.45


class Film(NamedTuple):
    """Times of run and film (s) at the beginning, at the end of the slow part, if any,
    and at the end."""

    run: tuple[float, ...]
    film: tuple[float, ...]

    def as_dict(self) -> Data:
        """Its data for the script, with the speed of each part in words."""
        rates = np.diff(self.film) / np.diff(self.run)
        words = [words_of_rate(rate) for rate in rates.tolist()]
        return {"run": rounded(self.run), "film": self.film, "words": words}


def film_of(
    result: Result, duration: float, start: float | int | None, end: float | int | None
) -> Film:
    """The first brake application, from the start until shortly after the first stop,
    or the requested part."""
    faults = Issues()
    low, high = part_to_play(result, start, end, faults)
    faults.report()
    slip = next(
        (
            e.time
            for e in result.events
            if e.name == "full_slip" and low < e.time < high
        ),
        high,
    )
    slow = low + 1.3 * (slip - low)
    if slow - low > 0.25 * (high - low):
        return Film((low, high), (0.0, duration))
    return Film((low, slow, high), (0.0, _SHARE * duration, duration))


def words_of_rate(rate: float) -> str:
    """Speed of a film, in words."""
    if rate >= 1.05:
        return f"slow motion: {_round(rate)} times slower than the brake"
    if rate > 0.95:
        return "as fast as the brake"
    return f"{_round(1 / rate)} times faster than the brake"


def _round(x: float) -> str:
    digits = max(0, 1 - math.floor(math.log10(x)))
    return f"{x:.{digits}f}"


def drawable(scene: Scene) -> bool:
    """Whether the film shows this kind of brake: one band, discs, or shoes."""
    return isinstance(scene.brake, Brake | DiscBrake | ShoeBrake)


def _places(scene: Scene) -> list[list[float]]:
    """Angles (rad, counter-clockwise from the right) and radii between which each
    lining is drawn."""
    brake: Any = scene.brake
    if brake.banded:
        return [
            [*sorted(ends), *LINING] for ends in on_circle(lining_edges(brake)).tolist()
        ]
    angles = pressed_angles(brake).tolist()
    if isinstance(brake, DiscBrake):
        pads = brake.linings
        inner = float(pads.inner_radius) / float(pads.outer_radius)
        middle = 0.5 * (inner + 0.97)
        # the pad in front of the disc outside, that behind it inside
        radii = [(middle, 0.97), (inner, middle)]
        return [[*ends, *radii[i % 2]] for i, ends in enumerate(angles)]
    return [[*ends, 0.82, 0.93] for ends in angles]


def film(result: Result, t: Times, clock: Film) -> Data:
    """The brake at the times `t` (s) of a run: angles, speeds, contacts, tensions,
    loads, temperatures; `clock`: which of them are played, and how fast."""
    p = look(result, t)
    force = reading("N")
    degrees = reading("K")
    brake = result.scene.brake
    contacts = lining_contacts(result, p)
    pairs = [
        {
            "words": brake.pairs[name].words,
            "contacts": [
                "".join(map(str, row)) for row in contacts[name].astype(int).tolist()
            ],
            "load": rounded(force(now.normal), _DRAWN),
        }
        for name, now in zip(contacts, p.shown.pairs, strict=True)
    ]
    hook = result.scene.duty.load.travelled(p.y.phi)
    data: Data = {
        "clock": clock.as_dict(),
        "phi": rounded(p.y.phi),
        "omega": rounded(reading("rad/s")(p.y.omega)),
        "torque": rounded(reading("N*m")(p.flows.contact.brake_torque)),
        "hook": None if hook is None else rounded(reading("m")(hook)),
        "hook_name": result.scene.duty.load.words.hook,
        "places": rounded(_places(result.scene)),
        "pairs": pairs,
        "tension": None,
        "ends": [],
        "heat": None,
    }
    if p.shown.tension is not None:
        tension = np.concatenate(
            [p.flows.contact.slack_tension[:, None], p.shown.tension],
            axis=1,
        )
        data["tension"] = rounded(force(tension), _DRAWN)
        ends = band_ends(on_circle(lining_edges(banded_brake(result.scene))))
        data["ends"] = [[*rounded(np.concatenate(end[:3])), end.side] for end in ends]
    heat = {
        name: degrees(T) for name, T in p.surfaces.items() if name in ("linings", "rim")
    }
    if heat:
        low = min(T.min() for T in heat.values())
        high = max(T.max() for T in heat.values())
        shown = {
            name: rounded(T if name == "linings" else T.max(axis=1), _DRAWN)
            for name, T in heat.items()
        }
        data["heat"] = {"low": float(low), "high": float(max(high, low + 1.0)), **shown}
    return data


# --- all of it ----------------------------------------------------------------------


def still(scene: Scene) -> Data:
    """Words, colours and units of the film, which do not depend on the numbers of a
    scene."""
    words = scene.brake.words
    states = {
        int(state): {
            "colour": _css(CONTACT_COLOURS[state]),
            "words": CONTACT_WORDS[state],
        }
        for state in CONTACT_WORDS
    }
    si = {"speed": "rad/s", "travel": "m", "force": "N", "torque": "N*m", "heat": "K"}
    units = {name: reading(unit) for name, unit in si.items()}
    return {
        "states": states,
        "units": {name: unit.name for name, unit in units.items()},
        "turning": units["speed"].factor,
        "lining": words.lining,
        "body": words.body,
        "banded": scene.brake.banded,
    }


def live(
    result: Result,
    detail: Detail = Detail(),  # noqa: B008
    duration: float = 8.0,
    start: float | None = None,
    end: float | None = None,
) -> Data:
    """Curves, events and film of a concrete result of positive duration; the film of
    `duration` (s) plays the run from `start` to `end` (s).

    Raises `InputError` for times outside the run.
    """
    clock = film_of(result, duration, start, end)
    series = both_sides(
        result,
        times_of(result, detail, clock),
        np.unique([event.time for event in result.events]),
    )
    charts = charts_of(result.scene, series)
    shown = windows(result)
    first, last = span(result)
    shown += [Window(first, last)] if shown[0].end < last else []
    return {
        "charts": [chart.as_dict() for chart in charts],
        "t": rounded(series.t),
        "y": [rounded(np.stack(chart.values(series))) for chart in charts],
        "windows": [
            {"words": name, "start": rounded(start), "end": rounded(end)}
            for start, end, _, name in shown
        ],
        "events": events_of(result),
        "film": film(result, np.asarray(series.t), clock)
        if drawable(result.scene)
        else None,
    }


def metric_rows(tiles: Sequence[Any]) -> list[Data]:
    """Key figures for the script, as `key_figures` gives them."""
    return [
        {
            "words": words,
            "text": str(value),
            "si": value.si,
            "unit": value.si_unit,
            "note": note,
            "decides": decides,
        }
        for words, value, note, decides in tiles
    ]


def embedded(data: Data) -> str:
    """Data as JSON that can stand in an element of a page, whatever texts it holds."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"), ensure_ascii=False)
    return (
        text.replace("&", "\\u0026")
        .replace("<", "\\u003c")
        .replace(">", "\\u003e")
        .replace("\u2028", "\\u2028")
    )
