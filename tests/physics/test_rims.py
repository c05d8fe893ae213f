"""Several alike rims: stops, levers and heat in closed form and against SciPy, one band
of twice the force, input."""

import dataclasses
import math

import numpy as np
import pytest
import test_every_mechanism as every
from helpers import all_near, closes, names_of, near
from scenes import lining_ratio, replaced

import simbrake as sb

R = 0.59
R_B = 0.623
J = 1200.0
W0 = 20.0
T0 = 4e3
LOAD = 3e3
N = 6
F = 0.35
BETA = math.radians(40.0)
AREA = 0.04
WIDTH = 0.12
LININGS = sb.Lining(F, np.full(N, BETA), AREA)


def brake(rims=2, linings=LININGS, **parts):
    return sb.Brake(sb.Pulley(R, J, WIDTH), sb.Band(R_B), linings, rims=rims, **parts)


def scene(rims=2, *, lever=T0, load=LOAD, end=9.0, omega=W0, linings=LININGS, **parts):
    lever = (
        sb.PiecewiseLinear([0.0, 9.0], [lever, lever])
        if isinstance(lever, float)
        else lever
    )
    return sb.Scene(
        brake(rims, linings), sb.Duty(lever, load), sb.Initial(omega), end, **parts
    )


def mu(f):
    return lining_ratio(f, BETA)


@pytest.fixture(scope="module")
def stopped():
    return sb.simulate(scene())


@pytest.mark.smoke
def test_torques_are_those_of_all_rims_and_forces_those_of_one(stopped):
    torque = 2 * R_B * T0 * (mu(F) ** N - 1)
    along = T0 * mu(F) ** np.arange(N + 1)
    time = J * W0 / (torque - LOAD)
    near(stopped.stopping_time, time, 1e-12)
    s = stopped.series([0.5 * time, 8.0])
    all_near(s.tension[0], along[1:], 1e-13)
    normal = (along[1:] + along[:-1]) * math.sin(BETA / 2)
    all_near(s.normal_load[0], normal, 1e-13)
    all_near(s.pressure[0], normal / AREA, 1e-13)
    all_near(s.brake_torque, [torque, LOAD], 1e-13)
    # at rest each band bears half of the load
    near(float(s.tight_tension[1]) - T0, LOAD / 2 / R_B, 1e-12)
    near(stopped.metrics["max_tension"], along[-1], 1e-13)
    near(stopped.metrics["min_holding_reserve"], torque / LOAD, 1e-12)
    work = torque * W0 * time / 2
    near(stopped.energy["friction_heat"], work, 1e-11)
    closes(stopped, 1e-12)


# --- every mechanism ----------------------------------------------------------------


def doubled(scene):
    """One band, linings and bandage of twice the stiffness, mass, area and force."""
    old = scene.brake
    twice = lambda part, *names: dataclasses.replace(
        part, **{n: 2 * getattr(part, n) for n in names}
    )
    band = old.band
    linings = twice(old.linings, "area")
    bandage = old.bandage
    if band.stiffness is not None:
        band = twice(band, "stiffness")
    if band.segments is not None:
        band = dataclasses.replace(
            band, segments=twice(band.segments, "stiffness", "anchor_damping")
        )
        linings = twice(linings, "mass")
    if bandage is not None:
        bandage = twice(
            bandage,
            "inertia",
            "preload",
            "area",
            *(["spring"] if bandage.spring is not None else []),
        )
    brake = dataclasses.replace(old, band=band, linings=linings, bandage=bandage)
    return dataclasses.replace(
        scene,
        brake=brake,
        duty=sb.Duty(twice(scene.duty.lever, "values"), scene.duty.load),
    )


@pytest.mark.slow
@every.on(
    "rigid band",
    "elastic band",
    "staged, rigid band",
    "staged, elastic band",
    "chain",
    "bandage on springs",
)
def test_every_mechanism_of_two_rims_is_one_of_twice_the_force(kind):
    """Heat and wear too: the heat part has both rims together, pressures are equal.
    Bands break away with a jump."""
    single = every.scene(kind, hot=kind != "chain")
    law = sb.ConstantFriction(0.4, 1.15)
    if kind != "chain":
        law = sb.friction.ProductFriction(law, (sb.LinearFade(2e-4, ROOM),))
    single = replaced(single, {"brake.linings.friction": law})
    two = sb.simulate(replaced(single, {"brake.rims": 2}))
    one = sb.simulate(doubled(single))
    rel = 1e-8 if kind == "chain" else 1e-12  # 69 events: rounding grows
    assert names_of(two) == names_of(one)
    all_near(two.events.times, one.events.times, rel, 1e-12)
    for name, value in one.energy.items():
        near(two.energy[name], value, rel, 1e-9)
    closes(two, 1e-9)
    for name in ("stopping_time", "min_holding_reserve"):
        near(two.metrics[name], one.metrics[name], rel)
    near(two.end_capacity.torque, one.end_capacity.torque, rel)
    ts = np.linspace(0.0, 8.0, 17)
    s = two.series(ts)
    wanted = one.series(ts)
    all_near(s.brake_torque, wanted.brake_torque, 1e-6, 1e-3)
    all_near(2 * s.tension, wanted.tension, 1e-6, 1e-3)
    for mine, other in zip(s.pairs.values(), wanted.pairs.values(), strict=True):
        all_near(mine.torque, other.torque, 1e-6, 1e-3)
        all_near(mine.friction_work, other.friction_work, 1e-8, 1e-3)
    if two.scene.heated:
        assert float(two.energy["heat_closure"]) < 1e-12
        all_near(two.end_temperatures, one.end_temperatures, 1e-12)
        all_near(two.worn_thickness, one.worn_thickness, 1e-12)


# --- heat ---------------------------------------------------------------------------

ROOM = 293.15


# --- levers -------------------------------------------------------------------------


@pytest.mark.slow
def test_levers_pull_on_all_bands():
    arms = {"arm": 1.5, "slack_arm": 0.1, "efficiency": 0.9}
    hand = sb.PiecewiseLinear([0.0, 9.0], [600.0, 600.0])
    result = sb.simulate(scene(lever=sb.Lever(hand, **arms)))
    near(result.series([0.1]).slack_tension[0], 0.9 * 600.0 * 15 / 2, 1e-13)
    near(result.metrics["max_lever_force"], 600.0, 1e-13)
    torque = 2 * R_B * 0.9 * 600.0 * 15 / 2 * (mu(F) ** N - 1)
    near(result.stopping_time, J * W0 / (torque - LOAD), 1e-12)
    held = sb.simulate(scene(lever=sb.SpeedHold(T0), end=2.0))
    near(
        held.series([1.0]).slack_tension[0], LOAD / (2 * R_B * (mu(F) ** N - 1)), 1e-12
    )
    near(held.energy["friction_heat"], LOAD * W0 * 2.0, 1e-10)
