"""From a scene to its system of equations, initial state and first mode: which kind of brake it is."""

from typing import Any

from .._parts._scene import Scene
from .._parts._worn import worn_scene
from ._acting import AbstractBrakeSystem
from ._assemble_band import assemble_band
from ._assemble_bandage import assemble_bandage
from ._assemble_chain import assemble_chain
from ._brake import BrakeSystem


def assemble(scene: Scene) -> tuple[AbstractBrakeSystem | BrakeSystem, Any, Any]:
    """System, initial state and initial mode of a scene. The run settles the true first mode itself, as an event.

    With feedback of wear the brake is as worn as it is at the start of the run.
    """
    scene = worn_scene(scene)
    if scene.brake.band.segments is not None:
        return assemble_chain(scene)
    bandage = scene.brake.bandage
    if bandage is not None and bandage.spring is not None:
        return assemble_bandage(scene)
    return assemble_band(scene)
