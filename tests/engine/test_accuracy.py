"""Estimated errors of a run against true ones: closed forms, SciPy, and runs whose
events differ."""

import dataclasses
import functools
import itertools
import math
import re

import numpy as np
import pytest
from helpers import names_of, near, nothing_compiled
from oracles.independent.draws import draw
from oracles.independent.draws import scene as random_scene
from scenes import closed_form, lining_ratio, replaced, stop_scene, tension_for
from scipy.integrate import solve_ivp

import simbrake as sb
from simbrake.runs.accuracy import difference

#: what an estimate may be of the true error, in its own size and in that of the value
SAFE = (3.0, 1e-13)
SHARP = (100.0, 1e-12)


def fading_stop(**more):
    """A rigid band on a rim that is one light lump in the air: friction fades with its
    temperature."""
    law = sb.friction.ProductFriction(0.35, (sb.LinearFade(1e-3, 293.15),))
    heat = sb.Heat(
        bodies=(
            sb.thermal.Lump("rim", 400.0, 293.15),
            sb.thermal.Reservoir("air", 293.15),
        ),
        links=(sb.thermal.Convection("rim", 1.0, 300.0),),
        friction=sb.thermal.FrictionHeat("rim", None, 1.0),
        rim="rim",
    )
    scene = stop_scene(C=None, law=law, end=2.0, **more)
    return sb.Scene(scene.brake, scene.duty, scene.initial, scene.end_time, heat)


@functools.cache
def fading_truth():
    """Of `fading_stop` by SciPy: stopping time, angle, and maximum rise;
    `ω' = −M(T)/J`, `C T' = M ω − h A T`."""
    R = 0.725
    J = 800.0
    T0 = 8e3

    def rhs(t, y):
        f = 0.35 * (1 - 1e-3 * y[2])
        torque = R * T0 * (lining_ratio(f, math.radians(13.5)) ** 20 - 1)
        return [y[1], -torque / J, (torque * y[1] - 300.0 * y[2]) / 400.0]

    def stopped(t, y):
        return y[1]

    def hottest(t, y):
        return rhs(t, y)[2]

    stopped.terminal = True
    out = solve_ivp(
        rhs,
        (0, 5),
        [0.0, 20.0, 0.0],
        "DOP853",
        rtol=1e-13,
        atol=1e-13,
        events=(stopped, hottest),
    )
    return out.t[-1], out.y[0, -1], out.y_events[1][0, 2]


def holds(true, estimate, value):
    return true <= SAFE[0] * estimate + SAFE[1] * abs(value) and estimate <= SHARP[
        0
    ] * true + SHARP[1] * abs(value)


@pytest.mark.parametrize(
    "rtol", [1e-3, 1e-6, pytest.param(1e-10, marks=pytest.mark.smoke), 1e-12]
)
def test_estimate_matches_the_true_error(rtol):
    result = sb.simulate(stop_scene(), rtol=rtol)
    truth = closed_form()
    found = result.accuracy()
    assert not found.problem
    for name, exact in (
        ("slip_onset_time", truth["t0"]),
        ("full_slip_time", truth["t1"]),
        ("stopping_time", truth["stop"]),
    ):
        assert holds(abs(result[name] - exact), found[name], exact)
    lines = str(found).splitlines()
    # of one table
    rows = ["Stopping time  ", "Time of lining limit (20)  ", "Speed at any time  "]
    assert [sum(line.startswith(row) for line in lines) for row in rows] == [1, 1, 1]
    stop = next(one for one in found.events if one.name == "stop")
    assert (stop.value, stop.error) == (result["stopping_time"], found["stopping_time"])
    assert len(found.events) == len(result.events)


