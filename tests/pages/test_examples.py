"""Every example of README and docs runs: fenced Python blocks page by page, and shell
lines with simbrake commands.

A page's blocks run one after the other in one namespace, so that a later one may use
what an earlier one made. A plain block right after a Python block is what that prints;
`…` stands for anything.
"""

import doctest
import os
import pathlib
import re
import shlex

import jax
import pytest
from helpers import main

ROOT = pathlib.Path(__file__).parents[2]
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])
#: pages that take more than some ten seconds to compile and run
SLOW = {
    f"docs/{name}.md"
    for name in (
        "calibration",
        "decision",
        "ensembles",
        "estimates",
        "extending",
        "first_steps",
        "jax",
        "recipes",
        "report",
        "rig_logs",
        "sensitivity",
        "typical_values",
        "uncertainty",
        "chain",
        "accuracy_and_speed",
        "verdict",
        "wear",
    )
}
#: what shell blocks may hold and is not run here: the set-up, measurements of an hour,
#: a server, what needs an extra
NOT_RUN = (
    "pip install",
    "pytest",
    "python benchmarks/",
    "python papers/",
    "python tests/",
    "simbrake app ",
)
NOT_RUN += ("cc ", "./stop", "simbrake publish ")


def blocks(page, language):
    return re.findall(
        rf"^```{language}\n(.*?)^```", page.read_text("utf-8"), re.S | re.M
    )


def examples(page):
    """Python blocks of a page, each with what it prints as far as the page shows
    that."""
    return re.findall(
        r"^```python\n(.*?)^```\n(?:\n```\n(.*?)^```)?",
        page.read_text("utf-8"),
        re.S | re.M,
    )


def name_of(page):
    return page.relative_to(ROOT).as_posix()


def commands(page):
    """Commands of the shell blocks of a page; `a && b` are two."""
    lines = [
        line
        for block in blocks(page, "sh")
        for line in block.replace("\\\n", " ").splitlines()
    ]
    return [
        part.strip() for line in lines for part in line.split(" && ") if part.strip()
    ]


def simbrake_commands(page):
    return [
        text
        for text in commands(page)
        if text.startswith("simbrake ") and not text.startswith(NOT_RUN)
    ]


EXAMPLES = [page for page in PAGES if blocks(page, "python") or simbrake_commands(page)]


def test_recipes_are_short_and_shown():
    """`nox -s recipes` runs them, with the libraries that they need."""
    page = (ROOT / "docs" / "recipes.md").read_text("utf-8")
    scripts = sorted((ROOT / "docs" / "recipes").glob("*.py"))
    shown = re.findall(r"^```{literalinclude} recipes/(\w+\.py)$", page, re.M)
    assert sorted(shown) == [script.name for script in scripts]
    for script in scripts:
        lines = [line.strip() for line in script.read_text("utf-8").splitlines()]
        code = [line for line in lines if line and not line.startswith(("#", '"""'))]
        assert len(code) <= 30, script.name


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder of its own with the scenarios in it, as the root of the repository has
    them."""
    (tmp_path / "scenarios").symlink_to(ROOT / "scenarios")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("JAX_COMPILATION_CACHE_DIR", "")
    # examples are written for JAX as it comes: mixed types are no error there
    with jax.numpy_dtype_promotion("standard"):
        yield tmp_path


def save_files(page, folder):
    """Files that a page tells its reader to save a block as."""
    text = page.read_text("utf-8")
    for name, block in re.findall(
        r"[Ss]ave this as `(\w+\.\w+)`.*?^```(?:python|toml|text)\n(.*?)^```",
        text,
        re.S | re.M,
    ):
        (folder / name).write_text(block, "utf-8")


def test_all_shell_blocks_are_looked_at():
    assert not [
        text
        for page in PAGES
        for text in commands(page)
        if not text.startswith(("simbrake ", *NOT_RUN))
    ]


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(
            page,
            id=name_of(page),
            marks=[pytest.mark.slow] if name_of(page) in SLOW else [],
        )
        for page in EXAMPLES
    ],
)
def test_examples_of(page, folder, capsys):
    save_files(page, folder)
    space = {"__name__": "example"}
    for number, (block, shown) in enumerate(examples(page), 1):
        exec(compile(block, f"{name_of(page)}, block {number}", "exec"), space)
        printed = capsys.readouterr().out
        wanted = shown.replace("…", "...")
        assert not shown or doctest.OutputChecker().check_output(
            wanted, printed, doctest.ELLIPSIS
        ), printed
    for text in simbrake_commands(page):
        capsys.readouterr()
        with pytest.raises(SystemExit) as stop:
            main(shlex.split(text, comments=True)[1:])
        out, err = capsys.readouterr()
        assert stop.value.code == 0, f"{text}: {out} {err}"
        assert out, text
        assert all(
            (folder / name).is_file() or os.listdir(folder / name)
            for name in re.findall(r"--out (\S+)", text)
        ), text
