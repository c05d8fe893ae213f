"""Numbers with truths that are independent of simbrake, beyond those that
`simbrake validate` shows to users."""

import functools
import importlib
import pathlib

import pytest

from simbrake.checks import run_case

MODULES = sorted(file.stem for file in pathlib.Path(__file__).parent.glob("cases_*.py"))
SUBJECTS = [
    subject for name in MODULES for subject in importlib.import_module(name).CASES
]


def name_of(subject):
    return f"{subject.__module__.removeprefix('cases_')}-{subject.__name__.removesuffix('_cases')}"


@functools.cache
def cases_of(subject):
    return subject()


@pytest.mark.parametrize("subject", SUBJECTS, ids=name_of)
def test_numbers_are_the_truth(subject):
    checks = [run_case(case) for case in cases_of(subject)]
    assert checks
    assert [
        (c.case, c.value, c.truth, c.error) for c in checks if c.verdict != "pass"
    ] == []
