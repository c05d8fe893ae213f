"""Many runs of one scene with other numbers, in one call: their plan, the runs, and
their data set.

Runs go in chunks to threads of this machine or to workers of a Dask cluster. Finished
chunks may be stored in a folder, and runs whose records were too short are repeated
with longer ones.
"""

import contextlib
import dataclasses
import functools
import hashlib
import json
import math
import os
import socket
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from .._base._arguments import explained
from .._base._faults import Fault, Issues, input_error
from .._base._progress import counting
from .._base._quantity import Quantity, unit_suffix
from .._base._store import canonical, trace_anew, versions
from ..outputs.judgement import COLOURS, REASONS, decoded
from ..outputs.log import status_of
from ..outputs.metrics import RESIDUALS
from ..parts.scene import Scene, require_scene
from ..physics.mechanism import Label
from ..runs.choice import stiffness
from ..runs.edit import Inputs, with_inputs, with_values
from ..runs.measure import Metric, check_metrics, name_of, unit_of
from ..runs.mesh import cuts_of, with_finer_layers
from ..runs.simulate import (
    check_limits,
    error_of_layers,
    errors_between,
    require_64_bits,
    require_compiling,
    second_rtol,
    simulate,
    solver_for,
    solver_name,
)
from ..thermal.mesh import finer_values
from ._chunks import LostWorkersError, Pool, Store, Task, interruptible, threads
from .evaluating import (
    ABOUT,
    Columns,
    Job,
    Paths,
    Solver,
    array_in_si,
    default_metrics,
    failure_name,
    faults_of_runs,
    limits_of_many,
    named_runs,
    own_part,
    run_chunk,
)

if TYPE_CHECKING:
    import dask.distributed
    import xarray as xr

    Dataset: TypeAlias = xr.Dataset
    Client: TypeAlias = dask.distributed.Client | str
else:  # imported where they are used
    Dataset = Client = Any
#: a function called with `(done, total)` runs; a progress line, on a terminal only
#: (`None`); or none (`False`)
Show: TypeAlias = Callable[[int, int], object] | bool | None

NOT_RUN = -1
#: runs for which chunks have space by default: few and many on a CPU; elsewhere
_CHUNKS = (64, 1024)
_MANY = 2**17
#: runs up to which each is made by itself: a program of chunks takes longer to compile
_FEW = 100
#: instants of events of a run for which there is space at least, before the last limit
#: of the steps
_ROOM = 16
#: chunks for every worker, so that all of them end at about the same time
_SHARES = 8
#: minimum ratio of the expected costs of two runs for which they are sorted
_UNEQUAL = 1.2
#: scenes looked at as a whole, besides those with the minimum and the maximum of every
#: parameter
_LOOKED_AT = 16
#: s to wait for the scheduler of a cluster, and for workers before one line says so
_PATIENCE = 5


# --- the plan of the runs -----------------------------------------------------------


@dataclasses.dataclass(frozen=True, eq=False)
class Plan:
    """A scene, the varied numbers (runs first), what is measured, and how it is
    integrated."""

    scene: Scene
    values: dict[str, np.ndarray]
    metrics: tuple[Metric, ...]
    rtol: float
    solver: Solver | None
    max_steps: int | None
    chunk: int | None
    key: str | None = None

    @property
    def paths(self) -> Paths:
        return Paths(
            tuple(self.values), tuple(array.shape[1:] for array in self.values.values())
        )

    @property
    def count(self) -> int:
        return len(next(iter(self.values.values())))

    @property
    def own(self) -> str:
        """Name of a class or function in it that is the user's own, or of a library
        that simbrake does not know."""
        return own_part(self.scene, self.solver, self.metrics)

    @functools.cached_property
    def columns(self) -> np.ndarray:
        """All varied numbers, (runs, numbers)."""
        return np.concatenate(
            [array.reshape(self.count, -1) for array in self.values.values()], axis=1
        )

    @functools.cached_property
    def first(self) -> Scene:
        """The scene of the first run, which has a number at each path."""
        return with_inputs(self.scene, self.paths.values(self.columns[0]))

    def one(self, i: int) -> Scene:
        """The scene of a run."""
        return with_values(self.first, self.paths.values(self.columns[i]))

    @functools.cached_property
    def abouts(self) -> dict[str, Quantity]:
        """Unit, meaning and range of every varied number."""
        known = Inputs(self.first)
        return {path: known.about(path) for path in self.values}

    def groups(self) -> list[tuple[Solver, np.ndarray]]:
        """Solvers, and the runs that each of them gets: for every run what it would get
        by itself."""
        every = np.arange(self.count)
        if self.solver is not None or not self.scene.heated:
            return [(self.solver or solver_for(False), every)]
        if not any(
            path.startswith(("heat", "end_time", "initial.time"))
            for path in self.values
        ):
            return [(solver_for(stiffness(self.first)[0]), every)]
        stiff = np.asarray([stiffness(self.one(i))[0] for i in range(self.count)])
        return [
            (solver_for(kind), every[stiff == kind])
            for kind in (False, True)
            if np.any(stiff == kind)
        ]


