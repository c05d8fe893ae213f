"""The path of one parameter through simbrake: files entered by a run and its
derivative.

    python docs/make_architecture.py          # prints the tables
    python docs/make_architecture.py --write  # draws the figure of docs/architecture.md

The friction coefficient of a band brake goes from a scene into a result (`simulate`,
first call: traced and compiled), is evaluated (`metrics`), and differentiated
(`jax.jvp`). A profiler of Python notes each file of the package when a function in it
is entered from another file; lines that JAX's own code calls back count as such.
"""

import argparse
import pathlib
import sys
from collections.abc import Callable
from typing import Any

import jax

import simbrake as sb

DOCS = pathlib.Path(__file__).parent
PACKAGE = pathlib.Path(sb.__file__).parent
#: folders from the lowest to the highest, with their purpose
LAYERS = (
    (
        "hybrid",
        "integrates any hybrid system: steps, guards, jumps, records, derivatives",
    ),
    ("_base", "numbers with units, input errors, tables, compiling, progress"),
    (
        "friction, profiles, loads, thermal, wear, brakes, …",
        "parts of a scene: parameters, laws, checks",
    ),
    ("parts", "the scene: all parts together, checked"),
    (
        "physics",
        "mechanisms with friction pairs; one system that couples them with heat, wear, "
        "rope, phases",
    ),
    (
        "outputs",
        "what a run says: quantities, maxima and marks between steps, metrics, events, stops",
    ),
    (
        "runs, files, results",
        "one run: simulate, prepare, result, limits, verdict, accuracy; scenes and "
        "results in files",
    ),
    (
        "studies, plot, checks",
        "many runs on one evaluator; figures; closed forms, a second integration by SciPy",
    ),
    (
        "design, rig, export",
        "estimates, synthesis, materials, layouts; recordings of rigs; C and FMU",
    ),
    ("pages", "reports, the app, the page that runs by itself"),
    ("cli", "the commands"),
)
#: how many of them, from the lowest, are the core
CORE = 7


def scene(friction: Any = 0.35, linings: int = 20) -> sb.Scene:
    """A rigid band, a load on a hook."""
    brake = sb.Brake(
        sb.Pulley(0.59, 1200.0),
        sb.Band(0.623),
        sb.uniform_linings(linings, "270 deg", friction),
    )
    return sb.Scene(
        brake, sb.Duty("24 kN", sb.HookLoad("60 t", 0.4, 8)), sb.Initial(24.0), 5.0
    )


def entered(work: Callable[[], Any]) -> dict[str, int]:
    """Files of the package in the order in which `work` first enters them, each with
    the number of entries."""
    found: dict[str, int] = {}
    last = [""]

    def note(frame: Any, event: str, _: Any) -> None:
        if event != "call":
            return
        path = pathlib.Path(frame.f_code.co_filename)
        if path.is_relative_to(PACKAGE) and frame.f_code.co_name != "<module>":
            name = path.relative_to(PACKAGE).as_posix()
            if name != last[0]:
                found[name] = found.get(name, 0) + 1
                last[0] = name

    sys.setprofile(note)
    try:
        work()
    finally:
        sys.setprofile(None)
    return found


def said(name: str) -> str:
    """The first paragraph of a file's docstring."""
    text = (PACKAGE / name).read_text("utf-8")
    paragraph = text.split('"""')[1].strip().partition("\n\n")[0]
    return " ".join(paragraph.split()).rstrip(".")


def tables() -> list[str]:
    """The paths as tables of Markdown."""
    # all modules are loaded then
    slope = jax.jvp(lambda f: sb.simulate(scene(f, 12)).stopping_time, (0.35,), (1.0,))
    assert sb.simulate(scene(0.35, 12)).metrics["stopping_time"] == slope[0]
    made: list[Any] = []
    ways = (
        ("Making a scene", lambda: made.append(scene())),
        ("Running it: `sb.simulate(scene)`", lambda: made.append(sb.simulate(made[0]))),
        ("Reading the result: `result.metrics`", lambda: made[1].metrics),
        (
            "A derivative: `jax.jvp` of `stopping_time`",
            lambda: jax.jvp(
                lambda f: sb.simulate(scene(f)).stopping_time, (0.35,), (1.0,)
            ),
        ),
    )
    lines: list[str] = []
    for title, work in ways:
        found = entered(work)
        lines += [
            f"**{title}**: {len(found)} files",
            "",
            "| file | entered from another | contents |",
            "|---|---|---|",
        ]
        lines += [
            f"| `{name}` | {count} | {said(name)} |" for name, count in found.items()
        ]
        lines.append("")
    return lines


def picture() -> None:
    """The layers, the lowest at the bottom."""
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

    figure = Figure(figsize=(10.4, 5.4), layout="constrained")
    axes = figure.subplots()
    for i, (names, words) in enumerate(LAYERS):
        axes.add_patch(
            Rectangle(
                (0, i), 16, 0.82, fc="#e8eef4" if i < CORE else "#f6efe2", ec="#4a6a8a"
            )
        )
        axes.text(0.15, i + 0.41, names, va="center", fontsize=9.5, weight="bold")
        axes.text(6.1, i + 0.41, words, va="center", fontsize=8.2)
    axes.annotate(
        "",
        (-0.25, 0.1),
        (-0.25, len(LAYERS) - 0.3),
        arrowprops={"arrowstyle": "->", "color": "#4a6a8a"},
    )
    axes.text(
        -0.55, CORE / 2, "core", rotation=90, va="center", ha="center", fontsize=9
    )
    axes.text(
        -0.55,
        (CORE + len(LAYERS)) / 2,
        "wings",
        rotation=90,
        va="center",
        ha="center",
        fontsize=9,
    )
    axes.set(xlim=(-0.9, 16.1), ylim=(-0.1, len(LAYERS)))
    axes.axis("off")
    figure.savefig(DOCS / "architecture.png", dpi=130)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--write",
        action="store_true",
        help="draw the figure of docs/architecture.md instead",
    )
    if parser.parse_args().write:
        picture()
    else:
        print("\n".join(tables()))


if __name__ == "__main__":
    main()
