"""From the end of a search to a calibration: errors, intervals, open combinations, warnings."""

from typing import Any

import numpy as np

from .._base._identify import Direction, Identified, identify
from .._base._quantity import leaves
from .._parts._scene import Scene
from .._run._edit import with_values
from ._calibration import Calibration, OpenCombination, Parameter, Residuals, State
from ._fit_model import slices
from ._measured import Measured, Points
from ._search import Search

#: shares of a combination that are not worth a word
_SMALL = 0.01
#: chi² as unlikely as this says that model and data disagree
_UNLIKELY = 1e-3


def assess(
    search: Search, before: Scene, data: Measured, first: np.ndarray, *, absolute: bool, confidence: float, rtol: float
) -> Calibration:
    """The calibration at the best point of a search."""
    from scipy.stats import chi2 as chi2_law  # slow to import: only those who fit pay for it

    assert search.best is not None
    _, z, found = search.best
    scale, paths = search.scale, search.model.plan.paths
    theta, residual = scale.up(z), search.residual(found)
    fixed = search.pressed(z) & ((z == 0) | (z == 1))
    if fixed.any():  # noise alone drives what is open against a bound: then the bound holds it, not the data
        whole = _identified(search, z, np.zeros_like(fixed), absolute, rtol)
        fixed = fixed & ~whole.concerned
    known = _identified(search, z, fixed, absolute, rtol)
    chi2, freedom = float(residual @ residual), residual.size - known.rank
    concerned, slope = np.zeros(z.size, bool), scale.slope(theta)
    concerned[~fixed] = known.concerned
    covariance = np.full((z.size, z.size), np.nan)
    covariance[np.ix_(~fixed, ~fixed)] = known.covariance
    error = np.sqrt(np.diag(covariance))
    quantile = _quantile(confidence, absolute and search.loss == "linear", freedom)
    ends = [scale.up(z + side * quantile * error) for side in (-1.0, 1.0)]
    parameters = _parameters(search, before, theta, first, z, fixed, concerned, error * slope, ends)
    covariance = covariance * np.outer(slope, slope)
    covariance[concerned] = covariance[:, concerned] = np.nan
    covariance[concerned, concerned] = np.inf
    probability = float(chi2_law.sf(chi2, freedom)) if absolute and search.loss == "linear" and freedom > 0 else None
    start = search.model(first)
    names = [paths[i] for i in np.flatnonzero(~fixed)]
    rate = (slope / np.where(theta == 0, 1.0, theta))[~fixed]
    return Calibration(
        parameters=parameters,
        covariance=covariance,
        chi2=chi2,
        chi2_start=float(np.sum(search.residual(start) ** 2)) if start.refused is None else float("inf"),
        freedom=freedom,
        absolute=absolute,
        probability=probability,
        confidence=confidence,
        singular_values=known.singular_values,
        open=tuple(_combination(one, known.open, names, rate, theta[~fixed] != 0) for one in known.open),
        residuals=_residuals(data, search, found.values, start.values, chi2, freedom, absolute),
        scene=with_values(before, dict(zip(paths, theta.tolist(), strict=True))),
        before=before,
        data=data,
        converged=search.converged,
        message=search.message,
        evaluations=search.model.evaluations,
        failures=dict(search.model.failures),
        solver=f"{type(search.model.plan.solver).__name__}, rtol {rtol:g}, {search.method}",
        loss=search.loss,
        warnings=tuple(_warnings(search, z, chi2, probability, fixed, paths)),
    )


def _identified(search: Search, z: np.ndarray, fixed: np.ndarray, absolute: bool, rtol: float) -> Identified:
    found = search.look(z)
    residual = search.residual(found)
    if fixed.all():
        return Identified(np.zeros((0, 0)), np.zeros(0, bool), np.zeros(0), [], 0)
    return identify(
        search.jacobian(z, found)[:, ~fixed],
        residual,
        absolute=absolute,
        loss=search.loss,
        loss_scale=search.loss_scale,
        # derivatives are those of the steps taken, and these differ from the motion by the tolerance
        noise=max(10 * rtol, 1e-12),
    )


def _quantile(confidence: float, known_noise: bool, freedom: int) -> float:
    """Half width of an interval in standard errors: normal where the noise is known, else Student's t."""
    from scipy.stats import norm, t

    if known_noise:
        return float(norm.ppf(0.5 + confidence / 2))
    return float(t.ppf(0.5 + confidence / 2, freedom)) if freedom > 0 else float("inf")


