"""Scenes in files, and given functions of time from measurements.

The names stand in `__init__.pyi`, each with its module, which is imported when the name is first used.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
