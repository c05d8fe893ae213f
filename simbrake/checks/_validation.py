"""Computed values beside independent reference values, and the verdicts."""

import abc
import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from .._base._table import Column, Table, Tabular, frozen

PASS = "pass"
FAIL = "fail"

# --- cases ---------------------------------------------------------------------------


class Case(NamedTuple):
    """One number that simbrake computes, `value()`, and its reference value.

    - `name`: subject, a slash, what is compared
    - `source` of the truth: a closed form in symbols, or the publication
    - `truth`: from the closed form or as published
    - `tolerance` of the error as `Check` has it

    Example:
        >>> change = lambda: result.energy["kinetic_change"]
        >>> case = sb.checks.Case("stop/kinetic energy", "closed form: −J ω²/2", -360e3, 1e-12, change)
        >>> round(float(case.value()), 4)
        -360000.0
    """

    name: str
    source: str
    truth: float
    tolerance: float
    value: Callable[[], Any]


# --- verdicts -----------------------------------------------------------------------


@frozen
class Check:
    """A case that was run.

    - `error`: `|value − truth|/|truth|`, and `|value − truth|` where the truth is 0; a
      message, with no value, where the run failed
    - `verdict`: `pass` while the error is not above the tolerance, else `fail`

    Example:
        >>> closure = lambda: result.energy["closure"]
        >>> case = sb.checks.Case("stop/energies", "their sum is 0", 0.0, 1e-10, closure)
        >>> sb.checks.run_case(case).verdict
        'pass'
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


def judged(
    case: str,
    source: str,
    value: float,
    truth: float,
    tolerance: float,
    size: float | None = None,
) -> Check:
    """The check of a value; `size`: reference of the difference, by default `|truth|`,
    and 1 where that is 0."""
    error = abs(value - truth) / (size or abs(truth) or 1.0)
    if not math.isfinite(error):
        return Check(
            case,
            source,
            None,
            truth,
            f"the value is {value}, the truth {truth}",
            tolerance,
            FAIL,
        )
    return Check(
        case,
        source,
        value,
        truth,
        error,
        tolerance,
        PASS if error <= tolerance else FAIL,
    )


def run_case(case: Case) -> Check:
    """Run a case; any exception is a `fail` with the message.

    Example:
        >>> sb.checks.run_case(sb.checks.Case("wrap/ratio", "closed form: 8/5", 1.6, 1e-12, lambda: 1 / 0)).error
        'ZeroDivisionError: division by zero'
    """
    try:
        return judged(
            case.name, case.source, float(case.value()), case.truth, case.tolerance
        )
    except Exception as problem:  # a validation must reach its end after any exception
        words = f"{type(problem).__name__}: {problem}".strip().splitlines()[0]
        return Check(
            case.name, case.source, None, case.truth, words, case.tolerance, FAIL
        )


@dataclasses.dataclass(frozen=True, repr=False)
class AbstractChecks(Tabular, Sequence[Check]):
    """Checks in order, in `checks`; a subclass defines how they are shown and when all
    passed."""

    checks: Sequence[Check]

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
        """Whether all passed."""

    def as_list(self) -> list[dict[str, Any]]:
        """Data printed by `simbrake validate --json`, also with `--cross-check`."""
        return [check.as_dict() for check in self.checks]

    def table(self, checks: Sequence[Check], truth: str) -> list[str | Table]:
        """Some checks as a table, and the messages of those that have one; `truth`: the
        heading of the truths."""
        columns = [
            *(
                "case",
                Column("value", heading="simbrake", show=".15g"),
                Column("truth", heading=truth, show=".15g"),
            ),
            *(
                Column(
                    "error", show=lambda x: "—" if isinstance(x, str) else f"{x:.1e}"
                ),
                Column("tolerance", show=".1e"),
                "verdict",
                "source",
            ),
        ]
        return [
            Table(columns, [c.as_dict() for c in checks]),
            *(f"{c.case}: {c.error}" for c in checks if isinstance(c.error, str)),
        ]

    __repr__ = Tabular.__str__


@dataclasses.dataclass(frozen=True, repr=False)
class Validation(AbstractChecks):
    """Checks in order; printing them shows the table and the count of verdicts.

    Example:
        >>> case = sb.checks.Case("wrap/ratio", "closed form: 8/5", 1.6, 1e-12, lambda: 1.7)
        >>> found = sb.checks.Validation([sb.checks.run_case(case)])
        >>> found.ok, found.failed
        (False, ['wrap/ratio'])
    """

    seconds: float = 0.0

    @property
    def ok(self) -> bool:
        """Whether there are checks, and every one passed."""
        return bool(self.checks) and not self.failed

    def parts(self) -> list[str | Table]:
        count = f"{len(self) - len(self.failed)} of {len(self)} cases pass in {self.seconds:.0f} s"
        return [*self.table(self.checks, "truth"), "", count]
