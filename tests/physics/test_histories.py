"""Histories of many points: against the same course of few, against closed forms, and
what a step costs."""

import dataclasses
import time

import jax
import numpy as np
import pytest
from helpers import all_near, near
from test_actuator import W0, J, scene

import simbrake as sb
from simbrake.loads import Actuator

RISE = 0.4
PULL = 9e3
POINTS = 400
RAMP = sb.PiecewiseLinear([0.0, RISE], [0.0, PULL])
T = np.concatenate([np.linspace(0.0, RISE, POINTS - 1), [4.0]])
SAMPLED = sb.PiecewiseLinear(T, np.interp(T, [0.0, RISE], [0.0, PULL]))
CYCLE = np.linspace(0.0, RISE, 40)
COURSES = {
    "lever": (RAMP, SAMPLED),
    "actuator": (Actuator(RAMP, 0.1, 0.05, 200.0), Actuator(SAMPLED, 0.1, 0.05, 200.0)),
    "cycles": (
        Actuator(sb.Repeated([0.0, RISE], [0.0, PULL], 0.5, 12), 0.1),
        Actuator(sb.Repeated(CYCLE, PULL * CYCLE / RISE, 0.5, 12), 0.1),
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("course", COURSES.values(), ids=COURSES)
def test_samples_of_straight_lines_are_these_lines(course):
    """Values, and derivatives: along a change of all samples in proportion that of the
    line's height."""
    stops = []
    slopes = []
    for lever in course:
        run = sb.prepare(scene(lever), ["stopping_time"], rtol=1e-12)
        values = next(
            place for path, place in run.places.items() if path.endswith("values")
        )
        stops.append(run().metrics["stopping_time"])
        slopes.append(run.gradient()[0, values] @ run.numbers[values])
    near(stops[1], stops[0], 1e-11)
    assert slopes[0] < 0
    near(slopes[1], slopes[0], 1e-8)


def end_speed(result):
    return result.record.y_end.omega


@pytest.mark.slow
def test_held_samples_of_a_torque_add_up():
    """`J (ω − ω_0) = Σ M_i Δt_i`; derivatives with respect to the first, a middle and
    the last sample are `Δt_i/J`, and with respect to the time of a jump its height over
    `J`."""
    t = np.linspace(0.0, 3.9, 40)
    M = 100.0 * np.cos(np.arange(40.0))
    free = scene(0.0, end=4.0)
    free = dataclasses.replace(
        free, duty=sb.Duty(0.0, sb.TorqueLoad(sb.profiles.held(t, M)))
    )
    run = sb.prepare(free, [end_speed], rtol=1e-12)
    near(run().metrics["end_speed"], W0 + M.sum() * 0.1 / J, 1e-13)
    slope = run.gradient()[0]
    by_value = slope[run.places["duty.load.profile.values"]]
    all_near(
        by_value[::2][[0, 20, 39]] + np.append(by_value[1::2], 0.0)[[0, 20, 39]],
        0.1 / J,
    )
    by_time = slope[run.places["duty.load.profile.times"]]
    all_near(by_time[1::2] + by_time[2::2], (M[:-1] - M[1:]) / J, atol=1e-13)


@pytest.mark.slow
def test_thousands_of_samples_in_each_kind_of_program():
    """`J (ω − ω_0) = ∫ M dt` by trapezoids, in a prepared run and in a user's `jit`.
    (XLA makes other code for so many numbers.)"""
    t = np.linspace(0.0, 4.0, 14_000)
    M = 100.0 * np.cos(7.0 * t)
    limits = {"rtol": 1e-10, "max_steps": 80_000}

    def free(samples):
        load = sb.TorqueLoad(sb.PiecewiseLinear(t, samples))
        return dataclasses.replace(scene(0.0, end=4.0), duty=sb.Duty(0.0, load))

    speed = pytest.approx(W0 + np.trapezoid(M, t) / J, rel=1e-12)
    assert sb.prepare(free(M), [end_speed], **limits)().metrics["end_speed"] == speed
    assert jax.jit(lambda M: end_speed(sb.simulate(free(M), **limits)))(M) == speed


@pytest.mark.slow
def test_a_step_costs_the_same_however_many_points_there_are():
    """Runs and gradients with 32 times as many points: time per step within twice, the
    best of several tries."""

    def cost(points):
        t = np.linspace(0.0, 4.9, points)
        run = sb.prepare(
            scene(sb.PiecewiseLinear(t, 9e3 + 1e3 * np.sin(5 * t))), ["stopping_time"]
        )
        run.gradient()  # (compiles)
        seconds = []
        for call in (run, run.gradient):
            tries = []
            for _ in range(7):
                begun = time.perf_counter()
                call()
                tries.append(time.perf_counter() - begun)
            seconds.append(min(tries))
        return np.divide(seconds, run().accepted)

    few = cost(250)
    many = cost(8000)
    assert np.all(many < 2 * few), (few, many)


@pytest.mark.slow
def test_each_sample_of_the_air_acts_on_a_network():
    """`C Ṫ = G (T_air − T)`: a sample acts as the integral of its hat under
    `(G/C) e^{−(t_e − t) G/C}`, and the shift of all as `1 − e^{−t_e G/C}`."""
    rate = 0.3
    t = np.linspace(0.0, 5.0, 41)
    step = t[1]

    def end_temperature(samples):
        air = sb.thermal.Reservoir("air", sb.PiecewiseLinear(t, samples))
        link = sb.thermal.Conductance("rim", "air", 1e4 * rate)
        heat = sb.Heat((sb.thermal.Lump("rim", 1e4, 300.0), air), (link,))
        return sb.simulate_heat(heat, [0.0, t[-1]], rtol=1e-11).temperature[-1, 0]

    slope = jax.grad(end_temperature)(300 + 10 * np.sin(t))
    near(slope.sum(), 1 - np.exp(-5.0 * rate), 1e-10)
    hat = np.exp((t[1:-1] - 5.0) * rate) * 2 * (np.cosh(rate * step) - 1)
    all_near(slope[1:-1], hat / (rate * step), 1e-8)
