"""The report: one page that needs nothing else, whose numbers are those of the run."""

import base64
import hashlib
import html
import html.parser
import json
import math
import re

import pytest
from commands import call
from helpers import all_equal, faults_of
from scenes import stop_run, stop_scene

import simbrake as sb

VOID = {"meta", "img", "br", "wbr", "link", "hr", "input"}
NASTY = "<script>alert(1)</script>"


class Page(html.parser.HTMLParser):
    """Elements of a page; fails where tags do not match."""

    def __init__(self, text):
        super().__init__()
        self.open = []
        self.ids = []
        self.links = []
        self.values = set()
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        self.ids += [found["id"]] if "id" in found else []
        self.links += [found[name] for name in ("href", "src", "data") if name in found]
        if tag == "data":
            self.values |= {float(x) for x in found["value"].split(",")}
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


@pytest.fixture(scope="module")
def run():
    return stop_run(load=300.0, T0=8e3)


@pytest.fixture(scope="module")
def made(run, tmp_path_factory):
    """The page of a run with everything asked for."""
    path = tmp_path_factory.mktemp("report") / "run.html"
    text = sb.report(
        run,
        path,
        sensitivity=["stopping_time"],
        span={"initial.omega": "30 rpm"},
        limits={"max_tension": 1e9, "max_normal_load": 10.0},
        title=f"A stop {NASTY} & more",
        files={"notes.txt": f"# {NASTY}\n[brake]"},
    )
    assert path.read_text("utf-8") == text
    return text


def test_page_is_complete_in_itself(made):
    """Nothing is loaded, no script but its own runs, and what people wrote is text."""
    page = Page(made)
    assert len(page.ids) == len(set(page.ids))
    for link in page.links:
        assert link.startswith("data:image/") or link[1:] in page.ids
    assert not re.search(r"<(link|iframe|object|embed)\b|url\(|@import", made)
    scripts = re.findall(r"<script>(.*?)</script>", made, re.S)
    policy = html.unescape(made)
    assert "default-src 'none'" in policy
    for text in scripts:
        digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        assert f"'sha256-{digest}'" in policy
    assert NASTY not in made
    assert made.count("&lt;script&gt;alert(1)&lt;/script&gt;") >= 2


def test_numbers_of_the_page(run, made):
    there = Page(made).values
    found = [value for value in run.metrics.values() if value is not None]
    assert len(found) > 5
    energies = ("load_work", "lever_work", "friction_heat")
    assert {*found, *(abs(float(run.energy[name])) for name in energies)} <= there
    assert {event.time for event in run.events} <= there
    assert {800.0, 0.725, 2e5, 8e3, math.radians(13.5)} <= there
    path = "brake.pulley.inertia"
    table = sb.sensitivity(run.scene, "stopping_time", path, span=None)
    slope = table.rows[0].derivative
    assert any(value == pytest.approx(slope, rel=1e-9) for value in there)


def test_scene_of_the_page_can_be_run_again(run, made):
    text = re.search("as it was run</summary><pre>(.*?)</pre>", made, re.S)[1]
    again = sb.files.scene_from_text(html.unescape(text))
    for a, b in zip(sb.files.leaves(run.scene), sb.files.leaves(again), strict=True):
        assert a.path == b.path
        all_equal(a.value, b.value)


def test_failures_and_faults(run):
    failed = sb.simulate(stop_scene(), max_events=2, throw=False)
    text = sb.report(failed, limits={"max_tension": 1e9})
    assert 'class="verdict red"' in text
    assert "event_limit" in text
    limits = {"max_tensoin": 1.0, "max_pressure": 1e5, "max_tension": math.nan}
    assert len(faults_of(sb.report, run, limits=limits, sensitivity=["nix"])) == 4


def test_command(capsys, tmp_path):
    file = tmp_path / "my_scene.py"
    program = '"""A stop by hand."""\nfrom scenes import stop_scene as scene\n'
    file.write_text(program)
    asked = ("report", str(file), "--no-check", "--json", "--out")
    limit = ("--limit", "max_tension=1")
    code, said, _ = call(capsys, *asked, str(tmp_path / "page.html"), *limit)
    said = json.loads(said)
    assert (code, said["status"]) == (0, "stopped")
    assert said["limits"][0]["verdict"] == "exceeded"
    assert "A stop by hand" in (tmp_path / "page.html").read_text("utf-8")
    wrong = ("--limit", "max_tension", "--sensitivity", "nix")
    code, _, err = call(capsys, *asked, str(tmp_path / "x.html"), *wrong)
    assert (code, "2 input errors" in err) == (2, True)
    assert not (tmp_path / "x.html").exists()
    assert call(capsys, *asked, str(tmp_path / "pages"))[0] == 0
    assert [page.name for page in (tmp_path / "pages").iterdir()] == ["my_scene.html"]
