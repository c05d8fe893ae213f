"""Runs at many points: chunks of runs by one program, or each run by itself."""

import dataclasses
import functools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeAlias, TypeGuard

import jax
import jax.numpy as jnp
import numpy as np

from .._base._compiling import LONGEST, Program, megabytes, program_of
from .._base._packing import Packing, pack
from .._base._store import MEMORY
from ..hybrid import LANDED, Record, Rodas5P
from ..hybrid.arrays import Array, numpy_of
from ..outputs.judgement import COLOURS, REASONS, Judgement, judge_of_many
from ..outputs.metrics import HOLDING, METRICS, identity_of, metric_names
from ..outputs.torques import ends_driven
from ..parts.scene import Scene
from ..runs.measure import MetricLike, measure, measure_all, name_of
from ..runs.result import Result
from ..runs.simulate import Solver, simulate, simulate_lane, solver_name, step_limits
from .bounds import Paths

#: arrays over runs, by name
Columns: TypeAlias = dict[str, np.ndarray]
#: step attempts that suffice for most stops without heat: a shorter record than the
#: first limit of a single run, faster to write and to measure
_SHORT = 128
#: rows of all records of a chunk together, where steps are recorded (with some hundred
#: columns half a gigabyte), and where only events are
_ROWS_OF_STEPS = 2**19
_ROWS_OF_EVENTS = 2**22
#: runs side by side on a CPU
LANES = 64


def _moved(record: Record) -> Array:
    """Whether the pulley turned at any time."""
    xp = numpy_of(record.rows.t)
    used = xp.arange(record.rows.t.shape[0], dtype=np.int32) <= record.count
    states = record.states
    return xp.any(used & ((states.omega != 0.0) | (states.phi != states.phi[0])))


def _sequence(record: Record) -> Array:
    """A hash of the events of a run: their kinds and the modes after them, in their
    order."""
    xp = numpy_of(record.rows.t)
    rows = record.rows
    n = rows.t.shape[0]
    events = (xp.arange(n, dtype=np.int32) < record.count) & (rows.kind >= LANDED)
    after = xp.concatenate([rows.mode[1:], rows.mode[-1:]]).astype(np.uint32)
    odd = (2 * np.arange(after.shape[1]) + 1).astype(np.uint32) * np.uint32(2654435761)
    what = xp.sum(after * odd, axis=1, dtype=np.uint32)
    what = (what + (rows.kind + 11).astype(np.uint32)) * np.uint32(2654435761)
    order = xp.cumsum(events).astype(np.uint32) * np.uint32(2246822519) | np.uint32(1)
    mixed = xp.sum(xp.where(events, (what ^ (what >> 15)) * order, 0), dtype=np.uint32)
    return (mixed >> 1).astype(np.int32)


class Coded(NamedTuple):
    """The part of a judgement that a table of many runs keeps."""

    reason: Any
    colour: Any
    steady: Any
    away: Any


#: how many values each of them can have
_CHOICES = Coded(len(REASONS), len(COLOURS), 2, 2)


def coded(judgement: Judgement) -> Array:
    """A judgement as one whole number."""
    number = jnp.zeros((), jnp.int32)
    for name, choices in _CHOICES._asdict().items():
        number = choices * number + jnp.asarray(getattr(judgement, name), jnp.int32)
    return number


def decoded(numbers: np.ndarray) -> Coded:
    """Judgements from numbers of `coded`."""
    return Coded(*np.unravel_index(np.asarray(numbers, int), _CHOICES))


_CLOSURE = "energy.closure"
#: columns of every table of runs, besides its metrics
RUN_COLUMNS: dict[str, Callable[[Result], Any]] = {
    "code": lambda r: r.record.code,
    "band": lambda r: r.record.mode_end.band,
    "inner": lambda r: r.record.mode_end.slides,
    "turn": lambda r: 1 if r.record.mode_end.turn is None else r.record.mode_end.turn,
    "moved": lambda r: _moved(r.record),
    "driven": lambda r: ends_driven(r.record),
    "judged": lambda r: coded(judge_of_many(r.record)),
    "steps": lambda r: r.record.stats.accepted,
    "rejected": lambda r: r.record.stats.rejected,
    "retaken": lambda r: r.record.stats.retaken,
    "segments": lambda r: r.record.stats.segments,
    "sequence": lambda r: _sequence(r.record),
    _CLOSURE: lambda r: r.energy["closure"],
}


