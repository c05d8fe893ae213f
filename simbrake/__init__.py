"""simbrake: a differentiable dynamic simulator of band-shoe brakes of drilling
drawworks.

    brake = sb.Brake(sb.Pulley("590 mm", 1200), sb.Band("623 mm"),
    sb.uniform_linings(20, "270 deg", 0.35)) scene = sb.Scene(brake, sb.Duty("24 kN",
    sb.HookLoad("60 t", "400 mm", 8)), sb.Initial(24), "5 s") result =
    sb.simulate(scene)
    print(result)                                  # the summary, the verdict first
    print(sb.studies.explain(result))              # what happened and why
    result["stopping_time"], result.events["stop"], result.series([0.0, 0.5]),
    result.plot()

- a scene: `Scene` of a `Brake`, `DiscBrake` or `ShoeBrake`, a `Duty` or `ForceDuty`,
  and `Initial`; `read_scene`
- parts: `friction`, `loads`, `profiles`, `thermal`, `wear`, `brakes`
- runs: `simulate`, `prepare`, `Result`; `results`, `report`, `compare`, `plot`,
  `dataset`, `save`, `read_result`
- studies: `sensitivity`, `ensemble`, `sweep`, `uncertainty`, `calibrate`,
  `lining_life`; `studies`, `layouts`
- recordings of rigs: `rig`
- estimates and checks: `estimates`, `synthesize`, `compare_materials`; `formulas`,
  `checks`, `validate`
- the integrator: `hybrid`

Values are in SI, or texts with a unit. The names at the top are in `__init__.pyi`, each
with its module, which is imported at the first use of the name: a run does not load the
modules of the studies, estimates and pages.

Importing simbrake turns on the 64-bit mode of JAX, whichever is imported first: events
cannot be located in 32 bits. Only where the environment variable JAX_ENABLE_X64 is 0
does it stay off, and a run is an error.
"""

import contextlib
import gc
import importlib.util
from collections.abc import Iterator
from typing import Any

from ._base._arguments import public_names
from ._base._precision import use_64_bits
from ._base._retired import answers

_named, __dir__, __all__ = public_names(__name__, __file__)

__version__ = "0.1.0"

use_64_bits()


@contextlib.contextmanager
def _uncollected() -> Iterator[None]:
    """While modules are loaded, all of whose objects stay, the garbage collector would
    walk over all of JAX's again and again: a fifth of the time."""
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()


def _with_home(name: str) -> Any:
    """A name at the top; of another one the error says where it is."""
    try:
        with _uncollected():
            return _named(name)
    except AttributeError:
        if name.startswith("_"):
            raise
    packages = [
        _named(package)
        for package in __all__
        if importlib.util.find_spec(f"{__name__}.{package}")
    ]
    homes = [home.__name__ for home in packages if name in getattr(home, "__all__", ())]
    hint = (
        f": it is {' and '.join(f'{home}.{name}' for home in homes)}" if homes else ""
    )
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}{hint}")


_INDICES = "docs/recipes/global_indices.py computes them by SALib on simbrake.studies.evaluator"
__getattr__ = answers(
    __name__, gone={"sobol_indices": _INDICES, "morris": _INDICES}, others=_with_home
)
