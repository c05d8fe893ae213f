"""Oracles of mechanisms: staged brake, chain, linings on springs or on a ring that travels, several bands, rope."""

import itertools
import math

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from stops import BY_SLOPE, EXACT, SMOOTH, G, ratio, slope, until


def staged_stop():
    """T_on, the lock and a stop in stage 3 on an elastic band; the grip depends on the tensions."""
    r, R_b, Jp, J_b, n, beta = 0.59, 0.64, 900.0, 45.0, 8, math.radians(33.0)
    f_e, rate, begin, load, C = 0.40, 4e3, 200.0, 300.0, 3e5
    mu, s = ratio(f_e, beta), math.sin(beta / 2)
    Pi = mu**n

    def times(f_i=0.22, preload=900.0):
        def lever(t):
            return begin + rate * t

        def grip(T_0, T_n):
            T = np.minimum(T_0 * mu ** np.arange(n + 1), T_n)
            return r * f_i * float(np.sum((T[1:] + T[:-1]) * s + preload))

        def drag(t):
            return R_b * lever(t) * (Pi - 1)

        whole, take_up = Jp + J_b, C * 0.0
        t, y = until(lambda t, y: [load / whole, R_b * y[0]], [20.0, take_up], lambda t, y: C * y[1] - lever(t))
        ride = lambda t, y: [(load - R_b * (C * y[1] - lever(t))) / whole, R_b * y[0]]  # noqa: E731
        t, y = until(ride, y, lambda t, y: C * y[1] - Pi * lever(t), t)
        slides = lambda t, y: [(load - drag(t)) / whole]  # noqa: E731
        full = lambda t, y: grip(lever(t), Pi * lever(t)) - drag(t) - J_b * (load - drag(t)) / whole  # noqa: E731
        slip, y = until(slides, y[:1], full, t)
        tension = lever(slip)

        def both(t, y):
            M = grip(lever(t), Pi * lever(t))
            return [(load - M) / Jp, (M - drag(t)) / J_b]

        # the band stretches with the lever: its slip ends before the bandage rests
        t, y = until(both, [y[0], y[0]], lambda t, y: y[1] - rate * Pi / C / R_b, slip)

        def swing(t, y):
            M = grip(lever(t), C * y[2])
            return [(load - M) / Jp, (M - R_b * (C * y[2] - lever(t))) / J_b, R_b * y[1]]

        lock, y = until(swing, [*y, Pi * lever(t) / C], lambda t, y: y[1], t)

        def held(t, y):
            T_0 = lever(t)
            T_n = brentq(lambda T: R_b * (T - T_0) - grip(T_0, T), T_0, T_0 * Pi, xtol=1e-12, rtol=1e-15)
            return [(load - grip(T_0, T_n)) / Jp]

        stop, y = until(held, y[:1], lambda t, y: y[0], lock)
        return slip, lock, stop, tension

    source = "SciPy DOP853, stage by stage; M_i = r f_i Σ ((T_i + T_{i−1}) sin β/2 + N_p)"
    slip, lock, stop, tension = times()
    yield "internal slip", slip, source, SMOOTH
    yield "tension at internal slip", tension, source, SMOOTH
    yield "external lock", lock, source, SMOOTH
    yield "stopping time", stop, source, SMOOTH
    yield "∂(stopping time)/∂f_i", slope(lambda x: times(x)[2], 0.22, 2e-3), source, BY_SLOPE
    yield "∂(stopping time)/∂N_p", slope(lambda x: times(preload=x)[2], 900.0, 2e-3), source, BY_SLOPE


def chain_of_one():
    """A lining of mass m under a band with a spring and a damper: sticks, slides, sticks."""
    inertia, R_b, m, D, f, tension, w0, end = 0.5, 0.9, 0.05, 0.03, 0.3, 1.0, 0.6, 2.0
    fz = f * math.tan(math.radians(13.5))

    def run(C=5.0):
        def force(y):
            return C * (0.2 + y[1]) + D * y[2]

        def stuck(t, y):
            a = -R_b * (force(y) - tension) / (inertia + m * R_b**2)
            return [a, y[2], R_b * a]

        def sliding(sign):
            def rhs(t, y):
                grip = sign * fz * (force(y) + tension)
                return [-R_b * grip / inertia, y[2], (grip + tension - force(y)) / m]

            return rhs

        def let_go(side):
            return lambda t, y: fz * (force(y) + tension) - side * (m * stuck(t, y)[2] + force(y) - tension)

        t, y, mode, times = 0.0, [w0, 0.0, R_b * w0], 0, []
        while True:
            events = [let_go(1), let_go(-1)] if mode == 0 else [lambda t, y, k=mode: k * (R_b * y[0] - y[2])]
            rhs = stuck if mode == 0 else sliding(mode)
            for event in events:
                event.terminal, event.direction = True, -1
            done = solve_ivp(rhs, (t, end), y, "DOP853", events=events, rtol=1e-13, atol=1e-15, max_step=0.02)
            t, y = done.t[-1], done.y[:, -1]
            if t >= end:
                return times, y
            times.append(t)
            mode = (1 if done.t_events[0].size else -1) if mode == 0 else 0
            if mode == 0:
                y[2] = R_b * y[0]

    source = "SciPy DOP853: m v̇ = G + T_0 − T, stick and slip event by event"
    times, y = run()
    yield "first slip", times[0], source, SMOOTH
    yield "first stick", times[1], source, SMOOTH
    yield "speed at the end", y[0], source, 1e-8
    yield "∂(speed)/∂C", slope(lambda C: run(C)[1][0], 5.0, 2e-4), source, 1e-6


