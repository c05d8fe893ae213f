"""Pictures show what the run has: read back from what is drawn, in the units that the axes name."""

import base64
import dataclasses
import json
import math
import pathlib
import re
import sys

import jax
import numpy as np
import pytest
from helpers import closed_form, stop_scene
from matplotlib.colors import to_hex
from matplotlib.patches import Wedge
from PIL import Image

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent))

import simbrake as sb
from benchmarks import report
from simbrake import plot
from simbrake._base._progress import Progress
from simbrake._pictures._plot_animation import Scenery
from simbrake._pictures._plot_film import film_of, ticks, words_of_rate
from simbrake._pictures._plot_wheel import CONTACT_COLOURS
from simbrake._run._lining_view import Contact

GAP = math.radians(2.0)


@pytest.fixture(scope="module")
def plain():
    """A stop with gaps between 8 linings and a soft linkage."""
    n, gaps = 8, np.full(7, GAP)
    gaps[3] = 3 * GAP
    band = sb.LiningsOnPlates(modulus=2e11, area=1.3e-3, slack_end=0.3, tight_end=0.5, linkage=2e5, gap=gaps)
    scene = stop_scene(n=n, beta=30.0, end=4.0)
    brake = dataclasses.replace(scene.brake, band=sb.Band(scene.brake.band.radius, band))
    return sb.simulate(dataclasses.replace(scene, brake=brake))


@pytest.fixture(scope="module")
def staged():
    """A staged brake on a rigid band, through all stages."""
    scene = stop_scene(n=6, beta=40.0, f=0.42, C=None, lever=sb.ramp(1e3, 15e3, 0.0, 0.5), end=4.0)
    bandage = sb.Bandage(inertia=20.0, friction=sb.ConstantFriction(0.28), preload=3e3)
    return sb.simulate(dataclasses.replace(scene, brake=dataclasses.replace(scene.brake, bandage=bandage)))


@pytest.fixture(scope="module")
def hot():
    """A stop with a rim in graded layers and a wall for each of 4 linings."""
    steel, lining = sb.material("steel_20L"), sb.material("FK-24A")
    heat = sb.layered_heat(
        rim=steel,
        rim_thickness=0.025,
        track_area=0.8,
        rim_layers=6,
        rim_first=1e-3,
        lining=lining,
        lining_thickness=0.03,
        lining_area=0.6,
        lining_layers=3,
        each=4,
        partition=sb.EffusivityPartition(steel, lining),
    )
    scene = stop_scene(n=4, beta=60.0, lever=sb.ramp(2e3, 20e3, 0.0, 0.3), end=2.5)
    return sb.simulate(dataclasses.replace(scene, heat=heat))


def radius(xy):
    return np.hypot(*np.asarray(xy, float).T)


def wedges(axes, gid):
    return [p for p in axes.patches if isinstance(p, Wedge) and p.get_gid() == gid]


def scale(axes, gid):
    """Value of a radius, from the two ends of a scale as it is written in the picture."""
    texts = [t for t in axes.texts if t.get_gid() == gid]
    values = np.asarray([float(t.get_text().removesuffix(" kN")) for t in texts])
    radii = radius([t.get_position() for t in texts])
    assert texts[-1].get_text().endswith(" kN")
    slope = (values[-1] - values[0]) / (radii[-1] - radii[0])
    return lambda r: values[0] + slope * (np.asarray(r) - radii[0])


@pytest.mark.parametrize("name", ["plain", "staged", "hot"])
def test_pulley_shows_tensions_and_loads_of_the_run(name, request):
    result = request.getfixturevalue(name)
    time = 0.5 * float(result.stopping_time)
    axes = plot.pulley(result, time).axes[0]
    s = result.series([time])
    n = s.tension.shape[1]
    tension = np.append(s.slack_tension, s.tension[0]) / 1e3
    (line,) = [x for x in axes.lines if x.get_gid() == "tension"]
    drawn = scale(axes, "tension scale")(radius(line.get_xydata())).reshape(n, 2)
    np.testing.assert_allclose(drawn, np.stack([tension[:-1], tension[1:]], axis=1), rtol=1e-9)
    bars = wedges(axes, "load")
    loads = scale(axes, "load scale")([bar.r - bar.width for bar in bars])
    np.testing.assert_allclose(loads, np.asarray(s.normal_load)[0] / 1e3, rtol=1e-9)
    for gid, values in (("T", tension), ("N", s.normal_load[0] / 1e3)):
        written = [float(t.get_text()) for t in axes.texts if t.get_gid() == gid]
        np.testing.assert_allclose(written, values, rtol=6e-3)
    words = " ".join(t.get_text() for t in axes.texts)
    assert "slack end" in words
    assert "tight end" in words
    assert f"Tₙ = {tension[-1]:.4g} kN" in words
    assert f"t = {time:.6g} s" in axes.figure.get_suptitle()


