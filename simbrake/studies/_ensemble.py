"""Many runs of one scene with other numbers, in one call: what is to run, the runs, and their data set."""

import math
import os
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from .._base._faults import Fault, InputError
from .._base._quantity import Quantity
from .._parts._scene import Scene, faults
from .._physics._mechanism import Label
from .._run._log import FAILURES, status_of
from .._run._measure import Metric, check_metrics, name_of, unit_of
from .._run._metrics import METRICS, metric_names
from .._run._simulate import require_64_bits
from ._chunks import NOT_RUN, Plan, run_all

#: scenes looked at as a whole, besides those with the minimum and the maximum of every parameter
_LOOKED_AT = 16
#: runs named in one fault
_NAMED = 5


def default_metrics(scene: Scene) -> tuple[str, ...]:
    """Everything that a scene has but maxima: these look at every step, which costs many times the run."""
    return tuple(name for name in metric_names(scene) if name not in METRICS or not METRICS[name].greatest)


def plan_of(
    scene: Scene,
    values: Mapping[str, Any],
    metrics: Sequence[Metric] | None,
    *,
    rtol: float,
    solver: Any,
    max_steps: int | None,
    chunk: int,
) -> Plan:
    """The plan, or `InputError` with all errors of values, ranges, metrics and settings."""
    arrays, found = _arrays(values)
    for name, value, good in (
        ("rtol", rtol, 1e-15 < float(rtol) < 0.1),
        ("chunk", chunk, chunk >= 1),
        ("max_steps", max_steps, max_steps is None or max_steps > 0),
    ):
        if not good:
            found.append(Fault(name, f"{value} is out of range", "0 < rtol < 0.1, chunk and max_steps > 0"))
    if found:
        raise InputError(found)
    asked = default_metrics(scene) if metrics is None else tuple(metrics)
    plan = Plan(scene, arrays, asked, float(rtol), solver, max_steps, int(chunk))
    first = plan.one(0)  # names that the scene does not have are told here
    found = [fault for path, about in plan.abouts().items() for fault in _outside(path, arrays[path], about)]
    try:
        check_metrics(first, asked)
    except InputError as error:
        found += error.faults
    names = [name_of(metric) for metric in asked]
    twice = {name for name in names if names.count(name) > 1}
    found += [Fault(name, "is asked for twice", "functions are told apart by their names") for name in sorted(twice)]
    found = found or _of_times(plan) or _of_scenes(plan)
    if found:
        raise InputError(found)
    return plan


def _arrays(values: Mapping[str, Any]) -> tuple[dict[str, np.ndarray], list[Fault]]:
    arrays: dict[str, np.ndarray] = {}
    found: list[Fault] = [] if values else [Fault("values", "nothing varies", "give {path: array of values}")]
    for path, value in values.items():
        try:
            array = np.array(value, dtype=np.float64)
        except (TypeError, ValueError):
            found.append(Fault(path, "its values are not numbers", "an array (runs,), or (runs, entries)"))
            continue
        if array.ndim not in (1, 2) or array.size == 0:
            shape = f"has the shape {array.shape}"
            found.append(Fault(path, shape, "an array (runs,), or (runs, entries) for a number with entries"))
        arrays[path] = array
    counts = {path: len(array) for path, array in arrays.items() if array.ndim}
    if len(set(counts.values())) > 1:
        each = ", ".join(f"{path} {count}" for path, count in counts.items())
        found.append(Fault("values", f"the numbers of runs differ: {each}", "give every number once for every run"))
    return arrays, found


def _named(runs: Any) -> str:
    """`(run 3)`, `(runs 3, 4, 5, 6, 7 and 12 more)`."""
    more = f" and {len(runs) - _NAMED} more" if len(runs) > _NAMED else ""
    return f"({'run' if len(runs) == 1 else 'runs'} {', '.join(str(i) for i in runs[:_NAMED])}{more})"


def _outside(path: str, array: np.ndarray, about: Quantity) -> list[Fault]:
    """One fault for all values of a number outside its range, with the runs that have them."""
    bad = np.argwhere(~about.admits(array).reshape(len(array), -1))
    if len(bad) == 0:
        return []
    worst = array.reshape(len(array), -1)[tuple(bad[0])]
    what = f"{worst:g} {about.unit} is out of range {_named(np.unique(bad[:, 0]))}"
    return [Fault(path, what, f"{about.meaning} must be {about.range} {about.unit}")]


def _of_times(plan: Plan) -> list[Fault]:
    """Runs that end before they start: these would come back as if they had reached their end."""
    start, end = (
        np.broadcast_to(plan.values.get(path, np.asarray(value, np.float64)), (plan.count,))
        for path, value in (("initial.time", plan.scene.initial.time), ("end_time", plan.scene.end_time))
    )
    bad = np.flatnonzero(~(end > start))
    what = f"{end[bad[0]]:g} s is not after the start {_named(bad)}" if len(bad) else ""
    return [Fault("end_time", what, "it must be later")] if len(bad) else []


