"""Data of the pages by hand: charts, sliders, sequences, cells, tables, rows and words that a browser only shows."""

import dataclasses
import math
import re
from types import SimpleNamespace

import numpy as np
import pytest
from disc_scenes import disc_scene
from shoe_scenes import shoe_scene
from stop_scenes import stop_scene

import simbrake as sb
from simbrake._pages import _app, _live, _page, _publish
from simbrake.hybrid import FINISHED, LANDED, STOPPED
from simbrake.studies import Sensitivity


@pytest.fixture(scope="module")
def run():
    return sb.simulate(stop_scene(load=300.0, T0=8e3))


def test_charts_are_those_of_the_columns_and_in_their_units():
    def column(k):
        return np.asarray([1e3 * k, 2e3 * k])

    def each(k):
        return np.asarray([[1.0, 3.0], [4.0, 2.0]]) * k

    scalars = dict(
        zip(("omega", "brake_torque", "load_torque", "tight_tension", "slack_tension"), range(1, 6), strict=True)
    )
    scalars |= {"bandage_speed": 6, "shaft_torque": 7, "lever_force": 8, "hook_position": 9, "at_limit": 10}
    tables = {"normal_load": 1e3, "rim_temperature": 100.0, "lining_temperature": 200.0, "band_temperature": 300.0}
    tables |= {"friction_coefficient": 0.1}
    s = SimpleNamespace(**{k: column(x) for k, x in scalars.items()}, **{k: each(x) for k, x in tables.items()})

    def found(scene, s):
        charts = _live.charts_of(scene, s)
        return {
            chart.title: (chart.unit, [(line.label, line.dashed, float(y[0])) for line, y in zip(
                chart.lines, chart.values(s), strict=True)]) for chart in charts
        }  # fmt: skip

    assert found(stop_scene(n=3), s) == {
        "Speed": ("rad/s", [("pulley ω", False, 1e3), ("bandage", True, 6e3)]),
        "Torque": ("kN·m", [("brake", False, 2.0), ("load", True, 3.0), ("others on the shaft", False, 7.0)]),
        "Tension of the band": ("kN", [("tight end", False, 4.0), ("slack end", False, 5.0)]),
        "Surface temperature": (
            "°C",
            [
                ("hottest rim", False, pytest.approx(26.85)),
                ("hottest lining", False, pytest.approx(326.85)),
                ("band", False, pytest.approx(626.85)),
            ],
        ),
        "Coefficient of friction, sliding": (
            "–",
            [("lowest of the linings", False, pytest.approx(0.1)), ("highest", True, pytest.approx(0.3))],
        ),
        "Travel of the hook": ("m", [("hook, downwards", False, 9e3)]),
        "At the limit, of 3": ("–", [("linings at their friction limit", False, 1e4)]),
    }
    absent = dict.fromkeys(("bandage_speed", "shaft_torque", "hook_position", "friction_coefficient"))
    absent |= dict.fromkeys(("rim_temperature", "lining_temperature", "band_temperature"))
    few = found(disc_scene(), SimpleNamespace(**{**vars(s), **absent}))
    assert list(few) == ["Speed", "Torque", "Forces", "At the limit, of 4"]
    assert [len(lines) for _, lines in few.values()] == [1, 2, 2, 1]
    assert few["Forces"] == ("kN", [("largest normal force on a pad", False, 3.0), ("actuator", True, 8.0)])
    assert few["Speed"][1][0][0] == "disc ω"
    stepped = [chart.stepped for chart in _live.charts_of(stop_scene(n=3), s)]
    assert stepped == [False] * 6 + [True]
    assert len(_publish.smooth(_live.charts_of(stop_scene(n=3), s))) == 6
    data = _live.charts_of(stop_scene(n=3), s)[0].as_dict()
    assert (data["title"], data["unit"], data["stepped"]) == ("Speed", "rad/s", False)
    assert [line["dashed"] for line in data["lines"]] == [False, True]


