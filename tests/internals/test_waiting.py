"""Rates and times left that are told while people wait, by a clock that is set."""

from types import SimpleNamespace

import pytest

from simbrake._base import _progress


@pytest.fixture
def clock(monkeypatch):
    """The seconds that the clock shows, to be set."""
    now = [100.0]
    monkeypatch.setattr("simbrake._base._progress.time", SimpleNamespace(monotonic=lambda: now[0]))
    return now


def test_what_is_counted_anew_has_a_new_rate(clock):
    told = _progress.Waiting("fit", "begins", shown=False)
    for at, what, done, text in (
        (100.0, "starts", 2, "starts 2 of 12, cost 3"),
        (104.0, "starts", 4, "starts 4 of 12, cost 3, 16 s left"),  # two in four seconds
        (106.0, "starts", 1, "starts 1 of 12, cost 3"),
        (107.0, "starts", 3, "starts 3 of 12, cost 3, 4 s left"),  # two in one second
        (110.0, "checks", 6, "checks 6 of 12, cost 3"),
        (113.0, "checks", 9, "checks 9 of 12, cost 3, 3 s left"),
    ):
        clock[0] = at
        told.now(what, done, 12, also=", cost 3")
        assert told.text() == text
    clock[0] = 130.0  # longer than expected
    assert told.text() == "checks 9 of 12, cost 3, 0 s left"
    told.now("checks", 10, 12, bound=True)
    assert told.text() == "checks 10 of 12, at most 10 s left"  # four in twenty seconds
    told.now("sums up")
    clock[0] = 142.0
    assert told.text() == "sums up, 12 s"


def test_the_time_left_of_a_run_is_a_bound(clock):
    clock[0] = 0.0
    told = _progress.Waiting("run", "compiles", shown=False)
    clock[0] = 20.0
    assert told.text() == "compiles, 20 s"
    told.reach(0.0, 1500.0)
    assert told.text() == "simulated to 0 of 1500 s"
    clock[0] = 30.0
    told.reach(300.0, 1500.0)  # a fifth in ten seconds, the compiler's not counted
    assert told.text() == "simulated to 300 of 1500 s, at most 40 s left"
    clock[0] = 35.0
    assert told.text().endswith("at most 35 s left")
    told.now("pictures", 0, 4)
    assert told.text() == "pictures 0 of 4"
    clock[0] = 37.0
    told.now("pictures", 1, 4)
    assert told.text() == "pictures 1 of 4, 6 s left"
    told.piece(3, 9)  # what goes on inside a picture is not told: the pictures are counted
    assert told.text() == "pictures 1 of 4, 6 s left"
    told.now("sums up")
    told.piece(0, 10)
    clock[0] = 38.0
    told.piece(2, 10)
    assert told.text() == "sums up 2 of 10, 4 s left"


def test_rate_of_pieces_since_the_first(clock, capsys):
    """The first takes ten seconds, the compiler's; what comes in less than 0.2 s is not said, unless it is the last."""
    line = _progress.Progress(100, True, done=4)
    for at, count, text in (
        (110.0, 6, "10/100 runs"),
        (110.1, 10, None),
        (110.31, 4, "24/100 runs, 45 runs/s, 2 s left"),
        (115.0, 36, "60/100 runs, 10 runs/s, 4 s left"),
        (115.21, 0, "60/100 runs, 10 runs/s, 4 s left"),
        (115.3, 39, None),
        (120.0, 1, "100/100 runs, 9 runs/s, 0 s left"),
    ):
        clock[0] = at
        line.add(count)
        said = capsys.readouterr().err.removeprefix("\r\x1b[K")  # of the line while it compiled
        assert said == ("" if text is None else f"\r{text}\x1b[K")
    line.close()
    assert capsys.readouterr().err == "\n"
