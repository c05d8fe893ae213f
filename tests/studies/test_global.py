"""Uncertain numbers: samples with known moments, intervals that cover, indices of functions and brakes that are known.

The stopping time of a rigid band under a constant lever, `ω_0 J/(R T_0 (Π − 1))`, is lognormal where speed, inertia and
slack tension are: mean, deviation, quantiles, failure probability and Sobol indices all have closed forms.
"""

import json
import math
import re
import sys

import numpy as np
import pytest
import xarray as xr
from scipy import stats
from scipy.special import ndtr, ndtri
from stop_scenes import closed_form, stop_scene

import simbrake as sb
from simbrake import plot
from simbrake.studies import _global, _uncertainty

SPREAD = {"initial.omega": 0.10, "brake.pulley.inertia": 0.20, "duty.slack_tension.level": 0.30}
MEDIAN = {"initial.omega": 20.0, "brake.pulley.inertia": 800.0, "duty.slack_tension.level": 8e3}
S = math.sqrt(sum(s**2 for s in SPREAD.values()))
TYPICAL = 20.0 * 800.0 / (0.725 * 8e3 * (closed_form()["Pi"] - 1))


def brake(end=6.0):
    return stop_scene(C=None, end=end)


def lognormals():
    return {path: stats.lognorm(s, scale=MEDIAN[path]) for path, s in SPREAD.items()}


def covered(estimate, truth):
    return estimate.low <= truth <= estimate.high


# --- samples ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("method", "close"), [("sobol", 2e-3), ("latin", 2e-2), ("random", 0.2)])
def test_samples_have_the_moments_of_their_distributions(method, close):
    given = {
        "brake.linings.friction.coefficient": (0.3, 0.4),
        "brake.linings.angle[3]": stats.truncnorm(-2, 2, 0.25, 0.02),
        "initial.omega": stats.norm(20, 3),
    }
    found = sb.studies.samples(brake(), given, 1024, seed=3, method=method)
    for path, one in (given | {"brake.linings.friction.coefficient": stats.uniform(0.3, 0.1)}).items():
        x = found[path]
        assert x.shape == (1024,)
        assert abs(x.mean() - one.mean()) < close * one.std()
        assert x.std() == pytest.approx(one.std(), rel=5 * close)
    again = sb.studies.samples(brake(), given, 1024, seed=3, method=method)
    assert all(np.array_equal(found[path], again[path]) for path in given)
    assert not np.array_equal(sb.studies.samples(brake(), given, 1024, seed=4, method=method)["initial.omega"], x)


def test_any_number_of_sobol_samples_is_the_head_of_the_next_power_of_two():
    given = {"initial.omega": (10.0, 20.0)}
    whole = sb.studies.samples(brake(), given, 128)["initial.omega"]
    assert np.array_equal(sb.studies.samples(brake(), given, 100)["initial.omega"], whole[:100])


def test_all_faults_of_the_input_in_one_report():
    given = {
        "brake.linings.friction.coefficient": stats.norm(0.35, 0.1),
        "brake.pulley.inertia": stats.uniform(-1, 4),
        "brake.linings.angle": (0.2, 0.1),
        "brake.linings.angle[2]": (0.1, 0.2),
        "brake.linings.angle[20]": (0.1, 0.2),
        "brake.band.radios": (0.1, 0.2),
        "initial.omega": "about 20",
    }
    with pytest.raises(sb.InputError) as caught:
        sb.uncertainty(
            brake(), given, ["stoping_time"], 0, quantiles=[1.5], confidence=95.0, limits={"max_tension": "high"}
        )
    text = str(caught.value)
    assert "with probability 0.00023" in text
    assert "scipy.stats.truncnorm(-3.5, 96.5, 0.35, 0.1)" in text
    for words in (
        "brake.pulley.inertia: is out of range with probability 0.25",
        "(0.2, 0.1) is not a range",
        "overlaps with brake.linings.angle",
        "there is no entry 20",
        "nearest: brake.band.radius",
        "str is not a distribution",
        "nearest: stopping_time",
        "n: 0 is not a number of samples",
        "quantiles: 1.5",
        "confidence: 95",
        "limits['max_tension']",
    ):
        assert words in text


