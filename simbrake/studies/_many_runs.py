"""All runs of a plan: on threads of this machine or on workers of a Dask cluster, the
expensive ones first, and those again whose records were too short."""

import contextlib
import functools
import hashlib
import json
import math
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from .._base._faults import Issues, input_error
from .._base._progress import counting
from .._base._store import canonical, versions
from ..runs.measure import name_of
from ..runs.simulate import solver_name
from ._chunks import LostWorkersError, Pool, Store, Task, interruptible, threads
from ._plan import FEW, Plan
from .evaluating import Solver
from .many_points import RUN_COLUMNS, Columns, Job, limits_of_many, run_chunk

if TYPE_CHECKING:
    import dask.distributed

    Client: TypeAlias = dask.distributed.Client | str
else:  # imported where it is used
    Client = Any

#: a function called with `(done, total)` runs; a progress line, on a terminal only
#: (`None`); or none (`False`)
Show: TypeAlias = Callable[[int, int], object] | bool | None
NOT_RUN = -1
#: runs for which chunks have space by default: few and many on a CPU; elsewhere
_CHUNKS = (64, 1024)
_MANY = 2**17
#: instants of events of a run for which there is space at least, before the last limit
#: of the steps
_ROOM = 16
#: chunks for every worker, so that all of them end at about the same time
_SHARES = 8
#: minimum ratio of the expected costs of two runs for which they are sorted
_UNEQUAL = 1.2
#: s to wait for the scheduler of a cluster, and for workers before one line says so
_PATIENCE = 5


def store_of(plan: Plan, folder: Path) -> Store:
    """The folder that keeps the chunks of a plan and of no other. Raises `InputError`
    where it is another plan's."""

    def hash_of(part: Any) -> str:
        return hashlib.sha256(
            canonical(part, static=True, by_name=True).encode()
        ).hexdigest()

    about = {
        "runs": plan.count,
        "paths": list(plan.values),
        "metrics": [name_of(metric) for metric in plan.metrics],
        "key": plan.key,
        "rtol": plan.rtol,
        "solver": None if plan.solver is None else solver_name(plan.solver),
        "max_steps": plan.max_steps,
        "versions": versions(),
        "the scene": hash_of(plan.scene),
        "the values": hash_of(plan.values),
        "the solver": hash_of(plan.solver),
    }
    return Store(folder, hash_of(json.dumps(about)), about)


@functools.lru_cache(maxsize=8)
def _unpacked(payload: bytes) -> Job:
    import cloudpickle

    return cloudpickle.loads(payload)


def run_packed(payload: bytes, task: Task, folder: str, study: str) -> Columns:
    """A chunk on a remote worker, which stores it at once if it can access the folder,
    and looks for it there first.

    Functions arrive with every message: one job is reused, or each would be traced.
    """
    store = Issues().attempt(Store, Path(folder), study) if folder else None
    kept = None if store is None else store.read(task)
    if kept is not None:
        return kept
    columns = run_chunk(_unpacked(payload), task.rows)
    if store is not None:
        store.write(task, columns)
    return columns


