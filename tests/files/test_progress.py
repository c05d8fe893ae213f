"""What people are told while they wait, and that being told changes nothing."""

import contextlib
import os
import pathlib
import pty
import subprocess
import sys

import jax
import numpy as np
import pytest
from scenes import stop_scene

import simbrake as sb

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


def test_progress_does_not_change_the_result(untold):
    """To the last bit; the times that are told rise to the end of the run."""
    seen = []
    told = sb.simulate(
        stop_scene(), max_steps=LONG, progress=lambda t, end: seen.append((t, end))
    )
    assert same_bits(told.record, untold.record)
    times = [t for t, _ in seen]
    assert (times[0], times[-1]) == (0.0, 5.0)
    assert times == sorted(times)
    assert {end for _, end in seen} == {5.0}


def test_a_run_can_be_interrupted():
    def stop(t, end):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sb.simulate(stop_scene(), max_steps=LONG, progress=stop)


def test_runs_of_an_ensemble_are_counted(capsys):
    seen = []
    speeds = {"initial.omega": np.linspace(5, 20, 40)}
    for progress in (True, False, lambda done, total: seen.append((done, total))):
        sb.ensemble(
            stop_scene(),
            speeds,
            ["stopping_time"],
            chunk=8,
            workers=1,
            progress=progress,
        )
        assert ("runs 40 of 40" in capsys.readouterr().err) is (progress is True)
    assert seen[-1] == (40, 40)
    assert seen == sorted(seen)


def test_what_compiles_is_told(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("SIMBRAKE_CACHE_DIR", str(tmp_path))
    scene = stop_scene(n=3, beta=40.0)
    sb.sensitivity(scene, "stopping_time", "initial.omega", span=None, progress=True)
    assert "derivatives, compiling" in capsys.readouterr().err


def test_terminal_is_told_and_pipe_is_not(tmp_path):
    """`simbrake run` with stderr on a terminal of its own, where it says its first word
    before it compiles, and with stderr in a pipe: the same on stdout."""
    scene = pathlib.Path(__file__).parents[2] / "scenarios" / "u2_5_5_stop.toml"
    command = [sys.executable, "-m", "simbrake", "run", str(scene)]

    def empty(name):
        """Nothing is compiled yet, so that it takes a while."""
        place = str(tmp_path / name)
        return {
            **os.environ,
            "JAX_COMPILATION_CACHE_DIR": place,
            "SIMBRAKE_CACHE_DIR": place,
        }

    options = {"stdout": subprocess.PIPE, "timeout": 300}
    piped = subprocess.run(
        command, stderr=subprocess.PIPE, env=empty("piped"), **options
    )
    assert (piped.returncode, piped.stderr) == (0, b"")
    ours, theirs = pty.openpty()
    shown = subprocess.run(command, stderr=theirs, env=empty("shown"), **options)
    os.close(theirs)
    said = b""
    with contextlib.suppress(
        OSError
    ):  # (the end of what a terminal holds; a read takes 4 kB of it)
        while part := os.read(ours, 1 << 16):
            said += part
    os.close(ours)
    said = said.decode()
    assert shown.stdout == piped.stdout
    told = [said.index(word) for word in ("loading…", "run: compiling…")]
    assert told == sorted(told)
    assert said.rstrip().endswith("\x1b[2K")  # the line is cleared at last
