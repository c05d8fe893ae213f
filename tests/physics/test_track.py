"""A point of the track over a revolution, against Fourier series and closed forms."""

import math

import numpy as np
import pytest
import staged_scenes
from helpers import all_near, near
from material_scenes import heated
from scenes import replaced

import simbrake as sb

STEEL = sb.material("steel_20L")
E = float(STEEL.effusivity)
ZETA = -0.2078862249773546  # ζ(−½)


def by_fourier(x, edges, flux, period, effusivity, terms=400_000):
    """Each harmonic of the flux through its own impedance `e √(iω)`; the tail of the
    sum is of the order N^{−3/2}."""
    ends = np.append(edges[1:], edges[0] + 1.0)
    total = np.zeros(np.size(x))
    for first in range(1, terms, 50_000):
        k = np.arange(first, first + 50_000)[:, None]
        c = (
            flux * (np.exp(-2j * np.pi * k * edges) - np.exp(-2j * np.pi * k * ends))
        ).sum(axis=1) / (2j * np.pi * k[:, 0])
        root = effusivity * np.sqrt(2j * np.pi * k[:, 0] / period)
        total += 2 * np.real((c / root) @ np.exp(2j * np.pi * k * x))
    return total


def test_square_wave_of_flux_on_a_half_space():
    """`±q` in turn: at the ends of the halves `∓(4 q/e) √(P/π) (2 − √½) ζ(−½)`, and the
    series in between."""
    q = 2e6
    period = 0.05
    edges = np.asarray([0.0, 0.5])
    flux = np.asarray([q, -q])
    ends = sb.formulas.revolution_ripple([0.0, 0.5], edges, flux, period, E)
    top = 4 * q / E * math.sqrt(period / math.pi) * (math.sqrt(0.5) - 2) * ZETA
    all_near(ends, [-top, top], 1e-13)
    x = np.asarray([0.13, 0.31, 0.77])
    found = sb.formulas.revolution_ripple(x, edges, flux, period, E)
    all_near(found, by_fourier(x, edges, flux, period, E), 1e-7)


def test_ripple_of_any_flux_has_no_mean():
    edges = np.asarray([0.05, 0.2, 0.45, 0.7])
    flux = np.asarray([3e6, -2e4, 1e6, -2e4])
    x = np.asarray([0.0, 0.1, 0.33, 0.6, 0.9])
    found = sb.formulas.revolution_ripple(x, edges, flux, 0.3, E)
    all_near(
        found, by_fourier(x, edges, flux, 0.3, E), atol=1e-6 * np.max(np.abs(found))
    )
    nodes, weights = np.polynomial.legendre.leggauss(40)
    mean = 0.0
    for begin, end in zip(edges, [*edges[1:], 1.05], strict=True):
        # x = begin + h u²: the ripple has a root at the beginning of an interval
        u = 0.5 * (nodes + 1)
        inside = sb.formulas.revolution_ripple(
            begin + (end - begin) * u**2, edges, flux, 0.3, E
        )
        mean += (end - begin) * np.sum(weights * inside * u)
    assert abs(mean) < 1e-12 * np.max(np.abs(found))


@pytest.fixture(scope="module")
def stop():
    scene = heated()
    n = scene.brake.linings.count
    share = 0.6
    wrap = float(np.sum(scene.brake.linings.angle))
    area = share * wrap / n * float(scene.brake.pulley.radius) * 0.22
    changes = {"brake.pulley.width": 0.22, "brake.linings.area": area}
    return sb.simulate(replaced(scene, changes)), area


@pytest.mark.slow
def test_a_point_of_the_track_in_a_run(stop):
    result, area = stop
    rim = result.scene.heat.bodies[0].material
    linings = result.scene.brake.linings
    angle = np.asarray(linings.angle)
    t = float(result.stopping_time) * np.asarray([0.2, 0.7])
    ripple = sb.formulas.track_ripple(result, t)
    s = result.series(t)
    omega = np.asarray(s.omega)
    all_near(ripple.period, 2 * math.pi / omega, 1e-12)
    # linings from the tight end on, each over 0.6 of its section
    before = np.append(np.asarray(s.slack_tension)[0], np.asarray(s.tension)[0, :-1])
    power = (
        (np.asarray(s.tension)[0] - before)
        * float(result.scene.brake.band.radius)
        * omega[0]
    )
    share = result.energy["heat_to_metal"] / result.energy["friction_heat"]
    all_near(ripple.flux[0][ripple.heated], share * power[::-1] / area, 1e-9)
    all_near(ripple.flux[0][~ripple.heated], 0.0)
    pitch = angle[::-1] / (2 * math.pi)
    all_near(ripple.edges[ripple.heated], np.cumsum(pitch) - 0.8 * pitch, 1e-9)
    x = np.append(np.linspace(0.0, 1.0, 500), ripple.edges)
    truth = sb.formulas.revolution_ripple(
        x, ripple.edges, ripple.flux[0], ripple.period[0], float(rim.effusivity)
    )
    near(ripple.amplitude[0], np.ptp(truth), 1e-5)
    near(ripple.above[0], np.max(truth), 1e-5)


@pytest.mark.slow
def test_inner_pair_heats_a_staged_rim():
    scene = staged_scenes.stop(lever=sb.Constant(3e3), end=60.0)
    scene = sb.with_values(
        scene, {"brake.bandage.area": 0.05, "brake.pulley.width": 0.2}
    )
    result = sb.simulate(scene)
    t = [
        stage.start + 0.5 * stage.duration
        for stage in result.stages
        if stage.name == "stage_3"
    ]
    ripple = sb.formulas.track_ripple(result, t, material=STEEL, share=0.9)
    s = result.series(np.asarray(t))
    power = np.asarray(s.pairs["internal"].torque) * np.asarray(s.omega)
    near(0.9 * power[0], 0.05 * ripple.flux[0][ripple.heated].sum(), 1e-9)
    assert float(s.bandage_speed[0]) == 0.0
    near(ripple.period[0], 2 * math.pi / float(s.omega[0]))