def plan_of(
    scene: Scene,
    values: Mapping[str, object],
    metrics: Sequence[Metric] | None,
    rtol: float,
    solver: Solver | None,
    max_steps: int | None,
    chunk: int | None,
) -> Plan:
    issues = Issues()
    arrays = _arrays(scene, values, issues)
    issues.attempt(check_limits, rtol, np.inf, max_steps)
    for name, count in (("chunk", chunk), ("max_steps", max_steps)):
        issues.unless(
            count is None or (isinstance(count, int) and count >= 1),
            name,
            count,
            f"{name} > 0",
        )
    issues.report()
    asked = default_metrics(scene) if metrics is None else tuple(metrics)
    plan = Plan(scene, arrays, asked, float(rtol), solver, max_steps, chunk)
    first = plan.first  # raises for names that the scene does not have
    for path, about in plan.abouts.items():
        issues += _outside(path, arrays[path], about)
    issues.attempt(check_metrics, first, asked)
    issues += [] if issues else _of_times(plan)
    issues += [] if issues else _of_scenes(plan)
    issues.report()
    return plan


def _arrays(scene: Scene, values: Mapping[str, object], issues: Issues) -> Columns:
    arrays: Columns = {}
    if not values or not isinstance(values, Mapping):
        issues.add("values", "nothing varies", "give {path: array of values}")
        return arrays
    for path, value in values.items():
        array = array_in_si(scene, path, value, issues)
        if array is None:
            continue
        if array.ndim not in (1, 2) or array.size == 0:
            hint = "an array (runs,), or (runs, entries) for a number with entries"
            issues.add(path, f"has the shape {array.shape}", hint)
        arrays[path] = array
    counts = {path: len(array) for path, array in arrays.items() if array.ndim}
    if len(set(counts.values())) > 1:
        each = ", ".join(f"{path} {count}" for path, count in counts.items())
        hint = "give every number once for every run"
        issues.add("values", f"the numbers of runs differ: {each}", hint)
    return arrays


def _outside(path: str, array: np.ndarray, about: Quantity) -> list[Fault]:
    """One error for all values of a parameter outside its range, with the runs that
    have them."""
    bad = np.argwhere(~about.admits(array).reshape(len(array), -1))
    if len(bad) == 0:
        return []
    worst = array.reshape(len(array), -1)[tuple(bad[0])]
    what = f"{worst:g}{unit_suffix(about.unit)} is out of range {named_runs(np.unique(bad[:, 0]))}"
    return [
        Fault(
            path,
            what,
            f"{about.meaning} must be {about.range}{unit_suffix(about.unit)}",
        )
    ]


def _of_times(plan: Plan) -> list[Fault]:
    """Runs that end before they start: these would be returned as if they had reached
    their end."""
    start, end = (
        plan.values.get(path, np.full(plan.count, value))
        for path, value in (
            ("initial.time", plan.scene.initial.time),
            ("end_time", plan.scene.end_time),
        )
    )
    bad = np.flatnonzero(~(end > start))
    if not len(bad):
        return []
    what = f"{end[bad[0]]:g} s is not after the start {named_runs(bad)}"
    return [Fault("end_time", what, "it must be later")]


