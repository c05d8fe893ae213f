"""Hoisting: a motor with limits, phases that end upwards, strings that grow and shrink,
the rope that winds back."""

import dataclasses
import itertools

import numpy as np
import pytest
from helpers import all_equal, all_near, closes, input_error, near
from scenes import drawworks_brake
from scipy.integrate import solve_ivp

import simbrake as sb
from simbrake.loads import (
    AfterTravel,
    BearingFriction,
    Driller,
    HookLoad,
    Motor,
    Phase,
    Phases,
    StringLoad,
    TackleLoss,
)

MASS = 60e3
RADIUS = 0.4
LINES = 8
INERTIA = 1200.0
TRAVEL = RADIUS / LINES  # m of the hook per radian
WEIGHT = MASS * 9.80665 * TRAVEL  # N·m
J = INERTIA + MASS * TRAVEL**2
# m/s, m/s²
UP = 1.2
DOWN = 1.0
FASTER = 0.5

BRAKE = drawworks_brake()
LOAD = HookLoad(MASS, RADIUS, LINES)
MOTOR = Motor("60 kN*m", "1100 kW", "40 rad/s")


def course(*speeds):
    """Speed of the drum (rad/s) in straight lines between speeds of the hook (m/s), at
    `FASTER`."""
    times = np.cumsum(
        [0.0, *(abs(b - a) / FASTER for a, b in itertools.pairwise(speeds))]
    )
    return sb.PiecewiseLinear(times, np.asarray(speeds) / TRAVEL)


def up(distance, speed=UP):
    """Hoist from rest to rest over a distance (m)."""
    slowing = speed**2 / (2 * FASTER)
    return (
        Phase(0.0, AfterTravel(slowing - distance), "hoist", motor=course(0.0, -speed)),
        Phase(0.0, "rest", "slow", motor=course(-speed, 0.0, speed)),
    )


def down(distance, speed=DOWN, **levers):
    """Lower from rest to rest over a distance (m) by a driller."""
    slowing = speed**2 / (2 * FASTER)
    return (
        Phase(
            Driller(course(0.0, speed), 60e3, **levers),
            AfterTravel(distance - slowing),
            "lower",
        ),
        Phase(Driller(course(speed, 0.0, -speed), 60e3, **levers), "rest", "brake"),
    )


def run(phases, load=LOAD, motor=MOTOR, end=1e4, brake=BRAKE, **parts):
    return sb.simulate(
        sb.Scene(
            brake, sb.Duty(phases, load), sb.Initial(0.0), end, motor=motor, **parts
        )
    )


def ends(result):
    return np.asarray([event.time for event in result.events["phase_end"]])


HOLD = Phase(30e3, 10.0, "hold")


def test_a_trip_up_and_down_takes_the_time_and_the_work_of_its_course():
    result = run(Phases((*up(25.0), HOLD, *down(20.0), HOLD), count=2))
    hoist = 25.0 / UP + UP / FASTER
    lower = 20.0 / DOWN + DOWN / FASTER
    cycle = np.cumsum([25.0 / UP, UP / FASTER, 10.0, 20.0 / DOWN, DOWN / FASTER, 10.0])
    all_near(ends(result), [*cycle, *(cycle + hoist + lower + 20.0)], 1e-10)
    energy = result.energy
    near(energy["motor_work"], 2 * MASS * 9.80665 * 25.0, 1e-10)
    near(energy["friction_heat"], 2 * MASS * 9.80665 * 20.0, 1e-10)
    assert float(energy["closure"]) < 1e-12
    at = result.series([20.0])  # steady: the motor bears the load
    near(at.motor_torque[0], WEIGHT, 1e-10)
    near(at.motor_power[0], MASS * 9.80665 * UP, 1e-10)
    near(at.hook_speed[0], -UP, 1e-10)
    assert at.fast_line_tension is None  # without a loss of the tackle


