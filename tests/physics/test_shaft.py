"""Torques on the shaft beside the brake: stops, rest on dry friction, terminal speeds,
heat; against closed forms."""

import dataclasses
import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import all_equal, all_near, changes_of, names_of, near
from oracles.stops import at_rest
from scenes import GAIN, PI, stop_scene
from scipy.integrate import quad, solve_ivp

import simbrake as sb
from simbrake.loads import (
    BearingFriction,
    EddyCurrentBrake,
    HydrodynamicBrake,
    TabulatedDrag,
    TabulatedLoad,
    TackleLoss,
    ViscousDrag,
)

J = 800.0
W0 = 20.0
#: torque per newton of slack tension of the brake of `stop_scene`


def scene(*laws, load=0.0, T0=0.0, w0=W0, end=30.0, C=None, **given):
    """A rigid brake, its band open unless told otherwise, with torques on its shaft."""
    return dataclasses.replace(
        stop_scene(C=C, T0=T0, w0=w0, load=load, end=end, **given), shaft=laws
    )


def run_of(*laws, **given):
    return sb.simulate(scene(*laws, **given))


def balanced(result):
    """The balances of energy and heat close."""
    energy = result.energy
    assert float(energy["closure"]) < 1e-9
    assert float(energy.get("heat_closure", 0.0)) < 1e-12
    return energy


# --- stops on one law and on three --------------------------------------------------


@pytest.mark.slow
def test_stop_on_three_laws_and_derivatives():
    """Dry, viscous and quadratic drag with the band open:
    `t = (2J/D)[atan((2kω+c)/D)]`, `D² = 4 k M − c²`."""
    given = jnp.asarray([1500.0, 40.0, 12.0, J, W0])

    def run(x):
        laws = (BearingFriction(x[0]), ViscousDrag(x[1]), HydrodynamicBrake(x[2]))
        return sb.simulate(scene(*laws, J=x[3], w0=x[4]), max_steps=128).stopping_time

    def closed(x):
        M, c, k, inertia, omega = x
        D = jnp.sqrt(4 * k * M - c**2)
        return (
            2 * inertia / D * (jnp.arctan((2 * k * omega + c) / D) - jnp.arctan(c / D))
        )

    all_near(jax.jit(jax.jacrev(run))(given), jax.grad(closed)(given), 1e-7)
    result = run_of(BearingFriction(1500.0), ViscousDrag(40.0), HydrodynamicBrake(12.0))
    assert (result.status, names_of(result)) == ("stopped", ["stop"])
    near(result.stopping_time, closed(given), 1e-9)
    energy = balanced(result)
    near(energy["shaft_bearing_friction"], 1500.0 * float(result.stopping_angle), 1e-9)
    shares = [
        float(energy[f"shaft_{name}"])
        for name in ("bearing_friction", "viscous_drag", "hydrodynamic_brake")
    ]
    near(sum(shares), 0.5 * J * W0**2, 1e-12)
    assert float(result.record.y_end.omega) == 0.0


def test_eddy_current_brake_after_kloss():
    """`t = ∫ J (ω² + ω_m²)/(2 e² M_m ω ω_m) dω` between two speeds, by quadrature; e
    from 0.5 to 1 at the second."""
    M_m = 9e3
    w_m = 11.0
    slow = 12.0

    def time(e, high, low):
        return quad(
            lambda w: J * (w**2 + w_m**2) / (2 * e**2 * M_m * w * w_m),
            low,
            high,
            epsabs=0,
            epsrel=1e-13,
        )[0]

    first = time(0.5, W0, slow)
    second = time(1.0, slow, 3.0)
    e = sb.PiecewiseLinear([first, first], [0.5, 1.0])
    result = run_of(EddyCurrentBrake(M_m, w_m, e), end=first + second)
    near(result.record.y_end.omega, 3.0, 1e-9)
    seen = result.series([first], left=True)
    near(seen.omega[0], slow, 1e-9)
    torque = 2 * 0.25 * M_m * slow * w_m / (slow**2 + w_m**2)
    near(seen.shaft_torque[0], torque, 1e-9)
    assert result.status == "released"
    near(balanced(result)["shaft_eddy_current_brake"], 0.5 * J * (W0**2 - 9.0), 1e-9)


