"""What data tell of parameters: covariance by a truncated SVD, and the combinations that they leave open."""

import dataclasses
from typing import NamedTuple

import numpy as np

#: first and second derivative of the robust losses ρ(z) of SciPy, z the squared residual over its scale
_LOSSES = {
    "linear": lambda z: (np.ones_like(z), np.zeros_like(z)),
    "soft_l1": lambda z: ((1 + z) ** -0.5, -0.5 * (1 + z) ** -1.5),
    "huber": lambda z: (np.maximum(z, 1) ** -0.5, np.where(z > 1, -0.5 * np.maximum(z, 1) ** -1.5, 0.0)),
    "cauchy": lambda z: (1 / (1 + z), -1 / (1 + z) ** 2),
    "arctan": lambda z: (1 / (1 + z**2), -2 * z / (1 + z**2) ** 2),
}
LOSSES = tuple(_LOSSES)
_RHO = {
    "linear": lambda z: z,
    "soft_l1": lambda z: 2 * (np.sqrt(1 + z) - 1),
    "huber": lambda z: np.where(z <= 1, z, 2 * np.sqrt(np.maximum(z, 1)) - 1),
    "cauchy": np.log1p,
    "arctan": np.arctan,
}
#: standard deviation of what is anywhere in a range of 1
_UNIFORM = 12**-0.5
#: a parameter that an open direction moves by less than this share of its standard error is not concerned by it
_CONCERNED = 0.1


@dataclasses.dataclass(frozen=True)
class Direction:
    """A combination of parameters that the data leave open: `change` of every parameter over its range (or its
    logarithm over that of the range), the largest 1. `spread`: the combination's standard error in these units, `inf`
    where the data do not depend on it at all."""

    change: np.ndarray
    singular_value: float
    spread: float


class Identified(NamedTuple):
    """Covariance of the scaled parameters and what is open.

    `covariance` (p, p) of the determined directions alone;  `concerned` (p,): parameters whose value an open direction
    moves;  `singular_values` (p,), in standard deviations of the data per whole range
    """

    covariance: np.ndarray
    concerned: np.ndarray
    singular_values: np.ndarray
    open: list[Direction]
    rank: int


def cost(residual: np.ndarray, loss: str, scale: float) -> float:
    """What a fit makes least: `½ Σ c² ρ((r/c)²)`."""
    return 0.5 * scale**2 * float(np.sum(_RHO[loss]((residual / scale) ** 2)))


def identify(
    jacobian: np.ndarray, residual: np.ndarray, *, absolute: bool, loss: str, loss_scale: float, noise: float
) -> Identified:
    """Covariance and open directions from residuals `r` (m,) in standard deviations and their derivatives `J` (m, p).

    - `cov = s² (JᵀJ)⁻¹`, `s = 1` where the standard deviations are `absolute`, else `s² = rᵀr/(m − p)`
    - robust losses: `H⁻¹ Jᵀ diag(ψ²) J H⁻¹ m/(m − p)`, `ψ = ρ' r`, `H = Jᵀ diag(ρ' + 2 z ρ'') J` (Huber)
    - a direction is open where its singular value is below the rounding `noise` of the largest, or where its standard
      error exceeds that of a uniform distribution over the range, `1/√12`: there the bounds say more than the data
    """
    m, p = jacobian.shape
    first, second = _LOSSES[loss]((residual / loss_scale) ** 2)
    curved = np.maximum(first + 2 * (residual / loss_scale) ** 2 * second, 0.0)
    rows = np.pad(np.sqrt(curved)[:, None] * jacobian, ((0, max(p - m, 0)), (0, 0)))
    _, s, vt = np.linalg.svd(rows, full_matrices=False)
    v = vt.T
    vanishing = s <= noise * max(float(s[0]), 1e-300)
    scatter = np.sqrt(_scatter(m, int(p - vanishing.sum())))
    safe = np.where(vanishing, 1.0, s)
    if loss == "linear":
        scale = 1.0 if absolute else scatter * float(np.linalg.norm(residual))
        bent = scale * (v / safe)  # columns whose outer products add up to the covariance
    else:
        bent = scatter * np.sqrt(m) * (v / safe**2) @ (v.T @ (jacobian * (first * residual)[:, None]).T)
    along = np.linalg.norm(v.T @ bent, axis=1) if loss != "linear" else scale / safe
    vague = ~vanishing & (along > _UNIFORM)
    closed = ~(vanishing | vague)
    if loss == "linear":
        covariance = bent[:, closed] @ bent[:, closed].T
    else:
        kept = v[:, closed] @ (v[:, closed].T @ bent)
        covariance = kept @ kept.T
    directions = [Direction(change, 0.0, np.inf) for change in _readable(v[:, vanishing])]
    for k in np.flatnonzero(vague):
        change = v[:, k] / v[np.argmax(np.abs(v[:, k])), k]
        directions.append(Direction(change, float(s[k]), float(along[k])))
    return Identified(covariance, _concerned(v[:, ~closed], covariance), s, directions, int(closed.sum()))


def _scatter(m: int, rank: int) -> float:
    """One over the degrees of freedom; without any the data do not show their scatter."""
    return 1 / (m - rank) if m > rank else np.inf


def _readable(basis: np.ndarray) -> np.ndarray:
    """Directions (k, p) that span the same as the columns of `basis` (p, k), each with as few parameters as may be."""
    k = basis.shape[1]
    if k == 0:
        return np.zeros((0, basis.shape[0]))
    from scipy.linalg import qr  # not paid for by those who only simulate

    _, _, order = qr(basis.T, pivoting=True)  # pyright: ignore
    rows = np.linalg.solve(basis.T[:, order[:k]], basis.T)
    rows[np.abs(rows) < 1e-6] = 0.0
    return rows / np.take_along_axis(rows, np.argmax(np.abs(rows), axis=1)[:, None], axis=1)


def _concerned(free: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Parameters that open directions (p, k), drawn as long as the bounds allow, would move beyond their errors."""
    if not free.size:
        return np.zeros(free.shape[0], bool)
    length = 1 / np.max(np.abs(free), axis=0)
    moved = np.max(np.abs(free) * length, axis=1)
    return moved > np.maximum(_CONCERNED * np.sqrt(np.diag(covariance)), 1e-6)
