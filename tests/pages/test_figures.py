"""Every figure of `simbrake.plot`: its example runs, texts are legible at half size,
axes have units."""

import dataclasses
import doctest
import inspect
import json
import re

import numpy as np
import pytest
import rig_recordings
from commands import call
from goldens import assert_kept, words_of
from matplotlib.text import Text
from paper_figures import PUBLISHED, published
from picture_scenes import hot_result, plain_result, staged_result
from stop_scenes import stop_scene

import simbrake as sb
from simbrake import plot

HOMES = (plot, sb.layouts.figures, sb.formulas.figures, sb.rig.figures)
DRAWN = {
    name: function
    for home in HOMES
    for name, function in vars(home).items()
    if inspect.isfunction(function)
    and function.__module__.startswith(home.__name__)
    and name[0] != "_"
}
#: axes without a unit: counts and names
COUNTED = r"lining,|lining$|number of the stop|^\$k\$ of \d+|brake applications|^(ex|in)ternal pair$|^$"


def check(figure):
    """Every axis names its unit, and every text can be read at half size."""
    root = figure.get_figure(root=True)
    for axes in root.axes:
        labels = [axes.get_xlabel(), axes.get_ylabel()] if axes.axison else []
        for label in labels:
            words = label.replace("\n", " ")
            assert re.search(r", \S+( \(.*\))?$|\(–\)|, % |, 1/s", words) or re.search(
                COUNTED, words
            ), words
    assert (
        min(
            text.get_fontsize()
            for text in root.findobj(Text)
            if text.get_text().strip()
        )
        / 2
        >= 6
    )


# --- the examples -------------------------------------------------------------------


def small_stop():
    brake = sb.Brake(
        sb.Pulley(0.59, 1200.0), sb.Band(0.623), sb.uniform_linings(8, "270 deg", 0.35)
    )
    return sb.Scene(
        brake, sb.Duty("12 kN", sb.HookLoad("20 t", 0.4, 8)), sb.Initial(24.0), 4.0
    )


def chain():
    scene = stop_scene(n=4, beta=60.0, C=1e5, T0=2e3, w0=6.0, elongation=2e-2, end=0.05)
    band = sb.Band(scene.brake.band.radius, 1e5, sb.Segments(2e7))
    linings = dataclasses.replace(scene.brake.linings, mass=4.0)
    return sb.simulate(
        dataclasses.replace(
            scene, brake=dataclasses.replace(scene.brake, band=band, linings=linings)
        )
    )


def life():
    scene = small_stop()
    linings = dataclasses.replace(scene.brake.linings, area=np.full(8, 0.05))
    brake = dataclasses.replace(scene.brake, linings=linings)
    return sb.lining_life(
        dataclasses.replace(scene, brake=brake, wear=sb.Wear(1e-14, permissible=8e-3))
    )


