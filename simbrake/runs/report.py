"""Event log, metrics and summary of a run, from one scan of all its steps, and as
text."""

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

#: from the place in a step where the samples have a zero that of the run is at most
#: this far (share of the step)
_NEAR = 1e-3
#: a speed below this share of the maximum and of the run's tolerance is rounding
_STILL = 1e-2
#: one below this share may be an error of the run
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
    """Places (k,) where many functions rise through 0, each between `low` and `high`
    (Illinois); NaN where none does.

    `function(some, x)` evaluates those numbered `some` at `x`; each only until its own
    zero is found. (SciPy's elementwise solvers do the same, and take half a second to
    import before the first answer.)
    """
    low, high, some = low.copy(), high.copy(), np.arange(len(low))
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
    for name, column, whats in columns:
        sticks = np.asarray(column) == 0
        for i, lining in np.argwhere(sticks[1:] != sticks[:-1]):
            what = whats[int(sticks[i + 1, lining])]
            events.append(Event(float(t[i + 1]), f"{name}_{what}", int(lining) + 1))
    return events


def friction_changes(modes: Mode, t: Sequence[float] | np.ndarray) -> list[Event]:
    """Begins of the changes of friction that begin when something happens, of modes as
    in `events_of_linings`."""
    onset = modes.onset
    begins = (
        []
        if onset is None
        else np.argwhere(np.diff(np.asarray(onset.begun, np.int32), axis=0))
    )
    return [Event(float(t[i + 1]), "friction_change") for i, _ in begins]


@functools.partial(RunJit, quick=True)
def _sensed(system: Any, heat: Any) -> Any:
    return sensed(system, heat)