# --- terminal speeds ----------------------------------------------------------------

LOAD = 6e3


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "closed"),
    [
        (
            lambda M: EddyCurrentBrake(M, 9.0),
            lambda M: 9.0 * (M / LOAD - jnp.sqrt((M / LOAD) ** 2 - 1)),
        ),
        (lambda k: HydrodynamicBrake(k), lambda k: jnp.sqrt(LOAD / k)),
        (lambda c: ViscousDrag(c), lambda c: LOAD / c),
    ],
)
def test_terminal_speed_of_each_law(law, closed):
    size = 2e4 if "Eddy" in type(law(1.0)).__name__ else 900.0

    def speed(x):
        return sb.simulate(
            scene(law(x), load=LOAD, w0=0.0, end=20.0), max_steps=256
        ).terminal_speed

    value, slope = jax.jvp(speed, (jnp.asarray(size),), (jnp.ones(()),))
    truth, exact = jax.jvp(closed, (jnp.asarray(size),), (jnp.ones(()),))
    near(value, truth, 1e-9)
    near(slope, exact, 1e-7)
    result = run_of(law(size), load=LOAD, w0=0.0, end=20.0)
    assert result.status == "lowering"
    assert result.message.endswith(f"{float(truth):.6g} rad/s")
    assert result.summary()["metrics"]["terminal_speed"] == float(value)
    near(result.record.y_end.omega, truth, 1e-2)
    balanced(result)


@pytest.mark.slow
def test_load_above_the_maximum_torque():
    assert math.isinf(
        run_of(
            EddyCurrentBrake(0.9 * LOAD, 9.0), load=LOAD, w0=1.0, end=2.0
        ).terminal_speed
    )
    # a band that drags: M_load − M_b = c ω
    result = run_of(ViscousDrag(500.0), load=LOAD, T0=0.6 * LOAD / GAIN, end=15.0)
    assert result.status == "lowering"
    near(result.terminal_speed, 0.4 * LOAD / 500.0, 1e-9)
    # the band cannot hold the load, and the eddy-current brake is past its maximum: it
    # runs away
    lost = run_of(
        EddyCurrentBrake(0.3 * LOAD, 2.0), load=LOAD, T0=0.6 * LOAD / GAIN, end=1.0
    )
    assert lost.status == "runaway"
    # on the way to a terminal speed it is neither
    assert (
        run_of(ViscousDrag(500.0), load=LOAD, T0=0.6 * LOAD / GAIN, end=0.1).status
        == "not_stopped"
    )


# --- rest on dry friction -----------------------------------------------------------


@pytest.mark.slow
def test_a_load_that_turns_round():
    """Dry friction opposes both ways: rest while `|M| ≤ M_c`, then backwards; also
    where the band stopped it first."""
    M_c = 2e3

    def turned(times, torques, end, T0=0.0):
        load = sb.PiecewiseLinear(times, torques)
        lever = sb.PiecewiseLinear([0.0, 0.5, 0.5], [T0, T0, 0.0])
        return run_of(
            BearingFriction(M_c),
            load=sb.TorqueLoad(load),
            lever=lever,
            w0=1.0,
            end=end,
        )

    result = turned([0.0, 10.0], [0.0, -1e4], 6.0)

    def motion(sense):
        return lambda t, y: [(-1e3 * t - sense * M_c) / J]

    ahead = solve_ivp(
        motion(1.0),
        (0.0, 6.0),
        [1.0],
        events=at_rest,
        rtol=1e-12,
        atol=1e-14,
        method="DOP853",
    )
    back = solve_ivp(
        motion(-1.0), (2.0, 6.0), [0.0], rtol=1e-12, atol=1e-14, method="DOP853"
    )
    assert names_of(result) == ["stop", "restart"]
    near(result.stopping_time, ahead.t[-1], 1e-9)
    near(result.events[1].time, 2.0, 1e-10)
    near(result.record.y_end.omega, back.y[0, -1], 1e-9)
    # without rest between: a jump of the load throws it back at once
    thrown = turned([0.0, 0.0], [-9e3, -9e3], 1.0)
    turn = J * 1.0 / (9e3 + M_c)
    near(thrown.record.y_end.omega, -(9e3 - M_c) * (1.0 - turn) / J, 1e-9)
    assert math.isinf(thrown.stopping_time)
    balanced(thrown)


