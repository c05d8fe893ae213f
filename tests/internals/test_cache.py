"""The cache on disk: the same numbers whatever the state of its folder, and nothing that another user could write."""

import json
import os
import pathlib
import re
import time

import jax
import pytest
from commands import call, python

from simbrake._base import _cache


@pytest.fixture
def folder(monkeypatch, tmp_path):
    """An empty folder for kept programs."""
    monkeypatch.setenv("SIMBRAKE_CACHE_DIR", str(tmp_path / "kept"))
    return tmp_path / "kept"


def test_nothing_is_kept_while_jax_debugs():
    assert re.fullmatch("run-[0-9a-f]{40}", _cache.key_of("run", 1))
    for looking in (jax.disable_jit(), jax.debug_nans(True), jax.debug_infs(True)):
        with looking:
            assert _cache.key_of("run", 1) is None
    cpu = jax.local_devices(backend="cpu")[0]
    assert _cache.key_of("run", 1) != _cache.key_of("run", 1, cpu)


def writable_folder(path):
    path.mkdir(mode=0o700)
    path.chmod(0o770)
    return path


def writable_parent(path):
    (path / "below").mkdir(mode=0o700, parents=True)
    path.chmod(0o707)
    return path / "below"


def link(path):
    (path / "real").mkdir(parents=True, mode=0o700)
    (path / "link").symlink_to(path / "real")
    return path / "link"


def file_instead(path):
    path.write_text("")
    return path


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (writable_folder, "others may write to {place} (chmod go-w helps)"),
        (writable_parent, "others may write to {place.parent} (chmod go-w helps)"),
        (link, "{place} is a symbolic link"),
        (file_instead, "{place}: File exists"),
    ],
)
def test_an_unsafe_folder_is_left_alone(make, words, monkeypatch, tmp_path, caplog):
    place = make(tmp_path / "place")
    monkeypatch.setenv("SIMBRAKE_CACHE_DIR", str(place))
    before = sorted(tmp_path.rglob("*"))
    assert _cache.cached("sum", (1, 2), lambda: 3) == 3
    assert _cache.cached("sum", (1, 2), lambda: 4) == 4
    assert sorted(tmp_path.rglob("*")) == before
    why = words.format(place=place)
    assert caplog.messages == [f"simbrake: compiled programs are not cached: {why}; SIMBRAKE_CACHE_DIR= turns this off"]


def test_a_folder_is_made_private(tmp_path):
    tmp_path.chmod(0o1777)  # as /tmp
    (tmp_path / "mine").mkdir(mode=0o750)
    _cache.Folder(tmp_path / "mine")
    _cache.Folder(tmp_path / "new" / "programs")
    places = ("", "mine", "new", "new/programs")
    assert [(tmp_path / place).stat().st_mode & 0o7777 for place in places] == [0o1777, 0o700, 0o755, 0o700]


@pytest.mark.skipif(os.getuid() != 0, reason="only root can give files away")
@pytest.mark.parametrize("what", ["folder", "file"])
def test_files_of_others_are_not_opened(what, folder, caplog):
    _cache.cached("sum", 1, lambda: 3)
    (file,) = folder.iterdir()
    os.chown(folder if what == "folder" else file, 12345, 12345)
    _cache._opened.cache_clear()
    assert _cache.cached("sum", 1, lambda: 4) == 4
    assert len(caplog.messages) == 1
    os.chown(folder, 0, 0)


@pytest.mark.parametrize(
    "damage",
    [
        lambda file: file.write_bytes(file.read_bytes()[:-1] + b"x"),
        lambda file: file.chmod(0o644),
        lambda file: (file.unlink(), file.symlink_to("/dev/null")),
    ],
    ids=["changed", "readable", "link"],
)
def test_a_damaged_file_is_made_anew(damage, folder, caplog):
    assert _cache.cached("sum", 1, lambda: 3) == 3
    assert _cache.cached("sum", 1, lambda: 5) == 3
    (file,) = folder.iterdir()
    damage(file)
    assert _cache.cached("sum", 1, lambda: 4) == 4
    (said,) = caplog.messages
    assert "is unusable and will be replaced" in said
    assert _cache.cached("sum", 1, lambda: 5) == 4
    assert [entry.name for entry in folder.iterdir()] == [file.name]


