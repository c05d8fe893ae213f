"""The event log of a run: mode changes, and marks that are merely passed (a lining reaching its limit)."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from .._physics._modes import BandMode, Label, events_of_change


class Event(NamedTuple):
    """One entry of the log: time in s, name, and the lining (from 1) where it concerns one."""

    time: float
    name: str
    lining: int | None = None

    def as_dict(self) -> dict[str, Any]:
        entry: dict[str, Any] = {"time": self.time, "name": self.name}
        if self.lining is not None:
            entry["lining"] = self.lining
        return entry


class Phase(NamedTuple):
    """Consecutive steps in one mode, from sample `first` to sample `last` of the arrays handed to `event_log`."""

    label: Label
    first: int
    last: int
    start: float
    end: float

    @property
    def band(self) -> int:
        return self.label.band


def event_log(
    phases: list[Phase],
    margins: np.ndarray,
    locate: Callable[[list[tuple[int, int]]], np.ndarray],
    linings: int,
    start: Label,
) -> list[Event]:
    """All events in order of time; entries at one instant in the order of cause and effect, linings by index.

    - `margins` (samples, 2 n): by how much each lining is past its limit (first `n` from the slack end, last `n` from
      the anchor) at samples along the run;  `locate` finds the time at which margin `j` rises through 0 between the
      samples `i` and `i + 1` for a list of `(i, j)`;  `start`: the mode from which the first phase came
    """
    events: list[Event] = []
    crossings: list[tuple[int, int]] = []
    places: list[int] = []
    label, reached = start, np.zeros(2 * linings, bool)
    # the last lining of either count comes with full slip, whatever rounding leaves of its margin there
    last = slice(max(linings - 1, 0), linings + 1)
    for number, phase in enumerate(phases):
        before = label.band
        for name in events_of_change(label, phase.label, number == 0):
            if name == "full_slip":
                events += _all_at_limit(phase, reached, linings)
            events.append(Event(float(phase.start), name))
        if phase.band == BandMode.ELASTIC:
            if before not in (BandMode.ELASTIC, BandMode.SLIP, BandMode.SLIP_BACK):
                reached = np.zeros(2 * linings, bool)
            here = margins[phase.first : phase.last + 1]
            # at the start: past the limit, or at 0 (a ramp from nothing) and on the way up
            soon = here[min(1, len(here) - 1)]  # a run that fails where the phase begins has no more
            at_once = (here[0] > 1e-12) | ((np.abs(here[0]) <= 1e-12) & (soon > 1e-12) & (here[0] >= 0))
            events += [
                Event(float(phase.start), "lining_limit", 1 + int(j) % linings)
                for j in np.flatnonzero(at_once & ~reached)
            ]
            reached = reached | at_once
            rises = (here[:-1] <= 0) & (here[1:] > 0)
            rises[:1] &= ~at_once
            rises[:, last] = False
            for i, j in np.argwhere(rises):
                crossings.append((phase.first + int(i), int(j)))
                places.append(len(events))
                events.append(Event(np.nan, "lining_limit", 1 + int(j) % linings))
            reached = here[-1] > 1e-12
            reached[last] = False
        elif phase.band in (BandMode.SLIP, BandMode.SLIP_BACK):
            reached = np.ones(2 * linings, bool)
        else:
            reached = np.zeros(2 * linings, bool)
        label = phase.label
    if crossings:
        for place, time in zip(places, locate(crossings), strict=True):
            events[place] = events[place]._replace(time=float(time))
    order = sorted(range(len(events)), key=lambda k: events[k].time)  # stable: cause before effect
    return [events[k] for k in order]


def _all_at_limit(phase: Phase, reached: np.ndarray, n: int) -> list[Event]:
    """Linings that come to their limit in the very moment of full slip."""
    if phase.band == BandMode.SLIP:
        order = [i for i in range(n) if not reached[i]]
    else:
        order = [i for i in range(n - 1, -1, -1) if not reached[n + i]]
    return [Event(float(phase.start), "lining_limit", i + 1) for i in order]


def marks_passed(passing: np.ndarray, row: np.ndarray) -> list[tuple[int, int]]:
    """Samples `i` and marks `j` where mark `j` is passed between the samples `i` and `i + 1` of one step.

    `passing` (samples, marks) is positive beyond a mark; a jump between two steps belongs to no crossing.
    """
    rises = (passing[:-1] <= 0) & (passing[1:] > 0) & (row[:-1] == row[1:])[:, None]
    return [(int(i), int(j)) for i, j in np.argwhere(rises)]
