"""Thermal networks: bodies, links between them, materials, and friction heat.

The names are in `__init__.pyi`, each with its module, which is imported at the first use of the name.
"""

import lazy_loader

from .._base._retired import answers

_named, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

__getattr__ = answers(
    __name__,
    internal={
        "AbstractContactLaw": "thermal._network",
        "AbstractPartition": "thermal._heat",
    },
    others=_named,
)
