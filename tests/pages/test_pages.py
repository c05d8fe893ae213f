"""Report, publication and app in a browser at 1280 and 400 px: what is read from the page is the run.

Chromium by Playwright where both are installed; elsewhere the data of the pages is tested without, which the end of the
test run says loudly (`conftest.py`).
"""

import base64
import dataclasses
import html
import http.client
import json
import math
import re
import threading
import time

import numpy as np
import pytest
from browsers import browser_path, chromium
from disc_scenes import disc_scene
from helpers import Waiting
from stop_scenes import stop_scene

import simbrake as sb
from simbrake._commands import _runs
from simbrake._pages import _app, _live, _publish
from simbrake._run._linings import look

NASTY = "</script><img src=x onerror=\"document.title='run'\">"
SIZES = {"wide": (1280, 900), "phone": (400, 800)}


@pytest.fixture(scope="module")
def browser():
    """A headless browser, `None` where there is none."""
    if browser_path() is None:
        yield None
        return
    with chromium() as found:
        yield found


def opened(browser, address, size="wide", **options):
    """A page that must not report errors, fits the width of its window, and asks for nothing elsewhere."""
    width, height = SIZES[size]
    page = browser.new_page(viewport={"width": width, "height": height}, **options)
    page.problems = []
    page.on("pageerror", lambda error: page.problems.append(str(error)))
    asked = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto(address)
    assert page.problems == []
    assert all(url.startswith((address.rpartition("/")[0], "data:")) or url.endswith("/favicon.ico") for url in asked)
    if options.get("java_script_enabled", True):
        assert page.evaluate("document.documentElement.scrollWidth") <= width
    return page


