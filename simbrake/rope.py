"""The rope: its layers on the drum with their effective radius, and its stretch between
drum and hook."""

import math

import jax.numpy as jnp
import numpy as np
from jaxtyping import Int

from ._base._faults import Fault
from ._base._part import Part, positive_quantity, quantity
from ._base._quantity import Scalar
from .hybrid.arrays import Array, numpy_of

__all__ = ["RopeElasticity", "RopeLayers", "RopeWeight"]


class RopeLayers(Part):
    """Rope wound on the drum in layers, `r_k = r_1 + (k − 1) h`, `h = rise · d`.

    - `diameter` `d` (m) of the rope;  `turns_per_layer` `N_g`: grooves of the drum
    - `turns` `N_0` on the drum at the start;  at the angle `φ` there are
      `N = N_0 − φ/2π`, in the layer `k` with `(k − 1) N_g ≤ N ≤ k N_g`
    - `rise` of a layer over the diameter: `√3/2` where a turn lies between two of the
      layer below, 1 on top of one

    Lowering pays rope out, and the radius falls from layer to layer. At a change of
    layer the kinetic energy of all that moves is continuous, as in a crossover without
    loss, however short: the speed of the pulley jumps.

    Example:
        >>> sb.loads.RopeLayers("32 mm", turns_per_layer=20, turns=50).turns
        array(50.)
    """

    diameter: Scalar = quantity("m", "diameter of the rope", low=0.0, typical=0.03)
    turns_per_layer: Scalar = positive_quantity("1", "turns of a full layer")
    turns: Scalar = positive_quantity("1", "turns on the drum at the start")
    rise: Scalar = quantity(
        "1", "rise of a layer over the diameter", 0.0, 1.0, default=math.sqrt(3) / 2
    )

    def first_layer(self) -> Int[Array, ""]:
        """Layer (from 1) that pays out at the start of lowering."""
        return jnp.ceil(jnp.asarray(self.turns) / self.turns_per_layer).astype(
            jnp.int32
        )

    def radius(self, drum_radius: Array, layer: Array) -> Array:
        """Effective radius (m) in a layer; `drum_radius` `r_1`: in the first one."""
        return (
            drum_radius
            + (numpy_of(layer).asarray(layer, np.float64) - 1)
            * self.rise
            * self.diameter
        )

    def margins(self, phi: Array, layer: Array) -> tuple[Array, Array]:
        """Room in the layer at the angle `phi` (rad), over its turns: until it is paid
        out, until it is full."""
        filled = (self.turns - phi / (2 * np.pi)) / self.turns_per_layer
        above = jnp.asarray(layer, jnp.float64)
        return filled - (above - 1), above - filled

    def _length(self, drum_radius: Array, turns: Array) -> Array:
        xp = numpy_of(turns)
        full = xp.maximum(xp.floor(turns / self.turns_per_layer), 0.0)
        below = full * drum_radius + full * (full - 1) / 2 * self.rise * self.diameter
        last = (turns - full * self.turns_per_layer) * self.radius(
            drum_radius, full + 1
        )
        return 2 * np.pi * (self.turns_per_layer * below + last)

    def paid_out(self, drum_radius: Array, phi: Array | float) -> Array:
        """Rope (m) paid out at the angle `phi` (rad) since the start, `∫ r dφ`; `inf`
        at an infinite angle."""
        xp = numpy_of(phi)
        is_finite = xp.isfinite(phi)
        left = self.turns - xp.where(is_finite, phi, 0.0) / (2 * np.pi)
        length = self._length(drum_radius, xp.asarray(self.turns)) - self._length(
            drum_radius, left
        )
        return xp.where(is_finite, length, xp.inf)


