"""Materials compared on one layered brake."""

import dataclasses

from heat_scenes import TRACK, layered_stop
from scenes import replaced, stop_scene

import simbrake as sb

ROOM = 293.15
DATA = sb.formulas.EstimateData(
    track_area=1.05, lining_area=0.75, rim_thickness=0.05
)  # thick: no heat reaches the back
# of `stop_scene`
J = 800.0
W0 = 20.0


def compared(rims, linings=("FK-24A",), scene=None, **options):
    options = {"data": DATA, "run": False} | options
    return sb.compare_materials(scene or stop_scene(C=None), rims, linings, **options)


def heated(law=None):
    """A rigid band under constant tension: all slides from the first moment, as the
    classical stop assumes."""
    scene = layered_stop(growth=1.15, law=law or sb.ConstantFriction(0.35))
    return replaced(scene, {"brake.band.stiffness": None, "initial": sb.Initial(20.0)})


def whole_scene(partition=None, rim="steel_20L", lining="FK-24A"):
    metal = sb.material(rim)
    lining = sb.material(lining)
    layered = sb.layered_heat(
        rim=metal,
        rim_thickness=0.025,
        track_area=TRACK,
        partition=partition or sb.thermal.EffusivityPartition(metal, lining),
        lining=lining,
        lining_area=0.7 * TRACK,
        band=sb.material("band_steel"),
        inside=10.0,
    )
    flash = sb.thermal.FlashTemperature(50e-6, metal.conductivity, metal.diffusivity)
    heat = dataclasses.replace(
        sb.thermal.with_pulley_structure(layered, metal), flash=flash
    )
    return dataclasses.replace(heated(), heat=heat)
