"""simbrake: a differentiable dynamic simulator of band-shoe brakes of drilling drawworks.

The names at the top are in `__init__.pyi`, each with its module, which is imported at the first use of the name: a
run
does not load the modules of the studies, estimates and pages. Less frequent names are in the
packages: friction, loads, profiles, thermal, wear, brakes; hybrid, results, studies, layouts, formulas,
published, checks, files, plot.

Importing simbrake turns on the 64-bit mode of JAX, whichever is imported first: events cannot be located in 32 bits.
Only where the environment variable JAX_ENABLE_X64 is 0 does it stay off, and a run is an error.
"""

import importlib.util
from typing import Any

import lazy_loader

from ._base._precision import use_64_bits

_named, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

__version__ = "0.1.0"

use_64_bits()


def __getattr__(name: str) -> Any:
    try:
        return _named(name)
    except AttributeError:
        if name.startswith("_"):
            raise
    packages = [_named(one) for one in __all__ if importlib.util.find_spec(f"{__name__}.{one}")]
    homes = [home.__name__ for home in packages if name in getattr(home, "__all__", ())]
    hint = f": it is {' and '.join(f'{home}.{name}' for home in homes)}" if homes else ""
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}{hint}")
