"""Compiled programs: the bound of those in memory, what is compiled how, and for which device."""

import gc
import importlib
import json
import os
import pathlib
import subprocess
import sys
import weakref
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from commands import python
from stop_scenes import closed_form, stop_scene

import simbrake as sb
from simbrake._base import _compiling, _programs
from simbrake._base._programs import STORE, Kept, Store, mappings
from simbrake.runs import simulate as _simulate

on_linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs /proc/self/maps")


@pytest.fixture
def store(monkeypatch):
    """A store for this test alone, with room for everything."""
    own = Store()
    monkeypatch.setenv("SIMBRAKE_PROGRAM_MEMORY", "1e6")
    for module in (_programs, _compiling):
        monkeypatch.setattr(module, "STORE", own)
    return own


def tiny():
    return _compiling.DeviceJit(lambda x: jnp.sort(jnp.sin(x))[::-1] + jnp.sum(x), subject=("tiny", object()))


def called(program, n, value=1.0):
    return np.asarray(program(np.full(n, value)))


def test_the_least_recently_used_go(store, monkeypatch):
    program = tiny()
    first = called(program, 1)
    each = store.memory
    monkeypatch.setenv("SIMBRAKE_PROGRAM_MEMORY", str(4.5 * each))
    for n in (2, 3, 4):
        called(program, n)
    assert len(store) == 4
    held = {key[2][0][0][0]: weakref.ref(entry.value.call) for key, entry in store._entries.items()}
    called(program, 1)
    called(program, 5)  # one too many: down to three
    assert [held[n]() is None for n in (1, 2, 3, 4)] == [False, True, True, False]
    assert (len(store), store.made) == (3, 5)
    np.testing.assert_array_equal(called(program, 1), first)
    assert store.made == 5
    called(program, 2)
    assert store.made == 6


@pytest.mark.slow
@on_linux
def test_mappings_are_given_back(store, monkeypatch):
    program = tiny()
    jax.jit(jnp.sort)(np.ones(7))  # threads of the compiler have mappings too
    monkeypatch.setenv("SIMBRAKE_PROGRAM_MAPPINGS", "120")
    before = mappings()
    monkeypatch.setattr(_programs, "mappings", lambda: mappings() - before)  # those of these programs alone
    counts = [0]
    for n in range(1, 50):
        called(program, n)
        counts.append(mappings() - before)
    each = max(np.diff(counts))
    assert 0 < each < 30
    assert 49 * each > 4 * 120  # they would exceed it by far
    assert max(counts) <= 120 + _programs._LEAST_MADE * each
    store.forget()
    assert mappings() - before <= each


def test_mappings_of_others_are_left_alone(store, monkeypatch):
    program = tiny()
    monkeypatch.setattr(_programs, "mappings", lambda: 5000 + 12 * len(store))
    monkeypatch.setenv("SIMBRAKE_PROGRAM_MAPPINGS", "2000")
    cleared = []
    monkeypatch.setattr(jax, "clear_caches", lambda: cleared.append(store.made))
    for n in range(1, 16):
        called(program, n)
    assert len(cleared) == 1
    assert len(store) == 15


def test_jax_cleared_once_a_store_has_gone(store, monkeypatch):
    class Part(NamedTuple):
        run: Any
        lines: int = 1000

        def clear_cache(self):
            self.run.clear_cache()

    alive, cleared = weakref.WeakSet(), []

    @Kept
    def part(n):
        run = jax.jit(lambda x: x * n)
        alive.add(run)
        return Part(run)

    monkeypatch.setenv("SIMBRAKE_PROGRAM_MEMORY", "20")  # four of them
    monkeypatch.setattr(jax, "clear_caches", lambda: cleared.append(store.made))
    for n in range(12):
        assert float(part(n).run(2.0)) == 2.0 * n
    gc.collect()
    assert len(alive) == len(store) <= 4
    assert cleared == [9]


