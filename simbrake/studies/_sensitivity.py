"""Local sensitivities: derivatives of results with respect to parameters, from one
differentiated run."""

import itertools
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from .._base._faults import Fault, InputError, Issues
from .._base._part import Leaf
from .._base._progress import Progress, shown_progress
from .._base._quantity import NumberReader, Quantity
from ..hybrid.arrays import Array
from ..outputs.log import labels_of
from ..parts.scene import Scene
from ..physics.mechanism import Label
from ..runs.edit import fault_of_limit, unknown_number, with_values
from ..runs.measure import (
    MetricLike,
    as_metrics,
    check_metrics,
    happened,
    name_of,
    unit_of,
)
from ..runs.one_sided import one_sided
from ..runs.result import Result
from ._sensitivity_table import ENDS, Sensitivity, SensitivityTable
from ._sides import Slopes, compare_sides
from .bounds import Inputs, Paths, name_of_entry, numbers_of
from .evaluating import Metrics, PointEvaluator, Solver, values_of


class Range(NamedTuple):
    """Metrics (m,) at the lower and the upper bound of a parameter, NaN where one has no
    value there; and changes within the range."""

    low: np.ndarray
    high: np.ndarray
    changes: str


def ranges_of(
    run: PointEvaluator,
    base: Result,
    spans: Mapping[str, np.ndarray],
    progress: Progress,
) -> dict[str, Range]:
    """Run the scene at both bounds `p ± span` of every parameter, one at a time; a list
    is changed as a whole."""
    usual = modes_of(base)
    known = Inputs(base.scene)
    ranges = {}
    for i, (path, half) in enumerate(spans.items()):
        progress.now("bounds of ranges", i, len(spans))
        if not np.any(half):
            continue
        value = np.asarray(known[path].value)
        ends = [
            end_of_range(run, with_values(base.scene, {path: end}), usual)
            for end in (value - half, value + half)
        ]
        changes = [
            f"{name} bound: {what}"
            for name, (_, what) in zip(ENDS, ends, strict=True)
            if what
        ]
        ranges[path] = Range(ends[0][0], ends[1][0], "; ".join(changes))
    return ranges


def modes_of(result: Result) -> list[Label]:
    return [label for label, _ in itertools.groupby(labels_of(result.record))]


def end_of_range(
    run: PointEvaluator, scene: Scene, usual: list[Label]
) -> tuple[np.ndarray, str]:
    """Metrics at one bound, and differences of the run there."""
    nothing = np.full(len(run.find.asked), np.nan)
    try:
        result = run.result(scene, throw=False)
    except InputError:
        return nothing, "out of range"
    if not result.ok:
        return nothing, f"the run ends as {result.status}"
    other = modes_of(result)
    what = ""
    if other != usual:
        part = next(
            i for i, (a, b) in enumerate(itertools.zip_longest(usual, other)) if a != b
        )
        mine, theirs = (
            str(modes[part]) if part < len(modes) else "the end"
            for modes in (usual, other)
        )
        what = f"other modes ({theirs} instead of {mine} after {usual[part - 1]})"
    return values_of(result, run.find), what


