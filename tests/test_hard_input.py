"""Hard cases of input."""

import pytest
from hard_cases import cases_to_test, check
from hard_input import CASES


@pytest.mark.parametrize("case", cases_to_test(CASES))
def test_input(case):
    check(case)
