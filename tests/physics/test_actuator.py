"""An actuator behind its command: dead time, lag and return spring, against closed
forms; its course by SciPy."""

import math

import jax.numpy as jnp
import numpy as np
import pytest
from helpers import all_near, closes, jacobians, names_of, near
from scenes import lining_ratio
from scipy.integrate import solve_ivp
from scipy.special import lambertw

import simbrake as sb
from simbrake.loads import Actuator, Cylinder

R = 0.6
J = 900.0
N = 10
BETA = math.radians(25.0)
FRICTION = 0.3
STATIC = 1.2
W0 = 18.0
FORCE = 7e3
LAG = 0.25
DEAD = 0.08
SPRING = 400.0
LOAD = 2e3
RELEASED = 3.0


def gain(f):
    """Torque per newton of the slack tension."""
    return R * (lining_ratio(f, BETA) ** N - 1)


def scene(lever, load=0.0, omega=W0, end=5.0):
    brake = sb.Brake(
        sb.Pulley(R, J),
        sb.Band(R),
        sb.Lining(sb.ConstantFriction(FRICTION, STATIC), np.full(N, BETA)),
    )
    return sb.Scene(brake, sb.Duty(lever, load), sb.Initial(omega), end)


COMMANDS = {
    "points": sb.PiecewiseLinear(
        [1.0, 2.0, 2.0, 3.5, 3.5, 4.0], [2e3, 8e3, 1e3, 1e3, 5e3, 0.0]
    ),
    "cycles": sb.Repeated(
        [0.0, 0.4, 0.9, 0.9, 2.0], [0.0, 5e3, 7e3, 2e3, 1e3], 2.0, 3, begin=0.5
    ),
    "cycles with gaps": sb.Repeated(
        [0.2, 0.4, 0.9], [0.0, 5e3, 7e3], 2.0, 3, begin=0.5
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS.values(), ids=list(COMMANDS))
def test_lagged_course_solves_its_equation(command):
    """`τ Ḟ + F = u(t − t_d)`, piece by piece."""
    actuator = Actuator(command, LAG, DEAD)
    force = float(command.value(-1.0, 0))
    i = 0
    start = 0.0
    while start < 9.0:
        end = min(float(actuator.next_knot(jnp.asarray(i, jnp.int32))), 9.0)
        if end > start:
            t = np.linspace(start, end, 4)
            rhs = lambda t, F, i=i: (float(command.value(t - DEAD, i)) - F) / LAG
            truth = solve_ivp(
                rhs, (start, end), [force], "DOP853", rtol=1e-12, atol=1e-9, t_eval=t
            ).y[0]
            all_near([float(actuator.value(x, i)) for x in t], truth, 1e-10, 1e-6)
            force = truth[-1]
        i = i + 1
        start = end


def stop_time(x):
    """Of a step of the command at 0 without a load, by the Lambert W function."""
    force, lag, dead = x
    c = J * W0 / (gain(FRICTION) * force) + lag
    return dead + c + lag * float(lambertw(-math.exp(-c / lag)).real)


def released(spring):
    command = sb.PiecewiseLinear([RELEASED, RELEASED], [FORCE, 0.0])
    return sb.simulate(scene(Actuator(command, LAG, DEAD, spring), LOAD))


@pytest.mark.slow
def test_release_frees_load_and_opens_band():
    """`F e^{−s/τ} − F_s` falls to what holds the load, and to 0: there the band
    opens."""
    result = released(SPRING)
    times = {event.name: event.time for event in result.events}
    begin = RELEASED + DEAD
    near(
        times["restart"],
        begin + LAG * math.log(FORCE / (LOAD / gain(STATIC * FRICTION) + SPRING)),
        1e-10,
    )
    near(times["release"], begin + LAG * math.log(FORCE / SPRING), 1e-10)
    assert result.series([4.9]).slack_tension[0] == 0.0
    # without a return spring the band never opens: its tension fades away
    faded = released(0.0)
    assert "release" not in names_of(faded)
    near(
        faded.series([4.9]).slack_tension[0],
        FORCE * math.exp(-(4.9 - begin) / LAG),
        1e-9,
    )
    for run in (result, faded):
        closes(run, 1e-12)


# --- a cylinder of air or oil -------------------------------------------------------

PRESSURE = 6e5
DIAMETER = 0.2
RATIO = 0.45
ETA = 0.9
AREA = math.pi * DIAMETER**2 / 4


def step_of_pressure(x, spring=0.0, begin=0.0, **options):
    """A cylinder under a step of its gauge pressure, for `x`: pressure, lag, dead time,
    diameter, ratio, efficiency."""
    step = sb.PiecewiseLinear([begin, begin], jnp.stack([jnp.zeros(()), x[0]]))
    return Cylinder(step, None, x[3], x[4], x[5], spring, x[1], x[2], **options)


@pytest.mark.slow
def test_stop_under_a_cylinder():
    """`T_0 = η i π d²/4 p` behind dead time and lag: the stop by the Lambert W
    function, derivatives by its chain."""
    x = np.array([PRESSURE, LAG, DEAD, DIAMETER, RATIO, ETA])

    def force(x):
        return np.array([x[5] * x[4] * math.pi / 4 * x[3] ** 2 * x[0], x[1], x[2]])

    def found(x):
        run = sb.simulate(scene(step_of_pressure(x)), max_steps=128)
        return jnp.stack([run.stopping_time, run.max_actuator_pressure.value])

    value, forwards, backwards = jacobians(found)(jnp.asarray(x))
    stop = stop_time(force(x))
    # it rises up to the end of the run
    pressure = PRESSURE * -math.expm1(-(5.0 - DEAD) / LAG)
    all_near(value, [stop, pressure], 1e-9)
    F, lag, dead = force(x)
    c = J * W0 / (gain(FRICTION) * F) + lag
    decayed = math.exp(-(stop - dead) / lag)
    by_force = -(c - lag) / F / (1 - decayed)
    by_lag = (1 - decayed * (1 + (stop - dead) / lag)) / (1 - decayed)
    truth = [
        by_force * F / PRESSURE,
        by_lag,
        1.0,
        2 * by_force * F / DIAMETER,
        by_force * F / RATIO,
        by_force * F / ETA,
    ]
    for jacobian in (forwards, backwards):
        all_near(jacobian[0], truth, 1e-7)


def test_pressure_against_a_return_spring():
    """The band closes where `p A = F_s`, opens there as well; the column has the
    pressure all along."""
    spring = 2e3
    begin = 0.5
    lever = sb.PiecewiseLinear(
        [begin, begin, RELEASED, RELEASED], [0.0, PRESSURE, PRESSURE, 0.0]
    )
    cylinder = Cylinder(
        lever, f"{AREA!r} m^2", None, RATIO, ETA, spring, LAG, DEAD, "5.5 bar"
    )
    result = sb.simulate(scene(cylinder, LOAD))
    near(
        result.slip_onset_time,
        begin + DEAD - LAG * math.log(1 - spring / (PRESSURE * AREA)),
        1e-10,
    )
    full = PRESSURE * -math.expm1(-(RELEASED - begin) / LAG)
    opened = result.events["release"].times[0]
    near(opened, RELEASED + DEAD + LAG * math.log(full * AREA / spring), 1e-10)
    t = np.array([0.3, 1.0, 2.5, 3.4])
    late = t - DEAD
    p = np.where(late < begin, 0.0, PRESSURE * -np.expm1(-(late - begin) / LAG))
    p = np.where(late > RELEASED, full * np.exp(-(late - RELEASED) / LAG), p)
    series = result.series(t)
    all_near(series.actuator_pressure, p, 1e-12)
    all_near(
        series.slack_tension, np.maximum(ETA * RATIO * (p * AREA - spring), 0.0), 1e-10
    )
    near(result.metrics["max_actuator_pressure"], full, 1e-12)
    assert result.verdict().colour.value == "red"


@pytest.mark.slow
def test_cylinder_behind_a_lever_and_in_phases():
    """On a hand lever it is its force; in a phase its time is that of the phase."""
    bare = Cylinder("4 bar", diameter="200 mm")
    on_lever = sb.simulate(scene(sb.Lever(bare, "1.2 m", "0.4 m")))
    near(on_lever.stopping_time, J * W0 / (gain(FRICTION) * 3 * 4e5 * AREA), 1e-10)
    near(on_lever.metrics["max_lever_force"], 4e5 * AREA, 1e-12)
    # (a custom course, without a lag of the actuator)
    rise = sb.profiles.ExponentialRise(4e5, LAG)
    phases = [
        sb.loads.Phase(0.0, "0.4 s"),
        sb.loads.Phase(
            Cylinder(rise, diameter="200 mm", dead_time=DEAD, ratio=0.5), "1 s"
        ),
    ]
    result = sb.simulate(scene(sb.loads.Phases(tuple(phases))))
    expected = [0.0, 0.0, 4e5 * -math.expm1(-(1.0 - 0.4 - DEAD) / LAG)]
    all_near(result.series([0.2, 0.45, 1.0]).actuator_pressure, expected, 1e-12, 1e-9)
    assert sb.simulate(scene(1e3)).series([0.0]).actuator_pressure is None


def test_stepper_sets_the_pressure():
    stepper = sb.Stepper(
        scene(Cylinder("4 bar", diameter="200 mm", dead_time=DEAD)), inputs=["lever"]
    )
    assert stepper.units == {"lever": "Pa"}
    stepper.advance("0.2 s", lever=2e5)
    slowed = gain(FRICTION) * AREA / J * (4e5 * DEAD + 2e5 * (0.2 - DEAD))
    near(stepper.omega, W0 - slowed, 1e-9)
