"""What the pages take from the code, filled in when they are built.

A line `<!-- table NAME -->` becomes a table of `TABLES`, `<!-- list NAME -->` a list of `LISTS`,
`<!-- measured NAME -->` what a benchmark has written as JSON, `<!-- printed NAME -->` a table of the papers.
"""

import json
import pathlib
import re
import sys
from collections.abc import Callable
from typing import Any

from reference import unit_of
from sphinx.application import Sphinx

from simbrake._outputs import _log as names
from simbrake._outputs._metrics import METRICS
from simbrake._outputs._quantities import PAIR_COLUMNS, SERIES_COLUMNS
from simbrake._physics import _mechanism

DOCS = pathlib.Path(__file__).parents[1]
sys.path[:0] = [str(DOCS.parent), str(DOCS.parent / "papers")]  # benchmarks, and what recomputes the papers


def table(head: str, rows: list[tuple[Any, ...]]) -> list[str]:
    """A table in Markdown; `head` has the columns with `|` between them."""
    columns = [cell.strip() for cell in head.split("|")]
    body = ["| " + " | ".join(str(cell).replace("|", "\\|") for cell in row) + " |" for row in rows]
    return ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns), *body]


def _codes() -> list[str]:
    done = (0, "a status above", "the run reached its end time", "")
    found = [(int(code), f"`{name}`", what, hint) for code, (name, what, hint) in names.FAILURES.items()]
    return table("code | status | message | remedy", [done, *sorted(found)])


def _columns(of: dict[str, Any]) -> list[str]:
    return table("column | unit | meaning", [(f"`{n}`", unit_of(about.unit), about.meaning) for n, about in of.items()])


def _metrics() -> list[str]:
    rows = [(f"`{n}`", unit_of(about.unit), about.meaning, about.needs.scenes) for n, about in METRICS.items()]
    return table("metric | unit | meaning | scenes", rows)


TABLES: dict[str, Callable[[], list[str]]] = {
    "events": lambda: table(
        "event | meaning | brakes", [(f"`{n}`", e.meaning, e.brakes) for n, e in names.EVENTS.items()]
    ),
    "modes": lambda: table(
        "number | mode | band | holds while",
        [(int(m), f"`{m.name}`", *words) for m, words in _mechanism.BAND_MODES.items()],
    ),
    "stages": lambda: table("stage | pairs", [(f"`{n}`", words) for n, words in names.STAGES.items()]),
    "statuses": lambda: table("status | message", [(f"`{s}`", words) for s, words in names.STATUS_MESSAGES.items()]),
    "codes": _codes,
    "metrics": _metrics,
    "series": lambda: _columns(SERIES_COLUMNS),
    "pairs": lambda: _columns(PAIR_COLUMNS),
}


def _notebooks() -> list[str]:
    """Title and question of every notebook."""
    lines = []
    for file in sorted((DOCS.parent / "notebooks").glob("*.ipynb")):
        cells = json.loads(file.read_text("utf-8"))["cells"]
        text = "".join(next(cell["source"] for cell in cells if cell["cell_type"] == "markdown"))
        title, question, *_ = [line.strip() for line in text.splitlines() if line.strip()]
        lines.append(f"- [{title.lstrip('# ')}](../notebooks/{file.name}): {question.removeprefix('**Question.** ')}")
    return lines


def _measured(name: str) -> list[str]:
    """A scene of the work–precision benchmark, or a part of the benchmark of costs."""
    from benchmarks import costs, report
    from benchmarks.machine import measured_on

    if name in costs.PARTS:
        return costs.markdown(json.loads(costs.NUMBERS.read_text("utf-8")), name).splitlines()
    found = json.loads((DOCS / "pictures" / "precision.json").read_text("utf-8"))
    packages = ("python", "jax", "scipy", "heyoka", "pydiffsol", "casadi")
    return [*report.markdown(found["scenes"][name]).splitlines(), "", measured_on(found["machine"], packages)]


def _hard_cases() -> list[str]:
    """Cases that are hard for simulators of stick and slip."""
    found, lines = json.loads((DOCS / "measured" / "hard_cases.json").read_text("utf-8")), []
    for part, rows in found.items():
        lines += [f"### {part}", "", *table("case | what makes it hard | simbrake | SciPy", rows), ""]
    return lines


def _printed(name: str) -> list[str]:
    """A printed table of the papers beside the computed one, or their claims."""
    import claims
    import write_page

    if name == "claims":
        return claims.page(json.loads(claims.NUMBERS.read_text("utf-8"))).splitlines()
    return write_page.block(name).splitlines()


LISTS: dict[str, Callable[[], list[str]]] = {"notebooks": _notebooks, "hard_cases": _hard_cases}
BLOCKS: dict[str, Callable[[str], list[str]]] = {
    "table": lambda name: TABLES[name](),
    "list": lambda name: LISTS[name](),
    "measured": _measured,
    "printed": _printed,
}
_MARK = re.compile(r"^<!-- (table|list|measured|printed) (\w+) -->$", re.M)


def filled(text: str) -> str:
    """A page with what its marks stand for."""
    return _MARK.sub(lambda mark: "\n".join(BLOCKS[mark[1]](mark[2])), text)


def _read(app: Sphinx, page: str, source: list[str]) -> None:
    source[0] = filled(source[0])


def setup(app: Sphinx) -> dict[str, bool]:
    # before the tables of contents, which are made of the lists
    app.connect("source-read", _read, priority=400)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
