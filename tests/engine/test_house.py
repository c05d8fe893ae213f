"""The house: layers, the public list, what a scene pays for, errors, and no
re-tracing."""

import ast
import functools
import pathlib
import platform
import re
import shutil
import types

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from commands import python
from helpers import near, nothing_compiled
from scenes import closed_form, stop_run, stop_scene

import simbrake as sb

PACKAGE = pathlib.Path(sb.__file__).parent


def acyclic(arrows):
    """Whether some order of the names lets every arrow point backwards: names without
    arrows are taken away."""
    left = {name: set(targets) - {name} for name, targets in arrows.items()}
    while left:
        free = [name for name, targets in left.items() if not targets & left.keys()]
        if not free:
            return sorted(left)
        for name in free:
            del left[name]
    return []


#: packages above the core, each above the ones before
WINGS = ("studies", "plot", "checks", "design", "rig", "export", "pages", "cli")
#: files at the top by their place: all lazy names, and the start of the command
TOP = {"__init__.py": len(WINGS) + 1, "__main__.py": len(WINGS)}


def height(parts):
    """0 in the core, from 1 in the wings, for a path inside the package."""
    if parts[0] in TOP:
        return TOP[parts[0]]
    return WINGS.index(parts[0]) + 1 if parts[0] in WINGS else 0


@functools.cache
def listed(package):
    """Names that the `__init__` of a package gives to all."""
    folder = PACKAGE.joinpath(*package)
    stub = folder / "__init__.pyi"
    file = stub if stub.is_file() else folder / "__init__.py"
    nodes = ast.walk(ast.parse(file.read_text("utf-8")))
    return {
        alias.name
        for node in nodes
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }


