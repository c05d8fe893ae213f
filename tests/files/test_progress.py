"""What people are told while they wait, and that being told changes nothing."""

import os
import pathlib
import pty
import subprocess
import sys
import time
from types import SimpleNamespace

import jax
import numpy as np
import pytest
from helpers import Waiting
from stop_scenes import closed_form, stop_scene

import simbrake as sb
from simbrake._base import _compiling, _progress
from simbrake._run import _simulate

LONG = 2048  # step attempts allowed from which on a run goes in stretches


def same_bits(a, b):
    """Whether two trees of arrays are equal to the last bit."""
    return all(
        np.asarray(x).tobytes() == np.asarray(y).tobytes()
        for x, y in zip(jax.tree.leaves(a), jax.tree.leaves(b), strict=True)
    )


@pytest.fixture(scope="module")
def untold():
    return sb.simulate(stop_scene(), max_steps=LONG)


def test_a_long_run_has_the_times_of_the_closed_form(untold):
    assert float(untold.stopping_time) == pytest.approx(closed_form()["stop"], rel=1e-10)
    plain = sb.simulate(stop_scene())
    assert int(plain.record.count) == int(untold.record.count)
    n = int(plain.record.count) + 1
    np.testing.assert_allclose(untold.record.rows.y[:n], plain.record.rows.y[:n], rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize("length", [1, 5])
def test_told_and_untold_are_one_program_and_one_result_to_the_last_bit(untold, monkeypatch, length):
    monkeypatch.setattr(_simulate, "_FIRST", length)
    monkeypatch.setattr(_simulate, "_TARGET", 0.0)  # no time at all: from then on every attempt is a stretch of its own
    programs = _simulate._stretch_program.made, _simulate._program.made
    seen = []
    told = sb.simulate(stop_scene(), max_steps=LONG, progress=lambda t, end: seen.append((t, end)))
    assert (_simulate._stretch_program.made, _simulate._program.made) == programs
    assert same_bits(told.record, untold.record)
    times = [t for t, _ in seen]
    assert times[0] == 0.0
    assert times[-1] == 5.0
    assert times == sorted(times)
    assert len(times) > 10
    assert {end for _, end in seen} == {5.0}


def test_a_limit_of_steps_holds_across_stretches(monkeypatch):
    monkeypatch.setattr(_simulate, "_FIRST", 4)
    monkeypatch.setattr(_simulate, "_TARGET", 0.0)
    scene = stop_scene()
    numbers, packing = _compiling.pack((scene, np.asarray(1e-10), np.asarray(np.inf), np.asarray(10_000, np.int32)))
    method = _simulate.as_method(_simulate.solver_of(scene))
    for tell in (None, lambda t, end: None):
        record = _simulate.long_run(numbers, packing, method, (10,), tell)
        assert int(record.code) == 1
        assert int(record.count) == 10
        assert record.rows.t.shape == (11,)
        assert 0 < float(record.t_end) < 5.0


def test_a_run_can_be_interrupted_between_stretches(monkeypatch):
    monkeypatch.setattr(_simulate, "_FIRST", 4)

    def stop(t, end):
        if t > 0:
            assert t < end
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sb.simulate(stop_scene(), max_steps=LONG, progress=stop)


def test_the_time_left_of_a_run_is_a_bound(monkeypatch):
    now = [0.0]
    monkeypatch.setattr("simbrake._base._progress.time", SimpleNamespace(monotonic=lambda: now[0]))
    told = Waiting("run", "compiles", shown=False)
    now[0] = 20.0
    assert told.text() == "compiles, 20 s"
    told.reach(0.0, 1500.0)
    assert told.text() == "simulated to 0 of 1500 s"
    now[0] = 30.0
    told.reach(300.0, 1500.0)  # a fifth in ten seconds, the compiler's not counted
    assert told.text() == "simulated to 300 of 1500 s, at most 40 s left"
    now[0] = 35.0
    assert told.text().endswith("at most 35 s left")
    told.now("pictures", 0, 4)
    assert told.text() == "pictures 0 of 4"
    now[0] = 37.0
    told.now("pictures", 1, 4)
    assert told.text() == "pictures 1 of 4, 6 s left"
    told.piece(3, 9)  # what goes on inside a picture is not told: the pictures are counted
    assert told.text() == "pictures 1 of 4, 6 s left"
    told.now("sums up")
    told.piece(0, 10)
    now[0] = 38.0
    told.piece(2, 10)
    assert told.text() == "sums up 2 of 10, 4 s left"


def test_pieces_reach_whoever_waits_and_nobody_else(capsys):
    _progress.piece(1, 2)
    with Waiting("run", "sums up", shown=True, after=0.02) as told:
        _progress.piece(1, 2)
        assert told.text() == "sums up 1 of 2"
        with _progress.waiting(told, "report", "sums up again") as same:
            assert same is told
        assert told.text() == "sums up again, 0 s"
        time.sleep(0.1)
    assert "run: sums up again, 0 s" in capsys.readouterr().err
    _progress.piece(2, 2)
    assert told.text().startswith("sums up again")


def test_a_terminal_is_told_and_a_pipe_is_not(tmp_path):
    """`simbrake run` with stderr on a terminal of its own and with stderr in a pipe: the same on stdout."""
    scene = pathlib.Path(__file__).parents[2] / "scenarios" / "u2_5_5_stop.toml"
    program = "from simbrake._base import _progress\n"
    program += "_progress.Waiting.__init__.__defaults__ = (None, 0.01)\n"  # impatient: a tenth of a second is long
    program += f"from simbrake._commands._cli import main\nmain(['run', {str(scene)!r}])"
    cache = {"JAX_COMPILATION_CACHE_DIR": os.path.join(tmp_path, "cache")}
    options = {"stdout": subprocess.PIPE, "env": {**os.environ, **cache}, "timeout": 300}
    piped = subprocess.run([sys.executable, "-c", program], stderr=subprocess.PIPE, **options)
    assert (piped.returncode, piped.stderr) == (0, b"")
    ours, theirs = pty.openpty()
    shown = subprocess.run([sys.executable, "-c", program], stderr=theirs, **options)
    os.close(theirs)
    said = os.read(ours, 1 << 16).decode()
    os.close(ours)
    assert shown.stdout == piped.stdout
    assert "run: compiling…, 0 s" in said
    assert said.endswith("\r\x1b[K")  # the line is cleared at last


def test_progress_waits_before_it_speaks(capsys):
    line = _progress.Progress(3, True, what="frames", after=3600.0)
    line.add(3)
    line.close()
    assert capsys.readouterr().err == ""
    line = _progress.Progress(3, True, what="frames")
    line.add(3)
    line.close()
    assert "3/3 frames" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.4, "0 s"),
        (59.4, "59 s"),
        (59.6, "1 min 00 s"),
        (60, "1 min 00 s"),
        (61, "1 min 01 s"),
        (3599, "59 min 59 s"),
        (3600, "1 h 00 min"),
        (7384, "2 h 03 min"),
        (2 * 3600 + 3599, "2 h 59 min"),
    ],
)
def test_spans_of_time_in_words(seconds, text):
    assert _progress.duration(seconds) == text


