"""What a mode is to a tool that takes expressions: operators, `exp` and whole powers,
and numbers that it is given."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np


class Words(NamedTuple):
    """What a tool adds to the operators: `let` keeps a value that is used more than
    once, under a name."""

    exp: Callable[[Any], Any]
    let: Callable[[Any], Any]


class Program(NamedTuple):
    """What is compiled once: `equations(words, t, y, q)` gives the rates of the states
    and the values of the guards."""

    states: int
    guards: int
    equations: Callable[
        [Words, Any, Sequence[Any], Sequence[Any]], tuple[list[Any], list[Any]]
    ]


class Written(NamedTuple):
    """A mode: its program, and the numbers `q` that it is given as it starts at `t`.

    Modes that differ in numbers alone share a program.
    """

    program: Program
    numbers: Callable[[float], np.ndarray]


def fixed(program: Program, *numbers: float) -> Written:
    """A mode with the same numbers at any time."""
    same = np.array(numbers)
    return Written(program, lambda t: same)


def row(matrix: Any, i: int) -> list[tuple[int, float]]:
    """Columns of a matrix's row that are not zero, and what stands there."""
    return [(int(j), float(matrix[i, j])) for j in matrix[i].nonzero()[0]]


class Sparse:
    """A matrix whose places are part of a program and whose entries are numbers of
    it."""

    def __init__(self, matrix: Any):
        rows = [row(matrix, i) for i in range(len(matrix))]
        self.entries = [x for entries in rows for _, x in entries]
        self._places = [[j for j, _ in entries] for entries in rows]

    def times(self, q: Sequence[Any], y: Sequence[Any]) -> list[Any]:
        """Product with `y`; `q`: numbers of which the entries are the first."""
        left = iter(q)
        return [total([next(left) * y[j] for j in places]) for places in self._places]


def total(terms: list[Any]) -> Any:
    """Their sum, without a zero to start from."""
    found = terms[0]
    for term in terms[1:]:
        found = found + term
    return found
