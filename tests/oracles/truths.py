"""Frozen truths of `simbrake validate`: closed forms, quadrature, SciPy's integrators; imports nothing of simbrake.

    python tests/oracles/truths.py            # writes simbrake/checks/truths.csv

Every function is one subject and yields rows (what, truth, source, tolerance). The numbers of a scene stand here and in
the case in `simbrake/checks/_cases_*.py`, written twice. Derivatives are sixth-order
central differences of the oracle.
"""

import csv
import itertools
import math
import pathlib

import numpy as np
from scipy.integrate import quad, solve_ivp
from scipy.interpolate import PchipInterpolator
from scipy.linalg import expm
from scipy.optimize import brentq

OUT = pathlib.Path(__file__).parents[2] / "simbrake" / "checks" / "truths.csv"
ROOM, G, GAS = 293.15, 9.80665, 8.31446261815324
EXACT, SMOOTH, BY_SLOPE = 1e-10, 1e-9, 1e-7

# a stop on a rigid or elastic band: four linings of 50°, constant slack tension, no load
N, BETA, R, J, T0, W0 = 4, math.radians(50.0), 0.725, 800.0, 8e3, 20.0


def ratio(f, beta=BETA):
    """`T_i/T_{i−1}` of a sliding lining."""
    z = math.tan(beta / 2)
    return (1 + f * z) / (1 - f * z)


def torque(f):
    return R * T0 * (ratio(f) ** N - 1)


def over(function, high, low=0.0):
    return quad(function, low, high, epsabs=0.0, epsrel=1e-13, limit=400)[0]


def slope(of, x, step=1e-2):
    h = step * x
    return sum(c * (of(x + k * h) - of(x - k * h)) for k, c in ((1, 45), (2, -9), (3, 1))) / (60 * h)


def until(rhs, y, event, t=0.0, end=100.0, direction=0.0):
    """The time and state at which an event comes first."""

    def wrapped(t, y):
        return event(t, y)

    wrapped.terminal, wrapped.direction = True, direction
    out = solve_ivp(rhs, (t, end), y, "DOP853", events=wrapped, rtol=2.3e-14, atol=1e-13)
    assert out.t_events[0].size, "the event does not come"
    return float(out.t_events[0][0]), out.y_events[0][0]


# --- friction laws ----------------------------------------------------------------------------------------------------


def stribeck_friction():
    def time(v_s=3.0, delta=1.5, angle=False):
        def law(v):
            return 0.30 + 0.15 * math.exp(-((v / v_s) ** delta))

        return over(lambda w: J * (w if angle else 1.0) / torque(law(R * w)), W0)

    source = "quadrature: ∫ J dω/M(f(R ω)), f = f_k + (f_s − f_k) exp(−(v/v_s)^δ)"
    yield "stopping time", time(), source, EXACT
    yield "angle", time(angle=True), "quadrature: ∫ J ω dω/M(f(R ω))", EXACT
    yield "∂(stopping time)/∂v_s", slope(lambda x: time(x), 3.0), source, BY_SLOPE
    yield "∂(stopping time)/∂δ", slope(lambda x: time(delta=x), 1.5), source, BY_SLOPE


