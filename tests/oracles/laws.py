"""Oracles of laws along a stop: friction over the speed, memory, oil, wear."""

import math

import numpy as np
from oracles.stops import (
    BETA,
    BY_SLOPE,
    EXACT,
    SMOOTH,
    T0,
    W0,
    J,
    N,
    R,
    over,
    ratio,
    slope,
    torque,
    until_rest,
)


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


def friction_with_memory():
    """Pads: `ċ = k (c_1 − c) + (q/w_0)(c_2 − c)`, `q = M ω/(n A)`."""
    f = 0.4
    force = 3e4
    pads = 3
    arm = 0.55
    inertia = 900.0
    area = 0.5 * (0.6**2 - 0.5**2)

    def stop(k=0.4, work=2e6):
        def rates(t, y):
            M = pads * f * y[1] * force * arm
            q = M * y[0] / (pads * area)
            return [-M / inertia, k * (0.5 - y[1]) + q / work * (1.2 - y[1])]

        return until_rest(rates, [W0, 0.9])

    source = "SciPy DOP853: ċ = k (c_1 − c) + q/w_0 (c_2 − c), J ω̇ = −n f c F r"
    time, y = stop()
    yield "stopping time", time, source, SMOOTH
    yield "factor at rest", y[1], source, SMOOTH
    yield "∂(stopping time)/∂k", slope(lambda k: stop(k)[0], 0.4), source, BY_SLOPE
    yield (
        "∂(stopping time)/∂w_0",
        slope(lambda w: stop(work=w)[0], 2e6),
        source,
        BY_SLOPE,
    )


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


def wear_of_linings():
    """Archard with a rate that rises with the temperature of the rim,
    `k (1 + s (T − T_r))`."""
    f = 0.35
    k = 2e-14
    s = 5e-3
    area = 0.03
    capacity = 2e4
    tension = T0 * ratio(f) ** np.arange(N + 1)
    pressure = (tension[1:] + tension[:-1]) * math.sin(BETA / 2) / area
    M = torque(f)
    energy = 0.5 * J * W0**2
    way = R * energy / M

    def worn(i, s):
        # ∫ (T − T_r) ds = (R/M)(1/C) ∫ W dW, W the work done so far
        return k * pressure[i] * (way + s * R * energy**2 / (2 * capacity * M))

    source = "closed form: k p_i ∫ (1 + s ΔT) v dt, ΔT = W/C"
    for i in (0, N - 1):
        yield f"lining {i + 1}", worn(i, s), source, EXACT
    yield "∂(lining 4)/∂s", worn(N - 1, 1.0) - worn(N - 1, 0.0), source, BY_SLOPE
