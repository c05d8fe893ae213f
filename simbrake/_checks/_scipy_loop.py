"""A second integrator for hybrid systems, to check the first: SciPy's `solve_ivp` from event to event, modes in Python.

It shares the system's equations, guards, transitions and jumps with `_hybrid`, and none of its stepping, error control
or location of events. It is slow and plain.
"""

import time
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import numpy as np
from jax.flatten_util import ravel_pytree

from .._base._compiling import DeviceJit
from .._hybrid import Record

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