def stribeck_friction_on_an_elastic_band():
    """The band rests until `C x = T_0 Π(f_s)`, drops to `T_0 Π(f(R_b ω))`, then friction grows and it sticks again."""
    f_s, f_k, v_s, R_b, C = 0.40, 0.28, 4.0, 0.76, 1.2e5

    def full(f):
        return T0 * ratio(f) ** N

    def stop(v_s=v_s):
        def law(v):
            return f_k + (f_s - f_k) * math.exp(-v / v_s)

        def alpha(w):
            return -R_b * (full(law(R_b * w)) - T0) / J

        def growth(w):
            v, z = R_b * w, math.tan(BETA / 2)
            steeper = full(law(v)) * N * 2 * z / (1 - (law(v) * z) ** 2)
            return -steeper * (f_s - f_k) / v_s * math.exp(-v / v_s) * R_b * alpha(w) / C

        def ride(t, y):
            return [-R_b * max(C * y[1] - T0, 0.0) / J, R_b * y[0], 0.0]

        def slide(t, y):
            return [alpha(y[0]), growth(y[0]), (full(law(R_b * y[0])) - T0) * (R_b * y[0] - growth(y[0]))]

        t, y = until(ride, [W0, 0.0, 0.0], lambda t, y: C * y[1] - T0)
        t, y = until(ride, y, lambda t, y: C * y[1] - full(f_s), t)
        slip, after = t, full(law(R_b * y[0]))
        jump = (y[1] - after / C) * (0.5 * (C * y[1] + after) - T0)
        t, y = until(slide, [y[0], after / C, jump], lambda t, y: R_b * y[0] - growth(y[0]), t)
        stick, heat = t, y[2]
        t, y = until(ride, y, lambda t, y: y[0], t)
        assert C * y[1] < full(f_s)
        return slip, stick, t, heat, 0.5 * C * y[1] ** 2

    source = "SciPy DOP853, stage by stage: T_n = T_0 Π(f(R_b ω)), v = R_b ω − Ṫ_n/C"
    names = ("full slip", "sticks again", "stopping time", "friction heat", "elastic energy at rest")
    for name, truth in zip(names, stop(), strict=True):
        yield name, truth, source, SMOOTH
    yield "∂(stopping time)/∂v_s", slope(lambda x: stop(x)[2], v_s), source, BY_SLOPE


def tabulated_friction():
    speed = np.array([0.0, 4.0, 9.0, 16.0])

    def time(second=0.35):
        law = PchipInterpolator(speed, [0.42, second, 0.31, 0.30])
        knots = [0.0, *(v / R for v in speed[1:-1] if v / R < W0), W0]
        return sum(over(lambda w: J / torque(float(law(R * w))), b, a) for a, b in itertools.pairwise(knots))

    source = "quadrature ∫ J dω/M over SciPy's monotone cubic (Fritsch and Carlson)"
    yield "stopping time", time(), source, EXACT
    yield "∂(stopping time)/∂f_2", slope(time, 0.35, 1e-3), source, 2e-6


def flash_temperature():
    """Fade by rim temperature and flash: `f = f_0 (1 − s (ΔT_rim + κ f √v))`, solved for f."""
    f_0, s, length, conductivity, diffusivity, hardness, capacity = 0.35, 1e-3, 1e-3, 50.0, 1.44e-5, 3e7, 1e5

    kappa = 2 * hardness / conductivity * math.sqrt(diffusivity * length / math.pi)

    def law(w):
        rim = J * (W0**2 - w**2) / (2 * capacity)
        return f_0 * (1 - s * rim) / (1 + f_0 * s * kappa * math.sqrt(R * w))

    source = "quadrature ∫ J dω/M(f), f = f_0 (1 − s (T + ΔT(f p v))); ΔT = (2 f p v/λ) √(a l/(π v)) (Blok, Jaeger)"
    # w = u²: the root has a smooth integrand
    yield "stopping time", over(lambda u: 2 * u * J / torque(law(u**2)), math.sqrt(W0)), source, SMOOTH


