"""Hard cases: heat, fade, flash temperature (tested by `test_hard_heat.py`)."""

import functools
import itertools
import math

import diffrax
import equinox as eqx
import jax.numpy as jnp
import numpy as np
from heat_scenes import (
    BETA,
    FLASH,
    T0,
    TRACK,
    W0,
    C,
    J,
    N,
    R,
    fading,
    layered_stop,
    lump,
    rigid_stop,
    warmed,
)
from heat_scenes import brake as heated_brake
from oracles.hard_cases import Case, Named, Value
from scenes import lining_ratio
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

import simbrake as sb

Z = math.tan(BETA / 2)


def tension_ratio(f):
    return lining_ratio(f, BETA) ** N


# --- a surface node of 0.1 µm -------------------------------------------------------

THIN = sb.thermal.layer_growth(1e-7, 0.028, 20)


def layers(growth):
    """Rates of the layers of `layered_stop` and the capacity of the first, written down
    independently."""
    dx = 0.028 * growth ** np.arange(20) / np.sum(growth ** np.arange(20))
    capacity = 7800.0 * 500.0 * TRACK * dx
    between = 48.0 * TRACK / (0.5 * (dx[1:] + dx[:-1]))
    front = 1 / (1 / (60.0 * 0.25 * TRACK) + dx[0] / (2 * 48.0 * TRACK))
    back = 1 / (1 / (60.0 * TRACK) + dx[-1] / (2 * 48.0 * TRACK))

    def rates(T, power):
        q = between * (T[:-1] - T[1:])
        into = np.append(0.0, q) - np.append(q, 0.0)
        into[0] += power - front * T[0]
        into[-1] -= back * T[-1]
        return into / capacity

    return rates, capacity[0]


def rigid_rhs(growth=THIN):
    rates, _ = layers(growth)

    def rhs(t, y):
        torque = R * T0 * (tension_ratio(0.35 * (1 - 3e-4 * y[1])) - 1)
        return np.append(-torque / J, rates(y[1:], 0.95 * torque * y[0]))

    return rhs


def thin_surface():
    """A stop on a rigid band against Radau: stopping time and all layers."""
    result = sb.simulate(rigid_stop(fading(), layered_stop(THIN).heat, 2.0))

    def stop(t, y):
        return y[0]

    stop.terminal = True
    stop.direction = -1
    start = np.append(W0, np.zeros(20))
    out = solve_ivp(
        rigid_rhs(), (0, 5), start, "Radau", events=stop, rtol=1e-10, atol=1e-10
    )
    T = (
        result.series([float(result.stopping_time)], left=True).temperature[0]
        - sb.thermal.ROOM
    )
    return [
        Value("stopping time", result.stopping_time, out.t[-1], 1e-8),
        Value("temperatures of the layers", T, out.y[1:, -1], 1e-6),
        Named("method", result.method_name, "Rodas5P"),
        Value("heat-balance residual", result.energy["heat_closure"], 0.0, 1e-10, True),
    ]


#: `−γ = |dT_n/dT_s| a (T_n − T_0)/(C c_s)` at full slip, where the surface is still
#: cold
STEEP_FADE = 3e-3
PI = tension_ratio(0.35)
# |dT_n/dT_s| over the slope of the fade (N)
SLOPE = T0 * PI * N * 2 * Z / (1 - (0.35 * Z) ** 2) * 0.35
FULL_SLIP = math.asin(math.sqrt(C / J) * T0 * (PI - 1) / (C * W0)) / (
    R * math.sqrt(C / J)
)


def snaps():
    """A surface of 0.1 µm without anything behind it, and surfaces a little above and
    below the least capacity."""
    least = SLOPE * STEEP_FADE * T0 * (PI - 1) / C

    def stop(capacity):
        duty = sb.Duty(T0, 0.0)
        law = fading(slope=STEEP_FADE, floor=0.4)
        given = sb.Scene(
            heated_brake(law), duty, sb.Initial(W0, T0 / C), 20.0, lump(capacity)
        )
        return sb.simulate(given, solver=diffrax.Dopri8(), throw=False)

    thin, above, below = (
        stop(c) for c in (7800.0 * 500.0 * TRACK * 1e-7, least * 1.001, least * 0.999)
    )
    return [
        Named("0.1 µm", thin.status, "band_snap"),
        Value("its time, full slip", thin.record.t_end, FULL_SLIP, 1e-9),
        Named("least capacity + 0.1 %", above.status, "stopped"),
        Named("− 0.1 %", below.status, "band_snap"),
        Value("its time", below.record.t_end, FULL_SLIP, 1e-9),
    ]


# --- radiation, runaway -------------------------------------------------------------


FADE = {"slope": 2.5e-3, "floor": 0.2, "capacity": 800.0, "load": 1.0e4}


def running_away(load=FADE["load"], end=12.0, blend=0.0):
    law = fading(slope=FADE["slope"], floor=FADE["floor"], blend=blend)
    return rigid_stop(law, lump(FADE["capacity"]), end, load=load)


