"""Whole runs of the standard brake against closed forms, and against SciPy where there
is none."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import all_equal, all_near, changes_of, closes, names_of, near
from oracles.stops import at_rest
from scenes import (
    GAIN,
    PI,
    closed_form,
    lining_ratio,
    stop_run,
    stop_scene,
)
from scipy.integrate import solve_ivp

import simbrake as sb


@pytest.fixture(scope="module")
def stop():
    return stop_run()


@pytest.mark.parametrize(
    "case",
    [
        pytest.param({}, marks=pytest.mark.smoke),
        {"f": 0.25, "C": 5e4, "T0": 3e3, "w0": 8.0},
        {"J": 1e-3, "R": 0.1, "C": 5e3, "T0": 20.0, "w0": 300.0},
        {"f": 0.5, "J": 5e4, "C": 1e6, "T0": 2e4, "w0": 3.0},
    ],
)
def test_closed_forms_of_every_event(case):
    truth = closed_form(**case)
    result = stop_run(**case, end=2 * truth["stop"])
    limits = result.events["lining_limit"].times
    got = [
        float(result.slip_onset_time),
        *limits,
        float(result.full_slip_time),
        float(result.stopping_time),
    ]
    all_near(got, [truth["t0"], *truth["limits"], truth["t1"], truth["stop"]], 1e-11)
    near(result.max_tension.value, case.get("T0", 8e3) * truth["Pi"], 1e-11)
    assert [e.lining for e in result.events if e.name == "lining_limit"] == list(
        range(1, 21)
    )
    assert names_of(result) == ["slip_onset"] + ["lining_limit"] * 20 + [
        "full_slip",
        "stop",
    ]
    closes(result, 1e-9)
    assert result.status == "stopped"


def test_stop_before_slip_is_all_elastic():
    """Z-16: the band never slips, stop at t0 + π/(2χ); nothing is heated."""
    case = {"f": 0.5, "C": 5e3, "w0": 2.0}
    onset = 8e3 / (5e3 * 0.725 * 2.0)
    result = stop_run(**case, end=10.0)
    chi = math.sqrt(5e3 * 0.725**2 / 800)
    near(result.stopping_time, onset + math.pi / (2 * chi), 1e-10)
    assert result.metrics["full_slip_time"] is None
    near(result.energy["friction_heat"], 0.0, abs=1e-9)
    assert 0 < names_of(result).count("lining_limit") < 20


def test_rigid_band_has_no_elastic_state():
    result = stop_run(C=None)
    near(result.stopping_time, 20 * 800 / (8e3 * GAIN), 1e-12)
    assert result.record.y_end.own is None
    assert names_of(result) == ["slip_onset"] + ["lining_limit"] * 20 + [
        "full_slip",
        "stop",
    ]
    assert {e.time for e in result.events[:-1]} == {0.0}
    assert result.series([0.1]).elongation is None


def test_hook_load_in_closed_form():
    """J 1200, 60 t on 8 lines and a drum of 0.4 m, 1.2 m/s, brake torque 60 kN·m, g
    9.81."""
    Pi = closed_form(n=1, f=0.3, beta=30.0)["Pi"]
    scene = sb.Scene(
        brake=sb.Brake(
            pulley=sb.Pulley(radius=0.6, inertia=1200.0),
            band=sb.Band(radius=0.6),
            linings=sb.uniform_linings(1, math.radians(30), 0.3),
        ),
        duty=sb.Duty(
            slack_tension=60e3 / (0.6 * (Pi - 1)),
            load=sb.HookLoad(mass=60e3, drum_radius=0.4, line_count=8, gravity=9.81),
        ),
        initial=sb.Initial(omega=24.0),
        end_time=3.0,
    )
    result = sb.simulate(scene)
    near(result.stopping_time, 1.05986261040236, 1e-11)
    near(result.hook_travel, 0.635917566241413, 1e-11)
    near(result.energy["friction_heat"], 763101.079489696, 1e-11)
    s = result.series([0.5])
    near(s.tight_tension[0] / s.slack_tension[0], 1.17482258673933, 1e-11)


def test_exponential_rise_of_slack_tension():
    """p = p0(1 − exp(−t/ti)) from exactly 0 on a rigid band: t_s = a + ti + ti
    W0(−exp(−(a + ti)/ti))."""
    a = 4.0
    ti = 0.5
    T_1 = 800 * 20 / a / GAIN
    scene = stop_scene(C=None, lever=sb.profiles.ExponentialRise(T_1, ti), end=8.0)
    near(sb.simulate(scene).stopping_time, 4.49993828748156, 1e-11)


def scipy_stop(T, dT, load, Pi, J, R, C, w0, t_end):
    """Take-up, elastic band, full slip, re-stick and stop, mode by mode with SciPy:
    nothing shared with simbrake."""

    def until(fun, guard, t, y):
        def event(t, y):
            return guard(t, y)

        event.terminal = True
        event.direction = -1
        out = solve_ivp(
            fun, (t, t_end), y, events=event, method="DOP853", rtol=3e-14, atol=1e-13
        )
        assert out.t_events[0].size == 1
        return out.t[-1], out.y[:, -1]

    def elastic(t, y):
        torque = (
            R * max(C * y[1] - T(t), 0.0)
            if t < times.get("t0", np.inf)
            else R * (C * y[1] - T(t))
        )
        return [(load(t, y[0]) - torque) / J, R * y[0]]

    def sliding(t, w):
        return [(load(t, w[0]) - R * T(t) * (Pi - 1)) / J]

    times = {}
    times["t0"], y = until(elastic, lambda t, y: T(t) - C * y[1], 0.0, [w0, 0.0])
    times["t1"], y = until(elastic, lambda t, y: T(t) * Pi - C * y[1], times["t0"], y)
    times["restick"], w = until(
        sliding, lambda t, w: R * w[0] - dT(t) * Pi / C, times["t1"], [y[0]]
    )
    times["stop"], y = until(
        elastic,
        lambda t, y: y[0],
        times["restick"],
        [w[0], T(times["restick"]) * Pi / C],
    )
    return times


def test_ramp_and_load_by_speed_match_scipy():
    """A lever and a load that change all the time; before the stop the rising tension
    makes the band stick again."""
    lever = sb.profiles.FunctionProfile(
        lambda t, p: p[0] + p[1] * jnp.sin(p[2] * t) ** 2,
        jnp.asarray([6e3, 4e3, 1.5]),
        1e4,
    )
    scene = stop_scene(C=4e4, lever=lever, end=3.0)
    load = sb.TorqueLoad(sb.PiecewiseLinear([0.0, 5.0], [2e3, 6e3]), drag=30.0)
    result = sb.simulate(
        sb.Scene(scene.brake, sb.Duty(lever, load), scene.initial, 3.0), rtol=1e-12
    )
    truth = scipy_stop(
        lambda t: 6e3 + 4e3 * math.sin(1.5 * t) ** 2,
        lambda t: 6e3 * math.sin(3.0 * t),
        lambda t, w: 2e3 + 800 * t - 30 * w,
        PI,
        800.0,
        0.725,
        4e4,
        20.0,
        3.0,
    )
    got = [e.time for e in result.events if e.name != "lining_limit"]
    assert changes_of(result) == [
        "slip_onset",
        "full_slip",
        "restick",
        "stop",
    ]
    all_near(got, list(truth.values()), 2e-10)
    closes(result, 1e-11)


@pytest.mark.parametrize(
    "table",
    [
        pytest.param(False, marks=pytest.mark.smoke),
        pytest.param(True, marks=pytest.mark.slow),
    ],
)
def test_stribeck_and_tables_match_scipy(table):
    v = np.linspace(0.0, 20.0, 161)
    f = 0.25 + 0.1 * np.exp(-v / 4.0)
    smooth = sb.StribeckFriction(0.35, 0.25, 4.0, exponent=1.0)
    law = sb.friction.TabulatedFriction(v, f) if table else smooth
    scene = stop_scene(C=None, law=law, end=3.0)

    def sliding(t, y):
        w = y[0]
        mu = 0.25 + 0.1 * math.exp(-0.725 * max(w, 0.0) / 4.0)
        return [-0.725 * 8e3 * (lining_ratio(mu, math.radians(13.5)) ** 20 - 1) / 800]

    out = solve_ivp(
        sliding, (0, 3), [20.0], events=at_rest, method="DOP853", rtol=1e-13, atol=1e-13
    )
    expected = out.t_events[0][0]
    got = float(sb.simulate(scene, rtol=1e-11 if not table else 1e-8).stopping_time)
    # the table's own interpolation error
    near(got, expected, 2e-5 if table else 1e-10)


@pytest.mark.slow
def test_elastic_band_heat_with_speed_law():
    """`T_n = T_0 Π(R ω)` stretches the band as it slides: its heat is ∫ (T_n − T_0)(R ω
    − Ṫ_n/C) dt."""
    C = 2e5
    T_0 = 8e3
    J = 800.0
    R = 0.725
    z = math.tan(math.radians(13.5) / 2)
    result = sb.simulate(
        stop_scene(
            C=C, law=sb.StribeckFriction(0.35, 0.25, 4.0, exponent=1.0), end=3.0
        ),
        rtol=1e-11,
    )

    def rates(t, y):
        more = 0.1 * math.exp(-R * y[0] / 4.0)
        # df/dω
        f = 0.25 + more
        slope = -R / 4.0 * more
        Pi = lining_ratio(f, math.radians(13.5)) ** 20
        alpha = -R * T_0 * (Pi - 1) / J
        stretch = T_0 * Pi * 40 * z / (1 - (f * z) ** 2) * slope * alpha / C
        return [alpha, T_0 * (Pi - 1) * (R * y[0] - stretch), T_0 * stretch]

    times = [float(result.full_slip_time), 0.5 * float(result.stopping_time)]
    s = result.series(times)
    truth = solve_ivp(
        rates, times, [float(s.omega[0]), 0.0, 0.0], "DOP853", rtol=1e-12, atol=1e-8
    ).y[:, -1]
    found = [
        s.omega[1],
        s.friction_heat[1] - s.friction_heat[0],
        s.lever_work[1] - s.lever_work[0],
    ]
    all_near(found, truth, 1e-9)


def test_other_way_swaps_slack_and_tight():
    """Rigid band, ω < 0: torque R_b T_0 (1 − 1/Π)."""
    result = stop_run(C=None, w0=-20.0, end=10.0)
    near(result.stopping_time, 20 * 800 / (0.725 * 8e3 * (1 - 1 / PI)), 1e-11)
    forces = result.series([0.5])
    near(forces.tight_tension[0], 8e3 / PI, 1e-12)
    assert float(forces.friction_force.sum()) < 0
    limits = [e.lining for e in result.events if e.name == "lining_limit"]
    assert limits == list(range(20, 0, -1))  # counted from the anchor


def test_series_has_both_values_at_events(stop):
    t1 = float(stop.stopping_time)
    left = stop.series([t1], left=True)
    right = stop.series([t1])
    near(left.brake_torque[0], 8e3 * GAIN, 1e-9)
    assert float(right.brake_torque[0]) == 0.0  # held without a load
    assert float(right.omega[0]) == 0.0


def test_values_outside_are_nan_if_asked_for(stop):
    """Before full slip of an elastic band `ω = ω_0 cos χ(t − t0)`."""
    truth = closed_form()
    chi = math.sqrt(2e5 * 0.725**2 / 800)
    t = 0.5 * (truth["t0"] + truth["t1"])
    s = stop.series([t, 99.0, -1.0, math.nan], fill=True)
    all_equal(s.t, [t, 99.0, -1.0, math.nan])
    near(s.omega[0], 20.0 * math.cos(chi * (t - truth["t0"])), 1e-9)
    for column in jax.tree.leaves(s[1:]):
        assert column.dtype == np.float64
        assert np.all(np.isfinite(column[0]))
        assert np.all(np.isnan(column[1:]))
    traced = jax.jit(lambda run: run.series(np.array([t, 99.0])))(stop)
    assert np.isnan(traced.omega[1])


def test_peaks(stop):
    m = stop.metrics
    near(m["max_tension"], 8e3 * PI, 1e-9)
    mu = PI ** (1 / 20)
    near(
        m["max_normal_load"],
        8e3 * PI * (1 + 1 / mu) * math.sin(math.radians(13.5) / 2),
        1e-9,
    )
    # first reached where the band begins to slide, behind the last lining
    assert (int(stop.max_tension.lining), int(stop.max_normal_load.lining)) == (20, 20)
    near(stop.max_tension.time, closed_form()["t1"], 1e-9)


@pytest.mark.parametrize("omega", [1e-155, 1e-300, -1e-200])
def test_tiny_speed_at_the_start(omega):
    """Its energy is below the least number: a stop at once, as from the least speeds
    that have one."""
    result = stop_run(C=None, w0=omega)
    assert (result.status, result["stopping_time"]) == (
        "stopped",
        pytest.approx(0.0, abs=1e-100),
    )
