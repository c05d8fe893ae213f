"""Outputs of a run: one self-contained HTML page, and files in a folder, written all or
not at all."""

import base64
import csv
import functools
import hashlib
import importlib.resources
import inspect
import json
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import jinja2
import numpy as np
from jaxtyping import Float
from markupsafe import Markup

from .. import plot
from .._base._faults import InputError, Issues, whole_file, whole_folder
from .._base._numbers import Number, digits, display_units, number
from .._base._progress import Progress, shown_progress
from .._base._table import Column, Table
from ..brakes._bands import MultiBandBrake
from ..brakes._pressed import DiscBrake, ShoeBrake
from ..brakes.design import Brake
from ..files._scene_file import scene_text
from ..outputs.metrics import RESIDUAL_SEES
from ..outputs.quantities import about_column, columns_by_name
from ..parts.scene import Scene
from ..plot.drawing import Axes, Figure, both_sides, data_uri, span
from ..results.stored import provenance, save
from ..rig._ledger import Ledger
from ..rig._replay import Comparison
from ..runs.accuracy import Accuracy, accuracy
from ..runs.findings import course, findings, remarks, stage_table
from ..runs.measure import (
    LimitCheck,
    MetricLike,
    check_metrics,
    happened,
    limit_checks,
    measure,
    name_of,
    read_limits,
    title_of,
)
from ..runs.result import Result
from ..runs.simulate import simulate
from ..runs.verdict import summary_with_limits, text_with_limits
from ..studies._sensitivity import sensitivity as tables_of
from ..studies._sensitivity_table import Sensitivity, SensitivityTable
from ..thermal.heat import place_count
from ._live import Data, Detail, drawable, embedded, live, still
from ._rows import (
    BADGES,
    duty_words,
    event_table,
    in_prose,
    key_figures,
    ledgers,
    parts_of,
)

#: contents of a page, by the names that the template uses
Contents: TypeAlias = dict[str, Any]


#: what a figure shows: a result, the duty ledger of a rig, or a replay beside its log
Subject: TypeAlias = Result | Ledger | Comparison | SensitivityTable


class Picture(NamedTuple):
    """A figure of a run: the function that draws it, title, and condition on the
    result.

    - `options`: further arguments of the function, so that one function can draw
      several figures
    - `drawn`: the script of a page draws this; the figure is for paper, and for readers
      without scripts
    """

    drawing: Callable[..., Figure | Axes]
    title: str
    wanted: Callable[[Result], bool] = lambda result: True
    options: tuple[str, ...] = ()
    drawn: bool = False

    @property
    def key(self) -> str:
        """A name for a file."""
        return "-".join([self.drawing.__name__, *self.options])

    @property
    def caption(self) -> str:
        """Caption: docstring of the function, without its arguments and errors."""
        words = inspect.getdoc(self.drawing) or ""
        return " ".join(
            re.split(r"\n\n(?:- |Raises |Example)", words)[0].replace("`", "").split()
        )

    def figure(self, subject: Subject) -> Figure:
        """The figure of what a page is about."""
        drawn: Any = self.drawing(subject, *self.options)
        return drawn.figure


def _each_lining_has_heat(result: Result) -> bool:
    heat = result.scene.network
    return heat.linings is not None and place_count(heat, heat.linings) > 1


#: the duty is in another section
DUTY = Picture(plot.duty, "What acts on the brake")
#: the influence of parameters on a metric is in another section too
TORNADO = Picture(plot.tornado, "Influence of the parameters")
#: the figures of a run in the order of the page; a new one is one line
PICTURES = (
    Picture(plot.stop, "The run over time", drawn=True),
    Picture(plot.stops, "The stops, one by one", lambda run: len(run.stops) > 1),
    Picture(
        plot.pulley,
        "Tensions and loads on the pulley's circle",
        lambda run: isinstance(run.scene.brake, Brake),
        drawn=True,
    ),
    Picture(
        plot.pulley,
        "Tensions and loads on the circles of the bands",
        lambda run: isinstance(run.scene.brake, MultiBandBrake),
    ),
    Picture(
        plot.pressed,
        "What presses the linings",
        lambda run: isinstance(run.scene.brake, DiscBrake | ShoeBrake),
        drawn=True,
    ),
    Picture(plot.lining_map, "Normal load of every lining", options=("normal_load",)),
    Picture(
        plot.stages, "Stages of the staged brake", lambda run: run.scene.brake.in_series
    ),
    Picture(
        plot.contacts,
        "Which linings slide",
        lambda run: bool(run.record.modes.contacts),
    ),
    Picture(plot.temperatures, "Temperatures", lambda run: run.scene.heated),
    Picture(
        plot.depth,
        "Through the depth of the rim",
        lambda run: bool(run.scene.network.walls),
    ),
    Picture(
        plot.lining_map,
        "Temperature of every lining",
        _each_lining_has_heat,
        ("temperature",),
    ),
)


