"""Calibration: planted parameters come back within their own error bars, and what data leave open is named."""

import contextlib

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from heat_scenes import fading, lump, rigid_stop
from scipy.optimize import least_squares
from scipy.stats import binom, chi2, norm, t
from stop_scenes import closed_form, stop_scene

import simbrake as sb
from simbrake import plot
from simbrake.studies import Outcome, State
from simbrake.studies._calibration import Parameter, _absoluteness, _combination, _elsewhere, _words
from simbrake.studies._evaluator import Box, Evaluation, Faults, Paths
from simbrake.studies._fit import _LOSSES, _RHO, Direction, FitModel, Search, confound, cost, identify

OMEGA, T0, J, F = (
    "initial.omega",
    "duty.slack_tension.level",
    "brake.pulley.inertia",
    "brake.linings.friction.coefficient",
)
TS = np.linspace(0.02, 0.6, 30)  # all before the stop of the rigid scene at 0.649 s
SIGMA = 0.2
LINE = {OMEGA: (5.0, 60.0), T0: (2e3, 3e4)}
START = {OMEGA: 15.0, T0: 6e3}


def rigid(**changes):
    return stop_scene(C=None, **changes)


def rate(T=1.0):
    """Deceleration (rad/s²) of the rigid scene, ω = ω_0 − rate·t, per newton of slack tension."""
    return 0.725 * (closed_form()["Pi"] - 1) / 800.0 * T


def line(w0=20.0, T=8e3, noise=None):
    exact = w0 - rate(T) * TS
    return exact if noise is None else exact + SIGMA * noise.standard_normal(TS.size)


def speeds(values, sigma=SIGMA):
    return sb.studies.Measured.of(TS, {"omega": values}, sigma=None if sigma is None else {"omega": sigma})


# --- errors ---------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_covariance_of_a_linear_problem_is_the_closed_one():
    fit = sb.calibrate(rigid(), LINE, speeds(line(noise=np.random.default_rng(0))), start=START)
    X = np.stack([np.ones_like(TS), -rate() * TS], axis=1)
    cov = SIGMA**2 * np.linalg.inv(X.T @ X)
    best = np.linalg.lstsq(X, line(noise=np.random.default_rng(0)), rcond=None)[0]
    np.testing.assert_allclose([fit[OMEGA].value, fit[T0].value], best, rtol=1e-9)
    np.testing.assert_allclose(fit.covariance, cov, rtol=1e-7)
    np.testing.assert_allclose(fit.correlation[0, 1], cov[0, 1] / np.sqrt(cov[0, 0] * cov[1, 1]), rtol=1e-7)
    half = norm.ppf(0.975) * np.sqrt(np.diag(cov))
    np.testing.assert_allclose(fit[T0].interval, best[1] + half[1] * np.array([-1, 1]), rtol=1e-7)
    assert fit.freedom == TS.size - 2
    assert fit.probability == pytest.approx(chi2.sf(fit.chi2, fit.freedom))
    assert fit.converged
    assert fit.outcome == Outcome.CONVERGED
    assert f"reduced χ² {fit.chi2 / 28:.3g} (28 degrees of freedom)" in fit.headline
    assert fit.open == ()
    assert float(fit.scene.initial.omega) == fit[OMEGA].value
    spans = np.array([55.0, 28e3])
    np.testing.assert_allclose(fit.singular_values, np.linalg.svd(X * spans / SIGMA, compute_uv=False), rtol=1e-7)


