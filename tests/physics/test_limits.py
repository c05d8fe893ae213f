"""Limits of a scene: marks of the log, verdict and scene files; a run does not depend
on them."""

import dataclasses

import heat_scenes as hs
import jax
import numpy as np
import pytest
from helpers import near
from scenes import drawworks_brake

import simbrake as sb

MASS = 60e3
DRUM = 0.4
LINES = 8
INERTIA = 1200.0


def falling(**limits):
    """A load that falls freely under an open brake until the lever acts at 0.5 s."""
    brake = drawworks_brake()
    duty = sb.Duty(
        sb.ramp(0.0, 40e3, 0.5, 1.0), sb.HookLoad(MASS, DRUM, LINES, gravity=9.81)
    )
    return sb.Scene(
        brake,
        duty,
        sb.Initial(10.0),
        12.0,
        limits=sb.Limits(**limits) if limits else None,
    )


def test_overspeed_of_free_fall():
    """`ω = ω_0 + M t/(J + m (R/z)²)` passes its limit on the way up, and is not told
    again on the way down."""
    arm = DRUM / LINES
    rate = MASS * 9.81 * arm / (INERTIA + MASS * arm**2)
    result = sb.simulate(falling(max_drum_speed=14.0))
    near(result.events["overspeed"].times, [4.0 / rate], 1e-12)
    assert result["max_drum_speed"] > 14.0
    (row,) = [row for row in result.verdict().rows if "speed" in row.name]
    assert row.state == "exceeded"
    turning = result.series([0.3]).omega
    near(turning, [10.0 + 0.3 * rate], 1e-12)


def test_limits_change_no_run():
    """The same bits with and without, and no event where the limit is not reached."""
    free, limited = (
        sb.simulate(one)
        for one in (falling(), falling(max_drum_speed=99.0, max_tension="1 MN"))
    )
    assert not limited.events["overspeed"]
    assert jax.tree.all(
        jax.tree.map(np.array_equal, free.record.rows, limited.record.rows)
    )


@pytest.mark.slow
def test_limits_of_temperatures():
    """A limit in the scene has the event that the permissible value of the heat part
    has, at the same time."""
    scene = hs.rigid_stop(hs.fading(), hs.lump())
    hottest = sb.simulate(scene)["peak_rim_temperature"]
    most = 0.5 * (hottest + 293.15)
    own = sb.with_values(scene, {"heat.permissible_rim": most})
    here = dataclasses.replace(scene, limits=sb.Limits(peak_rim_temperature=most))
    times = [
        sb.simulate(one).events["permissible_rim_temperature"].times
        for one in (own, here)
    ]
    assert times[0] == times[1]
    assert len(times[0]) == 1


def test_limit_of_an_energy():
    """In a scene file, in Python and by `--limit` it is one limit, with the same
    verdict and warning."""
    text = (
        sb.files.scene_text(falling()) + '\n[limits]\nenergy.friction_heat = "1 kJ"\n'
    )
    scene = sb.files.scene_from_text(text)
    assert (
        sb.files.scene_from_text(sb.files.scene_text(scene)).limits.given
        == scene.limits.given
    )
    own = sb.simulate(falling(energy={"friction_heat": "1 kJ"}))
    (row,) = [row for row in own.verdict().rows if row.name == "Energy: friction heat"]
    assert (row.limit, row.state) == ("≤ 1 kJ", "exceeded")
    assert sb.simulate(scene).summary()["warnings"] == own.summary()["warnings"]


@pytest.mark.slow
def test_drum_speed_derivative():
    """No torque depends on the speed: the whole course shifts with the initial speed,
    and so does its maximum."""

    def top(omega):
        return sb.simulate(
            sb.with_values(falling(), {"initial.omega": omega})
        ).max_drum_speed.value

    near(jax.grad(top)(10.0), 1.0, 1e-9)
