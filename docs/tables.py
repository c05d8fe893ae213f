"""Writes what the pages take from the code: `python docs/tables.py`; with `--check` it
only names the pages that are not up to date, and fails.

It stands between `<!-- KIND NAME -->` and `<!-- end -->`. The kinds: `table` of
`TABLES`, `list` of `LISTS`, `measured`: what a benchmark has written as JSON,
`printed`: a table of the papers, `estimates`: estimates beside simulations.
"""

import functools
import json
import pathlib
import re
import sys
from collections.abc import Callable
from typing import Any

from simbrake.outputs import log as names
from simbrake.outputs.metrics import METRICS
from simbrake.outputs.quantities import PAIR_COLUMNS, SERIES_COLUMNS
from simbrake.outputs.stages import STAGES
from simbrake.physics import mechanism
from simbrake.thermal.materials import library

DOCS = pathlib.Path(__file__).parent
# benchmarks, and what recomputes the papers
sys.path[:0] = [str(DOCS.parent), str(DOCS.parent / "papers")]
_POWERS = str.maketrans({"2": "²", "3": "³", "4": "⁴", "^": None})


def unit_of(words: str) -> str:
    """A unit as it is written by hand."""
    return words.replace("*", "·").translate(_POWERS)


def table(head: str, rows: list[tuple[Any, ...]]) -> list[str]:
    """A table in Markdown; `head` has the columns with `|` between them."""
    columns = [cell.strip() for cell in head.split("|")]
    body = [
        "| " + " | ".join(str(cell).replace("|", "\\|") for cell in row) + " |"
        for row in rows
    ]
    return ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns), *body]


def _codes() -> list[str]:
    done = (0, "a status above", "the run reached its end time", "")
    found = [
        (int(code), f"`{name}`", what, hint)
        for code, (name, what, hint) in names.FAILURES.items()
    ]
    return table("code | status | message | remedy", [done, *sorted(found)])


def _columns(of: dict[str, Any]) -> list[str]:
    return table(
        "column | unit | meaning",
        [(f"`{n}`", unit_of(about.unit), about.meaning) for n, about in of.items()],
    )


def _metrics() -> list[str]:
    rows = [
        (f"`{n}`", unit_of(about.unit), about.meaning, about.needs.scenes)
        for n, about in METRICS.items()
    ]
    return table("metric | unit | meaning | scenes", rows)


#: of the tables of the material library: heading, unit and zero of each number
LIBRARY = {
    "friction": {
        "coefficient": ("coefficient", 1.0, 0.0),
        "permissible_temperature": ("permissible, °C", 1.0, 273.15),
    },
    "thermal": {
        "conductivity": ("λ, W/(m·K)", 1.0, 0.0),
        "density": ("ρ, kg/m³", 1.0, 0.0),
        "specific_heat": ("c, J/(kg·K)", 1.0, 0.0),
    },
    "rim": {
        "young": ("$E$, GPa", 1e9, 0.0),
        "expansion": ("$\\alpha_T$, 10⁻⁶/K", 1e-6, 0.0),
        "poisson": ("$\\nu$", 1.0, 0.0),
        "permissible_stress": ("$\\sigma_p$, MPa", 1e6, 0.0),
        "permissible_temperature": ("$T_p$, °C", 1.0, 273.15),
        "solidus": ("solidus, °C", 1.0, 273.15),
        "hardness": ("hardness, MPa", 1e6, 0.0),
    },
    "lining": {
        "wear_coefficient": ("$I_0$, 10⁻¹⁴ m³/(N·m)", 1e-14, 0.0),
        "wear_threshold": ("$T_t$, °C", 1.0, 273.15),
        "wear_activation": ("$E_a$, kJ/mol", 1e3, 0.0),
        "permissible_temperature": ("$T_p$, °C", 1.0, 273.15),
        "hardness": ("hardness, MPa", 1e6, 0.0),
    },
}


def _library(part: str) -> list[str]:
    """Materials of a part of the library: value, range of what friction depends on, `*`
    for an assumption, sources."""
    rows = []
    for name, numbers in library(part).items():
        cells = []
        for number, (_, unit, zero) in LIBRARY[part].items():
            # as the permissible temperature of a class of SAE J866
            if (one := numbers.get(number)) is None:
                cells.append("")
                continue
            value, *ends = (
                f"{x / unit - zero:.4g}" for x in (one.value, one.low, one.high)
            )
            span = f" ({'…'.join(dict.fromkeys(ends))})" if part == "friction" else ""
            cells.append(f"{value}{span}{' *' * one.assumed}")
        sources = dict.fromkeys(
            one.source.removeprefix("assumption: ") for one in numbers.values()
        )
        whole = [
            one
            for one in sources
            if not any(other.startswith(one) and other != one for other in sources)
        ]
        rows.append((f"`{name}`", *cells, "; ".join(whole)))
    headings = [heading for heading, _, _ in LIBRARY[part].values()]
    return table(" | ".join(["material", *headings, "sources"]), rows)


