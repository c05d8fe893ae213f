"""One check of scale for each figure: what is drawn is its data, in the unit that the
axis names."""

import dataclasses
import math

import numpy as np
import pytest
import xarray as xr
from helpers import all_equal, all_near, input_error
from picture_scenes import (
    chain_result,
    disc_result,
    hot_result,
    plain_result,
    radius,
    row_type,
    scale,
    shoe_result,
    staged_result,
    wedges,
)
from scenes import lining_ratio, stop_run, stop_scene

import simbrake as sb
from simbrake import plot
from simbrake.design.layouts import LayoutRow
from simbrake.studies import (
    Calibration,
    Estimate,
    LifeHistory,
    LiningLife,
    Sensitivity,
    SensitivityTable,
    Uncertainty,
)


def apart_from_events(run, t):
    """Which of the times are no events, where a curve may jump."""
    times = run.events.times
    return np.min(np.abs(np.subtract.outer(t, times)), axis=1) > 1e-9


@pytest.mark.parametrize(
    ("figure", "panel", "make", "column", "factor", "shift"),
    [
        ("stop", 0, plain_result, "omega", 1.0, 0.0),
        ("stop", 2, plain_result, "brake_torque", 1e-3, 0.0),
        ("stop", 4, plain_result, "tight_tension", 1e-3, 0.0),
        ("stop", 2, disc_result, "lever_force", 1e-3, 0.0),
        ("duty", 0, staged_result, "slack_tension", 1e-3, 0.0),
        ("stages", 0, staged_result, "omega", 1.0, 0.0),
        ("temperatures", 0, hot_result, "rim_temperature", 1.0, -273.15),
    ],
)
def test_first_curve_of_a_panel(figure, panel, make, column, factor, shift):
    run = make()
    line = getattr(plot, figure)(run).axes[panel].lines[0]
    t, drawn = line.get_data()
    apart = apart_from_events(run, t)
    wanted = factor * np.ravel(getattr(run.series(t), column)) + shift
    all_near(drawn[apart], wanted[apart], 1e-9, 1e-9)


def test_overlay_and_comparison_of_runs():
    run = plain_result()
    t = np.array([0.1, 0.3, 0.7])
    measured = np.array([2e4, 3e4, 5e4])
    data = sb.studies.Measured.of(
        t, {"tight_tension": measured}, sigma={"tight_tension": 1e3}
    )
    (panel,) = plot.overlay(run, data).axes
    (points,) = panel.containers
    all_near(points.lines[0].get_xydata(), np.stack([t, 1e-3 * measured], axis=1))
    tension = plot.compare([run, run]).axes[2].lines[0]
    all_near(
        np.interp(0.5, *tension.get_data()),
        1e-3 * run.series([0.5]).tight_tension[0],
        1e-3,
    )


@pytest.mark.parametrize(("size", "unit"), [(1.0, "kJ"), (1e3, "MJ")])
def test_stops_by_hand(size, unit):
    """`J ω̇ = −M_b` of a rigid band: one stop from 20 rad/s, with the heat `J ω²/2`."""
    scene = stop_scene(n=4, beta=60.0, C=None, J=800.0 * size, T0=8e3 * size)
    time, heat = plot.stops(sb.simulate(scene)).axes
    torque = 0.725 * 8000.0 * (lining_ratio(0.35, math.pi / 3) ** 4 - 1)
    all_near(time.lines[0].get_xydata(), [[1, 800.0 * 20.0 / torque]], 1e-8)
    all_near(heat.lines[0].get_xydata(), [[1, 160.0]], 1e-8)
    assert heat.get_ylabel() == f"heat, {unit}"


def test_load_and_mass_of_a_duty():
    """A string of 60 t comes onto 8 t of hook and block after 0.2 s."""
    given = {"drum_radius": 0.4, "line_count": 8, "count": 2}
    load = sb.TrippingLoad(8e3, 60e3, 5e3, 0.2, 8.0, 10.0, **given)
    run = stop_run(n=4, C=None, T0=0.0, w0=3.0, load=load, end=1.0)
    torque, mass = (axes.lines[0] for axes in plot.duty(run).axes[1:])
    t, drawn = mass.get_data()
    apart = np.abs(t - 0.2) > 1e-9
    hung = np.where(t < 0.2, 8.0, 68.0)
    all_near(drawn[apart], hung[apart], 1e-9)
    wanted = hung * 9.80665 * 0.4 / 8
    all_near(torque.get_ydata()[apart], wanted[apart], 1e-9)


