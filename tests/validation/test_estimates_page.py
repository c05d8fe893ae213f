"""The tables of docs/estimates.md are what the estimates and simulations give, and say
what the page says of them."""

import json
import pathlib
import re
import sys

import pytest
from helpers import near
from printed_tables import agrees

import simbrake as sb

DOCS = pathlib.Path(sb.__file__).parents[1] / "docs"
NUMBER = re.compile(r"(?<![\w.])[−-]?\d+(?:\.\d+)?(?:e[+-]\d+)?")


@pytest.fixture(scope="module")
def page():
    """The script that writes the tables."""
    sys.path.insert(0, str(DOCS))
    import make_estimates

    yield make_estimates
    sys.path.remove(str(DOCS))


def on_page(page, name):
    return json.loads(page.NUMBERS.read_text("utf-8"))[name]


def assert_same(found, printed):
    """The same words, and numbers within their last place: runs on other machines
    differ by rounding."""
    found, printed = (json.dumps(one, ensure_ascii=False) for one in (found, printed))
    assert NUMBER.sub("#", found) == NUMBER.sub("#", printed)
    for now, then in zip(NUMBER.findall(found), NUMBER.findall(printed), strict=True):
        same = (
            float(now) == pytest.approx(float(then), rel=0.02)
            if "e" in then
            else agrees(then, float(now))
        )
        assert same, (now, then)


def test_schmidt_and_network_errors(page):
    """Two rows anew; the orders of all."""
    rows = on_page(page, "order")[0]["rows"]
    assert [int(row[0]) for row in rows] == list(page.LAYERS)
    for row in rows[:2]:
        printed = [float(row[i]) for i in (1, 3, 5)]
        near(page.schmidt_errors(int(row[0])), printed, 0.02)
    for row in rows[1:]:
        near([float(row[i]) for i in (2, 4, 6)], [2.0] * 3, abs=0.05)


@pytest.mark.slow
def test_estimates_of_stop_and_stands(page):
    made = page.parts()
    assert_same(made, on_page(page, "parts"))


@pytest.mark.slow
def test_estimates_of_the_staged_brake(page):
    assert_same(page.staged(), on_page(page, "staged"))
