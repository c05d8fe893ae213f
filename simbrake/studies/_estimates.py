"""Estimates with confidence intervals from independent groups of runs."""

from typing import Any, NamedTuple

import numpy as np

from .._base._table import plain

#: hits (and misses) on average in a group that Student's t needs; below, the exact
#: binomial interval is taken
_ENOUGH = 2


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