def test_programs_go_with_their_owner(store):
    program, other = tiny(), tiny()
    called(program, 1)
    called(other, 1)
    del program
    gc.collect()
    called(other, 2)
    assert len(store) == 2


@pytest.mark.slow
def test_a_prepared_run_keeps_its_program(monkeypatch):
    prepared = sb.prepare(stop_scene(), ["stopping_time"])
    value, slope = prepared().metrics["stopping_time"], prepared.gradient()
    STORE.forget()
    jax.clear_caches()
    monkeypatch.setattr(_simulate, "compiled", None)
    assert prepared().metrics["stopping_time"] == value
    np.testing.assert_array_equal(prepared.gradient(), slope)


@pytest.mark.slow
def test_programs_may_go_while_one_is_traced(store, monkeypatch):
    def stopping_time(omega):
        called(tiny(), 3)
        return sb.simulate(stop_scene(w0=omega), max_steps=128).stopping_time

    monkeypatch.setenv("SIMBRAKE_PROGRAM_MEMORY", "0")  # each new one ends the one before, and what JAX keeps
    value, slope = jax.jit(jax.value_and_grad(stopping_time))(20.0)
    truth, central = (closed_form(w0=w, xp=np)["stop"] for w in (20.0, 20.0 + 1e-200j))
    assert float(value) == pytest.approx(truth, rel=1e-9)
    assert float(slope) == pytest.approx(central.imag / 1e-200, rel=1e-8)
    assert store.made == 2
    assert len(store) == 1


@pytest.mark.slow
@on_linux
def test_every_program_can_be_given_back():
    """Of runs, a print, series, derivatives, a study and a stepper nothing stays."""

    def everything(n):
        scene = stop_scene(n, beta=270 / n, end=20.0)
        result = sb.simulate(scene)
        str(result)
        result.series([0.0, 0.1])
        sb.simulate(scene, max_steps=2048)
        sb.prepare(scene, ["stopping_time"])({"initial.omega": 18.0})
        jax.grad(lambda w: sb.simulate(stop_scene(n, beta=270 / n, w0=w, end=20.0)).stopping_time)(20.0)
        sb.ensemble(scene, {"initial.omega": [18.0, 20.0]}, ["stopping_time"], progress=False, workers=1, chunk=2)
        stepper = sb.Stepper(scene, inputs=["lever"])
        stepper.advance(0.1, lever=4e3)

    def given_back():
        gc.collect()
        STORE.forget()
        jax.clear_caches()
        gc.collect()
        return mappings()

    for library in ("pandas", "xarray"):  # have mappings, too
        importlib.import_module(library)
    before = given_back()
    everything(9)
    used = mappings() - before
    assert used > 400
    assert given_back() - before < 100  # more libraries


@pytest.mark.slow
@on_linux
def test_programs_of_structures_stay_bounded(monkeypatch):
    """Seven structures with room for two."""
    STORE.forget()
    jax.clear_caches()
    sb.simulate(stop_scene(8))
    each, before = STORE.memory, mappings()
    monkeypatch.setenv("SIMBRAKE_PROGRAM_MEMORY", str(2.5 * each))
    found, most = [], 0
    for n in (*range(8, 15), 8):
        found.append(float(sb.simulate(stop_scene(n)).stopping_time))
        most = max(most, STORE.memory)
    assert most <= 2.5 * each
    assert found[0] == found[-1]
    assert mappings() - before < 60


@pytest.mark.slow
def test_many_structures_with_prints_and_gradients():
    """A short turn of the script that tries a thousand of them (with the options of users)."""
    script = pathlib.Path(__file__).parents[1] / "many_structures.py"
    users = {name: value for name, value in os.environ.items() if not name.startswith(("XLA_", "JAX_"))}
    done = subprocess.run([sys.executable, script, "52", "24"], capture_output=True, text=True, env=users, check=False)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["mappings"] < 20_000
    assert found["megabytes"] < 1500.0


@pytest.fixture
def fresh_accelerators():
    _compiling.accelerators.cache_clear()
    yield
    _compiling.accelerators.cache_clear()
    _simulate._program.cache_clear()
    _simulate._part.cache_clear()