# --- intervals --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("method", "n"), [("sobol", 512), ("latin", 512), ("random", 256)])
def test_intervals_cover_the_truth_as_often_as_they_say(method, n):
    d, repeats = 4, 250
    hits: dict[str, int] = {}
    for seed in range(repeats):
        unit, group = _uncertainty._points(n, d, method, 16, seed)
        y = stats.norm.ppf(np.clip(unit, 1e-9, 1 - 1e-9)).sum(axis=1)  # normal with the variance d
        mean, deviation = _uncertainty.mean_and_deviation(y, group, 0.95)
        pairs = {"mean": (mean, 0.0), "deviation": (deviation, math.sqrt(d))}
        for p in (0.05, 0.5):
            pairs[f"quantile {p}"] = _uncertainty.quantile(y, group, p, 0.95), math.sqrt(d) * ndtri(p)
        for p in (0.3, 0.01):
            pairs[f"probability {p}"] = _uncertainty.probability(y > -math.sqrt(d) * ndtri(p), group, 0.95), p
        for name, (estimate, truth) in pairs.items():
            hits[name] = hits.get(name, 0) + covered(estimate, truth)
    share = {name: count / repeats for name, count in hits.items()}
    # 95 % of 250 scatters by 1.4 %; where few hits come to a set the binomial interval covers more
    assert min(share.values()) > 0.905, share
    assert share["mean"] < 0.99, share


def test_few_runs_bound_what_they_can():
    group = np.arange(20)
    never = _uncertainty.probability(np.zeros(20, bool), group, 0.95)
    assert never.high == pytest.approx(1 - 0.025 ** (1 / 20), rel=1e-9)
    assert _uncertainty.quantile(np.arange(20.0), group, 0.99, 0.95).high == np.inf
    # order statistics of 20: the 6th and the 15th hold the median with 95.9 %
    middle = _uncertainty.quantile(np.arange(1.0, 21.0), group, 0.5, 0.95)
    assert (middle.low, middle.value, middle.high) == (6.0, 10.5, 15.0)


def test_statistics_of_a_stop_against_closed_forms():
    limit = TYPICAL * math.exp(S * ndtri(0.97))
    found = sb.uncertainty(brake(), lognormals(), n=1024, limits={"stopping_time": limit}, quantiles=(0.05, 0.5, 0.9))
    s = found.statistics["stopping_time"]
    mean = TYPICAL * math.exp(S**2 / 2)
    deviation = mean * math.sqrt(math.expm1(S**2))
    assert s.count == found.runs == 1024
    assert s.mean.value == pytest.approx(mean, rel=2e-3)
    assert s.deviation.value == pytest.approx(deviation, rel=3e-2)
    assert covered(s.mean, mean)
    assert covered(s.deviation, deviation)
    for p, estimate in s.quantiles.items():
        truth = TYPICAL * math.exp(S * ndtri(p))
        assert estimate.value == pytest.approx(truth, rel=1e-2)
        assert covered(estimate, truth)
    (late,) = (f for name, f in found.failures.items() if name.startswith("stopping_time > "))
    assert late.probability.value == pytest.approx(0.03, abs=5e-3)
    assert covered(late.probability, 0.03)
    assert found.failures["does not stop"].count == 0
    assert json.loads(found.json())["metrics"]["stopping_time"]["mean"]["value"] == s.mean.value
    assert "16 independent sets of 64" in str(found)
    for path, given in json.loads(found.json())["inputs"].items():
        drawn = {p: MEDIAN[path] * math.exp(SPREAD[path] * ndtri(float(p))) for p in ("0.05", "0.5", "0.95")}
        assert given["quantiles"] == pytest.approx(drawn, rel=1e-9)
    # the figure: shares of the runs, the cumulative share is that of the lognormal, quantiles lie at its inverse
    density, cumulative = plot.distribution(found, "stopping_time").axes
    assert cumulative.get_xlabel() == "stopping time, s"
    assert sum(bar.get_height() for bar in density.patches) == pytest.approx(100.0)
    x, share = cumulative.lines[0].get_data()
    np.testing.assert_allclose(share, 100 * np.arange(1, 1025) / 1024, rtol=1e-12)
    np.testing.assert_allclose(share, 100 * ndtr(np.log(x / TYPICAL) / S), atol=2.5)  # Kolmogorov: 4 % at random
    marks = np.concatenate([one.lines[0].get_xydata() for one in cumulative.containers])
    np.testing.assert_allclose(marks[:, 0], TYPICAL * np.exp(S * ndtri(marks[:, 1] / 100)), rtol=1e-2)
    assert len(marks) == len(s.quantiles)
    shown = re.findall(r"^ *([\d.]+) % +([\d.]+)", str(found), re.MULTILINE)
    for p, value in shown:
        assert float(value) == pytest.approx(TYPICAL * math.exp(S * ndtri(float(p) / 100)), rel=1e-2)
    assert len(shown) == len(s.quantiles)


