"""Values that are in range, and most likely in another unit than was meant: warnings with what may have been meant."""

import math

import numpy as np

from .._base._table import number
from ..brakes._design import AbstractBrake
from ..loads import AbstractLoad
from ..thermal._heat import Heat

#: inertia (kg·m²) of a drawworks' drum, whose hook never carries less than the mass (kg): the block alone is heavier
_DRUM, _BLOCK = 100.0, 1000.0
#: track speeds (m/s) of brakes stay below; temperatures (K) of brakes and air lie above
_FAST, _COLD = 60.0, 200.0


def did_you_mean(brake: AbstractBrake, load: AbstractLoad, omega: float, heat: Heat) -> list[str]:
    """Warnings of values that are most likely in another unit (concrete values only)."""
    found = []
    for name in ("mass", "empty", "string"):
        mass = float(np.max(getattr(load, name, 0.0)))
        if 0 < mass < _BLOCK and float(brake.inertia) >= _DRUM:
            about = f"on the hook of a drum with {float(brake.inertia):g} kg·m²"
            found.append(_said(f"duty.load.{name}", f"{mass:g} kg", about, f'"{mass:g} t"'))
    speed = abs(omega) * float(brake.track_radius)
    if speed > _FAST:
        turned = f'"{omega:g} rpm" ({omega * math.pi / 30:.4g} rad/s)'
        found.append(
            _said("initial.omega", f"{omega:g} rad/s", f"{number(speed, 'm/s', count=3)} at the track", turned)
        )
    for i, body in enumerate(heat.bodies):
        T = getattr(body, "temperature", None)
        if isinstance(T, np.ndarray) and np.any(T < _COLD):
            least = float(np.min(T))
            cold = f"{least - 273.15:g} °C"
            found.append(_said(f"heat.bodies[{i}].temperature", f"{least:g} K", cold, f'"{least:g} degC"'))
    return found


def _said(path: str, value: str, about: str, meant: str) -> str:
    return f"unit: {path} = {value}, {about}: did you mean {meant}?"
