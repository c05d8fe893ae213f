"""Many runs: chunks on threads of this machine or workers of a Dask cluster, kept in a folder, repeated with longer
records where these were too short."""

import dataclasses
import functools
import hashlib
import itertools
import json
import math
import os
import queue
import sys
import types
import zipfile
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from importlib.metadata import version
from pathlib import Path
from typing import Any
from uuid import uuid4

import jax
import numpy as np

from .._base._faults import Fault, InputError
from .._base._progress import Progress
from .._base._quantity import Quantity, leaves
from .._parts._scene import Scene
from .._run._choice import stiffness
from .._run._edit import with_values
from .._run._measure import Metric, name_of
from .._run._simulate import solver_for
from ..hybrid import Code
from ._evaluator import ABOUT, Job, Paths, limits_of_many, place_of, run_chunk

NOT_RUN = -1
#: rows of all records of a chunk together: with some hundred columns half a gigabyte
_ROWS = 2**19
#: of the manifest
_FORMAT = 1
_RIDGE = 1e-6


def fingerprint(*parts: Any) -> str:
    """A hash of values, structures and functions that is the same in every process."""
    digest = hashlib.sha256()
    _feed(digest.update, parts)
    return digest.hexdigest()


def _feed(update: Any, part: Any) -> None:
    if isinstance(part, jax.Array | np.ndarray | np.generic | float | int):
        array = np.asarray(part)
        update(f"{array.dtype.str}{array.shape}".encode() + array.tobytes())
    elif isinstance(part, types.FunctionType):
        update(f"{part.__module__}.{part.__qualname__}".encode() + part.__code__.co_code)
        inner = [c.cell_contents for c in part.__closure__ or ()]
        _feed(update, [part.__defaults__, inner, part.__code__.co_names, *_constants(part.__code__)])
    elif dataclasses.is_dataclass(part) and not isinstance(part, type):
        update(type(part).__qualname__.encode())
        _feed(update, {field.name: getattr(part, field.name, None) for field in dataclasses.fields(part)})
    elif isinstance(part, dict):
        _feed(update, [*part.items()])
    elif isinstance(part, tuple | list):
        update(f"({len(part)}".encode())
        for one in part:
            _feed(update, one)
    elif part is None or isinstance(part, str | bytes):
        update(repr(part).encode())
    else:
        named = getattr(part, "__qualname__", None)
        update((named or type(part).__qualname__).encode())


def _constants(code: types.CodeType) -> list[Any]:
    """Constants of a function, those of functions inside it as well."""
    found: list[Any] = []
    for constant in code.co_consts:
        found += [constant.co_code, *_constants(constant)] if isinstance(constant, types.CodeType) else [constant]
    return [c for c in found if c is None or isinstance(c, str | bytes | float | int | tuple)]


