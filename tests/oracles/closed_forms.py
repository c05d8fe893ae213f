"""Oracles in closed form: the integrator's small systems, heat, stops of every kind of brake, other ways to run."""

import math

import numpy as np
from scipy.integrate import quad
from scipy.special import erfc, lambertw

FORM = "closed form: "
EXACT, BY_SLOPE = 1e-11, 1e-9

# --- small systems and heat -------------------------------------------------------------------------------------------


def belt_oscillator():
    """Slip lasts `(2/ω)(π − atan u)`, stick `2Δ/v_b`, with `u = Δω/v_b`, `ω = √(k/m)`, `Δ = (F_s − F_k)/k`."""
    m, k, F_s, F_k, v_b = 1.0, 1.0, 1.0, 0.6, 0.2
    D, w = (F_s - F_k) / k, math.sqrt(k / m)
    slip, swing = 2 / w * (math.pi - math.atan(D * w / v_b)), math.hypot(D, v_b / w)
    yield "slip lasts", slip, f"{FORM}(2/ω)(π − atan(Δω/v_b))", EXACT
    yield "stick lasts", 2 * D / v_b, f"{FORM}2Δ/v_b", EXACT
    yield "maximum x", F_k / k + swing, f"{FORM}F_k/k + √(Δ² + v_b²/ω²)", EXACT
    yield "minimum x", F_k / k - swing, f"{FORM}F_k/k − √(Δ² + v_b²/ω²)", EXACT
    u = D * w / v_b
    bend = 2 / (w * (1 + u * u))  # −∂T/∂u
    by_D, by_w = 2 / v_b - bend * w / v_b, -slip / w - bend * D / v_b
    slopes = {"F_s": by_D / k, "F_k": -by_D / k, "v_b": -2 * D / v_b**2 + bend * u / v_b}
    slopes |= {"k": -by_D * D / k + by_w * w / (2 * k), "m": -by_w * w / (2 * m)}
    for name, value in slopes.items():
        yield f"∂(period)/∂{name}", value, "closed form of the period, differentiated", BY_SLOPE


def of_the_test_set(end, *values):
    def rows():
        for i, value in enumerate(values, 1):
            yield f"y{i}({end})", value, "Test Set for IVP Solvers (Mazzia, Magherini)", 1e-6

    return rows


def two_lumps():
    for t in (0.1, 0.5, 1.0):
        yield f"T1 at {t} s", 323.15 + 50 * math.exp(-2 * 10.0 / 15.0 * t), f"{FORM}T_m + ΔT/2 · e^(−2Gt/C)", 1e-9


def half_space():
    q, t, K, a = 1e6, 2.0, 50.0, 1.4e-5

    def rise(x):
        spread = np.exp(-(x**2) / (4 * a * t))
        return q / K * (2 * np.sqrt(a * t / math.pi) * spread - x * erfc(x / np.sqrt(4 * a * t)))

    source = "Carslaw & Jaeger 2.9: half-space under constant flux"
    yield "order of the layers", 2.0, "second-order finite volumes", 0.05
    yield "surface", rise(0.0), source, 1e-3
    yield "2 mm deep", rise(0.002), source, 1e-3
    yield "10 mm deep", rise(0.010), source, 2e-3


# a rigid band with 20 linings on a drum that heats one insulated lump
_J, _R, _T0, _W0, _CAPACITY = 800.0, 0.725, 8e3, 20.0, 2e4


def _fading(w, slope):
    z = math.tan(math.radians(13.5) / 2)
    now = 0.35 * (1 - slope * _J * (_W0**2 - w**2) / (2 * _CAPACITY))
    return _R * _T0 * (((1 + now * z) / (1 - now * z)) ** 20 - 1)


