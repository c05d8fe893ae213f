"""States of the block and lowerings in a rig's log, by the updates of its height, and
the work of the hook in them."""

import dataclasses
from collections.abc import Iterator, Mapping
from datetime import datetime, timedelta
from typing import Any, NamedTuple

import numpy as np

from .._base._faults import Issues, input_error
from .._base._numbers import digits, number
from .._base._table import Column, Table, Tabular, frozen, plain
from ._log import Channel, Log

#: of the block in a row of the log
STATES = ("no data", "down", "up", "at rest", "in slips", "set down", "slack")
#: of the load on the hook
LOADS = ("not decidable", "block", "string")
#: share of the rows that makes a level of loads, width of a class of loads, ratio of
#: two levels
_SHARE = 0.03
_CLASS = 0.01
_APART = 1.25
#: share of a lowering in one update that makes it a jump
_SINGLE = 0.9
#: change of speed from one update to the next (m/s^2) that no block makes in a steady
#: motion
_SUDDEN = 0.25
#: correlation of the load with the acceleration of the block that shows how late it is
_ALIKE = 0.6
#: SI units of the thresholds of `lowerings` that are numbers
THRESHOLDS = {
    **dict.fromkeys(("pause", "spacing"), "s"),
    **dict.fromkeys(("heave", "travel", "jump", "floor"), "m"),
    **dict.fromkeys(("end_speed", "fastest"), "m/s"),
    **dict.fromkeys(("alone", "string", "slack", "set_down"), "1"),
}
#: SI unit → quantities in it; how a number is shown where four digits are too few or
#: too many
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
_SHOWN = {"begin": ".6g", "height": ".6g", "top_speed": ".3g", "change": "+.3g"}
#: flag of a lowering that goes on in a gap
_CUT = "cut by a gap"
#: update interval (s) above which no lowering can be followed
_SLOWEST = 15.0


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
    - `change`: of the height of the block over it, negative where the block is lower
      after it
    - `cut`: number of lowerings that go on in it
    - `rest`: whether the block is where it was, and nothing is cut
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

    - `gaps`: times without heights; what the block does in those that are no rest is
      unknown, and in no total
    - `state`, `load` (n,): places in `simbrake.rig.STATES` and `LOADS` of each row of
      the log
    - `tare`: what the hook load shows without a string (block, top drive and the zero
      of the gauge), `None` if unknown
    - `decidable`: whether a second, heavier level tells string and block apart
    - `interval_by`: what the intervals of the work are from
    - `thresholds`: the arguments
    - `notes`: to be read
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
        kinds = [
            f"{kind}: {sum(lowering.kind == kind for lowering in self.valid)}"
            for kind in reversed(LOADS)
        ]
        yield f"load {', '.join(kinds)}"
        yield self.table
        yield from [self.gap_table] if self.gaps else []
        yield self._shares
        yield from self.basis
        yield from (f"- {note}" for note in self.notes)

    @property
    def left_out(self) -> dict[str, Any]:
        """What no total has: flagged lowerings, those of them that gaps cut, gaps that
        are no rest, with their time (s) and by what the block is lower or higher after
        them (m); its travel and work, `None` where it is unknown."""
        lost = [gap for gap in self.gaps if not gap.rest]
        flagged = len(self) - len(self.valid)
        unknown = None if lost or flagged else 0.0
        return {
            "flagged": flagged,
            "cut": sum(_CUT in lowering.flags for lowering in self.lowerings),
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
        opening = (
            f"gaps in the log: {len(self.gaps)}, "
            f"{_long(sum(gap.duration for gap in self.gaps))} in all"
        )
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
        unsure = (
            "" if self.decidable else "; no second level: it may contain a light string"
        )
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
    return (
        f"{digits(seconds, 3)} s"
        if seconds < 3600.0
        else f"{digits(seconds / 3600.0, 3)} h"
    )


_WORKS = ("hook_work", "hook_work_low", "hook_work_high")


class Course(NamedTuple):
    """A channel as a line through its updates: `value` (k,) at `t` (k,), and the time
    (s) between two of them."""

    t: np.ndarray
    value: np.ndarray
    interval: float

    def at(self, t: np.ndarray) -> np.ndarray:
        return np.interp(t, self.t, self.value)


def course_of(channel: Channel, spacing: float = 0.0) -> Course:
    """The line through the updates of a channel, held values left out, at least
    `spacing` (s) apart.

    A value that did not change for longer than its interval began to change, on
    average, half an interval before the row that shows it: the last row before that
    time still has it.
    """
    t = channel.t
    x = channel.value
    rows = np.flatnonzero(~np.isnan(x))
    interval = float(np.median(np.diff(t[rows]))) if rows.size > 1 else 0.0
    if channel.held:
        interval = channel.interval
        updates = channel.updates
        before = rows[
            np.searchsorted(t[rows], t[updates[1:]] - 0.5 * interval, side="right") - 1
        ]
        long = t[updates[1:]] - t[updates[:-1]] > 1.5 * interval
        rows = np.union1d(np.union1d(updates, before[long]), rows[-1:])
    elif spacing > interval > 0.0:
        # the first row of each `spacing`
        number = np.floor((t[rows] - t[rows[0]]) / spacing + 1e-9)
        rows = rows[np.append(True, np.diff(number) > 0)]
        interval = spacing
    return Course(t[rows], x[rows], interval)


def lowerings(
    log: Log,
    *,
    pause: float = 15.0,
    heave: float = 0.3,
    end_speed: float = 0.05,
    travel: float = 2.0,
    jump: float = 3.0,
    floor: float = -1.0,
    fastest: float = 5.0,
    spacing: float = 1.0,
    tare: tuple[float, float] | None = None,
    alone: float = 1.1,
    string: float = 1.25,
    slack: float = 0.7,
    set_down: float = 0.8,
) -> Lowerings:
    """Lowerings of a log by the updates of its height, with the work of the hook
    `W = ∫F dx` in each.

        W = Σ ½ (F_i + F_{i+1}) (h_i − h_{i+1})    over the distinct updates of height and load

    Thresholds, which are printed with the result:

    - a motion ends after a `pause` (s) below `end_speed` (m/s), steps of a slow height
      such as in drilling included, or after more than `heave` (m) upwards; its ends are
      cut where it is slower than `end_speed`; at least `travel` (m) is a lowering
    - flags: more than `jump` (m) and nine tenths of the travel in a single update, or
      beyond two steady updates on each side of it (by 0.25 m/s² at least), faster than
      `fastest` (m/s), heights below `floor` (m), a load that is missing, a gap that
      cuts it: these lowerings are listed and left out of totals
    - `spacing`: heights are taken at least so far apart (s), as differences of frequent
      readings are noise
    - `tare`: lowest and highest load (N) without string; by default the lowest level of
      the load at rest at which the block also moves
    - loads up to `alone` times it are the block's, from `string` times it a string's;
      without a second level at rest neither is decidable. Below `slack` times it the
      hook is slack; a string at rest below `set_down` of its load in the motion before
      is set down

    Gaps: times without heights, longer than a `pause` and two and a half updates, are
    in `Lowerings.gaps`, with the change of the height over them. A lowering that goes
    on in one is flagged. A gap over which the height changes by `heave` at most, and
    which cuts nothing, is a rest.

    Intervals of the work: where the log has lowest and highest loads, `Σ min F Δh` and
    `Σ max F Δh`, bounds; else the spread of the quadratures, of which 90 % hold the
    work: load and height may differ by half an interval of each, readings between the
    updates scatter as their second differences do (Student's t), the height has steps,
    and the cut of the ends leaves something out.

    Raises `InputError` where the height is updated too rarely, and where nothing is
    lowered, in gaps neither.

    Example:
        >>> import pathlib, tempfile
        >>> t = np.arange(0.0, 120.0, 2.0)
        >>> height = 30.0 - np.clip(t - 40.0, 0.0, 20.0)
        >>> rows = [f"{a},{b},500\\n" for a, b in zip(t, height)]
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     file = pathlib.Path(folder, "rig.csv")
        ...     _ = file.write_text("Time,BPOS,HKLD\\ns,m,kN\\n" + "".join(rows))
        ...     (lowering,) = sb.rig.lowerings(sb.rig.read(file)).lowerings
        >>> lowering.travel, lowering.hook_work / 1e6
        (20.0, 10.0)
    """
    thresholds = {name: value for name, value in locals().items() if name != "log"}
    faults = faults_of_thresholds(thresholds)
    position = log.position
    if log.interval > _SLOWEST or position.interval > _SLOWEST:
        rate = digits(max(log.interval, position.interval if position.held else 0.0), 3)
        what = f"is updated each {rate} s: lowerings cannot be followed above {_SLOWEST:g} s"
        faults.add(
            f"{log.source} column {position.mnemonic}",
            what,
            "give a recording over time",
        )
    faults.report()
    height = course_of(position, spacing)
    load = course_of(log["hook_load"])
    if np.ptp(height.value) < travel:
        what = (
            f"stays within {digits(np.ptp(height.value), 3)} m: nothing is lowered "
            f"by {travel:g} m"
        )
        raise input_error(
            f"{log.source} column {position.mnemonic}",
            what,
            "is it the height of the block?",
        )
    return _Finder(log, height, load, thresholds).result()


def faults_of_thresholds(thresholds: Mapping[str, Any]) -> Issues:
    """Errors of arguments of `lowerings`."""
    faults = Issues()
    for name, x in thresholds.items():
        if name not in ("floor", "tare") and not (np.isfinite(x) and x > 0):
            faults.add(name, f"{x} is not a positive number", f"in {THRESHOLDS[name]}")
    tare = thresholds.get("tare")
    if tare is not None and not 0 < tare[0] <= tare[1]:
        faults.add(
            "tare",
            f"{tare} is no interval of loads",
            "lowest and highest load without string, N",
        )
    return faults


def spans_of(
    found: Lowerings, height: Course, load: Course
) -> tuple[list[tuple[int, int]], list[tuple[int, int]]]:
    """First and last knots of the height in each of its motions: those downwards, of
    which `found` is, and upwards."""
    turned = height._replace(value=-height.value)
    down, up = (
        _Finder(found.log, x, load, found.thresholds)._spans() for x in (height, turned)
    )
    return down, up


class _Finder:
    """Height and load of a log as lines, cut into motions."""

    def __init__(
        self, log: Log, height: Course, load: Course, thresholds: dict[str, Any]
    ) -> None:
        self.log = log
        self.height = height
        self.load = load
        self.limits = thresholds
        step = np.diff(height.t)
        self.fall = -np.diff(height.value)
        self.speed = self.fall / step
        #: speeds between two updates; a knot before an update is where the motion
        #: began, on average
        channel = log.position
        updated = np.isin(
            height.t, channel.t[channel.updates] if channel.held else height.t
        )
        # an update comes up to a row late: a short interval is the mean one
        row = log.interval
        known = updated[1:] & updated[:-1]
        self.lasted = np.where(known, np.clip(channel.period, step, step + row), step)
        self.mean_speed = self.fall / self.lasted
        self.between = np.where(known, self.mean_speed, -np.inf)
        #: times (g, 2) and heights (g, 2) at the ends of the times without heights
        known = ~np.isnan(channel.value)
        times = channel.t[known]
        values = channel.value[known]
        longest = max(thresholds["pause"], 2.5 * height.interval, 2.5 * row)
        i = np.flatnonzero(np.diff(times) > longest)
        self.gap_times = np.stack([times[i], times[i + 1]], axis=1)
        self.gap_heights = np.stack([values[i], values[i + 1]], axis=1)
        #: no height was recorded there
        self.blind = np.zeros(step.size, bool)
        self.blind[np.searchsorted(height.t, times[i], side="right") - 1] = True
        self.notes: list[str] = []
        #: highest load of the block alone, lowest of a string; no load is one of the
        #: two where they are not decidable
        self.heavy = -np.inf, np.inf

    def result(self) -> Lowerings:
        tare, decidable = self._tare()
        spans = self._spans()
        works = _Works(self.log, self.height, self.load)
        limits = self.limits
        if tare is not None and decidable:
            self.heavy = limits["alone"] * tare.high, limits["string"] * tare.high
        cuts = self._cuts(spans)
        found = [
            self._lowering(works, a, b, cut=cut)
            for (a, b), cut in zip(spans, np.any(cuts, axis=0).tolist(), strict=True)
        ]
        gaps = tuple(self._gaps(cuts.sum(axis=1)))
        if not found and not any(gap.change <= -limits["travel"] for gap in gaps):
            what = f"nothing is lowered by {limits['travel']:g} m"
            raise input_error(
                f"{self.log.source} column {self.log.position.mnemonic}",
                what,
                "does it count upwards?",
            )
        self._clocks(spans)
        state, load = self._states(tare)
        return Lowerings(
            self.log,
            tuple(found),
            gaps,
            state,
            load,
            tare,
            decidable,
            works.interval_by,
            limits,
            tuple(self.notes),
        )

    def _clocks(self, spans: list[tuple[int, int]]) -> None:
        """Note a load that shows the acceleration of the block, `F = m (g − a)`,
        earlier or later than the height."""
        lags = np.arange(-10.0, 10.1, 0.5)
        both = np.zeros(lags.size)
        loads = np.zeros(lags.size)
        rates = 0.0
        long = [(a, b) for a, b in spans if b - a > 4]
        for a, b in long:
            t = self.height.t[a : b + 1]
            v = self.mean_speed[a:b]
            rate = np.diff(v, prepend=v[0]) / np.diff(t)
            rate -= rate.mean()
            load = self.load.at(t[:-1] + lags[:, None])
            usual = np.maximum(np.median(load, axis=1, keepdims=True), 1.0)
            # what is picked up or set down is more
            load = np.clip(load / usual, 0.9, 1.1)
            load -= load.mean(axis=1, keepdims=True)
            both = both - load @ rate
            loads = loads + (load**2).sum(axis=1)
            rates = rates + rate @ rate
        alike = both / np.sqrt(np.maximum(loads * rates, 1e-12))
        lag = lags[alike.argmax()]
        late = 0.5 * (self.height.interval + self.load.interval)
        if (
            len(long) > 2
            and late < abs(lag) < lags[-1]
            and alike.max() > max(_ALIKE, 2.0 * alike[lags == 0.0][0])
        ):
            when = f"{abs(lag):g} s {'later' if lag > 0 else 'earlier'}"
            self.notes.append(
                f"the load shows starts and stops of the block about {when} than the "
                "height does, outside of the "
                f"intervals of the work: where their clocks differ, offset={lag:g} "
                "brings them together"
            )

    def _cuts(self, spans: list[tuple[int, int]]) -> np.ndarray:
        """Whether gaps (g) cut motions (k): the block moves at the edge of one, and is
        elsewhere at the other edge."""
        height = self.height
        held = self.log.position.held
        # a height that is held may move unseen for so long
        late = height.interval + self.log.interval if held else 0.0
        a, b = np.array(spans, int).reshape(-1, 2).T
        (begin, end) = self.gap_times.T[:, :, None]
        (before, after) = self.gap_heights.T[:, :, None]
        last = np.searchsorted(height.t, begin, side="right") - 1
        first = np.searchsorted(height.t, end, side="left")
        into = (b == last) | ((b < last) & (begin - height.t[b] < late))
        from_ = (a == first) | ((a > first) & (height.t[a] - end < late))
        room = self.limits["heave"]
        into &= np.abs(after - height.value[b]) > room
        return into | (from_ & (np.abs(before - height.value[a]) > room))

    def _gaps(self, cut: np.ndarray) -> Iterator[Gap]:
        """Times without heights, with the number of lowerings that each of them
        cuts."""
        edges = self.gap_times.tolist(), self.gap_heights.tolist()
        for (begin, end), (before, after), count in zip(
            *edges, cut.tolist(), strict=True
        ):
            change = after - before
            rest = not count and abs(change) <= self.limits["heave"]
            yield Gap(_start(self.log, begin), begin, end - begin, change, count, rest)

    def _spans(self) -> list[tuple[int, int]]:
        """First and last knot of each motion downwards."""
        pause, heave, slow = (
            self.limits[name] for name in ("pause", "heave", "end_speed")
        )
        step = np.diff(self.height.t)
        spans: list[tuple[int, int]] = []
        begin = -1
        rested = 0.0
        lowest = 0.0
        left = 0.0
        for k, (v, dt) in enumerate(
            zip(self.speed.tolist(), step.tolist(), strict=True)
        ):
            below = self.height.value[k + 1]
            if begin < 0:
                if v >= slow and not self.blind[k]:
                    begin = k
                    rested = 0.0
                    lowest = below
                    left = below
                    last = k + 1
                continue
            rested += dt
            # a step of a coarse height is no speed: as fast on the whole since the last
            # motion
            moves = v >= slow and left - below >= slow * rested
            if self.blind[k] or (rested > pause and v < slow) or below - lowest > heave:
                spans.append((begin, last))
                begin = -1
                continue
            if moves:
                rested = 0.0
                left = below
                if below <= max(lowest, self.height.value[last]):
                    last = k + 1
            lowest = min(lowest, below)
        if begin >= 0:
            spans.append((begin, last))
        drop = self.height.value
        return [(a, b) for a, b in spans if drop[a] - drop[b] >= self.limits["travel"]]

    def _lowering(self, works: "_Works", a: int, b: int, *, cut: bool) -> Lowering:
        t = self.height.t[a : b + 1]
        h = self.height.value[a : b + 1]
        begin, end = t[[0, -1]].tolist()
        top, bottom = h[[0, -1]].tolist()
        travel = top - bottom
        work, low, high = works.between(a, b)
        flags = [_CUT] if cut else []
        speed = self.mean_speed[a:b]
        if self.fall[a:b].max() > max(self.limits["jump"], _SINGLE * travel):
            flags.append("single update")
        elif self._jumps(speed, self.lasted[a:b]):
            flags.append("jump")
        if speed.max() > self.limits["fastest"]:
            flags.append("too fast")
        if h.min() < self.limits["floor"]:
            flags.append("below floor")
        if not np.isfinite(work):
            flags.append("load missing")
        mean = work / travel
        middle = [
            np.interp(-x, -np.minimum.accumulate(h), t)
            for x in (top - 0.25 * travel, top - 0.75 * travel)
        ]
        quiet = self.load.value[slice(*np.searchsorted(self.load.t, middle))]
        static = (
            float(np.median(quiet))
            if quiet.size
            else float(self.load.at(np.array(0.5 * sum(middle))))
        )
        return Lowering(
            start=_start(self.log, begin),
            begin=begin,
            duration=end - begin,
            height=top,
            travel=travel,
            top_speed=float(max(self.between[a:b].max(), travel / (end - begin))),
            mean_load=mean,
            static_load=static,
            hook_work=work,
            hook_work_low=low,
            hook_work_high=high,
            kind=LOADS[self._kind(mean)],
            flags=tuple(flags),
            activity=self._activity(begin, end),
        )

    def _jumps(self, speed: np.ndarray, lasted: np.ndarray) -> bool:
        """Whether an update is out of line with two steady ones on each side, by more
        than a jump."""
        if speed.size < 5:
            return False
        beside = np.stack([speed[:-4], speed[1:-3], speed[3:-1], speed[4:]])
        most = beside.max(0)
        spread = np.ptp(beside, 0)
        time = lasted[2:-2]
        least = np.maximum(
            np.maximum(self.limits["jump"] / time, _SUDDEN * time), 2.0 * spread
        )
        return bool(np.any(speed[2:-2] - most > least))

    def _activity(self, begin: float, end: float) -> str:
        """The log's own code that most rows of a span have."""
        channel = self.log.channels.get("activity")
        if channel is None:
            return ""
        codes = channel.value[slice(*np.searchsorted(self.log.t, (begin, end)))]
        codes = codes[~np.isnan(codes)]
        if not codes.size:
            return ""
        values, counts = np.unique(codes, return_counts=True)
        code = values[counts.argmax()]
        return channel.words[int(code)] if channel.words else f"{code:g}"

    def _kind(self, load: np.ndarray | float) -> Any:
        """Places in `LOADS`."""
        return np.select([load <= self.heavy[0], load >= self.heavy[1]], [1, 2], 0)

    # --- loads -----------------------------------------------------------------------

    def _rates(self) -> np.ndarray:
        """Speed downwards in each row of the log; NaN where no height was recorded."""
        piece = np.clip(
            np.searchsorted(self.height.t, self.log.t, side="left") - 1,
            0,
            self.speed.size - 1,
        )
        return np.where(self.blind[piece], np.nan, self.speed[piece])

    def _tare(self) -> tuple[Level | None, bool]:
        """Load without string, and whether there is a heavier level beside it."""
        limit = self.limits["tare"]
        if limit is not None:
            return Level(0.5 * (limit[0] + limit[1]), limit[0], limit[1]), True
        rate = np.abs(self._rates())
        slow = self.limits["end_speed"]
        every = self.load.at(self.log.t)
        load = every[rate < slow]
        moved = every[rate >= slow]
        load = load[load > 0.05 * np.max(load, initial=0.0)]
        if load.size < 10:
            return None, False
        classes = np.floor(np.log(load) / _CLASS).astype(int)
        count = np.bincount(classes - classes.min()).astype(float)
        wide = np.convolve(count, np.ones(5), "same")
        least = _SHARE * load.size
        peaks = [
            i
            for i in range(wide.size)
            if wide[i] >= least and wide[i] == wide[max(0, i - 3) : i + 4].max()
        ]
        if not peaks:
            return None, False
        loads = [np.exp((i + classes.min() + 0.5) * _CLASS) for i in peaks]
        # a slack hook is not moved: the block's level is one of the loads in motion
        near = [
            np.sum(np.abs(moved - x) < 0.1 * x) >= _SHARE * moved.size for x in loads
        ]
        low = high = peak = peaks[near.index(True) if any(near) else 0]
        while low > 0 and wide[low - 1] > 0.1 * wide[peak]:
            low -= 1
        while high < wide.size - 1 and wide[high + 1] > 0.1 * wide[peak]:
            high += 1
        inside = load[
            (classes - classes.min() >= low) & (classes - classes.min() <= high)
        ]
        level = Level(*np.quantile(inside, (0.5, 0.05, 0.95)).tolist())
        heavier = every > _APART * level.high
        return level, bool(heavier.mean() >= _SHARE)

    def _states(self, tare: Level | None) -> tuple[np.ndarray, np.ndarray]:
        """State of the block and class of the load in each row of the log."""
        rate = self._rates()
        slow = self.limits["end_speed"]
        channel = self.log["hook_load"]
        x = self.load.at(self.log.t)
        load = self._kind(x)
        state = np.select(
            [np.isnan(rate) | np.isnan(channel.value), rate >= slow, rate <= -slow],
            [0, 1, 2],
            3,
        )
        if tare is None:
            return state, load
        rest = state == 3
        is_slack = x < self.limits["slack"] * tare.low
        moving = np.isin(state, (1, 2)) & (load == 2)
        last = np.maximum.accumulate(np.where(moving, np.arange(x.size), -1))
        before = np.where(last >= 0, _mean_of_runs(moving, x)[last], -np.inf)
        lighter = x < self.limits["set_down"] * before
        return np.select(
            [rest & is_slack, rest & (load == 1), rest & lighter], [6, 4, 5], state
        ), load


def _start(log: Log, t: float) -> str | None:
    """Time in ISO 8601 of `t` seconds after the first row."""
    if log.start is None:
        return None
    at = datetime.fromisoformat(log.start) + timedelta(seconds=t)
    return at.isoformat().replace("+00:00", "Z")


def _mean_of_runs(inside: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Mean of `x` (n,) over the run of true values that each place belongs to."""
    run = np.cumsum(np.diff(inside, prepend=False) & inside) * inside
    total = np.bincount(run, np.where(inside, x, 0.0))
    count = np.bincount(run)
    return (total / np.maximum(count, 1))[run]


class _Works:
    """Work of the hook between two knots of the height, with its interval, by sums from
    the begin of the log."""

    def __init__(self, log: Log, height: Course, load: Course) -> None:
        self.log = log
        self.height = height
        self.load = load
        heights = np.round(height.value, 6)
        apart = np.diff(np.unique(heights))
        moves = np.count_nonzero(np.diff(heights))
        #: of a height that is written coarsely, so that the block comes to the same
        #: ones again and again; 0.7 of it is the 90 % of the two ends of a lowering
        self.step = float(apart.min()) if 0 < 3 * apart.size < moves else 0.0
        self.sums = self._cumulative(0.0)
        late = 0.5 * (height.interval + load.interval)
        self.shifted = [self._cumulative(x) for x in (-late, late)]
        channel = log["hook_load"]
        self.read = channel.t[~np.isnan(channel.value)]
        low, high = (log.channels.get(f"hook_load_{end}") for end in ("min", "max"))
        self.bounds = None
        if (
            low is not None
            and high is not None
            and not (np.isnan(low.value).all() or np.isnan(high.value).all())
        ):
            self.bounds = self._bounds(low, high)
        self.interval_by = (
            "lowest and highest loads, bounds"
            if self.bounds
            else "the spread of quadratures, 90 %"
        )

    def _cumulative(self, shift: float) -> np.ndarray:
        """`∫F dx` from the first knot to each one, with the load `shift` s later."""
        knots = self.height.t
        times = self.load.t + shift
        grid = np.union1d(knots, times[(times > knots[0]) & (times < knots[-1])])
        x = self.height.at(grid)
        f = np.interp(grid, times, self.load.value)
        work = np.append(0.0, np.cumsum(-0.5 * (f[1:] + f[:-1]) * np.diff(x)))
        return work[np.searchsorted(grid, knots)]

    def _bounds(self, low: Channel, high: Channel) -> tuple[np.ndarray, np.ndarray]:
        """`Σ min F Δh` and `Σ max F Δh` from the first knot to each one; upwards the
        bounds change places."""
        fall = -np.diff(self.height.value)
        first = np.searchsorted(low.t, self.height.t[:-1], side="left")
        last = np.searchsorted(low.t, self.height.t[1:], side="right")
        last = np.maximum(last, first + 1)
        rows = np.stack([first, last], axis=1).ravel().clip(0, low.t.size)
        low_x = np.append(np.where(np.isnan(low.value), np.inf, low.value), np.inf)
        high_x = np.append(np.where(np.isnan(high.value), -np.inf, high.value), -np.inf)
        least = np.minimum.reduceat(low_x, rows)[::2]
        most = np.maximum.reduceat(high_x, rows)[::2]
        ends = [np.where(np.isfinite(x), x, np.nan) * fall for x in (least, most)]
        ends = [np.minimum(*ends), np.maximum(*ends)]
        return tuple(np.append(0.0, np.cumsum(np.nan_to_num(x))) for x in ends)  # pyright: ignore

    def between(self, a: int, b: int) -> tuple[float, float, float]:
        """Work between two knots, and its interval."""
        begin, end = self.height.t[[a, b]]
        work = float(self.sums[b] - self.sums[a])
        first = np.searchsorted(self.read, begin, side="right")
        last = np.searchsorted(self.read, end)
        around = self.read[max(first - 1, 0) : last + 1]
        longest = max(
            np.max(np.diff(around), initial=0.0), around[0] - begin, end - around[-1]
        )
        if longest > max(_SLOWEST, 3.0 * self.load.interval):
            return np.nan, np.nan, np.nan
        if self.bounds is not None:
            low, high = (float(x[b] - x[a]) for x in self.bounds)
            return work, min(low, work), max(high, work)
        timing = max(abs(x[b] - x[a] - work) for x in self.shifted)
        # what the cut of the ends leaves out
        first, top, bottom, last = self.height.value[
            [max(a - 1, 0), a, b, min(b + 1, self.height.t.size - 1)]
        ]
        travel = top - bottom
        ends = abs(work) * ((abs(top - first) + abs(last - bottom)) / travel)
        steps = 0.7 * self.step * abs(work) / travel
        half = float(np.sqrt(timing**2 + ends**2 + steps**2 + self._scatter(a, b) ** 2))
        return work, work - half, work + half

    def _scatter(self, a: int, b: int) -> float:
        """Error of the work (90 %) by the scatter of the readings of the load around
        the line between them."""
        from scipy.special import stdtrit

        t = self.load.t
        i, j = np.searchsorted(t, (self.height.t[a], self.height.t[b]))
        if j - i < 3:
            i = max(i - 1, 0)
            j = min(j + 1, t.size)
        t = t[i:j]
        f = self.load.value[i:j]
        if t.size < 3:
            return 0.0
        share = (t[1:-1] - t[:-2]) / (t[2:] - t[:-2])
        off = f[1:-1] - (1 - share) * f[:-2] - share * f[2:]
        spread = np.sqrt(np.mean(off**2 / (1 + share**2 + (1 - share) ** 2)))
        middle = np.concatenate([t[:1], 0.5 * (t[1:] + t[:-1]), t[-1:]]).clip(
            self.height.t[a], self.height.t[b]
        )
        weight = np.diff(self.height.at(middle))
        return float(stdtrit(f.size - 2, 0.95) * spread * np.sqrt(np.sum(weight**2)))
