"""What must pass before a change is merged: `nox` runs it, `nox -s NAME` one session,
`nox -l` lists them all.

The sessions marked nightly take much longer and are not in the default:
`.ci/run nightly` runs everything. An interpreter that is missing fails the run, unless
`SIMBRAKE_CI_WITHOUT="3.12 3.13"` excludes it by name, and all its sessions with it. The
first of each kind, as listed here, takes longest: `.ci/run` puts the others beside it.
"""

import os
import pathlib
import sys
import tempfile

import nox

ROOT = pathlib.Path(__file__).parent
sys.path.insert(0, str(ROOT / "tests"))

from readme_lines import install_and_run, install_and_test  # noqa: E402

PYTHONS = ["3.11", "3.12", "3.13"]  # as the classifiers of pyproject.toml
OLDEST = "3.11"  # that .ci/oldest.txt is made for
NEWEST = "3.13"  # that the newest libraries come for first
MAIN = "3.11"  # runs all tests, and so needs no smoke session
WHEEL = "3.13"

excluded = os.environ.get("SIMBRAKE_CI_WITHOUT", "").split()
if unknown := set(excluded) - set(PYTHONS):
    sys.exit(
        f"SIMBRAKE_CI_WITHOUT names {', '.join(sorted(unknown))}; known are {', '.join(PYTHONS)}"
    )

nox.options.default_venv_backend = "venv"
nox.options.error_on_missing_interpreters = True
nox.options.sessions = []  # those of a day
OTHERS = [python for python in PYTHONS if python not in (MAIN, *excluded)]


def on(*pythons: str, daily: bool = True):
    """Makes a function a session on these Pythons, or none on those that are
    excluded."""

    def session(function):
        left = [python for python in pythons if python not in excluded]
        if left and daily:
            nox.options.sessions += [function.__name__]
        return nox.session(python=left)(function) if left else function

    return session


#: a skipped test is a failure: what it needs must be installed
NO_SKIPS = {"PYTEST_ADDOPTS": "--no-skips"}


def readme_line(session: nox.Session, find) -> None:
    """Run a line of README.md as it stands there, in the environment of the session."""
    line = find((ROOT / "README.md").read_text("utf-8"))
    session.run("bash", "-euo", "pipefail", "-c", line, external=True, env=NO_SKIPS)


def of_the_tests(session: nox.Session) -> dict[str, str]:
    """Variables by which other processes compile as the tests do, and use the programs
    that these have compiled."""
    cache = ROOT / ".pytest_cache"
    flags = session.run("python", "tests/compile_flags.py", str(cache), silent=True)
    return {
        "XLA_FLAGS": str(flags).strip(),
        "JAX_COMPILATION_CACHE_DIR": str(cache / "programs"),
        "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0",
        "JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES": "-1",
    }


@on(MAIN)
def main(session: nox.Session) -> None:
    """The two lines of README.md: the main job, and the tests."""
    readme_line(session, install_and_run)
    readme_line(session, install_and_test)


@on(*OTHERS)
def smoke(session: nox.Session) -> None:
    """What pip finds for each Python: the first line of README.md, and tests that touch
    every part. In the first of these environments, as another one would cost a minute,
    style and types too."""
    readme_line(session, install_and_run)
    session.install("-e", ".[test]")
    session.run("pytest", "-m", "smoke", "tests", env=NO_SKIPS)
    if session.python == OTHERS[0]:
        check_style(session)


def check_style(session: nox.Session) -> None:
    session.install("-e", ".[lint]")
    session.run("ruff", "check", ".")
    session.run("ruff", "format", "--check", ".")
    session.run("pyright")


@on(MAIN, daily=False)
def slow(session: nox.Session) -> None:
    """Nightly: the slow tests, with the peers of the benchmarks and the libraries of
    the recipes."""
    session.install("-e", ".[test,bench,recipes]")
    session.run(
        "pytest",
        "-m",
        "slow",
        "tests",
        "--ignore",
        "tests/pages/test_examples.py",
        env=NO_SKIPS,
    )


