"""Values of a brake application under estimate, each from its formula, on numbers of which no two are equal."""

import dataclasses
import math
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest

import simbrake as sb
from simbrake.formulas._braking import Braking
from simbrake.formulas._heated import Absent, HeatedPart, RunValues, WallCourse, _hardest, _sliding, schmidt_layers
from simbrake.formulas._inputs import read_given
from simbrake.formulas._material_table import QUANTITIES
from simbrake.formulas._materials import Compared
from simbrake.formulas.stress import ElasticMaterial
from simbrake.formulas.track import _around

RIM, LINING, BAND = sb.Material(40.0, 7800.0, 480.0), sb.Material(0.7, 2000.0, 1100.0), sb.Material(50.0, 7700.0, 500.0)
SIGMA = 5.670374419e-8
GIVEN = {
    "rim": RIM,
    "lining": LINING,
    "band": BAND,
    "rim_thickness": 0.025,
    "lining_thickness": 0.03,
    "band_thickness": 0.006,
    "track_area": 1.6,
    "lining_area": 0.9,
    "outer_area": 1.1,
    "share": 0.85,
    "external_share": 0.2,
    "beyond_share": 0.15,
    "power": sb.PowerShares(electrical=0.1, mechanical=0.2),
    "hardness": 2e9,
    "overlap": 0.6,
    "emissivity": 0.8,
    "ambient": 290.0,
    "start": 320.0,
    "band_start": 310.0,
    "coefficient": 12.0,
    "spot_length": 2e-5,
    "elastic": ElasticMaterial(),
}
STOP = SimpleNamespace(time=3.0, work=2e5, angle=31.0, ratio=5.5, power=9e4)
T, OMEGA = np.array([1.0, 2.0, 4.0, 5.0]), np.array([20.0, 16.0, 6.0, 0.0])
WORK = np.array([0.0, 1e5, 2.5e5, 3e5])
#: the rim of the run: three layers at four times, their faces, and the faces of the linings
LAYERS = np.array([[300.0, 300.0, 300.0], [340.0, 310.0, 301.0], [390.0, 330.0, 306.0], [370.0, 350.0, 318.0]])
WALL = sb.thermal.Wall("rim", RIM, 0.025, 1.6, layers=3, growth=1.5)


class Given(NamedTuple):
    value: object


def scene(**load):
    load = SimpleNamespace(**load)
    brake = SimpleNamespace(pulley=SimpleNamespace(radius=0.6), band=SimpleNamespace(radius=0.65))
    lever = SimpleNamespace(scale=lambda: 7e3)
    return SimpleNamespace(brake=brake, duty=SimpleNamespace(load=load, lever=lever), power_shares=None, heated=True)


def braking(monkeypatch, *, run=None, stop=STOP, given=None, load=None, **more):
    monkeypatch.setattr("simbrake.formulas._braking.band_brake", lambda scene: scene.brake)
    monkeypatch.setattr("simbrake.formulas._braking.friction_at_start", lambda scene, pair: np.array([0.3, 0.36]))
    inputs = {name: Given(value) for name, value in (GIVEN | (given or {})).items()}
    numbers = {"time": 4.0, "work": 3e5, "omega": 20.0} | more
    return Braking(scene(**(load or {})), inputs, stop, None, run, **numbers)


def run(**more):
    steps = 0.025 * np.array([1.0, 1.5, 2.25]) / 4.75
    rim = WallCourse(WALL, LAYERS, np.cumsum(steps) - steps / 2, steps)
    series = SimpleNamespace(
        t=T,
        rim_temperature=LAYERS[:, :1] + np.array([[0.0], [25.0], [30.0], [2.0]]),
        lining_temperature=None,
        band_temperature=np.array([[300.0, 304.0], [301.0, 307.0], [305.0, 311.0], [306.0, 318.0]]),
        slip_speed=np.array([12.0, -10.0, 4.0, 0.0]),
        normal_load=np.array([[1e3, 2e3], [2e3, 3e3], [3e3, 5e3], [4e3, 4e3]]),
    )
    result = SimpleNamespace(metrics={"stopping_time": 5.5, "stopping_angle": 44.0}, events=[], energy={}, stages=[])
    values = {"pair": "", "other_work": 0.5 * WORK, "brakings": 1, "total_work": 4e5} | more
    found = RunValues(
        result,
        series,
        values["pair"],
        WORK,
        values["other_work"],
        OMEGA,
        np.zeros(4),
        values["brakings"],
        values["total_work"],
    )
    found.__dict__.update(rim=rim, lining=None)
    return found