class Store:
    """A folder with a manifest and a file for every finished chunk, each written whole or not at all."""

    def __init__(self, folder: Path, key: str, about: dict[str, Any] | None):
        self.folder, self.key = Path(folder), key
        if self.folder.exists() and not self.folder.is_dir():
            raise InputError([Fault("directory", f"{folder} is a file", "give a folder")])
        manifest = self.folder / "manifest.json"
        if manifest.exists():
            self._compare(manifest, key, about or {})
            return
        if about is None:
            raise InputError([Fault("directory", f"{manifest} is not there")])
        if self.folder.is_dir() and any(self.folder.iterdir()):
            what = f"{folder} holds other files and no manifest of an ensemble"
            raise InputError([Fault("directory", what, "give a new or an empty folder")])
        self.folder.mkdir(parents=True, exist_ok=True)
        text = json.dumps({"format": _FORMAT, "fingerprint": key, **about}, indent=2)
        self._replace(manifest, lambda file: file.write(text.encode() + b"\n"))

    def _compare(self, manifest: Path, key: str, about: dict[str, Any]) -> None:
        try:
            there = json.loads(manifest.read_text("utf-8"))
        except (OSError, ValueError) as error:
            fault = Fault("directory", f"{manifest} cannot be read: {error}", "give another folder")
            raise InputError([fault]) from error
        if there.get("fingerprint") == key and there.get("format") == _FORMAT:
            return
        differ = [name for name, value in about.items() if there.get(name) != value]
        what = ", ".join(differ) or "numbers or structure of the scene, or the values"
        hint = "give another folder, or remove this one if its runs are no longer wanted"
        raise InputError([Fault("directory", f"{self.folder} holds another ensemble: {what} differ", hint)])

    def _replace(self, file: Path, write: Any) -> None:
        scratch = file.with_name(f".{file.name}.{uuid4().hex[:8]}")
        try:
            with open(scratch, "wb") as out:
                write(out)
                out.flush()
                os.fsync(out.fileno())
            os.replace(scratch, file)
        finally:
            scratch.unlink(missing_ok=True)

    def _file(self, runs: np.ndarray, limit: int) -> Path:
        mark = hashlib.sha256(np.asarray(runs, np.int64).tobytes() + str(limit).encode()).hexdigest()[:16]
        return self.folder / f"chunk-{int(runs[0]):08d}-{mark}.npz"

    def write(self, runs: np.ndarray, limit: int, columns: dict[str, np.ndarray], final: np.ndarray) -> None:
        """Keeps the numbers of a chunk; `final` marks the runs that are not repeated with a higher limit."""
        file = self._file(runs, limit)
        if not file.exists():
            arrays: dict[str, Any] = {"run": runs, "final": final, **{f"_{name}": c for name, c in columns.items()}}
            self._replace(file, lambda out: np.savez(out, **arrays))

    def read(self, runs: np.ndarray, limit: int) -> dict[str, np.ndarray] | None:
        """Numbers of a chunk that was kept, `None` if it was not."""
        found = _load(self._file(runs, limit))
        return None if found is None else found[2]

    def finished(self) -> list[tuple[np.ndarray, dict[str, np.ndarray]]]:
        """All runs that are done, chunk by chunk."""
        kept = [_load(file) for file in sorted(self.folder.glob("chunk-*.npz"))]
        return [
            (runs[final], {name: column[final] for name, column in columns.items()})
            for runs, final, columns in filter(None, kept)
        ]


def _load(file: Path) -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]] | None:
    """Runs, which of them are final, and columns; a corrupted file (e.g. disk full) counts as missing."""
    try:
        with np.load(file) as data:
            return data["run"], data["final"], {name[1:]: data[name] for name in data.files if name.startswith("_")}
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None


def store_at(folder: Path, key: str) -> Store | None:
    """The same folder seen from another process, `None` where it is not there."""
    try:
        return Store(folder, key, None)
    except InputError:
        return None


@dataclasses.dataclass(frozen=True, eq=False)
class Task:
    """One chunk: which runs (from 0), their numbers (runs, numbers), and how many they are filled up to."""

    job: Any  # None where it travels apart
    limit: int  # of the steps
    runs: np.ndarray
    rows: np.ndarray
    size: int
    last: bool = True  # no higher limit of the steps follows

    def final(self, columns: dict[str, np.ndarray]) -> np.ndarray:
        """Which runs are done: the others reached the limit of the steps and get a higher one."""
        return np.full(len(self.runs), True) if self.last else columns["code"] != int(Code.STEP_LIMIT)


