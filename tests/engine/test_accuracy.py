"""Estimated errors of a run against true ones: closed forms, SciPy, and runs whose events differ."""

import functools
import json
import math

import jax
import numpy as np
import pytest
from commands import output
from helpers import nothing_compiled
from oracles.independent.draws import draw
from oracles.independent.draws import scene as random_scene
from scipy.integrate import solve_ivp
from stop_scenes import closed_form, stop_scene

import simbrake as sb

#: what an estimate may be of the true error, in its own size and in that of the value
SAFE, SHARP = (3.0, 1e-13), (100.0, 1e-12)


def fading_stop(**more):
    """A rigid band on a rim that is one light lump in the air: friction fades with its temperature."""
    law = sb.friction.ProductFriction(sb.ConstantFriction(0.35), (sb.LinearFade(1e-3, 293.15),))
    heat = sb.Heat(
        bodies=(sb.thermal.Lump("rim", 400.0, 293.15), sb.thermal.Reservoir("air", 293.15)),
        links=(sb.thermal.Convection("rim", 1.0, 300.0),),
        friction=sb.thermal.FrictionHeat("rim", None, sb.thermal.ConstantPartition(1.0)),
        rim="rim",
    )
    scene = stop_scene(C=None, law=law, end=2.0, **more)
    return sb.Scene(scene.brake, scene.duty, scene.initial, scene.end_time, heat)


@functools.cache
def fading_truth():
    """Of `fading_stop` by SciPy: stopping time, angle, and maximum rise; `ω' = −M(T)/J`, `C T' = M ω − h A T`."""
    z, R, J, T0 = math.tan(math.radians(13.5) / 2), 0.725, 800.0, 8e3

    def rhs(t, y):
        f = 0.35 * (1 - 1e-3 * y[2])
        torque = R * T0 * (((1 + f * z) / (1 - f * z)) ** 20 - 1)
        return [y[1], -torque / J, (torque * y[1] - 300.0 * y[2]) / 400.0]

    def stopped(t, y):
        return y[1]

    def hottest(t, y):
        return rhs(t, y)[2]

    stopped.terminal = True
    out = solve_ivp(rhs, (0, 5), [0.0, 20.0, 0.0], "DOP853", rtol=1e-13, atol=1e-13, events=(stopped, hottest))
    return out.t[-1], out.y[0, -1], out.y_events[1][0, 2]


def holds(true, estimate, value):
    return true <= SAFE[0] * estimate + SAFE[1] * abs(value) and estimate <= SHARP[0] * true + SHARP[1] * abs(value)


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, pytest.param(1e-10, marks=pytest.mark.smoke), 1e-12])
def test_estimate_matches_the_true_error(rtol):
    result, truth = sb.simulate(stop_scene(), rtol=rtol), closed_form()
    found = result.accuracy()
    assert not found.problem
    for name, exact in (
        ("slip_onset_time", truth["t0"]),
        ("full_slip_time", truth["t1"]),
        ("stopping_time", truth["stop"]),
    ):
        assert holds(abs(result[name] - exact), found[name], exact)
    stop = next(one for one in found.events if one.name == "stop")
    assert (stop.time, stop.error) == (result["stopping_time"], found["stopping_time"])
    assert len(found.events) == len(result.events)


@pytest.mark.parametrize("rtol", [1e-3, 1e-5, 1e-8, 1e-10])
def test_error_seen_where_energy_is_exact(rtol):
    """Fade at loose tolerances: energy is conserved to rounding, while time and temperature are off."""
    t, phi, rise = fading_truth()
    result = sb.simulate(fading_stop(), rtol=rtol)
    found = result.accuracy()
    truth = {"stopping_time": t, "stopping_angle": phi, "peak_rim_temperature": 293.15 + rise}
    for name, exact in truth.items():
        assert holds(abs(result[name] - exact), found[name], exact), name
    states = {one.name: one for one in found.states}
    assert set(states) == {"angle", "speed", "energy", "temperature"}
    assert result["peak_rim_temperature"] - 50 < states["temperature"].largest <= result["peak_rim_temperature"]
    # at rest all of the angle's error is in the end
    assert holds(abs(float(result.record.y_end.phi) - phi), states["angle"].error, phi)
    if rtol == 1e-3:
        assert found["peak_rim_temperature"] / rise > 3 * float(result.energy["closure"])


@pytest.mark.slow
def test_estimate_of_stiff_and_even_stops():
    """Rodas5P; and a band that brakes evenly, which no tolerance would give other steps."""
    t, phi, _ = fading_truth()
    for rtol in (1e-4, 1e-8):
        result = sb.simulate(fading_stop(), solver=sb.hybrid.Rodas5P(), rtol=rtol)
        found = result.accuracy()
        assert holds(abs(result["stopping_time"] - t), found["stopping_time"], t)
        assert holds(abs(result["stopping_angle"] - phi), found["stopping_angle"], phi)
    even = sb.simulate(stop_scene(C=None), rtol=1e-4)
    found = even.accuracy()
    assert found.second_steps > found.steps
    assert all(one.relative is None or one.relative < 1e-12 for one in found.metrics)
    assert found["energy.load_work"] == 0.0  # exactly 0 in both
    assert found["slip_onset_time"] == 0.0