def _of_scenes(plan: Plan) -> list[Fault]:
    """Faults between numbers, in the runs with the minima and maxima and in some others; each told once."""
    columns = plan.columns
    ends = np.concatenate([columns.argmin(axis=0), columns.argmax(axis=0)])
    step = max(1, math.ceil(plan.count / _LOOKED_AT))
    chosen = np.unique(np.concatenate([ends, np.arange(0, plan.count, step)]))
    seen: dict[tuple[str, str], tuple[Fault, list[int]]] = {}
    for i in chosen:
        for fault in faults(plan.one(int(i))):
            seen.setdefault((fault.path, fault.hint), (fault, []))[1].append(int(i))
    found = []
    for fault, runs in seen.values():
        found.append(Fault(fault.path, f"{fault.problem} {_named(runs)}", fault.hint))
    return found


_MEANINGS = {
    "code": "0 if the run reached its end time, else its failure code; -1: not run",
    "steps": "steps accepted",
    "rejected": "step attempts rejected for their error",
    "retaken": "steps taken again, shorter, at events",
    "segments": "parts of the run between events",
    "energy.closure": "residual of the energy balance as a share of the largest energy exchanged",
}


def status_names(columns: dict[str, np.ndarray]) -> np.ndarray:
    """How every run ended, in the words of `Result.status`; `not_run` where it did not take place."""
    code, band = columns["code"], columns["band"]
    yes_or_no = [columns[name].astype(bool).astype(code.dtype) for name in ("moved", "exceeded")]
    kinds = np.stack([code, band, columns["inner"], *yes_or_no], axis=1)
    distinct, which = np.unique(kinds, axis=0, return_inverse=True)
    names = np.asarray([_status(*(int(number) for number in kind)) for kind in distinct], dtype=object)
    return names[which.reshape(-1)].astype(str)


def _status(code: int, band: int, inner: int, moved: int, exceeded: int) -> str:
    if code == NOT_RUN:
        return "not_run"
    if code:
        return FAILURES[code][0]  # pyright: ignore
    return str(status_of(Label(band, inner), bool(moved), lambda: bool(exceeded)))


def _as_dataset(plan: Plan, columns: dict[str, np.ndarray]) -> Any:
    """One row per run: the varied numbers as coordinates, metrics, result code and step counts as variables."""
    import xarray as xr

    coords: dict[str, Any] = {"run": ("run", np.arange(plan.count), {"meaning": "number of the run, from 0"})}
    for path, about in plan.abouts().items():
        array = plan.values[path]
        dims = ("run",) if array.ndim == 1 else ("run", f"{path} entry")
        coords[path] = (dims, array, {"units": about.unit, "meaning": about.meaning})
    data: dict[str, Any] = {}
    for metric in plan.metrics:
        name = name_of(metric)
        data[name] = ("run", columns[name], {"units": unit_of(metric)} if unit_of(metric) else {})
    for name, meaning in _MEANINGS.items():
        data[name] = ("run", columns[name], {"units": "1", "meaning": meaning})
    data["status"] = ("run", status_names(columns), {"meaning": "how the run ended"})
    data["method"] = ("run", columns["method"].astype(str), {"meaning": "solver of the run"})
    return xr.Dataset(data, coords, {"rtol": plan.rtol, "simbrake": version("simbrake"), "jax": version("jax")})


def _as_grid(flat: Any, axes: dict[str, np.ndarray]) -> Any:
    """The data set of a full grid (the last number varies fastest) with one dimension per number."""
    import xarray as xr

    shape = tuple(len(axis) for axis in axes.values())
    data = {
        name: (tuple(axes), variable.values.reshape(shape), variable.attrs) for name, variable in flat.data_vars.items()
    }
    data["run"] = (tuple(axes), np.arange(int(np.prod(shape))).reshape(shape), flat["run"].attrs)
    coords = {path: (path, axis, flat[path].attrs) for path, axis in axes.items()}
    return xr.Dataset(data, coords, flat.attrs)


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
      default everything the scene has but maxima (`max_…`, `peak_…`), which cost many times the run
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
    in `simbrake.results.FAILURES`, or −1), `status` (the words of `Result.status`, or `not_run`), `steps`, `rejected`,
    `retaken`, `segments`, `energy.closure` and `method`. A run that fails raises nothing. Times of what did not happen
    are `inf`. Ctrl-C ends the call early: what is finished is returned, the rest has the code −1 and `NaN`.

    Every value is checked against its range, and every end against its start. What else `check` demands of a scene is
    looked at in the runs with the minimum and the maximum of every parameter and in 16 others.

    Raises `InputError` with all errors at once, and `RuntimeError` if JAX is not in 64-bit mode.
    """
    require_64_bits()
    plan = plan_of(scene, values, metrics, rtol=rtol, solver=solver, max_steps=max_steps, chunk=chunk)
    if workers is not None and workers < 1:
        raise InputError([Fault("workers", f"{workers} is out of range", "at least 1")])
    folder = None if directory is None else Path(directory)
    columns = run_all(plan, workers=workers, client=client, directory=folder, progress=progress)
    return _as_dataset(plan, columns)


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
            faults.append(Fault(path, "is not a list of different numbers", "a grid needs every value once"))
        axes[path] = array
    if faults:
        raise InputError(faults)
    grid = np.meshgrid(*axes.values(), indexing="ij") if axes else []
    columns = {path: part.ravel() for path, part in zip(axes, grid, strict=True)}
    return _as_grid(ensemble(scene, columns, metrics, **settings), axes)
