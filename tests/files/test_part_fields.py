"""Fields of parts: their kinds, names and places, values and lists in them, what is said of each."""

import dataclasses
import inspect
from typing import Annotated, Any

import equinox as eqx
import jax
import numpy as np
import pytest
from stop_scenes import stop_scene
from test_values import ANGLE, POSITIVE

import simbrake as sb
from simbrake._base._part import (
    Leaf,
    Part,
    Whole,
    _faults_of_leaf,
    all_in_range,
    alternatives,
    as_arrays,
    as_part,
    faults_of_sizes,
    faults_of_whole,
    part,
    parts_below,
    quantity,
    takes_values,
    whole,
)
from simbrake._base._quantity import (
    Over,
    Quantity,
    positive,
)


class Probe(Part):
    mass: float = quantity("kg", "mass", positive=True)
    shift: Any = quantity("K", "shift", low=-5.0, high=5.0, difference=True, default=None)
    rows: Any = quantity("m", "rows", many=True, default=())
    gaps: Any = quantity("m", "gaps", low=0.0, many=Over.GAPS, default=1.0)
    each: Any = quantity("m", "each", many=True, default=1.0)
    law: sb.profiles.AbstractProfile | None = part(sb.profiles.AbstractProfile, "N", default=None)
    own: sb.profiles.AbstractProfile = part(sb.profiles.AbstractProfile, default=0.0)
    count: int = whole("count", low=2, high=5, default=3)


def said_of(make):
    with pytest.raises(sb.InputError) as caught:
        make()
    return [str(fault) for fault in caught.value.faults]


def test_fields_have_units_ranges_and_readable_types():
    fields = {field.name: field for field in dataclasses.fields(Probe)}
    assert {name: field.metadata.get("quantity") for name, field in fields.items() if "quantity" in field.metadata} == {
        "mass": Quantity("kg", "mass", 0.0, None, True),
        "shift": Quantity("K", "shift", -5.0, 5.0, False, True),
        "rows": Quantity("m", "rows", many=True, may_be_empty=True),
        "gaps": Quantity("m", "gaps", 0.0, many=Over.GAPS, may_be_empty=True),
        "each": Quantity("m", "each", many=True),
    }
    assert fields["count"].metadata["whole"] == Whole("count", 2, 5)
    assert fields["count"].metadata["static"]
    assert whole("n").metadata == {"whole": Whole("n", 1, 100_000), "static": True}
    shown_types = {name: str(one.annotation) for name, one in inspect.signature(Probe).parameters.items()}
    law = "<class 'AbstractProfile | float | None'>"
    assert [text.removeprefix("<class '").removesuffix("'>") for text in shown_types.values()] == [
        "float",
        "float | None",
        "float | Sequence[float]",
        "float | Sequence[float]",
        "float | Sequence[float]",
        law.removeprefix("<class '").removesuffix("'>"),
        "AbstractProfile | float",
        "<class 'int'>".removeprefix("<class '").removesuffix("'>"),
    ]


def test_a_part_reads_its_values_or_says_what_is_wrong():
    made = Probe("2 t", "3 K", "[1, 2] mm", law="2 kN", own=4)
    assert (float(made.mass), float(made.shift), made.rows.tolist()) == (2e3, 3.0, [1e-3, 2e-3])
    assert (float(made.law.level), float(made.own.level), made.count) == (2e3, 4.0, 3)
    assert said_of(lambda: Probe(None, "3 degC", [1, "x"], [-1.0, 1.0], law=Probe, own="2 kN", count=6)) == [
        'Probe.mass: is missing — mass, in SI units or with its unit, as in "1.5 kg"',
        "Probe.shift: '3 degC' is a temperature, not a difference of two — give it in K",
        "Probe.rows[1]: 'x' is not a number with a unit — rows, in SI units or with its unit, as in \"590 mm\"",
        "Probe.gaps[0]: -1 m is out of range — gaps must be ≥ 0 m",
        "Probe.law: <class 'test_part_fields.Probe'> does not fit here — give a Profile",
        "Probe.own: '2 kN' cannot be read here, as the unit depends on the field that holds it — "
        "give it in SI units, without a unit",
        "Probe.count: 6 is out of range — count must be 2…5",
    ]
    (said,) = said_of(lambda: Probe(1.0, law="x"))
    assert said.startswith("Probe.law: 'x' is not a number with a unit — ")
    assert said.endswith('as in "120 kN"')
    assert repr(Probe(1e5, 3.0)).startswith("Probe(mass=100 t, shift=3 K, gaps=1 m")
    page = " ".join(sb.LinearFade(1e-3, "120 degC", blend=10.0)._repr_html_().split())
    assert "120 °C" in page
    assert "10 K" in page


