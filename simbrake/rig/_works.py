"""Work of the hook between two updates of its height, with its interval."""

from typing import NamedTuple

import numpy as np

from ._log import Channel, Log

#: update interval (s) above which no lowering can be followed
SLOWEST = 15.0


class Course(NamedTuple):
    """A channel as a line through its updates: `value` (k,) at `t` (k,), and their
    usual `interval` (s)."""

    t: np.ndarray
    value: np.ndarray
    interval: float

    def at(self, t: np.ndarray) -> np.ndarray:
        return np.interp(t, self.t, self.value)


def course_of(channel: Channel, spacing: float = 0.0) -> Course:
    """The line through the updates of a channel, held values left out, at least
    `spacing` (s) apart.

    Where a value has not changed for longer than its interval, the change began on
    average half an interval before the row that shows it; the last row before that time
    is a point of the line as well.
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


class Works:
    """Work of the hook between two knots of the height, with its interval, from sums
    that run from the begin of the log."""

    def __init__(self, log: Log, height: Course, load: Course) -> None:
        self.log = log
        self.height = height
        self.load = load
        heights = np.round(height.value, 6)
        apart = np.diff(np.unique(heights))
        moves = np.count_nonzero(np.diff(heights))
        #: step (m) of a height that is written coarsely, so that the same values recur;
        #: the rounding at the two ends of a lowering is within 0.7 of it in 90 % of cases
        self.step = float(apart.min()) if 0 < 3 * apart.size < moves else 0.0
        self.sums = self._cumulative(0.0)
        late = 0.5 * (height.interval + load.interval)
        self.shifted = [self._cumulative(x) for x in (-late, late)]
        channel = log["hook_load"]
        self.read = channel.t[~np.isnan(channel.value)]
        low, high = (log.channels.get(f"hook_load_{end}") for end in ("min", "max"))
        self.bounds = None
        self.interval_by = "the spread of quadratures, 90 %"
        if (
            low is not None
            and high is not None
            and not (np.isnan(low.value).all() or np.isnan(high.value).all())
        ):
            self.bounds = self._bounds(low, high)
            self.interval_by = "lowest and highest loads, bounds"

    def _cumulative(self, shift: float) -> np.ndarray:
        """`∫F dx` from the first knot to each knot, with the load `shift` s later."""
        knots = self.height.t
        times = self.load.t + shift
        grid = np.union1d(knots, times[(times > knots[0]) & (times < knots[-1])])
        x = self.height.at(grid)
        f = np.interp(grid, times, self.load.value)
        work = np.append(0.0, np.cumsum(-0.5 * (f[1:] + f[:-1]) * np.diff(x)))
        return work[np.searchsorted(grid, knots)]

    def _bounds(self, low: Channel, high: Channel) -> tuple[np.ndarray, np.ndarray]:
        """`Σ min F Δh` and `Σ max F Δh` from the first knot to each knot; upwards the
        two change places."""
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
        if longest > max(SLOWEST, 3.0 * self.load.interval):
            return np.nan, np.nan, np.nan
        if self.bounds is not None:
            low, high = (float(x[b] - x[a]) for x in self.bounds)
            return work, min(low, work), max(high, work)
        timing = max(abs(x[b] - x[a] - work) for x in self.shifted)
        # what the cut of the ends leaves out
        before, top, bottom, after = self.height.value[
            [max(a - 1, 0), a, b, min(b + 1, self.height.t.size - 1)]
        ]
        travel = top - bottom
        ends = abs(work) * ((abs(top - before) + abs(after - bottom)) / travel)
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