@pytest.mark.slow
def test_figure_shows_measurements_runs_and_residuals():
    """Speeds before and after the fit are straight lines; the stopping time before it is ω_0/rate."""
    values, stop = line(noise=np.random.default_rng(0)), 20.0 / rate(8e3)
    data = speeds(values) + sb.studies.Measured.of(events={"stopping_time": (stop, 0.01)})
    fit = sb.calibrate(rigid(), LINE, data, start=START)
    (course, was), (residuals, now) = np.reshape(plot.calibration(fit).axes, (2, 2))
    lines = {one.get_label(): one for one in course.lines}
    for label, w0, T in (("before", 15.0, 6e3), ("fitted", fit[OMEGA].value, fit[T0].value)):
        t, drawn = lines[label].get_data()
        assert (t[0], t[-1]) == (TS[0], TS[-1])
        np.testing.assert_allclose(drawn, w0 - rate(T) * t, rtol=1e-9)
    (points,) = course.containers
    np.testing.assert_array_equal(points.lines[0].get_xydata(), np.stack([TS, values], axis=1))
    ends = np.asarray(points.lines[2][0].get_segments())[:, :, 1]
    np.testing.assert_allclose(ends, np.stack([values - SIGMA, values + SIGMA], axis=1), rtol=1e-12)
    fitted = fit[OMEGA].value - rate(fit[T0].value) * TS
    np.testing.assert_allclose(residuals.lines[0].get_xydata().T, [TS, (fitted - values) / SIGMA], rtol=1e-6)
    for panel, time in ((was, 15.0 / rate(6e3)), (now, fit[OMEGA].value / rate(fit[T0].value))):
        (bar,) = panel.patches[:1]
        assert bar.get_height() == pytest.approx((time - stop) / 0.01, rel=1e-6)


def test_without_standard_deviations_errors_come_from_the_scatter():
    values = line(noise=np.random.default_rng(3))
    fit = sb.calibrate(rigid(), LINE, speeds(values, None), start=START)
    X = np.stack([np.ones_like(TS), -rate() * TS], axis=1)
    r = values - X @ np.linalg.lstsq(X, values, rcond=None)[0]
    cov = r @ r / (TS.size - 2) * np.linalg.inv(X.T @ X)
    np.testing.assert_allclose(fit.covariance, cov, rtol=1e-7)
    low, high = fit[OMEGA].interval
    assert (high - low) / 2 == pytest.approx(t.ppf(0.975, TS.size - 2) * np.sqrt(cov[0, 0]), rel=1e-7)
    assert fit.probability is None
    assert not fit.absolute
    assert np.mean(fit.residuals[0].scaled ** 2) == pytest.approx(1 - 2 / TS.size)
    weights = sb.calibrate(rigid(), LINE, speeds(values, 7.0), start=START, absolute=False)
    np.testing.assert_allclose(weights.covariance, cov, rtol=1e-6)


@pytest.mark.slow
def test_coverage_of_the_intervals_over_repeated_experiments(caplog):
    """60 seeded experiments on one program: intervals hold the truth, errors are neither too small nor too large."""
    sb.calibrate(rigid(), LINE, speeds(line()), start=START)
    noise, runs = np.random.default_rng(7), 60
    inside, distance, scatter = np.zeros(2), 0.0, 0.0
    truth = np.array([20.0, 8e3])
    for i in range(runs):
        with jax.log_compiles() if i else contextlib.nullcontext():
            fit = sb.calibrate(rigid(), LINE, speeds(line(noise=noise)), start=START)
        off = np.array([fit[OMEGA].value, fit[T0].value]) - truth
        inside += [p.interval[0] <= x <= p.interval[1] for p, x in zip(fit.parameters, truth, strict=True)]
        distance += off @ np.linalg.solve(fit.covariance, off)
        scatter += fit.chi2
    assert "Compiling" not in caplog.text
    assert np.all(inside >= binom.ppf(1e-3, runs, 0.95))
    assert chi2.ppf(1e-3, 2 * runs) < distance < chi2.ppf(1 - 1e-3, 2 * runs)
    freedom = runs * (TS.size - 2)
    assert chi2.ppf(1e-3, freedom) < scatter < chi2.ppf(1 - 1e-3, freedom)


