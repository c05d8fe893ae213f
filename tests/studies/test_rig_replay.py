"""Replay of a rig's recording on a scene: motion, weight and heat against known truths,
what is refused, comparison."""

import dataclasses
import json

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import all_equal, all_near, closes, input_error, jacobians, near
from rig_recordings import log_of, recording, sampled, trip, witsml
from scenes import drawworks_brake
from scipy.integrate import solve_ivp

import simbrake as sb

G = 9.80665
LINES = 8
RADIUS = 0.4
INERTIA = 1200.0
CAPACITY = 2.0e5
COOLING = 400.0
AIR = 293.15
STRING = 6.0e5
BLOCK = 1.5e5
#: travel, speed, acceleration, load lowered, load at rest and hoisted
STANDS = [
    (28.0, 1.1, 0.15, STRING, BLOCK),
    (27.0, 1.6, 0.2, STRING, BLOCK),
    (25.0, 0.8, 0.1, STRING, BLOCK),
]


def scene_of(cooling=COOLING, **parts):
    brake = drawworks_brake()
    heat = sb.lumped_heat(
        rim=CAPACITY,
        partition=1.0,
        rim_cooling=cooling,
        temperature=AIR,
        ambient=AIR,
        permissible_rim="500 degC",
    )
    duty = sb.Duty("20 kN", sb.HookLoad("60 t", RADIUS, LINES))
    return dataclasses.replace(
        sb.Scene(brake, duty, sb.Initial(0.0), 1.0, heat), **parts
    )


def replayed(folder, t, height, **parts):
    """The replay of a constant load, and by how much its block is below that of the
    log."""
    log = recording(folder, t, height, np.full(t.size, STRING))
    replay = sb.rig.replay(log, scene_of(**parts))
    lowered = np.asarray(replay.path.hook.travelled(replay.path.angle_at(t)))
    return replay, height - (height[0] - lowered)


def truth(stands, *, inertia=STRING / G):
    """A trip whose load has the inertia of the lowered mass."""
    return trip(stands, inertia=inertia)


@pytest.mark.parametrize(
    "kind",
    [
        pytest.param("fine", marks=pytest.mark.slow),
        pytest.param("decimated", marks=pytest.mark.slow),
        "held",
    ],
)
def test_travel_work_and_temperature_of_a_known_trip(tmp_path, kind):
    """The rim has the heat of load times travel, and cools between: by SciPy, with the
    true motion."""
    t, h, load, true = truth(STANDS)
    replay = sb.rig.replay(
        recording(tmp_path, *sampled(t, h, load, kind, np.random.default_rng(2))),
        scene_of(),
    )
    assert replay.result.ok
    closes(replay.result, 1e-8)
    assert len(replay.lowerings) == len(true)
    for one, (_, _, travel, work) in zip(replay.lowerings, true, strict=True):
        assert abs(one.travel_deviation) < 0.01
        assert abs(one.work_deviation) < 0.03
        near(one.travel, travel, 0.01)
        near(one.hook_work, work, 0.03)
    per_radian = RADIUS / LINES
    speed = np.clip(-np.gradient(h, t) / per_radian, 0.0, None)
    power = speed * (
        STRING * per_radian
        - (INERTIA + STRING / G * per_radian**2) * np.gradient(speed, t)
    )

    def rates(time, T):
        return (np.interp(time, t, power) - COOLING * (T - AIR)) / CAPACITY

    each = [
        solve_ivp(rates, (a, b), [AIR], max_step=0.5).y[0, -1] for a, b, *_ in true[:1]
    ]
    near(replay.lowerings[0].hottest["peak_rim_temperature"] - AIR, each[0] - AIR, 0.03)
    whole = solve_ivp(rates, (t[0], true[-1][1]), [AIR], max_step=0.5)
    assert (
        replay.hottest
        is replay.lowerings[
            int(
                np.argmax([x.hottest["peak_rim_temperature"] for x in replay.lowerings])
            )
        ]
    )
    near(
        replay.lowerings[-1].hottest["peak_rim_temperature"] - AIR,
        whole.y[0].max() - AIR,
        0.03,
    )


