"""`simbrake validate`: its cases, its verdicts, and the cross-check of a scene with SciPy."""

import json
import pathlib

import jax
import numpy as np
import pytest
import staged_scenes as staged
from cases_heat import radiation_cases
from stop_scenes import closed_form, elastic_stop, stop_scene

import simbrake as sb
from simbrake._commands import _checks
from simbrake._run import _networks
from simbrake.checks import Case, _cases_band, _cross_check, _validate, _validation, run_case
from simbrake.checks._validation import subject_of
from simbrake.thermal import _network as _links

KEYS = ["case", "source", "value", "truth", "error", "tolerance", "verdict"]
DOCS = pathlib.Path(__file__).parents[2] / "docs"


def cases():
    return [case for lane in _validate.chosen() for case in lane]


def test_cases_are_many_and_each_has_a_name_of_its_own_a_source_and_a_tolerance():
    found = cases()
    assert len(found) >= 100
    assert len({case.name for case in found}) == len(found)
    subjects = {case.name.partition("/")[0] for case in found}
    for subject in ("belt oscillator", "elastic stop", "staged pair", "half-space", "held 3600 s", "Robertson"):
        assert subject in subjects
    for case in found:
        assert case.source
        assert np.isfinite(case.truth)
        assert 0 <= case.tolerance <= 0.15  # the loosest is a printed number of two digits


def test_truths_that_are_computed_agree_with_the_digits_published():
    """Numbers of the outside reference, of formulas that are evaluated anew for every run."""
    truth = {case.name: case.truth for case in cases()}
    for name, digits in {
        "belt oscillator/slip lasts": 4.06888787159140,
        "belt oscillator/∂(period)/∂k": -5.63444393579570,
        "belt oscillator/∂(period)/∂m": 2.43444393579570,
        "staged pair/external lock": 1.61952353926807,
        "staged pair/internal heat": 964.696427220533,
        "staged pair/external heat": 7835.30357277947,
        "hook load/stopping time": 1.05986261040236,
        "hook load/friction heat": 763101.079489696,
        "exponential rise/stopping time": 4.49993828748156,
        "two lumps/T1 at 0.5 s": 348.820855951630,
        "half-space/surface": 119.416426428837,
        "half-space/10 mm deep": 12.6092893607,
    }.items():
        assert truth[name] == pytest.approx(digits, rel=1e-11), name


def test_subjects_are_counted_once_each():
    assert subject_of("stop with fade/stopping time") == subject_of("stop with no fade/stopping time")
    assert subject_of("elastic stop/slip onset") == "elastic stop"


def test_frozen_cases_take_derivatives_along_a_number_an_array_and_one_of_its_numbers():
    """`t = J ω_0/M` of a stop: by the inertia, by all numbers of a lever `T_0`, and by one of two that are the same."""
    scene, done = elastic_stop(C=None), {}
    paths = {"J": "brake.pulley.inertia", "all": "duty.slack_tension.values", "first": "duty.slack_tension.values.0"}
    with pytest.MonkeyPatch.context() as patch:
        rows = [{"what": what, "source": "", "truth": "0", "tolerance": "0"} for what in paths]
        patch.setattr(_validation, "truths", lambda: {"one": rows})
        for case in _validation.frozen_cases("one", scene, {}, paths):
            done[case.name] = float(case.value())
    time = 800 * 20 / (0.725 * 8e3 * (closed_form(n=10, beta=27.0)["Pi"] - 1))
    assert done["one/J"] == pytest.approx(time / 800, rel=1e-10)
    assert done["one/all"] == pytest.approx(-time / 8e3, rel=1e-10)
    # the lever is constant up to 1e6 s: of a stop the first number alone counts
    assert done["one/first"] == pytest.approx(-time / 8e3, rel=1e-5)


def test_report_as_table_and_as_json(capsys):
    assert _checks.validate(only="elastic stop/s*", json_=True) == 0
    rows = json.loads(capsys.readouterr().out)
    assert [row["case"] for row in rows] == ["elastic stop/slip onset", "elastic stop/stopping time"]
    assert all(list(row) == KEYS for row in rows)
    assert all(row["verdict"] == "pass" and row["error"] <= row["tolerance"] for row in rows)
    report = sb.validate("elastic stop/slip onset")
    assert "1 of 1 cases pass" in str(report)
    assert _checks.validate(list_=True) == 0
    assert len(capsys.readouterr().out.splitlines()) == 1 + len(cases())
    with pytest.raises(sb.InputError, match="no case fits"):
        sb.validate("no such thing")


def test_other_physics_than_that_of_the_truth_fails():
    """A coefficient of friction and an inertia off by a thousandth: the cases that see it fail."""
    verdicts = [run_case(case).verdict for case in _cases_band.elastic_cases(elastic_stop(f=0.35 * 1.001))]
    assert verdicts == ["pass", "fail", "fail", "fail", "fail"]  # the onset of slip does not depend on friction
    checks = {c.case.partition("/")[2]: c for c in map(run_case, _cases_band.pair_cases(J_2=4.004))}
    assert checks["internal slip"].verdict == checks["external lock"].verdict == "fail"
    assert checks["internal slip"].error == pytest.approx(0.004 / 44, rel=1e-3)


