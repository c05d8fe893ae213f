"""A scene run twice, by simbrake and by SciPy, and what differs between the two."""

import itertools
import math
import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree

from .._base._compiling import DeviceJit
from .._base._faults import Fault, InputError
from .._base._progress import waiting
from .._parts._scene import Scene
from .._physics._mechanism import Label, events_of_change
from .._run._choice import stiffness
from .._run._result import Result
from .._run._simulate import simulate
from ..hybrid import Record
from ._validation import FAIL, PASS, AbstractChecks, Check

#: a guard this near to 0 has been reached (guards are of order one)
_REACHED = 1e-11
#: the same for guards that are reached together with another one, as SciPy's interpolant has them
_TOGETHER = 1e-10
#: least number of steps in a run: events are looked for at the ends of steps only
_SLICES = 200
#: changes of mode at one instant
_CHAIN = 200
METHODS = ("DOP853", "RK45", "RK23", "Radau", "BDF", "LSODA")


class Change(NamedTuple):
    """A segment of a run: its first time and its mode (flat)."""

    t: float
    mode: np.ndarray


class Course(NamedTuple):
    """What `drive` found: modes in order, time and state (flat) at the end, and the work.

    `trouble`: empty, or why it ended before the end of the run.
    """

    changes: list[Change]
    t: float
    y: np.ndarray
    evaluations: int
    seconds: float
    trouble: str


class _LimitError(Exception):
    """The work allowed was used up."""


class _Compiled(NamedTuple):
    """The system's functions on flat vectors, compiled, of one record."""

    rhs: Callable[..., Any]
    guards: Callable[..., Any]
    rates: Callable[..., Any]
    jacobian: Callable[..., Any]
    jump: Callable[..., Any]
    next_stop: Callable[..., Any]


def _compiled(record: Record) -> _Compiled:
    flat = record.flat
    return _Compiled(
        rhs=DeviceJit(lambda t, y, mode: flat.rhs(t, y, mode)),
        guards=DeviceJit(lambda t, y, mode: flat.guards(t, y, mode)),
        rates=DeviceJit(lambda t, y, mode: flat.rates(t, y, mode)[1]),
        jacobian=DeviceJit(lambda t, y, mode: jax.jacfwd(flat.rhs, argnums=1)(t, y, mode)),
        jump=DeviceJit(lambda *event: flat.jump(*event)),
        next_stop=DeviceJit(lambda mode: flat.next_stop(mode)),
    )


