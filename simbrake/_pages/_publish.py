"""A publication: a scene solved on a grid, as a page whose sliders interpolate between the solved points.

At each point a run and its derivatives by the parameters varied are known: of the metrics, of the times of its events,
and of its curves at fixed shares of the way from one event to the next, so that the events move and nothing is smeared
over them. Between points, with the share `s` of the way through a cell of width `h` along one axis,

    y = (1 + 2 s)(1 − s)² y_0 + s (1 − s)² h y'_0 + s² (3 − 2 s) y_1 + s² (s − 1) h y'_1

and the derivatives by the other axes linearly, `(1 − s) y'_0 + s y'_1`; so along one axis after the other. Exact at the
points with all derivatives, of fourth order on the lines between them and of third order inside. Where the sequence of
events is not the same at all corners of a cell, and at its centre, there is a gap.

No cubic follows a quantity that goes to infinity, as the stopping time does where the brake can just stop its load, and
the holding reserve where there is no load. What a cubic misses by a tenth at the centre of a cell is not shown there;
where that is the time of an event, the cell is a gap.
"""

import base64
import itertools
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._base._faults import Fault, InputError, whole_file
from .._base._part import leaves
from .._base._progress import Progress
from .._base._table import digits, pretty, scale
from .._outputs._judgement import COLOURS, REASONS, SMALL_RESERVE
from .._outputs._log import STATUS_MESSAGES, Status
from .._outputs._metrics import HOLDING, METRICS
from .._parts._scene import Scene
from .._run._edit import entry_of, with_values
from .._run._measure import PRESSURE, ROOM, LimitCheck, Limited, judged, limit_checks, measure, title_of, unit_of
from .._run._result import Result
from .._run._simulate import simulate
from .._run._verdict import SMALL_MARGIN
from ..hybrid import LANDED, STOPPED
from ..hybrid._arrays import Array
from ..studies._evaluator import Paths, PointEvaluator
from ._app import slider_of
from ._live import Chart, Data, charts_of, events_of, still
from ._page import PERMISSIBLE, PICTURES, draw, head, render
from ._rows import deciding

#: points and pieces between events at most; bytes of the numbers; samples of a piece
_POINTS, _PIECES, _BYTES, _SAMPLES = 4000, 60, 4_400_000, (6, 40)
#: cells whose centre is run
_CENTRES = 250
#: a metric, or the time of an event, that is off by more than this share at the centre of a cell is not shown there
_COARSE = 0.1
#: samples lie inside their piece by this share of it: on its ends there is an event
_INSIDE = 1e-9

Rows = Float[np.ndarray, "rows values"]  # values, and their derivative by each axis


#: parameters that are varied: the values (SI) by path at which the scene is solved
Axes: TypeAlias = Mapping[str, Sequence[float]]


def faults_of_axes(scene: Scene, axes: Axes) -> list[Fault]:
    """Errors of parameters and points that a page cannot have."""
    paths = {leaf.path for leaf in leaves(scene)}
    absent = [path for path in axes if entry_of(path, paths)[0] not in paths]
    faults = [Fault(path, "is absent in this scene", "give the scene a value of it") for path in absent]
    count = math.prod(map(len, axes.values()))
    return faults + ([Fault("--vary", f"makes {count} points", f"up to {_POINTS}")] if count > _POINTS else [])


# --- the solved points ------------------------------------------------------------------------------------------------


