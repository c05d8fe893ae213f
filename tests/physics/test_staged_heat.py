"""Heat of a staged brake: what both pairs leave where, fade that undoes a stage, derivatives."""

import dataclasses
import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import staged_scenes as staged

import simbrake as sb


def heated(fade=4e-4, **parts):
    """Both pairs fade with the linings' temperature; three lumps, shares S-12…14."""
    heat = sb.lumped_heat(
        rim=4e4,
        linings=6e3,
        band=9e3,
        lining_to_band=30.0,
        rim_cooling=15.0,
        band_cooling=5.0,
        partition=sb.thermal.ConstantPartition(0.7),
    )
    heat = sb.thermal.with_external_pair(heat, sb.thermal.ConstantPartition(0.5), rim_share=0.1)

    def law(f):
        return sb.friction.ProductFriction(sb.ConstantFriction(f), (sb.LinearFade(fade, 293.15, 0.0, 0.0),))

    return staged.stop(law=law(staged.F_EXT), inner=law(staged.F_INT), heat=heat, **parts)


@pytest.mark.slow
@pytest.mark.parametrize("stiffness", [None, 3e5])
def test_heat_of_both_pairs_is_accounted_for(stiffness):
    result = sb.simulate(heated(stiffness=stiffness))
    energy = {name: float(value) for name, value in result.energy.items()}
    assert energy["heat_closure"] <= 1e-12
    assert energy["closure"] <= 1e-9
    external, internal = energy["heat_external"], energy["heat_internal"]
    assert energy["heat_to_band"] == pytest.approx(0.5 * external, rel=1e-9)
    assert energy["heat_to_metal"] == pytest.approx(0.1 * external + 0.7 * internal, rel=1e-9)
    assert energy["heat_to_linings"] == pytest.approx(0.4 * external + 0.3 * internal, rel=1e-9)
    cold = sb.simulate(staged.stop(stiffness=stiffness))
    assert float(result.stopping_time) > 1.002 * float(cold.stopping_time)


@pytest.mark.slow
def test_heated_staged_stop_against_scipy():
    """Rigid band: rates of both speeds and three lumps written by hand, events from DOP853."""
    from scipy.integrate import solve_ivp
    from scipy.optimize import brentq

    result = sb.simulate(heated())
    s_, tan = math.sin(staged.BETA / 2), math.tan(staged.BETA / 2)

    def parts(t, y):
        left = 1 - 4e-4 * (y[3] - 293.15)
        z = staged.F_EXT * left * tan
        mu = np.full(staged.N, (1 + z) / (1 - z))
        return 200.0 + 4e3 * t, mu, staged.F_INT * left

    def grip(T_0, T_n, mu, f):
        T = staged.tensions(T_0, T_n, mu)
        return staged.R * f * float(np.sum((T[1:] + T[:-1]) * s_ + staged.PRELOAD))

    def rates(t, y, stage):  # ω, ω_b, rim, linings, band
        T_0, mu, f = parts(t, y)
        Pi = np.prod(mu)
        T_n = T_0 * Pi
        if stage == 3:
            T_n = brentq(lambda T: staged.R_B * (T - T_0) - grip(T_0, T, mu, f), T_0, T_0 * Pi, xtol=1e-10, rtol=1e-14)
        M_ext, M_int = staged.R_B * (T_n - T_0), grip(T_0, T_n, mu, f)
        if stage == 1:
            a = b = (300.0 - M_ext) / (staged.J + staged.J_B)
        else:
            a, b = (300.0 - M_int) / staged.J, (M_int - M_ext) / staged.J_B if stage == 2 else 0.0
        outer = M_ext * y[1]
        inner = M_int * (y[0] - y[1]) if stage > 1 else 0.0
        rim, lining, band = y[2:]
        back = 30.0 * (lining - band)
        return [
            a,
            b,
            (0.1 * outer + 0.7 * inner - 15.0 * (rim - 293.15)) / 4e4,
            (0.4 * outer + 0.3 * inner - back) / 6e3,
            (0.5 * outer + back - 5.0 * (band - 293.15)) / 9e3,
        ]

    def lets_go(t, y):
        T_0, mu, f = parts(t, y)
        M = staged.R_B * T_0 * (np.prod(mu) - 1)
        return grip(T_0, T_0 * np.prod(mu), mu, f) - M - staged.J_B * (300.0 - M) / (staged.J + staged.J_B)

    t, y, times = 0.0, np.array([20.0, 20.0, 293.15, 293.15, 293.15]), []
    for stage, event in ((1, lets_go), (2, lambda t, y: y[1]), (3, lambda t, y: y[0])):
        event.terminal = True
        run = solve_ivp(
            lambda t, y, k=stage: rates(t, y, k), (t, 20.0), y, "DOP853", events=event, rtol=1e-11, atol=1e-10
        )
        t, y = float(run.t_events[0][0]), run.y_events[0][0]
        times.append(t)
    ours = [result.internal_slip_time, result.external_lock_time, result.stopping_time]
    np.testing.assert_allclose([float(x) for x in ours], times, rtol=1e-8)
    end = result.series(times[-1:])
    np.testing.assert_allclose(end.temperature[0], y[2:], rtol=1e-9)
    left = 1 - 4e-4 * (y[3] - 293.15)
    np.testing.assert_allclose(end.friction_coefficient[0], staged.F_EXT * left, rtol=1e-9)
    np.testing.assert_allclose(end.pairs["internal"].friction_coefficient[0], staged.F_INT * left, rtol=1e-9)