# --- motion, forces and work ------------------------------------------------------------------------------------------


def test_motion_of_a_stop_and_of_each_pair(monkeypatch):
    b = braking(monkeypatch)
    assert (b.R, b.R_b, b.arm, b.speed) == (0.6, 0.65, 0.65, 20.0 * 0.6)
    assert b.travel == pytest.approx(0.65 * 20.0 * 4.0 / 2)
    assert b.mean_omega == pytest.approx(10.0)
    assert b.friction_travel() == pytest.approx(0.65 * 31.0)
    inner, outer = (dataclasses.replace(b, pair=pair, slid=-12.0) for pair in ("internal", "external"))
    assert (inner.arm, outer.arm) == (0.6, 0.65)
    assert (inner.speed, outer.speed) == (20.0 * 0.6, 20.0 * 0.65)
    assert (inner.travel, outer.travel) == (pytest.approx(7.2), pytest.approx(7.8))
    assert [x.part for x in (b, inner, outer)] == ["rim", "rim", "band"]
    assert b.on_rim() is b
    assert outer.on_rim() is None
    assert (b.stopped(), b.unstopped()) == (b, None)
    alone = dataclasses.replace(b, stop=None)
    assert (alone.stopped(), alone.unstopped()) == (None, alone)
    of_run = braking(monkeypatch, run=run())
    assert of_run.travel == pytest.approx(0.65 * (18.0 + 22.0 + 3.0))
    assert (of_run.hardest_time, of_run.hardest_angle, of_run.hardest_work()) == (5.5, 44.0, 4e5)
    assert braking(monkeypatch, run=run(brakings=2)).hardest_work() == 3e5


def test_rest_after_the_hardest_stop(monkeypatch):
    b = braking(monkeypatch, run=run(brakings=2))
    rests = b.run.result.events
    with pytest.raises(Absent):
        _ = b.hardest_time
    rests += [SimpleNamespace(name="stop", time=2.0), SimpleNamespace(name="lock", time=6.0)]
    with pytest.raises(Absent):
        _ = b.hardest_time
    rests.append(SimpleNamespace(name="stop", time=8.5))
    assert b.hardest_time == 7.5
    b.run.result.series = lambda t: SimpleNamespace(phi=10.0 * t)
    assert b.hardest_angle == pytest.approx(75.0)
    rests[-1].time = 9.0  # later than the brake application was long
    with pytest.raises(Absent):
        _ = b.hardest_time


def test_hook_has_travel_and_torque_has_none(monkeypatch):
    load = {"drum_radius": 0.4, "line_count": 8.0, "travelled": lambda angle: 0.05 * angle}
    b = braking(monkeypatch, load=load, run=run())
    assert b.drum == (0.4, 8.0)
    assert b.hook_travel() == pytest.approx(0.05 * 31.0)
    assert b.hardest_hook_travel() == pytest.approx(0.05 * 44.0)
    for call in (braking(monkeypatch).hook_travel, braking(monkeypatch, run=run()).hardest_hook_travel):
        with pytest.raises(Absent):
            call()


def test_forces_and_loads_on_the_linings(monkeypatch):
    b = braking(monkeypatch)
    assert (b.T_0, b.T_n()) == (7e3, 5.5 * 7e3)
    assert b.mean_torque() == pytest.approx(3e5 * 0.65 / 26.0)
    assert b.friction == pytest.approx(0.33)
    assert b.pressure == pytest.approx(3e5 / (0.33 * 26.0 * 0.9))
    assert b.contact_area() == pytest.approx(0.9 * b.pressure / 2e9)
    for soft in ({"hardness": 0.9 * b.pressure}, {"lining_area": math.inf}):
        with pytest.raises(Absent):
            _ = braking(monkeypatch, given=soft).pressure
    assert braking(monkeypatch, given={"hardness": b.pressure}).pressure == b.pressure
    with pytest.raises(Absent):
        _ = braking(monkeypatch, omega=0.0).pressure
    assert b.stopping_load == (2e5, 3.0)
    assert dataclasses.replace(b, stop=None).stopping_load == (3e5, 4.0)
    assert b.energy_load() == (2e5 / 0.9, None)
    assert b.power_load == (2e5 / 2.7, None)
    of_run = braking(monkeypatch, run=run())
    assert of_run.energy_load()[1] == pytest.approx(3e5 / 0.9)
    assert of_run.power_load[1] == pytest.approx(3e5 / 3.6)
    way = [12.0 * 3e3, 10.0 * 5e3, 4.0 * 8e3, 0.0]
    distance = np.trapezoid([12.0, 10.0, 4.0, 0.0], T)
    assert of_run.run_pressure == pytest.approx(np.trapezoid(way, T) / distance / 0.9)


