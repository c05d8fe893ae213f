"""Fitting parameters of a scene to measured data: bounded least squares, errors, and
undetermined parameters."""

from collections.abc import Mapping, Sequence

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


def assess(
    search: Search,
    scene: Scene,
    *,
    absolute: bool,
    confidence: float,
    profile: bool,
) -> Calibration:
    """The calibration at the best point of a search."""
    from scipy import stats  # slow to import: loaded by a fit only

    assert search.best is not None
    least, z, best = search.best
    box = search.box
    model = search.model
    paths = model.paths
    theta = box.up(z)
    slope = box.slope(theta)
    residual = search.residual(best)
    fixed = search.pressed(z) & ((z == 0) | (z == 1))
    # noise alone drives an undetermined parameter to a bound: then the bound fixes it,
    # not the data
    if fixed.any():
        fixed &= ~_identified(search, z, np.zeros_like(fixed), absolute).concerned
    known = _identified(search, z, fixed, absolute)
    chi2 = float(residual @ residual)
    freedom = residual.size - known.rank
    concerned = np.zeros(z.size, bool)
    concerned[~fixed] = known.concerned
    covariance = np.full((z.size, z.size), np.nan)
    covariance[np.ix_(~fixed, ~fixed)] = known.covariance
    error = np.where(concerned, np.inf, np.sqrt(np.diag(covariance)))
    # noise that is known is normal, else the scatter of the residuals gives Student's t
    noise_known = absolute and search.loss == "linear"
    quantile = np.inf
    if noise_known or freedom > 0:
        law = stats.norm if noise_known else stats.t(freedom)
        quantile = float(law.ppf(0.5 + confidence / 2))
    low, high = (
        np.where(concerned, side * np.inf, box.up(z + side * quantile * error))
        for side in (-1.0, 1.0)
    )
    covariance *= np.outer(slope, slope)
    covariance[concerned] = covariance[:, concerned] = np.nan
    covariance[concerned, concerned] = np.inf
    probability = (
        float(stats.chi2.sf(chi2, freedom)) if noise_known and freedom > 0 else None
    )
    start = model(box.start)
    # without absolute standard deviations residuals are scaled by the scatter
    scatter = 1.0 if absolute or chi2 == 0 or freedom <= 0 else np.sqrt(chi2 / freedom)
    columns = map(
        model.split,
        (search.measured, scatter * search.sigma, start.values, best.values),
    )
    residuals = tuple(
        Residuals(each.label(part.name), part.unit, part.t, *row)
        for (each, part), *row in zip(model.parts, *columns, strict=True)
    )
    outcome = Outcome.CONVERGED
    message = search.message
    if not search.converged:
        outcome = Outcome.NOT_CONVERGED
    elif concerned.any():
        outcome = Outcome.NOT_DETERMINED
        names = [path for path, c in zip(paths, concerned, strict=True) if c]
        message = f"the data do not determine {', '.join(names)}"
    names = [path for path, at in zip(paths, fixed, strict=True) if not at]
    changes = known.open * (slope / np.where(theta == 0, 1.0, theta))[~fixed]
    changes = [change / change[np.argmax(np.abs(change))] for change in changes]
    scenes = zip(model.scenes(box.start), model.scenes(theta), strict=True)
    recordings = tuple(
        FittedRecording(each.name, each.data, *pair)
        for each, pair in zip(model.recordings, scenes, strict=True)
    )
    before, after = (
        (recordings[0].before, recordings[0].scene)
        if len(recordings) == 1
        else (
            with_values(scene, dict(zip(paths[: model.shared], x, strict=False)))
            for x in (box.start, theta)
        )
    )
    tied = _tied(search, z, theta, ~fixed, concerned, scene)
    warnings = _warnings(search, z, chi2, probability)
    failures = dict(model.failures)
    profiles: list[tuple[float, float] | None] = [None] * z.size
    if profile and search.converged:
        rise = quantile**2 * (1.0 if absolute else chi2 / freedom)
        profiles = _profiles(search, z, rise, quantile * error)
        if search.best[0] < least - _BETTER * rise:
            there = _numbers_at(search, search.best[1])
            warnings.append(
                f"a profile has passed a better fit: start again from {there}"
            )
    inputs = Inputs(scene)
    parameters = tuple(
        Parameter(
            path=path,
            unit=inputs.about(model.fields[i]).unit,
            value=float(theta[i]),
            standard_error=float(error[i] * slope[i]),
            interval=(float(low[i]), float(high[i])),
            state=_state(concerned[i], fixed[i], z[i]),
            start=float(box.start[i]),
            low=float(box.low[i]),
            high=float(box.high[i]),
            logarithmic=bool(box.logarithmic[i]),
            profile=profiles[i],
        )
        for i, path in enumerate(paths)
    )
    notes = dict.fromkeys(
        f"data: {note}" for each in recordings for note in each.data.notes
    )
    solver = solver_name(model.solver)
    return Calibration(
        parameters=parameters,
        covariance=covariance,
        chi2=chi2,
        chi2_start=float(np.sum(search.residual(start) ** 2))
        if start.more is None
        else np.inf,
        freedom=freedom,
        absolute=absolute,
        probability=probability,
        confidence=confidence,
        singular_values=known.singular_values,
        open=tuple(
            dict(zip(names, change.tolist(), strict=True)) for change in changes
        ),
        residuals=residuals,
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
        fixed=tied,
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


def _tied(
    search: Search,
    z: np.ndarray,
    theta: np.ndarray,
    free: np.ndarray,
    concerned: np.ndarray,
    scene: Scene,
) -> tuple[FixedNumber, ...]:
    """Fixed numbers that are not told apart from fitted parameters, those with the
    largest effect in standard errors first."""
    if not (free & ~concerned).any():
        return ()
    slope = search.box.slope(theta)
    jacobian = search.jacobian(z)[:, free]
    which = np.flatnonzero(free)
    inputs = Inputs(scene)
    rows: list[tuple[float, FixedNumber]] = []
    for path, value, change in search.model.of_fixed(theta):
        ties = confound(jacobian, change / search.sigma, max(search.noise, STEP**2))
        strength = np.where(concerned[which], 0.0, np.abs(ties.correlation))
        k = int(np.argmax(strength))
        i = which[k]
        shift = ties.shift[k] * slope[i]
        error = float(np.sqrt(ties.variance[k])) * slope[i]
        # else an error of the whole number would not matter
        if strength[k] > _TIED and abs(shift) > error:
            relative = float(shift / theta[i]) if theta[i] else float(shift)
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


def _warnings(
    search: Search, z: np.ndarray, chi2: float, probability: float | None
) -> list[str]:
    warnings = []
    if probability is not None and probability > 1 - UNLIKELY and chi2 > 0:
        warnings.append(
            "χ² is improbably small: the standard deviations of the data are too large"
        )
    least = min((cost for cost, _ in search.ends), default=np.inf)
    equal = least * 1.01 + 1e-12 * search.measured.size
    far = [
        end
        for cost, end in search.ends
        if cost <= equal and np.max(np.abs(end - z)) > 0.05
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
    """Whether standard deviations are absolute; adds their errors."""
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
