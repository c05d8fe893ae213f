"""Local sensitivities: derivatives of results with respect to parameters, from one
differentiated run."""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np

from .._base._faults import Fault, InputError, Issues, input_error, nearest
from .._base._part import Leaf
from .._base._progress import Progress, shown_progress
from .._base._quantity import NumberReader, Quantity, unit_suffix
from .._base._table import Column, Table, Tabular, frozen
from ..hybrid.arrays import Array
from ..outputs.log import labels_of
from ..parts.scene import Scene
from ..physics.mechanism import Label
from ..runs.edit import Inputs, fault_of_limit, with_values
from ..runs.measure import Metric, check_metrics, happened, name_of, unit_of
from ..runs.one_sided import one_sided
from ..runs.result import Result
from ._sides import Slopes, compare_sides
from .evaluating import (
    Metrics,
    Paths,
    PointEvaluator,
    Solver,
    as_metrics,
    name_of_entry,
    numbers_of,
    values_of,
)

_ENDS = ("lower", "upper")


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
            for name, (_, what) in zip(_ENDS, ends, strict=True)
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


#: ends of paths of what nobody changes by a share: constants of nature, counts
FIXED = ("gravity", "line_count", "initial.time", "end_time")
#: an elasticity below this is rounding error
_ROUNDING = 1e-13
#: rows that are printed
_SHOWN = 30


class Sensitivity(NamedTuple):
    """Sensitivity of a metric `M` to one parameter `p` of a scene.

    - `path`, `unit`, `value` of the parameter (SI), and its `meaning`
    - `derivative` `dM/dp`
    - `elasticity` `(p/M) dM/dp`: percent of the metric for one percent of the parameter
    - `half`: half of the range of `p`
    - `low`, `high`: the metric at its bounds; `None` where it has
      no value or was not evaluated
    - `tangent`: change of the metric over `half` along the derivative. What `high − M`
      and `M − low` differ from it by is the curvature:
      `½ (low + high) − M = ½ half² d²M/dp² + O(half⁴)`
    - `error`: estimated error of the derivative by integration in time, from the same
      derivative at a tenth of the tolerance (above 1e-9 at 1e-12, below 1e-12 at ten
      times); NaN where that run has none
    - `note`: whether the derivative is one-sided, or why there is none (`derivative` is
      then NaN); changes within the range that limit its validity; empty if none

    A path that ends in `[:]` means all entries of a list: `value` is their mean,
    `derivative` that of one shift of all of them, `elasticity` and range those of one
    factor for all of them.

    Example:
        >>> table = sb.sensitivity(scene, "stopping_time", "initial.omega", span=None)
        >>> round(table.at("initial.omega").derivative, 5)
        0.05241
    """

    path: str
    unit: str
    meaning: str
    value: float
    derivative: float
    elasticity: float
    half: float | None = None
    low: float | None = None
    high: float | None = None
    note: str = ""
    tangent: float | None = None
    error: float = math.nan


@frozen
class SensitivityTable(Tabular):
    """Sensitivities of one metric, the largest elasticity first; `notes` concern the
    whole run.

    Example:
        >>> table = sb.sensitivity(scene, "stopping_time", "initial.omega", span=None)
        >>> [row.path for row in table.rows]
        ['initial.omega']
    """

    metric: str
    unit: str
    value: float
    rows: tuple[Sensitivity, ...]
    notes: tuple[str, ...] = ()

    def at(self, path: str) -> Sensitivity:
        """The row of a path; raises `KeyError` with the nearest paths."""
        for row in self.rows:
            if row.path == path:
                return row
        raise KeyError(
            f"{path}: not in the table; "
            f"{nearest(path, (row.path for row in self.rows), cutoff=0.3)}"
        )

    @property
    def matters(self) -> tuple[Sensitivity, ...]:
        """The rows of `wholes` that influence the metric or have a note."""
        return tuple(row for row in self.wholes if row.note or _moves(row))

    @property
    def wholes(self) -> tuple[Sensitivity, ...]:
        """The rows without the single entries of lists."""
        return tuple(
            row
            for row in self.rows
            if row.path.endswith("[:]") or not row.path.endswith("]")
        )

    def bars(
        self, most: int
    ) -> tuple[
        float, list[tuple[Sensitivity, list[tuple[Literal["low", "high"], float]]]]
    ]:
        """Of a tornado chart the value of the metric, and parameters with the ends of
        their bars.

        Without ranges in the table the bars are elasticities, which count from 0.
        """
        free = [row for row in self.matters if not row.path.endswith(FIXED)]
        ranged = [row for row in free if row.low is not None and row.high is not None]
        if ranged:
            return self.value, [
                (row, [("low", row.low), ("high", row.high)]) for row in ranged[:most]
            ]  # pyright: ignore
        rows = [row for row in free if np.isfinite(row.elasticity)]
        return 0.0, [
            (row, [("high" if row.elasticity > 0 else "low", row.elasticity)])
            for row in rows[:most]
        ]

    def parts(self) -> Iterator[str | Table]:
        """The single entries of lists are left out, parameters without influence only
        counted."""
        yield f"{self.metric} = {self.value:.8g}{unit_suffix(self.unit)}"
        shown = self.matters[:_SHOWN]
        ends = any(row.low is not None or row.high is not None for row in shown)
        columns = [("path", "parameter p"), Column("value", show=".6g"), "unit"]
        columns += [
            Column("derivative", show=".5g"),
            Column("error", heading="± error", show=".1g"),
        ]
        columns += [Column("elasticity", show=".4g")]
        columns += [Column("half", heading="± half", show=".3g", hidden=not ends)]
        columns += [
            Column(f"at the {name} bound", show=".7g", hidden=not ends)
            for name in _ENDS
        ]
        fields = (
            "path",
            "value",
            "unit",
            "derivative",
            "error",
            "elasticity",
            "half",
            "low",
            "high",
            "note",
        )
        rows = [tuple(getattr(row, field) for field in fields) for row in shown]
        yield Table([*columns, ("note", "")], rows)
        left = len(self.wholes) - len(shown)
        without = len(self.wholes) - len(self.matters)
        rest = [f"{left - without} more"] * (left > without) + [
            f"{without} without influence"
        ] * bool(without)
        if rest:
            yield f"and {' and '.join(rest)}"
        yield from (f"note: {note}" for note in self.notes)