def linings_on_springs():
    """Two linings with a spring between: each lets go of the rim, slides on both, and rests on the band."""
    inertia, own, r, R_b, f_i, damping, half = 200.0, [1.2, 1.5], 0.59, 0.64, 0.2, 0.05, math.radians(25.0)
    mu, k, mass = ratio(0.4, 2 * half), r * f_i * math.sin(half), 1 / (1 / own[0] + 1 / own[1]) / R_b**2

    def run(K=2e3, second=900.0):
        floor, D = [r * f_i * 1500.0, r * f_i * second], 2 * damping * math.sqrt(K * mass)
        slides, rests = [False, False], [False, False]

        def forces(t, y):
            S = K * y[1] + D * R_b * (y[2] - y[3])
            Q, T = [-R_b * S, R_b * S], [100.0 + 5900.0 * min(t / 0.3, 1.0)]
            for i in (0, 1):
                at_rest = (T[-1] * (R_b + k) + floor[i] + Q[i]) / (R_b - k)
                T.append(at_rest if rests[i] else T[-1] * mu)
            G, M = [R_b * (T[i + 1] - T[i]) for i in (0, 1)], [k * (T[i + 1] + T[i]) + floor[i] for i in (0, 1)]
            drag = sum(M[i] if slides[i] else G[i] - Q[i] for i in (0, 1))
            a = -drag / (inertia + sum(own[i] for i in (0, 1) if not slides[i]))
            each = [a if not slides[i] else 0.0 if rests[i] else (M[i] + Q[i] - G[i]) / own[i] for i in (0, 1)]
            room = [M[i] - (G[i] - Q[i] + own[i] * a) for i in (0, 1)]
            return [a, R_b * (y[2] - y[3]), *each], room

        t, y, log = 0.0, [20.0, 0.0, 20.0, 20.0], {}
        while "stop" not in log:
            events = {"stop": lambda t, y: y[0]}
            for i in (0, 1):
                if not slides[i]:
                    events[f"slip {i + 1}"] = lambda t, y, i=i: forces(t, y)[1][i]
                elif not rests[i]:
                    events[f"rest {i + 1}"] = lambda t, y, i=i: y[2 + i]
            for event in events.values():
                event.terminal, event.direction = True, -1
            span, watched = (t, 0.3 if t < 0.3 else 20.0), [*events.values()]
            out = solve_ivp(lambda t, y: forces(t, y)[0], span, y, "DOP853", rtol=1e-13, atol=1e-13, events=watched)
            t, y = out.t[-1], out.y[:, -1]
            for name in [name for name, times in zip(events, out.t_events, strict=True) if times.size]:
                log[name], i = t, int(name[-1]) - 1 if name != "stop" else 0
                slides[i] |= name.startswith("slip")
                if name.startswith("rest"):
                    rests[i], y[2 + i] = True, 0.0
        return log, y

    source = "SciPy DOP853, mode by mode: J_i ω̇_i = M_i + Q_i − R_b (T_i − T_(i−1)), Q_i of spring and damper"
    log, y = run()
    for name, words in (("slip 1", "lining 1 slips"), ("slip 2", "lining 2 slips")):
        yield words, log[name], source, SMOOTH
    for name, words in (("rest 1", "lining 1 rests on the band"), ("rest 2", "lining 2 rests on the band")):
        yield words, log[name], source, SMOOTH
    yield "stopping time", log["stop"], source, SMOOTH
    yield "elongation at rest", y[1], source, SMOOTH
    yield "∂(stopping time)/∂K", slope(lambda K: run(K)[0]["stop"], 2e3, 1e-3), source, BY_SLOPE
    yield "∂(stopping time)/∂N_pre", slope(lambda x: run(second=x)[0]["stop"], 900.0, 1e-3), source, BY_SLOPE