def stop_with_fade():
    time = quad(lambda w: _J / _fading(w, 2e-3), 0.0, _W0, epsabs=1e-13, epsrel=1e-13)[0]
    yield "stopping time", time, "quadrature ∫ J dω/M(T(ω)), T = T_0 + J(ω_0² − ω²)/2mc", 1e-9
    warming = _J * _W0**2 / (2 * _CAPACITY)
    yield "temperature at rest", 293.15 + warming, f"{FORM}T_0 + Jω_0²/2mc", 1e-9
    yield "heat-balance residual", 0.0, "first law", 1e-12


def stop_with_no_fade():
    yield "stopping time", _J * _W0 / _fading(_W0, 0.0), f"{FORM}J ω_0/M: as without heat", 1e-9


# --- band brakes ------------------------------------------------------------------------------------------------------


def stop(n=20, f=0.35, beta=13.5, R=0.725, J=800.0, C=2e5, T0=8e3, w0=20.0, xp=math):
    """Event times of a stop without load (model §3): t0, lining limits, t1 and stopping time.

        t0 = T_0/(C R ω_0),   lining i: t0 + asin(χ T_0 (Π_i − 1)/(C R ω_0))/χ,   χ² = C R²/J,   t1 = that of lining n
        stop: t1 + J ω_0 cos χ(t1 − t0)/(R T_0 (Π − 1))

    `xp`: `math`, or a module with the same functions for derivatives (`jax.numpy`) or complex numbers (`numpy`).
    """
    z = xp.tan(beta * math.pi / 180 / 2)
    mu = (1 + f * z) / (1 - f * z)
    Pi, t0, chi = mu**n, T0 / (C * R * w0), xp.sqrt(C * R**2 / J)
    limits = [t0 + xp.asin(chi * T0 * (mu ** (i + 1) - 1) / (C * R * w0)) / chi for i in range(n)]
    w1 = w0 * xp.cos(chi * (limits[-1] - t0))
    return {"t0": t0, "limits": limits, "t1": limits[-1], "stop": limits[-1] + w1 * J / (R * T0 * (Pi - 1)), "Pi": Pi}


ELASTIC = {"n": 10, "beta": 27.0, "f": 0.35, "R": 0.725, "J": 800.0, "C": 2e5, "w0": 20.0}


def elastic_stop():
    truth = stop(T0=8e3, **ELASTIC)
    by_asin = f"{FORM}t0 + asin(χ T_0 (Π_5 − 1)/(C R ω_0))/χ, χ² = C R²/J"
    yield "slip onset", truth["t0"], f"{FORM}T_0/(C R ω_0) [Z-15]", EXACT
    yield "limit of lining 5", truth["limits"][4], by_asin, EXACT
    yield "full slip", truth["t1"], f"{FORM}the same with Π [Z-16]", EXACT
    yield "stopping time", truth["stop"], f"{FORM}t1 + J ω_1/(R T_0 (Π − 1)) [Z-17, 18]", EXACT
    yield "maximum tension", 8e3 * truth["Pi"], f"{FORM}T_0 Π", EXACT
    for name in ("f", "beta", "R", "J", "C", "T0", "w0"):
        values = {"T0": 8e3, **ELASTIC}
        values[name] = values[name] + 1e-200j  # no difference of near numbers
        value = stop(xp=np, **values)["stop"].imag / 1e-200
        yield f"∂(stopping time)/∂{name}", value, "closed form of the stop, differentiated", BY_SLOPE


# a hook of 60 t on eight lines, braked by 60 kN·m through one lining
_MASS, _PER_TURN, _HOOK, _HOOK_SPEED, _PULL, _G = 60e3, 0.4 / 8, 1200.0, 24.0, 60e3, 9.81


def hook_load():
    inertia, torque = _HOOK + _MASS * _PER_TURN**2, _MASS * _G * 0.4 / 8
    time = inertia * _HOOK_SPEED / (_PULL - torque)
    yield "stopping time", time, f"{FORM}J_eq ω_0/(M_b − m g r/n), J_eq = J + m(r/n)²", EXACT
    yield "travel", _HOOK_SPEED * 0.4 / 8 * time / 2, f"{FORM}v_0 t/2", EXACT
    yield "friction heat", _PULL * _HOOK_SPEED * time / 2, f"{FORM}M_b ω_0 t/2", EXACT