@pytest.mark.parametrize("temperature_dependent", [False, True])
@pytest.mark.parametrize("spring", [None, 1e5])
def test_pair_must_have_a_place_for_its_heat(temperature_dependent, spring):
    """The heat of either pair would leave the network: both are named, once each, with what builds the place."""
    scene = heated() if temperature_dependent else staged.stop(heat=heated().heat)
    bandage = dataclasses.replace(scene.brake.bandage, spring=spring)
    scene = dataclasses.replace(scene, brake=dataclasses.replace(scene.brake, bandage=bandage))
    sb.check(scene)
    for field, builder in (("external", "with_external_pair(heat, partition)"), ("friction", "FrictionHeat(metal")):
        one = dataclasses.replace(scene, heat=dataclasses.replace(scene.heat, **{field: None}))
        with pytest.raises(sb.InputError) as caught:
            sb.simulate(one)
        (fault,) = caught.value.faults
        assert fault.path == f"heat.{field}"
        assert "would enter no body" in fault.problem
        assert builder in fault.hint
    neither = dataclasses.replace(scene, heat=dataclasses.replace(scene.heat, friction=None, external=None))
    with pytest.raises(sb.InputError) as caught:
        sb.check(neither)
    assert {fault.path for fault in caught.value.faults} == {"heat.friction", "heat.external"}


@pytest.mark.slow
def test_outer_lining_face_has_its_own_place():
    """Equal steel and equal fluxes on both faces of the linings: each face takes the heat that its own pair gives."""
    lining, steel = sb.Material(0.5, 2000.0, 1000.0), sb.Material(48.0, 7800.0, 500.0)
    heat = sb.layered_heat(
        rim=steel,
        rim_thickness=0.025,
        track_area=1.0,
        partition=sb.thermal.ConstantPartition(0.7),
        rim_layers=4,
        lining=lining,
        lining_thickness=0.04,
        lining_area=0.8,
        lining_layers=8,
        lining_both=True,
        lining_first=4e-4,
        band=steel,
    )
    heat = sb.thermal.with_external_pair(heat, sb.thermal.ConstantPartition(0.5))
    result = sb.simulate(staged.stop(heat=heat))
    onset = float(result.internal_slip_time)
    early = result.series([0.5 * onset, onset])
    assert np.all(np.asarray(early.lining_temperature) < sb.thermal.ROOM + 1e-3)  # nothing slides inside yet
    assert np.max(early.lining_outer_temperature[0]) > sb.thermal.ROOM + 1.0
    outer, inner = result.peak_lining_outer_temperature, result.peak_lining_temperature
    lock = float(result.external_lock_time)
    assert float(outer.time) < lock < float(inner.time)
    assert float(outer.value) == pytest.approx(
        float(np.max(result.series(np.linspace(0.9 * onset, lock, 200)).lining_outer_temperature)), rel=1e-4
    )


@pytest.mark.slow
def test_fade_undoes_a_stage():
    """External friction that fades below the internal one: the bandage comes loose again and rides with the pulley."""
    heat = sb.lumped_heat(
        rim=4e5,
        linings=5e4,
        band=300.0,
        lining_to_band=0.0,
        rim_cooling=0.0,
        band_cooling=0.0,
        partition=sb.thermal.ConstantPartition(1.0),
    )
    pair = sb.thermal.FrictionHeat("band", "linings", sb.thermal.ConstantPartition(1.0), sensed="band")
    heat = dataclasses.replace(heat, external=pair)
    law = sb.friction.ProductFriction(sb.ConstantFriction(staged.F_EXT), (sb.LinearFade(2.5e-3, 293.15, 0.15, 0.05),))
    scene = staged.stop(law=law, heat=heat, lever=sb.Constant(2e3), load=2e3, w0=40.0, preload=0.0, end=8.0)
    result = sb.simulate(scene)
    names = [e.name for e in result.events if e.name != "lining_limit"]
    assert names == ["slip_onset", "full_slip", "internal_slip", "internal_restick"]
    assert result.stages[-1].name == "stage_1"
    assert float(result.energy["closure"]) <= 1e-9


@pytest.mark.slow
def test_gradients_of_a_heated_staged_stop():
    import diffrax

    def answer(p):
        scene = heated(fade=p[0], stiffness=p[1], preload=p[2], J_b=p[3])
        result = sb.simulate(scene, rtol=1e-12, max_steps=256, solver=diffrax.Dopri8())
        return jnp.stack([result.external_lock_time, result.stopping_time, result.end_temperatures[0]])

    p = jnp.asarray([4e-4, 3e5, staged.PRELOAD, staged.J_B])
    jacobian = np.asarray(jax.jit(jax.jacfwd(answer))(p)) * np.asarray(p)
    h = 1e-3
    steps = np.concatenate([np.diag(np.full(4, k * h)) for k in (1, -1, 2, -2)])
    a, b, c, d = np.split(np.asarray(jax.jit(jax.vmap(answer))(p * (1 + steps))), 4)
    differences = ((8 * (a - b) - (c - d)) / (12 * h)).T
    largest = np.abs(differences).max(axis=1, keepdims=True)
    assert np.all(np.abs(jacobian - differences) <= 1e-7 * np.abs(differences) + 1e-9 * largest)
