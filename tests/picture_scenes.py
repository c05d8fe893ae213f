"""Results that are drawn, and how tests find in a picture what was drawn."""

import dataclasses
import functools
import math
import typing

import numpy as np
from matplotlib.patches import Wedge
from scenes import drawworks_brake, replaced, stop_scene

import simbrake as sb

GAP = math.radians(2.0)


def small_stop():
    """A small drawworks under a hook load."""
    brake = drawworks_brake()
    return sb.Scene(
        brake, sb.Duty("12 kN", sb.HookLoad("20 t", 0.4, 8)), sb.Initial(24.0), 4.0
    )


@functools.cache
def plain_result():
    """A stop with gaps between 8 linings and a soft linkage."""
    n = 8
    gaps = np.full(7, GAP)
    gaps[3] = 3 * GAP
    band = sb.brakes.LiningsOnPlates(
        modulus=2e11, area=1.3e-3, slack_end=0.3, tight_end=0.5, linkage=2e5, gap=gaps
    )
    scene = stop_scene(n=n, beta=30.0, end=4.0)
    return sb.simulate(replaced(scene, {"brake.band.stiffness": band}))


@functools.cache
def staged_result():
    """A staged brake on a rigid band, through all stages."""
    scene = stop_scene(
        n=6, beta=40.0, f=0.42, C=None, lever=sb.ramp(1e3, 15e3, 0.0, 0.5), end=4.0
    )
    bandage = sb.Bandage(inertia=20.0, friction=sb.ConstantFriction(0.28), preload=3e3)
    return sb.simulate(replaced(scene, {"brake.bandage": bandage}))


@functools.cache
def hot_result():
    """A stop with a rim in graded layers and a wall for each of 4 linings."""
    steel = sb.material("steel_20L")
    lining = sb.material("FK-24A")
    heat = sb.layered_heat(
        rim=steel,
        rim_thickness=0.025,
        track_area=0.8,
        rim_layers=6,
        rim_first=1e-3,
        lining=lining,
        lining_thickness=0.03,
        lining_area=0.6,
        lining_layers=3,
        each=4,
        partition=sb.thermal.EffusivityPartition(steel, lining),
    )
    scene = stop_scene(n=4, beta=60.0, lever=sb.ramp(2e3, 20e3, 0.0, 0.3), end=2.5)
    return sb.simulate(dataclasses.replace(scene, heat=heat))


@functools.cache
def disc_result():
    return sb.simulate(sb.read_scene("disc"))


@functools.cache
def shoe_result():
    force = sb.PiecewiseLinear([0.0, 0.25, 9.0], [0.0, 2000.0, 2000.0])
    friction = sb.ConstantFriction(0.32)
    shoes = sb.Shoes(friction, 0.15, 0.032, 0.15, 2.2)
    brake = sb.ShoeBrake(12.0, shoes, 0.1227, 0.212)
    duty = sb.ForceDuty(force, 0.0)
    return sb.simulate(sb.Scene(brake, duty, sb.Initial(25.0), 4.0))


@functools.cache
def chain_result():
    """Four linings of a chain slip one after the other."""
    scene = stop_scene(n=4, beta=60.0, C=1e5, T0=2e3, w0=6.0, elongation=0.02, end=0.05)
    changes = {"brake.band.segments": sb.Segments(2e7), "brake.linings.mass": 4.0}
    return sb.simulate(replaced(scene, changes))


def radius(xy):
    return np.hypot(*np.asarray(xy, float).T)


def wedges(axes, gid):
    return [p for p in axes.patches if isinstance(p, Wedge) and p.get_gid() == gid]


def scale(axes, gid):
    """Value of a radius, from the two ends of a scale as it is written in the
    picture."""
    texts = [t for t in axes.texts if t.get_gid() == gid]
    values = np.asarray([float(t.get_text().removesuffix(" kN")) for t in texts])
    radii = radius([t.get_position() for t in texts])
    assert texts[int(np.argmax(radii))].get_text().endswith(" kN")
    slope = (values[-1] - values[0]) / (radii[-1] - radii[0])
    return lambda r: values[0] + slope * (np.asarray(r) - radii[0])


def legend(drawn):
    """Texts of the legends of a figure or of a panel."""
    found = drawn.legends if hasattr(drawn, "legends") else [drawn.get_legend()]
    return [text.get_text() for one in found if one for text in one.get_texts()]


def row_type(table, field):
    """The class of the rows that a result of a study has in a field, as its annotation
    says."""
    return next(
        one
        for one in typing.get_args(typing.get_type_hints(table)[field])
        if dataclasses.is_dataclass(one)
    )
