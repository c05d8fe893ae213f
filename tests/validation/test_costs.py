"""The cost benchmark: its truths, its units, and the smallest piece of each part."""

import dataclasses
import pathlib
import sys

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).parents[2]))

from benchmarks import costs, processes
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
        assert slope == pytest.approx((ends[1] - ends[0]) / (2 * h * x), rel=1e-6)


def test_processor_time_of_a_fresh_process(tmp_path):
    busy = "import time\nwhile time.process_time() < 0.3: pass\ntime.sleep(0.3)\nprint('done')"
    done = processes.fresh(["-c", busy], str(tmp_path))
    assert done.out == "done\n"
    assert 0.3 <= done.cpu < 0.55
    assert done.seconds >= 0.6
    folders = "import os; print(os.environ['XDG_CACHE_HOME'], os.environ['SIMBRAKE_CACHE_DIR'])"
    assert processes.fresh(["-c", folders], str(tmp_path)).out.split() == [
        str(tmp_path),
        str(tmp_path / "simbrake"),
    ]
    assert processes.fresh(["-c", "raise SystemExit(2)"], code=2).code == 2
    with pytest.raises(RuntimeError, match="ended with 3"):
        processes.fresh(["-c", "raise SystemExit(3)"])


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
