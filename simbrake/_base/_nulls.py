"""How loggers say that there is no value: numbers, and texts of cells."""

from collections.abc import Sequence

import numpy as np

#: numbers that mean no value, beside those that a file declares
NULLS = (-999.25, -999.0, -9999.0, -9999.25, -99999.0, -999999.0)
#: texts of cells without value
EMPTY = (
    "",
    "-",
    "--",
    "---",
    "n/a",
    "N/A",
    "NA",
    "NaN",
    "nan",
    "NAN",
    "null",
    "NULL",
    "None",
    "#N/A",
)


def take_nulls(
    x: np.ndarray, nulls: Sequence[float] = NULLS, *, times: bool = False
) -> list[float]:
    """Set NaN where a number (n,) means no value; return the null values that there
    were.

    `times`: where some are lower than a null value, it is a time itself
    """
    found = []
    for null in nulls:
        room = 1e-9 * abs(null)
        low = np.fmin.reduce(x, initial=np.inf)
        if low > null + room or (times and low < null - room):
            continue
        same = np.abs(x - null) <= room
        if same.any():
            x[same] = np.nan
            found.append(null)
    return found


def told_as_null(value: float, columns: Sequence[str]) -> str:
    """A sentence on a number that was read as no value."""
    more = f" and {len(columns) - 4} more columns" if columns[4:] else ""
    return f"{value:g} is taken as a null value in {', '.join(columns[:4])}{more}"
