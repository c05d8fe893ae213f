"""The benchmark of exact sticking: its file, its tools, and another tool behind it."""

import importlib
import json
import math
import pathlib
import sys

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).parents[2]))

from benchmarks import sticking
from benchmarks.sticking import __main__ as command
from benchmarks.sticking import truths

PROBLEMS = sticking.problems()
#: those that are not slow; what is held moves exactly 0
FAST = {
    "simbrake_": ("hold", "equal limits", "rebound"),
    "scipy_events": [name for name in PROBLEMS if name != "chatter"],
}
#: error of derivatives by differences, of everything else
ALLOWED = {True: 1e-6, False: 1e-10}


def test_truths_are_their_formulas():
    assert len(PROBLEMS) == 10
    for problem in PROBLEMS.values():
        for name, one in problem["answers"].items():
            assert truths.true(problem, name) == pytest.approx(one["true"], rel=1e-12)


@pytest.mark.parametrize(
    ("module", "name"),
    [
        pytest.param(
            module,
            name,
            marks=[] if name in fast else [pytest.mark.slow],
            id=f"{name}-{module}",
        )
        for module, fast in FAST.items()
        for name in PROBLEMS
    ],
)
def test_tools_agree_with_truth(module, name):
    tool = importlib.import_module(f"benchmarks.sticking.{module}")
    problem = PROBLEMS[name]
    found = sticking.score(problem, sticking.answers(tool, problem))
    by_differences = name == "derivatives" and module == "scipy_events"
    assert not found["missing"]
    assert (found["error"] or 0) <= ALLOWED[by_differences]
    assert not found["moved"]


def test_smoothed_friction_creeps():
    """`J v' = 2 M exp(−2 v/ε)` near the limit: `φ = ε t/2 (ln(4 M t/(J ε)) − 1)`."""
    tool = importlib.import_module("benchmarks.sticking.regularised")
    found = sticking.answers(tool, PROBLEMS["hold"])
    creep = 1e-3 * 1000 / 2 * (math.log(4 * 1000 * 1000 / (50 * 1e-3)) - 1)
    assert found["moved"] == pytest.approx(creep, rel=1e-3)


TOOL = """
import json, sys
problem = json.load(sys.stdin)
assert "187" not in json.dumps(problem) and "where" not in problem
if problem["name"] == "reversal":
    sys.exit("no reversals")
print(json.dumps({"breakaway": 25.0, "speed": 187.5 * 1.01, "moved_before": 2e-3,
                  "angle": None}))
"""


def test_another_tool_is_scored(tmp_path, monkeypatch):
    (tmp_path / "tool.py").write_text(TOOL)
    out = tmp_path / "out.json"
    line = f"{sys.executable} {tmp_path / 'tool.py'}"
    given = ["--command", line, "--problems", "breakaway,reversal", "--json", str(out)]
    monkeypatch.setattr(sys, "argv", ["sticking", *given])
    assert command.main() == 0
    first, second = json.loads(out.read_text("utf-8"))["problems"]
    found = first["tools"][line]
    assert found["error"] == pytest.approx(0.01)
    assert found["moved"] == 2e-3
    assert found["missing"] == ["angle"]
    assert second["tools"][line] == {"failed": "no reversals"}
