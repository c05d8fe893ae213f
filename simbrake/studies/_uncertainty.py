"""Distributions on numbers of a scene in, quantiles and failure probabilities of its results out."""

import dataclasses
import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from .._base._faults import Fault, InputError
from .._base._table import Column, Table, Tabular, plain
from .._parts._scene import Scene
from .._run._log import FAILURES
from .._run._measure import Metric, check_metrics, name_of, unit_of
from ._ensemble import ensemble
from ._sampling import Distribution, Draws, Method, attempt, complete, faults_of_sampling, power_of_two, unit_points

#: hits (and misses) on average in a group that Student's t needs; below, the exact binomial interval is taken
_ENOUGH = 2


class Estimate(NamedTuple):
    """A value and its confidence interval; `nan` what cannot be told, an infinite end what is not bounded."""

    value: float
    low: float
    high: float

    def as_dict(self) -> dict[str, float | None]:
        return plain(self)


UNKNOWN = Estimate(np.nan, np.nan, np.nan)


def mean_and_deviation(values: np.ndarray, group: np.ndarray, confidence: float) -> tuple[Estimate, Estimate]:
    """Mean and standard deviation of `values` (n,) by the jackknife over groups, the deviation in its logarithm.

    For groups of equal size the mean's interval is the mean of the groups' means ± t_{R−1} s/√R.
    """
    if len(values) == 0:
        return UNKNOWN, UNKNOWN
    centre = float(np.mean(values))
    away = values - centre
    _, label = np.unique(group, return_inverse=True)
    count, first, second = (np.bincount(label, weights) for weights in (np.ones_like(away), away, away**2))
    with np.errstate(invalid="ignore", divide="ignore"):
        mean, deviation = _moments(count.sum(), first.sum(), second.sum())
        means, deviations = _moments(*(x.sum() - x for x in (count, first, second)))
        mean_half = _jackknife(mean, means, confidence)
        factor = np.exp(_jackknife(np.log(deviation), np.log(deviations), confidence))
    mean = centre + mean
    if deviation == 0.0:
        return Estimate(mean, mean, mean), Estimate(0.0, 0.0, 0.0)
    return (
        Estimate(mean, mean - mean_half, mean + mean_half),
        Estimate(deviation, deviation / factor, deviation * factor),
    )


def _moments(n: Any, first: Any, second: Any) -> Any:
    variance = np.maximum(second - first**2 / n, 0.0) / np.where(n > 1, n - 1, np.nan)
    return first / n, np.sqrt(variance)


def _jackknife(whole: Any, without: np.ndarray, confidence: float) -> float:
    """Half width of the interval of an estimate, from its values without each of the groups."""
    from scipy.stats import t

    R = len(without)
    if R < 2:
        return np.nan
    pseudo = R * whole - (R - 1) * without
    return float(t.ppf(0.5 + confidence / 2, R - 1) * np.std(pseudo, ddof=1) / np.sqrt(R))


def probability(hit: np.ndarray, group: np.ndarray, confidence: float) -> Estimate:
    """Share of runs that `hit` (n,), with its interval.

    Groups of one: Clopper–Pearson. Else Student's t over groups; where fewer than two hits or misses come to a group,
    Clopper–Pearson as if all runs were independent, since a scatter among so few tells nothing. Points that are spread
    evenly scatter less than that.
    """
    if len(hit) == 0:
        return UNKNOWN
    _, label = np.unique(group, return_inverse=True)
    sizes = np.bincount(label)
    low, high = share_interval(np.bincount(label, hit)[None], sizes, confidence)
    return Estimate(float(np.mean(hit)), float(low[0]), float(high[0]))


def share_interval(counts: np.ndarray, sizes: np.ndarray, confidence: float) -> tuple[np.ndarray, np.ndarray]:
    """Intervals (m,) of a share, from `counts` (m, R) of hits in groups of `sizes` (R,)."""
    from scipy.stats import beta, t

    n, k, R = sizes.sum(), counts.sum(axis=1), len(sizes)
    tail = (1 - confidence) / 2
    low = np.where(k > 0, beta.ppf(tail, np.maximum(k, 1), n - k + 1), 0.0)
    high = np.where(k < n, beta.ppf(1 - tail, k + 1, np.maximum(n - k, 1)), 1.0)
    if R < 2 or sizes.max() == 1:
        return low, high
    share = k / n
    rest = counts - share[:, None] * sizes
    half = t.ppf(1 - tail, R - 1) * np.sqrt(R / (R - 1) * np.sum(rest**2, axis=1)) / n
    enough = np.minimum(k, n - k) >= _ENOUGH * R
    return (
        np.where(enough, np.maximum(share - half, 0.0), low),
        np.where(enough, np.minimum(share + half, 1.0), high),
    )


