"""Where derivatives of a run exist on one side only, as far as the run itself shows
it."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree

from .._base._compiling import Compiled
from .._base._part import leaves
from ..hybrid import LANDED, STOPPED, Record
from ..hybrid.arrays import Array
from ..parts.scene import Scene

#: two events within this share of a run are nearly simultaneous
NEAR = 1e-6
#: a guard is grazed if it passes 0 so slowly that its size of order one would take this
#: many runs
GRAZE = 1e4


def jumps_at_start(scene: Scene) -> list[str]:
    """Profiles of the scene that jump exactly at its start: an earlier jump changes
    nothing, a later one does."""
    start = float(scene.initial.time)
    parts = {leaf.path: np.asarray(leaf.value, float) for leaf in leaves(scene)}
    notes = []
    for path, times in parts.items():
        values = parts.get(f"{path.removesuffix('times')}values")
        if (
            path.endswith(".times")
            and values is not None
            and times.ndim == 1
            and times.shape == values.shape
        ):
            at_start = np.flatnonzero(times == start)
            if len(at_start) > 1 and np.any(values[at_start] != values[at_start[0]]):
                notes.append(
                    f"{path}: a jump at the start: derivatives by its time are those "
                    "of an earlier one, 0"
                )
    return notes


def near_ties(record: Record) -> list[str]:
    """Events so close that a small change may exchange them."""
    n = int(record.count)
    t = np.asarray(record.rows.t)[: n + 1]
    kind = np.asarray(record.rows.kind)[:n]
    at = np.flatnonzero((kind == LANDED) | (kind == STOPPED))
    times = t[at + 1]
    landed = kind[at] == LANDED
    whole = t[-1] - t[0]
    notes = []
    for i in np.flatnonzero((np.diff(times) > 0) & (np.diff(times) < NEAR * whole)):
        if landed[i] or landed[i + 1]:
            what = (
                "events"
                if landed[i] and landed[i + 1]
                else "an event and a corner of a given function"
            )
            words = (
                f"{what} at {times[i]:.9g} s and {times[i + 1] - times[i]:.2g} s "
                "later nearly coincide"
            )
            notes.append(
                f"{words}: derivatives are one-sided, valid until the two change their order"
            )
    return notes


def _approach(record: Record, index: Array) -> tuple[Array, Array, Array]:
    """Times, rates (1/s) at which the guards that fired reached 0, and whether others
    reached 0 at the same instant.

    Guards that move alike, as those of speed and slip under a steady lever, are one.
    """
    t, y = record.ends(index)
    flat = record.flat
    span = record.t_end - record.rows.t[0]

    def at_event(t: Array, y: Any, i: Array) -> tuple[Array, Array]:
        mode = record.rows.mode[i]
        fired = record.rows.guard[i]
        packed = ravel_pytree(y)[0]
        f = flat.rhs(t, packed, mode)
        g, rate = jax.jvp(
            lambda t, y: flat.guards(t, y, mode), (t, packed), (jnp.ones_like(t), f)
        )
        normals = jnp.column_stack(
            jax.jacfwd(lambda t, y: flat.guards(t, y, mode), (0, 1))(t, packed)
        )
        size = jnp.linalg.norm(normals, axis=1)
        alike = jnp.abs(normals @ normals[fired]) >= (1 - 1e-9) * size * size[fired]
        together = ~alike & (rate < 0) & (jnp.abs(g) <= 1e-12 * jnp.abs(rate) * span)
        return rate[fired], jnp.any(together)

    return t, *jax.vmap(at_event)(t, y, index)


_approaches = Compiled(_approach)


def passages(record: Record) -> list[str]:
    """Grazing events, and simultaneous events."""
    record = record.compact()
    t = np.asarray(record.rows.t)
    kind = np.asarray(record.rows.kind)[: int(record.count)]
    index = np.flatnonzero(kind == LANDED)
    if not len(index):
        return []
    padded = np.pad(index, (0, -len(index) % 16), mode="edge").astype(np.int32)
    times, rates, together = (
        np.asarray(x)[: len(index)] for x in _approaches(record, padded)
    )
    whole = t[int(record.count)] - t[0]
    slow = times[np.abs(rates) * whole * GRAZE < 1]
    several = times[together]
    return [
        *(
            f"the event at {time:.9g} s is only just reached: a small change may remove it"
            for time in slow
        ),
        *(
            f"several thresholds are reached at {time:.9g} s: derivatives are one-sided there"
            for time in several
        ),
    ]


def one_sided(scene: Scene, record: Record) -> tuple[str, ...]:
    """Where derivatives of a concrete run are one-sided or no longer valid."""
    return (*jumps_at_start(scene), *near_ties(record), *passages(record))
