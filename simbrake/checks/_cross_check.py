"""A scene run by simbrake and by SciPy, and the differences."""

import dataclasses
import itertools
import time
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Bool, Float, Int

from .._base._compiling import Compiled
from .._base._faults import Issues
from .._base._progress import shown_progress
from .._base._table import Table
from ..hybrid import Record
from ..hybrid.arrays import Array
from ..hybrid.system import ENDED
from ..outputs.log import Event
from ..outputs.metrics import marks
from ..parts.scene import Scene
from ..physics.heated import thermal_of
from ..physics.mechanism import Label, events_of_change, turned_since_rest
from ..runs.choice import stiffness
from ..runs.report import events_of_linings, friction_changes
from ..runs.result import Result
from ..runs.simulate import simulate
from ._validation import FAIL, PASS, AbstractChecks, Check, judged

#: a guard this near to 0 has been reached (guards are of order one)
_REACHED = 1e-11
#: a limit exceeded by no more than this is only touched
_EXCEEDED = 1e-12
#: the same as `_REACHED` for guards that are reached together with another one, as
#: SciPy's interpolant has them
_TOGETHER = 1e-10
#: minimum number of steps in a run: events are detected at the ends of steps only
_SLICES = 200
#: changes of mode at one instant
_CHAIN = 200
METHODS = ("DOP853", "RK45", "RK23", "Radau", "BDF", "LSODA")

FlatState: TypeAlias = Float[np.ndarray, " state"]
Fired: TypeAlias = Bool[np.ndarray, " guard"]

# --- the second integration ----------------------------------------------------------


class Change(NamedTuple):
    """A segment of a run: its first time, its mode (flat), and the angle of the
    pulley."""

    t: float
    mode: Int[np.ndarray, " mode"]
    angle: float


