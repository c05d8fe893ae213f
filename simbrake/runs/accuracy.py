"""Estimated errors of one run: of its metrics, of the times of its events, and of its
states."""

import dataclasses
import difflib
import itertools
import math
import operator
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import jax
import numpy as np

from .._base._arguments import explained
from .._base._numbers import Number, digits, number, pretty
from .._base._table import Column, JsonObject, Table, Tabular, plain
from ..hybrid import Code, Record, Rodas5P
from ..outputs.log import Event, segments_of
from ..outputs.metrics import HOT, METRICS, RESIDUALS, about_output
from ..outputs.scan import Scan
from ..physics.heated import thermal_of
from ..thermal.heat import Heat
from ..thermal.mesh import merged
from .errors import EPS, error_of_layers, rounding, second_rtol
from .measure import title_of
from .mesh import cuts_of, with_finer_layers
from .result import Result, require_one
from .simulate import simulate, solver_of

#: times near 0 are rounded as this share of the duration of the run is
_LEAST_TIME = 1e-3
#: shares of a run, tried in this order: a segment that is shorter may be missing in one
#: of two runs
_BRIEFS = (0.0, 1e-12, 1e-9)
#: the states of two runs are compared at these shares of each step of the first run, at
#: this many times at most
_SHARES_OF_STEP = np.array([0.0, 0.25, 0.5, 0.75])
_MOST_TIMES = 4096


class ErrorEstimate(NamedTuple):
    """A number of a run with its estimated error, both in its SI unit; `None` where it
    has no value.

    - `value`: of a metric or an energy; the time of an event; the largest magnitude of
      a kind of states in the run
    - `layers`: the part of the error that comes from the layers of walls; for
      temperatures surfaces are included
    - `lining` of an event;  `time` (s) at which states have their largest error

    Example:
        >>> one = result.accuracy().metrics[2]
        >>> one.name, one.unit, one.error < 1e-9
        ('stopping_time', 's', True)
    """

    name: str
    unit: str
    value: float | None
    error: float | None
    layers: float | None = 0.0
    lining: int | None = None
    time: float | None = None

    @property
    def relative(self) -> float | None:
        """Error as a share of the value; of a temperature as a share of the kelvins."""
        return (
            self.error / abs(self.value)
            if self.error is not None and self.value
            else None
        )

    @property
    def is_of_layers(self) -> bool:
        """Whether the error is mostly that of the layers of walls."""
        return (self.layers or 0.0) > 0.5 * (self.error or 0.0)


def _worst(estimates: Iterable[ErrorEstimate]) -> ErrorEstimate:
    return max(estimates, key=lambda estimate: estimate.error or 0.0)


# --- states by kind -----------------------------------------------------------------


class Kind(NamedTuple):
    """A kind of states: its name in data, in words, and its unit."""

    name: str
    words: str
    unit: str


_KINDS = {
    "phi": Kind("angle", "angle", "rad"),
    "omega": Kind("speed", "speed", "rad/s"),
    "x": Kind("band_stretch", "elongation of the band", "m"),
    "omega_b": Kind("bandage_speed", "speed of the bandage", "rad/s"),
    "e": Kind("segment_stretch", "elongation of the segments", "m"),
    "v": Kind("lining_speed", "speed of the linings", "m/s"),
    "stretch": Kind("spring_stretch", "elongation of the springs", "m"),
    "speeds": Kind("lining_speed", "speed of the linings", "rad/s"),
    "ledger": Kind("energy", "energies", "J"),
    "heat": Kind("temperature", "temperatures", "K"),
    "worn": Kind("wear", "worn thickness", "m"),
    "memory": Kind("friction_state", "states of friction laws", "1"),
    "onset": Kind("friction_change_start", "start of a change of friction", "s"),
    "hook.speed": Kind("hook_speed", "speed of the hook", "m/s"),
    "hook.excess": Kind("rope_stretch", "elongation of the rope", "m"),
}


