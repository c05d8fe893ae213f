"""Short vectors in programs: several marks at once, the first least entry, the greatest and its derivative."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from simbrake.hybrid import largest, smallest
from simbrake.hybrid._arrays import any_of_each, entry, first_least


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("n", [1, 2, 7, 40])
def test_marks_at_once_are_those_one_by_one(seed, n):
    marks = np.random.default_rng(seed).random((5, n)) < 0.5 / n
    found = jax.jit(any_of_each)(*marks)
    assert [bool(mark) for mark in found] == [any(mark) for mark in marks]
    lanes = jax.vmap(any_of_each)(marks, ~marks)
    np.testing.assert_array_equal(lanes, [np.any(marks, axis=1), np.any(~marks, axis=1)])


def test_first_of_equal_entries():
    inf = np.inf
    cases = [
        ([3.0, 1.0, 1.0], 1.0, 1),
        ([-0.5, -1.0, 2.0, -1.0], -1.0, 1),
        ([inf, inf, 0.0], 0.0, 2),
        ([inf, -inf], -inf, None),  # no place counts where nothing is found
        ([0.25], 0.25, 0),
        ([0.1 + 0.2, 0.3], 0.3, 0),  # equal but for rounding
        ([0.3 * (1 + 1e-9), 0.3], 0.3, 1),
    ]
    for x, least, place in cases:
        found, at = jax.jit(first_least)(np.asarray(x))
        assert float(found) == least
        assert place is None or int(at) == place
        assert float(entry(jnp.asarray(x), at)) == x[int(at)]


@pytest.mark.parametrize("x", [[1.0, 3.0, 2.0], [2.0, 2.0, 1.0], [-4.0, -1.0], [0.0, 0.0], [5.0]])
def test_the_derivative_of_the_greatest_entry_is_that_of_the_first(x):
    x = np.asarray(x)
    one_hot = np.eye(len(x))[np.argmax(x)]
    assert float(largest(x)) == max(x)
    np.testing.assert_array_equal(jax.grad(largest)(x), one_hot)
    np.testing.assert_array_equal(jax.jacfwd(largest)(x), one_hot)
    assert float(smallest(-x)) == -max(x)
    np.testing.assert_array_equal(jax.grad(smallest)(-x), one_hot)
