"""Programs that evaluate runs: part of the program of a traced run, or compiled by
themselves and called for many instants at once."""

from collections.abc import Callable
from typing import Any, TypeVar

import jax
import numpy as np

from .._base._compiling import Compiled
from .._base._part import is_traced
from .._base._progress import piece
from ..hybrid import Record
from ..hybrid.arrays import Array
from ..hybrid.system import unravel
from ..physics._brake import State
from ..physics.mechanism import Mode

T = TypeVar("T")

#: instants in one call of a compiled program
LANES = 256


def is_traced_run(record: Record) -> bool:
    """Whether a run is being traced, even if only numbers of its system are on which its
    states do not depend."""
    return is_traced(record)


def record_of(run: Any) -> Record:
    """The record of a `Result` or a record itself; a concrete one without skipped and
    unused rows."""
    record: Record = getattr(run, "record", run)
    return record if is_traced_run(record) else record.compact()


class RunJit(Compiled):
    """A function of runs: compiled by itself for concrete runs, part of their program
    for traced ones."""

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        if is_traced((arguments, named)):
            return self._function(*arguments, **named)
        return jax.tree.map(np.asarray, super().__call__(*arguments, **named))


def in_lanes(look: Callable[..., T], *columns: np.ndarray, lanes: int = LANES) -> T:
    """`look(*columns)` of columns (m,), in calls of one length, so that it compiles once
    for any m."""
    parts = []
    count = len(columns[0])
    for start in range(0, count, lanes):
        if count > lanes:  # shown as progress
            piece(start // lanes, -(-count // lanes))
        rows = np.minimum(np.arange(start, start + lanes), count - 1)
        values = look(*(column[rows] for column in columns))
        used = min(lanes, count - start)
        parts.append(jax.tree.map(lambda leaf, n=used: np.asarray(leaf)[:n], values))
    return jax.tree.map(lambda *leaves: np.concatenate(leaves), *parts)


#: from numbers of samples (m,) to times (m,), flat states and flat modes (m, …)
Instants = Callable[[np.ndarray], tuple[Array, ...]]


def at_samples(
    record: Record,
    find: Callable[..., T],
    index: np.ndarray,
    instants: Instants,
    lanes: int = LANES,
) -> T:
    """`find(system, t, y, mode)` at the samples numbered `index`, called in lanes."""

    def look(index: np.ndarray) -> T:
        t, y, mode = instants(index)
        return find(
            record.system, t, unravel(y, record.y_like), unravel(mode, record.mode_like)
        )

    return in_lanes(look, index, lanes=lanes)


#: time, state and mode
EndOfRun = tuple[Array, State, Mode]


def ends_of(record: Record) -> tuple[EndOfRun, EndOfRun]:
    """Time, state and mode at the start and at the end of a run; NumPy's for a concrete
    run."""
    rows = record.rows
    t, y, mode = (
        x[0] if is_traced_run(record) else np.asarray(x)[0]
        for x in (rows.t, rows.y, rows.mode)
    )
    start = t, unravel(y, record.y_like), unravel(mode, record.mode_like)
    return start, (record.t_end, record.y_end, record.mode_end)
