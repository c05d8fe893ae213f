"""Figures of runs by their words and axes: titles, labels, legends, marks, and the parts of a run that are drawn."""

import dataclasses
import functools
import itertools
import math
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from picture_scenes import hot_result, plain_result, staged_result
from stop_scenes import stop_scene

import simbrake as sb
from simbrake import plot
from simbrake.plot._runs import _telling
from simbrake.plot._shared import (
    BLUE,
    GREEN,
    ORANGE,
    VERMILLION,
    Window,
    application,
    marks,
    strong_applications,
    windows,
)


def legend(drawn):
    """Texts of the legends of a figure or of a panel."""
    found = drawn.legends if hasattr(drawn, "legends") else [drawn.get_legend()]
    return [text.get_text() for one in found if one for text in one.get_texts()]


def upright(axes):
    """Places of vertical lines, each once."""
    two = [line.get_xdata() for line in axes.lines if len(line.get_xdata()) == 2]
    return sorted({x[0] for x in two if x[0] == x[1]})


def below(text, count=1):
    """The last lines of the title of a figure: what is below the words for its scene."""
    return "\n".join(text.splitlines()[-count:])


@functools.cache
def twice_result():
    """Two stops from 5 s on, the first the harder one, with a rim in layers: no lining has a temperature."""
    steel = sb.material("steel_20L")
    rim = {"rim": steel, "rim_thickness": 0.02, "track_area": 0.8, "rim_layers": 8, "rim_first": 2e-4}
    heat = sb.layered_heat(**rim, partition=0.9, permissible=350.0)
    load = sb.TorqueLoad(sb.PiecewiseLinear([0.0, 99.0], [2e3, 2e3]))
    lever = sb.PiecewiseLinear([7.0, 7.0, 8.0, 8.0], [8e3, 0.0, 0.0, 8e3])
    scene = stop_scene(n=4, beta=60.0, C=None, lever=lever, load=load, end=12.0)
    return sb.simulate(dataclasses.replace(scene, initial=sb.Initial(20.0, time=5.0), heat=heat))


@functools.cache
def disc_result():
    return sb.simulate(sb.read_scene(sb.files.shipped("disc")))


@functools.cache
def shoe_result(omega=25.0):
    force = sb.PiecewiseLinear([0.0, 0.25, 9.0], [0.0, 2e3, 2e3])
    shoes = sb.Shoes(sb.ConstantFriction(0.32), 0.150, 0.032, 0.15, math.radians(126.0))
    brake = sb.ShoeBrake(12.0, shoes, 0.1227, 0.212)
    return sb.simulate(sb.Scene(brake, sb.ForceDuty(force, sb.TorqueLoad(0.0)), sb.Initial(omega), 4.0))


# --- lever, load and the stop -----------------------------------------------------------------------------------------


def test_duty_of_an_actuator_and_of_a_lever():
    """The callipers close from 0 to 45 kN in a quarter of a second."""
    figure = plot.duty(disc_result())
    force, torque = figure.axes[:2]
    t, drawn = force.lines[0].get_data()
    np.testing.assert_allclose(drawn, np.minimum(180.0 * t, 45.0), atol=1e-9)
    assert (force.get_ylabel(), legend(force)) == ("force, kN", ["force of the actuator $F$"])
    assert (torque.get_ylabel(), legend(torque)) == ("torque, kN·m", ["load torque on the shaft"])
    assert below(figure.get_suptitle()) == "actuator and load"
    figure = plot.duty(plain_result())
    lever, torque = figure.axes
    assert (lever.get_ylabel(), legend(lever)) == ("tension, kN", ["slack tension $T_0$"])
    assert below(figure.get_suptitle()) == "lever and load"
    assert [axes.get_xlabel() for axes in figure.axes] == ["", "time, s"]
    assert lever.get_xlim() == (0.0, 4.0)
    assert plot.duty(staged_result()).axes[0].get_ylim()[0] == 0.0  # of a lever from 1 kN on
    driven = sb.simulate(dataclasses.replace(stop_scene(T0=0.0, C=None, load=-1e3), end_time=0.1))
    assert plot.duty(driven).axes[1].get_ylim()[0] < -1.0