def fade_under_an_elastic_band():
    """`T_n = T_0 Π(T)` yields as it fades: `v = R ω − T_0 Π' Ṫ/C`, hence the factor `1 + γ` in `Ṫ`."""
    f, C, capacity, load = 0.35, 1e5, 1.5e3, 500.0

    def stop(s=2e-3):
        def full(T):
            return ratio(f * (1 - s * (T - ROOM))) ** N

        def steeper(T):
            now, z = f * (1 - s * (T - ROOM)), math.tan(BETA / 2)
            return full(T) * N * (2 * z / (1 - (now * z) ** 2)) * (-f * s)

        def warming(w, T):
            drag = T0 * (full(T) - 1)
            gamma = drag * T0 * steeper(T) / (C * capacity)
            return drag * R * w / (capacity * (1 + gamma))

        def ride(t, y):
            return [(load - R * max(C * y[1] - T0, 0.0)) / J, R * y[0]]

        def slide(t, y):
            return [(load - R * T0 * (full(y[1]) - 1)) / J, warming(*y)]

        t, y = until(lambda t, y: [load / J, R * y[0]], [W0, 0.0], lambda t, y: C * y[1] - T0)
        t, y = until(ride, y, lambda t, y: C * y[1] - T0 * full(ROOM), t)
        slip = t
        t, y = until(slide, [y[0], ROOM], lambda t, y: y[0], t)
        return slip, t, y[1]

    source = "SciPy DOP853: C Ṫ = F (R_b ω − T_0 Π' Ṫ/k), the band yields as it fades"
    slip, time, hot = stop()
    yield "full slip", slip, source, SMOOTH
    yield "stopping time", time, source, SMOOTH
    yield "rim at rest", hot, source, SMOOTH
    yield "∂(stopping time)/∂s", slope(lambda s: stop(s)[1], 2e-3), source, BY_SLOPE


def friction_under_pressure():
    """`f = f_0 (1 + p/p_r)^{−m}` with `p = (T_i + T_{i−1}) sin(β/2)/A`: a root for each lining."""
    area = 0.03

    def run(m=0.3, p_r=1e6):
        T = T0
        for _ in range(N):

            def rest(f, before=T):
                p = before * (1 + ratio(f)) * math.sin(BETA / 2) / area
                return f - 0.35 * (1 + p / p_r) ** -m

            f = brentq(rest, 0.05, 0.36, xtol=1e-16, rtol=1e-15)
            T *= ratio(f)
        return J * W0 / (R * (T - T0)), f, T

    source = "root of f = f_0 (1 + p/p_r)^{−m}, p = (T_i + T_{i−1}) sin(β/2)/A, lining by lining"
    yield "stopping time", run()[0], source, EXACT
    yield "friction of lining 4", run()[1], source, EXACT
    yield "tight tension", run()[2], source, EXACT
    yield "∂(stopping time)/∂m", slope(lambda m: run(m)[0], 0.3), source, BY_SLOPE
    yield "∂(stopping time)/∂p_r", slope(lambda p_r: run(p_r=p_r)[0], 1e6), source, BY_SLOPE


def elongation_of_the_band():
    """`x = ∫ S dθ/k` over the arcs, gaps and ends of bonded linings, `S = S_C e^{f θ}` under them (K-1)."""
    gap, slack_end, tight_end = math.radians(4.0), 0.3, 0.5

    def stiffness(E_1=2e9, f=0.35):
        steel = E_1 * 13e-4
        k, x, S = steel / R + 1e8 * 60e-4 / 0.71, slack_end / steel, 1.0
        for i in range(N):
            x += over(lambda a, S=S: S * math.exp(f * a) / k, BETA)
            S *= math.exp(f * BETA)
            x += S * gap * R / steel if i < N - 1 else 0.0
        return S / (x + S * tight_end / steel)

    def stop(E_1=2e9):
        C = stiffness(E_1)
        chi, height = R * math.sqrt(C / J), T0 * (ratio(0.35) ** N - 1)
        angle = math.asin(chi * height / (C * R * W0))
        slip = T0 / (C * R * W0) + angle / chi
        return slip, slip + J * W0 * math.cos(angle) / (R * height), C

    source = "quadrature: Δl/S_C = ∫ e^{fθ} dθ/k over arcs, gaps, ends; C = e_n/(Δl/S_C); the stop of K"
    yield "full slip", stop()[0], source, EXACT
    yield "stopping time", stop()[1], source, EXACT
    yield "elongation at full slip", T0 * ratio(0.35) ** N / stop()[2], source, EXACT
    yield "∂(stopping time)/∂E_1", slope(lambda x: stop(x)[1], 2e9), source, BY_SLOPE


