"""Throughput of ensembles of stops, beside SciPy one run after the other and beside a bare loop over chunks.

The device column is filled where JAX finds an accelerator: its runs are made in a process of their own, as this one
has been told to look at the CPU alone.
"""

import dataclasses
import functools
import json
import os
import pathlib
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import jax
import numpy as np

import simbrake as sb
from benchmarks.parts import bare, stops
from benchmarks.parts.engine import STAGES, solver_named
from benchmarks.parts.table import Column, Part, Target
from benchmarks.parts.timing import interleaved
from benchmarks.peers import scipy_ivp
from benchmarks.scenes import CASES

NAME = "ensemble"
TITLE = "runs a second of many stops, rtol 1e-6"
_TOLERANCE, _METHOD, _CHUNK = 1e-6, "Tsit5", 64
_FRICTION = {"a": "brake.linings.friction.coefficient", "b": "brake.linings.friction.base.coefficient"}
_NAMES = ("full_slip_time", "stopping_time")
_SIZES, _QUICK = (100, 1_000, 10_000, 100_000), (100, 1_000)

COLUMNS = (
    Column("what", ""),
    Column("error", "error", ".1e"),
    Column("rate", "runs/s", ",.0f"),
    Column("core", "runs per core s", ",.0f"),
    Column("first", "first call s", ".1f"),
    Column("scipy", "× SciPy", ".0f"),
    Column("bare", "bare loop runs/s", ",.0f"),
    Column("share", "of the bare loop", ".2f"),
    Column("alone", "of its compiled chunks", ".2f"),
    Column("scaling", "× 1 worker", ".2f"),
    Column("device", "runs/s on a device", ",.0f"),
)


def drawn(name: str, count: int) -> dict[str, np.ndarray]:
    """Speeds, inertias and coefficients of friction of stops that all end within the run of a scene."""
    rng = np.random.default_rng(1)
    ranges = ((12.0, 20.0), (600.0, 800.0), (0.33, 0.40))
    paths = ("initial.omega", "brake.pulley.inertia", _FRICTION[name])
    return {path: rng.uniform(*ends, count) for path, ends in zip(paths, ranges, strict=True)}


def many(
    name: str, values: dict[str, np.ndarray], workers: int | None = None, chunk: int | None = None
) -> Callable[[], Any]:
    """A call of simbrake's ensemble."""
    scene, solver = CASES[name].simbrake(), solver_named(_METHOD)

    def call() -> Any:
        settings = {"rtol": _TOLERANCE, "solver": solver, "workers": workers, "chunk": chunk, "progress": False}
        data = sb.ensemble(scene, values, _NAMES, **settings)
        if np.any(data.code.values):
            raise RuntimeError("a run of the ensemble failed")
        return data

    return call


def single(name: str, row: Any, method: str, tolerance: float) -> Callable[[], Any]:
    """One of the runs by SciPy."""
    w_0, J, f = (float(x) for x in row)
    plain = dataclasses.replace(CASES[name].plain, w_0=w_0, J=J, f=f)
    return scipy_ivp.prepare(dataclasses.replace(CASES[name], plain=plain), method, tolerance)


def error(name: str, values: dict[str, np.ndarray], events: np.ndarray, sample: int = 16) -> float:
    """Largest relative error of the event times of some runs, against tight single runs by SciPy."""
    rows, worst = np.stack(list(values.values()), axis=1), 0.0
    for i in np.unique(np.linspace(0, len(events) - 1, sample).astype(int)):
        truth = single(name, rows[i], "SciPy DOP853", 1e-12)().times[-len(_NAMES) :]
        worst = max(worst, float(np.max(np.abs(events[i] / truth - 1))))
    return worst


def one_after_the_other(name: str, values: dict[str, np.ndarray], sample: int) -> dict[str, Any]:
    """SciPy on a few of the runs, with the faster of its explicit methods."""
    rows = np.stack(list(values.values()), axis=1)[:sample]
    calls = {
        method: [single(name, row, method, _TOLERANCE) for row in rows] for method in ("SciPy RK45", "SciPy DOP853")
    }
    times = interleaved({method: lambda s=s: [call() for call in s] for method, s in calls.items()}, 0.0, 3)
    best = min(times, key=lambda method: times[method].least)
    events = np.stack([call().times[-len(_NAMES) :] for call in calls[best]])
    row = {"what": f"({name}) {best}, {len(rows)} runs", "error": error(name, values, events)}
    return row | {"rate": len(rows) / times[best].least, "core": len(rows) / times[best].cpu_least}


