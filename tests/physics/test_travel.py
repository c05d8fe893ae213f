"""Linings that travel under the band: wear of a ring against quadrature."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
import staged_scenes as staged
from scipy.integrate import quad

import simbrake as sb

RATE = 2e-14
AREA = 0.03
Z = math.tan(staged.BETA / 2)
S = math.sin(staged.BETA / 2)
PI = ((1 + staged.F_EXT * Z) / (1 - staged.F_EXT * Z)) ** np.arange(staged.N + 1)
ARM = staged.R_B * (PI[-1] - 1)
#: wear per newton of slack tension and radian of travel at each station
EACH = RATE * (PI[1:] + PI[:-1]) * S / AREA * staged.R_B


def riding(lever, load, end, w0=20.0):
    """A bandage whose interference carries it round with the pulley."""
    scene = staged.stop(lever=lever, load=load, w0=w0, end=end, preload=1e5)
    linings = dataclasses.replace(scene.brake.linings, area=AREA)
    return dataclasses.replace(
        scene, brake=dataclasses.replace(scene.brake, linings=linings)
    )


def under(ring, travel):
    """Angle (rad) by which each point of the ring, at the angles `ring`, passes under
    each station during `travel`."""
    begin = staged.BETA * np.arange(staged.N)
    found = np.zeros((len(ring), staged.N))
    for k in range(-1, 12):
        low = np.maximum.outer(ring - travel, begin - 2 * math.pi * k)
        high = ring[:, None]
        found += np.maximum(
            np.minimum(high, begin + staged.BETA - 2 * math.pi * k) - low, 0
        )
    return found


def mean_over_arcs(count, travel):
    """The same, mean over each lining of the ring, by the midpoint rule: linear between
    points of a grid."""
    # edges of stations (33°) and ring linings lie on it, and those of `travel` if it is
    # on it
    fine = 3960
    points = (np.arange(fine) + 0.5) * 2 * math.pi / fine
    return under(points, travel).reshape(count, -1, staged.N).mean(axis=1)


@pytest.mark.slow
def test_a_stop_under_constant_tension():
    """Wear goes with the way, whatever the speed: each point of the ring has what
    passed it."""
    count = 11
    start = 2 * math.pi * 7 / 3960
    travel = 2 * math.pi * 4411 / 3960
    T_0 = (300.0 + (staged.J + staged.J_B) * 20.0**2 / (2 * travel)) / ARM
    found = sb.results.ring_wear(
        sb.simulate(riding(sb.Constant(T_0), 300.0, end=3.0)), count, RATE, start=start
    )
    assert found.travel == pytest.approx(travel, rel=1e-11)
    way = mean_over_arcs(count, start + travel) - mean_over_arcs(count, start)
    np.testing.assert_allclose(found.depth, way @ EACH * T_0, rtol=1e-9)
    # what the stations give is what the ring has
    assert found.depth.sum() * 2 * math.pi / count == pytest.approx(
        found.stations.sum() * staged.BETA, rel=1e-12
    )


@pytest.mark.slow
def test_a_ramp_against_quadrature():
    """`T_0` and so the wear per way grow with time: one integral per lining, between
    its corners."""
    scene = riding(sb.PiecewiseLinear([0.0, 9.0], [200.0, 36200.0]), 600.0, end=0.7)
    found = sb.results.ring_wear(sb.simulate(scene), 9, RATE)
    count = 9
    J = staged.J + staged.J_B
    omega = np.polynomial.Polynomial(
        [20.0, (600 - ARM * 200.0) / J, -ARM * 4e3 / (2 * J)]
    )
    psi = omega.integ()
    end = 0.7
    assert found.travel == pytest.approx(psi(end), rel=1e-11)
    edges = staged.BETA * np.arange(staged.N + 1)
    width = 2 * math.pi / count
    for j in (0, 4, 8):
        corners = [
            width * (j + k) - e + 2 * math.pi * n
            for k in (0, 1)
            for e in edges
            for n in range(-1, 4)
        ]
        roots = [(psi - c).roots() for c in corners if 0 < c < psi(end)]
        at = sorted(
            {
                float(r.real)
                for each in roots
                for r in each
                if abs(r.imag) < 1e-9 and 0 < r.real < end
            }
        )

        def rate(t, j=j):
            begin = width * j - psi(t)
            reach = 0.0
            for i, e in enumerate(edges[:-1]):
                for n in range(-1, 5):
                    low = max(begin + 2 * math.pi * n, e)
                    high = min(begin + width + 2 * math.pi * n, e + staged.BETA)
                    reach += max(high - low, 0) / width * EACH[i]
            return reach * (200 + 4e3 * t) * omega(t)

        pieces = [0.0, *at, end]
        truth = sum(
            quad(rate, a, b, epsabs=0, epsrel=1e-11)[0]
            for a, b in itertools.pairwise(pieces)
        )
        assert found.depth[j] == pytest.approx(truth, rel=1e-9)
