"""Report, app and publication in a browser at 1280 and 400 px: what is read from the page is the run.

Chromium by Playwright where both are installed; elsewhere the data of the pages is tested without, which the end of the
test run says loudly (`conftest.py`).
"""

import base64
import contextlib
import dataclasses
import html
import http.client
import io
import itertools
import json
import math
import re
import socket
import subprocess
import sys
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
import pytest
from browsers import browser_path, chromium
from commands import call, output
from disc_scenes import disc_scene
from rig_recordings import book
from stop_scenes import stop_scene

import simbrake as sb
from simbrake.export import _c_code

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


def test_curves_and_film_of_the_run(run, report):
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
    s = run.series(film["t"][50:60])
    np.testing.assert_allclose(np.asarray(film["tension"])[50:60, 1:], np.asarray(s.tension) / 1e3, rtol=1e-4)
    np.testing.assert_allclose(film["pairs"][0]["load"][50], np.asarray(s.normal_load[0]) / 1e3, rtol=1e-4)
    np.testing.assert_allclose(film["phi"][50:60], s.phi, rtol=1e-4)
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


def test_curves_of_temperature():
    heat = sb.Heat(
        (sb.thermal.Lump("metal", 2e5), sb.thermal.Lump("linings", 5e3)),
        friction=sb.thermal.FrictionHeat("metal", "linings", sb.thermal.ConstantPartition(0.9)),
        linings="linings",
        rim="metal",
    )
    hook = sb.HookLoad(1e3, 0.4, 8)
    for scene, body, lining in ((stop_scene(n=3, load=hook), "rim", "lining"), (disc_scene(), "disc", "pad")):
        result = sb.simulate(dataclasses.replace(scene, heat=heat))
        data = data_of(sb.report(result, check=False))["run"]
        charts = {chart["title"]: chart for chart in data["charts"]}
        named = [line["label"] for line in charts["Surface temperature"]["lines"]]
        assert named == [f"hottest {body}", f"hottest {lining}"]
        film = data["film"]
        s = result.series(film["t"])
        linings, rim = (np.asarray(x) - 273.15 for x in (s.lining_temperature, s.rim_temperature))
        np.testing.assert_allclose(film["heat"]["linings"], linings, rtol=1e-4)
        np.testing.assert_allclose(film["heat"]["rim"], rim.max(axis=1), rtol=1e-4)
        low, high = min(linings.min(), rim.min()), max(linings.max(), rim.max())
        assert (film["heat"]["low"], film["heat"]["high"]) == pytest.approx((low, max(high, low + 1.0)), rel=1e-4)
        assert (film["tension"] is None) == (film["hook"] is None) == (lining == "pad")
        if film["hook"]:
            np.testing.assert_allclose(film["hook"], np.asarray(film["phi"]) * 0.4 / 8, rtol=1e-5)


@pytest.mark.parametrize("size", SIZES)
def test_hovering_shows_the_series(browser, run, report, size):
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


def test_a_report_prints_on_four_pages(browser, report):
    if browser is None:
        return
    page = opened(browser, report[0].as_uri())
    printed = page.pdf(format="A4")
    assert 1 <= len(re.findall(rb"/Type\s*/Page\b", printed)) <= 4
    page.close()