def test_places_of_linings_in_the_film():
    """Pads in pairs around the disc, one outside and one inside; shoes on both sides of their pins at the bottom."""
    scene = disc_scene()
    pads = scene.brake.linings
    places = np.asarray(_live._places(scene))
    inner = float(pads.inner_radius) / float(pads.outer_radius)
    middle = 0.5 * (inner + 0.97)
    angles = np.asarray([0.5, 0.5, 1.5, 1.5]) * math.pi
    np.testing.assert_allclose(places[:, 0], angles - 0.35, rtol=1e-12)
    np.testing.assert_allclose(places[:, 1], angles + 0.35, rtol=1e-12)
    np.testing.assert_allclose(places[:, 2:], [[middle, 0.97], [inner, middle]] * 2, rtol=1e-12)
    scene = shoe_scene()
    start, end = float(scene.brake.linings.start), float(scene.brake.linings.end)
    left, right = -0.5 * math.pi - 0.12, -0.5 * math.pi + 0.12
    wanted = [[left - end, left - start, 0.82, 0.93], [right + start, right + end, 0.82, 0.93]]
    np.testing.assert_allclose(_live._places(scene), wanted, rtol=1e-12)
    band = np.asarray(_live._places(stop_scene(n=3, beta=60.0)))
    np.testing.assert_allclose(band[:, 1] - band[:, 0], math.radians(60.0), rtol=1e-12)
    assert band[:, 0].tolist() == sorted(band[:, 0], reverse=True)  # from the slack end at the left
    assert all(_live.drawable(scene) for scene in (disc_scene(), shoe_scene(), stop_scene(n=3)))


def test_colours_are_those_of_a_page():
    assert (_live._css("#12ab34"), _live._css("0.5"), _live._css("0"), _live._css("1")) == (
        *("#12ab34", "#808080", "#000000", "#ffffff"),
    )


def test_range_and_unit_of_a_slider():
    def about(unit, low=None, high=None, difference=False):
        return SimpleNamespace(unit=unit, low=low, high=high, difference=difference, meaning="what it is")

    def found(*arguments):
        one = _app.slider_of("x", *arguments)
        assert (one["path"], one["meaning"]) == ("x", "what it is")
        return [one[name] for name in ("value", "low", "high", "factor", "offset", "unit")]

    assert found(4e3, about("N")) == [4e3, 2e3, 6e3, 1e-3, 0.0, "kN"]
    assert found(-4e3, about("N")) == [-4e3, -6e3, -2e3, 1e-3, 0.0, "kN"]
    assert found(0.0, about("1")) == [0.0, 0.0, 1.0, 1.0, 0.0, "–"]
    assert found(0.8, about("1", 0.5, 1.0)) == [0.8, 0.5, 1.0, 1.0, 0.0, "–"]
    assert found(800.0, about("N")) == [800.0, 400.0, 1200.0, 1e-3, 0.0, "kN"]
    assert found(300.0, about("K")) == [300.0, 150.0, 450.0, 1.0, -273.15, "°C"]
    assert found(300.0, about("K", difference=True))[3:] == [1.0, 0.0, "K"]
    assert found(3.0, about("N", 2.0, 4.0), (1.0, 5.0)) == [3.0, 1.0, 5.0, 1.0, 0.0, "N"]
    assert found(3.0, about("N"), (2.0, 2.0))[1:3] == [2.0, 3.0]