def _of_scenes(plan: Plan) -> list[Fault]:
    """Errors between parameters, in the runs with the minima and maxima and in some
    others; each reported once."""
    columns = plan.columns
    ends = np.concatenate([columns.argmin(axis=0), columns.argmax(axis=0)])
    step = 1 if plan.count <= _FEW else math.ceil(plan.count / _LOOKED_AT)
    chosen = np.unique(np.concatenate([ends, np.arange(0, plan.count, step)]))
    return faults_of_runs((int(i), plan.one(int(i))) for i in chosen)


# --- where the runs are computed and kept -------------------------------------------


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
        from distributed.comm import get_address_host_port
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
        try:  # a client that finds nobody keeps on looking
            socket.create_connection(
                get_address_host_port(scheduler), _PATIENCE
            ).close()
        except (OSError, ValueError, OverflowError) as error:
            what = f"no Dask scheduler answers at {scheduler!r}: {error}"
            hint = "an address as tcp://10.0.0.1:8786"
            raise input_error("client", what, hint) from error
        own = Client(scheduler)
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


# --- runs by expected cost: a chunk costs as much as its slowest run ----------------


def spread(count: int, size: int) -> np.ndarray:
    """`size` of `count` runs in random order (a regular choice could miss a whole
    direction)."""
    return np.sort(np.random.default_rng(0).permutation(count)[:size])


def expected_cost(
    columns: np.ndarray, known: np.ndarray, steps: np.ndarray
) -> np.ndarray:
    """Expected logarithm of the steps of every run, from those of the runs `known`.

    Least squares on the varied numbers (runs, numbers), standardised, and their
    squares; on the numbers alone where few runs are known. Parameters that do not vary
    are left out.
    """
    scale = columns.std(axis=0)
    columns = (columns[:, scale > 0] - columns[:, scale > 0].mean(axis=0)) / scale[
        scale > 0
    ]
    squares = [columns**2] if 2 * columns.shape[1] + 1 <= len(known) / 2 else []
    x = np.concatenate([np.ones((len(columns), 1)), columns, *squares], axis=1)
    return x @ np.linalg.lstsq(x[known], np.log(np.maximum(steps, 1.0)))[0]


# --- all runs -----------------------------------------------------------------------


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
            and n <= _FEW
            and not any(map(callable, plan.metrics))
        )
        self.plan = plan
        self.pool = pool
        self.store = store
        self.columns: Columns = {name: np.zeros(n, np.int32) for name in ABOUT}
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
                self._fill(
                    task.runs[final],
                    {name: column[final] for name, column in columns.items()},
                )
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
            pilot = missing[spread(len(missing), few)]
            again = self.level(solver, pilot, limits[0], size, len(limits) == 1)
            if len(limits) > 1 and 2 * len(again) > len(pilot):
                limits = limits[1:]  # most runs are longer
            missing = runs[~self.done[runs]]
        known = runs[self.done[runs]]
        if len(known) > 1:
            attempts = np.sum(
                [
                    self.columns[name][known]
                    for name in ("steps", "rejected", "retaken", "segments")
                ],
                axis=0,
            )
            cost = expected_cost(
                self.plan.columns[runs], np.searchsorted(runs, known), attempts
            )
            if np.ptp(cost) > math.log(_UNEQUAL):
                missing = missing[
                    np.argsort(-cost[np.searchsorted(runs, missing)], kind="stable")
                ]
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
                interruptible() as pool.look,
            ):
                for solver, some in plan.groups():
                    runs.group(solver, some)
                pool.look()
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


# --- the data set -------------------------------------------------------------------

_MEANINGS = {
    "code": "0 if the run reached its end time, else its failure code; -1: not run",
    "steps": "steps accepted",
    "rejected": "step attempts rejected for their error",
    "retaken": "steps taken again, shorter, at events",
    "segments": "parts of the run between events",
    "sequence": "runs with the same number, from 0, have the same events in the same order",
    "energy.closure": RESIDUALS["energy.closure"].meaning,
}