def test_stop_has_the_whole_run_and_its_onset():
    run = plain_result()
    figure = plot.stop(run)
    full, stop = float(run.full_slip_time), float(run.stopping_time)
    left, right = figure.axes[::2], figure.axes[1::2]
    assert [left[0].get_title(), right[0].get_title()] == ["until rest", "up to full slip, enlarged"]
    np.testing.assert_allclose([left[0].get_xlim(), right[0].get_xlim()], [(0, 1.15 * stop), (0, 1.3 * full)])
    assert [axes.get_ylabel() for axes in right] == [""] * 4
    assert [axes.get_xlabel() for axes in figure.axes] == [""] * 6 + ["time, s", "time, ms"]
    assert right[3].xaxis.get_major_formatter()(0.005) == "5"
    marked = [float(run.slip_onset_time), full, stop]
    for panel in left:
        np.testing.assert_allclose(upright(panel), marked)
    np.testing.assert_allclose(upright(right[0]), marked[:2])
    assert legend(figure) == ["slip onset $t_0$", "full slip $t_1$", "stop"]
    words = ["standard brake, 8 linings, initial speed 20 rad/s", f"stopped: {run.message}"]
    assert figure.get_suptitle().splitlines() == words
    assert left[3].get_ylim() == (-0.5, 8.5)
    assert legend(left[3]) == ["linings at their limit $k$"]
    assert legend(left[0]) == [r"speed of the pulley $\omega$"]
    assert legend(left[2]) == ["tight end $T_n$", "slack end $T_0$"]
    t, tight = left[2].lines[0].get_data()
    apart = np.min(np.abs(np.subtract.outer(t, [e.time for e in run.events])), axis=1) > 1e-9
    s = run.series(t)
    np.testing.assert_allclose(tight[apart], np.asarray(s.tight_tension)[apart] / 1e3, rtol=1e-9)
    np.testing.assert_allclose(left[2].lines[1].get_ydata()[apart], np.asarray(s.slack_tension)[apart] / 1e3, rtol=1e-9)
    # titles stand beside each other, though only the left column has a legend below its own
    FigureCanvasAgg(figure).draw()
    low, level = (axes.title.get_window_extent().y0 for axes in (left[0], right[0]))
    assert low == pytest.approx(level, abs=0.5)
    assert low > left[0].get_legend().get_window_extent().y1 - 4.0
    # its lines are told apart by their dashes as well
    dashes = [line.get_linestyle() for line in left[0].lines if len(line.get_xdata()) == 2]
    assert dashes == [":", "--", "-."]


def test_stop_of_pads_and_of_shoes_shows_the_forces_on_them():
    """Pads are pressed alike: one curve, that of the actuator; each shoe has its own."""
    figure = plot.stop(disc_result())
    speed, _, force, count = figure.axes
    assert legend(speed) == [r"speed of the disc $\omega$"]
    assert legend(force) == ["actuator $F$", "normal force $N$"]
    for line in force.lines[:2]:
        np.testing.assert_allclose(line.get_ydata(), np.minimum(180.0 * line.get_xdata(), 45.0), atol=1e-9)
    assert force.get_ylabel() == "force, kN"
    assert (count.get_ylabel(), count.get_ylim(), legend(count)) == (
        "$k$ of 8",
        (-0.5, 8.5),
        ["pads at their limit $k$"],
    )
    assert figure.get_size_inches()[0] < plot.stop(plain_result()).get_size_inches()[0]  # one column of panels
    run = shoe_result()
    speed, _, force, _ = plot.stop(run).axes[: 4 * len(windows(run)) : len(windows(run))]
    assert legend(speed) == [r"speed of the drum $\omega$"]
    assert legend(force) == ["actuator $F$", "normal force $N$ on shoe 1", "normal force $N$ on shoe 2"]
    for i in (0, 1):
        t, drawn = force.lines[1 + i].get_data()
        late = (t > 0.3) & np.all(np.abs(np.subtract.outer(t, [e.time for e in run.events])) > 1e-9, axis=1)
        np.testing.assert_allclose(1e3 * drawn[late], np.asarray(run.series(t).normal_load)[late, i], rtol=1e-9)