class Course:
    """The run of a record by SciPy, up to the time reached: `drive` takes it to its
    end.

    - `method` of `scipy.integrate.solve_ivp`
    - `rtol`: relative tolerance, absolute ones are `rtol` times the typical
      sizes of the states, and of `energy` (J) for ledgers
    - `most`: evaluations of the right-hand side allowed; a longer run ends there with a
      message
    - `report`: called with the time reached and the end time at every evaluation
    - `changes`: modes in order;  `t`, `y`: time reached, and the state there (flat)
    - `evaluations`, `seconds`: work done
    - `trouble`: empty, or why it ended before the end of the run
    """

    def __init__(
        self,
        record: Record,
        method: str,
        rtol: float,
        most: int,
        energy: float,
        report: Callable[[float, float], None],
    ) -> None:
        sizes = _sizes(record)
        self.report = report
        self.method = method
        self.rtol = rtol
        self.most = most
        self.atol = rtol * np.where(np.isfinite(sizes), sizes, energy)
        self.t = float(record.rows.t[0])
        self.t1 = float(record.t1)
        self.y = np.asarray(record.rows.y[0])
        self.mode = np.asarray(record.rows.mode[0], np.int32)
        self.changes = [Change(self.t, self.mode, float(self.y[0]))]
        self.evaluations = 0
        self.seconds = 0.0
        self.trouble = ""
        self._chain = 0
        self.max_step = (self.t1 - self.t) / _SLICES
        flat = record.flat

        def of_mode(
            function: Callable[[Array, Array, Array], Array],
        ) -> Callable[[float, FlatState], np.ndarray]:
            program = Compiled(function)
            return lambda t, y: np.asarray(program(t, y, self.mode))

        self._rhs = of_mode(lambda t, y, mode: flat.rhs(t, y, mode))
        self.guards = of_mode(lambda t, y, mode: flat.guards(t, y, mode))
        self.rates = of_mode(lambda t, y, mode: flat.rates(t, y, mode)[1])
        self.limits = of_mode(lambda t, y, mode: flat.rates_and_guards(t, y, mode)[3])
        self.jacobian = of_mode(
            lambda t, y, mode: jax.jacfwd(flat.rhs, argnums=1)(t, y, mode)
        )
        self._jump = Compiled(lambda *event: flat.jump(*event))
        self._next_stop = Compiled(lambda mode, y: flat.next_stop(mode, y))
        # compiled before the time is taken
        for function in (self._rhs, self.guards, self.rates):
            function(self.t, self.y)

    def rhs(self, t: float, y: FlatState) -> FlatState:
        self.evaluations += 1
        if self.evaluations > self.most:
            words = f"{self.most} evaluations of the right-hand side were not enough"
            raise RuntimeError(f"{words} (t = {self.t:.6g} s was reached)")
        self.report(t, self.t1)
        return self._rhs(t, y)

    def jump(self, fired: Fired, at_stop: bool) -> None:
        """Change the mode at this instant."""
        y, after, code = self._jump(
            self.t, self.y, self.mode, fired, np.asarray(at_stop)
        )
        if int(code) == ENDED:
            self.t1 = self.t
        elif int(code) != 0:
            raise RuntimeError(f"the system ended the run with code {int(code)}")
        self.y = np.asarray(y)
        self.mode = np.asarray(after, np.int32)
        self._chain = self._chain + 1 if self.changes[-1].t == self.t else 0
        self.changes.append(Change(self.t, self.mode, float(self.y[0])))
        if self._chain > _CHAIN:
            raise RuntimeError("too many changes of mode at one instant")

    def sinking(self, span: float) -> Fired:
        """The lowest of the guards that are negative or fall from 0."""
        g = self.guards(self.t, self.y)
        rate = self.rates(self.t, self.y)
        below = (g < -_REACHED) & ((rate <= 0) | (g < -1e3 * _REACHED))
        falls = (g <= _REACHED) & (rate * span < -1e3 * _REACHED)
        fired = np.zeros(len(g), bool)
        if np.any(below | falls):
            fired[np.argmin(np.where(below | falls, g, np.inf))] = True
        return fired

    def advance(self, until: float) -> tuple[Fired, bool]:
        """Integrate to the first guard or to `until`; guards that fired, and whether
        `until` was reached."""
        # a slow import, needed by cross-checks only
        from scipy.integrate import solve_ivp

        armed = self.guards(self.t, self.y) > _REACHED
        limits = self.limits(self.t, self.y)
        # a guard that starts at 0 counts once it has gone negative from there, a limit
        # once it is exceeded
        offset = np.where(armed, np.where(limits, _EXCEEDED, 0.0), 2 * _REACHED)

        def lowest(t: float, y: FlatState) -> float:
            return float(np.min(self.guards(t, y) + offset))

        lowest.terminal = True
        lowest.direction = -1
        more: dict[str, Any] = (
            {"jac": self.jacobian} if self.method in ("Radau", "BDF", "LSODA") else {}
        )
        out = solve_ivp(
            self.rhs,
            (self.t, until),
            self.y,
            self.method,
            events=lowest,
            rtol=self.rtol,
            atol=self.atol,
            max_step=self.max_step,
            **more,
        )
        if out.status < 0:
            raise RuntimeError(f"SciPy: {out.message}")
        self.t = float(out.t[-1])
        self.y = np.asarray(out.y[:, -1])
        g = self.guards(self.t, self.y) + offset
        landed = out.status == 1
        fired = armed & (g <= _TOGETHER) & (landed | ~limits)
        if landed:
            fired[np.argmin(g)] = True
        return fired, not landed

    def drive(self) -> None:
        """Integrate to the end, or to what ends it early."""
        start = time.perf_counter()
        try:
            while self.t < self.t1:
                until = min(float(self._next_stop(self.mode, self.y)), self.t1)
                fired = self.sinking(max(until - self.t, self.max_step))
                reached = not np.any(fired)
                if reached and until > self.t:
                    fired, reached = self.advance(until)
                    if reached and until >= self.t1:
                        break
                self.jump(fired, reached)
        except RuntimeError as problem:
            self.trouble = str(problem)
        self.seconds = time.perf_counter() - start


def _sizes(record: Record) -> FlatState:
    """Typical sizes of the states."""
    like = jax.tree.map(
        lambda size, leaf: np.broadcast_to(size, np.shape(leaf)),
        record.system.scales(),
        record.y_like,
    )
    return np.asarray(ravel_pytree(like)[0])


# --- the report ---------------------------------------------------------------------

