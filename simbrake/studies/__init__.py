"""Studies of a scene: many runs, sensitivities, uncertainty, calibration, and the life
of the linings.

The names are in `__init__.pyi`, each with its module, which is imported at the first
use of the name.
"""

from .._base._arguments import public_names
from .._base._retired import answers

_named, __dir__, __all__ = public_names(__name__, __file__)

_INDICES = "docs/recipes/global_indices.py computes them by SALib on simbrake.studies.evaluator"
__getattr__ = answers(
    __name__,
    gone={
        "FRICTION": "docs/typical_values.md has the ranges of friction materials",
        "GlobalSensitivity": _INDICES,
        "KnownSpread": "simbrake.uncertainty takes ranges of your inputs",
        "known_spread": "simbrake.uncertainty takes ranges of your inputs; "
        "docs/typical_values.md has some",
        "MorrisTable": _INDICES,
        "SobolTable": _INDICES,
        "morris": _INDICES,
        "sobol_indices": _INDICES,
    },
    others=_named,
)
