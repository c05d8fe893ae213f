"""Oracles of laws along a stop: friction, memory, oil, flash temperature, wear, contacts that open."""

import itertools
import math

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import PchipInterpolator
from scipy.linalg import expm
from scipy.optimize import brentq
from stops import BETA, BY_SLOPE, EXACT, ROOM, SMOOTH, T0, W0, J, N, R, over, ratio, slope, torque, until


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
    yield "lever work at 1 s", slack * (x - slack / (2 * C)), f"{source}, ∫ min(C x, T_0) dx", SMOOTH
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


SUBJECTS = {
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
    "wear of linings": wear_of_linings,
    "contact that opens": contact_that_opens,
}
