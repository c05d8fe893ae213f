"""Duties in phases that end with rest, travel, a temperature or a time: against closed
forms; a faded stop by SciPy."""

import dataclasses
import math

import diffrax
import jax
import numpy as np
import pytest
from helpers import all_near, closes, names_of, near
from scenes import lining_ratio, replaced

import simbrake as sb
from simbrake.loads import Phase, Phases, StringLoad

G = 9.80665
R = 0.59
R_B = 0.623
J_P = 1200.0
PER_RAD = 0.4 / 8
F = 0.35
N = 20
WRAP = math.radians(270)
MU = lining_ratio(F, WRAP / N) ** N
GAIN = R_B * (MU - 1)  # N·m of brake torque per N of slack tension
BRAKE = sb.Brake(sb.Pulley(R, J_P), sb.Band(R_B), sb.uniform_linings(N, WRAP, F))
EMPTY = 5e3
STRING = 40e3
STAND = 2e3
PULL = 25e3
RAMP = 0.5
DISTANCE = 12.0
LOAD = StringLoad(EMPTY, STRING, 0.4, 8, STAND)
PHASES = Phases(
    (
        Phase(0.0, f"travel {DISTANCE} m", "lower"),
        Phase(sb.ramp(0.0, PULL, 0.0, RAMP), "rest", "brake"),
        Phase(PULL, "4 s", "hold"),
        Phase(PULL, "2 s", "slips", string_on_hook=False),
    ),
    count=2,
)
SCENE = sb.Scene(BRAKE, sb.Duty(PHASES, LOAD), sb.Initial(0.0), 60.0)


@pytest.fixture(scope="module")
def two_cycles():
    return sb.simulate(SCENE)


def ends(result):
    return [event for event in result.events if event.name == "phase_end"]


def closed_form(string=STRING):
    """Ends of the phases, and the angle after each cycle: a fall by the distance, the
    ramp, the rest of the stop."""
    t = 0.0
    phi = 0.0
    found = []
    angles = []
    for cycle in range(2):
        m = EMPTY + string + cycle * STAND
        J = J_P + m * PER_RAD**2
        M = m * G * PER_RAD
        fall = math.sqrt(2 * DISTANCE * J / (M * PER_RAD))
        fast = M / J * fall
        slow_down = (GAIN * PULL - M) / J
        slow = fast - (GAIN * PULL / 2 - M) * RAMP / J
        stop = t + fall + RAMP + slow / slow_down
        found += [t + fall, stop, stop + 4.0, stop + 6.0]
        ramp = fast * RAMP + (M / 2 - GAIN * PULL / 6) * RAMP**2 / J
        t = stop + 6.0
        phi = phi + DISTANCE / PER_RAD + ramp + slow**2 / (2 * slow_down)
        angles.append(phi)
    return np.asarray(found), np.asarray(angles)


def test_two_cycles_in_closed_form(two_cycles):
    times, angles = closed_form()
    found = ends(two_cycles)
    all_near([event.time for event in found], times, 1e-10)
    assert [(event.phase.name, event.phase.cycle) for event in found] == [
        (phase.name, cycle) for cycle in (1, 2) for phase in PHASES.phases
    ]
    assert [event.phase.until for event in found[:4]] == [
        "travel 12 m",
        "rest",
        "4 s",
        "2 s",
    ]
    all_near(np.cumsum(two_cycles.stops["angle"]), angles, 1e-9)
    near(two_cycles.record.t_end, times[-1], 1e-10)
    assert two_cycles.ok
    assert two_cycles.status == "stopped"
    closes(two_cycles, 1e-9)
    names = names_of(two_cycles)
    assert names.index("phase_end", names.index("stop")) == names.index("stop") + 1