def one_lining():
    fz = 0.3 * math.tan(math.radians(30.0) / 2)
    yield "tension ratio", (1 + fz) / (1 - fz), f"{FORM}single shoe: (1 + f tan β/2)/(1 − f tan β/2)", EXACT


_RIGID = stop(n=14, f=0.25, beta=15.0)["Pi"]


def brake_on_a_slider():
    source = "Modelica Standard Library, brake on a slider"
    yield "stop", 1.1, f"{source}: 0.1 + m v/F", EXACT
    yield "way", 0.6, f"{source}: v t_0 + m v²/2F", EXACT


def turning_back():
    yield "stopping time", 16e3 / (0.725 * 8e3 * (1 - 1 / _RIGID)), f"{FORM}J|ω_0|/(R T_0 (1 − 1/Π))", EXACT


def growing_load():
    yield "restart", 0.725 * 8e3 * (_RIGID - 1) / 1e3, f"{FORM}where M_load = R T_0 (Π − 1)", EXACT


def exponential_rise():
    x = (4.0 + 0.5) / 0.5
    time = 0.5 * (x + lambertw(-math.exp(-x)).real)
    yield "stopping time", time, f"{FORM}a + τ + τ W_0(−e^(−(a+τ)/τ)), a = Jω_0/M_0", EXACT


def staged_pair():
    J1, J2, w0, M, c = 40.0, 4.0, 20.0, 600.0, 500.0
    t0 = M * (J1 + J2) / (c * J1)
    w_t0 = w0 - c * t0**2 / (2 * (J1 + J2))
    # J2 ω̇2 = M − c t from t0 on, down to 0
    slope = M - c * t0
    d = (slope + math.sqrt(slope**2 + 2 * c * J2 * w_t0)) / c
    w1 = w_t0 - M * d / J1
    # internal slip: ω1 − ω2 = −M τ/J1 − (slope τ − c τ²/2)/J2 until the lock, then ω1 alone
    inner = M * (-(M / J1 + slope / J2) * d**2 / 2 + c * d**3 / (6 * J2)) + J1 * w1**2 / 2
    total = (J1 + J2) * w0**2 / 2
    yield "internal slip", t0, f"{FORM}M_i(J1 + J2)/(c J1)", EXACT
    yield "external lock", t0 + d, f"{FORM}J2 ω̇2 = M_i − c t to 0", EXACT
    yield "speed at the lock", w1, f"{FORM}ω1 = ω(t0) − M_i(t − t0)/J1", EXACT
    yield "stopping time", t0 / 2 + w0 * J1 / M, f"{FORM}t0/2 + ω_0 J1/M_i", EXACT
    yield "internal heat", inner, f"{FORM}∫ M_i(ω1 − ω2) dt", EXACT
    yield "external heat", total - inner, f"{FORM}(J1 + J2)ω_0²/2 − internal heat", EXACT


def held_brake():
    for what in ("half of the capacity", "capacity less 1e-12"):
        yield what, 0.0, "Coulomb friction below its capacity: moves exactly 0", 0.0


def held_staged_brake():
    yield "movement", 0.0, "Coulomb friction below its capacity: none", 0.0


# --- discs, drums, torques on the shaft, rope -------------------------------------------------------------------------


def disc_brake():
    f, inner, outer, n, F, load, J, w0 = 0.4, 0.30, 0.50, 4, 20e3, 1500.0, 400.0, 30.0
    torque = n * f * F * (0.5 * (inner + outer))
    time = J * w0 / (torque - load)
    new_arm = 2 / 3 * (outer**3 - inner**3) / (outer**2 - inner**2)
    of_worn = f"{FORM}J ω_0/(n f F r_e − M), r_e = (r_o + r_i)/2"
    of_new = f"{FORM}the same, r_e = ⅔ (r_o³ − r_i³)/(r_o² − r_i²)"
    yield "stopping time, uniform wear", time, of_worn, EXACT
    yield "friction heat", torque * w0 * time / 2, f"{FORM}n f F r_e ω_0 t/2", EXACT
    yield "stopping time, uniform pressure", J * w0 / (n * f * F * new_arm - load), of_new, EXACT
    yield "restart", 10.0 * 1.25 / 3, f"{FORM}where M(t) = n f_s F r_e", EXACT


