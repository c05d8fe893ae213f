"""Second derivatives of results, from exact gradients of runs nearby."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .._base._faults import Fault, Issues, input_error
from ..parts.scene import Scene
from ..runs.edit import with_values
from ..runs.measure import MetricLike, check_metrics
from ._sensitivity import check_happened, chosen_leaves, end_of_range, modes_of
from .bounds import Paths, name_of_entry, numbers_of
from .evaluating import Metrics, PointEvaluator, Solver, values_of

#: shares of the step, each of which removes one power of its square from the error
_SHARES = (1.0, 0.5, 0.25)


class Hessian(NamedTuple):
    """Second derivatives of a metric: `matrix` (k, k) `∂²M/∂p_i ∂p_j`, of the numbers
    named in `paths` (k,).

    - `value` `M`;  `gradient` (k,) `∂M/∂p_i`
    - `error` (k, k): estimate from the last two extrapolations, and from the asymmetry
      of the matrix

    Example:
        >>> found = sb.studies.hessian(scene, "stopping_angle", "initial.omega")
        >>> round(float(found.gradient[0]), 4), round(float(found.matrix[0, 0]), 4)
        (1.2577, 0.0524)
    """

    paths: tuple[str, ...]
    value: float
    gradient: np.ndarray
    matrix: np.ndarray
    error: np.ndarray


def hessian(
    scene: Scene,
    metric: MetricLike,
    paths: str | Sequence[str],
    *,
    step: float = 0.02,
    rtol: float = 1e-12,
    solver: Solver | None = None,
) -> Hessian:
    """Second derivatives of a metric with respect to parameters of a scene, through
    every event of its run.

    `∂²M/∂p_i ∂p_j ≈ (g_j(p + h e_i) − g_j(p − h e_i))/2h` of the exact gradient `g`,
    for `h`, `h/2`, `h/4`, and extrapolated to `h → 0` (Richardson: the error is
    `O(h⁶)`).

    - `metric`: a metric's name or a function of a `Result` to a number
    - `paths`: as `wrt` of `sensitivity`
    - `step`: first `h`, as a share of each number;  `rtol`, `solver`: as for `simulate`

    Raises `InputError` for unknown paths and metrics, for a number that is 0, and where
    a run at `p ± h` has another sequence of events: the metric has no second derivative
    across that; `SimulationError` where the run fails. Source: Richardson, Phil. Trans.
    R. Soc. A 210 (1911).

    Example:
        >>> found = sb.studies.hessian(scene, "stopping_angle", "initial.omega")
        >>> found.matrix.shape
        (1, 1)
    """
    metrics = Metrics((metric,))
    check_metrics(scene, metrics.asked)
    chosen = chosen_leaves(scene, paths)
    place = Paths.of(chosen)
    x = numbers_of(chosen)
    names = tuple(name_of_entry(*entry) for entry in place.entries)
    issues = Issues(
        Fault(name, "is 0", "leave it out")
        for name, number in zip(names, x, strict=True)
        if number == 0
    )
    issues.unless(0 < step < 1, "step", step, "0 < step < 1")
    issues.report()
    run = PointEvaluator(
        scene, place, metrics, size=1, reverse=x.size > 1, rtol=rtol, solver=solver
    )
    base = run.result()
    check_happened(metrics, values_of(base, metrics))
    usual = modes_of(base)
    moves = np.diag(step * np.abs(x))
    for name, move in zip(names, moves, strict=True):
        for moved in (x - move, x + move):
            _, words = end_of_range(run, with_values(scene, place.values(moved)), usual)
            if words:
                what = f"{words} within a step of {step:g}"
                issues.add(name, what, "give a smaller step")
    issues.report()
    run.like(base)

    def gradient(at: np.ndarray) -> np.ndarray:
        slopes = run(at)
        if slopes.code != 0 or not np.all(np.isfinite(slopes.jacobian)):
            raise input_error(
                "step", "the metric has no derivative within it", "give a smaller step"
            )
        return slopes.jacobian[0]

    rows = []
    errors = []
    for move in moves:
        slopes = np.stack(
            [
                (gradient(x + share * move) - gradient(x - share * move))
                / (2 * share * np.sum(move))
                for share in _SHARES
            ]
        )
        for k in range(1, len(_SHARES)):
            coarser = slopes[0]
            slopes = slopes[1:] + np.diff(slopes, axis=0) / (4**k - 1)
        rows.append(slopes[0])
        errors.append(np.abs(slopes[0] - coarser))
    matrix = np.stack(rows)
    error = np.maximum(np.stack(errors), np.abs(matrix - matrix.T) / 2)
    value = float(values_of(base, metrics)[0])
    return Hessian(names, value, gradient(x), (matrix + matrix.T) / 2, error)
