"""Several bands of unequal linings under one lever: shares, stops, holds in closed
form, heat against SciPy, input."""

import math

import numpy as np
import pytest
from helpers import all_near, closes, near
from oracles.stops import at_rest
from scenes import lining_ratio, with_points
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

import simbrake as sb

R = 0.59
R_B = 0.623
J = 1200.0
W0 = 20.0
T0 = 6e3
LOAD = 3e3
ANGLES = (np.array([0.9, 0.7, 0.8, 1.1]), np.array([0.5, 0.6, 0.4, 0.7, 0.8, 0.6]))
FRICTION = (np.array([0.35, 0.3, 0.32, 0.4]), np.full(6, 0.28))
STIFFNESS = (2e5, 3.5e5)
RATIO = (1.2, 1.05)
AREA = (0.03, np.array([0.02, 0.02, 0.015, 0.025, 0.03, 0.02]))


def lined(j, *, law=None, angle=None, stiffness=None, share=None, area=None):
    law = sb.ConstantFriction(FRICTION[j], RATIO[j]) if law is None else law
    linings = sb.Lining(
        law, ANGLES[j] if angle is None else angle, AREA[j] if area is None else area
    )
    stiffness = STIFFNESS[j] if stiffness is None and share is None else stiffness
    return sb.brakes.LinedBand(linings, stiffness, share)


def scene(bands=None, *, load=LOAD, omega=W0, pull=T0, end=6.0, **parts):
    bands = (lined(0), lined(1)) if bands is None else bands
    brake = sb.brakes.MultiBandBrake(sb.Pulley(R, J), R_B, bands)
    duty = sb.Duty(with_points(pull), sb.TorqueLoad(with_points(load)))
    return sb.Scene(brake, duty, sb.Initial(omega), end, **parts)


def tensions(slack, f, angle, back=False):
    mu = lining_ratio(f, angle)
    return slack * np.append(1.0, np.cumprod(1 / mu if back else mu))


def shares(stiffness=STIFFNESS, friction=FRICTION, xp=np):
    """K-8 with `c = Π/C`: all bands have one elongation `x = T_n/C`."""
    growth = [
        xp.prod(lining_ratio(f, a)) for f, a in zip(friction, ANGLES, strict=True)
    ]
    yielding = xp.stack([C / Pi for C, Pi in zip(stiffness, growth, strict=True)])
    return yielding / yielding.sum()


@pytest.fixture(scope="module")
def stopped():
    return sb.simulate(scene())


def test_a_stop_has_the_torque_of_both_bands(stopped):
    share = shares()
    along = [
        tensions(s * T0, f, a) for s, f, a in zip(share, FRICTION, ANGLES, strict=True)
    ]
    torque = R_B * sum(T[-1] - T[0] for T in along)
    time = J * W0 / (torque - LOAD)
    near(stopped.stopping_time, time, 1e-12)
    all_near(sb.brakes.tension_shares(stopped.scene.brake), share, 1e-14)
    s = stopped.series([0.5 * time])
    all_near(s.tension[0], np.concatenate([T[1:] for T in along]), 1e-13)
    near(s.tight_tension[0], sum(T[-1] for T in along), 1e-13)
    loads = [
        (T[1:] + T[:-1]) * np.sin(a / 2) for T, a in zip(along, ANGLES, strict=True)
    ]
    all_near(s.normal_load[0], np.concatenate(loads), 1e-13)
    work = np.asarray(sb.results.friction_work(stopped))
    all_near(
        work, np.concatenate([np.diff(T) for T in along]) * R_B * W0 * time / 2, 1e-11
    )
    closes(stopped, 1e-12)
    greatest = stopped.max_tension
    T_max = np.array([T[-1] for T in along])
    near(greatest.value, T_max.max(), 1e-13)
    assert int(greatest.lining) == (4, 10)[int(T_max.argmax())]


@pytest.mark.smoke
def test_given_shares_are_relative():
    for given in ((1.0, 2.0), (0.25, 0.5)):
        result = sb.simulate(
            scene((lined(0, share=given[0]), lined(1, share=given[1])))
        )
        torque = sum(
            w * R_B * T0 * (lining_ratio(f, a).prod() - 1)
            for w, f, a in zip((1 / 3, 2 / 3), FRICTION, ANGLES, strict=True)
        )
        near(result.stopping_time, J * W0 / (torque - LOAD), 1e-12)


def test_geometries_stretch_alike():
    """Each band by quadrature of `∫ S R dθ/(E A)` and its ends, `S` by Euler's law up
    to the tight end.

    There it is the `T_n = Π T_0` of the band's linings, whose share of the lever's
    tension `T_0` is.
    """
    modulus = 2.06e11
    area = (1.3e-3, 1.1e-3)
    ends = ((0.35, 0.6), (0.3, 1.4))
    bands = tuple(
        lined(
            j,
            stiffness=sb.brakes.LiningsOnPlates(
                modulus, area[j], *ends[j], gap=0.02 * j
            ),
        )
        for j in (0, 1)
    )
    found = np.asarray(sb.brakes.tension_shares(scene(bands).brake))
    stretch = []
    for j, share in enumerate(found):
        S = (
            share
            * T0
            * lining_ratio(FRICTION[j], ANGLES[j]).prod()
            / math.exp(np.sum(FRICTION[j] * ANGLES[j]))
        )
        total = S * ends[j][0] / (modulus * area[j])
        EA = modulus * area[j]
        for i, (f, a) in enumerate(zip(FRICTION[j], ANGLES[j], strict=True)):
            total += (
                quad(
                    lambda x, S=S, f=f: S * math.exp(f * x),
                    0,
                    a,
                    epsabs=0,
                    epsrel=1e-13,
                )[0]
                * R_B
                / EA
            )
            S *= math.exp(f * a)
            total += (
                S * R_B * 0.02 * j / EA
                if i < len(ANGLES[j]) - 1
                else S * ends[j][1] / EA
            )
        stretch.append(total)
    near(found.sum(), 1.0, 1e-15)
    near(stretch[0], stretch[1], 1e-12)


