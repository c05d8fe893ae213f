"""Deceleration as a column, a maximum and a limit, against closed forms."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from disc_scenes import TORQUE, F, disc_scene
from disc_scenes import J as DISC
from helpers import all_near, near
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
    near(peak.value, 9e3 / J, 1e-12)
    near(abs(result.series([float(peak.time)]).omega[0]), 6.0)
    (event,) = [each for each in result.events if each.name == "hard_braking"]
    speed = abs(result.series([event.time]).omega[0])
    near(speed, 6.0 * (1 + 0.6) / 0.8, 1e-9)
    assert result.verdict().colour == "red"


@pytest.mark.slow
def test_derivatives_and_runs_side_by_side():
    scene = coasting()
    slope = jax.grad(
        lambda most: (
            sb.simulate(
                sb.with_values(scene, {"shaft[0].max_torque": most})
            ).max_deceleration.value
        )
    )(9e3)
    near(slope, 1 / J, 1e-9)
    # its time is in proportion to 1/M_m
    time, slope = jax.value_and_grad(
        lambda most: (
            sb.simulate(
                sb.with_values(scene, {"shaft[0].max_torque": most})
            ).max_deceleration.time
        )
    )(9e3)
    near(slope, -float(time) / 9e3, 1e-8)
    speeds = {"initial.omega": [4.0, 12.0, 20.0]}
    data = sb.ensemble(scene, speeds, ["max_deceleration"], progress=False)
    slower = 2 * 9e3 * 4.0 * 6.0 / (4.0**2 + 6.0**2) / J
    expected = [slower, 9e3 / J, 9e3 / J]
    all_near(data.max_deceleration, expected, 1e-12)


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
    near(last.deceleration[0], torque / inertia, 1e-9)
    assert float(result.max_deceleration.time) == stop
    near(result["max_deceleration"], last.deceleration[0], 1e-9)
    near(result["max_hook_deceleration"], 0.4 / 8 * last.deceleration[0], 1e-9)
    assert result.series([stop, 6.0]).hook_deceleration.tolist() == [0.0, 0.0]
    # at first the load speeds up
    assert result.series([0.0]).deceleration[0] < 0


def test_nothing_slows():
    result = sb.simulate(coasting(w0=0.0, load=4e3, end=0.5))
    assert result["max_deceleration"] == 0.0


MEANS = [
    f"mean_{of}deceleration_{span}"
    for of in ("", "hook_")
    for span in ("by_time", "by_travel", "from_command")
]
ARM = 0.25
HOIST = sb.HookLoad(mass=4e3, drum_radius=ARM, line_count=1)


def disc_stop(force, load=None, **parts):
    """A disc of `TORQUE/F` N·m per newton on each pad."""
    scene = disc_scene(omega=10.0, end=20.0, **parts)
    load = sb.TorqueLoad(0.0) if load is None else load
    return dataclasses.replace(scene, duty=sb.ForceDuty(force, load))


PULL = sb.loads.Actuator(sb.PiecewiseLinear([0.2, 0.2], [0.0, F]), dead_time=0.3)
ALPHA = TORQUE / DISC


def test_means_of_a_constant_deceleration_behind_dead_time():
    """Without a load the speed stays until the pads act: means from there on are the
    constant one, the one from the command counts the dead time."""
    result = sb.simulate(disc_stop(PULL))
    found = [result[name] for name in MEANS[:3]]
    near(found, [ALPHA, ALPHA, 10.0 / (0.3 + 10.0 / ALPHA)], 1e-9)
    limits = {"mean_deceleration_by_time": 0.99 * ALPHA}
    assert result.verdict(limits).colour == "red"
    with pytest.raises(KeyError, match="mean_hook"):
        result["mean_hook_deceleration_by_time"]


@pytest.mark.slow
def test_means_in_phases_behind_dead_time():
    """A drag slows the shaft before."""
    phases = (sb.loads.Phase(0.0, "1 s"), sb.loads.Phase(PULL, "rest"))
    drag = sb.loads.EddyCurrentBrake(50.0, 5.0, sb.ramp(1.0, 0.0, 1.0, 1e-3))
    in_phases = disc_stop(sb.loads.Phases(phases), shaft=(drag,))
    run = sb.simulate(in_phases)
    found = [run[name] for name in MEANS[:3]]
    w = run.series([1.1]).omega[0]
    near(found, [ALPHA, ALPHA, w / (0.3 + w / ALPHA)], 1e-9)


def means_of_ramp(rate, begin=0.5, ahead=2.0, w0=10.0):
    """A load that speeds the shaft up by `a`, and pads that from `begin` on slow it
    by `k` more each second: `ω = w_b + a τ − k τ²/2`, greatest at `τ_1 = a/k`."""
    J = DISC + 4e3 * ARM**2
    a = 4e3 * sb.loads.GRAVITY * ARM / J
    k = rate * TORQUE / F / J
    w_b = w0 + a * begin
    tau_1 = a / k
    w_1 = w_b + a * tau_1 / 2
    braked = jnp.sqrt(2 * w_1 / k)  # ω = w_1 − k (τ − τ_1)²/2
    angle = w_1 * braked - k * braked**3 / 6
    pulley = [
        w_1 / braked,
        w_1**2 / (2 * angle),
        w_b / (tau_1 + braked),
    ]
    return jnp.stack([*pulley, *(ARM * mean for mean in pulley)])


RATE = 3e3


def ramp_stop(rate):
    """The greatest speed is inside the braking: its place moves with the ramp."""
    points = sb.PiecewiseLinear([0.0, 0.5, 20.5], [0.0, 0.0, 20.0 * rate])
    return disc_stop(points, HOIST)


def test_means_of_a_ramp():
    result = sb.simulate(ramp_stop(RATE))
    all_near([result[name] for name in MEANS], means_of_ramp(RATE), 1e-9)


@pytest.mark.slow
def test_derivatives_and_many_means_of_a_ramp():
    some = [0, 2, 4]  # by time, from the command; of the load by travel

    def means(rate):
        run = sb.simulate(ramp_stop(rate))
        return jnp.stack([getattr(run, MEANS[i]) for i in some])

    expected = jax.jacfwd(means_of_ramp)(RATE)[np.asarray(some)]
    all_near(jax.jacfwd(means)(RATE), expected, 1e-7)
    paths = {"duty.force.values[2]": [20 * RATE, 40 * RATE]}
    data = sb.ensemble(ramp_stop(RATE), paths, MEANS[:1], progress=False)
    expected = [means_of_ramp(x)[0] for x in (RATE, 2 * RATE)]
    all_near(data[MEANS[0]], expected, 1e-9)


def test_no_mean_without_a_stop():
    result = sb.simulate(
        disc_stop(sb.PiecewiseLinear([0.0, 0.5, 20.5], [1e3] * 3), HOIST)
    )
    assert {result[name] for name in MEANS} == {np.inf}
    assert MEANS[0] not in result.metrics