def test_linings_lie_at_their_true_angles_with_gaps(plain):
    axes = plot.pulley(plain).axes[0]
    drawn = wedges(axes, "external")
    span = np.asarray([[w.theta2, w.theta1] for w in drawn])
    np.testing.assert_allclose(span[:, 0] - span[:, 1], 30.0, rtol=1e-12)
    gaps = np.full(7, 2.0)
    gaps[3] = 6.0
    np.testing.assert_allclose(span[:-1, 1] - span[1:, 0], gaps, rtol=1e-9)
    assert span[0, 0] + span[-1, 1] == pytest.approx(180.0)  # the wrap is centred on the top
    # slack end at the left, where the pulley that turns counter-clockwise runs off
    assert span[0, 0] > 90 > span[-1, 1]


def test_default_time_is_that_of_the_greatest_tension(plain):
    figure = plot.pulley(plain)
    assert "when the tension is greatest" in figure.get_suptitle()
    written = [float(t.get_text()) for t in figure.axes[0].texts if t.get_gid() == "T"]
    assert max(written) == pytest.approx(plain.metrics["max_tension"] / 1e3, rel=6e-3)


def test_linings_have_the_colour_of_what_they_do(plain, staged):
    onset, full = float(plain.slip_onset_time), float(plain.full_slip_time)
    colours = {to_hex(colour): kind for kind, colour in CONTACT_COLOURS.items()}

    def seen(result, time, pair="external"):
        return [colours[to_hex(w.get_facecolor())] for w in wedges(plot.pulley(result, time).axes[0], pair)]

    middle = 0.5 * (onset + full)
    k = int(plain.series([middle]).at_limit[0])
    assert 0 < k < 8
    assert seen(plain, middle) == [Contact.AT_LIMIT] * k + [Contact.STICKS] * (8 - k)
    assert seen(plain, 0.5 * float(plain.stopping_time)) == [Contact.SLIDES] * 8
    late = 0.5 * (float(staged.external_lock_time) + float(staged.stopping_time))
    assert seen(staged, late, "internal") == [Contact.SLIDES] * 6
    assert Contact.SLIDES not in seen(staged, late)
    early = 0.5 * float(staged.internal_slip_time)
    assert seen(staged, early, "internal") == [Contact.STICKS] * 6
    assert seen(staged, early) == [Contact.SLIDES] * 6


def test_pulley_refuses_what_it_cannot_draw(plain):
    with pytest.raises(sb.InputError, match="outside the run"):
        plot.pulley(plain, 99.0)
    with pytest.raises(sb.InputError, match="outside the run"):
        plot.pulley(plain, math.nan)
    batch = jax.tree.map(lambda x: np.stack([x, x]), plain)
    for draw in (plot.pulley, plot.lining_map, plot.depth):
        with pytest.raises(sb.InputError, match="batch of runs"):
            draw(batch)


def test_chain_is_drawn_lining_by_lining():
    scene = stop_scene(n=4, beta=60.0, C=1e5, T0=2e3, w0=6.0, elongation=2e-2, end=0.05)
    linings = dataclasses.replace(scene.brake.linings, mass=4.0)
    band = sb.Band(scene.brake.band.radius, 1e5, sb.Segments(2e7))
    result = sb.simulate(dataclasses.replace(scene, brake=dataclasses.replace(scene.brake, band=band, linings=linings)))
    slips = {e.lining: e.time for e in result.events if e.name == "lining_slip"}
    # the front of slip runs from the tight end to the slack end
    time = 0.5 * (slips[4] + slips[3])
    drawn = wedges(plot.pulley(result, time).axes[0], "external")
    seen = [to_hex(w.get_facecolor()) for w in drawn]
    sticks, slides = (to_hex(CONTACT_COLOURS[c]) for c in (Contact.STICKS, Contact.SLIDES))
    assert seen == [sticks] * 3 + [slides]
    figure = plot.lining_map(result, "displacement")
    assert figure.axes[-1].get_ylabel().endswith(", mm")
    mesh = figure.axes[0].collections[0]
    edges = mesh.get_coordinates()[0, :, 0]
    shown = np.asarray(mesh.get_array()).reshape(4, -1)
    truth = np.asarray(result.series(0.5 * (edges[1:] + edges[:-1])).displacement).T * 1e3
    np.testing.assert_allclose(shown, truth, atol=1e-12)


