"""A publication: a page with the C of its scene as WebAssembly, so that every move of a
slider is a run."""

import base64
import gzip
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .._base._faults import input_error, whole_file
from .._base._numbers import pretty, scale, scales
from .._base._part import leaves
from .._base._progress import Progress
from ..export import Export, c_text, possible_inputs
from ..outputs.judgement import COLOURS, REASONS, SMALL_RESERVE
from ..outputs.log import FAILURES, Event, Status, status_words
from ..outputs.metrics import HOLDING, METRICS, is_least, is_of_size
from ..parts.scene import Scene
from ..runs.edit import entry_of
from ..runs.measure import (
    PRESSURE,
    ROOM,
    SMALL_MARGIN,
    LimitCheck,
    coverage_of,
    limit_checks,
    measure,
    title_of,
    unit_of,
)
from ..runs.result import Result
from ..runs.simulate import room_for, simulate
from ..runs.verdict import RESERVE, SLIDING, STILL_MOVING
from ..studies.limits import LimitsOfManyRuns
from ._app import is_limit, slider_of, sliders
from ._live import Data, charts_of, look_of_event
from ._page import PICTURES, draw, head, render, template_file
from ._rows import deciding

#: what to do where no page can run the scene
OTHER_PAGES = "simbrake report and simbrake app make pages of it"
#: rows of the curves: more than a page has pixels
_ROWS = 600
_FLAGS = (
    "-target",
    "wasm32-wasi",
    "-mexec-model=reactor",
    "-O2",
    "-std=c99",
    "-ffp-contract=off",
    "-s",
    "-Wl,-z,stack-size=4194304",
)


class Published(NamedTuple):
    """What a page has: sliders, metrics, and the size (bytes) of its program and of the
    page."""

    sliders: int
    metrics: int
    program: int
    size: int

    def __str__(self) -> str:
        return (
            f"{self.sliders} sliders, {self.metrics} metrics; the page has "
            f"{self.size / 1e6:.2g} MB, {self.program / 1e6:.2g} MB of them its program"
        )


def publish(
    scene: Scene,
    ranges: Mapping[str, Sequence[float]],
    path: Path,
    *,
    limits: Mapping[str, float],
    title: str,
    progress: Progress,
    rtol: float = 1e-10,
) -> Published:
    """Write the page of a scene that its reader's browser runs, with sliders for
    `ranges`, or else for all parameters.

    Raises `InputError` for a scene that has no C form.
    """
    base = simulate(scene, rtol=rtol, throw=False)
    metrics = [
        name
        for name, metric in METRICS.items()
        if not (metric.energy or metric.if_asked or metric.needs.lacks(scene))
    ]
    metrics.append("energy.friction_heat")
    progress.now("printing")
    steps = possible_inputs(scene) is not None
    # other numbers may need more steps
    room = max(256, 2 * room_for(base))

    def printed() -> tuple[Export, str]:
        export = Export("scene", scene, {} if steps else None, metrics, room)
        return export, c_text(export, OTHER_PAGES)

    export, text = printed()
    progress.now("compiling")
    program = gzip.compress(
        _compiled(text, steps, _ROWS if steps else room + 1), 9, mtime=0
    )
    charts = charts_of(scene, base.series([float(scene.initial.time)]))
    places = export.places()
    limited = LimitsOfManyRuns.of(scene, limits, metrics)
    checks = limit_checks(base, limits)
    data: Data = {
        "program": base64.b64encode(program).decode("ascii"),
        "controls": _controls(export, ranges),
        "numbers": int(export.numbers.size),
        "width": export.width,
        "steps": steps,
        "rows": _ROWS,
        "rtol": rtol,
        "span": _places(export, "initial.time") + _places(export, "end_time"),
        "metrics": [*_metrics(metrics, base, limited.limits)],
        "coverage": _coverage(limited, base, checks),
        "statuses": [status_words(status, scene.brake.words) for status in Status],
        "reasons": [f"{reason.id}: {reason.words}" for reason in REASONS],
        "colours": list(COLOURS),
        "ratios": [
            {"key": "reserve", "words": RESERVE, "reasons": [*range(len(REASONS))]},
            {
                "key": "least",
                "words": METRICS[HOLDING].title,
                "reasons": [*range(len(REASONS))],
            },
            {
                "key": "sliding",
                "words": SLIDING,
                "reasons": [
                    i for i, reason in enumerate(REASONS) if reason.id in STILL_MOVING
                ],
            },
        ],
        "least": metrics.index(HOLDING) if HOLDING in metrics else None,
        "small": SMALL_RESERVE,
        "failures": {
            int(code): [name, what] for code, (name, what, _) in FAILURES.items()
        },
        "events": [
            None,
            *(look_of_event(Event(0.0, name, None)) for name in export.events),
        ],
        "time": places["t"][0],
        "charts": [
            {
                **chart.as_dict(),
                "factor": chart.read.factor,
                "offset": chart.read.offset,
                "from": [[*places[line.column], line.most] for line in chart.lines],
            }
            for chart in charts
        ],
    }
    parts = {
        **head(base, checks, title),
        "kind": "live",
        "film": False,
        "panel": "Each move is a run in your browser, as exact as one in Python. "
        "Values in fields may leave the range "
        "of their slider.",
        "pictures": [draw(base, PICTURES[0])] if base.ok else (),
        "notes": [
            f"Relative tolerance {rtol:g}. Checks between several numbers of a scene "
            "are not made here."
        ],
        "data": {"live": data},
    }
    page = render(parts)
    with whole_file(path) as file:
        file.write_text(page, "utf-8")
    return Published(
        len(data["controls"]), len(metrics), len(program), len(page.encode())
    )