#: states by which phases find their own end: no result of a run
_OF_PHASES = ("begun", "turned", "way")


def kinds_of(record: Record) -> list[Kind]:
    """Kind of every entry of the flat state."""
    kinds = []
    for path, leaf in jax.tree_util.tree_leaves_with_path(record.y_like):
        names = [str(getattr(key, "name", key)) for key in path]
        name = names[0]
        if name == "hook":
            name = ".".join(names)
        elif name in ("own", "phase"):
            name = names[-1]
        kind = _KINDS.get(name, Kind(name, name.replace("_", " "), ""))
        kinds += [kind] * int(np.size(leaf))
    return kinds


# --- two runs, segment by segment ---------------------------------------------------


class Segment(NamedTuple):
    """Rows of a run from one event or time breakpoint to the next, and the mode in
    between."""

    first: int
    last: int
    mode: tuple[int, ...]


def _segments(scan: Scan, brief: float) -> list[Segment]:
    """Segments of a concrete run that last longer than `brief` (s)."""
    t = np.asarray(scan.record.rows.t)
    modes = np.asarray(scan.record.rows.mode)
    spans = [
        (int(a), int(b))
        for a, b in zip(*segments_of(scan.record), strict=True)
        if t[b + 1] - t[a] > brief
    ]
    return [Segment(a, b, tuple(modes[a].tolist())) for a, b in spans]


#: what the same event of two runs has in common
_event_key = operator.attrgetter("name", "lining")


def _words(event: Event | None) -> str:
    if event is None:
        return "nothing more"
    lining = "" if event.lining is None else f" of lining {event.lining}"
    return f"{event.name}{lining} at {event.time:.9g} s"


def _paired_events(
    a: list[Event], b: list[Event], brief: float
) -> tuple[list[tuple[Event, Event]], str]:
    """Pairs of the same event in two runs, events of one name in the order of time; or
    the first difference between the runs, in words.

    By rounding an event may come in one run alone, as a speed that passes 0 at a stop.
    It is left out if the other run has any event within `brief` (s) of it.
    """
    a, b = _without_brief(a, b, brief), _without_brief(b, a, brief)
    if Counter(map(_event_key, a)) == Counter(map(_event_key, b)):
        others: dict[tuple[str, int | None], list[Event]] = {}
        for event in b:
            others.setdefault(_event_key(event), []).append(event)
        return [(event, others[_event_key(event)].pop(0)) for event in a], ""
    for i, (mine, theirs) in enumerate(itertools.zip_longest(a, b)):
        if mine is None or theirs is None or _event_key(mine) != _event_key(theirs):
            return (
                [],
                f"event {i + 1} is {_words(mine)} in this run, {_words(theirs)} in the second",
            )
    return [], ""


def _without_brief(a: list[Event], b: list[Event], brief: float) -> list[Event]:
    """The events `a` without those that `b` has less often, where `b` has only other
    events within `brief` (s)."""
    more = Counter(map(_event_key, a)) - Counter(map(_event_key, b))

    def is_brief(event: Event) -> bool:
        near = [other for other in b if abs(other.time - event.time) <= brief]
        same = [other for other in near if _event_key(other) == _event_key(event)]
        return _event_key(event) in more and bool(near) and not same

    return [event for event in a if not is_brief(event)]


class Difference(NamedTuple):
    """Differences between two runs as `error` of metrics, of times of events in the
    order of the log, and of states by kind.

    - `problem`: empty, or why only metrics can be compared
    """

    metrics: list[ErrorEstimate]
    events: list[ErrorEstimate]
    states: list[ErrorEstimate]
    problem: str = ""