def lasted(result: Result) -> bool:
    """Whether a run has a positive duration; one that fails at its start has nothing to
    draw."""
    start, end = span(result)
    return end > start


def pictures_of(result: Result, progress: Progress) -> Iterator[Picture]:
    """Yield all figures that apply to a result, and report the current one."""
    wanted = [
        picture for picture in PICTURES if lasted(result) and picture.wanted(result)
    ]
    for i, picture in enumerate(wanted):
        progress.now("figures", i, len(wanted))
        yield picture


def draw(subject: Subject, picture: Picture) -> Contents:
    """One figure, as an image inside the page."""
    return {
        "name": picture.key,
        "title": picture.title,
        "caption": picture.caption,
        "drawn": picture.drawn,
        "address": data_uri(picture.figure(subject)),
    }


# --- the page -----------------------------------------------------------------------

#: rows of a table of sensitivities that are shown
_MOST = 20
#: bars of a tornado chart: their ranges take two runs each
_BARS = 12
#: rows of events from which on the list is folded
_FOLD = 30
#: an elasticity below this is rounding error
_ROUNDING = 1e-13


def report(
    run: Result | Scene,
    path: str | os.PathLike[str] | None = None,
    *,
    sensitivity: Sequence[MetricLike] = (),
    span: float | Mapping[str, float | str] | None = 0.01,
    limits: Mapping[str, int | float | str] | None = None,
    title: str = "",
    files: Mapping[str, str] | None = None,
    check: bool | Accuracy = True,
    rtol: float = 1e-10,
    progress: bool | Progress | None = False,
) -> str:
    """Write a run as one self-contained HTML page: no network, no other files. Returns
    the page.

    Verdict and key results come first, inputs last. Charts show values at the cursor
    and can be zoomed, a film shows the brake moment by moment; on paper and without
    scripts there are still figures instead.

    - `run`: a result, or a scene, which is run to its end or its failure with the
      tolerance `rtol`
    - `path`: file to write the page to; an existing file is replaced, whole or not at
      all
    - `sensitivity`: metrics whose derivatives by every parameter of the scene are
      shown; metrics without a value in this run are named
    - `span`: half of the range of each parameter in the tornado charts, 1 % of its
      value, or as in `simbrake.sensitivity` by path; the page says which
    - `limits`: permissible values of metrics (SI, or texts such as "450 degC"),
      and of `max_pressure`, the maximum mean pressure on a lining (Pa); the scene's own
      permissible temperature is always evaluated. The heading of the page says which
      are exceeded
    - `title`: heading of the page
    - `files`: name → text, shown at the end, such as the scene file
    - `check`: run a second time, to estimate the errors of the first run; or such an
      estimate (`Result.accuracy()`)
    - `progress`: report progress on stderr: `True`, or `None` on a terminal only

    Numbers are in readable units; the exact value in SI units is in the `value` of each
    `<data>` element.

    Raises `InputError` for errors of the scene, unknown metrics and limits.

    Example:
        >>> page = sb.report(result, title="First stop", check=False)
        >>> page[:15], "First stop" in page
        ('<!DOCTYPE html>', True)
    """
    scene = run.scene if isinstance(run, Result) else run
    bounds, found = read_limits(scene, limits or {})
    faults = Issues(found)
    faults.attempt(check_metrics, scene, sensitivity)
    faults.report()
    with shown_progress(progress, "report", "compiling the run…") as progress:
        result = (
            run
            if isinstance(run, Result)
            else simulate(run, rtol=rtol, throw=False, progress=progress)
        )
        parts = contents(result, bounds, title, files or {}, progress)
        if sensitivity:
            parts |= _sensitivities(result, sensitivity, span, progress)
        if check is True:
            progress.now("second run, for the error estimate")
        parts["accuracy"] = (
            accuracy(result, progress) if check is True else check or None
        )
    text = render(parts)
    if path is not None:
        with whole_file(Path(path)) as file:
            file.write_text(text, "utf-8")
    return text


