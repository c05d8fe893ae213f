"""A run as one self-contained page: what was braked, how it went, what it means and how sure it is."""

import base64
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .._base._faults import InputError, whole_file
from .._base._progress import Waiting, waiting
from .._base._table import Number, digits, number, pretty
from .._parts._scene import Scene, paths_without_meaning
from .._run._measure import Metric, check_metrics, happened, limit_checks, measure, name_of, read_limits, unit_of
from .._run._metrics import METRICS
from .._run._result import Result
from .._run._simulate import simulate
from ..brakes._pressed import DiscBrake, ShoeBrake
from ..files._scene_file import scene_text
from ..results._provenance import provenance
from ..results._rerun import Repeat, repeat
from ..studies._sensitivity import Sensitivity, SensitivityTable
from ..studies._sensitivity import sensitivity as tables_of
from ..thermal._heat import place_count
from ._rows import (
    duty_words,
    event_counts,
    event_rows,
    key_figures,
    ledgers,
    limit_rows,
    parts_of,
    stage_rows,
    verdict,
    words_of,
)


class Picture(NamedTuple):
    """A function of `simbrake.plot` that draws a result, when it has something to draw, and what to see in it.

    `options`: what else the function is given, so that one function can draw several pictures.
    """

    name: str
    title: str
    caption: str
    wanted: Callable[[Result], bool] = lambda result: True
    options: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        """A name for a file."""
        return "-".join([self.name, *self.options])

    def figure(self, result: Result) -> Any:
        """The picture as a matplotlib figure."""
        from .. import plot

        return getattr(plot, self.name)(result, *self.options)


def _heated(result: Result) -> bool:
    return result.scene.heated


def _banded(result: Result) -> bool:
    return result.scene.brake.banded


def _pressed(result: Result) -> bool:
    return isinstance(result.scene.brake, DiscBrake | ShoeBrake)


def _staged(result: Result) -> bool:
    return result.scene.brake.in_series


def _resolved(result: Result) -> bool:
    return bool(result.record.modes.contacts)  # pyright: ignore


def _walled(result: Result) -> bool:
    return bool(result.scene.network.walls)


def _lining_by_lining(result: Result) -> bool:
    """Whether every lining has a temperature of its own."""
    heat = result.scene.network
    return heat.linings is not None and place_count(heat, heat.linings) > 1


#: the duty has a section of its own
DUTY = Picture(
    "duty",
    "What acts on the brake",
    "What the lever gives, and torque with which the load drives the shaft, over the whole run.",
)
#: the pictures of a run in the order of the page; a new one is one line
PICTURES = (
    Picture(
        "stop",
        "The run over time",
        "From above: speed of the pulley, torques of brake and load, tensions at the two ends of the band "
        "or forces on the linings, number of "
        "linings at their friction limit. Dashed lines are events; where there are two columns, the right one "
        "enlarges the onset of slip.",
    ),
    Picture(
        "pulley",
        "Tensions and loads on the pulley's circle",
        "At the time of the greatest tension: outwards the tension of the band at the ends of the linings, inwards the "
        "normal load of each; linings at their true angles, coloured by what they do.",
        _banded,
    ),
    Picture(
        "pressed",
        "What presses the linings",
        "At the time of the greatest load: pads on their disc, or shoes in their drum, at their true angles, with the "
        "pressure on a lining, and its forces.",
        _pressed,
    ),
    Picture(
        "lining_map",
        "Normal load of every lining",
        "Linings in their order, those of a band from the slack to the tight end, over time, coloured by their normal "
        "load; lines are events.",
        options=("normal_load",),
    ),
    Picture(
        "stages",
        "Stages of the staged brake",
        "Speeds of pulley and bandage, torques and friction heat of both pairs, and their overlap coefficients (filled "
        "while a pair slides, hatched while it sticks); the shading says which stage it is.",
        _staged,
    ),
    Picture(
        "contacts",
        "Which linings slide",
        "One line for each lining, from the slack end, over time: light blue while it sticks, orange while it slides "
        "ahead, purple while it slides back.",
        _resolved,
    ),
    Picture(
        "temperatures",
        "Temperatures",
        "Surfaces over time with the permissible temperature of the linings, the coefficient of friction that is left, "
        "and the temperature through the depth of the walls at the hottest moment.",
        _heated,
    ),
    Picture(
        "depth",
        "Through the depth of the rim",
        "Temperature over time and depth below the friction surface, and beside it profiles while the face heats, at "
        "its hottest, and as it cools.",
        _walled,
    ),
    Picture(
        "lining_map",
        "Temperature of every lining",
        "Linings from the slack to the tight end over time, coloured by the temperature of their surface.",
        _lining_by_lining,
        ("temperature",),
    ),
)


