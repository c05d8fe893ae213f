"""Linings that travel under the band: wear of a ring against quadrature."""

import math

import numpy as np
import pytest
import staged_scenes as staged
from helpers import all_near, near
from scenes import lining_ratio, replaced

import simbrake as sb

RATE = 2e-14
AREA = 0.03
S = math.sin(staged.BETA / 2)
PI = lining_ratio(staged.F_EXT, staged.BETA) ** np.arange(staged.N + 1)
ARM = staged.R_B * (PI[-1] - 1)
#: wear per newton of slack tension and radian of travel at each station
EACH = RATE * (PI[1:] + PI[:-1]) * S / AREA * staged.R_B


def riding(lever, load, end, w0=20.0):
    """A bandage whose interference carries it round with the pulley."""
    scene = staged.stop(lever=lever, load=load, w0=w0, end=end, preload=1e5)
    return replaced(scene, {"brake.linings.area": AREA})


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
    near(found.travel, travel, 1e-11)
    way = mean_over_arcs(count, start + travel) - mean_over_arcs(count, start)
    all_near(found.depth, way @ EACH * T_0, 1e-9)
    # what the stations give is what the ring has
    near(
        found.depth.sum() * 2 * math.pi / count,
        found.stations.sum() * staged.BETA,
        1e-12,
    )
