"""Looking into a run at any time: states and forces by a partial step of the method out of a recorded row."""

import dataclasses
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from .._base._compiling import DeviceJit
from .._base._progress import piece
from .._hybrid import Record
from .._hybrid._arrays import Array
from .._physics._brake import BrakeSystem
from .._physics._mechanism import Shown
from .._physics._observe import passing, surfaces

SAMPLES = 9  # per step, when a whole run is scanned
LANES = 512  # times looked at in one call of the compiled probe


class Probe(NamedTuple):
    """States, forces and margins at the times `t` (m,)."""

    t: Array
    y: Any
    mode: Any
    flows: Any
    shown: Shown
    margins: Array
    greater_tension: Any  # of the two sides of each lining; None without a band
    surfaces: dict[str, Array]  # surface temperatures of rim, linings, band (m, nodes), where the scene has them
    passing: Array  # (m, marks): by how much marks that only heat can pass are passed (see `mark_names`)


def probe(record: Record, index: Array, share: Array) -> Probe:
    """Everything at a share (0…1) of the steps named, by a partial step of the method itself.

    The share is of the time up to the next row, so that ends of steps move with their events under differentiation.
    """
    t = record.rows.t
    h = share * (t[jnp.minimum(index + 1, record.count)] - t[index])
    return probe_at(record, index, h)


def probe_at(record: Record, index: Array, h: Array) -> Probe:
    system: BrakeSystem = record.system  # pyright: ignore
    t, y = record.inside(index, h)
    mode = jax.vmap(record.flat.unpack_mode)(record.rows.mode[index])

    def look(t: Array, y: Any, mode: Any) -> Any:
        q, mechanism = system.variables(t, y, mode), system.mechanism
        hot = surfaces(system, q)
        return (
            q,
            mechanism.shown(q.lever_tension, y.omega, y.own, mode, system.surfaces(y), q.contact),
            mechanism.lining_margins(mode, q.contact),
            hot,
            passing(system, mode, q, hot),
        )

    flows, shown, margins, hot, passed = jax.vmap(look)(t, y, mode)
    greater = None
    if shown.tension is not None:
        before = jnp.concatenate([flows.slack_tension[:, None], shown.tension[:, :-1]], axis=1)
        greater = jnp.maximum(shown.tension, before)
    return Probe(t, y, mode, flows, shown, margins, greater, hot, passed)


_probe_compiled = DeviceJit(probe_at)


def probe_many(record: Record, index: Any, h: Any) -> Probe:
    """The probe of a compact record outside of jit.

    A call gets the rows that it looks at, always as many, instead of the whole record: the work grows with the number
    of times, not with that times the length of the run, and runs of any length share one compiled program.
    """
    parts, index, h = [], np.asarray(index), np.asarray(h)
    lanes = np.arange(LANES, dtype=np.int32)
    for start in range(0, len(index), LANES):
        if len(index) > LANES:  # somebody may be waiting
            piece(start // LANES, -(-len(index) // LANES))
        i, s = index[start : start + LANES], h[start : start + LANES]
        used = len(i)
        here, offset = (np.pad(part, (0, LANES - used), mode="edge") for part in (i, s))
        rows = jax.tree.map(lambda column, here=here: column[here], record.rows)
        out = _probe_compiled(dataclasses.replace(record, rows=rows), lanes, offset)
        parts.append(jax.tree.map(lambda leaf, n=used: np.asarray(leaf)[:n], out))
    return jax.tree.map(lambda *leaves: np.concatenate(leaves), *parts)
