"""The reference from the docstrings: directive `public-names`, one page at a time.

Docstrings of simbrake are Markdown (names in backticks, formulas in indented blocks, lists), so they are parsed as
such: the directive writes Markdown with objects of Sphinx's Python domain around them. Signatures come from the source,
as they were written there.
"""

import ast
import dataclasses
import enum
import functools
import importlib
import inspect
import pathlib
import re
import types
from typing import Any

import groups
from docutils import nodes
from docutils.statemachine import StringList
from source_pages import PACKAGE, _parsed
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

_FENCE = "`````"
_MANY = 12
#: descriptions of the values of the package whose names are not self-explanatory
CONSTANTS = {
    "FAILURES": "Failure codes of a run: number → name, meaning, remedy. See [](../events_and_modes.md).",
    "EVENTS": "Names of the events in the log: name → meaning, which brakes. See [](../events_and_modes.md).",
    "GRAVITY": "Standard gravity, m/s².",
    "ROOM": "Reference temperature `T_r` of materials, K.",
    "STEFAN_BOLTZMANN": "Constant `σ` of Stefan and Boltzmann, W/(m²·K⁴).",
    "LIBRARY": "Thermal numbers by material, each with its value, range in use, source, and whether it is assumed.",
}


def definition(value: Any) -> Any:
    """The node of a class or function in its source."""
    file = inspect.getsourcefile(value)
    assert file is not None
    return functools.reduce(
        lambda node, part: next(x for x in node.body if getattr(x, "name", None) == part),
        value.__qualname__.split("."),
        _parsed(pathlib.Path(file)),
    )


def _annotation(node: ast.expr | None) -> str:
    words = "" if node is None else ast.unparse(node)
    words = re.sub(r"collections\.abc\.|jaxtyping\.", "", words)
    return "" if words in ("Any", "Scalar", "Any | None", "Scalar | None") else words


def arguments(node: ast.FunctionDef, method: bool) -> str:
    """The signature of a function as written, without uninformative annotations."""
    a = node.args
    plain = [*a.posonlyargs, *a.args][1 if method else 0 :]
    defaults = [None] * (len(plain) - len(a.defaults)) + list(a.defaults[-len(plain) :] if plain else [])
    parts = [_argument(x, d) for x, d in zip(plain, defaults, strict=True)]
    if a.vararg:
        parts.append(f"*{_argument(a.vararg, None)}")
    elif a.kwonlyargs:
        parts.append("*")
    parts += [_argument(x, d) for x, d in zip(a.kwonlyargs, a.kw_defaults, strict=True)]
    if a.kwarg:
        parts.append(f"**{_argument(a.kwarg, None)}")
    returns = _annotation(node.returns)
    return f"({', '.join(parts)})" + (f" -> {returns}" if returns and returns != "None" else "")


def _argument(node: ast.arg, default: ast.expr | None) -> str:
    kind = _annotation(node.annotation)
    text = f"{node.arg}: {kind}" if kind else node.arg
    return text if default is None else f"{text}={ast.unparse(default)}"


def _own_init(cls: type) -> ast.FunctionDef | None:
    for base in cls.__mro__:
        if base.__module__.startswith("simbrake"):
            init = next((x for x in definition(base).body if getattr(x, "name", "") == "__init__"), None)
            if init is not None:
                return init
    return None


def class_arguments(cls: type) -> str:
    """The arguments that make an object of a class; its fields where it has no `__init__` of its own."""
    if issubclass(cls, enum.Enum) or inspect.isabstract(cls) or cls.__name__.startswith("Abstract"):
        return ""
    init = _own_init(cls)
    if init is not None:
        return arguments(init, method=True)
    parts = []
    for parameter in inspect.signature(cls).parameters.values():
        kind = _annotation(_field_node(cls, parameter.name))
        text = f"{parameter.name}: {kind}" if kind else parameter.name
        if parameter.default is not parameter.empty:
            default = parameter.default
            text += f"={default!r}" if default is None or isinstance(default, bool | int | float | str) else "=..."
        parts.append(text)
    # results of functions are not made by users: their fields are listed below
    given_back = len(parts) > _MANY and not _quantities(cls)
    return f"({', '.join(parts)})" if parts and not given_back else ""


def _field_node(cls: type, name: str) -> ast.expr | None:
    for base in cls.__mro__:
        if base.__module__.startswith("simbrake"):
            for node in definition(base).body:
                if isinstance(node, ast.AnnAssign) and getattr(node.target, "id", None) == name:
                    return node.annotation
    return None


def _remarks(cls: type) -> list[str]:
    """Fields of a record that are explained by a comment beside them."""
    file = pathlib.Path(inspect.getsourcefile(cls) or "")
    lines, found = file.read_text("utf-8").splitlines(), []
    for node in definition(cls).body:
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and node.end_lineno:
            _, comment, words = lines[node.end_lineno - 1].rpartition("  # ")
            if comment and not words.startswith("pyright"):
                found.append(f"- `{node.target.id}`: {_escaped(words)}")
    return found


def _escaped(words: str) -> str:
    return words.replace("_", "\\_").replace("*", "\\*")