class Threads:
    """Threads that each hand chunks to a compiled program, which runs outside of Python's lock.

    On a CPU one thread per core, on accelerators one per device; `workers` limits them.
    """

    def __init__(self, workers: int | None = None):
        devices = jax.devices()
        cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        count = max(cores, len(devices)) if devices[0].platform == "cpu" else len(devices)
        self.workers = count if workers is None else min(workers, count) if workers > 0 else 1
        self._devices: queue.SimpleQueue[Any] = queue.SimpleQueue()
        for device in itertools.islice(itertools.cycle(devices), self.workers):
            self._devices.put(device)
        self._pool = ThreadPoolExecutor(self.workers, thread_name_prefix="simbrake")
        self._done: queue.SimpleQueue[tuple[Task, Future[Any]]] = queue.SimpleQueue()
        self._waiting: set[Future[Any]] = set()

    def submit(self, task: Task) -> None:
        future = self._pool.submit(self._run, task)
        self._waiting.add(future)
        future.add_done_callback(lambda f: self._done.put((task, f)))

    def _run(self, task: Task) -> dict[str, np.ndarray]:
        device = self._devices.get()
        try:
            return run_chunk(task.job, task.rows, task.size, device)
        finally:
            self._devices.put(device)

    def results(self) -> Iterator[tuple[Task, dict[str, np.ndarray]]]:
        """Finished tasks in the order in which they finish, until none is left."""
        while self._waiting:
            try:
                task, future = self._done.get(timeout=0.5)  # awake now and then, so that Ctrl-C is heard
            except queue.Empty:
                continue
            self._waiting.discard(future)
            if not future.cancelled():
                yield task, future.result()

    def cancel(self) -> None:
        """Nothing new is begun; what runs now comes to its end and is among the results."""
        for future in list(self._waiting):
            future.cancel()

    def close(self) -> None:
        self._pool.shutdown(wait=True, cancel_futures=True)


@functools.lru_cache(maxsize=8)
def _unpacked(payload: bytes) -> Job:
    import cloudpickle

    return cloudpickle.loads(payload)


def run_packed(payload: bytes, task: Task, folder: str | None, key: str) -> dict[str, np.ndarray]:
    """A chunk on a worker elsewhere, which keeps it at once if it sees the folder, and looks there first.

    Functions come anew with every message: one job is kept, or each would be traced.
    """
    store = None if folder is None else store_at(Path(folder), key)
    kept = None if store is None else store.read(task.runs, task.limit)
    if kept is not None:
        return kept
    columns = run_chunk(_unpacked(payload), task.rows, task.size)
    if store is not None:
        store.write(task.runs, task.limit, columns, task.final(columns))
    return columns


class Cluster:
    """The workers of a Dask cluster. A chunk whose worker dies is given to another by Dask's own scheduler."""

    def __init__(self, client: Any, store: Store | None):
        self._folder = (None, "") if store is None else (str(store.folder.resolve()), store.key)
        try:
            from distributed import Client
        except ImportError as error:
            hint = "pip install 'simbrake[ensemble]'"
            raise InputError([Fault("client", "needs dask.distributed, which is not installed", hint)]) from error
        self._own = isinstance(client, str)
        self._client: Any = Client(client) if self._own else client
        if not isinstance(self._client, Client):
            given = type(client).__name__
            raise InputError([Fault("client", f"is a {given}", "a dask.distributed.Client or a scheduler's address")])
        self._waiting: dict[Any, Task] = {}
        self._payloads: dict[int, tuple[Job, bytes]] = {}

    @property
    def workers(self) -> int:
        return max(1, sum(self._client.nthreads().values()))

    def submit(self, task: Task) -> None:
        import cloudpickle

        if id(task.job) not in self._payloads:
            self._payloads[id(task.job)] = (task.job, cloudpickle.dumps(task.job))
        payload, light = self._payloads[id(task.job)][1], dataclasses.replace(task, job=None)
        future = self._client.submit(run_packed, payload, light, *self._folder, pure=False)
        self._waiting[future] = task

    def results(self) -> Iterator[tuple[Task, dict[str, np.ndarray]]]:
        from distributed import as_completed

        while self._waiting:
            for future in as_completed(list(self._waiting)):
                task = self._waiting.pop(future)
                if future.status != "cancelled":
                    yield task, future.result()

    def cancel(self) -> None:
        self._client.cancel([f for f in self._waiting if not f.done()])
        self._waiting = {f: task for f, task in self._waiting.items() if f.status == "finished"}

    def close(self) -> None:
        for future in self._waiting:
            future.release()
        self._waiting = {}
        if self._own:
            self._client.close()


