"""Limits where of many runs nothing is kept but metrics."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..outputs.metrics import HOLDING, METRICS, allowable_values, keeps
from ..parts.scene import Scene
from ..results.stored import Dataset
from ..runs.findings import PRESSURE


class LimitsOfManyRuns(NamedTuple):
    """Limits where of many runs nothing is kept but metrics: `limits` of those, in SI;
    `aside` are the names of other limits."""

    limits: dict[str, float]
    aside: tuple[str, ...]

    @classmethod
    def of(
        cls, scene: Scene, limits: Mapping[str, float], metrics: Sequence[str]
    ) -> "LimitsOfManyRuns":
        """All limits of a run by metric: those given, and those of the parts of the
        scene.

        Of linings that are alike a pressure is limited by the load that gives it, and
        wear by what may still be lost.
        """
        every = {**allowable_values(scene), **limits}
        aside = []

        def least(name: str, bound: Any, of: str) -> None:
            if np.ptp(bound) == 0 and name in metrics:
                every[name] = min(every.get(name, np.inf), float(np.ravel(bound)[0]))
            else:
                aside.append(of)

        pressure = every.pop(PRESSURE, scene.brake.linings.permissible_pressure)
        if pressure is not None:
            least(
                "max_normal_load",
                np.asarray(pressure) * np.asarray(scene.brake.linings.area),
                PRESSURE,
            )
        if scene.wear is not None and scene.wear.permissible is not None:
            least(
                "greatest_wear",
                np.asarray(scene.wear.permissible) - np.asarray(scene.wear.worn),
                "worn_thickness",
            )
        # (the reserve has a limit in every scene that has one)
        wanted = [*every, *([] if METRICS[HOLDING].needs.lacks(scene) else [HOLDING])]
        aside += [name for name in wanted if name not in metrics]
        return cls(
            {name: limit for name, limit in every.items() if name in metrics},
            tuple(dict.fromkeys(aside)),
        )


def kept(data: Dataset, metric: str, limit: Any) -> Any:
    """Which runs keep a limit; where the brake held and no load hung, the reserve is
    infinite and keeps any."""
    within = keeps(limit, metric, data[metric])
    if metric == HOLDING:
        within |= np.isposinf(data[metric]) & (data["reason"] == "H4")
    return within
