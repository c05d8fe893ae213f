"""What the pages take from the code, filled in when they are built.

A line `<!-- reference PAGE -->` becomes the public names of a page of the reference (heading, signature, docstring,
parameters with units, members, source), `<!-- table NAME -->` a table of `TABLES`, `<!-- list NAME -->` a list of
`LISTS`, `<!-- measured NAME -->` what a benchmark has written as JSON, `<!-- printed NAME -->` a table of the papers.
Docstrings are Markdown, and taken as they are.
"""

import ast
import dataclasses
import enum
import functools
import importlib
import inspect
import json
import pathlib
import re
import sys
import types
from collections.abc import Callable, Iterator
from typing import Any

from sphinx.application import Sphinx
from sphinx.util import logging

import simbrake
from simbrake._physics import _mechanism
from simbrake._run import _log as names
from simbrake._run._metrics import METRICS
from simbrake._run._series import PAIR_COLUMNS, SERIES_COLUMNS

_log = logging.getLogger(__name__)

DOCS = pathlib.Path(__file__).parents[1]
sys.path[:0] = [str(DOCS.parent), str(DOCS.parent / "papers")]  # benchmarks, and what recomputes the papers
PACKAGE = pathlib.Path(simbrake.__file__).parent

#: page (a file in `docs/api`) → modules, in the order in which their names are shown
PAGES: dict[str, tuple[str, ...]] = {
    "run": (
        "_parts._scene",
        "_run._simulate",
        "_run._stepper",
        "_base._faults",
        "_base._part",
        "_base._quantity",
        "_run._edit",
        "files._scene_file",
        "files._fmu",
        "files._shipped",
        "_parts._programme",
        "checks",
    ),
    "brake": ("brakes._design", "brakes._bands", "brakes._pressed"),
    "duty": ("profiles", "loads", "files._schema"),
    "friction": ("friction",),
    "heat": ("thermal", "_run._networks"),
    "results": (
        "_run._result",
        "_run._series",
        "_run._log",
        "_run._metrics",
        "_run._measure",
        "_run._verdict",
        "_run._accuracy",
        "_run._errors",
        "_run._duty",
        "_physics._mechanism",
        "results._dataset",
        "results._compare",
        "results._explain",
        "_pages._page",
        "_base._table",
    ),
    "pictures": ("plot",),
    "statics": ("brakes._band",),
    "wear": ("wear", "studies._lining_life", "_run._travel"),
    "layouts": ("_run._linings", "_run._probe", "layouts"),
    "studies": ("studies",),
    "estimates": ("formulas",),
    "integrator": ("hybrid",),
}
_LETTERS = "Z, V, S, K and `model §` refer to the [sources of the theory manual](../theory/index.md#sources)."
_CODES = "[events, modes, codes](../events_and_modes.md)"
#: descriptions of the values of the package whose names are not self-explanatory
CONSTANTS = {
    "FAILURES": f"Failure codes of a run: number → name, meaning, remedy. See {_CODES}.",
    "EVENTS": f"Names of the events in the log: name → meaning, brakes. See {_CODES}.",
    "FRICTION": "Friction materials of linings: coefficient, permissible temperature, with ranges and sources.",
    "GRAVITY": "Standard gravity, m/s².",
    "ROOM": "Reference temperature `T_r` of materials, K.",
    "STEFAN_BOLTZMANN": "Stefan–Boltzmann constant `σ`, W/(m²·K⁴).",
    "LIBRARY": "Thermal properties by material, each with its value, range in use, source, and whether it is assumed.",
}
#: a result whose class has more fields than this is not made by users: its fields are listed below its signature
_MANY = 12
#: lines of a signature are broken beyond this length
_WIDTH = 100
#: between an argument and its default, without and with an annotation
_EQUALS = ("=", " = ")
#: opens a signature: coloured as Python, but no example (`tests/pages/test_examples.py` runs blocks of `python`)
_FENCE = "```py"
_KINDS = {
    "abc.abstractmethod": "abstract",
    "property": "property",
    "staticmethod": "static",
    "classmethod": "class method",
}
_POWERS = str.maketrans({"2": "²", "3": "³", "4": "⁴", "^": None})


# public names


@functools.cache
def public_names() -> dict[str, str]:
    """Public names of simbrake and its packages, with the module that defines each."""
    found = _imported(PACKAGE / "__init__.pyi")
    for stub in sorted(PACKAGE.glob("*/__init__.pyi")):
        home = stub.parent.name
        below = {name: f"{home}.{module}" for name, module in _imported(stub).items()}
        of_runs = _imported(stub.with_name("_of_runs.py")) if stub.with_name("_of_runs.py").is_file() else {}
        found = {**below, **{name: module for name, module in of_runs.items() if name in below}, **found}
    for home in ("friction", "profiles", "loads", "wear"):
        found = {**dict.fromkeys(_listed(PACKAGE / f"{home}.py"), home), **found}
    hybrid = _imported(PACKAGE / "hybrid" / "__init__.py")
    found |= {name: f"hybrid.{hybrid[name]}" for name in _listed(PACKAGE / "hybrid" / "__init__.py")}
    return {name: module for name, module in found.items() if not name.startswith("_") and module}


