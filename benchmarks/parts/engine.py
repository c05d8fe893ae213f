"""A prepared run against a bare loop of the same equations with as many evaluations, and the cost of an event."""

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

import simbrake as sb
from benchmarks.ours import event_times
from benchmarks.parts import bare
from benchmarks.parts.table import Column, Part, Target
from benchmarks.parts.timing import Times, interleaved, ratio
from benchmarks.reference import reference
from benchmarks.scenes import CASES

NAME = "engine"
TITLE = "a warm run against a bare loop with as many evaluations; an event in steps"
_TOLERANCE = 1e-8
_CASES = (("a", "Tsit5"), ("a", "Dopri8"), ("b", "Tsit5"), ("b", "Dopri8"), ("c", "Rodas5P"))
#: evaluations in a step after the first; Rodas5P: the columns of its Jacobian count as one
STAGES = {"Tsit5": 6, "Dopri8": 13, "Rodas5P": 8}

#: how far from an event a run ends, in the time since the last one: far enough to contain the short steps of a restart
_APART = 1e-3
_CLOSER = {
    ("b", "stop"): 1e-5,  # the band sticks again 4e-5 s before
    ("c", "full slip"): 1e-7,  # what the first micrometre does within 1e-7 s is no cost of the event
    ("c", "stop"): 1e-7,
}

COLUMNS = (
    Column("what", ""),
    Column("error", "error", ".1e"),
    Column("peer", "against"),
    Column("steps", "attempts", ".0f"),
    Column("seconds", "µs", ".1f", 1e6),
    Column("least", "least", ".1f", 1e6),
    Column("cpu", "CPU", ".1f", 1e6),
    Column("peer_cpu", "of the peer", ".1f", 1e6),
    Column("ratio", "ratio", ".2f"),
    Column("in_steps", "in steps", ".1f"),
)


def solver_named(name: str) -> Any:
    """A method by its name."""
    import diffrax

    return {"Tsit5": diffrax.Tsit5, "Dopri8": diffrax.Dopri8, "Rodas5P": sb.hybrid.Rodas5P}[name]()


class Warm(NamedTuple):
    """A prepared scene of the work–precision benchmark, its calls, and what its run costs in steps."""

    run: Any
    call: Callable[[], Any]
    attempts: int
    bare_steps: int
    error: float


@functools.cache
def warm(name: str, method: str, rtol: float = _TOLERANCE) -> Warm:
    """Prepares a scene and compares its event times with the reference."""
    import jax.numpy as jnp

    case = CASES[name]

    def times(result: Any) -> Any:
        return jnp.stack(event_times(result, case))

    run = sb.prepare(case.simbrake(), [times], solver=solver_named(method), rtol=rtol)
    answer = run()
    if answer.code:
        raise RuntimeError(f"({name}) {method} ends with {sb.results.FAILURES[answer.code][0]}")
    attempts = answer.accepted + answer.rejected + answer.retaken
    # a restart evaluates the rates twice: there, and for the length of the first step
    steps = round(attempts + 2 * answer.segments / STAGES[method])
    error = float(np.max(np.abs(answer.metrics["times"] / reference(name).answer.times - 1)))
    numbers = run.inputs(run.numbers, rtol)
    return Warm(run, lambda: np.asarray(run.program.call(numbers)), attempts, steps, error)


def _row(what: str, ours: Times, **more: Any) -> dict[str, Any]:
    return {"what": what, "seconds": ours.median, "least": ours.least, "cpu": ours.cpu_median} | more


def nothing(numbers: np.ndarray) -> Callable[[], Any]:
    """A call of a program that gives back some of its numbers: what a call costs by itself."""
    from simbrake._base._compiling import compiled

    call = compiled(lambda x: 2.0 * x, numbers).call
    return lambda: np.asarray(call(numbers))


def against_bare(name: str, method: str, budget: float) -> dict[str, Any]:
    """One scene with one method."""
    case, solver = CASES[name], solver_named(method)
    ready = warm(name, method)
    stretch = bare.longest(case.simbrake(), solver, _TOLERANCE)
    loops = bare.programs(case.simbrake(), solver, ready.bare_steps, stretch)
    calls = {"run": ready.call, "whole": ready.run, "nothing": nothing(ready.run.numbers), **loops}
    times = interleaved(calls, budget)
    best = min(loops, key=lambda way: times[way].cpu_median)
    row = _row(
        f"({name}) {method}",
        times["run"],
        error=ready.error,
        steps=ready.attempts,
        peer=f"bare loop, {best}",
        peer_cpu=times[best].cpu_median,
        ratio=ratio(times["run"], times[best], times["nothing"]),
    )
    idle = times["nothing"].cpu_median
    return row | {"nothing": idle, "python": times["whole"].cpu_median - times["run"].cpu_median}


