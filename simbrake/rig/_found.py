"""Lowerings that were found in a log, their table, gaps, and what totals leave out."""

import dataclasses
from collections import Counter
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from .._base._numbers import digits, number
from .._base._table import Column, Table, Tabular, frozen, plain
from ._log import Log

#: of the block in a row of the log
STATES = ("no data", "down", "up", "at rest", "in slips", "set down", "slack")
#: kinds of load on the hook
LOADS = ("not decidable", "block", "string")
#: SI unit → quantities in it
_QUANTITIES = {
    "s": "begin duration",
    "m": "height travel recorded_travel change",
    "m/s": "top_speed",
    "N": "mean_load static_load",
    "J": "hook_work hook_work_low hook_work_high recorded_work kinetic_energy "
    "tackle_loss drum_work drum_work_low "
    "drum_work_high auxiliary_work friction_work friction_heat",
    "W": "mean_power",
    "rad/s": "drum_speed",
    "N*m": "drum_torque",
}
_UNITS = {name: unit for unit, names in _QUANTITIES.items() for name in names.split()}
#: formats of quantities for which four digits are too few or too many
_SHOWN = {"begin": ".6g", "height": ".6g", "top_speed": ".3g", "change": "+.3g"}
#: flag of a lowering that goes on in a gap
CUT = "cut by a gap"
_WORKS = ("hook_work", "hook_work_low", "hook_work_high")


class Level(NamedTuple):
    """A load (N) with the interval that holds 90 % of its readings."""

    value: float
    low: float
    high: float


@frozen
class Lowering:
    """One lowering of the hook, in SI units; times are seconds from the first row of
    the log.

    - `start`: in ISO 8601, `None` in a log without date
    - `begin`, `duration`; `height` at the begin, `travel` down
    - `top_speed`: the highest mean speed between two updates of the height, over their
      usual interval at least
    - `mean_load`: `hook_work`/`travel`
    - `static_load`: median over the middle half of the travel, hardly accelerated
    - `hook_work`, `hook_work_low`, `hook_work_high`: `∫F dx` with its interval, see
      `lowerings`
    - `kind`: `string`, `block` or `not decidable`
    - `flags`: reasons to look at it, left out of totals
    - `activity`: the log's own code, for comparison
    """

    start: str | None
    begin: float
    duration: float
    height: float
    travel: float
    top_speed: float
    mean_load: float
    static_load: float
    hook_work: float
    hook_work_low: float
    hook_work_high: float
    kind: str
    flags: tuple[str, ...] = ()
    activity: str = ""

    @property
    def end(self) -> float:
        return self.begin + self.duration


class Gap(NamedTuple):
    """A time without heights that is longer than a pause; times are seconds from the
    first row of the log.

    - `start`: in ISO 8601, `None` in a log without date;  `begin`, `duration`
    - `change`: of the height of the block over the gap, negative downwards
    - `cut`: number of lowerings that go on in the gap
    - `rest`: whether the block is where it was, and no lowering is cut
    """

    start: str | None
    begin: float
    duration: float
    change: float
    cut: int
    rest: bool


