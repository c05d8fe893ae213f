"""Estimated errors of one run: of its metrics, of the times of its events, and of its
states."""

import dataclasses
import difflib
import functools
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
from .._base._table import Column, Table, Tabular, plain
from ..hybrid import Code, Record, Rodas5P
from ..outputs.log import Event, segments_of
from ..outputs.metrics import HOT, METRICS, RESIDUALS, about_output
from ..outputs.probe import Entry
from ..outputs.scan import Scan
from ..physics.heated import thermal_of
from ..thermal.heat import Heat
from ..thermal.mesh import merged
from .errors import EPS, error_of_layers, rounding, second_rtol
from .measure import title_of
from .mesh import cuts_of, with_finer_layers
from .result import Result, require_one
from .simulate import simulate, solver_of

#: share of a run to which instants near 0 are resolved, relative to rounding
_INSTANT = 1e-3
#: segments that last less than such a share of a run may come in one of two runs only
_BRIEFS = (0.0, 1e-12, 1e-9)
#: instants at which the states of two runs are compared, at most
_INSTANTS = 4096
#: shares of each step of the first run at which they are compared
_SHARES = np.array([0.0, 0.25, 0.5, 0.75])


class ErrorEstimate(NamedTuple):
    """A number of a run with its estimated error, both in its SI unit; `None` where it
    has no value.

    - `value`: of a metric or an energy; of an event its time; of a kind of states the
      largest in the run
    - `layers`: part of the error that the layers of walls make; of temperatures with
      those of the surfaces
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


#: states that only tell a phase when it ends
_OF_PHASES = ("begun", "turned", "way")


def kinds_of(record: Record) -> list[Kind]:
    """Kind of every entry of the flat state."""
    kinds = []
    for path, leaf in jax.tree_util.tree_leaves_with_path(record.y_like):
        names = [str(getattr(key, "name", key)) for key in path]
        name = (
            names[-1]
            if names[0] in ("own", "phase")
            else ".".join(names)
            if names[0] == "hook"
            else names[0]
        )
        kinds += [_KINDS.get(name, Kind(name, name.replace("_", " "), ""))] * int(
            np.size(leaf)
        )
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


#: what tells events apart
_named = operator.attrgetter("name", "lining")


def _words(event: Event | None) -> str:
    if event is None:
        return "nothing more"
    lining = "" if event.lining is None else f" of lining {event.lining}"
    return f"{event.name}{lining} at {event.time:.9g} s"


def _in_pairs(
    a: list[Event], b: list[Event], brief: float
) -> tuple[list[tuple[Event, Event]], str]:
    """The same events of two runs, those of one name in the order of time; or where the
    runs differ first, in words.

    An event that rounding shows in one run alone, as a speed that passes 0 where it
    stops, is left out if the other run has any event within `brief` (s) of it.
    """
    a, b = _without_brief(a, b, brief), _without_brief(b, a, brief)
    if Counter(map(_named, a)) == Counter(map(_named, b)):
        others: dict[tuple[str, int | None], list[Event]] = {}
        for event in b:
            others.setdefault(_named(event), []).append(event)
        return [(event, others[_named(event)].pop(0)) for event in a], ""
    for i, (mine, theirs) in enumerate(itertools.zip_longest(a, b)):
        if mine is None or theirs is None or _named(mine) != _named(theirs):
            return (
                [],
                f"event {i + 1} is {_words(mine)} in this run, {_words(theirs)} in the second",
            )
    return [], ""


def _without_brief(a: list[Event], b: list[Event], brief: float) -> list[Event]:
    """The events `a` without those of a name that is more frequent than in `b`, where
    `b` has others alone."""
    more = Counter(map(_named, a)) - Counter(map(_named, b))

    def is_brief(event: Event) -> bool:
        near = [other for other in b if abs(other.time - event.time) <= brief]
        same = [other for other in near if _named(other) == _named(event)]
        return _named(event) in more and bool(near) and not same

    return [event for event in a if not is_brief(event)]


class Difference(NamedTuple):
    """How far two runs lie apart: the `error` of metrics, of times of events in the
    order of the log, and of states by kind; and why only metrics can be compared."""

    metrics: list[ErrorEstimate]
    events: list[ErrorEstimate]
    states: list[ErrorEstimate]
    problem: str = ""


def metrics_of_run(result: Result) -> dict[str, float | None]:
    """Metrics of a concrete result and its energies as `energy.…`; no residuals, which
    are no values of the run."""
    energies = {f"energy.{name}": float(value) for name, value in result.energy.items()}
    energies = {
        name: value for name, value in energies.items() if name not in RESIDUALS
    }
    metrics = {
        name: value
        for name, value in result.metrics.items()
        if f"energy.{name}" not in energies
    }
    times = {
        f"{name}_time": float(peak.time) for name, peak in result.report().peaks.items()
    }
    return {
        **metrics,
        **{
            k: v
            for k, v in times.items()
            if metrics.get(k.removesuffix("_time")) is not None
        },
        **energies,
    }


def difference(a: Result, b: Result) -> Difference:
    """How far two runs of one scene lie apart; states at the ends of the first one's
    steps and inside them."""
    mine = a.report()
    theirs = b.report()
    ours = metrics_of_run(a)
    others = metrics_of_run(b)
    metrics = []
    for name, value in ours.items():
        other = others.get(name)
        apart = None if value is None or other is None else abs(value - other)
        metrics.append(ErrorEstimate(name, about_output(name)["units"], value, apart))
    times = a.record.rows.t
    briefs = [share * float(times[int(a.record.count)] - times[0]) for share in _BRIEFS]
    pairs, problem = _in_pairs(mine.events, theirs.events, briefs[-1])
    segments = None if problem else _matched(mine.scan, theirs.scan, briefs)
    if segments is None:
        return Difference(
            metrics,
            [],
            [],
            problem or "between two events the modes of the runs differ",
        )
    events = [
        ErrorEstimate(x.name, "s", float(x.time), abs(x.time - y.time), lining=x.lining)
        for x, y in pairs
    ]
    return Difference(metrics, events, _of_states(mine.scan, theirs.scan, segments))


def _matched(
    a: Scan, b: Scan, briefs: list[float]
) -> list[tuple[Segment, Segment]] | None:
    for brief in briefs:
        mine = _segments(a, brief)
        theirs = _segments(b, brief)
        if [segment.mode for segment in mine] == [segment.mode for segment in theirs]:
            return list(zip(mine, theirs, strict=True))
    return None


def _of_states(
    a: Scan, b: Scan, segments: list[tuple[Segment, Segment]]
) -> list[ErrorEstimate]:
    pairs = []
    for mine, theirs in segments:
        # times that lie between the same events in both runs: after an event of one of
        # them alone, states may jump
        begin = max(a.steps.t0[mine.first], b.steps.t0[theirs.first])
        end = min(a.steps.t1[mine.last], b.steps.t1[theirs.last])
        if begin > end:
            continue
        t0 = a.steps.t0[mine.first : mine.last + 1, None]
        t1 = a.steps.t1[mine.first : mine.last + 1, None]
        times = np.unique(np.clip(np.append(t0 + _SHARES * (t1 - t0), end), begin, end))
        pairs.append((*_places(a, mine, times), *_places(b, theirs, times)))
    if not pairs:
        return []
    own, place, row, share = (
        np.concatenate(column) for column in zip(*pairs, strict=True)
    )
    some = np.unique(
        np.linspace(0, len(own) - 1, min(len(own), _INSTANTS)).round().astype(int)
    )
    own = own[some]
    place = place[some]
    row = row[some]
    share = share[some]
    t = a.steps.t0[own] + place * (a.steps.t1[own] - a.steps.t0[own])
    y = _states_at(a, own, place)
    other = _states_at(b, row, share)
    kinds = kinds_of(a.record)
    others = kinds_of(b.record)
    states = []
    finer = kinds != others
    for kind in dict.fromkeys(kinds):
        if kind.name in _OF_PHASES:
            continue
        u = y[:, [i for i, entry in enumerate(kinds) if entry == kind]]
        v = other[:, [i for i, entry in enumerate(others) if entry == kind]]
        if kind.name == "temperature":
            u = _node_temperatures(a, u)
            v = _node_temperatures(b, v)
        if kind.name == "temperature" and finer:
            v = merged(*(thermal_of(scan.record.system).heat for scan in (a, b)), v)  # pyright: ignore
            faces = (
                scan.look(*at).hot
                for scan, at in ((a, (own, place)), (b, (row, share)))
            )
            u, v = (
                np.column_stack([T, *hot.values()])
                for T, hot in zip((u, v), faces, strict=True)
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


def _places(
    scan: Scan, segment: Segment, times: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Rows and shares of their steps at times between the ends of a segment."""
    starts = scan.steps.t0[segment.first : segment.last + 1]
    row = segment.first + np.searchsorted(starts, times, side="right") - 1
    span = scan.steps.t1[row] - scan.steps.t0[row]
    # (the end of a segment is that of its last step that lasts)
    share = np.where(
        span > 0, (times - scan.steps.t0[row]) / np.where(span > 0, span, 1.0), 1.0
    )
    return row, np.clip(share, 0.0, 1.0)


