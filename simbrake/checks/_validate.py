"""Run the closed forms and report the verdicts."""

import time
from fnmatch import fnmatchcase

from .._base._arguments import explained
from .._base._faults import Fault, InputError
from .._base._progress import Progress
from ..runs.simulate import require_64_bits
from ._validation import Case, Validation, run_case


def chosen(only: str | None = None) -> list[Case]:
    """The cases whose name holds the words `only`, or fits it as a pattern with `*`; all without it.

    Raises `InputError` where there is none.
    """
    from ._closed_forms import closed_forms  # loaded on demand: it imports the whole package

    cases = closed_forms()
    word = (only or "*").lower()
    pattern = word if any(sign in word for sign in "*?[") else f"*{word}*"
    picked = [case for case in cases if fnmatchcase(case.name.lower(), pattern)]
    if not picked:
        names = ", ".join(case.name for case in cases)
        raise InputError([Fault("--only", f"no case matches {only!r}", f"cases are {names}")])
    return picked


@explained
def validate(only: str | None = None, *, progress: bool | None = False) -> Validation:
    """Compare simbrake with twelve closed forms: every kind of brake, loads, heat, events, a derivative.

        report = simbrake.validate()
        assert report.ok
        print(report)

    - `only`: words in the names of cases, or a pattern with `*`, as in `"elastic band"` or `"*/stopping time"`
    - `progress`: a line on stderr; `None`: where that is a terminal

    Every value comes from a run by the same functions that you call. A case whose run fails is a `fail` with the
    message as its error; nothing is raised for it.

    Raises `InputError` where no case matches `only`, `RuntimeError` if JAX is not in 64-bit mode.
    """
    require_64_bits()
    cases = chosen(only)
    checks = []
    start = time.monotonic()
    with Progress("validate", "compiling…", progress) as shown:
        for case in cases:
            checks.append(run_case(case))
            shown.now("cases", len(checks), len(cases))
    return Validation(checks, time.monotonic() - start)
