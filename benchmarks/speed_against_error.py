"""Work against precision of whole runs with all their events: simbrake beside other
tools, on the same equations.

`python benchmarks/speed_against_error.py [--quick] [--scenes a,b] [--json out.json]
[--png out.png]`

For every tolerance: the largest error of event times and final state against an
independent reference, the median processor time of a warm run, steps, right-hand sides.
Times at equal error are given as ratios to simbrake; quote these, absolute times depend
on the machine. simbrake also integrates its energy balance, which the others do not.
The command fails if a tool does not come to the reference at its tightest tolerances.
`pip install -e '.[bench]'` installs the other tools. Of the numbers in
`docs/pictures/precision.json` (`--json`) the pages and their figure are made.
"""

import argparse
import contextlib
import json
import os
import pathlib
import signal
import sys
import time
import warnings
from collections.abc import Callable
from typing import Any

# matrices are small: more threads would only wait for each other
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
# JAX is not asked for its devices: the other tools have none
os.environ.setdefault("JAX_PLATFORMS", "cpu")
os.environ["SIMBRAKE_CACHE_DIR"] = ""  # what is compiled here is compiled anew
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

import numpy as np  # noqa: E402

from benchmarks import ours, peers, pictures, report  # noqa: E402
from benchmarks.machine import machine  # noqa: E402
from benchmarks.reference import error, reference  # noqa: E402
from benchmarks.scenes import CASES, Answer, Case  # noqa: E402
from benchmarks.timing import interleaved  # noqa: E402

FULL = tuple(10.0**-k for k in range(3, 13))
QUICK = (1e-4, 1e-7, 1e-10)
#: how close simbrake's best answer must come
AGREES = 1e-9
#: a method slower than this is not tried at tighter tolerances (s)
SLOW = 5.0
#: a run, with all that is compiled for it, is broken off after this time (s)
LIMIT = 90.0


@contextlib.contextmanager
def limited(seconds: float):
    """Breaks off what takes longer, where the system has an alarm clock."""
    if not hasattr(signal, "setitimer"):
        yield
        return

    def ring(number: int, frame: Any) -> None:
        raise TimeoutError(f"more than {seconds:.0f} s")

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def timed(call: Callable[[], Answer], budget: float) -> tuple[Answer, dict[str, float]]:
    """The answer, median processor time of warm runs, median and least elapsed time."""
    wall = time.perf_counter()
    cpu = time.process_time()
    answer = call()
    wall = time.perf_counter() - wall
    cpu = time.process_time() - cpu
    if wall > 1.0:
        return answer, {"seconds": cpu, "elapsed_seconds": wall, "least_seconds": wall}
    found = interleaved({"run": call}, budget)["run"]
    return answer, {
        "seconds": found.cpu_median,
        "elapsed_seconds": found.median,
        "least_seconds": found.least,
    }


def curve(
    case: Case, method: str, prepare: Any, tolerances: tuple[float, ...], budget: float
) -> list[dict[str, Any]]:
    """Points of one method."""
    truth = reference(case.name).answer
    rows = []
    for tolerance in tolerances:
        row: dict[str, Any] = {"method": method, "tolerance": tolerance}
        start = time.perf_counter()
        try:
            with limited(LIMIT):
                call = prepare(case, method, tolerance)
                answer = call()
                row["first_seconds"] = time.perf_counter() - start
                answer, times = timed(call, budget)
                row |= times
        except TimeoutError as late:
            print(
                f"({case.name}) {method} at {tolerance:.0e} broken off: {late}",
                file=sys.stderr,
            )
            break
        except (RuntimeError, ValueError, ArithmeticError, StopIteration) as failure:
            print(
                f"({case.name}) {method} at {tolerance:.0e} failed: {failure}",
                file=sys.stderr,
            )
            continue
        row["error_times"], row["error_state"] = error(case, answer, truth)
        row |= {"error": max(row["error_times"], row["error_state"])}
        row |= {"steps": int(answer.steps), "evaluations": int(answer.evaluations)}
        if not np.isfinite(row["error"]):
            print(
                f"({case.name}) {method} at {tolerance:.0e} missed an event",
                file=sys.stderr,
            )
            continue
        rows.append(row)
        if row["seconds"] > SLOW:
            break
    return rows