def several_bands():
    """Two bands of unequal linings under one lever; they stretch alike, `x = Π_j T_0,j/C_j`."""
    inertia, R_b, tension, load = 1200.0, 0.623, 6e3, 3e3
    angles = [np.array([0.9, 0.7, 0.8, 1.1]), np.array([0.5, 0.6, 0.4, 0.7, 0.8, 0.6])]
    friction = [np.array([0.35, 0.3, 0.32, 0.4]), np.full(6, 0.28)]

    def along(f, beta):
        fz = f * np.tan(beta / 2)
        return np.prod((1 + fz) / (1 - fz))

    def stop(first=2e5):
        stiff = [C / along(f, a) for C, f, a in zip((first, 3.5e5), friction, angles, strict=True)]
        shares = np.asarray(stiff) / sum(stiff)
        torques = [R_b * s * tension * (along(f, a) - 1) for s, f, a in zip(shares, friction, angles, strict=True)]
        return inertia * 20.0 / (sum(torques) - load), shares[0]

    source = "closed form: J ω_0/(Σ R_b T_0,j (Π_j − 1) − M), T_0,j by C_j/Π_j (K-8)"
    yield "stopping time", stop()[0], source, EXACT
    yield "share of the first band", stop()[1], source, EXACT
    yield "∂(stopping time)/∂C_1", slope(lambda C: stop(C)[0], 2e5), source, BY_SLOPE


def elastic_rope():
    """Drum and hook on a spring under a constant torque, and the swing after the stop."""
    inertia, rho, m, w0 = 1200.0, 0.05, 40e3, 8.0
    gain = 0.725 * (ratio(0.35, math.radians(13.5)) ** 20 - 1)

    def stop(k=4e6):
        inverse, M = 1 / m + rho**2 / inertia, 25e3 * gain
        rate = math.sqrt(k * inverse)
        middle = (G + rho * M / inertia) / rate**2
        swing = m * G / k - middle

        def speed(t):
            steady = (k * rho * middle - M) / inertia * t
            return w0 + steady + k * rho / inertia * swing * math.sin(rate * t) / rate

        t = brentq(speed, 1e-3, 1.0, xtol=1e-15, rtol=1e-15)
        e, v = middle + swing * math.cos(rate * t), -swing * rate * math.sin(rate * t)
        return t, m * G + math.hypot(k * e - m * G, v * math.sqrt(k * m))

    source = "closed form: two masses on a spring under a constant torque"
    yield "stopping time", stop()[0], source, SMOOTH
    yield "greatest hook load", stop()[1], source, 1e-8
    yield "∂(stopping time)/∂k", slope(lambda k: stop(k)[0], 4e6), source, BY_SLOPE


def linings_that_travel():
    """Linings on a bandage that rides with the rim, under eight stations of 33°; 11 of them fill the ring."""
    R_b, inertia, tension, load, n, beta, rate, area = 0.64, 945.0, 2e3, 300.0, 8, math.radians(33.0), 2e-14, 0.03
    mu = ratio(0.40, beta)
    T = tension * mu ** np.arange(n + 1)

    def way(tension=tension, f=0.40):
        return inertia * 20.0**2 / (2 * (R_b * tension * (ratio(f, beta) ** n - 1) - load))

    travel = way()
    pressure = (T[1:] + T[:-1]) * math.sin(beta / 2) / area

    def passed(point, station):
        """Angle by which a point of the ring that starts at `point` is under a station, to the slack end."""
        first = station * beta
        spans = [(first - 2 * math.pi * k, first + beta - 2 * math.pi * k) for k in range(20)]
        return sum(max(min(high, point) - max(low, point - travel), 0.0) for low, high in spans)

    def depth(lining):
        edges = [beta * i for i in range(n + 1)]
        corners = [e - 2 * math.pi * k + shift for e in edges for k in range(20) for shift in (0.0, travel)]
        low, high = beta_of_ring * lining, beta_of_ring * (lining + 1)
        cuts = [low, *sorted(c for c in corners if low < c < high), high]
        # linear in between: the middle is exact
        return (
            sum(
                (b - a) * sum(rate * pressure[k] * R_b * passed((a + b) / 2, k) for k in range(n))
                for a, b in itertools.pairwise(cuts)
            )
            / beta_of_ring
        )

    beta_of_ring = 2 * math.pi / 11
    source = "closed form: k Σ p_i R_b × angle under station i, mean over the lining"
    yield "travel", travel, "closed form: J ω_0²/2(R_b T_0 (Π − 1) − M)", EXACT
    yield "lining 1", depth(0), source, SMOOTH
    yield "lining 6", depth(5), source, SMOOTH
    source = "closed form: the travel, differentiated"
    yield "∂(travel)/∂T_0", slope(lambda x: way(x), tension), source, BY_SLOPE
    yield "∂(travel)/∂f", slope(lambda x: way(f=x), 0.40), source, BY_SLOPE


SUBJECTS = {
    "linings on springs": linings_on_springs,
    "linings that travel": linings_that_travel,
    "staged stop": staged_stop,
    "chain of one lining": chain_of_one,
    "several bands": several_bands,
    "elastic rope": elastic_rope,
}
