"""Values in every usual form: numbers, lists, arrays, texts with units, numbers for parts; what is refused at once."""

import inspect

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pandas as pd
import pytest
import staged_scenes
from heat_scenes import fading, layered_stop, lump, rigid_stop
from stop_scenes import stop_scene

import simbrake as sb
from simbrake._base._faults import Fault, require_not_negative, require_positive, require_share
from simbrake._base._part import (
    all_in_range,
    faults_of_values,
)
from simbrake._base._quantity import (
    NumberReader,
    Quantity,
    as_number,
    example,
    faults_of_tolerance,
    has_units,
    in_si,
    positive,
    shown,
)
from simbrake._run._edit import parse_assignments, read_numbers, unknown_paths


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
    for words in parts:
        assert words in str(caught.value)


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


# --- numbers by path --------------------------------------------------------------------------------------------------


def told(call, *arguments):
    with pytest.raises(sb.InputError) as caught:
        call(*arguments)
    return [str(fault) for fault in caught.value.faults]


def test_assignments_are_read_as_they_are_written():
    read = parse_assignments([" initial.omega = 2e1 ", "duty.load.mass=80 t", "brake.band.stiffness=None", "a=b=c"])
    assert read == {"initial.omega": 20.0, "duty.load.mass": "80 t", "brake.band.stiffness": None, "a": "b=c"}
    for text in ("initial.omega", "=3", "initial.omega=", " = "):
        assert told(parse_assignments, [text])[0].startswith(f"{text}: is not of the form path=value"), text
    assert len(told(parse_assignments, ["a", "b=1", "=c"])) == 2


def test_entries_and_absent_numbers_by_path():
    scene = stop_scene()
    angle = np.asarray(scene.brake.linings.angle)
    for path, i in (("brake.linings.angle[19]", 19), ("brake.linings.angle[-20]", 0), ("brake.linings.angle[-1]", 19)):
        for value in (0.1, "0.1 rad", np.asarray(0.1), jnp.asarray(0.1)):
            found = np.asarray(sb.with_values(scene, {path: value}).brake.linings.angle)
            assert found[i] == 0.1
            np.testing.assert_array_equal(np.delete(found, i), np.delete(angle, i))
    assert np.all(scene.brake.linings.angle == angle)  # the scene itself stays
    whole = sb.with_values(scene, {"brake.linings.angle": jnp.asarray(0.1)}).brake.linings.angle
    assert isinstance(whole, jax.Array)
    assert whole.tolist() == [0.1] * 20
    assert sb.with_values(scene, {"brake.band.stiffness": None}).brake.band.stiffness is None
    assert float(sb.with_values(stop_scene(C=None), {"brake.band.stiffness": 3e5}).brake.band.stiffness) == 3e5
    assert sb.with_values(scene, {"brake.pulley.width": None}).brake.pulley.width is None
    for values, words in (
        ({"brake.linings.angle[20]": 0.1}, "there is no entry 20 — brake.linings.angle has 20 entries, from 0"),
        ({"brake.linings.angle[-21]": 0.1}, "there is no entry -21"),
        ({"initial.omega[0]": 0.1}, "there is no entry 0 — initial.omega has 0 entries"),
        ({"brake.linings.angle[0]": [0.1, 0.2]}, "one number is needed for one entry"),
        ({"brake.linings.angle[0]": None}, "one number is needed for one entry"),
        ({"initial.omega": None}, "cannot be absent — give a number"),
        ({"initial.omega": "20 kN"}, "'kN'"),
    ):
        (text,) = told(sb.with_values, scene, values)
        assert words in text, values
    assert told(sb.with_values, scene, {"brake.linings.angle[3": 0.1})[0].startswith("brake.linings.angle[3: there is")


def test_another_law_in_the_place_of_a_number_brings_its_own_numbers():
    scene, path = layered_stop(), "heat.links[0].coefficient"
    law = sb.thermal.SpeedCoefficient(5.0, 2.0, 0.8)
    blown = sb.with_values(scene, {path: law, "initial.omega": np.asarray(3.0)})
    assert (blown.heat.links[0].coefficient, float(blown.initial.omega)) == (law, 3.0)
    assert float(sb.with_values(blown, {f"{path}.at_rest": 6.0}).heat.links[0].coefficient.at_rest) == 6.0
    other = {path: np.asarray(60.0), "brake.pulley.inertia": np.asarray(700.0)}
    still = sb.with_values(blown, other)
    assert (float(still.heat.links[0].coefficient), float(still.brake.pulley.inertia)) == (60.0, 700.0)
    assert (
        f"{path}.at_rest: there is no such number" in told(sb.with_values, blown, other | {f"{path}.at_rest": 6.0})[0]
    )


