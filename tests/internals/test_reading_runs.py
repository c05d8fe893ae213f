"""How a run is read: every event and code has words, maxima between the ends of steps,
the metrics of a scene."""

import itertools

import jax
import pytest
from shipped import load

import simbrake as sb
from simbrake.hybrid import Code
from simbrake.outputs import log as _log
from simbrake.outputs import stages as _stages
from simbrake.physics import _chain, _sprung
from simbrake.physics import mechanism as _mechanism
from simbrake.results import BandMode, metric_names

LABELS = [
    _mechanism.Label(int(band), inner) for band in BandMode for inner in (-1, 0, 1)
]


def test_every_event_has_a_row_in_words():
    emitted = {
        name
        for before, after in itertools.product(LABELS, LABELS)
        for first in (True, False)
        for name in _mechanism.events_of_change(before, after, first)
    }
    assert {
        "slip_onset",
        "full_slip",
        "stop",
        "restart",
        "external_lock",
        "internal_restick",
    } <= emitted
    chain = _chain.ChainMode(*[None] * len(_chain.ChainMode._fields))
    bandage = _sprung.SprungMode(*[None] * len(_sprung.SprungMode._fields))
    single = {
        f"{contact}_{what}"
        for mode in (chain, bandage)
        for contact in mode.contacts
        for what in ("slip", "stick")
    }
    assert len(single) == 6
    assert emitted | single <= _log.EVENTS.keys()
    assert all(about.meaning and about.brakes for about in _log.EVENTS.values())


def test_modes_stages_and_codes_have_words():
    assert set(_mechanism.BAND_MODES) == set(BandMode)
    assert {_stages.stage_of(label) for label in LABELS} == set(_stages.STAGES)
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
