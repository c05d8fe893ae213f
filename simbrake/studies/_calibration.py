"""Fitting parameters of a scene to measured data: bounded least squares, errors, and
undetermined parameters."""

import itertools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from .._base._faults import Fault, Issues
from .._base._progress import Progress
from ..parts.scene import Scene
from ..runs.edit import with_values
from ..runs.simulate import check_limits, solver_name
from ._determined import LOSSES, Identified, confound, identify
from ._fit import Search
from ._fitted import (
    UNLIKELY,
    Calibration,
    FittedRecording,
    FixedNumber,
    Outcome,
    Parameter,
    Residuals,
    State,
)
from ._recordings import (
    STEP,
    Bounds,
    FitModel,
    Recording,
    box_of_all,
    recordings_of,
    solver_within,
)
from .bounds import Inputs
from .evaluating import Solver
from .measured import Measured

#: correlation above which a fixed number is not told apart from a fitted one, and how
#: many the headline names
_TIED = 0.99
#: share of the cost by which another point must fit better
_BETTER = 0.01


class _Best(NamedTuple):
    """The best point of a search, and what the data say of it to first order.

    - `z` (p,) between 0 and 1, the parameters `theta`, and their `slope` by it
    - `fixed`: determined by a bound; `known`: what the data determine of the others
    - `open`: determined by neither
    - `error` of `z`, `covariance` (p, p) of the parameters
    - `quantile`: standard errors from the best point to the end of an interval
    - `probability` of a smaller χ², `None` without known noise or degrees of freedom
    """

    z: np.ndarray
    theta: np.ndarray
    slope: np.ndarray
    fixed: np.ndarray
    known: Identified
    open: np.ndarray
    error: np.ndarray
    covariance: np.ndarray
    quantile: float
    chi2: float
    freedom: int
    probability: float | None


def _best(search: Search, z: np.ndarray, absolute: bool, confidence: float) -> _Best:
    from scipy import stats  # slow to import: loaded by a fit only

    residual = search.residual(search.evaluate(z))
    fixed = search.pressed(z) & ((z == 0) | (z == 1))
    # noise alone drives an undetermined parameter to a bound: then the bound fixes it,
    # not the data
    if fixed.any():
        fixed &= ~_identified(search, z, np.zeros_like(fixed), absolute).concerned
    known = _identified(search, z, fixed, absolute)
    chi2 = float(residual @ residual)
    freedom = residual.size - known.rank
    open_ = np.zeros(z.size, bool)
    open_[~fixed] = known.concerned
    covariance = np.full((z.size, z.size), np.nan)
    covariance[np.ix_(~fixed, ~fixed)] = known.covariance
    error = np.where(open_, np.inf, np.sqrt(np.diag(covariance)))
    theta = search.box.up(z)
    slope = search.box.slope(theta)
    covariance *= np.outer(slope, slope)
    covariance[open_] = covariance[:, open_] = np.nan
    covariance[open_, open_] = np.inf
    # noise that is known is normal, else the scatter of the residuals gives Student's t
    noise_known = absolute and search.loss == "linear"
    quantile = np.inf
    if noise_known or freedom > 0:
        law = stats.norm if noise_known else stats.t(freedom)
        quantile = float(law.ppf(0.5 + confidence / 2))
    probability = None
    if noise_known and freedom > 0:
        probability = float(stats.chi2.sf(chi2, freedom))
    return _Best(
        *(z, theta, slope, fixed, known, open_, error, covariance),
        *(quantile, chi2, freedom, probability),
    )


