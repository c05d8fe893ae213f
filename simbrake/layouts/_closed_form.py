"""Lining angles in closed form for a wanted distribution along the band, each with its limit of feasibility.

Numbers go in and out as NumPy float64: a layout is designed once, not inside a simulation."""

import dataclasses
import math
from collections.abc import Callable

import numpy as np
from jaxtyping import Float


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    from scipy.optimize import brentq  # imported where it is used: most runs design no layout

    return float(brentq(function, low, high, xtol=1e-16, rtol=1e-14))  # pyright: ignore


class InfeasibleLayout(ValueError):
    """No such layout exists; the message says which limit is exceeded and where."""


@dataclasses.dataclass(frozen=True)
class Layout:
    """`angle` (n,) in rad from the slack to the tight end, `ratio` `Π_k = T_k/T_0` with `k` linings at their limit."""

    angle: Float[np.ndarray, " n"]
    ratio: float
    k: int


def _equal_increment_z(f: Float[np.ndarray, " k"], z_k: float) -> Float[np.ndarray, " k"]:
    # 1/(f_i z_i) = 1/(f_k z_k) − 2 (k − i)
    k = len(f)
    inverse = 1.0 / (f[-1] * z_k) - 2.0 * np.arange(k - 1, -1, -1)
    return 1.0 / (f * inverse)


def equal_increment_angles(f: float | Float[np.ndarray, " n"], n: int, k: int, wrap: float) -> Layout:
    """Angles for equal tension increments, i.e. equal torque, of the first `k` of `n` linings (Z tables 5, 6).

        1/(f_i z_i) = 1/(f_{i+1} z_{i+1}) − 2,   β_{k+1} = … = β_n = β_k,   Σβ = wrap
        Π_k = (1/(f_k z_k) + 1)/(1/(f_1 z_1) − 1),   feasible while f_1 z_1 < 1

    - `f`: coefficient of friction, one or per lining;  `wrap` (rad);  `1 ≤ k ≤ n`

    Raises `InfeasibleLayout` where the wrap cannot be reached before `f_1 z_1 = 1`.
    """
    if not 1 <= k <= n:
        raise InfeasibleLayout(f"k = {k} linings at their limit must lie between 1 and n = {n}")
    friction = np.broadcast_to(np.asarray(f, float), (n,))[:k]
    if np.any(friction <= 0) or not 0 < wrap <= 2 * math.pi * (1 + 1e-12):
        raise InfeasibleLayout("friction must be positive and the wrap between 0 and 360°")

    def angles(z_k: float) -> Float[np.ndarray, " n"]:
        beta = 2 * np.arctan(_equal_increment_z(friction, z_k))
        return np.append(beta, np.full(n - k, beta[-1]))

    z_max = 1.0 / (friction[-1] * (1.0 + 2.0 * (k - 1)))  # there f_1 z_1 = 1
    if np.sum(angles(z_max)) <= wrap:
        raise InfeasibleLayout(
            f"equal tension increments of {k} of {n} linings reach f·tan(β_1/2) = 1 at a wrap of "
            f"{math.degrees(np.sum(angles(z_max))):.1f}°, below the {math.degrees(wrap):.1f}° asked for"
        )
    z_k = _root(lambda z: float(np.sum(angles(z))) - wrap, 1e-12 * z_max, z_max)
    beta = angles(z_k)
    first = friction[0] * math.tan(beta[0] / 2)
    last = friction[-1] * z_k
    return Layout(beta, (1 / last + 1) / (1 / first - 1), k)


