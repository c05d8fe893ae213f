"""The life of the linings: closed forms, steps of many brakings beside one after the
other, turning the band."""

import dataclasses

import equinox as eqx
import numpy as np
import pytest
import staged_scenes
import wear_scenes as ws
from helpers import all_near, input_error, near
from scenes import lining_ratio

import simbrake as sb

LIMIT = 8e-3


def dragged(speed=None, k=1.5e-11, **wear):
    """A load that drives on while the lever comes: what delays the lever makes every
    braking longer."""
    scene = ws.stop(sb.Wear(k, permissible=LIMIT, take_up_speed=speed, **wear), end=6.0)
    lever = sb.PiecewiseLinear([0.2, 0.6], [200.0, ws.T0])
    return dataclasses.replace(scene, duty=sb.Duty(lever, 2000.0))


# --- without feedback ---------------------------------------------------------------


@pytest.fixture(scope="module")
def braking():
    return sb.simulate(ws.stop(sb.Wear(ws.K, permissible=LIMIT)))


@pytest.mark.slow
def test_life_is_that_of_the_tight_lining(braking):
    w = np.asarray(braking.worn_thickness)
    life = sb.lining_life(braking)
    assert life.first == 4
    near(life.brakings, LIMIT / w.max(), 1e-12)
    all_near(life.each, LIMIT / w, 1e-12)
    all_near(life.worn, LIMIT * w / w.max(), 1e-12)
    near(life.used, w.mean() / w.max(), 1e-12)
    # what is worn before, and a permissible wear of one's own, per lining and with a
    # unit
    worn = np.array([0.0, 1e-3, 0.0, 2e-3])
    early = sb.lining_life(sb.with_values(braking.scene, {"wear.worn": worn}), "6 mm")
    all_near(early.each, (6e-3 - worn) / w, 1e-12)
    each = np.array([1e-3, 8e-3, 8e-3, 8e-3])
    assert sb.lining_life(braking.scene, each).first == int(np.argmin(each / w)) + 1


@pytest.mark.slow
def test_best_turn_is_at_half_of_the_life(braking):
    w = np.asarray(braking.worn_thickness)
    life = sb.lining_life(braking, turn_at="best")
    near(life.brakings, 2 * LIMIT / (w[0] + w[-1]), 1e-6)
    near(life.turned_at[0], LIMIT / (w[0] + w[-1]), 1e-6)
    near(life.unturned, LIMIT / w.max(), 1e-12)
    near(life.gain, 2 * w[-1] / (w[0] + w[-1]), 1e-6)
    third = life.unturned / 3
    early = sb.lining_life(braking, turn_at=third)
    assert early.first == 1
    near(early.brakings, third + (LIMIT - third * w[0]) / w[-1], 1e-12)
    there_and_back = sb.lining_life(braking, turn_at=[third, 2 * third])
    assert there_and_back.first == 4
    all_near(
        there_and_back.worn[0],
        third * w[3] + (there_and_back.brakings - third) * w[0],
        1e-9,
    )
    never = sb.lining_life(braking, turn_at=10 * third)
    assert never.turned_at == ()
    near(never.brakings, life.unturned, 1e-12)


def test_what_goes_with_a_turned_band():
    law = sb.friction.ProductFriction(
        np.array([0.3, 0.28, 0.33, 0.25]),
        (
            sb.friction.TabulatedFade(
                [300.0, 400.0, 500.0, 600.0], [1.0, 0.9, 0.8, 0.7]
            ),
        ),
    )
    wear = sb.Wear(np.arange(1.0, 5.0) * 1e-14, worn=[1e-3, 2e-3, 3e-3, 4e-3])
    scene = ws.stop(wear, ws.lumps(), np.radians([40.0, 50.0, 60.0, 70.0]), law=law)
    turned = sb.studies.turned_scene(scene)
    all_near(np.degrees(turned.brake.linings.angle), [70.0, 60.0, 50.0, 40.0])
    all_near(turned.brake.linings.friction.base.coefficient, [0.25, 0.33, 0.28, 0.3])
    # a table
    all_near(turned.brake.linings.friction.factors[0].values, [1.0, 0.9, 0.8, 0.7])
    all_near(turned.wear.worn, [4e-3, 3e-3, 2e-3, 1e-3])
    again = sb.studies.turned_scene(turned)
    assert sb.files.scene_text(again) == sb.files.scene_text(scene)
    with input_error(match="ride on the pulley"):
        sb.studies.turned_scene(ws.wearing(staged_scenes.stop(), sb.Wear(1e-14)))


