"""Event log, metrics and summary of a run, from one scan of all its steps."""

import functools
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import jax
import numpy as np

from .._base._table import JsonObject, Table, plain
from ..outputs._wants import holding_rows
from ..outputs.duty import (
    Stop,
    duty_of,
    end_of,
    rows_of,
    speed_is_led,
    stop_table,
    stops_of,
)
from ..outputs.energies import energies
from ..outputs.extremes import Maxima, maxima
from ..outputs.judgement import Judgement, held_throughout, judge
from ..outputs.log import (
    Event,
    ModeSpan,
    Status,
    event_log,
    labels_of,
    segments_of,
    with_phases,
)
from ..outputs.metrics import HOLDING, METRICS, Peak, event_of, marks_of, metrics_of
from ..outputs.programs import RunJit, record_of
from ..outputs.scan import Scan, ScanColumns
from ..outputs.stability import shortage
from ..outputs.stages import Stage, absent_stages, stages_of
from ..phases import Ended, Phases
from ..physics.heated import sensed
from ..physics.mechanism import BandMode, Mode, turned_since_rest
from .choice import stiffness
from .mesh import ThickLayers, thick_layers

#: how far a zero of the run usually is from that of the polynomial through the samples
#: (share of the step)
_NEAR = 1e-3
#: in units of maximum speed × tolerance of the run: a speed up to `_STILL` is rounding,
#: up to `_SLOW` it may be an error of the run
_STILL = 1e-2
_SLOW = 1e2
#: torques that differ by less than this share of a typical one balance each other
_ROUNDING = 1e-9


@functools.cache
def _powers(count: int) -> np.ndarray:
    """Matrix from samples at even places 0…1 to the coefficients of the polynomial
    through them, constant first."""
    return np.linalg.inv(np.vander(np.linspace(0.0, 1.0, count), increasing=True))


def rising_roots(
    function: Callable[[np.ndarray, np.ndarray], np.ndarray],
    low: np.ndarray,
    high: np.ndarray,
) -> np.ndarray:
    """Places (k,) where k functions rise through 0, each between its `low` and `high`
    (Illinois method); NaN where it does not.

    `function(some, x)` evaluates the functions numbered `some` at `x`, each only until
    its zero is found. (SciPy's elementwise solvers do the same, but their import takes
    half a second.)
    """
    low = low.copy()
    high = high.copy()
    some = np.arange(len(low))
    f_low, f_high = np.split(function(np.tile(some, 2), np.concatenate([low, high])), 2)
    bracketed = (f_low <= 0) & (f_high > 0)
    side = np.zeros(len(low), int)
    some = some[bracketed]
    for _ in range(60):
        if not some.size:
            break
        a = low[some]
        b = high[some]
        f_a = f_low[some]
        f_b = f_high[some]
        x = a - f_a * (b - a) / (f_b - f_a)
        f = function(some, x)
        above = f > 0
        exact = np.abs(f) <= 1e-15
        f_low[some] = np.where(above, np.where(side[some] == 1, 0.5 * f_a, f_a), f)
        f_high[some] = np.where(above, f, np.where(side[some] == -1, 0.5 * f_b, f_b))
        side[some] = np.where(above, 1, -1)
        low[some] = np.where(~above | exact, x, a)
        high[some] = np.where(above | exact, x, b)
        some = some[
            high[some] - low[some] > 1e-15 * np.maximum(np.abs(high[some]), 1e-300)
        ]
    return np.where(bracketed, high, np.nan)


def events_of_linings(modes: Mode, t: Sequence[float] | np.ndarray) -> list[Event]:
    """Single linings that start to slip, stick, or leave the rim (one that reverses its
    slip does neither).

    - `modes`: columns of the modes that begin at the times `t` (s)
    """
    events = []
    columns = [
        (name, column, ("slip", "stick")) for name, column in modes.contacts.items()
    ]
    if modes.lifted is not None:
        columns.append(("lining", modes.lifted, ("lift_off", "touchdown")))
    for name, column, verbs in columns:
        touches = np.asarray(column) == 0
        for i, lining in np.argwhere(touches[1:] != touches[:-1]):
            verb = verbs[int(touches[i + 1, lining])]
            events.append(Event(float(t[i + 1]), f"{name}_{verb}", int(lining) + 1))
    return events


