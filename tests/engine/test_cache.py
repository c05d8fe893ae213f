"""The cache on disk: the same numbers whatever the state of its folder, and nothing that another user could write."""

import dataclasses
import functools
import json
import os
import pathlib
import platform
import re
import subprocess
import sys
import time
from types import SimpleNamespace

import diffrax
import jax
import numpy as np
import pytest
from commands import call
from stop_scenes import stop_scene

import simbrake as sb
from simbrake._base import _cache, _compiling
from simbrake._base._quantity import Over

RUN = """
import jax, logging, sys
jax.config.update("jax_log_compiles", True)
logging.basicConfig(stream=sys.stdout, format="%(message)s")
import simbrake as sb
from simbrake.files import open_scene
scene = open_scene(sys.argv[1])
result = sb.simulate(scene)
prepared = sb.prepare(scene, ["stopping_time"], rtol=1e-8)
numbers = float(result.stopping_time).hex(), prepared().metrics, prepared.gradient().tolist()
print(result, *numbers, "diffrax" in sys.modules)
"""


@pytest.fixture
def folder(monkeypatch, tmp_path):
    """An empty folder for kept programs."""
    monkeypatch.setenv("SIMBRAKE_CACHE_DIR", str(tmp_path / "kept"))
    return tmp_path / "kept"


def in_a_process(program, *arguments, **environment):
    options = {"capture_output": True, "text": True, "timeout": 300, "env": os.environ | environment}
    done = subprocess.run([sys.executable, "-c", program, *map(str, arguments)], **options)
    assert done.returncode == 0, done.stderr
    return done


@pytest.mark.slow
def test_a_second_process_compiles_nothing_and_finds_the_same_to_the_last_bit(folder, scenarios):
    """From Python; the report, a prepared run and its gradient too."""
    scene, off = scenarios / "u2_5_5_stop.toml", {"JAX_COMPILATION_CACHE_DIR": ""}
    first = in_a_process(RUN, scene, **off)
    assert "Compiling jit" in first.stdout
    again = in_a_process(RUN, scene, **off)
    assert "Compiling jit" not in again.stdout
    assert "Finished tracing" not in again.stdout
    answer = first.stdout[first.stdout.index("stopped:") :].replace("] True", "] False")
    assert again.stdout == answer
    assert first.stderr == again.stderr == ""
    assert all(file.stat().st_mode & 0o777 == 0o600 for file in folder.iterdir())


@pytest.mark.slow
def test_beside_the_cache_of_jax_no_program_is_written_that_cannot_run(folder, scenarios, tmp_path):
    """What JAX has read from its own cache can be stored and loaded, but not be called."""
    program = (
        "import sys\n"
        "import simbrake as sb; from simbrake.files import open_scene\n"
        "print(sb.simulate(open_scene(sys.argv[1])))"
    )
    scene, jax_too = (
        scenarios / "u2_5_5_stop.toml",
        {
            "JAX_COMPILATION_CACHE_DIR": str(tmp_path / "jax"),
            "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0",
            "JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES": "-1",
        },
    )
    first, second, third = (in_a_process(program, scene, **jax_too).stdout for _ in range(3))
    assert first == second == third
    assert not [file.name for file in folder.iterdir() if file.name.startswith(("run", "text"))]
    # programs written without it serve beside it
    in_a_process(program, scene, JAX_COMPILATION_CACHE_DIR="")
    assert in_a_process(program, scene, **jax_too).stdout == first


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


def of_package(name):
    """A function without a name of its own in a module of that name."""
    return eval("lambda x: x", {"__name__": f"{name}.mine"})


