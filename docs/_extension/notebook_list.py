"""Directive `notebooks`: the notebooks of the repository with title and first sentence, to be downloaded."""

import json
import pathlib

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

FOLDER = pathlib.Path(__file__).parents[2] / "notebooks"


def _head(file: pathlib.Path) -> tuple[str, str]:
    cells = json.loads(file.read_text("utf-8"))["cells"]
    text = next(("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown"), file.stem)
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return lines[0].lstrip("# "), lines[1] if len(lines) > 1 else ""


class Notebooks(SphinxDirective):
    """A list of links."""

    def run(self) -> list[nodes.Node]:
        lines = []
        for file in sorted(FOLDER.glob("*.ipynb")):
            title, words = _head(file)
            lines.append(f"- {{download}}`{title} <../notebooks/{file.name}>` {words}")
        holder = nodes.container()
        none = ["This checkout has no notebooks."]
        self.state.nested_parse(StringList(lines or none, source="notebooks"), self.content_offset, holder)
        return holder.children


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("notebooks", Notebooks)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
