"""The film of one braking: how fast it runs, what its frames show, what it refuses."""

import dataclasses
import math
import pathlib

import numpy as np
import pytest
from picture_scenes import hot_result, plain_result, staged_result
from PIL import Image
from stop_scenes import stop_scene

import simbrake as sb
from simbrake import plot
from simbrake.plot._animation import Film, Scenery, _numbers, film_of, ticks, words_of_rate


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


# --- times, words and marks -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("rate", "words"),
    [
        (123.4, "slow motion: 123 times slower than the brake"),
        (12.4, "slow motion: 12 times slower than the brake"),
        (2.345, "slow motion: 2.3 times slower than the brake"),
        (1.06, "slow motion: 1.1 times slower than the brake"),
        (1.04, "as fast as the brake"),
        (0.96, "as fast as the brake"),
        (0.94, "1.1 times faster than the brake"),
        (0.04, "25 times faster than the brake"),
    ],
)
def test_words_of_the_rate(rate, words):
    assert words_of_rate(rate) == words


def test_rate_is_that_of_the_part_of_the_film():
    film = Film((1.0, 1.5, 4.5), (0.0, 3.0, 6.0))
    assert [film.rate(t) for t in (0.0, 2.9, 3.1, 6.0)] == pytest.approx([6.0, 6.0, 1.0, 1.0])
    assert film.slow
    assert not Film((1.0, 4.0), (0.0, 6.0)).slow
    assert Film((1.0, 4.0), (0.0, 6.0)).rate(6.0) == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("run", "words"),
    [
        # none shortly before the end of the slow part, none shortly after it
        ((0.0, 0.1, 1.0), "0 ms, 20 ms, 40 ms, 60 ms, 80 ms, 0.2 s, 0.4 s, 0.6 s, 0.8 s, 1 s"),
        ((0.0, 0.19, 1.0), "0 ms, 50 ms, 100 ms, 150 ms, 0.4 s, 0.6 s, 0.8 s, 1 s"),
        ((0.0, 0.8, 8.0), "0 s, 0.2 s, 0.4 s, 0.6 s, 2 s, 4 s, 6 s, 8 s"),
        ((0.0, 1.0), "0 s, 0.2 s, 0.4 s, 0.6 s, 0.8 s, 1 s"),
        ((0.0, 0.6), "0 s, 0.2 s, 0.4 s, 0.6 s"),
    ],
)
def test_ticks_of_the_axis_of_a_film(run, words):
    places = ticks(Film(run, (0.0, 2.7, 6.0) if len(run) == 3 else (0.0, 6.0)))
    assert ", ".join(text for _, text in places) == words
    for t, text in places:
        value, unit = text.split()
        assert t == pytest.approx(float(value) * (1e-3 if unit == "ms" else 1.0))


def test_film_begins_and_ends_where_it_is_asked_to(plain):
    full, stop = float(plain.full_slip_time), float(plain.stopping_time)
    assert film_of(plain, 6.0, None, 2.0).run == pytest.approx((0.0, 1.3 * full, 2.0))
    assert film_of(plain, 6.0, 0.5 * stop, None).run == pytest.approx((0.5 * stop, 1.15 * stop))
    assert film_of(plain, 6.0, 2.0, None).run == pytest.approx((2.0, 4.0))  # after the stop: to the end of the run
    half = 0.5 * full
    assert film_of(plain, 6.0, half, 2.0).run == pytest.approx((half, half + 1.3 * (full - half), 2.0))
    short = film_of(plain, 6.0, 0.0, 4.0 * full)  # the onset is no short part of it
    assert short.run == pytest.approx((0.0, 4.0 * full))
    assert short.film == (0.0, 6.0)
    assert film_of(plain, 6.0, 0.0, 6.0 * full).film == pytest.approx((0.0, 2.7, 6.0))
    with pytest.raises(sb.InputError) as caught:
        film_of(plain, 6.0, -1.0, 9.0)
    assert [fault.path for fault in caught.value.faults] == ["start", "end"]
    with pytest.raises(sb.InputError, match="1 s is not after the start at 1 s"):
        film_of(plain, 6.0, 1.0, 1.0)


def test_numbers_of_a_film_at_their_bounds():
    file = pathlib.Path("stop.GIF")
    assert _numbers(file, 40.0, 50.0) == (40.0, 50.0)
    for duration, fps, paths in (
        (40.1, 50.0, ["duration"]),
        (math.inf, 50.0, ["duration"]),
        (1.0, 50.1, ["fps"]),
        (-1.0, 0.0, ["duration", "fps"]),
        (math.inf, 60.0, ["duration", "fps"]),
    ):
        with pytest.raises(sb.InputError) as caught:
            _numbers(file, duration, fps)
        assert [fault.path for fault in caught.value.faults] == paths


