"""Friction laws with states of their own: against closed forms and SciPy, files,
input."""

import math

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import all_near, closes, input_error, jacobians, near
from oracles.stops import at_rest
from scenes import lining_ratio
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from user_parts import RunningIn, Timed, Travelled

import simbrake as sb

J = 900.0
OMEGA = 20.0
F = 0.4
CAPACITY = 3e4
#: pads: force, count, effective radius by uniform wear, area, torque of the brake at
#: the start
FORCE = 3e4
PADS = 3
ARM = 0.5 * (0.5 + 0.6)
PAD = 0.5 * (0.6**2 - 0.5**2)
TORQUE = PADS * F * FORCE * ARM
#: band
T_0 = 4e3
R = 0.59
R_B = 0.64
BETA = math.radians(50.0)
AREA = 0.03
Z = math.tan(BETA / 2)


class Pressed(Timed):
    """By pressure, also at rest: `ξ̇ = (ξ_e − ξ) p/(p_0 τ)` with `p_0` = 1 MPa."""

    def rates(self, contact):
        return (self.end - contact.memory) * contact.p / 1e6 / self.time


class Recovering(Timed):
    """Two states: a fade that heat brings and that recovers slower, and the temperature
    that was last seen."""

    def start(self, n):
        return {"fade": jnp.zeros(n), "seen": 293.15}

    def rates(self, contact):
        fade = contact.memory["fade"]
        seen = contact.memory["seen"]
        return {
            "fade": (1e-3 * (seen - 293.15) - fade) / self.time,
            "seen": (contact.T - seen) / 0.5,
        }

    def sizes(self):
        return {"fade": 0.1, "seen": 100.0}

    def kinetic(self, contact):
        return self.coefficient * (1 - contact.memory["fade"])

    def static(self, contact):
        return self.coefficient * (1 - contact.memory["fade"])


def disc(law, load=0.0, omega=OMEGA, end=10.0, heat=None):
    """Three pads under a constant force: the pressure is constant."""
    brake = sb.DiscBrake(J, sb.Pads(law, 0.5, 0.6, 1.0, PADS))
    duty = sb.ForceDuty(FORCE, load)
    return sb.Scene(brake, duty, sb.Initial(omega), end, heat)


def band(
    law,
    stiffness=None,
    load=0.0,
    omega=OMEGA,
    end=10.0,
    elongation=0.0,
    bandage=None,
    n=4,
):
    brake = sb.Brake(
        sb.Pulley(R, J),
        sb.Band(R_B, stiffness),
        sb.Lining(law, np.full(n, BETA), AREA),
        bandage,
    )
    duty = sb.Duty(T_0, load)
    return sb.Scene(brake, duty, sb.Initial(omega, elongation), end)


def ratio(f, n=4):
    """`T_n/T_0` of a band whose linings all slide."""
    return lining_ratio(f, BETA) ** n


def final(result, pair=0):
    return np.asarray(result.record.y_end.memory[pair])


def towards(end, x):
    """`ξ_e + (1 − ξ_e) e^{−x}`"""
    return end + (1 - end) * np.exp(-x)


def stop_and_rest(rates, y, end):
    """The time of a stop, and the state at `end`, while the speed `y[0]` stays 0, by
    SciPy."""
    how = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-12}
    run = solve_ivp(rates, (0.0, 9.0), y, events=at_rest, **how)
    rested = solve_ivp(
        lambda t, y: [0.0, *rates(t, [0.0, *y[1:]])[1:]],
        (run.t[-1], end),
        run.y[:, -1],
        **how,
    )
    return run.t_events[0][0], rested.y[:, -1]


# --- sliding, closed forms ----------------------------------------------------------


@pytest.mark.slow
def test_friction_that_falls_with_the_way():
    """`½ J ω_0² = (M/r) [ξ_e s + (1 − ξ_e) L (1 − e^{−s/L})]` over the way `s` of a
    stop."""
    end = 0.4
    length = 6.0
    result = sb.simulate(disc(Travelled(F, end, length)), rtol=1e-12)

    def left(s):
        return 0.5 * J * OMEGA**2 - TORQUE / ARM * (
            end * s + (1 - end) * length * (1 - math.exp(-s / length))
        )

    s = brentq(left, 0.0, 100.0, xtol=1e-14, rtol=1e-14)
    near(result.stopping_angle, s / ARM, 1e-10)
    # and at rest nothing changes
    all_near(final(result), towards(end, s / length), 1e-10)


@pytest.mark.slow
def test_friction_that_runs_in_with_the_work():
    """`ξ` follows the friction work per area alone, whatever its course."""
    end = 1.4
    work = 4e5
    result = sb.simulate(disc(RunningIn(F, end, work)), rtol=1e-12)
    each = 0.5 * J * OMEGA**2 / PADS / PAD
    all_near(final(result), towards(end, each / work), 1e-10)
    with input_error(match=r"linings\.area"):
        sb.simulate(
            eqx.tree_at(lambda s: s.brake.linings.area, band(RunningIn()), None)
        )


