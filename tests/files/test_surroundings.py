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
import shutil
import signal
import subprocess
import sys
import threading
import time
import warnings

import jax
import numpy as np
import pytest
from commands import call
from helpers import main
from stop_scenes import stop_scene

import simbrake as sb

SPEED = "initial.omega"
SCENE = "scenarios/u2_5_5_stop.toml"
ROOT = pathlib.Path(__file__).parents[2]


def command(*arguments, **options):
    """A process of the command line."""
    usual = {
        "stdout": subprocess.PIPE,
        "stderr": subprocess.PIPE,
        "text": True,
        "cwd": ROOT,
    }
    return subprocess.Popen(
        [sys.executable, "-m", "simbrake", *map(str, arguments)], **usual | options
    )


def names(folder):
    return sorted(path.name for path in folder.iterdir())


# --- nothing is half written --------------------------------------------------------


@pytest.fixture(scope="module")
def result():
    return sb.simulate(stop_scene())


@contextlib.contextmanager
def no_more_than(size):
    """Files of this process end at so many bytes, as on a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize("name", ["result.nc", "scene.toml"])
def test_on_a_full_disk_the_old_file_stays(result, tmp_path, name):
    file = tmp_path / name
    write = (
        (lambda: sb.write_scene(result.scene, file))
        if name == "scene.toml"
        else lambda: sb.save(result, file)
    )
    write()
    before = file.read_bytes()
    with (
        no_more_than(100),
        pytest.raises(sb.InputError, match="cannot be written: File too large"),
    ):
        write()
    assert (names(tmp_path), file.read_bytes()) == ([name], before)


def test_a_folder_gets_all_files_or_none(result, tmp_path, capsys):
    """A full disk, a folder in the way of one of the files; a link is replaced, not
    followed."""
    sb.write_scene(result.scene, tmp_path / "scene.toml")
    folder = tmp_path / "out"
    elsewhere = tmp_path / "elsewhere"
    elsewhere.write_text("mine", "utf-8")
    asked = ("run", str(tmp_path / "scene.toml"), "--out", str(folder))
    assert (
        call(capsys, *asked)[0] == 0
    )  # compiled here, else programs that JAX keeps would be cut off as well
    shutil.rmtree(folder)
    with no_more_than(1000):
        code, _, err = call(capsys, *asked)
    assert (code, "cannot be written" in err) == (2, True)
    assert names(tmp_path) == ["elsewhere", "scene.toml"]
    (folder / "summary.txt").mkdir(parents=True)
    assert call(capsys, *asked)[0] == 2
    assert names(folder) == ["summary.txt"]
    (folder / "summary.txt").rmdir()
    (folder / "summary.json").symlink_to(elsewhere)
    assert call(capsys, *asked)[0] == 0
    assert {
        "result.nc",
        "series.csv",
        "stop.png",
        "summary.json",
        "summary.txt",
    } <= set(names(folder))
    assert not (folder / "summary.json").is_symlink()
    assert elsewhere.read_text("utf-8") == "mine"


def test_remains_of_a_killed_process(tmp_path):
    young = tmp_path / ".simbrake-young"
    old = tmp_path / ".simbrake-old"
    for folder, age in ((young, 3500), (old, 3700)):
        folder.mkdir()
        (folder / "part").write_text("half", "utf-8")
        os.utime(folder, (time.time() - age,) * 2)
    sb.write_scene(stop_scene(), tmp_path / "scene.toml")
    assert names(tmp_path) == [
        ".simbrake-young",
        "scene.toml",
    ]  # the young one may be at work


@pytest.mark.parametrize(
    "arguments", [("run", SCENE), ("sweep", SCENE, "--vary", "initial.omega=1:2:2")]
)
def test_nothing_runs_without_a_place(arguments, tmp_path, capsys, monkeypatch):
    """A file in the way, at once or above; a folder that is read-only (root may write
    there, hence simulated)."""

    def forbidden(*_, **__):
        raise AssertionError("it ran")

    monkeypatch.setattr(sb, "simulate", forbidden)
    monkeypatch.setattr(sb, "sweep", forbidden)
    (tmp_path / "file").write_text("mine", "utf-8")
    options = ("--out", "--resume") if arguments[0] == "sweep" else ("--out",)
    for option in options:
        for place, words in (
            (tmp_path / "file", "is a file"),
            (tmp_path / "file" / "below", "is a file"),
        ):
            with pytest.raises(SystemExit) as stop:
                main([*map(str, arguments), option, str(place)])
            assert stop.value.code == 2
            assert words in capsys.readouterr().err
    monkeypatch.setattr("os.access", lambda *_: False)
    with pytest.raises(SystemExit) as stop:
        main([*map(str, arguments), "--out", str(tmp_path / "new")])
    assert stop.value.code == 2
    assert names(tmp_path) == ["file"]


def test_full_disk_during_an_ensemble(tmp_path, monkeypatch):
    values = {SPEED: np.linspace(5, 20, 40)}
    write = np.savez

    def full(file, **columns):
        if len(names(tmp_path / "runs")) > 2:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        write(file, **columns)

    options = {
        "directory": tmp_path / "runs",
        "chunk": 8,
        "workers": 1,
        "progress": False,
    }
    monkeypatch.setattr(np, "savez", full)
    with pytest.raises(sb.InputError, match="No space left on device"):
        sb.ensemble(stop_scene(), values, ["stopping_time"], **options)
    assert not [name for name in names(tmp_path / "runs") if name.startswith(".")]
    monkeypatch.setattr(np, "savez", write)
    data = sb.ensemble(stop_scene(), values, ["stopping_time"], **options)
    fresh = sb.ensemble(
        stop_scene(), values, ["stopping_time"], **options | {"directory": None}
    )
    np.testing.assert_array_equal(data.stopping_time, fresh.stopping_time)


RESUMED = """
import sys, numpy as np, simbrake as sb
values = {"initial.omega": np.linspace(5, 25, 2000), "duty.load.mass": np.linspace(4e4, 8e4, 2000)}
settings = {"directory": sys.argv[2] or None, "chunk": 64, "progress": False}
data = sb.ensemble(sb.read_scene(sys.argv[1]), values, ["stopping_time", "energy.friction_heat"], **settings)
print(data.stopping_time.values.tobytes().hex()[:4000], data["energy.friction_heat"].values.sum().hex())
"""


def resumed(folder):
    program = [sys.executable, "-c", RESUMED, str(ROOT / SCENE), str(folder)]
    return subprocess.Popen(
        program, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


@pytest.mark.slow
def test_killed_and_continued_by_two(tmp_path):
    """`kill -9` in the middle; then two processes go on in the same folder at the same
    time."""
    folder = tmp_path / "runs"
    first = resumed(tmp_path / "runs")
    while first.poll() is None and len(list(folder.glob("chunk-*"))) < 5:
        time.sleep(0.02)
    first.kill()
    first.communicate()
    assert 5 <= len(list(folder.glob("chunk-*"))) < 31
    both = [resumed(folder), resumed(folder), resumed("")]
    said = [one.communicate(timeout=300) for one in both]
    assert [one.returncode for one in both] == [0, 0, 0], said
    assert said[0] == said[1] == said[2]
    assert not [
        name
        for name in names(folder)
        if not name.startswith(("chunk-", "manifest", ".simbrake-"))
    ]


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
    """The signal only leaves a mark; it is raised where the runs are waited for, and
    the usual handler comes back."""

    def press(done, total):
        with contextlib.suppress(
            KeyboardInterrupt
        ):  # as a callback of JAX would swallow it
            os.kill(os.getpid(), signal.SIGINT)

    values = {SPEED: np.linspace(5, 20, 400)}
    data = sb.ensemble(
        stop_scene(), values, ["stopping_time"], chunk=8, workers=1, progress=press
    )
    assert 0 < int((data.code == -1).sum()) < 400
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.usefixtures("heard")
def test_interrupted_while_it_loads():
    for delay in (0.1, 0.2, 0.3, 0.45, 0.6, 0.8):
        started = command("run", SCENE)
        time.sleep(delay)
        started.send_signal(signal.SIGINT)
        _, said = started.communicate(timeout=60)
        # (before simbrake is known to Python, nobody listens)
        assert "simbrake/cli" not in said, (delay, said)
        assert "jax" not in said, (delay, said)


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


# --- outputs that are closed or full ------------------------------------------------


def test_closed_and_full_outputs():
    with open("/dev/full", "w") as full:
        blocked = command("scene", "show", SCENE, stdout=full)
        closed = subprocess.Popen(
            [
                "bash",
                "-c",
                'exec "$@" >&-',
                "-",
                sys.executable,
                "-m",
                "simbrake",
                "scene",
                "show",
                SCENE,
            ],
            stderr=subprocess.PIPE,
            text=True,
            cwd=ROOT,
        )
        for one in (blocked, closed):
            one.communicate(timeout=120)
    assert (blocked.returncode, closed.returncode) == (1, 0)


# --- odd settings -------------------------------------------------------------------


@pytest.mark.slow
def test_without_a_home_in_the_locale_c(tmp_path):
    bare = {
        "LC_ALL": "C",
        "PYTHONPATH": str(ROOT),
        "PYTHONCOERCECLOCALE": "0",
        "PYTHONUTF8": "0",
    }
    done = command("run", SCENE, "--out", tmp_path / "out", env=bare)
    out, err = done.communicate(timeout=300)
    assert (done.returncode, err) == (0, "")
    assert out.startswith("stopped:")
    assert out.isascii()
    assert not (tmp_path / "out" / "summary.txt").read_text("utf-8").isascii()


def test_without_compiling_it_says_so():
    with (
        jax.disable_jit(),
        pytest.raises(sb.InputError, match="JAX_DISABLE_JIT: is set"),
    ):
        sb.simulate(stop_scene())
    with (
        jax.disable_jit(),
        pytest.raises(sb.InputError, match="JAX_DISABLE_JIT: is set"),
    ):
        sb.ensemble(stop_scene(), {SPEED: [1.0]})


def test_a_device_that_is_not_there():
    program = "import simbrake as sb, sys; sb.simulate(sb.read_scene(sys.argv[1]))"
    asked = os.environ | {"JAX_PLATFORMS": "cuda", "JAX_COMPILATION_CACHE_DIR": ""}
    done = subprocess.run(
        [sys.executable, "-c", program, str(ROOT / SCENE)],
        capture_output=True,
        text=True,
        env=asked,
    )
    if done.returncode == 0:
        pytest.skip("there is one")
    assert "JAX_PLATFORMS: is cuda, and there is no such device" in done.stderr


# --- threads and processes ----------------------------------------------------------


def test_four_threads_at_once():
    scenes = [stop_scene(w0=w, n=7) for w in np.linspace(5, 25, 16).tolist()]
    found = {}
    prepared = sb.prepare(scenes[0], ["stopping_time"])

    def work(first):
        for i in range(first, 16, 4):
            found[i] = (
                float(sb.simulate(scenes[i]).stopping_time),
                prepared({SPEED: 5.0 + i}).metrics["stopping_time"],
            )

    threads = [threading.Thread(target=work, args=(first,)) for first in range(4)]
    for one in threads:
        one.start()
    for one in threads:
        one.join(timeout=300)
    for i, scene in enumerate(scenes):
        assert found[i] == (
            float(sb.simulate(scene).stopping_time),
            prepared({SPEED: 5.0 + i}).metrics["stopping_time"],
        )


def _forked(pipe, prepared):
    said = []
    for ask in (
        lambda: sb.simulate(stop_scene()),
        prepared,
        lambda: sb.ensemble(stop_scene(), {SPEED: [1.0]}),
    ):
        try:
            ask()
        except sb.InputError as error:
            said.append(error.faults[0].problem)
    pipe.send(said)


def test_a_forked_process_says_so():
    prepared = sb.prepare(stop_scene(), ["stopping_time"])
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # JAX warns of every fork
        child = context.Process(target=_forked, args=(theirs, prepared))
        child.start()
    assert ours.poll(60)
    assert (
        ours.recv()
        == ["was forked from one that had run simbrake, without its threads"] * 3
    )
    child.join(10)
    assert child.exitcode == 0


# --- a cluster that does not answer -------------------------------------------------


@pytest.mark.parametrize(
    "address",
    ["tcp://127.0.0.1:1", "nonsense", "tcp://", "http://x:99999999", "tcp://::::"],
)
def test_a_scheduler_that_does_not_answer(address):
    pytest.importorskip("distributed")
    start = time.perf_counter()
    with pytest.raises(sb.InputError, match="client: no Dask scheduler answers at"):
        sb.ensemble(stop_scene(), {SPEED: [1.0]}, client=address)
    assert time.perf_counter() - start < 10
