"""Run the validation cases and report the verdicts."""

import itertools
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from fnmatch import fnmatchcase

from .._base._faults import Fault, InputError
from .._base._progress import Progress
from .._run._simulate import require_64_bits
from ._validation import Case, Check, Validation, run_case


def lanes_of_subjects() -> tuple[list[Callable[[], list[Case]]], ...]:
    """Functions that make the cases, in two lanes that run side by side; those of one share compiled programs."""
    # loaded on demand: they and their references take a good part of a second to import
    from . import _cases_band as band
    from . import _cases_heat as heat
    from . import _cases_integrator as integrator
    from . import _cases_laws as laws
    from . import _cases_mechanisms as mechanisms
    from . import _cases_runs as runs
    from . import _cases_shaft as shaft

    first = integrator, heat, mechanisms, runs
    second = band, shaft, laws
    return [s for module in first for s in module.CASES], [s for module in second for s in module.CASES]


def lanes_of_cases() -> list[list[Case]]:
    """Every case, none of them run yet, lane by lane."""
    return [[case for subject in lane for case in subject()] for lane in lanes_of_subjects()]


def chosen(only: str | None = None) -> list[list[Case]]:
    """The cases whose name holds the words `only`, or fits it as a pattern with `*`; all without it. In lanes.

    Raises `InputError` where there is none.
    """
    lanes = lanes_of_cases()
    if only is None:
        return lanes
    word = only.lower()
    pattern = word if any(sign in word for sign in "*?[") else f"*{word}*"
    picked = [[case for case in lane if fnmatchcase(case.name.lower(), pattern)] for lane in lanes]
    if not any(picked):
        subjects = ", ".join(dict.fromkeys(case.name.partition("/")[0] for lane in lanes for case in lane))
        raise InputError([Fault("--only", f"no case matches {only!r}", f"subjects are {subjects}")])
    return [lane for lane in picked if lane]


def run_lanes(lanes: Sequence[Sequence[Case]], progress: bool | None = None) -> Validation:
    """Run the lanes in parallel, as compiling releases Python; a line on a terminal shows the progress."""
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

    with shown, ThreadPoolExecutor(max(1, len(lanes))) as pool:
        futures = [pool.submit(run, lane) for lane in lanes]
        try:
            checks = [check for future in futures for check in future.result()]
        finally:
            halted.set()  # interrupted: each lane ends after the case it is at
    return Validation(checks, time.monotonic() - start)


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
    return run_lanes(chosen(only), progress)
