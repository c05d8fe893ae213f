"""SciPy's `solve_ivp` with terminal events: every contact sticks or slips.

Bodies that stick together have one acceleration. A segment ends at a corner of a given
torque, where a contact that sticks is at its limit, or where a slip speed comes to 0;
then come the first states that agree with their own forces, most of them sticking.
"""

import itertools
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from .networks import Network

#: a limit may be exceeded by this share, which is rounding
ROUNDING = 1e-12
#: after an event forces are compared with limits this much later (s)
LATER = 1e-9


class Run(Network):
    """A run; `states` are 0 of a contact that sticks, else the sign of its slip."""

    def __init__(self, problem: dict[str, Any]):
        super().__init__(problem)
        self.count = len(self.names)
        t = 0.0
        y = self.start
        states = tuple(int(np.sign(self.slip(c, y))) for c in range(len(self.contacts)))
        fired = None
        for stop in self.corners:
            longest = (stop - t) / 8
            while t < stop:
                self.follow(
                    y[self.count :],
                    [s == 0 or c == fired for c, s in enumerate(states)],
                )
                states = self.next_states(t, y, states)
                t, y, fired = self.segment(t, y, stop, states, longest)

    def follow(self, of: np.ndarray, sticking: Any) -> None:
        """Gives bodies that stick the value of what they stick to, to the last bit."""
        for c, row in reversed(list(enumerate(self.contacts))):
            if sticking[c]:
                of[row > 0] = 0.0
                of[row > 0] = -row @ of

    def forces(self, t: float, y: np.ndarray, states: Any) -> tuple[Any, Any]:
        """Accelerations of the bodies, and torques of all contacts."""
        torques = [s * self.limit(c, t, y) for c, s in enumerate(states)]
        left = self.torques(t, y) - np.dot(torques, self.contacts)
        sticking = [s == 0 for s in states]
        # a body that sticks hangs on the next one
        inertia = self.inertia.copy()
        whole = left.copy()
        for row in itertools.compress(self.contacts, sticking):
            inertia[row < 0] += inertia[row > 0]
            whole[row < 0] += whole[row > 0]
        acceleration = whole / inertia
        self.follow(acceleration, sticking)
        left -= self.inertia * acceleration
        for c, row in enumerate(self.contacts):
            if sticking[c]:
                torques[c] = left[row > 0][0]
                left -= row * torques[c]
        return acceleration, torques

    def reserve(self, c: int, t: float, y: np.ndarray, torque: float) -> float:
        """Static limit less the torque."""
        ratio = self.static_ratio(c) * (1 + ROUNDING)
        return ratio * self.limit(c, t, y) - abs(torque)

    def next_states(self, t: float, y: np.ndarray, before: Any) -> Any:
        choices = [
            (0, 1, -1) if slip == 0 else (int(np.sign(slip)),)
            for slip in (self.slip(c, y) for c in range(len(self.contacts)))
        ]
        after = t + LATER
        moved = y + LATER * np.concatenate([y[self.count :], np.zeros(self.count)])
        for states in sorted(itertools.product(*choices), key=np.count_nonzero):
            acceleration, torques = self.forces(after, moved, states)
            if all(
                self.reserve(c, after, moved, torques[c]) >= 0
                if s == 0
                else s * self.slip(c, y) > 0
                or s * (self.contacts[c] @ acceleration) > 0
                for c, s in enumerate(states)
            ):
                break
        else:
            raise RuntimeError(f"no states agree with their forces at {t} s")
        for c, (old, new) in enumerate(zip(before, states, strict=True)):
            if bool(old) != bool(new):
                self.events.append(("slip" if new else "stick", c, t))
        return states

    def segment(
        self, t: float, y: np.ndarray, stop: float, states: Any, longest: float
    ):
        """Up to an event or to `stop`: time, state, and the contact whose slip ended."""

        def rhs(t: float, y: np.ndarray) -> np.ndarray:
            return np.concatenate([y[self.count :], self.forces(t, y, states)[0]])

        def guard(c: int) -> Any:
            def value(t: float, y: np.ndarray) -> float:
                if states[c]:
                    return states[c] * self.slip(c, y)
                return self.reserve(c, t, y, self.forces(t, y, states)[1][c])

            value.terminal = True
            value.direction = -1
            return value

        guards = [guard(c) for c in range(len(states))]
        found = solve_ivp(
            rhs,
            (t, stop),
            y,
            "DOP853",
            events=guards,
            dense_output=True,
            max_step=longest,
            rtol=1e-12,
            atol=1e-13,
        )
        self.spans.append((found.t, found.sol))
        fired = [
            c for c, times in enumerate(found.t_events) if len(times) and states[c]
        ]
        return found.t[-1], found.y[:, -1].copy(), fired[0] if fired else None


solve = Run
