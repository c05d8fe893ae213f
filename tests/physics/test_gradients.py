"""First derivatives with respect to every number: forward = reverse = closed form =
central differences."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import all_near, jacobians, near
from jax.flatten_util import ravel_pytree
from scenes import GAIN, closed_form, stop_scene

import simbrake as sb


def stopping_time(scene, max_steps=128):
    return sb.simulate(scene, rtol=1e-12, max_steps=max_steps).stopping_time


@pytest.mark.smoke
def test_every_number_has_exact_derivatives():
    scene = jax.tree.map(jnp.asarray, stop_scene())
    vector, tree = ravel_pytree(scene)
    forward, reverse = (
        tree(x) for x in jacobians(lambda x: stopping_time(tree(x)))(vector)[1:]
    )
    numbers = [(leaf.path, leaf.value) for leaf in sb.files.leaves(reverse)]
    assert len(numbers) >= 12
    scale = {
        leaf.path: np.maximum(np.abs(np.asarray(leaf.value)), 1e-3)
        for leaf in sb.files.leaves(scene)
    }
    for (path, a), leaf in zip(numbers, sb.files.leaves(forward), strict=True):
        all_near(
            np.asarray(a) * scale[path],
            np.asarray(leaf.value) * scale[path],
            1e-10,
            1e-12,
            err_msg=path,
        )

    def truth(f, beta, R, J, C, T0, w0):
        return closed_form(f=f, beta=beta, R=R, J=J, C=C, T0=T0, w0=w0, xp=jnp)["stop"]

    values = (0.35, 13.5, 0.725, 800.0, 2e5, 8e3, 20.0)
    f, beta, R, J, C, T0, w0 = jax.jit(jax.grad(truth, argnums=tuple(range(7))))(
        *values
    )
    got = reverse
    pairs = {
        "f": (got.brake.linings.friction.coefficient, f),
        "beta": (np.sum(got.brake.linings.angle) * math.pi / 180, beta),
        "R": (got.brake.band.radius, R),
        "J": (got.brake.pulley.inertia, J),
        "C": (got.brake.band.stiffness, C),
        "T0": (got.duty.slack_tension.level, T0),
        "w0": (got.initial.omega, w0),
    }
    for name, (a, b) in pairs.items():
        assert float(a) == pytest.approx(float(b), rel=1e-9), name
    # numbers that cannot matter, and the start of the clock
    assert float(got.end_time) == 0.0
    near(got.initial.time, 1.0, 1e-10)


@pytest.mark.slow
def test_derivatives_by_start_and_end_time():
    """`ω = ω_0 − a (t_1 − t_0)` and its angle in a stop that the end of the run cuts
    off, both ways."""

    def end(x):
        scene = stop_scene(C=None, w0=x[2], time=x[0], end=x[1])
        state = sb.simulate(scene, rtol=1e-12).record.y_end
        return jnp.stack([state.omega, state.phi])

    value, forward, reverse = jacobians(end)(jnp.array([0.1, 0.4, 20.0]))
    a = 8e3 * GAIN / 800.0
    omega = 20.0 - a * 0.3
    all_near(value, [omega, 20.0 * 0.3 - 0.5 * a * 0.3**2], 1e-12)
    for found in (forward, reverse):
        all_near(found, [[a, -a, 1.0], [-omega, omega, 0.3]], 1e-11)


@pytest.mark.slow
def test_metrics_differentiable_outside_jit():
    """Where only the numbers that are differentiated are traced, and the modes of the
    run are known."""

    def asked(w0):
        result = sb.simulate(stop_scene(C=None, w0=w0), rtol=1e-12, max_steps=64)
        return (
            result.stopping_time,
            result.stopping_angle,
            result.max_tension.value,
            result.energy["friction_heat"],
        )

    values, slopes = jax.jvp(asked, (20.0,), (1.0,))
    t, phi, T, heat = (float(x) for x in values)
    # a constant torque M stops J ω₀ after t = J ω₀/M, φ = ω₀ t/2, with J ω₀²/2 of heat;
    # tensions do not know the speed
    for slope, truth in zip(
        slopes, (t / 20, 2 * phi / 20, 0.0, 2 * heat / 20), strict=True
    ):
        near(slope, truth, 1e-9, 1e-9 * T)
    near(heat, 0.5 * 800.0 * 20.0**2, 1e-9)


#: room for so many step attempts makes derivatives be compiled as long runs have them
LONG = 9000


@pytest.mark.slow
def test_gradients_with_room_for_a_long_run():
    """Both ways, by the friction and the speed at the start; a derivative of a
    derivative is refused there too."""

    def stop(x):
        return stopping_time(stop_scene(f=x[0], w0=x[1]), LONG)

    x = jnp.array([0.35, 20.0])
    truth = jax.jit(jax.grad(lambda x: closed_form(f=x[0], w0=x[1], xp=jnp)["stop"]))(x)
    all_near(jax.jit(jax.grad(stop))(x), truth, 1e-9)
    direction = jnp.array([0.1, 2.0])
    slope = jax.jit(lambda x: jax.jvp(stop, (x,), (direction,))[1])(x)
    all_near(slope, truth @ direction, 1e-9)
    # outside of jit, with too many rows for a matrix of all derivatives
    _, slope = jax.jvp(
        lambda w: stopping_time(stop_scene(w0=w), 400_000), (20.0,), (2.0,)
    )
    near(slope, 2.0 * float(truth[1]), 1e-9)
    with pytest.raises(NotImplementedError, match="first derivatives only"):
        jax.jit(jax.hessian(stop))(x)


@pytest.mark.parametrize(
    "slope_of",
    [
        pytest.param(jax.jacfwd, id="forward", marks=pytest.mark.slow),
        pytest.param(lambda f: jax.jit(jax.jacrev(f)), id="reverse in jit"),
        pytest.param(
            lambda f: lambda x: jax.vmap(jax.jacrev(f))(x[None])[0],
            id="mapped",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_what_never_comes_has_no_derivative(slope_of):
    """Forward, reverse, mapped, inside and outside of jit; other metrics of the same
    run keep theirs; in reverse, what is bounded above has a slope of 0."""
    never = stop_scene(C=None, load=1e5, end=1.0)

    def metrics(omega):
        result = sb.simulate(
            sb.with_values(never, {"initial.omega": omega}), max_steps=128
        )
        time = result.stopping_time
        return jnp.stack([time, result.energy["load_work"], jnp.minimum(time, 10.0)])

    found = slope_of(metrics)(jnp.asarray(20.0))
    assert np.isnan(found[0])
    # of the load, for each rad/s more at the start
    near(found[1], 1e5 * 1.0, 1e-9)
    # (forward, NaN times the slope 0 of the bound is NaN)
    assert np.isnan(found[2]) if slope_of is jax.jacfwd else found[2] == 0.0
    (note,) = [x for x in sb.simulate(never).derivative_notes() if "stopping_time" in x]
    assert note.startswith("no derivative (NaN)")
