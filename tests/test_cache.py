"""The cache on disk: the same numbers whatever the state of its folder, and nothing that another user could write."""

import json
import os
import subprocess
import sys
from types import SimpleNamespace

import diffrax
import jax
import numpy as np
import pytest
from helpers import stop_scene
from test_cli import call

import simbrake as sb
from simbrake._base import _cache, _compiling

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


@pytest.mark.parametrize("make", [writable_folder, writable_parent, link, link_above, file_instead])
def test_a_folder_that_is_not_safe_is_left_alone_with_one_line(make, monkeypatch, tmp_path, caplog):
    place = make(tmp_path / "place")
    monkeypatch.setenv("SIMBRAKE_CACHE_DIR", str(place))
    before = sorted(tmp_path.rglob("*"))
    assert _cache.cached("sum", (1, 2), lambda: 3) == 3
    assert _cache.cached("sum", (1, 2), lambda: 4) == 4
    assert sorted(tmp_path.rglob("*")) == before
    (said,) = caplog.messages
    assert said.startswith("simbrake: compiled programs are not cached: ")
    assert "\n" not in said


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
    monkeypatch.delenv("XDG_CACHE_HOME")
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
