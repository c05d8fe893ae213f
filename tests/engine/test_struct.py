"""What a class of a user's own gets from the base classes of parts: a frozen dataclass
that is a PyTree."""

import copy
import dataclasses
import inspect
import pickle
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import simbrake as sb
from simbrake.hybrid import AbstractMethod


class Worn(sb.friction.AbstractFriction):
    """Friction that is given less than all that it keeps."""

    level: Any = sb.quantity("1", "coefficient")
    share: float = eqx.field(converter=np.float64)
    kind: str = eqx.field(static=True, default="new")

    def __init__(self, level, kind="worn"):
        self.level = level
        self.share = 0.5
        self.kind = kind

    def kinetic(self, contact):
        return self.level * self.share

    static = kinetic


class Rough(Worn):
    """A class below it, made in the same way."""


def test_part_of_a_users_own_class():
    law = Rough("0.4", kind="rough")
    assert jax.tree.leaves(law) == [0.4, 0.5]
    assert [
        jax.tree_util.keystr(path) for path, _ in jax.tree.leaves_with_path(law)
    ] == [".level", ".share"]
    twice = jax.tree.map(lambda x: 2 * x, law)
    assert type(twice) is Rough
    assert (twice.level, twice.share, twice.kind) == (0.8, 1.0, "rough")
    assert twice != Rough(0.8, kind="rough")  # whose share is 0.5
    assert law == Rough(0.4, kind="rough")
    assert law != Rough(0.4)
    assert law != Worn(0.4, kind="rough")
    assert jax.jit(lambda law: law.level * law.share)(law) == 0.2
    for other in (
        copy.deepcopy(law),
        pickle.loads(pickle.dumps(law)),
        eqx.tree_at(lambda x: x.level, law, law.level),
    ):
        assert other == law
        assert type(other) is Rough
    with pytest.raises(dataclasses.FrozenInstanceError, match="level"):
        law.level = 0.3
    with pytest.raises(dataclasses.FrozenInstanceError, match="level"):
        del law.level
    numbers, rest = eqx.partition(law, eqx.is_array)
    assert eqx.combine(numbers, rest) == law
    assert jax.eval_shape(lambda: jax.tree.map(jnp.asarray, law)).level.shape == ()


def test_classes_that_are_not_complete():
    class Forgetful(Worn):
        def __init__(self):
            self.level = 0.3

    class NoOrder(AbstractMethod):
        def attempt(self, *arguments): ...
        def rolled(self): ...
        def fitted(self, couplings): ...
        def with_tangents(self): ...
        def with_fixed_jacobian(self, *arguments): ...
        def step_with_rate(self, *arguments): ...
        def state_after(self, *arguments): ...
        def pullback(self, *arguments): ...

    with pytest.raises(TypeError, match=r"Forgetful\.__init__ does not set share"):
        Forgetful()
    with pytest.raises(TypeError, match=r"NoOrder does not define .*order"):
        NoOrder()
    with pytest.raises(TypeError, match="abstract"):
        sb.friction.AbstractFriction()


def test_signature_tells_what_is_taken():
    assert (
        str(inspect.signature(sb.Pulley))
        == "(radius: float, inertia: float, width: float | None = None) -> None"
    )
    assert [*inspect.signature(Rough).parameters] == ["level", "kind"]
    assert hash(sb.hybrid.Rodas5P()) == hash(sb.hybrid.Rodas5P())
    assert sb.hybrid.Rodas5P() == sb.hybrid.Rodas5P()
