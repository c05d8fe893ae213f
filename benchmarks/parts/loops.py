"""The same stop again and again from Python: a prepared run beside heyoka's; `simulate` and `jax.jit` beside it."""

import importlib.util
import itertools
from collections.abc import Callable
from typing import Any

import jax
import numpy as np

import simbrake as sb
from benchmarks.parts.engine import solver_named, warm
from benchmarks.parts.table import Column, Part, Target
from benchmarks.parts.timing import Times, interleaved, ratio
from benchmarks.peers import heyoka_taylor
from benchmarks.reference import error, reference
from benchmarks.scenes import CASES

NAME = "loops"
TITLE = "one stop after the other from Python, rtol 1e-8"
_TOLERANCE = 1e-8
_METHODS = ("Tsit5", "Dopri8")
#: limits of a prepared run over heyoka's
_BESIDE = {"a": 3.0, "b": 4.0}
#: limits of other ways to run over a prepared run, on scene (a)
_WAYS = {"simulate": 8.0, "jax.jit": 4.0}

COLUMNS = (
    Column("what", ""),
    Column("error", "error", ".1e"),
    Column("seconds", "µs", ".1f", 1e6),
    Column("least", "least", ".1f", 1e6),
    Column("cpu", "CPU", ".1f", 1e6),
    Column("peer", "against"),
    Column("peer_error", "its error", ".1e"),
    Column("peer_cpu", "its CPU", ".1f", 1e6),
    Column("ratio", "ratio", ".2f"),
)


def _row(what: str, ours: Times, peer: str, theirs: Times, **more: Any) -> dict[str, Any]:
    row = {"what": what, "seconds": ours.median, "least": ours.least, "cpu": ours.cpu_median, "peer": peer}
    return row | {"peer_cpu": theirs.cpu_median, "ratio": ratio(ours, theirs)} | more


def beside_heyoka(name: str, budget: float) -> list[dict[str, Any]]:
    """A prepared run with each method, whole calls from Python, and heyoka's on the equations of its modes."""
    case, runs = CASES[name], {method: warm(name, method, _TOLERANCE) for method in _METHODS}
    theirs = heyoka_taylor.prepare(case, "heyoka Taylor", _TOLERANCE)
    wrong = error(case, theirs(), reference(name).answer)[0]
    times = interleaved({method: ready.run for method, ready in runs.items()} | {"heyoka": theirs}, budget)
    return [
        _row(
            f"({name}) prepared, {method}",
            times[method],
            "heyoka",
            times["heyoka"],
            error=ready.error,
            peer_error=wrong,
        )
        for method, ready in runs.items()
    ]


def ways(name: str, method: str, budget: float) -> list[dict[str, Any]]:
    """Runs with another speed each time: by `simulate`, in a jitted function of the user's, prepared."""
    scene, solver, ready = CASES[name].simbrake(), solver_named(method), warm(name, method, _TOLERANCE)
    room = ready.run.max_steps
    speeds = itertools.cycle(scene.initial.omega * np.linspace(0.99, 1.0, 16))

    def at(omega: Any) -> sb.Scene:
        initial = sb.Initial(omega, scene.initial.elongation)
        return sb.Scene(scene.brake, scene.duty, initial, scene.end_time, scene.heat)

    def time(omega: Any) -> Any:
        return sb.simulate(at(omega), solver=solver, rtol=_TOLERANCE, max_steps=room).stopping_time

    inside = jax.jit(time)
    calls: dict[str, Callable[[], Any]] = {
        "prepared": lambda: ready.run({"initial.omega": next(speeds)}),
        "simulate": lambda: sb.simulate(at(next(speeds)), solver=solver, rtol=_TOLERANCE),
        "jax.jit": lambda: jax.block_until_ready(inside(next(speeds))),
    }
    truth = reference(name).answer.times[-1]
    found = {"simulate": sb.simulate(scene, solver=solver, rtol=_TOLERANCE).stopping_time}
    found["jax.jit"] = inside(scene.initial.omega)
    times = interleaved(calls, budget, batch=0.02)  # a loop of each, as its callers write it
    common = {"peer": "prepared run", "peer_error": ready.error}
    return [
        _row(f"({name}) {way}, {method}", times[way], theirs=times["prepared"], **common)
        | {"error": abs(float(found[way]) / truth - 1), "way": way}
        for way in _WAYS
    ]


def measure(quick: bool) -> Part:
    """All of it; `quick`: scene (a)."""
    budget, names = (0.3, ["a"]) if quick else (2.0, list(_BESIDE))
    rows, targets, notes = [], [], []
    if importlib.util.find_spec("heyoka") is None:
        notes.append(f"heyoka is not installed: pip install {heyoka_taylor.PIP}")
    else:
        for name in names:
            found = beside_heyoka(name, budget)
            best = min(found, key=lambda row: row["cpu"])
            targets.append(Target(f"{best['what']}, over heyoka", _BESIDE[name], best["ratio"], error=best["error"]))
            rows += found
    for name in names:
        around = ways(name, "Dopri8", budget)
        rows += around
        if name == "a":
            targets += [
                Target(f"{row['what']}, over a prepared run", _WAYS[row["way"]], row["ratio"], error=row["error"])
                for row in around
            ]
    notes += [
        "ratio: of processor time of whole calls from Python, median over rounds in turn; error: of event times",
        "heyoka: modes written out by hand, without energy balance and record; from the same loop in Python",
    ]
    return Part(NAME, TITLE, COLUMNS, rows, targets, notes)
