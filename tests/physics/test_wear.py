"""Wear as a part of a scene: laws, states beside a run, and that a scene without it
pays nothing."""

import functools
import math

import bandage_scenes
import chain_scenes
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import staged_scenes
import wear_scenes as ws
from helpers import all_near, names_of, near
from scenes import stop_scene
from scipy.integrate import quad

import simbrake as sb

# --- laws ----------------------------------------------------------------------------


def test_laws_at_their_reference():
    laws = [
        sb.wear.ConstantWear(3e-14),
        sb.wear.LinearWear(3e-14, slope=6e-3, reference=423.15),
        sb.wear.ExponentialWear(3e-14, rise=120.0, reference=423.15),
        sb.wear.ArrheniusWear(3e-14, energy=4e4, reference=423.15),
        sb.wear.ThresholdWear(3e-14, energy=4e4, threshold=423.15),
    ]
    for law in laws:
        for T in (None, jnp.asarray(423.15)):
            near(law(None, None, T), 3e-14, 1e-15)
    hot = jnp.asarray([373.15, 573.15])
    grows = np.asarray(laws[2].at(hot))
    near(grows[1] / grows[0], math.exp(200 / 120), 1e-14)
    decomposed = np.asarray(laws[3].at(hot))
    over_gas = 4e4 / 8.31446261815324
    near(math.log(decomposed[1] / decomposed[0]), over_gas * (1 / 373.15 - 1 / 573.15))
    above = math.exp(over_gas * (1 / 423.15 - 1 / 573.15))
    all_near(laws[4].at(hot), 3e-14 * np.array([1.0, above]))
    all_near(laws[1].at(hot), 3e-14 * np.array([0.7, 1.9]), 1e-14)
    assert float(laws[1].at(jnp.asarray(200.0))) == 0.0  # never negative


# --- a stop in closed form ----------------------------------------------------------


@pytest.fixture(scope="module")
def cold():
    return sb.simulate(ws.stop(sb.Wear(ws.K)))


def test_rigid_stop_wears_linings_by_loads(cold):
    normal = ws.statics()[1]
    worn = np.asarray(cold.worn_thickness)
    all_near(worn / worn.sum(), normal / normal.sum(), 1e-12)
    all_near(worn, ws.K * ws.T0 * normal / ws.AREA * ws.distance(), 1e-10)
    # the volume is that of Archard for the friction work: f N = (T_i − T_{i−1})
    # cos(β/2)
    work = float(cold.energy["friction_heat"])
    near(ws.AREA * worn.sum(), ws.K * work * math.cos(ws.BETA / 2) / ws.F, 1e-12)
    all_near(worn, sb.results.lining_wear(cold, ws.K), 1e-12)


def test_lining_pressure_integrates_to_load():
    """At, near and far from a uniform pressure, below and above 1; smooth there,
    derivatives too."""
    for ratio in (0.3, 1 - 1e-3, 1.0, 1 + 1e-9, 1.02, 1.7, 40.0):
        within = functools.partial(sb.brakes.pressure_within, 3.0, ratio)
        mean = quad(
            lambda s, within=within: float(within(s)), 0.0, 1.0, epsabs=0, epsrel=1e-13
        )[0]
        near(mean, 3.0, 1e-12)
        near(float(within(1.0)) / float(within(0.0)), ratio, 1e-12)
    # p/p̄ = 1 + x (s − ½) + x² (s²/2 − s/2 + 1/12) + …,  x = ln r
    first = jax.grad(lambda r: sb.brakes.pressure_within(1.0, r, 0.8))(1.0)
    second = jax.grad(
        jax.grad(lambda x: sb.brakes.pressure_within(1.0, jnp.exp(x), 0.8))
    )(0.0)
    all_near([first, second], [0.3, 2 * (0.32 - 0.4 + 1 / 12)], 1e-12)


@pytest.mark.slow
def test_edges_of_linings_in_a_run(cold):
    tension, normal = ws.statics()
    x = np.log(tension[1:] / tension[:-1])
    edges = [
        ws.T0 * normal / ws.AREA * x / np.expm1(x) * np.exp(x * s) for s in (0.0, 1.0)
    ]
    for name, place, pressure in zip(
        ("slack_edge", "tight_edge"), (0.0, 1.0), edges, strict=True
    ):
        all_near(sb.results.lining_peak(cold, f"{name}_pressure"), pressure, 1e-12)
        all_near(sb.results.lining_mean(cold, f"{name}_pressure"), pressure, 1e-10)
        all_near(sb.results.lining_peak(cold, "edge_pressure_ratio"), np.exp(x), 1e-12)
        worn = sb.results.lining_wear(cold, ws.K, place=place)
        all_near(worn, ws.K * pressure * ws.distance(), 1e-10)