# --- at rest ------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("stiffness", ["disc", 2e6])
def test_held_brake_slips_as_friction_decays(stiffness):
    """`f e^{−t/τ}` falls to what the load needs at `t = τ ln(f/f*)`."""
    tau = 2.0
    load = 4e3
    if stiffness == "disc":
        needed = F * load / TORQUE
        slope = 1.0
    else:
        root = (1 + load / (R_B * T_0)) ** 0.25
        needed = (root - 1) / (root + 1) / Z
        # d ln f*/d ln M
        slope = (
            load
            / (R_B * T_0)
            / (1 + load / (R_B * T_0))
            * 0.25
            * 2
            * root
            / (root**2 - 1)
        )

    def run(x):
        law = Timed(F, 0.0, x[0])
        scene = (
            disc(law, x[1], 0.0)
            if stiffness == "disc"
            else band(law, stiffness, x[1], 0.0)
        )
        return sb.simulate(scene, rtol=1e-12, max_steps=256)

    result = run([tau, load])
    event = next(event for event in result.events if event.name == "restart")
    t = tau * math.log(F / needed)
    near(event.time, t, 1e-11)
    assert result.status in ("runaway", "not_stopped")

    def instant(x):  # the row of the event: a differentiated run has rows of its own
        times = run(x).record.rows.t
        return times[jnp.argmin(jnp.abs(times - t))][None]

    _, forwards, backwards = jacobians(instant)(jnp.asarray([tau, load]))
    all_near(forwards[0], [t / tau, -tau * slope / load], 1e-9)
    all_near(backwards, forwards, 1e-10)


@pytest.mark.slow
def test_pressure_at_rest_follows_tensions():
    """While the first lining alone carries the load all others have the tension of the
    tight end at both sides."""
    end = 0.8
    tau = 5.0
    load = 200.0
    result = sb.simulate(
        band(Pressed(F, end, tau), load=load, omega=0.0, end=3.0), rtol=1e-11
    )
    tight = T_0 + load / R_B
    normal = np.asarray([T_0 + tight, *(3 * [2 * tight])]) * math.sin(BETA / 2)
    assert result.status == "held"
    all_near(final(result), towards(end, normal / AREA / 1e6 * 3.0 / tau), 1e-9)


@pytest.mark.slow
def test_a_sliding_brake_that_loses_its_grip():
    """Without heat too the log has the instant at which the load outweighs the
    brake."""
    end = 0.5
    tau = 2.0
    load = 0.7 * TORQUE
    result = sb.simulate(disc(Timed(F, end, tau), load, end=4.0), rtol=1e-11)
    event = next(event for event in result.events if event.name == "grip_lost")
    near(event.time, tau * math.log(0.5 / 0.2), 1e-8)
    assert result.status == "runaway"


@pytest.mark.slow
def test_elastic_band_in_slip_follows_states():
    """`v_s = R_b ω − ẋ`, `x = T_0 Π(f ξ)/C`, `ξ̇ = (ξ_e − ξ) v_s²/L`: one equation for
    `v_s` at every instant."""
    C = 3e4
    end = 0.6
    length = 40.0
    law = Travelled(F, end, length, 2)
    scene = band(law, C, elongation=T_0 / C, end=1.2)
    result = sb.simulate(scene, rtol=1e-12)
    chi = R_B * math.sqrt(C / J)
    reach = T_0 * (ratio(F) - 1) * chi / (C * R_B * OMEGA)
    t_1 = math.asin(reach) / chi
    omega_1 = OMEGA * math.sqrt(1 - reach**2)
    near(result.full_slip_time, t_1, 1e-10)

    def slope(f):
        """`dT_n/df`"""
        return T_0 * ratio(f) * 4 * 2 * Z / (1 - (f * Z) ** 2)

    def rhs(t, y):
        omega, xi = y
        give = slope(F * xi) * F * (xi - end) / (length * C)  # v_s − give v_s² = R_b ω
        v = 2 * R_B * omega / (1 + math.sqrt(1 - 4 * give * R_B * omega))
        return [-R_B * T_0 * (ratio(F * xi) - 1) / J, (end - xi) * v**2 / length]

    run = solve_ivp(rhs, (t_1, 1.2), [omega_1, 1.0], "DOP853", rtol=1e-13, atol=1e-13)
    y = result.record.y_end
    near(y.omega, run.y[0, -1], 1e-9)
    all_near(final(result), run.y[1, -1], 1e-9)
    closes(result, 1e-10)
    # the states matter: 1 + γ is far from 1 at the start of the slip
    assert slope(F) * F * (1 - end) / (length * C) * R_B * omega_1 > 0.1


@pytest.mark.slow
def test_friction_that_outruns_the_band():
    scene = band(Travelled(F, 0.6, 0.2), 3e4, elongation=T_0 / 3e4)
    result = sb.simulate(scene, throw=False)
    assert result.status == "band_snap"
    assert "state" in result.message


# --- heat, two states, files --------------------------------------------------------


@pytest.fixture(scope="module")
def recovering():
    heat = sb.Heat(
        (sb.thermal.Lump("disc", 2e5), sb.thermal.Lump("pads", CAPACITY, count=PADS)),
        friction=sb.thermal.FrictionHeat("disc", "pads", 0.6),
        linings="pads",
    )
    return disc(Recovering(F, time=0.7), heat=heat, end=4.0)


def test_two_states_and_heat_against_scipy(recovering):
    result = sb.simulate(recovering, rtol=1e-12)

    def rhs(t, y):
        omega, T, fade, seen = y
        power = F * (1 - fade) * FORCE * ARM * omega
        rates = [
            0.4 * power / CAPACITY,
            (1e-3 * (seen - sb.thermal.ROOM) - fade) / 0.7,
            (T - seen) / 0.5,
        ]
        return [-PADS * F * (1 - fade) * FORCE * ARM / J, *rates]

    start = [OMEGA, sb.thermal.ROOM, 0.0, sb.thermal.ROOM]
    stop, rested = stop_and_rest(rhs, start, 4.0)
    near(result.stopping_time, stop, 1e-9)
    end = result.series([4.0])
    states = np.repeat(rested[2:, None], PADS, axis=1)
    all_near(end.friction_memory[0], states, 1e-8)
    all_near(end.friction_coefficient[0], F * (1 - states[0]))