@pytest.mark.slow
@pytest.mark.parametrize("timed", [False, True], ids=["rest", "time"])
@pytest.mark.parametrize(
    "shaft", [(), (BearingFriction(600.0),)], ids=["smooth", "dry"]
)
@pytest.mark.parametrize("stiffness", [None, 4e5], ids=["rigid", "elastic"])
def test_every_motion_that_a_motor_ends_is_a_stop_that_the_band_then_holds(
    stiffness, shaft, timed
):
    brake = sb.Brake(BRAKE.pulley, sb.Band(0.623, stiffness), BRAKE.linings)
    hoist, slow = up(25.0)
    slow = Phase(0.0, UP / FASTER, "slow", motor=course(-UP, 0.0)) if timed else slow
    phases = Phases((hoist, slow, HOLD), 3)
    scene = sb.Scene(
        brake, sb.Duty(phases, LOAD), sb.Initial(0.0), 1e3, motor=MOTOR, shaft=shaft
    )
    result = sb.simulate(scene)
    first = 25.0 / UP + UP / FASTER
    all_near(result.stops["time"], first + np.arange(3) * (first + 10.0), 1e-10)
    all_near(result.stops["travel"], -25.0, 1e-10)
    all_near(result.stops["braking_time"], 0.0, atol=1e-6)
    assert "-" not in str(result.stops)  # but the sign of a minus
    all_equal(result.events["stop"].times, result.stops["time"])
    assert float(result.stopping_time) == result.stops["time"][0]
    if stiffness is None:  # (that of an elastic band is what it lets go)
        near(result.energy["friction_heat"], 0.0, abs=1e-3)
    near(result.total_hook_travel, -75.0, 1e-10)


@pytest.mark.slow
def test_errors_of_a_start_are_not_those_of_another_one():
    hoist = Phases((Phase(0.0, "block up to 30 m", motor=course(0.0, -UP)),))

    def code(**start):
        scene = sb.Scene(
            BRAKE, sb.Duty(hoist, LOAD), sb.Initial(0.0, **start), 1e3, motor=MOTOR
        )
        return int(sb.simulate(scene).code)

    assert code(block_height="5 m") == 0
    with input_error(match="without the height at the start"):
        code()
    assert code(block_height="5 m") == 0


def _weak(torque, power):
    return Motor(torque, power, 40.0)


@pytest.mark.slow
def test_the_rope_of_a_tackle_is_judged_by_its_tightest_line():
    """2 MN on 12 lines of sheaves with K = 1.04: in hoisting API RP 9B's 213.1 kN,
    where 2 MN/12 are 166.7 kN."""
    K = 1.04
    n = 12
    pull = 2e6
    load = HookLoad(pull / 9.80665, RADIUS, n)
    steady = sb.PiecewiseLinear([0.0], [-12.0])
    motor = Motor("150 kN*m", "10 MW", "40 rad/s", speed=steady)
    scene = sb.Scene(
        BRAKE,
        sb.Duty(0.0, load),
        sb.Initial(-12.0),
        2.0,
        motor=motor,
        shaft=(TackleLoss(K),),
        limits=sb.Limits(max_rope_tension="190 kN"),
    )
    result = sb.simulate(scene)
    fast = pull * K**n * (K - 1) / (K**n - 1)
    for name in ("max_rope_tension", "max_fast_line_tension"):
        near(result.metrics[name], fast, 1e-9)
    near(result.metrics["max_dead_line_tension"], fast / K**n, 1e-9)
    near(result.series([1.0]).motor_torque[0], fast * RADIUS, 1e-9)
    assert result.verdict().colour == "red"