def test_sliders_are_in_groups_with_the_duty_first():
    scene = sb.with_values(stop_scene(n=3), {"brake.linings.angle[1]": 0.5})
    controls = _app.sliders(scene)
    paths = [one["path"] for one in controls]
    assert [path for path in paths if "angle" in path] == [f"brake.linings.angle[{i}]" for i in range(3)]
    angles = [one["value"] for one in controls if "angle" in one["path"]]
    assert angles == pytest.approx([math.radians(13.5), 0.5, math.radians(13.5)])
    heads = [path.partition(".")[0] for path in paths]
    assert heads == sorted(heads, key=["duty", "initial", "brake", "end_time"].index)
    groups = {one["path"]: one["group"] for one in controls}
    assert groups["brake.pulley.inertia"] == "brake.pulley"
    assert groups["end_time"] == "scene"
    alike = [one["path"] for one in _app.sliders(stop_scene(n=3)) if "angle" in one["path"]]
    assert alike == ["brake.linings.angle"]


def test_values_of_sliders_are_numbers_of_the_scene(run):
    app = _app.App(run.scene, {}, " two\n words ")
    assert float(app.edited({"initial.omega": 12}).initial.omega) == 12.0
    for wrong in ([], None, {"nix": 1.0}, {"initial.omega": "1"}, {"initial.omega": True}, {"initial.omega": None}):
        with pytest.raises(ValueError, match="not"):
            app.edited(wrong)
    saved = app.saved({"initial.omega": 12.0})
    assert saved["name"] == "scene.toml"
    assert saved["text"].startswith("# two words, changed in the app\n")
    locked = _app.App(stop_scene(C=None), {}, "").saved({"brake.linings.friction.coefficient": 9.0})
    assert "self-locking" in locked["problem"]
    assert "text" not in locked
    own = _app.App(stop_scene(lever=sb.profiles.FunctionProfile(lambda t, parameters: 1.0 + 0.0 * t)), {}, "")
    assert "duty.slack_tension" in own.saved({})["problem"]


def test_axes_of_a_publication(run):
    (speed, load) = _publish.read_axes(
        run.scene, ["initial.omega = 10 : 30 : 5", "duty.load.profile.level=1 kN*m:2 kN*m:2"]
    )
    assert speed == ("initial.omega", (10.0, 15.0, 20.0, 25.0, 30.0))
    assert load == ("duty.load.profile.level", (1e3, 2e3))
    refused = {
        "initial.omega=1:2:1": "is not a range of points",
        "initial.omega=2:2:3": "is not a range of points",
        "initial.omega=1:2:x": "is not of the form",
        "brake.linings.area=1:2:3": "is absent in this scene",
    }
    for text, words in refused.items():
        with pytest.raises(sb.InputError) as caught:
            _publish.read_axes(run.scene, [text])
        assert len(caught.value.faults) == 1
        assert words in str(caught.value)
    with pytest.raises(sb.InputError, match="is given twice"):
        _publish.read_axes(run.scene, ["initial.omega=1:2:3"] * 2)
    with pytest.raises(sb.InputError, match="--vary: is given 4 times"):
        _publish.read_axes(run.scene, [f"brake.linings.angle[{i}]=0.1:0.2:2" for i in range(4)])
    assert len(_publish.read_axes(run.scene, ["initial.omega=1:2:4000"])[0].values) == 4000


def test_sequence_and_pieces_of_a_run():
    """Rows behind the count and steps inside a piece are no events; a corner has no guard."""
    kind = np.asarray([0, LANDED, 0, STOPPED, LANDED, FINISHED, LANDED])
    rows = SimpleNamespace(kind=kind, guard=np.asarray([9, 3, 9, 9, 4, 9, 9]))
    result = SimpleNamespace(status="stopped", record=SimpleNamespace(rows=rows, count=6))
    found = _publish.sequence_of(result)
    events = [(int(kind[i]), guard) for i, guard in ((1, 3), (3, -1), (4, 4), (5, 9)) if kind[i] >= LANDED]
    assert found == ("stopped", *events)
    assert _publish.pieces_of(found) == 4


