"""What a fit gives back: values with errors, what the data leave open, and how well the model explains them."""

import dataclasses
import enum
from typing import Any

import numpy as np

from .._parts._scene import Scene
from ._measured import Measured


class State(enum.StrEnum):
    """What is known of a fitted parameter."""

    FITTED = "fitted"
    OPEN = "open"
    AT_LOW = "at_lower_bound"
    AT_HIGH = "at_upper_bound"


@dataclasses.dataclass(frozen=True)
class Parameter:
    """One fitted number, in SI units.

    - `standard_error`: `inf` where the data leave the parameter open, NaN at a bound (the other errors take it as
      given);  `interval`: confidence interval of `Calibration.confidence`, symmetric in the scale of the fit
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


@dataclasses.dataclass(frozen=True)
class Residuals:
    """Measured and fitted values of one column or event, in SI units; `scaled` is (model − measured)/σ."""

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


@dataclasses.dataclass(frozen=True)
class OpenCombination:
    """A direction in which the data do not hold the parameters.

    - `relative`: `dθ_i/θ_i` of every parameter along it, the largest 1 (`dθ_i` where `θ_i` is 0), at the fitted values
    - `spread`: its standard error over the range of the bounds; `inf`: the measurements do not depend on it at all
    - `words`: the same for people
    """

    relative: dict[str, float]
    singular_value: float
    spread: float
    words: str


@dataclasses.dataclass(frozen=True)
class Calibration:
    """A fit of a scene's numbers to measured data.

    - `parameters`, `covariance`, `correlation` (p, p), in the order of the parameters; SI units. Open parameters have
      infinite variances, parameters at a bound NaN, and both NaN covariances
    - `chi2 = Σ ((model − measured)/σ)²`, `freedom` degrees of freedom; `absolute`: the σ are absolute, else errors are
      scaled by `chi2/freedom`;  `probability` of a larger `chi2` where they are
    - `singular_values` of the Jacobian in standard deviations per range of the bounds; `open`: what the data leave open
    - `scene`: the scene with the fitted numbers;  `before`: with the start values
    - `converged`, `message`, `evaluations` of model and Jacobian together, `failures`: trial points refused, by reason
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
    open: tuple[OpenCombination, ...]
    residuals: tuple[Residuals, ...]
    scene: Scene
    before: Scene
    data: Measured
    converged: bool
    message: str
    evaluations: int
    failures: dict[str, int]
    solver: str
    loss: str
    warnings: tuple[str, ...]

    def __getitem__(self, path: str) -> Parameter:
        for parameter in self.parameters:
            if parameter.path == path:
                return parameter
        raise KeyError(path)

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
        found = self.covariance / np.outer(safe, safe)
        return np.where(np.outer(known, known), found, np.nan)

    @property
    def reduced_chi2(self) -> float:
        """`chi2` per degree of freedom; NaN without any."""
        return self.chi2 / self.freedom if self.freedom > 0 else float("nan")

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON; `null` where a number is infinite or unknown."""
        return {
            "converged": self.converged,
            "message": self.message,
            "parameters": [
                {
                    "path": p.path,
                    "unit": p.unit,
                    "value": p.value,
                    "standard_error": _number(p.standard_error),
                    "interval": [_number(end) for end in p.interval],
                    "state": str(p.state),
                    "start": p.start,
                    "bounds": [p.low, p.high],
                    "logarithmic": p.logarithmic,
                }
                for p in self.parameters
            ],
            "confidence": self.confidence,
            "covariance": _table(self.covariance),
            "correlation": _table(self.correlation),
            "chi2": self.chi2,
            "chi2_start": _number(self.chi2_start),
            "degrees_of_freedom": self.freedom,
            "reduced_chi2": _number(self.reduced_chi2),
            "probability_of_larger_chi2": self.probability,
            "absolute_sigma": self.absolute,
            "singular_values": [float(s) for s in self.singular_values],
            "open": [
                {
                    "relative_change": one.relative,
                    "singular_value": one.singular_value,
                    "spread": _number(one.spread),
                    "words": one.words,
                }
                for one in self.open
            ],
            "residuals": [
                {
                    "name": part.name,
                    "unit": part.unit,
                    "count": int(part.measured.size),
                    "chi2": float(np.sum(part.scaled**2)),
                    "largest": float(np.max(np.abs(part.scaled))),
                }
                for part in self.residuals
            ],
            "evaluations": self.evaluations,
            "failures": self.failures,
            "solver": self.solver,
            "loss": self.loss,
            "warnings": list(self.warnings),
        }

    def __str__(self) -> str:
        lines = [f"{'fitted' if self.converged else 'not converged'}: {self.message}"]
        width = max(len(p.path) for p in self.parameters)
        lines += [f"  {p.path:<{width}}  {_words(p, self.confidence)}" for p in self.parameters]
        lines.append(self._quality())
        if len(self.parameters) > 1:
            lines += self._correlations()
        lines += [f"open     {one.words}" for one in self.open]
        for part in self.residuals:
            rms = float(np.sqrt(np.mean(part.scaled**2)))
            worst = float(np.max(np.abs(part.scaled)))
            text = f"{part.measured.size} values, rms {rms:.3g} σ, at most {worst:.3g} σ"
            lines.append(f"data     {part.name}: {text}")
        lines += [f"warning  {text}" for text in self.warnings]
        refused = sum(self.failures.values())
        lines.append(f"solver   {self.solver}, {self.evaluations} runs with derivatives, {refused} refused")
        return "\n".join(lines)

    def _quality(self) -> str:
        text = f"chi²     {self.chi2_start:.5g} → {self.chi2:.5g} with {self.freedom} degrees of freedom"
        if self.freedom > 0:
            text += f", {self.reduced_chi2:.3g} each"
        if self.probability is not None:
            return f"{text}; a larger one has probability {self.probability:.2g}"
        return text if self.absolute else f"{text}; errors are scaled by it, as σ are not absolute"

    def _correlations(self) -> list[str]:
        table, lines = self.correlation, []
        for i in range(len(table)):
            for j in range(i):
                if abs(table[i, j]) > 0.9:
                    pair = f"{self.parameters[j].path} and {self.parameters[i].path}"
                    lines.append(f"corr     {table[i, j]:+.4f} between {pair}")
        return lines


def _words(p: Parameter, confidence: float) -> str:
    value = f"{p.value:<12.6g} {'' if p.unit == '1' else p.unit}".rstrip()
    if p.state == State.OPEN:
        at = ", and it ran into a bound" if p.value in (p.low, p.high) else ""
        return f"{value}  standard error infinite: the data leave it open{at}"
    if p.state in (State.AT_LOW, State.AT_HIGH):
        return f"{value}  at its {'lower' if p.state == State.AT_LOW else 'upper'} bound"
    low, high = p.interval
    return f"{value} ± {p.standard_error:.2g}  ({100 * confidence:g} %: {low:.6g}…{high:.6g}; start {p.start:.6g})"


def _number(x: float) -> float | None:
    return float(x) if np.isfinite(x) else None


def _table(matrix: np.ndarray) -> list[list[float | None]]:
    return [[_number(x) for x in row] for row in matrix]
