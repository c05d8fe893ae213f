"""Samples of uncertain parameters: quasi-random points, Latin hypercubes, or random ones."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, TypeAlias

import numpy as np

from .._base._faults import Fault, Issues
from .._base._quantity import Quantity, unit_suffix
from ..parts.scene import Scene
from ..parts.scene_checks import faults
from ..runs.edit import with_inputs, with_values
from ..runs.measure import MetricLike, check_metrics
from .bounds import Inputs, bounds_of
from .many_points import Columns

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
        issues += Inputs(scene).twice(distributions)
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
    metrics: Sequence[MetricLike] = (),
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
