"""Progress line with the remaining time."""

import contextlib
import contextvars
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import NamedTuple, TypeAlias


def duration(seconds: float) -> str:
    """Return a time span as short text, such as `3 min 20 s`."""
    s = round(seconds)
    if s < 60:
        return f"{s} s"
    minutes, s = divmod(s, 60)
    if minutes < 60:
        return f"{minutes} min {s:02d} s"
    return f"{minutes // 60} h {minutes % 60:02d} min"


#: called with the simulated time reached and the end time (s)
Tell: TypeAlias = Callable[[float, float], object]


class Line:
    """One line on stderr, overwritten in place on a terminal; elsewhere nothing is printed unless `shown`."""

    def __init__(self, name: str = "", shown: bool | None = None) -> None:
        self.name, self.shown = f"{name}: " if name else "", sys.stderr.isatty() if shown is None else shown
        self._start = time.monotonic()

    @property
    def spent(self) -> float:
        """Seconds since the start."""
        return time.monotonic() - self._start

    def show(self, text: str) -> None:
        if self.shown:
            sys.stderr.write(f"\r{self.name}{text}\x1b[K")
            sys.stderr.flush()

    def done(self, *, keep: bool = False) -> None:
        """Clear the line, or keep it."""
        if self.shown:
            sys.stderr.write("\n" if keep else "\r\x1b[K")
            sys.stderr.flush()


#: current progress report, for code far down the call stack
_TOLD: contextvars.ContextVar["Waiting | None"] = contextvars.ContextVar("told", default=None)


def piece(done: int, total: int) -> None:
    """Report `done` of `total` pieces to the active progress report, unless it counts other pieces."""
    told = _TOLD.get()
    if told is not None:
        told.piece(done, total)


class _Way(NamedTuple):
    """Progress of a task: `first` at the time `since`, `done` of `total` at the time `told`."""

    first: float
    since: float
    done: float
    total: float
    told: float
    unit: str
    bound: bool  # the time left is an upper bound: it may end before
    inner: bool  # pieces of a task that was announced without any
    also: str  # additional text

    def text(self, now: float) -> str:
        said = f"{self.done:.4g} of {self.total:.4g}{self.unit}{self.also}"
        if self.done <= self.first:
            return said
        rest = (self.told - self.since) * (self.total - self.done) / (self.done - self.first)
        return f"{said}, {'at most ' * self.bound}{duration(max(rest - (now - self.told), 0.0))} left"


class Waiting:
    """Show on a terminal the elapsed time of a task after two seconds, and the remaining time if known.

    A context: `with Waiting("run", "compiling…") as waiting:`. `now` names the next task and the number
    of its pieces done, if any; `reach` reports the simulated time of a run. The remaining time of a run is an upper
    bound, since a brake at rest is simulated in no time.
    """

    def __init__(self, name: str, what: str, shown: bool | None = None, after: float = 2.0) -> None:
        self._line, self._after = Line(name, shown), after
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._tell, daemon=True)
        self._token: contextvars.Token[Waiting | None] | None = None
        self._doing: tuple[str, float, _Way | None] = (what, time.monotonic(), None)

    def now(self, what: str, done: int = 0, total: int = 0, *, bound: bool = False, also: str = "") -> None:
        """Name the current task, or report `done` of its `total` pieces (`bound`: it may need fewer)."""
        if total:
            self._come(what, done, total, bound=bound, also=also)
        else:
            self._doing = (what, time.monotonic(), None)

    def reach(self, t: float, end: float) -> None:
        """Report that a run has reached the simulated time `t` (s) of `end`; the first call is at its start."""
        self._come("simulated to", t, end, unit=" s", bound=True)

    def piece(self, done: int, total: int) -> None:
        """Report `done` of `total` pieces of the current task, unless it was announced with other pieces."""
        what, _, way = self._doing
        if way is None or way.inner:
            self._come(what, done, total, inner=True)

    def _come(
        self,
        what: str,
        done: float,
        total: float,
        *,
        unit: str = "",
        bound: bool = False,
        inner: bool = False,
        also: str = "",
    ) -> None:
        (doing, _, way), now = self._doing, time.monotonic()
        first, since = way[:2] if way is not None and doing == what and done > way.first else (done, now)
        # one assignment: the reporting thread sees all of it or nothing
        self._doing = (what, since, _Way(first, since, done, total, now, unit, bound, inner, also))

    def text(self) -> str:
        """Current task, its progress and the elapsed time."""
        (what, since, way), now = self._doing, time.monotonic()
        return f"{what}, {duration(now - since)}" if way is None else f"{what} {way.text(now)}"

    def _tell(self) -> None:
        pause = self._after
        while not self._over.wait(pause):
            self._line.show(self.text())
            pause = 0.5

    def __enter__(self) -> "Waiting":
        if self._line.shown:
            self._thread.start()
            self._token = _TOLD.set(self)
        return self

    def __exit__(self, *error: object) -> None:
        self._over.set()
        if self._token is not None:
            _TOLD.reset(self._token)
            self._token = None
        if self._thread.is_alive():
            self._thread.join()
            if self._line.spent > self._after:
                self._line.done()


