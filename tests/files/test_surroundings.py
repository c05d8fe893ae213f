"""Faults of the surroundings: killed, no space, nothing to write to, several processes
and threads, odd settings.

What is promised in `docs/claims_and_evidence.md` is tried here; the cache has
`test_cache.py`, odd input `test_bad_input.py`.
"""

import contextlib
import errno
import multiprocessing
import os
import pathlib
import resource
import signal
import subprocess
import sys
import time
import warnings
from concurrent.futures import ThreadPoolExecutor

import jax
import numpy as np
import pytest
from commands import call
from helpers import all_equal, input_error
from scenes import stop_run, stop_scene

import simbrake as sb

SPEED = "initial.omega"
SCENE = "scenarios/u2_5_5_stop.toml"
ROOT = pathlib.Path(__file__).parents[2]
PIPES = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}


def command(*arguments, **options):
    """A process of the command line."""
    program = [sys.executable, "-m", "simbrake", *map(str, arguments)]
    return subprocess.Popen(program, **PIPES | {"cwd": ROOT} | options)


def names(folder):
    return sorted(path.name for path in folder.iterdir())


# --- nothing is half written --------------------------------------------------------


@contextlib.contextmanager
def no_more_than(size):
    """Files of this process end at so many bytes, as on a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_on_a_full_disk_the_old_files_stay(tmp_path, capsys):
    """Of a folder all files are written or none; a link is replaced, not followed."""
    result = stop_run()
    result.verdict()  # compiled before space is short: JAX keeps its programs in files
    scene = tmp_path / "scene.toml"
    file = tmp_path / "result.nc"
    asked = ("run", str(scene), "--out", str(tmp_path / "out"))
    for write in (
        lambda: sb.write_scene(result.scene, scene),
        lambda: sb.save(result, file),
    ):
        write()
        before = [path.read_bytes() for path in sorted(tmp_path.iterdir())]
        with no_more_than(100), input_error(match="cannot be written"):
            write()
        assert [path.read_bytes() for path in sorted(tmp_path.iterdir())] == before
    with no_more_than(1000):
        assert call(capsys, *asked)[0] == 2
    assert names(tmp_path) == ["result.nc", "scene.toml"]
    (tmp_path / "out" / "summary.txt").mkdir(parents=True)
    assert call(capsys, *asked)[0] == 2
    assert names(tmp_path / "out") == ["summary.txt"]
    (tmp_path / "out" / "summary.txt").rmdir()
    before = file.read_bytes()
    (tmp_path / "out" / "summary.json").symlink_to(file)
    assert call(capsys, *asked)[0] == 0
    assert not (tmp_path / "out" / "summary.json").is_symlink()
    assert file.read_bytes() == before


def test_remains_of_a_killed_process(tmp_path):
    for name, age in (("young", 3500), ("old", 3700)):
        folder = tmp_path / f".simbrake-{name}"
        folder.mkdir()
        os.utime(folder, (time.time() - age,) * 2)
    sb.write_scene(stop_scene(), tmp_path / "scene.toml")
    assert names(tmp_path) == [".simbrake-young", "scene.toml"]


@pytest.mark.parametrize("option", ["--out", "--resume"])
def test_nothing_runs_without_a_place(option, tmp_path, capsys, monkeypatch):
    """A file in the way, or above; a folder that is read-only (root may write there,
    hence simulated)."""

    def forbidden(*_, **__):
        raise AssertionError("it ran")

    monkeypatch.setattr(sb, "sweep", forbidden)
    (tmp_path / "file").touch()
    asked = ("sweep", "standard", "--vary", "initial.omega=1:2:2", option)
    for place in (tmp_path / "file", tmp_path / "file" / "below"):
        assert call(capsys, *asked, str(place))[0] == 2
    monkeypatch.setattr("os.access", lambda *_: False)
    assert call(capsys, *asked, str(tmp_path / "new"))[0] == 2
    assert names(tmp_path) == ["file"]


def test_full_disk_during_an_ensemble(tmp_path, monkeypatch):
    """What was finished is kept; the rest is made later."""
    values = {SPEED: np.linspace(5, 20, 40)}
    folder = tmp_path / "runs"
    write = np.savez

    def full(file, **columns):
        if len(names(folder)) > 2:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        write(file, **columns)

    def study(directory):
        options = {"chunk": 8, "workers": 1, "progress": False}
        asked = ["stopping_time"]
        return sb.ensemble(stop_scene(), values, asked, directory=directory, **options)

    monkeypatch.setattr(np, "savez", full)
    with input_error(match="No space left on device"):
        study(folder)
    monkeypatch.setattr(np, "savez", write)
    all_equal(study(folder).stopping_time, study(None).stopping_time)


RESUMED = """
import sys, numpy as np, simbrake as sb
values = {"initial.omega": np.linspace(5, 25, 2000)}
settings = {"directory": sys.argv[1] or None, "chunk": 64, "progress": False}
data = sb.ensemble(sb.read_scene("standard"), values, ["stopping_time"], **settings)
print(data.stopping_time.values.tobytes().hex())
"""


@pytest.mark.slow
def test_killed_and_continued_by_two(tmp_path):
    """`kill -9` in the middle; then two processes go on in the same folder at the same
    time."""
    folder = tmp_path / "runs"

    def resumed(place):
        return subprocess.Popen([sys.executable, "-c", RESUMED, str(place)], **PIPES)

    first = resumed(folder)
    while first.poll() is None and len(list(folder.glob("chunk-*"))) < 5:
        time.sleep(0.02)
    first.kill()
    first.communicate()
    assert 5 <= len(list(folder.glob("chunk-*"))) < 31
    both = [resumed(place) for place in (folder, folder, "")]
    said = [one.communicate(timeout=300) for one in both]
    assert [one.returncode for one in both] == [0, 0, 0], said
    assert said[0] == said[1] == said[2]


# --- interrupted --------------------------------------------------------------------


@pytest.fixture
def heard():
    """Ctrl-C is heard: a shell without job control starts what runs in its background
    with it ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("heard")
