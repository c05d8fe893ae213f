"""The cache on disk: the same numbers whatever the state of its folder, and nothing that another user could write."""

import json
import os
import pathlib
import re
import sys
import time
from types import SimpleNamespace

import diffrax
import jax
import numpy as np
import pytest
from commands import call, python
from stop_scenes import stop_scene

import simbrake as sb
from simbrake._base import _cache, _compiling


@pytest.fixture
def folder(monkeypatch, tmp_path):
    """An empty folder for kept programs."""
    monkeypatch.setenv("SIMBRAKE_CACHE_DIR", str(tmp_path / "kept"))
    return tmp_path / "kept"


def test_what_a_structure_is():
    scene = stop_scene()
    text = _cache.canonical(_compiling.pack(scene)[1])
    assert text == _cache.canonical(_compiling.pack(sb.with_values(scene, {"initial.omega": 3.0}))[1])
    other = stop_scene(n=19)
    assert text != _cache.canonical(_compiling.pack(other)[1])
    static = [_cache.canonical(sb.hybrid.ExplicitRungeKutta(solver)) for solver in (diffrax.Dopri8(), diffrax.Tsit5())]
    assert static[0] != static[1]

    class Mine(sb.friction.AbstractFriction):
        def static(self, contact):
            return 0.3 + 0.0 * contact.v

        def kinetic(self, contact):
            return 0.3 + 0.0 * contact.v

    for unknown in (Mine(), lambda x: x, jax.vmap(_cache.canonical), np.sin, object()):
        with pytest.raises(_cache.UnknownStructureError):
            _cache.canonical(unknown)
    assert _cache.key_of("law", Mine()) is None


def test_nothing_is_kept_while_jax_debugs():
    assert re.fullmatch("run-[0-9a-f]{40}", _cache.key_of("run", 1))
    for looking in (jax.disable_jit(), jax.debug_nans(True), jax.debug_infs(True)):
        with looking:
            assert _cache.key_of("run", 1) is None
    cpu = jax.local_devices(backend="cpu")[0]
    assert _cache.key_of("run", 1) != _cache.key_of("run", 1, cpu)


def test_what_is_in_the_key(monkeypatch):
    cpu = jax.local_devices(backend="cpu")[0]
    other = SimpleNamespace(platform="cpu", device_kind="other", client=cpu.client)
    keys = [_cache.key_of("run", 1, cpu), _cache.key_of("run", 2, cpu), _cache.key_of("run", 1, other)]
    monkeypatch.setenv("XLA_FLAGS", "--a")
    keys.append(_cache.key_of("run", 1, cpu))
    before = _cache._surroundings()
    assert all(word in before for word in (f"jax {jax.__version__}\n", sys.version, "_run/_simulate.py"))
    monkeypatch.setattr(_cache, "_surroundings", lambda: before.replace(jax.__version__, "0.0.1"))
    keys.append(_cache.key_of("run", 1, cpu))
    assert len(set(keys)) == len(keys)


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


def link_above(path):
    return link(path) / "below"


def file_instead(path):
    path.write_text("")
    return path


def sticky_folder(path):
    path.mkdir()
    path.chmod(0o1777)
    return path


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (writable_folder, "others may write to {place} (chmod go-w helps)"),
        (writable_parent, "others may write to {place.parent} (chmod go-w helps)"),
        (sticky_folder, "others may write to {place} (chmod go-w helps)"),
        (link, "{place} is a symbolic link"),
        (link_above, "{place.parent} is a symbolic link"),
        (file_instead, "{place.name}: Not a directory"),
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


def mode_of(path):
    return path.stat().st_mode & 0o7777


def test_a_folder_is_made_private(tmp_path):
    above, shared = tmp_path / "above", tmp_path / "shared"
    above.mkdir()
    (above / "mine").mkdir()
    for path, mode in ((above, 0o755), (above / "mine", 0o750)):
        path.chmod(mode)
    _cache.Folder(above / "mine")
    assert (mode_of(above), mode_of(above / "mine")) == (0o755, 0o700)
    shared.mkdir()
    shared.chmod(0o1777)  # as /tmp
    _cache.Folder(shared / "new" / "programs")
    assert [mode_of(path) for path in (shared, shared / "new", shared / "new" / "programs")] == [0o1777, 0o700, 0o700]


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


@pytest.mark.skipif(os.getuid() != 0, reason="only root can give files away")
def test_folders_above_may_belong_to_root(tmp_path, monkeypatch):
    (tmp_path / "theirs").mkdir(mode=0o700)
    (tmp_path / "mine").mkdir(mode=0o700)
    os.chown(tmp_path / "mine", 12345, 12345)
    monkeypatch.setattr(os, "getuid", lambda: 12345)
    assert _cache.Folder(tmp_path / "mine").entries() == []
    with pytest.raises(OSError, match="theirs belongs to another user"):
        _cache.Folder(tmp_path / "theirs")