@contextlib.contextmanager
def cluster(scheduler: Client, store: Store | None) -> Iterator[Pool]:
    """The workers of a Dask cluster. The chunk of a worker that dies is given to
    another, which may come later.

    A chunk that several workers died of ends the call, and so does a scheduler that is
    gone.
    """
    try:
        import cloudpickle
        from distributed import Client, KilledWorker
    except ImportError as error:
        hint = "pip install 'simbrake[ensemble]'"
        what = "needs dask.distributed, which is not installed"
        raise input_error("client", what, hint) from error
    if not isinstance(scheduler, str | Client):
        what = f"is a {type(scheduler).__name__}"
        hint = "a dask.distributed.Client or a scheduler's address"
        raise input_error("client", what, hint)
    place = ("", "") if store is None else (str(store.folder.resolve()), store.study)
    own: Any = contextlib.nullcontext(scheduler)
    if isinstance(scheduler, str):
        try:
            # (as a default it would be left to Dask even where it never answers)
            own = Client(scheduler, timeout=_PATIENCE, set_as_default=False)
        except (OSError, ValueError) as error:
            what = f"no Dask scheduler answers at {scheduler!r}: {error}"
            hint = "an address as tcp://10.0.0.1:8786"
            raise input_error("client", what, hint) from error
    with own as client:
        executor = client.get_executor(pure=False)

        def start(job: Job, tasks: list[Task]) -> list[Future[Columns]]:
            payload = cloudpickle.dumps(job)
            return [
                executor.submit(run_packed, payload, task, *place) for task in tasks
            ]

        alone_since: list[float] = []

        def idle() -> None:
            if client.status != "running":
                raise LostWorkersError("the scheduler is gone")
            try:
                present = client.nthreads()
            # the connection broke just now: its status says so in a moment
            except OSError:
                return
            if present:
                alone_since.clear()
            elif not alone_since:
                alone_since.append(time.monotonic())
            elif time.monotonic() > alone_since[0] + _PATIENCE:
                print(
                    "simbrake: no worker is left, waits for new ones (Ctrl-C: what is finished)",
                    file=sys.stderr,
                )
                alone_since[0] = math.inf

        def lost(error: BaseException | None) -> None:
            if isinstance(error, KilledWorker):
                raise LostWorkersError(
                    "the workers of one chunk died again and again (look at their memory)"
                )
            if error is None or client.status != "running":
                raise LostWorkersError("the scheduler is gone")

        yield Pool(max(1, sum(client.nthreads().values())), start, idle=idle, lost=lost)


def expected_cost(
    columns: np.ndarray, known: np.ndarray, steps: np.ndarray
) -> np.ndarray:
    """Expected logarithm of the steps of every run, from those of the runs `known`.

    Least squares on the varied numbers (runs, numbers), standardised, and their
    squares; on the numbers alone where few runs are known.
    """
    scale = columns.std(axis=0)
    columns = (columns - columns.mean(axis=0)) / np.where(scale > 0, scale, 1.0)
    squares = [columns**2] if 2 * columns.shape[1] + 1 <= len(known) / 2 else []
    x = np.concatenate([np.ones((len(columns), 1)), columns, *squares], axis=1)
    log = np.log(np.maximum(steps, 1.0))
    return x @ np.linalg.lstsq(x[known], log, rcond=None)[0]


def _power_of_2(count: float) -> int:
    """The smallest power of two that is not below."""
    return 1 << max(0, math.ceil(math.log2(max(1.0, count))))


