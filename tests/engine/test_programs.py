"""Compiled programs as users meet them: inside their own, side by side, in many
structures, on other devices."""

import json
import os
import pathlib
import subprocess
import sys

import jax
import numpy as np
import pytest
from commands import python
from helpers import all_near, near
from scenes import closed_form, stop_run, stop_scene

import simbrake as sb


@pytest.mark.slow
@pytest.mark.parametrize("room", ["320", "0"])
def test_a_run_inside_a_program_of_the_user(room, monkeypatch):
    """Also where there is no room (MB): each new program ends the one before, while
    another one is traced."""
    monkeypatch.setenv("SIMBRAKE_PROGRAM_MEMORY", room)

    def stopping_time(omega):
        stop_run(7)
        return sb.simulate(
            stop_scene(w0=omega), rtol=1e-11, max_steps=128
        ).stopping_time

    value, slope = jax.jit(jax.value_and_grad(stopping_time))(20.0)
    truth, central = (closed_form(w0=w, xp=np)["stop"] for w in (20.0, 20.0 + 1e-200j))
    near(value, truth, 1e-10)
    near(slope, central.imag / 1e-200, 1e-9)


@pytest.mark.slow
def test_scenes_of_numpy_side_by_side_inside_a_program():
    """`vmap` over stacked scenes within `jit`, as a sampler has it: the runs are those
    of each scene."""
    brake = sb.Brake(
        sb.Pulley(0.5, 800.0), sb.Band(0.5), sb.uniform_linings(2, 4.7, 0.35)
    )
    scene = sb.Scene(brake, sb.Duty(8e3, 1e3), sb.Initial(20.0), 5.0)
    both = jax.tree.map(lambda x: np.stack([x, x]), scene)

    def times(speed):
        found = jax.vmap(
            lambda one: (
                sb.simulate(sb.with_values(one, {"initial.omega": speed})).stopping_time
            )
        )
        return found(both)

    alone = sb.simulate(sb.with_values(scene, {"initial.omega": 18.0})).stopping_time
    all_near(jax.jit(times)(18.0), [alone, alone], 1e-12)


@pytest.mark.slow
def test_many_structures_with_prints_and_gradients():
    """A short turn of the script that tries a thousand of them (with the options of
    users)."""
    script = pathlib.Path(__file__).parents[1] / "many_structures.py"
    users = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("XLA_", "JAX_"))
    }
    done = subprocess.run(
        [sys.executable, script, "24", "12"],
        capture_output=True,
        text=True,
        env=users,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["mappings"] < 20_000
    assert found["megabytes"] < 1500.0


PROGRAM = """
import os
before = dict(os.environ)
import jax
values = dict(jax.config.values) | {"jax_enable_x64": True}  # the one change that simbrake makes
import simbrake as sb
scene = sb.read_scene("u2_5_5_stop")
here = sb.simulate(scene)
sb.ensemble(scene, {"initial.omega": [18.0, 20.0]}, ("stopping_time",))
assert dict(os.environ) == before, "the environment"
assert dict(jax.config.values) == values, "JAX's configuration"
with jax.default_device(jax.devices()[1]):
    there = sb.simulate(scene)
print(float(here.stopping_time), float(there.stopping_time))
"""


@pytest.mark.slow
def test_process_is_left_as_it_was_and_other_devices_serve():
    # two devices on one machine; as `XLA_FLAGS` may hold what the user has set, it is
    # set here
    flags = "--xla_force_host_platform_device_count=2"
    here, there = map(
        float, python(PROGRAM, XLA_FLAGS=flags, JAX_PLATFORMS="cpu").stdout.split()
    )
    near(here, there, 1e-10)