# --- maps -------------------------------------------------------------------------------------------------------------


def mesh_of(axes):
    """Edges of the cells and values of a map, one row for each place."""
    mesh = axes.collections[0]
    corners = np.asarray(mesh.get_coordinates())
    return corners[0, :, 0], corners[:, 0, 1], np.asarray(mesh.get_array()).reshape(corners.shape[0] - 1, -1)


@pytest.mark.parametrize(
    ("quantity", "unit", "factor", "shift"),
    [("normal_load", "kN", 1e-3, 0.0), ("temperature", "°C", 1.0, -273.15), ("slip_speed", "m/s", 1.0, 0.0)],
)
def test_lining_map_shows_the_series(hot, quantity, unit, factor, shift):
    figure = plot.lining_map(hot, quantity)
    edges, _, shown = mesh_of(figure.axes[0])
    s = hot.series(0.5 * (edges[1:] + edges[:-1]))
    column = {"temperature": "lining_temperature"}.get(quantity, quantity)
    truth = np.asarray(getattr(s, column))
    truth = np.broadcast_to(truth if truth.ndim == 2 else truth[:, None], shown.T.shape)
    np.testing.assert_allclose(shown, factor * np.abs(truth.T) + shift, rtol=1e-9, atol=1e-9)
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert "lining, from the slack to the tight end" in labels
    assert any(label.endswith(f", {unit}") for label in labels)
    assert figure.axes[0].get_xlabel() == "time, s"
    # every event is an edge: no cell mixes what is before and after it
    inside = [e.time for e in hot.events if edges[0] <= e.time <= edges[-1]]
    assert np.max(np.min(np.abs(np.subtract.outer(inside, edges)), axis=1)) <= 1e-11


@pytest.mark.parametrize("pair", ["external", "internal"])
def test_friction_heat_of_a_map_adds_up(staged, pair):
    _, _, shown = mesh_of(plot.lining_map(staged, "friction_heat", pair=pair).axes[0])
    np.testing.assert_allclose(shown[:, -1] * 1e3, sb.friction_work(staged, pair=pair), rtol=1e-4)
    assert np.all(np.diff(shown, axis=1) >= 0)


def test_lining_map_refuses_what_the_run_has_not(plain, staged):
    for quantity, pair, words in (
        ("colour", "external", "there are: temperature, normal_load"),
        ("temperature", "external", "no heat"),
        ("pressure", "external", "brake.linings.area"),
        ("displacement", "external", "chain"),
        ("friction_coefficient", "external", "no heat"),
        ("slip_speed", "internal", "only a staged brake"),
        ("slip_speed", "middle", "is no pair"),
    ):
        with pytest.raises(sb.InputError, match=words):
            plot.lining_map(plain, quantity, pair=pair)
    with pytest.raises(sb.InputError, match="of the band"):
        plot.lining_map(staged, "tension", pair="internal")
    with pytest.raises(sb.InputError, match="no heat"):
        plot.depth(plain)


def test_depth_shows_the_layers(hot):
    figure = plot.depth(hot)
    field, profile = figure.axes[:2]
    edges, layers, shown = mesh_of(field)
    rim = hot.scene.heat.bodies[0]
    np.testing.assert_allclose(np.diff(layers), 1e3 * np.asarray(rim.steps), rtol=1e-9)
    nodes = [i for i, name in enumerate(hot.nodes) if name.startswith("rim")]
    truth = np.asarray(hot.series(0.5 * (edges[1:] + edges[:-1])).temperature)[:, nodes].T - 273.15
    np.testing.assert_allclose(shown, truth, rtol=1e-12)
    assert field.get_ylabel() == "depth below the front face, mm (graded)"
    assert profile.get_xlabel() == "temperature, °C"
    # graded: every layer is equally high in the picture
    heights = np.diff(field.transData.transform(np.stack([np.zeros_like(layers), layers], axis=1))[:, 1])
    np.testing.assert_allclose(heights, heights[0], rtol=1e-9)
    # the hottest profile is among those at the side
    hottest = shown[:, np.argmax(shown[0])]
    assert any(np.array_equal(line.get_xdata(), hottest) for line in profile.lines)


