"""Compiled programs in memory: the bound is held, the least recently used go and give back what they hold."""

import gc
import sys
import threading
import weakref
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from stop_scenes import closed_form, stop_scene

import simbrake as sb
from simbrake._base import _compiling, _programs
from simbrake._base._programs import STORE, Kept, Store, mappings
from simbrake._run import _simulate

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


def test_jax_is_cleared_once_a_store_has_gone(store, monkeypatch):
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


def test_of_two_threads_one_compiles(store):
    made, gate = [], threading.Barrier(2)

    @Kept
    def slow(name):
        made.append(name)
        threading.Event().wait(0.05)
        return Program(name)

    class Program(NamedTuple):
        name: str
        lines: int = 1

    def ask():
        gate.wait()
        assert slow("a").name == "a"

    threads = [threading.Thread(target=ask) for _ in range(2)]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    assert made == ["a"]
    assert not store._gates


def test_a_failed_compilation_is_tried_again(store):
    @Kept
    def fails(name):
        raise ValueError(name)

    for _ in range(2):
        with pytest.raises(ValueError, match="a"):
            fails("a")
    assert len(store) == 0


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
        sb.ensemble(scene, {"initial.omega": [18.0, 20.0]}, ["stopping_time"], progress=False, workers=1)
        stepper = sb.Stepper(scene, inputs=["lever"])
        stepper.advance(0.1, lever=4e3)

    def given_back():
        gc.collect()
        STORE.forget()
        jax.clear_caches()
        gc.collect()
        return mappings()

    before = given_back()
    everything(9)
    used = mappings() - before
    assert used > 500
    assert given_back() - before < 100  # libraries that were loaded


@pytest.mark.slow
@on_linux
def test_structures_stay_within_a_small_bound(monkeypatch):
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
