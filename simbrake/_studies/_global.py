"""Which uncertain numbers make a result uncertain: Sobol indices and Morris screening, computed by SALib."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .._base._faults import Fault, InputError
from .._parts._scene import Scene
from .._run._measure import Metric, check_metrics, name_of, unit_of
from .._run._outcome import FAILURES, SimulationError
from ._ensemble import ensemble
from ._indices import (
    GlobalSensitivity,
    MorrisEffect,
    MorrisTable,
    SobolIndex,
    SobolPair,
    SobolTable,
    around,
)
from ._salib import morris_design, morris_numbers, sobol_design, sobol_numbers
from ._sampling import Distribution, Draws, attempt, complete, power_of_two


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

    Raises `InputError` with all faults at once, `ModuleNotFoundError` without SALib, and `SimulationError` where a run
    has no finite value or a metric never changes: there the indices do not exist. Its `result` holds all runs.
    """
    asked, draws = _checked(scene, distributions, metrics, confidence, [("n", n, 2), ("resamples", resamples, 2)])
    base, d = 2 ** power_of_two(n), len(draws.paths)
    unit = sobol_design(base, d, second_order, seed)
    data = complete(ensemble(scene, draws.values(unit), asked, **options))
    tables = {}
    for one, y in _values(data, asked, varies=True).items():
        tables[one] = sobol_table(draws.paths, y, second_order, confidence, resamples, seed, name=one)
    for one in asked:
        tables[name_of(one)] = dataclasses.replace(tables[name_of(one)], unit=unit_of(one))
    return GlobalSensitivity(tables, data, f"Sobol indices from {base} scrambled Sobol points", len(unit))


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
    found = sobol_numbers(y, d, second_order, confidence, resamples, seed)
    rows = [
        SobolIndex(path, around(*first), around(*total))
        for path, first, total in zip(
            paths,
            zip(found.first, found.first_half, strict=True),
            zip(found.total, found.total_half, strict=True),
            strict=True,
        )
    ]
    pairs = None
    if found.second is not None and found.second_half is not None:
        ends = [(i, j) for i in range(d) for j in range(i + 1, d)]
        both = [SobolPair((paths[i], paths[j]), around(found.second[i, j], found.second_half[i, j])) for i, j in ends]
        pairs = tuple(sorted(both, key=lambda pair: -pair.second.value))
    step = 2 * d + 2 if second_order else d + 2
    plain = np.concatenate([y[::step], y[step - 1 :: step]])  # the points of the design that are not mixed
    rows.sort(key=lambda row: -row.total.value)
    return SobolTable(name, "", float(plain.mean()), float(plain.std(ddof=1)), tuple(rows), pairs, confidence)


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
    even in its value. A distribution without an end is cut where `tail` is left. `μ*` orders numbers by weight, a `σ`
    of the size of `μ*` tells of interactions or curvature; the interval of `μ*` is SALib's bootstrap over trajectories.

    `distributions`, `metrics`, `options` and errors as in `sobol_indices`; a metric that never changes has effects 0.
    """
    counts = [("trajectories", trajectories, 2), ("resamples", resamples, 2), ("levels", levels, 2)]
    more = []
    if isinstance(levels, int) and levels % 2:
        more.append(Fault("levels", f"{levels} is odd", "an even number, as 4: steps are half of the range and more"))
    if not 0 < tail < 0.5:
        more.append(Fault("tail", f"{tail!r} is no share", "between 0 and 0.5, as 0.01"))
    asked, draws = _checked(scene, distributions, metrics, confidence, counts, more)
    unit = morris_design(trajectories, len(draws.paths), levels, seed)
    ends = np.array([_ends(draws.quantiles[path], tail) for path in draws.paths])
    points = ends[:, 0] + unit * (ends[:, 1] - ends[:, 0])
    data = complete(ensemble(scene, draws.values(points), asked, **options))
    spans = {path: [float(x) for x in pair] for path, pair in draws.values(ends.T).items()}
    tables = {}
    values = _values(data, asked, varies=False)
    for one in asked:
        found = morris_numbers(unit, values[name_of(one)], levels, confidence, resamples, seed)
        rows = [
            MorrisEffect(
                path, draws.units[path], spans[path][0], spans[path][1], float(mu), around(star, half), float(sigma)
            )
            for path, mu, star, half, sigma in zip(draws.paths, *found, strict=True)
        ]
        rows.sort(key=lambda row: -row.mu_star.value)
        tables[name_of(one)] = MorrisTable(name_of(one), unit_of(one), tuple(rows), confidence)
    method = f"elementary effects of Morris, {trajectories} trajectories on {levels} levels"
    return GlobalSensitivity(tables, data, method, len(unit))


def _ends(quantile: Any, tail: float) -> tuple[float, float]:
    """Shares between which a distribution is crossed: all of it where it ends."""
    return 0.0 if np.isfinite(quantile(0.0)) else tail, 1.0 if np.isfinite(quantile(1.0)) else 1.0 - tail


def _checked(
    scene: Scene,
    distributions: Mapping[str, Distribution],
    metrics: Metric | Sequence[Metric],
    confidence: float,
    counts: list[tuple[str, Any, int]],
    more: Sequence[Fault] = (),
) -> tuple[list[Metric], Draws]:
    asked: list[Metric] = [metrics] if isinstance(metrics, str) or callable(metrics) else list(metrics)
    found = [
        Fault(name, f"{value!r} is too few", f"a whole number, at least {least}")
        for name, value, least in counts
        if not isinstance(value, int | np.integer) or value < least
    ]
    found += more
    if not 0 < confidence < 1:
        found.append(Fault("confidence", f"{confidence!r} is no share", "between 0 and 1, as 0.95"))
    draws = attempt(found, Draws, scene, distributions)
    attempt(found, check_metrics, scene, asked)
    if found or draws is None:
        raise InputError(found)
    return asked, draws


def _values(data: Any, asked: Sequence[Metric], *, varies: bool) -> dict[str, np.ndarray]:
    """Values by metric, if every run has them; else an error that counts and names what to do."""
    code = np.asarray(data["code"])
    found = {name_of(one): np.asarray(data[name_of(one)], np.float64) for one in asked}
    words = []
    for name, y in found.items():
        missing = ~np.isfinite(y) & (code == 0)
        if missing.any():
            words.append(f"{name} does not exist in {missing.sum()} of {len(y)} runs (as a time that never comes)")
        elif varies and not (code != 0).any() and np.ptp(y) == 0.0:
            words.append(f"{name} is the same in every run: it has no variance to share out")
    for c in np.unique(code[code != 0]):
        name = FAILURES[int(c)][0] if int(c) in FAILURES else f"code {c}"  # pyright: ignore
        words.append(f"{np.sum(code == c)} of {len(code)} runs failed: {name}")
    if words:
        raise SimulationError(
            "indices do not exist: "
            + "; ".join(words)
            + ". Narrow the distributions, set a later end_time, or ask for a function that every run has, as "
            "lambda r: jax.numpy.minimum(r.stopping_time, r.scene.end_time); all runs are in the error's `result`",
            data,
        )
    return found
