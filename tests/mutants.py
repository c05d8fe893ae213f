"""Plants errors drawn once, one at a time, and tells which are seen: before and after a
change of the tests.

    python tests/mutants.py [WORD] [--pytest "FILE -k NAME"]

`mutants.csv` has some hundred: function, expression, what stands there instead, and
what sees it (a file of tests, with `-k` some of them), or why nothing can. WORD: those
whose row contains it. `--pytest`: what is run instead, as `tests/physics`. Errors at
other places, drawn anew: mutmut, see CONTRIBUTING.
"""

import argparse
import ast
import csv
import os
import pathlib
import shlex
import shutil
import subprocess
import sys
import tempfile

import pytest

ROOT = pathlib.Path(__file__).parents[1]


def expressions(tree, name=""):
    """All expressions in the order of the text, each with the qualified name of its
    function or class."""
    for node in ast.iter_child_nodes(tree):
        inner = name
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            within = "." if isinstance(tree, ast.ClassDef) else ".<locals>."
            inner = f"{name}{within if name else ''}{node.name}"
        if isinstance(node, ast.expr):
            yield name, node
        yield from expressions(node, inner)


def planted(file, function, before, after, number):
    """The text of a file with the error in it; `None` where the function has no such
    expression."""
    text = file.read_text("utf-8")
    found = [
        node
        for name, node in expressions(ast.parse(text))
        if name == function and ast.unparse(node) == before
    ]
    if number >= len(found):
        return None
    node = found[number]
    lines = text.encode().splitlines(keepends=True)
    assert node.end_lineno is not None
    start = sum(map(len, lines[: node.lineno - 1])) + node.col_offset
    end = sum(map(len, lines[: node.end_lineno - 1])) + (node.end_col_offset or 0)
    whole = text.encode()
    return (whole[:start] + f"({after})".encode() + whole[end:]).decode()


def place(tree, mutant):
    """The file where the error belongs, wherever its function has moved, and its text
    with the error."""
    files = [
        tree / "simbrake" / mutant["module"],
        *sorted((tree / "simbrake").rglob("*.py")),
    ]
    for file in filter(pathlib.Path.exists, files):
        text = planted(
            file,
            mutant["function"],
            mutant["before"],
            mutant["after"],
            int(mutant["number"]),
        )
        if text is not None:
            return file, text
    return None


def seen(tree, mutant, arguments):
    """What becomes of one error."""
    there = place(tree, mutant)
    if there is None:
        return "GONE: its function or expression is no more"
    file, text = there
    whole = file.read_text("utf-8")
    arguments = arguments or mutant["seen_by"].split()
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-x",
        "-q",
        "-n",
        "0",
        "-m",
        "",
        *arguments,
    ]
    file.write_text(text, "utf-8")
    try:
        surroundings = os.environ | {"PYTHONPATH": str(tree), "SIMBRAKE_CACHE_DIR": ""}
        done = subprocess.run(
            command,
            cwd=tree,
            env=surroundings,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
    finally:
        file.write_text(whole, "utf-8")
    if (
        done.returncode == pytest.ExitCode.NO_TESTS_COLLECTED
        or b"file or directory not found" in done.stdout
    ):
        return "NOTHING RUN: no such test"
    return "seen" if done.returncode else "NOT SEEN"


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("word", nargs="?", default="")
    parser.add_argument("--pytest", default="", metavar="ARGUMENTS")
    options = parser.parse_args()
    with (ROOT / "tests" / "mutants.csv").open(encoding="utf-8", newline="") as table:
        mutants = [
            row
            for row in csv.DictReader(table)
            if options.word in " ".join(row.values())
        ]
    missed = 0
    with tempfile.TemporaryDirectory() as folder:
        tree = pathlib.Path(folder) / "tree"
        shutil.copytree(ROOT, tree, ignore=shutil.ignore_patterns(".*", "__pycache__"))
        for mutant in mutants:
            if mutant["unseen_because"]:
                outcome = f"left out: {mutant['unseen_because']}"
            else:
                outcome = seen(tree, mutant, shlex.split(options.pytest))
                missed += outcome != "seen"
            print(
                f"{mutant['module']} {mutant['function']}: {mutant['before'][:50]!r}: {outcome}",
                flush=True,
            )
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main())