def _statuses(columns: Columns) -> np.ndarray:
    """How every run ended, in the words of `Result.status`, `not_run` where it did not
    take place: one look at all runs for each of the few ways that there are."""
    names = ("code", "band", "inner", "turn", "moved", "driven", "judged")
    kinds, which = np.unique(
        np.stack([columns[name] for name in names]), axis=1, return_inverse=True
    )
    words = []
    for code, band, inner, turn, moved, driven, judged in kinds.T.tolist():
        if code:
            words.append("not_run" if code == NOT_RUN else failure_name(code))
            continue
        decision = decoded(np.asarray(judged))
        status = status_of(
            Label(band, inner, turn),
            bool(moved),
            bool(driven),
            lambda decision=decision: bool(decision.away),
            lambda decision=decision: bool(decision.steady),
        )
        words.append(str(status))
    return np.asarray(words)[which.ravel()]


def _reasons(columns: Columns) -> tuple[np.ndarray, np.ndarray]:
    """Reason and colour of every run, empty where it did not take place."""
    took_place = columns["code"] != NOT_RUN
    decision = decoded(np.where(took_place, columns["judged"], 0))
    ids = np.asarray([reason.id for reason in REASONS])[decision.reason]
    colours = np.asarray(COLOURS)[decision.colour]
    return np.where(took_place, ids, ""), np.where(took_place, colours, "")


def _errors(plan: Plan, columns: Columns, second: Columns) -> Columns:
    """Estimated errors of every metric, NaN where a run failed, or the second one has
    other events."""
    same = (
        (columns["code"] == 0)
        & (second["code"] == 0)
        & (columns["sequence"] == second["sequence"])
    )
    steps = columns["steps"]
    return {
        name: np.where(same, errors_between(columns[name], second[name], steps), np.nan)
        for name in map(name_of, plan.metrics)
    }


def _with_layers(errors: Columns, columns: Columns, finer: Columns) -> Columns:
    """Errors with those of the layers of walls, from runs with finer layers; NaN where
    such a run failed."""
    whole = {}
    for name, error in errors.items():
        with np.errstate(invalid="ignore"):
            apart = np.abs(columns[name] - finer[name])
        apart[finer["code"] != 0] = np.nan
        whole[name] = error + error_of_layers(apart, error)
    return whole


def _finer(plan: Plan) -> Plan | None:
    """The plan of the same runs with finer layers, as the first run needs them; `None`
    without walls."""
    if not plan.scene.network.walls:
        return None
    cuts = cuts_of(
        simulate(plan.first, rtol=plan.rtol, solver=plan.solver, throw=False)
    )
    scene = with_finer_layers(plan.scene, cuts)
    values = finer_values(plan.scene.network, scene.network, plan.values)
    return dataclasses.replace(plan, scene=scene, values=values)


def _dataset(
    data: Mapping[str, tuple],
    coords: Mapping[str, tuple],
    dims: Sequence[str],
    attrs: Mapping,
) -> Dataset:
    """A data set of `(dimensions, array, attributes)` by name, with an index for each
    dimension.

    All of it is given as xarray keeps it: told to look what the arrays are, it imports
    all of Dask first, which takes longer than a thousand runs.
    """
    import pandas as pd
    import xarray as xr
    from xarray.indexes import PandasIndex

    def kept(entries: Mapping[str, tuple]) -> dict[str, xr.Variable]:
        return {
            name: xr.Variable(*entry, fastpath=True) for name, entry in entries.items()
        }

    indexes = {
        name: PandasIndex(pd.Index(coords[name][1], name=name), name) for name in dims
    }
    return xr.Dataset(kept(data), xr.Coordinates(kept(coords), indexes), attrs)


