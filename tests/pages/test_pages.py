"""Report, app and publication in a browser: what is read from the page is the run.

Chromium by Playwright where both are installed; elsewhere the data of the pages is
tested without, which the end of the test run says loudly (`conftest.py`).
"""

import base64
import contextlib
import dataclasses
import html
import http.client
import itertools
import json
import re
import socket
import subprocess
import sys
from typing import NamedTuple

import numpy as np
import pytest
from browsers import browser_path, chromium
from commands import call, output
from disc_scenes import disc_scene
from stop_scenes import stop_scene

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


def opened(browser, address):
    """A page that must not report errors, and asks for nothing elsewhere; it fits the
    width of a phone too."""
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    page.problems = []
    page.on("pageerror", lambda error: page.problems.append(str(error)))
    asked = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto(address)
    assert page.problems == []
    assert all(
        url.startswith((address.rpartition("/")[0], "data:"))
        or url.endswith("/favicon.ico")
        for url in asked
    )
    for width in (400, 1280):
        page.set_viewport_size({"width": width, "height": 900})
        assert page.evaluate("document.documentElement.scrollWidth") <= width
    return page


def data_of(text):
    (found,) = re.findall(
        r'<script type="application/json" id="data">(.*?)</script>', text, re.S
    )
    return json.loads(found)


# --- report -------------------------------------------------------------------------


@pytest.fixture(scope="module")
def scene():
    return stop_scene(load=300.0, T0=8e3)


@pytest.fixture(scope="module")
def run(scene):
    return sb.simulate(scene)


@pytest.fixture(scope="module")
def report(run, tmp_path_factory):
    file = tmp_path_factory.mktemp("pages") / "run.html"
    text = sb.report(
        run, file, check=False, title=f"A stop {NASTY}", limits={"max_tension": "30 kN"}
    )
    return file, text


def test_curves_and_film_of_the_run(run, report):
    data = data_of(report[1])["run"]
    titles = [chart["title"] for chart in data["charts"]]
    assert titles[:3] == ["Speed", "Torque", "Tension of the band"]
    t = np.asarray(data["t"])
    inside = (
        np.min(np.abs(t[:, None] - [event.time for event in run.events]), axis=1) > 1e-6
    )
    s = run.series(t[inside])
    np.testing.assert_allclose(
        np.asarray(data["y"][0][0])[inside], s.omega, rtol=1e-6, atol=1e-5
    )
    np.testing.assert_allclose(
        np.asarray(data["y"][1])[:, inside],
        np.stack([s.brake_torque, s.load_torque]) / 1e3,
        1e-4,
    )
    np.testing.assert_allclose(
        np.asarray(data["y"][2][0])[inside],
        np.asarray(s.tight_tension) / 1e3,
        rtol=1e-4,
    )
    film = data["film"]
    s = run.series(film["t"][50:60])
    np.testing.assert_allclose(
        np.asarray(film["tension"])[50:60, 1:], np.asarray(s.tension) / 1e3, rtol=1e-4
    )
    np.testing.assert_allclose(
        film["pairs"][0]["load"][50], np.asarray(s.normal_load[0]) / 1e3, rtol=1e-4
    )
    np.testing.assert_allclose(film["phi"][50:60], s.phi, rtol=1e-4)
    assert len(film["pairs"][0]["contacts"][50]) == run.scene.brake.linings.count
    marked = {event["words"]: event["t"] for event in data["events"]}
    assert marked["stop"] == run.metrics["stopping_time"]


def test_curves_of_temperature():
    heat = sb.Heat(
        (sb.thermal.Lump("metal", 2e5), sb.thermal.Lump("linings", 5e3)),
        friction=sb.thermal.FrictionHeat(
            "metal", "linings", sb.thermal.ConstantPartition(0.9)
        ),
        linings="linings",
        rim="metal",
    )
    hook = sb.HookLoad(1e3, 0.4, 8)
    for scene in (stop_scene(n=3, load=hook), disc_scene()):
        result = sb.simulate(dataclasses.replace(scene, heat=heat))
        film = data_of(sb.report(result, check=False))["run"]["film"]
        s = result.series(film["t"])
        linings, rim = (
            np.asarray(x) - 273.15 for x in (s.lining_temperature, s.rim_temperature)
        )
        np.testing.assert_allclose(film["heat"]["linings"], linings, rtol=1e-4)
        np.testing.assert_allclose(film["heat"]["rim"], rim.max(axis=1), rtol=1e-4)
        if film["hook"]:
            np.testing.assert_allclose(
                film["hook"], np.asarray(film["phi"]) * 0.4 / 8, rtol=1e-5
            )