class Runs:
    """Numbers of all runs of a plan, filled in as a pool returns chunks of them."""

    def __init__(
        self, plan: Plan, pool: Pool, store: Store | None, few: bool = False
    ) -> None:
        n = plan.count
        #: whether each run is made by itself
        self.few = (
            few
            and pool.on_cpu
            and plan.chunk is None
            and n <= FEW
            and not any(map(callable, plan.metrics))
        )
        self.plan = plan
        self.pool = pool
        self.store = store
        self.columns: Columns = {name: np.zeros(n, np.int32) for name in RUN_COLUMNS}
        self.columns |= {
            "code": np.full(n, NOT_RUN, np.int32),
            "energy.closure": np.full(n, np.nan),
        }
        self.columns |= {name_of(metric): np.full(n, np.nan) for metric in plan.metrics}
        self.columns["method"] = np.full(n, "", dtype="<U32")
        self.done = np.zeros(n, bool)
        for runs, columns in [] if store is None else store.finished():
            self._fill(runs, columns)
        self.report: Callable[[int], object] = lambda done: None

    def _fill(self, runs: np.ndarray, columns: Columns) -> None:
        for name, column in columns.items():
            self.columns[name][runs] = column
        self.done[runs] = True

    def take(self) -> None:
        """Waits for what was submitted, and takes over the runs that are done."""
        for task, columns in self.pool.results():
            final = task.final(columns)
            if self.store is not None:
                self.store.write(task, columns)
            if np.any(final):
                done = {name: column[final] for name, column in columns.items()}
                self._fill(task.runs[final], done)
                self.report(int(self.done.sum()))

    def level(
        self, solver: Solver, runs: np.ndarray, limit: int, size: int, last: bool
    ) -> np.ndarray:
        """Runs in chunks with one limit of the steps; returns those for which it was
        too low, in the same order."""
        room = limit if last else min(limit, max(_ROOM, limit // 4))
        job = self._job(solver, limit, size, room).fitting()
        return self._run(job, runs, self._share(len(runs), job), last)

    def singly(self, solver: Solver, runs: np.ndarray) -> None:
        """All runs of one solver, each as `simulate` makes it."""
        missing = runs[~self.done[runs]]
        share = math.ceil(len(missing) / (self.pool.workers * _SHARES))
        self._run(self._job(solver, self.plan.max_steps or 0, 0, 0), missing, share)

    def _job(self, solver: Solver, limit: int, size: int, room: int) -> Job:
        plan = self.plan
        return Job(
            plan.scene, plan.paths, plan.metrics, solver, plan.rtol, limit, size, room
        )

    def _run(
        self, job: Job, runs: np.ndarray, size: int, last: bool = True
    ) -> np.ndarray:
        """Runs in parts of a size; returns those that are not done."""
        parts = [runs[start : start + size] for start in range(0, len(runs), size or 1)]
        columns = self.plan.columns
        tasks = [Task(job.max_steps, part, columns[part], last) for part in parts]
        self.pool.submit(job, tasks)
        self.take()
        return runs[~self.done[runs]]

    def _size(self, count: int) -> int:
        """Runs for which a program of chunks has space; the same for most counts, or
        each would be compiled."""
        filled = _power_of_2(count)
        if self.plan.chunk is not None:
            return min(self.plan.chunk, filled)
        if not self.pool.on_cpu:  # all of a chunk side by side, filled or not
            return min(filled, _MANY)
        low, high = _CHUNKS
        return min(low, filled) if filled < low else high

    def _share(self, count: int, job: Job) -> int:
        """Runs in a chunk of so many: a few chunks for each worker, so that all workers
        end at about the same time."""
        if self.plan.chunk is not None or not self.pool.on_cpu:
            return job.size
        return int(
            np.clip(
                _power_of_2(count / (self.pool.workers * _SHARES)), job.lanes, job.size
            )
        )

    def group(self, solver: Solver, runs: np.ndarray) -> None:
        """All runs of one solver: a few to learn from, the rest in order of cost, then
        those that need more steps."""
        if self.few:
            return self.singly(solver, runs)
        missing = runs[~self.done[runs]]
        limits = list(limits_of_many(self.plan.scene, solver, self.plan.max_steps))
        size = self._size(len(runs))
        few = min(size, _CHUNKS[0]) if self.pool.on_cpu else size
        if len(missing) > few * self.pool.workers and not np.any(self.done[runs]):
            # in random order: a regular choice could miss a whole direction
            pilot = np.sort(np.random.default_rng(0).permutation(missing)[:few])
            again = self.level(solver, pilot, limits[0], size, len(limits) == 1)
            if len(limits) > 1 and 2 * len(again) > len(pilot):
                limits = limits[1:]  # most runs are longer
            missing = runs[~self.done[runs]]
        known = runs[self.done[runs]]
        if len(known) > 1:
            counts = ("steps", "rejected", "retaken", "segments")
            attempts = np.sum([self.columns[name][known] for name in counts], axis=0)
            cost = expected_cost(self.plan.columns, known, attempts)
            if np.ptp(cost[runs]) > math.log(_UNEQUAL):
                missing = missing[np.argsort(-cost[missing], kind="stable")]
        for limit in limits:
            missing = self.level(solver, missing, limit, size, limit == limits[-1])


def run_all(
    plan: Plan,
    workers: int | None,
    client: Client | None,
    directory: Path | None,
    progress: Show,
) -> Columns:
    """Columns of all runs of a plan; after Ctrl-C those of the finished ones, the
    others with the code `NOT_RUN`."""
    store = None if directory is None else store_of(plan, directory)
    with threads(workers) if client is None else cluster(client, store) as pool:
        runs = Runs(plan, pool, store, client is None)
        try:
            with (
                counting(
                    plan.count, progress, "runs", done=int(runs.done.sum())
                ) as runs.report,
                interruptible() as pool.check_interrupt,
            ):
                for solver, some in plan.groups():
                    runs.group(solver, some)
                pool.check_interrupt()
        except (KeyboardInterrupt, LostWorkersError) as end:
            pool.cancel()
            runs.take()
            left = int(np.sum(~runs.done))
            why = str(end) or "interrupted"
            print(
                f"simbrake: {why}, {left} of {plan.count} runs are missing (code -1)",
                file=sys.stderr,
            )
    return runs.columns