@pytest.mark.parametrize(
    ("interval", "rope"),
    [
        pytest.param(2.0, sb.loads.RopeLayers("32 mm", 20, 100), id="in layers"),
        pytest.param(5.0, None, id="seldom read", marks=pytest.mark.slow),
    ],
)
def test_between_updates_no_speed_is_above_that_of_the_log(tmp_path, interval, rope):
    """The drum is turned in trapezoids of its speed, whose ramps begin and end between
    updates of the height: at the top of one the parabola through three updates is above
    it by up to an eighth."""
    t, h, _, _ = truth(STANDS)
    angle = (42.0 - h) * LINES / (0.45 if rope else RADIUS)
    hook = sb.HookLoad("60 t", RADIUS, LINES, rope=rope)
    height = 42.0 - np.asarray(hook.travelled(angle))
    at = slice(None, None, round(interval / (t[1] - t[0])))
    replay, _ = replayed(
        tmp_path, t[at], height[at].round(3), duty=sb.Duty("20 kN", hook)
    )
    assert len(replay.lowerings) == 3
    near(replay.result["max_drum_speed"], np.gradient(angle, t).max(), 0.01)
    assert sb.rig.compare(replay).position.total.rmse < 5e-3


def test_the_inertia_in_the_recorded_load_counts_once(tmp_path):
    """A light block that is lowered fast: its load dips and rises by 15 %, its weight
    does not."""
    mass = BLOCK / G
    t, h, load, true = truth([(30.0, 2.4, 1.5, BLOCK, BLOCK)] * 2, inertia=mass)
    away = load / BLOCK - 1
    assert np.abs(away).max() > 0.15
    replay = sb.rig.replay(
        recording(tmp_path, *sampled(t, h, load, "fine", np.random.default_rng(3))),
        scene_of(0.0),
    )
    hung = np.asarray(replay.path.hook.masses)
    all_near(hung, mass, 0.01)
    compared = sb.rig.compare(replay)
    # the simulated load dips and rises as the recorded one: with the inertia in the
    # masses too it would be off by 9 %
    assert compared.load.total.rmse < 0.055 * BLOCK / 1e3
    assert abs(compared.load.total.bias) < 0.005 * BLOCK / 1e3
    assert compared.position.total.rmse < 0.01
    assert compared.position.total.coverage == compared.position.total.within == 1.0
    # the drum has more inertia than the block can turn that fast: the motor drives it,
    # and gives what is missing
    energy = replay.result.energy
    assert float(energy["friction_heat"]) > sum(work for *_, work in true)
    rise = replay.result["peak_rim_temperature"] - AIR
    near(rise, float(energy["friction_heat"]) / CAPACITY, 1e-6)


@pytest.mark.parametrize(
    "cycle",
    [
        pytest.param([-28.0, -0.12, 28.12], id="into the slips"),
        pytest.param(
            [-3.0, 0.25] * 5 + [13.75],
            id="raised between lowerings",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            [-14.0, 14.25, -0.25], id="lowered a little", marks=pytest.mark.slow
        ),
    ],
)
def test_small_movements_at_rest_are_given_back(tmp_path, cycle):
    """Movements below the threshold do not pile up: the block of the replay stays by
    that of the log."""
    pieces = [np.full(20, 30.0)]
    for way in cycle * 4:  # at 1 m/s, and 40 s of rest
        at = pieces[-1][-1]
        pieces += [
            at + np.sign(way) * np.minimum(np.arange(2.0, abs(way) + 2, 2.0), abs(way)),
            np.full(20, at + way),
        ]
    height = np.concatenate(pieces)
    t = 2.0 * np.arange(height.size)
    down = [-x for x in cycle * 4 if x < -2]
    replay, away = replayed(tmp_path, t, height)
    resting = np.append(height[1:] == height[:-1], True)
    assert np.abs(away[resting]).max() < 0.3
    all_near([one.travel for one in replay.lowerings], down, 0.01)
    all_near(
        [one.hook_work for one in replay.lowerings], STRING * np.asarray(down), 0.03
    )
    near(
        replay.result.energy["load_work"],
        STRING * (height[0] - height[-1]),
        abs=0.3 * STRING,
    )


@pytest.mark.slow
def test_a_slow_motion_follows_the_log(tmp_path):
    """As in drilling, with a pause: the height is met within 0.3 m all along."""
    t = np.arange(0.0, 2600.0, 2.0)
    times = [0.0, 40, 45, 85, 1285, 1685, 2485, 2600]
    height = np.interp(t, times, 30.0 - np.array([0.0, 0, 5, 5, 17, 17, 25, 25]))
    replay, away = replayed(tmp_path, t, height)
    assert np.abs(away).max() < 0.31
    near(replay.result.energy["load_work"], 25.0 * STRING, 1e-3)


