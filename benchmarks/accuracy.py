"""Estimated beside true errors of runs: `Result.accuracy()` over the benchmark's scenes
and random ones.

`python benchmarks/accuracy.py [--seed 1] [--count 60] [--rtol 1e-10,1e-3] [--scenes
abcdef] [--verify 3] [--json F]`

A case is one metric, energy, time of an event or kind of states of one run. Its true
error is the difference to a run at rtol 1e-13 with shorter steps. That run is compared
with references that share nothing with the integrator: closed forms and collocation of
order 23 (benchmarks/reference.py) for the benchmark's scenes, the independent models
(tests/oracles/independent) for the first `--verify` random ones. Random scenes are
drawn by the seed from every kind of brake and flavour of
tests/oracles/independent/draws.py.

Printed are, of all cases at each tolerance, how many have
`true ≤ 3 estimate + 1e-13 scale` (at least 95 % should) and
`estimate ≤ 100 true + 1e-12 scale` (at least 80 %). The scale is the value; of times at
least 1e-3 of the run, of energies the largest one, of states the largest value of their
kind. A run whose sequence of events is not that of the tight one should have no
estimate. Exit code 1 if a share is too low, or where an estimate is given and should
not be.
"""

import argparse
import itertools
import json
import os
import pathlib
import sys
from typing import Any, NamedTuple

os.environ.setdefault("JAX_PLATFORMS", "cpu")
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "tests"))

import numpy as np
from oracles.independent.compare import compare
from oracles.independent.draws import FLAVOURS, KINDS, draw, scene

import simbrake as sb
from benchmarks.ours import event_times, final_state
from benchmarks.reference import error, reference
from benchmarks.scenes import CASES, Answer
from simbrake.runs.accuracy import difference, longest_step

#: shares of the cases in which an estimate should be neither too small nor too large
LEAST_SAFE = 0.95
LEAST_SHARP = 0.80


class Row(NamedTuple):
    """One case: its scale, true and estimated error."""

    name: str
    scale: float
    true: float
    estimate: float

    @property
    def safe(self) -> bool:
        return self.true <= 3 * self.estimate + 1e-13 * self.scale

    @property
    def sharp(self) -> bool:
        return self.estimate <= 100 * self.true + 1e-12 * self.scale


class Judged(NamedTuple):
    """One scene at one tolerance: its cases, whether there is an estimate, and whether
    there should be one."""

    name: str
    rtol: float
    rows: list[Row]
    given: bool
    due: bool


def tight(problem: sb.Scene) -> sb.results.Result:
    """The run from which true errors are counted: the first of three tight ones whose
    events another one has too."""
    first = sb.simulate(problem, rtol=1e-13, throw=False)
    longest = longest_step(first.record)
    runs = [
        sb.simulate(problem, rtol=1e-13, max_step=share * longest, throw=False)
        for share in (1.3, 1.1, 0.9)
    ]
    for one, other in itertools.combinations([run for run in runs if run.ok], 2):
        if not difference(one, other).problem:
            return one
    return runs[0]


def judged(
    name: str, problem: sb.Scene, truth: sb.results.Result, rtol: float
) -> Judged:
    """The cases of a scene at one tolerance."""
    result = sb.simulate(problem, rtol=rtol, throw=False)
    if not (result.ok and truth.ok):
        return Judged(name, rtol, [], False, False)
    found = result.accuracy()
    apart = difference(result, truth)
    if found.problem or apart.problem:
        return Judged(name, rtol, [], not found.problem, not apart.problem)
    times = np.asarray(result.record.rows.t)
    instant = 1e-3 * float(times[int(result.record.count)] - times[0])
    energy = max(
        abs(float(one.value or 0.0)) for one in found.metrics if one.unit == "J"
    )
    rows = []
    for one, other in zip(found.metrics, apart.metrics, strict=True):
        true = other.error
        if one.value is not None and one.error is not None and true is not None:
            size = abs(float(one.value))
            scale = {"s": max(size, instant), "J": energy}.get(one.unit, size)
            # `truth` has the same layers
            rows.append(Row(one.name, scale, true, one.error - (one.layers or 0.0)))
    for event, other in zip(found.events, apart.events, strict=True):
        size = max(abs(event.value), instant)
        rows.append(
            Row(f"event {event.name}", size, other.error, event.error - event.layers)
        )
    for one, other in zip(found.states, apart.states, strict=True):
        rows.append(
            Row(f"state {one.name}", other.value, other.error, one.error - one.layers)
        )
    return Judged(name, rtol, rows, True, True)