@pytest.mark.slow
def test_what_speeds_cannot_tell_apart_is_found_and_named():
    """ω = ω_0 − R_b T_0 (Π − 1)/J t: of T_0 and J only the ratio is determined, and f enters the same product."""
    bounds = {OMEGA: (5.0, 60.0), T0: (2e3, 3e4), J: (200.0, 5e3)}
    fit = sb.calibrate(rigid(), bounds, speeds(line(noise=np.random.default_rng(0))), start=START)
    assert [p.state for p in fit.parameters] == [State.FITTED, State.OPEN, State.OPEN]
    assert np.isinf(fit[T0].standard_error)
    assert np.isinf(fit[J].standard_error)
    assert fit.outcome == Outcome.NOT_DETERMINED
    assert fit.headline.startswith(f"not determined: the data do not determine {T0}, {J}")
    assert any(text.startswith(f"fix {T0} or {J}") for text in fit.advice)
    (one,) = fit.open
    assert np.isinf(one.spread)
    assert one.relative[T0] == pytest.approx(one.relative[J], rel=1e-6)
    assert one.relative[OMEGA] == pytest.approx(0.0, abs=1e-6)
    assert T0 in one.words
    assert J in one.words
    assert OMEGA not in one.words
    assert "^-1" in one.words
    X = np.stack([np.ones_like(TS), TS], axis=1)
    best, cov = np.linalg.lstsq(X, line(noise=np.random.default_rng(0)), rcond=None)[0], np.linalg.inv(X.T @ X)
    assert fit[OMEGA].standard_error == pytest.approx(SIGMA * np.sqrt(cov[0, 0]), rel=1e-6)
    assert fit[T0].value / fit[J].value == pytest.approx(-best[1] / (rate() * 800.0), rel=1e-9)
    assert fit.singular_values[2] < 1e-9 * fit.singular_values[0]
    saved = fit.as_dict()
    assert saved["parameters"][1]["standard_error"] is None
    assert saved["open"][0]["spread"] is None
    assert "standard error infinite" in str(fit)


def test_a_product_is_named_only_where_nothing_else_is_open_in_its_parameters():
    one, other = (Direction(np.array(change), 0.0, np.inf) for change in ([1.0, -1.0, 0.0], [0.0, 1.0, 1.0]))
    arguments = ["p", "q", "r"], np.ones(3), np.array([True, True, True])
    assert "the data determine only (p)·(q)^1" in _combination(one, [one], *arguments).words
    assert "the data determine only" not in _combination(one, [one, other], *arguments).words


def test_errors_against_outliers_are_those_of_the_sandwich():
    rng = np.random.default_rng(5)
    X, r = rng.standard_normal((40, 3)) * 30, rng.standard_normal(40)
    got = identify(X, r, absolute=True, loss="huber", loss_scale=1e9, noise=1e-9)
    H = np.linalg.inv(X.T @ X)
    np.testing.assert_allclose(got.covariance, H @ (X.T * r**2) @ X @ H * 40 / 37, rtol=1e-10)
    # beyond the threshold, by `H = Jᵀ diag(C'') J` and `diag(C'²)` of the objective `C(r)`, differentiated numerically
    c = 0.8
    for loss, rho in (("soft_l1", lambda z: 2 * (np.sqrt(1 + z) - 1)), ("cauchy", np.log1p)):
        objective, h = lambda x, rho=rho: 0.5 * c**2 * rho((x / c) ** 2), 1e-4
        force = (objective(r + h) - objective(r - h)) / (2 * h)
        curved = np.maximum((objective(r + h) - 2 * objective(r) + objective(r - h)) / h**2, 0.0)
        G = np.linalg.inv((X.T * curved) @ X)
        sandwich = G @ (X.T * force**2) @ X @ G * 40 / 37
        got = identify(X, r, absolute=True, loss=loss, loss_scale=c, noise=1e-9)
        np.testing.assert_allclose(got.covariance, sandwich, rtol=1e-5, atol=1e-5 * np.abs(sandwich).max())
        assert cost(r, loss, c) == pytest.approx(
            least_squares(lambda x, r=r: r, [0.0], loss=loss, f_scale=c).cost, rel=1e-12
        )
    plain = identify(X, r, absolute=True, loss="linear", loss_scale=1.0, noise=1e-9)
    np.testing.assert_allclose(plain.covariance, H, rtol=1e-10)
    vague = identify(X * [1, 1, 1e-3], r, absolute=True, loss="linear", loss_scale=1.0, noise=1e-9)
    assert list(vague.concerned) == [False, False, True]
    assert vague.open[0].spread == pytest.approx(1e3 * np.sqrt(H[2, 2]), rel=0.01)


