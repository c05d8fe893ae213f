"""Acceptance tests as data: runs of scenes, and what must hold in each."""

import dataclasses
import enum
import itertools
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .._base._faults import Issues, existing_file, input_error, near, text_of_file
from .._base._numbers import number
from .._base._table import Table, plain
from ..files._scene_file import read_scene
from ..files.shipped_scenes import shipped_tests
from ..outputs.judgement import REASONS
from ..outputs.log import Status
from ..outputs.metrics import HOLDING, is_least, margin_to
from ..parts.scene import Scene
from ..runs.edit import numbers_in_si, with_values
from ..runs.findings import in_words_of
from ..runs.measure import PRESSURE, limit_checks, read_limits, unit_of
from ..runs.result import Result
from ..runs.simulate import simulate


class Must(enum.StrEnum):
    """What the load of a run must do.

    - `stops`: it comes to rest, and the friction brake holds it until the end
    - `holds`: the friction brake holds it from the start
    - `does not stop`: it never comes to rest; so a test records a known gap
    - `breaks away`: it starts at rest, and moves off

    Example:
        >>> sb.checks.Must("holds").name
        'HOLDS'
    """

    STOPS = "stops"
    HOLDS = "holds"
    DOES_NOT_STOP = "does not stop"
    BREAKS_AWAY = "breaks away"

    def met(self, result: Result) -> bool:
        """Whether a run did it."""
        status = result.status
        stops = bool(np.isfinite(float(result.stopping_time)))
        held = result.verdict().reason not in _NOT_HELD
        return {
            Must.STOPS: stops and held and status in (Status.STOPPED, Status.HELD),
            Must.HOLDS: held and status == Status.HELD,
            Must.DOES_NOT_STOP: not stops and status != Status.HELD,
            Must.BREAKS_AWAY: stops or status != Status.HELD,
        }[self]


_NOT_HELD = {reason.id for reason in REASONS if not reason.held}


class AcceptanceTest(NamedTuple):
    """One test: a scene with its changes, and what must hold.

    - `scene`: of the first values of its ranges;  `ranges`: path → values that are tried,
      all of them with each other
    - `within`: metric → permissible value in SI, the greatest, or the least of a metric
      that begins with `min_`
    - `source`: where its numbers are from
    """

    name: str
    scene: Scene
    ranges: dict[str, list[float]]
    must: Must | None
    within: dict[str, float]
    source: str


class Worst(NamedTuple):
    """The worst value of a metric in the runs of a test, and the changes it is at;
    `None`: a run has no value."""

    value: float | None
    at: dict[str, float]


class Answer(NamedTuple):
    """What became of a test.

    - `result`: in words what the load did; of several runs in the first one that does
      something else than it must, with the changes `at` which it does
    - `meets`: whether all runs do what they must
    - `worst`: metric → its worst value
    - `runs`: how many
    """

    test: AcceptanceTest
    result: str
    at: dict[str, float]
    meets: bool
    worst: dict[str, Worst]
    runs: int

    @property
    def passed(self) -> bool:
        """Whether the test passed."""
        return self.meets and all(
            _keeps(name, self.worst[name].value, limit)
            for name, limit in self.test.within.items()
        )

    def as_dict(self) -> dict[str, Any]:
        """The answer for JSON (SI)."""
        checks = []
        for name, limit in self.test.within.items():
            value, at = self.worst[name]
            kept = _keeps(name, value, limit)
            row = {"metric": name, "limit": limit, "value": plain(value), "at": at}
            checks.append(row | {"passed": kept})
        return {
            "name": self.test.name,
            "passed": self.passed,
            "must": self.test.must,
            "result": self.result,
            "at": self.at,
            "within": checks,
            "runs": self.runs,
            "source": self.test.source,
        }

    def rows(self) -> list[tuple[str, ...]]:
        """Lines of the table: one for what the load must do, one for each limit."""
        rows = []
        if self.test.must is not None or not self.meets:
            must = self.test.must
            asked = "" if must is None else _MUST[must]
            rows.append(("", asked, self.result, "", _changes(self.at)))
        for name, limit in self.test.within.items():
            value, at = self.worst[name]
            unit = "Pa" if name == PRESSURE else unit_of(name)
            sign = "≥" if is_least(name) else "≤"
            found = "no value" if value is None else str(number(value, unit))
            found = "no load hung" if value == np.inf else found
            failed = "" if _keeps(name, value, limit) else "failed"
            words = name.removeprefix("energy.").replace("_", " ")
            words = in_words_of(self.test.scene, words)
            bound = f"{sign} {number(limit, unit)}"
            rows.append((failed, words, found, bound, _changes(at)))
        if rows and not self.meets:
            rows[0] = ("failed", *rows[0][1:])
        heads = [("pass" if self.passed else "FAIL", self.test.name, self.test.source)]
        heads += [("", "", "")] * (len(rows) - 1)
        return [
            (verdict, name, *row[1:], row[0], source)
            for (verdict, name, source), row in zip(heads, rows, strict=True)
        ]