@pytest.mark.parametrize(("omega", "limits"), [(20.0, (0.0, 24.0)), (-20.0, (-24.0, 0.0)), (0.0, (0.0, 1.0))])
def test_constant_speed_has_an_axis_from_zero(omega, limits):
    run = sb.simulate(stop_scene(T0=0.0, C=None, w0=omega))
    assert plot.stop(run).axes[0].get_ylim() == pytest.approx(limits)
    start = "from rest" if omega == 0.0 else f"initial speed {'−' if omega < 0 else ''}20 rad/s"
    assert plot.stop(run).get_suptitle().splitlines()[0].replace("-", "−").endswith(start)


def test_stops_of_a_run_with_and_without_heat():
    """Rigid band: `J ω̇ = M_load − M_b`, and the heat of a stop is what its speed and the load give."""
    figure = plot.stops(twice_result())
    time, heat, hot = figure.axes
    factor = ((1 + 0.35 * math.tan(math.pi / 6)) / (1 - 0.35 * math.tan(math.pi / 6))) ** 4
    slowing = (0.725 * 8e3 * (factor - 1) - 2e3) / 800.0
    spun = 2e3 / 800.0  # in one second without the brake
    seconds = np.array([20.0, spun]) / slowing
    worked = 0.5 * 800.0 * np.array([20.0, spun]) ** 2 + 2e3 * 0.5 * np.array([20.0, spun]) * seconds
    np.testing.assert_allclose(time.lines[0].get_xydata(), [[1, seconds[0]], [2, seconds[1]]], rtol=1e-8)
    np.testing.assert_allclose(heat.lines[0].get_xydata(), [[1, worked[0] / 1e3], [2, worked[1] / 1e3]], rtol=1e-8)
    assert [legend(axes) for axes in figure.axes] == [["time under the band"], ["friction heat"], ["hottest rim"]]
    assert [axes.get_ylabel() for axes in figure.axes] == ["time, s", "heat, kJ", "temperature, °C"]
    assert [axes.get_xlabel() for axes in figure.axes] == ["", "", "number of the stop"]
    first = float(np.max(twice_result().series(np.linspace(5.0, 8.0, 3001)).rim_temperature)) - 273.15
    assert hot.lines[0].get_ydata()[0] == pytest.approx(first, abs=0.01)
    assert below(figure.get_suptitle()) == "the stops of the run"
    assert all(float(tick).is_integer() for tick in hot.get_xticks())
    cold = plot.stops(plain_result())
    assert [axes.get_ylabel() for axes in cold.axes] == ["time, s", "heat, kJ"]
    assert cold.get_size_inches()[1] < figure.get_size_inches()[1]
    with pytest.raises(sb.InputError, match="has no stop"):
        plot.stops(sb.simulate(stop_scene(T0=0.0, C=None)))


def test_parts_of_a_run_that_are_enlarged():
    """Stops at t1 and t2 after braking for b1 and b2; the first has all but the heat of the second."""
    run = twice_result()
    (first, second), (b1, b2) = run.stops["time"], run.stops["braking_time"]
    np.testing.assert_allclose(strong_applications(run), [5.0])

    def part(time, cooling=4.0):
        (found,) = application(run, time, "here", cooling)
        assert found.title == "here"
        return found.start, found.end

    # the time lies in a stop, or after it before the next motion, which then holds its cooling as well
    assert part(5.3) == pytest.approx((5.0, first + 4.0 * b1))
    assert part(6.5) == pytest.approx((5.0, first + 4.0 * (6.5 - first)))
    assert part(7.5) == pytest.approx((second - 1.2 * b2, second + 4.0 * b2))
    assert part(10.0, 0.3) == pytest.approx((second - 1.2 * b2, second + 0.3 * (10.0 - second)))
    assert part(11.9) == pytest.approx((second - 1.2 * b2, 12.0))
    assert application(plain_result(), 0.5, "here") == []


