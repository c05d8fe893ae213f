"""Uncertain numbers: samples with known moments, intervals that cover.

The stopping time of a rigid band under a constant lever, `ω_0 J/(R T_0 (Π − 1))`, is
lognormal where speed, inertia and slack tension are: mean, deviation, quantiles and
failure probability all have closed forms.
"""

import json
import math

import numpy as np
import pytest
from helpers import faults_of, near, paths_of
from scenes import GAIN, stop_scene
from scipy import stats
from scipy.special import ndtr, ndtri

import simbrake as sb

SPREAD = {
    "initial.omega": 0.10,
    "brake.pulley.inertia": 0.20,
    "duty.slack_tension.level": 0.30,
}
MEDIAN = {
    "initial.omega": 20.0,
    "brake.pulley.inertia": 800.0,
    "duty.slack_tension.level": 8e3,
}
S = math.sqrt(sum(s**2 for s in SPREAD.values()))
TYPICAL = 20.0 * 800.0 / (8e3 * GAIN)


def brake(end=6.0):
    return stop_scene(C=None, end=end)


def lognormals():
    return {path: stats.lognorm(s, scale=MEDIAN[path]) for path, s in SPREAD.items()}


def covered(estimate, truth):
    return estimate.low <= truth <= estimate.high


# --- samples ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("method", "close"), [("sobol", 2e-3), ("latin", 2e-2), ("random", 0.2)]
)
def test_samples_have_the_right_moments(method, close):
    given = {
        "brake.linings.friction.coefficient": (0.3, 0.4),
        "brake.linings.angle[3]": stats.truncnorm(-2, 2, 0.25, 0.02),
        "initial.omega": stats.norm(20, 3),
    }
    found = sb.studies.samples(brake(), given, 1024, seed=3, method=method)
    for path, one in (
        given | {"brake.linings.friction.coefficient": stats.uniform(0.3, 0.1)}
    ).items():
        x = found[path]
        assert x.shape == (1024,)
        assert abs(x.mean() - one.mean()) < close * one.std()
        near(x.std(), one.std(), 5 * close)
    again = sb.studies.samples(brake(), given, 1024, seed=3, method=method)
    assert all(np.array_equal(found[path], again[path]) for path in given)
    assert not np.array_equal(
        sb.studies.samples(brake(), given, 1024, seed=4, method=method)[
            "initial.omega"
        ],
        x,
    )


def test_any_number_of_sobol_samples():
    given = {"initial.omega": (10.0, 20.0)}
    whole = sb.studies.samples(brake(), given, 128)["initial.omega"]
    assert np.array_equal(
        sb.studies.samples(brake(), given, 100)["initial.omega"], whole[:100]
    )


def test_ranges_with_units():
    given = sb.studies.samples(brake(), {"initial.omega": ("120 rpm", "240 rpm")}, 16)
    assert np.array_equal(
        given["initial.omega"],
        sb.studies.samples(brake(), {"initial.omega": (4 * np.pi, 8 * np.pi)}, 16)[
            "initial.omega"
        ],
    )
    wrong = {"initial.omega": ("120 rpm", "2 m"), "initial.omeg": ("1 rpm", "2 rpm")}
    assert paths_of(sb.studies.samples, brake(), wrong, 16) == [*wrong]


def test_all_input_errors_in_one_report():
    given = {
        "brake.linings.friction.coefficient": stats.norm(0.35, 0.1),
        "brake.pulley.inertia": stats.uniform(-1, 4),
        "brake.linings.angle": (0.2, 0.1),
        "brake.linings.angle[2]": (0.1, 0.2),
        "brake.linings.angle[20]": (0.1, 0.2),
        "brake.band.radios": (0.1, 0.2),
        "initial.omega": "about 20",
    }
    faults = faults_of(
        sb.uncertainty,
        brake(),
        given,
        ["stoping_time"],
        0,
        quantiles=[1.5],
        confidence=95.0,
        limits={"max_tension": "high"},
    )
    assert len(faults) == 14