def lasted(result: Result) -> bool:
    """Whether a run lasted any time; one that fails at its start has nothing to draw."""
    times = np.asarray(result.record.rows.t)
    return bool(times[int(result.record.count)] > times[0])


def pictures_of(result: Result) -> Iterator[Picture]:
    """All pictures that a result has something for."""
    if lasted(result):
        yield from (picture for picture in PICTURES if picture.wanted(result))


# --- pictures in the page ---------------------------------------------------------------------------------------------

#: a picture whose SVG is longer is a PNG instead (bytes)
_LONGEST = 400_000
_DPI = 170.0  # of PNGs: sharp in print over the width of a page


class Drawing(NamedTuple):
    """A picture as an image inside the page."""

    name: str
    title: str
    caption: str
    address: str  # data URI


def draw(result: Result, picture: Picture) -> Drawing:
    """One picture of a result, as an image inside the page."""
    return drawing(picture.key, picture.title, picture.caption, picture.figure(result))


def drawing(name: str, title: str, caption: str, figure: object) -> Drawing:
    """A figure as an image inside the page: SVG, or PNG where that is shorter to load."""
    from ..plot._shared import png, svg

    kind, data = "svg+xml", svg(figure)  # pyright: ignore
    if len(data) > _LONGEST:
        kind, data = "png", png(figure, _DPI)  # pyright: ignore
    return Drawing(name, title, caption, f"data:image/{kind};base64,{base64.b64encode(data).decode('ascii')}")


def drawings_of(result: Result, told: Waiting) -> list[Drawing]:
    """All pictures that a result has something for."""
    drawn, pictures = [], list(pictures_of(result))
    for i, picture in enumerate(pictures):
        told.now("pictures", i, len(pictures))
        drawn.append(draw(result, picture))
    return drawn


# --- the page ---------------------------------------------------------------------------------------------------------

#: rows of a table of sensitivities that are shown
_MOST = 20
#: rows of events from which on the list is folded
_FOLD = 30
#: an elasticity below this is rounding
_ROUNDING = 1e-13


class SensitivityPart(NamedTuple):
    """Sensitivities of one metric: its value, rows with derivative and elasticity, the tornado chart."""

    words: str
    value: Number
    rows: tuple[tuple[Sensitivity, Number, str, str], ...]
    left_out: int
    notes: tuple[str, ...]
    tornado: Drawing


