"""Plants errors in the package, one at a time, and counts those that no test and no validation case notices.

    python tests/plant.py --map                      # once, Python >= 3.12: which test runs which function
    python tests/plant.py --count 200 --seed 1       # then: 200 errors, in equal numbers per part, kind by kind
    python tests/plant.py --count 5 --seed 3 --module simbrake/_physics/_rigid.py
    python tests/plant.py --count 200 --seed 1 --list    # the places alone
    python tests/plant.py --again --seed 1           # its survivors once more, after tests were written
    python tests/plant.py --count 200 --seed 2 --part physics --validation    # by `simbrake validate` alone
    python tests/plant.py --page                     # what is known so far into docs/planted_errors.md

Each error is put into a copy of the tree, and the tests and subjects of `simbrake validate` that run its function are
run on it, the cheap and those about its module first, until one fails or the time is up. A copy that cannot be
imported, or a test that takes far longer than it should, counts as caught. `planted_equivalent.csv` names errors that
change no result.
"""

import argparse
import csv
import dataclasses
import itertools
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).parents[1]
if __name__ == "__main__":
    sys.path.insert(0, str(ROOT / "tests"))

from planting import KINDS, Site, sites, with_error  # noqa: E402

KEPT = ROOT / ".pytest_cache" / "planted"
PAGE = ROOT / "docs" / "planted_errors.md"
BEGIN, END = "<!-- planted: begin -->\n", "<!-- planted: end -->\n"

#: folders and files of each part of the package; the first that fits is taken
PARTS = {
    "physics": "_physics _parts _phases.py brakes thermal fade.py friction.py loads.py profiles.py rope.py shaft.py "
    "wear.py",
    "engine": "hybrid _run/_simulate.py _run/_duty.py _run/_scan.py _run/_stepper.py _run/_networks.py",
    "reports": "_pages results _run/_report.py _run/_verdict.py _run/_log.py _run/_choice.py",
    "studies": "studies layouts formulas _run",
    "files": "files _commands _base",
    "figures": "plot",
}
#: tests that see any change of the text or of the count of equations, right or wrong
BLIND = {"test_house.py", "test_words.py", "test_program_size.py", "test_costs.py", "test_docs.py", "test_plant.py"}
ROWS = "planted_rows.py"
#: files whose functions run in other processes, or before a test: tests that see them
ELSEWHERE = {"simbrake/files/_slave.py": "files/test_fmu.py", "simbrake/_base/_precision.py": "files/test_start.py"}


def part_of(module: str) -> str | None:
    inside = module.removeprefix("simbrake/")
    for part, places in PARTS.items():
        if any(inside == place or inside.startswith(f"{place}/") for place in places.split()):
            return part
    return None


# --- inside the runs of pytest: this file is their plugin -------------------------------------------------------------


def _recorded(item, nextitem):
    """Runs a test; which functions of the package it calls, and how long it takes."""
    seen: set = set()
    watch = sys.monitoring
    if ROWS in item.nodeid:
        # (a program that an earlier subject has compiled would hide the functions that it was made of)
        from simbrake._base._programs import STORE

        STORE.forget()

    def called(code, offset):
        seen.add(code)
        return watch.DISABLE  # (once per test and function is enough, and costs next to nothing)

    watch.use_tool_id(watch.PROFILER_ID, "plant")
    watch.register_callback(watch.PROFILER_ID, watch.events.PY_START, called)
    watch.set_events(watch.PROFILER_ID, watch.events.PY_START)
    watch.restart_events()
    start = time.monotonic()
    try:
        yield
    finally:
        watch.set_events(watch.PROFILER_ID, 0)
        watch.free_tool_id(watch.PROFILER_ID)
    package = f"{Path.cwd() / 'simbrake'}{os.sep}"
    names = {
        f"{Path(code.co_filename).relative_to(Path.cwd()).as_posix()}::{code.co_qualname}"
        for code in seen
        if code.co_filename.startswith(package)
    }
    item.config.planted[item.nodeid] = {"seconds": time.monotonic() - start, "functions": sorted(names)}