def test_mass_on_the_hook_whatever_layer_pays_out():
    rope = sb.loads.RopeLayers("30 mm", 5, 14)
    given = {"drum_radius": 0.4, "line_count": 8, "count": 1, "rope": rope}
    load = sb.TrippingLoad(8e3, 60e3, 5e3, 0.2, 80.0, 100.0, **given)
    run = stop_run(n=4, C=None, T0=0.0, w0=20.0, load=load, end=1.5)
    assert len({*run.series(np.linspace(0.3, 1.5, 50)).rope_layer}) > 1
    t, drawn = plot.panels.hook_mass(run).lines[0].get_data()
    all_near(drawn[t > 0.21], 68.0, 1e-12)


# --- wheels and maps ----------------------------------------------------------------


@pytest.mark.parametrize("make", [plain_result, staged_result, hot_result])
def test_pulley(make):
    """Tensions and loads by the scales in the picture, linings at their angles."""
    run = make()
    time = 0.5 * float(run.stopping_time)
    axes = plot.pulley(run, time).axes[0]
    s = run.series([time])
    tension = np.append(s.slack_tension, s.tension[0]) / 1e3
    (line,) = [line for line in axes.lines if line.get_gid() == "tension"]
    drawn = scale(axes, "tension scale")(radius(line.get_xydata())).reshape(-1, 2)
    all_near(drawn, np.stack([tension[:-1], tension[1:]], axis=1), 1e-9)
    loads = [bar.r - bar.width for bar in wedges(axes, "load")]
    all_near(scale(axes, "load scale")(loads), np.asarray(s.normal_load)[0] / 1e3, 1e-9)
    linings = wedges(axes, "external")
    all_near(
        [w.theta2 - w.theta1 for w in linings],
        np.degrees(run.scene.brake.linings.angle),
        1e-9,
    )


def test_pads_and_shoes():
    """Eight pads of 16° with 45 kN each; pressure of shoes as the sine of the angle."""
    wheel, course = plot.pressed(disc_result(), 0.3).axes
    pads = [patch for patch in wheel.patches if patch.get_gid() == "pad"]
    assert all((p.r, p.width) == pytest.approx((0.8, 0.15)) for p in pads)
    r, pressure = course.lines[0].get_data()
    pull = np.trapezoid(1e6 * pressure * (r / 1e3), r / 1e3) * math.radians(16.0)
    assert pull == pytest.approx(45e3, rel=1e-4)
    run = shoe_result()
    normal = np.asarray(run.series([0.3]).normal_load)[0]
    for line, load in zip(plot.pressed(run, 0.3).axes[1].lines, normal, strict=True):
        theta, drawn = line.get_data()
        greatest = float(run.scene.brake.greatest_pressure(load))
        all_near(drawn, 1e-6 * greatest * np.sin(np.radians(theta)), 1e-5)


def cells(axes):
    """Edges along both axes and the values of a map, a row for each place."""
    mesh = axes.collections[0]
    corners = np.asarray(mesh.get_coordinates())
    values = np.asarray(mesh.get_array()).reshape(corners.shape[0] - 1, -1)
    return corners[0, :, 0], corners[:, 0, 1], values


def test_lining_map():
    hot = hot_result()
    edges, _, shown = cells(plot.lining_map(hot, "temperature").axes[0])
    truth = hot.series(0.5 * (edges[1:] + edges[:-1])).lining_temperature
    all_near(shown, np.asarray(truth).T - 273.15, 1e-9)


def test_short_applications_are_seen_on_a_long_map():
    """In each of twenty cycles of 50 s the load falls for 1 s, and is stopped in some
    tenths of a second."""
    cycle = ([0.0, 1.0, 1.0, 1.3, 1.3, 50.0], [0.0, 0.0, 8e3, 8e3, 2e3, 2e3])
    lever = sb.Repeated(*cycle, "50 s", 20)
    run = stop_run(n=4, C=None, lever=lever, w0=0.0, load=200.0, end=1e3)
    assert len(run.stops) == 20
    axes = plot.lining_map(run, "normal_load").axes[0]
    last = np.asarray(axes.collections[0].get_array())[-1]
    most = float(run.metrics["max_normal_load"]) / 1e3
    assert np.count_nonzero(last > 0.98 * most) == 20


def test_friction_heat_of_a_map():
    staged = staged_result()
    for pair in ("external", "internal"):
        figure = plot.lining_map(staged, "friction_heat", pair=pair)
        _, _, shown = cells(figure.axes[0])
        work = sb.results.friction_work(staged, pair=pair)
        all_near(shown[:, -1] * 1e3, work, 1e-4)


