"""Public names of runs and results that are defined in the packages of the run."""

from .._base._numbers import display_units
from ..outputs.duty import DutyKind
from ..outputs.log import EVENTS, FAILURES, Event, Events, SimulationError, Status
from ..outputs.metrics import METRICS, Mark, Metric, metric_names
from ..outputs.probe import integral
from ..outputs.quantities import PAIR_COLUMNS, SERIES_COLUMNS, PairSeries, Series
from ..outputs.stages import Stage, internal_slip_tension
from ..physics.mechanism import BandMode
from ..runs.accuracy import Accuracy, ErrorEstimate, accuracy
from ..runs.findings import Finding
from ..runs.linings import (
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
from ..runs.measure import LimitCheck, LimitCoverage, VerdictRow, limit_checks
from ..runs.networks import (
    CyclicState,
    HeatResult,
    cyclic_steady_state,
    simulate_heat,
    steady_state,
    with_temperatures,
)
from ..runs.prepared import Prepared, PreparedAccuracy, PreparedResult, prepare
from ..runs.result import Result
from ..runs.verdict import Verdict, verdict
