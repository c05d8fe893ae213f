"""What every brake has, whatever its kind: shaft, load and lever, heat, wear,
ledger."""

import abc
import copy
from itertools import pairwise

import numpy as np
from oracles.independent.stepping import AbstractModel, Law, Lines, Logged, Lumps

#: sizes below this share of a typical one are rounding
ROUNDING = 1e-11
OPEN = "open"
TAKE_UP = "take up"
ELASTIC = "elastic"
SLIP = "slip"
BACK = "slip back"
HELD = "held"


class Pair:
    """A friction pair at one instant: friction power (W) and load (N) of each lining,
    slip speed (m/s)."""

    def __init__(self, power, normal, slip):
        self.power = power
        self.normal = normal
        self.slip = np.abs(slip) + 0 * normal


class Brake(AbstractModel):
    """A brake with the states `φ, ω`, those of its own, works and heats, temperatures,
    wear of each pair.

    `p`: the numbers of the scene;  `pairs`: number of its friction pairs;  `own`: sizes
    of the states of its own
    """

    def __init__(self, p, pairs, own):
        self.p = p
        self.n = p["n"]
        self.log = []
        self.modes = []
        self.slopes = []
        self.start = 0.0
        self.end = p["end"]
        self.lever = copy.deepcopy(p["lever"])
        self.load = copy.deepcopy(p["load"])
        self.drag = p["drag"]
        self.J = p["J"] + p["hook_inertia"]
        self.law = law_of(p["law"], p.get("fade"))
        self.heat = None if p["heat"] is None else Lumps(p["heat"], self.n)
        self.pairs = pairs
        self.wears = p["wear"]
        self.force = self.lever.largest()
        self.torque = max(
            self.J * abs(p["omega"]), self.load.largest() + abs(p["hook_torque"]), 1.0
        )
        self.speed = max(abs(p["omega"]), 1.0)
        self.mode = OPEN
        self.first = True
        self.pulls = self.empties = False
        nodes = 0 if self.heat is None else self.n + 2
        worn = 0 if self.wears is None else self.n * pairs
        work = 0.5 * self.J * self.speed**2 + 1.0
        parts = [
            [1.0, self.speed],
            own,
            [work] * (3 + pairs),
            [10.0] * nodes,
            [1e-7] * worn,
        ]
        self.sizes = np.concatenate(parts)
        ends = np.cumsum([0, *map(len, parts)])
        _, self.OWN, self.WORK, self.T, self.WORN = (
            slice(a, b) for a, b in pairwise(ends)
        )
        self.y = np.zeros(len(self.sizes))
        self.y[1] = p["omega"]
        if p["heat"] is not None:
            self.y[self.T] = p["heat"]["start"]

    def knots(self):
        return [*self.lever.knots(), *self.load.knots()]

    def enter(self, begin, end):
        # a lever that comes down to nothing lets go, also where it pulls again from the
        # same instant on
        self.empties = (
            begin > self.start
            and self.pulls
            and abs(self.lever(begin)) <= ROUNDING * self.force
        )
        self.lever.enter(begin, end)
        self.load.enter(begin, end)
        self.begin, self.pulls = begin, self.lever.positive()

    @abc.abstractmethod
    def change(self, t, y, fired):
        """Find the mode at this instant, log it, and return the states after it."""

    def settle(self, t, y, fired):
        if not fired and self.empties and self.pulls:
            self.pulls = False
            y = self.change(t, y, [])
            self.pulls = True
        y = self.change(t, y, fired)
        self.modes.append((t, self.label()))
        return y

    def label(self):
        """The mode, as it is compared."""
        return (self.mode,)

    def lining_temperatures(self, y):
        return None if self.heat is None else y[self.T][1:-1]

    def driving(self, t, omega):
        """`M_load` (N·m)."""
        return self.load(t) + self.p["hook_torque"] - self.drag * omega

    def note(self, t, name, lining=None):
        self.log.append(Logged(t, name, lining))

    def friction_heat(self, pairs):
        """Heat flows (W) into the nodes."""
        assert self.heat is not None
        if len(pairs) == 1:
            return self.heat.into(pairs[0].power, self.p["heat"]["metal"], 0)
        return self.heat.into(
            pairs[0].power, self.p["heat"]["metal_out"], -1
        ) + self.heat.into(pairs[1].power, self.p["heat"]["metal"], 0)

    def warming(self, y, omega, flows):
        """Rates (K/s) of the nodes under the heat flows."""
        assert self.heat is not None
        speeds = (
            abs(omega) * self.p["track"],
            np.abs(self.bandage_speeds(y)) * self.p["R_b"],
        )
        closed = self.mode != OPEN
        staged = self.pairs > 1
        on_rim = ~self.off if staged else np.full(self.n, closed)
        return self.heat.rates(
            y[self.T], speeds, on_rim, closed if staged else True, flows
        )

    def bandage_speeds(self, y):
        """Speeds (rad/s) of the linings, each or all of them: 0 where these do not
        turn."""
        return 0.0

    def assembled(
        self,
        t,
        y,
        alpha,
        own,
        pairs,
        lever_power=0.0,
        damping=0.0,
        omega=None,
    ):
        """Rates of all states; `omega`: the speed where it is known better than by the
        state."""
        omega = float(y[1]) if omega is None else omega
        rates = np.zeros_like(y)
        rates[0] = omega
        rates[1] = alpha
        rates[self.OWN] = own
        works = [
            self.driving(t, omega) * omega,
            lever_power,
            damping,
            *(float(np.sum(k.power)) for k in pairs),
        ]
        rates[self.WORK] = works
        if self.heat is not None:
            rates[self.T] = self.warming(y, omega, self.friction_heat(pairs))
        if self.wears is not None:
            T = self.lining_temperatures(y)
            worn = []
            for k, pair, area in zip(self.wears, pairs, self.p["areas"], strict=True):
                rate = k["k"] * (
                    1 if T is None else np.maximum(1 + k["slope"] * (T - k["at"]), 0.0)
                )
                worn.append(rate * pair.normal / area * pair.slip)
            rates[self.WORN] = np.concatenate(worn)
        return rates

    def kinetic_energy(self, y):
        return 0.5 * self.J * float(y[1]) ** 2

    def stored(self, y):
        """Elastic energy (J)."""
        return 0.0

    def stands_or_goes(self, low, torque, high, fired):
        """Which way a brake at rest starts under the torque, 0: it is held between the
        limits."""
        if self.mode == HELD and "above" in fired:
            return 1
        if self.mode == HELD and "below" in fired:
            return -1
        spare = ROUNDING * self.torque
        return 1 if torque > high + spare else -1 if torque < low - spare else 0


