"""The evaluator of studies against closed forms: derivatives in every direction, codes, records that were too short."""

import numpy as np
import pytest
from stop_scenes import closed_form, stop_scene

import simbrake as sb
from simbrake.studies import Evaluator, Metrics, Paths

PATHS = ("initial.omega", "brake.pulley.inertia", "duty.slack_tension.level")
NAMES = ("stopping_time", "stopping_angle")
X = np.array([18.0, 900.0, 7e3])


def scene(**changes):
    return stop_scene(C=None, **changes)


def truth(x):
    """`t = ω_0 J/(R T_0 (Π − 1))`, `φ = ω_0 t/2`, and their derivatives."""
    t = x[0] * x[1] / (0.725 * x[2] * (closed_form()["Pi"] - 1))
    powers = np.array([[1.0, 1.0, -1.0], [2.0, 1.0, -1.0]])
    values = np.array([t, x[0] * t / 2])
    return values, values[:, None] * powers / x


@pytest.mark.parametrize(
    ("reverse", "singly"),
    [
        (False, False),
        pytest.param(True, True, marks=pytest.mark.slow),
    ],
)
def test_values_and_derivatives_of_a_stop(reverse, singly):
    run = Evaluator(scene(), Paths.each(PATHS), Metrics(NAMES), size=2, reverse=reverse, singly=singly)
    found, (values, slopes) = run(X), truth(X)
    assert found.code == 0
    np.testing.assert_allclose(found.values, values, rtol=1e-9)
    np.testing.assert_allclose(found.jacobian, slopes, rtol=1e-8)
    assert run(X) is found  # remembered
    assert run.runs == 1


@pytest.mark.slow
def test_a_record_that_is_too_short():
    short = sb.simulate(scene(end=1e-3))
    run = Evaluator(
        scene(end=1e-3), Paths.each(("end_time", *PATHS)), Metrics(NAMES), size=2, reverse=True, singly=True
    )
    run.like(short)
    run.limits = (4, *run.limits)  # fewer than any stop takes
    found = run(np.array([5.0, *X]))
    assert found.code == 0
    np.testing.assert_allclose(found.values, truth(X)[0], rtol=1e-9)
    assert run.runs == 1
    few = Evaluator(scene(), Paths.each(PATHS), Metrics(NAMES), size=2, reverse=True, singly=True, max_steps=4)
    assert few(X).code == 1
    assert np.all(np.isnan(few(X).jacobian))
