"""Global sensitivity analysis: Sobol indices and Morris screening, computed by SALib."""

import dataclasses
import importlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from .._base._arguments import explained
from .._base._faults import Fault
from .._base._table import Column, Table, Tabular, plain
from .._outputs._log import SimulationError
from .._parts._scene import Scene
from .._run._measure import Metric, name_of, unit_of
from ._ensemble import Dataset, ensemble
from ._evaluator import Faults, as_metrics, failure_name
from ._uncertainty import Distribution, Draws, Estimate, checked, complete, power_of_two


def _salib(method: str, d: int, seed: int) -> tuple[Callable[..., np.ndarray], Callable[..., dict[str, Any]]]:
    """SALib's sampling and analysis by a method, of functions of `d` numbers from 0 to 1."""
    names = ("sample", "analyze", f"sample.{method}", f"analyze.{method}")
    try:
        *_, sample, analyze = (importlib.import_module(f"SALib.{name}") for name in names)
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            "global sensitivity indices are computed by SALib, which is not installed: pip install 'simbrake[global]'"
        ) from error
    problem = {"num_vars": d, "names": [f"x{i}" for i in range(d)], "bounds": [[0.0, 1.0]] * d}
    # of the design and of the bootstrap; never 0, which SALib reads as no seed
    seeds = [int(seed) | 1 for seed in np.random.SeedSequence(seed).generate_state(2)]
    return partial(sample.sample, problem, seed=seeds[0]), partial(analyze.analyze, problem, seed=seeds[1])


def sobol_design(n: int, d: int, second: bool, seed: int) -> np.ndarray:
    """Saltelli's design on scrambled Sobol points, `n (d + 2)` rows, with pairs `n (2d + 2)`; `n` a power of two."""
    return _salib("sobol", d, seed)[0](n, calc_second_order=second)


@dataclasses.dataclass(frozen=True)
class SobolIndex:
    """Shares of a metric's variance from one parameter alone (`first`) and with its interactions (`total`)."""

    path: str
    first: Estimate
    total: Estimate
    meaning: str = ""


@dataclasses.dataclass(frozen=True)
class SobolPair:
    """Share of a metric's variance from the interaction of two parameters."""

    paths: tuple[str, str]
    second: Estimate


@dataclasses.dataclass(frozen=True)
class SobolTable(Tabular):
    """Indices of one metric, the largest total effect first; its mean and standard deviation over the samples."""

    metric: str
    unit: str
    mean: float
    deviation: float
    indices: tuple[SobolIndex, ...]
    pairs: tuple[SobolPair, ...] | None
    confidence: float

    @property
    def alone(self) -> float:
        """Sum of the first-order indices: the rest to 1 is due to interactions."""
        return sum(one.first.value for one in self.indices)

    def parts(self) -> Iterator[str | Table]:
        unit = f" {self.unit}" if self.unit else ""
        yield f"{self.metric}: mean {self.mean:.6g}{unit}, standard deviation {self.deviation:.4g}{unit}"
        columns = [Column("path", heading="parameter", left=True), Column("total", heading="total S_T", show=_shown)]
        rows = [(one.path, one.total, one.first) for one in self.indices]
        interval = f"± half of the {100 * self.confidence:g} % interval"
        yield Table([*columns, Column("first", heading="first order S_1", show=_shown)], rows, interval)
        yield f"sum of the first order {self.alone:.3f}: the rest to 1 is due to interactions"
        sure = [pair for pair in self.pairs or () if pair.second.low > 0]
        yield from (f"together {pair.paths[0]} × {pair.paths[1]}: {_shown(pair.second)}" for pair in sure)
        if self.pairs and not sure:
            yield "no significant interaction of a pair"

    def as_dict(self) -> dict[str, Any]:
        data = plain(vars(self))
        return data | {"standard_deviation": data.pop("deviation")}


@dataclasses.dataclass(frozen=True)
class MorrisEffect:
    """Elementary effects of one parameter: change of the metric across its range (SI units of the metric).

    - `mu`: mean;  `mu_star`: mean of the absolute values;  `sigma`: dependence on the values of the others
    - `low`, `high`: the range crossed
    """

    path: str
    unit: str
    low: float
    high: float
    mu: float
    mu_star: Estimate
    sigma: float
    meaning: str = ""


@dataclasses.dataclass(frozen=True)
class MorrisTable(Tabular):
    """Elementary effects on one metric, the largest first."""

    metric: str
    unit: str
    effects: tuple[MorrisEffect, ...]
    confidence: float

    def parts(self) -> Iterator[str | Table]:
        unit = f", {self.unit}" if self.unit else ""
        yield f"{self.metric}{unit}: effect of crossing the range (± half of the {100 * self.confidence:g} % interval)"
        columns = [Column("path", heading="parameter", left=True), Column("range", left=True)]
        columns += [Column("μ*", heading="mean |effect| μ*", show=_shown)]
        columns += [Column("μ", heading="mean μ", show=".4g"), Column("σ", show=".4g")]
        ranges = [f"{one.low:.4g} … {one.high:.4g} {'' if one.unit == '1' else one.unit}" for one in self.effects]
        rows = zip(self.effects, ranges, strict=True)
        yield Table(columns, [(one.path, span, one.mu_star, one.mu, one.sigma) for one, span in rows])