def _states_at(scan: Scan, row: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Flat states at a share of the steps named; at their ends as recorded, not changed
    by rounding, but before the jump of the speed at a change of the rope's layer."""
    steps = scan.steps
    inside = (share > 0.0) & (share < 1.0)
    if scan.record.system.load.layers is not None:  # pyright: ignore
        inside = share > 0.0
    y = np.where(share[:, None] == 0.0, steps.y0[row], steps.y1[row])
    if inside.any():
        y[inside] = scan.states(row[inside], share[inside])[1]
    return y


def _node_temperatures(scan: Scan, u: np.ndarray) -> np.ndarray:
    # (in NumPy: a program would be compiled for this alone)
    thermal = jax.tree.map(np.asarray, thermal_of(scan.record.system))  # pyright: ignore
    return thermal.temperatures(u)


# --- the second run -----------------------------------------------------------------


def longest_step(record: Record) -> float:
    """Longest step (s) of the second run: such that it cuts the steps of the first, all
    but the shortest, in two."""
    h = np.diff(np.asarray(record.rows.t)[: int(record.count) + 1])
    h = h[h > 0]
    low = 0.0
    high = float(np.max(h, initial=0.0))
    for _ in range(60 if high else 0):
        middle = 0.5 * (low + high)
        low, high = (
            (low, middle)
            if np.sum(np.ceil(h / middle)) <= 2 * len(h)
            else (middle, high)
        )
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
    # it needs more of them than the first
    if limits.max_steps is not None and int(second.code) == Code.STEP_LIMIT:
        second = simulate(result.scene, **options)
    return second


def finer_run(result: Result, progress: Any = False) -> Result | None:
    """The same run with finer layers, and the method that fits them; `None` without
    walls."""
    if not result.scene.network.walls:
        return None
    scene = with_finer_layers(result.scene, cuts_of(result))
    limits = result.limits
    options: dict[str, Any] = {
        "max_step": float(limits.max_step),
        "max_events": int(limits.max_events),
    }
    return simulate(
        scene, rtol=float(result.rtol), throw=False, progress=progress, **options
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
        """Words behind an error that is mostly that of the layers of walls: often of
        the first instants of a heating, so that maxima are more exact."""
        if not state.is_of_layers:
            return ""
        maxima = [
            metric
            for metric in self.metrics
            if metric.name in HOT and metric.error is not None
        ]
        beside = (
            f"; maxima {_size(_worst(maxima).error, 'K')}"
            if state.unit == "K" and maxima
            else ""
        )
        return f" (by the layers of walls{beside})"

    @property
    def how(self) -> str:
        """From which runs."""
        longest = (
            f" and steps of at most {number(self.max_step, 's', count=3)}"
            if math.isfinite(self.max_step)
            else ""
        )
        again = f"a second run with rtol {digits(self.second_rtol, 2)}{longest}"
        finer = (
            f", and one with finer layers: {self.finer_steps} steps"
            if self.finer_steps
            else ""
        )
        return f"{again}: {self.second_steps} steps after {self.steps}{finer}"

    @property
    def line(self) -> str:
        """The estimate in one line."""
        if self.problem:
            return f"no estimate of the error: {self.problem}"
        phrases = (
            []
            if self.event_time is None
            else [f"event times {_size(self.event_time, 's')}"]
        )
        phrases += [
            f"{_KIND_WORDS[state.name]} {_size(state.error, state.unit)}{self._layers_of(state)}"
            for state in self.states
            if state.error
        ]
        without = (
            f"; not all have that of the layers of walls: {self.finer_problem}"
            if self.finer_problem
            else ""
        )
        return (
            f"estimated errors of at most: {', '.join(phrases) or 'nothing moves'}; "
            f"from {self.how}{without}"
        )

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

    def as_dict(self) -> Entry:
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


def _values(part: Any, *names: str, **more: Any) -> Entry:
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
    steps = int(result.record.stats.accepted)
    network = result.scene.network
    if not result.ok:
        why = f"the run ended early ({result.status}) and was not repeated"
        scope = _scope(network, "no estimate")
        return Accuracy(
            rtol, second_rtol(rtol), math.inf, steps, 0, 0.0, problem=why, scope=scope
        )
    start = time.perf_counter()
    second = second_run(result, progress)
    seconds = time.perf_counter() - start
    second_steps = int(second.record.stats.accepted)
    longest = min(longest_step(result.record), float(result.limits.max_step))
    estimate = functools.partial(
        Accuracy, rtol, second_rtol(rtol), longest, steps, second_steps, seconds
    )
    if not second.ok:
        why = f"the second run failed ({second.status}): {second.message}"
        return estimate(problem=why, scope=_scope(network, "no estimate"))
    apart = difference(result, second)
    if apart.problem:
        return estimate(problem=apart.problem, scope=_scope(network, "no estimate"))
    metrics, events, states = _estimates(result, apart)
    found = estimate(metrics, events, states, scope=_scope(network, ""))
    start = time.perf_counter()
    finer = finer_run(result, progress)
    if finer is None:
        return found
    cost: dict[str, Any] = {"finer_steps": int(finer.record.stats.accepted)}
    if finer.ok:
        found = _with_layers(found, difference(result, finer))
    else:
        why = f"the run with finer layers failed ({finer.status})"
        found = dataclasses.replace(
            found, finer_problem=why, scope=_scope(network, why)
        )
    return dataclasses.replace(found, **cost, finer_seconds=time.perf_counter() - start)


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


def _estimates(
    result: Result, apart: Difference
) -> Iterator[tuple[ErrorEstimate, ...]]:
    """Errors of metrics, events and states: how far two runs lie apart, and what
    rounding leaves."""
    steps = int(result.record.stats.accepted)
    scan = result.report().scan
    times_of_peaks = {
        f"{name}_time" for name, metric in METRICS.items() if metric.greatest
    }
    span = float(np.max(scan.steps.t1)) - float(np.min(scan.steps.t0))
    energy = max(
        (
            abs(estimate.value)
            for estimate in apart.metrics
            if estimate.name.startswith("energy.") and estimate.value
        ),
        default=0.0,
    )

    def with_rounding(estimate: ErrorEstimate, least: float = 0.0) -> ErrorEstimate:
        return estimate._replace(
            error=float(
                (estimate.error or 0.0)
                + rounding(steps, max(abs(estimate.value or 0.0), least))
            )
        )

    metrics = []
    for estimate in apart.metrics:
        # (what is 0 in both is no sum)
        if estimate.error is not None and (estimate.error or estimate.value):
            estimate = with_rounding(
                estimate, {"s": _INSTANT * span, "J": energy}.get(estimate.unit, 0.0)
            )
            if estimate.name in times_of_peaks:
                estimate = estimate._replace(
                    error=(estimate.error or 0.0)
                    + _root_of_rounding(scan, estimate.value or 0.0)
                )
        metrics.append(estimate)
    yield tuple(metrics)
    yield tuple(with_rounding(event, _INSTANT * span) for event in apart.events)
    yield tuple(map(with_rounding, apart.states))


def _root_of_rounding(scan: Scan, t: float) -> float:
    """How exactly the time of a maximum inside a step is known: over √ε of the step it
    changes by rounding alone."""
    steps = scan.steps
    row = int(
        np.clip(np.searchsorted(steps.t0, t, side="right") - 1, 0, len(steps.t0) - 1)
    )
    inside = steps.t0[row] < t < steps.t1[row]
    return math.sqrt(EPS) * float(steps.t1[row] - steps.t0[row]) if inside else 0.0
