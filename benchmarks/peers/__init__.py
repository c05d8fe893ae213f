"""Other tools on the same scenes, one module each, with one interface.

- `NAME`, `PACKAGES` (import names) and `PIP` (what to install)
- `methods(case)`: the tool's methods for a scene, each with `None` or with the reason
  why it does not run it
- `prepare(case, method, tolerance)`: everything that one does once (build, compile);
  returns the call that is timed, which gives an `Answer`
- `AGREES`: the error below which its best answer must come; what is known of a floor is
  in the module's text
"""

import importlib
import importlib.util
from types import ModuleType

from benchmarks.scenes import CASES, Answer

MODULES = (
    "scipy_ivp",
    "sundae_cvode",
    "casadi_events",
    "pathsim_blocks",
    "diffrax_smooth",
    "heyoka_taylor",
    "pydiffsol_text",
)


def available() -> tuple[list[ModuleType], list[str]]:
    """The peers that are installed, and a line for each that is not."""
    found = []
    missing = []
    for name in MODULES:
        module = importlib.import_module(f"benchmarks.peers.{name}")
        lacking = [
            package
            for package in module.PACKAGES
            if importlib.util.find_spec(package) is None
        ]
        if lacking:
            missing.append(
                f"{module.NAME}: {', '.join(lacking)} not installed: pip install {module.PIP}"
            )
        else:
            found.append(module)
    return found, missing


def solve(peer: ModuleType, scene: str, method: str, tolerance: float) -> Answer:
    """One run of a scene with a method of a peer."""
    return peer.prepare(CASES[scene], method, tolerance)()