def test_structures_in_words():
    """Names of classes and functions of known packages, shapes and types; numbers where they are static."""
    for value, words in (
        (None, "None"),
        ((1, [2.5, "a"]), "builtins.tuple(1,builtins.list(2.5,'a'))"),
        ({"a": True}, "{'a':True}"),
        (np.zeros((2, 3)), "float64[2, 3]"),
        (jax.ShapeDtypeStruct((4,), np.int32), "int32[4]"),
        (np.dtype("int32"), "int32"),
        (Over.GAPS, "simbrake._base._quantity.Over.GAPS"),
        (_cache.canonical, "simbrake._base._cache.canonical"),
        ("".join, "builtins.str.join"),
        (functools.partial(int, 3), "functools.partialbuiltins.tuple(builtins.int,builtins.tuple(3),{})"),
    ):
        assert _cache.canonical(value) == words
    light, heavy = sb.Pulley(1.0, 2.0), sb.Pulley(1.0, 3.0)
    assert _cache.canonical(light) == _cache.canonical(heavy)
    assert _cache.canonical(light, static=True) != _cache.canonical(heavy, static=True)
    assert _cache.canonical(np.ones(2)) == _cache.canonical(np.zeros(2)) == "float64[2]"
    assert re.fullmatch(r"float64\[2\][0-9a-f]{64}", _cache.canonical(np.ones(2), static=True))
    held = dataclasses.make_dataclass("Held", [("x", object, dataclasses.field(metadata={"static": True}))])
    held.__module__ = "simbrake.mine"
    assert _cache.canonical(held(np.ones(2))) != _cache.canonical(held(np.zeros(2)))  # static where a field says so
    wrapped = functools.wraps(_cache.canonical)(lambda value: "")
    for unknown in (json.dumps, of_package("simbrake"), wrapped):
        with pytest.raises(_cache.UnknownStructureError):
            _cache.canonical(unknown)


def test_nothing_is_kept_of_what_jax_is_asked_to_look_at():
    assert re.fullmatch("run-[0-9a-f]{40}", _cache.key_of("run", 1))
    for looking in (jax.disable_jit(), jax.debug_nans(True), jax.debug_infs(True)):
        with looking:
            assert _cache.key_of("run", 1) is None
    cpu = jax.local_devices(backend="cpu")[0]
    assert _cache.key_of("run", 1) != _cache.key_of("run", 1, cpu)


def test_surroundings_are_the_sources_and_the_processor():
    package = os.path.dirname(sb.__file__)
    about = os.stat(os.path.join(package, "_run", "_simulate.py"))
    lines = _cache._surroundings().splitlines()
    assert f"{os.path.join('_run', '_simulate.py')} {about.st_size} {about.st_mtime_ns}" in lines
    assert not [line for line in lines if ".pyc" in line]
    first, rest = _cache._processor()[:3], _cache._processor()[3:]
    assert first == [platform.machine(), platform.system(), str(os.cpu_count())]
    assert all(line.startswith(("model", "flags", "Features", "CPU")) for line in rest)
    assert len({line for line in rest if line.startswith("flags")}) <= 1


def test_versions_sources_device_and_settings_are_in_the_key(monkeypatch):
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
def test_a_folder_that_is_not_safe_is_left_alone_with_one_line(make, words, monkeypatch, tmp_path, caplog):
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


def test_a_folder_is_made_private_and_those_above_stay_as_they_are(tmp_path):
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
def test_what_belongs_to_somebody_else_is_not_opened(what, folder, caplog):
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
def test_a_damaged_file_is_made_anew_with_one_line(damage, folder, caplog):
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


def test_the_files_unused_for_longest_go_first(folder, monkeypatch):
    monkeypatch.setenv("SIMBRAKE_CACHE_SIZE", "0.03")
    for i in range(3):
        _cache.cached("block", i, lambda: bytes(9_000))
        os.utime(folder / _cache.key_of("block", i), (i, i))
    _cache.cached("block", 0, lambda: b"")  # used again
    _cache.cached("block", 3, lambda: bytes(9_000))
    assert {file.name for file in folder.iterdir()} == {_cache.key_of("block", i) for i in (0, 2, 3)}


def test_no_more_than_the_limit_is_kept_and_nothing_of_killed_processes(folder, monkeypatch):
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