def test_a_robust_loss_shrugs_off_outliers():
    values = line(noise=np.random.default_rng(2))
    values[[4, 11, 25]] += 20.0
    plain = sb.calibrate(rigid(), LINE, speeds(values), start=START)
    robust = sb.calibrate(rigid(), LINE, speeds(values), start=START, loss="cauchy")
    assert abs(robust[T0].value - 8e3) < 3 * robust[T0].standard_error
    assert abs(plain[T0].value - 8e3) > 3 * plain[T0].standard_error
    assert plain.probability < 1e-6
    assert any("does not explain" in text for text in plain.warnings)


# --- recovery and derivatives ---------------------------------------------------------------------------------------

ELASTIC = {F: (0.1, 0.6), "brake.band.stiffness": (1e4, 1e7), J: (200.0, 3e3)}
EVENTS = ("slip_onset_time", "full_slip_time", "stopping_time")


def elastic_data():
    """Closed-form event times, and speeds in the elastic stage and after it, of f 0.31, C 1.5e5, J 900."""
    case = {"f": 0.31, "C": 1.5e5, "J": 900.0}
    form, run = closed_form(**case), sb.simulate(stop_scene(**case), rtol=1e-12)
    ts = np.array([0.001, 0.004, 0.008, 0.1, 0.3, 0.5, 4.0])
    events = dict(zip(EVENTS, ((form["t0"], 1e-5), (form["t1"], 1e-5), (form["stop"], 1e-3)), strict=True))
    return sb.studies.Measured.of(ts, {"omega": run.series(ts).omega}, sigma={"omega": 0.1}, events=events)


@pytest.fixture(scope="module")
def elastic():
    return elastic_data()


def test_planted_parameters_come_back_from_exact_data(elastic):
    fit = sb.calibrate(stop_scene(), ELASTIC, elastic, rtol=1e-11)
    np.testing.assert_allclose(list(fit.values.values()), [0.31, 1.5e5, 900.0], rtol=1e-8)
    assert [p.logarithmic for p in fit.parameters] == [False, True, False]
    assert fit.chi2 < 1e-8
    low, high = fit["brake.band.stiffness"].interval
    assert low * high == pytest.approx(1.5e5**2, rel=1e-6)  # symmetric in its logarithm


def central(model, theta, relative=1e-5):
    columns = []
    for i, x in enumerate(theta):
        h = relative * x
        steps = [model(theta + k * h * np.eye(theta.size)[i]).values for k in (-2, -1, 1, 2)]
        columns.append((8 * (steps[2] - steps[1]) - (steps[3] - steps[0])) / (12 * h))
    return np.stack(columns, axis=1)


def test_jacobian_against_central_differences(elastic):
    import diffrax

    model = FitModel(stop_scene(), tuple(ELASTIC), elastic, solver=diffrax.Dopri8(), rtol=1e-11, max_steps=None)
    theta = np.array([0.31, 1.5e5, 900.0])
    J, D = model(theta).jacobian * theta, central(model, theta) * theta
    np.testing.assert_allclose(J, D, rtol=1e-6, atol=1e-8 * np.abs(D).max())


@pytest.mark.slow
def test_friction_fade_and_heat_capacity_of_a_heated_stop():
    def scene(f, slope, capacity):
        return rigid_stop(fading(f, slope), lump(capacity), end=2.0)

    planted = np.array([0.33, 8e-4, 1.6e4])
    run = sb.simulate(scene(*planted), rtol=1e-12)
    ts = np.linspace(0.05, 1.5, 25)
    s = run.series(ts)
    data = sb.studies.Measured.of(
        ts,
        {"omega": s.omega, "rim_temperature": s.rim_temperature[:, 0]},
        sigma={"omega": 0.1, "rim_temperature": 1.0},
        events={"stopping_time": (float(run.stopping_time), 0.01)},
    )
    bounds = {
        "brake.linings.friction.base.coefficient": (0.2, 0.5),
        "brake.linings.friction.factors[0].slope": (0.0, 3e-3),
        "heat.bodies[0].capacity": (5e3, 1e5),
    }
    guess = scene(0.35, 3e-4, 2e4)
    fit = sb.calibrate(guess, bounds, data, rtol=1e-11)
    np.testing.assert_allclose(list(fit.values.values()), planted, rtol=1e-8)
    assert "Dopri8" in fit.solver
    import diffrax

    model = FitModel(guess, tuple(bounds), data, solver=diffrax.Dopri8(), rtol=1e-11, max_steps=None)
    J, D = model(planted).jacobian * planted, central(model, planted) * planted
    np.testing.assert_allclose(J, D, rtol=1e-6, atol=1e-8 * np.abs(D).max())


