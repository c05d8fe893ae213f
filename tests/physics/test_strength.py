"""Stresses of band and anchor, force and travel of the lever, and their allowable
values."""

import math

import jax.numpy as jnp
import numpy as np
import pytest
from helpers import near
from scenes import lining_ratio, replaced

import simbrake as sb

R = 0.6
J = 900.0
N = 8
BETA = math.radians(30.0)
F = 0.3
C = 4e5
FORCE = 500.0
ARM = 1.4
SLACK_ARM = 0.1
ETA = 0.9
T0 = ETA * FORCE * ARM / SLACK_ARM
RATIO = lining_ratio(F, BETA) ** N
AREA = 8e-4
ANCHOR = 5e-4
CLEARANCE = 1.5e-3
WORN = 4e-3


def scene(strength=None, force=FORCE, worn=WORN, **limits):
    lever = sb.Lever(
        sb.PiecewiseLinear([0.0, 0.2], jnp.stack([0.0 * force, 1.0 * force])),
        ARM,
        SLACK_ARM,
        ETA,
        CLEARANCE,
        **limits,
    )
    lining = sb.Lining(F, np.full(N, BETA), area=0.02)
    brake = sb.Brake(sb.Pulley(R, J), sb.Band(R, C, strength=strength), lining)
    duty = sb.Duty(lever, 0.0)
    return sb.Scene(brake, duty, sb.Initial(20.0), 3.0, wear=sb.Wear(1e-12, worn=worn))


STRENGTH = sb.brakes.Strength(AREA, "20 MPa", ANCHOR, "90 MPa")


@pytest.mark.slow
def test_stresses_force_and_travel():
    result = sb.simulate(scene(STRENGTH, greatest_force=450.0, greatest_travel=0.5))
    m = result.metrics
    near(m["max_band_stress"], T0 * RATIO / AREA, 1e-9)
    near(m["max_anchor_stress"], T0 * RATIO / ANCHOR, 1e-9)
    near(m["max_lever_force"], FORCE, 1e-9)
    assert result.summary()["at"]["max_band_stress_lining"] == N
    # stopped in full slip: the band keeps its stretch; wear of the run is Archard's
    lost = WORN + np.asarray(result.worn_thickness)
    travel = ARM / SLACK_ARM * (T0 * RATIO / C + np.sum(BETA * (lost + CLEARANCE)))
    near(m["lever_travel"], travel, 1e-9)
    # a lever that is eased behind the stop has travelled as far
    force = sb.PiecewiseLinear([0.0, 0.2, 2.0, 2.5], [0.0, FORCE, FORCE, 0.0])
    eased = sb.Duty(replaced(result.scene.duty.lever, {"force": force}), 0.0)
    eased = sb.simulate(replaced(result.scene, {"duty": eased}))
    assert eased.series([3.0]).elongation[0] < 1e-9
    near(eased.metrics["lever_travel"], travel, 1e-9)
    said = [
        text for text in result.summary()["warnings"] if text.startswith("over_limit")
    ]
    assert [text.split()[1:3] for text in said] == [
        ["band", "stress"],
        ["lever", "force"],
        ["lever", "travel"],
    ]
    within = sb.simulate(
        scene(sb.brakes.Strength(AREA, "80 MPa"), greatest_force="600 N")
    )
    assert not [
        text for text in within.summary()["warnings"] if text.startswith("over_limit")
    ]
    assert "max_anchor_stress" not in within.metrics