def test_frames_of_a_short_film(plain, tmp_path):
    """At least two frames; a GIF counts in hundredths of a second, and is shown with 50 of them a second at most."""
    for fps, count, shown in ((10, 2, 100), (30, 2, 30), (50, 3, 20)):
        file = plot.animate(plain, tmp_path / f"{fps}.gif", duration=0.06, fps=fps, progress=False)
        with Image.open(file) as image:
            assert (image.n_frames, image.info["duration"]) == (count, shown)
            image.seek(1)


def test_scenery_of_a_staged_brake_says_what_it_shows(staged):
    stop = float(staged.stopping_time)
    film, times = Film((0.0, 0.6, stop), (0.0, 1.0, 2.0)), np.array([0.0, 0.5, 1.0, 1.5, 2.0])
    scenery = Scenery(staged, film, times)
    wheel, speed, tension = scenery.figure.axes
    for i in (1, 3):
        scenery.show(i)
        t = film.run_time(times[i])
        s = staged.series([t])
        first, second, third = scenery.title.get_text().splitlines()
        assert first.split("; ")[0] == f"t = {t:9.4f} s    {words_of_rate([1 / 0.6, 1 / (stop - 0.6)][i // 2])}"
        assert second == f"ω = {s.omega[0]:7.3f} rad/s   φ = {s.phi[0] / (2 * math.pi):7.4f} turns"
        torque = s.brake_torque[0] / 1e3
        ends = f"T₀ = {s.slack_tension[0] / 1e3:7.2f} kN   Tₙ = {s.tight_tension[0] / 1e3:7.2f} kN"
        assert third == f"{ends}   brake torque {torque:7.2f} kN·m"
        # the bandage has turned by the integral of its speed
        grid = np.linspace(0.0, t, 20001)
        turned = np.trapezoid(staged.series(grid).bandage_speed, grid)
        x, y = (np.asarray(v)[0] for v in scenery.ride.get_data())
        assert math.hypot(x, y) == pytest.approx(1.10)
        assert math.remainder(math.atan2(y, x) - math.pi / 2 - turned, 2 * math.pi) == pytest.approx(0.0, abs=1e-3)
        assert [cursor.get_xdata() for cursor in scenery.cursors] == [[pytest.approx(t)] * 2] * 2
        for k, spoke in enumerate(scenery.spokes):
            x, y = spoke.get_data()
            assert np.hypot(x, y) == pytest.approx([0.1, 0.85])
            apart = np.arctan2(y, x) - math.pi / 2 - float(s.phi[0]) - 2 * math.pi * k / 3
            np.testing.assert_allclose([math.remainder(a, 2 * math.pi) for a in apart], 0.0, atol=1e-9)
        assert np.hypot(*scenery.mark.get_data()) == pytest.approx(0.7)
    for panel, curves in (
        (speed, {r"pulley $\omega$": ("omega", 1.0), r"bandage $\omega_b$": ("bandage_speed", 1.0)}),
        (tension, {"tight end $T_n$": ("tight_tension", 1e-3), "slack end $T_0$": ("slack_tension", 1e-3)}),
    ):
        assert [text.get_text() for text in panel.get_legend().get_texts()] == list(curves)
        for line in panel.lines:
            if line.get_label() in curves:
                column, factor = curves[line.get_label()]
                t, drawn = line.get_data()
                apart = np.min(np.abs(np.subtract.outer(t, [e.time for e in staged.events])), axis=1) > 1e-9
                values = np.asarray(getattr(staged.series(t), column))
                np.testing.assert_allclose(drawn[apart], factor * values[apart], rtol=1e-9, atol=1e-12)
                assert (t[0], t[-1]) == pytest.approx((0.0, stop))
        assert panel.get_xlim() == pytest.approx((0.0, stop))
        (slow,) = panel.patches
        assert slow.get_extents().transformed(panel.transData.inverted()).intervalx == pytest.approx([0.0, 0.6])
        # the axis runs as the film does: half of it for the first 0.6 s
        assert panel.transAxes.inverted().transform(panel.transData.transform((0.6, 0.0)))[0] == pytest.approx(0.5)
    assert [panel.get_ylabel() for panel in (speed, tension)] == ["speed,\nrad/s", "tension,\nkN"]
    assert [text.get_text() for text in speed.texts] == ["slow motion"]
    (legend,) = scenery.figure.legends
    words = [text.get_text() for text in legend.get_texts()]
    assert words[-2:] == ["mark on the bandage", "mark on the pulley"]
    assert legend.get_title().get_text() == "outer half of a lining: band on lining; inner half: lining on rim"
    ends = [text.get_text() for text in wheel.texts]
    assert ends == ["slack end\n(lever)", "tight end\n(anchor)"]


