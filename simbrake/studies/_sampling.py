"""Distributions on numbers of a scene, and samples of them: quasi-random, Latin hypercube or random."""

from collections.abc import Callable, Mapping
from typing import Any, Literal

import numpy as np

from .._base._faults import Fault, InputError
from .._base._quantity import Quantity, leaves
from .._parts._scene import Scene, faults
from .._run._edit import with_values
from .._run._log import SimulationError
from ._evaluator import place_of, same_numbers

#: a frozen distribution of scipy.stats (anything with `ppf` or `icdf`), or (low, high) for a uniform one
Distribution = Any
Method = Literal["sobol", "latin", "random"]
METHODS = ("sobol", "latin", "random")

#: half a step of SciPy's Sobol points: a quantile function is never asked at 0 or 1, where a tail is infinite
_EDGE = 2.0**-31


class Draws:
    """Checked distributions of a scene: from points of the unit cube to numbers of the scene.

    Raises `InputError` with all errors at once: unknown paths, paths that overlap, what is not a distribution, and
    distributions that leave the admissible range of their number.
    """

    def __init__(self, scene: Scene, distributions: Mapping[str, Distribution]):
        found: list[Fault] = []
        if not distributions:
            found.append(Fault("distributions", "there are none", "as in {'brake.linings.friction.coefficient': …}"))
        self.quantiles: dict[str, Callable[[Any], Any]] = {}
        chances: dict[str, Any] = {}
        medians: dict[str, float] = {}
        for path, given in distributions.items():
            one, fault = _distribution(path, given)
            if fault is not None:
                found.append(fault)
                medians[path] = np.nan
                continue
            self.quantiles[path] = _quantile_of(one)
            chances[path], medians[path] = one, float(self.quantiles[path](0.5))
        found += _faults_of_paths(scene, medians)
        known = {path: value for path, value in medians.items() if not any(fault.path == path for fault in found)}
        self.units: dict[str, str] = {}
        middle = with_values(scene, known)
        about = {leaf.path: leaf.about for leaf in leaves(middle)}
        for path in known:
            quantity = about[place_of(path, about)[0]]
            self.units[path] = quantity.unit
            found += _faults_of_range(path, chances[path], quantity)
        if not found:
            found += [Fault(f.path, f"{f.problem}, at the medians", f.hint) for f in faults(middle)]
        if found:
            raise InputError(found)

    @property
    def paths(self) -> list[str]:
        return list(self.quantiles)

    def values(self, unit: np.ndarray) -> dict[str, np.ndarray]:
        """Numbers of the scene (n,) by path, from points (n, d) of the unit cube."""
        inside = np.clip(unit, _EDGE, 1.0 - _EDGE)
        columns = zip(self.quantiles.items(), inside.T, strict=True)
        return {path: np.asarray(quantile(u), np.float64) for (path, quantile), u in columns}


def samples(
    scene: Scene,
    distributions: Mapping[str, Distribution],
    n: int,
    seed: int = 0,
    method: Method = "sobol",
) -> dict[str, np.ndarray]:
    """`n` samples of independent numbers of a scene: path → (n,), as `ensemble` takes them.

    - `distributions`: by path (`"brake.linings.angle[3]"` for one entry; a path of an array alone means one number
      for all its entries) a frozen distribution of `scipy.stats`, or `(low, high)` for a uniform one; SI units
    - `method`: `"sobol"`, scrambled Sobol points, evenly spread where `n` is a power of two (for another `n` the
      first `n` points of the next power, which are still well spread but no longer balanced); `"latin"`, a Latin
      hypercube; `"random"`, independent points

    The same seed gives the same samples. Raises `InputError` with all errors at once.
    """
    found = faults_of_sampling(n, method)
    draws = attempt(found, Draws, scene, distributions)
    if found or draws is None:
        raise InputError(found)
    return draws.values(unit_points(n, len(draws.paths), method, np.random.default_rng(seed)))


def faults_of_sampling(n: Any, method: Any) -> list[Fault]:
    """What is wrong with a number of samples and a method."""
    found = []
    if not isinstance(n, int | np.integer) or n < 1:
        found.append(Fault("n", f"{n!r} is not a number of samples", "a whole number, at least 1"))
    if method not in METHODS:
        found.append(Fault("method", f"{method!r} is unknown", f"one of {', '.join(METHODS)}"))
    return found