def friction_with_memory():
    """Pads: `ċ = k (c_1 − c) + (q/w_0)(c_2 − c)`, `q = M ω/(n A)`."""
    f, force, pads, arm, inertia = 0.4, 3e4, 3, 0.55, 900.0
    area = 0.5 * (0.6**2 - 0.5**2)

    def stop(k=0.4, work=2e6):
        def rates(t, y):
            M = pads * f * y[1] * force * arm
            q = M * y[0] / (pads * area)
            return [-M / inertia, k * (0.5 - y[1]) + q / work * (1.2 - y[1])]

        return until(rates, [W0, 0.9], lambda t, y: y[0])

    source = "SciPy DOP853: ċ = k (c_1 − c) + q/w_0 (c_2 − c), J ω̇ = −n f c F r"
    time, y = stop()
    yield "stopping time", time, source, SMOOTH
    yield "factor at rest", y[1], source, SMOOTH
    yield "∂(stopping time)/∂k", slope(lambda k: stop(k)[0], 0.4), source, BY_SLOPE
    yield "∂(stopping time)/∂w_0", slope(lambda w: stop(work=w)[0], 2e6), source, BY_SLOPE


def changing_friction():
    """Oil on linings 2 and 3 from an instant on."""
    f = 0.35

    def time(at=0.5, factor=0.4):
        oiled = R * T0 * (ratio(f) ** 2 * ratio(factor * f) ** 2 - 1)
        return at + (W0 - torque(f) * at / J) * J / oiled

    source = "closed form: t_1 + (J ω_0 − M_1 t_1)/M_2, M_2 with two linings oiled"
    yield "stopping time", time(), source, EXACT
    yield "∂(stopping time)/∂t_1", slope(time, 0.5), source, BY_SLOPE
    yield "∂(stopping time)/∂φ", slope(lambda x: time(factor=x), 0.4), source, BY_SLOPE


def softening_on_a_soft_band():
    """`f c` with `ċ_i = κ_i (c_e − c_i) (v/v_0)²`: `v + T_0 Σ (∂Π/∂c_i) ċ_i(v)/C = R ω`, solved at every call."""
    f, C, beta, slack, load, pace, end = 0.35, 2e4, math.radians(80.0), 9e3, 500.0, np.array([0.5, 1.5]), 0.4
    z = math.tan(beta / 2)

    def stop(v_0=10.0):
        def full(c):
            return math.prod((1 + f * z * x) / (1 - f * z * x) for x in c)

        def softening(w, c):
            by_c = full(c) * 2 * f * z / (1 - (f * z * c) ** 2)
            towards = pace * (end - c) / v_0**2
            drawn = slack * float(by_c @ towards) / C  # (below 0: the band draws back, and slips the faster)

            def rest(v):
                return v + drawn * v * abs(v) - R * w

            v = brentq(rest, min(2 * R * w, 0.0), -0.5 / drawn, xtol=1e-15, rtol=1e-15)
            return towards * v * abs(v)

        def ride(t, y):
            return [(load - R * max(C * y[1] - slack, 0.0)) / J, R * y[0]]

        def slide(t, y):
            return [(load - R * slack * (full(y[1:]) - 1)) / J, *softening(y[0], y[1:])]

        t, y = until(lambda t, y: [load / J, R * y[0]], [W0, 0.0], lambda t, y: C * y[1] - slack)
        slip, y = until(ride, y, lambda t, y: C * y[1] - slack * full(np.ones(2)), t)
        early = solve_ivp(slide, (slip, 1.0), [y[0], 1.0, 1.0], "DOP853", rtol=2.3e-14, atol=1e-13).y[:, -1]
        t, y = until(slide, [y[0], 1.0, 1.0], lambda t, y: y[0], slip)
        return slip, t, y[1], y[2], slack * full(early[1:]) / C

    source = "SciPy DOP853, the slip speed by a root: v + T_0 Σ (∂Π/∂c) ċ(v)/C = R ω"
    slip, time, first, second, x = stop()
    yield "full slip", slip, source, SMOOTH
    yield "stopping time", time, source, SMOOTH
    yield "factor of lining 1 at rest", first, source, SMOOTH
    yield "factor of lining 2 at rest", second, source, SMOOTH
    yield "elongation at 1 s", x, f"{source}, C x = T_0 Π(c)", SMOOTH
    yield "work of the lever at 1 s", slack * (x - slack / (2 * C)), f"{source}, ∫ min(C x, T_0) dx", SMOOTH
    yield "∂(stopping time)/∂v_0", slope(lambda x: stop(x)[1], 10.0), source, BY_SLOPE