def data_of(text):
    (found,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', text, re.S)
    return json.loads(found)


def number(text):
    return float(text.replace("−", "-").split()[0])


def legend(page, chart):
    """Time and values at the cursor of a chart."""
    values = page.locator(f'[data-chart="{chart}"] .u-value').all_inner_texts()
    return [number(value) for value in values]


# --- report -----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def scene():
    return stop_scene(load=300.0, T0=8e3)


@pytest.fixture(scope="module")
def run(scene):
    return sb.simulate(scene)


@pytest.fixture(scope="module")
def report(run, tmp_path_factory):
    file = tmp_path_factory.mktemp("pages") / "run.html"
    text = sb.report(run, file, check=False, title=f"A stop {NASTY}", limits={"max_tension": "30 kN"})
    return file, text


def test_curves_and_film_of_the_page_are_those_of_the_run(run, report):
    data = data_of(report[1])["run"]
    titles = [chart["title"] for chart in data["charts"]]
    assert titles[:3] == ["Speed", "Torque", "Tension of the band"]
    t = np.asarray(data["t"])
    inside = np.min(np.abs(t[:, None] - [event.time for event in run.events]), axis=1) > 1e-6
    s = run.series(t[inside])
    np.testing.assert_allclose(np.asarray(data["y"][0][0])[inside], s.omega, rtol=1e-6, atol=1e-5)
    np.testing.assert_allclose(
        np.asarray(data["y"][1])[:, inside], np.stack([s.brake_torque, s.load_torque]) / 1e3, 1e-4
    )
    np.testing.assert_allclose(np.asarray(data["y"][2][0])[inside], np.asarray(s.tight_tension) / 1e3, rtol=1e-4)
    film = data["film"]
    p = look(run, film["t"][50:60])
    np.testing.assert_allclose(np.asarray(film["tension"])[50:60, 1:], np.asarray(p.shown.tension) / 1e3, rtol=1e-4)
    np.testing.assert_allclose(film["pairs"][0]["load"][50], np.asarray(p.shown.pairs[0].normal[0]) / 1e3, rtol=1e-4)
    np.testing.assert_allclose(film["phi"][50:60], p.y.phi, rtol=1e-4)
    assert len(film["pairs"][0]["contacts"][50]) == run.scene.brake.linings.count
    stop, slip = run.metrics["stopping_time"], run.metrics["full_slip_time"]
    assert [(window["words"], window["start"], window["end"]) for window in data["windows"]] == [
        ("until rest", 0.0, pytest.approx(1.15 * stop)),
        ("up to full slip, enlarged", 0.0, pytest.approx(1.3 * slip)),
        ("whole run", 0.0, 5.0),
    ]
    assert (film["hook"], film["heat"], film["seconds"]) == (None, None, 8.0)
    slow, fast = film["rates"]
    assert fast["until"] == 8.0
    for one, low, high, begin in ((slow, 0.0, 1.3 * slip, 0.0), (fast, 1.3 * slip, 1.15 * stop, slow["until"])):
        rate = float(re.search(r"slow motion: (\S+) times", one["words"])[1])
        assert rate == pytest.approx((one["until"] - begin) / (high - low), rel=0.05)
    marked = {event["words"]: event["t"] for event in data["events"]}
    assert marked["stop"] == run.metrics["stopping_time"]


def test_curves_of_temperature_are_named_after_the_body():
    heat = sb.Heat(
        (sb.thermal.Lump("metal", 2e5), sb.thermal.Lump("linings", 5e3)),
        friction=sb.thermal.FrictionHeat("metal", "linings", sb.thermal.ConstantPartition(0.9)),
        linings="linings",
        rim="metal",
    )
    hook = sb.HookLoad(1e3, 0.4, 8)
    for scene, body, lining in ((stop_scene(n=3, load=hook), "rim", "lining"), (disc_scene(), "disc", "pad")):
        result = sb.simulate(dataclasses.replace(scene, heat=heat))
        charts = {chart.title: chart for chart in _live.charts_of(result.scene, result.series([0.1]))}
        named = [line.label for line in charts["Surface temperature"].lines]
        assert named == [f"hottest {body}", f"hottest {lining}"]
        film = _live.film(result, 5)
        s = result.series(film["t"])
        linings, rim = (np.asarray(x) - 273.15 for x in (s.lining_temperature, s.rim_temperature))
        np.testing.assert_allclose(film["heat"]["linings"], linings, rtol=1e-4)
        np.testing.assert_allclose(film["heat"]["rim"], rim.max(axis=1), rtol=1e-4)
        low, high = min(linings.min(), rim.min()), max(linings.max(), rim.max())
        assert (film["heat"]["low"], film["heat"]["high"]) == pytest.approx((low, max(high, low + 1.0)), rel=1e-4)
        assert (film["tension"] is None) == (film["hook"] is None) == (lining == "pad")
        if film["hook"]:
            np.testing.assert_allclose(film["hook"], np.asarray(film["phi"]) * 0.4 / 8, rtol=1e-5)


@pytest.mark.parametrize(("omega", "begins"), [(17.0, 17.0), (23.0, 23.0), (10.0, 20.0), (25.0, 20.0)])
def test_a_published_slider_begins_at_the_value_of_the_scene(omega, begins):
    """At the middle of its values where that of the scene is outside of them."""
    axis = _publish.Axis("initial.omega", (16.0, 20.0, 24.0))
    assert _publish._slider(stop_scene(w0=omega), axis)["value"] == begins


def test_numbers_are_rounded_to_seven_digits():
    values = [0.0, 1.23456789e-7, -9.87654321e9, math.inf, 3.0]
    assert _live.rounded(values) == [0.0, 1.234568e-7, -9.876543e9, None, 3.0]


def test_first_and_last_sections(report):
    text = report[1]
    order = [text.index(f'id="{name}"') for name in ("banner", "pictures", "events", "limits", "duty", "equipment")]
    assert order == sorted(order)
    assert "Holding reserve (static capacity over load)" in text[: text.index('id="figures"')]
    assert '<div class="verdict red"' in text


@pytest.mark.parametrize("size", SIZES)
def test_hovering_shows_the_values_of_the_series(browser, run, report, size):
    if browser is None:
        return
    page = opened(browser, report[0].as_uri(), size)
    for place in (0.06, 0.1, 0.55):
        area = page.locator('[data-chart="Torque"] .u-over')
        area.scroll_into_view_if_needed()
        box = area.bounding_box()
        page.mouse.move(box["x"] + place * box["width"], box["y"] + 20)
        page.wait_for_timeout(100)
        t, brake, load = legend(page, "Torque")
        s = run.series([t])
        assert 0 < t < 5.0
        assert brake == pytest.approx(float(s.brake_torque[0]) / 1e3, rel=1e-4)
        assert load == pytest.approx(float(s.load_torque[0]) / 1e3, rel=1e-4)
        assert legend(page, "Speed")[0] == t  # one cursor in all charts
        assert legend(page, "Speed")[1] == pytest.approx(float(s.omega[0]), rel=1e-4, abs=1e-4)
        film = float(re.search(r"t = (\S+) s", page.inner_text("#now"))[1])
        assert film == pytest.approx(min(t, 1.15 * run.metrics["stopping_time"]), abs=0.02)  # the film follows
    page.close()


def test_zooming_one_chart_zooms_all(browser, run, report):
    if browser is None:
        return
    page = opened(browser, report[0].as_uri())
    area = page.locator('[data-chart="Speed"] .u-over')
    area.scroll_into_view_if_needed()

    def ends_at(t):
        """Whether the right edge of another chart comes to be at the time t: charts are drawn a moment later."""
        box = area.bounding_box()
        for i in range(50):
            page.mouse.move(box["x"] + box["width"] - 1 - i % 2, box["y"] + 20)
            page.wait_for_timeout(40)
            if legend(page, "Torque")[0] == pytest.approx(t, rel=0.03):
                return True
        return False

    end = 1.3 * run.metrics["full_slip_time"]
    assert ends_at(1.15 * run.metrics["stopping_time"])
    page.get_by_role("button", name="whole run").click()
    assert ends_at(5.0)
    page.get_by_role("button", name="up to full slip, enlarged").click()
    assert ends_at(end)
    box = area.bounding_box()
    page.mouse.move(box["x"] + 0.25 * box["width"], box["y"] + 20)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 20, steps=5)
    page.mouse.up()
    assert ends_at(0.5 * end)
    page.mouse.dblclick(box["x"] + 50, box["y"] + 20)
    assert ends_at(5.0)
    page.close()


