"""The pulley, discs and drums along the shaft: places of marks, arrows, scales, pressures."""

import functools
import math

import matplotlib.style
import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.patches import FancyArrowPatch
from picture_scenes import CONTACTS, plain_result, radius, scale, staged_result, wedges
from stop_scenes import stop_scene

import simbrake as sb
from simbrake import plot


def arrows(axes, gid=None):
    """Tails and tips of arrows."""
    return [np.asarray(p._posA_posB) for p in axes.patches if isinstance(p, FancyArrowPatch) and p.get_gid() == gid]


def angle_of(xy):
    return np.degrees(np.arctan2(*np.asarray(xy, float).T[::-1]))


@functools.cache
def rigid_result(**given):
    return sb.simulate(stop_scene(n=4, beta=60.0, C=None, **given))


def shoe_scene(end=126.0, start=0.15):
    force = sb.PiecewiseLinear([0.0, 9.0], [2e3, 2e3])
    shoes = sb.Shoes(sb.ConstantFriction(0.32), 0.150, 0.032, start, math.radians(end))
    brake = sb.ShoeBrake(12.0, shoes, 0.1227, 0.212)
    return sb.Scene(brake, sb.ForceDuty(force, sb.TorqueLoad(0.0)), sb.Initial(25.0), 4.0)


# --- along the band ---------------------------------------------------------------------------------------------------


def test_rotation_and_ends_that_change():
    """Backwards the lever's end is the tight one; at rest there is no arrow."""
    run = rigid_result()
    axes = plot.pulley(run, 0.1).axes[0]
    (ahead,) = arrows(axes, "rotation")
    np.testing.assert_allclose(angle_of(ahead), [216.0 - 360.0, 230.0 - 360.0])
    omega = float(run.series([0.1]).omega[0])
    assert f"$\\omega$\n{omega:.3g}\nrad/s" in [text.get_text() for text in axes.texts]
    assert not arrows(plot.pulley(run, 4.9).axes[0], "rotation")
    back = rigid_result(w0=-20.0)
    axes = plot.pulley(back, 0.1).axes[0]
    np.testing.assert_allclose(angle_of(*arrows(axes, "rotation")), [-36.0, -50.0])
    words = " ".join(text.get_text() for text in axes.texts)
    assert "lever end, now tight (lever)\n$T_0$ = 8 kN" in words
    slack = float(back.series([0.1]).tension[0, -1]) / 1e3
    assert f"anchor end, now slack (anchor)\n$T_n$ = {slack:.4g} kN" in words


def test_scale_of_the_load_leaves_the_speed_free():
    """Where the maximum load is just above a mark of its scale, that mark is next to the speed in the middle."""
    most = rigid_result().metrics["max_normal_load"]
    figure = plot.pulley(rigid_result(T0=8e3 * 20.1e3 / most), 0.1)
    figure.canvas.draw()
    texts = figure.axes[0].texts
    (speed,) = [text.get_window_extent() for text in texts if "rad/s" in text.get_text()]
    marks = [text for text in texts if text.get_gid() == "load scale"]
    assert [text.get_text() for text in marks] == ["0 kN", "20"]
    assert not any(text.get_window_extent().overlaps(speed) for text in marks)


def test_dark_style_shows_what_is_black():
    with matplotlib.style.context("dark_background"):
        figure = plot.stop(rigid_result())
    assert to_hex(figure.axes[0].lines[0].get_color()) == "#ffffff"
    assert to_hex(plot.stop(rigid_result()).axes[0].lines[0].get_color()) == "#000000"


def test_both_pairs_of_a_staged_brake():
    """Linings in two rings; the load on the rim has an outline of its own, and rules are no part of the title."""
    run = staged_result()
    time = 0.5 * float(run.internal_slip_time)
    figure = plot.pulley(run, time)
    axes, pairs = figure.axes[0], run.series([time]).pairs
    assert "outer half of a lining" not in figure.get_suptitle()
    assert figure.legends[0].get_title().get_text().startswith("outer half of a lining: band on lining")
    value = scale(axes, "load scale")
    for gid, pair in (("load", "external"), ("rim load", "internal")):
        drawn = [value(bar.r - bar.width) for bar in wedges(axes, gid)]
        np.testing.assert_allclose(drawn, np.asarray(pairs[pair].normal_load)[0] / 1e3, rtol=1e-9)
    assert not wedges(axes, "rim load")[0].get_fill()
    outer, inner = wedges(axes, "external")[0], wedges(axes, "internal")[0]
    assert outer.r - outer.width == pytest.approx(inner.r)


