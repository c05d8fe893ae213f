"""Words and numbers of the report: handy units, profiles and loads, every number of a scene with its meaning."""

import math

import numpy as np
import pytest
from heat_scenes import fading, rigid_stop

import simbrake as sb
from simbrake._base._table import digits, number, numbers
from simbrake._pages._rows import load_words, parts_of, profile_words


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (1.25e5, "N", "125 kN"),
        (0.0139, "s", "13.9 ms"),
        (3.5e-18, "s", "3.5·10⁻¹⁸ s"),
        (0.0, "N", "0 N"),
        (293.15, "K", "20 °C"),
        (math.pi / 4, "rad", "45°"),
        (18.8446, "rad", "18.8446 rad"),
        (1200.0, "kg*m^2", "1200 kg·m²"),
        (-2.5e-9, "1/K", "−2.5·10⁻⁹ 1/K"),
        (123456.7, "1", "123457"),
        (2.06e11, "Pa", "206 GPa"),
        (1e-12, "1", "10⁻¹²"),
        (1234567.0, "1", "1234570"),
        (None, "N", "—"),
        (math.inf, "s", "—"),
    ],
)
def test_handy_numbers(value, unit, text):
    assert str(number(value, unit)) == text


#: unit → magnitudes at which its name for reading changes, these names from the smallest on, and what they are in SI
NAMES = {
    "N": ([1e3, 1e6], {"N": 1, "kN": 1e3, "MN": 1e6}),
    "N*m": ([1e3, 1e6], {"N·m": 1, "kN·m": 1e3, "MN·m": 1e6}),
    "N/m": ([1e3, 1e6], {"N/m": 1, "kN/m": 1e3, "MN/m": 1e6}),
    "J": ([1e3, 1e7], {"J": 1, "kJ": 1e3, "MJ": 1e6}),
    "W": ([1e3, 1e6], {"W": 1, "kW": 1e3, "MW": 1e6}),
    "Pa": ([1e3, 1e5, 1e9], {"Pa": 1, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9}),
    "kg": ([1e4], {"kg": 1, "t": 1e3}),
    "m": ([1e-4, 0.1], {"µm": 1e-6, "mm": 1e-3, "m": 1}),
    "m^2": ([0.01], {"cm²": 1e-4, "m²": 1}),
    "s": ([1e-4, 0.1], {"µs": 1e-6, "ms": 1e-3, "s": 1}),
}
RIG_NAMES = {
    "N": ([4448.2216152605], {"lbf": 4.4482216152605, "klbf": 4448.2216152605}),
    "N*m": ([1e6], {"ft·lbf": 1.3558179483314, "ft·klbf": 1355.8179483314}),
    "J": ([1e3], {"ft·lbf": 1.3558179483314, "ft·klbf": 1355.8179483314}),
    "W": ([], {"hp": 745.69987158227}),
    "Pa": ([1e6], {"psi": 6894.7572931684, "ksi": 6894757.2931684}),
    "kg": ([], {"lb": 0.45359237}),
    "m": ([0.3], {"in": 0.0254, "ft": 0.3048}),
    "m^2": ([0.1], {"in²": 6.4516e-4, "ft²": 0.09290304}),
    "m/s": ([], {"ft/min": 0.00508}),
    "rad/s": ([], {"rpm": math.pi / 30}),
}


@pytest.mark.parametrize(("system", "table"), [("si", NAMES), ("rig", RIG_NAMES)])
def test_names_of_units_change_with_the_magnitude(system, table):
    for unit, (limits, names) in table.items():
        ends = [0.01 * (limits or [1e4])[0], *limits, 50 * (limits or [1e4])[-1]]
        for (name, si), low, high in zip(names.items(), ends, ends[1:], strict=False):
            for value in (1.001 * low, 0.999 * high):
                with sb.results.shown_in(system):
                    read, _, shown = str(number(value, unit, count=12)).partition(" ")
                assert shown == name
                assert float(read.replace("−", "-")) * si == pytest.approx(value, rel=1e-10)


def test_handy_arrays_and_differences():
    assert str(numbers(np.full(20, math.radians(13.5)), "rad")) == "20 × 13.5°"
    assert str(numbers([0.0, 0.35], "s")) == "0, 0.35 s"
    assert str(numbers(np.linspace(0.0, 4e3, 9), "N")) == "9 values from 0 to 4 kN"
    assert str(number(5.0, "K", absolute=False)) == "5 K"
    assert digits(-1e-12, 2) == "−10⁻¹²"
    exact = 0.1 + 0.2
    assert float(number(exact, "m").si) == exact


def test_equipment_has_every_number_of_a_scene():
    bodies = (sb.thermal.Lump("lining", 2e4), sb.thermal.Lump("rim", 1e5))
    friction = sb.thermal.FrictionHeat("rim", "lining", sb.thermal.ConstantPartition(0.0))
    heat = sb.Heat(bodies, friction=friction, rim="rim", linings="lining", permissible=304.0)
    scene = rigid_stop(fading(slope=1e-6), heat, end=4.0)
    parts = parts_of(scene)
    rows = {row.path: row for part in parts for row in part.rows}
    assert {leaf.path for leaf in sb.files.leaves(scene)} <= set(rows)
    assert str(rows["heat.permissible"].value) == "30.85 °C"
    assert str(rows["duty.slack_tension.level"].value) == "8 kN"  # unit from its place
    assert str(rows["duty.load.profile.level"].value) == "0 N·m"
    assert str(rows["brake.linings.friction.factors[0].blend"].value) == "0 K"  # a width, not a temperature
    assert rows["heat.friction.lining"].value.text == "lining"


def test_profiles_and_loads_in_words():
    assert profile_words(sb.Constant(8e3), "N") == "8 kN at all times"
    lines = profile_words(sb.ramp(2e3, 24e3, 0.0, 0.35), "N")
    assert lines == "straight lines through 2 kN at 0 s, 24 kN at 0.35 s; constant before and after"
    cycles = profile_words(sb.Repeated([1.0, 2.0], [3e4, 0.0], 50.0, 30), "N")
    assert cycles.startswith("30 cycles of 50 s each, in each straight lines through 30 kN at 1 s, 0 kN at 2 s")
    lever = profile_words(sb.Lever(sb.Constant(100.0), 1.5, 0.1), "N")
    assert "times 15" in lever
    assert "100 N at all times" in lever
    many = profile_words(sb.PiecewiseLinear(np.arange(100.0), np.arange(100.0)), "N")
    assert "94 more" in many
    assert profile_words(sb.profiles.FunctionProfile(_wave), "N") == "a user-defined function, _wave"
    hook = load_words(sb.HookLoad(mass=60e3, drum_radius=0.4, line_count=8))
    assert hook == "60 t on the hook, 8 lines strung, rope at 0.4 m from the shaft: 29.42 kN·m on the shaft"
    hook = load_words(sb.HookLoad(mass=61234.56, drum_radius=0.4234567, line_count=8, drag=12.345678))
    torque = f"{61234.56 * 9.80665 * 0.4234567 / 8e3:.5g} kN·m on the shaft; drag 12.346 N·m·s against the motion"
    assert hook == f"61.235 t on the hook, 8 lines strung, rope at 0.42346 m from the shaft: {torque}"


def _wave(t, parameters):
    return 1.0 + 0.0 * t
