"""How loggers say that there is no value: numbers, and texts of cells."""

from collections.abc import Sequence

import numpy as np

#: numbers that mean no value, beside those that a file declares
NULLS = (-999.25, -999.0, -9999.0, -9999.25, -99999.0, -999999.0)
#: texts of cells without value
EMPTY = ("", "-", "--", "---", "n/a", "N/A", "NA", "NaN", "nan", "NAN", "null", "NULL", "None", "#N/A")


def is_null(x: np.ndarray, nulls: Sequence[float] = NULLS) -> np.ndarray:
    """Whether each of the numbers (n,) is one that means no value."""
    return np.any([np.abs(x - null) <= 1e-9 * abs(null) for null in nulls] or [np.zeros(x.shape, bool)], axis=0)


def told_as_null(value: float, columns: Sequence[str]) -> str:
    """A sentence on a number that was read as no value."""
    more = f" and {len(columns) - 4} more columns" if columns[4:] else ""
    return f"{value:g} is taken as a null value in {', '.join(columns[:4])}{more}"
