"""A stop of one band: states as in `equations`."""

from collections.abc import Sequence
from typing import Any

from benchmarks.peers.written.form import Program, Sparse, Words, Written, fixed
from benchmarks.scenes import Stop


def _take_up(words: Words, t: Any, y: Sequence[Any], q: Sequence[Any]) -> Any:
    (w, _, x) = y
    (R, T_0, C) = q
    return [0.0 * w, w, R * w], [T_0 - C * x]


def _elastic(words: Words, t: Any, y: Sequence[Any], q: Sequence[Any]) -> Any:
    (w, _, x) = y
    (R, swing, k, T_full, C) = q
    return [swing - k * x, w, R * w], [T_full - C * x]


def _slip(words: Words, t: Any, y: Sequence[Any], q: Sequence[Any]) -> Any:
    (w, _) = y
    (slowing,) = q
    return [slowing + 0.0 * w, w], [w]


def written(p: Stop) -> dict[str, Written]:
    R = p.R
    C = p.C
    T_0 = p.T_0
    Pi = p.Pi
    modes = {
        "take_up": fixed(Program(3, 1, _take_up), R, T_0, C),
        "elastic": fixed(
            Program(3, 1, _elastic), R, R * T_0 / p.J, R * C / p.J, T_0 * Pi, C
        ),
    }
    if p.rates is None:
        return modes | {"slip": fixed(Program(2, 1, _slip), -R * T_0 * (Pi - 1) / p.J)}
    return modes | _hot(p)


def _hot(p: Stop) -> dict[str, Written]:
    assert p.rates is not None
    assert p.into is not None
    k = len(p.rates)
    n = p.n
    walls = Sparse(p.rates)
    spots = [int(i) for i in p.into.nonzero()[0]]

    def slip(words: Words, t: Any, y: Sequence[Any], q: Sequence[Any]) -> Any:
        w = y[0]
        T = y[2:]
        (R, arm, T_0, fz_0, fall_of, per_C) = q[:6]
        heats = q[6 : 6 + len(spots)]
        cooling = walls.times(q[6 + len(spots) :], T)
        fz = words.let(fz_0 - fall_of * T[0])
        T_n = words.let(T_0 * ((1 + fz) / (1 - fz)) ** n)
        g = words.let(T_n - T_0)
        fall = words.let(-2.0 * n * fall_of * per_C * T_n / (1 - fz * fz))
        rest = words.let(cooling[0])
        speed = words.let(R * w - fall * rest)
        P = words.let(g * speed / (1 + fall * heats[0] * g))
        cooling[0] = rest
        for i, a in zip(spots, heats, strict=True):
            cooling[i] = cooling[i] + a * P
        return [-arm * g, w, *cooling], [speed]

    def stick(words: Words, t: Any, y: Sequence[Any], q: Sequence[Any]) -> Any:
        (w, _, x) = y[:3]
        (R, stretching, push) = q[:3]
        return [push - stretching * x, w, R * w, *walls.times(q[3:], y[3:])], [w]

    def held(words: Words, t: Any, y: Sequence[Any], q: Sequence[Any]) -> Any:
        return [0.0 * y[0], *walls.times(q, y[1:-1]), 0.0 * y[0]], []

    arm = p.R / p.J
    fz_0 = p.f * p.z
    heats = [float(p.into[i]) for i in spots]
    friction = (p.R, arm, p.T_0, fz_0, fz_0 * p.fade, 1 / p.C, *heats)
    return {
        "slip": fixed(Program(k + 2, 1, slip), *friction, *walls.entries),
        "stick": fixed(
            Program(k + 3, 1, stick), p.R, arm * p.C, arm * p.T_0, *walls.entries
        ),
        "held": fixed(Program(k + 2, 0, held), *walls.entries),
    }
