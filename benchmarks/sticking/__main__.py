"""Runs tools on the problems of exact sticking: `python -m benchmarks.sticking`."""

import argparse
import importlib
import json
import os
import pathlib
import resource
import shlex
import subprocess
import sys
import time
from typing import Any

os.environ.setdefault("JAX_PLATFORMS", "cpu")

from benchmarks.machine import machine

from . import answers, markdown, problems, score

#: tools by name: their modules
TOOLS = {
    "simbrake": "simbrake_",
    "SciPy with events": "scipy_events",
    "SciPy with tanh": "regularised",
}
#: where the page takes its table from
NUMBERS = pathlib.Path(__file__).parents[2] / "docs" / "measured" / "sticking.json"


def by_module(module: str, problem: dict[str, Any]) -> tuple[dict[str, Any], float]:
    """Answers, and CPU seconds of a second run."""
    tool = importlib.import_module(f"benchmarks.sticking.{module}")
    found = {}
    for _ in range(2):
        begin = time.process_time()
        found = answers(tool, problem)
    return found, time.process_time() - begin  # pyright: ignore


def by_command(command: str, problem: dict[str, Any]) -> tuple[dict[str, Any], float]:
    """Answers that a command prints as JSON, and its CPU seconds; it reads the problem
    without its true values and formulas on stdin."""
    told = {key: part for key, part in problem.items() if key != "where"}
    told["answers"] = {k: one["asked"] for k, one in problem["answers"].items()}
    begin = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        shlex.split(command),
        input=json.dumps(told),
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise RuntimeError(done.stderr.strip() or f"exit code {done.returncode}")
    end = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = end.ru_utime + end.ru_stime - begin.ru_utime - begin.ru_stime
    return json.loads(done.stdout), spent


def main() -> int:
    parser = argparse.ArgumentParser(prog="benchmarks.sticking", description=__doc__)
    parser.add_argument(
        "--tool", action="append", choices=TOOLS, help="default: all of them"
    )
    parser.add_argument(
        "--command",
        action="append",
        default=[],
        help="another tool: reads a problem as JSON, prints {answer: number}",
    )
    parser.add_argument("--problems", help="names with commas between them")
    parser.add_argument("--json", type=pathlib.Path, help="writes all errors")
    parser.add_argument("--write-docs", action="store_true")
    given = parser.parse_args()
    asked = problems()
    if given.problems:
        asked = {name: asked[name] for name in given.problems.split(",")}
    tools: dict[str, Any] = dict.fromkeys(given.command, by_command)
    for name in given.tool or ([] if given.command else TOOLS):
        tools[name] = lambda tool, problem: by_module(TOOLS[tool], problem)
    rows: list[Any] = []
    for name, problem in asked.items():
        row = {"name": name, "hard": problem["hard"], "tools": {}}
        for tool, run in tools.items():
            print(f"{name}: {tool}", file=sys.stderr)
            try:
                found, spent = run(tool, problem)
            except Exception as why:  # any fault of a tool is a result
                print(f"failed: {why}", file=sys.stderr)
                row["tools"][tool] = {"failed": str(why)}
                continue
            row["tools"][tool] = score(problem, found) | {"cpu_s": spent}
        rows.append(row)
    whole = {"machine": machine(), "problems": rows}
    print("\n".join(markdown(whole)))
    for file in (given.json, NUMBERS if given.write_docs else None):
        if file:
            file.write_text(json.dumps(whole, indent=1) + "\n", "utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