@pytest.mark.parametrize(
    "damage",
    [
        lambda file: file.write_bytes(file.read_bytes()[:-1] + b"x"),
        lambda file: file.write_bytes(b""),
        lambda file: file.chmod(0o644),
        lambda file: (file.unlink(), file.symlink_to("/dev/null")),
    ],
    ids=["changed", "empty", "readable", "link"],
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


def test_files_unused_for_longest_go_first(folder, monkeypatch):
    monkeypatch.setenv("SIMBRAKE_CACHE_SIZE", "0.03")
    for i in range(3):
        _cache.cached("block", i, lambda: bytes(9_000))
        os.utime(folder / _cache.key_of("block", i), (i, i))
    _cache.cached("block", 0, lambda: b"")  # used again
    _cache.cached("block", 3, lambda: bytes(9_000))
    assert {file.name for file in folder.iterdir()} == {_cache.key_of("block", i) for i in (0, 2, 3)}


def test_no_more_than_the_limit_is_kept(folder, monkeypatch):
    """Three files of 10,000 bytes fill 0.03 MB; one byte more is too much."""
    monkeypatch.setenv("SIMBRAKE_CACHE_SIZE", "0.03")
    store = _cache.folder()
    store.write("a", b"")
    empty, now = store.entries()[0].size, time.time()
    for i, name in enumerate("abc"):
        store.write(name, bytes(10_000 - empty))
        os.utime(folder / name, (now + i, now + i))
    assert store.entries() == [
        _cache.Entry(name, 10_000, pytest.approx(now + i)) for i, name in ((2, "c"), (1, "b"), (0, "a"))
    ]
    store.write("b", bytes(10_001 - empty))
    os.utime(folder / "b", (now + 1, now + 1))
    for name, age in ((".young", 3000), (".old", 4000), ("b", 4000)):
        (folder / name).touch()
        os.utime(folder / name, (now - age, now - age))
    store.write("c", b"")
    assert {entry.name for entry in store.entries()} == {"b", "c", ".young"}
    assert (store.read("c"), store.read("d")) == (b"", None)
    (folder / "below").mkdir(mode=0o700)
    with pytest.raises(OSError, match="below is not a private file"):
        store.read("below")
    assert "below" not in [entry.name for entry in store.entries()]


@pytest.mark.parametrize(("text", "megabytes"), [("30", 30.0), ("0", 0.0), ("-3", 0.0), ("many", 512.0), (None, 512.0)])
def test_the_size_of_the_cache_is_a_setting(monkeypatch, text, megabytes):
    monkeypatch.delenv("SIMBRAKE_CACHE_SIZE", raising=False)
    if text is not None:
        monkeypatch.setenv("SIMBRAKE_CACHE_SIZE", text)
    assert _cache.limit() == megabytes


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
    """What JAX drops of the arguments is not in the text of a program, but the compiled one wants it in its place."""
    program = (
        "import numpy as np; import simbrake; from simbrake._base._compiling import DeviceJit\n"
        "for size in (2, 3):\n"
        "    print(DeviceJit(lambda x, unused: x + 1.0)(np.ones(2), np.ones(size)).tolist())"
    )
    assert python(program, JAX_COMPILATION_CACHE_DIR="").stdout == "[2.0, 2.0]\n[2.0, 2.0]\n"
    assert any(file.name.startswith("text") for file in folder.iterdir())


KEPT = """
import time
import jax, numpy as np, simbrake
from simbrake._base import _compiling
traced = []
def function(x):
    traced.append(x)
    time.sleep(0.5)
    return {"a": x.sum(), "b": (x * x)[:2]}
made = [_compiling.compiled(function, np.ones(3), subject=("probe", 1), quick=quick) for quick in (1, 1, 0, 1)]
made = [one._replace(quick=bool(one.quick)) for one in made]
print([one.quick for one in made], [one.one_function for one in made], len(traced))
print(made[0].trace_seconds >= 0.5 > made[0].compile_seconds > 0)
print([one[1:3] == made[0][1:3] for one in made], made[3][1:] == made[2][1:])
print(*({name: x.tolist() for name, x in one.call(np.arange(3.0)).items()} for one in made), sep="\\n")
power = _compiling.DeviceJit(lambda x, n, scale=1.0: scale * x**n, static_argnames="n", subject=("power",))
print([power(np.asarray(3.0), n=n).item() for n in (2, 3)], power(np.asarray(3.0), n=2, scale=np.asarray(2.0)).item())
"""


def test_quick_and_optimised_programs(folder):
    """The quick one is kept and read; where the optimised one is wanted it is made, and read by both from then on."""
    done = python(KEPT, JAX_COMPILATION_CACHE_DIR="").stdout.splitlines()
    assert done[0] == "[True, True, False, False] [True, True, True, True] 1"
    assert done[1] == "True"
    assert done[2] == "[True, True, False, False] True"
    assert done[3:7] == ["{'a': 3.0, 'b': [0.0, 1.0]}"] * 4
    assert done[7] == "[9.0, 27.0] 18.0"
    assert {file.name.partition("-")[0] for file in folder.iterdir()} == {"accelerators", "probe", "power"}
