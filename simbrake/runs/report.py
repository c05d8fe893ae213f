"""Event log, metrics and summary of a run, from one scan of all its steps, and as
text."""

import functools
import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import jax
import numpy as np

from .._base._table import Table, in_rig_units, number, plain
from ..hybrid import FINISHED, Record
from ..hybrid.extremes import first_largest
from ..outputs._wants import holding_rows
from ..outputs.duty import (
    DutyKind,
    Stop,
    columns_of,
    counted,
    duty_lines,
    duty_of,
    end_of,
    rows_of,
    speed_is_led,
    stop_table,
    stops_of,
    words_of,
)
from ..outputs.extremes import Maxima
from ..outputs.judgement import Judgement, held_throughout, judge
from ..outputs.log import (
    Event,
    Phase,
    Stage,
    Status,
    absent_stages,
    event_log,
    stages_of,
    with_phases,
)
from ..outputs.metrics import (
    HOLDING,
    HOT,
    METRICS,
    RESIDUAL_SEES,
    Peak,
    energies,
    energy_balance,
    event_of,
    heat_balance,
    limits_exceeded,
    marks,
    marks_of,
    metrics_of,
)
from ..outputs.probe import Entry, RunJit, record_of
from ..outputs.scan import Scan, ScanColumns
from ..outputs.stability import shortage
from ..parts.scene import plausibility, warnings
from ..phases import Ended, Phases
from ..physics._brake import BrakeSystem
from ..physics.heated import sensed
from ..physics.mechanism import BandMode, Label, Mode, turned_since_rest
from .choice import stiffness
from .mesh import thick_layers

#: from the place in a step where the samples have a zero that of the run is at most
#: this far (share of the step)
_NEAR = 1e-3
#: a speed below this share of the maximum and of the run's tolerance is rounding
_STILL = 1e-2
#: one below this share may be an error of the run
_SLOW = 1e2
#: torques that differ by less than this share of a typical one balance each other
_ROUNDING = 1e-9


def labels_of(record: Record, rows: np.ndarray | None = None) -> list[Label]:
    """Modes as in the log, in rows of a concrete record, by default in all of them and
    at its end."""
    mode: Mode = record.modes
    rows = np.arange(int(record.count) + 1) if rows is None else rows
    columns = (np.asarray(column)[rows].tolist() for column in mode.label)
    return [Label(*pair) for pair in zip(*columns, strict=True)]


def segments_of(record: Record) -> tuple[np.ndarray, np.ndarray]:
    """First and last rows of a concrete record from one event or time breakpoint to the
    next."""
    n = int(record.count)
    kind = np.asarray(record.rows.kind)[:n]
    last = np.union1d(np.flatnonzero(kind >= FINISHED), [n - 1] if n else []).astype(
        int
    )
    return np.concatenate([[0], last[:-1] + 1]).astype(int)[: len(last)], last


@functools.cache
def _powers(count: int) -> np.ndarray:
    """Matrix from samples at even places 0…1 to the coefficients of the polynomial
    through them, constant first."""
    return np.linalg.inv(np.vander(np.linspace(0.0, 1.0, count), increasing=True))


