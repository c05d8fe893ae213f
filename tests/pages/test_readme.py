"""README.md: its length, and the lines that CI runs; every command named as evidence of
a claim tests something."""

import functools
import json
import pathlib
import re
import shlex
import subprocess
import sys

import pytest
from readme_lines import claims, install_and_run, install_and_test

ROOT = pathlib.Path(__file__).parents[2]
README = (ROOT / "README.md").read_text("utf-8")
PAGES = sorted((ROOT / "docs").rglob("*.md"))
CLAIMS = claims((ROOT / "docs" / "claims_and_evidence.md").read_text("utf-8"))
#: selects the tests marked slow as well
ALL = ["-m", "slow or not slow"]


def pytest_arguments(command: str) -> list[str] | None:
    name, *arguments = shlex.split(command)
    return arguments if name == "pytest" and "--nbmake" not in arguments else None


@functools.cache
def collected() -> dict[tuple[str, ...], set[str]]:
    """The tests of every pytest command of the claims and docs, as it stands and with
    the slow ones."""
    named = [command for row in CLAIMS for command in row]
    named += [
        one
        for page in PAGES
        for one in re.findall(r"`(pytest [^`]+)`", page.read_text("utf-8"))
    ]
    wanted = [
        arguments
        for command in dict.fromkeys(named)
        if (arguments := pytest_arguments(command)) is not None
    ]
    wanted += [[*arguments, *ALL] for arguments in wanted if "-m" not in arguments]
    program = [sys.executable, str(ROOT / "tests" / "collect_tests.py")]
    done = subprocess.run(
        program,
        input=json.dumps(wanted),
        capture_output=True,
        text=True,
        cwd=ROOT,
        check=True,
    )
    found = json.loads(done.stdout.splitlines()[-1])
    return {
        tuple(arguments): set(names)
        for arguments, names in zip(wanted, found, strict=True)
    }


@pytest.mark.slow
def test_evidence_commands_collect_tests():
    assert len(collected()) > 60
    assert not [
        " ".join(arguments) for arguments, names in collected().items() if not names
    ]


@pytest.mark.slow
def test_no_claim_leaves_its_slow_tests_out():
    """What `-m 'not slow'` of the configuration deselects is named by another command
    of the same row."""
    for row in CLAIMS:
        lists = [
            arguments
            for command in row
            if (arguments := pytest_arguments(command)) is not None
        ]
        selected = set().union(*(collected()[tuple(arguments)] for arguments in lists))
        for arguments in lists:
            if "-m" not in arguments:
                assert collected()[(*arguments, *ALL)] <= selected, row


def test_scripts_of_the_claims_exist():
    scripts = [
        shlex.split(re.sub(r"[\[\]]", "", x))
        for row in CLAIMS
        for x in row
        if x.startswith("python ")
    ]
    assert scripts
    for _, file, *options in scripts:
        source = (ROOT / file).read_text("utf-8")
        assert not [
            name
            for name in options
            if name.startswith("--") and f'"{name}"' not in source
        ]


@pytest.mark.parametrize("line", [install_and_run, install_and_test])
def test_lost_or_doubled_set_up_line(line):
    text = line(README)
    assert text.startswith("pip install -e ")
    for broken in (
        README.replace(text, text + " --quick"),
        README.replace(text, f"{text}\n{text}"),
        "",
    ):
        with pytest.raises(ValueError, match=r"README\.md: [02] lines"):
            line(broken)
