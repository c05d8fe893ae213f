"""64-bit mode of JAX: on from the moment at which both JAX and simbrake are loaded.
Free of JAX.

Scripts and notebooks need no set-up line, whichever of the two they import first, and
`import simbrake` alone does not wait for JAX. The environment of the process is left as
it is.
"""

import importlib.util
import os
import sys
from importlib.machinery import ModuleSpec
from types import ModuleType

_OFF = ("0", "false", "off", "no", "n", "f")


def use_64_bits() -> None:
    """Turn on the 64-bit mode of JAX, now or when JAX is loaded; `JAX_ENABLE_X64=0` in
    the environment keeps it off."""
    if os.environ.get("JAX_ENABLE_X64", "1").lower() in _OFF:
        return
    if (jax := sys.modules.get("jax")) is not None:
        _turn_on(jax)
    else:
        sys.meta_path.insert(0, _WhenLoaded())


def _turn_on(jax: ModuleType) -> None:
    jax.config.update("jax_enable_x64", True)


class _WhenLoaded:
    """Finder for imports that waits for JAX, and is removed when it is found."""

    def find_spec(
        self, name: str, path: object = None, target: object = None
    ) -> ModuleSpec | None:
        if name != "jax":
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(name)
        if spec is not None and spec.loader is not None:
            load = spec.loader.exec_module

            def exec_module(module: ModuleType) -> None:
                load(module)
                _turn_on(module)

            spec.loader.exec_module = exec_module
        return spec
