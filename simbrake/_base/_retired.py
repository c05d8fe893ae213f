"""Public names that went or became internal: the modules that had them answer for one version. Free of JAX."""

import importlib
import warnings
from collections.abc import Callable, Mapping
from typing import Any


def answers(
    module: str,
    *,
    internal: Mapping[str, str] | None = None,
    moved: Mapping[str, str] | None = None,
    gone: Mapping[str, str] | None = None,
    others: Callable[[str], Any] | None = None,
) -> Callable[[str], Any]:
    """`__getattr__` of a public module for its former names.

    - `internal`: name → module of the package that has it still, `module:name` under another name; a use warns
    - `moved`: name → its public place now, below the package; a use warns
    - `gone`: name → what to use instead; a use is an error that says so
    - `others`: what finds all other names, as of `lazy_loader`
    """
    package = module.partition(".")[0]

    def lookup(name: str) -> Any:
        if home := (internal or {}).get(name):
            said = f"{module}.{name} is internal, and leaves {module} with the next version"
            warnings.warn(said, DeprecationWarning, stacklevel=2)
            home, _, present = home.partition(":")
            return getattr(importlib.import_module(f"{package}.{home}"), present or name)
        if place := (moved or {}).get(name):
            warnings.warn(f"{module}.{name} is {package}.{place} now", DeprecationWarning, stacklevel=2)
            home, _, present = f"{package}.{place}".rpartition(".")
            return getattr(importlib.import_module(home), present)
        if instead := (gone or {}).get(name):
            raise AttributeError(f"{module}.{name} went: {instead}")
        if others is None:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        return others(name)

    return lookup