def sensitivity(
    scene: Scene,
    metric: MetricLike | Sequence[MetricLike],
    wrt: str | Sequence[str] | None = None,
    *,
    span: float | Mapping[str, float | str] | None = 0.01,
    most: int | None = None,
    rtol: float = 1e-10,
    solver: Solver | None = None,
    progress: Progress | bool | None = None,
) -> Any:
    """Derivatives of one or several metrics with respect to parameters of a scene,
    through every event of its run.

    - `metric`: a metric's name (`"stopping_time"`, `"max_tension"`,
      `"energy.friction_heat"`) or a function of a `Result` to a number; a list of them
      gives a list of `SensitivityTable`
    - `wrt`: paths, as `"brake.linings.friction"` for all below it, or one field;
      `None`: every parameter of the scene
    - `span`: half of the range of each number, as a share of it, or by path in SI or
      with a unit (for lists too: then a shift); the scene is run at both bounds and the
      table notes where the sequence of modes differs. `None`: no range is evaluated
    - `most`: ranges are evaluated of so many parameters for each metric, those of the
      largest elasticities; `None`: of all, two runs for each
    - `rtol`, `solver`: as for `simulate`
    - `progress`: `None` reports progress on a terminal, `True` always, `False` never

    Forward derivatives are taken one number at a time, reverse ones one metric at a
    time, whichever are fewer; either is one compiled program, which all scenes of a
    structure share.

    Derivatives are compared with differences of whole runs on both sides: at a corner
    the derivative is that of one side and noted as one-sided, where differences diverge
    there is none.

    Raises `InputError` for unknown paths and metrics, and where a metric has no value
    in this run (an event that did not occur has no derivative); `SimulationError` where
    the run fails.

    Example:
        >>> table = sb.sensitivity(scene, "stopping_time", "initial.omega", span=None)
        >>> round(table.at("initial.omega").elasticity, 6)
        1.0
    """
    single = isinstance(metric, str) or callable(metric)
    metrics = Metrics(tuple(as_metrics(metric)))
    issues = Issues()
    issues.attempt(check_metrics, scene, metrics.asked)
    within = most is None or most >= 0
    issues.unless(within, "most", most, "a number of parameters, from 0")
    chosen = issues.attempt(chosen_leaves, scene, wrt) or []
    spans: dict[str, np.ndarray] = {}
    if span is not None and chosen:
        spans = issues.attempt(_spans, chosen, span) or {}
    issues.report()
    paths = Paths.of(chosen)
    size = len(metrics.asked)
    x = numbers_of(chosen)
    run = PointEvaluator(
        scene,
        paths,
        metrics,
        size=size,
        reverse=x.size > size,
        singly=True,
        rtol=rtol,
        solver=solver,
    )
    with shown_progress(progress, "sensitivity", "compiling the run…") as progress:
        base = run.result(progress=progress)
        values = values_of(base, metrics)
        check_happened(metrics, values)
        progress.now("derivatives")
        finer_run = run.finer()
        longer = base if finer_run.rtol >= 0.05 * run.rtol else finer_run.result()
        run.like(longer)  # a derivative replays the run: its length is known
        finer_run.like(longer)
        slopes = run(x)
        if slopes.code != 0 or not np.all(np.isfinite(slopes.values)):
            raise RuntimeError(
                "the differentiated run ended before the plain one; please report this scene"
            )
        finer = finer_run(x)
        sides = compare_sides(run, base, chosen, values, slopes.jacobian, progress)
        first = _decisive(paths, slopes.jacobian * x, most)
        ranges = {path: half for path, half in spans.items() if path in first}
        around = ranges_of(run, base, ranges, progress)
    notes = () if span is None else one_sided(base.scene, base.record)
    tables = []
    for k, (metric, value) in enumerate(
        zip(metrics.asked, values.tolist(), strict=True)
    ):
        derivatives = paths.values(slopes.jacobian[k]), paths.values(finer.jacobian[k])
        rows = _rows(chosen, *derivatives, value, spans, around, sides, k)
        tables.append(
            SensitivityTable(name_of(metric), unit_of(metric), value, rows, notes)
        )
    return tables[0] if single else tables


def chosen_leaves(scene: Scene, wrt: str | Sequence[str] | None) -> list[Leaf]:
    """The requested parameters of a run, each once, in order."""
    known = list(Inputs(scene).values())
    if wrt is None:
        return known
    chosen = {}
    issues = Issues()
    for path in [wrt] if isinstance(wrt, str) else wrt:
        here = [
            leaf
            for leaf in known
            if leaf.path == path or leaf.path.startswith((f"{path}.", f"{path}["))
        ]
        if not here:
            issues.append(fault_of_limit(path) or unknown_number(scene, path))
        chosen |= {leaf.path: leaf for leaf in here}
    issues.report()
    return list(chosen.values())