def test_depth():
    hot = hot_result()
    edges, layers, shown = cells(plot.depth(hot).axes[0])
    all_near(np.diff(layers), 1e3 * np.asarray(hot.scene.heat.bodies[0].steps), 1e-9)
    nodes = [i for i, name in enumerate(hot.nodes) if name.startswith("rim")]
    truth = np.asarray(hot.series(0.5 * (edges[1:] + edges[:-1])).temperature)
    all_near(shown, truth[:, nodes].T - 273.15, 1e-12)


def test_contacts_of_a_chain():
    """Before all slip, those slide whose first slip is past."""
    run = chain_result()
    slips = {e.lining: e.time for e in run.events if e.name == "lining_slip"}
    edges, _, states = cells(plot.contacts(run).axes[0])
    middle = 0.5 * (edges[1:] + edges[:-1])
    early = middle < slips[1]
    ahead = [middle[early] > slips[k] for k in (1, 2, 3, 4)]
    all_equal(states[:, early], ahead)


# --- studies, from data made by hand ------------------------------------------------


def test_tornado():
    mass = Sensitivity("load.mass", "kg", "mass", 2e4, 1e-4, 1.0, 2e3, 1.9, 2.2)
    axes = plot.tornado(SensitivityTable("stopping_time", "s", 2.0, (mass,)))
    ends = [p.get_x() + p.get_width() for p in axes.patches]
    assert ends == pytest.approx([1.9, 2.2])


def test_distribution():
    T = 273.15 + np.arange(10.0, 90.0, 10.0)
    few = row_type(Uncertainty, "statistics")(
        "K",
        8,
        Estimate(0, 0, 0),
        Estimate(0, 0, 0),
        {0.05: Estimate(285.15, 283.15, 290.15)},
        0.0,
        0.0,
    )
    data = {"peak_rim_temperature": T, "code": np.zeros(8, int)}
    found = Uncertainty(
        data,
        {"peak_rim_temperature": few},
        codes={},
        inputs={},
        groups=1,
        method="random",
        seed=1,
        confidence=0.9,
        failures={},
        limits={},
        runs=8,
    )
    _, cumulative = plot.distribution(found, "peak_rim_temperature").axes
    (stairs,) = [x for x in cumulative.lines if x.get_drawstyle() == "steps-post"]
    all_near(stairs.get_xydata(), [[10.0 * i, 12.5 * i] for i in range(1, 9)])


def test_calibration():
    """Residuals in standard deviations, temperatures in °C."""
    run = hot_result()
    t = np.array([0.2, 0.4])
    rim = np.array([300.0, 320.0])
    sigma = np.array([0.5, 1.0])
    data = sb.studies.Measured.of(t, {"rim_temperature": rim})
    rows = row_type(Calibration, "residuals")(
        "rim_temperature", "K", t, rim, sigma, rim - 4.0, rim + 2.0
    )
    recording = row_type(Calibration, "recordings")("", data, run.scene, run.scene)
    given = {field.name: None for field in dataclasses.fields(Calibration)}
    given |= {"residuals": (rows,), "recordings": (recording,)}
    given |= {"message": "converged", "chi2": 12.5, "freedom": 4}
    curve, off = plot.calibration(Calibration(**given)).axes
    all_near(
        curve.containers[0].lines[0].get_xydata(), np.stack([t, rim - 273.15], axis=1)
    )
    all_near(off.lines[0].get_ydata(), 2.0 / sigma)


def test_layouts_and_angles():
    rows = [
        LayoutRow(
            name, np.radians(angle), None, {"load": np.asarray(load)}, {"load": "N"}
        )
        for name, angle, load in (
            ("given", [40.0, 30.0, 20.0], [4.0, 4.5, 5.8]),
            ("level", [42.0, 30.0, 18.0], [5.0, 5.0, 5.0]),
        )
    ]
    angles, *_ = sb.layouts.figures.layouts(rows).axes
    all_near(
        [line.get_ydata() for line in angles.lines], [np.degrees(r.angle) for r in rows]
    )
    layout = sb.layouts.equal_increment_angles(0.3, 10, 10, math.radians(270.0))
    axes = sb.layouts.figures.angles({"equal increments": layout})
    dots = [line for line in axes.lines if line.get_marker() != "None"]
    all_near(dots[0].get_ydata(), np.degrees(layout.angle))


