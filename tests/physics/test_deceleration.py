"""Deceleration as a column, a maximum and a limit, against closed forms."""

import dataclasses

import jax
import numpy as np
import pytest
from scenes import stop_scene

import simbrake as sb

J = 800.0
EDDY = sb.loads.EddyCurrentBrake(9e3, 6.0)
HOOK = sb.HookLoad(mass=20e3, drum_radius=0.4, line_count=8)


def coasting(w0=20.0, load=0.0, limits=None, end=5.0):
    """The band open, an eddy-current brake on the shaft."""
    scene = stop_scene(C=None, T0=0.0, w0=w0, load=load, end=end)
    return dataclasses.replace(scene, shaft=(EDDY,), limits=limits)


@pytest.mark.parametrize("way", [1, -1])
def test_maximum_inside_a_motion(way):
    """An eddy-current brake slows most at its critical speed, by `M_m/J`; its limit is
    exceeded where `2 M_m ω ω_m/(ω² + ω_m²) = J a`."""
    limit = 0.8 * 9e3 / J
    result = sb.simulate(coasting(20.0 * way, limits=sb.Limits(max_deceleration=limit)))
    peak = result.max_deceleration
    assert float(peak.value) == pytest.approx(9e3 / J, rel=1e-12)
    assert abs(result.series([float(peak.time)]).omega[0]) == pytest.approx(6.0)
    (event,) = [each for each in result.events if each.name == "hard_braking"]
    speed = abs(result.series([event.time]).omega[0])
    assert speed == pytest.approx(6.0 * (1 + 0.6) / 0.8, rel=1e-9)
    assert result.verdict().colour == "red"


def test_derivatives_and_runs_side_by_side():
    scene = coasting()
    slope = jax.grad(
        lambda most: (
            sb.simulate(
                sb.with_values(scene, {"shaft[0].max_torque": most})
            ).max_deceleration.value
        )
    )(9e3)
    assert slope == pytest.approx(1 / J, rel=1e-9)
    # its time is in proportion to 1/M_m
    time, slope = jax.value_and_grad(
        lambda most: (
            sb.simulate(
                sb.with_values(scene, {"shaft[0].max_torque": most})
            ).max_deceleration.time
        )
    )(9e3)
    assert slope == pytest.approx(-float(time) / 9e3, rel=1e-8)
    speeds = {"initial.omega": [4.0, 12.0, 20.0]}
    data = sb.ensemble(scene, speeds, ["max_deceleration"], progress=False)
    slower = 2 * 9e3 * 4.0 * 6.0 / (4.0**2 + 6.0**2) / J
    expected = [slower, 9e3 / J, 9e3 / J]
    np.testing.assert_allclose(data.max_deceleration, expected, rtol=1e-12)


def test_left_limit_at_rest_and_load_on_a_hook():
    """A ramp of the lever that is still rising as the pulley comes to rest: the maximum
    is that of the last instant, and 0 from then on."""
    lever = sb.ramp(0.0, 60e3, 0.0, 6.0)
    scene = stop_scene(C=None, T0=0.0, w0=12.0, load=HOOK, end=6.0)
    scene = dataclasses.replace(scene, duty=sb.Duty(lever, HOOK))
    result = sb.simulate(scene)
    stop = float(result.stopping_time)
    last = result.series([stop], left=True)
    inertia = float(scene.brake.pulley.inertia) + 20e3 * (0.4 / 8) ** 2
    torque = last.brake_torque[0] - 20e3 * sb.loads.GRAVITY * 0.4 / 8
    assert last.deceleration[0] == pytest.approx(torque / inertia, rel=1e-9)
    assert float(result.max_deceleration.time) == stop
    assert result["max_deceleration"] == pytest.approx(last.deceleration[0], rel=1e-9)
    assert result["max_hook_deceleration"] == pytest.approx(
        0.4 / 8 * last.deceleration[0], rel=1e-9
    )
    assert result.series([stop, 6.0]).hook_deceleration.tolist() == [0.0, 0.0]
    # at first the load speeds up
    assert result.series([0.0]).deceleration[0] < 0


def test_nothing_slows():
    result = sb.simulate(coasting(w0=0.0, load=4e3, end=0.5))
    assert result["max_deceleration"] == 0.0