def text(one: Judged) -> str:
    """A line about a scene."""
    head = f"{one.name:38} rtol {one.rtol:7.0e}"
    if not one.rows:
        if one.given:
            return f"{head}  WRONG: an estimate, although the events of the tight run are others"
        return (
            f"{head}  no estimate, "
            f"{'although the events are the same' if one.due else 'as the events differ'}"
        )
    ratio = [
        row.estimate / row.true for row in one.rows if row.true > 1e-13 * row.scale
    ]
    shown = (
        f"estimate/true {min(ratio):.2g}…{max(ratio):.2g}, median {np.median(ratio):.3g}"
        if ratio
        else "rounding"
    )
    unsafe, blunt = (
        [r for r in one.rows if not ok(r)]
        for ok in (lambda r: r.safe, lambda r: r.sharp)
    )
    named = "".join(
        f"\n    {what}: {r.name} true {r.true:.2e} estimate {r.estimate:.2e} scale {r.scale:.2e}"
        for what, rows in (("too small", unsafe), ("too large", blunt))
        for r in rows[:3]
    )
    return (
        f"{head}  {len(one.rows):4} cases, {len(unsafe)} too small, {len(blunt)} "
        f"too large; {shown}{named}"
    )


def share(rows: list[Row], which: str) -> float:
    """The share of the cases for which a property holds."""
    return float(np.mean([getattr(row, which) for row in rows])) if rows else 1.0


def drawn(seed: int, count: int) -> list[tuple[str, str, int]]:
    """Kinds, flavours and seeds of random scenes: every pair as often, one after the
    other as they share a program."""
    rng = np.random.default_rng(seed)
    pairs = [(kind, flavour) for kind in KINDS for flavour in FLAVOURS]
    order = rng.permutation(len(pairs))
    seeds = rng.integers(10_000, 10**9, count)
    places = sorted(i % len(pairs) for i in range(count))
    return [
        (*pairs[order[place]], int(one))
        for place, one in zip(places, seeds, strict=True)
    ]


def distance_to_reference(name: str, truth: sb.results.Result) -> float:
    """Error of the tight run of a benchmark scene, in the measure of the benchmark."""
    times = np.asarray([float(t) for t in event_times(truth, CASES[name])])
    return max(
        error(
            CASES[name],
            Answer(times, np.asarray(final_state(truth)), 0, 0),
            reference(name).answer,
        )
    )


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seed", type=int, default=1, help="of the random scenes")
    parser.add_argument("--count", type=int, default=60, help="random scenes")
    parser.add_argument(
        "--rtol", default="1e-10,1e-3", help="tolerances of the runs that are judged"
    )
    parser.add_argument("--scenes", default="abcdef", help="scenes of the benchmark")
    parser.add_argument(
        "--verify",
        type=int,
        default=3,
        help="random scenes that the independent models run as well",
    )
    parser.add_argument("--json", help="file for the numbers")
    options = parser.parse_args()
    tolerances = [float(x) for x in options.rtol.split(",")]
    found: list[Judged] = []

    def take(name: str, problem: sb.Scene) -> Any:
        truth = tight(problem)
        for rtol in tolerances:
            found.append(judged(name, problem, truth, rtol))
            print(text(found[-1]), flush=True)
        return truth

    wrong = False
    try:
        for name in options.scenes:
            away = distance_to_reference(
                name, take(f"benchmark ({name})", CASES[name].simbrake())
            )
            print(
                f"    its tight run is {away:.1e} from {reference(name).method}",
                flush=True,
            )
        for i, (kind, flavour, seed) in enumerate(drawn(options.seed, options.count)):
            take(f"{kind}, {flavour}, seed {seed}", scene(draw(kind, flavour, seed)))
            if i < options.verify:
                other = compare(kind, flavour, seed)
                wrong |= bool(other.differs)
                agrees = other.differs or "agrees"
                print(
                    f"    independent model: {agrees}, times {other.times:.1e} s, ends "
                    f"{other.states:.1e}",
                    flush=True,
                )
    except KeyboardInterrupt:
        print("interrupted: totals so far")
    for rtol in tolerances:
        here = [one for one in found if one.rtol == rtol]
        rows = [row for one in here for row in one.rows]
        safe = share(rows, "safe")
        sharp = share(rows, "sharp")
        false = sum(one.given and not one.due for one in here)
        none = sum(not one.given for one in here)
        needless = sum(one.due and not one.given for one in here)
        wrong |= safe < LEAST_SAFE or sharp < LEAST_SHARP or false > 0
        print(
            f"rtol {rtol:.0e}: {len(here)} scenes, {len(rows)} cases; true ≤ 3 "
            f"estimate + 1e-13 scale in {100 * safe:.2f} %, estimate ≤ 100 true + "
            f"1e-12 scale in {100 * sharp:.2f} %; no estimate in {none} scenes, "
            f"{needless} of them without need; {false} estimates of other events"
        )
    if options.json:
        data = [
            {**one._asdict(), "rows": [row._asdict() for row in one.rows]}
            for one in found
        ]
        pathlib.Path(options.json).write_text(json.dumps(data, indent=1), "utf-8")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
