"""Holding, restarting, releasing, re-sticking, reversing: sequences of modes and what
happens to the energy."""

import math

import jax.numpy as jnp
import numpy as np
import pytest
from bandage_scenes import profile
from helpers import all_near, changes_of, closes, input_error, near
from scenes import GAIN, PI, closed_form, stop_run, stop_scene

import simbrake as sb

HOLD = 8e3 * GAIN  # greatest load that the standard scene holds, N·m


def in_steps(lever=((0.0,), (8e3,)), load=((0.0,), (0.0,)), **parts):
    """Points of the lever and of the load, as many in all of these scenes, so that they
    share a program."""
    return stop_scene(
        lever=profile(*lever, 5), load=sb.TorqueLoad(profile(*load, 2)), **parts
    )


@pytest.mark.parametrize("stiffness", [2e5, None])
@pytest.mark.parametrize(
    "share", [0.0, 0.5, 0.999999, 1.0, 1 - 1e-15, 1 + 1e-15, -0.05]
)
def test_a_held_brake_does_not_move_at_all(stiffness, share):
    scene = stop_scene(C=stiffness, w0=0.0, load=share * HOLD, end=3600.0)
    result = sb.simulate(scene)
    s = result.series(np.linspace(0.0, 3600.0, 97))
    assert np.all(np.asarray(s.omega) == 0.0)
    assert np.all(np.asarray(s.phi) == 0.0)
    assert result.status == "held"
    assert result.events == []
    closes(result, 1e-12)


def test_hold_after_a_stop_is_exact():
    result = stop_run(load=0.3 * HOLD, end=3600.0)
    s = result.series(np.linspace(float(result.stopping_time), 3600.0, 50))
    assert np.all(np.asarray(s.omega) == 0.0)
    assert np.ptp(np.asarray(s.phi)) == 0.0
    all_near(s.brake_torque, 0.3 * HOLD, 1e-12)


@pytest.mark.parametrize("stiffness", [pytest.param(2e5, marks=pytest.mark.slow), None])
def test_load_above_the_brake_restarts_it(stiffness):
    """Load ramp from 0 at 5 kN·m/s on a brake at rest: restart exactly where it passes
    the capacity."""
    result = sb.simulate(
        in_steps(load=((0.0, 12.0), (0.0, 60e3)), C=stiffness, w0=0.0, end=12.0)
    )
    restart = result.events["restart"].times[0]
    near(restart, HOLD / 5e3, 1e-11)
    assert changes_of(result)[0] == "restart"
    closes(result, 1e-9)
    late = result.series([restart + 1.0])
    if stiffness is None:  # ω̇ = 5e3 (t − t_r)/J
        near(late.omega[0], 5e3 / 2 / 800, 1e-9)


@pytest.mark.slow
def test_release_at_rest_and_braking_again():
    """Lever off and on: stop, slow release until the load breaks the brake loose, open,
    second stop."""
    lever = (0.0, 2.0, 3.0, 3.5, 3.6), (8e3, 8e3, 0.0, 0.0, 8e3)
    result = sb.simulate(in_steps(lever, ((0.0,), (0.5 * HOLD,)), end=8.0))
    assert changes_of(result) == [
        "slip_onset",
        "full_slip",
        "stop",
        "restart",
        "full_slip",
        "release",
        "slip_onset",
        "full_slip",
        "stop",
    ]
    times = {name: result.events[name].times for name in ("restart", "release")}
    assert times["release"] == [pytest.approx(3.0, abs=1e-12)]
    # where the capacity has fallen to half
    near(times["restart"][0], 2.5, 1e-9)
    closes(result, 1e-9)
    assert result.status == "stopped"


def test_release_books_the_elastic_energy():
    result = sb.simulate(
        in_steps(((0.0, 2.0, 2.0, 3.0), (8e3, 8e3, 0.0, 0.0)), end=3.0)
    )
    assert changes_of(result) == ["slip_onset", "full_slip", "stop", "release"]
    assert result.status == "released"
    assert float(result.record.y_end.own.x) == 0.0
    e = result.energy
    near(e["friction_heat"], 160e3 + float(e["lever_work"]), 1e-12)
    assert float(e["closure"]) <= 1e-12


def test_band_sticks_again_under_fast_lever():
    """In slip ẋ = Ṫ_0 Π/C: under a ramp the band sticks again before the stop, where
    R_b ω has fallen to it."""
    result = sb.simulate(in_steps(((0.0, 0.5, 0.7), (8e3, 8e3, 12e3)), C=5e4, end=3.0))
    assert changes_of(result) == ["slip_onset", "full_slip", "restick", "stop"]
    restick = result.events["restick"].times[0]
    s = result.series([restick], left=True)
    assert abs(float(s.slip_speed[0])) < 1e-8
    closes(result, 1e-9)


