"""The staged brake mode by mode (model §4): riding, both pairs sliding, bandage held on the band, rest.

States (ω, ω_b, φ, heat of the band's pair, heat of the rim's pair). While the bandage is held the split of the tension
is linear on pieces: `k` linings at their limit; a piece is a mode, as its end is a corner of the torque.
"""

import math
from typing import Any

import numpy as np

from benchmarks.equations import Automaton, Guard, Mode
from benchmarks.scenes import Staged

_SIZES = np.array([20.0, 20.0, 10.0, 1e5, 1e5])


class Tensions:
    """Numbers of the mobilisation rule that stay the same, for equal linings."""

    def __init__(self, p: Staged):
        mu, sine = (1 + p.f_ext * p.z) / (1 - p.f_ext * p.z), math.sin(math.atan(p.z))
        self.Pi = mu ** np.arange(p.n + 1)
        self.top = float(self.Pi[-1])
        # ΣN = T_0 slack_k + T_n tight_k with k linings at their limit
        sums = np.concatenate([[0.0], np.cumsum(self.Pi[1:] + self.Pi[:-1])]) * sine
        k = np.arange(p.n)
        self.slack = np.append(sums[:-1] + self.Pi[:-1] * sine, sums[-1])
        self.tight = np.append((1 + 2 * (p.n - 1 - k)) * sine, 0.0)


def staged(p: Staged) -> Automaton:
    """Its modes; the piece `k` of the held bandage is the mode `locked k`."""
    known, rim, together = Tensions(p), p.R * p.f_int, p.J + p.J_b
    grip, full = p.R_b * (known.top - 1), rim * float(known.slack[-1])
    preload, decay = rim * p.n * p.preload, 1 / p.tau
    first = math.exp(-p.ahead * decay)
    level, load, J, J_b = p.level, p.load, p.J, p.J_b

    def lever(t: float) -> float:
        return level * (1 - first * math.exp(-t * decay))

    def ride(t: float, y: Any) -> tuple[float, ...]:
        M = grip * lever(t)
        a = (load - M) / together
        return a, a, y[0], M * y[0], 0.0

    def margin(t: float, y: Any) -> float:
        T_0 = lever(t)
        M = grip * T_0
        return preload + full * T_0 - M - J_b * (load - M) / together

    def both(t: float, y: Any) -> tuple[float, ...]:
        T_0 = lever(t)
        M_int, M_ext = preload + full * T_0, grip * T_0
        return (load - M_int) / J, (M_int - M_ext) / J_b, y[0], M_ext * y[1], M_int * (y[0] - y[1])

    def columns(t: float, mode: str) -> np.ndarray:
        T_0, found = lever(t), np.zeros((5, 5))
        found[2, 0] = 1.0
        if mode == "ride":
            found[3, 0] = grip * T_0
        else:
            found[3, 1], found[4, 0] = grip * T_0, preload + full * T_0
            found[4, 1] = -found[4, 0]
        return found

    def tight(T_0: float, k: int) -> float:
        """`T_n` of `R_b (T_n − T_0) = M_int(T_n)` on the piece `k`."""
        return (preload + (p.R_b + rim * known.slack[k]) * T_0) / (p.R_b - rim * known.tight[k])

    def piece(t: float, y: Any) -> int:
        T_0 = lever(t)
        for k in range(p.n):
            T_n = tight(T_0, k)
            if known.Pi[k] * T_0 <= T_n <= known.Pi[k + 1] * T_0:
                return k
        raise RuntimeError("the bandage does not stay on the band")

    def locked(k: int) -> Mode:
        a = preload / (p.R_b - rim * known.tight[k])
        b = float((p.R_b + rim * known.slack[k]) / (p.R_b - rim * known.tight[k]))
        low = float(known.Pi[k])
        c_0, c_1 = p.R_b * a, p.R_b * (b - 1)

        def rhs(t: float, y: Any) -> tuple[float, ...]:
            M = c_0 + c_1 * lever(t)
            return (load - M) / J, 0.0, y[0], 0.0, M * y[0]

        def jacobian(t: float, y: Any) -> np.ndarray:
            found = np.zeros((5, 5))
            found[2, 0], found[4, 0] = 1.0, c_0 + c_1 * lever(t)
            return found

        guards = [Guard("stop", lambda t, y: y[0], "rest", lambda t, y: y)]
        if k:
            # the lever grows, so that the ratio of the tensions falls
            less = Guard(None, lambda t, y: a + (b - low) * lever(t), f"locked {k - 1}", lambda t, y: y)
            guards.append(less)
        return Mode(rhs, jacobian, tuple(guards), _SIZES)

    def resting(t: float, y: Any) -> np.ndarray:
        found = np.array(y, dtype=float)
        found[1] = 0.0
        return found

    def name(t: float, y: Any) -> str:
        return f"locked {piece(t, y)}"

    slip = Guard("internal slip", margin, "both", lambda t, y: y)
    lock = Guard("external lock", lambda t, y: y[1], name, resting)
    modes = {
        "ride": Mode(ride, lambda t, y: columns(t, "ride"), (slip,), _SIZES),
        "both": Mode(both, lambda t, y: columns(t, "both"), (lock,), _SIZES),
        "rest": Mode(None, None, (), _SIZES),
    }
    modes |= {f"locked {k}": locked(k) for k in range(p.n)}

    def final(mode: str, y: Any) -> np.ndarray:
        if mode != "rest":
            raise RuntimeError(f"ended in the mode {mode}: an event was missed")
        return np.asarray(y)[2:]

    start = np.array([p.w_0, p.w_0, 0.0, 0.0, 0.0])
    return Automaton(modes, "ride", start, p.end, final, fastest=1e-2)