def _rise(
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
    def _energies(self) -> Entry:
        return energies(self._record)

    @functools.cached_property
    def _maxima(self) -> Maxima:
        """Maximum values over the run, and from each restart to the next."""
        return self.maxima_between([(stop.start, stop.end) for stop in self._stop_rows])

    def maxima_between(self, spans: Sequence[tuple[int, int]]) -> Maxima:
        """Maximum values over the run, and between pairs of rows that do not
        overlap."""
        return Maxima(
            self._record, tuple(metrics_of(self.result.scene, greatest=True)), spans
        )

    @functools.cached_property
    def peaks(self) -> dict[str, Peak]:
        """Maximum values over the run by their names."""
        return {
            name: METRICS[name].of_peak(peak, self.result.scene)
            for name, peak in self._maxima.whole.items()
        }

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
    def broke_away(self) -> tuple[float, float]:
        """When a held load broke away first (s), and the static capacity of the brake
        over the load then."""
        rows = np.flatnonzero(holding_rows(self._record).broken)
        t = float(np.asarray(self._record.rows.t)[rows[0]])
        columns = self.scan.seen
        at = int(np.flatnonzero(self.scan.row == rows[0])[0])
        load, capacity = (float(np.asarray(x)[at]) for x in columns.holding)
        return t, capacity / load if load > 0 else np.inf

    @property
    def phase_at_end(self) -> Ended | None:
        """The phase in force at the end, of a duty in phases."""
        lever = self._record.system.lever  # pyright: ignore
        return (
            lever.ended(int(self._record.mode_end.phase))
            if isinstance(lever, Phases)
            else None
        )

    @property
    def pull(self) -> tuple[float, float, float] | None:
        """Maximum tension of a lever that holds the speed, the largest that it had in
        the run (N), and when (s)."""
        if not speed_is_led(self.result.scene):
            return None
        system: BrakeSystem = self._record.system  # pyright: ignore
        columns = self.scan.seen
        i = int(np.argmax(columns.lever_tension))
        return (
            float(system.lever.greatest()),
            float(columns.lever_tension[i]),
            float(columns.t[i]),
        )  # pyright: ignore

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
        phases = [Phase(*span) for span in spans]
        start, *_, end = labels_of(record, np.asarray([0, n]))
        if n and end != labels[-1]:  # an event at the very end
            phases.append(
                Phase(
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
        margins = np.asarray(self.scan.seen.margins)
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
        # pyright: ignore
        lever = self._record.system.lever
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
    def _stops(self) -> Table:
        return stops_of(
            self._record, self.result.scene, self._stop_rows, self._maxima.between
        )

    @property
    def stops(self) -> Table:
        """The stops of the run, in the system of units in force."""
        names = [column.name for column in self._stops.columns]
        return Table(columns_of(names, words_of(self.result.scene)), list(self._stops))

    def _marks(self) -> list[Event]:
        """Events of quantities that pass their limits."""
        events: list[Event] = []
        for name, limit in self._limits.items():

            def excess(
                columns: ScanColumns, name: str = name, limit: float = limit
            ) -> np.ndarray:
                return (np.asarray(columns.passing[name]) - limit) / max(
                    abs(limit), 1.0
                )

            values = excess(self.scan.seen)
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
        t = np.asarray(self.scan.seen.t)
        speed = np.abs(np.asarray(self.scan.seen.omega))
        slight = _SLOW * float(self.result.rtol) * np.max(speed)
        return bool(np.all(speed[(t >= time) & (t <= min(stops))] <= slight))

    def _reversals(self) -> list[Event]:
        """Instants at which the speed of the pulley changes its sign without a rest."""
        seen = self.scan.seen
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
        margins = margins_of(scan.seen)

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

        near = _rise(polynomial, place / last, (place + 1) / last)
        share = np.where(np.isnan(near), (place + 0.5) / last, near)
        left = np.arange(len(near))
        for reach in (
            _NEAR,
            1.0 / last,
            1.0,
        ):  # the run itself may have it a little aside
            low = np.maximum(share[left] - reach, 0.0)
            high = np.minimum(share[left] + reach, 1.0)
            exact = _rise(lambda some, x, left=left: margin(left[some], x), low, high)
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

    def _staged(self) -> Entry:
        """The stages of a staged brake, and why one is missing."""
        scene = self.result.scene
        if not scene.brake.in_series:
            return {}
        stages = self.stages
        system = self.result.record.system
        greatest = np.max(self.scan.seen.lever_tension)
        load = self.scan.seen.load_torque[0]
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

    def _holding(self, metrics: Entry) -> Entry:
        """Load and capacity at the minimum holding reserve, and the tension of a lever
        that holds the speed."""
        columns = self.scan.seen
        least = metrics.get(HOLDING)
        pull = self.pull
        entry: Entry = (
            {}
            if pull is None
            else {"pull": dict(zip(("limit", "value", "time"), pull, strict=True))}
        )
        if least is not None:
            load = abs(
                float(
                    np.interp(self.peaks[HOLDING].time, columns.t, columns.load_torque)
                )
            )
            entry["holding"] = {"load_torque": load, "capacity": least * load}
        return entry

    def _notes(self) -> list[str]:
        """What this run could not see."""
        system: BrakeSystem = self._record.system  # pyright: ignore
        words = {"lever": "the lever", "load": "the load", "motor": "the motor"}
        names = list(
            dict.fromkeys(
                words.get(name, "another given function") for name in system.sampled
            )
        )
        if not names:
            return []
        t = np.asarray(self._record.rows.t)[: int(self._record.count) + 1]
        # (guards are looked at more often, but what turns the pulley is seen by the
        # steps alone)
        longest = float(np.max(np.diff(t), initial=0.0)) * self._record.method.blind
        verb = (
            "is a user-defined function"
            if len(names) == 1
            else "are user-defined functions"
        )
        return [
            f"sampled: {' and '.join(names)} {verb} of time; this run looked at least every "
            f"{number(longest, 's', count=3)}, a shorter pulse may be missed: give its "
            "knots, or a shorter max_step"
        ]

    @functools.cached_property
    def summary(self) -> Entry:
        """What `Result.summary` gives a copy of."""
        r = self.result
        stats = self.result.record.stats
        metrics = self.metrics
        words = self.result.scene.brake.words
        count = r.scene.brake.linings.count
        widths = self._maxima.widths
        single = [
            name
            for name in self.peaks
            if METRICS[name].of_linings and widths[name] == count
        ]
        said = [
            *warnings(r.scene),
            *plausibility(r.scene, metrics.get("peak_rim_temperature")),
        ]
        numbers = metrics | {
            f"energy.{name}": value for name, value in plain(self._energies).items()
        }
        said += thick_layers(r.scene, self.scan, self.peaks)
        said += shortage(self.scan, r.status) + limits_exceeded(r.scene, numbers)
        # (those that do from the start are told by the scene)
        if times := [
            event.time for event in self.events if event.name == "self_locking"
        ]:
            said.append(
                f"self_locking: a lining came to lock itself, first at {min(times):.6g} s"
            )
        if times := [
            event.time for event in self.events if event.name == "coolant_boils"
        ]:
            how = (
                "the coolant boils at the wetted wall; the heat is computed as if it "
                "stayed liquid"
            )
            said.append(f"coolant_boils: from {times[0]:.6g} s on {how}")
        capacity = None
        if r.status in (
            Status.NOT_STOPPED,
            Status.RUNAWAY,
        ):  # a lining that locks itself holds any load
            end_capacity = r.end_capacity
            capacity = {
                "load_torque": end_capacity.hanging,
                "brake_torque": float(end_capacity.torque),
                "pairs": end_capacity.pairs,
            }
        summary = {
            "status": r.status,
            "duty": duty_of(r.scene, r.status, len(self.stops)),
            "message": r.message,
            "capacity": capacity,
            "warnings": said,
            "notes": self._notes(),
            "events": [event.as_dict() for event in self.events],
            "end": end_of(self._record, r.scene),
            **self._holding(metrics),
            "metrics": metrics,
            "at": {
                **{
                    f"{name}_time": float(peak.time)
                    for name, peak in self.peaks.items()
                },
                **{
                    f"{name}_lining": int(self.peaks[name].lining) for name in single
                },  # not of all as one body
            },
            **({"stops": self.stops.as_list()} if len(self.stops) > 1 else {}),
            **self._staged(),
            **(
                {}
                if r.scene.brake.banded
                else {"brake": words.brake, "lining": words.lining, "body": words.body}
            ),
            **({} if r.scene.brake.rims == 1 else {"rims": r.scene.brake.rims}),
            **({} if r.scene.wear is None else {"worn_thickness": r.worn_thickness}),
            "distribution": r.record.system.mechanism.distribution,
            "energy": self._energies,
            "solver": {
                "method": r.method_name,
                "reason": stiffness(r.scene)[1],
                "rtol": r.rtol,
                "steps": stats.accepted,
                **{
                    name: getattr(stats, name)
                    for name in ("rejected", "retaken", "events", "segments")
                },
            },
        }
        return plain(summary)


# --- the summary as text ------------------------------------------------------------


def _number(value: float | None, unit: str) -> str:
    if value is None:
        return "—"
    return str(number(value, unit)) if in_rig_units() else f"{value:.6g} {unit}"


def _kilo(value: float | None, unit: str, *, digits: int = 6) -> str:
    """A number in thousands; a dash for what left the range of numbers in a failed
    run."""
    if value is None:
        return f"— {unit}"
    rig = in_rig_units()
    return (
        str(number(value, unit[1:], count=digits))
        if rig
        else f"{value / 1e3 + 0.0:.{digits}g} {unit}"
    )


def _sum(
    energies: Entry, words: Mapping[str, str], *, digits: int = 6, between: str = " + "
) -> str:
    """The energies that a run has, each after its words, in kJ."""
    there = {words[name]: value for name, value in energies.items() if name in words}
    return between.join(
        f"{word} {_kilo(value, 'kJ', digits=digits)}" for word, value in there.items()
    )


def _share(value: float | None) -> str:
    return "—" if value is None else f"{value:.1e}"


def _grouped(events: list[Entry]) -> str:
    """Events in order, runs of one name at several linings drawn together."""
    parts = []
    for _, group in itertools.groupby(
        enumerate(events), lambda x: (x[1]["name"], -1 if "lining" in x[1] else x[0])
    ):
        first, *more = (event for _, event in group)
        words = first["name"].replace("_", " ")
        lining = f" {first['lining']}" if "lining" in first else ""
        if more:
            words = f"{words}s"
            lining = f"{lining}…{more[-1]['lining']}"
        until = f"…{more[-1]['time']:.6g}" if more else ""
        parts.append(f"{words}{lining} {first['time']:.6g}{until} s")
    shown = (
        parts
        if len(parts) <= 12
        else [*parts[:6], f"… {len(parts) - 10} more …", *parts[-4:]]
    )
    return ", ".join(shown) if shown else "none"


def hottest_first(metrics: Mapping[str, float | None]) -> list[str]:
    """Names of the maximum temperatures that a run has, the highest one first."""
    there = {
        name: value
        for name, value in metrics.items()
        if name.startswith("peak_") and value is not None
    }
    return sorted(
        (name for name in there if name.endswith("_temperature")),
        key=lambda name: -there[name],
    )


def body_of(place: str, summary: Entry) -> str:
    """A place whose temperature is reported, in the words of its kind of brake."""
    own = {
        "rim": summary.get("body", "rim"),
        "linings": f"{summary.get('lining', 'lining')}s",
    }
    return own.get(place, "linings outside" if place == "outer" else place)


def _course(summary: Entry) -> Iterator[str]:
    """Onset of slip and stop of a run with one stop, or of one without as far as it
    came; stages of a staged brake."""
    m = summary["metrics"]
    if summary["duty"] in (
        DutyKind.STOP,
        DutyKind.TURNING,
        DutyKind.RUNAWAY,
        DutyKind.FAILED,
    ):
        acts = (
            "slip onset t0"
            if "lining" not in summary
            else f"the {summary['lining']}s act from"
        )
        if m["slip_onset_time"] is not None or m["stopping_time"] is not None:
            slips = _number(m["full_slip_time"], "s")
            yield f"onset    {acts} {_number(m['slip_onset_time'], 's')}, full slip {slips}"
        if m["stopping_time"] is not None:
            travel = (
                ""
                if m["hook_travel"] is None
                else f", hook travel {_number(m['hook_travel'], 'm')}"
            )
            yield (
                f"stop     after {_number(m['stopping_time'], 's')}, "
                f"{_number(m['stopping_angle'], 'rad')}{travel}"
            )
    yield from duty_lines(summary)
    if "stages" in summary:
        pairs = {"heat_external": "external", "heat_internal": "internal"}
        slip, lock = (
            _number(m[name], "s")
            for name in ("internal_slip_time", "external_lock_time")
        )
        yield (
            f"staged   internal slip {slip}, external lock {lock}; heat "
            f"{_sum(summary['energy'], pairs)}"
        )
        for stage in summary["stages"]:
            heat = _sum(stage, pairs, digits=4, between=", ")
            yield f"         {stage['start']:.6g}…{stage['end']:.6g} s {stage['name']}: {heat}"
        yield from (
            f"         no {stage['name']}: {stage['reason']}"
            for stage in summary["absent_stages"]
        )


def _forces(summary: Entry) -> Iterator[str]:
    """Maximum tension and load with their linings, maximum hook load, minimum holding
    reserve."""
    m = summary["metrics"]
    at = summary["at"]
    lining = summary.get("lining", "lining")
    each = f" of each of {summary['rims']} rims" if "rims" in summary else ""
    for head, name, where in (
        ("tension", "max_tension", "behind lining"),
        ("load", "max_normal_load", f"on {lining}"),
    ):
        if name in m:
            most = _kilo(m[name], "kN")
            when = _number(at[f"{name}_time"], "s")
            yield f"{head:8} at most {most} {where} {at[f'{name}_lining']}{each} at {when}"
    if m.get("max_hook_load") is not None:
        most = _kilo(m["max_hook_load"], "kN")
        when = _number(at["max_hook_load_time"], "s")
        yield (
            f"hook     at most {most} at {when}; at most "
            f"{m['max_hook_load_over_weight']:.5g} times its weight"
        )
    if m.get(HOLDING) is not None:
        when = _number(at[f"{HOLDING}_time"], "s")
        yield f"holding  static capacity at least {m[HOLDING]:.5g} times the load, at {when}"


#: terms of both balances in words
_TERMS = {
    "load_work": "load",
    "lever_work": "lever",
    "motor_work": "motor",
    "kinetic_release": "kinetic",
    "friction_heat": "friction heat",
    "damper_heat": "dampers",
    "shaft_work": "other torques on the shaft",
    "electrical_work": "electrical",
    "mechanical_work": "mechanical",
    "elastic_change": "elastic",
    "kinetic_change": "kinetic energy gained",
    "heat_to_metal": "to metal",
    "heat_to_linings": "to linings",
    "heat_to_band": "to band",
    "heat_elsewhere": "to no body",
    "heat_supplied": "supplied",
    "heat_stored": "stored",
    "heat_lost": "lost",
    "heat_to_coolant": "to coolant",
}
#: maximum temperatures of jackets, and where they are
_COOLANT = {
    "peak_wetted_temperature": "at the wetted wall",
    "peak_coolant_temperature": "at the outlet",
}


def _energy(summary: Entry) -> Iterator[str]:
    """Energy in and out, marks that the run passed, maximum temperatures, heat,
    wear."""
    m = summary["metrics"]
    e = summary["energy"]
    at = summary["at"]
    lining = summary.get("lining", "lining")
    into, out = energy_balance(e)
    change = e["kinetic_change"]
    if change is not None and change > _ROUNDING * abs(
        e["load_work"] or 0.0
    ):  # the load has sped the pulley up
        out["kinetic_change"] = change
        del into["kinetic_release"]
    yield f"energy   {_sum(into, _TERMS)} = {_sum(out, _TERMS)}"
    passed = []
    for name, words in {
        **{mark.event: mark.words for mark in marks()},
        "self_locking": "self-locking",
    }.items():
        if times := [
            event["time"] for event in summary["events"] if event["name"] == name
        ]:
            often = "once, " if len(times) == 1 else f"{len(times)} times, first "
            passed.append(f"{words} {often}at {min(times):.6g} s")
    if passed:
        yield f"marks    {', '.join(passed)}"
    if "heat_stored" in e:
        hot = []
        for name in (name for name in hottest_first(m) if name in HOT):
            rig = in_rig_units()
            T = m[name]
            degrees = number(T, "K", count=5) if rig else f"{T - 273.15:.5g} °C"
            hot.append(
                f"{body_of(HOT[name], summary)} {degrees} at {at[f'{name}_time']:.6g} s"
            )
        yield f"hottest  {', '.join(hot) or 'the scene names no rim, linings or band'}"
        into, out = heat_balance(e)
        into = {
            name: x
            for name, x in into.items()
            if x != 0 or name in ("heat_to_metal", "heat_to_linings")
        }
        yield (
            f"heat     {_sum(into, _TERMS)} = {_sum(out, _TERMS)} (residual "
            f"{_share(e['heat_closure'])})"
        )
    if "peak_wetted_temperature" in m:
        hottest = (
            f"{number(m[name], 'K', count=5)} {where} at {_number(at[f'{name}_time'], 's')}"
            for name, where in _COOLANT.items()
        )
        yield f"coolant  at most {', '.join(hottest)}"
    if "worn_thickness" in summary and (most := m["greatest_wear"]) is not None:
        worn = summary["worn_thickness"]
        mean = m["wear_over_mean"]
        least = m["wear_over_least"]
        depth = number(most, "m", count=5) if in_rig_units() else f"{1e6 * most:.5g} µm"
        over = "" if least is None else f", {least:.4g} times the least"
        where = f"{lining} {first_largest(np.asarray(worn)) + 1}"
        slid = mean is not None
        yield "wear     " + (
            f"at most {depth} on {where}, {mean:.4g} times the mean{over}"
            if slid
            else f"none: no {lining} slid"
        )


def text(summary: Entry, first: Sequence[str] = ()) -> str:
    """About ten lines that can be read without the source; `first`: lines below the
    heading."""
    e = summary["energy"]
    s = summary["solver"]
    many = summary["duty"] == DutyKind.STOPS
    residual_note = "" if e["closure"] is None else f" ({RESIDUAL_SEES})"
    lines = [
        f"{summary['status']}: {summary['message']}",
        *first,
        f"events   {counted(summary['events']) if many else _grouped(summary['events'])}",
        *_course(summary),
        *_forces(summary),
        *_energy(summary),
        f"closure  relative energy-balance residual {_share(e['closure'])}{residual_note}",
        f"solver   {s['method']}, rtol {s['rtol']:g}: {s['steps']} steps, "
        f"{s['rejected']} rejected, "
        f"{s['retaken']} truncated at events, {s['segments']} segments",
    ]
    if not summary["distribution"].startswith("mobilisation"):
        lines.append(f"split    {summary['distribution']}")
    if "heat_stored" in e:
        lines.append(f"method   {s['method']}: {s['reason']}")
    if (table := stop_table(summary)) is not None:
        lines += ["stops", *(f"         {line}" for line in str(table).splitlines())]
    lines += [f"note     {note}" for note in summary.get("notes", ())]
    return "\n".join(
        [*lines, *(f"warning  {warning}" for warning in summary["warnings"])]
    )