TABLES: dict[str, Callable[[], list[str]]] = {
    "events": lambda: table(
        "event | meaning | brakes",
        [(f"`{n}`", e.meaning, e.brakes) for n, e in names.EVENTS.items()],
    ),
    "modes": lambda: table(
        "number | mode | band | holds while",
        [(int(m), f"`{m.name}`", *words) for m, words in mechanism.BAND_MODES.items()],
    ),
    "stages": lambda: table(
        "stage | pairs", [(f"`{n}`", words) for n, words in STAGES.items()]
    ),
    "statuses": lambda: table(
        "status | message",
        [(f"`{s}`", words) for s, words in names.STATUS_MESSAGES.items()],
    ),
    "codes": _codes,
    "metrics": _metrics,
    "series": lambda: _columns(SERIES_COLUMNS),
    "pairs": lambda: _columns(PAIR_COLUMNS),
    **{f"{part}_materials": functools.partial(_library, part) for part in LIBRARY},
}


def _notebooks() -> list[str]:
    """Title and question of every notebook."""
    lines = []
    for file in sorted((DOCS.parent / "notebooks").glob("*.ipynb")):
        cells = json.loads(file.read_text("utf-8"))["cells"]
        text = "".join(
            next(cell["source"] for cell in cells if cell["cell_type"] == "markdown")
        )
        title, question, *_ = [
            line.strip() for line in text.splitlines() if line.strip()
        ]
        lines.append(
            f"- [{title.lstrip('# ')}](../notebooks/{file.name}): "
            f"{question.removeprefix('**Question.** ')}"
        )
    return lines


def _measured(name: str) -> list[str]:
    """A scene of the work–precision benchmark, or a part of the benchmark of costs."""
    from benchmarks import costs, report
    from benchmarks.machine import measured_on

    if name in costs.PARTS:
        return costs.markdown(
            json.loads(costs.NUMBERS.read_text("utf-8")), name
        ).splitlines()
    found = json.loads((DOCS / "pictures" / "precision.json").read_text("utf-8"))
    packages = ("python", "jax", "scipy", "heyoka", "pydiffsol", "casadi")
    return [
        *report.markdown(found["scenes"][name]).splitlines(),
        "",
        measured_on(found["machine"], packages),
    ]


def _hard_cases() -> list[str]:
    """Cases that are hard for simulators of stick and slip."""
    found = json.loads((DOCS / "measured" / "hard_cases.json").read_text("utf-8"))
    lines = []
    for part, rows in found.items():
        lines += [
            f"### {part}",
            "",
            *table("case | what makes it hard | simbrake", rows),
            "",
        ]
    return lines


def _sticking() -> list[str]:
    """The benchmark of exact sticking."""
    from benchmarks import machine, sticking

    found = json.loads((DOCS / "measured" / "sticking.json").read_text("utf-8"))
    measured = machine.measured_on(found["machine"], ("python", "jax", "scipy"))
    return [*sticking.markdown(found), "", measured]


def _estimates(name: str) -> list[str]:
    """Tables of estimates beside simulations, and remarks on them."""
    lines = []
    for part in json.loads((DOCS / "measured" / "estimates.json").read_text("utf-8"))[
        name
    ]:
        lines += (
            [f"- {part}"]
            if isinstance(part, str)
            else [*table(" | ".join(part["head"]), part["rows"]), ""]
        )
    return lines


def _printed(name: str) -> list[str]:
    """A printed table of the papers beside the computed one, or their claims."""
    import claims
    import write_page

    if name == "claims":
        return claims.page(json.loads(claims.NUMBERS.read_text("utf-8"))).splitlines()
    return write_page.block(name).splitlines()


LISTS: dict[str, Callable[[], list[str]]] = {
    "notebooks": _notebooks,
    "hard_cases": _hard_cases,
    "sticking": _sticking,
}
BLOCKS: dict[str, Callable[[str], list[str]]] = {
    "table": lambda name: TABLES[name](),
    "list": lambda name: LISTS[name](),
    "measured": _measured,
    "printed": _printed,
    "estimates": _estimates,
}
_BLOCK = re.compile(
    rf"(?<=^<!-- )({'|'.join(BLOCKS)}) (\w+) -->\n.*?(?=^<!-- end -->$)", re.M | re.S
)


def filled(text: str) -> str:
    """A page with what its marks stand for."""

    def block(mark: re.Match[str]) -> str:
        kind, name = mark.groups()
        lines = "\n".join(BLOCKS[kind](name)).strip()
        return f"{kind} {name} -->\n\n{lines}\n\n"

    return _BLOCK.sub(block, text)


def main() -> None:
    stale = []
    for page in sorted(DOCS.rglob("*.md")):
        text = page.read_text("utf-8")
        if (new := filled(text)) == text:
            continue
        stale.append(str(page.relative_to(DOCS)))
        if "--check" not in sys.argv:
            page.write_text(new, "utf-8")
    if stale and "--check" in sys.argv:
        sys.exit(f"run `python docs/tables.py`: {', '.join(stale)} would change")


if __name__ == "__main__":
    main()