class Sampled(NamedTuple):
    """The run at a point: metrics, times at which its pieces end, and curves inside the pieces."""

    metrics: tuple[str, ...]
    pieces: int
    samples: int

    def __call__(self, result: Result, given: Any = None) -> tuple[Array, None]:
        rows, count = result.record.rows, result.record.count
        ends = (rows.kind == LANDED) | (rows.kind == STOPPED)
        ends = ends & (jnp.arange(rows.kind.size, dtype=jnp.int32) < count)
        (index,) = jnp.nonzero(ends, size=self.pieces - 1, fill_value=rows.kind.size)
        inner = jnp.asarray(rows.t)[jnp.minimum(index.astype(jnp.int32) + 1, count)]
        edges = jnp.concatenate([jnp.asarray(rows.t)[:1], inner, jnp.asarray(rows.t)[count][None]])
        shares = jnp.asarray(_INSIDE + (1 - 2 * _INSIDE) * np.linspace(0.0, 1.0, self.samples))
        times = edges[:-1, None] + jnp.diff(edges)[:, None] * shares
        series = result.series(times.ravel())
        lines = [line for chart in smooth(charts_of(result.scene, series)) for line in chart.values(series)]
        each = [jnp.asarray(measure(result, name), jnp.float64).reshape(1) for name in self.metrics]
        return jnp.concatenate([*each, edges, *lines]), None

    def size(self, lines: int) -> int:
        """Count of these numbers."""
        return len(self.metrics) + self.pieces + 1 + lines * self.pieces * self.samples

    def cut(self, rows: Rows, pieces: int, lines: int) -> Rows:
        """The numbers of a run that has fewer pieces: behind its end there are empty ones."""
        at = len(self.metrics) + self.pieces + 1
        curves = rows[:, at:].reshape(len(rows), lines, self.pieces, self.samples)[:, :, :pieces]
        return np.concatenate([rows[:, : len(self.metrics) + pieces + 1], curves.reshape(len(rows), -1)], axis=1)


def smooth(charts: Sequence[Chart]) -> list[Chart]:
    """Charts whose curves have derivatives."""
    return [chart for chart in charts if not chart.stepped]


def sequence_of(result: Result) -> tuple[Any, ...]:
    """Properties that must not change between two points: events and corners in their order, status and verdict."""
    kind = np.asarray(result.record.rows.kind)[: int(result.record.count)]
    guard, events = np.asarray(result.record.rows.guard), np.flatnonzero(kind >= LANDED)
    ended = result.status, result.report().judgement.reason
    return ended, *((int(kind[i]), -1 if kind[i] == STOPPED else int(guard[i])) for i in events)


def pieces_of(sequence: tuple[Any, ...]) -> int:
    """Number of pieces between events of a run."""
    return 1 + sum(kind in (LANDED, STOPPED) for kind, _ in sequence[1:])


def between(corners: Float[np.ndarray, "corners rows values"], shares: Sequence[float], widths: Sequence[float]) -> Any:
    """Values inside a cell from rows at its corners, the last axis counting fastest; the formula of this module."""
    for k, (s, h) in enumerate(zip(shares, widths, strict=True), 1):
        a, b = np.split(corners, 2)
        value = (1 + 2 * s) * (1 - s) ** 2 * a[:, 0] + s * (1 - s) ** 2 * h * a[:, k]
        value = value + s * s * (3 - 2 * s) * b[:, 0] + s * s * (s - 1) * h * b[:, k]
        corners = (1 - s) * a + s * b
        corners[:, 0] = value
    return corners[0, 0]


class Published(NamedTuple):
    """What a page shows, and how far off it is.

    - counts: points, those whose run failed, cells, those that are gaps, those at whose centre a run was compared
    - the largest deviation of a metric that is shown there, as a share of its value in that run; of which metric, and
      at which values (SI) of the parameters
    - `coarse`: metrics that change too fast to be shown in some cells, and in how many
    """

    points: int
    failed: int
    cells: int
    gaps: int
    checked: int
    deviation: float
    of: str
    at: dict[str, float]
    coarse: dict[str, int]

    def __str__(self) -> str:
        said = f"{self.points} points solved" + (f", {self.failed} of them failed" if self.failed else "")
        said += f"; {self.gaps} of {self.cells} cells between them are gaps, where the sequence of events changes, or "
        said += "times of events change too fast"
        if self.coarse:
            words = ", ".join(f"{name} in {count}" for name, count in self.coarse.items())
            said += f"; not shown, as they change too fast between the points: {words} of these cells"
        if self.of:
            where = ", ".join(f"{path} = {digits(value)}" for path, value in self.at.items())
            far = f"{digits(100 * self.deviation, 2)} % ({self.of}, at {where}, SI)"
            said += f"; at {self.checked} centres of cells the largest deviation of what is shown is {far}"
        return said