def metrics_of_run(result: Result) -> dict[str, float | None]:
    """Metrics of a concrete result and its energies as `energy.…`; no residuals, which
    are no values of the run."""
    energies = {
        key: float(value)
        for name, value in result.energy.items()
        if (key := f"energy.{name}") not in RESIDUALS
    }
    metrics = {
        name: value
        for name, value in result.metrics.items()
        if f"energy.{name}" not in energies
    }
    times = {
        f"{name}_time": float(peak.time)
        for name, peak in result.report().peaks.items()
        if metrics.get(name) is not None
    }
    return {**metrics, **times, **energies}


def difference(a: Result, b: Result) -> Difference:
    """Differences between two runs of one scene; states are compared at the ends of the
    steps of `a` and inside them."""
    log_a = a.report().events
    log_b = b.report().events
    values_b = metrics_of_run(b)
    metrics = []
    for name, value in metrics_of_run(a).items():
        other = values_b.get(name)
        apart = None if value is None or other is None else abs(value - other)
        metrics.append(ErrorEstimate(name, about_output(name)["units"], value, apart))
    times = a.record.rows.t
    briefs = [share * float(times[int(a.record.count)] - times[0]) for share in _BRIEFS]
    pairs, problem = _paired_events(log_a, log_b, briefs[-1])
    if problem:
        return Difference(metrics, [], [], problem)
    scans = a.report().scan, b.report().scan
    segments = _matched(*scans, briefs)
    if segments is None:
        problem = "between two events the modes of the runs differ"
        return Difference(metrics, [], [], problem)
    events = [
        ErrorEstimate(x.name, "s", float(x.time), abs(x.time - y.time), lining=x.lining)
        for x, y in pairs
    ]
    return Difference(metrics, events, _of_states(*scans, segments))


def _matched(
    a: Scan, b: Scan, briefs: list[float]
) -> list[tuple[Segment, Segment]] | None:
    """The same segments of two runs, without the shortest that one run alone may have;
    `None` where their modes differ."""
    for brief in briefs:
        of_a = _segments(a, brief)
        of_b = _segments(b, brief)
        if [segment.mode for segment in of_a] == [segment.mode for segment in of_b]:
            return list(zip(of_a, of_b, strict=True))
    return None


class Places(NamedTuple):
    """Instants of a run: rows of its record, and shares of their steps."""

    row: np.ndarray
    share: np.ndarray


def _common_places(
    a: Scan, b: Scan, segments: list[tuple[Segment, Segment]]
) -> tuple[Places, Places] | None:
    """The same instants in two runs, by the steps of `a`; `None` without any."""
    pairs = []
    for of_a, of_b in segments:
        # times that lie between the same events in both runs: after an event of one of
        # them alone, states may jump
        begin = max(a.steps.t0[of_a.first], b.steps.t0[of_b.first])
        end = min(a.steps.t1[of_a.last], b.steps.t1[of_b.last])
        if begin > end:
            continue
        t0 = a.steps.t0[of_a.first : of_a.last + 1, None]
        t1 = a.steps.t1[of_a.first : of_a.last + 1, None]
        inside = t0 + _SHARES_OF_STEP * (t1 - t0)
        times = np.unique(np.clip(np.append(inside, end), begin, end))
        pairs.append((_places(a, of_a, times), _places(b, of_b, times)))
    if not pairs:
        return None
    count = sum(len(in_a.row) for in_a, _ in pairs)
    some = np.linspace(0, count - 1, min(count, _MOST_TIMES)).round().astype(int)

    def joined(parts: Iterable[Places]) -> Places:
        columns = (np.concatenate(column) for column in zip(*parts, strict=True))
        return Places(*(column[np.unique(some)] for column in columns))

    in_a, in_b = zip(*pairs, strict=True)
    return joined(in_a), joined(in_b)


