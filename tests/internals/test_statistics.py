"""Bounds, losses, errors and words of fits; samples, intervals and indices of functions that are known."""

import math

import numpy as np
import pytest
import xarray as xr
from fit_scenes import ELASTIC, LINE, START, elastic_data, line, rigid, speeds
from scipy import stats
from scipy.optimize import least_squares
from scipy.special import ndtri
from stop_scenes import stop_scene

import simbrake as sb
from simbrake.studies import State, _global, _uncertainty
from simbrake.studies._calibration import Parameter, _absoluteness, _combination, _elsewhere, _words
from simbrake.studies._evaluator import (
    Box,
    Evaluation,
    Faults,
    Paths,
    asked_of,
    box_of,
    place_of,
    same_numbers,
)
from simbrake.studies._fit import _LOSSES, _RHO, Direction, FitModel, Search, confound, cost, identify


def test_paths_and_numbers_named_twice():
    sizes = {"a.b": 3, "c[0].x": 1}
    assert place_of("a.b[-1]", sizes) == ("a.b", -1)
    assert place_of("c[0].x", sizes) == ("c[0].x", None)
    assert place_of("d[e].f", sizes) == ("d[e].f", None)
    assert same_numbers(["a.b[2]", "c[0].x", "a.b[0]"], sizes) == {}
    assert same_numbers(["a.b[2]", "a.b[-1]"], sizes) == {"a.b[-1]": "a.b[2]"}
    assert set(same_numbers(["a.b[2]", "a.b"], sizes)) == {"a.b"}
    assert set(same_numbers(["a.b", "a.b[1]"], sizes)) == {"a.b[1]"}


def test_unknowns_are_linear_or_logarithmic():
    found = Faults()
    bounds = {"initial.omega": (5.0, 25.0), "brake.pulley.inertia": (10.0, 1e5), "duty.load.profile.level": (0.0, 4e5)}
    box = box_of(rigid(J=1e3), bounds, found, starts={"initial.omega": 10.0}, decades=100.0)
    assert found == []
    assert box.logarithmic.tolist() == [False, True, False]
    assert box.start[:2].tolist() == [10.0, 1e3]
    z = np.array([0.25, 0.5, 1.0])
    np.testing.assert_allclose(box.up(z), [10.0, 1e3, 4e5], rtol=1e-14)
    np.testing.assert_allclose(box.down(box.up(z)), z, rtol=1e-14)
    np.testing.assert_allclose(box.slope(box.up(z)), [20.0, 1e3 * np.log(1e4), 4e5], rtol=1e-14)
    # exactly a hundredfold is linear still, and so are bounds from 0
    for low, logarithmic in ((1e3, False), (999.0, True)):
        one = box_of(rigid(J=1e3), {"brake.pulley.inertia": (low, 1e5)}, found, decades=100.0)
        assert one.logarithmic.tolist() == [logarithmic]
    linear = box_of(rigid(), {"brake.pulley.inertia": (1.0, 1e5)}, found)
    assert linear.logarithmic.tolist() == [False]
    each = box_of(rigid(), {"brake.linings.angle": (np.full(20, 0.1), 0.5), "initial.omega": (0, 30)}, found, each=True)
    assert each.paths.shapes == ((20,), ())
    assert each.low.tolist() == [0.1] * 20 + [0.0]
    np.testing.assert_allclose(each.start, [np.radians(13.5)] * 20 + [20.0])
    one = box_of(rigid(), {"brake.linings.angle": (0.1, 0.5)}, found)
    assert one.start.tolist() == [pytest.approx(np.radians(13.5))]
    assert found == []


@pytest.mark.parametrize(
    ("bounds", "words"),
    [
        ({"initial.omeg": (1.0, 2.0)}, "initial.omeg: there is no such number in the scene"),
        ({"initial.omega": 3.0}, "initial.omega: 3.0 are not bounds — (low, high), numbers or lists of 1"),
        ({"initial.omega": (1.0, "much")}, "are not bounds"),
        ({"brake.linings.angle": ([0.1, 0.1], 0.3)}, "are not bounds — (low, high), numbers or lists of 20"),
        ({"initial.omega": (2.0, 2.0)}, "the bounds (2.0, 2.0) are out of range — finite, low < high"),
        ({"initial.omega": (1.0, np.inf)}, "are out of range — finite, low < high"),
        ({"brake.pulley.inertia": (-5.0, 900.0)}, "the bound -5 kg*m^2 is out of range — must be "),
        ({"brake.linings.angle[2]": (0.1, 7.0)}, "the bound 7 rad is out of range"),
        ({"initial.omega": (21.0, 30.0)}, "the start 20.0 is outside the bounds (21.0, 30.0) — give a start inside"),
        ({"initial.omega": (1.0, 19.0)}, "is outside the bounds"),
        ({"brake.pulley.width": (0.1, 0.3)}, "brake.pulley.width: has no one value in the scene"),
        (
            {"brake.linings.angle": (0.1, 0.5), "brake.linings.angle[3]": (0.1, 0.5)},
            "brake.linings.angle[3]: is free twice — as brake.linings.angle is",
        ),
    ],
)
def test_bounds_that_are_none_are_told(bounds, words):
    found = Faults()
    box_of(rigid(), bounds, found, each=True)
    (fault,) = found
    assert words in str(fault)