def test_without_a_folder_nothing_is_kept(monkeypatch, tmp_path, caplog):
    monkeypatch.setenv("SIMBRAKE_CACHE_DIR", "")
    assert _cache.folder() is None
    monkeypatch.delenv("SIMBRAKE_CACHE_DIR")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert _cache.place() == tmp_path / "simbrake" / "programs"
    monkeypatch.setenv("XDG_CACHE_HOME", "cache")  # not absolute, which has no meaning there
    assert _cache.place() is None
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert _cache.place() == pathlib.Path.home() / ".cache" / "simbrake" / "programs"
    monkeypatch.setattr("os.path.expanduser", lambda path: path)  # nobody knows a home
    assert _cache.place() is None
    assert caplog.messages == []


def test_a_full_disk_is_told_once(folder, monkeypatch, caplog):
    def full(self, name, body):
        raise OSError(28, "No space left on device", name)

    monkeypatch.setattr(_cache.Folder, "write", full)
    assert [_cache.cached("sum", i, lambda i=i: i) for i in range(3)] == [0, 1, 2]
    assert caplog.messages == ["simbrake: a compiled program is not cached: No space left on device"]


def test_no_more_than_the_limit_is_kept(folder, monkeypatch):
    """Three files of 10,000 bytes fill 0.03 MB; with one byte more that goes which was not used for longest."""
    assert _cache.limit() == 512.0
    monkeypatch.setenv("SIMBRAKE_CACHE_SIZE", "0.03")
    store = _cache.folder()
    store.write("a", b"")
    empty, now = store.entries()[0].size, time.time()
    for i, name in enumerate("abc"):
        store.write(name, bytes(10_000 - empty))
        os.utime(folder / name, (now + i, now + i))
    assert [entry.name for entry in store.entries()] == ["c", "b", "a"]
    store.write("b", bytes(10_001 - empty))
    os.utime(folder / "b", (now + 1, now + 1))
    store.write("c", b"")
    assert {entry.name for entry in store.entries()} == {"b", "c"}
    assert (store.read("c"), store.read("d")) == (b"", None)


def test_the_command_shows_and_clears(folder, capsys):
    _cache.cached("sum", 1, lambda: 3)
    _cache.cached("sum", 2, lambda: 3)
    code, out, _ = call(capsys, "cache", "--json")
    found = json.loads(out)
    assert (code, found["folder"], found["programs"], found["limit_bytes"]) == (0, str(folder), 2, 512_000_000)
    assert found["kinds"]["sum"]["files"] == 2
    code, out, _ = call(capsys, "cache")
    assert (code, out.splitlines()[0].startswith("2 files, 0.0 of at most 512 MB, in ")) == (0, True)
    code, out, _ = call(capsys, "cache", "--clear")
    assert (code, out) == (0, f"2 files removed from {folder}\n")
    assert list(folder.iterdir()) == []


def test_unused_arguments_are_in_the_key(folder):
    """What JAX drops of the arguments is not in the text of a program, but the compiled one wants it in its place.

    Nor may two values of a static argument share one.
    """
    program = (
        "import numpy as np; import simbrake; from simbrake._base._compiling import DeviceJit\n"
        "for size in (2, 3):\n"
        "    print(DeviceJit(lambda x, unused: x + 1.0)(np.ones(2), np.ones(size)).tolist())\n"
        "power = DeviceJit(lambda x, n: x**n, static_argnames='n', subject=('power',))\n"
        "print([power(np.asarray(3.0), n=n).item() for n in (2, 3)])"
    )
    for _ in range(2):
        found = python(program, JAX_COMPILATION_CACHE_DIR="").stdout
        assert found == "[2.0, 2.0]\n[2.0, 2.0]\n[9.0, 27.0]\n"
    assert {"text", "power"} <= {file.name.partition("-")[0] for file in folder.iterdir()}
    # nor is it kept where in the source an operation came from
    assert not any(b"<string>" in file.read_bytes() for file in folder.iterdir())


def test_a_restored_program_finds_lapack(folder):
    """JAX looks LAPACK up when it lowers a call of it; a process that only restores a program has done so too."""
    program = (
        "import numpy as np; import jax.numpy as jnp; import simbrake\n"
        "from simbrake._base._compiling import DeviceJit\n"
        "solve = DeviceJit(lambda a, b: jnp.linalg.solve(a, b), subject=('solve',))\n"
        "print(solve(2.0 * np.eye(3), np.ones(3)).tolist())"
    )
    for _ in range(2):
        assert python(program, JAX_COMPILATION_CACHE_DIR="").stdout == "[0.5, 0.5, 0.5]\n"
    assert "solve" in {file.name.partition("-")[0] for file in folder.iterdir()}
