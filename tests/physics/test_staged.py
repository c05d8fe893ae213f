"""The staged brake: both pairs, every stage and event, against closed forms and
balances."""

import math

import jax.numpy as jnp
import numpy as np
import pytest
import staged_scenes as staged
from helpers import all_near, changes_of, closes, jacobians, near
from scenes import lining_ratio, staged_pair

import simbrake as sb

# --- the staged pair of validation: internal capacity constant, external c·t --------


@pytest.mark.smoke
def test_staged_pair_has_its_closed_form():
    result = sb.simulate(staged_pair())
    near(result.internal_slip_time, 1.32, 1e-11)
    near(result.external_lock_time, 1.61952353926807, 1e-11)
    near(result.stopping_time, 1.99333333333333, 1e-11)
    s = result.series([1.32, 1.61952353926807])
    all_near(s.omega, [10.1, 5.60714691097909], 1e-11)
    near(result.energy["heat_external"], 7835.30357277947, 1e-11)
    near(result.energy["heat_internal"], 964.696427220533, 1e-11)
    assert changes_of(result) == [
        "slip_onset",
        "full_slip",
        "internal_slip",
        "external_lock",
        "stop",
    ]
    assert [stage.name for stage in result.stages] == [
        "stage_1",
        "stage_2",
        "stage_3",
        "held",
    ]
    near(sum(stage.heat_internal for stage in result.stages), 964.696427220533, 1e-11)


@pytest.mark.slow
def test_staged_pair_has_gradients_both_ways():
    def times(x):
        result = sb.simulate(staged_pair(x[0], c=x[1]), max_steps=64)
        return jnp.stack([result.internal_slip_time, result.stopping_time])

    truth = [[2.2e-3, -1.12222222222e-3], [-2.64e-3, -1.32e-3]]
    _, forward, backward = jacobians(times)(np.asarray([600.0, 500.0]))
    all_near(forward, np.transpose(truth), 1e-9)
    all_near(backward, np.transpose(truth), 1e-9)


# --- onset and lock -----------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("rate", [10.0, 1e3, 1e5])
def test_internal_slip_begins_at_one_tension(rate):
    result = sb.simulate(staged.stop(rate=rate, start=500.0, end=100.0))
    tension = 500.0 + rate * float(result.internal_slip_time)
    near(
        tension,
        sb.results.internal_slip_tension(staged.brake(), staged.J, 300.0),
        1e-10,
    )
    closes(result, 1e-9)


@pytest.mark.slow
def test_slopes_of_onset_tension_and_lock():
    light = float(
        sb.results.internal_slip_tension(staged.brake(J_b=1e-12), staged.J, 300.0)
    )
    tensions = [
        float(sb.results.internal_slip_tension(staged.brake(J_b=J_b), staged.J, 300.0))
        for J_b in (0.9, 0.09)
    ]
    slope = math.log10(abs(tensions[0] / light - 1) / abs(tensions[1] / light - 1))
    near(slope, 1.0, abs=0.01)
    # under the load that the band balances at the onset: the pulley goes on turning,
    # the bandage lags with the ramp
    Pi = lining_ratio(staged.F_EXT, staged.BETA) ** staged.N
    load = staged.R_B * light * (Pi - 1)
    excess = []
    for rate in (1.0, 0.1, 0.01):
        result = sb.simulate(
            staged.stop(rate=rate, start=light - rate, load=load, end=2000.0)
        )
        s = result.series([float(result.external_lock_time)])
        assert float(s.omega[0]) > 1.0
        excess.append(float(s.slack_tension[0]) / light - 1)
    slopes = np.log10(np.asarray(excess[:-1]) / np.asarray(excess[1:]))
    near(slopes[1], 0.5, abs=0.01)
    assert abs(slopes[1] - 0.5) < abs(slopes[0] - 0.5) + 1e-3


