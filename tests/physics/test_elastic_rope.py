"""Elastic rope: swings in closed form, free fall, stops against SciPy, the limit of a
rigid rope, other parts."""

import dataclasses
import math

import numpy as np
import pytest
from helpers import all_equal, all_near, closes, near
from scenes import GAIN, stop_scene
from scipy.integrate import solve_ivp

import simbrake as sb
from simbrake.loads import RopeElasticity, RopeLayers

G = 9.80665
M = 40e3
J = 1200.0
RHO = 0.4 / 8
K = 4e6
W = M * G
# N·m of brake torque per N of slack tension


def scene(
    k=K,
    c=0.0,
    m=M,
    J=J,
    T0=30e3,
    w0=24.0,
    end=3.0,
    stretch=None,
    rope=None,
    lever=None,
    C=None,
):
    load = sb.HookLoad(
        m, 0.4, 8.0, rope=rope, elasticity=RopeElasticity(k, c, stretch=stretch)
    )
    return stop_scene(C=C, J=J, T0=T0, w0=w0, load=load, end=end, lever=lever)


def names(result):
    return [
        event.name
        for event in result.events
        if event.name not in ("lining_limit", "slip_onset", "full_slip")
    ]


# --- closed forms -------------------------------------------------------------------


@pytest.mark.slow
def test_hook_swings_over_a_drum_at_rest():
    """`F − W = (k e_0 − W) e^{−δt} (cos ω t − … sin ω t)`; the drum moves exactly 0,
    and the reserve is that of the rope."""
    for c in (0.0, 3e4):
        result = sb.simulate(scene(c=c, w0=0.0, stretch=1.6 * W / K))
        assert result.status == "held"
        delta = c / (2 * M)
        omega = math.sqrt(K / M - delta**2)
        t = np.linspace(0.0, 3.0, 40)
        s = result.series(t)
        fade = 0.6 * W / K * np.exp(-delta * t)
        phase = omega * t
        e = W / K + fade * (np.cos(phase) + delta / omega * np.sin(phase))
        v = -fade * (omega + delta**2 / omega) * np.sin(phase)
        all_near(s.rope_stretch, e, 1e-9)
        all_near(s.hook_load, K * e + c * v, 1e-9)
        all_near(s.hook_speed, v, 1e-9, 1e-10)
        all_near(s.hook_position, e - 1.6 * W / K, 1e-9, 1e-11)
        all_near(s.load_torque, RHO * s.hook_load, 1e-12)
        all_equal(s.brake_torque, s.load_torque)
        assert not np.any(s.omega)
        assert not np.any(s.phi)
        most = float(result.max_hook_load.value)
        # at once, or after whole swings
        near(most, 1.6 * W, 1e-9)
        near(result.metrics["max_hook_load_over_weight"], 1.6, 1e-9)
        near(result.metrics["min_holding_reserve"], 30e3 * GAIN / (RHO * 1.6 * W), 1e-9)
        gone = (
            0.5 * M * (-(v[-1] ** 2))
            + 0.5 * K * (e[0] ** 2 - e[-1] ** 2)
            + W * (e[-1] - e[0])
        )
        near(result.energy["damper_heat"], gone, 1e-8, 1e-6)
        closes(result, 1e-9)
    # a weight that hangs still does so exactly, at any stiffness
    still = sb.simulate(scene(193461.33280156262, m=41591.71271006674, w0=0.0))
    assert float(still.energy["closure"]) == 0.0


def test_overshoot_of_a_hard_stop():
    """`F_max = m g + v √(k m)` of a drum that stops in no time: of a light drum under a
    strong band."""
    result = sb.simulate(scene(J=1e-6, w0=6.0, T0=60e3, end=0.3, stretch=W / K))
    v = 6.0 * RHO
    most = W + v * math.sqrt(K * M)
    assert most * RHO < 60e3 * GAIN
    assert float(result.stopping_time) < 1e-10
    near(result.max_hook_load.value, most, 1e-8)
    near(result.max_hook_load.time, math.pi / 2 / math.sqrt(K / M), 1e-6)


def test_slack_rope_falls_and_is_taut_again():
    """Drum held: slack where `k e = 0`, free fall for `2 v/g`, and the same swing
    again."""
    result = sb.simulate(scene(w0=0.0, stretch=3 * W / K, end=2.0))
    omega = math.sqrt(K / M)
    slack = 2 * math.pi / 3 / omega
    v = 2 * W / K * omega * math.sin(2 * math.pi / 3)
    flight = 2 * v / G
    swing = 4 * math.pi / 3 / omega
    times = [event.time for event in result.events if event.name.startswith("rope")]
    assert names(result)[:4] == ["rope_slack", "rope_taut", "rope_slack", "rope_taut"]
    all_near(times[:4], np.cumsum([slack, flight, swing, flight]), 1e-9)
    t = slack + np.linspace(0.05, 0.95, 7) * flight
    s = result.series(t)
    all_near(s.rope_stretch, -v * (t - slack) + 0.5 * G * (t - slack) ** 2, 1e-9)
    assert not np.any(s.hook_load)
    all_near(s.brake_torque, 0.0, atol=1e-9)
    closes(result, 1e-10)
    # slack from the start by 0.2 m, and a blow of the damper as it becomes taut
    fallen = sb.simulate(scene(c=2e4, w0=0.0, stretch=-0.2, end=0.5))
    (taut,) = fallen.events["rope_taut"].times
    near(taut, math.sqrt(0.4 / G), 1e-9)
    near(fallen.series([taut]).hook_load[0], 2e4 * math.sqrt(0.4 * G), 1e-9)
    closes(fallen, 1e-10)