class Job(NamedTuple):
    """Properties that all runs of a chunk share. Structure and metrics are compiled in,
    numbers are not.

    - `size`: how many runs a chunk has at most; 0: each run by itself
    - `room`: how many instants of events a run may have, where only events are recorded
    """

    scene: Scene
    paths: Paths
    metrics: tuple[MetricLike, ...]
    solver: Solver
    rtol: float
    max_steps: int
    size: int
    room: int

    @property
    def recorded(self) -> bool:
        """Whether steps are recorded, as a metric needs them: a user's function, the
        holding reserve, or a mean."""
        return any(
            not isinstance(metric, str) or metric == HOLDING or _is_if_asked(metric)
            for metric in self.metrics
        )

    @property
    def measured(self) -> tuple[MetricLike, ...]:
        """Metrics that its program computes: those asked for, and all of simbrake's own
        that cost next to nothing, so that one program serves for any of them."""
        cheap = (
            name
            for name in default_metrics(self.scene)
            if isinstance(identity_of(name), str)
        )
        return tuple(dict.fromkeys([*cheap, *self.metrics]))

    @property
    def lanes(self) -> int:
        """Runs side by side on a CPU: more than one only where runs are short, explicit,
        and of one rigid or elastic mechanism.

        Others would become slower: long runs reach their events at too different times,
        implicit steps of many lanes leave the fast memory, and the changes of mode of
        staged brakes and of single linings are more work side by side.
        """
        brake = self.scene.brake
        alone = (
            self.recorded
            or isinstance(self.solver, Rodas5P)
            or brake.in_series
            or brake.resolved
        )
        return 1 if alone or self.max_steps > _SHORT else min(LANES, self.size)

    def fitting(self) -> "Job":
        """The same with chunks whose records fit."""
        most = _ROWS_OF_EVENTS // self.room
        if self.recorded:
            most = _ROWS_OF_STEPS // self.max_steps
        return self._replace(size=max(1, min(self.size, most)))


def limits_of_many(
    scene: Scene, solver: Solver, max_steps: int | None
) -> tuple[int, ...]:
    """Limits of the step attempts of many runs, tried in turn: long records cost time
    and memory even where they are not filled."""
    limits = step_limits(scene, max_steps)
    # with heat a long duty or an implicit method usually needs more, and a program with
    # too low a limit is compiled in vain
    long = scene.heated and (isinstance(solver, Rodas5P) or limits[0] > 8 * _SHORT)
    return limits if max_steps or long else (_SHORT, *limits)


def is_maximum(metric: MetricLike) -> TypeGuard[str]:
    """Whether a metric is a maximum over the run."""
    return isinstance(metric, str) and metric in METRICS and METRICS[metric].greatest


def _is_if_asked(metric: str) -> bool:
    return metric in METRICS and METRICS[metric].if_asked


def default_metrics(scene: Scene) -> tuple[str, ...]:
    """All metrics of a scene, except maxima, which cost half a run more, and those that
    a run has only if they are asked for."""
    return tuple(
        name
        for name in metric_names(scene)
        if not (is_maximum(name) or _is_if_asked(name))
    )


def _integrate(
    numbers: Array,
    *,
    like: Packing,
    job: Job,
    metrics: Sequence[MetricLike],
    lanes: int,
) -> Array:
    """Columns (names, runs) of a chunk, computed in groups of as many runs as lanes, up
    to the number of points."""
    scene, rows, rtol, count = like.unpack(numbers)
    maxima = tuple(filter(is_maximum, metrics))
    others = [metric for metric in metrics if metric not in maxima]

    def values_of_run(x: Array) -> Array:
        varied = job.paths(scene, x)
        if lanes == 1 or job.recorded:
            result = simulate(
                varied, solver=job.solver, rtol=rtol, max_steps=job.max_steps
            )
            values = measure_all(result, metrics)
        else:
            result, tops = simulate_lane(
                varied, job.solver, rtol, job.max_steps, job.room, maxima
            )
            found = dict(zip(others, measure_all(result, others), strict=True)) | tops
            values = [found[metric] for metric in metrics]
        columns = [*(find(result) for find in RUN_COLUMNS.values()), *values]
        return jnp.stack([jnp.asarray(value, jnp.float64) for value in columns])

    def group(i: Array | int) -> Array:
        if lanes == 1:
            row = jax.lax.dynamic_index_in_dim(rows, i, keepdims=False)
            return values_of_run(row)[:, None]
        some = jax.lax.dynamic_slice_in_dim(rows, i * lanes, lanes)
        return jax.vmap(values_of_run, out_axes=1)(some)

    if lanes == job.size:
        return group(0)

    def body(carry: tuple[Array, Array]) -> tuple[Array, Array]:
        i, table = carry
        return i + 1, jax.lax.dynamic_update_slice_in_dim(table, group(i), i * lanes, 1)

    height = len(RUN_COLUMNS) + len(metrics)
    begin = jnp.asarray(0, jnp.int32), jnp.zeros((height, job.size))
    return jax.lax.while_loop(lambda carry: carry[0] * lanes < count, body, begin)[1]