def _of_states(
    a: Scan, b: Scan, segments: list[tuple[Segment, Segment]]
) -> list[ErrorEstimate]:
    places = _common_places(a, b, segments)
    if places is None:
        return []
    at_a, at_b = places
    t0 = a.steps.t0[at_a.row]
    t = t0 + at_a.share * (a.steps.t1[at_a.row] - t0)
    y_a = _states_at(a, at_a)
    y_b = _states_at(b, at_b)
    kinds_a = kinds_of(a.record)
    kinds_b = kinds_of(b.record)
    states = []
    for kind in dict.fromkeys(kinds_a):
        if kind.name in _OF_PHASES:
            continue
        u = y_a[:, [entry == kind for entry in kinds_a]]
        v = y_b[:, [entry == kind for entry in kinds_b]]
        if kind.name == "temperature":
            u = _node_temperatures(a, u)
            v = _node_temperatures(b, v)
            if kinds_a != kinds_b:  # `b` has finer layers
                coarse, fine = (thermal_of(scan.record.system).heat for scan in (a, b))  # pyright: ignore
                u = np.column_stack([u, *a.look(*at_a).hot.values()])
                v = np.column_stack(
                    [merged(coarse, fine, v), *b.look(*at_b).hot.values()]
                )
        apart = np.max(np.abs(u - v), axis=1)
        worst = int(np.argmax(apart))
        largest = float(np.max(np.abs(u)))
        states.append(
            ErrorEstimate(
                kind.name, kind.unit, largest, float(apart[worst]), time=float(t[worst])
            )
        )
    return states


def _places(scan: Scan, segment: Segment, times: np.ndarray) -> Places:
    """Where times between the ends of a segment lie."""
    starts = scan.steps.t0[segment.first : segment.last + 1]
    row = segment.first + np.searchsorted(starts, times, side="right") - 1
    t0 = scan.steps.t0[row]
    span = scan.steps.t1[row] - t0
    # (the end of a segment is that of its last step that lasts)
    share = np.where(span > 0, (times - t0) / np.where(span > 0, span, 1.0), 1.0)
    return Places(row, np.clip(share, 0.0, 1.0))


def _states_at(scan: Scan, at: Places) -> np.ndarray:
    """Flat states; at ends of steps as recorded, without the rounding of a partial
    step, but before the jump of the speed at a change of the rope's layer."""
    row, share = at
    inside = (share > 0.0) & (share < 1.0)
    if scan.record.system.load.layers is not None:  # pyright: ignore
        inside = share > 0.0
    y = np.where(share[:, None] == 0.0, scan.steps.y0[row], scan.steps.y1[row])
    if inside.any():
        y[inside] = scan.states(row[inside], share[inside])[1]
    return y


def _node_temperatures(scan: Scan, u: np.ndarray) -> np.ndarray:
    # (in NumPy: a program would be compiled for this alone)
    thermal = jax.tree.map(np.asarray, thermal_of(scan.record.system))  # pyright: ignore
    return thermal.temperatures(u)


# --- the second run -----------------------------------------------------------------


def longest_step(record: Record) -> float:
    """Longest step (s) of the second run: the shortest with which the steps of the first
    run, cut by it, become at most twice as many."""
    h = np.diff(np.asarray(record.rows.t)[: int(record.count) + 1])
    h = h[h > 0]
    low = 0.0
    high = float(np.max(h, initial=0.0))
    for _ in range(60 if high else 0):
        middle = 0.5 * (low + high)
        if np.sum(np.ceil(h / middle)) <= 2 * len(h):
            high = middle
        else:
            low = middle
    return high or math.inf


def second_run(result: Result, progress: Any = False) -> Result:
    """The same scene with the same solver at `second_rtol`, by the program that the
    first run has compiled."""
    limits = result.limits
    options: dict[str, Any] = {
        "solver": _solver_again(result),
        "rtol": second_rtol(float(result.rtol)),
        "max_step": min(longest_step(result.record), float(limits.max_step)),
        "max_events": int(limits.max_events),
        "throw": False,
        "progress": progress,
    }
    second = simulate(result.scene, max_steps=limits.max_steps, **options)
    # the limit suited the first run; the second one needs more steps
    if limits.max_steps is not None and int(second.code) == Code.STEP_LIMIT:
        second = simulate(result.scene, **options)
    return second