def contents(
    result: Result,
    limits: Mapping[str, float],
    title: str,
    files: Mapping[str, str],
    progress: Progress,
) -> Contents:
    """Contents of the page of one result."""
    progress.now("post-processing…")
    scene = result.scene
    report = result.report()
    summary = report.summary
    brake = scene.brake
    parts = parts_of(scene)
    linings = f"{brake.words.lining}s"
    linings += "" if brake.rims == 1 else f" on each of {brake.rims} rims"
    events = event_table(result.events)
    kind = f"A run of a {brake.kind} with {brake.linings.count} {linings}"
    origin = {
        name: value
        for name, value in provenance(result).items()
        if name not in ("scene", "outcome")
    }
    origin["machine"] = {
        name: value
        for name, value in origin["machine"].items()
        if name != "one_function"
    }
    return {
        **head(result, limit_checks(result, limits), title or kind),
        "kind": "report",
        "data": {"run": live(result), "still": still(scene)}
        if lasted(result)
        else None,
        "parts": [part for part in parts if not part["path"].startswith("heat")],
        "thermal_parts": [part for part in parts if part["path"].startswith("heat")],
        "duty": duty_words(scene),
        "duty_picture": draw(result, DUTY) if lasted(result) else None,
        "pictures": [
            draw(result, picture) for picture in pictures_of(result, progress)
        ],
        "events": events,
        "fold": len(events) > _FOLD,
        "stages": stage_table(summary),
        "stops": report.stops if "stops" in summary else None,
        "ledgers": [*ledgers(result)],
        "residual_sees": RESIDUAL_SEES,
        "said": {finding.topic: finding.text for finding in findings(report)},
        "absent": summary.get("absent_stages", ()),
        "remarks": remarks(report),
        "sensitivities": None,
        "without": [],
        "accuracy": None,
        "provenance": flat(origin),
        "files": {**_scene_text(scene), **files},
    }


def head(result: Result, checks: Sequence[LimitCheck], title: str) -> Contents:
    """Contents of every page: title, verdict, key results; those of some pages alone
    empty."""
    report = result.report()
    verdict = result.verdict(checks)
    rows = tuple(row._replace(note=in_prose(row.note)) for row in verdict.rows)
    status = (
        result.status.replace("_", " ").capitalize()
        if result.ok
        else f"Failed: {result.status}"
    )
    return {
        "title": title,
        "verdict": verdict._replace(headline=in_prose(verdict.headline), rows=rows),
        "badges": BADGES,
        "outcome": in_prose(f"{status}: {result.message}. {course(report).text}."),
        "figures": key_figures(report),
        "lining": result.scene.brake.words.lining,
        "film": drawable(result.scene),
        "panel": "",
        "notes": (),
        "pictures": (),
        "sections": (),
    }


def film_page(
    result: Result,
    title: str,
    count: int,
    duration: float,
    start: float | None,
    end: float | None,
) -> str:
    """A page with the film of a run and its charts alone.

    Raises `InputError` for times outside the run.
    """
    run = live(result, Detail(frames=count), duration, start, end)
    data = {"still": still(result.scene), "run": run}
    return render(
        {**head(result, limit_checks(result, {}), title), "kind": "film", "data": data}
    )


def _scene_text(scene: Scene) -> dict[str, str]:
    """The scene as a file that can be run again, or the reason why it cannot be
    written."""
    try:
        return {"As a scene file, as it was run": scene_text(scene)}
    except InputError as error:
        return {"It cannot be written as a scene file": str(error)}


def flat(mapping: Mapping[str, object], above: str = "") -> list[tuple[str, str]]:
    """Names and texts of a mapping of mappings, in order; `above` begins the names."""
    rows: list[tuple[str, str]] = []
    for name, value in mapping.items():
        words = f"{above}{name}".replace("_", " ")
        if isinstance(value, Mapping):
            rows += flat(value, f"{words}: ")
        elif isinstance(value, list | tuple):
            rows.append((words, ", ".join(str(entry) for entry in value)))
        else:
            rows.append((words, "—" if value is None else str(value)))
    return rows


def _sensitivities(
    result: Result,
    metrics: Sequence[MetricLike],
    span: float | Mapping[str, float | str] | None,
    progress: Progress,
) -> Contents:
    """Sections of the metrics that have a value in this run, and the names of the
    others."""
    there = [
        metric for metric in metrics if result.ok and happened(measure(result, metric))
    ]
    tables: list[SensitivityTable] = []
    if there:
        rtol = float(result.rtol)
        tables = tables_of(
            result.scene, there, span=span, most=_BARS, rtol=rtol, progress=progress
        )
    sections = [
        {
            "words": title_of(table.metric),
            "value": number(table.value, table.unit, count=3),
            "tornado": {
                **draw(table, TORNADO),
                "name": f"tornado-{table.metric}",
            },
            "rows": _sensitivity_table(table.matters[:_MOST]),
            "left_out": len(table.wholes) - len(table.matters[:_MOST]),
            "notes": table.notes,
        }
        for table in tables
    ]
    if span is None:
        ranges = ""
    elif isinstance(span, Mapping):
        ranges = "The ranges of the charts are those given."
    else:
        ranges = (
            f"The ranges of the charts are ± {digits(100 * span)} % of each parameter."
        )
    without = [name_of(metric) for metric in metrics if metric not in there]
    return {"sensitivities": sections, "ranges": ranges, "without": without}