class _Run:
    """One run in progress."""

    def __init__(self, record: Record, method: str, rtol: float, atol: np.ndarray, most: int, tell: Any):
        self.tell = tell
        self.do, self.method, self.rtol, self.atol, self.most = _compiled(record), method, rtol, atol, most
        self.t, self.t1 = float(record.rows.t[0]), float(record.t1)
        self.y, self.mode = np.asarray(record.rows.y[0]), np.asarray(record.rows.mode[0], np.int32)
        self.changes = [Change(self.t, self.mode)]
        self.evaluations, self._chain = 0, 0
        self.max_step = (self.t1 - self.t) / _SLICES

    def rhs(self, t: float, y: np.ndarray) -> np.ndarray:
        self.evaluations += 1
        if self.evaluations > self.most:
            raise _LimitError
        self.tell(t, self.t1)
        return np.asarray(self.do.rhs(t, y, self.mode))

    def jump(self, fired: np.ndarray, at_stop: bool) -> str:
        """Changes the mode at this instant; what went wrong, or nothing."""
        y, after, code = self.do.jump(self.t, self.y, self.mode, fired, np.asarray(at_stop))
        if int(code) != 0:
            return f"the system ended the run with code {int(code)}"
        self.y, self.mode = np.asarray(y), np.asarray(after, np.int32)
        self._chain = self._chain + 1 if self.changes[-1].t == self.t else 0
        self.changes.append(Change(self.t, self.mode))
        return "the modes change again and again at one instant" if self._chain > _CHAIN else ""

    def sinking(self, span: float) -> np.ndarray:
        """Of the guards that are negative already or fall from 0 now, the lowest."""
        g = np.asarray(self.do.guards(self.t, self.y, self.mode))
        rate = np.asarray(self.do.rates(self.t, self.y, self.mode))
        below = (g < -_REACHED) & ((rate <= 0) | (g < -1e3 * _REACHED))
        falls = (g <= _REACHED) & (rate * span < -1e3 * _REACHED)
        found = np.zeros(len(g), bool)
        if np.any(below | falls):
            found[np.argmin(np.where(below | falls, g, np.inf))] = True
        return found

    def advance(self, until: float) -> tuple[np.ndarray, bool]:
        """Integrates to the first guard or to `until`; guards that fired, and whether `until` was reached."""
        from scipy.integrate import solve_ivp  # half a second that only a cross-check pays

        start = np.asarray(self.do.guards(self.t, self.y, self.mode))
        armed = start > _REACHED
        # a guard that starts at 0 counts once it has gone negative from there
        offset = np.where(armed, 0.0, 2 * _REACHED)

        def lowest(t: float, y: np.ndarray) -> float:
            return float(np.min(np.asarray(self.do.guards(t, y, self.mode)) + offset))

        lowest.terminal, lowest.direction = True, -1  # pyright: ignore
        more: dict[str, Any] = {"jac": lambda t, y: np.asarray(self.do.jacobian(t, y, self.mode))}
        out = solve_ivp(
            self.rhs,
            (self.t, until),
            self.y,
            self.method,
            events=lowest,
            rtol=self.rtol,
            atol=self.atol,
            max_step=self.max_step,
            **(more if self.method in ("Radau", "BDF", "LSODA") else {}),
        )
        if out.status < 0:
            raise RuntimeError(f"SciPy: {out.message}")
        self.t, self.y = float(out.t[-1]), np.asarray(out.y[:, -1])
        g = np.asarray(self.do.guards(self.t, self.y, self.mode)) + offset
        landed = out.status == 1
        fired = armed & (g <= _TOGETHER)
        if landed:
            fired[np.argmin(g)] = True
        return fired, not landed

    def run(self) -> str:
        """To the end; what stopped it before, or nothing."""
        while self.t < self.t1:
            until = min(float(self.do.next_stop(self.mode)), self.t1)
            fired = self.sinking(max(until - self.t, self.max_step))
            if np.any(fired):
                trouble = self.jump(fired, False)
            elif until <= self.t:
                trouble = self.jump(fired, True)
            else:
                fired, reached = self.advance(until)
                if reached and until >= self.t1:
                    return ""
                trouble = self.jump(fired, reached)
            if trouble:
                return trouble
        return ""


def drive(
    record: Record,
    method: str = "DOP853",
    rtol: float = 1e-10,
    most: int = 400_000,
    energy: float = 1.0,
    tell: Callable[[float, float], Any] = lambda t, end: None,
) -> Course:
    """Repeats the run of a record with SciPy.

    - `method` of `scipy.integrate.solve_ivp`;  `rtol`: relative tolerance, absolute ones are `rtol` times the typical
      sizes of the states, and of `energy` (J) for ledgers
    - `most`: evaluations of the right-hand side allowed; a longer run ends there, and says so
    - `tell`: called with the time reached and the end time at every evaluation

    Compiling is not counted in `seconds`: the first few evaluations are made before.
    """
    like = jax.tree.map(lambda size, leaf: np.broadcast_to(size, np.shape(leaf)), record.system.scales(), record.y_like)
    sizes = np.asarray(ravel_pytree(like)[0])
    atol = rtol * np.where(np.isfinite(sizes), sizes, energy)
    run = _Run(record, method, rtol, atol, most, tell)
    for function in (run.do.rhs, run.do.guards, run.do.rates):
        function(run.t, run.y, run.mode)
    start = time.perf_counter()
    try:
        trouble = run.run()
    except _LimitError:
        trouble = f"{most} evaluations of the right-hand side were not enough (t = {run.t:.6g} s was reached)"
    except RuntimeError as problem:
        trouble = str(problem)
    seconds = time.perf_counter() - start
    return Course(run.changes, run.t, run.y, run.evaluations, seconds, trouble)


# --- the cross-check --------------------------------------------------------------------------------------------------

_CHANGES = {
    *("slip_onset", "full_slip", "stop", "restick", "restart", "release"),
    *("internal_slip", "internal_restick", "external_lock", "external_release"),
}
#: thermal nodes up to which each has its own line
_NODES = 12
#: lines of the table after which events that agree are left out
_ROWS = 24
SCOPE = (
    "Checked: integration, location of events and changes of mode, by another integrator that shares equations, guards "
    "and jumps with simbrake.\nNot checked: the physics in these equations (`simbrake validate` does that), limits of "
    "single linings and other marks that are only passed, greatest values."
)