# --- stages -----------------------------------------------------------------------------------------------------------


def test_stages_are_shaded_and_named():
    run = staged_result()
    figure = plot.stages(run)
    speed, *_, inner = figure.axes
    stop = run.stages[-1].start
    np.testing.assert_allclose(speed.get_xlim(), (0.0, 1.15 * stop))
    assert inner.get_xlabel() == "time, s"
    ends = [*(stage.start for stage in run.stages), 1.15 * stop]
    for panel in figure.axes:
        spans = [patch.get_extents().transformed(panel.transData.inverted()) for patch in panel.patches]
        np.testing.assert_allclose([sorted(s.intervalx) for s in spans], np.stack([ends[:-1], ends[1:]], axis=1))
        shades = [to_hex(patch.get_facecolor()) for patch in panel.patches]
        assert shades == [GREEN.lower(), ORANGE.lower(), BLUE.lower(), "#808080"]
    assert [text.get_text() for text in speed.texts] == ["stage 1", "stage 2", "stage 3"]
    middle = [0.5 * (a + b) for a, b in itertools.pairwise(ends)]
    np.testing.assert_allclose([text.get_position()[0] for text in speed.texts], middle[:3])
    assert all(0.8 < text.get_position()[1] < 1.0 for text in speed.texts)
    assert speed.get_ylim()[1] == pytest.approx(1.3 * 20.0)
    assert legend(figure) == [
        "stage 1: band slides on the bandage",
        "stage 2: both pairs slide",
        "stage 3: pulley slides in the bandage",
        "held",
    ]
    assert below(figure.get_suptitle()) == f"stages of the brake: {run.message}"
    assert [axes.get_ylim() for axes in figure.axes[3:]] == [(0.0, 1.0)] * 2
    # a run that ends while the pulley still turns is drawn to its end, and names the stages that last
    short = sb.simulate(dataclasses.replace(run.scene, end_time=run.stages[2].start + 1e-3))
    speed = plot.stages(short).axes[0]
    assert speed.get_xlim() == (0.0, pytest.approx(run.stages[2].start + 1e-3))
    assert [text.get_text() for text in speed.texts] == ["stage 1", "stage 2"]
    longer = 1.5 * run.stages[2].start
    short = sb.simulate(dataclasses.replace(run.scene, end_time=longer))
    assert plot.stages(short).axes[0].get_xlim() == (0.0, pytest.approx(longer))
    later = sb.simulate(dataclasses.replace(run.scene, initial=sb.Initial(20.0, time=0.2)))
    end = 0.2 + 1.15 * (later.stages[-1].start - 0.2)
    assert plot.stages(later).axes[0].get_xlim() == pytest.approx((0.2, end))
    # running in
    grown = plot.stages(run, running_in=sb.results.RunningIn(0.4, 1e3)).axes[3]
    high, low = (axes.collections[0].get_paths()[0].vertices[:, 1].sum() for axes in (figure.axes[3], grown))
    assert low < 0.99 * high


# --- temperatures and depth -------------------------------------------------------------------------------------------


def with_permissible(run, kelvin):
    heat = dataclasses.replace(run.scene.heat, permissible=kelvin)
    return dataclasses.replace(run, scene=dataclasses.replace(run.scene, heat=heat))


