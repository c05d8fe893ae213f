"""One fit to many recordings: shared parameters, those of each recording, numbers that
are known of each."""

import numpy as np
import pytest
from fit_scenes import OMEGA, SIGMA, T0, F, J, rate, rigid
from helpers import all_equal, all_near, input_error, near, paths_of
from scenes import GAIN, PI, closed_form
from scipy.stats import norm

import simbrake as sb
from simbrake.studies import Outcome, State

INERTIAS = {"first": 800.0, "second": 1000.0, "third": 1300.0}
SPEEDS = {"first": 20.0, "second": 23.0, "third": 18.0}
TIMES = {
    "first": np.linspace(0.02, 0.6, 30),
    "second": np.linspace(0.1, 0.5, 11),
    "third": np.array([0.05, 0.4]),
}
EACH = {OMEGA: (5.0, 60.0)}


def deceleration(inertia):
    """rad/s² per newton of slack tension."""
    return rate() * 800.0 / inertia


def stops(seed=0, **more):
    noise = np.random.default_rng(seed)
    return {
        name: sb.studies.Measured.of(
            t,
            {
                "omega": SPEEDS[name]
                - deceleration(inertia) * 8e3 * t
                + SIGMA * noise.standard_normal(t.size)
            },
            sigma={"omega": SIGMA},
            known={J: inertia, **more},
        )
        for (name, inertia), t in zip(INERTIAS.items(), TIMES.values(), strict=True)
    }


def joint(data):
    """Least squares of T_0 and the three initial speeds: best values and covariance."""
    rows = []
    values = []
    for i, (name, inertia) in enumerate(INERTIAS.items()):
        own = np.zeros((TIMES[name].size, 3))
        own[:, i] = 1.0
        rows.append(np.column_stack([-deceleration(inertia) * TIMES[name], own]))
        values.append(data[name].points[0].value)
    X = np.concatenate(rows)
    return np.linalg.lstsq(X, np.concatenate(values), rcond=None)[
        0
    ], SIGMA**2 * np.linalg.inv(X.T @ X)


def test_shared_and_own_parameters_are_the_joint_least_squares():
    data = stops()
    start = {f"{OMEGA}@third": 30.0}
    fit = sb.calibrate(
        rigid(), {T0: (2e3, 3e4)}, data, per_recording=EACH, start=start, profile=True
    )
    best, covariance = joint(data)
    assert list(fit.values) == [T0, *(f"{OMEGA}@{name}" for name in INERTIAS)]
    all_near(list(fit.values.values()), best, 1e-9)
    all_near(fit.covariance, covariance, 1e-7, 1e-12)
    assert (fit.outcome, fit.freedom) == (Outcome.CONVERGED, 43 - 4)
    assert fit[f"{OMEGA}@third"].start == 30.0
    half = norm.ppf(0.975) * np.sqrt(covariance[0, 0])
    all_near(fit[T0].interval, best[0] + half * np.array([-1, 1]), 1e-7)
    all_near(fit[T0].profile, fit[T0].interval, 1e-7)  # linear
    assert fit[f"{OMEGA}@first"].profile is None
    assert [part.name for part in fit.residuals] == [
        f"omega@{name}" for name in INERTIAS
    ]
    third = fit.recordings[2]
    assert float(third.scene.brake.pulley.inertia) == 1300.0
    assert float(third.scene.initial.omega) == fit[f"{OMEGA}@third"].value
    assert float(fit.scene.duty.slack_tension.level) == fit[T0].value
    assert float(fit.scene.brake.pulley.inertia) == 800.0  # of no recording
    assert fit.as_dict()["parameters"][3]["path"] == f"{OMEGA}@third"


@pytest.mark.slow
def test_one_recording_of_many_is_a_fit_as_ever():
    data = stops()["second"]
    alone = sb.calibrate(rigid(), {T0: (2e3, 3e4), **EACH}, data)
    listed = sb.calibrate(rigid(), {T0: (2e3, 3e4)}, [data], per_recording=EACH)
    assert list(listed.values) == [T0, f"{OMEGA}@1"]
    all_equal(list(listed.values.values()), list(alone.values.values()))
    all_equal(listed.covariance, alone.covariance)
    assert float(alone.scene.brake.pulley.inertia) == 1000.0


