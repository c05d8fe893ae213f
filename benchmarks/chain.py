"""The chain of linings mode by mode (model §3.1): in the mode `k slide` the `k` linings
at the tight end slide.

States (ω, φ, elongations e_i, speeds v_i of the linings). The lever pulls evenly and
friction is constant, so that every mode is linear: its matrix is built once from the
equations. All linings that stick move alike and leave the tensions between them as they
were: only the first of them, seen from the anchor, can let go. That none sticks again
is looked at when the next one lets go, and at the end.
"""

from typing import Any

import numpy as np

from benchmarks.automaton import Automaton, Guard, Mode
from benchmarks.scenes import Chain


class Linear:
    """Modes as matrices: rates `A[k] y + b[k]`; what the next lining to slip can still
    hold (N), `g[k]·y + h[k]`."""

    def __init__(self, p: Chain):
        n = p.n
        self.p = p
        self.fz = p.f * p.z
        self.K = p.stiffness
        self.D = np.array([2 * p.zeta * np.sqrt(p.K * p.m)] * (n - 1) + [0.0])
        self.A = []
        self.b = []
        self.g = []
        self.h = []
        for k in range(n + 1):
            rates, spare = self.equations(np.zeros(2 * n + 2), k)
            columns = [self.equations(e, k) for e in np.eye(2 * n + 2)]
            self.A.append(np.stack([c[0] - rates for c in columns], axis=1))
            self.b.append(rates)
            self.g.append(np.array([c[1] - spare for c in columns]))
            self.h.append(spare)

    def equations(self, y: np.ndarray, k: int) -> tuple[np.ndarray, float]:
        """Rates, and the limit less the grip of the first lining that sticks."""
        p = self.p
        n = self.p.n
        stuck = n - k
        w = y[0]
        e = y[2 : n + 2]
        v = y[n + 2 :].copy()
        v[:stuck] = p.R * w
        stretching = v - np.append(v[1:], 0.0)
        T = p.T_0 + self.K * e + self.D * stretching
        before = np.append(p.T_0, T[:-1])
        G = self.fz * (T + before)
        carried = np.sum((T - before)[:stuck]) + np.sum(G[stuck:])
        alpha = -p.R * carried / (p.J + p.R**2 * stuck * p.m)
        a = (G + before - T) / p.m
        a[:stuck] = p.R * alpha
        spare = 0.0
        if stuck:
            i = stuck - 1
            spare = G[i] - (p.m * p.R * alpha + T[i] - before[i])
        return np.concatenate([[alpha, w], stretching, a]), float(spare)

    def checked(self, y: Any, k: int) -> np.ndarray:
        """The state, if the linings that slide still do."""
        y = np.asarray(y)
        if np.any(self.p.R * y[0] < y[2 * self.p.n + 2 - k :]):
            raise RuntimeError("a lining sticks again: an event was missed")
        return y


def chain(p: Chain) -> Automaton:
    """Its modes."""
    n = p.n
    known = Linear(p)
    sizes = sizes_of(p)

    def sliding(k: int) -> Mode:
        A = known.A[k]
        b = known.b[k]
        g = known.g[k]
        h = known.h[k]
        guards = ()
        if k < n:

            def after(t: float, y: Any) -> np.ndarray:
                return known.checked(y, k)

            guards = (
                Guard(
                    f"lining {n - k} slips",
                    lambda t, y: h + float(g @ y),
                    f"{k + 1} slide",
                    after,
                ),
            )
        return Mode(lambda t, y: A @ y + b, lambda t, y: A, guards, sizes)

    def final(mode: str, y: Any) -> np.ndarray:
        if mode != f"{n} slide":
            raise RuntimeError(f"ended in the mode {mode}: an event was missed")
        y = known.checked(y, n)
        return np.concatenate([y[1::-1], y[2:]])

    start = np.concatenate([[p.w_0, 0.0], np.zeros(n), np.full(n, p.R * p.w_0)])
    modes = {f"{k} slide": sliding(k) for k in range(n + 1)}
    return Automaton(modes, "0 slide", start, p.end, final, fastest=2e-4)


def sizes_of(p: Chain) -> np.ndarray:
    """Typical sizes of the states."""
    return np.concatenate([[p.w_0, 0.1], p.stretch, np.full(p.n, p.R * p.w_0)])