@pytest.mark.parametrize("side", ["below", "above"])
@pytest.mark.parametrize("edge", ["lowering", "hoisting"])
def test_a_tackle_rests_between_its_two_branches(side, edge):
    """A weak motor and an open brake: the drum rests while `η_l M_h ≤ M ≤ M_h/η_h`, and
    moves by the difference."""
    law = TackleLoss(1.04)
    strung = law.strung(LINES)
    torque = {
        "lowering": WEIGHT * float(strung.lowering_efficiency),
        "hoisting": WEIGHT / float(strung.hoisting_efficiency),
    }[edge]
    away = 10.0 if side == "above" else -10.0
    motor = Motor(
        torque + away, 1e9, 1e3, speed=sb.PiecewiseLinear([0.0, 100.0], [0.0, -200.0])
    )
    scene = sb.Scene(
        BRAKE, sb.Duty(0.0, LOAD), sb.Initial(0.0), 2.0, motor=motor, shaft=(law,)
    )
    moves = (edge == "lowering") == (side == "below")
    omega = float(sb.simulate(scene).record.y_end.omega)
    near(omega, -away * 2.0 / J if moves else 0.0, 1e-9, 0.0)


def test_a_programme_asks_a_motor_for_what_the_tackle_takes_in_hoisting():
    law = TackleLoss(hoisting_efficiency=0.8)
    heavy = WEIGHT / 0.8 + J * FASTER / TRAVEL
    programme = ["hoist 10 m at 1 m/s"]
    parts = {"pull": 30e3, "lever_time": 0.3, "acceleration": FASTER, "shaft": (law,)}

    def scene(torque):
        motor = Motor(torque, "3 MW", "40 rad/s")
        return sb.programme_scene(BRAKE, programme, LOAD, motor=motor, **parts)

    scene(1.001 * heavy)
    with input_error(match="needs"):
        scene(0.999 * heavy)


@pytest.mark.slow
def test_a_motor_holds_back_what_it_lowers_and_the_brake_takes_the_rest():
    weak = _weak(0.5 * WEIGHT, 1e7)
    lower = Phase(
        Driller(course(0.0, DOWN), 60e3),
        "travel 20 m",
        "lower",
        motor=course(0.0, DOWN),
    )
    brake = Phase(Driller(course(DOWN, 0.0, -DOWN), 60e3), "rest", "brake")
    energy = run(Phases((lower, brake)), motor=weak).energy
    hook_work = MASS * 9.80665 * (20.0 + DOWN**2 / (2 * FASTER))
    near(energy["motor_work"], -0.5 * MASS * 9.80665 * 20.0, 1e-9)
    near(energy["friction_heat"], hook_work - 0.5 * MASS * 9.80665 * 20.0, 1e-9)


@pytest.mark.slow
def test_a_motor_at_its_limits_hoists_on_an_elastic_rope():
    """Own equations of drum, hook and rope, by SciPy."""
    k = 8.5e6
    c = 3e5
    drag = 40.0
    gain = 3.0
    position_gain = 1.5
    torque = 34e3
    power = 0.6e6
    load = HookLoad(
        MASS, RADIUS, LINES, elasticity=sb.loads.RopeElasticity(k, damping=c)
    )
    motor = Motor(torque, power, 40.0, gain=gain, position_gain=position_gain)
    hoist = Phases((Phase(0.0, "travel -5 m", motor=course(0.0, -UP)),))
    result = run(hoist, load, motor, 60.0, shaft=(sb.loads.ViscousDrag(drag),))
    knot = UP / FASTER
    steady = -UP / TRAVEL

    def rates(t, y):
        phi, omega, v, stretch = y[:4]
        early = t < knot
        speed, faster = (steady * t / knot, steady / knot) if early else (steady, 0.0)
        angle = 0.5 * faster * t**2 if early else steady * (t - 0.5 * knot)
        force = k * stretch + c * (v - TRAVEL * omega)
        wanted = faster - gain * (omega - speed) - position_gain * (phi - angle)
        most = min(torque, power / max(abs(omega), 1e-12))
        given = np.clip(force * TRAVEL - drag * omega - INERTIA * wanted, -most, most)
        alpha = (force * TRAVEL - drag * omega - given) / INERTIA
        return [
            omega,
            alpha,
            9.80665 - force / MASS,
            v - TRAVEL * omega,
            -given * omega,
        ]

    def arrived(t, y):
        return y[0] * TRAVEL + 5.0

    arrived.terminal = True
    options = {"rtol": 1e-11, "atol": 1e-10, "method": "DOP853", "max_step": 0.02}
    first = solve_ivp(
        rates, (0.0, knot), [0.0, 0.0, 0.0, MASS * 9.80665 / k, 0.0], **options
    )
    truth = solve_ivp(rates, (knot, 60.0), first.y[:, -1], events=arrived, **options)
    near(result.record.t_end, truth.t[-1], 1e-9)
    near(result.energy["motor_work"], truth.y[4, -1], 1e-9)
    closes(result, 1e-12)


