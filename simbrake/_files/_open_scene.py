"""A scene from a file of either kind: TOML, or a Python file with a function `scene()`."""

import importlib.util
from pathlib import Path

from .._base._faults import Fault, InputError
from .._parts._scene import Scene
from ._scene_file import read_scene


def open_scene(file: str | Path) -> Scene:
    """The scene of a TOML file, or that which the function `scene()` of a Python file returns.

    Raises `InputError` with every fault of a TOML file, and with the error of a Python file in one line.
    """
    file = Path(file)
    if not file.is_file():
        folder = file.parent if file.parent.is_dir() else Path(".")
        there = sorted(str(f) for kind in ("*.toml", "*.py") for f in folder.glob(kind))
        if file.is_dir():
            there = sorted(str(f) for kind in ("*.toml", "*.py") for f in file.glob(kind))
        hint = f"there are: {', '.join(there[:8])}" if there else "give the path of a scene file"
        raise InputError([Fault(str(file), "is a folder" if file.is_dir() else "there is no such file", hint)])
    if file.suffix == ".toml":
        return read_scene(file)
    if file.suffix != ".py":
        hint = "a scene is a .toml file, or a .py file with a function scene()"
        raise InputError([Fault(str(file), "is neither TOML nor Python", hint)])
    return _from_python(file)


def _from_python(file: Path) -> Scene:
    spec = importlib.util.spec_from_file_location(f"scenario_{file.stem}", file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
        if not callable(getattr(module, "scene", None)):
            raise InputError([Fault(str(file), "defines no function scene()", "return a simbrake.Scene from it")])
        scene = module.scene()
    except InputError:
        raise
    except Exception as error:  # whatever goes wrong in somebody's file is a fault of the input, told in one line
        raise InputError([Fault(str(file), f"{type(error).__name__}: {error}", "mend the scenario file")]) from error
    if not isinstance(scene, Scene):
        raise InputError([Fault(str(file), f"scene() returned {type(scene).__name__}", "return a simbrake.Scene")])
    return scene
