"""Sizes of compiled runs and their steps, as upper bounds: what a change of the
equations may not make dearer."""

import jax
import jax.numpy as jnp
import pytest
import shipped

import simbrake as sb

#: instructions of the optimised program (JAX 0.10.2), and step attempts at rtol 1e-10:
#: lower them with the programs
BOUNDS = {
    "u2_5_5_stop": (6_500, 13),
    "everything_coupled": (82_000, 246),
    "tripping_30_stands": (29_000, 14_800),
}
SCENES = pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=() if name == "u2_5_5_stop" else pytest.mark.slow)
        for name in BOUNDS
    ],
)


@SCENES
def test_compiled_instructions(name):
    scene = shipped.load(name).scene()

    def stop(omega):
        return sb.simulate(
            sb.with_values(scene, {"initial.omega": omega}), throw=False
        ).stopping_time

    text = jax.jit(stop).lower(jnp.asarray(10.0)).compile().as_text()
    # other releases of JAX write functions of their own otherwise
    assert text.count(" = ") <= 1.15 * BOUNDS[name][0]


@pytest.mark.slow
@SCENES
def test_step_attempts(name):
    solver = sb.simulate(shipped.load(name).scene(), rtol=1e-10).summary()["solver"]
    # processors round differently
    assert (
        sum(solver[k] for k in ("steps", "rejected", "retaken"))
        <= 1.0 + 1.02 * BOUNDS[name][1]
    )