if "PLANT_MAP" in os.environ or "PLANT_LIMIT" in os.environ:
    import pytest

    def pytest_configure(config):
        config.planted, config.planted_failed, config.planted_start = {}, [], time.monotonic()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(item, nextitem):
        if "PLANT_MAP" in os.environ:
            yield from _recorded(item, nextitem)
            return True
        if time.monotonic() - item.config.planted_start > float(os.environ["PLANT_LIMIT"]):
            item.session.shouldstop = "the time is up"
        return (yield)

    def pytest_runtest_logreport(report):
        if report.failed:
            _config.planted_failed.append(report.nodeid)

    def pytest_sessionstart(session):
        global _config
        _config = session.config

    def pytest_sessionfinish(session, exitstatus):
        if "PLANT_MAP" in os.environ:
            good = {name: of for name, of in session.config.planted.items() if name not in _config.planted_failed}
            Path(os.environ["PLANT_MAP"]).write_text(json.dumps(good), "utf-8")


# --- copies of the tree -----------------------------------------------------------------------------------------------


def copied(folder: Path) -> Path:
    """The working tree, in a folder; programs compiled for all copies are kept in one place."""
    listed = ["git", "ls-files", "-co", "--exclude-standard", "-z"]
    names = subprocess.run(listed, cwd=ROOT, capture_output=True, check=True, text=True).stdout
    for name in filter(None, names.split("\0")):
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
    (folder / ".pytest_cache").mkdir()
    (KEPT / "programs").mkdir(parents=True, exist_ok=True)
    (folder / ".pytest_cache" / "programs").symlink_to(KEPT / "programs")
    return folder


def _surroundings(tree: Path, **settings: str) -> dict[str, str]:
    """Those of pytest in a copy: options meant for the pytest that runs this may be unknown there."""
    path = os.pathsep.join((str(tree), str(tree / "tests")))
    return os.environ | {"PYTHONPATH": path, "SIMBRAKE_CACHE_DIR": "", "PYTEST_ADDOPTS": "", **settings}


def run_pytest(tree: Path, tests: Iterable[str], limit: float, **settings: str) -> tuple[int | None, str]:
    """Exit status and output of pytest in a copy; the status is `None` where it had to be ended."""
    call = [sys.executable, "-m", "pytest", "-n", "0", "-x", "-q", "--no-header", "--tb=line", "-p", "plant", *tests]
    if "PLANT_MAP" in settings:
        call.remove("-x")
    process = subprocess.Popen(
        call,
        cwd=tree,
        env=_surroundings(tree, **settings),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    )
    try:
        output = process.communicate(timeout=limit)[0]
        return process.returncode, output.decode(errors="replace")
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, 9)  # what it has started, too
        return None, process.communicate()[0].decode(errors="replace")


# --- which test runs which function -----------------------------------------------------------------------------------


def make_map(only: list[str], jobs: int) -> None:
    """Runs every file of tests and records what its tests call; files recorded before are left out."""
    files = [ROOT / "tests" / ROWS, *sorted((ROOT / "tests").rglob("test_*.py"))]
    files = [f for f in files if f.name not in BLIND and (f.name in only or not only)]
    todo = [f for f in files if only or not (KEPT / "map" / f"{f.stem}.json").exists()]
    (KEPT / "map").mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        tree = copied(Path(folder))

        def one(file: Path) -> None:
            start, target = time.monotonic(), KEPT / "map" / f"{file.stem}.json"
            status, _ = run_pytest(tree, [file.relative_to(ROOT).as_posix()], 3000.0, PLANT_MAP=str(target))
            print(f"{file.name}: pytest ends with {status} after {time.monotonic() - start:.0f} s", flush=True)

        with ThreadPoolExecutor(jobs) as pool:
            list(pool.map(one, todo))


