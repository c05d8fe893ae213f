"""Report, app and publication: what the page has, and shows in a browser, is the run.

Chromium by Playwright where both are installed; elsewhere the data of the pages is
tested without, which the end of the test run says loudly (`conftest.py`).
"""

import contextlib
import http.client
import itertools
import json
import math
import re
import subprocess
import sys

import numpy as np
import pytest
from browsers import browser_path, chromium
from commands import call, output
from helpers import all_near, near
from scenes import stop_scene
from verdict_scenes import helped_hold

import simbrake as sb

NASTY = "</script><img src=x onerror=\"document.title='run'\">"


@pytest.fixture(scope="module")
def browser():
    """A headless browser, `None` where there is none."""
    if browser_path() is None:
        yield None
        return
    with chromium() as found:
        yield found


@contextlib.contextmanager
def opened(browser, address):
    """A page that reports no error, asks for nothing elsewhere, and fits a phone."""
    page = browser.new_page(viewport={"width": 400, "height": 900})
    problems = []
    asked = []
    page.on("pageerror", lambda error: problems.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    page.goto(address)
    assert page.evaluate("document.documentElement.scrollWidth") <= 400
    page.set_viewport_size({"width": 1280, "height": 900})
    yield page
    own = (address.rpartition("/")[0], "data:")
    assert [x for x in asked if not x.startswith(own) and "favicon" not in x] == []
    assert problems == []
    page.close()


def data_of(text):
    pattern = '<script type="application/json" id="data">(.*?)</script>'
    (found,) = re.findall(pattern, text, re.S)
    return json.loads(found)


@pytest.fixture(scope="module")
def scene():
    return stop_scene(load=300.0, T0=8e3)


#: moves a film by steps; times at which the cursors of the charts are
_MOVE = """(step) => {
  const at = document.getElementById("at");
  at.value = Number(at.value) + step;
  at.dispatchEvent(new Event("input"));
}"""
_CURSORS = """() => [...document.querySelectorAll(".chart .u-legend")]
  .map((legend) => legend.querySelector(".u-value").textContent)"""


# --- report -------------------------------------------------------------------------


def test_curves_and_film_of_a_report(scene, browser, tmp_path):
    run = sb.simulate(scene)
    file = tmp_path / "run.html"
    text = sb.report(run, file, check=False, title=f"A stop {NASTY}")
    assert NASTY not in text
    data = data_of(text)["run"]
    t = np.asarray(data["t"])
    times = run.events.times
    inside = np.min(np.abs(np.subtract.outer(t, times)), axis=1) > 1e-6
    s = run.series(t[inside])
    for chart, factor, column in (
        (0, 1.0, "omega"),
        (1, 1e-3, "brake_torque"),
        (2, 1e-3, "tight_tension"),
    ):
        drawn = np.asarray(data["y"][chart][0])[inside]
        wanted = factor * np.asarray(getattr(s, column))
        all_near(drawn, wanted, 1e-4, 1e-5)
    film = data["film"]
    s = run.series(t[50:60])
    tension = np.asarray(film["tension"])[50:60, 1:]
    all_near(tension, np.asarray(s.tension) / 1e3, 1e-4)
    all_near(film["phi"][50:60], s.phi, 1e-4)
    if browser is not None:
        with opened(browser, file.as_uri()) as page:
            assert page.title() != "run"
            assert page.inner_text("h1") == f"A stop {NASTY}"
            # the film and all charts are at one moment, or these are zoomed to others
            for step, shown in ((1, True), (20, True), (1e9, False)):
                page.evaluate(_MOVE, step)
                now = page.inner_text("#now").split(" ")[2] if shown else "—"
                assert set(page.evaluate(_CURSORS)) == {now}


def test_report_in_units_of_a_rig(tmp_path, capsys, scene):
    """Texts and charts, all in one system."""
    file = tmp_path / "stop.toml"
    sb.write_scene(scene, file)
    page = tmp_path / "stop.html"
    asked = ("--units", "rig", "--no-check", "--out", str(page))
    assert call(capsys, "report", str(file), *asked)[0] == 0
    text = page.read_text("utf-8")
    run = data_of(text)["run"]
    units = [chart["unit"] for chart in run["charts"]]
    assert units == ["rpm", "ft·lbf", "klbf", "–"]
    s = sb.simulate(scene).series(run["t"][50:51])
    pound = 0.45359237 * 9.80665
    drawn = [line[50] for lines in run["y"][:3] for line in lines]
    near(drawn[0] * math.pi / 30, s.omega[0], 1e-6)
    near(drawn[1] * pound * 0.3048, s.brake_torque[0], 1e-6)
    near(drawn[3] * 1e3 * pound, s.tight_tension[0], 1e-6)
    near(run["film"]["torque"][50] * pound * 0.3048, s.brake_torque[0], 1e-6)
    parts = r"<(script|style|pre).*?</\1>|data:[^\"]*|<[^>]*>"
    shown = re.sub(parts, "", text, flags=re.DOTALL)
    found = re.search(r".{40}(\b(kN(?!/m)|MPa|kJ|rad/s|m/s)\b|°C)", shown)
    assert not found


# --- app ----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def server(scene, tmp_path_factory):
    """Address of the app of a scene in a process of its own."""
    toml = tmp_path_factory.mktemp("app") / "scene.toml"
    toml.write_text(f"# An app {NASTY}\n{sb.files.scene_text(scene)}", "utf-8")
    command = [sys.executable, "-m", "simbrake", "app", str(toml), "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        said = "".join(itertools.takewhile(lambda line: line != "}\n", process.stdout))
        yield json.loads(said + "}")["address"]
        process.terminate()


def ask(server, path="", values=None, **headers):
    """Code and text of the answer to a request below the address, or at `/…`."""
    host, token = re.fullmatch("http://([^/]+)/(.*)", server).groups()
    link = http.client.HTTPConnection(host)
    body = values if isinstance(values, str) else json.dumps({"values": values})
    headers = {"Content-Type": "application/json"} | headers
    path = path if path.startswith("/") else f"/{token}{path}"
    link.request(
        "GET" if values is None else "POST",
        path,
        None if values is None else body,
        {name.replace("_", "-"): text for name, text in headers.items()},
    )
    answer = link.getresponse()
    found = answer.status, answer.read().decode()
    link.close()
    return found


def test_requests_of_a_stranger_are_refused(server):
    assert server.startswith("http://127.0.0.1:")
    code, text = ask(server)
    assert code == 200
    assert NASTY not in text
    refused = [
        ask(server, "/")[0],
        ask(server, "run/../..")[0],
        ask(server, Host="evil.example:80")[0],
        ask(server, "run", {}, Origin="http://evil.example")[0],
        ask(server, "run", {}, Content_Type="text/plain")[0],
        ask(server, "run", {"nix": 1.0})[0],
        ask(server, "run", {"initial.omega": "20"})[0],
        ask(server, "run", "[" * 100_000)[0],
        ask(server, "run", "{}", Content_Length="²".encode())[0],
    ]
    assert refused == [404, 404, 403, 403, 400, 400, 400, 400, 400]


def test_a_move_is_a_run(server, scene):
    def last(values):
        return json.loads(ask(server, "run", values)[1].splitlines()[-1])

    run = sb.simulate(sb.with_values(scene, {"initial.omega": 15.0}))
    found = last({"initial.omega": 15.0})["results"]["metrics"]
    values = {row["words"]: float(row["si"]) for row in found}
    assert values["Stopping time"] == run.metrics["stopping_time"]
    wrong = last({"brake.pulley.inertia": -1.0})["problem"]
    assert "brake.pulley.inertia" in wrong
    controls = data_of(ask(server)[1])["app"]["controls"]
    paths = {control["path"].partition("[")[0] for control in controls}
    assert paths == {leaf.path for leaf in sb.files.leaves(scene)}


# --- the page that runs by itself ---------------------------------------------------

STOP = sb.files.shipped("u2_5_5_stop")


@pytest.fixture(scope="module")
def published(tmp_path_factory):
    pytest.importorskip("ziglang")
    path = tmp_path_factory.mktemp("published") / "stop.html"
    said = json.loads(output("publish", str(STOP), "--out", str(path), "--json"))
    assert said["size"] == path.stat().st_size < 1e6
    return path


@pytest.mark.parametrize(
    "values",
    [
        {"initial.omega": 18.5, "duty.load.mass": 45e3},
        {"brake.linings.friction.coefficient": 0.02},
        {"brake.linings.friction.coefficient": 0.13},
        {"end_time": 0.5},
    ],
)
def test_each_move_in_the_browser_is_a_run(published, browser, values):
    """Metrics, events, curves and verdict in the browser are those of Python."""
    if browser is None:
        return
    live = data_of(published.read_text("utf-8"))["live"]
    controls = {control["path"]: control for control in live["controls"]}
    result = sb.simulate(sb.with_values(sb.read_scene(STOP), values))
    with opened(browser, published.as_uri()) as page:
        page.wait_for_function(
            "window.simbrake.live && document.body.dataset.milliseconds"
        )
        opening = "document.querySelectorAll('details').forEach((x) => { x.open = 1; })"
        page.evaluate(opening)
        for name, value in values.items():
            field = page.locator(f'[data-path="{name}"] input[type=text]')
            factor, offset = (controls[name][x] for x in ("factor", "offset"))
            field.fill(str(value * factor + offset))
            field.press("Tab")
        found = page.evaluate("window.simbrake.live.run()")
        metrics = zip(live["metrics"], found["metrics"], strict=True)
        metrics = {about["name"]: value for about, value in metrics}
        wanted = {name: float(result[name]) for name in metrics}
        assert metrics == pytest.approx(wanted, rel=1e-9)
        times = [event.time for event in result.events if event.lining is None]
        assert [event["t"] for event in found["events"]] == pytest.approx(times)
        said = result.verdict()
        assert page.text_content("#banner b").startswith(f"{said.reason}:")
        assert str(said.colour) in page.get_attribute("#banner", "class").split()
        calls = "window.simbrake.live"
        curves = page.evaluate(f"{calls}.curves(0, 0.4, {calls}.run().events)")
        t = np.asarray(curves["t"])
        apart = np.all(np.abs(np.subtract.outer(t, times)) > 1e-6, axis=1)
        series = result.series(t[apart])
        speed, torque = (np.asarray(curves["y"][k][0])[apart] for k in (0, 1))
        all_near(speed, series.omega, 1e-8, 1e-8)
        all_near(torque, 1e-3 * series.brake_torque, 1e-8)
        field = page.locator('[data-path="initial.omega"] input[type=text]')
        field.fill("-1e60")
        field.press("Tab")
        assert "out of range" in page.text_content("#state")


@pytest.mark.slow
def test_a_page_tells_of_an_earlier_weak_hold(browser, tmp_path):
    """The load runs on when it is let go."""
    sb.write_scene(helped_hold(1 / 0.91, 0.5), tmp_path / "weak.toml")
    page_file = tmp_path / "weak.html"
    output("publish", str(tmp_path / "weak.toml"), "--out", str(page_file))
    if browser is None:
        return
    with opened(browser, page_file.as_uri()) as page:
        page.wait_for_function("document.body.dataset.milliseconds")
        row = page.text_content("tr:has-text('Minimum holding reserve')")
        assert "0.91" in row
        assert "exceeded" in row


def test_what_makes_no_publication(scene, tmp_path, monkeypatch, capsys):
    """Wrong ranges or no compiler: the ways out, and nothing is written."""
    sb.write_scene(scene, tmp_path / "scene.toml")
    out = str(tmp_path / "page.html")
    publish = ("publish", str(tmp_path / "scene.toml"), "--out", out)
    wrong = ("initial.omega=3:2", "end_time=1:2:3", "nix=1:2", "end_time")
    given = [text for range_ in wrong for text in ("--vary", range_)]
    code, _, err = call(capsys, *publish, *given)
    assert (code, f"{len(wrong)} input errors" in err) == (2, True)
    monkeypatch.setitem(sys.modules, "ziglang", None)
    code, _, err = call(capsys, *publish)
    assert (code, "simbrake report" in err) == (2, True)
    assert [path.name for path in tmp_path.iterdir()] == ["scene.toml"]
