"""Runs by expected cost: side by side a chunk costs as much as its slowest run; runs of like cost belong together."""

import numpy as np

_RIDGE = 1e-6


def _features(columns: np.ndarray, squares: bool) -> np.ndarray:
    parts = [np.ones((len(columns), 1)), columns]
    return np.concatenate([*parts, columns**2] if squares else parts, axis=1)


def spread(count: int, size: int) -> np.ndarray:
    """`size` of `count` runs without any order of their own (a regular choice could miss a whole direction)."""
    return np.sort(np.random.default_rng(0).permutation(count)[:size])


def expected_cost(columns: np.ndarray, known: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Expected logarithm of the steps of every run, from those of the runs `known`.

    Least squares on the varied numbers (runs, numbers), standardised, and their squares; on the numbers alone where
    few runs are known. Numbers that do not vary say nothing.
    """
    scale = columns.std(axis=0)
    columns = (columns[:, scale > 0] - columns[:, scale > 0].mean(axis=0)) / scale[scale > 0]
    x = _features(columns, squares=2 * columns.shape[1] + 1 <= len(known) / 2)
    some, log = x[known], np.log(np.maximum(steps, 1.0))
    lhs = some.T @ some + _RIDGE * len(known) * np.eye(x.shape[1])
    return x @ np.linalg.solve(lhs, some.T @ log)
