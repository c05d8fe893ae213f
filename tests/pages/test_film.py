"""The film of one braking: how fast it runs, what its frames show, what it refuses."""

import math
import re

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex
from matplotlib.text import Text
from picture_scenes import CONTACTS, hot_result, plain_result, staged_result, wedges
from PIL import Image
from stop_scenes import stop_scene

import simbrake as sb
from simbrake import plot

RESULTS = {"plain": plain_result, "staged": staged_result, "hot": hot_result}
NUMBER = r"\s*([-−\d.]+)"


@pytest.fixture
def filmed(monkeypatch, tmp_path):
    """What stands in the frames of a film, as they are drawn."""

    def film(result, **options):
        seen, raw = [], FigureCanvasAgg.buffer_rgba

        def read(canvas):
            (title,) = [x.get_text() for x in canvas.figure.findobj(Text) if x.get_text().startswith("t = ")]
            axes = canvas.figure.axes
            linings = [CONTACT_OF.get(to_hex(w.get_facecolor())) for w in wedges(axes[0], "external")]
            cursors = {x[0] for panel in axes[1:3] for x in [panel.lines[-1].get_xdata()] if len(x) == 2}
            seen.append((title, linings, cursors))
            return raw(canvas)

        with monkeypatch.context() as patch:
            patch.setattr(FigureCanvasAgg, "buffer_rgba", read)
            plot.animate(result, tmp_path / "film.gif", progress=False, **options)
        return seen

    return film


CONTACT_OF = {to_hex(colour): words for words, colour in CONTACTS.items()}


def read(title):
    """Time (s) and the other numbers of a title, by their signs."""
    found = {sign: float(x) for sign, x in re.findall(rf"(ω|φ|T₀|Tₙ|torque|travel) ?=?{NUMBER}", title)}
    t, unit = re.match(rf"t ={NUMBER} (\w+)", title).groups()
    return float(t) * {"s": 1.0, "ms": 1e-3}[unit], found


@pytest.mark.parametrize("name", RESULTS)
def test_frames_show_the_run(filmed, name):
    """Numbers of the titles in their units, cursors and the colours of contact, frame by frame."""
    result = RESULTS[name]()
    frames = filmed(result, duration=1.0, fps=9)
    assert len(frames) == 9
    for title, linings, cursors in frames[1:]:
        t, found = read(title)
        (at,) = cursors
        assert at == pytest.approx(t, abs=1e-4)
        s = result.series([at])
        wanted = {
            "ω": s.omega[0],
            "φ": s.phi[0] / (2 * math.pi),
            "T₀": s.slack_tension[0] / 1e3,
            "Tₙ": s.tight_tension[0] / 1e3,
            "torque": s.brake_torque[0] / 1e3,
        }
        assert found.keys() == wanted.keys()
        for sign, value in wanted.items():
            assert found[sign] == pytest.approx(float(value), abs=0.006), (sign, title)
        assert len(linings) == result.scene.brake.linings.count
        if name != "hot":
            assert set(linings) <= set(CONTACTS)
    if name == "plain":
        assert frames[5][1] == ["slides"] * 8
        assert frames[-1][1].count("sticks") == 8  # at rest


def times_of(frames):
    return np.asarray([min(cursors) for _, _, cursors in frames])


def test_film_is_slow_where_slip_begins(filmed):
    """45 % of the film up to 1.3 times full slip, the rest up to 1.15 times the stop; the title says how slow."""
    run = plain_result()
    full, stop = float(run.full_slip_time), float(run.stopping_time)
    frames = filmed(run, duration=5.05, fps=20)
    t = times_of(frames)
    assert (t[0], t[45], t[100]) == pytest.approx((0.0, 1.3 * full, 1.15 * stop))
    for i, rate in ((10, 0.45 * 5.05 / (1.3 * full)), (90, 0.55 * 5.05 / (1.15 * stop - 1.3 * full))):
        times = re.search(r"slow motion: (\S+) times slower", frames[i][0])[1]
        assert float(times) == pytest.approx(rate, rel=0.05)


@pytest.mark.parametrize(
    ("duration", "words"),
    [(1.0, "as fast as the brake"), (0.5, "2.0 times faster"), (2.0, "slow motion: 2.0 times slower")],
)
def test_rate_of_an_even_film(filmed, duration, words):
    frames = filmed(plain_result(), duration=duration, fps=10, start=2.0, end=3.0)
    assert all(words in title for title, _, _ in frames)
    np.testing.assert_allclose(times_of(frames), np.linspace(2.0, 3.0, len(frames)))


@pytest.mark.parametrize(
    ("start", "end", "first", "last"),
    [(None, 2.0, 0.0, 2.0), (0.5, None, 0.5, None), (2.0, None, 2.0, 4.0)],
)
def test_ends_of_the_film(filmed, start, end, first, last):
    """By default shortly after the stop; from after the stop to the end of the run."""
    run = plain_result()
    t = times_of(filmed(run, duration=0.3, fps=10, start=start, end=end))
    assert (t[0], t[-1]) == pytest.approx((first, 1.15 * float(run.stopping_time) if last is None else last))


def test_title_has_the_travel_of_the_hook(filmed):
    """Radius of the drum 0.4 m and 8 lines: 0.05 m for each radian."""
    run = sb.simulate(stop_scene(n=4, beta=60.0, C=None, T0=3e4, load=sb.HookLoad(5e3, 0.4, 8.0), end=1.0))
    for title, _, (at,) in filmed(run, duration=0.4, fps=10, start=0.1, end=0.4):
        assert read(title)[1]["travel"] == pytest.approx(0.05 * float(run.series([at]).phi[0]), abs=1e-4)


def test_animation_writes_every_frame(tmp_path):
    """A GIF counts in hundredths of a second, is shown with 50 of them a second at most, and has two at least."""
    told = []
    for fps, count, shown in ((10, 2, 100), (30, 2, 30), (50, 3, 20)):
        file = tmp_path / "new" / f"{fps}.gif"
        plot.animate(plain_result(), file, duration=0.06, fps=fps, progress=lambda *done: told.append(done))
        with Image.open(file) as image:
            assert (image.n_frames, image.info["duration"], image.info["loop"]) == (count, shown, 0)
        assert told[-count:] == [(i, count) for i in range(1, count + 1)]


@pytest.mark.parametrize(
    ("name", "given", "paths"),
    [
        ("stop.mp4", {}, ["path"]),
        ("stop.gif", {"duration": -1.0, "fps": 0.0}, ["duration", "fps"]),
        ("stop.gif", {"duration": math.inf, "fps": 60.0}, ["duration", "fps"]),
        ("stop.gif", {"duration": 1e4}, ["duration"]),
        ("stop.gif", {"start": -1.0, "end": 9.0}, ["start", "end"]),
        ("stop.gif", {"start": 1.0, "end": 1.0}, ["end"]),
    ],
)
def test_what_makes_no_film(tmp_path, name, given, paths):
    with pytest.raises(sb.InputError) as caught:
        plot.animate(plain_result(), tmp_path / name, **given)
    assert [fault.path for fault in caught.value.faults] == paths
    assert not list(tmp_path.iterdir())