def unit_points(n: int, d: int, method: str, rng: np.random.Generator) -> np.ndarray:
    """Points (n, d) in the unit cube."""
    if method == "random":
        return rng.random((n, d))
    from scipy.stats import qmc

    if method == "latin":
        return qmc.LatinHypercube(d, rng=rng).random(n)
    return qmc.Sobol(d, rng=rng).random_base2(power_of_two(n))[:n]


def power_of_two(n: int) -> int:
    """Exponent of the least power of two that is not below `n`."""
    return (int(n) - 1).bit_length()


def _distribution(path: str, given: Any) -> tuple[Any, Fault | None]:
    """The distribution meant, or what is wrong with it."""
    how = "a frozen distribution as scipy.stats.norm(0.35, 0.02), or (low, high) for a uniform one"
    if isinstance(given, tuple | list):
        try:
            low, high = (float(x) for x in given)
        except (TypeError, ValueError):
            return None, Fault(path, f"{given!r} is not a range", how)
        if not (np.isfinite(low) and np.isfinite(high) and low < high):
            return None, Fault(path, f"({low:g}, {high:g}) is not a range", "low < high, both finite")
        from scipy import stats

        return stats.uniform(low, high - low), None
    if _quantile_of(given) is None or isinstance(given, type) or not callable(getattr(given, "cdf", None)):
        return None, Fault(path, f"{type(given).__name__} is not a distribution", how)
    try:
        middle = np.asarray(_quantile_of(given)(0.5), np.float64)
    except Exception as error:  # a distribution that is not frozen asks for its parameters here
        return None, Fault(path, f"has no median: {type(error).__name__}: {error}", how)
    if middle.ndim or not np.isfinite(middle):
        return None, Fault(path, f"its median is {middle}, not one number", "look at the distribution's parameters")
    return given, None


def _quantile_of(distribution: Any) -> Any:
    return getattr(distribution, "ppf", None) or getattr(distribution, "icdf", None)


def _faults_of_paths(scene: Scene, medians: dict[str, float]) -> list[Fault]:
    """Paths that the scene does not have, and those that mean the same number."""
    found: list[Fault] = []
    try:
        with_values(scene, {path: 0.0 if np.isnan(value) else value for path, value in medians.items()})
    except InputError as error:
        found += error.faults
    sizes = {leaf.path: np.size(leaf.value) for leaf in leaves(scene)}
    hint = "give each number one distribution"
    return found + [
        Fault(p, f"means what {old} means as well", hint) for p, old in same_numbers(medians, sizes).items()
    ]


def _faults_of_range(path: str, distribution: Any, about: Quantity) -> list[Fault]:
    """A distribution that puts weight where its number is out of range, however little."""
    below = above = 0.0
    if about.low is not None:
        below = float(distribution.cdf(about.low if about.open_low else np.nextafter(about.low, -np.inf)))
    if about.high is not None:
        above = float(1.0 - distribution.cdf(about.high))
    if not below + above > 0.0:
        return []
    unit = "" if about.unit == "1" else f" {about.unit}"
    problem = f"is out of range with probability {below + above:.2g}: {about.meaning} must be {about.range}{unit}"
    return [Fault(path, problem, _cut(distribution, about))]


def _cut(distribution: Any, about: Quantity) -> str:
    """How to keep a distribution inside a range."""
    name, args, given = (getattr(distribution, key, None) for key in ("dist", "args", "kwds"))
    if getattr(name, "name", "") != "norm" or args is None or given is None:
        return "cut it (scipy.stats.truncnorm for a normal one), or take one that ends there"
    mean, std = distribution.mean(), distribution.std()
    low = "-inf" if about.low is None else f"{(about.low - mean) / std:.6g}"
    high = "inf" if about.high is None else f"{(about.high - mean) / std:.6g}"
    return f"cut it: scipy.stats.truncnorm({low}, {high}, {mean:g}, {std:g})".replace("inf", "numpy.inf")


def attempt(found: list[Fault], make: Callable[..., Any], *arguments: Any) -> Any:
    """What `make` gives, or `None` and its faults added to `found`, so that all faults come in one report."""
    try:
        return make(*arguments)
    except InputError as error:
        found += error.faults
        return None


def complete(data: Any) -> Any:
    """The data set of an ensemble, if every run was made: those made first are the expensive ones, no fair sample.

    Raises `SimulationError`, whose `result` is the data set.
    """
    missing = int(np.sum(np.asarray(data["code"]) < 0))
    if missing:
        message = f"interrupted: {missing} of {data.sizes['run']} runs were not made, and the rest is no fair sample. "
        raise SimulationError(f"{message}With directory=… the same call goes on where it ended", data)
    return data