# --- all runs ---------------------------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True, eq=False)
class Plan:
    """A scene, the varied numbers (runs first), what is measured, and how it is integrated."""

    scene: Scene
    values: dict[str, np.ndarray]
    metrics: tuple[Metric, ...]
    rtol: float
    solver: Any
    max_steps: int | None
    chunk: int

    @property
    def paths(self) -> Paths:
        return Paths(tuple(self.values), tuple(array.shape[1:] for array in self.values.values()))

    @property
    def count(self) -> int:
        return len(next(iter(self.values.values())))

    @functools.cached_property
    def columns(self) -> np.ndarray:
        """All varied numbers, (runs, numbers)."""
        return np.concatenate([array.reshape(self.count, -1) for array in self.values.values()], axis=1)

    def one(self, i: int) -> Scene:
        """The scene of run `i`."""
        return with_values(self.scene, {path: array[i] for path, array in self.values.items()})

    def abouts(self) -> dict[str, Quantity]:
        """Unit, meaning and range of every varied number."""
        known = {leaf.path: leaf.about for leaf in leaves(self.one(0))}
        return {path: known[place_of(path, known)[0]] for path in self.values}

    def groups(self) -> list[tuple[Any, np.ndarray]]:
        """Solvers, and the runs that each of them gets: for every run what it would get by itself."""
        every = np.arange(self.count)
        if self.solver is not None or not self.scene.heated:
            return [(self.solver or solver_for(False), every)]
        if not any(path.startswith(("heat", "end_time", "initial.time")) for path in self.values):
            return [(solver_for(stiffness(self.one(0))[0]), every)]
        stiff = np.asarray([stiffness(self.one(i))[0] for i in range(self.count)])
        return [(solver_for(kind), every[stiff == kind]) for kind in (False, True) if np.any(stiff == kind)]

    def store(self, folder: Path) -> Store:
        """The folder that keeps the chunks of this plan and of no other."""
        names = [name_of(metric) for metric in self.metrics]
        functions = [metric for metric in self.metrics if not isinstance(metric, str)]
        key = fingerprint(self.scene, self.values, names, functions, self.rtol, self.solver, self.max_steps)
        about = {
            "runs": self.count,
            "paths": list(self.values),
            "metrics": names,
            "rtol": self.rtol,
            "solver": None if self.solver is None else type(self.solver).__name__,
            "max_steps": self.max_steps,
            "simbrake": version("simbrake"),
        }
        return Store(folder, key, about)


class _Columns:
    """Numbers of all runs, filled in as they come."""

    def __init__(self, plan: Plan, store: Store | None, progress: Any):
        n = plan.count
        self.all: dict[str, np.ndarray] = {name: np.zeros(n, np.int32) for name in ABOUT}
        self.all |= {"code": np.full(n, NOT_RUN, np.int32), "energy.closure": np.full(n, np.nan)}
        self.all |= {name_of(metric): np.full(n, np.nan) for metric in plan.metrics}
        self.all["method"] = np.full(n, "", dtype="<U32")
        self.done = np.zeros(n, bool)
        self._store = store
        for runs, found in [] if store is None else store.finished():
            self._fill(runs, found)
        self.progress = Progress(n, progress, int(self.done.sum()))

    def _fill(self, runs: np.ndarray, found: dict[str, np.ndarray]) -> None:
        for name, column in found.items():
            self.all[name][runs] = column
        self.done[runs] = True

    def put(self, task: Task, found: dict[str, np.ndarray]) -> None:
        """Takes over the runs of a chunk that are done."""
        final = task.final(found)
        if self._store is not None:
            self._store.write(task.runs, task.limit, found, final)
        if np.any(final):
            self._fill(task.runs[final], {name: column[final] for name, column in found.items()})
            self.progress.add(int(final.sum()))

    def attempts(self, runs: np.ndarray) -> np.ndarray:
        return sum(self.all[name][runs] for name in ("steps", "rejected", "retaken")) + self.all["segments"][runs]


