"""Validation cases: computed values beside independent reference values, and the verdicts."""

import abc
import csv
import dataclasses
import functools
import math
from collections.abc import Callable, Mapping, Sequence
from importlib import resources
from typing import Any, NamedTuple, TypeAlias

import jax
import numpy as np

from .._base._arguments import explained
from .._base._compiling import DeviceJit
from .._base._table import Column, Table, Tabular
from .._parts._scene import Scene
from .._run._result import Result
from .._run._simulate import Solver, simulate

PASS, FAIL = "pass", "fail"

# --- cases ------------------------------------------------------------------------------------------------------------


class Case(NamedTuple):
    """One number that simbrake computes, `value()`, and its reference value.

    - `name`: subject, a slash, what is compared;  `source` of the truth: a closed form in symbols, or the publication
    - `truth`: from the closed form or as published;  `tolerance` of the error as `Check` has it

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


#: quantity that a case reads from a result: a function of it, or names, keys and places in it as `energy.friction_heat`
Reader: TypeAlias = str | Callable[[Any], Any]


@functools.cache
def truths() -> Mapping[str, Sequence[Mapping[str, str]]]:
    """Rows of `truths.csv` by subject; `tests/oracles/truths.py` made them, with nothing of simbrake."""
    subjects: dict[str, list[Mapping[str, str]]] = {}
    text = (resources.files("simbrake.checks") / "truths.csv").read_text("utf-8")
    for row in csv.DictReader(text.splitlines()):
        subjects.setdefault(row["subject"], []).append(row)
    return subjects


def _cases(subject: str, values: Mapping[str, Callable[[], Any]]) -> list[Case]:
    """Those cases of a subject of `truths.csv` of which there are values, by what they compare."""
    return [
        Case(f"{subject}/{what}", row["source"], float(row["truth"]), float(row["tolerance"]), values[what])
        for row in truths()[subject]
        if (what := row["what"]) in values
    ]


def cases_of(subject: str, run: Callable[[], Any], reads: Mapping[str, Reader]) -> list[Case]:
    """Cases that read one result, `run()`, which is made when the first of them is run."""
    once = functools.cache(run)
    return _cases(subject, {what: functools.partial(_read, once, reader) for what, reader in reads.items()})


def cases_of_run(
    subject: str,
    scene: Scene,
    reads: Mapping[str, Reader],
    slopes: Mapping[str, str] | None = None,
    of: Callable[[Result], Any] = lambda result: result.stopping_time,
    program: str | None = None,
    solver: Solver | None = None,
    rtol: float = 1e-12,
) -> list[Case]:
    """Cases that read the result of a scene, and derivatives of `of(result)` by the numbers at paths of the scene.

    - `slopes`: paths by what is compared; of an array by the sum of its numbers, or by that whose place ends the path
    - `program`: name of the compiled program that subjects share, whose scenes differ in their numbers alone
    - `solver`: as of `simulate`; one of fewer stages takes half as long to compile
    """
    if not slopes and program is None:
        return cases_of(subject, lambda: simulate(scene, rtol=rtol, solver=solver), reads)
    run = _with_slope(program or subject, of, solver)

    @functools.cache
    def along(path: str) -> tuple[Result, Any]:
        # (as numbers of NumPy: outside of jit every operation of JAX would compile by itself)
        return jax.device_get(run(jax.tree.map(np.asarray, scene), _towards(scene, path)))

    slopes = slopes or {}
    first = next(iter(slopes.values()), "initial.omega")
    values = {what: functools.partial(_read, lambda: along(first)[0], reader) for what, reader in reads.items()}
    return _cases(subject, values | {what: lambda path=path: along(path)[1] for what, path in slopes.items()})


@functools.cache
def _with_slope(name: str, of: Callable[[Result], Any], solver: Solver | None) -> DeviceJit:
    """One program for a result and a derivative, in forward mode: the other mode takes several times as long."""

    def both(scene: Scene, tangent: Scene) -> tuple[Result, Any]:
        def value_and_result(scene: Scene) -> tuple[Any, Result]:
            result = simulate(scene, rtol=1e-12, max_steps=1024, solver=solver)
            return of(result), result

        _, slope, result = jax.jvp(value_and_result, (scene,), (tangent,), has_aux=True)
        return result, slope

    return DeviceJit(both, subject=("validation", name, solver), quick=True)


def _towards(scene: Scene, path: str) -> Scene:
    """The direction in a scene that changes the number at a path."""
    tangent = jax.tree.map(lambda x: np.zeros(np.shape(x)), scene)
    head, _, last = path.rpartition(".")
    above = _read(lambda: tangent, head)
    if isinstance(above, np.ndarray):
        above[int(last)] = 1.0
    else:
        _read(lambda: tangent, path)[...] = 1.0
    return tangent


def _read(run: Callable[[], Any], what: Reader) -> Any:
    value = run()
    if not isinstance(what, str):
        return what(value)
    for name in what.split("."):
        if name.isdigit():
            value = value[int(name)]
        else:
            value = value[name] if isinstance(value, Mapping) else getattr(value, name)
    return value


# --- verdicts ---------------------------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Check:
    """A case that was run.

    - `error`: `|value − truth|/|truth|`, and `|value − truth|` where the truth is 0; a message, with no value, where
      the run failed
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