#: lines of the table after which events that agree are left out
_ROWS = 24
SCOPE = (
    "Checked: integration, location of events and changes of mode, by another "
    "integrator that shares equations, guards "
    "and jumps with simbrake.\nNot checked: the physics in these equations (`simbrake "
    "validate` does that), limits of "
    "single linings and other thresholds that are only logged, maxima."
)


@dataclasses.dataclass(frozen=True, repr=False)
class CrossCheck(AbstractChecks):
    """Quantities of both runs as checks, `value` simbrake's and `truth` SciPy's;
    printing it shows the table.

    - `first_difference`: where the changes of mode differ for the first time, in words,
      or empty
    - `trouble`: reason for an incomplete run of SciPy, or empty
    - `seconds`: of a warm run of simbrake and of SciPy's
    - `evaluations` of the right-hand side by SciPy

    Example:
        >>> found = sb.cross_check(scene, result=result)
        >>> found.ok, found.method
        (True, 'DOP853')
    """

    method: str
    first_difference: str
    trouble: str
    seconds: tuple[float, float]
    evaluations: int

    @property
    def ok(self) -> bool:
        """Whether both runs are complete and agree in all compared quantities."""
        return not self.trouble and not self.failed

    def parts(self) -> Iterator[str | Table]:
        """The table, of many events the first ones and all that differ; then time,
        verdict and scope."""
        shown = [
            c
            for i, c in enumerate(self)
            if i < _ROWS or c.verdict != PASS or not c.case[0].isdigit()
        ]
        yield from self.table(shown, "SciPy")
        if len(shown) < len(self):
            yield f"({len(self) - len(shown)} more events that agree are left out)"
        ours, theirs = self.seconds
        ratio = f", {theirs / ours:.3g} times as long" if ours > 0 else ""
        yield ""
        yield (
            f"time     simbrake {1e3 * ours:.3g} ms (compiled), SciPy "
            f"{1e3 * theirs:.3g} ms{ratio}; "
            f"{self.evaluations} evaluations of a compiled right-hand side by {self.method}"
        )
        yield f"verdict  {len(self) - len(self.failed)} of {len(self)} quantities agree"
        if self.first_difference:
            yield f"modes    differ first {self.first_difference}"
        if self.trouble:
            yield f"SciPy    ended early: {self.trouble}"
        yield SCOPE


# --- compared quantities ------------------------------------------------------------

#: name, simbrake's value, SciPy's, and the reference of the difference
_Compared: TypeAlias = tuple[str, float, float, float]
#: logged thresholds that change no mode, beside marks
_LIMITS = ("lining_limit", "self_locking")
#: time (s) from turning round to rest in one stop
_AT_ONCE = 1e-6
#: maximum number of thermal nodes with a line each
_NODES = 12
#: states of the mechanisms
_WORDS = {
    "phi": "angle (rad)",
    "omega": "speed (rad/s)",
    "x": "elongation (m)",
    "omega_b": "bandage speed (rad/s)",
    "e": "segment elongation (m)",
    "v": "lining speed (m/s)",
    "stretch": "spring elongation (m)",
    "speeds": "lining speed (rad/s)",
    "begun": "start of the phase (s)",
    "turned": "angle in the phase (rad)",
    "onset": "start of a change of friction (s)",
}


def _scipy_events(result: Result, course: Course) -> list[Event]:
    """Changes of SciPy's run in the words of the event log."""
    unpack = result.record.flat.unpack_mode
    modes: list[Any] = [
        jax.tree.map(np.asarray, unpack(jnp.asarray(change.mode)))
        for change in course.changes
    ]
    times = [change.t for change in course.changes]
    labels = [Label(*(int(column) for column in mode.label)) for mode in modes]
    # the first mode is where the run starts to look for the true one
    first = 1 if len(modes) > 1 and times[1] == times[0] and labels[0].band == 0 else 0
    events = []
    before = labels[0]
    turned = turned_since_rest(labels, [change.angle for change in course.changes])
    for i in range(first, len(modes)):
        stopped = result.record.system.rests_open and turned[i]  # pyright: ignore
        events += [
            Event(times[i], name)
            for name in events_of_change(before, labels[i], i == first, stopped)
        ]
        before = labels[i]
    stops = [event.time for event in events if event.name == "stop"]
    # (one that turns round as it comes to rest has only stopped, in the log too)
    events = [
        e
        for e in events
        if e.name != "reversal" or not any(0 <= t - e.time < _AT_ONCE for t in stops)
    ]
    columns = jax.tree.map(lambda *each: np.stack(each), *modes)
    if columns.phase is not None:
        events += [
            Event(times[i + 1], "phase_end")
            for i in np.flatnonzero(np.diff(columns.phase))
        ]
    return [
        *events,
        *friction_changes(columns, times),
        *events_of_linings(columns, times),
    ]


