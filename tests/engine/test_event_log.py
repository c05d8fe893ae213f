"""The event log: events where their conditions are met, also in long runs and in those
that fail."""

import dataclasses

import diffrax
import numpy as np
import pytest
from scenes import closed_form, stop_scene

import simbrake as sb
from simbrake.results import Event

LININGS = 20
BETA = 0.2
F = 0.4
T0 = 1e4


@pytest.fixture(scope="module")
def swinging():
    """A run of an elastic band under a load that swings by ±100 kN·m in every second,
    past the grip either way."""
    linings = sb.Lining(sb.ConstantFriction(F, 1.1), np.full(LININGS, BETA))
    brake = sb.Brake(sb.Pulley(0.7, 2000.0), sb.Band(0.7, 3e5), linings)
    load = sb.TorqueLoad(
        sb.Repeated([0.0, 0.25, 0.75, 1.0], [0.0, 1e5, -1e5, 0.0], 1.0, 20)
    )
    return sb.simulate(
        sb.Scene(brake, sb.Duty(sb.Constant(T0), load), sb.Initial(0.5), 20.0),
        max_steps=4096,
    )


@pytest.mark.slow
def test_lining_limits_are_at_their_tension(swinging):
    """`T_n = T_0 μ^i` when lining `i` comes to its limit, `T_0/μ^(n+1−i)` counted from
    the anchor (model §3)."""
    events = [e for e in swinging.events if e.name == "lining_limit"]
    assert len(events) > 240
    z = 1.1 * F * np.tan(BETA / 2)
    mu = (1 + z) / (1 - z)
    i = np.array([e.lining for e in events])
    tension = (
        np.asarray(swinging.series([e.time for e in events], left=True).tight_tension)
        / T0
    )
    ahead = mu**i
    back = mu ** (i - 1.0 - LININGS)
    np.testing.assert_allclose(tension, np.where(tension > 1, ahead, back), rtol=1e-9)


def test_full_slip_follows_all_lining_limits(swinging):
    """Counted from the slack end, or from the anchor when the band slides back."""
    slips = [k for k, e in enumerate(swinging.events) if e.name == "full_slip"]
    ahead = list(range(1, LININGS + 1))
    assert len(slips) > 9
    for k in slips:
        before = swinging.events[k - LININGS : k]
        assert {e.name for e in before} == {"lining_limit"}
        assert [e.lining for e in before] in (ahead, ahead[::-1])


@pytest.mark.slow
def test_log_of_a_run_that_fails():
    whole = sb.simulate(stop_scene())
    for steps in (2, 4, 5, 8):
        failed = sb.simulate(stop_scene(), max_steps=steps, throw=False)
        end = float(failed.record.rows.t[steps])
        wanted = [event for event in whole.events if event.time <= end]
        assert [event[1:] for event in failed.events] == [event[1:] for event in wanted]
        np.testing.assert_allclose(
            failed.events.times, [event.time for event in wanted], rtol=1e-10
        )
    assert [
        event.name
        for event in sb.simulate(stop_scene(end=float(whole.stopping_time))).events
    ][-2:] == [
        "full_slip",
        "stop",
    ]


def test_events_as_dictionaries_and_by_name():
    assert Event(1.0, "stop").as_dict() == {"time": 1.0, "name": "stop"}
    assert Event(1.0, "lining_limit", 0).as_dict() == {
        "time": 1.0,
        "name": "lining_limit",
        "lining": 0,
    }
    log = sb.results.Events(
        [Event(1.0, "stop"), Event(2.0, "restart"), Event(3.0, "stop")]
    )
    assert log["stop"].times == [1.0, 3.0]
    assert log[1].time == 2.0
    with pytest.raises(KeyError, match="nearest: stop"):
        log["stopp"]
    with pytest.raises(KeyError, match="nearest: slip_onset, lining_limit, full_slip"):
        log["#"]


@pytest.mark.slow
def test_maxima_near_the_ends_of_steps():
    """`C θ' = P_0 (1 − t/t_s) − G θ` of a cooled rim: hottest at
    `ln(1 + G t_s/C)/(G/C)`, in many places of a step."""
    n = 20
    J = 800.0
    w_0 = 20.0
    C = 2e4
    torque = 0.725 * 8e3 * (closed_form(n=n)["Pi"] - 1)
    t_s = J * w_0 / torque
    near = []
    for G in np.linspace(4e3, 4e4, 25):
        heat = sb.lumped_heat(rim=C, partition=1.0, rim_cooling=G)
        scene = dataclasses.replace(stop_scene(n=n, C=None, end=2.0), heat=heat)
        result = sb.simulate(scene, rtol=1e-12, solver=diffrax.Dopri8())
        peak = result.peak_rim_temperature
        at = np.log(1 + G / C * t_s) / (G / C)
        rise = torque * w_0 / G * (1 - at / t_s)
        assert peak.time == pytest.approx(at, rel=1e-5)
        assert peak.value - 293.15 == pytest.approx(rise, rel=1e-9)
        steps = np.asarray(result.record.rows.t)[: int(result.record.count) + 1]
        near.append(np.min(np.abs(steps - at)) / t_s)
    assert min(near) < 5e-3  # the end of a step lies next to one of them
