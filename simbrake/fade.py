"""Moved: the factors of friction are in `simbrake.friction`. This name goes with the next version."""

import warnings

from .friction import *  # noqa: F403

warnings.warn("simbrake.fade is simbrake.friction", DeprecationWarning, stacklevel=2)
