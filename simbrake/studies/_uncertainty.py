"""Uncertainty propagation: from distributions of parameters to quantiles and failure
probabilities of results.

Samples are quasi-random, Latin hypercubes or random; every estimate has its confidence
interval.
"""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np

from .._base._faults import Fault, Issues
from .._base._quantity import Quantity, unit_suffix
from .._base._table import Column, Table, Tabular, frozen, plain
from ..outputs.judgement import REASONS
from ..outputs.log import SimulationError
from ..parts.scene import Scene, faults, require_scene
from ..runs.edit import Inputs, with_inputs, with_values
from ..runs.measure import Metric, check_metrics, name_of, unit_of
from ._ensemble import Dataset, ensemble
from .evaluating import Columns, as_metrics, bounds_of, failure_name

#: a frozen distribution of scipy.stats (anything with `ppf` or `icdf`), or (low, high)
#: for a uniform one
Distribution: TypeAlias = Any
#: a quantile function: from shares to numbers
Quantile: TypeAlias = Callable[[Any], Any]
Method = Literal["sobol", "latin", "random"]
#: names of the points of a method
METHODS = {
    "sobol": "scrambled Sobol points",
    "latin": "Latin hypercube points",
    "random": "random points",
}

#: half a step of SciPy's Sobol points: a quantile function is never evaluated at 0 or
#: 1, where a tail is infinite
_EDGE = 2.0**-31
#: hits (and misses) on average in a group that Student's t needs; below, the exact
#: binomial interval is taken
_ENOUGH = 2
_HOT = "peak_lining_temperature"
#: the criterion of runs that fail by any of the others
ANY = "any of these"


# --- samples ------------------------------------------------------------------------


class Draws:
    """Checked distributions of a scene: map points of the unit cube to its parameters.

    Raises `InputError` with all errors: unknown paths, paths that overlap, values that
    are no distribution, and distributions that leave the range of their parameter.
    """

    def __init__(self, scene: Scene, distributions: Mapping[str, Distribution]) -> None:
        issues = Issues()
        if not distributions:
            issues.add(
                "distributions",
                "is empty",
                "as in {'brake.linings.friction.coefficient': …}",
            )
        frozen = {
            path: _frozen(scene, path, distribution, issues)
            for path, distribution in distributions.items()
        }
        frozen = {path: law for path, law in frozen.items() if law is not None}
        self.quantiles = {path: _quantile_of(law) for path, law in frozen.items()}
        medians = {path: float(draw(0.5)) for path, draw in self.quantiles.items()}
        issues.attempt(with_inputs, scene, dict.fromkeys(distributions, 0.0) | medians)
        for path, old in Inputs(scene).twice(distributions).items():
            issues.add(
                path, f"overlaps with {old}", "give each parameter one distribution"
            )
        bad = {fault.path for fault in issues}
        middle = with_values(
            scene, {path: medians[path] for path in medians.keys() - bad}
        )
        inputs = Inputs(middle)
        self.about = {path: inputs.about(path) for path in medians if path not in bad}
        for path, about in self.about.items():
            issues += _faults_of_range(path, frozen[path], about)
        if not issues:
            issues += [
                Fault(f.path, f"{f.problem}, at the medians", f.hint)
                for f in faults(middle)
            ]
        issues.report()

    @property
    def paths(self) -> list[str]:
        return list(self.quantiles)

    def values(self, unit: np.ndarray) -> Columns:
        """Parameters of the scene (n,) by path, from points (n, d) of the unit cube."""
        inside = np.clip(unit, _EDGE, 1.0 - _EDGE)
        columns = zip(self.quantiles.items(), inside.T, strict=True)
        return {
            path: np.asarray(quantile(u), np.float64) for (path, quantile), u in columns
        }


