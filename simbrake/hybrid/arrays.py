"""Array types, and entries of a vector at places known while tracing."""

import functools
import itertools
from collections.abc import Callable, Sequence
from types import ModuleType
from typing import TYPE_CHECKING, Any, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int, PyTree, Shaped

if TYPE_CHECKING:
    Array: TypeAlias = jax.Array | np.ndarray
else:

    class _AnyArray(type):
        def __instancecheck__(cls, instance: object) -> bool:
            return isinstance(instance, jax.Array | np.ndarray | np.generic)

    class Array(metaclass=_AnyArray):
        """JAX's where a run is traced; NumPy's, and its scalars, in the numbers of a
        concrete run.

        One class: of a union of three, each of the 800 shapes in annotations would be
        three classes."""


Scalar = ScalarArray = Float[Array, ""]
#: a vector; and two of other lengths
Vector = Float[Array, " n"]
VectorK = Float[Array, " k"]
VectorM = Float[Array, " m"]
#: of any shape
Floats = Float[Array, "..."]
Count = IntScalar = Int[Array, ""]
Mark = Bool[Array, ""]
Marks = Bool[Array, " n"]
TwoArrays = tuple[Array, Array]
NumberOrArray = float | int | Array
State = Float[Array, " state"]
Guards = Float[Array, " guard"]
GuardMarks = Bool[Array, " guard"]
#: rates of a state at `(t, y)`
Rhs = Callable[[Scalar, State], State]
#: the same as a function of the numbers in it as well, `(params, t, y)`
RhsOf = Callable[[PyTree, Scalar, State], State]


def numpy_of(values: Any) -> ModuleType:
    """NumPy for concrete values: outside of jit every operation of JAX would compile by
    itself."""
    return np if isinstance(values, np.ndarray | np.generic) else jnp


# --- entries of a vector at known places, as pieces: gathers and scatters are slow in loops on a CPU


def _joined(
    parts: Sequence[Float[Array, " _"]], places: Sequence[int]
) -> Float[Array, " k"]:
    """`concatenate(parts)[places]`, each place at most once.

    The parts are split where the places leave off: in reverse, pieces of a split are
    joined, where slices would each be padded with zeros and all of them summed.
    """
    ends = np.cumsum([0, *(part.shape[0] for part in parts)])
    breaks = np.flatnonzero(np.diff(places) != 1) + 1
    runs = [
        (int(run[0]), int(run[-1]) + 1) for run in np.split(np.asarray(places), breaks)
    ]
    cuts = np.unique([*ends, *itertools.chain.from_iterable(runs)])
    pieces = dict[int, Array]()
    for part, (a, b) in zip(parts, itertools.pairwise(ends.tolist()), strict=True):
        inside = [c for c in cuts.tolist() if a <= c <= b]
        sizes = np.diff(inside).tolist()
        pieces |= zip(
            inside,
            jax.lax.split(part, sizes) if len(sizes) > 1 else [part],
            strict=False,
        )
    return jnp.concatenate(
        [pieces[c] for a, b in runs for c in cuts.tolist() if a <= c < b]
    )


def take(x: Float[Array, " n"], places: tuple[int, ...]) -> Float[Array, " k"]:
    """`x[places]`."""
    return _joined([x], places) if places else jnp.zeros(0, x.dtype)


#: entries that differ by this share are equal: XLA may compute them twice, with
#: different rounding
_NEAR = 1e-12


def largest(x: Float[Array, " n"]) -> Float[Array, ""]:
    """`max x_i`, with the derivative of the first entry that is largest but for
    rounding."""
    return np.max(x) if isinstance(x, np.ndarray) else _largest(x)


@jax.custom_jvp
def _largest(x: Float[Array, " n"]) -> Float[Array, ""]:
    return jnp.max(x)


@_largest.defjvp
def _(
    primals: tuple[Float[Array, " n"]], tangents: tuple[Float[Array, " n"]]
) -> tuple[Array, Array]:
    (x,) = primals
    (dx,) = tangents
    # not `jnp.max`, whose own derivative would be taken where this rule is
    # differentiated again: it divides by how many entries are equal to the maximum,
    # none where a fused kernel rounds a copy of `x` otherwise
    most = _largest(x)
    place = _first(x >= most - _NEAR * jnp.abs(most))
    return most, jnp.sum(
        jnp.where(np.arange(x.shape[0], dtype=np.int32) == place, dx, 0.0)
    )


def smallest(x: Float[Array, " n"]) -> Float[Array, ""]:
    """`min x_i`, with the derivative of the first entry that is smallest."""
    return -largest(-x)


# --- of short vectors: each reduction in a program costs it time at every call ------


def any_of_each(*marks: Bool[Array, " n"]) -> list[Mark]:
    """Whether any entry of each vector is set: all of them by one reduction, as bits of
    whole numbers."""
    bits = [
        jnp.where(mark, np.int32(1 << i), np.int32(0)) for i, mark in enumerate(marks)
    ]
    union = jax.lax.reduce_or(functools.reduce(jnp.bitwise_or, bits), axes=(0,))
    return [(union & np.int32(1 << i)) != 0 for i in range(len(marks))]


def first_least(x: Float[Array, " n"]) -> tuple[Float[Array, ""], Count]:
    """The smallest entry, and the first index that has it within rounding."""
    least = jnp.min(x)
    return least, _first(x <= least + _NEAR * jnp.abs(least))


def _first(marks: Bool[Array, " n"]) -> Count:
    """The first place of those marked, the last of all if none is."""
    last = marks.shape[0] - 1
    return jnp.min(
        jnp.where(marks, np.arange(last + 1, dtype=np.int32), np.int32(last))
    )


def entry(x: Shaped[Array, " n"], place: Count) -> Shaped[Array, ""]:
    """`x[place]` of a place that exists."""
    return jax.lax.dynamic_slice(x, (place,), (1,))[0]


def put(
    x: Float[Array, " n"], places: tuple[int, ...], values: Float[Array, " k"]
) -> Float[Array, " n"]:
    """`x` with `values` at `places`."""
    n = x.shape[0]
    source = np.arange(n)
    source[list(places)] = n + np.arange(len(places))
    return _joined([x, values], source.tolist()) if n else x


def templates(y0: PyTree, mode0: PyTree) -> tuple[PyTree, PyTree]:
    """Zeros of the shapes and types of the states and of the mode of a system."""
    y_like = jax.tree.map(lambda leaf: np.zeros(jnp.shape(leaf)), y0)
    return y_like, jax.tree.map(lambda leaf: np.zeros(jnp.shape(leaf), np.int32), mode0)
