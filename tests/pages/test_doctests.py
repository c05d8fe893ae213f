"""The examples in docstrings give what they say; every part at the top has one, and
what runs in a moment."""

import doctest
import inspect
import math
import types

import numpy as np
import pytest
import rig_recordings
from picture_scenes import small_stop

import simbrake as sb


def public():
    named = (getattr(sb, name) for name in sb.__all__)
    # (examples of figures have more to draw: test_figures.py)
    homes = [
        sb,
        *(
            home
            for home in named
            if isinstance(home, types.ModuleType) and home is not sb.plot
        ),
    ]
    return {
        name: getattr(home, name)
        for home in homes
        for name in getattr(home, "__all__", ())
    }


EXAMPLES = {
    name: one
    for name, one in public().items()
    if ">>>" in (inspect.getdoc(one) or "") and callable(one)
}


@pytest.fixture(scope="module")
def given():
    """What the examples have: a small stop under a hook load, its result, and the
    ledger of a recording."""
    scene = small_stop()
    book = rig_recordings.book()
    return {
        "sb": sb,
        "np": np,
        "math": math,
        "scene": scene,
        "result": sb.simulate(scene),
        "book": book,
    }


@pytest.mark.parametrize("name", EXAMPLES)
def test_example(name, given):
    (test,) = doctest.DocTestFinder(recurse=False).find(
        EXAMPLES[name], name, globs=dict(given)
    )
    said = []
    # a long result is wrapped in the docstring
    runner = doctest.DocTestRunner(
        verbose=False, optionflags=doctest.NORMALIZE_WHITESPACE
    )
    failed, tried = runner.run(test, out=said.append)
    assert tried
    assert not failed, "".join(said)