def finer_run(result: Result, progress: Any = False) -> Result | None:
    """The same run with finer layers, and the method that fits them; `None` without
    walls."""
    if not result.scene.network.walls:
        return None
    return simulate(
        with_finer_layers(result.scene, cuts_of(result)),
        rtol=float(result.rtol),
        max_step=float(result.limits.max_step),
        max_events=int(result.limits.max_events),
        throw=False,
        progress=progress,
    )


def _solver_again(result: Result) -> Any:
    """The solver of the run as it was given, which finds the compiled program: the
    method of a record may be a variant of it that fits the system."""
    used = result.record.method
    if isinstance(used, Rodas5P):
        return Rodas5P()
    usual = solver_of(result.scene)
    return (
        usual if getattr(usual, "solver", None) == getattr(used, "solver", "") else used
    )


# --- the estimate -------------------------------------------------------------------


def _scope(heat: Heat, problem: str) -> str:
    """What an estimate covers and what not; `problem`: why the layers of walls are not
    in it."""
    layers = ""
    beyond = ["the model and its parameters"]
    if heat.walls and problem:
        beyond.insert(0, f"the layers of walls ({problem})")
    elif heat.walls:
        layers = ", and the layers of walls"
    elif heat.bodies:
        beyond.insert(0, "differences of temperature inside bodies of one temperature")
    return (
        "covers the integration in time: steps, events, states and maximum values "
        f"inside steps{layers}. Does not "
        f"cover {', '.join(beyond)}, or a pulse in a profile that no step looked at"
    )