def report(
    run: Result | Scene,
    path: str | os.PathLike[str] | None = None,
    *,
    sensitivity: Sequence[Metric] = (),
    span: float | None = 0.01,
    limits: Mapping[str, int | float | str] | None = None,
    title: str = "",
    files: Mapping[str, str] | None = None,
    check: bool = True,
    rtol: float = 1e-10,
    progress: Any = False,
) -> str:
    """A run as one HTML page that needs nothing else: no network, no other files, no scripts. Returns the page.

    - `run`: a result, or a scene, which is run to its end or its failure with the tolerance `rtol`
    - `path`: where to write the page too; an existing file is replaced, whole or not at all
    - `sensitivity`: metrics whose derivatives by every number of the scene are shown, with `span` as in
      `simbrake.sensitivity`; one that has no value in this run is named as such
    - `limits`: greatest permissible values of metrics (SI, or texts as "450 degC"), and of `max_pressure`, the
      greatest mean pressure on a lining (Pa); the scene's own permissible temperature is always evaluated. The heading
      of the page says which are exceeded
    - `title`: heading of the page;  `files`: name → text, shown at the end, such as the scene's file
    - `check`: run a second time at another tolerance, to say how accurate the first is
    - `progress`: says on stderr what is done and how long it takes: `True`, or `None` on a terminal only

    Numbers are in handy units; the exact value in SI units is in the `value` of each `<data>` element.

    Raises `InputError` for faults of the scene, unknown metrics and limits.
    """
    scene = run.scene if isinstance(run, Result) else run
    bounds, found = read_limits(scene, limits or {})
    try:
        check_metrics(scene, sensitivity)
    except InputError as error:
        found += error.faults
    if found:
        raise InputError(found)
    with waiting(progress, "report", "compiles the run") as told:
        result = run if isinstance(run, Result) else simulate(run, rtol=rtol, throw=False, progress=told)
        parts = contents(result, bounds, title, files or {}, told)
        if sensitivity:
            parts["sensitivities"], parts["without"] = _sensitivities(result, sensitivity, span, told)
        if check:
            told.now("second run, for the error estimate")
            parts["repeat"] = _accuracy(repeat(result, told))
    text = render(parts)
    if path is not None:
        with whole_file(Path(path)) as file:
            file.write_text(text, "utf-8")
    return text


def contents(
    result: Result, limits: Mapping[str, float], title: str, files: Mapping[str, str], told: Waiting
) -> dict[str, Any]:
    """Everything that a page shows of one result."""
    told.now("sums up")
    scene, summary = result.scene, result.summary()
    absent = paths_without_meaning(scene)
    parts = [part._replace(rows=tuple(row for row in part.rows if row.path not in absent)) for part in parts_of(scene)]
    parts = [part for part in parts if part.rows]
    events, checks = event_rows(result.events), limit_checks(result, limits)
    return {
        "title": title or _name(scene),
        "verdict": verdict(result, summary, checks),
        "figures": key_figures(summary, unit_of),
        "parts": [part for part in parts if not part.path.startswith("heat")],
        "thermal_parts": [part for part in parts if part.path.startswith("heat")],
        "duty": duty_words(scene),
        "duty_picture": draw(result, DUTY) if lasted(result) else None,
        "pictures": drawings_of(result, told),
        "counts": event_counts(result.events),
        "events": events,
        "fold": len(events) > _FOLD,
        "stages": stage_rows(summary),
        "absent_stages": summary.get("absent_stages", []),
        "ledgers": ledgers(result, summary),
        "limits": limit_rows(checks),
        "warnings": summary["warnings"],
        "solver": summary["solver"],
        "accuracy": {
            "rtol": digits(summary["solver"]["rtol"], 3),
            "closure": digits(summary["energy"]["closure"], 2),
            "heat_closure": digits(summary["energy"].get("heat_closure", 0.0), 2) if scene.heated else "",
        },
        "sensitivities": None,
        "without": [],
        "repeat": None,
        "provenance": flat(_provenance(result)),
        "files": {**_scene_text(scene), **files},
    }


def _name(scene: Scene) -> str:
    brake = scene.brake
    return f"A run of a {brake.kind} with {brake.linings.count} {brake.words.lining}s"


def _provenance(result: Result) -> Mapping[str, Any]:
    """Where the result comes from; scene and outcome have sections of their own."""
    return {name: value for name, value in provenance(result).items() if name not in ("scene", "outcome")}