@pytest.mark.parametrize("size", SIZES)
def test_film_plays_steps_and_scrubs(browser, run, report, size):
    if browser is None:
        return
    film = data_of(report[1])["run"]["film"]
    page = opened(browser, report[0].as_uri(), size)
    page.locator("#at").fill("100")
    for step, moment in (("#forth", 101), ("#forth", 102), ("#back", 101)):
        page.click(step)
        assert float(re.search(r"t = (\S+) s", page.inner_text("#now"))[1]) == pytest.approx(
            film["t"][moment], rel=1e-5
        )
    angle = float(re.search(r"rotate\((\S+)\)", page.get_attribute(".turning", "transform"))[1])
    assert math.remainder(angle + math.degrees(film["phi"][101]), 360.0) == pytest.approx(0.0, abs=1e-2)
    page.locator('.lining[data-lining="4"]').hover(force=True)
    said = page.inner_text("#looked")
    assert f"N = {film['pairs'][0]['load'][101][4]:.5g} kN" in said
    assert f"T behind it {film['tension'][101][5]:.5g} kN" in said
    page.click("#play")
    page.wait_for_timeout(300)
    page.click("#play")
    assert int(page.input_value("#at")) > 101
    page.close()


def test_still_figures_without_scripts_and_on_paper(browser, report):
    static = re.findall(r'<figure id="picture-(\w+)" class="static">', report[1])
    assert static == ["stop", "pulley"]
    if browser is None:
        return
    page = opened(browser, report[0].as_uri(), java_script_enabled=False)
    assert page.locator("#picture-stop img").is_visible()
    assert not page.locator("#film").is_visible()
    page.close()
    page = opened(browser, report[0].as_uri())
    assert page.locator("#film").is_visible()
    assert not page.locator("#picture-stop").is_visible()
    page.emulate_media(media="print")
    assert page.locator("#picture-stop img").is_visible()
    assert not page.locator("#charts").is_visible()
    page.close()