@dataclasses.dataclass(frozen=True, repr=False)
class Accuracy(Tabular):
    """Estimated errors of a run, from a second one, and with walls in layers from a
    third one with finer layers.

    - `metrics` (with energies), `events` (of their times), `states` (of each kind, at
      any time): the estimated errors; `problem`: empty, or why there is none (the three
      are empty then)
    - `rtol` of the run, `second_rtol` and `max_step` (s) of the second
    - `steps` and `second_steps` taken, `seconds` of
      the second run
    - `scope`: what the errors cover, and what not
    - `finer_steps` and `finer_seconds` of the run with finer layers, 0 without;
      `finer_problem`: empty, or why the layers are in no error, or in those of metrics
      alone

    `accuracy["stopping_time"]` is the error of a metric or of a kind of states.
    Printing it shows all of them.

    Example:
        >>> found = result.accuracy()
        >>> found.problem, found["stopping_time"] < 1e-9
        ('', True)
    """

    rtol: float
    second_rtol: float
    max_step: float
    steps: int
    second_steps: int
    seconds: float
    metrics: tuple[ErrorEstimate, ...] = ()
    events: tuple[ErrorEstimate, ...] = ()
    states: tuple[ErrorEstimate, ...] = ()
    problem: str = ""
    scope: str = ""
    finer_steps: int = 0
    finer_seconds: float = 0.0
    finer_problem: str = ""

    def __getitem__(self, name: str) -> float | None:
        errors = {
            estimate.name: estimate.error for estimate in (*self.metrics, *self.states)
        }
        if name not in errors:
            near = difflib.get_close_matches(name, errors, n=3, cutoff=0.4)
            hint = self.problem or f"nearest: {', '.join(near or errors)}"
            raise KeyError(f"no error of {name!r}; {hint}")
        return errors[name]

    __iter__ = None

    @property
    def event_time(self) -> float | None:
        """The largest error of the time of an event (s), `None` without events."""
        return _worst(self.events).error if self.events else None

    def _layers_of(self, state: ErrorEstimate) -> str:
        """Words that follow an error that comes mostly from the layers of walls: it is
        often that of the first instants of a heating, so that maxima are more exact."""
        if not state.is_of_layers:
            return ""
        maxima = [
            metric
            for metric in self.metrics
            if metric.name in HOT and metric.error is not None
        ]
        more = ""
        if state.unit == "K" and maxima:
            more = f"; maxima {_size(_worst(maxima).error, 'K')}"
        return f" (by the layers of walls{more})"

    @property
    def how(self) -> str:
        """From which runs."""
        words = f"a second run with rtol {digits(self.second_rtol, 2)}"
        if math.isfinite(self.max_step):
            words += f" and steps of at most {number(self.max_step, 's', count=3)}"
        words += f": {self.second_steps} steps after {self.steps}"
        if self.finer_steps:
            words += f", and one with finer layers: {self.finer_steps} steps"
        return words

    @property
    def line(self) -> str:
        """The estimate in one line."""
        if self.problem:
            return f"no estimate of the error: {self.problem}"
        phrases = []
        if self.events:
            phrases.append(f"event times {_size(self.event_time, 's')}")
        phrases += [
            f"{_KIND_WORDS[state.name]} {_size(state.error, state.unit)}{self._layers_of(state)}"
            for state in self.states
            if state.error
        ]
        line = (
            f"estimated errors of at most: {', '.join(phrases) or 'nothing moves'}; "
            f"from {self.how}"
        )
        if self.finer_problem:
            line += f"; not all have that of the layers of walls: {self.finer_problem}"
        return line

    def parts(self) -> Iterator[str | Table]:
        """The errors; then how they were found, and what the estimate does not
        cover."""
        yield f"accuracy {self.line}"
        if not self.problem:
            yield self.table()
        if self.seconds:
            yield (
                f"cost     {self.second_steps} steps after {self.steps}, "
                f"{number(self.seconds, 's', count=3)}"
            )
        if self.finer_steps:
            seconds = number(self.finer_seconds, "s", count=3)
            yield f"         {self.finer_steps} steps with finer layers, {seconds}"
        yield f"scope    {self.scope}"

    def table(self) -> Table:
        """Errors of metrics with a value, of the times of events, by name the largest,
        and of states at any time."""
        by_name: dict[str, list[ErrorEstimate]] = {}
        for event in self.events:
            by_name.setdefault(event.name, []).append(event)
        times = {
            f"Time of {name.replace('_', ' ')} ({len(events)})": events
            for name, events in by_name.items()
        }
        estimates = [
            *(
                (title_of(metric.name), metric)
                for metric in self.metrics
                if metric.value is not None
            ),
            *((title, _worst(events)) for title, events in times.items()),
            *(
                (f"{_KIND_WORDS[state.name].capitalize()} at any time", state)
                for state in self.states
            ),
        ]
        columns = [
            "of",
            Column("value"),
            Column("error"),
            Column("relative"),
            Column("at"),
        ]
        layered = any(estimate.layers for _, estimate in estimates)
        if layered:
            columns.append(Column("layers", heading="by the layers"))
        rows = [
            (
                title,
                number(estimate.value, estimate.unit),
                _size(estimate.error, estimate.unit),
                "—" if estimate.relative is None else digits(estimate.relative, 2),
                "" if estimate.time is None else number(estimate.time, "s"),
                *([_size(estimate.layers or None, estimate.unit)] if layered else []),
            )
            for title, estimate in estimates
        ]
        return Table(columns, rows)

    def as_dict(self) -> JsonObject:
        """`{estimated, problem, scope, metrics, events, states, cost}` of JSON, numbers
        in SI."""
        cost = (
            "rtol",
            "second_rtol",
            "steps",
            "second_steps",
            "finer_steps",
            "finer_seconds",
        )
        entry = {
            "estimated": not self.problem,
            "problem": self.problem,
            "scope": self.scope,
            "metrics": {
                metric.name: _values(metric, "unit", "value", "error", "layers")
                for metric in self.metrics
            },
            "events": [
                _values(event, "name", "lining", "error", "layers", time=event.value)
                for event in self.events
            ],
            "states": {
                state.name: _values(
                    state,
                    "name",
                    "unit",
                    "error",
                    "time",
                    "layers",
                    largest=state.value,
                )
                for state in self.states
            },
            "cost": _values(
                self, *cost, second_max_step=self.max_step, second_seconds=self.seconds
            ),
            "finer_problem": self.finer_problem,
        }
        return plain(entry)


