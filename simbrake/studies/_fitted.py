"""Results of a fit: parameters with their errors, residuals, and what is left open."""

import dataclasses
import enum
from collections.abc import Iterator
from typing import Any

import numpy as np

from .._base._faults import input_error
from .._base._table import Column, Table, Tabular, frozen, plain
from ..parts.scene import Scene
from .measured import Measured


class State(enum.StrEnum):
    """Status of a fitted parameter.

    Example:
        >>> [state.name for state in sb.studies.State]
        ['FITTED', 'OPEN', 'AT_LOW', 'AT_HIGH']
    """

    FITTED = "fitted"
    OPEN = "open"
    AT_LOW = "at_lower_bound"
    AT_HIGH = "at_upper_bound"


class Outcome(enum.StrEnum):
    """What a fit has learned.

    - `CONVERGED`: the residual no longer decreases, and the data determine every
      parameter, or a bound does
    - `NOT_DETERMINED`: it no longer decreases, but the data leave parameters open
    - `NOT_CONVERGED`: the search ended before: limit of evaluations, rejected points,
      interruption

    Example:
        >>> [str(outcome) for outcome in sb.studies.Outcome]
        ['converged', 'not_determined', 'not_converged']
    """

    CONVERGED = "converged"
    NOT_DETERMINED = "not_determined"
    NOT_CONVERGED = "not_converged"


@frozen
class FixedNumber:
    """A fixed number of the scene that the data do not tell apart from a fitted
    parameter.

    - `path`, `value` (SI; the largest entry of a list, of which all entries change in
      proportion)
    - `parameter`: path of the fitted one;  `correlation` of the two if both were fitted
    - `shift`: relative change of the parameter per relative change of the number,
      `(dθ/θ)/(dk/k)` (`dθ/(dk/k)` where θ is 0): an error of 1 % in the number is one
      of `shift` % in the parameter, which its standard error leaves out

    Example:
        >>> sb.studies.FixedNumber("drum", 0.4, "m", "friction", 0.999, -1.2).shift
        -1.2
    """

    path: str
    value: float
    unit: str
    parameter: str
    correlation: float
    shift: float


@frozen
class Parameter:
    """One fitted parameter, in SI units; `path` is `initial.omega@NAME` of one that
    only the recording NAME has.

    - `standard_error`: `inf` where the data do not determine the parameter, NaN at a
      bound (the other errors assume it as fixed);  `interval`: confidence interval of
      `Calibration.confidence`, symmetric in the scale of the fit
    - `profile`: values at which `min χ²` over all other parameters exceeds its least
      value by the quantile of χ² for the confidence; `±inf` where it does not up to the
      bound, `None` where it was not asked for
    - `low`, `high`: the bounds;  `logarithmic`: fitted on a logarithmic scale
    """

    path: str
    unit: str
    value: float
    standard_error: float
    interval: tuple[float, float]
    state: State
    start: float
    low: float
    high: float
    logarithmic: bool
    profile: tuple[float, float] | None = None


@frozen
class Residuals:
    """Measured and fitted values of one column or event, in SI units; `scaled` is
    (model − measured)/σ. Of several recordings the name is `omega@NAME`."""

    name: str
    unit: str
    t: np.ndarray | None
    measured: np.ndarray
    sigma: np.ndarray
    before: np.ndarray
    model: np.ndarray

    @property
    def scaled(self) -> np.ndarray:
        return (self.model - self.measured) / self.sigma

    @property
    def largest(self) -> float:
        """Largest magnitude of `scaled`."""
        return float(np.max(np.abs(self.scaled)))


@frozen
class FittedRecording:
    """A recording in a fit: its data, its scene with the start values and with the
    fitted ones. The name is empty where it is the only one."""

    name: str
    data: Measured
    before: Scene
    scene: Scene


