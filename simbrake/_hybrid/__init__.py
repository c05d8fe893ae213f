"""Event-driven integration of hybrid systems on the methods of diffrax: one flat loop over step attempts."""

from ._bordered import CORE as CORE
from ._bordered import LINEAR as LINEAR
from ._bordered import QUADRATURE as QUADRATURE
from ._method import AbstractMethod as AbstractMethod
from ._method import ExplicitRungeKutta as ExplicitRungeKutta
from ._packing import ADVANCED as ADVANCED
from ._packing import FINISHED as FINISHED
from ._packing import INSTANT as INSTANT
from ._packing import LANDED as LANDED
from ._packing import SKIPPED as SKIPPED
from ._packing import STOPPED as STOPPED
from ._packing import Rows as Rows
from ._places import largest as largest
from ._places import smallest as smallest
from ._rosenbrock import Rodas5P as Rodas5P
from ._solve import Record as Record
from ._solve import hybridsolve as hybridsolve
from ._stretches import beginning as beginning
from ._stretches import joined as joined
from ._stretches import stretch as stretch
from ._system import SYSTEM_CODES as SYSTEM_CODES
from ._system import AbstractHybridSystem as AbstractHybridSystem
from ._system import AbstractSemiExplicitSystem as AbstractSemiExplicitSystem
from ._system import Code as Code
from ._system import Instant as Instant
from ._system import Settings as Settings