# --- what a fit has not learned ---------------------------------------------------------------------------------------

HOLDS, TRUTH = 280.0, 224.85  # N: the brake holds the load of `held` from the first one on
LATER = np.linspace(0.1, 2.0, 20)


def held(T):
    """A load that hangs on the brake: from rest it accelerates at `(M − R T_0 (Π − 1))/J`, or is held."""
    return rigid(T0=T, w0=0.0, load=rate(HOLDS) * 800.0)


def lowering(T, noise):
    exact = max(rate(HOLDS) - rate(T), 0.0) * LATER
    values = exact + 0.01 * np.random.default_rng(noise).standard_normal(LATER.size)
    return sb.studies.Measured.of(LATER, {"omega": values}, sigma={"omega": 0.01})


@pytest.mark.slow
def test_a_start_that_holds_the_load_is_stuck_and_told_the_way_out():
    bounds = {T0: (100.0, 400.0)}
    fit = sb.calibrate(held(300.0), bounds, lowering(TRUTH, 0))
    assert (fit.outcome, fit.converged) == (Outcome.STUCK, False)
    assert fit.chi2 == pytest.approx(fit.chi2_start, rel=1e-12)
    assert fit.headline.startswith(f"stuck: no measured value reacts to {T0} = 300 N")
    assert "starts=6" in fit.advice[0]
    assert fit.as_dict()["outcome"] == "stuck"
    assert str(fit).splitlines()[0] == fit.headline
    out = sb.calibrate(held(300.0), bounds, lowering(TRUTH, 0), starts=6)
    assert out.outcome == Outcome.CONVERGED
    assert abs(out[T0].value - TRUTH) < 3 * out[T0].standard_error
    # a load that is held indeed: every force that holds it explains the data
    still = sb.calibrate(held(300.0), bounds, lowering(300.0, 1))
    assert still.outcome == Outcome.NOT_DETERMINED
    assert T0 in still.headline


class Toy:
    """A model of one parameter from 0 to 1, and its slope, in the place of a scene."""

    def __init__(self, values, h=1e-6):
        self.rtol, self.runs, self.failures, self.paths = 1e-10, 0, {}, ("p",)
        self.run = self
        self.values, self.h = values, h

    def __call__(self, x):
        self.runs += 1
        up, here, down = (np.atleast_1d(self.values(float(x[0]) + k * self.h)) for k in (1, 0, -1))
        return Evaluation(here, ((up - down) / (2 * self.h))[:, None], 0, None)

    def refused(self, found):
        return None


@pytest.mark.parametrize(
    ("values", "measured", "start", "unexplained", "stuck"),
    [
        (lambda p: max(0.6 - p, 0.0), 0.4, 0.8, True, True),  # reacts below 0.6 only
        (lambda p: max(0.6 - p, 0.0), 0.4, 0.8, False, True),  # and fits better there, whatever the noise is
        (lambda p: max(0.6 - p, 0.0), 0.0, 0.8, False, False),  # fits where it is
        (lambda p: max(0.6 - p, 0.0), -5.0, 0.8, True, True),  # explains nothing, and has seen a part of its bounds
        (lambda p: 3.0, 0.4, 0.8, True, False),  # reacts nowhere
        (lambda p: np.cos(4 * np.pi * p) + p, -0.8, 0.75, True, True),  # a local minimum
        (lambda p: p**2, 0.25, 0.5, False, False),  # the minimum
        (lambda p: p**2 + p, -1.0, 0.0, True, False),  # a bad fit that is the best one
    ],
)
def test_a_search_is_stuck_where_other_values_fit_better(values, measured, start, unexplained, stuck):
    ends = (np.zeros(1), np.ones(1), np.array([start]), np.array([False]))
    search = Search(
        Toy(values), Box(Paths.each(("p",)), *ends), np.array([measured]), np.ones(1), "linear", 1.0, "trf", 50, 1
    )
    search.run()
    z = search.best[1]
    silent = search.silent(z)
    found = _elsewhere(search, z, silent, unexplained)
    assert (found is not None) == stuck
    if found is not None:
        assert set(found.silent) == ({"p"} if silent[0] else set())
        assert values(found.values["p"]) != values(float(z[0]))


