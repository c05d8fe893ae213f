"""Schmidt's layer scheme: conduction through a wall by repeated halving, an independent check of a layered rim."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from .._base._admissible import require_not_negative, require_positive
from ..thermal._material import Material


class SchmidtCourse(NamedTuple):
    """Temperatures of a wall by Schmidt's scheme: times (m,) in s, depths (N + 2,) in m, temperatures (m, N + 2) in K.

    First and last depth are the faces, between them the centres of the layers.
    """

    t: Float[np.ndarray, " m"]
    depth: Float[np.ndarray, " k"]
    temperature: Float[np.ndarray, "m k"]

    @property
    def mean(self) -> Float[np.ndarray, " m"]:
        """Mean temperature of the layers (K): the scheme keeps it to the last joule."""
        return self.temperature[:, 1:-1].mean(axis=1)


def schmidt(
    material: Material,
    thickness: float,
    layers: int,
    end: float,
    flux: float | Callable[[float, float], float],
    *,
    start: float | Float[np.ndarray, " N"] = 0.0,
    front_coefficient: float = 0.0,
    back_coefficient: float = 0.0,
    ambient: float = 0.0,
) -> SchmidtCourse:
    """Temperatures of a wall that is heated at its front, layer by layer (S-28, S-29; E. Schmidt, 1924):

        t_j⁺ = ½ (t_{j−1} + t_{j+1}),   Δτ = Δx²/(2 a),   j = 1…N
        face: t_s = (t_j + Δx (q + h t_a)/(2 λ))/(1 + h Δx/(2 λ)),   layer beyond it: 2 t_s − t_j

    The layers' temperatures are those of their centres. Outside each face stands a layer with the temperature that
    makes the flow through the face right, so that what the wall gains is exactly what flows in.

    - `material` at its reference temperature; `thickness` `δ` (m) in `layers` `N` of `Δx = δ/N`; `end` (s): steps of
      `Δτ` are made until it is reached
    - `flux` `q` (W/m²) into the front: a number, or a function of the beginning and end of a step (s), its mean there
    - `start`: temperature of the wall, a number or (N,); `front_coefficient` `h_f`, `back_coefficient` `h_b`
      (W/(m²·K)) to `ambient` `t_a`; temperatures in K or as rises

    Of second order in `Δx` at fixed time, and stable with any coefficient. (Nodes on the faces, as the scheme is often
    drawn, form two interleaved grids; a cooled face then drives these apart without bound.) Raises `ValueError` for
    numbers outside their ranges and for fewer than 2 layers.

    Reference: M. Jakob, *Heat Transfer*, vol. 1 (1949), ch. 19.
    """
    require_positive(thickness=thickness, end=end)
    require_not_negative(front_coefficient=front_coefficient, back_coefficient=back_coefficient)
    if layers < 2:
        raise ValueError(f"layers = {layers} must be at least 2")
    dx = thickness / layers
    step, half = dx**2 / (2 * float(material.diffusivity)), dx / (2 * float(material.conductivity))

    def face(t: Any, q: Any, h: float) -> Any:
        return (t + half * (q + h * ambient)) / (1 + half * h)

    count = max(1, math.ceil(end / step * (1 - 1e-12)))
    t = step * np.arange(count + 1)
    entering = [flux(t[m], t[m + 1]) if callable(flux) else flux for m in range(count)]
    padded = np.empty(layers + 2)
    T = np.empty((count + 1, layers + 2))
    T[0] = np.pad(np.broadcast_to(np.asarray(start, float), (layers,)), 1, mode="edge")
    for m, q in enumerate(entering):
        padded[1:-1] = now = T[m, 1:-1]
        padded[0] = 2 * face(now[0], q, front_coefficient) - now[0]
        padded[-1] = 2 * face(now[-1], 0.0, back_coefficient) - now[-1]
        T[m + 1, 1:-1] = 0.5 * (padded[:-2] + padded[2:])
    after = np.asarray([*entering[1:], entering[-1]])
    T[1:, 0] = face(T[1:, 1], 0.5 * (np.asarray(entering) + after), front_coefficient)
    T[1:, -1] = face(T[1:, -2], 0.0, back_coefficient)
    depth = np.concatenate([[0.0], dx * (np.arange(layers) + 0.5), [thickness]])
    return SchmidtCourse(t, depth, T)