# --- held, restart, reversal --------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("stiffness", [None, 3e5])
def test_held_staged_brake_does_not_move(stiffness):
    lever = sb.Constant(4e3)
    held = sb.simulate(
        staged.stop(stiffness=stiffness, lever=lever, load=1e3, w0=0.0, end=3600.0)
    )
    s = held.series(np.linspace(0.0, 3600.0, 50))
    assert np.all(np.asarray(s.phi) == 0.0)
    assert np.all(np.asarray(s.bandage_speed) == 0.0)
    assert held.status == "held"
    # the internal pair is the weaker one under a load ahead: T_n = T_0 + M/R_b, M =
    # M_int(T_n)
    ramp = sb.TorqueLoad(sb.PiecewiseLinear([0.0, 100.0], [0.0, 2e4]))
    scene = staged.stop(stiffness=stiffness, lever=lever, w0=0.0, end=50.0)
    result = sb.simulate(
        sb.Scene(scene.brake, sb.Duty(lever, ramp), scene.initial, scene.end_time)
    )
    assert changes_of(result)[:2] == ["restart", "internal_slip"]
    M = 200.0 * float(result.internal_slip_time)
    mu = np.full(staged.N, lining_ratio(staged.F_EXT, staged.BETA))
    T = staged.tensions(4e3, 4e3 + M / staged.R_B, mu)
    capacity = (
        staged.R
        * staged.F_INT
        * np.sum((T[1:] + T[:-1]) * math.sin(staged.BETA / 2) + staged.PRELOAD)
    )
    near(capacity, M, 1e-10)
    assert result.status == "runaway"


@pytest.mark.slow
def test_forces_of_both_pairs_by_statics():
    """In every stage, by hand; linings that stick to the rim share its torque as the
    friction that each can give."""
    result = sb.simulate(staged.stop())
    middles = [0.5 * (stage.start + stage.end) for stage in result.stages]
    assert [stage.name for stage in result.stages] == [
        "stage_1",
        "stage_2",
        "stage_3",
        "held",
    ]
    s = result.series(middles)
    outer = s.pairs["external"]
    inner = s.pairs["internal"]
    mu = np.full(staged.N, lining_ratio(staged.F_EXT, staged.BETA))
    for i, stage in enumerate(result.stages):
        T = staged.tensions(s.slack_tension[i], s.tight_tension[i], mu)
        on_rim = (T[1:] + T[:-1]) * math.sin(staged.BETA / 2) + staged.PRELOAD
        M_ext = staged.R_B * (T[-1] - T[0])
        M_int = staged.R * staged.F_INT * on_rim.sum()
        carried = 300.0 - staged.J * (300.0 - M_ext) / (staged.J + staged.J_B)
        drive = {"stage_1": carried, "held": 300.0}.get(stage.name, M_int)
        all_near(inner.normal_load[i], on_rim, 1e-11)
        all_near([outer.torque[i], inner.torque[i]], [M_ext, drive], 1e-11)
        all_near(inner.capacity[i], M_int, 1e-11)
        all_near(
            outer.friction_force[i], np.diff(T) * math.cos(staged.BETA / 2), atol=1e-8
        )
        all_near(
            inner.friction_force[i], drive / staged.R * on_rim / on_rim.sum(), 1e-11
        )
        slip = (
            staged.R_B * s.bandage_speed[i],
            staged.R * (s.omega[i] - s.bandage_speed[i]),
        )
        for pair, v, slides in zip(
            (outer, inner), slip, ("stage_1 stage_2", "stage_2 stage_3"), strict=True
        ):
            all_near(pair.slip_speed[i], v if stage.name in slides else 0.0, 1e-12)
            assert set(pair.sense[i]) == {int(stage.name in slides)}
    all_near(outer.heat + inner.heat, s.friction_heat, 1e-13)
    near(inner.heat[-1], result.energy["heat_internal"], 1e-12)


# --- input --------------------------------------------------------------------------


def test_overlap_coefficients_follow_stages():
    result = sb.simulate(staged_pair())
    o = sb.results.overlap(result, [0.5, 1.4, 1.8, 2.5])
    share = 4 * (math.pi / 3) / (2 * math.pi)
    all_near(o.external_dynamic, [share, share, 0, 0], 1e-12)
    all_near(o.external_static, [0, 0, share, share], 1e-12)
    all_near(o.internal_dynamic, [0, share, share, 0], 1e-12)
    all_near(o.internal_static, [share, 0, 0, share], 1e-12)
    grown = sb.results.overlap(result, [1.8, 2.5], sb.results.RunningIn(0.4, 1e3))
    worked = np.asarray([7835.30357277947, 7835.30357277947])
    all_near(grown.external_static, share * (1 - 0.6 * np.exp(-worked / 1e3)), 1e-10)