def test_correlations_with_a_fixed_number_are_those_of_a_fit_of_both():
    rng = np.random.default_rng(1)
    A, j, r = rng.standard_normal((30, 3)), rng.standard_normal(30), rng.standard_normal(30)
    j = A @ [2.0, -1.0, 0.01] + 0.05 * j
    got = confound(A, j, r, 1e-12)
    whole = np.linalg.inv(np.c_[A, j].T @ np.c_[A, j])
    np.testing.assert_allclose(got.correlation, whole[:3, 3] / np.sqrt(np.diag(whole)[:3] * whole[3, 3]), rtol=1e-9)
    np.testing.assert_allclose(got.variance, np.diag(np.linalg.inv(A.T @ A)), rtol=1e-9)
    fits = [np.linalg.lstsq(A, b, rcond=None)[0] for b in (r, r - j)]
    np.testing.assert_allclose(got.shift, fits[1] - fits[0], rtol=1e-9)
    left = [np.linalg.lstsq(B, r, rcond=None)[1][0] for B in (A, np.c_[A, j])]
    assert got.gain == pytest.approx(left[0] - left[1], rel=1e-9)
    same = confound(A, A @ [1.0, 0.0, 0.0], r, 1e-9)  # free, it could be anything
    np.testing.assert_allclose(same.correlation, [-1.0, 0.0, 0.0], atol=1e-6)
    assert same.gain == 0.0


@pytest.mark.slow
def test_a_wrong_fixed_number_that_acts_alike_is_in_the_headline():
    """Speeds of a short time long after the start determine ω_0 given T_0, and hardly both."""
    ts = np.linspace(0.55, 0.6, 30)
    data = sb.studies.Measured.of(ts, {"omega": 20.0 - rate(8e3) * ts}, sigma={"omega": 0.01})
    wrong = 8.4e3
    fit = sb.calibrate(rigid(T0=wrong), {OMEGA: (5.0, 60.0)}, data)
    assert fit.outcome == Outcome.CONVERGED
    assert abs(fit[OMEGA].value - 20.0) > 100 * fit[OMEGA].standard_error  # confident, and wrong
    (one,) = [one for one in fit.fixed if one.path == T0]
    cov = np.linalg.inv(np.stack([np.ones_like(ts), -ts]) @ np.stack([np.ones_like(ts), -ts], axis=1))
    assert one.correlation == pytest.approx(cov[0, 1] / np.sqrt(cov[0, 0] * cov[1, 1]), abs=1e-6)
    assert 0.9999 > one.correlation > 0.99
    assert one.shift == pytest.approx(rate(wrong) * ts.mean() / fit[OMEGA].value, rel=1e-5)
    assert (1 - one.shift * 0.4 / 8.4) * fit[OMEGA].value == pytest.approx(20.0, rel=1e-6)  # corrected by it
    assert one.parameter == OMEGA
    assert T0 in fit.headline or len(fit.fixed) > 3
    assert any("independently" in text for text in fit.advice)
    assert fit.as_dict()["fixed"][0]["parameter"] == OMEGA
    # speeds from the start on tell the two apart: -0.87
    fit = sb.calibrate(rigid(T0=wrong), {OMEGA: (5.0, 60.0)}, speeds(20.0 - rate(8e3) * TS, 0.01))
    assert fit.fixed == ()
    assert "does not explain the data" in fit.headline
    free = [text for text in fit.advice if text.startswith("free ")]
    assert len(free) == 1
    assert free[0].endswith(" to 0") or float(free[0].split()[-1]) < 1e-3 * fit.chi2


