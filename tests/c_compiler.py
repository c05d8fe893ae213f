"""The C compiler of the machine, and what it makes of a file."""

import ctypes
import shutil
import subprocess

import pytest

COMPILER = shutil.which("gcc") or shutil.which("cc")
FLAGS = [
    "-O2",
    "-std=c99",
    "-ffp-contract=off",
    "-Wall",
    "-Werror",
    "-Wno-unused",
    "-Wno-tautological-compare",
]
#: marks of a file of tests that need it
NEEDED = [
    pytest.mark.slow,
    pytest.mark.skipif(COMPILER is None, reason="no C compiler"),
]


def library_of(file):
    """The library that a file of C makes."""
    library = file.with_suffix(".so")
    asked = [COMPILER, *FLAGS, "-shared", "-fPIC", "-o", library, file, "-lm"]
    subprocess.run(asked, check=True)
    return ctypes.CDLL(str(library))
