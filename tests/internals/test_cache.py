"""The cache on disk: the same numbers whatever the state of its folder, and nothing
that another user could write."""

import os
import time

import pytest
from commands import python

from simbrake._base import _store


@pytest.fixture
def folder(monkeypatch, tmp_path):
    """An empty folder for kept programs."""
    monkeypatch.setenv("SIMBRAKE_CACHE_DIR", str(tmp_path / "kept"))
    return tmp_path / "kept"


def kept(number):
    """A number as an answer, or the answer that an earlier process has kept."""
    return _store.kept_on_disk(_store.file_of("sum", (1, 2)), lambda: number)


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


@pytest.mark.parametrize("make", [writable_folder, writable_parent, link, file_instead])
def test_an_unsafe_folder_is_left_alone(make, monkeypatch, tmp_path, caplog):
    place = make(tmp_path / "place")
    monkeypatch.setenv("SIMBRAKE_CACHE_DIR", str(place))
    before = sorted(tmp_path.rglob("*"))
    assert [kept(x) for x in (3, 4)] == [3, 4]
    assert sorted(tmp_path.rglob("*")) == before
    assert len(caplog.messages) == 1


def test_a_folder_is_made_private(tmp_path):
    tmp_path.chmod(0o1777)  # as /tmp
    (tmp_path / "mine").mkdir(mode=0o750)
    _store.Folder(tmp_path / "mine")
    _store.Folder(tmp_path / "new" / "programs")
    places = ("", "mine", "new", "new/programs")
    assert [(tmp_path / place).stat().st_mode & 0o7777 for place in places] == [
        0o1777,
        0o700,
        0o755,
        0o700,
    ]


@pytest.mark.skipif(os.getuid() != 0, reason="only root can give files away")
@pytest.mark.parametrize("what", ["folder", "file"])
def test_files_of_others_are_not_opened(what, folder, caplog):
    kept(3)
    (file,) = folder.iterdir()
    os.chown(folder if what == "folder" else file, 12345, 12345)
    _store._opened.cache_clear()
    assert kept(4) == 4
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
    assert [kept(x) for x in (3, 5)] == [3, 3]
    (file,) = folder.iterdir()
    damage(file)
    assert [kept(x) for x in (4, 5)] == [4, 4]
    assert len(caplog.messages) == 1
    assert [entry.name for entry in folder.iterdir()] == [file.name]


def test_no_more_than_the_limit_is_kept(folder, monkeypatch):
    """Three files of 10,000 bytes fill 0.03 MB; with one byte more that goes which was
    not used for longest."""
    monkeypatch.setenv("SIMBRAKE_CACHE_SIZE", "0.03")
    store = _store.folder()
    store.write("a", b"")
    empty = store.entries()[0].size
    now = time.time()
    for i, name in enumerate("abc"):
        store.write(name, bytes(10_000 - empty))
        os.utime(folder / name, (now + i, now + i))
    assert {entry.name for entry in store.entries()} == {"a", "b", "c"}
    store.write("b", bytes(10_001 - empty))
    assert {entry.name for entry in store.entries()} == {"b", "c"}


def test_programs_that_look_alike_are_not_mixed_up(folder):
    """What JAX drops of the arguments, and values of a static argument, are not in the
    text of a program.

    A process that only restores a program has to find LAPACK too.
    """
    program = (
        "import numpy as np; import jax.numpy as jnp; import simbrake\n"
        "from simbrake._base._compiling import Compiled\n"
        "for size in (2, 3):\n"
        "    print(Compiled(lambda x, unused: x + 1.0)(np.ones(2), np.ones(size)).tolist())\n"
        "power = Compiled(lambda x, n: x**n, static_argnames=('n',), subject=('power',))\n"
        "print([power(np.asarray(3.0), n=n).item() for n in (2, 3)])\n"
        "solve = Compiled(lambda a, b: jnp.linalg.solve(a, b), subject=('solve',))\n"
        "print(solve(2.0 * np.eye(3), np.ones(3)).tolist())"
    )
    for _ in range(2):
        found = python(program, JAX_COMPILATION_CACHE_DIR="").stdout
        assert found == "[2.0, 2.0]\n[2.0, 2.0]\n[9.0, 27.0]\n[0.5, 0.5, 0.5]\n"
    assert {"text", "power", "solve"} <= {
        file.name.partition("-")[0] for file in folder.iterdir()
    }