def test_stop_statistics_match_closed_forms():
    limit = TYPICAL * math.exp(S * ndtri(0.97))
    found = sb.uncertainty(
        brake(),
        lognormals(),
        n=1024,
        limits={"stopping_time": limit},
        quantiles=(0.05, 0.5, 0.9),
    )
    s = found.statistics["stopping_time"]
    mean = TYPICAL * math.exp(S**2 / 2)
    deviation = mean * math.sqrt(math.expm1(S**2))
    assert s.count == found.runs == 1024
    near(s.mean.value, mean, 2e-3)
    near(s.deviation.value, deviation, 3e-2)
    assert covered(s.mean, mean)
    assert covered(s.deviation, deviation)
    for p, estimate in s.quantiles.items():
        truth = TYPICAL * math.exp(S * ndtri(p))
        near(estimate.value, truth, 1e-2)
        assert covered(estimate, truth)
    (late,) = (
        f for name, f in found.failures.items() if name.startswith("stopping_time > ")
    )
    near(late.probability.value, 0.03, abs=5e-3)
    assert covered(late.probability, 0.03)
    assert found.failures["does not stop"].count == 0
    told = json.loads(found.json())
    assert told["metrics"]["stopping_time"]["mean"]["value"] == s.mean.value
    for path, given in told["inputs"].items():
        drawn = {
            p: MEDIAN[path] * math.exp(SPREAD[path] * ndtri(float(p)))
            for p in ("0.05", "0.5", "0.95")
        }
        near(given["quantiles"], drawn, 1e-9)


def test_runs_that_do_not_stop_are_counted():
    end = TYPICAL * math.exp(S * ndtri(0.8))
    found = sb.uncertainty(brake(end), lognormals(), n=512, confidence=0.999)
    s = found.statistics["stopping_time"]
    assert covered(found.failures["does not stop"].probability, 0.2)
    assert s.count == found.runs - found.failures["does not stop"].count
    # the mean of a lognormal that is cut at its 80 % quantile
    cut = TYPICAL * math.exp(S**2 / 2) * ndtr(ndtri(0.8) - S) / 0.8
    assert covered(s.mean, cut)
    assert covered(s.quantiles[0.5], TYPICAL * math.exp(S * ndtri(0.4)))


def test_limit_of_a_least_value():
    """A reserve `M_b/M` of loads even between 0.6 and 1.2 `M_b` is at least 1.25 up to
    a load of 0.8 `M_b`; loads above `M_b` are not held, and have none. A load held from
    the start has no stopping time, and does not fail to stop."""
    torque = 8e3 * GAIN
    loads = {"duty.load.profile.level": (0.6 * torque, 1.2 * torque)}
    scene = stop_scene(C=None, w0=0.0, end=0.1, load=0.8 * torque)
    metrics = ["min_holding_reserve", "stopping_time"]
    limits = {"min_holding_reserve": 1.25}
    found = sb.uncertainty(scene, loads, metrics, 256, limits=limits)
    assert covered(found.failures["does not stop"].probability, 1 / 3)
    weak = found.failures["min_holding_reserve < 1.25"]
    near(weak.probability.value, 2 / 3, abs=5e-3)
    (line,) = sb.plot.histogram(found, "min_holding_reserve").get_lines()
    assert line.get_xdata()[0] == 1.25


def test_interrupted_ensemble_is_no_sample():
    def stop(done, total):
        if done:
            raise KeyboardInterrupt

    with pytest.raises(sb.SimulationError, match="of 512 runs were not made"):
        sb.uncertainty(brake(), lognormals(), n=512, progress=stop, workers=1)


# --- statistics of given numbers ----------------------------------------------------


@pytest.mark.parametrize(
    "distribution",
    [
        (0.4, 0.3),
        (0.3, np.inf),
        stats.rv_continuous,
        stats.norm(0.35, -1.0),
        stats.norm([0.3, 0.4], 0.01),
        stats.norm(0.25, 0.25),
    ],
)
def test_wrong_distributions_are_reported(distribution):
    path = "brake.linings.friction.coefficient"
    assert paths_of(sb.studies.samples, brake(), {path: distribution}, 4) == [path]