def coverage(limited: Limited, base: Result, checks: Sequence[LimitCheck]) -> Data:
    """How a page with sliders compares, in words, and whether its verdict leaves anything `open`."""
    missing, names = judged(base, checks).missing, {check.name for check in checks if check.limit is not None}
    by_load = PRESSURE in names and "max_normal_load" in limited.limits
    aside = ", ".join(title_of(name) for name in limited.aside)
    words = ["Pressure on linings is compared by their load."] if by_load else []
    words += [f"Not looked at here: {aside}."] if aside else []
    words += [f"No limit for: {', '.join(missing)}."] if missing else []
    return {"words": " ".join(words), "open": bool(aside or missing)}


def publish(
    scene: Scene,
    axes: Axes,
    path: Path,
    *,
    limits: Mapping[str, float],
    title: str,
    progress: Progress,
    rtol: float = 1e-10,
) -> Published:
    """Solve a scene on the grid of `axes` and write the page. Raises `InputError` where it would become too large."""
    names, points = [*axes], list(itertools.product(*axes.values()))
    base = simulate(scene, rtol=rtol, throw=False)
    sequences, results = list[tuple[Any, ...] | None](), dict[tuple[Any, ...], Result]()
    for i, point in enumerate(points):
        progress.now("runs", i, len(points))
        result = simulate(with_values(scene, dict(zip(names, point, strict=True))), rtol=rtol, throw=False)
        sequences.append(sequence_of(result) if result.ok else None)
        if result.ok:
            results.setdefault(sequence_of(result), result)
    if not results:
        raise InputError([Fault("--vary", f"no run ends: {result.message}", "other ranges")])  # pyright: ignore
    first = next(iter(results.values()))
    charts = smooth(charts_of(scene, first.series([float(scene.initial.time)])))
    lines, most = sum(len(chart.lines) for chart in charts), max(map(pieces_of, results))
    metrics = tuple(name for name, metric in METRICS.items() if not metric.energy and not metric.needs.lacks(scene))
    metrics = (*metrics, "energy.friction_heat")
    room = _BYTES * 3 / 16 / (len(points) * (1 + len(axes))) - len(metrics) - most - 1
    samples = min(_SAMPLES[1], int(room / (lines * most)))
    if samples < _SAMPLES[0] or most > _PIECES:
        what = f"makes {len(points)} points with up to {most} pieces between events: the page would exceed 5 MB"
        raise InputError([Fault("--vary", what, "fewer points, or an earlier end_time")])
    sampled = Sampled(metrics, most, samples)
    solve = PointEvaluator(scene, Paths.each(names), sampled, size=sampled.size(lines), singly=True, rtol=rtol)
    solve.like(first)
    grid = _Grid(axes, sequences, _derivatives(solve, points, sequences, progress))
    gaps, coarse, about = _centres(scene, grid, sampled, rtol, progress)
    places, kinds, numbers = grid.packed(results, sampled, lines)
    limited, checks = Limited.of(scene, limits, metrics), limit_checks(base, limits)
    data = {
        "axes": [_slider(scene, path, values) for path, values in axes.items()],
        "points": places,
        "sequences": kinds,
        "gaps": gaps,
        "coarse": coarse,
        "metrics": metrics_of(metrics, base, limited.limits),
        "coverage": coverage(limited, base, checks),
        "charts": [chart.as_dict() for chart in charts],
        "samples": samples,
        "numbers": numbers,
    }
    notes = (
        f"Solved at {' × '.join(map(str, grid.shape))} points with exact derivatives, cubic Hermite between them. "
        f"{about}.",
        "Maxima over a run have a kink where they move to another instant; there the deviation is largest.",
    )
    parts = {
        **head(base, checks, title),
        "kind": "publish",
        "film": False,
        "panel": "Solved range in blue; yellow marks gaps, where the sequence of events changes, "
        "or times of events change too fast.",
        "pictures": [*([draw(base, PICTURES[0])] if base.ok else []), *grid.map(scene, metrics, limited)],
        "notes": notes,
        "data": {"still": still(scene), "grid": data},
    }
    with whole_file(path) as file:
        file.write_text(render(parts), "utf-8")
    return about


