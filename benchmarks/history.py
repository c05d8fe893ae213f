"""How sizes and times of a dozen scenes went from commit to commit: a file that this command appends to and draws.

`python benchmarks/history.py [--add] [--scene a --scene b …] [--png history.png]`

`--add` measures the scenes of `benchmarks/size.py` at the present commit and appends a row for each to
`benchmarks/history.csv`: equations, lines, step attempts, error, processor time to trace and compile in imports of
JAX, of a warm run in runs of a fixed problem by SciPy. Units of the same minute on the same machine make rows of
different machines comparable, by some ten percent. `--png` draws the file, a line for each scene.

Counts are tests as well (`tests/engine/test_program_size.py`); times are not: they depend on what else runs.
"""

import argparse
import csv
import datetime
import pathlib
import subprocess
import sys
from collections.abc import Iterable
from typing import Any

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))
FILE = ROOT / "benchmarks" / "history.csv"
#: column → how it is drawn
DRAWN = {
    "equations": "equations of the run",
    "compile, imports": "tracing and compiling, imports of JAX",
    "warm run, units": "warm run, runs of SciPy's unit",
    "attempts": "step attempts",
}
COLUMNS = ("date", "commit", "jax", "cpu", "scene", "equations", "lines", "attempts", "error")
COLUMNS += ("compile, imports", "warm run, units")


def commit() -> str:
    """The commit that is measured, with a star where files differ from it."""

    def git(*arguments: str) -> str:
        return subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()

    return git("rev-parse", "--short", "HEAD") + ("*" if git("status", "--porcelain", "--", "simbrake") else "")


def unit_run() -> float:
    """Processor seconds of a fixed problem by SciPy: a damped oscillator over 30 swings by DOP853."""
    from scipy.integrate import solve_ivp

    from benchmarks.parts.timing import interleaved

    def run() -> Any:
        return solve_ivp(lambda t, y: (y[1], -y[0] - 0.1 * y[1]), (0.0, 188.0), (1.0, 0.0), "DOP853", rtol=1e-8)

    return interleaved({"unit": run}, 1.0)["unit"].cpu_median


def rows(names: Iterable[str]) -> Iterable[dict[str, Any]]:
    """One row for each scene, as it is measured."""
    import concurrent.futures
    import multiprocessing

    import jax

    from benchmarks import size
    from benchmarks.machine import machine
    from benchmarks.parts.processes import unit

    about, now, here = machine(), datetime.date.today().isoformat(), commit()
    for name in names:
        imports, reference = unit(), unit_run()
        with concurrent.futures.ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
            found = pool.submit(size.measured, name, False).result()
            error = pool.submit(error_of, name).result()
        spent = found["trace, CPU s"] + found["lower, CPU s"] + found["compile, CPU s"]
        yield {
            "date": now,
            "commit": here,
            "jax": jax.__version__,
            "cpu": f"{about['cpu']}, {about['cores']} cores",
            "scene": name,
            "equations": found["run"],
            "lines": found["StableHLO lines"],
            "attempts": found["step attempts"],
            "error": f"{error:.1e}" if error == error else "",  # none: the modes changed another number of times
            "compile, imports": f"{spent / imports:.2f}",
            "warm run, units": f"{1e-6 * found['warm run, CPU µs'] / reference:.3g}",
        }


def error_of(name: str) -> float:
    """Largest relative error of event times, friction heat and temperatures of a scene, against a tight run."""
    import simbrake as sb
    from benchmarks import shipped, size

    subject = size.SCENES[name]
    found = (sb.simulate(subject.scene(), solver=subject.solver, rtol=rtol) for rtol in (size.RTOL, shipped.TIGHT))
    mine, truth = map(shipped.Marks.of, found)
    return mine.error(truth)


def read() -> list[dict[str, str]]:
    """The rows of the file."""
    return list(csv.DictReader(FILE.read_text("utf-8").splitlines())) if FILE.exists() else []


def draw(path: str) -> None:
    """A panel for each of four columns, over the commits, relative to the first row of every scene."""
    import matplotlib.pyplot as plt

    history = read()
    commits = list(dict.fromkeys(row["commit"] for row in history))
    figure, panels = plt.subplots(len(DRAWN), 1, figsize=(8, 10), sharex=True, layout="constrained")
    for panel, (column, title) in zip(panels, DRAWN.items(), strict=True):
        for i, name in enumerate(dict.fromkeys(row["scene"] for row in history)):
            own = [row for row in history if row["scene"] == name]
            first = float(own[0][column])
            at, values = [commits.index(row["commit"]) for row in own], [float(row[column]) / first for row in own]
            # (there are ten colours)
            panel.plot(at, values, "o-" if i < 10 else "s--", ms=3, label=name)
        panel.set_title(f"{title}, over the first row of each scene", loc="left", fontsize=9)
        panel.grid(alpha=0.3)
    panels[-1].set_xticks(range(len(commits)), commits, rotation=45)
    panels[-1].set_xlabel("commit")
    figure.legend(*panels[0].get_legend_handles_labels(), ncols=6, fontsize=8, loc="outside upper left")
    figure.savefig(path, dpi=150)


def main() -> int:
    from benchmarks import size

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--add", action="store_true", help="measure the present commit and append it")
    parser.add_argument("--scene", action="append", choices=list(size.SCENES), help="default: all")
    parser.add_argument("--png", help="draw the file")
    options = parser.parse_args()
    if options.add:
        begins = not FILE.exists()
        with FILE.open("a", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, COLUMNS)
            if begins:
                writer.writeheader()
            for row in rows(options.scene or size.SCENES):
                writer.writerow(row)
                file.flush()
                print(
                    ", ".join(f"{name} {value}" for name, value in row.items() if name not in COLUMNS[:4]), flush=True
                )
    if options.png:
        draw(options.png)
    if not (options.add or options.png):
        print(f"{len(read())} rows in {FILE.relative_to(ROOT)}; --add measures, --png FILE draws")
    return 0


if __name__ == "__main__":
    sys.exit(main())
