"""Disc and double-shoe brakes, and several rigid bands: the torque follows from the
force.

Moments of the shoes by quadrature.
"""

import numpy as np
from oracles.independent.base import (
    BACK,
    HELD,
    OPEN,
    SLIP,
    Brake,
    Pair,
    names_of_change,
)
from oracles.independent.draws import BANDS
from scenes import lining_ratio
from scipy.integrate import quad


def effective_radius(p):
    """`r_e` (m) of a pad: `∫ p r² dr/∫ p r dr` over its face."""
    pressure = (lambda r: 1 / r) if p["worn_in"] else (lambda r: 1.0)
    (a, b) = p["radii"]
    return (
        quad(lambda r: pressure(r) * r**2, a, b)[0]
        / quad(lambda r: pressure(r) * r, a, b)[0]
    )


def shoe_arms(p):
    """`M_N/N` and `M_F/(f N)` (m) of a shoe about its pin."""
    (begin, end) = p["angles"]
    a = p["pin"]
    r = p["radius"]
    normal = quad(np.sin, begin, end)[0]
    M_N = a * quad(lambda x: np.sin(x) ** 2, begin, end)[0]
    M_F = quad(lambda x: np.sin(x) * (r - a * np.cos(x)), begin, end)[0]
    return M_N / normal, M_F / normal


class Pressed(Brake):
    """`J ω̇ = M_load − M`, `M = ± r Σ f_i N_i`, up to the static limits while at
    rest."""

    def __init__(self, p):
        super().__init__(p, 1, [])
        self.shoes = p["kind"] == "shoe"
        if self.shoes:
            self.radius = p["radius"]
            self.arms = shoe_arms(p)
        elif p["kind"] == "disc":
            self.radius = effective_radius(p)

    def loads(self, force, f, back):
        """Normal forces (N) on linings that slide."""
        if not self.shoes:
            return np.full(self.n, force)
        leads = np.array([-1.0, 1.0]) if back else np.array([1.0, -1.0])
        return force * self.p["arm"] / (self.arms[0] - leads * f * self.arms[1])

    def friction(self, force, f, back):
        """Friction (N) at the radius of linings that slide."""
        return f * self.loads(force, f, back)

    def limits(self, t, y):
        """Least and largest torque (N·m) of a brake at rest."""
        f = np.broadcast_to(self.law.static(self.lining_temperatures(y)), (self.n,))
        F = self.lever(t)
        low, high = (float(np.sum(self.friction(F, f, back))) for back in (True, False))
        return -self.radius * low, self.radius * high

    def change(self, t, y, fired):
        y = y.copy()
        old = self.mode
        if "motion" in fired:
            y[1] = 0.0
        if not self.pulls:
            self.mode = OPEN
        elif y[1] != 0:
            self.mode = SLIP if y[1] > 0 else BACK
        else:
            low, high = self.limits(t, y)
            direction = self.stands_or_goes(low, self.driving(t, 0.0), high, fired)
            self.mode = {0: HELD, 1: SLIP, -1: BACK}[direction]
        for name in names_of_change(old, self.mode, self.first):
            self.note(t, name)
        self.first = False
        return y

    def _sliding(self, t, y):
        """The pair while it slides, and the brake torque (N·m)."""
        back = self.mode == BACK
        v = (-1 if back else 1) * float(y[1]) * self.radius
        f = self.law.kinetic(np.full(self.n, v), self.lining_temperatures(y))
        F = self.lever(t)
        each = self.friction(F, f, back)
        return Pair(each * v, self.loads(F, f, back), v), (
            -1 if back else 1
        ) * self.radius * float(np.sum(each))

    def rates(self, t, y):
        nothing = Pair(np.zeros(self.n), np.zeros(self.n), 0.0)
        M = self.driving(t, float(y[1]))
        if self.mode == HELD:
            return self.assembled(t, y, 0.0, [], [nothing], omega=0.0)
        if self.mode == OPEN:
            return self.assembled(t, y, M / self.J, [], [nothing])
        pair, torque = self._sliding(t, y)
        return self.assembled(t, y, (M - torque) / self.J, [], [pair])

    def guards(self, t, y):
        if self.mode == HELD:
            (low, high) = self.limits(t, y)
            M = self.driving(t, 0.0)
            return {"above": (high - M) / self.torque, "below": (M - low) / self.torque}
        if self.mode == OPEN:
            return {}
        return {"motion": (1 if self.mode == SLIP else -1) * float(y[1]) / self.speed}


class Bands(Pressed):
    """Rigid bands under one lever: `T_i = T_{i−1} μ_i^{±1}` along each, from its share
    of the tension."""

    def __init__(self, p):
        super().__init__(p)
        self.radius = p["R_b"]
        self.shares = p["given"] / np.sum(p["given"])
        if p["by_stiffness"]:
            start = None if p["heat"] is None else p["heat"]["start"][1:-1]
            f = self.law.kinetic(np.zeros(self.n), start)
            rise = [np.exp(np.sum((f * p["beta"])[a:b])) for a, b in BANDS]
            self.shares = p["stiffness"] / rise / np.sum(p["stiffness"] / rise)

    def tensions(self, force, f, back):
        """Tensions (N) ahead of every lining and behind it."""
        ahead = np.zeros(self.n)
        behind = np.zeros(self.n)
        mu = lining_ratio(f, self.p["beta"])
        mu = 1 / mu if back else mu
        for share, (first, last) in zip(self.shares, BANDS, strict=True):
            T = share * force
            for i in range(first, last):
                ahead[i] = T
                T = T * mu[i]
                behind[i] = T
        return ahead, behind

    def loads(self, force, f, back):
        ahead, behind = self.tensions(force, f, back)
        return (ahead + behind) * np.sin(self.p["beta"] / 2)

    def friction(self, force, f, back):
        ahead, behind = self.tensions(force, f, back)
        return np.abs(behind - ahead)
