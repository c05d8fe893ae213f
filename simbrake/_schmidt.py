"""Schmidt's layer scheme: conduction through a wall by repeated halving, an independent check of a layered rim."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from ._admissible import require_not_negative, require_positive
from ._material import Material


class SchmidtCourse(NamedTuple):
    """Temperatures of a wall by Schmidt's scheme: times (m,) in s, depths (k,) in m, temperatures (m, k) in K."""

    t: Float[np.ndarray, " m"]
    depth: Float[np.ndarray, " k"]
    temperature: Float[np.ndarray, "m k"]

    @property
    def mean(self) -> Float[np.ndarray, " m"]:
        """Mean temperature of the wall (K), by the trapezoidal rule, which the scheme conserves exactly."""
        T = self.temperature
        return (T[:, 1:-1].sum(axis=1) + 0.5 * (T[:, 0] + T[:, -1])) / (T.shape[1] - 1)


def schmidt(
    material: Material,
    thickness: float,
    layers: int,
    end: float,
    flux: float | Callable[[float, float], float],
    *,
    start: float | Float[np.ndarray, " k"] = 0.0,
    front_coefficient: float = 0.0,
    back_coefficient: float = 0.0,
    ambient: float = 0.0,
) -> SchmidtCourse:
    """Temperatures of a wall that is heated at its front, layer by layer (S-28, S-29; E. Schmidt, 1924):

        t_j⁺ = ½ (t_{j−1} + t_{j+1})   at   Δτ = Δx²/(2 a)
        front: t_0⁺ = t_1 + (Δx/λ)[q − h_f (t_0 − t_a)],   back: t_N⁺ = t_{N−1} − (Δx/λ) h_b (t_N − t_a)

    The ends follow from a mirrored node beyond each face, so that what the wall gains is exactly what flows in.

    - `material` at its reference temperature; `thickness` `δ` (m) in `layers` `N` of `Δx = δ/N`; `end` (s): steps of
      `Δτ` are made until it is reached
    - `flux` `q` (W/m²) into the front: a number, or a function of the beginning and end of a step (s), its mean there
    - `start`: temperature of the wall, a number or (N + 1,); `front_coefficient` `h_f`, `back_coefficient` `h_b`
      (W/(m²·K)) to `ambient` `t_a`; temperatures in K or as rises

    Of second order in `Δx` at fixed time: on a half-space under constant flux the surface at an even step falls short
    by the share `Δx²/(8 a t)`. Between an odd step and the next even one the face keeps its temperature (the scheme is
    two interleaved grids). Raises `ValueError` for numbers outside their ranges, fewer than 2 layers, or layers so thick
    that a cooled face would overshoot, `h Δx/λ > 1`.

    Reference: M. Jakob, *Heat Transfer*, vol. 1 (1949), ch. 19.
    """
    require_positive(thickness=thickness, end=end)
    require_not_negative(front_coefficient=front_coefficient, back_coefficient=back_coefficient)
    if layers < 2:
        raise ValueError(f"layers = {layers} must be at least 2")
    dx = thickness / layers
    step = dx**2 / (2 * float(material.diffusivity))
    over = dx / float(material.conductivity)
    if over * max(front_coefficient, back_coefficient) > 1:
        raise ValueError(f"layers of {dx:g} m are too thick for the cooled faces: h Δx/λ must not exceed 1")
    count = max(1, math.ceil(end / step * (1 - 1e-12)))
    T = np.empty((count + 1, layers + 1))
    T[0] = start
    t = step * np.arange(count + 1)
    for m in range(count):
        now, new = T[m], T[m + 1]
        q: Any = flux(t[m], t[m + 1]) if callable(flux) else flux
        new[1:-1] = 0.5 * (now[:-2] + now[2:])
        new[0] = now[1] + over * (q - front_coefficient * (now[0] - ambient))
        new[-1] = now[-2] - over * back_coefficient * (now[-1] - ambient)
    return SchmidtCourse(t, dx * np.arange(layers + 1), T)