class CrossCheck(AbstractChecks):
    """Quantities of both runs as checks, `value` simbrake's and `truth` SciPy's; printing it shows the table.

    - `first_difference`: where the changes of mode differ for the first time, in words, or empty
    - `trouble`: why SciPy's run is not whole, or empty
    - `seconds`: of a warm run of simbrake and of SciPy's;  `evaluations` of the right-hand side by SciPy
    """

    def __init__(self, checks: Any, course: Course, method: str, difference: str, seconds: tuple[float, float]):
        self.checks, self.method = tuple(checks), method
        self.first_difference, self.trouble = difference, course.trouble
        self.seconds, self.evaluations = seconds, course.evaluations

    @property
    def ok(self) -> bool:
        """Whether both runs are whole and agree in everything compared."""
        return not self.trouble and not self.failed

    def __str__(self) -> str:
        ours, theirs = self.seconds
        ratio = f", {theirs / ours:.3g} times as long" if ours > 0 else ""
        lines = [
            _table(self.checks),
            "",
            f"time     simbrake {1e3 * ours:.3g} ms (compiled), SciPy {1e3 * theirs:.3g} ms{ratio}; "
            f"{self.evaluations} evaluations of a compiled right-hand side by {self.method}",
            f"verdict  {len(self) - len(self.failed)} of {len(self)} quantities agree",
        ]
        if self.first_difference:
            lines.append(f"modes    differ first {self.first_difference}")
        if self.trouble:
            lines.append(f"SciPy    ended early: {self.trouble}")
        return "\n".join([*lines, SCOPE])

    __repr__ = __str__


def _table(checks: Sequence[Check]) -> str:
    """Checks as text; of many events the first ones, and all that differ."""
    head = f"{'quantity':34} {'simbrake':>22} {'SciPy':>22} {'difference':>11} {'relative':>9} {'allowed':>8}  verdict"
    lines, left_out = [head], 0
    for i, c in enumerate(checks):
        if i >= _ROWS and c.verdict == PASS and c.case[0].isdigit():
            left_out += 1
            continue
        if isinstance(c.error, str) or c.value is None:
            lines += [f"{c.case:34} {'—':>22} {'—':>22} {'—':>11} {'—':>9} {'—':>8}  {c.verdict}", f"    {c.error}"]
            continue
        lines.append(
            f"{c.case:34} {c.value:>22.15g} {c.truth:>22.15g} {c.value - c.truth:>11.1e} {c.error:>9.1e} "
            f"{c.tolerance:>8.0e}  {c.verdict}"
        )
    return "\n".join([*lines, f"({left_out} more events that agree are left out)"] if left_out else lines)


class _Named(NamedTuple):
    """One change in the log of a run."""

    time: float
    name: str
    lining: int | None

    def __str__(self) -> str:
        return self.name if self.lining is None else f"{self.name} of lining {self.lining}"


def _scipy_events(result: Result, course: Course) -> list[_Named]:
    """Changes of SciPy's run in the words of the event log."""
    unpack = result.record.flat.unpack_mode
    modes: list[Any] = [jax.tree.map(np.asarray, unpack(jnp.asarray(change.mode))) for change in course.changes]
    times = [change.t for change in course.changes]
    labels = [Label(int(mode.band), int(mode.slides)) for mode in modes]
    # the first mode is where the run starts to look for the true one
    first = 1 if len(modes) > 1 and times[1] == times[0] and labels[0].band == 0 else 0
    found, before = [], labels[0]
    for i in range(first, len(modes)):
        found += [_Named(times[i], name, None) for name in events_of_change(before, labels[i], i == first)]
        before = labels[i]
    for (was, now), t in zip(itertools.pairwise(modes), times[1:], strict=True):
        for kind, column in now.contacts.items():
            for lining in np.flatnonzero(np.asarray(column) != np.asarray(was.contacts[kind])):
                what = "stick" if np.asarray(column)[lining] == 0 else "slip"
                found.append(_Named(t, f"{kind}_{what}", int(lining) + 1))
    return found


def _own_events(result: Result) -> list[_Named]:
    kinds = list(jax.tree.map(np.asarray, result.record.mode_end).contacts)
    names = {*_CHANGES, *(f"{kind}_{what}" for kind in kinds for what in ("stick", "slip"))}
    return [_Named(float(e.time), e.name, e.lining) for e in result.events if e.name in names]


