"""Uncertainty propagation: from distributions of parameters to quantiles and failure
probabilities of results."""

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from .._base._faults import Fault, Issues
from .._base._numbers import pretty
from .._base._table import Column, Table, Tabular, frozen, plain
from ..outputs.judgement import REASONS
from ..outputs.log import SimulationError
from ..outputs.metrics import is_least
from ..parts.scene import Scene, require_scene
from ..runs.measure import MetricLike, as_metrics, name_of, unit_of
from ._draws import METHODS, Distribution, Method, checked, power_of_two, unit_points
from ._ensemble import Dataset, ensemble
from ._estimates import Estimate, mean_and_deviation, probability, quantile
from .evaluating import failure_name
from .limits import kept

_HOT = "peak_lining_temperature"
#: the criterion of runs that fail by any of the others
ANY = "any of these"


@frozen
class Statistics:
    """A metric over the runs that have it: `count` of them, mean, standard deviation,
    quantiles, extremes, SI units."""

    unit: str
    count: int
    mean: Estimate
    deviation: Estimate
    quantiles: dict[float, Estimate]
    least: float
    greatest: float


@frozen
class Failure:
    """A failure criterion: number of runs that meet it, and its probability."""

    count: int
    probability: Estimate


@frozen
class Uncertainty(Tabular):
    """Result of `uncertainty`; `data` holds every run: sampled parameters, metrics,
    codes.

    - `statistics`: by metric
    - `failures`: by failure criterion
    - `codes`: runs that failed, by name
    - `limits`: metric → its permissible value (n,) or one number
    - `inputs`: path → (unit, 5 %, median, 95 %)
    """

    data: Dataset
    statistics: dict[str, Statistics]
    failures: dict[str, Failure]
    codes: dict[str, int]
    inputs: dict[str, tuple[str, float, float, float]]
    limits: dict[str, Any]
    runs: int
    groups: int
    method: str
    seed: int
    confidence: float

    def as_dict(self) -> dict[str, Any]:
        """Return the data without the runs for JSON: `None` where a number does not
        exist or has no bound."""
        metrics = {
            name: {
                "unit": s.unit,
                "runs": s.count,
                "mean": s.mean,
                "standard_deviation": s.deviation,
            }
            | {
                "quantiles": {f"{p:g}": e for p, e in s.quantiles.items()},
                "least": s.least,
                "greatest": s.greatest,
            }
            for name, s in self.statistics.items()
        }
        inputs = {
            path: {
                "unit": unit,
                "quantiles": {"0.05": low, "0.5": middle, "0.95": high},
            }
            for path, (unit, low, middle, high) in self.inputs.items()
        }
        failures = {
            name: {"runs": f.count, "probability": f.probability}
            for name, f in self.failures.items()
        }
        about = {
            name: getattr(self, name)
            for name in ("runs", "method", "groups", "seed", "confidence")
        }
        return plain(
            about
            | {
                "inputs": inputs,
                "metrics": metrics,
                "failures": failures,
                "failed_runs": self.codes,
            }
        )

    def json(self) -> str:
        return json.dumps(self.as_dict(), indent=2, allow_nan=False)

    def parts(self) -> Iterator[str | Table]:
        how = f"{self.runs} {METHODS[self.method]}"
        if self.method != "random":
            how += f", {self.groups} independent sets of {self.runs // self.groups}"
        yield f"{how}; seed {self.seed}; intervals of {100 * self.confidence:g} %"
        yield ""
        shares = [Column(share, show=".5g") for share in ("5 %", "median", "95 %")]
        rows = [
            (path, *numbers, "" if unit == "1" else unit)
            for path, (unit, *numbers) in self.inputs.items()
        ]
        yield Table([("path", "drawn"), *shares, "unit"], rows)
        for name, s in self.statistics.items():
            yield ""
            title = ", ".join(filter(None, (name, pretty(s.unit))))
            yield f"{title}: {self._share(s.count)}"
            if s.count:
                columns = [
                    ("statistic", ""),
                    *(Column(x) for x in ("value", "from", "to")),
                ]
                estimates = {"mean": s.mean, "standard deviation": s.deviation}
                estimates |= {f"{100 * p:g} %": e for p, e in s.quantiles.items()}
                rows = [(what, *estimate) for what, estimate in estimates.items()]
                yield Table(
                    columns,
                    [*rows, ("extremes of the runs", None, s.least, s.greatest)],
                )
        if self.failures:
            yield ""
            columns = [
                "failure",
                *(Column(x, show=".4g") for x in ("probability", "from", "to")),
            ]
            rows = [
                (name, *f.probability, f"{f.count} of {self.runs} runs")
                for name, f in self.failures.items()
            ]
            yield Table([*columns, ("runs", "")], rows)
        if self.codes:
            each = ", ".join(f"{name} {count}" for name, count in self.codes.items())
            yield ""
            yield (
                f"{sum(self.codes.values())} runs failed ({each}): they count as "
                "failures, and have no metrics"
            )

    def _share(self, count: int) -> str:
        if count == self.runs:
            return f"of all {count} runs"
        rest = "the rest has none" if count else "no statistics"
        return f"of the {count} of {self.runs} runs ({count / self.runs:.2%}) that have it; {rest}"