class Map:
    """Which tests run a function, in the order in which they are tried; `validation`: subjects of it alone."""

    def __init__(self, validation: bool = False) -> None:
        self.seconds: dict[str, float] = {}
        self.of_function: dict[str, set[str]] = defaultdict(set)
        self.of_group: dict[str, set[str]] = defaultdict(set)  # functions
        for file in sorted((KEPT / "map").glob(f"{Path(ROWS).stem}.json" if validation else "*.json")):
            for test, known in json.loads(file.read_text("utf-8")).items():
                self.seconds[test] = known["seconds"]
                self.of_group[_group(test)] |= set(known["functions"])
                for function in known["functions"]:
                    self.of_function[function].add(test)
                    self.of_function[function.partition("::")[0]].add(test)

    def forget_lost(self, tree: Path) -> None:
        """Leaves out tests that are there no more: pytest would run none of a list in which one is unknown."""
        files = sorted({test.partition("::")[0] for test in self.seconds})
        there = [file for file in files if (tree / file).exists()]
        call = [sys.executable, "-m", "pytest", "-n", "0", "-q", "-m", "", "--collect-only", *there]
        listed = subprocess.run(call, cwd=tree, env=_surroundings(tree), stdout=subprocess.PIPE, check=True, text=True)
        lost = set(self.seconds) - set(listed.stdout.splitlines())
        for tests in self.of_function.values():
            tests -= lost
        if lost:
            names = " ".join(sorted({Path(test.partition("::")[0]).name for test in lost}))
            print(f"{len(lost)} tests of the map are lost; python tests/plant.py --map {names}", flush=True)
        self.seconds = {test: seconds for test, seconds in self.seconds.items() if test not in lost}

    def tests(self, site: Site) -> list[str]:
        """Tests that run its function, by files; all that run anything of the module where none runs that function.

        In turn what costs little and calls little outside this folder, and what calls functions of this module that few
        others call: a common function is run by all tests, but its cases are the business of few. Within one process a
        later test may use what an earlier one has traced, so that the tests of a file keep together; and what a fixture
        has found for all tests of a file, so that its other tests come at the end.
        """
        found = self.of_function.get(f"{site.module}::{site.function}") or self.of_function.get(site.module, set())
        cost: Counter[str] = Counter()
        for test in found:
            cost[_group(test)] += self.seconds[test]
        folder, module = site.module.rpartition("/")[0], f"{site.module}::"
        callers = Counter(itertools.chain.from_iterable(self.of_group.values()))

        def small(group: str) -> float:
            calls = self.of_group[group]
            return cost[group] * (len(calls) / sum(call.startswith(f"{folder}/") for call in calls)) ** 2

        def strange(group: str) -> float:
            rare = sum(1 / callers[call] for call in self.of_group[group] if call.startswith(module))
            return (cost[group] + 3.0) / (rare + 1e-9)

        def in_turn(key: Callable[[str], float]) -> list[str]:
            """A subject of the validation, then a file of tests: all subjects first would use up the time."""
            groups = sorted(cost, key=lambda group: (key(group), group))
            place = {True: itertools.count(0, 2), False: itertools.count(1, 2)}
            rank = {group: next(place[ROWS in group]) for group in groups}
            return sorted(groups, key=lambda group: rank[group])

        groups = dict.fromkeys(itertools.chain.from_iterable(zip(in_turn(small), in_turn(strange), strict=True)))
        rank = {group: i for i, group in enumerate(groups)}
        others = {test for test in self.seconds if _group(test) in rank}
        known = sorted(others, key=lambda test: (test not in found, rank[_group(test)], self.seconds[test]))
        return known or ([f"tests/{ELSEWHERE[site.module]}"] if site.module in ELSEWHERE else [])


def _group(test: str) -> str:
    """The file of a test; a subject of the validation stands alone, as it shares nothing with the others."""
    return test if ROWS in test else test.partition("::")[0]


# --- planting ---------------------------------------------------------------------------------------------------------


def equivalents() -> dict[tuple[str, str, str, str], str]:
    """Errors that change no result, with the reasons."""
    with (ROOT / "tests" / "planted_equivalent.csv").open(encoding="utf-8", newline="") as file:
        return {(r["module"], r["function"], r["before"], r["after"]): r["reason"] for r in csv.DictReader(file)}


def drawn(count: int, seed: int, module: str | None = None) -> Iterator[Site]:
    """Places by seed: parts in turn, then a kind of error, then a place, each as likely as the others of its kind."""
    pool: dict[str, dict[str, list[Site]]] = defaultdict(lambda: defaultdict(list))
    for file in sorted((ROOT / "simbrake").rglob("*.py")):
        name = file.relative_to(ROOT).as_posix()
        part = part_of(name)
        if name == module or (module is None and part):
            for site in sites(file, ROOT):
                pool[part or "other"][site.kind].append(site)
    if not pool:
        raise SystemExit(f"{module} is not a file of the package")
    draw, parts, found, known = random.Random(seed), sorted(pool), set(), 0
    for _turn in range(50 * count):
        if known == count:
            return
        of_part = pool[parts[known % len(parts)]]
        site = draw.choice(of_part[draw.choice([kind for kind in KINDS if of_part[kind]])])
        if site not in found and with_error((ROOT / site.module).read_text("utf-8"), site) is not None:
            found.add(site)
            known += 1
            yield site


