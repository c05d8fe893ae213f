"""The cost benchmark: its truths, its units, and the smallest piece of each part."""

import dataclasses
import pathlib
import sys

import pytest
from helpers import near

sys.path.insert(0, str(pathlib.Path(__file__).parents[2]))

from benchmarks import costs
from benchmarks.scenes import CASES, closed_form, cycles_case


def test_exact_derivatives():
    p = CASES["a"].plain
    h = 1e-4
    for name, slope in zip(
        ("w_0", "J", "f", "T_0"), costs.exact(p).values(), strict=True
    ):
        x = getattr(p, name)
        ends = [
            closed_form(dataclasses.replace(p, **{name: x * (1 + s * h)})).times[2]
            for s in (-1, 1)
        ]
        near(slope, (ends[1] - ends[0]) / (2 * h * x), 1e-6)


@pytest.mark.slow
def test_mistakes_in_fresh_processes():
    found = {
        cost.what: cost for cost in costs.process(True).costs
    }  # every mistake has to end with code 2
    assert len(found) == 8
    assert (
        found["run u2_5_5_stop.toml, again"].cpu
        < found["run u2_5_5_stop.toml, cold"].cpu
    )
    assert found["run u2_5_5_stop.toml, cold"].error <= 1e-9


@pytest.mark.slow
def test_looks_and_ways_to_run():
    (events,) = costs.looks(
        "(f)", cycles_case(2).simbrake(), {"events": costs.LOOKS["events"]}, 1
    )
    assert events.error <= 1e-9
    assert all(cost.error <= 1e-9 and cost.ratio > 0 for cost in costs.ways("a", 0.02))
    assert all(
        cost.error <= 1e-7 and cost.peer_error <= 1e-7
        for cost in costs.beside_heyoka("a", 0.02)
    )


@pytest.mark.slow
def test_derivatives_and_ensembles():
    assert all(cost.error <= 1e-7 for cost in costs.derivatives("a", "Dopri8", 0.02))
    one, workers = costs.many("a", 100, 10, 1)
    assert max(one.error, one.peer_error) <= 1e-5
    assert workers.ratio > 0