def runs_away():
    """At first the brake slows the load; it fades, and the load wins.

    Adiabatic: `d(J ω²/2)/dT = c (M/M_b − 1)`, `dt = c dT/(M_b ω)`.
    """
    result = sb.simulate(running_away())
    c = FADE["capacity"]
    M = FADE["load"]
    corner = (1 - FADE["floor"]) / FADE["slope"]

    def torque(u):
        return (
            R
            * T0
            * (tension_ratio(0.35 * max(1 - FADE["slope"] * u, FADE["floor"])) - 1)
        )

    def speed(u):
        inside = quad(
            lambda s: M / torque(s) - 1, 0.0, min(u, corner), epsabs=1e-9, epsrel=1e-12
        )[0]
        inside += max(u - corner, 0.0) * (M / torque(corner) - 1)
        return math.sqrt(W0**2 + 2 * c / J * inside)

    def time(u):
        ends = [0.0, min(u, corner), u]
        return sum(
            quad(
                lambda s: c / (torque(s) * speed(s)), a, b, epsabs=1e-12, epsrel=1e-12
            )[0]
            if b > a
            else 0.0
            for a, b in itertools.pairwise(ends)
        )

    u = float(result.end_temperatures[0]) - sb.thermal.ROOM
    slowest = brentq(lambda u: torque(u) - M, 0.0, corner)
    least = float(np.min(np.asarray(result.series(np.linspace(0.0, 12.0, 4001)).omega)))
    return [
        Named("", result.status, "runaway"),
        Value("minimum speed, where M_b = M", least, speed(slowest), 1e-6),
        Value("speed at the end", result.record.y_end.omega, speed(u), 1e-9),
        Value("time at its temperature", time(u), 12.0, 1e-8),
        Value("energy-balance residual", result.energy["closure"], 0.0, 1e-9, True),
    ]


# --- flash temperature --------------------------------------------------------------

#: friction that rises steeply between 400 and 450 K
STEEP = sb.friction.ProductFriction(
    0.3,
    (
        sb.friction.TabulatedFade(
            np.array([250.0, 400.0, 450.0, 2000.0]), np.array([0.9, 1.0, 2.2, 2.3])
        ),
    ),
)
HARD = eqx.tree_at(
    lambda f: f.hardness, FLASH, np.asarray(3e7), is_leaf=lambda x: x is None
)


def excess(T, v, f):
    """`f − F(T + ΔT(f))`."""
    rise = (
        2 * np.asarray(f) * 3e7 * v / 50.0 * math.sqrt(1.44e-5 * 1e-3 / (math.pi * v))
    )
    return f - 0.3 * np.asarray(
        STEEP.factors[0].factor(sb.friction.Contact(v=None, T=jnp.asarray(T + rise)))
    )


@functools.cache
def roots(T, v):
    f = np.linspace(0.2, 0.8, 601)
    r = excess(T, v, f)
    changed = np.flatnonzero(np.sign(r[:-1]) != np.sign(r[1:]))
    return tuple(
        brentq(lambda x: excess(T, v, x), f[i], f[i + 1], xtol=1e-15) for i in changed
    )


def started(T, v=20.0 * R, law=STEEP):
    """A run from a temperature and a sliding speed."""
    given = warmed(
        law, 1e5, stiffness=None, end=1.0, flash=HARD, capacity=1e5, w0=v / R
    )
    given = eqx.tree_at(lambda s: s.heat.bodies[0].temperature, given, T)
    return sb.simulate(given, throw=False)


def two_solutions():
    T = 300.0
    v = 14.0
    found = np.asarray(started(T, v).series([0.0]).friction_coefficient[0])
    assert len(roots(340.0, v)) == 1
    return [
        Named("roots", len(roots(T, v)), 3),
        Value(
            "that of the branch from ΔT = 0",
            found,
            np.full(len(found), roots(T, v)[0]),
            1e-12,
        ),
        Named(
            "40 K hotter only the upper one is left, and rejected",
            started(340.0, v).status,
            "flash_fold",
        ),
    ]


def no_solution():
    """Warm already at the start: the branch without flash does not exist there; and
    friction beyond locking."""
    hot = started(345.0)
    # f z rises from 0.46 beyond 1
    locking = eqx.tree_at(lambda law: law.base.coefficient, STEEP, np.asarray(3.9))
    locked = started(330.0, law=locking)
    return [
        Named("no branch from ΔT = 0", hot.status, "flash_fold"),
        Value("at", hot.record.t_end, 0.0, 0.0, True),
        Named("the only root beyond locking", locked.status, "flash_fold"),
    ]


CASES = [
    Case(
        "surface node of 0.1 µm, rigid band",
        "rates of 1e9 1/s beside a stop of 0.7 s",
        thin_surface,
    ),
    Case(
        "surface node of 0.1 µm, fade, compliant band",
        "fade outruns the band: there is no answer",
        snaps,
    ),
    Case(
        "thermal runaway by fade",
        "the brake slows the load, fades, and loses it",
        runs_away,
    ),
    Case(
        "flash temperature with several solutions",
        "three roots, and a fold that removes two",
        two_solutions,
    ),
    Case(
        "flash temperature without a solution at the start",
        "no branch to begin on",
        no_solution,
        slow=True,
    ),
]