def test_texts_of_people_never_run(browser, report):
    assert NASTY not in report[1]
    assert _live.embedded({"a": NASTY + "\u2028&"}).count("<") == 0
    assert json.loads(_live.embedded({"a": NASTY + "\u2028&"}))["a"] == NASTY + "\u2028&"
    if browser is None:
        return
    page = opened(browser, report[0].as_uri())
    assert page.title() != "run"
    assert page.inner_text("h1") == f"A stop {NASTY}"
    # the policy of the page refuses a script that is not its own
    page.evaluate("() => { const s = document.createElement('script'); s.textContent = 'window.ran = 1'; "
                  "document.body.append(s); }")  # fmt: skip
    assert page.evaluate("window.ran") is None
    page.close()


def test_animate_writes_a_page(tmp_path, monkeypatch):
    (tmp_path / "scene.py").write_text(
        '"""A film."""\nfrom stop_scenes import stop_scene\nscene = lambda: stop_scene(load=300.0, T0=8e3)\n'
    )
    assert _runs.animate(tmp_path / "scene.py", tmp_path / "film.html", duration=2.0, fps=10, end=1.0) == 0
    film = data_of((tmp_path / "film.html").read_text("utf-8"))["run"]["film"]
    assert len(film["t"]) == 20
    assert film["t"][-1] == 1.0
    assert film["seconds"] == 2.0


# --- publication ------------------------------------------------------------------------------------------------------


def test_hermite_is_exact_where_its_docs_say():
    """Cubics along one axis, quadratics in a cell of three; corners with all derivatives."""
    cubic = lambda x: np.asarray([[2 - x + 3 * x**2 - 0.5 * x**3], [-1 + 6 * x - 1.5 * x**2]])  # noqa: E731
    for s in (0.0, 0.3, 1.0):
        found = _publish.between(np.stack([cubic(1.0), cubic(3.0)]), [s], [2.0])
        assert found[0] == pytest.approx(cubic(1.0 + 2.0 * s)[0, 0], rel=1e-13)
    A = np.asarray([[1.0, 0.4, -0.7], [0.4, -2.0, 0.3], [-0.7, 0.3, 0.5]])
    quadratic = lambda x: np.concatenate([[[0.5 * x @ A @ x + x @ [1, 2, 3]]], (A @ x + [1, 2, 3])[:, None]])  # noqa: E731
    widths, shares = np.asarray([0.5, 2.0, 1.0]), np.asarray([0.2, 0.7, 0.45])
    corners = np.stack([quadratic(widths * step) for step in np.ndindex(2, 2, 2)])
    assert _publish.between(corners, shares, widths)[0] == pytest.approx(quadratic(shares * widths)[0, 0], rel=1e-12)


@pytest.fixture(scope="module")
def published(scene, tmp_path_factory):
    """Speed and load; the brake gives 24.6 kN·m, so that it cannot stop the largest load."""
    file = tmp_path_factory.mktemp("published") / "sliders.html"
    axes = _publish.read_axes(scene, ["initial.omega=16:24:3", "duty.load.profile.level=200 N*m:30 kN*m:4"])
    told = Waiting("publish", "x", False)
    about = _publish.publish(scene, axes, file, limits={"stopping_time": 8.0}, title=NASTY, told=told)
    return file, data_of(file.read_text("utf-8")), about


