"""What makes the loops of the engine fast: entries as slices, bordered systems, constant rows formed once."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from heat_scenes import layered_stop
from helpers import assemble

import simbrake as sb
from simbrake.hybrid import CORE, LINEAR, _arrays, _bordered, _system, largest, smallest
from simbrake.results import BandMode


def test_entries_as_slices():
    rng = np.random.default_rng(5)
    x, places = rng.normal(size=9), (7, 8, 0, 3, 4)
    np.testing.assert_array_equal(_arrays.take(jnp.asarray(x), places), x[list(places)])
    values, expected = rng.normal(size=5), x.copy()
    expected[list(places)] = values
    np.testing.assert_array_equal(_arrays.put(jnp.asarray(x), places, jnp.asarray(values)), expected)
    assert _arrays.take(jnp.asarray(x), ()).shape == (0,)


def test_largest_entry_and_its_derivative():
    x, d = jnp.asarray([1.0, 3.0, -2.0, 3.0]), jnp.asarray([0.1, 0.2, 0.3, 0.4])
    for find, value, slope in ((largest, 3.0, 0.2), (smallest, -2.0, 0.3)):
        found = jax.jvp(find, (x,), (d,))
        assert (float(found[0]), float(found[1])) == (value, slope)
        np.testing.assert_array_equal(jax.grad(find)(x), np.asarray(d == slope, float))
        assert np.isnan(find(x.at[2].set(jnp.nan)))


@pytest.mark.parametrize(("m", "n"), [(0, 7), (3, 0), (1, 1), (3, 19), (5, 64), (20, 4)])
def test_bordered_systems_against_dense_ones(m, n):
    rng = np.random.default_rng(m + 100 * n)
    # layers from thin to thick: conductances over many powers of ten, as in a wall with a fine surface
    g = 10.0 ** rng.uniform(-3, 6, n)
    lower, upper = -g * np.arange(n).clip(0, 1), -np.append(g[1:], np.zeros(int(n > 0)))
    diagonal = 1 - lower - upper
    core = rng.normal(size=(m, m)) * 10.0 ** rng.uniform(-4, 4, (m, 1))  # pivots are not where they are at first
    right, below = rng.normal(size=(m, n)), rng.normal(size=(n, m))
    a = _bordered.Bordered(*(jnp.asarray(x) for x in (core, right, below, lower, diagonal, upper)))
    dense = np.zeros((m + n, m + n))
    dense[:m, :m], dense[:m, m:], dense[m:, :m] = core, right, below
    if n:
        dense[m:, m:] = np.diag(diagonal) + np.diag(lower[1:], -1) + np.diag(upper[:-1], 1)
    b = rng.normal(size=m + n)
    for matrix, whole in ((a, dense), (a.transposed, dense.T)):
        x = np.asarray(_bordered.solve(_bordered.factor(matrix), jnp.asarray(b)))
        size = np.abs(whole) @ np.abs(x) + np.abs(b)
        assert np.max(np.abs(whole @ x - b) / size) < 1e-12  # backward error, row by row
        np.testing.assert_allclose(x, np.linalg.solve(whole, b), rtol=1e-8, atol=1e-12)


def bordered_rates(m, n, constant, seed=3):
    """Rates whose chain rows are linear where `constant`, over states core, then chain; the rest is not."""
    rng = np.random.default_rng(seed)
    a = rng.normal(size=(m + n, m + n))
    i = np.arange(n)
    a[m:, m:] *= np.abs(i[:, None] - i) < 2  # neighbours in the chain
    a, bend = jnp.asarray(a), jnp.asarray(np.append(np.ones(m), 1.0 - np.asarray(constant, float)))
    return lambda x: a @ x + bend * jnp.sin(a @ x)


@pytest.mark.parametrize("constant", [(), (0, 1, 2, 3, 4, 5, 6, 7), (1, 2, 3, 5, 6), (3,)])
@pytest.mark.parametrize("m", [1, 4])
def test_jacobian_with_rows_formed_once_is_the_dense_one(m, constant):
    n = 8
    linear = np.isin(np.arange(n), constant)
    kinds = np.append(np.full(m, CORE), np.arange(n) + LINEAR * linear)
    places = _bordered.Couplings.of(kinds)
    assert places == _bordered.Couplings(tuple(range(m)), tuple(range(m, m + n)), (), tuple(linear.tolist()))
    f = bordered_rates(m, n, linear)
    rng = np.random.default_rng(8)
    there, here = rng.normal(size=(2, m + n))
    known = _bordered.linear_rows(jax.linearize(f, there)[1], places)
    found = _bordered.jacobian(jax.linearize(f, here)[1], places, known)
    dense = np.asarray(jax.jacfwd(f)(here))
    np.testing.assert_allclose(found.core, dense[:m, :m], rtol=1e-14)
    np.testing.assert_allclose(found.right, dense[:m, m:], rtol=1e-14)
    np.testing.assert_allclose(found.below, dense[m:, :m], rtol=1e-14)
    chain = np.diag(found.diagonal) + np.diag(found.lower[1:], -1) + np.diag(found.upper[:-1], 1)
    np.testing.assert_allclose(chain, dense[m:, m:], rtol=1e-14)


@pytest.mark.slow
def test_rows_marked_as_linear_are_the_same_in_every_state_and_mode():
    """Layers within walls of constant properties, and no others."""
    scene = layered_stop()
    steel = sb.Material(48.0, 7800.0, 500.0)
    fading_steel = sb.Material(48.0, 7800.0, 500.0, conductivity_slope=-5e-4)
    more = (
        sb.thermal.Wall("pair", steel, 0.02, 0.1, 4, 1.5, copies=2),
        sb.thermal.Wall("hot", fading_steel, 0.02, 0.1, 5),
    )
    links = (sb.thermal.Convection("pair.back", 0.1, 20.0), sb.thermal.Radiation("hot.front", 0.1, 0.8))
    heat = dataclasses.replace(scene.heat, bodies=scene.heat.bodies + more, links=scene.heat.links + links)
    system, y, mode = assemble(dataclasses.replace(scene, heat=heat))
    kinds = np.concatenate([np.ravel(kind) for kind in jax.tree.leaves(system.couplings())])
    marked = kinds >= LINEAR
    assert marked.sum() == 18 + 2 * 3  # all but the outermost layers that a link or friction reaches
    flat = _system.flatten(system, y, mode)
    slope = jax.jit(jax.jacfwd(flat.rhs, argnums=1))
    rng = np.random.default_rng(2)
    start = np.asarray(_system.ravel(y, jnp.float64))
    found = []
    for band in (BandMode.SLIP, BandMode.ELASTIC, BandMode.HELD, BandMode.OPEN):
        state = start + rng.uniform(0.0, 300.0, start.size) * (kinds >= 0)
        packed = _system.pack_mode(mode._replace(band=jnp.asarray(int(band), jnp.int32)))
        found.append(np.asarray(slope(rng.uniform(0.0, 1.0), state, packed)))
    for J in found[1:]:
        np.testing.assert_array_equal(J[marked], found[0][marked])
    others = (kinds >= 0) & ~marked
    assert all(np.any(J[others] != found[0][others]) for J in found[1:])
