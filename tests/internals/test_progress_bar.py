"""What a terminal shows of a long task: its words, and the time left."""

import pytest
import rich.progress

from simbrake._base._progress import Progress


@pytest.fixture
def clock(monkeypatch):
    """The seconds that the clock of the bar shows, to be set."""
    now, begin = [100.0], rich.progress.Progress.__init__
    monkeypatch.setattr(
        rich.progress.Progress, "__init__", lambda self, *a, **more: begin(self, *a, get_time=lambda: now[0], **more)
    )
    return now


def shown(progress):
    """The line that a terminal shows: its words, the time spent, the time left."""
    task = progress._bar.tasks[0]
    return task.description, task.elapsed, task.time_remaining


def test_time_left_by_pieces_after_the_first(clock):
    with Progress("run", "compiles", shown=True, after=60.0) as progress:
        for seconds, report, words, left in (
            (20.0, None, "compiles", None),
            (0.0, lambda: progress.reach(0.0, 1500.0), "simulated to 0 of 1500 s", None),
            (10.0, lambda: progress.reach(300.0, 1500.0), "simulated to 300 of 1500 s", None),
            (10.0, lambda: progress.reach(600.0, 1500.0), "simulated to 600 of 1500 s", 30.0),
            (0.0, lambda: progress.now("pictures", 0, 4), "pictures 0 of 4", None),
            (2.0, lambda: progress.now("pictures", 1, 4, also=", cost 3"), "pictures 1 of 4, cost 3", None),
            (2.0, lambda: progress.piece(3, 9), "pictures 1 of 4, cost 3", None),  # inside a picture
            (0.0, lambda: progress.now("pictures", 2, 4), "pictures 2 of 4", 4.0),
            (1.0, lambda: progress.now("pictures", 0, 4), "pictures 0 of 4", None),  # counted anew
            (0.0, lambda: progress.now("sums up"), "sums up", None),
            (1.0, lambda: progress.piece(2, 10), "sums up 2 of 10", None),
        ):
            clock[0] += seconds
            if report is not None:
                report()
            said, _, rest = shown(progress)
            assert (said, rest) == (f"run: {words}", left)
