"""Hard cases of input, and that every case which another test checks is there."""

import importlib
import inspect

import pytest
from oracles import hard_events, hard_heat, hard_input, hard_limits, hard_time
from oracles.hard_cases import Elsewhere, cases_to_test, check

MODULES = (hard_limits, hard_events, hard_time, hard_heat, hard_input)


@pytest.mark.parametrize("case", cases_to_test(hard_input.CASES))
def test_input(case):
    check(case)


def test_cases_of_other_tests_are_there():
    for case in (case for module in MODULES for case in module.CASES if isinstance(case, Elsewhere)):
        inspect.signature(getattr(importlib.import_module(case.file), case.test)).bind(**case.arguments)


def test_names_of_cases_are_unique():
    names = [case.name for module in MODULES for case in module.CASES]
    assert len(set(names)) == len(names)
