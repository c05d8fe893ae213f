"""Classical estimates of a staged brake: exact where the run is as they assume, and
each pair with its own numbers."""

import numpy as np
import pytest
import staged_scenes
from helpers import all_near, near
from scenes import lining_ratio, replaced
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import simbrake as sb

R, R_B, J, J_B, N = (
    getattr(staged_scenes, name) for name in ("R", "R_B", "J", "J_B", "N")
)


def constant(T_0, **changes):
    """A stop under a constant lever tension: what the classical estimate assumes."""
    return staged_scenes.stop(lever=sb.Constant(T_0), end=60.0, **changes)


def by_hand(T_0, load=300.0, w0=20.0):
    """Stages 2 and 3 from the equations of motion, the tension of the held bandage by
    bisection."""
    s = np.sin(staged_scenes.BETA / 2)
    mu = np.full(N, lining_ratio(staged_scenes.F_EXT, staged_scenes.BETA))

    def grip(T_n):
        T = staged_scenes.tensions(T_0, T_n, mu)
        return (
            R
            * staged_scenes.F_INT
            * float(np.sum((T[1:] + T[:-1]) * s + staged_scenes.PRELOAD))
        )

    top = T_0 * float(np.prod(mu))
    M_ext = R_B * (top - T_0)
    M_int = grip(top)
    T_n = brentq(
        lambda T_n: R_B * (T_n - T_0) - grip(T_n), T_0, top, xtol=1e-9, rtol=1e-14
    )
    t_2 = J_B * w0 / (M_ext - M_int)
    left = w0 + (load - M_int) / J * t_2
    t_3 = J * left / (grip(T_n) - load)
    external = M_ext * w0 * t_2 / 2
    # what is left of kinetic energy and load is worked off inside
    turned = (w0 + left) * t_2 / 2 + left * t_3 / 2
    return (t_2, t_3), external, 0.5 * (J + J_B) * w0**2 + load * turned - external


@pytest.mark.parametrize("T_0", [3e3, 12e3])
def test_the_classical_staged_stop(T_0):
    stop = sb.formulas.classical_staged_stop(constant(T_0))
    ((t_2, t_3), external, internal) = by_hand(T_0)
    assert stop is not None
    near(stop.times, (0.0, t_2, t_3), 1e-9)
    near(stop.external.work, external, 1e-12)
    near(stop.internal.work, internal, 1e-9)
    assert stop.onset < T_0


@pytest.fixture(scope="module")
def run():
    return sb.simulate(constant(3e3))


@pytest.mark.slow
def test_run_as_the_estimate_assumes_agrees(run):
    table = sb.estimates(run)
    for name in (
        "torque, external pair",
        "torque, both pairs slide",
        "stage 2",
        "stage 3",
        "stopping time",
        "stopping angle",
        "friction work",
        "friction work, external pair",
        "friction work, internal pair",
        "share of the external pair",
        "share of the internal pair",
    ):
        assert table[name].value == pytest.approx(table[name].simulated, rel=1e-8), name
    assert table["stage 1"].value == table["stage 1"].simulated == 0
    alone = sb.estimates(constant(3e3))
    assert {row.simulated for row in alone} == {None}
    for name in (
        "surface temperature, falling flux, internal pair",
        "bulk temperature, end, external pair",
    ):
        assert alone[name].value == pytest.approx(table[name].value, rel=1e-6), name
    # work over friction, way and area of the linings
    near(
        alone["pressure, mean, internal pair"].value,
        table["pressure, mean, internal pair"].value,
        1e-3,
    )


@pytest.mark.slow
def test_brake_below_onset_rides_to_the_end():
    scene = constant(500.0)
    stop = sb.formulas.classical_staged_stop(scene)
    assert stop is not None
    assert stop.internal == (0.0, 0.0, 0.0, 0.0)
    near(stop.external.work, 0.5 * (J + J_B) * 20.0**2 + 300.0 * stop.angle, 1e-12)
    table = sb.estimates(scene)
    assert table["share of the internal pair"].value == 0
    assert not any(row.name.endswith("rim, internal pair") for row in table)
    result = sb.simulate(scene)
    near(sb.estimates(result)["stage 1"].value, result.metrics["stopping_time"], 1e-10)


