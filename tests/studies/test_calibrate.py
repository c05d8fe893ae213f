"""Calibration: planted parameters come back within their own error bars, and what data
leave open is named."""

import numpy as np
import pytest
from fit_scenes import (
    ELASTIC,
    LINE,
    OMEGA,
    SIGMA,
    START,
    T0,
    TS,
    F,
    J,
    elastic_data,
    line,
    rate,
    rigid,
    speeds,
)
from goldens import assert_refused
from heat_scenes import fading, lump, rigid_stop
from helpers import all_near, input_error, near, nothing_compiled
from scenes import stop_scene
from scipy.stats import chi2, norm, t

import simbrake as sb
from simbrake.studies import Outcome, State

# --- errors --------------------------------------------------------------------------


@pytest.mark.slow
def test_linear_covariance_is_the_closed_one():
    fit = sb.calibrate(
        rigid(), LINE, speeds(line(noise=np.random.default_rng(0))), start=START
    )
    X = np.stack([np.ones_like(TS), -rate() * TS], axis=1)
    cov = SIGMA**2 * np.linalg.inv(X.T @ X)
    best = np.linalg.lstsq(X, line(noise=np.random.default_rng(0)), rcond=None)[0]
    all_near([fit[OMEGA].value, fit[T0].value], best, 1e-9)
    all_near(fit.covariance, cov, 1e-7)
    all_near(fit.correlation[0, 1], cov[0, 1] / np.sqrt(cov[0, 0] * cov[1, 1]), 1e-7)
    half = norm.ppf(0.975) * np.sqrt(np.diag(cov))
    all_near(fit[T0].interval, best[1] + half[1] * np.array([-1, 1]), 1e-7)
    assert fit.freedom == TS.size - 2
    near(fit.probability, chi2.sf(fit.chi2, fit.freedom))
    assert fit.converged
    assert fit.outcome == Outcome.CONVERGED
    assert fit.open == ()
    assert float(fit.scene.initial.omega) == fit[OMEGA].value
    spans = np.array([55.0, 28e3])
    all_near(
        fit.singular_values, np.linalg.svd(X * spans / SIGMA, compute_uv=False), 1e-7
    )


@pytest.mark.slow
def test_errors_without_standard_deviations(caplog):
    values = line(noise=np.random.default_rng(3))
    fit = sb.calibrate(rigid(), LINE, speeds(values, None), start=START)
    X = np.stack([np.ones_like(TS), -rate() * TS], axis=1)
    r = values - X @ np.linalg.lstsq(X, values, rcond=None)[0]
    cov = r @ r / (TS.size - 2) * np.linalg.inv(X.T @ X)
    all_near(fit.covariance, cov, 1e-7)
    low, high = fit[OMEGA].interval
    near((high - low) / 2, t.ppf(0.975, TS.size - 2) * np.sqrt(cov[0, 0]), 1e-7)
    assert fit.probability is None
    assert not fit.absolute
    near(np.mean(fit.residuals[0].scaled ** 2), 1 - 2 / TS.size)
    with nothing_compiled(caplog):
        weights = sb.calibrate(
            rigid(), LINE, speeds(values, 7.0), start=START, absolute=False
        )
    all_near(weights.covariance, cov, 1e-6)


@pytest.mark.slow
def test_undetermined_product_is_named():
    """ω = ω_0 − R_b T_0 (Π − 1)/J t: of T_0 and J only the ratio is determined, and f
    enters the same product."""
    bounds = {OMEGA: (5.0, 60.0), T0: (2e3, 3e4), J: (200.0, 5e3)}
    fit = sb.calibrate(
        rigid(), bounds, speeds(line(noise=np.random.default_rng(0))), start=START
    )
    assert [p.state for p in fit.parameters] == [State.FITTED, State.OPEN, State.OPEN]
    assert np.isinf(fit[T0].standard_error)
    assert np.isinf(fit[J].standard_error)
    assert fit.outcome == Outcome.NOT_DETERMINED
    assert fit.open == (pytest.approx({OMEGA: 0.0, T0: 1.0, J: 1.0}, abs=1e-6),)
    X = np.stack([np.ones_like(TS), TS], axis=1)
    best = np.linalg.lstsq(X, line(noise=np.random.default_rng(0)), rcond=None)[0]
    cov = np.linalg.inv(X.T @ X)
    near(fit[OMEGA].standard_error, SIGMA * np.sqrt(cov[0, 0]), 1e-6)
    near(fit[T0].value / fit[J].value, -best[1] / (rate() * 800.0), 1e-9)
    assert fit.singular_values[2] < 1e-9 * fit.singular_values[0]
    assert fit.as_dict()["parameters"][1]["standard_error"] is None


@pytest.mark.slow
def test_a_robust_loss_shrugs_off_outliers():
    values = line(noise=np.random.default_rng(2))
    values[[4, 11, 25]] += 20.0
    plain = sb.calibrate(rigid(), LINE, speeds(values), start=START)
    robust = sb.calibrate(rigid(), LINE, speeds(values), start=START, loss="cauchy")
    assert abs(robust[T0].value - 8e3) < 3 * robust[T0].standard_error
    assert abs(plain[T0].value - 8e3) > 3 * plain[T0].standard_error
    assert plain.probability < 1e-6