@on(MAIN, daily=False)
def rest(session: nox.Session) -> None:
    """Nightly: files and commands, pages and figures, validation and benchmarks."""
    session.install("-e", ".[test,bench,live]")
    session.run(
        "pytest",
        "tests/files",
        "tests/pages",
        "tests/validation",
        "tests/internals",
        env=NO_SKIPS,
    )


@on(MAIN, daily=False)
def recipes(session: nox.Session) -> None:
    """Nightly: the scripts of docs/recipes with other libraries, in a folder of their
    own."""
    session.install(".[recipes]")
    with tempfile.TemporaryDirectory() as folder:
        session.chdir(folder)
        for script in sorted((ROOT / "docs" / "recipes").glob("*.py")):
            session.run("python", str(script))


@on(OLDEST, daily=False)
def oldest(session: nox.Session) -> None:
    """Nightly: the oldest versions that pyproject.toml admits."""
    session.install("-e", ".[test]", "-c", ".ci/oldest.txt")
    session.run("simbrake", "run", "scenarios/u2_5_5_stop.py")
    # the newest indirect dependencies deprecate what the oldest direct ones call
    session.run("pytest", "-m", "smoke", "-W", "default", "tests", env=NO_SKIPS)


@on(NEWEST, daily=False)
def newest(session: nox.Session) -> None:
    """Nightly: the newest version of everything, also beyond the bounds of
    pyproject.toml."""
    session.install("-e", ".[test]")
    session.install(
        "--upgrade", "jax", "diffrax", "equinox", "numpy", "scipy", "xarray"
    )
    session.run("simbrake", "run", "scenarios/u2_5_5_stop.py")
    session.run("pytest", "-m", "smoke", "-W", "default", "tests", env=NO_SKIPS)


@on(WHEEL, daily=False)
def wheel(session: nox.Session) -> None:
    """Nightly: the wheel made from the sdist, in an environment and a folder of its
    own, with the options of users."""
    session.install("build")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        session.run("python", "-m", "build", "--outdir", name, ".")
        (file,) = folder.glob("*.whl")
        session.run("python", "-m", "venv", str(folder / "env"))
        python = str(folder / "env" / "bin" / "python")
        session.run(
            python, "-m", "pip", "install", "-q", f"{file}[test]", external=True
        )
        session.chdir(folder)
        session.run(
            python,
            str(ROOT / ".ci" / "check_installed.py"),
            str(ROOT),
            external=True,
            env={"PYTHONPATH": ""},
        )
        tests = [
            python,
            "-m",
            "pytest",
            "-c",
            str(ROOT / "pyproject.toml"),
            "-m",
            "smoke",
            str(ROOT / "tests"),
        ]
        users = {"PYTHONPATH": "", "PYTHONSAFEPATH": "1", "SIMBRAKE_USER_OPTIONS": "1"}
        session.run(*tests, external=True, env=NO_SKIPS | users)


@on(MAIN, daily=False)
def docs(session: nox.Session) -> None:
    """Nightly: the pages, their examples, the printed tables, the notebooks."""
    session.install("-e", ".[dev]")
    session.run("python", "docs/tables.py", "--check")
    session.run(
        "sphinx-build", "-q", "-W", "--keep-going", "-b", "html", "docs", "build/docs"
    )
    session.run("python", "papers/reproduce.py", silent=True)
    session.run("python", "papers/measured.py", silent=True)
    # the examples of the docs call nearly everything between them: here shapes and
    # types of every call are checked
    checked = NO_SKIPS | {"SIMBRAKE_CHECK_TYPES": "1"}
    session.run(
        "pytest",
        "-m",
        "slow",
        "--dist",
        "load",
        "tests/pages/test_examples.py",
        env=checked,
    )
    session.run(
        "pytest",
        "--nbmake",
        "--nbmake-timeout=600",
        "notebooks",
        env=of_the_tests(session),
    )


@on(MAIN, daily=not OTHERS)
def lint(session: nox.Session) -> None:
    """Style, format and types, in an environment of their own."""
    check_style(session)