def test_numbers_make_parts_where_they_can():
    profile, family = sb.Constant(3.0), sb.profiles.AbstractProfile
    for given in (None, profile, len, "2 kg", "2 N"):
        assert as_part(given, family) is given
    assert as_part(3.0, sb.Pulley) == 3.0  # no number makes a pulley
    assert float(as_part(3, family).level) == 3.0
    assert float(as_part("2 kN", family, "N").level) == 2e3
    assert as_part("2 kg", family, "N") == "2 kg"
    assert [alternatives(hint) for hint in (int, int | None)] == [(int,), (int, type(None))]


def test_whole_numbers():
    for value, low, said in (
        (3, 1, []),
        (np.int64(5), 2, []),
        (2, 2, []),
        (True, 1, ["n: True is not a whole number — count, as in 1"]),
        (2.0, 2, ["n: 2.0 is not a whole number — count, as in 2"]),
        ("3", 0, ["n: '3' is not a whole number — count, as in 1"]),
        (6, 2, ["n: 6 is out of range — count must be 2…5"]),
        (1, 2, ["n: 1 is out of range — count must be 2…5"]),
    ):
        assert [str(fault) for fault in faults_of_whole("n", value, Whole("count", low, 5))] == said


@pytest.mark.parametrize(
    ("value", "about", "said"),
    [
        (np.asarray(3.0), POSITIVE, ""),
        (3, POSITIVE, ""),
        (np.asarray([1, 2], np.int32), Quantity("m", "rows", many=True), ""),
        (jax.ShapeDtypeStruct((), np.float64), POSITIVE, ""),
        (np.zeros(0), Quantity("m", "rows", many=True, may_be_empty=True), ""),
        (np.asarray(3.0, np.float32), POSITIVE, "is float32, in which events cannot be located — give mass as float64"),
        ("3", POSITIVE, "'3' is not a number — give a number in kg"),
        (None, Quantity("SI", "level"), "None is not a number — give a number in SI units"),
        (np.asarray(["a"]), POSITIVE, "array(['a'], dtype='<U1') is not a number — give a number in kg"),
        (np.ones(2), POSITIVE, "has the shape (2,) — give one number"),
        (
            np.ones((1, 2)),
            Quantity("m", "rows", many=True),
            "has the shape (1, 2) — give one number, or a list of numbers",
        ),
        (np.zeros(0), Quantity("m", "rows", many=True), "is an empty list — give rows"),
        (np.asarray(-2.0), POSITIVE, "-2 kg is out of range — mass must be > 0 kg"),
        (270.0, ANGLE, '270 rad is out of range — wrap must be > 0 and ≤ 6 rad; did you mean "270 deg"?'),
    ],
)
def test_what_is_said_of_a_value_in_a_part(value, about, said):
    assert [str(fault) for fault in _faults_of_leaf(Leaf("a", value, about))] == ([f"a: {said}"] if said else [])


