"""Pages of results: the report of a run, the app with sliders, the page that runs by
itself, the duty ledger of a rig.

The names are in `__init__.pyi`, each with its module, which is imported at the first
use of the name.
"""

from .._base._arguments import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