def _scene_text(scene: Scene) -> dict[str, str]:
    """The scene as a file that can be run again, or why no file can hold it."""
    try:
        return {"As a scene file, as it was run": scene_text(scene)}
    except InputError as error:
        return {"No scene file can hold it": str(error)}


def flat(found: Mapping[str, Any], above: str = "") -> list[tuple[str, str]]:
    """Names and texts of a mapping of mappings, in order; `above` begins the names."""
    rows: list[tuple[str, str]] = []
    for name, value in found.items():
        words = f"{above}{name}".replace("_", " ")
        if isinstance(value, Mapping):
            rows += flat(value, f"{words}: ")
        elif isinstance(value, list | tuple):
            rows.append((words, ", ".join(str(one) for one in value)))
        else:
            rows.append((words, "—" if value is None else str(value)))
    return rows


def _sensitivities(
    result: Result, metrics: Sequence[Metric], span: float | None, told: Waiting
) -> tuple[list[SensitivityPart], list[str]]:
    """Tables of the metrics that have a value in this run, and the names of the others."""
    from .. import plot

    there = [one for one in metrics if result.ok and happened(measure(result, one))]
    without = [name_of(one) for one in metrics if one not in there]
    if not there:
        return [], without
    tables: list[SensitivityTable] = tables_of(result.scene, there, span=span, rtol=float(result.rtol), progress=told)
    parts = []
    for table in tables:
        shown = table.matters[:_MOST]
        rows = tuple((row, *_influence(row)) for row in shown)
        words = words_of(table.metric)
        caption = "Percent of the metric for one percent of each number; the widest bar on top."
        if span:
            over = f"its range of ± {100 * span:g} %"
            caption = f"What every number does to it over {over}, the others fixed; the widest bar on top."
        picture = drawing(f"tornado_{table.metric}", words, caption, plot.tornado(table))
        value, left = number(table.value, table.unit), len(table.wholes) - len(shown)
        parts.append(SensitivityPart(words, value, rows, left, table.notes, picture))
    return parts, without


def _influence(row: Sensitivity) -> tuple[Number, str, str]:
    """Value, derivative and elasticity of a number for reading; what is rounding is 0."""
    value = number(row.value, row.unit)
    if row.value and abs(row.elasticity) < _ROUNDING:
        return value, "0", "0"
    return value, digits(row.derivative, 5), digits(row.elasticity, 4)


def _in_si(difference: float | None, unit: str) -> Number:
    """A difference, whose size matters more than its unit, in SI."""
    return (
        Number("—")
        if difference is None
        else Number(digits(difference, 2), pretty(unit), repr(difference), pretty(unit))
    )


def _accuracy(second: Repeat) -> dict[str, Any]:
    """The comparison of two runs, with numbers for reading."""
    order = list(METRICS)
    return {
        "rtol": digits(second.rtol, 3),
        "max_step": None if second.max_step is None else number(second.max_step, "s", count=3),
        "tighter": second.tighter,
        "problem": second.problem,
        "unmatched": second.unmatched,
        "events": [(shift.name, shift.count, _in_si(shift.difference, "s")) for shift in second.events],
        "metrics": [
            (
                words_of(shift.name),
                number(shift.value, shift.unit),
                _in_si(shift.difference, shift.unit),
                "—" if shift.relative is None else digits(shift.relative, 2),
            )
            for shift in sorted(
                second.metrics, key=lambda shift: order.index(shift.name) if shift.name in order else 99
            )
            if shift.value is not None or shift.other is not None
        ],
    }


def render(parts: Mapping[str, Any]) -> str:
    """The page of what `contents` found. Every text is escaped by the template."""
    import jinja2  # loaded by those who want a page

    loader = jinja2.PackageLoader("simbrake", "templates")
    settings = {"autoescape": True, "trim_blocks": True, "lstrip_blocks": True, "undefined": jinja2.StrictUndefined}
    return jinja2.Environment(loader=loader, **settings).get_template("report.html").render(parts)
