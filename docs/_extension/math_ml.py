"""Equations as MathML, which browsers draw by themselves: the pages need no script and no network."""

import re
from typing import Any

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util import logging

_log = logging.getLogger(__name__)
_TAG = re.compile(r"\\tag\{([^{}]*)\}")


def mathml(tex: str, block: bool) -> str:
    """MathML of `tex`. Raises `MathError` for what it does not know, also a fraction without braces."""
    if re.search(r"\\[dt]?frac[^{a-z]", tex):
        raise MathError(f"\\frac needs braces around both parts: {tex}")
    return re.sub(r">\s+<", "><", tex2mathml(tex, as_block=block))


def _drawn(self: Any, node: nodes.Element, block: bool) -> str:
    try:
        return mathml(_TAG.sub("", node.astext()).strip(), block)
    except MathError as error:
        _log.warning("equation: %s", error, location=node)
        return self.encode(node.astext())


def _inline(self: Any, node: nodes.Element) -> None:
    self.body.append(_drawn(self, node, block=False))
    raise nodes.SkipNode


def _block(self: Any, node: nodes.Element) -> None:
    source = _TAG.search(node.astext())
    tag = f'<span class="equation-source">{self.encode(source[1])}</span>' if source else ""
    self.body.append(f'<div class="equation">{_drawn(self, node, block=True)}{tag}</div>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