def run_all(
    plan: Plan, *, workers: int | None, client: Any, directory: Path | None, progress: Any
) -> dict[str, np.ndarray]:
    """Columns of all runs of a plan; after Ctrl-C those of the finished ones, the others with the code `NOT_RUN`."""
    store = None if directory is None else plan.store(directory)
    pool = Threads(workers) if client is None else Cluster(client, store)
    columns = _Columns(plan, store, progress)
    interrupted = False
    try:
        for solver, runs in plan.groups():
            _run_group(plan, columns, pool, solver, runs)
    except KeyboardInterrupt:
        interrupted = True
        pool.cancel()
        for task, found in pool.results():
            columns.put(task, found)
    finally:
        pool.close()
        columns.progress.close()
    if interrupted:
        left = int(np.sum(~columns.done))
        print(f"simbrake: interrupted, {left} of {plan.count} runs are missing (code -1)", file=sys.stderr)
    return columns.all


def _run_group(plan: Plan, columns: _Columns, pool: Any, solver: Any, runs: np.ndarray) -> None:
    """All runs of one solver: a pilot chunk, then the rest in order of cost, then those that need more steps."""
    missing = runs[~columns.done[runs]]
    limits = list(limits_of_many(plan.scene, solver, plan.max_steps))
    size = min(plan.chunk, 1 << max(0, math.ceil(math.log2(max(1, len(runs))))))
    if len(missing) > plan.chunk * pool.workers and not np.any(columns.done[runs]):
        pilot = missing[spread(len(missing), size)]
        again = _run_level(plan, columns, pool, solver, pilot, limits[0], size, len(limits) == 1)
        if len(limits) > 1 and 2 * len(again) > len(pilot):
            limits = limits[1:]  # most runs are longer
        missing = runs[~columns.done[runs]]
    known = runs[columns.done[runs]]
    if len(known) > 1:
        where = np.searchsorted(runs, known)
        cost = expected_cost(plan.columns[runs], where, columns.attempts(known))
        cost = cost[np.searchsorted(runs, missing)]
        missing = missing[np.argsort(-cost, kind="stable")]
    for limit in limits:
        missing = _run_level(plan, columns, pool, solver, missing, limit, size, limit == limits[-1])


def _run_level(
    plan: Plan, columns: _Columns, pool: Any, solver: Any, runs: np.ndarray, limit: int, size: int, last: bool
) -> np.ndarray:
    """Runs in chunks with one limit of the steps; gives back those for which it was too low, in the same order."""
    job = Job(plan.scene, plan.paths, plan.metrics, solver, plan.rtol, limit)
    size = max(1, min(size, _ROWS // limit))
    for start in range(0, len(runs), size):
        part = runs[start : start + size]
        pool.submit(Task(job, limit, part, plan.columns[part], size, last))
    for task, found in pool.results():
        columns.put(task, found)
    return runs[~columns.done[runs]]


# --- runs by expected cost: a chunk costs as much as its slowest run --------------------------------------------------


def _features(columns: np.ndarray, squares: bool) -> np.ndarray:
    parts = [np.ones((len(columns), 1)), columns]
    return np.concatenate([*parts, columns**2] if squares else parts, axis=1)


def spread(count: int, size: int) -> np.ndarray:
    """`size` of `count` runs without any order of their own (a regular choice could miss a whole direction)."""
    return np.sort(np.random.default_rng(0).permutation(count)[:size])


def expected_cost(columns: np.ndarray, known: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Expected logarithm of the steps of every run, from those of the runs `known`.

    Least squares on the varied numbers (runs, numbers), standardised, and their squares; on the numbers alone where
    few runs are known. Numbers that do not vary say nothing.
    """
    scale = columns.std(axis=0)
    columns = (columns[:, scale > 0] - columns[:, scale > 0].mean(axis=0)) / scale[scale > 0]
    x = _features(columns, squares=2 * columns.shape[1] + 1 <= len(known) / 2)
    some, log = x[known], np.log(np.maximum(steps, 1.0))
    lhs = some.T @ some + _RIDGE * len(known) * np.eye(x.shape[1])
    return x @ np.linalg.solve(lhs, some.T @ log)
