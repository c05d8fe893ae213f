"""The resolved chain: linings that stick and slide one by one on segments of the
band."""

from typing import NamedTuple

import numpy as np
from oracles.independent.base import (
    BACK,
    ELASTIC,
    HELD,
    SLIP,
    Brake,
    Pair,
    names_of_change,
)

#: a lining that is nearer to its limit than this share of a typical tension is at it
_AT = 1e-10


class Now(NamedTuple):
    """Forces and accelerations at one instant."""

    alpha: float
    force: np.ndarray  # G_i (N)
    limit: np.ndarray  # up to which a lining sticks (N)
    slip: np.ndarray  # R_b ω − u̇_i (m/s)
    acceleration: np.ndarray  # ü_i (m/s²)
    total: np.ndarray  # tension of a segment if it could push (N)
    damping: float  # W
    normal: np.ndarray


class Chain(Brake):
    """`m_i ü_i = G_i + T_{i−1} − T_i`, `J ω̇ = M_load − R_b Σ G_i`; states `u_i`,
    `u̇_i`."""

    def __init__(self, p):
        q = p["segments"]
        n = p["n"]
        self.K = np.append(q["stiffness"], p["C"])
        self.m = q["mass"]
        between = (
            2 * q["damping"] * np.sqrt(self.K[:-1] * 0.5 * (self.m[1:] + self.m[:-1]))
        )
        self.D = np.append(between, q["anchor"])
        self.pre = p["C"] * p["x"]
        speed = p["R_b"] * max(abs(p["omega"]), 1.0)
        super().__init__(
            p, 1, [p["lever"].largest() / float(np.min(self.K))] * n + [speed] * n
        )
        self.R_b = p["R_b"]
        self.sine = np.sin(p["beta"] / 2)
        self.cosine = np.cos(p["beta"] / 2)
        self.y[self.OWN][n:] = p["R_b"] * p["omega"]
        self.linings = np.zeros(n, int)
        self.taut = np.ones(n, bool)
        self.mode = HELD if p["omega"] == 0 else ELASTIC
        self.sense = -1 if p["omega"] < 0 else 1

    def label(self):
        return (self.mode, *map(int, self.linings))

    def now(self, t, y):
        u, v = np.split(y[self.OWN], 2)
        T_0 = self.lever(t)
        omega = float(y[1])
        sticks = self.linings == 0
        v = np.where(sticks, self.R_b * omega, v)
        elastic = self.pre + self.K * (u - np.append(u[1:], 0.0))
        stretching = v - np.append(v[1:], 0.0)
        total = elastic + self.D * stretching
        tension = np.where(self.taut, total, 0.0)
        before = np.append(T_0, tension[:-1])
        slip = self.R_b * omega - v
        normal = (tension + before) * self.sine
        T = self.lining_temperatures(y)
        G = (
            self.linings
            * self.law.kinetic(self.linings * slip, T)
            * normal
            / self.cosine
        )
        carried = float(np.sum(np.where(sticks, tension - before, G)))
        inertia = self.J + self.R_b**2 * float(np.sum(self.m[sticks]))
        alpha = (self.driving(t, omega) - self.R_b * carried) / inertia
        G = np.where(sticks, self.m * self.R_b * alpha + tension - before, G)
        limit = self.law.static(T) * normal / self.cosine
        acceleration = np.where(
            sticks, self.R_b * alpha, (G + before - tension) / self.m
        )
        damping = float(np.sum((tension - np.maximum(elastic, 0.0)) * stretching))
        return Now(alpha, G, limit, slip, acceleration, total, damping, normal)

    def rates(self, t, y):
        now = self.now(t, y)
        v = np.split(y[self.OWN], 2)[1]
        v = np.where(self.linings == 0, self.R_b * float(y[1]), v)
        pair = Pair(now.force * now.slip, now.normal, now.slip)
        power = self.lever(t) * float(v[0])
        return self.assembled(
            t, y, now.alpha, np.append(v, now.acceleration), [pair], power, now.damping
        )

    def guards(self, t, y):
        now = self.now(t, y)
        each = np.where(
            self.linings == 0,
            (now.limit - np.abs(now.force)) / self.force,
            self.linings * now.slip / (self.R_b * self.speed),
        )
        found = {f"lining {i}": float(each[i]) for i in range(self.n)}
        found |= {
            f"taut {i}": float(x) / self.force
            for i, x in enumerate(np.where(self.taut, 1, -1) * now.total)
        }
        if self.mode != HELD:
            found["motion"] = self.sense * float(y[1]) / self.speed
        return found

    def change(self, t, y, fired):
        y = y.copy()
        old = self.mode
        before = self.linings.copy()
        if self.first:
            self.taut = self.now(t, y).total > 0
        for name in fired:
            if name.startswith("taut"):
                self.taut[int(name.split()[1])] ^= True
        marked = [int(name.split()[1]) for name in fired if name.startswith("lining")]
        for _ in range(2 * self.n + 2):
            now = self.now(t, y)
            was = self.linings.copy()
            for i in range(self.n):
                past = (
                    abs(now.force[i])
                    > now.limit[i] + (_AT if i not in marked else -1e-6) * self.force
                )
                if was[i] == 0 and past:
                    self.linings[i] = 1 if now.force[i] > 0 else -1
                    self.note(t, "lining_slip", i + 1)
                elif was[i] != 0 and i in marked:
                    self.linings[i] = 0
                    self.note(t, "lining_stick", i + 1)
            marked = []
            self._stick_at_once(t, y, was)
            if np.array_equal(was, self.linings):
                break
        own = y[self.OWN]
        own[self.n :] = np.where(self.linings == 0, self.R_b * y[1], own[self.n :])
        self._label(t, y, old, before, "motion" in fired)
        return y

    def _stick_at_once(self, t, y, was):
        """A lining that lets go together with others sticks again where it would slide
        the other way."""
        now = self.now(t, y)
        for i in range(self.n):
            away = self.linings[i] * (self.R_b * now.alpha - now.acceleration[i])
            if (
                was[i] == 0
                and self.linings[i]
                and away < -1e-6 * self.force / self.m[i]
            ):
                self.linings[i] = 0
                self.note(t, "lining_stick", i + 1)

    def _label(self, t, y, old, before, stops):
        ahead = bool(np.all(self.linings > 0))
        back = bool(np.all(self.linings < 0))
        restarts = (
            old == HELD and (ahead or back) and not np.array_equal(before, self.linings)
        )
        self.mode = SLIP if ahead else BACK if back else ELASTIC
        if (old == HELD and not restarts) or stops:
            self.mode = HELD
        if restarts:
            self.sense = -1 if y[1] < 0 else 1 if y[1] > 0 else -1 if back else 1
        for name in names_of_change(old, self.mode, self.first):
            self.note(t, name)
        self.first = False

    def stored(self, y):
        u = np.split(y[self.OWN], 2)[0]
        tension = np.maximum(self.pre + self.K * (u - np.append(u[1:], 0.0)), 0.0)
        return float(np.sum(tension**2 / (2 * self.K)))

    def kinetic_energy(self, y):
        v = np.split(y[self.OWN], 2)[1]
        return super().kinetic_energy(y) + 0.5 * float(np.sum(self.m * v**2))