def _as_dataset(plan: Plan, columns: Columns, errors: Columns | None = None) -> Dataset:
    """One row per run: the varied numbers as coordinates, metrics, result code and step
    counts as variables."""
    coords: dict[str, Any] = {
        "run": (
            ("run",),
            np.arange(plan.count),
            {"meaning": "number of the run, from 0"},
        )
    }
    for path, about in plan.abouts.items():
        array = plan.values[path]
        dims = ("run",) if array.ndim == 1 else ("run", f"{path} entry")
        coords[path] = (dims, array, {"units": about.unit, "meaning": about.meaning})
    data: dict[str, Any] = {}

    def add(name: str, column: np.ndarray, **about: str) -> None:
        data[name] = (("run",), column, about)

    for metric in plan.metrics:
        name = name_of(metric)
        unit = {"units": unit_of(metric)} if unit_of(metric) else {}
        add(name, columns[name], **unit)
        if errors is not None:
            meaning = f"estimated error of {name}; NaN where the events of a second run differ"
            add(f"{name}_error", errors[name], **unit, meaning=meaning)
    # numbers in the order in which the sequences occur first
    _, first, which = np.unique(
        columns["sequence"], return_index=True, return_inverse=True
    )
    order = np.argsort(np.argsort(first))[which].astype(np.int32)
    for name, meaning in _MEANINGS.items():
        column = order if name == "sequence" else columns[name]
        add(name, column, units="1", meaning=meaning)
    add("status", _statuses(columns), meaning="how the run ended")
    reasons, colours = _reasons(columns)
    judged = "whether the brake did what it was to do, as in a verdict"
    add("reason", reasons, meaning=judged)
    add("colour", colours, meaning="colour of the reason, without limits of metrics")
    add("method", columns["method"], meaning="solver of the run")
    return _dataset(
        data,
        coords,
        ["run"],
        {"rtol": plan.rtol, "simbrake": version("simbrake"), "jax": version("jax")},
    )


def _as_grid(flat: Dataset, axes: Columns) -> Dataset:
    """The data set of a full grid (the last number varies fastest) with one dimension
    per number."""
    dims = tuple(axes)
    shape = tuple(len(axis) for axis in axes.values())
    data = {
        name: (dims, column.values.reshape(shape), column.attrs)
        for name, column in {**flat.data_vars, "run": flat["run"]}.items()
    }
    coords = {path: ((path,), axis, flat[path].attrs) for path, axis in axes.items()}
    return _dataset(data, coords, dims, flat.attrs)