def _derivatives(
    solve: PointEvaluator, points: Sequence[Any], sequences: Sequence[Any], progress: Progress
) -> list[Rows | None]:
    """Values and derivatives at the solved points, `None` where a run failed."""
    solved = list[Rows | None]()
    for i, (point, sequence) in enumerate(zip(points, sequences, strict=True)):
        progress.now("derivatives", i, len(points))
        evaluation = None if sequence is None else solve(np.asarray(point))
        good = evaluation is not None and evaluation.code == 0
        solved.append(_rows(evaluation.values, evaluation.jacobian) if evaluation is not None and good else None)
    return solved


def _rows(values: np.ndarray, jacobian: np.ndarray) -> Rows:
    """Values and derivatives by each axis; what did not happen has no value and no derivative."""
    there = np.isfinite(values)
    slopes = np.where(there, jacobian.T, 0.0)
    return np.concatenate([np.where(there, values, np.nan)[None], np.where(np.isfinite(slopes), slopes, 0.0)])


class _Grid(NamedTuple):
    """The solved points, the last axis counting fastest."""

    axes: Axes
    sequences: Sequence[tuple[Any, ...] | None]
    solved: Sequence[Rows | None]

    @property
    def shape(self) -> list[int]:
        return [len(values) for values in self.axes.values()]

    @property
    def cells(self) -> int:
        return math.prod(n - 1 for n in self.shape)

    def around(self, cell: int) -> list[int]:
        """Cells beside a cell, along each axis."""
        counts = [n - 1 for n in self.shape]
        place = np.unravel_index(cell, counts)
        moved = [np.add(place, sign * step) for step in np.eye(len(counts), dtype=int) for sign in (-1, 1)]
        return [int(np.ravel_multi_index(tuple(p), counts)) for p in moved if np.all((p >= 0) & (p < counts))]

    def corners(self, cell: int) -> tuple[tuple[int, ...], list[int]]:
        """Place of a cell, and the points at its corners."""
        place = tuple(int(i) for i in np.unravel_index(cell, [n - 1 for n in self.shape]))
        steps = itertools.product((0, 1), repeat=len(place))
        each = [np.ravel_multi_index([i + d for i, d in zip(place, step, strict=True)], self.shape) for step in steps]
        return place, [int(i) for i in each]

    def map(self, scene: Scene, metrics: Sequence[str], limited: Limited) -> list[Data]:
        """The permissible map of a grid of two parameters, where all limits are those of the page."""
        limits = limited.limits
        if len(self.axes) != 2 or min(self.shape) < 2 or not limits or limited.aside:
            return []
        import xarray as xr  # (slow to import)

        paths, about = [*self.axes], {leaf.path: leaf.about for leaf in leaves(scene)}
        solved = np.stack(
            [np.full(len(metrics), np.nan) if rows is None else rows[0, : len(metrics)] for rows in self.solved]
        )
        values = {
            name: (paths, solved[:, metrics.index(name)].reshape(self.shape), {"units": unit_of(name)})
            for name in limits
        }
        codes = {"code": (paths, np.asarray([rows is None for rows in self.solved], int).reshape(self.shape))}
        ends = {}
        for path, points in self.axes.items():
            of = about[entry_of(path, about)[0]]
            ends[path] = (path, [*points], {"units": of.unit, "meaning": of.meaning})
        return [draw((xr.Dataset({**values, **codes}, ends), limits), PERMISSIBLE)]

    def packed(self, results: Mapping[tuple[Any, ...], Result], sampled: Sampled, lines: int) -> Any:
        """For the script: of each point its sequence of events and where its numbers begin; the sequences; the numbers.

        - `results`: a run of each sequence;  `lines`: number of curves
        """
        sizes, kept, order = {events: pieces_of(events) for events in results}, list[np.ndarray](), [*results]
        points, start = list[Data](), 0
        for rows, sequence in zip(self.solved, self.sequences, strict=True):
            if rows is None or sequence is None:
                points.append({"sequence": -1, "start": start})
                continue
            points.append({"sequence": order.index(sequence), "start": start})
            kept.append(sampled.cut(rows, sizes[sequence], lines).astype("<f4").ravel())
            start += kept[-1].size
        sequences = [_sequence(result, sizes[events], sampled, lines) for events, result in results.items()]
        return points, sequences, base64.b64encode(np.concatenate(kept).tobytes()).decode("ascii")


