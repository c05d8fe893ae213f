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
    figure = plt.figure(figsize=(10, sum(heights) + 0.6), layout="constrained")
    # each panel with margins of its own: the names of the limits are long
    panels = figure.subfigures(len(heights), 1, height_ratios=heights, squeeze=False)[:, 0]
    _limits(panels[0].subplots(), targets)
    for panel, part in zip(panels[1:], sized, strict=True):
        _curves(panel.subplots(), part)
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
    ax.set_xlabel("reached over wanted, of rates the inverse; left of 1: within the limit")
    ax.tick_params(axis="y", labelsize=8)


def _curves(ax: Any, part: Part) -> None:
    curves: dict[str, list[dict[str, Any]]] = {}
    for row in part.rows:
        if "size" in row:
            curves.setdefault(row["curve"], []).append(row)
    for i, (name, rows) in enumerate(curves.items()):
        style = {"color": f"C{i}", "marker": "osD^v*"[i % 6], "markersize": 4}
        sizes = [row["size"] for row in rows]
        ax.loglog(sizes, [row["value"] for row in rows], label=name, **style)
        ax.loglog(sizes, [row["bare"] for row in rows], label=f"{name}, bare loop", linestyle="--", **style)
    low, high = ax.get_ylim()
    if high < 10 * low:  # nearly level: a decade at least, or rounding looks like a trend
        ax.set_ylim(low / 3, high * 3)
    ax.set_title(f"{part.name}: {part.title}", loc="left", fontsize=10)
    ax.set_xlabel("size")
    ax.set_ylabel("seconds of one run" if part.name == "growth" else "runs a second")
    ax.grid(alpha=0.3)
    ax.legend(fontsize=8, frameon=False)