def rows_of(grid, point):
    """Values and derivatives at a solved point."""
    numbers = np.frombuffer(base64.b64decode(grid["numbers"]), "<f4")
    about = grid["points"][point]
    size = grid["sequences"][about["sequence"]]["size"]
    return numbers[about["start"] : about["start"] + (1 + len(grid["axes"])) * size].reshape(-1, size)


def test_solved_points_are_runs_with_their_derivatives(scene, published):
    grid = published[1]["grid"]
    rows, name = rows_of(grid, 4), "Stopping time"  # the second speed, the smallest load
    at = [metric["words"] for metric in grid["metrics"]].index(name)
    w, load, h = 20.0, 200.0, 1e-4

    def stop(w, load):
        changed = {"initial.omega": w, "duty.load.profile.level": load}
        return sb.simulate(sb.with_values(scene, changed), rtol=1e-12).metrics["stopping_time"]

    assert rows[0, at] == pytest.approx(stop(w, load), rel=1e-7)
    by_speed = (stop(w * (1 + h), load) - stop(w * (1 - h), load)) / (2 * h * w)
    by_load = (stop(w, load * (1 + h)) - stop(w, load * (1 - h))) / (2 * h * load)
    assert rows[1:, at] == pytest.approx([by_speed, by_load], rel=1e-5)
    # speeds at fixed shares of the way from event to event
    sequence, m = grid["sequences"][grid["points"][4]["sequence"]], grid["samples"]
    first = len(grid["metrics"])
    edges, k = rows[0, first : first + sequence["pieces"] + 1], m // 2
    t = edges[1] + (edges[2] - edges[1]) * k / (m - 1)
    speed = rows[0, first + sequence["pieces"] + 1 + m + k]
    run = sb.simulate(sb.with_values(scene, {"initial.omega": w, "duty.load.profile.level": load}))
    assert speed == pytest.approx(float(run.series([t]).omega[0]), rel=1e-5)


def test_gaps_are_where_the_sequence_changes(published):
    file, data, about = published
    grid = data["grid"]
    status = [grid["sequences"][point["sequence"]]["status"] for point in grid["points"]]
    assert status[0] == "Stopped"
    assert status[3] == "Runaway"
    for cell in range(6):
        i, j = divmod(cell, 3)
        corners = {grid["points"][4 * (i + a) + j + b]["sequence"] for a in (0, 1) for b in (0, 1)}
        assert len(corners) == 1 or cell in grid["gaps"]
    assert 0 < about.gaps == len(grid["gaps"]) < about.cells == 6
    assert about.points == 12
    assert file.stat().st_size < 5e6
    assert NASTY not in file.read_text("utf-8")


@pytest.mark.parametrize("size", SIZES)
def test_sliders_show_the_run_and_the_gap(browser, scene, published, size):
    if browser is None:
        return
    page = opened(browser, published[0].as_uri(), size)
    fields = [
        page.locator(f'[data-path="{path}"] input[type=text]') for path in ("initial.omega", "duty.load.profile.level")
    ]

    def put(*values):
        for field, value in zip(fields, values, strict=True):
            field.fill(str(value))
            field.dispatch_event("change")

    def metrics():
        names, values = page.locator("#figures dt").all_inner_texts(), page.locator("#figures data")
        return dict(zip(names, [float(one.get_attribute("value")) for one in values.all()], strict=True))

    unit = published[1]["grid"]["axes"][1]["factor"]
    for w, load, rel in ((20.0, 200.0, 1e-6), (22.0, 200.0, 1e-3)):
        put(w, load * unit)
        true = sb.simulate(sb.with_values(scene, {"initial.omega": w, "duty.load.profile.level": load})).metrics
        for words, name in (("Stopping time", "stopping_time"), ("Full slip t₁", "full_slip_time")):
            assert metrics()[words] == pytest.approx(true[name], rel=rel)
    gap = published[1]["grid"]["gaps"][0]
    low, high = (published[1]["grid"]["axes"][1]["values"][gap % 3 + k] for k in (0, 1))
    put(18.0, 0.5 * (low + high) * unit)
    assert page.inner_text("#banner b") == "No value here"
    assert "Gap" in page.inner_text("#state")
    assert page.evaluate("document.body.classList.contains('gap')")
    assert "var(--gap)" in page.locator('[data-path="duty.load.profile.level"] input[type=range]').get_attribute(
        "style"
    )
    put(18.0, 200.0 * unit)
    assert page.inner_text("#banner b") == "Stopped"
    assert page.inner_text("#state") == ""
    assert page.problems == []
    page.close()


