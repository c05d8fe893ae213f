"""Every printed balance sums by its own terms, to its digits: summary and JSON of
shipped scenes."""

import json
import math
import re

import pytest
import shipped
from heat_scenes import lump
from helpers import near
from scenes import stop_scene

import simbrake as sb
from simbrake.files.shipped_scenes import TEMPLATES

NUMBER = r"[-−]?(?:\d+(?:\.\d+)?(?:e[-+]\d+)?(?:·10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)?|10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)"
FACTORS = {
    "J": 1.0,
    "kJ": 1e3,
    "MJ": 1e6,
    "W": 1.0,
    "kW": 1e3,
    "MW": 1e6,
    "N·m": 1.0,
    "kN·m": 1e3,
    "MN·m": 1e6,
}
LOWER = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹−", "-0123456789-")


def value_of(text, unit):
    """A printed number in SI."""
    mantissa, _, power = (
        text.translate(LOWER).rpartition("·10")
        if "·10" in text
        else (text.translate(LOWER), "", "")
    )
    return float(mantissa) * 10.0 ** float(power or 0) * FACTORS[unit]


def terms(text):
    """Printed numbers with a unit of energy, power or torque, in SI."""
    return [
        value_of(*found)
        for found in re.findall(rf"({NUMBER}) ({'|'.join(FACTORS)})(?![\w·])", text)
    ]


def assert_equal_sums(left, right, digits=6):
    """Sums of printed terms agree to what rounding to so many digits can leave."""
    assert left
    assert right
    rounding = sum(
        0.5 * 10.0 ** (math.floor(math.log10(abs(x))) + 1 - digits)
        for x in (*left, *right)
        if x
    )
    assert abs(sum(left) - sum(right)) <= 1.01 * rounding


SHAFT = (
    sb.loads.HydrodynamicBrake(60.0, place="rim"),
    sb.loads.BearingFriction("30 N*m"),
)


def hydrodynamic():
    """Heat of the brake and of torques on the shaft, one with a place for its heat;
    shares of the power."""
    shares = sb.PowerShares(electrical=0.02, mechanical=0.05)
    parts = {"heat": lump(2e5), "shaft": SHAFT, "power_shares": shares}
    return stop_scene(load=3e4, end=3.0, **parts)


def lowered():
    """A lever that holds the speed beside the same torques, under a load with drag."""
    parts = {"heat": lump(2e5), "shaft": SHAFT, "lever": sb.SpeedHold(8e3)}
    return stop_scene(C=None, load=sb.TorqueLoad(4e4, 50.0), end=3.0, **parts)


def not_in_the_network():
    """Friction heat that enters no body, beside a source that heats one."""
    bodies = (sb.thermal.Lump("rim", 2e5), sb.thermal.Reservoir("air"))
    links = (sb.thermal.Conductance("rim", "air", 20.0),)
    heat = sb.Heat(
        bodies, links, sources=(sb.thermal.Source("rim", "2 kW"),), rim="rim"
    )
    return stop_scene(C=None, heat=heat)


MADE = {one.__name__: one for one in (hydrodynamic, lowered, not_in_the_network)}


def scene_of(name):
    if name in MADE:
        return MADE[name]()
    if name in shipped.NAMES:
        return shipped.load(name).scene()
    return sb.read_scene(sb.files.shipped(name))


#: scenarios whose template is the same duty of the same kind of brake
TWINS = {
    "u2_5_5_stop",
    "sensitivity_u2_5_5",
    "tripping_30_stands",
    "disc_stop",
    "double_shoe_stop",
}
SHIPPED = [*TEMPLATES, *(name for name in shipped.NAMES if name not in TWINS)]
QUICK = ("heated", "disc", *MADE)


def scenes():
    marks = {
        name: () if name in QUICK else pytest.mark.slow for name in [*MADE, *SHIPPED]
    }
    return [pytest.param(name, marks=mark) for name, mark in marks.items()]


@pytest.mark.parametrize("name", scenes())
def test_printed_balances_sum(name):
    result = sb.simulate(scene_of(name))
    heads = ["energy   ", "heat     "] if result.scene.heated else ["energy   "]
    for head in heads:
        (line,) = [x for x in str(result).splitlines() if x.startswith(head)]
        assert_equal_sums(*map(terms, line.partition(" (")[0].split(" = ")))
        if head == heads[0]:
            dragged = float(getattr(result.scene.duty.load, "drag", 0.0)) > 0
            assert ("load less its drag " in line) == dragged

    e = json.loads(json.dumps(result.summary()))["energy"]

    def total(*names):
        return sum(e.get(one, 0.0) for one in names)

    taken = total(
        "friction_heat",
        "damper_heat",
        "shaft_work",
        "electrical_work",
        "mechanical_work",
        "pick_up_heat",
    )
    given = total("load_work", "rope_work", "lever_work", "motor_work")
    changed = total("kinetic_change", "elastic_change")
    near(given, taken + changed, 1e-9, 1e-9 * taken)
    if result.scene.heated:
        friction = total(
            "heat_to_metal", "heat_to_linings", "heat_to_band", "heat_elsewhere"
        )
        near(friction, e["friction_heat"], 1e-9)
        into = friction + total("shaft_work", "heat_supplied")
        out = total("heat_stored", "heat_lost")
        near(into, out, 1e-9)
    each = [one for one in e if one.startswith("shaft_") and one != "shaft_work"]
    near(total(*each), e.get("shaft_work", 0.0), 1e-12)
    pairs = [f"heat_{pair}" for pair in result.scene.brake.pairs]
    assert total(*pairs) in (0.0, pytest.approx(e["friction_heat"], rel=1e-12))
    for pair in pairs:
        stages = [stage[pair] for stage in result.summary().get("stages", [])]
        assert not stages or sum(stages) == pytest.approx(e[pair], rel=1e-9)