def test_texts_of_people_never_run(browser, report):
    assert NASTY not in report[1]
    if browser is None:
        return
    page = opened(browser, report[0].as_uri())
    assert page.title() != "run"
    assert page.inner_text("h1") == f"A stop {NASTY}"
    # the policy of the page refuses a script that is not its own
    page.evaluate("() => { const s = document.createElement('script'); s.textContent = "
    "'window.ran = 1'; "
                  "document.body.append(s); }")  # fmt: skip
    assert page.evaluate("window.ran") is None
    page.close()


def test_animate_writes_a_page(tmp_path, capsys):
    (tmp_path / "scene.py").write_text(
        '"""A film."""\nfrom stop_scenes import stop_scene\nscene = lambda: '
        "stop_scene(load=300.0, T0=8e3)\n"
    )
    film = ("animate", str(tmp_path / "scene.py"), str(tmp_path / "film.html"))
    assert call(capsys, *film, "--duration", "2", "--fps", "10", "--end", "1")[0] == 0
    film = data_of((tmp_path / "film.html").read_text("utf-8"))["run"]["film"]
    assert len(film["t"]) == 20
    assert film["t"][-1] == 1.0
    assert film["seconds"] == 2.0


# --- app ----------------------------------------------------------------------------


class Server(NamedTuple):
    address: str

    @property
    def port(self):
        return int(self.address.split(":")[2].partition("/")[0])

    @property
    def token(self):
        return self.address.rstrip("/").rpartition("/")[2]


@pytest.fixture(scope="module")
def server(scene, tmp_path_factory):
    toml = tmp_path_factory.mktemp("app") / "scene.toml"
    toml.write_text(f"# An app {NASTY}\n{sb.files.scene_text(scene)}", "utf-8")
    with serving(toml, "--limit", "max_tension=100 kN") as found:
        yield found


@contextlib.contextmanager
def serving(toml, *options):
    """The app of a scene, until the block ends."""
    command = [sys.executable, "-m", "simbrake", "app", str(toml), *options, "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        address = json.JSONDecoder().raw_decode(
            "".join(itertools.takewhile(lambda x: x != "}\n", process.stdout)) + "}"
        )
        yield Server(address[0]["address"])
        process.terminate()


def ask(server, path, values=None, **headers):
    """Code and text of an answer."""
    link = http.client.HTTPConnection("127.0.0.1", server.port)
    body = None if values is None else json.dumps({"values": values})
    headers = {"Content-Type": "application/json"} | {
        name.replace("_", "-"): text for name, text in headers.items()
    }
    link.request("GET" if values is None else "POST", path, body, headers)
    answer = link.getresponse()
    found = answer.status, answer.read().decode()
    link.close()
    return found


def sent(server, body, length=None, wait=10.0):
    """What comes back of a request as it is written, empty where the connection was
    closed without an answer."""
    lines = [
        f"POST /{server.token}/run HTTP/1.1",
        f"Host: 127.0.0.1:{server.port}",
        "Content-Type: application/json",
    ]
    lines += [
        f"Content-Length: {len(body) if length is None else length}",
        "Connection: close",
        "",
        "",
    ]
    with socket.create_connection(("127.0.0.1", server.port), timeout=wait) as link:
        link.sendall("\r\n".join(lines).encode() + body.encode())
        return b"".join(iter(lambda: link.recv(65536), b"")).decode()


def test_requests_of_a_stranger_are_answered(server):
    """Too deep, too many digits, a length that is none: refused, and not just
    dropped."""
    digits = "9" * 400
    deep = "[" * 100_000
    for body in (
        f'{{"values": {{"initial.omega": {digits}}}}}',
        deep,
        f'{{"values": {deep}',
    ):
        assert " 400 " in sent(server, body).splitlines()[0]
    for length in ("²", "-1", "1" * 5000):
        assert " 400 " in sent(server, "{}", length).splitlines()[0]


def test_only_this_computer_with_the_token(server):
    place = f"/{server.token}/"
    assert server.address.startswith("http://127.0.0.1:")
    assert len(server.token) >= 32
    code, text = ask(server, place)
    assert code == 200
    assert "connect-src 'self'" in html.unescape(text)
    assert NASTY not in text
    refused = [
        ask(server, "/")[0],
        ask(server, f"/{server.token[:-1]}/")[0],
        ask(server, place + "run/../..")[0],
        ask(server, place, Host=f"evil.example:{server.port}")[0],
        ask(server, place, Host="127.0.0.1")[0],
        ask(server, place + "run", {}, Origin="http://evil.example")[0],
        ask(server, place + "run", {}, Content_Type="text/plain")[0],
        ask(server, place + "run", {"nix": 1.0})[0],
        ask(server, place + "run", {"initial.omega": "20"})[0],
        ask(server, place + "nix", {})[0],
    ]
    assert refused == [404, 404, 404, 403, 403, 403, 400, 400, 400, 404]