def test_runs_that_do_not_stop_are_counted_and_the_rest_is_told_apart():
    end = TYPICAL * math.exp(S * ndtri(0.8))
    found = sb.uncertainty(brake(end), lognormals(), n=512, confidence=0.999)
    s = found.statistics["stopping_time"]
    assert covered(found.failures["does not stop"].probability, 0.2)
    assert s.count == found.runs - found.failures["does not stop"].count
    # the mean of a lognormal that is cut at its 80 % quantile
    cut = TYPICAL * math.exp(S**2 / 2) * ndtr(ndtri(0.8) - S) / 0.8
    assert covered(s.mean, cut)
    assert covered(s.quantiles[0.5], TYPICAL * math.exp(S * ndtri(0.4)))
    assert f"{s.count} of 512 runs" in str(found)
    with pytest.raises(sb.SimulationError, match=r"stopping_time does not exist in \d+ of 80 runs") as caught:
        sb.sobol_indices(brake(end), lognormals(), n=16)
    assert caught.value.result.sizes["run"] == 80  # pyright: ignore


def test_failed_runs_count_as_failures_and_have_no_metrics():
    import xarray as xr

    rng = np.random.default_rng(0)
    x = rng.uniform(1.0, 2.0, 200)
    code = np.where(np.arange(200) < 10, 1, 0)
    data = xr.Dataset({"stopping_time": ("run", np.where(np.arange(200) < 50, np.inf, x)), "code": ("run", code)})
    data["max_tension"] = "run", np.where(code == 1, np.nan, 1e3 * x)
    asked = ["stopping_time", "max_tension"]
    bounds = {"max_tension": 1.9e3}
    found = _uncertainty._evaluate(
        data, np.arange(200), asked, bounds, (0.5,), 0.95, "random", 0, {"x": ("1", 1.0, 1.5, 2.0)}
    )
    assert found.statistics["stopping_time"].count == 150
    assert found.statistics["max_tension"].count == 190
    assert found.statistics["max_tension"].mean.value == pytest.approx(1e3 * x[10:].mean())
    assert found.failures["does not stop"].count == 50
    passed = int(np.sum(x[10:] > 1.9)) + 10
    assert found.failures["max_tension > 1900 N"].count == passed
    assert found.failures["any of these"].count == int(np.sum((np.arange(200) < 50) | (x > 1.9)))
    assert found.codes == {"step_limit": 10}
    assert "10 runs failed (step_limit 10)" in str(found)


def test_an_interrupted_ensemble_is_no_sample():
    def stop(done, total):
        if done:
            raise KeyboardInterrupt

    with pytest.raises(sb.SimulationError, match="of 512 runs were not made"):
        sb.uncertainty(brake(), lognormals(), n=512, progress=stop, workers=1)


# --- indices ----------------------------------------------------------------------------------------------------------


