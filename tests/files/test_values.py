"""Values in every usual form: numbers, lists, arrays, texts with units, numbers for
parts; what is refused at once."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pandas as pd
import pytest
import staged_scenes
from heat_scenes import fading, layered_stop, lump, rigid_stop
from helpers import all_equal, all_near, faults_of, input_error, near, paths_of
from scenes import stop_run, stop_scene

import simbrake as sb


@pytest.mark.parametrize(
    "value",
    [
        0.59,
        "590 mm",
        "5_90.0_0 mm",
        "0.59",
        np.float64(0.59),
        np.asarray(0.59),
        jnp.asarray(0.59),
        np.float32(0.59),
    ],
)
def test_a_number_in_any_form(value):
    radius = sb.Pulley(value, 1200).radius
    assert radius.dtype == np.float64
    near(radius, 0.59, 1e-15 if np.asarray(value).dtype != np.float32 else 1e-7)


@pytest.mark.parametrize(
    "value",
    [
        [10, 20],
        (10.0, "20 N"),
        np.asarray([10, 20]),
        jnp.asarray([10, 20]),
        "[10, 20] N",
        ["0.01 kN", 20],
        pd.Series([10, 20]),
    ],
)
def test_lists_in_any_form(value):
    preload = sb.Bandage("65 kg*m^2", 0.3, value).preload
    assert preload.dtype == np.float64
    all_equal(preload, [10.0, 20.0])


def test_texts_and_numbers_make_one_scene():
    def scene(wrap, friction, tension, load):
        linings = sb.uniform_linings(20, wrap, friction)
        brake = sb.Brake(sb.Pulley(0.59, 1200), sb.Band("612 mm"), linings)
        return sb.Scene(brake, sb.Duty(tension, load), sb.Initial("190 rpm"), 20)

    long = scene(
        1.5 * np.pi,
        sb.ConstantFriction(0.35),
        sb.Constant(8000.0),
        sb.TorqueLoad(sb.Constant(1000.0)),
    )
    for short in (
        scene("270 deg", 0.35, 8000, 1000),
        scene("270 deg", "35 %", "8 kN", "1 kN*m"),
    ):
        assert jax.tree.structure(short) == jax.tree.structure(long)
        jax.tree.map(lambda a, b: all_near(a, b, 1e-15), short, long)


def test_numbers_stand_for_parts():
    assert isinstance(sb.TorqueLoad(29430.0).profile, sb.Constant)
    assert isinstance(sb.Wear(1e-14).rate, sb.wear.ConstantWear)
    assert isinstance(
        sb.thermal.FrictionHeat("rim", None, 1.0).partition,
        sb.thermal.ConstantPartition,
    )
    assert isinstance(sb.ForceDuty("12 kN", 0).load, sb.TorqueLoad)
    assert isinstance(
        sb.friction.ProductFriction(0.4, (sb.LinearFade(1e-3, "20 degC"),)).base,
        sb.ConstantFriction,
    )
    assert isinstance(
        sb.lumped_heat(rim=1e5, partition=0.9, rim_cooling=20.0).friction.partition,
        sb.thermal.ConstantPartition,
    )


def test_numbers_put_in_later_are_checked():
    def put(value):
        return eqx.tree_at(lambda s: s.brake.pulley.inertia, stop_scene(C=None), value)

    times = [
        float(sb.simulate(put(J)).stopping_time)
        for J in (2400.0, 2400, np.asarray(2400.0))
    ]
    assert times[0] == times[1] == times[2]
    near(
        times[0],
        2400.0 / 800.0 * float(stop_run(C=None).stopping_time),
        1e-9,
    )
    for bad in (-1.0, "1200", float("inf")):
        with input_error(match=r"brake\.pulley\.inertia"):
            sb.simulate(put(bad))


def test_traced_values_pass():
    def mass(radius):
        return sb.Pulley(radius, radius**2).inertia

    assert jax.grad(mass)(3.0) == 6.0
    all_equal(jax.vmap(mass)(jnp.asarray([1.0, -2.0])), [1.0, 4.0])


# --- numbers by path ----------------------------------------------------------------


def test_entries_and_absent_numbers_by_path():
    scene = stop_scene()
    angle = np.asarray(scene.brake.linings.angle)
    for path, i in (
        ("brake.linings.angle[19]", 19),
        ("brake.linings.angle[-20]", 0),
        ("brake.linings.angle[-1]", 19),
    ):
        for value in (0.1, "0.1 rad", np.asarray(0.1), jnp.asarray(0.1)):
            found = np.asarray(sb.with_values(scene, {path: value}).brake.linings.angle)
            assert found[i] == 0.1
            all_equal(np.delete(found, i), np.delete(angle, i))
    assert np.all(scene.brake.linings.angle == angle)  # the scene itself stays
    whole = sb.with_values(
        scene, {"brake.linings.angle": jnp.asarray(0.1)}
    ).brake.linings.angle
    assert isinstance(whole, jax.Array)
    assert whole.tolist() == [0.1] * 20
    assert (
        sb.with_values(scene, {"brake.band.stiffness": None}).brake.band.stiffness
        is None
    )
    elastic = sb.with_values(stop_scene(C=None), {"brake.band.stiffness": 3e5})
    assert float(elastic.brake.band.stiffness) == 3e5
    for values in (
        {"brake.linings.angle[20]": 0.1},
        {"brake.linings.angle[-21]": 0.1},
        {"brake.linings.angle[3": 0.1},
        {"initial.omega[0]": 0.1},
        {"brake.linings.angle[0]": [0.1, 0.2]},
        {"brake.linings.angle[0]": None},
        {"brake.linings.angle": ["10 deg", "12 deg"]},
        {"brake.linings.angle": [[0.1], [0.1, 0.2]]},
        {"initial.omega": None},
        {"initial.omega": "20 kN"},
    ):
        assert paths_of(sb.with_values, scene, values) == [*values]
    # a unit was given: there is nothing to guess
    (fault,) = faults_of(sb.with_values, scene, {"brake.linings.angle": "700 deg"})
    assert fault.hint.endswith("≤ 3.14159 rad")


def test_one_number_or_the_other():
    """Of two numbers that stand for each other an edit leaves exactly one."""
    cylinder = sb.loads.Cylinder("8 bar", diameter="200 mm")
    scene = stop_scene(lever=cylinder)
    area = "duty.slack_tension.area"
    diameter = "duty.slack_tension.diameter"
    assert (
        float(
            sb.with_values(
                scene, {diameter: None, area: 0.03}
            ).duty.slack_tension.piston_area
        )
        == 0.03
    )
    for values in ({diameter: None}, {area: 0.03}):
        assert paths_of(sb.with_values, scene, values) == [diameter]
    spoiled = eqx.tree_at(lambda s: s.initial.omega, scene, None)
    assert paths_of(sb.simulate, spoiled) == ["initial.omega"]


def test_law_in_the_place_of_a_number():
    scene = layered_stop()
    path = "heat.links[0].coefficient"
    law = sb.thermal.SpeedCoefficient(5.0, 2.0, 0.8)
    blown = sb.with_values(scene, {path: law, "initial.omega": np.asarray(3.0)})
    assert (blown.heat.links[0].coefficient, float(blown.initial.omega)) == (law, 3.0)
    assert (
        float(
            sb.with_values(blown, {f"{path}.at_rest": 6.0})
            .heat.links[0]
            .coefficient.at_rest
        )
        == 6.0
    )
    other = {path: np.asarray(60.0), "brake.pulley.inertia": np.asarray(700.0)}
    still = sb.with_values(blown, other)
    assert (
        float(still.heat.links[0].coefficient),
        float(still.brake.pulley.inertia),
    ) == (60.0, 700.0)
    assert paths_of(sb.with_values, blown, other | {f"{path}.at_rest": 6.0})


def test_count_of_linings_keeps_the_wrap():
    scene = stop_scene()
    path = "brake.linings.count"
    for count in (15, 15.0, np.asarray(15.0)):
        fewer = sb.with_values(scene, {path: count, "initial.omega": 3.0})
        all_near(fewer.brake.linings.angle, np.full(15, np.radians(270.0) / 15), 1e-15)
        assert float(fewer.initial.omega) == 3.0
    each = sb.with_values(scene, {"brake.linings.area": np.full(20, 0.02)})
    all_equal(sb.with_values(each, {path: 3}).brake.linings.area, np.full(3, 0.02))
    one = sb.with_values(sb.with_values(scene, {"brake.linings.area": 0.02}), {path: 2})
    assert (one.brake.linings.count, np.shape(one.brake.linings.area)) == (2, ())
    for wrong in (0, 2.5, 10_001, [3, 4], "many", None):
        assert paths_of(sb.with_values, scene, {path: wrong}) == [path]
    unequal = sb.with_values(scene, {"brake.linings.angle[3]": 0.1})
    heated = rigid_stop(fading(), lump())
    assert sb.with_values(heated, {path: 10}).brake.linings.count == 10
    for given in (unequal, staged_scenes.stop(preload=np.full(8, 900.0))):
        assert paths_of(sb.with_values, given, {path: 10})
