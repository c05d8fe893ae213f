"""Many runs of one structure as one program: integrated side by side, then measured."""

import dataclasses
import functools
import threading
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ._compiling import cpu_compiler_options
from ._edit import with_values
from ._measure import Metric, measure, name_of
from ._metrics import PEAKS
from ._result import Result
from ._scene import Scene
from ._simulate import simulate

#: rows of a record that are measured: the next of these sizes that holds the longest run of a chunk
_SIZES = tuple(64 * 4**i for i in range(8))
#: of every run besides its metrics
ABOUT = ("code", "band", "inner", "moved", "steps", "rejected", "retaken", "segments", "energy.closure")


@dataclasses.dataclass(frozen=True, eq=False)
class Job:
    """What all runs of a chunk share. Structure and metrics are compiled in, numbers are not."""

    scene: Scene
    paths: tuple[str, ...]
    metrics: tuple[Metric, ...]
    solver: Any
    rtol: float
    max_steps: int

    @functools.cached_property
    def key(self) -> tuple[Any, ...]:
        """Equal for jobs that share a compiled program (with rows of the same shapes)."""
        leaves, structure = jax.tree.flatten(self.scene)
        shapes = tuple((np.shape(leaf), type(leaf)) for leaf in leaves)
        return structure, shapes, self.paths, self.solver, self.max_steps


def _integrate(scene: Scene, rows: Any, rtol: Any, *, paths: tuple[str, ...], solver: Any, max_steps: int) -> Result:
    def one(row: Any) -> Result:
        changed = with_values(scene, dict(zip(paths, row, strict=True)))
        return simulate(changed, solver=solver, rtol=rtol, max_steps=max_steps)

    return jax.vmap(one)(rows)


def scans(metric: Metric) -> bool:
    """Whether a metric looks into every step (greatest values), or may do so (functions)."""
    return not isinstance(metric, str) or metric in PEAKS or metric.startswith("peak_")


def _about(result: Result) -> dict[str, Any]:
    record, stats = result.record, result.record.stats
    mode: Any = record.mode_end
    numbers = {
        "code": record.code,
        "band": jnp.asarray(mode.band, jnp.int32),
        "inner": jnp.asarray(mode.slides, jnp.int32),
        "moved": jnp.any(record.rows.y[:, 1] != 0.0),
        "steps": stats.accepted,
        "rejected": stats.rejected,
        "retaken": stats.retaken,
        "segments": stats.segments,
        "energy.closure": result.energy["closure"],
    }
    assert tuple(numbers) == ABOUT
    return numbers


def _measured(result: Result, *, metrics: tuple[Metric, ...], size: int, lanes: int) -> dict[str, Any]:
    """Numbers of a batch of results, of which the first `size` rows are used."""
    rows = jax.tree.map(lambda leaf: leaf[:, :size], result.record.rows)
    result = eqx.tree_at(lambda r: r.record.rows, result, rows)

    def light(one: Result) -> dict[str, Any]:
        return _about(one) | {name_of(m): measure(one, m) for m in metrics if not scans(m)}

    def heavy(one: Result) -> dict[str, Any]:
        return {name_of(m): measure(one, m) for m in metrics if scans(m)}

    found = jax.vmap(light)(result)
    # a scan looks at every step several times: a few runs at once are enough work, and all would take gigabytes
    return found | (jax.lax.map(heavy, result, batch_size=lanes) if any(map(scans, metrics)) else {})


@functools.cache
def _programs() -> tuple[Any, Any]:
    options = cpu_compiler_options()
    return (
        jax.jit(_integrate, static_argnames=("paths", "solver", "max_steps"), compiler_options=options),
        jax.jit(_measured, static_argnames=("metrics", "size", "lanes"), compiler_options=options),
    )


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


def run_chunk(job: Job, rows: tuple[np.ndarray, ...], size: int, device: Any = None) -> dict[str, np.ndarray]:
    """Runs the samples `rows` (one array per path, the samples along its first axis), filled up to `size`.

    Gives an array over the samples for every name in `ABOUT`, every metric, and `method`. What a single run would raise
    is not raised: failures are in `code`.
    """
    jax.config.update("jax_enable_x64", True)  # on a worker elsewhere
    count = len(rows[0])
    device = device or jax.devices()[0]
    padded = tuple(np.concatenate([row, np.repeat(row[-1:], size - count, axis=0)]) for row in rows)
    integrate, measured = _programs()
    with jax.default_device(device):
        shapes = (device, *(row.shape for row in padded))
        result = _call(
            (*job.key, shapes),
            integrate,
            job.scene,
            padded,
            np.asarray(job.rtol, np.float64),
            paths=job.paths,
            solver=job.solver,
            max_steps=job.max_steps,
        )
        used = int(np.max(np.asarray(result.record.count))) + 1
        kept = min(next((n for n in _SIZES if n >= used), used), job.max_steps + 1)
        lanes = 1 if device.platform == "cpu" else 16
        key = (*job.key, shapes, job.metrics, kept)
        found = _call(key, measured, result, metrics=job.metrics, size=kept, lanes=lanes)
    columns = {name: np.asarray(value)[:count] for name, value in jax.device_get(found).items()}
    return columns | {"method": np.full(count, type(job.solver).__name__, dtype="<U32")}