def test_equal_loads_of_z_level_the_wear(braking):
    """`N_n/N_1 = μ^(n−1)` for the uniform pitch, 1 for equal loads, over the whole
    life; and the gain in brakings."""
    angle = np.asarray(sb.layouts.equal_load_angles(ws.F, ws.N, ws.N * ws.BETA).angle)
    factor = lining_ratio(ws.F, ws.BETA) ** (ws.N - 1)
    uniform, level = (
        sb.lining_life(one)
        for one in (
            braking,
            sb.with_values(braking.scene, {"brake.linings.angle": angle}),
        )
    )
    all_near(uniform.over_least / level.over_least, factor, 1e-9)
    all_near(level.over_least, 1.0, 1e-9)
    near(level.used, 1.0, 1e-9)
    # wear ∝ N_i/(Π − 1): the layout also changes the distance of the stop
    (T, even) = ws.statics()
    (T_level, normal) = ws.statics(angle)
    gain = (even[-1] / (T[-1] - 1)) / (normal[-1] / (T_level[-1] - 1))
    near(level.brakings / uniform.brakings, gain, 1e-9)


# --- with feedback ------------------------------------------------------------------


@pytest.mark.slow
def test_worn_brake_has_a_smaller_circle(braking):
    """`R_b' = R_b − h̄`; without load the distance and the wear of a braking stay, and
    the stop takes longer."""
    h = np.array([1e-3, 2e-3, 3e-3, 6e-3])
    scene = sb.with_values(braking.scene, {"brake.band.radius": 0.65})
    fresh = sb.simulate(
        eqx.tree_at(lambda s: s.wear, scene, sb.Wear(ws.K, worn=h, geometry=True))
    )
    near(fresh.record.system.mechanism.radius, 0.65 - h.mean(), 1e-14)
    alpha = ws.T0 * (ws.statics()[0][-1] - 1) / ws.J
    near(fresh.stopping_time, ws.W0 / (alpha * (0.65 - h.mean())), 1e-10)
    all_near(fresh.worn_thickness, braking.worn_thickness, 1e-9)
    slow = dragged(0.05, worn=h)
    late = float(np.sum(h) * ws.BETA / 0.05)
    lever = sb.studies.worn_scene(slow).duty.slack_tension
    near(lever.delay, late, 1e-14)
    prompt = dataclasses.replace(dragged(), initial=sb.Initial(ws.W0, time=0.0))
    moved = sb.simulate(slow)
    by_hand = dataclasses.replace(
        prompt.duty,
        slack_tension=sb.PiecewiseLinear([0.2 + late, 0.6 + late], [200.0, ws.T0]),
    )
    expected = sb.simulate(dataclasses.replace(prompt, duty=by_hand))
    near(moved.stopping_time, expected.stopping_time, 1e-12)
    all_near(moved.worn_thickness, expected.worn_thickness, 1e-10)