def stopping_time(omega):
    return sb.simulate(stop_scene(w0=omega), rtol=1e-11, max_steps=128).stopping_time


@pytest.mark.slow
def test_a_run_inside_a_program_of_the_user(fresh_accelerators):
    # nothing was compiled before: what XLA accepts is found out in the midst of tracing
    plain = jax.jit(stopping_time).lower(20.0)
    assert ("xla_cpu_small_call" in plain.as_text()) == _compiling.accelerators("cpu").one_function
    truth = closed_form()["stop"]
    assert float(plain.compile()(20.0)) == pytest.approx(truth, rel=1e-10)
    slope = jax.jit(jax.value_and_grad(stopping_time)).lower(20.0)
    assert "xla_cpu_small_call" not in slope.as_text()
    value, by_speed = slope.compile()(20.0)
    central = closed_form(w0=20.0 + 1e-200j, xp=np)["stop"].imag / 1e-200
    assert float(value) == pytest.approx(truth, rel=1e-10)
    assert float(by_speed) == pytest.approx(central, rel=1e-9)


def test_scenes_of_numpy_side_by_side_inside_a_program():
    """`vmap` over stacked scenes within `jit`, as a sampler has it: the runs are those of each scene."""
    brake = sb.Brake(sb.Pulley(0.5, 800.0), sb.Band(0.5), sb.uniform_linings(2, 4.7, 0.35))
    scene = sb.Scene(brake, sb.Duty(8e3, sb.TorqueLoad(1e3)), sb.Initial(20.0), 5.0)
    both = jax.tree.map(lambda x: np.stack([x, x]), scene)

    def times(speed):
        found = jax.vmap(lambda one: sb.simulate(sb.with_values(one, {"initial.omega": speed})).stopping_time)
        return found(both)

    alone = sb.simulate(sb.with_values(scene, {"initial.omega": 18.0})).stopping_time
    np.testing.assert_allclose(jax.jit(times)(18.0), [alone, alone], rtol=1e-12)


def test_what_xla_refuses_is_left_out(fresh_accelerators, monkeypatch):
    usual = _compiling.accelerators("cpu")
    gone = usual.refused
    assert set(gone) <= {"xla_cpu_use_fusion_emitters"}  # all that a tested version of JAX no longer has
    kept = {name: value for name, value in _compiling._CPU_OPTIONS.items() if name not in gone}
    more = dict(_compiling._ONE_FUNCTION_OPTIONS)
    assert usual == (kept, kept | more, True, gone)
    for name in ("_CPU_OPTIONS", "_ONE_FUNCTION_OPTIONS"):
        _compiling.accelerators.cache_clear()
        with monkeypatch.context() as here:
            here.setattr(_compiling, name, getattr(_compiling, name) | {"xla_no_such_option": True})
            found = _compiling.accelerators("cpu")
            assert found == usual._replace(refused=found.refused)
            assert sorted(found.refused) == sorted((*gone, "xla_no_such_option"))
    _compiling.accelerators.cache_clear()

    def unmarked(function, numbers):
        raise NotImplementedError

    monkeypatch.setattr(_compiling, "one_function", unmarked)
    assert _compiling.accelerators("cpu") == (kept, kept | more, False, (*gone, "xla_cpu_small_call"))
    assert _compiling.accelerators("gpu") == ({}, {}, False, ())


@pytest.mark.slow
def test_answers_do_not_need_any_accelerator(fresh_accelerators, monkeypatch):
    none = _compiling.Accelerators({}, {}, False, ())
    for module in (_compiling, _simulate):
        monkeypatch.setattr(module, "accelerators", lambda platform: none)
    _simulate._program.cache_clear()
    _simulate._part.cache_clear()
    truth = closed_form()["stop"]
    assert float(sb.simulate(stop_scene(), rtol=1e-11, max_steps=128).stopping_time) == pytest.approx(truth, rel=1e-10)
    within = jax.jit(lambda omega: stopping_time(omega)).lower(20.0)  # (a new function: nothing traced before)
    assert "xla_cpu_small_call" not in within.as_text()
    assert float(within.compile()(20.0)) == pytest.approx(truth, rel=1e-10)