@pytest.mark.slow
@pytest.mark.parametrize("C", [None, 2e5])
def test_bearings_hold_first_then_the_band(C):
    """Held by both; the lever is released and the bearings hold; the load grows until
    it exceeds them."""
    M_c = 4e3
    M = 3e3
    T0 = 2e3
    slope = 1e3
    lever = sb.PiecewiseLinear([0.0, 6.0, 6.0], [T0, T0, 0.0])
    grown = sb.TorqueLoad(
        sb.PiecewiseLinear([0.0, 3.0, 4.0, 5.0, 8.0, 30.0], [M, M, 6e3, M, M, M + 22e3])
    )
    result = run_of(BearingFriction(M_c), load=grown, lever=lever, C=C, end=9.6, w0=4.0)
    seen = result.series([2.0, 4.0, 7.0])
    all_equal(seen.omega, 0.0)
    all_near(seen.brake_torque, [0.0, 6e3 - M_c, 0.0], atol=1e-8)
    all_near(seen.shaft_torque, [M, M_c, M], 1e-12)
    assert changes_of(result)[-3:] == [
        "stop",
        "release",
        "restart",
    ]
    restart = 8.0 + (M_c - M) / slope
    near(result.events[-1].time, restart, 1e-11)
    near(result.record.y_end.omega, slope * (9.6 - restart) ** 2 / (2 * J), 1e-8)
    if C is None:
        near(result.stopping_time, J * 4.0 / (T0 * GAIN + M_c - M), 1e-11)
    balanced(result)


@pytest.mark.slow
def test_tackle_loss_helps_to_lower():
    """The drum sees `η m g r/n`, at rest as well."""
    eta = 0.85
    m = 20e3
    T0 = 6e3
    hook = sb.HookLoad(m, 0.4, 8)
    lowered = m * 9.80665 * 0.05 * eta
    arm = 0.05
    result = run_of(TackleLoss(lowering_efficiency=eta), load=hook, T0=T0, end=12.0)
    inertia = J + m * arm**2
    near(result.stopping_time, inertia * W0 / (T0 * GAIN - lowered), 1e-10)
    near(result.series([11.0]).brake_torque[0], lowered, 1e-12)
    energy = balanced(result)
    near(energy["shaft_tackle_loss"], (1 - eta) * float(energy["load_work"]), 1e-10)


@pytest.mark.parametrize(
    ("K", "n"), [(1.04, 8), (1.04, 12), (1.09, 10), (1.0, 8), (1.0 + 1e-9, 8), (1.3, 1)]
)
def test_lines_of_a_tackle(K, n):
    """Line by line: neighbours differ by `K`, together they bear the hook; each
    efficiency leads back to `K`."""
    law = TackleLoss(sheave_factor=K).strung(n)
    powers = K ** np.arange(n)
    fast, dead = law.tensions(1.0, n, -1.0)
    near([float(dead * powers.sum()), float(fast)], [1.0, float(dead) * K**n], 1e-14)
    near(law.hoisting_efficiency, 1 / (n * float(fast)), 1e-14)
    fast, dead = law.tensions(1.0, n, 1.0)
    near(
        [float(fast * K * powers.sum()), float(dead)], [1.0, float(fast) * K**n], 1e-14
    )
    near(law.lowering_efficiency, n * float(fast), 1e-14)
    for name in ("hoisting_efficiency", "lowering_efficiency"):
        other = TackleLoss(**{name: getattr(law, name)}).strung(n)
        for number in ("sheave_factor", "hoisting_efficiency", "lowering_efficiency"):
            near(getattr(other, number), getattr(law, number), 1e-14)


@pytest.mark.parametrize("K", [1.0, 1.04, 1.3])
def test_derivatives_through_the_sheave_factor(K):
    """Of `1/η_l = mean K^i` and `1/η_h = 1/mean K^-i`, and back from the efficiency by
    the inverse of the slope."""
    n = 8
    i = np.arange(1, 9)
    mean = float(np.mean(K**i))
    slope = float(np.mean(i * K ** (i - 1)))
    lowering = -slope / mean**2
    hoisting = -float(np.mean(i * K ** (-i - 1.0)))
    by_K = jax.jacrev(lambda x: TackleLoss(sheave_factor=x).strung(n))(jnp.asarray(K))
    near(by_K.lowering_efficiency, lowering, 1e-13)
    near(by_K.hoisting_efficiency, hoisting, 1e-13)
    by_eta = jax.jacfwd(lambda x: TackleLoss(lowering_efficiency=x).strung(n))(
        jnp.asarray(1 / mean)
    )
    near(by_eta.sheave_factor, 1 / lowering, 1e-12)
    near(by_eta.hoisting_efficiency, hoisting / lowering, 1e-12)