def test_sobol_indices_of_the_ishigami_function():
    a, b = 7.0, 0.1
    x = np.pi * (2 * _global.sobol_design(4096, 3, True, seed=2) - 1)
    y = np.sin(x[:, 0]) + a * np.sin(x[:, 1]) ** 2 + b * x[:, 2] ** 4 * np.sin(x[:, 0])
    first = (1 + b * np.pi**4 / 5) ** 2 / 2, a**2 / 8, 0.0
    both = b**2 * np.pi**8 * (1 / 18 - 1 / 50)
    variance = sum(first) + both
    table = _global.sobol_table(["x", "y", "z"], y, True, name="Ishigami")
    truth = dict(zip("xyz", zip(first, (first[0] + both, first[1], both), strict=True), strict=True))
    assert [row.path for row in table.indices] == ["x", "y", "z"]
    for row in table.indices:
        for estimate, exact in zip((row.first, row.total), truth[row.path], strict=True):
            assert estimate.value == pytest.approx(exact / variance, abs=0.01)
            assert covered(estimate, exact / variance)
    assert table.pairs is not None
    assert table.pairs[0].paths == ("x", "z")
    assert table.pairs[0].second.value == pytest.approx(both / variance, abs=0.02)
    assert table.deviation == pytest.approx(math.sqrt(variance), rel=1e-2)
    assert "together x × z" in str(table)


def test_intervals_of_sobol_indices_cover_the_g_function():
    a = np.array([0.0, 1.0, 4.5])
    v = 1 / (3 * (1 + a) ** 2)
    variance = np.prod(1 + v) - 1
    first, total = v / variance, v * np.prod(1 + v) / (1 + v) / variance
    hits, repeats = np.zeros((2, 3)), 100
    for seed in range(repeats):
        u = _global.sobol_design(128, 3, False, seed)
        table = _global.sobol_table(
            ["0", "1", "2"], np.prod((abs(4 * u - 2) + a) / (1 + a), axis=1), resamples=200, seed=seed
        )
        for row in table.indices:
            i = int(row.path)
            hits[:, i] += covered(row.first, first[i]), covered(row.total, total[i])
    assert hits.min() >= 0.88 * repeats, hits


def test_sobol_indices_of_a_brake_against_closed_forms():
    found = sb.sobol_indices(brake(), lognormals(), n=512)
    table = found["stopping_time"]
    v = {path: math.expm1(s**2) for path, s in SPREAD.items()}
    whole = math.prod(1 + x for x in v.values())
    assert [row.path for row in table.indices] == sorted(SPREAD, key=lambda path: -SPREAD[path])
    for row in table.indices:
        x = v[row.path]
        assert row.first.value == pytest.approx(x / (whole - 1), abs=0.03)
        assert row.total.value == pytest.approx(x * whole / (1 + x) / (whole - 1), abs=0.03)
        assert covered(row.first, x / (whole - 1))
    assert table.unit == "s"
    assert table.mean == pytest.approx(TYPICAL * math.exp(S**2 / 2), rel=5e-3)
    assert found.runs == found.data.sizes["run"] == 512 * 5
    axes = plot.indices(table).axes[0]
    assert [label.get_text() for label in axes.get_yticklabels()] == [row.path for row in table.indices[::-1]]
    drawn = {round(bar.get_y() + 0.19, 6): bar.get_width() for bar in axes.patches}
    for i, row in enumerate(table.indices[::-1]):
        x = v[row.path]
        assert drawn[round(i - 0.2, 6)] == pytest.approx(x / (whole - 1), abs=0.03)
        assert drawn[round(i + 0.2, 6)] == pytest.approx(x * whole / (1 + x) / (whole - 1), abs=0.03)


@pytest.mark.parametrize("second_order", [False, True])
def test_mean_and_deviation_of_unmixed_runs(second_order):
    """Of a block of runs the first and the one that has none of its numbers; the others mix both."""
    found = sb.sobol_indices(brake(), lognormals(), n=8, second_order=second_order, resamples=2)
    d, y = len(SPREAD), found.data["stopping_time"].values
    inputs = np.stack([found.data[path].values for path in SPREAD], axis=1)
    size = 2 * d + 2 if second_order else d + 2
    unmixed = []
    for first in range(0, len(y), size):
        block = range(first, first + size)
        (other,) = (i for i in block if np.all(inputs[i] != inputs[first]))
        unmixed += [y[first], y[other]]
    table = found["stopping_time"]
    assert (table.mean, table.deviation) == pytest.approx((np.mean(unmixed), np.std(unmixed, ddof=1)), rel=1e-12)


