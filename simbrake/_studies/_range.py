"""Where derivatives of a run end to hold: ends of ranges, events that nearly coincide, guards that are grazed."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree

from .._base._compiling import DeviceJit
from .._base._faults import InputError
from .._base._progress import Waiting
from .._base._quantity import leaves
from .._physics._mechanism import Label
from .._run._edit import with_values
from .._run._report import labels_of
from .._run._result import Result
from .._run._simulate import simulate
from ..hybrid import LANDED, STOPPED, Record

#: two events that lie within this share of a run are nearly simultaneous
NEAR = 1e-6
#: a guard is grazed if it passes 0 so slowly that its size of order one would take this many runs
GRAZE = 1e4


class Range(NamedTuple):
    """Metrics at both ends of the range of every number (`None`: no run there), notes by path and on the whole run."""

    ends: dict[str, tuple[np.ndarray | None, np.ndarray | None]]
    changes: dict[str, str]
    notes: tuple[str, ...]

    def of(self, path: str, k: int) -> tuple[float | None, float | None, str]:
        """Metric `k` at both ends of a path, and its note."""
        low, high = (
            None if end is None or not np.isfinite(end[k]) else float(end[k])
            for end in self.ends.get(path, (None, None))
        )
        return low, high, self.changes.get(path, "")


def sequence(result: Result) -> list[Label]:
    """Modes of a concrete run in order."""
    labels = labels_of(result.record)
    return [label for i, label in enumerate(labels) if i == 0 or label != labels[i - 1]]


def look_around(
    base: Result, values: Callable[[Result], Any], spans: Mapping[str, Any], *, rtol: float, solver: Any, told: Waiting
) -> Range:
    """Runs the scene at both ends `p ± span` of every number, one at a time; a list moves as a whole."""
    usual, known = sequence(base), {leaf.path: np.asarray(leaf.value) for leaf in leaves(base.scene)}
    ends: dict[str, tuple[np.ndarray | None, np.ndarray | None]] = {}
    changes: dict[str, str] = {}
    for i, (path, half) in enumerate(spans.items()):
        told.now("ends of ranges", i, len(spans))
        if not np.any(half):
            continue
        seen, words = [], []
        for sign, name in ((-1, "low"), (1, "high")):
            end, what = _end(base.scene, path, known[path] + sign * half, values, usual, rtol, solver)
            seen.append(end)
            words += [f"{name} end: {what}"] if what else []
        ends[path] = (seen[0], seen[1])
        if words:
            changes[path] = "; ".join(words)
    return Range(ends, changes, tuple(near_ties(base.record) + passages(base.record)))


def _end(
    scene: Any, path: str, p: Any, values: Any, usual: list[Label], rtol: float, solver: Any
) -> tuple[np.ndarray | None, str]:
    """Metrics at one end, and what is different there."""
    try:
        result = simulate(with_values(scene, {path: p}), rtol=rtol, solver=solver, throw=False)
    except InputError:
        return None, "not admissible"
    if not result.ok:
        return None, f"the run ends as {result.status}"
    other = sequence(result)
    part = next((i for i, (a, b) in enumerate(zip(usual, other, strict=False)) if a != b), min(len(usual), len(other)))
    what = ""
    if other != usual:
        mine, theirs = (str(s[part]) if part < len(s) else "the end" for s in (usual, other))
        what = f"other modes ({theirs} instead of {mine} after {usual[part - 1]})"
    return np.asarray(values(result)), what


def near_ties(record: Record) -> list[str]:
    """Events that lie so close that a small change may exchange them."""
    n = int(record.count)
    t, kind = np.asarray(record.rows.t)[: n + 1], np.asarray(record.rows.kind)[:n]
    at = np.flatnonzero((kind == LANDED) | (kind == STOPPED))
    times, landed, whole = t[at + 1], kind[at] == LANDED, t[-1] - t[0]
    found = []
    for i in np.flatnonzero((np.diff(times) > 0) & (np.diff(times) < NEAR * whole)):
        if landed[i] or landed[i + 1]:
            what = "events" if landed[i] and landed[i + 1] else "an event and a corner of a given function"
            words = f"{what} at {times[i]:.9g} s and {times[i + 1] - times[i]:.2g} s later nearly coincide"
            found.append(f"{words}: derivatives are one-sided, they end where the two change their order")
    return found


def _approach(record: Record, index: Any) -> Any:
    """Times, rates (1/s) at which the guards that fired came to 0, and whether others came to 0 at the same instant.

    Guards that move alike, as those of speed and slip under a steady lever, are one.
    """
    t, y = record.ends(index)
    flat, span = record.flat, record.t_end - record.rows.t[0]

    def one(t: Any, y: Any, i: Any) -> Any:
        mode, fired = record.rows.mode[i], record.rows.guard[i]
        packed = ravel_pytree(y)[0]
        f = flat.rhs(t, packed, mode)
        g, rate = jax.jvp(lambda t, y: flat.guards(t, y, mode), (t, packed), (jnp.ones_like(t), f))
        normals = jnp.column_stack(jax.jacfwd(lambda t, y: flat.guards(t, y, mode), (0, 1))(t, packed))
        size = jnp.linalg.norm(normals, axis=1)
        alike = jnp.abs(normals @ normals[fired]) >= (1 - 1e-9) * size * size[fired]
        together = ~alike & (rate < 0) & (jnp.abs(g) <= 1e-12 * jnp.abs(rate) * span)
        return rate[fired], jnp.any(together)

    return t, *jax.vmap(one)(t, y, index)


_approaches = DeviceJit(_approach)


def passages(record: Record) -> list[str]:
    """Events that the state only just reaches, and events that come several at once."""
    record = record.compact()
    t, kind = np.asarray(record.rows.t), np.asarray(record.rows.kind)[: int(record.count)]
    index = np.flatnonzero(kind == LANDED)
    if not len(index):
        return []
    padded = np.pad(index, (0, -len(index) % 16), mode="edge").astype(np.int32)
    times, rates, together = (np.asarray(x)[: len(index)] for x in _approaches(record, padded))
    whole = t[int(record.count)] - t[0]
    slow = times[np.abs(rates) * whole * GRAZE < 1]
    several = times[together]
    return [
        *(f"the event at {time:.9g} s is only just reached: a small change may undo it" for time in slow),
        *(f"several marks are passed at once at {time:.9g} s: derivatives are one-sided there" for time in several),
    ]
