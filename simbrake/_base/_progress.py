"""Progress of long tasks on a terminal: what is being done, the time spent, and the
time left."""

import contextlib
import contextvars
import sys
import threading
from collections.abc import Callable, Iterator
from typing import TypeAlias

#: called with the simulated time reached and the end time (s)
Report: TypeAlias = Callable[[float, float], object]

#: for code far down the call stack
_CURRENT: contextvars.ContextVar["Progress | None"] = contextvars.ContextVar(
    "progress", default=None
)


def piece(done: int, total: int) -> None:
    """Report `done` of `total` pieces of the current task, unless it counts other
    pieces."""
    progress = _CURRENT.get()
    if progress is not None:
        progress.piece(done, total)


@contextlib.contextmanager
def compiling() -> Iterator[None]:
    """Say of the current task that it compiles."""
    progress = _CURRENT.get()
    if progress is None:
        yield
        return
    progress.compiles += 1
    progress.refresh()
    try:
        yield
    finally:
        progress.compiles -= 1
        progress.refresh()


@contextlib.contextmanager
def saying(words: str) -> Iterator[None]:
    """Say on a terminal at once what is being done, while libraries load: what draws a
    bar is one of them."""
    shown = sys.stderr.isatty()
    if shown:
        print(words, end="", file=sys.stderr, flush=True)
    try:
        yield
    finally:
        if shown:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)


class Progress:
    """Show a task on a terminal after half a second, with the time spent, and the time
    left where pieces are counted.

    A context: `with Progress("run", "compiling…") as progress:`. `now` names the next
    task and the number of its pieces done, if any; `reach` reports the simulated time
    of a run. The time left of a run is an upper bound, since a brake at rest is
    simulated in no time.
    """

    def __init__(
        self,
        name: str,
        what: str,
        shown: bool | None = None,
        after: float = 0.5,
        *,
        keep: bool = False,
    ) -> None:
        self.shown = sys.stderr.isatty() if shown is None else shown
        self.compiles = 0  # programs that are being made
        self._name = f"{name}: " if name else ""
        self._doing = what
        self._done = ""
        self._counted = False
        self._after = after
        self._keep = keep
        self._bar = None

    def now(
        self,
        what: str,
        done: float = 0,
        total: float = 0,
        *,
        unit: str = "",
        also: str = "",
    ) -> None:
        """Name the current task, or report `done` of its `total` pieces."""
        self._counted = total > 0
        self._show(what, done, total, unit, also)

    def reach(self, t: float, end: float) -> None:
        """Report that a run has reached the simulated time `t` (s) of `end`; the first
        call is at its start."""
        self.now("simulated to", t, end, unit=" s")

    def piece(self, done: int, total: int) -> None:
        """Report `done` of `total` pieces of the current task, unless it was announced
        with other pieces."""
        if not self._counted:
            self._show(self._doing, done, total)

    def _show(
        self, what: str, done: float, total: float, unit: str = "", also: str = ""
    ) -> None:
        anew = what != self._doing
        self._doing = what
        self._done = (f" {done:.4g} of {total:.4g}{unit}" if total else "") + also
        if self._bar is not None:
            values = {"total": total or None, "completed": done}
            again = anew or done < self._bar.tasks[0].completed
            (self._bar.reset if again else self._bar.update)(self._task, **values)
            self.refresh()

    @property
    def _words(self) -> str:
        compiles = self.compiles > 0 and "compiling" not in self._doing
        return f"{self._name}{self._doing}{self._done}{', compiling' * compiles}"

    def refresh(self) -> None:
        """Show what is being done now."""
        if self._bar is not None:
            self._bar.update(self._task, description=self._words)

    def __enter__(self) -> "Progress":
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
            self._token = _CURRENT.set(self)
        return self

    def __exit__(self, *error: object) -> None:
        if self._bar is not None:
            _CURRENT.reset(self._token)
            self._timer.cancel()
            self._timer.join()
            self._bar.stop()
            self._bar = None


@contextlib.contextmanager
def shown_progress(
    progress: "Progress | bool | None", name: str, what: str
) -> Iterator[Progress]:
    """The caller's `Progress` with the current task, or a new one (`None`: shown on a
    terminal only)."""
    if isinstance(progress, Progress):
        progress.now(what)
        yield progress
        return
    with Progress(name, what, progress) as own:
        yield own


@contextlib.contextmanager
def reporting(progress: "Progress | Report | bool | None") -> Iterator[Report | None]:
    """Receiver of a run's progress: nothing (`False`), a function of `(t, end_time)`,
    or as `shown_progress`."""
    if progress is False or callable(progress):
        yield progress or None
        return
    with shown_progress(progress, "run", "compiling…") as shown:
        yield shown.reach


@contextlib.contextmanager
def counting(
    total: int,
    show: Callable[[int, int], object] | bool | None,
    what: str,
    *,
    done: int = 0,
    after: float = 0.0,
) -> Iterator[Callable[[int], object]]:
    """Receiver of the number of finished pieces: a function of `(done, total)`, or a
    line on a terminal that is kept.

    `show`: `None` shows the line only where stderr is a terminal; `what` names the
    pieces; nothing is shown in the first `after` seconds.
    """
    if callable(show):
        yield lambda done: show(done, total)
        return
    with Progress("", what, show, after, keep=True) as shown:
        shown.now(what, done, total)
        yield lambda done: shown.now(what, done, total)
