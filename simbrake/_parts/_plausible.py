"""What is unusual for a brake of drilling drawworks: warnings with their source, never a refusal."""

import math

import numpy as np
from jax.core import Tracer

from .._base._quantity import leaves
from ._design import Brake
from ._network import place_of
from ._scene import Scene, static_friction

_DRUMEANU = "Drumeanu & Antonescu 2003, band brakes of drawworks"
#: coefficient of friction, wrap angle (deg), rim temperature (°C): low, high
FRICTION, WRAP, RIM = (0.35, 0.65), (270.0, 325.0), (300.0, 800.0)
#: linings of a band; conductivities (W/(m·K)) of rims and linings
LININGS, RIM_CONDUCTIVITY, LINING_CONDUCTIVITY = (8.0, 26.0), (38.0, 163.0), (0.4, 1.5)
ZERO = 273.15  # K


def plausibility(scene: Scene, peak_rim: float | None = None) -> list[str]:
    """Numbers of a scene that are unusual for a brake of drawworks: what, the usual range, its source, the reason.

    - static coefficient of friction 0.35…0.65, wrap 270…325°, rim at most 800 °C: Drumeanu & Antonescu (2003); Z has
      cases down to 0.1, and a single stop stays far below 300 °C, so that there is no warning for a cool rim
    - 8…26 linings: Z;  conductivity of rim 38…163 and linings 0.4…1.5 W/(m·K): V, tables 1 and 2, and textbooks
    - `peak_rim`: highest rim temperature (K) of a run of it, if there was one
    """
    if any(isinstance(leaf.value, Tracer) for leaf in leaves(scene)):
        return []
    found = _of_brake(scene)
    if peak_rim is not None and peak_rim - ZERO > RIM[1]:
        found.append(
            f"unusual: rim at {peak_rim - ZERO:.0f} °C, usual in heavy service are {RIM[0]:.0f}…{RIM[1]:.0f} °C "
            f"({_DRUMEANU}); properties of steel and linings are not known that hot"
        )
    return found + _of_materials(scene)


def _of_brake(scene: Scene) -> list[str]:
    brake, found = scene.brake, []
    if not isinstance(brake, Brake):
        return []  # the sources are about band brakes
    n, f = brake.linings.count, static_friction(scene)
    if _outside(f.min(), FRICTION) or _outside(f.max(), FRICTION):
        values = f"{f.min():.4g}" if np.ptp(f) < 1e-12 else f"{f.min():.4g}…{f.max():.4g}"
        found.append(
            f"unusual: static coefficient of friction {values}, usual are {FRICTION[0]}…{FRICTION[1]} ({_DRUMEANU}); "
            "tensions depend on it exponentially (Z computes cases down to 0.1)"
        )
    wrap = math.degrees(float(np.sum(brake.linings.angle)))
    if _outside(wrap, WRAP):
        found.append(
            f"unusual: wrap {wrap:.5g}°, usual are {WRAP[0]:.0f}…{WRAP[1]:.0f}° ({_DRUMEANU}); "
            "the grip of the band depends on it exponentially"
        )
    if _outside(float(n), LININGS):
        found.append(f"unusual: {n} linings, usual are {LININGS[0]:.0f}…{LININGS[1]:.0f} (Z)")
    return found


def _of_materials(scene: Scene) -> list[str]:
    found, heat = [], scene.network
    walls = {wall.name: wall for wall in heat.walls}
    for what, place, usual in (("rim", heat.rim, RIM_CONDUCTIVITY), ("linings", heat.linings, LINING_CONDUCTIVITY)):
        wall = walls.get(place_of(place)[0]) if place else None
        if wall is not None and _outside(float(wall.material.conductivity), usual):
            value = float(wall.material.conductivity)
            found.append(
                f"unusual: {what} with {value:.4g} W/(m·K), usual are {usual[0]:g}…{usual[1]:g} (V, tables 1 and 2); "
                "is the unit right?"
            )
    return found


def _outside(value: float, usual: tuple[float, float]) -> bool:
    slack = 1e-9 * usual[1]  # the angles of equal linings add up to a wrap with rounding
    return not usual[0] - slack <= value <= usual[1] + slack
