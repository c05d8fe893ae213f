"""Recipes with other libraries, by what these find; `nox -s recipes` runs all
scripts."""

import pathlib
import runpy

import numpy as np
import pytest

RECIPES = pathlib.Path(__file__).parents[2] / "docs" / "recipes"


@pytest.mark.slow
def test_sobol_and_morris_indices():
    """As simbrake's own functions computed them before they were removed (friction,
    load, speed)."""
    salib = pytest.importorskip("SALib.analyze.morris")
    found = runpy.run_path(str(RECIPES / "global_indices.py"))
    run = found["run"]
    shares = found["shares"]
    effects = found["effects"]
    np.testing.assert_allclose(
        shares["S1"],
        [0.7967177855880134, 0.11857571112057518, 0.03054379865408016],
        rtol=1e-12,
    )
    np.testing.assert_allclose(
        shares["ST"],
        [0.8456862104869378, 0.14875798657430017, 0.03854156274073079],
        rtol=1e-12,
    )
    mu = [-1.2630814709214415, 0.4490472694656421, 0.2949923856829302]
    sigma = [0.5726160556789935, 0.33339439213686656, 0.14441690914795507]
    np.testing.assert_allclose(
        [effects["mu"], effects["sigma"]], [mu, sigma], rtol=3e-9
    )
    # (those stayed 2⁻³¹ inside of the ranges)
    (low, high) = run.bounds.T
    X = found["X"]
    inside = low + (high - low) * np.clip(
        (X - low) / (high - low), 2.0**-31, 1.0 - 2.0**-31
    )
    effects = salib.analyze(found["problem"], X, run.evaluate(inside)[:, 0], seed=3)
    np.testing.assert_allclose(
        [effects["mu"], effects["sigma"]], [mu, sigma], rtol=1e-12
    )