@pytest.mark.slow
def test_the_dead_line_is_the_tightest_in_lowering():
    """Until the stop by the pull `m (g + a)`; then by the weight, as if it could have
    been hoisted last."""
    K = 1.04
    n = 8
    m = 20e3
    T0 = 6e3

    def run(K):
        return run_of(TackleLoss(K), load=sb.HookLoad(m, 0.4, n), T0=T0, end=12.0)

    result = run(K)
    eta = n * (K - 1) / (K * (K**n - 1))
    slower = (T0 * GAIN - eta * m * 9.80665 * 0.05) / (J + m * 0.05**2) * 0.05
    at = result.series([1.0, 11.0])
    dead = eta * K**n / n * m * np.asarray([9.80665 + slower, 9.80665])
    all_near(at.dead_line_tension, dead, 1e-10)
    all_near(at.rope_tension, [dead[0], K * dead[1]], 1e-10)


# --- heat, levers, input ------------------------------------------------------------


def test_heat_enters_its_body_or_is_lost():
    """One lump behind a conductance to the air takes the eddy-current brake's heat:
    SciPy, of 3 equations."""
    C = 5e4
    g = 30.0
    M_m = 2e4
    w_m = 9.0
    load = 6e3
    heat = sb.Heat(
        bodies=(sb.thermal.Lump("rotor", C, 300.0), sb.thermal.Reservoir("air", 290.0)),
        links=(sb.thermal.Conductance("rotor", "air", g),),
    )
    plain = scene(
        EddyCurrentBrake(M_m, w_m, 1.0, "rotor"),
        BearingFriction(300.0),
        load=load,
        w0=5.0,
        end=20.0,
    )
    result = sb.simulate(dataclasses.replace(plain, heat=heat))

    def rates(t, y):
        w, T, _ = y
        M = 2 * M_m * w * w_m / (w * w + w_m * w_m)
        return [
            (load - M - 300.0) / J,
            (M * w - g * (T - 290.0)) / C,
            g * (T - 290.0) + 300.0 * w,
        ]

    truth = solve_ivp(
        rates, (0.0, 20.0), [5.0, 300.0, 0.0], rtol=1e-12, atol=1e-10, method="DOP853"
    ).y[:, -1]
    near(result.record.y_end.omega, truth[0], 1e-9)
    near(result.end_temperatures[0], truth[1], 1e-9)
    energy = balanced(result)
    near(energy["heat_lost"], truth[2], 1e-9)
    assert result.status == "lowering"


@pytest.mark.parametrize(
    ("laws", "load", "T0", "torque"),
    [
        ((), 900.0, 0.0, 900.0),
        ((BearingFriction(300.0),), 900.0, 0.0, 1200.0),
        ((), 900.0, 10.0, None),
    ],
)
def test_a_pulley_that_turns_round_has_an_event(laws, load, T0, torque):
    """`t = J ω_0/M`, free, against dry friction, and sliding under a brake that is too
    weak."""
    back = 0.725 * T0 * (1 - 1 / PI)
    result = run_of(*laws, load=load, T0=T0, w0=-W0)
    time = J * W0 / (torque or load + back)
    near(result.events["reversal"].times, [time], 1e-12)
    assert not result.events["stop"]


@pytest.mark.slow
def test_a_rest_is_no_reversal():
    """It comes to rest on its bearings, and a load the other way starts it again."""
    load = sb.TorqueLoad(
        sb.PiecewiseLinear([0.0, 25.0, 25.0, 26.0], [100.0, 100.0, 900.0, 900.0])
    )
    result = run_of(BearingFriction(600.0), load=load, w0=-W0)
    assert names_of(result) == ["stop", "restart"]
    swings = sb.TorqueLoad(
        sb.profiles.FunctionProfile(lambda t, M: M * jnp.cos(t), 1e3, typical=1e3)
    )
    times = run_of(load=swings, w0=0.0, end=7.0).events["reversal"].times
    near(times, [math.pi, 2 * math.pi], 1e-12)


