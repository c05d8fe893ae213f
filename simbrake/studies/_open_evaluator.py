"""A scene as a function of arrays: for samplers, optimisers and reliability methods of
other libraries."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .._base._arguments import explained
from .._base._faults import Issues, input_error, shown
from ..parts.scene import Scene, require_scene
from ..runs.edit import entry_of, with_inputs
from ..runs.measure import MetricLike, as_metrics, check_metrics, unit_of
from ..runs.prepared import Prepared, prepare
from ..runs.simulate import Solver
from .bounds import Inputs, Paths, bounds_of, faults_of_runs
from .evaluating import Metrics, PointEvaluator, failure_name


@explained
class Evaluator:
    """A scene as a function of arrays; made by `evaluator`.

    - `names`: paths of the k numbers;  `units`: their SI units
    - `bounds` (k, 2): lowest and highest value
    - `start` (k,): the values in the scene, of a list their mean
    - `metrics`: names of the m values
    - `metric_units`: their SI units, empty for a function
    - `codes` (n,): of the runs of the last `evaluate`, 0 or a failure code as in
      `simbrake.results.FAILURES`
    - `messages`: for each of these runs which values it does not have, and why; empty
      where it has all

    Example:
        >>> run = sb.studies.evaluator(scene, {"initial.omega": (12.0, 24.0)}, ["stopping_time", "stopping_angle"])
        >>> run.units, run.bounds.tolist(), run.metric_units
        (('rad/s',), [[12.0, 24.0]], ('s', 'rad'))
        >>> run.evaluate([[18.0], [24.0]]).round(4)
        array([[ 0.9433,  8.4896],
               [ 1.2577, 15.0927]])
        >>> run.jacobian([24.0]).round(5)
        array([[0.05241],
               [1.25772]])
    """

    def __init__(
        self,
        prepared: Prepared,
        slopes: PointEvaluator,
        bounds: Mapping[str, np.ndarray],
        units: Sequence[str],
    ) -> None:
        self._prepared = prepared
        self._slopes = slopes
        self._places = [prepared.places[path] for path in bounds]
        self.names = tuple(bounds)
        self.units = tuple(units)
        self.bounds = np.stack([*bounds.values()])
        self.start = np.array(
            [np.mean(prepared.numbers[place]) for place in self._places]
        )
        self.metrics = prepared.metrics
        self.metric_units = tuple(map(unit_of, self.metrics))
        self.codes = np.zeros(0, np.int32)
        self.messages = list[str]()

    def __repr__(self) -> str:
        return f"Evaluator({', '.join(self.names)} → {', '.join(self.metrics)})"

    def evaluate(self, X: Any) -> np.ndarray:
        """Metrics (n, m) of the runs with the numbers `X` (n, k), or (m,) of one run
        with (k,); SI units.

        NaN where a run fails, or does not have the metric: `codes` and `messages` say
        why. `bounds` are for others to read: numbers outside are evaluated, unless they
        are impossible.

        Raises `InputError` for another shape, and with all numbers that are impossible,
        with their runs.
        """
        answers = [self._prepared(point) for point in self._points(X)]
        values = np.array([[*answer.metrics.values()] for answer in answers])
        values = values.reshape(-1, len(self.metrics))
        self.codes = np.array([answer.code for answer in answers], np.int32)
        values[~np.isfinite(values) | (self.codes != 0)[:, None]] = np.nan
        self.messages = [
            failure_name(code) if code else self._missing(row)
            for code, row in zip(self.codes.tolist(), values, strict=True)
        ]
        return values.reshape(*np.shape(X)[:-1], len(self.metrics))

    def jacobian(self, X: Any) -> np.ndarray:
        """Derivatives (m, k) of the metrics by the numbers at `X` (k,), (n, m, k) at
        (n, k), through all events.

        As many passes as there are metrics or numbers, whichever are fewer. NaN and
        errors as for `evaluate`, which finds the codes. The first call compiles.
        """
        self._points(X)
        if not self._slopes.runs and len(self._slopes.limits) > 1:
            # (a derivative replays the run: its length is known)
            self._slopes.like(self._slopes.result(throw=False))
        slopes = [
            self._slopes(x).jacobian for x in np.atleast_2d(np.asarray(X, np.float64))
        ]
        return np.array(slopes).reshape(
            *np.shape(X)[:-1], len(self.metrics), len(self.names)
        )

    def _points(self, X: Any) -> np.ndarray:
        """All numbers of the scene for each run."""
        try:
            x = np.asarray(X, np.float64)
        except (TypeError, ValueError):
            what = f"{shown(X)} is no array of numbers"
            raise input_error("X", what, "numbers in SI") from None
        k = len(self.names)
        if x.ndim not in (1, 2) or x.shape[-1] != k:
            hint = f"({k},), or (runs, {k}): {', '.join(self.names)}"
            raise input_error("X", f"has the shape {x.shape}", hint)
        rows = np.atleast_2d(x)
        points = np.tile(self._prepared.numbers, (len(rows), 1))
        for place, column in zip(self._places, rows.T, strict=True):
            points[:, place] = column[:, None]
        scenes = map(self._prepared.scene_with, points)
        Issues(faults_of_runs(enumerate(scenes))).report()
        return points

    def _missing(self, values: np.ndarray) -> str:
        lost = ", ".join(np.asarray(self.metrics)[np.isnan(values)])
        return f"no {lost}" if lost else ""


_NUMBER = (
    "give a function that is a number in the scene, or infinite where something never "
    "happens"
)


def evaluator(
    scene: Scene,
    parameters: str | Sequence[str] | Mapping[str, Any],
    metrics: MetricLike | Sequence[MetricLike] = "stopping_time",
    *,
    rtol: float = 1e-10,
    solver: Solver | None = None,
    max_steps: int | None = None,
) -> Evaluator:
    """Opens a scene to other libraries, as a function of arrays: `evaluate(X)` and
    `jacobian(X)`.

    - `parameters`: paths, as in `with_values`, one number each (of a list: one for all
      its entries), with the bounds that physics sets; or `{path: (low, high)}`, in SI
      or texts with units
    - `metrics`: names, energies as `energy.…`, or functions of a `Result` to a number
    - `rtol`, `solver`, `max_steps`: as for `prepare`

    New numbers never compile again, save where a run needs more steps than any before;
    functions of your own are traced anew by each call of `evaluator`. Runs follow one
    another; for very many `ensemble` uses all cores, accelerators or a cluster.

    Raises `InputError` with all errors, and `SimulationError` where the scene's own run
    fails.

    Example:
        >>> run = sb.studies.evaluator(scene, {"duty.load.mass": ("15 t", "25 t")}, ["stopping_time", "hook_travel"])
        >>> run.evaluate(run.bounds.mean(axis=1)).round(4)
        array([1.2577, 0.7546])
    """
    require_scene(scene)
    known = Inputs(scene)
    issues = Issues()
    asked = as_metrics(metrics)
    paths = [parameters] if isinstance(parameters, str) else list(parameters)
    if not paths:
        issues.add(
            "parameters",
            "is empty",
            "as {'brake.linings.friction.coefficient': (0.3, 0.4)}",
        )
    leaves = {path: known.get(entry_of(path)[0]) for path in paths}
    # (of what is not there a value that also a count of linings may have)
    count = float(scene.brake.linings.count)
    present = {
        path: count if leaf is None else float(np.mean(leaf.value))
        for path, leaf in leaves.items()
    }
    if issues.attempt(with_inputs, scene, present) is not None:
        hint = "put one there by with_values first; a count of linings changes the structure"
        for path, leaf in leaves.items():
            if leaf is None:
                issues.add(path, "cannot vary: the scene has no number there", hint)
    issues += known.twice(paths)
    issues.attempt(check_metrics, scene, asked)
    issues.report()
    bounds = dict[str, np.ndarray]()
    units = []
    for path in paths:
        about = known.about(path)
        units.append(about.unit)
        if isinstance(parameters, Mapping):
            ends = bounds_of(scene, path, parameters[path], issues, about)
        else:
            ends = np.array(
                [
                    -np.inf if about.low is None else about.low,
                    np.inf if about.high is None else about.high,
                ]
            )
        bounds[path] = np.zeros(2) if ends is None else ends
    issues.report()
    settings: dict[str, Any] = {"solver": solver, "rtol": rtol, "max_steps": max_steps}
    slopes = PointEvaluator(
        scene,
        Paths.each(paths),
        Metrics(tuple(asked)),
        size=len(asked),
        reverse=len(paths) > len(asked),
        singly=True,
        **settings,
    )
    prepared = prepare(scene, asked, **settings)
    for name, value in prepared().metrics.items():
        if np.ndim(value):
            hint = "give a function of the result to one number"
            issues.add(name, "is an array", hint)
        elif np.isnan(value):
            issues.add(name, "is not a number in the scene", _NUMBER)
    issues.report()
    return Evaluator(prepared, slopes, bounds, units)