def test_temperatures_of_two_stops_enlarge_the_hotter_one():
    run = twice_result()
    hottest, first = float(run.metrics["peak_rim_temperature_time"]), run.stops["time"][0]
    figure = plot.temperatures(run)
    whole, friction, near, _, depth = figure.axes
    assert whole.get_xlim() == (5.0, 12.0)
    assert near.get_xlim() == pytest.approx((5.0, first + 4.0 * run.stops["braking_time"][0]))
    assert near.get_title(loc="left") == "the hottest brake application"
    assert depth.get_title(loc="left") == f"through the rim at {hottest:.6g} s"
    assert 5.0 < hottest < first
    assert [axes.get_xlabel() for axes in figure.axes] == [
        "",
        "time, s",
        "",
        "time, s",
        "depth below the friction surface, mm",
    ]
    assert [axes.get_legend() is None for axes in figure.axes] == [False, False, True, True, True]
    for axes in (whole, near):
        t, T = axes.lines[0].get_data()
        np.testing.assert_allclose(T, np.ravel(run.series(t).rim_temperature) - 273.15)
        assert axes.lines[0].get_linewidth() > 2.0  # the rim is broad
    low, high = friction.get_ylim()
    assert low == 0.0 < 0.35 < high < 0.6
    top, bottom = float(np.max(whole.lines[0].get_ydata())), float(np.min(whole.lines[0].get_ydata()))
    # the permissible temperature is a line where that leaves the curves their height
    assert legend(whole) == ["rim", "permissible 76.85 °C, above"]
    near_enough = 273.15 + top + 1.4 * (top - bottom)
    drawn = plot.temperatures(with_permissible(run, near_enough)).axes[0]
    limit = next(line for line in drawn.lines if line.get_label().startswith("permissible"))
    np.testing.assert_allclose(limit.get_ydata(), near_enough - 273.15)
    assert not limit.get_label().endswith("above")
    far = plot.temperatures(with_permissible(run, 273.15 + top + 1.6 * (top - bottom))).axes[0]
    assert legend(far)[-1].endswith("above")


def test_cycles_are_an_envelope_over_the_whole_run_alone(monkeypatch):
    """One cycle, so one point of the maximum and one of the minimum; the enlarged application has its curve."""
    monkeypatch.setattr(plot._runs, "_FEW", 0)
    run = twice_result()
    whole, _, near, *_ = plot.temperatures(run).axes
    assert legend(whole) == ["rim", "lowest of a cycle", "permissible 76.85 °C, above"]
    high, low = (line.get_xydata() for line in whole.lines[:2])
    T = np.ravel(run.series(np.linspace(5.0, 12.0, 7001)).rim_temperature) - 273.15
    np.testing.assert_allclose(high, [[run.metrics["peak_rim_temperature_time"], T.max()]], rtol=1e-2)
    np.testing.assert_allclose(low, [[5.0, T.min()]], rtol=1e-2)
    assert [line.get_linestyle() for line in whole.lines[:2]] == ["-", ":"]
    assert len(near.lines[0].get_xdata()) > 100


def test_temperatures_of_one_stop_have_one_column():
    figure = plot.temperatures(hot_result())
    surface, friction, rim, lining = figure.axes
    assert legend(surface) == ["rim", "linings, hottest", "linings, coolest"]
    assert legend(friction) == ["when sliding"]
    assert [axes.get_title(loc="left").partition(" at ")[0] for axes in (rim, lining)] == [
        "through the rim",
        "through the lining",
    ]
    figure.canvas.draw()
    boxes = [axes.get_position() for axes in figure.axes]
    assert boxes[0].x1 > boxes[2].x1 + 0.1  # over both columns
    assert boxes[2].x1 < boxes[3].x0
    assert boxes[0].y0 > boxes[1].y1 > boxes[1].y0 > boxes[2].y1
    assert [to_hex(line.get_color()) for line in surface.lines[:3]] == [c.lower() for c in (VERMILLION, ORANGE, ORANGE)]
    assert below(figure.get_suptitle()) == "temperatures"
    with pytest.raises(ValueError, match="no heat"):
        plot.temperatures(plain_result())


