"""Public names that went: the modules that had them answer for one version. Free of
JAX."""

from collections.abc import Callable, Mapping
from typing import Any


def answers(
    home: str, gone: Mapping[str, str], others: Callable[[str], Any] | None = None
) -> Callable[[str], Any]:
    """`__getattr__` of a public module, or of a class, for names that went.

    - `gone`: name → what to use instead; a use is an error that says so
    - `others`: what finds all other names, as of `lazy_loader`
    """

    def lookup(name: str) -> Any:
        if instead := gone.get(name):
            raise AttributeError(f"{home}.{name} went: {instead}")
        if others is None:
            raise AttributeError(f"{home} has no attribute {name!r}")
        return others(name)

    return lookup