def test_pairs_have_their_shares_and_faces():
    data = sb.formulas.EstimateData(
        share=0.9,
        external_share=0.6,
        beyond_share=0.05,
        track_area=0.9,
        lining_area=0.6,
        outer_area=0.7,
    )
    table = sb.estimates(constant(3e3), data)
    stop = sb.formulas.classical_staged_stop(constant(3e3))
    assert stop is not None
    inputs = {i.name: i for i in table.inputs}
    rim = inputs["rim"].value
    band = inputs["band"].value
    into_rim = 0.9 * stop.internal.work + 0.05 * stop.external.work
    rise = into_rim / (0.9 * 0.025 * float(rim.density * rim.specific_heat))
    near(table["bulk temperature, end, internal pair"].value - 293.15, rise)
    rise = (
        0.6
        * stop.external.work
        / (0.7 * 0.006 * float(band.density * band.specific_heat))
    )
    near(table["bulk temperature, end, external pair"].value - 293.15, rise)
    way = R * stop.internal.angle
    pressure = stop.internal.work / (staged_scenes.F_INT * way * 0.6)
    near(table["pressure, mean, internal pair"].value, pressure)


@pytest.mark.slow
def test_staged_stop_with_centrifugal_force():
    """Stage 2 against SciPy, with linings off the rim at first; and beside a run."""
    mass = 5.0
    T_0 = 3e3
    load = 300.0
    w0 = 30.0
    scene = constant(T_0, w0=w0, preload=300.0)
    masses = {"mass": mass, "mass_radius": 0.61}
    scene = replaced(scene, {"brake.bandage": replaced(scene.brake.bandage, masses)})
    Pi = lining_ratio(staged_scenes.F_EXT, staged_scenes.BETA) ** np.arange(N + 1)
    pressed = T_0 * (Pi[1:] + Pi[:-1]) * np.sin(staged_scenes.BETA / 2) + 300.0
    assert np.any(pressed < mass * 0.61 * w0**2)

    def rates(t, y):
        M = (
            R
            * staged_scenes.F_INT
            * np.maximum(pressed - mass * 0.61 * y[1] ** 2, 0).sum()
        )
        return [
            (load - M) / J,
            (M - R_B * T_0 * (Pi[-1] - 1)) / J_B,
            y[0],
            y[1],
            M * (y[0] - y[1]),
        ]

    lock = lambda t, y: y[1]
    lock.terminal = True
    truth = solve_ivp(
        rates, (0, 9), [w0, w0, 0, 0, 0], "DOP853", events=lock, rtol=1e-12, atol=1e-12
    )
    stop = sb.formulas.classical_staged_stop(scene)
    near(stop.times[1], truth.t[-1], 1e-9)
    near(stop.external.angle, truth.y[3, -1], 1e-9)
    M_3 = stop.torques[2]
    left = truth.y[0, -1]
    near(stop.times[2], J * left / (M_3 - load), 1e-9)
    near(stop.angle, truth.y[2, -1] + 0.5 * left * stop.times[2], 1e-9)
    near(stop.internal.work, truth.y[4, -1] + M_3 * 0.5 * left * stop.times[2], 1e-9)
    table = sb.estimates(sb.simulate(scene))
    for name in (
        "stage 2",
        "stage 3",
        "friction work, internal pair",
        "slack tension of internal slip",
    ):
        row = table[name]
        if name.startswith("slack"):
            assert row.value < row.simulated == T_0
        else:
            assert row.value == pytest.approx(row.simulated, rel=1e-8), name


def test_initial_friction_by_speed_of_pair():
    """The outer pair slides on the band circle, the inner one on the rim; a line
    through two points, 0 at 20 m/s."""
    law = sb.friction.TabulatedFriction([0.0, 20.0], [0.4, 0.0])
    scene = staged_scenes.stop(law=law, inner=law, w0=20.0)
    for pair, radius in (("external", R_B), ("internal", R)):
        found = sb.formulas.statics.friction_at_start(scene, pair)
        all_near(found, np.full(N, 0.4 * (1 - radius)), 1e-12)