def test_unequal_entries_have_no_one_value():
    found = Faults()
    unequal = sb.with_values(rigid(), {"brake.linings.angle[3]": 0.1})
    box_of(unequal, {"brake.linings.angle": (0.05, 0.5)}, found)
    assert [str(fault) for fault in found] == [
        "brake.linings.angle: has no one value in the scene — give its start value"
    ]
    assert box_of(unequal, {"brake.linings.angle[3]": (0.05, 0.5)}, Faults()).start.tolist() == [0.1]


def test_wrong_settings_say_what_is_right():
    found = Faults()
    for share in (0.0, 1.0, 0.5, -1.0):
        found.share("share", share, 0.9)
    found.unless(2 > 1, "good", 1, "never")
    found.unless(False, "n", 0, "at least 1")
    found.choice("law", "b", ("a", "b"))
    found.choice("law", "c", iter(("a", "b")))
    assert found.attempt(lambda x: x + 1, 2) == 3
    assert found.attempt(sb.Pulley, -1.0, 1.0) is None
    assert [str(one) for one in found][:5] == [
        "share: 0.0 is not a share — between 0 and 1, as 0.9",
        "share: 1.0 is not a share — between 0 and 1, as 0.9",
        "share: -1.0 is not a share — between 0 and 1, as 0.9",
        "n: 0 is out of range — at least 1",
        "law: 'c' is unknown — one of a, b",
    ]
    with pytest.raises(sb.InputError, match="6 input errors"):
        found.report()
    Faults().report()
    assert asked_of("stopping_time") == ["stopping_time"]
    assert asked_of(len) == [len]
    assert asked_of(("stopping_time", len)) == ["stopping_time", len]


def test_product_named_if_all_else_is_known():
    one, other = (Direction(np.array(change), 0.0, np.inf) for change in ([1.0, -1.0, 0.0], [0.0, 1.0, 1.0]))
    arguments = ["p", "q", "r"], np.ones(3), np.array([True, True, True])
    assert "the data determine only (p)·(q)^1" in _combination(one, [one], *arguments).words
    assert "the data determine only" not in _combination(one, [one, other], *arguments).words


def test_robust_errors_match_the_sandwich():
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


def test_jacobian_matches_differences():
    import diffrax

    model = FitModel(stop_scene(), tuple(ELASTIC), elastic_data(), solver=diffrax.Dopri8(), rtol=1e-11, max_steps=None)
    theta = np.array([0.31, 1.5e5, 900.0])
    J, D = model(theta).jacobian * theta, central(model, theta) * theta
    np.testing.assert_allclose(J, D, rtol=1e-6, atol=1e-8 * np.abs(D).max())


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
def test_search_stuck_if_others_fit_better(values, measured, start, unexplained, stuck):
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


def test_fixed_number_correlates_as_fitted():
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


def test_given_deviations_are_absolute():
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


def test_slopes_and_curvatures_of_the_losses():
    z, h = np.array([0.3, 0.7, 1.6, 5.0]), 1e-4
    for name, (first, second) in ((name, law(z)) for name, law in _LOSSES.items()):
        rho = _RHO[name]
        np.testing.assert_allclose(first, (rho(z + h) - rho(z - h)) / (2 * h), rtol=1e-7)
        np.testing.assert_allclose(second, (rho(z + h) - 2 * rho(z) + rho(z - h)) / h**2, atol=2e-7)
        assert cost(np.array([1e-6]), name, 2.0) == pytest.approx(0.5e-12, rel=1e-6)  # near 0 all are squares


def central(model, theta, relative=1e-5):
    columns = []
    for i, x in enumerate(theta):
        h = relative * x
        steps = [model(theta + k * h * np.eye(theta.size)[i]).values for k in (-2, -1, 1, 2)]
        columns.append((8 * (steps[2] - steps[1]) - (steps[3] - steps[0])) / (12 * h))
    return np.stack(columns, axis=1)


@pytest.mark.parametrize(("method", "n"), [("sobol", 512), ("latin", 512), ("random", 256)])
def test_intervals_cover_the_truth_as_stated(method, n):
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


def test_failed_runs_count_without_metrics():
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


def test_sobol_indices_of_ishigami_function():
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


def test_sobol_intervals_cover_g_function():
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


def test_morris_effects_of_linear_function():
    a = np.array([3.0, -2.0, 0.5, 0.0])
    x = _global.morris_design(10, 4, 6, seed=1)
    found = _global.morris_numbers(x, x @ a, 6, 0.95, 100, seed=1)
    np.testing.assert_allclose(found.mu, a, atol=1e-12)
    np.testing.assert_allclose(found.mu_star, abs(a), atol=1e-12)
    np.testing.assert_allclose(found.sigma, 0.0, atol=1e-12)


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


def test_group_scatter_needs_enough_hits():
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


def test_report_tells_of_runs_without_metric():
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


def test_points_come_in_the_sets_asked_for():
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


def covered(estimate, truth):
    return estimate.low <= truth <= estimate.high
