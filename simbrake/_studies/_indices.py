"""Tables of global sensitivity: Sobol indices and elementary effects, for people and as dictionaries."""

import dataclasses
from typing import Any

from .._run._measure import Metric, name_of
from ._confidence import Estimate


@dataclasses.dataclass(frozen=True)
class SobolIndex:
    """Shares of a metric's variance that come from one number alone (`first`) and with all it acts on (`total`)."""

    path: str
    first: Estimate
    total: Estimate


@dataclasses.dataclass(frozen=True)
class SobolPair:
    """Share of a metric's variance that two numbers make together, beyond what each makes alone."""

    paths: tuple[str, str]
    second: Estimate


@dataclasses.dataclass(frozen=True)
class SobolTable:
    """Indices of one metric, the greatest total effect first; its mean and standard deviation over the samples."""

    metric: str
    unit: str
    mean: float
    deviation: float
    indices: tuple[SobolIndex, ...]
    pairs: tuple[SobolPair, ...] | None
    confidence: float

    @property
    def alone(self) -> float:
        """Sum of the first-order indices: what is missing to 1 are interactions."""
        return sum(one.first.value for one in self.indices)

    def __str__(self) -> str:
        unit = f" {self.unit}" if self.unit else ""
        wide = max(len(one.path) for one in self.indices) + 2
        lines = [
            f"{self.metric}: mean {self.mean:.6g}{unit}, standard deviation {self.deviation:.4g}{unit}",
            f"{'number':{wide}}{'total S_T':>22}{'first order S_1':>24}"
            + f"   (± half of the {100 * self.confidence:g} % interval)",
        ]
        lines += [f"{one.path:{wide}}{_shown(one.total):>22}{_shown(one.first):>24}" for one in self.indices]
        lines.append(f"sum of the first order {self.alone:.3f}: what is missing to 1 are interactions")
        for pair in self.pairs or ():
            if pair.second.low > 0:
                lines.append(f"together {pair.paths[0]} × {pair.paths[1]}: {_shown(pair.second)}")
        if self.pairs and not any(pair.second.low > 0 for pair in self.pairs):
            lines.append("no pair whose interaction is surely not 0")
        return "\n".join(lines)

    def as_dict(self) -> dict[str, Any]:
        return {
            "metric": self.metric,
            "unit": self.unit,
            "mean": self.mean,
            "standard_deviation": self.deviation,
            "confidence": self.confidence,
            "indices": [
                {"path": one.path, "first": one.first.as_dict(), "total": one.total.as_dict()} for one in self.indices
            ],
            "pairs": None
            if self.pairs is None
            else [{"paths": list(pair.paths), "second": pair.second.as_dict()} for pair in self.pairs],
        }


@dataclasses.dataclass(frozen=True)
class MorrisEffect:
    """Elementary effects of one number: change of the metric if it crosses its range (SI units of the metric).

    - `mu`: mean;  `mu_star`: mean of the absolute values;  `sigma`: how much it depends on where the others are
    - `low`, `high`: the range crossed
    """

    path: str
    unit: str
    low: float
    high: float
    mu: float
    mu_star: Estimate
    sigma: float


@dataclasses.dataclass(frozen=True)
class MorrisTable:
    """Elementary effects on one metric, the greatest first."""

    metric: str
    unit: str
    effects: tuple[MorrisEffect, ...]
    confidence: float

    def __str__(self) -> str:
        unit = f", {self.unit}" if self.unit else ""
        wide = max(len(one.path) for one in self.effects) + 2
        ranges = [f"{one.low:.4g} … {one.high:.4g} {'' if one.unit == '1' else one.unit}" for one in self.effects]
        across = max(map(len, ranges)) + 2
        lines = [
            f"{self.metric}{unit}: effect of crossing the range (± half of the {100 * self.confidence:g} % interval)",
            f"{'number':{wide}}{'range':{across}}{'mean |effect| μ*':>24}{'mean μ':>12}{'σ':>12}",
        ]
        lines += [
            f"{one.path:{wide}}{span:{across}}{_shown(one.mu_star):>24}{one.mu:12.4g}{one.sigma:12.4g}"
            for one, span in zip(self.effects, ranges, strict=True)
        ]
        return "\n".join(lines)

    def as_dict(self) -> dict[str, Any]:
        rows = [{**dataclasses.asdict(one), "mu_star": one.mu_star.as_dict()} for one in self.effects]
        return {"metric": self.metric, "unit": self.unit, "confidence": self.confidence, "effects": rows}


@dataclasses.dataclass(frozen=True)
class GlobalSensitivity:
    """Tables by metric (`found["stopping_time"]`), and every run in `data`."""

    tables: dict[str, Any]
    data: Any
    method: str
    runs: int

    def __getitem__(self, metric: Metric) -> Any:
        return self.tables[name_of(metric)]

    def __str__(self) -> str:
        return "\n\n".join([f"{self.method}, {self.runs} runs", *map(str, self.tables.values())])

    def as_dict(self) -> dict[str, Any]:
        tables = {name: table.as_dict() for name, table in self.tables.items()}
        return {"method": self.method, "runs": self.runs, "metrics": tables}


def around(value: Any, half: Any) -> Estimate:
    """A value and what lies `half` to either side."""
    return Estimate(float(value), float(value - half), float(value + half))


def _shown(e: Estimate) -> str:
    return f"{e.value:.4g} ± {e.high - e.value:.2g}"
