"""The reference by Sphinx's autodoc: `.. reference::` takes names, and modules, of
which all public names are meant.

Docstrings are close to reStructuredText. What they lack for it is added here: `name` in
backticks becomes a link where it is a public name, indented formulas become literal,
and classes get a table of their parameters with units.
"""

import dataclasses
import enum
import importlib
import inspect
import pathlib
import re
import types
from collections.abc import Iterator
from typing import Any

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.domains.python import PyXRefRole
from sphinx.environment import BuildEnvironment
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective
from tables import unit_of

import simbrake

_log = logging.getLogger(__name__)
PACKAGE = pathlib.Path(simbrake.__file__).parent
#: a result whose class has more fields than this is not made by users: its signature is
#: left out
_MANY = 12
#: a paragraph at the margin, and the indented block below it, unless that is an example
#: or an item of a list
_FORMULA = re.compile(r"^(\S.*)\n\n(?= {4}(?!>>>|- ))", re.M)

_TYPED = (addnodes.desc_annotation, addnodes.desc_returns, addnodes.desc_sig_name)
_OR = r"\0 \0\|\0 \0"
#: one type for arrays of JAX and of NumPy, word by word
_UNION = re.compile(
    rf"(\w+)\0\[\0jaxlib\._jax\.Array\0(.*?)\0\](?P<others>{_OR}\1\0\[\0ndarray\0\2\0\](?:{_OR}generic)?)"
)


def found(name: str) -> Any:
    """The object with a dotted name."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError:
        home, _, last = name.rpartition(".")
        return getattr(found(home), last)


def names_in(module: types.ModuleType, name_of_module: str) -> Iterator[str]:
    """Functions and classes that a public module lists, except those that are at the
    top of the package or among the results as well."""
    homes = [home for home in (simbrake, simbrake.results) if home is not module]
    for name in module.__all__:
        value = getattr(module, name)
        elsewhere = any(
            name in home.__all__ and getattr(home, name) is value for home in homes
        )
        if callable(value) and not elsewhere:
            yield f"{name_of_module}.{name}"


class Reference(SphinxDirective):
    """A table of contents, then every object with signature, docstring, parameters,
    members and source."""

    has_content = True

    def run(self) -> list[nodes.Node]:
        words = " ".join(self.content).split()
        values = {word: found(word) for word in words}
        names = [
            n
            for w, v in values.items()
            for n in (names_in(v, w) if isinstance(v, types.ModuleType) else [w])
        ]
        lines = [
            ".. autosummary::",
            "   :nosignatures:",
            "",
            *(f"   {name}" for name in names),
            "",
        ]
        for name in names:
            value = found(name)
            kind = "function"
            if isinstance(value, type):
                kind = "exception" if issubclass(value, Exception) else "class"
            lines += [f".. auto{kind}:: {name}", ""]
        return self.parse_text_to_nodes("\n".join(lines))


class Name(PyXRefRole):
    """What stands in backticks in a docstring: a link where it is a class, or a
    function whose name tells it."""

    def process_link(
        self, env: Any, refnode: Any, has_explicit_title: bool, title: str, target: str
    ) -> tuple[str, str]:
        title, target = super().process_link(
            env, refnode, has_explicit_title, title, target
        )
        refnode["refspecific"] = target[:1].isupper() or "_" in target
        return title, target


def parameters(cls: type) -> list[str]:
    """Table of the parameters of a scene's part, with unit and range."""
    rows = []
    for field in dataclasses.fields(cls) if dataclasses.is_dataclass(cls) else ():
        about = field.metadata.get("quantity")
        if about is not None:
            default = (
                "required"
                if field.default is dataclasses.MISSING
                else f"``{field.default!r}``"
            )
            rows.append(
                (
                    f"``{field.name}``",
                    about.meaning,
                    unit_of(about.unit),
                    about.range,
                    default,
                )
            )
    if not rows:
        return []
    lines = ["", ".. list-table::", "   :header-rows: 1", ""]
    for row in [("parameter", "meaning", "unit", "range", "default"), *rows]:
        lines += [f"   {'*' if i == 0 else ' '} - {cell}" for i, cell in enumerate(row)]
    return [*lines, ""]


