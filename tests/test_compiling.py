"""How programs are compiled: accelerators that may be refused, the device, and runs inside a user's own program."""

import os
import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import closed_form, stop_scene

import simbrake as sb
from simbrake._base import _compiling
from simbrake._run import _simulate


@pytest.fixture
def fresh_accelerators():
    _compiling.accelerators.cache_clear()
    yield
    _compiling.accelerators.cache_clear()
    _simulate._program.cache_clear()
    _simulate._part.cache_clear()


def stopping_time(omega):
    return sb.simulate(stop_scene(w0=omega), rtol=1e-11, max_steps=128).stopping_time


def test_a_run_inside_a_program_of_the_user_is_one_function_unless_differentiated_or_vectorised(fresh_accelerators):
    # nothing was compiled before: what XLA accepts is found out in the midst of tracing
    plain = jax.jit(stopping_time).lower(20.0)
    assert ("xla_cpu_small_call" in plain.as_text()) == _compiling.accelerators("cpu").one_function
    truth = closed_form()["stop"]
    assert float(plain.compile()(20.0)) == pytest.approx(truth, rel=1e-10)

    speeds = jnp.asarray([10.0, 20.0])
    side_by_side = jax.jit(jax.vmap(stopping_time)).lower(speeds)
    slope = jax.jit(jax.value_and_grad(stopping_time)).lower(20.0)
    assert "xla_cpu_small_call" not in side_by_side.as_text() + slope.as_text()
    truths = [closed_form(w0=w)["stop"] for w in (10.0, 20.0)]
    np.testing.assert_allclose(side_by_side.compile()(speeds), truths, rtol=1e-10)
    value, by_speed = slope.compile()(20.0)
    central = closed_form(w0=20.0 + 1e-200j, xp=np)["stop"].imag / 1e-200
    assert float(value) == pytest.approx(truth, rel=1e-10)
    assert float(by_speed) == pytest.approx(central, rel=1e-9)


def test_what_xla_refuses_is_left_out(fresh_accelerators, monkeypatch):
    kept = dict(_compiling._CPU_OPTIONS)
    usual = _compiling.accelerators("cpu")
    _compiling.accelerators.cache_clear()
    monkeypatch.setattr(_compiling, "_CPU_OPTIONS", kept | {"xla_no_such_option": True})
    found = _compiling.accelerators("cpu")
    assert found.options == usual.options
    assert set(found.refused) == {*usual.refused, "xla_no_such_option"}


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


def test_the_process_is_left_as_it_was_and_the_device_is_the_one_asked_for():
    # two devices on one machine; as `XLA_FLAGS` may hold what the user has set, it is set here
    environment = dict(os.environ, XLA_FLAGS="--xla_force_host_platform_device_count=2", JAX_PLATFORMS="cpu")
    command = [sys.executable, "-c", PROGRAM]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=300)
    assert done.returncode == 0, done.stderr
    times, devices = done.stdout.splitlines()
    truth = closed_form()["stop"]
    assert [float(x) for x in times.split()] == pytest.approx([truth, truth], rel=1e-10)
    assert devices == "0 1"


def test_the_shipped_tableau_is_that_of_diffrax():
    import diffrax

    from simbrake.hybrid import ExplicitRungeKutta

    assert ExplicitRungeKutta.shipped("Dopri8") == ExplicitRungeKutta(diffrax.Dopri8())
