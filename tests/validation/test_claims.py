"""The papers' claims: that their page is theirs, and numbers of the quick ones by
formulas written here."""

import importlib.util
import json
import math
import pathlib
import sys

import numpy as np
import pytest
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


def test_every_claim_is_kept(claims):
    assert len(claims.CLAIMS) >= 16
    assert {one.paper for one in claims.CLAIMS} == set(claims.PAPERS)
    ordered = sorted(
        claims.CLAIMS, key=lambda one: list(claims.PAPERS).index(one.paper)
    )
    for kept, one in zip(KEPT, ordered, strict=True):
        assert kept["claim"].startswith(one.words), (
            "run: python papers/claims.py --write-docs"
        )
        assert kept["place"] == one.place
    page = claims.page(KEPT)
    assert page.startswith(
        "42 claims: 15 confirmed, 20 confirmed within limits, 7 contradicted."
    )
    assert all(line.count(" | ") == 3 for line in page.splitlines() if "**" in line)
    last = page.partition("## Claims without a run")[2].strip().splitlines()
    assert last == [f"- {line}" for line in claims.unsaid()]
    assert {line[0] for line in claims.unsaid()} == set(claims.PAPERS)


def test_quick_claims_are_as_kept(claims, quick):
    assert len(quick) >= 8
    for one, found in quick.values():
        assert claims.row_of(one, found) in KEPT, (
            "run: python papers/claims.py --write-docs"
        )


def rise(f, angle):
    """Tensions at the two sides of a sliding lining."""
    return (1 + f * math.tan(angle / 2)) / (1 - f * math.tan(angle / 2))


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
    assert claims.claims_of_stress.cycles_to_crack(strain) == pytest.approx(
        1e5, rel=1e-9
    )


def test_numbers_by_hand(quick):
    """Of the layouts, S's radiation and V's resistances."""
    fz = 0.2 * math.tan(math.radians(13.5))
    assert quick["tight_side"][1].value == pytest.approx(
        ((1 + fz) / (1 - fz)) ** 9, rel=1e-12
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
    assert quick["variable_pitch"][1].value == pytest.approx(highest / uneven, rel=1e-9)
    edge = [
        x / -math.expm1(-x) / arc
        for arc in (27.0, 54.0)
        for x in [math.log(rise(0.3, math.radians(arc)))]
    ]
    assert quick["edges"][1].value == pytest.approx(edge[1] / edge[0], rel=1e-12)
    T = 673.15
    h = 0.8 * 5.670374419e-8 * (T**2 + 293.15**2) * (T + 293.15)
    assert quick["governs"][1].value == pytest.approx(h, rel=1e-6)
    flat = lambda r, R, L: math.log(R / r) / (2 * math.pi * L)
    shell = 0.220 / (math.pi * (0.590**2 - 0.565**2))
    behind = (
        flat(0.420, 0.565, 0.035)
        + flat(0.565, 0.615, 0.025)
        + flat(0.575, 0.615, 0.025)
    )
    assert quick["resistance"][1].value == pytest.approx(1 + behind / shell, rel=1e-12)
    arcs = quick["sliding_arc"][1].value  # Z's table 1
    assert arcs == pytest.approx(244.6 / 134.5, rel=2e-3)
    assert quick["fourier"][1].value < 15
    f = 0.35
    half = np.full(10, math.radians(27.0))
    T = np.cumprod([rise(f, angle) for angle in half])
    N = T + np.append(1.0, T[:-1])
    worn = N / np.repeat([N[:5].mean(), N[5:].mean()], 5)
    assert quick["branches"][1].value == pytest.approx(
        worn.max() / worn.min(), rel=1e-12
    )
    z = 1 / (1 / z_n(0.3) - 2 * 0.3 * steps)
    T = np.cumprod((1 + 0.3 * z) / (1 - 0.3 * z))
    beta = 2 * np.arctan(z)
    p = (T + np.append(1.0, T[:-1])) * np.sin(beta / 2) / beta
    assert quick["areas"][1].value == pytest.approx(p.max() / p.min(), rel=1e-9)
    assert quick["two_surfaces"][1].value == pytest.approx(1.0, rel=1e-12)
    assert quick["larger_area"][1].value == 1.0
    assert np.isfinite([found.value for _, found in quick.values()]).all()
