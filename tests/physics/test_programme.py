"""Programmes in words: what is planned is what the run does."""

import dataclasses
import math

import numpy as np
import pytest
from helpers import all_near, closes, input_error, near
from scenes import drawworks_brake, lining_ratio

import simbrake as sb

BRAKE = drawworks_brake(20)
HOOK = sb.HookLoad(mass=60e3, drum_radius=0.4, line_count=8)
TRIP = (
    "take the string",
    "lower 27 m at 1.2 m/s",
    "brake to rest",
    "hold 5 s",
    "set the string in the slips",
    "wait 10 s",
    "repeat 3 times",
)


@pytest.fixture(scope="module")
def tripping():
    return sb.simulate(
        sb.programme_scene(BRAKE, TRIP, HOOK, pull=30e3, empty=5e3, stand=900.0)
    )


def starts_of(result, count):
    """Starts of all cycles: the ends of the last phase of those before."""
    last = len(result.scene.duty.slack_tension.phases)
    return [0.0] + [
        e.time
        for e in result.events
        if e.phase and e.phase.phase == last and e.phase.cycle < count
    ]


@pytest.mark.slow
def test_hook_is_lowered_as_programmed(tripping):
    run_up = 1.2 / 0.5
    lowering = 1.2 / 0.5 + (27 - 1.2**2 / (2 * 0.5)) / 1.2
    starts = starts_of(tripping, 3)
    s = tripping.series(
        np.concatenate([[t + run_up, t + 10.0, t + lowering] for t in starts]),
        left=True,
    )
    all_near(s.omega, 24.0, 1e-9)
    travel = np.asarray(s.phi).reshape(3, 3) * 0.4 / 8
    all_near(travel[:, 2] - travel[:, 0], 27 - 1.2**2 / (2 * 0.5), 1e-9)
    near(travel[0, 2], 27.0, 1e-9)
    near(tripping.events["restart"].times, starts[1:], 1e-12)
    closes(tripping, 1e-9)


@pytest.mark.slow
def test_stop_comes_later_with_each_stand(tripping):
    first, *_ = stops = tripping.events["stop"].times
    # J ω̇ = −R_b (Π − 1)(T_0 − T_w): the lever goes from T_w to the pull in 0.35 s
    mu = lining_ratio(0.35, math.radians(13.5))
    gain = 0.623 * (mu**20 - 1)
    J = 1200 + 60e3 * 0.05**2
    excess = gain * 30e3 - 60e3 * 9.80665 * 0.05
    stop = 0.175 + J * 24.0 / excess
    lowering = 1.2 / 0.5 + (27 - 1.2**2 / (2 * 0.5)) / 1.2
    near(first, lowering + stop, 1e-10)
    starts = starts_of(tripping, 3)
    # what follows a stop waits for it: holding and the time in the slips last as said
    # in every cycle
    near(
        [*starts[1:], float(tripping.record.t_end)],
        [time + 15.0 for time in stops],
        1e-12,
    )
    near(tripping.scene.end_time, 2 * 3 * (lowering + stop + 15.0), 1e-12)
    late = [time - start for time, start in zip(stops, starts, strict=True)]
    assert late[0] < late[1] < late[2]


LOWERED = ("lower 10 m at 1.2 m/s", "brake to rest", "hold 1 s")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("drag", "shaft"),
    [
        (100.0, (sb.loads.ViscousDrag(100.0),)),
        (0.0, (sb.loads.TackleLoss(lowering_efficiency=0.9),)),
        (40.0, (sb.loads.BearingFriction(900.0), sb.loads.ViscousDrag(40.0))),
    ],
)
def test_the_lever_starts_from_what_all_torques_leave_of_the_load(drag, shaft):
    """The same resistance as drag of the load and as parts of the shaft: the lever
    begins with what it held before."""
    result = sb.simulate(
        sb.programme_scene(BRAKE, LOWERED, HOOK, pull=24e3, shaft=shaft)
    )
    lowered = result.events["phase_end"].times[0]
    before, after = result.series(
        [lowered * (1 - 1e-9), lowered * (1 + 1e-12)]
    ).slack_tension
    near(after, before, 1e-6)
    if len(shaft) == 1 and drag:
        same = dataclasses.replace(HOOK, drag=drag)
        times = (
            sb.simulate(sb.programme_scene(BRAKE, LOWERED, same, pull=24e3))
            .events["phase_end"]
            .times
        )
        near(times, result.events["phase_end"].times, 1e-10)


@pytest.mark.parametrize(
    "shaft",
    [
        pytest.param(
            (sb.loads.ViscousDrag(400.0), sb.loads.HydrodynamicBrake(60.0)),
            marks=pytest.mark.slow,
        ),
        (sb.loads.BearingFriction(3e3), sb.loads.TackleLoss(sheave_factor=1.04)),
    ],
)
def test_the_plan_of_braking_counts_what_resists_at_speed(shaft):
    """Time and travel of the plan are those of the run."""
    planned = sb.programme_scene(BRAKE, LOWERED, HOOK, pull=24e3, shaft=shaft)
    result = sb.simulate(planned)
    near(float(planned.end_time) / 2, result.record.t_end, 1e-10)
    short = dataclasses.replace(HOOK, rope=sb.loads.RopeLayers("30 mm", 10.0, 10.0))
    with input_error(match=f"lowers {result['total_hook_travel']:.5g} m in all"):
        sb.programme_scene(BRAKE, LOWERED, short, pull=24e3, shaft=shaft)