def quantile(values: np.ndarray, group: np.ndarray, p: float, confidence: float) -> Estimate:
    """Quantile `p` of `values` (n,), with the interval of all x whose share of values below has `p` in its interval.

    For runs drawn at random that is the exact interval of order statistics. An end is infinite where the values do not
    bound it: 20 runs say nothing of how far the upper 1 % reach.
    """
    n = len(values)
    if n == 0:
        return UNKNOWN
    _, label = np.unique(group, return_inverse=True)
    order = np.argsort(values, kind="stable")
    sizes = np.bincount(label)
    if sizes.max() == 1:  # only the totals matter
        below, sizes = np.arange(n + 1)[:, None], np.array([n])
    else:
        below = np.zeros((n + 1, len(sizes)), dtype=np.int64)
        below[np.arange(1, n + 1), label[order]] = 1
        np.cumsum(below, axis=0, out=below)
    low, high = share_interval(below, sizes, confidence)
    level = np.flatnonzero((low <= p) & (p <= high))
    ends = np.concatenate([[-np.inf], values[order], [np.inf]])
    middle = float(np.quantile(values, p, method="median_unbiased"))
    return Estimate(middle, float(ends[level[0]]), float(ends[level[-1] + 1]))


_HOT = "peak_lining_temperature"


@dataclasses.dataclass(frozen=True)
class Statistics:
    """A metric over the runs that have it: `count` of them, mean, standard deviation, quantiles, extremes, SI units."""

    unit: str
    count: int
    mean: Estimate
    deviation: Estimate
    quantiles: dict[float, Estimate]
    least: float
    greatest: float


@dataclasses.dataclass(frozen=True)
class Failure:
    """Something that must not happen: in how many runs it did, and its probability."""

    count: int
    probability: Estimate


@dataclasses.dataclass(frozen=True)
class Uncertainty(Tabular):
    """What `uncertainty` found; `data` holds every run: numbers that were drawn, metrics, codes.

    - `statistics`: by metric;  `failures`: by what must not happen;  `codes`: runs that failed, by name
    - `limits`: metric → its maximum permissible value (n,) or one number;  `inputs`: path → (unit, 5 %, median, 95 %)
    """

    data: Any
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
        """Everything but the runs, for JSON: `None` where a number does not exist or has no bound."""
        metrics = {
            name: {
                "unit": s.unit,
                "runs": s.count,
                "mean": s.mean,
                "standard_deviation": s.deviation,
                "quantiles": {f"{p:g}": e for p, e in s.quantiles.items()},
                "least": s.least,
                "greatest": s.greatest,
            }
            for name, s in self.statistics.items()
        }
        inputs = {
            path: {"unit": unit, "quantiles": {"0.05": low, "0.5": middle, "0.95": high}}
            for path, (unit, low, middle, high) in self.inputs.items()
        }
        failures = {name: {"runs": f.count, "probability": f.probability} for name, f in self.failures.items()}
        about = {name: getattr(self, name) for name in ("runs", "method", "groups", "seed", "confidence")}
        return plain(about | {"inputs": inputs, "metrics": metrics, "failures": failures, "failed_runs": self.codes})

    def json(self) -> str:
        return json.dumps(self.as_dict(), indent=2, allow_nan=False)

    def parts(self) -> Iterator[str | Table]:
        points = {"sobol": "scrambled Sobol points", "latin": "Latin hypercube points", "random": "random points"}
        how = f"{self.runs} {points[self.method]}"
        if self.method != "random":
            how += f", {self.groups} independent sets of {self.runs // self.groups}"
        yield f"{how}; seed {self.seed}; intervals of {100 * self.confidence:g} %"
        yield ""
        shares = [Column(share, show=".5g") for share in ("5 %", "median", "95 %")]
        rows = [(path, *numbers, "" if unit == "1" else unit) for path, (unit, *numbers) in self.inputs.items()]
        yield Table([Column("path", heading="drawn", left=True), *shares, "unit"], rows)
        for name, s in self.statistics.items():
            yield ""
            yield f"{name}{', ' + s.unit if s.unit else ''}: {self._share(s.count)}"
            if s.count:
                columns = [Column("statistic", heading="", left=True), *(Column(x) for x in ("value", "from", "to"))]
                found = {"mean": s.mean, "standard deviation": s.deviation}
                found |= {f"{100 * p:g} %": e for p, e in s.quantiles.items()}
                rows = [(what, *estimate) for what, estimate in found.items()]
                yield Table(columns, [*rows, ("extremes of the runs", None, s.least, s.greatest)])
        if self.failures:
            yield ""
            columns = [Column("failure", left=True), *(Column(x, show=".4g") for x in ("probability", "from", "to"))]
            rows = [(name, *f.probability, f"{f.count} of {self.runs} runs") for name, f in self.failures.items()]
            yield Table([*columns, Column("runs", heading="", left=True)], rows)
        if self.codes:
            each = ", ".join(f"{name} {count}" for name, count in self.codes.items())
            yield ""
            yield f"{sum(self.codes.values())} runs failed ({each}): they count as failures, and have no metrics"

    def _share(self, count: int) -> str:
        if count == self.runs:
            return f"of all {count} runs"
        rest = "the rest has none" if count else "there is nothing to say"
        return f"of the {count} of {self.runs} runs ({count / self.runs:.2%}) that have it; {rest}"


