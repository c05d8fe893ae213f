"""Designs and analyses of global sensitivity by SALib, on the unit cube: nothing here knows of a brake."""

from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np


class SobolNumbers(NamedTuple):
    """First-order and total indices (d,), of pairs (d, d) above the diagonal, each with half its interval."""

    first: np.ndarray
    first_half: np.ndarray
    total: np.ndarray
    total_half: np.ndarray
    second: np.ndarray | None
    second_half: np.ndarray | None


class MorrisNumbers(NamedTuple):
    """Mean elementary effects (d,), means of their absolute values with half the interval, standard deviations."""

    mu: np.ndarray
    mu_star: np.ndarray
    mu_star_half: np.ndarray
    sigma: np.ndarray


def _salib() -> Any:
    try:
        from SALib.analyze import morris as morris_analysis
        from SALib.analyze import sobol as sobol_analysis
        from SALib.sample import morris as morris_sample
        from SALib.sample import sobol as sobol_sample
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            "global sensitivity indices are computed by SALib, which is not installed: pip install 'simbrake[global]'"
        ) from error
    return SimpleNamespace(
        morris_analysis=morris_analysis,
        morris_sample=morris_sample,
        sobol_analysis=sobol_analysis,
        sobol_sample=sobol_sample,
    )


def _problem(d: int) -> dict[str, Any]:
    return {"num_vars": d, "names": [f"x{i}" for i in range(d)], "bounds": [[0.0, 1.0]] * d}


def _seeds(seed: int) -> tuple[int, int]:
    """Seeds of the design and of the bootstrap; never 0, which SALib takes for none."""
    design, resampling = np.random.SeedSequence(seed).generate_state(2)
    return int(design) | 1, int(resampling) | 1


def sobol_design(n: int, d: int, second: bool, seed: int) -> np.ndarray:
    """Saltelli's design on scrambled Sobol points, `n (d + 2)` rows, with pairs `n (2d + 2)`; `n` a power of two."""
    return _salib().sobol_sample.sample(_problem(d), n, calc_second_order=second, seed=_seeds(seed)[0])


def sobol_numbers(y: np.ndarray, d: int, second: bool, confidence: float, resamples: int, seed: int) -> SobolNumbers:
    """Indices from the values (rows,) of a function on `sobol_design`; intervals by SALib's bootstrap."""
    found = _salib().sobol_analysis.analyze(
        _problem(d),
        y,
        calc_second_order=second,
        num_resamples=resamples,
        conf_level=confidence,
        seed=_seeds(seed)[1],
    )
    pairs = (found["S2"], found["S2_conf"]) if second else (None, None)
    return SobolNumbers(found["S1"], found["S1_conf"], found["ST"], found["ST_conf"], *pairs)


def morris_design(trajectories: int, d: int, levels: int, seed: int) -> np.ndarray:
    """Trajectories of one step in each direction on a grid of `levels` from 0 to 1: `trajectories (d + 1)` rows."""
    return _salib().morris_sample.sample(_problem(d), trajectories, num_levels=levels, seed=_seeds(seed)[0])


def morris_numbers(
    x: np.ndarray, y: np.ndarray, levels: int, confidence: float, resamples: int, seed: int
) -> MorrisNumbers:
    """Elementary effects of a function with the values `y` (rows,) on the design `x`, per unit of `x`."""
    found = _salib().morris_analysis.analyze(
        _problem(x.shape[1]),
        x,
        y,
        num_levels=levels,
        conf_level=confidence,
        num_resamples=resamples,
        seed=_seeds(seed)[1],
    )
    columns = ("mu", "mu_star", "mu_star_conf", "sigma")
    return MorrisNumbers(*(np.asarray(found[name], np.float64) for name in columns))