@pytest.mark.parametrize("rtol", [1e-3, 1e-5, 1e-8, 1e-10])
def test_error_seen_where_energy_is_exact(rtol):
    """Fade at loose tolerances: energy is conserved to rounding, while time and
    temperature are off."""
    t, phi, rise = fading_truth()
    result = sb.simulate(fading_stop(), rtol=rtol)
    found = result.accuracy()
    truth = {
        "stopping_time": t,
        "stopping_angle": phi,
        "peak_rim_temperature": 293.15 + rise,
    }
    for name, exact in truth.items():
        assert holds(abs(result[name] - exact), found[name], exact), name
    states = {one.name: one for one in found.states}
    assert set(states) == {"angle", "speed", "energy", "temperature"}
    assert (
        result["peak_rim_temperature"] - 50
        < states["temperature"].value
        <= result["peak_rim_temperature"]
    )
    # at rest all of the angle's error is in the end
    assert holds(abs(float(result.record.y_end.phi) - phi), states["angle"].error, phi)
    if rtol == 1e-3:
        assert found["peak_rim_temperature"] / rise > 3 * float(
            result.energy["closure"]
        )


def hydrodynamic_stop():
    """An elastic band and a hydrodynamic brake, whose torque falls with the square of
    the speed."""
    return dataclasses.replace(stop_scene(), shaft=(sb.loads.HydrodynamicBrake(30.0),))


@pytest.mark.parametrize("rtol", [1e-6, 1e-8, 1e-10])
@pytest.mark.parametrize(
    ("stop", "solver"),
    [
        (fading_stop, {}),
        pytest.param(hydrodynamic_stop, {}, marks=pytest.mark.slow),
        pytest.param(
            fading_stop, {"solver": sb.hybrid.Rodas5P()}, marks=pytest.mark.slow
        ),
    ],
)
def test_errors_of_states_hold_at_any_time(stop, solver, rtol):
    """A series inside steps, beside a run with ten times as many: also where events
    come a little later."""
    result = sb.simulate(stop(), rtol=rtol, **solver)
    found = result.accuracy()
    end = float(result.scene.end_time)
    exact = sb.simulate(stop(), rtol=1e-13, max_step=0.01)
    times = np.random.default_rng(1).uniform(0.0, end, 200)
    mine = result.series(times)
    truth = exact.series(times)
    for name, column in (
        ("angle", "phi"),
        ("speed", "omega"),
        ("band_stretch", "elongation"),
        ("temperature", "rim_temperature"),
    ):
        if getattr(mine, column) is None:
            continue
        true = np.max(np.abs(getattr(mine, column) - getattr(truth, column)))
        assert true <= 2 * found[name] + 1e-14 * np.max(
            np.abs(getattr(truth, column))
        ), name
        assert found[name] <= 30 * true + 1e-12 * np.max(
            np.abs(getattr(truth, column))
        ), name


@pytest.mark.slow
def test_errors_of_states_do_not_count_jumps():
    """The speed jumps where the rope changes its layer, by 3 % and more."""
    rope = sb.rope.RopeLayers("32 mm", turns_per_layer=2, turns=19)
    load = sb.HookLoad("2 t", 0.4, 8, rope=rope)
    scene = dataclasses.replace(stop_scene(C=None, w0=24.0), duty=sb.Duty(1500.0, load))
    result = sb.simulate(scene)
    assert names_of(result).count("layer_change") > 1
    assert result.accuracy()["speed"] < 1e-9


def test_second_run_compiles_no_program(caplog):
    result = sb.simulate(fading_stop(), rtol=1e-7)
    str(result)
    with nothing_compiled(caplog):
        assert not result.accuracy().problem


@pytest.mark.slow
def test_other_events_are_no_estimate():
    """An elastic band that sticks just before the stop, which a loose tolerance sees as
    one event."""
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
        assert holds(abs(one.value - event.time), one.error, max(event.time, 1e-3))


