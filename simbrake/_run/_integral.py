"""Integrals over a whole run of anything that can be looked at in it, by quadrature inside every recorded step."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from .._base._compiling import DeviceJit
from .._hybrid import SKIPPED, Record
from ._probe import Probe, probe

#: Gauss–Legendre points in every step: exact to the order 2 · 6 − 1, above that of the methods that integrate
POINTS = 6


def as_tree(function: Callable[..., Any]) -> Any:
    """A function as a PyTree, so that it can be an argument of a compiled program; PyTrees stay as they are."""
    leaf = jax.tree.structure(0)
    return jax.tree_util.Partial(function) if jax.tree.structure(function) == leaf else function


def is_traced(tree: Any) -> bool:
    """Whether any leaf is being traced by a transformation of JAX."""
    return any(isinstance(leaf, Tracer) for leaf in jax.tree.leaves(tree))


def _integrate(record: Record, pick: Any, *, points: int) -> Any:
    rows = record.rows
    n = rows.t.shape[0]
    here = jnp.arange(n, dtype=jnp.int32)
    used = (here < record.count) & (rows.kind != SKIPPED)
    span = jnp.where(used, rows.t[jnp.minimum(here + 1, record.count)] - rows.t, 0.0)
    nodes, weights = np.polynomial.legendre.leggauss(points)
    # rows that were never written hold nothing that could be looked at: there the first row is, with weight 0
    index = jnp.repeat(jnp.where(used, here, 0), points)
    values = pick(probe(record, index, jnp.tile(jnp.asarray(0.5 * (nodes + 1)), n)))
    weight = jnp.repeat(span, points) * jnp.tile(jnp.asarray(0.5 * weights), n)
    return jax.tree.map(lambda leaf: jnp.tensordot(weight, leaf, axes=1), values)


_compiled = DeviceJit(_integrate, static_argnames="points")


def integral(run: Any, pick: Callable[[Probe], Any], *, points: int = POINTS) -> Any:
    """`∫ pick(probe) dt` over a run, from its start to its end.

        ∫ q dt = Σ_steps h Σ_k w_k q(t + s_k h)        (Gauss–Legendre, `points` nodes s_k in each recorded step)

    - `run`: a `Result` or its record, concrete or traced; under `vmap` map the call, not a batch of results
    - `pick`: function of a probe of `m` times to an array (m, …), or a PyTree of such: what is looked at there are
      `p.t`, `p.y`, `p.mode`, `p.flows`, `p.shown` (friction pairs, tensions), `p.surfaces`. Use one function again, or
      a `jax.tree_util.Partial` of one: a new function compiles anew

    Between two events a run is smooth and its states inside a step are those of the method itself, so that the error
    is that of the integration. What is not smooth inside a step (linings that come to their limit one by one while a
    band is elastic) converges more slowly; `points` tells. Differentiable forward and reverse, ends of steps move
    with their events. Heat that is booked at an instant (a restart, a break-away, a release of an elastic band) is no
    integral and not in it.
    """
    record: Record = getattr(run, "record", run)
    pick = as_tree(pick)
    if is_traced((record, pick)):
        return _integrate(record, pick, points=points)
    return _compiled(record.compact(), pick, points=points)
