"""Materials by energy level: exchanged in a scene, estimated by hand, simulated by one
program, shown."""

import dataclasses
import math

import jax
import numpy as np
import pytest
from helpers import all_near, near
from material_scenes import ROOM, W0, J, compared, whole_scene
from scenes import stop_scene
from scipy.special import erfc

import simbrake as sb

# --- exchanged in a scene -----------------------------------------------------------


def test_new_material_equals_a_scene_with_it():
    brass = sb.material("brass")
    other = sb.material("retinax")
    found = sb.with_materials(whole_scene(), brass, other)
    built = whole_scene(rim="brass", lining="retinax").heat
    assert jax.tree.structure(found.heat) == jax.tree.structure(built)
    for a, b in zip(jax.tree.leaves(found.heat), jax.tree.leaves(built), strict=True):
        all_near(a, b, 1e-14)


def test_shares_follow_if_of_materials():
    brass = sb.material("brass")
    other = sb.material("retinax")
    given = sb.with_materials(
        whole_scene(sb.thermal.ConstantPartition(0.9)), brass, other
    ).heat.friction.partition
    assert float(given.metal) == 0.9
    flat = np.full(2, 10.0)
    law = sb.thermal.TransmissionPartition(
        np.array([300.0, 400.0]), flat, flat, flat, flat * 1e-6
    )
    changed = sb.with_materials(whole_scene(law), brass, other).heat.friction.partition
    assert (float(changed.rim_conductivity), float(changed.lining_conductivity)) == (
        109.0,
        0.6,
    )
    assert float(changed.surface_conductivity) == 1.02


# --- by hand ------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["steel_20L", "aluminium_alloy"])
def test_a_stop_by_hand(name):
    """Constant torque, no load: W = ½ J ω², and a half-space while no heat reaches the
    back."""
    scene = stop_scene(C=None)
    table = compared([name], scene=scene)
    row = table.row(name)
    m = sb.formulas.rim_material(name)
    k, rho, c = (m.numbers[key] for key in ("conductivity", "density", "specific_heat"))
    lining = sb.material("FK-24A")
    e_1 = math.sqrt(k * rho * c)
    e_2 = math.sqrt(0.736 * 2000.0 * 1000.0)
    work = 0.5 * J * W0**2
    tau = sb.formulas.classical_stop(scene).time
    share = e_1 / (e_1 + e_2)
    q = share * work / (1.05 * tau)
    a = k / (rho * c)
    assert a * tau / 0.05**2 < 0.06  # else this is no half-space
    depth = 1.73 * math.sqrt(a * tau)
    peak = 2 / 3 * 2 * (2 * q) * math.sqrt(tau / 2 / math.pi) / e_1
    at_end = 2 * q * math.sqrt(tau / math.pi) / e_1
    mean = q * tau / (0.05 * rho * c)
    v = W0 * float(scene.brake.pulley.radius)
    flash = 2 * share * 0.35 * 300e6 * v / k * math.sqrt(a * 50e-6 / (math.pi * v))
    half = float(np.asarray(scene.brake.linings.angle)[0]) / 2
    truth = {
        "friction_work": work,
        "duration": tau,
        "share": share,
        "effusivity_share": share,
        "bulk": ROOM + 2 / 3 * share * work / (c * rho * 1.05 * depth),
        "bulk_end": ROOM + mean,
        "surface": ROOM + peak,
        "maximum": ROOM + peak + flash / 3,
        "stress": -m.elastic.young
        * m.elastic.expansion
        / (1 - m.elastic.poisson)
        * (at_end - mean),
        "wear": 3e-14 * work * math.cos(half) / (0.35 * 0.75),
        "mass": rho * 0.05 * 1.05,
    }
    truth["stress_ratio"] = -truth["stress"] / m.elastic.permissible
    radius = float(scene.brake.pulley.radius)
    truth["inertia"] = truth["mass"] * (radius**2 + (radius - 0.05) ** 2) / 2
    # what the back gives to the face
    image = math.exp(-(0.05**2) / (a * tau)) + erfc(0.05 / math.sqrt(a * tau))
    for key, value in truth.items():
        scale = value - (
            ROOM if key in ("bulk", "bulk_end", "surface", "maximum") else 0.0
        )
        assert abs(row[key].value - value) <= (1e-12 + 2 * image) * abs(scale), key
    assert float(lining.conductivity) == 0.736


def test_maximum_work_in_closed_form():
    """Surface of a half-space: rise ∝ q √τ ∝ W^(3/4) at given torques; at that work a
    pair is just admissible."""
    stiffless = sb.formulas.rim_material(
        "steel_20L", young=1.0, permissible_temperature=ROOM + 30.0
    )
    row = compared([stiffless]).row("steel_20L")
    rise = row["surface"].value - ROOM
    near(
        row.greatest_work, row["friction_work"].value * (30.0 / rise) ** (4 / 3), 1e-10
    )
    assert row.ends == "rim temperature"
    stressed = compared(["steel_20L"]).row("steel_20L")
    assert stressed.ends == "thermal stress"
    works = [f * stressed.greatest_work for f in (1 - 1e-6, 1.0, 1 + 1e-6)]
    table = compared(["steel_20L"], energy=works)
    found = [table.row("steel_20L", level=i) for i in range(3)]
    near([row["friction_work"].value for row in found], works, 1e-11)
    near(found[1]["stress_ratio"].value, 1.0, 1e-9)
    assert [row.admissible for row in (found[0], found[2])] == [True, False]
    for row in found:
        near(row.greatest_work, stressed.greatest_work, 1e-9)


def test_rim_too_hot_at_start_leaves_nothing():
    row = compared(
        [sb.formulas.rim_material("brass", permissible_temperature=290.0)]
    ).row("brass")
    assert (row.greatest_work, row.ends) == (0.0, "rim temperature")
    assert not row.admissible


def test_ranking_has_admissible_pairs_first():
    weak = dataclasses.replace(
        sb.formulas.rim_material("steel_20L", permissible_stress=1e6), name="weak"
    )
    strong = dataclasses.replace(
        sb.formulas.rim_material("steel_20L", permissible_stress=1e9), name="strong"
    )
    table = compared([weak, strong])
    assert [row.rim for row in table.ranking()] == ["strong", "weak"]
    assert [row.admissible for row in table.ranking()] == [True, False]
