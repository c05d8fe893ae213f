"""Numbers with truths that are independent of simbrake, beyond those that `simbrake validate` shows to users."""

import importlib
import json
import pathlib
import re

import numpy as np
import pytest
from case_tools import truths
from commands import call

import simbrake as sb
from simbrake.checks import run_case

MODULES = sorted(file.stem for file in pathlib.Path(__file__).parent.glob("cases_*.py"))
SUBJECTS = [subject for name in MODULES for subject in importlib.import_module(name).CASES]


def name_of(subject):
    return f"{subject.__module__.removeprefix('cases_')}, {subject.__name__.removesuffix('_cases')}"


@pytest.mark.parametrize("subject", SUBJECTS, ids=name_of)
def test_numbers_are_the_truth(subject):
    checks = [run_case(case) for case in subject()]
    assert checks
    assert [(c.case, c.value, c.truth, c.error) for c in checks if c.verdict != "pass"] == []


def test_cases_have_names_and_sources():
    found = [case for subject in SUBJECTS for case in subject()]
    assert len({case.name for case in found}) == len(found)
    for case in found:
        assert case.source
        assert np.isfinite(case.truth)
        assert 0 <= case.tolerance <= 0.15  # the loosest is a printed number of two digits


def test_computed_truths_are_as_published():
    """Numbers of outside references, of formulas that are evaluated anew for every run."""
    truth = {case.name: case.truth for subject in SUBJECTS for case in subject()}
    for name, digits in {
        "bouncing ball/impact 11": 2.49911331422462,
        "lock-up/heat": 1620.0,
        "winch with a differential band/tension ratio": 2.97674607410784,
        "winch with a differential band/torque": 69545.6492930983,
        "winch with a differential band/load that it holds": 309091.774635993,
        "simple band, forward/pull for 225 N·m": 88.9605391354699,
        "simple band, reversed/pull for 225 N·m": 288.960539135470,
        "fading flux/maximum rise": 52.4180821839227,
        "flutter of a lining/speed above which it decays": 1.35402510055111,
        "flutter of a lining/growth rate at 0.5 m/s": 56.4773952196454,
        "flutter of a lining/growth rate at 2.0 m/s": -9.06581770836234,
        "band and block/torque": 2547.32287226585,
        "band and block/time to stop": 7.39975137300599,
        "radiation to 0 K/T at 3600 s": 270.786641370929,
        "radiation to 300 K/T at 600 s": 482.334096654852,
        "repeated stops/rise after 10": 190.802296902655,
        "two bodies in contact/steel and lining": 0.907538740903391,
        "two bodies in contact/two metals": 0.599546754116704,
    }.items():
        assert truth[name] == pytest.approx(digits, rel=1e-11), name


@pytest.fixture(scope="module")
def oracles():
    """The script that makes the frozen truths, and the text of all its modules."""
    folder = pathlib.Path(__file__).parents[1] / "oracles"
    names = ("truths", "duties", "laws", "mechanisms", "stops")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(folder)
        return importlib.import_module("truths"), "\n".join((folder / f"{x}.py").read_text("utf-8") for x in names)


def test_frozen_truths_are_of_their_script(oracles, capsys):
    script, text = oracles
    assert not re.search(r"^\s*(import|from) (simbrake|jax)", text, re.MULTILINE)
    frozen = [(subject, row["what"], float(row["truth"])) for subject, rows in truths().items() for row in rows]
    made = [(subject, what, truth) for subject, what, truth, _, _ in script.rows()]
    assert [row[:2] for row in frozen] == [row[:2] for row in made]
    np.testing.assert_allclose([row[2] for row in frozen], [row[2] for row in made], rtol=1e-8)
    shown = pathlib.Path(sb.checks.__file__).with_name("truths.csv").read_text("utf-8").splitlines()
    assert set(shown) <= set(pathlib.Path(__file__).with_name("truths.csv").read_text("utf-8").splitlines())
    _, out, _ = call(capsys, "validate", "--list", "--json")
    named = {case.name for subject in SUBJECTS for case in subject()} | {row["case"] for row in json.loads(out)}
    assert {f"{subject}/{what}" for subject, what, _ in frozen} <= named


def test_no_case_is_in_the_package_too(capsys):
    _, out, _ = call(capsys, "validate", "--list", "--json")
    here = {case.name for subject in SUBJECTS for case in subject()}
    assert not here & {row["case"] for row in json.loads(out)}