@pytest.mark.slow
@pytest.mark.parametrize(
    "solver",
    [pytest.param(diffrax.Dopri8(), id="explicit"), sb.hybrid.Rodas5P()],
)
def test_derivatives_through_the_begin_of_a_phase(solver):
    """The lever's ramp begins with its phase, later for a lighter string: rates depend
    on that instant.

    Heat changes nothing here, but with it the implicit method knows which rates depend
    on which states.
    """
    warm = dataclasses.replace(
        SCENE, heat=sb.lumped_heat(rim=6e4, linings=6e3, partition=0.9, rim_cooling=0.0)
    )

    def end(string):
        return sb.simulate(
            sb.with_values(warm, {"duty.load.string": string}), solver=solver
        ).record.t_end

    def true(share):
        return closed_form(STRING * (1 + share))[0][-1]

    slope = (
        (4 * (true(1e-3) - true(-1e-3)) / 2e-3 - (true(2e-3) - true(-2e-3)) / 4e-3)
        / 3
        / STRING
    )
    for derivative in (jax.grad, jax.jacfwd):
        near(jax.jit(derivative(end))(STRING), slope, 1e-7)


@pytest.mark.slow
def test_a_phase_ended_by_a_temperature():
    """Drag at a held speed heats the rim with `M ω`; two phases that are over as they
    begin are passed at once."""
    capacity = 6e4
    torque = 8e3
    omega = 10.0
    level = 323.15
    heat = sb.lumped_heat(
        rim=capacity, partition=sb.thermal.ConstantPartition(1.0), rim_cooling=0.0
    )

    def run(level):
        drag = sb.SpeedHold(100e3)
        hot = sb.loads.AtTemperature(level)
        below = f"temperature of the rim below {float(sb.thermal.ROOM) + 35} K"
        phases = Phases(
            (
                Phase(drag, hot),
                Phase(drag, hot),
                Phase(drag, below),
                Phase(60e3, "rest"),
            ),
            1,
        )
        return sb.simulate(
            sb.Scene(BRAKE, sb.Duty(phases, torque), sb.Initial(omega), 40.0, heat)
        )

    t = capacity * (level - sb.thermal.ROOM) / (torque * omega)
    found = ends(run(level))
    near(
        [event.time for event in found],
        [t, t, t, t + J_P * omega / (GAIN * 60e3 - torque)],
        1e-9,
    )
    assert [event.phase.phase for event in found] == [1, 2, 3, 4]
    slope = jax.jit(jax.grad(lambda level: run(level).record.t_end))(level)
    near(slope, capacity / (torque * omega), 1e-7)


@pytest.mark.slow
def test_rest_is_armed_by_motion_alone():
    # it rests from the start under the lever: only after the release, the drop and the
    # stop it has come to rest
    lever = sb.PiecewiseLinear([1.0, 1.0, 2.0, 2.0], [PULL, 0.0, 0.0, PULL])
    scene = dataclasses.replace(
        SCENE, duty=sb.Duty(Phases((Phase(lever, "rest"),)), LOAD)
    )
    result = sb.simulate(scene)
    M = (EMPTY + STRING) * G * PER_RAD
    near([event.time for event in ends(result)], [2.0 + M / (GAIN * PULL - M)], 1e-10)


@pytest.mark.slow
def test_ends_at_one_instant_are_all_passed():
    """A corner of the lever, the end of the phase by its time, and a lever that jumps
    with it."""
    M = (EMPTY + STRING) * G * PER_RAD
    lever = sb.PiecewiseLinear([0.0, 1.0], [0.0, 0.0])
    phases = Phases(
        (
            Phase(lever, "1 s"),
            Phase(sb.PiecewiseLinear([0.0, 0.0], [0.0, PULL]), "rest"),
        ),
        1,
    )
    result = sb.simulate(dataclasses.replace(SCENE, duty=sb.Duty(phases, LOAD)))
    near(
        [event.time for event in ends(result)],
        [1.0, 1.0 + M / (GAIN * PULL - M)],
        1e-10,
    )


