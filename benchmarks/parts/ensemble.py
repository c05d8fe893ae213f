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
from benchmarks.parts import bare
from benchmarks.parts.engine import STAGES, solver_named
from benchmarks.parts.table import Column, Part, Target
from benchmarks.peers import scipy_ivp
from benchmarks.scenes import CASES

NAME = "ensemble"
TITLE = "runs a second of many stops with a rim of 20 layers and fade, scene (b), rtol 1e-6"
_TOLERANCE, _METHOD, _CHUNK = 1e-6, "Tsit5", 64
#: of an accelerator: enough runs side by side to fill it
_DEVICE_CHUNK = 16_384
_PATHS = ("initial.omega", "brake.pulley.inertia", "brake.linings.friction.base.coefficient")
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
    Column("device", "runs/s on a device", ",.0f"),
)


def drawn(count: int) -> dict[str, np.ndarray]:
    """Speeds, inertias and coefficients of friction of stops that all end within the run."""
    rng = np.random.default_rng(1)
    ranges = ((12.0, 20.0), (600.0, 800.0), (0.33, 0.40))
    return {path: rng.uniform(*ends, count) for path, ends in zip(_PATHS, ranges, strict=True)}


def timed(call: Callable[[], Any], times: int) -> tuple[Any, float, float, float]:
    """Answer, least wall and processor time of warm calls, and the wall time of the first."""
    start = time.perf_counter()
    answer = call()
    first = time.perf_counter() - start
    walls, cores = [], []
    for _ in range(times):
        wall, core = time.perf_counter(), time.process_time()
        answer = call()
        walls.append(time.perf_counter() - wall)
        cores.append(time.process_time() - core)
    return answer, min(walls), min(cores), first


def many(values: dict[str, np.ndarray], workers: int | None, times: int, chunk: int = _CHUNK) -> dict[str, Any]:
    """simbrake's ensemble: event times, rates, mean number of step attempts and restarts."""

    def call() -> Any:
        return sb.ensemble(
            CASES["b"].simbrake(),
            values,
            _NAMES,
            rtol=_TOLERANCE,
            solver=solver_named(_METHOD),
            workers=workers,
            chunk=chunk,
            progress=False,
        )

    data, wall, core, first = timed(call, times)
    if np.any(data.code.values):
        raise RuntimeError("a run of the ensemble failed")
    count = len(values[_PATHS[0]])
    work = data.steps + data.rejected + data.retaken + 2 * data.segments / STAGES[_METHOD]
    found = {"events": np.stack([data[name].values for name in _NAMES], axis=1), "steps": float(work.mean())}
    return found | {"rate": count / wall, "core": count / core, "first": first}


@functools.cache
def _tight() -> Any:
    return sb.prepare(CASES["b"].simbrake(), _NAMES, solver=solver_named("Dopri8"), rtol=1e-11)


def error(values: dict[str, np.ndarray], events: np.ndarray, sample: int = 16) -> float:
    """Largest relative error of the event times of some runs, against single runs at 1e-11 with another method."""
    chosen = np.unique(np.linspace(0, len(events) - 1, sample).astype(int))
    worst = 0.0
    for i in chosen:
        truth = _tight()({path: column[i] for path, column in values.items()}).metrics
        worst = max(worst, float(np.max(np.abs(events[i] / [truth[name] for name in _NAMES] - 1))))
    return worst


def one_after_the_other(values: dict[str, np.ndarray], sample: int) -> dict[str, Any]:
    """SciPy on a few of the runs, with the faster of its explicit methods."""
    rows = list(zip(*(values[path][:sample] for path in _PATHS), strict=True))
    best: dict[str, Any] = {"rate": 0.0}
    for method in ("SciPy RK45", "SciPy DOP853"):
        calls = []
        for w_0, J, f in rows:
            plain = dataclasses.replace(CASES["b"].plain, w_0=float(w_0), J=float(J), f=float(f))
            calls.append(scipy_ivp.prepare(dataclasses.replace(CASES["b"], plain=plain), method, _TOLERANCE))
        calls[0]()
        wall, core = time.perf_counter(), time.process_time()
        events = np.stack([call().times for call in calls])
        rates = {"rate": len(rows) / (time.perf_counter() - wall), "core": len(rows) / (time.process_time() - core)}
        if rates["rate"] > best["rate"]:
            best = {"what": f"{method}, {len(rows)} runs", "error": error(values, events)} | rates
    return best


