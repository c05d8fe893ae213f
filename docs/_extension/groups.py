"""Page of the reference of each public name, by the module that defines it."""

import ast
import functools
import pathlib
import types

import simbrake

#: page (a file in `docs/api`) → modules, in the order in which their names are shown
PAGES: dict[str, tuple[str, ...]] = {
    "run": (
        "_parts._scene",
        "_run._simulate",
        "_base._faults",
        "_base._quantity",
        "_run._edit",
        "files._scene_file",
        "_parts._programme",
        "checks",
    ),
    "brake": ("brakes._design", "brakes._pressed"),
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
        "_run._duty",
        "_physics._mechanism",
        "results._dataset",
        "results._compare",
        "results._explain",
        "_pages._page",
        "_base._table",
    ),
    "statics": ("brakes._band",),
    "wear": ("wear", "studies._lining_life", "_run._travel"),
    "layouts": ("_run._linings", "_run._probe", "layouts"),
    "studies": ("studies",),
    "estimates": ("formulas", "published"),
    "integrator": ("hybrid",),
}


PACKAGE = pathlib.Path(simbrake.__file__).parent


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


@functools.cache
def path_of(name: str) -> str:
    """Package from which a public name is imported: `simbrake` or a subpackage."""
    if name in simbrake.__all__:
        return "simbrake"
    homes = [home for home in simbrake.__all__ if isinstance(getattr(simbrake, home), types.ModuleType)]
    return next(f"simbrake.{home}" for home in homes if name in getattr(getattr(simbrake, home), "__all__", ()))


def _imported(file: pathlib.Path) -> dict[str, str]:
    """Names that a file imports from modules of its own package or the one above, with these modules."""
    nodes = [n for n in ast.parse(file.read_text("utf-8")).body if isinstance(n, ast.ImportFrom) and n.level]
    return {alias.asname or alias.name: node.module or "" for node in nodes for alias in node.names}


def _listed(file: pathlib.Path) -> list[str]:
    """The `__all__` of a module."""
    assigned = [n for n in ast.parse(file.read_text("utf-8")).body if isinstance(n, ast.Assign)]
    return next(ast.literal_eval(n.value) for n in assigned if getattr(n.targets[0], "id", "") == "__all__")


def names_on(page: str) -> list[str]:
    """Public names of one page, by module and in the order of their definition."""
    names = public_names()
    mine = [name for name in names if page_of(name) == page]
    order = list(dict.fromkeys(module for prefix in PAGES[page] for module in names.values() if _below(module, prefix)))
    return [name for module in order for name in _in_order(module, [one for one in mine if names[one] == module])]


def _below(module: str, prefix: str) -> bool:
    return module == prefix or module.startswith(f"{prefix}.")


def _in_order(module: str, mine: list[str]) -> list[str]:
    file = PACKAGE.joinpath(*module.split(".")).with_suffix(".py")
    if not file.is_file():
        return mine
    words = [getattr(node, "name", "") for node in ast.parse(file.read_text("utf-8")).body]
    return sorted(mine, key=lambda name: words.index(name) if name in words else -1)


def page_of(name: str) -> str | None:
    """The page of a public name, `None` if it has none: that with the longest prefix of its module."""
    module = public_names()[name]
    found = [(prefix, page) for page, prefixes in PAGES.items() for prefix in prefixes if _below(module, prefix)]
    return max(found, key=lambda one: len(one[0]))[1] if found else None
