"""Public names of runs and results that are defined in the packages of the run."""

from .._base._table import display_units
from .._outputs._duty import DutyKind
from .._outputs._log import EVENTS, FAILURES, Event, Events, SimulationError, Stage, Status, internal_slip_tension
from .._outputs._metrics import METRICS, Mark, Metric, metric_names
from .._outputs._probe import integral
from .._outputs._quantities import PAIR_COLUMNS, SERIES_COLUMNS, PairSeries, Series
from .._physics._mechanism import BandMode
from .._run._accuracy import Accuracy, ErrorEstimate, accuracy
from .._run._linings import (
    Overlap,
    RingWear,
    RunningIn,
    friction_work,
    geometric_overlap,
    lining_mean,
    lining_peak,
    lining_wear,
    overlap,
    ring_wear,
)
from .._run._measure import Judged, LimitCheck, limit_checks
from .._run._networks import (
    CyclicState,
    HeatResult,
    cyclic_steady_state,
    simulate_heat,
    steady_state,
    with_temperatures,
)
from .._run._result import Result
from .._run._simulate import Prepared, PreparedAccuracy, PreparedResult, prepare
from .._run._verdict import Verdict, VerdictRow, verdict
