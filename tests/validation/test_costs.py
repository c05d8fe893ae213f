"""The cost benchmark: its bare loop, its truths, and the smallest piece of each part."""

import math
import pathlib
import sys

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).parents[2]))

from benchmarks import costs, documents
from benchmarks.parts import (
    again,
    bare,
    chart,
    elsewhere,
    engine,
    ensemble,
    first,
    gradient,
    growth,
    looking,
    loops,
    processes,
    stops,
    table,
    timing,
)
from benchmarks.scenes import CASES, closed_form


@pytest.mark.parametrize("method", ["Tsit5", "Dopri8"])
def test_bare_loop_integrates_the_longest_stretch(method):
    scene, solver, p = CASES["a"].simbrake(), engine.solver_named(method), CASES["a"].plain
    stretch = bare.longest(scene, solver, 1e-10)
    truth = closed_form(p)
    assert stretch.t == pytest.approx(truth.times[1], rel=1e-9)
    assert stretch.span == pytest.approx(truth.times[2] - truth.times[1], rel=1e-9)
    for call in bare.programs(scene, solver, 3, stretch).values():
        found = call()  # angle, speed, …: the slowing is constant, so that any number of steps is exact
        assert found[0] == pytest.approx(truth.state[0], rel=1e-10)
        assert abs(found[1]) <= 1e-9


@pytest.mark.slow
def test_engine_and_gradient_of_the_short_scene():
    row = engine.against_bare("a", "Dopri8", 0.02)
    assert row["error"] <= 1e-8
    assert row["cpu"] > row["nothing"] > 0
    around = engine.events("a", "Dopri8", 0.02)
    assert [r["what"].split(", ")[1] for r in around] == list(CASES["a"].events)
    assert all(r["steps"] >= 1 and math.isfinite(r["in_steps"]) for r in around)
    rows = gradient.one("a", "Dopri8", 0.02, True)
    assert all(r["error"] <= 1e-8 and r["ratio"] > 0 for r in rows)


def test_exact_derivatives_are_those_of_the_closed_form():
    import dataclasses

    p, h = CASES["a"].plain, 1e-4
    fields = ("w_0", "J", "f", "T_0")
    for name, slope in zip(fields, gradient.exact(p).values(), strict=True):
        x = getattr(p, name)
        ends = [closed_form(dataclasses.replace(p, **{name: x * (1 + s * h)})).times[2] for s in (-1, 1)]
        assert slope == pytest.approx((ends[1] - ends[0]) / (2 * h * x), rel=1e-6)


@pytest.mark.slow
def test_ensembles():
    row = ensemble.row_of("a", 100, 1, 1)
    assert row["error"] <= 1e-6
    assert row["rate"] > 0
    assert ensemble.one_after_the_other("a", ensemble.drawn("a", 3), 3)["error"] <= 1e-5
    scipy, ours = stops.rows(100, 1e-8, 1)
    assert max(scipy["error"], ours["error"]) <= 1e-6


@pytest.mark.slow
@pytest.mark.parametrize(("curve", "size"), [("layers", 10), ("linings", 8), ("linings of a chain", 8)])
def test_growth(curve, size):
    row = growth.point(curve, size, 0.02)
    assert row["error"] <= 1e-5
    assert row["bare"] > 0


@pytest.mark.slow
def test_first_result_of_a_fresh_process(tmp_path):
    script = first.scripts()["(a) stop"]
    cold, warm = (first.process(script, str(tmp_path)) for _ in range(2))
    assert list(tmp_path.iterdir())
    truth = closed_form(CASES["a"].plain).times[-1]
    for found in (cold, warm):
        assert found.said["stop"] == pytest.approx(truth, rel=1e-9)
        assert found.seconds > found.said["import"][0] - found.began > 0
    assert warm.said["compile"] < cold.said["compile"]


def test_processor_time_of_a_fresh_process_is_its_own(tmp_path):
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


def test_rounds_are_divided_by_their_own_unit(monkeypatch):
    units, cpu = iter([99.0, 0.5, 1.0, 0.5]), iter([1.0, 4.0, 3.0])
    monkeypatch.setattr(processes, "unit", lambda: next(units))  # the first one only warms up
    found = processes.Rounds.of(3, lambda: {"x": next(cpu)})
    assert found.in_units("x") == 4.0
    assert found.in_units("x", less=1.0) == 3.0
    assert found.seconds("x") == 3.0


def test_difference_of_events():
    names = ["slip", "stop"]
    assert again.largest_difference((names, [0.0, 2.0]), (names, [0.0, 2.0])) == 0.0
    assert again.largest_difference((names, [1.0, 2.0]), (names, [1.0, 2.5])) == pytest.approx(0.2)
    assert math.isnan(again.largest_difference((names, [1.0, 2.0]), (names[:1], [1.0])))


