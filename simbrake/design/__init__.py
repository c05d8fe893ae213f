"""Design before a run: `formulas` with estimates, synthesis and materials, and
`layouts` of linings."""

from .._base._arguments import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
