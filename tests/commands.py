"""The command line and Python, as tests call them."""

import contextlib
import io
import os
import subprocess
import sys

import pytest
from helpers import main


def call(capsys, *arguments):
    """Exit code, output and messages of a command."""
    with pytest.raises(SystemExit) as stop:
        main(list(arguments))
    out, err = capsys.readouterr()
    return stop.value.code, out, err


def python(program, *arguments, **environment):
    """A process that runs a program with some more variables in its environment."""
    command = [sys.executable, "-c", program, *map(str, arguments)]
    environment = os.environ | environment
    done = subprocess.run(
        command,
        capture_output=True,
        text=True,
        timeout=300,
        env=environment,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done


def output(*arguments):
    """What a command prints, outside of a test."""
    with (
        contextlib.redirect_stdout(io.StringIO()) as printed,
        contextlib.suppress(SystemExit),
    ):
        main(list(arguments))
    return printed.getvalue()


@pytest.fixture(autouse=True)
def no_cache(monkeypatch):
    monkeypatch.setenv("JAX_COMPILATION_CACHE_DIR", "")
