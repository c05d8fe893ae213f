"""The work–precision benchmark: its equations, its reference and its interpolation."""

import pathlib
import sys

import numpy as np
import pytest

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent))

import simbrake as sb
from benchmarks import ours, peers, report
from benchmarks.equations import automaton_of
from benchmarks.peers import scipy_ivp
from benchmarks.reference import error, radau, reference
from benchmarks.scenes import CASES, closed_form, layers


@pytest.mark.parametrize("name", ["a", "b", *(pytest.param(n, marks=pytest.mark.slow) for n in "df")])
def test_scipy_and_simbrake_agree(name):
    case = CASES[name]
    theirs = peers.solve(scipy_ivp, name, "SciPy DOP853", 1e-11)
    mine = ours.simbrake_runner(case, "simbrake Dopri8", 1e-11)()
    assert max(error(case, mine, theirs)) <= 1e-9
    if name == "a":
        assert max(error(case, mine, closed_form(case.plain))) <= 1e-11
    if name == "b":
        assert theirs.times[-1] == pytest.approx(0.65866, abs=1e-5)


@pytest.mark.parametrize("name", [pytest.param("b", marks=pytest.mark.slow), "d"])
def test_reference_by_collocation(name):
    theirs = peers.solve(scipy_ivp, name, "SciPy DOP853", 1e-12)
    assert max(error(CASES[name], theirs, reference(name).answer)) <= 1e-11
    assert reference(name).uncertainty <= 1e-12


@pytest.mark.parametrize("name", ["a", "b", "c", "d", "f"])
def test_jacobians_of_the_plain_equations(name):
    rng = np.random.default_rng(0)
    for mode in automaton_of(CASES[name]).modes.values():
        if mode.rhs is None:
            continue
        y = mode.scales * rng.uniform(0.5, 1.5, len(mode.scales))
        steps = 1e-5 * mode.scales
        columns = [
            (np.asarray(mode.rhs(0.3, y + h * e)) - np.asarray(mode.rhs(0.3, y - h * e))) / (2 * h)
            for h, e in zip(steps, np.eye(len(y)), strict=True)
        ]
        found = mode.jacobian(0.3, y)
        np.testing.assert_allclose(found, np.stack(columns, axis=1), atol=1e-9 * np.max(np.abs(found)))


def test_stiff_scene_is_as_described():
    p = CASES["c"].plain
    steps = layers(1e-6, 0.028, 20)
    assert steps[0] == pytest.approx(1e-6, rel=1e-9)
    assert steps.sum() == pytest.approx(0.028, rel=1e-12)
    slope = 2 * p.n * p.f * p.z * p.fade * p.T_0 * p.Pi / (1 - (p.f * p.z) ** 2)
    assert 1 - slope * p.into[0] * p.T_0 * (p.Pi - 1) / p.C == pytest.approx(0.17, abs=0.005)  # 1 + γ at full slip
    sb.check(CASES["c"].simbrake())


def test_radau_points_integrate_their_polynomials():
    c, A = radau(5)
    for k in range(5):
        np.testing.assert_allclose(A @ c**k, c ** (k + 1) / (k + 1), atol=1e-14)
    # the last row is the quadrature, exact to degree 2 s − 2
    assert A[-1] @ c**8 == pytest.approx(1 / 9, abs=1e-14)


def test_time_at_equal_error():
    points = [{"seconds": t, "error": t**-4} for t in (1.0, 2.0, 8.0)]
    assert report.time_at(points, 3.0**-4) == pytest.approx(3.0)
    assert report.time_at(points, 10.0) == 1.0
    assert report.time_at(points, 1e-9) is None
