"""Many runs of one scene with other numbers, in one call."""

import math
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .._base._faults import Fault, InputError
from .._base._order import expected_cost, spread
from .._base._progress import Progress
from .._parts._scene import Scene
from .._run._measure import Metric, name_of
from .._run._simulate import require_64_bits
from ._chunks import ABOUT, Job
from ._dataset import NOT_RUN, as_dataset, as_grid
from ._distribute import Cluster, Task, Threads
from ._plan import Plan, plan_of
from ._store import Store, fingerprint

#: rows of all records of a chunk together: with some hundred columns half a gigabyte
_ROWS = 2**19


def ensemble(
    scene: Scene,
    values: Mapping[str, Any],
    metrics: Sequence[Metric] | None = None,
    *,
    rtol: float = 1e-10,
    solver: Any = None,
    chunk: int = 64,
    workers: int | None = None,
    max_steps: int | None = None,
    progress: Any = None,
    client: Any = None,
    directory: str | os.PathLike[str] | None = None,
) -> Any:
    """Runs a scene once for every row of `values` and gives an `xarray.Dataset` with the dimension `run`.

    - `values`: `{path: array}`, (runs,) for one number (or one for all entries of a field), (runs, entries) for a
      field with entries; SI units, paths as in `with_values`
    - `metrics`: names, energies as `energy.…`, or functions of a `Result` to a number that accept traced values. By
      default everything the scene has but greatest values (`max_…`, `peak_…`), which cost many times the run
    - `rtol`, `solver`, `max_steps`: as in `simulate`; every run gets the solver and the step limits that it would get
      by itself, and its numbers are those of a single run to rounding
    - `chunk`: runs in one call of one program: on a CPU one after the other in one function, elsewhere (and where XLA
      cannot do that) side by side, when a chunk costs as much as its slowest run. A first chunk tells what the numbers
      do to the steps, and the rest is sorted by that, the expensive ones first
    - `workers`: threads, by default one per core, or one per accelerator where there are any
    - `client`: a `dask.distributed.Client`, or the address of its scheduler: chunks are run there. simbrake must be
      installed on the workers; a chunk whose worker dies is run by another
    - `directory`: finished chunks are kept there. The same call goes on where an earlier one ended, another one is
      refused. Workers of a cluster that see the folder write there themselves, so that one that dies loses no more
      than the chunk it was at
    - `progress`: `None` shows a line where stderr is a terminal, `False` none; or a function of `(done, total)`

    The data set has the varied numbers as coordinates (`units`, `meaning`), every metric, `code` (0, a failure code as
    in `simbrake.FAILURES`, or −1), `status` (the words of `Result.status`, or `not_run`), `steps`, `rejected`,
    `retaken`, `segments`, `energy.closure` and `method`. A run that fails raises nothing. Times of what did not happen
    are `inf`. Ctrl-C ends the call early: what is finished is returned, the rest has the code −1 and `NaN`.

    Every value is checked against its range, and every end against its start. What else `check` demands of a scene is
    looked at in the runs with the least and the greatest value of every number and in 16 others.

    Raises `InputError` with all faults at once, and `RuntimeError` if JAX is not in 64-bit mode.
    """
    require_64_bits()
    plan = plan_of(scene, values, metrics, rtol=rtol, solver=solver, max_steps=max_steps, chunk=chunk)
    if workers is not None and workers < 1:
        raise InputError([Fault("workers", f"{workers} is not admissible", "at least 1")])
    store = None if directory is None else _store(plan, Path(directory))
    pool = Threads(workers) if client is None else Cluster(client, store)
    table = _Table(plan, store, progress)
    interrupted = False
    try:
        for method, runs in plan.groups():
            _run_group(plan, table, pool, method, runs)
    except KeyboardInterrupt:
        interrupted = True
        pool.cancel()
        for task, columns in pool.results():
            table.put(task, columns)
    finally:
        pool.close()
        table.progress.close()
    if interrupted:
        left = int(np.sum(~table.done))
        print(f"simbrake: interrupted, {left} of {plan.count} runs are missing (code -1)", file=sys.stderr)
    return as_dataset(plan, table.columns, _attrs(plan))


