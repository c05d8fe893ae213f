"""The integrator on small systems with exact answers: event times and their first
derivatives."""

import math

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import DOPRI8, all_near, event_times, near, settings, solve
from small_systems import (
    SLIP,
    BeltOscillator,
    BouncingBall,
    CoulombOscillator,
    Filippov,
    Oscillator,
    Robertson,
    VanDerPol,
    arrays,
    first_event_times,
)

import simbrake as sb

BELT = arrays(BeltOscillator())
T_SLIP = 4.06888787159140
T_STICK = 4.0
BALL = [
    0.451523640985731,
    1.08365673836575,
    1.52614990653177,
    1.83589512424798,
    2.05271677664933,
    2.20449193333027,
    2.31073454300693,
    2.3851043697806,
    2.43716324852216,
    2.47360446364125,
    2.49911331422462,
]


def belt_start(belt):
    return Oscillator(belt.F_s / belt.k, belt.v_b), jnp.asarray(SLIP)


@jax.jit
def _states_at(record, ts):
    return record.at(ts)[0]


def states_at(record, ts):
    """Interpolated states as NumPy arrays, by one program."""
    return jax.tree.map(np.asarray, _states_at(record, ts))


def test_belt_oscillator_times_and_extremes():
    r = solve(BELT, *belt_start(BELT), 0.0, 30.0, settings(1e-13))
    period = T_SLIP + T_STICK
    truth = [T_SLIP, period, period + T_SLIP, 2 * period, 2 * period + T_SLIP]
    all_near(event_times(r)[:5], truth, 1e-11 / 4)
    # extremes over one slip phase, where v = 0: x = F_k/k ± √(Δ² + v_b²/ω²)
    top = math.atan2(0.2, 0.4)
    x = states_at(r, np.asarray([top, top + math.pi])).x
    all_near(x, [1.047213595499958, 0.152786404500042], 1e-11)


def belt_period(belt):
    r = sb.hybrid.hybridsolve(
        belt, *belt_start(belt), 0.0, 12.0, DOPRI8, settings(1e-12, max_steps=128)
    )
    return first_event_times(r, 2)[1]


@pytest.mark.slow
def test_gradient_of_belt_oscillator_period():
    truth = {
        "F_s": 8.0,
        "F_k": -8.0,
        "v_b": -16.0,
        "k": -5.63444393579570,
        "m": 2.43444393579570,
    }
    reverse = jax.jit(jax.grad(belt_period))(BELT)
    forward = jax.jit(jax.jacfwd(belt_period))(BELT)
    for name, value in truth.items():
        near(getattr(reverse, name), value, 1e-9)
        near(getattr(forward, name), getattr(reverse, name), 1e-12)


def test_second_derivatives_are_refused():
    with pytest.raises(
        NotImplementedError,
        match=r"first derivatives only.*simbrake\.studies\.hessian does",
    ):
        jax.jit(jax.hessian(belt_period))(BELT)


def test_leine_slip_law():
    """Leine et al. 1998, slip law F_s/(1 + 3|v|): exact stick, where smoothing gives
    11.298…11.989 for the period."""
    r = solve(
        arrays(BeltOscillator(decay=3.0)), *belt_start(BELT), 0.0, 13.0, settings(1e-13)
    )
    all_near(event_times(r), [4.29599952548, 12.00103129483], 1e-10)
    x = states_at(r, np.asarray([4.29599952548])).x
    near(x[0], -0.54100635387, abs=1e-9)


def test_coulomb_oscillator_rests_exactly():
    r = solve(
        arrays(CoulombOscillator()),
        Oscillator(1.0, 0.0),
        jnp.asarray(-1),
        0.0,
        1000.0,
        settings(1e-13),
    )
    near(event_times(r)[-1], 9.42477796076938, 1e-12)
    near(r.y_end.x, -0.1, abs=1e-12)
    assert float(r.y_end.v) == 0.0
    rest = states_at(r, np.linspace(9.5, 1000.0, 50))
    assert np.all(np.asarray(rest.x) == float(r.y_end.x))


def test_filippov_sliding():
    r = solve(
        arrays(Filippov()),
        jnp.asarray([1.5, 1.0]),
        jnp.asarray(1),
        0.0,
        1.0,
        settings(),
    )
    all_near(event_times(r), [1 / 7], 1e-12)
    all_near(r.y_end, [31 / 34, 31 / 34], 1e-12)


def test_bouncing_ball():
    r = solve(
        arrays(BouncingBall()),
        Oscillator(1.0, 0.0),
        jnp.asarray(0),
        0.0,
        3.0,
        settings(),
    )
    all_near(event_times(r), BALL, 1e-12)
    assert float(r.y_end.v) == 0.0


@pytest.mark.parametrize("rtol", [1e-5, 1e-7, 1e-9])
def test_event_times_are_within_tolerance(rtol):
    """Not as an interpolant: the error of an event time stays near the tolerance and
    falls with it."""
    r = solve(BELT, *belt_start(BELT), 0.0, 9.0, settings(rtol))
    assert abs(event_times(r)[0] - T_SLIP) < 10 * rtol


@pytest.mark.parametrize(
    ("system", "start", "end", "rtol", "truth"),
    [
        (
            Robertson(),
            [1.0, 0, 0],
            1e11,
            1e-8,
            [0.2083340149701255e-7, 0.8333360770334713e-13, 0.9999999791665050],
        ),
        (VanDerPol(), [2.0, 0], 2.0, 1e-9, [1.706167732170483, -0.8928097010247975]),
    ],
)
def test_stiff_problems(system, start, end, rtol, truth):
    """Against the Test Set for IVP Solvers (Mazzia & Magherini), at its end times."""
    r = solve(
        system,
        jnp.asarray(start),
        jnp.asarray(0),
        0.0,
        end,
        settings(rtol, max_steps=8192),
        sb.hybrid.Rodas5P(),
    )
    all_near(r.y_end, truth, 1e-6)


@pytest.mark.slow
def test_events_match_nested_diffrax():
    """The same slip phase by diffrax's own event mechanism, bisected to rounding."""
    import optimistix

    def field(t, y, args):
        return jnp.stack([y[1], 1 / (1 + 3 * (0.2 - y[1])) - y[0]])

    def fires(t, y, args, **kwargs):
        # 0.2 − v starts at 0 and rises: watch it once it has left
        return jnp.where(t < 0.1, 1.0, 0.2 - y[1])

    out = diffrax.diffeqsolve(
        diffrax.ODETerm(field),
        diffrax.Dopri8(),
        0.0,
        10.0,
        1e-3,
        jnp.asarray([1.0, 0.2]),
        stepsize_controller=diffrax.PIDController(rtol=1e-12, atol=1e-12, dtmax=0.05),
        event=diffrax.Event(
            fires, optimistix.Bisection(rtol=1e-14, atol=1e-14), direction=False
        ),
    )
    r = solve(
        arrays(BeltOscillator(decay=3.0)), *belt_start(BELT), 0.0, 5.0, settings(1e-13)
    )
    near(event_times(r)[0], out.ts[0], abs=1e-9)


def test_shipped_tableau_is_that_of_diffrax():
    assert sb.hybrid.ExplicitRungeKutta.shipped(
        "Dopri8"
    ) == sb.hybrid.ExplicitRungeKutta(diffrax.Dopri8())
