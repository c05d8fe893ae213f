"""The cost benchmark: its truths, its units, and the smallest piece of each part."""

import dataclasses
import json
import math
import pathlib
import sys

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).parents[2]))

from benchmarks import costs, processes, timing
from benchmarks.scenes import CASES, closed_form, cycles_case


def test_exact_derivatives():
    p, h = CASES["a"].plain, 1e-4
    for name, slope in zip(("w_0", "J", "f", "T_0"), costs.exact(p).values(), strict=True):
        x = getattr(p, name)
        ends = [closed_form(dataclasses.replace(p, **{name: x * (1 + s * h)})).times[2] for s in (-1, 1)]
        assert slope == pytest.approx((ends[1] - ends[0]) / (2 * h * x), rel=1e-6)


def test_processor_time_of_a_fresh_process(tmp_path):
    busy = "import time\nwhile time.process_time() < 0.3: pass\ntime.sleep(0.3)\nprint('done')"
    done = processes.fresh(["-c", busy], str(tmp_path))
    assert done.out == "done\n"
    assert 0.3 <= done.cpu < 0.55
    assert done.seconds >= 0.6
    folders = "import os; print(os.environ['XDG_CACHE_HOME'], os.environ['SIMBRAKE_CACHE_DIR'])"
    assert processes.fresh(["-c", folders], str(tmp_path)).out.split() == [str(tmp_path), str(tmp_path / "simbrake")]
    assert processes.fresh(["-c", "raise SystemExit(2)"], code=2).code == 2
    with pytest.raises(RuntimeError, match="ended with 3"):
        processes.fresh(["-c", "raise SystemExit(3)"])


def test_rounds_in_their_own_unit(monkeypatch):
    units, cpu = iter([99.0, 0.5, 1.0, 0.5]), iter([1.0, 4.0, 3.0])
    monkeypatch.setattr(processes, "unit", lambda: next(units))  # the first one only warms up
    found = processes.Rounds.of(3, lambda: {"x": next(cpu)})
    assert found.in_units("x") == 4.0
    assert found.in_units("x", less=1.0) == 3.0
    assert found.seconds("x") == 3.0


def test_ratio_is_taken_round_by_round():
    slow, fast = timing.Times([], [3.0, 30.0, 5.0]), timing.Times([], [2.0, 20.0, 2.0])
    assert timing.ratio(slow, fast) == 1.5
    seen = []
    found = timing.interleaved({"a": lambda: seen.append("a"), "b": lambda: seen.append("b")}, 0.0, 3)
    assert [len(found[name].wall) for name in "ab"] == [3, 3]
    assert seen[-1] == "b"


def test_difference_of_events():
    first, second = ("slip", 0.0), ("stop", 2.0)
    assert costs.largest_difference([first, second], [first, second]) == 0.0
    assert costs.largest_difference([first, second], [first, ("stop", 2.5)]) == pytest.approx(0.2)
    assert math.isnan(costs.largest_difference([first, second], [first]))


def test_cost_beyond_its_limit_is_missed():
    kept = costs.Cost("kept", 1e-3, "run", 2e-3, 0.5, 1.0, 1e-9)
    over = kept._replace(what="over", ratio=2.0)
    assert [cost.missed for cost in (kept, over, over._replace(limit=None))] == [False, True, False]
    about = {"cpu": "C", "cores": 2, "load": 0.5}
    about["versions"] = dict.fromkeys(("python", "jax", "diffrax", "scipy", "heyoka"), "1")
    part = {"title": "how long", "costs": [kept._asdict(), over._asdict()], "notes": ["a note"]}
    text = costs.markdown(json.loads(json.dumps({"machine": about, "parts": {"loops": part}})), "loops")
    assert [line.endswith("| missed |") for line in text.splitlines() if "ms" in line] == [False, True]


@pytest.mark.slow
def test_mistakes_in_fresh_processes():
    found = {cost.what: cost for cost in costs.process(True).costs}  # every mistake has to end with code 2
    assert len(found) == 8
    assert found["run u2_5_5_stop.toml, again"].cpu < found["run u2_5_5_stop.toml, cold"].cpu
    assert found["run u2_5_5_stop.toml, cold"].error <= 1e-9


@pytest.mark.slow
def test_looks_and_ways_to_run():
    (events,) = costs.looks("(f)", cycles_case(2).simbrake(), {"events": costs.LOOKS["events"]}, 1)
    assert events.error <= 1e-9
    assert all(cost.error <= 1e-9 and cost.ratio > 0 for cost in costs.ways("a", 0.02))
    assert all(cost.error <= 1e-7 and cost.peer_error <= 1e-7 for cost in costs.beside_heyoka("a", 0.02))


@pytest.mark.slow
def test_derivatives_and_ensembles():
    assert all(cost.error <= 1e-7 for cost in costs.derivatives("a", "Dopri8", 0.02, 1))
    one, workers = costs.many("a", 100, 10, 1)
    assert max(one.error, one.peer_error) <= 1e-5
    assert workers.ratio > 0