@pytest.mark.slow
def test_wear_metrics_series_and_words(cold):
    _, normal = ws.statics()
    m = cold.metrics
    near(m["greatest_wear"], cold.worn_thickness[-1], 1e-15)
    near(m["wear_over_mean"], normal[-1] / normal.mean(), 1e-12)
    near(m["wear_over_least"], normal[-1] / normal[0], 1e-12)
    # wear follows the distance: φ R
    series = cold.series([0.0, 0.5, 8.0])
    share = np.asarray(series.phi) / float(series.phi[-1])
    all_near(series.worn_thickness, np.outer(share, cold.worn_thickness), 1e-10)
    data = sb.dataset(cold, [0.0, 8.0])
    assert data.worn_thickness.dims == ("time", "lining")


def test_run_without_slip_has_no_wear(cold):
    still = sb.simulate(sb.with_values(cold.scene, {"initial.omega": 0.0}))
    assert not np.any(np.asarray(still.worn_thickness))
    assert still.metrics["wear_over_mean"] is None


# --- with heat ----------------------------------------------------------------------


@pytest.mark.parametrize(
    "solver", [None, pytest.param(sb.hybrid.Rodas5P(), marks=pytest.mark.slow)]
)
def test_hot_wear_is_as_exact_as_the_run(solver):
    """All heat into an insulated rim: `k p_i ∫ exp((T − T_r)/ΔT) ds`, `T = T_r + W/C`;
    no rate depends on the wear."""
    rise = 70.0
    capacity = 800.0
    heat = sb.thermal.lumped_heat(
        rim=capacity, partition=sb.thermal.ConstantPartition(1.0), rim_cooling=0.0
    )
    result = sb.simulate(
        ws.stop(sb.Wear(sb.wear.ExponentialWear(ws.K, rise)), heat),
        solver=solver,
        rtol=1e-9,
    )
    hottest = ws.J * ws.W0**2 / 2 / capacity
    mean = rise / hottest * math.expm1(hottest / rise)
    worn = ws.K * ws.T0 * ws.statics()[1] / ws.AREA * ws.distance() * mean
    all_near(result.worn_thickness, worn, 1e-8)


# --- every kind of brake ------------------------------------------------------------


@pytest.mark.parametrize(
    "scene",
    [
        lambda: stop_scene(n=6, beta=40.0, law=sb.ConstantFriction(0.25, 1.2)),
        pytest.param(lambda: staged_scenes.stop(end=6.0), marks=pytest.mark.slow),
        pytest.param(lambda: bandage_scenes.scene(), marks=pytest.mark.slow),
        pytest.param(lambda: chain_scenes.drawworks(4), marks=pytest.mark.slow),
    ],
    ids=["elastic band, break-away", "staged", "bandage", "chain"],
)
def test_states_are_integrals_over_the_run(scene):
    scene = scene()
    inner = None if scene.brake.bandage is None else 3e-14
    result = sb.simulate(ws.wearing(scene, sb.Wear(1e-14, internal=inner)))
    worn = result.record.y_end.worn
    all_near(worn[0], sb.results.lining_wear(result, 1e-14), 1e-9)
    assert np.min(worn[0]) > 0
    if inner is not None:
        all_near(
            worn[1],
            sb.results.lining_wear(result, inner, pair="internal"),
            1e-9,
        )
        all_near(result.worn_thickness, worn[0] + worn[1], 1e-15)
        last = result.series([float(result.record.t_end)])
        all_near(
            np.asarray(last.pairs["internal"].worn_thickness)[0],
            worn[1],
            1e-9,
        )


@pytest.mark.slow
def test_turned_band_wears_from_other_end():
    lever = sb.PiecewiseLinear(
        [0.0, 3.0, 3.0, 5.0, 5.0], [ws.T0, ws.T0, 0.0, 0.0, ws.T0]
    )
    drive = sb.TorqueLoad(
        sb.PiecewiseLinear([3.0, 3.0, 5.0, 5.0], [0.0, 7000.0, 7000.0, 0.0])
    )

    def worn(turned_at):
        scene = ws.stop(sb.Wear(ws.K, turned_at=turned_at), end=9.0)
        scene = sb.Scene(
            scene.brake, sb.Duty(lever, drive), scene.initial, 9.0, wear=scene.wear
        )
        result = sb.simulate(scene)
        assert names_of(result).count("stop") == 2
        return np.asarray(result.series([2.9, 9.0]).worn_thickness)

    first, both = worn([20.0, 30.0])  # after the end: never
    all_near(worn([3.5, 30.0])[1], first + (both - first)[::-1], 1e-12)
    all_near(worn([3.5, 4.0])[1], both, 1e-12)