# --- pads and shoes ---------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def disc():
    return sb.simulate(sb.read_scene(sb.files.shipped("disc")))


def test_pads_lie_around_the_disc(disc):
    """Eight pads of 16° at four callipers, each with 45 kN; uniform wear: `p r` is constant."""
    figure = plot.pressed(disc, 0.3)
    wheel, course = figure.axes
    pads = [p for p in wheel.patches if p.get_gid() == "pad"]
    middles = [90.0, 180.0, 270.0, 360.0]
    np.testing.assert_allclose([[p.theta1, p.theta2] for p in pads], [[m - 8.0, m + 8.0] for m in middles])
    assert all((p.r, p.width) == pytest.approx((0.8, 0.15)) for p in pads)
    assert {to_hex(p.get_facecolor()) for p in pads} == {to_hex(CONTACTS["slides"])}
    forces = next(t.get_text() for t in wheel.texts if t.get_text().startswith("pad 1:")).splitlines()
    assert [line.partition(":")[0] for line in forces] == ["pad 1", "pad 2", "… 5 more …", "pad 8"]
    assert forces[0] == "pad 1: $N$ = 45 kN, friction 18 kN"
    curve, mean, effective = course.lines
    area = math.radians(16.0) / 2 * (0.8**2 - 0.65**2)
    assert mean.get_ydata()[0] == pytest.approx(45e3 / area / 1e6)
    assert effective.get_xdata()[0] == pytest.approx(1e3 * float(disc.scene.brake.radius))
    r, p = curve.get_data()
    assert (r[0], r[-1]) == pytest.approx((650.0, 800.0))
    pull = np.trapezoid(1e6 * p * (r / 1e3), r / 1e3) * math.radians(16.0)  # ∫ p dA
    assert pull == pytest.approx(45e3, rel=1e-4)
    torque = 8 * 0.4 * np.trapezoid(1e6 * p * (r / 1e3) ** 2, r / 1e3) * math.radians(16.0)
    assert f"force of the actuator 45 kN, brake torque {torque / 1e3:.4g} kN·m" in figure.get_suptitle()
    assert f"$t$ = {disc.report().peaks['max_normal_load'].time:.4g} s" in plot.pressed(disc).get_suptitle()


@pytest.mark.parametrize(("start", "end", "highest"), [(0.15, 126.0, 90.0), (0.15, 60.0, 60.0), (1.9, 150.0, 108.862)])
def test_shoes_lie_in_the_drum(start, end, highest):
    """The pressure rises with the sine of the angle from the pin; the leading shoe, ahead, is at the left."""
    run = sb.simulate(shoe_scene(end, start))
    wheel, course = plot.pressed(run, 0.1).axes
    normal = np.asarray(run.series([0.1]).normal_load)[0]
    top = np.asarray([float(run.scene.brake.greatest_pressure(N)) for N in normal])
    assert top[0] > top[1]
    assert [line.get_label() for line in course.lines] == ["shoe 1, leading ahead", "shoe 2, trailing ahead"]
    for line, p in zip(course.lines, top, strict=True):
        theta, drawn = line.get_data()
        assert (theta[0], theta[-1]) == pytest.approx((math.degrees(start), end))
        shape = np.sin(np.radians(theta)) / math.sin(math.radians(highest))
        np.testing.assert_allclose(drawn, 1e-6 * p * shape, rtol=1e-5)
    shoes = [p for p in wheel.patches if p.get_gid() == "shoe"]
    pins = [line.get_xydata()[0] for line in wheel.lines if line.get_marker() == "o"]
    beside, low = math.degrees(0.12), math.degrees(start)
    np.testing.assert_allclose(angle_of(pins), [-90.0 - beside, -90.0 + beside])
    spans = [[-90 - beside - end, -90 - beside - low], [-90 + beside + low, -90 + beside + end]]
    np.testing.assert_allclose([[p.theta1, p.theta2] for p in shoes], spans)
    fills = [p for p in wheel.patches if p.get_gid() == "pressure"]
    deepest = [0.92 * 0.15 - radius(p.get_xy()).min() for p in fills]
    np.testing.assert_allclose(np.divide(deepest, deepest[0]), top / top[0], rtol=1e-3)


def test_pressed_is_of_discs_and_drums():
    with pytest.raises(sb.InputError, match=r"is a band brake.* draw it with `plot\.pulley`"):
        plot.pressed(plain_result())
