"""Runs inside a compiled search: the solver a scene wants, and the room that its steps need."""

import math
import sys
import time
from typing import Any

import diffrax

from ._choice import stiffness
from ._hybrid import Rodas5P
from ._result import Result
from ._scene import Scene
from ._simulate import simulate

_MOST = 16384


def solver_for(scene: Scene) -> Any:
    """The solver that a concrete scene would get: inside a search its values cannot be looked at."""
    return Rodas5P() if stiffness(scene)[0] else diffrax.Dopri8()


def room_for(result: Result) -> int:
    """Step attempts to allow in runs like this one: twice as many, as a power of two."""
    return min(max(64, 1 << math.ceil(math.log2(2 * int(result.record.count) + 16))), _MOST)


def first_run(scene: Scene, solver: Any, rtol: float) -> tuple[Result, Any, int]:
    """The run of a concrete scene, the solver for runs like it and the room that they need."""
    solver = solver_for(scene) if solver is None else solver
    result = simulate(scene, solver=solver, rtol=rtol)
    return result, solver, room_for(result)


class Progress:
    """One line on a terminal's error stream that is written over; elsewhere nothing is printed."""

    def __init__(self, name: str):
        self.name, self.start, self.shown = name, time.monotonic(), sys.stderr.isatty()

    def show(self, text: str) -> None:
        """Writes over the line: how far the search is, and for how long it has run."""
        if self.shown:
            print(f"\r{self.name}: {text}, {time.monotonic() - self.start:.0f} s\x1b[K", end="", file=sys.stderr)

    def done(self) -> None:
        """Clears the line."""
        if self.shown:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)
