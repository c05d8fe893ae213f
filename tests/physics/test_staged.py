"""The staged brake: both pairs, every stage and event, against closed forms and
balances."""

import math

import jax.numpy as jnp
import numpy as np
import pytest
import staged_scenes as staged
from helpers import jacobians
from scenes import staged_pair, stop_scene

import simbrake as sb
from simbrake import plot


def names(result):
    return [e.name for e in result.events if e.name != "lining_limit"]


# --- the staged pair of validation: internal capacity constant, external c·t --------


@pytest.mark.smoke
def test_staged_pair_has_its_closed_form():
    result = sb.simulate(staged_pair())
    assert float(result.internal_slip_time) == pytest.approx(1.32, rel=1e-11)
    assert float(result.external_lock_time) == pytest.approx(
        1.61952353926807, rel=1e-11
    )
    assert float(result.stopping_time) == pytest.approx(1.99333333333333, rel=1e-11)
    s = result.series([1.32, 1.61952353926807])
    np.testing.assert_allclose(s.omega, [10.1, 5.60714691097909], rtol=1e-11)
    assert float(result.energy["heat_external"]) == pytest.approx(
        7835.30357277947, rel=1e-11
    )
    assert float(result.energy["heat_internal"]) == pytest.approx(
        964.696427220533, rel=1e-11
    )
    assert names(result) == [
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
    assert sum(stage.heat_internal for stage in result.stages) == pytest.approx(
        964.696427220533, rel=1e-11
    )


@pytest.mark.slow
def test_staged_pair_has_gradients_both_ways():
    def times(x):
        result = sb.simulate(staged_pair(x[0], c=x[1]), max_steps=64)
        return jnp.stack([result.internal_slip_time, result.stopping_time])

    truth = [[2.2e-3, -1.12222222222e-3], [-2.64e-3, -1.32e-3]]
    _, forward, backward = jacobians(times)(np.asarray([600.0, 500.0]))
    np.testing.assert_allclose(forward, np.transpose(truth), rtol=1e-9)
    np.testing.assert_allclose(backward, np.transpose(truth), rtol=1e-9)


# --- onset and lock -----------------------------------------------------------------


@pytest.mark.parametrize("rate", [10.0, 1e3, 1e5])
def test_internal_slip_begins_at_one_tension(rate):
    result = sb.simulate(staged.stop(rate=rate, start=500.0, end=100.0))
    tension = 500.0 + rate * float(result.internal_slip_time)
    assert tension == pytest.approx(
        float(sb.results.internal_slip_tension(staged.brake(), staged.J, 300.0)),
        rel=1e-10,
    )
    assert float(result.energy["closure"]) <= 1e-9


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
    assert slope == pytest.approx(1.0, abs=0.01)
    # under the load that the band balances at the onset: the pulley goes on turning,
    # the bandage lags with the ramp
    z = math.tan(staged.BETA / 2)
    Pi = ((1 + staged.F_EXT * z) / (1 - staged.F_EXT * z)) ** staged.N
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
    assert slopes[1] == pytest.approx(0.5, abs=0.01)
    assert abs(slopes[1] - 0.5) < abs(slopes[0] - 0.5) + 1e-3


# --- stages that cannot occur -------------------------------------------------------


@pytest.mark.slow
def test_bandage_turns_with_the_pulley():
    result = sb.simulate(staged.stop(f_int=0.6, stiffness=3e5))
    assert "internal_slip" not in names(result)
    summary = result.summary()
    assert [stage["name"] for stage in summary["absent_stages"]] == [
        "stage_2",
        "stage_3",
    ]
    # it is then a standard brake with the inertia of both
    plain = staged.stop(stiffness=3e5, J=staged.J + staged.J_B)
    standard = sb.Scene(
        sb.Brake(plain.brake.pulley, plain.brake.band, plain.brake.linings),
        plain.duty,
        plain.initial,
        plain.end_time,
    )
    assert float(result.stopping_time) == pytest.approx(
        float(sb.simulate(standard).stopping_time), rel=1e-12
    )
    assert float(result.energy["heat_internal"]) == 0.0


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
    assert names(result)[:2] == ["restart", "internal_slip"]
    M = 200.0 * float(result.internal_slip_time)
    z = math.tan(staged.BETA / 2)
    mu = np.full(staged.N, (1 + staged.F_EXT * z) / (1 - staged.F_EXT * z))
    T = staged.tensions(4e3, 4e3 + M / staged.R_B, mu)
    capacity = (
        staged.R
        * staged.F_INT
        * np.sum((T[1:] + T[:-1]) * math.sin(staged.BETA / 2) + staged.PRELOAD)
    )
    assert capacity == pytest.approx(M, rel=1e-10)
    assert result.status == "runaway"
    assert np.all(np.asarray(result.series([40.0, 50.0]).bandage_speed) == 0.0)
    # against the braking direction, with more interference, the band is the weaker one:
    # M = −R_b T_0 (1 − 1/Π)
    back = sb.TorqueLoad(sb.PiecewiseLinear([0.0, 100.0], [0.0, -2e4]))
    scene = staged.stop(stiffness=stiffness, lever=lever, w0=0.0, end=50.0, preload=3e3)
    result = sb.simulate(
        sb.Scene(scene.brake, sb.Duty(lever, back), scene.initial, scene.end_time)
    )
    restart = next(e.time for e in result.events if e.name == "restart")
    assert restart == pytest.approx(
        staged.R_B * 4e3 * (1 - 1 / np.prod(mu)) / 200.0, rel=1e-10
    )
    # what the band lets go at once on the restart is the next stage's; no heat is lost
    # between them
    assert [s.heat_external for s in result.stages if s.name == "held"] == [0.0]
    assert sum(s.heat_external for s in result.stages) == pytest.approx(
        float(result.energy["heat_external"]), rel=1e-12
    )


@pytest.fixture(scope="module", params=[None, 2e5], ids=["rigid", "elastic"])
def duties(request):
    """Random levers, loads, releases, reversals on staged brakes, static friction above
    kinetic in some."""
    found = []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        brake = sb.Brake(
            sb.Pulley(0.6, 800.0),
            sb.Band(0.65, request.param),
            sb.Lining(
                sb.ConstantFriction(rng.uniform(0.25, 0.5), rng.choice([1.0, 1.2])),
                np.full(6, math.radians(45)),
            ),
            sb.Bandage(
                rng.uniform(5, 80),
                sb.ConstantFriction(rng.uniform(0.1, 0.5), rng.choice([1.0, 1.3])),
                rng.choice([0.0, rng.uniform(0, 2e3)]),
            ),
        )
        tension = rng.uniform(0, 2e4, 5) * (rng.random(5) > 0.3)
        lever = sb.PiecewiseLinear(np.sort(rng.uniform(0, 8, 5)), tension)
        load = sb.TorqueLoad(
            sb.PiecewiseLinear(np.sort(rng.uniform(0, 8, 4)), rng.uniform(-6e3, 9e3, 4))
        )
        start = sb.Initial(rng.choice([20.0, 5.0, 0.0, -8.0]))
        found.append(sb.simulate(sb.Scene(brake, sb.Duty(lever, load), start, 9.0)))
    return found


@pytest.mark.slow
def test_random_duties_only_dissipate(duties):
    seen = set()
    for result in duties:
        assert float(result.energy["closure"]) <= 1e-9
        s = result.series(np.linspace(0.0, 9.0, 300))
        scale = 1e-9 * max(1.0, float(result.energy["friction_heat"]))
        pair = s.pairs["internal"]
        total = np.asarray(s.friction_heat)
        assert np.all(np.diff(pair.heat) >= -scale)
        assert np.all(np.diff(total - pair.heat) >= -scale)
        sticks = np.all(np.asarray(pair.sense) == 0, axis=1)
        slack = 1e-6 * np.abs(pair.capacity) + 1e-3
        assert np.all(np.abs(pair.torque)[sticks] <= (pair.capacity + slack)[sticks])
        wrong = np.asarray(pair.sense) * np.asarray(pair.slip_speed) < -1e-8
        assert not np.any(wrong)
        seen |= set(names(result))
    assert {
        "internal_slip",
        "external_lock",
        "external_release",
        "internal_restick",
        "restart",
        "release",
    } <= seen


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
    z = math.tan(staged.BETA / 2)
    mu = np.full(staged.N, (1 + staged.F_EXT * z) / (1 - staged.F_EXT * z))
    for i, stage in enumerate(result.stages):
        T = staged.tensions(s.slack_tension[i], s.tight_tension[i], mu)
        on_rim = (T[1:] + T[:-1]) * math.sin(staged.BETA / 2) + staged.PRELOAD
        M_ext = staged.R_B * (T[-1] - T[0])
        M_int = staged.R * staged.F_INT * on_rim.sum()
        carried = 300.0 - staged.J * (300.0 - M_ext) / (staged.J + staged.J_B)
        drive = {"stage_1": carried, "held": 300.0}.get(stage.name, M_int)
        np.testing.assert_allclose(inner.normal_load[i], on_rim, rtol=1e-11)
        np.testing.assert_allclose(
            [outer.torque[i], inner.torque[i]], [M_ext, drive], rtol=1e-11
        )
        np.testing.assert_allclose(inner.capacity[i], M_int, rtol=1e-11)
        np.testing.assert_allclose(
            outer.friction_force[i], np.diff(T) * math.cos(staged.BETA / 2), atol=1e-8
        )
        np.testing.assert_allclose(
            inner.friction_force[i],
            drive / staged.R * on_rim / on_rim.sum(),
            rtol=1e-11,
        )
        slip = (
            staged.R_B * s.bandage_speed[i],
            staged.R * (s.omega[i] - s.bandage_speed[i]),
        )
        for pair, v, slides in zip(
            (outer, inner), slip, ("stage_1 stage_2", "stage_2 stage_3"), strict=True
        ):
            np.testing.assert_allclose(
                pair.slip_speed[i], v if stage.name in slides else 0.0, rtol=1e-12
            )
            assert set(pair.sense[i]) == {int(stage.name in slides)}
    np.testing.assert_allclose(outer.heat + inner.heat, s.friction_heat, rtol=1e-13)
    assert inner.heat[-1] == pytest.approx(
        float(result.energy["heat_internal"]), rel=1e-12
    )


# --- input --------------------------------------------------------------------------


def test_faults_of_a_bandage_in_one_report():
    scene = staged.stop(preload=np.full(3, 100.0), f_int=0.2)
    with pytest.raises(
        sb.InputError, match=r"brake\.bandage\.preload: does not fit 8 linings"
    ):
        sb.simulate(scene)
    with pytest.raises(sb.InputError, match=r"brake\.bandage\.inertia"):
        sb.simulate(sb.with_values(staged.stop(), {"brake.bandage.inertia": -1.0}))
    with pytest.raises(sb.InputError, match="is self-locking"):
        sb.simulate(staged.stop(f_ext=3.6))
    with pytest.raises(ValueError, match="no bandage"):
        _ = sb.simulate(stop_scene()).internal_slip_time


def test_overlap_coefficients_follow_stages():
    result = sb.simulate(staged_pair())
    o = sb.results.overlap(result, [0.5, 1.4, 1.8, 2.5])
    share = 4 * (math.pi / 3) / (2 * math.pi)
    np.testing.assert_allclose(o.external_dynamic, [share, share, 0, 0], rtol=1e-12)
    np.testing.assert_allclose(o.external_static, [0, 0, share, share], rtol=1e-12)
    np.testing.assert_allclose(o.internal_dynamic, [0, share, share, 0], rtol=1e-12)
    np.testing.assert_allclose(o.internal_static, [share, 0, 0, share], rtol=1e-12)
    grown = sb.results.overlap(result, [1.8, 2.5], sb.results.RunningIn(0.4, 1e3))
    worked = np.asarray([7835.30357277947, 7835.30357277947])
    np.testing.assert_allclose(
        grown.external_static, share * (1 - 0.6 * np.exp(-worked / 1e3)), rtol=1e-10
    )
    with pytest.raises(ValueError, match="with a bandage"):
        plot.stages(sb.simulate(stop_scene()))
