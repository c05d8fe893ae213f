"""Build hook: the wheel has the shipped scenes as `simbrake/scenarios`; a checkout has them beside the package."""

from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class ShippedScenes(BuildHookInterface):
    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if version != "editable":
            build_data["force_include"]["scenarios"] = "simbrake/scenarios"
