"""Finds lowerings and states of the block in a rig's log, by the updates of its
height."""

from collections.abc import Iterator, Mapping
from datetime import datetime, timedelta
from typing import Any

import numpy as np

from .._base._faults import Issues, input_error
from .._base._numbers import digits
from ._found import CUT, LOADS, Gap, Level, Lowering, Lowerings
from ._log import Log
from ._works import SLOWEST, Course, Works, course_of

#: levels of the load: least share of the rows in a level, width of a class of loads
#: (share of the load), least ratio of two levels
_SHARE = 0.03
_CLASS = 0.01
_APART = 1.25
#: share of a lowering from which a single update is a jump
_SINGLE = 0.9
#: change of speed from one update to the next (m/s^2) that no block makes in a steady
#: motion
_SUDDEN = 0.25
#: least correlation of the load with the acceleration of the block that shows a delay
_ALIKE = 0.6
#: SI units of the thresholds of `lowerings` that are numbers
THRESHOLDS = {
    **dict.fromkeys(("pause", "spacing"), "s"),
    **dict.fromkeys(("heave", "travel", "jump", "floor"), "m"),
    **dict.fromkeys(("end_speed", "fastest"), "m/s"),
    **dict.fromkeys(("alone", "string", "slack", "set_down"), "1"),
}


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

    - a motion ends after a `pause` (s) below `end_speed` (m/s), as does the slow motion
      of drilling, whose height moves in steps, or after more than `heave` (m) upwards;
      its ends are cut where it is slower than `end_speed`; from `travel` (m) on it is a
      lowering
    - flags: more than `jump` (m) and nine tenths of the travel in a single update, or a
      speed that differs by as much from two steady updates on each side (by 0.25 m/s²
      at least), faster than `fastest` (m/s), heights below `floor` (m), a missing load,
      a gap that cuts the lowering. Flagged lowerings are listed and left out of totals
    - `spacing`: heights are taken at least so far apart (s), as differences of frequent
      readings are noise
    - `tare`: lowest and highest load (N) without string; by default the lowest level of
      the load at rest at which the block also moves
    - loads up to `alone` times the tare are the block's, from `string` times the tare a
      string's; without a second level at rest they are not decidable. Below `slack`
      times the tare the hook is slack; a string at rest below `set_down` of its load in
      the motion before is set down

    Gaps: times without heights, longer than a `pause` and two and a half updates, are
    in `Lowerings.gaps`, with the change of the height over them. A lowering that goes
    on in a gap is flagged. A gap over which the height changes by `heave` at most, and
    which cuts nothing, is a rest.

    Intervals of the work: where the log has lowest and highest loads they are the
    bounds `Σ min F Δh` and `Σ max F Δh`; else the spread of quadratures, which holds the
    work in 90 % of cases: load and height may differ by half an interval of each,
    readings between the updates scatter as their second differences do (Student's t),
    the height has steps, and the cut of the ends leaves something out.

    Raises `InputError` where the height is updated too rarely, and where nothing is
    lowered, not even in gaps.

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
    column = f"{log.source} column {position.mnemonic}"
    if log.interval > SLOWEST or position.interval > SLOWEST:
        rate = digits(max(log.interval, position.interval if position.held else 0.0), 3)
        what = f"is updated each {rate} s: lowerings cannot be followed above {SLOWEST:g} s"
        faults.add(column, what, "give a recording over time")
    faults.report()
    height = course_of(position, spacing)
    load = course_of(log["hook_load"])
    if np.ptp(height.value) < travel:
        stays = f"stays within {digits(np.ptp(height.value), 3)} m"
        what = f"{stays}: nothing is lowered by {travel:g} m"
        raise input_error(column, what, "is it the height of the block?")
    return _Finder(log, height, load, thresholds).result()


def faults_of_thresholds(thresholds: Mapping[str, Any]) -> Issues:
    """Errors of arguments of `lowerings`."""
    faults = Issues()
    for name, x in thresholds.items():
        if name not in ("floor", "tare") and not (np.isfinite(x) and x > 0):
            faults.add(name, f"{x} is not a positive number", f"in {THRESHOLDS[name]}")
    tare = thresholds.get("tare")
    if tare is not None and not 0 < tare[0] <= tare[1]:
        hint = "lowest and highest load without string, N"
        faults.add("tare", f"{tare} is no interval of loads", hint)
    return faults


def spans_of(
    found: Lowerings, height: Course, load: Course
) -> tuple[list[tuple[int, int]], list[tuple[int, int]]]:
    """First and last knots of the height in each motion downwards, the lowerings of
    `found`, and in each motion upwards."""
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
        channel = log.position
        updated = np.isin(
            height.t, channel.t[channel.updates] if channel.held else height.t
        )
        # the other knots are where a motion began on average (`course_of`)
        both = updated[1:] & updated[:-1]
        # an update comes up to a row late: a shorter time than usual lasted the mean
        row = log.interval
        self.lasted = np.where(both, np.clip(channel.period, step, step + row), step)
        self.mean_speed = self.fall / self.lasted
        #: mean speed where it is known: between two updates
        self.between = np.where(both, self.mean_speed, -np.inf)
        #: times (g, 2) and heights (g, 2) at the ends of the times without heights
        recorded = ~np.isnan(channel.value)
        times = channel.t[recorded]
        values = channel.value[recorded]
        longest = max(thresholds["pause"], 2.5 * height.interval, 2.5 * row)
        i = np.flatnonzero(np.diff(times) > longest)
        self.gap_times = np.stack([times[i], times[i + 1]], axis=1)
        self.gap_heights = np.stack([values[i], values[i + 1]], axis=1)
        #: whether a step is a gap, without heights
        self.blind = np.zeros(step.size, bool)
        self.blind[np.searchsorted(height.t, times[i], side="right") - 1] = True
        self.notes: list[str] = []
        #: highest load of the block alone, and lowest load of a string; no load is
        #: beyond these where the two are not decidable
        self.block_to_string = -np.inf, np.inf

    def result(self) -> Lowerings:
        tare, decidable = self._tare()
        spans = self._spans()
        works = Works(self.log, self.height, self.load)
        limits = self.limits
        if tare is not None and decidable:
            ends = limits["alone"] * tare.high, limits["string"] * tare.high
            self.block_to_string = ends
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
        """Notes where the load shows the acceleration of the block, `F = m (g − a)`,
        earlier or later than the height does."""
        lags = np.arange(-10.0, 10.1, 0.5)
        products = np.zeros(lags.size)
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
            # (a larger change is a string that is picked up or set down)
            load = np.clip(load / usual, 0.9, 1.1)
            load -= load.mean(axis=1, keepdims=True)
            products = products - load @ rate
            loads = loads + (load**2).sum(axis=1)
            rates = rates + rate @ rate
        alike = products / np.sqrt(np.maximum(loads * rates, 1e-12))
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
                "height does, outside of the intervals of the work: where their clocks "
                f"differ, offset={lag:g} brings them together"
            )

    def _cuts(self, spans: list[tuple[int, int]]) -> np.ndarray:
        """Whether gaps (g) cut motions (k), (g, k): the block moves at an edge of the
        gap, and is elsewhere at the other edge."""
        height = self.height
        held = self.log.position.held
        # how long the block may move before a held height shows it
        late = height.interval + self.log.interval if held else 0.0
        a, b = np.array(spans, int).reshape(-1, 2).T
        begin, end = self.gap_times.T[:, :, None]
        before, after = self.gap_heights.T[:, :, None]
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
        steps = np.diff(self.height.t).tolist()
        height = self.height.value
        spans: list[tuple[int, int]] = []
        begin = -1  # of the present motion, below 0 without any
        last = 0
        rested = 0.0  # time since it last moved
        rest_height = 0.0
        lowest = 0.0
        for k, (v, dt) in enumerate(zip(self.speed.tolist(), steps, strict=True)):
            below = height[k + 1]
            if begin < 0:
                if v >= slow and not self.blind[k]:
                    begin = k
                    rested = 0.0
                    lowest = rest_height = below
                    last = k + 1
                continue
            rested += dt
            if self.blind[k] or (rested > pause and v < slow) or below - lowest > heave:
                spans.append((begin, last))
                begin = -1
                continue
            # a step of a coarse height alone is no motion: the mean speed since the last
            # motion has to be as high
            if v >= slow and rest_height - below >= slow * rested:
                rested = 0.0
                rest_height = below
                if below <= max(lowest, height[last]):
                    last = k + 1
            lowest = min(lowest, below)
        if begin >= 0:
            spans.append((begin, last))
        travel = self.limits["travel"]
        return [(a, b) for a, b in spans if height[a] - height[b] >= travel]

    def _lowering(self, works: Works, a: int, b: int, *, cut: bool) -> Lowering:
        t = self.height.t[a : b + 1]
        h = self.height.value[a : b + 1]
        begin, end = t[[0, -1]].tolist()
        top, bottom = h[[0, -1]].tolist()
        travel = top - bottom
        work, low, high = works.between(a, b)
        flags = [CUT] if cut else []
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
        # begin and end of the middle half of the travel
        middle = [
            np.interp(-x, -np.minimum.accumulate(h), t)
            for x in (top - 0.25 * travel, top - 0.75 * travel)
        ]
        quiet = self.load.value[slice(*np.searchsorted(self.load.t, middle))]
        if not quiet.size:
            quiet = self.load.at(np.array(0.5 * sum(middle)))
        return Lowering(
            start=_start(self.log, begin),
            begin=begin,
            duration=end - begin,
            height=top,
            travel=travel,
            top_speed=float(max(self.between[a:b].max(), travel / (end - begin))),
            mean_load=mean,
            static_load=float(np.median(quiet)),
            hook_work=work,
            hook_work_low=low,
            hook_work_high=high,
            kind=LOADS[self._kind(mean)],
            flags=tuple(flags),
            activity=self._activity(begin, end),
        )

    def _jumps(self, speed: np.ndarray, lasted: np.ndarray) -> bool:
        """Whether an update is faster than two steady updates on each side, by more than
        a jump."""
        if speed.size < 5:
            return False
        around = np.stack([speed[:-4], speed[1:-3], speed[3:-1], speed[4:]])
        time = lasted[2:-2]
        excess = speed[2:-2] - around.max(0)
        least = np.maximum(self.limits["jump"] / time, _SUDDEN * time)
        return bool(np.any(excess > np.maximum(least, 2.0 * np.ptp(around, 0))))

    def _activity(self, begin: float, end: float) -> str:
        """The log's own activity code in most rows of a span."""
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
        block, string = self.block_to_string
        return np.select([load <= block, load >= string], [1, 2], 0)

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
        """Load without string, and whether there is a heavier level."""
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
        first = classes.min()
        classes -= first
        count = np.bincount(classes).astype(float)
        wide = np.convolve(count, np.ones(5), "same")
        least = _SHARE * load.size
        peaks = [
            i
            for i in range(wide.size)
            if wide[i] >= least and wide[i] == wide[max(0, i - 3) : i + 4].max()
        ]
        if not peaks:
            return None, False
        loads = [np.exp((i + first + 0.5) * _CLASS) for i in peaks]
        # a slack hook is not moved: the block's level is one of the loads in motion
        near = [
            np.sum(np.abs(moved - x) < 0.1 * x) >= _SHARE * moved.size for x in loads
        ]
        low = high = peak = peaks[near.index(True) if any(near) else 0]
        while low > 0 and wide[low - 1] > 0.1 * wide[peak]:
            low -= 1
        while high < wide.size - 1 and wide[high + 1] > 0.1 * wide[peak]:
            high += 1
        inside = load[(classes >= low) & (classes <= high)]
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