def test_morris_effects_of_a_linear_function_are_its_coefficients():
    a = np.array([3.0, -2.0, 0.5, 0.0])
    x = _global.morris_design(10, 4, 6, seed=1)
    found = _global.morris_numbers(x, x @ a, 6, 0.95, 100, seed=1)
    np.testing.assert_allclose(found.mu, a, atol=1e-12)
    np.testing.assert_allclose(found.mu_star, abs(a), atol=1e-12)
    np.testing.assert_allclose(found.sigma, 0.0, atol=1e-12)


def test_morris_effects_of_a_brake():
    given = {"initial.omega": (16.0, 24.0), "brake.pulley.width": (0.2, 0.3), "brake.pulley.inertia": (790.0, 810.0)}
    scene = sb.with_values(brake(), {"brake.pulley.width": 0.23})
    found = sb.morris(scene, given, trajectories=8)
    speed, inertia, width = found["stopping_time"].effects
    assert (speed.path, inertia.path, width.path) == ("initial.omega", "brake.pulley.inertia", "brake.pulley.width")
    # linear in the speed, and a little in the inertia with it
    assert speed.mu == pytest.approx(8.0 / 20.0 * TYPICAL, rel=0.02)
    assert inertia.mu_star.value == pytest.approx(20.0 / 800.0 * TYPICAL, rel=0.1)  # at 8 speeds of 16…24
    assert inertia.sigma > 1e-6
    assert (width.mu, width.sigma) == (0.0, 0.0)
    assert found.runs == 8 * 4
    assert "16 … 24 rad/s" in str(found)
    # the mean effect is that of the mean other factor, its spread half the range of it
    axes = plot.effects(found["stopping_time"]).axes[0]
    assert axes.get_xlabel().endswith(", s")
    points = {one.get_label(): one.lines[0].get_xydata()[0] for one in axes.containers}
    assert points.keys() == set(given)
    assert points["initial.omega"][0] == pytest.approx(8.0 / 20.0 * TYPICAL, rel=0.02)
    assert points["initial.omega"][1] < 0.02 * points["initial.omega"][0]
    np.testing.assert_array_equal(points["brake.pulley.width"], 0.0)
    assert points["brake.pulley.inertia"][1] == pytest.approx(inertia.sigma, rel=1e-12)


def test_without_salib_the_error_names_the_command(monkeypatch):
    monkeypatch.setitem(sys.modules, "SALib.analyze", None)
    with pytest.raises(ModuleNotFoundError, match=r"pip install 'simbrake\[global\]'"):
        sb.morris(brake(), {"initial.omega": (16.0, 24.0)})


# --- statistics of given numbers --------------------------------------------------------------------------------------


def evaluated(columns, group, asked=("stopping_time",), bounds=None, shares=(0.5,), method="random"):
    """The statistics of runs whose numbers are given."""
    count = len(group)
    data = xr.Dataset({name: ("run", np.asarray(column)) for name, column in columns.items()})
    data["code"] = ("run", np.asarray(columns.get("code", np.zeros(count, int))))
    inputs = {"initial.omega": ("rad/s", 1.0, 2.0, 3.0), "brake.linings.friction.coefficient": ("1", 0.3, 0.35, 0.4)}
    return _uncertainty._evaluate(data, np.asarray(group), list(asked), bounds or {}, shares, 0.9, method, 7, inputs)