# --- bounds, events that do not occur, interruption -----------------------------------------------------------------


def test_a_bound_that_holds_the_fit_is_said():
    values = line(noise=np.random.default_rng(0))
    fit = sb.calibrate(rigid(), LINE | {T0: (2e3, 7e3)}, speeds(values), start=START)
    assert fit[T0].state == State.AT_HIGH
    assert fit[T0].value == 7e3
    assert np.isnan(fit[T0].standard_error)
    assert any("at an active bound" in text for text in fit.warnings)
    best = np.mean(values + rate(7e3) * TS)  # the other one, given this
    assert fit[OMEGA].value == pytest.approx(best, rel=1e-8)
    assert fit[OMEGA].standard_error == pytest.approx(SIGMA / np.sqrt(TS.size), rel=1e-6)
    assert fit.as_dict()["parameters"][1]["state"] == "at_upper_bound"


def test_events_that_the_model_does_not_have():
    data = sb.studies.Measured.of(events={"stopping_time": (0.5, 0.01)})
    bounds, weak = {F: (0.01, 0.6)}, {F: 0.011}
    with pytest.raises(sb.InputError, match="stopping_time does not occur"):
        sb.calibrate(rigid(end=2.0), bounds, data, start=weak)
    fit = sb.calibrate(rigid(end=2.0), bounds, data, start=weak, starts=3)
    assert float(sb.simulate(fit.scene).stopping_time) == pytest.approx(0.5, rel=1e-7)
    assert fit.failures["stopping_time does not occur in the model"] >= 1
    assert fit.as_dict()["chi2_start"] is None
    late = sb.calibrate(rigid(end=2.0), bounds, sb.studies.Measured.of(events={"stopping_time": (3.0, 0.01)}))
    assert (late.outcome, late.converged) == (Outcome.NOT_CONVERGED, False)
    assert "stopping_time does not occur" in late.message
    assert np.isfinite(late[F].value)


def test_interruption_keeps_the_best_point(monkeypatch):
    look, calls = Search.look, []

    def interrupted(self, z):
        calls.append(z)
        if len(calls) > 3:
            monkeypatch.setattr(Search, "look", look)
            raise KeyboardInterrupt
        return look(self, z)

    monkeypatch.setattr(Search, "look", interrupted)
    fit = sb.calibrate(rigid(), LINE, speeds(line()), start=START)
    assert not fit.converged
    assert "interrupted" in fit.message
    assert fit.chi2 <= fit.chi2_start


def test_what_is_wrong_with_a_fit_is_told_at_once():
    bad = {F: (0.5, 0.4), "brake.pulley.mass": (1.0, 2.0), J: (-5.0, 900.0), T0: (2e3, 6e3), OMEGA: (1.0, np.inf)}
    with pytest.raises(sb.InputError) as caught:
        sb.calibrate(rigid(), bad, speeds(line()), loss="square", start={"end_time": 3.0}, confidence=1.0)
    text = str(caught.value)
    for words in (F, "brake.pulley.mass", "-5 kg*m^2", "start 8000", OMEGA, "'square'", "end_time", "confidence"):
        assert words in text
    data = speeds(line(), None) + sb.studies.Measured.of(events={"stopping_time": 1.0})
    with pytest.raises(sb.InputError, match="2 input errors"):
        sb.calibrate(rigid(), LINE, data)
    with pytest.raises(sb.InputError, match="name the measured one"):
        sb.calibrate(rigid(), LINE, sb.studies.Measured.of(TS, {"tension": line()}, sigma={"tension": 1.0}))
    with pytest.raises(sb.InputError, match="end_time"):
        sb.calibrate(rigid(end=0.3), LINE, speeds(line()))


def test_traced_entries_of_arrays_can_be_set():
    def total(x):
        scene = sb.with_values(rigid(), {"brake.linings.angle[3]": x, "brake.linings.area": None})
        whole = sb.with_values(rigid(), {"brake.linings.angle": x})
        return jnp.sum(scene.brake.linings.angle) + jnp.sum(whole.brake.linings.angle)

    value, slope = jax.jit(jax.value_and_grad(total))(0.2)
    assert float(slope) == 21.0
    assert float(value) == pytest.approx(19 * np.radians(13.5) + 21 * 0.2)


