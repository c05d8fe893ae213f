"""The source of simbrake as pages, and the role `source` that leads to a line of it.

`` {source}`brakes._band.tension_ratio` `` is a link to that function; a name that does not exist is a warning, so that
the texts cannot name code that is gone.
"""

import ast
import functools
import pathlib
from collections.abc import Iterator
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.docutils import SphinxRole

import simbrake

_log = logging.getLogger(__name__)
PACKAGE = pathlib.Path(simbrake.__file__).parent


def _body_of(tree: Any, name: str) -> Any:
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name == name:
            return node
        if isinstance(node, ast.Assign) and any(isinstance(t, ast.Name) and t.id == name for t in node.targets):
            return node
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and node.target.id == name:
            return node
    return None


@functools.cache
def _parsed(file: pathlib.Path) -> ast.Module:
    return ast.parse(file.read_text("utf-8"))


def find(name: str) -> tuple[str, int]:
    """Page and line of a dotted name below simbrake (`hybrid._loop`, `_physics._forces.Forces.limits`).

    Raises `KeyError` where there is none.
    """
    parts, folder = name.split("."), PACKAGE
    while (folder / parts[0]).is_dir():
        folder /= parts.pop(0)
        if not parts:
            parts = ["__init__"]
    file = folder / f"{parts[0]}.py"
    if not file.is_file():
        raise KeyError(f"no module for {name!r} in simbrake")
    node, line = _parsed(file), 1
    for part in parts[1:]:
        node = _body_of(node, part)
        if node is None:
            raise KeyError(f"no {part!r} of {name!r} in {file.name}")
        line = node.lineno
    return "_modules/" + file.relative_to(PACKAGE.parent).with_suffix("").as_posix(), line


class SourceRole(SphinxRole):
    """A link to a line of the source."""

    def run(self) -> tuple[list[nodes.Node], list[nodes.system_message]]:
        literal = nodes.literal(self.text, self.text)
        try:
            page, line = find(self.text)
        except KeyError as error:
            _log.warning("source: %s", error.args[0], location=self.get_location())
            return [literal], []
        builder = self.env.app.builder
        if builder.format != "html":
            return [literal], []
        uri = f"{builder.get_relative_uri(self.env.docname, page)}#L-{line}"
        return [nodes.reference("", "", literal, refuri=uri, internal=True, classes=["source"])], []


def _pages(app: Sphinx) -> Iterator[tuple[str, dict[str, Any], str]]:
    highlighter = app.builder.highlighter  # pyright: ignore
    for file in sorted(PACKAGE.rglob("*.py")):
        name = file.relative_to(PACKAGE.parent).as_posix()
        code = highlighter.highlight_block(
            file.read_text("utf-8"), "python", linenos="inline", lineanchors="L", anchorlinenos=True
        )
        page = "_modules/" + name.removesuffix(".py")
        yield page, {"title": name, "body": f"<h1>{name}</h1>\n{code}"}, "page.html"


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_role("source", SourceRole())
    app.connect("html-collect-pages", _pages)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
