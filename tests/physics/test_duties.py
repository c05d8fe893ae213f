"""Strings taken in motion, the cyclic steady state, and ready networks of brakes."""

import math
import time

import equinox as eqx
import jax
import numpy as np
import pytest
from heat_scenes import BETA, W0, J, N, fading, rigid_stop
from helpers import all_near, near
from scenes import lining_ratio

import simbrake as sb

# --- duties --------------------------------------------------------------------------


def test_cyclic_state_is_where_cycling_ends():
    heat = sb.lumped_heat(
        rim=1e4,
        linings=5e3,
        band=4e3,
        partition=sb.thermal.ConstantPartition(0.8),
        rim_cooling=60.0,
        lining_to_band=40.0,
        band_cooling=30.0,
    )
    scene = rigid_stop(fading(slope=1e-3, floor=0.4), heat, 60.0)
    found = sb.cyclic_steady_state(scene)
    assert found.change < 1e-7
    T = np.full(3, sb.thermal.ROOM)
    for _ in range(100):
        run = sb.simulate(
            eqx.tree_at(lambda s: s.heat, scene, sb.results.with_temperatures(heat, T))
        )
        T = np.asarray(run.end_temperatures)
    all_near(T, found.result.end_temperatures, atol=1e-6)
    assert found.cycles < 40
    # over a cycle all friction heat leaves: half the kinetic energy's worth at 60 s
    near(found.result.energy["heat_lost"], 0.5 * J * W0**2, 1e-7)


# --- ready networks -----------------------------------------------------------------


def installation(each=1, **more):
    area = 2 * math.pi * 0.59 * 0.22
    return sb.layered_heat(
        rim=sb.material("steel_20L"), rim_thickness=0.025, rim_layers=6, rim_first=1e-3, track_area=area,
        lining=sb.material("FK-24A"), lining_area=0.75 * area, lining_layers=5, lining_first=1e-4, each=each,
        partition=0.9, **more,
    )  # fmt: skip


@pytest.mark.slow
def test_linings_heat_by_their_own_friction():
    """Insulated walls, one per lining: stored heat in proportion to the tension
    increments, whatever the depth."""
    scene = rigid_stop(sb.ConstantFriction(0.35), installation(each=N))
    result = sb.simulate(scene)
    wall = next(body for body in scene.heat.bodies if body.name == "lining")
    steel = sb.material("band_steel")
    heat = installation(band=steel, band_thickness=0.004)
    strip = next(body for body in heat.bodies if body.name == "band")
    all_linings = N * wall.area
    near(
        strip.capacity, steel.density * steel.specific_heat * 0.004 * all_linings, 1e-13
    )
    capacity = float(
        wall.material.density * wall.material.specific_heat * wall.area
    ) * np.asarray(wall.steps)
    rise = np.asarray(result.end_temperatures)[6:].reshape(N, 5) - sb.thermal.ROOM
    linings = rise @ capacity
    tensions = lining_ratio(0.35, BETA) ** np.arange(N + 1)
    all_near(linings / linings.sum(), np.diff(tensions) / (tensions[-1] - 1), 1e-9)
    near(linings.sum(), 0.1 * 0.5 * J * W0**2, 1e-9)
    assert int(result.peak_lining_temperature.lining) == N
    assert result.nodes[6] == "lining[1,1]"


def test_radiation_governs_when_hot():
    T = sb.thermal.radiation_governs_above(25.0, 0.8)
    near(
        0.8 * sb.thermal.STEFAN_BOLTZMANN * (T**4 - sb.thermal.ROOM**4),
        25.0 * (T - sb.thermal.ROOM),
        1e-10,
    )


@pytest.mark.slow
def test_cost_grows_no_faster_than_layers():
    def cost(layers):
        growth = sb.thermal.layer_growth(1e-6, 0.03, layers)
        steel = sb.material("steel_20L")
        heat = sb.Heat(
            (
                sb.thermal.Wall("w", steel, 0.03, 1.0, layers, growth),
                sb.thermal.Reservoir("air"),
            ),
            (sb.thermal.Convection("w.back", 1.0, 100.0),),
            sources=(sb.thermal.Source("w.front", sb.ramp(1e6, 0.0, 0.0, 5.0)),),
        )
        times = []
        for _ in range(6):
            start = time.process_time()
            jax.block_until_ready(
                sb.simulate_heat(
                    heat, [0.0, 5.0], rtol=1e-8, solver=sb.hybrid.Rodas5P()
                ).temperature
            )
            times.append(time.process_time() - start)
        return sorted(times[1:])[2]

    assert cost(1000) / cost(10) < 100**1.2
    assert cost(1000) / cost(100) < 10**1.2 * 1.5  # the timing itself is uncertain