def _spans(
    chosen: list[Leaf], span: float | Mapping[str, float | str]
) -> dict[str, np.ndarray]:
    """Half-ranges by path, in the units of the numbers."""
    if not isinstance(span, Mapping):
        return {
            leaf.path: np.asarray(span * np.abs(np.asarray(leaf.value)))
            for leaf in chosen
        }
    units = {leaf.path: leaf.about.unit for leaf in chosen}
    reader = NumberReader()
    issues = Issues(
        Fault(path, "has a span but is not a requested parameter")
        for path in span
        if path not in units
    )
    spans = {}
    for path in (path for path in span if path in units):
        half = span[path]
        about = Quantity(
            units[path], "half a range", 0.0, open_low=True, difference=True
        )
        spans[path] = reader.number(
            half if isinstance(half, str) else float(half), about, path, about.unit
        )
    issues += reader.faults
    issues.report()
    return {path: np.asarray(half, np.float64) for path, half in spans.items()}


def _decisive(paths: Paths, effects: np.ndarray, most: int | None) -> set[str]:
    """The parameters of the largest effects on a metric each, by those of their entries
    (m, k), `p dM/dp`."""
    sizes = np.stack(
        [np.abs(np.sum(effects[:, entries], axis=1)) for entries in paths.spans]
    )
    order = np.argsort(-np.nan_to_num(sizes), axis=0, kind="stable")[:most]
    return {paths.names[i] for i in order.ravel()}


def check_happened(metrics: Metrics, values: np.ndarray) -> None:
    hint = "its derivative does not exist; request one that occurs, or set a later end_time"
    missing = [
        metric
        for metric, value in zip(metrics.asked, values, strict=True)
        if not happened(value)
    ]
    Issues(
        Fault(name_of(metric), "has no value in this run", hint) for metric in missing
    ).report()


def _rows(
    chosen: list[Leaf],
    derivatives: Mapping[str, Array],
    finer: Mapping[str, Array],
    value: float,
    spans: Mapping[str, np.ndarray],
    ranges: Mapping[str, Range],
    sides: Slopes,
    k: int,
) -> tuple[Sensitivity, ...]:
    """Rows of metric `k`, lists as wholes (index `None`) and by their entries."""
    rows = []
    for leaf in chosen:
        path = leaf.path
        p = np.asarray(leaf.value, np.float64)
        slopes = np.asarray(derivatives[path])
        errors = np.asarray(finer[path]) - slopes
        with np.errstate(divide="ignore", invalid="ignore"):
            elasticities = slopes * p / value
        for index in [None, *np.ndindex(p.shape)] if p.ndim else [()]:
            here = ... if index is None else index
            number = float(np.mean(p[here]))
            derivative = float(np.sum(slopes[here]))
            elasticity = float(np.sum(elasticities[here]))
            note = ""
            if (side := sides.get((k, path, index))) is not None:
                # (a list as a whole: by the mean of its entries)
                if side.value != derivative:
                    elasticity = side.value * number / value if value else np.nan
                derivative, note = side
            exists = np.isfinite(derivative)
            row = Sensitivity(
                name_of_entry(path, index or ()),
                leaf.about.unit,
                leaf.about.meaning,
                number,
                derivative,
                elasticity,
                note=note,
                error=abs(float(np.sum(errors[here]))) if exists else np.nan,
            )
            if index is None:
                row = row._replace(path=f"{path}[:]")
            half = spans.get(path)
            if half is not None and not index:
                tangent = float(np.sum(slopes * half)) if exists else None
                row = row._replace(half=float(np.mean(half)), tangent=tangent)
            if path in ranges and not index:
                low, high = (
                    float(end[k]) if np.isfinite(end[k]) else None
                    for end in ranges[path][:2]
                )
                note = "; ".join(filter(None, (note, ranges[path].changes)))
                row = row._replace(low=low, high=high, note=note)
            rows.append(row)

    def size(row: Sensitivity) -> float:
        return abs(row.elasticity) if np.isfinite(row.elasticity) else 0.0

    return tuple(sorted(rows, key=size, reverse=True))
