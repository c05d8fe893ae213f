"""The pulley, discs and drums along the shaft: places of marks, arrows, scales,
pressures."""

import math

import numpy as np
import pytest
from picture_scenes import radius, scale, staged_result, wedges

import simbrake as sb
from simbrake import plot


def shoe_scene(end=126.0, start=0.15):
    force = sb.PiecewiseLinear([0.0, 9.0], [2e3, 2e3])
    shoes = sb.Shoes(sb.ConstantFriction(0.32), 0.150, 0.032, start, math.radians(end))
    brake = sb.ShoeBrake(12.0, shoes, 0.1227, 0.212)
    return sb.Scene(
        brake, sb.ForceDuty(force, sb.TorqueLoad(0.0)), sb.Initial(25.0), 4.0
    )


# --- along the band -----------------------------------------------------------------


def test_both_pairs_of_a_staged_brake():
    run = staged_result()
    time = 0.5 * float(run.internal_slip_time)
    axes = plot.pulley(run, time).axes[0]
    pairs = run.series([time]).pairs
    value = scale(axes, "load scale")
    for gid, pair in (("load", "external"), ("rim load", "internal")):
        drawn = [value(bar.r - bar.width) for bar in wedges(axes, gid)]
        np.testing.assert_allclose(
            drawn, np.asarray(pairs[pair].normal_load)[0] / 1e3, rtol=1e-9
        )


# --- pads and shoes -----------------------------------------------------------------


@pytest.fixture(scope="module")
def disc():
    return sb.simulate(sb.read_scene(sb.files.shipped("disc")))


def test_pads_lie_around_the_disc(disc):
    """Eight pads of 16° at four callipers, each with 45 kN; uniform wear: `p r` is
    constant."""
    wheel, course = plot.pressed(disc, 0.3).axes
    pads = [p for p in wheel.patches if p.get_gid() == "pad"]
    middles = [90.0, 180.0, 270.0, 360.0]
    np.testing.assert_allclose(
        [[p.theta1, p.theta2] for p in pads], [[m - 8.0, m + 8.0] for m in middles]
    )
    assert all((p.r, p.width) == pytest.approx((0.8, 0.15)) for p in pads)
    curve, mean, effective = course.lines
    area = math.radians(16.0) / 2 * (0.8**2 - 0.65**2)
    assert mean.get_ydata()[0] == pytest.approx(45e3 / area / 1e6)
    assert effective.get_xdata()[0] == pytest.approx(
        1e3 * float(disc.scene.brake.radius)
    )
    r, p = curve.get_data()
    assert (r[0], r[-1]) == pytest.approx((650.0, 800.0))
    pull = np.trapezoid(1e6 * p * (r / 1e3), r / 1e3) * math.radians(16.0)  # ∫ p dA
    assert pull == pytest.approx(45e3, rel=1e-4)


@pytest.mark.parametrize(
    ("start", "end", "highest"),
    [(0.15, 126.0, 90.0), (0.15, 60.0, 60.0), (1.9, 150.0, 108.862)],
)
def test_shoes_lie_in_the_drum(start, end, highest):
    """The pressure rises with the sine of the angle from the pin; the leading shoe,
    ahead, is at the left."""
    run = sb.simulate(shoe_scene(end, start))
    wheel, course = plot.pressed(run, 0.1).axes
    normal = np.asarray(run.series([0.1]).normal_load)[0]
    top = np.asarray([float(run.scene.brake.greatest_pressure(N)) for N in normal])
    assert top[0] > top[1]
    for line, p in zip(course.lines, top, strict=True):
        theta, drawn = line.get_data()
        assert (theta[0], theta[-1]) == pytest.approx((math.degrees(start), end))
        shape = np.sin(np.radians(theta)) / math.sin(math.radians(highest))
        np.testing.assert_allclose(drawn, 1e-6 * p * shape, rtol=1e-5)
    fills = [p for p in wheel.patches if p.get_gid() == "pressure"]
    deepest = [0.92 * 0.15 - radius(p.get_xy()).min() for p in fills]
    np.testing.assert_allclose(np.divide(deepest, deepest[0]), top / top[0], rtol=1e-3)