def test_why_a_file_is_not_read_or_written_is_said(folder, caplog):
    def failing(error):
        def restore(content):
            raise error

        return restore

    for error, words in (
        (OSError(5, "broken"), "[Errno 5] broken"),
        (OSError(5, "broken", "disk"), "disk: broken"),
        (ValueError("old"), "old"),
        (EOFError(), "EOFError"),
    ):
        _cache.write("sum-1", lambda: 3)
        assert _cache.read("sum-1", lambda content: content + 1) == 4
        assert _cache.read("sum-1", failing(error)) is None
        assert caplog.messages.pop() == f"simbrake: cache file sum-1 is unusable and will be replaced: {words}"
        caplog.clear()
        assert list(folder.iterdir()) == []
    assert _cache.read("sum-1", lambda content: content) is None
    for error, words in ((OSError(5, "broken"), "broken"), (OSError("strange"), "strange"), (ValueError("no"), "no")):
        _cache.write("sum-1", lambda error=error: failing(error)(None))
        assert caplog.messages.pop() == f"simbrake: a compiled program is not cached: {words}"
        caplog.clear()
    _cache.write(None, lambda: 3)  # what has no key
    assert _cache.read(None, lambda content: content) is None
    assert (caplog.messages, list(folder.iterdir())) == ([], [])


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


@pytest.mark.slow
def test_a_users_own_law_is_traced_each_time_and_compiled_once(folder, tmp_path, scenarios):
    scene = tmp_path / "mine.py"
    law = """
import pathlib, sys
import equinox as eqx
import simbrake as sb
from simbrake.files import open_scene
class Mine(sb.friction.AbstractFriction):
    def static(self, contact):
        return {value} + 0.0 * contact.v
    def kinetic(self, contact):
        return {value} + 0.0 * contact.v
def scene():
    return eqx.tree_at(lambda s: s.brake.linings.friction, open_scene(pathlib.Path(sys.argv[2])), Mine())
"""
    program = RUN.split("prepared =")[0] + "print(result)"
    found = []
    for value in (0.35, 0.35, 0.3):
        scene.write_text(law.format(value=value))
        found.append(in_a_process(program, scene, scenarios / "u2_5_5_stop.toml", JAX_COMPILATION_CACHE_DIR="").stdout)
    assert "Finished XLA compilation of jit(<lambda>)" in found[0]
    assert "Finished XLA compilation" not in found[1]
    assert "Finished XLA compilation of jit(<lambda>)" in found[2]
    stops = [text[text.index("stop     after") :].splitlines()[0] for text in found]
    assert stops[0] == stops[1] != stops[2]


def test_a_program_that_is_run_often_is_compiled_again_and_agrees():
    scene, numbers = stop_scene(), {"initial.omega": 20.0}
    program = _compiling.Improving(
        lambda quick: _compiling.compiled(lambda x: jax.numpy.sin(x) @ x, np.ones(3), quick=quick)
    )
    quick, x = program._program, np.asarray([0.1, 0.2, 0.3])
    for _ in range(3):
        found = program(x)
    assert program._program is quick  # three runs are not worth it
    program._worth = 0.0
    program(x)
    program._thread.join()
    assert program._program is not quick
    assert abs(program(x) - found) <= 1e-15
    result = sb.simulate(sb.with_values(scene, numbers))
    run = sb.prepare(scene, ["stopping_time"])(numbers)  # with the optimiser
    assert run.metrics["stopping_time"] == pytest.approx(float(result.stopping_time), rel=1e-11)


def test_one_text_with_other_arguments_that_it_does_not_use_is_another_program(folder):
    """What JAX drops of the arguments is not in the text of a program, but the compiled one wants it in its place."""
    program = (
        "import numpy as np; import simbrake; from simbrake._base._compiling import DeviceJit\n"
        "for size in (2, 3):\n"
        "    print(DeviceJit(lambda x, unused: x + 1.0)(np.ones(2), np.ones(size)).tolist())"
    )
    assert in_a_process(program, JAX_COMPILATION_CACHE_DIR="").stdout == "[2.0, 2.0]\n[2.0, 2.0]\n"
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


def test_a_quick_program_is_not_taken_for_an_optimised_one(folder):
    """The quick one is kept and read; where the optimised one is wanted it is made, and read by both from then on."""
    done = in_a_process(KEPT, JAX_COMPILATION_CACHE_DIR="").stdout.splitlines()
    assert done[0] == "[True, True, False, False] [True, True, True, True] 1"
    assert done[1] == "True"
    assert done[2] == "[True, True, False, False] True"
    assert done[3:7] == ["{'a': 3.0, 'b': [0.0, 1.0]}"] * 4
    assert done[7] == "[9.0, 27.0] 18.0"
    assert {file.name.partition("-")[0] for file in folder.iterdir()} == {"accelerators", "probe", "power"}
