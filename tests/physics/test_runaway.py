"""A load that the brake cannot hold: the outcome `runaway`, both torques, temporary
shortages, the kinetic energy."""

import dataclasses
import math

import chain_scenes
import jax
import pytest
from disc_scenes import TORQUE, disc_scene
from heat_scenes import fading, lump, rigid_stop
from helpers import near
from scenes import lining_ratio, stop_run, stop_scene

import simbrake as sb

R = 0.725
T0 = 8e3
N = 20
BETA = math.radians(13.5)


def capstan(f):
    """`Π` of the linings of the brake."""
    return lining_ratio(f, BETA) ** N


#: what the sliding brake of `stop_scene` gives, and the same with its lever end tight
AHEAD = R * T0 * (capstan(0.35) - 1)
BACK = R * T0 * (1 - 1 / capstan(0.35))


def with_load(scene, load):
    duty = sb.Duty(
        scene.duty.slack_tension,
        load if isinstance(load, sb.TorqueLoad) else sb.TorqueLoad(load),
    )
    return dataclasses.replace(scene, duty=duty)


def assert_holds_up_to(scene, torque, *, relative=1e-6):
    """A load just above `torque` runs away, one just below does not; the torque is
    named to 1e-9."""
    for factor, status in ((1 + relative, "runaway"), (1 - relative, "not_stopped")):
        result = sb.simulate(with_load(scene, sb.Constant(factor * torque)))
        assert result.status == status
        found = result.summary()["capacity"]
        near(found["brake_torque"], abs(torque), 1e-9)
        near(found["load_torque"], abs(factor * torque), 1e-12)
    return result


@pytest.mark.parametrize("stiffness", [2e5, None])
@pytest.mark.parametrize(("omega", "torque"), [(20.0, AHEAD), (-20.0, -BACK)])
def test_brake_holds_by_the_capstan_equation(stiffness, omega, torque):
    assert_holds_up_to(stop_scene(C=stiffness, w0=omega, end=0.3), torque)


@pytest.mark.parametrize(
    "scene",
    [
        stop_scene(C=None, load=AHEAD, end=2.0),
        stop_scene(C=2e5, load=AHEAD, end=2.0),
        stop_scene(C=None, w0=-20.0, load=-BACK, end=2.0),
        pytest.param(
            stop_scene(C=None, lever=sb.SpeedHold(T0), load=AHEAD, end=2.0),
            marks=pytest.mark.slow,
        ),
        pytest.param(disc_scene(load=TORQUE, end=2.0), marks=pytest.mark.slow),
    ],
)
def test_load_equal_to_brake_is_no_runaway(scene):
    """The speed stays constant from full slip on: nothing runs away, and nothing says
    so."""
    result = sb.simulate(scene)
    found = result.end_capacity
    s = result.series([1.0, 2.0])
    near(found.torque, found.load, 1e-12)
    near(s.omega[1], s.omega[0], 1e-9)
    assert result.status == "not_stopped"


@pytest.mark.slow
def test_capacity_at_the_speed_of_the_end():
    law = sb.StribeckFriction(
        static_coefficient=0.35, kinetic_coefficient=0.2, stribeck_speed=30.0
    )
    result = stop_run(law=law, C=None, load=6e4, end=0.3)
    v = R * float(result.record.y_end.omega)
    f = 0.2 + 0.15 * math.exp(-((v / 30.0) ** 2))
    assert 0.22 < f < 0.33
    assert result.status == "runaway"
    near(result.end_capacity.torque, R * T0 * (capstan(f) - 1), 1e-9)
    # the load is below what the cold brake gives and above what the faded one does
    hot = sb.simulate(
        rigid_stop(fading(slope=1.5e-3), lump(2e4), 8.0, load=2e4, w0=25.0)
    )
    f = 0.35 * (1 - 1.5e-3 * (float(hot.end_temperatures[0]) - 293.15))
    faded = R * T0 * (capstan(f) - 1)
    assert faded < 2e4 < AHEAD
    assert hot.status == "runaway"
    near(hot.end_capacity.torque, faded, 1e-9)