def uncertainty(
    scene: Scene,
    distributions: Mapping[str, Distribution],
    metrics: MetricLike | Sequence[MetricLike] = ("stopping_time",),
    n: int = 1024,
    *,
    limits: Mapping[str, object] | None = None,
    quantiles: Sequence[float] = (0.05, 0.5, 0.95),
    confidence: float = 0.95,
    replicates: int = 16,
    seed: int = 0,
    method: Method = "sobol",
    **options: Any,
) -> Uncertainty:
    """Uncertainty of results from uncertain parameters of a scene, with confidence
    intervals.

    - `distributions`: as for `samples`, independent of each other
    - `metrics`: names, or functions of a result; `n`: minimum number of runs
    - `limits`: permissible value of metrics (SI), the greatest, or the least of a
      metric that begins with `min_`. The scene's permissible
      temperature of the linings applies by default (another number replaces it, `None`
      takes it away)
    - `method`, `replicates`: `"sobol"` takes that many independently scrambled sets of
      Sobol points, each of a power of two, `"latin"` as many Latin hypercubes;
      intervals are Student's t over these sets. `"random"` takes independent points;
      intervals of shares and quantiles are then exact (Clopper–Pearson, order
      statistics)
    - `options` go to `ensemble`: client, directory, workers, chunk, rtol, solver

    Failures: the run `does not stop` (if `stopping_time` is among the metrics), a
    metric exceeds its limit, any of these. A run that failed by its code counts as each
    of them, as its further course is unknown. Statistics are of the runs that have the
    metric, with their number.

    Raises `InputError` with all errors, and `SimulationError` (with the runs made) if
    it was interrupted.
    """
    asked = as_metrics(metrics)
    issues = Issues()
    bounds, hidden = _limits(scene, limits, asked)
    for p in quantiles:
        issues.share("quantiles", p, 0.95)
    issues.share("confidence", confidence, 0.95)
    if not isinstance(replicates, int | np.integer) or replicates < 2:
        issues.add(
            "replicates",
            f"{replicates!r} sets have no scatter",
            "at least 2; 8 to 32 are usual",
        )
    issues += [
        Fault(
            f"limits[{name!r}]",
            f"{value!r} is not a number",
            "the permissible value in SI units",
        )
        for name, value in bounds.items()
        if not isinstance(value, int | float | np.floating) or np.isnan(value)
    ]
    draws = checked(issues, scene, distributions, n, method, [*asked, *hidden])
    unit, group = _points(n, len(draws.paths), method, replicates, seed)
    values = draws.values(unit)
    data = ensemble(scene, values, [*asked, *hidden], **options)
    if missing := int(np.sum(data["code"].values < 0)):
        # (those made first are the expensive ones)
        message = (
            f"interrupted: {missing} of {data.sizes['run']} runs were not made, "
            "and the rest is a biased sample. "
        )
        raise SimulationError(
            f"{message}With directory=… the same call continues the interrupted one",
            data,
        )
    if "heat.permissible" in values and _HOT not in (limits or {}):
        bounds[_HOT] = values["heat.permissible"]
    shares = np.full((len(draws.paths), 3), (0.05, 0.5, 0.95)).T
    inputs: dict[str, Any] = {
        path: (draws.about[path].unit, *numbers.tolist())
        for path, numbers in draws.values(shares).items()
    }
    statistics, failures = _evaluate(data, group, asked, bounds, quantiles, confidence)
    code = data["code"].values
    codes, counts = np.unique(code[code != 0], return_counts=True)
    return Uncertainty(
        data=data.assign_coords(group=("run", group)),
        statistics=statistics,
        failures=failures,
        codes=dict(
            zip(map(failure_name, codes.tolist()), counts.tolist(), strict=True)
        ),
        inputs=inputs,
        limits=dict(bounds),
        runs=len(group),
        groups=len(np.unique(group)),
        method=method,
        seed=seed,
        confidence=confidence,
    )