def _compiled(text: str, steps: bool, rows: int) -> bytes:
    """The program of a page, as WebAssembly."""
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        (scratch / "scene.c").write_text(text, "utf-8")
        (scratch / "live.c").write_text(template_file("live.c"), "utf-8")
        defined = [f"-DROWS={rows}", *(["-DSTEPS"] if steps else [])]
        zig = [sys.executable, "-m", "ziglang", "cc", *_FLAGS, *defined]
        call = [*zig, "-o", "live.wasm", "live.c"]
        done = subprocess.run(call, cwd=scratch, capture_output=True, text=True)
        if done.returncode:
            lines = [line for line in done.stderr.splitlines() if "error" in line]
            error = [*lines, done.stderr[-200:]][0]
            raise input_error("ziglang", f"failed: {error}", OTHER_PAGES)
        return (scratch / "live.wasm").read_bytes()


def _controls(export: Export, ranges: Mapping[str, Sequence[float]]) -> list[Data]:
    """Sliders of the page, each with the places of its number."""
    fields = {leaf.path: leaf for leaf in leaves(export.scene)}
    if ranges:
        controls = []
        for path, (low, high) in ranges.items():
            field, index = entry_of(path)
            value = float(np.ravel(fields[field].value)[index or 0])
            about = fields[field].about
            group = {"group": field.rpartition(".")[0] or "scene"}
            controls.append(slider_of(path, value, about, (low, high)) | group)
    else:
        # (limits are those of the start: what a slider moves is a run)
        there = {
            leaf.path for leaf in leaves(export.scene.as_run) if not is_limit(leaf)
        }
        controls = [
            control
            for control in sliders(export.scene)
            if entry_of(control["path"])[0] in there
        ]
    for control in controls:
        field, _ = entry_of(control["path"])
        control["places"] = _places(export, control["path"])
        control["ends"] = [float(end) for end in fields[field].about.ends]
    return controls


def _places(export: Export, path: str) -> list[int]:
    """Places of a parameter, or of all entries of a list, among the numbers of a
    scene."""
    placed = {leaf.path: leaf.value for leaf in export.placed}
    field, index = entry_of(path)
    places = np.ravel(placed[field]).astype(int).tolist()
    return places if index is None else [places[index]]


# --- what the page says of its metrics ----------------------------------------------


def _coverage(
    limited: LimitsOfManyRuns, base: Result, checks: Sequence[LimitCheck]
) -> Data:
    """What the page compares with limits, in words, and whether that leaves its verdict
    `open`."""
    covered = coverage_of(base, checks)
    names = {check.name for check in checks if check.limit is not None}
    by_load = PRESSURE in names and "max_normal_load" in limited.limits
    aside = ", ".join(title_of(name, base.scene) for name in limited.aside)
    words = ["Pressure on linings is compared by their load."] if by_load else []
    words += [f"Not looked at here: {aside}."] if aside else []
    words += [f"{covered}."] if covered.missing else []
    return {"words": " ".join(words), "open": bool(aside or covered.missing)}


def _metrics(
    names: Sequence[str], base: Result, limits: Mapping[str, float]
) -> Iterator[Data]:
    """Metrics for the script: words, units for reading, and whether they decide;
    `limit`: what they may be at most (`least`: at least; `of_size`: in either sense),
    `small`: a margin that is less is small."""
    decide = deciding({name: float(measure(base, name)) for name in names})
    for name in names:
        unit = unit_of(name)
        limit = limits.get(name)
        factor, offset, read_in = scale(unit, 0.0, absolute=True)
        small = 0.0
        if limit is not None:
            small = SMALL_MARGIN * max(limit - ROOM * (unit == "K"), 0.0)
        yield {
            "name": name,
            "words": title_of(name, base.scene),
            # (the last one for what is smaller; of a difference without the offset)
            "scales": [*scales(unit), (0.0, factor, read_in)],
            "offset": offset,
            "difference": scale(unit, 0.0)[2],
            "si_unit": pretty(unit),
            "limit": limit,
            "least": is_least(name),
            "of_size": is_of_size(name),
            "small": small,
            "decides": name in decide,
        }
