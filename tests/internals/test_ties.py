"""Derivatives at ties: limits of torques and forces, and what a sensitivity says where two sides differ."""

import jax.numpy as jnp
import numpy as np
import pytest
from helpers import assert_one_sided

from simbrake._base._corners import clipped, greater, lesser
from simbrake.phases import held_within
from simbrake.physics.shaft import borne_at_rest
from simbrake.studies._sides import Kind, Side, judged


@pytest.mark.parametrize(
    ("f", "numbers", "ways"),
    [
        (lambda x: borne_at_rest(*x), [0.0, 0.0], " +"),
        (lambda x: borne_at_rest(*x), [3.0, 3.0], ""),
        (lambda x: borne_at_rest(*x), [-3.0, 3.0], ""),
        (lambda x: held_within(*x), [0.0, 2.0, 3.0], ""),
        (lambda x: held_within(*x), [6.0, 2.0, 3.0], ""),
        (lambda x: jnp.stack([lesser(*x), greater(*x)]), [1.0, 1.0], ""),
        (lambda x: clipped(*x), [1.0, 1.0, 2.0], ""),
    ],
)
def test_derivative_of_limit_is_one_sided(f, numbers, ways):
    assert_one_sided(f, numbers, ways)


def given(value):
    return Side(Kind.GIVEN, value, 1e-9)


@pytest.mark.parametrize(
    ("slope", "below", "above", "value", "note"),
    [
        (2.0, given(2.0), given(3.0), 2.0, "one-sided: 2 below, 3 above"),
        (2.5, given(2.0), given(3.0), 3.0, "one-sided, by differences: 2 below, 3 above"),
        (9.0, given(2.0), given(2.0), 2.0, "by differences: 2 below, 2 above (the run itself gives 9)"),
        (9.0, Side(Kind.REFUSED), given(2.0), 2.0, "one-sided, by differences: 2 above"),
        (2.0, Side(Kind.LOST), given(2.0), 2.0, "one-sided: 2 above, no value below"),
        (9.0, Side(Kind.LOST), Side(Kind.LOST), np.nan, "none: no value on either side"),
        (9.0, given(2.0), Side(Kind.DIVERGES), np.nan, "none: differences diverge above"),
    ],
)
def test_what_is_reported_for_both_sides(slope, below, above, value, note):
    found = judged(slope, below, above)
    assert found.value == pytest.approx(value, nan_ok=True)
    assert found.note.startswith(note)


def test_derivative_of_both_sides_has_no_note():
    assert judged(2.0, given(2.0), given(2.0)) is None
    assert judged(2.0, Side(Kind.REFUSED), given(2.0)) is None
