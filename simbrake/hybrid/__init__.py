"""Integration of hybrid systems with exact events and derivatives through them, for any
equations.

`hybridsolve` integrates an `AbstractHybridSystem` with the Runge–Kutta tableaus of
diffrax, or Rodas5P for stiff systems, in one flat loop over step attempts.
"""

from ._bordered import CORE, LINEAR, QUADRATURE  # noqa: F401
from ._method import AbstractMethod, ExplicitRungeKutta
from ._rosenbrock import Rodas5P
from ._solve import (  # noqa: F401
    EventKind,
    Given,
    HybridEvent,
    Record,
    beginning,
    concatenate,
    hybridsolve,
    solve_segment,
)
from .arrays import largest, smallest  # noqa: F401
from .system import (  # noqa: F401
    ADVANCED,
    FINISHED,
    INSTANT,
    LANDED,
    SKIPPED,
    STOPPED,
    SYSTEM_CODES,
    AbstractHybridSystem,
    AbstractSemiExplicitSystem,
    Code,
    Instant,
    Rows,
    Settings,
)

#: names for users; others are internal
__all__ = [
    "AbstractHybridSystem",
    "AbstractMethod",
    "AbstractSemiExplicitSystem",
    "Code",
    "EventKind",
    "ExplicitRungeKutta",
    "HybridEvent",
    "Instant",
    "Record",
    "Rodas5P",
    "Settings",
    "hybridsolve",
]