def wear_of_linings():
    """Archard with a rate that rises with the temperature of the rim, `k (1 + s (T − T_r))`."""
    f, k, s, area, capacity = 0.35, 2e-14, 5e-3, 0.03, 2e4
    tension = T0 * ratio(f) ** np.arange(N + 1)
    pressure = (tension[1:] + tension[:-1]) * math.sin(BETA / 2) / area
    M, energy = torque(f), 0.5 * J * W0**2
    way = R * energy / M

    def worn(i, s):
        # ∫ (T − T_r) ds = (R/M)(1/C) ∫ W dW, W the work done so far
        return k * pressure[i] * (way + s * R * energy**2 / (2 * capacity * M))

    source = "closed form: k p_i ∫ (1 + s ΔT) v dt, ΔT = W/C"
    for i in (0, N - 1):
        yield f"lining {i + 1}", worn(i, s), source, EXACT
    yield "∂(lining 4)/∂s", worn(N - 1, 1.0) - worn(N - 1, 0.0), source, BY_SLOPE


def contact_that_opens():
    """Rim, linings and band: rim and linings exchange heat until the band is released."""
    capacity, start, closed, behind, at, end = (
        np.array([4e3, 600.0, 900.0]),
        [420.0, 350.0, 300.0],
        40.0,
        25.0,
        20.0,
        50.0,
    )

    def rates(*pairs):
        A = np.zeros((3, 3))
        for a, b, g in pairs:
            A[a, a], A[a, b], A[b, b], A[b, a] = A[a, a] - g, A[a, b] + g, A[b, b] - g, A[b, a] + g
        return A / capacity[:, None]

    def linings(at=at, g=closed):
        before = expm(rates((0, 1, g), (1, 2, behind)) * at) @ start
        return (expm(rates((1, 2, behind)) * (end - at)) @ before)[:2]

    source = "closed form: exp(A_2 (t − t_1)) exp(A_1 t_1) T_0"
    yield "rim", linings()[0], source, SMOOTH
    yield "linings", linings()[1], source, SMOOTH
    yield "∂(linings)/∂R_c", slope(lambda x: linings(g=0.1 / x)[1], 0.1 / closed), source, BY_SLOPE


# --- mechanisms -------------------------------------------------------------------------------------------------------


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
    """Two bands of unequal linings under one lever; `K-8` shares the slack tension by `e^{Σ f α}/C`."""
    inertia, R_b, tension, load = 1200.0, 0.623, 6e3, 3e3
    angles = [np.array([0.9, 0.7, 0.8, 1.1]), np.array([0.5, 0.6, 0.4, 0.7, 0.8, 0.6])]
    friction = [np.array([0.35, 0.3, 0.32, 0.4]), np.full(6, 0.28)]

    def along(f, beta):
        fz = f * np.tan(beta / 2)
        return np.prod((1 + fz) / (1 - fz))

    def stop(first=2e5):
        stiff = [C / math.exp(f @ a) for C, f, a in zip((first, 3.5e5), friction, angles, strict=True)]
        shares = np.asarray(stiff) / sum(stiff)
        torques = [R_b * s * tension * (along(f, a) - 1) for s, f, a in zip(shares, friction, angles, strict=True)]
        return inertia * 20.0 / (sum(torques) - load), shares[0]

    source = "closed form: J ω_0/(Σ R_b T_0,j (Π_j − 1) − M), T_0,j by C_j e^{−Σ f α} (K-8)"
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


