"""Heat of a staged brake: what both pairs leave where, fade that undoes a stage."""

import dataclasses

import numpy as np
import pytest
import staged_scenes as staged
from helpers import changes_of, closes, near

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
    heat = sb.thermal.with_external_pair(
        heat, sb.thermal.ConstantPartition(0.5), rim_share=0.1
    )

    def law(f):
        return sb.friction.ProductFriction(f, (sb.LinearFade(fade, 293.15, 0.0, 0.0),))

    return staged.stop(
        law=law(staged.F_EXT), inner=law(staged.F_INT), heat=heat, **parts
    )


@pytest.mark.slow
@pytest.mark.parametrize("stiffness", [None, 3e5])
def test_heat_of_both_pairs_is_accounted_for(stiffness):
    result = sb.simulate(heated(stiffness=stiffness))
    energy = {name: float(value) for name, value in result.energy.items()}
    assert energy["heat_closure"] <= 1e-12
    assert energy["closure"] <= 1e-9
    external = energy["heat_external"]
    internal = energy["heat_internal"]
    near(energy["heat_to_band"], 0.5 * external, 1e-9)
    near(energy["heat_to_metal"], 0.1 * external + 0.7 * internal, 1e-9)
    near(energy["heat_to_linings"], 0.4 * external + 0.3 * internal, 1e-9)
    cold = sb.simulate(staged.stop(stiffness=stiffness))
    assert float(result.stopping_time) > 1.002 * float(cold.stopping_time)


@pytest.mark.slow
def test_outer_lining_face_has_its_own_place():
    """Equal steel and equal fluxes on both faces of the linings: each face takes the
    heat that its own pair gives."""
    lining = sb.Material(0.5, 2000.0, 1000.0)
    steel = sb.Material(48.0, 7800.0, 500.0)
    heat = sb.layered_heat(
        rim=steel,
        rim_thickness=0.025,
        track_area=1.0,
        partition=0.7,
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
    # nothing slides inside yet
    assert np.all(np.asarray(early.lining_temperature) < sb.thermal.ROOM + 1e-3)
    assert np.max(early.lining_outer_temperature[0]) > sb.thermal.ROOM + 1.0
    outer = result.peak_lining_outer_temperature
    inner = result.peak_lining_temperature
    lock = float(result.external_lock_time)
    assert float(outer.time) < lock < float(inner.time)
    near(
        outer.value,
        np.max(
            result.series(np.linspace(0.9 * onset, lock, 200)).lining_outer_temperature
        ),
        1e-4,
    )


@pytest.mark.slow
def test_fade_undoes_a_stage():
    """External friction that fades below the internal one: the bandage comes loose
    again and rides with the pulley."""
    heat = sb.lumped_heat(
        rim=4e5,
        linings=5e4,
        band=300.0,
        lining_to_band=0.0,
        rim_cooling=0.0,
        band_cooling=0.0,
        partition=sb.thermal.ConstantPartition(1.0),
    )
    pair = sb.thermal.FrictionHeat("band", "linings", 1.0, sensed="band")
    heat = dataclasses.replace(heat, external=pair)
    law = sb.friction.ProductFriction(
        staged.F_EXT, (sb.LinearFade(2.5e-3, 293.15, 0.15, 0.05),)
    )
    scene = staged.stop(
        law=law,
        heat=heat,
        lever=sb.Constant(2e3),
        load=2e3,
        w0=40.0,
        preload=0.0,
        end=8.0,
    )
    result = sb.simulate(scene)
    names = changes_of(result)
    assert names == ["slip_onset", "full_slip", "internal_slip", "internal_restick"]
    assert result.stages[-1].name == "stage_1"
    closes(result, 1e-9)