@pytest.mark.slow
def test_the_lever_holds_in_a_pause_of_a_lowering(tmp_path):
    """At rest the tension is the pull, not what is left of that in motion."""
    t = np.arange(0.0, 200.0, 2.0)
    height = 40.0 - np.clip(0.5 * (t - 40), 0, 12) - np.clip(0.5 * (t - 76), 0, 14)
    replay, _ = replayed(tmp_path, t, height)
    assert len(replay.lowerings) == 1
    scene = scene_of()
    held = float(
        sb.simulate(dataclasses.replace(scene, end_time=5.0)).metrics[
            "min_holding_reserve"
        ]
    )
    near(replay.result.metrics["min_holding_reserve"], held * 60e3 * G / STRING, 1e-6)
    all_equal(replay.result.series([66.0, 70.0, 74.0]).omega, 0.0)


def test_the_lever_holds_between_a_lowering_and_a_hoisting(tmp_path):
    """Both meet in an update of the height: the band is not judged open at rest."""
    t = np.arange(0.0, 200.0, 2.0)
    height = np.interp(t, [40.0, 80.0, 120.0], [40.0, 20.0, 40.0])
    replay, _ = replayed(tmp_path, t, height)
    assert replay.result["min_holding_reserve"] > 1.0


def test_shares_of_a_motor_are_no_heat_of_the_brake(tmp_path):
    t, h, load, _ = truth(STANDS)
    log = recording(tmp_path, *sampled(t, h, load, "held", np.random.default_rng(4)))
    book = sb.rig.ledger(
        log, lines=LINES, brake="regenerative", auxiliary={"string": 0.75, "block": 0.0}
    )
    replay = sb.rig.replay(book, scene_of())
    heat = float(replay.result.energy["friction_heat"])
    work = sum(one.hook_work for one in replay.lowerings)
    near(heat, 0.25 * work, 0.03)
    # an assumed share takes heat off the brake: what it is at most, without it, stands
    # beside it
    near(replay.bound.energy["friction_heat"], work, 0.03)
    alone = sb.rig.replay(log, scene_of())
    near(alone.result.energy["friction_heat"], work, 0.03)
    told = json.loads(json.dumps(replay.as_dict()))["replay"]
    peaks = (part["metrics"]["peak_rim_temperature"] for part in (told, told["bound"]))
    low, high = peaks
    assert high == replay.bound["peak_rim_temperature"] > low + 20
    assert alone.bound is None
    # the pulled lever holds what rests: sliding under it, the band would have 104 kN
    assert max(run.result.metrics["max_tension"] for run in (replay, alone)) < 90e3


@pytest.mark.slow
def test_through_gaps_the_block_of_a_replay_moves_evenly(tmp_path):
    """Lowered by 16 m at 1 m/s, of which 6 m are in a gap, hoisted by 12 m in another
    one, and lowered by 10 m."""
    times = [0.0, 40, 56, 200, 240, 300, 320, 400]
    t = np.arange(0.0, 400.0, 2.0)
    height = np.interp(t, times, [30, 30, 14, 14, 26, 26, 16, 16])
    kept = (t <= 46) | ((t >= 52) & (t <= 180)) | (t >= 260)
    t = np.where(t >= 52, t + 20.0, t)  # 26 s for these 6 m
    replay, away = replayed(tmp_path, t[kept], height[kept])
    assert replay.result.ok
    near(replay.result.energy["load_work"], 14.0 * STRING, 1e-3)
    assert np.abs(away).max() < 0.3
    assert [one.lowering.flags for one in replay.lowerings] == [
        ("cut by a gap",),
        ("cut by a gap",),
        (),
    ]
    assert [gap["change"] for gap in replay.as_dict()["gaps"]] == [-6.0, 12.0]


