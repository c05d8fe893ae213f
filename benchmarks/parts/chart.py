"""The chart of the cost benchmark: what is used of each limit, and the curves over sizes."""

import logging
from typing import Any

from benchmarks.parts.table import Part


def draw(about: dict[str, Any], parts: list[Part], path: str) -> None:
    """Limits as bars, one panel for each part that has sizes."""
    import matplotlib

    matplotlib.use("Agg")
    logging.getLogger("matplotlib.font_manager").setLevel(logging.ERROR)  # fonts for signs that are not used
    import matplotlib.pyplot as plt

    targets = [(part.name, target) for part in parts for target in part.targets]
    sized = [part for part in parts if any("size" in row for row in part.rows)]
    heights = [0.28 * len(targets) + 1.2, *(4.2 for _ in sized)]
    figure, axes = plt.subplots(
        len(heights), 1, figsize=(10, sum(heights)), height_ratios=heights, squeeze=False, layout="constrained"
    )
    _limits(axes[0, 0], targets)
    for ax, part in zip(axes[1:, 0], sized, strict=True):
        _curves(ax, part)
    figure.suptitle(f"Costs beside what is wanted\n{about['cpu']}, {about['cores']} cores", fontsize=11)
    figure.savefig(path, dpi=130)
    plt.close(figure)


def _limits(ax: Any, targets: list[Any]) -> None:
    names = [f"{part}: {target.what}" for part, target in targets]
    # a cost below nothing is rounding of a difference
    shares = [max(target.share, 1e-2) for _, target in targets]
    colours = ["tab:green" if target.met else "tab:red" for _, target in targets]
    ax.barh(names[::-1], shares[::-1], color=colours[::-1])
    ax.axvline(1.0, color="black", linewidth=1.0)
    ax.set_xscale("log")
    ax.set_xlabel("reached over wanted (of rates: wanted over reached); left of 1 is within the limit")
    ax.tick_params(axis="y", labelsize=8)


def _curves(ax: Any, part: Part) -> None:
    curves: dict[str, list[tuple[float, float]]] = {}
    for row in part.rows:
        if "size" in row:
            curves.setdefault(row["curve"], []).append((row["size"], row["value"]))
    for marker, (name, points) in zip("osD^v*" * 9, curves.items()):  # noqa: B905
        ax.loglog(*zip(*points, strict=True), marker=marker, markersize=4, label=name)
    ax.set_title(f"{part.name}: {part.title}", loc="left", fontsize=10)
    ax.set_xlabel("size")
    ax.set_ylabel("s of one run" if part.name == "growth" else "runs a second")
    ax.grid(alpha=0.3)
    ax.legend(fontsize=8, frameon=False)
