"""Exact sticking: ten problems with closed forms, for any simulator (README.md)."""

import copy
import itertools
import json
import math
import pathlib
from typing import Any

import numpy as np
from scipy.optimize import brentq

PROBLEMS = pathlib.Path(__file__).with_name("problems.json")
#: central differences move a number by this share
STEP = 1e-4


def problems() -> dict[str, Any]:
    """The problems by name."""
    found = json.loads(PROBLEMS.read_text("utf-8"))["problems"]
    return {problem["name"]: problem for problem in found}


def crossings(times: Any, value: Any) -> list[tuple[float, float]]:
    """Instants at which a function of time changes its sign, and its sign after."""
    at = [(t, x) for t in times if (x := value(t)) != 0]
    return [
        (float(brentq(value, t, after, xtol=1e-15)), math.copysign(1, y))
        for (t, x), (after, y) in itertools.pairwise(at)
        if x * y < 0
    ]


def answer(run: Any, asked: dict[str, Any]) -> float:
    """The number that is asked for; NaN of an event that did not occur.

    - `run.events`: `(kind, contact, time)` in order, kind `slip` or `stick`
    - `run.turns(body)`: times at which a speed changes its sign;  `run.state(body, t)`:
      angle and speed
    """
    match asked:
        case {"time_of": kind, "nth": nth}:
            times = (
                run.turns(asked["body"])
                if kind == "turn"
                else [t for *what, t in run.events if what == [kind, asked["contact"]]]
            )
            return times[nth - 1] if len(times) >= nth else math.nan
        case {"count": kind, "contact": contact}:
            return float(sum(what == [kind, contact] for *what, _ in run.events))
        case {"speed": body, "at": t}:
            return run.state(body, t)[1]
        case {"angle": body, "at": t, "since": since}:
            return run.state(body, t)[0] - run.state(body, since)[0]
    raise ValueError(f"no such question: {asked}")


def number(problem: dict[str, Any], path: list[Any]) -> Any:
    """The part of a problem at a path."""
    for key in path:
        problem = problem[key]
    return problem


def with_number(problem: dict[str, Any], paths: list[list[Any]], x: Any) -> Any:
    """The problem with another number at the paths."""
    changed = copy.deepcopy(problem)
    for path in paths:
        number(changed, path[:-1])[path[-1]] = x
    return changed


def differences(solve: Any, problem: dict[str, Any], asked: Any) -> dict[str, float]:
    """Derivatives of times by central differences."""
    found = {}
    for label, one in asked.items():
        time = problem["answers"][one["derivative_of"]]["asked"]
        x = number(problem, one["by"][0])
        above, below = (
            answer(solve(with_number(problem, one["by"], x * (1 + step))), time)
            for step in (STEP, -STEP)
        )
        found[label] = (above - below) / (2 * STEP * x)
    return found


def answers(tool: Any, problem: dict[str, Any]) -> dict[str, float]:
    """What a module with `solve(problem)` says to all questions; its own
    `derivatives(problem, asked)` take the place of differences."""
    run = tool.solve(problem)
    found = {}
    slopes = {}
    for label, one in problem["answers"].items():
        if "derivative_of" in one["asked"]:
            slopes[label] = one["asked"]
        else:
            found[label] = answer(run, one["asked"])
    if hasattr(tool, "derivatives"):
        return found | (tool.derivatives(problem, slopes) if slopes else {})
    return found | differences(tool.solve, problem, slopes)


def score(problem: dict[str, Any], found: dict[str, Any]) -> dict[str, Any]:
    """Largest error of what has a size, relative to it; largest of what must be 0
    (`None`: nothing must); what was not given."""
    errors = {}
    sizes = []
    rests = []
    for label, one in problem["answers"].items():
        given = found.get(label)
        if given is not None and np.isfinite(given):
            errors[label] = abs(given - one["true"]) / (abs(one["true"]) or 1.0)
            (sizes if one["true"] else rests).append(errors[label])
    return {
        "error": max(sizes, default=None),
        "moved": max(rests, default=None),
        "missing": [label for label in problem["answers"] if label not in errors],
        "errors": errors,
    }


def markdown(whole: dict[str, Any]) -> list[str]:
    """Lines of a table: problems, and of each tool largest error, motion of what must
    rest, CPU time."""
    tools = list(whole["problems"][0]["tools"])
    head = ["problem", "what is hard", *tools]
    rows = [head, ["---"] * len(head)]
    for row in whole["problems"]:
        cells = [row["name"], row["hard"]]
        for one in row["tools"].values():
            if "failed" in one:
                cells.append("failed")
                continue
            parts = [] if one["error"] is None else [f"{one['error']:.0e}"]
            if one["moved"] is not None:
                parts.append(f"moved {one['moved']:.1g}")
            parts += [f"{len(one['missing'])} not given"] * bool(one["missing"])
            parts.append(f"{float(format(one['cpu_s'] * 1e3, '.2g')):,g} ms")
            cells.append("; ".join(parts))
        rows.append(cells)
    return ["| " + " | ".join(row) + " |" for row in rows]