#: what the examples have besides a scene and its result, as far as they name it
GIVEN = {
    "heated": hot_result,
    "staged": staged_result,
    "chain": chain,
    "disc": lambda: sb.simulate(sb.read_scene(sb.files.shipped("disc"))),
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
    said: list[str] = []
    failed, tried = doctest.DocTestRunner(verbose=False).run(
        test, out=said.append, clear_globs=False
    )
    assert tried
    assert not failed, "".join(said)
    if "figure" in test.globs:
        check(test.globs["figure"])
        assert_kept(
            request,
            f"figures/{name}",
            words_of(test.globs["figure"].get_figure(root=True)),
        )


def shoe():
    force = sb.PiecewiseLinear([0.0, 0.25, 9.0], [0.0, 2e3, 2e3])
    shoes = sb.Shoes(sb.ConstantFriction(0.32), 0.150, 0.032, 0.15, 2.2)
    brake = sb.ShoeBrake(12.0, shoes, 0.1227, 0.212)
    return sb.simulate(
        sb.Scene(brake, sb.ForceDuty(force, sb.TorqueLoad(0.0)), sb.Initial(25.0), 4.0)
    )


#: runs that are no example, how they are drawn, and which of these figures obey the
#: rules by themselves
OTHER = {
    "plain": (plain_result, ("stop", "pulley", "duty")),
    "hot": (hot_result, ("stop", "pulley", "duty")),
    "staged": (staged_result, ("stop", "pulley", "duty")),
    "disc": (GIVEN["disc"], ("stop", "duty")),
    "shoe": (shoe, ("stop", "pressed", "duty")),
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


# --- several runs -------------------------------------------------------------------


def test_compare_draws_each_result(given, tmp_path):
    heavy = sb.simulate(sb.with_values(given["scene"], {"duty.load.mass": 24e3}))
    hot = hot_result()
    stored = sb.save(heavy, tmp_path / "heavy.nc")
    figure = plot.compare(
        {"light": given["result"], "heavy": stored, "hot": sb.dataset(hot)}
    )
    check(figure)
    labels = [axes.get_ylabel().replace("\n", " ") for axes in figure.axes]
    assert labels == [
        "speed, rad/s",
        "brake torque, kN·m",
        "tension of the tight end, kN",
        "hottest surface, °C",
    ]
    speed = {
        line.get_label(): line
        for line in figure.axes[0].lines
        if not line.get_label().startswith("_")
    }
    assert list(speed) == ["light", "heavy", "hot"]
    assert (
        len({(line.get_color(), line.get_linestyle()) for line in speed.values()}) == 3
    )
    for name, run in (("light", given["result"]), ("heavy", heavy), ("hot", hot)):
        t = np.linspace(0.0, 2.4, 40)
        np.testing.assert_allclose(
            np.interp(t, *np.asarray(speed[name].get_data())),
            run.series(t).omega,
            rtol=1e-3,
            atol=1e-2,
        )
    # temperatures: of the one that has some, the hotter of both faces
    (line,) = figure.axes[3].lines
    top = max(hot.metrics[f"peak_{place}_temperature"] for place in ("rim", "lining"))
    assert np.max(line.get_ydata()) == pytest.approx(top - 273.15, rel=1e-3)
    # stops are marked on the curves of the speed
    stops = [
        line.get_xdata()[0] for line in figure.axes[0].lines if line.get_marker() == "D"
    ]
    np.testing.assert_allclose(
        stops, [run.stopping_time for run in (given["result"], heavy, hot)], rtol=1e-12
    )
    assert figure.axes[0].get_xlim()[1] == pytest.approx(1.15 * max(stops))
    with pytest.raises(sb.InputError, match="give two or more"):
        plot.compare([hot])


MASS = np.linspace(10e3, 60e3, 11)


@pytest.fixture(scope="module")
def grid(given):
    values = {"duty.load.mass": MASS, "initial.omega": [12.0, 24.0, 36.0]}
    return sb.sweep(
        given["scene"],
        values,
        ["stopping_time", "energy.friction_heat"],
        progress=False,
    )


def test_sequence_is_that_of_the_event_logs(given, grid):
    seen = {}
    for i, mass in enumerate(MASS):
        run = sb.simulate(
            sb.with_values(
                given["scene"], {"duty.load.mass": mass, "initial.omega": 24.0}
            ),
            throw=False,
        )
        names = tuple((event.name, event.lining) for event in run.events)
        number = int(grid["sequence"][i, 1])
        assert seen.setdefault(names, number) == number
    assert len(set(seen.values())) == len(seen) >= 2


def test_the_hardest_stop_is_enlarged():
    """Two stops of a run that begins at 5 s: the whole until 1.15 of the way to the
    last stop, then the harder one."""
    load = sb.TorqueLoad(sb.PiecewiseLinear([0.0, 99.0], [2e3, 2e3]))
    lever = sb.PiecewiseLinear([7.0, 7.0, 8.0, 8.0], [8e3, 0.0, 0.0, 8e3])
    scene = dataclasses.replace(
        stop_scene(C=None, lever=lever, load=load, end=30.0),
        initial=sb.Initial(20.0, time=5.0),
    )
    result = sb.simulate(scene)
    first, second = result.stops["time"]
    assert result.stops["energy"][0] > result.stops["energy"][1]
    whole, hard = plot.stop(result).axes[:2]
    np.testing.assert_allclose(
        whole.get_xlim(), (5.0, 5.0 + 1.15 * (second - 5.0)), rtol=1e-9
    )
    assert hard.get_xlim()[0] < 5.0 + 1e-9 < first < hard.get_xlim()[1] < second


def test_title_is_that_of_the_scene(given):
    assert (
        plot.stop(given["result"])
        .get_suptitle()
        .startswith("standard brake, 8 linings, initial speed 24 rad/s\n")
    )
    with plot.titled("a stop"):
        assert (
            plot.lining_map(given["result"], "tension")
            .get_suptitle()
            .startswith("a stop\n")
        )
    assert "a stop" not in plot.duty(given["result"]).get_suptitle()


# --- from the command line ----------------------------------------------------------


def run(capsys, *arguments):
    return call(capsys, *map(str, arguments))[:2]


def test_compare_writes_a_figure(given, tmp_path, capsys, drawn):
    a = sb.save(given["result"], tmp_path / "a.nc")
    b = sb.save(given["result"], tmp_path / "b.nc")
    heavy = sb.with_values(given["scene"], {"duty.load.mass": 24e3})
    sb.write_scene(heavy, tmp_path / "heavy.toml")
    code, out = run(
        capsys,
        "compare",
        a,
        b,
        tmp_path / "heavy.toml",
        "--json",
        "--out",
        tmp_path / "out",
    )
    found = json.loads(out)
    assert (code, found["results"]) == (1, ["a", "b", "heavy"])
    assert (
        [one["equal"] for one in found["comparisons"]]
        == [True, False]
        == [True, found["equal"]]
    )
    assert found["comparisons"][1]["scene"][0]["name"] == "duty.load.mass"
    assert json.loads((tmp_path / "out" / "compare.json").read_text("utf-8")) == found
    assert (tmp_path / "out" / "compare.png").exists()
    axes = drawn["compare.png"].axes[0]
    stops = [line.get_xdata()[0] for line in axes.lines if line.get_marker() == "D"]
    later = sb.simulate(heavy).stopping_time
    np.testing.assert_allclose(
        stops, [given["result"].stopping_time] * 2 + [later], rtol=1e-9
    )
    run(capsys, "compare", a, a, "--out", tmp_path / "same")
    labels = [line.get_label() for line in drawn["compare.png"].axes[0].lines]
    assert [text for text in labels if text[0] != "_"] == [f"{a}, 1", f"{a}, 2"]


def test_sweep_writes_its_figure(given, tmp_path, capsys, drawn):
    sb.write_scene(given["scene"], tmp_path / "stop.toml")
    vary = [
        "--vary",
        "duty.load.mass=18e3:22e3:3",
        "--metrics",
        "stopping_time",
        "--out",
        tmp_path / "out",
    ]
    assert run(capsys, "sweep", tmp_path / "stop.toml", *vary)[0] == 0
    assert sorted(file.name for file in (tmp_path / "out").iterdir()) == [
        "runs.csv",
        "runs.nc",
        "sweep.png",
    ]
    mass, time = np.concatenate(
        [line.get_xydata() for line in drawn["sweep.png"].axes[0].lines]
    ).T
    np.testing.assert_allclose(mass, [18.0, 20.0, 22.0], rtol=1e-12)
    assert time[1] == pytest.approx(float(given["result"].stopping_time), rel=1e-8)