def _ordered(events: list[Event], near: float) -> list[Event]:
    """Events in order of time; those of one instant by name, as their order there is a
    convention."""
    by_time = sorted(events, key=lambda e: e.time)
    groups = []
    for event in by_time:
        if groups and event.time - groups[-1][-1].time <= near:
            groups[-1].append(event)
        else:
            groups.append([event])
    return [
        e
        for group in groups
        for e in sorted(group, key=lambda e: (e.name, e.lining or 0))
    ]


def _words(event: Event) -> str:
    return (
        event.name if event.lining is None else f"{event.name} of lining {event.lining}"
    )


def _difference(ours: list[Event], theirs: list[Event]) -> tuple[int, str]:
    """Number of changes in the same order in both, and place of the first different
    one."""

    def label(event: Event | None) -> str:
        return (
            "nothing more"
            if event is None
            else f"{_words(event)} at {event.time:.12g} s"
        )

    for i, (a, b) in enumerate(itertools.zip_longest(ours, theirs)):
        if a is None or b is None or (a.name, a.lining) != (b.name, b.lining):
            return i, f"at change {i + 1}: simbrake has {label(a)}, SciPy {label(b)}"
    return len(ours), ""


def _compared_times(
    ours: list[Event], theirs: list[Event], same: int, span: float
) -> Iterator[_Compared]:
    stops = [
        next((e.time for e in events if e.name == "stop"), None)
        for events in (ours, theirs)
    ]
    if stops[0] is not None and stops[1] is not None:
        yield "stopping time (s)", stops[0], stops[1], max(abs(stops[1]), 1e-3 * span)
    for i, (a, b) in enumerate(itertools.islice(zip(ours, theirs, strict=False), same)):
        yield f"{i + 1} {_words(a)} (s)", a.time, b.time, max(abs(b.time), 1e-3 * span)


def _labels(result: Result) -> list[tuple[str, str]]:
    """Name and kind of every entry of the flat state."""
    labels = []
    nodes = iter(result.nodes)
    pairs = result.record.system.pair_names  # pyright: ignore
    for path, leaf in jax.tree_util.tree_leaves_with_path(result.record.y_like):
        names = [str(getattr(key, "name", key)) for key in path]
        kind = (
            "energy"
            if "ledger" in names
            else "heat"
            if names[0] == "heat"
            else "motion"
        )
        for i in range(np.size(leaf)):
            if kind == "heat":
                word = f"temperature {next(nodes)} (K)"
            elif "friction" in names:
                word = (
                    "friction heat (J)"
                    if len(pairs) == 1
                    else f"{pairs[path[-1].idx]} heat (J)"
                )
            elif kind == "energy":
                word = (
                    " ".join(names[1:])
                    .replace("_", " ")
                    .replace("heat lost", "heat: lost")
                    + " (J)"
                )
            else:
                own = names[-1] if names[0] in ("own", "phase") else names[0]
                word = _WORDS.get(own, own) + (f" {i + 1}" if np.ndim(leaf) else "")
            labels.append((word, kind))
    return labels


def _compared_ends(result: Result, y: FlatState) -> Iterator[_Compared]:
    """Final states by name; of many thermal nodes the one with the maximum
    difference."""
    record = result.record
    labels = _labels(result)
    start = np.array(record.rows.y[0])
    ours = np.array(record.rows.y[record.count])
    theirs = np.array(y)
    energies, nodes = (
        [i for i, label in enumerate(labels) if label[1] == kind]
        for kind in ("energy", "heat")
    )
    size = np.maximum(np.abs(theirs), _sizes(record))
    largest = max((abs(ours[i]) for i in energies), default=1.0)
    size[energies] = np.maximum(np.abs(theirs[energies]), max(1e-3 * largest, 1e-12))
    worst = None
    more = ""
    if nodes:
        # of the warming, not from 0 K
        size[nodes] = max(1.0, float(np.max(np.abs(ours[nodes] - start[nodes]))))
        thermal: Any = thermal_of(record.system)  # pyright: ignore
        for state in (ours, theirs):
            state[nodes] = thermal.temperatures(state[nodes])
        if len(nodes) > _NODES:
            worst = nodes[int(np.argmax(np.abs(ours - theirs)[nodes]))]
            more = f", most different of {len(nodes)}"
    for i, (name, kind) in enumerate(labels):
        if kind != "heat" or worst in (None, i):
            yield (
                f"end: {name}{more if kind == 'heat' else ''}",
                float(ours[i]),
                float(theirs[i]),
                float(size[i]),
            )


