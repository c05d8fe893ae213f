"""Tables generated from the code: directive `code-table` with the subjects below."""

from collections.abc import Callable

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from simbrake._physics import _mechanism as _modes
from simbrake._run import _log as _stages
from simbrake._run._log import EVENTS
from simbrake._run._metrics import METRICS
from simbrake._run._series import PAIR_COLUMNS, SERIES_COLUMNS


def _table(head: str, rows: list[tuple[object, ...]]) -> list[str]:
    columns = [cell.strip() for cell in head.split("|")]
    body = ["| " + " | ".join(str(cell).replace("|", "\\|") for cell in row) + " |" for row in rows]
    return ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns), *body]


def events() -> list[str]:
    rows: list[tuple[object, ...]] = [(f"`{name}`", about.meaning, about.brakes) for name, about in EVENTS.items()]
    return _table("event | meaning | brakes", rows)


def modes() -> list[str]:
    rows: list[tuple[object, ...]] = [(int(m), f"`{m.name}`", *words) for m, words in _modes.BAND_MODES.items()]
    return _table("number | mode | band | holds while", rows)


def stages() -> list[str]:
    return _table("stage | pairs", [(f"`{name}`", words) for name, words in _stages.STAGES.items()])


def statuses() -> list[str]:
    rows: list[tuple[object, ...]] = [(f"`{status}`", words) for status, words in _stages.STATUS_MESSAGES.items()]
    return _table("status | message", rows)


def codes() -> list[str]:
    done = (0, "a status above", "the run reached its end time", "")
    found = [(int(code), f"`{name}`", what, hint) for code, (name, what, hint) in _stages.FAILURES.items()]
    return _table("code | status | message | remedy", [done, *sorted(found)])


def metrics() -> list[str]:
    rows: list[tuple[object, ...]] = [
        (f"`{name}`", about.unit.replace("*", "·"), about.meaning, about.needs.scenes)
        for name, about in METRICS.items()
    ]
    return _table("metric | unit | meaning | scenes", rows)


def series() -> list[str]:
    rows: list[tuple[object, ...]] = [
        (f"`{name}`", about.unit.replace("*", "·"), about.meaning) for name, about in SERIES_COLUMNS.items()
    ]
    return _table("column | unit | meaning", rows)


def pairs() -> list[str]:
    """Columns of a friction pair."""
    rows: list[tuple[object, ...]] = [
        (f"`{name}`", about.unit.replace("*", "·"), about.meaning) for name, about in PAIR_COLUMNS.items()
    ]
    return _table("column | unit | meaning", rows)


TABLES: dict[str, Callable[[], list[str]]] = {
    "events": events,
    "modes": modes,
    "stages": stages,
    "statuses": statuses,
    "codes": codes,
    "metrics": metrics,
    "series": series,
    "pairs": pairs,
}


class CodeTable(SphinxDirective):
    """One of the tables."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        subject = self.arguments[0]
        holder = nodes.container()
        lines = StringList(TABLES[subject](), source=f"table of {subject}")
        self.state.nested_parse(lines, self.content_offset, holder)
        return holder.children


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("code-table", CodeTable)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