# --- friction by direction and over speed, torques as tables --------------------------

#: 100 N·m, 300 N·m at rest, and 50 N·m·s downwards; 40 N·m upwards
BY_SENSE = BearingFriction(100.0, 300.0, 0.5, 50.0, reverse=BearingFriction(40.0))


@pytest.mark.slow
@pytest.mark.parametrize("way", [1, -1])
def test_coasting_by_direction(way):
    """Down Coulomb, Stribeck and viscous friction, by SciPy; up `t = J ω/M`."""
    result = run_of(BY_SENSE, w0=way * 4.0, end=100.0)

    def slowing(t, w):
        return [-(100.0 + 200.0 * math.exp(-w[0] / 0.5) + 50.0 * w[0]) / J]

    def rests(t, w):
        return w[0]

    rests.terminal = True
    expected = J * 4.0 / 40.0
    if way > 0:
        tight = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14}
        told = solve_ivp(slowing, (0, 100), [4.0], events=rests, **tight)
        expected = told.t_events[0][0]
    near(result.stopping_time, expected, 1e-9)
    assert names_of(result) == ["stop"]
    assert result.series([100.0]).omega[0] == 0.0
    balanced(result)


@pytest.mark.parametrize(
    ("load", "moves"), [(299.0, 0), (301.0, 1), (-39.0, 0), (-41.0, -1)]
)
def test_rest_and_breakaway_by_direction(load, moves):
    """The limit at rest is the static one of the sense that the load would begin."""
    result = run_of(BY_SENSE, load=load, w0=0.0, end=5.0)
    assert np.sign(result.series([5.0]).omega[0]) == moves
    assert result.status == ("held" if moves == 0 else "released")


@pytest.mark.parametrize("way", [1, -1])
def test_a_growing_load_breaks_away_from_band_and_bearings(way):
    """`J ω' = P (t − 2 s)` from the instant at which the load `P t` passes the torque
    of both, also behind a breakpoint of the load."""
    ratio = GAIN / 0.725 + 1
    held = 600.0 + 100.0 * GAIN / (1.0 if way > 0 else ratio)
    rate = way * held / 2.0
    load = sb.TorqueLoad(
        sb.PiecewiseLinear([0.0, 3.0, 4.0], rate * np.array([0, 3, 4]))
    )
    law = BearingFriction(600.0)
    result = run_of(law, load=load, T0=100.0, w0=0.0, end=4.0)
    near(result.events["restart"].times, [2.0], 1e-12)
    near(result.series([4.0]).omega[0], rate * 2.0**2 / 2 / J, 1e-9)


def test_tables_of_torque_over_speed():
    """A fan on a line through its points, `ω = ω_0 exp(−c t/J)`; a rotor whose torque
    falls along a line to its speed without load, `ω = ω_1 (1 − exp(−M_0 t/(J ω_1)))`;
    beyond the table the last torque holds, and a warning says so."""
    told = lambda result: [text[:12] for text in result.summary()["warnings"]]
    fan = TabulatedDrag([0.0, 7.0, 30.0], [0.0, 350.0, 1500.0])
    result = run_of(fan, w0=-W0, end=20.0)
    expected = -W0 * math.exp(-50.0 * 20.0 / J)
    near(result.series([20.0]).omega[0], expected, 1e-9)
    balanced(result)
    rotor = TabulatedLoad([0.0, 4.0, 25.0], [2500.0, 2100.0, 0.0])
    result = run_of(w0=0.0, load=rotor, end=9.0)
    expected = 25.0 * (1 - math.exp(-2500.0 * 9.0 / (J * 25.0)))
    near(result.series([9.0]).omega[0], expected, 1e-9)
    driven = run_of(w0=40.0, load=TabulatedLoad([0.0, 4.5, 9.0], [1e3, 2e3, 3e3]))
    near(driven.series([2.0]).omega[0], 40.0 + 3e3 * 2.0 / J)
    assert (told(result), told(driven)) == ([], ["beyond_table"])