def _integrator(job: Job, numbers: Array, like: Packing, device: Any) -> Program:
    """The compiled integration of a chunk whose parameters are laid out as `like`; one
    thread compiles, the others wait.

    On a CPU groups of lanes follow one another: more than a few dozen lanes gain
    nothing there, and every lane waits for the slowest.
    """
    metrics = job.measured
    lanes = job.lanes if device.platform == "cpu" else job.size
    # the numbers of the scene are in the vector: a cached program must not hold them
    without = job._replace(scene=None)
    run = functools.partial(
        _integrate, like=like, job=without, metrics=metrics, lanes=lanes
    )
    asked = tuple(map(identity_of, metrics))
    subject = ("chunk", like, job.paths, asked, job.solver, *job[5:], lanes)

    def make() -> Program:
        return program_of(run, numbers, subject=subject, longest=LONGEST)

    return MEMORY.get((*subject, device), make, megabytes)


def run_chunk(job: Job, rows: np.ndarray, device: Any = None) -> Columns:
    """Runs the points `rows` (points, numbers), `job.size` at most, or each by itself.

    Gives an array over the points for every name in `RUN_COLUMNS`, every metric, and
    `method`. A run that fails raises nothing: its failure is in `code`.
    """
    run = _side_by_side if job.size else _one_by_one
    found = run(job, rows, device)
    integers = RUN_COLUMNS.keys() - {_CLOSURE}
    columns = {
        name: found[name].astype(np.int32 if name in integers else np.float64)
        for name in [*RUN_COLUMNS, *map(name_of, job.metrics)]
    }
    method = np.full(len(rows), solver_name(job.solver), dtype="<U32")
    return columns | {"method": method}


def _side_by_side(job: Job, rows: np.ndarray, device: Any) -> Columns:
    count = len(rows)
    device = device or jax.devices()[0]
    filled = rows[np.minimum(np.arange(job.size), count - 1)]
    numbers, like = pack((job.scene, filled, job.rtol, np.asarray(count, np.int32)))
    with jax.default_device(device):
        integrate = _integrator(job, numbers, like, device).call
        table = jax.block_until_ready(integrate(numbers))
    names = [*RUN_COLUMNS, *map(name_of, job.measured)]
    return dict(zip(names, np.asarray(table)[:, :count], strict=True))


def _one_by_one(job: Job, rows: np.ndarray, device: Any) -> Columns:
    """Columns of a chunk by the program of single runs, which a scene that ran before
    has on disk."""
    names = [*RUN_COLUMNS, *job.metrics]

    def values(row: np.ndarray) -> list[float]:
        result = simulate(
            job.paths(job.scene, row),
            solver=job.solver,
            rtol=job.rtol,
            max_steps=job.max_steps or None,
            throw=False,
        )
        energy = result.energy
        result = dataclasses.replace(result, record=result.record.compact())

        def value(name: str) -> Any:
            if name.startswith("energy."):
                return energy[name.removeprefix("energy.")]
            if (find := RUN_COLUMNS.get(name)) is not None:
                return find(result)
            # (a number may take away what a metric is of, as a load)
            lost = METRICS[name].needs.lacks(result.scene)
            return np.inf if lost else measure(result, name)

        return [float(value(name)) for name in names]

    return dict(zip(names, np.array([*map(values, rows)]).T, strict=True))