def _ordered(events: list[_Named], near: float) -> list[_Named]:
    """Events in order of time; those of one instant by name, as their order there is a convention."""
    by_time, groups = sorted(events, key=lambda e: e.time), []
    for event in by_time:
        if groups and event.time - groups[-1][-1].time <= near:
            groups[-1].append(event)
        else:
            groups.append([event])
    return [e for group in groups for e in sorted(group, key=lambda e: (e.name, e.lining or 0))]


def _difference(ours: list[_Named], theirs: list[_Named]) -> tuple[int, str]:
    """How many changes come in the same order in both, and where the first other one is."""

    def said(events: list[_Named], i: int) -> str:
        return f"{events[i]} at {events[i].time:.12g} s" if i < len(events) else "nothing more"

    for i in range(max(len(ours), len(theirs))):
        a, b = ours[i : i + 1], theirs[i : i + 1]
        if not a or not b or (a[0].name, a[0].lining) != (b[0].name, b[0].lining):
            return i, f"at change {i + 1}: simbrake has {said(ours, i)}, SciPy {said(theirs, i)}"
    return len(ours), ""


class _Compared:
    """Collects checks; an error is a difference over the size of what is compared."""

    def __init__(self, source: str, tolerance: float):
        self.source, self.tolerance, self.checks = source, tolerance, []

    def add(self, name: str, ours: Any, theirs: Any, size: float, over: float | None = None) -> None:
        """`size`: the least that the difference is taken over, in place of a smaller truth; `over`: in its place."""
        ours, theirs = float(ours), float(theirs)
        error = abs(ours - theirs) / (over or max(abs(theirs), size))
        verdict = PASS if error <= self.tolerance else FAIL
        if not math.isfinite(error):
            self.checks.append(Check(name, self.source, None, theirs, f"{ours} beside {theirs}", self.tolerance, FAIL))
        else:
            self.checks.append(Check(name, self.source, ours, theirs, error, self.tolerance, verdict))


def _compare_events(found: _Compared, ours: list[_Named], theirs: list[_Named], span: float, difference: str) -> None:
    same, _ = _difference(ours, theirs)
    error: float | str = difference or 0.0
    found.checks.append(
        Check(
            "changes of mode", found.source, float(same), float(len(theirs)), error, 0.0, FAIL if difference else PASS
        )
    )
    stops = [next((e.time for e in events if e.name == "stop"), None) for events in (ours, theirs)]
    if stops[0] is not None and stops[1] is not None:
        found.add("stopping time (s)", stops[0], stops[1], 1e-3 * span)
    for i in range(same):
        found.add(f"{i + 1} {ours[i]} (s)", ours[i].time, theirs[i].time, 1e-3 * span)


def _labels(result: Result) -> list[tuple[str, str]]:
    """Name and kind of every entry of the flat state."""
    found = []
    words = {"phi": "angle (rad)", "omega": "speed (rad/s)", "x": "elongation (m)", "omega_b": "bandage speed (rad/s)"}
    words |= {"e": "segment elongation (m)", "v": "lining speed (m/s)"}
    words |= {"stretch": "spring elongation (m)", "speeds": "lining speed (rad/s)"}
    nodes, system = result.nodes, result.record.system
    pairs = system.pair_names  # pyright: ignore
    for path, leaf in jax.tree_util.tree_leaves_with_path(result.record.y_like):
        names = [str(getattr(key, "name", key)) for key in path]
        kind = "energy" if "ledger" in names else "heat" if names[0] == "heat" else "motion"
        for i in range(np.size(leaf)):
            if kind == "heat":
                word = f"temperature {nodes[i]} (K)"
            elif "friction" in names:
                word = "friction heat (J)" if len(pairs) == 1 else f"{pairs[path[-1].idx]} heat (J)"
            elif kind == "energy":
                word = " ".join(names[1:]).replace("_", " ").replace("heat lost", "heat: lost") + " (J)"
            else:
                own = names[-1] if names[0] == "own" else names[0]
                word = words.get(own, own) + (f" {i + 1}" if np.ndim(leaf) else "")
            found.append((word, kind))
    return found


