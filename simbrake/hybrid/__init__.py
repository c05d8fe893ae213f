"""Integration of hybrid systems with exact events and derivatives through them, for any equations.

`hybridsolve` integrates an `AbstractHybridSystem` with the Runge–Kutta tableaus of diffrax, or Rodas5P for stiff
systems, in one flat loop over step attempts.
"""

from ._arrays import largest as largest
from ._arrays import smallest as smallest
from ._bordered import CORE as CORE
from ._bordered import LINEAR as LINEAR
from ._bordered import QUADRATURE as QUADRATURE
from ._method import AbstractMethod as AbstractMethod
from ._method import ExplicitRungeKutta as ExplicitRungeKutta
from ._rosenbrock import Rodas5P as Rodas5P
from ._solve import EventKind as EventKind
from ._solve import HybridEvent as HybridEvent
from ._solve import Record as Record
from ._solve import beginning as beginning
from ._solve import concatenate as concatenate
from ._solve import hybridsolve as hybridsolve
from ._solve import solve_segment as solve_segment
from ._system import ADVANCED as ADVANCED
from ._system import FINISHED as FINISHED
from ._system import INSTANT as INSTANT
from ._system import LANDED as LANDED
from ._system import SKIPPED as SKIPPED
from ._system import STOPPED as STOPPED
from ._system import SYSTEM_CODES as SYSTEM_CODES
from ._system import AbstractHybridSystem as AbstractHybridSystem
from ._system import AbstractSemiExplicitSystem as AbstractSemiExplicitSystem
from ._system import Code as Code
from ._system import Instant as Instant
from ._system import Rows as Rows
from ._system import Settings as Settings

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
