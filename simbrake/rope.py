"""The rope on the drum, layer on layer: its effective radius, and the travel of the hook."""

import math

import jax.numpy as jnp
import numpy as np
from jaxtyping import Int

from ._base._quantity import Part, Scalar, quantity
from .hybrid._arrays import Array

__all__ = ["RopeLayers"]


class RopeLayers(Part):
    """Rope wound on the drum in layers, `r_k = r_1 + (k − 1) h`, `h = rise · d`.

    - `diameter` `d` (m) of the rope;  `turns_per_layer` `N_g`: grooves of the drum
    - `turns` `N_0` on the drum at the start;  at the angle `φ` there are `N = N_0 − φ/2π`, in the layer
      `k` with `(k − 1) N_g ≤ N ≤ k N_g`
    - `rise` of a layer over the diameter: `√3/2` where a turn lies between two of the layer below, 1 on top of one

    Lowering pays rope out, and the radius falls from layer to layer. At a change of layer the kinetic energy of all
    that moves is continuous, as in a crossover without loss, however short: the speed of the pulley jumps.

    Example:
        >>> sb.loads.RopeLayers("32 mm", turns_per_layer=20, turns=50).turns
        array(50.)
    """

    diameter: Scalar = quantity("m", "diameter of the rope", low=0.0)
    turns_per_layer: Scalar = quantity("1", "turns of a full layer", positive=True)
    turns: Scalar = quantity("1", "turns on the drum at the start", positive=True)
    rise: Scalar = quantity("1", "rise of a layer over the diameter", low=0.0, high=1.0, default=math.sqrt(3) / 2)

    def first_layer(self) -> Int[Array, ""]:
        """Layer (from 1) that pays out at the start of lowering."""
        return jnp.ceil(jnp.asarray(self.turns) / self.turns_per_layer).astype(jnp.int32)

    def radius(self, drum_radius: Array, layer: Array) -> Array:
        """Effective radius (m) in a layer; `drum_radius` `r_1`: in the first one."""
        return drum_radius + (jnp.asarray(layer, jnp.float64) - 1) * self.rise * self.diameter

    def margins(self, phi: Array, layer: Array) -> tuple[Array, Array]:
        """Room in the layer at the angle `phi` (rad), over its turns: until it is paid out, until it is full."""
        filled = (self.turns - phi / (2 * np.pi)) / self.turns_per_layer
        above = jnp.asarray(layer, jnp.float64)
        return filled - (above - 1), above - filled

    def _length(self, drum_radius: Array, turns: Array) -> Array:
        full = jnp.maximum(jnp.floor(turns / self.turns_per_layer), 0.0)
        below = full * drum_radius + full * (full - 1) / 2 * self.rise * self.diameter
        last = (turns - full * self.turns_per_layer) * self.radius(drum_radius, full + 1)
        return 2 * np.pi * (self.turns_per_layer * below + last)

    def paid_out(self, drum_radius: Array, phi: Array) -> Array:
        """Rope (m) paid out at the angle `phi` (rad) since the start, `∫ r dφ`; `inf` at an infinite angle."""
        known = jnp.isfinite(phi)
        left = self.turns - jnp.where(known, phi, 0.0) / (2 * np.pi)
        length = self._length(drum_radius, jnp.asarray(self.turns)) - self._length(drum_radius, left)
        return jnp.where(known, length, jnp.inf)
