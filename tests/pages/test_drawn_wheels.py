"""The pulley, discs and drums along the shaft: places of marks and numbers, arrows, scales, words, pressures."""

import dataclasses
import functools
import math

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.patches import Arc, FancyArrowPatch, Wedge
from picture_scenes import CONTACTS, legend, plain_result, radius, scale, staged_result, wedges
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
    np.testing.assert_allclose(radius(ahead), 0.2)
    (arc,) = [p for p in axes.patches if isinstance(p, Arc)]
    assert (arc.theta1, arc.theta2, arc.width, arc.height) == (-50.0, 230.0, 0.4, 0.4)
    omega = float(run.series([0.1]).omega[0])
    assert f"$\\omega$\n{omega:.3g}\nrad/s" in [text.get_text() for text in axes.texts]
    rest = plot.pulley(run, 4.9).axes[0]
    assert "at rest" in [text.get_text() for text in rest.texts]
    assert not arrows(rest, "rotation")
    figure = plot.pulley(rigid_result(w0=-20.0), 0.1)
    (back,) = arrows(figure.axes[0], "rotation")
    np.testing.assert_allclose(angle_of(back), [-36.0, -50.0])
    words = " ".join(text.get_text() for text in figure.axes[0].texts)
    assert "lever end, now tight (lever)\n$T_0$ = 8 kN" in words
    slack = float(rigid_result(w0=-20.0).series([0.1]).tension[0, -1]) / 1e3
    assert f"anchor end, now slack (anchor)\n$T_n$ = {slack:.4g} kN" in words


def test_words_of_the_pulley():
    run = plain_result()
    middle = 0.5 * (float(run.slip_onset_time) + float(run.full_slip_time))
    figure = plot.pulley(run, middle)
    torque = float(run.series([middle]).brake_torque[0]) / 1e3
    lines = figure.get_suptitle().splitlines()
    assert lines[0].startswith("standard brake, 8 linings")
    assert f"brake torque {torque:.4g} kN·m" in lines
    assert any(line.startswith("load sharing of sticking linings: mobilisation rule") for line in lines)
    made = [to_hex(patch.get_facecolor()) for patch in figure.legends[0].get_patches()[1:]]
    assert made == [to_hex(CONTACTS[k]) for k in ("at its friction limit", "sticks")]
    later = plot.pulley(run, 0.5 * float(run.stopping_time))
    assert len(legend(later)) == 3


def test_both_pairs_of_a_staged_brake():
    """Linings in two rings; the load on the rim has an outline of its own."""
    run = staged_result()
    time = 0.5 * float(run.internal_slip_time)
    figure = plot.pulley(run, time)
    axes, pairs = figure.axes[0], run.series([time]).pairs
    value = scale(axes, "load scale")
    for gid, pair in (("load", "external"), ("rim load", "internal")):
        drawn = [value(bar.r - bar.width) for bar in wedges(axes, gid)]
        np.testing.assert_allclose(drawn, np.asarray(pairs[pair].normal_load)[0] / 1e3, rtol=1e-9)
    assert not wedges(axes, "rim load")[0].get_fill()
    outer, inner = wedges(axes, "external")[0], wedges(axes, "internal")[0]
    assert outer.r - outer.width == pytest.approx(inner.r)
    assert (outer.r, inner.r - inner.width) == pytest.approx((1.18, 1.02))
    (number,) = [t for t in axes.texts if t.get_text() == "3" and t.get_gid() is None]
    assert radius(number.get_position()) == pytest.approx(outer.r - 0.5 * outer.width)


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
    words = {t.get_text(): t.get_position() for t in wheel.texts}
    for i, text in enumerate(("1, 2", "3, 4", "5, 6", "7, 8")):
        assert radius(words[text]) == pytest.approx(0.725)
        assert math.cos(math.radians(angle_of(words[text]) - middles[i])) == pytest.approx(1.0)
    forces = next(text for text in words if text.startswith("pad 1")).splitlines()
    assert [line.partition(":")[0] for line in forces] == ["pad 1", "pad 2", "… 5 more …", "pad 8"]
    assert forces[0] == "pad 1: $N$ = 45 kN, friction 18 kN"
    curve, mean, effective = course.lines
    area = math.radians(16.0) / 2 * (0.8**2 - 0.65**2)
    assert mean.get_ydata()[0] == pytest.approx(45e3 / area / 1e6)
    assert mean.get_label() == f"mean {45e-3 / area:.4g} MPa"
    reach = 1e3 * float(disc.scene.brake.radius)
    assert effective.get_xdata()[0] == pytest.approx(reach)
    assert effective.get_label() == f"effective radius {reach:.4g} mm"
    r, p = curve.get_data()
    assert (r[0], r[-1]) == pytest.approx((650.0, 800.0))
    pull = np.trapezoid(1e6 * p * (r / 1e3), r / 1e3) * math.radians(16.0)  # ∫ p dA
    assert pull == pytest.approx(45e3, rel=1e-4)
    torque = 8 * 0.4 * np.trapezoid(1e6 * p * (r / 1e3) ** 2, r / 1e3) * math.radians(16.0)
    assert f"force of the actuator 45 kN, brake torque {torque / 1e3:.4g} kN·m" in figure.get_suptitle()
    assert (course.get_xlabel(), course.get_ylabel(), course.get_ylim()[0]) == ("radius, mm", "pressure, MPa", 0.0)
    assert wheel.get_xlim() == wheel.get_ylim() == (-wheel.get_xlim()[1], wheel.get_xlim()[1])
    (face,) = [p for p in wheel.patches if isinstance(p, Wedge) and p.get_gid() is None]
    assert 0.8 * 0.65 < face.r - face.width < 0.65  # a face somewhat broader than the pads
    whole = face.r
    assert 0.8 < whole < wheel.get_xlim()[1] < 1.2 * whole
    (tip,) = arrows(wheel, "rotation")
    np.testing.assert_allclose(radius(tip), 0.32 * float(disc.scene.brake.radius))
    default = plot.pressed(disc).get_suptitle()
    assert f"$t$ = {disc.report().peaks['max_normal_load'].time:.6g} s" in default


