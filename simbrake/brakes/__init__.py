"""Brakes and their parts: band, linings, pulley, bandage; discs with pads, drums with shoes; their statics.

The names are in `__init__.pyi`, each with its module, which is imported at the first use of the name.
"""

import lazy_loader

from .._base._retired import answers

_named, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

__getattr__ = answers(
    __name__,
    internal={
        "AbstractGeometry": "brakes._band",
    },
    others=_named,
)