# --- heat and temperatures --------------------------------------------------------------------------------------------


def test_shares_of_the_work_and_fluxes(monkeypatch):
    b = braking(monkeypatch, more=4e3)
    assert (b.split.heat, b.split.electrical, b.split.mechanical) == pytest.approx((2.1e5, 3e4, 6e4))
    assert b.heat == pytest.approx(2.1e5)
    assert b.metal_heat == pytest.approx(0.85 * 2.1e5 + 4e3)
    assert b.flux == pytest.approx(b.metal_heat / (1.6 * 4.0))
    assert b.initial_flux == pytest.approx(2 * b.flux)
    assert b.lining_flux == pytest.approx(b.flux / 0.6)
    assert b.power_of_S() == pytest.approx(0.68 * 9e4)
    assert b.effusivity_share() == pytest.approx(1 / (1 + math.sqrt(0.7 * 2000 * 1100 / (40 * 7800 * 480))))
    outer = dataclasses.replace(b, pair="external")
    assert outer.metal_heat == pytest.approx(0.2 * 2.1e5 + 4e3)
    assert outer.flux == pytest.approx(outer.metal_heat / (1.1 * 4.0))
    stack = b.stack()
    across = 0.03 / 0.7 + 0.006 / 50.0
    assert stack["conductivity"] == pytest.approx(0.036 / across)
    assert stack["resistance"] == pytest.approx(across / 0.9)
    with pytest.raises(AttributeError, match="width"):
        _ = b.width
    assert b.with_inputs(share=0.5).metal_heat == pytest.approx(0.5 * 2.1e5 + 4e3)


def test_parts_and_their_mean_rises(monkeypatch):
    b = braking(monkeypatch, more=4e3)
    rim, lining, band = b.parts.values()
    assert [*b.parts] == ["rim", "lining", "band"]
    depth = 1.73 * math.sqrt(40 / (7800 * 480) * 4.0)
    assert rim.depth == pytest.approx(depth)
    assert rim.volume == pytest.approx(1.6 * depth)
    assert rim.rise == pytest.approx(2 / 3 * (0.85 * 2.1e5 + 4e3) / (480.0 * 7800 * 1.6 * depth))
    assert rim.bulk == pytest.approx(320.0 + rim.rise)
    assert rim.Fo() == 1 / 3
    assert rim.Fo_words() == "1/3, for b ≤ δ"
    assert (lining.material, lining.thickness, lining.area, lining.start) == (LINING, 0.03, 0.9, 320.0)
    assert lining.share == pytest.approx(0.15)
    assert (band.material, band.thickness, band.area, band.share, band.more) == (BAND, 0.006, 0.9, 0.0, 0.0)
    assert band.Fo_words() == "a τ/δ², for b > δ"
    outer = dataclasses.replace(b, pair="external").parts
    assert [*outer] == ["band", "lining"]
    assert (outer["band"].share, outer["band"].area, outer["band"].start) == (0.2, 1.1, 310.0)
    assert outer["lining"].area == 1.1
    assert isinstance(b.heated, HeatedPart)
    assert b.heated.name == "rim"


