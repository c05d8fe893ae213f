"""Figures. Each function draws into a given figure or makes one, and returns it without showing it."""

from .._base._retired import answers
from ._animation import animate
from ._many import compare, materials, permissible, sweep
from ._pulley import pressed, pulley
from ._rig import ledger, replay
from ._runs import contacts, depth, duty, lining_map, stages, stop, stops, temperatures
from ._shared import titled
from ._studies import angles, calibration, chord_angles, distribution, layouts, overlay, tornado, wear

__all__ = [
    "angles",
    "animate",
    "calibration",
    "chord_angles",
    "compare",
    "contacts",
    "depth",
    "distribution",
    "duty",
    "layouts",
    "ledger",
    "lining_map",
    "materials",
    "overlay",
    "permissible",
    "pressed",
    "pulley",
    "replay",
    "stages",
    "stop",
    "stops",
    "sweep",
    "temperatures",
    "titled",
    "tornado",
    "wear",
]

__getattr__ = answers(
    __name__,
    gone={
        "indices": "docs/recipes/global_indices.py has them as a table, made by SALib",
        "effects": "docs/recipes/global_indices.py has them as a table, made by SALib",
        "browse": "plot.stop draws the run over time, plot.pulley the brake at a time; simbrake app has sliders",
    },
)
