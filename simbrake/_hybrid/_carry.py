"""What the flat loop carries from one step attempt to the next, packed into two vectors.

Two vectors instead of twenty arrays: XLA then updates the whole carry in two small kernels. With one kernel per array
it would also repeat the decisions of an attempt in every one of them.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Bool, Float, Int

from ._arrays import Array


class Stats(NamedTuple):
    """Counts of one run: accepted steps, rejected ones, retakes towards an event, events, segments."""

    accepted: Int[Array, ""]
    rejected: Int[Array, ""]
    retaken: Int[Array, ""]
    events: Int[Array, ""]
    segments: Int[Array, ""]


class Carry(NamedTuple):
    """State of the loop between two attempts."""

    t: Float[Array, ""]
    h: Float[Array, ""]  # what the step-size controller proposes
    cap: Float[Array, ""]  # how far a retake may go
    crossing: Float[Array, ""]  # distance within which a guard is known to cross
    t_event: Float[Array, ""]
    y: Float[Array, " state"]
    f: Float[Array, " state"]
    g: Float[Array, " guard"]
    rate: Float[Array, " guard"]
    armed: Bool[Array, " guard"]  # has stood clear of zero since the last restart
    cluster: Bool[Array, " guard"]  # fired in the present cluster of events with hardly any time between
    status: Int[Array, ""]
    retakes: Int[Array, ""]
    chain: Int[Array, ""]  # events at this very instant
    close: Int[Array, ""]  # repeated firings in the present cluster
    settling: Int[Array, ""]  # just after a restart: 2 rates and guards are unknown, 1 the first step's length; else 0
    stats: Stats
    mode: Int[Array, " mode"]


#: whole numbers of a carry beside its marks and its mode: status, retakes, chain, close, settling, and the counts
FIXED = 5 + len(Stats._fields)

Packed = tuple[Float[Array, " x"], Int[Array, " n"]]


def pack(c: Carry) -> Packed:
    x = jnp.concatenate([jnp.stack([c.t, c.h, c.cap, c.crossing, c.t_event]), c.y, c.f, c.g, c.rate])
    scalars = jnp.stack([c.status, c.retakes, c.chain, c.close, c.settling, *c.stats])
    return x, jnp.concatenate([scalars, c.armed.astype(jnp.int32), c.cluster.astype(jnp.int32), c.mode])


def carried_size(ny: int, ng: int, nm: int) -> int:
    """Numbers of a packed carry, whole ones included."""
    return 5 + 2 * ny + 2 * ng + FIXED + 2 * ng + nm


def unpack(packed: Packed, ny: int, ng: int) -> Carry:
    x, n = packed
    head, y, f, g, rate = jax.lax.split(x, (5, ny, ny, ng, ng))
    scalars, armed, cluster, mode = jax.lax.split(n, (FIXED, ng, ng, n.shape[0] - FIXED - 2 * ng))
    t, h, cap, crossing, t_event = jnp.unstack(head)
    status, retakes, chain, close, settling, *counted = jnp.unstack(scalars)
    return Carry(
        t,
        h,
        cap,
        crossing,
        t_event,
        y,
        f,
        g,
        rate,
        armed > 0,
        cluster > 0,
        status,
        retakes,
        chain,
        close,
        settling,
        Stats(*counted),
        mode,
    )
