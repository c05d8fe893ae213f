"""Every figure of `simbrake.plot`: its example runs, texts are legible at half size,
axes have units."""

import dataclasses
import doctest
import inspect
import itertools
import json
import re

import numpy as np
import pytest
import rig_recordings
from commands import call
from goldens import assert_kept, words_of
from helpers import all_equal, all_near
from matplotlib.figure import Figure
from matplotlib.text import Text
from paper_figures import PUBLISHED, published
from picture_scenes import (
    chain_result,
    disc_result,
    hot_result,
    plain_result,
    shoe_result,
    small_stop,
    staged_result,
)
from scenes import replaced, stop_run

import simbrake as sb
from simbrake import plot
from simbrake.plot.drawing import TEXT

HOMES = (plot, plot.panels, sb.layouts.figures, sb.formulas.figures, sb.rig.figures)
DRAWN = {
    name: function
    for home in HOMES
    for name in getattr(home, "__all__", vars(home))
    for function in [getattr(home, name)]
    if inspect.isfunction(function)
    and function.__module__.startswith(home.__name__.removesuffix(".panels"))
    and name[0] != "_"
}
#: axes without a unit: counts and names
COUNTED = r"lining,|lining$|number of the stop|^\$k\$ of \d+|brake applications|^(ex|in)ternal pair$|^$"


def drawn_texts(figure):
    """Texts of a figure with their places (pixels): no slanted ones, whose boxes are
    larger than they are, and none of ticks out of sight."""
    figure.draw_without_rendering()
    hidden = set()
    for axis in (axis for axes in figure.axes for axis in (axes.xaxis, axes.yaxis)):
        low, high = sorted(axis.get_view_interval())
        slack = 1e-9 * (high - low)
        for tick in axis.get_major_ticks():
            if not low - slack <= tick.get_loc() <= high + slack:
                hidden |= {tick.label1, tick.label2}
    return [
        (text.get_text(), text.get_window_extent())
        for text in figure.findobj(Text)
        if text not in hidden and text.get_visible() and text.get_text().strip()
        if text.get_rotation() % 90 == 0
    ]


def check(figure):
    """Every axis names its unit, every text can be read at half size, and none covers
    another."""
    root = figure.get_figure(root=True)
    for axes in root.axes:
        labels = [axes.get_xlabel(), axes.get_ylabel()] if axes.axison else []
        for label in labels:
            words = label.replace("\n", " ")
            assert re.search(r", \S+( \(.*\))?$|\(–\)|, % |, 1/s", words) or re.search(
                COUNTED, words
            ), words
    texts = [text for text in root.findobj(Text) if text.get_text().strip()]
    assert min(text.get_fontsize() for text in texts) / 2 >= 6
    for (one, place), (other, there) in itertools.combinations(drawn_texts(root), 2):
        wide = min(place.x1, there.x1) - max(place.x0, there.x0)
        high = min(place.y1, there.y1) - max(place.y0, there.y0)
        # (the boxes have some white above and below the letters)
        assert wide < 2 or high < 0.3 * TEXT, (one, other)


# --- the examples -------------------------------------------------------------------


def trip():
    """Two stands run in: the hook takes the string, and sets it in the slips."""
    load = sb.TrippingLoad("8 t", "12 t", 800.0, 0.5, 3.5, 4.0, 0.4, 8, count=2)
    scene = small_stop()
    return sb.simulate(dataclasses.replace(scene, duty=sb.Duty("12 kN", load)))


def life():
    wear = sb.Wear(1e-14, permissible=8e-3)
    changes = {"brake.linings.area": np.full(8, 0.05), "wear": wear}
    return sb.lining_life(replaced(small_stop(), changes))


#: what the examples have besides a scene and its result, as far as they name it
GIVEN = {
    "heated": hot_result,
    "staged": staged_result,
    "chain": chain_result,
    "trip": trip,
    "disc": disc_result,
    "life": life,
    "book": rig_recordings.book,
    "comparison": rig_recordings.comparison,
    "rims": lambda: sb.formulas.EstimateData(track_area=1.6),
}


@pytest.fixture(scope="module")
def given():
    scene = small_stop()
    return {"sb": sb, "scene": scene, "result": sb.simulate(scene)}


@pytest.mark.parametrize("name", DRAWN)
def test_example_and_rules(name, given, tmp_path, request):
    words = inspect.getdoc(DRAWN[name])
    (test,) = doctest.DocTestFinder(recurse=False).find(
        inspect.unwrap(DRAWN[name]), name, globs=dict(given)
    )
    test.globs |= {
        key: make() for key, make in GIVEN.items() if re.search(rf"\b{key}\b", words)
    } | {"folder": tmp_path}
    said = []
    failed, tried = doctest.DocTestRunner(verbose=False).run(
        test, out=said.append, clear_globs=False
    )
    assert tried
    assert not failed, "".join(said)
    made = test.globs.get("axes", test.globs.get("figure"))
    if made is not None:
        figure = made.get_figure(root=True)
        check(figure)
        # (the words of panels of a run are in the sheets)
        if name not in plot.panels.__all__:
            assert_kept(request, f"figures/{name}", words_of(figure))


