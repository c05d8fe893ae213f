"""The scenarios that ship, by their names."""

import importlib.util
import pathlib

FOLDER = pathlib.Path(__file__).parents[1] / "scenarios"
#: those that make a scene; the others are studies
NAMES = sorted(
    file.stem for file in FOLDER.glob("*.py") if "def scene(" in file.read_text("utf-8")
)


def load(name):
    spec = importlib.util.spec_from_file_location(name, FOLDER / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
