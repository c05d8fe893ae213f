"""Errors of a run from what a second one has: at a tighter tolerance, or with finer
layers."""

from typing import Any

import numpy as np

#: factor between the tolerances of the two runs; the loosest one of the second, and the
#: tightest, below which rounding governs the steps
RATIO = 100.0
TIGHT = 1e-12
TIGHTEST = 1e-13
#: relative rounding of one operation
EPS = 2.0**-52


def second_rtol(rtol: float) -> float:
    """Tolerance of a second run beside which the error of the first one counts alone.

    100 times tighter, and at least as tight as 1e-12: at a loose tolerance many steps
    are as short as events and time breakpoints make them, and would be the same steps
    again. Not below 1e-13, where rounding governs.
    """
    return float(np.clip(rtol / RATIO, TIGHTEST, TIGHT))


#: factor from what finer layers change to the error of the layers: 2 where that is
#: proportional to their thickness, as of friction that sees the mean of a layer, and a
#: little more; where it falls with the square, 4/3 would be enough
_OF_LAYERS = 2.2


def error_of_layers(apart: Any, error: Any) -> Any:
    """Error of the layers of walls: from the difference to a run with finer ones, and
    the error in time.

    The difference counts where the errors in time of both runs do not explain it.
    """
    return _OF_LAYERS * np.maximum(apart - 2 * error, 0.0)


def rounding(steps: Any, size: Any) -> Any:
    """What rounding leaves of a number of this size that is summed over so many
    steps."""
    return EPS * np.sqrt(np.maximum(steps, 1)) * np.abs(size)


def errors_between(a: Any, b: Any, steps: Any) -> np.ndarray:
    """Errors of values `a` from those of a second run, NaN where one of them is not
    finite."""
    a = np.asarray(a, float)
    b = np.asarray(b, float)
    both = np.isfinite(a) & np.isfinite(b)
    with np.errstate(invalid="ignore"):
        error = np.abs(a - b) + rounding(steps, a)
    return np.where(both, error, np.nan)