def test_all_errors_of_the_axes_at_once(scene):
    texts = ["initial.omega=3:2:4", "initial.omega=1:2", "nix=1:2:3", "duty.load.profile.level=1 kg:2:3"]
    with pytest.raises(sb.InputError) as caught:
        _publish.read_axes(scene, texts)
    assert len(caught.value.faults) == 5
    with pytest.raises(sb.InputError, match="up to 4000"):
        _publish.read_axes(scene, ["initial.omega=1:2:5000"])
    with pytest.raises(sb.InputError, match="--vary: is missing"):
        _publish.read_axes(scene, [])


# --- app --------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def server(scene):
    found = _app.Server(_app.App(scene, {"max_tension": 1e5}, f"An app {NASTY}"))
    thread = threading.Thread(target=found.serve_forever, daemon=True)
    thread.start()
    yield found
    found.shutdown()
    found.server_close()
    thread.join()


def ask(server, path, values=None, **headers):
    """Code and text of an answer."""
    link = http.client.HTTPConnection("127.0.0.1", server.server_port)
    body = None if values is None else json.dumps({"values": values})
    headers = {"Content-Type": "application/json"} | {name.replace("_", "-"): text for name, text in headers.items()}
    link.request("GET" if values is None else "POST", path, body, headers)
    answer = link.getresponse()
    found = answer.status, answer.read().decode()
    link.close()
    return found


def test_only_this_computer_with_the_token(server):
    place = f"/{server.token}/"
    assert server.server_address[0] == "127.0.0.1"
    assert len(server.token) >= 32
    code, text = ask(server, place)
    assert code == 200
    assert "connect-src 'self'" in html.unescape(text)
    assert NASTY not in text
    refused = [
        ask(server, "/")[0],
        ask(server, f"/{server.token[:-1]}/")[0],
        ask(server, place + "run/../..")[0],
        ask(server, place, Host=f"evil.example:{server.server_port}")[0],
        ask(server, place, Host="127.0.0.1")[0],
        ask(server, place + "run", {}, Origin="http://evil.example")[0],
        ask(server, place + "run", {}, Content_Type="text/plain")[0],
        ask(server, place + "run", {"nix": 1.0})[0],
        ask(server, place + "run", {"initial.omega": "20"})[0],
        ask(server, place + "nix", {})[0],
    ]
    assert refused == [404, 404, 404, 403, 403, 403, 400, 400, 400, 404]


def answers(server, values):
    return [json.loads(line) for line in ask(server, f"/{server.token}/run", values)[1].splitlines()]


def test_a_move_is_a_run(server, scene):
    found = answers(server, {"initial.omega": 15.0})[-1]
    run = sb.simulate(sb.with_values(scene, {"initial.omega": 15.0}))
    values = {one["words"]: float(one["si"]) for one in found["results"]["metrics"]}
    assert values["Stopping time"] == run.metrics["stopping_time"]
    assert values["Maximum tension of the band"] == run.metrics["max_tension"]
    assert found["results"]["colour"] == "amber"  # no limit of the band or the linings is given
    assert found["run"]["y"][0][0][0] == 15.0
    wrong = answers(server, {"brake.pulley.inertia": -1.0})[-1]["problem"]
    assert "brake.pulley.inertia" in wrong
    text = json.loads(ask(server, f"/{server.token}/scene", {"initial.omega": 15.0})[1])["text"]
    assert sb.files.scene_from_text(text).initial.omega == 15.0


