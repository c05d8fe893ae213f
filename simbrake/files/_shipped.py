"""Scenes that come with simbrake: commented templates for a new scene, and the shipped scenes. Free of JAX."""

import ast
import difflib
from pathlib import Path
from typing import NamedTuple

from .._base._arguments import explained
from .._base._faults import Fault, InputError

#: names of the templates, in the order in which a newcomer meets them
TEMPLATES = ("standard", "staged", "heated", "tripping", "rig", "disc", "shoe")
#: studies, and further scenes of a kind of which an installed package has one: `scenarios/` of a checkout has them
IN_CHECKOUT = (
    "calibrate_friction",
    "everything_coupled",
    "sensitivity_u2_5_5",
    "stopping_time_uncertainty",
    "unequal_bands",
)
_PACKAGE = Path(__file__).parents[1]


class Shipped(NamedTuple):
    """A file that comes with simbrake: its `name`, the `file`, and what it is about (`title`)."""

    name: str
    file: Path
    title: str

    @property
    def template(self) -> bool:
        return self.name in TEMPLATES


def shipped_files() -> dict[str, Shipped]:
    """All of them by name, templates first. A scene in TOML and in Python has the TOML file at its name."""
    # beside the modules in an installed package, beside the package in a checkout
    scenes = next(path for path in (_PACKAGE / "scenarios", _PACKAGE.parent / "scenarios") if path.is_dir())
    files = [_PACKAGE / "templates" / "scenes" / f"{name}.toml" for name in TEMPLATES]
    files += sorted([*scenes.glob("*.py"), *scenes.glob("*.toml")], key=lambda file: (file.stem, file.suffix))
    return {file.stem: Shipped(file.stem, file, title_of(file, file.read_text("utf-8"))) for file in files}


@explained
def shipped(name: str) -> Path:
    """The file of a template or shipped scene by its name: `sb.read_scene(sb.files.shipped("u2_5_5_stop"))`.

    Raises `InputError` with the nearest names where there is none.

    Example:
        >>> sb.files.shipped("standard").name
        'standard.toml'
    """
    files = shipped_files()
    if name in files:
        return files[name].file
    hint = hint_of(name) or f"there are: {', '.join(files)}"
    raise InputError([Fault(name, "is not the name of a template or shipped scene", hint)])


def hint_of(name: str) -> str:
    """Where a scene is that an installed package does not have, or the nearest names; empty where there are none."""
    if name in IN_CHECKOUT:
        return f"it is scenarios/{name}.py in a checkout of the repository"
    near = difflib.get_close_matches(name, shipped_files(), n=3, cutoff=0.5)
    return f"nearest: {', '.join(near)}" if near else ""


def title_of(file: Path, text: str) -> str:
    """Heading of a scene: the first line of the docstring or comment of its file, else the file's name."""
    if file.suffix == ".py":
        try:
            said = ast.get_docstring(ast.parse(text)) or ""
        except SyntaxError:
            said = ""
    else:
        said = next(iter(text.splitlines()), "").lstrip("# ") if text.startswith("#") else ""
    return said.strip().partition("\n")[0].rstrip(".") or file.stem.replace("_", " ")
