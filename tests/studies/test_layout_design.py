"""Integrals over a run for every lining, layouts that level what they give, and the
least tension under limits."""

import dataclasses
import math

import bandage_scenes
import chain_scenes
import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from goldens import assert_refused
from helpers import all_equal, all_near, near
from scenes import lining_ratio, stop_run, stop_scene
from wear_scenes import AREA, BETA, T0, W0, F, J, N, R, statics, stop

import simbrake as sb


class HotWear(eqx.Module):
    """`I = I_0 (1 + s (T − 293.15))`: one structure with and without influence of the
    temperature."""

    rate: jax.Array
    slope: jax.Array

    def __call__(self, p, v, T):
        return self.rate * (1 + self.slope * (T - 293.15))


def rate(slope=0.0):
    return HotWear(jnp.asarray(2e-14), jnp.asarray(slope))


def heated_stop(fade=0.0, angle=None):
    """Rigid band, constant lever, no load; each lining a lump, whose temperature lowers
    its friction."""
    law = sb.friction.ProductFriction(F, (sb.LinearFade(fade, 293.15, 0.2, 0.05),))
    heat = sb.Heat(
        bodies=(
            sb.thermal.Lump("rim", 1e5),
            sb.thermal.Lump("linings", 400.0, count=N),
            sb.thermal.Reservoir("air"),
        ),
        links=(sb.thermal.Conductance("rim", "air", 5.0),),
        friction=sb.thermal.FrictionHeat("rim", "linings", 0.9),
        rim="rim",
        linings="linings",
    )
    return stop(None, heat, angle, law=law, area=np.full(N, AREA))


# --- integrals ----------------------------------------------------------------------


@pytest.mark.slow
def test_work_wear_and_means_in_closed_form():
    result = sb.simulate(heated_stop())
    T, normal = statics()
    energy = J * W0**2 / 2
    work = np.asarray(sb.results.friction_work(result))
    all_near(work, energy * np.diff(T) / (T[-1] - 1), 1e-10)
    near(work.sum(), result.energy["friction_heat"], 1e-12)
    distance = energy / (T0 * (T[-1] - 1))
    all_near(
        sb.results.lining_wear(result, rate()),
        2e-14 * T0 * normal / AREA * distance,
        1e-10,
    )
    increment = np.asarray(sb.results.lining_mean(result, "tension_increment"))
    all_near(increment, T0 * np.diff(T), 1e-12)
    peaks = np.asarray(sb.results.lining_peak(result, "normal_load"))
    near(peaks.max(), result.metrics["max_normal_load"], 1e-12)


@pytest.mark.slow
def test_work_matches_ledger_at_any_points():
    result = sb.simulate(heated_stop(fade=1e-3))
    work = np.asarray(sb.results.friction_work(result, points=4))
    near(work.sum(), result.energy["friction_heat"], 1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    "scene",
    [
        lambda: bandage_scenes.scene(),
        lambda: chain_scenes.drawworks(4),
    ],
    ids=["bandage", "chain"],
)
def test_lining_work_is_the_heat_in_ledger(scene):
    result = sb.simulate(scene())
    ledger = result.record.y_end.ledger
    near(sb.results.friction_work(result).sum(), ledger.friction[0], 1e-9)
    if len(ledger.friction) > 1:
        inner = sb.results.friction_work(result, pair="internal")
        near(inner.sum(), ledger.friction[1], 1e-9)


def test_break_away_heat_is_of_no_lining():
    n = 6
    C = 2e5
    result = stop_run(n=n, beta=40.0, C=C, law=sb.ConstantFriction(0.25, 1.2))
    before, after = (
        8e3 * lining_ratio(f, math.radians(40.0)) ** n for f in (1.2 * 0.25, 0.25)
    )
    jump = (before - after) / C * (0.5 * (before + after) - 8e3)
    lost = float(result.energy["friction_heat"]) - float(
        sb.results.friction_work(result).sum()
    )
    near(lost, jump, 1e-8)