def test_a_line_is_overwritten_in_place_cleared_or_kept(capsys, monkeypatch):
    _progress.Line("run").show("nothing")  # no terminal
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    for line, shown in (
        (_progress.Line("run"), "\rrun: half\x1b[K"),
        (_progress.Line(shown=True), "\rhalf\x1b[K"),
        (_progress.Line("run", shown=False), ""),
    ):
        line.show("half")
        assert capsys.readouterr().err == shown
        line.done()
        assert capsys.readouterr().err == ("\r\x1b[K" if shown else "")
        line.done(keep=True)
        assert capsys.readouterr().err == ("\n" if shown else "")


@pytest.fixture
def clock(monkeypatch):
    """The seconds that the clock shows, to be set."""
    now = [100.0]
    monkeypatch.setattr("simbrake._base._progress.time", SimpleNamespace(monotonic=lambda: now[0]))
    return now


def test_what_is_counted_anew_has_a_new_rate(clock):
    told = Waiting("fit", "begins", shown=False)
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
    assert told._thread.daemon  # it does not keep the process


def test_who_is_told_of_a_run():
    said = []
    with _progress.telling(False) as nobody:
        assert nobody is None
    with _progress.telling(said.append) as somebody:
        assert somebody == said.append
    with _progress.telling(None) as reach:
        reach(0.0, 5.0)
        assert reach.__self__.text() == "simulated to 0 of 5 s"
        assert reach.__self__._line.name == "run: "
    with _progress.waiting(False, "fit", "begins") as own:
        assert (own.text(), own._line.name, own._line.shown) == ("begins, 0 s", "fit: ", False)


def test_the_rate_of_pieces_is_that_since_the_first(clock, capsys):
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


def test_one_piece_in_less_than_a_second_has_a_rate_and_none_has_not(clock, capsys):
    line = _progress.Progress(9, True, what="frames")
    for at, count, text in (
        (101.0, 1, "1/9 frames"),
        (101.5, 1, "2/9 frames, 2 frames/s, 4 s left"),
        (102.0, 0, "2/9 frames, 1 frames/s, 7 s left"),
    ):
        clock[0] = at
        line.add(count)
        assert capsys.readouterr().err == f"\r{text}\x1b[K"
    at_once = _progress.Progress(2, True)
    capsys.readouterr()
    at_once.add(1)
    clock[0] = 103.0
    at_once.add(0)
    assert capsys.readouterr().err.endswith("\r1/2 runs\x1b[K")
    clock[0] = 104.0
    at_once = _progress.Progress(2, True)
    at_once.add(1)
    at_once.add(1)  # at the same moment
    assert capsys.readouterr().err.endswith("\r2/2 runs\x1b[K")


def test_nothing_is_said_too_early_and_a_function_is_told_all(clock, capsys):
    line = _progress.Progress(10, True, after=60.0)
    line.add(5)
    clock[0] = 159.0
    line.add(1)
    line.close()
    assert capsys.readouterr().err == ""
    clock[0] = 160.0
    line.add(1)
    assert capsys.readouterr().err == "\r7/10 runs, 0 runs/s, 1 min 30 s left\x1b[K"
    line.close()
    assert capsys.readouterr().err == "\n"
    _progress.Progress(10, True).close()
    assert capsys.readouterr().err == "\n"
    said = []
    line = _progress.Progress(10, lambda *told: said.append(told), done=2)
    line.add(3)
    line.add(5)
    line.close()
    assert (said, capsys.readouterr().err) == ([(5, 10), (10, 10)], "")
