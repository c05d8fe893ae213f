"""The part of a page of the documentation that a command writes."""

import pathlib
from typing import Any

BEGIN, END = "<!-- figures of the command begin here -->", "<!-- and end here -->"
ROOT = pathlib.Path(__file__).resolve().parents[1]


def blocks(path: pathlib.Path, mark: str) -> dict[str, str]:
    """What stands between the two marks by name; a block begins with a comment of the mark and its name."""
    inside = path.read_text("utf-8").split(BEGIN)[1].split(END)[0]
    return {block.split(" -->", 1)[0]: block.split(" -->", 1)[1] for block in inside.split(f"<!-- {mark} ")[1:]}


def write(path: pathlib.Path, mark: str, new: dict[str, str], order: tuple[str, ...]) -> None:
    """Replaces blocks between the two marks; those not given stay as they are."""
    before, rest = path.read_text("utf-8").split(BEGIN)
    after = rest.split(END)[1]
    found = blocks(path, mark) | {name: f"\n\n{text}\n\n" for name, text in new.items()}
    whole = "".join(f"<!-- {mark} {name} -->{found[name]}" for name in order if name in found)
    path.write_text(f"{before}{BEGIN}\n\n{whole}{END}{after}", "utf-8")


def measured_on(about: dict[str, Any], packages: tuple[str, ...]) -> str:
    """The machine in one sentence."""
    versions = ", ".join(f"{name} {about['versions'][name]}" for name in packages)
    return f"Measured on {about['cpu']}, {about['cores']} cores (load {about['load']:.1f}); {versions}."
