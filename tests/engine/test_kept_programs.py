"""Programs kept on disk: a second process compiles nothing, and finds the same
numbers."""

import dataclasses
import json

import numpy as np
import pytest
from commands import python
from helpers import near, nothing_compiled
from scenes import stop_scene

import simbrake as sb

RUN = """
import jax, logging, sys
jax.config.update("jax_log_compiles", True)
logging.basicConfig(stream=sys.stdout, format="%(message)s")
import simbrake as sb
scene = sb.read_scene(sys.argv[1])
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


@pytest.mark.slow
def test_a_second_process_compiles_nothing(folder, scenarios):
    """From Python; the report, a prepared run and its gradient too."""
    scene = scenarios / "u2_5_5_stop.toml"
    off = {"JAX_COMPILATION_CACHE_DIR": ""}
    first = python(RUN, scene, **off)
    assert "Compiling jit" in first.stdout
    again = python(RUN, scene, **off)
    assert "Compiling jit" not in again.stdout
    assert "Finished tracing" not in again.stdout
    answer = first.stdout[first.stdout.index("stopped:") :].replace("] True", "] False")
    assert again.stdout == answer
    assert first.stderr == again.stderr == ""
    assert all(file.stat().st_mode & 0o777 == 0o600 for file in folder.iterdir())


READ = """
import jax, sys
compiled = []
jax.monitoring.register_event_duration_secs_listener(
    lambda name, seconds, **about: compiled.append(about.get("fun_name")) if "backend_compile" in name else None
)
import simbrake as sb
str(sb.simulate(sb.read_scene(sys.argv[1])))
print(len(compiled), "equinox" in sys.modules)
"""


@pytest.mark.slow
@pytest.mark.parametrize("name", ["disc_stop.py", "unequal_bands.py"])
def test_a_result_is_read_without_compiling(folder, scenarios, name):
    """Areas, wear and joined bands are no operations of JAX by themselves; what traces
    programs is not loaded."""
    off = {"JAX_COMPILATION_CACHE_DIR": ""}
    assert python(READ, scenarios / name, **off).stdout.split()[1] == "True"
    assert python(READ, scenarios / name, **off).stdout.split() == ["0", "False"]


def test_other_limits_and_times_compile_nothing(folder, caplog):
    """What is wanted of a run is picked from what two programs show of it."""
    scene = stop_scene()
    str(sb.simulate(scene))
    limits = sb.Limits(max_drum_speed=1.0, max_tension="1 kN")
    with nothing_compiled(caplog):
        result = sb.simulate(dataclasses.replace(scene, limits=limits))
        assert "over_limit: tension" in str(result)
        assert len(result.series(np.linspace(0.0, 0.5, 7)).t) == 7


SLOPE = """
import json, sys
import jax
import simbrake as sb
compiled = []
jax.monitoring.register_event_duration_secs_listener(
    lambda name, seconds, **about: compiled.append(about.get("fun_name")) if "backend_compile" in name else None
)
scene = sb.read_scene(sys.argv[1])
def stop(omega):
    return sb.simulate(sb.with_values(scene, {"initial.omega": omega})).stopping_time
omega = float(scene.initial.omega)
slopes = [float(jax.grad(stop)(omega)), float(jax.jvp(stop, (omega,), (1.0,))[1]), float(jax.jacfwd(stop)(omega))]
print(json.dumps([slopes, compiled]))
if len(sys.argv) > 2:
    print(json.dumps([float(jax.jit(jax.grad(stop))(omega))]))
"""


@pytest.mark.slow
def test_gradients_outside_jit_are_kept(folder, scenarios):
    """A later process compiles single operations alone; a derivative inside of jit is
    that of JAX itself."""
    scene = scenarios / "u2_5_5_stop.toml"
    off = {"JAX_COMPILATION_CACHE_DIR": ""}
    first, inside = map(
        json.loads, python(SLOPE, scene, "jit", **off).stdout.splitlines()
    )
    again = json.loads(python(SLOPE, scene, **off).stdout)
    assert first[0] == again[0]
    near(first[0], inside * 3, 1e-12)
    assert "jit(slopes)" in first[1]
    assert not {"jit(slopes)", "jit(run)"}.intersection(again[1])


@pytest.mark.slow
def test_beside_the_cache_of_jax(folder, scenarios, tmp_path):
    """What JAX has read from its own cache can be stored and loaded, but not be
    called."""
    program = "import sys\nimport simbrake as sb\nprint(sb.simulate(sb.read_scene(sys.argv[1])))"
    scene = scenarios / "u2_5_5_stop.toml"
    jax_too = {
        "JAX_COMPILATION_CACHE_DIR": str(tmp_path / "jax"),
        "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0",
        "JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES": "-1",
    }
    first, second = (python(program, scene, **jax_too).stdout for _ in range(2))
    assert first == second
    assert not [
        file.name for file in folder.iterdir() if file.name.startswith(("run", "text"))
    ]
    # programs written without it serve beside it
    python(program, scene, JAX_COMPILATION_CACHE_DIR="")
    assert python(program, scene, **jax_too).stdout == first


@pytest.mark.slow
def test_a_users_law_is_compiled_once(folder, tmp_path, scenarios):
    scene = tmp_path / "mine.py"
    law = """
import pathlib, sys
import equinox as eqx
import simbrake as sb
class Mine(sb.friction.AbstractFriction):
    def static(self, contact):
        return {value} + 0.0 * contact.v
    def kinetic(self, contact):
        return {value} + 0.0 * contact.v
def scene():
    return eqx.tree_at(lambda s: s.brake.linings.friction, sb.read_scene(pathlib.Path(sys.argv[2])), Mine())
"""
    program = RUN.split("prepared =")[0] + "print(result)"
    found = []
    for value in (0.35, 0.35, 0.3):  # another number is another text of the program
        scene.write_text(law.format(value=value))
        found.append(
            python(
                program,
                scene,
                scenarios / "u2_5_5_stop.toml",
                JAX_COMPILATION_CACHE_DIR="",
            ).stdout
        )
    assert "Finished XLA compilation of jit(run)" in found[0]
    # (its values at the start are checked operation by operation)
    assert "Finished XLA compilation of jit(run)" not in found[1]
    assert "Finished XLA compilation of jit(run)" in found[2]
    stops = [text[text.index("course   ") :].splitlines()[0] for text in found]
    assert stops[0] == stops[1] != stops[2]
