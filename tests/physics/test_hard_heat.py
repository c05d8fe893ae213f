"""Hard cases with heat."""

import pytest
from oracles.hard_cases import cases_to_test, check
from oracles.hard_heat import CASES


@pytest.mark.slow
@pytest.mark.parametrize("case", cases_to_test(CASES))
def test_heat(case):
    check(case)
