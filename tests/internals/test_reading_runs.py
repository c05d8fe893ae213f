"""How a run is read: every mode and code has words, the metrics of a scene."""

from itertools import product

import jax
import pytest
from shipped import load

import simbrake as sb
from simbrake.hybrid import Code
from simbrake.outputs import log as _log
from simbrake.outputs import stages as _stages
from simbrake.physics import mechanism as _mechanism
from simbrake.results import BandMode, metric_names


def test_modes_stages_and_codes_have_words():
    assert set(_mechanism.BAND_MODES) == set(BandMode)
    labels = (_mechanism.Label(*each) for each in product(BandMode, (-1, 0, 1)))
    assert {_stages.stage_of(label) for label in labels} == set(_stages.STAGES)
    assert set(_log.STATUS_MESSAGES) == set(_log.Status)
    assert set(_log.FAILURES) == (set(Code) | set(_mechanism.BrakeCode)) - {
        Code.COMPLETED
    }


# --- metrics ------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["slip_onset_chain", "resolved_bandage"])
def test_scene_names_are_those_of_its_run(name):
    scene = load(name).scene()
    energies = set()
    names = metric_names(scene)

    def run(scene):
        result = sb.simulate(scene)
        energies.update(
            f"energy.{key}" for key in result.energy if not key.endswith("closure")
        )
        return [result[one] for one in names]

    assert all(
        (shape.shape, shape.dtype) == ((), "float64")
        for shape in jax.eval_shape(run, scene)
    )
    assert energies == {one for one in names if one.startswith("energy.")}
