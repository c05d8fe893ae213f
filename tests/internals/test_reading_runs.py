"""How a run is read: every event and code has words, maxima between the ends of steps,
the metrics of a scene."""

import itertools

import jax
import numpy as np
import pytest
from heat_scenes import T0, fading, lump, rigid_stop
from shipped import load

import simbrake as sb
from simbrake.hybrid import Code
from simbrake.outputs import log as _log
from simbrake.outputs import scan as _scan
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
    assert {_log.stage_of(label) for label in LABELS} == set(_log.STAGES)
    assert set(_log.STATUS_MESSAGES) == set(_log.Status)
    assert set(_log.FAILURES) == (set(Code) | set(_mechanism.BrakeCode)) - {
        Code.COMPLETED
    }


# --- between the ends of steps ------------------------------------------------------

HOT = 273.15 + 30.0
#: columns of the series of which a metric is the maximum
COLUMNS = {
    "max_tension": ("tension", "slack_tension"),
    "max_normal_load": ("normal_load",),
    "peak_rim_temperature": ("rim_temperature",),
    "peak_lining_temperature": ("lining_temperature",),
}


def warming(end=1.5):
    """Rim and linings get hot and cool again while a lever with corners brakes."""
    heat = lump(2e3, 0.9, 1e3, 400.0, permissible=HOT)
    lever = sb.PiecewiseLinear([0.0, 0.3, 0.7, end], [0.2 * T0, T0, 0.6 * T0, 0.6 * T0])
    return rigid_stop(fading(slope=1e-3), heat, end, lever)


def swinging_load():
    """An elastic band under a load that swings past the grip either way: limits of
    linings, and jumps of tension."""
    linings = sb.Lining(sb.ConstantFriction(0.4, 1.1), np.full(6, 0.4))
    brake = sb.Brake(sb.Pulley(0.7, 2000.0), sb.Band(0.7, 3e5), linings)
    load = sb.TorqueLoad(
        sb.Repeated([0.0, 0.25, 0.75, 1.0], [0.0, 1e5, -1e5, 0.0], 1.0, 3)
    )
    return sb.Scene(brake, sb.Duty(sb.Constant(1e4), load), sb.Initial(0.5), 3.0)


RUNS = {
    "explicit": lambda: sb.simulate(warming(), rtol=1e-8),
    "stiff": lambda: sb.simulate(warming(), solver=sb.hybrid.Rodas5P(), rtol=1e-9),
    "jumps": lambda: sb.simulate(swinging_load()),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", RUNS)
def test_peaks_are_those_of_partial_steps(name, monkeypatch):
    """Looked at on interpolants between the ends of steps, also where the run is
    short."""
    monkeypatch.setattr(_scan, "_SHORT", 0)
    result = RUNS[name]()
    rows = np.asarray(result.record.rows.t)[: int(result.record.count) + 1]
    times = np.unique(
        rows[:-1, None]
        + np.linspace(0.0, 1.0, 40, endpoint=False) * np.diff(rows)[:, None]
    )
    looks = result.series(times), result.series(times, left=True)
    peaks = result.report().peaks
    for name in COLUMNS.keys() & peaks.keys():
        found = peaks[name]
        columns = COLUMNS[name]
        seen = np.concatenate(
            [np.ravel(getattr(look, column)) for look in looks for column in columns]
        )
        assert found.value >= seen.max() * (1 - 1e-12), name
        assert found.value == pytest.approx(seen.max(), rel=1e-4), name
        at = [result.series([found.time], left=left) for left in (False, True)]
        there = np.asarray(
            [np.max(getattr(look, column)) for look in at for column in columns]
        )
        # as exact as the run: the time of an interior maximum hardly matters
        assert np.min(np.abs(there / found.value - 1)) < 0.1 * float(result.rtol), name
    marks = [
        event.time for event in result.events if event.name == "permissible_temperature"
    ]
    assert len(marks) == int(result.scene.heated)
    for mark in marks:
        assert np.max(result.series([mark]).lining_temperature) == pytest.approx(
            HOT, rel=1e-11
        )


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