def samples(
    scene: Scene,
    distributions: Mapping[str, Distribution],
    n: int,
    seed: int = 0,
    method: Method = "sobol",
) -> Columns:
    """`n` samples of independent parameters of a scene: path → (n,), as for `ensemble`.

    - `distributions`: by path (`"brake.linings.angle[3]"` for one entry; a path of an
      array alone means one number for all its entries) a frozen distribution of
      `scipy.stats`, or `(low, high)` for a uniform one; in SI, or texts with units
    - `method`: `"sobol"`, scrambled Sobol points, evenly spread where `n` is a power of
      two (for another `n` the first `n` points of the next power, which are still well
      spread but no longer balanced); `"latin"`, a Latin hypercube; `"random"`,
      independent points

    The same seed gives the same samples. Raises `InputError` with all errors.

    Example:
        >>> drawn = sb.studies.samples(scene, {"initial.omega": (20.0, 28.0)}, 8)
        >>> drawn["initial.omega"].size, bool((drawn["initial.omega"] >= 20.0).all())
        (8, True)
    """
    draws = checked(Issues(), scene, distributions, n, method)
    return draws.values(
        unit_points(n, len(draws.paths), method, np.random.default_rng(seed))
    )


def checked(
    issues: Issues,
    scene: Scene,
    distributions: Mapping[str, Distribution],
    n: int | np.integer,
    method: str,
    metrics: Sequence[Metric] = (),
) -> Draws:
    """The distributions. Raises `InputError` with all their errors and those already in
    `found`."""
    if not isinstance(n, int | np.integer) or n < 1:
        issues.add(
            "n", f"{n!r} is not a number of samples", "a whole number, at least 1"
        )
    issues.choice("method", method, METHODS)
    draws = issues.attempt(Draws, scene, distributions)
    issues.attempt(check_metrics, scene, metrics)
    issues.report()
    assert draws is not None
    return draws


def unit_points(n: int, d: int, method: str, rng: np.random.Generator) -> np.ndarray:
    """Points (n, d) in the unit cube."""
    if method == "random":
        return rng.random((n, d))
    from scipy.stats import qmc

    if method == "latin":
        return qmc.LatinHypercube(d, rng=rng).random(n)
    return qmc.Sobol(d, rng=rng).random_base2(power_of_two(n))[:n]


def power_of_two(n: int) -> int:
    """Exponent of the smallest power of two that is not below `n`."""
    return (int(n) - 1).bit_length()


def _frozen(
    scene: Scene, path: str, distribution: Distribution, issues: Issues
) -> Distribution:
    """The frozen distribution, or `None`, with its error added."""
    if isinstance(distribution, tuple | list):
        ends = bounds_of(scene, path, distribution, issues, None)
        if ends is None:
            return None
        from scipy import stats

        return stats.uniform(ends[0], ends[1] - ends[0])
    try:
        middle = float(_quantile_of(distribution)(0.5))
        distribution.cdf(middle)
    # no distribution, or one that asks for its parameters here
    except Exception as error:
        what = f"{type(distribution).__name__} is no frozen distribution: {error}"
        hint = "as scipy.stats.norm(0.35, 0.02), or (low, high) for a uniform one"
        issues.add(path, what, hint)
        return None
    if np.isfinite(middle):
        return distribution
    issues.add(path, f"its median is {middle}", "look at the distribution's parameters")
    return None


def _quantile_of(distribution: Distribution) -> Quantile:
    return getattr(distribution, "ppf", None) or distribution.icdf


def _faults_of_range(
    path: str, distribution: Distribution, about: Quantity
) -> list[Fault]:
    """Error of a distribution with any probability outside the range of its
    parameter."""
    below = above = 0.0
    if about.low is not None:
        edge = about.low if about.open_low else np.nextafter(about.low, -np.inf)
        below = distribution.cdf(edge)
    if about.high is not None:
        above = 1.0 - distribution.cdf(about.high)
    if not below + above > 0.0:
        return []
    problem = (
        f"is out of range with probability {below + above:.2g}: {about.meaning} "
        f"must be {about.range}"
    )
    problem += unit_suffix(about.unit)
    return [Fault(path, problem, _cut(distribution, about))]