@dataclasses.dataclass(frozen=True)
class GlobalSensitivity(Tabular):
    """Tables by metric (`found["stopping_time"]`), and every run in `data`."""

    tables: Mapping[str, SobolTable | MorrisTable]
    data: Dataset
    method: str
    runs: int

    def __getitem__(self, metric: Metric) -> Any:
        return self.tables[name_of(metric)]

    def parts(self) -> Iterator[str | Table]:
        yield f"{self.method}, {self.runs} runs"
        for table in self.tables.values():
            yield ""
            yield from table.parts()

    def as_dict(self) -> dict[str, Any]:
        """All results without the single runs."""
        tables = {name: table.as_dict() for name, table in self.tables.items()}
        return {"method": self.method, "runs": self.runs, "metrics": tables}


def around(value: float, half: float) -> Estimate:
    """A value with the interval ± `half`."""
    return Estimate(float(value), float(value - half), float(value + half))


def _shown(e: Estimate) -> str:
    return f"{e.value:.4g} ± {e.high - e.value:.2g}"


@explained
def sobol_indices(
    scene: Scene,
    distributions: Mapping[str, Distribution],
    metrics: Metric | Sequence[Metric] = "stopping_time",
    n: int = 512,
    *,
    second_order: bool = False,
    confidence: float = 0.95,
    resamples: int = 1000,
    seed: int = 0,
    **options: Any,
) -> GlobalSensitivity:
    """First-order and total Sobol indices of metrics, with confidence intervals, a `SobolTable` for each.

    `S_i = Var(E[y | x_i])/Var(y)`, `S_Ti = 1 − Var(E[y | x_~i])/Var(y)` for independent `x`; estimators of Saltelli et
    al. (Comput. Phys. Commun. 181, 2010) on scrambled Sobol points by SALib, intervals by its bootstrap over points.

    - `distributions`: as `samples` takes them;  `metrics`: names, or functions of a result
    - `n`: base points, rounded up to a power of two; `n (d + 2)` runs for `d` numbers, with `second_order` (indices of
      pairs) `n (2d + 2)`
    - `resamples`: of the bootstrap;  `options` go to `ensemble`

    Raises `InputError` with all errors, `ModuleNotFoundError` without SALib, and `SimulationError` where a run
    has no finite value or a metric never changes: there the indices do not exist. Its `result` holds all runs.
    """
    asked, draws = _checked(scene, distributions, metrics, confidence, n=n, resamples=resamples)
    base = 2 ** power_of_two(n)
    unit = sobol_design(base, len(draws.paths), second_order, seed)

    def table(metric: Metric, y: np.ndarray) -> SobolTable:
        indices = sobol_table(draws.paths, y, second_order, confidence, resamples, seed, name=name_of(metric))
        rows = [dataclasses.replace(row, meaning=draws.about[row.path].meaning) for row in indices.indices]
        return dataclasses.replace(indices, unit=unit_of(metric), indices=tuple(rows))

    data = complete(ensemble(scene, draws.values(unit), asked, **options))
    return _found(data, asked, table, f"Sobol indices from {base} scrambled Sobol points", varies=True)


def sobol_table(
    paths: Sequence[str],
    y: np.ndarray,
    second_order: bool = False,
    confidence: float = 0.95,
    resamples: int = 1000,
    seed: int = 0,
    *,
    name: str = "y",
) -> SobolTable:
    """The table of any function that has the values `y` on `sobol_design`."""
    d = len(paths)
    analyze = _salib("sobol", d, seed)[1]
    analysis = analyze(y, calc_second_order=second_order, num_resamples=resamples, conf_level=confidence)
    firsts, totals = (map(around, analysis[kind], analysis[f"{kind}_conf"]) for kind in ("S1", "ST"))
    rows = [SobolIndex(*row) for row in zip(paths, firsts, totals, strict=True)]
    pairs = None
    if second_order:
        ends = [(i, j) for i in range(d) for j in range(i + 1, d)]
        both = [
            SobolPair((paths[i], paths[j]), around(analysis["S2"][i, j], analysis["S2_conf"][i, j])) for i, j in ends
        ]
        pairs = tuple(sorted(both, key=lambda pair: -pair.second.value))
    step = 2 * d + 2 if second_order else d + 2
    unmixed = np.concatenate([y[::step], y[step - 1 :: step]])
    rows.sort(key=lambda row: -row.total.value)
    return SobolTable(name, "", float(unmixed.mean()), float(unmixed.std(ddof=1)), tuple(rows), pairs, confidence)