def test_statistics_of_few_numbers_by_hand():
    x = np.array([3.0, 1.0, 4.0, 2.0, 5.0, 9.0])
    one = evaluated({"stopping_time": x}, [0, 0, 1, 1, 2, 2]).statistics["stopping_time"]
    means = np.array([2.0, 3.0, 7.0])
    half = stats.t.ppf(0.95, 2) * means.std(ddof=1) / math.sqrt(3)
    assert one.mean == pytest.approx((4.0, 4.0 - half, 4.0 + half), rel=1e-12)
    assert (one.count, one.unit, one.least, one.greatest) == (6, "s", 1.0, 9.0)
    spread = [np.std(np.delete(x, [i, i + 1]), ddof=1) for i in (0, 2, 4)]
    pseudo = 3 * math.log(x.std(ddof=1)) - 2 * np.log(spread)
    factor = math.exp(stats.t.ppf(0.95, 2) * pseudo.std(ddof=1) / math.sqrt(3))
    deviation = x.std(ddof=1)
    assert one.deviation == pytest.approx((deviation, deviation / factor, deviation * factor), rel=1e-12)
    # each run by itself: order statistics; what 6 values do not bound is infinite
    single = evaluated({"stopping_time": x}, np.arange(6), shares=(0.5, 0.95)).statistics["stopping_time"]
    inside = [i for i in range(7) if covered(share(i, 6), 0.5)]
    ends = np.concatenate([[-np.inf], np.sort(x), [np.inf]])
    assert single.quantiles[0.5] == (3.5, ends[inside[0]], ends[inside[-1] + 1])
    assert single.quantiles[0.95].high == math.inf
    half = stats.t.ppf(0.95, 5) * x.std(ddof=1) / math.sqrt(6)
    assert single.mean == pytest.approx((4.0, 4.0 - half, 4.0 + half), rel=1e-12)
    same = evaluated({"stopping_time": np.full(6, 2.5)}, [0, 0, 1, 1, 2, 2]).statistics["stopping_time"]
    assert (same.mean, same.deviation) == ((2.5, 2.5, 2.5), (0.0, 0.0, 0.0))
    whole = evaluated({"stopping_time": x}, np.zeros(6)).statistics["stopping_time"]
    assert whole.mean.value == 4.0
    assert math.isnan(whole.mean.low)


def share(hits, runs, confidence=0.9):
    """Clopper and Pearson's interval of a share."""
    tail = (1 - confidence) / 2
    low = stats.beta.ppf(tail, hits, runs - hits + 1) if hits else 0.0
    return _uncertainty.Estimate(
        hits / runs, low, stats.beta.ppf(1 - tail, hits + 1, runs - hits) if hits < runs else 1.0
    )


def test_shares_of_groups_follow_their_scatter_where_hits_are_enough():
    hits = np.array([5, 6, 7, 6])  # of 10 in each of 4 groups
    hit = np.concatenate([np.arange(10) < k for k in hits])
    group = np.repeat(np.arange(4), 10)
    half = stats.t.ppf(0.95, 3) * (hits / 10).std(ddof=1) / 2
    assert _uncertainty.probability(hit, group, 0.9) == pytest.approx((0.6, 0.6 - half, 0.6 + half), rel=1e-12)
    assert _uncertainty.probability(~hit, group, 0.9) == pytest.approx((0.4, 0.4 - half, 0.4 + half), rel=1e-12)
    for few in (np.arange(40) < 3, np.arange(40) >= 3, np.zeros(40, bool), np.ones(40, bool)):
        assert _uncertainty.probability(few, group, 0.9) == pytest.approx(share(few.sum(), 40), rel=1e-12)
    assert _uncertainty.probability(hit, np.arange(40), 0.9) == pytest.approx(share(24, 40), rel=1e-12)
    assert _uncertainty.probability(hit, np.zeros(40), 0.9) == pytest.approx(share(24, 40), rel=1e-12)
    assert all(math.isnan(x) for x in _uncertainty.probability(hit[:0], group[:0], 0.9))
    assert all(math.isnan(x) for x in _uncertainty.quantile(np.zeros(0), group[:0], 0.5, 0.9))