def test_a_planted_wrong_constant_of_nature_fails(monkeypatch):
    def checked():
        jax.clear_caches()
        _networks._compiled.clear_cache()  # the constant is part of the program
        return run_case(next(c for c in radiation_cases() if c.name == "radiation to 0 K/T at 3600 s"))

    assert checked().verdict == "pass"
    with monkeypatch.context() as planted:
        planted.setattr(_links, "STEFAN_BOLTZMANN", 1.001 * _links.STEFAN_BOLTZMANN)
        check = checked()
    assert checked().verdict == "pass"
    assert check.verdict == "fail"
    # T ~ σ^(−1/3)
    assert check.error == pytest.approx(1e-3 / 3, rel=0.05)


def test_a_case_that_raises_is_a_fail_with_its_message():
    def broken():
        raise sb.SimulationError("step_limit: too long\nmore", None)

    check = run_case(Case("a/b", "nowhere", 1.0, 1e-3, broken))
    assert check.as_dict() == {
        "case": "a/b",
        "source": "nowhere",
        "value": None,
        "truth": 1.0,
        "error": "SimulationError: step_limit: too long",
        "tolerance": 1e-3,
        "verdict": "fail",
    }
    report = sb.checks.Validation([check])
    assert not report.ok
    assert "step_limit: too long" in str(report)
    assert run_case(Case("a/c", "nowhere", 1.0, 1e-3, lambda: np.nan)).verdict == "fail"
    assert not sb.checks.Validation([]).ok


# --- cross-check ----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def elastic():
    scene = elastic_stop(load=300.0, drag=20.0)
    return scene, sb.simulate(scene)


def test_cross_check_of_an_elastic_stop_agrees(elastic, capsys):
    scene, result = elastic
    report = sb.cross_check(scene, result=result)
    assert report.ok, str(report)
    assert all(list(row) == KEYS for row in report.as_list())
    names = [check.case for check in report]
    for name in ("changes of mode", "stopping time (s)", "2 full_slip (s)", "end: elongation (m)"):
        assert name in names
    assert all(check.error <= 1e-8 and check.source == "SciPy DOP853" for check in report)
    assert "Not checked: the physics" in str(report)
    assert "times as long" in str(report)
    assert report.evaluations > 100


def test_cross_check_of_another_run_finds_the_differences(elastic):
    scene, _ = elastic
    # a stiffness off by 1e-6 moves times and energies, but not the order of events
    other = sb.simulate(sb.with_values(scene, {"brake.band.stiffness": 2e5 * (1 + 1e-6)}))
    report = sb.cross_check(scene, result=other)
    verdict = {check.case: check.verdict for check in report}
    assert not report.ok
    assert verdict["changes of mode"] == "pass"
    assert verdict["2 full_slip (s)"] == verdict["end: elongation (m)"] == "fail"
    # a lever that pulls harder keeps the band from sliding
    other = sb.simulate(sb.with_values(scene, {"duty.slack_tension.values": np.full(6, 8e4)}))
    report = sb.cross_check(scene, result=other)
    assert report.first_difference.startswith("at change 2: simbrake has stop at")
    assert "SciPy full_slip at" in report.first_difference
    assert report.as_list()[0]["verdict"] == "fail"
    assert "differ first" in str(report)


def test_cross_check_that_would_take_too_long_says_so(elastic):
    scene, result = elastic
    report = sb.cross_check(scene, result=result, max_evaluations=150)
    assert not report.ok
    assert "150 evaluations of the right-hand side were not enough" in report.trouble
    assert report.trouble in str(report)
    assert report[-1].verdict == "fail"
    with pytest.raises(sb.InputError, match="SciPy has no"):
        sb.cross_check(scene, method="Euler")


def test_cross_check_of_a_staged_stop_agrees():
    report = sb.cross_check(staged.stop(stiffness=3e5))
    assert report.ok, str(report)
    names = [check.case for check in report]
    assert "3 internal_slip (s)" in names
    assert "5 external_lock (s)" in names
    assert "end: internal heat (J)" in names


def test_scipy_loop_finds_what_the_closed_form_says():
    """The second integrator is itself no copy of the first: it comes to the truth on its own."""
    scene = stop_scene(n=10, beta=27.0)
    course = _cross_check.drive(sb.simulate(scene).record, rtol=1e-11, energy=1e5)
    truth = closed_form(n=10, beta=27.0)
    assert course.trouble == ""
    times = [change.t for change in course.changes]
    np.testing.assert_allclose(times[-3:], [truth["t0"], truth["t1"], truth["stop"]], rtol=1e-10)