@contextlib.contextmanager
def waiting(progress: "Waiting | bool | None", name: str, what: str) -> Iterator[Waiting]:
    """The caller's `Waiting` with the current task, or a new one (`None`: shown on a terminal only)."""
    if isinstance(progress, Waiting):
        progress.now(what)
        yield progress
        return
    with Waiting(name, what, progress) as own:
        yield own


@contextlib.contextmanager
def telling(progress: "Waiting | Tell | bool | None") -> Iterator[Tell | None]:
    """Receiver of a run's progress: nothing (`False`), a function of `(t, end_time)`, or as `waiting`."""
    if progress is False or callable(progress):
        yield progress or None
        return
    with waiting(progress, "run", "compiling…") as told:
        yield told.reach


class Progress:
    """Count finished pieces out of `total` and report them on stderr.

    `show`: `None` reports only where stderr is a terminal, a function is called with `(done, total)` instead. The
    rate is that since the first piece, whose time includes compiling. `what` names the pieces; nothing is reported
    in the first `after` seconds.
    """

    def __init__(
        self,
        total: int,
        show: Callable[[int, int], object] | bool | None = None,
        done: int = 0,
        what: str = "runs",
        after: float = 0.0,
    ) -> None:
        self.total, self.done, self._what, self._after = total, done, what, after
        self._tell = show if callable(show) else None
        self._line = Line(shown=False if callable(show) else show)
        self._start, self._before, self._said = time.monotonic(), done, 0.0
        self._begun, self._spoke = self._start, False
        self._first = True
        # the time before the first piece, mostly compiling, cannot be estimated
        self._waiting = Waiting("", f"{done}/{total} {what}, begins", self._line.shown).__enter__()

    def add(self, count: int) -> None:
        self.done += count
        self._waiting.__exit__()
        if self._tell is not None:
            self._tell(self.done, self.total)
        now = time.monotonic()
        due = now - self._said > 0.2 or self.done == self.total
        if due and now - self._begun >= self._after:
            self._said, self._spoke = now, True
            self._line.show(self._text(now))
        if self._first:
            self._first, self._start, self._before = False, now, self.done

    def _text(self, now: float) -> str:
        share = f"{self.done}/{self.total} {self._what}"
        elapsed, since = now - self._start, self.done - self._before
        if self._first or since <= 0 or elapsed <= 0:
            return share
        left = (self.total - self.done) * elapsed / since
        return f"{share}, {since / elapsed:.0f} {self._what}/s, {duration(left)} left"

    def close(self) -> None:
        self._waiting.__exit__()
        if self._spoke or self._after == 0.0:
            self._line.done(keep=True)
