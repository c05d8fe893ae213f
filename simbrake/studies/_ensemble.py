"""Many runs of one scene with other numbers, in one call, and their data set."""

import dataclasses
import os
import sys
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from .._base._arguments import explained
from .._base._faults import Issues
from .._base._store import trace_anew
from ..outputs.judgement import COLOURS, REASONS
from ..outputs.log import status_of
from ..outputs.metrics import RESIDUALS
from ..parts.scene import Scene, require_scene
from ..physics.mechanism import Label
from ..results.stored import Dataset
from ..runs.errors import error_of_layers, errors_between, second_rtol
from ..runs.measure import MetricLike, name_of, unit_of
from ..runs.mesh import cuts_of, with_finer_layers
from ..runs.simulate import require_64_bits, require_compiling, simulate
from ..thermal.mesh import finer_values
from ._many_runs import NOT_RUN, Client, Show, run_all
from ._plan import Plan, plan_of
from .bounds import array_in_si
from .evaluating import Solver, failure_name
from .many_points import Columns, decoded

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
    metrics: MetricLike | Sequence[MetricLike] | None = None,
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
    metrics: MetricLike | Sequence[MetricLike] | None = None,
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
    if issues and axes:  # what else is wrong, in the same report
        firsts = {path: axis[:1] for path, axis in axes.items()}
        issues.attempt(plan_of, scene, firsts, metrics, 1e-10, None, None, None)
    issues.report()
    grid = np.meshgrid(*axes.values(), indexing="ij") if axes else []
    columns = {path: part.ravel() for path, part in zip(axes, grid, strict=True)}
    return _as_grid(ensemble(scene, columns, metrics, **settings), axes)
