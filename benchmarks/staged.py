"""The staged brake mode by mode (model §4): riding, both pairs sliding, bandage held on
the band, rest.

States (ω, ω_b, φ, heat of the band's pair, heat of the rim's pair). While the bandage
is held the split of the tension is linear on pieces: `k` linings at their limit; a
piece is a mode, as its end is a corner of the torque.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.automaton import Automaton, Guard, Mode
from benchmarks.scenes import Staged

_SIZES = np.array([20.0, 20.0, 10.0, 1e5, 1e5])


class Tensions:
    """Numbers of the mobilisation rule that stay the same, for equal linings."""

    def __init__(self, p: Staged):
        mu = (1 + p.f_ext * p.z) / (1 - p.f_ext * p.z)
        sine = math.sin(math.atan(p.z))
        self.Pi = mu ** np.arange(p.n + 1)
        self.top = float(self.Pi[-1])
        # ΣN = T_0 slack_k + T_n tight_k with k linings at their limit
        sums = np.concatenate([[0.0], np.cumsum(self.Pi[1:] + self.Pi[:-1])]) * sine
        k = np.arange(p.n)
        self.slack = np.append(sums[:-1] + self.Pi[:-1] * sine, sums[-1])
        self.tight = np.append((1 + 2 * (p.n - 1 - k)) * sine, 0.0)


Lever = Callable[[float], float]


def staged(p: Staged) -> Automaton:
    """Its modes; the piece `k` of the held bandage is the mode `locked k`."""
    known = Tensions(p)
    decay = 1 / p.tau
    level = p.level
    first = math.exp(-p.ahead * decay)

    def lever(t: float) -> float:
        return level * (1 - first * math.exp(-t * decay))

    modes = {
        "ride": _ride(p, known, lever),
        "both": _both(p, known, lever),
        "rest": Mode(None, None, (), _SIZES),
    }
    modes |= {f"locked {k}": _locked(p, known, lever, k) for k in range(p.n)}

    def final(mode: str, y: Any) -> np.ndarray:
        if mode != "rest":
            raise RuntimeError(f"ended in the mode {mode}: an event was missed")
        return np.asarray(y)[2:]

    start = np.array([p.w_0, p.w_0, 0.0, 0.0, 0.0])
    return Automaton(modes, "ride", start, p.end, final, fastest=1e-2)


def _ride(p: Staged, known: Tensions, lever: Lever) -> Mode:
    """The bandage turns with the pulley, until what drives it is more than the inner
    pair holds."""
    grip, full, preload = pairs(p, known)
    load = p.load
    J_b = p.J_b
    together = p.J + p.J_b

    def rhs(t: float, y: Any) -> tuple[float, ...]:
        M = grip * lever(t)
        a = (load - M) / together
        return a, a, y[0], M * y[0], 0.0

    def jacobian(t: float, y: Any) -> np.ndarray:
        found = np.zeros((5, 5))
        found[2, 0] = 1.0
        found[3, 0] = grip * lever(t)
        return found

    def margin(t: float, y: Any) -> float:
        T_0 = lever(t)
        M = grip * T_0
        return preload + full * T_0 - M - J_b * (load - M) / together

    return Mode(
        rhs, jacobian, (Guard("internal slip", margin, "both", lambda t, y: y),), _SIZES
    )


def _both(p: Staged, known: Tensions, lever: Lever) -> Mode:
    """Both pairs slide, until the bandage stands."""
    grip, full, preload = pairs(p, known)
    load = p.load
    J = p.J
    J_b = p.J_b

    def rhs(t: float, y: Any) -> tuple[float, ...]:
        T_0 = lever(t)
        M_int = preload + full * T_0
        M_ext = grip * T_0
        return (
            (load - M_int) / J,
            (M_int - M_ext) / J_b,
            y[0],
            M_ext * y[1],
            M_int * (y[0] - y[1]),
        )

    def jacobian(t: float, y: Any) -> np.ndarray:
        T_0 = lever(t)
        found = np.zeros((5, 5))
        found[2, 0] = 1.0
        found[3, 1] = grip * T_0
        found[4, 0] = preload + full * T_0
        found[4, 1] = -found[4, 0]
        return found

    def resting(t: float, y: Any) -> np.ndarray:
        found = np.array(y, dtype=float)
        found[1] = 0.0
        return found

    def piece(t: float, y: Any) -> str:
        return f"locked {_piece(p, known, lever(t))}"

    return Mode(
        rhs,
        jacobian,
        (Guard("external lock", lambda t, y: y[1], piece, resting),),
        _SIZES,
    )


def _locked(p: Staged, known: Tensions, lever: Lever, k: int) -> Mode:
    """The bandage is held, `k` of its linings at their limit: `T_n = a + b T_0`."""
    a, b = line(p, known, k)
    load = p.load
    J = p.J
    low = float(known.Pi[k])
    c_0 = p.R_b * a
    c_1 = p.R_b * (b - 1)

    def rhs(t: float, y: Any) -> tuple[float, ...]:
        M = c_0 + c_1 * lever(t)
        return (load - M) / J, 0.0, y[0], 0.0, M * y[0]

    def jacobian(t: float, y: Any) -> np.ndarray:
        found = np.zeros((5, 5))
        found[2, 0] = 1.0
        found[4, 0] = c_0 + c_1 * lever(t)
        return found

    guards = [Guard("stop", lambda t, y: y[0], "rest", lambda t, y: y)]
    if k:
        # the lever grows, so that the ratio of the tensions falls
        less = Guard(
            None,
            lambda t, y: a + (b - low) * lever(t),
            f"locked {k - 1}",
            lambda t, y: y,
        )
        guards.append(less)
    return Mode(rhs, jacobian, tuple(guards), _SIZES)


def pairs(p: Staged, known: Tensions) -> tuple[float, float, float]:
    """`M_ext/T_0`; `M_int/T_0` in full slip of the band; what the preload adds to
    `M_int`."""
    rim = p.R * p.f_int
    return p.R_b * (known.top - 1), rim * float(known.slack[-1]), rim * p.n * p.preload


def line(p: Staged, known: Tensions, k: int) -> tuple[float, float]:
    """`a`, `b` of the root `T_n = a + b T_0` of `R_b (T_n − T_0) = M_int(T_n)` on the
    piece `k`."""
    rim = p.R * p.f_int
    below = p.R_b - rim * float(known.tight[k])
    return rim * p.n * p.preload / below, (p.R_b + rim * float(known.slack[k])) / below


def _piece(p: Staged, known: Tensions, T_0: float) -> int:
    """How many linings are at their limit as the bandage comes to stand."""
    for k in range(p.n):
        a, b = line(p, known, k)
        if known.Pi[k] * T_0 <= a + b * T_0 <= known.Pi[k + 1] * T_0:
            return k
    raise RuntimeError("the bandage does not stay on the band")