def test_temperatures_of_a_brake_without_a_band_are_of_its_own_parts():
    """Of lumps alone there is nothing through the depth."""
    parts = (
        sb.thermal.Lump("drum", 4e3, 293.15),
        sb.thermal.Lump("shoes", 60.0, 293.15, count=2),
        sb.thermal.Reservoir("air", 293.15),
    )
    rubbing = sb.thermal.FrictionHeat("drum", "shoes", sb.thermal.ConstantPartition(0.8))
    heat = sb.Heat(parts, (sb.thermal.Conductance("shoes", "air", 1.0),), rubbing, rim="drum", linings="shoes")
    run = sb.simulate(dataclasses.replace(shoe_result().scene, heat=heat))
    figure = plot.temperatures(run)
    assert len(figure.axes) == 2
    assert legend(figure.axes[0]) == ["drum", "shoes, hottest", "shoes, coolest"]
    assert figure.get_size_inches()[0] < plot.temperatures(hot_result()).get_size_inches()[0]
    # the cooling drum: half of the kinetic energy's heat at the end, less what the shoes lost to the air
    drum = figure.axes[0].lines[0].get_ydata()
    assert drum[-1] == pytest.approx(20.0 + 0.8 * 0.5 * 12.0 * 25.0**2 / 4e3, rel=1e-6)
    with pytest.raises(sb.InputError, match="no body of the scene is in layers"):
        plot.depth(run)
    with pytest.raises(sb.InputError, match="the scene has no heat"):
        plot.depth(plain_result())


def test_depth_of_two_stops_enlarges_the_hotter_one():
    run = twice_result()
    figure = plot.depth(run)
    whole, near, profile, bar = figure.axes
    first, second = run.stops["time"]
    np.testing.assert_allclose(whole.get_xlim(), (5.0, 5.0 + 1.15 * (second - 5.0)))
    np.testing.assert_allclose(near.get_xlim(), (5.0, first + 4.0 * run.stops["braking_time"][0]))
    assert [axes.get_title(loc="left") for axes in (whole, near)] == ["until rest", "the hottest application"]
    assert [axes.get_xlabel() for axes in figure.axes] == ["time, s", "time, s", "temperature, °C", ""]
    assert [axes.get_ylabel() for axes in figure.axes] == [
        "depth below the front face, mm",
        "",
        "",
        "temperature, °C",
    ]
    assert all(axes.get_ylim() == (20.0, 0.0) for axes in (whole, near, profile))
    # profiles: first, hottest and last of the enlarged map, each with its mark above it
    edges = np.asarray(near.collections[0].get_coordinates())[0, :, 0]
    middle = 0.5 * (edges[1:] + edges[:-1])
    front = np.asarray(near.collections[0].get_array()).reshape(8, -1)[0]
    seconds = [float(text.split(" s")[0]) for text in legend(profile)]
    assert seconds == sorted(seconds)
    np.testing.assert_allclose([seconds[0], seconds[-1]], middle[[0, -1]], rtol=1e-4)
    (hot,) = [text for text in legend(profile) if text.endswith("\n(hottest)")]
    assert float(hot.split(" s")[0]) == pytest.approx(middle[np.argmax(front)], rel=1e-4)
    marks = [line for line in near.lines if line.get_marker() == 7]
    np.testing.assert_allclose([line.get_xdata()[0] for line in marks], seconds, rtol=1e-4)
    assert all(1.0 < line.get_ydata()[0] < 1.1 for line in marks)
    np.testing.assert_array_equal(*([line.get_color() for line in lines] for lines in (marks, profile.lines)))
    for line, time in zip(profile.lines, seconds, strict=True):
        i = int(np.argmin(np.abs(middle - time)))
        np.testing.assert_allclose(line.get_xdata(), np.asarray(near.collections[0].get_array()).reshape(8, -1)[:, i])
        np.testing.assert_allclose(line.get_ydata(), 1e3 * np.asarray(run.scene.heat.bodies[0].centres))
    for axes in (whole, near):  # one scale of colours
        assert axes.collections[0].get_clim() == pytest.approx((20.0, front.max()), abs=0.05)
    assert bar.get_ylim() == pytest.approx(near.collections[0].get_clim())
    title = "temperature through the depth: rim, means of 8 layers"
    assert below(figure.get_suptitle()) == title
    assert legend(figure) == ["slip onset $t_0$", "full slip $t_1$", "stop", "release"]
    np.testing.assert_allclose(upright(near), [5.0, first, 7.0, 8.0, second])


