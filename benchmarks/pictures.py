"""Error against time as a picture: all scenes with all tools."""

import logging
import math
from typing import Any

from benchmarks.report import by_method

#: colour of each tool; its methods differ by their marks
_COLOURS = {
    "simbrake": "black",
    "heyoka": "#e6007e",
    "CyRK": "#d55e00",
    "diffsol": "#7a4a21",
    "CasADi": "#009e73",
    "sundae": "#e69f00",
    "SciPy": "#0072b2",
    "PathSim": "#cc79a7",
    "diffrax": "#56b4e9",
}
_MARKS = "osD^v*P"
#: rounding of the references: where an error of 0 stands
_ROUNDING = 1e-16


def _figure(columns: int, rows: int, size: tuple[float, float]) -> tuple[Any, Any]:
    from matplotlib.figure import Figure  # loaded when everything is measured

    # fonts for signs that are not used
    logging.getLogger("matplotlib.font_manager").setLevel(logging.ERROR)
    figure = Figure(figsize=size, layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False).ravel()


def _place(found: dict[str, Any]) -> str:
    about = found["machine"]
    return f"{about['cpu']}, {about['cores']} cores; simbrake {about['versions']['simbrake']}"


def work_precision(found: dict[str, Any]) -> Any:
    """A panel for each scene, a line for each method; the legend below is in columns,
    one for each tool."""
    scenes = list(found["scenes"].values())
    columns = min(2, len(scenes))
    rows = math.ceil(len(scenes) / columns)
    figure, axes = _figure(columns, rows, (7.0 * columns, 5.0 * rows + 3.4))
    marks = _marks(scenes)
    for ax, scene in zip(axes, scenes, strict=False):
        _panel(ax, scene, marks)
    for ax in axes[len(scenes) :]:
        ax.set_axis_off()
    figure.suptitle(
        "Error (of event times, relative, and of the final state in its typical sizes) "
        "against time of one warm run:"
        " left and low is better\n"
        "C: compiled by gcc;  tanh ε: friction smoothed with tanh(slip speed / (ε · initial speed))"
        f"\n{_place(found)}",
        fontsize=12,
    )
    _legend(figure, marks)
    return figure


def _marks(scenes: list[dict[str, Any]]) -> dict[str, dict[str, str]]:
    """Mark of each method by tool, the same one in all panels."""
    found: dict[str, dict[str, str]] = {tool: {} for tool in _COLOURS}
    for scene in scenes:
        for name in by_method(scene):
            known = found.setdefault(name.split()[0], {})
            known.setdefault(name, _MARKS[len(known) % len(_MARKS)])
    return {tool: known for tool, known in found.items() if known}


def _panel(ax: Any, scene: dict[str, Any], marks: dict[str, dict[str, str]]) -> None:
    for name, all_points in by_method(scene).items():
        tool = name.split()[0]
        points = [p for p in all_points if math.isfinite(p["error"])]
        ours = tool == "simbrake"
        ax.loglog(
            [1e3 * p["seconds"] for p in points],
            [max(p["error"], _ROUNDING) for p in points],
            marker=marks[tool][name],
            color=_COLOURS.get(tool, "0.5"),
            linewidth=2.4 if ours else 1.1,
            markersize=6 if ours else 4.5,
            zorder=3 if ours else 2,
        )
    uncertain = max(scene["reference"]["uncertainty"], 1.5 * _ROUNDING)
    ax.axhspan(_ROUNDING / 2, uncertain, color="0.88")
    ax.set_ylim(_ROUNDING / 2, None)
    # a title that is too long for its panel goes on in a second line
    head, _, rest = scene["title"].partition(": ")
    ax.set_title(f"({scene['name']}) {head}\n{rest}", loc="left", fontsize=12)
    ax.set_xlabel("time, ms", fontsize=12)
    ax.set_ylabel("largest error (–)", fontsize=12)
    ax.tick_params(labelsize=12)
    ax.grid(alpha=0.3)


def _legend(figure: Any, marks: dict[str, dict[str, str]]) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    nothing = Line2D([], [], linestyle="none", label=" ")
    tools = []
    for tool, names in marks.items():
        style = {
            "color": _COLOURS.get(tool, "0.5"),
            "linewidth": 2.4 if tool == "simbrake" else 1.3,
        }
        tools.append(
            [
                Line2D([], [], marker=mark, label=name, **style)
                for name, mark in names.items()
            ]
        )
    tools[0].append(Patch(color="0.88", label="reference uncertain"))
    # columns are filled from above: short tools share one, and all are as long as the
    # longest
    tall = max(8, *(len(entries) for entries in tools))
    stacks: list[list[Any]] = []
    for entries in tools:
        if stacks and len(stacks[-1]) + len(entries) <= tall:
            stacks[-1] += entries
        else:
            stacks.append(list(entries))
    handles = [
        handle
        for stack in stacks
        for handle in [*stack, *[nothing] * (tall - len(stack))]
    ]
    figure.legend(
        handles=handles,
        loc="outside lower center",
        ncols=len(stacks),
        fontsize=12,
        frameon=False,
    )
