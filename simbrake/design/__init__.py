"""Design before a run: `formulas` with estimates, synthesis and materials, and `layouts` of linings."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