@pytest.mark.slow
def test_gradients_of_wear_match_differences():
    paths = {
        "duty.slack_tension.level": T0,
        "initial.omega": W0,
        "brake.linings.friction.factors[0].slope": 1e-3,
        "brake.linings.angle[1]": BETA,
        "brake.linings.area[3]": AREA,
    }
    shares = jnp.asarray([0.7, -0.2, 0.4, 1.3])

    def worn(scene):
        result = sb.simulate(scene, solver=diffrax.Dopri8(), rtol=1e-12, max_steps=64)
        return 1e6 * shares @ sb.results.lining_wear(result, rate(2e-3))

    scene = heated_stop(fade=1e-3)
    gradient = jax.jit(jax.grad(worn))(jax.tree.map(jnp.asarray, scene))
    slopes = {leaf.path: np.asarray(leaf.value) for leaf in sb.files.leaves(gradient)}
    for path, value in paths.items():
        base, _, index = (
            path.removesuffix("]").rpartition("[")
            if path.endswith("]")
            else (path, "", "")
        )
        got = slopes[base][int(index)] if index else slopes[base]

        def at(x, path=path):
            result = sb.simulate(
                sb.with_values(scene, {path: x}), solver=diffrax.Dopri8(), rtol=1e-12
            )
            return 1e6 * float(shares @ sb.results.lining_wear(result, rate(2e-3)))

        h = 1e-3 * value
        close = (at(value + h) - at(value - h)) / (2 * h)
        far = (at(value + 2 * h) - at(value - 2 * h)) / (4 * h)
        assert float(got) == pytest.approx((4 * close - far) / 3, rel=1e-7), path


# --- layouts ------------------------------------------------------------------------


@pytest.mark.parametrize("target", ["tension_increment", "normal_load", "pressure"])
def test_static_layouts_are_the_closed_forms(target):
    area = np.array([0.03, 0.03, 0.025, 0.03, 0.028])
    f = np.array([0.3, 0.28, 0.33, 0.3, 0.25])
    scene = stop_scene(n=5, beta=44.0, C=None, law=sb.ConstantFriction(f))
    scene = sb.with_values(scene, {"brake.linings.area": area})
    design = sb.equal_layout(scene, target, start="given")
    wrap = 5 * math.radians(44.0)
    if target == "tension_increment":
        layout = sb.layouts.equal_increment_angles(f, 5, 5, wrap)
    else:
        layout = sb.layouts.equal_load_angles(
            f, 5, wrap, area=area if target == "pressure" else 1.0
        )
    expected = layout.angle
    all_near(design.angle, expected, atol=1e-8)
    assert design.non_uniformity <= 1 + 1e-8
    near(design.angle.sum(), wrap, 1e-14)
    assert design.row("given").non_uniformity > 1.3
    T, normal = statics(expected, f)
    near(T[-1], layout.ratio, 1e-11)
    level = {
        "tension_increment": np.diff(T),
        "normal_load": normal,
        "pressure": normal / area,
    }[target]
    all_near(level, level[0], 1e-12)


def test_equal_pressure_areas_follow_loads():
    scene = sb.with_values(
        stop_scene(n=5, beta=44.0, C=None), {"brake.linings.area": 0.03}
    )
    design = sb.equal_layout(scene, "pressure", free="area", start="given")
    normal = statics(np.full(5, math.radians(44.0)), 0.35)[1]
    all_near(design.area, 0.15 * normal / normal.sum(), 1e-8)


@pytest.mark.slow
def test_angles_and_areas_over_a_braking():
    """Without fade the shares do not change in the run: the statics hold."""
    design = sb.equal_layout(
        heated_stop(),
        ("friction_work", "wear"),
        free="both",
        over="braking",
        rate=rate(),
        start="given",
    )
    angle = sb.layouts.equal_increment_angles(F, N, N, N * BETA).angle
    normal = statics(angle)[1]
    all_near(design.angle, angle, atol=1e-8)
    all_near(design.area, N * AREA * normal / normal.sum(), 1e-8)


@pytest.mark.slow
def test_fade_and_hot_wear_move_the_layout():
    cold = sb.equal_layout(
        heated_stop(), "wear", over="braking", rate=rate(), start="given"
    )
    static = sb.layouts.equal_load_angles(F, N, N * BETA).angle
    all_near(cold.angle, static, atol=1e-8)
    hot = sb.equal_layout(
        heated_stop(fade=1e-3), "wear", over="braking", rate=rate(2e-3)
    )
    assert hot.non_uniformity <= 1 + 1e-6
    assert hot.row("closed form").non_uniformity > 1.01
    assert np.abs(hot.angle - static).max() > math.radians(0.1)
    worn = np.asarray(sb.results.lining_wear(sb.simulate(hot.scene), rate(2e-3)))
    assert worn.max() / worn.min() <= 1 + 1e-6
    assert hot.as_dict()["layouts"][-1]["angle"] == hot.angle.tolist()