def double_shoe():
    """Shigley's internal expanding shoes under the force that gives the leading one 1 MPa, in both directions.

    Drum 300 mm, linings 32 mm wide from 0 to 126°, pins at 122.7 mm; moments of a shoe by quadrature.
    """
    f, J, w0, p, b, r, a, end = 0.32, 12.0, 25.0, 1e6, 0.032, 0.150, 0.1227, math.radians(126.0)
    nodes, weights = np.polynomial.legendre.leggauss(40)

    def over(function, end):
        # exact for these integrands, also along complex angles
        return complex(np.sum(weights * function(0.5 * end * (nodes + 1)))) * end / 2

    def moments(f=f, end=end):
        """Of the normal forces and of friction about the pin, and of friction about the shaft."""
        M_N = p * b * r * a * over(lambda x: np.sin(x) ** 2, end)
        M_F = f * p * b * r * over(lambda x: np.sin(x) * (r - a * np.cos(x)), end)
        return M_N, M_F, f * p * b * r**2 * over(np.sin, end)

    M_N, M_F, leading = (x.real for x in moments())
    force = (M_N - M_F) / 0.212
    trailing = leading * (M_N - M_F) / (M_N + M_F)
    time = J * w0 / (leading + trailing)

    def slowed(f=f, end=end):
        """Stopping time under the same force, whose pressure is that of each shoe."""
        N, M, T = moments(f, end)
        return J * w0 / (force * 0.212 * T * (1 / (N - M) + 1 / (N + M)))

    shigley = "Budynas & Nisbett, Shigley's Mechanical Engineering Design, internal expanding shoes"
    source = f"{shigley}; moments by quadrature"
    yield "torque of the leading shoe", leading, f"{source}: f p b r² ∫ sin θ dθ", EXACT
    yield "torque of the trailing shoe", trailing, f"{source}: M (M_N − M_F)/(M_N + M_F)", EXACT
    yield "stopping time", time, f"{source}: J ω_0/(M_1 + M_2)", EXACT
    yield "maximum pressure", 1e6, f"{source}: 1 MPa was given", EXACT
    yield "friction that locks", f * M_N / M_F, f"{source}: M_N = M_F", EXACT
    of_slope = "the same: J ω_0/(M_1 + M_2), differentiated"
    yield "∂(stopping time)/∂f", slowed(f + 1e-200j).imag / 1e-200, of_slope, BY_SLOPE
    yield "∂(stopping time)/∂θ_2", slowed(end=end + 1e-200j).imag / 1e-200, of_slope, BY_SLOPE
    yield "stopping time backwards", time, "the same", EXACT


def bearing_friction():
    M_c, M, growth = 5e3, 1e3, 800.0
    yield "stopping time", _J * _W0 / (M_c - M), f"{FORM}J ω_0/(M_c − M)", EXACT
    yield "restart", 5.0 + (M_c - M) / growth, f"{FORM}where M(t) = M_c", EXACT


def rope_in_layers():
    """Stops over two and over four layers of rope, by energy."""
    m, r, d, n, g, T_0 = 40e3, 0.4, 0.04, 8.0, 9.80665, 12e3
    M_b = 0.725 * T_0 * (stop()["Pi"] - 1)
    for words, each, turns, w0 in (("hook travel", 4.0, 5.0, _W0), ("hook travel, four layers", 1.5, 5.0, 31.0)):
        top = math.ceil(turns / each)
        energy, travel = 0.5 * (_J + m * ((r + (top - 1) * math.sqrt(3) / 2 * d) / n) ** 2) * w0**2, 0.0
        for layer in range(top, 0, -1):
            radius = r + (layer - 1) * math.sqrt(3) / 2 * d
            net = M_b - m * g * radius / n
            turned = min(2 * math.pi * min(turns - (layer - 1) * each, each), energy / net)
            energy, travel = energy - net * turned, travel + radius * turned / n
        yield words, travel, f"{FORM}Σ r_k φ_k/n, J ω_0²/2 = Σ (M_b − m g r_k/n) φ_k", EXACT