@explained
def morris(
    scene: Scene,
    distributions: Mapping[str, Distribution],
    metrics: Metric | Sequence[Metric] = "stopping_time",
    trajectories: int = 20,
    levels: int = 4,
    *,
    tail: float = 0.01,
    confidence: float = 0.95,
    resamples: int = 1000,
    seed: int = 0,
    **options: Any,
) -> GlobalSensitivity:
    """Screening by elementary effects (Morris 1991; `μ*` of Campolongo et al. 2007), a `MorrisTable` for each metric.

    `trajectories (d + 1)` runs for `d` numbers. Steps are even in the probability of each number: on a uniform one
    even in its value. An unbounded distribution is truncated at the probability `tail`. `μ*` orders numbers by weight,
    a `σ` of the size of `μ*` indicates interactions or curvature; the interval of `μ*` is SALib's bootstrap.

    `distributions`, `metrics`, `options` and errors as in `sobol_indices`; a metric that never changes has effects 0.
    """
    issues = Faults()
    if isinstance(levels, int) and levels % 2:
        issues.append(Fault("levels", f"{levels} is odd", "an even number, as 4: steps are half of the range and more"))
    issues.unless(0 < tail < 0.5, "tail", tail, "between 0 and 0.5, as 0.01")
    counts = {"trajectories": trajectories, "resamples": resamples, "levels": levels}
    asked, draws = _checked(scene, distributions, metrics, confidence, issues, **counts)
    sample, analyze = _salib("morris", len(draws.paths), seed)
    unit = sample(trajectories, num_levels=levels)  # steps of one number at a time: trajectories (d + 1) rows
    # where a distribution is bounded it is crossed as a whole
    ends = np.array(
        [
            (0.0 if np.isfinite(quantile(0.0)) else tail, 1.0 if np.isfinite(quantile(1.0)) else 1.0 - tail)
            for quantile in draws.quantiles.values()
        ]
    )
    spans = draws.values(ends.T)

    def table(metric: Metric, y: np.ndarray) -> MorrisTable:
        analysis = analyze(unit, y, num_levels=levels, conf_level=confidence, num_resamples=resamples)
        numbers = (analysis[name] for name in ("mu", "mu_star", "mu_star_conf", "sigma"))
        rows = []
        for (path, (low, high)), mu, star, half, sigma in zip(spans.items(), *numbers, strict=True):
            about, ends = draws.about[path], (float(low), float(high))
            numbers = float(mu), around(star, half), float(sigma)
            rows.append(MorrisEffect(path, about.unit, *ends, *numbers, about.meaning))
        rows.sort(key=lambda row: -row.mu_star.value)
        return MorrisTable(name_of(metric), unit_of(metric), tuple(rows), confidence)

    data = complete(ensemble(scene, draws.values(ends[:, 0] + unit * (ends[:, 1] - ends[:, 0])), asked, **options))
    method = f"elementary effects of Morris, {trajectories} trajectories on {levels} levels"
    return _found(data, asked, table, method, varies=False)


def _checked(
    scene: Scene,
    distributions: Mapping[str, Distribution],
    metrics: Metric | Sequence[Metric],
    confidence: float,
    issues: Faults | None = None,
    **counts: int,
) -> tuple[list[Metric], Draws]:
    asked, issues = as_metrics(metrics), Faults() if issues is None else issues
    for name, value in counts.items():
        if not isinstance(value, int | np.integer) or value < 2:
            issues.append(Fault(name, f"{value!r} is too few", "a whole number, at least 2"))
    issues.share("confidence", confidence, 0.95)
    return asked, checked(issues, scene, distributions, metrics=asked)


def _found(
    data: Dataset,
    asked: list[Metric],
    table: Callable[[Metric, np.ndarray], SobolTable | MorrisTable],
    method: str,
    *,
    varies: bool,
) -> GlobalSensitivity:
    """Tables of all metrics, if every run has them; else an error with counts and hints."""
    code = np.asarray(data["code"])
    values = {name_of(one): np.asarray(data[name_of(one)], np.float64) for one in asked}
    words = []
    for name, y in values.items():
        missing = ~np.isfinite(y) & (code == 0)
        if missing.any():
            words.append(
                f"{name} does not exist in {missing.sum()} of {len(y)} runs (as of an event that does not occur)"
            )
        elif varies and not (code != 0).any() and np.ptp(y) == 0.0:
            words.append(f"{name} is the same in every run: it has no variance")
    for c in np.unique(code[code != 0]):
        words.append(f"{np.sum(code == c)} of {len(code)} runs failed: {failure_name(int(c))}")
    if words:
        raise SimulationError(
            f"indices do not exist: {'; '.join(words)}. Narrow the distributions, set a later end_time, or use a "
            "function that every run has, as lambda r: jax.numpy.minimum(r.stopping_time, r.scene.end_time); all runs "
            "are in the error's `result`",
            data,
        )
    tables = {name_of(one): table(one, values[name_of(one)]) for one in asked}
    return GlobalSensitivity(tables, data, method, len(code))