def retarders_on_the_shaft():
    """Hydrodynamic brake and viscous drag together: `J ω̇ = −(k ω² + c ω)`."""
    k, c, inertia, low = 14.0, 60.0, 800.0, 4.0

    def time(k=k):
        return inertia / c * math.log(W0 * (k * low + c) / (low * (k * W0 + c)))

    t = time()

    def speed(k=k):
        grown = math.exp(-c * t / inertia) * W0 / (k * W0 + c)
        return c * grown / (1 - k * grown)

    source = "closed form: ω at (J/c) ln[ω_0 (k ω + c)/(ω (k ω_0 + c))]"
    yield "speed", speed(), source, EXACT
    yield "∂(speed)/∂k", slope(speed, k), source, BY_SLOPE


def free_fall_then_brake():
    """0.8 s of free fall of 60 t, then 60 kN·m (three phases of one closed form)."""
    whole, M, load, fall = 1350.0, 6e4, 60e3 * 0.4 / 8 * G, 0.8

    def stop(M=M, fall=fall):
        top = load * fall / whole
        time = fall + whole * top / (M - load)
        return top, time, M * top * (time - fall) / 2

    source = "closed form: ω_1 = M_L t_1/J, J ω_1/(M − M_L)"
    top, time, heat = stop()
    yield "greatest speed", top, source, EXACT
    yield "stopping time", time, source, EXACT
    yield "friction heat", heat, source, EXACT
    yield "∂(stopping time)/∂t_1", slope(lambda t: stop(fall=t)[1], fall), source, BY_SLOPE
    # the torque is in proportion to the arm of 0.1 m
    yield "∂(stopping time)/∂l", slope(lambda arm: stop(M * arm / 0.1)[1], 0.1), source, BY_SLOPE


def lever_that_holds_the_speed():
    """`T_0 = M/(R_b (Π(T) − 1))` while the lever can, `T = T_r + M ω t/C`; then its limit, and the load gains."""
    M, f, capacity, limit, w0, end = 5e3, 0.35, 1e3, 3000.0, 5.0, 6.0

    def run(s=1e-3):
        def gain(rise):
            return R * (ratio(f * (1 - s * rise)) ** N - 1)

        lost = brentq(lambda t: limit * gain(M * w0 * t / capacity) - M, 0.0, end, xtol=1e-14, rtol=1e-14)

        def rates(t, y):
            brake = limit * gain(y[1])
            return [(M - brake) / J, brake * y[0] / capacity]

        rest = solve_ivp(rates, (lost, end), [w0, M * w0 * lost / capacity], "DOP853", rtol=2.3e-14, atol=1e-13)
        return M / gain(M * w0 * 3.0 / capacity), lost, rest.y[0, -1]

    form = "closed form: T_0 = M/(R_b (Π(T) − 1)), T = T_r + M ω t/C"
    tension, lost, speed = run()
    yield "speed", w0, "closed form: ω_0", EXACT
    yield "slack tension", tension, form, EXACT
    yield "friction heat", M * w0 * 3.0, "closed form: M ω_0 t", EXACT
    yield "grip lost", lost, f"{form}, = limit", 1e-7
    source = "SciPy DOP853: J ω̇ = M − R_b T_0 (Π(T) − 1), C Ṫ = R_b T_0 (Π − 1) ω from there"
    yield "speed at the end", speed, source, SMOOTH
    # no step ends at the corner, which costs the derivative digits
    yield "∂(speed at the end)/∂s", slope(lambda s: run(s)[2], 1e-3), source, 1e-4


