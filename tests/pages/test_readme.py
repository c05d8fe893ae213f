"""Every command named as evidence of a claim tests something."""

import json
import pathlib
import re
import shlex
import subprocess
import sys

import pytest
from readme_lines import claims

ROOT = pathlib.Path(__file__).parents[2]
CLAIMS = claims((ROOT / "docs" / "claims_and_evidence.md").read_text("utf-8"))


@pytest.mark.slow
def test_evidence_commands_collect_tests():
    named = [command for row in CLAIMS for command in row]
    for page in sorted((ROOT / "docs").rglob("*.md")):
        named += re.findall(r"`(pytest [^`]+)`", page.read_text("utf-8"))
    wanted = [
        shlex.split(command)[1:]
        for command in dict.fromkeys(named)
        if command.startswith("pytest ") and "--nbmake" not in command
    ]
    assert len(wanted) > 50
    done = subprocess.run(
        [sys.executable, str(ROOT / "tests" / "collect_tests.py")],
        input=json.dumps(wanted),
        capture_output=True,
        text=True,
        cwd=ROOT,
        check=True,
    )
    found = json.loads(done.stdout.splitlines()[-1])
    assert [
        " ".join(one) for one, names in zip(wanted, found, strict=True) if not names
    ] == []


def test_scripts_of_the_claims_exist():
    for command in {x for row in CLAIMS for x in row if x.startswith("python ")}:
        _, file, *options = shlex.split(re.sub(r"[\[\]]", "", command))
        source = (ROOT / file).read_text("utf-8")
        assert all(f'"{x}"' in source for x in options if x.startswith("--")), command
