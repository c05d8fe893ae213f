"""Parts of every kind in a scene file: read again they are as they were written."""

import dataclasses

import jax
import numpy as np
import pytest
import wear_scenes
from heat_scenes import lump, rigid_stop
from helpers import all_near
from scenes import stop_scene
from test_water_cooling import drag, wet_lump

import simbrake as sb
from simbrake import loads
from simbrake.friction import ChangingFriction, FrictionChange, MemoryProcess

ROPE = loads.RopeWeight(6.0, 10.0, 400.0)
POINTS = sb.PiecewiseLinear([1.0, 2.0, 2.0], [2e3, 8e3, 1e3])
LAWS = (
    loads.EddyCurrentBrake("20 kN*m", "60 rpm", sb.ramp(0.0, 1.0, 1.0, 2.0)),
    loads.HydrodynamicBrake(3.0, 0.5),
    loads.TackleLoss(lowering_efficiency=0.9),
    loads.BearingFriction("0.5 kN*m", 700.0, 0.5, 3.0, loads.BearingFriction(40.0)),
    loads.TabulatedDrag([0.0, 7.0], [0.0, 350.0]),
)
CHANGES = (
    FrictionChange(sb.PiecewiseLinear([1.0, 2.0], [1.0, 0.4]), [3, 4], "stop 2"),
    FrictionChange(0.5, when="temperature of the rim below 50 degC"),
)
MEMORY = sb.friction.FrictionWithMemory(
    sb.StribeckFriction(0.45, 0.4, 0.5),
    (
        MemoryProcess(1.0, sb.LinearFade(8e-4, 423.15), 0.5),
        MemoryProcess(1.2, work=4e6),
    ),
    np.linspace(0.8, 0.9, 20),
)
PHASES = loads.Phases(
    (
        loads.Phase(
            0.0,
            "travel -9 m",
            "hoist",
            motor=sb.PiecewiseLinear([0.0, 1.0], [0.0, -20.0]),
        ),
        loads.Phase(POINTS, "rest", "brake", string_on_hook=False),
    ),
    2,
    then=loads.Phases((loads.Phase(9e3, "4 s"),), stands=-1),
)
STRING = loads.StringLoad("8 t", "40 t", 0.4, 8, stand=800.0, weight=ROPE)
CYLINDER = loads.Cylinder(
    POINTS, "300 cm^2", None, 2.0, 0.9, "0.4 kN", "250 ms", "80 ms", "120 psi"
)
LEVER = sb.Lever(
    loads.Actuator(sb.Repeated([0.0, 0.4], [0.0, 5e3], 2.0, 3), 0.2), 1.2, 0.2
)
SCENES = {
    "shaft": stop_scene(load=sb.HookLoad(2e4, 0.4, 8, weight=ROPE), shaft=LAWS),
    "changes": rigid_stop(ChangingFriction(0.35, CHANGES), lump()),
    "memory": rigid_stop(
        MEMORY,
        lump(linings=1e4),
        lever=CYLINDER,
        area=0.02,
        load=loads.WindlassLoad(5e3, 100.0, 0.5, 10.0, 50.0, 1e3),
    ),
    "counterweight": stop_scene(
        lever=LEVER,
        load=loads.CounterweightLoad(
            3e3, 2500.0, 0.5, 2.0, 3.0, 1.0, 300.0, 40.0, traction=2.0
        ),
    ),
    "phases": stop_scene(
        lever=PHASES, load=STRING, motor=loads.Motor("60 kN*m", "2 MW", "40 rad/s")
    ),
    "rope": stop_scene(
        load=sb.HookLoad(
            2e4,
            0.4,
            8,
            rope=loads.RopeLayers(0.04, 4.0, 9.5),
            elasticity=loads.RopeElasticity(
                modulus="100 GPa", area="500 mm^2", length="40 m"
            ),
        )
    ),
    "water": dataclasses.replace(
        drag(wet_lump()), power_shares=sb.PowerShares(0.1, 0.2)
    ),
    "wear": wear_scenes.stop(
        sb.Wear(
            sb.wear.ExponentialWear(2e-14, rise=90.0), permissible=8e-3, turned_at=[3.0]
        )
    ),
    "limits": stop_scene(
        lever=sb.wear.Delayed(POINTS, 0.5),
        limits=sb.Limits(max_tension="90 kN", energy={"friction_heat": "1 kJ"}),
    ),
}


@pytest.mark.parametrize("kind", SCENES)
def test_scene_is_read_as_written(kind):
    written = SCENES[kind]
    text = sb.files.scene_text(written)
    again = sb.files.scene_from_text(text)
    assert jax.tree.structure(again) == jax.tree.structure(
        jax.tree.map(np.asarray, written)
    )
    for one, other in zip(
        jax.tree.leaves(again), jax.tree.leaves(written), strict=True
    ):
        all_near(one, other, 1e-15)
    assert sb.files.scene_text(again) == text