@dataclasses.dataclass(frozen=True)
class Outcome:
    """What became of an error: `caught`, `survived` or `equivalent`, and by which test."""

    part: str
    site: Site
    verdict: str
    by: str
    seconds: float
    tests: int

    def as_dict(self) -> dict:
        return dataclasses.asdict(self) | {"site": self.site._asdict()}

    @staticmethod
    def of(read: dict) -> "Outcome":
        return Outcome(**read | {"site": Site(**read["site"])})


def tried(site: Site, tree: Path, known: Map, limit: float) -> Outcome:
    """Plants an error in a copy, runs the tests, and takes it out again."""
    part, start, reason = part_of(site.module) or "other", time.monotonic(), equivalents().get(site.key)
    if reason:
        return Outcome(part, site, "equivalent", reason, 0.0, 0)
    tests, file = known.tests(site), tree / site.module
    if not tests:
        return Outcome(part, site, "survived", "no test runs it", 0.0, 0)
    text = (ROOT / site.module).read_text("utf-8")
    planted = with_error(text, site)
    assert planted is not None
    slowest = max(known.seconds.get(test, 60.0) for test in tests)
    arguments = tree / "planted_tests.txt"
    arguments.write_text("\n".join(tests), "utf-8")

    def put(what: str) -> None:
        file.write_text(what, "utf-8")
        for old in (file.parent / "__pycache__").glob(f"{file.stem}.*.pyc"):
            old.unlink()  # (times of files have whole seconds there)

    put(planted)
    try:
        status, output = run_pytest(tree, [f"@{arguments.name}"], limit + 60 + 5 * slowest, PLANT_LIMIT=str(limit))
    finally:
        put(text)
    spent = time.monotonic() - start
    return Outcome(part, site, *judged(status, output, len(tests)), spent, len(tests))


def judged(status: int | None, output: str, count: int) -> tuple[str, str]:
    """Whether an error is caught, and by what, as pytest ended.

    A pytest that ends by itself, as a process may that has compiled too much, says nothing of the error: it counts as
    not noticed.
    """
    told = [line for line in output.splitlines() if line.startswith(("FAILED ", "ERROR "))]
    if told:
        return "caught", told[0].partition(" ")[2].partition(" - ")[0]
    if status is None:
        return "caught", "takes far longer than it should"
    if "while loading conftest" in output:
        return "caught", "cannot be imported"
    if "the time is up" in output:
        return "survived", "the time was up"
    return "survived", f"{count} tests pass" if status == 0 else f"pytest ended by itself, with {status}"


def run_batch(found: list[Site], jobs: int, limit: float, target: Path, validation: bool = False) -> list[Outcome]:
    """Every error in turn, in as many copies as there are jobs; what an earlier run of the batch found is kept."""
    target.parent.mkdir(parents=True, exist_ok=True)
    done = [Outcome.of(json.loads(line)) for line in target.read_text("utf-8").splitlines()] if target.exists() else []
    of_before = {outcome.site: outcome for outcome in done}
    known, lock, todo = Map(validation), threading.Lock(), [site for site in found if site not in of_before]
    if not known.seconds:
        raise SystemExit("which test runs which function is not known yet: python tests/plant.py --map")
    programs = {f.name for f in (KEPT / "programs").glob("*")}
    with tempfile.TemporaryDirectory() as folder:
        free = [copied(Path(folder) / str(job)) for job in range(jobs)]
        known.forget_lost(free[0])

        def one(site: Site) -> Outcome:
            with lock:
                tree = free.pop()
            try:
                outcome = tried(site, tree, known, limit)
            finally:
                with lock:
                    free.append(tree)
            with lock, target.open("a", encoding="utf-8") as file:
                file.write(json.dumps(outcome.as_dict()) + "\n")
                place = f"{site.module}:{site.line}"
                print(
                    f"{outcome.verdict:9s} {outcome.seconds:5.0f} s {place} {site.kind}: {_short(site)} [{outcome.by}]",
                    flush=True,
                )
            return outcome

        with ThreadPoolExecutor(jobs) as pool:
            of_before |= {outcome.site: outcome for outcome in pool.map(one, todo)}
    for file in (KEPT / "programs").glob("*"):
        if file.name not in programs:
            file.unlink(missing_ok=True)  # programs of planted errors
    return [of_before[site] for site in found]