def judged(case: str, source: str, value: float, truth: float, tolerance: float, size: float | None = None) -> Check:
    """The check of a value; `size`: reference of the difference, by default `|truth|`, and 1 where that is 0."""
    error = abs(value - truth) / (size or abs(truth) or 1.0)
    if not math.isfinite(error):
        return Check(case, source, None, truth, f"the value is {value}, the truth {truth}", tolerance, FAIL)
    return Check(case, source, value, truth, error, tolerance, PASS if error <= tolerance else FAIL)


@explained
def run_case(case: Case) -> Check:
    """Run a case; any exception is a `fail` with the message.

    Example:
        >>> sb.checks.run_case(sb.checks.Case("wrap/ratio", "closed form: 8/5", 1.6, 1e-12, lambda: 1 / 0)).error
        'ZeroDivisionError: division by zero'
    """
    try:
        return judged(case.name, case.source, float(case.value()), case.truth, case.tolerance)
    except Exception as problem:  # a validation must reach its end after any exception
        words = f"{type(problem).__name__}: {problem}".strip().splitlines()[0]
        return Check(case.name, case.source, None, case.truth, words, case.tolerance, FAIL)


def _error(error: float | str) -> str:
    return "—" if isinstance(error, str) else f"{error:.1e}"


@dataclasses.dataclass(frozen=True, repr=False)
class AbstractChecks(Tabular, Sequence[Check]):
    """Checks in order, in `checks`; a subclass defines how they are shown and when all passed."""

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
        """Some checks as a table, and the messages of those that have one; `truth`: the heading of the truths."""
        columns = [
            *("case", Column("value", heading="simbrake", show=".15g"), Column("truth", heading=truth, show=".15g")),
            *(Column("difference", show=".1e"), Column("error", show=_error), Column("tolerance", show=".1e")),
            *("verdict", "source"),
        ]
        rows = [c.as_dict() | {"difference": None if c.value is None else c.value - c.truth} for c in checks]
        return [Table(columns, rows), *(f"{c.case}: {c.error}" for c in checks if isinstance(c.error, str))]

    __repr__ = Tabular.__str__


#: names that show one formula or mechanism in several scenes, and the subject that they make
_TOGETHER = {"stop with no fade": "stop with fade", "staged brake held 3600 s": "held 3600 s"}


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
        failed = self.failed
        subjects = len({_TOGETHER.get(head, head) for head in (check.case.partition("/")[0] for check in self)})
        count = f"{len(self) - len(failed)} of {len(self)} cases pass in {self.seconds:.0f} s, on {subjects} subjects"
        count += f"; not: {', '.join(failed)}" if failed else ""
        return [*self.table(self.checks, "truth"), "", f"{count} (error: of the truth, absolute where that is 0)"]