def _moves(row: Sensitivity) -> bool:
    """A number that is 0 has no elasticity, but may have an influence."""
    return row.derivative != 0 and (row.value == 0 or abs(row.elasticity) > _ROUNDING)


def sensitivity(
    scene: Scene,
    metric: Metric | Sequence[Metric],
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
    check_metrics(scene, metrics.asked)
    if most is not None and most < 0:
        raise input_error(
            "most", f"{most} is out of range", "a number of parameters, from 0"
        )
    chosen = chosen_leaves(scene, wrt)
    spans = {} if span is None else _spans(chosen, span)
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
            some = f"as {', '.join(leaf.path for leaf in known[:4])}"
            hint = nearest(path, (leaf.path for leaf in known), some, cutoff=0.4)
            issues.append(
                fault_of_limit(path)
                or Fault(path, "unknown parameter of the scene", hint)
            )
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


# --- second derivatives -------------------------------------------------------------


#: shares of the step, each of which removes one power of its square from the error
_SHARES = (1.0, 0.5, 0.25)


class Hessian(NamedTuple):
    """Second derivatives of a metric: `matrix` (k, k) `∂²M/∂p_i ∂p_j`, of the numbers
    named in `paths` (k,).

    - `value` `M`;  `gradient` (k,) `∂M/∂p_i`
    - `error` (k, k): estimate from the last two extrapolations, and from the asymmetry
      of the matrix

    Example:
        >>> found = sb.studies.hessian(scene, "stopping_angle", "initial.omega")
        >>> round(float(found.gradient[0]), 4), round(float(found.matrix[0, 0]), 4)
        (1.2577, 0.0524)
    """

    paths: tuple[str, ...]
    value: float
    gradient: np.ndarray
    matrix: np.ndarray
    error: np.ndarray


def hessian(
    scene: Scene,
    metric: Metric,
    paths: str | Sequence[str],
    *,
    step: float = 0.02,
    rtol: float = 1e-12,
    solver: Solver | None = None,
) -> Hessian:
    """Second derivatives of a metric with respect to parameters of a scene, through
    every event of its run.

    `∂²M/∂p_i ∂p_j ≈ (g_j(p + h e_i) − g_j(p − h e_i))/2h` of the exact gradient `g`,
    for `h`, `h/2`, `h/4`, and extrapolated to `h → 0` (Richardson: the error is
    `O(h⁶)`).

    - `metric`: a metric's name or a function of a `Result` to a number
    - `paths`: as `wrt` of `sensitivity`
    - `step`: first `h`, as a share of each number;  `rtol`, `solver`: as for `simulate`

    Raises `InputError` for unknown paths and metrics, for a number that is 0, and where
    a run at `p ± h` has another sequence of events: the metric has no second derivative
    across that; `SimulationError` where the run fails. Source: Richardson, Phil. Trans.
    R. Soc. A 210 (1911).

    Example:
        >>> found = sb.studies.hessian(scene, "stopping_angle", "initial.omega")
        >>> found.matrix.shape
        (1, 1)
    """
    metrics = Metrics((metric,))
    check_metrics(scene, metrics.asked)
    chosen = chosen_leaves(scene, paths)
    place = Paths.of(chosen)
    x = numbers_of(chosen)
    names = tuple(name_of_entry(*entry) for entry in place.entries)
    issues = Issues(
        Fault(name, "is 0", "leave it out")
        for name, number in zip(names, x, strict=True)
        if number == 0
    )
    issues.unless(0 < step < 1, "step", step, "0 < step < 1")
    issues.report()
    run = PointEvaluator(
        scene, place, metrics, size=1, reverse=x.size > 1, rtol=rtol, solver=solver
    )
    base = run.result()
    check_happened(metrics, values_of(base, metrics))
    usual = modes_of(base)
    moves = np.diag(step * np.abs(x))
    for name, move in zip(names, moves, strict=True):
        for moved in (x - move, x + move):
            _, words = end_of_range(run, with_values(scene, place.values(moved)), usual)
            if words:
                what = f"{words} within a step of {step:g}"
                issues.add(name, what, "give a smaller step")
    issues.report()
    run.like(base)

    def gradient(at: np.ndarray) -> np.ndarray:
        slopes = run(at)
        if slopes.code != 0 or not np.all(np.isfinite(slopes.jacobian)):
            raise input_error(
                "step", "the metric has no derivative within it", "give a smaller step"
            )
        return slopes.jacobian[0]

    rows = []
    errors = []
    for move in moves:
        slopes = np.stack(
            [
                (gradient(x + share * move) - gradient(x - share * move))
                / (2 * share * np.sum(move))
                for share in _SHARES
            ]
        )
        for k in range(1, len(_SHARES)):
            coarser = slopes[0]
            slopes = slopes[1:] + np.diff(slopes, axis=0) / (4**k - 1)
        rows.append(slopes[0])
        errors.append(np.abs(slopes[0] - coarser))
    matrix = np.stack(rows)
    error = np.maximum(np.stack(errors), np.abs(matrix - matrix.T) / 2)
    value = float(values_of(base, metrics)[0])
    return Hessian(names, value, gradient(x), (matrix + matrix.T) / 2, error)
