"""What changes slowly at the surfaces: thickness worn off, and states of friction laws."""

import itertools
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ..friction import SurfaceState, memory_at_start, memory_sizes, remembers
from ..hybrid import CORE, LINEAR
from ..hybrid._arrays import Array
from ..wear import Wear
from ._mechanism import AbstractMechanism, Pair, Rub


def rates_of_memory(pair: Pair, surface: SurfaceState, v: Array, normal: Float[Array, " n"], power: Array) -> Any:
    """Rates of the states of a pair's law, (n,) each.

    - `v` (m/s): slip speed signed by the sense, `power` (W) of the friction of each lining: (n,) or one for all

    Past the end of a slide, where both are below 0, a rate `g` goes on with the slope that it has, `2 g(0) − g(|v|)`.
    """
    law, still = pair.law, jnp.zeros(pair.count)
    p = None if pair.area is None else normal / pair.area
    v, q = v + still, None if pair.area is None else power / pair.area + still

    def at(v: Array, q: Any) -> Any:
        return jax.tree.map(lambda rate: rate + still, law.rates(surface.contact(v, p, q)))

    if pair.memory is None or not pair.memory.bends:
        return at(v, q)  # a straight line goes on by itself
    past, at_rest = v < 0, at(still, None if q is None else still)
    found = at(jnp.where(past, -v, v), None if q is None else jnp.where(past, -q, q))
    return jax.tree.map(lambda rate, still: jnp.where(past, 2 * still - rate, rate), found, at_rest)


def start_of_memory(pairs: tuple[Pair, ...]) -> Any:
    """States of the laws at the start, one PyTree for each pair (`None`: its law has none); `None` without any."""
    return _each(pairs, lambda pair: memory_at_start(pair.law, pair.count))


def sizes_of_memory(pairs: tuple[Pair, ...]) -> Any:
    """Typical sizes of these states."""
    return _each(pairs, lambda pair: memory_sizes(pair.law, memory_at_start(pair.law, pair.count)))


def couplings_of_memory(mechanism: AbstractMechanism, others: np.ndarray) -> Any:
    """Places of these states in the Jacobian, beside those of all `others`.

    A state of a lining stands in the chain, without neighbours, where its rate depends on the core alone (speeds,
    temperatures) and on itself; else it is one of the core, as all linings are coupled there. A chain of them alone is
    worth its border only while that is the smaller part.
    """
    places, core = itertools.count(1 + max((kind % LINEAR for kind in others if kind >= 0), default=-1)), others == CORE
    chained = bool(np.any(others >= 0))

    def of(pair: Pair) -> Any:
        states, tree = jax.tree.flatten(memory_at_start(pair.law, pair.count))
        if len(states) > 1 or _couples(mechanism, pair) or not (chained or np.sum(core) < pair.count):
            return tree.unflatten([np.full(state.shape, CORE) for state in states])
        return tree.unflatten([np.fromiter(itertools.islice(places, pair.count), int)])

    return _each(mechanism.pairs, of)


def _couples(mechanism: AbstractMechanism, pair: Pair) -> bool:
    """Whether the rate of one lining's state depends on the states of others at the same instant."""
    rates = pair.memory
    assert rates is not None
    return (mechanism.couples_loads and (rates.p or rates.q)) or (mechanism.couples_slip and rates.slip)


def _each(pairs: tuple[Pair, ...], of: Any) -> Any:
    found = tuple(of(pair) if remembers(pair.law) else None for pair in pairs)
    return None if all(one is None for one in found) else found


# --- wear -------------------------------------------------------------------------------------------------------------


class Wearing(eqx.Module):
    """`ḣ_i = I(T_i) p_i v_i`, `p_i = N_i/A_i` (model §7). No rate depends on the thickness: it is a quadrature.

    The thickness worn off (m) is a tuple of (n,), one for each pair, `None` of one without a rate of wear.

    - `turned_at`: times at which the band is turned end for end. `h_i` of the first pair stays that of the lining which
      was the `i`-th at the start; after an odd number of turns it rubs where the `(n + 1 − i)`-th did
    - `scale` (m): typical thickness that the run wears off
    """

    scale: Float[Array, ""]
    turned_at: Array | None
    count: int = eqx.field(static=True)
    followed: tuple[bool, ...] = eqx.field(static=True)

    def rates(self, t: Array, pairs: tuple[Pair, ...], rubs: tuple[Rub, ...], hot: tuple[Any, ...]) -> tuple[Any, ...]:
        """Rates of wear (m/s) of the linings as they were counted at the start."""
        found = []
        for pair, rub, T in zip(pairs, rubs, hot, strict=True):
            if pair.wear is None or pair.area is None:
                found.append(None)
                continue
            p, v = rub.normal / pair.area, rub.sense * rub.slip
            rate = jnp.broadcast_to(pair.wear(p, v, T) * p * v, (self.count,))
            if self.turned_at is not None and not found:
                turns = jnp.sum(jnp.asarray(t) >= self.turned_at)
                rate = jnp.where(turns % 2 == 1, rate[::-1], rate)
            found.append(rate)
        return tuple(found)

    def each(self, value: Any) -> tuple[Any, ...]:
        """One value for every thickness."""
        return tuple(value if followed else None for followed in self.followed)

    @property
    def start(self) -> tuple[Any, ...]:
        """Nothing is worn off yet."""
        return self.each(jnp.zeros(self.count))


def assemble_wear(wear: Wear | None, pairs: tuple[Pair, ...], energy: Array) -> Wearing | None:
    """The wear of a scene, or nothing at all; `energy` (J): what a typical braking turns into heat."""
    if wear is None:
        return None
    assert pairs[0].area is not None
    # volume k W/f, over all linings: f n is of the order of 1
    scale = jax.lax.stop_gradient(jnp.max(wear.rate.at(None) / pairs[0].area) * energy)
    return Wearing(
        scale=jnp.where(scale > 0, scale, 1.0),
        turned_at=None if wear.turned_at is None else jnp.asarray(wear.turned_at),
        count=pairs[0].count,
        followed=tuple(pair.wear is not None and pair.area is not None for pair in pairs),
    )