class Report:
    """Event log, metrics and summary of one concrete result, from one scan when they
    are first needed."""

    def __init__(self, result: Any) -> None:
        self.result = result
        self._record = record_of(result)

    @functools.cached_property
    def scan(self) -> Scan:
        """The run as it was scanned."""
        return Scan(self._record, float(self.result.rtol), tuple(self._limits))

    @functools.cached_property
    def _limits(self) -> dict[str, float]:
        """Limits of the quantities that have marks."""
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

    @functools.cached_property
    def judgement(self) -> Judgement:
        """Whether the brake did what it was to do. At rest the reserve is the minimum
        while it was to hold."""
        least = np.inf if self.holding is None else float(self.holding.value)
        found = held_throughout(judge(self._record), least)
        return Judgement(*(np.asarray(number).item() for number in found))

    @property
    def by_worst_angle(self) -> bool:
        """Whether the reserve is that of another angle than the one at which the load
        is held."""
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
        columns = self.scan.columns
        at = int(np.flatnonzero(self.scan.row == rows[0])[0])
        load, capacity = (float(np.asarray(x)[at]) for x in columns.holding)
        return t, capacity / load if load > 0 else np.inf

    @property
    def phase_at_end(self) -> Ended | None:
        """The phase in force at the end, of a duty in phases."""
        lever: Any = self._record.system.lever  # pyright: ignore
        phase = int(self._record.mode_end.phase)
        return lever.ended(phase) if isinstance(lever, Phases) else None

    @property
    def pull(self) -> JsonObject | None:
        """Of a lever that holds the speed: `limit` of its tension, the largest `value`
        in the run (N), and its `time` (s)."""
        if not speed_is_led(self.result.scene.duty.lever):
            return None
        columns = self.scan.columns
        i = int(np.argmax(columns.lever_tension))
        limit = self._record.system.lever.greatest()  # pyright: ignore
        numbers = (limit, columns.lever_tension[i], columns.t[i])
        return dict(zip(("limit", "value", "time"), map(float, numbers), strict=True))

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
        spans = zip(labels, *places, *times, turned[first].tolist(), strict=True)
        phases = [ModeSpan(*span) for span in spans]
        start, *_, end = labels_of(record, np.asarray([0, n]))
        if n and end != labels[-1]:  # an event at the very end
            phases.append(
                ModeSpan(
                    end,
                    n * samples - 1,
                    n * samples - 1,
                    float(t[n]),
                    float(t[n]),
                    bool(turned[n]),
                )
            )
        if (
            phases
            and phases[0].label.band == BandMode.OPEN
            and phases[0].end == phases[0].start
        ):
            phases = phases[1:]  # the settling of the first mode
        margins = np.asarray(self.scan.columns.margins)
        locate = functools.partial(self._locate, lambda columns: columns.margins)
        events = event_log(phases, margins, locate, margins.shape[1] // 2, start)
        known = {event.time for event in events if event.name in ("stop", "reversal")}
        events = [
            *(event for event in self._reversals() if event.time not in known),
            *events,
        ]
        events = [
            event
            for event in events
            if event.name != "reversal" or not self._is_of_stop(event.time, events)
        ]
        events += [
            *self._marks(),
            *events_of_linings(record.modes, t),
            *self._locking(),
        ]
        inside = [*self._phase_ends(), *friction_changes(record.modes, t)]
        return with_phases(sorted(events, key=lambda event: event.time), inside)

    @functools.cached_property
    def turned(self) -> np.ndarray:
        """Whether the pulley has turned since it last was at rest, in every row, where
        it may rest in an open band."""
        if not self._record.system.rests_open:  # pyright: ignore
            return np.zeros(int(self._record.count) + 1, bool)
        labels = labels_of(self._record)
        return np.asarray(
            turned_since_rest(
                labels, np.asarray(self._record.states.phi)[: len(labels)].tolist()
            )
        )

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
        for name, limit in self._limits.items():

            def excess(
                columns: ScanColumns, name: str = name, limit: float = limit
            ) -> np.ndarray:
                return (np.asarray(columns.marked[name]) - limit) / max(
                    abs(limit), 1.0
                )

            values = excess(self.scan.columns)
            row = np.asarray(self.scan.row)
            # (a jump between two steps belongs to no crossing)
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
        """Whether the pulley turns round by the errors of the run alone, as it comes to
        rest."""
        stops = [
            event.time
            for event in events
            if event.name == "stop" and event.time >= time
        ]
        if not stops:
            return False
        t = np.asarray(self.scan.columns.t)
        speed = np.abs(np.asarray(self.scan.columns.omega))
        slight = _SLOW * float(self.result.rtol) * np.max(speed)
        return bool(np.all(speed[(t >= time) & (t <= min(stops))] <= slight))

    def _reversals(self) -> list[Event]:
        """Instants at which the speed of the pulley changes its sign without a rest."""
        seen = self.scan.columns
        row = np.asarray(self.scan.row)
        omega = np.asarray(seen.omega)
        t = np.asarray(seen.t)
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
                return np.stack([columns.omega, -np.asarray(columns.omega)], axis=1)

            upwards = way[after[inside]] > 0
            times[inside] = self._locate(
                speeds, [*zip(before[inside], np.where(upwards, 0, 1), strict=True)]
            )
        return [Event(float(time), "reversal") for time in times]

    def _locking(self) -> list[Event]:
        """Linings that come to lock themselves."""
        locks = self._record.modes.locks
        t = np.asarray(self._record.rows.t)
        began = (
            []
            if locks is None
            else np.flatnonzero(np.diff(np.asarray(locks, np.int32)) > 0)
        )
        return [Event(float(t[i + 1]), "self_locking") for i in began]

    def _locate(
        self, margins_of: Callable[[ScanColumns], Any], crossings: list[tuple[int, int]]
    ) -> np.ndarray:
        """Times at which margins rise through zero."""
        scan = self.scan
        sample, mark = np.asarray(crossings, int).T
        row = scan.row[sample]
        steps = scan.steps
        margins = margins_of(scan.columns)

        def margin(some: np.ndarray, share: np.ndarray) -> np.ndarray:
            looked = margins_of(scan.look(row[some], share))
            return looked[np.arange(len(some)), mark[some]]

        # the zero of the polynomial through all samples of the step, between those
        # numbered `place` and `place + 1`
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
        left = np.arange(len(near))
        for reach in (
            _NEAR,
            1.0 / last,
            1.0,
        ):  # the run itself may have it a little aside
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
        energy = self._energies
        scene = self.result.scene
        metrics = metrics_of(scene, greatest=False)
        values = {
            name: metric.find(self._record, scene) for name, metric in metrics.items()
        }
        values |= {name: peak.value for name, peak in self.peaks.items()}
        hot = {
            f"{name}_time": p.time
            for name, p in self.peaks.items()
            if name.startswith("peak_")
        }
        heats = (
            "heat_to_metal",
            "heat_to_linings",
            "heat_to_band",
            "heat_lost",
            "heat_to_coolant",
        )
        values = {
            **values,
            **hot,
            **{name: energy[name] for name in heats if name in energy},
        }
        return plain({name: float(value) for name, value in values.items()})

    @property
    def stages(self) -> list[Stage]:
        """Stages of a staged brake in order."""
        return stages_of(self._record, labels_of(self._record))

    def _staged(self) -> JsonObject:
        """The stages of a staged brake, and why one is missing."""
        scene = self.result.scene
        if not scene.brake.in_series:
            return {}
        stages = self.stages
        system = self.result.record.system
        greatest = np.max(self.scan.columns.lever_tension)
        load = self.scan.columns.load_torque[0]
        hot = _sensed(
            system, jax.tree.map(lambda column: column[0], self._record.states.heat)
        )
        stage_names = {stage.name for stage in stages}
        absent = absent_stages(
            scene.brake,
            float(system.inertia),
            float(load),
            stage_names,
            float(greatest),
            hot,
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
        seen = self.scan.columns
        load = np.interp(self.peaks[HOLDING].time, seen.t, seen.load_torque)
        return {"load_torque": abs(load), "capacity": least * abs(load)}

    @functools.cached_property
    def shortage(self) -> Mapping[str, float] | None:
        """Torque of the sliding brake and load where the load exceeded it most, in a
        run that does not end so."""
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
            # not of all linings as one body
            if METRICS[name].of_linings and widths[name] == scene.brake.linings.count:
                at[f"{name}_lining"] = peak.lining
        capacity = None
        if r.status in (Status.NOT_STOPPED, Status.RUNAWAY):
            # (a lining that locks itself holds any load)
            end = r.end_capacity
            capacity = {"load_torque": end.hanging, "brake_torque": end.torque}
            capacity["pairs"] = end.pairs
        words = scene.brake.words
        parts = {"brake": words.brake, "lining": words.lining, "body": words.body}
        several = len(self._stops) > 1
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
            "stops": self._stops if several else None,
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
