"""Scenes that come with simbrake: commented templates for a new scene, and the shipped
scenes. Free of JAX."""

import ast
import os
from pathlib import Path
from typing import NamedTuple

from .._base._faults import InputError, existing_file, input_error, nearest

#: names of the templates, in the order in which a newcomer meets them
TEMPLATES = (
    *("standard", "staged", "heated", "tripping", "rig", "disc", "shoe"),
    *("lift", "windlass", "winch", "winder", "rotor"),
)
#: studies, and further scenes of a kind of which an installed package has one:
#: `scenarios/` of a checkout has them
IN_CHECKOUT = (
    "calibrate_friction",
    "everything_coupled",
    "sensitivity_u2_5_5",
    "stopping_time_uncertainty",
    "unequal_bands",
)
_PACKAGE = Path(__file__).parents[1]
_TESTS = _PACKAGE / "templates" / "tests"


class Shipped(NamedTuple):
    """A file that comes with simbrake: its `name`, the `file`, and what it is about
    (`title`)."""

    name: str
    file: Path
    title: str

    @property
    def template(self) -> bool:
        return self.name in TEMPLATES


def _files() -> list[Path]:
    """All of them, templates first; a scene in TOML stands behind the same one in
    Python."""
    # beside the modules in an installed package, beside the package in a checkout
    places = (_PACKAGE / "scenarios", _PACKAGE.parent / "scenarios")
    scenes = [
        file
        for place in places
        for ending in ("*.py", "*.toml")
        for file in place.glob(ending)
    ]
    files = [_PACKAGE / "templates" / "scenes" / f"{name}.toml" for name in TEMPLATES]
    return files + sorted(scenes, key=lambda file: (file.stem, file.suffix))


def shipped_files() -> dict[str, Shipped]:
    """All of them by name, templates first. A scene in TOML and in Python has the TOML
    file at its name."""
    return {file.stem: Shipped(file.stem, file, title_of(file)) for file in _files()}


def shipped_tests(name: str | Path) -> Path | None:
    """The file of acceptance tests of a name that ends in `_tests`, if it is shipped."""
    name = Path(name).stem
    return _TESTS / f"{name}.toml" if name in shipped_test_names() else None


def shipped_test_names() -> list[str]:
    """Names of the shipped files of acceptance tests."""
    return sorted(file.stem for file in _TESTS.glob("*_tests.toml"))


def _shipped_file(name: str | Path) -> Path | None:
    """The shipped file of a name: with or without its ending, with `scenarios/` before
    it, or the file's own path."""
    path = Path(name)
    short = path.name if path.parent in (Path(), Path("scenarios")) else None
    found = [
        file for file in _files() if path == file or short in (file.stem, file.name)
    ]
    return found[-1] if found else None


def shipped(name: str | Path) -> Path:
    """The file of a template or shipped scene by its name, with or without its ending.

    `simbrake.read_scene` takes the name itself. Raises `InputError` with the nearest
    names where there is none.

    Example:
        >>> sb.files.shipped("standard").name
        'standard.toml'
    """
    file = _shipped_file(name)
    if file is not None:
        return file
    hint = hint_of(name) or f"there are: {', '.join(shipped_files())}"
    raise input_error(str(name), "is not the name of a template or shipped scene", hint)


def scene_file(name: str | Path, *kinds: str) -> Path:
    """The file of a scene: at that path, else the template or shipped scene of that
    name.

    - `kinds`: patterns of other files that fit

    Raises `InputError` with the nearest names and the scenes in the folder where there
    is none.
    """
    file = Path(name)
    if not os.path.isfile(file) and (named := _shipped_file(file)) is not None:
        return named
    try:
        return existing_file(file, "*.toml", "*.py", *kinds)
    except InputError as error:
        (fault,) = error.faults
        hint = f"{hint_of(file) or fault.hint}; simbrake new lists templates and shipped scenes"
        raise input_error(fault.path, fault.problem, hint) from None


def hint_of(name: str | Path) -> str:
    """Where a scene is that an installed package does not have, or the nearest names;
    empty where there are none."""
    short = Path(name).stem
    if short in IN_CHECKOUT:
        return f"it is scenarios/{short}.py in a checkout of the repository"
    return nearest(short, shipped_files(), "")


def title_of(file: Path) -> str:
    """Heading of a scene: the first paragraph of the docstring or the first line of the
    comment of its file, else the file's name."""
    text = file.read_text("utf-8", errors="replace")
    if file.suffix == ".py":
        try:
            whole = ast.get_docstring(ast.parse(text)) or ""
            title = " ".join(whole.partition("\n\n")[0].split())
        except SyntaxError:
            title = ""
    else:
        title = (
            next(iter(text.splitlines()), "").lstrip("# ")
            if text.startswith("#")
            else ""
        )
    return title.strip().rstrip(".") or file.stem.replace("_", " ")
