"""Results of a run: series, events, energies, friction at each lining; data sets, files, comparisons.

The names are in `__init__.pyi`, each with its module, which is imported at the first use of the name.
"""

import lazy_loader

from .._base._retired import answers

_named, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

__getattr__ = answers(
    __name__,
    gone={
        **dict.fromkeys(
            ("Beside", "SideBySide"),
            "compare two at a time; pandas.DataFrame([one.metrics for one in results]) shows several",
        ),
        **dict.fromkeys(("EventError", "StateError"), "simbrake.results.ErrorEstimate is of events and states too"),
    },
    others=_named,
)