# --- recovery and derivatives -------------------------------------------------------


@pytest.fixture(scope="module")
def elastic():
    return elastic_data()


@pytest.mark.slow
def test_planted_parameters_come_back(elastic):
    fit = sb.calibrate(stop_scene(), ELASTIC, elastic, rtol=1e-11)
    all_near(list(fit.values.values()), [0.31, 1.5e5, 900.0], 1e-8)
    assert [p.logarithmic for p in fit.parameters] == [False, True, False]
    assert fit.chi2 < 1e-8
    low, high = fit["brake.band.stiffness"].interval
    near(low * high, 1.5e5**2, 1e-6)  # symmetric in its logarithm


@pytest.mark.slow
def test_fade_and_heat_capacity_come_back():
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
    all_near(list(fit.values.values()), planted, 1e-8)
    assert "Dopri8" in fit.solver


# --- what a fit has not learned -----------------------------------------------------

# N: the brake holds the load of `held` from the first one on
HOLDS = 280.0
TRUTH = 224.85
LATER = np.linspace(0.1, 2.0, 20)


def held(T):
    """A load that hangs on the brake: from rest it accelerates at
    `(M − R T_0 (Π − 1))/J`, or is held."""
    return rigid(T0=T, w0=0.0, load=rate(HOLDS) * 800.0)


def lowering(T, noise):
    exact = max(rate(HOLDS) - rate(T), 0.0) * LATER
    values = exact + 0.01 * np.random.default_rng(noise).standard_normal(LATER.size)
    return sb.studies.Measured.of(LATER, {"omega": values}, sigma={"omega": 0.01})


@pytest.mark.slow
def test_start_that_holds_the_load_determines_nothing():
    bounds = {T0: (100.0, 400.0)}
    fit = sb.calibrate(held(300.0), bounds, lowering(TRUTH, 0))
    assert fit.outcome == Outcome.NOT_DETERMINED
    near(fit.chi2, fit.chi2_start, 1e-12)
    out = sb.calibrate(held(300.0), bounds, lowering(TRUTH, 0), starts=6)
    assert out.outcome == Outcome.CONVERGED
    assert abs(out[T0].value - TRUTH) < 3 * out[T0].standard_error
    # a load that is held indeed: every force that holds it explains the data
    still = sb.calibrate(held(300.0), bounds, lowering(300.0, 1))
    assert still.outcome == Outcome.NOT_DETERMINED


# --- bounds, events that do not occur, interruption ---------------------------------


@pytest.mark.slow
def test_a_bound_that_holds_the_fit_is_said():
    values = line(noise=np.random.default_rng(0))
    texts = START | {T0: f"{START[T0] / 1e3!r} kN"}
    fit = sb.calibrate(
        rigid(), LINE | {T0: ("2 kN", "7 kN")}, speeds(values), start=texts
    )
    assert fit[T0].state == State.AT_HIGH
    assert fit[T0].value == 7e3
    assert np.isnan(fit[T0].standard_error)
    best = np.mean(values + rate(7e3) * TS)  # the other one, given this
    near(fit[OMEGA].value, best, 1e-8)
    near(fit[OMEGA].standard_error, SIGMA / np.sqrt(TS.size), 1e-6)
    assert fit.as_dict()["parameters"][1]["state"] == "at_upper_bound"


@pytest.mark.slow
def test_events_that_the_model_does_not_have():
    data = sb.studies.Measured.of(events={"stopping_time": (0.5, 0.01)})
    bounds = {F: (0.01, 0.6)}
    weak = {F: 0.011}
    with input_error(match="stopping_time does not occur"):
        sb.calibrate(rigid(end=2.0), bounds, data, start=weak)
    fit = sb.calibrate(rigid(end=2.0), bounds, data, start=weak, starts=3)
    near(sb.simulate(fit.scene).stopping_time, 0.5, 1e-7)
    assert fit.failures["stopping_time does not occur in the model"] >= 1
    assert fit.as_dict()["chi2_start"] is None
    late = sb.calibrate(
        rigid(end=2.0),
        bounds,
        sb.studies.Measured.of(events={"stopping_time": (3.0, 0.01)}),
    )
    assert (late.outcome, late.converged) == (Outcome.NOT_CONVERGED, False)
    assert np.isfinite(late[F].value)


def test_all_errors_of_a_fit_come_at_once(request):
    bad = {F: (0.5, 0.4), "brake.pulley.mass": (1.0, 2.0), J: (-5.0, 900.0)}
    bad |= {T0: (2e3, 6e3), OMEGA: (1.0, np.inf)}
    options = {"loss": "square", "start": {"end_time": 3.0}, "confidence": 1.0}
    tension = sb.studies.Measured.of(TS, {"tension": line()}, sigma={"tension": 1.0})
    twice = {"brake.linings.angle[3]": (0.2, 0.3), "brake.linings.angle": (0.2, 0.3)}
    cases = (
        lambda: sb.calibrate(rigid(), bad, speeds(line()), **options),
        lambda: sb.calibrate(rigid(), LINE, tension),
        lambda: sb.calibrate(rigid(end=0.3), LINE, speeds(line())),
        lambda: sb.calibrate(rigid(), twice, speeds(line())),
    )
    assert_refused(request, "fits", cases)
