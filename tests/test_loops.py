"""What makes the loops of the engine fast: invariants moved out, entries of vectors as slices, bordered systems."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from simbrake._hybrid._bordered import Bordered, factor, solve
from simbrake._hybrid._invariants import hoisted
from simbrake._hybrid._places import put, take


@jax.custom_jvp
def cubed(x):
    return x * x * x


@cubed.defjvp
def _(primals, tangents):
    return cubed(primals[0]), 3 * primals[0] ** 2 * tangents[0]


def turns(numbers, start, *, moved, count=5):
    """A loop whose body has invariants, calls, a loop of its own, a branch and a custom rule."""

    def body(carry):
        i, x = carry
        slope = jnp.tan(numbers) * jnp.sum(jnp.exp(numbers)) + cubed(numbers)
        other = jnp.tan(numbers) - jnp.where(numbers > 0, 0.0, -0.0)  # asked for once more
        inner, last = jax.lax.scan(lambda c, k: (c + k * jnp.sin(numbers), c), x, jnp.arange(3.0))
        x = jax.lax.cond(i > 2, lambda: inner + 1e-2 * slope, lambda: inner - 1e-3 * other * cubed(x))
        return i + 1, x + 1e-3 * jnp.sum(last)

    begin = (jnp.asarray(0, jnp.int32), start)
    return jax.lax.while_loop(lambda c: c[0] < count, hoisted(body, begin) if moved else body, begin)[1]


def numbers_of(function, *arguments) -> tuple[list[str], list[str]]:
    """Names of the operations outside and inside of the loop."""

    def names(program) -> list[str]:
        found = []
        for equation in program.eqns:
            found.append(equation.primitive.name)
            for value in equation.params.values():
                parts = value if isinstance(value, tuple) else (value,)
                for part in parts:
                    inner = getattr(part, "jaxpr", None)
                    if inner is not None:
                        found += names(inner)
        return found

    program = jax.make_jaxpr(function)(*arguments).jaxpr
    loops = [equation for equation in program.eqns if equation.primitive.name == "while"]
    outside = [equation.primitive.name for equation in program.eqns if equation.primitive.name != "while"]
    return outside, names(loops[0].params["body_jaxpr"].jaxpr)


def test_invariants_move_out_and_nothing_else_changes():
    numbers, start = jnp.linspace(0.1, 1.0, 4), jnp.linspace(-1.0, 2.0, 4)
    before, after = (jax.jit(lambda a, b, m=m: turns(a, b, moved=m)) for m in (False, True))
    np.testing.assert_allclose(after(numbers, start), before(numbers, start), rtol=1e-14)
    many = jnp.stack([numbers, 2 * numbers])
    starts = jnp.stack([start, start - 1])
    np.testing.assert_allclose(jax.vmap(after)(many, starts), jax.vmap(before)(many, starts), rtol=1e-14)

    def whole(a, b):
        return turns(a, b, moved=True)

    outside, inside = numbers_of(whole, numbers, start)
    assert outside.count("tan") == 1
    assert not {"tan", "exp", "sin"} & set(inside)
    assert "tan" in numbers_of(lambda a, b: turns(a, b, moved=False), numbers, start)[1]


def test_signs_of_zero_are_kept_apart():
    def body(carry):
        return jnp.stack([1.0 / (0.0 * carry[0]), jnp.copysign(1.0, jnp.where(carry[1] > 0, -0.0, 0.0))])

    begin = jnp.ones(2)
    np.testing.assert_array_equal(jax.jit(lambda x: hoisted(body, x)(x))(begin), jax.jit(body)(begin))


def test_entries_as_slices():
    rng = np.random.default_rng(5)
    x, places = rng.normal(size=9), (7, 8, 0, 3, 4)
    np.testing.assert_array_equal(take(jnp.asarray(x), places), x[list(places)])
    values, expected = rng.normal(size=5), x.copy()
    expected[list(places)] = values
    np.testing.assert_array_equal(put(jnp.asarray(x), places, jnp.asarray(values)), expected)
    assert take(jnp.asarray(x), ()).shape == (0,)


@pytest.mark.parametrize(("m", "n"), [(0, 7), (3, 0), (1, 1), (3, 19), (5, 64), (20, 4)])
def test_bordered_systems_against_dense_ones(m, n):
    rng = np.random.default_rng(m + 100 * n)
    # layers from thin to thick: conductances over many powers of ten, as in a wall with a fine surface
    g = 10.0 ** rng.uniform(-3, 6, n)
    lower, upper = -g * np.arange(n).clip(0, 1), -np.append(g[1:], np.zeros(int(n > 0)))
    diagonal = 1 - lower - upper
    core = rng.normal(size=(m, m)) * 10.0 ** rng.uniform(-4, 4, (m, 1))  # pivots are not where they are at first
    right, below = rng.normal(size=(m, n)), rng.normal(size=(n, m))
    a = Bordered(*(jnp.asarray(x) for x in (core, right, below, lower, diagonal, upper)))
    dense = np.zeros((m + n, m + n))
    dense[:m, :m], dense[:m, m:], dense[m:, :m] = core, right, below
    if n:
        dense[m:, m:] = np.diag(diagonal) + np.diag(lower[1:], -1) + np.diag(upper[:-1], 1)
    b = rng.normal(size=m + n)
    for matrix, whole in ((a, dense), (a.transposed, dense.T)):
        x = np.asarray(solve(factor(matrix), jnp.asarray(b)))
        size = np.abs(whole) @ np.abs(x) + np.abs(b)
        assert np.max(np.abs(whole @ x - b) / size) < 1e-12  # backward error, row by row
        np.testing.assert_allclose(x, np.linalg.solve(whole, b), rtol=1e-8, atol=1e-12)