@functools.cache
def _bare_program(like: Any, paths: tuple[str, ...], size: int) -> Any:
    """The bare loop over one chunk, compiled as the ensemble is."""
    from simbrake._base._compiling import compiled
    from simbrake._run._edit import with_values

    run = bare.loop("written out", solver_named(_METHOD))

    def whole(numbers: Any) -> Any:
        scene, rows, t, h, n, y, mode = like.unpack(numbers)

        def one(row: Any) -> Any:
            changed = with_values(scene, dict(zip(paths, row, strict=True)))
            return run(changed, t, h, n.astype(np.int32), y, mode.astype(np.int32))

        return jax.vmap(one)(rows)

    return compiled(whole, np.zeros(size)).call


@functools.cache
def _stretch(name: str) -> bare.Stretch:
    return bare.longest(CASES[name].simbrake(), solver_named(_METHOD), _TOLERANCE)


def bare_chunks(name: str, values: dict[str, np.ndarray], steps: int, threads: int) -> Callable[[], list[np.ndarray]]:
    """A call of the bare loop over chunks of the runs, `steps` steps each, on so many threads."""
    from simbrake._base._compiling import pack

    scene, stretch = CASES[name].simbrake(), _stretch(name)
    columns = np.stack(list(values.values()), axis=1)
    chunks = [columns[i : i + _CHUNK] for i in range(0, len(columns), _CHUNK)]
    chunks[-1] = np.concatenate([chunks[-1], np.repeat(chunks[-1][-1:], _CHUNK - len(chunks[-1]), axis=0)])
    rest = stretch.t, stretch.span / steps, float(steps), stretch.y, np.asarray(stretch.mode, np.float64)
    packed = [pack((scene, chunk, *rest)) for chunk in chunks]
    program = _bare_program(packed[0][1], tuple(values), packed[0][0].size)

    def call() -> list[np.ndarray]:
        with ThreadPoolExecutor(threads) as pool:
            return list(pool.map(lambda pair: np.asarray(program(pair[0])), packed))

    if not np.all(np.isfinite(call()[0])):
        raise RuntimeError("the bare loop leaves the numbers: its steps are too long to be stable")
    return call