def _points(
    n: int, d: int, method: str, replicates: int, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, d) of the unit cube and the independent group of each (n,)."""
    if method == "random":
        return unit_points(n, d, method, np.random.default_rng(seed)), np.arange(n)
    each = -(-n // replicates)
    each = 2 ** power_of_two(each) if method == "sobol" else each
    children = np.random.SeedSequence(seed).spawn(replicates)
    sets = [
        unit_points(each, d, method, np.random.default_rng(child)) for child in children
    ]
    return np.concatenate(sets), np.repeat(np.arange(replicates), each)


def _limits(
    scene: Scene, limits: Mapping[str, object] | None, asked: list[MetricLike]
) -> tuple[dict[str, Any], list[MetricLike]]:
    """Limits by metric, and the metrics needed only for limits."""
    require_scene(scene)
    bounds = {
        name: value for name, value in (limits or {}).items() if value is not None
    }
    heat = scene.network
    if (
        heat.permissible is not None
        and "linings" in heat.hot_places
        and _HOT not in (limits or {})
    ):
        bounds[_HOT] = float(heat.permissible)
    names = [name_of(metric) for metric in asked]
    return bounds, [name for name in bounds if name not in names]


def _evaluate(
    data: Dataset,
    group: np.ndarray,
    asked: Sequence[MetricLike],
    bounds: Mapping[str, float | np.ndarray],
    shares: Sequence[float],
    confidence: float,
) -> tuple[dict[str, Statistics], dict[str, Failure]]:
    """Statistics and failures of runs that were made."""
    failed = data["code"].values != 0
    statistics = {}
    failures = {}
    for metric in asked:
        name = name_of(metric)
        x = data[name].values.astype(float)
        here = np.isfinite(x) & ~failed
        x = x[here]
        g = group[here]
        mean, deviation = mean_and_deviation(x, g, confidence)
        at = {float(p): quantile(x, g, p, confidence) for p in shares}
        extremes = (float(x.min()), float(x.max())) if len(x) else (np.nan, np.nan)
        statistics[name] = Statistics(
            unit_of(metric), len(x), mean, deviation, at, *extremes
        )
    if "stopping_time" in statistics:
        # (a load that stopped once, and moves at the end, is not stopped)
        goes_on = np.isin(
            data["reason"].values, [reason.id for reason in REASONS if reason.goes_on]
        )
        # (a load that is held from the start has no stopping time)
        held = data["status"].values == "held"
        rests = held | np.isfinite(data["stopping_time"].values)
        failures["does not stop"] = ~rests | goes_on | failed
    for name, limit in bounds.items():
        shown = (
            f"{limit:g} {pretty(unit_of(name))}".rstrip()
            if np.ndim(limit) == 0
            else "its sampled limit"
        )
        within = kept(data, name, limit).values
        failures[f"{name} {'<' if is_least(name) else '>'} {shown}"] = ~within | failed
    if len(failures) > 1:
        failures[ANY] = np.any(list(failures.values()), axis=0)
    return statistics, {
        name: Failure(int(hit.sum()), probability(hit, group, confidence))
        for name, hit in failures.items()
    }
