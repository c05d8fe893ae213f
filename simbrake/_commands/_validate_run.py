"""The command `simbrake validate`: its arguments are parsed, its exit code is returned."""

import json
import sys
from typing import Any

from .._parts._scene import Scene
from .._run._log import SimulationError
from ..checks._cross_check import cross_check
from ..checks._validate import chosen, run_lanes


def listing(only: str | None, json_: bool) -> int:
    """Prints the cases without running any."""
    cases = [case for lane in chosen(only) for case in lane]
    if json_:
        rows = [{"case": c.name, "source": c.source, "truth": c.truth, "tolerance": c.tolerance} for c in cases]
        print(json.dumps(rows, indent=1))
    else:
        print("\n".join(f"{c.name:42} {c.tolerance:>8.0e}  {c.source}" for c in cases))
    return 0


def run(only: str | None = None, *, list_: bool = False, json_: bool = False) -> int:
    """Runs the cases, prints them; 0 if all pass, else 1."""
    if list_:
        return listing(only, json_)
    report = run_lanes(chosen(only))
    print(json.dumps(report.as_list(), indent=1, allow_nan=False) if json_ else report)
    return 0 if report.ok else 1


def run_cross_check(scene: Scene, *, json_: bool = False, **options: Any) -> int:
    """Repeats a scene with SciPy, prints the differences; 0 if they agree, else 1. `options`: as of `cross_check`."""
    try:
        report = cross_check(scene, progress=None, **options)
    except SimulationError as error:
        print(f"simbrake: {error}", file=sys.stderr)
        return 1
    print(json.dumps(report.as_list(), indent=1, allow_nan=False) if json_ else report)
    return 0 if report.ok else 1