def assess(
    search: Search,
    scene: Scene,
    *,
    absolute: bool,
    confidence: float,
    profile: bool,
) -> Calibration:
    """The calibration at the best point of a search: its errors, what is tied to the
    parameters, their profiles, and the runs before and after."""
    assert search.best is not None
    least, z, evaluation = search.best
    model = search.model
    best = _best(search, z, absolute, confidence)
    start = model(search.box.start)
    fixed_numbers = _tied(search, best, scene)
    warnings = _warnings(search, best)
    failures = dict(model.failures)
    profiles: list[tuple[float, float] | None] = [None] * z.size
    if profile and search.converged:
        scale = 1.0 if absolute else best.chi2 / best.freedom
        rise = best.quantile**2 * scale
        profiles = _profiles(search, z, rise, best.quantile * best.error)
        if search.best[0] < least - _BETTER * rise:
            there = _numbers_at(search, search.best[1])
            warnings.append(
                f"a profile has passed a better fit: start again from {there}"
            )
    # without absolute standard deviations residuals are scaled by the scatter
    scatter = 1.0
    if not absolute and best.chi2 > 0 and best.freedom > 0:
        scatter = np.sqrt(best.chi2 / best.freedom)
    recordings = _recordings(model, search.box.start, best.theta)
    if len(recordings) == 1:
        before, after = recordings[0].before, recordings[0].scene
    else:
        shared = model.paths[: model.shared]
        before, after = (
            with_values(scene, dict(zip(shared, numbers, strict=False)))
            for numbers in (search.box.start, best.theta)
        )
    outcome, message = _outcome(search, best)
    notes = dict.fromkeys(
        f"data: {note}" for each in recordings for note in each.data.notes
    )
    solver = solver_name(model.solver)
    return Calibration(
        parameters=_parameters(search, scene, best, profiles),
        covariance=best.covariance,
        chi2=best.chi2,
        chi2_start=float(np.sum(search.residual(start) ** 2))
        if start.more is None
        else np.inf,
        freedom=best.freedom,
        absolute=absolute,
        probability=best.probability,
        confidence=confidence,
        singular_values=best.known.singular_values,
        open=_open_directions(best, model.paths),
        residuals=_residuals(search, scatter, start.values, evaluation.values),
        before=before,
        scene=after,
        recordings=recordings,
        converged=search.converged,
        message=message,
        evaluations=model.points * len(recordings),
        failures=failures,
        solver=f"{solver}, rtol {model.run.rtol:g}, {search.method}",
        loss=search.loss,
        warnings=(*warnings, *notes),
        outcome=outcome,
        fixed=fixed_numbers,
    )


def _outcome(search: Search, best: _Best) -> tuple[Outcome, str]:
    """How the fit ended, and why in words."""
    if not search.converged:
        return Outcome.NOT_CONVERGED, search.message
    if not best.open.any():
        return Outcome.CONVERGED, search.message
    names = itertools.compress(search.model.paths, best.open)
    return Outcome.NOT_DETERMINED, f"the data do not determine {', '.join(names)}"


def _parameters(
    search: Search,
    scene: Scene,
    best: _Best,
    profiles: list[tuple[float, float] | None],
) -> tuple[Parameter, ...]:
    box = search.box
    standard_error = best.error * best.slope
    low, high = (
        np.where(
            best.open,
            side * np.inf,
            box.up(best.z + side * best.quantile * best.error),
        )
        for side in (-1.0, 1.0)
    )
    inputs = Inputs(scene)
    return tuple(
        Parameter(
            path=path,
            unit=inputs.about(search.model.fields[i]).unit,
            value=float(best.theta[i]),
            standard_error=float(standard_error[i]),
            interval=(float(low[i]), float(high[i])),
            state=_state(best.open[i], best.fixed[i], best.z[i]),
            start=float(box.start[i]),
            low=float(box.low[i]),
            high=float(box.high[i]),
            logarithmic=bool(box.logarithmic[i]),
            profile=profiles[i],
        )
        for i, path in enumerate(search.model.paths)
    )


def _open_directions(best: _Best, paths: Sequence[str]) -> tuple[dict[str, float], ...]:
    """Relative changes of parameters that the data do not see, the largest 1."""
    free = ~best.fixed
    relative = best.slope / np.where(best.theta == 0, 1.0, best.theta)
    changes = best.known.open * relative[free]
    changes = [change / change[np.argmax(np.abs(change))] for change in changes]
    names = [*itertools.compress(paths, free)]
    return tuple(dict(zip(names, change.tolist(), strict=True)) for change in changes)


def _residuals(
    search: Search, scatter: float, start: np.ndarray, best: np.ndarray
) -> tuple[Residuals, ...]:
    """Measured values of all parts, their standard deviations, and those of the first
    and the best run."""
    model = search.model
    columns = map(model.split, (search.measured, scatter * search.sigma, start, best))
    return tuple(
        Residuals(each.label(part.name), part.unit, part.t, *row)
        for (each, part), *row in zip(model.parts, *columns, strict=True)
    )