def _imported(file: pathlib.Path) -> dict[str, str]:
    """Names that a file imports from modules of its own package or the one above, with these modules."""
    nodes = [n for n in parsed(file).body if isinstance(n, ast.ImportFrom) and n.level]
    return {alias.asname or alias.name: node.module or "" for node in nodes for alias in node.names}


def _listed(file: pathlib.Path) -> list[str]:
    """The `__all__` of a module."""
    assigned = [n for n in parsed(file).body if isinstance(n, ast.Assign)]
    return next(ast.literal_eval(n.value) for n in assigned if getattr(n.targets[0], "id", "") == "__all__")


@functools.cache
def parsed(file: pathlib.Path) -> ast.Module:
    """Syntax tree of a module."""
    return ast.parse(file.read_text("utf-8"))


@functools.cache
def path_of(name: str) -> str:
    """Package from which a public name is imported: `simbrake` or a subpackage."""
    if name in simbrake.__all__:
        return "simbrake"
    homes = [home for home in simbrake.__all__ if isinstance(getattr(simbrake, home), types.ModuleType)]
    return next(f"simbrake.{home}" for home in homes if name in getattr(getattr(simbrake, home), "__all__", ()))


def names_on(page: str) -> list[str]:
    """Public names of one page, by module and in the order of their definition."""
    names = public_names()
    mine = [name for name in names if page_of(name) == page]
    order = list(dict.fromkeys(module for prefix in PAGES[page] for module in names.values() if _below(module, prefix)))
    return [name for module in order for name in _in_order(module, [one for one in mine if names[one] == module])]


@functools.cache
def page_of(name: str) -> str | None:
    """The page of a public name, `None` if it has none: that with the longest prefix of its module."""
    module = public_names()[name]
    found = [(prefix, page) for page, prefixes in PAGES.items() for prefix in prefixes if _below(module, prefix)]
    return max(found, key=lambda one: len(one[0]))[1] if found else None


def _below(module: str, prefix: str) -> bool:
    return module == prefix or module.startswith(f"{prefix}.")


def _in_order(module: str, mine: list[str]) -> list[str]:
    file = PACKAGE.joinpath(*module.split(".")).with_suffix(".py")
    if not file.is_file():
        return mine
    words = [getattr(node, "name", "") for node in parsed(file).body]
    return sorted(mine, key=lambda name: words.index(name) if name in words else -1)


def _plot_functions() -> dict[str, Any]:
    import simbrake.plot as plot

    return {n: v for n, v in sorted(vars(plot).items()) if isinstance(v, types.FunctionType) and not n.startswith("_")}


def entries(page: str) -> dict[str, Any]:
    """What a page of the reference describes: name as in `import simbrake as sb` → object."""
    found = {f"{path_of(n)}.{n}": getattr(importlib.import_module(path_of(n)), n) for n in names_on(page)}
    if page == "pictures":
        found |= {f"simbrake.plot.{name}": value for name, value in _plot_functions().items()}
    return {f"sb{full.removeprefix('simbrake')}": value for full, value in found.items()}


