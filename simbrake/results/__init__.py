"""Results of a run: series, events, energies, friction at each lining; data sets,
files.

The names are in `__init__.pyi`, each with its module, which is imported at the first
use of the name.
"""

import importlib
from typing import Any

from .._base._arguments import public_names
from .._base._retired import answers

_named, __dir__, __all__ = public_names(__name__, __file__)

#: what wings say of results, by its wing
_ABOVE = {
    "compare": "checks",
    "Comparison": "checks",
    "explain": "studies",
    "Explanation": "studies",
}


def _found(name: str) -> Any:
    if wing := _ABOVE.get(name):
        return getattr(importlib.import_module(f"simbrake.{wing}"), name)
    return _named(name)


__getattr__ = answers(
    __name__,
    gone={
        "Judged": "simbrake.results.LimitCoverage is its name",
        **dict.fromkeys(
            ("Beside", "SideBySide"),
            "compare two at a time; pandas.DataFrame([one.metrics for one in results]) "
            "shows several",
        ),
        **dict.fromkeys(
            ("EventError", "StateError"),
            "simbrake.results.ErrorEstimate is of events and states too",
        ),
    },
    others=_found,
)