def friction_changes(modes: Mode, t: Sequence[float] | np.ndarray) -> list[Event]:
    """Begins of changes of friction that wait for a temperature or a stop; `modes` and
    `t` as in `events_of_linings`."""
    if modes.onset is None:
        return []
    begun = np.asarray(modes.onset.begun, np.int32)
    begins = np.argwhere(np.diff(begun, axis=0))
    return [Event(float(t[i + 1]), "friction_change") for i, _ in begins]


@functools.partial(RunJit, quick=True)
def _sensed(system: Any, heat: Any) -> Any:
    return sensed(system, heat)


class Report:
    """Event log, metrics and summary of a concrete result, each computed when it is
    first needed."""

    def __init__(self, result: Any) -> None:
        self.result = result
        self._record = record_of(result)

    @functools.cached_property
    def scan(self) -> Scan:
        """Samples in all steps of the run."""
        return Scan(self._record, float(self.result.rtol), tuple(self._limits))

    @functools.cached_property
    def _limits(self) -> dict[str, float]:
        """Limits of the quantities with marks, see `marks_of`."""
        return marks_of(self._record.system, self.result.scene)  # pyright: ignore

    @functools.cached_property
    def _energies(self) -> JsonObject:
        return energies(self._record)

    @functools.cached_property
    def _maxima(self) -> Maxima:
        """Maximum values over the run, and from each restart to the next."""
        return self.maxima_between([(stop.start, stop.end) for stop in self._stop_rows])

    def maxima_between(self, spans: Sequence[tuple[int, int]]) -> Maxima:
        """Maximum values over the run, and between pairs of rows that do not
        overlap."""
        scene = self.result.scene
        names = tuple(metrics_of(scene, greatest=True))
        return maxima(self._record, scene, names, spans)

    @property
    def peaks(self) -> dict[str, Peak]:
        """Maximum values over the run by their names."""
        return self._maxima.whole

    @functools.cached_property
    def holding(self) -> Peak | None:
        """Minimum holding reserve while the brake is to hold; `None` where no load is
        held."""
        reserve = self.peaks.get(HOLDING)
        return reserve if reserve is not None and np.isfinite(reserve.value) else None

    @property
    def held_nothing(self) -> bool:
        """Whether the brake was to hold, and no load hung while it was."""
        to_hold = holding_rows(self._record).to_hold
        return self.holding is None and bool(to_hold.any())

    @functools.cached_property
    def judgement(self) -> Judgement:
        """Whether the brake did what it was to do. Its reserve at rest is the minimum
        over the times at which it was to hold."""
        least = np.inf if self.holding is None else float(self.holding.value)
        found = held_throughout(judge(self._record), least)
        return Judgement(*(np.asarray(number).item() for number in found))

    @property
    def by_worst_angle(self) -> bool:
        """Whether the reserve is that at another angle, where the load is heavier than
        where it is held."""
        if not self.result.scene.duty.load.by_angle:
            return False
        held = np.inf if self.holding is None else float(self.holding.value)
        return self.judgement.reserve < held * (1 - _ROUNDING)

    @property
    def broke_away(self) -> tuple[float, float]:
        """When a held load broke away first (s), and the static capacity of the brake
        over the load then."""
        rows = np.flatnonzero(holding_rows(self._record).broken)
        t = float(np.asarray(self._record.rows.t)[rows[0]])
        at = int(np.flatnonzero(self.scan.row == rows[0])[0])
        load, capacity = (float(x[at]) for x in self.scan.columns.holding)
        return t, capacity / load if load > 0 else np.inf

    @property
    def phase_at_end(self) -> Ended | None:
        """The phase in force at the end, of a duty in phases."""
        lever: Any = self._record.system.lever  # pyright: ignore
        phase = int(self._record.mode_end.phase)
        return lever.ended(phase) if isinstance(lever, Phases) else None

    @property
    def pull(self) -> JsonObject | None:
        """Tension of a lever that holds the speed: its `limit`, the largest `value` in
        the run (N), and the `time` of that (s)."""
        if not speed_is_led(self.result.scene.duty.lever):
            return None
        columns = self.scan.columns
        i = int(np.argmax(columns.lever_tension))
        limit = self._record.system.lever.greatest()  # pyright: ignore
        return {
            "limit": float(limit),
            "value": float(columns.lever_tension[i]),
            "time": float(columns.t[i]),
        }

    @functools.cached_property
    def events(self) -> list[Event]:
        """The event log."""
        record = self._record
        samples = self.scan.samples
        n = int(record.count)
        t = np.asarray(record.rows.t)
        first, last = segments_of(record)
        labels = labels_of(record, last)
        places = (first * samples).tolist(), ((last + 1) * samples - 1).tolist()
        times = (t[first].tolist(), t[last + 1].tolist())
        turned = self.turned
        columns = zip(labels, *places, *times, turned[first].tolist(), strict=True)
        spans = [ModeSpan(*column) for column in columns]
        start, end = labels_of(record, np.asarray([0, n]))
        if n and end != labels[-1]:  # an event at the very end
            at = n * samples - 1
            time = float(t[n])
            spans.append(ModeSpan(end, at, at, time, time, bool(turned[n])))
        first_mode = spans[0] if spans else None
        if (
            first_mode is not None
            and first_mode.label.band == BandMode.OPEN
            and first_mode.end == first_mode.start
        ):
            del spans[0]  # the first mode settles at once
        margins = np.asarray(self.scan.columns.margins)
        locate = functools.partial(self._locate, lambda columns: columns.margins)
        events = event_log(spans, margins, locate, margins.shape[1] // 2, start)
        known = {event.time for event in events if event.name in ("stop", "reversal")}
        marked = [event for event in self._reversals() if event.time not in known]
        events = [
            event
            for event in [*marked, *events]
            if event.name != "reversal" or not self._is_of_stop(event.time, events)
        ]
        events += [
            *self._marks(),
            *events_of_linings(record.modes, t),
            *self._locking(),
        ]
        ends = [*self._phase_ends(), *friction_changes(record.modes, t)]
        return with_phases(sorted(events, key=lambda event: event.time), ends)

    @functools.cached_property
    def turned(self) -> np.ndarray:
        """Whether the pulley has turned since it last was at rest, in every row; False
        where it cannot rest in an open band."""
        if not self._record.system.rests_open:  # pyright: ignore
            return np.zeros(int(self._record.count) + 1, bool)
        labels = labels_of(self._record)
        phi = np.asarray(self._record.states.phi)[: len(labels)].tolist()
        return np.asarray(turned_since_rest(labels, phi))

    def _phase_ends(self) -> list[Event]:
        """Ends of the phases of the duty."""
        lever = self._record.system.lever  # pyright: ignore
        t = np.asarray(self._record.rows.t)
        if not isinstance(lever, Phases):
            return []
        passed = np.asarray(self._record.modes.phase)
        ends = np.flatnonzero(np.diff(passed))
        return [
            Event(float(t[i + 1]), "phase_end", phase=lever.ended(int(passed[i])))
            for i in ends
        ]

    @functools.cached_property
    def _stop_rows(self) -> list[Stop]:
        return rows_of(labels_of(self._record), self.turned)

    @functools.cached_property
    def _stops(self) -> list[JsonObject]:
        maxima = self._maxima.between
        return stops_of(self._record, self.result.scene, self._stop_rows, maxima)

    @property
    def stops(self) -> Table:
        """The stops of the run, in the system of units in force."""
        return stop_table(self._stops, self.result.scene)

    def _marks(self) -> list[Event]:
        """Events of quantities that pass their limits."""
        events: list[Event] = []
        row = self.scan.row
        for name, limit in self._limits.items():

            def excess(
                columns: ScanColumns, name: str = name, limit: float = limit
            ) -> Any:
                return (columns.marked[name] - limit) / max(abs(limit), 1.0)

            values = excess(self.scan.columns)
            # (a jump between two steps is no crossing)
            rises = (
                (values[:-1] <= 0) & (values[1:] > 0) & (row[:-1] == row[1:])[:, None]
            )
            crossings = [(int(i), int(j)) for i, j in np.argwhere(rises)]
            times = self._locate(excess, crossings) if crossings else []
            each = values.shape[1] > 1
            events += [
                Event(float(t), event_of(name), j + 1 if each else None)
                for t, (_, j) in zip(times, crossings, strict=True)
            ]
        return events

    def _is_of_stop(self, time: float, events: list[Event]) -> bool:
        """Whether a reversal at this time is an error of the run alone, as the pulley
        comes to rest."""
        stops = [
            event.time
            for event in events
            if event.name == "stop" and event.time >= time
        ]
        if not stops:
            return False
        t = self.scan.columns.t
        speed = np.abs(self.scan.columns.omega)
        slight = _SLOW * float(self.result.rtol) * np.max(speed)
        return bool(np.all(speed[(t >= time) & (t <= min(stops))] <= slight))

    def _reversals(self) -> list[Event]:
        """Instants at which the speed of the pulley changes its sign without a rest."""
        row = self.scan.row
        omega = self.scan.columns.omega
        t = self.scan.columns.t
        slight = _STILL * float(self.result.rtol) * np.max(np.abs(omega), initial=0.0)
        way = np.where(np.abs(omega) > slight, np.sign(omega), 0.0)
        moves = np.flatnonzero(way)
        flips = np.flatnonzero(way[moves[:-1]] != way[moves[1:]])
        if not flips.size:
            return []
        rests = np.asarray(self._record.modes.rests)
        before = moves[flips]
        after = moves[flips + 1]
        passes = (
            (t[after - 1] <= t[np.minimum(before + 1, after)])
            & ~rests[row[before]]
            & ~rests[row[after]]
        )
        before = before[passes]
        after = after[passes]
        times = t[before + 1]
        inside = np.flatnonzero((after == before + 1) & (row[before] == row[after]))
        if inside.size:

            def speeds(columns: ScanColumns) -> np.ndarray:
                return np.stack([columns.omega, -columns.omega], axis=1)

            upwards = way[after[inside]] > 0
            times[inside] = self._locate(
                speeds, [*zip(before[inside], np.where(upwards, 0, 1), strict=True)]
            )
        return [Event(float(time), "reversal") for time in times]

    def _locking(self) -> list[Event]:
        """Linings that come to lock themselves."""
        locks = self._record.modes.locks
        if locks is None:
            return []
        t = np.asarray(self._record.rows.t)
        begins = np.flatnonzero(np.diff(np.asarray(locks, np.int32)) > 0)
        return [Event(float(t[i + 1]), "self_locking") for i in begins]

    def _locate(
        self, margins_of: Callable[[ScanColumns], Any], crossings: list[tuple[int, int]]
    ) -> np.ndarray:
        """Times at which margins rise through zero: for each crossing `(i, j)` that of
        margin `j` between the samples `i` and `i + 1`."""
        scan = self.scan
        sample, mark = np.asarray(crossings, int).T
        row = scan.row[sample]
        steps = scan.steps
        margins = margins_of(scan.columns)

        def margin(some: np.ndarray, share: np.ndarray) -> np.ndarray:
            exact = margins_of(scan.look(row[some], share))
            return exact[np.arange(len(some)), mark[some]]

        # a first guess: the zero of the polynomial through all samples of the step,
        # between those numbered `place` and `place + 1`
        place = sample % scan.samples
        last = scan.samples - 1
        values = margins[
            (sample - place)[:, None] + np.arange(scan.samples), mark[:, None]
        ]
        terms = values @ _powers(scan.samples).T

        def polynomial(some: np.ndarray, x: np.ndarray) -> np.ndarray:
            return np.sum(terms[some] * x[:, None] ** np.arange(scan.samples), axis=1)

        near = rising_roots(polynomial, place / last, (place + 1) / last)
        share = np.where(np.isnan(near), (place + 0.5) / last, near)
        # the zero of the run itself, ever further from the guess
        left = np.arange(len(near))
        for reach in (_NEAR, 1.0 / last, 1.0):
            low = np.maximum(share[left] - reach, 0.0)
            high = np.minimum(share[left] + reach, 1.0)
            exact = rising_roots(
                lambda some, x, left=left: margin(left[some], x), low, high
            )
            located = ~np.isnan(exact)
            share[left[located]] = exact[located]
            left = left[~located]
            if not left.size:
                break
        return np.asarray(steps.t0[row] + share * (steps.t1[row] - steps.t0[row]))

    @functools.cached_property
    def metrics(self) -> dict[str, float | None]:
        """Metrics of the run by name, times of the peak temperatures, and heats."""
        energy = self._energies
        scene = self.result.scene
        metrics = metrics_of(scene, greatest=False)
        values = {
            name: metric.find(self._record, scene) for name, metric in metrics.items()
        }
        values |= {name: peak.value for name, peak in self.peaks.items()}
        values |= {
            f"{name}_time": peak.time
            for name, peak in self.peaks.items()
            if name.startswith("peak_")
        }
        bodies = ("to_metal", "to_linings", "to_band", "lost", "to_coolant")
        heats = [f"heat_{body}" for body in bodies]
        values |= {name: energy[name] for name in heats if name in energy}
        return plain({name: float(value) for name, value in values.items()})

    @property
    def stages(self) -> list[Stage]:
        """Stages of a staged brake in order."""
        return stages_of(self._record, labels_of(self._record))

    def _staged(self) -> JsonObject:
        """The stages of a staged brake, and why one is missing."""
        brake = self.result.scene.brake
        if not brake.in_series:
            return {}
        stages = self.stages
        system = self.result.record.system
        columns = self.scan.columns
        at_start = jax.tree.map(lambda column: column[0], self._record.states.heat)
        absent = absent_stages(
            brake,
            float(system.inertia),
            float(columns.load_torque[0]),
            {stage.name for stage in stages},
            float(np.max(columns.lever_tension)),
            _sensed(system, at_start),
        )
        return {
            "stages": [stage.as_dict() for stage in stages],
            "absent_stages": absent,
        }

    @property
    def _held(self) -> JsonObject | None:
        """Torques of the load and of the brake at the minimum holding reserve."""
        least = self.metrics.get(HOLDING)
        if least is None:
            return None
        columns = self.scan.columns
        load = np.interp(self.peaks[HOLDING].time, columns.t, columns.load_torque)
        return {"load_torque": abs(load), "capacity": least * abs(load)}

    @functools.cached_property
    def shortage(self) -> Mapping[str, float] | None:
        """Torque of the sliding brake and load when the load exceeded it most; `None`
        for a runaway, whose status tells it."""
        return None if self.result.status == Status.RUNAWAY else shortage(self.scan)

    @functools.cached_property
    def thick_layers(self) -> list[ThickLayers]:
        """Heated walls whose layers are too thick for the heating."""
        return list(thick_layers(self.result.scene, self.scan, self.peaks))

    @functools.cached_property
    def summary(self) -> JsonObject:
        """Numbers of a run, as `Result.summary` gives them with its words."""
        r = self.result
        scene = r.scene
        stats = r.record.stats
        widths = self._maxima.widths
        at: JsonObject = {
            f"{name}_time": peak.time for name, peak in self.peaks.items()
        }
        for name, peak in self.peaks.items():
            # (where all linings are one body the run does not tell which it was)
            if METRICS[name].of_linings and widths[name] == scene.brake.linings.count:
                at[f"{name}_lining"] = peak.lining
        capacity = None
        if r.status in (Status.NOT_STOPPED, Status.RUNAWAY):
            end = r.end_capacity
            capacity = {
                "load_torque": end.hanging,
                "brake_torque": end.torque,
                "pairs": end.pairs,
            }
        words = scene.brake.words
        parts = {"brake": words.brake, "lining": words.lining, "body": words.body}
        counts = ("rejected", "retaken", "events", "segments")
        solver = {
            "method": r.method_name,
            "reason": stiffness(scene)[1],
            "rtol": r.rtol,
            "steps": stats.accepted,
            **{name: getattr(stats, name) for name in counts},
        }
        optional = {
            "pull": self.pull,
            "holding": self._held,
            "stops": self._stops if len(self._stops) > 1 else None,
            **self._staged(),
            **({} if scene.brake.banded else parts),
            "rims": None if scene.brake.rims == 1 else scene.brake.rims,
            "worn_thickness": None if scene.wear is None else r.worn_thickness,
        }
        summary = {
            "status": r.status,
            "duty": duty_of(scene, r.status, len(self._stops)),
            "capacity": capacity,
            "events": [event.as_dict() for event in self.events],
            "end": end_of(self._record, scene),
            "metrics": self.metrics,
            "at": at,
            **{name: x for name, x in optional.items() if x is not None},
            "distribution": r.record.system.mechanism.distribution,
            "energy": self._energies,
            "solver": solver,
        }
        return plain(summary)