# --- stops against SciPy ------------------------------------------------------------


def by_scipy(points, tensions, k, c, w0, end, J):
    """Events with their times and states `(φ, ω, v, e)`, and the state at the end:
    sliding or held, taut or slack."""
    held = False
    taut = True
    t = 0.0
    y = np.array([0.0, w0, w0 * RHO, W / k])
    found = []

    def pull(y):
        return k * y[3] + c * (y[2] - RHO * y[1])

    def rhs(t, y):
        F = pull(y) if taut else 0.0
        turn = 0.0 if held else (F * RHO - GAIN * np.interp(t, points, tensions)) / J
        return [y[1], turn, G - F / M, y[2] - RHO * y[1]]

    def moves(t, y):
        return (
            GAIN * np.interp(t, points, tensions) - (RHO * pull(y) if taut else 0.0)
            if held
            else y[1]
        )

    def rope(t, y):
        return pull(y) if taut else -min(k * y[3], pull(y))

    for event in (moves, rope):
        event.terminal = True
        event.direction = -1
    while t < end:
        until = min([x for x in (*points, end) if x > t + 1e-12])
        out = solve_ivp(
            rhs,
            (t, until),
            y,
            "DOP853",
            events=(moves, rope),
            rtol=2e-13,
            atol=1e-14,
            max_step=0.02,
        )
        t = out.t[-1]
        y = out.y[:, -1]
        if out.status == 1 and len(out.t_events[0]):
            held = not held
            y = y * [1.0, 0.0 if held else 1.0, 1.0, 1.0]
            found.append(("stop" if held else "restart", t, y))
        elif out.status == 1:
            taut = not taut
            found.append(("rope_taut" if taut else "rope_slack", t, y))
    return found, y


#: a stop that the swing of the hook breaks twice; one so hard that the rope goes slack,
#: with damping, then a release; and the least number of events
STOPS = {
    "restart": ([0.0, 0.25, 0.5], [25e3, 25e3, 6.8e3], K, 5e3, 8.0, 3.0, J, 5),
    "slack": (
        [0.0, 0.1, 1.6, 1.7],
        [20e3, 80e3, 80e3, 6e3],
        2e7,
        2e4,
        60.0,
        2.4,
        150.0,
        6,
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", STOPS)
def test_stop_against_scipy(kind):
    points, tensions, k, c, w0, end, inertia, least = STOPS[kind]
    events, last = by_scipy(points, tensions, k, c, w0, end, inertia)
    what = scene(
        k, c, J=inertia, w0=w0, end=end, lever=sb.PiecewiseLinear(points, tensions)
    )
    result = sb.simulate(what, rtol=1e-12)
    assert names(result) == [name for name, *_ in events]
    assert len(events) >= least
    times = [time for _, time, _ in events]
    ours = [
        event.time
        for event in result.events
        if event.name in ("stop", "restart", "rope_slack", "rope_taut")
    ]
    all_near(ours, times, 1e-9)
    s = result.series([*times, end], left=True)
    found = np.stack([s.phi, s.omega, s.hook_speed, s.rope_stretch], axis=1)
    truth = np.array([*(state for *_, state in events), last])
    size = np.array([1.0, w0, w0 * RHO, W / k])
    all_near(found / size, truth / size, 1e-9, 1e-9)
    closes(result, 1e-10)
    implicit = sb.simulate(what, solver=sb.hybrid.Rodas5P())
    assert names(implicit) == names(result)
    near(implicit.series([end]).rope_stretch[0], last[3], 1e-6)


# --- together with everything else --------------------------------------------------


@pytest.mark.slow
def test_balances_with_everything_coupled():
    heat = sb.lumped_heat(
        rim=4e5, partition=sb.thermal.ConstantPartition(1.0), rim_cooling=60.0
    )
    shaft = (
        sb.loads.BearingFriction(500.0),
        sb.loads.TackleLoss(lowering_efficiency=0.9),
        sb.loads.EddyCurrentBrake(2e3, 10.0),
    )
    plain = scene(c=2e4, C=4e5, rope=RopeLayers(0.04, 4.0, 4.5), T0=16e3)
    result = sb.simulate(dataclasses.replace(plain, heat=heat, shaft=shaft))
    assert result.status == "stopped"
    assert {"layer_change", "stop"} <= set(names(result))
    closes(result, 1e-9)
    assert float(result.energy["heat_closure"]) < 1e-12
    # a layer less: the speed of the drum stays, and with it the stretch
    (change,) = result.events["layer_change"].times
    before = result.series([change], left=True)
    after = result.series([change])
    all_near(after.omega, before.omega, 1e-12)
    near(
        after.hook_load[0] - before.hook_load[0],
        2e4 * float(after.omega[0]) * 0.04 * math.sqrt(3) / 2 / 8,
        1e-9,
    )
