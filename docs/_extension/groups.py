"""Which page of the reference a public name stands on: by the module that defines it."""

import ast
import pathlib

import simbrake

#: page (a file in `docs/api`) → modules, in the order in which their names are shown
PAGES: dict[str, tuple[str, ...]] = {
    "run": (
        "_parts._scene",
        "_run._simulate",
        "_run._outcome",
        "_base._faults",
        "_base._quantity",
        "_run._edit",
        "files._scene_file",
        "_parts._programme",
        "checks",
    ),
    "brake": ("brakes._design", "brakes._pressed"),
    "duty": ("profiles", "loads", "files._history"),
    "friction": ("friction",),
    "heat": ("thermal", "_run._networks"),
    "results": (
        "_run._result",
        "_run._series",
        "_run._log",
        "_physics._mechanism",
        "results._dataset",
        "results._provenance",
        "results._compare",
        "results._rerun",
        "_pages._page",
    ),
    "statics": ("brakes._band", "_parts._layout"),
    "wear": ("wear", "studies._lining_life"),
    "layouts": ("_run._linings", "_run._probe", "layouts"),
    "studies": ("studies",),
    "estimates": ("formulas", "published"),
    "speed": ("_run._prepare",),
    "integrator": ("hybrid",),
}


def public_names() -> dict[str, str]:
    """Public names of simbrake, with the module that `simbrake/__init__.pyi` takes each from."""
    tree = ast.parse(pathlib.Path(simbrake.__file__).with_suffix(".pyi").read_text("utf-8"))
    found = {}
    for node in tree.body:
        if isinstance(node, ast.ImportFrom) and node.level == 1 and node.module:
            for alias in node.names:
                found[alias.asname or alias.name] = node.module
    return {name: module for name, module in found.items() if not name.startswith("_")}


def names_on(page: str) -> list[str]:
    """Public names of one page, by module and in the order of their definition."""
    names = public_names()
    mine = [name for name in names if page_of(name) == page]
    order = list(dict.fromkeys(module for prefix in PAGES[page] for module in names.values() if _below(module, prefix)))
    return [name for module in order for name in _in_order(module, [one for one in mine if names[one] == module])]


def _below(module: str, prefix: str) -> bool:
    return module == prefix or module.startswith(f"{prefix}.")


def _in_order(module: str, mine: list[str]) -> list[str]:
    file = pathlib.Path(simbrake.__file__).parent.joinpath(*module.split(".")).with_suffix(".py")
    if not file.is_file():
        return mine
    words = [getattr(node, "name", "") for node in ast.parse(file.read_text("utf-8")).body]
    return sorted(mine, key=lambda name: words.index(name) if name in words else -1)


def page_of(name: str) -> str | None:
    """The page on which a public name stands, `None` if it has none: that with the longest prefix of its module."""
    module = public_names()[name]
    found = [(prefix, page) for page, prefixes in PAGES.items() for prefix in prefixes if _below(module, prefix)]
    return max(found, key=lambda one: len(one[0]))[1] if found else None