def test_depth_of_one_of_several_walls(hot):
    nodes = [i for i, name in enumerate(hot.nodes) if name.startswith("lining[2,")]
    edges, _, shown = mesh_of(plot.depth(hot, "lining", 2).axes[0])
    truth = np.asarray(hot.series(0.5 * (edges[1:] + edges[:-1])).temperature)[:, nodes].T - 273.15
    np.testing.assert_allclose(shown, truth, rtol=1e-12)
    assert "lining 4 of 4" in plot.depth(hot, "lining").get_suptitle()  # at the tight end it is hottest
    with pytest.raises(sb.InputError, match="there are: rim, lining"):
        plot.depth(hot, "flange")
    with pytest.raises(sb.InputError, match="1…4"):
        plot.depth(hot, "lining", 5)


# --- layouts ----------------------------------------------------------------------------------------------------------


def test_angles_add_up_to_the_wrap(plain):
    layout = sb.equal_increment_angles(0.3, 10, 10, math.radians(270.0))
    axes = plot.angles({"equal increments": layout, "with gaps": plain.scene}).axes[0]
    steps = [line for line in axes.lines if line.get_marker() == "None"]
    dots = {line.get_label().partition(":")[0]: line for line in axes.lines if line.get_marker() != "None"}
    np.testing.assert_allclose(dots["equal increments"].get_ydata(), np.degrees(layout.angle), rtol=1e-12)
    np.testing.assert_allclose(dots["uniform pitch"].get_ydata(), 27.0, rtol=1e-12)
    x = np.asarray(steps[0].get_xdata()).reshape(10, 3)
    np.testing.assert_allclose(x[:, 1] - x[:, 0], np.degrees(layout.angle), rtol=1e-12)
    assert x[-1, 1] == pytest.approx(270.0)
    x = np.asarray(steps[1].get_xdata()).reshape(8, 3)
    np.testing.assert_allclose(x[1:, 0] - x[:-1, 1], [2, 2, 2, 6, 2, 2, 2], rtol=1e-9)
    assert axes.get_xlabel().endswith(", °")
    assert axes.get_ylabel().endswith(", °")
    assert "Σβ = 270°" in axes.get_legend().get_texts()[0].get_text()
    # Z, table 6: first row
    assert dots["equal increments"].get_ydata()[0] == pytest.approx(50.3, abs=0.5)


def test_angles_name_every_fault():
    with pytest.raises(sb.InputError) as caught:
        plot.angles({"degrees": np.full(10, 27.0), "none": [], "words": "wide", "fine": np.full(4, 0.5)})
    assert [fault.path for fault in caught.value.faults] == ["given['degrees']", "given['none']", "given['words']"]
    assert "are they in degrees" in str(caught.value)
    with pytest.raises(sb.InputError, match="empty"):
        plot.angles({})


# --- work and precision -----------------------------------------------------------------------------------------------


def benchmark():
    rows = [
        {"method": "simbrake Dopri8", "seconds": 1e-4, "error": 1e-6},
        {"method": "simbrake Dopri8", "seconds": 2e-4, "error": 0.0},
        {"method": "Other RK4", "seconds": 3e-3, "error": 1e-4},
        {"method": "Other RK4", "seconds": 5e-3, "error": math.inf},
    ]
    scene = {"name": "a", "title": "stop", "reference": {"uncertainty": 1e-15}, "rows": rows}
    machine = {"cpu": "a processor", "cores": 2, "versions": {"simbrake": "0"}}
    return {"machine": machine, "fast_loops": False, "scenes": {"a": scene, "b": {**scene, "name": "b"}}}