@pytest.mark.slow
def test_a_motor_and_a_rope_of_the_scene(tmp_path):
    """The drum follows the height in every layer; a motor that is too weak is told."""
    t, h, load, _ = truth(STANDS)
    rope = sb.loads.RopeLayers("32 mm", turns_per_layer=20, turns=100)
    scene = scene_of(
        duty=sb.Duty("20 kN", sb.HookLoad("60 t", RADIUS, LINES, rope=rope)),
        motor=sb.loads.Motor("60 kN*m", "3 MW", "60 rad/s"),
        shaft=(
            sb.loads.TackleLoss(lowering_efficiency=0.9),
            sb.loads.EddyCurrentBrake("60 kN*m", "20 rad/s"),
        ),
    )
    log = recording(tmp_path, *sampled(t, h, load, "fine", np.random.default_rng(7)))
    replay = sb.rig.replay(log, scene)
    heat, loss = (
        float(replay.result.energy[name])
        for name in ("friction_heat", "shaft_tackle_loss")
    )
    work = sum(one.hook_work for one in replay.lowerings)
    near(heat, 0.9 * work, 0.02)
    assert loss > 0.1 * work
    assert sb.rig.compare(replay).position.total.rmse < 0.02
    rope = sb.loads.RopeLayers("32 mm", turns_per_layer=20, turns=60)
    short = dataclasses.replace(
        scene, duty=sb.Duty("20 kN", sb.HookLoad("60 t", RADIUS, LINES, rope=rope))
    )
    with input_error(match=r"rope.turns: pay out .* of the hook, the log has 27.95 m"):
        sb.rig.replay(log, short)


def test_what_cannot_be_replayed_is_named(tmp_path):
    t, h, load, _ = truth(STANDS[:1])
    rows = slice(None, None, 100)
    log = recording(
        tmp_path, t[rows], h[rows], load[rows], LINS=("", np.full(t[rows].size, 10))
    )
    duties = (sb.HookLoad("60 t", RADIUS, LINES), sb.TorqueLoad("12 kN*m"))
    for hung in duties:
        with input_error():
            sb.rig.replay(log, scene_of(duty=sb.Duty("20 kN", hung)))
    columns = {
        "BLOCKCOMP": ("m", h[rows]),
        "HKLD": ("kN", load[rows]),
        "HEAVE": ("m", np.sin(t[rows])),
    }
    heaving = log_of(tmp_path, "b.xml", witsml(t[rows], columns))
    with input_error(match="1 of 1 lowerings"):
        sb.rig.replay(heaving, scene_of())


TIMES = np.array([0.0, 5, 9, 29, 33, 60, 64, 84, 88, 100, 103, 110, 113])
SPEEDS = np.array([0.0, 0, 20, 20, 0, 0, -20, -20, 0, 0, 30, 30, 0])
HEAVY = 60e3
LIGHT = 2e3


def of_a_motion(masses, share):
    """Lowered by 24 m and hoisted heavy, driven down by 15 m light."""
    angles = np.append(
        0.0, np.cumsum(0.5 * (SPEEDS[1:] + SPEEDS[:-1]) * np.diff(TIMES))
    )
    speed = sb.PiecewiseLinear(TIMES, SPEEDS)
    shares = share * np.ones(TIMES.size)
    motion = sb.loads.RecordedMotion(speed, angles, "60 kN", "30 kN", shares)
    duty = sb.Duty(motion, sb.loads.RecordedLoad([0, 95], masses, RADIUS, LINES))
    motor = sb.loads.Motor("90 kN*m", "3 MW", "60 rad/s")
    return sb.Scene(scene_of().brake, duty, sb.Initial(0.0), 130.0, motor=motor)


def heat_and_work(masses, share):
    """Of the brake, of the motor: `drive` (N·m) is what it needs to drive the light
    load down."""
    (heavy, light) = masses
    per_radian = RADIUS / LINES
    drive = (INERTIA + light * per_radian**2) * 10.0 - light * G * per_radian
    braked = heavy * G * 24 + light * G * 15 + drive * 45
    return (1 - share) * braked, heavy * G * 24 + drive * 45 - share * braked


def test_a_recorded_speed_passes_zero_in_a_point():
    """But where a lowering aims below 0, and rests from that instant on."""

    def followed(times, speeds):
        times, speeds = np.array(times), np.array(speeds)
        moved = np.cumsum(0.5 * (speeds[1:] + speeds[:-1]) * np.diff(times))
        speed = sb.PiecewiseLinear(times, speeds)
        angles = np.append(0.0, moved)
        share = np.zeros(times.size)
        lever = sb.loads.RecordedMotion(speed, angles, "60 kN", "30 kN", share)
        duty = dataclasses.replace(scene_of().duty, slack_tension=lever)
        motor = sb.loads.Motor("90 kN*m", "3 MW", "60 rad/s")
        return sb.simulate(scene_of(duty=duty, motor=motor, end_time=3.0))

    for times, speeds in (
        ([0.0, 0.5], [5.0, -5.0]),
        ([0.0, 0.5, 0.9], [5.0, -5.0, 0.0]),
        ([0.0, 0.5, 0.5], [-5.0, 5.0, 0.0]),
    ):
        with input_error(match="changes its sign between"):
            followed(times, speeds)
    rests = followed([0.0, 1.0, 1.5, 1.5], [0.0, 2.0, -1.0, 0.0])
    near(rests.stopping_time, 1.0 + 2.0 / 6.0, 1e-9)