def actuator():
    """`τ Ḟ + F = u(t − t_d)`, `T_0 = F − F_s`: the force in closed form from point to point, `J ω̇ = −R T_0 (Π − 1)`."""
    times, values, spring = (0.0, 0.3, 0.3, 1.1), (1.5e3, 6e3, 9e3, 4e3), 800.0

    def pieces(tau, dead):
        """Begin, end, force and command at the begin, slope."""
        F, found = values[0], []
        for begin, end, low, high in zip(times, (*times[1:], 99.0), values, (*values[1:], values[-1]), strict=True):
            if end == begin:
                continue
            m = (high - low) / (end - begin)
            found.append((begin + dead, end + dead, F, low, m))
            F = high - tau * m + (F - low + tau * m) * math.exp(-(end - begin) / tau)
        return [(0.0, dead, values[0], values[0], 0.0), *found]

    def impulse(t, tau, dead):
        whole = 0.0
        for begin, end, F, u, m in pieces(tau, dead):
            s = min(t, end) - begin
            if s > 0:
                steady = (u - tau * m - spring) * s + m * s * s / 2
                whole += steady + (F - u + tau * m) * tau * -math.expm1(-s / tau)
        return whole

    def stop(tau=0.15, dead=0.08):
        gain = R * (ratio(0.35) ** N - 1)
        return brentq(lambda t: gain * impulse(t, tau, dead) - J * W0, 0.1, 20.0, xtol=1e-15, rtol=1e-15)

    source = "closed form: ∫ (F − F_s) dt = J ω_0/R(Π − 1), F by τ Ḟ + F = u(t − t_d) from point to point"
    yield "stopping time", stop(), source, EXACT
    yield "∂(stopping time)/∂τ", slope(lambda x: stop(x), 0.15), source, BY_SLOPE
    yield "∂(stopping time)/∂t_d", slope(lambda x: stop(dead=x), 0.08), source, BY_SLOPE


def phase_that_ends_hot():
    """A load that the brake slows too little heats the rim to a level, and then a stronger pull stops it."""
    weak, strong, load, capacity = 4e3, 12e3, 9e3, 4e4
    gain = R * (ratio(0.35) ** N - 1)

    def ends(rise=60.0):
        M, alpha = gain * weak, (load - gain * weak) / J
        way = capacity * rise / M
        t = (-W0 + math.sqrt(W0 * W0 + 2 * alpha * way)) / alpha
        last = (W0 + alpha * t) / ((gain * strong - load) / J)
        return t, t + last, rise + gain * strong * (W0 + alpha * t) * last / 2 / capacity

    source = "closed form: C ΔT = M φ, φ = ω_0 t + α t²/2, then a stop under the second pull"
    yield "first phase", ends()[0], source, EXACT
    yield "stopping time", ends()[1], source, EXACT
    yield "rise at rest", ends()[2], source, EXACT
    yield "∂(stopping time)/∂(level)", slope(lambda x: ends(x)[1], 60.0), source, BY_SLOPE


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
    "lever that holds the speed": lever_that_holds_the_speed,
    "linings that travel": linings_that_travel,
    "Stribeck friction": stribeck_friction,
    "Stribeck friction on an elastic band": stribeck_friction_on_an_elastic_band,
    "tabulated friction": tabulated_friction,
    "flash temperature": flash_temperature,
    "fade under an elastic band": fade_under_an_elastic_band,
    "friction with memory": friction_with_memory,
    "softening on a soft band": softening_on_a_soft_band,
    "oiled linings": changing_friction,
    "friction under pressure": friction_under_pressure,
    "elongation of the band": elongation_of_the_band,
    "actuator": actuator,
    "phase that ends hot": phase_that_ends_hot,
    "wear of linings": wear_of_linings,
    "contact that opens": contact_that_opens,
    "staged stop": staged_stop,
    "chain of one lining": chain_of_one,
    "several bands": several_bands,
    "elastic rope": elastic_rope,
    "phases by state": phases_by_state,
    "retarders on the shaft": retarders_on_the_shaft,
    "free fall, then brake": free_fall_then_brake,
}


def rows():
    for subject, oracle in SUBJECTS.items():
        for what, truth, source, tolerance in oracle():
            yield subject, what, float(truth), tolerance, source


if __name__ == "__main__":
    with OUT.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("subject", "what", "truth", "tolerance", "source"))
        for subject, what, truth, tolerance, source in rows():
            writer.writerow((subject, what, f"{truth:.16g}", f"{tolerance:g}", source))
