"""Smoothed friction in SciPy's `solve_ivp`: torque over slip speed as `tanh`, with a
static peak, as in simulators without events."""

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from . import crossings
from .networks import Network

#: slip speed over which friction rises (rad/s)
THRESHOLD = 1e-3
#: a contact counts as slipping above so many of them
SLIPS = 5


class Smoothed(Network):
    """A run of the smoothed problem."""

    def __init__(self, problem: dict[str, Any]):
        super().__init__(problem)
        t = 0.0
        y = self.start
        for stop in self.corners:
            found = solve_ivp(
                self.rhs,
                (t, stop),
                y,
                "Radau",
                dense_output=True,
                rtol=1e-8,
                atol=1e-10,
            )
            self.spans.append((found.t, found.sol))
            t = stop
            y = found.y[:, -1]
        for c in range(len(self.contacts)):
            self.events += [
                ("slip" if way > 0 else "stick", c, t)
                for t, way in crossings(self.steps, lambda t: self.over(c, t))
            ]
        self.events.sort(key=lambda event: event[-1])

    def over(self, c: int, t: float) -> float:
        """Slip speed above that from which a contact counts as slipping."""
        return abs(self.slip(c, self.now(t))) - SLIPS * THRESHOLD

    def rhs(self, t: float, y: np.ndarray) -> np.ndarray:
        torques = self.torques(t, y)
        for c, row in enumerate(self.contacts):
            v = self.slip(c, y) / THRESHOLD
            peak = 1 + (self.static_ratio(c) - 1) * np.exp(-((v / 10) ** 2))
            torques -= row * self.limit(c, t, y) * peak * np.tanh(v)
        return np.concatenate([y[len(self.names) :], torques / self.inertia])


solve = Smoothed
