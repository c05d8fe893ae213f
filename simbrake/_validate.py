"""Runs the validation cases and tells what came of them."""

import time
from collections.abc import Callable, Sequence
from fnmatch import fnmatchcase

from . import (
    _validation_brakes,
    _validation_events,
    _validation_heat,
    _validation_invariants,
    _validation_staged,
    _validation_tables,
)
from ._progress import Line, duration
from ._quantity import Fault, InputError
from ._simulate import require_64_bits
from ._validation import Case, Check, Validation, run_case

_SUBJECTS = (
    _validation_events,
    _validation_brakes,
    _validation_staged,
    _validation_heat,
    _validation_invariants,
    _validation_tables,
)


def all_cases() -> list[Case]:
    """Every case, none of them run yet."""
    return [case for subject in _SUBJECTS for case in subject.cases()]


def chosen(only: str | None) -> list[Case]:
    """The cases whose name holds the words `only`, or fits it as a pattern with `*`; all without it.

    Raises `InputError` where there is none.
    """
    found = all_cases()
    if only is None:
        return found
    word = only.lower()
    pattern = word if any(sign in word for sign in "*?[") else f"*{word}*"
    picked = [case for case in found if fnmatchcase(case.name.lower(), pattern)]
    if not picked:
        subjects = ", ".join(dict.fromkeys(case.name.partition("/")[0] for case in found))
        raise InputError([Fault("--only", f"no case fits {only!r}", f"subjects are {subjects}")])
    return picked


def run_cases(cases: Sequence[Case], progress: bool | None = None, tell: Callable[[Check], None] | None = None) -> Validation:
    """Runs cases one after the other, with a line on a terminal that says how far they are; `tell` hears each one."""
    line, checks = Line("validate", progress), []
    start = time.monotonic()
    for i, case in enumerate(cases):
        left = (len(cases) - i) * line.spent / max(i, 1)
        line.show(f"{i}/{len(cases)} {case.name}" + (f", about {duration(left)} left" if i else ""))
        checks.append(run_case(case))
        if tell is not None:
            tell(checks[-1])
    line.done()
    return Validation(checks, time.monotonic() - start)


def validate(only: str | None = None, *, progress: bool | None = False) -> Validation:
    """Runs simbrake on cases whose answer is known from outside, and compares.

        report = simbrake.validate()
        assert report.ok
        print(report)

    - `only`: words in the names of cases, or a pattern with `*`, as in `"elastic stop"` or `"*/order*"`
    - `progress`: a line on stderr; `None`: where that is a terminal

    The truths are closed forms and published numbers; every value comes from simbrake's own integrator, brakes and
    thermal networks. A case whose run fails is a `fail` with the message as its error; nothing is raised for it.

    Raises `InputError` where no case fits `only`, `RuntimeError` if JAX is not in 64-bit mode.
    """
    require_64_bits()
    return run_cases(chosen(only), progress)
