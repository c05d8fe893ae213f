"""Subjects of `simbrake validate` as tests, for errors that `plant.py` plants; pytest alone does not collect them."""

import pytest

from simbrake.checks import run_case
from simbrake.checks._validate import lanes_of_subjects

SUBJECTS = [subject for lane in lanes_of_subjects() for subject in lane]


def name_of(subject):
    return f"{subject.__module__.rpartition('_cases_')[2]}, {subject.__name__.removesuffix('_cases')}"


@pytest.mark.parametrize("subject", SUBJECTS, ids=name_of)
def test_row(subject):
    checks = [run_case(case) for case in subject()]
    assert [(c.case, c.value, c.error) for c in checks if c.verdict != "pass"] == []
