"""Hard cases of a brake without heat: limits of friction and geometry, events, time and
units."""

import pytest
from oracles import hard_events, hard_limits, hard_time
from oracles.hard_cases import cases_to_test, check


@pytest.mark.slow
@pytest.mark.parametrize("case", cases_to_test(hard_limits.CASES))
def test_limits(case):
    check(case)


@pytest.mark.parametrize("case", cases_to_test(hard_events.CASES))
def test_events(case):
    check(case)


@pytest.mark.parametrize("case", cases_to_test(hard_time.CASES))
def test_time(case):
    check(case)
