"""Where chunks are computed: threads over the devices of this machine, or the workers of a Dask cluster."""

import dataclasses
import functools
import itertools
import os
import queue
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import jax
import numpy as np

from .._base._faults import Fault, InputError
from ..hybrid import Code
from ._chunks import Job, run_chunk
from ._store import Store, store_at


@dataclasses.dataclass(frozen=True, eq=False)
class Task:
    """One chunk: which runs (numbers from 0), their samples, and the number they are filled up to."""

    job: Any  # None where it travels apart
    limit: int  # of the steps
    runs: np.ndarray
    rows: tuple[np.ndarray, ...]
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
