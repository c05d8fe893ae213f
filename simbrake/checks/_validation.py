"""Validation cases: what simbrake computes beside a truth from outside, and a verdict."""

import abc
import dataclasses
import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

PASS, FAIL = "pass", "fail"


class Case(NamedTuple):
    """One number that simbrake computes, `value()`, and what it should be.

    - `name`: subject, a slash, what is compared;  `source` of the truth: a closed form in symbols, or who published it
    - `truth`: from the closed form or as published;  `tolerance` of the error as `Check` has it
    """

    name: str
    source: str
    truth: float
    tolerance: float
    value: Callable[[], Any]


@dataclasses.dataclass(frozen=True)
class Check:
    """A case that was run.

    - `error`: `|value − truth|/|truth|`, and `|value − truth|` where the truth is 0; a message, with no value, where
      the run failed
    - `verdict`: `pass` while the error is not above the tolerance, else `fail`
    """

    case: str
    source: str
    value: float | None
    truth: float
    error: float | str
    tolerance: float
    verdict: str

    def as_dict(self) -> dict[str, Any]:
        return dataclasses.asdict(self)


def error_of(value: float, truth: float) -> float:
    """`|value − truth|/|truth|`, and `|value − truth|` where the truth is 0."""
    return abs(value - truth) / (abs(truth) or 1.0)


def run_case(case: Case) -> Check:
    """Runs a case; whatever it raises is a `fail` with the message."""
    given = case.name, case.source
    try:
        value = float(case.value())
    except Exception as problem:  # a validation has to come to its end, whatever is broken
        words = f"{type(problem).__name__}: {problem}".strip().splitlines()[0]
        return Check(*given, None, case.truth, words, case.tolerance, FAIL)
    if not math.isfinite(value):
        return Check(*given, None, case.truth, f"the value is {value}", case.tolerance, FAIL)
    error = error_of(value, case.truth)
    return Check(*given, value, case.truth, error, case.tolerance, PASS if error <= case.tolerance else FAIL)


def _number(x: float | None) -> str:
    return "—" if x is None else f"{x:.15g}"


def _cut(text: str, width: int) -> str:
    return text if len(text) <= width else text[: width - 1] + "…"


def table(checks: Sequence[Check], truth: str = "truth") -> str:
    """Checks as text in columns; messages of failed runs stand below their line."""
    lines = [f"{'case':42} {'value':>22} {truth:>22} {'error':>9} {'tolerance':>9} verdict  source"]
    for c in checks:
        error = "—" if isinstance(c.error, str) else f"{c.error:.1e}"
        lines.append(
            f"{_cut(c.case, 42):42} {_number(c.value):>22} {_number(c.truth):>22} {error:>9} {c.tolerance:>9.1e} "
            f"{c.verdict:7}  {c.source}"
        )
        if isinstance(c.error, str):
            lines.append(f"    {c.error}")
    return "\n".join(lines)


class AbstractChecks(Sequence[Check]):
    """Checks in order, in `checks`; a subclass says how they are shown and when all is well."""

    checks: tuple[Check, ...]

    def __getitem__(self, index: Any) -> Any:
        return self.checks[index]

    def __len__(self) -> int:
        return len(self.checks)

    @property
    def failed(self) -> list[str]:
        """Names of the checks that did not pass."""
        return [check.case for check in self.checks if check.verdict != PASS]

    @property
    @abc.abstractmethod
    def ok(self) -> bool:
        """Whether all is well."""

    def as_list(self) -> list[dict[str, Any]]:
        """What `simbrake validate --json` prints, with `--cross-check` too."""
        return [check.as_dict() for check in self.checks]


class Validation(AbstractChecks):
    """Checks in order; printing them shows the table and the count of verdicts."""

    def __init__(self, checks: Iterable[Check], seconds: float = 0.0):
        self.checks, self.seconds = tuple(checks), seconds

    @property
    def ok(self) -> bool:
        """Whether there are checks, and every one passed."""
        return bool(self.checks) and not self.failed

    def __str__(self) -> str:
        failed = self.failed
        count = f"{len(self) - len(failed)} of {len(self)} cases pass in {self.seconds:.0f} s"
        count += f"; not: {', '.join(failed)}" if failed else ""
        rule = "error: of the truth, absolute where that is 0"
        return f"{table(self.checks)}\n\n{count} ({rule})"

    __repr__ = __str__
