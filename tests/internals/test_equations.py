"""Equations of a scene by themselves: limits at ties, states and rows, thermal flows, what asks for which solver."""

import jax.numpy as jnp
import numpy as np
import pytest
from helpers import assert_one_sided

from simbrake._base._corners import clipped, greater, lesser
from simbrake._phases import held_within
from simbrake._physics._shaft import borne_at_rest
from simbrake.studies._sides import Kind, Side, judged

# --- limits at ties ---------------------------------------------------------------------------------------------------


def dry(x):
    return borne_at_rest(*x)


def held(x):
    return held_within(*x)


@pytest.mark.parametrize(
    ("f", "numbers", "ways"),
    [
        (dry, [0.0, 0.0], " +"),
        (dry, [0.0, 2.0], ""),
        (dry, [-3.0, 0.0], " +"),
        (dry, [3.0, 3.0], ""),
        (dry, [-3.0, 3.0], ""),
        (held, [0.0, 2.0, 3.0], ""),
        (held, [6.0, 2.0, 3.0], ""),
        (lambda x: jnp.stack([lesser(*x), greater(*x)]), [1.0, 1.0], ""),
        (lambda x: clipped(*x), [1.0, 1.0, 2.0], ""),
    ],
)
def test_derivative_of_a_limit_is_of_one_side(f, numbers, ways):
    assert_one_sided(f, numbers, ways)


def given(value, error=1e-9):
    return Side(Kind.GIVEN, value, error)


@pytest.mark.parametrize(
    ("slope", "below", "above", "value", "note"),
    [
        (2.0, given(2.0), given(2.0), None, None),
        (2.0, given(2.0), given(3.0), 2.0, "one-sided: 2 below, 3 above"),
        (3.0, given(2.0), given(3.0), 3.0, "one-sided: 2 below, 3 above"),
        (2.5, given(2.0), given(3.0), 3.0, "one-sided, by differences: 2 below, 3 above"),
        (9.0, given(2.0), given(2.0), 2.0, "by differences: 2 below, 2 above (the run itself gives 9)"),
        (2.0, Side(Kind.REFUSED), given(2.0), None, None),
        (9.0, Side(Kind.REFUSED), given(2.0), 2.0, "one-sided, by differences: 2 above"),
        (2.0, Side(Kind.LOST), given(2.0), 2.0, "one-sided: 2 above, no value below"),
        (9.0, Side(Kind.LOST), Side(Kind.LOST), np.nan, "none: no value on either side"),
        (9.0, given(2.0), Side(Kind.DIVERGES), np.nan, "none: differences diverge above"),
        (9.0, Side(Kind.REFUSED), Side(Kind.REFUSED), None, None),
    ],
)
def test_what_is_reported_for_both_sides(slope, below, above, value, note):
    found = judged(slope, below, above)
    if value is None:
        assert found is None
    else:
        assert found.value == pytest.approx(value, nan_ok=True)
        assert found.note.startswith(note)