def test_a_report_tells_runs_that_have_no_metric_or_failed():
    columns = {
        "stopping_time": [1.0, 2.0, np.inf, np.nan],
        "max_tension": [10.0, 30.0, 20.0, np.nan],
        "code": [0, 0, 0, 1],
    }
    found = evaluated(columns, [0, 0, 1, 1], ("stopping_time", "max_tension"), {"max_tension": 20.0}, method="sobol")
    assert {name: one.count for name, one in found.statistics.items()} == {"stopping_time": 2, "max_tension": 3}
    assert {name: one.count for name, one in found.failures.items()} == {
        "does not stop": 2,
        "max_tension > 20 N": 2,
        "any of these": 3,
    }
    assert found.codes == {"step_limit": 1}
    assert (found.runs, found.groups) == (4, 2)
    lines = [" ".join(line.split()) for line in str(found).splitlines()]
    assert lines[0].endswith("2 independent sets of 2; seed 7; intervals of 90 %")
    assert "initial.omega 1 2 3 rad/s" in lines
    assert "brake.linings.friction.coefficient 0.3 0.35 0.4" in lines
    assert "stopping_time, s: of the 2 of 4 runs (50.00%) that have it; the rest has none" in lines
    assert [line for line in lines if line.startswith("extremes")] == [
        "extremes of the runs 1 2",
        "extremes of the runs 10 30",
    ]
    assert any(line.startswith("max_tension > 20 N 0.5 ") and line.endswith("2 of 4 runs") for line in lines)
    assert lines[-1] == "1 runs failed (step_limit 1): they count as failures, and have no metrics"
    told = found.as_dict()
    assert told["failed_runs"] == {"step_limit": 1}
    assert told["inputs"]["initial.omega"]["quantiles"] == {"0.05": 1.0, "0.5": 2.0, "0.95": 3.0}
    sampled = evaluated(columns, np.arange(4), ("stopping_time",), {"max_tension": np.array([5.0, 50.0, 19.0, 9.0])})
    assert sampled.failures["max_tension > its sampled limit"].count == 3
    assert "independent sets" not in str(sampled).splitlines()[0]
    clean = evaluated({"stopping_time": np.ones(4)}, np.arange(4))
    assert "stopping_time, s: of all 4 runs" in str(clean)
    assert set(clean.failures) == {"does not stop"}
    assert "runs failed" not in str(clean)
    none = evaluated({"stopping_time": np.full(4, np.inf)}, np.arange(4))
    assert "of the 0 of 4 runs (0.00%) that have it; no statistics" in str(none)
    assert not evaluated({"max_tension": np.ones(4)}, np.arange(4), ("max_tension",)).failures
    assert _uncertainty.failure_name(99) == "code 99"


def test_points_are_in_as_many_sets_of_a_power_of_two_as_asked_for():
    for method, n, sets, each in (("sobol", 100, 8, 16), ("sobol", 128, 8, 16), ("latin", 100, 8, 13)):
        points, group = _uncertainty._points(n, 3, method, sets, 0)
        assert points.shape == (sets * each, 3)
        assert group.tolist() == np.repeat(np.arange(sets), each).tolist()
        first, second = points[:each], points[each : 2 * each]
        assert not np.array_equal(first, second)
        # one point in each of as many slices of every axis
        cells = np.sort(np.floor(first * each).astype(int), axis=0)
        np.testing.assert_array_equal(cells, np.tile(np.arange(each)[:, None], 3))
    points, group = _uncertainty._points(10, 2, "random", 8, 0)
    assert (points.shape, group.tolist()) == ((10, 2), list(range(10)))
    assert [_uncertainty.power_of_two(n) for n in (1, 2, 3, 4, 5, 1024, 1025)] == [0, 1, 2, 2, 3, 10, 11]


@pytest.mark.parametrize(
    ("distribution", "words"),
    [
        ((0.4, 0.3), "(0.4, 0.3) is not a range"),
        ((0.3, 0.3), "is not a range"),
        ((0.3, np.inf), "is not a range"),
        ((0.3,), "is not a range"),
        (stats.rv_continuous, "type is not a distribution"),
        (0.35, "float is not a distribution"),
        (stats.norm(0.35, -1.0), "its median is nan, not one number"),
        (stats.norm([0.3, 0.4], 0.01), "not one number"),
        (
            stats.norm(0.25, 0.25),
            "is out of range with probability 0.16: coefficient of friction must be ≥ 0 and ≤ 10 — "
            "truncate it: scipy.stats.truncnorm(-1, 39, 0.25, 0.25)",
        ),
        (stats.laplace(0.25, 0.25), "truncate it (scipy.stats.truncnorm for a normal one), or use a bounded one"),
    ],
)
def test_what_is_no_distribution_of_a_number_is_told(distribution, words):
    with pytest.raises(sb.InputError) as caught:
        sb.studies.samples(brake(), {"brake.linings.friction.coefficient": distribution}, 4)
    (fault,) = caught.value.faults
    assert words in str(fault)
