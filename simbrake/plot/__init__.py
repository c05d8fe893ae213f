"""Figures. Each function draws into a given figure or makes one, and returns it without
showing it.

The names are in `__init__.pyi`, each with its module, which is imported at the first
use of the name.
"""

from .._base._arguments import public_names
from .._base._retired import answers

_named, __dir__, __all__ = public_names(__name__, __file__)

_LAYOUTS = ("angles", "chord_angles", "layouts")
__getattr__ = answers(
    __name__,
    gone={
        **{name: f"simbrake.layouts.figures.{name} draws it" for name in _LAYOUTS},
        "materials": "simbrake.formulas.figures.materials draws it",
        **{
            name: f"simbrake.rig.figures.{name} draws it"
            for name in ("ledger", "replay")
        },
        "indices": "docs/recipes/global_indices.py has them as a table, made by SALib",
        "effects": "docs/recipes/global_indices.py has them as a table, made by SALib",
        "browse": "plot.stop draws the run over time, plot.pulley the brake at a time; "
        "simbrake app has sliders",
    },
    others=_named,
)