@frozen
class Calibration(Tabular):
    """A fit of a scene's parameters to measured data of one or more recordings.

    - `parameters`, `covariance`, `correlation` (p, p), in the order of the parameters;
      SI units. Open parameters have infinite variances, parameters at a bound NaN, and
      both NaN covariances
    - `chi2 = Σ ((model − measured)/σ)²`, `freedom` degrees of freedom; `absolute`: the
      σ are absolute, else errors are scaled by `chi2/freedom`;  `probability` of a
      larger `chi2` where they are
    - `singular_values` of the Jacobian in standard deviations per range of the bounds
    - `open`: combinations that the data do not determine: `dθ_i/θ_i` of each parameter
      by path (`dθ_i` where `θ_i` is 0), the largest 1
    - `scene`: the scene with the fitted numbers
    - `before`: with the start values. Of several recordings both have the
      shared parameters alone, and `recordings` has the scene and the data of each
    - `outcome`, `message`: why the search ended
    - `converged`: whether it ended at a minimum, also where the data do
      not determine every parameter
    - `fixed`: fixed numbers that correlate by more than 0.99 with a fitted one, those
      with the largest effect first
    - `evaluations` of model and Jacobian together, `failures`: rejected trial points,
      by reason
    """

    parameters: tuple[Parameter, ...]
    covariance: np.ndarray
    chi2: float
    chi2_start: float
    freedom: int
    absolute: bool
    probability: float | None
    confidence: float
    singular_values: np.ndarray
    open: tuple[dict[str, float], ...]
    residuals: tuple[Residuals, ...]
    scene: Scene
    before: Scene
    recordings: tuple[FittedRecording, ...]
    converged: bool
    message: str
    evaluations: int
    failures: dict[str, int]
    solver: str
    loss: str
    warnings: tuple[str, ...]
    outcome: Outcome
    fixed: tuple[FixedNumber, ...]

    def __getitem__(self, path: str) -> Parameter:
        return {parameter.path: parameter for parameter in self.parameters}[path]

    def of(
        self, recording: str | None = None
    ) -> tuple[FittedRecording, list[Residuals]]:
        """A recording and its residuals, by default that with the largest residual.
        Raises `InputError`."""
        parts = iter(self.residuals)
        rows = {
            each.name: (each, [next(parts) for _ in each.data.all])
            for each in self.recordings
        }
        if recording is None:
            return max(
                rows.values(), key=lambda row: max(part.largest for part in row[1])
            )
        if recording not in rows:
            raise input_error(
                "recording",
                f"there is no {recording!r}",
                f"there are: {', '.join(rows)}",
            )
        return rows[recording]

    @property
    def values(self) -> dict[str, float]:
        """Fitted values by path."""
        return {parameter.path: parameter.value for parameter in self.parameters}

    @property
    def correlation(self) -> np.ndarray:
        """Correlation of the fitted parameters; NaN where one is open or at a bound."""
        error = np.sqrt(np.diag(self.covariance))
        known = np.isfinite(error) & (error > 0)
        safe = np.where(known, error, 1.0)
        matrix = self.covariance / np.outer(safe, safe)
        return np.where(np.outer(known, known), matrix, np.nan)

    @property
    def reduced_chi2(self) -> float:
        """`chi2` per degree of freedom; NaN without any."""
        return self.chi2 / self.freedom if self.freedom > 0 else np.nan

    @property
    def headline(self) -> str:
        """What the fit has learned, in one line."""
        text = f"{self.outcome.replace('_', ' ')}: {self.message}"
        if self.freedom > 0 and self.converged:
            text += f"; {self._reduced}"
        if self.probability is not None and self.probability < UNLIKELY:
            text += ": the model does not explain the data"
        if self.fixed:
            named = [
                f"{number.path} ({number.correlation:+.4f} with {number.parameter})"
                for number in self.fixed[:_NAMED]
            ]
            more = (
                f" and {len(self.fixed) - _NAMED} more"
                if len(self.fixed) > _NAMED
                else ""
            )
            text += (
                f"; cannot be told apart from fixed numbers: {', '.join(named)}{more}"
            )
        return text

    @property
    def _reduced(self) -> str:
        return f"reduced χ² {self.reduced_chi2:.3g} ({self.freedom} degrees of freedom)"

    def as_dict(self) -> dict[str, Any]:
        """Return the data for JSON; `null` where a number is infinite or unknown."""
        names = (
            "outcome headline converged message confidence covariance correlation "
            "chi2 chi2_start reduced_chi2"
        )
        names += " singular_values open fixed evaluations failures solver loss warnings"
        data: dict[str, Any] = {name: getattr(self, name) for name in names.split()}
        parameters = map(dataclasses.asdict, self.parameters)
        data["parameters"] = [
            p | {"bounds": [p.pop("low"), p.pop("high")]} for p in parameters
        ]
        data["degrees_of_freedom"] = self.freedom
        data |= {
            "probability_of_larger_chi2": self.probability,
            "absolute_sigma": self.absolute,
        }
        data["residuals"] = [
            {
                "name": r.name,
                "unit": r.unit,
                "count": r.scaled.size,
                "chi2": r.scaled @ r.scaled,
                "largest": r.largest,
            }
            for r in self.residuals
        ]
        return plain(data)

    def parts(self) -> Iterator[str | Table]:
        yield self.headline
        profiled = any(p.profile for p in self.parameters)
        ends = ("from", "to")
        columns = [
            ("path", "parameter"),
            Column("value"),
            "unit",
            Column("standard error", show=".2g"),
            *(Column(f"{100 * self.confidence:g} % {end}") for end in ends),
            *(Column(f"profile {end}", hidden=not profiled) for end in ends),
            Column("start"),
            ("state", ""),
        ]
        rows = [
            (
                p.path,
                p.value,
                "" if p.unit == "1" else p.unit,
                *(
                    (p.standard_error, *p.interval)
                    if p.state == State.FITTED
                    else (None,) * 3
                ),
                *(p.profile or (None, None)),
                p.start,
                _words(p),
            )
            for p in self.parameters
        ]
        yield Table(columns, rows)
        yield self._quality()
        for i, j in zip(
            *np.nonzero(np.abs(np.tril(self.correlation, -1)) > 0.9), strict=True
        ):
            pair = f"{self.parameters[j].path} and {self.parameters[i].path}"
            yield f"corr     {self.correlation[i, j]:+.4f} between {pair}"
        for row in self.open:
            shares = (
                f"{path} {share:+.3g}"
                for path, share in row.items()
                if abs(share) >= _SMALL
            )
            yield f"open     {', '.join(shares)} (relative changes) together"
        for number in self.fixed:
            shift = (
                f"shifts {number.parameter} by {number.shift:+.3g} %, correlation "
                f"{number.correlation:+.4f}"
            )
            yield f"fixed    {number.path} +1 % {shift}"
        data = [
            ("name", "data"),
            Column("values"),
            Column("rms", display_units="σ", show=".3g"),
        ]
        rows = [
            (r.name, r.scaled.size, np.sqrt(np.mean(r.scaled**2)), r.largest)
            for r in self.residuals
        ]
        yield Table([*data, Column("maximum", display_units="σ", show=".3g")], rows)
        yield from (f"warning  {text}" for text in self.warnings)
        refused = sum(self.failures.values())
        yield (
            f"solver   {self.solver}, {self.evaluations} runs with derivatives, "
            f"{refused} rejected"
        )

    def _quality(self) -> str:
        text = f"χ²       {self.chi2_start:.5g} → {self.chi2:.5g}"
        text += f", {self._reduced}" if self.freedom > 0 else ", no degrees of freedom"
        if self.probability is not None:
            return f"{text}; a larger one has probability {self.probability:.2g}"
        return (
            text
            if self.absolute
            else f"{text}; errors are scaled by it, as σ are not absolute"
        )


def _words(p: Parameter) -> str:
    if p.state == State.OPEN:
        at = ", and it reached a bound" if p.value in (p.low, p.high) else ""
        return f"standard error infinite: not determined by the data{at}"
    return {
        State.AT_LOW: "at its lower bound",
        State.AT_HIGH: "at its upper bound",
    }.get(p.state, "")


#: smaller shares of a combination are not named
_SMALL = 0.01
_NAMED = 3
#: probability of χ² below which model and data disagree
UNLIKELY = 1e-3
