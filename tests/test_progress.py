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
from helpers import Waiting, closed_form, stop_scene

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
    programs = _simulate._stretch_program.cache_info().currsize, _simulate._program.cache_info().currsize
    seen = []
    told = sb.simulate(stop_scene(), max_steps=LONG, progress=lambda t, end: seen.append((t, end)))
    assert (_simulate._stretch_program.cache_info().currsize, _simulate._program.cache_info().currsize) == programs
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
    scene = pathlib.Path(__file__).parent.parent / "scenarios" / "u2_5_5_stop.toml"
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
