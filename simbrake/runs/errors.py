"""Errors of a run, estimated from a second run: at a tighter tolerance, or with finer
layers."""

from typing import Any

import numpy as np

#: how many times tighter the second run's tolerance is than the first's, and the range
#: in which it stays: above, both runs could take the same steps, as short as events and
#: time breakpoints make them; below, rounding governs the steps
_TIGHTER = 100.0
_LOOSEST = 1e-12
_TIGHTEST = 1e-13
#: relative rounding of one operation
EPS = 2.0**-52


def second_rtol(rtol: float) -> float:
    """Tolerance of a second run whose own error is negligible next to that of the
    first: 100 times tighter, within 1e-13 … 1e-12."""
    return float(np.clip(rtol / _TIGHTER, _TIGHTEST, _LOOSEST))


#: factor from what finer layers change to the error of the layers: 2 where the error is
#: proportional to their thickness, as of friction that depends on the mean of a layer,
#: and a little more; where it falls with the square, 4/3 would be enough
_OF_LAYERS = 2.2


def error_of_layers(difference: Any, error: Any) -> Any:
    """Error by the layers of walls, from the difference to a run with finer layers
    beyond what the errors in time of both runs explain.

    - `error`: the estimated error in time of the first run
    """
    return _OF_LAYERS * np.maximum(difference - 2 * error, 0.0)


def rounding(steps: Any, size: Any) -> Any:
    """Error by rounding of a number of this size that is a sum over the steps."""
    return EPS * np.sqrt(np.maximum(steps, 1)) * np.abs(size)


def errors_between(a: Any, b: Any, steps: Any) -> np.ndarray:
    """Errors of values `a` by the values `b` of a second run, NaN where either is not
    finite."""
    a = np.asarray(a, float)
    b = np.asarray(b, float)
    both = np.isfinite(a) & np.isfinite(b)
    with np.errstate(invalid="ignore"):
        error = np.abs(a - b) + rounding(steps, a)
    return np.where(both, error, np.nan)
