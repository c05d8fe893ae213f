"""Figures. Each function draws into a given figure or makes one, and returns it without showing it."""

from .._base._retired import answers
from ._animation import animate
from ._many import compare, permissible, sweep
from ._runs import contacts, depth, duty, lining_map, stages, stop, stops, temperatures
from ._studies import calibration, distribution, overlay, tornado, wear
from .drawing import titled
from .wheels import pressed, pulley

__all__ = [
    "animate",
    "calibration",
    "compare",
    "contacts",
    "depth",
    "distribution",
    "duty",
    "lining_map",
    "overlay",
    "permissible",
    "pressed",
    "pulley",
    "stages",
    "stop",
    "stops",
    "sweep",
    "temperatures",
    "titled",
    "tornado",
    "wear",
]

_LAYOUTS = ("angles", "chord_angles", "layouts")
__getattr__ = answers(
    __name__,
    gone={
        **{name: f"simbrake.layouts.figures.{name} draws it" for name in _LAYOUTS},
        "materials": "simbrake.formulas.figures.materials draws it",
        **{name: f"simbrake.rig.figures.{name} draws it" for name in ("ledger", "replay")},
        "indices": "docs/recipes/global_indices.py has them as a table, made by SALib",
        "effects": "docs/recipes/global_indices.py has them as a table, made by SALib",
        "browse": "plot.stop draws the run over time, plot.pulley the brake at a time; simbrake app has sliders",
    },
)