def test_temperatures_by_formula(monkeypatch):
    b = braking(monkeypatch)
    whole = b.metal_heat / (1.6 * 0.025 * 7800 * 480)
    assert b.whole_rise == pytest.approx(whole)
    assert b.end == pytest.approx(320.0 + whole)
    falling = 2 / 3 * (2 * b.initial_flux / math.sqrt(40 * 7800 * 480)) * math.sqrt(4.0 / (2 * math.pi))
    assert b.falling() == pytest.approx(320.0 + falling)
    # a slab much thicker than the heat goes has the rise of a half-space
    thick = braking(monkeypatch, given={"rim_thickness": 0.5})
    assert thick.falling_slab() == pytest.approx(320.0 + falling, rel=1e-6)
    plain = 320.0 + 2 * b.flux * math.sqrt(4.0 / (math.pi * 40 * 7800 * 480))
    assert thick.plate() == pytest.approx(plain, rel=1e-9)
    assert b.maximum[0] == pytest.approx(320.0 + sb.formulas.maximum_temperatures(b.heated.rise, falling, b.flash)[0])
    assert braking(monkeypatch, omega=0.0).flash is None
    law = sb.thermal.FlashTemperature(2e-5, 40.0, 40.0 / (7800 * 480), 0.85 * 0.7, 2e9)
    assert b.flash == pytest.approx(float(law.rise(np.asarray(0.33 * 2e9 * 12.0), np.asarray(12.0))))
    assert b.stationary_drop() == pytest.approx(b.flux * 0.025 / 40.0)
    assert b.gradient() == pytest.approx(2 * b.flux / 40.0)
    assert b.radiation == pytest.approx(0.8 * SIGMA * (320.0**2 + 290.0**2) * 610.0)
    mean = b.flux * 4.0 / (0.025 * 7800 * 480)
    face = b.plate() - 320.0
    assert b.stress == pytest.approx(-2.05e11 * 12e-6 / 0.7 * (face - mean))
    assert b.stress_ratio() == pytest.approx(-b.stress / 150e6)
    assert 0 > b.free_stress() > b.stress


def test_heat_balance_and_four_turns(monkeypatch):
    b = braking(monkeypatch)
    expected = sb.formulas.heat_balance(
        b.flux / 0.6,
        overlap=0.6,
        coefficient=12.0 + b.radiation,
        surface=320.0,
        ambient=290.0,
        omega=10.0,
        area=1.6,
    )
    assert b.balance == expected
    assert b.balanced_overlap() == 0.6
    for missing in ({"omega": 0.0}, {"given": {"overlap": 0.0}}, {"slid": 0.0}):
        with pytest.raises(Absent):
            _ = braking(monkeypatch, **missing).balance
    # 18 rad in the first second, 22 in the next two: the rest of 8π rad falls into these
    time, heat = braking(monkeypatch, run=run()).four_turns()
    late = (8 * math.pi - 18.0) / 22.0 * 2.0
    assert time == pytest.approx(1.0 + late)
    assert heat == pytest.approx(0.85 * 0.7 * (1e5 + 1.5e5 * late / 2.0))
    slow = dataclasses.replace(run(), omega=0.5 * OMEGA)
    with pytest.raises(Absent):
        braking(monkeypatch, run=slow).four_turns()


# --- the run ----------------------------------------------------------------------------------------------------------


def test_the_rim_of_a_run(monkeypatch):
    b, r = braking(monkeypatch, run=run()), run()
    steps = r.course.steps
    np.testing.assert_allclose(r.course.mean(), LAYERS @ steps / 0.025)
    cut = np.array([steps[0], 0.01 - steps[0], 0.0])
    np.testing.assert_allclose(r.course.inside(0.01), cut)
    np.testing.assert_allclose(r.course.mean(0.01), LAYERS @ cut / 0.01)
    np.testing.assert_array_equal(r.course.back, LAYERS[:, 2])
    np.testing.assert_allclose(r.course.content, 7800 * 480 * (LAYERS - LAYERS[:1]) @ steps)
    assert b.kept == pytest.approx(r.course.content[-1] * 1.6)
    assert b.kept_flux() == pytest.approx(b.kept / (1.6 * 4.0))
    assert b.start_now == pytest.approx(300.0)
    assert b.simulated_end() == pytest.approx(r.course.mean()[-1])
    assert b.simulated_bulk == pytest.approx(np.mean(r.course.mean(b.heated.depth)))
    assert b.peak == 420.0
    assert r.drop == pytest.approx(420.0 - 306.0)
    assert b.drop_flux() == pytest.approx(40.0 * 114.0 / 0.025)
    assert r.gradient == pytest.approx(30.0 / (0.5 * steps[0]))
    time, power, work = r.at_peak()
    assert time == pytest.approx(3.0 / 4.0)
    assert work == pytest.approx(2.5 / 3.0)
    # a derivative of second order between unequal steps
    assert power == pytest.approx((5e4 * 2.0 + 7.5e4 * 1.0) / 3.0 * 4.0 / 3e5)
    np.testing.assert_allclose(r.profile_depth, [0.0, *r.course.depth, 0.025])
    np.testing.assert_allclose(r.profile[2], [420.0, 390.0, 330.0, 306.0, 306.0])
    assert r.max_power() == pytest.approx(1e5)
    assert r.duration == 4.0
    assert r.layered_duration() == 4.0
    outer = run(pair="external")
    assert not outer.layered
    np.testing.assert_allclose(outer.band, [302.0, 304.0, 308.0, 312.0])
    assert r.face == 420.0
    with pytest.raises(Absent):
        outer.layered_duration()