def _changes(at: dict[str, float]) -> str:
    return ", ".join(f"{path} {value:.6g}" for path, value in at.items())


class Acceptance(NamedTuple):
    """Answers to all tests of a file: print it, or take `as_dict()`."""

    answers: tuple[Answer, ...]

    @property
    def passed(self) -> bool:
        """Whether all tests passed."""
        return all(answer.passed for answer in self.answers)

    def as_dict(self) -> dict[str, Any]:
        """All answers for JSON (SI)."""
        return {
            "passed": self.passed,
            "failed": sum(not answer.passed for answer in self.answers),
            "tests": [answer.as_dict() for answer in self.answers],
            "note": NOTE,
        }

    def __str__(self) -> str:
        count = len(self.answers)
        failed = sum(not answer.passed for answer in self.answers)
        head = f"{count} test{'s' * (count != 1)}, {count - failed} passed, {failed} failed"
        heads = ["", "test", "asked", "found", "limit", "at", "", "source"]
        rows = [row for answer in self.answers for row in answer.rows()]
        return f"{head}\n{Table(heads, rows)}\n{NOTE}"


#: what a passed file says
NOTE = (
    "passed: the model satisfies these numbers. It says nothing about compliance with a "
    "code or a standard."
)
#: source of a test that names none
YOURS = "yours to set"
#: values of a range without `count`, and runs of one test at most
_COUNT = 3
_MOST_RUNS = 500
_KEYS = ("name", "scene", "set", "must", "within", "source")


def read_tests(file: str | Path) -> list[AcceptanceTest]:
    """The tests of a TOML file, or of the shipped one of that name
    (`drawworks_tests`).

    A file has `scene` (a file next to it, a template or a shipped scene) and a table
    `[[test]]` for each test, with `name`, `must` (see `Must`), `within` (metric =
    limit), `set` (path = value), `source`, and `scene` where it has another. Values are
    in SI, or texts with their unit; `{ low = "40 t", high = "60 t", count = 5 }` tries
    a range.

    Raises `InputError` with all errors of the file, also with what no run can fulfil.

    Example:
        >>> tests = sb.checks.read_tests("drawworks_tests")
        >>> tests[1].must.value, tests[1].within
        ('holds', {'min_holding_reserve': 1.25})
    """
    given = Path(file)
    named = None if given.is_file() else shipped_tests(given)
    path = named or existing_file(given, "*.toml")
    try:
        content = tomllib.loads(text_of_file(path))
    except tomllib.TOMLDecodeError as error:
        hint = "see simbrake test --help"
        raise input_error(str(path), f"is no TOML: {error}", hint) from None
    faults = Issues()
    _unknown(faults, "", content, ("scene", "test"))
    tables = content.get("test", [])
    if not isinstance(tables, list) or not tables:
        faults.add("test", "is missing", "give a table [[test]] for each test")
        tables = []
    tests = []
    for i, table in enumerate(tables):
        found = _read_test(table, f"test[{i}]", content.get("scene"), path, faults)
        tests.append(found)
    faults.report()
    return [test for test in tests if test is not None]