def _recordings(
    model: FitModel, start: np.ndarray, theta: np.ndarray
) -> tuple[FittedRecording, ...]:
    scenes = zip(model.scenes(start), model.scenes(theta), strict=True)
    return tuple(
        FittedRecording(each.name, each.data, *pair)
        for each, pair in zip(model.recordings, scenes, strict=True)
    )


def _profiles(
    search: Search, z: np.ndarray, rise: float, widths: np.ndarray
) -> list[tuple[float, float] | None]:
    """Values of each parameter that all recordings share at the ends of its profile,
    `∓inf` where there is none; `None` of the others."""
    found: list[tuple[float, float] | None] = [None] * z.size
    with Progress("calibrate", "profiles…"):
        for i in range(search.model.shared):
            ends = []
            for end in search.profile(z, i, rise, widths[i]):
                if np.isfinite(end):
                    there = np.where(np.arange(z.size) == i, end, z)
                    end = float(search.box.up(there)[i])
                ends.append(end)
            found[i] = ends[0], ends[1]
    return found


def _state(open_: bool, fixed: bool, z: float) -> State:
    if open_ or not fixed:
        return State.OPEN if open_ else State.FITTED
    return State.AT_LOW if z == 0 else State.AT_HIGH


def _numbers_at(search: Search, z: np.ndarray) -> str:
    """Parameters of a point in words."""
    values = zip(search.model.paths, search.box.up(z), strict=True)
    return ", ".join(f"{path} = {value:.5g}" for path, value in values)


def _tied(search: Search, best: _Best, scene: Scene) -> tuple[FixedNumber, ...]:
    """Fixed numbers that are not told apart from fitted parameters, those with the
    largest effect in standard errors first."""
    free = ~best.fixed
    if not (free & ~best.open).any():
        return ()
    jacobian = search.jacobian(best.z)[:, free]
    which = np.flatnonzero(free)
    inputs = Inputs(scene)
    rows: list[tuple[float, FixedNumber]] = []
    for path, value, change in search.model.of_fixed(best.theta):
        ties = confound(jacobian, change / search.sigma, max(search.noise, STEP**2))
        strength = np.where(best.open[which], 0.0, np.abs(ties.correlation))
        k = int(np.argmax(strength))
        i = which[k]
        shift = ties.shift[k] * best.slope[i]
        error = float(np.sqrt(ties.variance[k])) * best.slope[i]
        # else an error of the whole number would not matter
        if strength[k] > _TIED and abs(shift) > error:
            relative = float(shift / best.theta[i]) if best.theta[i] else float(shift)
            unit = inputs[path].about.unit
            correlation = float(ties.correlation[k])
            row = FixedNumber(
                path, value, unit, search.model.paths[i], correlation, relative
            )
            rows.append((abs(shift) / error if error > 0 else np.inf, row))
    rows.sort(key=lambda row: -row[0])
    return tuple(row for _, row in rows)


def _identified(
    search: Search, z: np.ndarray, fixed: np.ndarray, absolute: bool
) -> Identified:
    return identify(
        search.jacobian(z)[:, ~fixed],
        search.residual(search.evaluate(z)),
        absolute=absolute,
        loss=search.loss,
        loss_scale=search.loss_scale,
        noise=search.noise,
    )


def _warnings(search: Search, best: _Best) -> list[str]:
    warnings = []
    probability = best.probability
    if probability is not None and probability > 1 - UNLIKELY and best.chi2 > 0:
        warnings.append(
            "χ² is improbably small: the standard deviations of the data are too large"
        )
    least = min((cost for cost, _ in search.ends), default=np.inf)
    equal = least * 1.01 + 1e-12 * search.measured.size
    far = [
        end
        for cost, end in search.ends
        if cost <= equal and np.max(np.abs(end - best.z)) > 0.05
    ]
    if far:
        there = _numbers_at(search, far[0])
        warnings.append(
            f"not unique: {len(far)} other starts end equally well elsewhere, one at {there}"
        )
    return warnings


