"""Subjects of `simbrake validate` as tests, for errors that `plant.py` plants; pytest alone does not collect them."""

import pytest

from simbrake.checks import run_case
from simbrake.checks._validate import lanes_of_cases

CASES = [case for lane in lanes_of_cases() for case in lane]


def subject(case):
    return case.name.partition("/")[0]


@pytest.mark.parametrize("name", list(dict.fromkeys(map(subject, CASES))))
def test_row(name):
    checks = [run_case(case) for case in CASES if subject(case) == name]
    assert [(c.case, c.value, c.error) for c in checks if c.verdict != "pass"] == []