def test_panel_in_given_axes(given):
    """A panel draws into the axes that it is given, and nowhere else: a figure of two
    panels, one for the stop and one of one's own."""
    figure = Figure()
    left, right = figure.subplots(1, 2)
    series = given["result"].series(np.linspace(0.2, 0.4, 50))
    assert plot.panels.torques(given["result"], series=series, ax=left) is left
    x, y = left.lines[0].get_data()
    all_equal(x, series.t)
    all_near(y, series.brake_torque / 1e3)
    (table,) = sb.sensitivity(given["scene"], ["stopping_time"], ["duty.load.mass"])
    assert plot.tornado(table, ax=right) is right
    assert figure.axes == [left, right]
    assert not figure.legends
    assert not figure.get_suptitle()


@pytest.mark.parametrize(
    ("count", "wrap"),
    [(8, "290 deg"), (8, "320 deg"), (8, "345 deg"), (200, "270 deg")],
)
def test_labels_of_wide_wraps_and_many_linings_lie_apart(count, wrap):
    linings = sb.uniform_linings(count, wrap, 0.35)
    scene = replaced(small_stop(), {"brake.linings": linings})
    check(plot.pulley(sb.simulate(scene), 0.1))


def test_rest_of_a_pulley_is_relative_to_its_run():
    """Half of a stop from 1e-6 rad/s."""
    result = stop_run(n=4, beta=60.0, C=None, T0=4e-4, w0=1e-6)
    texts = plot.pulley(result, result.metrics["stopping_time"] / 2).axes[0].texts
    assert "$\\omega$\n5·10⁻⁷\nrad/s" in [text.get_text() for text in texts]


def test_title_stands_above_a_legend_of_two_lines():
    """Narrow panels of the whole run and of one of its two stops."""
    lever = sb.profiles.held([0.0, 3.0, 4.0, 9.0], [12e3, 0.0, 12e3, 12e3])
    motor = sb.loads.Motor(
        "60 kN*m", "1 MW", "40 rad/s", speed=sb.ramp(5.0, 5.0, 0.0, 1.0)
    )
    duty = sb.Duty(lever, sb.HookLoad("20 t", 0.4, 8))
    scene = dataclasses.replace(small_stop(), duty=duty, motor=motor, end_time=9.0)
    check(plot.stop(sb.simulate(scene)))


def test_forces_of_parallel_bands_are_sums():
    bands = sb.brakes.ParallelBands((2e5, 3e5))
    scene = replaced(small_stop(), {"brake.band.stiffness": bands})
    figure = plot.stop(sb.simulate(scene))
    assert figure.legends[0].get_title().get_text() == (
        "forces are sums of 2 parallel bands"
    )


#: runs that are no example, how they are drawn, and which of these figures obey the
#: rules by themselves
OTHER = {
    "plain": (plain_result, ("stop", "pulley", "duty")),
    "hot": (hot_result, ("stop", "pulley", "duty")),
    "staged": (staged_result, ("stop", "pulley", "duty")),
    "disc": (disc_result, ("stop", "duty")),
    "shoe": (shoe_result, ("stop", "pressed", "duty")),
}


@pytest.mark.parametrize("name", OTHER)
def test_rules_for_figures_of_other_runs(name, request):
    make, drawn = OTHER[name]
    words = ""
    for kind in drawn:
        figure = getattr(plot, kind)(make())
        words += f"--- {kind}\n{words_of(figure)}"
        if name in ("plain", "hot", "staged"):
            check(figure)
    if name in ("staged", "disc", "shoe"):
        assert_kept(request, f"figures/of_{name}", words)


@pytest.mark.parametrize("name", PUBLISHED)
def test_rules_for_figures_of_the_papers(name):
    check(published(name))


def test_commands_write_figures(given, tmp_path, capsys):
    """Of two equal results and a heavier load; of a sweep."""
    saved = sb.save(given["result"], tmp_path / "a.nc")
    heavy = tmp_path / "heavy.toml"
    sb.write_scene(sb.with_values(given["scene"], {"duty.load.mass": 24e3}), heavy)
    asked = ("compare", saved, saved, heavy, "--json", "--out", tmp_path / "out")
    code, out, _ = call(capsys, *map(str, asked))
    found = json.loads(out)
    assert [one["equal"] for one in found["comparisons"]] == [True, False]
    assert (code, found["equal"]) == (1, False)
    vary = ("--vary", "duty.load.mass=18e3:22e3:3", "--metrics", "stopping_time")
    asked = ("sweep", heavy, *vary, "--out", tmp_path / "out")
    assert call(capsys, *map(str, asked))[0] == 0
    names = {file.name for file in (tmp_path / "out").iterdir()}
    assert names >= {"compare.json", "compare.png", "runs.csv", "runs.nc", "sweep.png"}


def test_sequence_is_that_of_the_event_logs(given):
    """A sweep numbers the sequences of events of its runs."""
    mass = np.linspace(10e3, 60e3, 6)
    grid = sb.sweep(given["scene"], {"duty.load.mass": mass}, ["stopping_time"])
    seen = {}
    for value, number in zip(mass, grid["sequence"].values.tolist(), strict=True):
        scene = sb.with_values(given["scene"], {"duty.load.mass": value})
        events = sb.simulate(scene, throw=False).events
        names = tuple((event.name, event.lining) for event in events)
        assert seen.setdefault(names, number) == number
    assert len(set(seen.values())) == len(seen) >= 2
