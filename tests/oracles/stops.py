"""What the oracles share: a stop of four linings, quadrature, slopes, the first event
of an equation."""

import math

from scenes import lining_ratio
from scipy.integrate import quad, solve_ivp

EXACT = 1e-10
SMOOTH = 1e-9
BY_SLOPE = 1e-7

# a stop on a rigid or elastic band: four linings of 50°, constant slack tension, no
# load
N = 4
BETA = math.radians(50.0)
R = 0.725
J = 800.0
T0 = 8e3
W0 = 20.0


def ratio(f, beta=BETA):
    """`T_i/T_{i−1}` of a sliding lining."""
    return lining_ratio(f, beta)


def torque(f):
    return R * T0 * (ratio(f) ** N - 1)


def over(function, high):
    return quad(function, 0.0, high, epsabs=0.0, epsrel=1e-13, limit=400)[0]


def slope(of, x, step=1e-2):
    h = step * x
    return sum(
        c * (of(x + k * h) - of(x - k * h)) for k, c in ((1, 45), (2, -9), (3, 1))
    ) / (60 * h)


def at_rest(t, y):
    """Event of `solve_ivp` at which a stop ends, `y[0]` the speed."""
    return y[0]


at_rest.terminal = True


def until_rest(rates, y):
    """The time and state at which `y[0]` comes to 0 first."""
    out = solve_ivp(
        rates, (0.0, 100.0), y, "DOP853", events=at_rest, rtol=2.3e-14, atol=1e-13
    )
    assert out.t_events[0].size, "the event does not come"
    return float(out.t_events[0][0]), out.y_events[0][0]
