"""Figures. Each function draws into a given figure or makes one, and returns it without showing it."""

from ._animation import animate as animate
from ._comparisons import materials as materials
from ._many import compare as compare
from ._many import sweep as sweep
from ._pulley import pressed as pressed
from ._pulley import pulley as pulley
from ._runs import contacts as contacts
from ._runs import depth as depth
from ._runs import duty as duty
from ._runs import lining_map as lining_map
from ._runs import stages as stages
from ._runs import stop as stop
from ._runs import stops as stops
from ._runs import temperatures as temperatures
from ._shared import titled as titled
from ._studies import angles as angles
from ._studies import calibration as calibration
from ._studies import chord_angles as chord_angles
from ._studies import distribution as distribution
from ._studies import effects as effects
from ._studies import indices as indices
from ._studies import layouts as layouts
from ._studies import overlay as overlay
from ._studies import tornado as tornado
from ._studies import wear as wear


def __getattr__(name: str) -> object:
    if name == "work_precision":  # (the hint goes with the next version)
        raise AttributeError("simbrake.plot.work_precision is benchmarks/pictures.py in a checkout of the repository")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
