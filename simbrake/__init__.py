"""simbrake: a differentiable dynamic simulator of band-shoe brakes of drilling drawworks.

The public names stand in `__init__.pyi`, each with its module, which is imported when the name is first used: who runs
one braking need not wait for the modules of the studies, estimates and pages.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

__version__ = "0.1.0"
