"""Figures of runs by their words and axes: titles, labels, legends, marks, and the
parts of a run that are drawn."""

import dataclasses
import functools
import math

import numpy as np
import pytest
from picture_scenes import plain_result
from stop_scenes import stop_scene

import simbrake as sb
from simbrake import plot


@functools.cache
def twice_result():
    """Two stops from 5 s on, the first the harder one, with a rim in layers: no lining
    has a temperature."""
    steel = sb.material("steel_20L")
    rim = {
        "rim": steel,
        "rim_thickness": 0.02,
        "track_area": 0.8,
        "rim_layers": 8,
        "rim_first": 2e-4,
    }
    heat = sb.layered_heat(**rim, partition=0.9, permissible=350.0)
    load = sb.TorqueLoad(sb.PiecewiseLinear([0.0, 99.0], [2e3, 2e3]))
    lever = sb.PiecewiseLinear([7.0, 7.0, 8.0, 8.0], [8e3, 0.0, 0.0, 8e3])
    scene = stop_scene(n=4, beta=60.0, C=None, lever=lever, load=load, end=12.0)
    return sb.simulate(
        dataclasses.replace(scene, initial=sb.Initial(20.0, time=5.0), heat=heat)
    )


@functools.cache
def disc_result():
    return sb.simulate(sb.read_scene(sb.files.shipped("disc")))


@functools.cache
def shoe_result(omega=25.0):
    force = sb.PiecewiseLinear([0.0, 0.25, 9.0], [0.0, 2e3, 2e3])
    shoes = sb.Shoes(sb.ConstantFriction(0.32), 0.150, 0.032, 0.15, math.radians(126.0))
    brake = sb.ShoeBrake(12.0, shoes, 0.1227, 0.212)
    return sb.simulate(
        sb.Scene(brake, sb.ForceDuty(force, sb.TorqueLoad(0.0)), sb.Initial(omega), 4.0)
    )