def calibrate(
    scene: Scene,
    bounds: Bounds,
    data: Measured | Sequence[Measured] | Mapping[str, Measured],
    *,
    per_recording: Bounds | None = None,
    start: Mapping[str, float | str] | None = None,
    rtol: float = 1e-8,
    solver: Solver | None = None,
    max_steps: int | None = None,
    loss: str = "linear",
    loss_scale: float = 1.0,
    absolute: bool | None = None,
    confidence: float = 0.95,
    starts: int = 1,
    method: str = "trf",
    max_evaluations: int = 200,
    profile: bool = False,
) -> Calibration:
    """Fit parameters of a scene, within bounds, to measured data of one or more
    recordings.

        min ½ Σ ρ(((model − measured)/σ)²)

    - `bounds`: `{"brake.linings.friction.coefficient": (0.2, 0.5)}` in SI or as texts
      with units, paths as in `with_values`; where both are positive and their ratio
      exceeds 100 the search is logarithmic
    - `data`: `read_measured(…)` or `Measured.of(…)`; of several recordings a list
      (their names are 1, 2, …), or a dictionary by name. Numbers that are known of a
      recording are in its `Measured.known`
    - `per_recording`: bounds of parameters that differ between recordings; `bounds` are
      those of shared ones
    - `start`: start values, by default the scene's (those known of a recording);
      `"initial.omega@NAME"` is that of one
    - `rtol`, `solver`, `max_steps`: as for `simulate`
    - `loss`: `linear`, or against outliers `soft_l1`, `huber`, `cauchy`, `arctan` of
      residuals beyond `loss_scale` σ
    - `absolute`: whether the σ are absolute (errors from them alone) or only weights
      (errors scaled by the scatter of the residuals, Student's t); by default absolute
      where all are given
    - `starts`: number of starts, the first at `start`, the others spread over the
      bounds (Halton); the best fit counts
    - `method`: `trf` or `dogbox` of `scipy.optimize.least_squares`
    - `max_evaluations` of each start

    - `profile`: whether to find profile intervals of the shared parameters too, in some
      10 to 100 evaluations each

    A trial point whose run fails, or in which a measured event does not occur, is
    rejected: the step is shortened, and the reason is counted in
    `Calibration.failures`. Ctrl-C ends the search with the best point found so far.

    Raises `InputError` with all errors, also where no start has all measured events.
    Source: errors after Björck, Numerical Methods for Least Squares Problems (1996),
    1.1, 2.7; profiles after Pawitan, In All Likelihood (2001), 3.4.
    """
    issues = Issues()
    issues.choice("loss", loss, LOSSES)
    issues.choice("method", method, ("trf", "dogbox"))
    issues.unless(starts >= 1, "starts", starts, "at least 1")
    issues.share("confidence", confidence, 0.95)
    issues.unless(loss_scale > 0, "loss_scale", loss_scale, "> 0")
    issues.attempt(check_limits, rtol, max_steps=max_steps)
    if profile and loss != "linear":
        issues.add(
            "profile", f"is not known of the loss {loss}", 'it needs loss="linear"'
        )
    issues.unless(
        max_evaluations >= 1, "max_evaluations", max_evaluations, "at least 1"
    )
    own = per_recording or {}
    recordings = recordings_of(scene, data, issues)
    box = box_of_all(recordings, bounds, own, start or {}, issues)
    absolute = _absoluteness(
        recordings, absolute, len(bounds) + len(own) * len(recordings), issues
    )
    issues.report()
    solver = solver_within(recordings, {**bounds, **own}) if solver is None else solver
    model = FitModel(
        recordings,
        tuple(bounds),
        tuple(own),
        solver=solver,
        rtol=rtol,
        max_steps=max_steps,
    )
    model.check(box.start)
    search = Search(
        model, box, *model.arrays, loss, loss_scale, method, max_evaluations, starts
    )
    search.run()
    return assess(
        search, scene, absolute=absolute, confidence=confidence, profile=profile
    )


def _absoluteness(
    recordings: Sequence[Recording],
    absolute: bool | None,
    parameters: int,
    issues: Issues,
) -> bool:
    """Whether standard deviations are absolute; adds their best."""
    parts = [
        (each.label(part.name), part.sigma)
        for each in recordings
        for part in each.data.all
    ]
    without = [name for name, sigma in parts if sigma is None]
    count = sum(each.data.count for each in recordings)
    hint = "give its measuring error, as a column …_sigma or by sigma={…}"
    if without and (len(parts) > 1 or absolute):
        issues += [Fault(name, "has no standard deviation", hint) for name in without]
    if absolute is None:
        absolute = not without
    if not absolute and count <= parameters:
        what = f"{count} values do not determine their scatter with {parameters} parameters"
        issues.add("data", what, "measure more, or give standard deviations")
    return absolute