@pytest.mark.slow
def test_worn_linings_in_the_heat_part():
    h = np.array([1e-3, 2e-3, 3e-3, 6e-3])
    wear = sb.Wear(ws.K, worn=h, heat=True, thickness=0.03)
    heat = ws.lumps()
    heat = dataclasses.replace(
        heat,
        bodies=(*heat.bodies, sb.thermal.Lump("band", 1e4)),
        links=(sb.thermal.Conductance("linings", "band", 3.0),),
        friction=sb.thermal.FrictionHeat("rim", "linings", 0.9),
    )
    # linings by their name, and as what the friction heats
    for named in ("linings", None):
        told = dataclasses.replace(heat, linings=named)
        worn = sb.studies.worn_scene(ws.stop(wear, told)).heat
        all_near(worn.bodies[1].capacity, ws.CAPACITY * (1 - h / 0.03), 1e-14)
        all_near(worn.links[0].value, 3.0 / (1 - h / 0.03), 1e-14)
    # insulated walls: they store a tenth of the friction's heat in what is left of them
    steel = sb.material("steel_20L")
    lining = sb.material("FK-24A")
    for each, left in ((1, 0.03 - h.mean()), (4, 0.03 - h)):
        layered = sb.layered_heat(
            rim=steel,
            rim_thickness=0.025,
            track_area=0.8,
            rim_layers=4,
            partition=0.9,
            lining=lining,
            lining_thickness=0.03,
            lining_area=4 * ws.AREA,
            lining_layers=5,
            each=each,
        )
        result = sb.simulate(ws.stop(sb.Wear(ws.K, worn=h, heat=True), layered))
        (wall,) = (body for body in layered.bodies if body.name == "lining")
        rise = (
            np.asarray(result.end_temperatures)[-5 * each :].reshape(each, 5)
            - sb.thermal.ROOM
        ) @ np.asarray(wall.steps)
        depth = np.sum(rise / 0.03 * left) * float(wall.area)
        stored = float(lining.density * lining.specific_heat) * depth
        near(stored, 0.1 * float(result.energy["friction_heat"]), 1e-8)


def test_a_step_of_many_stops_by_its_formula():
    """`h(Δ) = ½ [(Δ + 1) w(0) + (Δ − 1) w(Δ w(0))]`; at the end the first lining has
    lost all that it may lose."""
    scene = dragged(0.03)
    step = 20.0

    def wear(worn):
        return np.asarray(
            sb.simulate(sb.with_values(scene, {"wear.worn": worn})).worn_thickness
        )

    first = wear(np.zeros(4))
    life = sb.lining_life(scene, step=step)
    expected = 0.5 * ((step + 1) * first + (step - 1) * wear(step * first))
    assert life.history.brakings[1] == step
    all_near(life.history.worn[1], expected, 1e-9)
    assert life.brakings % step > 1
    near(life.worn[life.first - 1], LIMIT, 1e-9)


@pytest.mark.slow
def test_large_steps_match_single_brakings():
    scene = dragged(0.03)
    one_by_one = sb.lining_life(scene, step=1)
    life = sb.lining_life(scene)
    # feedback matters
    assert (
        one_by_one.history.per_braking[-1, 3]
        > 1.1 * one_by_one.history.per_braking[0, 3]
    )
    assert life.runs < one_by_one.runs / 2
    near(life.brakings, one_by_one.brakings, 2e-4)
    sharp = sb.lining_life(scene, tolerance=1e-4)
    assert abs(sharp.brakings - one_by_one.brakings) < abs(
        life.brakings - one_by_one.brakings
    )
    all_near(sharp.worn, one_by_one.worn, 1e-4)
    # one after the other is the recursion itself
    h = np.zeros(4)
    for _ in range(3):
        h = h + np.asarray(
            sb.simulate(sb.with_values(scene, {"wear.worn": h})).worn_thickness
        )
    all_near(one_by_one.history.worn[3], h, 1e-9)
    turned = sb.lining_life(scene, turn_at="best")
    around = [
        sb.lining_life(scene, turn_at=turned.turned_at[0] * x).brakings
        for x in (0.97, 1.03)
    ]
    assert turned.brakings > max(around)
    assert turned.gain > 1.3