def remarks(cls: type) -> list[str]:
    """Fields of a record that are explained by a comment beside them."""
    text = inspect.getsource(cls) if _is_written(cls) else ""
    fields = re.findall(r"^    (\w+): [^#\n]*  # (?!pyright)(.+)$", text, re.M)
    escaped = [(name, re.sub(r"([|*_])", r"\\\1", words)) for name, words in fields]
    return ["", *(f"- ``{name}``: {words}" for name, words in escaped), ""]


def _is_written(value: Any) -> bool:
    """Whether a class or function stands in the source: one that is made from a
    registry, as `Limits`, does not."""
    try:
        return bool(inspect.getsource(value))
    except (OSError, TypeError):
        return False


def _docstring(
    app: Sphinx, what: str, name: str, value: Any, options: Any, lines: list[str]
) -> None:
    text = _FORMULA.sub(r"\1\n\n::\n\n", "\n".join(lines))
    lines[:] = text.splitlines()
    if what == "class":
        lines += parameters(value) + remarks(value)
        if issubclass(value, enum.Enum):
            lines += [
                "",
                *(f"- ``{member.name}`` = {member.value}" for member in value),
                "",
            ]


def _signature(
    app: Sphinx,
    what: str,
    name: str,
    value: Any,
    options: Any,
    words: str | None,
    returns: str | None,
) -> tuple[str, str | None] | None:
    """Signatures of what no user calls are left out."""
    if not words or what not in ("class", "exception"):
        return None
    record = len(getattr(value, "__annotations__", {})) > _MANY and not parameters(
        value
    )
    abstract = inspect.isabstract(value) or value.__name__.startswith("Abstract")
    return (
        ("", None)
        if what == "exception" or record or abstract or issubclass(value, enum.Enum)
        else None
    )


def source_of(domain: str, info: dict[str, str]) -> str | None:
    """Address of the line of a function or class in the page of its source, for
    `sphinx.ext.linkcode`."""
    home, _, last = f"{info['module']}.{info['fullname']}".rpartition(".")
    value = inspect.unwrap(getattr(found(home), last, None)) if info["module"] else None
    value = getattr(value, "fget", value)
    if not isinstance(value, type | types.FunctionType) or not _is_written(value):
        return None
    file = pathlib.Path(inspect.getsourcefile(value) or "").relative_to(PACKAGE.parent)
    return f"../_modules/{file.with_suffix('.html').as_posix()}#L-{inspect.getsourcelines(value)[1]}"


def _complete(app: Sphinx, env: BuildEnvironment) -> None:
    """Every public name has its place."""
    homes = [getattr(simbrake, name) for name in simbrake.__all__]
    modules = [
        simbrake,
        *(home for home in homes if isinstance(home, types.ModuleType)),
    ]
    names = ((name, getattr(home, name)) for home in modules for name in home.__all__)
    public = {name for name, value in names if not isinstance(value, types.ModuleType)}
    missing = public - {
        name.rpartition(".")[2] for name in env.domains.python_domain.objects
    }
    if missing:
        _log.warning(
            "give these names a place in docs/api: %s", ", ".join(sorted(missing))
        )


def _arrays(app: Sphinx, doctree: nodes.document) -> None:
    """Types of arrays as they are in the source: `Float[Array, 'n']`, which is a union
    when it is evaluated."""
    for place in doctree.findall(lambda node: isinstance(node, _TYPED)):
        words = "\0".join(child.astext() for child in place.children)
        for match in reversed(list(_UNION.finditer(words))):
            first = words[: match.start("others")].count("\0") + 1
            del place[first : first + match["others"].count("\0")]
    for text in list(doctree.findall(nodes.Text)):
        if text == "jaxlib._jax.Array":
            text.parent.replace(text, nodes.Text("Array"))


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("reference", Reference)
    app.add_role("name", Name())
    app.connect("autodoc-process-docstring", _docstring)
    app.connect("autodoc-process-signature", _signature)
    app.connect("doctree-read", _arrays)
    app.connect("env-check-consistency", _complete)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
