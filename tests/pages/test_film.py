"""An animation: what its frames show, and what it refuses."""

import json
import math
import re

import numpy as np
import pytest
from commands import call
from helpers import paths_of
from matplotlib.figure import Figure
from picture_scenes import plain_result
from PIL import Image

from simbrake import plot


def test_frames_show_the_run(monkeypatch, tmp_path):
    """Five frames until 1.15 of the way to the stop: time, torque, and a mark that
    turns with `φ`."""
    run = plain_result()
    seen = []
    save = Figure.savefig

    def read(figure, *arguments, **named):
        texts = [figure.get_suptitle(), *(t.get_text() for t in figure.axes[0].texts)]
        lines = [line for axes in figure.axes for line in axes.lines]
        (mark,) = [x.get_xydata()[0] for x in lines if x.get_gid() == "mark"]
        seen.append(("\n".join(texts), mark))
        return save(figure, *arguments, **named)

    monkeypatch.setattr(Figure, "savefig", read)
    file = tmp_path / "new" / "film.gif"
    plot.animate(run, file, duration=0.5, fps=10, progress=False)
    times = np.linspace(0.0, 1.15 * float(run.stopping_time), 5)
    s = run.series(times)
    for i, (words, (x, y)) in enumerate(seen):
        told = float(re.search(r"\$t\$ = (\S+) s", words)[1])
        torque = float(re.search(r"brake torque (\S+) kN", words)[1])
        assert told == pytest.approx(times[i], rel=1e-3)
        assert torque == pytest.approx(float(s.brake_torque[i]) / 1e3, rel=1e-3)
        turned = math.atan2(y, x) - (float(s.phi[i]) + math.pi / 2)
        assert math.remainder(turned, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)
    still = plot.pulley(run, float(run.stopping_time) - 1e-7).axes[0].texts
    assert "$\\omega$\n0\nrad/s" in [text.get_text() for text in still]
    with Image.open(file) as image:
        assert (image.n_frames, image.info["duration"]) == (len(seen), 100) == (5, 100)


@pytest.mark.parametrize(
    ("name", "given", "paths"),
    [
        ("stop.mp4", {}, ["path"]),
        ("stop.gif", {"duration": -1.0, "fps": 60.0}, ["fps", "duration"]),
        ("stop.gif", {"start": -1.0, "end": 9.0}, ["start", "end"]),
    ],
)
def test_what_makes_no_animation(tmp_path, name, given, paths):
    assert paths_of(plot.animate, plain_result(), tmp_path / name, **given) == paths
    assert not list(tmp_path.iterdir())


def test_animation_as_a_page(tmp_path, capsys):
    file = tmp_path / "film.html"
    options = ("--duration", "2", "--fps", "10", "--end", "1")
    assert call(capsys, "animate", "standard", str(file), *options)[0] == 0
    pattern = '<script type="application/json" id="data">(.*?)</script>'
    (data,) = re.findall(pattern, file.read_text("utf-8"), re.S)
    run = json.loads(data)["run"]
    clock = run["film"]["clock"]
    assert (clock["run"][-1], clock["film"][-1]) == (1.0, 2.0)
    moments = np.interp(np.linspace(0.0, 2.0, 20), clock["film"], clock["run"])
    apart = np.min(abs(np.subtract.outer(run["t"], moments)), axis=0)
    assert np.max(apart) < 1e-6  # rounded