def uncertainty(
    scene: Scene,
    distributions: Mapping[str, Distribution],
    metrics: Metric | Sequence[Metric] = ("stopping_time",),
    n: int = 1024,
    *,
    limits: Mapping[str, Any] | None = None,
    quantiles: Sequence[float] = (0.05, 0.5, 0.95),
    confidence: float = 0.95,
    replicates: int = 16,
    seed: int = 0,
    method: Method = "sobol",
    **options: Any,
) -> Uncertainty:
    """How uncertain results are where numbers of a scene are: every number with its confidence interval.

    - `distributions`: as `samples` takes them, independent of each other
    - `metrics`: names, or functions of a result; `n`: least number of runs
    - `limits`: maximum permissible value of metrics (SI). The scene's permissible temperature of the linings counts
      without being named (another number replaces it, `None` takes it away)
    - `method`, `replicates`: `"sobol"` takes that many independently scrambled sets of Sobol points, each of a power of
      two, `"latin"` as many Latin hypercubes; intervals are Student's t over these sets. `"random"` takes independent
      points; intervals of shares and quantiles are then exact (Clopper–Pearson, order statistics)
    - `options` go to `ensemble`: client, directory, workers, chunk, rtol, solver

    Failures: the run `does not stop` (asked where `stopping_time` is among the metrics), a metric exceeds its limit,
    any of these. A run that failed by its code counts as each of them, as nobody knows how it would have gone on.
    Statistics are of the runs that have the metric, and say how many these are.

    Raises `InputError` with all errors at once, and `SimulationError` (with the runs made) if it was interrupted.
    """
    asked = [metrics] if isinstance(metrics, str) or callable(metrics) else list(metrics)
    found = faults_of_sampling(n, method) + _faults_of_statistics(quantiles, confidence, replicates)
    bounds, hidden = _limits(scene, limits, asked)
    draws = attempt(found, Draws, scene, distributions)
    attempt(found, check_metrics, scene, [*asked, *hidden])
    found += [
        Fault(f"limits[{name!r}]", f"{value!r} is not a number", "the maximum permissible value in SI units")
        for name, value in bounds.items()
        if not isinstance(value, int | float | np.floating) or np.isnan(value)
    ]
    if found or draws is None:
        raise InputError(found)
    unit, group = _points(n, len(draws.paths), method, replicates, seed)
    values = draws.values(unit)
    data = complete(ensemble(scene, values, [*asked, *hidden], **options))
    if "heat.permissible" in values and _HOT not in (limits or {}):
        bounds[_HOT] = values["heat.permissible"]
    return _evaluate(data, group, asked, bounds, tuple(quantiles), confidence, method, seed, _inputs(draws))


