"""Many runs of one structure as one program."""

import dataclasses
import functools
import threading
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from .._base._compiling import DeviceJit, Packing, Program, compiled, pack
from .._parts._scene import Scene
from .._run._balance import end_capacity
from .._run._edit import with_values
from .._run._measure import Metric, measure, name_of
from .._run._metrics import METRICS
from .._run._result import Result
from .._run._simulate import simulate

#: rows of a record that are measured: the next of these sizes that holds the longest run of a chunk
_SIZES = tuple(64 * 4**i for i in range(8))
#: of every run besides its metrics
ABOUT = ("code", "band", "inner", "moved", "exceeded", "steps", "rejected", "retaken", "segments", "energy.closure")


@dataclasses.dataclass(frozen=True, eq=False)
class Job:
    """What all runs of a chunk share. Structure and metrics are compiled in, numbers are not."""

    scene: Scene
    paths: tuple[str, ...]
    metrics: tuple[Metric, ...]
    solver: Any
    rtol: float
    max_steps: int


def scans(metric: Metric) -> bool:
    """Whether a metric looks into every step (greatest values), or may do so (functions)."""
    return not isinstance(metric, str) or (metric in METRICS and METRICS[metric].greatest)


def _about(result: Result) -> dict[str, Any]:
    record, stats = result.record, result.record.stats
    mode: Any = record.mode_end
    numbers = {
        "code": record.code,
        "band": jnp.asarray(mode.band, jnp.int32),
        "inner": jnp.asarray(mode.slides, jnp.int32),
        "moved": jnp.any(record.rows.y[:, 1] != 0.0),
        "exceeded": end_capacity(record).exceeded,
        "steps": stats.accepted,
        "rejected": stats.rejected,
        "retaken": stats.retaken,
        "segments": stats.segments,
        "energy.closure": result.energy["closure"],
    }
    assert tuple(numbers) == ABOUT
    return numbers


def _integrate(
    numbers: Any,
    *,
    like: Packing,
    paths: tuple[str, ...],
    solver: Any,
    metrics: tuple[Metric, ...],
    max_steps: int,
    each: Any,
) -> tuple[dict[str, Any], Result | None]:
    """Numbers of every run, and the runs themselves where a metric looks into all their steps."""
    scene, rows, rtol = like.unpack(numbers)

    def one(row: Any) -> tuple[dict[str, Any], Result | None]:
        changed = with_values(scene, dict(zip(paths, row, strict=True)))
        result = simulate(changed, solver=solver, rtol=rtol, max_steps=max_steps)
        light = {name_of(m): measure(result, m) for m in metrics if not scans(m)}
        return _about(result) | light, result if any(map(scans, metrics)) else None

    return each(one, rows)


def _side_by_side(one: Any, rows: Any) -> Any:
    return jax.vmap(one)(rows)


def _scanned(result: Result, *, metrics: tuple[Metric, ...], size: int, lanes: int) -> dict[str, Any]:
    """Metrics that look into all steps of a batch of results, of which the first `size` rows are used."""
    rows = jax.tree.map(lambda leaf: leaf[:, :size], result.record.rows)
    result = eqx.tree_at(lambda r: r.record.rows, result, rows)

    def heavy(one: Result) -> dict[str, Any]:
        return {name_of(m): measure(one, m) for m in metrics if scans(m)}

    # a scan looks at every step several times: a few runs at once are enough work, and all would take gigabytes
    return jax.lax.map(heavy, result, batch_size=lanes)


_scanner = DeviceJit(_scanned, static_argnames=("metrics", "size", "lanes"))


#: compiled integrations, the latest last; a program takes a megabyte or more
_integrators: dict[Any, Program] = {}
_KEPT = 16
_ready: set[Any] = set()
_compiling = threading.Lock()


def _call(key: Any, program: Any, *arguments: Any, **static: Any) -> Any:
    """A compiled program's answer; of several threads that want it first, one compiles and the others wait."""
    if key in _ready:
        return jax.block_until_ready(program(*arguments, **static))
    with _compiling:
        found = jax.block_until_ready(program(*arguments, **static))
        _ready.add(key)
    return found


def _integrator(job: Job, numbers: np.ndarray, like: Packing, device: Any) -> Program:
    """The compiled integration of a chunk whose numbers lie like this; one thread compiles and the others wait.

    On a CPU the runs follow one another, if XLA can make one function of it: side by side every step that is an event
    for one of them would cost all of them the work of an event, and the arithmetic becomes no faster.
    """
    key = (like, job.paths, job.solver, job.metrics, job.max_steps, device)
    with _compiling:
        if key not in _integrators:
            shared = {"like": like, "paths": job.paths, "solver": job.solver, "metrics": job.metrics}
            run = functools.partial(_integrate, **shared, max_steps=job.max_steps)
            serial, parallel = (functools.partial(run, each=each) for each in (jax.lax.map, _side_by_side))
            _integrators[key] = compiled(serial, numbers, otherwise=parallel, device=device)
            while len(_integrators) > _KEPT:
                del _integrators[next(iter(_integrators))]
        return _integrators[key]


def run_chunk(job: Job, rows: tuple[np.ndarray, ...], size: int, device: Any = None) -> dict[str, np.ndarray]:
    """Runs the samples `rows` (one array per path, the samples along its first axis), filled up to `size`.

    Gives an array over the samples for every name in `ABOUT`, every metric, and `method`. What a single run would raise
    is not raised: failures are in `code`.
    """
    jax.config.update("jax_enable_x64", True)  # on a worker elsewhere
    count = len(rows[0])
    device = device or jax.devices()[0]
    padded = tuple(np.concatenate([row, np.repeat(row[-1:], size - count, axis=0)], dtype=np.float64) for row in rows)
    numbers, like = pack((job.scene, padded, job.rtol))
    with jax.default_device(device):
        found, result = jax.block_until_ready(_integrator(job, numbers, like, device).call(numbers))
        if result is not None:
            used = int(np.max(np.asarray(result.record.count))) + 1
            kept = min(next((n for n in _SIZES if n >= used), used), job.max_steps + 1)
            lanes = 1 if device.platform == "cpu" else 16
            key = (like, job.solver, job.max_steps, device, job.metrics, kept)
            found = found | _call(key, _scanner, result, metrics=job.metrics, size=kept, lanes=lanes)
    columns = {name: np.asarray(value)[:count] for name, value in jax.device_get(found).items()}
    return columns | {"method": np.full(count, type(job.solver).__name__, dtype="<U32")}
