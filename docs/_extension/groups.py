"""Which page of the reference a public name stands on: by the module that defines it."""

import ast
import pathlib

import simbrake

#: page (a file in `docs/api`) → modules, in the order in which their names are shown
PAGES: dict[str, tuple[str, ...]] = {
    "run": (
        "_scene",
        "_simulate",
        "_outcome",
        "_faults",
        "_quantity",
        "_edit",
        "_schema",
        "_scene_file",
        "_programme",
        "_validation",
        "_validate",
        "_cross_check",
    ),
    "brake": ("_design", "_compliance", "_pressed"),
    "duty": ("_duty", "_driller", "_lever", "_loads", "_history"),
    "friction": ("_friction", "_fade"),
    "heat": ("_heat", "_network", "_links", "_material", "_exchange", "_builders", "_conduction", "_cyclic"),
    "results": (
        "_result",
        "_series",
        "_log",
        "_event_names",
        "_modes",
        "_stages",
        "_overlap",
        "_labelled",
        "_result_file",
        "_provenance",
        "_compare",
        "_comparison",
        "_rerun",
        "_html_report",
        "_animate",
    ),
    "statics": ("_band", "_layout"),
    "wear": ("_wear", "_worn", "_lining_life"),
    "layouts": (
        "_rubbing",
        "_integral",
        "_equal_layout",
        "_least_tension",
    ),
    "studies": (
        "_sensitivity",
        "_ensemble",
        "_uncertainty",
        "_global",
        "_sampling",
        "_calibration",
        "_measured",
    ),
    "estimates": (
        "_engineering",
        "_estimate_data",
        "_estimate_report",
        "_compare_materials",
        "_material_table",
        "_material_data",
        "_classical_stop",
        "_classical_staged",
        "_power_shares",
        "_triboelectric",
        "_thermal_estimates",
        "_contact_estimates",
        "_equivalents",
        "_heat_balance",
        "_schmidt",
        "_thermal_stress",
        "_synthesis",
        "_synthesis_report",
        "_synthesis_chain",
        "_property_iteration",
        "_rational_thickness",
    ),
    "speed": ("_prepare", "_compiling"),
    "integrator": ("_hybrid",),
}


def public_names() -> dict[str, str]:
    """Public names of simbrake, with the module that `simbrake/__init__.pyi` takes each from."""
    tree = ast.parse(pathlib.Path(simbrake.__file__).with_suffix(".pyi").read_text("utf-8"))
    found = {}
    for node in tree.body:
        if isinstance(node, ast.ImportFrom) and node.level == 1 and node.module:
            for alias in node.names:
                found[alias.asname or alias.name] = node.module.split(".")[-1]
    return {name: module for name, module in found.items() if not name.startswith("_")}


def names_on(page: str) -> list[str]:
    """Public names of one page, by module and in the order of their definition."""
    names = public_names()
    return [name for module in PAGES[page] for name in _in_order(module, names)]


def _in_order(module: str, names: dict[str, str]) -> list[str]:
    mine = [name for name, where in names.items() if where == module]
    file = next(pathlib.Path(simbrake.__file__).parent.glob(f"*/{module}.py"), None)
    if file is None:
        return mine
    words = [getattr(node, "name", "") for node in ast.parse(file.read_text("utf-8")).body]
    return sorted(mine, key=lambda name: words.index(name) if name in words else -1)


def page_of(name: str) -> str | None:
    """The page on which a public name stands, `None` if it has none."""
    module = public_names().get(name)
    return next((page for page, modules in PAGES.items() if module in modules), None)