def sweep(scene: Scene, values: Mapping[str, Any], metrics: Sequence[Metric] | None = None, **settings: Any) -> Any:
    """Runs a scene on the full grid of the values given, `{path: (k,)}`: a data set with one dimension per path.

    Everything else is as in `ensemble`; `run` is the number of each run, the last path varies fastest.
    """
    axes, faults = {}, []
    for path, axis in values.items():
        try:
            array = np.atleast_1d(np.asarray(axis, dtype=np.float64))
        except (TypeError, ValueError):
            array = np.zeros((1, 1))
        if array.ndim != 1 or len(np.unique(array)) != len(array):
            faults.append(Fault(path, "is no list of different numbers", "a grid needs every value once"))
        axes[path] = array
    if faults:
        raise InputError(faults)
    grid = np.meshgrid(*axes.values(), indexing="ij") if axes else []
    columns = {path: part.ravel() for path, part in zip(axes, grid, strict=True)}
    return as_grid(ensemble(scene, columns, metrics, **settings), axes)


def _attrs(plan: Plan) -> dict[str, Any]:
    from importlib.metadata import version

    return {"rtol": plan.rtol, "simbrake": version("simbrake"), "jax": version("jax")}


def _store(plan: Plan, folder: Path) -> Store:
    from importlib.metadata import version

    names = [name_of(metric) for metric in plan.metrics]
    functions = [metric for metric in plan.metrics if not isinstance(metric, str)]
    key = fingerprint(plan.scene, plan.values, names, functions, plan.rtol, plan.solver, plan.max_steps)
    about = {
        "runs": plan.count,
        "paths": list(plan.paths),
        "metrics": names,
        "rtol": plan.rtol,
        "solver": None if plan.solver is None else type(plan.solver).__name__,
        "max_steps": plan.max_steps,
        "simbrake": version("simbrake"),
    }
    return Store(folder, key, about)


class _Table:
    """Numbers of all runs, filled in as they come."""

    def __init__(self, plan: Plan, store: Store | None, progress: Any):
        n = plan.count
        self.columns: dict[str, np.ndarray] = {name: np.zeros(n, np.int32) for name in ABOUT}
        self.columns |= {"code": np.full(n, NOT_RUN, np.int32), "energy.closure": np.full(n, np.nan)}
        self.columns |= {name_of(metric): np.full(n, np.nan) for metric in plan.metrics}
        self.columns["method"] = np.full(n, "", dtype="<U32")
        self.done = np.zeros(n, bool)
        self._store = store
        for runs, found in [] if store is None else store.finished():
            self._fill(runs, found)
        self.progress = Progress(n, progress, int(self.done.sum()))

    def _fill(self, runs: np.ndarray, found: dict[str, np.ndarray]) -> None:
        for name, column in found.items():
            self.columns[name][runs] = column
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
        return (
            sum(self.columns[name][runs] for name in ("steps", "rejected", "retaken")) + self.columns["segments"][runs]
        )


def _run_group(plan: Plan, table: _Table, pool: Any, solver: Any, runs: np.ndarray) -> None:
    """All runs of one solver: a pilot chunk, then the rest in order of cost, then those that need more steps."""
    missing = runs[~table.done[runs]]
    limits = list(plan.limits(solver))
    size = min(plan.chunk, 1 << max(0, math.ceil(math.log2(max(1, len(runs))))))
    if len(missing) > plan.chunk * pool.workers and not np.any(table.done[runs]):
        pilot = missing[spread(len(missing), size)]
        again = _run_level(plan, table, pool, solver, pilot, limits[0], size, len(limits) == 1)
        if len(limits) > 1 and 2 * len(again) > len(pilot):
            limits = limits[1:]  # most runs are longer
        missing = runs[~table.done[runs]]
    known = runs[table.done[runs]]
    if len(known) > 1:
        where = np.searchsorted(runs, known)
        cost = expected_cost(plan.columns[runs], where, table.attempts(known))
        cost = cost[np.searchsorted(runs, missing)]
        missing = missing[np.argsort(-cost, kind="stable")]
    for limit in limits:
        missing = _run_level(plan, table, pool, solver, missing, limit, size, limit == limits[-1])


def _run_level(
    plan: Plan, table: _Table, pool: Any, solver: Any, runs: np.ndarray, limit: int, size: int, last: bool
) -> np.ndarray:
    """Runs in chunks with one limit of the steps; gives back those for which it was too low, in the same order."""
    job = Job(plan.scene, plan.paths, plan.metrics, solver, plan.rtol, limit)
    size = max(1, min(size, _ROWS // limit))
    for start in range(0, len(runs), size):
        part = runs[start : start + size]
        pool.submit(Task(job, limit, part, tuple(array[part] for array in plan.values.values()), size, last))
    for task, columns in pool.results():
        table.put(task, columns)
    return runs[~table.done[runs]]