def test_sharing_of_a_load_at_rest(stopped):
    static = [r * f for r, f in zip(RATIO, FRICTION, strict=True)]
    slack = shares() * T0
    most = np.array(
        [
            T * (lining_ratio(f, a).prod() - 1)
            for T, f, a in zip(slack, static, ANGLES, strict=True)
        ]
    )
    s = stopped.series([5.5])
    assert float(s.omega[0]) == 0.0
    assert float(s.brake_torque[0]) == LOAD
    held = stopped.scene.brake.of_bands(np.asarray(s.tension)[0])
    all_near([T[-1] for T in held] - slack, LOAD / R_B * most / most.sum(), 1e-12)
    for j, T in enumerate(held):  # no lining beyond its limit
        assert np.all(np.diff(np.append(slack[j], T)) >= -1e-9)
        assert np.all(
            T / np.append(slack[j], T[:-1])
            <= lining_ratio(static[j], ANGLES[j]) * (1 + 1e-12)
        )
    near(stopped.metrics["min_holding_reserve"], R_B * most.sum() / LOAD, 1e-12)
    rising = sb.PiecewiseLinear([0.0, 9.0], [0.0, 3 * R_B * most.sum()])
    result = sb.simulate(scene(omega=0.0, load=rising, end=5.0))
    restart = result.events["restart"].times[0]
    near(restart, 3.0, 1e-12)
    kinetic = sum(
        T * (lining_ratio(f, a).prod() - 1)
        for T, f, a in zip(slack, FRICTION, ANGLES, strict=True)
    )
    near(result.end_capacity.torque, R_B * kinetic, 1e-12)


# --- heat, fade, memory, wear -------------------------------------------------------

C_RIM = 4e4
G_RIM = 60.0
TO_RIM = 0.7
ROOM = 293.15
N = ANGLES[0].size, ANGLES[1].size


@pytest.mark.slow
def test_laws_see_the_rim_of_their_own_band():
    """Rims that start at different temperatures; heat into the linings is not
    modelled."""
    start = np.array([293.15, 393.15])
    fade = sb.LinearFade(2e-3, 273.15)
    laws = [
        sb.friction.ProductFriction(sb.ConstantFriction(f, 1.0), (fade,))
        for f in FRICTION
    ]
    heat = sb.Heat(
        (
            sb.thermal.Lump("rims", C_RIM, start, count=2),
            sb.thermal.Reservoir("air", ROOM),
        ),
        (sb.thermal.Conductance("rims", "air", G_RIM),),
        sb.thermal.FrictionHeat("rims", None, TO_RIM),
        rim="rims",
    )
    result = sb.simulate(
        scene((lined(0, law=laws[0]), lined(1, law=laws[1])), load=0.0, heat=heat),
        rtol=1e-11,
    )

    def friction(T):
        return [
            f * (1 - 2e-3 * (rim - 273.15)) for f, rim in zip(FRICTION, T, strict=True)
        ]

    slack = shares(friction=friction(start)) * T0
    near(
        slack[0],
        T0
        * float(sb.brakes.tension_shares(result.scene.brake, np.repeat(start, N))[0]),
    )

    def rates(t, y):
        f = friction(y[1:])
        pull = np.array(
            [
                S * (lining_ratio(one, a).prod() - 1)
                for S, one, a in zip(slack, f, ANGLES, strict=True)
            ]
        )
        return [
            -R_B * pull.sum() / J,
            *((TO_RIM * pull * R_B * y[0] - G_RIM * (y[1:] - ROOM)) / C_RIM),
        ]

    truth = solve_ivp(
        rates, (0, 9), [W0, *start], "DOP853", events=at_rest, rtol=1e-13, atol=1e-12
    )
    near(result.stopping_time, truth.t[-1], 1e-10)
    all_near(result.series([truth.t[-1]]).rim_temperature[0], truth.y[1:, -1], 1e-10)


@pytest.mark.slow
def test_pressure_on_one_band():
    factor = FRICTION[0]
    p_r = 5e5
    m = 0.3
    law = sb.friction.ProductFriction(factor, (sb.friction.PressureFactor(p_r, m),))
    result = sb.simulate(scene((lined(0, law=law, share=1.0), lined(1, share=1.0))))
    slack = T = T0 / 2
    for f_0, a in zip(factor, ANGLES[0], strict=True):

        def excess(f, T=T, a=a, f_0=f_0):
            mu = lining_ratio(f, a)
            return f - f_0 * (1 + T * (1 + mu) * math.sin(a / 2) / AREA[0] / p_r) ** -m

        T *= lining_ratio(brentq(excess, 0.0, f_0, xtol=1e-15), a)
    torque = R_B * (
        T - slack + slack * (lining_ratio(FRICTION[1], ANGLES[1]).prod() - 1)
    )
    near(result.stopping_time, J * W0 / (torque - LOAD), 1e-12)
