"""Figures of runs by their words and axes: titles, labels, legends, marks, and the parts of a run that are drawn."""

import dataclasses
import functools
import itertools
import math

import numpy as np
import pytest
from matplotlib.colors import to_hex
from picture_scenes import BLUE, GREEN, ORANGE, hot_result, legend, plain_result, staged_result
from stop_scenes import stop_scene

import simbrake as sb
from simbrake import plot


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


def test_stop_has_the_run_and_its_onset():
    run = plain_result()
    figure = plot.stop(run)
    full, stop = float(run.full_slip_time), float(run.stopping_time)
    left, right = figure.axes[::2], figure.axes[1::2]
    np.testing.assert_allclose([left[0].get_xlim(), right[0].get_xlim()], [(0, 1.15 * stop), (0, 1.3 * full)])
    assert right[3].xaxis.get_major_formatter()(0.005) == "5"
    marked = [float(run.slip_onset_time), full, stop]
    for panel in left:
        np.testing.assert_allclose(upright(panel), marked)
    np.testing.assert_allclose(upright(right[0]), marked[:2])
    assert left[3].get_ylim() == (-0.5, 8.5)
    t, tight = left[2].lines[0].get_data()
    apart = np.min(np.abs(np.subtract.outer(t, [e.time for e in run.events])), axis=1) > 1e-9
    s = run.series(t)
    np.testing.assert_allclose(tight[apart], np.asarray(s.tight_tension)[apart] / 1e3, rtol=1e-9)
    np.testing.assert_allclose(left[2].lines[1].get_ydata()[apart], np.asarray(s.slack_tension)[apart] / 1e3, rtol=1e-9)