@pytest.mark.slow
def test_a_recorded_motion_is_followed_to_the_last_digit():
    """Angles of the points, heat and work of the motor in closed form."""
    scene = of_a_motion([HEAVY, LIGHT], 0.0)
    motion = scene.duty.lever
    load = scene.duty.load
    motor = scene.motor
    result = sb.simulate(scene)
    all_near(result.series(TIMES).phi, motion.angles, atol=1e-6)
    heat, work = heat_and_work([HEAVY, LIGHT], 0.0)
    near(result.energy["motor_work"], work, 1e-7)
    near(result.energy["friction_heat"], heat, 1e-7)
    assert (
        sb.simulate(sb.files.scene_from_text(sb.files.scene_text(scene))).record.t_end
        == 130.0
    )
    for change, words in (
        ({"motor": None}, "the recorded motion hoists"),
        (
            {
                "motor": dataclasses.replace(
                    motor, speed=sb.PiecewiseLinear([0.0], [1.0])
                )
            },
            "has no effect beside",
        ),
        (
            {"motor": sb.loads.Motor("90 kN*m", "3 MW", "20 rad/s")},
            "30 rad/s is above the motor's 20 rad/s",
        ),
        (
            {
                "duty": sb.Duty(
                    dataclasses.replace(motion, angles=motion.angles[1:]), load
                )
            },
            "has 12 values for 13 points",
        ),
        (
            {
                "duty": sb.Duty(
                    dataclasses.replace(
                        motion, speed=sb.PiecewiseLinear(TIMES, SPEEDS - 1)
                    ),
                    load,
                )
            },
            "sign",
        ),
        (
            {
                "duty": sb.Duty(
                    motion, sb.loads.RecordedLoad([0, 95], [1e4], RADIUS, LINES)
                )
            },
            "of one length",
        ),
    ):
        with input_error(match=words):
            sb.check_scene(dataclasses.replace(scene, **change))


@pytest.mark.slow
@pytest.mark.parametrize("torque", [15.0, 12.5, 18.0])
def test_a_motor_that_is_behind_lowers_after_it_hoisted(torque):
    """The drum is still hoisted, or just at rest, where the recording is lowered
    already; the tackle has its loss."""
    times = np.array([0.0, 4, 14, 16, 18, 28, 32, 40])
    speeds = np.array([0.0, -20, -20, 0, 12, 12, 0, 0])
    angles = np.append(
        0.0, np.cumsum(0.5 * (speeds[1:] + speeds[:-1]) * np.diff(times))
    )
    speed = sb.PiecewiseLinear(times, speeds)
    share = np.full(times.size, 0.7)
    motion = sb.loads.RecordedMotion(speed, angles, "60 kN", "30 kN", share)
    duty = sb.Duty(motion, sb.loads.RecordedLoad([0.0], [15e3], RADIUS, LINES))
    parts = {
        "motor": sb.loads.Motor(1e3 * torque, 3e6, 60.0),
        "shaft": (sb.loads.TackleLoss(lowering_efficiency=0.85),),
    }
    result = sb.simulate(
        sb.Scene(scene_of().brake, duty, sb.Initial(0.0), 40.0, **parts)
    )
    assert result.ok
    closes(result, 1e-7)
    assert float(result.series([15.9]).omega[0]) < -0.1


@pytest.mark.slow
def test_derivatives_of_a_recorded_motion():
    """By both masses and by the motor's share, forwards and backwards, beside those of
    the closed forms."""

    def of_the_run(x):
        energy = sb.simulate(of_a_motion(x[:2], x[2])).energy
        return jnp.stack([energy["friction_heat"], energy["motor_work"]])

    start = jnp.asarray([HEAVY, LIGHT, 0.25])
    value, forwards, backwards = jacobians(of_the_run)(start)
    truth = jax.jacobian(lambda x: jnp.stack(heat_and_work(x[:2], x[2])))(start)
    all_near(value, heat_and_work([HEAVY, LIGHT], 0.25), 1e-7)
    for jacobian in (forwards, backwards):
        all_near(jacobian, truth, 1e-6)
