"""The papers' claims: that their page is theirs, and numbers of the quick ones by
formulas written here."""

import importlib.util
import json
import math
import pathlib
import sys

import numpy as np
import pytest
from helpers import near
from scenes import lining_ratio
from scipy.optimize import brentq

ROOT = pathlib.Path(__file__).parents[2]
KEPT = json.loads((ROOT / "docs" / "measured" / "claims.json").read_text("utf-8"))


@pytest.fixture(scope="module")
def claims():
    spec = importlib.util.spec_from_file_location(
        "claims", ROOT / "papers" / "claims.py"
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    path = list(sys.path)
    spec.loader.exec_module(module)
    yield module
    sys.path[:] = path


@pytest.fixture(scope="module")
def quick(claims):
    runs = claims.Runs()
    return {
        one.find.__name__: (one, one.find(runs)) for one in claims.CLAIMS if one.fast
    }


def test_quick_claims_are_as_kept(claims, quick):
    assert len(quick) >= 8
    for one, found in quick.values():
        assert claims.row_of(one, found) in KEPT, (
            "run: python papers/claims.py --write-docs"
        )


def test_rainflow(claims):
    """The example of ASTM E1049, and the range of strain that lasts a given number of
    cycles."""
    ranges = {}
    for size, count in claims.claims_of_stress.rainflow(
        np.asarray([-2.0, 1, -3, 5, 5, -1, 3, -4, 4, -2])
    ):
        ranges[size] = ranges.get(size, 0) + count
    assert ranges == {3: 0.5, 4: 1.5, 6: 0.5, 8: 1.0, 9: 0.5}
    strain = 3.5 * 412e6 / 2.05e11 * 1e5**-0.12 + (-math.log(0.65) / 1e5) ** 0.6
    near(claims.claims_of_stress.cycles_to_crack(strain), 1e5, 1e-9)


def test_numbers_by_hand(quick):
    """Of the layouts, S's radiation and V's resistances."""
    near(
        quick["tight_side"][1].value, lining_ratio(0.2, math.radians(27.0)) ** 9, 1e-12
    )
    # equal increments: 1/z_i = 1/z_n − 2 f (n − i) over the wrap, and a uniform pitch
    # of the same ratio of tensions
    f = 0.4
    steps = np.arange(9, -1, -1)

    def z_n(f):
        return brentq(
            lambda z: 2 * np.arctan(1 / (1 / z - 2 * f * steps)).sum() - 1.5 * math.pi,
            1e-3,
            1 / (2 * f * 9 + f),
        )

    z = 1 / (1 / z_n(f) - 2 * f * steps)
    T = np.cumprod((1 + f * z) / (1 - f * z))
    uneven = np.max((T + np.append(1.0, T[:-1])) * np.sin(np.arctan(z)))
    mu = T[-1] ** 0.1
    highest = T[-1] * (1 + 1 / mu) * math.sin(math.atan((mu - 1) / (mu + 1) / f))
    near(quick["variable_pitch"][1].value, highest / uneven, 1e-9)
    T = 673.15
    h = 0.8 * 5.670374419e-8 * (T**2 + 293.15**2) * (T + 293.15)
    near(quick["governs"][1].value, h, 1e-6)
    flat = lambda r, R, L: math.log(R / r) / (2 * math.pi * L)
    shell = 0.220 / (math.pi * (0.590**2 - 0.565**2))
    behind = (
        flat(0.420, 0.565, 0.035)
        + flat(0.565, 0.615, 0.025)
        + flat(0.575, 0.615, 0.025)
    )
    near(quick["resistance"][1].value, 1 + behind / shell, 1e-12)
