"""Run the validation cases and report the verdicts."""

import itertools
import threading
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from fnmatch import fnmatchcase

from .._base._arguments import explained
from .._base._faults import Fault, InputError
from .._base._progress import Progress
from .._run._simulate import require_64_bits
from ._validation import Case, Check, Validation, run_case


def chosen(only: str | None = None) -> list[list[Case]]:
    """The cases whose name holds the words `only`, or fits it as a pattern with `*`; all without it. In lanes.

    Raises `InputError` where there is none.
    """
    from ._cases import LANES  # loaded on demand: they take a good part of a second to import

    lanes = [[case for subject in lane for case in subject()] for lane in LANES]
    if only is None:
        return lanes
    word = only.lower()
    pattern = word if any(sign in word for sign in "*?[") else f"*{word}*"
    picked = [[case for case in lane if fnmatchcase(case.name.lower(), pattern)] for lane in lanes]
    if not any(picked):
        subjects = ", ".join(dict.fromkeys(case.name.partition("/")[0] for lane in lanes for case in lane))
        raise InputError([Fault("--only", f"no case matches {only!r}", f"subjects are {subjects}")])
    return [lane for lane in picked if lane]


@explained
def validate(only: str | None = None, *, progress: bool | None = False) -> Validation:
    """Run simbrake on cases with independent reference solutions, and compare.

        report = simbrake.validate()
        assert report.ok
        print(report)

    - `only`: words in the names of cases, or a pattern with `*`, as in `"elastic stop"` or `"*/order*"`
    - `progress`: a line on stderr; `None`: where that is a terminal

    The truths are closed forms and published numbers; every value comes from the integrator, brakes and
    thermal networks. A case whose run fails is a `fail` with the message as its error; nothing is raised for it.

    Raises `InputError` where no case matches `only`, `RuntimeError` if JAX is not in 64-bit mode.
    """
    require_64_bits()
    lanes = chosen(only)
    shown, total = Progress("validate", "compiling…", progress), sum(map(len, lanes))
    start, halted, done = time.monotonic(), threading.Event(), itertools.count(1)

    def run(lane: Sequence[Case]) -> list[Check]:
        checks = []
        for case in lane:
            if halted.is_set():
                break
            checks.append(run_case(case))
            shown.now("cases", next(done), total)
        return checks

    # side by side, as compiling releases Python
    with shown, ThreadPoolExecutor(max(1, len(lanes))) as pool:
        futures = [pool.submit(run, lane) for lane in lanes]
        try:
            checks = [check for future in futures for check in future.result()]
        finally:
            halted.set()  # interrupted: each lane ends after the case it is at
    return Validation(checks, time.monotonic() - start)
