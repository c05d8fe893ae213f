"""Values in every usual form: numbers, lists, arrays, texts with units, numbers for parts; what is refused at once."""

import inspect

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pandas as pd
import pytest
import staged_scenes
from helpers import stop_scene

import simbrake as sb
from simbrake._base._part import all_in_range, faults_of_values


@pytest.mark.parametrize(
    "value", [0.59, "590 mm", "0.59", np.float64(0.59), np.asarray(0.59), jnp.asarray(0.59), np.float32(0.59)]
)
def test_a_number_in_any_form(value):
    radius = sb.Pulley(value, 1200).radius
    assert radius.dtype == np.float64
    assert float(radius) == pytest.approx(0.59, rel=1e-15 if np.asarray(value).dtype != np.float32 else 1e-7)


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
    np.testing.assert_array_equal(preload, [10.0, 20.0])


def test_texts_and_numbers_make_the_same_scene():
    def scene(wrap, friction, tension, load):
        linings = sb.uniform_linings(20, wrap, friction)
        brake = sb.Brake(sb.Pulley(0.59, 1200), sb.Band("612 mm"), linings)
        return sb.Scene(brake, sb.Duty(tension, load), sb.Initial("190 rpm"), 20)

    long = scene(1.5 * np.pi, sb.ConstantFriction(0.35), sb.Constant(8000.0), sb.TorqueLoad(sb.Constant(1000.0)))
    for short in (scene("270 deg", 0.35, 8000, 1000), scene("270 deg", "35 %", "8 kN", "1 kN*m")):
        assert jax.tree.structure(short) == jax.tree.structure(long)
        jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-15), short, long)


def test_numbers_stand_for_parts_of_every_family():
    assert isinstance(sb.TorqueLoad(29430.0).profile, sb.Constant)
    assert isinstance(sb.Wear(1e-14).rate, sb.wear.ConstantWear)
    assert isinstance(sb.thermal.FrictionHeat("rim", None, 1.0).partition, sb.thermal.ConstantPartition)
    assert isinstance(sb.ForceDuty("12 kN", 0).load, sb.TorqueLoad)
    assert isinstance(sb.friction.ProductFriction(0.4, (sb.LinearFade(1e-3, "20 degC"),)).base, sb.ConstantFriction)
    assert isinstance(
        sb.lumped_heat(rim=1e5, partition=0.9, rim_cooling=20.0).friction.partition, sb.thermal.ConstantPartition
    )


@pytest.mark.parametrize(
    ("make", "parts"),
    [
        (lambda: sb.Pulley(-0.59, float("nan")), ("Pulley.radius: -0.59 m", "Pulley.inertia: nan", "must be > 0 m")),
        (lambda: sb.Pulley("590 kg", 1200), ("Pulley.radius: '590 kg'", "in m", "known here: m, cm, mm")),
        (lambda: sb.Pulley("wide", True), ("'wide' is not a number", 'as in "590 mm"', "Pulley.inertia: True is not")),
        (lambda: sb.Pulley(None, 1200, {}), ("Pulley.radius: is missing", "Pulley.width: a table is not a number")),
        (lambda: sb.Duty("24 mm", 0), ("Duty.slack_tension", "'mm' is not a unit", "in N")),
        (lambda: sb.Constant("24 kN"), ("Constant.level: '24 kN' cannot be read", "give it in SI units")),
        (
            lambda: sb.Brake(sb.Pulley(1, 1), 3.0, 0.35),
            ("Brake.band: 3.0 does not fit here", "give a Band", "Brake.linings: 0.35"),
        ),
        (lambda: sb.uniform_linings(0, "-1 rad", 0.3), ("count: 0 is out of range", "wrap: '-1 rad' is out of range")),
        (lambda: sb.thermal.Wall("w", sb.material("cast_iron"), 0.02, 1.0, 0), ("Wall.layers: 0 is out of range",)),
        (lambda: sb.Initial(jnp.float32(3)), ("Initial.omega: is float32",)),
    ],
)
def test_what_is_wrong_is_said_at_once(make, parts):
    with pytest.raises(sb.InputError) as caught:
        make()
    for part in parts:
        assert part in str(caught.value)


