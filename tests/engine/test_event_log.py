"""The event log: events where their conditions are met, also in long runs and in those
that fail."""

import numpy as np
import pytest
from helpers import all_near
from scenes import lining_ratio, stop_run, stop_scene

import simbrake as sb

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
        sb.Scene(brake, sb.Duty(T0, load), sb.Initial(0.5), 20.0),
        max_steps=4096,
    )


@pytest.mark.slow
def test_lining_limits_are_at_their_tension(swinging):
    """`T_n = T_0 μ^i` when lining `i` comes to its limit, `T_0/μ^(n+1−i)` counted from
    the anchor (model §3)."""
    events = [e for e in swinging.events if e.name == "lining_limit"]
    assert len(events) > 240
    mu = lining_ratio(1.1 * F, BETA)
    i = np.array([e.lining for e in events])
    tension = (
        np.asarray(swinging.series([e.time for e in events], left=True).tight_tension)
        / T0
    )
    ahead = mu**i
    back = mu ** (i - 1.0 - LININGS)
    all_near(tension, np.where(tension > 1, ahead, back), 1e-9)


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
    whole = stop_run()
    for steps in (2, 4, 5, 8):
        failed = sb.simulate(stop_scene(), max_steps=steps, throw=False)
        end = float(failed.record.rows.t[steps])
        wanted = [event for event in whole.events if event.time <= end]
        assert [event[1:] for event in failed.events] == [event[1:] for event in wanted]
        all_near(failed.events.times, [event.time for event in wanted], 1e-10)
    assert [event.name for event in stop_run(end=float(whole.stopping_time)).events][
        -2:
    ] == [
        "full_slip",
        "stop",
    ]