def _points(n: int, d: int, method: str, replicates: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, d) of the unit cube and the independent group of each (n,)."""
    if method == "random":
        return unit_points(n, d, method, np.random.default_rng(seed)), np.arange(n)
    each = -(-n // replicates)
    each = 2 ** power_of_two(each) if method == "sobol" else each
    children = np.random.SeedSequence(seed).spawn(replicates)
    sets = [unit_points(each, d, method, np.random.default_rng(child)) for child in children]
    return np.concatenate(sets), np.repeat(np.arange(replicates), each)


def _inputs(draws: Draws) -> dict[str, tuple[str, float, float, float]]:
    return {
        path: (draws.units[path], *(float(draws.quantiles[path](p)) for p in (0.05, 0.5, 0.95)))  # pyright: ignore
        for path in draws.paths
    }


def _permissible(scene: Scene) -> float | None:
    heat = scene.network
    known = heat.permissible is not None and "linings" in heat.hot_places
    return float(np.asarray(heat.permissible)) if known else None


def _limits(scene: Scene, given: Mapping[str, Any] | None, asked: list[Metric]) -> tuple[dict[str, Any], list[Metric]]:
    """Limits by metric, and the metrics that only they ask for."""
    bounds = {name: value for name, value in (given or {}).items() if value is not None}
    own = _permissible(scene)
    if own is not None and _HOT not in (given or {}):
        bounds[_HOT] = own
    names = [name_of(one) for one in asked]
    return bounds, [name for name in bounds if name not in names]


def _faults_of_statistics(quantiles: Sequence[float], confidence: float, replicates: int) -> list[Fault]:
    found = [Fault("quantiles", f"{p!r} is not a share", "between 0 and 1") for p in quantiles if not 0 < p < 1]
    if not 0 < confidence < 1:
        found.append(Fault("confidence", f"{confidence!r} is not a share", "between 0 and 1, as 0.95"))
    if not isinstance(replicates, int | np.integer) or replicates < 2:
        found.append(Fault("replicates", f"{replicates!r} sets have no scatter", "at least 2; 8 to 32 are usual"))
    return found


def _evaluate(
    data: Any,
    group: np.ndarray,
    asked: list[Metric],
    bounds: dict[str, Any],
    shares: tuple[float, ...],
    confidence: float,
    method: str,
    seed: int,
    inputs: dict[str, Any],
) -> Uncertainty:
    """Statistics and failures of runs that were made."""
    code = np.asarray(data["code"])
    failed = code != 0
    statistics, failures = {}, {}
    for one in asked:
        name = name_of(one)
        x = np.asarray(data[name], np.float64)
        here = np.isfinite(x) & ~failed
        x, g = x[here], group[here]
        mean, deviation = mean_and_deviation(x, g, confidence)
        at = {float(p): quantile(x, g, p, confidence) for p in shares}
        extremes = (float(x.min()), float(x.max())) if len(x) else (np.nan, np.nan)
        statistics[name] = Statistics(unit_of(one), len(x), mean, deviation, at, *extremes)
    if "stopping_time" in statistics:
        failures["does not stop"] = ~np.isfinite(np.asarray(data["stopping_time"])) | failed
    for name, limit in bounds.items():
        shown = f"{limit:g} {unit_of(name)}".rstrip() if np.ndim(limit) == 0 else "its drawn limit"
        failures[f"{name} > {shown}"] = (np.asarray(data[name]) > limit) | np.isnan(np.asarray(data[name])) | failed
    if len(failures) > 1:
        failures["any of these"] = np.any(list(failures.values()), axis=0)
    counts = {int(c): int(np.sum(code == c)) for c in np.unique(code[failed])}
    return Uncertainty(
        data=data.assign_coords(group=("run", group)),
        statistics=statistics,
        failures={name: Failure(int(hit.sum()), probability(hit, group, confidence)) for name, hit in failures.items()},
        codes={failure_name(c): count for c, count in counts.items()},
        inputs=inputs,
        limits=bounds,
        runs=len(group),
        groups=len(np.unique(group)),
        method=method,
        seed=seed,
        confidence=confidence,
    )


def failure_name(code: int) -> str:
    """A result code in a word."""
    return FAILURES[code][0] if code in FAILURES else f"code {code}"  # pyright: ignore
