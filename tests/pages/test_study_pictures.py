"""Pictures of layouts and of measured speeds, checked against the numbers they show."""

import math
import pathlib
import sys

import numpy as np
import pytest
from picture_scenes import plain_result
from PIL import Image

sys.path.insert(0, str(pathlib.Path(__file__).parents[2]))

import simbrake as sb
from benchmarks import pictures
from simbrake import plot


@pytest.fixture(scope="module")
def plain():
    return plain_result()


# --- layouts ----------------------------------------------------------------------------------------------------------


def test_angles_add_up_to_the_wrap(plain):
    layout = sb.layouts.equal_increment_angles(0.3, 10, 10, math.radians(270.0))
    axes = plot.angles({"equal increments": layout, "with gaps": plain.scene}).axes[0]
    steps = [line for line in axes.lines if line.get_marker() == "None"]
    dots = {line.get_label().partition(":")[0]: line for line in axes.lines if line.get_marker() != "None"}
    np.testing.assert_allclose(dots["equal increments"].get_ydata(), np.degrees(layout.angle), rtol=1e-12)
    np.testing.assert_allclose(dots["uniform pitch"].get_ydata(), 27.0, rtol=1e-12)
    x = np.asarray(steps[0].get_xdata()).reshape(10, 3)
    np.testing.assert_allclose(x[:, 1] - x[:, 0], np.degrees(layout.angle), rtol=1e-12)
    assert x[-1, 1] == pytest.approx(270.0)
    x = np.asarray(steps[1].get_xdata()).reshape(8, 3)
    np.testing.assert_allclose(x[1:, 0] - x[:-1, 1], [2, 2, 2, 6, 2, 2, 2], rtol=1e-9)
    assert axes.get_xlabel().endswith(", °")
    assert axes.get_ylabel().endswith(", °")
    assert r"$\Sigma\beta$ = 270°" in axes.get_legend().get_texts()[0].get_text()
    # Z, table 6: first row
    assert dots["equal increments"].get_ydata()[0] == pytest.approx(50.3, abs=0.5)


def test_angles_name_every_fault():
    with pytest.raises(sb.InputError) as caught:
        plot.angles({"degrees": np.full(10, 27.0), "none": [], "words": "wide", "fine": np.full(4, 0.5)})
    assert [fault.path for fault in caught.value.faults] == ["given['degrees']", "given['none']", "given['words']"]
    assert "are they in degrees" in str(caught.value)
    with pytest.raises(sb.InputError, match="empty"):
        plot.angles({})


# --- work and precision -----------------------------------------------------------------------------------------------


def benchmark():
    rows = [
        {"method": "simbrake Dopri8", "seconds": 1e-4, "error": 1e-6},
        {"method": "simbrake Dopri8", "seconds": 2e-4, "error": 0.0},
        {"method": "Other RK4", "seconds": 3e-3, "error": 1e-4},
        {"method": "Other RK4", "seconds": 5e-3, "error": math.inf},
    ]
    scene = {"name": "a", "title": "stop", "reference": {"uncertainty": 1e-15}, "rows": rows}
    machine = {"cpu": "a processor", "cores": 2, "versions": {"simbrake": "0"}}
    return {"machine": machine, "scenes": {"a": scene, "b": {**scene, "name": "b"}}}


def test_picture_of_the_benchmark(tmp_path):
    pictures.work_precision(benchmark()).savefig(tmp_path / "chart.png")
    with Image.open(tmp_path / "chart.png") as image:
        assert min(image.size) > 500
