"""Random scenes against models in NumPy and SciPy that share no equation with the
package.

A few of those that `python tests/oracles/random_scenes.py` runs, one of each kind of
brake.
"""

import pytest
from oracles.independent.compare import compare

SCENES = (
    # two alike rims
    ("rigid band", "plain", 4),
    ("elastic band", "hot", 4),
    ("elastic band", "plain", 5),
    ("staged, rigid band", "plain", 1),
    # at rest under a load beyond both pairs: the weaker one alone lets go
    ("staged, elastic band", "plain", 0),
    ("chain", "plain", 5),
    ("disc", "hot", 2),
    ("shoe", "hot", 0),
    ("shoe", "fill", 2),
    # linings that lift off the rim and touch again, where they take no heat; the second
    # on two alike rims
    ("staged, rigid band", "hot", 1),
    ("staged, elastic band", "plain", 9),
    ("resolved bandage", "plain", 1),
    # linings held at rest of which springs tear one off; six linings with friction that
    # depends on their own speeds
    ("resolved bandage", "plain", 2),
    ("resolved bandage", "fill", 2),
    ("several bands", "hot", 1),
)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "flavour", "seed"), SCENES)
def test_random_scene_agrees_with_its_oracle(kind, flavour, seed):
    found = compare(kind, flavour, seed)
    assert not found.differs, found
    assert found.modes > 1
