"""Scenes in files, and given functions of time from measurements.

The names are in `__init__.pyi`, each with its module, which is imported at the first
use of the name.
"""

from .._base._arguments import public_names
from .._base._retired import answers

_named, __dir__, __all__ = public_names(__name__, __file__)

__getattr__ = answers(
    __name__,
    gone={
        "open_scene": "simbrake.read_scene reads files of both kinds",
        "write_fmu": "simbrake.export.export_fmu writes an FMU of C, which needs no Python",
        "export_c": "simbrake.export_c is its place",
        "export_fmu": "simbrake.export.export_fmu is its place",
    },
    others=_named,
)