def answers(server, values):
    return [
        json.loads(line)
        for line in ask(server, f"/{server.token}/run", values)[1].splitlines()
    ]


def test_a_move_is_a_run(server, scene):
    found = answers(server, {"initial.omega": 15.0})[-1]
    run = sb.simulate(sb.with_values(scene, {"initial.omega": 15.0}))
    values = {one["words"]: float(one["si"]) for one in found["results"]["metrics"]}
    assert values["Stopping time"] == run.metrics["stopping_time"]
    assert values["Maximum tension of the band"] == run.metrics["max_tension"]
    assert (
        found["results"]["colour"] == "amber"
    )  # no limit of the band or the linings is given
    assert found["run"]["y"][0][0][0] == 15.0
    wrong = answers(server, {"brake.pulley.inertia": -1.0})[-1]["problem"]
    assert "brake.pulley.inertia" in wrong
    text = json.loads(
        ask(server, f"/{server.token}/scene", {"initial.omega": 15.0})[1]
    )["text"]
    assert sb.files.scene_from_text(text).initial.omega == 15.0


def controls_of(server):
    return data_of(ask(server, f"/{server.token}/")[1])["app"]["controls"]


def test_every_parameter_has_a_slider(server, scene):
    controls = {one["path"]: one for one in controls_of(server)}
    leaves = {leaf.path: leaf for leaf in sb.files.leaves(scene)}
    assert {path.partition("[")[0] for path in controls} == set(leaves)
    for path, one in controls.items():
        about = leaves[path.partition("[")[0]].about
        assert one["low"] <= one["value"] <= one["high"]
        assert one["low"] < one["high"]
        assert about.low is None or one["low"] >= about.low
        assert about.high is None or one["high"] <= about.high
    assert controls["initial.omega"]["unit"] == "rad/s"


def test_a_slider_moves_metrics_and_pictures(browser, server, scene, tmp_path):
    if browser is None:
        return
    from playwright.sync_api import expect

    page = opened(browser, server.address)
    assert page.title() != "run"
    page.fill("#find", "omega")
    page.locator('[data-path="initial.omega"] input[type=range]').fill("700")
    expect(page.locator("#state")).to_have_text(
        re.compile("drawn after"), timeout=30_000
    )
    control = next(one for one in controls_of(server) if one["path"] == "initial.omega")
    w = control["low"] + 0.7 * (control["high"] - control["low"])
    run = sb.simulate(sb.with_values(scene, {"initial.omega": w}))
    expect(page.locator("#figures")).to_contain_text(
        f"{run.metrics['stopping_time']:.3g} s", timeout=30_000
    )
    with page.expect_download() as download:
        page.click("#save")
    file = tmp_path / "scene.toml"
    download.value.save_as(file)
    assert float(sb.read_scene(file).initial.omega) == pytest.approx(w, rel=1e-12)
    assert page.problems == []
    page.close()


# --- publication: a page that runs its scene ----------------------------------------


STOP = sb.files.shipped("u2_5_5_stop")


@pytest.fixture(scope="module")
def published(tmp_path_factory):
    """The page of a stop, and its data."""
    pytest.importorskip("ziglang")
    path = tmp_path_factory.mktemp("published") / "stop.html"
    said = json.loads(output("publish", str(STOP), "--out", str(path), "--json"))
    return path, said, data_of(path.read_text("utf-8"))["live"]


def test_a_publication_has_what_it_needs(published):
    path, said, live = published
    assert said == {
        "written": str(path),
        "sliders": len(live["controls"]),
        "metrics": len(live["metrics"]),
        "program": len(base64.b64decode(live["program"])),
        "size": path.stat().st_size,
    }
    assert said["size"] < 1e6
    angles = next(
        control
        for control in live["controls"]
        if control["path"] == "brake.linings.angle"
    )
    assert len(angles["places"]) == 20  # equal ones have one slider


