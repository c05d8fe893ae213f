"""Validation of laws along a stop: friction, memory, changes, flash temperature, wear, contacts that open.

The truths are in `truths.csv`, made by `tests/oracles/truths.py`, which imports nothing of simbrake.
"""

from typing import Any

from case_tools import Case, frozen_cases
from stop_scenes import stop_scene

from simbrake import (
    ConstantFriction,
    Heat,
    LinearFade,
    Scene,
    lumped_heat,
    with_values,
)
from simbrake.friction import (
    AbstractFriction,
    PressureFactor,
    ProductFriction,
)
from simbrake.thermal import ROOM, ConstantPartition, FlashTemperature

_N = 4
_LAW = "brake.linings.friction"


def _stop(law: AbstractFriction, heat: Heat | None = None, end: float = 3.0, **parts: Any) -> Scene:
    """A stop of four linings of 50° under a constant lever, the band rigid where no stiffness `C` is given."""
    scene = stop_scene(n=_N, beta=50.0, law=law, end=end, **{"C": None, **parts})
    return Scene(scene.brake, scene.duty, scene.initial, end, heat)


def _rim(capacity: float, flash: FlashTemperature | None = None) -> Heat:
    """All heat into one insulated lump, of which the friction takes its temperature."""
    heat = lumped_heat(rim=capacity, partition=ConstantPartition(1.0), rim_cooling=0.0)
    return Heat(heat.bodies, heat.links, heat.friction, heat.sources, flash, heat.rim, heat.linings, heat.band)


def _fading(slope: float) -> AbstractFriction:
    return ProductFriction(ConstantFriction(0.35), (LinearFade(slope, ROOM, 0.0, 0.0),))  # pyright: ignore


def pressed_cases() -> list[Case]:
    """Friction that falls with the pressure, which it raises: implicit, lining by lining."""
    law = ProductFriction(ConstantFriction(0.35), (PressureFactor(1e6, 0.3),))  # pyright: ignore
    factor = f"{_LAW}.factors.0"
    return frozen_cases(
        "friction under pressure",
        with_values(_stop(law), {"brake.linings.area": 0.03}),
        {
            "stopping time": "stopping_time",
            "friction of lining 4": lambda result: result.series([0.5]).pairs["external"].friction_coefficient[0, 3],
            "tight tension": lambda result: result.series([0.5]).tight_tension[0],
        },
        {"∂(stopping time)/∂m": f"{factor}.exponent", "∂(stopping time)/∂p_r": f"{factor}.reference"},
    )


def heated_cases() -> list[Case]:
    """Fade on an elastic band, which yields as it fades, and flash temperature, which makes friction implicit."""
    flash = FlashTemperature(1e-3, 50.0, 1.44e-5, 1.0, 3e7)
    elastic = _stop(_fading(2e-3), _rim(1.5e3), C=1e5, load=500.0)
    read = {"full slip": "full_slip_time", "stopping time": "stopping_time", "rim at rest": "end_temperatures.0"}
    return [
        *frozen_cases("fade under an elastic band", elastic, read, {"∂(stopping time)/∂s": f"{_LAW}.factors.0.slope"}),
        *frozen_cases("flash temperature", _stop(_fading(1e-3), _rim(1e5, flash)), read),
    ]


CASES = (
    pressed_cases,
    heated_cases,
)