def equal_load_angles(
    f: float | Float[np.ndarray, " n"], n: int, wrap: float, *, area: float | Float[np.ndarray, " n"] = 1.0
) -> Layout:
    """Angles for equal normal loads `N_i` of `n` sliding linings, or equal pressures `N_i/A_i` (model §2.2).

        s_i/((1 + f_i z_i) A_i) = s_{i+1}/((1 − f_{i+1} z_{i+1}) A_{i+1}),   Σβ = wrap

    followed from the tight end on the branch `z < f^(−1/3)`, where the left side peaks.

    Raises `InfeasibleLayout` where no lining of the branch carries the load, or a lining would lock itself.
    """
    friction = np.broadcast_to(np.asarray(f, float), (n,))
    areas = np.broadcast_to(np.asarray(area, float), (n,))
    if np.any(friction <= 0) or np.any(areas <= 0):
        raise InfeasibleLayout("friction and areas must be positive")

    def left(z: float, i: int) -> float:
        return z / math.sqrt(1 + z * z) / (1 + friction[i] * z) / areas[i]

    def right(z: float, i: int) -> float:
        return z / math.sqrt(1 + z * z) / (1 - friction[i] * z) / areas[i]

    def chain(z_n: float) -> Float[np.ndarray, " n"] | int:
        """`z` of all linings, or the index of the one that cannot carry the load."""
        z = np.empty(n)
        z[-1] = z_n
        for i in range(n - 2, -1, -1):
            if friction[i + 1] * z[i + 1] >= 1:
                return i + 1
            target = right(z[i + 1], i + 1)
            peak = friction[i] ** (-1 / 3)
            if target > left(peak, i):
                return i
            z[i] = _root(lambda s, i=i, target=target: left(s, i) - target, 0.0, peak)
        return z if friction[0] * z[0] < 1 else 0

    def surplus(z_n: float) -> float:
        z = chain(z_n)
        return 2 * math.pi if isinstance(z, int) else float(np.sum(2 * np.arctan(z))) - wrap

    low, high = 1e-12, math.tan(min(wrap, 0.999 * math.pi) / 2)
    if surplus(high) < 0:
        raise InfeasibleLayout(f"{n} linings of equal load cannot span {math.degrees(wrap):.1f}°")
    for _ in range(200):  # bisection: the chain ends abruptly where it becomes infeasible
        middle = 0.5 * (low + high)
        low, high = (middle, high) if surplus(middle) < 0 else (low, middle)
    z = chain(low)
    if isinstance(z, int) or abs(float(np.sum(2 * np.arctan(z))) - wrap) > 1e-9:
        at = chain(high)
        where = f"lining {at + 1}" if isinstance(at, int) else "a lining"
        raise InfeasibleLayout(
            f"equal loads on {n} linings over {math.degrees(wrap):.1f}°: {where} cannot carry the load "
            "(the load of one lining peaks at tan(β/2) = f^(−1/3), and f·tan(β/2) must stay below 1)"
        )
    fz = friction * z
    return Layout(2 * np.arctan(z), float(np.prod((1 + fz) / (1 - fz))), n)


def chord_equal_load_angles(f: float, k: int, beta_k: float, beta_k1: float) -> Float[np.ndarray, " k"]:
    """Chord angles `β_1…β_k` (rad) for equal normal loads `N_2 = … = N_k`, `β_k` and `β_{k−1}` given.

        m_j = (1 + f z_j)/(1 − f z_j),  p_j = z_j/(1 − f z_j),  j = k…3                                     (Z-11)
        z_{j−2} = m_{j−1} p_j/(1 − f m_{j−1} p_j)

    Raises `InfeasibleLayout` where a `1 − f z` or a denominator is not positive, or the chords do not fit.
    """
    z = np.full(k + 1, np.nan)
    z[k], z[k - 1] = math.tan(beta_k / 2), math.tan(beta_k1 / 2)
    for j in range(k, 2, -1):
        for i in (j, j - 1):
            if 1 - f * z[i] <= 0:
                raise InfeasibleLayout(f"chord {i}: 1 − f·tan(β_{i}/2) = {1 - f * z[i]:.4g} is not positive")
        m, p = (1 + f * z[j - 1]) / (1 - f * z[j - 1]), z[j] / (1 - f * z[j])
        denominator = 1 - f * m * p
        if denominator <= 0:
            raise InfeasibleLayout(f"chord {j - 2}: the denominator 1 − f m p = {denominator:.4g} is not positive")
        z[j - 2] = m * p / denominator
    beta = 2 * np.arctan(z[1:])
    if 1 - f * z[1] <= 0:
        raise InfeasibleLayout(f"chord 1: 1 − f·tan(β_1/2) = {1 - f * z[1]:.4g} is not positive")
    if np.sum(beta) > 2 * math.pi:
        raise InfeasibleLayout(f"the chords span {math.degrees(np.sum(beta)):.1f}°, more than the pulley has")
    return beta