def test_each_move_in_the_browser_is_a_run(published, browser):
    """Metrics, events and curves in the browser are those of Python; what is out of
    range is refused."""
    if browser is None:
        return
    path, _, live = published
    page = opened(browser, path.as_uri())
    page.wait_for_function(
        "window.simbrake.live !== undefined && document.body.dataset.milliseconds"
    )
    scene = sb.read_scene(STOP)
    for values in (
        {"initial.omega": 18.5},
        {"duty.load.mass": 45e3, "brake.linings.friction.coefficient": 0.31},
    ):
        for name, value in values.items():
            control = next(one for one in live["controls"] if one["path"] == name)
            field = page.locator(f'[data-path="{name}"] input[type=text]')
            field.fill(str(value * control["factor"] + control["offset"]))
            field.press("Tab")
        scene = sb.with_values(scene, values)
        result = sb.simulate(scene)
        found = page.evaluate("window.simbrake.live.run()")
        assert found["code"] == 0
        for about, value in zip(live["metrics"], found["metrics"], strict=True):
            assert value == pytest.approx(float(result[about["name"]]), rel=1e-9)
        times = [event.time for event in result.events if event.lining is None]
        assert [event["t"] for event in found["events"]] == pytest.approx(
            times, rel=1e-9
        )
        assert page.text_content("#banner b").startswith("H4")
    curves = page.evaluate(
        "window.simbrake.live.curves(0, 5, window.simbrake.live.run().events)"
    )
    series = result.series(np.asarray(curves["t"]))
    between = np.all(
        [np.abs(np.asarray(curves["t"]) - t) > 1e-6 for t in times], axis=0
    )
    speed, torque = (np.asarray(curves["y"][k][0]) for k in (0, 1))
    np.testing.assert_allclose(
        speed[between], series.omega[between], rtol=1e-8, atol=1e-8
    )
    np.testing.assert_allclose(
        torque[between], 1e-3 * series.brake_torque[between], rtol=1e-8
    )
    page.locator('[data-path="initial.omega"] input[type=text]').fill("-1e60")
    page.locator('[data-path="initial.omega"] input[type=text]').press("Tab")
    assert "out of range" in page.text_content("#state")
    assert page.problems == []
    page.close()


@pytest.mark.parametrize(
    ("friction", "end_time"),
    [(0.02, 5.0), (0.35, 0.5), (0.13, 5.0)],
    ids=["falls", "ends too early", "small reserve"],
)
def test_a_page_judges_a_load_by_its_reserve_as_a_run_does(
    published, browser, friction, end_time
):
    """Colour, reason, and the rows of what the friction brake gives over the load, held
    or in motion."""
    if browser is None:
        return
    path, _, _ = published
    values = {"brake.linings.friction.coefficient": friction, "end_time": end_time}
    said = sb.simulate(sb.with_values(sb.read_scene(STOP), values)).verdict()
    page = opened(browser, path.as_uri())
    page.wait_for_function(
        "window.simbrake.live !== undefined && document.body.dataset.milliseconds"
    )
    page.evaluate(
        "document.querySelectorAll('details').forEach((box) => { box.open = true; })"
    )
    for name, value in values.items():
        field = page.locator(f'[data-path="{name}"] input[type=text]')
        field.fill(str(value))
        field.press("Tab")
    assert page.text_content("#banner b").startswith(said.reason + ":")
    assert str(said.colour) in page.get_attribute("#banner", "class").split()
    shown = [
        row.locator("td").all_text_contents() for row in page.locator("#rows tr").all()
    ]
    rows = {name: (value, state) for name, value, _, _, state in shown}
    wanted = [row for row in said.rows if row.limit == "> 1"]
    assert len(wanted) == (1 if said.reason == "H4" else 2)
    for row in wanted:
        value, state = rows[row.name]
        assert float(value) == pytest.approx(float(row.value.split()[0]), rel=2e-4)
        assert state == str(row.state)
    assert page.problems == []
    page.close()


def test_what_makes_no_publication(scene, tmp_path, monkeypatch, capsys):
    """Wrong ranges, no compiler, no C form: each with the way out, and nothing is
    written."""
    sb.write_scene(scene, tmp_path / "scene.toml")
    publish = (
        "publish",
        str(tmp_path / "scene.toml"),
        "--out",
        str(tmp_path / "page.html"),
    )

    def told(*vary):
        code, _, err = call(
            capsys,
            *publish,
            "--live",
            *(text for one in vary for text in ("--vary", one)),
        )
        assert code == 2
        assert [path.name for path in tmp_path.iterdir()] == ["scene.toml"]
        return err

    err = told(
        "initial.omega=3:2",
        "end_time=1:2:3",
        "nix=1:2",
        "duty.load.profile.level=1 kg:2",
        "end_time",
    )
    assert "5 input errors" in err
    assert "--live has no effect" in err
    assert "its low end is not below its high one" in err
    assert "is not of the form PATH=LOW:HIGH" in err
    assert "twice" in told("initial.omega=1:2", "initial.omega=1:2")
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "ziglang", None)
        err = told()
    assert all(
        way in err
        for way in ("simbrake report", "simbrake app", "pip install 'simbrake[live]'")
    )
