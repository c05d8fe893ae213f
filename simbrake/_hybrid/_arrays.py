"""What an array is here."""

from typing import TYPE_CHECKING, TypeAlias

import jax
import numpy as np

if TYPE_CHECKING:
    Array: TypeAlias = jax.Array | np.ndarray
else:
    # JAX's where a run is traced; NumPy's, and its scalars, in the numbers of a concrete run
    Array = jax.Array | np.ndarray | np.generic
