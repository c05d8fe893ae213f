"""Friction power as heat, electrical and mechanical work: what heats, what is booked,
and that it costs nothing."""

import dataclasses

import pytest
from helpers import near
from scenes import stop_scene

import simbrake as sb

SHARES = sb.PowerShares(electrical=0.05, mechanical=0.27)


def heated(shares=None):
    """A stop whose rim takes all heat and loses none, with friction that does not look
    at it."""
    rim = sb.thermal.Lump("rim", capacity=2e4, temperature=300.0)
    heat = sb.Heat(
        (rim,),
        (),
        sb.thermal.FrictionHeat("rim", None, 1.0),
        rim="rim",
    )
    return dataclasses.replace(stop_scene(), heat=heat, power_shares=shares)


@pytest.fixture(scope="module")
def runs():
    return sb.simulate(heated()), sb.simulate(heated(SHARES))


@pytest.mark.slow
def test_heat_warms_and_the_rest_is_booked(runs):
    plain, split = (
        {name: float(value) for name, value in run.energy.items()} for run in runs
    )
    work = plain["friction_heat"]
    near(split["friction_heat"], 0.68 * work, 1e-9)
    near(split["electrical_work"], 0.05 * work, 1e-9)
    near(split["mechanical_work"], 0.27 * work, 1e-9)
    near(split["heat_stored"], 0.68 * plain["heat_stored"], 1e-9)
    assert max(split["closure"], split["heat_closure"]) < 1e-9
    assert "electrical_work" not in plain
    assert "electrical" not in str(runs[0])
    rises = [float(run.series([5.0]).temperature[0, 0]) - 300.0 for run in runs]
    near(rises[1], 0.68 * work / 2e4, 1e-9)
    near(rises[0], work / 2e4, 1e-9)
    # torque and times do not know of it
    near(runs[1].stopping_time, runs[0].stopping_time, 1e-10)


@pytest.mark.slow
def test_flash_temperature_sees_heat_alone():
    """Half of the power as heat is a flash of half the share."""
    flash = sb.thermal.FlashTemperature(50e-6, 48.0, 1.2e-5, 1.0, 300e6)
    law = sb.friction.ProductFriction(0.35, (sb.LinearFade(3e-4, 293.15),))

    def torque(flash, shares):
        start = dataclasses.replace(
            stop_scene(C=None, law=law, end=1e-3),
            heat=heated().heat,
            power_shares=shares,
        )
        scene = dataclasses.replace(
            start, heat=dataclasses.replace(start.heat, flash=flash)
        )
        return float(sb.simulate(scene).series([0.0]).brake_torque[0])

    half = torque(flash, sb.PowerShares(mechanical=0.5))
    near(half, torque(dataclasses.replace(flash, share=0.5), None), 1e-12)
    assert half > 1.001 * torque(flash, None)