@frozen
class Lowerings(Tabular):
    """Lowerings of a log in the order of time, and the states of the block.

    - `gaps`: times without heights; what the block does in gaps that are no rest is
      unknown, and in no total
    - `state`, `load` (n,): places in `simbrake.rig.STATES` and `LOADS` of each row of
      the log
    - `tare`: what the hook load shows without a string (block, top drive and the zero
      of the gauge), `None` if unknown
    - `decidable`: whether a second, heavier level tells string and block apart
    - `interval_by`: what the intervals of the work are from
    - `thresholds`: the arguments
    - `notes`: doubts about the log, for the user to check
    """

    log: Log = dataclasses.field(repr=False)
    lowerings: tuple[Lowering, ...]
    gaps: tuple[Gap, ...]
    state: np.ndarray = dataclasses.field(repr=False)
    load: np.ndarray = dataclasses.field(repr=False)
    tare: Level | None
    decidable: bool
    interval_by: str
    thresholds: dict[str, Any]
    notes: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.lowerings)

    @property
    def valid(self) -> tuple[Lowering, ...]:
        """Those without flags, of which totals are made."""
        return tuple(lowering for lowering in self.lowerings if not lowering.flags)

    def parts(self) -> Iterator[str | Table]:
        work, low, high = (
            sum(getattr(lowering, name) for lowering in self.valid) for name in _WORKS
        )
        flagged = len(self) - len(self.valid)
        total = (
            f"{number(work, 'J', count=4)} ({number(low, 'J', count=4)} to "
            f"{number(high, 'J', count=4)})"
        )
        are = "is" if flagged == 1 else "are"
        aside = f"; {flagged} more {are} flagged and left out" if flagged else ""
        yield f"{counted(len(self.valid))}, {total} at the hook{aside}"
        yield from self.lost
        counts = Counter(lowering.kind for lowering in self.valid)
        kinds = [f"{kind}: {counts[kind]}" for kind in reversed(LOADS)]
        yield f"load {', '.join(kinds)}"
        yield self.table
        yield from [self.gap_table] if self.gaps else []
        yield self._shares
        yield from self.basis
        yield from (f"- {note}" for note in self.notes)

    @property
    def left_out(self) -> dict[str, Any]:
        """What totals leave out: numbers of flagged lowerings, of lowerings that gaps cut,
        and of gaps that are no rest, with their time (s) and by how much the block is
        lower or higher after them (m); travel and work left out, `None`: unknown."""
        lost = [gap for gap in self.gaps if not gap.rest]
        flagged = len(self) - len(self.valid)
        unknown = None if lost or flagged else 0.0
        return {
            "flagged": flagged,
            "cut": sum(CUT in lowering.flags for lowering in self.lowerings),
            "gaps": len(lost),
            "gap_duration": float(sum(gap.duration for gap in lost)),
            "gap_fall": float(sum(max(-gap.change, 0.0) for gap in lost)),
            "gap_rise": float(sum(max(gap.change, 0.0) for gap in lost)),
            "travel": unknown,
            "hook_work": unknown,
        }

    @property
    def lost(self) -> tuple[str, ...]:
        """What gaps leave unknown, in words; empty without gaps."""
        if not self.gaps:
            return ()
        out = self.left_out
        whole = _long(sum(gap.duration for gap in self.gaps))
        opening = f"gaps in the log: {len(self.gaps)}, {whole} in all"
        if not out["gaps"]:
            return (
                f"{opening}; after each of them the block is where it was: taken as a rest",
            )
        ways = {"fall": "lower", "rise": "higher"}
        moved = [
            f"{number(x, 'm', count=3)} {word}"
            for way, word in ways.items()
            if (x := out[f"gap_{way}"])
        ]
        cut = (
            f", and of {out['cut']} pieces of lowerings that they cut"
            if out["cut"]
            else ""
        )
        where = f"after which the block is {' and '.join(moved)} in all"
        return (
            f"{opening}; unknown, and in no total: travel and energy in {out['gaps']} of "
            f"them, {where}{cut}",
        )

    @property
    def gap_table(self) -> Table:
        """A row for each gap."""
        columns = [*map(column_of, ("start", "begin", "duration", "change"))]
        return Table(
            [*columns, Column("cut", heading="lowerings cut"), Column("rest")],
            self.gaps,
            "gaps",
        )

    @property
    def basis(self) -> tuple[str, ...]:
        """Load without string, thresholds, and what the intervals are from, in
        words."""
        limits = ", ".join(
            f"{name} = {'by the log' if x is None else x}"
            for name, x in self.thresholds.items()
        )
        return (
            self._level,
            f"thresholds: {limits}",
            f"interval of the work by {self.interval_by}",
        )

    @property
    def _level(self) -> str:
        if self.tare is None:
            return "load without string: unknown, the block is nowhere at rest"
        value, low, high = (number(x, "N", count=4) for x in self.tare)
        unsure = ""
        if not self.decidable:
            unsure = "; no second level: it may contain a light string"
        return f"load without string: {value} ({low} to {high}){unsure}"

    @property
    def _shares(self) -> str:
        words = (
            f"{name} {100 * x:.0f} %"
            for name, x in self._share_by_state.items()
            if x > 0
        )
        return f"rows: {', '.join(words)}"

    @property
    def _share_by_state(self) -> dict[str, float]:
        share = np.bincount(self.state, minlength=len(STATES)) / max(self.state.size, 1)
        return dict(zip(STATES, share.tolist(), strict=True))

    @property
    def table(self) -> Table:
        """A row for each lowering."""
        return Table(
            map(column_of, COLUMNS), (vars(lowering) for lowering in self.lowerings)
        )

    def as_dict(self) -> dict[str, Any]:
        """Lowerings with totals, thresholds and states as shares; SI units."""
        return plain(
            {
                "source": self.log.source,
                "start": self.log.start,
                "lowerings": self.table,
                "totals": {
                    name: sum(getattr(lowering, name) for lowering in self.valid)
                    for name in ("travel", *_WORKS)
                },
                "gaps": self.gap_table,
                "left_out": self.left_out,
                "tare": self.tare,
                "decidable": self.decidable,
                "states": self._share_by_state,
                "interval_by": self.interval_by,
                "thresholds": self.thresholds,
                "notes": self.notes,
                "guesses": self.log.guesses,
            }
        )


def counted(lowerings: int) -> str:
    return f"{lowerings} lowering" + ("" if lowerings == 1 else "s")


def in_seconds(start: str) -> str:
    """A time in ISO 8601 without what is after its seconds."""
    return start[:19].replace("T", " ")


def column_of(name: str) -> Column:
    """The column of a quantity of a lowering, a gap, the drum or a replay, by its
    name."""
    if name in _UNITS:
        return Column(
            name, _UNITS[name], show=_SHOWN.get(name, ".4g"), hidden=name == "height"
        )
    words = {"start": in_seconds, "flags": ", ".join}
    return Column(name, show=words.get(name, str), left=True)


#: columns of a lowering
COLUMNS = [field.name for field in dataclasses.fields(Lowering)]


def _long(seconds: float) -> str:
    """A time in words."""
    if seconds < 3600.0:
        return f"{digits(seconds, 3)} s"
    return f"{digits(seconds / 3600.0, 3)} h"
