"""Draws the figures of `pictures.md` into `pictures/`, from the shipped scenarios. Takes some minutes."""

import dataclasses
import importlib.util
import json
import math
import sys
from pathlib import Path
from typing import Any

from PIL import Image

import simbrake as sb
from simbrake import plot

HERE = Path(__file__).resolve().parent
DPI = 72
COLOURS = 200  # fewer, and those that carry a meaning melt into one


def scenario(name: str) -> Any:
    """A scenario as a module."""
    spec = importlib.util.spec_from_file_location(name, HERE.parent / "scenarios" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def save(figure: Any, name: str) -> None:
    """Writes a figure as a small PNG."""
    file = HERE / "pictures" / f"{name}.png"
    figure.savefig(file, dpi=DPI)
    with Image.open(file) as image:
        small = image.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    small.save(file, optimize=True)
    print(f"{file.name}: {file.stat().st_size / 1e3:.0f} kB")


def main() -> None:
    (HERE / "pictures").mkdir(exist_ok=True)
    stop = sb.simulate(scenario("u2_5_5_stop").scene())
    save(plot.stop(stop), "stop")
    save(plot.pulley(stop, 0.005), "pulley")
    save(plot.lining_map(stop, "normal_load"), "lining_map")
    save(plot.tornado(sb.sensitivity(stop.scene, ["stopping_time"], span=0.05)[0]), "tornado")
    layouts = {
        "equal increments": sb.layouts.equal_increment_angles(0.3, 10, 10, math.radians(270.0)),
        "equal loads": sb.layouts.equal_load_angles(0.3, 10, math.radians(270.0)),
    }
    save(plot.angles(layouts), "angles")
    save(plot.chord_angles(7, (0.1, 0.3, 0.5)), "chord_angles")
    save(plot.pressed(sb.simulate(scenario("disc_stop").scene())), "pressed_disc")
    save(plot.pressed(sb.simulate(scenario("double_shoe_stop").scene())), "pressed_shoe")
    save(plot.contacts(sb.simulate(scenario("slip_onset_chain").scene())), "contacts")
    staged = sb.simulate(scenario("staged_vs_standard").scene())
    save(plot.stages(staged), "stages")
    save(plot.pulley(staged), "pulley_staged")
    tripping = scenario("tripping_30_stands")
    tripping.STANDS = 4  # enough to see it
    heated = sb.simulate(tripping.scene())
    save(plot.temperatures(heated), "temperatures")
    save(plot.depth(heated), "depth")
    save(plot.wear(scenario("lining_life").lives(scenario("lining_life").scene())), "wear")
    hot_stop = dataclasses.replace(stop.scene, heat=tripping.heat())
    save(plot.materials(sb.compare_materials(hot_stop, energy={"initial.omega": [12.0, 24.0, 36.0]})), "materials")
    film = HERE / "pictures" / "stop.gif"
    plot.animate(stop, film, duration=0.5, fps=20)
    with Image.open(film) as frames:
        frames.seek(3)
        frame = frames.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    frame.save(HERE / "pictures" / "animation.png", optimize=True)
    film.unlink()
    benchmark()


def benchmark() -> None:
    """Draws what `benchmarks/speed_against_error.py --json` wrote, here and with `--shipped`, into the two files."""
    sys.path.insert(0, str(HERE.parent))
    from benchmarks import pictures

    found = json.loads((HERE / "pictures" / "precision.json").read_text("utf-8"))
    save(pictures.work_precision(found), "speed_against_error")
    save(plot.work_precision(found | {"scenes": {name: found["scenes"][name] for name in "ac"}}), "precision")
    shipped = json.loads((HERE / "pictures" / "shipped.json").read_text("utf-8"))
    save(pictures.shipped(shipped), "shipped")


if __name__ == "__main__":
    main()