def test_ctrl_c_is_never_lost_in_a_callback():
    """It is raised where the runs are waited for, and the usual handler comes back."""

    def press(done, total):
        # (suppressed, as a callback of JAX would swallow it)
        with contextlib.suppress(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)

    values = {SPEED: np.linspace(5, 20, 400)}
    options = {"chunk": 8, "workers": 1, "progress": press}
    data = sb.ensemble(stop_scene(), values, ["stopping_time"], **options)
    assert 0 < int((data.code == -1).sum()) < 400
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.usefixtures("heard")
@pytest.mark.parametrize("delay", [1.5, 2.5])
def test_interrupted_while_it_compiles(delay, tmp_path):
    """And ends itself: the end of the interpreter under a compilation that was
    interrupted may crash."""
    environment = os.environ | {"SIMBRAKE_CACHE_DIR": str(tmp_path)}
    started = command("run", "scenarios/tripping_30_stands.py", env=environment)
    time.sleep(delay)
    started.send_signal(signal.SIGINT)
    _, said = started.communicate(timeout=60)
    assert started.returncode == 130
    assert said.startswith("simbrake: interrupted")
    assert said.count("\n") == 1


# --- odd outputs and settings -------------------------------------------------------


def test_full_output_and_the_locale_c(tmp_path):
    with open("/dev/full", "w") as full:
        blocked = command("scene", "show", SCENE, stdout=full)
        blocked.communicate(timeout=120)
    assert blocked.returncode == 1
    bare = {"LC_ALL": "C", "PYTHONPATH": str(ROOT), "PYTHONCOERCECLOCALE": "0"}
    done = command("run", SCENE, env=bare | {"PYTHONUTF8": "0"})
    out, err = done.communicate(timeout=300)
    assert (done.returncode, err) == (0, "")
    assert out.isascii()


def test_without_compiling_or_the_device_it_says_so():
    with jax.disable_jit(), input_error(match="JAX_DISABLE_JIT"):
        stop_run()
    asked = os.environ | {"JAX_PLATFORMS": "cuda", "JAX_COMPILATION_CACHE_DIR": ""}
    done = command("run", SCENE, env=asked)
    _, err = done.communicate(timeout=300)
    assert done.returncode == 0 or "JAX_PLATFORMS: is cuda" in err


def test_four_threads_at_once():
    speeds = np.linspace(5, 25, 16).tolist()
    prepared = sb.prepare(stop_scene(n=7), ["stopping_time"])

    def times(speed):
        single = float(stop_run(w0=speed, n=7).stopping_time)
        return single, prepared({SPEED: speed}).metrics["stopping_time"]

    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(times, speeds)) == [times(speed) for speed in speeds]


def _forked(pipe, prepared):
    calls = (
        lambda: stop_run(),
        prepared,
        lambda: sb.ensemble(stop_scene(), {SPEED: [1.0]}),
    )
    for ask in calls:
        try:
            ask()
        except sb.InputError as error:
            pipe.send(error.faults[0].problem)


def test_a_forked_process_says_so():
    prepared = sb.prepare(stop_scene(), ["stopping_time"])
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        child = context.Process(target=_forked, args=(theirs, prepared))
        child.start()
    for _ in range(3):
        assert ours.poll(60)
        assert ours.recv().startswith("was forked from one that had run simbrake")
    child.join(10)
    assert child.exitcode == 0


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "nonsense", "http://x:99999"])
def test_a_scheduler_that_does_not_answer(address):
    """It is told, and is no scheduler of what Dask computes afterwards."""
    dask = pytest.importorskip("dask")
    start = time.perf_counter()
    with input_error(match="client: no Dask scheduler answers"):
        sb.ensemble(stop_scene(), {SPEED: [1.0]}, client=address)
    assert time.perf_counter() - start < 10
    assert dask.config.get("scheduler", None) is None
