"""Draws the figures of `pictures.md`, and small copies for the gallery, from the
shipped scenarios: some minutes."""

import dataclasses
import importlib.util
import json
import math
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import to_rgb
from PIL import Image

import simbrake as sb
from simbrake import plot
from simbrake.files.shipped_scenes import title_of
from simbrake.plot.drawing import CYCLE

HERE = Path(__file__).resolve().parent
DPI = 72
WIDTH = 300  # px, of small copies
COLOURS = 200  # fewer, and those that carry a meaning melt into one


def scenario(name: str) -> Any:
    """A scenario as a module."""
    spec = importlib.util.spec_from_file_location(
        name, HERE.parent / "scenarios" / f"{name}.py"
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def few_colours(image: Image.Image, colours: int = COLOURS) -> Image.Image:
    """The image with a palette that has the colours of thin lines as they are, though
    few points have them."""
    full = image.convert("RGB")
    paler = [
        1 - share + share * np.asarray(to_rgb(colour))
        for colour in CYCLE
        for share in (0.25, 0.5, 0.75, 1.0)
    ]
    thin = ["white", *paler, *colormaps["viridis"](np.linspace(0, 0.92, 9))]
    kept = np.rint(255 * np.asarray([to_rgb(colour) for colour in thin]))
    rest = np.asarray(full.quantize(colours - len(thin)).getpalette()).reshape(-1, 3)
    palette = np.concatenate([kept, rest])[:colours]
    seen, which = np.unique(
        np.asarray(full).reshape(-1, 3), axis=0, return_inverse=True
    )
    nearest = [
        int(np.argmin(np.sum((palette - colour) ** 2, axis=1))) for colour in seen
    ]
    small = Image.fromarray(
        np.asarray(nearest, np.uint8)[which].reshape(full.height, full.width), "P"
    )
    small.putpalette(palette.astype(np.uint8).ravel().tolist())
    return small


def save(figure: Any, name: str, colours: int = COLOURS, gallery: bool = True) -> None:
    """Writes a figure as a small PNG."""
    file = HERE / "pictures" / f"{name}.png"
    figure.savefig(file, dpi=DPI)
    with Image.open(file) as image:
        small = few_colours(image, colours)
    small.save(file, optimize=True)
    if gallery:
        thumbnail(file)
    print(f"{file.name}: {file.stat().st_size / 1e3:.0f} kB")


def thumbnail(file: Path) -> None:
    """A small copy of a figure, for the gallery."""
    (file.parent / "small").mkdir(exist_ok=True)
    with Image.open(file) as image:
        size = (WIDTH, round(WIDTH * image.height / image.width))
        few_colours(image.convert("RGB").resize(size, Image.Resampling.LANCZOS)).save(
            file.parent / "small" / file.name, optimize=True
        )


def titled(name: str) -> Any:
    """Figures inside have the title of a scenario."""
    file = sb.files.shipped(name)
    return plot.titled(title_of(file))


def main() -> None:
    (HERE / "pictures").mkdir(exist_ok=True)
    with titled("u2_5_5_stop"):
        stops(sb.simulate(scenario("u2_5_5_stop").scene()))
    layouts = {
        "equal increments": sb.layouts.equal_increment_angles(
            0.3, 10, 10, math.radians(270.0)
        ),
        "equal loads": sb.layouts.equal_load_angles(0.3, 10, math.radians(270.0)),
    }
    save(sb.layouts.figures.angles(layouts).figure, "angles")
    save(sb.layouts.figures.chord_angles(7, (0.1, 0.3, 0.5)), "chord_angles")
    for name, draw, picture in (
        ("disc_stop", plot.pressed, "pressed_disc"),
        ("double_shoe_stop", plot.pressed, "pressed_shoe"),
        ("slip_onset_chain", plot.contacts, "contacts"),
    ):
        with titled(name):
            save(draw(sb.simulate(scenario(name).scene())), picture)
    staged = sb.simulate(scenario("staged_vs_standard").scene())
    with titled("staged_vs_standard"):
        save(plot.stages(staged), "stages")
        save(plot.pulley(staged), "pulley_staged", 96)
    heated = sb.simulate(scenario("tripping_30_stands").scene())
    with titled("tripping_30_stands"):
        save(plot.stops(heated), "stops")
        save(plot.temperatures(heated), "temperatures")
        save(plot.depth(heated), "depth")
    save(
        plot.wear(scenario("lining_life").lives(scenario("lining_life").scene())),
        "wear",
    )
    decision()
    benchmark()


def decision() -> None:
    """The figure of `decision.md`, by the page's own blocks."""
    blocks = re.findall(
        r"^```python\n(.*?)^```", (HERE / "decision.md").read_text("utf-8"), re.S | re.M
    )
    space: dict[str, Any] = {}
    for block in (blocks[0], blocks[2]):  # the scene, the runs
        exec(block, space)
    save(plot.distribution(space["found"], "hook_travel"), "decision")


def stops(stop: sb.Result) -> None:
    """Figures of one stop, and of many like it."""
    scene = stop.scene
    save(plot.stop(stop), "stop")
    save(plot.pulley(stop, 0.005), "pulley", 96)
    save(plot.lining_map(stop, "normal_load"), "lining_map")
    save(
        plot.tornado(sb.sensitivity(scene, ["stopping_time"], span=0.05)[0]).figure,
        "tornado",
    )
    film = HERE / "pictures" / "stop.gif"
    plot.animate(stop, film, duration=0.5, fps=20, end=0.4)
    with Image.open(film) as frames:
        frames.seek(3)
        frame = few_colours(frames)
    frame.save(HERE / "pictures" / "animation.png", optimize=True)
    thumbnail(HERE / "pictures" / "animation.png")
    film.unlink()
    friction = "brake.linings.friction.coefficient"
    runs = {
        f"friction {f:.2f}": sb.simulate(sb.with_values(scene, {friction: f}))
        for f in (0.30, 0.35, 0.40)
    }
    save(plot.compare(runs), "compare")
    mass = np.linspace(20e3, 160e3, 29)
    speed = np.linspace(2.0, 36.0, 18)
    save(
        plot.sweep(
            sb.sweep(scene, {"duty.load.mass": mass}),
            ["stopping_time", "energy.friction_heat"],
        ),
        "sweep",
    )
    grid = sb.sweep(
        scene,
        {"duty.load.mass": mass, "initial.omega": speed},
        ["stopping_time", "energy.friction_heat"],
    )
    save(plot.sweep(grid), "sweep_grid")
    hot_stop = dataclasses.replace(scene, heat=scenario("tripping_30_stands").heat())
    save(
        sb.formulas.figures.materials(
            sb.compare_materials(hot_stop, energy={"initial.omega": [12.0, 24.0, 36.0]})
        ),
        "materials",
    )


def benchmark() -> None:
    """Draws what `benchmarks/speed_against_error.py --json` wrote."""
    sys.path.insert(0, str(HERE.parent))
    from benchmarks import pictures

    found = json.loads((HERE / "pictures" / "precision.json").read_text("utf-8"))
    save(pictures.work_precision(found), "speed_against_error", gallery=False)


if __name__ == "__main__":
    main()