def _parameters(
    search: Search,
    scene: Scene,
    theta: np.ndarray,
    first: np.ndarray,
    z: np.ndarray,
    fixed: np.ndarray,
    concerned: np.ndarray,
    error: np.ndarray,
    ends: list[np.ndarray],
) -> tuple[Parameter, ...]:
    units = {leaf.path: leaf.about.unit for leaf in leaves(scene)}
    found = []
    for i, path in enumerate(search.model.plan.paths):
        state = State.OPEN if concerned[i] else State.FITTED
        if fixed[i]:
            state = State.AT_LOW if z[i] == 0 else State.AT_HIGH
        spread = np.inf if concerned[i] else np.nan if fixed[i] else float(error[i])
        interval = (float(ends[0][i]), float(ends[1][i]))
        if concerned[i] or fixed[i]:
            interval = (-np.inf, np.inf) if concerned[i] else (np.nan, np.nan)
        unit = units.get(path, units.get(path.rpartition("[")[0], ""))
        low, high = float(search.scale.low[i]), float(search.scale.high[i])
        logarithmic = bool(search.scale.logarithmic[i])
        found.append(
            Parameter(path, unit, float(theta[i]), spread, interval, state, float(first[i]), low, high, logarithmic)
        )
    return tuple(found)


def _residuals(
    data: Measured,
    search: Search,
    model: np.ndarray,
    before: np.ndarray,
    chi2: float,
    freedom: int,
    absolute: bool,
) -> tuple[Residuals, ...]:
    # without absolute standard deviations residuals are told in those that the scatter shows
    scatter = 1.0 if absolute or chi2 == 0 or freedom <= 0 else np.sqrt(chi2 / freedom)
    found = []
    for part, here in slices(data):
        t = part.t if isinstance(part, Points) else None
        sigma = scatter * search.sigma[here]
        found.append(Residuals(part.name, part.unit, t, search.measured[here], sigma, before[here], model[here]))
    return tuple(found)


def _combination(
    one: Direction, others: list[Direction], names: list[str], rate: np.ndarray, relative: np.ndarray
) -> OpenCombination:
    """An open direction in relative changes of the parameters, and in words."""
    change = one.change * rate
    change = change / change[np.argmax(np.abs(change))]
    told = [int(i) for i in np.argsort(-np.abs(change), kind="stable") if abs(change[i]) >= _SMALL]
    parts = [f"{names[i]} {change[i] * (1.0 if relative[i] else 0.01):+.3g}{' %' if relative[i] else ''}" for i in told]
    if len(told) == 1:
        words = f"{names[told[0]]}: no measured value depends on it"
        rest = [names[i] for i in np.flatnonzero(one.change) if i != told[0]]
        if np.isfinite(one.spread):
            words = f"{names[told[0]]}: its bounds say more of it than the data"
        elif rest:
            words = f"{names[told[0]]}: within its bounds it does no more than tiny changes of {', '.join(rest)}"
    else:
        together = f"{', '.join(parts[:-1])} and {parts[-1]} together"
        words = f"{together} change no measured value"
        if np.isfinite(one.spread):
            words = f"{together} change the measured values by less than their errors show within the bounds"
    alone = [other for other in others if other is not one and any(abs(other.change[i]) > 1e-6 for i in told)]
    if len(told) == 2 and all(relative[told]) and not alone:
        power = -change[told[0]] / change[told[1]]
        words += f"; the data hold only ({names[told[0]]})·({names[told[1]]})^{power:.3g}"
    if np.isfinite(one.spread):
        words += f" (standard error {one.spread:.3g} of their range)"
    shown: dict[str, Any] = {name: float(x) for name, x in zip(names, change, strict=True)}
    return OpenCombination(shown, one.singular_value, one.spread, words)


def _warnings(
    search: Search, z: np.ndarray, chi2: float, probability: float | None, fixed: np.ndarray, paths: tuple[str, ...]
) -> list[str]:
    found = []
    if probability is not None and probability < _UNLIKELY:
        what = f"chi² is as improbable as {probability:.1g}: the model does not explain the data within their errors"
        found.append(f"{what}, and the standard errors are too small")
    elif probability is not None and probability > 1 - _UNLIKELY and chi2 > 0:
        found.append("chi² is improbably small: the standard deviations of the data are too large")
    if fixed.any():
        named = ", ".join(path for path, at in zip(paths, fixed, strict=True) if at)
        found.append(f"pressed on a bound: {named}; the errors of the others take it as given")
    if not search.converged:
        found.append("the search has not converged: values and errors are those of the best point found")
    least = min((cost for cost, _ in search.ends), default=np.inf)
    far = [
        end
        for cost, end in search.ends
        if cost <= least * 1.01 + 1e-12 * search.measured.size and np.max(np.abs(end - z)) > 0.05
    ]
    if far:
        values = ", ".join(f"{p} = {v:.5g}" for p, v in zip(paths, search.scale.up(far[0]), strict=True))
        found.append(f"not unique: {len(far)} other starts end as well elsewhere, one at {values}")
    reasons = ", ".join(f"{reason} ({n} times)" for reason, n in search.model.failures.items())
    if reasons:
        found.append(f"trial points were refused: {reasons}")
    return found
