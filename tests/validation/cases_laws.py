"""Validation of laws along a stop: friction, memory, changes, flash temperature, wear, contacts that open.

The truths are in `truths.csv`, made by `tests/oracles/truths.py`, which imports nothing of simbrake.
"""

from typing import Any

from case_tools import Case, frozen_cases
from stop_scenes import stop_scene, time_of

from simbrake import (
    ConstantFriction,
    Heat,
    LinearFade,
    PiecewiseLinear,
    Scene,
    lumped_heat,
    with_values,
)
from simbrake.friction import (
    AbstractFriction,
    PressureFactor,
    ProductFriction,
    StribeckFriction,
    TabulatedFriction,
)
from simbrake.thermal import ROOM, Conductance, ConstantPartition, FlashTemperature, FrictionHeat, Lump, ThermalContact

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
    return ProductFriction(ConstantFriction(0.35), (LinearFade(slope, ROOM, 0.0, 0.0),))


def speed_cases() -> list[Case]:
    """Friction over the slip speed, a curve and a table."""
    table = TabulatedFriction([0.0, 4.0, 9.0, 16.0], [0.42, 0.35, 0.31, 0.30])
    # the band circle is wider than the rim
    elastic = with_values(_stop(StribeckFriction(0.40, 0.28, 4.0, 1.0), C=1.2e5), {"brake.band.radius": 0.76})
    return [
        *frozen_cases(
            "Stribeck friction on an elastic band",
            elastic,
            {
                "full slip": "full_slip_time",
                "sticks again": time_of("restick"),
                "stopping time": "stopping_time",
                "friction heat": "energy.friction_heat",
                "elastic energy at rest": "energy.elastic_change",
            },
            {"∂(stopping time)/∂v_s": f"{_LAW}.stribeck_speed"},
        ),
        *frozen_cases(
            "tabulated friction",
            _stop(table),
            {"stopping time": "stopping_time", "angle": "stopping_angle"},
            {"∂(stopping time)/∂f_2": f"{_LAW}.coefficient.1"},
        ),
    ]


def pressed_cases() -> list[Case]:
    """Friction that falls with the pressure, which it raises: implicit, lining by lining."""
    law = ProductFriction(ConstantFriction(0.35), (PressureFactor(1e6, 0.3),))
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


def contact_cases() -> list[Case]:
    """Rim and linings at rest exchange heat until the band is released."""
    links = (ThermalContact("rim", "linings", 0.1, 0.1 / 40.0, opens=True), Conductance("linings", "band", 25.0))
    bodies = (Lump("rim", 4e3, 420.0), Lump("linings", 600.0, 350.0), Lump("band", 900.0, 300.0))
    heat = Heat(
        bodies, links, FrictionHeat("rim", "linings", ConstantPartition(0.5)), (), None, "rim", "linings", "band"
    )
    lever = PiecewiseLinear([0.0, 20.0, 20.0, 50.0], [2e3, 2e3, 0.0, 0.0])
    scene = _stop(ConstantFriction(0.35), heat, lever=lever, w0=0.0, end=50.0)
    return frozen_cases(
        "contact that opens",
        scene,
        {"rim": "end_temperatures.0", "linings": "end_temperatures.1"},
        {"∂(linings)/∂R_c": "heat.links.0.resistance"},
        of=lambda result: result.end_temperatures[1],
    )


CASES = (speed_cases, pressed_cases, heated_cases, contact_cases)