def test_a_reversal_at_a_stop_in_one_run_alone():
    """A hoist comes to rest where the lever is pulled; in one of two runs it is seen to
    turn back 4e-8 s before."""

    def hoisted(last):
        speed = sb.PiecewiseLinear([0.0, 2.0], [-5.0, last])
        motor = sb.loads.Motor("60 kN*m", "1 MW", "40 rad/s", speed=speed)
        lever = sb.profiles.held([0.0, 2.0], [0.0, 12e3])
        load = sb.HookLoad("20 t", 0.4, 8)
        scene = stop_scene(C=None, lever=lever, w0=-5.0, load=load, end=100.0)
        return sb.simulate(dataclasses.replace(scene, motor=motor))

    plain, turned = (hoisted(last) for last in (1e-8, 1e-7))
    assert names_of(turned) == ["reversal", *names_of(plain)]
    for pair in ((plain, turned), (turned, plain)):
        found = difference(*pair)
        assert not found.problem
        assert [one.name for one in found.events] == names_of(plain)


def test_run_ended_early_has_no_estimate():
    failed = sb.simulate(stop_scene(), max_events=2, throw=False)
    found = failed.accuracy()
    assert found.problem == "the run ended early (event_limit) and was not repeated"
    assert (found.metrics, found.events, found.states) == ((), (), ())
    assert "no estimate" in str(found)
    with pytest.raises(KeyError, match="ended early"):
        found["stopping_time"]


# --- layers of walls ----------------------------------------------------------------

_START = 293.15  # K, at the start


def layered_stop(material, thickness, time, growth=1.0, layers=10):
    """A stop under a constant torque within `time` (s) whose heat all goes into a rim
    in layers."""
    inertia = 1200.0
    omega = 24.0
    radius = 0.59
    tension = tension_for(inertia * omega / time, 20, 0.35, 13.5, radius)
    wall = sb.thermal.Wall(
        "rim", material, thickness, 0.8, layers=layers, growth=growth
    )
    heat = sb.Heat(
        (wall,), (), sb.thermal.FrictionHeat("rim.front", None, 1.0), rim="rim.front"
    )
    stop = {"R": radius, "J": inertia, "T0": tension, "w0": omega, "end": 2 * time}
    return stop_scene(C=None, heat=heat, **stop)


def rise_of_a_stop(scene, time):
    """Maximum rise (K) of a half-space whose flux falls linearly to 0:
    `(4/(3 √π)) q_0 √(a t/2)/λ` at half the time."""
    wall = scene.heat.bodies[0]
    flux = (
        float(scene.brake.inertia)
        * float(scene.initial.omega) ** 2
        / (time * float(wall.area))
    )
    depth = math.sqrt(float(wall.material.diffusivity) * time / 2)
    return (
        4 / (3 * math.sqrt(math.pi)) * flux * depth / float(wall.material.conductivity)
    )


def mesh_warnings(result):
    return [text for text in result.summary()["warnings"] if text.startswith("mesh: ")]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["steel_20L", "FK-24A"])
def test_error_of_layers_covers_the_true_one(name):
    """Thick and thin layers, equal and graded: the estimate covers the error, and the
    warning comes with large ones."""
    material = sb.material(name)
    warned = set()
    for thickness, time, growth in itertools.product(
        (12e-3, 32e-3, 60e-3), (0.3, 0.84, 3.0), (1.0, 1.3, 1.8)
    ):
        if thickness < 5 * math.sqrt(float(material.diffusivity) * time):
            continue  # heat reaches the back
        scene = layered_stop(material, thickness, time, growth)
        result = sb.simulate(scene)
        truth = rise_of_a_stop(scene, time)
        true = result["peak_rim_temperature"] - _START - truth
        estimate = result.accuracy()["peak_rim_temperature"]
        where = (
            f"{thickness} m, {time} s, growth {growth}: {true / truth:.4f} of the rise"
        )
        assert abs(true) <= 1.01 * estimate, where
        assert estimate <= 2.5 * abs(true), where
        said = mesh_warnings(result)
        share = abs(true) / (truth + true)
        if abs(share - 0.025) > 2e-3:
            assert bool(said) == (share > 0.025), where
        if said:
            warned.add(thickness)
            told = float(re.search(r"is some ([\d.]+) K too high", said[0])[1])
            assert told == pytest.approx(true, rel=0.15), where
    assert warned >= {32e-3, 60e-3}