def test_numbers_of_a_shorter_run_are_cut_out():
    """Two metrics, edges of three pieces, and two lines of three pieces with two samples each."""
    sampled = _publish.Sampled(("a", "b"), 3, 2)
    assert sampled.size(2) == 2 + 4 + 2 * 3 * 2
    row = np.arange(18.0)
    found = sampled.cut(np.stack([row, row + 100.0]), 2, 2)
    assert found[0].tolist() == [0, 1, 2, 3, 4, 6, 7, 8, 9, 12, 13, 14, 15]
    assert found[1].tolist() == (found[0] + 100.0).tolist()
    assert sampled._replace(pieces=2).size(2) == found.shape[1]
    values, slopes = np.asarray([1.0, math.inf, 3.0]), np.asarray([[1.0, 2.0], [3.0, 4.0], [math.nan, 6.0]])
    np.testing.assert_array_equal(
        _publish._rows(values, slopes), [[1.0, np.nan, 3.0], [1.0, 0.0, 0.0], [2.0, 0.0, 6.0]]
    )


def test_cells_of_a_grid_have_their_corners():
    """The last axis counts fastest: 3 × 4 points, 2 × 3 cells."""
    grid = _publish._Grid((), (3, 4), (), ())
    assert grid.cells == 6
    assert grid.corners(0) == ((0, 0), [0, 1, 4, 5])
    assert grid.corners(4) == ((1, 1), [5, 6, 9, 10])


def test_a_publication_says_how_good_it_is():
    about = _publish.Published(12, 2, 6, 3, 0, 0.0, "")
    said = (
        "12 points solved, 2 of them failed; 3 of 6 cells between them are gaps, where the sequence of events changes"
    )
    assert str(about) == said
    whole = about._replace(failed=0, checked=3, deviation=0.0123, of="Stopping time")
    assert str(whole) == (
        said.replace(", 2 of them failed", "")
        + "; at 3 centres of cells the largest deviation is 1.2 % (Stopping time)"
    )
    assert whole.as_dict()["deviation"] == 0.0123


def test_metrics_and_sliders_of_a_publication(run):
    found = _publish._metric("max_tension", run, {"max_tension": 7.0})
    assert (found["words"], found["unit"], found["si_unit"], found["limit"]) == (
        *("Maximum tension of the band", "kN", "N", 7.0),
    )
    assert (found["factor"], found["offset"]) == (1e-3, 0.0)
    assert _publish._metric("stopping_time", run, {})["limit"] is None
    short = sb.simulate(stop_scene(load=300.0, T0=8e3, end=0.3))
    assert _publish._metric("stopping_time", short, {})["unit"] == "s"
    hot = SimpleNamespace(scene=SimpleNamespace(network=SimpleNamespace(permissible=np.asarray(500.0))))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_publish, "measure", lambda *_: 400.0)
        found = _publish._metric("peak_lining_temperature", hot, {})
        assert (found["limit"], found["offset"], found["unit"]) == (500.0, -273.15, "°C")
        assert _publish._metric("peak_lining_temperature", hot, {"peak_lining_temperature": 450.0})["limit"] == 450.0
        assert _publish._metric("peak_rim_temperature", hot, {})["limit"] is None
    axis = _publish.Axis("brake.linings.angle[2]", (0.1, 0.2, 0.4))
    found = _publish._slider(run.scene, axis)
    assert (found["value"], found["low"], found["high"], found["values"]) == (
        *(pytest.approx(math.radians(13.5)), 0.1, 0.4, axis.values),
    )


def test_sequences_of_a_publication_say_how_the_run_ended(run):
    found = _publish._sequence(run, 3, _publish.Sampled(("a",), 9, 5), 2)
    assert (found["pieces"], found["size"]) == (3, 1 + 4 + 2 * 3 * 5)
    assert (found["status"], found["colour"]) == ("Stopped", "green")
    assert found["message"] == "the brake brought the pulley to rest and holds it"
    edges = [0.0, *(event.time for event in run.events if event.name != "lining_limit"), 5.0]
    assert len(found["events"]) == 3
    for event in found["events"]:
        assert edges[event["edge"]] == event["t"]
    away = sb.simulate(stop_scene(load=1e5, T0=8e3, end=0.3))
    turning = sb.simulate(stop_scene(load=300.0, T0=8e3, end=0.3))
    colours = [_publish._sequence(one, 1, _publish.Sampled((), 1, 2), 1)["colour"] for one in (away, turning)]
    assert colours == ["red", "amber"]