def test_profiles_are_at_steps_of_the_temperature_of_the_face():
    """A face that heats by 1 K a step for 100 steps and cools by 1 K a step for 50."""
    face = np.append(np.arange(101.0), np.arange(99.0, 49.0, -1.0))
    hottest, shown = _telling(face)
    assert hottest == 100
    assert shown.tolist() == [0, 20, 50, 75, 100, 115, 130, 150]


def test_depth_of_a_wall_by_name():
    run = hot_result()
    assert below(plot.depth(run).get_suptitle()).endswith("depth: rim, means of 6 layers")
    assert below(plot.depth(run, "lining", 2).get_suptitle()).endswith("depth: lining 2 of 4, means of 3 layers")
    for wrong in (0, 5):
        with pytest.raises(sb.InputError, match=f"there is no lining {wrong} — there are 1…4"):
            plot.depth(run, "lining", wrong)
    # the wall of the rim by default; where the scene names none, or one that is no wall, the first one
    bodies = [body for name in ("lining", "rim") for body in run.scene.heat.bodies if body.name == name]
    rest = [body for body in run.scene.heat.bodies if body not in bodies]
    for rim, wall in (("rim.front", "rim"), (None, "lining"), ("air", "lining")):
        heat = dataclasses.replace(run.scene.heat, bodies=(*bodies, *rest), rim=rim)
        other = dataclasses.replace(run, scene=dataclasses.replace(run.scene, heat=heat))
        assert f"depth: {wall}" in below(plot.depth(other).get_suptitle())


# --- maps -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "quantity", "pair", "label", "title", "colours"),
    [
        (
            plain_result,
            "normal_load",
            "external",
            "normal load $N$, kN",
            "normal load $N$, lining by lining",
            "viridis",
        ),
        (
            plain_result,
            "edge_pressure_ratio",
            "external",
            "tight over slack edge pressure (–)",
            "tight over slack edge pressure, lining by lining",
            "viridis",
        ),
        (
            hot_result,
            "temperature",
            "external",
            "surface temperature, °C",
            "surface temperature, lining by lining",
            "inferno",
        ),
        (
            staged_result,
            "slip_speed",
            "internal",
            "slip speed |$v$|, m/s",
            "linings on the rim: slip speed |$v$|, lining by lining",
            "viridis",
        ),
        (disc_result, "normal_load", "external", "normal load $N$, kN", "normal load $N$, pad by pad", "viridis"),
    ],
)
def test_lining_map_says_what_it_shows(make, quantity, pair, label, title, colours):
    figure = plot.lining_map(make(), quantity, pair=pair)
    columns = windows(make())
    panels, bars = figure.axes[: len(columns)], figure.axes[len(columns) :]
    assert [bar.get_ylabel() for bar in bars] == [label] * len(columns)
    assert below(figure.get_suptitle()) == title
    for panel, part in zip(panels, columns, strict=True):
        mesh = panel.collections[0]
        assert mesh.get_cmap().name == colours
        shown = np.asarray(mesh.get_array())
        assert mesh.get_clim() == pytest.approx((shown.min(), shown.max()))
        np.testing.assert_allclose(panel.get_xlim(), (part.start, part.end))
        assert panel.get_title() == part.title
        events = [e.time for e in make().events if part.start <= e.time <= part.end]
        assert set(upright(panel)) <= set(events)
        assert upright(panel)
    order = "pad" if make is disc_result else "lining, from the slack to the tight end"
    assert [panel.get_ylabel() for panel in panels] == [order, *[""] * (len(panels) - 1)]
    wide = {1: 8.0, 2: 11.0}
    assert abs(figure.get_size_inches()[0] - wide[len(columns)]) < 1.0


