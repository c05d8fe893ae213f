"""Tolerance of a second run, and errors of numbers from those of both runs."""

from typing import Any, NamedTuple

import numpy as np

from ._log import FAILURES

#: factor between the tolerances of the two runs; the loosest one of the second, and the tightest, below which rounding
#: governs the steps
RATIO, TIGHT, TIGHTEST = 100.0, 1e-12, 1e-13
#: relative rounding of one operation
EPS = 2.0**-52


def second_rtol(rtol: float) -> float:
    """Tolerance of a second run beside which the error of the first one counts alone.

    100 times tighter, and at least as tight as 1e-12: at a loose tolerance many steps are as short as events and
    time breakpoints make them, and would be the same steps again. Not below 1e-13, where rounding governs.
    """
    return float(np.clip(rtol / RATIO, TIGHTEST, TIGHT))


def rounding(steps: Any, size: Any) -> Any:
    """What rounding leaves of a number of this size that is summed over so many steps."""
    return EPS * np.sqrt(np.maximum(steps, 1)) * np.abs(size)


class AnswerAccuracy(NamedTuple):
    """Estimated errors of a prepared run: of its metrics by name, as they are in the answer (`None`, in arrays NaN,
    where one has no value); steps of both runs; and `problem`, empty, or why there is no estimate.

    Example:
        >>> prepared = sb.prepare(scene, ["stopping_time"])
        >>> prepared.accuracy({"initial.omega": 18.0}).errors["stopping_time"] < 1e-9
        True
    """

    errors: dict[str, Any]
    steps: int
    second_steps: int
    problem: str = ""


def of_answers(first: Any, second: Any) -> AnswerAccuracy:
    """Errors of the first of two answers of a prepared run from their difference."""
    counts = first.accepted, second.accepted
    for which, one in (("the run", first), ("the second run", second)):
        if one.code:
            return AnswerAccuracy({}, *counts, f"{which} failed ({FAILURES[one.code][0]})")  # pyright: ignore
    if (first.events, first.segments) != (second.events, second.segments):
        words = f"the runs have {first.events} and {second.events} events"
        return AnswerAccuracy({}, *counts, f"{words} in {first.segments} and {second.segments} segments")
    errors: dict[str, Any] = {}
    for name, value in first.metrics.items():
        error = errors_between(value, second.metrics[name], first.accepted)
        errors[name] = error if error.ndim else None if np.isnan(error) else float(error)
    return AnswerAccuracy(errors, *counts)


def errors_between(a: Any, b: Any, steps: Any) -> np.ndarray:
    """Errors of values `a` from those of a second run, NaN where one of them is not finite."""
    a, b = np.asarray(a, float), np.asarray(b, float)
    both = np.isfinite(a) & np.isfinite(b)
    with np.errstate(invalid="ignore"):
        error = np.abs(a - b) + rounding(steps, a)
    return np.where(both, error, np.nan)
