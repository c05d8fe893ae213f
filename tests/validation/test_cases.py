"""Numbers with truths that are independent of simbrake, beyond those that `simbrake validate` shows to users."""

import csv
import functools
import importlib
import json
import pathlib
import re

import numpy as np
import pytest
from commands import call
from oracles import truths

from simbrake.checks import run_case

MODULES = sorted(file.stem for file in pathlib.Path(__file__).parent.glob("cases_*.py"))
SUBJECTS = [subject for name in MODULES for subject in importlib.import_module(name).CASES]


def name_of(subject):
    return f"{subject.__module__.removeprefix('cases_')}, {subject.__name__.removesuffix('_cases')}"


@functools.cache
def cases_of(subject):
    return subject()


@pytest.mark.parametrize("subject", SUBJECTS, ids=name_of)
def test_numbers_are_the_truth(subject):
    checks = [run_case(case) for case in cases_of(subject)]
    assert checks
    assert [(c.case, c.value, c.truth, c.error) for c in checks if c.verdict != "pass"] == []


def test_cases_have_names_and_sources(capsys):
    found = [case for subject in SUBJECTS for case in cases_of(subject)]
    names = {case.name for case in found}
    assert len(names) == len(found)
    for case in found:
        assert case.source
        assert np.isfinite(case.truth)
        assert 0 <= case.tolerance <= 0.15  # the loosest is a printed number of two digits
    _, out, _ = call(capsys, "validate", "--list", "--json")
    assert not names & {row["case"] for row in json.loads(out)}


FILES = ("truths", "closed_forms", "laws", "mechanisms", "stops")


def test_frozen_truths_are_of_their_script(capsys):
    folder = pathlib.Path(truths.__file__).parent
    text = "\n".join((folder / f"{name}.py").read_text("utf-8") for name in FILES)
    assert not re.search(r"^\s*(import|from) (simbrake|jax)", text, re.MULTILINE)
    frozen = list(csv.DictReader(truths.FILE.read_text("utf-8").splitlines()))
    names, made = zip(*((f"{subject}/{what}", truth) for subject, what, truth, _, _ in truths.rows()), strict=True)
    assert tuple(f"{row['subject']}/{row['what']}" for row in frozen) == names
    np.testing.assert_allclose([float(row["truth"]) for row in frozen], made, rtol=1e-8)
    _, out, _ = call(capsys, "validate", "--list", "--json")
    assert set(names) <= {row["case"] for row in json.loads(out)}