def _sensitivity_table(rows: Sequence[Sensitivity]) -> Table:
    columns = [("path", "parameter"), "meaning", Column("value")]
    columns += [
        Column("derivative", display_units="SI units"),
        Column("elasticity"),
        Column("meaning_note", hidden=True),
    ]
    lines = []
    for row in rows:
        # rounding errors are shown as 0
        rounding = row.value and abs(row.elasticity) < _ROUNDING
        influence = [
            Number("0" if rounding else digits(value, count), si=str(value))
            for value, count in ((row.derivative, 5), (row.elasticity, 4))
        ]
        lines.append(
            (row.path, row.meaning, number(row.value, row.unit), *influence, row.note)
        )
    return Table(columns, lines)


def template_file(name: str) -> str:
    """A file of the templates, with what it needs to stand inside a page."""
    return (
        importlib.resources.files("simbrake")
        .joinpath("templates", name)
        .read_text("utf-8")
    )


def render(parts: Mapping[str, Any]) -> str:
    """The page with these contents. The template escapes every text; no script but the
    page's own can run."""
    loader = jinja2.PackageLoader("simbrake", "templates")
    environment = jinja2.Environment(
        loader=loader,
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    # (a number stays with its unit)
    glued = functools.partial(re.sub, r"(?<=\d) (?=[^\s(])", "\u00a0")
    environment.filters |= {"digits": digits, "number": number, "glued": glued}
    names = [
        "uplot/uPlot.iife.min.js",
        "page.js",
        *(["sliders.js"] if parts["panel"] else []),
    ]
    scripts = [template_file(name) for name in names]
    hashes = [
        base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")
        for text in scripts
    ]
    allowed = " ".join(f"'sha256-{digest}'" for digest in hashes)
    allowed += " 'wasm-unsafe-eval'" if parts["kind"] == "live" else ""
    policy = f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src {allowed}"
    policy += "; connect-src 'self'" if parts["kind"] == "app" else ""
    inlined = {
        "scripts": map(Markup, scripts),
        "uplot_style": Markup(template_file("uplot/uPlot.min.css")),
    }
    data: Data | None = parts["data"]
    shown = {
        **parts,
        **inlined,
        "policy": policy,
        "data": None if data is None else Markup(embedded(data)),
    }
    return environment.get_template("page.html").render(shown)


# --- files --------------------------------------------------------------------------


def write_run(result: Result, folder: Path, checks: Sequence[LimitCheck]) -> list[Path]:
    """Write `summary.json`, `summary.txt`, `series.csv`, `result.nc`, and every figure
    that the run has as PNG; data in SI, text and figures in the units for reading.

    - `checks`: limits shown in the summaries
    """
    with (
        Progress("run", "series") as progress,
        whole_folder(folder) as (scratch, written),
    ):
        with display_units("si"):
            write_json(scratch / "summary.json", summary_with_limits(result, checks))
            save(result, scratch / "result.nc")
        (scratch / "summary.txt").write_text(
            text_with_limits(result, checks) + "\n", "utf-8"
        )
        names, table = _series_table(result)
        with (scratch / "series.csv").open("w", encoding="utf-8", newline="") as file:
            # names of bodies may hold anything
            csv.writer(file, lineterminator="\n").writerow(names)
            np.savetxt(file, table, fmt="%.12g", delimiter=",", encoding="utf-8")
        for picture in pictures_of(result, progress):
            picture.figure(result).savefig(scratch / f"{picture.key}.png", dpi=130)
    return written


def _series_table(result: Result) -> tuple[list[str], Float[np.ndarray, "m columns"]]:
    """Column names with units, and the series on an even grid with the values before
    and after every event."""
    series = both_sides(
        result,
        np.linspace(*span(result), 1001),
        np.unique([e.time for e in result.events]),
    )
    names: list[str] = []
    columns: list[np.ndarray] = []
    for name, values in columns_by_name(series, pairs=result.tells_pairs_apart).items():
        unit = f" [{about_column(name).unit}]" if about_column(name).unit else ""
        each = [
            "_".join(str(i + 1) for i in place)
            for place in np.ndindex(values.shape[1:])
        ]
        labels = result.nodes if name == "temperature" else each
        names += (
            [name + unit]
            if values.ndim == 1
            else [f"{name}_{label}{unit}" for label in labels]
        )
        columns += list(values.reshape(len(values), -1).T)
    return names, np.stack(columns, axis=1)


def write_json(file: Path, data: object) -> None:
    file.write_text(json.dumps(data, indent=2, allow_nan=False) + "\n", "utf-8")