def test_the_device_of_a_run(monkeypatch):
    with jax.default_device("cpu"):
        assert _compiling.run_device() == jax.local_devices(backend="cpu")[0]
    monkeypatch.setattr(jax, "local_devices", lambda backend=None: {None: ["gpu:0", "gpu:1"]}[backend])
    with pytest.raises(KeyError):
        jax.local_devices("cpu")

    def without_cpu(backend=None):
        if backend == "cpu":
            raise RuntimeError("no such backend")
        return ["gpu:0", "gpu:1"]

    monkeypatch.setattr(jax, "local_devices", without_cpu)
    assert _compiling.run_device() == "gpu:0"


def test_what_answers_are_remembered_by():
    asked = []

    @_compiling.per_value(lambda part: part["x"])
    def twice(part):
        asked.append(part)
        return 2 * float(np.sum(part["x"]))

    for i in (0, 1, 0, 1):
        assert twice({"x": np.asarray(float(i)), "y": i}) == 2.0 * i
    assert len(asked) == 2
    assert twice({"x": np.asarray([1.0, 2.0])}) == 6.0


def test_what_calls_a_library():
    a = np.arange(9.0) + np.eye(3).ravel()

    def solved(x):
        return jnp.linalg.solve(x.reshape(3, 3), jnp.ones(3))

    program = _compiling.compiled(solved, a)
    assert not program.one_function
    np.testing.assert_allclose(program.call(a), np.linalg.solve(a.reshape(3, 3), np.ones(3)), rtol=1e-13)
    other = _compiling.compiled(solved, a, otherwise=lambda x: 2 * solved(x))
    np.testing.assert_allclose(other.call(a), 2 * np.asarray(program.call(a)), rtol=1e-15)
    assert _compiling.compiled(jnp.tan, a, otherwise=solved).one_function == (jax.default_backend() == "cpu")


PROGRAM = """
import os
before = dict(os.environ)
import jax
values = dict(jax.config.values) | {"jax_enable_x64": True}  # the one change that simbrake makes
import math, numpy as np
import simbrake as sb
linings = sb.uniform_linings(20, math.radians(270), sb.ConstantFriction(0.35))
brake = sb.Brake(sb.Pulley(0.725, 800.0), sb.Band(0.725, 2e5), linings)
scene = sb.Scene(brake, sb.Duty(sb.Constant(8e3), sb.TorqueLoad()), sb.Initial(20.0), 5.0)
from simbrake._base._compiling import Packed
unpack, used = Packed.unpack, []
Packed.unpack = lambda packed: (used.extend(d.id for d in packed.numbers.devices()), unpack(packed))[1]
here = sb.simulate(scene, max_steps=128)
sb.ensemble(scene, {"initial.omega": np.asarray([18.0, 20.0])}, ("stopping_time",), max_steps=128)
assert dict(os.environ) == before, "the environment"
assert dict(jax.config.values) == values, "JAX's configuration"
with jax.default_device(jax.devices()[1]):
    there = sb.simulate(scene, max_steps=128)
print(float(here.stopping_time), float(there.stopping_time))
print(*used)
"""


@pytest.mark.slow
def test_process_and_device_are_as_asked_for():
    # two devices on one machine; as `XLA_FLAGS` may hold what the user has set, it is set here
    environment = {"XLA_FLAGS": "--xla_force_host_platform_device_count=2", "JAX_PLATFORMS": "cpu"}
    times, devices = python(PROGRAM, **environment).stdout.splitlines()
    truth = closed_form()["stop"]
    assert [float(x) for x in times.split()] == pytest.approx([truth, truth], rel=1e-10)
    assert devices == "0 0 0 1"  # the run, two runs of the ensemble, the run elsewhere
