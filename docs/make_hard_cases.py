"""Writes `hard_cases.md`, the table of hard cases, from the cases that the tests check. Run it from this folder.

Errors are rounded up to powers of ten, so that the table is the same on every machine. Takes about six minutes.
"""

import importlib
import pathlib
import sys
import warnings

import jax

jax.config.update("jax_numpy_dtype_promotion", "strict")

HERE = pathlib.Path(__file__).parent
sys.path[:0] = [str(HERE.parent / "tests" / folder) for folder in (".", "physics", "engine", "files")]

PARTS = [
    ("Friction and geometry", "oracles.hard_limits", "test_hard_brake.py::test_limits"),
    ("Events, rest and motion", "oracles.hard_events", "test_hard_brake.py::test_events"),
    ("Time, units, tolerances", "oracles.hard_time", "test_hard_brake.py::test_time"),
    ("Heat", "oracles.hard_heat", "test_hard_heat.py::test_heat"),
    ("Input", "oracles.hard_input", "test_hard_input.py::test_input"),
]

HEAD = """# Hard cases

Results of simbrake for cases in which stick–slip simulators are likely to fail: numbers with their error against a
closed form or an independent integration (relative, rounded up to a power of ten ≥ 1e-13), or a code. The tests check
the same functions (`pytest -k hard tests`; rows marked *slow* with `-m slow`); `python make_hard_cases.py` in this
folder recomputes the table. Rows "asserted" belong to an older test, which is run for the table too. The last column
shows SciPy's `solve_ivp` with events, where informative.
"""

FOOT = """
## Conclusions

- `band_snap`, `flash_fold`, `singular_geometry` name a point beyond which the equations have no solution. A solver of
  ordinary differential equations passes it without a message.
- At f·tan(β/2) = 1 − 1e-12 the torque has four digits, as friction itself is given to a rounding of 1. No other
  accuracy is lost.
- Corners of levers and loads are time breakpoints, not events: a step ends on them, however short the ramp. A load
  profile without knots (user-defined) is sampled about 1000 times in a run ([integration.md](integration.md)).
- NaN and infinite parameters are rejected before the run with their paths. Where they are traced (`jit`, `vmap`,
  `grad`) the run ends with the code `not_finite` before it begins.
"""


def text(words: object) -> str:
    return str(words).replace("|", "\\|").replace("\n", " ")


def row(case) -> str:
    from hard_cases import Elsewhere

    if isinstance(case, Elsewhere):
        getattr(importlib.import_module(case.file), case.test)(**case.arguments)
        file = f"`{case.file}.py::{case.test}`"
        return f"| {text(case.name)} | {text(case.why)} | asserted in {file}: {text(case.asserts)} | |"
    found = case.run()
    for one in found:
        one.check()
    name = case.name + (" (*slow*)" if case.slow else "")
    said = case.scipy() if case.scipy else ""
    return f"| {text(name)} | {text(case.why)} | {text('; '.join(map(str, found)))} | {text(said)} |"


def main() -> None:
    warnings.simplefilter("ignore")
    lines = [HEAD]
    for title, module, test in PARTS:
        print(title, flush=True)
        lines += [
            f"## {title}",
            "",
            f"`{test}`",
            "",
            "| case | what makes it hard | simbrake | SciPy |",
            "|---|---|---|---|",
        ]
        lines += [row(case) for case in importlib.import_module(module).CASES]
        lines.append("")
        jax.clear_caches()
    (HERE / "hard_cases.md").write_text("\n".join(lines) + FOOT, "utf-8")


if __name__ == "__main__":
    main()
