"""Every command named as evidence of a claim tests something; the files of a release
agree."""

import json
import pathlib
import re
import shlex
import subprocess
import sys
import tomllib

import pytest
from readme_lines import claims

import simbrake as sb

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
        if file == "-m":
            module, *options = options
            file = f"{module.replace('.', '/')}/__main__.py"
        source = (ROOT / file).read_text("utf-8")
        assert all(f'"{x}"' in source for x in options if x.startswith("--")), command


def test_files_of_a_release_agree():
    """One version, date and list of dependencies in all files that state them."""
    text = {
        name: (ROOT / name).read_text("utf-8")
        for name in ("CHANGELOG.md", "CITATION.cff", "conda/recipe.yaml")
    }
    code, deposit = (
        json.loads((ROOT / name).read_text("utf-8"))
        for name in ("codemeta.json", ".zenodo.json")
    )
    version, date = re.search(
        r"^## (\S+) \((.+)\)$", text["CHANGELOG.md"], re.M
    ).groups()
    assert version == sb.__version__
    assert f"\nversion: {version}\ndate-released: {date}\n" in text["CITATION.cff"]
    assert (code["version"], code["datePublished"]) == (version, date)
    assert (deposit["version"], deposit["publication_date"]) == (version, date)
    assert f'version: "{version}"' in text["conda/recipe.yaml"]
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    _, listed = text["conda/recipe.yaml"].split("  run:\n    - ")
    found = listed.partition("\n\n")[0].replace(" ", "").split("\n-")
    wanted = ["python" + project["requires-python"], *project["dependencies"]]
    assert [name.replace("matplotlib-base", "matplotlib") for name in found] == wanted
    assert code["keywords"] == deposit["keywords"] == project["keywords"]