def _values(part: Any, *names: str, **more: Any) -> JsonObject:
    return {name: getattr(part, name) for name in names} | more


_KIND_WORDS = {kind.name: kind.words for kind in _KINDS.values()}


def _size(error: float | None, unit: str) -> Number:
    """An error in its SI unit."""
    return (
        Number("—")
        if error is None
        else Number(digits(error, 2), pretty(unit), repr(error), pretty(unit))
    )


@explained
def accuracy(result: Result, progress: Any = False) -> Accuracy:
    """Estimate the errors of a concrete result: of every metric, of the time of every
    event, of every kind of states.

        error ≈ |value − value of a second run| + ε √steps |value|          (ε = 2⁻⁵²: what rounding leaves)

    The second run has the same solver at a tolerance 100 times tighter, 1e-12 at the
    loosest and 1e-13 at the tightest, and steps so short that the first run's would be
    cut in two; so its own error is a small part of the difference. (It is a tolerance,
    not a list of halved steps, as a tolerance needs no other compiled program.) Where
    the events of the two runs are not the same ones in the same order there is no
    estimate, and `problem` says where they differ first. A run that ended early has
    none either.

    States are compared at the ends of the first run's steps and at three times inside
    each, in a long run at some 4096 of these. So the errors of states are those of
    `Result.series` at any time, but for one: between the times of an event in the two
    runs, where a state may jump in one of them only. Forces and torques of a series
    have none.

    Of a scene with walls, a third run has every layer cut in two, or in four, eight, …
    where the first is too thick for the time of heating; and its own compiled program.
    What it changes beyond the errors in time is added 2.2-fold: `error + 2.2 max(|value
    − value with finer layers| − 2 error, 0)`. That covers an error that is proportional
    to the thickness, as of friction that sees the mean of a layer; of surfaces it falls
    with the square. `layers` of each error is that part.

    It covers the integration in time and the layers of walls, not differences of
    temperature inside a `Lump`, the model and its parameters, or a pulse in a profile
    that no step looked at. `progress` as for `simulate`.

    Raises `InputError` for a traced result or a batch.

    Example:
        >>> sb.results.accuracy(result).problem
        ''
    """
    rtol = float(require_one(result).rtol)
    network = result.scene.network
    found = Accuracy(
        rtol,
        second_rtol(rtol),
        max_step=math.inf,
        steps=int(result.record.stats.accepted),
        second_steps=0,
        seconds=0.0,
        scope=_scope(network, "no estimate"),
    )
    if not result.ok:
        why = f"the run ended early ({result.status}) and was not repeated"
        return dataclasses.replace(found, problem=why)
    start = time.perf_counter()
    second = second_run(result, progress)
    found = dataclasses.replace(
        found,
        max_step=min(longest_step(result.record), float(result.limits.max_step)),
        second_steps=int(second.record.stats.accepted),
        seconds=time.perf_counter() - start,
    )
    if not second.ok:
        why = f"the second run failed ({second.status}): {second.message}"
        return dataclasses.replace(found, problem=why)
    apart = difference(result, second)
    if apart.problem:
        return dataclasses.replace(found, problem=apart.problem)
    found = _with_errors(found, result, apart)
    start = time.perf_counter()
    finer = finer_run(result, progress)
    if finer is None:
        return found
    if finer.ok:
        found = _with_layers(found, difference(result, finer))
    else:
        why = f"the run with finer layers failed ({finer.status})"
        found = dataclasses.replace(
            found, finer_problem=why, scope=_scope(network, why)
        )
    return dataclasses.replace(
        found,
        finer_steps=int(finer.record.stats.accepted),
        finer_seconds=time.perf_counter() - start,
    )


