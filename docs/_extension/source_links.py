"""The source of simbrake as pages, and links to it:
`` [`brakes.band.grip`](../../simbrake/brakes/band.py) ``.

On a hosting site such a link opens the file. In the built pages it leads to the line of
that name; a name that is not in the file is a warning, so that the texts cannot name
code that is gone.
"""

import ast
import pathlib
import posixpath
from collections.abc import Iterator
from typing import Any

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.util import logging

import simbrake

_log = logging.getLogger(__name__)
PACKAGE = pathlib.Path(simbrake.__file__).parent


def _defined(body: list[ast.stmt], name: str) -> Any:
    for node in body:
        targets = getattr(node, "targets", [getattr(node, "target", None)])
        if name in (
            getattr(node, "name", None),
            *(getattr(target, "id", None) for target in targets),
        ):
            return node
    return None


def line_of(file: pathlib.Path, name: str) -> int:
    """Line of a dotted name below simbrake (`hybrid._loop`,
    `brakes.band.BondedLinings`) in the file that has it.

    Raises `KeyError` where it is not there.
    """
    module = [
        part
        for part in file.relative_to(PACKAGE).with_suffix("").parts
        if part != "__init__"
    ]
    parts = name.split(".")
    if parts[: len(module)] != module:
        raise KeyError(f"{name} is not in {file.name}")
    node = ast.parse(file.read_text("utf-8"))
    line = 1
    for part in parts[len(module) :]:
        node = _defined(node.body, part)
        if node is None:
            raise KeyError(f"no {part!r} of {name!r} in {file.name}")
        line = node.lineno
    return line


def _to_pages(app: Sphinx, doctree: nodes.document) -> None:
    """Links to files of the package become links to their pages, before Sphinx collects
    them as downloads."""
    here = app.env.docname
    for node in list(doctree.findall(addnodes.download_reference)):
        file = pathlib.Path(app.env.relfn2path(node["reftarget"], here)[1]).resolve()
        if not file.is_relative_to(PACKAGE.resolve()):
            continue
        file = PACKAGE / file.relative_to(PACKAGE.resolve())
        line = 1
        try:
            line = line_of(file, node.astext())
        except KeyError as error:
            _log.warning("source: %s", error.args[0], location=node)
        page = (
            "_modules/"
            + file.relative_to(PACKAGE.parent).with_suffix(".html").as_posix()
        )
        uri = posixpath.relpath(page, posixpath.dirname(here) or ".")
        node.replace_self(
            nodes.reference(
                "",
                "",
                *node.children,
                refuri=f"{uri}#L-{line}",
                internal=True,
                classes=["source"],
            )
        )


def _pages(app: Sphinx) -> Iterator[tuple[str, dict[str, Any], str]]:
    highlighter = app.builder.highlighter  # pyright: ignore
    for file in sorted(PACKAGE.rglob("*.py")):
        name = file.relative_to(PACKAGE.parent).as_posix()
        code = highlighter.highlight_block(
            file.read_text("utf-8"),
            "python",
            linenos="inline",
            lineanchors="L",
            anchorlinenos=True,
        )
        page = "_modules/" + name.removesuffix(".py")
        yield page, {"title": name, "body": f"<h1>{name}</h1>\n{code}"}, "page.html"


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("doctree-read", _to_pages, priority=100)
    app.connect("html-collect-pages", _pages)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
