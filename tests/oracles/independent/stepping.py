"""Integration from event to event with SciPy's DOP853; modes, guards and changes of
mode are the model's own."""

import abc
from typing import NamedTuple

import numpy as np
from scipy.integrate import DOP853, solve_ivp
from scipy.optimize import brentq, minimize_scalar

RTOL = 1e-11
#: a guard is armed once it has been above this; all are of the order 1
_ARMED = 1e-9
#: guards that are reached together
_TOGETHER = 1e-10
#: points inside a step at which the guards are evaluated, as shares of it; in the first
#: after an event more near it
_INSIDE = np.linspace(0.0, 1.0, 8)[1:]
_AFTER_EVENT = np.concatenate([np.geomspace(1e-6, 0.1, 11), _INSIDE])
#: a guard below this may dip under 0 between two points
_NEAR = 0.05
#: least number of steps of a run
_STEPS = 60
#: changes of mode at one instant
_CHAIN = 60


class Logged(NamedTuple):
    """An event: time (s), name, lining (from 1) where it concerns one."""

    time: float
    name: str
    lining: int | None = None


class AbstractModel(abc.ABC):
    """A brake: states `y`, and a mode that is kept in attributes."""

    start: float
    end: float
    y: np.ndarray
    #: typical sizes of the states, for the absolute tolerance
    sizes: np.ndarray
    log: list[Logged]
    #: times at which guards came to 0, and how fast they did (1/s)
    slopes: list[tuple[float, float]]

    @abc.abstractmethod
    def knots(self):
        """Known times of the given functions."""

    @abc.abstractmethod
    def enter(self, begin, end):
        """A stretch of time begins on which all given functions are smooth."""

    def leave(self, t, y):  # noqa: B027 (most have nothing to do)
        """Such a stretch ends."""

    @abc.abstractmethod
    def settle(self, t, y, fired):
        """Find the mode at this instant, log what happened, and return the states after
        it."""

    @abc.abstractmethod
    def rates(self, t, y):
        """Rates of the states in the mode."""

    @abc.abstractmethod
    def guards(self, t, y):
        """Margins by name, positive while the mode holds (the same names while the mode
        is the same)."""


class _Found(NamedTuple):
    t: float
    y: np.ndarray
    fired: list[str]
    slope: float = -np.inf


def _exactly(model, t, y, until):
    if until <= t:
        return y
    out = solve_ivp(
        model.rates,
        (t, until),
        y,
        "DOP853",
        rtol=RTOL / 10,
        atol=RTOL / 10 * model.sizes,
    )
    return out.y[:, -1]


def _land(
    model,
    t,
    y,
    dense,
    name,
    low,
    high,
):
    """Time and states where a guard is 0, and its rate: from the interpolant, then by
    steps that end there."""

    def value(s):
        return model.guards(s, dense(s))[name]

    root = (
        float(brentq(value, low, high, xtol=1e-15, rtol=1e-14))
        if value(low) > 0
        else low
    )
    reach = max(1e-6 * (high - low), 1e-13 * max(1.0, abs(high)))
    slope = (value(root + reach) - value(root - reach)) / (2 * reach)
    at = _exactly(model, t, y, root)
    for _ in range(4):
        gap = model.guards(root, at)[name]
        if slope == 0 or abs(gap) < 1e-14:
            break
        moved = min(max(root - gap / slope, low), high)
        if abs(moved - root) < 1e-15 * max(1.0, abs(root)):
            break
        root = moved
        at = _exactly(model, t, y, moved)
    return root, at, slope