def measure(
    case: Case, modules: list[Any], tolerances: tuple[float, ...], budget: float
) -> dict[str, Any]:
    """One scene with all methods."""
    known = reference(case.name)
    rows: list[dict[str, Any]] = []
    left_out: dict[str, str] = {}
    faults: list[str] = []
    contenders = [("simbrake", ours.methods(case), ours.simbrake_runner, AGREES)]
    contenders += [
        (peer.NAME, peer.methods(case), peer.prepare, peer.AGREES) for peer in modules
    ]
    for _, methods, prepare, agrees in contenders:
        for method, why in methods.items():
            if why is not None:
                left_out[method] = why
                continue
            points = curve(case, method, prepare, tolerances, budget)
            best = min((p["error"] for p in points), default=np.inf)
            tightest = min((p["tolerance"] for p in points), default=0.0)
            # a run with few tolerances does not come as far; errors of many steps and
            # events add up
            allowed = max(agrees, 1e3 * tightest * max(1.0, len(case.events) / 3))
            if best > allowed:
                faults.append(
                    f"({case.name}) {method}: error {best:.1e} at best, {allowed:.0e} was expected"
                )
            rows += points
    scene = {
        "name": case.name,
        "title": case.title,
        "events": case.events,
        "state": case.state,
        "reference": {
            "method": known.method,
            "uncertainty": known.uncertainty,
            "times": known.answer.times.tolist(),
            "state": known.answer.state.tolist(),
        },
        "rows": rows,
        "left_out": left_out,
        "faults": faults,
    }
    return scene | {"equal_error": report.equal_error(scene)}


def of_scenes(names: list[str], options: argparse.Namespace) -> dict[str, Any]:
    """All tools on the scenes of the benchmark, printed; drawn and written into the
    documentation if asked for."""
    modules, missing = peers.available()
    found: dict[str, Any] = {"machine": machine(), "missing": missing, "scenes": {}}
    print("\n".join(f"missing: {line}" for line in missing))
    tolerances, budget = (QUICK, 0.05) if options.quick else (FULL, 0.5)
    for name in names:
        found["scenes"][name] = measure(CASES[name], modules, tolerances, budget)
        print(report.text(found["scenes"][name]), flush=True)
    if options.png:
        pictures.work_precision(found).savefig(options.png, dpi=100)
    return found


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--quick", action="store_true", help="few tolerances and short timings"
    )
    parser.add_argument(
        "--scenes",
        default=None,
        help=f"of {','.join(CASES)}; default: all, with --quick a,b",
    )
    parser.add_argument("--json", help="file for the numbers")
    parser.add_argument("--png", help="file for the chart")
    options = parser.parse_args()
    names = (options.scenes or ("a,b" if options.quick else ",".join(CASES))).split(",")
    if unknown := set(names) - set(CASES):
        parser.error(
            f"no scene {', '.join(sorted(unknown))}; there are {', '.join(CASES)}"
        )
    warnings.filterwarnings("ignore", message=".*divide.*|.*overflow.*")
    ours.configure()
    about = machine()
    print(f"{about['cpu']}, {about['cores']} cores, load {about['load']:.1f}")
    print(", ".join(f"{name} {number}" for name, number in about["versions"].items()))
    found = of_scenes(names, options)
    if options.json:
        pathlib.Path(options.json).write_text(
            json.dumps(found, separators=(",", ":")), "utf-8"
        )
    faults = [fault for scene in found["scenes"].values() for fault in scene["faults"]]
    print(
        "\n".join(["", *faults] if faults else ["", "all agree with their references"])
    )
    return bool(faults)


if __name__ == "__main__":
    sys.exit(main())
