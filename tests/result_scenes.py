"""Scenes whose results are saved, loaded and compared."""

from scenes import stop_scene

import simbrake as sb


def heated_stop():
    """Two linings, a rim in three layers and two walls in two layers, all joined to the
    air."""
    iron = sb.Material(48.0, 7800.0, 500.0)
    stuff = sb.Material(0.8, 2000.0, 900.0)
    heat = sb.Heat(
        bodies=(
            sb.thermal.Wall("rim", iron, 0.028, 0.9, 3, 1.5),
            sb.thermal.Lump("shield/cover", 2e3),
            sb.thermal.Wall("lining", stuff, 0.03, 0.05, 2, copies=2),
            sb.thermal.Reservoir("air"),
        ),
        links=(
            sb.thermal.Convection("rim.back", 0.9, 60.0),
            sb.thermal.Convection("lining.back", 0.05, 20.0),
            sb.thermal.Conductance("shield/cover", "air", 1.0),
        ),
        friction=sb.thermal.FrictionHeat("rim.front", "lining.front", 0.9),
        rim="rim.front",
        linings="lining.front",
    )
    return stop_scene(n=2, beta=120.0, C=None, end=4.0, heat=heat)
