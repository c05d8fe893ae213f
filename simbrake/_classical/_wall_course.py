"""Temperatures of the layers of a wall over a run, however many copies of it there are."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from .._run._series import Series
from ..thermal._heat import Heat, node_names
from ..thermal._material import Material
from ..thermal._network import Wall, place_of


class WallCourse(NamedTuple):
    """Layers (m, k) of a wall in K from the named face on, mean of its copies; depth and thickness (k,) of each (m)."""

    wall: Wall
    layers: Float[np.ndarray, "m k"]
    depth: Float[np.ndarray, " k"]
    steps: Float[np.ndarray, " k"]

    def mean(self, depth: float) -> Float[np.ndarray, " m"]:
        """Mean temperature (K) down to a depth (m), by the shares of the layers inside it."""
        inside = self.inside(depth)
        return self.layers @ inside / np.sum(inside)

    def inside(self, depth: float) -> Float[np.ndarray, " k"]:
        """How much of each layer's thickness (m) lies within a depth."""
        ends = np.cumsum(self.steps)
        return np.clip(depth - (ends - self.steps), 0.0, self.steps)

    @property
    def content(self) -> Float[np.ndarray, " m"]:
        """Heat per area (J/m²) above that of the first row, with the material's temperature dependence."""
        return heat_content(self.wall.material, self.layers[:1], self.layers) @ self.steps


def heat_content(material: Material, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """`ρ ∫ c dT` (J/m³) from `start` to `end` (K), exact for a specific heat that is linear in the temperature."""
    slope = 0.0 if material.specific_heat_slope is None else float(material.specific_heat_slope)
    middle = 0.5 * (start + end) - float(material.reference)
    return float(material.density * material.specific_heat) * (1 + slope * middle) * (end - start)


def wall_course(heat: Heat, s: Series, place: str | None) -> WallCourse | None:
    """The wall at whose face a place is, over a concrete series; `None` where that is no wall."""
    if place is None or s.temperature is None:
        return None
    name, face = place_of(place)
    wall = next(body for body in heat.bodies if body.name == name)
    if not isinstance(wall, Wall):
        return None
    first = [wall.name, f"{wall.name}[1]", f"{wall.name}[1,1]"]
    at = next(i for i, node in enumerate(node_names(heat)) if node in first)
    layers = np.asarray(s.temperature)[:, at : at + wall.count].reshape(-1, wall.copies, wall.layers).mean(axis=1)
    steps = np.asarray(wall.steps)
    if face == "back":
        layers, steps = layers[:, ::-1], steps[::-1]
    return WallCourse(wall, layers, np.cumsum(steps) - 0.5 * steps, steps)