# --- words ------------------------------------------------------------------------------------------------------------


def test_open_combinations_are_told_in_words():
    def said(change, spread=np.inf, relative=(True, True, True), rate=(1.0, 1.0, 1.0), others=()):
        one = Direction(np.array(change), 0.0, spread)
        return _combination(one, [one, *others], ["p", "q", "r"], np.array(rate), np.array(relative))

    assert said([0.0, 1.0, 0.0]).words == "q: no measured value depends on it"
    assert said([0.0, 1.0, 0.0], 0.5).words == (
        "q: its bounds determine it better than the data (standard error 0.5 of their range)"
    )
    assert said([0.0, 1.0, 0.004]).words == "q: its whole range has less effect than tiny changes of r"
    assert said([0.5, 1.0, -0.25]).words == "q +1 %, p +0.5 % and r -0.25 % together change no measured value"
    assert said([0.5, 1.0, -0.25], 2.0).words == (
        "q +1 %, p +0.5 % and r -0.25 % together change the measured values by less than their errors within the "
        "bounds (standard error 2 of their range)"
    )
    pair = said([0.5, -1.0, 0.0])
    assert pair.words.startswith("q +1 % and p -0.5 % together change no measured value; the data determine only ")
    assert pair.words.endswith("(q)·(p)^2")
    assert pair.relative == {"p": -0.5, "q": 1.0, "r": 0.0}
    absolute = said([0.5, 1.0, 0.0], relative=(True, False, True)).words
    assert absolute == "q +0.01 and p +0.5 % together change no measured value"
    assert said([1.0, 1.0, 0.0], rate=(2.0, 0.5, 1.0)).relative == {"p": 1.0, "q": 0.25, "r": 0.0}


def test_states_of_parameters_in_words():
    def said(state, value=3.0):
        return _words(Parameter("p", "N", value, 0.1, (2.0, 4.0), state, 3.5, 1.0, 5.0, False))

    open_ = "standard error infinite: not determined by the data"
    assert said(State.FITTED) == ""
    assert (said(State.AT_LOW), said(State.AT_HIGH)) == ("at its lower bound", "at its upper bound")
    assert [said(State.OPEN, value) for value in (3.0, 1.0, 5.0)] == [open_, *[f"{open_}, and it reached a bound"] * 2]


def test_standard_deviations_are_absolute_where_all_are_given():
    both = speeds(line()) + sb.studies.Measured.of(events={"stopping_time": (1.0, 0.1)})
    half = speeds(line()) + sb.studies.Measured.of(events={"stopping_time": 1.0})
    for data, wanted, absolute, faults in (
        (both, None, True, 0),
        (both, False, False, 0),
        (speeds(line(), None), None, False, 0),
        (speeds(line(), None), True, True, 1),
        (half, None, False, 1),
        (half, False, False, 1),
    ):
        found = Faults()
        assert _absoluteness(data, wanted, 2, found) is absolute
        assert len(found) == faults
    few = sb.studies.Measured.of([0.1, 0.2], {"omega": [2.0, 1.0]})
    for parameters, words in ((1, []), (2, ["data: 2 values do not determine their scatter with 2 parameters"])):
        found = Faults()
        _absoluteness(few, None, parameters, found)
        assert [str(one).partition(" — ")[0] for one in found] == words


def test_losses_are_the_slopes_and_curvatures_of_their_objectives():
    z, h = np.array([0.3, 0.7, 1.6, 5.0]), 1e-4
    for name, (first, second) in ((name, law(z)) for name, law in _LOSSES.items()):
        rho = _RHO[name]
        np.testing.assert_allclose(first, (rho(z + h) - rho(z - h)) / (2 * h), rtol=1e-7)
        np.testing.assert_allclose(second, (rho(z + h) - 2 * rho(z) + rho(z - h)) / h**2, atol=2e-7)
        assert cost(np.array([1e-6]), name, 2.0) == pytest.approx(0.5e-12, rel=1e-6)  # near 0 all are squares