def test_another_number_of_equal_linings_keeps_the_wrap():
    scene, path = stop_scene(), "brake.linings.count"
    for count in (15, 15.0, np.asarray(15.0)):
        fewer = sb.with_values(scene, {path: count, "initial.omega": 3.0})
        np.testing.assert_allclose(fewer.brake.linings.angle, np.full(15, np.radians(270.0) / 15), rtol=1e-15)
        assert float(fewer.initial.omega) == 3.0
    each = sb.with_values(scene, {"brake.linings.area": np.full(20, 0.02)})
    np.testing.assert_array_equal(sb.with_values(each, {path: 3}).brake.linings.area, np.full(3, 0.02))
    one = sb.with_values(sb.with_values(scene, {"brake.linings.area": 0.02}), {path: 2})
    assert (one.brake.linings.count, np.shape(one.brake.linings.area)) == (2, ())
    for wrong in (0, 2.5, 10_001, [3, 4], "many", None):
        (text,) = told(sb.with_values, scene, {path: wrong})
        assert text.startswith(f"{path}: {wrong} is not a number of linings"), wrong
    unequal = sb.with_values(scene, {"brake.linings.angle[3]": 0.1})
    heated = rigid_stop(fading(), lump())
    assert sb.with_values(heated, {path: 10}).brake.linings.count == 10
    (text,) = told(sb.with_values, unequal, {path: 10})
    assert "linings differ, or other parts have a number for each" in text
    preloads = staged_scenes.stop(preload=np.full(8, 900.0))
    assert "other parts have a number for each" in told(sb.with_values, preloads, {path: 10})[0]


def test_unknown_paths_have_the_same_name_elsewhere_and_then_like_ones_as_hints():
    scene = stop_scene()
    (text,) = told(sb.with_values, scene, {"pulley.radius": 1.0})
    nearest = text.partition("nearest: ")[2].split(", ")
    assert nearest[:2] == ["brake.pulley.radius", "brake.band.radius"]
    assert len(nearest) <= 4
    assert "there is no such number in the scene — there are: " in told(sb.with_values, scene, {"§§": 1.0})[0]
    assert unknown_paths(scene, ["initial.omega", "brake.linings.angle[2]", "initial.omeg", "nothing[3]"]) == [
        "initial.omeg",
        "nothing[3]",
    ]


def test_numbers_of_one_path_have_units_all_or_none():
    scene, mass = stop_scene(load=sb.TorqueLoad(5e3)), "brake.pulley.inertia"
    assert read_numbers(scene, mass, ["1", "2e3"]) == [1.0, 2e3]
    assert read_numbers(scene, "initial.omega", ["60 rpm", "2 rad/s"]) == [pytest.approx(2 * np.pi), 2.0]
    assert read_numbers(scene, "brake.linings.angle[3]", ["90 deg"]) == [pytest.approx(np.pi / 2)]
    assert read_numbers(scene, "brake.linings.angle", ["1", "2"]) == [1.0, 2.0]
    assert told(read_numbers, scene, "end_time", ["3 s", " 4 ", "5"]) == [
        "end_time: 4 has no unit, others have one — give all of them their unit"
    ]
    assert "'kg' is not a unit" in told(read_numbers, scene, "end_time", ["3 kg", "4"])[0]
    assert len(told(read_numbers, scene, "end_time", ["3 kg", "4"])) == 1
    assert "no such number" in told(read_numbers, scene, "omega[3]", ["3"])[0]


# --- numbers, their ranges and the words about them -------------------------------------------------------------------

FREE, POSITIVE = Quantity("N", "force"), Quantity("kg", "mass", 0.0, open_low=True)
SHARE, LENGTH = Quantity("1", "share", 0.0, 1.0), Quantity("m", "length", 5.0)
ANGLE, TIME = Quantity("rad", "wrap", 0.0, 6.0, open_low=True), Quantity("s", "time")


