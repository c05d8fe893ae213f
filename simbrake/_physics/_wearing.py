"""Wear made ready for integration: how fast the linings of each friction pair lose thickness."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Float

from .._hybrid._arrays import Array
from .._parts._wear import Wear
from ._mechanism import Pair, Rub


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