@pytest.mark.parametrize("ratio", [1.0, 1.3])
def test_static_friction_above_kinetic(ratio):
    """Break-away drops the tension from T_0 Π_s to T_0 Π_k at once; the energy freed is
    heat."""
    scene = stop_scene(law=sb.ConstantFriction(0.3, static_ratio=ratio))
    result = sb.simulate(scene)
    t1 = float(result.full_slip_time)
    before = result.series([t1], left=True)
    after = result.series([t1])
    static = closed_form(f=0.3 * ratio)["Pi"]
    kinetic = closed_form(f=0.3)["Pi"]
    near(before.tight_tension[0], 8e3 * static, 1e-9)
    near(after.tight_tension[0], 8e3 * kinetic, 1e-12)
    x1 = 8e3 * static / 2e5
    x2 = 8e3 * kinetic / 2e5
    heat = float(after.friction_heat[0] - before.friction_heat[0])
    near(heat, (x1 - x2) * (0.5 * 8e3 * (static + kinetic) - 8e3), 1e-8, 1e-9)
    closes(result, 1e-12)


@pytest.mark.parametrize(
    ("r", "status"), [(0.5, "not_stopped"), (2.0, "not_stopped"), (20.0, "stopped")]
)
def test_lever_ramp_from_exactly_zero(r, status):
    """r = C R_b ω0/Ṫ_0: onset at 0 if r ≥ 1, lining i at 0 if r ≥ Π_i in index order,
    full slip at 0 if r ≥ Π."""
    rate = 2e5 * 0.725 * 20 / r
    result = sb.simulate(in_steps(((0.0, 10.0), (0.0, 10 * rate)), end=2.0))
    at_zero = [e for e in result.events if e.time == 0.0]
    mu = PI ** (1 / 20)
    linings = min(20, int(math.log(r) / math.log(mu)) if r > 1 else 0)
    assert [e.lining for e in at_zero if e.name == "lining_limit"] == list(
        range(1, linings + 1)
    )
    assert ("slip_onset" in [e.name for e in at_zero]) == (r >= 1)
    assert ("full_slip" in [e.name for e in at_zero]) == (r >= PI)
    assert result.status == status
    closes(result, 1e-9)


def test_lever_draws_a_slack_band_at_rest():
    """x := T_0/(Π_s C); lever work less elastic energy is heat."""
    result = stop_run(w0=0.0, end=1.0)
    x = 8e3 / (PI * 2e5)
    near(result.record.y_end.own.x, x, 1e-13)
    e = result.energy
    near(e["lever_work"], 8e3 * x, 1e-12)
    near(e["friction_heat"], 8e3 * x - 0.5 * 2e5 * x**2, 1e-12)


def test_speed_through_zero():
    """The load stops the pulley before full slip and drives it back, until the band
    slides the other way."""
    low = -0.725 * 8e3 * (1 - 1 / PI)
    result = stop_run(load=2 * low, w0=3.0, end=3.0)
    assert changes_of(result) == ["slip_onset", "reversal", "full_slip"]
    assert int(result.record.mode_end.band) == sb.results.BandMode.SLIP_BACK
    end = result.record.y_end
    assert float(end.omega) < 0
    # in full slip backwards: ω̇ = (M_load + R_b T_0 (1 − 1/Π))/J
    s = result.series([2.5, 3.0])
    near(float(s.omega[1] - s.omega[0]) / 0.5, (2 * low - low) / 800, 1e-9)
    closes(result, 1e-9)


def test_reversed_load_restarts_other_way():
    low = 0.725 * 8e3 * (1 - 1 / PI)
    result = sb.simulate(
        in_steps(load=((0.0, 10.0), (0.0, -2 * low)), w0=0.0, C=None, end=10.0)
    )
    near(result.events["restart"].times[0], 5.0, 1e-11)
    assert float(result.record.y_end.omega) < 0


@pytest.mark.slow
def test_short_pulse_of_the_load_is_noticed():
    """1 s of overload in an hour of holding, given as a smooth function without any
    knots."""
    load = sb.TorqueLoad(
        sb.profiles.FunctionProfile(
            lambda t, p: p * jnp.exp(-(((t - 1800.0) / 60.0) ** 2)),
            jnp.asarray(1.2 * HOLD),
            HOLD,
        )
    )
    result = stop_run(w0=0.0, C=None, end=3600.0, load=load)
    assert changes_of(result)[:2] == ["restart", "full_slip"]
    expected = 1800 - 60 * math.sqrt(math.log(1.2))
    near(result.events[0].time, expected, 1e-9)
    assert changes_of(result)[-1] == "stop"


@pytest.mark.slow
def test_a_lining_that_locks_itself():
    law = sb.ConstantFriction(np.append(np.full(19, 0.35), 9.0))
    with input_error(
        match=r"lining 20: f·tan\(β/2\) = 1.065 ≥ 1, the band is self-locking"
    ):
        stop_run(C=None, law=law)
    result = stop_run(law=law, end=1.0)
    assert result.metrics["full_slip_time"] is None  # it never slips
    # as if bonded: a quarter of an oscillation from the onset
    chi = math.sqrt(2e5 * 0.725**2 / 800)
    near(result.stopping_time, 8e3 / (2e5 * 0.725 * 20) + math.pi / 2 / chi, 1e-10)