@pytest.mark.parametrize(("rtol", "second"), [(1e-3, 1e-12), (1e-12, 1e-13)])
def test_second_run_is_finer(rtol, second):
    """The tolerance is 100 times tighter, within bounds, and steps are shorter also where it would not shorten them."""
    found = sb.simulate(stop_scene(), rtol=rtol).accuracy()
    assert found.second_rtol == pytest.approx(second)
    assert found.second_steps > found.steps


def test_second_run_compiles_no_program(caplog):
    result = sb.simulate(fading_stop(), rtol=1e-7)
    str(result)
    with nothing_compiled(caplog):
        assert not result.accuracy().problem


@pytest.mark.slow
def test_other_events_are_no_estimate():
    """An elastic band that sticks just before the stop, which a loose tolerance sees as one event."""
    problem = random_scene(draw("elastic band", "fill", 8686171))
    found = sb.simulate(problem, rtol=1e-3).accuracy()
    assert found.problem.startswith("event 6 is stop at 3.387")
    assert "in this run, restick at 3.387" in found.problem
    assert (found.metrics, found.events, found.states) == ((), (), ())
    assert found.as_dict()["estimated"] is False
    assert f"no estimate of the error: {found.problem}" in str(found)
    with pytest.raises(KeyError, match="restick"):
        found["stopping_time"]
    resolved = sb.simulate(problem, rtol=1e-8)
    truth = sb.simulate(problem, rtol=1e-13)
    found = resolved.accuracy()
    for one, event in zip(found.events, truth.events, strict=True):
        assert holds(abs(one.time - event.time), one.error, max(event.time, 1e-3))


def test_run_ended_early_has_no_estimate():
    failed = sb.simulate(stop_scene(), max_events=2, throw=False)
    found = failed.accuracy()
    assert found.problem == "the run ended early (event_limit) and was not repeated"
    assert (found.metrics, found.events, found.states) == ((), (), ())
    assert "no estimate" in str(found)
    with pytest.raises(KeyError, match="ended early"):
        found["stopping_time"]


def test_step_limit_is_of_the_first_run():
    result = sb.simulate(stop_scene(), max_steps=15)
    assert not result.accuracy().problem
    assert result.accuracy().second_steps > 15


@pytest.mark.slow
def test_estimate_of_a_batch_is_refused():
    batch = jax.vmap(lambda omega: sb.simulate(sb.with_values(stop_scene(), {"initial.omega": omega})))
    with pytest.raises(sb.InputError, match="one result"):
        batch(np.asarray([18.0, 20.0])).accuracy()


@pytest.mark.slow
def test_command_prints_errors_and_keys(tmp_path):
    file = tmp_path / "stop.toml"
    sb.write_scene(stop_scene(), file)
    text = output("run", str(file), "--accuracy")
    assert "\naccuracy estimated errors of at most: event times" in text
    found = json.loads(output("run", str(file), "--accuracy", "--json"))["accuracy"]
    assert found["estimated"]
    assert found["scope"] in text
    assert set(found["states"]) == {"angle", "speed", "band_stretch", "energy"}
    assert found["cost"]["second_steps"] > found["cost"]["steps"] > 0
    assert found["metrics"]["stopping_time"]["error"] < 1e-9
    assert {one["name"] for one in found["events"]} == {"slip_onset", "lining_limit", "full_slip", "stop"}
    told = json.loads(output("explain", str(file), "--accuracy", "--no-influence", "--json"))["findings"]
    assert told[-1]["numbers"]["metrics"] == found["metrics"]
    page = json.loads(output("report", str(file), "--out", str(tmp_path / "stop.html"), "--json"))
    assert page["accuracy"]["metrics"] == found["metrics"]


@pytest.mark.slow
def test_prepared_runs_and_ensembles():
    prepared = sb.prepare(stop_scene(), ["stopping_time", "full_slip_time", "internal_slip_time"][:2], rtol=1e-4)
    for omega in (18.0, 20.0):
        found, truth = prepared.accuracy({"initial.omega": omega}), closed_form(w0=omega)
        answer = prepared({"initial.omega": omega})
        assert not found.problem
        assert holds(abs(answer.metrics["stopping_time"] - truth["stop"]), found.errors["stopping_time"], truth["stop"])
    grid = {"initial.omega": [18.0, 19.0, 20.0]}
    data = sb.ensemble(stop_scene(), grid, ["stopping_time"], rtol=1e-4, accuracy=True, progress=False)
    for omega, t, error in zip(grid["initial.omega"], data.stopping_time, data.stopping_time_error, strict=True):
        exact = closed_form(w0=omega)["stop"]
        assert holds(abs(float(t) - exact), float(error), exact)
    never = sb.ensemble(stop_scene(end=0.3), grid, ["stopping_time"], accuracy=True, progress=False)
    assert np.all(np.isnan(never.stopping_time_error))