def test_stop_of_pads_and_of_shoes():
    """Pads are pressed alike: one curve, that of the actuator; each shoe has its
    own."""
    figure = plot.stop(disc_result())
    force = figure.axes[2]
    for line in force.lines[:2]:
        np.testing.assert_allclose(
            line.get_ydata(), np.minimum(180.0 * line.get_xdata(), 45.0), atol=1e-9
        )
    run = shoe_result()
    panels = plot.stop(run).axes
    _, _, force, _ = panels[:: len(panels) // 4]
    for i in (0, 1):
        t, drawn = force.lines[1 + i].get_data()
        late = (t > 0.3) & np.all(
            np.abs(np.subtract.outer(t, [e.time for e in run.events])) > 1e-9, axis=1
        )
        np.testing.assert_allclose(
            1e3 * drawn[late], np.asarray(run.series(t).normal_load)[late, i], rtol=1e-9
        )


def test_stops_with_and_without_heat():
    """Rigid band: `J ω̇ = M_load − M_b`, and the heat of a stop is what its speed and
    the load give."""
    figure = plot.stops(twice_result())
    time, heat, hot = figure.axes
    factor = (
        (1 + 0.35 * math.tan(math.pi / 6)) / (1 - 0.35 * math.tan(math.pi / 6))
    ) ** 4
    slowing = (0.725 * 8e3 * (factor - 1) - 2e3) / 800.0
    spun = 2e3 / 800.0  # in one second without the brake
    seconds = np.array([20.0, spun]) / slowing
    worked = (
        0.5 * 800.0 * np.array([20.0, spun]) ** 2
        + 2e3 * 0.5 * np.array([20.0, spun]) * seconds
    )
    np.testing.assert_allclose(
        time.lines[0].get_xydata(), [[1, seconds[0]], [2, seconds[1]]], rtol=1e-8
    )
    np.testing.assert_allclose(
        heat.lines[0].get_xydata(),
        [[1, worked[0] / 1e3], [2, worked[1] / 1e3]],
        rtol=1e-8,
    )
    first = (
        float(
            np.max(twice_result().series(np.linspace(5.0, 8.0, 3001)).rim_temperature)
        )
        - 273.15
    )
    assert hot.lines[0].get_ydata()[0] == pytest.approx(first, abs=0.01)
    with pytest.raises(sb.InputError, match="has no stop"):
        plot.stops(sb.simulate(stop_scene(T0=0.0, C=None)))


@functools.cache
def cycles_result():
    """Nine stops, each from 2.5 rad/s as the load spins up in one second."""
    lever = sb.Repeated([0.0, 1.0, 1.0, 2.0], [8e3, 8e3, 0.0, 0.0], 2.0, 9)
    steel = sb.material("steel_20L")
    heat = sb.layered_heat(
        rim=steel, rim_thickness=0.02, track_area=0.8, rim_layers=4, partition=0.9
    )
    scene = stop_scene(n=4, beta=60.0, C=None, w0=2.5, lever=lever, load=2e3, end=18.0)
    return sb.simulate(dataclasses.replace(scene, heat=heat))


def test_hook_beside_pulley_and_slip_only_where_it_takes_time():
    """Of a rigid rope both speeds lie on each other; a rigid band slips at once, an
    elastic one from its onset on."""
    lever = sb.PiecewiseLinear([0.0, 1.0, 1.0, 9.0], [0.0, 0.0, 8e3, 8e3])
    rigid = stop_scene(
        n=4, beta=60.0, C=None, lever=lever, load=sb.HookLoad(2e3, 0.4, 8)
    )
    run = sb.simulate(rigid)
    figure = plot.stop(run)
    speed = figure.axes[0]
    hook = figure.axes[4]
    t, v = hook.lines[0].get_data()
    np.testing.assert_allclose(v, run.series(t).hook_speed, atol=1e-9)
    np.testing.assert_allclose(np.divide(hook.get_ylim(), speed.get_ylim()), 0.4 / 8)
    soft = dataclasses.replace(rigid.brake, band=sb.Band(rigid.brake.band.radius, 1e5))
    run = sb.simulate(dataclasses.replace(rigid, brake=soft))
    near = plot.stop(run).axes[1].get_xlim()
    onset = run.metrics["slip_onset_time"]
    slip = run.metrics["full_slip_time"]
    assert 1.0 <= onset < slip
    np.testing.assert_allclose(
        near, [onset - 0.3 * (slip - onset), slip + 0.3 * (slip - onset)], rtol=1e-9
    )


def test_many_cycles_are_an_envelope():
    """Of nine short stops the maximum of each; the hottest one has its curve beside
    them."""
    run = cycles_result()
    whole, _, near, *_ = plot.temperatures(run).axes
    high, low = (line.get_xydata() for line in whole.lines[:2])
    assert len(high) == len(low) == 9
    for t, T in high:
        around = np.linspace(max(0.0, t - 0.5), min(18.0, t + 0.5), 2001)
        assert (
            pytest.approx(np.max(run.series(around).rim_temperature) - 273.15, abs=0.1)
            == T
        )
    assert len(near.lines[0].get_xdata()) > 100


def test_temperatures_without_a_band():
    """Of lumps alone there is nothing through the depth."""
    parts = (
        sb.thermal.Lump("drum", 4e3, 293.15),
        sb.thermal.Lump("shoes", 60.0, 293.15, count=2),
        sb.thermal.Reservoir("air", 293.15),
    )
    rubbing = sb.thermal.FrictionHeat(
        "drum", "shoes", sb.thermal.ConstantPartition(0.8)
    )
    heat = sb.Heat(
        parts,
        (sb.thermal.Conductance("shoes", "air", 1.0),),
        rubbing,
        rim="drum",
        linings="shoes",
    )
    run = sb.simulate(dataclasses.replace(shoe_result().scene, heat=heat))
    figure = plot.temperatures(run)
    assert len(figure.axes) == 2
    # the cooling drum: half of the kinetic energy's heat at the end, less what the
    # shoes lost to the air
    drum = figure.axes[0].lines[0].get_ydata()
    assert drum[-1] == pytest.approx(20.0 + 0.8 * 0.5 * 12.0 * 25.0**2 / 4e3, rel=1e-6)
    for other in (run, plain_result()):
        with pytest.raises(sb.InputError):
            plot.depth(other)
