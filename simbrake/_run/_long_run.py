"""Long runs: in stretches of step attempts, between which one can say how far the run is, or interrupt it."""

import functools
import time
from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from .._base._compiling import Packing, Program, compiled, run_device
from .._hybrid import AbstractHybridSystem, AbstractMethod, Code, Record, Settings, beginning, joined, stretch
from .._parts._scene import Scene
from .._physics._assemble import assemble

#: step attempts in a stretch at most
STRETCH = 1024
#: lines up to which a program as one function takes no longer to compile
LONGEST = 9_000
#: least number of steps in a run under profiles that are not piecewise simple
_SLICES = 64
#: attempts in the first stretch where somebody waits: enough to tell how long one takes
_FIRST = 64
#: seconds that a stretch should take where somebody waits for it
_TARGET = 0.25

#: told of the time reached and the end time, both s
Tell = Callable[[float, float], Any]


def posed(
    scene: Scene, rtol: Any, max_step: Any, max_events: Any, max_steps: int
) -> tuple[AbstractHybridSystem, Any, Any, Settings]:
    """What is to be integrated: system, state and mode at the start, and the settings of the integrator."""
    system, state, mode = assemble(scene)
    if system.guard_samples:
        # a profile of one's own may hide a pulse: with the samples inside a step, 1/1000 of the run is looked at
        span = jnp.asarray(scene.end_time) - jnp.asarray(scene.initial.time)
        max_step = jnp.minimum(max_step, span / _SLICES)
    settings = Settings(
        rtol=rtol,
        max_step=max_step,
        max_events=max_events,
        max_steps=max_steps,
        guard_samples=system.guard_samples,
    )
    return system, state, mode, settings


@functools.lru_cache(maxsize=64)
def _program(packing: Packing, method: AbstractMethod, device: Any) -> tuple[Program, np.ndarray]:
    """One stretch of all runs of one structure, compiled: a function of the numbers, what the stretch before has left,
    and its length, in one vector; and what the first stretch begins with."""

    def begin(numbers: Any) -> Any:
        scene, *limits = packing.unpack(numbers)
        system, state, mode, _ = posed(scene, *limits, max_steps=STRETCH)
        return beginning(system, state, mode, scene.initial.time)

    n = packing.size
    size = jax.eval_shape(begin, np.ones(n)).shape[0]

    def run(x: Any) -> tuple[Record, Any]:
        scene, *limits = packing.unpack(x[:n])
        system, state, mode, settings = posed(scene, *limits, max_steps=STRETCH)
        ends = scene.initial.time, scene.end_time
        return stretch(system, state, mode, *ends, method, settings, x[n:-1], x[-1].astype(jnp.int32))

    return compiled(run, np.ones(n + size + 1), longest=LONGEST, device=device), np.full(size, np.nan)


def long_run(
    numbers: np.ndarray, packing: Packing, method: AbstractMethod, rooms: Sequence[int], tell: Tell | None = None
) -> Record:
    """A run of up to `rooms[-1]` step attempts; its record has space for the least of `rooms` that is enough.

    The record is the same to the last bit whether somebody is told or not: stretches are then shorter, no more.
    """
    program, carried = _program(packing, method, run_device())
    scene: Scene = packing.unpack(numbers)[0]
    t, end = float(scene.initial.time), float(scene.end_time)
    if tell is not None:
        tell(t, end)
    rows: list[Any] = []  # of the stretches before
    left, length = rooms[-1], STRETCH if tell is None else _FIRST
    while True:
        begun = time.monotonic()
        part, carried = program.call(np.concatenate([numbers, carried, [float(min(length, left))]]))
        count = int(part.count)
        rows.append(jax.tree.map(lambda leaf, n=count: np.asarray(leaf)[:n].copy(), part.rows))
        left -= count
        if int(part.code) != Code.STEP_LIMIT or left <= 0:
            break
        if tell is not None:
            tell(float(part.t_end), end)
            spent = max(time.monotonic() - begun, 1e-6)
            length = int(np.clip(length * np.clip(_TARGET / spent, 0.25, 4.0), 1, STRETCH))
    if tell is not None:
        tell(float(part.t_end), end)
    used = rooms[-1] - left
    return joined(rows, part, next(room for room in rooms if used <= room))