def _cut(distribution: Distribution, about: Quantity) -> str:
    """Hint for keeping a distribution inside a range."""
    law = getattr(distribution, "dist", None)
    if getattr(law, "name", "") != "norm":
        return (
            "truncate it (scipy.stats.truncnorm for a normal one), or use a bounded one"
        )
    mean = distribution.mean()
    std = distribution.std()
    low = "-inf" if about.low is None else f"{(about.low - mean) / std:.6g}"
    high = "inf" if about.high is None else f"{(about.high - mean) / std:.6g}"
    return (
        f"truncate it: scipy.stats.truncnorm({low}, {high}, {mean:g}, {std:g})".replace(
            "inf", "numpy.inf"
        )
    )


# --- estimates with intervals -------------------------------------------------------


class Estimate(NamedTuple):
    """A value and its confidence interval; `nan`: unknown, an infinite end: not
    bounded.

    Example:
        >>> sb.studies.Estimate(value=0.02, low=0.01, high=0.04).high
        0.04
    """

    value: float
    low: float
    high: float

    def as_dict(self) -> dict[str, float | None]:
        return plain(self)


UNKNOWN = Estimate(np.nan, np.nan, np.nan)


def mean_and_deviation(
    values: np.ndarray, group: np.ndarray, confidence: float
) -> tuple[Estimate, Estimate]:
    """Mean and standard deviation of `values` (n,) by the jackknife over groups, the
    deviation in its logarithm.

    For groups of equal size the mean's interval is the mean of the groups' means ±
    t_{R−1} s/√R.
    """
    if len(values) == 0:
        return UNKNOWN, UNKNOWN
    centre = float(np.mean(values))
    away = values - centre
    label, count = _labels(group)
    first, second = (np.bincount(label, weights) for weights in (away, away**2))
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


