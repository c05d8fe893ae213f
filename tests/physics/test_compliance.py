"""Band compliance: elongation against quadrature, bands in parallel, the scene with
geometry, the lever."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import all_near, near
from scenes import closed_form, stop_run, stop_scene
from scipy.integrate import quad

import simbrake as sb

E1 = 2.1e11
A1 = 1.3e-3
E2 = 3e9
A2 = 6.6e-3
R0 = 0.623
R0_ = 0.605
L_C = 0.4
L_H = 0.9
BETA = math.radians(13.5)


BAND = {"modulus": E1, "area": A1, "slack_end": L_C, "tight_end": L_H}
LINING = {"lining_modulus": E2, "lining_area": A2, "lining_radius": R0_}
SLOTTED = {
    "modulus": E1,
    "slack_area": A1,
    "tight_area": 0.6 * A1,
    "split": 2.9,
    "lining_modulus": E2,
    "slack_lining_area": A2,
    "tight_lining_area": 0.4 * A2,
    "lining_radius": R0_,
    "slack_end": L_C,
    "tight_end": L_H,
}


def bonded(**change):
    return sb.brakes.BondedLinings(**{**BAND, **LINING, **change})


def plates(**change):
    return sb.brakes.LiningsOnPlates(**{**BAND, **change})


def slotted(**change):
    return sb.brakes.ContinuousLining(**{**SLOTTED, **change})


def elongation_by_quadrature(
    S_C, pieces, ends=((L_C, E1 * A1), (L_H, E1 * A1)), end_factor=1.0
):
    """`∫ S ds/k` along `pieces` of (friction, angle, stiffness per rad), and the ends
    (length, EA)."""
    S = S_C
    total = end_factor * S_C * ends[0][0] / ends[0][1]
    for f, angle, k in pieces:
        total += (
            quad(
                lambda θ, S=S, f=f: S * math.exp(f * θ),
                0.0,
                angle,
                epsabs=0,
                epsrel=1e-13,
            )[0]
            / k
        )
        S *= math.exp(f * angle)
    return total + end_factor * S * ends[1][0] / ends[1][1]


ANGLES = np.radians([20.0, 8.0, 15.0, 30.0])
GAPS = np.radians([2.0, 0.0, 3.5])
EACH = np.asarray([0.35, 0.1, 0.0, 0.5])
BARE = E1 * A1 / R0
BOND = E1 * A1 / R0 + E2 * A2 / R0_


def laid(f, angles, gaps, k):
    """Arcs with their friction and bare gaps without, alternating."""
    pieces = [(f[0], angles[0], k)]
    for i, gap in enumerate(gaps):
        pieces += [(0.0, gap, BARE), (f[i + 1], angles[i + 1], k)]
    return pieces


@pytest.mark.parametrize("halved", [False, True])
@pytest.mark.parametrize(("make", "k"), [(bonded, BOND), (plates, BARE)])
def test_separate_linings_match_quadrature(make, k, halved):
    equal = (
        np.full(20, 0.35),
        np.full(20, math.radians(12.0)),
        np.full(19, math.radians(1.5)),
    )
    for f, angles, gaps in (equal, (EACH, ANGLES, GAPS), (0 * EACH, ANGLES, GAPS)):
        got = make(gap=gaps, halved_ends=halved).elongation(5e3, f, angles, R0)
        truth = elongation_by_quadrature(
            5e3, laid(f, angles, gaps, k), end_factor=0.5 if halved else 1.0
        )
        near(got, truth, 1e-13)
    one = make(gap=equal[2]).compliance(0.35, equal[1], R0)
    near(
        one,
        make(gap=math.radians(1.5)).compliance(equal[0], equal[1], R0),
        1e-14,
    )


@pytest.mark.parametrize("split", [0.0, 2.9, math.radians(400.0)])
def test_more_than_a_turn_matches_quadrature(split):
    wrap = math.radians(400.0)
    f = 0.2
    tongue = BOND
    slot = 0.6 * E1 * A1 / R0 + E2 * 0.4 * A2 / R0_
    pieces = [(f, split, tongue), (f, wrap - split, slot)]
    ends = ((L_C, E1 * A1), (L_H, 0.6 * E1 * A1))
    angle = np.full(50, wrap / 50)
    got = slotted(split=split).elongation(5e3, f, angle, R0)
    near(got, elongation_by_quadrature(5e3, pieces, ends), 1e-13)
    near(sb.brakes.tension_rise(f, angle), math.exp(f * wrap), 1e-13)


@pytest.mark.parametrize("make", [bonded, plates, slotted])
def test_elongation_is_exact_at_no_friction(make):
    """`Δl/S_C` at f = 0 and its derivative, against those of the integrand
    `∫ e^{fθ} dθ`."""
    angle = np.full(20, BETA)

    def compliance(f):
        return make().stretch(f, angle, R0)

    value, slope = jax.value_and_grad(compliance)(0.0)
    wrap = 20 * BETA
    if make is slotted:
        split = 2.9
        slot = 0.6 * E1 * A1 / R0 + E2 * 0.4 * A2 / R0_
        rest = wrap**2 - split**2
        truth = split / BOND + (wrap - split) / slot + (L_C + L_H / 0.6) / (E1 * A1)
        rise = split**2 / 2 / BOND + rest / 2 / slot + wrap * L_H / 0.6 / (E1 * A1)
    else:
        k = BOND if make is bonded else BARE
        truth = wrap / k + (L_C + L_H) / (E1 * A1)
        rise = wrap**2 / 2 / k + wrap * L_H / (E1 * A1)
    near(value, truth, 1e-13)
    near(slope, rise, 1e-12)
    # no seam where the series hands over to the closed form, f α = 0.02
    close = [
        float(jax.jit(jax.grad(compliance))(0.02 / BETA * s))
        for s in (1 - 1e-9, 1 + 1e-9)
    ]
    near(close[0], close[1], 1e-8)


def test_anchor_and_linkage_are_in_series():
    angle = np.full(20, BETA)
    alone, soft = (
        float(bonded(linkage=c).stiffness(0.35, angle, R0)) for c in (None, 1e5)
    )
    near(1 / soft, 1 / alone + 1 / 1e5, 1e-14)
    rise = math.exp(0.35 * 20 * BETA)
    near(alone, 5e3 * rise / float(bonded().elongation(5e3, 0.35, angle, R0)), 1e-13)


def test_parallel_bands_stretch_alike():
    c = np.asarray([2e-8, 5e-8, 3e-8])
    split = np.asarray(sb.brakes.lever_split(c, 1e4))
    near(split.sum(), 1e4, 1e-15)
    all_near(split * c, split[0] * c[0], 1e-15)
    # geometries and numbers, with linings of their own friction
    angle = np.full(4, 0.6)
    bands = sb.brakes.ParallelBands((bonded(), plates(tight_end=2.0), 4e8))
    shares = bands.shares(EACH, angle, R0)
    each = np.asarray([band.stiffness(EACH, angle, R0) for band in bands.bands])
    all_near(shares, each / each.sum(), 1e-14)
    stretched = [
        float(b.elongation(8e3 * s, EACH, angle, R0))
        for b, s in zip(bands.bands, shares, strict=True)
    ]
    all_near(stretched, stretched[0], 1e-14)
    near(bands.elongation(8e3, EACH, angle, R0), stretched[0], 1e-14)


def soft_scene(modulus=5e8, **rest):
    """A band of little modulus, so that its stretch governs the stop."""
    return stop_scene(C=plates(modulus=modulus, **rest))


@pytest.mark.slow
def test_geometry_equals_its_stiffness_value():
    scene = soft_scene()
    C = float(sb.brakes.stiffness_of(scene.brake))
    assert 1e5 < C < 1e6
    geometry = sb.simulate(scene)
    near(geometry.stopping_time, closed_form(C=C)["stop"], 1e-10)
    # two equal bands are one of twice the stiffness, half the tension in each
    pair = stop_scene(C=sb.brakes.ParallelBands((plates(modulus=5e8),) * 2))
    all_near(sb.brakes.tension_shares(pair.brake), [0.5, 0.5], 4e-16)  # two roundings
    twice = float(stop_run(C=2 * C).stopping_time)
    near(sb.simulate(pair).stopping_time, twice, 1e-14)
    assert sb.brakes.stiffness_of(stop_scene(C=None).brake) is None


def test_stiffness_under_a_temperature_law():
    law = sb.friction.ProductFriction(0.4, (sb.LinearFade(1e-3, 300.0),))
    brake = stop_scene(C=plates(), law=law).brake
    hot = stop_scene(C=plates(), f=0.4 * (1 - 1e-3 * 100.0)).brake
    near(sb.brakes.stiffness_of(brake, 400.0), sb.brakes.stiffness_of(hot), 1e-14)
    with pytest.raises(ValueError, match="depends on the temperature"):
        sb.brakes.stiffness_of(brake)


@pytest.mark.slow
def test_gradient_of_the_stop_by_the_band():
    def stop(modulus, tight_end, f):
        scene = stop_scene(
            C=plates(modulus=modulus, tight_end=tight_end, linkage=2e6), f=f
        )
        return sb.simulate(scene, rtol=1e-12, max_steps=128).stopping_time

    def truth(modulus, tight_end, f):
        C = plates(modulus=modulus, tight_end=tight_end, linkage=2e6).stiffness(
            f, np.full(20, BETA), 0.725
        )
        return closed_form(C=C, f=f, xp=jnp)["stop"]

    at = (5e8, 0.9, 0.35)
    got = jax.jit(jax.grad(stop, argnums=(0, 1, 2)))(*at)
    all_near(got, jax.jit(jax.grad(truth, argnums=(0, 1, 2)))(*at), 1e-9)


def test_lever_of_the_textbook():
    lever = sb.Lever(200.0, arm=0.75, slack_arm=0.12, efficiency=0.9)
    near(lever.value(0.0, 0), 0.9 * 200.0 * 0.75 / 0.12, 1e-15)


def test_a_differential_lever_locks_itself():
    T_0 = float(sb.loads.differential_lever_tension(200.0, 0.75, 0.12, 0.02, 4.0))
    moments = T_0 * 0.12 - 4.0 * T_0 * 0.02 - 200.0 * 0.75
    assert abs(moments) < 1e-12
    assert np.isinf(sb.loads.differential_lever_tension(200.0, 0.75, 0.12, 0.03, 4.0))
    slope = jax.grad(
        lambda b: sb.loads.differential_lever_tension(200.0, 0.75, 0.12, b, 4.0)
    )(0.02)
    near(slope, 150.0 * 4.0 / 0.04**2, 1e-12)