@pytest.mark.parametrize(
    "shaft",
    [
        (sb.loads.ViscousDrag(1000.0),),
        (sb.loads.BearingFriction(24e3),),
        (sb.loads.TackleLoss(lowering_efficiency=0.3),),
    ],
)
def test_a_speed_that_other_torques_keep_away_is_said(shaft):
    with input_error(match="cannot be reached: the load is too light") as caught:
        sb.programme_scene(BRAKE, LOWERED, HOOK, pull=24e3, shaft=shaft)
    assert len(caught.value.faults) == 1


def test_too_weak_a_pull_names_the_least_one():
    with input_error(match=r"needs \d+ N at the slack end — raise `pull`") as caught:
        sb.programme_scene(
            BRAKE, ("lower 9 m at 1 m/s", "brake to rest"), HOOK, pull=3e3
        )
    least = float(str(caught.value).split("needs ")[1].split(" N")[0])
    mu = lining_ratio(0.35, math.radians(13.5))
    near(least, 60e3 * 9.80665 * 0.05 / (0.623 * (mu**20 - 1)), 1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("brake", ["brake to rest in 3 s", "brake to rest"])
def test_braking_adds_its_own_travel(brake):
    """`V X/2` beside the 25 m: in the run, and in the error of a rope that is too short
    by a little."""
    lines = ("lower 25 m at 1.2 m/s", brake)
    travel = sb.simulate(
        sb.programme_scene(BRAKE, lines, sb.HookLoad(60e3, 0.4, 8), pull=40e3)
    )["total_hook_travel"]
    if brake.endswith("s"):
        near(travel, 26.8, 1e-4)
    assert travel > 25.1
    turns = (travel - 0.05) * 8 / (2 * math.pi * 0.4)
    hook = sb.HookLoad(60e3, 0.4, 8, rope=sb.loads.RopeLayers("30 mm", turns, turns))
    with input_error(match=f"lowers {travel:.4g}[0-9]* m in all, braking included"):
        sb.programme_scene(BRAKE, lines, hook, pull=40e3)


@pytest.mark.slow
def test_a_programme_with_layers_of_rope():
    """The hook is lowered as far as said over three layers; the pulley keeps the speed
    of the outermost."""
    rope = sb.loads.RopeLayers("30 mm", 20.0, 50.0)
    hook = sb.HookLoad(60e3, 0.4, 8, rope=rope)
    lines = (
        "take the string",
        "lower 12 m at 1 m/s",
        "brake to rest",
        "hold 1 s",
        "set the string in the slips",
    )
    result = sb.simulate(sb.programme_scene(BRAKE, lines, hook, pull=40e3, empty=5e3))
    radius = 0.4 + np.array([0.0, 1.0, 2.0]) * math.sqrt(3) / 2 * 0.03
    # m of rope in each layer
    full = 2 * math.pi * radius * np.array([20.0, 20.0, 10.0])
    down = result.events["phase_end"].times[0]
    rope_out = 12.0 * 8
    assert full[1] + full[2] < rope_out < full.sum()
    turns = 30 + (rope_out - full[1] - full[2]) / (2 * math.pi * radius[0])
    s = result.series([4.0, down])
    near(s.hook_position[1], 12.0, 1e-9)
    near(s.phi[1], 2 * math.pi * turns, 1e-9)
    near(s.omega[0], 8 / radius[2], 1e-9)
    assert result.status == "stopped"
    closes(result, 1e-9)
    with input_error(
        match=r"lowers 3\d\.\d+ m in all, braking included, the rope on the drum is enough for 16\.\d+ m"
    ):
        sb.programme_scene(
            BRAKE, (*lines, "repeat 3 times"), hook, pull=40e3, empty=5e3
        )


# --- hoisting, and lowering by other brakes -----------------------------------------

MOTOR = sb.loads.Motor("90 kN*m", "2 MW", "60 rad/s")
EDDY = sb.loads.EddyCurrentBrake("90 kN*m", "30 rad/s")
ROUND = (
    "make up a stand in 20 s",
    "take the string",
    "lower 26 m at 1.2 m/s on the auxiliary brake",
    "brake to rest",
    "hold 5 s",
    "set the string in the slips",
    "hoist back at 1.2 m/s",
    "hold 5 s",
    "repeat 2 times",
    "lower 26 m at 1.2 m/s on the motor",
    "brake to rest",
    "take the string",
    "hoist back at 0.8 m/s",
    "hold 5 s",
    "set in slips",
    "lay down a stand in 20 s",
    "repeat 2 times",
)


@pytest.mark.slow
def test_a_trip_in_and_out_comes_back():
    scene = sb.programme_scene(
        BRAKE,
        ROUND,
        HOOK,
        pull=30e3,
        empty=8e3,
        stand=900.0,
        acceleration=0.3,
        motor=MOTOR,
        shaft=(EDDY,),
    )
    result = sb.simulate(scene)
    ends = {(e.phase.name, e.phase.cycle): e.time for e in result.events["phase_end"]}
    s = result.series(
        [ends["lower", 1] - 1e-6, ends["lower", 2] - 1e-6, float(result.record.t_end)]
    )
    # the auxiliary brake alone tends to the speed that the words say, with a heavier
    # string to a higher one
    near(s.hook_speed[0], 1.2, 5e-3)
    # 2 M_m e/(1 + e²) of the full torque, by the square of the share
    e = 24.0 / 30.0
    weight = 60e3 * 9.80665 * 0.05
    near(s.load_torque[1], (60e3 + 900.0) * 9.80665 * 0.05, 1e-12)
    share = weight / (2 * 90e3 * e / (1 + e * e))
    ratio = float(s.omega[1]) / 30.0
    near(
        share * 2 * 90e3 * ratio / (1 + ratio**2), (60e3 + 900.0) * 9.80665 * 0.05, 5e-3
    )
    near(s.hook_position[2], 0.0, abs=1e-9)
    closes(result, 1e-9)