@functools.cache
def _bare_program(like: Any, size: int) -> Any:
    """The bare loop over one chunk, compiled as the ensemble is."""
    from simbrake._compiling import compiled
    from simbrake._edit import with_values

    run = bare.loop("written out", solver_named(_METHOD))

    def whole(numbers: Any) -> Any:
        scene, rows, t, h, n, y, mode = like.unpack(numbers)

        def one(row: Any) -> Any:
            changed = with_values(scene, dict(zip(_PATHS, row, strict=True)))
            return run(changed, t, h, n.astype(np.int32), y, mode.astype(np.int32))

        return jax.vmap(one)(rows)

    return compiled(whole, np.zeros(size)).call


@functools.cache
def _stretch() -> bare.Stretch:
    return bare.longest(CASES["b"].simbrake(), solver_named(_METHOD), _TOLERANCE)


def bare_chunks(values: dict[str, np.ndarray], steps: int, threads: int) -> Callable[[], list[np.ndarray]]:
    """A call of the bare loop over chunks of the runs, `steps` steps each, on so many threads."""
    from simbrake._compiling import pack

    scene, stretch = CASES["b"].simbrake(), _stretch()
    columns = np.stack([values[path] for path in _PATHS], axis=1)
    chunks = [columns[i : i + _CHUNK] for i in range(0, len(columns), _CHUNK)]
    chunks[-1] = np.concatenate([chunks[-1], np.repeat(chunks[-1][-1:], _CHUNK - len(chunks[-1]), axis=0)])
    rest = stretch.t, stretch.span / steps, float(steps), stretch.y, np.asarray(stretch.mode, np.float64)
    packed = [pack((scene, chunk, *rest)) for chunk in chunks]
    program = _bare_program(packed[0][1], packed[0][0].size)

    def call() -> list[np.ndarray]:
        with ThreadPoolExecutor(threads) as pool:
            return list(pool.map(lambda pair: np.asarray(program(pair[0])), packed))

    if not np.all(np.isfinite(call()[0])):
        raise RuntimeError("the bare loop leaves the numbers: its steps are too long to be stable")
    return call


def on_a_device(count: int) -> float | None:
    """Runs a second on an accelerator, in a process that may look for one; `None` where there is none."""
    root = str(pathlib.Path(__file__).resolve().parents[2])
    environment = {name: value for name, value in os.environ.items() if name not in ("JAX_PLATFORMS", "XLA_FLAGS")}
    path = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
    command = [sys.executable, "-m", "benchmarks.parts.ensemble", str(count)]
    done = subprocess.run(command, env=environment | {"PYTHONPATH": path}, capture_output=True, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def accelerated() -> bool:
    """Whether JAX could find something else than a CPU here."""
    from importlib.metadata import distributions

    return any((d.metadata["Name"] or "").startswith(("jax-cuda", "jax-rocm", "libtpu")) for d in distributions())


def measure(quick: bool) -> Part:
    """All sizes, one worker and all."""
    from simbrake._distribute import Threads

    sizes, cores = (_QUICK if quick else _SIZES), Threads().workers
    slow = one_after_the_other(drawn(sizes[0]), 10 if quick else 40)
    rows, device = [slow], accelerated()
    for count in sizes:
        values, times = drawn(count), 5 if count <= 10_000 else 2
        for workers in sorted({1, cores}):
            found = many(values, workers, times)
            bare_wall = timed(bare_chunks(values, round(found["steps"]), workers), times)[1]
            threads = "1 worker" if workers == 1 else f"{workers} workers"
            row = {"what": f"{count:,} runs, {threads}", "error": error(values, found["events"])}
            row |= {name: found[name] for name in ("rate", "core", "first")}
            row |= {"scipy": found["rate"] / slow["rate"], "bare": count / bare_wall}
            row["share"] = row["rate"] / row["bare"]
            rows.append(row)
        rows[-1]["device"] = on_a_device(count) if device else None
    last = rows[-1]
    targets = [
        Target(f"runs/s, {last['what']}", 120_000.0, last["rate"], least=True),
        Target(f"share of the bare loop over chunks, {last['what']}", 0.8, last["share"], least=True),
        Target(f"times SciPy, {last['what']}", 100.0, last["scipy"], least=True),
    ]
    notes = [
        f"{_METHOD}, chunks of {_CHUNK}; SciPy one run after the other on the number of runs given, its faster method",
        "error: largest relative one of two event times in 16 of the runs, against single runs at 1e-11 with Dopri8",
        f"bare loop: {found['steps']:.1f} steps for each run, the mean of what the runs take",
        "runs/s or the share of the bare loop is wanted, not both",
    ]
    return Part(NAME, TITLE, COLUMNS, rows, targets, notes)


if __name__ == "__main__":
    jax.config.update("jax_enable_x64", True)
    runs = int(sys.argv[1])
    away = jax.devices()[0].platform != "cpu"
    print(json.dumps(many(drawn(runs), None, 3, min(runs, _DEVICE_CHUNK))["rate"] if away else None))
