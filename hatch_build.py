"""Build hook: the wheel has one shipped scene of each kind as `simbrake/scenarios`; a
checkout has all beside it."""

import ast
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class ShippedScenes(BuildHookInterface):
    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if version != "editable":
            here = Path(self.root)
            nodes = ast.parse(
                (here / "simbrake" / "files" / "shipped_scenes.py").read_text("utf-8")
            ).body
            names = next(
                n.value
                for n in nodes
                if isinstance(n, ast.Assign)
                and ast.unparse(n.targets[0]) == "IN_CHECKOUT"
            )
            for file in sorted((here / "scenarios").glob("*.*")):
                if file.stem not in ast.literal_eval(names):
                    build_data["force_include"][str(file)] = (
                        f"simbrake/scenarios/{file.name}"
                    )