@pytest.mark.slow
def test_direction_that_no_recording_determines_is_named():
    """Of T_0 and f only the product with the tension ratio enters; initial speeds are
    determined."""
    fit = sb.calibrate(
        rigid(), {T0: (2e3, 3e4), F: (0.2, 0.6)}, stops(), per_recording=EACH
    )
    assert fit.outcome == Outcome.NOT_DETERMINED
    assert [p.state for p in fit.parameters] == [
        State.OPEN,
        State.OPEN,
        *[State.FITTED] * 3,
    ]
    (direction,) = fit.open
    assert {path for path, share in direction.items() if abs(share) > 1e-6} == {T0, F}
    # without a known inertia of each, a scale of all forces and inertias is open as
    # well
    free = {name: sb.studies.Measured(data.points) for name, data in stops().items()}
    fit = sb.calibrate(
        rigid(), {T0: (2e3, 3e4)}, free, per_recording={**EACH, J: (300.0, 5e3)}
    )
    assert fit.outcome == Outcome.NOT_DETERMINED


@pytest.mark.slow
def test_fixed_numbers_of_all_recordings_are_named():
    """An error in all inertias at once is one in T_0, whose standard error takes them
    as exact."""
    fit = sb.calibrate(rigid(), {T0: (2e3, 3e4)}, stops(), per_recording=EACH)
    (inertia,) = [one for one in fit.fixed if one.path == J]
    assert inertia.value == 1300.0
    assert inertia.parameter == T0
    near(inertia.shift, 1.0, 1e-5)


def test_errors_name_the_recording():
    data = stops()
    data["second"] = sb.studies.Measured(
        data["second"].points, known={J: -1.0, "end_time": 0.3, "brake.mass": 1.0}
    )
    bounds = {T0: (2e3, 3e4), J: (1.0, 1e4)}
    start = {f"{OMEGA}@4": 22.0}
    paths = set(
        paths_of(sb.calibrate, rigid(), bounds, data, per_recording=EACH, start=start)
    )
    assert paths >= {"brake.mass@second", f"{J}@second", f"{OMEGA}@4"}
    data["second"] = sb.studies.Measured(data["second"].points, known={"end_time": 0.3})
    for given in (data, []):
        with input_error():
            sb.calibrate(rigid(), {T0: (2e3, 3e4)}, given)


# --- profiles -----------------------------------------------------------------------


@pytest.mark.slow
def test_profile_of_a_curved_model():
    """One stopping time t = J ω/(R T_0 (Π(f) − 1)) of σ: the ends are where the time is
    off by 1.96 σ."""
    time = lambda T: 800.0 * 20.0 / (GAIN * T)
    sigma = 0.2 * time(8e3)
    quantile = norm.ppf(0.975)
    data = sb.studies.Measured.of(events={"stopping_time": (time(8e3), sigma)})
    scene = sb.with_values(rigid(end=20.0), {OMEGA: 20.0, T0: 7e3})
    fit = sb.calibrate(scene, {T0: (2e3, 3e4)}, data, profile=True)
    exact = [8e3 / (1 + side * 0.2 * quantile) for side in (1, -1)]
    all_near(fit[T0].profile, exact, 1e-6)
    assert fit[T0].interval[1] - fit[T0].interval[0] < exact[1] - exact[0]
    # a bound nearer than that end
    fit = sb.calibrate(scene, {T0: (2e3, 1.2e4)}, data, profile=True)
    near(fit[T0].profile[0], exact[0], 1e-6)
    assert fit[T0].profile[1] == np.inf
    # with a friction that is not known better either, T_0 is open, and f is limited by
    # the bound of T_0
    both = sb.calibrate(scene, {T0: (6e3, 1e4), F: (0.3, 0.5)}, data, profile=True)
    assert both[T0].profile == (-np.inf, np.inf)
    highest = closed_form(f=both[F].profile[1])["Pi"] - 1
    near(highest * 6e3, (PI - 1) * exact[1], 1e-6)
    with input_error(match="profile: is not known of the loss huber"):
        sb.calibrate(scene, {T0: (6e3, 1e4)}, data, profile=True, loss="huber")
