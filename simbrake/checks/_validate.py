"""Run the closed forms and report the verdicts."""

import time

from .._base._progress import Progress
from ..runs.simulate import require_64_bits
from ._validation import Validation, run_case
from .closed_forms import chosen


def validate(only: str | None = None, *, progress: bool | None = False) -> Validation:
    """Compare simbrake with twelve closed forms: every kind of brake, loads, heat,
    events, a derivative.

        report = simbrake.validate()
        assert report.ok
        print(report)

    - `only`: words in the names of cases, or a pattern with `*`, as in `"elastic band"`
      or `"*/stopping time"`
    - `progress`: a line on stderr; `None`: where that is a terminal

    Every value comes from a run by the same functions that you call. A case whose run
    fails is a `fail` with the message as its error; nothing is raised for it.

    Raises `InputError` where no case matches `only`, `RuntimeError` if JAX is not in
    64-bit mode.
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
