"""The evaluator of studies against closed forms: derivatives in every direction, codes, records that were too short."""

import numpy as np
import pytest
from stop_scenes import closed_form, stop_scene

import simbrake as sb
from simbrake.studies import Evaluator, Metrics, Paths
from simbrake.studies._evaluator import Faults, asked_of, box_of, place_of, same_numbers, values_of

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
        (True, True),
        pytest.param(True, False, marks=pytest.mark.slow),
        pytest.param(False, True, marks=pytest.mark.slow),
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
def test_a_record_that_is_too_short_is_lengthened_and_a_failed_run_has_its_code():
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


def test_values_of_a_concrete_result():
    result = sb.simulate(sb.with_values(scene(), dict(zip(PATHS, X, strict=True))))
    np.testing.assert_allclose(values_of(result, Metrics(NAMES)), truth(X)[0], rtol=1e-9)


def test_numbers_as_a_vector_and_back():
    paths = Paths(("brake.linings.angle", "initial.omega", "brake.linings.angle[2]"), ((20,), (), ()))
    x = np.arange(1.0, 23.0)
    laid = paths(scene(), x)
    assert [span.stop - span.start for span in paths.spans] == [20, 1, 1]
    assert float(laid.initial.omega) == 21.0
    np.testing.assert_array_equal(laid.brake.linings.angle, [1, 2, 22, *range(4, 21)])


def test_paths_of_entries_and_numbers_that_are_named_twice():
    sizes = {"a.b": 3, "c[0].x": 1}
    assert place_of("a.b[-1]", sizes) == ("a.b", -1)
    assert place_of("c[0].x", sizes) == ("c[0].x", None)
    assert place_of("d[e].f", sizes) == ("d[e].f", None)
    assert same_numbers(["a.b[2]", "c[0].x", "a.b[0]"], sizes) == {}
    assert same_numbers(["a.b[2]", "a.b[-1]"], sizes) == {"a.b[-1]": "a.b[2]"}
    assert set(same_numbers(["a.b[2]", "a.b"], sizes)) == {"a.b"}
    assert set(same_numbers(["a.b", "a.b[1]"], sizes)) == {"a.b[1]"}


def test_unknowns_are_linear_or_logarithmic_between_the_bounds():
    found = Faults()
    bounds = {"initial.omega": (5.0, 25.0), "brake.pulley.inertia": (10.0, 1e5), "duty.load.profile.level": (0.0, 4e5)}
    box = box_of(scene(J=1e3), bounds, found, starts={"initial.omega": 10.0}, decades=100.0)
    assert found == []
    assert box.logarithmic.tolist() == [False, True, False]
    assert box.start[:2].tolist() == [10.0, 1e3]
    z = np.array([0.25, 0.5, 1.0])
    np.testing.assert_allclose(box.up(z), [10.0, 1e3, 4e5], rtol=1e-14)
    np.testing.assert_allclose(box.down(box.up(z)), z, rtol=1e-14)
    np.testing.assert_allclose(box.slope(box.up(z)), [20.0, 1e3 * np.log(1e4), 4e5], rtol=1e-14)
    # exactly a hundredfold is linear still, and so are bounds from 0
    for low, logarithmic in ((1e3, False), (999.0, True)):
        one = box_of(scene(J=1e3), {"brake.pulley.inertia": (low, 1e5)}, found, decades=100.0)
        assert one.logarithmic.tolist() == [logarithmic]
    linear = box_of(scene(), {"brake.pulley.inertia": (1.0, 1e5)}, found)
    assert linear.logarithmic.tolist() == [False]
    each = box_of(scene(), {"brake.linings.angle": (np.full(20, 0.1), 0.5), "initial.omega": (0, 30)}, found, each=True)
    assert each.paths.shapes == ((20,), ())
    assert each.low.tolist() == [0.1] * 20 + [0.0]
    np.testing.assert_allclose(each.start, [np.radians(13.5)] * 20 + [20.0])
    one = box_of(scene(), {"brake.linings.angle": (0.1, 0.5)}, found)
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
    box_of(scene(), bounds, found, each=True)
    (fault,) = found
    assert words in str(fault)


def test_unequal_entries_have_no_one_value():
    found = Faults()
    unequal = sb.with_values(scene(), {"brake.linings.angle[3]": 0.1})
    box_of(unequal, {"brake.linings.angle": (0.05, 0.5)}, found)
    assert [str(fault) for fault in found] == [
        "brake.linings.angle: has no one value in the scene — give its start value"
    ]
    assert box_of(unequal, {"brake.linings.angle[3]": (0.05, 0.5)}, Faults()).start.tolist() == [0.1]


def test_settings_are_told_with_what_they_should_be():
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