def _unknown(
    faults: Issues, place: str, table: Mapping[str, Any], keys: tuple[str, ...]
) -> None:
    for key in table:
        if key not in keys:
            where = f"{place}.{key}" if place else key
            hint = near(key, keys).removeprefix("; ") or f"there are: {', '.join(keys)}"
            faults.add(where, "is not a key of a file of tests", hint)


def _read_test(
    table: Any, place: str, default: Any, file: Path, faults: Issues
) -> AcceptanceTest | None:
    """One test; its errors go to `faults`."""
    if not isinstance(table, dict):
        faults.add(place, "is no table", "begin it with [[test]]")
        return None
    _unknown(faults, place, table, _KEYS)
    before = len(faults)
    for key in ("set", "within"):
        if not isinstance(table.get(key, {}), dict):
            faults.add(f"{place}.{key}", "is no table", f'as {key}.PATH = "value"')
    name = table.get("name", place)
    must = None
    if "must" in table:
        try:
            must = Must(table["must"])
        except ValueError:
            hint = f"there are: {', '.join(Must)}"
            faults.add(f"{place}.must", f"{table['must']!r} is no result", hint)
    elif not table.get("within"):
        hint = "give must, within, or both"
        faults.add(place, "asks for nothing", hint)
    source = table.get("scene", default)
    if not isinstance(source, str):
        faults.add(f"{place}.scene", "is missing", "a file, or the name of a template")
        return None
    beside = file.parent / source
    base = faults.attempt(read_scene, beside if beside.is_file() else source)
    if base is None:
        return None
    values = {}
    ranges: dict[str, list[float]] = {}
    for path, given in _flat(table.get("set", {})).items():
        if isinstance(given, dict):
            tried = faults.attempt(_range, base, path, given, f"{place}.set.{path}")
            if tried is not None:
                ranges[path] = tried
                values[path] = tried[0]
        else:
            values[path] = given
    own = Issues()
    scene = own.attempt(with_values, base, values)
    faults += [
        dataclasses.replace(each, path=f"{place}.set.{each.path}") for each in own
    ]
    runs = int(np.prod([len(tried) for tried in ranges.values()], dtype=float))
    if runs > _MOST_RUNS:
        what = f"{runs} runs are too many"
        faults.add(f"{place}.set", what, f"at most {_MOST_RUNS}")
    if scene is None:
        return None
    within, wrong = read_limits(
        scene, _flat(table.get("within", {})), f"{place}.within.{{}}"
    )
    for each in wrong:
        path = (
            each.path if each.path.startswith(place) else f"{place}.within.{each.path}"
        )
        faults.append(dataclasses.replace(each, path=path))
    _impossible(faults, place, must, scene, within)
    if len(faults) > before:
        return None
    return AcceptanceTest(
        str(name), scene, ranges, must, within, str(table.get("source", YOURS))
    )


def _flat(table: Any, above: str = "") -> dict[str, Any]:
    """Values by path, of keys with dots or of tables, none of what is no table; a range
    stays a table."""
    found = {}
    for key, value in (table if isinstance(table, dict) else {}).items():
        if isinstance(value, dict) and not {"low", "high"} & set(value):
            found |= _flat(value, f"{above}{key}.")
        else:
            found[f"{above}{key}"] = value
    return found


def _range(scene: Scene, path: str, given: dict[str, Any], place: str) -> list[float]:
    """Values of a range, evenly from its low to its high end."""
    faults = Issues()
    for key in given:
        if key not in ("low", "high", "count"):
            faults.add(f"{place}.{key}", "is not a key of a range", "low, high, count")
    count = given.get("count", _COUNT)
    if not isinstance(count, int) or count < 2:
        faults.add(f"{place}.count", f"{count!r} is no number of values", "2 or more")
    ends = [given.get("low"), given.get("high")]
    if None in ends:
        faults.add(place, "has one end", "give low and high")
        faults.report()
    tried: Any = faults.attempt(numbers_in_si, scene, path, ends)
    if tried is not None and not tried[0] < tried[1]:
        faults.add(place, f"{ends[0]} is not below {ends[1]}", "low is the lower end")
    faults.report()
    assert tried is not None
    return np.linspace(tried[0], tried[1], count).tolist()