HOISTED = sb.HookLoad(60e3, 0.4, 8)
WEIGHT = 60e3 * G * PER_RAD
MOVED = J_P + 60e3 * PER_RAD**2
BEARINGS = sb.loads.BearingFriction(500.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("load", "omega", "lever", "shaft", "truth"),
    [
        pytest.param(
            HOISTED, -10.0, 0.0, (), MOVED * 10.0 / WEIGHT, id="hoisted, power fails"
        ),
        pytest.param(
            HOISTED,
            -10.0,
            100.0,
            (),
            MOVED * 10.0 / (WEIGHT + 100.0 * GAIN / MU),
            id="and a weak brake",
        ),
        pytest.param(
            -800.0,
            10.0,
            0.0,
            (),
            J_P * 10.0 / 800.0,
            id="torque against the motion",
        ),
        pytest.param(
            0.0,
            10.0,
            0.0,
            (BEARINGS,),
            J_P * 10.0 / 500.0,
            id="dry bearings without load",
        ),
    ],
)
def test_rest_comes_by_whatever_stops_the_pulley(load, omega, lever, shaft, truth):
    """Nothing holds it there: the phase ends as the speed passes through 0, and the
    lever of the next one holds it."""
    lost = sb.friction.FrictionChange(sb.Constant(0.9), when="stop 1")
    law = sb.friction.ChangingFriction(sb.ConstantFriction(F), (lost,))
    brake = replaced(BRAKE, {"linings.friction": law})
    duty = sb.Duty(Phases((Phase(lever, "rest"), Phase(30e3, "3 s"))), load)
    result = sb.simulate(sb.Scene(brake, duty, sb.Initial(omega), 60.0, shaft=shaft))
    near([event.time for event in ends(result)], [truth, truth + 3.0], 1e-12)
    near(result.events["stop"].times, [truth], 1e-12)
    near(result.events["friction_change"].times, [truth], 1e-12)
    near(result.metrics["stopping_time"], truth, 1e-12)
    assert np.ptp(result.series([truth + 1.0, truth + 2.0]).phi) == 0.0
    assert (result.status, float(result.record.y_end.omega)) == ("stopped", 0.0)


def test_time_of_a_rest_that_nothing_holds_has_derivatives():
    def end(x):
        duty = sb.Duty(Phases((Phase(0.0, "rest"), Phase(30e3, "3 s"))), -x[0])
        return sb.simulate(sb.Scene(BRAKE, duty, sb.Initial(x[1]), 60.0)).record.t_end

    slope = jax.jit(jax.jacrev(end))(np.array([800.0, 10.0]))
    all_near(slope, [-J_P * 10.0 / 800.0**2, J_P / 800.0], 1e-12)


# --- what cannot be -----------------------------------------------------------------


@pytest.mark.slow
def test_endless_phase_says_what_it_awaits():
    weak = Phases((PHASES.phases[0], Phase(500.0, "rest", "brake")), 1)
    result = sb.simulate(
        dataclasses.replace(SCENE, duty=sb.Duty(weak, LOAD), end_time=8.0), throw=False
    )
    assert result.status == "phase_never_ends"


def test_stops_are_in_every_form(two_cycles):
    table = two_cycles.stops
    times, _ = closed_form()
    near(table["time"], times[[1, 5]], 1e-9)
    near(table["motion_time"], [times[1], times[5] - times[3]], 1e-9)
    near(table["braking_time"], [times[1] - times[0], times[5] - times[4]], 1e-9)
    near(np.sum(table["energy"]), two_cycles.energy["friction_heat"], 1e-12)
    all_near(np.asarray(table["angle"]) * PER_RAD, table["travel"], 1e-12)


def test_scipy_passes_the_same_phases():
    assert sb.checks.cross_check(SCENE).ok


@pytest.mark.slow
def test_a_stop_is_no_reversal():
    """Power fails while hoisting, with a loss of the tackle: the pulley stops as the
    friction turns round."""
    up = sb.PiecewiseLinear([0.0, 3.0], [0.0, -20.0])
    some = Phase(0.0, "4 s", motor=up), Phase(0.0, "rest"), Phase(60e3, "5 s")
    motor = sb.loads.Motor("60 kN*m", "2 MW", "40 rad/s")
    duty = sb.Duty(Phases(some), sb.HookLoad("60 t", 0.4, 8))
    loss = (sb.loads.TackleLoss(sheave_factor=1.04),)
    scene = dataclasses.replace(
        SCENE,
        duty=duty,
        initial=sb.Initial(0.0),
        end_time=60.0,
        motor=motor,
        shaft=loss,
    )
    names = names_of(sb.simulate(scene))
    assert (names.count("stop"), names.count("reversal")) == (1, 0)