def anchor(heading: str) -> str:
    """The anchor that hosting sites and MyST give a heading."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


# signatures


def definition(value: Any) -> Any:
    """The node of a class or function in its source."""
    node: Any = parsed(_file(value))
    for part in value.__qualname__.split("."):
        node = next(x for x in node.body if getattr(x, "name", None) == part)
    return node


def _file(value: Any) -> pathlib.Path:
    return pathlib.Path(inspect.getsourcefile(value) or "")


def _annotation(node: ast.expr | None) -> str:
    words = "" if node is None else ast.unparse(node)
    words = re.sub(r"collections\.abc\.|jaxtyping\.", "", words)
    return "" if words in ("Any", "Scalar", "Any | None", "Scalar | None") else words


def _argument(node: ast.arg, default: ast.expr | None) -> str:
    kind = _annotation(node.annotation)
    text = f"{node.arg}: {kind}" if kind else node.arg
    return text if default is None else f"{text}{_EQUALS[bool(kind)]}{ast.unparse(default)}"


def arguments(node: ast.FunctionDef, method: bool) -> tuple[list[str], str]:
    """Arguments of a function as written, without uninformative annotations, and its type of result."""
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
    return parts, "" if returns == "None" else returns


def signature(name: str, parts: list[str], returns: str = "") -> str:
    """A call in one line, or one argument a line where that is too long."""
    end = f") -> {returns}" if returns else ")"
    line = f"{name}({', '.join(parts)}{end}"
    return line if len(line) <= _WIDTH else f"{name}(\n    " + ",\n    ".join(parts) + f",\n{end}"


def _own_init(cls: type) -> ast.FunctionDef | None:
    for base in cls.__mro__:
        if base.__module__.startswith("simbrake"):
            init = next((x for x in definition(base).body if getattr(x, "name", "") == "__init__"), None)
            if init is not None:
                return init
    return None


def class_arguments(cls: type) -> list[str]:
    """The arguments that make an object of a class; its fields where it has no `__init__` of its own."""
    if issubclass(cls, enum.Enum) or inspect.isabstract(cls) or cls.__name__.startswith("Abstract"):
        return []
    init = _own_init(cls)
    if init is not None:
        return arguments(init, method=True)[0]
    parts = []
    for parameter in inspect.signature(cls).parameters.values():
        kind = _annotation(_field_node(cls, parameter.name))
        text = f"{parameter.name}: {kind}" if kind else parameter.name
        if parameter.default is not parameter.empty:
            default = parameter.default
            plain = default is None or isinstance(default, bool | int | float | str)
            text += _EQUALS[bool(kind)] + (repr(default) if plain else "...")
        parts.append(text)
    return [] if len(parts) > _MANY and not _quantities(cls) else parts


def _field_node(cls: type, name: str) -> ast.expr | None:
    for base in cls.__mro__:
        if base.__module__.startswith("simbrake"):
            for node in definition(base).body:
                if isinstance(node, ast.AnnAssign) and getattr(node.target, "id", None) == name:
                    return node.annotation
    return None


# descriptions


def linked(text: str, page: str, but: str = "") -> str:
    """Public names in backticks become links, except in formulas and for the object itself."""
    known = public_names()

    def link(match: re.Match[str]) -> str:
        name = match[1].removesuffix("()")
        plain = name.islower() and "_" not in name and name not in ("simulate", "ensemble", "prepare", "sensitivity")
        home = None if plain or name == but or name not in known else page_of(name)
        if home is None:
            return match[0]
        to = anchor(f"sb{path_of(name).removeprefix('simbrake')}.{name}")
        return f"[{match[0]}]({'' if home == page else f'{home}.md'}#{to})"

    lines = text.splitlines()
    formula = re.compile(r"(?<!\[)`([A-Za-z_]+(?:\(\))?)`")
    return "\n".join(line if line.startswith("    ") else formula.sub(link, line) for line in lines)


def _quantities(cls: type) -> list[str]:
    """Table of the parameters of a scene's part, with unit and range."""
    rows = []
    for field in dataclasses.fields(cls) if dataclasses.is_dataclass(cls) else ():
        about = field.metadata.get("quantity")
        if about is not None:
            default = "required" if field.default is dataclasses.MISSING else f"`{field.default!r}`"
            rows.append((f"`{field.name}`", about.meaning, _unit(about.unit), about.range, default))
    return table("parameter | meaning | unit | range | default", rows) if rows else []


def _unit(words: str) -> str:
    return words.replace("*", "·").translate(_POWERS)


def _remarks(cls: type) -> list[str]:
    """Fields of a record that are explained by a comment beside them."""
    lines, found = _file(cls).read_text("utf-8").splitlines(), []
    for node in definition(cls).body:
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and node.end_lineno:
            _, comment, words = lines[node.end_lineno - 1].rpartition("  # ")
            if comment and not words.startswith("pyright"):
                words = words.replace("_", "\\_").replace("*", "\\*")
                found.append(f"- `{node.target.id}`: {words}")
    return found


def _members(cls: type, page: str) -> list[str]:
    """Public methods and properties that a class itself defines and explains."""
    lines: list[str] = []
    for node in definition(cls).body:
        if not isinstance(node, ast.FunctionDef) or node.name.startswith("_") or not ast.get_docstring(node):
            continue
        marks = [ast.unparse(x) for x in node.decorator_list]
        words = linked(ast.get_docstring(node) or "", page, cls.__name__).splitlines()
        parts, returns = arguments(node, method="staticmethod" not in marks)
        kinds = [word for mark, word in _KINDS.items() if mark in marks]
        kind = f" ({', '.join(kinds)})" if kinds else ""
        call = node.name if "property" in marks else f"{node.name}({', '.join(parts)})"
        gives = f" → `{returns}`" if returns else ""
        lines += [f"- **`{call}`**{gives}{kind}: {words[0]}", *(f"  {line}".rstrip() for line in words[1:])]
    return lines