def test_wear():
    done = np.array([0.0, 6e3, 12e3])
    each = np.array([1.0, 0.5, 0.3])
    worn = 0.008 * (done / 12e3)[:, None] * each
    life = LiningLife(
        12e3,
        1,
        12e3 / each,
        0.008 * np.ones(3),
        (),
        None,
        LifeHistory(done, worn, worn[1:2].repeat(3, axis=0), np.ones(3)),
        2,
    )
    _, course = plot.wear({"as built": life}).subfigs
    most = next(x for x in course.axes[0].lines if x.get_label() == "as built")
    all_near(most.get_xydata()[-1], [12.0, 8.0])


def test_materials():
    """A bar for each rim and energy: temperatures in °C."""
    track = sb.formulas.EstimateData(track_area=1.6)
    given = {"energy": [2e5, 4e6], "data": track, "run": False}
    table = sb.compare_materials(
        stop_scene(), ["steel_20L", "brass"], ["FK-24A"], **given
    )
    surface, *_ = sb.formulas.figures.materials(table).axes
    rows = [
        table.row(rim, "FK-24A", i) for rim in ("steel_20L", "brass") for i in (0, 1)
    ]
    all_near(
        [bar.get_width() for bar in surface.patches],
        [row["surface"].value - 273.15 for row in rows],
    )


MASS = ("load.mass", np.array([1e4, 2e4, 3e4, 5e4]), {"units": "kg"})
SPEED = ("speed", np.array([1.0, 2.0, 4.0]), {"units": "rad/s"})


def study(dims, coords, unit, values, sequence):
    about = {"units": "1", "meaning": "of the run"}
    found = {
        "metric": (dims, values, {"units": unit}),
        "sequence": (dims, np.asarray(sequence), about),
        "code": (dims, np.zeros(np.shape(values), int), about),
    }
    return xr.Dataset(found, coords)


def test_sweep_over_one_parameter():
    """Joined by dots where another sequence of events begins."""
    T = 273.15 + np.array([20.0, 40.0, 50.0, 90.0])
    data = study("load.mass", {"load.mass": MASS}, "K", T, [0, 0, 1, 1])
    lines = plot.sweep(data).axes[0].lines
    for line, points in zip(
        lines,
        ([[10, 20], [20, 40]], [[30, 50], [50, 90]], [[20, 40], [30, 50]]),
        strict=True,
    ):
        all_near(line.get_xydata(), points)
    assert [line.get_linestyle() for line in lines] == ["-", "-", ":"]


def test_sweep_over_two_parameters():
    """Contours of the plane 10 x + y."""
    z = 10.0 * MASS[1][:, None] / 1e3 + SPEED[1]
    coords = {"load.mass": MASS, "speed": SPEED}
    data = study(("load.mass", "speed"), coords, "s", z, np.zeros((4, 3)))
    axes = plot.sweep(data).axes[0]
    line = max(axes.collections[1].get_paths(), key=lambda path: len(path.vertices))
    along = 10.0 * line.vertices[:, 0] + line.vertices[:, 1]
    levels = axes.collections[0].levels
    assert np.abs(np.subtract.outer(along, levels)).min(axis=1).max() < 1e-6


def test_permissible_map():
    """Of planes x and y: the region is that of both limits."""
    x = np.linspace(1.0, 3.0, 5)
    y = np.linspace(10.0, 20.0, 6)
    along = np.broadcast_to(x[:, None], (5, 6))
    up = np.broadcast_to(y, (5, 6))
    data = xr.Dataset(
        {
            "hook_travel": (("a", "b"), along, {"units": "m"}),
            "min_holding_reserve": (("a", "b"), up, {"units": "1"}),
            "code": (("a", "b"), np.zeros((5, 6), int)),
        },
        {"a": ("a", x, {"units": "m"}), "b": ("b", y, {"units": "s"})},
    )
    limits = {"hook_travel": 2.2, "min_holding_reserve": 13.0}
    mesh = plot.permissible(data, limits).collections[0].get_array()
    u, v = np.meshgrid(np.linspace(1, 3, len(mesh)), np.linspace(10, 20, len(mesh)))
    inside = (np.abs(u - 2.2) > 1e-9) & (np.abs(v - 13.0) > 1e-9)
    all_equal(
        np.ma.getdata(mesh)[inside].astype(bool), ((u <= 2.2) & (v >= 13.0))[inside]
    )


def test_what_a_figure_cannot_draw():
    plain = plain_result()
    for draw, given in (
        (plot.pulley, (plain, 99.0)),
        (plot.pulley, (plain, math.nan)),
        (plot.depth, (plain,)),
        (plot.stops, (stop_run(T0=0.0, C=None),)),
        (plot.compare, ([plain],)),
        (sb.layouts.figures.angles, ({"in degrees": np.full(10, 27.0)},)),
    ):
        with input_error():
            draw(*given)
