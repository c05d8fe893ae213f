"""Oracles of duties: phases, retarders, levers that hold a speed, actuators."""

import math

from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from stops import BY_SLOPE, EXACT, SMOOTH, W0, G, J, N, R, ratio, slope


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
    """`τ F' + F = u(t − t_d)`, `T_0 = F − F_s`: the force in closed form from point to point, then `J ω̇ = −M`."""
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

    source = "closed form: ∫ (F − F_s) dt = J ω_0/R(Π − 1), F by τ F' + F = u(t − t_d) from point to point"
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


SUBJECTS = {
    "lever that holds the speed": lever_that_holds_the_speed,
    "actuator": actuator,
    "phase that ends hot": phase_that_ends_hot,
    "phases by state": phases_by_state,
    "retarders on the shaft": retarders_on_the_shaft,
    "free fall, then brake": free_fall_then_brake,
}