#: place of the times of events among those of the metrics
_TIMES = -1


def _centres(
    scene: Scene, grid: _Grid, sampled: Sampled, rtol: float, progress: Progress
) -> tuple[list[int], dict[int, list[int]], Published]:
    """What runs at the centres of cells say.

    - cells in which the sequence of events changes
    - of a cell the places of the metrics that are not shown there, or `_TIMES` where it is a gap as times of events are
      off
    - how far off the page is
    """
    gaps, whole = list[int](), list[int]()
    for cell in range(grid.cells):
        _, corners = grid.corners(cell)
        same = len({grid.sequences[i] for i in corners}) == 1 and all(grid.solved[i] is not None for i in corners)
        (whole if same else gaps).append(cell)
    chosen = whole[:: 1 + len(whole) // _CENTRES]
    coarse = dict[int, list[int]]()
    worst, of, at = 0.0, "", dict[str, float]()
    for i, cell in enumerate(chosen):  # (which grows)
        progress.now("centres of cells", i, len(chosen))
        place, corners = grid.corners(cell)
        ends = [values[k : k + 2] for values, k in zip(grid.axes.values(), place, strict=True)]
        centre = {name: 0.5 * (low + high) for name, (low, high) in zip(grid.axes, ends, strict=True)}
        result = simulate(with_values(scene, centre), rtol=rtol, throw=False)
        if not result.ok or sequence_of(result) != grid.sequences[corners[0]]:
            gaps.append(cell)
            continue
        rows = np.stack([grid.solved[k] for k in corners])  # pyright: ignore
        values = between(rows, [0.5] * len(ends), [high - low for low, high in ends])
        off = _deviations(result, sampled, values, rows)
        late = _late(result, sampled, values)
        if late or np.any(off > _COARSE):
            coarse[cell] = [_TIMES] if late else np.flatnonzero(off > _COARSE).tolist()
            # (its neighbours may be as coarse)
            chosen += [other for other in grid.around(cell) if other in whole and other not in chosen]
        shown = np.where(late | (off > _COARSE), 0.0, off)
        if (largest := float(np.max(shown))) > worst:
            worst, of, at = largest, title_of(sampled.metrics[int(np.argmax(shown))]), centre
    fast = [cell for cell, which in coarse.items() if _TIMES in which]
    hidden = [i for which in coarse.values() if _TIMES not in which for i in which]
    named = {title_of(sampled.metrics[i]): hidden.count(i) for i in sorted(set(hidden))}
    failed, missing = sum(rows is None for rows in grid.solved), len(gaps) + len(fast)
    about = Published(len(grid.solved), failed, grid.cells, missing, len(chosen), worst, of, at, named)
    return sorted(gaps), coarse, about


def _deviations(result: Result, sampled: Sampled, values: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """By which share of the run's own value each metric is off; 0 where the run has none."""
    true = np.asarray([float(measure(result, name)) for name in sampled.metrics])
    off, around = np.abs(values[: true.size] - true), np.max(np.abs(corners[:, 0, : true.size]), axis=0)
    size = np.maximum(np.abs(true), np.maximum(1e-6 * around, 1e-300))  # (a value that passes zero has no share)
    return np.where(np.isfinite(off), off / size, 0.0)


def _late(result: Result, sampled: Sampled, values: np.ndarray) -> bool:
    """Whether the time of an event is off by more than `_COARSE` of the time since the begin of the run."""
    true = _edges(result)
    since = np.maximum(true - true[0], 1e-6 * (true[-1] - true[0]))
    first = len(sampled.metrics)
    return bool(np.any(np.abs(values[first : first + true.size] - true) > _COARSE * since))


def _edges(result: Result) -> np.ndarray:
    """Times (s) between which the pieces of a run lie."""
    rows, count = result.record.rows, int(result.record.count)
    kind, t = np.asarray(rows.kind)[:count], np.asarray(rows.t)
    return np.concatenate([t[:1], t[1 : count + 1][(kind == LANDED) | (kind == STOPPED)], t[count : count + 1]])


def _slider(scene: Scene, path: str, values: Sequence[float]) -> Data:
    fields = {leaf.path: leaf for leaf in leaves(scene)}
    field, index = entry_of(path, fields)
    leaf = fields[field]
    value = float(np.ravel(leaf.value)[index or 0])
    value = value if values[0] <= value <= values[-1] else values[len(values) // 2]
    return {**slider_of(path, value, leaf.about, (values[0], values[-1])), "values": [*values]}


def _sequence(result: Result, pieces: int, sampled: Sampled, lines: int) -> Data:
    edges = _edges(result)
    judgement = result.report().judgement
    reason = REASONS[judgement.reason]
    events = [{**event, "edge": int(np.argmin(np.abs(edges - event["t"])))} for event in events_of(result)]
    return {
        "pieces": pieces,
        "size": sampled._replace(pieces=pieces).size(lines),
        "events": events,
        "status": f"{reason.id}: {reason.words}",
        "message": message_of(result.scene, Status(result.status)),
        "colour": COLOURS[judgement.colour],
    }


def message_of(scene: Scene, status: Status) -> str:
    """How a run ended, in the words of its kind of brake."""
    return STATUS_MESSAGES[status].replace("the pulley", f"the {scene.brake.words.body}")


def metrics_of(names: Sequence[str], base: Result, limits: Mapping[str, float]) -> list[Data]:
    """Metrics for the script: words, unit for reading, limit, and whether they decide."""
    decide = deciding({name: float(measure(base, name)) for name in names})
    return [{"name": name, **_metric(name, base, limits), "decides": name in decide} for name in names]


def _metric(name: str, base: Result, limits: Mapping[str, float]) -> Data:
    """`limit` and `least`: what it may be at most and must exceed; `small`: a margin that is less is small."""
    unit, value = unit_of(name), float(measure(base, name))
    factor, offset, shown = scale(unit, abs(value) if math.isfinite(value) else 1.0, absolute=True)
    limit, least, small = limits.get(name), None, 0.0
    if limit is not None:
        small = SMALL_MARGIN * max(limit - (ROOM if unit == "K" else 0.0), 0.0)
    elif name == HOLDING:
        least, small = 1.0, SMALL_RESERVE - 1.0
    reading = {"factor": factor, "offset": offset, "unit": shown, "si_unit": pretty(unit)}
    return {"words": title_of(name), **reading, "limit": limit, "least": least, "small": small}
