"""Engineering formulas by subject, and the estimates, synthesis and comparison of
materials built on them.

`statics`: classical stops; `heating`: temperatures, balance and thickness of rim and
lining; `stress`: thermal stress; `contact`: areas, radiation, electricity, equivalents.
Names are in `__init__.pyi`; a module is imported when one of its names is used.
"""

from ..._base._arguments import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