def _advance(model, t, y, until):
    """Integrate to the first guard or to `until`."""
    longest = (model.end - model.start) / _STEPS
    atol = RTOL * model.sizes
    solver = DOP853(model.rates, t, y, until, rtol=RTOL, atol=atol, max_step=longest)
    names = list(model.guards(t, y))
    last = np.array(list(model.guards(t, y).values()))
    armed = last > _TOGETHER
    at = t
    first_step = True
    # marks say nothing of the mode
    holding = np.array([not name.startswith("limit") for name in names], bool)
    while solver.status == "running":
        solver.step()
        if solver.status == "failed" or solver.t_old is None:
            raise RuntimeError(f"DOP853 came to no end at {solver.t:.9g} s")
        dense = solver.dense_output()
        before = solver.t_old
        y_before = dense(before)
        for share in _AFTER_EVENT if first_step else _INSIDE:
            s = before + share * (solver.t - before)
            here = np.array(list(model.guards(s, dense(s)).values()))
            lost = ~armed & holding & (here < -1e-6) & (last < -1e-7)
            if np.any(lost):
                raise RuntimeError(
                    f"at {s:.9g} s a mode holds that cannot: {names[int(np.argmax(lost))]}"
                )
            past = [(i, s) for i in np.flatnonzero(armed & (here < 0))]
            near = np.flatnonzero(
                armed & holding & (here >= 0) & (np.minimum(here, last) < _NEAR)
            )
            past += [
                (i, low)
                for i in near
                if (low := _dip(model, dense, names[i], at, s)) is not None
            ]
            if past:
                found = [
                    (*_land(model, before, y_before, dense, names[i], at, high), i)
                    for i, high in past
                ]
                root, y_root, slope, first = min(found, key=lambda one: one[0])
                if until - root < 1e-12 * max(1.0, until):  # the known time comes first
                    return _Found(until, y_root, [])
                values = np.array(list(model.guards(root, y_root).values()))
                together = [
                    i
                    for i in range(len(names))
                    if i == first or (armed[i] and values[i] < _TOGETHER)
                ]
                return _Found(root, y_root, [names[i] for i in together], slope)
            armed = armed | (here > _ARMED)
            last = here
            at = s
        first_step = False
    return _Found(until, solver.y, [])


def _dip(
    model,
    dense,
    name,
    low,
    high,
):
    """A time between two at which a guard is positive and at which it is not, if there
    is one."""

    def value(s):
        return model.guards(s, dense(s))[name]

    reach = 1e-3 * (high - low)
    if (
        reach <= 1e-12 * max(1.0, abs(high))
        or value(low + reach) >= value(low)
        or value(high - reach) >= value(high)
    ):
        return None
    least = minimize_scalar(
        value,
        bounds=(low, high),
        method="bounded",
        options={"xatol": 1e-6 * (high - low)},
    )
    return float(least.x) if least.fun < 0 else None


def integrate(model):
    """Run a model to its end; its events are in `model.log`. Returns the states at the
    end."""
    t = model.start
    y = model.y
    inside = sorted({knot for knot in model.knots() if model.start < knot < model.end})
    for stop, after in zip(
        [*inside, model.end], [*inside[1:], model.end, model.end], strict=False
    ):
        if t == model.start:
            model.enter(t, stop)
            y = model.settle(t, y, [])
        chain = 0
        last = t
        while t < stop:
            t, y, fired, slope = _advance(model, t, y, stop)
            if fired:
                model.slopes.append((t, abs(slope)))
                y = model.settle(t, y, fired)
                chain = chain + 1 if t == last else 0
                last = t
                if chain > _CHAIN:
                    raise RuntimeError(f"the mode changes again and again at {t:.9g} s")
        if stop < model.end:
            model.leave(stop, y)
            model.enter(stop, after)
            y = model.settle(t, y, [])
    return y


# --- given functions of time --------------------------------------------------------


class Lines:
    """Straight lines between points, constant outside of them; two points at one time
    are a jump."""

    def __init__(self, times, values):
        self.times = [float(t) for t in times]
        self.values = [float(v) for v in values]
        self.at = 0.0
        self.level = 0.0
        self.slope = 0.0

    def knots(self):
        return self.times

    def enter(self, begin, end):
        middle = 0.5 * (begin + end)
        k = int(np.searchsorted(self.times, middle))
        if k == 0 or k == len(self.times):
            self.at, self.level, self.slope = (
                begin,
                self.values[min(k, len(self.times) - 1)],
                0.0,
            )
            return
        (t_0, t_1) = self.times[k - 1 : k + 1]
        (v_0, v_1) = self.values[k - 1 : k + 1]
        self.at = t_0
        self.level = v_0
        self.slope = (v_1 - v_0) / (t_1 - t_0)

    def __call__(self, t):
        return self.level + self.slope * (t - self.at)

    def rate(self, t):
        return self.slope

    def positive(self):
        """Whether it is above 0 on the stretch (its values are never below)."""
        return self.level > 0 or self.slope > 0

    def largest(self):
        return max(abs(v) for v in self.values)


class Filling(Lines):
    """`p_1 (1 − exp(−(t − t_0)/t_i))` from `t_0` on."""

    def __init__(self, level, time_constant, begin):
        super().__init__([begin], [level])
        self.full = level
        self.tau = time_constant
        self.begin = begin
        self.on = False

    def enter(self, begin, end):
        self.on = 0.5 * (begin + end) > self.begin

    def __call__(self, t):
        return (
            -self.full * float(np.expm1(-(t - self.begin) / self.tau))
            if self.on
            else 0.0
        )

    def rate(self, t):
        return (
            self.full / self.tau * float(np.exp(-(t - self.begin) / self.tau))
            if self.on
            else 0.0
        )

    def positive(self):
        return self.on