def _source(value: Any) -> str:
    file = _file(value).relative_to(PACKAGE)
    parts = [part for part in file.with_suffix("").parts if part != "__init__"]
    return f"Source: [`{'.'.join([*parts, value.__qualname__])}`](../../simbrake/{file.as_posix()})"


def _comment(name: str) -> str:
    """The `#:` comment above a constant where it is defined."""
    file = PACKAGE.joinpath(*public_names()[name].split(".")).with_suffix(".py")
    found = re.search(rf"((?:^#: .*\n)+){name}\b", file.read_text("utf-8"), re.M) if file.is_file() else None
    return " ".join(line[3:] for line in found[1].splitlines()) if found else ""


def entry(full: str, value: Any, page: str) -> Iterator[list[str]]:
    """Paragraphs of Markdown for one public name."""
    name = full.rpartition(".")[2]
    yield [f"## `{full}`"]
    words = linked(inspect.cleandoc(value.__doc__ or ""), page, name).splitlines()
    if isinstance(value, type):
        exception, parts = issubclass(value, Exception), [] if issubclass(value, Exception) else class_arguments(value)
        kind = "exception" if exception else "class"
        yield [_FENCE, signature(f"{kind} {full}", parts) if parts else f"{kind} {full}", "```"]
        yield words
        if issubclass(value, enum.Enum):
            yield [f"- `{member.name}` = {member.value}" for member in value]
        yield _quantities(value)
        yield _remarks(value)
        yield _members(value, page)
        yield [_source(value)]
    elif isinstance(value, types.FunctionType) or hasattr(value, "__wrapped__"):
        bare = inspect.unwrap(value)
        yield [_FENCE, signature(full, *arguments(definition(bare), method=False)), "```"]
        yield words
        yield [_source(bare)]
    else:
        yield [_FENCE, f"{full} = {value!r}" if isinstance(value, float) else full, "```"]
        yield [CONSTANTS.get(name) or _comment(name)]


def reference(page: str) -> list[str]:
    """All public names of a page: a table of contents, then one section each."""
    found = entries(page)
    first = {full: _summary(full.rpartition(".")[2], value) for full, value in found.items()}
    rows = [
        (f"[`{full}`](#{anchor(full)})", linked(words, page, full.rpartition(".")[2])) for full, words in first.items()
    ]
    paragraphs = [[_LETTERS], table("name | meaning", rows)]
    paragraphs += [part for full, value in found.items() for part in entry(full, value, page) if part]
    return [line for part in paragraphs for line in ["", *part]][1:]


def _summary(name: str, value: Any) -> str:
    """First sentence of the description of a public name."""
    described = isinstance(value, type | types.FunctionType) or hasattr(value, "__wrapped__")
    text = inspect.cleandoc(value.__doc__ or "") if described else CONSTANTS.get(name) or _comment(name)
    return re.split(r"(?<=\.)\s(?=[A-Z`])|:\s*$", " ".join(text.split("\n\n")[0].splitlines()))[0]


# tables and lists


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
    return table("column | unit | meaning", [(f"`{n}`", _unit(about.unit), about.meaning) for n, about in of.items()])


def _metrics() -> list[str]:
    rows = [(f"`{n}`", _unit(about.unit), about.meaning, about.needs.scenes) for n, about in METRICS.items()]
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


def _names() -> list[str]:
    """Every public name, by page."""
    lines = []
    for page in PAGES:
        title = (DOCS / "api" / f"{page}.md").read_text("utf-8").partition("\n")[0].lstrip("# ")
        names = [f"[`{full.removeprefix('sb.')}`]({page}.md#{anchor(full)})" for full in entries(page)]
        lines.append(f"- **[{title}]({page}.md)**: {', '.join(names)}")
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


LISTS: dict[str, Callable[[], list[str]]] = {"notebooks": _notebooks, "names": _names, "hard_cases": _hard_cases}
BLOCKS: dict[str, Callable[[str], list[str]]] = {
    "reference": reference,
    "table": lambda name: TABLES[name](),
    "list": lambda name: LISTS[name](),
    "measured": _measured,
    "printed": _printed,
}
_MARK = re.compile(r"^<!-- (reference|table|list|measured|printed) (\w+) -->$", re.M)


def filled(text: str) -> str:
    """A page with what its marks stand for."""
    return _MARK.sub(lambda mark: "\n".join(BLOCKS[mark[1]](mark[2])), text)


def _read(app: Sphinx, page: str, source: list[str]) -> None:
    source[0] = filled(source[0])


def _complete(app: Sphinx) -> None:
    homeless = [f"{name} (module {module})" for name, module in public_names().items() if page_of(name) is None]
    if homeless:
        _log.warning("give their modules a page in PAGES of docs/_extension/from_code.py: %s", ", ".join(homeless))


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("builder-inited", _complete)
    # before the tables of contents, which are made of the lists
    app.connect("source-read", _read, priority=400)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
