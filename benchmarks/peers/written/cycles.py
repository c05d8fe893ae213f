"""Repeated stops: on each piece of the lever its tension is a straight line, whose two
numbers a mode is given."""

import bisect
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from benchmarks.peers.written.form import Program, Words, Written
from benchmarks.scenes import Cycles


def written(p: Cycles) -> dict[str, Written]:
    n = p.n
    (C_r, C_l, C_b) = p.capacities
    (out_r, out_b) = p.cooling

    def torque(words: Words, t: Any, T: Any, q: Sequence[Any]) -> Any:
        level, slope, fz_0, fall, R = q
        fz = words.let(fz_0 - fall * T)
        return words.let(R * (level + slope * t) * (((1 + fz) / (1 - fz)) ** n - 1))

    def cooling(words: Words, y: Sequence[Any], q: Sequence[Any]) -> list[Any]:
        _, _, T_r, T_l, T_b = y
        rim, lining, to_band, band = q
        flow = words.let(T_l - T_b)
        return [-rim * T_r, -lining * flow, to_band * flow - band * T_b]

    def held(words: Words, t: Any, y: Sequence[Any], q: Sequence[Any]) -> Any:
        spare = torque(words, t, y[3], q[:5]) - q[9]
        return [0.0 * y[0], 0.0 * y[0], *cooling(words, y, q[5:9])], [spare]

    def moving(words: Words, t: Any, y: Sequence[Any], q: Sequence[Any]) -> Any:
        w = y[0]
        (load, drag, J, to_rim, to_lining) = q[9:]
        M = torque(words, t, y[3], q[:5])
        (rim, lining, band) = cooling(words, y, q[5:9])
        P = words.let(M * w)
        return [
            (load - drag * w - M) / J,
            w,
            rim + to_rim * P,
            lining + to_lining * P,
            band,
        ], [w]

    def letting_go(words: Words, t: Any, y: Sequence[Any], q: Sequence[Any]) -> Any:
        return moving(words, t, y, q)[0], []

    starts, lines = _pieces(p)
    friction = (
        p.f * p.z,
        p.f * p.z * p.fade,
        p.R,
        out_r / C_r,
        p.between / C_l,
        p.between / C_b,
        out_b / C_b,
        p.load,
    )
    turning = (p.drag, p.J, p.share / C_r, (1 - p.share) / C_l)

    def numbers(more: tuple[float, ...]) -> Callable[[float], np.ndarray]:
        rows = [np.array([*line, *friction, *more]) for line in lines]
        return lambda t: rows[bisect.bisect_right(starts, t) - 1]

    return {
        "held": Written(Program(5, 1, held), numbers(())),
        "letting go": Written(Program(5, 0, letting_go), numbers(turning)),
        "moving": Written(Program(5, 1, moving), numbers(turning)),
    }


def _pieces(p: Cycles) -> tuple[list[float], list[tuple[float, float]]]:
    """Where the straight lines of the lever's tension begin, and the level at `t = 0`
    and the slope of each."""
    starts = [0.0]
    lines = [(p.tensions[-1], 0.0)]
    for i in range(p.count):
        for k, t in enumerate(p.times):
            slope = 0.0
            if k + 1 < len(p.times):
                slope = (p.tensions[k + 1] - p.tensions[k]) / (p.times[k + 1] - t)
            starts.append(i * p.period + t)
            lines.append((p.tensions[k] - slope * starts[-1], slope))
    return starts, lines
