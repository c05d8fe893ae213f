"""Evaluators against closed forms: values, derivatives, codes, arrays."""

import jax.numpy as jnp
import numpy as np
import pytest
from goldens import assert_refused
from helpers import all_equal, all_near, input_error, near, nothing_compiled
from scenes import GAIN, stop_scene
from shoe_scenes import shoe_scene

import simbrake as sb
from simbrake.friction import ChangingFriction, FrictionChange

PATHS = ("initial.omega", "brake.pulley.inertia", "duty.slack_tension.level")
NAMES = ("stopping_time", "stopping_angle")
ANGLE = "brake.linings.angle"
X = np.array([18.0, 900.0, 7e3])


def scene(**changes):
    return stop_scene(C=None, **changes)


def truth(x):
    """`t = ω_0 J/(R T_0 (Π − 1))`, `φ = ω_0 t/2`, and their derivatives."""
    t = x[0] * x[1] / (x[2] * GAIN)
    powers = np.array([[1.0, 1.0, -1.0], [2.0, 1.0, -1.0]])
    x, values = np.asarray(x), np.array([t, x[0] * t / 2])
    return values, values[:, None] * powers / x


def test_a_scene_as_a_function_of_arrays(caplog):
    ranges = {
        "initial.omega": ("10 rad/s", "30 rad/s"),
        PATHS[1]: (700.0, 1000.0),
        PATHS[2]: (6e3, 8e3),
    }

    def twice(result):
        return 2.0 * result.stopping_time

    run = sb.studies.evaluator(scene(), ranges, [*NAMES, twice])
    assert (run.names, run.units) == (PATHS, ("rad/s", "kg*m^2", "N"))
    assert (run.metrics, run.metric_units) == ((*NAMES, "twice"), ("s", "rad", ""))
    assert run.start.tolist() == [20.0, 800.0, 8e3]
    run.jacobian(run.start)
    some = np.random.default_rng(0).uniform(*run.bounds.T, (4, 3))
    with nothing_compiled(caplog):
        values = run.evaluate(some)
        slopes = run.jacobian(some)
        one = run.evaluate(list(some[0]))
        its_slopes = run.jacobian(some[0])
    for x, y, slope in zip(some, values, slopes, strict=True):
        (t, angle), (dt, more) = truth(x)
        all_near(y, [t, angle, 2 * t], 1e-9)
        all_near(slope, [dt, more, 2 * dt], 1e-8)
    all_equal(one, values[0])
    all_equal(its_slopes, slopes[0])
    assert run.evaluate(some[:0]).shape == (0, 3)
    assert run.jacobian(some[:0]).shape == (0, 3, 3)


FACTOR = 1.0


def scaled(result):
    return FACTOR * result.stopping_time


@pytest.mark.slow
def test_a_changed_global_of_an_own_function(monkeypatch):
    for factor in (1.0, 3.0):
        monkeypatch.setitem(globals(), "FACTOR", factor)
        run = sb.studies.evaluator(scene(), "initial.omega", scaled)
        t = truth([20.0, 800.0, 8e3])[0][0]
        near(run.evaluate(run.start)[0], factor * t)
        near(run.jacobian(run.start)[0, 0], factor * t / 20.0)


@pytest.mark.slow
def test_one_number_for_all_entries_of_a_list():
    """Shifting all angles is shifting each of them; without bounds given these are the
    range of the number."""
    given = scene(n=3, beta=90.0)
    whole = sb.studies.evaluator(given, ANGLE, "stopping_time")
    each = [f"{ANGLE}[{i}]" for i in range(3)]
    single = sb.studies.evaluator(given, each, "stopping_time")
    all_near(whole.bounds, [[0.0, np.pi]])
    near(whole.start, single.start.mean())
    all_near(
        whole.jacobian(whole.start)[0, 0], single.jacobian(single.start).sum(), 1e-12
    )


@pytest.mark.slow
def test_runs_without_values_say_why():
    """A run that does not stop in time, and a shoe that locks when its friction
    grows."""
    grown = FrictionChange(sb.PiecewiseLinear([0.3, 0.3], [1.0, 1.0]))
    given = shoe_scene(
        friction=ChangingFriction(
            sb.ConstantFriction(np.array([0.32, 0.32]), 1.1), (grown,)
        )
    )
    paths = ["end_time", "brake.linings.friction.changes[0].factor.values[1]"]
    run = sb.studies.evaluator(given, paths, ["stopping_time", "energy.friction_heat"])
    assert repr(run) == (
        f"Evaluator({', '.join(paths)} → stopping_time, energy.friction_heat)"
    )
    stops, slides, locks = run.evaluate([[9.0, 1.0], [0.1, 1.0], [9.0, 4.0]])
    assert np.all(np.isfinite(stops))
    all_equal(np.isnan([slides, locks]), [[True, False], [True, True]])
    assert run.codes.tolist()[:2] == [0, 0]
    assert sb.results.FAILURES[run.codes[2]][0] == "singular_geometry"
    assert run.messages == ["", "no stopping_time", "singular_geometry"]
    all_equal(np.isnan(run.jacobian([0.1, 1.0])), [[True, True], [False, False]])
    assert np.all(np.isnan(run.jacobian([9.0, 4.0])))


def an_array(result):
    return np.ones(2) * result.stopping_time


def of_nothing(result):
    return result.stoping_time


def undefined(result):
    return jnp.log(-result.stopping_time)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("metric", "words"),
    [
        (an_array, "an_array: is an array"),
        (of_nothing, r"of_nothing: raises AttributeError: .*nearest: stopping_time"),
        (
            undefined,
            "undefined: is not a number in the scene|undefined: has no value in this run",
        ),
    ],
)
def test_a_metric_of_ones_own_that_fails_is_named(metric, words):
    few = scene(n=2)
    studies = {
        "evaluator": lambda: sb.studies.evaluator(few, PATHS, metric),
        "sensitivity": lambda: sb.studies.sensitivity(few, metric),
        "ensemble": lambda: sb.ensemble(few, {PATHS[0]: [10.0, 20.0]}, [metric]),
    }
    if metric is undefined:  # in some runs of many it may be
        del studies["ensemble"]
    for study in studies.values():
        with input_error(match=words) as caught:
            study()
        assert len(caught.value.faults) == 1


def test_all_errors_of_the_input(request):
    given = scene()
    studies = [
        lambda parameters=parameters, metrics=metrics: sb.studies.evaluator(
            given, parameters, metrics
        )
        for parameters, metrics in (
            ({"initial.omeg": (1.0, 2.0)}, [max, max]),
            ({ANGLE: (0.1, 0.2), f"{ANGLE}[2]": (0.1, 0.2)}, NAMES),
            ({PATHS[0]: ("10 m", "20 m")}, NAMES),
            ({PATHS[1]: (-1.0, 2.0), PATHS[2]: (2.0, 1.0)}, NAMES),
            (["brake.linings.count"], NAMES),
            ([], NAMES),
        )
    ]
    evaluate = sb.studies.evaluator(given, PATHS).evaluate
    points = [
        lambda x=x: evaluate(x)
        for x in (
            [20.0, -800.0, 8e3],
            [np.nan, 800.0, 8e3],
            1.0,
            [20.0, 800.0],
            "20 rad/s",
        )
    ]
    assert_refused(request, "evaluators", studies + points)
