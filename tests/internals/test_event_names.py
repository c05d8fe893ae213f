"""Every event, mode, stage, status and code that can come has its words."""

import itertools

from simbrake._physics import _chain, _mechanism, _sprung
from simbrake._run import _log
from simbrake.hybrid import Code
from simbrake.results import BandMode

LABELS = [_mechanism.Label(int(band), inner) for band in BandMode for inner in (-1, 0, 1)]


def test_every_change_of_mode_has_names_with_a_row():
    emitted = {
        name
        for before, after in itertools.product(LABELS, LABELS)
        for first in (True, False)
        for name in _mechanism.events_of_change(before, after, first)
    }
    assert {"slip_onset", "full_slip", "stop", "restart", "external_lock", "internal_restick"} <= emitted
    assert emitted <= _log.EVENTS.keys()


def test_contacts_of_single_linings_have_rows():
    chain = _chain.ChainMode(*[None] * len(_chain.ChainMode._fields))
    bandage = _sprung.SprungMode(*[None] * len(_sprung.SprungMode._fields))
    names = {
        f"{contact}_{what}" for mode in (chain, bandage) for contact in mode.contacts for what in ("slip", "stick")
    }
    assert len(names) == 6
    assert names <= _log.EVENTS.keys()


def test_every_mode_stage_status_and_code_has_words():
    assert set(_mechanism.BAND_MODES) == set(BandMode)
    assert {_log.stage_of(label) for label in LABELS} == set(_log.STAGES)
    assert set(_log.STATUS_MESSAGES) == set(_log.Status)
    assert set(_log.FAILURES) == (set(Code) | set(_mechanism.BrakeCode)) - {Code.COMPLETED}
    assert all(len(words) == 2 and all(words) for words in _mechanism.BAND_MODES.values())
    assert all(about.meaning and about.brakes for about in _log.EVENTS.values())