def test_work_and_precision(tmp_path):
    file = tmp_path / "found.json"
    file.write_text(json.dumps(benchmark()), "utf-8")
    for data in (benchmark(), file, str(file)):
        figure = plot.work_precision(data)
        assert len(figure.axes) == 2
        lines = {line.get_label(): line for line in figure.axes[0].lines}
        np.testing.assert_allclose(lines["simbrake Dopri8"].get_xydata(), [[0.1, 1e-6], [0.2, 1e-16]])
        np.testing.assert_allclose(lines["Other RK4"].get_xydata(), [[3.0, 1e-4]])  # what failed has no mark
        assert figure.axes[0].get_xlabel().endswith(", ms")
    report.chart(benchmark(), str(tmp_path / "chart.png"))
    with Image.open(tmp_path / "chart.png") as image:
        assert min(image.size) > 500


def test_work_and_precision_refuses_other_files(tmp_path):
    with pytest.raises(sb.InputError, match="cannot be read"):
        plot.work_precision(tmp_path / "none.json")
    (tmp_path / "bad.json").write_text("{", "utf-8")
    with pytest.raises(sb.InputError, match="is no JSON"):
        plot.work_precision(tmp_path / "bad.json")
    with pytest.raises(sb.InputError, match=r"data\.scenes"):
        plot.work_precision({"rows": []})
    broken = benchmark()
    del broken["scenes"]["a"]["rows"][1]["error"], broken["scenes"]["b"]["title"]
    with pytest.raises(sb.InputError, match="2 faults"):
        plot.work_precision(broken)


# --- film -------------------------------------------------------------------------------------------------------------


def test_film_is_slow_where_slip_begins(plain):
    film = film_of(plain, 6.0, None, None)
    full, stop = float(plain.full_slip_time), float(plain.stopping_time)
    assert film.run == pytest.approx((0.0, 1.3 * full, 1.15 * stop))
    assert film.run_time(0.45 * 6.0) == pytest.approx(1.3 * full)
    at = np.linspace(0.0, 6.0, 50)
    np.testing.assert_allclose(film.film_time(film.run_time(at)), at, atol=1e-12)
    assert film.rate(0.1) == pytest.approx(2.7 / (1.3 * full))
    assert words_of_rate(film.rate(0.1)).startswith("slow motion")
    assert words_of_rate(0.01) == "100 times faster than the brake"
    places = ticks(film)
    assert all(0 <= t <= film.run[-1] for t, _ in places)
    assert {words.split()[1] for _, words in places} == {"ms", "s"}
    for t, words in places:
        value, unit = words.split()
        assert float(value) * (1e-3 if unit == "ms" else 1.0) == pytest.approx(t)
    # a window without an onset of slip runs evenly
    assert film_of(plain, 6.0, 0.5 * stop, 0.8 * stop).run == pytest.approx((0.5 * stop, 0.8 * stop))


@pytest.mark.parametrize("name", ["staged", "hot"])
def test_film_shows_the_run(name, request):
    result = request.getfixturevalue(name)
    times = np.linspace(0.0, 2.0, 9)
    film = film_of(result, 2.0, None, None)
    scenery = Scenery(result, film, times)
    for i in (1, 4, 8):
        scenery.show(i)
        t = film.run_time(times[i])
        s = result.series([t])
        x, y = (np.asarray(v)[0] for v in scenery.mark.get_data())
        phi = math.atan2(y, x) - math.pi / 2
        assert math.remainder(phi - float(s.phi[0]), 2 * math.pi) == pytest.approx(0.0, abs=1e-9)
        assert scenery.cursors[0].get_xdata()[0] == pytest.approx(t)
        if name == "hot":
            coldest, hottest = (float(f(s.lining_temperature)) - 273.15 for f in (np.min, np.max))
            assert scenery.hot[int(np.argmax(s.lining_temperature))].get_facecolor() == pytest.approx(
                scenery.colours.to_rgba(hottest)
            )
            assert scenery.norm.vmin <= coldest
        else:
            assert "internal" in scenery.wedges
    assert len(scenery.wedges["external"]) == result.scene.brake.linings.count


def test_spokes_vanish_where_the_film_cannot_follow(plain):
    film = film_of(plain, 2.0, 0.0, float(plain.stopping_time))
    coarse = Scenery(plain, film, np.linspace(0.0, 2.0, 4))
    coarse.show(2)
    assert coarse.mark.get_alpha() == 0.0
    assert "too fast to be seen" in coarse.title.get_text()
    coarse.show(0)
    fine = Scenery(plain, film, np.linspace(0.0, 2.0, 400))
    fine.show(390)
    assert fine.spokes[0].get_alpha() == fine.mark.get_alpha() == 1.0


