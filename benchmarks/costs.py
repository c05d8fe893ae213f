"""What simbrake's answers cost, each beside its limit and its error, and beside a peer or a bare loop of the same run.

`python benchmarks/costs.py [--quick] [--parts first,again,…] [--json out.json] [--png out.png]`

- `first`: a fresh process of Python up to its first result, in imports of jax and diffrax
- `again`: `simbrake run` on shipped scenes, cold and a second time, and mistakes, in imports of jax
- `looking`: a result printed, its metrics and events, in the time of its run
- `engine`: a warm run against a bare loop with as many evaluations; an event in steps
- `loops`: run after run from Python, beside heyoka; `simulate` and `jax.jit` beside prepared runs
- `gradient`: derivatives in warm runs, and what they take to compile
- `ensemble`: runs a second beside SciPy and beside a bare loop over chunks
- `growth`: time over the number of layers and linings
- `elsewhere`: what needs many cores or an accelerator, as last measured

Quote ratios: times depend on the machine and on what else it does. `--write-docs` puts the tables into docs/costs.md.
"""

import argparse
import json
import os
import pathlib
import sys
import time
import warnings
from typing import Any

# matrices are small: more threads would only wait for each other
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
os.environ.setdefault("JAX_PLATFORMS", "cpu")
os.environ["SIMBRAKE_CACHE_DIR"] = ""  # what is compiled here is compiled anew
ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from benchmarks import documents, ours  # noqa: E402
from benchmarks.machine import machine  # noqa: E402
from benchmarks.parts import chart, elsewhere, table  # noqa: E402

PARTS = ("first", "again", "looking", "engine", "loops", "gradient", "ensemble", "growth", "elsewhere")


def measured(names: list[str], quick: bool, where: str) -> list[table.Part]:
    """The parts asked for, each printed as it is done; `where`: the machine, of what not every machine can measure."""
    import importlib

    found = []
    for name in names:
        start = time.perf_counter()
        part = importlib.import_module(f"benchmarks.parts.{name}").measure(quick)
        print(table.text(part), f"\n  ({time.perf_counter() - start:.0f} s)", flush=True)
        elsewhere.keep(part.targets if name != elsewhere.NAME and not quick else [], where)
        found.append(part)
    return found


def write_docs(path: pathlib.Path, about: dict[str, Any], parts: list[table.Part]) -> None:
    """Puts the tables of the parts between the two marks of a document; parts not measured stay as they are."""
    head = documents.measured_on(about, ("python", "jax", "diffrax", "scipy"))
    # what was measured on other machines tells its own
    texts = {part.name: [table.markdown(part), *([] if part.name == elsewhere.NAME else [head])] for part in parts}
    documents.write(path, "part", {name: "\n\n".join(lines) for name, lines in texts.items()}, PARTS)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="few sizes, one scene, short timings")
    parser.add_argument("--parts", default=",".join(PARTS), help="default: all")
    parser.add_argument("--json", help="file for the numbers")
    parser.add_argument("--png", help="file for the chart")
    parser.add_argument("--write-docs", action="store_true", help="write the tables into docs/costs.md")
    options = parser.parse_args()
    names = options.parts.split(",")
    if unknown := set(names) - set(PARTS):
        parser.error(f"no part {', '.join(sorted(unknown))}; there are {', '.join(PARTS)}")
    warnings.filterwarnings("ignore", message=".*divide.*|.*overflow.*")
    ours.configure()
    about = machine()
    print(f"{about['cpu']}, {about['cores']} cores, load {about['load']:.1f}")
    print(", ".join(f"{name} {number}" for name, number in about["versions"].items()))
    parts = measured(names, options.quick, f"{about['cpu']}, {about['cores']} cores; JAX {about['versions']['jax']}")
    if options.json:
        numbers = {"machine": about, "quick": options.quick, "parts": {part.name: part.as_numbers() for part in parts}}
        pathlib.Path(options.json).write_text(json.dumps(numbers, indent=1))
    if options.png:
        chart.draw(about, parts, options.png)
    if options.write_docs:
        write_docs(ROOT / "docs" / "costs.md", about, parts)
    missed = [target for part in parts for target in part.targets if not target.met]
    print(f"\n{sum(len(part.targets) for part in parts) - len(missed)} targets reached, {len(missed)} missed")
    return 0


if __name__ == "__main__":
    sys.exit(main())
