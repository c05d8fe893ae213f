"""Equations as MathML, which browsers draw natively: the pages need no script and no
network."""

import re
from typing import Any

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util import logging

_log = logging.getLogger(__name__)
_TAG = re.compile(r"\\tag\{([^{}]*)\}")
# the accents proper vanish in the letter where no mathematical font is installed
_DOTS = {"˙": ".", "¨": ".."}
_DOTTED = re.compile(
    r"<(mover|munderover)[^>]*><mi>(\w)</mi>((?:(?!</mu?n?d?e?r?over>).)*?)<mo[^>]*>([˙¨])</mo></\1>"
)


def mathml(tex: str, block: bool) -> str:
    """MathML of `tex`. Raises `MathError` for what it does not know, also a fraction
    without braces."""
    if re.search(r"\\[dt]?frac[^{a-z]", tex):
        raise MathError(f"\\frac needs braces around both parts: {tex}")
    text = re.sub(r">\s+<", "><", tex2mathml(tex, as_block=block))
    text = text.replace("<mo>∶</mo><mo>=</mo>", "<mo>≔</mo>").replace(
        "<mtable ", '<mtable displaystyle="true" '
    )
    text = re.sub(
        r"<mo[^>]*>\|</mo>", '<mo stretchy="false" lspace="0" rspace="0">|</mo>', text
    )
    text = re.sub(
        r"<mo>(sin|cos|tan|arcsin|exp|ln|max|min)</mo>",
        r'<mo lspace="0" rspace="0.17em">\1</mo>',
        text,
    )
    return _DOTTED.sub(_dotted, text)


def _dotted(match: re.Match[str]) -> str:
    """A letter with dots, its index beside it instead of below."""
    letter = (
        f'<mover accent="true"><mi>{match[2]}</mi><mo '
        f'stretchy="false">{_DOTS[match[4]]}</mo></mover>'
    )
    return f"<msub>{letter}{match[3]}</msub>" if match[3] else letter


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
    tag = (
        f'<span class="equation-source">{self.encode(source[1])}</span>'
        if source
        else ""
    )
    self.body.append(
        f'<div class="equation">{_drawn(self, node, block=True)}{tag}</div>\n'
    )
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
