"""The resolved chain (model §3.1): every lining sticks and slides for itself."""

import math

import numpy as np
import pytest
from chain_scenes import (
    ARM,
    chain,
    changes,
    drawworks,
    first_slips,
    full_slip_of,
    looked,
    run,
    stop_of,
)
from helpers import all_equal, all_near, closes, near
from scenes import lining_ratio

import simbrake as sb

Z_ANGLE = math.tan(math.radians(13.5))
MU = lining_ratio(0.3, math.radians(27.0))


def quasi_static(k=4, R_b=ARM, C=5.0 / ARM, J=4.0):
    """First lining limit, t1 and stopping time from the onset of slip (closed forms of
    model §3), T_0 = ω_0 = 1."""
    chi = math.sqrt(C * R_b**2 / J)
    first, t1 = (math.asin(chi * (MU**i - 1) / (C * R_b)) / chi for i in (1, k))
    return first, t1, t1 + math.cos(chi * t1) * J / (R_b * (MU**k - 1))


@pytest.mark.slow
def test_converges_to_the_quasi_static_band():
    first, t1, stop = quasi_static()
    masses = np.asarray([1e-2, 1e-3, 1e-4])
    stiffnesses = np.asarray([1e2, 1e3, 1e4])
    light = [run(chain(m=m, K=1e4), 1e-9, 32768) for m in masses]
    stiff = [run(chain(m=1e-4, K=K, end=0.4), 1e-9, 32768) for K in stiffnesses]
    errors = {
        "first slip over mass": (
            masses,
            [first_slips(r).min() - first for r in light],
            1.0,
        ),
        "stopping time over mass": (
            masses[1:],
            [stop_of(r) - stop for r in light[1:]],
            1.0,
        ),
        "full slip over stiffness": (
            stiffnesses,
            [full_slip_of(r) - t1 for r in stiff],
            -1.0,
        ),
    }
    for name, (sizes, error, slope) in errors.items():
        found = np.diff(np.log(np.abs(error))) / np.diff(np.log(sizes))
        print(name, np.asarray(error), "slopes", found)
        all_near(found, slope, atol=0.06, err_msg=name)
    # with a damped anchor the linings come to rest and carry what statics says
    record = run(chain(m=1e-4, K=1e4, damping=4.5e-3), 1e-9, 32768)
    i = int(np.searchsorted(np.asarray(record.rows.t)[: int(record.count)], 3.0))
    all_near(np.asarray(looked(record)[0].tension)[i], MU ** np.arange(1, 5), 1e-6)
    all_near([stop_of(record), full_slip_of(record)], [stop, t1], atol=1.1e-3)


def test_a_whole_stop_of_26_linings():
    result = sb.simulate(drawworks(26))
    closes(result, 1e-9)
    record = result.record
    _, y, mode = looked(record)
    linings = np.asarray(mode.own.linings)[: int(record.count) + 1]
    # a lining that comes to stick has exactly the speed of the pulley from then on
    rows = np.flatnonzero(np.any((linings[1:] == 0) & (linings[:-1] != 0), axis=1)) + 1
    caught = (linings[rows] == 0) & (linings[rows - 1] != 0)
    rim = np.asarray(record.system.mechanism.radius * y.omega)[rows, None]
    assert np.sum(caught) >= 26
    assert not np.any(np.where(caught, np.asarray(y.own.v)[rows] - rim, 0.0))
    # from the tight end on; near the slack end the rising lever draws the linings ahead
    # of the pulley first
    first = first_slips(record)
    assert np.all(np.diff(first[6:]) < 0)
    bands = [int(after.band) for _, _, after in changes(record)]
    assert sb.results.BandMode.SLIP in bands
    assert bands[-1] == sb.results.BandMode.HELD


@pytest.mark.slow
def test_lining_friction_is_at_its_own_slip():
    s = sb.simulate(
        chain(law=sb.StribeckFriction(0.35, 0.3, 0.4), m=0.05, damping=0.05, end=1.0)
    ).series([0.25, 0.5])
    slip = np.abs(np.asarray(s.pairs["external"].slip_speed))
    assert slip[1].max() > 1.001 * slip[1].min() > 0.0
    all_near(s.friction_coefficient, 0.3 + 0.05 * np.exp(-((slip / 0.4) ** 2)), 1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("sense", [1, -1])
def test_sudden_load_moves_a_chain_its_way(sense):
    load = (0.0,), (sense * 400.0,)
    result = sb.simulate(chain(w0=0.0, load=load, m=0.05, damping=0.3, end=0.5))
    last = int(result.record.count)
    assert result.events["restart"].times == [0.0]
    assert int(result.record.modes.sense[last]) == sense
    assert sense * float(result.record.y_end.omega) > 1.0


def test_segments_go_slack_and_taut_again():
    # let go, and thrown in again
    lever = (0.0, 0.5, 0.5, 1.0, 1.0), (1.0, 1.0, 0.0, 0.0, 1.0)
    scene = chain(lever=lever, m=2e-2, K=100.0, end=3.0)
    result = sb.simulate(scene, rtol=1e-11)
    closes(result, 1e-10)
    record = result.record
    found = changes(record)
    for bit in (1, 2):  # a segment pulls, a segment is stretched
        was = np.stack([after.own.segments & bit for _, _, after in found]) > 0
        gone = [i for i in range(4) if np.any(~was[:, i]) and was[-1, i]]
        assert gone
    tension = np.asarray(looked(record)[0].tension)[: int(record.count) + 1]
    assert np.min(tension) >= -1e-14


@pytest.mark.slow
def test_linings_that_let_go_at_one_instant():
    # from rest under a ramp of the load the same force would hold each lining: M(t) =
    # (J + n m R²) 2 f z T_0/(m R)
    n = 5
    m = 0.5
    J = 4.0
    rate = 2.0
    # the anchor's lining holds: its spring pulls as well
    f = np.asarray([0.3, 0.3, 0.3, 0.3, 0.9])
    load = (0.0, 10.0), (0.0, 10.0 * rate)
    record = run(
        chain(
            n=n,
            f=f,
            m=m,
            J=J,
            R_b=1.0,
            C=1e-6,
            w0=0.0,
            K=50.0,
            load=load,
            T0=0.01,
            x0=1e4,
            ratio=0.0,
            end=0.3,
        ),
        1e-12,
        256,
    )
    found = changes(record)
    t = (J + n * m) * 2 * 0.3 * Z_ANGLE * 0.01 / m / rate
    near(found[0][0], t, 1e-10)
    all_equal(found[0][1].own.linings, 0)
    all_equal(found[0][2].own.linings, [1, 1, 1, 1, 0])
    assert found[0][1].band == sb.results.BandMode.HELD
