"""Parts of the integrator: bordered systems, roots inside a step."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from helpers import all_near, near

from simbrake.hybrid import CORE, LINEAR, _bordered
from simbrake.hybrid._search import first_root


@pytest.mark.parametrize(("m", "n"), [(0, 7), (3, 0), (3, 19), (20, 4)])
def test_bordered_systems_against_dense_ones(m, n):
    rng = np.random.default_rng(m + 100 * n)
    # layers from thin to thick: conductances over many powers of ten, as in a wall with
    # a fine surface
    g = 10.0 ** rng.uniform(-3, 6, n)
    lower = -g * np.arange(n).clip(0, 1)
    upper = -np.append(g[1:], np.zeros(int(n > 0)))
    diagonal = 1 - lower - upper
    core = rng.normal(size=(m, m)) * 10.0 ** rng.uniform(
        -4, 4, (m, 1)
    )  # pivots are not where they are at first
    right = rng.normal(size=(m, n))
    below = rng.normal(size=(n, m))
    a = _bordered.Bordered(
        *(jnp.asarray(x) for x in (core, right, below, lower, diagonal, upper))
    )
    dense = np.zeros((m + n, m + n))
    dense[:m, :m] = core
    dense[:m, m:] = right
    dense[m:, :m] = below
    if n:
        dense[m:, m:] = (
            np.diag(diagonal) + np.diag(lower[1:], -1) + np.diag(upper[:-1], 1)
        )
    b = rng.normal(size=m + n)
    for matrix, whole in ((a, dense), (a.transposed, dense.T)):
        x = np.asarray(_bordered.solve(_bordered.factor(matrix), jnp.asarray(b)))
        size = np.abs(whole) @ np.abs(x) + np.abs(b)
        assert (
            np.max(np.abs(whole @ x - b) / size) < 1e-12
        )  # backward error, row by row
        all_near(x, np.linalg.solve(whole, b), 1e-8, 1e-12)


def bordered_rates(m, n, constant, seed=3):
    """Rates whose chain rows are linear where `constant`, over states core, then chain;
    the rest is not, and moves with time."""
    rng = np.random.default_rng(seed)
    a = rng.normal(size=(m + n, m + n))
    i = np.arange(n)
    a[m:, m:] *= np.abs(i[:, None] - i) < 2  # neighbours in the chain
    a = jnp.asarray(a)
    bend = jnp.asarray(np.append(np.ones(m), 1.0 - np.asarray(constant, float)))
    return lambda t, x: a @ x + bend * jnp.sin(a @ x + t)


@pytest.mark.parametrize("constant", [(), (0, 1, 2, 3, 4, 5, 6, 7), (1, 2, 3, 5, 6)])
def test_rows_formed_once_are_the_dense_ones(constant):
    m = 4
    n = 8
    linear = np.isin(np.arange(n), constant)
    kinds = np.append(np.full(m, CORE), np.arange(n) + LINEAR * linear)
    places = _bordered.Couplings.of(kinds)
    assert places == _bordered.Couplings(
        tuple(range(m)), tuple(range(m, m + n)), (), tuple(linear.tolist())
    )
    f = bordered_rates(m, n, linear)
    rng = np.random.default_rng(8)
    there, here = rng.normal(size=(2, m + n))
    known = _bordered.linear_rows(jax.linearize(f, 0.0, there)[1], places)
    found, drift = _bordered.jacobian(jax.linearize(f, 0.3, here)[1], places, known)
    by_time, dense = (np.asarray(x) for x in jax.jacfwd(f, argnums=(0, 1))(0.3, here))
    all_near(drift, by_time, 1e-14)
    all_near(found.core, dense[:m, :m], 1e-14)
    all_near(found.right, dense[:m, m:], 1e-14)
    all_near(found.below, dense[m:, :m], 1e-14)
    chain = (
        np.diag(found.diagonal)
        + np.diag(found.lower[1:], -1)
        + np.diag(found.upper[:-1], 1)
    )
    all_near(chain, dense[m:, m:], 1e-14)


def test_first_root_of_a_cubic_to_rounding():
    # cubics with one crossing in (0, 1), against the roots of their polynomials
    rng = np.random.default_rng(3)
    checked = 0
    root = jax.jit(first_root)
    for c in rng.normal(size=(200, 4)):
        roots = np.roots(c)
        inside = np.sort(
            roots[
                (np.abs(roots.imag) < 1e-12) & (roots.real > 0) & (roots.real < 1)
            ].real
        )
        if len(inside) != 1 or c[3] <= 1e-3:
            continue
        ends = (c[3], c[2], np.sum(c), 3 * c[0] + 2 * c[1] + c[2])
        found = root(*(np.asarray([x]) for x in ends))
        near(found[0], inside[0], abs=1e-12 / abs(np.polyval(np.polyder(c), inside[0])))
        checked += 1
    assert checked > 30
