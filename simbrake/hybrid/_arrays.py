"""What an array is here, and entries of a vector at places known while tracing."""

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int, PyTree

if TYPE_CHECKING:
    Array: TypeAlias = jax.Array | np.ndarray
else:
    # JAX's where a run is traced; NumPy's, and its scalars, in the numbers of a concrete run
    Array = jax.Array | np.ndarray | np.generic

Scalar = Float[Array, ""]
Count = Int[Array, ""]
Mark = Bool[Array, ""]
State = Float[Array, " state"]
Guards = Float[Array, " guard"]
#: rates of a state at `(t, y)`
Rhs = Callable[[Scalar, State], State]
#: the same as a function of the numbers in it as well, `(params, t, y)`
RhsOf = Callable[[PyTree, Scalar, State], State]


# --- entries of a vector at known places, as slices: gathers and scatters are slow in loops on a CPU ------------------


def _runs(places: tuple[int, ...]) -> list[tuple[int, int]]:
    """Consecutive places as `(first, end)`."""
    if not places:
        return []
    cuts = np.flatnonzero(np.diff(places) != 1) + 1
    return [(int(run[0]), int(run[-1]) + 1) for run in np.split(np.asarray(places), cuts)]


def take(x: Float[Array, " n"], places: tuple[int, ...]) -> Float[Array, " k"]:
    """`x[places]`."""
    return jnp.concatenate([x[a:b] for a, b in _runs(places)]) if places else jnp.zeros(0, x.dtype)


def largest(x: Float[Array, " n"]) -> Float[Array, ""]:
    """`max x_i`, with the derivative of the first entry that is largest.

    The derivative of `jnp.max` looks for entries equal to the maximum and divides by their number. XLA may compute the
    entries twice, with different rounding: then there are none.
    """
    return jnp.sum(jnp.where(jnp.arange(x.shape[0], dtype=jnp.int32) == jnp.argmax(x).astype(jnp.int32), x, 0.0))


def smallest(x: Float[Array, " n"]) -> Float[Array, ""]:
    """`min x_i`, with the derivative of the first entry that is smallest."""
    return -largest(-x)


def put(x: Float[Array, " n"], places: tuple[int, ...], values: Float[Array, " k"]) -> Float[Array, " n"]:
    """`x` with `values` at `places`."""
    n = x.shape[0]
    source = np.arange(n)
    source[list(places)] = n + np.arange(len(places))
    return take(jnp.concatenate([x, values]), tuple(int(i) for i in source))