# --- other ways to run a scene ----------------------------------------------------------------------------------------


def prepared_run():
    w0 = 26.0
    time = _J * w0 / (0.725 * 8e3 * (stop()["Pi"] - 1))
    angle, at = 0.5 * w0 * time, "at another initial speed"
    of_time, of_angle = f"{FORM}J ω_0/(R T_0 (Π − 1)), {at}", f"{FORM}J ω_0²/(2 R T_0 (Π − 1)), {at}"
    yield "stopping_time", time, of_time, 1e-10
    yield "stopping_angle", angle, of_angle, 1e-10
    yield "∂(stopping time)/∂ω_0", time / w0, f"{of_time}, differentiated", 1e-10
    yield "∂(stopping angle)/∂J", angle / _J, f"{of_angle}, differentiated", 1e-10


def ensemble():
    def of(w0):
        return stop(n=5, beta=54.0, w0=w0)

    chi, C, source = 0.725 * math.sqrt(2e5 / 800.0), 2e5, f"{FORM}model §3, one by one"
    slow = 8e3 / (C * 0.725 * 0.5) + math.pi / (2 * chi)
    yield "stopping time, run 1", of(20.0)["stop"], source, 1e-10
    yield "stopping time, run 2", slow, f"{FORM}t_0 + π/2χ", 1e-10
    yield "full slip, run 2", 0.0, "does not come", 1e-10
    yield "full slip, run 3", of(26.0)["t1"], source, 1e-10
    yield "slip onset, run 4", of(60.0)["t0"], source, 1e-10
    yield "stop, run 4", 0.0, "later than the end", 1e-10
    yield "stopping time, run 5", of(22.0)["stop"], source, 1e-10
    yield "energy-balance residual", 0.0, "first law", 1e-10


def steps_from_outside():
    """In full slip `ω` falls by `R T_0 (Π − 1)/J` a second, so that its value after every step is known."""
    low, high = (0.725 * T_0 * (stop()["Pi"] - 1) / _J for T_0 in (4e3, 9e3))
    middle, source = _W0 - 0.3 * low, f"{FORM}ω_0 − Σ R T_0 (Π − 1) Δt/J"
    yield "speed after two steps", middle, source, 1e-10
    yield "speed under a harder pull", middle - 0.05 * high, source, 1e-10
    yield "speed put back", middle, source, 1e-10
    yield "stop", 0.3 + middle / high, f"{FORM}t_1 + ω_1 J/(R T_0 (Π − 1))", 1e-10


SUBJECTS = {
    "belt oscillator": belt_oscillator,
    "Robertson": of_the_test_set("1e11", 0.2083340149701255e-7, 0.8333360770334713e-13, 0.9999999791665050),
    "van der Pol": of_the_test_set("2", 0.1706167732170483e1, -0.8928097010247975),
    "two lumps": two_lumps,
    "half-space": half_space,
    "stop with fade": stop_with_fade,
    "stop with no fade": stop_with_no_fade,
    "prepared run": prepared_run,
    "ensemble": ensemble,
    "steps from outside": steps_from_outside,
    "elastic stop": elastic_stop,
    "hook load": hook_load,
    "one lining": one_lining,
    "brake on a slider": brake_on_a_slider,
    "turning back": turning_back,
    "growing load": growing_load,
    "exponential rise": exponential_rise,
    "staged pair": staged_pair,
    "held 3600 s": held_brake,
    "staged brake held 3600 s": held_staged_brake,
    "disc brake": disc_brake,
    "double shoe": double_shoe,
    "bearing friction": bearing_friction,
    "rope in layers": rope_in_layers,
}
