"""Writes the true values in `problems.json` from the formulas beside them:
`python -m benchmarks.sticking.truths`."""

import cmath
import json
from typing import Any

from scipy.optimize import brentq

from . import PROBLEMS

NAMES = {
    **vars(cmath),
    "root": lambda f, a, b: brentq(lambda x: f(x).real, a, b, xtol=1e-16, rtol=1e-15),
}


def values(problem: dict[str, Any], **moved: complex) -> dict[str, Any]:
    """All quantities of a problem by their formulas; `moved` are replaced."""
    found = dict(NAMES)
    for name, formula in problem["where"].items():
        found[name] = moved.get(name) or eval(formula, found)
    for name, answer in problem["answers"].items():
        if "derivative_of" not in answer["asked"]:
            found[name] = eval(answer["formula"], found)
    return found


def true(problem: dict[str, Any], name: str) -> float:
    """The true value of an answer; a derivative by a complex step."""
    answer = problem["answers"][name]
    if "derivative_of" not in answer["asked"]:
        return complex(values(problem)[name]).real
    _, of, _, _, by = answer["formula"].split()
    moved = values(problem)[by] + 1e-30j
    return values(problem, **{by: moved})[of].imag / 1e-30


def written() -> str:
    """The text of the file."""
    found = json.loads(PROBLEMS.read_text("utf-8"))
    for problem in found["problems"]:
        for name, answer in problem["answers"].items():
            answer["true"] = true(problem, name)
    return json.dumps(found, indent=1) + "\n"


if __name__ == "__main__":
    PROBLEMS.write_text(written(), "utf-8")