def test_schmidt_has_the_work_of_the_run():
    r = run()
    found = r.schmidt(RIM, 0.8, 1.6, beyond=0.25)
    n = schmidt_layers(RIM, 0.025, 4.0)
    assert n == 100
    assert schmidt_layers(RIM, 0.025, 200.0) == int(math.sqrt(1e4 / (40 / (7800 * 480) * 200.0 / 0.025**2))) == 54
    assert found.temperature.shape[1] == n + 2  # the face, the layers, the back
    start = np.interp(0.025 * (np.arange(n) + 0.5) / n, r.profile_depth, r.profile[0])
    # adiabatic: what has entered is in the layers
    gained = np.mean(found.temperature[-1, 1:-1] - start) * 0.025 * 7800 * 480 * 1.6
    assert gained == pytest.approx(0.8 * 3e5 + 0.25 * 1.5e5, rel=1e-9)
    assert (schmidt_layers(RIM, 0.025, 1e6), schmidt_layers(RIM, 0.025, 1e-3)) == (8, 100)


def test_the_share_of_the_metal_in_a_run(monkeypatch):
    energy = {"heat_to_metal": 2.4e5, "heat_to_band": 3e4, "heat_external": 1e5}
    for pair, entered in (("", 2.4e5), ("external", 3e4), ("internal", 2.4e5 - 0.15 * 1e5)):
        b = braking(monkeypatch, run=run(), pair=pair)
        b.run.result.energy = energy
        assert b.simulated_share == pytest.approx(entered / 4e5)
    b.scene.power_shares = sb.PowerShares(mechanical=0.2)
    assert b.simulated_share == pytest.approx(entered / 3.2e5)
    assert b.booked_words() == "the run has the shares of `Scene.power_shares`"
    assert b.booked_split().mechanical == pytest.approx(6e4)
    b.scene.power_shares = None
    assert b.booked_words() == "in the run all of it is heat"
    b.scene.heated = False
    with pytest.raises(Absent):
        _ = b.simulated_share


def test_pairs_of_a_staged_brake(monkeypatch):
    b = braking(monkeypatch, run=run())
    stages = [
        ("stage_1", 0.0, 1.5),
        ("stage_2", 1.5, 2.0),
        ("stage_1", 2.0, 2.2),
        ("stage_3", 2.2, 5.0),
        ("held", 5, 9),
    ]
    b.run.result.stages = [SimpleNamespace(name=n, start=s, end=e, duration=e - s) for n, s, e in stages]
    assert b.stage_times() == pytest.approx((1.7, 0.5, 2.8))
    b.__dict__["pair_runs"] = {"external": SimpleNamespace(work=np.array([0.0, 7e4])), "internal": None}
    assert b.pair_works == {"external": 7e4, "internal": 0.0, "both": 7e4}
    assert b.pair_shares() == {"external": 1.0, "internal": 0.0}
    b.__dict__["pair_runs"]["internal"] = SimpleNamespace(work=np.array([0.0, 3e4]))
    assert b.pair_shares() == pytest.approx({"external": 0.7, "internal": 0.3})
    own = {name: SimpleNamespace(time=t, work=w, omega=o, angle=a) for name, t, w, o, a in (
        ("external", 2.0, 6e4, 18.0, 20.0),
        ("internal", 1.0, 4e4, 11.0, 7.0),
    )}  # fmt: skip
    both = dataclasses.replace(b, run=None, stages=SimpleNamespace(**own))
    outer, inner = both.of_pairs()
    assert (outer.pair, outer.time, outer.work, outer.omega, outer.slid, outer.more) == (
        "external", 2.0, 6e4, 18.0, 20.0, 0.0
    )  # fmt: skip
    assert (inner.pair, inner.time, inner.work, inner.omega, inner.slid) == ("internal", 1.0, 4e4, 11.0, 7.0)
    assert inner.more == pytest.approx(0.15 * 0.7 * 6e4)
    own["internal"].work = 0.0
    assert [one.pair for one in both.of_pairs()] == ["external"]