@explained
def ensemble(
    scene: Scene,
    values: Mapping[str, object],
    metrics: Sequence[Metric] | None = None,
    *,
    rtol: float = 1e-10,
    solver: Solver | None = None,
    chunk: int | None = None,
    workers: int | None = None,
    max_steps: int | None = None,
    progress: Show = None,
    client: Client | None = None,
    directory: str | os.PathLike[str] | None = None,
    key: str | None = None,
    accuracy: bool = False,
) -> Dataset:
    """Runs a scene once for every row of `values` and gives an `xarray.Dataset` with
    the dimension `run`.

    - `values`: `{path: array}`, (runs,) for one number (or one for all entries of a
      field), (runs, entries) for a field with entries; in SI, or (runs,) texts with
      units, as `["40 t", "80 t"]`; paths as in `with_values`
    - `metrics`: names, energies as `energy.…`, or functions of a `Result` to a number
      that accept traced values. By default everything the scene has but maxima
      (`max_…`, `peak_…`), which cost many times the run
    - `rtol`, `solver`, `max_steps`: as in `simulate`; every run gets the solver and the
      step limits that it would get by itself, and its numbers are those of a single run
      to rounding
    - `chunk`: runs in one call of one program, by default 64 to 1024 on a CPU, up to
      131,072 elsewhere; without it up to 100 runs on a CPU are made as `simulate` makes
      them, if no metric is a function. They go side by side, on a CPU in groups of 64;
      those that reach an event wait for the others, so that a group costs as much as
      its slowest run. Where a metric samples all steps, runs of a CPU follow one
      another instead. A few runs show what the numbers do to the steps, and the rest is
      sorted by that, the expensive ones first
    - `workers`: threads, by default one per core, or one per accelerator where there
      are any
    - `client`: a `dask.distributed.Client`, or the address of its scheduler: chunks are
      run there. simbrake must be installed on the workers; a chunk whose worker dies is
      run by another
    - `directory`: finished chunks are stored there. The same call continues where an
      earlier one ended; another one is rejected, as is one of another version of
      simbrake or JAX. Workers of a cluster with access to the folder write there
      themselves, so that one that dies loses no more than its current chunk
    - `key`: with `directory`, a text for the present version of your own functions and
      classes in the scene and among the metrics; give another one whenever they, or
      what they read, change. Without a key a study that holds some starts anew at each
      call, and a line on stderr says so
    - `progress`: `None` shows a line where stderr is a terminal, `False` none; or a
      function of `(done, total)`
    - `accuracy`: make all runs a second time, at the tolerance of `Result.accuracy` and
      by the same program, to estimate the error of each metric: variables `…_error`,
      NaN where a run failed, a metric has no value, or the events of the second run are
      not the same ones; none at all after Ctrl-C. Of walls a third time, with finer
      layers

    The data set has the varied numbers as coordinates (`units`, `meaning`), every
    metric, `code` (0, a failure code as in `simbrake.results.FAILURES`, or −1),
    `status` (the words of `Result.status`, or `not_run`), `reason` and `colour`
    (whether the brake did what it was to do, as `Verdict.reason`; without limits),
    `steps`, `rejected`, `retaken`, `segments`, `sequence` (the same number: the same
    events in the same order), `energy.closure` and `method`. A run that fails raises
    nothing. Times of what did not happen are `inf`. Ctrl-C ends the call early: what is
    finished is returned, the rest has the code −1 and `NaN`.

    Every value is checked against its range, and every end against its start. What else
    `check` demands of a scene is looked at in up to 100 runs, of more in those with the
    minimum and the maximum of every parameter and in 16 others.

    Raises `InputError` with all errors at once, and `RuntimeError` if JAX is not in
    64-bit mode.
    """
    require_64_bits()
    require_compiling()
    require_scene(scene)
    plan = plan_of(scene, values, metrics, rtol, solver, max_steps, chunk)
    issues = Issues()
    fits = workers is None or (isinstance(workers, int) and workers >= 1)
    issues.unless(fits, "workers", workers, "at least 1")
    if key is not None and directory is None:
        what = "is for finished runs in a folder, and there is none"
        issues.add("key", what, "give directory (--resume) as well")
    issues.report()
    plan = dataclasses.replace(plan, key=key)
    folder = None if directory is None else Path(directory)
    if own := plan.own:
        trace_anew()
        if folder is not None and key is None:
            print(
                f"simbrake: starts anew and keeps nothing in {folder}: {own} may have "
                "changed (key=… or --key)",
                file=sys.stderr,
            )
            folder = None

    def columns_of(plan: Plan, below: str = "") -> Columns:
        where = None if folder is None else folder / below
        return run_all(plan, workers, client, where, progress)

    columns = columns_of(plan)
    errors = None
    if accuracy and np.all(
        columns["code"] != NOT_RUN
    ):  # else Ctrl-C has ended the call
        again = dataclasses.replace(plan, rtol=second_rtol(plan.rtol))
        errors = _errors(plan, columns, columns_of(again, "accuracy"))
        if (finer := _finer(plan)) is not None:
            errors = _with_layers(errors, columns, columns_of(finer, "layers"))
    return _as_dataset(plan, columns, errors)


@explained
def sweep(
    scene: Scene,
    values: Mapping[str, object],
    metrics: Sequence[Metric] | None = None,
    **settings: Any,
) -> Dataset:
    """Runs a scene on the full grid of the values given, `{path: (k,)}`: a data set
    with one dimension per path.

    Everything else is as in `ensemble`; `run` is the number of each run, the last path
    varies fastest.

    Example:
        >>> grid = sb.sweep(scene, {"initial.omega": [12.0, 24.0]}, ["stopping_time"])
        >>> [round(float(t), 4) for t in grid.stopping_time.values]
        [0.6289, 1.2577]
    """
    axes = {}
    issues = Issues()
    for path, axis in values.items():
        array = array_in_si(scene, path, axis, issues)
        if array is None:
            continue
        array = np.atleast_1d(array)
        if array.ndim != 1 or len(np.unique(array)) != len(array):
            hint = "a grid needs every value once"
            issues.add(path, "is not a list of different numbers", hint)
        axes[path] = array
    issues.report()
    grid = np.meshgrid(*axes.values(), indexing="ij") if axes else []
    columns = {path: part.ravel() for path, part in zip(axes, grid, strict=True)}
    return _as_grid(ensemble(scene, columns, metrics, **settings), axes)