def test_what_is_put_in_later_is_taken_or_told():
    def put(value):
        return eqx.tree_at(lambda s: s.brake.pulley.inertia, stop_scene(C=None), value)

    times = [float(sb.simulate(put(J)).stopping_time) for J in (2400.0, 2400, np.asarray(2400.0))]
    assert times[0] == times[1] == times[2]
    assert times[0] == pytest.approx(2400.0 / 800.0 * float(sb.simulate(stop_scene(C=None)).stopping_time), rel=1e-9)
    for bad in (-1.0, "1200", float("inf")):
        with pytest.raises(sb.InputError, match=r"brake\.pulley\.inertia"):
            sb.simulate(put(bad))


def test_what_cannot_be_read_by_path_is_told_with_what_is_out_of_range():
    wrong = {"duty.load.torque": "abc", "brake.pulley.inertia": -3.0, "initial.omega": "20 rad/s"}
    with pytest.raises(sb.InputError) as error:
        sb.with_values(stop_scene(), wrong)
    assert {"brake.pulley.inertia"} < {fault.path for fault in error.value.faults}
    assert len(error.value.faults) == 2


def test_ranges_in_one_go_say_the_same_as_number_by_number():
    """Every number of a staged scene with heat at its bounds, beyond them and out of all range."""
    scene = staged_scenes.stop(stiffness=1e5)
    places = [leaf for leaf in sb.files.leaves(scene) if leaf.value is not None]
    assert all_in_range(scene)
    seen = set()
    for leaf in places:
        low, high = leaf.about.low, leaf.about.high
        ends = [x + d for x in (low, high) if x is not None for d in (-1e-9, 0.0, 1e-9)]
        for value in (*ends, 1e41, -1e41, np.nan, np.inf):
            other = sb.with_values(scene, {leaf.path: value})
            assert all_in_range(other) == (not faults_of_values(other)), (leaf.path, value)
            seen.add(all_in_range(other))
    assert seen == {True, False}
    assert not all_in_range(eqx.tree_at(lambda s: s.end_time, scene, 3.0))  # looked at number by number
    assert not all_in_range(eqx.tree_at(lambda s: s.end_time, scene, np.zeros(2)))


def test_what_does_not_fit_together_is_told_again_for_other_numbers():
    scene, wide = stop_scene(), {"brake.linings.angle": 0.4}
    for _ in range(2):
        sb.check(scene)
        with pytest.raises(sb.InputError, match="the linings span"):
            sb.simulate(sb.with_values(scene, wide))
        with pytest.raises(sb.InputError, match="is not after the start"):
            sb.simulate(sb.with_values(scene, {"end_time": 0.0}))
        with pytest.raises(sb.InputError, match="is inside the track"):
            sb.simulate(sb.with_values(scene, {"brake.band.radius": 0.1}))


def test_numbers_by_path_in_loops_are_those_one_by_one():
    scene = stop_scene()
    changed = {"initial.omega": 3, "brake.linings.angle": 0.2, "brake.linings.angle[2]": 0.1, "end_time": np.float64(2)}
    quick, slow = sb.with_values(scene, changed), scene
    for path, value in changed.items():
        slow = sb.with_values(slow, {path: np.asarray(value, np.float64)})  # arrays go the longer way
    assert eqx.tree_equal(quick, slow)
    assert {np.asarray(x).dtype for x in jax.tree.leaves(quick)} == {np.dtype(np.float64)}
    assert float(scene.initial.omega) != 3.0


def test_traced_values_pass():
    def mass(radius):
        return sb.Pulley(radius, radius**2).inertia

    assert jax.grad(mass)(3.0) == 6.0
    np.testing.assert_array_equal(jax.vmap(mass)(jnp.asarray([1.0, -2.0])), [1.0, 4.0])


def test_signatures_are_readable():
    assert str(inspect.signature(sb.Pulley)) == "(radius: float, inertia: float, width: float | None = None) -> None"
    for build in (sb.uniform_linings, sb.ramp, sb.lumped_heat, sb.layered_heat, sb.programme_scene, sb.history):
        assert "Quantity" not in str(inspect.signature(build))
        assert "Whole" not in str(inspect.signature(build))