def test_an_odd_pad_is_alone_at_its_calliper(disc):
    brake = disc.scene.brake
    pads = dataclasses.replace(brake.linings, faces=3)
    run = sb.simulate(dataclasses.replace(disc.scene, brake=dataclasses.replace(brake, linings=pads)))
    wheel = plot.pressed(run, 0.3).axes[0]
    assert [t.get_text() for t in wheel.texts][:2] == ["1, 2", "3"]
    np.testing.assert_allclose([p.theta1 for p in wheel.patches if p.get_gid() == "pad"], [82.0, 262.0])
    forces = next(t.get_text() for t in wheel.texts if t.get_text().startswith("pad 1:"))
    assert [line.partition(":")[0] for line in forces.splitlines()] == ["pad 1", "pad 2", "pad 3"]


@pytest.mark.parametrize(("start", "end", "highest"), [(0.15, 126.0, 90.0), (0.15, 60.0, 60.0), (1.9, 150.0, 108.862)])
def test_shoes_lie_in_the_drum(start, end, highest):
    """The pressure rises with the sine of the angle from the pin; the leading shoe, ahead, is at the left."""
    run = sb.simulate(shoe_scene(end, start))
    figure = plot.pressed(run, 0.1)
    wheel, course = figure.axes
    normal = np.asarray(run.series([0.1]).normal_load)[0]
    top = np.asarray([float(run.scene.brake.greatest_pressure(N)) for N in normal])
    assert top[0] > top[1]
    assert [line.get_label() for line in course.lines] == ["shoe 1, leading ahead", "shoe 2, trailing ahead"]
    for line, p in zip(course.lines, top, strict=True):
        theta, drawn = line.get_data()
        assert (theta[0], theta[-1]) == pytest.approx((math.degrees(start), end))
        shape = np.sin(np.radians(theta)) / math.sin(math.radians(highest))
        np.testing.assert_allclose(drawn, 1e-6 * p * shape, rtol=1e-5)
    assert len({line.get_color() for line in course.lines}) == 2
    shoes = [p for p in wheel.patches if p.get_gid() == "shoe"]
    pins = [line.get_xydata()[0] for line in wheel.lines if line.get_marker() == "o"]
    beside = math.degrees(0.12)
    np.testing.assert_allclose(angle_of(pins), [-90.0 - beside, -90.0 + beside])
    np.testing.assert_allclose(radius(np.asarray(pins)), 0.1227)
    low, high = math.degrees(start), end
    np.testing.assert_allclose(
        [[p.theta1, p.theta2] for p in shoes],
        [[-90 - beside - high, -90 - beside - low], [-90 + beside + low, -90 + beside + high]],
    )
    fills = [p for p in wheel.patches if p.get_gid() == "pressure"]
    deepest = [0.92 * 0.15 - radius(p.get_xy()).min() for p in fills]
    np.testing.assert_allclose(np.divide(deepest, deepest[0]), top / top[0], rtol=1e-3)
    assert deepest[0] == pytest.approx(0.45 * 0.15, rel=1e-3)
    assert max(radius(p.get_xy()).max() for p in fills) == pytest.approx(0.92 * 0.15)
    for fill, shoe in zip(fills, shoes, strict=True):  # along the shoe, in both of its edges
        ahead, back = np.split(fill.get_xy()[:400], 2)
        for edge in (ahead, back[::-1]):
            turned = np.degrees(np.unwrap(np.radians(angle_of(edge))))
            ends = sorted([turned[0], turned[-1]])
            np.testing.assert_allclose(np.cos(np.radians(np.subtract(ends, [shoe.theta1, shoe.theta2]))), 1.0)
    for number, shoe in zip(("1", "2"), shoes, strict=True):
        (text,) = [t for t in wheel.texts if t.get_text() == number]
        middle = 0.5 * (shoe.theta1 + shoe.theta2)
        assert math.cos(math.radians(angle_of(text.get_position()) - middle)) == pytest.approx(1.0)
        assert shoe.r - shoe.width < radius(text.get_position()) < shoe.r
    (drum,) = [p for p in wheel.patches if isinstance(p, Wedge) and p.get_gid() is None]
    assert drum.r - drum.width == pytest.approx(1.02 * 0.15)
    assert wheel.get_xlim()[1] == pytest.approx(1.15 * 0.15)


def test_pressed_is_of_discs_and_drums():
    with pytest.raises(sb.InputError, match=r"is a band brake.* draw it with `plot\.pulley`"):
        plot.pressed(plain_result())
