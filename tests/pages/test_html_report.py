"""The report: one page that needs nothing else, whose numbers are those of the run."""

import base64
import hashlib
import html
import html.parser
import json
import math
import re

import numpy as np
import pytest
from commands import call
from heat_scenes import fading, rigid_stop
from stop_scenes import stop_scene

import simbrake as sb

VOID = {"meta", "img", "br", "wbr", "link", "hr", "input"}
NASTY = "<script>alert(1)</script>"


class Page(html.parser.HTMLParser):
    """Elements of a page; raises where tags do not match."""

    def __init__(self, text):
        super().__init__()
        self.open = []
        self.ids = []
        self.links = []
        self.values = []
        self.text = []
        self.tags = set()
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        self.tags.add(tag)
        self.ids += [found["id"]] if "id" in found else []
        self.links += [
            found[name]
            for name in ("href", "src", "srcset", "action", "data", "poster")
            if name in found
        ]
        self.values += [found["value"]] if tag == "data" else []
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)

    @property
    def words(self):
        return " ".join("".join(self.text).split())


@pytest.fixture(scope="module")
def run():
    return sb.simulate(stop_scene(load=300.0, T0=8e3), throw=True)


@pytest.fixture(scope="module")
def made(run, tmp_path_factory):
    """The page of a run with everything asked for, and its text."""
    path = tmp_path_factory.mktemp("report") / "run.html"
    limits = {"max_tension": 1e9, "max_normal_load": 10.0}
    title = f"A stop {NASTY} & more"
    files = {"notes.txt": f"# {NASTY}\n[brake]"}
    asked = {
        "sensitivity": ["stopping_time"],
        "span": {"initial.omega": "30 rpm"},
        "limits": limits,
        "title": title,
        "files": files,
    }
    text = sb.report(run, path, **asked)
    assert path.read_text("utf-8") == text
    return text


def hot_scene(permissible, name="lining"):
    """A stop with a lump of 20 kJ/K as linings: at rest it is `W0² J/2 / 20 kJ/K` = 8 K
    warmer."""
    bodies = (
        sb.thermal.Lump(name, 2e4, temperature=300.0),
        sb.thermal.Lump("rim", 1e5, temperature=300.0),
    )
    friction = sb.thermal.FrictionHeat("rim", name, sb.thermal.ConstantPartition(0.0))
    heat = sb.Heat(
        bodies, friction=friction, rim="rim", linings=name, permissible=permissible
    )
    return rigid_stop(fading(slope=1e-6), heat, end=4.0)


@pytest.fixture(scope="module")
def hot():
    return sb.simulate(hot_scene(304.0, NASTY))


def test_page_is_complete_in_itself(made):
    page = Page(made)
    assert made.startswith("<!DOCTYPE html>")
    assert {
        "html",
        "head",
        "title",
        "main",
        "nav",
        "figure",
        "figcaption",
        "table",
    } <= page.tags
    assert not page.tags & {"link", "iframe", "object", "embed"}
    assert len(page.ids) == len(set(page.ids))
    for link in page.links:
        assert link.startswith("data:image/") or (
            link[0] == "#" and link[1:] in page.ids
        )
    # scripts are the data of the page and those that its policy names by their hashes;
    # nothing else runs
    scripts = re.findall(r"<script>(.*?)</script>", made, re.S)
    hashes = re.search(r"script-src ((?:'sha256-[^']*' ?)+)\"", html.unescape(made))[
        1
    ].split()
    digests = [
        base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        for text in scripts
    ]
    assert hashes == [f"'sha256-{digest}'" for digest in digests]
    assert "default-src 'none'" in html.unescape(made)
    assert len(re.findall("<script", made)) == len(scripts) + 1 == 3
    style = re.findall(r"<style>(.*?)</style>", made, re.S)
    assert len(style) == 1
    assert not re.search(r"url\(|@import", style[0])


def test_numbers_of_the_page(run, made):
    page = Page(made)
    there = {float(x) for value in page.values for x in value.split(",")}
    found = [value for value in run.metrics.values() if value is not None]
    assert len(found) > 5
    assert set(found) <= there
    assert {
        abs(float(run.energy[name]))
        for name in ("load_work", "lever_work", "friction_heat")
    } <= there
    assert {event.time for event in run.events} <= there
    assert {800.0, 0.725, 2e5, 8e3, math.radians(13.5)} <= there
    assert f"{1e3 * run.metrics['slip_onset_time']:.3g} ms" in page.words  # for reading


def test_what_people_wrote_is_escaped(made, hot):
    for text in (made, sb.report(hot, check=False)):
        assert NASTY not in text
        assert "&lt;script&gt;alert(1)&lt;/script&gt;" in text
    assert "A stop &lt;script&gt;alert(1)&lt;/script&gt; &amp; more" in made


def test_sensitivities_only_if_asked(run, made):
    assert 'id="sensitivities"' in made
    slope = (
        sb.sensitivity(run.scene, "stopping_time", "brake.pulley.inertia", span=None)
        .rows[0]
        .derivative
    )
    assert any(
        float(v) == pytest.approx(slope, rel=1e-9)
        for v in Page(made).values
        if "," not in v
    )
    plain = sb.report(run, check=False)
    assert "ensitivities" not in plain


def test_scene_of_the_page_can_be_run_again(run, made):
    text = html.unescape(
        re.search(
            r"<summary>As a scene file, as it was run</summary><pre>(.*?)</pre>",
            made,
            re.S,
        ).group(1)
    )
    again = sb.files.scene_from_text(text)
    for a, b in zip(sb.files.leaves(run.scene), sb.files.leaves(again), strict=True):
        assert a.path == b.path
        np.testing.assert_array_equal(a.value, b.value)


def test_failure_is_shown_with_its_message():
    result = sb.simulate(stop_scene(), max_events=2, throw=False)
    text = sb.report(result, limits={"max_tension": 1e9})
    page = Page(text)
    assert 'class="verdict red"' in text
    assert "Failed: event_limit" in page.words


def test_all_faults_of_the_options_at_once(run):
    with pytest.raises(sb.InputError) as caught:
        sb.report(
            run,
            limits={"max_tensoin": 1.0, "max_pressure": 1e5, "max_tension": math.nan},
            sensitivity=["nix"],
        )
    assert len(caught.value.faults) == 4
    assert "max_tension" in str(caught.value)


def test_command(capsys, tmp_path):
    file = tmp_path / "my_scene.py"
    program = "from stop_scenes import stop_scene as scene\n"
    file.write_text('"""A stop by hand.\n\nMore."""\n' + program)
    out = tmp_path / "page.html"
    asked = ("report", str(file), "--no-check", "--json")
    code, said, _ = call(capsys, *asked, "--out", str(out), "--limit", "max_tension=1")
    said = json.loads(said)
    assert (code, said["status"], said["written"]) == (0, "stopped", str(out))
    assert said["limits"][0]["verdict"] == "exceeded"
    page = Page(out.read_text("utf-8"))
    assert "A stop by hand" in page.words
    assert "my_scene.py" in page.words
    code, _, err = call(
        capsys, *asked, "--limit", "max_tension", "--sensitivity", "nix"
    )
    assert (code, "2 input errors" in err) == (2, True)
    assert (
        call(capsys, *asked, "--out", str(tmp_path / "pages"))[0] == 0
    )  # a folder, as of every command
    assert [page.name for page in (tmp_path / "pages").iterdir()] == ["my_scene.html"]
    (tmp_path / "taken").touch()
    code, _, err = call(capsys, *asked, "--out", str(tmp_path / "taken"))
    assert (code, "is a file" in err) == (2, True)