def test_stop_of_pads_and_of_shoes():
    """Pads are pressed alike: one curve, that of the actuator; each shoe has its own."""
    figure = plot.stop(disc_result())
    _, _, force, count = figure.axes
    for line in force.lines[:2]:
        np.testing.assert_allclose(line.get_ydata(), np.minimum(180.0 * line.get_xdata(), 45.0), atol=1e-9)
    assert (count.get_ylabel(), count.get_ylim(), legend(count)) == (
        "$k$ of 8",
        (-0.5, 8.5),
        ["pads at their limit $k$"],
    )
    run = shoe_result()
    panels = plot.stop(run).axes
    _, _, force, _ = panels[:: len(panels) // 4]
    for i in (0, 1):
        t, drawn = force.lines[1 + i].get_data()
        late = (t > 0.3) & np.all(np.abs(np.subtract.outer(t, [e.time for e in run.events])) > 1e-9, axis=1)
        np.testing.assert_allclose(1e3 * drawn[late], np.asarray(run.series(t).normal_load)[late, i], rtol=1e-9)


@pytest.mark.parametrize(("omega", "limits"), [(20.0, (0.0, 24.0)), (-20.0, (-24.0, 0.0)), (0.0, (0.0, 1.0))])
def test_constant_speed_has_axis_from_zero(omega, limits):
    run = sb.simulate(stop_scene(T0=0.0, C=None, w0=omega))
    assert plot.stop(run).axes[0].get_ylim() == pytest.approx(limits)


def test_stops_with_and_without_heat():
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
    first = float(np.max(twice_result().series(np.linspace(5.0, 8.0, 3001)).rim_temperature)) - 273.15
    assert hot.lines[0].get_ydata()[0] == pytest.approx(first, abs=0.01)
    assert all(float(tick).is_integer() for tick in hot.get_xticks())
    with pytest.raises(sb.InputError, match="has no stop"):
        plot.stops(sb.simulate(stop_scene(T0=0.0, C=None)))


# --- stages -----------------------------------------------------------------------------------------------------------


def test_stages_are_shaded_and_named():
    run = staged_result()
    figure = plot.stages(run)
    speed, *_, _ = figure.axes
    stop = run.stages[-1].start
    np.testing.assert_allclose(speed.get_xlim(), (0.0, 1.15 * stop))
    ends = [*(stage.start for stage in run.stages), 1.15 * stop]
    for panel in figure.axes:
        spans = [patch.get_extents().transformed(panel.transData.inverted()) for patch in panel.patches]
        np.testing.assert_allclose([sorted(s.intervalx) for s in spans], np.stack([ends[:-1], ends[1:]], axis=1))
        shades = [to_hex(patch.get_facecolor()) for patch in panel.patches]
        assert shades == [GREEN.lower(), ORANGE.lower(), BLUE.lower(), "#808080"]
    middle = [0.5 * (a + b) for a, b in itertools.pairwise(ends)]
    np.testing.assert_allclose([text.get_position()[0] for text in speed.texts], middle[:3])
    assert all(0.8 < text.get_position()[1] < 1.0 for text in speed.texts)
    assert speed.get_ylim()[1] == pytest.approx(1.3 * 20.0)
    assert below(figure.get_suptitle()) == f"stages of the brake: {run.message}"
    assert [axes.get_ylim() for axes in figure.axes[3:]] == [(0.0, 1.0)] * 2
    # a run that ends while the pulley still turns is drawn to its end, and names the stages that last
    short = sb.simulate(dataclasses.replace(run.scene, end_time=run.stages[2].start + 1e-3))
    speed = plot.stages(short).axes[0]
    assert speed.get_xlim() == (0.0, pytest.approx(run.stages[2].start + 1e-3))
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


def test_temperatures_of_two_stops():
    run = twice_result()
    hottest, first = float(run.metrics["peak_rim_temperature_time"]), run.stops["time"][0]
    figure = plot.temperatures(run)
    whole, friction, near, _, depth = figure.axes
    assert whole.get_xlim() == (5.0, 12.0)
    assert near.get_xlim() == pytest.approx((5.0, first + 4.0 * run.stops["braking_time"][0]))
    assert depth.get_title(loc="left") == f"through the rim at {hottest:.6g} s"
    assert 5.0 < hottest < first
    for axes in (whole, near):
        t, T = axes.lines[0].get_data()
        np.testing.assert_allclose(T, np.ravel(run.series(t).rim_temperature) - 273.15)
    low, high = friction.get_ylim()
    assert low == 0.0 < 0.35 < high < 0.6
    top, bottom = float(np.max(whole.lines[0].get_ydata())), float(np.min(whole.lines[0].get_ydata()))
    # the permissible temperature is a line where that leaves the curves their height
    near_enough = 273.15 + top + 1.4 * (top - bottom)
    drawn = plot.temperatures(with_permissible(run, near_enough)).axes[0]
    limit = next(line for line in drawn.lines if line.get_label().startswith("permissible"))
    np.testing.assert_allclose(limit.get_ydata(), near_enough - 273.15)
    assert not limit.get_label().endswith("above")


def test_many_cycles_are_an_envelope():
    """Of nine short stops the maximum of each; the hottest one has its curve beside them."""
    lever = sb.Repeated([0.0, 1.0, 1.0, 2.0], [8e3, 8e3, 0.0, 0.0], 2.0, 9)
    steel = sb.material("steel_20L")
    heat = sb.layered_heat(rim=steel, rim_thickness=0.02, track_area=0.8, rim_layers=4, partition=0.9)
    scene = stop_scene(n=4, beta=60.0, C=None, w0=2.0, lever=lever, load=2e3, end=18.0)
    run = sb.simulate(dataclasses.replace(scene, heat=heat))
    whole, _, near, *_ = plot.temperatures(run).axes
    high, low = (line.get_xydata() for line in whole.lines[:2])
    assert len(high) == len(low) == 9
    for t, T in high:
        around = np.linspace(max(0.0, t - 0.5), min(18.0, t + 0.5), 2001)
        assert pytest.approx(np.max(run.series(around).rim_temperature) - 273.15, abs=0.1) == T
    assert len(near.lines[0].get_xdata()) > 100


def test_temperatures_without_a_band():
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
    # the cooling drum: half of the kinetic energy's heat at the end, less what the shoes lost to the air
    drum = figure.axes[0].lines[0].get_ydata()
    assert drum[-1] == pytest.approx(20.0 + 0.8 * 0.5 * 12.0 * 25.0**2 / 4e3, rel=1e-6)
    with pytest.raises(sb.InputError, match="no body of the scene is in layers"):
        plot.depth(run)
    with pytest.raises(sb.InputError, match="the scene has no heat"):
        plot.depth(plain_result())


def test_depth_of_two_stops():
    run = twice_result()
    figure = plot.depth(run)
    whole, near, profile, bar = figure.axes
    first, second = run.stops["time"]
    np.testing.assert_allclose(whole.get_xlim(), (5.0, 5.0 + 1.15 * (second - 5.0)))
    np.testing.assert_allclose(near.get_xlim(), (5.0, first + 4.0 * run.stops["braking_time"][0]))
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
    np.testing.assert_allclose(upright(near), [5.0, first, 7.0, 8.0, second])


def test_depth_of_a_wall_by_name():
    run = hot_result()
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
    ("make", "quantity", "pair", "colours"),
    [
        (plain_result, "normal_load", "external", "viridis"),
        (plain_result, "edge_pressure_ratio", "external", "viridis"),
        (hot_result, "temperature", "external", "inferno"),
        (staged_result, "slip_speed", "internal", "viridis"),
        (disc_result, "normal_load", "external", "viridis"),
    ],
)
def test_scales_and_marks_of_a_lining_map(make, quantity, pair, colours):
    figure = plot.lining_map(make(), quantity, pair=pair)
    count = len(figure.axes) // 2
    for panel in figure.axes[:count]:
        mesh = panel.collections[0]
        assert mesh.get_cmap().name == colours
        shown = np.asarray(mesh.get_array())
        assert mesh.get_clim() == pytest.approx((shown.min(), shown.max()))
        start, end = panel.get_xlim()
        events = [e.time for e in make().events if start <= e.time <= end]
        assert set(upright(panel)) <= set(events)
        assert upright(panel)


def test_scale_of_a_map_of_one_value():
    mesh = plot.lining_map(hot_result(), "friction_coefficient").axes[0].collections[0]
    assert mesh.get_clim() == pytest.approx((0.35, 1.35))