def _quantities(cls: type) -> list[str]:
    """Table of the numbers of a scene's part, with unit and range."""
    rows = []
    for field in dataclasses.fields(cls) if dataclasses.is_dataclass(cls) else ():
        about = field.metadata.get("quantity")
        if about is not None:
            given = "required" if field.default is dataclasses.MISSING else f"`{field.default!r}`"
            unit = about.unit.replace("*", "·")
            rows.append(f"| `{field.name}` | {about.meaning} | {unit} | {about.range} | {given} |")
    return ["| number | meaning | unit | range | default |", "|---|---|---|---|---|", *rows] if rows else []


def linked(text: str, but: str) -> str:
    """Public names in backticks become links, except in formulas and for the object itself."""
    known = groups.public_names()

    def link(match: re.Match[str]) -> str:
        name = match[1].removesuffix("()")
        plain = name.islower() and "_" not in name and name not in ("simulate", "ensemble", "prepare", "sensitivity")
        return (
            match[0]
            if name not in known or name == but or plain
            else f"{{py:obj}}`{name} <{groups.path_of(name)}.{name}>`"
        )

    lines = text.splitlines()
    return "\n".join(
        line if line.startswith("    ") else re.sub(r"`([A-Za-z_]+(?:\(\))?)`", link, line) for line in lines
    )


def described(value: Any, name: str) -> list[str]:
    text = inspect.cleandoc(value.__doc__ or "")
    return linked(text, name).splitlines()


def _members(cls: type) -> list[str]:
    """Public methods and properties that a class itself defines and explains."""
    lines: list[str] = []
    for node in definition(cls).body:
        if not isinstance(node, ast.FunctionDef) or node.name.startswith("_") or not ast.get_docstring(node):
            continue
        marks = [ast.unparse(x) for x in node.decorator_list]
        words = linked(ast.get_docstring(node) or "", cls.__name__).splitlines()
        if "property" in marks:
            kind = _annotation(node.returns)
            lines += [f"````{{py:property}} {node.name}", *([f":type: {kind}", ""] if kind else [""])]
        else:
            lines.append(f"````{{py:method}} {node.name}{arguments(node, method='staticmethod' not in marks)}")
            options = {
                "staticmethod": "staticmethod",
                "classmethod": "classmethod",
                "abc.abstractmethod": "abstractmethod",
            }
            lines += [*(f":{option}:" for mark, option in options.items() if mark in marks), ""]
        lines += [*words, "````", ""]
    return lines


def _source(value: Any) -> str:
    file = pathlib.Path(inspect.getsourcefile(value) or "").relative_to(PACKAGE).with_suffix("")
    parts = [part for part in file.parts if part != "__init__"]
    return f"Source: {{source}}`{'.'.join([*parts, value.__qualname__])}`"


def entry(name: str, value: Any, prefix: str = "simbrake") -> list[str]:
    """Markdown of one public name."""
    full = f"{prefix}.{name}"
    if isinstance(value, types.FunctionType) or (hasattr(value, "__wrapped__") and not isinstance(value, type)):
        bare = inspect.unwrap(value)
        head = [f"{_FENCE}{{py:function}} {full}{arguments(definition(bare), method=False)}", ""]
        return [*head, *described(bare, name), "", _source(bare), _FENCE, ""]
    if isinstance(value, type):
        kind = "py:exception" if issubclass(value, Exception) else "py:class"
        signature = "" if issubclass(value, Exception) else class_arguments(value)
        lines = [f"{_FENCE}{{{kind}}} {full}{signature}", "", *described(value, name), ""]
        if issubclass(value, enum.Enum):
            lines += [f"- `{member.name}` = {member.value}" for member in value]
        lines += [*_quantities(value), "", *_remarks(value), "", *_members(value), "", _source(value), _FENCE, ""]
        return lines
    shown = [f":value: {value!r}"] if isinstance(value, float) else []
    return [f"{_FENCE}{{py:data}} {full}", *shown, "", CONSTANTS.get(name) or _comment(name), _FENCE, ""]


def _comment(name: str) -> str:
    """The `#:` comment above a constant where it is defined."""
    file = PACKAGE / f"{groups.public_names()[name]}.py"
    found = re.search(rf"((?:^#: .*\n)+){name}\b", file.read_text("utf-8"), re.M) if file.is_file() else None
    return " ".join(line[3:] for line in found[1].splitlines()) if found else ""


def _value(name: str) -> Any:
    return getattr(importlib.import_module(groups.path_of(name)), name)


class PublicNames(SphinxDirective):
    """All public names of a page of the reference, or the functions of `simbrake.plot`."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        page = self.arguments[0]
        if page == "pictures":
            import simbrake.plot as plot

            names = [n for n, v in vars(plot).items() if isinstance(v, types.FunctionType) and not n.startswith("_")]
            found = [(name, getattr(plot, name), "simbrake.plot") for name in sorted(names)]
        else:
            found = [(name, _value(name), groups.path_of(name)) for name in groups.names_on(page)]
        for _, value, _ in found:
            if isinstance(value, type | types.FunctionType):
                self.env.note_dependency(inspect.getsourcefile(value) or "")
        lines = [line for each in found for line in entry(*each)]
        holder = nodes.container()
        self.state.nested_parse(StringList(lines, source=f"reference of {page}"), self.content_offset, holder)
        return holder.children


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("public-names", PublicNames)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