def test_tables_of_the_report_by_hand():
    nested = {"a_b": {"c": 1, "d": None}, "e": [1, "x"], "f": "y"}
    assert _page.flat(nested) == [("a b: c", "1"), ("a b: d", "—"), ("e", "1, x"), ("f", "y")]
    rows = [
        Sensitivity("m", "kg", "mass", 2.0, 1.23456, 0.5, note="kinks"),
        Sensitivity("none", "N", "force", 4.0, 1e-20, 1e-14),
        Sensitivity("zero", "N", "force", 0.0, 1e-20, 1e-14),
    ]
    found = [[str(x) for x in row.values()] for row in _page._sensitivity_table(rows)]
    assert found[0] == ["m", "mass", "2 kg", "1.2346", "0.5", "kinks"]
    assert found[1][3:5] == ["0", "0"]
    assert found[2][3:5] == ["10⁻²⁰", "10⁻¹⁴"]


def test_figures_of_a_page_have_names_and_conditions():
    pictures = {picture.key: picture for picture in _page.PICTURES}
    assert list(pictures) == [
        *("stop", "stops", "pulley", "pressed", "lining_map-normal_load", "stages", "contacts", "temperatures"),
        *("depth", "lining_map-temperature"),
    ]
    assert [key for key, picture in pictures.items() if picture.drawn] == ["stop", "pulley", "pressed"]
    for picture in pictures.values():
        assert not re.search(r"`|\n|Raises|Example", picture.caption)
        begins = getattr(sb.plot, picture.name).__doc__.splitlines()[0].replace("`", "")
        assert picture.caption.startswith(begins)

    def wanted(scene, **result):
        found = {"stops": [1], "record": SimpleNamespace(modes=SimpleNamespace(contacts={})), **result}
        one = SimpleNamespace(scene=scene, **found)
        return {key for key, picture in pictures.items() if picture.wanted(one)}

    always = {"stop", "lining_map-normal_load"}
    assert wanted(stop_scene(n=3)) == always | {"pulley"}
    assert wanted(stop_scene(n=3), stops=[1, 2]) == always | {"pulley", "stops"}
    modes = SimpleNamespace(contacts={"lining": 1})
    assert wanted(disc_scene(), record=SimpleNamespace(modes=modes)) == always | {"pressed", "contacts"}
    one = sb.Heat((sb.thermal.Lump("linings", 5e3),), linings="linings")
    each = sb.Heat((sb.thermal.Lump("linings", 5e3, count=3),), linings="linings")
    for heat, more in ((one, set()), (each, {"lining_map-temperature"})):
        scene = dataclasses.replace(stop_scene(n=3), heat=heat)
        assert wanted(scene) == always | {"pulley", "temperatures"} | more


def test_columns_of_the_series_file(run):
    names, table = _page.series_table(run, 11)
    assert names[0] == "t [s]"
    assert {"omega [rad/s]", "tension_20 [N]", "normal_load_1 [N]"} <= set(names)
    assert table.shape[1] == len(names)
    t = table[:, 0]
    assert (t[0], t[-1]) == (0.0, 5.0)
    assert set(np.linspace(0.0, 5.0, 11)) <= set(t)
    events = np.unique([event.time for event in run.events if event.time > 0])
    assert all(np.count_nonzero(t == time) == 2 for time in events)
    at = int(np.flatnonzero(t == 2.5)[0])
    s = run.series([2.5])
    assert table[at, names.index("tension_20 [N]")] == float(s.tension[0, 19])
    assert table[at, names.index("phi [rad]")] == float(s.phi[0])