# --- friction laws and heat ---------------------------------------------------------


class Law:
    """`f_k`, or `f_k + (f_s − f_k) exp(−(v/v_s)²)`, times a fade
    `max(φ_min, 1 − s (T − T_p)₊)`, corners rounded."""

    def __init__(
        self,
        kinetic,
        static,
        speed=None,
        fade=None,
    ):
        self.k = np.asarray(kinetic, float)
        self.s = np.asarray(static, float)
        self.speed = speed
        self.fade_of = fade

    def _base(self, v):
        if self.speed is None:
            return self.k + 0 * v
        # past the end of a slide the curve goes on with its slope, which is 0 there
        decay = np.exp(-((v / self.speed) ** 2))
        return np.where(
            v >= 0,
            self.k + (self.s - self.k) * decay,
            2 * self.s - self.k - (self.s - self.k) * decay,
        )

    def _base_slope(self, v):
        if self.speed is None:
            return 0 * v
        bend = -2 * np.abs(v) / self.speed**2 * np.exp(-((v / self.speed) ** 2))
        return (self.s - self.k) * bend

    @staticmethod
    def _rounded(x, w):
        u = (x + w) / (2 * w)
        inside = (
            w * u**5 * (14 - 28 * u + 20 * u**2 - 5 * u**3),
            u**4 * (35 - 84 * u + 70 * u**2 - 20 * u**3),
        )
        return (
            np.where(x >= w, x, np.where(x <= -w, 0.0, inside[0])),
            np.where(x >= w, 1.0, np.where(x <= -w, 0.0, inside[1])),
        )

    def fade(self, T):
        """The factor at the temperatures `T` (K), and its slope."""
        if self.fade_of is None:
            return 1.0, 0.0
        p = self.fade_of
        above, bend = self._rounded(T - p["above"], p["blend"])
        left, slope = self._rounded(
            1 - p["slope"] * above - p["floor"], p["slope"] * p["blend"]
        )
        return p["floor"] + left, -slope * p["slope"] * bend

    def kinetic(self, v, T):
        return self._base(v) * self.fade(T)[0]

    def by_speed(self, v, T):
        return self._base_slope(v) * self.fade(T)[0]

    def by_temperature(self, v, T):
        return self._base(v) * self.fade(T)[1]

    def static(self, T):
        return self.s * self.fade(T)[0]


class Lumps:
    """Rim, linings (one node each), band: convection and radiation into the air,
    contact on both sides of the linings.

    Of a standard brake, the linings leave the rim with an open band; of a staged one
    they leave the band, and those that lift off leave the rim, with their part of what
    linings cover of it.
    """

    def __init__(self, p, n):
        self.p = p
        self.n = n
        self.capacity = np.concatenate(
            [[p["rim"]], np.full(n, p["lining"]), [p["band"]]]
        )

    def rates(
        self,
        T,
        speeds,
        on_rim,
        on_band,
        friction,
    ):
        """Rates (K/s) under the heat flows `friction` (W) into the nodes; `speeds`
        (m/s) of rim and linings.

        - `on_rim` (n,): which linings touch it;  `on_band`: whether they touch the band
        """
        p = self.p
        air = self.p["air"]
        flow = np.array(friction, float)
        open_share = 1 - p["covered"] * np.mean(on_rim)
        h, h_linings = (
            p["h"] * (1 + (v / p["h_speed"]) ** 2) ** (0.5 * 0.8) for v in speeds
        )
        exchanged = p["contact"] * on_rim * (T[0] - T[1:-1])
        flow[0] -= np.sum(exchanged)
        flow[1:-1] += exchanged - p["lining_area"] * h_linings * (T[1:-1] - air)
        flow[0] -= open_share * p["rim_area"] * h * (T[0] - air)
        flow[0] -= (
            open_share
            * p["rim_area"]
            * p["emissivity"]
            * 5.670374419e-8
            * (T[0] ** 4 - air**4)
        )
        across = p["conductance"] * on_band * (T[1:-1] - T[-1])
        flow[1:-1] -= across
        flow[-1] += np.sum(across) - p["band_loss"] * (T[-1] - air)
        return flow / self.capacity

    def into(self, power, share, metal):
        """Heat flows into the nodes of the friction power of each lining: a share into
        rim (0) or band (−1)."""
        flow = np.zeros(self.n + 2)
        flow[1:-1] = (1 - share) * power
        flow[metal] += share * np.sum(power)
        return flow
