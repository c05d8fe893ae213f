"""The staged brake; the pieces of the held bandage share one program. States as in
`benchmarks/staged.py`."""

import math
from collections.abc import Sequence
from typing import Any

from benchmarks.peers.written.form import Program, Words, Written, fixed
from benchmarks.scenes import Staged
from benchmarks.staged import Tensions, line, pairs


def _lever(words: Words, t: Any, q: Sequence[Any]) -> Any:
    level, missing, decay = q
    return words.let(level - missing * words.exp(-decay * t))


def _ride(words: Words, t: Any, y: Sequence[Any], q: Sequence[Any]) -> Any:
    w = y[0]
    (grip, full, preload, load, J_b, together) = q[3:]
    T_0 = _lever(words, t, q[:3])
    M = words.let(grip * T_0)
    a = words.let((load - M) / together)
    return [a, a, w, M * w, 0.0 * w], [preload + full * T_0 - M - J_b * a]


def _both(words: Words, t: Any, y: Sequence[Any], q: Sequence[Any]) -> Any:
    (w, w_b) = y[:2]
    (grip, full, preload, load, J, J_b) = q[3:]
    T_0 = _lever(words, t, q[:3])
    M_int = words.let(preload + full * T_0)
    M_ext = words.let(grip * T_0)
    return [
        (load - M_int) / J,
        (M_int - M_ext) / J_b,
        w,
        M_ext * w_b,
        M_int * (w - w_b),
    ], [w_b]


def _locked(words: Words, t: Any, y: Sequence[Any], q: Sequence[Any]) -> Any:
    w = y[0]
    (c_0, c_1, load, J, a, b_less_low) = q[3:]
    T_0 = _lever(words, t, q[:3])
    M = words.let(c_0 + c_1 * T_0)
    return [(load - M) / J, 0.0 * w, w, 0.0 * w, M * w], [w, a + b_less_low * T_0]


def written(p: Staged) -> dict[str, Written]:
    known = Tensions(p)
    lever = (p.level, p.level * math.exp(-p.ahead / p.tau), 1 / p.tau)
    both = pairs(p, known)
    modes = {
        "ride": fixed(Program(5, 1, _ride), *lever, *both, p.load, p.J_b, p.J + p.J_b),
        "both": fixed(Program(5, 1, _both), *lever, *both, p.load, p.J, p.J_b),
    }
    locked = Program(5, 2, _locked)
    for k in range(p.n):
        a, b = line(p, known, k)
        # with none at its limit there is no piece after it
        less = (a, b - float(known.Pi[k])) if k else (1.0, 0.0)
        modes[f"locked {k}"] = fixed(
            locked, *lever, p.R_b * a, p.R_b * (b - 1), p.load, p.J, *less
        )
    return modes