@pytest.mark.slow
def test_chain_holds_what_its_band_does():
    torque = chain_scenes.ARM * (lining_ratio(0.3, math.radians(27.0)) ** 4 - 1)
    assert_holds_up_to(chain_scenes.chain(end=0.5), torque, relative=1e-3)


@pytest.mark.slow
def test_lever_to_pull_harder_is_no_runaway():
    def status(lever, end=0.3):
        return stop_run(lever=lever, load=3e4, C=None, end=end).status

    times = [0.0, 0.2, 1.0, 2.0]
    # no change is to come
    assert status(sb.PiecewiseLinear(times, [1e3, T0, T0, T0])) == "runaway"
    assert status(sb.PiecewiseLinear(times, [1e3, T0, T0, 2 * T0])) == "not_stopped"
    assert (
        status(sb.PiecewiseLinear([0.0, 0.4, 1.0, 2.0], [1e3, T0, T0, T0]))
        == "not_stopped"
    )
    assert status(sb.profiles.ExponentialRise(T0, 0.01)) == "runaway"
    assert status(sb.profiles.ExponentialRise(T0, 0.2)) == "not_stopped"
    assert status(sb.SpeedHold(limit=T0)) == "runaway"
    assert status(sb.SpeedHold(limit=2 * T0)) == "not_stopped"


@pytest.mark.parametrize(
    ("profile", "time"),
    [
        (sb.Constant(1.0), -math.inf),
        (sb.PiecewiseLinear([0.0, 1.0, 2.0], [0.0, 3.0, 3.0]), 1.0),
        (sb.PiecewiseLinear([0.0, 1.0, 2.0], [3.0, 0.0, 3.0]), 2.0),
        (sb.Lever(sb.PiecewiseLinear([0.0, 1.0], [0.0, 3.0]), 2.0, 1.0), 1.0),
        (sb.Repeated([0.0, 0.5], [1.0, 2.0], period=2.0, count=3), 4.5),
        (sb.profiles.ExponentialRise(1.0, 0.1, begin=0.7), 0.7),
        (
            sb.loads.Actuator(
                sb.PiecewiseLinear([0.0, 1.0], [0.0, 3.0]), dead_time=0.25
            ),
            1.25,
        ),
        (sb.wear.Delayed(sb.PiecewiseLinear([0.0, 1.0], [0.0, 3.0]), 0.5), 1.5),
    ],
)
def test_time_of_the_last_turn_of_a_profile(profile, time):
    assert bool(profile.is_settled(max(time, -1e9)))
    assert math.isinf(time) or not bool(profile.is_settled(time - 1e-9))


@pytest.mark.slow
def test_locking_and_no_load_are_no_runaway():
    assert stop_run(f=0.0, end=0.3).status == "not_stopped"
    locked = stop_run(n=2, beta=100.0, f=0.9, load=1e5, w0=0.5, end=0.02)
    assert locked.status == "not_stopped"
    assert locked.summary()["capacity"] == {
        "load_torque": 1e5,
        "brake_torque": None,
        "pairs": [None],
    }


@pytest.mark.slow
def test_temporary_shortage_is_a_warning():
    pulse = sb.PiecewiseLinear([0.2, 0.2, 0.5, 0.5], [0.0, 4e4, 4e4, 0.0])
    result = sb.simulate(with_load(stop_scene(C=None, end=6.0), pulse))
    assert result.status == "stopped"
    assert result.summary()["warnings"][0].startswith("shortage")
    # a load that the brake outweighs, and one that is there only while the lever still
    # rises
    assert (
        sb.simulate(with_load(stop_scene(C=None), sb.Constant(0.9 * AHEAD))).summary()[
            "warnings"
        ]
        == []
    )


@pytest.mark.slow
def test_capacity_is_differentiable():
    """∂M_b/∂T_0 = M_b/T_0."""

    def torque(T):
        return sb.simulate(
            stop_scene(T0=T, load=1e5, C=None, end=0.3), max_steps=64
        ).end_capacity.torque

    value, slope = jax.jvp(torque, (T0,), (1.0,))
    near(value, AHEAD, 1e-12)
    near(slope, AHEAD / T0, 1e-12)
