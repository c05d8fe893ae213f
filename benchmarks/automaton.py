"""A run mode by mode: what holds in a mode, what ends it, what follows."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np


class Guard(NamedTuple):
    """Falls through 0 at an event: its name (or `None`), the mode that follows (or what
    tells it), the state there."""

    event: str | None
    value: Callable[[float, Any], float]
    mode: str | Callable[[float, Any], str]
    state: Callable[[float, Any], Any]


class Mode(NamedTuple):
    """Right-hand side (`None`: nothing changes), Jacobian, what ends the mode, typical
    sizes of the states."""

    rhs: Callable[[float, Any], Any] | None
    jacobian: Callable[[float, Any], np.ndarray] | None
    guards: tuple[Guard, ...]
    scales: np.ndarray
    #: the mode that follows at the next corner of the lever, `None`: the same
    then: str | None = None


class Automaton(NamedTuple):
    """Modes by name, where the run starts, and the final state from the last mode's.

    `knots`: times at which the equations have a corner; integration restarts there.
    `fastest`: a time (s) in which the fastest of its states hardly changes
    """

    modes: dict[str, Mode]
    mode: str
    state: np.ndarray
    end: float
    final: Callable[[str, Any], np.ndarray]
    knots: tuple[float, ...] = ()
    fastest: float = 1e-3
