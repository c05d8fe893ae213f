"""What a terminal shows of a long task: its words, and the time left."""

import pytest
import rich.progress

from simbrake._base._progress import Waiting


@pytest.fixture
def clock(monkeypatch):
    """The seconds that the clock of the bar shows, to be set."""
    now, begin = [100.0], rich.progress.Progress.__init__
    monkeypatch.setattr(
        rich.progress.Progress, "__init__", lambda self, *a, **more: begin(self, *a, get_time=lambda: now[0], **more)
    )
    return now


def shown(told):
    """The line that a terminal shows: its words, the time spent, the time left."""
    task = told._bar.tasks[0]
    return task.description, task.elapsed, task.time_remaining


def test_time_left_by_pieces_after_the_first(clock):
    with Waiting("run", "compiles", shown=True, after=60.0) as told:
        for seconds, tell, words, left in (
            (20.0, None, "compiles", None),
            (0.0, lambda: told.reach(0.0, 1500.0), "simulated to 0 of 1500 s", None),
            (10.0, lambda: told.reach(300.0, 1500.0), "simulated to 300 of 1500 s", None),
            (10.0, lambda: told.reach(600.0, 1500.0), "simulated to 600 of 1500 s", 30.0),
            (0.0, lambda: told.now("pictures", 0, 4), "pictures 0 of 4", None),
            (2.0, lambda: told.now("pictures", 1, 4, also=", cost 3"), "pictures 1 of 4, cost 3", None),
            (2.0, lambda: told.piece(3, 9), "pictures 1 of 4, cost 3", None),  # inside a picture
            (0.0, lambda: told.now("pictures", 2, 4), "pictures 2 of 4", 4.0),
            (1.0, lambda: told.now("pictures", 0, 4), "pictures 0 of 4", None),  # counted anew
            (0.0, lambda: told.now("sums up"), "sums up", None),
            (1.0, lambda: told.piece(2, 10), "sums up 2 of 10", None),
        ):
            clock[0] += seconds
            if tell is not None:
                tell()
            said, _, rest = shown(told)
            assert (said, rest) == (f"run: {words}", left)