class RopeWeight(Part):
    """Weight of the rope between drum and hook, and inertia of the whole rope.

        M_r = g q r (l − d),   J_r = q r² [L − N l + l k/N²],   l = l_0 + s

    - `linear_mass` `q` (kg/m)
    - `hanging_length` `l_0` (m) of each of the `N` lines at the start; the hook travels
      by `s`
    - `length` `L` (m) of the rope that moves: lines, what runs to the drum, and what is
      on it. With layers of rope it may be left out: it is then what the turns hold
    - `drum_below` `d` (m): crown sheaves above the drum, 0 of a drum without a tackle

    Where one of the two is used up the run ends with the code `rope_end`. Lines have
    `N, N − 2, N − 2, …` times the speed of the hook, with
    `k = N² + N (N − 1)(N − 2)/3`; all rope on the drum moves with the layer that pays
    out. Their inertia pulls like that of a mass on the hook (exact for one line).
    Source: energy of the rope (Lagrange).

    Example:
        >>> rope = sb.loads.RopeWeight("6 kg/m", hanging_length="30 m", length="600 m")
        >>> load = sb.HookLoad("12 t", "400 mm", 10, weight=rope)
        >>> round(float(load.ropes(0.0, 0).torque))
        706
    """

    linear_mass: Scalar = positive_quantity("kg/m", "mass per length of the rope")
    hanging_length: Scalar = quantity("m", "length of each line at the start", low=0.0)
    length: Scalar | None = positive_quantity(
        "m", "length of the rope that moves", default=None
    )
    drum_below: Scalar = quantity(
        "m", "height of the crown above the drum", low=0.0, default=0.0
    )

    def whole(
        self, drum_radius: Array, lines: Scalar, layers: RopeLayers | None
    ) -> Array:
        """`L` (m), given or what the turns of `layers` hold; `drum_radius` of the first
        layer."""
        if self.length is not None:
            return jnp.asarray(self.length)
        assert layers is not None
        on_drum = layers.paid_out(drum_radius, 2 * np.pi * jnp.asarray(layers.turns))
        return lines * jnp.asarray(self.hanging_length) + self.drum_below + on_drum


class RopeElasticity(Part):
    """Stretch of the rope between drum and hook: the hook moves by itself, and hangs on
    a spring with a damper.

        F = k e + c ė > 0,   ė = v − ω r_d/n,   m v̇ = m g − F,   M_load = F r_d/n;   k
        = n E A/L

    - `stiffness` `k` (N/m) at the hook; or of the lines strung by `modulus` `E` (Pa) of
      the rope, its metallic `area` `A` (m²), and `length` `L` (m) of a line between the
      blocks, the part towards the drum included
    - `damping` `c` (N·s/m) at the hook
    - `stretch` `e_0` (m) at the start, below 0: slack by that; `None`: `m g/k`, the
      weight at rest

    A rope cannot push: where `F` falls to 0 it is slack, the hook falls freely and the
    drum bears nothing, until the rope is longer than without load again, `e > 0` and
    `k e + c ė > 0`. The hook starts with the speed `v = ω_0 r_d/n`. `k` stays the same
    over the travel.

    Example:
        >>> lines = sb.loads.RopeElasticity(modulus="100 GPa", area="500 mm^2", length="40 m")
        >>> round(float(lines.at_hook(8)) / 1e6, 4)
        10.0
    """

    stiffness: Scalar | None = positive_quantity(
        "N/m", "stiffness of all lines at the hook", default=None
    )
    damping: Scalar = quantity(
        "N*s/m", "damping of all lines at the hook", low=0.0, default=0.0
    )
    modulus: Scalar | None = positive_quantity(
        "Pa", "modulus of elasticity of the rope", default=None
    )
    area: Scalar | None = positive_quantity(
        "m^2", "metallic cross-section of the rope", default=None
    )
    length: Scalar | None = positive_quantity("m", "length of a line", default=None)
    stretch: Scalar | None = quantity("m", "stretch at the start", default=None)

    def at_hook(self, line_count: Scalar) -> Array:
        """`k` (N/m)."""
        if self.stiffness is not None:
            return jnp.asarray(self.stiffness)
        assert self.modulus is not None
        return jnp.asarray(line_count) * self.modulus * self.area / self.length

    def faults(self, path: str) -> list[Fault]:
        """Error of a stiffness that is given twice, or not at all."""
        present = [
            number is not None for number in (self.modulus, self.area, self.length)
        ]
        if all(present) if self.stiffness is None else not any(present):
            return []
        what = (
            "is missing"
            if self.stiffness is None
            else "is given beside modulus, area or length"
        )
        return [
            Fault(
                f"{path}.stiffness",
                what,
                "give it, or modulus, area and length of the lines",
            )
        ]
