"""The equations mode by mode in plain floats and small NumPy, as a careful user of a
general solver writes them.

Products that stay the same are hoisted, matrices are built once, and Jacobians are
given.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.automaton import Automaton, Guard, Mode
from benchmarks.chain import chain
from benchmarks.cycles import cycles
from benchmarks.scenes import Case, Chain, Cycles, Staged, Stop
from benchmarks.staged import staged

Segment = Callable[[str, float, Any, float], tuple[float, Any, int | None]]


def drive(
    automaton: Automaton, case: Case, segment: Segment
) -> tuple[np.ndarray, np.ndarray]:
    """Runs the modes one after the other: `segment(mode, t, y, stop)` gives the time
    and state where it ended, and the index of the guard that ended it (`None`: it came
    to `stop`). Returns the times of the events and the final state.
    """
    t = 0.0
    name = automaton.mode
    y = automaton.state
    modes = automaton.modes
    names = []
    times = []
    last = name
    stops = iter((*automaton.knots, automaton.end))
    stop = next(stops)
    while stop is not None:
        mode = modes[name]
        if mode.rhs is None:
            t = stop
            fired = None
        else:
            t, y, fired = segment(name, t, y, stop)
        if fired is not None:
            guard = mode.guards[fired]
            if guard.event is not None:
                names.append(guard.event)
                times.append(t)
            name = guard.mode if isinstance(guard.mode, str) else guard.mode(t, y)
            y = guard.state(t, y)
        else:
            last = name
            name = mode.then or name
            stop = next(stops, None)
    return _in_order(case.events, names, times), automaton.final(last, y)


def _in_order(
    events: tuple[str, ...], names: list[str], times: list[float]
) -> np.ndarray:
    """Times of the scene's events; NaN for one that did not come, or not as often."""
    if tuple(names) == events:
        return np.array(times)
    logged = {
        event: iter([t for name, t in zip(names, times, strict=True) if name == event])
        for event in events
    }
    return np.array([next(logged[event], np.nan) for event in events])


def automaton_of(case: Case) -> Automaton:
    """The modes of a scene."""
    if isinstance(case.plain, Staged):
        return staged(case.plain)
    if isinstance(case.plain, Chain):
        return chain(case.plain)
    if isinstance(case.plain, Cycles):
        return cycles(case.plain)
    return _stop(case.plain)


def _stop(p: Stop) -> Automaton:
    """Take-up, elastic, full slip, held; states (ω, φ, x), in full slip (ω, φ, T…),
    held (φ, T…, x) with x frozen.

    With heat the band sticks again shortly before the stop: the rim's surface cools,
    friction recovers, `v_s = 0` comes before `ω = 0`; then the states are (ω, φ, x,
    T…).
    """
    R = p.R
    C = p.C
    T_0 = p.T_0
    Pi = p.Pi
    k = R * C / p.J
    swing = R * T_0 / p.J
    sizes = np.array([20.0, 10.0, 0.3])
    take_up = Mode(
        lambda t, y: (0.0, y[0], R * y[0]),
        lambda t, y: np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [R, 0.0, 0.0]]),
        (Guard("slip onset", lambda t, y: T_0 - C * y[2], "elastic", lambda t, y: y),),
        sizes,
    )
    T_full = T_0 * Pi
    cold = np.zeros(0 if p.rates is None else len(p.rates))
    elastic = Mode(
        lambda t, y: (swing - k * y[2], y[0], R * y[0]),
        lambda t, y: np.array([[0.0, 0.0, -k], [1.0, 0.0, 0.0], [R, 0.0, 0.0]]),
        (
            Guard(
                "full slip",
                lambda t, y: T_full - C * y[2],
                "slip",
                lambda t, y: np.concatenate([y[:2], cold]),
            ),
        ),
        sizes,
    )
    modes = _dry_slip(p) if p.rates is None else _hot_slip(p)

    def final(mode: str, y: Any) -> np.ndarray:
        if mode != "held":
            raise RuntimeError(f"ended in the mode {mode}: an event was missed")
        return np.concatenate([y[:1], y[-1:], y[1:-1]])

    fastest = 1e-2 if p.rates is None else 0.03 / float(np.max(-np.diag(p.rates)))
    modes |= {"take_up": take_up, "elastic": elastic}
    start = np.array([p.w_0, 0.0, p.x_0])
    return Automaton(
        modes, "elastic" if p.x_0 else "take_up", start, p.end, final, fastest=fastest
    )


