"""Writes `measured/hard_cases.json` for `claims_and_evidence.md` from the cases that
the tests check.

Errors are rounded up to powers of ten, so that the table is the same on every machine.
Takes about six minutes.
"""

import importlib
import json
import pathlib
import sys
import warnings

import jax

jax.config.update("jax_numpy_dtype_promotion", "strict")

HERE = pathlib.Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "tests"))

PARTS = {
    "Friction and geometry": "oracles.hard_limits",
    "Events, rest and motion": "oracles.hard_events",
    "Time, units, tolerances": "oracles.hard_time",
    "Heat": "oracles.hard_heat",
    "Input": "oracles.hard_input",
}


def row(case) -> list[str]:
    found = case.run()
    for one in found:
        one.check()
    name = case.name + (" (*slow*)" if case.slow else "")
    return [name, case.why, "; ".join(map(str, found))]


def main() -> None:
    warnings.simplefilter("ignore")
    found = {}
    for title, module in PARTS.items():
        print(title, flush=True)
        found[title] = [row(case) for case in importlib.import_module(module).CASES]
        jax.clear_caches()
    file = HERE / "measured" / "hard_cases.json"
    file.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", "utf-8")


if __name__ == "__main__":
    main()