@pytest.mark.parametrize(("scheme", "paper"), [("light", (255, 255, 255)), ("dark", (18, 24, 31))])
def test_figures_are_dark_on_a_dark_screen(browser, report, scheme, paper):
    if browser is None:
        return
    page = opened(browser, report[0].as_uri(), color_scheme=scheme)
    figures = page.locator("figure > img:visible")
    assert figures.count() > 0
    for i in range(figures.count()):
        shown = plt.imread(io.BytesIO(figures.nth(i).screenshot()))
        assert tuple(np.rint(255 * shown[20, 4, :3])) == paper
        # (axes and texts are as far from the paper as can be read)
        assert np.ptp(shown[:, : shown.shape[1] // 12].mean(axis=2)) > 0.6
    page.close()


def test_texts_of_people_never_run(browser, report):
    assert NASTY not in report[1]
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


@pytest.mark.parametrize("size", SIZES)
def test_ledger_of_a_rig(browser, tmp_path, size):
    recorded = book()
    sb.pages.write_ledger(recorded, tmp_path)
    text = (tmp_path / "ledger.html").read_text("utf-8")
    assert all(words in text for words in ("flagged and left out: 1", "single update", *recorded.notes))
    if browser is not None:
        page = opened(browser, f"file://{tmp_path}/ledger.html", size)
        assert page.locator("#lowerings tbody tr").count() == 2 * len(recorded.entries)
        assert page.locator("#totals table").count() == 2
        page.close()


def test_animate_writes_a_page(tmp_path, capsys):
    (tmp_path / "scene.py").write_text(
        '"""A film."""\nfrom stop_scenes import stop_scene\nscene = lambda: stop_scene(load=300.0, T0=8e3)\n'
    )
    film = ("animate", str(tmp_path / "scene.py"), str(tmp_path / "film.html"))
    assert call(capsys, *film, "--duration", "2", "--fps", "10", "--end", "1")[0] == 0
    film = data_of((tmp_path / "film.html").read_text("utf-8"))["run"]["film"]
    assert len(film["t"]) == 20
    assert film["t"][-1] == 1.0
    assert film["seconds"] == 2.0


# --- app --------------------------------------------------------------------------------------------------------------


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
    headers = {"Content-Type": "application/json"} | {name.replace("_", "-"): text for name, text in headers.items()}
    link.request("GET" if values is None else "POST", path, body, headers)
    answer = link.getresponse()
    found = answer.status, answer.read().decode()
    link.close()
    return found


def sent(server, body, length=None, wait=10.0):
    """What comes back of a request as it is written, empty where the connection was closed without an answer."""
    lines = [f"POST /{server.token}/run HTTP/1.1", f"Host: 127.0.0.1:{server.port}", "Content-Type: application/json"]
    lines += [f"Content-Length: {len(body) if length is None else length}", "Connection: close", "", ""]
    with socket.create_connection(("127.0.0.1", server.port), timeout=wait) as link:
        link.sendall("\r\n".join(lines).encode() + body.encode())
        return b"".join(iter(lambda: link.recv(65536), b"")).decode()


def test_requests_of_a_stranger_are_answered(server):
    """Too deep, too many digits, a length that is none: refused, and not just dropped."""
    digits, deep = "9" * 400, "[" * 100_000
    for body in (f'{{"values": {{"initial.omega": {digits}}}}}', deep, f'{{"values": {deep}'):
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


@pytest.mark.slow
def test_the_app_opens_on_what_pulls_and_not_on_its_limit(scene, tmp_path):
    """The full pull of the hand, though the force that is allowed is larger."""
    force = sb.PiecewiseLinear([0.0, 0.4], [0.0, 450.0])
    lever = sb.Lever(force, arm=1.8, slack_arm=0.025, efficiency=0.9, greatest_force=600.0)
    duty, start = sb.Duty(lever, sb.HookLoad(60e3, 0.35, 10)), sb.Initial(hook_speed=1.0)
    sb.write_scene(dataclasses.replace(scene, duty=duty, initial=start), tmp_path / "scene.toml")
    with serving(tmp_path / "scene.toml") as found:
        first = {one.get("name"): one["path"] for one in controls_of(found) if one["group"] == "What decides first"}
    assert first["Pull of the hand, full"] == "duty.slack_tension.force.values[1]"
    assert first["Hook speed at the start"] == "initial.hook_speed"
    assert first["Mass on the hook"] == "duty.load.mass"


def compared_with_the_start(page, start, now):
    """A press of the button adds the start to tiles and charts, another one removes it."""
    before = page.locator(".chart .u-label").all_inner_texts()
    page.click("#compare")
    first, last = (run.metrics["stopping_time"] for run in (start, now))
    said = page.locator("#figures div", has=page.get_by_text("Stopping time", exact=True)).locator("small").inner_text()
    share = re.fullmatch(rf"start: {first:.3g} s, [+]?([−.\d]+) %", said).group(1)
    assert number(share) == pytest.approx(100 * (last / first - 1), rel=0.05)  # two digits
    labels = page.locator(".chart .u-label").all_inner_texts()
    assert [name for name in labels if name.endswith(", start")] == [
        f"{name}, start" for name in before if name != "t, s"
    ]
    page.click("#compare")
    assert page.locator(".chart .u-label").all_inner_texts() == before
    assert "start:" not in page.inner_text("#figures")


@pytest.mark.parametrize("size", SIZES)
def test_a_slider_moves_metrics_and_pictures(browser, server, scene, size, tmp_path):
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
    control = next(one for one in controls_of(server) if one["path"] == "initial.omega")
    w = control["low"] + 0.7 * (control["high"] - control["low"])
    run = sb.simulate(sb.with_values(scene, {"initial.omega": w}))
    expect(page.locator("#figures")).to_contain_text(f"{run.metrics['stopping_time']:.3g} s", timeout=30_000)
    page.fill("#find", "")
    with page.expect_download() as download:
        page.click("#save")
    file = tmp_path / "scene.toml"
    download.value.save_as(file)
    saved = sb.read_scene(file)
    assert float(saved.initial.omega) == pytest.approx(w, rel=1e-12)
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.click("#copy")
    expect(page.locator("#state")).to_have_text("copied as TOML")
    assert page.evaluate("navigator.clipboard.readText()") == file.read_text("utf-8")
    compared_with_the_start(page, sb.simulate(scene), run)
    page.click("#reset")
    expect(page.locator("#figures")).to_contain_text(
        f"{sb.simulate(scene).metrics['stopping_time']:.3g} s", timeout=30_000
    )
    assert page.problems == []
    page.close()


# --- publication: a page that runs its scene --------------------------------------------------------------------------


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
    first = [control for control in live["controls"] if control["group"] == live["controls"][0]["group"]]
    assert [control["path"] for control in first] == [
        "duty.load.mass",
        "initial.omega",
        "duty.slack_tension.values[1]",
        "brake.linings.friction.coefficient",
    ]
    angles = next(control for control in live["controls"] if control["path"] == "brake.linings.angle")
    assert len(angles["places"]) == 20  # equal ones have one slider


def test_each_move_in_the_browser_is_a_run(published, browser):
    """Metrics, events and curves in the browser are those of Python; what is out of range is refused."""
    if browser is None:
        return
    path, _, live = published
    page = opened(browser, path.as_uri())
    page.wait_for_function("window.simbrake.live !== undefined && document.body.dataset.milliseconds")
    scene = sb.read_scene(STOP)
    for values in ({"initial.omega": 18.5}, {"duty.load.mass": 45e3, "brake.linings.friction.coefficient": 0.31}):
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
        assert [event["t"] for event in found["events"]] == pytest.approx(times, rel=1e-9)
        assert page.text_content("#banner b").startswith("H4: At rest and held")
    compared_with_the_start(page, sb.simulate(sb.read_scene(STOP)), result)
    curves = page.evaluate("window.simbrake.live.curves(0, 5, window.simbrake.live.run().events)")
    series = result.series(np.asarray(curves["t"]))
    between = np.all([np.abs(np.asarray(curves["t"]) - t) > 1e-6 for t in times], axis=0)
    speed, torque = (np.asarray(curves["y"][k][0]) for k in (0, 1))
    np.testing.assert_allclose(speed[between], series.omega[between], rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(torque[between], 1e-3 * series.brake_torque[between], rtol=1e-8)
    page.locator('[data-path="initial.omega"] input[type=text]').fill("-1e60")
    page.locator('[data-path="initial.omega"] input[type=text]').press("Tab")
    assert "out of range" in page.text_content("#state")
    page.click("#reset")
    assert page.text_content("#state").startswith("run in")
    assert page.problems == []
    page.close()


@pytest.mark.parametrize(
    ("friction", "end_time"), [(0.02, 5.0), (0.35, 0.5), (0.13, 5.0)], ids=["falls", "ends too early", "small reserve"]
)
def test_a_page_judges_a_load_by_its_reserve_as_a_run_does(published, browser, friction, end_time):
    """Colour, reason, and the rows of what the friction brake gives over the load, held or in motion."""
    if browser is None:
        return
    path, _, _ = published
    values = {"brake.linings.friction.coefficient": friction, "end_time": end_time}
    said = sb.simulate(sb.with_values(sb.read_scene(STOP), values)).verdict()
    page = opened(browser, path.as_uri())
    page.wait_for_function("window.simbrake.live !== undefined && document.body.dataset.milliseconds")
    page.evaluate("document.querySelectorAll('details').forEach((box) => { box.open = true; })")
    for name, value in values.items():
        field = page.locator(f'[data-path="{name}"] input[type=text]')
        field.fill(str(value))
        field.press("Tab")
    assert page.text_content("#banner b").startswith(said.reason + ":")
    assert str(said.colour) in page.get_attribute("#banner", "class").split()
    shown = [row.locator("td").all_text_contents() for row in page.locator("#rows tr").all()]
    rows = {name: (value, state) for name, value, _, _, state in shown}
    wanted = [row for row in said.rows if row.limit == "> 1"]
    assert len(wanted) == (1 if said.reason == "H4" else 2)
    for row in wanted:
        value, state = rows[row.name]
        assert float(value) == pytest.approx(float(row.value.split()[0]), rel=2e-4)
        assert state == str(row.state)
    assert page.problems == []
    page.close()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("areas", "limit", "words"),
    [
        ("0.03 m^2", 6e3, "Pressure on linings is compared by their load."),
        ([0.03] * 19 + [0.02], None, "Not looked at here: Maximum mean pressure on a lining."),
    ],
)
def test_a_publication_keeps_the_limits_of_its_scene(browser, scene, tmp_path, areas, limit, words):
    """The run exceeds a permissible pressure: a page is red if it can look, and never green if it cannot."""
    pytest.importorskip("ziglang")
    linings = dataclasses.replace(scene.brake.linings, area=areas, permissible_pressure=0.2e6)
    limited = dataclasses.replace(scene, brake=dataclasses.replace(scene.brake, linings=linings))
    sb.write_scene(limited, tmp_path / "scene.toml")
    out = tmp_path / "page.html"
    text = f"# {NASTY}\n{(tmp_path / 'scene.toml').read_text('utf-8')}"
    (tmp_path / "scene.toml").write_text(text, "utf-8")
    given = ("--vary", "initial.omega=20:20.1", "--limit", "max_tension=1 MN", "--out", str(out))
    output("publish", str(tmp_path / "scene.toml"), *given)
    text = out.read_text("utf-8")
    data = data_of(text)["live"]
    limits = {metric["name"]: metric["limit"] for metric in data["metrics"]}
    assert (limits["max_normal_load"], limits["max_tension"]) == (pytest.approx(limit) if limit else None, 1e6)
    assert words in data["coverage"]["words"]
    assert [(one["path"], one["low"], one["high"]) for one in data["controls"]] == [("initial.omega", 20.0, 20.1)]
    assert NASTY not in text
    if browser is not None:
        page = opened(browser, out.as_uri())
        page.wait_for_function("document.body.dataset.milliseconds")
        said = page.inner_text("#banner")
        assert words in said
        assert ("exceeded" in said) == (limit is not None)
        assert page.get_attribute("#banner", "class") == f"verdict {'red' if limit else 'amber'}"
        page.close()


def test_what_makes_no_publication(scene, tmp_path, monkeypatch, capsys):
    """Wrong ranges, no compiler, no C form: each with the way out, and nothing is written."""
    sb.write_scene(scene, tmp_path / "scene.toml")
    publish = ("publish", str(tmp_path / "scene.toml"), "--out", str(tmp_path / "page.html"))

    def told(*vary):
        code, _, err = call(capsys, *publish, "--live", *(text for one in vary for text in ("--vary", one)))
        assert code == 2
        assert [path.name for path in tmp_path.iterdir()] == ["scene.toml"]
        return err

    err = told("initial.omega=3:2", "end_time=1:2:3", "nix=1:2", "duty.load.profile.level=1 kg:2", "end_time")
    assert "5 input errors" in err
    assert "--live has no effect" in err
    assert "its low end is not below its high one" in err
    assert "is not of the form PATH=LOW:HIGH" in err
    assert "twice" in told("initial.omega=1:2", "initial.omega=1:2")
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "ziglang", None)
        err = told()
    assert all(way in err for way in ("simbrake report", "simbrake app", "pip install 'simbrake[live]'"))
    pytest.importorskip("ziglang")
    monkeypatch.delitem(_c_code._ENTRYWISE, "tan")
    err = told()
    assert "uses the operation tan, which has no C form yet — simbrake report and simbrake app" in err
