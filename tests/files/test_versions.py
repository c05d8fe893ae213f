"""Versions of packages: the bounds in pyproject.toml, the oldest versions that CI runs,
the warning at newer ones."""

import pathlib
import re
import tomllib

import pytest
from commands import python
from packaging.requirements import Requirement
from packaging.version import Version

ROOT = pathlib.Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
EXTRAS = PROJECT["optional-dependencies"]
TESTED = [
    Requirement(text)
    for text in (
        *PROJECT["dependencies"],
        *(text for name in ("ensemble", "test") for text in EXTRAS[name]),
    )
    if not text.startswith("simbrake")
]


def bounds(requirement, operator):
    return [one.version for one in requirement.specifier if one.operator == operator]


def test_every_lower_bound_is_run_by_ci():
    """The constraints of the job with the oldest versions pin every direct dependency
    at its lower bound."""
    text = (ROOT / ".ci" / "oldest.txt").read_text("utf-8")
    pins = dict(re.findall(r"^([\w-]+)==(\S+)$", text, re.M))
    assert "://" not in text
    for requirement in TESTED:
        (lowest,) = bounds(requirement, ">=")
        assert Version(pins[requirement.name.lower()]) == Version(lowest), requirement


(FIRST,) = (Version(bounds(one, "<")[0]).release for one in TESTED if one.name == "jax")


@pytest.mark.parametrize(
    ("version", "lines"),
    [
        ((FIRST[0], FIRST[1] - 1, 9), 0),
        pytest.param((*FIRST, 0), 1, marks=pytest.mark.smoke),
        ((1, 0, 0), 1),
    ],
)
def test_newer_jax_than_tested_warns(version, lines):
    """A user's process: importing the package alone says nothing, the first name that
    needs JAX does, once."""
    program = f"""
import jax, sys
jax.__version_info__ = {version}
import simbrake as sb
print("imported", file=sys.stderr)
sb.Scene, sb.simulate, sb.ensemble
"""
    first, *warned = python(program).stderr.splitlines()
    assert first == "imported"
    assert len(warned) == lines
    for line in warned:
        assert (
            f"JAX {'.'.join(map(str, version))} is newer than simbrake was tested with"
            in line
        )
