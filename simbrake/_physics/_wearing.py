"""Wear made ready for integration: what rubs at each lining, and how fast it goes."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Float

from .._hybrid._arrays import Array
from .._parts._design import Brake
from .._parts._wear import AbstractWearRate, Wear


class Pressed(NamedTuple):
    """One friction pair of every lining at one instant: load (N), slip speed (m/s, 0 while it sticks), temperature."""

    normal: Float[Array, " n"]
    speed: Any
    temperature: Any  # that the pair's friction law sees (K), `None` where the scene has none


class Worn(NamedTuple):
    """Thickness (m) worn off every lining since the start: at the face of the band's pair, and of the internal one."""

    outer: Any
    inner: Any = None


class Wearing(eqx.Module):
    """`ḣ_i = I(T_i) p_i v_i`, `p_i = N_i/A_i` (model §7). No rate depends on the thickness: it is a quadrature.

    - `turned_at`: times at which the band is turned end for end. `h_i` stays that of the lining which was the `i`-th at
      the start; after an odd number of turns it rubs where the `(n + 1 − i)`-th did
    - `scale` (m): typical thickness that the run wears off
    """

    rate: AbstractWearRate
    internal: AbstractWearRate | None
    area: Array
    internal_area: Array | None
    scale: Float[Array, ""]
    turned_at: Array | None
    count: int = eqx.field(static=True)

    def _pair(self, rate: AbstractWearRate, area: Array, pressed: Pressed) -> Float[Array, " n"]:
        p = pressed.normal / area
        return jnp.broadcast_to(rate(p, pressed.speed, pressed.temperature) * p * pressed.speed, (self.count,))

    def rates(self, t: Array, outer: Pressed, inner: Pressed | None) -> Worn:
        """Rates of wear (m/s) of the linings as they were counted at the start."""
        found = self._pair(self.rate, self.area, outer)
        if self.turned_at is not None:
            turns = jnp.sum(jnp.asarray(t) >= self.turned_at)
            found = jnp.where(turns % 2 == 1, found[::-1], found)
        if self.internal is None or self.internal_area is None or inner is None:
            return Worn(found)
        return Worn(found, self._pair(self.internal, self.internal_area, inner))

    def each(self, value: Any) -> Worn:
        """One value for every thickness."""
        return Worn(value, None if self.internal is None else value)

    @property
    def start(self) -> Worn:
        """Nothing is worn off yet."""
        return self.each(jnp.zeros(self.count))


def assemble_wear(wear: Wear | None, brake: Brake, energy: Array) -> Wearing | None:
    """The wear of a scene, or nothing at all; `energy` (J): what a typical braking turns into heat."""
    if wear is None:
        return None
    bandage = brake.bandage
    # volume k W/f, over all linings: f n is of the order of 1
    scale = jax.lax.stop_gradient(jnp.max(wear.rate.at(None) / jnp.asarray(brake.linings.area)) * energy)
    inner = None if wear.internal is None or bandage is None else bandage.area
    return Wearing(
        rate=wear.rate,
        internal=None if inner is None else wear.internal,
        area=jnp.asarray(brake.linings.area),
        internal_area=None if inner is None else jnp.asarray(inner),
        scale=jnp.where(scale > 0, scale, 1.0),
        turned_at=None if wear.turned_at is None else jnp.asarray(wear.turned_at),
        count=brake.linings.count,
    )
