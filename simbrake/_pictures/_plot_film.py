"""What a film of a run shows when: its times, slower where slip begins."""

import math
from typing import Any, NamedTuple

import numpy as np

from .._base._faults import Fault, InputError
from .._base._quantity import as_number
from .._run._result import Result
from .._run._series import fault_of_times
from ._plot_shared import span, windows

SHARE = 0.45  # of the film that the onset of slip gets where it is short


class Film(NamedTuple):
    """Times of the run at the beginning, at the end of the slow part, if any, and at the end; of the film as well."""

    run: tuple[float, ...]  # s
    film: tuple[float, ...]  # s

    def run_time(self, film: Any) -> Any:
        """Time of the run at a time of the film."""
        return np.interp(film, self.film, self.run)

    def film_time(self, run: Any) -> Any:
        """Time of the film at a time of the run."""
        return np.interp(run, self.run, self.film)

    def rate(self, film: float) -> float:
        """Seconds of film for one second of the run."""
        i = min(int(np.searchsorted(self.film, film, side="right")), len(self.film) - 1)
        return (self.film[i] - self.film[i - 1]) / (self.run[i] - self.run[i - 1])


def film_of(result: Result, duration: float, start: float | int | None, end: float | int | None) -> Film:
    """The first braking, from the start until shortly after the first stop, or what is asked for."""
    first, last = span(result)
    begin, finish, _ = windows(result)
    stop = next((e.time for e in result.events if e.name == "stop" and e.time > begin), None)
    if stop is not None:
        finish = min(finish, begin + 1.15 * (stop - begin))
    low = begin if start is None else float(as_number(start))
    high = max(finish, low) if end is None else float(as_number(end))
    high = last if end is None and high <= low else high
    found = [
        fault
        for name, value in (("start", low), ("end", high))
        if (fault := fault_of_times(np.asarray([value]), first, last, name))
    ]
    low, high = max(low, first), min(high, last)
    if not found and not low < high:
        found.append(Fault("end", f"{high:g} s is not after the start at {low:g} s", "it must be later"))
    if found:
        raise InputError(found)
    slip = next((e.time for e in result.events if e.name == "full_slip" and low < e.time < high), None)
    slow = None if slip is None else low + 1.3 * (slip - low)
    if slow is None or slow - low > 0.25 * (high - low):
        return Film((low, high), (0.0, duration))
    return Film((low, slow, high), (0.0, SHARE * duration, duration))


def words_of_rate(rate: float) -> str:
    """How fast a film runs, in words."""
    if rate >= 1.05:
        return f"slow motion: {_round(rate)} times slower than the brake"
    if rate > 0.95:
        return "as fast as the brake"
    return f"{_round(1 / rate)} times faster than the brake"


def _round(x: float) -> str:
    digits = max(0, 1 - math.floor(math.log10(x)))
    return f"{x:.{digits}f}"


def ticks(film: Film) -> list[tuple[float, str]]:
    """Times of the run for the ticks of a time axis that runs as the film does, with words."""
    from matplotlib.ticker import MaxNLocator  # the numbers of a tick are its business

    found: list[tuple[float, str]] = []
    slow = len(film.run) == 3
    for i, (low, high) in enumerate(zip(film.run, film.run[1:], strict=False)):
        milliseconds = slow and i == 0 and high - low < 0.5
        factor, unit = (1e3, "ms") if milliseconds else (1.0, "s")
        for value in MaxNLocator(5, steps=[1, 2, 2.5, 5, 10]).tick_values(factor * low, factor * high):
            t = value / factor
            room = (film.film_time(high) - film.film_time(t)) / film.film[-1]
            near = i > 0 and (film.film_time(t) - film.film[i]) / film.film[-1] < 0.04
            if low <= t <= high and not near and (room > 0.02 or i == len(film.run) - 2):
                found.append((t, f"{value:g} {unit}"))
    return found