@pytest.mark.slow
def test_thirty_stands_in_and_out_have_their_masses():
    count = 30
    empty = 8e3
    string = 40e3
    stand = 800.0

    def cycle(pause, hooked):
        phases = (*up(27.0), Phase(30e3, 5.0, pause), *down(27.0), HOLD)
        return tuple(
            dataclasses.replace(phase, string_on_hook=phase.name in hooked)
            for phase in phases
        )

    inwards = cycle("make up", ("lower", "brake"))
    out = cycle("lay down", ("hoist", "slow"))
    phases = Phases(inwards, count, then=Phases(out, count, stands=-1))
    result = run(phases, StringLoad(empty, string, RADIUS, LINES, stand=stand), end=1e5)
    assert int(result.code) == 0
    g = 9.80665
    strings = string + stand * np.arange(count)
    # up and down over the same 27 m: the string goes down, then up, and the block both
    near(result.energy["friction_heat"], g * 27 * np.sum(2 * empty + strings), 1e-9)
    near(result.energy["motor_work"], g * 27 * np.sum(2 * empty + strings), 1e-9)
    closes(result, 1e-9)
    assert len(result.events["phase_end"]) == 2 * count * 6
    assert result.events["phase_end"][-1].phase.cycle == 2 * count
    # in the last second of every phase
    load = result.series(ends(result) - 0.5).load_torque
    begun = np.asarray(load).reshape(2, count, 6)
    all_near(begun[0, :, 3], (empty + strings) * g * TRAVEL, 1e-12)
    all_near(begun[1, :, 0], (empty + strings[::-1]) * g * TRAVEL, 1e-12)


@pytest.mark.slow
def test_position_is_corrected_as_a_damped_oscillator():
    gain = 2.0
    position_gain = 1.0
    speed = DOWN / TRAVEL
    driller = Driller(sb.PiecewiseLinear([0.0], [speed]), 200e3, gain, position_gain)
    scene = sb.Scene(BRAKE, sb.Duty(driller, LOAD), sb.Initial(1.05 * speed), 5.0)
    t = np.linspace(0.0, 5.0, 6)
    away = np.asarray(sb.simulate(scene).series(t).phi) - speed * t
    # g²/4 = h: aperiodic
    all_near(away, 0.05 * speed * t * np.exp(-t), atol=1e-9)


@pytest.mark.slow
def test_phases_end_at_a_height_of_the_block():
    hoist = Phase(0.0, "block up to 30 m", "hoist", motor=course(0.0, -UP))
    slow = Phase(0.0, UP / FASTER, "slow", motor=course(-UP, 0.0))
    lower = Phase(Driller(course(0.0, DOWN), 60e3), "block down to 10 m", "lower")
    scene = sb.Scene(
        BRAKE,
        sb.Duty(Phases((hoist, slow, HOLD, lower)), LOAD),
        sb.Initial(0.0, block_height="5 m"),
        1e3,
        motor=MOTOR,
    )
    expected = 25.0 / UP + 0.5 * UP / FASTER
    rise = UP**2 / (2 * FASTER)  # while it slows
    lowering = (20.0 + rise) / DOWN + 0.5 * DOWN / FASTER
    result = sb.simulate(scene)
    times = np.cumsum([expected, UP / FASTER, 10.0, lowering])
    all_near(ends(result), times, 1e-10)


