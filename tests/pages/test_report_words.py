"""Words and numbers of the report: handy units, profiles and loads, every number of a scene with its meaning."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from heat_scenes import fading, rigid_stop
from stop_scenes import stop_scene

import simbrake as sb
from simbrake._base._table import digits, number, numbers
from simbrake._pages import _rows
from simbrake._pages._rows import load_words, parts_of, profile_words
from simbrake._phases import Ended
from simbrake._run._measure import LimitVerdict
from simbrake.results import Event, LimitCheck
from simbrake.studies import Sensitivity, SensitivityTable


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


def test_more_profiles_in_words():
    rise = sb.profiles.ExponentialRise(24e3, 0.2, 0.5)
    assert profile_words(rise, "N") == "rises from 0 at 0.5 s towards 24 kN with the time constant 0.2 s"
    cycles = sb.Repeated([1.0, 2.0], [3e4, 0.0], 50.0, 30, begin=4.0)
    assert profile_words(cycles, "N").startswith("30 cycles of 50 s each from 4 s on, in each straight lines through ")
    lines = profile_words(sb.Repeated([1.0, 2.0], [3e4, 0.0], 50.0, 30), "N")
    assert lines.startswith("30 cycles of 50 s each, in each ")
    assert profile_words(sb.SpeedHold(3e4), "N") == "as required to hold the speed, at most 30 kN"
    driller = sb.Driller(sb.ramp(1.0, 6.0, 0.0, 2.0), 3e4)
    words = "as required for a speed of 1 rad/s at 0 s, 6 rad/s at 2 s, at most 30 kN"
    assert profile_words(driller, "N") == words
    knots = sb.profiles.FunctionProfile(_wave, knots=[1.0, 2.0])
    assert profile_words(knots, "N") == "a user-defined function, _wave, with 2 corners or jumps"
    lever = sb.Lever(sb.Constant(100.0), 1.5, 0.1)
    assert profile_words(lever, "N") == (
        "a force on the lever, times 15 (efficiency · arm/slack arm): 100 N at all times"
    )
    phases = sb.loads.Phases(
        (sb.loads.Phase(sb.Constant(3e4), "rest", "brake"), sb.loads.Phase(sb.Constant(0.0), "40 s")), count=3
    )
    untils = [phase.until.words for phase in phases.phases]
    assert profile_words(phases, "N") == (
        f"3 cycles of phases; brake: 30 kN at all times, until {untils[0]}; 2: 0 N at all times, until {untils[1]}"
    )
    many = profile_words(sb.PiecewiseLinear(np.arange(9.0), np.arange(9.0)), "N")
    assert many.startswith(
        "straight lines through 0 N at 0 s, 1 N at 1 s, 2 N at 2 s, 3 N at 3 s, … 3 more …, 7 N at 7 s,"
    )
    assert profile_words(sb.PiecewiseLinear(np.arange(8.0), np.arange(8.0)), "N").count(" at ") == 8
    assert profile_words(sb.PiecewiseLinear([0.0, 1.0], [293.15, 373.15]), "K").startswith(
        "straight lines through 20 °C at 0 s, 100 °C at 1 s"
    )


def test_more_loads_in_words():
    tackle = "8 lines strung, rope at 0.4 m from the shaft"
    rope = sb.loads.RopeLayers(0.04, 4.0, 8.5)
    layers = sb.HookLoad(2e4, 0.4, 8, rope=rope, elasticity=sb.loads.RopeElasticity(stiffness=2e6))
    words = f"in the first layer, {float(rope.turns):g} turns on the drum, 2 MN/m at the hook: "
    assert words in load_words(layers)
    assert "on the drum" not in load_words(sb.HookLoad(2e4, 0.4, 8))
    torque = load_words(sb.TorqueLoad(sb.Constant(3e3), drag=2.0))
    assert torque == "a torque on the shaft, 3 kN·m at all times; drag 2 N·m·s against the motion"
    string = sb.loads.StringLoad(8e3, 80e3, 0.4, 8, stand=900.0)
    assert load_words(string) == (
        f"a string of 80 t in the first cycle, 900 kg more in each, on a hook of 8000 kg or in the slips; {tackle}"
    )
    trip = sb.loads.TrippingLoad(8e3, 80e3, 900.0, 5.0, 55.0, 60.0, 0.4, 8, count=30)
    assert load_words(trip) == (
        "trip in 30 stands of 900 kg, one every 60 s: 8000 kg of hook and block, and from 5 s to 55 s of each cycle "
        f"the string, initially 80 t; {tackle}"
    )


def test_duty_in_words():
    rows = dict(_rows.duty_words(sb.with_values(stop_scene(w0=20.0, load=300.0), {"initial.time": 0.5})))
    assert rows == {
        "Lever, slack tension": "8 kN at all times",
        "Load": "a torque on the shaft, 300 N·m at all times",
        "Start": "20 rad/s at 0.5 s",
        "End": "at 5 s",
    }
    phases = sb.loads.Phases((sb.loads.Phase(sb.Constant(3e4), "rest", "brake"),))
    rows = dict(_rows.duty_words(stop_scene(w0=0.0, lever=phases)))
    assert rows["Start"] == "0 rad/s at 0 s, at rest"
    assert rows["End"] == "with the last phase, at the latest at 5 s"


def test_parts_of_a_scene_in_words():
    parts = {part.path: part for part in parts_of(stop_scene())}
    assert (parts[""].kind, parts[""].words) == ("Scene", "One run of a brake.")
    assert parts["brake.linings"].words == "The linings, counted from the slack to the tight end."
    assert parts["brake.pulley"].words == (sb.Pulley.__doc__ or "").splitlines()[0]
    assert [row.path for row in parts["brake.pulley"].rows][:2] == ["brake.pulley.radius", "brake.pulley.inertia"]
    rows = {row.path: (row.meaning, str(row.value)) for part in parts_of(
        stop_scene(lever=sb.profiles.FunctionProfile(_wave))) for row in part.rows}  # fmt: skip
    assert rows["duty.slack_tension.function"] == ("function", "_wave")
    assert rows["brake.linings.area"][1] == "not given"
    hook = [str(row.value) for part in parts_of(stop_scene(load=sb.HookLoad(2e4, 0.4, 8))) for row in part.rows]
    assert "None" not in hook
    repeated = stop_scene(lever=sb.Repeated([1.0, 2.0], [3e4, 0.0], 50.0, 30))
    rows = {row.path: (row.meaning, str(row.value)) for part in parts_of(repeated) for row in part.rows}
    assert rows["duty.slack_tension.count"][1] == "30"
    assert rows["duty.slack_tension.count"][0] != "count"


def test_rows_of_events():
    events = [
        Event(1.0, "slip_onset"),
        *(Event(1.0 + i / 8, "lining_limit", i) for i in (3, 2, 1)),
        Event(2.0, "lining_slip", 4),
        *(Event(2.5, "lining_stick", i) for i in (1, 2, 4)),
        *(Event(2.75, "lining_lift_off", i) for i in (2, 5, 4)),
        Event(3.0, "stop"),
        Event(4.0, "stop"),
        Event(5.0, "phase_end", phase=Ended("hold", 2, 1, "40 s")),
        Event(6.0, "own"),
    ]
    rows = [
        {name: str(x) if name != "meaning_members" else x for name, x in row.items()}
        for row in _rows.event_table(events)
    ]
    assert [(row["time"], row["event"], row["lining"], row["time_end"]) for row in rows] == [
        ("1 s", "slip_onset", "", "None"),
        ("1.375 s", "lining_limit", "3…1", "1.125 s"),
        ("2 s", "lining_slip", "4", "None"),
        ("2.5 s", "lining_stick", "3 times", "None"),
        ("2.75 s", "lining_lift_off", "3 times", "None"),
        ("3 s", "stop", "", "None"),
        ("4 s", "stop", "", "None"),
        ("5 s", "phase_end", "", "None"),
        ("6 s", "own", "", "None"),
    ]
    assert [len(row["meaning_members"]) for row in rows] == [0, 3, 0, 3, 3, 0, 0, 0, 0]
    assert [f"{i} {t}" for i, t in rows[1]["meaning_members"]] == ["3 1.375 s", "2 1.25 s", "1 1.125 s"]
    assert "lining lift off" in str(_rows.event_table(events))
    assert rows[0]["meaning"] == "the band is taut: it begins to brake"
    assert rows[7]["meaning"] == "phase 2 'hold' of cycle 1 (40 s) ended"
    assert rows[8]["meaning"] == ""
    counts = [tuple(map(str, row.values())) for row in _rows.event_counts(events[5:10])]
    assert counts == [
        ("lining_stick", "3", "2.5 s", "2.5 s", "a lining sticks"),
        ("lining_lift_off", "2", "2.75 s", "2.75 s", "a lining lifts off the rim"),
    ]
    (row,) = _rows.event_counts([Event(1.0, "stop"), Event(3.0, "stop")])
    assert (row["count"], str(row["first"]), str(row["last"])) == (2, "1 s", "3 s")


def test_rows_of_limits_stages_and_key_figures():
    checks = [
        LimitCheck("max_tension", 4e3, 5e3, "N", LimitVerdict.EXCEEDED, "at 1 s"),
        LimitCheck("peak_rim_temperature", 373.15, 363.15, "K", LimitVerdict.WITHIN),
        LimitCheck("stopping_time", None, None, "s", LimitVerdict.NOT_EVALUATED),
    ]
    rows = [[str(x) for x in row.values()] for row in _rows.limit_table(checks)]
    assert rows == [
        ["Maximum tension of the band", "4 kN", "5 kN", "−1 kN", "exceeded", "at 1 s", "bad"],
        ["Hottest rim surface", "100 °C", "90 °C", "10 K", "within limit", "", "good"],
        ["Stopping time", "—", "—", "—", "not evaluated", "", rows[2][-1]],
    ]
    stage = {"name": "stage_2", "start": 0.5, "end": 2.0, "duration": 1.5, "heat_external": 8e3, "heat_internal": 4e3}
    stage |= {"load_work": 5e3, "lever_work": 6e3}
    (row,) = _rows.stage_table(
        {
            "stages": [
                stage,
            ]
        }
    )
    assert [str(x) for x in row.values()] == [
        *("stage 2", "0.5 s", "2 s", "1.5 s", "8 kJ", "4 kJ", "5 kJ", "6 kJ", "both pairs slide")
    ]
    assert len(_rows.stage_table({})) == 0
    summary = {
        "at": {"max_tension_lining": 7, "max_tension_time": 0.5, "stopping_time_time": 1.0},
        "metrics": {"slip_onset_time": None, "max_tension": 4e3, "stopping_time": 2.0, "peak_rim_temperature": 373.15},
        "capacity": {"load_torque": 3e3, "brake_torque": 2e3},
        "energy": {"friction_heat": 9e3},
        "lining": "pad",
        "body": "disc",
    }
    figures = [(words, str(value), note) for words, value, note in _rows.key_figures(summary)]
    assert sorted(figures[:-3]) == [
        ("Hottest disc surface", "100 °C", ""),
        ("Maximum tension of the band", "4 kN", "pad 7, at 0.5 s"),
        ("Stopping time", "2 s", "at 1 s"),
    ]
    assert figures[-3:] == [
        ("Load torque at the end", "3 kN·m", ""),
        ("Torque of the sliding brake at the end", "2 kN·m", ""),
        ("Friction heat", "9 kJ", ""),
    ]
    stops = [
        {"stop": 1, "motion_time": 1.0, "braking_time": 0.75, "angle": 9.0, "energy": 8e3, "travel": 2.0},
        {"stop": 2, "motion_time": 2.0, "braking_time": 0.5, "angle": 12.0, "energy": 9e3, "travel": 3.0},
    ]
    many = _rows.key_figures(summary | {"stops": stops, "capacity": None})
    assert [(words, str(value), note) for words, value, note in many[:7]] == [
        ("Stops", "2", ""),
        ("Time in motion", "3 s", ""),
        ("Time of braking", "1.25 s", ""),
        ("Longest braking", "0.75 s", "in stop 1"),
        ("Maximum friction heat of a stop", "9 kJ", "in stop 2"),
        ("Angle of all stops", "21 rad", ""),
        ("Hook travel of all stops", "5 m", ""),
    ]
    assert {words for words, *_ in many[7:]} == {"Maximum tension of the band", "Hottest disc surface", "Friction heat"}
    without = [{name: x for name, x in stop.items() if name != "travel"} for stop in stops]
    assert len(_rows.key_figures(summary | {"stops": without, "capacity": None})) == len(many) - 1


def row_of(path, elasticity, half=None, low=None, high=None, tangent=None, value=2.0):
    return Sensitivity(path, "kg", "mass", value, elasticity, elasticity, half, low, high, tangent=tangent)


def test_bars_of_a_tornado_are_in_percent_of_its_width():
    """The metric is 10 m, its ends 4 and 24: 20 wide."""
    rows = (
        row_of("small", 0.5, 0.25, 9.0, 11.5, 1.0),
        row_of("large", 1.0, 1.0, 24.0, 4.0),
        row_of("bare", 2.0),
        row_of("half", 2.0, 1.0, 10.0, None),
        row_of("other half", 2.0, 1.0, None, 10.0),
    )
    chart = _rows.tornado(SensitivityTable("travel", "m", 10.0, rows))
    assert chart.caption.startswith("Metric at the lower (blue) and the upper (red) bound")
    assert chart.base == pytest.approx(30.0)
    large, small = chart.bars
    assert (large.path, large.words, large.tangents) == ("large", "2 kg ± 1 kg", ())
    assert [(end.side, end.x, end.width) for end in large.ends] == [
        ("low", pytest.approx(30.0), pytest.approx(70.0)),
        ("high", pytest.approx(0.0), pytest.approx(30.0)),
    ]
    assert [end.words for end in small.ends] == ["small, lower bound: 9 m", "small, higher bound: 11.5 m"]
    assert [end.x for end in small.ends] == pytest.approx([25.0, 30.0])
    assert [end.width for end in small.ends] == pytest.approx([5.0, 7.5])
    assert small.tangents == pytest.approx((25.0, 35.0))
    assert [bar.path for bar in _rows.tornado(SensitivityTable("travel", "m", 10.0, rows), 1).bars] == ["small"]
    down, up = row_of("down", 1.0, 1.0, 4.0, 10.0), row_of("up", 1.0, 1.0, 10.0, 11.0)
    assert [bar.path for bar in _rows.tornado(SensitivityTable("travel", "m", 10.0, (up, down))).bars] == ["down", "up"]
    # a tangent beyond the ends widens the chart
    wide = _rows.tornado(SensitivityTable("travel", "m", 10.0, (row_of("x", 1.0, 1.0, 9.0, 11.0, 10.0),)))
    assert (wide.base, wide.bars[0].tangents) == (pytest.approx(50.0), pytest.approx((0.0, 100.0)))


def test_without_ranges_a_tornado_shows_elasticities():
    rows = (row_of("up", 1.5), row_of("down", -2.5), row_of("none", math.nan), row_of("least", 0.5))
    chart = _rows.tornado(SensitivityTable("travel", "m", 10.0, rows))
    assert chart.caption == "Percent of the metric for one percent of each parameter."
    assert chart.base == pytest.approx(62.5)
    found = [(bar.path, bar.words, *(end[:3] for end in bar.ends)) for bar in chart.bars]
    assert found == [
        ("down", "2 kg", ("low", pytest.approx(0.0), pytest.approx(62.5))),
        ("up", "2 kg", ("high", pytest.approx(62.5), pytest.approx(37.5))),
        ("least", "2 kg", ("high", pytest.approx(62.5), pytest.approx(12.5))),
    ]
    assert chart.bars[0].ends[0].words == "down: −2.5"


def test_ledgers_of_a_run_with_heat():
    energy = {"load_work": 5e3, "lever_work": 1e3, "kinetic_change": -6e3, "friction_heat": 11e3, "closure": 1e-9}
    pairs = {"external": SimpleNamespace(words="outside"), "internal": SimpleNamespace(words="inside")}

    def books(pairs, **energies):
        result = SimpleNamespace(
            scene=SimpleNamespace(brake=SimpleNamespace(pairs=pairs)), stored_heat={"rim": 8e3, "air": -1e3}
        )
        return _rows.ledgers(result, {"energy": energy | energies})

    def shares(side):
        return {share.words: (str(share.value), pytest.approx(share.percent)) for share in side}

    (book,) = books({"external": pairs["external"]}, damper_heat=1e3)
    assert (book.title, str(book.total), book.closure) == ("Mechanical energy", "12 kJ", "10⁻⁹")
    assert {name: value for name, (value, _) in shares(book.into).items()} == {
        "Work of the load": "5 kJ",
        "Work of the lever": "1 kJ",
        "Kinetic energy given up": "6 kJ",
    }
    assert {name: value for name, (value, _) in shares(book.out).items()} == {
        "Friction heat": "11 kJ",
        "Heat of dampers": "1 kJ",
    }
    assert [share.hue for share in (*book.into, *book.out)] == [0, 1, 2, 3, 4]
    assert [share.percent for share in book.out] == pytest.approx([100 * 11 / 12, 100 / 12])
    heat = {"heat_external": 7e3, "heat_internal": 4e3, "heat_stored": 7e3, "heat_supplied": 0.0, "heat_lost": 4e3}
    heat |= {"heat_to_metal": 9e3, "heat_to_linings": 2e3, "heat_to_band": 0.0, "heat_closure": 2e-9}
    first, second = books(pairs, **heat)
    assert [share.words for share in first.out] == ["Friction heat, outside", "Friction heat, inside"]
    assert "no error estimate" in second.note
    assert second.closure == "2·10⁻⁹"
    assert {name: value for name, (value, _) in shares(second.into).items()} == {
        "Friction heat into metal": "9 kJ",
        "Friction heat into linings": "2 kJ",
        "Stored in air": "1 kJ",
    }
    assert {name: value for name, (value, _) in shares(second.out).items()} == {
        "Stored in rim": "8 kJ",
        "Lost to the surroundings and to no body": "4 kJ",
    }
    none = books(
        pairs, **heat | {"heat_to_metal": 0.0, "heat_to_linings": 0.0, "heat_elsewhere": 11e3, "shaft_work": 2e3}
    )[1]
    assert shares(none.into)["Friction heat into no body"][0] == "11 kJ"
    assert shares(none.into)["Other torques on the shaft"][0] == "2 kJ"
