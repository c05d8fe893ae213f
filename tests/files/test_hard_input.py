"""Hard cases of input."""

import pytest
from oracles import hard_events, hard_heat, hard_input, hard_limits, hard_time
from oracles.hard_cases import cases_to_test, check


@pytest.mark.parametrize("case", cases_to_test(hard_input.CASES))
def test_input(case):
    check(case)


def test_names_of_cases_are_unique():
    modules = hard_limits, hard_events, hard_time, hard_heat, hard_input
    names = [case.name for module in modules for case in module.CASES]
    assert len(set(names)) == len(names)
