"""Evaluators against closed forms: values, derivatives, codes, arrays."""

import jax.numpy as jnp
import numpy as np
import pytest
from helpers import nothing_compiled
from shoe_scenes import shoe_scene
from stop_scenes import closed_form, stop_scene

import simbrake as sb
from simbrake.friction import ChangingFriction, FrictionChange

PATHS = ("initial.omega", "brake.pulley.inertia", "duty.slack_tension.level")
NAMES = ("stopping_time", "stopping_angle")
X = np.array([18.0, 900.0, 7e3])


def scene(**changes):
    return stop_scene(C=None, **changes)


def truth(x):
    """`t = ω_0 J/(R T_0 (Π − 1))`, `φ = ω_0 t/2`, and their derivatives."""
    t = x[0] * x[1] / (0.725 * x[2] * (closed_form()["Pi"] - 1))
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
    np.testing.assert_array_equal(
        run.bounds, [[10.0, 30.0], [700.0, 1000.0], [6e3, 8e3]]
    )
    np.testing.assert_array_equal(run.start, [20.0, 800.0, 8e3])
    run.jacobian(run.start)
    some = np.random.default_rng(0).uniform(*run.bounds.T, (4, 3))
    with nothing_compiled(caplog):
        values = run.evaluate(some)
        slopes = run.jacobian(some)
        one = run.evaluate(list(some[0]))
        its_slopes = run.jacobian(some[0])
    for x, y, slope in zip(some, values, slopes, strict=True):
        (t, angle), (dt, more) = truth(x)
        np.testing.assert_allclose(y, [t, angle, 2 * t], rtol=1e-9)
        np.testing.assert_allclose(slope, [dt, more, 2 * dt], rtol=1e-8)
    np.testing.assert_array_equal(one, values[0])
    np.testing.assert_array_equal(its_slopes, slopes[0])
    assert run.evaluate(some[:0]).shape == (0, 3)
    assert run.jacobian(some[:0]).shape == (0, 3, 3)


FACTOR = 1.0


def scaled(result):
    return FACTOR * result.stopping_time


def test_a_changed_global_of_an_own_function(monkeypatch):
    for factor in (1.0, 3.0):
        monkeypatch.setitem(globals(), "FACTOR", factor)
        run = sb.studies.evaluator(scene(), "initial.omega", scaled)
        t = truth([20.0, 800.0, 8e3])[0][0]
        assert run.evaluate(run.start)[0] == pytest.approx(factor * t)
        assert run.jacobian(run.start)[0, 0] == pytest.approx(factor * t / 20.0)
        row = sb.sensitivity(scene(), scaled, "initial.omega", span=None).at(
            "initial.omega"
        )
        assert row.derivative == pytest.approx(factor * t / 20.0)


def test_one_number_for_all_entries_of_a_list():
    """Shifting all angles is shifting each of them; without bounds given these are the
    range of the number."""
    path = "brake.linings.angle"
    whole = sb.studies.evaluator(scene(), path, "stopping_time")
    single = sb.studies.evaluator(
        scene(), [f"{path}[{i}]" for i in range(20)], "stopping_time"
    )
    np.testing.assert_allclose(whole.bounds, [[0.0, np.pi]])
    assert whole.start == pytest.approx(single.start.mean())
    np.testing.assert_allclose(
        whole.jacobian(whole.start)[0, 0],
        single.jacobian(single.start).sum(),
        rtol=1e-12,
    )


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
    stops, slides, locks = run.evaluate([[9.0, 1.0], [0.1, 1.0], [9.0, 4.0]])
    assert np.all(np.isfinite(stops))
    np.testing.assert_array_equal(
        np.isnan([slides, locks]), [[True, False], [True, True]]
    )
    assert run.codes.tolist()[:2] == [0, 0]
    assert sb.results.FAILURES[run.codes[2]][0] == "singular_geometry"
    assert run.messages == ["", "no stopping_time", "singular_geometry"]
    np.testing.assert_array_equal(
        np.isnan(run.jacobian([0.1, 1.0])), [[True, True], [False, False]]
    )
    assert np.all(np.isnan(run.jacobian([9.0, 4.0])))


def an_array(result):
    return np.ones(2) * result.stopping_time


def of_nothing(result):
    return result.stoping_time


def undefined(result):
    return jnp.log(-result.stopping_time)


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
    studies = {
        "evaluator": lambda: sb.studies.evaluator(scene(), PATHS, metric),
        "sensitivity": lambda: sb.studies.sensitivity(scene(), metric),
        "ensemble": lambda: sb.ensemble(
            scene(), {"initial.omega": [10.0, 20.0]}, metrics=[metric]
        ),
    }
    if metric is undefined:  # in some runs of many it may be
        del studies["ensemble"]
    for study in studies.values():
        with pytest.raises(sb.InputError, match=words) as caught:
            study()
        assert len(caught.value.faults) == 1


def test_all_errors_of_the_input():
    given = {
        "initial.omeg": (10.0, 20.0),
        "brake.linings.angle": (0.1, 0.2),
        "brake.linings.angle[2]": (0.1, 0.2),
    }
    with pytest.raises(sb.InputError) as caught:
        sb.studies.evaluator(scene(), given, ["stoping_time", max, max])
    assert [fault.path for fault in caught.value.faults] == [
        *list(given)[::2],
        "stoping_time",
        "max",
    ]
    given = {
        "initial.omega": ("10 m", "20 m"),
        "brake.pulley.inertia": (-1.0, 2.0),
        PATHS[2]: (2.0, 1.0),
    }
    with pytest.raises(sb.InputError) as caught:
        sb.studies.evaluator(scene(), given)
    assert [fault.path for fault in caught.value.faults] == ["initial.omega", *given]
    with pytest.raises(
        sb.InputError,
        match=r"(?s)brake\.linings\.area: cannot vary.*brake\.linings\.count: cannot vary",
    ):
        sb.studies.evaluator(scene(), ["brake.linings.area", "brake.linings.count"])
    with pytest.raises(sb.InputError, match="parameters: is empty"):
        sb.studies.evaluator(scene(), [])

    run = sb.studies.evaluator(scene(), PATHS)
    with pytest.raises(sb.InputError) as caught:
        run.evaluate([[20.0, -800.0, 8e3], [20.0, -900.0, 8e3], [np.nan, 800.0, 8e3]])
    assert [fault.path for fault in caught.value.faults] == [PATHS[1], PATHS[0]]
    assert "(runs 0, 1)" in str(caught.value)
    for X in (1.0, [20.0, 800.0], np.zeros((2, 2, 3)), "20 rad/s"):
        with pytest.raises(sb.InputError, match="X: "):
            run.evaluate(X)