def _with_layers(found: Accuracy, apart: Difference) -> Accuracy:
    """The estimate with the errors of the layers of walls, from the difference to a run
    with finer ones."""

    def added(estimate: ErrorEstimate, other: ErrorEstimate) -> ErrorEstimate:
        if estimate.error is None or other.error is None:
            return estimate._replace(error=None, layers=None)
        layers = float(error_of_layers(other.error, estimate.error))
        return estimate._replace(error=estimate.error + layers, layers=layers)

    metrics = tuple(map(added, found.metrics, apart.metrics))
    if apart.problem:
        why = f"with finer layers {apart.problem}"
        hottest = max(
            (metric.layers or 0.0 for metric in metrics if metric.name in HOT),
            default=0.0,
        )
        states = tuple(
            state._replace(error=(state.error or 0.0) + hottest, layers=hottest)
            if state.unit == "K"
            else state
            for state in found.states
        )
        return dataclasses.replace(
            found, metrics=metrics, states=states, finer_problem=why
        )
    states = []
    for state, other in zip(found.states, apart.states, strict=True):
        whole = added(state, other)
        states.append(
            whole._replace(time=other.time, value=other.value)
            if whole.is_of_layers
            else whole
        )
    events = tuple(map(added, found.events, apart.events))
    return dataclasses.replace(
        found, metrics=metrics, events=events, states=tuple(states)
    )


def _with_errors(found: Accuracy, result: Result, apart: Difference) -> Accuracy:
    """The estimate with the errors in time: the differences to the second run, and
    rounding."""
    steps = found.steps
    scan = result.report().scan
    times_of_peaks = {
        f"{name}_time" for name, metric in METRICS.items() if metric.greatest
    }
    span = float(np.max(scan.steps.t1)) - float(np.min(scan.steps.t0))
    energies = [
        abs(estimate.value or 0.0)
        for estimate in apart.metrics
        if estimate.name.startswith("energy.")
    ]
    least_of_unit = {"s": _LEAST_TIME * span, "J": max(energies, default=0.0)}

    def with_rounding(estimate: ErrorEstimate, least: float = 0.0) -> ErrorEstimate:
        size = max(abs(estimate.value or 0.0), least)
        error = float((estimate.error or 0.0) + rounding(steps, size))
        return estimate._replace(error=error)

    def of_metric(estimate: ErrorEstimate) -> ErrorEstimate:
        # (what is 0 in both runs is no sum)
        if estimate.error is None or not (estimate.error or estimate.value):
            return estimate
        estimate = with_rounding(estimate, least_of_unit.get(estimate.unit, 0.0))
        if estimate.name not in times_of_peaks:
            return estimate
        by_rounding = _root_of_rounding(scan, estimate.value or 0.0)
        return estimate._replace(error=(estimate.error or 0.0) + by_rounding)

    return dataclasses.replace(
        found,
        metrics=tuple(map(of_metric, apart.metrics)),
        events=tuple(
            with_rounding(event, least_of_unit["s"]) for event in apart.events
        ),
        states=tuple(map(with_rounding, apart.states)),
        scope=_scope(result.scene.network, ""),
    )


def _root_of_rounding(scan: Scan, t: float) -> float:
    """Error of the time of a maximum inside a step by rounding: within √ε of the step
    the value changes by rounding alone."""
    steps = scan.steps
    row = int(
        np.clip(np.searchsorted(steps.t0, t, side="right") - 1, 0, len(steps.t0) - 1)
    )
    inside = steps.t0[row] < t < steps.t1[row]
    return math.sqrt(EPS) * float(steps.t1[row] - steps.t0[row]) if inside else 0.0
