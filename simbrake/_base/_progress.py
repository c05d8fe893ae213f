"""Progress of long tasks on a terminal: what is being done, the time spent, and the time left."""

import contextlib
import contextvars
import sys
import threading
from collections.abc import Callable, Iterator
from typing import TypeAlias

#: called with the simulated time reached and the end time (s)
Tell: TypeAlias = Callable[[float, float], object]

#: current progress report, for code far down the call stack
_TOLD: contextvars.ContextVar["Waiting | None"] = contextvars.ContextVar("told", default=None)


def piece(done: int, total: int) -> None:
    """Report `done` of `total` pieces to the active progress report, unless it counts other pieces."""
    told = _TOLD.get()
    if told is not None:
        told.piece(done, total)


class Waiting:
    """Show a task on a terminal after two seconds, with the time spent, and the time left where pieces are counted.

    A context: `with Waiting("run", "compiling…") as waiting:`. `now` names the next task and the number of its pieces
    done, if any; `reach` reports the simulated time of a run. The time left of a run is an upper bound, since a brake
    at rest is simulated in no time.
    """

    def __init__(
        self, name: str, what: str, shown: bool | None = None, after: float = 2.0, *, keep: bool = False
    ) -> None:
        self.shown = sys.stderr.isatty() if shown is None else shown
        self._name, self._doing, self._counted, self._after = f"{name}: " if name else "", what, False, after
        self._keep, self._bar = keep, None

    def now(self, what: str, done: float = 0, total: float = 0, *, unit: str = "", also: str = "") -> None:
        """Name the current task, or report `done` of its `total` pieces."""
        self._counted = total > 0
        self._show(what, done, total, unit, also)

    def reach(self, t: float, end: float) -> None:
        """Report that a run has reached the simulated time `t` (s) of `end`; the first call is at its start."""
        self.now("simulated to", t, end, unit=" s")

    def piece(self, done: int, total: int) -> None:
        """Report `done` of `total` pieces of the current task, unless it was announced with other pieces."""
        if not self._counted:
            self._show(self._doing, done, total)

    def _show(self, what: str, done: float, total: float, unit: str = "", also: str = "") -> None:
        anew, self._doing = what != self._doing, what
        if self._bar is not None:
            counted = f" {done:.4g} of {total:.4g}{unit}" if total else ""
            values = {"description": f"{self._name}{what}{counted}{also}", "total": total or None, "completed": done}
            again = anew or done < self._bar.tasks[0].completed
            (self._bar.reset if again else self._bar.update)(self._task, **values)

    def __enter__(self) -> "Waiting":
        if self.shown:
            # loaded where somebody looks
            from rich import console, progress

            self._bar = progress.Progress(
                progress.TextColumn("{task.description}", markup=False),
                progress.TimeElapsedColumn(),
                progress.TextColumn("left at most"),
                progress.TimeRemainingColumn(),
                console=console.Console(stderr=True, force_terminal=True),
                transient=not self._keep,
                redirect_stdout=False,
                redirect_stderr=False,
            )
            self._task = self._bar.add_task(f"{self._name}{self._doing}", total=None)
            self._timer = threading.Timer(self._after, self._bar.start)
            self._timer.daemon = True
            self._timer.start()
            self._token = _TOLD.set(self)
        return self

    def __exit__(self, *error: object) -> None:
        if self._bar is not None:
            _TOLD.reset(self._token)
            self._timer.cancel()
            self._timer.join()
            self._bar.stop()
            self._bar = None


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
    """Count finished pieces out of `total`, and show them as `Waiting` does; the last line is kept.

    `show`: `None` shows them only where stderr is a terminal; a function is called with `(done, total)` instead.
    `what` names the pieces; nothing is shown in the first `after` seconds.
    """

    def __init__(
        self,
        total: int,
        show: Callable[[int, int], object] | bool | None = None,
        done: int = 0,
        what: str = "runs",
        after: float = 0.0,
    ) -> None:
        self.total, self.done, self._what = total, done, what
        self._tell = show if callable(show) else None
        self._waiting = Waiting("", what, False if callable(show) else show, after, keep=True).__enter__()
        self._waiting.now(what, done, total)

    def add(self, count: int) -> None:
        self.done += count
        if self._tell is not None:
            self._tell(self.done, self.total)
        self._waiting.now(self._what, self.done, self.total)

    def close(self) -> None:
        self._waiting.__exit__()