def _impossible(
    faults: Issues,
    place: str,
    must: Must | None,
    scene: Scene,
    within: dict[str, float],
) -> None:
    """Errors of tests that no run passes, or every run."""
    starts = float(scene.start_speed)
    if must in (Must.HOLDS, Must.BREAKS_AWAY) and starts != 0:
        what = f"asks for '{must}' of a run that starts at {starts:g} rad/s"
        faults.add(f"{place}.must", what, "set initial.omega = 0")
    times = [name for name in within if name in ("stopping_time", "hook_travel")]
    if must is Must.DOES_NOT_STOP and times:
        what = "has a limit, and a run that does not stop has no value"
        faults.add(f"{place}.within.{times[0]}", what, "leave one of them out")
    for name, limit in within.items():
        if limit <= 0 and not name.startswith("energy."):
            what = f"{limit:g} holds for {'every' if is_least(name) else 'no'} run"
            faults.add(f"{place}.within.{name}", what, "give a number above 0")


def run_tests(
    tests: list[AcceptanceTest],
    *,
    progress: Callable[[int, int], object] = lambda done, of: None,
) -> Acceptance:
    """Run tests, of ranges all values with each other, and judge the worst.

    A run that fails by its solver passes no test.

    Example:
        >>> stop = sb.checks.AcceptanceTest(
        ...     "stops", scene, {}, sb.checks.Must.STOPS, {"stopping_time": 1.0}, "")
        >>> found = sb.checks.run_tests([stop])
        >>> found.passed, round(found.answers[0].worst["stopping_time"].value, 4)
        (False, 1.2577)
    """
    answers = []
    for i, test in enumerate(tests):
        progress(i, len(tests))
        answers.append(_answer(test))
    return Acceptance(tuple(answers))


def _answer(test: AcceptanceTest) -> Answer:
    """The answer to one test."""
    worst: dict[str, Worst] = {}
    result_of_first = ""
    failing: tuple[str, dict[str, float]] | None = None
    runs = 0
    for changes in itertools.product(*test.ranges.values()):
        at = dict(zip(test.ranges, changes, strict=True))
        result = simulate(with_values(test.scene, at), throw=False)
        runs += 1
        words = result.message if result.ok else f"no answer: {result.message}"
        verdict = result.verdict()
        if verdict.reason in _NOT_HELD:
            words = verdict.sentence
        result_of_first = result_of_first or words
        met = result.ok and (test.must is None or test.must.met(result))
        if not met and failing is None:
            failing = words, at
        for name in test.within:
            found = Worst(_value(result, name, test.within[name]), at)
            if name not in worst or _is_worse(name, found.value, worst[name].value):
                worst[name] = found
    words, at = failing or (result_of_first, {})
    return Answer(test, words, at, failing is None, worst, runs)


_MUST = {
    Must.STOPS: "must stop",
    Must.HOLDS: "must hold",
    Must.DOES_NOT_STOP: "must not stop",
    Must.BREAKS_AWAY: "must break away",
}


def _value(result: Result, name: str, limit: float) -> float | None:
    """A metric of a run, or the mean pressure of the lining nearest its limit; the
    reserve of a brake that held no load is infinite."""
    if not result.ok:
        return None
    if name == PRESSURE:
        checks = limit_checks(result, {name: limit})
        return next(check.value for check in checks if check.name == name)
    value = float(result[name])
    unloaded = name == HOLDING and result.report().held_nothing
    return value if np.isfinite(value) or unloaded else None


def _is_worse(name: str, value: float | None, than: float | None) -> bool:
    """Whether a value is farther from what is permissible; none is the farthest."""
    if value is None or than is None:
        return value is None
    return margin_to(than, name, value) < 0


def _keeps(name: str, value: float | None, limit: float) -> bool:
    return value is not None and margin_to(limit, name, value) >= 0