def test_animation_writes_every_frame(plain, tmp_path):
    told = []
    file = plot.animate(
        plain, tmp_path / "new" / "stop.gif", duration=0.5, fps=10, progress=lambda *done: told.append(done)
    )
    with Image.open(file) as image:
        assert image.n_frames == 5
        assert image.info["duration"] == 100
        assert image.info["loop"] == 0
    assert told == [(i, 5) for i in range(1, 6)]
    page = plot.animate(plain, str(tmp_path / "stop.html"), duration=0.3, fps=10).read_text("utf-8")
    (frames,) = re.findall(r"const frames = (\[.*?\]), step = 100;", page)
    images = [base64.b64decode(frame) for frame in json.loads(frames)]
    assert len(images) == 3
    assert all(image.startswith(b"\x89PNG") for image in images)
    assert not re.search(r"https?://", page)  # works offline
    assert sorted(p.name for p in tmp_path.iterdir()) == ["new", "stop.html"]


def test_animation_refuses_what_makes_no_film(plain, tmp_path):
    for name, given, words in (
        ("stop.mp4", {}, "let it end in .gif or .html"),
        ("stop.gif", {"duration": 0.0}, "duration"),
        ("stop.gif", {"fps": 100}, "up to 50"),
        ("stop.gif", {"duration": 1e4}, "frames"),
        ("stop.gif", {"start": -1.0}, "outside the run"),
        ("stop.gif", {"start": 1.0, "end": 0.5}, "not after the start"),
    ):
        with pytest.raises(sb.InputError, match=words):
            plot.animate(plain, tmp_path / name, **given)
    assert not list(tmp_path.iterdir())


def test_progress_waits_before_it_speaks(capsys):
    line = Progress(3, True, what="frames", after=3600.0)
    line.add(3)
    line.close()
    assert capsys.readouterr().err == ""
    line = Progress(3, True, what="frames")
    line.add(3)
    line.close()
    assert "3/3 frames" in capsys.readouterr().err


# --- those that were there --------------------------------------------------------------------------------------------


def test_example_of_the_page_and_events_in_the_chart(tmp_path, monkeypatch):
    page = (pathlib.Path(__file__).parent.parent / "docs" / "pictures.md").read_text("utf-8")
    (example,) = re.findall(r"```python\n(.*?)```", page, re.S)
    monkeypatch.chdir(tmp_path)
    found = {}
    exec(compile(example, "pictures.md", "exec"), found)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["pulley.png", "stop.gif", "stop.png"]
    axes = plot.stop(found["result"]).axes
    lines = sorted({line.get_xdata()[0] for line in axes[0].lines if len(line.get_xdata()) == 2})
    truth = closed_form()
    np.testing.assert_allclose(lines, [truth["t0"], truth["t1"], truth["stop"]], rtol=1e-9)
    assert [panel.get_ylabel() for panel in axes[::2]] == ["ω, rad/s", "torque, kN·m", "tension, kN", "k of 20"]
    assert axes[6].get_xlabel() == "time, s"
    assert axes[7].get_xlabel() == "time, ms"


def test_page_names_every_picture():
    page = (pathlib.Path(__file__).parent.parent / "docs" / "pictures.md").read_text("utf-8")
    public = {name for name, value in vars(plot).items() if callable(value) and not name.startswith("_")}
    assert {name for name in public if f"plot.{name}(" not in page} == set()
    shown = set(re.findall(r"\]\((pictures/.*?\.png)\)", page))
    assert all((pathlib.Path(__file__).parent.parent / "docs" / name).stat().st_size <= 60e3 for name in shown)


def test_stages_show_overlaps_over_time(staged):
    figure = plot.stages(staged)
    labels = [panel.get_ylabel() for panel in figure.axes]
    assert labels == ["speed, rad/s", "torque, kN·m", "friction heat, kJ", "external overlap", "internal overlap"]
    ends = np.unique([s.start for s in staged.stages if s.name.startswith("stage_")])
    assert len([t for t in figure.axes[0].texts if t.get_text().startswith("stage ")]) == len(ends) == 3


def test_temperatures_have_units(hot):
    labels = [panel.get_ylabel() for panel in plot.temperatures(hot).axes]
    assert labels.count("temperature, °C") == 2
    assert "surface temperature, °C" in labels