def on_a_device(name: str, count: int) -> float | None:
    """Runs a second on an accelerator, in a process that may look for one; `None` where there is none."""
    root = str(pathlib.Path(__file__).resolve().parents[2])
    environment = {name: value for name, value in os.environ.items() if name not in ("JAX_PLATFORMS", "XLA_FLAGS")}
    path = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
    command = [sys.executable, "-m", "benchmarks.parts.ensemble", name, str(count)]
    done = subprocess.run(command, env=environment | {"PYTHONPATH": path}, capture_output=True, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def accelerated() -> bool:
    """Whether JAX could find something else than a CPU here."""
    from importlib.metadata import distributions

    return any((d.metadata["Name"] or "").startswith(("jax-cuda", "jax-rocm", "libtpu")) for d in distributions())


def row_of(name: str, count: int, workers: int, rounds: int) -> dict[str, Any]:
    """One size on so many threads."""
    values = drawn(name, count)
    ours = many(name, values, workers)
    start = time.perf_counter()
    data = ours()
    first = time.perf_counter() - start
    attempts = data.steps + data.rejected + data.retaken + 2 * data.segments / STAGES[_METHOD]
    steps = float(attempts.mean())
    found = interleaved({"ours": ours, "bare": bare_chunks(name, values, round(steps), workers)}, 0.0, rounds)
    rate, core = count / found["ours"].least, count / found["ours"].cpu_least
    loops = count / found["bare"].least
    threads = "1 worker" if workers == 1 else f"{workers} workers"
    events = np.stack([data[metric].values for metric in _NAMES], axis=1)
    row = {
        "what": f"({name}) {count:,} runs, {threads}",
        "error": error(name, values, events),
        "steps": steps,
        "first": first,
    }
    row |= {"rate": rate, "core": core, "bare": loops, "share": rate / loops}
    return row | {"size": count, "curve": threads, "value": rate}


def chunks_alone(ours: Callable[[], Any]) -> Callable[[], list[np.ndarray]]:
    """The calls of compiled programs that a call of the ensemble makes, and nothing else."""
    from simbrake.studies import _evaluator

    calls, find = list[tuple[Callable[[Any], Any], np.ndarray]](), _evaluator._integrator

    def watched(*arguments: Any) -> Any:
        program = find(*arguments)

        def call(numbers: np.ndarray) -> Any:
            calls.append((program.call, numbers))
            return program.call(numbers)

        return program._replace(call=call)

    _evaluator._integrator = watched
    try:
        ours()
    finally:
        _evaluator._integrator = find
    return lambda: [np.asarray(call(numbers)[0]) for call, numbers in calls]


def end_to_end(name: str, count: int, slow: dict[str, Any], workers: int, rounds: int) -> dict[str, Any]:
    """The ensemble on one core against its compiled chunks alone, against SciPy, and against all workers."""
    values = drawn(name, count)
    ours = many(name, values, 1)
    events = np.stack([ours()[metric].values for metric in _NAMES], axis=1)
    calls = {"ours": ours, "alone": chunks_alone(ours), "all": many(name, values, workers)}
    found = interleaved(calls, 0.0, rounds)
    core = count / found["ours"].cpu_least
    row = {"what": f"({name}) {count:,} runs, end to end on one core", "error": error(name, values, events)}
    row |= {"rate": count / found["ours"].least, "core": core, "scipy": core / slow["core"]}
    row |= {"alone": found["alone"].cpu_least / found["ours"].cpu_least}
    return row | {"scaling": found["ours"].least / found["all"].least}


def _limits(row: dict[str, Any], times: float, workers: int) -> list[Target]:
    """What is wanted of a row of `end_to_end`."""
    return [
        Target(f"share of its compiled chunks, {row['what']}", 0.8, row["alone"], least=True),
        Target(f"times SciPy on one core, {row['what']}", times, row["scipy"], least=True),
        Target(f"{workers} workers against 1, {row['what']}", 0.75 * workers, row["scaling"], least=True),
    ]


def measure(quick: bool) -> Part:
    """All sizes, one worker and all; `quick`: few runs of the scene without heat."""
    from simbrake.studies._chunks import thread_count

    sizes, workers = (_QUICK if quick else _SIZES), sorted({1, thread_count()})
    name = "a" if quick else "b"
    slow = one_after_the_other(name, drawn(name, sizes[0]), 10 if quick else 40)
    rows = [row_of(name, count, some, 5 if count <= 10_000 else 1) for count in sizes for some in workers]
    for row in rows:
        row["scipy"] = row["rate"] / slow["rate"]
        if row["curve"] == rows[-1]["curve"] and accelerated():
            row["device"] = on_a_device(name, row["size"])
    last, notes = rows[-1], [f"{_METHOD}, chunks of {_CHUNK}; SciPy one run after the other with its faster method"]
    notes += [
        "error: largest relative one of two event times in 16 of the runs, against tight single runs by SciPy",
        "bare loop: as many steps as the runs take on average, in chunks of the same size on as many threads",
        "of its compiled chunks: processor time of the same calls of the same programs, with nothing around them",
        "rates are the best of several rounds",
    ]
    rows.insert(0, slow)
    whole = []
    for which, count, times in (("a", 100_000, 100.0), ("b", 10_000, 80.0)):
        if not quick or which == name:
            peer = slow if which == name else one_after_the_other(which, drawn(which, 100), 40)
            rows += [] if which == name else [peer]
            rows.append(end_to_end(which, 10_000 if quick else count, peer, workers[-1], 3))
            whole += _limits(rows[-1], times, workers[-1])
    if not quick:
        rows += [row for rtol in (1e-6, 1e-10) for row in stops.rows(10_000, rtol)]
        alike, unequal = stops.order(10_000)
        notes.append("(a): error of every run, against the closed form")
        notes.append(f"unsorted, stops take {alike:.2f} times the processor time, runs of unequal length {unequal:.2f}")
    reached = max(last["rate"] / 120_000.0, last["share"] / 0.8)
    targets = [
        *whole,
        # the one or the other
        Target(f"rate over 120,000 runs/s or 80 % of the bare loop, {last['what']}", 1.0, reached, least=True),
    ]
    return Part(NAME, TITLE, COLUMNS, rows, targets, notes)


if __name__ == "__main__":
    name, runs, best = sys.argv[1], int(sys.argv[2]), None
    if jax.devices()[0].platform != "cpu":
        sample = drawn(name, runs)
        best = runs / interleaved({"": many(name, sample)}, 0.0, 3)[""].least
    print(json.dumps(best))