def test_every_parameter_has_a_slider_within_its_range(scene):
    controls = {one["path"]: one for one in _app.sliders(scene)}
    leaves = {leaf.path: leaf for leaf in sb.files.leaves(scene)}
    assert {path.partition("[")[0] for path in controls} == set(leaves)
    for path, one in controls.items():
        about = leaves[path.partition("[")[0]].about
        assert one["low"] <= one["value"] <= one["high"]
        assert one["low"] < one["high"]
        assert about.low is None or one["low"] >= about.low
        assert about.high is None or one["high"] <= about.high
    assert controls["initial.omega"]["unit"] == "rad/s"


def test_the_latest_move_wins_and_progress_is_shown(scene, monkeypatch):
    """Three moves while the first runs: it ends early, the second never begins, the third is answered."""
    app, begun, ran = _app.App(scene, {}, ""), threading.Event(), []
    real = sb.simulate

    def slow(scene, progress, **options):
        ran.append(float(scene.initial.omega))
        progress(2.0, 5.0)
        begun.set()
        while ran[-1] == 1.0 and app._latest < 3:
            time.sleep(0.02)
        progress(3.0, 5.0)
        return real(scene, **options)

    monkeypatch.setattr(_app, "simulate", slow)
    found = {}
    moves = [
        threading.Thread(target=lambda w=w: found.update({w: list(app.answers({"initial.omega": w}))}))
        for w in (1.0, 2.0, 3.0)
    ]
    moves[0].start()
    begun.wait(10)
    time.sleep(0.5)
    for move in moves[1:]:
        move.start()
        time.sleep(0.1)
    for move in moves:
        move.join(60)
    assert found[1.0][-1] == found[2.0][-1] == {"superseded": True}
    assert found[1.0][0] == {"progress": 0.4}
    assert "results" in found[3.0][-1]
    assert ran == [1.0, 3.0]


@pytest.mark.parametrize("size", SIZES)
def test_a_slider_of_the_app_moves_metrics_and_pictures(browser, server, scene, size):
    if browser is None:
        return
    from playwright.sync_api import expect

    page = opened(browser, server.address, size)
    assert page.title() != "run"
    if size == "phone":
        page.locator("summary", has_text="initial").click()
    page.fill("#find", "omega")
    assert page.locator(".control:visible").count() == 1
    page.locator('[data-path="initial.omega"] input[type=range]').fill("700")
    expect(page.locator("#state")).to_have_text(re.compile("drawn after"), timeout=30_000)
    control = next(one for one in _app.sliders(scene) if one["path"] == "initial.omega")
    w = control["low"] + 0.7 * (control["high"] - control["low"])
    run = sb.simulate(sb.with_values(scene, {"initial.omega": w}))
    expect(page.locator("#figures")).to_contain_text(f"{run.metrics['stopping_time']:.5g} s", timeout=30_000)
    page.fill("#find", "")
    with page.expect_download() as download:
        page.click("#save")
    saved = sb.read_scene(download.value.path())
    assert float(saved.initial.omega) == pytest.approx(w, rel=1e-12)
    page.click("#reset")
    expect(page.locator("#figures")).to_contain_text(
        f"{sb.simulate(scene).metrics['stopping_time']:.5g} s", timeout=30_000
    )
    assert page.problems == []
    page.close()


def test_command_publishes(tmp_path, capsys):
    source = '"""A page."""\nfrom stop_scenes import stop_scene\nscene = lambda: stop_scene(load=300.0, T0=8e3)\n'
    (tmp_path / "scene.py").write_text(source)
    out = tmp_path / "sliders.html"
    assert _runs.publish(tmp_path / "scene.py", vary=["initial.omega=16:24:2"], out=out, json_=True) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["points"] == 2
    assert data_of(out.read_text("utf-8"))["grid"]["axes"][0]["path"] == "initial.omega"
    with pytest.raises(sb.InputError, match="--port"):
        _runs.app(tmp_path / "scene.py", port=-1)
