"""The film of one braking: how fast it runs, what its frames show, what it refuses."""

import math

import numpy as np
import pytest
from picture_scenes import hot_result, plain_result, staged_result
from PIL import Image

import simbrake as sb
from simbrake import plot
from simbrake.plot._animation import Scenery, film_of, ticks, words_of_rate


@pytest.fixture(scope="module")
def plain():
    return plain_result()


@pytest.fixture(scope="module")
def staged():
    return staged_result()


@pytest.fixture(scope="module")
def hot():
    return hot_result()


def test_film_is_slow_where_slip_begins(plain):
    film = film_of(plain, 6.0, None, None)
    full, stop = float(plain.full_slip_time), float(plain.stopping_time)
    assert film.run == pytest.approx((0.0, 1.3 * full, 1.15 * stop))
    assert film.run_time(0.45 * 6.0) == pytest.approx(1.3 * full)
    at = np.linspace(0.0, 6.0, 50)
    np.testing.assert_allclose(film.film_time(film.run_time(at)), at, atol=1e-12)
    assert film.rate(0.1) == pytest.approx(2.7 / (1.3 * full))
    assert words_of_rate(film.rate(0.1)).startswith("slow motion")
    assert words_of_rate(0.01) == "100 times faster than the brake"
    places = ticks(film)
    assert all(0 <= t <= film.run[-1] for t, _ in places)
    assert {words.split()[1] for _, words in places} == {"ms", "s"}
    for t, words in places:
        value, unit = words.split()
        assert unit == ("ms" if t < film.run[1] else "s")
        assert float(value) * (1e-3 if unit == "ms" else 1.0) == pytest.approx(t)
    # a window without an onset of slip runs evenly
    assert film_of(plain, 6.0, 0.5 * stop, 0.8 * stop).run == pytest.approx((0.5 * stop, 0.8 * stop))


@pytest.mark.parametrize("name", ["staged", "hot"])
def test_film_shows_the_run(name, request):
    result = request.getfixturevalue(name)
    times = np.linspace(0.0, 2.0, 9)
    film = film_of(result, 2.0, None, None)
    scenery = Scenery(result, film, times)
    for i in (1, 4, 8):
        scenery.show(i)
        t = film.run_time(times[i])
        s = result.series([t])
        x, y = (np.asarray(v)[0] for v in scenery.mark.get_data())
        phi = math.atan2(y, x) - math.pi / 2
        assert math.remainder(phi - float(s.phi[0]), 2 * math.pi) == pytest.approx(0.0, abs=1e-9)
        assert scenery.cursors[0].get_xdata()[0] == pytest.approx(t)
        _, _, clock, unit, *_ = scenery.title.get_text().split()
        assert unit == ("ms" if film.slow and t < film.run[1] < 0.5 else "s")
        assert float(clock) * (1e-3 if unit == "ms" else 1.0) == pytest.approx(t, abs=1e-4)
        if name == "hot":
            coldest, hottest = (float(f(s.lining_temperature)) - 273.15 for f in (np.min, np.max))
            assert scenery.hot[int(np.argmax(s.lining_temperature))].get_facecolor() == pytest.approx(
                scenery.colours.to_rgba(hottest)
            )
            assert scenery.norm.vmin <= coldest
        else:
            assert "internal" in scenery.wedges
    assert len(scenery.wedges["external"]) == result.scene.brake.linings.count


def test_spokes_vanish_where_the_film_cannot_follow(plain):
    film = film_of(plain, 2.0, 0.0, float(plain.stopping_time))
    coarse = Scenery(plain, film, np.linspace(0.0, 2.0, 4))
    coarse.show(2)
    assert coarse.mark.get_alpha() == 0.0
    assert "too fast to show" in coarse.title.get_text()
    coarse.show(0)
    fine = Scenery(plain, film, np.linspace(0.0, 2.0, 400))
    fine.show(390)
    assert fine.spokes[0].get_alpha() == fine.mark.get_alpha() == 1.0


def test_animation_writes_every_frame(plain, tmp_path):
    told = []
    file = plot.animate(
        plain, tmp_path / "new" / "stop.gif", duration=0.5, fps=10, progress=lambda *done: told.append(done)
    )
    with Image.open(file) as image:
        assert image.n_frames == 5
        assert image.info["duration"] == 100
        assert image.info["loop"] == 0
    assert told == [(i, 5) for i in range(1, 6)]
    assert [p.name for p in tmp_path.iterdir()] == ["new"]


def test_animation_refuses_what_makes_no_film(plain, tmp_path):
    for name, given, words in (
        ("stop.mp4", {}, r"let it end in \.gif"),
        ("stop.gif", {"duration": 0.0}, "duration"),
        ("stop.gif", {"fps": 100}, "up to 50"),
        ("stop.gif", {"duration": 1e4}, "frames"),
        ("stop.gif", {"start": -1.0}, "outside the run"),
        ("stop.gif", {"start": 1.0, "end": 0.5}, "not after the start"),
    ):
        with pytest.raises(sb.InputError, match=words):
            plot.animate(plain, tmp_path / name, **given)
    assert not list(tmp_path.iterdir())