@pytest.mark.parametrize(
    ("about", "inside", "outside", "words"),
    [
        (FREE, (-1e40, 0.0, 1e40), (-1.05e40, 1.05e40, np.nan, np.inf), "finite"),
        (POSITIVE, (1.5e-40, 1e40), (1e-40, 0.0, -1.0, 1.05e40, np.nan), "> 0"),
        (SHARE, (0.0, 0.5, 1.0), (-1e-9, 1.001), "≥ 0 and ≤ 1"),
        (LENGTH, (5.0, 1e6), (4.9, 1.05e6), "≥ 5"),
        (ANGLE, (1e-30, 6.0), (0.0, 6.1), "> 0 and ≤ 6"),
        (TIME, (-1e12, 1e12), (-1.05e12, 1.05e12), "finite"),
        (Quantity("N", "force", high=3.0), (-1e40, 3.0), (3.1,), "≤ 3"),
        (Quantity("N", "force", 2.0, open_low=True), (2.1, 1e40), (2.0,), "> 2"),
    ],
)
def test_ranges_of_numbers(about, inside, outside, words):
    assert [about.admits_one(x) for x in (*inside, *outside)] == [True] * len(inside) + [False] * len(outside)
    assert about.admits(np.asarray([*inside, *outside])).tolist() == [True] * len(inside) + [False] * len(outside)
    assert about.range == words


def test_what_is_wanted_of_a_number_in_words():
    for about, value, words in (
        (FREE, 1e41, "at most 1e+40 in magnitude"),
        (FREE, -1e41, "at most 1e+40 in magnitude"),
        (FREE, np.inf, "finite"),
        (LENGTH, 2e6, "at most 1e+06 in magnitude"),
        (LENGTH, 3.0, "≥ 5"),
        (POSITIVE, 1e-41, "> 1e-40"),
        (POSITIVE, 0.0, "> 0"),
        (POSITIVE, -1.0, "> 0"),
        (SHARE, 1.5, "≥ 0 and ≤ 1"),
        (Quantity("N", "force", 1.0, open_low=True), 0.5, "> 1"),
    ):
        assert about.wanted(value) == words
    for about, value, words in (
        (ANGLE, 270.0, '; did you mean "270 deg"?'),
        (ANGLE, 400.0, ""),  # not in degrees either
        (ANGLE, 3.0, ""),
        (Quantity("rad", "angle", 0.0), 270.0, ""),
        (Quantity("m", "length", 0.0, 6.0), 270.0, ""),
        (Quantity("rad", "angle", 0.1, 1.0), 2.0, ""),  # as likely radians
    ):
        assert about.in_degrees(value) == words
    about = positive("m", "thickness", 3.0)
    assert about == Quantity("m", "thickness", 0.0, 3.0, open_low=True)
    fields = ("open_low", "difference", "many", "may_be_empty")
    assert [getattr(FREE, name) for name in fields] == [False] * 4


def test_what_counts_as_a_number():
    array = np.asarray([1.0, 2.0])
    assert as_number(array) is array
    frame = pd.Series([1, 2])
    for given in ([1, 2], (1.0, 2), np.asarray([1, 2]), np.asarray([1, 2], np.uint8), frame, np.float32([1, 2])):
        found = as_number(given)
        assert (type(found), found.dtype, found.tolist()) == (np.ndarray, np.float64, [1.0, 2.0])
    assert (as_number(3).dtype, float(as_number(3))) == (np.float64, 3.0)
    whole, short = jnp.asarray([1, 2]), jnp.asarray(0.5, jnp.float32)
    assert (as_number(whole).dtype, as_number(short).dtype) == (np.float64, np.float32)
    traced = as_number([jnp.asarray(1.0), 2.0])
    assert isinstance(traced, jax.Array)
    assert traced.tolist() == [1.0, 2.0]
    for other in (True, None, "3", {}, pd.Series, ["a"], [1, [2, 3]], np.asarray([True]), np.asarray(["a"]), 1j):
        assert as_number(other) is other
    texts = ("1 m", ["1 m", 2], (1, "2"), [1, 2], 3, {"1"}, None)
    assert [has_units(x) for x in texts] == [True, True, True, False, False, False, False]
    metres = Quantity("m", "length", many=True)
    assert in_si("2 mm", metres) == 0.002
    assert in_si((1, "2 mm"), metres).tolist() == in_si([1, "2 mm"], metres).tolist() == [1.0, 0.002]
    assert in_si(3, metres).dtype == np.float64
    assert in_si("2 kg", metres) == "2 kg"
    assert in_si("2", Quantity("SI", "level")) == "2"