@pytest.mark.slow
def test_mistakes_of_the_command_line():
    rows = again.mistakes(1)  # every one of them has to end with code 2
    assert [row["what"] for row in rows][:2] == ["unknown command", "unknown option"]
    assert all(row["ratio"] > 0 for row in rows)


@pytest.mark.slow
def test_looks_and_loops():
    few, more = looking.growth((2, 4), 1)
    assert few["events"] < more["events"]
    assert few["error"] <= 1e-9
    found = {row["way"]: row for row in loops.ways("a", "Dopri8", 0.02)}
    assert set(found) == {"simulate", "jax.jit"}
    assert all(row["error"] <= 1e-9 and row["ratio"] > 0 for row in found.values())


def test_rows_of_other_machines_are_kept_with_their_date(tmp_path):
    file = tmp_path / "elsewhere.csv"
    file.write_text("what,sense,wanted,reached,error,date,machine\nstops,>=,4,0.3,,2020-01-01,old\nrest,<=,1,2,,x,y\n")
    found = [table.Target(f"stops, {x}", 4.0, x, True, 1e-9) for x in (9.0, 5.0)]  # the worst of them
    elsewhere.keep([*found, table.Target("other", 1.0, 1.0)], "new", file)
    part = elsewhere.measure(False, file)
    assert [(target.reached, target.met) for target in part.targets] == [(5.0, True), (2.0, False)]
    assert (part.rows[0]["machine"], part.rows[1]["date"]) == ("new", "x")
    assert part.rows[0]["date"] != "2020-01-01"
    assert "error 1.0e-09" in table.text(part)
    assert all(row["reached"] > 0 for row in elsewhere.measure(False).rows)  # those of the repository


def test_exponent_takes_the_upper_half():
    rows = [{"size": n, "cpu": n**1.3 * (7.0 if n < 30 else 1.0)} for n in (10, 30, 100, 300)]
    assert growth.exponent(rows, "cpu") == pytest.approx(1.3, abs=1e-12)


def test_ratio_is_taken_round_by_round():
    slow, fast = timing.Times([], [3.0, 30.0, 5.0]), timing.Times([], [2.0, 20.0, 2.0])
    assert timing.ratio(slow, fast) == 1.5
    idle = timing.Times([], [1.0, 1.0, 1.0])
    assert timing.ratio(slow, fast, idle) == 2.0
    seen = []
    found = timing.interleaved({"a": lambda: seen.append("a"), "b": lambda: seen.append("b")}, 0.0, 3)
    assert [len(found[name].wall) for name in "ab"] == [3, 3]
    assert seen[-1] == "b"


def _part() -> table.Part:
    columns = (table.Column("what", ""), table.Column("time", "ms", ".1f", 1e3))
    rows = [{"what": "x", "time": 0.25, "size": 1, "value": 0.25, "curve": "c", "bare": 0.1}, {"what": "y"}]
    targets = [table.Target("time", 1.0, 2.0), table.Target("rate", 1.0, 2.0, least=True)]
    return table.Part("growth", "how long", columns, rows, targets, ["a note"])


def test_tables_and_document(tmp_path, drawn):
    part = _part()
    assert [target.met for target in part.targets] == [False, True]
    assert [target.share for target in part.targets] == [2.0, 0.5]
    assert "250.0" in table.text(part)
    assert "MISSED  time" in table.text(part)
    about = {"cpu": "C", "cores": 2, "load": 0.5, "versions": dict.fromkeys(("python", "jax", "diffrax", "scipy"), "1")}
    path = tmp_path / "costs.md"
    path.write_text(f"before\n{documents.BEGIN}\nold\n{documents.END}\nafter\n", "utf-8")
    costs.write_docs(path, about, [part])
    text = path.read_text("utf-8")
    assert "| x | 250.0 |" in text
    assert "old" not in text
    assert text.startswith("before\n")
    assert text.endswith("after\n")
    costs.write_docs(path, about, [part._replace(name="engine", title="how fast")])  # the other one stays
    text = path.read_text("utf-8")
    assert text.index("how fast") < text.index("how long") < text.index("after")
    chart.draw(about, [part], str(tmp_path / "costs.png"))
    limits = drawn["costs.png"].axes[0]
    assert [bar.get_width() for bar in limits.patches] == [0.5, 2.0]  # reached over wanted, the first one on top


def test_numbers_in_the_document():
    assert [table.number(x) for x in (0.012345, 1.2345, 123456.7)] == ["0.0123", "1.23", "123,457"]
