"""Oracles of mechanisms: chain, linings on springs, several bands, rope, phases."""

import math

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from stops import BY_SLOPE, EXACT, SMOOTH, G, ratio, slope


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

    K = 2e3

    def run():
        floor, D = [r * f_i * 1500.0, r * f_i * 900.0], 2 * damping * math.sqrt(K * mass)
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


def phases_by_state():
    """Two cycles: free fall by 12 m, a stop under a ramp, 4 s, 2 s out of the slips; 2 t more each time."""
    inertia, per_rad, pull, ramp = 1200.0, 0.05, 25e3, 0.5
    gain = 0.623 * (ratio(0.35, math.radians(270) / 20) ** 20 - 1)

    def ends(distance=12.0):
        t, found = 0.0, []
        for cycle in range(2):
            m = 45e3 + 2e3 * cycle
            whole, M = inertia + m * per_rad**2, m * G * per_rad
            fall = math.sqrt(2 * distance * whole / (M * per_rad))
            lost = (gain * pull / 2 - M) * ramp / whole  # speed that the ramp takes
            t += fall
            found.append(t)
            t += ramp + (M / whole * fall - lost) / ((gain * pull - M) / whole)
            found.append(t)
            t += 6.0
        return [*found, t]

    source = "closed form: √(2 s J/(M ρ)), then the ramp and the rest of the stop"
    found = ends()
    yield "first fall ends", found[0], source, EXACT
    yield "first stop", found[1], source, EXACT
    yield "second fall ends", found[2], source, EXACT
    yield "end", found[4], source, EXACT
    yield "∂(end)/∂s", slope(lambda s: ends(s)[4], 12.0), source, BY_SLOPE


SUBJECTS = {
    "linings on springs": linings_on_springs,
    "chain of one lining": chain_of_one,
    "several bands": several_bands,
    "elastic rope": elastic_rope,
    "phases by state": phases_by_state,
}