def law_of(p, fade):
    """The friction law of a pair from its numbers."""
    return Law(p["kinetic"], p["static"], p.get("speed"), fade)


def answers(model, y):
    """What is compared at the end of a run."""
    first = model.y
    work = y[model.WORK]
    found = {
        "angle": float(y[0]),
        "speed": float(y[1]),
        "load work": float(work[0]),
        "lever work": float(work[1]),
        "damper heat": float(work[2]),
        "friction heat": float(work[3]),
        "kinetic change": model.kinetic_energy(y) - model.kinetic_energy(first),
        "elastic change": model.stored(y) - model.stored(first),
    }
    if model.pairs > 1:
        found["internal heat"] = float(work[4])
    if model.heat is not None:
        found["temperatures"] = y[model.T].copy()
    if model.wears is not None:
        found["worn"] = y[model.WORN].copy()
    return found


def names_of_change(before, after, first):
    """Names of the events in a change of mode of what a lever acts on, as
    docs/events_and_modes.md has them."""
    if before == after:
        return []
    if after == OPEN:
        return ["release"]
    if after == HELD:
        return [] if first or before == OPEN else ["stop"]
    found = []
    if after in (ELASTIC, SLIP, BACK):
        if before == HELD:
            found.append("restart")
        elif before in (OPEN, TAKE_UP):
            found.append("slip_onset")
        elif after == ELASTIC:
            found.append("restick")
        if after != ELASTIC:
            found.append("full_slip")
    return found


def names_with_a_bandage(names, before, after):
    """Names of the events of a staged brake: those of its band (`names_of_change`) and
    those of the rim.

    `before`, `after`: mode of the band, and 0 where the linings stick to the rim
    """
    (old, slid) = before
    (new, slides) = after
    if old != HELD and new == HELD and slides:
        names = ["external_lock"]
    if old == HELD and new != HELD and slid:
        names = ["external_release" if name == "restart" else name for name in names]
    if slid == 0 and slides:
        return [
            *(["restart"] if old == HELD and new == HELD else []),
            "internal_slip",
            *names,
        ]
    if slid and slides == 0:
        if new == HELD:
            return names if "stop" in names else [*names, "stop"]
        return [*names, "internal_restick"]
    return names


__all__ = [
    "BACK",
    "ELASTIC",
    "HELD",
    "OPEN",
    "ROUNDING",
    "SLIP",
    "TAKE_UP",
    "Brake",
    "Lines",
    "Pair",
    "answers",
]
