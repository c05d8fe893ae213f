"""A scene in steps, and as a program of its own: C without dependencies, and an FMU.

The names are in `__init__.pyi`, each with its module, which is imported at the first
use of the name.
"""

from .._base._arguments import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
