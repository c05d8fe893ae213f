"""The chain of linings: one program for all modes, in which numbers say who slides and
who is watched."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.chain import Linear
from benchmarks.peers.written.form import Program, Words, Written, fixed, total
from benchmarks.scenes import Chain


def written(p: Chain) -> dict[str, Written]:
    n = p.n
    known = Linear(p)
    damped = [i for i in range(n) if known.D[i]]

    def equations(words: Words, t: Any, y: Sequence[Any], q: Sequence[Any]) -> Any:
        w = y[0]
        e = y[2 : n + 2]
        v = y[n + 2 :]
        (T_0, fz, R, per_m, heavy, inert) = q[:6]
        left = list(q[6:])
        slides, sticks, watched, K = (left[i * n : (i + 1) * n] for i in range(4))
        D = dict(zip(damped, left[4 * n : -2], strict=True))
        (moved, spare) = left[-2:]
        stretching = [words.let(v[i] - v[i + 1]) for i in range(n - 1)] + [v[-1]]
        T = [T_0]
        for i in range(n):
            pull = T_0 + K[i] * e[i]
            T.append(words.let(pull + D[i] * stretching[i] if i in D else pull))
        more = [words.let(T[i + 1] - T[i]) for i in range(n)]
        G = [words.let(fz * (T[i + 1] + T[i])) for i in range(n)]
        carried = total([slides[i] * G[i] + sticks[i] * more[i] for i in range(n)])
        a = words.let(inert * carried)  # R α
        moving = [
            slides[i] * (per_m * (G[i] - more[i])) + sticks[i] * a for i in range(n)
        ]
        rest = (
            spare
            - moved * heavy * a
            + total([watched[i] * (G[i] - more[i]) for i in range(n)])
        )
        return [a / R, w, *stretching, *moving], [rest]

    program = Program(2 * n + 2, 1, equations)
    modes = {}
    for k in range(n + 1):
        stuck = n - k
        places = np.arange(n)
        sticks = (places < stuck).astype(float)
        watched = (places == stuck - 1).astype(float)
        head = (
            p.T_0,
            known.fz,
            p.R,
            1 / p.m,
            p.m,
            -(p.R**2) / (p.J + p.R**2 * stuck * p.m),
        )
        rows = np.concatenate([1 - sticks, sticks, watched, known.K, known.D[damped]])
        # when all slide nothing is watched
        modes[f"{k} slide"] = fixed(
            program, *head, *rows.tolist(), *((1.0, 0.0) if stuck else (0.0, 1.0))
        )
    return modes