@pytest.mark.slow
def test_layers_that_a_warning_proposes_are_good():
    steel = sb.material("steel_20L")
    time = 0.84
    scene = layered_stop(steel, 60e-3, time)
    (said,) = mesh_warnings(sb.simulate(scene))
    layers, first = re.search(
        r"(\d+) layers, the first ([\d.]+) mm thick, would do", said
    ).groups()
    growth = sb.thermal.layer_growth(float(first) * 1e-3, 60e-3, int(layers))
    result = sb.simulate(layered_stop(steel, 60e-3, time, growth, int(layers)))
    near(result["peak_rim_temperature"] - _START, rise_of_a_stop(scene, time), 0.02)
    assert not mesh_warnings(result)


@pytest.mark.slow
@pytest.mark.parametrize(("layers", "growth"), [(8, 1.0), (4, 1.0), (10, 1.3)])
def test_fade_carries_the_error_of_layers_into_the_stopping_time(layers, growth):
    """Friction that falls with the mean temperature of the first layer: the estimate
    covers what thin layers change."""
    law = sb.friction.ProductFriction(0.35, (sb.LinearFade(2e-3, _START),))

    def stop(layers, growth):
        scene = layered_stop(sb.material("steel_20L"), 32e-3, 0.84, growth, layers)
        return sb.simulate(replaced(scene, {"brake.linings.friction": law}))

    thick = stop(layers, growth)
    thin = stop(80, 1.08)
    true = abs(thick["stopping_time"] - thin["stopping_time"])
    found = thick.accuracy()
    assert 1e-3 < true <= found["stopping_time"] <= 3 * true
    near(
        next(event for event in found.events if event.name == "stop").layers,
        found["stopping_time"],
    )


def test_layers_count_where_finer_ones_have_other_events():
    """A permissible temperature that only thick layers exceed: temperatures have the
    error of the layers as well."""
    scene = layered_stop(sb.material("steel_20L"), 32e-3, 0.84)
    truth = rise_of_a_stop(scene, 0.84)
    heat = dataclasses.replace(scene.heat, permissible_rim=_START + truth + 1.0)
    result = sb.simulate(dataclasses.replace(scene, heat=heat))
    found = result.accuracy()
    true = result["peak_rim_temperature"] - _START - truth
    assert [event.name for event in result.events if "permissible" in event.name]
    assert "with finer layers event" in found.finer_problem
    assert found.finer_problem in found.line
    assert true < found["peak_rim_temperature"] < 3 * true
    assert found["temperature"] >= true


@pytest.mark.slow
def test_prepared_runs_and_ensembles():
    prepared = sb.prepare(
        stop_scene(),
        ["stopping_time", "full_slip_time", "internal_slip_time"][:2],
        rtol=1e-4,
    )
    for omega in (18.0, 20.0):
        found = prepared.accuracy({"initial.omega": omega})
        truth = closed_form(w0=omega)
        answer = prepared({"initial.omega": omega})
        assert not found.problem
        assert holds(
            abs(answer.metrics["stopping_time"] - truth["stop"]),
            found.errors["stopping_time"],
            truth["stop"],
        )
    grid = {"initial.omega": [18.0, 19.0, 20.0]}
    data = sb.ensemble(
        stop_scene(), grid, ["stopping_time"], rtol=1e-4, accuracy=True, progress=False
    )
    for omega, t, error in zip(
        grid["initial.omega"], data.stopping_time, data.stopping_time_error, strict=True
    ):
        exact = closed_form(w0=omega)["stop"]
        assert holds(abs(float(t) - exact), float(error), exact)
    never = sb.ensemble(
        stop_scene(end=0.3), grid, ["stopping_time"], accuracy=True, progress=False
    )
    assert np.all(np.isnan(never.stopping_time_error))