def _labels(group: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Number of the group of each run, from 0, and how many runs each group has."""
    return np.unique(group, return_inverse=True, return_counts=True)[1:]  # pyright: ignore


def _moments(n: Any, first: Any, second: Any) -> tuple[Any, Any]:
    variance = np.maximum(second - first**2 / n, 0.0) / np.where(n > 1, n - 1, np.nan)
    return first / n, np.sqrt(variance)


def _jackknife(whole: float, without: np.ndarray, confidence: float) -> float:
    """Half width of the interval of an estimate, from its values without each of the
    groups."""
    from scipy.stats import t

    R = len(without)
    if R < 2:
        return np.nan
    pseudo = R * whole - (R - 1) * without
    return float(
        t.ppf(0.5 + confidence / 2, R - 1) * np.std(pseudo, ddof=1) / np.sqrt(R)
    )


def probability(hit: np.ndarray, group: np.ndarray, confidence: float) -> Estimate:
    """Share of runs that `hit` (n,), with its interval.

    Groups of one: Clopper–Pearson. Else Student's t over groups; where a group has
    fewer than two hits or misses, Clopper–Pearson as if all runs were independent,
    since so few do not estimate the scatter. Evenly spread points scatter less than
    that.
    """
    if len(hit) == 0:
        return UNKNOWN
    label, sizes = _labels(group)
    low, high = share_interval(np.bincount(label, hit)[None], sizes, confidence)
    return Estimate(float(np.mean(hit)), float(low[0]), float(high[0]))


def share_interval(
    counts: np.ndarray, sizes: np.ndarray, confidence: float
) -> tuple[np.ndarray, np.ndarray]:
    """Intervals (m,) of a share, from `counts` (m, R) of hits in groups of `sizes`
    (R,)."""
    from scipy.stats import beta, t

    n = sizes.sum()
    k = counts.sum(axis=1)
    R = len(sizes)
    tail = (1 - confidence) / 2
    # (not a number: of no hits, or of nothing else)
    low = np.nan_to_num(beta.ppf(tail, k, n - k + 1), nan=0.0)
    high = np.nan_to_num(beta.ppf(1 - tail, k + 1, n - k), nan=1.0)
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


def quantile(
    values: np.ndarray, group: np.ndarray, p: float, confidence: float
) -> Estimate:
    """Quantile `p` of `values` (n,), with the interval of all x whose share of values
    below has `p` in its interval.

    For runs drawn at random that is the exact interval of order statistics. An end is
    infinite where the values do not bound it: 20 runs do not bound the upper 1 %.
    """
    n = len(values)
    if n == 0:
        return UNKNOWN
    label, sizes = _labels(group)
    order = np.argsort(values, kind="stable")
    if sizes.max() == 1:  # only the totals matter
        below = np.arange(n + 1)[:, None]
        sizes = np.array([n])
    else:
        below = np.zeros((n + 1, len(sizes)), dtype=np.int64)
        below[np.arange(1, n + 1), label[order]] = 1
        np.cumsum(below, axis=0, out=below)
    low, high = share_interval(below, sizes, confidence)
    level = np.flatnonzero((low <= p) & (p <= high))
    ends = np.concatenate([[-np.inf], values[order], [np.inf]])
    middle = float(np.quantile(values, p, method="median_unbiased"))
    return Estimate(middle, float(ends[level[0]]), float(ends[level[-1] + 1]))


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
    - `limits`: metric → its maximum permissible value (n,) or one number
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
            yield f"{name}{', ' + s.unit if s.unit else ''}: {self._share(s.count)}"
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
    metrics: Metric | Sequence[Metric] = ("stopping_time",),
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
    - `limits`: maximum permissible value of metrics (SI). The scene's permissible
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
            "the maximum permissible value in SI units",
        )
        for name, value in bounds.items()
        if not isinstance(value, int | float | np.floating) or np.isnan(value)
    ]
    draws = checked(issues, scene, distributions, n, method, [*asked, *hidden])
    unit, group = _points(n, len(draws.paths), method, replicates, seed)
    values = draws.values(unit)
    data = ensemble(scene, values, [*asked, *hidden], **options)
    if missing := int(np.sum(np.asarray(data["code"]) < 0)):
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
    code = np.asarray(data["code"])
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
    scene: Scene, limits: Mapping[str, object] | None, asked: list[Metric]
) -> tuple[dict[str, Any], list[Metric]]:
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
        bounds[_HOT] = float(np.asarray(heat.permissible))
    names = [name_of(metric) for metric in asked]
    return bounds, [name for name in bounds if name not in names]


def _evaluate(
    data: Dataset,
    group: np.ndarray,
    asked: Sequence[Metric],
    bounds: Mapping[str, float | np.ndarray],
    shares: Sequence[float],
    confidence: float,
) -> tuple[dict[str, Statistics], dict[str, Failure]]:
    """Statistics and failures of runs that were made."""
    failed = np.asarray(data["code"]) != 0
    statistics = {}
    failures = {}
    for metric in asked:
        name = name_of(metric)
        x = np.asarray(data[name], np.float64)
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
        failures["does not stop"] = (
            ~np.isfinite(np.asarray(data["stopping_time"])) | goes_on | failed
        )
    for name, limit in bounds.items():
        shown = (
            f"{limit:g} {unit_of(name)}".rstrip()
            if np.ndim(limit) == 0
            else "its sampled limit"
        )
        failures[f"{name} > {shown}"] = (
            (np.asarray(data[name]) > limit) | np.isnan(np.asarray(data[name])) | failed
        )
    if len(failures) > 1:
        failures[ANY] = np.any(list(failures.values()), axis=0)
    return statistics, {
        name: Failure(int(hit.sum()), probability(hit, group, confidence))
        for name, hit in failures.items()
    }