def taken(file):
    """(module, name) of everything that a file imports from the package."""
    here = file.relative_to(PACKAGE).parts[:-1]
    for node in ast.walk(ast.parse(file.read_text("utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level:
            home = here[: len(here) - node.level + 1]
            home = (*home, *node.module.split(".")) if node.module else home
            for alias in node.names:
                inside = (*home, alias.name)
                path = PACKAGE.joinpath(*inside)
                is_module = path.with_suffix(".py").is_file() or path.is_dir()
                yield (inside, None) if is_module else (home, alias.name)


def test_wings_use_public_names_of_what_is_below():
    """No arrow from the core to a wing, none from a wing to a higher one; a wing takes
    what has a public name: a module without underscore, or a name that the `__init__`
    of its package lists. `_base` is for all."""
    wrong = []
    for file in PACKAGE.rglob("*.py"):
        path = file.relative_to(PACKAGE)
        for home, name in taken(file):
            if not home or home[0] == "_base":
                continue
            arrow = f"{path} -> {'.'.join(home)} {name or ''}"
            if height(home) > height(path.parts):
                wrong.append(f"{arrow}: upwards")
            if path.parts[0] not in WINGS or home[0] == path.parts[0]:
                continue
            private = any(part.startswith("_") for part in (*home, name or ""))
            if private and not (name and name[0] != "_" and name in listed(home[:-1])):
                wrong.append(f"{arrow}: private")
    assert wrong == []


RUN = """
import importlib, pkgutil, simbrake as sb
for found in pkgutil.walk_packages(sb.__path__, "simbrake."):
    if found.name.split(".")[1] not in {above}:
        importlib.import_module(found.name)
print(sb.simulate(sb.read_scene("standard")).status)
"""


@pytest.mark.parametrize("wing", [*WINGS, "all"])
@pytest.mark.slow
def test_without_a_wing_the_rest_imports_and_runs(wing, tmp_path, monkeypatch):
    gone = WINGS if wing == "all" else (wing,)
    without = shutil.ignore_patterns("__pycache__")
    shutil.copytree(PACKAGE, tmp_path / "simbrake", ignore=without)
    for name in gone:
        shutil.rmtree(tmp_path / "simbrake" / name)
    above = (*WINGS[WINGS.index(gone[0]) :], "__main__")
    monkeypatch.chdir(tmp_path)  # before the package of this checkout
    found = python(RUN.format(above=above), PYTHONPATH=str(tmp_path))
    assert found.stdout.strip() == "stopped"


def test_imports_point_one_way():
    """No circle among the modules, and none among the folders: there is an order from
    the lowest to the highest."""
    files = [
        file
        for file in PACKAGE.rglob("*.py")
        if file.parent != PACKAGE or not file.stem.startswith("_")
    ]
    modules = {
        ".".join(file.relative_to(PACKAGE).with_suffix("").parts): {
            ".".join(
                home
                if PACKAGE.joinpath(*home).with_suffix(".py").is_file()
                else (*home, "__init__")
            )
            for home, _ in taken(file)
        }
        for file in files
    }
    modules = {name: found & modules.keys() for name, found in modules.items()}
    assert acyclic(modules) == []
    folders = {}
    for name, found in modules.items():
        folder = folders.setdefault(name.split(".")[0], set())
        folder |= {used.split(".")[0] for used in found}
    assert acyclic(folders) == []
    assert folders["hybrid"] == {"hybrid"}


def test_integrator_knows_nothing_of_brakes():
    for file in (PACKAGE / "hybrid").glob("*.py"):
        text = file.read_text("utf-8").lower()
        assert not re.search(
            r"\b(brakes?|linings?|pulleys?|tensions?|bands?|friction|slip)\b", text
        ), file.name
        tree = ast.parse(file.read_text("utf-8"))
        assert not [
            n for n in ast.walk(tree) if isinstance(n, ast.ImportFrom) and n.level > 1
        ]


def test_no_private_parts_of_jax_are_used():
    """No private module, no program of JAX taken apart, no flag of the process;
    `equinox.internal` in one file."""
    inside = re.compile(
        r"jax\._src|jax\.(interpreters|extend)|make_jaxpr|\.eqns\b|\bXLA_FLAGS\b.*\]\s*=|_p\.bind"
    )
    sources = {path: path.read_text("utf-8") for path in PACKAGE.rglob("*.py")}
    assert not {path.name for path, text in sources.items() if inside.search(text)}
    assert [
        path.name for path, text in sources.items() if "equinox.internal" in text
    ] == ["_loop.py"]


def test_importing_loads_only_what_runs_use():
    """Pictures, tables, units, reports, SciPy and what traces programs are loaded by
    those who use them."""
    heavy = (
        "matplotlib",
        "scipy",
        "xarray",
        "pandas",
        "pint",
        "jinja2",
        "pyarrow",
        "cyclopts",
        "equinox",
    )
    names = ("studies", "checks", "design", "rig", "export", "pages", "cli")
    unused = tuple(f"simbrake.{name}" for name in names)
    program = "import sys, simbrake as sb; sb.Scene, sb.Brake, sb.simulate; print("
    program += f"[name for name in {heavy + unused} if name in sys.modules])"
    found = python(program)
    assert found.stdout.strip() == "[]"


@pytest.mark.slow
def test_a_fresh_process_reads_every_template():
    """Kinds of a part are found among the classes that are loaded: whoever reads a file
    has loaded them all."""
    program = (
        "import simbrake as sb; from simbrake.files.shipped_scenes import TEMPLATES; "
    )
    program += "print([sb.read_scene(name).end_time is not None for name in TEMPLATES])"
    found = python(program)
    assert "False" not in found.stdout


def test_help_and_version_do_not_need_jax():
    program = (
        "import sys; from simbrake.__main__ import main\nsys.argv = ['simbrake', "
        "sys.argv[1]]\n"
    )
    program += (
        "try:\n    main()\nfinally:\n    print(sorted({'jax', 'numpy', 'scipy'} "
        "& set(sys.modules)))"
    )
    for option in ("--help", "--version"):
        found = python(program, option)
        assert found.stdout.splitlines()[-1] == "[]", option
    assert f"jax {jax.__version__}" in found.stdout
    assert f"Python {platform.python_version()}" in found.stdout


def test_public_names():
    """Every class is explained, and a name says where it is."""
    homes = [
        getattr(sb, name)
        for name in sb.__all__
        if isinstance(getattr(sb, name), types.ModuleType)
    ]
    found = [
        getattr(home, name)
        for home in (sb, *homes)
        for name in getattr(home, "__all__", ())
    ]
    classes = {one for one in found if isinstance(one, type)}
    assert not [one.__name__ for one in classes if not one.__doc__]
    with pytest.raises(
        AttributeError, match=r"'Convection': it is simbrake\.thermal\.Convection"
    ):
        _ = sb.Convection
    with pytest.raises(AttributeError, match=r"'Convektion'$"):
        _ = sb.Convektion


@pytest.mark.slow
def test_a_thousand_values_do_not_re_trace(caplog):
    float(stop_run(T0=5e3).stopping_time)
    rng = np.random.default_rng(1)
    with nothing_compiled(caplog):
        for i in range(1000):
            T0 = 8e3 * rng.uniform(0.8, 1.2)
            f = rng.uniform(0.2, 0.4)
            w0 = rng.uniform(5, 30)
            result = stop_run(T0=T0, f=f, w0=w0, end=20.0)
            if i % 100 == 0:
                truth = closed_form(T0=T0, f=f, w0=w0)["stop"]
                near(result.stopping_time, truth, 1e-10)


def test_absent_physics_has_no_states():
    elastic, rigid = (stop_run(C=C).record.y_end for C in (2e5, None))
    assert len(jax.tree.leaves(elastic)) == 6
    assert len(jax.tree.leaves(rigid)) == 5


def test_failure_raises_or_returns_its_code():
    with pytest.raises(sb.SimulationError, match="step_limit") as caught:
        sb.simulate(stop_scene(), max_steps=8)
    assert float(caught.value.result.record.t_end) < 5.0
    result = sb.simulate(stop_scene(), max_steps=8, throw=False)
    assert result.status == "step_limit"
    assert "max_steps" in result.message


def test_32_bits_are_refused_clearly():
    with jax.enable_x64(False), pytest.raises(RuntimeError, match="jax_enable_x64"):
        stop_run()


BITS = """
import os, sys
before, finders = dict(os.environ), len(sys.meta_path)
import {}
{}
assert "jax" in sys.modules
print(jax.numpy.ones(1).dtype, dict(os.environ) == before, len(sys.meta_path) - finders)
"""


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("simbrake", "assert 'jax' not in sys.modules; import jax"),
        ("jax", "import simbrake"),
        ("simbrake", "simbrake.Scene; import jax"),
    ],
)
def test_scripts_need_not_set_64_bits(first, second, monkeypatch):
    """Whichever is imported first; neither the environment nor the finders of imports
    are left changed."""
    program = BITS.format(first, second)
    monkeypatch.delenv("JAX_ENABLE_X64", raising=False)
    assert python(program).stdout.split() == ["float64", "True", "0"]
    if first == "jax":  # the user's word counts, until a run is asked for
        off = python(program, JAX_ENABLE_X64="0")
        assert off.stdout.split() == ["float32", "True", "0"]


@pytest.mark.slow
def test_a_result_passes_through_jit():
    run = jax.jit(lambda scene: sb.simulate(scene, max_steps=128))
    whole = run(jax.tree.map(jnp.asarray, stop_scene()))
    assert whole.status == "stopped"
    near(whole.stopping_time, closed_form()["stop"], 1e-10)
    assert len(whole.events) == 23