def test_a_map_of_one_value_for_all_has_a_scale_of_its_own():
    mesh = plot.lining_map(hot_result(), "friction_coefficient").axes[0].collections[0]
    assert mesh.get_clim() == pytest.approx((0.35, 1.35))


def test_one_lining_surface_for_all_is_said():
    steel, lining = sb.material("steel_20L"), sb.material("FK-24A")
    thick = {"rim_thickness": 0.02, "track_area": 0.8, "rim_layers": 3, "lining_layers": 2, "lining_area": 0.6}
    heat = sb.layered_heat(rim=steel, lining=lining, partition=0.9, **thick)
    run = sb.simulate(dataclasses.replace(stop_scene(n=4, beta=60.0, C=None), heat=heat))
    words = below(plot.lining_map(run, "temperature").get_suptitle())
    assert words == "surface temperature, lining by lining (one surface for all linings)"
    assert "for all linings" not in plot.lining_map(run, "slip_speed").get_suptitle()
    assert legend(plot.temperatures(run).axes[0]) == ["rim", "linings"]


# --- windows and marks ------------------------------------------------------------------------------------------------


def made_run(*events):
    """What windows and marks read of a run from 5 to 15 s with these events."""
    rows = SimpleNamespace(t=np.array([5.0, 9.0, 15.0, 0.0]))
    named = [SimpleNamespace(name=name, time=time) for name, time in events]
    return SimpleNamespace(record=SimpleNamespace(count=2, rows=rows), events=named)


def test_windows_count_from_the_start_of_the_run():
    both = windows(made_run(("full_slip", 5.0), ("full_slip", 5.1), ("stop", 6.0), ("lining_slip", 7.0)))
    assert [(w.title, w.enlarged) for w in both] == [("until rest", False), ("up to full slip, enlarged", True)]
    np.testing.assert_allclose([w[:2] for w in both], [(5.0, 6.15), (5.0, 5.13)])
    # a quarter of the run is no short onset, and a run that moves on is drawn to its end
    for events in ([("full_slip", 5.3), ("stop", 6.0)], [("stop", 6.0), ("restart", 8.0)], []):
        (whole,) = windows(made_run(*events))
        moves = events[-1:] != [("stop", 6.0)]
        assert whole[:2] == (5.0, 15.0 if moves else pytest.approx(6.15))
        assert whole.title == ("whole run" if moves else "until rest")


def test_short_times_that_are_enlarged_are_in_milliseconds():
    for window, words in (
        (Window(5.0, 5.4, True), "time, ms"),
        (Window(5.0, 5.6, True), "time, s"),
        (Window(5.0, 5.4), "time, s"),
    ):
        axes = Figure().subplots()
        window.label_time(axes)
        assert axes.get_xlabel() == words


def test_many_marks_are_faint_and_none_hide_a_map():
    for count, drawn, look in ((12, 12, (1.1, 1.0)), (40, 0, (1.1, 1.0)), (41, 0, (0.33, 0.3))):
        run = made_run(*[("stop", 6.0 + 0.1 * i) for i in range(count)], ("lining_slip", 6.0), ("stop", 14.0))
        axes, over = Figure().subplots(1, 2)
        assert marks(axes, run, Window(5.0, 13.0)) == ["stop"] * count
        assert len(axes.lines) == count
        assert (axes.lines[0].get_linewidth(), axes.lines[0].get_alpha()) == pytest.approx(look)
        assert marks(over, run, Window(5.0, 13.0), front=True) == ["stop"] * drawn
        assert len(over.lines) == 2 * drawn  # each on white