def test_the_first_bad_entry_of_a_list_is_named():
    many = Quantity("m", "rows", 0.0, many=True)
    for value, made, said in (
        (np.asarray([1.0, -2.0, -3.0]), True, "a[1]: -2 m is out of range — rows must be ≥ 0 m"),
        (
            np.asarray([[1.0, 2.0], [3.0, -4.0], [-5.0, 6.0]]),
            False,
            "a[1, 1]: -4 m is out of range — rows must be ≥ 0 m",
        ),
    ):
        assert [str(fault) for fault in _faults_of_leaf(Leaf("a", value, many), made=made)] == [said]


def test_lists_have_an_entry_for_each_lining_or_each_gap():
    for rows, gaps, each, said in (
        (1.0, 1.0, 1.0, []),
        ([1.0] * 4, [1.0] * 3, [1.0] * 4, []),
        (
            [1.0] * 3,
            [1.0] * 4,
            1.0,
            [
                "rows: does not fit 4 linings — give one number, or a list of 4",
                "gaps: does not fit 4 linings — give one number, or a list of 3",
            ],
        ),
    ):
        assert [str(fault) for fault in faults_of_sizes(Probe(1.0, None, rows, gaps, each), "", 4)] == said
    table = sb.PiecewiseLinear([0.0, 1.0, 2.0], [1.0, 2.0, 3.0])
    assert faults_of_sizes(table, "", 4) == []  # points of a table: any number


def test_parts_below_and_arrays_in_them():
    scene = stop_scene()
    found = {path: unit for path, _, unit in parts_below(scene)}
    assert (found[""], found["duty.slack_tension"], found["brake.pulley"]) == ("SI", "N", "SI")
    several = [path for path, _, _ in parts_below((scene.initial, [scene.duty]), "x")]
    assert several[:3] == ["x[0]", "x[1][0]", "x[1][0].slack_tension"]
    assert as_arrays(scene) is scene
    pair = (scene.initial, scene.duty)
    assert as_arrays(pair) is pair
    changed = as_arrays((eqx.tree_at(lambda i: i.omega, scene.initial, 3), scene.duty, "text"))
    assert (type(changed), changed[1] is scene.duty, changed[2]) == (tuple, True, "text")
    assert (type(changed[0].omega), changed[0].omega.dtype) == (np.ndarray, np.float64)
    assert all_in_range(Probe(1.0))
    assert not all_in_range(eqx.tree_at(lambda p: p.each, Probe(1.0), np.zeros(0)))
    assert all_in_range(eqx.tree_at(lambda p: p.gaps, Probe(1.0), np.zeros(0)))


@takes_values
def built(
    mass: Annotated[float, positive("kg", "mass")],
    rows: Annotated[list, Quantity("m", "rows", many=True)] = (),
    law: sb.profiles.AbstractProfile | None = None,
    count: Annotated[int, Whole("count", 1, 4)] = 2,
    name: str = "x",
) -> tuple:
    """What it is given."""
    return mass, rows, law, count, name


def test_functions_read_their_values_as_parts_do():
    assert built("2 t") == (2e3, (), None, 2, "x")
    mass, rows, law, count, name = built(1, rows="[1, 2] mm", law=3.0, count=4, name="y")
    assert (mass, rows, float(law.level), count, name) == (1, [1e-3, 2e-3], 3.0, 4, "y")
    assert built(1.0, None, law)[1:3] == (None, law)
    assert said_of(lambda: built("-2 t", [1, "x"], count=5)) == [
        "mass: '-2 t' = -2000 kg is out of range — mass must be > 0 kg",
        "rows[1]: 'x' is not a number with a unit — rows, in SI units or with its unit, as in \"590 mm\"",
        "count: 5 is out of range — count must be 1…4",
    ]
    signature = str(inspect.signature(built)).replace("simbrake.profiles.", "")
    assert signature.startswith("(mass: float, rows: list = (), law: ")
    assert signature.endswith(", count: int = 2, name: str = 'x') -> tuple")
    assert built.__doc__ == "What it is given."