def _dry_slip(p: Stop) -> dict[str, Mode]:
    slowing = -p.R * p.T_0 * (p.Pi - 1) / p.J
    x = p.T_0 * p.Pi / p.C
    jacobian = np.array([[0.0, 0.0], [1.0, 0.0]])
    stop = Guard("stop", lambda t, y: y[0], "held", lambda t, y: np.array([y[1], x]))
    slip = Mode(
        lambda t, y: (slowing, y[0]),
        lambda t, y: jacobian,
        (stop,),
        np.array([20.0, 10.0]),
    )
    return {"slip": slip, "held": Mode(None, None, (), np.array([10.0, 0.3]))}


def _slipping(p: Stop) -> Mode:
    """Full slip with `v_s = (R ω − ẋ_0)/(1 + γ)`: the sliding band follows the fading
    friction (model §3)."""
    assert p.rates is not None
    assert p.into is not None
    R = p.R
    C = p.C
    T_0 = p.T_0
    n = p.n
    rates = p.rates
    k = len(rates)
    fz_0 = p.f * p.z
    q = p.f * p.z * p.fade
    arm = R / p.J
    per_C = 1 / p.C
    a = float(p.into[0])
    M = np.zeros((k + 2, k + 2))
    M[1, 0] = 1.0
    M[2:, 2:] = rates
    into = np.concatenate([[0.0, 0.0], p.into])
    spots = [(int(i), float(into[i])) for i in np.flatnonzero(into)]
    own = M[2].copy()

    def grip(T: float) -> tuple[float, float, float]:
        """`T_n − T_0`, its derivative by the temperature, and `1 − (f z)²`."""
        fz = fz_0 - q * T
        T_n = T_0 * ((1 + fz) / (1 - fz)) ** n
        rest = 1 - fz * fz
        return T_n - T_0, -2 * n * q * T_n / rest, rest

    def rhs(t: float, y: Any) -> np.ndarray:
        out = M @ y
        g, slope, _ = grip(y.item(2))
        fall = slope * per_C
        P = g * (R * y.item(0) - fall * out.item(2)) / (1 + fall * a * g)
        out[0] = -arm * g
        for i, d in spots:
            out[i] += d * P
        return out

    def jacobian(t: float, y: Any) -> np.ndarray:
        g, slope, rest = grip(y.item(2))
        fz = fz_0 - q * y.item(2)
        bend = slope**2 / (g + T_0) + 4 * n * q**2 * fz * (g + T_0) / rest**2
        D = 1 + slope * a * g * per_C
        Q = float(own @ y)
        v = (R * y.item(0) - slope * Q * per_C) / D
        dv = -slope * per_C / D * own
        dv[0] = R / D
        dv[2] -= (bend * Q + v * a * (bend * g + slope**2)) * per_C / D
        dP = g * dv
        dP[2] += slope * v
        J = M + np.outer(into, dP)
        J[0, 2] = -arm * slope
        return J

    def speed(t: float, y: Any) -> float:
        """`(1 + γ) v_s`."""
        return R * float(y[0]) - grip(float(y[2]))[1] * per_C * float(own @ y)

    def sticking(t: float, y: Any) -> np.ndarray:
        return np.concatenate([y[:2], [(grip(float(y[2]))[0] + T_0) / C], y[2:]])

    sizes = np.array([20.0, 10.0, *[10.0] * k])
    return Mode(rhs, jacobian, (Guard(None, speed, "stick", sticking),), sizes)


def _hot_slip(p: Stop) -> dict[str, Mode]:
    """Full slip, sticking shortly before the stop, and rest, in which only the
    temperatures change."""
    assert p.rates is not None
    R = p.R
    C = p.C
    T_0 = p.T_0
    rates = p.rates
    arm = p.R / p.J
    k = len(rates)
    hot = [10.0] * k
    joined = np.zeros((k + 3, k + 3))
    push = np.zeros(k + 3)
    joined[0, 2] = -arm * C
    joined[1, 0] = 1.0
    joined[2, 0] = R
    joined[3:, 3:] = rates
    push[0] = arm * T_0
    stop = Guard(
        "stop",
        lambda t, y: y[0],
        "held",
        lambda t, y: np.concatenate([y[1:2], y[3:], y[2:3]]),
    )
    stick = Mode(
        lambda t, y: joined @ y + push,
        lambda t, y: joined,
        (stop,),
        np.array([20.0, 10.0, 0.3, *hot]),
    )
    cooling = np.zeros((k + 2, k + 2))
    cooling[1:-1, 1:-1] = rates
    held = Mode(
        lambda t, y: cooling @ y, lambda t, y: cooling, (), np.array([10.0, *hot, 0.3])
    )
    return {"slip": _slipping(p), "stick": stick, "held": held}