def test_scenery_of_an_even_film_and_of_surfaces(plain, hot):
    stop = float(plain.stopping_time)
    even = Scenery(plain, Film((0.0, stop), (0.0, 2.0)), np.array([0.0, 1.0]))
    _, speed, _ = even.figure.axes
    assert not speed.texts
    assert not speed.patches
    assert speed.get_legend() is None
    assert even.ride is None
    assert [text.get_text() for text in even.figure.legends[0].get_texts()][-1] == "mark on the pulley"
    assert even.figure.legends[0].get_title().get_text() in ("", "None")
    # surfaces: one scale for all frames, the rim at its hottest place
    times = np.array([0.0, 1.0, 2.0])
    film = film_of(hot, 2.0, None, None)
    scenery = Scenery(hot, film, times)
    s = hot.series(film.run_time(times))
    linings, rim = np.asarray(s.lining_temperature) - 273.15, np.asarray(s.rim_temperature) - 273.15
    assert scenery.norm.vmin == pytest.approx(min(linings.min(), rim.min()))
    assert scenery.norm.vmax == pytest.approx(max(linings.max(), rim.max()))
    scenery.show(1)
    assert scenery.rim.get_facecolor() == pytest.approx(scenery.colours.to_rgba(rim[1].max()))
    for wedge, T in zip(scenery.hot, linings[1], strict=True):
        assert wedge.get_facecolor() == pytest.approx(scenery.colours.to_rgba(T))
    label = "surface temperature, °C\n(outer ring: linings, inner ring: rim)"
    assert scenery.figure.axes[3].get_ylabel() == label
    still = Scenery(hot, Film((0.0, 1e-9), (0.0, 2.0)), np.array([0.0, 0.0]))
    assert (still.norm.vmin, still.norm.vmax) == pytest.approx((20.0, 21.0))


def test_spokes_vanish_before_the_mark_does(plain):
    """Between two frames the pulley turns by 1.5 to 2 rad: too much for three spokes, not for one mark."""
    film = Film((0.0, float(plain.stopping_time)), (0.0, 2.0))
    scenery = Scenery(plain, film, film.film_time(np.array([0.1, 0.2, 0.3])))
    scenery.show(1)
    assert (scenery.spokes[0].get_alpha(), scenery.mark.get_alpha()) == (0.0, 1.0)
    assert "too fast to show" not in scenery.title.get_text()


def test_title_says_how_far_the_hook_has_travelled():
    """Radius of the drum 0.4 m and 8 lines: 0.05 m for each radian."""
    scene = stop_scene(n=4, beta=60.0, C=None, T0=3e4, load=sb.HookLoad(5e3, 0.4, 8.0), end=1.0)
    run = sb.simulate(scene)
    film = Film((0.0, 1.0), (0.0, 1.0))
    scenery = Scenery(run, film, np.array([0.0, 0.1, 0.2]))
    scenery.show(2)
    phi = float(run.series([0.2]).phi[0])
    assert scenery.title.get_text().splitlines()[1].endswith(f"turns   hook travel {0.05 * phi:7.4f} m")


def test_film_of_two_stops_ends_after_the_first_one():
    """A run from 5 s on, released at 7 s and braked again at 8 s: times are counted from its start."""
    load = sb.TorqueLoad(sb.PiecewiseLinear([0.0, 99.0], [2e3, 2e3]))
    lever = sb.PiecewiseLinear([7.0, 7.0, 8.0, 8.0], [8e3, 0.0, 0.0, 8e3])
    scene = stop_scene(n=4, beta=60.0, C=None, lever=lever, load=load, end=12.0)
    run = sb.simulate(dataclasses.replace(scene, initial=sb.Initial(20.0, time=5.0)))
    first = float(run.stops["time"][0])
    assert film_of(run, 6.0, None, None).run == pytest.approx((5.0, 5.0 + 1.15 * (first - 5.0)))
    assert film_of(run, 6.0, 7.9, 12.0).run == pytest.approx((7.9, 8.03, 12.0))


def test_frames_are_in_the_order_of_time(plain, tmp_path, monkeypatch):
    seen, show = [], Scenery.show
    monkeypatch.setattr(Scenery, "show", lambda self, i: (seen.append(self.times[i]), show(self, i)))
    plot.animate(plain, tmp_path / "stop.gif", duration=0.4, fps=10, progress=False)
    np.testing.assert_allclose(seen, np.linspace(0.0, 0.4, 4))
