"""Equations of a problem in NumPy, for tools that integrate them themselves."""

from typing import Any

import numpy as np

from . import crossings


class Network:
    """Bodies, contacts and springs; the state is all angles, then all speeds.

    A run of it too: `spans` are `(steps, y(t))` in order.
    """

    def __init__(self, problem: dict[str, Any]):
        self.problem = problem
        self.names = list(problem["bodies"])
        bodies = problem["bodies"].values()
        self.inertia = np.array([body["inertia"] for body in bodies])
        speeds = [body["speed"] for body in bodies]
        self.start = np.array([0.0] * len(speeds) + speeds)
        self.contacts = [self._row(one) for one in problem["contacts"]]
        self.springs = [self._row(one) for one in problem.get("springs", [])]
        times = {problem["end"]}
        for one in (*bodies, *problem["contacts"]):
            for given in one.values():
                if isinstance(given, dict):
                    times |= {t for t in given["times"] if 0 < t < problem["end"]}
        self.corners = sorted(times)
        self.events: list[tuple[str, int, float]] = []
        self.spans: list[Any] = []

    def _row(self, one: dict[str, Any]) -> np.ndarray:
        """1 at the first body, -1 at the second: times the speeds it is the slip."""
        first, second = one["between"]
        return np.array([float(n == first) - (n == second) for n in self.names])

    def pull(self, y: np.ndarray) -> float:
        """Torque of the spring."""
        stiffness = self.problem["springs"][0]["stiffness"]
        return stiffness * (self.springs[0] @ y[: len(self.names)])

    def torques(self, t: float, y: np.ndarray) -> np.ndarray:
        """Torques on the bodies without contacts."""
        bodies = self.problem["bodies"].values()
        found = np.array([at(body["torque"], t) for body in bodies])
        for row in self.springs:
            found -= row * self.pull(y)
        return found

    def limit(self, c: int, t: float, y: np.ndarray) -> float:
        """Kinetic limit of a contact."""
        one = self.problem["contacts"][c]
        share = one.get("limit_per_spring_torque")
        return at(one["limit"], t) + (share * self.pull(y) if share else 0.0)

    def static_ratio(self, c: int) -> float:
        return self.problem["contacts"][c].get("static_ratio", 1.0)

    def slip(self, c: int, y: np.ndarray) -> float:
        return self.contacts[c] @ y[len(self.names) :]

    # --- what has been found ---

    def now(self, t: float) -> np.ndarray:
        """The state at a time."""
        place = int(np.searchsorted([steps[-1] for steps, _ in self.spans], t))
        return self.spans[min(place, len(self.spans) - 1)][1](t)

    def state(self, body: str, t: float) -> tuple[float, float]:
        y = self.now(t)
        which = self.names.index(body)
        return float(y[which]), float(y[len(self.names) + which])

    @property
    def steps(self) -> np.ndarray:
        return np.concatenate([steps for steps, _ in self.spans])

    def turns(self, body: str) -> list[float]:
        return [t for t, _ in crossings(self.steps, lambda t: self.state(body, t)[1])]


def at(given: Any, t: float) -> float:
    """A number, or straight lines between points."""
    if isinstance(given, dict):
        return float(np.interp(t, given["times"], given["values"]))
    return given