def test_what_cannot_be_levelled_says_why():
    scene = stop_scene(n=3, beta=110.0, f=0.3, C=None)
    with pytest.raises(sb.layouts.InfeasibleLayout, match="nearest to self-locking"):
        sb.equal_layout(scene, "normal_load", start="given")


@pytest.mark.parametrize("large", [2, 3])
def test_lining_that_cannot_carry_is_named(large):
    """At equal pressure a lining of fifty times the area needs fifty times the load,
    above the peak at `f^(−1/3)`."""
    area = np.where(np.arange(1, 5) == large, 50.0, 1.0)
    with pytest.raises(
        sb.layouts.InfeasibleLayout, match=f"lining {large} cannot carry the load"
    ):
        sb.layouts.equal_load_angles(0.3, 4, math.radians(200.0), area=area)


# --- least tension ------------------------------------------------------------------


@pytest.mark.slow
def test_least_tension_is_the_closed_form():
    """`T_max = T_0 Π`, `T_0 (Π − 1) = J ω_0/(R t)`: most friction, and most of the wrap
    on as few linings as may be."""
    n = 5
    longest = 4.0
    scene = stop_scene(n=n, f=0.2, C=None, J=J, R=R, end=6.0)
    angle = np.radians([50.0, 36.0, 44.0, 30.0, 40.0])
    scene = sb.with_values(scene, {"brake.linings.angle": angle})
    design = sb.least_tension(
        scene,
        longest,
        {
            "duty.slack_tension.level": (1e3, 4e4),
            "brake.linings.friction.coefficient": (0.1, 0.3),
            "brake.linings.angle": (math.radians(20.0), math.radians(60.0)),
        },
        limits={"max_normal_load": 1e6},
    )
    assert design.success, design.message
    best = statics(np.radians([60.0, 60.0, 40.0, 20.0, 20.0]), 0.3)[0][-1]
    need = J * 20.0 / (R * longest)
    near(design.value, need * best / (best - 1), 1e-8)
    time, load_limit = design.limits
    assert time.active
    near(time.value, longest, 1e-8)
    near(time.sensitivity, -need / longest * best / (best - 1), 1e-6)
    assert not load_limit.active
    assert load_limit.sensitivity == 0.0
    near(design.values["brake.linings.friction.coefficient"], 0.3, 1e-9)
    near(np.sum(np.asarray(design.scene.brake.linings.angle)), angle.sum(), 1e-12)
    assert design.stationarity < 1e-6
    again = sb.simulate(design.scene)
    near(again.metrics["max_tension"], design.value, 1e-9)


def test_all_search_errors_in_one_report(request):
    scene = dataclasses.replace(stop_scene(C=None), end_time=np.asarray(-1.0))
    free = {
        "brake.linings.angle[99]": (0.1, 0.2),
        "duty.slack_tension.level": (9e3, 2e4),
        "initial.omega": (3.0, 2.0),
        "brake.pulley.inertia": 5.0,
    }
    limits = {"peak_rim_temperature": 500.0, "min_holding_reserve": 1.25}
    options = {"free": "areas", "over": "day", "pair": "internal", "start": "best"}
    searches = (
        lambda: sb.least_tension(scene, -2.0, free, limits=limits),
        lambda: sb.equal_layout(stop_scene(), "wear", **options),
    )
    assert_refused(request, "searches", searches)


def test_a_turned_band_is_the_band_from_its_other_end():
    """Entries of linings and of the gaps between them."""
    plates = sb.brakes.LiningsOnPlates(2.1e11, 1.3e-3, 0.3, 0.5, gap=[0.05, 0.15])
    linings = sb.Lining([0.3, 0.42, 0.35], np.radians([28.0, 51.0, 36.0]), 0.03)
    brake = sb.Brake(sb.Pulley(0.59, 1200.0), sb.Band(0.623, plates), linings)
    wear = sb.Wear([3e-14, 6e-14, 9e-14], worn=[1e-3, 2e-3, 4e-3])
    scene = dataclasses.replace(stop_scene(), brake=brake, wear=wear)
    turned = sb.studies.turned_scene(scene)
    for read in (
        lambda x: x.brake.linings.friction.coefficient,
        lambda x: x.brake.linings.angle,
        lambda x: x.brake.band.stiffness.gap,
        lambda x: x.wear.worn,
        lambda x: x.wear.rate.coefficient,
    ):
        all_equal(read(turned), np.flip(read(scene)))
