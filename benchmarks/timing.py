"""Times of several calls that are measured in turn, so that other work on the machine
meets all of them alike."""

import statistics
import time
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

#: shortest time that is measured at once (s): clocks and interrupts are far below it
_BATCH = 1e-3


class Times(NamedTuple):
    """Seconds of one call in every round: elapsed, and of the processor (all threads of
    this process)."""

    wall: list[float]
    cpu: list[float]

    @property
    def median(self) -> float:
        return statistics.median(self.wall)

    @property
    def cpu_least(self) -> float:
        return min(self.cpu)

    @property
    def cpu_median(self) -> float:
        return statistics.median(self.cpu)


def interleaved(
    calls: Mapping[str, Callable[[], Any]],
    budget: float,
    least: int = 5,
    batch: float = _BATCH,
) -> dict[str, Times]:
    """Rounds through all calls for `budget` seconds, at least `least` rounds; a short
    call is repeated in its turn.

    Every call is made once or twice before, to warm up; `batch`: shortest time of one
    turn (s).
    """
    counts = {}
    for name, call in calls.items():
        wall = _once(call, 1)[0]
        if wall < 0.1:  # the first one may have come upon cold caches
            wall = _once(call, 1)[0]
        counts[name] = max(1, round(batch / max(wall, 1e-7)))
    found = {name: Times([], []) for name in calls}
    end = time.perf_counter() + budget
    rounds = 0
    while rounds < least or time.perf_counter() < end:
        rounds += 1
        for name, call in calls.items():
            wall, cpu = _once(call, counts[name])
            found[name].wall.append(wall)
            found[name].cpu.append(cpu)
    return found


def _once(call: Callable[[], Any], count: int) -> tuple[float, float]:
    wall = time.perf_counter()
    cpu = time.process_time()
    for _ in range(count):
        call()
    return (time.perf_counter() - wall) / count, (time.process_time() - cpu) / count


def ratio(a: Times, b: Times, less: Times | None = None) -> float:
    """Median over the rounds of processor time of `a` over that of `b`, `less` taken
    off both."""
    off = (
        [0.0] * len(a.cpu)
        if less is None
        else [statistics.median(less.cpu)] * len(a.cpu)
    )
    return statistics.median(
        (x - z) / (y - z) for x, y, z in zip(a.cpu, b.cpu, off, strict=True)
    )