def test_interval_of_the_most_friction_work():
    t, work = np.arange(8.0), np.array([0.0, 0.0, 2.0, 3.0, 3.0, 4.0, 9.0, 9.0])
    assert _hardest(t, work) == (4, 6, 2)
    assert _hardest(t, np.zeros(8)) is None
    assert _hardest(t, np.array([1.0, 9.0, 9.0, 9.0, 9.0, 9.0, 9.0, 9.0])) == (0, 1, 1)
    s = SimpleNamespace(
        omega=np.array([9.0, 4.0]),
        brake_torque=np.array([1.0, 2.0]),
        bandage_speed=np.array([5.0, 6.0]),
        pairs={
            "external": SimpleNamespace(torque=np.array([7.0])),
            "internal": SimpleNamespace(torque=np.array([-8.0])),
        },
    )
    for pair, speed, torque in (("", [9, 4], [1, 2]), ("external", [5, 6], [7]), ("internal", [4, -2], [8])):
        found = _sliding(s, pair)
        np.testing.assert_array_equal(found[0], speed)
        np.testing.assert_array_equal(found[1], torque)


def made(work, fails=(), level=0, rim="brass", simulated=None, ends="melts"):
    compared = {name: Compared(1.0, None) for name in QUANTITIES} | {"surface": Compared(400.0, simulated)}
    return sb.formulas.MaterialRow(level, rim, "FK-24A", compared, fails, work, ends)


def test_ranking_is_by_admissible_then_work():
    rows = (
        made(3e6, ("hot",), rim="steel_20L"),
        made(1e6, rim="brass"),
        made(2e6, rim="cast_iron"),
        made(9e6, rim="brass", level=1),
    )
    rims = tuple(sb.formulas.rim_material(name) for name in ("steel_20L", "brass", "cast_iron"))
    linings = (sb.formulas.lining_material("FK-24A"),)
    levels = tuple(sb.formulas.EnergyLevel(words, 1e6, 2e6) for words in ("scene", "twice"))
    table = sb.formulas.MaterialComparison("about", levels, rims, linings, rows, ("a note",))
    assert [row.rim for row in table.ranking(0)] == ["cast_iron", "brass", "steel_20L"]
    assert [row.greatest_work for row in table.ranking()] == [9e6]
    assert table.row("brass") is rows[1]
    assert table.row("brass", level=-1) is rows[3]
    with pytest.raises(KeyError, match="no row 'gold' with 'FK-24A'; there are: rims steel_20L, brass, cast_iron; lin"):
        table.row("gold")
    assert not table.simulated


def test_linings_all_around_leave_no_gap():
    linings = sb.Lining(sb.ConstantFriction(0.3), np.radians([80.0, 90.0, 100.0, 90.0]), 0.7 * 0.2 * np.pi / 2)
    brake = sb.Brake(sb.Pulley(0.7, 800.0, 0.2), sb.Band(0.7), linings)
    edges, lining = _around(brake, np.asarray(linings.area))
    # faces of 90° in sections from the tight end on: the first is cut to its 80°, that of 100° lies in its middle
    wide = np.radians([0.0, 90.0, 95.0, 185.0, 190.0, 280.0]) / (2 * math.pi)
    np.testing.assert_allclose(edges, wide, atol=1e-12)
    assert lining.tolist() == [3, -1, 2, -1, 1, 0]
    edges, lining = _around(brake, np.full(4, 1.0))
    np.testing.assert_allclose(edges, np.radians([0.0, 90.0, 190.0, 280.0]) / (2 * math.pi))
    assert lining.tolist() == [3, 2, 1, 0]


def test_numbers_with_units_and_all_errors():
    data, limits = read_given(["rim_thickness=28 mm", "rim=cast_iron", "permissible.back=130 degC", "ambient=30 degC"])
    assert data.rim_thickness == pytest.approx(0.028)
    assert float(data.rim.conductivity) == 50.0
    assert limits.back == pytest.approx(403.15)
    assert data.ambient == pytest.approx(303.15)
    assert data.elastic is None
    assert read_given(["permissible.stress=200 MPa"])[0].elastic.permissible == 200e6
    with pytest.raises(sb.InputError) as error:
        read_given(["nonsense", "rims=1", "rim=gold", "share=2", "rim_thickness=3 kg"])
    assert len(error.value.faults) == 5
