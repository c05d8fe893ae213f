"""What data determine: covariance by a truncated SVD, the undetermined combinations of
parameters, and fixed numbers that are tied to fitted ones."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

#: the robust losses ρ(z) of SciPy, z the squared residual over its scale
_LOSSES: dict[str, Callable[[Any], Any]] = {
    "linear": lambda z: z,
    "soft_l1": lambda z: 2 * (jnp.sqrt(1 + z) - 1),
    "huber": lambda z: jnp.where(z <= 1, z, 2 * jnp.sqrt(jnp.maximum(z, 1)) - 1),
    "cauchy": jnp.log1p,
    "arctan": jnp.arctan,
}
LOSSES = tuple(_LOSSES)
#: standard deviation of a uniform distribution over a range of 1
_UNIFORM = 12**-0.5
#: a parameter that an open direction moves by less than this share of its standard
#: error is not affected by it
_CONCERNED = 0.1


class Identified(NamedTuple):
    """Covariance of the scaled parameters, and undetermined directions.

    - `covariance` (p, p) of the determined directions alone
    - `singular_values` (p,), in standard deviations of the data per whole range
    - `open` (k, p): directions that the data do not determine
    - `concerned` (p,): parameters that one of them changes
    """

    covariance: np.ndarray
    concerned: np.ndarray
    singular_values: np.ndarray
    open: np.ndarray
    rank: int


def cost(residual: np.ndarray, loss: str, scale: float) -> float:
    """Objective of a fit: `½ Σ c² ρ((r/c)²)`."""
    return 0.5 * scale**2 * float(np.sum(_LOSSES[loss]((residual / scale) ** 2)))


def identify(
    jacobian: np.ndarray,
    residual: np.ndarray,
    *,
    absolute: bool,
    loss: str,
    loss_scale: float,
    noise: float,
) -> Identified:
    """Covariance and open directions from residuals `r` (m,) in standard deviations and
    their derivatives `J` (m, p).

    - `cov = s² (JᵀJ)⁻¹`, `s = 1` where the standard deviations are `absolute`, else
      `s² = rᵀr/(m − p)`
    - robust losses: `H⁻¹ Jᵀ diag(ψ²) J H⁻¹ m/(m − p)`, `ψ = ρ' r`,
      `H = Jᵀ diag(ρ' + 2 z ρ'') J` (Huber)
    - a direction is open where its singular value is below the rounding `noise` of the
      largest, or where its standard error exceeds that of a uniform distribution over
      the range, `1/√12`: there the bounds determine more than the data
    """
    m, p = jacobian.shape
    z = (residual / loss_scale) ** 2
    slope = jax.grad(_LOSSES[loss])
    first = np.asarray(jax.vmap(slope)(z))
    second = np.asarray(jax.vmap(jax.grad(slope))(z))
    curved = np.maximum(first + 2 * z * second, 0.0)
    rows = np.pad(np.sqrt(curved)[:, None] * jacobian, ((0, max(p - m, 0)), (0, 0)))
    _, s, vt = np.linalg.svd(rows, full_matrices=False)
    vanishing = s <= noise * np.max(s, initial=1e-300)
    freedom = m - int(p - vanishing.sum())
    # without any degrees of freedom it is unknown
    scatter = np.sqrt(1 / freedom if freedom > 0 else np.inf)
    if loss == "linear":
        scale = 1.0 if absolute else scatter * np.linalg.norm(residual)
        push = np.diag(s)
    else:
        scale = scatter * np.sqrt(m)
        push = vt @ (jacobian * (first * residual)[:, None]).T
    # columns whose outer products add up to the covariance, along each direction
    along = scale * push / np.where(vanishing, 1.0, s)[:, None] ** 2
    vague = ~vanishing & (np.linalg.norm(along, axis=1) > _UNIFORM)
    closed = ~(vanishing | vague)
    whole = vt[closed].T @ along[closed]
    covariance = whole @ whole.T
    free = vt[~closed]
    return Identified(
        covariance, _concerned(free.T, covariance), s, free, int(closed.sum())
    )


class Confounded(NamedTuple):
    """How a fixed number is tied to fitted ones (p,): their correlations if it were
    free, their shift for its change of 1, and their variances while it is fixed (for
    residuals of variance 1)."""

    correlation: np.ndarray
    shift: np.ndarray
    variance: np.ndarray


def confound(jacobian: np.ndarray, column: np.ndarray, noise: float) -> Confounded:
    """Correlations of fitted parameters, with derivatives `J` (m, p), with a number of
    derivatives `j` (m,).

    With `a = J⁺ j` and `e = j − J a`, freeing the number makes its variance `1/eᵀe`,
    those of the parameters `C_ii + a_i²/eᵀe` with `C = (JᵀJ)⁺`, and the covariances
    `−a_i/eᵀe`.

    Source: Björck, Numerical Methods for Least Squares Problems (1996), 3.2 (a column
    that is added).
    """
    inverse = np.linalg.pinv(jacobian, noise)
    a = inverse @ column
    rest = column - jacobian @ a
    size = float(column @ column)
    variance = np.sum(inverse**2, axis=1)
    square = max(float(rest @ rest), noise**2 * size)  # never of rounding alone
    scale = np.sqrt(variance * square + a**2)
    correlation = np.where(scale > 0, -a / np.where(scale > 0, scale, 1.0), 0.0)
    return Confounded(correlation, -a, variance)


def _concerned(free: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Parameters that open directions (p, k), drawn as long as the bounds allow, would
    move beyond their errors."""
    if not free.size:
        return np.zeros(free.shape[0], bool)
    length = 1 / np.max(np.abs(free), axis=0)
    moved = np.max(np.abs(free) * length, axis=1)
    return moved > np.maximum(_CONCERNED * np.sqrt(np.diag(covariance)), 1e-6)
