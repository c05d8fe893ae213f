"""A progress line with the remaining time, for people who wait."""

import sys
import threading
import time
from typing import Any


def duration(seconds: float) -> str:
    """A time span in few words, as in `3 min 20 s`."""
    s = round(seconds)
    if s < 60:
        return f"{s} s"
    minutes, s = divmod(s, 60)
    if minutes < 60:
        return f"{minutes} min {s:02d} s"
    return f"{minutes // 60} h {minutes % 60:02d} min"


class Line:
    """One line on a terminal's error stream that is written over; elsewhere nothing is printed, unless `shown`."""

    def __init__(self, name: str = "", shown: bool | None = None):
        self.name, self.shown = f"{name}: " if name else "", sys.stderr.isatty() if shown is None else shown
        self._start = time.monotonic()

    @property
    def spent(self) -> float:
        """Seconds since the beginning."""
        return time.monotonic() - self._start

    def show(self, text: str) -> None:
        if self.shown:
            sys.stderr.write(f"\r{self.name}{text}\x1b[K")
            sys.stderr.flush()

    def done(self, *, keep: bool = False) -> None:
        """Clears the line, or leaves it."""
        if self.shown:
            sys.stderr.write("\n" if keep else "\r\x1b[K")
            sys.stderr.flush()


class Waiting:
    """Says on a terminal how long something takes that cannot be counted, once it has taken two seconds.

    A context: `with Waiting("run", "compiles what is new to it"):`
    """

    def __init__(self, name: str, what: str, shown: bool | None = None, after: float = 2.0):
        self._line, self._what, self._after = Line(name, shown), what, after
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._tell, daemon=True)

    def _tell(self) -> None:
        pause = self._after
        while not self._over.wait(pause):
            self._line.show(f"{self._what}, {duration(self._line.spent)}")
            pause = 0.5

    def __enter__(self) -> "Waiting":
        if self._line.shown:
            self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._over.set()
        if self._thread.is_alive():
            self._thread.join()
            if self._line.spent > self._after:
                self._line.done()


class Progress:
    """Counts what is done out of `total` and says so on stderr.

    `show`: `None` says it only where stderr is a terminal, a function is called with `(done, total)` instead. The rate
    is that since the first piece, which also waited for the compiler. `what` names the pieces; nothing is said in the
    first seconds, as many as `after`.
    """

    def __init__(self, total: int, show: Any = None, done: int = 0, what: str = "runs", after: float = 0.0):
        self.total, self.done, self._what, self._after = total, done, what, after
        self._tell = show if callable(show) else None
        self._line = Line(shown=False if callable(show) else show)
        self._start, self._before, self._said = time.monotonic(), done, 0.0
        self._begun, self._spoke = self._start, False
        self._first = True

    def add(self, count: int) -> None:
        self.done += count
        if self._tell is not None:
            self._tell(self.done, self.total)
        now = time.monotonic()
        due = now - self._said > 0.2 or self.done == self.total
        if due and (self._spoke or now - self._begun >= self._after):
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
        if self._spoke or self._after == 0.0:
            self._line.done(keep=True)