def _ends(run: Any, at: float) -> Callable[[], Any]:
    """A call of the run ended at a time."""
    numbers = run.inputs(run.vector({"end_time": at}), run.rtol)
    return lambda: np.asarray(run.program.call(numbers))


def events(name: str, method: str, budget: float) -> list[dict[str, Any]]:
    """What a run costs more that ends just behind an event than one that ends just before it."""
    ready, case = warm(name, method), CASES[name]
    times = np.asarray(ready.run().metrics["times"])
    apart = np.diff(times, prepend=0.0) * [_CLOSER.get((name, event), _APART) for event in case.events]
    calls: dict[str, Callable[[], Any]] = {"run": ready.call, "nothing": nothing(ready.run.numbers)}
    for event, t, d in zip(case.events, times, apart, strict=True):
        calls |= {f"before {event}": _ends(ready.run, t - d), f"after {event}": _ends(ready.run, t + d)}
    found = interleaved(calls, budget)
    step = (found["run"].cpu_median - found["nothing"].cpu_median) / ready.attempts
    rows = []
    for event, t, d in zip(case.events, times, apart, strict=True):
        before, after = found[f"before {event}"], found[f"after {event}"]
        extra = float(np.median(np.asarray(after.cpu) - np.asarray(before.cpu)))
        ends = [ready.run({"end_time": at}) for at in (t - d, t + d)]
        work = [a.accepted + a.rejected + a.retaken for a in ends]
        row = {"what": f"({name}) {method}, {event}", "error": ready.error, "peer": "the same without it"}
        row |= {"steps": work[1] - work[0], "seconds": after.median - before.median, "cpu": extra}
        row |= {"least": after.least - before.least, "peer_cpu": before.cpu_median, "in_steps": extra / step}
        rows.append(row)
    return rows


def corners(budget: float, more: int = 16) -> dict[str, Any]:
    """A corner of the lever that is none: restarts at known times of a run whose answer they do not change."""
    p = CASES["a"].plain
    runs = []
    for count in (2, 2 + more):
        times = np.linspace(0.0, p.end, count)
        scene = CASES["a"].simbrake()
        duty = sb.Duty(sb.PiecewiseLinear(times, np.full(count, p.T_0)), scene.duty.load)
        scene = sb.Scene(scene.brake, duty, scene.initial, 0.9 * reference("a").answer.times[-1])
        runs.append(sb.prepare(scene, ["full_slip_time"], solver=solver_named("Dopri8"), rtol=_TOLERANCE))
    numbers = [run.inputs(run.numbers, run.rtol) for run in runs]
    calls = {
        str(i): lambda run=run, x=x: np.asarray(run.program.call(x))
        for i, (run, x) in enumerate(zip(runs, numbers, strict=True))
    }
    found = interleaved(calls | {"nothing": nothing(numbers[0])}, budget)
    answers = [run() for run in runs]
    work = [a.accepted + a.rejected + a.retaken for a in answers]
    passed = answers[1].segments - answers[0].segments
    step = (found["0"].cpu_median - found["nothing"].cpu_median) / work[0]
    extra = float(np.median(np.asarray(found["1"].cpu) - np.asarray(found["0"].cpu))) / passed
    error = max(abs(a.metrics["full_slip_time"] / reference("a").answer.times[1] - 1) for a in answers)
    row = {"what": "(a) Dopri8, corner of the lever", "error": error, "peer": "the same without corners"}
    row |= {"steps": (work[1] - work[0]) / passed, "cpu": extra, "peer_cpu": found["0"].cpu_median}
    return row | {"in_steps": extra / step}


def measure(quick: bool) -> Part:
    """All of it; `quick`: the short scene with one method."""
    budget = 0.3 if quick else 2.0
    pairs = (("a", "Dopri8"),) if quick else _CASES
    runs = [against_bare(name, method, budget) for name, method in pairs]
    around = [row for name, method in pairs for row in events(name, method, budget)]
    rows = [*runs, *around]
    if not quick:
        rows.append(corners(budget))
    targets = [Target(f"run in bare loops, {row['what']}", 2.0, row["ratio"]) for row in runs]
    targets += [Target(f"event in steps, {row['what']}", 5.0, row["in_steps"]) for row in around]
    idle, python = (np.median([row[key] for row in runs]) * 1e6 for key in ("nothing", "python"))
    notes = [
        f"ratio: of processor time, less {idle:.1f} µs that a call of an empty program takes",
        f"Python around it, for numbers by path and metrics by name, takes {python:.1f} µs more",
        "event: the run ended just behind it less the run ended just before it, one step more included",
    ]
    return Part(NAME, TITLE, COLUMNS, rows, targets, notes)