def _compare_ends(found: _Compared, result: Result, y: np.ndarray) -> None:
    """Final states by name; of many thermal nodes the one with the greatest difference."""
    record, system = result.record, result.record.system
    end = np.asarray(record.rows.y[record.count])
    like = jax.tree.map(lambda size, leaf: np.broadcast_to(size, np.shape(leaf)), system.scales(), record.y_like)
    sizes = np.asarray(ravel_pytree(like)[0])
    labels = _labels(result)
    energies = [i for i, (_, kind) in enumerate(labels) if kind == "energy"]
    largest = max((abs(end[i]) for i in energies), default=1.0)
    nodes = [i for i, (_, kind) in enumerate(labels) if kind == "heat"]
    if nodes:
        thermal: Any = system.thermal  # pyright: ignore
        start = np.asarray(record.rows.y[0])
        change = max(1.0, float(np.max(np.abs(end[nodes] - start[nodes]))))
        ours, theirs = (np.asarray(thermal.temperatures(part[nodes])) for part in (end, y))
        worst = int(np.argmax(np.abs(ours - theirs)))
    for i, (name, kind) in enumerate(labels):
        if kind == "motion":
            found.add(f"end: {name}", end[i], y[i], float(sizes[i]))
        elif kind == "energy":
            found.add(f"end: {name}", end[i], y[i], max(1e-3 * largest, 1e-12))
        elif len(nodes) <= _NODES or nodes[worst] == i:
            k = nodes.index(i)
            more = "" if len(nodes) <= _NODES else f", most different of {len(nodes)}"
            found.add(f"end: {name}{more}", ours[k], theirs[k], change, over=change)  # of the warming, not from 0 K


def _faults(method: str | None, rtol: float, most: int) -> list[Fault]:
    found = []
    if method is not None and method not in METHODS:
        found.append(Fault("method", f"SciPy has no {method!r}", f"one of {', '.join(METHODS)}"))
    if not 1e-13 <= rtol < 0.1:
        found.append(Fault("rtol", f"{rtol} is out of range", "1e-13 ≤ rtol < 0.1"))
    if most < 1:
        found.append(Fault("max_evaluations", f"{most} is out of range", "at least 1"))
    return found


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
    """Repeats a scene with SciPy and compares: changes of mode, times of events, state and energies at the end.

        print(simbrake.cross_check(scene))

    - `method` of `scipy.integrate.solve_ivp`; by default `DOP853`, and `Radau` where simbrake's choice is stiff as well
    - `rtol`: relative tolerance of both runs
    - `tolerance`: of the relative differences, by default `100 rtol`; relative to the quantity, or to the typical size
      of its kind where that is more (speeds, the largest energy, the greatest warming)
    - `max_evaluations` of the right-hand side by SciPy: a longer run ends there, is named in `trouble`, and is not `ok`
    - `result`: of the scene, to be checked in place of a new run

    SciPy integrates the same equations from event to event and locates every event itself; modes are switched in
    Python. So it checks integration and events, not the physics: that is what `validate` is for.

    Raises `InputError` with all faults of scene and options, `SimulationError` where simbrake's own run fails.
    """
    faults = _faults(method, rtol, max_evaluations)
    if faults:
        raise InputError(faults)
    with waiting(progress, "cross-check", "compiles the run") as told:
        fresh = simulate(scene, rtol=rtol, progress=told) if result is None else result
        start = time.perf_counter()
        again = simulate(scene, rtol=rtol)
        own_seconds = time.perf_counter() - start
        method = method or ("Radau" if stiffness(scene)[0] else "DOP853")
        told.now(f"compiles what SciPy {method} calls")
        energy: Any = again.record.system
        course = drive(again.record, method, rtol, max_evaluations, float(energy.sizes.torque), told.reach)
    found = _Compared(f"SciPy {method}", 100 * rtol if tolerance is None else tolerance)
    span = float(scene.end_time) - float(scene.initial.time)
    near = 1e-9 * span
    ours, theirs = _own_events(fresh), _scipy_events(again, course)
    if course.trouble:
        ours = [event for event in ours if event.time <= course.t]
    ours, theirs = _ordered(ours, near), _ordered(theirs, near)
    difference = _difference(ours, theirs)[1]
    _compare_events(found, ours, theirs, span, difference)
    if course.trouble:
        found.checks.append(Check("end of the run", found.source, None, span, course.trouble, found.tolerance, FAIL))
    else:
        _compare_ends(found, fresh, course.y)
    return CrossCheck(found.checks, course, method, difference, (own_seconds, course.seconds))
