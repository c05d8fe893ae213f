"""Reference solutions by an independent method: collocation of order 23 at Radau's
points on a graded mesh.

No step-size control, no interpolant: elements that grow from the fastest time of the
scene on, Newton's method in each, and the length of the last one solved for the guard.
How far two meshes differ is returned as its uncertainty.
"""

import functools
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from benchmarks.automaton import Automaton, Mode
from benchmarks.equations import automaton_of, drive
from benchmarks.scenes import CASES, Answer, Case, closed_form

_STAGES = 12


@functools.cache
def radau(s: int) -> tuple[np.ndarray, np.ndarray]:
    """Points and matrix of the Radau IIA method of `s` stages (order 2s − 1; Hairer &
    Wanner II, IV.5)."""
    # (complex numbers from NumPy 2.5 on)
    points = np.sort(legendre.legroots([0.0] * (s - 1) + [-1.0, 1.0]).real)
    points[-1] = 1.0
    series = np.eye(s)
    integrals = np.stack(
        [legendre.legval(points, legendre.legint(row, lbnd=-1)) for row in series],
        axis=1,
    )
    matrix = np.linalg.solve(legendre.legvander(points, s - 1).T, integrals.T).T
    return (1 + points) / 2, matrix / 2


@functools.cache
def _split(s: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Eigenvalues, eigenvectors and their inverse of Radau's matrix: they split its
    Newton system (ibid. IV.8)."""
    values, vectors = np.linalg.eig(radau(s)[1])
    return values, vectors, np.linalg.inv(vectors)


def _element(mode: Mode, t: float, y: np.ndarray, h: float) -> np.ndarray:
    """State at the end of one element."""
    assert mode.rhs is not None
    c, A = radau(_STAGES)
    n = len(y)
    if mode.jacobian is not None:
        J = mode.jacobian(t + h / 2, y)
    else:
        f = np.asarray(mode.rhs(t, y))
        steps = 1e-7 * mode.scales
        columns = [
            (np.asarray(mode.rhs(t, y + d * e)) - f) / d
            for d, e in zip(steps, np.eye(n), strict=True)
        ]
        J = np.stack(columns, axis=1)
    values, vectors, back = _split(_STAGES)
    # what rounding does to these is made up for by the next change
    inverses = np.linalg.inv(np.eye(n) - h * values[:, None, None] * J)
    Z = np.zeros((_STAGES, n))
    last = np.inf
    for _ in range(60):
        F = np.stack(
            [
                np.asarray(mode.rhs(t + ci * h, y + z), dtype=float)
                for ci, z in zip(c, Z, strict=True)
            ]
        )
        split = back @ (h * A @ F - Z)
        change = (vectors @ (inverses @ split[:, :, None])[:, :, 0]).real
        Z = Z + change
        size = float(np.max(np.abs(change) / mode.scales))
        if size <= 1e-17 or (size < 1e-13 and size >= last / 2):
            break
        last = size
    else:
        raise RuntimeError("collocation did not converge")
    return y + Z[-1]


def _segment(automaton: Automaton, refinement: float):
    span = automaton.end

    def segment(name, t, y, stop):
        mode = automaton.modes[name]
        y = np.asarray(y, dtype=float)
        h = automaton.fastest / refinement
        while True:
            step = min(h, stop - t)
            end = _element(mode, t, y, step)
            past = [
                i
                for i, guard in enumerate(mode.guards)
                if guard.value(t + step, end) < 0
            ]
            if past:
                lengths = [_length(mode, i, t, y, step) for i in past]
                first = int(np.argmin(lengths))
                step = lengths[first]
                return t + step, _element(mode, t, y, step), past[first]
            t = t + step
            y = end
            if t >= stop or stop - t < 1e-14 * span:
                return stop, y, None
            h = min(h * (1 + 1 / refinement), span / (16 * refinement))

    return segment


def _length(mode: Mode, index: int, t: float, y: np.ndarray, h: float) -> float:
    """Length of the element at whose end the guard is 0."""
    from scipy.optimize import brentq

    value = mode.guards[index].value
    return brentq(
        lambda s: float(value(t + s, _element(mode, t, y, s) if s else y)),
        0.0,
        h,
        xtol=1e-300,
        rtol=1e-15,
    )


class Reference(NamedTuple):
    """The answer, by what method, and its uncertainty in the benchmark's measure of
    error."""

    answer: Answer
    method: str
    uncertainty: float


def error(case: Case, answer: Answer, reference: Answer) -> tuple[float, float]:
    """Largest relative error of an event time, and largest error of the final state in
    its typical sizes."""
    times = float(np.max(np.abs(answer.times / reference.times - 1)))
    return times, float(np.max(np.abs(answer.state - reference.state) / case.scales))


@functools.cache
def reference(name: str) -> Reference:
    """The closed form where there is one, else collocation on two meshes."""
    case = CASES[name]
    automaton = automaton_of(case)
    found = []
    for refinement in (1.0, 1.5):
        times, state = drive(automaton, case, _segment(automaton, refinement))
        found.append(Answer(times, state, 0, 0))
    coarse, fine = found
    if name == "a":
        exact = closed_form(case.plain)
        return Reference(exact, "closed form", max(error(case, fine, exact)))
    return Reference(
        fine,
        f"Radau collocation of order {2 * _STAGES - 1}",
        max(error(case, coarse, fine)),
    )
