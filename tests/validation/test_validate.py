"""`simbrake validate`: its closed forms, its verdicts, and the cross-check of a scene
with SciPy."""

import json

import numpy as np
import pytest
import staged_scenes as staged
from commands import call, output
from helpers import input_error
from scenes import elastic_stop

import simbrake as sb
from simbrake.checks import Case, run_case

CASES = json.loads(output("validate", "--list", "--json"))
KEYS = ["case", "source", "value", "truth", "error", "tolerance", "verdict"]


@pytest.mark.parametrize("name", [case["case"] for case in CASES])
def test_closed_forms(capsys, name):
    code, out, _ = call(capsys, "validate", "--only", name, "--json")
    (row,) = json.loads(out)
    assert list(row) == KEYS
    assert (code, row["case"], row["verdict"]) == (0, name, "pass")
    assert row["error"] <= row["tolerance"] <= 1e-3
    assert row["source"].startswith("closed form: ")


def test_case_that_raises_fails():
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
    assert run_case(Case("a/c", "nowhere", 1.0, 1e-3, lambda: np.nan)).verdict == "fail"
    assert run_case(Case("a/c", "nowhere", 1.0, 1e-3, lambda: 1.0011)).verdict == "fail"
    assert not sb.checks.Validation([]).ok


# --- cross-check --------------------------------------------------------------------


@pytest.fixture(scope="module")
def elastic():
    scene = elastic_stop(load=300.0, drag=20.0)
    return scene, sb.simulate(scene)


def test_cross_check_of_an_elastic_stop(elastic, capsys):
    scene, result = elastic
    report = sb.cross_check(scene, result=result)
    assert report.ok, str(report)
    assert all(list(row) == KEYS for row in report.as_list())
    names = [check.case for check in report]
    for name in (
        "changes of mode",
        "stopping time (s)",
        "2 full_slip (s)",
        "end: elongation (m)",
    ):
        assert name in names
    assert all(
        check.error <= 1e-8 and check.source == "SciPy DOP853" for check in report
    )
    assert report.evaluations > 100


def test_cross_check_of_another_run(elastic):
    scene, _ = elastic
    # a stiffness off by 1e-6 moves times and energies, but not the order of events
    other = sb.simulate(
        sb.with_values(scene, {"brake.band.stiffness": 2e5 * (1 + 1e-6)})
    )
    report = sb.cross_check(scene, result=other)
    verdict = {check.case: check.verdict for check in report}
    assert not report.ok
    assert verdict["changes of mode"] == "pass"
    assert verdict["2 full_slip (s)"] == verdict["end: elongation (m)"] == "fail"
    # a lever that pulls harder keeps the band from sliding
    other = sb.simulate(
        sb.with_values(scene, {"duty.slack_tension.values": np.full(6, 8e4)})
    )
    report = sb.cross_check(scene, result=other)
    assert report.first_difference.startswith("at change 2: simbrake has stop at")
    assert "SciPy full_slip at" in report.first_difference
    assert report.as_list()[0]["verdict"] == "fail"


def test_cross_check_that_takes_too_long(elastic):
    scene, result = elastic
    report = sb.cross_check(scene, result=result, max_evaluations=150)
    assert not report.ok
    assert "150 evaluations of the right-hand side were not enough" in report.trouble
    assert report[-1].verdict == "fail"
    with input_error(match="SciPy has no"):
        sb.cross_check(scene, method="Euler")


def test_cross_check_of_a_staged_stop():
    report = sb.cross_check(staged.stop(stiffness=3e5))
    assert report.ok, str(report)
    names = [check.case for check in report]
    assert "3 internal_slip (s)" in names
    assert "5 external_lock (s)" in names
    assert "end: internal heat (J)" in names