def test_the_speed_of_the_hook_starts_a_run_and_has_a_limit():
    driller = Driller(sb.PiecewiseLinear([0.0], [1.2 / TRAVEL]), 200e3)
    scene = sb.Scene(
        BRAKE, sb.Duty(driller, LOAD), sb.Initial(hook_speed="1.2 m/s"), 5.0
    )
    result = sb.simulate(scene)
    near(result.metrics["max_hook_speed"], 1.2, 1e-12)
    near(result.metrics["max_rope_tension"], MASS * 9.80665 / LINES, 1e-12)
    slower = sb.with_values(scene, {"initial.hook_speed": 1.0})
    limited = dataclasses.replace(
        slower, limits=sb.Limits(max_hook_speed="1.1 m/s", max_rope_tension="80 kN")
    )
    (event,) = sb.simulate(limited).events["hook_overspeed"]
    # the load runs free until the lever follows it: 1 m/s at first, 1.2 m/s later
    # the deviation halves at the gain of 2/s
    near(event.time, np.log(2.0) / 2.0, 1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("speed", "travel", "reason"),
    [
        pytest.param(-UP, -9.0, "M1", id="up"),
        pytest.param(DOWN, 9.0, "L1", id="down"),
        pytest.param(0.0, 0.0, "H7", id="still"),
    ],
)
def test_a_run_that_ends_under_the_motor_is_driven(speed, travel, reason):
    """It is amber, as no pull of the friction brake is given: it would not hold the
    load without the motor."""
    motor = dataclasses.replace(
        MOTOR, speed=course(0.0, speed) if speed else sb.PiecewiseLinear([0.0], [0.0])
    )
    end = 5.0 if speed == 0 else 9.0 / abs(speed) + 0.5 * abs(speed) / FASTER
    result = sb.simulate(
        sb.Scene(BRAKE, sb.Duty(0.0, LOAD), sb.Initial(0.0), end, motor=motor)
    )
    assert result.status == result.summary()["duty"] == "driven"
    assert (result.verdict().colour, result.verdict().reason) == ("amber", reason)
    near(result.total_hook_travel, travel, abs=1e-9)


@pytest.mark.slow
def test_a_speed_that_is_never_followed_has_a_name():
    load = HookLoad(100.0, RADIUS, LINES)
    driller = Driller(sb.PiecewiseLinear([0.0], [30.0]), 60e3)
    result = sb.simulate(sb.Scene(BRAKE, sb.Duty(driller, load), sb.Initial(0.0), 5.0))
    assert result.status == "not_followed"
    weak = Motor(0.5 * WEIGHT, 1e6, 40.0, sb.PiecewiseLinear([0.0], [-10.0]))
    assert (
        sb.simulate(
            sb.Scene(BRAKE, sb.Duty(0.0, LOAD), sb.Initial(0.0), 5.0, motor=weak)
        ).status
        == "not_followed"
    )


@pytest.mark.slow
def test_a_way_upwards_without_a_motor_is_that_of_a_block_in_motion():
    """`s = v²/(2 a)` of a block that coasts up; nothing else hoists it, and the run
    names the phase."""
    rises = Phases((Phase(0.0, "travel -0.1 m", "coast"), HOLD))
    scene = sb.Scene(BRAKE, sb.Duty(rises, LOAD), sb.Initial(-10.0), 5.0)
    a = WEIGHT / J
    v = 10.0
    t = (v - np.sqrt(v**2 - 2 * a * 0.1 / TRAVEL)) / a
    near(sb.simulate(scene, throw=False).events["phase_end"].times, [t], 1e-10)
    failed = sb.simulate(
        dataclasses.replace(scene, initial=sb.Initial(0.0)), throw=False
    )
    assert failed.status == "phase_never_ends"
