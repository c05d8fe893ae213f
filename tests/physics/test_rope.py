"""Layers of rope on the drum: travel, a stop by energy with jumps of the speed, the end
of the rope."""

import math

import jax.numpy as jnp
import numpy as np
import pytest
from helpers import all_equal, all_near, changes_of, closes, jacobians, names_of, near
from scenes import GAIN, stop_run, stop_scene

import simbrake as sb
from simbrake.loads import RopeLayers

J = 1200.0
R_1 = 0.4
LINES = 8.0
GRAVITY = 9.80665
PITCH = math.sqrt(3) / 2
#: mass on the hook, diameter, turns of a layer, turns on the drum (a third layer
#: begun), speed
GIVEN = (40e3, 0.04, 4.0, 9.5, 24.0)


def stop(x=GIVEN, T0=10.5e3, C=None, end=12.0, **given):
    m, d, per_layer, turns, w0 = x
    load = sb.HookLoad(m, R_1, LINES, rope=RopeLayers(d, per_layer, turns))
    return stop_scene(C=C, J=J, T0=T0, w0=w0, load=load, end=end, **given)


def by_energy(x, T0=10.5e3):
    """Time, angle, travel of a stop that ends in the first layer: in each layer a
    constant torque, between them jumps of the speed at constant kinetic energy."""
    m, d, per_layer, turns, w0 = x
    radii = [R_1 + k * PITCH * d for k in (2, 1, 0)]
    J_0 = J + m * (radii[0] / LINES) ** 2
    E = 0.5 * J_0 * w0**2
    time = 0.0
    angle = 0.0
    travel = 0.0
    for r, here in zip(radii, (turns - 2 * per_layer, per_layer, None), strict=True):
        inertia = J + m * (r / LINES) ** 2
        torque = T0 * GAIN - m * GRAVITY * r / LINES
        phi = E / torque if here is None else 2 * jnp.pi * here
        left = E - torque * phi
        fast = jnp.sqrt(2 * E / inertia)
        slow = 0.0 if here is None else jnp.sqrt(2 * left / inertia)
        time = time + (fast - slow) * inertia / torque
        angle = angle + phi
        travel = travel + r * phi / LINES
        E = left
    return jnp.stack([time, angle, travel])


@pytest.mark.slow
def test_three_layer_stop_and_derivatives():
    def run(x):
        result = sb.simulate(stop(tuple(x)), rtol=1e-12, max_steps=256)
        return jnp.stack(
            [result.stopping_time, result.stopping_angle, result.hook_travel]
        )

    value, forwards, backwards = jacobians(run)(jnp.asarray(GIVEN))
    truth, slopes, _ = jacobians(by_energy)(jnp.asarray(GIVEN))
    all_near(value, truth, 1e-11)
    all_near(forwards, slopes, 1e-7, 1e-12)
    all_near(backwards, slopes, 1e-7, 1e-12)


@pytest.mark.slow
def test_three_layer_stop_events_and_balance():
    result = sb.simulate(stop())
    assert changes_of(result) == [
        "slip_onset",
        "full_slip",
        "layer_change",
        "layer_change",
        "stop",
    ]
    closes(result, 1e-12)
    change = result.events["layer_change"].times
    before = result.series(change, left=True)
    after = result.series(change)
    all_equal(before.rope_layer, [3, 2])
    all_equal(after.rope_layer, [2, 1])
    m, d = GIVEN[:2]
    r = R_1 + PITCH * d * np.array([2.0, 1.0, 0.0])
    inertia = J + m * (r / LINES) ** 2
    all_near(after.omega / before.omega, np.sqrt(inertia[:-1] / inertia[1:]), 1e-12)
    all_near(after.load_torque, m * GRAVITY * r[1:] / LINES, 1e-12)
    # held in the first layer
    near(result.series([11.0]).brake_torque[0], m * GRAVITY * R_1 / LINES, 1e-12)
    near(result.energy["load_work"], m * GRAVITY * float(result.hook_travel), 1e-12)


@pytest.mark.slow
def test_rope_wound_up_again_and_rope_ending():
    """Thrown upwards the rope climbs a layer and comes back: the same speed there,
    without a loss; then it ends."""
    m = 40e3
    d = 0.04
    per_layer = 4.0
    w0 = -14.0
    scene = stop((m, d, per_layer, 3.0, w0), T0=0.0, end=4.0)
    result = sb.simulate(scene, throw=False)
    r = R_1 + PITCH * d * np.array([0.0, 1.0])
    inertia = J + m * (r / LINES) ** 2
    torque = m * GRAVITY * r / LINES
    assert result.status == "rope_end"
    assert names_of(result) == ["layer_change", "reversal", "layer_change"]
    up = math.sqrt(w0**2 - 2 * torque[0] * 2 * math.pi / inertia[0])
    first = (-w0 - up) * inertia[0] / torque[0]
    beyond = up * math.sqrt(inertia[0] / inertia[1])
    rise = beyond * inertia[1] / torque[1]
    second = first + 2 * rise
    all_near(result.events.times, [first, first + rise, second], 1e-9)
    down = math.sqrt(up**2 + 2 * torque[0] * 2 * math.pi * per_layer / inertia[0])
    near(result.record.t_end, second + (down - up) * inertia[0] / torque[0], 1e-9)
    near(result.record.y_end.phi, 6 * math.pi, 1e-10)


def test_tripping_with_layers():
    """Mass taken in motion on a layer brings its energy at that radius; the balance
    closes."""
    load = sb.TrippingLoad(
        *(4e3, 30e3, 2e3, 0.5, 6.0, 8.0, R_1, LINES),
        count=1,
        rope=RopeLayers(0.04, 4.0, 9.5, rise=1.0),
    )
    result = stop_run(C=None, J=J, T0=10.5e3, w0=24.0, load=load, end=7.0)
    closes(result, 1e-12)
    r = R_1 + 2 * 0.04
    first = stop_run(C=None, J=J, T0=10.5e3, w0=24.0, load=load, end=0.4)
    inertia = J + 4e3 * (r / LINES) ** 2
    fall = (10.5e3 * GAIN - 4e3 * GRAVITY * r / LINES) * 0.4 / inertia
    assert float(first.record.y_end.phi) < 3 * math.pi
    near(first.record.y_end.omega, 24.0 - fall, 1e-10)
