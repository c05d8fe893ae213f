"""An animation: what its frames show, when, and what it refuses; and how fast the film
of a page runs."""

import math
import re

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from picture_scenes import CONTACTS, plain_result, staged_result, wedges
from PIL import Image

import simbrake as sb
from simbrake import plot

CONTACT_OF = {to_hex(colour): words for words, colour in CONTACTS.items()}


@pytest.fixture
def filmed(monkeypatch, tmp_path):
    """Of every frame, as it is saved: words, contacts of the linings, places of the
    marks, scale of tension."""

    def film(result, **options):
        seen = []
        save = Figure.savefig

        def read(figure, *arguments, **named):
            words = [
                figure.get_suptitle(),
                *(text.get_text() for text in figure.axes[0].texts),
            ]
            linings = [
                CONTACT_OF[to_hex(wedge.get_facecolor())]
                for wedge in wedges(figure.axes[0], "external")
            ]
            marks = [
                line.get_xydata()[0]
                for axes in figure.axes
                for line in axes.lines
                if line.get_gid() == "mark"
            ]
            scale = [
                text.get_text()
                for text in figure.axes[0].texts
                if text.get_gid() == "tension scale"
            ]
            seen.append(("\n".join(words), linings, marks, scale))
            return save(figure, *arguments, **named)

        with monkeypatch.context() as patch:
            patch.setattr(Figure, "savefig", read)
            plot.animate(result, tmp_path / "film.gif", progress=False, **options)
        return seen

    return film


def time_of(words):
    return float(re.search(r"\$t\$ = (\S+) s", words)[1])


@pytest.mark.parametrize(
    "make", [plain_result, pytest.param(staged_result, marks=pytest.mark.slow)]
)
def test_frames_show_the_run(filmed, make):
    """Evenly until 1.15 of the way to the stop: torque, tensions, stick and slip, and a
    mark that turns with `φ`."""
    result = make()
    frames = filmed(result, duration=0.5, fps=10)
    times = np.linspace(0.0, 1.15 * float(result.stopping_time), 5)
    s = result.series(times)
    for i, (words, linings, [(x, y)], _) in enumerate(frames):
        assert time_of(words) == pytest.approx(times[i], rel=1e-3)
        for sign, value in (
            ("brake torque", s.brake_torque),
            ("T_0$ =", s.slack_tension),
            ("T_n$ =", s.tight_tension),
        ):
            assert float(
                re.search(rf"{re.escape(sign)} (\S+) kN", words)[1]
            ) == pytest.approx(float(value[i]) / 1e3, rel=1e-3, abs=1e-3)
        assert len(linings) == result.scene.brake.linings.count
        turned = math.atan2(y, x) - (float(s.phi[i]) + math.pi / 2)
        assert math.remainder(turned, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)
    assert len(frames) == 5
    if make is plain_result:
        assert frames[2][1] == ["slides"] * 8
        assert frames[-1][1].count("sticks") == 8  # at rest


def test_the_scales_of_all_frames_are_one(filmed):
    """The same numbers stand at the rings in each frame, though the tension rises from
    8 to 36 kN."""
    scales = [scale for *_, scale in filmed(plain_result(), duration=0.3, fps=10)]
    assert scales == [["0", "10", "20", "30 kN"]] * 3


@pytest.mark.parametrize(
    ("start", "end", "first", "last"),
    [(None, 2.0, 0.0, 2.0), (0.5, None, 0.5, None), (2.0, None, 2.0, 4.0)],
)
def test_ends_of_the_animation(filmed, start, end, first, last):
    """By default shortly after the stop; from after the stop to the end of the run."""
    run = plain_result()
    frames = filmed(run, duration=0.2, fps=10, start=start, end=end)
    wanted = first, 1.15 * float(run.stopping_time) if last is None else last
    assert [time_of(words) for words, *_ in frames] == pytest.approx(wanted, rel=1e-3)


def test_animation_writes_every_frame(tmp_path):
    """A GIF counts in hundredths of a second, and has two frames at least."""
    told = []
    for fps, count, shown in ((10, 2, 100), (50, 3, 20)):
        file = tmp_path / "new" / f"{fps}.gif"
        plot.animate(
            plain_result(),
            file,
            duration=0.06,
            fps=fps,
            progress=lambda *done: told.append(done),
        )
        with Image.open(file) as image:
            assert (image.n_frames, image.info["duration"], image.info["loop"]) == (
                count,
                shown,
                0,
            )
        assert told[-count:] == [(i, count) for i in range(1, count + 1)]


@pytest.mark.parametrize(
    ("name", "given", "paths"),
    [
        ("stop.mp4", {}, ["path"]),
        ("stop.gif", {"duration": -1.0, "fps": 60.0}, ["fps", "duration"]),
        ("stop.gif", {"duration": math.inf}, ["duration"]),
        ("stop.gif", {"duration": 1e4}, ["duration"]),
        ("stop.gif", {"start": -1.0, "end": 9.0}, ["start", "end"]),
        ("stop.gif", {"start": math.nan}, ["start"]),
        ("stop.gif", {"start": 1.0, "end": 1.0}, ["end"]),
    ],
)
def test_what_makes_no_animation(tmp_path, name, given, paths):
    with pytest.raises(sb.InputError) as caught:
        plot.animate(plain_result(), tmp_path / name, **given)
    assert [fault.path for fault in caught.value.faults] == paths
    assert not list(tmp_path.iterdir())


# --- the film of a page -------------------------------------------------------------