def test_tolerances_and_arguments_of_formulas():
    for good in (1e-8, 1.05e-15, 0.099, np.float64(1e-3), np.asarray([1e-8, 1e-3])):
        assert faults_of_tolerance(good) == []
    for bad in (
        1e-15,
        0.1,
        0.105,
        1.0,
        -1.0,
        np.nan,
        "1e-8",
        None,
        np.asarray([1e-8, 0.105]),
        np.asarray([1e-15, 1e-3]),
    ):
        assert faults_of_tolerance(bad) == [Fault("rtol", f"{shown(bad)} is out of range", "must be > 1e-15 and < 0.1")]
    jax.eval_shape(lambda rtol: faults_of_tolerance(rtol) or rtol, 3.0)
    checks = ((require_positive, "positive"), (require_not_negative, "at least 0"), (require_share, "between 0 and 1"))
    values = (0.5, 0.0, 1.0, 1.5, -0.5, np.inf, np.nan, [0.5, -1.0], None)
    fits = {0: "yn yynnnny".replace(" ", ""), 1: "yyyynnnny", 2: "yyynnnnny"}
    for i, (check, words) in enumerate(checks):
        for value, fit in zip(values, fits[i], strict=True):
            if fit == "y":
                check(x=value)
            else:
                with pytest.raises(ValueError, match="must be") as told:
                    check(y=0.5, x=value, z=value)
                assert str(told.value) == f"x = {value} must be {words}; z = {value} must be {words}"


def read(value, about, si=None):
    """The number that is read, or what is said of it."""
    reader = NumberReader()
    found = reader.number(value, about, "here", about.unit if si is None else si)
    return str(reader.faults[0]) if reader.faults else found if isinstance(found, float) else found.tolist()


def test_numbers_are_read_and_what_is_wrong_is_said_in_words():
    many = Quantity("rad", "wrap", 0.0, 6.0, many=True)
    blend = Quantity("K", "blend", 0.0, difference=True)
    hint = 'mass, in SI units or with its unit, as in "1.5 kg"'
    for value, about, wanted in (
        (2, POSITIVE, 2.0),
        ("2 t", POSITIVE, 2000.0),
        ("2", POSITIVE, 2.0),
        ("[1, 2] rad", many, [1.0, 2.0]),
        (["90 deg", 1], many, [np.pi / 2, 1.0]),
        ("[]", many, []),
        ("20 K", blend, 20.0),
        ("20 degC", Quantity("K", "temperature"), 293.15),
        ("20 degC", blend, "here: '20 degC' is a temperature, not a difference of two — give it in K"),
        ("[1, x] rad", many, "here: '[1, x] rad' is not a list of numbers — as in \"[0.2, 0.3] rad\""),
        (
            '["a"] rad',
            many,
            "here[0]: 'a' is not a number with a unit — wrap, in SI units or with its unit, as in \"270 deg\"",
        ),
        ([1], POSITIVE, f"here: is a list — give one number: {hint}"),
        (True, POSITIVE, f"here: True is not a number — {hint}"),
        (None, POSITIVE, f"here: None is not a number — {hint}"),
        ("heavy", POSITIVE, f"here: 'heavy' is not a number with a unit — {hint}"),
        (10**400, POSITIVE, f"here: {'1' + '0' * 56}… is too large"),
        ("2 m", POSITIVE, "here: '2 m': 'm' is not a unit of mass, which is in kg — known here: "),
        (-2.0, POSITIVE, "here: -2.0 is out of range — mass must be > 0 kg"),
        ("-2 t", POSITIVE, "here: '-2 t' = -2000 kg is out of range — mass must be > 0 kg"),
        ("-2 kg", POSITIVE, "here: '-2 kg' is out of range — mass must be > 0 kg"),
        ("1e999 kg", POSITIVE, "here: '1e999 kg' is out of range — mass must be > 0 kg"),
        (1.5, SHARE, "here: 1.5 is out of range — share must be ≥ 0 and ≤ 1"),
        ([1, 270], many, 'here[1]: 270 is out of range — wrap must be ≥ 0 and ≤ 6 rad; did you mean "270 deg"?'),
    ):
        found = read(value, about)
        assert found == wanted or (isinstance(wanted, str) and wanted.endswith("here: ") and found.startswith(wanted))
    assert read(-1.0, Quantity("SI", "level", 0.0)) == "here: -1.0 is out of range — level must be ≥ 0"
    reader = NumberReader()
    reader.fault("", "is odd")
    assert reader.faults == [Fault("scene", "is odd")]


def test_values_are_shortened_and_examples_given_in_messages():
    assert shown({"a": 1}) == "a table"
    assert shown("x" * 58) == f"'{'x' * 58}'"
    assert shown("x" * 59) == f"'{'x' * 56}…"
    assert shown(np.eye(2)) == "array([[1., 0.], [0., 1.]])"
    assert [example(si) for si in ("1", "SI")] == ["", ""]
    assert example("N") == ', in SI units or with its unit, as in "120 kN"'
    assert example("J") == ', in SI units or with its unit, as in "1.5 J"'