def cross_check(
    scene: Scene,
    *,
    method: str | None = None,
    rtol: float = 1e-10,
    tolerance: float | None = None,
    max_evaluations: int = 400_000,
    result: Result | None = None,
    progress: bool | None = False,
) -> CrossCheck:
    """Repeat a scene with SciPy and compare: changes of mode, times of events, state
    and energies at the end.

        print(simbrake.cross_check(scene))

    - `method` of `scipy.integrate.solve_ivp`; by default `DOP853`, and `Radau` where
      simbrake's choice is stiff as well
    - `rtol`: relative tolerance of both runs
    - `tolerance`: of the relative differences, by default `100 rtol`; relative to the
      quantity, or to the typical size of its kind where that is more (speeds, the
      largest energy, the maximum warming)
    - `max_evaluations` of the right-hand side by SciPy: a longer run ends there, is
      named in `trouble`, and is not `ok`
    - `result`: of the scene, to be checked in place of a new run

    SciPy integrates the same equations from event to event and locates every event
    itself; modes are switched in Python. So it checks integration and events, not the
    physics (see `validate`).

    Raises `InputError` with all errors of scene and options, `SimulationError` where
    the run of simbrake fails.
    """
    faults = Issues()
    if method is not None and method not in METHODS:
        faults.add("method", f"SciPy has no {method!r}", f"one of {', '.join(METHODS)}")
    if not 1e-13 <= rtol < 0.1:
        faults.add("rtol", f"{rtol} is out of range", "1e-13 ≤ rtol < 0.1")
    if max_evaluations < 1:
        faults.add(
            "max_evaluations", f"{max_evaluations} is out of range", "at least 1"
        )
    faults.report()
    with shown_progress(progress, "cross-check", "compiling…") as shown:
        fresh = simulate(scene, rtol=rtol, progress=shown) if result is None else result
        start = time.perf_counter()
        again = simulate(scene, rtol=rtol)
        own_seconds = time.perf_counter() - start
        method = method or ("Radau" if stiffness(scene)[0] else "DOP853")
        shown.now(f"compiling for SciPy {method}")
        system: Any = again.record.system
        course = Course(
            again.record,
            method,
            rtol,
            max_evaluations,
            float(system.sizes.torque),
            shown.reach,
        )
        course.drive()
    source = f"SciPy {method}"
    allowed = 100 * rtol if tolerance is None else tolerance
    span = float(scene.end_time) - float(scene.initial.time)
    passed = {*_LIMITS, *(mark.event for mark in marks())}
    own = [event for event in fresh.events if event.name not in passed]
    if course.trouble:
        own = [event for event in own if event.time <= course.t]
    ours, theirs = (
        _ordered(events, 1e-9 * span) for events in (own, _scipy_events(again, course))
    )
    same, difference = _difference(ours, theirs)
    verdict = FAIL if difference else PASS
    checks = [
        Check(
            "changes of mode",
            source,
            float(same),
            float(len(theirs)),
            difference or 0.0,
            0.0,
            verdict,
        )
    ]
    pairs = itertools.chain(
        _compared_times(ours, theirs, same, span),
        () if course.trouble else _compared_ends(fresh, course.y),
    )
    checks += [judged(name, source, a, b, allowed, size) for name, a, b, size in pairs]
    if course.trouble:
        checks.append(
            Check("end of the run", source, None, span, course.trouble, allowed, FAIL)
        )
    seconds = (own_seconds, course.seconds)
    return CrossCheck(
        checks, method, difference, course.trouble, seconds, course.evaluations
    )