def tried_again(target: Path, jobs: int, limit: float, validation: bool = False) -> list[Outcome]:
    """A batch with its survivors planted anew, in the tree as it is now; those whose code is gone are left out."""
    outcomes, now = [Outcome.of(json.loads(line)) for line in target.read_text("utf-8").splitlines()], {}
    survivors = [outcome.site for outcome in outcomes if outcome.verdict == "survived"]
    for old in survivors:
        same = [site for site in sites(ROOT / old.module, ROOT) if site.key == old.key]
        if same:
            now[old] = min(same, key=lambda site: abs(site.line - old.line))
    anew = target.with_suffix(".again.jsonl")
    found = dict(zip(now, run_batch(list(now.values()), jobs, limit, anew, validation), strict=True))
    outcomes = [found.get(o.site, o) for o in outcomes if o.site not in survivors or o.site in found]
    target.write_text("".join(json.dumps(o.as_dict()) + "\n" for o in outcomes), "utf-8")
    anew.unlink()
    return outcomes


# --- the page ---------------------------------------------------------------------------------------------------------


def _short(site: Site, longest: int = 70) -> str:
    cut = [text if len(text) <= longest else text[: longest - 1] + "…" for text in (site.before, site.after)]
    return " → ".join(cut)


def table(outcomes: list[Outcome]) -> str:
    """Counts by part, then the survivors by module, in Markdown."""
    lines = [
        "| part | planted | caught | survived | equivalent | caught of those that matter |",
        "|---|---|---|---|---|---|",
    ]
    for part in [*PARTS, "all"]:
        of = Counter(o.verdict for o in outcomes if part in (o.part, "all"))
        matter = of["caught"] + of["survived"]
        if matter:
            share = f"{100 * of['caught'] / matter:.0f} %"
            lines.append(
                f"| {part} | {of.total()} | {of['caught']} | {of['survived']} | {of['equivalent']} | {share} |"
            )
    lines += ["", "| survivor in | line | kind | error | tests |", "|---|---|---|---|---|"]
    for o in sorted((o for o in outcomes if o.verdict == "survived"), key=lambda o: (o.site.module, o.site.line)):
        text = _short(o.site).replace("|", "\\|").replace("`", "'").replace("\n", " ")
        lines.append(f"| {o.site.module} | {o.site.line} | {o.site.kind} | `{text}` | {o.by} |")
    return "\n".join(lines) + "\n"


def write_page(outcomes: list[Outcome], told: str) -> None:
    before, rest = PAGE.read_text("utf-8").split(BEGIN)
    PAGE.write_text(f"{before}{BEGIN}{told}\n\n{table(outcomes)}{END}{rest.split(END)[1]}", "utf-8")


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=200, help="how many errors")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--module", help="a file of the package, from the root of the repository")
    parser.add_argument("--part", action="append", choices=[*PARTS], help="of the errors drawn, those of this part")
    parser.add_argument("--validation", action="store_true", help="by the subjects of `simbrake validate` alone")
    parser.add_argument("--jobs", type=int, default=2, help="how many at a time")
    parser.add_argument("--limit", type=float, default=240.0, help="seconds after which no further test begins")
    parser.add_argument("--list", action="store_true", help="print the places, and plant nothing")
    parser.add_argument(
        "--again", action="store_true", help="the survivors of this batch anew, in the tree as it is now"
    )
    parser.add_argument("--map", nargs="*", metavar="FILE", help="record which test runs what; these files anew")
    parser.add_argument("--page", action="store_true", help="write the outcome into docs/planted_errors.md")
    chosen = parser.parse_args(arguments)
    if chosen.map is not None:
        if sys.version_info < (3, 12):
            parser.error("--map needs Python 3.12 or newer (sys.monitoring)")
        make_map(chosen.map, chosen.jobs)
        return
    where = f"-{Path(chosen.module).stem}" if chosen.module else ""
    where += "-validation" if chosen.validation else ""
    target = KEPT / f"outcomes-{chosen.seed}{where}.jsonl"
    if chosen.again:
        outcomes = tried_again(target, chosen.jobs, chosen.limit, chosen.validation)
    else:
        found = list(drawn(chosen.count, chosen.seed, chosen.module))
        found = [site for site in found if not chosen.part or part_of(site.module) in chosen.part]
        if chosen.list:
            for site in found:
                print(f"{site.module}:{site.line} {site.kind}: {_short(site)}")
            return
        outcomes = run_batch(found, chosen.jobs, chosen.limit, target, chosen.validation)
    print(table(outcomes))
    if chosen.page:
        spent = f"{sum(o.seconds for o in outcomes) / 60 / chosen.jobs:.0f} min with {chosen.jobs} jobs"
        write_page(outcomes, f"{len(outcomes)} errors, seed {chosen.seed}, {spent}.")


if __name__ == "__main__":
    main()
